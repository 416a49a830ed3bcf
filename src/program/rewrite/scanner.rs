//! Small tools to look through program texts without changing the place of anything.

use std::ops::Range;

/// A text in which comments and quoted texts are blanks, byte for byte as long as the program. Bytes beyond ASCII are `?`.
pub(super) fn masked(program: &[u8], comment: &str, block: Option<(&str, &str)>, hides_quotes: bool) -> String {
    let mut text = String::with_capacity(program.len());
    let mut at = 0;
    let starts = |at: usize, mark: &str| {
        !mark.is_empty() && program.get(at..).is_some_and(|rest| rest.starts_with(mark.as_bytes()))
    };
    while let Some(byte) = program.get(at).copied() {
        let hidden = if let Some((_, end)) = block.filter(|(begin, _)| starts(at, begin)) {
            let length =
                (at..program.len()).find(|place| starts(*place, end)).map_or(program.len(), |place| place + end.len());
            length - at
        } else if starts(at, comment) {
            length_until(program, at, |byte| byte == b'\n')
        } else if hides_quotes && byte == b'"' {
            let inside = length_until(program, at + 1, |byte| byte == b'"' || byte == b'\n');
            inside + 2
        } else {
            0
        };
        if hidden == 0 {
            text.push(if byte.is_ascii() { char::from(byte) } else { '?' });
            at += 1;
            continue;
        }
        let end = (at + hidden).min(program.len());
        for byte in program.get(at..end).unwrap_or_default() {
            text.push(if *byte == b'\n' { '\n' } else { ' ' });
        }
        at = end;
    }
    text
}

fn length_until(program: &[u8], from: usize, is_end: impl Fn(u8) -> bool) -> usize {
    program.get(from..).map_or(0, |rest| rest.iter().position(|byte| is_end(*byte)).unwrap_or(rest.len()))
}

/// The line of a place, from 1.
pub(super) fn line_of(text: &str, at: usize) -> usize {
    text.bytes().take(at).filter(|byte| *byte == b'\n').count() + 1
}

/// The part of a text; empty beyond its end.
pub(super) fn part(text: &str, range: Range<usize>) -> &str {
    text.get(range).unwrap_or_default()
}

/// Places of the items between `open` (at `at`) and the first `close`, split at commas, without blanks around them; and the
/// place behind `close`.
pub(super) fn items(text: &str, at: usize, open: char, close: char) -> Option<(Vec<Range<usize>>, usize)> {
    let rest = text.get(at..)?;
    let inside = rest.strip_prefix(open)?;
    let length = inside.find(close)?;
    let (start, end) = (at + open.len_utf8(), at + open.len_utf8() + length);
    let mut items = Vec::new();
    let mut from = start;
    for item in part(text, start..end).split(',') {
        let lead = item.len() - item.trim_start().len();
        items.push(from + lead..from + lead + item.trim().len());
        from += item.len() + 1;
    }
    Some((items, end + close.len_utf8()))
}

/// Whether all of these places hold plain numbers.
pub(super) fn are_numbers(text: &str, items: &[Range<usize>]) -> bool {
    items.iter().all(|item| part(text, item.clone()).parse::<f64>().is_ok_and(f64::is_finite))
}

/// The first place at or behind `at` that is neither blank nor line end.
pub(super) fn after_blanks(text: &str, at: usize) -> usize {
    let rest = text.get(at..).unwrap_or_default();
    at + (rest.len() - rest.trim_start().len())
}
