//! Robot programs of every dialect with their joint targets replaced: everything else byte by byte as it was.

use jiff::civil::date;
use trupose::profile::{Profile, builtin};
use trupose::program::motion::{Command, Companion, Goal, ReadOptions, Scan, Target};
use trupose::program::rewrite::{rewrite, scan};
use trupose::program::{Dialect, Options, Pause, ProgramError, Robot, write};
use trupose::session::plan::{PlannedPose, PoseKind};

struct Arm {
    profile: Profile,
    pulses: Vec<Option<f64>>,
    speeds: Vec<Option<f64>>,
}

impl Arm {
    fn new(name: &str) -> Self {
        let profile = Profile::parse(builtin(name).unwrap(), name).unwrap().0;
        let pulses = (0..profile.chain().dof()).map(|joint| Some(1000.5 - 300.25 * joint as f64)).collect();
        let speeds = profile.joints().iter().map(|joint| joint.max_speed).collect();
        Self { profile, pulses, speeds }
    }

    fn robot(&self) -> Robot<'_> {
        Robot {
            profile: self.profile.name(),
            chain: self.profile.chain(),
            max_speeds: &self.speeds,
            pulses_per_degree: &self.pulses,
            joint_aliases: &[],
        }
    }
}

const ARMS: [(Dialect, &str, f64); 7] = [
    (Dialect::Rapid, "abb_irb120", 1e-6),
    (Dialect::Krl, "kuka_kr6_r900", 1e-6),
    (Dialect::Fanuc, "fanuc_lrmate200id", 1e-4),
    (Dialect::Urscript, "ur5e", 1e-7),
    (Dialect::Val3, "staubli_tx2_60", 1e-6),
    (Dialect::Inform, "soochow", 1e-4),
    (Dialect::Ros, "fanuc_lrmate200id", 1e-7),
];

fn poses(shift: f64) -> Vec<PlannedPose> {
    let degrees = [
        [0.0, -15.0, 20.0, 0.0, 30.0, 0.0],
        [10.0, -20.5, 30.125, -40.0, 50.001, 170.0],
        [-99.0, 45.0, -12.345, 120.0, -88.0, -9.0],
    ];
    let configuration =
        |row: &[f64; 6]| row.iter().zip(1..).map(|(q, i)| (q + shift * f64::from(i)).to_radians()).collect();
    let row = |(index, row)| PlannedPose {
        pose: format!("{index}"),
        kind: PoseKind::Identification,
        configuration: configuration(row),
        point_in_base: None,
    };
    degrees.iter().enumerate().map(row).collect()
}

/// The file with the positions, and how to read it: together with the moves, where they are in another file.
fn written(dialect: Dialect, arm: &Arm, shift: f64) -> (Vec<u8>, ReadOptions) {
    let options = Options {
        name: "cal".to_owned(),
        pause: Pause::Dwell(3.0),
        speed: 0.1,
        created: date(2025, 3, 9).at(14, 5, 0, 0),
        dangers: Vec::new(),
    };
    let program = write(dialect, &arm.robot(), &poses(shift), &options).unwrap();
    let companion = |file: &trupose::program::ProgramFile| Companion {
        name: file.file_name.clone(),
        text: file.text.clone().into_bytes(),
    };
    let companions = program.files[1..].iter().map(companion).collect();
    (program.files[0].text.clone().into_bytes(), ReadOptions { companions, ..ReadOptions::default() })
}

fn joints(target: &Target) -> Vec<f64> {
    match &target.goal {
        Goal::Joints(joints) => joints.clone(),
        Goal::Pose(pose) => panic!("{pose:?}"),
    }
}

fn found(dialect: Dialect, arm: &str, text: &str) -> Scan {
    scan(dialect, &Arm::new(arm).robot(), &ReadOptions::default(), text.as_bytes()).unwrap()
}

