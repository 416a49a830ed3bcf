//! The link constants of a whole arm from circles, measured on the simulated cell.

use std::fs;
use std::path::Path;

use crate::support::trupose_in;
use nalgebra::Point3;
use trupose::identification::circle_point::{MeasuredArm, Template, measure_arm};
use trupose::kinematics::{ForwardKinematics, JointType, LinkParameter, ParameterId};
use trupose::link::{Link as _, SimulatedCell};
use trupose::profile::{Profile, builtin};
use trupose::session::reading::MeasureRequest;
use trupose::session::simulation::{Simulation, Truth};
use trupose::units::{from_deg, from_mm};

const POINTS: usize = 10;
const NOISE_MM: f64 = 0.01;

/// Rows in which each joint moves in turn: 90° to 150° about a bent posture, slides 100 mm, within the limits.
fn configurations(profile: &Profile) -> Vec<Vec<f64>> {
    let joints = profile.chain().joints();
    let usual = |index: usize| profile.joints()[index].limits.unwrap_or((-3.0, 3.0));
    let posture: Vec<f64> = (0..joints.len())
        .map(|index| {
            let (low, high) = usual(index);
            f64::midpoint(low, high) + 0.1 * (high - low) * [0.3, -0.5, 0.4, 0.7, 0.9, -0.6, 0.2][index]
        })
        .collect();
    let mut rows = Vec::new();
    for (joint, at) in posture.iter().enumerate() {
        let reach = match joints[joint].joint_type {
            JointType::Revolute => from_deg(60.0),
            JointType::Prismatic => from_mm(50.0),
        };
        let (low, high) = usual(joint);
        for step in 0..POINTS {
            let part = 2.0 * step as f64 / (POINTS - 1) as f64 - 1.0;
            let mut row = posture.clone();
            row[joint] = (at + reach * part).clamp(low, high);
            rows.push(row);
        }
    }
    rows
}

/// A profile whose SMR is beside the last axis, so that it goes round every axis.
fn profile(name: &str) -> Profile {
    let (profile, _) = Profile::parse(builtin(name).unwrap(), name).unwrap();
    let mut target = profile.targets()[0].clone();
    target.position_in_flange = Point3::new(0.06, 0.01, 0.04);
    target.uncertainty = 1e-3;
    profile.with_target(0, target)
}

struct Case {
    template: Template,
    rows: Vec<Vec<f64>>,
    exact: Vec<Point3<f64>>,
    measured: Vec<Point3<f64>>,
    truth: SimulatedCell,
}

fn case(name: &str, seed: u64) -> Case {
    let profile = profile(name);
    let simulation = Simulation { seed, truth: Truth::Drawn, noise_mm: Some(NOISE_MM), ..Simulation::default() };
    let mut cell = SimulatedCell::new(&profile, &simulation).unwrap();
    let rows = configurations(&profile);
    let mut measured = Vec::new();
    for (index, row) in rows.iter().enumerate() {
        let request = MeasureRequest {
            number: index as u64 + 1,
            pose: index.to_string(),
            target: 0,
            configuration: row.clone(),
            following: None,
            settle: 0.0,
            shots: 1,
        };
        measured.push(cell.measure(&request, &|| true).unwrap().point);
    }
    let truth = cell.truth();
    let kinematics = ForwardKinematics::new(&truth.arm.chain);
    let exact = rows
        .iter()
        .map(|row| truth.base_from_tracker.inverse() * kinematics.point_in_base(row, &truth.arm.targets[0]))
        .collect();
    let template =
        Template { chain: profile.chain().clone(), beta_joints: profile.beta_joints().to_vec(), is_nominal: true };
    Case { template, rows, exact, measured, truth: cell }
}

fn value(arm: &MeasuredArm, id: ParameterId) -> f64 {
    arm.constants.iter().find(|constant| constant.id == id).map_or(f64::NAN, |constant| constant.value)
}

/// Six axes with parallel ones and a spherical wrist, six without, seven, and a SCARA.
const ARMS: [&str; 6] = ["soochow", "abb_irb120", "ur10e", "kuka_iiwa7", "franka_panda", "epson_ls3_b401s"];

