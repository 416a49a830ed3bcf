//! `--record`: the targets as they are meant and as they are commanded, for a 3D viewer.

use std::path::Path;

use jiff::Timestamp;
use nalgebra::{Isometry3, Point3};

use super::super::record;
use crate::error::Failure;
use crate::recording::{DrawnTarget, write_targets};

/// Writes the picture of named targets: where the tool is to be, and where the nominal arm has it at the command.
pub(super) fn write(path: &Path, targets: impl Iterator<Item = (String, [Isometry3<f64>; 2])>) -> Result<(), Failure> {
    record::check_target(path)?;
    let point = |pose: &Isometry3<f64>| Point3::from(pose.translation.vector);
    let drawn = targets.map(|(name, [meant, commanded])| DrawnTarget {
        name,
        meant: point(&meant),
        commanded: point(&commanded),
    });
    write_targets(path, Timestamp::now(), &drawn.collect::<Vec<_>>()).map_err(|error| record::failure(&error))
}
