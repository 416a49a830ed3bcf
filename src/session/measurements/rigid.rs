//! Rows measured with their orientation: each becomes the four corners of a rigid body (see [`crate::identification::rigid`]).

use std::collections::BTreeMap;

use nalgebra::{Isometry3, Translation3};

use super::Row;
use super::foreign::{Expected, Reading, as_orientation};
use crate::identification::rigid::{CORNERS, Tetrahedron};
use crate::session::orientation::Orientation;
use crate::session::table::{Defect, Header, Measure, NumberColumn, Numbers, Record, TableProblem};
use crate::text::{decimals_for, fixed, listed};
use crate::units::{to_deg, to_mm};

/// Name of the column with the standard deviation of rotations.
const SIGMA: &str = "sigma_rot";
/// Columns that end like an angle and are none of an orientation.
const OTHERS: [&str; 2] = ["sigma_rot_deg", "sigma_rot_rad"];
/// The body of a table without the name of a target.
const NAMELESS: &str = "probe";

/// The columns of the orientation and its error.
#[derive(Debug)]
pub(super) struct Turned {
    orientation: Orientation,
    sigma: Option<NumberColumn>,
    reading: Reading,
    /// The target of rows that name none.
    target: String,
    /// Bodies of the robot: other readings of them must be put as points of the same size.
    known: BTreeMap<String, Tetrahedron>,
}

/// A rotation that was read, with the row that it belongs to.
#[derive(Debug)]
pub(super) struct TurnedRow {
    row: Row,
    pose: Isometry3<f64>,
    /// Standard deviations per coordinate (m) and per axis (rad).
    sigmas: (f64, f64),
}

/// What a table says about orientations.
#[derive(Debug, Default)]
pub(super) enum Orientations {
    /// Nothing.
    #[default]
    None,
    /// They are used.
    Used(Box<Turned>),
    /// They are there without an error, so that they cannot be used: the names of their columns.
    Unused(Vec<String>),
}

impl Orientations {
    /// Finds the orientation of rows. It is used where its standard deviation is stated; then whatever looks like one must be clear.
    pub(super) fn find(
        header: &mut Header,
        reading: &Reading,
        expected: &Expected<'_>,
        problems: &mut Vec<TableProblem>,
    ) -> Self {
        let is_stated = header.has_quantity(SIGMA) || reading.sigma_rotation.is_some();
        if !is_stated {
            // Beside points without any such statement these may be columns of another meaning.
            let mut doubts = Vec::new();
            let known = header.known().iter().map(|name| as_orientation(name).unwrap_or_else(|| name.clone()));
            let known: Vec<String> = known.collect();
            let mut looked_at = Header::renamed(header.line, header.names.clone(), &known, &mut doubts);
            let found = Orientation::find(&mut looked_at, &OTHERS, &mut doubts);
            let columns = found.iter().flat_map(|orientation| &orientation.columns);
            let names: Vec<String> =
                columns.filter_map(|column| header.names.get(column.index)).map(|name| format!("'{name}'")).collect();
            return if names.is_empty() || !doubts.is_empty() { Self::None } else { Self::Unused(names) };
        }
        let sigma = header.number(SIGMA, Measure::Angle, problems);
        let before = problems.len();
        match Orientation::find(header, &OTHERS, problems) {
            Some(orientation) => Self::Used(Box::new(Turned {
                orientation,
                sigma,
                reading: reading.clone(),
                target: expected.usual_target().unwrap_or(NAMELESS).to_owned(),
                known: expected.bodies.clone(),
            })),
            None if problems.len() > before => Self::None,
            None => {
                let read = crate::session::orientation::READ.to_vec();
                problems.push(Defect::NoOrientation { read }.at(header.line));
                Self::None
            }
        }
    }
}

