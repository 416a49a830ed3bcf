//! Choice of rows by the text of their cells: `pose % 17 == 0 and position != 'backcenter'`.
//!
//! ```text
//! filter     = all { "or" all }
//! all        = term { "and" term }
//! term       = "not" term | "(" filter ")" | comparison
//! comparison = column [ "%" number ] operator value
//! operator   = "==" | "!=" | "<" | "<=" | ">" | ">="
//! value      = number | 'text'
//! ```
//!
//! A column is a name as in the table, upper and lower case alike; a name with other characters than letters, digits, `_`
//! and `.` is written in double quotation marks. Numbers are compared as numbers **in the unit of the column**, text letter
//! by letter and for equality only; a quotation mark inside a text is written twice. `%` is the remainder, never
//! negative.

mod parser;

use std::cmp::Ordering;

use thiserror::Error;

use crate::text::printable;

/// A condition on the cells of a row.
#[derive(Clone, Debug, PartialEq)]
pub struct Filter {
    condition: Condition,
}

#[derive(Clone, Debug, PartialEq)]
enum Condition {
    Any(Vec<Self>),
    All(Vec<Self>),
    Not(Box<Self>),
    Number { column: String, divisor: Option<f64>, operator: Operator, value: f64 },
    Text { column: String, equal: bool, value: String },
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Operator {
    Equal,
    NotEqual,
    Less,
    LessOrEqual,
    Greater,
    GreaterOrEqual,
}

impl Operator {
    const fn holds(self, ordering: Ordering) -> bool {
        match self {
            Self::Equal => ordering.is_eq(),
            Self::NotEqual => ordering.is_ne(),
            Self::Less => ordering.is_lt(),
            Self::LessOrEqual => ordering.is_le(),
            Self::Greater => ordering.is_gt(),
            Self::GreaterOrEqual => ordering.is_ge(),
        }
    }
}

/// Why a filter cannot be used.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[non_exhaustive]
pub enum FilterError {
    /// The text is not a filter. Shown with a caret below the place.
    #[error("the filter cannot be read: {expected}\n  {text}\n  {:>width$}", "^", width = at + 1)]
    Syntax {
        /// The text, control characters replaced.
        text: String,
        /// 0-based character of the place.
        at: usize,
        /// What was expected there.
        expected: String,
    },
    /// A column that the table does not have.
    #[error("the filter asks for column '{column}', which the table does not have; it has {}", columns.join(", "))]
    UnknownColumn {
        /// The name in the filter.
        column: String,
        /// The names in the table.
        columns: Vec<String>,
    },
    /// A cell that is compared with a number and is none.
    #[error(
        "line {line}, column '{column}': the filter compares '{text}' with a number; correct the cell, or compare with \
         a text in single quotation marks"
    )]
    NotANumber {
        /// 1-based line in the file.
        line: usize,
        /// Name of the column.
        column: String,
        /// Text of the cell.
        text: String,
    },
}

impl Filter {
    /// Reads a filter.
    ///
    /// # Errors
    /// [`FilterError::Syntax`] with the first place that does not follow the grammar.
    pub fn parse(text: &str) -> Result<Self, FilterError> {
        Ok(Self { condition: parser::parse(text)? })
    }

    /// Checks that a table has the columns that the filter asks for.
    ///
    /// # Errors
    /// [`FilterError::UnknownColumn`] for the first that is missing.
    pub fn check(&self, columns: &[String]) -> Result<(), FilterError> {
        self.condition.check(columns)
    }

    /// Whether the row on `line` (1-based, for the message) with the cells `fields`, parallel to `columns`, is chosen.
    ///
    /// # Errors
    /// A column that the table does not have, or a cell that is compared with a number and is none.
    pub fn matches(&self, columns: &[String], fields: &[String], line: usize) -> Result<bool, FilterError> {
        self.condition.matches(columns, fields, line)
    }
}

impl Condition {
    fn check(&self, columns: &[String]) -> Result<(), FilterError> {
        match self {
            Self::Any(conditions) | Self::All(conditions) => {
                conditions.iter().try_for_each(|condition| condition.check(columns))
            }
            Self::Not(condition) => condition.check(columns),
            Self::Number { column, .. } | Self::Text { column, .. } => place(column, columns).map(|_| ()),
        }
    }

    fn matches(&self, columns: &[String], fields: &[String], line: usize) -> Result<bool, FilterError> {
        let cell = |column: &str| place(column, columns).map(|place| fields.get(place).map_or("", String::as_str));
        match self {
            Self::Any(conditions) => {
                for condition in conditions {
                    if condition.matches(columns, fields, line)? {
                        return Ok(true);
                    }
                }
                Ok(false)
            }
            Self::All(conditions) => {
                for condition in conditions {
                    if !condition.matches(columns, fields, line)? {
                        return Ok(false);
                    }
                }
                Ok(true)
            }
            Self::Not(condition) => Ok(!condition.matches(columns, fields, line)?),
            Self::Text { column, equal, value } => Ok((cell(column)? == value) == *equal),
            Self::Number { column, divisor, operator, value } => {
                let text = cell(column)?;
                // The table reader has refused a file that mixes decimal signs, so a lone comma is one.
                let number = text.parse().or_else(|_| text.replacen(',', ".", 1).parse());
                let Some(number) = number.ok().filter(|number: &f64| number.is_finite()) else {
                    return Err(FilterError::NotANumber { line, column: column.clone(), text: printable(text) });
                };
                let number = divisor.map_or(number, |divisor| number.rem_euclid(divisor));
                Ok(number.partial_cmp(value).is_some_and(|ordering| operator.holds(ordering)))
            }
        }
    }
}

/// Place of the column with this name; exact before upper and lower case alike.
fn place(column: &str, columns: &[String]) -> Result<usize, FilterError> {
    let exact = columns.iter().position(|name| name == column);
    let alike = || columns.iter().position(|name| name.to_lowercase() == column.to_lowercase());
    exact.or_else(alike).ok_or_else(|| FilterError::UnknownColumn {
        column: printable(column),
        columns: columns.iter().map(|name| printable(name)).collect(),
    })
}