#[test]
fn the_constants_are_within_three_sigma_of_the_truth() {
    for name in ARMS {
        let (mut square, mut count, mut beyond, mut worst) = (0.0, 0, 0, 0.0_f64);
        for seed in 1..=6 {
            let case = case(name, seed);
            let truth = measure_arm(&case.template, &case.rows, &case.exact, Some(1e-9)).unwrap();
            let found = measure_arm(&case.template, &case.rows, &case.measured, Some(from_mm(NOISE_MM))).unwrap();
            for constant in &found.constants {
                assert!(constant.sigma > 0.0, "{name} {}", constant.id);
                let off = (constant.value - value(&truth, constant.id)) / constant.sigma;
                // Of a hundred constants a quarter of one is beyond 3 sigma, of a thousand less than a tenth beyond 4.
                assert!(off.abs() < 4.0, "{name} seed {seed}: {} is {off:.1} sigma off", constant.id);
                beyond += usize::from(off.abs() > 3.0);
                square += off * off;
                count += 1;
                worst = worst.max(off.abs());
            }
            let target = found.point_in_flange - truth.point_in_flange;
            assert!((0..3).all(|axis| target[axis].abs() < 4.0 * found.point_sigma[axis]), "{name} {target}");
        }
        let ratio = (square / f64::from(count)).sqrt();
        eprintln!("{name}: {} constants, RMS {ratio:.2} sigma, worst {worst:.2}", count / 6);
        assert!((0.8..1.25).contains(&ratio), "{name}: {ratio}");
        assert!(beyond <= 1, "{name}: {beyond} of {count} constants beyond 3 sigma");
    }
}

#[test]
fn without_noise_the_measured_arm_is_the_true_one() {
    for name in ARMS {
        let case = case(name, 3);
        let found = measure_arm(&case.template, &case.rows, &case.exact, None).unwrap();
        let worst = found.residuals.iter().copied().fold(0.0, f64::max);
        assert!(worst < 1e-8, "{name}: {worst}");
        // Twists and lengths do not depend on where the base is, nor on what is left to the template.
        let arm = &case.truth.truth().arm;
        for constant in &found.constants {
            let ParameterId::Link { joint, parameter } = constant.id else { panic!() };
            let is_free = matches!(parameter, LinkParameter::Alpha | LinkParameter::A)
                && !case.template.beta_joints.contains(&joint)
                && case.template.chain.joints()[joint].joint_type == JointType::Revolute;
            let truth = arm.value(constant.id).unwrap();
            assert!(
                !is_free || (truth - constant.value).abs() < 1e-7,
                "{name} {}: {truth} {}",
                constant.id,
                constant.value
            );
        }
        // Anywhere else the arm is the true one as well.
        let kinematics = [ForwardKinematics::new(&found.chain), ForwardKinematics::new(&arm.chain)];
        let pairs = case.rows.windows(3).step_by(7).map(|rows| {
            let mixed: Vec<f64> = (0..rows[0].len()).map(|joint| rows[joint % 3][joint] + 0.1).collect();
            let found = kinematics[0].point_in_base(&mixed, &found.point_in_flange);
            (found, kinematics[1].point_in_base(&mixed, &arm.targets[0]))
        });
        let pairs: Vec<_> = pairs.collect();
        for (one, other) in pairs.iter().zip(pairs.iter().skip(1)) {
            let difference = (one.0 - other.0).norm() - (one.1 - other.1).norm();
            assert!(difference.abs() < 1e-7, "{name}: {difference}");
        }
    }
}

#[test]
fn an_unknown_arm_is_measured_from_the_kinds_of_its_joints() {
    for name in ["soochow", "ur10e", "kuka_iiwa7", "epson_ls3_b401s"] {
        let case = case(name, 2);
        let types: Vec<JointType> = case.template.chain.joints().iter().map(|joint| joint.joint_type).collect();
        let template = Template::unknown(&types).unwrap();
        let exact = measure_arm(&template, &case.rows, &case.exact, None).unwrap();
        assert!(exact.residuals.iter().all(|residual| *residual < 1e-8), "{name}");
        let found = measure_arm(&template, &case.rows, &case.measured, None).unwrap();
        let worst = found.residuals.iter().copied().fold(0.0, f64::max);
        assert!(worst < from_mm(0.2), "{name}: {worst}");
        assert!(found.constants.iter().all(|constant| constant.nominal.is_none()));
    }
    // The arm of the paper has one pair of parallel axes.
    let case = case("soochow", 2);
    let unknown = measure_arm(&Template::unknown(&[JointType::Revolute; 6]).unwrap(), &case.rows, &case.measured, None);
    assert_eq!(unknown.unwrap().beta_joints, [1]);
}

