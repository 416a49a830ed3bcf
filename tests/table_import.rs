//! Tables of other programs: every way to write the same readings gives the same readings, and what is not clear is refused.

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use proptest::prelude::*;
use trupose::kinematics::JointType::{self, Revolute};
use trupose::session::measurements::{
    Columns, Expected, JoinBy, Layout, Measurements, PointFile, Reading, joined, read_for,
};
use trupose::session::{TableErrors, workbook};

const JOINTS: [JointType; 3] = [Revolute; 3];

/// Rows of the plain table that every other one must equal: joints in degrees, points in mm.
const ROWS: [[f64; 6]; 3] = [
    [10.5, -20.25, 30.0, 1000.125, -200.5, 300.0],
    [11.0, 21.5, -31.0, 1001.0, 201.75, 301.5],
    [12.0, 22.0, 32.5, -999.5, 202.0, 302.0],
];

fn robot(targets: &[&str]) -> Expected<'static> {
    Expected {
        joints: &JOINTS,
        names: ["shoulder", "elbow", "wrist"].map(|name| vec![name.to_owned(), format!("{name}_joint")]).to_vec(),
        targets: targets.iter().map(|name| (*name).to_owned()).collect(),
        ..Expected::joints(&JOINTS)
    }
}

fn read(text: impl AsRef<[u8]>, reading: &Reading) -> Result<Measurements, TableErrors> {
    read_for(&robot(&["smr"]), Layout::Named, reading, text, "t")
}

fn assert_same(table: &Measurements, what: &str) {
    assert_eq!(table.rows.len(), ROWS.len(), "{what}: {:?}", table.rows);
    for (row, expected) in table.rows.iter().zip(ROWS) {
        let found = row.configuration.iter().map(|value| value.to_degrees());
        let found: Vec<f64> = found.chain(row.point.iter().map(|value| value * 1000.0)).collect();
        let is_same = found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-9);
        assert!(is_same, "{what}: {found:?} is not {expected:?}");
    }
}

/// The rows with this text before, between and after the numbers.
fn written(header: &str, between: &str, number: impl Fn(usize, f64) -> String) -> String {
    let row = |row: &[f64; 6]| {
        row.iter().enumerate().map(|(index, value)| number(index, *value)).collect::<Vec<_>>().join(between)
    };
    let rows: Vec<String> = ROWS.iter().map(row).collect();
    format!("{header}\n{}\n", rows.join("\n"))
}

fn plain(_: usize, value: f64) -> String {
    value.to_string()
}

fn comma(_: usize, value: f64) -> String {
    value.to_string().replace('.', ",")
}

