//! `trupose identify`: kinematic errors from measured points.

use std::io::Write;
use std::ops::ControlFlow;
use std::path::Path;

use super::load::now;
use super::progress::Progress;
use super::{Console, advice, estimation_settings, identity, load, payload_of, record, to_json};
use crate::checksum::{self, Syntax};
use crate::cli::{EstimationArgs, IdentifyArgs};
use crate::error::{ExitStatus, Failure};
use crate::procedure::checks;
use crate::procedure::deliver::{REPORT_HTML, REPORT_JSON};
use crate::procedure::health::Mounting;
use crate::procedure::identify::{IdentifyRequest, NamedSample, SampleSet, identify};
use crate::procedure::recalibrate::Previous;
use crate::profile::{Level, Profile};
use crate::report;
use crate::session::TableProblem;
use crate::session::about::About;
use crate::session::calibration::Calibration;
use crate::session::measurements::Row;
use crate::session::state::Session;
use crate::session::summary::{IdentificationSummary, InputRole, VerdictStatus, VerificationMode};
use crate::store::{self, Links};

pub(super) fn run<O: Write, E: Write>(args: &IdentifyArgs, console: &mut Console<O, E>) -> Result<ExitStatus, Failure> {
    let estimation = &args.estimation;
    let mut loaded = load::profile(&estimation.profile)?;
    let previous = previous(args, &mut loaded, console)?;
    for diagnostic in &loaded.warnings {
        console.remark(&diagnostic.to_string());
    }
    args.record.record.as_deref().map_or(Ok(()), record::check_target)?;
    let named = (&loaded.profile, estimation.profile.as_str());
    let identification = load::measurements(&args.measurements, &args.layout, named, InputRole::Identification)?;
    if let Some(note) = &identification.table.understood.orientation {
        console.remark(&format!("note: {note}"));
    }
    load::take_bodies(&mut loaded, &identification.table, console)?;
    let profile = &loaded.profile;
    let named = (profile, estimation.profile.as_str());
    let filter = load::filter(estimation.filter.as_deref(), &identification.table.columns)?;
    let (rows, rest) = load::split(&identification.table, filter.as_ref())?;
    let verification = args
        .verify
        .as_ref()
        .map(|path| load::measurements(path, &args.layout, named, InputRole::Verification))
        .transpose()?;
    let (verification_rows, basis, verification_mode) = match &verification {
        Some(loaded) => {
            let basis = format!("'{}', same set-up", loaded.input.file);
            (load::split(&loaded.table, None)?.0, basis, VerificationMode::File)
        }
        None if args.verify_rest => (rest, "the rows that '--use' leaves out".to_owned(), VerificationMode::Rest),
        None => (Vec::new(), String::new(), VerificationMode::None),
    };
    if verification_mode != VerificationMode::None && verification_rows.is_empty() {
        return Err(Failure::new(ExitStatus::Usage, "no row is left for the verification")
            .hint("'--use' must leave some rows out"));
    }

    let layout = identification.table.layout;
    // With two files, warnings about rows name the file.
    let file = verification.as_ref().map(|_| identification.input.file.as_str());
    let mut set = sample_set(&rows, profile, file, &identification.table.warnings)?;
    let file = verification.as_ref().map(|loaded| loaded.input.file.as_str());
    let odd = verification.as_ref().map_or(&[][..], |loaded| &loaded.table.warnings);
    let mut verification_set = sample_set(&verification_rows, profile, file, odd)?;
    // A result is simulated if either of its tables is.
    let of_verification = || verification.as_ref().and_then(|loaded| loaded.simulated.clone());
    set.warnings.extend(identification.simulated.clone().or_else(of_verification));
    load::settle_changes(&mut set.warnings, estimation.edited);
    load::settle_changes(&mut verification_set.warnings, estimation.edited);
    let inputs = [Some(identification.input), verification.map(|loaded| loaded.input)].into_iter().flatten().collect();
    let payload = payload_of(&estimation.payload, &loaded.profile)?;
    let mut settings = estimation_settings(estimation, args.weighting);
    let mut mounted = None;
    if let Some(previous) = &previous {
        settings.level = Level::Geometric;
        mounted = previous.calibration.mounted.filter(|_| previous.mounting == Mounting::Same);
    }
    let request = IdentifyRequest {
        previous,
        mounted,
        payload,
        profile: loaded.profile,
        profile_text: loaded.text,
        created: now(),
        inputs,
        settings,
        identification: set,
        verification: verification_set,
        basis,
        verification_mode,
        layout: Some(layout),
        socket_distance_mm: None,
    };
    run_request(&request, estimation, args.record.record.as_deref(), console)
}