/// A change of rows and points.
type Change<'a> = &'a dyn Fn(&mut Vec<Vec<f64>>, &mut Vec<Point3<f64>>);

#[test]
fn rows_that_do_not_move_one_joint_at_a_time_are_refused() {
    let case = case("ur10e", 1);
    let error = |change: Change<'_>| {
        let (mut rows, mut points) = (case.rows.clone(), case.measured.clone());
        change(&mut rows, &mut points);
        measure_arm(&case.template, &rows, &points, None).unwrap_err().to_string()
    };
    let messages = [
        error(&|rows, _| rows[1][3] += 0.1),
        error(&|rows, points| {
            rows.truncate(50);
            points.truncate(50);
        }),
        error(&|rows, _| rows[30..40].iter_mut().for_each(|row| row[0] += 0.1)),
        error(&|rows, _| rows[10..20].iter_mut().for_each(|row| row[1] = 0.0)),
        error(&|_, points| points.truncate(10)),
        error(&|_, points| points[20..30].iter_mut().for_each(|point| *point = Point3::origin())),
    ];
    insta::assert_snapshot!(messages.join("\n"));
}

/// The rows of a case as a table.
fn table(case: &Case) -> String {
    let types: Vec<JointType> = case.template.chain.joints().iter().map(|joint| joint.joint_type).collect();
    let title = |(index, kind): (usize, &JointType)| format!("q{}_{},", index + 1, kind.quantity().unit());
    let mut text: String = types.iter().enumerate().map(title).collect();
    text += "x_mm,y_mm,z_mm\n";
    for (row, point) in case.rows.iter().zip(&case.measured) {
        let joints = row.iter().zip(&types).map(|(value, kind)| kind.quantity().to_edge(*value));
        let values: Vec<String> =
            joints.chain(point.coords.iter().map(|value| value * 1e3)).map(|value| format!("{value:.6}")).collect();
        text += &(values.join(",") + "\n");
    }
    text
}

fn run(folder: &Path, arguments: &[&str]) -> (i32, String, String) {
    let output = trupose_in(folder, arguments);
    let text = |bytes: &[u8]| String::from_utf8(bytes.to_vec()).unwrap();
    (output.status.code().unwrap(), text(&output.stdout), text(&output.stderr))
}

