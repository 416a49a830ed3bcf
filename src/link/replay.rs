//! Replays the measurements of a table as if they were captured now.
//!
//! A reading is found by the name of its pose or, if the table does not contain the name, by configuration. If a pose has
//! several rows, the choice depends only on the number of the measurement, so that a resumed session gets the same values: it
//! is the last row of the pose up to this number (row 1 is measurement 1), or else its first row. Requests in the order of the
//! table therefore replay it in order, drift poses included, and a repeated measurement takes the next row of its pose.

use super::{Link, LinkError};
use crate::kinematics::JointType;
use crate::profile::Profile;
use crate::session::measurements::{Expected, Layout, Measurements, Reading as TableReading, Row, read_for};
use crate::session::reading::{MeasureRequest, Reading};
use crate::text::printable;
use crate::units::{DEGREE, MICROMETRE};

/// Largest difference of a joint angle at the same pose (rad).
const SAME_ANGLE: f64 = 1e-3 * DEGREE;
/// Largest difference of a sliding joint at the same pose (m).
const SAME_LENGTH: f64 = MICROMETRE;

/// Reported duration of a measurement (s).
const SECONDS: f64 = 5.0;

/// A table that takes the place of the instrument.
#[derive(Clone, Debug)]
pub struct Replay {
    file: String,
    joints: Vec<JointType>,
    rows: Vec<ReplayRow>,
    readings: Vec<Row>,
}

/// A measurement in the table, without its reading.
#[derive(Clone, Debug, PartialEq)]
pub struct ReplayRow {
    pub pose: String,
    pub target: usize,
    /// Pendant joint values (rad, sliding joints m).
    pub configuration: Vec<f64>,
    /// Whether an earlier row has the same pose and target.
    pub repeats: bool,
}

impl Replay {
    /// Reads the bytes of a table for the robot of `profile`. Duplicate rows are skipped; `file` is the name for messages.
    ///
    /// # Errors
    /// [`LinkError::SetUp`] with all defects of the table, or as in [`Self::of_table`].
    pub fn new(profile: &Profile, bytes: &[u8], file: &str, layout: Layout) -> Result<Self, LinkError> {
        let joints: Vec<JointType> = profile.chain().joints().iter().map(|joint| joint.joint_type).collect();
        let expected = Expected::of(profile, &joints);
        let table = read_for(&expected, layout, &TableReading::default(), bytes, file)
            .map_err(|errors| LinkError::SetUp(errors.to_string()))?;
        Self::of_table(profile, &table, file)
    }

    /// Replays a table that was read before. A row without a target belongs to the first one.
    ///
    /// # Errors
    /// [`LinkError::SetUp`]: a target that the profile does not have.
    pub fn of_table(profile: &Profile, table: &Measurements, file: &str) -> Result<Self, LinkError> {
        let file = printable(file);
        let mut rows: Vec<ReplayRow> = Vec::new();
        let mut readings = Vec::new();
        for row in table.distinct_rows() {
            let index_of = |name: &str| profile.targets().iter().position(|target| target.name == name);
            let Some(target) = row.target.as_deref().map_or(Some(0), index_of) else {
                let name = row.target.as_deref().unwrap_or_default();
                let known: Vec<&str> = profile.targets().iter().map(|target| target.name.as_str()).collect();
                return Err(LinkError::SetUp(format!(
                    "'{file}', line {}: the profile has no target '{name}'; it has {}",
                    row.line,
                    known.join(", ")
                )));
            };
            let repeats = rows.iter().any(|earlier| earlier.pose == row.pose && earlier.target == target);
            let (pose, configuration) = (row.pose.clone(), row.configuration.clone());
            rows.push(ReplayRow { pose, target, configuration, repeats });
            readings.push(row.clone());
        }
        let joints = profile.chain().joints().iter().map(|joint| joint.joint_type).collect();
        Ok(Self { file, joints, rows, readings })
    }

    /// All rows in the order of the table; those that do not repeat others form a plan.
    pub fn rows(&self) -> &[ReplayRow] {
        &self.rows
    }

    /// Whether two configurations are the same pose.
    fn is_same(&self, a: &[f64], b: &[f64]) -> bool {
        let tolerance = |joint: &JointType| match joint {
            JointType::Revolute => SAME_ANGLE,
            JointType::Prismatic => SAME_LENGTH,
        };
        a.len() == b.len() && a.iter().zip(b).zip(&self.joints).all(|((a, b), joint)| (a - b).abs() <= tolerance(joint))
    }

    /// The reading for a request.
    fn find(&self, request: &MeasureRequest) -> Option<&Row> {
        let is_known = self.rows.iter().any(|row| row.pose == request.pose);
        let matches = |row: &ReplayRow| {
            row.target == request.target
                && if is_known {
                    row.pose == request.pose
                } else {
                    self.is_same(&row.configuration, &request.configuration)
                }
        };
        let rows = self.rows.iter().zip(&self.readings).enumerate();
        let mut candidates = rows.filter(|(_, (row, _))| matches(row)).map(|(index, (_, reading))| (index, reading));
        let first = candidates.next()?;
        let reached = candidates.take_while(|(index, _)| (*index as u64) < request.number).last();
        Some(reached.unwrap_or(first).1)
    }
}

