//! A file with every field: values arrive in metre and radian, and defaults are those of the documentation.

use nalgebra::{Point3, Vector3};

use super::super::{Level, Masses, Profile, Severity, Tracker, check_text, show_text};
use crate::kinematics::{Convention, ForwardKinematics, JointType, LinkParameter, ParameterId};

const EVERYTHING: &str = r#"(
    schema: 1, name: "all", title: "All fields", source: "made up for a test", convention: Modified,
    base: (xyz_mm: (100.0, 0.0, 0.0), rpy_deg: (0.0, 0.0, 90.0)),
    controller_world: (xyz_mm: (0.0, 0.0, 375.0)),
    joints: [
        (name: "A", type: Revolute, alpha_deg: 0.0, a_mm: 0.0, d_mm: 200.0, theta_deg: 0.0,
            direction: -1, limits_deg: (-90.0, 90.0), planning_limits_deg: (-45.0, 60.0),
            max_speed_deg_s: 180.0, pulses_per_degree: -1024.0, aliases: ["joint_1", "joint_a1"], mass_kg: 12.5, centre_mm: (10.0, -20.0, 30.0)),
        (name: "B", type: Revolute, alpha_deg: 0.0, a_mm: 300.0, d_mm: 0.0, theta_deg: 0.0, beta_deg: 0.5,
            limits_deg: (-90.0, 90.0), coupling: {"A": 0.5}, mass_kg: 4.0, centre_mm: (-150.0, 0.0, 0.0)),
        (name: "C", type: Prismatic, alpha_deg: 90.0, a_mm: 0.0, d_mm: 50.0, theta_deg: 0.0,
            limits_mm: (0.0, 400.0), max_speed_mm_s: 500.0, mass_kg: 2.0, centre_mm: (0.0, 0.0, -100.0)),
    ],
    flange: (xyz_mm: (0.0, 0.0, 10.0)),
    targets: [
        (name: "one", position_mm: (1.0, 2.0, 3.0), axis_in_flange: (0.0, 2.0, 0.0)),
        (name: "two", position_mm: (4.0, 5.0, 6.0), uncertainty_mm: 0.0),
    ],
    payload: (mass_kg: 3.0, centre_mm: (0.0, 5.0, 60.0)),
    gravity_in_base: (0.0, 3.0, -4.0),
    fixed: ["theta1", "target1.z", "d1"],
    expected_deviations: (length_mm: 0.5, angle_mrad: 3.0, joint_offset_mrad: 20.0, prismatic_offset_mm: 2.0,
        parameters_mm: {"a2": 4.0, "target1.x": 7.0}, parameters_mrad: {"beta2": 0.1}),
    acceptance: (position_max_mm: 1.5, distance_rms_mm: 0.25),
    instrument: (name: "tracker", sigma_um: 15.0, sigma_um_per_m: 6.0),
    link: (address: "emscon:192.168.0.2", options: "(measure_ms: 2000)", robot: "rtde:192.168.0.10", automatic: true),
    tracker: (position_mm: (0.0, 2500.0, 500.0), acceptance_angle_deg: 45.0, range_mm: (1000.0, 9000.0)),
    bodies: [(link: 3, from_mm: (0.0, 0.0, 0.0), to_mm: (0.0, 0.0, 100.0), radius_mm: 40.0)],
    floor_mm: -20.0,
    keep_out: [(name: "table", min_mm: (0.0, 0.0, 0.0), max_mm: (100.0, 200.0, 300.0))],
)"#;

fn everything() -> Profile {
    let (profile, warnings) = Profile::parse(EVERYTHING, "all.ron").unwrap();
    assert!(warnings.is_empty(), "{}", warnings[0]);
    profile
}

fn near(found: f64, expected: f64) -> bool {
    (found - expected).abs() < 1e-12
}

#[test]
fn geometry_arrives_in_metre_and_radian() {
    let profile = everything();
    let chain = profile.chain();
    assert_eq!(chain.convention(), Convention::Modified);
    assert_eq!(chain.joints()[2].joint_type, JointType::Prismatic);
    assert_eq!(chain.joints()[1].coupling, [0.5, 0.0, 0.0]);
    assert_eq!(profile.beta_joints(), [1]);
    assert!(near(chain.joints()[1].link.beta, 0.5_f64.to_radians()) && near(chain.joints()[1].link.a, 0.3));
    assert!(near(chain.joints()[0].direction, -1.0));
    // The base turns x to y; the second axis is 300 mm out, the first one 200 mm high.
    let links = ForwardKinematics::new(chain).base_from_links(&[0.0, 0.0, 0.0]);
    assert!((links[2].translation.vector - Vector3::new(0.1, 0.3, 0.2)).norm() < 1e-12);
    assert!((chain.flange().translation.vector - Vector3::new(0.0, 0.0, 0.01)).norm() < 1e-12);
}

