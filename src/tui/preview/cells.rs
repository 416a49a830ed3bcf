//! Characters for cells of 2 × 4 dots: braille, half blocks or ASCII.

use super::raster::CellDots;
use crate::tui::glyphs::Glyphs;

/// Braille dot of each place (2·row + column), Unicode chapter 21.1.
const BRAILLE: [u32; 8] = [0x01, 0x08, 0x02, 0x10, 0x04, 0x20, 0x40, 0x80];
/// Half blocks: none, upper, lower, both.
const HALVES: [char; 4] = [' ', '▀', '▄', '█'];
/// Fill of a solid, from dark to bright.
const RAMP: [char; 6] = ['.', ':', '-', '=', '+', '%'];

/// Shapes of characters: rows from the top, each with its left and right dot.
const SHAPES: [(char, [u8; 4]); 27] = [
    ('\'', [0b10, 0b10, 0b00, 0b00]),
    ('\'', [0b01, 0b01, 0b00, 0b00]),
    ('\'', [0b10, 0b00, 0b00, 0b00]),
    ('\'', [0b01, 0b00, 0b00, 0b00]),
    ('"', [0b11, 0b00, 0b00, 0b00]),
    ('-', [0b00, 0b11, 0b00, 0b00]),
    ('-', [0b00, 0b00, 0b11, 0b00]),
    ('-', [0b00, 0b10, 0b01, 0b00]),
    ('-', [0b00, 0b01, 0b10, 0b00]),
    ('_', [0b00, 0b00, 0b00, 0b11]),
    ('.', [0b00, 0b00, 0b00, 0b10]),
    ('.', [0b00, 0b00, 0b00, 0b01]),
    ('.', [0b00, 0b00, 0b10, 0b10]),
    ('.', [0b00, 0b00, 0b01, 0b01]),
    ('.', [0b00, 0b00, 0b01, 0b10]),
    ('.', [0b00, 0b00, 0b10, 0b01]),
    ('|', [0b10, 0b10, 0b10, 0b10]),
    ('|', [0b01, 0b01, 0b01, 0b01]),
    ('|', [0b11, 0b11, 0b11, 0b11]),
    ('/', [0b01, 0b01, 0b10, 0b10]),
    ('/', [0b01, 0b10, 0b10, 0b10]),
    ('/', [0b01, 0b01, 0b01, 0b10]),
    ('\\', [0b10, 0b10, 0b01, 0b01]),
    ('\\', [0b10, 0b01, 0b01, 0b01]),
    ('\\', [0b10, 0b10, 0b10, 0b01]),
    ('=', [0b11, 0b00, 0b11, 0b00]),
    ('#', [0b11, 0b11, 0b11, 0b01]),
];

/// The character for a cell; `None` if no dot is lit.
pub(super) fn character(cell: CellDots, glyphs: Glyphs) -> Option<char> {
    match glyphs {
        Glyphs::Unicode => braille(cell.lit),
        Glyphs::Blocks => half_block(cell.lit),
        Glyphs::Ascii => ascii(cell),
    }
}

fn braille(lit: u8) -> Option<char> {
    let pattern: u32 = BRAILLE.iter().enumerate().filter(|(place, _)| lit >> place & 1 == 1).map(|(_, dot)| dot).sum();
    (lit != 0).then(|| char::from_u32(0x2800 + pattern)).flatten()
}

/// A half is filled when two of its four dots are lit.
fn half_block(lit: u8) -> Option<char> {
    let upper = usize::from((lit & 0x0f).count_ones() >= 2);
    let lower = usize::from((lit >> 4).count_ones() >= 2);
    HALVES.get(upper + 2 * lower).copied().filter(|c| *c != ' ')
}

/// The character for lines and outlines by shape, for the inside of solids by brightness.
fn ascii(cell: CellDots) -> Option<char> {
    if cell.lines == 0 {
        let level = cell.tone as usize * RAMP.len() / 121;
        return (cell.tone > 0).then(|| RAMP.get(level).copied()).flatten();
    }
    SHAPES.iter().min_by_key(|(_, rows)| (pattern(*rows) ^ cell.lines).count_ones()).map(|(c, _)| *c)
}

/// Rows as bits 2·row + column.
fn pattern(rows: [u8; 4]) -> u8 {
    rows.iter().enumerate().map(|(row, dots)| (((dots >> 1) & 1) | ((dots & 1) << 1)) << (2 * row)).sum()
}

#[cfg(test)]
mod tests {
    use super::super::raster::Material;
    use super::*;

    fn cell(rows: [u8; 4]) -> CellDots {
        let lit = pattern(rows);
        CellDots { lit, lines: lit, tone: 0, material: Material::Floor }
    }

    #[test]
    fn each_kind_of_character_has_the_shape() {
        let slash = cell([0b01, 0b01, 0b10, 0b10]);
        assert_eq!(character(slash, Glyphs::Unicode), Some('⡜'));
        assert_eq!(character(slash, Glyphs::Blocks), Some('█'));
        assert_eq!(character(slash, Glyphs::Ascii), Some('/'));
        let top = cell([0b11, 0b00, 0b00, 0b00]);
        let all = [Glyphs::Unicode, Glyphs::Blocks, Glyphs::Ascii].map(|glyphs| character(top, glyphs));
        assert_eq!(all, [Some('⠉'), Some('▀'), Some('"')]);
    }

    #[test]
    fn nothing_lit_is_nothing_and_ascii_is_ascii() {
        for lit in 0..=u8::MAX {
            let dots = CellDots { lit, lines: lit, tone: 0, material: Material::Floor };
            for glyphs in [Glyphs::Unicode, Glyphs::Ascii] {
                assert_eq!(character(dots, glyphs).is_none(), lit == 0, "{lit}");
            }
            assert!(character(dots, Glyphs::Ascii).is_none_or(|c| c.is_ascii_graphic()));
        }
        let inside = |tone| character(CellDots { lit: 1, lines: 0, tone, material: Material::Nominal }, Glyphs::Ascii);
        assert_eq!([inside(1), inside(120)], [Some('.'), Some('%')]);
    }
}
