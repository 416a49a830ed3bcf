//! The joint check on shipped arms that are a little different, with every kind of fault.

use nalgebra::{Isometry3, Point3, Vector3};
use trupose::identification::joint_check::{CheckedStop, JointCheck, JointFault, JointSeen, check_joints};
use trupose::kinematics::{ForwardKinematics, LinkParameter, ParameterId};
use trupose::procedure::joint_check::{Stop, plan};
use trupose::profile::{Profile, builtin};
use trupose::units::{DEGREE, MICROMETRE, MILLIMETRE, to_deg, to_mm};

/// A shipped arm with the reflector beside the last axis.
fn profile(name: &str) -> Profile {
    let (profile, _) = Profile::parse(builtin(name).unwrap(), name).unwrap();
    let mut target = profile.targets()[0].clone();
    let offset = &mut target.position_in_flange;
    if offset.x.hypot(offset.y) < 20.0 * MILLIMETRE {
        (offset.x, offset.y) = (40.0 * MILLIMETRE, -30.0 * MILLIMETRE);
    }
    profile.with_target(0, target)
}

/// What the tracker sees of an arm that is a little different and has faults. The reflector is 30 mm from where the profile has it.
fn measured(profile: &Profile, faults: &[JointFault]) -> Vec<CheckedStop> {
    let deviations = (1..profile.chain().dof()).flat_map(|joint| {
        let sign = if joint % 2 == 0 { 1.0 } else { -1.0 };
        let id = |parameter| ParameterId::Link { joint, parameter };
        [(id(LinkParameter::Theta), sign * 0.2 * DEGREE), (id(LinkParameter::A), sign * 0.4 * MILLIMETRE)]
    });
    let real = profile.arm().with(deviations).unwrap().chain;
    let forward = ForwardKinematics::new(&real);
    let target = profile.targets()[0].position_in_flange + Vector3::new(0.02, -0.02, 0.01);
    let base_from_tracker = Isometry3::new(Vector3::new(2.5, -1.0, 0.6), Vector3::new(0.2, -0.1, 2.0));
    let is_mirrored = faults.contains(&JointFault::Mirrored);
    let seen = |(index, stop): (usize, Stop)| {
        let mut q = stop.configuration.clone();
        for fault in faults {
            fault.correct(&stop.configuration, &mut q);
        }
        let noise = |phase: f64| 20.0 * MICROMETRE * (7.3 * index as f64 + phase).sin();
        let point = base_from_tracker.inverse() * forward.point_in_base(&q, &target);
        let point = point + Vector3::new(noise(0.0), noise(2.0), noise(4.0));
        let point = if is_mirrored { Point3::new(-point.x, point.y, point.z) } else { point };
        CheckedStop { joint: stop.joint, configuration: stop.configuration, point }
    };
    plan(profile).unwrap().into_iter().enumerate().map(seen).collect()
}

fn checked(profile: &Profile, faults: &[JointFault]) -> JointCheck {
    let target = profile.targets()[0].position_in_flange;
    let stops = measured(profile, faults);
    check_joints(profile.chain(), &stops, (target, 50.0 * MILLIMETRE), 20.0 * MICROMETRE).unwrap()
}

const ARMS: [&str; 5] = ["soochow", "ur10e", "kuka_kr6_r900", "fanuc_lrmate200id", "abb_irb120"];

#[test]
fn an_arm_as_its_profile_says_passes_and_shows_its_reflector() {
    for name in ARMS {
        let profile = profile(name);
        let check = checked(&profile, &[]);
        assert_eq!(check.faults, [], "{name}");
        assert!(!check.is_unexplained, "{name}: {} mm", to_mm(check.rms));
        assert!(check.joints.iter().all(JointSeen::is_right), "{name}: {:?}", check.joints);
        assert!(check.joints.iter().all(|joint| joint.seen.is_some()), "{name}: {:?}", check.joints);
        let real = profile.targets()[0].position_in_flange + Vector3::new(0.02, -0.02, 0.01);
        let off = check.point_in_flange - real;
        assert!(off.norm() < 5.0 * MILLIMETRE, "{name}: {} mm", to_mm(off.norm()));
    }
}

#[test]
fn a_reversed_joint_is_found_whichever_it_is() {
    for name in ARMS {
        let profile = profile(name);
        for joint in 0..profile.chain().dof() {
            let fault = JointFault::Reversed { joint };
            assert_eq!(checked(&profile, &[fault]).faults, [fault], "{name}");
        }
    }
}

#[test]
fn couplings_and_units_are_found() {
    for name in ARMS {
        let profile = profile(name);
        for joint in 1..profile.chain().dof() {
            let coupled = JointFault::Coupled { joint, with: joint - 1, factor: 1.0 };
            assert_eq!(checked(&profile, &[coupled]).faults, [coupled], "{name}");
            let unit = JointFault::Unit { joint, factor: DEGREE };
            let check = checked(&profile, &[unit]);
            assert_eq!(check.faults, [unit], "{name}");
        }
    }
}

#[test]
fn several_faults_at_once_and_a_mirrored_frame_are_found() {
    let profile = profile("soochow");
    let both = [JointFault::Reversed { joint: 1 }, JointFault::Reversed { joint: 4 }];
    let mut found = checked(&profile, &both).faults;
    found.sort_by_key(JointFault::joint);
    assert_eq!(found, both);
    assert_eq!(checked(&profile, &[JointFault::Mirrored]).faults, [JointFault::Mirrored]);
}

#[test]
fn a_zero_that_is_elsewhere_is_found_with_its_size() {
    for name in ARMS {
        let profile = profile(name);
        for joint in 1..profile.chain().dof() - 1 {
            for offset in [15.0 * DEGREE, -90.0 * DEGREE] {
                let check = checked(&profile, &[JointFault::Zero { joint, offset }]);
                let [JointFault::Zero { joint: found, offset: size }] = check.faults[..] else {
                    panic!("{name}, joint {joint} by {}: {:?}", to_deg(offset), check.faults)
                };
                assert_eq!(found, joint, "{name}");
                assert!((size - offset).abs() < 3.0 * DEGREE, "{name}, joint {joint}: {}", to_deg(size));
            }
        }
    }
}
