//! Separated-value tables as text cells with true line numbers; shared by every table a session reads.
//!
//! What separates the cells (commas, semicolons, tabs, bars or blanks) is detected from the line of column names. A byte order mark,
//! line ends of all kinds, blank lines, rows of nothing but separators (spreadsheets leave them at the end) and comments are passed
//! over. Cells lose surrounding blanks; control characters in them are replaced, so that no cell can disturb a terminal.
//!
//! What a column means is not known here.

mod columns;
mod encoding;
mod lines;
mod number;
mod problem;

pub(super) use columns::{Header, Measure, NumberColumn};
pub(super) use encoding::decode;
pub(super) use lines::{Separator, is_number};
pub(super) use number::Numbers;
pub use problem::{Defect, TableErrors, TableProblem};

use crate::checksum::{self, Finding};
use crate::text::printable;

/// Most lines of a table: a hundred times a long calibration.
const MOST_ROWS: usize = 250_000;
/// Most bytes of a line.
const LONGEST_LINE: usize = 64 * 1024;
/// Most columns of a table.
const MOST_COLUMNS: usize = 1000;

/// One line of a table, split into cells.
#[derive(Clone, Debug)]
pub(super) struct Record {
    /// 1-based line in the file.
    pub(super) line: usize,
    /// Trimmed, printable text of the cells.
    pub(super) cells: Vec<String>,
}

/// The lines of a table, the line of column names apart.
#[derive(Debug, Default)]
pub(super) struct Table {
    /// The first line that is neither blank nor a comment.
    pub(super) header: Option<Record>,
    /// The lines after it that have the right number of cells; the others are among the problems.
    pub(super) records: Vec<Record>,
    /// Whether `1,5` can be a number: the comma does not separate cells.
    pub(super) decimal_comma: bool,
    /// What separates the cells.
    pub(super) separator: Separator,
    /// The last comment above the first row, split like one: some programs write the column names there.
    pub(super) heading: Option<Record>,
    /// The comments, without their marks.
    pub(super) comments: Vec<String>,
}

/// How the cells of a table are separated and counted.
#[derive(Clone, Copy, Debug)]
pub(super) enum Shape {
    /// The first line names the columns, decides the separator and the number of cells.
    Named,
    /// The first line is whatever it is; the second decides the separator and every row has `cells` cells.
    Fixed {
        /// Cells of a row.
        cells: usize,
    },
    /// As `Fixed`, with tabs and nothing else between the cells.
    Tabs {
        /// Cells of a row.
        cells: usize,
    },
}