impl Turned {
    /// The pose of a row; none, reported, if its numbers are no rotation or have no error.
    pub(super) fn read(
        &self,
        row: Row,
        record: &Record,
        numbers: &mut Numbers<'_>,
        problems: &mut Vec<TableProblem>,
    ) -> Option<TurnedRow> {
        let before = problems.len();
        let columns = self.orientation.columns.iter();
        let values: Vec<f64> = columns.filter_map(|&column| numbers.required(record, column, problems)).collect();
        let own = self.sigma.and_then(|column| numbers.deviation(record, column, problems));
        if problems.len() > before {
            return None;
        }
        let rotation = match self.orientation.rotation(&values) {
            Ok(rotation) => rotation,
            Err(defect) => {
                problems.push(defect.at(record.line));
                return None;
            }
        };
        let (position, rotation_sigma) = (row.sigma.or(self.reading.sigma), own.or(self.reading.sigma_rotation));
        let (Some(position), Some(rotation_sigma)) = (position, rotation_sigma) else {
            let lacking = if position.is_none() { "sigma_mm" } else { "sigma_rot_deg" };
            problems.push(Defect::NoSigma { lacking }.at(record.line));
            return None;
        };
        let pose = Isometry3::from_parts(Translation3::from(row.point.coords), rotation);
        Some(TurnedRow { row, pose, sigmas: (position, rotation_sigma) })
    }

    /// The corners of all rows, and what was done, in words.
    pub(super) fn corners(&self, turned: Vec<TurnedRow>) -> (Vec<Row>, Option<String>) {
        let mut ratios: Vec<f64> = turned.iter().map(|row| row.sigmas.0 / row.sigmas.1).collect();
        ratios.sort_by(f64::total_cmp);
        let body = ratios.get(ratios.len() / 2).and_then(|ratio| Tetrahedron::of_sigmas(*ratio, 1.0));
        let Some(of_errors) = body else { return (Vec::new(), None) };
        let (mut largest, mut radius): ((f64, f64), f64) = ((0.0, 0.0), of_errors.radius);
        let mut rows = Vec::with_capacity(4 * turned.len());
        for TurnedRow { row, pose, sigmas } in turned {
            largest = (largest.0.max(sigmas.0), largest.1.max(sigmas.1));
            let name = row.target.as_deref().unwrap_or(&self.target).to_owned();
            let body = self.known.get(&name).copied().unwrap_or(of_errors);
            radius = body.radius;
            let sigma = Some(body.corner_sigma(sigmas.0, sigmas.1));
            for ((letter, _), point) in CORNERS.into_iter().zip(body.points(&pose)) {
                rows.push(Row { target: Some(format!("{name}.{letter}")), point, sigma, ..row.clone() });
            }
        }
        let two_digits = |value: f64| fixed(value, decimals_for(value));
        let note = format!(
            "orientations are read as {}: each pose becomes four points of a rigid body, {:.1} mm from the measured one, whose distances carry the orientation (sigma up to {} mm and {} deg)",
            self.orientation.form_read(),
            to_mm(radius),
            two_digits(to_mm(largest.0)),
            two_digits(to_deg(largest.1))
        );
        (rows, Some(note))
    }
}

/// The remark about orientations that cannot be used.
pub(super) fn unused(columns: &[String]) -> String {
    format!(
        "the orientation in {} is not used, because its error is not stated; a column sigma_rot_deg would state it",
        listed(columns)
    )
}

#[cfg(test)]
mod tests {
    use nalgebra::{Matrix3, Quaternion, Rotation3, UnitQuaternion, Vector3};
    use proptest::prelude::*;

    use super::*;
    use crate::kinematics::JointType;
    use crate::session::measurements::{Layout, Measurements, read, read_for, write_with_text};
    use crate::session::table::TableErrors;

    const JOINTS: [JointType; 1] = [JointType::Revolute];

    fn read_with(header: &str, values: &[f64]) -> Result<Measurements, TableErrors> {
        let values: Vec<String> = values.iter().map(|value| format!("{value:.15}")).collect();
        let text = format!(
            "pose,q1_deg,x_mm,y_mm,z_mm,{header},sigma_mm,sigma_rot_deg\n1,10,1000,200,-300,{},0.02,0.01\n",
            values.join(",")
        );
        read(text, "6d.csv", &JOINTS)
    }

    /// The pose that the four rows of a table stand for.
    fn pose(table: &Measurements) -> Isometry3<f64> {
        let names: Vec<&str> = table.rows.iter().filter_map(|row| row.target.as_deref()).collect();
        assert_eq!(names, ["probe.a", "probe.b", "probe.c", "probe.d"]);
        let points: [_; 4] = std::array::from_fn(|corner| table.rows[corner].point);
        Tetrahedron::of_points(&points).unwrap().pose(&points).unwrap()
    }

