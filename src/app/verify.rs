//! `trupose verify`: a calibration on other data.

use std::error::Error;
use std::io::Write;

use nalgebra::Isometry3;

use super::identify::exit_status;
use super::{Console, advice, load, payload_of, to_json};
use crate::cli::VerifyArgs;
use crate::error::{ExitStatus, Failure};
use crate::identification::verification::{FittedSetup, ModelErrors, fit_setup, fit_targets};
use crate::identification::{Observations, Places, PointSample, Problem};
use crate::kinematics::{Arm, FreeParameter, ParameterId, Place};
use crate::procedure::assess::{point_verification, verdict};
use crate::procedure::checks::{self, Unseen};
use crate::procedure::{ProcedureError, input_file, provenance};
use crate::profile::{Level, Profile};
use crate::report;
use crate::session::calibration::{Calibration, SampleText};
use crate::session::measurements::Row;
use crate::session::set_up::PayloadText;
use crate::session::summary::{
    InputRole, ModelSummary, Provenance, Refit, SCHEMA, VerificationReport, Warning, WarningCode,
};
use crate::text;
use crate::units::{MICROMETRE, MILLIMETRE, to_mm};

/// Prior standard deviation of a remounted target (m).
const NEW_MOUNTING: f64 = 50.0 * MILLIMETRE;
/// Positions this many times worse than distances show that the set-up has changed.
const MOVED: f64 = 10.0;

pub(super) fn run<O: Write, E: Write>(args: &VerifyArgs, console: &mut Console<O, E>) -> Result<ExitStatus, Failure> {
    let file = args.calibration.display().to_string();
    let load::LoadedCalibration { calibration, text, profile } =
        load::calibration(&args.calibration, args.edited, console)?;
    let profile = &calibration.mounted_on(&profile);
    let measured = load::measurements(&args.measurements, &args.layout, (profile, &file), InputRole::Verification)?;
    let filter = load::filter(args.filter.as_deref(), &measured.table.columns)?;
    let (measured_rows, _) = load::split(&measured.table, filter.as_ref())?;
    let all = load::samples(&measured_rows, profile)?;
    if all.is_empty() {
        return Err(Failure::new(ExitStatus::Usage, "no row is left for the verification").hint("check '--use'"));
    }

    let plausible = check_table(args, profile, &all)?;
    let joints = profile.chain().joints();
    let known = identification_places(&calibration, profile, &file)?;
    check_targets(args.refit, profile, &known, &all)?;
    let unseen = Unseen::new(joints, &known, all.iter().map(|sample| &sample.at));
    let counting = measured_rows.iter().zip(&all).zip(&unseen.counts).filter(|(_, counts)| **counts);
    let (rows, samples): (Vec<&Row>, Vec<PointSample>) =
        counting.map(|((row, sample), _)| (*row, sample.clone())).unzip();
    let payload = payload_of(&args.payload, profile)?;
    let models = Models::new(&calibration, profile, payload.as_ref(), &file)?;
    let (nominal, identified) = models.set_up(args.refit, profile, &samples, &file)?;
    let errors = |setup: &FittedSetup| {
        ModelErrors::new(&setup.arm, &setup.base_from_station, &samples)
            .ok_or_else(|| Failure::new(ExitStatus::Numerical, "the frame of the instrument could not be fitted"))
    };
    let (nominal_errors, identified_errors) = (errors(&nominal)?, errors(&identified)?);
    let mut warnings = checks::table_warnings(None, &measured.table.warnings);
    let configurations = measured_rows.iter().map(|row| (row.line, row.configuration.as_slice()));
    warnings.extend(checks::limit_warning(profile, None, configurations));
    warnings.extend(calibration.edited().map(|said| Warning::new(WarningCode::ChangedCalibration, said, false)));
    warnings.extend(carried_over(&calibration));
    let of_calibration = calibration.warnings.iter().find(|warning| warning.code == WarningCode::Simulated);
    warnings.extend(measured.simulated.as_ref().or(of_calibration).cloned());
    warnings.extend(plausible);
    let (basis, fitted) = match args.refit {
        Refit::None => ("same set-up as the identification", 0),
        Refit::Frame => ("another set-up: the position of the tracker was fitted to these same points", 6),
        Refit::Target => {
            let basis = "same place of the tracker: the position of the SMR was fitted to these same points";
            (basis, remounted_targets(profile, &samples).len())
        }
        Refit::FrameAndTarget => {
            let basis = "another set-up: the positions of tracker and SMR were fitted to these same points";
            (basis, 6 + remounted_targets(profile, &samples).len())
        }
    };
    let tested: Vec<Place> = samples.iter().map(|sample| sample.at.clone()).collect();
    let poses = Places::new(joints, &tested).distinct();
    if fitted > 0 && 3 * poses < 4 * fitted {
        let message = format!(
            "{fitted} numbers of the set-up were fitted to only {}: the position errors look better than they are",
            text::counted(poses, "pose")
        );
        warnings.push(Warning::new(WarningCode::FewData, message, true));
    }
    let left_out = unseen.left_out();
    warnings.extend(unseen.warning);
    warnings.extend(checks::set_warnings(profile, &known, &tested));
    warnings.extend(checks::few_warning(samples.len(), poses));
    let named = rows.iter().zip(&identified_errors.vectors);
    warnings.extend(checks::far_warning(named.map(|(row, error)| (row.pose.as_str(), row.line, error))));
    load::settle_changes(&mut warnings, args.edited);
    let mut verification = point_verification(
        joints,
        &samples,
        &nominal_errors,
        &identified_errors,
        format!("'{}', {basis}", measured.input.file),
        args.refit,
    );
    verification.left_out = left_out;
    verification.independent = checks::is_independent(&warnings);
    warnings.extend(checks::better_warning(&verification));
    warnings.sort_by_key(|warning| !warning.blocks_acceptance);
    if args.refit == Refit::None {
        warnings.splice(0..0, moved_set_up(&verification.identified));
    }
    for warning in &mut warnings {
        warning.put_into_words(advice::words);
    }
    let inputs = vec![input_file(InputRole::Calibration, file, text.as_bytes()), measured.input];
    let report = VerificationReport {
        schema: SCHEMA,
        provenance: Provenance {
            serial: calibration.provenance.serial.clone(),
            instrument_serial: calibration.provenance.instrument_serial.clone(),
            ..provenance(profile, &calibration.profile, load::now(), inputs)
        },
        verdict: verdict(profile.acceptance(), Ok(&verification), &warnings, &calibration.sigma),
        warnings,
        verification,
    };
    let text = if args.json { to_json(&report)? } else { report::verification_text(&report) };
    console.print(&text)?;
    Ok(exit_status(report.verdict.status))
}

