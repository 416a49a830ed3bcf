//! Measurement tables: layouts and units, laws on random tables and random bytes, and real files.

use std::fs;

use crate::support::measured_data;
use nalgebra::Point3;
use proptest::prelude::*;
use trupose::kinematics::JointType::{self, Prismatic, Revolute};
use trupose::session::constraints::{Constraints, read_constraints};
use trupose::session::filter::Filter;
use trupose::session::measurements::{self, Layout, Row, read, read_as, write};

fn close(a: f64, b: f64, tolerance: f64) -> bool {
    (a - b).abs() <= tolerance
}

#[test]
fn units_become_metre_and_radian() {
    let joints = [Revolute, Revolute, Prismatic];
    let text = "z_in,Q1_DEG,q2_rad,q3_mm,x_m,y_um,sigma_um,temperature_degc,note\n2,90,-1.5,250,1.5,2e6,10,21.5,ok\n";
    let table = read(text, "units.csv", &joints).unwrap();
    let row = &table.rows[0];
    let expected = [90f64.to_radians(), -1.5, 0.25];
    assert!(row.configuration.iter().zip(expected).all(|(&a, b)| close(a, b, 1e-15)), "{row:?}");
    assert!((row.point - Point3::new(1.5, 2.0, 0.0508)).norm() < 1e-15, "{row:?}");
    assert!(close(row.sigma.unwrap(), 10e-6, 1e-18));
    assert_eq!(row.temperature, Some(21.5));
    assert_eq!((row.line, row.pose.as_str(), row.target.as_deref()), (2, "0", None));
    assert_eq!(table.columns[0], "pose");
    assert_eq!((table.columns.len(), row.fields.last().map(String::as_str)), (row.fields.len(), Some("ok")));
}

#[test]
fn separators_decimal_commas_and_line_endings_make_no_difference() {
    let plain = "pose,q1_deg,x_mm,y_mm,z_mm,sigma_mm\nA,1.5,100.25,200,300,\nB,2.5,101.25,200,300,0.01\n";
    let expected = read(plain, "t", &[Revolute]).unwrap();
    for text in [
        plain.replace('\n', "\r\n"),
        plain.replace(',', ";"),
        plain.replace(',', "\t").replace('.', ","),
        plain.replace(',', ";").replace('.', ","),
        format!("\u{feff}{plain}\n\n,,,,,\n"),
        plain.replace("A,", "\"A\" ,"),
    ] {
        let read = read(text.as_bytes(), "t", &[Revolute]).unwrap();
        let same = read.rows.iter().zip(&expected.rows).all(|(a, b)| {
            (&a.pose, &a.configuration, a.point, a.sigma, a.line)
                == (&b.pose, &b.configuration, b.point, b.sigma, b.line)
        });
        assert!(same && read.rows.len() == 2 && read.warnings.is_empty(), "{text}");
    }
}

#[test]
fn copies_are_kept_and_marked_and_repeated_readings_are_fine() {
    let text = "pose,q1_deg,x_mm,y_mm,z_mm\n1,10,1,2,3\n1,10,1,2,3.001\n1,10,1,2,3\n2,20,4,5,6\n";
    let table = read(text, "t", &[Revolute]).unwrap();
    assert_eq!((table.rows.len(), table.duplicates.as_slice(), table.warnings.len()), (4, &[2][..], 1));
    let distinct: Vec<usize> = table.distinct_rows().map(|row| row.line).collect();
    assert_eq!(distinct, [2, 3, 5]);
}

#[test]
fn robodk_and_delmia_are_read_by_place() {
    let robodk = "J1,J2,J3,J4,J5,J6,X,Y,Z,TX,TY,TZ\n\
                  90,2,3,4,5,6,1000,8,9,0,0,100\n1,2,3,4,5,7,1001,8,9,50,0,100\n";
    let table = read_as(Layout::RoboDk, robodk, "t", &[Revolute; 6]).unwrap();
    assert!(close(table.rows[0].configuration[0], 90f64.to_radians(), 1e-15));
    assert!(close(table.rows[0].point.x, 1.0, 1e-15));
    let targets: Vec<_> = table.rows.iter().map(|row| row.target.as_deref()).collect();
    assert_eq!(targets, [Some("tcp1"), Some("tcp2")]);
    assert!(Filter::parse("tcp_x_mm == 50").unwrap().matches(&table.columns, &table.rows[1].fields, 3).unwrap());

    let commented = robodk.replacen("J1", "# J1", 1);
    let table = read_as(Layout::RoboDk, &commented, "t", &[Revolute; 6]).unwrap();
    assert_eq!((table.rows.len(), table.warnings.len()), (2, 0));

    let delmia = "Tag\tJ1\tJ2\tX\tY\tZ\nP7\t180\t500\t1000\t2\t3\n";
    let table = read_as("DELMIA".parse().unwrap(), delmia, "t", &[Revolute, Prismatic]).unwrap();
    let row = &table.rows[0];
    assert_eq!((row.pose.as_str(), row.configuration[1], row.point.x), ("P7", 0.5, 1.0));
}

