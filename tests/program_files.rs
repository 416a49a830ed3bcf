//! Programs as people have them: what is a target, what stays and why, and that nothing else ever changes.

use std::fs;
use std::path::{Path, PathBuf};

use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use trupose::kinematics::ForwardKinematics;
use trupose::profile::{Profile, builtin};
use trupose::program::motion::{Command, Companion, Goal, Hint, MoveKind, ReadOptions, Reason, Scan, Setting};
use trupose::program::rewrite::{rewrite, scan};
use trupose::program::{Dialect, Robot, gzip};

use crate::support::{invented, text, trupose};

const PULSES: [Option<f64>; 7] = [Some(1000.0); 7];

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/programs")
}

fn companion(name: &str) -> Companion {
    Companion { name: name.to_owned(), text: fs::read(folder().join(name)).unwrap() }
}

fn with(profile: &Profile) -> Robot<'_> {
    Robot {
        profile: profile.name(),
        chain: profile.chain(),
        max_speeds: &[],
        pulses_per_degree: &PULSES,
        joint_aliases: profile.joint_aliases(),
    }
}

fn profile(arm: &str) -> Profile {
    Profile::parse(builtin(arm).unwrap(), arm).unwrap().0
}

fn found(dialect: Dialect, arm: &str, text: &[u8], companions: Vec<Companion>) -> Scan {
    let options = ReadOptions { companions, ..ReadOptions::default() };
    scan(dialect, &with(&profile(arm)), &options, text).unwrap()
}

/// A program of the field with what is right for it: lines of targets, and of places that stay.
struct Field {
    file: &'static str,
    dialect: Dialect,
    arm: &'static str,
    companions: &'static [&'static str],
    targets: &'static [usize],
    left: &'static [(usize, Reason)],
}

const fn field(
    file: &'static str,
    dialect: Dialect,
    arm: &'static str,
    companions: &'static [&'static str],
    targets: &'static [usize],
    left: &'static [(usize, Reason)],
) -> Field {
    Field { file, dialect, arm, companions, targets, left }
}

const ABB: &str = "abb_irb120";
const KUKA: &str = "kuka_kr6_r900";
const FANUC: &str = "fanuc_lrmate200id";
const PANDA: &str = "franka_panda";
const STAUBLI: &str = "staubli_tx2_60";