#[test]
fn a_profile_is_made_from_circles_and_can_be_planned_with() {
    let folder = tempfile::tempdir().unwrap();
    let case = case("abb_irb120", 4);
    fs::write(folder.path().join("circles.csv"), table(&case)).unwrap();
    // Of an arm of which nothing is known but its limits.
    let limits = "165, -110..110, -110..70, 160, 120, 180";
    let new =
        ["profile", "new", "--circles", "circles.csv", "--name", "Unknown 1", "--limits", limits, "--out", "new.ron"];
    let (code, _, said) = run(folder.path(), &new);
    assert_eq!(code, 0, "{said}");
    assert!(said.contains("beta2") && !said.contains("nominal"), "{said}");
    let text = fs::read_to_string(folder.path().join("new.ron")).unwrap();
    let (profile, _) = Profile::parse(&text, "new.ron").unwrap_or_else(|errors| panic!("{errors}"));
    let truth = &case.truth.truth().arm;
    let made = ForwardKinematics::new(profile.chain());
    let real = ForwardKinematics::new(&truth.chain);
    let target = profile.targets()[0].position_in_flange;
    let place = |q: &[f64]| (made.point_in_base(q, &target), real.point_in_base(q, &truth.targets[0]));
    let (a, b) = (place(&[0.3, -0.5, 0.2, 0.8, -0.6, 1.0]), place(&[-0.7, 0.4, -0.3, -0.9, 0.8, -1.2]));
    let difference = ((a.0 - b.0).norm() - (a.1 - b.1).norm()).abs();
    assert!(difference < from_mm(0.5), "{difference}");
    // The tracker stands where it stands, up to a turn about the first axis and a shift along it.
    let horizontal = |point: Point3<f64>| point.x.hypot(point.y);
    let stands = Point3::from(case.truth.truth().base_from_tracker.translation.vector);
    let off = horizontal(profile.tracker().position_in_base) - horizontal(stands);
    assert!(off.abs() < 0.01, "{off}");
    let plan = [
        "plan",
        "--profile",
        "new.ron",
        "--poses",
        "20",
        "--verification",
        "0",
        "--candidates",
        "200",
        "--out",
        "plan.csv",
    ];
    let (code, _, said) = run(folder.path(), &plan);
    assert_eq!(code, 0, "{said}");

    // Compared with the data sheet.
    let new = [
        "profile",
        "new",
        "--circles",
        "circles.csv",
        "--compare",
        "abb_irb120",
        "--sigma-mm",
        "0.01",
        "--out",
        "better.ron",
    ];
    let (code, _, said) = run(folder.path(), &new);
    assert_eq!(code, 0, "{said}");
    assert!(said.contains("nominal") && said.contains("difference") && !said.contains("WARNING"), "{said}");
    let (code, _, said) = run(folder.path(), &["profile", "check", "better.ron"]);
    assert_eq!(code, 0, "{said}");
    let new = ["profile", "new", "--circles", "circles.csv", "--compare", "abb_irb1600_6_145"];
    let (_, _, said) = run(folder.path(), &new);
    assert!(said.contains("WARNING") && said.contains("marked !"), "{said}");
}

#[test]
fn tables_of_circles_that_cannot_be_used_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("a.csv"), "x_mm,y_mm,z_mm\n1,2,3\n").unwrap();
    let (code, _, said) = run(folder.path(), &["profile", "new", "--circles", "a.csv"]);
    assert!(code == 2 && said.contains("no columns q1_deg"), "{said}");
    let case = case("ur10e", 1);
    let half: Vec<String> = table(&case).lines().take(31).map(str::to_owned).collect();
    fs::write(folder.path().join("b.csv"), half.join("\n")).unwrap();
    let (code, _, said) = run(folder.path(), &["profile", "new", "--circles", "b.csv"]);
    assert!(code == 4 && said.contains("joint J4 is not moved in any series"), "{said}");
}

#[test]
fn a_profile_is_made_from_seven_dimensions() {
    let folder = tempfile::tempdir().unwrap();
    let limits = "165, -110..110, -110..70, 160, 120, 400";
    let sheet = [
        "profile",
        "new",
        "--data-sheet",
        "abb",
        "--name",
        "My ABB",
        "--base",
        "290",
        "--shoulder",
        "0",
        "--upper-arm",
        "270",
    ];
    let rest = ["--elbow", "70", "--forearm", "302", "--flange", "72", "--limits", limits];
    let with = |more: &[&'static str]| [&sheet[..], &rest[..], more].concat();
    let (code, out, said) = run(folder.path(), &with(&["--pendant", "374,0,630", "--out", "my.ron"]));
    assert_eq!((code, out.as_str()), (0, ""), "{said}");
    assert!(said.contains("at all zeros the flange is at x 374.0, y 0.0, z 630.0 mm"), "{said}");
    assert!(said.contains("the pendant shows the same"), "{said}");
    let (code, out, _) = run(folder.path(), &["profile", "check", "my.ron"]);
    assert!(code == 0 && out.contains("can be used"), "{out}");
    // What the pendant shows tells which dimension or which maker was meant.
    let (code, _, said) = run(folder.path(), &with(&["--pendant", "644,0,360"]));
    assert!(code == 2 && said.contains("the zero position of kuka"), "{said}");
    let (code, _, said) = run(folder.path(), &[&sheet[..], &["--elbow", "70"]].concat());
    assert!(code == 2 && said.contains("missing: forearm (mm)"), "{said}");
    let (code, _, said) = run(folder.path(), &["profile", "new"]);
    assert!(code == 2 && said.contains("--data-sheet"), "{said}");
}