    fn about(axis: &str, angle: f64) -> Matrix3<f64> {
        let (s, c) = angle.sin_cos();
        match axis {
            "x" => Matrix3::new(1.0, 0.0, 0.0, 0.0, c, -s, 0.0, s, c),
            "y" => Matrix3::new(c, 0.0, s, 0.0, 1.0, 0.0, -s, 0.0, c),
            _ => Matrix3::new(c, -s, 0.0, s, c, 0.0, 0.0, 0.0, 1.0),
        }
    }

    #[test]
    fn every_form_of_orientation_is_read_as_its_definition_says() {
        let degrees = [-35.0, 62.0, 110.0];
        let [one, two, three] = degrees.map(f64::to_radians);
        let rotation = UnitQuaternion::new(Vector3::new(0.3, -0.9, 1.2));
        let matrix = rotation.to_rotation_matrix().into_inner();
        let q = rotation.quaternion();
        let v = rotation.scaled_axis();
        let fixed_xyz = about("z", three) * about("y", two) * about("x", one);
        let moving_zyx = about("z", one) * about("y", two) * about("x", three);
        let forms: Vec<(&str, Vec<f64>, Matrix3<f64>)> = vec![
            ("roll_deg,pitch_deg,yaw_deg", degrees.to_vec(), fixed_xyz),
            ("w_deg,p_deg,r_deg", degrees.to_vec(), fixed_xyz),
            ("W [deg],P [deg],R [deg]", degrees.to_vec(), fixed_xyz),
            ("fixed_x_deg,fixed_y_deg,fixed_z_deg", degrees.to_vec(), fixed_xyz),
            ("A_deg,B_deg,C_deg", degrees.to_vec(), moving_zyx),
            ("A (deg),B (deg),C (deg)", degrees.to_vec(), moving_zyx),
            ("moving_z_deg,moving_y_deg,moving_x_deg", degrees.to_vec(), moving_zyx),
            (
                "moving_z_deg,moving_y_deg,moving_z2_deg",
                degrees.to_vec(),
                about("z", one) * about("y", two) * about("z", three),
            ),
            (
                "moving_x_rad,moving_y_rad,moving_z_rad",
                vec![one, two, three],
                about("x", one) * about("y", two) * about("z", three),
            ),
            ("rx_rad,ry_rad,rz_rad", v.iter().copied().collect(), matrix),
            ("qx,qy,qz,qw", vec![q.i, q.j, q.k, q.w], matrix),
            ("qw,qx,qy,qz", vec![q.w, q.i, q.j, q.k], matrix),
            ("qw,qx,qy,qz", vec![-q.w, -q.i, -q.j, -q.k], matrix),
            ("r11,r12,r13,r21,r22,r23,r31,r32,r33", matrix.transpose().iter().copied().collect(), matrix),
            ("R11,R21,R31,R12,R22,R32,R13,R23,R33", matrix.iter().copied().collect(), matrix),
        ];
        for (header, values, expected) in forms {
            let table = read_with(header, &values).unwrap_or_else(|errors| panic!("{header}: {errors}"));
            let found = pose(&table);
            let expected = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(expected));
            assert!(found.rotation.angle_to(&expected) < 1e-9, "{header}");
            assert!((found.translation.vector - Vector3::new(1.0, 0.2, -0.3)).norm() < 1e-12, "{header}");
            assert!(table.rows.iter().all(|row| row.sigma.is_some_and(|sigma| (sigma - 4e-5).abs() < 1e-12)));
            assert!(
                table.understood.orientation.iter().any(|note| note.contains("four points of a rigid body")),
                "{header}"
            );
            // What is written is read as the same points.
            let again = read(write_with_text(&table, &JOINTS), "points.csv", &JOINTS).unwrap();
            assert_eq!((again.rows.len(), &again.understood.orientation), (4, &None), "{header}");
            assert!(
                table
                    .understood
                    .columns
                    .iter()
                    .all(|column| column.read_as.is_some() || column.name.starts_with("sigma")),
                "{header}"
            );
            assert!(pose(&again).rotation.angle_to(&expected) < 1e-7, "{header}");
        }
    }

    #[test]
    fn what_is_no_clear_orientation_is_refused_with_the_forms_that_are_read() {
        for (header, values, reason) in [
            ("rx_deg,ry_deg,rz_deg", &[1.0, 2.0, 3.0][..], "look like an orientation"),
            ("euler1,euler2,euler3", &[1.0, 2.0, 3.0], "look like an orientation"),
            ("note", &[1.0], "no orientation is found"),
            ("qx,qy,qz,qw", &[0.5, 0.5, 0.5, 0.9], "the quaternion is no rotation: its length is"),
            ("qx,qy,qz", &[0.0, 0.0, 1.0], "column qw is missing"),
            ("r11,r12,r13,r21,r22,r23,r31,r32,r33", &[1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, -1.0], "left-handed"),
            ("a_deg,b_deg,c_deg,qx,qy,qz,qw", &[0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0], "gives the orientation twice"),
        ] {
            let errors = read_with(header, values).unwrap_err().to_string();
            assert!(errors.contains(reason), "{header}: {errors}");
        }
        let text = "pose,q1_deg,x_mm,y_mm,z_mm,qx,qy,qz,qw,sigma_rot_deg\n1,10,1000,200,-300,0,0,0,1,0.01\n";
        let errors = read(text, "6d.csv", &JOINTS).unwrap_err().to_string();
        assert!(errors.contains("this row lacks 'sigma_mm'"), "{errors}");
    }

    #[test]
    fn an_orientation_without_its_error_is_not_used_and_said_to_be() {
        let text = "pose,q1_deg,x_mm,y_mm,z_mm,qx,qy,qz,qw\n1,10,1000,200,-300,0,0,0,1\n";
        let table = read(text, "6d.csv", &JOINTS).unwrap();
        assert_eq!(table.rows.len(), 1);
        assert!(
            table.understood.orientation.iter().any(|note| note.contains("'qx'") && note.contains("sigma_rot_deg"))
        );
        let reading = Reading { sigma: Some(2e-5), sigma_rotation: Some(1e-4), ..Reading::default() };
        let expected = Expected { targets: vec!["ball".to_owned()], ..Expected::joints(&JOINTS) };
        let table = read_for(&expected, Layout::Named, &reading, text, "6d.csv").unwrap();
        assert_eq!(table.rows[3].target.as_deref(), Some("ball.d"));
        let plain = "pose,q1_deg,x_mm,y_mm,z_mm\n1,10,1000,200,-300\n";
        assert!(read(plain, "3d.csv", &JOINTS).unwrap().understood.orientation.is_none());
    }

    proptest! {
        #[test]
        fn any_cells_are_read_or_refused(
            names in prop::collection::vec("(qx|qy|qz|qw|a_deg|b_deg|c_deg|rx_rad|r11|r33|moving_z_deg|roll|W|euler|[a-z_]{0,6})", 0..10),
            cells in prop::collection::vec("([-0-9.,e]{0,8}|nan|inf|1e308|-1|1)", 0..16),
            sigma in "(0.01|0|-1|nan|1e-308|)",
        ) {
            let text = format!("pose,q1_deg,x_mm,y_mm,z_mm,{},sigma_mm,sigma_rot_deg\n1,10,1000,200,-300,{},0.02,{sigma}\n", names.join(","), cells.join(","));
            if let Ok(table) = read(&text, "fuzz.csv", &JOINTS) {
                prop_assert_eq!(table.rows.len() % 4, 0);
                prop_assert!(table.rows.iter().all(|row| row.point.iter().all(|value| value.is_finite())));
            }
        }

        #[test]
        fn quaternions_come_back(w in -1.0..1.0_f64, x in -1.0..1.0_f64, y in -1.0..1.0_f64, z in -1.0..1.0_f64) {
            prop_assume!(Quaternion::new(w, x, y, z).norm() > 0.1);
            let rotation = UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z));
            let q = rotation.quaternion();
            let table = read_with("qw,qx,qy,qz", &[q.w, q.i, q.j, q.k]).unwrap();
            prop_assert!(pose(&table).rotation.angle_to(&rotation) < 1e-7);
        }
    }
}
