//! Forward kinematics of the shipped profiles against the maker's dimension drawings.
//!
//! The drawing gives a point and a direction for every axis with all pendant values at zero, and the flange there. The flange
//! at another configuration follows by turning about these lines in space, last joint first (product of exponentials; Lynch
//! and Park 2017, §4.1). No link table takes part.

use nalgebra::{Isometry3, Matrix3, Point3, Rotation3, Translation3, Unit, UnitQuaternion, Vector3};

use super::super::builtin_names;
use super::shipped::shipped;
use crate::kinematics::ForwardKinematics;

type Triple = [f64; 3];

const X: Triple = [1.0, 0.0, 0.0];
const Y: Triple = [0.0, 1.0, 0.0];
const Z: Triple = [0.0, 0.0, 1.0];
const MINUS_X: Triple = [-1.0, 0.0, 0.0];
const MINUS_Y: Triple = [0.0, -1.0, 0.0];
const MINUS_Z: Triple = [0.0, 0.0, -1.0];

/// A robot as drawn at pendant zero, in mm.
struct Drawing {
    name: &'static str,
    /// Point on and direction of each axis; positive pendant values turn right-handed about it.
    axes: Vec<(Triple, Triple)>,
    /// Sliding joints.
    sliding: &'static [usize],
    /// Centre of the flange face.
    flange: Triple,
    /// Directions of the flange's x and z.
    flange_x: Triple,
    flange_z: Triple,
}

impl Drawing {
    /// `turns`: how much each axis turns against its predecessor (rad) or slides (m).
    fn base_from_flange(&self, turns: &[f64]) -> Isometry3<f64> {
        let [x, z] = [self.flange_x, self.flange_z].map(Vector3::from);
        let axes = Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[x, z.cross(&x), z]));
        let origin = Vector3::from(self.flange) * 1e-3;
        let start = Isometry3::from_parts(Translation3::from(origin), UnitQuaternion::from_rotation_matrix(&axes));
        self.axes.iter().zip(turns).enumerate().rev().fold(start, |pose, (joint, ((point, axis), turn))| {
            let axis = Vector3::from(*axis);
            if self.sliding.contains(&joint) {
                return Translation3::from(axis * *turn) * pose;
            }
            let point = Point3::from(*point) * 1e-3;
            let rotation = UnitQuaternion::from_axis_angle(&Unit::new_normalize(axis), *turn);
            Isometry3::rotation_wrt_point(rotation, point) * pose
        })
    }
}

fn drawing(name: &'static str, axes: Vec<(Triple, Triple)>, flange: Triple, x: Triple, z: Triple) -> Drawing {
    Drawing { name, axes, sliding: &[], flange, flange_x: x, flange_z: z }
}

/// UR at zero: both arms horizontal towards −x, wrist hanging down, flange towards −y.
fn ur(name: &'static str, [shoulder, upper, fore, wrist1, wrist2, wrist3]: [f64; 6]) -> Drawing {
    let (elbow, wrist) = (-upper, -upper - fore);
    let axes = vec![
        ([0.0, 0.0, 0.0], Z),
        ([0.0, 0.0, shoulder], MINUS_Y),
        ([elbow, 0.0, shoulder], MINUS_Y),
        ([wrist, 0.0, shoulder], MINUS_Y),
        ([wrist, -wrist1, 0.0], MINUS_Z),
        ([wrist, 0.0, shoulder - wrist2], MINUS_Y),
    ];
    drawing(name, axes, [wrist, -wrist1 - wrist3, shoulder - wrist2], X, MINUS_Y)
}

/// Upper arm up, forearm forward: `forward` from axis 1 to 2, heights of axes 2, 3, 4, then wrist centre and flange face.
fn upright(name: &'static str, forward: f64, heights: Triple, wrist: f64, flange: f64, x: Triple) -> Drawing {
    let [shoulder, elbow, forearm] = heights;
    let axes = vec![
        ([0.0, 0.0, 0.0], Z),
        ([forward, 0.0, shoulder], Y),
        ([forward, 0.0, elbow], Y),
        ([0.0, 0.0, forearm], X),
        ([wrist, 0.0, forearm], Y),
        ([0.0, 0.0, forearm], X),
    ];
    drawing(name, axes, [flange, 0.0, forearm], x, X)
}