/// Splits `text` into records. Rows with a wrong number of cells or an open quotation mark go to `problems` instead.
pub(super) fn split(text: &str, shape: Shape, problems: &mut Vec<TableProblem>) -> Table {
    let text = &lines::unified(text);
    // Looked at before anything is taken apart, which would multiply the memory.
    if let Some(problem) = beyond_limits(text) {
        problems.push(problem);
        return Table::default();
    }
    let mut table = match shape {
        Shape::Named => Table::default(),
        Shape::Fixed { .. } => Table { separator: of_fixed(content_lines(text).nth(1)), ..Table::default() },
        Shape::Tabs { .. } => Table { separator: Separator::Tab, ..Table::default() },
    };
    let prepared = matches!(shape, Shape::Named).then(|| lines::prepared(text));
    let text = prepared.as_ref().map_or(text, |prepared| &prepared.text);
    if let Some(prepared) = &prepared {
        table.separator = prepared.separator;
        table.heading = prepared.heading.as_ref().map(|(line, said)| Record {
            line: *line,
            cells: lines::cells(said, prepared.separator).iter().map(|cell| printable(cell)).collect(),
        });
        table.comments = prepared.comments.iter().map(|said| printable(said)).collect();
    }
    let separator = table.separator.byte();
    table.decimal_comma = separator != b',';
    let mut reader = csv::ReaderBuilder::new()
        .delimiter(separator)
        .has_headers(false)
        .flexible(true)
        .comment(Some(b'#'))
        .from_reader(text.as_bytes());
    let mut raw = csv::StringRecord::new();
    let mut lines = LineCounter { text: text.as_bytes(), offset: 0, line: 1 };
    let mut width = match shape {
        Shape::Named => None,
        Shape::Fixed { cells } | Shape::Tabs { cells } => Some(cells),
    };
    loop {
        let from = usize::try_from(reader.position().byte()).unwrap_or(usize::MAX);
        match reader.read_record(&mut raw) {
            Ok(true) => {}
            Ok(false) => break,
            Err(reason) => {
                problems.push(Defect::Unreadable { reason: reason.to_string() }.at(lines.line));
                break;
            }
        }
        let line = lines.record_at(from);
        if lines.is_indented_comment() || raw.iter().all(|cell| cell.trim().is_empty()) {
            continue;
        }
        if raw.iter().any(|cell| cell.contains(['\n', '\r'])) {
            let end = usize::try_from(reader.position().byte()).unwrap_or(usize::MAX);
            let last_line = lines.line_before(end);
            problems.push(Defect::OpenQuote { last_line }.at(line));
            continue;
        }
        let mut cells: Vec<String> = raw.iter().map(|cell| printable(cell.trim())).collect();
        let Some(expected) = width.filter(|_| table.header.is_some()) else {
            while cells.last().is_some_and(String::is_empty) {
                cells.pop();
            }
            if cells.len() > MOST_COLUMNS {
                problems.push(Defect::TooManyColumns { columns: cells.len(), most: MOST_COLUMNS }.at(line));
                break;
            }
            width = width.or(Some(cells.len()));
            table.header = Some(Record { line, cells });
            continue;
        };
        // Separators that a spreadsheet adds at the end of a line.
        while cells.len() > expected && cells.last().is_some_and(String::is_empty) {
            cells.pop();
        }
        if cells.len() == expected {
            table.records.push(Record { line, cells });
        } else {
            let comma = separator == b',';
            problems.push(Defect::CellCount { found: cells.len(), expected, comma }.at(line));
        }
    }
    table
}

/// Why a text is far too large to be a table of measurements, if it is.
fn beyond_limits(text: &str) -> Option<TableProblem> {
    let rows = text.bytes().filter(|byte| *byte == b'\n').count();
    if rows > MOST_ROWS {
        return Some(Defect::TooManyRows { rows, most: MOST_ROWS }.of_table());
    }
    let is_break = |byte: &u8| matches!(byte, b'\n' | b'\r');
    let (index, long) = text.as_bytes().split(is_break).enumerate().find(|(_, line)| line.len() > LONGEST_LINE)?;
    Some(Defect::LongLine { bytes: long.len(), most: LONGEST_LINE }.at(index + 1))
}

/// The warning about a table of this program that has changed since it was written.
pub(super) fn changed(text: &str) -> Option<TableProblem> {
    (checksum::check(text) == Finding::Changed).then(|| Defect::Changed.of_table())
}

/// Lines that are neither blank nor comments.
fn content_lines(text: &str) -> impl Iterator<Item = &str> {
    text.split(['\n', '\r']).filter(|line| {
        let start = line.trim_start();
        !start.is_empty() && !start.starts_with('#')
    })
}

/// The separator that a line of a fixed layout has most of; the comma for a line without any.
fn of_fixed(line: Option<&str>) -> Separator {
    let line = line.unwrap_or_default();
    let count = |separator: &Separator| line.bytes().filter(|byte| *byte == separator.byte()).count();
    // The last of equal counts wins, so the preferred one comes last.
    let known = [Separator::Comma, Separator::Semicolon, Separator::Tab];
    known.into_iter().filter(|separator| count(separator) > 0).max_by_key(count).unwrap_or(Separator::Comma)
}

/// Follows the line numbers of records: the ones of the `csv` crate count neither blank lines nor CRLF as wanted here.
struct LineCounter<'a> {
    text: &'a [u8],
    offset: usize,
    line: usize,
}

