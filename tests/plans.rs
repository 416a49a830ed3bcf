//! Plans as text: what is read, what is refused, and that written ones read back.

use nalgebra::Point3;
use proptest::prelude::*;
use trupose::kinematics::JointType::{self, Prismatic, Revolute};
use trupose::session::plan::PoseKind::{Drift, Home, Identification, Verification, Via};
use trupose::session::plan::{PlannedPose, PoseKind, header, read, write};

const JOINTS: [JointType; 3] = [Revolute, Prismatic, Revolute];

#[test]
fn a_plain_list_is_a_plan() {
    let plan = read("pose,q1_deg,q2_mm,q3_rad\nA,90,250,-1.5\nB,10,0,0\n", "list.csv", &JOINTS).unwrap();
    assert!(plan.warnings.is_empty());
    let kinds: Vec<PoseKind> = plan.rows.iter().map(|row| row.kind).collect();
    assert_eq!(kinds, [PoseKind::Identification; 2]);
    assert_eq!((plan.rows[0].pose.as_str(), plan.rows[0].point_in_base), ("A", None));
    let expected = [90f64.to_radians(), 0.25, -1.5];
    assert!(plan.rows[0].configuration.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-15));
    let numbered = read("q1_deg;q2_mm;q3_deg\r\n90,5;250;1\r\n", "list.csv", &JOINTS).unwrap();
    assert_eq!(numbered.rows[0].pose, "0");
}

#[test]
fn kinds_points_and_other_columns_are_read() {
    let text = "\
pose,kind,q1_deg,q2_mm,q3_deg,x_mm,y_mm,z_mm,note
home,HOME,0,0,0,,,,
1,,10,20,30,100,200,300,first
2,verification,11,21,31,1,2,3,
1,drift,10,20,30,100,200,300,
v,via,0,5,0,1,2,3,
home,home,0,0,0,,,,
";
    let plan = read(text, "plan.csv", &JOINTS).unwrap();
    let kinds: Vec<PoseKind> = plan.rows.iter().map(|row| row.kind).collect();
    assert_eq!(kinds, [Home, Identification, Verification, Drift, Via, Home]);
    assert_eq!(plan.rows[1].point_in_base, Some(Point3::new(0.1, 0.2, 0.3)));
    assert_eq!(plan.rows[0].point_in_base, None);
    assert!(plan.warnings.is_empty());
}

#[test]
fn defects_are_named_with_place_and_remedy() {
    let header = header(&JOINTS);
    let mut messages = String::new();
    for (name, text) in [
        ("kind.csv", format!("{header}\n1,identify,1,2,3\n2,Verification,1,2,4\n")),
        ("several.csv", format!("{header}\n1,identification,1,x,3\n,home,1,2,\n2,via,1,2\n")),
        ("nothing.csv", format!("{header}\nhome,home,0,0,0\n")),
        ("empty.csv", format!("{header}\n")),
        ("no_text.csv", String::new()),
        ("units.csv", "pose,q1,q2_mm,q3_deg\n1,1,2,3\n".to_owned()),
        ("joints.csv", "pose,q1_deg,q2_mm\n1,1,2\n".to_owned()),
        ("point.csv", format!("{header},x_mm,y_mm\n1,identification,1,2,3,4,5\n")),
        ("moved.csv", format!("{header}\n1,identification,1,2,3\n1,drift,1,2,3.5\n")),
    ] {
        let errors = read(&text, name, &JOINTS).unwrap_err();
        messages = format!("{messages}{errors}\n\n");
    }
    let twice = format!("{header}\n1,identification,1,2,3\n2,verification,1,2,3\n1,drift,1,2,3\n");
    let plan = read(&twice, "twice.csv", &JOINTS).unwrap();
    assert_eq!(plan.warnings.len(), 1);
    messages = format!("{messages}{}\n", plan.warnings[0]);
    insta::assert_snapshot!(messages);
}

fn rows() -> impl Strategy<Value = Vec<PlannedPose>> {
    let row = (
        "[A-Za-z0-9_ #,;\"'é.-]{0,8}",
        0..PoseKind::ALL.len(),
        (-7.0..7.0_f64, -2.0..2.0_f64, -7.0..7.0_f64),
        prop::option::of(prop::array::uniform3(-5.0..5.0_f64)),
    );
    prop::collection::vec(row, 1..20).prop_map(|rows| {
        let numbered = rows.into_iter().enumerate();
        numbered
            .map(|(index, (pose, kind, q, point))| PlannedPose {
                // Unique, and without blanks at the ends, which reading takes off.
                pose: format!("{}_{index}", pose.trim_start()),
                kind: if index == 0 { PoseKind::Verification } else { PoseKind::ALL[kind] },
                configuration: vec![q.0, q.1, q.2],
                point_in_base: point.map(Point3::from),
            })
            .collect()
    })
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn written_plans_read_back(rows in rows()) {
        let text = write(&rows, &JOINTS);
        let plan = read(&text, "t", &JOINTS).map_err(|errors| TestCaseError::fail(format!("{errors}\n{text}")))?;
        prop_assert_eq!(plan.rows.len(), rows.len());
        for (read, row) in plan.rows.iter().zip(&rows) {
            prop_assert_eq!((&read.pose, read.kind), (&row.pose, row.kind));
            for (a, b) in read.configuration.iter().zip(&row.configuration) {
                prop_assert!((a - b).abs() < 1.1e-9, "{a} {b}");
            }
            prop_assert_eq!(read.point_in_base.is_some(), row.point_in_base.is_some());
            if let (Some(a), Some(b)) = (read.point_in_base, row.point_in_base) {
                prop_assert!((a - b).amax() < 1e-6);
            }
        }
        // What was read is written the same again.
        prop_assert_eq!(write(&plan.rows, &JOINTS), text);
    }

    #[test]
    fn no_bytes_make_the_reader_panic(bytes in prop::collection::vec(any::<u8>(), 0..200)) {
        let _outcome = read(&bytes, "t", &JOINTS);
        let headed = [header(&JOINTS).as_bytes(), b"\n", bytes.as_slice()].concat();
        let _outcome = read(&headed, "t", &JOINTS);
    }
}
