//! Entries in one line each, for transcripts and lists. Stable: scripts and people compare them.

use super::entry::{Correction, Decision, Entry, MeasuredText, PlanText};
use crate::session::about::About;
use crate::session::plan::PoseKind;
use crate::session::set_up::{InstrumentChoice, Step, TargetChoice};
use crate::session::summary::{IdentificationSummary, StatisticsSummary};
use crate::session::wire::LinkChoice;

impl Entry {
    /// The entry in one line, without a full stop.
    pub fn describe(&self) -> String {
        match self {
            Self::Opened { program, name, .. } => format!("session '{name}' opened by {program}"),
            Self::Profile { source, sha256, .. } => {
                format!("profile '{source}' (sha256 {}…)", sha256.chars().take(12).collect::<String>())
            }
            Self::Step(step) => format!("step {} of {}: {step}", step.number(), Step::ALL.len()),
            Self::Instrument(instrument) => format!("instrument: {}", instrument_text(instrument)),
            Self::Connected { identity } => format!("connected: {identity}"),
            Self::Target(target) => format!("SMR: {}", target_text(target)),
            Self::Payload(payload) => format!("payload: {payload}"),
            Self::Cell(cell) => format!("cell: {cell}"),
            Self::CirclePoint(point) => {
                format!("measurement {}: joint {} turned, at {}", point.number, point.joint + 1, xyz(point.xyz_mm))
            }
            Self::CirclesDiscarded => "circles discarded".to_owned(),
            Self::Plan(plan) => format!("plan: {}", plan_text(plan)),
            Self::PlanExtended(plan) => format!("more poses: {}", plan_text(plan)),
            Self::Sample(sample) => sample_text(sample),
            Self::Refused { number, pose, reason, .. } => {
                format!("measurement {number}: pose {pose}: no sample: {reason}")
            }
            Self::Decision { sample, decision } => {
                let decision = match decision {
                    Decision::Keep => "kept",
                    Decision::LeaveOut => "excluded",
                    Decision::Undo => "undone",
                };
                format!("measurement {sample}: {decision}")
            }
            Self::Correction(correction) => correction_text(correction),
            Self::Undone { line, what } => format!("undone: {what} (line {line})"),
            Self::Redone { line, what } => format!("done again: {what} (line {line})"),
            Self::JointCheckPoint(point) => {
                let turned = point.joint.map_or_else(
                    || "start of the joint check".to_owned(),
                    |joint| format!("joint check, joint {} moved", joint + 1),
                );
                format!("measurement {}: {turned}, at {}", point.number, xyz(point.xyz_mm))
            }
            Self::JointCheckDiscarded => "joint check discarded".to_owned(),
            Self::Row(row) => format!("went to row {} of the plan", row + 1),
            Self::Passed { pose, .. } => format!("passed through '{pose}'"),
            Self::RobotProgram(program) => format!("robot program written: {}", program.files.join(", ")),
            Self::ProgramDriven => "the robot program was driven once by hand".to_owned(),
            Self::ThroughHome(row) => format!("going through home to row {} of the plan", row + 1),
            Self::Skipped { row, skipped: true } => format!("row {} of the plan skipped", row + 1),
            Self::Skipped { row, skipped: false } => format!("row {} of the plan is to be measured after all", row + 1),
            Self::Note { pose: Some(pose), text } => format!("note to pose {pose}: {text}"),
            Self::Note { pose: None, text } => format!("note: {text}"),
            Self::About(about) => format!("for the report: {}", about_text(about)),
            Self::Identified(result) => result_text(&result.summary, result.calibration.is_some()),
            Self::Delivered { files, left_out, .. } if left_out.is_empty() => format!("written: {}", files.join(", ")),
            Self::Delivered { files, left_out, .. } => {
                format!("written: {}; left out: {}", files.join(", "), left_out.join("; "))
            }
            Self::Corrected(program) => format!("program corrected: {}", program.line()),
            Self::Resumed { program, torn_bytes: 0 } => format!("resumed by {program}"),
            Self::Resumed { program, torn_bytes } => {
                format!("resumed by {program}; {torn_bytes} bytes of an incomplete last entry dropped")
            }
            Self::Closed { reason } => format!("closed: {reason}"),
        }
    }
}

fn xyz((x, y, z): (f64, f64, f64)) -> String {
    format!("({x:.4}, {y:.4}, {z:.4}) mm")
}

fn sample_text(sample: &MeasuredText) -> String {
    let MeasuredText { number, pose, kind, xyz_mm, factor, scatter_mm, findings, .. } = sample;
    let kind = match kind {
        PoseKind::Identification => "",
        PoseKind::Verification => " (verification)",
        PoseKind::Drift => " (drift)",
        PoseKind::Home | PoseKind::Via => " (on the way)",
    };
    let scatter = scatter_mm.map_or_else(String::new, |scatter| format!(", scatter {scatter:.4} mm"));
    let factor = factor.map_or_else(String::new, |factor| format!(" times {factor}, in the unit of the one before"));
    let findings: Vec<String> =
        findings.iter().map(|finding| format!("; CHECK {}: {}", finding.cause, finding.message)).collect();
    format!("measurement {number}: pose {pose}{kind} at {}{factor}{scatter}{}", xyz(*xyz_mm), findings.concat())
}

