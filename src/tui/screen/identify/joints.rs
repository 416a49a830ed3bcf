//! The page of the errors of the joints: what explains the error, the models that were tried, and the curve of each joint.

use crate::session::joint_errors::{CurveMarks, curve_drawn, curve_scale, shares_sentence};
use crate::session::summary::{IdentificationSummary, JointErrorSummary, SelectionSummary};
use crate::text::fixed;
use crate::tui::glyphs::Glyphs;
use crate::tui::screen::page::Page;
use crate::tui::theme::Role;

/// Columns beside a curve: name, ends of the range, blanks.
const BESIDE: usize = 22;
/// Most columns of a curve.
const MOST: usize = 100;

pub(super) fn joints(summary: &IdentificationSummary, glyphs: Glyphs, page: &mut Page) {
    match &summary.selection {
        Some(selection) => causes(selection, page),
        None => page.paragraph("Only the geometry was identified: no errors of joints were looked for.", Role::Plain),
    }
    if !summary.joint_errors.is_empty() {
        errors(&summary.joint_errors, glyphs, page);
    }
}

fn causes(selection: &SelectionSummary, page: &mut Page) {
    page.paragraph(&shares_sentence(selection), Role::Plain);
    if selection.candidates.len() > 1 {
        page.title("Models that were tried, with their error at poses left out in turn");
        for candidate in &selection.candidates {
            let is_kept = candidate.terms == selection.kept;
            let mark = if is_kept { ("kept ", Role::Ok) } else { ("     ", Role::Dim) };
            let text = format!("{} mm  {}", fixed(candidate.left_out_rms_mm, 3), candidate.terms);
            page.marked(mark, &text, if is_kept { Role::Plain } else { Role::Dim });
        }
    }
    page.marked(("why: ", Role::Dim), &selection.reason, Role::Plain);
}

fn errors(joints: &[JointErrorSummary], glyphs: Glyphs, page: &mut Page) {
    let marks = if glyphs == Glyphs::Ascii { CurveMarks::Digits } else { CurveMarks::Blocks };
    let scale = curve_scale(joints);
    page.title("Angle error of each joint over its range");
    let columns = page.columns().saturating_sub(BESIDE).clamp(8, MOST);
    for joint in joints {
        if let (Some((first, ..)), Some((last, ..))) = (joint.curve.first(), joint.curve.last()) {
            let drawn = curve_drawn(joint, columns, scale, marks);
            page.line(vec![
                (format!("{:<6}{first:>5.0} ", joint.joint), Role::Dim),
                (drawn, Role::Hint),
                (format!(" {last:.0} deg"), Role::Dim),
            ]);
        }
    }
    page.paragraph(&marks.legend(scale), Role::Dim);
    page.gap();
    let head = format!("{:<6}{:<20}{:>7}{:>7}  {}", "joint", "measured", "rms", "sigma", "gives way under gravity");
    page.line(vec![(head, Role::Dim)]);
    for joint in joints {
        let (from, to) = joint.measured_deg;
        let sigma = joint.sigma_urad().map_or_else(|| "-".to_owned(), |sigma| fixed(sigma, 0));
        let line = format!(
            "{:<6}{:<20}{:>7}{sigma:>7}  {}",
            joint.joint,
            format!("{from:>5.0} ..{to:>5.0} deg"),
            fixed(joint.curve_rms_urad, 0),
            joint.gravity_words().unwrap_or_else(|| "-".to_owned())
        );
        page.line(vec![(line, Role::Plain)]);
    }
    page.paragraph("rms and sigma of the curve in urad, where the joint was measured.", Role::Dim);
}
