//! Every table in `tests/measurements/invalid` has one defect (the names say which); its message is a snapshot.

use std::fs;
use std::path::PathBuf;

use crate::support::root;
use trupose::kinematics::JointType;
use trupose::session::constraints::read_constraints;
use trupose::session::filter::Filter;
use trupose::session::measurements::{Layout, read, read_as};

const JOINTS: [JointType; 3] = [JointType::Revolute; 3];

#[test]
fn defects_are_named_with_place_and_remedy() {
    let folder = root().join("tests/measurements/invalid");
    let mut files: Vec<PathBuf> = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    files.sort();
    assert!(files.len() >= 20);
    let mut messages = String::new();
    for file in files {
        let name = file.file_name().unwrap().to_str().unwrap();
        let bytes = fs::read(&file).unwrap();
        let errors = if name.starts_with("constraints_") {
            read_constraints(&bytes, name, &JOINTS).expect_err(name)
        } else {
            read(&bytes, name, &JOINTS).expect_err(name)
        };
        messages = format!("{messages}{errors}\n\n");
    }
    insta::assert_snapshot!(messages);
}

#[test]
fn a_table_for_a_sliding_joint_is_refused_in_degrees() {
    let joints = [JointType::Prismatic, JointType::Revolute];
    let errors = read("q1_deg,q2_deg,x_mm,y_mm,z_mm\n1,2,3,4,5\n", "rail.csv", &joints).unwrap_err();
    insta::assert_snapshot!(errors);
}

#[test]
fn imported_layouts_say_what_they_need() {
    let mut messages = String::new();
    let six = [JointType::Revolute; 6];
    for (layout, text, joints) in [
        (Layout::RoboDk, "names\n1,2,3,4,5,6,7,8,9\n", &six[..]),
        (Layout::RoboDk, "names\n1,2,3,4,5,6,7,8,9,0,0,100\n", &JOINTS[..]),
        (Layout::RoboDk, "names\n", &six[..]),
        (Layout::Delmia, "names\nP1;1;2;3;7;8;9\n", &JOINTS[..]),
        (Layout::Delmia, "names\nP1\t1\t2\tx\t7\t8\t9\n", &JOINTS[..]),
    ] {
        let errors = read_as(layout, text, "imported.txt", joints).unwrap_err();
        messages = format!("{messages}{errors}\n\n");
    }
    messages = format!("{messages}{}\n", "igrip".parse::<Layout>().unwrap_err());
    insta::assert_snapshot!(messages);
}

#[test]
fn warnings_name_both_rows() {
    let text = "\
pose,target,q1_deg,q2_deg,q3_deg,x_mm,y_mm,z_mm
0,A,10,20,30,1000.1,200.2,300.3
1,A,11,21,31,1001.1,201.2,301.3
0,A,10,20,30,1000.1,200.2,300.3
2,A,12,22,32,1001.1,201.2,301.3
2,B,12,22,32,1001.1,201.2,301.3
";
    let measurements = read(text, "odd.csv", &JOINTS).unwrap();
    let sockets = "\
position,socket,q1_deg,q2_deg,q3_deg
left,0,10,20,30
left,0,11,21,31
left,0,10,20,30
left,1,10,20,30
";
    let lengths = "\
from_q1_deg,from_q2_deg,from_q3_deg,to_q1_deg,to_q2_deg,to_q3_deg,length_mm
1,2,3,4,5,6,100
1,2,3,4,5,6,100
";
    let numbers = "1,2,3,4,5,6,700,8,9,0,0,100\n1,2,3,4,5,7,701,8,9,0,0,100\n";
    let ignored = read_as(Layout::RoboDk, numbers, "robodk.csv", &[JointType::Revolute; 6]).unwrap();
    let mut warnings = measurements.warnings;
    for text in [sockets, lengths] {
        use trupose::session::constraints::Constraints;
        warnings.extend(match read_constraints(text, "odd.csv", &JOINTS).unwrap() {
            Constraints::SharedPoints(points) => points.warnings,
            Constraints::Lengths(lengths) => lengths.warnings,
            Constraints::Contacts(contacts) => contacts.warnings,
        });
    }
    warnings.extend(ignored.warnings);
    let lines: Vec<String> = warnings.iter().map(ToString::to_string).collect();
    insta::assert_snapshot!(lines.join("\n"));
}

#[test]
fn filters_show_where_they_stop_making_sense() {
    let mut messages = String::new();
    for text in [
        "",
        "pose",
        "pose = 3",
        "pose % 17",
        "pose % 0 == 0",
        "pose % 'x' == 0",
        "position != backcenter",
        "position < 'backcenter'",
        "pose % 2 == 'a'",
        "'pose' == 3",
        "(pose == 1 and x_mm > 3",
        "pose == 1)",
        "pose == 1 pose == 2",
        "pose == 1 && x_mm > 3",
        "!(pose == 1)",
        "position == 'back",
        "pose == 1e",
        "pose == 1 and",
        "pöse == 1 and \u{1b}[2J",
    ] {
        messages = format!("{messages}{}\n\n", Filter::parse(text).unwrap_err());
    }
    let columns = ["pose", "position"].map(str::to_owned);
    let filter = Filter::parse("pos % 2 == 0").unwrap();
    messages = format!("{messages}{}\n\n", filter.check(&columns).unwrap_err());
    let filter = Filter::parse("position < 3").unwrap();
    let fields = ["1", "left"].map(str::to_owned);
    messages = format!("{messages}{}\n", filter.matches(&columns, &fields, 12).unwrap_err());
    insta::assert_snapshot!(messages);
}
