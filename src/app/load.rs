//! Reading the files that commands name.

use std::io::Write;
use std::path::{Path, PathBuf};

use super::Console;
use crate::checksum::{self, Finding};
use crate::error::{ExitStatus, Failure};
use crate::identification::PointSample;
use crate::kinematics::Place;
use crate::procedure::bodies::{BodyError, WithBodies, with_bodies};
use crate::procedure::{input_file, joint_types};
use crate::profile::{Diagnostic, Profile, builtin, builtin_names};
use crate::session::calibration::{Calibration, Integrity};
use crate::session::export::simulation_of_table;
use crate::session::filter::Filter;
use crate::session::measurements::{Expected, Layout, Measurements, Reading, Row, SavedLayout, read_for};
use crate::session::summary::{InputFile, InputRole, Warning, WarningCode};
use crate::session::{TableErrors, TableProblem, workbook};
use crate::store;
use crate::text::counted;

/// A profile with the text it came from.
#[derive(Clone, Debug)]
pub(super) struct LoadedProfile {
    pub(super) profile: Profile,
    pub(super) text: String,
    pub(super) warnings: Vec<Diagnostic>,
}

/// The text of a file.
pub(super) fn text(path: &Path) -> Result<String, Failure> {
    let bytes = store::read(path).map_err(|error| Failure::from_error(ExitStatus::Usage, &error))?;
    String::from_utf8(bytes).map_err(|error| {
        let place = error.utf8_error().valid_up_to();
        Failure::new(ExitStatus::Usage, format!("'{}' is not UTF-8 text (byte {place})", path.display()))
            .hint("save it as UTF-8")
    })
}

/// Loads a shipped profile by name, or any profile by path.
pub(super) fn profile(name_or_path: &str) -> Result<LoadedProfile, Failure> {
    let path = Path::new(name_or_path);
    let (text, file) = match builtin(name_or_path) {
        Some(text) => (text.to_owned(), format!("profiles/{name_or_path}.ron")),
        None if path.is_file() => (text(path)?, name_or_path.to_owned()),
        None => {
            let names: Vec<&str> = builtin_names().collect();
            return Err(Failure::new(ExitStatus::Usage, format!("there is no profile or file '{name_or_path}'"))
                .hint(format!("shipped profiles: {}", names.join(", "))));
        }
    };
    parse_profile(text, &file)
}

/// A profile from its text.
pub(super) fn parse_profile(text: String, file: &str) -> Result<LoadedProfile, Failure> {
    match Profile::parse(&text, file) {
        Ok((profile, warnings)) => Ok(LoadedProfile { profile, text, warnings }),
        Err(errors) => {
            let count = counted(errors.error_count(), "error");
            Err(Failure::new(ExitStatus::Usage, format!("profile '{file}' has {count}\n\n{errors}\n")))
        }
    }
}

/// A calibration with the text it came from and the robot inside.
#[derive(Clone, Debug)]
pub(super) struct LoadedCalibration {
    pub(super) calibration: Calibration,
    pub(super) text: String,
    pub(super) profile: Profile,
}

/// A calibration file. One that has changed since it was written is refused unless the change is `edited` on purpose.
pub(super) fn calibration<O: Write, E: Write>(
    path: &Path,
    edited: bool,
    console: &mut Console<O, E>,
) -> Result<LoadedCalibration, Failure> {
    let file = path.display().to_string();
    let text = text(path)?;
    let calibration = Calibration::parse(&text).map_err(|error| {
        let failure = Failure::new(ExitStatus::Usage, format!("'{file}' is not a usable calibration: {error}"));
        match checksum::check(&text) {
            Finding::Changed => failure.hint("the file has changed since it was written: take an intact copy"),
            Finding::Intact | Finding::Missing => {
                failure.hint("a calibration is written by 'trupose identify --out DIR'")
            }
        }
    })?;
    match (calibration.integrity, calibration.edited()) {
        (_, Some(said)) if !edited => {
            return Err(Failure::new(ExitStatus::Usage, format!("'{file}': {said}"))
                .hint("take an intact copy of the file: a changed digit moves the robot")
                .hint("if the change was made on purpose, give '--edited'; every result then says so"));
        }
        (Integrity::Unchecked, _) => console.remark(&format!(
            "note: '{file}' is of an earlier version, without a check sum: a change in it would not be noticed"
        )),
        (Integrity::Intact | Integrity::Changed(_), _) => {}
    }
    let profile = parse_profile(calibration.profile.clone(), &format!("{file} (profile)"))?.profile;
    Ok(LoadedCalibration { calibration, text, profile })
}

