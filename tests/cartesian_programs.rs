//! Programs with Cartesian targets, through the command line: what is corrected, what is refused, and what the arm then does.

use std::fs;
use std::path::Path;

use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion, Vector3};
use serde_json::Value;
use trupose::inverse::InverseKinematics;
use trupose::kinematics::ForwardKinematics;
use trupose::profile::{Profile, builtin};
use trupose::program::Dialect;
use trupose::session::calibration::Calibration;
use trupose::units::{MICROMETRE, from_mm, to_mm};

use crate::support::{invented, root, text, trupose};

const CALIBRATION: &str = "sessions/example/calibration.ron";

struct Cell {
    profile: Profile,
    identified: trupose::kinematics::Arm,
}

impl Cell {
    fn new() -> Self {
        let calibration = Calibration::parse(&fs::read_to_string(root().join(CALIBRATION)).unwrap()).unwrap();
        let profile = Profile::parse(builtin("soochow").unwrap(), "soochow").unwrap().0;
        let identified = calibration.identified(&profile).unwrap();
        Self { profile, identified }
    }

    fn nominal(&self, degrees: [f64; 6]) -> Isometry3<f64> {
        ForwardKinematics::new(self.profile.chain()).base_from_flange(&degrees.map(f64::to_radians))
    }

    /// Where the real arm brings the tool when its controller gets a pose near these joint values.
    fn reached(&self, base_from_tool: &Isometry3<f64>, tool: &Isometry3<f64>, near: [f64; 6]) -> Isometry3<f64> {
        let limits: Vec<_> = self.profile.joints().iter().map(|range| range.limits).collect();
        let inverse = InverseKinematics::new(self.profile.chain(), &limits);
        let q = inverse.nearest(&(base_from_tool * tool.inverse()), &near.map(f64::to_radians)).unwrap();
        ForwardKinematics::new(&self.identified.chain).base_from_flange(&q) * tool
    }
}

fn tool() -> Isometry3<f64> {
    Isometry3::new(Vector3::new(0.01, 0.0, 0.15), Vector3::zeros())
}

fn frame() -> Isometry3<f64> {
    Isometry3::new(Vector3::new(0.5, -0.2, 0.1), Vector3::new(0.0, 0.0, 0.3))
}

const TARGETS: [[f64; 6]; 4] = [
    [10.0, 20.0, -30.0, 40.0, 50.0, 60.0],
    [12.0, 22.0, -28.0, 35.0, 52.0, 58.0],
    [15.0, 25.0, -26.0, 30.0, 55.0, 55.0],
    [18.0, 20.0, -20.0, 25.0, 60.0, 50.0],
];

fn pose_of(pose: &Isometry3<f64>) -> String {
    let (p, q) = (pose.translation.vector.map(to_mm), pose.rotation);
    format!("[{:.4},{:.4},{:.4}],[{:.9},{:.9},{:.9},{:.9}]", p.x, p.y, p.z, q.w, q.i, q.j, q.k)
}

/// A module with its tool and frame; the last target is reached by `last`.
fn module(cell: &Cell, last: &str) -> String {
    let targets: Vec<String> = TARGETS
        .iter()
        .enumerate()
        .map(|(index, q)| {
            let pose = frame().inverse() * cell.nominal(*q) * tool();
            let quarter = |joint: usize| (q[joint] / 90.0).floor();
            format!(
                "  CONST robtarget p{index}:=[{},[{},{},{},0],[9E9,9E9,9E9,9E9,9E9,9E9]];",
                pose_of(&pose),
                quarter(0),
                quarter(3),
                quarter(5)
            )
        })
        .collect();
    format!(
        "MODULE Part\n  PERS tooldata gun:=[TRUE,[{}],[1,[0,0,1],[1,0,0,0],0,0,0]];\n  \
         PERS wobjdata table:=[FALSE,TRUE,\"\",[{}],[[0,0,0],[1,0,0,0]]];\n{}\n  PROC main()\n    \
         MoveJ p0,v100,fine,gun\\WObj:=table;\n    MoveL p1,v100,z10,gun\\WObj:=table;\n    \
         MoveC p2,p3,v100,fine,gun\\WObj:=table;\n{last}  ENDPROC\nENDMODULE\n",
        pose_of(&tool()),
        pose_of(&frame()),
        targets.join("\n")
    )
}

