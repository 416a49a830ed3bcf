//! `trupose compensate --program`: the motion targets of existing robot programs, corrected.

use std::io::Write;
use std::path::{Path, PathBuf};

use super::super::{Console, to_json};
use super::correct::{self, Corrected, Resolved};
use super::report::{PathReport, Report};
use super::settings::Settings;
use super::{Job, SHOWN, is_same_file, picture};
use crate::cli::compensate::{CompensateArgs, Points};
use crate::compensation::Status;
use crate::error::{ExitStatus, Failure};
use crate::program::motion::{Companion, Goal, Hint, LeftAlone, ReadOptions, Reason, Scan};
use crate::program::{Dialect, ProgramError, Robot, gzip, insert, rewrite, with_remark};
use crate::store;
use crate::text::{counted, printable};
use crate::units::from_mm;

/// Why points that were taught are not corrected.
const TAUGHT: &str = "taught points are not corrected: they were recorded where the real arm was, so the arm returns to them as it is; corrected, \
                      it would miss them by its error";

/// What a program says that was corrected with an edited calibration; it fits the 32 characters of the shortest remarks.
const EDITED: &str = "WARNING: EDITED CALIBRATION";

/// A file with its text, and its bytes if they are compressed.
type Input<'p> = (&'p Path, Option<Vec<u8>>, Vec<u8>);

/// A program and what becomes of it.
struct Part<'p> {
    path: &'p Path,
    scan: Scan,
    results: Vec<Corrected>,
    corrected: Vec<u8>,
    is_changed: bool,
    paths: Vec<PathReport>,
    /// Lines of moves that deviate by more than they may, and have no place for further points.
    undivided: Vec<usize>,
}

