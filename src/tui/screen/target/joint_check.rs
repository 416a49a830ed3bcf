//! The joint check: the configuration to go to, and the result.

use crate::text::fixed;
use crate::tui::screen::page::Page;
use crate::tui::theme::Role;
use crate::wizard::view::{JointCheckRow, JointCheckView};

/// The next point to measure.
pub(super) fn to_measure(check: &JointCheckView, page: &mut Page) {
    let title = match &check.joint {
        Some(joint) => format!("joint check: move {joint} only, point {} of {}", check.measured + 1, check.of),
        None => format!("joint check: go to the start, point {} of {}", check.measured + 1, check.of),
    };
    page.line(vec![(title, Role::Title)]);
    let said = match &check.joint {
        Some(joint) => format!("Move {joint} to the value shown, let the arm come to rest, and measure."),
        None => {
            "Go to this configuration and measure. After that each joint is moved once, by a few degrees.".to_owned()
        }
    };
    page.paragraph(&said, Role::Plain);
    page.gap();
    for shown in &check.joints {
        let (role, remark) = if shown.moves_most {
            (Role::Title, format!("  <- moves by {} {}", fixed(shown.moves, 1), shown.unit))
        } else {
            (Role::Plain, String::new())
        };
        let value = format!("{:<6}{:>11} {:<3}", shown.name, fixed(shown.value, 3), shown.unit);
        page.line(vec![(value, role), (remark, Role::Hint)]);
    }
    page.gap();
    page.paragraph("Points measured so far are kept when you go back.", Role::Dim);
}

/// A value with its standard deviation, or a dash.
fn with_sigma(value: Option<(f64, f64)>) -> String {
    value.map_or_else(|| "-".to_owned(), |(value, sigma)| format!("{} ±{}", fixed(value, 2), fixed(sigma, 2)))
}

fn row(joint: &JointCheckRow) -> Vec<(String, Role)> {
    let line = format!(
        "{:<6}{:>9}{:>16}{:>16} {:<4} ",
        joint.name,
        fixed(joint.asked, 2),
        with_sigma(joint.seen),
        with_sigma(joint.zero),
        joint.unit
    );
    let (word, role) = match (joint.is_right, joint.seen) {
        (false, _) => ("WRONG", Role::Warn),
        (true, Some(_)) => ("right", Role::Ok),
        (true, None) => ("not seen", Role::Dim),
    };
    vec![(line, Role::Plain), (word.to_owned(), role)]
}

/// The result of the check.
pub(super) fn result(check: &JointCheckView, page: &mut Page) {
    page.title(&format!("Joint check, {} of {} points", check.measured, check.of));
    if let Some(problem) = &check.problem {
        page.marked(("NO RESULT: ", Role::Warn), problem, Role::Warn);
        page.paragraph("X measures the check again.", Role::Plain);
        return;
    }
    let Some(verdict) = &check.verdict else {
        page.paragraph("It is not complete; x continues it.", Role::Plain);
        return;
    };
    if verdict.faults.is_empty() {
        page.paragraph("All joints are as the profile says: sign, zero, unit and coupling.", Role::Ok);
    }
    for fault in &verdict.faults {
        page.marked(("- ", Role::Warn), fault, Role::Warn);
    }
    page.line(vec![(format!("{:<6}{:>9}{:>16}{:>16}", "joint", "moved by", "seen", "zero off by"), Role::Dim)]);
    for joint in &verdict.joints {
        page.line(row(joint));
    }
    let [x, y, z] = verdict.smr_mm.map(|value| fixed(value, 1));
    let [sx, sy, sz] = verdict.smr_sigma_mm.map(|value| fixed(value, 1));
    page.pair("SMR", &format!("about ({x}, {y}, {z}) mm in the flange, ±({sx}, {sy}, {sz})"));
    page.pair("fit", &format!("{} mm rms", fixed(verdict.rms_mm, 3)));
    page.paragraph("- : this check cannot show it. X measures the check again.", Role::Dim);
}
