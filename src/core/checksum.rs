//! Check sums inside files of text, which tell a file that has changed since this program wrote it.
//!
//! A sum finds accidents: a digit that was struck in an editor, a disk or a transfer that lost a part. It does not prove who wrote a
//! file. The sum is a line of its own, in the form in which the format writes comments:
//!
//! ```text
//! // trupose-check:9f2c…            .ron          # trupose-check:9f2c…          .csv
//! "check": "trupose-check:9f2c…",   .json         <!-- trupose-check:9f2c… -->   .html
//! ```
//!
//! It covers every other line, without blanks at their ends, so that another kind of line break, a byte order mark or an empty line
//! at the end is no change.

use std::ops::Range;

use sha2::{Digest as _, Sha256};

/// What the line of the sum contains, before the digits.
const MARK: &str = "trupose-check:";
/// Digits of the sum, in hexadecimal.
const DIGITS: usize = 32;
/// Lines at the beginning among which the sum is searched. Another file may be quoted further down, with a sum of its own.
const HEAD: usize = 12;

/// How a format writes the line of the sum.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Syntax {
    Ron,
    Csv,
    Json,
    Html,
}

impl Syntax {
    const ALL: [Self; 4] = [Self::Ron, Self::Csv, Self::Json, Self::Html];

    /// The line of the sum, without a line break.
    fn line(self, sum: &str) -> String {
        match self {
            Self::Ron => format!("// {MARK}{sum}"),
            Self::Csv => format!("# {MARK}{sum}"),
            Self::Json => format!("  \"check\": \"{MARK}{sum}\","),
            Self::Html => format!("<!-- {MARK}{sum} -->"),
        }
    }
}

/// What the sum of a file says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Finding {
    /// The content is as it was written.
    Intact,
    /// The content, or the sum, has changed since.
    Changed,
    /// There is no sum.
    Missing,
}

/// Adds the line of the sum to a text: after the first line, in a table after its comments.
pub fn with_sum(text: &str, syntax: Syntax) -> String {
    let line = syntax.line(&sum(text)) + "\n";
    let before = match syntax {
        Syntax::Csv => text.split_inclusive('\n').take_while(|line| line.starts_with('#')).map(str::len).sum(),
        Syntax::Ron | Syntax::Json | Syntax::Html => text.find('\n').map_or(text.len(), |end| end + 1),
    };
    let (head, rest) = text.split_at(before);
    [head, &line, rest].concat()
}

/// Compares a text with its sum.
pub fn check(text: &str) -> Finding {
    let Some(line) = text.lines().take(HEAD).find(|line| line.contains(MARK)) else { return Finding::Missing };
    let sum = sum(text);
    let line = line.trim_start_matches('\u{feff}').trim_end();
    if Syntax::ALL.iter().any(|syntax| syntax.line(&sum) == line) { Finding::Intact } else { Finding::Changed }
}

/// Place of the line of the sum in a text, in bytes.
pub fn place(text: &str) -> Option<Range<usize>> {
    let start: usize =
        text.split_inclusive('\n').take(HEAD).take_while(|line| !line.contains(MARK)).map(str::len).sum();
    let line = text.get(start..)?.lines().next().filter(|line| line.contains(MARK))?;
    Some(start..start + line.len())
}

/// The sum of a text, whether it has the line of a sum or not.
pub fn sum(text: &str) -> String {
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let own = text.lines().take(HEAD).position(|line| line.contains(MARK));
    let mut lines: Vec<&str> =
        text.lines().enumerate().filter(|(index, _)| Some(*index) != own).map(|(_, line)| line.trim_end()).collect();
    while lines.last().is_some_and(|line| line.is_empty()) {
        lines.pop();
    }
    let mut digest = Sha256::new();
    for line in lines {
        digest.update(line);
        digest.update("\n");
    }
    digest.finalize().iter().take(DIGITS / 2).map(|byte| format!("{byte:02x}")).collect::<Vec<_>>().concat()
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXTS: [(Syntax, &str); 4] = [
        (Syntax::Ron, "// A calibration.\n(\n    a: 1.5,\n)\n"),
        (Syntax::Csv, "# SIMULATED\npose,x_mm\n1,2.5\n"),
        (Syntax::Json, "{\n  \"a\": 1.5\n}\n"),
        (Syntax::Html, "<!DOCTYPE html>\n<p>1.5\n"),
    ];

    #[test]
    fn every_digit_and_every_line_counts() {
        for (syntax, text) in TEXTS {
            let written = with_sum(text, syntax);
            assert_eq!(check(&written), Finding::Intact, "{written}");
            assert_eq!(sum(&written), sum(text));
            assert_eq!(check(text), Finding::Missing);
            for (at, digit) in written.char_indices().filter(|(_, c)| c.is_ascii_hexdigit()) {
                let other = if digit == '7' { "8" } else { "7" };
                let mut changed = written.clone();
                changed.replace_range(at..=at, other);
                let expected = if changed.contains(MARK) { Finding::Changed } else { Finding::Missing };
                assert_eq!(check(&changed), expected, "{changed}");
            }
            let mut cut: Vec<&str> = written.lines().collect();
            cut.pop();
            assert_eq!(check(&cut.join("\n")), Finding::Changed);
        }
    }

    #[test]
    fn an_editor_that_saves_the_same_lines_changes_nothing() {
        for (syntax, text) in TEXTS {
            let written = with_sum(text, syntax);
            let bom = format!("\u{feff}{written}");
            let blanks = written.replace('\n', "  \n") + "\n\n";
            for saved in [written.replace('\n', "\r\n"), written.trim_end().to_owned(), bom, blanks] {
                assert_eq!(check(&saved), Finding::Intact, "{saved:?}");
            }
        }
    }

    #[test]
    fn a_file_quoted_inside_keeps_its_own_sum() {
        let quoted = with_sum("// A profile.\n(name: \"x\")\n", Syntax::Ron);
        let text = format!("// A calibration.\n(\n{}    profile: r#\"{quoted}\"#,\n)\n", "    a: 1,\n".repeat(HEAD));
        let written = with_sum(&text, Syntax::Ron);
        assert_eq!(check(&written), Finding::Intact);
        assert_eq!(check(&written.replace("name: \"x\"", "name: \"y\"")), Finding::Changed);
        assert_eq!(check(&text), Finding::Missing);
    }
}