fn run(folder: &Path, program: &str, more: &[&str]) -> (i32, String, String) {
    let file = folder.join("part.mod");
    fs::write(&file, program).unwrap();
    let mut arguments =
        vec!["compensate", "--calibration", CALIBRATION, "--dialect", "rapid", "--program", file.to_str().unwrap()];
    arguments.extend(more);
    let output = trupose(&arguments);
    let joined = text(&output.stderr).split_whitespace().collect::<Vec<_>>().join(" ");
    (output.status.code().unwrap(), text(&output.stdout), joined)
}

/// The poses of the robtargets of a module.
fn written(program: &str) -> Vec<Isometry3<f64>> {
    let lines = program.lines().filter(|line| line.contains("robtarget"));
    let pose = |line: &str| {
        let numbers = line.split_once(":=").unwrap().1.split([',', '[', ']', ';']);
        let numbers: Vec<f64> =
            numbers.filter(|cell| !cell.is_empty()).take(7).map(|cell| cell.parse().unwrap()).collect();
        let rotation = UnitQuaternion::from_quaternion(Quaternion::new(numbers[3], numbers[4], numbers[5], numbers[6]));
        let place = Translation3::new(from_mm(numbers[0]), from_mm(numbers[1]), from_mm(numbers[2]));
        Isometry3::from_parts(place, rotation)
    };
    lines.map(pose).collect()
}

#[test]
fn cartesian_targets_bring_the_identified_arm_where_they_were_meant() {
    let (cell, folder) = (Cell::new(), tempfile::tempdir().unwrap());
    let program = module(&cell, "");
    let (code, out, err) = run(folder.path(), &program, &["--points", "computed"]);
    assert_eq!(code, 0, "{out}{err}");
    assert!(err.contains("4 of 4 Cartesian targets corrected") && err.contains("targets moved by "), "{err}");
    assert!(err.contains("between the targets of linear and circular moves the path deviates by "), "{err}");
    let poses = written(&out);
    assert_eq!(poses.len(), 4);
    for (pose, q) in poses.iter().zip(TARGETS) {
        let meant = cell.nominal(q) * tool();
        let there = cell.reached(&(frame() * pose), &tool(), q);
        let off = (there.translation.vector - meant.translation.vector).norm();
        // The program has decimals of 0.1 um and more.
        assert!(off < MICROMETRE, "{off}");
        assert!(there.rotation.angle_to(&meant.rotation) < 2e-6);
        // Without compensation it is elsewhere.
        assert!((cell.reached(&meant, &tool(), q).translation.vector - meant.translation.vector).norm() > 1e-4);
    }
    let same = |text: &str| -> Vec<String> {
        text.lines().filter(|line| !line.contains("robtarget")).map(str::to_owned).collect()
    };
    assert_eq!(same(&out), same(&program));
}

#[test]
fn points_must_be_stated_and_taught_ones_stay() {
    let (cell, folder) = (Cell::new(), tempfile::tempdir().unwrap());
    let program = module(&cell, "");
    let (code, out, err) = run(folder.path(), &program, &[]);
    assert_eq!((code, out.as_str()), (2, ""), "{err}");
    assert!(err.contains("computed or taught?") && err.contains("--points computed"), "{err}");
    let (code, out, err) = run(folder.path(), &program, &["--points", "taught"]);
    assert_eq!((code, out.as_str()), (2, ""), "{err}");
    assert!(err.contains("they were recorded where the real arm was"), "{err}");
}

#[test]
fn a_path_is_corrected_as_a_whole_or_not_at_all() {
    let (cell, folder) = (Cell::new(), tempfile::tempdir().unwrap());
    let program = module(&cell, "    MoveL Offs(p3,0,0,50),v100,fine,gun\\WObj:=table;\n");
    let (code, out, err) = run(folder.path(), &program, &["--points", "computed"]);
    assert_eq!((code, out.as_str()), (1, ""), "{err}");
    assert!(err.contains("would stay uncorrected beside corrected ones") && err.contains("'--partial'"), "{err}");
    let (code, out, err) = run(folder.path(), &program, &["--points", "computed", "--partial"]);
    assert!(code == 1 && out.contains("Offs(p3,0,0,50)"), "{err}");
    assert!(err.contains("an offset"), "{err}");
}

