//! Signs beyond ASCII, each with its ASCII form; and text that is safe to put on a terminal.

use unicode_width::{UnicodeWidthChar as _, UnicodeWidthStr as _};

use crate::text::printable;

/// Which characters the terminal can show. Decided once, at the start.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Glyphs {
    /// Everything: braille, blocks, arrows.
    #[default]
    Unicode,
    /// Half blocks instead of braille, for fonts without it.
    Blocks,
    /// ASCII only.
    Ascii,
}

impl Glyphs {
    const fn choose(self, unicode: &'static str, ascii: &'static str) -> &'static str {
        match self {
            Self::Unicode | Self::Blocks => unicode,
            Self::Ascii => ascii,
        }
    }

    /// A horizontal line.
    pub const fn rule(self) -> &'static str {
        self.choose("─", "-")
    }

    /// Between two things on one line.
    pub const fn dot(self) -> &'static str {
        self.choose(" · ", " | ")
    }

    /// The choice that has the focus.
    pub const fn pointer(self) -> &'static str {
        self.choose("▸ ", "> ")
    }

    /// Something is cut off.
    pub const fn ellipsis(self) -> &'static str {
        self.choose("…", "~")
    }

    /// A part of a bar that is done.
    pub const fn bar_done(self) -> &'static str {
        self.choose("█", "#")
    }

    /// A part of a bar that is left.
    pub const fn bar_left(self) -> &'static str {
        self.choose("░", ".")
    }

    /// The pose to go to.
    pub const fn next(self) -> &'static str {
        self.choose("◎", "@")
    }

    /// The reflector.
    pub const fn reflector(self) -> &'static str {
        self.choose("●", "O")
    }

    /// A point in doubt.
    pub const fn doubt(self) -> &'static str {
        self.choose("‼", "!")
    }

    /// The arrow keys.
    pub const fn arrows(self) -> &'static str {
        self.choose("←↑↓→", "arrows")
    }

    /// The arrow keys left and right.
    pub const fn sideways(self) -> &'static str {
        self.choose("←→", "Left/Right")
    }

    /// A text that this terminal can show: no control characters; without Unicode, nothing but ASCII.
    pub fn show(self, text: &str) -> String {
        let clean = printable(text);
        match self {
            Self::Unicode | Self::Blocks => clean,
            Self::Ascii => clean.chars().map(ascii).collect(),
        }
    }
}

/// What stands for a character on a terminal that has only ASCII.
fn ascii(c: char) -> String {
    match c {
        ' '..='~' => c.to_string(),
        'µ' | 'μ' => "u".to_owned(),
        '°' => "deg".to_owned(),
        'σ' => "sigma".to_owned(),
        'Δ' => "d".to_owned(),
        '±' => "+-".to_owned(),
        '–' | '—' | '−' => "-".to_owned(),
        '→' => "->".to_owned(),
        '…' => "~".to_owned(),
        '·' => "|".to_owned(),
        _ => "?".to_owned(),
    }
}

/// Columns that a text takes.
pub fn width(text: &str) -> usize {
    text.width()
}

/// The beginning of a text that fits into `room` columns, with a sign where something is missing.
pub fn shortened(text: &str, room: usize, glyphs: Glyphs) -> String {
    if width(text) <= room {
        return text.to_owned();
    }
    let Some(left) = room.checked_sub(1) else { return String::new() };
    let mut taken = 0;
    let begin: String = text
        .chars()
        .take_while(|c| {
            taken += c.width().unwrap_or(0);
            taken <= left
        })
        .collect();
    begin + glyphs.ellipsis()
}

/// A text in lines of at most `room` columns, broken at blanks; a word longer than a line is broken where it must be.
pub fn wrapped(text: &str, room: usize) -> Vec<String> {
    let mut lines = Vec::new();
    if room == 0 {
        return lines;
    }
    for paragraph in text.split('\n') {
        let mut line = String::new();
        for word in paragraph.split(' ') {
            let mut word = word.to_owned();
            if !line.is_empty() && width(&line) + 1 + width(&word) > room {
                lines.push(std::mem::take(&mut line));
            }
            while width(&word) > room {
                let (head, tail) = broken(&word, room);
                lines.push(head);
                word = tail;
            }
            if !line.is_empty() {
                line.push(' ');
            }
            line.push_str(&word);
        }
        lines.push(line);
    }
    lines
}

/// A word cut at `room` columns; at least one character goes into the head.
fn broken(word: &str, room: usize) -> (String, String) {
    let mut taken = 0;
    let count = word
        .chars()
        .take_while(|c| {
            taken += c.width().unwrap_or(0);
            taken <= room
        })
        .count()
        .max(1);
    (word.chars().take(count).collect(), word.chars().skip(count).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texts_keep_to_their_room() {
        assert_eq!(shortened("reflector", 5, Glyphs::Unicode), "refl…");
        assert_eq!(shortened("reflector", 9, Glyphs::Ascii), "reflector");
        assert_eq!(shortened("reflector", 0, Glyphs::Ascii), "");
        assert_eq!(shortened("漢字漢字", 4, Glyphs::Ascii), "漢~");
        assert_eq!(wrapped("move the robot", 8), ["move the", "robot"]);
        assert_eq!(wrapped("abcdefgh ij", 3), ["abc", "def", "gh", "ij"]);
        assert_eq!(wrapped("a\n\nb", 3), ["a", "", "b"]);
        assert!(wrapped("a", 0).is_empty());
    }

    #[test]
    fn without_unicode_only_ascii_comes_out() {
        let text = Glyphs::Ascii.show("Δd = 3 µm ± 0.1° \u{1b}[31m");
        assert!(text.is_ascii() && !text.contains('\u{1b}'), "{text}");
        assert_eq!(Glyphs::Unicode.show("a\u{7}b"), "a\u{fffd}b");
    }
}
