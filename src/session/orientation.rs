//! The forms in which a table gives orientations, recognised by the names of its columns.

use nalgebra::{Matrix3, Quaternion, Rotation3, UnitQuaternion, Vector3};

use crate::session::table::{Defect, Header, Measure, NumberColumn, TableProblem};

/// A quaternion whose length is farther from 1, or a matrix whose axes are farther from orthonormal, is no rotation.
const ROTATION_TOLERANCE: f64 = 1e-3;

/// What is read, for messages.
pub(super) const READ: [&str; 8] = [
    "roll_deg, pitch_deg, yaw_deg (about the fixed x, y, z)",
    "a_deg, b_deg, c_deg (KUKA)",
    "w_deg, p_deg, r_deg (FANUC)",
    "rx_rad, ry_rad, rz_rad (rotation vector)",
    "fixed_x_deg, fixed_y_deg, fixed_z_deg (in the order of the columns)",
    "moving_z_deg, moving_y_deg, moving_x_deg (in the order of the columns; a second turn about z is moving_z2_deg)",
    "qx, qy, qz, qw (quaternion)",
    "r11, r12, r13, r21 to r33 (matrix, row by row)",
];

/// Names that look like an orientation without an angle unit.
const LIKE_AN_ORIENTATION: [&str; 14] =
    ["rx", "ry", "rz", "roll", "pitch", "yaw", "qx", "qy", "qz", "qw", "quat", "rot", "euler", "orientation"];

/// How an orientation is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Form {
    /// Angles about the fixed x, y and z.
    FixedXyz,
    /// Angles about z, the new y and the new x.
    MovingZyx,
    RotationVector,
    /// Angles about axes (0 is x) that stay where they are, one after the other.
    Fixed([usize; 3]),
    /// Angles about axes that turn along.
    Moving([usize; 3]),
    Quaternion,
    Matrix,
}

/// The columns of an orientation.
#[derive(Clone, Debug)]
pub(super) struct Orientation {
    form: Form,
    pub(super) columns: Vec<NumberColumn>,
}

/// Whether a column has this name with an angle unit.
fn is_angle(lower: &[String], name: &str) -> bool {
    ["deg", "rad"].iter().any(|unit| lower.contains(&format!("{name}_{unit}")))
}

/// Whether a table has columns of these angles: one of them with its unit, two where a letter alone can mean anything, or all without
/// a unit, which is then reported.
fn has_angles(lower: &[String], names: &[&str; 3]) -> bool {
    let with_unit = names.iter().filter(|name| is_angle(lower, name)).count();
    let least = if names.iter().all(|name| name.len() == 1) { 2 } else { 1 };
    with_unit >= least || names.iter().all(|name| lower.iter().any(|known| known == name))
}

impl Orientation {
    /// Finds the orientation among the columns; `None` if there is none. What looks like one and is not read, or is given twice, is a
    /// problem: a tool must never turn freely by mistake.
    ///
    /// `others` are columns with another meaning, which may look like one.
    pub(super) fn find(header: &mut Header, others: &[&str], problems: &mut Vec<TableProblem>) -> Option<Self> {
        let lower = header.known().to_vec();
        let mut found: Vec<(usize, Self)> = Vec::new();
        let angles = [
            (["roll", "pitch", "yaw"], Form::FixedXyz),
            (["a", "b", "c"], Form::MovingZyx),
            (["w", "p", "r"], Form::FixedXyz),
        ];
        for (index, (names, form)) in angles.into_iter().enumerate() {
            if has_angles(&lower, &names) {
                let columns = names.iter().filter_map(|name| header.required(name, Measure::Angle, problems));
                found.push((index, Self { form, columns: columns.collect() }));
            }
        }
        // In degrees these are angles of some makers and a rotation vector of others.
        let vector = ["rx", "ry", "rz"];
        if vector.iter().all(|name| lower.contains(&format!("{name}_rad"))) {
            let columns = vector.iter().filter_map(|name| header.required(name, Measure::Angle, problems));
            found.push((3, Self { form: Form::RotationVector, columns: columns.collect() }));
        }
        for (index, prefix) in [(4, "fixed_"), (5, "moving_")] {
            if let Some(turns) = Self::turns(header, &lower, prefix, problems) {
                found.push((index, turns));
            }
        }
        let plain = [
            (6, Form::Quaternion, ["qx", "qy", "qz", "qw"].as_slice()),
            (7, Form::Matrix, ["r11", "r12", "r13", "r21", "r22", "r23", "r31", "r32", "r33"].as_slice()),
        ];
        for (index, form, names) in plain {
            if names.iter().any(|name| header.text(name).is_some()) {
                let columns = names.iter().filter_map(|name| header.required_text(name));
                let columns = columns.map(|index| NumberColumn { index, unit: 1.0 }).collect();
                found.push((index, Self { form, columns }));
            }
        }
        if found.len() > 1 {
            let forms = found.iter().filter_map(|(index, _)| READ.get(*index).copied()).collect();
            problems.push(Defect::SeveralOrientations { forms }.at(header.line));
        }
        let orientation = found.into_iter().next().map(|(_, orientation)| orientation);
        let used = |index: usize| {
            orientation.iter().flat_map(|orientation| &orientation.columns).any(|column| column.index == index)
        };
        let unread: Vec<String> = header
            .names
            .iter()
            .zip(&lower)
            .enumerate()
            .filter(|(index, (_, lower))| {
                !used(*index) && !others.contains(&lower.as_str()) && is_like_an_orientation(lower)
            })
            .map(|(_, (name, _))| name.clone())
            .collect();
        // Beside joint values such a column is the user's own business.
        let is_cartesian = orientation.is_some() || ["x", "y", "z"].iter().any(|name| header.has_quantity(name));
        if is_cartesian && !unread.is_empty() {
            problems.push(Defect::UnknownOrientation { columns: unread, read: READ.to_vec() }.at(header.line));
        }
        orientation
    }