const FIELD: &[Field] = &[
    field("r01_numarray.mod", Dialect::Rapid, ABB, &[], &[5], &[]),
    field("r02_split.mod", Dialect::Rapid, ABB, &[], &[2], &[]),
    field("r03_latin1.mod", Dialect::Rapid, ABB, &[], &[3], &[]),
    field(
        "r05_robjoint.mod",
        Dialect::Rapid,
        ABB,
        &[],
        &[],
        &[(4, Reason::Component), (5, Reason::Component), (6, Reason::Elsewhere)],
    ),
    field(
        "r06_moves.mod",
        Dialect::Rapid,
        ABB,
        &[],
        &[],
        &[(2, Reason::SeveralSettings), (8, Reason::Offset), (9, Reason::Offset)],
    ),
    field("r07_yumi.mod", Dialect::Rapid, ABB, &[], &[], &[(2, Reason::SeventhAxis)]),
    field("r07_yumi.mod", Dialect::Rapid, PANDA, &[], &[2], &[]),
    field("r08_comment_move.mod", Dialect::Rapid, ABB, &[], &[4], &[]),
    field("r09_offsetjoint.mod", Dialect::Rapid, ABB, &[], &[6], &[(3, Reason::NotMovedTo), (4, Reason::NotMovedTo)]),
    field("r10_only_extax.mod", Dialect::Rapid, ABB, &[], &[], &[(2, Reason::OtherGroup)]),
    field("r11_twotasks_move_var.mod", Dialect::Rapid, ABB, &[], &[2], &[]),
    field(
        "r12_noext.mod",
        Dialect::Rapid,
        ABB,
        &[],
        &[4],
        &[(3, Reason::Unreadable), (5, Reason::Computed), (6, Reason::Elsewhere)],
    ),
    field(
        "k01_rel_names.dat",
        Dialect::Krl,
        KUKA,
        &[],
        &[],
        &[(3, Reason::NotMovedTo), (4, Reason::NotMovedTo), (5, Reason::NotMovedTo)],
    ),
    field("k01_rel_names.dat", Dialect::Krl, KUKA, &["krl/release.src"], &[3, 4, 5], &[]),
    field("k02_tol.dat", Dialect::Krl, KUKA, &[], &[], &[(2, Reason::NotMovedTo), (3, Reason::NotMovedTo)]),
    field(
        "k02_tol.dat",
        Dialect::Krl,
        KUKA,
        &["krl/release.src"],
        &[],
        &[(2, Reason::NotMovedTo), (3, Reason::Relative)],
    ),
    field("k03_arrays.dat", Dialect::Krl, KUKA, &["krl/release.src"], &[3, 4, 5, 6], &[]),
    field("k04_inline.src", Dialect::Krl, KUKA, &[], &[], &[(9, Reason::Elsewhere), (12, Reason::Elsewhere)]),
    field(
        "k05_e6axis_part.src",
        Dialect::Krl,
        KUKA,
        &[],
        &[2, 4, 6, 7, 9, 10, 11, 14, 14, 16],
        &[(3, Reason::Incomplete), (5, Reason::Relative), (8, Reason::Component), (12, Reason::Relative)],
    ),
    field(
        "k06_rel_var.src",
        Dialect::Krl,
        KUKA,
        &[],
        &[],
        &[(3, Reason::Relative), (4, Reason::Elsewhere), (5, Reason::Relative)],
    ),
    field("f01_comment_gp2.ls", Dialect::Fanuc, FANUC, &[], &[12], &[]),
    field(
        "f02_pos_word.ls",
        Dialect::Fanuc,
        FANUC,
        &[],
        &[14],
        &[(12, Reason::Offset), (21, Reason::OffsetBase), (27, Reason::Untaught)],
    ),
    field("f03_pr_only.ls", Dialect::Fanuc, FANUC, &[], &[], &[(10, Reason::Register), (11, Reason::Register)]),
    field("f04_posreg.va", Dialect::Fanuc, FANUC, &[], &[], &[(2, Reason::Register)]),
    field("f05_gp2only.ls", Dialect::Fanuc, FANUC, &[], &[], &[(7, Reason::OtherGroup)]),
    field("f06_ext7.ls", Dialect::Fanuc, FANUC, &[], &[12], &[(5, Reason::JointCount { found: 7, joints: 6 })]),
    field("i01_two_groups.jbi", Dialect::Inform, "soochow", &[], &[8, 9, 10], &[(18, Reason::NotMovedTo)]),
    field(
        "i02_spaces.jbi",
        Dialect::Inform,
        "soochow",
        &[],
        &[8, 9],
        &[(10, Reason::JointCount { found: 7, joints: 6 }), (11, Reason::JointCount { found: 8, joints: 6 })],
    ),
    field("i03_angle.jbi", Dialect::Inform, "soochow", &[], &[8], &[]),
    field("u01_polyscope.script", Dialect::Urscript, "ur5e", &[], &[4, 6], &[]),
    field(
        "v01_omitted.dtx",
        Dialect::Val3,
        STAUBLI,
        &["field/v04_prog.pgx"],
        &[5],
        &[
            (8, Reason::NotMovedTo),
            (11, Reason::NotMovedTo),
            (12, Reason::NotMovedTo),
            (15, Reason::OffsetBase),
            (16, Reason::NotMovedTo),
        ],
    ),
    field("v02_old.dtx", Dialect::Val3, STAUBLI, &["val3/home.pgx"], &[6, 13], &[]),
    field(
        "v03_jointrs.dtx",
        Dialect::Val3,
        STAUBLI,
        &["field/v04_prog.pgx"],
        &[],
        &[(5, Reason::NotMovedTo), (8, Reason::NotMovedTo)],
    ),
    field("s01_block.yaml", Dialect::Ros, PANDA, &[], &[10, 20], &[]),
    field("s02_json.json", Dialect::Ros, PANDA, &[], &[2], &[]),
    field("s03_jtc.yaml", Dialect::Ros, PANDA, &[], &[6, 8], &[]),
    field("s04_fingers.yaml", Dialect::Ros, PANDA, &[], &[3], &[]),
    field("s05_order.yaml", Dialect::Ros, PANDA, &[], &[4], &[]),
    field("s07_goal_positions.yaml", Dialect::Ros, PANDA, &[], &[4], &[]),
];

#[test]
fn programs_of_the_field_give_what_is_right() {
    for Field { file, dialect, arm, companions, targets, left } in FIELD {
        let text = fs::read(folder().join("field").join(file)).unwrap();
        let scan = found(*dialect, arm, &text, companions.iter().map(|name| companion(name)).collect());
        let lines: Vec<usize> = scan.targets.iter().map(|target| target.line).collect();
        let reasons: Vec<(usize, Reason)> = scan.left.iter().map(|left| (left.line, left.reason.clone())).collect();
        assert_eq!((lines.as_slice(), reasons.as_slice()), (*targets, *left), "{file}: {scan:?}");
    }
}

#[test]
fn settings_of_the_controller_stay() {
    let text = fs::read(folder().join("field/k07_ifhome.src")).unwrap();
    let scan = found(Dialect::Krl, KUKA, &text, Vec::new());
    assert!(scan.targets.is_empty());
    let lines: Vec<usize> = scan.left.iter().map(|left| left.line).collect();
    assert_eq!(lines, [3, 5, 6, 7]);
    let utf16 = fs::read(folder().join("field/r04_utf16.mod")).unwrap();
    let profile = profile(ABB);
    assert!(rewrite(Dialect::Rapid, &with(&profile), &utf16, &Scan::default(), &[]).unwrap() == utf16);
    assert!(trupose::program::rewrite::scan(Dialect::Rapid, &with(&profile), &ReadOptions::default(), &utf16).is_err());
    assert!(
        trupose::program::rewrite::scan(Dialect::Urscript, &with(&profile), &ReadOptions::default(), &[0x1f, 0x8b, 8])
            .is_err()
    );
}

