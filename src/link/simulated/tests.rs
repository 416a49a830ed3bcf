//! The simulated cell does what its documentation says.

use super::*;
use crate::kinematics::{Arm, JointTerm, LinkParameter, MAX_ORDER, ParameterId, SMOOTH_ORDERS, TiltAxis};
use crate::profile::{Level, builtin};
use crate::session::set_up::PayloadText;
use crate::session::simulation::{JointErrorSizes, Truth};

fn profile(name: &str) -> Profile {
    Profile::parse(builtin(name).unwrap(), name).unwrap().0
}

fn cell(faults: &[&str]) -> SimulatedCell {
    noisy(faults, 0.0)
}

fn noisy(faults: &[&str], noise_mm: f64) -> SimulatedCell {
    let faults = faults.iter().map(|fault| fault.parse().unwrap()).collect();
    let simulation = Simulation { truth: Truth::Paper, noise_mm: Some(noise_mm), faults, ..Simulation::default() };
    SimulatedCell::new(&profile("soochow"), &simulation).unwrap()
}

/// Pose `number`; each one differs from the others.
fn configuration(number: u64) -> Vec<f64> {
    (0..6).map(|joint| (number as f64 * 0.7 + f64::from(joint) * 1.3).sin()).collect()
}

fn request(number: u64) -> MeasureRequest {
    MeasureRequest {
        number,
        pose: format!("p{number}"),
        target: 0,
        configuration: configuration(number),
        following: Some(configuration(number + 1)),
        settle: 2.0,
        shots: 1,
    }
}

fn measure(cell: &mut SimulatedCell, request: &MeasureRequest) -> Reading {
    cell.measure(request, &|| true).unwrap()
}

/// Measurements 1 to `count` of a cell.
fn points(cell: &mut SimulatedCell, count: u64) -> Vec<Point3<f64>> {
    (1..=count).map(|number| measure(cell, &request(number)).point).collect()
}

/// How far the measurements of a cell with faults are from those of one without (mm).
fn off_by_mm(faults: &[&str], count: u64) -> Vec<f64> {
    let (faulty, right) = (points(&mut cell(faults), count), points(&mut cell(&[]), count));
    faulty.iter().zip(right).map(|(faulty, right)| to_mm((faulty - right).norm())).collect()
}

/// The true point of an arm that stands somewhere.
fn standing_at(cell: &SimulatedCell, configuration: &[f64]) -> Point3<f64> {
    let truth = cell.truth();
    let point = ForwardKinematics::new(&truth.arm.chain).point_in_base(configuration, &truth.arm.targets[0]);
    truth.base_from_tracker.inverse() * point
}

fn assert_same(a: Point3<f64>, b: Point3<f64>) {
    assert!((a - b).norm() < 1e-12, "{a} is not {b}");
}

#[test]
fn distances_are_those_of_the_true_arm() {
    let mut cell = cell(&[]);
    let measured = points(&mut cell, 20);
    let truth = cell.truth().clone();
    let deviation = |joint, parameter| {
        let id = ParameterId::Link { joint, parameter };
        truth.arm.value(id).unwrap() - profile("soochow").arm().value(id).unwrap()
    };
    assert!((deviation(1, LinkParameter::Beta) - 0.155_f64.to_radians()).abs() < 1e-12);
    assert!((deviation(0, LinkParameter::A) + from_mm(3.885)).abs() < 1e-12);
    let arm = ForwardKinematics::new(&truth.arm.chain);
    let predicted: Vec<Point3<f64>> =
        (1..=20).map(|number| arm.point_in_base(&configuration(number), &truth.arm.targets[0])).collect();
    for j in 0..20 {
        for k in 0..j {
            let difference = (measured[j] - measured[k]).norm() - (predicted[j] - predicted[k]).norm();
            assert!(difference.abs() < 1e-12, "{j} {k}: {difference}");
        }
    }
    let place = truth.base_from_tracker.translation.vector - profile("soochow").tracker().position_in_base.coords;
    assert!(place.norm() < 5.0 * TRACKER_SPREAD && truth.base_from_tracker.rotation.angle() > 0.1);
}