    /// Three turns about axes that the names of the columns tell, in the order of the columns.
    fn turns(header: &mut Header, lower: &[String], prefix: &str, problems: &mut Vec<TableProblem>) -> Option<Self> {
        let named = lower.iter().filter_map(|name| {
            let rest = name.strip_prefix(prefix)?;
            let rest = rest.strip_suffix("_deg").or_else(|| rest.strip_suffix("_rad"))?;
            let axis = match rest.trim_end_matches(|digit: char| digit.is_ascii_digit()) {
                "x" => 0,
                "y" => 1,
                "z" => 2,
                _ => return None,
            };
            Some((format!("{prefix}{rest}"), axis))
        });
        let named: Vec<(String, usize)> = named.collect();
        let [(_, first), (_, second), (_, third)] = named[..] else { return None };
        let axes = [first, second, third];
        let form = if prefix == "fixed_" { Form::Fixed(axes) } else { Form::Moving(axes) };
        let columns = named.iter().filter_map(|(name, _)| header.required(name, Measure::Angle, problems));
        Some(Self { form, columns: columns.collect() })
    }

    /// The form in words, as messages name it.
    pub(super) const fn form_read(&self) -> &'static str {
        match self.form {
            Form::FixedXyz => "angles about the fixed x, y and z",
            Form::MovingZyx => "angles about z, the new y and the new x",
            Form::RotationVector => "a rotation vector",
            Form::Fixed(_) => "angles about fixed axes, in the order of the columns",
            Form::Moving(_) => "angles about moving axes, in the order of the columns",
            Form::Quaternion => "a quaternion",
            Form::Matrix => "a matrix, row by row",
        }
    }

    /// The rotation that the numbers of a row describe.
    pub(super) fn rotation(&self, values: &[f64]) -> Result<UnitQuaternion<f64>, Defect> {
        let about = |axis: usize, angle: f64| {
            let axis = [Vector3::x_axis(), Vector3::y_axis(), Vector3::z_axis()][axis];
            UnitQuaternion::from_axis_angle(&axis, angle)
        };
        match (self.form, values) {
            (Form::FixedXyz, &[x, y, z]) | (Form::MovingZyx, &[z, y, x]) => {
                Ok(UnitQuaternion::from_euler_angles(x, y, z))
            }
            (Form::RotationVector, &[x, y, z]) => Ok(UnitQuaternion::from_scaled_axis(Vector3::new(x, y, z))),
            (Form::Fixed([one, two, three]), &[a, b, c]) => Ok(about(three, c) * about(two, b) * about(one, a)),
            (Form::Moving([one, two, three]), &[a, b, c]) => Ok(about(one, a) * about(two, b) * about(three, c)),
            (Form::Quaternion, &[x, y, z, w]) => {
                let quaternion = Quaternion::new(w, x, y, z);
                let length = quaternion.norm();
                if (length - 1.0).abs() > ROTATION_TOLERANCE {
                    let reason = format!("its length is {length:.4} instead of 1");
                    return Err(Defect::NoRotation { name: "the quaternion", reason });
                }
                Ok(UnitQuaternion::from_quaternion(quaternion))
            }
            (Form::Matrix, values) if values.len() == 9 => {
                let matrix = Matrix3::from_row_slice(values);
                let off = (matrix.transpose() * matrix - Matrix3::identity()).amax();
                let reason = if off > ROTATION_TOLERANCE {
                    format!("its columns are {off:.4} away from orthonormal axes")
                } else if matrix.determinant() < 0.0 {
                    "its axes are left-handed".to_owned()
                } else {
                    return Ok(UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix(&matrix)));
                };
                Err(Defect::NoRotation { name: "the matrix", reason })
            }
            // The missing columns are reported already.
            _ => Ok(UnitQuaternion::identity()),
        }
    }
}

/// Whether an orientation can have a column of this name (in lower case).
pub(super) fn is_column(lower: &str) -> bool {
    let base = lower.strip_suffix("_deg").or_else(|| lower.strip_suffix("_rad"));
    let angles = ["roll", "pitch", "yaw", "a", "b", "c", "w", "p", "r"];
    let is_turn = |base: &str| {
        let axis = base.strip_prefix("fixed_").or_else(|| base.strip_prefix("moving_"));
        axis.is_some_and(|axis| ["x", "y", "z"].contains(&axis.trim_end_matches(|digit: char| digit.is_ascii_digit())))
    };
    let is_entry = |name: &str| {
        let entry = name.strip_prefix('r').and_then(|digits| digits.parse::<u8>().ok());
        entry.is_some_and(|entry| (1..=3).contains(&(entry / 10)) && (1..=3).contains(&(entry % 10)))
    };
    base.is_some_and(|base| angles.contains(&base) || is_turn(base))
        || ["rx_rad", "ry_rad", "rz_rad", "qx", "qy", "qz", "qw"].contains(&lower)
        || is_entry(lower)
}

/// Whether the name of a column that is not read looks like an orientation: an angle that is no joint value, or a known beginning.
fn is_like_an_orientation(lower: &str) -> bool {
    let is_joint = lower.strip_prefix('q').is_some_and(|rest| rest.starts_with(|digit: char| digit.is_ascii_digit()));
    let is_angle = lower.ends_with("_deg") || lower.ends_with("_rad");
    let is_named = LIKE_AN_ORIENTATION.iter().any(|name| {
        let rest = lower.strip_prefix(name);
        rest.is_some_and(|rest| !rest.starts_with(|letter: char| letter.is_alphabetic()))
    });
    !is_joint && (is_angle || is_named)
}
