//! `trupose import`: tables of other programs as tables of measurements.

use std::collections::BTreeSet;
use std::io::Write;
use std::path::{Path, PathBuf};

use super::{Console, load};
use crate::checksum::{self, Syntax};
use crate::cli::ImportArgs;
use crate::error::{ExitStatus, Failure};
use crate::identification::{Observations, Problem};
use crate::procedure::{checks, joint_types};
use crate::profile::{Level, Profile};
use crate::session::export::{marked_as_simulated, simulation_of_table};
use crate::session::measurements::{
    Expected, Layout, Measurements, PointFile, Reading, Row, SavedLayout, Understood, joined, read_for, write_with_text,
};
use crate::session::{TableErrors, TableProblem, workbook};
use crate::store;
use crate::text::{columns, counted, listed, shortened};
use crate::units::{from_deg, from_mm, to_mm};

/// Columns of a terminal that a cell of the listing takes at most.
const WIDEST: usize = 28;
/// Columns of a table of RoboDK.
const ROBODK_COLUMNS: usize = 12;
/// Warnings about rows that are shown.
const SHOWN_WARNINGS: usize = 5;
/// Points from which a mistake can be told from the errors of an arm.
const ENOUGH: usize = 8;

pub(super) fn run<O: Write, E: Write>(args: &ImportArgs, console: &mut Console<O, E>) -> Result<ExitStatus, Failure> {
    let mut loaded = load::profile(&args.profile)?;
    let profile = &loaded.profile;
    let (layout, mut reading) = load::layout(&args.layout, &args.profile)?;
    reading.columns = args.columns.clone().or(reading.columns);
    reading.units = args.units.unwrap_or(reading.units);
    reading.skip_missing |= args.skip_missing;
    reading.sigma = args.sigma_mm.map(from_mm).or(reading.sigma);
    reading.sigma_rotation = args.sigma_rot_deg.map(from_deg).or(reading.sigma_rotation);
    let joints = joint_types(profile);
    let expected = Expected::of(profile, &joints);
    let table = match &args.joints {
        Some(file) => read_joined(args, &expected, &reading, file),
        None => read_files(args, &expected, layout, &reading),
    };
    let table = match table {
        Ok(table) => table,
        Err(Refusal::Failure(failure)) => return Err(failure),
        Err(Refusal::Table(errors)) => {
            if let Some(understood) = errors.understood.as_ref().filter(|understood| !understood.columns.is_empty()) {
                console.remark(&listing(understood));
            }
            return Err(refused(&errors, args));
        }
    };
    // A new check sum would hide the change for good.
    if let Some(change) = table.warnings.iter().find(|warning| warning.is_change()) {
        return Err(Failure::new(ExitStatus::Usage, change.to_string())
            .hint("take an intact copy; if the change was made on purpose, 'trupose identify --edited' reads the table as it is"));
    }
    let simulated = simulated(args)?;
    if let Some(said) = &simulated {
        console.remark(&format!("WARNING: SIMULATED: {said}"));
    }
    for warning in table.warnings.iter().take(SHOWN_WARNINGS) {
        console.remark(&format!("note: {warning}"));
    }
    if let Some(more) = table.warnings.len().checked_sub(SHOWN_WARNINGS).filter(|more| *more > 0) {
        console.remark(&format!("note: and {more} more like these"));
    }
    console.say(&summary(&table, profile))?;
    if table.understood.lacks_orientation_error {
        console.remark("note: '--sigma-rot-deg' states the error of all orientations");
    }
    load::take_bodies(&mut loaded, &table, console)?;
    let profile = &loaded.profile;
    if args.rows {
        console.say(&rows(&table, profile))?;
    }
    let status = triage(&table, profile, console)?;
    if let Some(name) = &args.save_layout {
        let path = layout_path(name, &args.profile)?;
        let text =
            SavedLayout::new(&reading).to_text().map_err(|error| Failure::from_error(ExitStatus::Internal, &error))?;
        store::replace(&path, &text).map_err(|error| Failure::from_error(ExitStatus::Store, &error))?;
        console.say_written(&path)?;
    }
    if let Some(path) = &args.out {
        let text = write_with_text(&table, &joints);
        let text = simulated.as_deref().map_or_else(|| text.clone(), |said| marked_as_simulated(said, &text));
        let text = checksum::with_sum(&text, Syntax::Csv);
        store::replace(path, &text).map_err(|error| Failure::from_error(ExitStatus::Store, &error))?;
        console.say_written(path)?;
    }
    if let Some(path) = &args.out_profile {
        store::replace(path, &loaded.text).map_err(|error| Failure::from_error(ExitStatus::Store, &error))?;
        console.say_written(path)?;
    }
    Ok(status)
}

