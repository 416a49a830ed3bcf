//! The lines of a table before they are split: comments, and what separates the cells.
//!
//! Programs mark comments with `#`, `%`, `//` or `!`, and separate cells with commas, semicolons, tabs, bars or blanks. Here they all
//! become lines that one splitter reads, with the same line numbers.

/// What stands before a comment.
const COMMENT_MARKS: [&str; 4] = ["#", "%", "//", "!"];

/// What stands between the cells of a line.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(in crate::session) enum Separator {
    #[default]
    Comma,
    Semicolon,
    Tab,
    Bar,
    Blanks,
}

impl Separator {
    /// The separator in words.
    pub(in crate::session) const fn name(self) -> &'static str {
        match self {
            Self::Comma => "commas",
            Self::Semicolon => "semicolons",
            Self::Tab => "tabs",
            Self::Bar => "bars",
            Self::Blanks => "blanks",
        }
    }

    /// The byte between the cells of a prepared line.
    pub(super) const fn byte(self) -> u8 {
        match self {
            Self::Comma => b',',
            Self::Semicolon => b';',
            Self::Tab | Self::Blanks => b'\t',
            Self::Bar => b'|',
        }
    }
}

/// A text with comments marked by `#` and nothing but [`Separator::byte`] between the cells.
#[derive(Debug)]
pub(super) struct Prepared {
    pub(super) text: String,
    pub(super) separator: Separator,
    /// Line and text of the last comment above the first row: some programs write the column names there.
    pub(super) heading: Option<(usize, String)>,
    /// The comments, without their marks.
    pub(super) comments: Vec<String>,
}

/// Line ends of all kinds as line feeds, without a byte order mark.
pub(super) fn unified(text: &str) -> String {
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    text.replace("\r\n", "\n").replace('\r', "\n")
}

/// Prepares a text whose first line that is neither blank nor a comment shows what separates the cells.
pub(super) fn prepared(text: &str) -> Prepared {
    let mut comments = Vec::new();
    let mut heading = None;
    let mut first = None;
    for (index, line) in text.lines().enumerate() {
        let start = line.trim();
        match comment(start) {
            _ if start.is_empty() => {}
            Some(said) => {
                comments.push(said.to_owned());
                if first.is_none() {
                    heading = Some((index + 1, said.to_owned()));
                }
            }
            None => {
                first.get_or_insert(line);
            }
        }
    }
    let separator = separator(first.unwrap_or_default());
    let mut prepared = String::with_capacity(text.len());
    for line in text.lines() {
        let start = line.trim();
        if comment(start).is_some() || is_rule(start) {
            prepared.extend([format!("#{start}")]);
        } else {
            match separator {
                Separator::Blanks => prepared.push_str(&blanks_as_tabs(start).join("\t")),
                Separator::Bar => prepared.push_str(without_frame(start)),
                Separator::Comma | Separator::Semicolon | Separator::Tab => prepared.push_str(line),
            }
        }
        prepared.push('\n');
    }
    Prepared { text: prepared, separator, heading, comments }
}

/// The cells of a single line.
pub(super) fn cells(line: &str, separator: Separator) -> Vec<String> {
    match separator {
        Separator::Blanks => blanks_as_tabs(line),
        Separator::Comma | Separator::Semicolon | Separator::Tab | Separator::Bar => {
            line.split(char::from(separator.byte())).map(|cell| cell.trim().to_owned()).collect()
        }
    }
}

/// Whether a cell holds a number, with a decimal point or a decimal comma.
pub(in crate::session) fn is_number(cell: &str) -> bool {
    cell.parse::<f64>().is_ok() || cell.replacen(',', ".", 1).parse::<f64>().is_ok()
}

/// What a comment line says; `None` for other lines.
fn comment(start: &str) -> Option<&str> {
    let mark = COMMENT_MARKS.iter().find(|mark| start.starts_with(**mark))?;
    let said = start.strip_prefix(mark).unwrap_or(start);
    Some(said.trim_start_matches(['#', '%', '/', '!', '-', '=', ' ']).trim_end())
}

/// A line that only draws the frame of a table, as in Markdown.
fn is_rule(start: &str) -> bool {
    start.len() > 2
        && start.starts_with('|')
        && start.bytes().all(|byte| matches!(byte, b'|' | b'-' | b':' | b' ' | b'+'))
}

