//! The wizard in plain lines, through pipes, what is recorded there, and sessions looked at again.

use std::fs;
use std::io::Write as _;
use std::path::Path;
use std::process::{Output, Stdio};

use crate::support::{command, text};
use trupose::session::journal::Entry;
use trupose::session::state::Session;
use trupose::store::session::read_journal;

const POSES: usize = 18;

fn place() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("plan.csv"), include_str!("sessions/plan.csv")).unwrap();
    folder
}

fn run(folder: &Path, arguments: &[&str], input: &str) -> Output {
    let mut command = command(folder, arguments);
    command.env("TERM", "dumb").env("LANG", "C").env_remove("LC_ALL");
    let mut child = command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    child.stdin.take().unwrap().write_all(input.as_bytes()).unwrap();
    child.wait_with_output().unwrap()
}

/// The whole demo in lines.
fn demo() -> String {
    let before = "ChooseProfile(\"soochow\")\nNameSession(\"s\")\nNext\n\
        ChooseInstrument(Simulated((seed: 1, truth: Paper)))\nNext\nChooseTarget(Profile)\nNext\n\
        LoadPlan(\"missing.csv\")\nLoadPlan(\"plan.csv\")\nAcceptPlan\n";
    format!("{before}{}Next\nIdentify\nNext\nNext\nDeliver\nQuit\n", "Measure\n".repeat(POSES))
}

#[test]
fn the_whole_calibration_is_done_in_lines_recorded_and_done_again() {
    let place = place();
    let output = run(place.path(), &["wizard", "--record-script", "recorded.script.ron"], &demo());
    let said = text(&output.stdout);
    assert_eq!(output.status.code(), Some(0), "{}\n{said}", text(&output.stderr));
    assert!(output.stdout.is_ascii());
    for part in ["step 1 of 8: Profile", "step 8 of 8: Deliver", "not done: ", "18 samples", "You can type:", "<- next"]
    {
        assert!(said.contains(part), "{part}:\n{said}");
    }
    assert!(text(&output.stderr).contains("trupose resume sessions/s"), "{}", text(&output.stderr));
    let session = Session::of(&read_journal(&place.path().join("sessions/s")).unwrap()).unwrap();
    assert!(session.closed && session.delivered.iter().any(|file| file.contains("calibration.ron")));
    assert_eq!(session.counted().count(), POSES);

    let script = fs::read_to_string(place.path().join("recorded.script.ron")).unwrap();
    assert!(script.contains("Fails(LoadPlan(\"missing.csv\")"), "{script}");
    let again = run(place.path(), &["--script", "recorded.script.ron"], "");
    assert_eq!(again.status.code(), Some(0), "{}", text(&again.stderr));
    let measured = |name: &str| fs::read_to_string(place.path().join(name).join("measurements.csv")).unwrap();
    assert_eq!(measured("sessions/s-2"), measured("sessions/s"));
}

#[test]
fn the_end_of_the_input_closes_the_session() {
    let place = place();
    let input = "\nnonsense\n99\nall\n1 x\nChooseProfile(\"soochow\")\nNameSession(\"s\")\nNext\n";
    let output = run(place.path(), &["wizard", "--plain"], input);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    let said = text(&output.stdout);
    assert!(said.contains("there is no 99 in the list") && said.contains("step 2 of 8"), "{said}");
    let journal = read_journal(&place.path().join("sessions/s")).unwrap();
    let Entry::Closed { reason } = &journal.lines.last().unwrap().entry else { panic!("not closed") };
    assert_eq!(reason, "the input ended");
    // And on with it.
    let output = run(place.path(), &["resume", "sessions/s", "--plain"], "ChooseTarget(Profile)\nBack\n");
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    assert!(text(&output.stdout).contains("step 2 of 8"), "{}", text(&output.stdout));
}

