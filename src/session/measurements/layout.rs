//! The layouts a measurement table can have.

use std::fmt;
use std::str::FromStr;

use thiserror::Error;

use crate::text::written_as_text;

/// How the cells of a measurement table are arranged.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Layout {
    /// Named columns with units, in any order: trupose's own.
    #[default]
    Named,
    /// The table of RoboDK's calibration: 12 columns, the first line ignored. Six joints (degree), the measured point
    /// (mm), the centre of the target in the flange frame (RoboDK's "TCP") (mm).
    RoboDk,
    /// A table of DELMIA, tabs between the cells, the first line ignored: name of the pose, one value per joint
    /// [degree, sliding joints mm], the measured point (mm).
    ///
    /// DELMIA publishes no fixed layout. This is an assumption, kept narrow: a table with another number of columns is
    /// refused, never guessed at.
    Delmia,
}

impl Layout {
    /// All layouts.
    pub const ALL: [Self; 3] = [Self::Named, Self::RoboDk, Self::Delmia];

    /// The name a user gives: `named`, `robodk`, `delmia`.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Named => "named",
            Self::RoboDk => "robodk",
            Self::Delmia => "delmia",
        }
    }
}

written_as_text!(Layout);

impl fmt::Display for Layout {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// A layout that is not known.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[error("there is no table layout '{name}'; it is one of 'named', 'robodk' and 'delmia'")]
pub struct UnknownLayout {
    /// What was asked for.
    pub name: String,
}

impl FromStr for Layout {
    type Err = UnknownLayout;

    fn from_str(name: &str) -> Result<Self, Self::Err> {
        let known = Self::ALL.into_iter().find(|layout| layout.name().eq_ignore_ascii_case(name));
        known.ok_or_else(|| UnknownLayout { name: crate::text::printable(name) })
    }
}