#[test]
fn socket_rows_are_grouped_in_file_order() {
    let text = "position,socket,row,q1_rad\nleft,0,0,1\nright,0,0,2\nleft,0,1,3\nright,0,1,4\n";
    let Constraints::SharedPoints(points) = read_constraints(text, "t", &[Revolute]).unwrap() else { panic!("kind") };
    let groups: Vec<_> = points
        .groups
        .iter()
        .map(|group| {
            (group.position.as_str(), group.samples.iter().map(|row| row.configuration[0]).collect::<Vec<_>>())
        })
        .collect();
    assert_eq!(groups, [("left", vec![1.0, 3.0]), ("right", vec![2.0, 4.0])]);
}

#[test]
fn lengths_are_metres_between_two_configurations() {
    let text = "from_q1_deg,to_q1_rad,length_in,sigma_mm\n180,1,10,0.02\n";
    let Constraints::Lengths(lengths) = read_constraints(text, "t", &[Revolute]).unwrap() else { panic!("kind") };
    let row = &lengths.rows[0];
    assert!(close(row.length, 0.254, 1e-15) && close(row.sigma.unwrap(), 2e-5, 1e-18));
    assert!(close(row.from[0], std::f64::consts::PI, 1e-15) && close(row.to[0], 1.0, 0.0));
}

#[test]
fn filters_choose_rows() {
    let columns = ["pose", "position", "x_mm", "my note"].map(str::to_owned);
    let fields = ["34", "back'center", "-12,5", ""].map(str::to_owned);
    for (text, expected) in [
        ("pose % 17 == 0", true),
        ("pose % 17 != 0", false),
        ("x_mm % 10 == 7.5", true),
        ("x_mm<-12 and x_mm>=-12.5", true),
        ("position == 'back''center'", true),
        ("not position != 'back''center'", true),
        ("pose == '34.0'", false),
        ("POSE == 34.0", true),
        ("\"my note\" == ''", true),
        ("pose == 1 or pose == 34 and x_mm > 0", false),
        ("(pose == 34 or pose == 1) and not (x_mm > 0)", true),
        // The cell of the second comparison is no number, but the first decides.
        ("pose == 34 or position < 3", true),
    ] {
        let filter = Filter::parse(text).unwrap();
        filter.check(&columns).unwrap();
        assert_eq!(filter.matches(&columns, &fields, 2), Ok(expected), "{text}");
    }
}

#[test]
fn deep_filters_are_refused_and_long_ones_are_not() {
    for text in ["(".repeat(100_000), "not ".repeat(100_000)] {
        assert!(Filter::parse(&text).unwrap_err().to_string().contains("nested too deeply"));
    }
    assert!(Filter::parse(&vec!["pose == 1"; 10_000].join(" or ")).is_ok());
}

#[test]
fn measured_tables_of_others_are_read() {
    let Some(folder) = measured_data("") else { return };
    let text = |name: &str| fs::read_to_string(folder.join(name)).unwrap();
    for (name, rows) in
        [("ur5/grid.csv", 1000), ("ur5/random.csv", 20), ("ur10/series_b.csv", 1495), ("ur10/series_c.csv", 2773)]
    {
        let table = read(text(name), name, &[Revolute; 6]).unwrap_or_else(|errors| panic!("{errors}"));
        println!("{name}: {} warnings", table.warnings.len());
        table.warnings.iter().take(3).for_each(|warning| println!("  {warning}"));
        assert_eq!(table.rows.len(), rows);
        if name == "ur5/grid.csv" {
            let filter = Filter::parse("pose % 17 == 0").unwrap();
            let chosen = table.rows.iter().filter(|row| filter.matches(&table.columns, &row.fields, row.line).unwrap());
            assert_eq!(chosen.count(), 59);
        }
    }
    for (name, rows) in [("panda_1", 182), ("panda_2_clean", 497), ("panda_3", 387)] {
        let name = format!("ball_socket/{name}.csv");
        let read = read_constraints(text(&name), &name, &[Revolute; 7]).unwrap_or_else(|errors| panic!("{errors}"));
        let Constraints::SharedPoints(points) = read else { panic!("{name}") };
        println!("{name}: {} groups, {} warnings", points.groups.len(), points.warnings.len());
        points.warnings.iter().take(3).for_each(|warning| println!("  {warning}"));
        assert_eq!(points.groups.iter().map(|group| group.samples.len()).sum::<usize>(), rows);
    }
}