/// Says of warnings about changed tables that the change was `edited` on purpose, or how to say so.
pub(super) fn settle_changes(warnings: &mut [Warning], edited: bool) {
    for warning in warnings.iter_mut().filter(|warning| warning.code == WarningCode::ChangedTable) {
        let addition =
            if edited { "it was used because '--edited' was given" } else { "give '--edited' if that was on purpose" };
        warning.message = format!("{}; {addition}", warning.message);
        warning.blocks_acceptance = !edited;
    }
}

/// A measurement table with the bytes it came from.
#[derive(Clone, Debug)]
pub(super) struct LoadedTable {
    pub(super) table: Measurements,
    pub(super) input: InputFile,
    /// The warning of a table whose points are simulated.
    pub(super) simulated: Option<Warning>,
}

/// A layout of tables by its name: one that the program knows, or one that `import` saved beside the profile or here.
pub(super) fn layout(name: &str, profile: &str) -> Result<(Layout, Reading), Failure> {
    let known = match name.parse::<Layout>() {
        Ok(layout) => return Ok((layout, Reading::default())),
        Err(unknown) => unknown,
    };
    let file = SavedLayout::file_name(name);
    let profile = Path::new(profile);
    let beside = profile.parent().filter(|_| profile.is_file()).map(|folder| folder.join(&file));
    let candidates = [beside, Some(PathBuf::from(&file)), Some(PathBuf::from(name))];
    let Some(path) = candidates.into_iter().flatten().find(|path| path.is_file()) else {
        return Err(Failure::from_error(ExitStatus::Usage, &known)
            .hint(format!("'trupose import --save-layout {name}' would save one as '{file}' beside the profile")));
    };
    let reading = SavedLayout::parse(&text(&path)?).map_err(|reason| {
        Failure::new(ExitStatus::Usage, format!("'{}' is no layout of tables: {reason}", path.display()))
    })?;
    Ok((Layout::Named, reading))
}

/// A measurement table for the robot of a profile, whose name or path is `profile_name`.
pub(super) fn measurements(
    path: &Path,
    layout: &str,
    (profile, profile_name): (&Profile, &str),
    role: InputRole,
) -> Result<LoadedTable, Failure> {
    let (layout, reading) = self::layout(layout, profile_name)?;
    let bytes = store::read(path).map_err(|error| Failure::from_error(ExitStatus::Usage, &error))?;
    let file = path.display().to_string();
    let refused = |errors: &TableErrors| {
        let failure = Failure::new(ExitStatus::Usage, errors.to_string());
        let is_of_columns = errors.problems.iter().any(TableProblem::is_of_columns);
        match errors.understood.as_ref().and_then(|understood| understood.proposal.as_deref()) {
            Some(proposal) => failure.hint(format!(
                "if this is what the columns mean, units included: 'trupose import {file} --profile {profile_name} --columns '{proposal}' --save-layout NAME --out points.csv'"
            )),
            None if is_of_columns => failure.hint(format!("'trupose import {file} --profile {profile_name}' shows what is understood")),
            None => failure,
        }
    };
    let sheet = workbook::is_workbook(&bytes).then(|| workbook::sheet_text(&bytes, &file, None)).transpose();
    let sheet = sheet.map_err(|errors| refused(&errors))?;
    let content = sheet.as_deref().map_or(bytes.as_slice(), str::as_bytes);
    let joints = joint_types(profile);
    let table = read_for(&Expected::of(profile, &joints), layout, &reading, content, &file)
        .map_err(|errors| refused(&errors))?;
    let simulated = simulation_of_table(&bytes).map(|said| Warning::simulated(&said));
    Ok(LoadedTable { table, input: input_file(role, file, &bytes), simulated })
}

