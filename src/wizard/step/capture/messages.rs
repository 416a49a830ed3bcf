//! Messages about readings, samples and corrections.

use crate::session::journal::{Correction, Entry, MeasuredText};
use crate::session::reading::Reading;
use crate::session::state::{Robot, Session};
use crate::wizard::live::AS_PLANNED;
use crate::wizard::notice::Notice;

/// The message about a robot that is not at the configuration shown. The reported values are used; both are kept.
pub(super) fn not_as_planned(noted: &MeasuredText, robot: &Robot) -> Option<Notice> {
    let reported = noted.reported_joints.as_ref()?;
    let differences = reported.iter().zip(&noted.joints).map(|(reported, shown)| (reported - shown).abs());
    let (joint, difference) = differences.enumerate().max_by(|(_, one), (_, other)| one.total_cmp(other))?;
    let joint = robot.profile.chain().joints().get(joint)?;
    let quantity = joint.joint_type.quantity();
    (quantity.from_edge(difference) > AS_PLANNED).then(|| {
        Notice::attention(format!(
            "pose {}: joint {} is {difference:.3} {} away from the plan",
            noted.pose,
            joint.name,
            quantity.unit()
        ))
        .hint("the joint values reported by the robot are used; the planned ones are kept for reference. Remeasure if this was unintended")
    })
}

/// The message about remarks of the instrument that the operator has to see.
pub(super) fn remarked(pose: &str, reading: &Reading) -> Option<Notice> {
    let warnings: Vec<&str> =
        reading.remarks.iter().filter(|remark| remark.is_warning).map(|remark| remark.text.as_str()).collect();
    let notice = || {
        Notice::attention(format!("pose {pose}: the instrument says: {}", warnings.join("; ")))
            .hint("the point is kept with this remark; measure again if that may be better")
    };
    (!warnings.is_empty()).then(notice)
}

/// The entry of a reading that is refused.
pub(super) fn refused(noted: &MeasuredText, reason: String) -> Entry {
    let xyz_mm =
        [noted.xyz_mm.0, noted.xyz_mm.1, noted.xyz_mm.2].iter().all(|value| value.is_finite()).then_some(noted.xyz_mm);
    Entry::Refused { number: noted.number, pose: noted.pose.clone(), reason, xyz_mm }
}

/// Ends a correction of the unit at the last measurement: it must not convert measurements to come.
pub(super) fn bounded(remedy: Correction, session: &Session) -> Correction {
    match remedy {
        // Earlier versions proposed it without an end.
        Correction::Scale { since, factor, until: None } => {
            Correction::Scale { since, factor, until: Some(session.measurements) }
        }
        remedy => remedy,
    }
}

/// The message about a sample that is still in the unit from which the previous one was converted.
pub(super) fn other_unit(noted: &MeasuredText, factor: f64) -> Notice {
    let what = format!("pose {}: still in the wrong unit; its coordinates are multiplied by {factor}", noted.pose);
    Notice::attention(what)
        .hint("switch the instrument back to the expected unit; points in that unit are taken as they are")
}

pub(super) fn corrected(correction: &Correction) -> String {
    match correction {
        Correction::Scale { since, factor, until } => {
            let which = match until {
                None => format!("from measurement {since} on"),
                Some(until) if until == since => format!("of measurement {since}"),
                Some(until) => format!("of measurements {since} to {until}"),
            };
            format!("coordinates {which} are multiplied by {factor}; the original values stay in the journal")
        }
        Correction::Swap { first, second } => format!("measurements {first} and {second} were swapped"),
        Correction::Row { sample, .. } => format!("measurement {sample} was assigned to the pose where the robot was"),
        Correction::Joints { sample, .. } => format!("measurement {sample} now uses the corrected joint values"),
        Correction::TakenBack { .. } => {
            "the correction that followed from the measurement is undone with it; both stay in the journal".to_owned()
        }
    }
}
