//! The two closed forms, as intersections of circles about the axes of the joints.

use nalgebra::{Isometry3, Vector3};

use super::lines::{Line, across, angle_about, angles_of_part};

/// Largest distance between lines that count as meeting (m), and angle between lines that count as parallel (rad): the solutions are
/// then starts of a search, which ends at the exact ones.
const NEARLY_MEETING: f64 = 2e-3;
const NEARLY_PARALLEL: f64 = 1e-2;
/// Lines that differ by less are what their names say.
const EXACTLY: f64 = 1e-9;
/// How much further than its reach an arm may be asked to go, for rounding and for arms that only nearly have the form.
const EXACT_SLACK: f64 = 1e-9;
const NEAR_SLACK: f64 = 1e-2;

/// A family of arms with a closed form.
#[derive(Clone, Debug)]
pub(super) struct Form {
    pub(super) kind: Kind,
    /// Point that the joints after the arm proper leave where it is: the middle of the wrist, at joint values zero.
    pub(super) wrist: Vector3<f64>,
    slack: f64,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    /// Axes 2 and 3 are parallel, 4, 5 and 6 meet in a point.
    SphericalWrist,
    /// Axes 2, 3 and 4 are parallel, 5 and 6 meet.
    ThreeParallel,
}

impl Form {
    /// The family of the arm with these six axes; `None` if it is of neither.
    pub(super) fn of(lines: &[Line]) -> Option<Self> {
        let [one, two, three, four, five, six] = lines else { return None };
        let parallel = |a: &Line, b: &Line| a.direction.cross(&b.direction).norm();
        let (wrist, gap) = five.meeting(six)?;
        let elbow = parallel(two, three);
        // Joint 1 must move the plane in which joints 2 and 3 work, and joint 5 must turn axis 6.
        if elbow > NEARLY_PARALLEL || gap > NEARLY_MEETING || parallel(one, two) < 0.1 {
            return None;
        }
        let form = |kind, defect: f64| {
            let slack = if defect < EXACTLY { EXACT_SLACK } else { NEAR_SLACK };
            Some(Self { kind, wrist, slack })
        };
        let beside = across(&four.direction, &(wrist - four.point)).norm();
        if beside < NEARLY_MEETING && parallel(four, five) > 0.1 {
            return form(Kind::SphericalWrist, gap.max(elbow).max(beside));
        }
        let third = parallel(two, four);
        if third < NEARLY_PARALLEL && parallel(four, five) > 0.1 {
            return form(Kind::ThreeParallel, gap.max(elbow).max(third));
        }
        None
    }

    /// Joint variables of all branches that move the flange by `motion` from where it is with all joints at zero.
    pub(super) fn solutions(&self, lines: &[Line], motion: &Isometry3<f64>) -> Vec<[f64; 6]> {
        let mut solutions = Vec::with_capacity(8);
        let [one, two, ..] = lines else { return solutions };
        let reached = motion.rotation * self.wrist + motion.translation.vector;
        // Seen along axis 2, joints 2 and 3 (and 4 of three parallel ones) leave the wrist at its depth.
        let depth = two.direction.dot(&(self.wrist - one.point));
        let back = nalgebra::Unit::new_unchecked(-one.direction.into_inner());
        let firsts = angles_of_part(&back, &(reached - one.point), &two.direction, depth, self.slack);
        for first in firsts.into_iter().flatten() {
            let remaining = one.turn(-first) * motion;
            match self.kind {
                Kind::SphericalWrist => self.spherical(lines, first, &remaining, &mut solutions),
                Kind::ThreeParallel => self.parallel(lines, first, &remaining, &mut solutions),
            }
        }
        solutions
    }

    fn spherical(&self, lines: &[Line], first: f64, motion: &Isometry3<f64>, solutions: &mut Vec<[f64; 6]>) {
        let [_, two, three, four, five, six] = lines else { return };
        let reached = motion.rotation * self.wrist + motion.translation.vector;
        for [second, third] in self.planar(two, three, &self.wrist, &reached) {
            let turned = (two.turn(second) * three.turn(third)).rotation.inverse() * motion.rotation;
            let axis = six.direction.into_inner();
            let goal = turned * axis;
            let part = four.direction.dot(&goal);
            let Some(fifths) = angles_of_part(&five.direction, &axis, &four.direction, part, self.slack) else {
                continue;
            };
            for fifth in fifths {
                let bent = five.turn(fifth).rotation;
                let fourth = angle_about(&four.direction, &(bent * axis), &goal);
                let rest = (four.turn(fourth).rotation * bent).inverse() * turned;
                let sixth = turn_about(six, &rest);
                solutions.push([first, second, third, fourth, fifth, sixth]);
            }
        }
    }

    fn parallel(&self, lines: &[Line], first: f64, motion: &Isometry3<f64>, solutions: &mut Vec<[f64; 6]>) {
        let [_, two, three, four, five, six] = lines else { return };
        let normal = two.direction.into_inner();
        let axis = six.direction.into_inner();
        let part = normal.dot(&(motion.rotation * axis));
        let Some(fifths) = angles_of_part(&five.direction, &axis, &normal, part, self.slack) else { return };
        for fifth in fifths {
            let bent = five.turn(fifth);
            let seen = motion.rotation.inverse() * normal;
            let sixth = angle_about(&six.direction, &seen, &(bent.rotation.inverse() * normal));
            let planar = motion * (bent * six.turn(sixth)).inverse();
            let reached = planar.rotation * four.point + planar.translation.vector;
            for [second, third] in self.planar(two, three, &four.point, &reached) {
                let rest = (two.turn(second) * three.turn(third)).inverse() * planar;
                let fourth = turn_about(four, &rest.rotation);
                solutions.push([first, second, third, fourth, fifth, sixth]);
            }
        }
    }

    /// The angles of two parallel axes that take a point to where it is seen across them.
    fn planar(&self, two: &Line, three: &Line, from: &Vector3<f64>, to: &Vector3<f64>) -> Vec<[f64; 2]> {
        let normal = &two.direction;
        let upper = across(normal, &(three.point - two.point));
        let fore = across(normal, &(from - three.point));
        let goal = across(normal, &(to - two.point));
        let part = (goal.norm_squared() - upper.norm_squared() - fore.norm_squared()) / 2.0;
        let thirds = angles_of_part(&three.direction, &fore, &upper, part, self.slack);
        thirds
            .into_iter()
            .flatten()
            .map(|third| [two.angle_between(&(three.turn(third) * nalgebra::Point3::from(*from)).coords, to), third])
            .collect()
    }
}

/// How far a rotation turns about a line.
fn turn_about(line: &Line, rotation: &nalgebra::UnitQuaternion<f64>) -> f64 {
    let across = if line.direction.x.abs() < 0.8 { Vector3::x() } else { Vector3::y() };
    angle_about(&line.direction, &across, &(rotation * across))
}
