//! Targets for poses that were measured with their orientation: the corners of a rigid body that stand for each of them.

use std::collections::BTreeMap;

use nalgebra::{Isometry3, Point3, Vector3};
use thiserror::Error;

use crate::identification::rigid::{CORNERS, Tetrahedron, mounting};
use crate::kinematics::ForwardKinematics;
use crate::profile::{FREE_TARGET_UNCERTAINTY, Profile, ProfileErrors, Target, with_targets};
use crate::session::measurements::Row;
use crate::text::counted;

/// A profile whose targets are the corners of the measured bodies.
#[derive(Clone, Debug)]
pub struct WithBodies {
    pub profile: Profile,
    /// Its text.
    pub text: String,
    /// The targets that became bodies.
    pub bodies: Vec<String>,
}

/// Why the corners of a body cannot be placed on the flange.
#[derive(Debug, Error)]
pub enum BodyError {
    #[error("the orientation of '{body}' on the flange does not show in {}: the flange turned about one axis at most", counted(*poses, "pose"))]
    OneAxis { body: String, poses: usize },
    #[error("the targets cannot be written into the profile")]
    Text,
    #[error("the profile with the corners of the bodies has errors\n\n{0}")]
    Profile(#[from] ProfileErrors),
}

/// Adds the corners `probe.a` to `probe.d` to a robot that has `probe` alone, where rows were measured with their orientation. Where
/// the body is mounted is found from the nominal arm, so that only the identification has to make it exact. None if there is nothing
/// to add.
///
/// # Errors
/// The rows do not show how a body is mounted.
pub fn with_bodies(profile: &Profile, text: &str, rows: &[&Row]) -> Result<Option<WithBodies>, BodyError> {
    let has = |name: &str| profile.targets().iter().any(|target| target.name == name);
    let mut targets = Vec::with_capacity(profile.targets().len() + CORNERS.len());
    let mut bodies = Vec::new();
    for target in profile.targets() {
        let names = CORNERS.map(|(letter, _)| format!("{}.{letter}", target.name));
        let measured = measured(rows, &names);
        if measured.is_empty() || names.iter().any(|name| has(name)) {
            targets.push(target.clone());
            continue;
        }
        let Some((body, flange_from_body)) = mounted(profile, &measured) else {
            return Err(BodyError::OneAxis { body: target.name.clone(), poses: measured.len() });
        };
        let corners = names.into_iter().zip(body.points(&flange_from_body));
        targets.extend(corners.map(|(name, position_in_flange)| Target {
            name,
            position_in_flange,
            uncertainty: target.uncertainty.max(FREE_TARGET_UNCERTAINTY),
            ..target.clone()
        }));
        bodies.push(target.name.clone());
    }
    if bodies.is_empty() {
        return Ok(None);
    }
    let text = with_targets(text, &targets).ok_or(BodyError::Text)?;
    let (profile, _) = Profile::parse(&text, profile.name())?;
    Ok(Some(WithBodies { profile, text, bodies }))
}

/// A configuration with the corners of a body that were measured there.
struct Measured<'a> {
    configuration: &'a [f64],
    /// Sum of the readings of each corner, and how many there are.
    corners: [(Vector3<f64>, f64); 4],
}

/// The poses at which all corners of a body were measured.
fn measured<'a>(rows: &[&'a Row], names: &[String; 4]) -> Vec<Measured<'a>> {
    let mut poses: BTreeMap<&str, Measured<'a>> = BTreeMap::new();
    for row in rows {
        let corner = names.iter().position(|name| row.target.as_ref() == Some(name));
        let Some(corner) = corner else { continue };
        let pose = poses
            .entry(&row.pose)
            .or_insert_with(|| Measured { configuration: &row.configuration, corners: [(Vector3::zeros(), 0.0); 4] });
        let (sum, count) = &mut pose.corners[corner];
        *sum += row.point.coords;
        *count += 1.0;
    }
    poses.into_values().filter(|pose| pose.corners.iter().all(|(_, count)| *count > 0.0)).collect()
}

/// The body, and where the nominal arm says that it is on the flange.
fn mounted(profile: &Profile, measured: &[Measured<'_>]) -> Option<(Tetrahedron, Isometry3<f64>)> {
    let points: Vec<[Point3<f64>; 4]> =
        measured.iter().map(|pose| pose.corners.map(|(sum, count)| Point3::from(sum / count))).collect();
    let radii: Vec<f64> = points.iter().filter_map(Tetrahedron::of_points).map(|body| body.radius).collect();
    let body = Tetrahedron { radius: radii.iter().sum::<f64>() / radii.len().max(1) as f64 };
    let forward = ForwardKinematics::new(profile.chain());
    let pairs: Vec<_> = measured
        .iter()
        .zip(&points)
        .filter_map(|(pose, points)| Some((forward.base_from_flange(pose.configuration), body.pose(points)?)))
        .collect();
    Some((body, mounting(&pairs)?))
}
