//! `trupose constraints`: identification from direct distances, without any coordinates.

use std::collections::BTreeMap;
use std::io::Write;

use super::identify::deliver;
use super::load::{self, LoadedProfile};
use super::progress::Progress;
use super::{Console, advice, estimation_settings, record};
use crate::cli::ConstraintsArgs;
use crate::error::{ExitStatus, Failure};
use crate::identification::verification::{DirectErrors, FittedSetup, fit_setup};
use crate::identification::{
    Identification, Length, LengthEnd, Observations, Problem, Settings, SharedPoint, Weighting, identify,
};
use crate::kinematics::{Arm, FreeParameter, Place};
use crate::procedure::assess::{direct_summary, joint_summaries};
use crate::procedure::identify::calibration;
use crate::procedure::result::{self, Context};
use crate::procedure::summary::{Finished, SampleName};
use crate::procedure::{EstimationSettings, ProcedureError, checks, input_file, joint_types, target_parameters};
use crate::session::constraints::{Constraints, SharedPoints, read_constraints_bytes};
use crate::session::filter::Filter;
use crate::session::summary::{
    IdentificationSettings, InputRole, ModelSummary, Refit, VerificationMode, VerificationSummary, Warning,
};
use crate::store;
use crate::units::from_mm;

/// Observations with the names that belong to them, one place after the other.
#[derive(Clone, Debug, Default)]
struct Named {
    observations: Observations,
    names: Vec<SampleName>,
    /// Position of the plate per shared point.
    positions: Vec<String>,
}

pub(super) fn run<O: Write, E: Write>(
    args: &ConstraintsArgs,
    console: &mut Console<O, E>,
) -> Result<ExitStatus, Failure> {
    let estimation = &args.estimation;
    let loaded = load::profile(&estimation.profile)?;
    for diagnostic in &loaded.warnings {
        console.remark(&diagnostic.to_string());
    }
    let bytes = store::read(&args.measurements).map_err(|error| Failure::from_error(ExitStatus::Usage, &error))?;
    let file = args.measurements.display().to_string();
    let table = read_constraints_bytes(&bytes, &file, &joint_types(&loaded.profile))
        .map_err(|errors| Failure::new(ExitStatus::Usage, errors.to_string()))?;
    let (columns, table_warnings) = match &table {
        Constraints::SharedPoints(shared) => (&shared.columns, &shared.warnings),
        Constraints::Lengths(lengths) => (&lengths.columns, &lengths.warnings),
    };
    let mut warnings = checks::table_warnings(None, table_warnings);
    warnings.extend(checks::limit_warning(&loaded.profile, None, configurations(&table)));
    let filter = load::filter(estimation.filter.as_deref(), columns)?;
    let (identification, rest) = match &table {
        Constraints::SharedPoints(shared) => (
            shared_points(args, shared, |fields, line| keep(filter.as_ref(), columns, fields, line, true))?,
            shared_points(args, shared, |fields, line| keep(filter.as_ref(), columns, fields, line, false))?,
        ),
        Constraints::Lengths(lengths) => {
            if args.leave_one_out.is_some() || args.socket_distance_mm.is_some() {
                return Err(Failure::new(
                    ExitStatus::Usage,
                    "'--leave-one-out' and '--socket-distance-mm' belong to tables with shared points; this one holds lengths",
                ));
            }
            let of = |wanted: bool| -> Result<Named, Failure> {
                let mut named = Named::default();
                for row in &lengths.rows {
                    if keep(filter.as_ref(), columns, &row.fields, row.line, wanted)? {
                        let end = |q: &Vec<f64>| LengthEnd::Target(Place { configuration: q.clone(), target: 0 });
                        let (from, to) = (end(&row.from), end(&row.to));
                        named.observations.lengths.push(Length { from, to, length: row.length, sigma: row.sigma });
                        let name = |side: &str| SampleName { pose: side.to_owned(), line: row.line };
                        named.names.extend([name("from"), name("to")]);
                    }
                }
                Ok(named)
            };
            (of(true)?, of(false)?)
        }
    };
    if matches!(table, Constraints::SharedPoints(_)) && identification.observations.lengths.is_empty() {
        let message = "shared points without any known length leave the size of the robot to the prior; give '--socket-distance-mm'";
        warnings.push(Warning::new("no_scale", message.to_owned(), true));
    }

    let setup = Setup::new(args, &loaded);
    let found = setup.identify(&identification.observations, console)?;
    let problem = setup.problem(&identification.observations);
    let context = Context { level: setup.estimation.level, expected: None };
    warnings.extend(result::result_warnings(&problem, &found, &setup.settings, context));
    let of_identification = warnings.clone();
    let mut verification = if args.verify_rest {
        if rest.observations.places().next().is_none() {
            return Err(Failure::new(ExitStatus::Usage, "no row is left for the verification")
                .hint("'--use' must leave some rows out"));
        }
        Some(setup.verify(&identification.observations, &rest.observations, &found)?)
    } else if args.leave_one_out.is_some() {
        Some(setup.leave_one_out(&identification, console)?)
    } else {
        None
    };
    if let Some(verification) = &mut verification {
        let joints = loaded.profile.chain().joints();
        if args.verify_rest {
            let places = |named: &Named| named.observations.places().cloned().collect::<Vec<_>>();
            warnings.extend(checks::set_warnings(joints, &places(&identification), &places(&rest)));
            verification.independent = checks::is_independent(&warnings);
        }
        let tested = if args.verify_rest { &rest } else { &identification };
        let poses = tested.observations.distinct(joints).min(verification.samples);
        warnings.extend(checks::few_warning(verification.samples, poses));
    }
    let nominal = setup.nominal(&identification.observations)?;
    let unusable = result::is_unusable(&warnings, &found, &setup.settings);
    warnings.sort_by_key(|warning| !warning.blocks_acceptance);
    let finished = Finished {
        profile: &loaded.profile,
        profile_text: &loaded.text,
        created: load::now(),
        inputs: vec![input_file(InputRole::Identification, file, &bytes)],
        settings: settings(args, &setup.estimation),
        found: &found,
        names: &identification.names,
        warnings,
        verification,
    };
    let mut summary = finished.summary();
    summary.warnings.iter_mut().for_each(|warning| warning.put_into_words(advice::words));
    summary.verdict.put_into_words(advice::words);
    let calibration =
        (!unusable).then(|| calibration(&summary, &loaded.text, &nominal, &problem, of_identification, None));
    let session = estimation
        .out
        .as_deref()
        .map(|folder| record::bare_session(folder, &estimation.profile, &loaded.text, &summary, calibration.as_ref()));
    deliver(summary, calibration.as_ref(), session.transpose()?.as_ref(), estimation, console)
}