#[test]
fn every_way_to_write_the_same_table_gives_the_same_readings() {
    let inside = |index: usize, value: f64| if index < 3 { value.to_radians() } else { value / 1000.0 }.to_string();
    let zero_based = "joint_0 [deg],joint_1 [deg],joint_2 [deg],x [mm],y [mm],z [mm]";
    for (header, between, number) in [
        ("q1_deg,q2_deg,q3_deg,x_mm,y_mm,z_mm", ",", &plain as &dyn Fn(usize, f64) -> String),
        ("q1_deg q2_deg  q3_deg x_mm y_mm z_mm", "   ", &plain),
        ("q1_deg q2_deg q3_deg x_mm y_mm z_mm", " ", &comma),
        ("q1_deg|q2_deg|q3_deg|x_mm|y_mm|z_mm", " | ", &plain),
        ("q1_deg;q2_deg;q3_deg;x_mm;y_mm;z_mm", ";", &comma),
        ("q1_deg\tq2_deg\tq3_deg\tx_mm\ty_mm\tz_mm", "\t", &comma),
        ("# tracker 3\n% one\n// two\n! three\nq1_deg,q2_deg,q3_deg,x_mm,y_mm,z_mm", ",", &plain),
        ("q1,q2,q3,x,y,z\ndeg,deg,deg,mm,mm,mm", ",", &plain),
        ("q1,q2,q3,x,y,z\n[deg],[deg],[deg],[mm],[mm],[mm]", ",", &plain),
        ("q1 [deg],q2 [deg],q3 [deg],x [mm],y [mm],z [mm]", ",", &plain),
        ("J1 (deg) J2 (deg) J3 (deg) X (mm) Y (mm) Z (mm)", " ", &plain),
        ("A1 [°],A2 [°],A3 [°],X/mm,Y/mm,Z/mm", ",", &plain),
        ("theta_1 [rad],theta_2 [rad],theta_3 [rad],m_03 [m],m_13 [m],m_23 [m]", ",", &inside),
        ("Achse1_Grad;Achse2_Grad;Achse3_Grad;X_mm;Y_mm;Z_mm", ";", &comma),
        ("axe 1 (degrés);axe 2 (degrés);axe 3 (degrés);mesure x (mm);mesure y (mm);mesure z (mm)", ";", &comma),
        ("关节1（度）,关节2（度）,关节3（度）,X坐标（毫米）,Y坐标（毫米）,Z坐标（毫米）", ",", &plain),
        ("第1軸[度],第2軸[度],第3軸[度],X座標[ミリ],Y座標[ミリ],Z座標[ミリ]", ",", &plain),
        ("shoulder_joint [deg],elbow [deg],Wrist Joint [deg],x_mm,y_mm,z_mm", ",", &plain),
        ("arm_left_1_joint [deg],arm_left_2_joint [deg],arm_left_3_joint [deg],x1_mm,y1_mm,z1_mm", ",", &plain),
        (zero_based, ",", &plain),
        ("% q1_deg,q2_deg,q3_deg,x_mm,y_mm,z_mm", ",", &plain),
        ("// Units: Millimeters, degrees\nq1,q2,q3,x,y,z", ",", &plain),
    ] {
        let text = written(header, between, number);
        for text in [text.clone(), text.replace('\n', "\r\n"), text.replace('\n', "\r"), format!("\u{feff}{text}")] {
            let table = read(&text, &Reading::default()).unwrap_or_else(|errors| panic!("{errors}\n{text}"));
            assert_same(&table, &text);
        }
    }
}

#[test]
fn glued_exports_lose_their_repeated_names() {
    let once = written("q1,q2,q3,x,y,z\ndeg,deg,deg,mm,mm,mm", ",", plain);
    let (head, rows) = once.split_at(once.find("10.5").unwrap());
    let first = rows.lines().take(1).map(|line| format!("{line}\n")).collect::<Vec<String>>().concat();
    let rest = rows.lines().skip(1).map(|line| format!("{line}\n")).collect::<Vec<String>>().concat();
    let table = read(format!("{head}{first}{head}{rest}"), &Reading::default()).unwrap();
    assert_same(&table, "glued");
    assert!(table.understood.notes.iter().any(|note| note.contains("1 line repeats")), "{:?}", table.understood.notes);
}

#[test]
fn columns_are_taken_as_a_person_names_them() {
    let text = written("a,b,c,d,e,f", ",", plain);
    let columns: Columns = "q1_deg=a, q2_deg=B, q3_deg=#3, x_mm=d, y_mm=e, z_mm=f".parse().unwrap();
    let reading = Reading { columns: Some(columns), ..Reading::default() };
    assert_same(&read(&text, &reading).unwrap(), "named");
    let listed =
        Reading { columns: Some("q1_deg,q2_deg,q3_deg,x_mm,y_mm,z_mm".parse().unwrap()), ..Reading::default() };
    assert_same(&read(written("", ",", plain).trim_start(), &listed).unwrap(), "no names");
    let units = Reading { units: "deg,mm".parse().unwrap(), ..Reading::default() };
    assert_same(&read(written("J1,J2,J3,X,Y,Z", ",", plain), &units).unwrap(), "units");

    for (header, columns, expected) in [
        ("a,b,c,d,e,f", "q1_deg=a, q2_deg=b, q3_deg=c, x_mm=d, y_mm=e, z_mm=g", "there is no column 'g'"),
        (
            "a,b,c,d,e,f",
            "q1_deg=a, q2_deg=b, q3_deg=c, x_mm=d, y_mm=e, z_mm=#7",
            "there is no column '#7'; columns: 6 columns",
        ),
        (
            "a,b,c,d [m],e,f",
            "q1_deg=a, q2_deg=b, q3_deg=c, x_mm=d, y_mm=e, z_mm=f",
            "the name states 'm', but 'x_mm' is asked for",
        ),
        ("a,b,c,d,e,f", "q1_deg,q2_deg,x_mm,y_mm,z_mm", "5 columns are listed, but the table has 6"),
    ] {
        let reading = Reading { columns: Some(columns.parse().unwrap()), ..Reading::default() };
        let errors = read(written(header, ",", plain), &reading).unwrap_err().to_string();
        assert!(errors.contains(expected), "{errors}");
    }
}