pub(super) fn run<O: Write, E: Write>(
    args: &CompensateArgs,
    job: &Job<'_>,
    dialect: Dialect,
    console: &mut Console<O, E>,
) -> Result<ExitStatus, Failure> {
    if args.insert.is_some() && !insert::can_insert(dialect) {
        return Err(Failure::new(ExitStatus::Usage, format!("points cannot be inserted into {dialect} programs"))
            .hint(
                "'--insert' is for RAPID, KRL and URScript; without it the path between the targets is only judged",
            ));
    }
    let profile = &job.arm.profile;
    let max_speeds: Vec<Option<f64>> = profile.joints().iter().map(|joint| joint.max_speed).collect();
    let pulses: Vec<Option<f64>> = profile.joints().iter().map(|joint| joint.pulses_per_degree).collect();
    let robot = Robot {
        profile: profile.name(),
        chain: profile.chain(),
        max_speeds: &max_speeds,
        pulses_per_degree: &pulses,
        joint_aliases: profile.joint_aliases(),
    };
    let texts = args.program.iter().chain(&args.companion).map(|path| {
        let text = store::read(path).map_err(|error| Failure::from_error(ExitStatus::Usage, &error))?;
        // What cannot be unpacked is refused by the reader.
        Ok(match gzip::unpacked(&text) {
            Some(unpacked) => (path.as_path(), Some(text), unpacked),
            None => (path.as_path(), None, text),
        })
    });
    let texts: Vec<Input<'_>> = texts.collect::<Result<_, Failure>>()?;
    let mut parts = Vec::new();
    for (path, packed, text) in texts.iter().take(args.program.len()) {
        let unusable = |error: ProgramError| Failure::new(ExitStatus::Usage, format!("'{}': {error}", path.display()));
        let others = texts.iter().filter(|(other, ..)| other != path);
        let companions = others.map(|(path, _, text)| Companion { name: file_name(path), text: text.clone() });
        let options = ReadOptions {
            joint_names: (!args.joint_names.is_empty()).then(|| args.joint_names.clone()),
            companions: companions.collect(),
            ignores_external_axes: args.ignore_external_axes,
        };
        let scan = rewrite::scan(dialect, &robot, &options, text).map_err(unusable)?;
        check_points(args.points, &scan)?;
        let resolved = Resolved {
            tools: Settings { given: &args.tool, kind: "tool" },
            frames: Settings { given: &args.frame, kind: "frame" },
        };
        let results = correct::corrected(job, &resolved, &scan);
        let commands: Vec<_> = results.iter().map(Corrected::command).collect();
        let mut corrected = rewrite::rewrite(dialect, &robot, text, &scan, &commands).map_err(unusable)?;
        let is_changed = corrected != *text;
        let unproven = |what: String| {
            let message =
                format!("'{}': reading back the corrected program: {what}; nothing is written", path.display());
            Failure::new(ExitStatus::Internal, message)
        };
        let (paths, insertions, undivided) = correct::between(job, &scan, &results, args.insert.map(from_mm));
        if is_changed {
            let again = rewrite::scan(dialect, &robot, &options, &corrected).map_err(unusable)?;
            correct::prove(job, &results, &scan, &again).map_err(unproven)?;
            if !insertions.is_empty() {
                corrected = insert::insert(dialect, &corrected, &again, &insertions);
                let last = rewrite::scan(dialect, &robot, &options, &corrected).map_err(unusable)?;
                correct::prove_inserted(&again, &insertions, &last).map_err(unproven)?;
            }
        }
        if is_changed && job.arm.edited.is_some() {
            match with_remark(dialect, &corrected, EDITED) {
                Some(text) => corrected = text,
                None => console.remark(&format!(
                    "note: '{}' has no place for a remark, so it does not say that the calibration was edited",
                    path.display()
                )),
            }
        }
        if let Some(original) = packed {
            corrected = if is_changed { gzip::packed(&corrected) } else { original.clone() };
        }
        parts.push(Part { path, scan, results, corrected, is_changed, paths, undivided });
    }
    check_paths(args, &parts)?;
    let mut report = Report { edited: job.arm.edited.clone(), ..Report::default() };
    for part in &parts {
        add(part, args.json, &mut report);
    }
    write(args, &parts, &mut report, console)?;
    if let Some(path) = &args.record {
        let results = parts.iter().flat_map(|part| &part.results);
        picture::write(path, results.filter_map(|result| Some((result.label(), result.poses(job)?))))?;
        report.written.push(path.display().to_string());
    }
    if args.json {
        console.print(&to_json(&report)?)?;
    }
    for part in &parts {
        remarks(job, part, &parts, console);
    }
    for line in report.lines() {
        console.remark(&line);
    }
    let has_targets = parts.iter().any(|part| !part.scan.targets.is_empty());
    if parts.iter().all(|part| part.scan.targets.is_empty() && part.scan.left.is_empty()) {
        console.remark("no motion target was found; is it this dialect?");
    }
    Ok(if report.left == 0 && has_targets { ExitStatus::Accepted } else { ExitStatus::NotAccepted })
}

fn file_name(path: &Path) -> String {
    path.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned())
}

/// Only computed points are corrected, and only the user knows whether they are.
fn check_points(points: Option<Points>, scan: &Scan) -> Result<(), Failure> {
    let hints: Vec<String> = scan.hints.iter().map(ToString::to_string).collect();
    let hints = if hints.is_empty() { String::new() } else { format!(" (in this program: {})", hints.join("; ")) };
    match points {
        Some(Points::Computed) => Ok(()),
        Some(Points::Taught) => Err(Failure::new(ExitStatus::Usage, TAUGHT)
            .hint("correct what was computed: programs of offline systems, CAD, measured or calculated positions")),
        None => {
            let guess = scan.hints.iter().find_map(Hint::is_computed);
            let guess = match guess {
                Some(true) => ". They look computed",
                Some(false) => ". They look taught",
                None => "",
            };
            let message = format!(
                "are the points of this program computed or taught?{hints}{guess}. Computed points (offline programming, CAD) are where the nominal arm \
                 would be and are corrected; {TAUGHT}"
            );
            Err(Failure::new(ExitStatus::Usage, message).hint("give '--points computed' or '--points taught'"))
        }
    }
}