#[test]
fn scripts_and_programs_keep_what_they_compute_or_pass_on() {
    let lines = |scan: &Scan| {
        let targets: Vec<usize> = scan.targets.iter().map(|target| target.line).collect();
        (targets, scan.left.iter().map(|left| left.line).collect::<Vec<usize>>())
    };
    let text = fs::read(folder().join("field/u02_oldpolyscope.script")).unwrap();
    let scan = found(Dialect::Urscript, "ur5e", &text, Vec::new());
    assert_eq!(lines(&scan), (vec![3, 5, 6, 7, 9, 11, 14, 16, 22, 24, 25], vec![18, 20, 23, 28]), "{scan:?}");
    let text = fs::read(folder().join("field/v04_prog.pgx")).unwrap();
    let scan = found(Dialect::Val3, STAUBLI, &text, vec![companion("field/v01_omitted.dtx")]);
    assert_eq!(lines(&scan), (vec![6], vec![5, 7, 8, 9]), "{scan:?}");
}

#[test]
#[expect(clippy::float_cmp, reason = "a number that is read as it was written")]
fn polyscope_states_pose_tool_and_branch() {
    let text = fs::read(folder().join("field/u01_polyscope.script")).unwrap();
    let scan = found(Dialect::Urscript, "ur5e", &text, Vec::new());
    let Goal::Pose(pose) = &scan.targets[0].goal else { panic!("{scan:?}") };
    assert_eq!(pose.frame_from_tool.translation.vector, Vector3::new(-0.144, -0.436, 0.202));
    assert!(matches!(&pose.tool, Setting::Known { pose, .. } if pose.translation.z == 0.15));
    assert_eq!(pose.frame, Setting::Identity);
    assert!(pose.configuration.to_string().contains("nearest"), "{}", pose.configuration);
    let kinds: Vec<_> = scan.moves.iter().map(|motion| (motion.kind, motion.target, motion.path)).collect();
    assert_eq!(kinds, [(MoveKind::Joint, Some(0), 1), (MoveKind::Linear, Some(1), 1)]);
}

#[test]
fn inline_forms_take_tool_and_base_from_their_data() {
    let own = own(Dialect::Krl, &fs::read_to_string(folder().join("krl.txt")).unwrap());
    let part = &own[0];
    let scan = found(part.dialect, &part.arm, part.text.as_bytes(), part.companions.clone());
    for target in scan.targets.iter().filter(|target| target.name.as_deref() != Some("XHOME1")) {
        let Goal::Pose(pose) = &target.goal else { panic!("{target:?}") };
        assert_eq!((pose.tool.name(), pose.frame.name()), ("TOOL_DATA[1]", "BASE_DATA[2]"));
        assert_eq!(pose.configuration.to_string(), "S 2, T 10");
    }
    // The other file of the pair: its moves are there, their values are not.
    let source = fs::read(folder().join("krl/part.src")).unwrap();
    let data = Companion { name: "part.dat".to_owned(), text: part.text.clone().into_bytes() };
    let scan = found(Dialect::Krl, KUKA, &source, vec![data]);
    assert!(scan.left.iter().all(|left| left.reason == Reason::InFile("part.dat".to_owned())), "{scan:?}");
    assert_eq!((scan.left.len(), scan.moves.len()), (3, 3));
}

/// A program written in the manner of real ones.
struct Own {
    title: String,
    dialect: Dialect,
    arm: String,
    targets: usize,
    left: usize,
    companions: Vec<Companion>,
    text: String,
}

fn own(dialect: Dialect, file: &str) -> Vec<Own> {
    let programs = file.split("=== ").filter(|part| !part.trim().is_empty());
    programs
        .map(|part| {
            let (head, text) = part.split_once('\n').unwrap();
            let mut fields = head.split("; ");
            let mut next = || fields.next().unwrap().to_owned();
            let (title, arm) = (next(), next());
            let number = |field: String| field.split(' ').nth(1).unwrap().parse().unwrap();
            let (targets, left) = (number(next()), number(next()));
            let companions = fields.map(|field| companion(field.strip_prefix("with ").unwrap())).collect();
            Own { title, dialect, arm, targets, left, companions, text: text.to_owned() }
        })
        .collect()
}

/// The programs of a folder, one file per dialect.
fn programs_in(folder: &Path) -> Vec<Own> {
    let of_dialect =
        |dialect: &Dialect| own(*dialect, &fs::read_to_string(folder.join(format!("{dialect}.txt"))).unwrap());
    Dialect::ALL.iter().flat_map(of_dialect).collect()
}

/// Programs in the manner of real ones: 20 of each dialect, whose targets are within the reach of a shipped arm. Tools that a program
/// does not state are 100 mm long.
fn typical() -> Vec<Own> {
    programs_in(&folder().join("typical"))
}

/// Programs that show what is difficult about a language.
fn difficult() -> Vec<Own> {
    programs_in(&folder())
}

fn all_own() -> Vec<Own> {
    difficult().into_iter().chain(typical()).collect()
}

