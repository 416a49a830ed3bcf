//! The layouts a measurement table can have.

use crate::text::{names, written_as_text};

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

names!(Layout { Named = "named", RoboDk = "robodk", Delmia = "delmia", });
written_as_text!(Layout);
