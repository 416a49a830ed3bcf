//! Attacks on files: what is changed by accident is named, and nothing is lost without a word.
//!
//! The counts are small, so that the tests stay quick. `TRUPOSE_ATTACKS=20` multiplies them, and `--nocapture` prints the figures
//! of `docs/reliability.md`.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Output;

use crate::support::{command, root, text};
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use trupose::kinematics::JointType;
use trupose::profile::{Profile, builtin};
use trupose::session::calibration::{Calibration, Integrity};
use trupose::session::journal::{self, Entry, JournalError, Line, Sum};
use trupose::session::measurements;

/// How often an attack is repeated.
fn times(count: usize) -> usize {
    let factor = std::env::var("TRUPOSE_ATTACKS").ok().and_then(|factor| factor.parse().ok()).unwrap_or(1);
    count * factor
}

fn random(seed: u64) -> ChaCha8Rng {
    ChaCha8Rng::seed_from_u64(seed)
}

fn run(folder: &Path, arguments: &[&str]) -> Output {
    command(folder, arguments).output().unwrap()
}

/// What is printed to people, in one line.
fn errors(output: &Output) -> String {
    text(&output.stderr).replace("\n  ", " ")
}

/// A text with one digit changed at random.
fn digit_changed(text: &str, random: &mut ChaCha8Rng) -> String {
    let digits: Vec<usize> =
        text.bytes().enumerate().filter(|(_, byte)| byte.is_ascii_digit()).map(|(index, _)| index).collect();
    let at = digits[random.random_range(0..digits.len())];
    let old = text.as_bytes()[at];
    let new = b'0' + (old - b'0' + random.random_range(1..10)) % 10;
    let mut bytes = text.as_bytes().to_vec();
    bytes[at] = new;
    String::from_utf8(bytes).unwrap()
}

/// The calibration of the example in `folder`, as the program writes it.
fn calibrated(folder: &Path) -> PathBuf {
    let table = root().join("sessions/soochow-example/measurements.csv");
    let table = table.to_str().unwrap();
    let output = run(folder, &["identify", "--profile", "soochow", "--measurements", table, "--out", "result"]);
    assert!(matches!(output.status.code(), Some(0 | 1)), "{}", errors(&output));
    folder.join("result/calibration.ron")
}

/// The text with the first number after `name` replaced; a deviation is that of the first parameter.
fn with(text: &str, name: &str, value: &str) -> String {
    let from = if name == "deviation: " { text.find("parameters: [").unwrap() } else { 0 };
    let at = from + text[from..].find(name).unwrap() + name.len();
    let end = at + text[at..].find([',', '\n', ')']).unwrap();
    [&text[..at], value, &text[end..]].concat()
}

