//! `trupose identify`.

use std::io::Write;
use std::path::Path;

use super::assess::{point_verification, set_warnings};
use super::estimate::{self, Finished, SampleName, nominal_targets, warning};
use super::{Console, load, to_json};
use crate::cli::{IdentifyArgs, WeightingArg};
use crate::error::{ExitStatus, Failure};
use crate::identification::plausibility::{Plausibility, compare_with_nominal};
use crate::identification::verification::{FittedSetup, ModelErrors, fit_setup};
use crate::identification::{ArmModel, Identification, Observations, PointSample, Problem, Weighting};
use crate::profile::Profile;
use crate::report;
use crate::session::calibration::{self, Calibration};
use crate::session::measurements::{Measurements, Row};
use crate::session::summary::{IdentificationSummary, VerificationSummary, Warning};
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

    let mut warnings = table_warnings(&identification.table);
    if let Some(loaded) = &verification {
        warnings.extend(table_warnings(&loaded.table));
    }
    warnings.extend(limit_warnings(profile, &rows));
    warnings.extend(limit_warnings(profile, &verification_rows));
    warnings.extend(check_plausibility(&problem)?);

    let distance = observations.points.iter().map(|sample| sample.point.coords.norm()).sum::<f64>()
        / observations.points.len().max(1) as f64;
    let weighting = match args.weighting {
        WeightingArg::Covariance => Weighting::Covariance,
        WeightingArg::Uniform => Weighting::Uniform,
    };
    let settings = estimate::settings(estimation, weighting, profile, Some(distance));
    let found = estimate::solve(&problem, &settings, console)?;
    warnings.extend(estimate::result_warnings(&problem, &found, &settings));

    let nominal = nominal_setup(&problem, &found)?;
    let checked = verify(profile, &nominal, &found, &verification_samples, basis);
    if checked.is_some() {
        warnings.extend(set_warnings(profile.chain().joints(), &observations.points, &verification_samples));
    }
    warnings.sort_by_key(|warning| !warning.blocks_acceptance);
    let inputs = [Some(identification.input), verification.map(|loaded| loaded.input)].into_iter().flatten().collect();
    let finished = Finished {
        args: estimation,
        loaded: &loaded,
        inputs,
        settings: &settings,
        found: &found,
        names: &names,
        warnings,
        verification: checked,
    };
    let summary = finished.summary();
    let calibration = calibration(&summary, &loaded.text, &nominal, Some(&found));
    deliver(summary, &calibration, estimation.out.as_deref(), estimation.json, console)
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

fn table_warnings(table: &Measurements) -> Vec<Warning> {
    table.warnings.iter().map(|problem| warning("table", problem.to_string(), false)).collect()
}

/// Rows whose joints are outside the limits of the profile.
fn limit_warnings(profile: &Profile, rows: &[&Row]) -> Option<Warning> {
    const SHOWN: usize = 3;
    let joints = profile.chain().joints();
    let mut outside = Vec::new();
    for row in rows {
        for ((joint, range), value) in joints.iter().zip(profile.joints()).zip(&row.configuration) {
            let quantity = joint.joint_type.quantity();
            if let Some((low, high)) = range.limits
                && !(low - 1e-9..=high + 1e-9).contains(value)
            {
                outside.push(format!(
                    "line {}: {} at {:.2} {unit}, allowed {:.2}…{:.2} {unit}",
                    row.line,
                    joint.name,
                    quantity.to_edge(*value),
                    quantity.to_edge(low),
                    quantity.to_edge(high),
                    unit = quantity.unit()
                ));
            }
        }
    }
    let more = outside.len().saturating_sub(SHOWN);
    let list = outside.iter().take(SHOWN).cloned().collect::<Vec<_>>().join("; ");
    let tail = if more > 0 { format!("; and {more} more") } else { String::new() };
    (!outside.is_empty()).then(|| {
        warning("joint_limits", format!("joint values outside the limits of the profile (degrees and radians mixed up, or another robot?): {list}{tail}"), false)
    })
}

/// Refuses data that a known mistake explains better than this robot does.
fn check_plausibility(problem: &Problem<'_>) -> Result<Vec<Warning>, Failure> {
    let plausibility = compare_with_nominal(problem).map_err(|error| estimate::identification_failure(&error))?;
    if plausibility.is_plausible() {
        return Ok(Vec::new());
    }
    let Plausibility { nominal, expected, mistake } = &plausibility;
    let joints = problem.chain.joints();
    let gap = format!(
        "the measured points are typically {:.1} mm off the nominal robot, {:.1} mm can be expected",
        to_mm(*nominal),
        to_mm(*expected)
    );
    match mistake {
        Some(mistake) => {
            let text = mistake.describe(|joint| joints[joint].name.clone());
            Err(Failure::new(ExitStatus::Usage, format!("{gap}: {text}")))
        }
        None => Ok(vec![warning(
            "implausible",
            format!(
                "{gap}, and no single mistake explains it (rows in another order, another robot, two joints wrong?)"
            ),
            true,
        )]),
    }
}

/// The calibration file of a result.
pub(super) fn calibration(
    summary: &IdentificationSummary,
    profile_text: &str,
    nominal: &FittedSetup,
    found: Option<&Identification>,
) -> Calibration {
    let station = found.and_then(|found| found.base_from_station.first());
    Calibration {
        schema: calibration::SCHEMA,
        provenance: summary.provenance.clone(),
        settings: summary.settings.clone(),
        sigma: summary.sigma.clone(),
        verdict: summary.verdict.clone(),
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
        profile: profile_text.to_owned(),
    }
}

/// Writes the result files and prints the summary.
pub(super) fn deliver<O: Write, E: Write>(
    mut summary: IdentificationSummary,
    calibration: &Calibration,
    out: Option<&Path>,
    json: bool,
    console: &mut Console<O, E>,
) -> Result<ExitStatus, Failure> {
    if let Some(folder) = out {
        let store_failure = |error: store::StoreError| Failure::from_error(ExitStatus::Store, &error);
        store::create_folder(folder).map_err(store_failure)?;
        let text = calibration.to_text().map_err(|error| Failure::from_error(ExitStatus::Internal, &error))?;
        let (calibration_file, report_file) = (folder.join("calibration.ron"), folder.join("report.json"));
        summary.written = vec![calibration_file.display().to_string(), report_file.display().to_string()];
        store::replace(&calibration_file, &text).map_err(store_failure)?;
        store::replace(&report_file, &to_json(&summary)?).map_err(store_failure)?;
    }
    let text = if json { to_json(&summary)? } else { report::identification_text(&summary) };
    console.print(&text)?;
    Ok(exit_status(&summary.verdict.status))
}

/// 1 only where limits were checked and not met.
pub(super) fn exit_status(verdict: &str) -> ExitStatus {
    if verdict == "not_accepted" { ExitStatus::NotAccepted } else { ExitStatus::Accepted }
}