const JOINTS: [JointType; 3] = [Revolute, Prismatic, Revolute];

fn rows() -> impl Strategy<Value = Vec<Row>> {
    let length = -20.0..20.0f64;
    let row = (
        "[A-Za-z0-9_ #,;\"'é.-]{0,8}",
        prop::option::of("[A-Z#,\"]{1,3}"),
        (-7.0..7.0f64, length.clone(), -7.0..7.0f64),
        (length.clone(), length.clone(), 0.001..20.0f64),
        prop::option::of(1e-6..1e-2f64),
        prop::option::of(-40.0..120.0f64),
    );
    prop::collection::vec(row, 1..20).prop_map(|rows| {
        let row =
            |(index, (pose, target, q, p, sigma, temperature)): (usize, (String, _, (f64, f64, f64), _, _, _))| {
                let (x, y, z): (f64, f64, f64) = p;
                Row {
                    line: index + 2,
                    // Unique, and without blanks at the ends, which reading takes off.
                    pose: format!("{}_{index}", pose.trim_start()),
                    target,
                    configuration: vec![q.0, q.1, q.2],
                    point: Point3::new(x, y, z),
                    sigma,
                    temperature,
                    fields: Vec::new(),
                }
            };
        rows.into_iter().enumerate().map(row).collect()
    })
}

proptest! {
    // A failure prints its input; no file is left behind.
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn written_tables_read_back(rows in rows()) {
        let text = write(&rows, &JOINTS);
        let table = read(&text, "t", &JOINTS).map_err(|errors| TestCaseError::fail(format!("{errors}\n{text}")))?;
        prop_assert_eq!(table.rows.len(), rows.len());
        for (read, row) in table.rows.iter().zip(&rows) {
            prop_assert_eq!((read.line, &read.pose, &read.target), (row.line, &row.pose, &row.target));
            prop_assert_eq!(read.temperature, row.temperature);
            for (a, b) in read.configuration.iter().zip(&row.configuration) {
                prop_assert!(close(*a, *b, 1.1e-9), "{a} {b}");
            }
            prop_assert!((read.point - row.point).amax() < 1.1e-9);
            prop_assert_eq!(read.sigma.is_some(), row.sigma.is_some());
            prop_assert!(close(read.sigma.unwrap_or(0.0), row.sigma.unwrap_or(0.0), 1.1e-9));
        }
        // What was read is written alike: nothing drifts from save to save.
        prop_assert_eq!(write(&table.rows, &JOINTS), text);
    }

    #[test]
    fn random_bytes_never_panic(bytes in prop::collection::vec(any::<u8>(), 0..300)) {
        survive(&bytes);
    }

    #[test]
    fn damaged_tables_never_panic(
        rows in rows(),
        damage in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>(), 0..3usize), 1..6),
    ) {
        let mut bytes = write(&rows, &JOINTS).into_bytes();
        for (place, byte, kind) in damage {
            let at = place.index(bytes.len());
            match kind {
                0 => bytes[at] = byte,
                1 => bytes.insert(at, b",;\t\"\n\r#.-e"[usize::from(byte) % 10]),
                _ => bytes.truncate(at + 1),
            }
        }
        survive(&bytes);
    }

    #[test]
    fn random_filters_never_panic(text in ".{0,60}", words in prop::collection::vec(0..14usize, 0..12)) {
        let columns = vec!["a".to_owned()];
        let vocabulary =
            ["a", "a", "and", "or", "not", "(", ")", "%", "==", "<", "3", "-1e3", "'x'", "\"a\""];
        let phrase: Vec<&str> = words.into_iter().map(|word| vocabulary[word]).collect();
        for text in [text, phrase.join(" ")] {
            match Filter::parse(&text) {
                Ok(filter) => drop(filter.matches(&columns, &["3".to_owned()], 1)),
                Err(error) => prop_assert!(!error.to_string().is_empty()),
            }
        }
    }
}

/// Reads in every way; errors must have a text without control characters.
fn survive(bytes: &[u8]) {
    let errors = Layout::ALL
        .iter()
        .filter_map(|layout| read_as(*layout, bytes, "t", &JOINTS).err())
        .chain(read_as(Layout::RoboDk, bytes, "t", &[Revolute; 6]).err())
        .chain(read_constraints(bytes, "t", &JOINTS).err());
    for error in errors {
        assert!(!error.problems.is_empty());
        assert!(!error.to_string().chars().any(|c| c.is_control() && c != '\n'), "{error}");
    }
}

#[test]
fn the_header_in_the_hint_is_read() {
    let text = format!("{}\nA,S1,1,2,3,4,5,6\n", measurements::header(&JOINTS));
    assert_eq!(read(&text, "t", &JOINTS).unwrap().rows.len(), 1);
}