fn plan_text(plan: &PlanText) -> String {
    let condition = plan.condition_number.map(|condition| format!(", condition number {condition:.1}"));
    let error = plan.predicted_error_sigma.map(|error| format!(", predicted error {error:.3} sigma"));
    format!(
        "{} identification and {} verification poses, {}{}{}",
        plan.count(PoseKind::Identification),
        plan.count(PoseKind::Verification),
        plan.origin,
        condition.unwrap_or_default(),
        error.unwrap_or_default()
    )
}

/// The correction in one line.
pub fn correction_text(correction: &Correction) -> String {
    match correction {
        Correction::Scale { since, factor, until: None } => {
            format!("corrected: coordinates from measurement {since} on times {factor}")
        }
        Correction::Scale { since, factor, until: Some(until) } if since == until => {
            format!("corrected: coordinates of measurement {since} times {factor}")
        }
        Correction::Scale { since, factor, until: Some(until) } => {
            format!("corrected: coordinates of measurements {since} to {until} times {factor}")
        }
        Correction::Swap { first, second } => format!("corrected: measurements {first} and {second} change places"),
        Correction::Row { sample, row } => {
            format!("corrected: measurement {sample} belongs to row {} of the plan", row + 1)
        }
        Correction::Joints { sample, joints } => {
            let joints: Vec<String> = joints.iter().map(|value| format!("{value:.3}")).collect();
            format!("corrected: at measurement {sample} the robot was at ({})", joints.join(", "))
        }
        Correction::TakenBack { line } => format!("the correction in line {line} is undone"),
    }
}

fn result_text(summary: &IdentificationSummary, is_usable: bool) -> String {
    if !is_usable {
        return format!("identified from {} samples: no usable solution", summary.samples);
    }
    let rank = summary.rank.map_or_else(|| "unclear".to_owned(), |rank| rank.to_string());
    let text = format!(
        "identified from {} samples: {} parameters, rank {rank}, {} rejected",
        summary.samples,
        summary.parameter_count,
        summary.rejected.len()
    );
    let Some(verification) = &summary.verification else { return text + "; not verified" };
    let position = |statistics: &Option<StatisticsSummary>| {
        statistics.map_or_else(|| "-".to_owned(), |position| format!("{:.3}", position.mean))
    };
    let verified = format!(
        "; verified on {} samples: mean position error {} mm nominal, {} mm identified",
        verification.samples,
        position(&verification.nominal.position_mm),
        position(&verification.identified.position_mm)
    );
    format!("{text}{verified}; {}", summary.verdict.word().to_lowercase())
}

fn about_text(about: &About) -> String {
    let texts: Vec<String> = about.given().map(|(detail, text)| format!("{} {text}", detail.label())).collect();
    if texts.is_empty() { "nothing given".to_owned() } else { texts.join(", ") }
}

/// An instrument in one line.
pub fn instrument_text(instrument: &InstrumentChoice) -> String {
    match instrument {
        InstrumentChoice::Manual { unit } => format!("typed in by hand, in {}", unit.sign()),
        InstrumentChoice::Simulated(simulation) => {
            let faults: Vec<String> = simulation.faults.iter().map(ToString::to_string).collect();
            let faults = if faults.is_empty() { String::new() } else { format!(", with {}", faults.join(", ")) };
            let wires: Vec<&str> = simulation.wires.iter().map(|wire| wire.protocol().name()).collect();
            let wires = if wires.is_empty() { String::new() } else { format!(", over {}", wires.join(" and ")) };
            format!("simulated cell, seed {}{wires}{faults}", simulation.seed)
        }
        InstrumentChoice::Linked(LinkChoice { address, robot, is_automatic, .. }) => {
            let robot = robot.as_ref().map_or_else(String::new, |robot| format!(", robot {robot}"));
            let automatic = if *is_automatic { ", measuring automatically" } else { "" };
            crate::text::printable(&format!("{address}{robot}{automatic}"))
        }
        InstrumentChoice::Replay { sets } => {
            let files: Vec<&str> = sets.iter().map(|set| set.file.as_str()).collect();
            format!("recorded measurements: {}", files.join(", "))
        }
    }
}

/// The chosen position of the SMR, in one line.
pub fn target_text(choice: &TargetChoice) -> String {
    let at = |(x, y, z): (f64, f64, f64)| format!("({x:.3}, {y:.3}, {z:.3}) mm in the flange");
    match *choice {
        TargetChoice::Profile => "as the profile says".to_owned(),
        TargetChoice::Known { xyz_mm, sigma_mm } if sigma_mm <= 0.0 => format!("{}, exact", at(xyz_mm)),
        TargetChoice::Known { xyz_mm, sigma_mm } => format!("{}, to {sigma_mm} mm", at(xyz_mm)),
        TargetChoice::Free { sigma_mm } => format!("free, within {sigma_mm} mm of the place in the profile"),
        TargetChoice::Circles { xyz_mm, sigma_mm } => format!("{}, to {sigma_mm:.3} mm, from circles", at(xyz_mm)),
    }
}
