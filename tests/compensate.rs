//! Compensation: closed loop on a simulated arm, what is not reachable, and the commands that apply a calibration.

use std::fs;
use std::path::Path;

use crate::support::paper_case::{PaperCase, RANGES, paper_deviations, random_configurations, seeded};
use crate::support::trupose;
use nalgebra::{DVector, Isometry3, Point3, Translation3};
use trupose::compensation::{Compensator, Goal, Settings, Status, ToolArm};
use trupose::geometry::register;
use trupose::identification::identify;
use trupose::inverse::{InverseKinematics, Posture};
use trupose::kinematics::{Arm, ForwardKinematics, KinematicChain, ParameterUnit, Place};
use trupose::link::SimulatedCell;
use trupose::model::CalibratedArm;
use trupose::model::proof::configurations;
use trupose::profile::{Level, Profile, builtin, builtin_names};
use trupose::program::motion::ReadOptions;
use trupose::program::rewrite::scan;
use trupose::program::{Dialect, Robot};
use trupose::session::calibration::{Calibration, LoadsText};
use trupose::session::set_up::PayloadText;
use trupose::session::simulation::{Simulation, Truth};
use trupose::session::summary::ParameterSummary;
use trupose::units::{MICROMETRE, from_deg, to_deg, to_mm};

fn profile(name: &str) -> Profile {
    Profile::parse(builtin(name).unwrap(), name).unwrap().0
}

fn with_tool(chain: &KinematicChain, point: Option<&Point3<f64>>) -> ToolArm {
    let flange_from_tool =
        point.map_or_else(Isometry3::identity, |point| Isometry3::from(Translation3::from(point.coords)));
    ToolArm { chain: chain.clone(), flange_from_tool }
}

/// Mean and largest distance (m) of points from where they were meant, the base frame aside: distances cannot know it.
fn errors(meant: &[Point3<f64>], reached: &[Point3<f64>]) -> (f64, f64) {
    let pairs = reached.iter().zip(meant).map(|(reached, meant)| (1.0, *reached, *meant));
    let frame = register(pairs).unwrap().to_from_from;
    let distances: Vec<f64> =
        reached.iter().zip(meant).map(|(reached, meant)| (frame * reached - meant).norm()).collect();
    (distances.iter().sum::<f64>() / distances.len() as f64, distances.iter().copied().fold(0.0, f64::max))
}

/// Errors of the arm as it is commanded naively, of the identified model, and of the arm commanded with compensation.
fn closed_loop(noise: f64, seed: u64, position_only: bool) -> [(f64, f64); 3] {
    let mut rng = seeded(seed);
    let truth = paper_deviations();
    let case = PaperCase::simulated(&truth, 56, noise, &mut rng);
    let found = identify(&case.problem(), &trupose::identification::Settings::default(), &mut |_| {}).unwrap();
    let deviations = DVector::from_iterator(found.estimates.len(), found.estimates.iter().map(|e| e.deviation));
    let nominal = case.arm.clone();
    let identified = case.problem().arm_with(&deviations);
    let real = case.problem().arm_with(&truth);
    let limits: Vec<_> = RANGES.iter().map(|(low, high)| Some((from_deg(*low) - 0.2, from_deg(*high) + 0.2))).collect();
    let arms = [&nominal, &identified].map(|model| with_tool(&model.chain, model.targets.first()));
    let settings = Settings { position_only, ..Settings::default() };
    let compensator = Compensator::new(&arms[0], &arms[1], &limits, settings);
    let point = |model: &Arm, q: &[f64]| ForwardKinematics::new(&model.chain).point_in_base(q, &model.targets[0]);
    let (mut meant, mut naive, mut predicted, mut compensated) = (vec![], vec![], vec![], vec![]);
    for q in random_configurations(2000, &mut rng) {
        let done = compensator.solve(&Goal::Configuration(q.clone()));
        if done.status != Status::Reached {
            // Wrist singularities are inside the ranges of this case.
            continue;
        }
        meant.push(point(&nominal, &q));
        naive.push(point(&real, &q));
        predicted.push((point(&identified, &q), point(&real, &q)));
        compensated.push(point(&real, &done.command));
    }
    assert!(meant.len() > 1700, "{}", meant.len());
    let (models, truths): (Vec<_>, Vec<_>) = predicted.into_iter().unzip();
    [errors(&meant, &naive), errors(&models, &truths), errors(&meant, &compensated)]
}

#[test]
fn compensated_targets_bring_the_error_down_to_the_identified_level() {
    let mut table = "noise um, orientation | nominal | identified | compensated (mean / max mm)\n".to_owned();
    for (noise, position_only) in [(10.0, false), (50.0, false), (10.0, true)] {
        let [nominal, identified, compensated] = closed_loop(noise * MICROMETRE, 11, position_only);
        let cell = |(mean, max): (f64, f64)| format!("{:.4} / {:.4}", to_mm(mean), to_mm(max));
        table = format!(
            "{table}{noise}, {} | {} | {} | {}\n",
            !position_only,
            cell(nominal),
            cell(identified),
            cell(compensated)
        );
        assert!(nominal.0 > 20.0 * identified.0, "{table}");
        assert!((compensated.0 / identified.0 - 1.0).abs() < 0.05, "{table}");
    }
    println!("{table}");
}