/// What the program makes of a typical one: its report.
fn corrected(program: &Own, calibration: &str) -> serde_json::Value {
    let place = tempfile::tempdir().unwrap();
    let path = |name: &str| place.path().join(name.rsplit('/').next().unwrap()).to_str().unwrap().to_owned();
    fs::write(path("program"), &program.text).unwrap();
    let dialect = program.dialect.to_string();
    let (file, out) = (path("program"), path("out"));
    let mut arguments = vec!["compensate", "--calibration", calibration, "--program", &file, "--dialect", &dialect];
    arguments.extend(["--points", "computed", "--partial", "--tool", "0,0,100,0,0,0", "--json", "--out", &out]);
    let companions: Vec<String> = program.companions.iter().map(|companion| path(&companion.name)).collect();
    for (companion, file) in program.companions.iter().zip(&companions) {
        fs::write(file, &companion.text).unwrap();
        arguments.extend(["--companion", file]);
    }
    let output = trupose(&arguments);
    let said = text(&output.stderr);
    assert!(matches!(output.status.code(), Some(0 | 1)), "{}: {said}", program.title);
    serde_json::from_slice(&output.stdout).unwrap_or_else(|error| panic!("{}: {error}: {said}", program.title))
}

#[test]
fn of_typical_programs_more_than_95_percent_of_the_targets_are_corrected() {
    let folder = tempfile::tempdir().unwrap();
    let programs = typical();
    for &dialect in Dialect::ALL {
        let (mut count, mut done, mut left) = (0, 0, 0);
        for program in programs.iter().filter(|program| program.dialect == dialect) {
            let calibration = folder.path().join(&program.arm).to_str().unwrap().to_owned();
            if !Path::new(&calibration).exists() {
                fs::write(&calibration, invented::calibration(&program.arm).to_text().unwrap()).unwrap();
            }
            let report = corrected(program, &calibration);
            let number = |name: &str| usize::try_from(report[name].as_u64().unwrap()).unwrap();
            (count, done, left) = (count + 1, done + number("corrected"), left + number("left"));
            let unnamed =
                report["targets"].as_array().unwrap().iter().find(|target| {
                    target["status"] != "reached" && target["reason"].as_str().is_none_or(str::is_empty)
                });
            assert!(unnamed.is_none(), "{}: {unnamed:?}", program.title);
            if number("corrected") != program.targets || number("left") != program.left {
                println!("{dialect} {}: {} corrected, {} left", program.title, number("corrected"), number("left"));
                for target in report["targets"].as_array().unwrap() {
                    if target["status"] != "reached" {
                        println!("    {target}");
                    }
                }
            }
        }
        println!("{dialect}: {count} programs, {done} of {} targets corrected", done + left);
        assert!(count >= 20 && 100 * done >= 95 * (done + left), "{dialect}: {done} corrected, {left} left");
    }
}

#[test]
fn own_programs_have_their_targets() {
    for program in all_own() {
        let scan = found(program.dialect, &program.arm, program.text.as_bytes(), program.companions.clone());
        let counts = (scan.targets.len(), scan.left.len());
        assert_eq!(counts, (program.targets, program.left), "{:?} {}: {scan:#?}", program.dialect, program.title);
    }
}

/// New values for all targets: joints by a hundredth of a degree, poses by some micrometres and microradians.
fn moved(scan: &Scan, by: f64) -> Vec<Option<Command>> {
    let turn = UnitQuaternion::from_euler_angles(by, -2.0 * by, by);
    let shift = Isometry3::from_parts(Vector3::new(by, by, -by).into(), turn);
    let command = |goal: &Goal| match goal {
        Goal::Joints(joints) => Command::Joints(joints.iter().map(|q| q + by).collect()),
        Goal::Pose(pose) => Command::Pose(pose.frame_from_tool * shift),
    };
    scan.targets.iter().map(|target| Some(command(&target.goal))).collect()
}

/// How far two goals are apart, as the larger of metres and radians.
fn distance(one: &Goal, command: &Command) -> f64 {
    match (one, command) {
        (Goal::Joints(one), Command::Joints(two)) => {
            one.iter().zip(two).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
        }
        (Goal::Pose(one), Command::Pose(two)) => {
            let shift = (one.frame_from_tool.translation.vector - two.translation.vector).norm();
            shift.max(one.frame_from_tool.rotation.angle_to(&two.rotation))
        }
        (Goal::Joints(_) | Goal::Pose(_), _) => f64::INFINITY,
    }
}

#[test]
fn corrected_values_are_read_back_as_meant() {
    for program in all_own() {
        let profile = profile(&program.arm);
        let robot = with(&profile);
        for line_end in ["\n", "\r\n", "\r"] {
            let bytes = program.text.replace('\n', line_end).into_bytes();
            let companions = program.companions.iter().map(|companion| Companion {
                text: text(&companion.text).replace("\r\n", "\n").replace('\n', line_end).into_bytes(),
                ..companion.clone()
            });
            let options = ReadOptions { companions: companions.collect(), ..ReadOptions::default() };
            let scan = scan(program.dialect, &robot, &options, &bytes).unwrap();
            assert_eq!((scan.targets.len(), scan.left.len()), (program.targets, program.left), "{}", program.title);
            let commands = moved(&scan, 1.7e-4);
            let written = rewrite(program.dialect, &robot, &bytes, &scan, &commands).unwrap();
            let again = trupose::program::rewrite::scan(program.dialect, &robot, &options, &written).unwrap();
            assert_eq!(again.targets.len(), scan.targets.len(), "{}", program.title);
            assert_eq!(again.left, scan.left, "{}", program.title);
            // Digits that the controllers store: three decimals of FANUC, whole pulses, four decimals of Yaskawa's angles.
            let digits = match program.dialect {
                Dialect::Fanuc | Dialect::Inform => 3e-5,
                Dialect::Rapid | Dialect::Krl | Dialect::Urscript | Dialect::Val3 | Dialect::Ros => 4e-7,
            };
            for (target, command) in again.targets.iter().zip(commands.iter().flatten()) {
                let apart = distance(&target.goal, command);
                assert!(apart < digits, "{}: {target:?} is {apart} off {command:?}", program.title);
            }
            assert_eq!(skeleton(&written), skeleton(&bytes), "{}", program.title);
        }
    }
}

