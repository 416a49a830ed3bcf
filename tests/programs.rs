//! Robot programs: snapshots of every dialect, joint values read back out of the text, refusals.

use jiff::civil::date;
use trupose::profile::{Profile, builtin};
use trupose::program::{Dialect, Options, Pause, Program, ProgramError, Robot, write};
use trupose::session::plan::{PlannedPose, PoseKind};

fn profile(name: &str) -> Profile {
    Profile::parse(builtin(name).unwrap(), name).unwrap_or_else(|errors| panic!("{errors}")).0
}

/// A profile with what robots need.
struct Arm {
    profile: Profile,
    max_speeds: Vec<Option<f64>>,
    pulses_per_degree: Vec<Option<f64>>,
}

impl Arm {
    fn new(name: &str) -> Self {
        let profile = profile(name);
        let max_speeds = profile.joints().iter().map(|joint| joint.max_speed).collect();
        let pulses_per_degree = (0..profile.chain().dof()).map(|joint| Some(1000.5 + 100.25 * joint as f64)).collect();
        Self { profile, max_speeds, pulses_per_degree }
    }

    fn robot(&self) -> Robot<'_> {
        Robot {
            profile: self.profile.name(),
            chain: self.profile.chain(),
            max_speeds: &self.max_speeds,
            pulses_per_degree: &self.pulses_per_degree,
            joint_aliases: &[],
        }
    }
}

fn pose(name: &str, kind: PoseKind, degrees: &[f64]) -> PlannedPose {
    let configuration = degrees.iter().map(|angle| angle.to_radians()).collect();
    PlannedPose { pose: name.to_owned(), kind, configuration, point_in_base: None }
}

fn plan() -> Vec<PlannedPose> {
    let first = [10.0, -20.5, 30.125, -40.0, 50.001, 170.0];
    vec![
        pose("home", PoseKind::Home, &[0.0, -15.0, 20.0, 0.0, 30.0, 0.0]),
        pose("7", PoseKind::Identification, &first),
        pose("via1", PoseKind::Via, &[0.0, -30.0, 20.0, -0.0, 30.0, 0.0]),
        pose("8", PoseKind::Verification, &[-110.999, 45.0, -12.345, 120.0, -88.0, -179.999]),
        pose("7", PoseKind::Drift, &first),
        pose("home", PoseKind::Home, &[0.0, -15.0, 20.0, 0.0, 30.0, 0.0]),
    ]
}

fn options(pause: Pause) -> Options {
    Options {
        name: "Cal poses".to_owned(),
        pause,
        speed: 0.1,
        created: date(2025, 3, 9).at(14, 5, 0, 0),
        dangers: Vec::new(),
    }
}

/// The robot that a dialect is shown for.
fn arm_of(dialect: Dialect) -> Arm {
    Arm::new(match dialect {
        Dialect::Rapid => "abb_irb120",
        Dialect::Krl => "kuka_kr6_r900",
        Dialect::Fanuc | Dialect::Ros => "fanuc_lrmate200id",
        Dialect::Urscript => "ur5e",
        Dialect::Val3 => "staubli_tx2_60",
        Dialect::Inform => "soochow",
    })
}

fn shown(program: &Program) -> String {
    let files = program.files.iter().map(|file| {
        // The version would change all snapshots with every release.
        let text = file.text.replace('\r', "").replace(env!("CARGO_PKG_VERSION"), "(version)");
        format!("=== {}\n{text}", file.file_name)
    });
    files.collect::<Vec<_>>().join("\n")
}

#[test]
fn programs_read_as_their_controllers_want_them() {
    for &dialect in Dialect::ALL {
        let arm = arm_of(dialect);
        let program = write(dialect, &arm.robot(), &plan(), &options(Pause::Dwell(3.0))).unwrap();
        insta::assert_snapshot!(format!("{dialect}_dwell"), shown(&program));
        match write(dialect, &arm.robot(), &plan(), &options(Pause::Acknowledge)) {
            Ok(program) => insta::assert_snapshot!(format!("{dialect}_acknowledge"), shown(&program)),
            Err(error) => assert_eq!((dialect, error), (Dialect::Ros, ProgramError::NoOperator)),
        }
    }
}

