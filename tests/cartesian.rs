//! Cartesian targets: poses of all shipped arms in their configurations, tables with every form of orientation, and the filter.

use std::fs;
use std::io::{BufRead as _, BufReader, Write as _};
use std::path::Path;
use std::process::{Command, Stdio};
use std::thread;
use std::time::Instant;

use nalgebra::{Isometry3, Vector3};
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use trupose::compensation::{Compensator, PoseGoal, Settings, ToolArm};
use trupose::inverse::{Posture, distance};
use trupose::kinematics::ForwardKinematics;
use trupose::profile::{Level, Profile, builtin, builtin_names};
use trupose::units::MICROMETRE;

use crate::support::{PROGRAM, root, skip, text, trupose};

const POSES: usize = 10_000;
const EXAMPLE: &str = "sessions/example";

fn pose(random: &mut ChaCha8Rng, reach: f64) -> Isometry3<f64> {
    let mut vector = |size: f64| Vector3::from_fn(|_, _| random.random_range(-size..size));
    Isometry3::new(vector(reach), vector(1.5))
}

/// What becomes of random poses with random tools and frames: how many are corrected, and the largest errors (m, rad).
fn corrected(name: &str, poses: usize) -> (usize, f64, f64) {
    let profile = Profile::parse(builtin(name).unwrap(), name).unwrap().0;
    let limits: Vec<_> = profile.joints().iter().map(|range| range.limits).collect();
    let mut random = ChaCha8Rng::seed_from_u64(7);
    let free = profile.parameters(Level::default());
    let deviations: Vec<_> =
        free.iter().map(|free| (free.id, 0.5 * free.expected * random.random_range(-1.0..1.0))).collect();
    let arms = [profile.chain().clone(), profile.arm().with(deviations).unwrap().chain]
        .map(|chain| ToolArm { chain, flange_from_tool: Isometry3::identity() });
    let compensator = Compensator::new(&arms[0], &arms[1], &limits, Settings::default());
    let (nominal, identified) = (ForwardKinematics::new(&arms[0].chain), ForwardKinematics::new(&arms[1].chain));
    let (mut count, mut position, mut angle) = (0, 0.0_f64, 0.0_f64);
    for _ in 0..poses {
        let q: Vec<f64> =
            limits.iter().map(|range| range.map_or(0.0, |(low, high)| random.random_range(low..high))).collect();
        let (tool, frame) = (pose(&mut random, 0.2), pose(&mut random, 1.0));
        let meant = nominal.base_from_flange(&q) * tool;
        let posture = compensator.inverse().posture(&q);
        // As a program states it: the branch, and the turns.
        let is_meant =
            |other: Option<&Posture>, turned: &[f64]| other == posture.as_ref() && distance(turned, &q) < 0.3;
        let goal = PoseGoal { base_from_tool: meant, flange_from_tool: tool, is_meant: &is_meant, near: Some(&q) };
        let Ok(done) = compensator.solve_pose(&goal) else { continue };
        count += 1;
        // The controller: its own nominal arm, in the stated configuration, for what the program says in its frame.
        let written = frame.inverse() * done.base_from_tool;
        let taken = compensator.taken(&PoseGoal { base_from_tool: frame * written, ..goal }).unwrap();
        let there = identified.base_from_flange(&taken) * tool;
        position = position.max((there.translation.vector - meant.translation.vector).norm());
        angle = angle.max(there.rotation.angle_to(&meant.rotation));
        assert_eq!(compensator.inverse().posture(&taken), posture, "{name}");
    }
    (count, position, angle)
}

#[test]
fn poses_of_all_shipped_arms_are_reached_in_their_configuration() {
    let names: Vec<&str> = builtin_names().filter(|name| *name != "epson_ls3_b401s").collect();
    let results: Vec<_> = thread::scope(|scope| {
        let runs: Vec<_> = names.iter().map(|name| scope.spawn(move || corrected(name, POSES))).collect();
        runs.into_iter().map(|run| run.join().unwrap()).collect()
    });
    for (name, (count, position, angle)) in names.iter().zip(results) {
        println!("{name:<20} {count} of {POSES} corrected, {position:.1e} m, {angle:.1e} rad");
        assert!(position < MICROMETRE && angle < 1e-6, "{name}: {position} {angle}");
        // The rest is near singularities and limits.
        assert!(count > POSES * 85 / 100, "{name}: {count}");
    }
}