/// A text without its numbers, and without the attributes that VAL3 omits when they are zero.
fn skeleton(text: &[u8]) -> Vec<u8> {
    let mut text = text.to_vec();
    for name in ["j1", "j2", "j3", "j4", "j5", "j6", "rx", "ry", "rz", "x", "y", "z"] {
        let mark = format!(" {name}=\"").into_bytes();
        while let Some(at) = text.windows(mark.len()).position(|window| window == mark) {
            let end = text[at + mark.len()..]
                .iter()
                .position(|byte| *byte == b'"')
                .map_or(text.len(), |end| at + mark.len() + end + 1);
            text.drain(at..end);
        }
    }
    text.retain(|byte| !matches!(byte, b'0'..=b'9' | b'.' | b'-' | b'+' | b'e' | b'E' | b' '));
    text
}

/// A pseudo-random sequence that is the same everywhere.
struct Dice(u64);

impl Dice {
    fn roll(&mut self, below: usize) -> usize {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        usize::try_from(self.0 >> 33).unwrap() % below.max(1)
    }
}

#[test]
fn broken_programs_never_panic_and_change_only_in_numbers() {
    const BYTES: &[u8] = b"[]{}()<>\"'\\;:,=!#.- \t\r\n0123456789EePpAXJ/*\xfc";
    let mut programs: Vec<(Dialect, String, Vec<u8>, Vec<Companion>)> =
        difficult().into_iter().map(|own| (own.dialect, own.arm, own.text.into_bytes(), own.companions)).collect();
    for Field { file, dialect, arm, companions, .. } in FIELD {
        let text = fs::read(folder().join("field").join(file)).unwrap();
        programs.push((*dialect, (*arm).to_owned(), text, companions.iter().map(|name| companion(name)).collect()));
    }
    let mut dice = Dice(20);
    for (dialect, arm, text, companions) in &programs {
        let profile = profile(arm);
        let robot = with(&profile);
        let options = ReadOptions { companions: companions.clone(), ..ReadOptions::default() };
        for _ in 0..15 {
            let mut broken = text.clone();
            for _ in 0..=dice.roll(4) {
                if broken.len() < 2 {
                    break;
                }
                let at = dice.roll(broken.len() - 1);
                match dice.roll(4) {
                    0 => broken[at] = BYTES[dice.roll(BYTES.len())],
                    1 => broken.insert(at, BYTES[dice.roll(BYTES.len())]),
                    2 => {
                        let end = (at + dice.roll(40)).min(broken.len());
                        broken.drain(at..end);
                    }
                    _ => broken.truncate(at + 1),
                }
            }
            let Ok(found) = scan(*dialect, &robot, &options, &broken) else { continue };
            let none = vec![None; found.targets.len()];
            assert!(rewrite(*dialect, &robot, &broken, &found, &none).unwrap() == broken);
            let written = rewrite(*dialect, &robot, &broken, &found, &moved(&found, 1e-4)).unwrap();
            assert_eq!(
                String::from_utf8_lossy(&skeleton(&written)),
                String::from_utf8_lossy(&skeleton(&broken)),
                "{}",
                String::from_utf8_lossy(&broken)
            );
        }
    }
}

/// What the page on programs says about its examples.
fn described(scan: &Scan) -> String {
    let name = |name: &Option<String>| name.as_ref().map_or_else(String::new, |name| format!(" {name}"));
    let setting = |setting: &Setting| match setting {
        Setting::Identity => "none".to_owned(),
        Setting::Known { name, .. } => name.clone(),
        Setting::Named(name) => format!("{name} (to be stated)"),
    };
    let target = |target: &trupose::program::motion::Target| {
        let goal = match &target.goal {
            Goal::Joints(_) => "joints".to_owned(),
            Goal::Pose(pose) => {
                let branch = pose.configuration.to_string();
                let branch = if branch.is_empty() { "as before".to_owned() } else { branch };
                format!("pose; branch {branch}; tool {}; frame {}", setting(&pose.tool), setting(&pose.frame))
            }
        };
        (target.line, format!("line {}:{} target, {goal}", target.line, name(&target.name)))
    };
    let mut lines: Vec<(usize, String)> = scan.targets.iter().map(target).collect();
    let left = |left: &trupose::program::motion::LeftAlone| {
        (left.line, format!("line {}:{} left, {}", left.line, name(&left.name), left.reason))
    };
    lines.extend(scan.left.iter().map(left));
    lines.sort_by_key(|(line, _)| *line);
    lines.into_iter().flat_map(|(_, text)| [text, "\n".to_owned()]).collect()
}

