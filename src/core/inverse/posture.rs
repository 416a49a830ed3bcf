//! The branch of a configuration in terms of the arm itself, from which the notations of the makers follow.

use nalgebra::{Point3, Vector3};

use super::closed::{Form, Kind};
use super::lines::{Line, across};
use crate::kinematics::KinematicChain;

/// The branch of a six-axis arm in a configuration.
///
/// *Front* is the side of axis 1 to which the x axis of the base points while joint 1 is at zero; it turns with joint 1. For arms of
/// Universal Robots the wrist is where axes 5 and 6 meet, and the elbow is seen with the point of axis 4.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Posture {
    /// The middle of the wrist is behind axis 1: ABB `cfx` 4 to 7, KUKA `S` bit 0, FANUC `B`.
    pub wrist_is_behind: bool,
    /// The middle of the wrist is behind the line from axis 2 to axis 3 (the lower arm, its direction up): ABB `cfx` 2, 3, 6, 7, KUKA `S` bit 1.
    /// At the stretched arm it changes.
    pub wrist_is_behind_lower_arm: bool,
    /// Axis 5 is at a negative angle, as the pendant counts, from the straight wrist (axes 4 and 6 in line): odd ABB `cfx`.
    pub wrist_is_negative: bool,
}

impl Posture {
    /// Axis 3 is above the line from axis 2 to the wrist, seen from the side: FANUC `U`.
    pub const fn elbow_is_up(&self) -> bool {
        self.wrist_is_behind == self.wrist_is_behind_lower_arm
    }

    pub(super) fn new(form: &Form, lines: &[Line], chain: &KinematicChain, variables: &[f64]) -> Self {
        let ([one, two, three, four, five, six], [_, second, third, fourth, fifth, _]) = (lines, variables) else {
            return Self { wrist_is_behind: false, wrist_is_behind_lower_arm: false, wrist_is_negative: false };
        };
        // All is seen from a base that turns with joint 1.
        let x = Vector3::x();
        let front = front(one, two, &x);
        let side = one.direction.cross(&front);
        let upper = two.turn(*second);
        let elbow = upper * Point3::from(three.point);
        let outer = upper * three.turn(*third);
        let wrist = match form.kind {
            Kind::SphericalWrist => outer * Point3::from(form.wrist),
            Kind::ThreeParallel => outer * four.turn(*fourth) * Point3::from(form.wrist),
        };
        let hand = match form.kind {
            Kind::SphericalWrist => wrist,
            Kind::ThreeParallel => outer * Point3::from(four.point),
        };
        let lower_arm = across(&two.direction, &(elbow.coords - two.point));
        let before = side.cross(&lower_arm).dot(&(hand - elbow));
        let straight = four.direction.dot(&six.direction);
        let bent = five.turn(*fifth).rotation * six.direction.into_inner();
        let sine = five.direction.dot(&four.direction.cross(&bent));
        // Where axes 4 and 6 are at right angles at zero (Universal Robots), the sign is that of the sine of joint 5 itself.
        let counted = if straight.abs() > 0.1 { sine * straight.signum() } else { fifth.sin() };
        Self {
            wrist_is_behind: front.dot(&(wrist.coords - one.point)) < 0.0,
            wrist_is_behind_lower_arm: before < 0.0,
            wrist_is_negative: chain.joints()[4].direction * counted < 0.0,
        }
    }
}

/// The direction across axes 1 and 2 that points to the front.
fn front(one: &Line, two: &Line, x: &Vector3<f64>) -> Vector3<f64> {
    let across_both = one.direction.cross(&two.direction).normalize();
    let part = across_both.dot(x);
    // An arm whose plane is across the x axis of its base has its front where axis 2 is.
    let sign = if part.abs() > 0.1 { part } else { across_both.dot(&(two.point - one.point)) };
    if sign < 0.0 { -across_both } else { across_both }
}
