//! Numbers and paragraphs laid out for 80 columns.

use crate::text::printable;

/// Width of a report.
pub(super) const WIDTH: usize = 80;

/// Numbers beyond this are shown with an exponent.
const LARGE: f64 = 1e9;

/// A number with fixed decimals; no negative zero, and an exponent above 1e9.
pub fn fixed(value: f64, decimals: usize) -> String {
    if value.abs() > LARGE {
        return format!("{value:.3e}");
    }
    let text = format!("{value:.decimals$}");
    let is_zero = text.chars().all(|c| matches!(c, '-' | '0' | '.'));
    if is_zero { text.trim_start_matches('-').to_owned() } else { text }
}

/// Decimals that show two significant digits of an uncertainty, between 1 and 6.
pub(super) fn decimals_for(sigma: f64) -> usize {
    (1..=6)
        .find(|&decimals| sigma * 10_f64.powi(decimals) >= 9.95)
        .map_or(6, |decimals| decimals.unsigned_abs() as usize)
}

/// Adds a line with its line break.
pub(super) fn push_line(text: &mut String, line: &str) {
    text.push_str(&printable(line));
    text.push('\n');
}

/// Breaks a paragraph into lines; the first begins with `first`, the others with as many blanks.
pub(super) fn paragraph(first: &str, text: &str) -> String {
    let indent = " ".repeat(first.chars().count());
    let mut lines = Vec::new();
    let mut line = first.to_owned();
    let mut empty = true;
    for word in text.split_whitespace() {
        if !empty && line.chars().count() + 1 + word.chars().count() > WIDTH {
            lines.push(std::mem::replace(&mut line, indent.clone()));
            empty = true;
        }
        if !empty {
            line.push(' ');
        }
        line.push_str(&printable(word));
        empty = false;
    }
    lines.push(line);
    lines.join("\n") + "\n"
}

#[cfg(test)]
mod tests {
    use super::*;

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
    fn paragraphs_hang_below_their_mark() {
        let text = paragraph("  - ", &"word ".repeat(20));
        assert!(text.lines().all(|line| line.chars().count() <= WIDTH));
        assert!(text.lines().nth(1).unwrap().starts_with("    word"));
    }
}
