//! What can be wrong with a table, where, and what to do about it.

use std::fmt;

use thiserror::Error;

use crate::session::measurements::Understood;
use crate::text::printable;

/// Problems shown in a message; the others are counted.
const SHOWN_PROBLEMS: usize = 20;

/// Characters of a cell or name shown in a message.
const SHOWN_CHARACTERS: usize = 60;

/// A defect of a table. The text says what is wrong and what to do; the place is in [`TableProblem`].
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum Defect {
    /// More rows than any calibration has.
    #[error("the table has {rows} lines; at most {most} are read: select those of the calibration first")]
    TooManyRows { rows: usize, most: usize },
    /// A line that is no row of a table.
    #[error("the line has {bytes} bytes; at most {most} are read: is this a table with one row for each pose?")]
    LongLine { bytes: usize, most: usize },
    /// More columns than any table has.
    #[error("the line has {columns} columns; at most {most} are read: is this a table with one row for each pose?")]
    TooManyColumns { columns: usize, most: usize },
    /// The check sum of a table that this program wrote does not fit.
    #[error("the table has changed since the program wrote it: a number or a row may be wrong")]
    Changed,
    /// Text in UTF-16 that ends within a character.
    #[error("the file is UTF-16 text, and damaged; save it again, as 'CSV UTF-8'")]
    Utf16,
    /// Zero bytes.
    #[error("the file is no text: it has zero bytes; export the table as text, such as CSV")]
    NotText,
    /// A workbook where only text can be read.
    #[error("the file is a workbook (.xlsx) or another archive; save the sheet as CSV, or import it")]
    Workbook,
    /// A workbook of before 2007.
    #[error("the file is an old workbook (.xls); save it as .xlsx or as CSV")]
    OldWorkbook,
    /// A workbook that cannot be read.
    #[error("the workbook cannot be read: {reason}")]
    BadWorkbook {
        /// What is wrong, and what to do.
        reason: String,
    },
    /// Names of two sets of joints.
    #[error("several sets of columns could be the joints: {}; name those that the pendant showed", sets.join("; "))]
    SeveralJointSets {
        /// The columns of each.
        sets: Vec<String>,
    },
    /// Names of two sets of coordinates.
    #[error("several sets of columns could be the measured point: {}; name the measured ones", sets.join("; "))]
    SeveralPoints {
        /// The columns of each.
        sets: Vec<String>,
    },
    /// More SMRs in a row than the robot has.
    #[error("{source_name}, but the profile has {known}; add the others to its 'targets'")]
    MoreTargets {
        /// What the table has, in words.
        source_name: String,
        /// Targets of the profile, counted.
        known: String,
    },
    /// Another tool centre in each row, in columns that are not read.
    #[error(
        "{} different values: these are different targets, which must not be mixed; read the table in the layout 'robodk', or name a column 'target'",
        named(columns, "has", "have")
    )]
    VaryingTool {
        /// Names of the columns.
        columns: Vec<String>,
    },
    /// A column that was asked for and is not there.
    #[error("there is no column '{}'; columns: {known}", excerpt(name))]
    NoSuchColumn {
        /// The name that was asked for.
        name: String,
        /// The names in the file, or their number.
        known: String,
    },
    /// A name and its mapping that state different units.
    #[error("the name states '{stated}', but {against}")]
    OtherUnit {
        /// Unit in the name of the column.
        stated: String,
        /// What states another one, in words.
        against: String,
    },
    /// A row of a point file that belongs to no row of the joint file, or the reverse.
    #[error("{0}")]
    NotJoined(String),
    /// A file that is asked for something it does not have.
    #[error("{0}")]
    Lacking(String),
    /// The splitter gave up.
    #[error("the line cannot be split into cells: {reason}")]
    Unreadable {
        /// Why.
        reason: String,
    },
    /// A cell in quotation marks that continues past the end of its line.
    #[error(
        "a quotation mark opens a cell that continues to line {last_line}, so none of these lines can be read; \
         close it on its own line"
    )]
    OpenQuote {
        /// Last line of the cell.
        last_line: usize,
    },
    /// The first line holds numbers, not names.
    #[error(
        "this line has numbers where the column names should be; write the names with their units above it{}",
        if *cells == 12 { ", or read a table of RoboDK with the layout 'robodk'" } else { "" }
    )]
    NoHeader {
        /// Cells of the line.
        cells: usize,
    },
    /// Two columns with the same name.
    #[error("columns {first} and {second} have this name; rename or remove one")]
    DuplicateColumn {
        /// 1-based place of the first.
        first: usize,
        /// 1-based place of the second.
        second: usize,
    },
    /// Two columns give the same quantity in two units.
    #[error("the table gives this already as column '{other}'; rename or remove one")]
    SameQuantity {
        /// Name of the earlier column.
        other: String,
    },
    /// Not one column per joint of the robot.
    #[error(
        "the robot has {joints} {}, but the table has {}; it needs {}, and the profile must be that of the measured robot",
        if *joints == 1 { "joint" } else { "joints" },
        joint_columns(prefix, found),
        if *joints == 1 { format!("{prefix}q1") } else { format!("{prefix}q1 … {prefix}q{joints}") }
    )]
    JointColumns {
        /// `from_`, `to_` or nothing.
        prefix: String,
        /// Joints of the robot.
        joints: usize,
        /// Names of the joint columns of the table.
        found: Vec<String>,
    },
    /// Columns that the table needs.
    #[error("{} missing; add {}", named(columns, "is", "are"), if columns.len() == 1 { "it" } else { "them" })]
    MissingColumns {
        /// Their names in the usual units.
        columns: Vec<String>,
    },
    /// Columns whose name does not end with a unit.
    #[error(
        "{} no unit, and trupose does not guess it; end the name with it, as in '{}'",
        named(columns, "has", "have"),
        excerpt(example)
    )]
    MissingUnits {
        /// Their names.
        columns: Vec<String>,
        /// The first of them with its usual unit.
        example: String,
    },
    /// A name that ends with something that is not a unit of its quantity.
    #[error(
        "'{unit}' is not a unit for this column; convert its values to {}, or give it another name if it is something else",
        any_of(allowed)
    )]
    UnknownUnit {
        /// What the name ends with.
        unit: String,
        /// Units of the quantity.
        allowed: Vec<&'static str>,
    },
    /// Columns that look like an orientation that is not read.
    #[error(
        "{} like an orientation, but not one that is read; to leave it free by mistake would turn the tool. Rename or remove {}. Orientations are {}",
        named(columns, "looks", "look"),
        if columns.len() == 1 { "it" } else { "them" },
        read.join("; ")
    )]
    UnknownOrientation {
        /// Their names.
        columns: Vec<String>,
        /// The forms that are read.
        read: Vec<&'static str>,
    },
    /// Two forms of orientation in one table.
    #[error("the table gives the orientation twice: {}; remove one", forms.join(", and "))]
    SeveralOrientations {
        /// The forms that were found.
        forms: Vec<&'static str>,
    },
    /// The error of an orientation without the orientation.
    #[error("the error of an orientation is stated, but no orientation is found. Orientations are {}", read.join("; "))]
    NoOrientation {
        /// The forms that are read.
        read: Vec<&'static str>,
    },
    /// A pose of which one of the two errors is not stated.
    #[error("a pose needs the errors of its position and of its orientation; this row lacks '{lacking}'")]
    NoSigma {
        /// The column that is missing or empty.
        lacking: &'static str,
    },
    /// Numbers that are no rotation.
    #[error("{name} is no rotation: {reason}")]
    NoRotation {
        /// What the numbers are.
        name: &'static str,
        /// What is wrong.
        reason: String,
    },
    /// None of the tables of direct distances.
    #[error(
        "the columns are neither those of a socket table (position, socket, joints), nor those of a table of lengths \
         (from_ joints, to_ joints, length), nor those of a table of contacts (feature, shape, joints, length){}",
        if *has_points { "; a table with x, y and z is read as measurements" } else { "" }
    )]
    NotConstraints {
        /// The table has tracker coordinates.
        has_points: bool,
    },
    /// A table of commands where one of targets should be.
    #[error(
        "it is a table of commands that 'compensate' wrote; correcting them again would move the arm elsewhere, so use the original targets"
    )]
    AlreadyCompensated,
    /// Nothing to read.
    #[error("the table has no rows; it needs column names and below them one row per reading")]
    NoRows,
    /// A row with too few or too many cells.
    #[error(
        "the row has {found} {} instead of {expected}; {}",
        if *found == 1 { "cell" } else { "cells" },
        if *comma && found > expected {
            "decimal commas need ';' or a tab between the columns"
        } else {
            "check the separators, and that the line is complete"
        }
    )]
    CellCount {
        /// Cells of the row.
        found: usize,
        /// Cells that a row of the table has.
        expected: usize,
        /// The cells are separated by commas.
        comma: bool,
    },
    /// A cell that needs a value.
    #[error("the cell is empty; write its value, or leave the row out with a '#' before it")]
    Empty,
    /// Text where a number is needed.
    #[error("'{}' is not a number; write one such as '-12.5'", excerpt(text))]
    NotANumber {
        /// Text of the cell.
        text: String,
    },
    /// A number whose digits are in groups.
    #[error(
        "'{}' has a thousands separator; write the number without it, as the same text could be another number elsewhere",
        excerpt(text)
    )]
    Grouped {
        /// Text of the cell.
        text: String,
    },
    /// NaN, an infinity, or a number too large.
    #[error(
        "'{}' is not a number that can be measured; write its value, or leave the row out with a '#' before it",
        excerpt(text)
    )]
    NotFinite {
        /// Text of the cell.
        text: String,
    },
    /// Decimal comma and decimal point in one file.
    #[error(
        "'{}' and line {other_line} do not agree on the decimal sign, so '1,234' could be a thousand; \
         use the same sign in the whole file and no thousands separators",
        excerpt(text)
    )]
    MixedDecimals {
        /// Text of the cell.
        text: String,
        /// First line with the other sign.
        other_line: usize,
    },
    /// A standard deviation that is zero or negative.
    #[error(
        "'{}' is not a standard deviation; write a positive number, or leave the cell empty if it is unknown",
        excerpt(text)
    )]
    NotPositive {
        /// Text of the cell.
        text: String,
    },
    /// A word that is no shape of a feature.
    #[error("'{}' is not a shape; write {}", excerpt(text), any_of(allowed))]
    UnknownShape {
        /// Text of the cell.
        text: String,
        /// The shapes there are.
        allowed: Vec<&'static str>,
    },
    /// Rows of one feature that do not agree.
    #[error(
        "feature '{}' is on line {first_line} with another shape, or with a length where this row has none or the reverse; \
         give one of the two another name, or the same shape and columns",
        excerpt(feature)
    )]
    OtherShape {
        /// Name of the feature.
        feature: String,
        /// Line of its first row.
        first_line: usize,
    },
    /// A length that is missing, or that a shape has none of.
    #[error(
        "a {shape} {}",
        if *is_missing {
            "needs the measured length in each row"
        } else {
            "has no measured length; leave the cell empty, or write another shape"
        }
    )]
    LengthOfShape {
        /// Name of the shape.
        shape: &'static str,
        /// Whether the length is missing.
        is_missing: bool,
    },
    /// Warning: contacts that tell no more than where the feature is.
    #[error(
        "feature '{}' has {found} {}, which only show where it is; at least {needed} tell something about the robot",
        excerpt(feature),
        if *found == 1 { "contact" } else { "contacts" }
    )]
    FewContacts {
        /// Name of the feature.
        feature: String,
        /// Contacts with it.
        found: usize,
        /// Contacts that it takes.
        needed: usize,
    },
    #[error("'{}' is not a length; write the measured distance, which is never negative", excerpt(text))]
    NegativeLength {
        /// Text of the cell.
        text: String,
    },
    /// The tracker's own origin.
    #[error(
        "the point is 0, 0, 0: the tracker had no target; measure again, or leave the row out with a '#' before it"
    )]
    ZeroPoint,
    /// One pose number, two configurations.
    #[error(
        "pose '{}'{} is on line {first_line} with another configuration: joint {joint} was {first} {unit} there and is \
         {here} {unit} here; correct the joint values, or give one of the two another pose",
        excerpt(pose),
        of_target(target.as_deref())
    )]
    OtherConfiguration {
        /// Text of the pose.
        pose: String,
        /// Text of the target.
        target: Option<String>,
        /// Line of the first row of this pose and target.
        first_line: usize,
        /// 1-based joint that differs most.
        joint: usize,
        /// Its value on the first line, at the edge.
        first: f64,
        /// Its value on this line, at the edge.
        here: f64,
        /// `deg` or `mm`.
        unit: &'static str,
    },
    /// Warning: a row that appears twice.
    #[error("the row repeats line {first_line}, joint values and point alike; it is left out as a copy")]
    Repeats {
        /// Line of the first of the two.
        first_line: usize,
    },
    /// Warning: a configuration that appears twice for the same point.
    #[error("the joint values are those of line {first_line}; a second row with them adds no information")]
    RepeatsConfiguration {
        /// Line of the first of the two.
        first_line: usize,
    },
    /// Warning: a length that appears twice.
    #[error("the row repeats line {first_line}, joint values and length alike; remove it if it is a copy")]
    RepeatsLength {
        /// Line of the first of the two.
        first_line: usize,
    },
    /// Warning: a point that was measured before, to the last digit, with the robot or the target elsewhere.
    #[error(
        "the point is that of line {first_line} to the last digit, but {} another; the instrument may have \
         repeated an old reading: measure one of the two again",
        if *other_target { "the target is" } else { "the configuration is" }
    )]
    StalePoint {
        /// Line of the first of the two.
        first_line: usize,
        /// The target differs, not the configuration.
        other_target: bool,
    },
    /// Warning: the line of names of an imported layout holds numbers.
    #[error(
        "the layout takes this line for column names, but it holds numbers; put a line of names above it if it is a reading"
    )]
    NumbersIgnored,
    /// A row with too few or too many cells for an imported layout.
    #[error("the row has {found} {} instead of {expected}; the layout is {separator}: {columns}", if *found == 1 { "cell" } else { "cells" })]
    LayoutCells {
        /// Cells of the row.
        found: usize,
        /// Cells of a row in the layout.
        expected: usize,
        /// How cells are separated, in words.
        separator: &'static str,
        /// Meaning of the cells, in order.
        columns: String,
    },
    /// A layout for another robot.
    #[error(
        "a table of RoboDK has six turning joints, and this robot has {joints} {}; write a table with named columns instead",
        if *joints == 6 { "joints that do not all turn" } else if *joints == 1 { "joint" } else { "joints" }
    )]
    LayoutJoints {
        /// Joints of the robot.
        joints: usize,
    },
    /// A kind of pose that plans do not have.
    #[error("'{}' is not a kind of pose; write {}", excerpt(text), any_of(allowed))]
    UnknownKind {
        /// Text of the cell.
        text: String,
        /// The kinds there are.
        allowed: Vec<&'static str>,
    },
    /// A plan of nothing but home and via poses.
    #[error("no pose of the plan is measured; it needs rows of kind 'identification' or 'verification'")]
    NothingToMeasure,
    /// A length between a configuration and itself.
    #[error("both ends are the same configuration, but the length is '{}'; correct the joint values", excerpt(text))]
    SameEnds {
        /// Text of the length.
        text: String,
    },
    /// Warning: a socket that was reached once only.
    #[error(
        "this is the only row of position '{}', socket '{}', so it constrains nothing; seat the ball there again in \
         another configuration",
        excerpt(position),
        excerpt(socket)
    )]
    LoneRow {
        /// Place of the plate.
        position: String,
        /// Socket of the plate.
        socket: String,
    },
}