/// The earlier calibration to begin with. Its own profile is used, because its deviations belong to that.
fn previous<O: Write, E: Write>(
    args: &IdentifyArgs,
    loaded: &mut load::LoadedProfile,
    console: &mut Console<O, E>,
) -> Result<Option<Previous>, Failure> {
    let Some(path) = &args.from_calibration else { return Ok(None) };
    let file = path.display().to_string();
    let earlier = load::calibration(path, args.estimation.edited, console)?;
    if earlier.profile.name() != loaded.profile.name() {
        let (own, other) = (earlier.profile.name(), loaded.profile.name());
        return Err(Failure::new(ExitStatus::Usage, format!("'{file}' is of the robot '{own}', not of '{other}'"))
            .hint("give the profile of the robot that was calibrated"));
    }
    if earlier.calibration.profile != loaded.text {
        console.remark(&format!("note: the profile inside '{file}' is used; the one that was given differs from it"));
        *loaded = load::parse_profile(earlier.calibration.profile.clone(), &format!("{file} (profile)"))?;
    }
    Ok(Some(Previous {
        calibration: earlier.calibration,
        mounting: if args.same_smr { Mounting::Same } else { Mounting::New },
        drift: args.drift.unwrap_or_else(Previous::usual_drift),
    }))
}

/// Identifies as requested, writes a recording if there is a path for it, and delivers the result.
pub(super) fn run_request<O: Write, E: Write>(
    request: &IdentifyRequest,
    args: &EstimationArgs,
    recording: Option<&Path>,
    console: &mut Console<O, E>,
) -> Result<ExitStatus, Failure> {
    if request.settings.contradict_terms() {
        return Err(Failure::new(ExitStatus::Usage, "these settings rule out the errors of joints that are asked for")
            .hint(
                "leave out '--prior none', '--weighting uniform' and '--iterations 1', or '--terms' and '--level full'",
            ));
    }
    let about = identity::about(&args.identity, &About::default())?;
    let mut progress = Progress::new(&mut console.err);
    let mut identified = identify(request, &mut |stage| {
        progress.identifying(stage);
        ControlFlow::Continue(())
    })?;
    identified.put_into_words(advice::words);
    if let Some(path) = recording {
        record::identification(path, &args.profile, &about, request, &identified)?;
    }
    let session = args
        .out
        .as_deref()
        .map(|folder| record::identification_session(folder, &args.profile, &about, request, &identified));
    deliver(identified.summary, identified.calibration.as_ref(), session.transpose()?.as_ref(), args, console)
}

/// The samples of rows with their names; `file` is named where there are several.
fn sample_set(
    rows: &[&Row],
    profile: &Profile,
    file: Option<&str>,
    odd: &[TableProblem],
) -> Result<SampleSet, Failure> {
    let samples = load::samples(rows, profile)?;
    let named = |(row, sample): (&&Row, _)| NamedSample {
        pose: row.pose.clone(),
        line: row.line,
        sample,
        temperature: row.temperature,
    };
    Ok(SampleSet {
        samples: rows.iter().zip(samples).map(named).collect(),
        file: file.map(str::to_owned),
        warnings: checks::table_warnings(file, odd),
        ..SampleSet::default()
    })
}

/// Writes the result files and prints the summary, even if writing fails, so that the numbers are not lost. Without a
/// `calibration` there is no usable solution, and only the report of `session` is written.
fn deliver<O: Write, E: Write>(
    mut summary: IdentificationSummary,
    calibration: Option<&Calibration>,
    session: Option<&Session>,
    args: &EstimationArgs,
    console: &mut Console<O, E>,
) -> Result<ExitStatus, Failure> {
    let mut failed = None;
    if let (Some(folder), Some(session)) = (&args.out, session) {
        failed = save(&mut summary, calibration, session, folder).err();
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
fn save(
    summary: &mut IdentificationSummary,
    calibration: Option<&Calibration>,
    session: &Session,
    folder: &Path,
) -> Result<(), Failure> {
    let store_failure = |error: store::StoreError| Failure::from_error(ExitStatus::Store, &error);
    store::create_folder(folder).map_err(store_failure)?;
    let mut files = Vec::new();
    if let Some(calibration) = calibration {
        let text = calibration.to_text().map_err(|error| Failure::from_error(ExitStatus::Internal, &error))?;
        files.push(("calibration.ron".to_owned(), text));
    }
    let names = files.iter().map(|(name, _)| name.as_str()).chain([REPORT_JSON, REPORT_HTML]);
    summary.written = names.map(|name| folder.join(name).display().to_string()).collect();
    let mut document = report::Document::of_tables(session, &files);
    document.result = Some(summary.clone());
    let document = document.numbered();
    files.push((REPORT_JSON.to_owned(), checksum::with_sum(&to_json(&document)?, Syntax::Json)));
    files.push((REPORT_HTML.to_owned(), checksum::with_sum(&report::report_html(&document), Syntax::Html)));
    let files = files.iter().map(|(name, text)| (folder.join(name), text.as_bytes()));
    store::replace_all(files, Links::Followed).map_err(store_failure)
}

/// The exit status of a verdict: `NotAccepted` only if limits were checked and are not met.
pub(super) fn exit_status(verdict: VerdictStatus) -> ExitStatus {
    if verdict == VerdictStatus::NotAccepted { ExitStatus::NotAccepted } else { ExitStatus::Accepted }
}