#[test]
fn every_shipped_arm_is_compensated_and_the_rest_is_named() {
    for name in builtin_names() {
        let profile = profile(name);
        let free = profile.parameters(Level::Geometric);
        let deviations =
            free.iter().zip([0.5, -0.5].into_iter().cycle()).map(|(free, half)| (free.id, half * free.expected));
        let arms = [profile.chain().clone(), profile.arm().with(deviations).unwrap().chain];
        let arms = arms.map(|chain| with_tool(&chain, None));
        let limits: Vec<_> = profile.joints().iter().map(|range| range.limits).collect();
        let planning: Vec<_> = profile.joints().iter().map(|range| range.planning_limits).collect();
        // A SCARA cannot tilt its tool: its position only.
        let position_only = profile.chain().dof() < 6;
        let settings = Settings { position_only, ..Settings::default() };
        let compensator = Compensator::new(&arms[0], &arms[1], &limits, settings);
        let (nominal, identified) = (ForwardKinematics::new(&arms[0].chain), ForwardKinematics::new(&arms[1].chain));
        let (mut reached, mut usable) = (0, 0);
        for q in configurations(profile.chain(), &planning, 500) {
            let done = compensator.solve(&Goal::Configuration(q.clone()));
            for (value, limit) in done.command.iter().zip(&limits) {
                assert!(limit.is_none_or(|(low, high)| (low..=high).contains(value)), "{name}: beyond its limit");
            }
            let (goal, there) = (nominal.base_from_flange(&q), identified.base_from_flange(&done.command));
            let apart = (goal.translation.vector - there.translation.vector).norm();
            assert!((apart - done.position_error).abs() < 1e-9, "{name}");
            if done.status.is_usable() {
                usable += 1;
                assert!(apart < MICROMETRE, "{name}: {apart}");
            }
            if done.status == Status::Reached {
                reached += 1;
                assert!(position_only || goal.rotation.angle_to(&there.rotation) < 1e-6, "{name}");
            }
        }
        // The quill of the SCARA has 150 mm: some corrections would leave it.
        let least = if position_only { 400 } else { 450 };
        assert!(reached >= 400 && usable >= least, "{name}: {reached} reached, {usable} usable of 500");
    }
}

#[test]
fn limits_singularities_and_reach_are_told_apart() {
    let ur = profile("ur5");
    let deviations = ur.parameters(Level::Geometric).into_iter().map(|free| (free.id, free.expected));
    let arms = [ur.chain().clone(), ur.arm().with(deviations).unwrap().chain].map(|chain| with_tool(&chain, None));
    let limits: Vec<_> = ur.joints().iter().map(|range| range.limits).collect();
    let solve = |limits: &[Option<(f64, f64)>], goal: &Goal| {
        Compensator::new(&arms[0], &arms[1], limits, Settings::default()).solve(goal)
    };
    let away = [0.3, -1.2, 1.4, -1.0, 1.1, 0.2];
    let free = solve(&limits, &Goal::Configuration(away.to_vec()));
    assert_eq!(free.status, Status::Reached);
    // The same target with a joint that already stands at its limit on the side to which it would be corrected.
    let mut tight = limits.clone();
    let correction = free.command[1] - away[1];
    tight[1] = Some(if correction > 0.0 { (-3.0, away[1]) } else { (away[1], 3.0) });
    let held = solve(&tight, &Goal::Configuration(away.to_vec()));
    assert!(matches!(held.status, Status::PositionOnly) || held.status == Status::AtLimit(vec![1]), "{held:?}");
    assert!((held.command[1] - away[1]).abs() < 1e-6 || held.status == Status::PositionOnly);
    let mut narrow = limits.clone();
    narrow[2] = Some((-1.0, 1.0));
    let beyond = solve(&narrow, &Goal::Configuration(vec![0.0, 0.0, 3.0, 0.0, f64::NAN, 0.0]));
    assert_eq!(beyond.status, Status::BeyondLimit(vec![2, 4]));
    // Beyond it by a full turn only: the same place.
    let mut turned = away.to_vec();
    turned[2] -= 2.0 * std::f64::consts::PI;
    narrow[2] = Some((-2.0, 2.0));
    let turned = solve(&narrow, &Goal::Configuration(turned));
    assert_eq!(turned.status, Status::Reached);
    assert!((turned.command[2] - free.command[2]).abs() < 1e-9);
    // Wrist straight: axes 4 and 6 in line. The orientation would need a large turn of both, the position does not.
    let straight = solve(&limits, &Goal::Configuration(vec![0.3, -1.2, 1.4, -1.0, 1e-4, 0.2]));
    assert_eq!(straight.status, Status::PositionOnly, "{straight:?}");
    assert!(straight.position_error < MICROMETRE && straight.angle_error > 1e-5);
    // Cartesian: what the nominal arm reaches, with and without a hint of the branch, and what nobody reaches.
    let pose = ForwardKinematics::new(ur.chain()).base_from_flange(&away);
    let near = solve(&limits, &Goal::Pose { base_from_tool: pose, near: Some(away.map(|q| q + 0.1).to_vec()) });
    assert_eq!(near.status, Status::Reached);
    assert!(near.meant.unwrap().iter().zip(away).all(|(a, b)| (a - b).abs() < 1e-5));
    assert!(near.command.iter().zip(&free.command).all(|(a, b)| (a - b).abs() < 1e-5));
    let anywhere = solve(&limits, &Goal::Pose { base_from_tool: pose, near: None });
    assert_eq!(anywhere.status, Status::Reached);
    let point = Goal::Position { point_in_base: Point3::new(0.3, 0.4, 0.5), near: None };
    assert_eq!(solve(&limits, &point).status, Status::Reached);
    let far = Goal::Position { point_in_base: Point3::new(3.0, 0.4, 0.5), near: None };
    assert_eq!(solve(&limits, &far).status, Status::OutOfReach);
}