/// A line of a table with bars, without those at its ends.
fn without_frame(start: &str) -> &str {
    match start.strip_prefix('|').and_then(|rest| rest.strip_suffix('|')) {
        Some(inner) => inner,
        None => start,
    }
}

/// The separator that a line has most of; of equal counts the one that is less often part of a text.
fn separator(line: &str) -> Separator {
    let count = |separator: &Separator| line.bytes().filter(|byte| *byte == separator.byte()).count();
    let visible = [Separator::Comma, Separator::Semicolon, Separator::Tab, Separator::Bar];
    let most = visible.into_iter().filter(|separator| count(separator) > 0).max_by_key(count);
    // A first row of decimal commas between semicolons has more commas than semicolons.
    let is_within = |separator: Separator| {
        let cells: Vec<&str> = line.split(char::from(separator.byte())).map(str::trim).collect();
        cells.len() > 2 && cells.iter().filter(|cell| is_number(cell)).count() * 2 > cells.len()
    };
    let most = match most {
        Some(Separator::Comma) => [Separator::Semicolon, Separator::Tab, Separator::Bar]
            .into_iter()
            .find(|separator| count(separator) > 0 && is_within(*separator))
            .or(most),
        _ => most,
    };
    match most {
        Some(Separator::Comma) if has_decimal_commas_between_blanks(line) => Separator::Blanks,
        Some(separator) => separator,
        None if line.trim().contains([' ', '\u{a0}']) => Separator::Blanks,
        None => Separator::Comma,
    }
}

/// `1,5 2,5 3,5`: the commas are inside the numbers.
fn has_decimal_commas_between_blanks(line: &str) -> bool {
    let words: Vec<&str> = line.split_whitespace().collect();
    let within = |word: &&&str| !word.ends_with(',') && !word.starts_with(',') && is_number(word) && word.contains(',');
    words.len() > 1
        && words.iter().filter(within).count() * 2 > words.len()
        && !words.iter().any(|word| word.ends_with(','))
}

/// The words of a line. What is in quotation marks stays together, and so does a unit in brackets with the name before it.
fn blanks_as_tabs(line: &str) -> Vec<String> {
    let mut words: Vec<String> = Vec::new();
    let mut word = String::new();
    let mut quoted = false;
    for character in line.chars() {
        if character == '"' {
            quoted = !quoted;
        }
        if character.is_whitespace() && !quoted {
            if !word.is_empty() {
                words.push(std::mem::take(&mut word));
            }
        } else {
            word.push(character);
        }
    }
    if !word.is_empty() {
        words.push(word);
    }
    let mut joined: Vec<String> = Vec::new();
    for word in words {
        match joined.last_mut() {
            Some(name) if is_bracketed(&word) && !is_bracketed(name) => name.extend([format!(" {word}")]),
            _ => joined.push(word),
        }
    }
    joined
}

fn is_bracketed(word: &str) -> bool {
    let ends = |open: char, close: char| word.starts_with(open) && word.ends_with(close);
    ends('[', ']') || ends('(', ')')
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_separator_is_the_one_between_the_cells() {
        for (line, expected) in [
            ("a,b,c", Separator::Comma),
            ("a;b;c", Separator::Semicolon),
            ("1,5;2,5;3,5", Separator::Semicolon),
            ("a\tb\tc", Separator::Tab),
            ("a|b|c", Separator::Bar),
            ("a b  c", Separator::Blanks),
            ("1,5 2,5 3,5", Separator::Blanks),
            ("1.5, 2.5, 3.5", Separator::Comma),
            ("Joint 1 (deg),Joint 2 (deg)", Separator::Comma),
            ("a", Separator::Comma),
        ] {
            assert_eq!(separator(line), expected, "{line}");
        }
    }

    #[test]
    fn comments_of_all_kinds_are_marked_and_lines_keep_their_numbers() {
        let read = prepared("% one\n// two\n! three\n\n  # four\na b [mm]\n1 2\n");
        assert_eq!(read.text, "#% one\n#// two\n#! three\n\n## four\na\tb [mm]\n1\t2\n");
        assert_eq!(read.comments, ["one", "two", "three", "four"]);
        assert_eq!(read.heading, Some((5, "four".to_owned())));
    }

    #[test]
    fn a_table_drawn_with_bars_loses_its_frame() {
        let read = prepared("| a | b |\n|---|---|\n| 1 | 2 |\n");
        assert_eq!(read.text, " a | b \n#|---|---|\n 1 | 2 \n");
    }
}