#[test]
fn a_tool_that_is_not_in_the_program_comes_from_an_option() {
    let (cell, folder) = (Cell::new(), tempfile::tempdir().unwrap());
    let whole = module(&cell, "");
    let program: String = whole.split_inclusive('\n').filter(|line| !line.contains("tooldata")).collect();
    let (code, _, err) = run(folder.path(), &program, &["--points", "computed"]);
    assert!(
        code == 1 && err.contains("its tool 'gun' is not in the given files; give '--tool gun=x,y,z,rx,ry,rz'"),
        "{err}"
    );
    let (_, expected, _) = run(folder.path(), &whole, &["--points", "computed"]);
    for option in ["gun=10,0,150,0,0,0", "GUN=10,0,150,0,0,0", "10,0,150,0,0,0"] {
        let (code, out, err) = run(folder.path(), &program, &["--points", "computed", "--tool", option]);
        assert_eq!(code, 0, "{err}");
        for (one, other) in written(&out).iter().zip(written(&expected)) {
            assert!((one.translation.vector - other.translation.vector).norm() < 2e-7);
        }
    }
    let (code, _, err) = run(folder.path(), &program, &["--points", "computed", "--tool", "gun=1,2"]);
    assert!(code == 2 && err.contains("is no pose"), "{err}");
}

#[test]
fn the_result_is_reported_and_drawn() {
    let (cell, folder) = (Cell::new(), tempfile::tempdir().unwrap());
    let (out_file, picture) = (folder.path().join("out.mod"), folder.path().join("targets.rrd"));
    let options =
        ["--points", "computed", "--json", "--out", out_file.to_str().unwrap(), "--record", picture.to_str().unwrap()];
    let (code, out, err) = run(folder.path(), &module(&cell, ""), &options);
    assert_eq!(code, 0, "{err}");
    let report: Value = serde_json::from_str(&out).unwrap();
    assert_eq!((report["corrected"].as_u64(), report["left"].as_u64()), (Some(4), Some(0)), "{out}");
    let targets = report["targets"].as_array().unwrap();
    assert!(targets.iter().all(|target| target["moved_mm"].as_f64().unwrap() > 0.1 && target["status"] == "reached"));
    assert_eq!(report["paths"].as_array().unwrap().len(), 2, "{out}");
    assert!(fs::metadata(&picture).unwrap().len() > 500 && out_file.exists());
    // Nothing is corrected where the arm is not known.
    let (code, _, err) =
        run(folder.path(), &module(&cell, ""), &["--points", "computed", "--largest-uncertainty-mm", "0.001"]);
    assert!(code == 1 && err.contains("above the limit of 0.00 mm"), "{err}");
}