#[test]
fn the_same_seed_gives_the_same_values_also_after_a_resume() {
    let faults = ["target-bumped@3:1mm", "outlier@5:2mm", "wrong-pose@6", "drift@1:10mm/h", "not-at-rest@7:0.3mm"];
    let all = points(&mut noisy(&faults, 0.02), 10);
    assert_eq!(all, points(&mut noisy(&faults, 0.02), 10));
    for (number, point) in (1..).zip(&all) {
        assert_eq!(measure(&mut noisy(&faults, 0.02), &request(number)).point, *point);
    }
    let mut other = noisy(&faults, 0.02);
    other.seed += 1;
    assert_ne!(all, points(&mut other, 10));
}

#[test]
fn a_fault_changes_no_other_measurement() {
    let (with, without) = (points(&mut noisy(&["outlier@5:2mm"], 0.02), 9), points(&mut noisy(&[], 0.02), 9));
    let different: Vec<usize> = (0..9).filter(|&index| with[index] != without[index]).collect();
    assert_eq!(different, [4]);
}

#[test]
fn noise_has_the_stated_sigma() {
    for shots in [1, 4] {
        let (mut noisy, mut exact) = (noisy(&[], 0.05), cell(&[]));
        let (mut square, mut scatter) = (0.0, 0.0);
        for number in 1..=3000 {
            let request = MeasureRequest { shots, ..request(number) };
            let (reading, exact) = (measure(&mut noisy, &request), measure(&mut exact, &request));
            assert_eq!(reading.sigma, Some(from_mm(0.05) / f64::from(shots).sqrt()));
            square += ((reading.point - exact.point) / reading.sigma.unwrap()).norm_squared();
            scatter += reading.scatter.map_or(0.0, |scatter| scatter.powi(2));
        }
        // 9000 values: a mean square of 1 within 0.015, one standard deviation.
        assert!((square / 9000.0 - 1.0).abs() < 0.05, "{}", square / 9000.0);
        let expected = from_mm(0.05).powi(2) * 3.0 * (1.0 - 1.0 / f64::from(shots));
        assert!((scatter / 3000.0 - expected).abs() <= 0.05 * expected, "{scatter}");
    }
    let instrument = SimulatedCell::new(&profile("soochow"), &Simulation::default()).unwrap();
    let reading = measure(&mut instrument.clone(), &request(1));
    assert!((reading.sigma.unwrap() - 10e-6).abs() < 1e-12 && reading.scatter.is_none());
    let default = SimulatedCell::new(&profile("ur5"), &Simulation::default()).unwrap();
    assert!(matches!(default.noise, Noise::Constant(_) | Noise::Instrument(_)));
}

#[test]
fn drawn_deviations_are_of_the_expected_size_and_targets_near_their_place() {
    let profile = profile("ur5e");
    let (mut square, mut count) = (0.0, 0.0);
    for seed in 0..200 {
        for (id, deviation) in truth::deviations(&profile, Truth::Drawn, seed).unwrap() {
            let free = profile.parameters(Level::Geometric);
            let expected = free.iter().find(|free| free.id == id).unwrap().expected;
            if matches!(id, ParameterId::Target { .. }) {
                assert!(deviation.abs() < from_mm(10.0) && expected > from_mm(10.0));
            } else {
                square += (deviation / expected).powi(2);
                count += 1.0;
            }
        }
    }
    assert!((square / count - 1.0_f64).abs() < 0.1, "{}", square / count);
    assert!(truth::deviations(&profile, Truth::Nominal, 1).unwrap().is_empty());
}

#[test]
fn faults_of_the_pose() {
    let mut wrong = cell(&["wrong-pose@2"]);
    assert_same(measure(&mut wrong, &request(2)).point, standing_at(&wrong, &configuration(3)));
    let last = MeasureRequest { following: None, ..request(2) };
    let elsewhere = measure(&mut wrong, &last).point;
    assert!((elsewhere - standing_at(&wrong, &configuration(2))).norm() > 0.1);
    assert_eq!(elsewhere, measure(&mut wrong, &last).point);

    let mut swapped = cell(&["swapped-rows@2"]);
    let seen = points(&mut swapped, 4);
    for (index, stands_at) in [1, 3, 2, 4].into_iter().enumerate() {
        assert_same(seen[index], standing_at(&swapped, &configuration(stands_at)));
    }
    let mut resumed = cell(&["swapped-rows@2"]);
    assert_same(measure(&mut resumed, &request(3)).point, standing_at(&resumed, &configuration(3)));

    let mut sign = cell(&["joint-sign@1:j3"]);
    let mut turned = configuration(5);
    turned[2] = -turned[2];
    assert_same(measure(&mut sign, &request(5)).point, standing_at(&sign, &turned));

    let mut mistyped = cell(&["mistyped-joint@8:j2:5deg"]);
    let mut typed = configuration(8);
    typed[1] += 5.0 * DEGREE;
    assert_same(measure(&mut mistyped, &request(8)).point, standing_at(&mistyped, &typed));
    assert_same(measure(&mut mistyped, &request(9)).point, standing_at(&mistyped, &configuration(9)));
}