impl Link for Replay {
    fn connect(&mut self) -> Result<String, LinkError> {
        Ok(format!("measurements of '{}', {} rows", self.file, self.rows.len()))
    }

    /// Returns the joint values of the row as those reported by the robot.
    fn measure(&mut self, request: &MeasureRequest, keep_going: &dyn Fn() -> bool) -> Result<Reading, LinkError> {
        if !keep_going() {
            return Err(LinkError::Cancelled);
        }
        let row = self
            .find(request)
            .ok_or_else(|| LinkError::NoReading { file: self.file.clone(), pose: request.pose.clone() })?;
        Ok(Reading {
            point: row.point,
            sigma: row.sigma,
            scatter: None,
            shots: 1,
            temperature: row.temperature,
            pressure: None,
            humidity: None,
            configuration: Some(row.configuration.clone()),
            joint_scatter: None,
            remarks: Vec::new(),
            seconds: SECONDS,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::profile::builtin;
    use crate::units::{from_deg, to_mm};

    const TABLE: &str = "pose,q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg,x_mm,y_mm,z_mm,sigma_mm,temperature_degc
a,0,0,0,0,10,0,1000,0,0,0.01,20.5
b,10,0,0,0,10,0,1000,50,0,,
c,20,0,0,0,10,0,1000,100,0,,
a,0,0,0,0,10,0,1000.02,0,0,0.02,21.5
";

    fn replay() -> Replay {
        let (profile, _) = Profile::parse(builtin("soochow").unwrap(), "soochow").unwrap();
        Replay::new(&profile, TABLE.as_bytes(), "table.csv", Layout::Named).unwrap()
    }

    fn request(number: u64, pose: &str, q1_deg: f64) -> MeasureRequest {
        let configuration = vec![from_deg(q1_deg), 0.0, 0.0, 0.0, from_deg(10.0), 0.0];
        MeasureRequest { number, pose: pose.into(), target: 0, configuration, following: None, settle: 2.0, shots: 1 }
    }

    #[test]
    fn rows_are_played_in_the_order_of_the_table() {
        let mut replay = replay();
        assert!(replay.connect().unwrap().contains("table.csv"));
        let plan: Vec<(String, bool)> = replay.rows().iter().map(|row| (row.pose.clone(), row.repeats)).collect();
        assert_eq!(plan, [("a", false), ("b", false), ("c", false), ("a", true)].map(|(a, b)| (a.to_owned(), b)));
        let x = |reading: Reading| format!("{:.2}", to_mm(reading.point.x));
        assert_eq!(x(replay.measure(&request(1, "a", 0.0), &|| true).unwrap()), "1000.00");
        assert_eq!(x(replay.measure(&request(3, "a", 0.0), &|| true).unwrap()), "1000.00");
        let last = replay.measure(&request(4, "a", 0.0), &|| true).unwrap();
        assert_eq!((last.sigma, last.temperature, last.seconds), (Some(2e-5), Some(21.5), 5.0));
        assert_eq!(x(last), "1000.02");
    }

    #[test]
    fn a_pose_with_another_name_is_found_by_its_configuration() {
        let mut replay = replay();
        let found = replay.measure(&request(9, "id-07", 10.000_9), &|| true).unwrap();
        assert!((found.point.y - 0.05).abs() < 1e-12);
        assert_eq!(found.configuration, Some(request(9, "b", 10.0).configuration));
        let error = replay.measure(&request(9, "id-08", 10.002), &|| true).unwrap_err();
        assert_eq!(error, LinkError::NoReading { file: "table.csv".into(), pose: "id-08".into() });
        let other = MeasureRequest { target: 1, ..request(1, "a", 0.0) };
        assert!(matches!(replay.measure(&other, &|| true), Err(LinkError::NoReading { .. })));
        assert_eq!(replay.measure(&request(1, "a", 0.0), &|| false), Err(LinkError::Cancelled));
    }

    #[test]
    fn defects_of_the_table_are_all_reported() {
        let (profile, _) = Profile::parse(builtin("soochow").unwrap(), "soochow").unwrap();
        let text = TABLE.replace("1000,50,0", "1000,fifty,0");
        let errors = Replay::new(&profile, text.as_bytes(), "table.csv", Layout::Named).unwrap_err();
        assert!(errors.to_string().contains("fifty"), "{errors}");
        let text = TABLE.replace("pose,", "pose,target,").replace("\na,", "\na,smr,").replace("\nb,", "\nb,ball,");
        let error = Replay::new(&profile, text.replace("\nc,", "\nc,,").as_bytes(), "table.csv", Layout::Named);
        let message = error.unwrap_err().to_string();
        assert_eq!(message, "'table.csv', line 3: the profile has no target 'ball'; it has smr");
    }
}