#[test]
fn the_examples_of_the_page_give_what_it_says() {
    let page = fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/programs.md")).unwrap();
    let block = |from: &str| {
        let (_, rest) = page.split_once(&format!("```{from}\n")).unwrap();
        let (code, rest) = rest.split_once("```").unwrap();
        let (_, rest) = rest.split_once("```text\n").unwrap();
        (code.to_owned(), rest.split_once("```").unwrap().0.to_owned())
    };
    for (name, dialect, arm) in [
        ("rapid", Dialect::Rapid, ABB),
        ("krl", Dialect::Krl, KUKA),
        ("fanuc", Dialect::Fanuc, FANUC),
        ("urscript", Dialect::Urscript, "ur5e"),
        ("val3", Dialect::Val3, STAUBLI),
        ("inform", Dialect::Inform, "soochow"),
        ("ros", Dialect::Ros, PANDA),
    ] {
        let (code, stated) = block(name);
        let found = described(&found(dialect, arm, code.as_bytes(), Vec::new()));
        assert_eq!(found, stated, "{name}:\n{found}");
    }
}

#[test]
fn signs_of_computed_and_taught_points_are_reported() {
    let own = own(Dialect::Rapid, include_str!("programs/rapid.txt"));
    let offline = own.iter().find(|own| own.title.contains("offline")).unwrap();
    let hints = found(Dialect::Rapid, ABB, offline.text.as_bytes(), Vec::new()).hints;
    assert!(hints.iter().any(|hint| hint.to_string() == "line 1: written by RobotStudio"), "{hints:?}");
    let target = |x: f64, y: f64| format!("LIN {{X {x},Y {y},Z {},A 0,B 90,C 0,S 18,T 2}}\n", x + 100.0);
    let program = |step: f64| (0..8).map(|index| target(step * f64::from(index + 1), step)).collect::<String>();
    for (step, computed) in [(10.0, true), (10.123, false)] {
        let scan = found(Dialect::Krl, KUKA, program(step).as_bytes(), Vec::new());
        let said: Vec<_> = scan.hints.iter().filter_map(Hint::is_computed).collect();
        assert_eq!(said, [computed], "{:?}", scan.hints);
        assert!(scan.hints.contains(&Hint::AbsoluteAccuracy { line: 1 }));
    }
}

#[test]
fn flanges_of_shipped_profiles_are_those_of_the_controllers() {
    // Position of the flange (mm), and its x and z axes, at the pose that the makers' manuals draw.
    for (arm, degrees, position, x, z) in [
        (ABB, [0.0; 6], [374.0, 0.0, 630.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]),
        (KUKA, [0.0, -90.0, 90.0, 0.0, 0.0, 0.0], [525.0, 0.0, 890.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]),
        (FANUC, [0.0; 6], [465.0, 0.0, 365.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]),
        (STAUBLI, [0.0; 6], [0.0, 20.0, 670.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]),
    ] {
        let profile = profile(arm);
        let base_from_flange = ForwardKinematics::new(profile.chain()).base_from_flange(&degrees.map(f64::to_radians));
        let world_from_flange = profile.base_from_world().inverse() * base_from_flange;
        let found = world_from_flange.translation.vector * 1000.0;
        assert!((found - Vector3::from(position)).norm() < 1e-6, "{arm}: {found}");
        assert!((world_from_flange.rotation * Vector3::x() - Vector3::from(x)).norm() < 1e-9, "{arm}");
        assert!((world_from_flange.rotation * Vector3::z() - Vector3::from(z)).norm() < 1e-9, "{arm}");
    }
}

#[test]
fn a_compressed_program_of_polyscope_is_corrected_inside() {
    let place = tempfile::tempdir().unwrap();
    let path = |name: &str| place.path().join(name).to_str().unwrap().to_owned();
    let packed = fs::read(folder().join("urp/pick.urp")).unwrap();
    let before = gzip::unpacked(&packed).unwrap();
    let scan = found(Dialect::Urscript, "ur5e", &before, Vec::new());
    let names: Vec<_> = scan.targets.iter().filter_map(|target| target.name.clone()).collect();
    assert_eq!(names, ["Waypoint_1", "Waypoint_2", "Waypoint_3", "Waypoint_4"]);
    assert_eq!(scan.left.iter().map(|left| left.reason.clone()).collect::<Vec<_>>(), [Reason::Relative]);
    fs::write(path("pick.urp"), &packed).unwrap();
    fs::write(path("cal.ron"), invented::calibration("ur5e").to_text().unwrap()).unwrap();
    let (program, calibration, out) = (path("pick.urp"), path("cal.ron"), path("out.urp"));
    let output = trupose(&[
        "compensate",
        "--calibration",
        &calibration,
        "--program",
        &program,
        "--dialect",
        "urscript",
        "--points",
        "computed",
        "--partial",
        "--out",
        &out,
    ]);
    assert!(text(&output.stderr).contains("4 of 4 joint targets"), "{}", text(&output.stderr));
    let after = gzip::unpacked(&fs::read(out).unwrap()).unwrap();
    assert_ne!(after, before);
    assert_eq!(skeleton(&after), skeleton(&before));
    // Where nothing is corrected, the copy is the file itself.
    let soochow = "sessions/example/calibration.ron";
    let out = path("same.urp");
    let output = trupose(&[
        "compensate",
        "--calibration",
        soochow,
        "--program",
        &program,
        "--dialect",
        "krl",
        "--points",
        "computed",
        "--out",
        &out,
    ]);
    assert!(text(&output.stdout).starts_with("unchanged: "), "{}", text(&output.stdout));
    assert_eq!(fs::read(out).unwrap(), packed);
    let damaged = packed.iter().map(|byte| byte ^ 1).collect::<Vec<u8>>();
    fs::write(path("pick.urp"), [&[0x1f, 0x8b], &damaged[2..]].concat()).unwrap();
    let output = trupose(&[
        "compensate",
        "--calibration",
        &calibration,
        "--program",
        &program,
        "--dialect",
        "urscript",
        "--points",
        "computed",
    ]);
    assert!(
        output.status.code() == Some(2) && text(&output.stderr).contains("cannot be unpacked"),
        "{}",
        text(&output.stderr)
    );
}