#[test]
fn faults_of_target_and_instrument() {
    let near = |found: Vec<f64>, expected: &[f64]| {
        assert!(found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-9), "{found:?} is not {expected:?}");
    };
    near(off_by_mm(&["target-bumped@3:5mm"], 5), &[0.0, 0.0, 5.0, 5.0, 5.0]);
    near(off_by_mm(&["outlier@2:2mm"], 4), &[0.0, 2.0, 0.0, 0.0]);
    near(off_by_mm(&["not-at-rest@2:0.3mm"], 3), &[0.0, 0.3, 0.0]);
    let step = 0.2 * USUAL_TIME / 3600.0;
    near(off_by_mm(&["drift@2-4:0.2mm/h"], 6), &[0.0, 0.0, step, 2.0 * step, 2.0 * step, 2.0 * step]);

    let mut moving = cell(&["not-at-rest@2:0.3mm", "outlier@3:2mm"]);
    let scatter = |number| measure(&mut moving, &MeasureRequest { shots: 5, ..request(number) }).scatter.unwrap();
    let [still, moves, outlier] = [1, 2, 3].map(scatter);
    assert!(still < 1e-12 && (moves - from_mm(0.3)).abs() < 1e-9 && outlier < 1e-12);

    let right = points(&mut cell(&[]), 3);
    let (inch, metre) = (points(&mut cell(&["inch@2"]), 3), points(&mut cell(&["metre@1-2"]), 3));
    assert_same(inch[0], right[0]);
    assert_same(inch[2], Point3::from(right[2].coords / 25.4));
    assert_same(metre[1], Point3::from(right[1].coords / 1000.0));
    assert_same(metre[2], right[2]);

    let mut broken = cell(&["beam-break@2-3"]);
    let results: Vec<bool> = (1..=4).map(|number| broken.measure(&request(number), &|| true).is_ok()).collect();
    assert_eq!(results, [true, false, false, true]);
    assert_eq!(broken.measure(&request(2), &|| true), Err(LinkError::BeamBroken));
    assert_eq!(broken.measure(&request(1), &|| false), Err(LinkError::Cancelled));
}

#[test]
fn time_counts_settling_shots_and_the_way_onward() {
    let mut cell = cell(&[]);
    let mut request = MeasureRequest { following: None, shots: 3, ..request(1) };
    assert!((measure(&mut cell, &request).seconds - 5.0).abs() < 1e-12);
    let mut onward = request.configuration.clone();
    onward[0] += 30.0 * DEGREE;
    request.following = Some(onward);
    // J1 turns 150 deg/s at most.
    assert!((measure(&mut cell, &request).seconds - (5.0 + 2.0 + 1.0)).abs() < 1e-9);
}

