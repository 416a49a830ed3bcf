//! `trupose identify`.

use std::io::Write;
use std::path::Path;

use super::assess::point_verification;
use super::estimate::{self, Finished, SampleName, Special, nominal_targets};
use super::result::{self, Context};
use super::{Console, checks, load, to_json};
use crate::cli::{EstimationArgs, IdentifyArgs, WeightingArg};
use crate::error::{ExitStatus, Failure};
use crate::identification::verification::{FittedSetup, ModelErrors, fit_setup};
use crate::identification::{ArmModel, Identification, Observations, PointSample, Problem, TargetAt, Weighting};
use crate::profile::{Level, Profile};
use crate::report;
use crate::session::calibration::{self, Calibration, SampleText};
use crate::session::measurements::Row;
use crate::session::summary::{IdentificationSummary, VerdictStatus, VerificationMode, VerificationSummary, Warning};
use crate::store;
use crate::units::to_mm;

pub(super) fn run<O: Write, E: Write>(args: &IdentifyArgs, console: &mut Console<O, E>) -> Result<ExitStatus, Failure> {
    let estimation = &args.estimation;
    let loaded = load::profile(&estimation.profile)?;
    let profile = &loaded.profile;
    for diagnostic in &loaded.warnings {
        console.remark(&diagnostic.to_string());
    }
    let identification = load::measurements(&args.measurements, args.layout, profile, "identification")?;
    let filter = load::filter(estimation.filter.as_deref(), &identification.table.columns)?;
    let (rows, rest) = load::split(&identification.table, filter.as_ref())?;
    let verification =
        args.verify.as_ref().map(|path| load::measurements(path, args.layout, profile, "verification")).transpose()?;
    let (verification_rows, basis) = match &verification {
        Some(loaded) => (load::split(&loaded.table, None)?.0, format!("'{}', same set-up", loaded.input.file)),
        None if args.verify_rest => (rest, "the rows that '--use' leaves out".to_owned()),
        None => (Vec::new(), String::new()),
    };
    if (args.verify_rest || verification.is_some()) && verification_rows.is_empty() {
        return Err(Failure::new(ExitStatus::Usage, "no row is left for the verification")
            .hint("'--use' must leave some rows out"));
    }

    let samples = load::samples(&rows, profile)?;
    let verification_samples = load::samples(&verification_rows, profile)?;
    let names: Vec<SampleName> = rows.iter().map(|row| SampleName { pose: row.pose.clone(), line: row.line }).collect();
    let parameters = estimate::parameters(estimation, profile);
    let targets = nominal_targets(profile);
    let observations = Observations { points: samples, ..Observations::default() };
    let problem =
        Problem { chain: profile.chain(), targets: &targets, parameters: &parameters, observations: &observations };

    // With two files in play, what is said about rows names the file.
    let file = verification.as_ref().map(|_| identification.input.file.as_str());
    let mut warnings = checks::table_warnings(file, &identification.table.warnings);
    warnings.extend(checks::limit_warning(profile, file, configurations(&rows)));
    let expected = estimate::parameters_of(Level::Geometric, estimation, profile);
    let compared = checks::check_plausibility(&Problem { parameters: &expected, ..problem })?;
    warnings.extend(compared.warning);

    let distance = observations.points.iter().map(|sample| sample.point.coords.norm()).sum::<f64>()
        / observations.points.len().max(1) as f64;
    let weighting = match args.weighting {
        WeightingArg::Covariance => Weighting::Covariance,
        WeightingArg::Uniform => Weighting::Uniform,
    };
    let settings = estimate::settings(estimation, weighting, profile, Some(distance));
    let found = estimate::solve(&problem, &settings, console)?;
    let context = Context { level: estimation.level, expected: Some(compared.expected) };
    warnings.extend(result::result_warnings(&problem, &found, &settings, context));

    let nominal = nominal_setup(&problem, &found)?;
    let of_identification = warnings.clone();
    let file = verification.as_ref().map(|loaded| loaded.input.file.as_str());
    if let Some(loaded) = &verification {
        warnings.extend(checks::table_warnings(file, &loaded.table.warnings));
    }
    warnings.extend(checks::limit_warning(profile, file, configurations(&verification_rows)));
    let mut checked = verify(profile, &nominal, &found, &verification_samples, basis);
    if let Some(checked) = &mut checked {
        let places = |samples: &[PointSample]| samples.iter().map(|sample| sample.at.clone()).collect::<Vec<_>>();
        let (known, tested) = (places(&observations.points), places(&verification_samples));
        let doubts = checks::set_warnings(profile.chain().joints(), &known, &tested);
        checked.independent = checks::is_independent(&doubts);
        warnings.extend(doubts);
        warnings.extend(checks::few_warning(checked.samples));
    }
    warnings.sort_by_key(|warning| !warning.blocks_acceptance);
    let unusable = result::is_unusable(&warnings, &found, &settings);
    let special = Special {
        layout: Some(args.layout.to_string()),
        verification: match (&verification, args.verify_rest) {
            (Some(_), _) => VerificationMode::File,
            (None, true) => VerificationMode::Rest,
            (None, false) => VerificationMode::None,
        },
        ..Special::default()
    };
    let inputs = [Some(identification.input), verification.map(|loaded| loaded.input)].into_iter().flatten().collect();
    let finished = Finished {
        args: estimation,
        loaded: &loaded,
        inputs,
        settings: &settings,
        special,
        found: &found,
        names: &names,
        warnings,
        verification: checked,
    };
    let summary = finished.summary();
    let calibration =
        (!unusable).then(|| calibration(&summary, &loaded.text, &nominal, &problem, of_identification, Some(&found)));
    deliver(summary, calibration.as_ref(), estimation, console)
}

