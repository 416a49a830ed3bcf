//! Gravity on the joints, and the errors of joints that follow from it, for every shipped robot.

use std::f64::consts::{FRAC_PI_2, PI};

use crate::support::derivatives::assert_derivatives;
use crate::support::paper_case::seeded;
use nalgebra::{Isometry3, Point3, Translation3, Unit, UnitQuaternion, Vector3};
use rand::RngExt as _;
use rand_chacha::ChaCha8Rng;
use trupose::kinematics::{
    Arm, Convention, ForwardKinematics, GRAVITY, JointTerm, JointType, KinematicChain, LinkMass, Loads, ParameterId,
    Place,
};
use trupose::profile::{Masses, Mounting, Profile, builtin, builtin_names};

fn profile(name: &str) -> Profile {
    Profile::parse(builtin(name).unwrap(), name).unwrap().0
}

fn shipped() -> Vec<Profile> {
    builtin_names().map(profile).collect()
}

fn random_point(rng: &mut ChaCha8Rng) -> Point3<f64> {
    Point3::from([0; 3].map(|_| rng.random_range(-0.3..0.3)))
}

fn random_configuration(chain: &KinematicChain, rng: &mut ChaCha8Rng) -> Vec<f64> {
    let range = |joint_type| if joint_type == JointType::Revolute { PI } else { 0.3 };
    chain.joints().iter().map(|joint| rng.random_range(-1.0..1.0) * range(joint.joint_type)).collect()
}

/// The arm with random masses, payload and mounting.
fn loaded(chain: &KinematicChain, down: Vector3<f64>, rng: &mut ChaCha8Rng) -> KinematicChain {
    let mut mass = |_| LinkMass { mass: rng.random_range(0.5..20.0), centre: random_point(rng) };
    let links: Vec<LinkMass> = (0..chain.dof()).map(&mut mass).collect();
    let payload = mass(0);
    let ranges = vec![(-PI, PI); chain.dof()];
    chain.clone().with_loads(Loads::new(chain, links, payload, down, &ranges))
}

fn mountings(rng: &mut ChaCha8Rng) -> [Vector3<f64>; 4] {
    let leaning = Mounting::Gravity(Unit::new_normalize(random_point(rng).coords));
    [Mounting::Floor, Mounting::Wall, Mounting::Ceiling, leaning].map(Mounting::down)
}

/// Every term that the joints of this arm can have.
fn terms(chain: &KinematicChain) -> Vec<ParameterId> {
    let all = (0..chain.dof()).flat_map(|joint| JointTerm::all().map(move |term| (joint, term)));
    all.filter(|(joint, term)| chain.has_term(*joint, *term))
        .map(|(joint, term)| ParameterId::Joint { joint, term })
        .collect()
}

/// Every column, of links and of joints, with errors of all groups at once.
#[test]
fn derivatives_by_the_terms_of_joints_match_difference_quotients() {
    let mut rng = seeded(11);
    for profile in shipped() {
        let compliant = |ids: &[ParameterId], joint: usize| {
            ids.contains(&ParameterId::Joint { joint, term: JointTerm::Compliance })
        };
        for down in mountings(&mut rng) {
            let chain = loaded(profile.chain(), down, &mut rng);
            let mut ids = terms(&chain);
            for (joint, of) in chain.joints().iter().enumerate() {
                let vertical_first = joint == 0 && down.x == 0.0 && down.y == 0.0;
                let expected = of.joint_type == JointType::Revolute && !vertical_first;
                let is_scara = chain.joints().iter().any(|joint| joint.joint_type == JointType::Prismatic);
                assert!(is_scara || compliant(&ids, joint) == expected, "{} joint {joint}", profile.name());
            }
            ids.extend(ParameterId::all(chain.dof(), 1));
            let deviations: Vec<_> = ids.iter().map(|id| (*id, rng.random_range(-0.01..0.01))).collect();
            let target = Point3::new(0.03, -0.02, 0.09);
            let arm = Arm { chain, targets: vec![target] }.with(deviations).unwrap();
            let place = Place { configuration: random_configuration(&arm.chain, &mut rng), target: 0 };
            assert_derivatives(profile.name(), &arm, &ids, &place);
        }
    }
}

/// Masses as points in the base, each with the joint whose link carries it.
fn points(chain: &KinematicChain, q: &[f64]) -> Vec<(usize, f64, Point3<f64>)> {
    let loads = chain.loads().unwrap();
    let frames = ForwardKinematics::new(chain).base_from_links(q);
    let links = loads.links().iter().enumerate();
    let mut points: Vec<_> = links.map(|(joint, link)| (joint, link.mass, frames[joint + 1] * link.centre)).collect();
    let payload = loads.payload();
    points.push((chain.dof() - 1, payload.mass, frames[chain.dof() + 1] * payload.centre));
    points
}

