//! `trupose compensate --program`: the motion targets of existing robot programs, corrected.

use std::io::Write;
use std::path::{Path, PathBuf};

use super::super::{Console, to_json};
use super::{SHOWN, is_same_file, picture};
use crate::cli::compensate::{CompensateArgs, Points};
use crate::compensation::Status;
use crate::correction::Corrector;
use crate::correction::program::{self, CorrectedProgram, CorrectionError, Input, TAUGHT, Work};
use crate::correction::report::Report;
use crate::correction::settings::Settings;
use crate::correction::targets::{Corrected, Resolved};
use crate::error::{ExitStatus, Failure};
use crate::program::motion::{Companion, Goal, Hint, LeftAlone, ReadOptions, Reason, Scan};
use crate::program::{Dialect, insert};
use crate::store;
use crate::text::{counted, printable};
use crate::units::from_mm;

/// A program and what becomes of it.
struct Part<'p> {
    path: &'p Path,
    program: CorrectedProgram,
}

pub(super) fn run<O: Write, E: Write>(
    args: &CompensateArgs,
    job: &Corrector<'_>,
    dialect: Dialect,
    console: &mut Console<O, E>,
) -> Result<ExitStatus, Failure> {
    if args.insert.is_some()
        && let Some(reason) = insert::cannot_insert(dialect)
    {
        return Err(Failure::new(
            ExitStatus::Usage,
            format!("points cannot be inserted into {dialect} programs: {reason}"),
        )
        .hint("'--insert' is for RAPID, KRL and URScript; without it the path between the targets is only judged"));
    }
    let files = args.program.iter().chain(&args.companion).map(|path| {
        let file = store::read(path).map_err(|error| Failure::from_error(ExitStatus::Usage, &error))?;
        Ok((path.as_path(), Input::new(file)))
    });
    let files: Vec<(&Path, Input)> = files.collect::<Result<_, Failure>>()?;
    let mut parts = Vec::new();
    for (path, input) in files.iter().take(args.program.len()) {
        let others = files.iter().filter(|(other, _)| other != path);
        let companions = others.map(|(path, input)| Companion { name: file_name(path), text: input.text.clone() });
        let work = Work {
            dialect,
            options: ReadOptions {
                joint_names: (!args.joint_names.is_empty()).then(|| args.joint_names.clone()),
                companions: companions.collect(),
                ignores_external_axes: args.ignore_external_axes,
            },
            resolved: Resolved {
                tools: Settings { given: &args.tool, kind: "tool" },
                frames: Settings { given: &args.frame, kind: "frame" },
            },
            insert: args.insert.map(from_mm),
        };
        let failed = |error: CorrectionError| {
            let status = match &error {
                CorrectionError::Program(_) => ExitStatus::Usage,
                CorrectionError::Unproven(_) => ExitStatus::Internal,
            };
            Failure::new(status, format!("'{}': {error}", path.display()))
        };
        let scan = program::scan(job, &work, input).map_err(|error| failed(error.into()))?;
        check_points(args.points, &scan)?;
        let program = program::corrected(job, &work, input, scan).map_err(failed)?;
        if program.lacks_remark {
            console.remark(&format!(
                "note: '{}' has no place for a remark, so it does not say that the calibration was edited",
                path.display()
            ));
        }
        parts.push(Part { path, program });
    }
    check_paths(args, &parts)?;
    let mut report = Report { edited: job.arm.edited.clone(), ..Report::default() };
    for part in &parts {
        add(part, args.json, &mut report);
    }
    write(args, &parts, &mut report, console)?;
    if let Some(path) = &args.record {
        let results = parts.iter().flat_map(|part| &part.program.results);
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
    let has_targets = parts.iter().any(|part| !part.program.scan.targets.is_empty());
    if parts.iter().all(|part| part.program.scan.targets.is_empty() && part.program.scan.left.is_empty()) {
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
        let torn = part.program.torn();
        let Some(first) = torn.first() else { continue };
        let reason = part.program.why_left(*first).map_or_else(String::new, |reason| format!(" ({reason})"));
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

/// Adds a program to the report; the places that are left one by one only for other programs, as there may be very many.
fn add(part: &Part<'_>, is_complete: bool, report: &mut Report) {
    let program = &part.program;
    report.corrected += program.done();
    report.left += program.missed();
    let count = if is_complete { usize::MAX } else { program.results.len() };
    report.targets.extend(program.reports().take(count));
    report.paths.extend(program.paths.iter().cloned());
}

fn write<O: Write, E: Write>(
    args: &CompensateArgs,
    parts: &[Part<'_>],
    report: &mut Report,
    console: &mut Console<O, E>,
) -> Result<(), Failure> {
    let Some(out) = &args.out else {
        return match parts {
            [part] if !args.json => console.print_bytes(&part.program.file),
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
        store::replace_bytes(&path, &part.program.file)
            .map_err(|error| Failure::from_error(ExitStatus::Store, &error))?;
        if part.program.is_changed {
            report.written.push(path.display().to_string());
        } else {
            report.unchanged.push(path.display().to_string());
        }
        match (args.json, part.program.is_changed) {
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
                let missing = result.report.missing.as_ref();
                let option = missing.map_or_else(String::new, |missing| {
                    let name =
                        if missing.name.is_empty() { String::new() } else { format!("{}=", printable(&missing.name)) };
                    format!("; give '--{} {name}x,y,z,rx,ry,rz'", missing.kind)
                });
                let reason = result.report.reason.as_deref().unwrap_or_default();
                format!("{}{left}{reason}{option}", named(&result.report.name))
            }
            Self::Left(left) => format!("{}left as it is: {}", named(&left.name), left.reason),
        }
    }
}

fn remarks<O: Write, E: Write>(job: &Corrector<'_>, part: &Part<'_>, all: &[Part<'_>], console: &mut Console<O, E>) {
    // What another program of this call contains is corrected there.
    let is_elsewhere = |reason: &Reason| match reason {
        Reason::InFile(name) => all.iter().any(|other| file_name(other.path) == *name),
        _ => false,
    };
    let left: Vec<_> = part.program.scan.left.iter().filter(|left| !is_elsewhere(&left.reason)).collect();
    let with_reason = part.program.results.iter().filter(|result| result.report.reason.is_some());
    let mut notes: Vec<Note<'_>> =
        with_reason.map(Note::Target).chain(left.iter().map(|left| Note::Left(left))).collect();
    notes.sort_by_key(Note::line);
    for note in notes.iter().take(SHOWN) {
        console.remark(&format!("line {}: {}", note.line(), note.text()));
    }
    if notes.len() > SHOWN {
        console.remark(&format!("and {} more lines", notes.len() - SHOWN));
    }
    if let Some(first) = part.program.undivided.first() {
        console.remark(&format!(
            "{} would need more points and cannot get them, first line {first}: points are put only into plain linear moves directly behind another \
             move",
            counted(part.program.undivided.len(), "move")
        ));
    }
    let external = |reason: &Reason| matches!(reason, Reason::ExternalAxes | Reason::SeventhAxis);
    if left.iter().any(|left| external(&left.reason)) {
        console.remark(
            "external axes that carry neither the arm nor the workpiece do not matter: '--ignore-external-axes'",
        );
    }
    let (joints, mut largest) = (job.joints(), vec![0.0; job.joints().len()]);
    for result in &part.program.results {
        result.widen(&mut largest);
    }
    let corrections = joints.iter().zip(&largest).map(|(joint, largest)| {
        let quantity = joint.joint_type.quantity();
        format!("{} {:.3} {}", joint.name, quantity.to_edge(*largest), quantity.unit())
    });
    let corrections: Vec<String> = corrections.collect();
    let count = |is_pose: bool| {
        let of_kind = |index: &usize| {
            part.program.scan.targets.get(*index).is_some_and(|target| matches!(target.goal, Goal::Pose(_)) == is_pose)
        };
        let indices: Vec<usize> = (0..part.program.results.len()).filter(of_kind).collect();
        let done = indices.iter().filter(|index| part.program.results[**index].is_done()).count();
        (done, indices.len())
    };
    let ((joint, joints_found), (pose, poses_found)) = (count(false), count(true));
    let position_only = part
        .program
        .results
        .iter()
        .filter(|result| result.is_done() && result.report.status == Status::PositionOnly.name());
    console.remark(&format!(
        "{}: {joint} of {joints_found} joint targets and {pose} of {poses_found} Cartesian targets corrected ({} in position only), {} left; \
         largest corrections: {}",
        printable(&file_name(part.path)),
        position_only.count(),
        counted(left.len(), "other place"),
        corrections.join(", ")
    ));
}