#[test]
fn a_changed_digit_of_a_calibration_is_named_everywhere() {
    let folder = tempfile::tempdir().unwrap();
    let file = calibrated(folder.path());
    let whole = fs::read_to_string(&file).unwrap();
    assert!(whole.contains("schema: 2,"), "{}", &whole[..200]);
    let table = root().join("sessions/soochow-example/verification.csv");
    let table = table.to_str().unwrap();
    fs::write(
        folder.path().join("targets.csv"),
        "pose,q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg\n1,10,20,30,40,50,60\n",
    )
    .unwrap();
    let export = ["export", "--calibration", "c.ron", "--format", "dh-csv", "--out", "dh.csv"];
    let compensate = ["compensate", "--calibration", "c.ron", "--targets", "targets.csv"];
    let verify = ["verify", "--calibration", "c.ron", "--measurements", table];
    let sum = whole.lines().find(|line| line.contains("trupose-check:")).unwrap();
    for (changed, reason) in [
        (with(&whole, "deviation: ", "-3.588243482760474"), "its content does not fit its check sum"),
        (whole.replace("a_mm: 140.0", "a_mm: 190.0"), "its content does not fit its check sum"),
        (whole.replace(&format!("{sum}\n"), ""), "its check sum is missing"),
        (
            with(&whole.replace(&format!("{sum}\n"), ""), "schema: ", "1").replace("a_mm: 140.0", "a_mm: 190.0"),
            "the profile inside is not the one whose SHA-256 it states",
        ),
    ] {
        fs::write(folder.path().join("c.ron"), changed).unwrap();
        for arguments in [&export[..], &compensate, &verify] {
            let output = run(folder.path(), arguments);
            let said = errors(&output);
            assert_eq!(output.status.code(), Some(2), "{arguments:?}: {said}");
            assert!(said.contains(reason) && said.contains("--edited"), "{said}");
            let output = run(folder.path(), &[arguments, &["--edited"]].concat());
            assert!(matches!(output.status.code(), Some(0 | 1)), "{arguments:?}: {}", errors(&output));
            let out = text(&output.stdout);
            let results =
                if arguments == export { fs::read_to_string(folder.path().join("dh.csv")).unwrap() } else { out };
            assert!(results.replace("\n  ", " ").contains("was changed after it was written"), "{results}");
        }
    }
    // What an editor does to lines is no change, and a file of an earlier version is read with a note.
    let earlier = with(&whole.replace(&format!("{sum}\n"), ""), "schema: ", "1");
    for (same, note) in [(whole.replace('\n', "\r\n"), ""), (format!("{whole}\n\n"), ""), (earlier, "earlier version")]
    {
        fs::write(folder.path().join("c.ron"), same).unwrap();
        let output = run(folder.path(), &export);
        assert_eq!(output.status.code(), Some(0), "{}", errors(&output));
        assert_eq!(errors(&output).contains("note: 'c.ron' is of an earlier version"), !note.is_empty());
    }
}

#[test]
fn numbers_that_no_arm_has_are_not_a_defect_of_the_program() {
    let folder = tempfile::tempdir().unwrap();
    let whole = fs::read_to_string(calibrated(folder.path())).unwrap();
    fs::write(folder.path().join("c.ron"), with(&whole, "deviation: ", "6.7e15")).unwrap();
    for format in ["corrected-profile", "dh-csv", "urdf"] {
        let arguments = ["export", "--calibration", "c.ron", "--format", format, "--out", "out", "--edited"];
        let output = run(folder.path(), &arguments);
        assert_eq!(output.status.code(), Some(2), "{}", errors(&output));
        assert!(errors(&output).contains("which no arm does"), "{}", errors(&output));
    }
}

#[test]
fn changed_digits_of_calibrations() {
    let folder = tempfile::tempdir().unwrap();
    let whole = fs::read_to_string(calibrated(folder.path())).unwrap();
    assert_eq!(Calibration::parse(&whole).unwrap().integrity, Integrity::Intact);
    let mut random = random(17);
    let (count, mut refused) = (times(30), 0);
    for _ in 0..count {
        match Calibration::parse(&digit_changed(&whole, &mut random)) {
            Err(_) => refused += 1,
            Ok(changed) => assert!(matches!(changed.integrity, Integrity::Changed(_))),
        }
    }
    println!(
        "digits of calibration.ron: {count} changed, {refused} unreadable, {} named by the sum, 0 missed",
        count - refused
    );
}

#[test]
fn changed_tables_and_results_of_a_session_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let example = root().join("sessions/example");
    let session = folder.path().join("s");
    fs::create_dir(&session).unwrap();
    fs::copy(example.join("journal.ron"), session.join("journal.ron")).unwrap();
    for arguments in [&["session", "export", "s", "--csv", "--out", "s"][..], &["session", "report", "s"]] {
        assert_eq!(run(folder.path(), arguments).status.code(), Some(0), "{arguments:?}");
    }
    let show = || text(&run(folder.path(), &["session", "show", "s"]).stdout);
    let identify = ["identify", "--profile", "soochow", "--measurements", "s/measurements.csv"];
    assert!(!text(&run(folder.path(), &identify).stdout).contains("has changed since"));
    for name in ["measurements.csv", "plan.csv", "report.json", "report.html"] {
        let file = session.join(name);
        let whole = fs::read_to_string(&file).unwrap();
        assert!(!show().contains(&format!("{name}: CHANGED")), "{}", show());
        let at = whole.rfind(|c: char| c.is_ascii_digit()).unwrap();
        let other = if &whole[at..=at] == "7" { "8" } else { "7" };
        fs::write(&file, [&whole[..at], other, &whole[at + 1..]].concat()).unwrap();
        assert!(show().contains(&format!("{name}: CHANGED since it was written")), "{}", show());
        if name == "measurements.csv" {
            let output = run(folder.path(), &identify);
            let said = text(&output.stdout).replace("\n  ", " ");
            assert!(said.contains("has changed since the program wrote it") && said.contains("--edited"), "{said}");
            let output = run(folder.path(), &[&identify[..], &["--edited"]].concat());
            assert!(text(&output.stdout).replace("\n  ", " ").contains("because '--edited' was given"));
        }
        fs::write(&file, whole).unwrap();
    }
}

