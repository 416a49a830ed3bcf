//! Words for people: plain functions on text, used by every module that writes messages.
//!
//! Columns are those of a terminal: a wide character takes two, a combining mark none.

#![warn(missing_docs)]

mod names;

use std::borrow::Borrow;
use std::error::Error;

use unicode_width::{UnicodeWidthChar as _, UnicodeWidthStr as _};

pub use crate::{names, names_of_option, written_as_text};
pub use names::UnknownName;

/// Marks a place where text was cut off.
pub const ELLIPSIS: char = '…';

/// Whether a character keeps its place in a terminal line: no control character, and no invisible one that reorders text.
pub fn is_printable(character: char) -> bool {
    let reorders =
        matches!(character, '\u{200b}'..='\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2066}'..='\u{2069}' | '\u{feff}');
    !character.is_control() && !reorders
}

/// Text from outside made safe for a terminal: characters that are not [printable](is_printable) become U+FFFD.
pub fn printable(text: &str) -> String {
    text.chars().map(|c| if is_printable(c) { c } else { char::REPLACEMENT_CHARACTER }).collect()
}

/// Number of terminal columns that a text takes.
pub fn columns(text: &str) -> usize {
    text.width()
}

/// The beginning of a text, at most `most` columns wide, with an ellipsis where something was cut off.
pub fn shortened(text: &str, most: usize) -> String {
    if columns(text) <= most {
        return text.to_owned();
    }
    let Some(room) = most.checked_sub(1) else { return String::new() };
    let (mut head, _) = split_at_column(text, room);
    head.push(ELLIPSIS);
    head
}