/// Two targets far apart, and a third one behind an offset.
fn long_path(dialect: Dialect, poses: &[Isometry3<f64>], confs: &[String]) -> String {
    let numbers =
        |values: &[f64], decimals: usize| values.iter().map(|value| format!("{value:.decimals$}")).collect::<Vec<_>>();
    let mm = |pose: &Isometry3<f64>| numbers(pose.translation.vector.map(to_mm).as_slice(), 4);
    match dialect {
        Dialect::Rapid => {
            let target =
                |index: usize| format!("[{},{},[9E9,9E9,9E9,9E9,9E9,9E9]]", pose_of(&poses[index]), confs[index]);
            format!(
                "MODULE M\r\n  CONST robtarget pB:={};\r\n  PROC main()\r\n    MoveJ {},v100,fine,tool0;\r\n    MoveL pB,v100,fine,tool0\\WObj:=wobj0; ! there\r\n    \
                 IF diA=1 MoveL {},v100,fine,tool0;\r\n    MoveL pB,v100,fine,tool0;\r\n  ENDPROC\r\nENDMODULE\r\n",
                target(1),
                target(0),
                target(0)
            )
        }
        Dialect::Krl => {
            let target = |pose: &Isometry3<f64>| {
                let (c, b, a) = pose.rotation.euler_angles();
                let turn = numbers(&[a, b, c].map(f64::to_degrees), 5);
                let values = [mm(pose), turn].concat();
                let named =
                    ["X", "Y", "Z", "A", "B", "C"].iter().zip(values).map(|(name, value)| format!("{name} {value}"));
                format!("{{{}}}", named.collect::<Vec<_>>().join(","))
            };
            format!(
                "DEF x()\n$TOOL=$NULLFRAME\n$BASE=$NULLFRAME\nPTP {{A1 10,A2 -70,A3 100,A4 5,A5 50,A6 20}}\nLIN {}\nLIN {}\n;comment\nTRIGGER WHEN \
                 DISTANCE=0 DELAY=0 DO $OUT[1]=TRUE\nLIN {}\nEND\n",
                target(&poses[0]),
                target(&poses[1]),
                target(&poses[0])
            )
        }
        _ => {
            let target = |pose: &Isometry3<f64>| {
                let (p, r) = (pose.translation.vector, pose.rotation.scaled_axis());
                format!("p[{}]", numbers(&[p.x, p.y, p.z, r.x, r.y, r.z], 8).join(", "))
            };
            format!(
                "def x():\n  set_tcp(p[0,0,0,0,0,0])\n  movej([0.08,-1.57,1.57,-1.57,-1.57,0.17])\n  movel({}, a=1.2)\n  $ 3 \"W\"\n  movel({}, a=1.2, v=0.1)\n  \
                 sleep(1)\n  movel({}, a=1.2)\nend\n",
                target(&poses[0]),
                target(&poses[1]),
                target(&poses[0])
            )
        }
    }
}

#[test]
fn points_are_inserted_only_where_the_arm_surely_comes_from_the_target_before() {
    let folder = tempfile::tempdir().unwrap();
    for (dialect, arm, base) in [
        (Dialect::Rapid, "abb_irb120", [10.0, 20.0, 10.0, 5.0, 60.0, 20.0]),
        (Dialect::Krl, "kuka_kr6_r900", [10.0, -70.0, 100.0, 5.0, 50.0, 20.0]),
        (Dialect::Urscript, "ur5e", [5.0, -90.0, 90.0, -90.0, -90.0, 10.0]),
    ] {
        let profile = Profile::parse(builtin(arm).unwrap(), arm).unwrap().0;
        let forward = ForwardKinematics::new(profile.chain());
        let ends = [base, [base[0] + 25.0, base[1] + 5.0, base[2] - 8.0, base[3] + 3.0, base[4] + 6.0, base[5] + 10.0]];
        let poses = ends.map(|q| forward.base_from_flange(&q.map(f64::to_radians)));
        let confs = ends.map(|q| {
            let quarter = |joint: usize| (q[joint] / 90.0).floor();
            format!("[{},{},{},0]", quarter(0), quarter(3), quarter(5))
        });
        let (calibration, file) = (folder.path().join(arm), folder.path().join("program"));
        fs::write(&calibration, invented::calibration(arm).to_text().unwrap()).unwrap();
        let program = long_path(dialect, &poses, &confs);
        fs::write(&file, &program).unwrap();
        let name = dialect.to_string();
        let compensate = |more: &[&str]| {
            let fixed = ["compensate", "--points", "computed", "--dialect", &name];
            let files = ["--calibration", calibration.to_str().unwrap(), "--program", file.to_str().unwrap()];
            let output = trupose(&[&fixed[..], &files, more].concat());
            assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
            (text(&output.stdout), text(&output.stderr).split_whitespace().collect::<Vec<_>>().join(" "))
        };
        let (plain, _) = compensate(&[]);
        let (json, _) = compensate(&["--json"]);
        let report: Value = serde_json::from_str(&json).unwrap();
        let worst = report["paths"]
            .as_array()
            .unwrap()
            .iter()
            .map(|path| path["corrected_mm"].as_f64().unwrap())
            .fold(0.0, f64::max);
        // Not even a tenth of the deviation is left.
        let limit = format!("{}", 0.1 * worst);
        let (divided, said) = compensate(&["--insert", &limit]);
        let (json, _) = compensate(&["--insert", &limit, "--json"]);
        let report: Value = serde_json::from_str(&json).unwrap();
        let paths = report["paths"].as_array().unwrap();
        let inserted: u64 = paths.iter().filter_map(|path| path["inserted"].as_u64()).sum();
        println!("{arm}: {worst:.4} mm, {inserted} points: {said}");
        assert!(inserted >= 3, "{json}");
        assert!(said.contains("would need more points and cannot get them"), "{said}");
        let moved: Vec<&Value> = paths.iter().filter(|path| path["inserted"].is_u64()).collect();
        assert!(moved.iter().all(|path| path["corrected_mm"].as_f64().unwrap() <= 0.1 * worst), "{json}");
        // Only lines were added, and they are moves that do not stop.
        let mut rest = plain.lines().peekable();
        let added: Vec<&str> = divided.lines().filter(|line| rest.next_if_eq(line).is_none()).collect();
        assert!(rest.next().is_none(), "{divided}");
        assert_eq!(u64::try_from(added.len()).unwrap(), inserted, "{divided}");
        let mark = match dialect {
            Dialect::Rapid => "v100,z1,tool0\\WObj:=wobj0;",
            Dialect::Krl => "} C_DIS",
            _ => ", r=0.001)",
        };
        assert!(added.iter().all(|line| line.ends_with(mark)), "{added:#?}");
        assert_eq!(divided.contains("\r\n"), program.contains("\r\n"));
    }
    let refused = trupose(&[
        "compensate",
        "--calibration",
        CALIBRATION,
        "--program",
        "x.ls",
        "--dialect",
        "fanuc",
        "--points",
        "computed",
        "--insert",
        "0.1",
    ]);
    assert!(refused.status.code() == Some(2) && text(&refused.stderr).contains("cannot be inserted"));
}