/// The frame of a joint before its own rotation.
fn joint_frame(chain: &KinematicChain, joint: usize, q: &[f64]) -> Isometry3<f64> {
    let frames = ForwardKinematics::new(chain).base_from_links(q);
    let of = &chain.joints()[joint];
    let variable = of.variable(joint, q);
    let (theta, d) = match of.joint_type {
        JointType::Revolute => (of.link.theta + variable, of.link.d),
        JointType::Prismatic => (of.link.theta, of.link.d + variable),
    };
    match chain.convention() {
        Convention::Standard => frames[joint],
        Convention::Modified => {
            let screw = Isometry3::from_parts(
                Translation3::new(0.0, 0.0, d),
                UnitQuaternion::from_axis_angle(&Vector3::z_axis(), theta),
            );
            frames[joint + 1] * screw.inverse()
        }
    }
}

/// The work that gravity does when all beyond a joint turns about an axis of its frame is the moment times the angle.
#[test]
fn gravity_torques_are_derivatives_of_the_potential_energy() {
    let mut rng = seeded(12);
    for profile in shipped() {
        for down in mountings(&mut rng) {
            let chain = loaded(profile.chain(), down, &mut rng);
            let q = random_configuration(&chain, &mut rng);
            let loads = chain.loads().unwrap().at(&q);
            for (joint, load) in loads.iter().enumerate() {
                let frame = joint_frame(&chain, joint, &q);
                let work = |axis: &Unit<Vector3<f64>>, angle: f64| -> f64 {
                    let turn = frame * UnitQuaternion::from_axis_angle(axis, angle) * frame.inverse();
                    let beyond = points(&chain, &q).into_iter().filter(|(of, ..)| *of >= joint);
                    beyond.map(|(_, mass, point)| mass * GRAVITY * down.dot(&(turn * point).coords)).sum()
                };
                let found = [load.moment[0], load.moment[1], load.torque];
                for (axis, found) in [Vector3::x_axis(), Vector3::y_axis(), Vector3::z_axis()].iter().zip(found) {
                    let quotient = (work(axis, 1e-4) - work(axis, -1e-4)) / 2e-4;
                    assert!((quotient - found).abs() < 1e-4, "{} {joint}: {quotient} {found}", profile.name());
                }
                // The same by the joint offset, through the forward kinematics of the arm itself.
                if chain.joints()[joint].joint_type == JointType::Revolute {
                    let theta: ParameterId = format!("theta{}", joint + 1).parse().unwrap();
                    let at = |step: f64| -> f64 {
                        let turned = Arm::from(chain.clone()).with([(theta, step)]).unwrap();
                        let all = points(&turned.chain, &q).into_iter();
                        all.map(|(_, mass, point)| mass * GRAVITY * down.dot(&point.coords)).sum()
                    };
                    let quotient = (at(1e-4) - at(-1e-4)) / 2e-4;
                    assert!((quotient - load.torque).abs() < 1e-4, "{} {joint}", profile.name());
                }
            }
        }
    }
}

/// Torques computed by hand from the tables that the masses came from.
#[test]
fn published_masses_are_in_the_frames_of_their_source() {
    let torque = |name: &str, joint: usize, q: &[f64]| profile(name).chain().loads().unwrap().at(q)[joint].torque;
    // Universal Robots at zero: stretched out along -x, so the torque of the shoulder is mass times distance.
    for (name, a2, a3, [m2, m3, wrist], [x2, x3]) in [
        ("ur5", 0.425, 0.39225, [8.393, 2.33, 1.219 + 1.219 + 0.1879], [0.2125, 0.15]),
        ("ur5e", 0.425, 0.3922, [8.058, 2.846, 1.37 + 1.3 + 0.365], [0.2125, 0.15]),
        ("ur10", 0.612, 0.5723, [12.7, 4.27, 2.0 + 2.0 + 0.365], [0.38, 0.24]),
        ("ur10e", 0.6127, 0.57155, [13.051, 3.989, 2.1 + 1.98 + 0.615], [0.38, 0.24]),
    ] {
        let elbow = GRAVITY * (m3 * (a3 - x3) + wrist * a3);
        let shoulder = GRAVITY * (m2 * (a2 - x2) + (m3 + wrist) * a2) + elbow;
        let q = [0.0; 6];
        assert!((torque(name, 1, &q) - shoulder).abs() < 1e-9, "{name}");
        assert!((torque(name, 2, &q) - elbow).abs() < 1e-9, "{name}");
        assert!(torque(name, 0, &q).abs() < 1e-12, "{name}");
    }
    // LBR iiwa: heights of the centres above the shoulder, the arm laid down by its second joint.
    let iiwa14 = [(6.35, 0.419), (3.5, 0.6945), (3.5, 0.847), (3.5, 1.0405), (1.8, 1.1806), (1.2, 1.281)];
    let iiwa7 = [(2.7258, 0.4073), (3.175, 0.651), (2.73, 0.807), (1.69, 1.0), (1.8, 1.1421), (0.4, 1.2494)];
    for (name, shoulder, links) in [("kuka_iiwa14", 0.36, iiwa14), ("kuka_iiwa7", 0.34, iiwa7)] {
        let expected: f64 = links.iter().map(|(mass, height)| GRAVITY * mass * (height - shoulder)).sum();
        let found = torque(name, 1, &[0.0, FRAC_PI_2, 0.0, 0.0, 0.0, 0.0, 0.0]);
        assert!((found.abs() - expected).abs() < 1e-6 * expected, "{name}: {found} {expected}");
    }
    // Panda: centres along the stretched arm, seen from the shoulder, for the arm laid down with its elbow straight.
    let panda = [
        (0.646_926, 0.02872),
        (3.228_604, 0.316 - 0.066_502),
        (3.587_895, 0.316 + 0.104_419),
        (1.225_946, 0.7 - 0.038_437),
        (1.666_555, 0.7 - 0.014_117),
        (0.735_522, 0.7 - 0.061_597),
    ];
    let expected: f64 = panda.iter().map(|(mass, distance)| GRAVITY * mass * distance).sum();
    let found = torque("franka_panda", 1, &[0.0, FRAC_PI_2, 0.0, 0.0, 0.0, 0.0, 0.0]);
    assert!((found.abs() - expected).abs() < 1e-6 * expected, "{found} {expected}");
}