/// Names of the tools of all Cartesian targets; with a question mark where the program does not state them.
fn tools(dialect: Dialect, arm: &str, text: &str, companions: Vec<Companion>) -> Vec<String> {
    let scan = found(dialect, arm, text.as_bytes(), companions);
    let tool = |goal: &Goal| match goal {
        Goal::Joints(_) => None,
        Goal::Pose(pose) => Some(match &pose.tool {
            Setting::Identity => "none".to_owned(),
            Setting::Known { name, .. } => name.clone(),
            Setting::Named(name) => format!("{name}?"),
        }),
    };
    scan.targets.iter().filter_map(|target| tool(&target.goal)).collect()
}

#[test]
fn tools_that_change_while_the_program_runs_are_not_taken_as_known() {
    let tool = |z: usize| format!("{{X 0,Y 0,Z {z},A 0,B 0,C 0}}");
    let target = |x: usize| format!("LIN {{X {x},Y 0,Z 500,A 0,B 90,C 0}}\n");
    let krl = |text: &str, companions| tools(Dialect::Krl, KUKA, text, companions);
    let program = |body: &str| format!("DEF a()\n$BASE=$NULLFRAME\n$TOOL={}\n{body}END\n", tool(100));
    // The second round begins with the tool of the end of the first.
    let turn = |kind: &str, z: usize| {
        let (head, end) = kind.split_once(' ').unwrap();
        program(&format!("{head}\n{}$TOOL={}\n{}{end}\n", target(1), tool(z), target(2)))
    };
    for kind in ["LOOP ENDLOOP", "REPEAT UNTIL", "WHILE ENDWHILE", "FOR ENDFOR"] {
        assert_eq!(krl(&turn(kind, 200), Vec::new()), ["$TOOL?", "$TOOL"], "{kind}");
        assert_eq!(krl(&turn(kind, 100), Vec::new()), ["$TOOL", "$TOOL"], "{kind}");
    }
    let nested = format!("LOOP\n{}LOOP\n{}$TOOL={}\nENDLOOP\nENDLOOP\n", target(1), target(2), tool(5));
    assert_eq!(krl(&program(&nested), Vec::new()), ["$TOOL?", "$TOOL?"]);
    // A numbered tool that the program changes is not that of the data list.
    let list = Companion { name: "$config.dat".to_owned(), text: format!("TOOL_DATA[1]={}\n", tool(100)).into_bytes() };
    for (change, known) in [
        ("", true),
        ("TOOL_DATA[1].Z=150\n", false),
        ("TOOL_DATA[I].Z=150\n", false),
        ("TOOL_DATA[2].Z=150\n", true),
        ("TOOL_DATA[1]=MEASURED\n", false),
        ("MEASURE(TOOL_DATA[1])\n", false),
        ("TOOL_DATA[1]={X 0,Y 0,Z 7,A 0,B 0,C 0}\n", false),
        ("TOOL_DATA[1]={Z 7}\n", false),
    ] {
        let text = format!("DEF a()\n$TOOL=TOOL_DATA[1]\n$BASE=$NULLFRAME\n{}{change}END\n", target(1));
        let expected = if known { "TOOL_DATA[1]" } else { "TOOL_DATA[1]?" };
        assert_eq!(krl(&text, vec![list.clone()]), [expected], "{change}");
    }
}

