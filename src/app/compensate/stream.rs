//! `trupose compensate --stream`: a filter for bridges and gateways. Each line on the standard input is a target as JSON, and each is
//! answered by one line on the standard output. What cannot be answered is answered with an error: nothing ends the stream but its end.

use std::io::{BufRead as _, Write};

use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::super::Console;
use crate::compensation::{Goal, PoseGoal};
use crate::correction::report::Moved;
use crate::correction::{Corrector, reason, status_reason};
use crate::error::{ExitStatus, Failure};
use crate::units::{from_deg, from_mm, to_mm};

/// A quaternion whose length is farther from 1 is no rotation.
const QUATERNION_TOLERANCE: f64 = 1e-3;

/// A target.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Request {
    /// Comes back with the answer.
    #[serde(default)]
    id: Value,
    /// Joint values (deg, sliding joints mm).
    joints: Option<Vec<f64>>,
    /// The tool in the frame.
    pose: Option<Pose>,
    /// The tool in the flange; without it the flange.
    tool: Option<Pose>,
    /// The frame in the base of the robot; without it the base.
    frame: Option<Pose>,
    /// Joint values (deg, sliding joints mm) near which the arm reaches the pose.
    near: Option<Vec<f64>>,
}

/// A pose; exactly one of the orientations is stated.
#[derive(Clone, Copy, Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
struct Pose {
    xyz_mm: [f64; 3],
    #[serde(skip_serializing_if = "Option::is_none")]
    quaternion_xyzw: Option<[f64; 4]>,
    /// About the fixed axes x, y and z.
    #[serde(skip_serializing_if = "Option::is_none")]
    rpy_deg: Option<[f64; 3]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    rotation_vector_rad: Option<[f64; 3]>,
}

/// The answer to a target.
#[derive(Debug, Default, Serialize)]
struct Answer {
    id: Value,
    /// `reached`, `position_only`, the reason in a word, or `error`.
    status: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    joints: Option<Vec<f64>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pose: Option<Pose>,
    #[serde(flatten)]
    moved: Option<Moved>,
    #[serde(skip_serializing_if = "Option::is_none")]
    uncertainty_mm: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    error: Option<String>,
}

impl Pose {
    fn isometry(&self) -> Result<Isometry3<f64>, String> {
        let rotation = match (self.quaternion_xyzw, self.rpy_deg, self.rotation_vector_rad) {
            (Some([x, y, z, w]), None, None) => {
                let quaternion = Quaternion::new(w, x, y, z);
                let is_unit = (quaternion.norm() - 1.0).abs() <= QUATERNION_TOLERANCE;
                if !is_unit {
                    return Err(format!("a quaternion has length {:.4} instead of 1", quaternion.norm()));
                }
                UnitQuaternion::from_quaternion(quaternion)
            }
            (None, Some(angles), None) => {
                let [roll, pitch, yaw] = angles.map(from_deg);
                UnitQuaternion::from_euler_angles(roll, pitch, yaw)
            }
            (None, None, Some(vector)) => UnitQuaternion::from_scaled_axis(Vector3::from(vector)),
            _ => {
                return Err(
                    "a pose needs 'xyz_mm' and one of 'quaternion_xyzw', 'rpy_deg', 'rotation_vector_rad'".to_owned()
                );
            }
        };
        let translation = Translation3::from(Vector3::from(self.xyz_mm.map(from_mm)));
        let pose = Isometry3::from_parts(translation, rotation);
        let is_finite =
            pose.translation.vector.iter().chain(pose.rotation.coords.iter()).all(|value| value.is_finite());
        if is_finite { Ok(pose) } else { Err("a pose has a number that is not finite".to_owned()) }
    }

    fn new(pose: &Isometry3<f64>) -> Self {
        let position = pose.translation.vector.map(to_mm);
        let turn = pose.rotation.coords;
        Self {
            xyz_mm: [position.x, position.y, position.z],
            quaternion_xyzw: Some([turn.x, turn.y, turn.z, turn.w]),
            rpy_deg: None,
            rotation_vector_rad: None,
        }
    }
}

pub(super) fn run<O: Write, E: Write>(job: &Corrector<'_>, console: &mut Console<O, E>) -> Result<ExitStatus, Failure> {
    let unreadable =
        |error: std::io::Error| Failure::new(ExitStatus::Store, format!("cannot read the standard input: {error}"));
    let mut input = std::io::stdin().lock();
    let mut line = Vec::new();
    loop {
        line.clear();
        if input.read_until(b'\n', &mut line).map_err(unreadable)? == 0 {
            return Ok(ExitStatus::Accepted);
        }
        if line.iter().all(u8::is_ascii_whitespace) {
            continue;
        }
        let answer = answered(job, &line);
        let text = serde_json::to_string(&answer).map_err(|error| Failure::from_error(ExitStatus::Internal, &error))?;
        console.print(&(text + "\n"))?;
    }
}

