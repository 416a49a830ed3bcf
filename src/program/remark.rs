//! Remarks that are put into an existing program, as the language writes them.

use super::Dialect;
use super::lexer::{BYTE_ORDER_MARK, latin, line_end, lines, with_line_feeds};
use super::names::ascii;

/// How a language writes a remark in a line of its own.
#[derive(Clone, Copy, Debug)]
pub(super) struct Remark {
    pub(super) before: &'static str,
    pub(super) after: &'static str,
    /// Longest text (characters).
    pub(super) longest: usize,
    /// First words of the line behind which it is put.
    pub(super) behind: &'static [&'static str],
    /// Whether it may be the first line of a file that has no such line.
    pub(super) may_be_first: bool,
    /// Beginning of files of this language that have no remarks.
    pub(super) never_in: &'static [u8],
}

impl Remark {
    pub(super) const fn new(before: &'static str, behind: &'static [&'static str]) -> Self {
        Self { before, after: "", longest: 72, behind, may_be_first: true, never_in: b"" }
    }
}

/// Puts a remark near the beginning of a program; `None` if the file has no place for one. Texts that are too long for the language
/// end early.
pub fn with_remark(dialect: Dialect, program: &[u8], text: &str) -> Option<Vec<u8>> {
    let remark = dialect.language().remark;
    let start = if program.starts_with(BYTE_ORDER_MARK) { BYTE_ORDER_MARK.len() } else { 0 };
    let first = program.get(start..).unwrap_or_default().trim_ascii_start().first().copied();
    if first.is_some_and(|first| remark.never_in.contains(&first)) {
        return None;
    }
    let is_place = |line: &[u8]| {
        let line = latin(line);
        let mut words = line.split_whitespace().filter(|word| !word.eq_ignore_ascii_case("GLOBAL"));
        let word = words.next().unwrap_or_default();
        remark.behind.iter().any(|wanted| word.eq_ignore_ascii_case(wanted))
    };
    let read = with_line_feeds(program);
    let place =
        lines(&read).map(|(_, place)| place).find(|place| is_place(program.get(place.clone()).unwrap_or_default()));
    let at = match place {
        Some(line) => (line.end + 1).min(program.len()),
        None if remark.may_be_first => start,
        None => return None,
    };
    let line_end = line_end(program);
    let text: String = ascii_text(text).chars().take(remark.longest).collect();
    let (before, behind) = program.split_at_checked(at)?;
    let mut result = before.to_vec();
    if at > start && !before.ends_with(line_end.as_bytes()) {
        result.extend_from_slice(line_end.as_bytes());
    }
    result.extend_from_slice(format!("{}{text}{}{line_end}", remark.before, remark.after).as_bytes());
    result.extend_from_slice(behind);
    Some(result)
}

/// Printable ASCII that ends no remark.
fn ascii_text(text: &str) -> String {
    text.replace("--", "-").split(' ').map(ascii).collect::<Vec<_>>().join(" ")
}