#[test]
fn ranges_follow_the_type_of_the_joint() {
    let profile = everything();
    let [a, b, c] = profile.joints() else { panic!("three joints") };
    let (low, high) = a.planning_limits.unwrap();
    assert!(near(low, -45.0_f64.to_radians()) && near(high, 60.0_f64.to_radians()));
    assert!(near(a.max_speed.unwrap(), std::f64::consts::PI) && near(a.pulses_per_degree.unwrap(), -1024.0));
    assert_eq!(b.planning_limits, b.limits);
    assert_eq!((b.max_speed, b.pulses_per_degree), (None, None));
    assert!(near(c.limits.unwrap().1, 0.4) && near(c.max_speed.unwrap(), 0.5));
}

#[test]
fn names_and_origin_of_other_programs() {
    let profile = everything();
    assert_eq!(profile.joint_aliases()[0], ["joint_1", "joint_a1"]);
    assert!(profile.joint_aliases()[1].is_empty());
    assert!(near(profile.base_from_world().translation.z, 0.375));
}

#[test]
fn targets_expected_deviations_and_fixed_parameters() {
    let profile = everything();
    let [one, two] = profile.targets() else { panic!("two targets") };
    assert!(one.is_free() && near(one.uncertainty, 0.05) && !two.is_free());
    assert_eq!((one.axis_in_flange, two.axis_in_flange), (Vector3::y_axis(), Vector3::z_axis()));
    let free = profile.parameters(Level::Geometric);
    let names: Vec<String> = free.iter().map(|free| free.id.to_string()).collect();
    assert_eq!(names.join(" "), "alpha1 a1 alpha2 a2 d2 theta2 alpha3 a3 d3 theta3 beta2 target1.x target1.y");
    let of = |name: &str| free.iter().find(|free| free.id.to_string() == name).unwrap().expected;
    for (name, expected) in [
        ("alpha1", 3e-3),
        ("a1", 0.5e-3),
        ("a2", 4e-3),
        ("theta2", 20e-3),
        ("d3", 2e-3),
        ("theta3", 3e-3),
        ("beta2", 0.1e-3),
        ("target1.x", 7e-3),
        ("target1.y", 50e-3),
    ] {
        assert!(near(of(name), expected), "{name}: {}", of(name));
    }
    let offsets: Vec<ParameterId> = profile.parameters(Level::Offsets).iter().map(|free| free.id).collect();
    assert_eq!(offsets[0], ParameterId::Link { joint: 1, parameter: LinkParameter::Theta });
    assert_eq!(offsets[1], ParameterId::Link { joint: 2, parameter: LinkParameter::D });
    assert_eq!(offsets.len(), 4);
}

#[test]
fn masses_arrive_in_kilogram_and_metre() {
    let profile = everything();
    let loads = profile.chain().loads().unwrap();
    let Masses::Links(links) = profile.masses() else { panic!("{:?}", profile.masses()) };
    assert_eq!(loads.links(), links);
    assert!(near(links[0].mass, 12.5) && (links[0].centre - Point3::new(0.01, -0.02, 0.03)).norm() < 1e-12);
    assert_eq!(profile.payload(), Some(loads.payload()));
    assert!(near(loads.payload().mass, 3.0) && near(loads.payload().centre.z, 0.06));
    assert!((profile.mounting().down() - Vector3::new(0.0, 0.6, -0.8)).norm() < 1e-12);
    // A sliding joint has no limits of a turn: the loads are taken within its own.
    assert!(loads.largest_torque(0) > 1.0);
    for (mounting, down) in
        [("mounting: Floor", -Vector3::z()), ("mounting: Ceiling", Vector3::z()), ("mounting: Wall", Vector3::x())]
    {
        let text = EVERYTHING.replace("gravity_in_base: (0.0, 3.0, -4.0)", mounting);
        assert_eq!(Profile::parse(&text, "all.ron").unwrap().0.mounting().down(), down);
    }
    let split = EVERYTHING.replace(", mass_kg: 12.5, centre_mm: (10.0, -20.0, 30.0)", "");
    let (partial, warnings) = Profile::parse(&split, "all.ron").unwrap();
    assert_eq!(warnings.len(), 1, "{warnings:?}");
    let Masses::Links(links) = partial.masses() else { panic!("{:?}", partial.masses()) };
    assert!(near(links[0].mass, 0.0) && near(links[1].mass, 4.0));
}

#[test]
fn cell_and_limits() {
    let profile = everything();
    let acceptance = profile.acceptance();
    assert!(near(acceptance.position_max.unwrap(), 1.5e-3) && near(acceptance.distance_rms.unwrap(), 0.25e-3));
    assert_eq!((acceptance.position_mean, acceptance.distance_max), (None, None));
    assert!(near(profile.instrument().unwrap().sigma_at(5.0), 45e-6));
    let tracker = profile.tracker();
    assert!((tracker.position_in_base - Point3::new(0.0, 2.5, 0.5)).norm() < 1e-12);
    assert!(near(tracker.acceptance_angle, 45.0_f64.to_radians()) && near(tracker.range.1, 9.0));
    assert!(near(profile.bodies()[0].radius, 0.04) && profile.bodies()[0].link == 3);
    assert!(near(profile.floor().unwrap(), -0.02));
    assert!((profile.keep_out()[0].max - Point3::new(0.1, 0.2, 0.3)).norm() < 1e-12);
    insta::assert_snapshot!("show_all", show_text(&profile));
}

