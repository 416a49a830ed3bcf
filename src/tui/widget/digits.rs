//! Large numbers, three lines high, that can be read from two metres.

use ratatui::buffer::Buffer;
use ratatui::layout::Rect;
use ratatui::style::Style;

use crate::tui::glyphs::Glyphs;
use crate::tui::paint;

/// Lines of a number.
pub const HEIGHT: u16 = 3;

/// Half blocks: five dots high, three wide.
const BLOCKS: [[&str; 3]; 10] = [
    ["█▀█", "█ █", "▀▀▀"],
    ["▄█ ", " █ ", "▀▀▀"],
    ["▀▀█", "█▀▀", "▀▀▀"],
    ["▀▀█", "▀▀█", "▀▀▀"],
    ["█ █", "▀▀█", "  ▀"],
    ["█▀▀", "▀▀█", "▀▀▀"],
    ["█▀▀", "█▀█", "▀▀▀"],
    ["▀▀█", "  █", "  ▀"],
    ["█▀█", "█▀█", "▀▀▀"],
    ["█▀█", "▀▀█", "▀▀▀"],
];

/// Seven segments in ASCII.
const SEGMENTS: [[&str; 3]; 10] = [
    [" _ ", "| |", "|_|"],
    ["   ", "  |", "  |"],
    [" _ ", " _|", "|_ "],
    [" _ ", " _|", " _|"],
    ["   ", "|_|", "  |"],
    [" _ ", "|_ ", " _|"],
    [" _ ", "|_ ", "|_|"],
    [" _ ", "  |", "  |"],
    [" _ ", "|_|", "|_|"],
    [" _ ", "|_|", " _|"],
];

/// The three lines of a character.
fn shape(c: char, glyphs: Glyphs) -> [&'static str; 3] {
    let digits = if glyphs == Glyphs::Ascii { &SEGMENTS } else { &BLOCKS };
    let digit = c.to_digit(10).and_then(|digit| usize::try_from(digit).ok());
    match (digit.and_then(|digit| digits.get(digit)), c, glyphs) {
        (Some(lines), _, _) => *lines,
        (None, '-', Glyphs::Ascii) => ["   ", " _ ", "   "],
        (None, '-', _) => ["   ", "▀▀▀", "   "],
        (None, '.', Glyphs::Ascii) => [" ", " ", "."],
        (None, '.', _) => [" ", " ", "▀"],
        _ => ["   ", "   ", "   "],
    }
}

/// Columns of a number.
pub fn columns(text: &str) -> u16 {
    let wide: usize = text.chars().map(|c| if c == '.' { 2 } else { 4 }).sum();
    u16::try_from(wide.saturating_sub(1)).unwrap_or(u16::MAX)
}

/// Draws a number: digits, point and minus.
pub fn draw(text: &str, glyphs: Glyphs, style: Style, area: Rect, buf: &mut Buffer) {
    let mut column = 0;
    for c in text.chars() {
        let mut end = column;
        for (row, line) in (0_u16..).zip(shape(c, glyphs)) {
            end = end.max(paint::text(buf, area, (column, row), line, style));
        }
        column = end.saturating_add(1);
    }
}