/// What a refused table proposes reads it, once a person has confirmed it.
/// Pasted back, it would read counts of an encoder as angles.
#[test]
fn joints_in_another_unit_get_no_proposal() {
    for name in ["q#_pulse", "J# [pulse]", "A#_cnt", "axis # (counts)"] {
        let names: Vec<String> = (1..=3).map(|joint| name.replace('#', &joint.to_string())).collect();
        let text = format!("{},x_mm,y_mm,z_mm\n137112,43846,-7934,1,2,3\n82174,28755,42835,2,3,4\n", names.join(","));
        let errors = read(&text, &Reading::default()).unwrap_err();
        assert_eq!(
            errors.understood.as_ref().and_then(|understood| understood.proposal.clone()),
            None,
            "{name}: {errors}"
        );
    }
}

#[test]
fn a_proposal_can_be_pasted_back() {
    for text in [
        written("Point;A1;A2;A3;X;Y;Z", ";", |index, value| {
            if index == 0 { format!("P;{}", comma(0, value)) } else { comma(index, value) }
        }),
        written(
            "field.position0,field.position1,field.position2,field.point.x,field.point.y,field.point.z",
            ",",
            plain,
        ),
        written("", "  ", plain).trim_start().to_owned(),
        written("u,v,w,X,Y,Z", ",", plain),
    ] {
        let errors = read(&text, &Reading::default()).unwrap_err();
        let proposal =
            errors.understood.as_ref().unwrap().proposal.clone().unwrap_or_else(|| panic!("{errors}\n{text}"));
        let columns = proposal.parse().unwrap_or_else(|error| panic!("{proposal}: {error}"));
        let table = read(&text, &Reading { columns: Some(columns), ..Reading::default() });
        assert_same(&table.unwrap_or_else(|errors| panic!("{errors}\n{proposal}")), &proposal);
    }
}

#[test]
fn several_smrs_in_one_row_are_targets_of_the_profile() {
    let text = "pose,q1_deg,q2_deg,q3_deg,x1_mm,y1_mm,z1_mm,x2_mm,y2_mm,z2_mm\nA,1,2,3,10,20,30,11,21,31\nB,2,3,4,12,22,32,0,0,0\n";
    let expected = robot(&["left", "right"]);
    let skipping = Reading { skip_missing: true, ..Reading::default() };
    let table = read_for(&expected, Layout::Named, &skipping, text, "t").unwrap();
    let found: Vec<(&str, Option<&str>, f64)> =
        table.rows.iter().map(|row| (row.pose.as_str(), row.target.as_deref(), (row.point.x * 1e3).round())).collect();
    assert_eq!(found, [("A", Some("left"), 10.0), ("A", Some("right"), 11.0), ("B", Some("left"), 12.0)]);
    assert!(table.understood.notes.iter().any(|note| note.contains("left out, without a point: line 3")));
    let zero = read_for(&expected, Layout::Named, &Reading::default(), text, "t").unwrap_err();
    assert!(zero.problems.iter().all(trupose::session::TableProblem::is_without_point), "{zero}");
    let few = read_for(&robot(&["smr"]), Layout::Named, &skipping, text, "t").unwrap_err().to_string();
    assert!(few.contains("every row has 2 points, but the profile has 1 target ('smr')"), "{few}");
}