impl LineCounter<'_> {
    /// Line of the record for which the reader stood at byte `from`, passing over what the reader passes over.
    fn record_at(&mut self, from: usize) -> usize {
        while self.offset < from.min(self.text.len()) {
            self.step();
        }
        while let Some(&byte) = self.text.get(self.offset) {
            match byte {
                b'\n' | b'\r' => self.step(),
                b'#' => {
                    while self.text.get(self.offset).is_some_and(|&byte| byte != b'\n') {
                        self.step();
                    }
                }
                _ => break,
            }
        }
        self.line
    }

    /// Last line with text before byte `end`, from the current record on.
    fn line_before(&self, end: usize) -> usize {
        let mut ahead = LineCounter { text: self.text, offset: self.offset, line: self.line };
        let mut last = self.line;
        while ahead.offset < end.min(self.text.len()) {
            if ahead.text.get(ahead.offset).is_some_and(|byte| !byte.is_ascii_whitespace()) {
                last = ahead.line;
            }
            ahead.step();
        }
        last
    }

    /// Whether the current record is a comment with blanks before its `#`.
    fn is_indented_comment(&self) -> bool {
        let rest = self.text.get(self.offset..).unwrap_or_default();
        rest.iter().find(|&&byte| byte != b' ') == Some(&b'#')
    }

    fn step(&mut self) {
        let next = self.text.get(self.offset + 1);
        match self.text.get(self.offset) {
            Some(b'\n') => self.line += 1,
            Some(b'\r') if next != Some(&b'\n') => self.line += 1,
            _ => {}
        }
        self.offset += 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lines(text: &str) -> (Vec<usize>, Vec<String>) {
        let mut problems = Vec::new();
        let table = split(text, Shape::Named, &mut problems);
        let header = table.header.iter().map(|record| record.line);
        (
            header.chain(table.records.iter().map(|record| record.line)).collect(),
            problems.iter().map(ToString::to_string).collect(),
        )
    }

    #[test]
    fn line_numbers_survive_comments_blank_lines_and_line_endings() {
        for ending in ["\n", "\r\n", "\r"] {
            let text =
                ["\u{feff}# from the cell", "", "a,b", "1,2", "", "# x, y", "  # indented", "3,4", ",", "5,6", ""]
                    .join(ending);
            assert_eq!(lines(&text), (vec![3, 4, 8, 10], vec![]), "{ending:?}");
        }
        assert_eq!(lines("a,b\r1,2\r\r3,4"), (vec![1, 2, 4], vec![]));
    }

    #[test]
    fn absurd_tables_are_refused_before_they_are_taken_apart() {
        let columns = |count: usize| (0..count).map(|index| format!("c{index}")).collect::<Vec<_>>().join(",");
        let row = format!("{}\n", "1,".repeat(LONGEST_LINE));
        for (text, reason) in [
            (columns(MOST_COLUMNS + 1), "line 1: the line has 1001 columns; at most 1000 are read"),
            (format!("a,b\n{row}"), "line 2: the line has 131072 bytes; at most 65536 are read"),
            (format!("a,b\n{}", "1,2\n".repeat(MOST_ROWS)), "the table has 250001 lines; at most 250000 are read"),
        ] {
            let (read, problems) = lines(&text);
            assert!(read.len() <= 1 && problems.len() == 1 && problems[0].starts_with(reason), "{problems:?}");
        }
        assert_eq!(lines(&columns(MOST_COLUMNS)), (vec![1], vec![]));
    }

    #[test]
    fn an_open_quotation_mark_is_reported_with_the_lines_it_swallows() {
        let (read, problems) = lines("a,b\n1,2\n\"x,2\n3,4\n5,6\n");
        assert_eq!(read, [1, 2]);
        assert_eq!(problems.len(), 1);
        assert!(problems[0].starts_with("line 3: a quotation mark"), "{problems:?}");
        assert!(problems[0].contains("line 5"), "{problems:?}");
    }

    #[test]
    fn quoted_cells_keep_separators_and_lose_control_characters() {
        let mut problems = Vec::new();
        let table = split("a;b\n\"x;1\";\u{1b}[31m\n", Shape::Named, &mut problems);
        assert!(problems.is_empty() && table.decimal_comma);
        assert_eq!(table.records[0].cells, ["x;1", "\u{fffd}[31m"]);
    }
}