#[test]
fn what_is_left_out_has_the_documented_default() {
    let text = r#"(schema: 1, name: "x", title: "x", source: "x", convention: Standard, joints: [
        (name: "A", type: Revolute, alpha_deg: 90.0, a_mm: 0.0, d_mm: 0.0, theta_deg: 0.0)])"#;
    let outcome = Profile::parse(text, "x.ron");
    // Beside the two of reading: bodies, instrument, acceptance and tracker are not stated, and the SMR is on the last axis.
    assert!(check_text("x.ron", &outcome).ends_with("x.ron: profile 'x' can be used: 0 errors, 7 warnings\n"));
    let (profile, warnings) = outcome.unwrap();
    assert!(warnings.iter().all(|warning| warning.severity == Severity::Warning));
    assert_eq!(*profile.tracker(), Tracker::default());
    assert_eq!((profile.floor(), profile.instrument(), profile.bodies().len()), (Some(0.0), None, 0));
    assert_eq!(profile.targets().len(), 1);
    assert!(profile.targets()[0].is_free());
    assert_eq!(profile.parameters(Level::Geometric).len(), 4 + 3);
    let joint = profile.joints()[0];
    assert_eq!((joint.limits, joint.planning_limits, joint.max_speed), (None, None, None));
}

/// Hayati's β belongs to the link between the parallel axes: in Craig's form that is the second one.
#[test]
fn beta_is_proposed_on_the_right_link() {
    let without = EVERYTHING.replace(", beta_deg: 0.5", "").replace("\"beta2\": 0.1", "");
    let (_, warnings) = Profile::parse(&without, "all.ron").unwrap();
    assert_eq!(warnings.len(), 1);
    assert_eq!(warnings[0].message, "the axes of 'A' and 'B' are parallel, but 'B' has no 'beta_deg'");
}

#[test]
fn the_link_of_the_cell_arrives_with_its_addresses_in_full() {
    let profile = everything();
    let link = profile.link().unwrap();
    assert_eq!(link.address.to_string(), "emscon:tcp:192.168.0.2:700");
    assert_eq!(link.options.as_deref(), Some("(measure_ms: 2000)"));
    assert_eq!(link.robot.as_ref().unwrap().to_string(), "rtde:tcp:192.168.0.10:30004");
    assert!(link.is_automatic);
    // What is shown can be written into a profile again.
    let shown = EVERYTHING.replace("emscon:192.168.0.2", &link.address.to_string());
    assert_eq!(Profile::parse(&shown, "all.ron").unwrap().0, profile);
    let text = show_text(&profile);
    assert!(text.contains("link: emscon:tcp:192.168.0.2:700, robot at rtde:tcp:192.168.0.10:30004"), "{text}");
}

/// What a joint can turn beyond half a turn is for cables to decide, and an arm must not be planned below its own base.
#[test]
#[expect(clippy::float_cmp, reason = "rounded to whole degrees")]
fn plans_stay_within_half_a_turn_and_above_the_floor_unless_stated() {
    let of = |joint: &str, more: &str| {
        let text = format!(
            r#"(schema: 1, name: "x", title: "x", source: "x", convention: Standard, joints: [
            (name: "A", type: Revolute, alpha_deg: 90.0, a_mm: 0.0, d_mm: 0.0, theta_deg: 0.0, {joint})], {more})"#
        );
        Profile::parse(&text, "x.ron").unwrap().0
    };
    let planning = |joint: &str| {
        let (low, high) = of(joint, "").joints()[0].planning_limits.unwrap();
        [low, high].map(|limit| limit.to_degrees().round())
    };
    assert_eq!(planning("limits_deg: (-400.0, 400.0)"), [-180.0, 180.0]);
    assert_eq!(planning("limits_deg: (-90.0, 270.0)"), [-90.0, 180.0]);
    assert_eq!(planning("limits_deg: (-120.0, 120.0)"), [-120.0, 120.0]);
    assert_eq!(planning("limits_deg: (200.0, 300.0)"), [200.0, 300.0]);
    assert_eq!(planning("limits_deg: (-400.0, 400.0), planning_limits_deg: (-200.0, 400.0)"), [-200.0, 400.0]);
    let limits = "limits_deg: (-90.0, 90.0)";
    assert_eq!(of(limits, "").floor(), Some(0.0));
    assert_eq!(of(limits, "floor_mm: None").floor(), None);
    assert_eq!(of(limits, "mounting: Ceiling").floor(), None);
    let turning = of("limits_deg: (-400.0, 400.0)", "").gaps();
    assert_eq!(turning[0].message, "A turns beyond 180 deg without 'planning_limits_deg'");
}