#[test]
fn a_column_may_count_the_targets() {
    let text = "q1_deg,q2_deg,q3_deg,x_mm,y_mm,z_mm,SMR\n1,2,3,10,20,30,1\n1,2,3,11,21,31,2\n";
    let table = read_for(&robot(&["left", "right"]), Layout::Named, &Reading::default(), text, "t").unwrap();
    let targets: Vec<_> = table.rows.iter().map(|row| row.target.as_deref()).collect();
    assert_eq!(targets, [Some("left"), Some("right")]);
    let few = read_for(&robot(&["smr"]), Layout::Named, &Reading::default(), text, "t").unwrap_err().to_string();
    assert!(few.contains("column 'SMR' names 2 targets ('1', '2'), but the profile has 1 target ('smr')"), "{few}");
}

fn point_file(text: &str, target: Option<&str>) -> PointFile {
    PointFile { name: "points".to_owned(), content: text.as_bytes().to_vec(), target: target.map(str::to_owned) }
}

fn join(joints: &str, points: &[PointFile], by: Option<JoinBy>, targets: &[&str]) -> Result<Measurements, TableErrors> {
    let reading = Reading { units: "deg,mm".parse().unwrap(), ..Reading::default() };
    joined(&robot(targets), (&reading, &reading), ("joints", joints.as_bytes()), points, by)
}

#[test]
fn joints_and_points_of_two_files_are_joined() {
    let joints = "10.5 -20.25 30\n11 21.5 -31\n12 22 32.5\n";
    let points = "A::Cal::P1, 1000.125, -200.5, 300\nA::Cal::P2, 1001, 201.75, 301.5\nA::Cal::P3, -999.5, 202, 302\n";
    let table = join(joints, &[point_file(points, None)], None, &["smr"]).unwrap_or_else(|errors| panic!("{errors}"));
    assert_same(&table, "by row");
    assert_eq!(table.rows[1].pose, "P2");

    // By name, in another order, with other decimal signs.
    let named = "Name;J1;J2;J3\nP3;12;22;32,5\nP1;10,5;-20,25;30\nP2;11;21,5;-31\nP4;1;2;3\n";
    let table = join(named, &[point_file(points, None)], None, &["smr"]).unwrap_or_else(|errors| panic!("{errors}"));
    assert_same(&table, "by name");

    let timed = "time,q1,q2,q3\n99.9,10.5,-20.25,30\n100,10.5,-20.25,30\n105,11,21.5,-31\n110,12,22,32.5\n";
    let seen = "t,x,y,z\n100.2,1000.125,-200.5,300\n104.9,1001,201.75,301.5\n110,-999.5,202,302\n";
    let table = join(timed, &[point_file(seen, None)], Some(JoinBy::Time), &["smr"])
        .unwrap_or_else(|errors| panic!("{errors}"));
    assert_same(&table, "by time");
    let moving = timed.replace("99.9,10.5", "99.9,10.9");
    let errors = join(&moving, &[point_file(seen, None)], Some(JoinBy::Time), &["smr"]).unwrap_err().to_string();
    assert!(errors.contains("the robot moved within 0.5 s"), "{errors}");
    let late = seen.replace("110,", "120,");
    let errors = join(timed, &[point_file(&late, None)], Some(JoinBy::Time), &["smr"]).unwrap_err().to_string();
    assert!(errors.contains("no joints were read within 0.5 s"), "{errors}");

    // A row that is missing would shift all that follow.
    let short = points.lines().take(2).map(|line| format!("{line}\n")).collect::<Vec<String>>().concat();
    let errors = join(joints, &[point_file(&short, None)], None, &["smr"]).unwrap_err().to_string();
    assert!(errors.contains("it has 2 rows, but 'joints' has 3: rows are missing somewhere"), "{errors}");
    let errors = join(named, &[point_file(&points.replace("P2", "P9"), None)], None, &["smr"]).unwrap_err().to_string();
    assert!(errors.contains("has no joints for the points 'P9'"), "{errors}");
    let errors = join(&named.replace("P4", "P1"), &[point_file(points, None)], None, &["smr"]).unwrap_err().to_string();
    assert!(errors.contains("the pose 'P1' is in it twice"), "{errors}");

    // One file for each SMR.
    let both = [point_file(points, None), point_file(&points.replace("1000.125", "1000.5"), None)];
    let table = join(joints, &both, None, &["left", "right"]).unwrap_or_else(|errors| panic!("{errors}"));
    assert_eq!(table.rows.len(), 6);
    assert_eq!(table.rows[3].target.as_deref(), Some("right"));
    let errors = join(joints, &both, None, &["smr"]).unwrap_err().to_string();
    assert!(errors.contains("there are 2 files of points, and the profile has 1 target"), "{errors}");
}