// ------------------------------------------------------------------------------------------------------------------ journal

/// The journal of the example up to a line, damaged there.
fn ending_damaged(folder: &Path, line: usize, from: &str, to: &str) -> Vec<u8> {
    let whole = fs::read_to_string(root().join("sessions/example/journal.ron")).unwrap();
    let mut lines: Vec<&str> = whole.lines().take(line).collect();
    let damaged = lines.pop().unwrap().replace(from, to);
    let bytes = (lines.join("\n") + "\n" + &damaged + "\n").into_bytes();
    fs::create_dir_all(folder.join("s")).unwrap();
    fs::write(folder.join("s/journal.ron"), &bytes).unwrap();
    bytes
}

const OF_A_SESSION: [&[&str]; 8] = [
    &["session", "show", "s"],
    &["session", "export", "s", "--csv"],
    &["session", "report", "s"],
    &["session", "report", "s", "--text"],
    &["replay", "s", "--csv"],
    &["replay", "s", "--print"],
    &["record", "rebuild", "s"],
    &["resume", "s", "--plain"],
];

#[test]
fn damage_of_a_complete_last_line_is_never_taken_for_an_interrupted_write() {
    let folder = tempfile::tempdir().unwrap();
    let whole = fs::read_to_string(root().join("sessions/example/journal.ron")).unwrap();
    let (index, sample) = whole.lines().enumerate().filter(|(_, line)| line.contains(", Sample(")).nth(10).unwrap();
    let pose = sample.split_once("pose:\"").unwrap().1.split_once('"').unwrap().0;
    let before = ending_damaged(folder.path(), index + 1, "xyz_mm:(", "xyz_mm:(1");
    for arguments in OF_A_SESSION {
        let output = run(folder.path(), arguments);
        let said = errors(&output);
        assert_eq!(output.status.code(), Some(5), "{arguments:?}: {said}");
        for part in [&format!("line {} of the journal is damaged", index + 1), &format!("pose {pose}"), "head -n"] {
            assert!(said.contains(part), "{part}: {said}");
        }
        assert_eq!(fs::read(folder.path().join("s/journal.ron")).unwrap(), before);
    }
    let output = run(folder.path(), &["session", "list", "."]);
    assert!(errors(&output).contains("is damaged") && text(&output.stdout).contains("cannot be read"));
}

#[test]
fn an_interrupted_last_write_is_said_by_every_command() {
    let whole = fs::read(root().join("sessions/example/journal.ron")).unwrap();
    let ends: Vec<usize> = whole.iter().enumerate().filter(|(_, byte)| **byte == b'\n').map(|(at, _)| at + 1).collect();
    // A line without its end, and a page of the last line that reads as zeros.
    let torn = whole[..ends[29] - 20].to_vec();
    let mut lost = whole[..ends[29]].to_vec();
    lost[ends[28] + 10..ends[28] + 60].fill(0);
    for bytes in [torn, lost] {
        for arguments in OF_A_SESSION.iter().copied().chain([&["session", "list", "."][..]]) {
            let folder = tempfile::tempdir().unwrap();
            fs::create_dir(folder.path().join("s")).unwrap();
            fs::write(folder.path().join("s/journal.ron"), &bytes).unwrap();
            let output = run(folder.path(), arguments);
            let said = errors(&output) + &text(&output.stdout);
            assert!(said.contains("interrupted"), "{arguments:?}: {said}");
            let is_named = output.status.code() == Some(0) || said.contains("nothing has been identified");
            assert!(is_named, "{arguments:?}: {said}");
        }
    }
}