impl Defect {
    /// A defect of the whole table.
    pub(in crate::session) fn of_table(self) -> TableProblem {
        TableProblem { line: None, column: None, defect: self }
    }

    /// A defect of a line, 1-based.
    pub(in crate::session) fn at(self, line: usize) -> TableProblem {
        TableProblem { line: Some(line), column: None, defect: self }
    }

    /// A defect of a cell.
    pub(in crate::session) fn at_cell(self, line: usize, column: &str) -> TableProblem {
        TableProblem { line: Some(line), column: Some(column.to_owned()), defect: self }
    }

    /// Whether the line of column names is at fault, so that it helps to show how it should read.
    const fn is_of_header(&self) -> bool {
        matches!(
            self,
            Self::NoHeader { .. }
                | Self::DuplicateColumn { .. }
                | Self::SameQuantity { .. }
                | Self::JointColumns { .. }
                | Self::MissingColumns { .. }
                | Self::MissingUnits { .. }
                | Self::UnknownUnit { .. }
                | Self::NotConstraints { .. }
                | Self::NoRows
        )
    }
}

/// A defect or warning with its place.
#[derive(Clone, Debug, PartialEq)]
pub struct TableProblem {
    /// 1-based line in the file; `None` when the whole file is meant.
    pub line: Option<usize>,
    /// Name of the column as written in the file.
    pub column: Option<String>,
    /// What is wrong and what to do.
    pub defect: Defect,
}

