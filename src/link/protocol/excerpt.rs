//! Received text in messages.

use crate::text::{printable, shortened};

/// Most terminal columns of a received text in a message.
const LONGEST: usize = 60;

/// Received text as it is quoted in a message: trimmed, printable and shortened.
pub(super) fn excerpt(text: &str) -> String {
    shortened(&printable(text.trim()), LONGEST)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_excerpt_is_short_and_has_nothing_that_a_terminal_acts_on() {
        assert_eq!(excerpt(" a\u{1b}[31m\u{7f}b\u{9b}\u{202e}\r\n"), "a\u{fffd}[31m\u{fffd}b\u{fffd}\u{fffd}");
        assert_eq!(excerpt(&"\u{e4}".repeat(LONGEST)), "\u{e4}".repeat(LONGEST));
        assert_eq!(excerpt(&"\u{e4}".repeat(LONGEST + 1)), "\u{e4}".repeat(LONGEST - 1) + "\u{2026}");
    }
}