#[test]
fn a_lost_page_in_the_last_write_keeps_nobody_out() {
    // Writes of one, one, two and one lines; the lines of a write have its time.
    let opened = Entry::Opened { schema: journal::SCHEMA, program: "test".to_owned(), name: "s".to_owned() };
    let note = || Entry::Note { pose: None, text: "x".repeat(100) };
    let (mut bytes, mut ends, mut sum) = (Vec::new(), vec![0], Sum::default());
    for (number, (second, entry)) in (1..).zip([(1, opened), (2, note()), (3, note()), (3, note()), (4, note())]) {
        let time = jiff::Timestamp::from_second(second).unwrap();
        let (line, next) = journal::encode(&Line { number, time, entry }, &sum).unwrap();
        bytes.extend(line.into_bytes());
        ends.push(bytes.len());
        sum = next;
    }
    let lost = |lines: usize| {
        let mut bytes = bytes[..ends[lines]].to_vec();
        bytes[ends[2] + 8..ends[3] - 4].fill(0);
        journal::read(&bytes)
    };
    let journal = lost(4).unwrap();
    assert_eq!((journal.lines.len(), journal.torn_bytes), (2, ends[4] - ends[2]));
    // The page before the line break is lost as well.
    let mut whole_page = bytes[..ends[4]].to_vec();
    whole_page[ends[2]..ends[3] + 10].fill(0);
    assert_eq!(journal::read(&whole_page).unwrap().lines.len(), 2);
    // With a line of a later write behind it, it is damage.
    assert!(matches!(lost(5), Err(JournalError::Damaged { line: 3, .. })), "{:?}", lost(5));
}

#[test]
fn damaged_journals() {
    let whole = fs::read(root().join("sessions/example/journal.ron")).unwrap();
    let ends: Vec<usize> = whole.iter().enumerate().filter(|(_, byte)| **byte == b'\n').map(|(at, _)| at + 1).collect();
    let mut random = random(9);
    let (count, mut named, mut interrupted) = (times(100), 0, 0);
    for _ in 0..count {
        // A session that ended anywhere.
        let end = ends[random.random_range(5..ends.len())];
        let mut bytes = whole[..end].to_vec();
        let at = random.random_range(0..end - 1);
        match random.random_range(0..4) {
            0 => bytes[at] ^= 1 << random.random_range(0..8),
            1 => {
                let digits: Vec<usize> = (0..end).filter(|index| bytes[*index].is_ascii_digit()).collect();
                let at = digits[random.random_range(0..digits.len())];
                bytes[at] = b'0' + (bytes[at] - b'0' + 1) % 10;
            }
            2 => {
                let end = (at + 512).min(end);
                bytes[at..end].fill(0);
            }
            _ => drop(bytes.drain(at..(at + random.random_range(1..200)).min(end - 1))),
        }
        match journal::read(&bytes) {
            Err(_) => named += 1,
            Ok(journal) if journal.torn_bytes > 0 => interrupted += 1,
            Ok(journal) => panic!("{} lines without a word", journal.lines.len()),
        }
    }
    println!(
        "journals: {count} damaged, {named} refused with the line, {interrupted} read with a note, 0 without a word"
    );
}

// --------------------------------------------------------------------------------------------------------------- recordings