impl TableProblem {
    /// Whether the table has changed since this program wrote it.
    pub fn is_change(&self) -> bool {
        self.defect == Defect::Changed
    }

    /// Whether a reading has no point.
    pub fn is_without_point(&self) -> bool {
        let name = self.column.as_deref().unwrap_or_default().to_lowercase();
        let is_of_point = name.starts_with(['x', 'y', 'z']);
        matches!(self.defect, Defect::ZeroPoint)
            || (is_of_point && matches!(self.defect, Defect::Empty | Defect::NotFinite { .. }))
    }

    /// Whether it is not clear which sheet of a workbook is meant.
    pub fn is_about_sheets(&self) -> bool {
        matches!(&self.defect, Defect::BadWorkbook { reason } if reason.contains("sheets"))
    }

    /// Whether the names of the columns are at fault.
    pub fn is_of_columns(&self) -> bool {
        self.defect.is_of_header()
            || matches!(
                self.defect,
                Defect::Lacking(_) | Defect::SeveralJointSets { .. } | Defect::SeveralPoints { .. }
            )
    }
}

impl fmt::Display for TableProblem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match (self.line, self.column.as_deref()) {
            (Some(line), Some(column)) => write!(f, "line {line}, column '{}': ", excerpt(column))?,
            (Some(line), None) => write!(f, "line {line}: ")?,
            (None, Some(column)) => write!(f, "column '{}': ", excerpt(column))?,
            (None, None) => {}
        }
        self.defect.fmt(f)
    }
}