/// A workbook of stored parts.
fn workbook(sheets: &[(&str, &str)], shared: &str) -> Vec<u8> {
    let mut parts = vec![("xl/sharedStrings.xml".to_owned(), format!("<sst>{shared}</sst>"))];
    let (mut names, mut links) = (String::new(), String::new());
    for (index, (name, cells)) in sheets.iter().enumerate() {
        names.extend([format!("<sheet name=\"{name}\" r:id=\"r{index}\"/>")]);
        links.extend([format!("<Relationship Id=\"r{index}\" Target=\"worksheets/sheet{index}.xml\"/>")]);
        parts.push((
            format!("xl/worksheets/sheet{index}.xml"),
            format!("<worksheet><sheetData>{cells}</sheetData></worksheet>"),
        ));
    }
    parts.push((
        "xl/workbook.xml".to_owned(),
        format!("<workbook xmlns:r=\"urn:r\"><sheets>{names}</sheets></workbook>"),
    ));
    parts.push(("xl/_rels/workbook.xml.rels".to_owned(), format!("<Relationships>{links}</Relationships>")));
    let (mut file, mut directory) = (Vec::new(), Vec::new());
    for (name, text) in &parts {
        let offset = u32::try_from(file.len()).unwrap();
        let (size, length) = (u32::try_from(text.len()).unwrap(), u16::try_from(name.len()).unwrap());
        file.extend(b"PK\x03\x04\x14\0\0\0\0\0\0\0\0\0\0\0\0\0");
        file.extend([size.to_le_bytes(), size.to_le_bytes()].concat());
        file.extend([length.to_le_bytes(), [0, 0]].concat());
        file.extend(name.bytes().chain(text.bytes()));
        directory.extend(b"PK\x01\x02\x14\0\x14\0\0\0\0\0\0\0\0\0\0\0\0\0");
        directory.extend([size.to_le_bytes(), size.to_le_bytes()].concat());
        directory.extend(length.to_le_bytes());
        directory.extend([0; 12]);
        directory.extend(offset.to_le_bytes());
        directory.extend(name.bytes());
    }
    let (start, size) = (u32::try_from(file.len()).unwrap(), u32::try_from(directory.len()).unwrap());
    let count = u16::try_from(parts.len()).unwrap();
    file.extend(directory);
    file.extend(b"PK\x05\x06\0\0\0\0");
    file.extend([count.to_le_bytes(), count.to_le_bytes()].concat());
    file.extend([size.to_le_bytes(), start.to_le_bytes()].concat());
    file.extend([0, 0]);
    file
}

fn sheet() -> (String, String) {
    let names = ["J1 [deg]", "J2 [deg]", "J3 [deg]", "X [mm]", "Y [mm]", "Z [mm]"];
    let shared = names.iter().map(|name| format!("<si><r><t>{name}</t></r></si>")).collect::<Vec<String>>().concat();
    let mut rows = String::from("<row r=\"2\">");
    for (index, letter) in ["A", "B", "C", "D", "E", "F"].iter().enumerate() {
        rows.extend([format!("<c r=\"{letter}2\" t=\"s\"><v>{index}</v></c>")]);
    }
    rows += "</row>";
    for (index, row) in ROWS.iter().enumerate() {
        let cells = row.iter().map(|value| format!("<c><v>{value:e}</v></c>")).collect::<Vec<String>>().concat();
        rows.extend([format!("<row r=\"{}\">{cells}</row>", index + 4)]);
    }
    (rows, shared)
}