#[test]
fn a_damaged_recording_keeps_nobody_out_of_a_session() {
    let example = root().join("sessions/example");
    let whole = fs::read(example.join("recording.rrd")).unwrap();
    let mut random = random(12);
    let count = times(5);
    for turn in 0..count {
        let folder = tempfile::tempdir().unwrap();
        let session = folder.path().join("s");
        fs::create_dir(&session).unwrap();
        fs::copy(example.join("journal.ron"), session.join("journal.ron")).unwrap();
        let mut bytes = whole.clone();
        let at = random.random_range(0..bytes.len());
        bytes[at] = random.random();
        let end = (at + [1, 512, 4096][turn % 3]).min(bytes.len());
        bytes[at + 1..end].fill(0);
        fs::write(session.join("recording.rrd"), bytes).unwrap();
        let output = run(folder.path(), &["resume", "s", "--plain"]);
        assert_eq!(output.status.code(), Some(0), "{}", errors(&output));
        assert_eq!(run(folder.path(), &["record", "rebuild", "s"]).status.code(), Some(0));
        let output = run(folder.path(), &["replay", "s/recording.rrd", "--csv"]);
        assert_eq!(output.status.code(), Some(0), "the file stands for its folder: {}", errors(&output));
    }
    println!("recordings: {count} damaged, every session resumed");
}

// ------------------------------------------------------------------------------------------------------------------- inputs

#[test]
fn mutated_inputs() {
    const JOINTS: [JointType; 6] = [JointType::Revolute; 6];
    let folder = tempfile::tempdir().unwrap();
    let calibration = fs::read(calibrated(folder.path())).unwrap();
    let profile = builtin("soochow").unwrap().as_bytes().to_vec();
    let table = fs::read(root().join("sessions/soochow-example/measurements.csv")).unwrap();
    let journal = fs::read(root().join("sessions/example/journal.ron")).unwrap();
    let mut random = random(1000);
    let count = times(200);
    for turn in 0..count {
        let source = [&calibration, &profile, &table, &journal][turn % 4];
        let mut bytes = source.clone();
        for _ in 0..random.random_range(1..6) {
            let at = random.random_range(0..bytes.len());
            let to = (at + random.random_range(1..64)).min(bytes.len());
            match random.random_range(0..5) {
                0 => bytes[at] = random.random(),
                1 => drop(bytes.drain(at..to)),
                2 => {
                    let part = bytes[at..to].to_vec();
                    bytes.splice(at..at, part.repeat(random.random_range(1..50)));
                }
                3 => drop(bytes.splice(at..at, *b"1e308")),
                _ => bytes.truncate(at.max(1)),
            }
        }
        let text = String::from_utf8_lossy(&bytes).into_owned();
        match turn % 4 {
            0 => {
                let intact = Calibration::parse(&text).is_ok_and(|read| read.integrity == Integrity::Intact);
                assert!(!intact || text.trim_end() == String::from_utf8_lossy(source).trim_end(), "{text}");
            }
            1 => drop(Profile::parse(&text, "p")),
            2 => drop(measurements::read(&bytes, "t", &JOINTS)),
            _ => drop(journal::read(&bytes)),
        }
    }
    println!("inputs: {count} mutated, 0 crashes");
}

#[test]
fn absurd_inputs_are_refused_early() {
    let folder = tempfile::tempdir().unwrap();
    let columns: Vec<String> = (0..100_000).map(|index| format!("c{index}")).collect();
    fs::write(folder.path().join("wide.csv"), columns.join(",") + "\n").unwrap();
    fs::write(folder.path().join("endless.csv"), format!("pose,x_mm\n{}", "1,".repeat(5_000_000))).unwrap();
    fs::write(folder.path().join("long.csv"), format!("pose,x_mm\n{}", "1,2\n".repeat(1_000_000))).unwrap();
    let sparse = fs::File::create(folder.path().join("huge.csv")).unwrap();
    sparse.set_len(300 << 20).unwrap();
    let title = builtin("soochow").unwrap().replace("title: \"", &format!("title: \"{}", "x".repeat(10_000_000)));
    fs::write(folder.path().join("title.ron"), title).unwrap();
    let identify = |profile: &str, table: &str| {
        let limited = format!(
            "ulimit -v 3000000; ulimit -t 20; exec '{}' identify --profile {profile} --measurements {table}",
            crate::support::PROGRAM
        );
        std::process::Command::new("sh").args(["-c", &limited]).current_dir(folder.path()).output().unwrap()
    };
    for (profile, table, reason) in [
        ("soochow", "wide.csv", "bytes; at most 65536 are read"),
        ("soochow", "endless.csv", "bytes; at most 65536 are read"),
        ("soochow", "long.csv", "at most 250000 are read"),
        ("soochow", "huge.csv", "larger than 256 MiB"),
        ("title.ron", "wide.csv", "a profile has at most"),
    ] {
        let output = identify(profile, table);
        let said = errors(&output);
        assert_eq!(output.status.code(), Some(2), "{table}: {said}");
        assert!(said.contains(reason) && said.len() < 2000, "{said}");
    }
}