/// Everything that is wrong with one table, in the order of its lines. Never empty.
#[derive(Clone, Debug, PartialEq)]
pub struct TableErrors {
    /// Name of the file, as given by the caller.
    pub file: String,
    /// The defects; more than are shown in the text.
    pub problems: Vec<TableProblem>,
    /// How the line of column names should read for this robot; one entry per kind of table.
    pub headers: Vec<String>,
    /// What was understood of the columns, where that can help.
    pub understood: Option<Box<Understood>>,
}

impl TableErrors {
    /// The problems of `file` in the order of its lines.
    pub(in crate::session) fn new(file: &str, mut problems: Vec<TableProblem>, headers: Vec<String>) -> Self {
        problems.sort_by_key(|problem| problem.line);
        Self { file: printable(file), problems, headers, understood: None }
    }
}

impl fmt::Display for TableErrors {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let count = self.problems.len();
        write!(f, "'{}' has {count} {}", self.file, if count == 1 { "problem" } else { "problems" })?;
        for problem in self.problems.iter().take(SHOWN_PROBLEMS) {
            write!(f, "\n  {problem}")?;
        }
        if count > SHOWN_PROBLEMS {
            write!(f, "\n  and {} more", count - SHOWN_PROBLEMS)?;
        }
        if self.problems.iter().any(|problem| problem.defect.is_of_header()) {
            for (index, header) in self.headers.iter().enumerate() {
                let lead = if index == 0 { "hint: for this robot the column names read" } else { "  or" };
                write!(f, "\n{lead} '{header}'")?;
            }
        }
        Ok(())
    }
}