/// iiwa straight up: senses alternate as on the pendant.
fn iiwa(name: &'static str, shoulder: f64, elbow: f64, wrist: f64, flange: f64) -> Drawing {
    let axes = vec![
        ([0.0; 3], Z),
        ([0.0, 0.0, shoulder], Y),
        ([0.0; 3], Z),
        ([0.0, 0.0, elbow], MINUS_Y),
        ([0.0; 3], Z),
        ([0.0, 0.0, wrist], Y),
        ([0.0; 3], Z),
    ];
    drawing(name, axes, [0.0, 0.0, flange], X, Z)
}

fn fanuc() -> Drawing {
    // Heights above axis 2, where FANUC's WORLD is. Senses as on the pendant: J3 up, J5 up, J4 and J6 against x.
    let axes = vec![
        ([0.0; 3], Z),
        ([50.0, 0.0, 0.0], Y),
        ([50.0, 0.0, 330.0], MINUS_Y),
        ([0.0, 0.0, 365.0], MINUS_X),
        ([385.0, 0.0, 365.0], MINUS_Y),
        ([0.0, 0.0, 365.0], MINUS_X),
    ];
    drawing("fanuc_lrmate200id", axes, [465.0, 0.0, 365.0], Z, X)
}

fn drawings() -> Vec<Drawing> {
    let kuka = vec![
        // All zero: link arm and forearm stretched forward, 35 mm apart in height.
        ([0.0; 3], MINUS_Z),
        ([25.0, 0.0, 400.0], Y),
        ([480.0, 0.0, 400.0], Y),
        ([0.0, 0.0, 435.0], MINUS_X),
        ([900.0, 0.0, 435.0], Y),
        ([0.0, 0.0, 435.0], MINUS_X),
    ];
    let panda = vec![
        // All zero: straight up, elbow 82.5 mm forward, hand 88 mm forward and pointing down.
        ([0.0; 3], Z),
        ([0.0, 0.0, 333.0], Y),
        ([0.0; 3], Z),
        ([82.5, 0.0, 649.0], MINUS_Y),
        ([0.0; 3], Z),
        ([0.0, 0.0, 1033.0], MINUS_Y),
        ([88.0, 0.0, 0.0], MINUS_Z),
    ];
    let staubli = vec![
        // All zero: straight up, the arm 20 mm beside axis 1.
        ([0.0; 3], Z),
        ([0.0, 0.0, 375.0], Y),
        ([0.0, 0.0, 665.0], Y),
        ([0.0, 20.0, 0.0], Z),
        ([0.0, 0.0, 975.0], Y),
        ([0.0, 20.0, 0.0], Z),
    ];
    let scara = vec![([0.0; 3], Z), ([225.0, 0.0, 0.0], Z), ([0.0; 3], Z), ([400.0, 0.0, 0.0], Z)];
    vec![
        ur("ur5", [89.159, 425.0, 392.25, 109.15, 94.65, 82.3]),
        ur("ur10", [127.3, 612.0, 572.3, 163.941, 115.7, 92.2]),
        ur("ur5e", [162.5, 425.0, 392.2, 133.3, 99.7, 99.6]),
        ur("ur10e", [180.7, 612.7, 571.55, 174.15, 119.85, 116.55]),
        upright("soochow", 170.0, [504.0, 1284.0, 1424.0], 930.0, 1055.0, Z),
        upright("abb_irb120", 0.0, [290.0, 560.0, 630.0], 302.0, 374.0, MINUS_Z),
        upright("abb_irb1600_6_145", 150.0, [486.5, 1186.5, 1186.5], 750.0, 815.0, MINUS_Z),
        upright("meca500", 0.0, [135.0, 270.0, 308.0], 120.0, 190.0, MINUS_Z),
        fanuc(),
        drawing("kuka_kr6_r900", kuka, [980.0, 0.0, 435.0], MINUS_Z, X),
        iiwa("kuka_iiwa7", 340.0, 740.0, 1140.0, 1266.0),
        iiwa("kuka_iiwa14", 360.0, 780.0, 1180.0, 1306.0),
        drawing("franka_panda", panda, [88.0, 0.0, 926.0], X, MINUS_Z),
        drawing("staubli_tx2_60", staubli, [0.0, 20.0, 1045.0], X, Z),
        Drawing { sliding: &[2], ..drawing("epson_ls3_b401s", scara, [400.0, 0.0, 0.0], X, Z) },
    ]
}