fn calibration() -> String {
    format!("{EXAMPLE}/calibration.ron")
}

fn compensated(folder: &Path, table: &str, more: &[&str]) -> (i32, String, String) {
    let targets = folder.join("targets.csv");
    fs::write(&targets, table).unwrap();
    let calibration = calibration();
    let mut arguments = vec!["compensate", "--calibration", &calibration, "--targets", targets.to_str().unwrap()];
    arguments.extend(more);
    let output = trupose(&arguments);
    (output.status.code().unwrap(), text(&output.stdout), text(&output.stderr))
}

/// The joint values of the first command.
fn first_command(out: &str) -> Vec<f64> {
    let cells = out.lines().nth(1).unwrap_or_default().split(',').skip(2).take(6);
    cells.map(|cell| cell.parse().unwrap()).collect()
}

#[test]
fn every_form_of_orientation_in_a_table_is_read_or_refused() {
    let folder = tempfile::tempdir().unwrap();
    let run = |header: &str, row: &str| {
        compensated(folder.path(), &format!("pose,x_mm,y_mm,z_mm,{header}\na,900,100,800,{row}\n"), &[])
    };
    let (code, out, err) = run("roll_deg,pitch_deg,yaw_deg", "10,160,20");
    assert_eq!(code, 0, "{out}{err}");
    let expected = first_command(&out);
    let turn =
        nalgebra::UnitQuaternion::from_euler_angles(10_f64.to_radians(), 160_f64.to_radians(), 20_f64.to_radians());
    let (q, v, m) = (turn.coords, turn.scaled_axis(), turn.to_rotation_matrix());
    let m = m.matrix();
    let cells = |values: &[f64]| values.iter().map(|value| format!("{value:.12}")).collect::<Vec<_>>().join(",");
    let matrix: Vec<f64> = (0..9).map(|index| m[(index / 3, index % 3)]).collect();
    let forms = [
        ("w_deg,p_deg,r_deg", "10,160,20".to_owned()),
        ("a_deg,b_deg,c_deg", "20,160,10".to_owned()),
        ("A_rad,B_rad,C_rad", cells(&[20_f64.to_radians(), 160_f64.to_radians(), 10_f64.to_radians()])),
        ("qx,qy,qz,qw", cells(&[q.x, q.y, q.z, q.w])),
        ("qw,qx,qy,qz", cells(&[q.w, q.x, q.y, q.z])),
        ("rx_rad,ry_rad,rz_rad", cells(&[v.x, v.y, v.z])),
        ("fixed_x_deg,fixed_y_deg,fixed_z_deg", "10,160,20".to_owned()),
        ("moving_z_deg,moving_y_deg,moving_x_deg", "20,160,10".to_owned()),
        ("r11,r12,r13,r21,r22,r23,r31,r32,r33", cells(&matrix)),
    ];
    for (header, row) in forms {
        let (code, out, err) = run(header, &row);
        assert_eq!(code, 0, "{header}: {out}{err}");
        let found = first_command(&out);
        assert!(found.iter().zip(&expected).all(|(a, b)| (a - b).abs() < 1e-5), "{header}: {found:?} {expected:?}");
    }
    let refused = [
        // Angles in some controllers, a rotation vector in others.
        ("rx_deg,ry_deg,rz_deg", "10,20,30", "columns rx_deg, ry_deg and rz_deg look like an orientation"),
        ("o_deg,a_deg,t_deg", "10,20,30", "look like an orientation"),
        ("qx,qy,qz", "0,0,0", "qw is missing"),
        ("qx,qy,qz,qw", "0,0,0,0.9", "its length is 0.9000 instead of 1"),
        ("qx,qy,qz,qw,roll_deg,pitch_deg,yaw_deg", "0,0,0,1,0,0,0", "the orientation twice"),
        ("a,b,c", "10,20,30", "no unit"),
        ("heading_deg", "10", "column heading_deg looks like an orientation"),
        ("quat_x,quat_y,quat_z,quat_w", "0,0,0,1", "look like an orientation"),
        ("r11,r12,r13,r21,r22,r23,r31,r32,r33", "1,0,0,0,1,0,0,0,-1", "left-handed"),
    ];
    for (header, row, message) in refused {
        let (code, out, err) = run(header, row);
        let said = err.split_whitespace().collect::<Vec<_>>().join(" ");
        assert!(code == 2 && out.is_empty() && said.contains(message), "{header}: {code} {out}{err}");
    }
    let (_, _, err) = run("o_deg,a_deg,t_deg", "10,20,30");
    let err = err.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(err.contains("qx, qy, qz, qw (quaternion)") && err.contains("a_deg, b_deg, c_deg (KUKA)"), "{err}");
}