#[test]
fn targets_of_every_dialect_are_read_and_replaced_as_the_writer_would_have_written_them() {
    for (dialect, name, tolerance) in ARMS {
        let arm = Arm::new(name);
        let (text, options) = written(dialect, &arm, 0.0);
        let found = scan(dialect, &arm.robot(), &options, &text).unwrap();
        // A dwell of ROS is the same point again.
        let each = if dialect == Dialect::Ros { 2 } else { 1 };
        assert_eq!(found.targets.len(), 3 * each, "{dialect}");
        assert_eq!(found.left, [], "{dialect}");
        for (target, pose) in found.targets.iter().step_by(each).zip(poses(0.0)) {
            for (read, meant) in joints(target).into_iter().zip(pose.configuration) {
                assert!((read - meant).abs() < tolerance, "{dialect}: {read} {meant}");
            }
        }
        let same: Vec<_> = found.targets.iter().map(|target| Some(Command::Joints(joints(target)))).collect();
        assert!(
            rewrite(dialect, &arm.robot(), &text, &found, &same).unwrap() == text,
            "{dialect}: the same targets change the program"
        );
        let none = vec![None; found.targets.len()];
        assert!(rewrite(dialect, &arm.robot(), &text, &found, &none).unwrap() == text, "{dialect}");
        let moved: Vec<_> =
            poses(0.25).into_iter().flat_map(|pose| vec![Some(Command::Joints(pose.configuration)); each]).collect();
        let corrected = rewrite(dialect, &arm.robot(), &text, &found, &moved).unwrap();
        let again = scan(dialect, &arm.robot(), &options, &corrected).unwrap();
        for (target, pose) in again.targets.iter().step_by(each).zip(poses(0.25)) {
            for (read, meant) in joints(target).into_iter().zip(pose.configuration) {
                assert!((read - meant).abs() < tolerance, "{dialect}: {read} {meant}");
            }
        }
        if dialect != Dialect::Ros {
            // Times of a ROS trajectory depend on the moves; all others are what the writer writes.
            assert!(corrected == written(dialect, &arm, 0.25).0, "{dialect}: {}", String::from_utf8_lossy(&corrected));
        }
    }
}

#[test]
fn bytes_that_are_no_utf8_stay() {
    let arm = Arm::new("kuka_kr6_r900");
    let text = b"; M\xfcller\r\nPTP {A1 1,A2 -90,A3 90,A4 0,A5 10,A6 0} ; Gr\xfc\xdfe {A1 3}\r\n".to_vec();
    let found = scan(Dialect::Krl, &arm.robot(), &ReadOptions::default(), &text).unwrap();
    assert_eq!((found.targets.len(), found.left.len()), (1, 0));
    let command = [0.5, -90.25, 90.0, 0.0, 10.0, 0.0].map(f64::to_radians).to_vec();
    let corrected = rewrite(Dialect::Krl, &arm.robot(), &text, &found, &[Some(Command::Joints(command))]).unwrap();
    let expected = b"; M\xfcller\r\nPTP {A1 0.50000,A2 -90.25000,A3 90.00000,A4 0.00000,A5 10.00000,A6 0.00000} ; Gr\xfc\xdfe {A1 3}\r\n";
    assert_eq!(corrected, expected);
    assert_eq!(
        scan(Dialect::Krl, &arm.robot(), &ReadOptions::default(), b"P\0T\0").unwrap_err(),
        ProgramError::NotText
    );
}

