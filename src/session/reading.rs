//! Requests to an instrument at a pose, and its readings.

use nalgebra::Point3;

/// Request for a measurement. The operator has moved the robot to the configuration shown.
#[derive(Clone, Debug, PartialEq)]
pub struct MeasureRequest {
    /// Number of the measurement in the session, from 1, repeated and refused ones included; continues after a resume.
    pub number: u64,
    pub pose: String,
    /// Index of the target.
    pub target: usize,
    /// Pendant joint values shown to the operator (rad, sliding joints m).
    pub configuration: Vec<f64>,
    /// Configuration of the next pose, if there is one.
    pub following: Option<Vec<f64>>,
    /// Wait before the first shot (s).
    pub settle: f64,
    /// Readings to average.
    pub shots: u32,
}

/// Reading of an instrument: the mean of its shots.
#[derive(Clone, Debug, PartialEq)]
pub struct Reading {
    /// Centre of the SMR in the tracker frame (m).
    pub point: Point3<f64>,
    /// Standard deviation of a coordinate (m), if the instrument states it.
    pub sigma: Option<f64>,
    /// Root mean square distance of the shots from their mean (m); `None` for a single shot or a typed value.
    pub scatter: Option<f64>,
    pub shots: u32,
    /// Temperature (°C).
    pub temperature: Option<f64>,
    /// Pressure of the air (hPa).
    pub pressure: Option<f64>,
    /// Relative humidity of the air (%).
    pub humidity: Option<f64>,
    /// Pendant joint values that the robot itself reported (rad, sliding joints m).
    pub configuration: Option<Vec<f64>>,
    /// Scatter of these values, if the robot reported them several times.
    pub joint_scatter: Option<JointScatter>,
    /// Remarks of the instrument and the robot on this reading.
    pub remarks: Vec<Remark>,
    /// Duration (s), motion and settling included.
    pub seconds: f64,
}

/// Scatter of the joint values that a robot at rest reported.
#[derive(Clone, Debug, PartialEq)]
pub struct JointScatter {
    /// Standard deviation of a single value of each joint (rad, sliding joints m).
    pub sigma: Vec<f64>,
    /// Number of values that were averaged.
    pub count: u32,
}

/// Remark of the instrument or the robot on a reading.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Remark {
    pub text: String,
    /// Whether the operator has to see it; other remarks are only kept.
    pub is_warning: bool,
}

/// Live reading of a link.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LiveReading {
    /// Time by the link's own clock (s); only differences matter.
    pub seconds: f64,
    /// The reflector in the frame of the instrument (m), if it is seen. Never a measurement.
    pub point: Option<Point3<f64>>,
    /// Whether the instrument shows nothing between shots, whatever it sees.
    pub is_blind: bool,
    /// Time without any message (s) from an instrument that sends continuously.
    pub silent: Option<f64>,
    /// Joints of the robot: pendant values (rad), if it reports them.
    pub joints: Option<Vec<f64>>,
    /// Whether the robot is at rest; `None`: it does not report that.
    pub is_still: Option<bool>,
    /// Reason why the instrument cannot be used now.
    pub down: Option<String>,
}