/// Lines of at most `width` columns, broken at blanks. Line breaks in the text stay; a word wider than a line is cut.
pub fn wrapped(text: &str, width: usize) -> Vec<String> {
    let mut lines = Vec::new();
    if width == 0 {
        return lines;
    }
    for paragraph in text.split('\n') {
        let mut line = String::new();
        for word in paragraph.split(' ') {
            let mut word = word.to_owned();
            if !line.is_empty() && columns(&line) + 1 + columns(&word) > width {
                lines.push(std::mem::take(&mut line));
            }
            while columns(&word) > width {
                let (head, tail) = split_at_column(&word, width);
                if head.is_empty() {
                    // A wide character in a single column fits nowhere: it stays whole.
                    break;
                }
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

/// The part of a text that fits into `most` columns, and the rest.
fn split_at_column(text: &str, most: usize) -> (String, String) {
    let mut taken = 0;
    let fits = |c: &char| {
        taken += c.width().unwrap_or(0);
        taken <= most
    };
    let head: String = text.chars().take_while(fits).collect();
    let tail = text.chars().skip(head.chars().count()).collect();
    (head, tail)
}

/// `1 sample`, `3 samples`: a count with its noun, for nouns whose plural ends in *s*.
pub fn counted(count: usize, noun: &str) -> String {
    if count == 1 { format!("1 {noun}") } else { format!("{count} {noun}s") }
}

/// `1 axis`, `3 axes`: a count with the form of the noun that fits it.
pub fn counted_as(count: usize, one: &str, many: &str) -> String {
    format!("{count} {}", if count == 1 { one } else { many })
}

/// `a, b and c`.
pub fn listed<S: Borrow<str>>(items: &[S]) -> String {
    joined(items, "and")
}

/// `a, b or c`.
pub fn alternatives<S: Borrow<str>>(items: &[S]) -> String {
    joined(items, "or")
}

fn joined<S: Borrow<str>>(items: &[S], last_word: &str) -> String {
    match items.split_last() {
        None => String::new(),
        Some((only, [])) => only.borrow().to_owned(),
        Some((last, rest)) => format!("{} {last_word} {}", rest.join(", "), last.borrow()),
    }
}

/// A number with fixed decimals, without the sign of a rounded zero.
pub fn decimal(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    let is_zero = text.bytes().all(|byte| matches!(byte, b'-' | b'0' | b'.'));
    if is_zero { text.trim_start_matches('-').to_owned() } else { text }
}

/// As [`decimal`], but with an exponent above 1e9, so that it fits into a column.
pub fn fixed(value: f64, decimals: usize) -> String {
    if value.abs() > 1e9 { format!("{value:.3e}") } else { decimal(value, decimals) }
}

/// Decimals that show two significant digits of an uncertainty, from 1 to 6.
pub fn decimals_for(sigma: f64) -> usize {
    (1..=6_u8).find(|&decimals| sigma * 10_f64.powi(i32::from(decimals)) >= 9.95).map_or(6, usize::from)
}

/// An error and everything that caused it, joined by colons.
pub fn causes(error: &dyn Error) -> String {
    let mut text = error.to_string();
    let mut source = error.source();
    while let Some(cause) = source {
        text = format!("{text}: {cause}");
        source = cause.source();
    }
    text
}

/// The allowed name that `given` most likely means, if one is close enough to suggest.
pub fn near_miss<'n>(given: &str, allowed: &[&'n str]) -> Option<&'n str> {
    // Names are short; a hostile one is not compared at length.
    const LONGEST_COMPARED: usize = 64;
    let given: String = given.chars().take(LONGEST_COMPARED).collect::<String>().to_ascii_lowercase();
    let distance = |name: &str| strsim::levenshtein(&given, &name.to_ascii_lowercase());
    let (distance, name) = allowed.iter().map(|name| (distance(name), *name)).min()?;
    (distance * 2 <= name.chars().count()).then_some(name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn control_characters_and_reordering_marks_are_replaced() {
        assert_eq!(printable("a\u{1b}[31mb\u{202e}c µ°"), "a\u{fffd}[31mb\u{fffd}c µ°");
    }

    #[test]
    fn shortened_text_keeps_to_its_columns() {
        for (text, most, expected) in
            [("pose", 4, "pose"), ("poses", 4, "pos…"), ("表示", 3, "表…"), ("表示", 2, "…"), ("abc", 0, "")]
        {
            assert_eq!(shortened(text, most), expected);
            assert!(columns(&shortened(text, most)) <= most);
        }
    }

    #[test]
    fn lines_break_at_blanks_and_long_words_are_cut() {
        assert_eq!(wrapped("one two three", 7), ["one two", "three"]);
        assert_eq!(wrapped("a\n\nb", 5), ["a", "", "b"]);
        assert_eq!(wrapped("unbreakable", 4), ["unbr", "eaka", "ble"]);
        assert_eq!(wrapped("表", 1), ["表"]);
        assert!(wrapped("x", 0).is_empty());
    }

    #[test]
    fn counts_and_lists_read_as_english() {
        assert_eq!(counted(1, "sample"), "1 sample");
        assert_eq!(counted(0, "sample"), "0 samples");
        assert_eq!(counted_as(2, "axis", "axes"), "2 axes");
        assert_eq!(listed::<&str>(&[]), "");
        assert_eq!(listed(&["a"]), "a");
        assert_eq!(listed(&["a", "b", "c"]), "a, b and c");
        assert_eq!(alternatives(&["a".to_owned(), "b".to_owned()]), "a or b");
    }

    #[test]
    fn near_misses_are_suggested_and_far_ones_are_not() {
        assert_eq!(near_miss("jonits", &["joints", "base"]), Some("joints"));
        assert_eq!(near_miss("BASE", &["joints", "base"]), Some("base"));
        assert_eq!(near_miss("speed", &["joints", "base"]), None);
        assert_eq!(near_miss("x", &[]), None);
        assert_eq!(near_miss(&"long".repeat(10_000), &["joints"]), None);
    }

    #[test]
    fn two_digits_of_the_uncertainty_are_shown() {
        let shown = [12.0, 1.2, 0.12, 0.012, 0.0995, 0.000_001, 0.0].map(decimals_for);
        assert_eq!(shown, [1, 1, 2, 3, 2, 6, 6]);
    }

    #[test]
    fn zero_has_no_sign() {
        assert_eq!(fixed(-0.0004, 3), "0.000");
        assert_eq!(fixed(-0.0006, 3), "-0.001");
        assert_eq!(fixed(-1e308, 3), "-1.000e308");
    }

    #[test]
    fn an_error_is_printed_with_its_causes() {
        let error = std::io::Error::other(std::fmt::Error);
        assert_eq!(causes(&error), error.to_string());
    }
}
