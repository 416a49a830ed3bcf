//! `trupose constraints`: identification from direct distances, without any coordinates.

use std::collections::BTreeMap;
use std::io::Write;

use super::identify::run_request;
use super::{Console, estimation_settings, load, payload_of};
use crate::cli::ConstraintsArgs;
use crate::error::{ExitStatus, Failure};
use crate::identification::{Length, LengthEnd, SharedPoint, Weighting};
use crate::kinematics::Place;
use crate::procedure::identify::{Distances, IdentifyRequest, SampleSet};
use crate::procedure::{SampleName, checks, input_file, joint_types};
use crate::session::constraints::{Constraints, Contacts, Lengths, NamedShape, SharedPoints, read_constraints};
use crate::session::filter::Filter;
use crate::session::summary::{InputRole, VerificationMode};
use crate::store;
use crate::units::from_mm;

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
    let table = read_constraints(&bytes, &file, &joint_types(&loaded.profile))
        .map_err(|errors| Failure::new(ExitStatus::Usage, errors.to_string()))?;
    let (columns, odd) = match &table {
        Constraints::SharedPoints(shared) => (&shared.columns, &shared.warnings),
        Constraints::Lengths(lengths) => (&lengths.columns, &lengths.warnings),
        Constraints::Contacts(contacts) => (&contacts.columns, &contacts.warnings),
    };
    let filter = load::filter(estimation.filter.as_deref(), columns)?;
    let (identification, rest) = match &table {
        Constraints::SharedPoints(shared) => (
            shared_points(args, shared, &Side { filter: filter.as_ref(), columns, matching: true })?,
            shared_points(args, shared, &Side { filter: filter.as_ref(), columns, matching: false })?,
        ),
        Constraints::Lengths(_) | Constraints::Contacts(_)
            if args.leave_one_out.is_some() || args.socket_distance_mm.is_some() =>
        {
            return Err(Failure::new(
                ExitStatus::Usage,
                "'--leave-one-out' and '--socket-distance-mm' belong to tables with shared points; this one holds lengths or contacts",
            ));
        }
        Constraints::Lengths(table) => (
            lengths(table, &Side { filter: filter.as_ref(), columns, matching: true })?,
            lengths(table, &Side { filter: filter.as_ref(), columns, matching: false })?,
        ),
        Constraints::Contacts(table) => (
            contacts(table, &Side { filter: filter.as_ref(), columns, matching: true })?,
            contacts(table, &Side { filter: filter.as_ref(), columns, matching: false })?,
        ),
    };
    if args.verify_rest && rest.names.is_empty() {
        return Err(Failure::new(ExitStatus::Usage, "no row is left for the verification")
            .hint("'--use' must leave some rows out"));
    }
    let payload = payload_of(&estimation.payload, &loaded.profile)?;
    let verification = if args.verify_rest { rest } else { Distances::default() };
    let request = IdentifyRequest {
        profile: loaded.profile,
        profile_text: loaded.text,
        mounted: None,
        payload,
        created: load::now(),
        inputs: vec![input_file(InputRole::Identification, file, &bytes)],
        settings: estimation_settings(estimation, Weighting::Covariance),
        identification: SampleSet {
            distances: identification,
            warnings: checks::table_warnings(None, odd),
            ..SampleSet::default()
        },
        verification: SampleSet { distances: verification, ..SampleSet::default() },
        basis: "the rows that '--use' leaves out".to_owned(),
        verification_mode: match (args.verify_rest, &args.leave_one_out) {
            (true, _) => VerificationMode::Rest,
            (false, Some(_)) => VerificationMode::LeaveOneOut,
            (false, None) => VerificationMode::None,
        },
        layout: None,
        previous: None,
        socket_distance_mm: args.socket_distance_mm.map(|distance| (distance, args.socket_distance_sigma_mm)),
    };
    run_request(&request, estimation, None, console)
}

/// The rows of a table on one side of a filter.
struct Side<'a> {
    filter: Option<&'a Filter>,
    columns: &'a [String],
    /// Whether these are the rows that match; without a filter all do.
    matching: bool,
}

impl Side<'_> {
    fn has(&self, fields: &[String], line: usize) -> Result<bool, Failure> {
        let matches = match self.filter {
            None => true,
            Some(filter) => filter
                .matches(self.columns, fields, line)
                .map_err(|error| Failure::from_error(ExitStatus::Usage, &error))?,
        };
        Ok(matches == self.matching)
    }
}

/// The lengths of the rows on one side of the filter.
fn lengths(table: &Lengths, side: &Side<'_>) -> Result<Distances, Failure> {
    let mut distances = Distances::default();
    for row in &table.rows {
        if side.has(&row.fields, row.line)? {
            let [from, to] = [&row.from, &row.to]
                .map(|configuration| LengthEnd::Target(Place { configuration: configuration.clone(), target: 0 }));
            distances.observations.lengths.push(Length { from, to, length: row.length, sigma: row.sigma });
            let name = |end: &str| SampleName { pose: end.to_owned(), line: row.line };
            distances.names.extend([name("from"), name("to")]);
        }
    }
    Ok(distances)
}

/// The contacts of the rows on one side of the filter. Features keep their number on both sides.
fn contacts(table: &Contacts, side: &Side<'_>) -> Result<Distances, Failure> {
    let mut distances = Distances::default();
    distances.observations.features = table.features.iter().map(|named| named.shape).collect();
    distances.features = table.features.iter().map(|named| named.name.clone()).collect();
    for row in &table.rows {
        if side.has(&row.fields, row.line)? {
            let (feature, NamedShape { name, shape }) = (row.feature, &table.features[row.feature]);
            for component in 0..shape.components() {
                let is_measured = component + 1 == shape.components();
                distances.observations.lengths.push(Length {
                    from: LengthEnd::Target(Place { configuration: row.configuration.clone(), target: 0 }),
                    to: LengthEnd::Feature { feature, component },
                    length: if is_measured { row.length } else { 0.0 },
                    sigma: row.sigma,
                });
                distances.names.push(SampleName { pose: name.clone(), line: row.line });
            }
        }
    }
    Ok(distances)
}

/// The shared points of the rows on one side of the filter, with the distance between the sockets of one position where it is
/// known.
fn shared_points(args: &ConstraintsArgs, table: &SharedPoints, side: &Side<'_>) -> Result<Distances, Failure> {
    let mut distances = Distances::default();
    for group in &table.groups {
        let mut at = Vec::new();
        for row in &group.samples {
            if side.has(&row.fields, row.line)? {
                at.push(Place { configuration: row.configuration.clone(), target: 0 });
                let pose = format!("{}/{}", group.position, group.socket);
                distances.names.push(SampleName { pose, line: row.line });
            }
        }
        if !at.is_empty() {
            distances.observations.shared.push(SharedPoint { at });
            distances.positions.push(group.position.clone());
        }
    }
    if let Some(distance) = args.socket_distance_mm {
        let sigma = Some(from_mm(args.socket_distance_sigma_mm));
        let mut sockets: BTreeMap<&str, Vec<usize>> = BTreeMap::new();
        for (index, position) in distances.positions.iter().enumerate() {
            sockets.entry(position).or_default().push(index);
        }
        for (position, sockets) in &sockets {
            match sockets.as_slice() {
                [_] => {}
                [first, second] => distances.observations.lengths.push(Length {
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
    Ok(distances)
}