#[test]
fn a_table_keeps_its_columns_turns_joints_and_says_what_moved() {
    let folder = tempfile::tempdir().unwrap();
    let header = "pose,note,q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg,speed_mm_s";
    let table = |q1: &str| format!("{header}\na,\"weld, 1\",{q1},20,-30,40,50,60,100\n");
    let (code, out, err) = compensated(folder.path(), &table("350"), &[]);
    assert_eq!(code, 0, "{err}");
    let lines: Vec<&str> = out.lines().collect();
    assert!(lines[0].ends_with("left_mm,left_deg,moved_mm,moved_deg,note,speed_mm_s"), "{out}");
    assert!(lines[1].ends_with(",\"weld, 1\",100"), "{out}");
    assert!(err.contains("targets moved by ") && err.contains("the arm is known within +-"), "{err}");
    // J1 has 170 degrees to each side: 350 is -10.
    let (_, same, _) = compensated(folder.path(), &table("-10"), &[]);
    assert_eq!(out, same);
    let (code, out, err) = compensated(folder.path(), &table("-10"), &["--json"]);
    assert_eq!(code, 0, "{err}");
    let report: serde_json::Value = serde_json::from_str(&out).unwrap();
    assert_eq!(report["corrected"], 1);
    assert!(report["targets"][0]["moved_mm"].as_f64().unwrap() > 0.1, "{out}");
    assert!(report["targets"][0]["uncertainty_mm"].as_f64().unwrap() > 0.0, "{out}");
    // Beyond what is known nothing is corrected.
    let (code, out, err) = compensated(folder.path(), &table("-10"), &["--largest-uncertainty-mm", "0.0001"]);
    assert_eq!(code, 1, "{err}");
    assert!(out.contains("a,uncertain,,,,,,,") && err.contains("above the limit of 0.00 mm"), "{out}{err}");
    // Without an orientation that is said.
    let (_, _, err) = compensated(folder.path(), "pose,x_mm,y_mm,z_mm\na,900,100,800\n", &[]);
    assert!(err.contains("no orientations"), "{err}");
}

