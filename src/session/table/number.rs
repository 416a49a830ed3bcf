//! Cells that hold numbers.

use super::{Defect, NumberColumn, Record, TableProblem};

/// Larger numbers (m, rad) are not a measurement in any unit, but a lost decimal point or rubbish that would become infinity.
const LARGEST: f64 = 1e6;

/// Reads the number cells of one table and gathers what is wrong with them.
#[derive(Debug)]
pub(in crate::session) struct Numbers<'a> {
    names: &'a [String],
    decimal_comma: bool,
    /// Lines of the first number with a decimal point and of the first with a decimal comma.
    first_point: Option<usize>,
    first_comma: Option<usize>,
    mixed: bool,
}

impl<'a> Numbers<'a> {
    /// A reader for a table with the given column names; `decimal_comma` allows `1,5`.
    pub(in crate::session) fn new(names: &'a [String], decimal_comma: bool) -> Self {
        Self { names, decimal_comma, first_point: None, first_comma: None, mixed: false }
    }

    /// The value of a cell in the unit of the inside; `None` with a problem when there is none.
    pub(in crate::session) fn required(
        &mut self,
        record: &Record,
        column: NumberColumn,
        problems: &mut Vec<TableProblem>,
    ) -> Option<f64> {
        if Self::text(record, column).is_empty() {
            problems.push(Defect::Empty.at_cell(record.line, self.name(column)));
            return None;
        }
        self.optional(record, column, problems)
    }

    /// As [`Numbers::required`], but an empty cell is neither a value nor a problem.
    pub(in crate::session) fn optional(
        &mut self,
        record: &Record,
        column: NumberColumn,
        problems: &mut Vec<TableProblem>,
    ) -> Option<f64> {
        let text = Self::text(record, column);
        if text.is_empty() {
            return None;
        }
        let name = self.name(column);
        let mut refuse = |defect: Defect| {
            problems.push(defect.at_cell(record.line, name));
            None
        };
        let comma = self.decimal_comma && text.bytes().filter(|&byte| byte == b',').count() == 1 && !text.contains('.');
        let value = if comma { text.replacen(',', ".", 1).parse::<f64>() } else { text.parse::<f64>() };
        let Ok(value) = value else {
            let text = text.to_owned();
            return refuse(if is_grouped(&text) { Defect::Grouped { text } } else { Defect::NotANumber { text } });
        };
        if !value.is_finite() || (value * column.unit).abs() > LARGEST {
            return refuse(Defect::NotFinite { text: text.to_owned() });
        }
        // "1,234" is 1.234 or a thousand: only a file that uses one decimal sign throughout is unambiguous.
        let (own, other) = if comma {
            (&mut self.first_comma, self.first_point)
        } else if text.contains('.') {
            (&mut self.first_point, self.first_comma)
        } else {
            (&mut None, None)
        };
        own.get_or_insert(record.line);
        if let Some(other_line) = other
            && !self.mixed
        {
            self.mixed = true;
            return refuse(Defect::MixedDecimals { text: text.to_owned(), other_line });
        }
        Some(value * column.unit)
    }

    /// A standard deviation: positive, or an empty cell.
    pub(in crate::session) fn deviation(
        &mut self,
        record: &Record,
        column: NumberColumn,
        problems: &mut Vec<TableProblem>,
    ) -> Option<f64> {
        let value = self.optional(record, column, problems)?;
        if value > 0.0 {
            return Some(value);
        }
        let text = Self::text(record, column).to_owned();
        problems.push(Defect::NotPositive { text }.at_cell(record.line, self.name(column)));
        None
    }

    /// Text of the cell of a column.
    pub(in crate::session) fn text(record: &Record, column: NumberColumn) -> &str {
        record.cells.get(column.index).map_or("", String::as_str)
    }

    /// Name of a column as written.
    pub(in crate::session) fn name(&self, column: NumberColumn) -> &'a str {
        self.names.get(column.index).map_or("", String::as_str)
    }
}

/// Whether a text is a number whose digits are in groups of three: `1,234.5`, `1.234,5`, `1 234.5` or `1'234.5`.
fn is_grouped(text: &str) -> bool {
    let is_between = |c: char| matches!(c, ',' | '.' | ' ' | '\'' | '\u{a0}' | '\u{2009}' | '\u{202f}' | '’');
    let whole = text.trim_start_matches(['-', '+']);
    let parts: Vec<&str> = whole.split(is_between).collect();
    let is_digits = |part: &&str| !part.is_empty() && part.bytes().all(|byte| byte.is_ascii_digit());
    match parts.as_slice() {
        [first, groups @ .., _last] => {
            !groups.is_empty()
                && parts.iter().all(is_digits)
                && first.len() <= 3
                && groups.iter().all(|group| group.len() == 3)
        }
        _ => false,
    }
}
