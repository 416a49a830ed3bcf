//! Inverse kinematics of all shipped arms with six and seven axes: every configuration is among the solutions of its own pose.

use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use trupose::inverse::{InverseKinematics, Posture, distance};
use trupose::kinematics::{Convention, ForwardKinematics, Joint, KinematicChain};
use trupose::model::proof::configurations;
use trupose::profile::{Profile, builtin};

const SIX_AXES: &[&str] = &[
    "abb_irb120",
    "abb_irb1600_6_145",
    "fanuc_lrmate200id",
    "kuka_kr6_r900",
    "meca500",
    "soochow",
    "staubli_tx2_60",
    "ur10",
    "ur10e",
    "ur5",
    "ur5e",
];
const SEVEN_AXES: &[&str] = &["franka_panda", "kuka_iiwa14", "kuka_iiwa7"];

fn profile(name: &str) -> Profile {
    Profile::parse(builtin(name).unwrap(), name).unwrap().0
}

fn limits(profile: &Profile) -> Vec<Option<(f64, f64)>> {
    profile.joints().iter().map(|range| range.limits).collect()
}

#[test]
fn every_configuration_is_among_the_solutions_of_its_pose() {
    for name in SIX_AXES {
        let profile = profile(name);
        let limits = limits(&profile);
        let inverse = InverseKinematics::new(profile.chain(), &limits);
        assert!(inverse.is_closed(), "{name}");
        let forward = ForwardKinematics::new(profile.chain());
        for q in configurations(profile.chain(), &limits, 60) {
            let pose = forward.base_from_flange(&q);
            let all = inverse.solutions(&pose);
            assert!(all.iter().any(|solution| distance(solution, &q) < 1e-6), "{name} {q:?}");
            for solution in &all {
                let reached = forward.base_from_flange(solution);
                assert!((reached.translation.vector - pose.translation.vector).norm() < 1e-9);
                assert!(reached.rotation.angle_to(&pose.rotation) < 1e-9);
                assert!(inverse.beyond(solution).is_empty());
            }
            // The posture tells the branches apart.
            let posture = inverse.posture(&q);
            let mut alike = all.iter().filter(|solution| inverse.posture(solution) == posture).cloned();
            assert!(alike.all(|mut solution| {
                inverse.unwind(&mut solution, &q);
                distance(&solution, &q) < 1e-6
            }));
        }
    }
}

#[test]
fn the_nearest_solution_keeps_the_branch_and_the_redundant_joint() {
    let mut random = ChaCha8Rng::seed_from_u64(5);
    for name in SIX_AXES.iter().chain(SEVEN_AXES) {
        let profile = profile(name);
        let limits = limits(&profile);
        let inverse = InverseKinematics::new(profile.chain(), &limits);
        let forward = ForwardKinematics::new(profile.chain());
        for q in configurations(profile.chain(), &limits, 60) {
            // Near, with the redundant joint where it is.
            let near: Vec<f64> =
                (0..q.len())
                    .map(|joint| {
                        if q.len() == 7 && joint == 2 { q[joint] } else { q[joint] + random.random_range(-0.02..0.02) }
                    })
                    .collect();
            let found = inverse.nearest(&forward.base_from_flange(&q), &near).unwrap();
            assert!(distance(&found, &near) < 0.02 + 1e-6 || distance(&found, &q) < 1e-6, "{name} {q:?} {found:?}");
        }
    }
}

/// An arm whose constants are rounded or measured has no exact closed form; its solutions are exact all the same.
#[test]
fn an_arm_that_is_nearly_of_a_family_is_solved_exactly() {
    for name in ["abb_irb120", "ur5e"] {
        let profile = profile(name);
        let limits = limits(&profile);
        let joints: Vec<Joint> = profile
            .chain()
            .joints()
            .iter()
            .enumerate()
            .map(|(index, joint)| {
                let mut joint = joint.clone();
                joint.link.alpha += 4e-4 * (index as f64 - 2.5);
                joint.link.a += 1e-4 * index as f64;
                joint
            })
            .collect();
        let chain =
            KinematicChain::new(Convention::Standard, *profile.chain().base(), joints, *profile.chain().flange());
        let chain = chain.unwrap();
        let inverse = InverseKinematics::new(&chain, &limits);
        let forward = ForwardKinematics::new(&chain);
        assert!(inverse.is_closed());
        let all = configurations(&chain, &limits, 40);
        let found = all.iter().filter(|q| {
            let solutions = inverse.solutions(&forward.base_from_flange(q));
            solutions.iter().any(|solution| distance(solution, q) < 1e-6)
        });
        // Where two branches almost meet, both searches may end at the same one.
        assert!(found.count() + 1 >= all.len(), "{name}");
    }
}

/// The postures that the makers write, for arms whose zero is where their manuals draw it.
#[test]
fn postures_follow_the_arm() {
    let of = |name: &str, degrees: [f64; 6]| -> Posture {
        let profile = profile(name);
        let inverse = InverseKinematics::new(profile.chain(), &limits(&profile));
        inverse.posture(&degrees.map(f64::to_radians)).unwrap()
    };
    let posture = |wrist_is_behind, wrist_is_behind_lower_arm, wrist_is_negative| Posture {
        wrist_is_behind,
        wrist_is_behind_lower_arm,
        wrist_is_negative,
    };
    for name in ["abb_irb120", "abb_irb1600_6_145", "fanuc_lrmate200id"] {
        // Lower arm up, forearm to the front.
        assert_eq!(of(name, [0.0, 0.0, 0.0, 0.0, 30.0, 0.0]), posture(false, false, false), "{name}");
        assert_eq!(of(name, [70.0, 0.0, 0.0, 0.0, -30.0, 0.0]), posture(false, false, true), "{name}");
        // Leaning back until the wrist is behind axis 1; the forearm is still in front of the lower arm.
        assert_eq!(of(name, [0.0, -85.0, 0.0, 0.0, 30.0, 0.0]).wrist_is_behind, name != "fanuc_lrmate200id", "{name}");
    }
    // KUKA draws its zero with the arm stretched to the front; A3 at 90° and A2 at -90° is the same as above.
    assert_eq!(of("kuka_kr6_r900", [0.0, -90.0, 90.0, 0.0, 30.0, 0.0]), posture(false, false, false));
    assert!(of("kuka_kr6_r900", [0.0, -90.0, -45.0, 0.0, 30.0, 0.0]).wrist_is_behind_lower_arm);
    // Stäubli stands upright at zero: a positive J3 bends to the front.
    assert_eq!(of("staubli_tx2_60", [0.0, 0.0, 90.0, 0.0, 30.0, 0.0]), posture(false, false, false));
    assert!(of("staubli_tx2_60", [0.0, 0.0, -90.0, 0.0, 30.0, 0.0]).wrist_is_behind);
}
