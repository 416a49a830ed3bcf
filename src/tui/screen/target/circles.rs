//! The circle-point analysis: the configuration to go to, and the result.

use crate::text::fixed;
use crate::tui::screen::page::Page;
use crate::tui::theme::Role;
use crate::wizard::view::{ArmView, CirclesView};

/// The next point to measure.
pub(super) fn to_measure(circles: &CirclesView, page: &mut Page) {
    let joint = circles.joint.as_deref().unwrap_or("?");
    page.line(vec![(format!("circle of {joint}: point {} of {}", circles.measured + 1, circles.of), Role::Title)]);
    page.paragraph(
        &format!("Go to this configuration, then measure. Only {joint} turns along its circle."),
        Role::Plain,
    );
    page.gap();
    for shown in &circles.joints {
        let (role, remark) = if shown.moves_most { (Role::Title, "  <- turns") } else { (Role::Plain, "") };
        let value = format!("{:<6}{:>11} {:<3}", shown.name, fixed(shown.value, 3), shown.unit);
        page.line(vec![(value, role), (remark.to_owned(), Role::Hint)]);
    }
    page.gap();
    page.paragraph("Points measured so far are kept when you go back.", Role::Dim);
}

/// The result of the circles.
pub(super) fn result(circles: &CirclesView, page: &mut Page) {
    page.title(&format!("Circles, {} points", circles.measured));
    if let Some(problem) = &circles.problem {
        page.marked(("NO RESULT: ", Role::Warn), problem, Role::Warn);
        page.paragraph("d restarts the circles.", Role::Plain);
        return;
    }
    if let Some(arm) = &circles.arm {
        return whole_arm(arm, page);
    }
    if circles.fits.is_empty() {
        page.paragraph("They are not complete; c continues them.", Role::Plain);
        return;
    }
    let head =
        format!("{:<6}{:>5}{:>31}{:>9}{:>8}{:>6}", "joint", "points", "centre, tracker frame", "radius", "off", "arc");
    page.line(vec![(head, Role::Dim)]);
    for fit in &circles.fits {
        let [x, y, z] = fit.centre_mm.map(|value| format!("{:>10}", fixed(value, 2)));
        let line = format!(
            "{:<6}{:>5} {x}{y}{z}{:>9}{:>8}{:>6}",
            fit.joint,
            fit.points,
            fixed(fit.radius_mm, 2),
            fixed(fit.residual_rms_mm, 4),
            fixed(fit.arc_deg, 0)
        );
        page.line(vec![(line, Role::Plain)]);
    }
    page.paragraph("lengths in mm, arc in degrees; off: RMS distance of the points from their circle", Role::Dim);
    if let Some(result) = &circles.result {
        let [x, y, z] = result.xyz_mm.map(|value| fixed(value, 3));
        let [sx, sy, sz] = result.sigma_mm.map(|value| fixed(value, 4));
        page.pair("SMR", &format!("({x}, {y}, {z}) mm in the flange"));
        page.pair("sigma", &format!("({sx}, {sy}, {sz}) mm"));
        page.pair("off", &format!("{} mm RMS over both circles", fixed(result.residual_rms_mm, 4)));
        page.paragraph("u uses this result, d restarts the circles.", Role::Hint);
    }
}

/// The constants of the whole arm beside those of the profile.
fn whole_arm(arm: &ArmView, page: &mut Page) {
    let head =
        format!("{:<8}{:>12}{:>9}{:>5}{:>12}{:>11}", "constant", "measured", "sigma", "", "profile", "difference");
    page.line(vec![(head, Role::Dim)]);
    for row in &arm.constants {
        let value = format!("{:<8}{:>12}{:>9} {:<4}", row.name, fixed(row.measured, 3), fixed(row.sigma, 3), row.unit);
        let compared = match (row.nominal, row.difference) {
            (Some(nominal), Some(difference)) => format!("{:>12}{:>11}", fixed(nominal, 3), fixed(difference, 3)),
            _ => String::new(),
        };
        let (role, mark) = if row.is_astonishing { (Role::Warn, " !") } else { (Role::Plain, "") };
        page.line(vec![(value, Role::Plain), (compared, role), (mark.to_owned(), Role::Warn)]);
    }
    let [x, y, z] = arm.smr_mm.map(|value| fixed(value, 3));
    page.pair("SMR", &format!("({x}, {y}, {z}) mm in the flange"));
    let [x, y, z] = arm.tracker_mm.map(|value| fixed(value, 0));
    page.pair("tracker", &format!("({x}, {y}, {z}) mm in the base"));
    page.pair("off", &format!("{} mm at most", fixed(arm.worst_mm, 3)));
    page.paragraph("!: more than an assembly error: another arm, a wrong dimension, or other joint values.", Role::Dim);
    page.paragraph("s saves it as a profile for a new session, u uses the SMR here, d restarts.", Role::Hint);
}