#[test]
fn a_program_says_that_its_calibration_was_edited_and_a_copy_that_nothing_changed() {
    let (cell, folder) = (Cell::new(), tempfile::tempdir().unwrap());
    let edited = fs::read_to_string(root().join(CALIBRATION)).unwrap().replacen("expected: ", "expected: 1", 1);
    let (calibration, file) = (folder.path().join("edited.ron"), folder.path().join("part.mod"));
    fs::write(&calibration, edited).unwrap();
    fs::write(&file, module(&cell, "")).unwrap();
    let (calibration, file) = (calibration.to_str().unwrap(), file.to_str().unwrap());
    let arguments = [
        "compensate",
        "--calibration",
        calibration,
        "--dialect",
        "rapid",
        "--program",
        file,
        "--points",
        "computed",
        "--edited",
    ];
    let output = trupose(&arguments);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    assert!(
        text(&output.stdout).starts_with("MODULE Part\n  ! WARNING: EDITED CALIBRATION\n"),
        "{}",
        text(&output.stdout)
    );
    let output = trupose(&[&arguments[..], &["--json"]].concat());
    assert!(text(&output.stdout).contains("\"edited\": \"this calibration was changed"), "{}", text(&output.stdout));
    // Nothing is corrected, so nothing is said.
    let (nothing, out) = (folder.path().join("nothing.mod"), folder.path().join("out.mod"));
    fs::write(&nothing, "MODULE M\nENDMODULE\n").unwrap();
    let output = trupose(&[
        "compensate",
        "--calibration",
        calibration,
        "--dialect",
        "rapid",
        "--program",
        nothing.to_str().unwrap(),
        "--points",
        "computed",
        "--edited",
        "--out",
        out.to_str().unwrap(),
    ]);
    assert_eq!(output.status.code(), Some(1));
    assert!(text(&output.stdout).starts_with("unchanged: "), "{}", text(&output.stdout));
    assert_eq!(fs::read(out).unwrap(), fs::read(nothing).unwrap());
}