/// Line and configuration of rows.
pub(super) fn configurations<'a>(rows: &[&'a Row]) -> impl Iterator<Item = (usize, &'a [f64])> {
    rows.iter().map(|row| (row.line, row.configuration.as_slice()))
}

/// The nominal arm with frame and free target fitted to the accepted identification samples.
fn nominal_setup(problem: &Problem<'_>, found: &Identification) -> Result<FittedSetup, Failure> {
    let points: Vec<PointSample> = problem
        .observations
        .points
        .iter()
        .enumerate()
        .filter(|(index, _)| !found.is_rejected(*index))
        .map(|(_, sample)| sample.clone())
        .collect();
    let accepted = Observations { points, ..problem.observations.clone() };
    let model = ArmModel { chain: problem.chain.clone(), targets: problem.targets.to_vec() };
    fit_setup(&model, &estimate::target_parameters(problem.parameters), &accepted)
        .map_err(|error| estimate::identification_failure(&error))
}

fn verify(
    profile: &Profile,
    nominal: &FittedSetup,
    found: &Identification,
    samples: &[PointSample],
    basis: String,
) -> Option<VerificationSummary> {
    let nominal = ModelErrors::new(&nominal.model, &nominal.base_from_station, samples)?;
    let identified = ModelErrors::new(&found.model, &found.base_from_station, samples)?;
    Some(point_verification(profile.chain().joints(), samples, &nominal, &identified, basis, "none"))
}

/// The calibration file of a result; `warnings` are those about the identification itself.
pub(super) fn calibration(
    summary: &IdentificationSummary,
    profile_text: &str,
    nominal: &FittedSetup,
    problem: &Problem<'_>,
    warnings: Vec<Warning>,
    found: Option<&Identification>,
) -> Calibration {
    let station = found.and_then(|found| found.base_from_station.first());
    let joints = problem.chain.joints();
    let sample = |at: &TargetAt| {
        let values = at.configuration.iter().zip(joints);
        SampleText::new(at.target, values.map(|(value, joint)| joint.joint_type.quantity().to_edge(*value)))
    };
    Calibration {
        schema: calibration::SCHEMA,
        provenance: summary.provenance.clone(),
        settings: summary.settings.clone(),
        sigma: summary.sigma.clone(),
        verdict: summary.verdict.clone(),
        warnings,
        rank: summary.rank,
        parameters: summary.parameters.clone(),
        base_from_station: station.map(Into::into),
        nominal_base_from_station: nominal.base_from_station.first().map(Into::into),
        nominal_targets_mm: nominal
            .model
            .targets
            .iter()
            .map(|point| (to_mm(point.x), to_mm(point.y), to_mm(point.z)))
            .collect(),
        samples: problem.observations.places().map(sample).collect(),
        profile: profile_text.to_owned(),
    }
}

/// Writes the result files and prints the summary: also where writing fails, so that the numbers are not lost. Without a
/// `calibration` there is no usable solution, and only the report is written.
pub(super) fn deliver<O: Write, E: Write>(
    mut summary: IdentificationSummary,
    calibration: Option<&Calibration>,
    args: &EstimationArgs,
    console: &mut Console<O, E>,
) -> Result<ExitStatus, Failure> {
    let mut failed = None;
    if let Some(folder) = &args.out {
        failed = save(&mut summary, calibration, folder).err();
        if failed.is_some() {
            summary.written.clear();
        }
    }
    let text = if args.json { to_json(&summary)? } else { report::identification_text(&summary) };
    console.print(&text)?;
    if let Some(failure) = failed {
        return Err(failure.hint("choose another folder with '--out'"));
    }
    if calibration.is_none() {
        if args.out.is_some() {
            console.remark("not written: calibration.ron, because there is no usable solution");
            if args.out.as_ref().is_some_and(|folder| folder.join("calibration.ron").exists()) {
                console.remark("the calibration.ron in that folder is from an earlier run");
            }
        }
        return Ok(ExitStatus::Numerical);
    }
    Ok(exit_status(summary.verdict.status))
}

/// Writes the result files into `folder` and lists them in the summary.
fn save(summary: &mut IdentificationSummary, calibration: Option<&Calibration>, folder: &Path) -> Result<(), Failure> {
    let store_failure = |error: store::StoreError| Failure::from_error(ExitStatus::Store, &error);
    store::create_folder(folder).map_err(store_failure)?;
    if let Some(calibration) = calibration {
        let text = calibration.to_text().map_err(|error| Failure::from_error(ExitStatus::Internal, &error))?;
        let file = folder.join("calibration.ron");
        store::replace(&file, &text).map_err(store_failure)?;
        summary.written.push(file.display().to_string());
    }
    let file = folder.join("report.json");
    summary.written.push(file.display().to_string());
    store::replace(&file, &to_json(summary)?).map_err(store_failure)
}

/// 1 only where limits were checked and not met.
pub(super) fn exit_status(verdict: VerdictStatus) -> ExitStatus {
    if verdict == VerdictStatus::NotAccepted { ExitStatus::NotAccepted } else { ExitStatus::Accepted }
}