/// Why there is no table.
enum Refusal {
    Table(TableErrors),
    Failure(Failure),
}

impl From<TableErrors> for Refusal {
    fn from(errors: TableErrors) -> Self {
        Self::Table(errors)
    }
}

impl From<Failure> for Refusal {
    fn from(failure: Failure) -> Self {
        Self::Failure(failure)
    }
}

/// The bytes of a table; of a workbook those of its sheet as text.
fn content(path: &Path, sheet: Option<&str>) -> Result<Vec<u8>, Refusal> {
    let bytes = store::read(path).map_err(|error| Failure::from_error(ExitStatus::Usage, &error))?;
    if workbook::is_workbook(&bytes) {
        let file = path.display().to_string();
        return Ok(workbook::sheet_text(&bytes, &file, sheet)?.into_bytes());
    }
    Ok(bytes)
}

/// What the tables say about a simulation that their points come from.
fn simulated(args: &ImportArgs) -> Result<Option<String>, Failure> {
    let points = args.points.iter().map(|named| named.split_once('=').map_or(named.as_str(), |(_, path)| path));
    let paths = args.files.iter().cloned().chain(points.map(PathBuf::from));
    for path in paths.filter(|path| path.is_file()) {
        let bytes = store::read(&path).map_err(|error| Failure::from_error(ExitStatus::Usage, &error))?;
        if let Some(said) = simulation_of_table(&bytes) {
            return Ok(Some(said));
        }
    }
    Ok(None)
}

/// The tables one behind the other. Where two have poses of the same name, the name of the file is put before them.
fn read_files(
    args: &ImportArgs,
    expected: &Expected<'_>,
    layout: Layout,
    reading: &Reading,
) -> Result<Measurements, Refusal> {
    let mut whole: Option<Measurements> = None;
    let mut taken: BTreeSet<String> = BTreeSet::new();
    for path in &args.files {
        let bytes = content(path, args.sheet.as_deref())?;
        let mut table = read_for(expected, layout, reading, &bytes, &path.display().to_string())?;
        if table.rows.iter().any(|row| taken.contains(&row.pose)) {
            let stem = path.file_stem().map_or_else(|| "table".to_owned(), |stem| stem.to_string_lossy().into_owned());
            for row in &mut table.rows {
                row.pose = format!("{stem}-{}", row.pose);
            }
        }
        taken.extend(table.rows.iter().map(|row| row.pose.clone()));
        match &mut whole {
            None => whole = Some(table),
            Some(whole) => {
                let before = whole.rows.len();
                if whole.columns != table.columns {
                    // Their other columns do not belong together.
                    whole.columns.clear();
                }
                whole.duplicates.extend(table.duplicates.iter().map(|index| index + before));
                whole.rows.extend(table.rows);
                whole.warnings.extend(table.warnings);
                whole.understood.notes.extend(table.understood.notes);
            }
        }
    }
    whole.ok_or_else(|| Failure::new(ExitStatus::Usage, "no table is given").into())
}