/// The split is rough by nature: compliance needs the shape of the torque, not its size.
#[test]
fn a_split_weight_is_like_the_published_masses() {
    let mut rng = seeded(13);
    for (name, weight) in [("ur5", 18.4), ("ur5e", 20.6), ("ur10", 28.9), ("ur10e", 33.5)] {
        let profile = profile(name);
        let chain = profile.chain();
        let links = chain.split_weight(weight);
        let moved: f64 = links.iter().map(|link| link.mass).sum();
        assert!(moved > 0.8 * weight && moved < weight, "{name}: {moved} of {weight} kg");
        let ranges: Vec<(f64, f64)> = profile.joints().iter().map(|range| range.limits.unwrap()).collect();
        let split = Loads::new(chain, links, LinkMass::default(), -Vector3::z(), &ranges);
        for joint in [1, 2] {
            let (mut product, mut squares) = (0.0, [0.0; 2]);
            for _ in 0..500 {
                let q = random_configuration(chain, &mut rng);
                let [own, rough] = [chain.loads().unwrap(), &split].map(|loads| loads.at(&q)[joint].torque);
                product += own * rough;
                squares = [squares[0] + own * own, squares[1] + rough * rough];
            }
            let alike = product / (squares[0] * squares[1]).sqrt();
            let size = (squares[1] / squares[0]).sqrt().ln();
            assert!(alike > 0.97 && size.abs() < 0.5, "{name} joint {joint}: {alike} {size}");
        }
    }
}

#[test]
fn a_payload_changes_the_torque_and_not_what_coefficients_mean() {
    let profile = profile("ur5").with_payload(LinkMass { mass: 2.0, centre: Point3::new(0.0, 0.0, 0.05) });
    let compliance = ParameterId::Joint { joint: 1, term: JointTerm::Compliance };
    let identified = profile.arm().with([(compliance, 1e-3)]).unwrap();
    let heavy = LinkMass { mass: 5.0, centre: Point3::new(0.0, 0.0, 0.1) };
    let loaded = identified.clone().with_payload(heavy);
    let [before, after] = [&identified, &loaded].map(|arm| arm.chain.loads().unwrap());
    assert_eq!(before.scale(), after.scale());
    assert_eq!((before.payload().mass, after.payload().mass), (2.0, 5.0));
    // The joint turns by 1 mrad where its torque is that of the identification at its largest.
    let q = [0.3, -0.4, 0.5, 0.1, 0.2, 0.3];
    for arm in [&identified, &loaded] {
        let loads = arm.chain.loads().unwrap();
        let angle = 1e-3 * loads.at(&q)[1].torque / before.largest_torque(1);
        let turned = [q[0], q[1] + angle, q[2], q[3], q[4], q[5]];
        let rigid = ForwardKinematics::new(profile.chain()).base_from_flange(&turned);
        let soft = ForwardKinematics::new(&arm.chain).base_from_flange(&q);
        assert!((rigid.translation.vector - soft.translation.vector).norm() < 1e-12);
    }
    assert!(after.at(&q)[1].torque.abs() > 1.2 * before.at(&q)[1].torque.abs());
    // A profile with that payload is one to identify at: its scale is its own.
    let other = profile.with_payload(heavy);
    assert!(other.chain().loads().unwrap().largest_torque(1) > 1.1 * before.largest_torque(1));
    // A scale that was written down is taken as it is.
    let scale = before.scale().clone();
    assert_eq!(other.chain().loads().unwrap().with_scale(scale.clone()).scale(), &scale);
    // Without masses there is nothing to load.
    let soochow = self::profile("soochow");
    assert_eq!((soochow.masses(), soochow.chain().loads()), (&Masses::Unknown, None));
    assert_eq!(soochow.chain().clone().with_payload(heavy), *soochow.chain());
}
