//! `trupose compare`: what has changed between calibrations.

use std::io::Write;
use std::path::{Path, PathBuf};

use super::{Console, check, load, to_json};
use crate::checksum::{self, Syntax};
use crate::cli::compare::CompareArgs;
use crate::error::{ExitStatus, Failure};
use crate::procedure::compare::{CompareError, compare, curves, open_error};
use crate::procedure::health::Mounting;
use crate::procedure::known::Known;
use crate::report;
use crate::session::comparison::{CalibrationPart, ComparisonSummary, PairSummary, SCHEMA};
use crate::session::summary::{Warning, WarningCode};
use crate::store;
use crate::text::causes;
use crate::units::to_mm;

/// The name of the file in a folder.
const CALIBRATION: &str = "calibration.ron";

/// The calibration in a folder, or the file itself.
fn file_of(path: &Path) -> PathBuf {
    if path.is_dir() { path.join(CALIBRATION) } else { path.to_owned() }
}

pub(super) fn run<O: Write, E: Write>(args: &CompareArgs, console: &mut Console<O, E>) -> Result<ExitStatus, Failure> {
    let mounting = if args.same_smr { Mounting::Same } else { Mounting::New };
    let mut all = Vec::new();
    for path in &args.calibrations {
        let file = file_of(path);
        let (loaded, known) = check::known(&file, args.edited, console)?;
        all.push((file.display().to_string(), loaded, known));
    }
    let Some((_, first, _)) = all.first() else {
        return Err(Failure::new(ExitStatus::Usage, "there is nothing to compare"));
    };
    let mut calibrations = Vec::new();
    let mut warnings = Vec::new();
    for (file, loaded, known) in &all {
        let open = open_error(known, mounting).map_err(|error| failure(&error))?;
        calibrations.push(CalibrationPart {
            file: file.clone(),
            created: loaded.calibration.provenance.created.clone(),
            poses: known.places.len(),
            sigma_mm: to_mm(known.sigma),
            open_mm: to_mm(open),
        });
        if let Some(said) = loaded.calibration.edited() {
            warnings.push(Warning::new(WarningCode::ChangedCalibration, format!("'{file}': {said}"), false));
        }
    }
    let last = all.len() - 1;
    let in_turn = (0..last).map(|index| (index, index + 1));
    let pairs: Vec<(usize, usize)> = in_turn.chain((last > 1).then_some((0, last))).collect();
    let compared = |(from, to): (usize, usize)| -> Result<PairSummary, Failure> {
        let ((_, one, before), (_, other, after)): (&Loaded, &Loaded) = (&all[from], &all[to]);
        let pair = compare(before, after, mounting).map_err(|error| failure(&error))?;
        let curves = curves(&one.calibration.joint_errors, &other.calibration.joint_errors);
        Ok(PairSummary { from, to, curves, ..pair })
    };
    let provenance = &first.calibration.provenance;
    let summary = ComparisonSummary {
        schema: SCHEMA,
        program: provenance.program.clone(),
        created: load::now(),
        robot: provenance.robot.clone(),
        profile: provenance.profile.clone(),
        warnings,
        calibrations,
        pairs: pairs.into_iter().map(compared).collect::<Result<_, _>>()?,
    };
    if let Some(file) = &args.html {
        let page = checksum::with_sum(&report::comparison_html(&summary), Syntax::Html);
        store::replace(file, &page).map_err(|error| Failure::from_error(ExitStatus::Store, &error))?;
    }
    console.print(&if args.json { to_json(&summary)? } else { report::comparison_text(&summary) })?;
    let has_changed = summary.pairs.iter().any(|pair| pair.has_changed);
    Ok(if has_changed { ExitStatus::NotAccepted } else { ExitStatus::Accepted })
}

/// A calibration with its file and what it knows.
type Loaded = (String, load::LoadedCalibration, Known);

fn failure(error: &CompareError) -> Failure {
    let status = match error {
        CompareError::Singular => ExitStatus::Numerical,
        CompareError::Known(_) | CompareError::OtherRobot => ExitStatus::Usage,
    };
    Failure::new(status, causes(error))
}
