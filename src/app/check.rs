//! `trupose check`: whether a calibration still holds.

use std::error::Error;
use std::io::Write;
use std::path::Path;

use serde::Serialize;

use super::{Console, advice, load, to_json};
use crate::cli::check::{CheckArgs, CheckCommand, CheckPlanArgs};
use crate::error::{ExitStatus, Failure};
use crate::procedure::health::{self, HealthError, HealthRequest, Mounting};
use crate::procedure::identify::NamedSample;
use crate::procedure::known::Known;
use crate::procedure::{checks, input_file, joint_types, plan as planner, provenance};
use crate::report;
use crate::session::health::{ForecastSummary, HealthVerdict};
use crate::session::plan;
use crate::session::summary::{InputRole, Warning, WarningCode};
use crate::store;
use crate::text::causes;
use crate::units::from_mm;

pub(super) fn run<O: Write, E: Write>(
    command: &CheckCommand,
    console: &mut Console<O, E>,
) -> Result<ExitStatus, Failure> {
    match command {
        CheckCommand::Plan(args) => write_plan(args, console),
        CheckCommand::Evaluate(args) => evaluate(args, console),
    }
}

/// What the calibration in a file knows of its arm.
pub(super) fn known<O: Write, E: Write>(
    path: &Path,
    edited: bool,
    console: &mut Console<O, E>,
) -> Result<(load::LoadedCalibration, Known), Failure> {
    let loaded = load::calibration(path, edited, console)?;
    let known = Known::new(&loaded.calibration, &loaded.profile)
        .map_err(|error| Failure::new(ExitStatus::Usage, format!("'{}': {}", path.display(), causes(&error))))?;
    Ok((loaded, known))
}

const fn mounting(same: bool) -> Mounting {
    if same { Mounting::Same } else { Mounting::New }
}

/// A planned check as JSON.
#[derive(Debug, Serialize)]
struct PlannedCheck<'a> {
    poses: usize,
    minutes: Option<f64>,
    zeros: &'a [ForecastSummary],
    warnings: &'a [Warning],
    written: &'a Path,
}

fn write_plan<O: Write, E: Write>(args: &CheckPlanArgs, console: &mut Console<O, E>) -> Result<ExitStatus, Failure> {
    let (loaded, known) = known(&args.calibration, args.edited, console)?;
    let request = health::plan_request(load::now(), args.poses);
    let profile = &health::planned_profile(&known.profile, mounting(args.same_smr));
    let mut summary = planner::plan(profile, &loaded.calibration.profile, &request, &|| true, &|_| {})?;
    let types = joint_types(profile);
    let rows = planner::rows(&summary, &types);
    let places: Vec<_> = rows
        .iter()
        .filter(|row| row.kind.is_measured())
        .map(|row| crate::kinematics::Place { configuration: row.configuration.clone(), target: 0 })
        .collect();
    let zeros = health::forecast(&known, &places, mounting(args.same_smr)).map_err(|error| failure(&error))?;
    store::replace(&args.out, &plan::write(&rows, &types))
        .map_err(|error| Failure::from_error(ExitStatus::Store, &error))?;
    // What the poses of a check cannot find of other parameters is no fault of theirs.
    summary.warnings.retain(|warning| !matches!(warning.code, WarningCode::PoorData));
    for warning in &mut summary.warnings {
        warning.put_into_words(advice::words);
    }
    let minutes = summary.time.as_ref().map(|time| time.total_min);
    let planned =
        PlannedCheck { poses: places.len(), minutes, zeros: &zeros, warnings: &summary.warnings, written: &args.out };
    if args.json {
        console.print(&to_json(&planned)?)?;
    } else {
        for warning in &summary.warnings {
            console.remark(&format!("note: {}", warning.message));
        }
        console.print(&report::forecast_text(places.len(), minutes, &zeros, &args.out.display().to_string()))?;
    }
    Ok(ExitStatus::Accepted)
}

fn evaluate<O: Write, E: Write>(args: &CheckArgs, console: &mut Console<O, E>) -> Result<ExitStatus, Failure> {
    let (loaded, known) = known(&args.calibration, args.edited, console)?;
    let profile = &known.profile;
    let file = args.calibration.display().to_string();
    let measured = load::measurements(&args.measurements, "named", (profile, &file), InputRole::Verification)?;
    let rows: Vec<_> = measured.table.distinct_rows().collect();
    let samples = rows.iter().zip(load::samples(&rows, profile)?).map(|(row, sample)| NamedSample {
        pose: row.pose.clone(),
        line: row.line,
        sample,
        temperature: row.temperature,
    });
    let mut warnings = checks::table_warnings(None, &measured.table.warnings);
    let configurations = rows.iter().map(|row| (row.line, row.configuration.as_slice()));
    warnings.extend(checks::limit_warning(profile, None, configurations));
    warnings.extend(measured.simulated.clone());
    load::settle_changes(&mut warnings, args.edited);
    let inputs = vec![input_file(InputRole::Calibration, file, loaded.text.as_bytes()), measured.input.clone()];
    let request = HealthRequest {
        known: &known,
        calibrated: loaded.calibration.provenance.created.clone(),
        samples: samples.collect(),
        mounting: mounting(args.same_smr),
        sigma: args.sigma_mm.map(from_mm),
        limit: args.limit_mm.map(from_mm).or_else(|| health::limit_of(profile)),
        provenance: provenance(profile, &loaded.calibration.profile, load::now(), inputs),
        warnings,
    };
    let summary = health::evaluate(&request).map_err(|error| failure(&error))?;
    console.print(&if args.json { to_json(&summary)? } else { report::health_text(&summary) })?;
    Ok(match summary.verdict {
        HealthVerdict::StillValid => ExitStatus::Accepted,
        HealthVerdict::ZeroMoved { .. }
        | HealthVerdict::Changed { .. }
        | HealthVerdict::MeasureAgain { .. }
        | HealthVerdict::Undecided { .. } => ExitStatus::NotAccepted,
    })
}

fn failure(error: &HealthError) -> Failure {
    let status = match error {
        HealthError::Singular | HealthError::Setup(_) => ExitStatus::Numerical,
        HealthError::Known(_) | HealthError::FewPoses { .. } => ExitStatus::Usage,
    };
    Failure::new(status, causes(error as &dyn Error))
}