#[test]
fn what_cannot_be_simulated_is_said() {
    let refused = |name: &str, truth, noise_mm, fault: &str| {
        let faults = if fault.is_empty() { Vec::new() } else { vec![fault.parse().unwrap()] };
        let simulation = Simulation { seed: 1, truth, noise_mm, faults, ..Simulation::default() };
        SimulatedCell::new(&profile(name), &simulation).unwrap_err().to_string()
    };
    let messages = [
        refused("ur5e", Truth::Paper, None, ""),
        refused("franka_panda", Truth::Paper, None, ""),
        refused("soochow", Truth::Paper, Some(-1.0), ""),
        refused("soochow", Truth::Paper, None, "joint-sign@1:j7"),
        refused("soochow", Truth::Paper, None, "mistyped-joint@1:j2:5mm"),
        refused("epson_ls3_b401s", Truth::Drawn, None, "mistyped-joint@1:j3:5deg"),
    ];
    insta::assert_snapshot!(messages.join("\n"), @r"
    the true deviations of the method paper belong to its arm (profile 'soochow'), not to 'ur5e': alpha1 is -90 deg in the paper and 90 in the profile; use drawn or nominal ones
    the true deviations of the method paper belong to its arm (profile 'soochow'), not to 'franka_panda': the paper's arm has six joints in the standard convention; use drawn or nominal ones
    the noise is -1 mm; it must be a number of at least 0
    fault 'joint-sign@1:j7': 'soochow' has 6 joints
    fault 'mistyped-joint@1:j2:5mm': joint J2 is in deg
    fault 'mistyped-joint@1:j3:5deg': joint J3 is in mm
    ");
    let short = MeasureRequest { configuration: vec![0.0; 3], ..request(1) };
    assert!(matches!(cell(&[]).measure(&short, &|| true), Err(LinkError::SetUp(_))));
    let other = MeasureRequest { target: 4, ..request(1) };
    assert!(matches!(cell(&[]).measure(&other, &|| true), Err(LinkError::SetUp(_))));
    let connected = noisy(&[], 0.02).connect().unwrap();
    assert_eq!(connected, "simulated cell: Soochow University six-axis arm (method paper), noise 0.02 mm, seed 1");
}

#[test]
fn joints_have_the_errors_that_are_asked_for() {
    let sizes = |curves_urad, compliance_urad, tilt_urad, harmonics_urad| {
        Some(JointErrorSizes { curves_urad, compliance_urad, tilt_urad, harmonics_urad })
    };
    let hidden = |name: &str, joint_errors, payload| {
        let simulation = Simulation { truth: Truth::Nominal, joint_errors, payload, ..Simulation::default() };
        SimulatedCell::new(&profile(name), &simulation).map(|cell| cell.truth().arm.clone())
    };
    let rigid = hidden("ur5", None, None).unwrap();
    assert_eq!(rigid, profile("ur5").arm());
    let arm = hidden("ur5", sizes(100.0, 500.0, 200.0, 300.0), None).unwrap();
    let value = |arm: &Arm, joint, term| arm.value(ParameterId::Joint { joint, term });
    let (mut curve, mut smooth) = (0.0, 0.0);
    for joint in 0..6 {
        // Gravity bends downwards. A vertical axis does not feel it, nor does the last one, which the masses are centred on.
        let compliance = value(&arm, joint, JointTerm::Compliance);
        let is_balanced = joint == 0 || joint == 5;
        assert!(if is_balanced { compliance.is_none() } else { compliance.unwrap() > 0.0 }, "{compliance:?}");
        assert!(TiltAxis::ALL.iter().all(|axis| value(&arm, joint, JointTerm::Tilt(*axis)).unwrap() > 0.0));
        for order in 1..=MAX_ORDER {
            let pair = [JointTerm::Sine(order), JointTerm::Cosine(order)].map(|term| value(&arm, joint, term).unwrap());
            let power = f64::midpoint(pair[0].powi(2), pair[1].powi(2));
            *(if order > SMOOTH_ORDERS { &mut curve } else { &mut smooth }) += power / 6.0;
        }
    }
    let [curve, smooth] = [curve, smooth].map(|power: f64| power.sqrt() / 1e-6);
    assert!((curve - 100.0).abs() < 15.0, "{curve}");
    assert!((smooth - 300.0 * 2.0_f64.sqrt()).abs() < 130.0, "{smooth}");
    // The geometry is drawn as without them, and the same joints fail alike under a payload.
    let payload = PayloadText { mass_kg: 3.0, centre_mm: (0.0, 0.0, 80.0) };
    let loaded = hidden("ur5", sizes(100.0, 500.0, 200.0, 300.0), Some(payload)).unwrap();
    assert_eq!(loaded.chain.errors(), arm.chain.errors());
    assert_eq!(loaded.chain.loads().unwrap().payload(), payload.mass());
    assert_eq!(loaded.chain.joints(), arm.chain.joints());
    let refused = |name: &str, joint_errors, payload| hidden(name, joint_errors, payload).unwrap_err().to_string();
    let messages = [
        refused("soochow", sizes(100.0, 500.0, 0.0, 0.0), None),
        refused("ur5", sizes(-1.0, 0.0, 0.0, 0.0), None),
        refused("ur5", None, Some(PayloadText { mass_kg: -2.0, ..payload })),
    ];
    insta::assert_snapshot!(messages.join("\n"), @r"
    compliance and tilt need the masses of the arm, which the profile 'soochow' does not give
    the joint errors have curves of -1 urad; they must be from 0 to 20000 urad
    a payload of -2 kg, centre (0, 0, 80) mm in the flange cannot be simulated
    ");
    // Without masses a joint can still have curves.
    assert!(hidden("soochow", sizes(100.0, 0.0, 0.0, 0.0), None).is_ok());
}