/// Zero, and configurations with every joint turned by its own amount.
fn configurations(joints: usize) -> Vec<Vec<f64>> {
    let turned = |scale: f64, shift: f64| (0..joints).map(|i| scale * (shift + 1.7 * i as f64).sin()).collect();
    vec![vec![0.0; joints], turned(0.8, 0.3), turned(1.3, 1.1), turned(-2.1, 2.9), turned(2.9, 4.2)]
}

#[test]
fn every_shipped_profile_moves_as_drawn() {
    let drawings = drawings();
    let mut drawn: Vec<&str> = drawings.iter().map(|drawing| drawing.name).collect();
    drawn.sort_unstable();
    assert_eq!(drawn, builtin_names().collect::<Vec<_>>());
    for drawing in &drawings {
        let profile = shipped(drawing.name);
        let arm = ForwardKinematics::new(profile.chain());
        for q in configurations(profile.chain().dof()) {
            let mut turns = q.clone();
            if drawing.name == "fanuc_lrmate200id" {
                // The pendant's J3 is the slope of the forearm: the elbow turns by what J2 leans forward as well.
                turns[2] = q[2] + q[1];
            }
            let found = arm.base_from_flange(&q);
            let drawn = drawing.base_from_flange(&turns);
            let distance = (found.translation.vector - drawn.translation.vector).norm();
            let angle = found.rotation.angle_to(&drawn.rotation);
            assert!(distance < 1e-9 && angle < 1e-7, "{} at {q:?}: {distance} m, {angle} rad", drawing.name);
        }
    }
}

/// Flange positions that makers and manuals print, in mm.
#[test]
fn published_positions() {
    let published: [(&str, &[f64], Triple); 9] = [
        ("ur5", &[0.0; 6], [-817.25, -191.45, -5.491]),
        ("ur10", &[0.0; 6], [-1184.3, -256.141, 11.6]),
        ("abb_irb120", &[0.0; 6], [374.0, 0.0, 630.0]),
        ("abb_irb1600_6_145", &[0.0; 6], [815.0, 0.0, 1186.5]),
        ("kuka_kr6_r900", &[0.0, -90.0, 90.0, 0.0, 0.0, 0.0], [525.0, 0.0, 890.0]),
        ("fanuc_lrmate200id", &[0.0; 6], [465.0, 0.0, 365.0]),
        ("meca500", &[0.0; 6], [190.0, 0.0, 308.0]),
        ("franka_panda", &[0.0, -45.0, 0.0, -135.0, 0.0, 90.0, 45.0], [306.891, 0.0, 590.282]),
        ("epson_ls3_b401s", &[0.0, 0.0, 0.0, 0.0], [400.0, 0.0, 0.0]),
    ];
    for (name, degrees, expected) in published {
        let profile = shipped(name);
        let q: Vec<f64> = degrees.iter().map(|angle| angle.to_radians()).collect();
        let flange = ForwardKinematics::new(profile.chain()).base_from_flange(&q).translation.vector * 1e3;
        assert!((flange - Vector3::from(expected)).norm() < 2e-3, "{name}: {flange:?}");
    }
}

/// A forearm that keeps its slope while J2 moves is what FANUC's coupling means.
#[test]
fn fanuc_j2_alone_does_not_turn_the_hand() {
    let profile = shipped("fanuc_lrmate200id");
    let arm = ForwardKinematics::new(profile.chain());
    let rest = arm.base_from_flange(&[0.0; 6]);
    let leant = arm.base_from_flange(&[0.0, 0.5, 0.0, 0.0, 0.0, 0.0]);
    assert!(rest.rotation.angle_to(&leant.rotation) < 1e-7);
    assert!(leant.translation.x > rest.translation.x + 0.1 && leant.translation.z < rest.translation.z);
}