#[test]
fn messages_disturb_no_terminal() {
    const EVIL: &str = "\u{1b}[2J\u{7}\u{9b}31m\u{202e}evil";
    let folder = tempfile::tempdir().unwrap();
    let evil = folder.path().join(EVIL);
    fs::create_dir(&evil).unwrap();
    fs::copy(root().join("sessions/example/journal.ron"), evil.join("journal.ron")).unwrap();
    let spaced = format!("emscon:127.0.0.1:1{EVIL}");
    for arguments in [
        &["record", "rebuild", EVIL][..],
        &["session", "report", EVIL],
        &["session", "list", "."],
        &["session", "export", EVIL, "--csv", "--out", EVIL],
        &["link", "test", &spaced],
        &["link", "test", EVIL],
        &[EVIL],
        &["identify", "--level", EVIL],
        &["profile", "check", EVIL],
        &["resume", EVIL, "--plain"],
    ] {
        let output = run(folder.path(), arguments);
        let said = text(&output.stdout) + &text(&output.stderr);
        let bad = said.chars().find(|c| (c.is_control() && *c != '\n') || *c == '\u{202e}');
        assert_eq!(bad, None, "{arguments:?}: {said:?}");
    }
}

#[test]
fn limits_that_cannot_be_meant_are_named() {
    let profile = |acceptance: &str| {
        let text = builtin("soochow").unwrap();
        let (before, own) = text.split_once("acceptance: (").unwrap();
        let text = format!("{before}acceptance: ({acceptance}){}", own.split_once(')').unwrap().1);
        let (_, warnings) = Profile::parse(&text, "p").unwrap();
        warnings.iter().map(|warning| warning.message.clone()).collect::<Vec<_>>().join("; ")
    };
    assert_eq!(profile("position_mean_mm: 0.5, position_max_mm: 1.0"), "");
    assert!(
        profile("position_mean_mm: 4.0, position_max_mm: 1.0")
            .contains("'position_mean_mm' is above 'position_max_mm'")
    );
    assert!(profile("distance_max_mm: 400000.0").contains("which every arm meets"));
}

/// Exit code 70 is for defects of the program, and a limit of the system is none.
#[test]
fn limits_of_the_system_are_no_defect_of_the_program() {
    let folder = tempfile::tempdir().unwrap();
    let calibration = calibrated(folder.path());
    let targets = "pose,q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg\na,1,2,3,4,5,6\n";
    fs::write(folder.path().join("targets.csv"), targets).unwrap();
    let table = root().join("sessions/soochow-example/measurements.csv");
    let (calibration, table) = (calibration.to_str().unwrap(), table.to_str().unwrap());
    let commands = [
        format!("compensate --calibration {calibration} --targets targets.csv --out out.csv --record out.rrd"),
        format!("export --calibration {calibration} --format urdf --out out.urdf"),
        format!("identify --profile soochow --measurements {table} --out again"),
    ];
    for limit in ["ulimit -f 1", "ulimit -n 3", "ulimit -n 6"] {
        for command in &commands {
            let limited = format!("trap '' XFSZ; {limit}; exec '{}' {command}", crate::support::PROGRAM);
            let output =
                std::process::Command::new("sh").args(["-c", &limited]).current_dir(folder.path()).output().unwrap();
            let code = output.status.code();
            // With few files the program itself may not start (127).
            assert!(matches!(code, Some(0..=5 | 126 | 127)), "{limit}: {command}: {code:?} {}", errors(&output));
        }
    }
}