/// A path of which only a part is corrected does not fit together.
fn check_paths(args: &CompensateArgs, parts: &[Part<'_>]) -> Result<(), Failure> {
    if args.partial {
        return Ok(());
    }
    for part in parts {
        let torn = correct::half_corrected(&part.scan, &part.results);
        let Some(first) = torn.first() else { continue };
        let reason = why_left(part, *first);
        let message = format!(
            "'{}': {} would stay uncorrected beside corrected ones of the same path, first line {first}{reason}; nothing is written",
            part.path.display(),
            counted(torn.len(), "move")
        );
        return Err(Failure::new(ExitStatus::NotAccepted, message)
            .hint("name what is missing ('--tool', '--frame', '--companion'), or accept it with '--partial'"));
    }
    Ok(())
}

/// The reason why the move on a line is left, for a message.
fn why_left(part: &Part<'_>, line: usize) -> String {
    let step = part.scan.moves.iter().find(|step| step.line == line);
    let target = step.and_then(|step| part.results.get(step.target?)).and_then(|result| result.report.reason.clone());
    let left = part.scan.left.iter().find(|left| left.line == line).map(|left| left.reason.to_string());
    target.or(left).map_or_else(String::new, |reason| format!(" ({reason})"))
}

/// Whether something that is left counts as a motion target that should have been corrected.
fn is_missed(reason: &Reason) -> bool {
    // Not motions, or read with the file that has them.
    !matches!(reason, Reason::InFile(_) | Reason::SystemVariable | Reason::NotMovedTo | Reason::OtherGroup)
}

/// Adds a program to the report; the places that are left one by one only for other programs, as there may be very many.
fn add(part: &Part<'_>, is_complete: bool, report: &mut Report) {
    let corrected = part.results.iter().filter(|result| result.is_done()).count();
    report.corrected += corrected;
    let missed = part.scan.left.iter().filter(|left| is_missed(&left.reason)).count();
    report.left += part.results.len() - corrected + missed;
    report.targets.extend(part.results.iter().map(|result| result.report.clone()));
    let left = part.scan.left.iter().filter(|_| is_complete);
    report.targets.extend(left.map(|left| super::report::TargetReport {
        line: left.line,
        name: left.name.clone(),
        status: "left",
        reason: Some(left.reason.to_string()),
        ..super::report::TargetReport::default()
    }));
    report.paths.extend(part.paths.iter().cloned());
}

fn write<O: Write, E: Write>(
    args: &CompensateArgs,
    parts: &[Part<'_>],
    report: &mut Report,
    console: &mut Console<O, E>,
) -> Result<(), Failure> {
    let Some(out) = &args.out else {
        return match parts {
            [part] if !args.json => console.print_bytes(&part.corrected),
            [_] => Ok(()),
            _ => Err(Failure::new(ExitStatus::Usage, "several programs need a folder").hint("give '--out DIR'")),
        };
    };
    if parts.len() > 1 {
        store::create_folder(out).map_err(|error| Failure::from_error(ExitStatus::Store, &error))?;
    }
    let is_folder = parts.len() > 1 || out.is_dir();
    let place = |part: &Part<'_>| if is_folder { out.join(file_name(part.path)) } else { out.clone() };
    let paths: Vec<PathBuf> = parts.iter().map(place).collect();
    for (index, (path, part)) in paths.iter().zip(parts).enumerate() {
        if is_same_file(path, part.path) {
            let message = format!("'{}' is the program to correct; nothing is written", path.display());
            return Err(Failure::new(ExitStatus::Usage, message)
                .hint("write to another folder: corrected targets must not be corrected a second time"));
        }
        if paths[..index].contains(path) {
            let message = format!("two programs would be written as '{}'; nothing is written", path.display());
            return Err(Failure::new(ExitStatus::Usage, message).hint("correct programs of one name one by one"));
        }
    }
    for (path, part) in paths.into_iter().zip(parts) {
        store::replace_bytes(&path, &part.corrected).map_err(|error| Failure::from_error(ExitStatus::Store, &error))?;
        if part.is_changed {
            report.written.push(path.display().to_string());
        } else {
            report.unchanged.push(path.display().to_string());
        }
        match (args.json, part.is_changed) {
            (true, _) => {}
            (false, true) => console.say_written(&path)?,
            (false, false) => console.say(&format!("unchanged: {}\n", path.display()))?,
        }
    }
    Ok(())
}

/// A line of the program that a remark names.
enum Note<'a> {
    Target(&'a Corrected),
    Left(&'a LeftAlone),
}

impl Note<'_> {
    const fn line(&self) -> usize {
        match self {
            Self::Target(result) => result.report.line,
            Self::Left(left) => left.line,
        }
    }

    fn text(&self) -> String {
        let named =
            |name: &Option<String>| name.as_ref().map_or_else(String::new, |name| format!("{}: ", printable(name)));
        match self {
            Self::Target(result) => {
                let left = if result.is_done() { "" } else { "left as it is: " };
                format!("{}{left}{}", named(&result.report.name), result.report.reason.as_deref().unwrap_or_default())
            }
            Self::Left(left) => format!("{}left as it is: {}", named(&left.name), left.reason),
        }
    }
}

fn remarks<O: Write, E: Write>(job: &Job<'_>, part: &Part<'_>, all: &[Part<'_>], console: &mut Console<O, E>) {
    // What another program of this call contains is corrected there.
    let is_elsewhere = |reason: &Reason| match reason {
        Reason::InFile(name) => all.iter().any(|other| file_name(other.path) == *name),
        _ => false,
    };
    let left: Vec<_> = part.scan.left.iter().filter(|left| !is_elsewhere(&left.reason)).collect();
    let with_reason = part.results.iter().filter(|result| result.report.reason.is_some());
    let mut notes: Vec<Note<'_>> =
        with_reason.map(Note::Target).chain(left.iter().map(|left| Note::Left(left))).collect();
    notes.sort_by_key(Note::line);
    for note in notes.iter().take(SHOWN) {
        console.remark(&format!("line {}: {}", note.line(), note.text()));
    }
    if notes.len() > SHOWN {
        console.remark(&format!("and {} more lines", notes.len() - SHOWN));
    }
    if let Some(first) = part.undivided.first() {
        console.remark(&format!(
            "{} would need more points and cannot get them, first line {first}: points are put only into plain linear moves directly behind another \
             move",
            counted(part.undivided.len(), "move")
        ));
    }
    let external = |reason: &Reason| matches!(reason, Reason::ExternalAxes | Reason::SeventhAxis);
    if left.iter().any(|left| external(&left.reason)) {
        console.remark(
            "external axes that carry neither the arm nor the workpiece do not matter: '--ignore-external-axes'",
        );
    }
    let (joints, mut largest) = (job.joints(), vec![0.0; job.joints().len()]);
    for result in &part.results {
        result.widen(&mut largest);
    }
    let corrections = joints.iter().zip(&largest).map(|(joint, largest)| {
        let quantity = joint.joint_type.quantity();
        format!("{} {:.3} {}", joint.name, quantity.to_edge(*largest), quantity.unit())
    });
    let corrections: Vec<String> = corrections.collect();
    let count = |is_pose: bool| {
        let of_kind = |index: &usize| {
            part.scan.targets.get(*index).is_some_and(|target| matches!(target.goal, Goal::Pose(_)) == is_pose)
        };
        let indices: Vec<usize> = (0..part.results.len()).filter(of_kind).collect();
        let done = indices.iter().filter(|index| part.results[**index].is_done()).count();
        (done, indices.len())
    };
    let ((joint, joints_found), (pose, poses_found)) = (count(false), count(true));
    let position_only =
        part.results.iter().filter(|result| result.is_done() && result.report.status == Status::PositionOnly.name());
    console.remark(&format!(
        "{}: {joint} of {joints_found} joint targets and {pose} of {poses_found} Cartesian targets corrected ({} in position only), {} left; \
         largest corrections: {}",
        printable(&file_name(part.path)),
        position_only.count(),
        counted(left.len(), "other place"),
        corrections.join(", ")
    ));
}