fn answered(job: &Corrector<'_>, line: &[u8]) -> Answer {
    let request: Request = match serde_json::from_slice(line) {
        Ok(request) => request,
        Err(error) => {
            let id = serde_json::from_slice::<Value>(line).ok().and_then(|value| value.get("id").cloned());
            return refused(id.unwrap_or_default(), error.to_string());
        }
    };
    let id = request.id.clone();
    let answer = match &request {
        Request { joints: Some(joints), pose: None, tool: None, frame: None, near: None, .. } => of_joints(job, joints),
        Request { joints: None, pose: Some(pose), .. } => of_pose(job, &request, pose),
        _ => Err("a target has either 'joints', or 'pose' with 'tool', 'frame' and 'near'".to_owned()),
    };
    match answer {
        Ok(answer) => Answer { id, ..answer },
        Err(error) => refused(id, error),
    }
}

fn refused(id: Value, error: String) -> Answer {
    Answer { id, status: "error", error: Some(error), ..Answer::default() }
}

/// Joint values of the edge (deg, mm) as those of the inside.
fn inside(job: &Corrector<'_>, values: &[f64]) -> Result<Vec<f64>, String> {
    let joints = job.joints();
    if values.len() != joints.len() || !values.iter().all(|value| value.is_finite()) {
        return Err(format!("the arm has {} joints; {} finite values are given", joints.len(), values.len()));
    }
    Ok(values.iter().zip(joints).map(|(value, joint)| joint.joint_type.quantity().from_edge(*value)).collect())
}

fn at_edge(job: &Corrector<'_>, q: &[f64]) -> Vec<f64> {
    q.iter().zip(job.joints()).map(|(value, joint)| joint.joint_type.quantity().to_edge(*value)).collect()
}

fn of_joints(job: &Corrector<'_>, joints: &[f64]) -> Result<Answer, String> {
    let done = job.compensator.solve(&Goal::Configuration(inside(job, joints)?));
    let status = done.status.name();
    if !done.status.is_usable() {
        return Ok(Answer { status, error: Some(reason(&done, job.joints())), ..Answer::default() });
    }
    let uncertainty = job.uncertainty(&done.command, &job.tools[1]);
    if let Some(error) = job.too_uncertain(uncertainty) {
        return Ok(Answer { status: "uncertain", error: Some(error), ..Answer::default() });
    }
    let nominal = job.compensator.inverse().forward();
    let tool = |q: &[f64]| nominal.base_from_flange(q) * job.tools[0];
    let moved = done.meant.as_ref().map(|meant| Moved::between(&tool(meant), &tool(&done.command)));
    Ok(Answer {
        status,
        joints: Some(at_edge(job, &done.command)),
        moved,
        uncertainty_mm: uncertainty.map(to_mm),
        ..Answer::default()
    })
}

fn of_pose(job: &Corrector<'_>, request: &Request, pose: &Pose) -> Result<Answer, String> {
    let known = |pose: &Option<Pose>| pose.as_ref().map_or_else(|| Ok(Isometry3::identity()), Pose::isometry);
    let (tool, frame) = (known(&request.tool)?, known(&request.frame)?);
    let near = request.near.as_ref().map(|near| inside(job, near)).transpose()?;
    let goal = PoseGoal {
        base_from_tool: frame * pose.isometry()?,
        flange_from_tool: tool,
        is_meant: &|_, _| true,
        near: near.as_deref(),
    };
    let done = match job.compensator.solve_pose(&goal) {
        Ok(done) => done,
        Err(status) => {
            let error = status_reason(&status, job.joints());
            let error = if near.is_none() { format!("{error}; state 'near'") } else { error };
            return Ok(Answer { status: status.name(), error: Some(error), ..Answer::default() });
        }
    };
    let uncertainty = job.uncertainty(&done.command, &tool);
    if let Some(error) = job.too_uncertain(uncertainty) {
        return Ok(Answer { status: "uncertain", error: Some(error), ..Answer::default() });
    }
    Ok(Answer {
        status: "reached",
        joints: Some(at_edge(job, &done.command)),
        pose: Some(Pose::new(&(frame.inverse() * done.base_from_tool))),
        moved: Some(Moved::between(&goal.base_from_tool, &done.base_from_tool)),
        uncertainty_mm: uncertainty.map(to_mm),
        ..Answer::default()
    })
}