/// Refuses targets that the calibration does not know, unless they are fitted.
fn check_targets(refit: Refit, profile: &Profile, known: &[Place], samples: &[PointSample]) -> Result<(), Failure> {
    let fitted = match refit {
        Refit::None | Refit::Frame => false,
        Refit::Target | Refit::FrameAndTarget => true,
    };
    // Old calibrations do not list their samples.
    if fitted || known.is_empty() {
        return Ok(());
    }
    let unknown = checks::unknown_targets(profile, known.iter(), samples.iter().map(|sample| &sample.at));
    if unknown.is_empty() {
        return Ok(());
    }
    let message = format!(
        "the calibration does not know where {} {} in the flange: the errors would be those of the guess in the profile",
        text::listed(&unknown),
        if unknown.len() == 1 { "is" } else { "are" }
    );
    let hint = match refit {
        Refit::Frame => "'--refit frame+target' fits it to these points",
        Refit::None | Refit::Target | Refit::FrameAndTarget => "'--refit target' fits it to these points",
    };
    Err(Failure::new(ExitStatus::Usage, message).hint(hint))
}

/// Looks for mistakes in the whole table, as `identify` does.
fn check_table(args: &VerifyArgs, profile: &Profile, samples: &[PointSample]) -> Result<Option<Warning>, Failure> {
    let mut parameters = profile.parameters(Level::Geometric);
    if matches!(args.refit, Refit::Target | Refit::FrameAndTarget) {
        parameters.retain(|parameter| parameter.id.target().is_none());
        parameters.extend(remounted_targets(profile, samples));
    }
    let observations = Observations::default();
    let problem = Problem { arm: &profile.arm(), parameters: &parameters, observations: &observations };
    Ok(checks::check_verification(&problem, samples)?)
}

/// A warning if positions are much worse than distances: only positions depend on where the tracker is.
fn moved_set_up(identified: &ModelSummary) -> Option<Warning> {
    let (position, distance) = (identified.position_mm?.mean, identified.distance_mm?.mean);
    (position > MOVED * distance.max(to_mm(MICROMETRE))).then(|| {
        let message = format!(
            "the distances fit ({} mm), the positions do not ({} mm): the tracker, or the SMR, is not where it was at the identification. '--refit frame' fits the position of the tracker, '--refit frame+target' that of the SMR too",
            text::fixed(distance, 4),
            text::fixed(position, 4)
        );
        Warning::new(WarningCode::AnotherSetUp, message, true)
    })
}