#[test]
fn what_is_no_joint_target_is_left_and_named() {
    for (dialect, arm, text, targets, left) in [
        (
            Dialect::Rapid,
            "abb_irb120",
            "CONST jointtarget a:=[[0,0,0,0,30,0],[9E9,9E9,9E9,9E9,9E9,9E9]];\n! MoveAbsJ [[1,2,3,4,5,6],[9E9,9E9,9E9,9E9,9E9,9E9]]\nTPWrite \"[[1,2,3,4,5,6],[1,2,3,4,5,6]]\";\nMoveAbsJ a,v100,fine,tool0;",
            1,
            vec![],
        ),
        (
            Dialect::Rapid,
            "abb_irb120",
            "MoveAbsJ [[0,nA,0,0,30,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v1;\nMoveL p10,v100,fine,tool0;\nMoveAbsJ [aJoints,e];",
            0,
            vec![1, 2, 3],
        ),
        (
            Dialect::Krl,
            "kuka_kr6_r900",
            "PTP {A1 10}\nPTP_REL {A1 1,A2 0,A3 0,A4 0,A5 0,A6 0}\nLIN {X 1,Y 2,Z 3,A 0,B 0,C 0}\nDECL E6AXIS XP1={E6AXIS: A1 1,A2 -90,A3 90,A4 0,A5 10,A6 0,E1 0}",
            1,
            vec![1, 2, 4],
        ),
        (
            Dialect::Fanuc,
            "fanuc_lrmate200id",
            "J P[1] 10% FINE\n/POS\nP[1]{\n GP1:\n\tUF : 0, UT : 1,\n\tX =  1.0 mm, Y = 2.0 mm\n};\nP[2]{\n GP1:\n\tJ1= 1.0 deg,\tJ2= 2.0 deg\n};\n",
            0,
            vec![3, 8],
        ),
        (
            Dialect::Urscript,
            "ur5e",
            "q1=[0,-1.5,1,0,1,0]\nq2=[1,2,3]\nother=[0,0,0,0,0,0]\nmovej(q1,a=1)\nmovej([0,d2r(90),0,0,0,0])\nmovel(p[1,2,3,4,5,6])\nmovej(get_inverse_kin(p))\n# movej([0,0,0,0,0,0])\nmovej(q2)",
            3,
            vec![7, 9],
        ),
        (
            Dialect::Val3,
            "staubli_tx2_60",
            "<Data name=\"p\" type=\"pointRx\"><Value key=\"0\" x=\"1\" y=\"2\" z=\"3\" rx=\"0\" ry=\"0\" rz=\"0\" /></Data>\n<!-- <Value j1=\"1\" j2=\"1\" j3=\"1\" j4=\"1\" j5=\"1\" j6=\"1\"/> -->\n<Data name=\"j\" type=\"jointRx\"><Value key=\"1\" j1=\"a\" j2=\"1\" j3=\"1\" j4=\"1\" j5=\"1\" j6=\"1\"/></Data>",
            0,
            vec![1, 3],
        ),
        (
            Dialect::Inform,
            "soochow",
            "///POSTYPE PULSE\n///PULSE\nC00000=1,2,3,4,5,6\nC00001=1,2\n///POSTYPE USER\nC00002=1,2,3,4,5,6\nBC00000=7\n",
            1,
            vec![4, 6],
        ),
        (
            Dialect::Ros,
            "ur5e",
            "joint_names: [J6, J1, J2, J3, J4, J5]\npoints:\n  - positions: [6, 1, 2, 3, 4, 5]\n  - positions:\n    - 0.0\n",
            1,
            vec![4],
        ),
    ] {
        let scan = found(dialect, arm, text);
        let lines: Vec<usize> = scan.left.iter().map(|left| left.line).collect();
        assert_eq!((scan.targets.len(), lines), (targets, left), "{dialect}: {text}\n{scan:?}");
        if dialect == Dialect::Ros {
            assert_eq!(joints(&scan.targets[0]), [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
        }
    }
    let arm = Arm::new("ur5e");
    let text = b"joint_names: [elbow, a, b, c, d, e]\npoints:\n";
    assert!(matches!(
        scan(Dialect::Ros, &arm.robot(), &ReadOptions::default(), text).unwrap_err(),
        ProgramError::JointNames { .. }
    ));
    let names = ["a", "b", "elbow", "c", "d", "e"].map(str::to_owned);
    let options = ReadOptions { joint_names: Some(names.to_vec()), ..ReadOptions::default() };
    assert!(scan(Dialect::Ros, &arm.robot(), &options, text).is_ok());
}