fn calibrate(folder: &Path) -> String {
    let output = trupose(&[
        "identify",
        "--profile",
        "soochow",
        "--measurements",
        "sessions/soochow-example/measurements.csv",
        "--verify",
        "sessions/soochow-example/verification.csv",
        "--out",
        folder.to_str().unwrap(),
    ]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    folder.join("calibration.ron").to_str().unwrap().to_owned()
}

#[test]
fn a_table_of_targets_becomes_a_table_of_commands() {
    let folder = tempfile::tempdir().unwrap();
    let calibration = calibrate(folder.path());
    let targets = folder.path().join("targets.csv");
    let run = |text: &str, more: &[&str]| {
        fs::write(&targets, text).unwrap();
        let mut arguments = vec!["compensate", "--calibration", &calibration, "--targets", targets.to_str().unwrap()];
        arguments.extend(more);
        let output = trupose(&arguments);
        let text = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap();
        (output.status.code().unwrap(), text(output.stdout), text(output.stderr))
    };
    let (code, out, err) =
        run("pose,q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg\na,10,20,-30,40,50,60\nb,0,0,0,0,170,0\n", &[]);
    assert_eq!(code, 1, "{out}{err}");
    let lines: Vec<&str> = out.lines().collect();
    assert_eq!(lines[0], "pose,status,q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg,left_mm,left_deg,moved_mm,moved_deg");
    assert!(lines[1].starts_with("a,reached,") && lines[2] == "b,beyond_limit,,,,,,,,,,", "{out}");
    assert!(err.contains("pose b (line 3): not reached: J5 has a target beyond its limit"), "{err}");
    assert!(err.contains("1 of 2 targets reached"), "{err}");
    let commanded: Vec<f64> = lines[1].split(',').skip(2).take(6).map(|cell| cell.parse().unwrap()).collect();
    let correction =
        commanded.iter().zip([10.0, 20.0, -30.0, 40.0, 50.0, 60.0]).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!((0.01..5.0).contains(&correction), "{out}");

    let (code, out, err) = run("pose,x_mm,y_mm,z_mm\nfar,9000,0,0\nnear,900,100,800\n", &["--target", "smr"]);
    assert_eq!(code, 1, "{out}{err}");
    assert!(out.contains("far,out_of_reach,,") && out.contains("near,reached,"), "{out}");
    let file = folder.path().join("out.csv");
    let (code, out, err) = run(
        "pose,x_mm,y_mm,z_mm,roll_deg,pitch_deg,yaw_deg\nnear,900,100,800,10,160,20\n",
        &["--out", file.to_str().unwrap()],
    );
    assert_eq!(code, 0, "{out}{err}");
    assert!(fs::read_to_string(&file).unwrap().contains("near,reached,"));
    let (code, _, err) = run("pose,x_mm,y_mm\nnear,900,100\n", &[]);
    assert!(code == 2 && err.contains("z_mm is missing"), "{err}");
    let (code, _, err) = run("pose,x_mm,y_mm,z_mm\nnear,900,100,3\n", &["--target", "ball"]);
    assert!(code == 2 && err.contains("targets: "), "{err}");

    // What the data do not tell is said where it matters.
    let joints = "pose,q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg\na,10,20,-30,40,50,60\n";
    let (code, commands, err) = run(joints, &[]);
    assert!(code == 0 && err.contains("theta6 (0."), "{err}");
    let (code, _, err) = run(joints, &["--target", "smr"]);
    assert!(code == 0 && !err.contains("theta6 (0."), "{err}");
    // Of many the first are named.
    let beyond: Vec<String> = (0..50).map(|row| format!("p{row},0,0,0,0,170,0")).collect();
    let table = format!("pose,q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg\n{}\n", beyond.join("\n"));
    let (code, _, err) = run(&table, &[]);
    assert!(code == 1 && err.contains("pose p19 ") && !err.contains("pose p20 "), "{err}");
    assert!(err.contains("and 30 more;") && err.contains("0 of 50 targets reached"), "{err}");
    // What is corrected is not corrected once more.
    let (code, out, err) = run(&commands, &[]);
    assert_eq!((code, out.as_str()), (2, ""), "{err}");
    assert!(err.contains("it is a table of commands"), "{err}");
    let (code, out, err) = run(joints, &["--out", targets.to_str().unwrap()]);
    assert_eq!((code, out.as_str()), (2, ""), "{err}");
    assert_eq!(fs::read_to_string(&targets).unwrap(), joints);
}

/// A calibration with compliance, of an arm whose weight is known.
fn soft(text: &str) -> Calibration {
    let mut calibration = Calibration::parse(text).unwrap();
    calibration.profile = calibration.profile.replacen("    targets: [", "    weight_kg: 400.0,\n    targets: [", 1);
    let compliance = ParameterSummary {
        id: "joint2.compliance".parse().unwrap(),
        unit: ParameterUnit::Microradian,
        nominal: 0.0,
        deviation: 2000.0,
        sigma: Some(10.0),
        expected: 1000.0,
        identifiable: true,
    };
    calibration.parameters.push(compliance);
    calibration.payload = Some(PayloadText { mass_kg: 2.0, centre_mm: (0.0, 0.0, 50.0) });
    let profile = Profile::parse(&calibration.profile, "soft").unwrap().0;
    let chain = calibration.mounted_on(&profile).chain().clone();
    calibration.loads = LoadsText::of(&chain, &calibration.parameters);
    calibration
}

#[test]
fn commands_are_for_the_payload_that_the_arm_works_with() {
    let folder = tempfile::tempdir().unwrap();
    let rigid = fs::read_to_string(calibrate(folder.path())).unwrap();
    let calibration = soft(&rigid);
    let text = calibration.to_text().unwrap();
    assert_eq!(Calibration::parse(&text).unwrap(), calibration);
    assert!(!rigid.contains("payload") && !rigid.contains("loads"), "what there is not is not written");
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    fs::write(path("soft.ron"), &text).unwrap();
    let joints = [20.0, 60.0, -30.0, 40.0, 50.0, 60.0];
    fs::write(path("targets.csv"), "pose,q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg\na,20,60,-30,40,50,60\n").unwrap();
    let run = |calibration: &str, payload: &[&str]| {
        let (calibration, targets) = (path(calibration), path("targets.csv"));
        let mut arguments = vec!["compensate", "--calibration", &calibration, "--targets", &targets, "--target", "smr"];
        arguments.extend(payload);
        let output = trupose(&arguments);
        let out = String::from_utf8(output.stdout).unwrap();
        let command = out.lines().nth(1).map(|line| {
            let cells = line.split(',').skip(2).take(6);
            cells.map(|cell| from_deg(cell.parse().unwrap())).collect::<Vec<f64>>()
        });
        (output.status.code().unwrap(), command.unwrap_or_default(), String::from_utf8(output.stderr).unwrap())
    };
    let profile = Profile::parse(&calibration.profile, "soft").unwrap().0;
    let identified = calibration.identified(&profile).unwrap();
    let meant: Vec<f64> = joints.iter().map(|angle| from_deg(*angle)).collect();
    let nominal = Arm { targets: vec![profile.targets()[0].position_in_flange], ..profile.arm() };
    let point = |arm: &Arm, q: &[f64]| arm.point_in_base(&Place { configuration: q.to_vec(), target: 0 });
    let mut commands = Vec::new();
    for payload in [None, Some(PayloadText { mass_kg: 60.0, centre_mm: (0.0, 0.0, 200.0) })] {
        let options: &[&str] =
            if payload.is_some() { &["--payload-kg", "60", "--payload-centre-mm", "0,0,200"] } else { &[] };
        let (code, command, err) = run("soft.ron", options);
        assert_eq!(code, 0, "{err}");
        let arm = payload.map_or_else(|| identified.clone(), |payload| identified.clone().with_payload(payload.mass()));
        let left = (point(&arm, &command) - point(&nominal, &meant)).norm();
        assert!(left < 2e-6, "{payload:?}: {left}");
        commands.push(command);
    }
    // The heavier load bends the second joint further, by its torque against that of the identification.
    let further = (commands[1][1] - commands[0][1]).abs();
    assert!((1e-5..2e-3).contains(&further), "{further}");
    // The same numbers mean the same arm if the scale is not the one that this program would compute.
    let mut doubled = calibration.clone();
    let loads = doubled.loads.as_mut().unwrap();
    loads.torques_nm.iter_mut().for_each(|torque| *torque *= 2.0);
    doubled.parameters.last_mut().unwrap().deviation *= 2.0;
    let same = doubled.identified(&profile).unwrap();
    assert!((point(&same, &meant) - point(&identified, &meant)).norm() < 1e-12);

    // A payload needs masses, and both of its numbers.
    let (code, _, err) = run("calibration.ron", &["--payload-kg", "60", "--payload-centre-mm", "0,0,200"]);
    let said = err.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(code == 2 && said.contains("gives no masses of the arm"), "{err}");
    let (code, _, err) = run("soft.ron", &["--payload-kg", "60"]);
    assert!(code == 2 && err.contains("--payload-centre-mm"), "{err}");
    for wrong in ["0,0", "0,0,20000", "0,0,x"] {
        let (code, _, err) = run("soft.ron", &["--payload-kg", "60", "--payload-centre-mm", wrong]);
        assert!(code == 2 && err.contains("is not a point within 10 m of the flange"), "{err}");
    }
    for (wrong, message) in [("mass_kg: 2.0", "'payload' needs a mass"), ("moment_nm: ", "'loads' has a number")] {
        let broken = text.replacen(wrong, &wrong.replace("2.0", "-2.0").replace("nm: ", "nm: -"), 1);
        let error = Calibration::parse(&broken).unwrap_err().to_string();
        assert!(error.contains(message), "{error}");
    }
}

#[test]
fn what_speaks_against_a_calibration_is_said_wherever_it_is_applied() {
    let folder = tempfile::tempdir().unwrap();
    let calibration = calibrate(folder.path());
    let text = fs::read_to_string(&calibration).unwrap();
    let (accepted, refused) = ("status: accepted", "status: not_accepted");
    assert!(text.contains(accepted), "{text}");
    fs::write(&calibration, text.replace(accepted, refused)).unwrap();
    let out = folder.path().join("c.urdf").to_str().unwrap().to_owned();
    let output = trupose(&["export", "--calibration", &calibration, "--format", "urdf", "--out", &out, "--edited"]);
    assert!(output.status.success());
    let said = String::from_utf8(output.stderr).unwrap();
    assert!(said.contains("WARNING: this calibration was not accepted"), "{said}");
    assert!(fs::read_to_string(&out).unwrap().contains("WARNING: this calibration was not accepted"));
    let targets = folder.path().join("t.csv");
    fs::write(&targets, "q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg\n10,20,-30,40,50,60\n").unwrap();
    let output =
        trupose(&["compensate", "--calibration", &calibration, "--targets", targets.to_str().unwrap(), "--edited"]);
    assert!(output.status.success());
    assert!(String::from_utf8(output.stderr).unwrap().contains("WARNING: this calibration was not accepted"));
    // Those of a simulated cell are for no real arm, and a later verification says so too.
    let example = "sessions/example/calibration.ron";
    let output = trupose(&["export", "--calibration", example, "--format", "dh-csv", "--out", &out]);
    assert!(String::from_utf8(output.stderr).unwrap().contains("WARNING: SIMULATED"));
    assert!(fs::read_to_string(&out).unwrap().contains("# WARNING: SIMULATED"));
    let again = ["verify", "--calibration", example, "--measurements", "sessions/example/measurements.csv"];
    let output = trupose(&[&again[..], &["--use", "kind == 'verification'"]].concat());
    assert!(String::from_utf8(output.stdout).unwrap().contains("SIMULATED"));
}

#[test]
fn a_tracker_that_moved_is_named_by_verify() {
    let folder = tempfile::tempdir().unwrap();
    let calibration = calibrate(folder.path());
    // The same points seen from elsewhere.
    let table = fs::read_to_string("sessions/soochow-example/verification.csv").unwrap();
    let moved: Vec<String> = table
        .lines()
        .map(|line| match line.split(',').collect::<Vec<_>>()[..] {
            [ref before @ .., x, y, z] if x.parse::<f64>().is_ok() => {
                let number = |text: &str| text.parse::<f64>().unwrap();
                format!("{},{},{},{}", before.join(","), 500.0 - number(y), number(x) + 20.0, number(z) - 7.0)
            }
            _ => line.to_owned(),
        })
        .collect();
    let path = folder.path().join("moved.csv").to_str().unwrap().to_owned();
    fs::write(&path, moved.join("\n")).unwrap();
    let verify = ["verify", "--calibration", &calibration, "--measurements", &path];
    let output = trupose(&verify);
    let text = String::from_utf8(output.stdout).unwrap();
    assert_eq!(output.status.code(), Some(1), "{text}");
    let words: Vec<&str> = text.split_whitespace().collect();
    assert!(words.join(" ").contains("'--refit frame' fits the position of the tracker"), "{text}");
    let output = trupose(&[&verify[..], &["--refit", "frame"]].concat());
    let text = String::from_utf8(output.stdout).unwrap();
    assert!(output.status.success() && !text.contains("is not where it was"), "{text}");
}

#[test]
fn models_are_exported_and_a_urdf_is_imported() {
    let folder = tempfile::tempdir().unwrap();
    let calibration = calibrate(folder.path());
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    for (format, name) in [("corrected-profile", "c.ron"), ("urdf", "c.urdf"), ("dh-csv", "c.csv"), ("json", "c.json")]
    {
        let out = path(name);
        let output = trupose(&["export", "--calibration", &calibration, "--format", format, "--out", &out]);
        assert!(output.status.success(), "{format}: {}", String::from_utf8_lossy(&output.stderr));
        assert!(String::from_utf8(output.stdout).unwrap().contains("read back: within"));
    }
    let out = path("c.yaml");
    let output = trupose(&["export", "--calibration", &calibration, "--format", "ur-kinematics", "--out", &out]);
    assert_eq!(output.status.code(), Some(2));
    assert!(!Path::new(&out).exists());
    // The corrected profile can be used, and the URDF comes back as a profile of the same arm.
    assert!(trupose(&["profile", "check", &path("c.ron")]).status.success());
    let imported = path("imported.ron");
    let output =
        trupose(&["profile", "import-urdf", &path("c.urdf"), "--base", "base", "--tip", "flange", "--out", &imported]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let read = |name: &str| Profile::parse(&fs::read_to_string(path(name)).unwrap(), name).unwrap().0;
    let (corrected, back) = (read("c.ron"), read("imported.ron"));
    let (a, b) = (ForwardKinematics::new(corrected.chain()), ForwardKinematics::new(back.chain()));
    let limits: Vec<_> = corrected.joints().iter().map(|range| range.limits).collect();
    for q in configurations(corrected.chain(), &limits, 100) {
        let (a, b) = (a.base_from_flange(&q), b.base_from_flange(&q));
        assert!((a.translation.vector - b.translation.vector).norm() < 1e-9 && a.rotation.angle_to(&b.rotation) < 1e-9);
    }
    assert!(trupose(&["profile", "show", &imported]).status.success());
    // Millimetres where metres belong.
    let urdf = fs::read_to_string(path("c.urdf")).unwrap();
    let mut pieces = urdf.split("xyz=\"");
    let mut text = pieces.next().unwrap().to_owned();
    for piece in pieces {
        let (numbers, rest) = piece.split_once('"').unwrap();
        let larger = numbers.split_whitespace().map(|number| (1e3 * number.parse::<f64>().unwrap()).to_string());
        text.extend(["xyz=\"", &larger.collect::<Vec<_>>().join(" "), "\"", rest]);
    }
    fs::write(path("mm.urdf"), text).unwrap();
    for (file, is_long) in [("c.urdf", false), ("mm.urdf", true)] {
        let output = trupose(&["profile", "import-urdf", &path(file), "--base", "base", "--tip", "flange"]);
        let said = String::from_utf8(output.stderr).unwrap();
        assert_eq!(said.contains("are they millimetres in this one?"), is_long, "{file}: {said}");
    }
    let output = trupose(&[
        "profile",
        "import-urdf",
        "tests/urdf/panda.urdf",
        "--base",
        "panda_link0",
        "--tip",
        "panda_rightfinger",
    ]);
    assert_eq!(output.status.code(), Some(2));
    let message = String::from_utf8(output.stderr).unwrap();
    assert!(message.contains("line 45"), "{message}");
    // Into the nominal URDF of the arm: without '--into' there is no base to name.
    let output = trupose(&[
        "export",
        "--calibration",
        &calibration,
        "--format",
        "urdf",
        "--into",
        "tests/urdf/ur5.urdf",
        "--base",
        "base",
        "--out",
        &out,
    ]);
    assert!(output.status.code() == Some(2) && !Path::new(&out).exists());
}

#[test]
fn a_robot_program_is_corrected_in_place() {
    let folder = tempfile::tempdir().unwrap();
    let calibration = calibrate(folder.path());
    let file = folder.path().join("part.src");
    let text = b"DEF part()\r\n; M\xfcller\r\nPTP {A1 10,A2 20,A3 -30,A4 40,A5 50,A6 60}\r\nLIN {X 1,Y 2,Z 3,A 0,B 0,C 0}\r\nPTP {A1 0,A2 0,A3 0,A4 0,A5 0,A6 0}\r\nEND\r\n";
    fs::write(&file, text).unwrap();
    let out = folder.path().join("corrected.src");
    let output = trupose(&[
        "compensate",
        "--calibration",
        &calibration,
        "--program",
        file.to_str().unwrap(),
        "--dialect",
        "krl",
        "--points",
        "computed",
        "--partial",
        "--out",
        out.to_str().unwrap(),
    ]);
    let message = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(1), "{message}");
    let message = message.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(message.contains("line 4: left as it is: its tool '$TOOL' is not in the given files"), "{message}");
    // The second target has a straight wrist.
    assert!(message.contains("line 5: near a singularity only the position is reached"), "{message}");
    assert!(
        message.contains(
            "2 of 2 joint targets and 0 of 1 Cartesian targets corrected (1 in position only), 0 other places left"
        ),
        "{message}"
    );
    let corrected = fs::read(&out).unwrap();
    let lines = |text: &[u8]| text.split(|byte| *byte == b'\n').map(<[u8]>::to_vec).collect::<Vec<_>>();
    let (before, after) = (lines(text), lines(&corrected));
    let changed: Vec<usize> = (0..before.len()).filter(|line| before[*line] != after[*line]).collect();
    assert_eq!((before.len(), changed), (after.len(), vec![2, 4]));
}

#[test]
fn programs_of_every_dialect_get_the_same_corrections() {
    let folder = tempfile::tempdir().unwrap();
    let calibration = "sessions/example/calibration.ron";
    let mut summaries = Vec::new();
    // The file that holds the targets, and how many lines name each of them.
    for (dialect, file, lines_each) in [
        ("rapid", "calposes.mod", 1),
        ("krl", "calposes.src", 1),
        ("fanuc", "CALPOSES.LS", 2),
        ("urscript", "calposes.script", 1),
        ("val3", "calposes.dtx", 1),
        ("ros", "calposes.yaml", 1),
    ] {
        let place = folder.path().join(dialect);
        let plan = ["program", "--profile", "soochow", "--plan", "sessions/example/plan.csv", "--dialect", dialect];
        let output = trupose(&[&plan[..], &["--out", place.to_str().unwrap()]].concat());
        assert!(output.status.success(), "{dialect}: {}", String::from_utf8_lossy(&output.stderr));
        let (before, after) = (place.join(file), place.join("corrected"));
        let run = |program: &Path, out: &Path| {
            let mut arguments = vec![
                "compensate",
                "--calibration",
                calibration,
                "--program",
                program.to_str().unwrap(),
                "--dialect",
                dialect,
                "--points",
                "computed",
                "--out",
                out.to_str().unwrap(),
            ];
            // The moves of a VAL3 application are in other files than its points.
            let entries = fs::read_dir(&place).unwrap().map(|entry| entry.unwrap().path());
            let moves: Vec<_> = entries.filter(|path| path.extension().is_some_and(|name| name == "pgx")).collect();
            arguments.extend(moves.iter().flat_map(|path| ["--companion", path.to_str().unwrap()]));
            let output = trupose(&arguments);
            (output.status.code(), String::from_utf8(output.stderr).unwrap())
        };
        let (code, said) = run(&before, &after);
        // Two wrists are nearly straight: said, but usable.
        assert_eq!(code, Some(0), "{dialect}: {said}");
        let summary = said.lines().find(|line| line.contains("corrected (2 in position only)")).unwrap();
        let targets: usize = summary.split(" of ").next().unwrap().split(' ').next_back().unwrap().parse().unwrap();
        summaries.push(summary.split_once("largest corrections").unwrap().1.to_owned());
        let (old, new) = (fs::read_to_string(before).unwrap(), fs::read_to_string(&after).unwrap());
        assert_eq!(old.lines().count(), new.lines().count(), "{dialect}");
        let changed = old.lines().zip(new.lines()).filter(|(old, new)| old != new).count();
        assert_eq!(changed, lines_each * targets, "{dialect}");
        // What was written is a program of the same dialect.
        let (_, again) = run(&after, &place.join("twice"));
        assert!(again.contains(&format!("of {targets} joint targets")), "{dialect}: {again}");
    }
    // Digits differ between the dialects, corrections do not.
    assert!(summaries.iter().all(|summary| *summary == summaries[0]), "{summaries:#?}");
}

/// A whole calibration by the wizard on its simulated cell. Returns the file.
fn calibrated_in_the_cell(folder: &Path, robot: &str, simulation: &Simulation) -> String {
    let path = |name: &str| folder.join(name).to_str().unwrap().to_owned();
    let cell = ron::to_string(simulation).unwrap();
    let payload = simulation
        .payload
        .map_or_else(String::new, |payload| format!("Do(StatePayload({})), ", ron::to_string(&payload).unwrap()));
    let script = format!(
        "(title: \"closed loop\", clock: Some(\"2026-01-05T08:00:00Z\"), steps: [\
         Do(ChooseProfile(\"{robot}\")), Do(NameSession(\"loop\")), Do(Next), \
         Do(ChooseInstrument(Simulated({cell}))), Do(Next), \
         Do(ChooseTarget(Profile)), {payload}Do(Next), \
         Do(MakePlan((poses: 40, verification: 12, candidates: 300, seed: 1, drift_every: 0))), Do(AcceptPlan), \
         CaptureAll(Fail), Do(Next), Do(Identify), Do(Next), Do(Next), Do(Deliver)])"
    );
    fs::write(path("loop.script.ron"), script).unwrap();
    let output =
        trupose(&["--script", &path("loop.script.ron"), "--sessions", folder.to_str().unwrap(), "--no-recording"]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    path("loop/calibration.ron")
}

/// The calibration of a simulated cell, applied to the arm that hides in that cell. Mean errors of the SMR (m): commanded naively, of
/// the identified model, commanded with compensation.
fn closed_loop_in_the_cell(robot: &str, simulation: &Simulation) -> [f64; 3] {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let calibration = calibrated_in_the_cell(folder.path(), robot, simulation);

    let nominal = profile(robot);
    let cell = SimulatedCell::new(&nominal, simulation).unwrap();
    let hidden = cell.truth();
    let read = Calibration::parse(&fs::read_to_string(&calibration).unwrap()).unwrap();
    let identified = CalibratedArm::new(&read, &nominal).unwrap();
    let planning: Vec<_> = nominal.joints().iter().map(|range| range.planning_limits).collect();
    let goals = configurations(nominal.chain(), &planning, 400);
    let header = ",q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg";
    let rows = goals.iter().enumerate().map(|(index, q)| {
        let cells: Vec<String> = q.iter().map(|value| to_deg(*value).to_string()).collect();
        format!("{index},{}\n", cells.join(","))
    });
    fs::write(path("targets.csv"), format!("pose{header}\n{}", rows.collect::<String>())).unwrap();
    let (targets, commands) = (path("targets.csv"), path("commands.csv"));
    let name = &nominal.targets()[0].name;
    let output = trupose(&[
        "compensate",
        "--calibration",
        &calibration,
        "--targets",
        &targets,
        "--target",
        name,
        "--out",
        &commands,
    ]);
    assert!(output.status.code().is_some_and(|code| code < 2), "{}", String::from_utf8_lossy(&output.stderr));

    let point = |chain: &KinematicChain, target: &Point3<f64>, q: &[f64]| {
        ForwardKinematics::new(chain).point_in_base(q, target)
    };
    let (mut meant, mut naive, mut predicted, mut real, mut compensated) = (vec![], vec![], vec![], vec![], vec![]);
    let written = fs::read_to_string(&commands).unwrap();
    for (q, line) in goals.iter().zip(written.lines().skip(1)) {
        let cells: Vec<&str> = line.split(',').collect();
        if cells[1] != "reached" {
            continue;
        }
        let command: Vec<f64> = cells[2..8].iter().map(|cell| from_deg(cell.parse().unwrap())).collect();
        meant.push(point(nominal.chain(), &nominal.targets()[0].position_in_flange, q));
        naive.push(point(&hidden.arm.chain, &hidden.arm.targets[0], q));
        predicted.push(point(&identified.identified.chain, &identified.identified.targets[0], q));
        real.push(point(&hidden.arm.chain, &hidden.arm.targets[0], q));
        compensated.push(point(&hidden.arm.chain, &hidden.arm.targets[0], &command));
    }
    assert!(meant.len() > 300, "{robot}: {} reached", meant.len());
    [errors(&meant, &naive).0, errors(&predicted, &real).0, errors(&meant, &compensated).0]
}

#[test]
fn the_arm_that_hides_in_the_simulated_cell_goes_where_it_is_meant_to() {
    let rigid = |truth| Simulation { seed: 5, truth, noise_mm: Some(0.01), ..Simulation::default() };
    let soft = Simulation {
        joint_errors: Some("curves=100,compliance=500,tilt=100,harmonics=200".parse().unwrap()),
        payload: Some(PayloadText { mass_kg: 3.0, centre_mm: (0.0, 0.0, 80.0) }),
        ..rigid(Truth::Drawn)
    };
    for (robot, simulation, tolerance) in
        [("soochow", rigid(Truth::Paper), 0.05), ("ur5e", rigid(Truth::Drawn), 0.05), ("ur5e", soft, 0.1)]
    {
        let [naive, identified, compensated] = closed_loop_in_the_cell(robot, &simulation).map(to_mm);
        let figures = format!("{robot}: {naive:.4} mm naive, {identified:.5} identified, {compensated:.5} compensated");
        println!("{figures}");
        assert!(naive > 20.0 * identified, "{figures}");
        assert!((compensated / identified - 1.0).abs() < tolerance, "{figures}");
    }
}

/// A Cartesian target in a program: its line.
fn line_of_target(dialect: Dialect, pose: &Isometry3<f64>, q: &[f64], posture: Posture) -> String {
    let (p, r) = (pose.translation.vector, pose.rotation);
    let numbers = |values: &[f64]| values.iter().map(|value| format!("{value:.9}")).collect::<Vec<_>>().join(",");
    if dialect == Dialect::Rapid {
        let quarter = |joint: usize| (to_deg(q[joint]) / 90.0).floor();
        let form = 4 * i32::from(posture.wrist_is_behind)
            + 2 * i32::from(posture.wrist_is_behind_lower_arm)
            + i32::from(posture.wrist_is_negative);
        format!(
            "MoveJ [[{}],[{}],[{},{},{},{form}],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,fine,gun;",
            numbers(p.map(to_mm).as_slice()),
            numbers(&[r.w, r.i, r.j, r.k]),
            quarter(0),
            quarter(3),
            quarter(5)
        )
    } else {
        let turn = r.scaled_axis();
        let pose = numbers(&[p.x, p.y, p.z, turn.x, turn.y, turn.z]);
        format!("movej(get_inverse_kin(p[{pose}], qnear=[{}]))", numbers(q))
    }
}

/// The same with a program whose targets are Cartesian: it is corrected, read again, and executed by a controller that inverts the nominal
/// arm, while the arm that hides in the cell moves. Mean errors of the tool (m) as in [`closed_loop_in_the_cell`], and the number of
/// targets.
fn program_in_the_cell(dialect: Dialect, robot: &str, simulation: &Simulation) -> ([f64; 3], usize) {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let calibration = calibrated_in_the_cell(folder.path(), robot, simulation);
    let nominal = profile(robot);
    let cell = SimulatedCell::new(&nominal, simulation).unwrap();
    let hidden = &cell.truth().arm.chain;
    let read = Calibration::parse(&fs::read_to_string(&calibration).unwrap()).unwrap();
    let identified = CalibratedArm::new(&read, &nominal).unwrap().identified.chain;
    let limits: Vec<_> = nominal.joints().iter().map(|range| range.limits).collect();
    let inverse = InverseKinematics::new(nominal.chain(), &limits);
    let tool = Isometry3::translation(0.02, -0.01, 0.15);
    let planning: Vec<_> = nominal.joints().iter().map(|range| range.planning_limits).collect();
    let goals = configurations(nominal.chain(), &planning, 400);
    let tool_of = |chain: &KinematicChain, q: &[f64]| ForwardKinematics::new(chain).base_from_flange(q) * tool;
    let lines = goals.iter().map(|q| {
        let pose = tool_of(nominal.chain(), q);
        line_of_target(dialect, &pose, q, inverse.posture(q).unwrap()) + "\n"
    });
    let body: String = lines.collect();
    let text = match dialect {
        Dialect::Rapid => format!(
            "MODULE M\nPERS tooldata gun:=[TRUE,[[20,-10,150],[1,0,0,0]],[1,[0,0,1],[1,0,0,0],0,0,0]];\nPROC main()\n{body}ENDPROC\nENDMODULE\n"
        ),
        _ => format!("def p():\nset_tcp(p[0.02,-0.01,0.15,0,0,0])\n{body}end\n"),
    };
    fs::write(path("program"), text).unwrap();
    let (program, out, name) = (path("program"), path("corrected"), dialect.to_string());
    let arguments = ["compensate", "--calibration", &calibration, "--program", &program, "--dialect", &name];
    let output = trupose(&[&arguments[..], &["--points", "computed", "--partial", "--json", "--out", &out]].concat());
    assert!(output.status.code().is_some_and(|code| code < 2), "{}", String::from_utf8_lossy(&output.stderr));
    let report: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let joints = nominal.joints();
    let speeds: Vec<_> = joints.iter().map(|joint| joint.max_speed).collect();
    let pulses: Vec<_> = joints.iter().map(|joint| joint.pulses_per_degree).collect();
    let robot = Robot {
        profile: nominal.name(),
        chain: nominal.chain(),
        max_speeds: &speeds,
        pulses_per_degree: &pulses,
        joint_aliases: nominal.joint_aliases(),
    };
    let found = scan(dialect, &robot, &ReadOptions::default(), &fs::read(out).unwrap()).unwrap();
    assert_eq!(found.targets.len(), goals.len());
    let point = |pose: Isometry3<f64>| Point3::from(pose.translation.vector);
    let (mut meant, mut naive, mut predicted, mut compensated) = (vec![], vec![], vec![], vec![]);
    for ((target, q), said) in found.targets.iter().zip(&goals).zip(report["targets"].as_array().unwrap()) {
        let trupose::program::motion::Goal::Pose(pose) = &target.goal else { panic!("{target:?}") };
        if said["status"] != "reached" {
            continue;
        }
        let taken = inverse.nearest(&(pose.frame_from_tool * tool.inverse()), q).unwrap();
        meant.push(point(tool_of(nominal.chain(), q)));
        naive.push(point(tool_of(hidden, q)));
        predicted.push(point(tool_of(&identified, q)));
        compensated.push(point(tool_of(hidden, &taken)));
    }
    ([errors(&meant, &naive).0, errors(&predicted, &naive).0, errors(&meant, &compensated).0], meant.len())
}

#[test]
fn a_program_with_cartesian_targets_brings_the_hidden_arm_where_it_is_meant_to() {
    let cell = |truth| Simulation { seed: 6, truth, noise_mm: Some(0.01), ..Simulation::default() };
    // The reflector of the paper is exactly known. Elsewhere one reflector cannot tell the flange from its own place, which costs the
    // tool, away from it, what the identified model misses there.
    for (dialect, robot, simulation, times) in
        [(Dialect::Rapid, "soochow", cell(Truth::Paper), 20.0), (Dialect::Urscript, "ur5e", cell(Truth::Drawn), 2.0)]
    {
        let (found, count) = program_in_the_cell(dialect, robot, &simulation);
        let [naive, identified, compensated] = found.map(to_mm);
        let figures = format!(
            "{robot}, {dialect}, {count} targets: {naive:.4} mm naive, {identified:.5} identified, {compensated:.5} compensated"
        );
        println!("{figures}");
        assert!(count > 300 && naive > times * identified, "{figures}");
        assert!((compensated / identified - 1.0).abs() < 0.05, "{figures}");
    }
}