/// A warning if the identification itself was not acceptable: then a good verification is not enough.
fn carried_over(calibration: &Calibration) -> Option<Warning> {
    let codes: Vec<&str> = Warning::blocking(&calibration.warnings).into_iter().map(WarningCode::as_str).collect();
    let message = format!(
        "the calibration itself was not acceptable: {}; good figures here do not change that. Identify again from better data",
        codes.join(", ")
    );
    (!codes.is_empty()).then(|| Warning::new(WarningCode::CalibrationNotAcceptable, message, true))
}

/// The configurations and targets that the calibration was identified from.
fn identification_places(calibration: &Calibration, profile: &Profile, file: &str) -> Result<Vec<Place>, Failure> {
    let joints = profile.chain().joints();
    let place = |(index, sample): (usize, &SampleText)| {
        if sample.joints.len() != joints.len() || sample.target >= profile.targets().len() {
            let message = format!("'{file}': identification sample {} does not fit its profile", index + 1);
            return Err(Failure::new(ExitStatus::Usage, message));
        }
        let values = sample.joints.iter().zip(joints);
        let configuration = values.map(|(value, joint)| joint.joint_type.quantity().from_edge(*value)).collect();
        Ok(Place { configuration, target: sample.target })
    };
    calibration.samples.iter().enumerate().map(place).collect()
}

/// Nominal and identified arm of a calibration with the set-up of its identification.
struct Models {
    nominal: Arm,
    identified: Arm,
    nominal_station: Option<Isometry3<f64>>,
    station: Option<Isometry3<f64>>,
}

impl Models {
    /// The arms of a calibration, with another payload if there is one.
    fn new(
        calibration: &Calibration,
        profile: &Profile,
        payload: Option<&PayloadText>,
        file: &str,
    ) -> Result<Self, Failure> {
        let unusable =
            |error: &dyn Error| Failure::new(ExitStatus::Usage, format!("'{file}': {}", text::causes(error)));
        let identified = calibration.identified(profile).map_err(|error| unusable(&error))?;
        Ok(Self {
            nominal: calibration.nominal(profile).map_err(|error| unusable(&error))?,
            identified: payload
                .map_or_else(|| identified.clone(), |payload| identified.clone().with_payload(payload.mass())),
            nominal_station: calibration.nominal_base_from_station.as_ref().map(Into::into),
            station: calibration.base_from_station.as_ref().map(Into::into),
        })
    }

    /// Both arms with the set-up in which `samples` were measured.
    fn set_up(
        self,
        refit: Refit,
        profile: &Profile,
        samples: &[PointSample],
        file: &str,
    ) -> Result<(FittedSetup, FittedSetup), Failure> {
        let free = match refit {
            Refit::None | Refit::Target => {
                let known = |arm, station: Option<Isometry3<f64>>| -> Result<FittedSetup, Failure> {
                    let base_from_station = vec![station.ok_or_else(|| {
                        Failure::new(ExitStatus::Usage, format!("'{file}' contains no tracker position"))
                            .hint("use '--refit frame' or '--refit frame+target'")
                    })?];
                    if refit == Refit::None {
                        return Ok(FittedSetup { arm, base_from_station, features: Vec::new() });
                    }
                    fit_targets(&arm, &base_from_station, samples).ok_or_else(|| {
                        Failure::new(ExitStatus::Numerical, "the position of the SMR could not be fitted")
                    })
                };
                return Ok((known(self.nominal, self.nominal_station)?, known(self.identified, self.station)?));
            }
            Refit::Frame => Vec::new(),
            Refit::FrameAndTarget => remounted_targets(profile, samples),
        };
        let observations = Observations { points: samples.to_vec(), ..Observations::default() };
        let fit = |arm: &Arm| fit_setup(arm, &free, &observations).map_err(ProcedureError::from);
        Ok((fit(&self.nominal)?, fit(&self.identified)?))
    }
}

/// Free coordinates of all targets that the samples contain.
fn remounted_targets(profile: &Profile, samples: &[PointSample]) -> Vec<FreeParameter> {
    (0..profile.targets().len())
        .filter(|target| samples.iter().any(|sample| sample.at.target == *target))
        .flat_map(ParameterId::of_target)
        .map(|id| FreeParameter { id, expected: NEW_MOUNTING })
        .collect()
}