#[test]
fn a_sheet_of_a_workbook_is_a_table() {
    let (rows, shared) = sheet();
    let file = workbook(&[("Notes", ""), ("Data", &rows)], &shared);
    let text = workbook::sheet_text(&file, "t", None).unwrap();
    let table = read(&text, &Reading::default()).unwrap_or_else(|errors| panic!("{errors}\n{text}"));
    assert_same(&table, &text);
    assert_eq!(table.rows[0].line, 4);
    let two = workbook(&[("A", &rows), ("B", &rows)], &shared);
    let errors = workbook::sheet_text(&two, "t", None).unwrap_err().to_string();
    assert!(errors.contains("it has several sheets with cells ('A', 'B'); say which one"), "{errors}");
    assert!(workbook::sheet_text(&two, "t", Some("B")).is_ok());
    let errors = workbook::sheet_text(&two, "t", Some("C")).unwrap_err().to_string();
    assert!(errors.contains("it has no sheet 'C'; sheets: 'A', 'B'"), "{errors}");
    let far = workbook(&[("A", "<row r=\"1048576\"><c r=\"XFD1048576\"><v>1</v></c></row>")], "");
    let errors = workbook::sheet_text(&far, "t", None).unwrap_err().to_string();
    assert!(errors.contains("a cell is in row 1048576"), "{errors}");
}

fn run(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_trupose")).args(arguments).current_dir(folder).output().unwrap()
}

fn said(output: &Output) -> String {
    let words = [&output.stdout[..], &output.stderr].concat();
    String::from_utf8_lossy(&words).split_whitespace().collect::<Vec<_>>().join(" ")
}

/// The way of a person: refused, the proposal pasted back and saved, the next table of the same kind read under its name.
#[test]
fn a_layout_is_saved_beside_the_profile_and_used_again() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    fs::create_dir(path.join("cell")).unwrap();
    let profile = trupose::profile::builtin("abb_irb120").unwrap();
    fs::write(path.join("cell/arm.ron"), profile).unwrap();
    let mut text = "Nr;A1;A2;A3;A4;A5;A6;X;Y;Z\n".to_owned();
    for (index, point) in ["600,1;10,5;900,25", "500,1;210,5;800,25", "400,1;310,5;700,25"].iter().enumerate() {
        text.extend([format!("{index};{index},5;12,5;20,5;30;40;50;{point}\n")]);
    }
    fs::write(path.join("kuka.csv"), &text).unwrap();
    let refused = run(path, &["import", "kuka.csv", "--profile", "cell/arm.ron"]);
    assert_eq!(refused.status.code(), Some(2));
    let words = said(&refused);
    let proposal = words.split("--columns '").nth(1).unwrap().split('\'').next().unwrap().to_owned();
    let done = run(
        path,
        &[
            "import",
            "kuka.csv",
            "--profile",
            "cell/arm.ron",
            "--columns",
            &proposal,
            "--save-layout",
            "kuka",
            "--rows",
            "--out",
            "points.csv",
        ],
    );
    let words = said(&done);
    assert_eq!(done.status.code(), Some(0), "{words}");
    assert!(
        words.contains("3 readings, 3 poses, target 'smr'") && words.contains("600.1000 10.5000 900.2500"),
        "{words}"
    );
    assert!(path.join("cell/kuka.layout.ron").is_file());
    let again =
        run(path, &["import", "kuka.csv", "--profile", "cell/arm.ron", "--layout", "kuka", "--out", "again.csv"]);
    assert_eq!(again.status.code(), Some(0), "{}", said(&again));
    assert_eq!(fs::read(path.join("points.csv")).unwrap(), fs::read(path.join("again.csv")).unwrap());
    let unknown =
        run(path, &["identify", "--measurements", "kuka.csv", "--profile", "cell/arm.ron", "--layout", "faro"]);
    assert!(
        said(&unknown).contains("there is no 'faro' here") && said(&unknown).contains("--save-layout faro"),
        "{}",
        said(&unknown)
    );
    // `identify` reads the same table by the same layout: three points are too few for it, but they were read.
    let read = run(path, &["identify", "--measurements", "kuka.csv", "--profile", "cell/arm.ron", "--layout", "kuka"]);
    assert!(!said(&read).contains("has no unit") && !said(&read).contains("joint columns"), "{}", said(&read));
}