#[test]
fn shifts_hold_through_loops_calls_and_jumps() {
    let rapid = |body: &str| {
        let target = "[[400,0,500],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]]";
        let text = format!("MODULE M\nPROC main()\n{body}ENDPROC\nENDMODULE\n").replace('@', target);
        let scan = found(Dialect::Rapid, ABB, text.as_bytes(), Vec::new());
        (scan.targets.len(), scan.left.len())
    };
    let go = "MoveL @,v1,fine,tool0;\n";
    assert_eq!(rapid(&format!("{go}PDispOn p,tool0;\n{go}PDispOff;\n{go}")), (2, 1));
    // The second call begins displaced.
    assert_eq!(rapid(&format!("{go}PDispOn p,tool0;\n{go}")), (0, 2));
    let turn = format!("WHILE TRUE DO\n{go}PDispOn p,tool0;\n{go}ENDWHILE\nPDispOff;\n{go}");
    assert_eq!(rapid(&turn), (1, 2));
    let job = |name: &str, body: &str| {
        let head = "//POS\n///TOOL 1\n///POSTYPE ROBOT\n///RECTAN\n///RCONF 0,0,0,0,0,0\n";
        let points =
            (0..3).map(|index| format!("C0000{index}=40{index},0,500,180,0,0\n")).collect::<Vec<String>>().concat();
        format!("/JOB\n//NAME {name}\n{head}{points}//INST\nNOP\n{body}END\n")
    };
    let inform = |text: String, other: Option<String>| {
        let companions = other.map(|text| Companion { name: "other.jbi".to_owned(), text: text.into_bytes() });
        let scan = found(Dialect::Inform, "soochow", text.as_bytes(), companions.into_iter().collect());
        let left = scan.left.iter().filter(|left| left.reason == Reason::Offset).count();
        (scan.targets.len(), left)
    };
    let moves = "MOVL C00000 V=1\nMOVL C00001 V=1\nMOVL C00002 V=1\n";
    assert_eq!(inform(job("A", moves), None), (3, 0));
    let caller = |around: &str| job("MAIN", &around.replace('@', "CALL JOB:A\n"));
    assert_eq!(inform(job("A", moves), Some(caller("SFTON P001\n@SFTOF\n"))), (0, 3));
    assert_eq!(inform(job("A", moves), Some(caller("SFTON P001\nSFTOF\n@"))), (3, 0));
    // The job that is called leaves the shift on.
    let first = "MOVL C00000 V=1\nCALL JOB:B\nMOVL C00001 V=1\nSFTOF\nMOVL C00002 V=1\n";
    assert_eq!(inform(job("A", first), Some(job("B", "SFTON P001\n"))), (2, 1));
    let jump = "*LOOP\nMOVL C00000 V=1\nSFTON P001\nMOVL C00001 V=1\nJUMP *LOOP IF IN#(1)=ON\nSFTOF\nMOVL C00002 V=1\n";
    assert_eq!(inform(job("A", jump), None), (1, 2));
}

#[test]
fn positions_in_calls_of_unknown_routines_are_named() {
    for (dialect, arm, text) in [
        (
            Dialect::Rapid,
            ABB,
            "MODULE M\nPROC main()\nmyMove [[400,0,500],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100;\nENDPROC\nENDMODULE\n",
        ),
        (
            Dialect::Rapid,
            ABB,
            "MODULE M\nPROC main()\nmyMove [[0,0,0,0,30,0],[9E9,9E9,9E9,9E9,9E9,9E9]];\nENDPROC\nENDMODULE\n",
        ),
        (Dialect::Urscript, "ur5e", "def p():\n  pick(p[0.1,0.2,0.3,0,3.14,0], 5)\nend\n"),
        (Dialect::Urscript, "ur5e", "def p():\n  where = p[0.1,0.2,0.3,0,3.14,0]\n  pick(where)\nend\n"),
        (Dialect::Urscript, "ur5e", "def p():\n  x = pick(at=[0,-1.5,1.5,-1.5,-1.5,0])\nend\n"),
    ] {
        let scan = found(dialect, arm, text.as_bytes(), Vec::new());
        let reasons: Vec<&Reason> = scan.left.iter().map(|left| &left.reason).collect();
        assert!(scan.targets.is_empty() && matches!(reasons[..], [Reason::PassedTo(_)]), "{text}: {scan:?}");
    }
    let harmless = "def p():\n  force_mode(p[0,0,0,0,0,0], [0,0,1,0,0,0], [0,0,-10,0,0,0], 2, [1,1,1,1,1,1])\n  speedl([0,0,0.1,0,0,0], 1)\nend\n";
    assert_eq!(found(Dialect::Urscript, "ur5e", harmless.as_bytes(), Vec::new()).left, []);
}

#[test]
fn a_byte_order_mark_hides_nothing() {
    for program in typical().into_iter().chain(difficult()) {
        let plain = found(program.dialect, &program.arm, program.text.as_bytes(), program.companions.clone());
        let marked = [b"\xef\xbb\xbf", program.text.as_bytes()].concat();
        let marked = found(program.dialect, &program.arm, &marked, program.companions.clone());
        let goals =
            |scan: &Scan| scan.targets.iter().map(|target| (target.line, target.goal.clone())).collect::<Vec<_>>();
        assert_eq!((goals(&marked), &marked.left), (goals(&plain), &plain.left), "{}", program.title);
    }
    let short = "\u{feff}/MN\n   1:L PR[1] 100mm/sec FINE ;\n/END\n";
    assert_eq!(found(Dialect::Fanuc, FANUC, short.as_bytes(), Vec::new()).left.len(), 1);
    let short = "\u{feff}//POS\n///TOOL 1\n///POSTYPE PULSE\n///PULSE\nC0=1,2,3,4,5,6\n//INST\nMOVJ C0 VJ=1\n";
    assert_eq!(found(Dialect::Inform, "soochow", short.as_bytes(), Vec::new()).targets.len(), 1);
}