/// The record of the settings, with those that only this command has.
fn settings(args: &ConstraintsArgs, estimation: &EstimationSettings) -> IdentificationSettings {
    IdentificationSettings {
        socket_distance_mm: args.socket_distance_mm,
        socket_distance_sigma_mm: args.socket_distance_mm.map(|_| args.socket_distance_sigma_mm),
        verification: match (args.verify_rest, &args.leave_one_out) {
            (true, _) => VerificationMode::Rest,
            (false, Some(_)) => VerificationMode::LeaveOneOut,
            (false, None) => VerificationMode::None,
        },
        ..estimation.record()
    }
}

/// Line and configuration of every place in a table.
fn configurations(table: &Constraints) -> Vec<(usize, &[f64])> {
    match table {
        Constraints::SharedPoints(shared) => {
            let rows = shared.groups.iter().flat_map(|group| &group.samples);
            rows.map(|row| (row.line, row.configuration.as_slice())).collect()
        }
        Constraints::Lengths(lengths) => {
            let ends = lengths.rows.iter().map(|row| (row.line, [row.from.as_slice(), row.to.as_slice()]));
            ends.flat_map(|(line, ends)| ends.map(|end| (line, end))).collect()
        }
    }
}

/// Whether a row is on the wanted side of the filter.
fn keep(
    filter: Option<&Filter>,
    columns: &[String],
    fields: &[String],
    line: usize,
    wanted: bool,
) -> Result<bool, Failure> {
    let matches = match filter {
        None => true,
        Some(filter) => {
            filter.matches(columns, fields, line).map_err(|error| Failure::from_error(ExitStatus::Usage, &error))?
        }
    };
    Ok(matches == wanted)
}

/// The shared points of the rows that `keep` picks, with the distance between the sockets of one position where it is known.
fn shared_points(
    args: &ConstraintsArgs,
    table: &SharedPoints,
    keep: impl Fn(&[String], usize) -> Result<bool, Failure>,
) -> Result<Named, Failure> {
    let mut named = Named::default();
    for group in &table.groups {
        let mut at = Vec::new();
        for row in &group.samples {
            if keep(&row.fields, row.line)? {
                at.push(Place { configuration: row.configuration.clone(), target: 0 });
                let pose = format!("{}/{}", group.position, group.socket);
                named.names.push(SampleName { pose, line: row.line });
            }
        }
        if !at.is_empty() {
            named.observations.shared.push(SharedPoint { at });
            named.positions.push(group.position.clone());
        }
    }
    if let Some(distance) = args.socket_distance_mm {
        let sigma = Some(from_mm(args.socket_distance_sigma_mm));
        let mut sockets: BTreeMap<&str, Vec<usize>> = BTreeMap::new();
        for (index, position) in named.positions.iter().enumerate() {
            sockets.entry(position).or_default().push(index);
        }
        for (position, sockets) in &sockets {
            match sockets.as_slice() {
                [_] => {}
                [first, second] => named.observations.lengths.push(Length {
                    from: LengthEnd::SharedPoint(*first),
                    to: LengthEnd::SharedPoint(*second),
                    length: from_mm(distance),
                    sigma,
                }),
                more => {
                    return Err(Failure::new(
                        ExitStatus::Usage,
                        format!("position '{position}' has {} sockets; '--socket-distance-mm' is for two", more.len()),
                    ));
                }
            }
        }
    }
    Ok(named)
}

