//! All shipped profiles: readable, free of warnings, consistent.

use nalgebra::Point3;

use super::super::{Level, Profile, Severity, builtin, builtin_names, list_text, show_text};
use crate::kinematics::{ForwardKinematics, LinkParameter, ParameterId};

pub(super) fn shipped(name: &str) -> Profile {
    match Profile::parse(builtin(name).unwrap(), name) {
        Ok((profile, warnings)) => {
            assert!(warnings.is_empty(), "{}", warnings[0]);
            profile
        }
        Err(errors) => panic!("{errors}"),
    }
}

#[test]
fn shipped_profiles_parse_without_a_warning_and_are_ron() {
    let names: Vec<&str> = builtin_names().collect();
    assert!(names.is_sorted());
    for name in names {
        let profile = shipped(name);
        assert_eq!(profile.name(), name);
        assert!(profile.source().len() > 20, "{name}");
        if let Err(error) = ron::from_str::<ron::Value>(builtin(name).unwrap()) {
            panic!("{name}: {error}");
        }
    }
}

#[test]
fn shipped_profiles_have_limits_speeds_and_bodies() {
    for profile in builtin_names().map(shipped) {
        let name = profile.name();
        for range in profile.joints() {
            assert!(range.limits.is_some() && range.planning_limits.is_some() && range.max_speed.is_some(), "{name}");
        }
        let links: std::collections::BTreeSet<usize> = profile.bodies().iter().map(|body| body.link).collect();
        assert_eq!(links.len(), profile.chain().dof() + 1, "{name}: every link has a body");
        assert!(profile.floor().is_some() && profile.acceptance().position_rms.is_some(), "{name}");
    }
}

/// In the middle of the planning range the arm must be able to stand: planning starts from there.
#[test]
fn bodies_are_apart_in_a_usual_pose() {
    for (name, pose) in USUAL_POSES {
        let profile = shipped(name);
        let arm = ForwardKinematics::new(profile.chain());
        let q: Vec<f64> = pose.iter().map(|angle| f64::to_radians(*angle)).collect();
        let links = arm.base_from_links(&q);
        let placed: Vec<(usize, Point3<f64>, Point3<f64>, f64)> = profile
            .bodies()
            .iter()
            .map(|body| (body.link, links[body.link] * body.from, links[body.link] * body.to, body.radius))
            .collect();
        for (link, from, to, radius) in &placed {
            if *link > 1 {
                let lowest = from.z.min(to.z) - radius;
                assert!(lowest > profile.floor().unwrap(), "{name}: link {link} is below the floor: {lowest}");
            }
            for (other, other_from, other_to, other_radius) in &placed {
                if other > &(link + 1) {
                    let gap = distance((from, to), (other_from, other_to)) - radius - other_radius;
                    assert!(gap > 0.0, "{name}: links {link} and {other} overlap by {} mm", -1e3 * gap);
                }
            }
        }
    }
}

const USUAL_POSES: [(&str, &[f64]); 15] = [
    ("abb_irb120", &[0.0, 0.0, 0.0, 0.0, 30.0, 0.0]),
    ("abb_irb1600_6_145", &[0.0, 0.0, 0.0, 0.0, 30.0, 0.0]),
    ("epson_ls3_b401s", &[0.0, 60.0, 0.0, 0.0]),
    ("fanuc_lrmate200id", &[0.0, 0.0, 0.0, 0.0, -60.0, 0.0]),
    ("franka_panda", &[0.0, -45.0, 0.0, -135.0, 0.0, 90.0, 45.0]),
    ("kuka_iiwa14", &[0.0, 30.0, 0.0, -60.0, 0.0, 60.0, 0.0]),
    ("kuka_iiwa7", &[0.0, 30.0, 0.0, -60.0, 0.0, 60.0, 0.0]),
    ("kuka_kr6_r900", &[0.0, -90.0, 90.0, 0.0, 60.0, 0.0]),
    ("meca500", &[0.0, 0.0, 0.0, 0.0, 60.0, 0.0]),
    ("soochow", &[0.0, 0.0, 0.0, 0.0, 60.0, 0.0]),
    ("staubli_tx2_60", &[0.0, 0.0, 90.0, 0.0, 60.0, 0.0]),
    ("ur10", &[0.0, -90.0, 90.0, -90.0, -90.0, 0.0]),
    ("ur10e", &[0.0, -90.0, 90.0, -90.0, -90.0, 0.0]),
    ("ur5", &[0.0, -90.0, 90.0, -90.0, -90.0, 0.0]),
    ("ur5e", &[0.0, -90.0, 90.0, -90.0, -90.0, 0.0]),
];

/// Distance of two lines by brute force: exact enough to see an overlap.
fn distance(one: (&Point3<f64>, &Point3<f64>), other: (&Point3<f64>, &Point3<f64>)) -> f64 {
    let at = |(from, to): (&Point3<f64>, &Point3<f64>), step: u32| from + (to - from) * (f64::from(step) / 60.0);
    (0..=60)
        .flat_map(|i| (0..=60).map(move |j| (i, j)))
        .map(|(i, j)| (at(one, i) - at(other, j)).norm())
        .fold(f64::INFINITY, f64::min)
}

#[test]
fn the_papers_robot_has_the_papers_25_parameters() {
    let profile = shipped("soochow");
    let free = profile.parameters(Level::Geometric);
    assert_eq!(free.len(), 25);
    assert_eq!(free[24].id, ParameterId::Link { joint: 1, parameter: LinkParameter::Beta });
    let names: Vec<String> = free.iter().take(5).map(|parameter| parameter.id.to_string()).collect();
    assert_eq!(names, ["alpha1", "a1", "d1", "theta1", "alpha2"]);
    let expected: Vec<f64> = free.iter().take(4).map(|parameter| parameter.expected).collect();
    assert_eq!(expected, [2e-3, 1e-3, 1e-3, 10e-3]);
    assert_eq!(profile.parameters(Level::Offsets).len(), 6);
}

#[test]
fn free_targets_come_last_and_prismatic_offsets_are_lengths() {
    let scara = shipped("epson_ls3_b401s");
    let names: Vec<String> = scara.parameters(Level::Offsets).iter().map(|free| free.id.to_string()).collect();
    assert_eq!(names, ["theta1", "theta2", "d3", "theta4", "target1.x", "target1.y", "target1.z"]);
    let free = scara.parameters(Level::Geometric);
    assert_eq!(free.len(), 4 * 4 + 2 + 3);
    assert_eq!(free.last().map(|free| free.expected), Some(0.05));
    let panda = shipped("franka_panda");
    assert!(panda.parameters(Level::Offsets).iter().take(7).all(|free| free.expected.to_bits() == 5e-3_f64.to_bits()));
}

#[test]
fn texts_for_people() {
    let profiles: Vec<Profile> = builtin_names().map(shipped).collect();
    let list = list_text(&profiles);
    insta::assert_snapshot!("list", list);
    for name in ["soochow", "fanuc_lrmate200id", "epson_ls3_b401s", "franka_panda"] {
        insta::assert_snapshot!(format!("show_{name}"), show_text(&shipped(name)));
    }
    for text in profiles.iter().map(show_text).chain([list]) {
        for line in text.lines() {
            assert!(line.chars().count() <= 80 && line == line.trim_end(), "'{line}'");
        }
    }
}

#[test]
fn severity_orders_warnings_below_errors() {
    assert!(Severity::Warning < Severity::Error);
}