#[test]
fn the_filter_answers_every_line() {
    let calibration = calibration();
    let mut child = Command::new(PROGRAM)
        .current_dir(root())
        .args(["compensate", "--calibration", &calibration, "--stream"])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let mut input = child.stdin.take().unwrap();
    let mut output = BufReader::new(child.stdout.take().unwrap());
    let mut ask = |line: &[u8]| -> serde_json::Value {
        input.write_all(line).unwrap();
        input.write_all(b"\n").unwrap();
        let mut answer = String::new();
        output.read_line(&mut answer).unwrap();
        serde_json::from_str(&answer).unwrap()
    };
    let joints = br#"{"id":7,"joints":[10,20,-30,40,50,60]}"#;
    let answer = ask(joints);
    assert_eq!((&answer["id"], &answer["status"]), (&7.into(), &"reached".into()), "{answer}");
    let moved = answer["moved_mm"].as_f64().unwrap();
    assert!((0.1..50.0).contains(&moved), "{answer}");
    let commanded = answer["joints"].clone();
    let pose = br#"{"pose":{"xyz_mm":[900,100,800],"rpy_deg":[10,160,20]},"tool":{"xyz_mm":[0,0,100],"quaternion_xyzw":[0,0,0,1]},"near":[5,15,10,-10,90,-160]}"#;
    let answer = ask(pose);
    assert_eq!(answer["status"], "reached", "{answer}");
    assert!(answer["pose"]["xyz_mm"][0].as_f64().is_some() && answer["id"].is_null());
    // What cannot be answered is no end.
    let wrong: [&[u8]; 9] = [
        b"{",
        b"\xff\xfe",
        br#"{"id":1}"#,
        br#"{"id":1,"joints":[1,2]}"#,
        br#"{"id":1,"joints":[1,2,3,4,5,1e999]}"#,
        br#"{"id":1,"pose":{"xyz_mm":[900,100,800]}}"#,
        br#"{"id":1,"pose":{"xyz_mm":[900,100,800],"rx":1,"ry":2,"rz":3}}"#,
        br#"{"id":1,"joints":[1,2,3,4,5,6],"tool":{"xyz_mm":[0,0,1],"rpy_deg":[0,0,0]}}"#,
        br#"{"id":1,"pose":{"xyz_mm":[900,100,800],"quaternion_xyzw":[0,0,0,2]}}"#,
    ];
    for line in wrong {
        let answer = ask(line);
        assert_eq!(answer["status"], "error", "{answer}");
        assert!(answer["error"].as_str().is_some_and(|error| !error.is_empty()), "{answer}");
    }
    let far = ask(br#"{"id":2,"pose":{"xyz_mm":[9000,100,800],"rpy_deg":[0,0,0]}}"#);
    assert_eq!((&far["id"], &far["status"]), (&2.into(), &"out_of_reach".into()), "{far}");
    let ambiguous = ask(br#"{"pose":{"xyz_mm":[900,100,800],"rpy_deg":[10,160,20]}}"#);
    assert_eq!(ambiguous["status"], "ambiguous", "{ambiguous}");
    let begin = Instant::now();
    for _ in 0..100 {
        assert_eq!(ask(joints)["joints"], commanded);
    }
    println!("{:.0} us per answer", begin.elapsed().as_secs_f64() * 1e4);
    drop(input);
    assert!(child.wait().unwrap().success());
}

/// The client in the documentation, word by word.
#[test]
fn the_client_of_the_documentation_works() {
    if Command::new("python3").arg("--version").output().is_err() {
        skip("there is no python3");
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let page = fs::read_to_string(root().join("docs/compensation.md")).unwrap();
    let client = page.split("```python\n").nth(1).unwrap().split("```").next().unwrap();
    fs::write(folder.path().join("client.py"), client).unwrap();
    fs::copy(root().join(calibration()), folder.path().join("calibration.ron")).unwrap();
    let programs = Path::new(PROGRAM).parent().unwrap();
    let output = Command::new("python3")
        .current_dir(folder.path())
        .arg("client.py")
        .env("PATH", format!("{}:{}", programs.display(), std::env::var("PATH").unwrap()))
        .output()
        .unwrap();
    let (out, err) = (text(&output.stdout), text(&output.stderr));
    assert!(output.status.success(), "{out}{err}");
    assert_eq!(out.split(',').count(), 6, "{out}");
}

/// A pose without a configuration is corrected in the branch of the move before, where that move is known.
#[test]
fn a_free_pose_after_an_unknown_move_is_left() {
    let folder = tempfile::tempdir().unwrap();
    let calibration = calibration();
    let run = |between: &str| {
        let file = folder.path().join("part.script");
        let q = [0.2, 0.3, -0.2, 0.4, 0.8, 0.1];
        let profile = Profile::parse(builtin("soochow").unwrap(), "soochow").unwrap().0;
        let there = ForwardKinematics::new(profile.chain()).base_from_flange(&q);
        let (p, r) = (there.translation.vector, there.rotation.scaled_axis());
        let text = format!(
            "def part():\n  movej([0.2,0.3,-0.2,0.4,0.8,0.1])\n{between}  movel(p[{:.9},{:.9},{:.9},{:.9},{:.9},{:.9}])\nend\n",
            p.x, p.y, p.z, r.x, r.y, r.z
        );
        fs::write(&file, text).unwrap();
        let arguments = ["compensate", "--calibration", &calibration, "--dialect", "urscript", "--points", "computed"];
        let more = ["--partial", "--tool", "0,0,0,0,0,0", "--json", "--program", file.to_str().unwrap()];
        let output = trupose(&[&arguments[..], &more].concat());
        let json: serde_json::Value = serde_json::from_slice(&output.stdout)
            .unwrap_or_else(|_error| panic!("{}", String::from_utf8_lossy(&output.stderr)));
        (json["corrected"].as_u64().unwrap(), json["left"].as_u64().unwrap())
    };
    assert_eq!(run(""), (2, 0));
    for unknown in ["  goto_other_side()\n", "  movej(q_from_camera)\n"] {
        let (corrected, left) = run(unknown);
        assert!(corrected == 1 && left >= 1, "{unknown}: {corrected} corrected, {left} left");
    }
}