/// What stays the same over all identifications of one command.
struct Setup<'a> {
    loaded: &'a LoadedProfile,
    estimation: EstimationSettings,
    parameters: Vec<FreeParameter>,
    arm: Arm,
    settings: Settings,
}

impl<'a> Setup<'a> {
    fn new(args: &ConstraintsArgs, loaded: &'a LoadedProfile) -> Self {
        let estimation = estimation_settings(&args.estimation, Weighting::Covariance);
        Self {
            loaded,
            parameters: estimation.parameters(&loaded.profile),
            arm: loaded.profile.arm(),
            settings: estimation.solver(&loaded.profile, None),
            estimation,
        }
    }

    fn problem<'b>(&'b self, observations: &'b Observations) -> Problem<'b> {
        Problem { arm: &self.arm, parameters: &self.parameters, observations }
    }

    fn identify<O: Write, E: Write>(
        &self,
        observations: &Observations,
        console: &mut Console<O, E>,
    ) -> Result<Identification, Failure> {
        let mut progress = Progress::new(&mut console.err);
        identify(&self.problem(observations), &self.settings, &mut |iteration| progress.step(iteration))
            .map_err(|error| ProcedureError::from(error).into())
    }

    /// The nominal arm with its target fitted.
    fn nominal(&self, observations: &Observations) -> Result<FittedSetup, Failure> {
        fit_setup(&self.arm, &target_parameters(&self.parameters), observations)
            .map_err(|error| ProcedureError::from(error).into())
    }

    fn verify(
        &self,
        identification: &Observations,
        rest: &Observations,
        found: &Identification,
    ) -> Result<VerificationSummary, Failure> {
        let nominal = DirectErrors::new(&self.nominal(identification)?.arm, rest);
        let identified = DirectErrors::new(&found.arm, rest);
        Ok(self.summary(&nominal, &identified, rest, "the rows that '--use' leaves out".to_owned()))
    }

    /// Identifies once per position of the plate without it, and pools the errors on the positions left out.
    fn leave_one_out<O: Write, E: Write>(
        &self,
        all: &Named,
        console: &mut Console<O, E>,
    ) -> Result<VerificationSummary, Failure> {
        let mut positions: Vec<&String> = Vec::new();
        for position in &all.positions {
            if !positions.contains(&position) {
                positions.push(position);
            }
        }
        if positions.len() < 2 {
            return Err(Failure::new(ExitStatus::Usage, "leaving one position out needs at least two positions"));
        }
        let mut pooled: Option<(DirectErrors, DirectErrors, Observations)> = None;
        for (index, position) in positions.iter().enumerate() {
            let kept = all.observations.of_shared(|index| all.positions.get(index) != Some(*position));
            let left_out = all.observations.of_shared(|index| all.positions.get(index) == Some(*position));
            let found = self.identify(&kept, console)?;
            let nominal = DirectErrors::new(&self.nominal(&kept)?.arm, &left_out);
            let identified = DirectErrors::new(&found.arm, &left_out);
            if positions.len() > 4 && index + 1 < positions.len() {
                console.remark(&format!("left out {} of {} positions", index + 1, positions.len()));
            }
            pooled = Some(match pooled {
                None => (nominal, identified, left_out),
                Some((all_nominal, all_identified, mut observations)) => {
                    observations.shared.extend(left_out.shared);
                    (all_nominal.pooled_with(&nominal), all_identified.pooled_with(&identified), observations)
                }
            });
        }
        let Some((nominal, identified, observations)) = pooled else {
            return Err(Failure::new(ExitStatus::Usage, "there is no position to leave out"));
        };
        let basis = format!("leaving out each of {} positions in turn", positions.len());
        Ok(self.summary(&nominal, &identified, &observations, basis))
    }

    fn summary(
        &self,
        nominal: &DirectErrors,
        identified: &DirectErrors,
        observations: &Observations,
        basis: String,
    ) -> VerificationSummary {
        let seats = observations.shared.iter().filter(|shared| shared.at.len() > 1).flat_map(|shared| &shared.at);
        let configurations: Vec<&[f64]> = seats.map(|at| at.configuration.as_slice()).collect();
        let summary: [ModelSummary; 2] = [direct_summary(nominal), direct_summary(identified)];
        let [nominal, identified_summary] = summary;
        VerificationSummary {
            samples: identified.seats.len() + identified.lengths.len(),
            basis,
            independent: true,
            refit: Refit::None,
            nominal,
            identified: identified_summary,
            residual_by_joint: if configurations.is_empty() {
                Vec::new()
            } else {
                joint_summaries(self.loaded.profile.chain().joints(), &configurations, &identified.seats)
            },
        }
    }
}
