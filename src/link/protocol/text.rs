//! Texts of a peer on their way to a screen.

use crate::text::printable;

/// Longest part of a text that stands in a message (characters).
const LONGEST: usize = 60;

/// A text of a peer for a message: without blanks around it, short, and with nothing that a terminal would act on.
pub fn shown(text: &str) -> String {
    let text = text.trim();
    let short: String = text.chars().take(LONGEST).collect();
    let more = if short.len() < text.len() { "..." } else { "" };
    printable(&short) + more
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_shown_text_is_short_and_has_nothing_that_a_terminal_acts_on() {
        assert_eq!(shown(" a\u{1b}[31m\u{7f}b\u{9b}\u{202e}\r\n"), "a\u{fffd}[31m\u{fffd}b\u{fffd}\u{fffd}");
        assert_eq!(shown(&"\u{e4}".repeat(LONGEST)), "\u{e4}".repeat(LONGEST));
        assert_eq!(shown(&"\u{e4}".repeat(LONGEST + 1)), "\u{e4}".repeat(LONGEST) + "...");
    }
}