/// Gives a robot the corners of the bodies that stand for poses measured with their orientation, where it does not have them.
pub(super) fn take_bodies<O: Write, E: Write>(
    loaded: &mut LoadedProfile,
    table: &Measurements,
    console: &mut Console<O, E>,
) -> Result<(), Failure> {
    let rows: Vec<&Row> = table.distinct_rows().collect();
    let found = with_bodies(&loaded.profile, &loaded.text, &rows).map_err(|error| {
        let failure = Failure::from_error(ExitStatus::Usage, &error);
        match error {
            BodyError::OneAxis { body, .. } => failure
                .hint("measure with the wrist turned about two axes")
                .hint(format!("or put the corners '{body}.a' to '{body}.d' into the targets of the profile")),
            BodyError::Text | BodyError::Profile(_) => failure,
        }
    })?;
    if let Some(WithBodies { profile, text, bodies }) = found {
        console.remark(&format!(
            "note: how {} mounted on the flange is estimated from the nominal arm and then identified",
            if bodies.len() == 1 { format!("'{}' is", bodies[0]) } else { format!("'{}' are", bodies.join("', '")) }
        ));
        (loaded.profile, loaded.text) = (profile, text);
    }
    Ok(())
}

/// Parses a filter and checks it against the columns of a table.
pub(super) fn filter(text: Option<&str>, columns: &[String]) -> Result<Option<Filter>, Failure> {
    let Some(text) = text else { return Ok(None) };
    let usage = |error: &dyn std::error::Error| {
        Failure::from_error(ExitStatus::Usage, error)
            .hint("a condition reads like \"pose % 17 == 0\" or \"position != 'left'\"")
    };
    let filter = Filter::parse(text).map_err(|error| usage(&error))?;
    filter.check(columns).map_err(|error| usage(&error))?;
    Ok(Some(filter))
}

/// Splits the rows of a table (copies left out) by a filter: those that match, and the rest.
pub(super) fn split<'a>(
    table: &'a Measurements,
    filter: Option<&Filter>,
) -> Result<(Vec<&'a Row>, Vec<&'a Row>), Failure> {
    let mut matching = Vec::new();
    let mut rest = Vec::new();
    for row in table.distinct_rows() {
        let matches = match filter {
            None => true,
            Some(filter) => filter
                .matches(&table.columns, &row.fields, row.line)
                .map_err(|error| Failure::from_error(ExitStatus::Usage, &error))?,
        };
        if matches { matching.push(row) } else { rest.push(row) }
    }
    Ok((matching, rest))
}

/// Samples for the maths from the rows of a table.
pub(super) fn samples(rows: &[&Row], profile: &Profile) -> Result<Vec<PointSample>, Failure> {
    rows.iter()
        .map(|row| {
            let target = match &row.target {
                None => 0,
                Some(name) => target_index(profile, name).ok_or_else(|| {
                    let known: Vec<&str> = profile.targets().iter().map(|target| target.name.as_str()).collect();
                    Failure::new(ExitStatus::Usage, format!("line {}: the profile has no target '{name}'", row.line))
                        .hint(format!("targets of '{}': {}", profile.name(), known.join(", ")))
                })?,
            };
            Ok(PointSample {
                at: Place { configuration: row.configuration.clone(), target },
                station: 0,
                point: row.point,
                sigma: row.sigma,
            })
        })
        .collect()
}

fn target_index(profile: &Profile, name: &str) -> Option<usize> {
    profile.targets().iter().position(|target| target.name == name)
}

/// The current time in UTC, to the second.
pub(super) fn now() -> String {
    let now = jiff::Timestamp::now();
    now.round(jiff::Unit::Second).unwrap_or(now).to_string()
}

/// The current date and time in UTC, for the heads of robot programs.
pub(super) fn today() -> jiff::civil::DateTime {
    jiff::Timestamp::now().to_zoned(jiff::tz::TimeZone::UTC).datetime()
}