#[test]
fn text_is_ascii_with_the_line_ends_of_the_controller() {
    let mut plan = plan();
    plan[1].pose = "Prüfung\"; end\n\u{1b}".to_owned();
    for &dialect in Dialect::ALL {
        let arm = arm_of(dialect);
        let program = write(dialect, &arm.robot(), &plan, &options(Pause::Dwell(2.5))).unwrap();
        for file in &program.files {
            assert!(file.text.bytes().all(|byte| matches!(byte, b' '..=b'~' | b'\r' | b'\n' | b'\t')), "{dialect}");
            assert!(file.text.contains("SAFETY: run it in manual mode"), "{dialect}");
            let (lines, carriage_returns) = (file.text.matches('\n').count(), file.text.matches("\r\n").count());
            let expected = if matches!(dialect, Dialect::Urscript | Dialect::Ros) { 0 } else { lines };
            assert_eq!((carriage_returns, file.text.matches('\r').count()), (expected, expected), "{dialect}");
            assert!(file.text.ends_with('\n'));
        }
    }
}

/// All numbers between `start` and `end`, for each place where `start` stands.
fn numbers_between(text: &str, start: &str, end: &str) -> Vec<Vec<f64>> {
    let parts = text.split(start).skip(1).map(|rest| rest.split(end).next().unwrap());
    parts.map(numbers).collect()
}

fn numbers(text: &str) -> Vec<f64> {
    let cells = text.split(|c: char| !(c.is_ascii_digit() || matches!(c, '-' | '.')));
    cells.filter(|cell| !cell.is_empty()).map(|cell| cell.parse().unwrap()).collect()
}

/// Numbers after `=` or a blank, without axis names such as `A1` and `J1`.
fn named_numbers(text: &str) -> Vec<f64> {
    let words = text.split(|c: char| c == ',' || c.is_whitespace() || matches!(c, '=' | '"' | '/'));
    words.filter_map(|word| word.parse().ok()).collect()
}

/// Joint values of all stops as they stand in a program: degrees, pulses or radians.
fn values(dialect: Dialect, program: &Program) -> Vec<Vec<f64>> {
    let text = program.files[0].text.as_str();
    match dialect {
        Dialect::Rapid => numbers_between(text, "MoveAbsJ [[", "]"),
        Dialect::Krl => {
            text.split("PTP {").skip(1).map(|rest| named_numbers(rest.split('}').next().unwrap())).collect()
        }
        Dialect::Fanuc => {
            text.split("UT : 1,").skip(1).map(|rest| named_numbers(rest.split('}').next().unwrap())).collect()
        }
        Dialect::Urscript => numbers_between(text, "movej([", "]"),
        Dialect::Val3 => {
            let array = text.split("jJoints").nth(1).unwrap().split("</Data>").next().unwrap();
            array.split("<Value key=").skip(1).map(|row| named_numbers(row)[1..].to_vec()).collect()
        }
        Dialect::Inform => text
            .lines()
            .filter(|line| line.starts_with('C'))
            .map(|line| numbers(line.split_once('=').unwrap().1))
            .collect(),
        Dialect::Ros => numbers_between(text, "positions: [", "]"),
    }
}

#[test]
fn joint_values_read_back_are_those_of_the_plan() {
    let plan = plan();
    for &dialect in Dialect::ALL {
        let arm = arm_of(dialect);
        let program = write(dialect, &arm.robot(), &plan, &options(Pause::Dwell(3.0))).unwrap();
        let read = values(dialect, &program);
        // In a trajectory a dwell is a second point.
        let stops: Vec<&PlannedPose> = plan
            .iter()
            .flat_map(|pose| {
                std::iter::repeat_n(pose, if dialect == Dialect::Ros && pose.kind.is_measured() { 2 } else { 1 })
            })
            .collect();
        assert_eq!(read.len(), stops.len(), "{dialect}");
        let mut largest: f64 = 0.0;
        for (values, pose) in read.iter().zip(stops) {
            assert_eq!(values.len(), 6, "{dialect}: {values:?}");
            for (joint, (value, &q)) in values.iter().zip(&pose.configuration).enumerate() {
                let (angle, expected) = match dialect {
                    // FANUC's pendant J3 is the slope of the forearm, a URDF's joint 3 the angle at the elbow.
                    Dialect::Ros if joint == 2 => (*value, q + pose.configuration[1]),
                    Dialect::Ros | Dialect::Urscript => (*value, q),
                    Dialect::Inform => ((value / arm.pulses_per_degree[joint].unwrap()).to_radians(), q),
                    _ => (value.to_radians(), q),
                };
                largest = largest.max((angle - expected).abs());
            }
        }
        let tolerance = if dialect == Dialect::Inform { 0.5_f64.to_radians() / 1000.0 } else { 6e-9 };
        assert!(largest <= tolerance, "{dialect}: {largest}");
        assert!(
            (largest - program.largest_rounding).abs() < 1e-12,
            "{dialect}: {largest} {}",
            program.largest_rounding
        );
    }
}

