//! Symbols beyond ASCII with their ASCII forms, and text that is safe to print on a terminal.

use crate::text;

/// Characters that the terminal can show. Decided once, at the start.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Glyphs {
    /// Everything: braille, blocks, arrows.
    #[default]
    Unicode,
    /// Half blocks instead of braille, for fonts without it.
    Blocks,
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

    /// Separator between two items on one line.
    pub const fn dot(self) -> &'static str {
        self.choose(" · ", " | ")
    }

    /// Marks the choice that has the focus.
    pub const fn pointer(self) -> &'static str {
        self.choose("▸ ", "> ")
    }

    /// Marks text that is cut off.
    pub const fn ellipsis(self) -> &'static str {
        self.choose("…", "~")
    }

    /// Completed part of a bar.
    pub const fn bar_done(self) -> &'static str {
        self.choose("█", "#")
    }

    /// Remaining part of a bar.
    pub const fn bar_left(self) -> &'static str {
        self.choose("░", ".")
    }

    /// Marks the pose to go to.
    pub const fn next(self) -> &'static str {
        self.choose("◎", "@")
    }

    /// Marks the reflector.
    pub const fn reflector(self) -> &'static str {
        self.choose("●", "O")
    }

    /// Marks a point in doubt.
    pub const fn doubt(self) -> &'static str {
        self.choose("‼", "!")
    }

    /// Name of the four arrow keys.
    pub const fn arrows(self) -> &'static str {
        self.choose("←↑↓→", "arrows")
    }

    /// Name of the arrow keys left and right.
    pub const fn sideways(self) -> &'static str {
        self.choose("←→", "Left/Right")
    }

    /// A text that this terminal can show: without control characters, and pure ASCII if there is no Unicode.
    pub fn show(self, text: &str) -> String {
        let clean = text::printable(text);
        match self {
            Self::Unicode | Self::Blocks => clean,
            Self::Ascii => clean.chars().map(ascii).collect(),
        }
    }
}

/// ASCII replacement of a character.
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

/// The beginning of a text that fits into `columns`, with the ellipsis of these glyphs where something is cut off.
pub fn shortened(text: &str, columns: usize, glyphs: Glyphs) -> String {
    text::shortened(text, columns).replace(text::ELLIPSIS, glyphs.ellipsis())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shortened_texts_keep_to_their_columns() {
        assert_eq!(shortened("reflector", 5, Glyphs::Unicode), "refl…");
        assert_eq!(shortened("reflector", 9, Glyphs::Ascii), "reflector");
        assert_eq!(shortened("reflector", 0, Glyphs::Ascii), "");
        assert_eq!(shortened("漢字漢字", 4, Glyphs::Ascii), "漢~");
    }

    #[test]
    fn without_unicode_only_ascii_comes_out() {
        let text = Glyphs::Ascii.show("Δd = 3 µm ± 0.1° \u{1b}[31m");
        assert!(text.is_ascii() && !text.contains('\u{1b}'), "{text}");
        assert_eq!(Glyphs::Unicode.show("a\u{7}b"), "a\u{fffd}b");
    }
}