fn read_joined(
    args: &ImportArgs,
    expected: &Expected<'_>,
    reading: &Reading,
    joints: &Path,
) -> Result<Measurements, Refusal> {
    let of_joints = content(joints, args.sheet.as_deref())?;
    let mut points = Vec::with_capacity(args.points.len());
    for named in &args.points {
        let (target, path) = match named.split_once('=') {
            Some((target, path)) if !Path::new(named).exists() => (Some(target.to_owned()), path),
            _ => (None, named.as_str()),
        };
        if let Some(target) = target.as_ref().filter(|target| !expected.targets.contains(target)) {
            let known = listed(&expected.targets);
            return Err(Failure::new(ExitStatus::Usage, format!("the profile has no target '{target}'"))
                .hint(format!("its targets: {known}"))
                .into());
        }
        let content = content(Path::new(path), args.sheet.as_deref())?;
        points.push(PointFile { name: path.to_owned(), content, target });
    }
    let of_points =
        Reading { columns: args.point_columns.clone().or_else(|| reading.columns.clone()), ..reading.clone() };
    let file = joints.display().to_string();
    Ok(joined(expected, (reading, &of_points), (&file, &of_joints), &points, args.join)?)
}

/// The refusal of a table, with the options that may help.
fn refused(errors: &TableErrors, args: &ImportArgs) -> Failure {
    let mut failure = Failure::new(ExitStatus::Usage, errors.to_string());
    let proposal = errors.understood.as_ref().and_then(|understood| understood.proposal.as_deref());
    let missing = errors.problems.iter().any(TableProblem::is_without_point);
    if missing && !args.skip_missing {
        failure = failure.hint("'--skip-missing' leaves out the readings without a point");
    }
    if errors.problems.iter().any(|problem| problem.to_string().contains("lacks 'sigma_")) {
        failure = failure.hint("'--sigma-mm' and '--sigma-rot-deg' state the errors of all rows");
    }
    if errors.problems.iter().any(TableProblem::is_about_sheets) {
        failure = failure.hint("'--sheet NAME' chooses one");
    }
    let of_robodk = errors.understood.as_ref().is_some_and(|understood| understood.columns.len() == ROBODK_COLUMNS);
    if of_robodk && errors.problems.iter().any(TableProblem::is_of_columns) {
        failure =
            failure.hint("a table of RoboDK (six joints, point, target on the flange) is read with '--layout robodk'");
    }
    let is_half = errors.problems.iter().any(|problem| problem.to_string().contains("without joint values"));
    if is_half && args.joints.is_none() {
        return failure.hint("'--joints FILE --points FILE' joins two tables");
    }
    match proposal {
        Some(proposal) if args.columns.is_none() => {
            let option = if args.joints.is_some() && proposal.contains("x_") { "--point-columns" } else { "--columns" };
            failure.hint(format!("if this is what they mean, units included, give {option} '{proposal}'"))
        }
        None if errors.problems.iter().any(TableProblem::is_of_columns) => {
            failure.hint("name the columns with --columns 'q1_deg=NAME, …, x_mm=NAME, …'; '#3' is the third")
        }
        _ => failure,
    }
}

/// The columns of a file and what they are read as.
fn listing(understood: &Understood) -> String {
    let cell = |text: &str, width: usize| {
        let text = shortened(text, width);
        let padding = width.saturating_sub(columns(&text));
        format!("{text}{}", " ".repeat(padding))
    };
    let width = |of: &dyn Fn(&crate::session::measurements::ColumnRead) -> usize, least: usize| {
        understood.columns.iter().map(of).max().unwrap_or_default().clamp(least, WIDEST)
    };
    let names = width(&|column| columns(&column.name), 6);
    let kinds = width(&|column| column.read_as.as_ref().map_or(1, |name| columns(name)), 7);
    let mut lines = vec![format!("  #  {}  {}  first row", cell("column", names), cell("read as", kinds))];
    for (index, column) in understood.columns.iter().enumerate() {
        lines.push(format!(
            "{:>3}  {}  {}  {}",
            index + 1,
            cell(&column.name, names),
            cell(column.read_as.as_deref().unwrap_or("-"), kinds),
            shortened(&column.example, WIDEST)
        ));
    }
    let trimmed: Vec<&str> = lines.iter().map(|line| line.trim_end()).collect();
    trimmed.join("\n") + "\n"
}