#[test]
fn a_session_is_replayed_without_a_terminal_and_not_changed() {
    let place = place();
    assert_eq!(run(place.path(), &["wizard"], &demo()).status.code(), Some(0));
    let file = place.path().join("sessions/s/journal.ron");
    let bytes = fs::read(&file).unwrap();
    let replay = |arguments: &[&str]| run(place.path(), &[&["replay", "sessions/s"], arguments].concat(), "");
    let journal = read_journal(&place.path().join("sessions/s")).unwrap();
    let sample = journal.lines.iter().position(|line| matches!(line.entry, Entry::Sample(_))).unwrap() + 1;

    let all = text(&replay(&["--print"]).stdout);
    assert_eq!(all.lines().count(), journal.lines.len() + 2 + POSES);
    let part = text(&replay(&["--print", "--entry", &sample.to_string()]).stdout);
    assert_eq!(part.lines().count(), sample + 2 + 1);
    assert!(all.starts_with(part.split("\n\n").next().unwrap()));
    let table = text(&replay(&["--csv"]).stdout);
    assert_eq!(table, fs::read_to_string(place.path().join("sessions/s/measurements.csv")).unwrap());
    assert_eq!(text(&replay(&["--csv", "--entry", &sample.to_string()]).stdout).lines().count(), 4);

    for (arguments, code, message) in [
        (&["--print", "--entry", "0"][..], 2, "the session has no entry 0"),
        (&["--csv", "--entry", "1"], 2, "has no robot at that entry"),
        (&[], 2, "needs a terminal"),
    ] {
        let output = replay(arguments);
        assert_eq!(output.status.code(), Some(code), "{arguments:?}");
        assert!(text(&output.stderr).replace("\n  ", " ").contains(message), "{}", text(&output.stderr));
    }
    assert_eq!(run(place.path(), &["replay", "sessions/none", "--print"], "").status.code(), Some(5));
    assert_eq!(fs::read(&file).unwrap(), bytes);
}

/// Runs plain lines with a limit of the size of files: a disk that is full at exactly that byte.
#[cfg(unix)]
fn limited(folder: &Path, blocks: u64, input: &str) -> Output {
    let program = command(folder, &[]).get_program().to_owned();
    let limited = format!("ulimit -f {blocks}; exec '{}' wizard --plain --no-recording", program.to_str().unwrap());
    let mut shell = std::process::Command::new("timeout");
    shell.args(["60", "sh", "-c", &limited]).current_dir(folder).env("TERM", "dumb").env("LANG", "C");
    let mut child = shell.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    drop(child.stdin.take().unwrap().write_all(input.as_bytes()));
    child.wait_with_output().unwrap()
}

#[cfg(unix)]
#[test]
fn a_journal_that_cannot_grow_stops_the_lines_and_is_never_called_saved() {
    let whole = place();
    assert_eq!(run(whole.path(), &["wizard", "--no-recording"], &demo()).status.code(), Some(0));
    let full = fs::metadata(whole.path().join("sessions/s/journal.ron")).unwrap().len() / 512;
    for blocks in [full / 2, full * 2 / 3] {
        let place = place();
        let output = limited(place.path(), blocks, &demo());
        let (said, errors) = (text(&output.stdout), text(&output.stderr).replace("\n  ", " "));
        assert_eq!(output.status.code(), Some(5), "{errors}\n{said}");
        for part in ["STOP: could not save", "NOT SAVED", "  retry", "  quit"] {
            assert!(said.contains(part), "{part}:\n{said}");
        }
        assert!(errors.contains("NOT saved: "), "{errors}");
        assert!(errors.contains("the session is saved up to there") && errors.contains("trupose resume"), "{errors}");
        let journal = read_journal(&place.path().join("sessions/s")).unwrap();
        assert_eq!(journal.torn_bytes, 0);
        let resumed = run(place.path(), &["resume", "sessions/s", "--plain"], "Quit\n");
        assert_eq!(resumed.status.code(), Some(0), "{}", text(&resumed.stderr));
    }
}
