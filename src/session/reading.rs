//! What is asked of an instrument at a pose, and what it gives.

use nalgebra::Point3;

/// A measurement that is asked for. Whoever is at the cell has moved the robot to the configuration shown.
#[derive(Clone, Debug, PartialEq)]
pub struct MeasureRequest {
    /// Counts the measurements of a session from 1, repeated and refused ones included; goes on after a resume.
    pub number: u64,
    /// Name of the pose.
    pub pose: String,
    /// Index of the target.
    pub target: usize,
    /// Pendant joint values shown to the operator (rad, sliding joints m).
    pub configuration: Vec<f64>,
    /// Those of the pose that is shown next, if there is one.
    pub following: Option<Vec<f64>>,
    /// Wait before the first shot (s).
    pub settle: f64,
    /// Readings to average.
    pub shots: u32,
}

/// What an instrument saw: the mean of its shots.
#[derive(Clone, Debug, PartialEq)]
pub struct Reading {
    /// Centre of the SMR in the tracker frame (m).
    pub point: Point3<f64>,
    /// Standard deviation of a coordinate (m), if the instrument states it.
    pub sigma: Option<f64>,
    /// Root mean square distance of the shots from their mean (m); `None` for a single shot or a typed value.
    pub scatter: Option<f64>,
    /// Number of shots.
    pub shots: u32,
    /// Temperature (°C).
    pub temperature: Option<f64>,
    /// Pendant joint values that the robot itself reported (rad, sliding joints m).
    pub configuration: Option<Vec<f64>>,
    /// Time that it took, motion and settling included (s).
    pub seconds: f64,
}

/// What a link sees now.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LiveReading {
    /// Time by the link's own clock (s); only differences matter.
    pub seconds: f64,
    /// The reflector in the frame of the instrument (m), if it is seen. Never a measurement.
    pub point: Option<Point3<f64>>,
    /// The instrument shows nothing between shots, whatever it sees.
    pub is_blind: bool,
    /// Nothing has been heard from the instrument for so long (s), where something is due all the time.
    pub silent: Option<f64>,
    /// Joints of the robot: pendant values (rad), if it tells them.
    pub joints: Option<Vec<f64>>,
    /// Whether the robot rests; `None`: it does not tell.
    pub is_still: Option<bool>,
    /// Why the instrument cannot be asked now.
    pub down: Option<String>,
}