/// What was read, in words.
fn summary(table: &Measurements, profile: &Profile) -> String {
    let Understood { separator, notes, orientation, .. } = &table.understood;
    let mut text = if table.understood.columns.is_empty() { String::new() } else { listing(&table.understood) };
    if !separator.is_empty() {
        text.extend([format!("cells are separated by {separator}\n")]);
    }
    text.extend(notes.iter().chain(orientation).map(|note| format!("{note}\n")));
    let distinct: Vec<&Row> = table.distinct_rows().collect();
    let poses: BTreeSet<&str> = distinct.iter().map(|row| row.pose.as_str()).collect();
    let targets: BTreeSet<&str> = distinct.iter().filter_map(|row| row.target.as_deref()).collect();
    let of_targets = if targets.is_empty() {
        let first = profile.targets().first().map_or("", |target| target.name.as_str());
        format!("target '{first}'")
    } else {
        counted(targets.len(), "target")
    };
    text.extend([format!("{}, {}, {of_targets}\n", counted(distinct.len(), "reading"), counted(poses.len(), "pose"))]);
    text
}

/// Every row as it was read.
fn rows(table: &Measurements, profile: &Profile) -> String {
    let joints = profile.chain().joints();
    let mut text = "line  pose  target  joints (deg, mm)  point (mm)\n".to_owned();
    for row in &table.rows {
        let values = row.configuration.iter().zip(joints);
        let values: Vec<String> =
            values.map(|(value, joint)| format!("{:.4}", joint.joint_type.quantity().to_edge(*value))).collect();
        let point: Vec<String> = row.point.iter().map(|value| format!("{:.4}", to_mm(*value))).collect();
        let target = row.target.as_deref().unwrap_or("-");
        text.extend([format!("{:>4}  {}  {target}  {}  {}\n", row.line, row.pose, values.join(" "), point.join(" "))]);
    }
    text
}

/// Looks whether the points can be those of this robot, and names the mistake if one explains them.
fn triage<O: Write, E: Write>(
    table: &Measurements,
    profile: &Profile,
    console: &mut Console<O, E>,
) -> Result<ExitStatus, Failure> {
    let distinct: Vec<&Row> = table.distinct_rows().collect();
    let points = load::samples(&distinct, profile)?;
    let range =
        checks::limit_warning(profile, None, distinct.iter().map(|row| (row.line, row.configuration.as_slice())));
    if let Some(warning) = range {
        console.remark(&format!("WARNING: {}", warning.message));
    }
    if points.len() < ENOUGH {
        console.say(&format!(
            "with fewer than {ENOUGH} points it cannot be checked whether they are those of this robot\n"
        ))?;
        return Ok(ExitStatus::Accepted);
    }
    let observations = Observations { points, ..Observations::default() };
    let parameters = profile.parameters(Level::Geometric);
    let problem = Problem { arm: &profile.arm(), parameters: &parameters, observations: &observations };
    match checks::check_plausibility(&problem, "") {
        Ok(compared) => {
            match compared.warning {
                None => {
                    console.say("the distances between the points are those of this robot, up to the errors that are to be found\n")?;
                    Ok(ExitStatus::Accepted)
                }
                Some(warning) => {
                    console.remark(&format!("WARNING: {}", warning.message));
                    Ok(ExitStatus::NotAccepted)
                }
            }
        }
        Err(error) => {
            console.remark(&format!("WARNING: {error}"));
            Ok(ExitStatus::NotAccepted)
        }
    }
}

/// Where a layout is saved: beside the profile, or in the current folder for a shipped profile.
pub(super) fn layout_path(name: &str, profile: &str) -> Result<PathBuf, Failure> {
    let is_plain = !name.is_empty() && name.chars().all(|c| c.is_alphanumeric() || matches!(c, '-' | '_' | '.'));
    if !is_plain || ["named", "robodk", "delmia"].contains(&name) {
        let message = format!("'{name}' cannot be the name of a layout");
        return Err(Failure::new(ExitStatus::Usage, message).hint("use letters, digits, '-' and '_'"));
    }
    let profile = Path::new(profile);
    let folder = profile.parent().filter(|_| profile.is_file()).unwrap_or_else(|| Path::new(""));
    Ok(folder.join(SavedLayout::file_name(name)))
}