#[test]
fn ros_values_of_an_uncoupled_arm_are_those_of_the_pendant() {
    let arm = Arm::new("kuka_kr6_r900");
    let program = write(Dialect::Ros, &arm.robot(), &plan(), &options(Pause::Dwell(3.0))).unwrap();
    let read = values(Dialect::Ros, &program);
    assert!((read[1][0] - 10f64.to_radians()).abs() < 1e-8 && (read[1][5] - 170f64.to_radians()).abs() < 1e-8);
}

#[test]
fn seven_joints_and_sliding_joints_go_where_they_can() {
    let scara = Arm::new("epson_ls3_b401s");
    let mut stop = pose("1", PoseKind::Identification, &[30.0, -40.0, 0.0, 90.0]);
    stop.configuration[2] = -0.123_456;
    let program =
        write(Dialect::Fanuc, &scara.robot(), std::slice::from_ref(&stop), &options(Pause::Dwell(3.0))).unwrap();
    assert!(program.files[0].text.contains("J3=  -123.456  mm,\r\n\tJ4=    90.000 deg\r\n};"));
    let program = write(Dialect::Ros, &scara.robot(), &[stop], &options(Pause::Dwell(3.0))).unwrap();
    assert!(program.files[0].text.contains("[0.52359878, -0.69813170, -0.12345600, 1.57079633]"));

    let panda = Arm::new("franka_panda");
    let stop = pose("1", PoseKind::Identification, &[0.0, -45.0, 0.0, -135.0, 0.0, 90.0, 45.0]);
    assert!(write(Dialect::Ros, &panda.robot(), std::slice::from_ref(&stop), &options(Pause::Dwell(3.0))).is_ok());
    assert!(write(Dialect::Inform, &panda.robot(), &[stop], &options(Pause::Dwell(3.0))).is_ok());
}

#[test]
fn what_cannot_be_written_is_refused_with_a_reason() {
    let mut messages = String::new();
    let mut refuse = |dialect: Dialect, arm: &Arm, plan: &[PlannedPose], options: &Options| {
        let error = write(dialect, &arm.robot(), plan, options).unwrap_err();
        messages = format!("{messages}{dialect}: {error}\n");
    };
    let dwell = options(Pause::Dwell(3.0));
    let soochow = Arm::new("soochow");
    refuse(Dialect::Rapid, &soochow, &[], &dwell);
    refuse(Dialect::Rapid, &soochow, &[pose("3", PoseKind::Home, &[1.0, 2.0])], &dwell);
    refuse(Dialect::Rapid, &soochow, &[pose("3", PoseKind::Home, &[f64::NAN; 6])], &dwell);
    for dialect in [Dialect::Rapid, Dialect::Krl, Dialect::Fanuc, Dialect::Urscript, Dialect::Val3] {
        let seven = Arm::new("kuka_iiwa7");
        refuse(dialect, &seven, &[pose("1", PoseKind::Home, &[0.0; 7])], &dwell);
    }
    let scara = Arm::new("epson_ls3_b401s");
    refuse(Dialect::Inform, &scara, &[pose("1", PoseKind::Home, &[0.0; 4])], &dwell);
    let mut unknown = Arm::new("soochow");
    unknown.pulses_per_degree[2] = None;
    unknown.pulses_per_degree[4] = Some(0.0);
    unknown.max_speeds[0] = None;
    refuse(Dialect::Inform, &unknown, &plan(), &dwell);
    refuse(Dialect::Ros, &unknown, &plan(), &dwell);
    unknown.pulses_per_degree = vec![Some(1e9); 6];
    refuse(Dialect::Inform, &unknown, &plan(), &dwell);
    refuse(Dialect::Inform, &Arm::new("fanuc_lrmate200id"), &plan(), &dwell);
    refuse(Dialect::Ros, &soochow, &plan(), &options(Pause::Acknowledge));
    refuse(Dialect::Krl, &soochow, &plan(), &options(Pause::Dwell(0.0)));
    refuse(Dialect::Krl, &soochow, &plan(), &options(Pause::Dwell(3000.0)));
    refuse(Dialect::Krl, &soochow, &plan(), &Options { speed: 1.0, ..dwell });
    messages = format!("{messages}{}\n", "karel".parse::<Dialect>().unwrap_err());
    insta::assert_snapshot!(messages);
}

#[test]
fn dialects_have_names() {
    for &dialect in Dialect::ALL {
        assert_eq!(dialect.name().to_uppercase().parse(), Ok(dialect));
    }
}