/// What a table says about itself is not lost: that it is simulated, that it was changed, and the columns for filters.
#[test]
fn marks_and_other_columns_survive() {
    let folder = tempfile::tempdir().unwrap();
    let example = fs::read_to_string(crate::support::root().join("sessions/example/measurements.csv")).unwrap();
    fs::write(folder.path().join("points.csv"), &example).unwrap();
    let arguments = ["import", "points.csv", "--profile", "soochow", "--out", "again.csv"];
    let done = run(folder.path(), &arguments);
    assert_eq!(done.status.code(), Some(0), "{}", said(&done));
    assert!(said(&done).contains("WARNING: SIMULATED"), "{}", said(&done));
    let again = fs::read_to_string(folder.path().join("again.csv")).unwrap();
    assert!(
        again.starts_with("# SIMULATED: ") && again.contains("sigma_mm,kind\n") && again.contains(",identification\n"),
        "{again}"
    );
    let changed = example.replacen("44.786", "44.787", 1);
    fs::write(folder.path().join("points.csv"), changed).unwrap();
    let refused = run(folder.path(), &arguments);
    assert_eq!(refused.status.code(), Some(2));
    assert!(said(&refused).contains("the table has changed since the program wrote it"), "{}", said(&refused));
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, ..ProptestConfig::default() })]

    #[test]
    fn random_bytes_and_texts_never_panic(bytes in prop::collection::vec(any::<u8>(), 0..300), text in "[q-z0-9_,;|\\t \\n\"'#%!/.:A-J\\[\\]()-]{0,200}") {
        for reading in [Reading::default(), Reading { skip_missing: true, units: "deg,mm".parse().unwrap(), ..Reading::default() }] {
            drop(read(&bytes, &reading));
            drop(read(&text, &reading));
            drop(joined(&robot(&["a", "b"]), (&reading, &reading), ("j", text.as_bytes()), &[point_file(&text, None)], None));
        }
        drop(workbook::sheet_text(&bytes, "t", None));
        drop(text.parse::<Columns>());
    }

    /// A table with one changed character is read as before, refused, or has that cell changed: no other number moves.
    #[test]
    fn a_changed_character_moves_no_other_cell(at in 0_usize..400, to in "[0-9,;. \\t|\"a-z-]") {
        let text = written("Point;J1 [deg];J2 [deg];J3 [deg];X [mm];Y [mm];Z [mm]", ";", |index, value| if index == 0 { format!("P{value};{}", comma(0, value)) } else { comma(index, value) });
        let names = text.lines().next().unwrap().chars().count();
        let place = text.char_indices().map(|(place, _)| place).nth(names + at % (text.chars().count() - names)).unwrap();
        let changed: String = text.char_indices().map(|(index, c)| if index == place { to.chars().next().unwrap() } else { c }).collect();
        if let Ok(table) = read(&changed, &Reading::default()) {
            let mut moved = 0;
            for (row, expected) in table.rows.iter().zip(ROWS) {
                let found = row.configuration.iter().map(|value| value.to_degrees()).chain(row.point.iter().map(|value| value * 1000.0));
                moved += found.zip(expected).filter(|(a, b)| (a - b).abs() > 1e-9).count();
            }
            prop_assert!(moved <= 1 || table.rows.len() != ROWS.len(), "{changed}\n{:?}", table.rows);
        }
    }

    #[test]
    fn damaged_workbooks_never_panic(at in any::<prop::sample::Index>(), byte in any::<u8>(), cut in any::<prop::sample::Index>()) {
        let (rows, shared) = sheet();
        let mut file = workbook(&[("Data", &rows)], &shared);
        let place = at.index(file.len());
        file[place] = byte;
        drop(workbook::sheet_text(&file, "t", None));
        file.truncate(cut.index(file.len()));
        drop(workbook::sheet_text(&file, "t", None));
    }
}
