//! How to apply the result, and what not to do with it.

use super::markup::{add, escape, list, paragraph};
use crate::report::document::{Document, PointOrigin, ResultState};
use crate::session::summary::VerdictStatus;

/// The content of a file beside the report.
fn about(file: &str) -> &'static str {
    match file {
        "calibration.ron" => "the identified arm with everything needed to use or verify it: the result to apply",
        "measurements.csv" => "everything measured that counts; any program can identify from it again",
        "plan.csv" => "the poses that were planned",
        "corrected.ron" => "a robot profile with the identified geometry",
        "corrected.urdf" => "the identified chain as a robot description (URDF); read back and compared",
        "dh.csv" => "the identified link constants with all digits, convention and couplings",
        "joint-corrections.csv" => {
            "what to add to the commanded angle of each joint, and how far it gives way under gravity"
        }
        "default_kinematics.yaml" => "kinematics for the ROS description of Universal Robots",
        "drift.csv" => "the pose that was measured repeatedly",
        _ => "",
    }
}

pub(super) fn section(document: &Document) -> String {
    let report = &document.report;
    let mut html = String::from("<h2>How to apply the result</h2>\n");
    let verdict = document.result.as_ref().map(|result| result.verdict.status);
    let stop = match (report.state, report.points_from, verdict) {
        (ResultState::None, ..) => Some("There is no result yet: identify first."),
        (ResultState::OutOfDate, ..) => {
            Some("Do not apply it: samples have changed. Identify again, and write a new report.")
        }
        (ResultState::Unusable, ..) => Some("There is nothing to apply: the data gave no usable solution."),
        (_, PointOrigin::Simulated, _) => Some("Do not apply it to a robot: the points are simulated."),
        (_, _, Some(VerdictStatus::NotAccepted)) => Some("Do not apply it until the reason for NOT ACCEPTED is found."),
        (_, _, Some(VerdictStatus::NotEvaluated)) => {
            Some("It was not evaluated against all limits: verify it before relying on it.")
        }
        _ => None,
    };
    if let Some(stop) = stop {
        add(&mut html, &format!("<div class=\"warn\"><b>{stop}</b></div>\n"));
    }
    if matches!(report.state, ResultState::None | ResultState::Unusable) {
        return html;
    }
    let files: Vec<String> = report
        .files
        .iter()
        .map(|file| match about(&file.name) {
            "" => format!("<code>{}</code>", escape(&file.name)),
            about => format!("<code>{}</code>: {about}", escape(&file.name)),
        })
        .collect();
    if !files.is_empty() {
        html.push_str(&paragraph("Files beside this report:"));
        html.push_str(&list(&files));
    }
    html.push_str("<h3>What to do</h3>\n");
    let has_joint_errors = document.result.as_ref().is_some_and(|result| !result.joint_errors.is_empty());
    let constants = if has_joint_errors {
        "Best: let <code>trupose compensate</code> change the joint values of the programs; it knows the errors of the joints. Where only link constants can be applied, use those of <code>dh.csv</code> (<code>trupose export --format dh-csv</code>): they were identified without errors of joints, and the head of the file says how much accuracy that costs. Never apply the constants of the table above alone."
    } else {
        "Put the identified link constants of the table above into the offline programming system, or into the controller where it takes them. Use the values of <code>calibration.ron</code>: they have all digits."
    };
    let todo = [
        constants,
        "Check the signs and the order of the joints on one pose at low speed, with a hand on the enabling switch.",
        "Teach tool and user frames again, or convert them: those taught with the nominal model do not fit the identified one.",
        "Verify on new poses, now and after every event that may move something (collision, change of a motor or gear, new mastering): <code>trupose verify --calibration calibration.ron --measurements NEW.csv --refit frame+target</code>",
        "Keep this report, <code>measurements.csv</code> and <code>calibration.ron</code> together.",
    ];
    html.push_str(&list(&todo.map(str::to_owned)));
    html.push_str("<h3>What must not be done</h3>\n");
    let never = [
        "Do not apply it to another arm of the same type: it belongs to this serial number.",
        "Do not apply it on top of a correction that was off while measuring (an accuracy option of the controller): measure and run with the same setting.",
        "Do not take single parameters out of a group marked <i>only combined</i>.",
        "Do not rely on it outside the measured joint ranges, or with a much larger payload than during the measurement.",
        "Do not quote the residuals of the fit as accuracy.",
    ];
    html.push_str(&list(&never.map(str::to_owned)));
    html
}