impl std::error::Error for TableErrors {}

/// The beginning of a text, for a message.
fn excerpt(text: &str) -> String {
    let mut shown: String = text.chars().take(SHOWN_CHARACTERS).collect();
    if shown.len() < text.len() {
        shown.push('…');
    }
    printable(&shown)
}

/// `a, b and c`.
fn list(names: &[String]) -> String {
    let shown: Vec<String> = names.iter().map(|name| excerpt(name)).collect();
    match shown.split_last() {
        Some((last, rest)) if !rest.is_empty() => format!("{} and {last}", rest.join(", ")),
        _ => shown.concat(),
    }
}

/// `column a is`, `columns a and b are`.
fn named(columns: &[String], one: &str, several: &str) -> String {
    if columns.len() == 1 {
        format!("column {} {one}", list(columns))
    } else {
        format!("columns {} {several}", list(columns))
    }
}

fn joint_columns(prefix: &str, found: &[String]) -> String {
    match found.len() {
        0 => format!("no joint columns ({prefix}q1 …)"),
        1 => format!("one joint column ({})", list(found)),
        count => format!("{count} joint columns ({})", list(found)),
    }
}

/// `'mm', 'm' or 'in'`.
fn any_of(allowed: &[&str]) -> String {
    let quoted: Vec<String> = allowed.iter().map(|unit| format!("'{unit}'")).collect();
    match quoted.split_last() {
        Some((last, rest)) if !rest.is_empty() => format!("{} or {last}", rest.join(", ")),
        _ => quoted.concat(),
    }
}

fn of_target(target: Option<&str>) -> String {
    target.map_or_else(String::new, |target| format!(" (target '{}')", excerpt(target)))
}
