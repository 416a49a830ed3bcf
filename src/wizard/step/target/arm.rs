//! The whole arm from circles: every joint is turned in turn, and the result becomes a profile.

use nalgebra::Point3;

use crate::identification::circle_point::{MeasuredArm, Template, measure_arm};
use crate::procedure::measured_arm::{constants, profile_text};
use crate::session::journal::from_edge;
use crate::session::state::Session;
use crate::text::counted;
use crate::units::to_mm;
use crate::wizard::notice::Notice;
use crate::wizard::view::{ArmView, ConstantView};

/// Name of the profile in the session's folder.
pub(super) const ARM_FILE: &str = "measured-arm.ron";

/// Measures the arm from all circles of the session.
///
/// # Errors
/// Why there is no result, in words.
pub(super) fn measured(session: &Session) -> Result<Box<MeasuredArm>, String> {
    let robot = session.robot.as_ref().ok_or("there is no robot")?;
    let (rows, points): (Vec<Vec<f64>>, Vec<Point3<f64>>) = session
        .circle_points
        .iter()
        .map(|point| (from_edge(&point.joints, &robot.joint_types), session.point_of_circle(point)))
        .unzip();
    let profile = &robot.profile;
    let template = Template {
        chain: profile.chain().without_errors(),
        beta_joints: profile.beta_joints().to_vec(),
        is_nominal: true,
    };
    let distance = profile.tracker().position_in_base.coords.norm();
    let sigma = profile.instrument().map(|instrument| instrument.sigma_at(distance));
    measure_arm(&template, &rows, &points, sigma).map(Box::new).map_err(|error| error.to_string())
}

/// The profile of the measured arm; its name says that it is measured.
pub(super) fn file(session: &Session, arm: &MeasuredArm) -> Option<(String, String)> {
    let profile = &session.robot.as_ref()?.profile;
    let name = format!("{}_measured", profile.name());
    let origin = counted(session.circle_points.len(), "point");
    Some((ARM_FILE.to_owned(), profile_text(profile, arm, Some(&name), &origin)))
}

/// What is said when the last point is measured.
pub(super) fn verdict(arm: &MeasuredArm) -> Notice {
    let astonishing: Vec<String> =
        constants(arm).into_iter().filter(|row| row.is_astonishing).map(|row| row.name).collect();
    let worst = to_mm(arm.residuals.iter().copied().fold(0.0, f64::max));
    let fits = format!("the measured arm puts every point within {worst:.3} mm of where it was seen");
    if astonishing.is_empty() {
        return Notice::info(fits).hint("compare the constants with the data sheet, then save the profile");
    }
    Notice::attention(format!(
        "{fits}, but these constants differ from the profile by more than an assembly error: {}",
        astonishing.join(", ")
    ))
    .hint("another arm, a wrong dimension in the profile, or joint values that are not the pendant's")
}

/// The result for a screen.
pub(super) fn view(arm: &MeasuredArm) -> ArmView {
    ArmView {
        constants: constants(arm)
            .into_iter()
            .map(|row| ConstantView {
                difference: row.difference(),
                name: row.name,
                unit: row.unit.to_owned(),
                measured: row.measured,
                sigma: row.sigma,
                nominal: row.nominal,
                is_astonishing: row.is_astonishing,
            })
            .collect(),
        smr_mm: arm.point_in_flange.coords.map(to_mm).into(),
        tracker_mm: (arm.base_from_tracker * Point3::origin()).coords.map(to_mm).into(),
        worst_mm: to_mm(arm.residuals.iter().copied().fold(0.0, f64::max)),
    }
}
