//! The wizard in a real terminal: walked by keys, resized, suspended, flooded, and abandoned in every step.
//!
//! What is looked for is stable: the step in the header, `saved`, what a key does.

use std::fs;
use std::time::Duration;

use crate::support::PROGRAM;
use crate::support::place::Place;
use crate::support::pty::{CTRL_U, CTRL_Z, ENTER, PATIENCE, Shown, Terminal, processor_seconds};
use crate::support::technician::Technician;
use proptest::prelude::*;
use proptest::test_runner::{Config, TestRunner};
use trupose::session::journal::Entry;
use trupose::session::set_up::Step;
use trupose::session::state::Session;
use trupose::store::session::read_journal;

/// A terminal that went away is noticed within this.
const GONE: Duration = Duration::from_secs(1);
/// Processor time (s) that closing a session may take.
const CLOSING: f64 = 0.3;
const SIZE: (u16, u16) = (80, 24);
const POSES: usize = 18;
/// A search for poses on a busy machine.
const PLANNING: Duration = Duration::from_mins(4);

/// Steps of a script that end in each step of the wizard.
const SCRIPT: [&str; 7] = [
    "Do(ChooseProfile(\"soochow\")), Do(NameSession(\"s\")), Do(Next)",
    "Do(ChooseInstrument(Simulated((seed: 1, truth: Paper)))), Do(Next)",
    "Do(ChooseTarget(Profile)), Do(Next)",
    "Do(LoadPlan(\"plan.csv\")), Do(AcceptPlan)",
    "CaptureAll(Fail), Do(Next)",
    "Do(Identify), Do(Next)",
    "Do(Next)",
];

impl Place {
    /// A session that is in `step`.
    fn session_in(&self, step: Step) {
        let steps = SCRIPT[..step.number() - 1].join(", ");
        let script = format!("(title: \"test\", steps: [{steps}])");
        fs::write(self.path("to.script.ron"), script).unwrap();
        let output = self.run(&["--script", "to.script.ron"]);
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    }

    /// The wizard in a terminal, with the first step shown.
    fn wizard(&self, arguments: &[&str], variables: &[(&str, &str)]) -> Terminal {
        let arguments = [&["wizard", "--profile", "soochow"], arguments].concat();
        let terminal = Terminal::start_with(self.0.path(), PROGRAM, &arguments, SIZE, variables);
        terminal.wait_for_step(1);
        terminal
    }

    /// The wizard with a session in `step`.
    fn resumed(&self, step: Step) -> Terminal {
        self.session_in(step);
        let terminal = Terminal::start(self.0.path(), &["resume", "sessions/s"], SIZE);
        terminal.wait_for_step(u32::try_from(step.number()).unwrap());
        terminal.wait_for_text("· saved ·");
        terminal
    }

    /// The journal makes a session and ends in good order.
    #[track_caller]
    fn is_closed(&self) -> Session {
        let journal = read_journal(&self.session()).unwrap();
        let last = journal.lines.last().unwrap();
        assert!(matches!(last.entry, Entry::Closed { .. }), "{last:?}");
        assert_eq!(journal.torn_bytes, 0);
        Session::of(&journal).unwrap()
    }
}

/// What is written when the terminal is given back, in this order.
#[track_caller]
fn is_given_back(terminal: &Terminal) {
    // The program may have ended before all that it wrote is read here.
    terminal
        .wait_for("the last that is written", |shown| String::from_utf8_lossy(&shown.raw).contains("\u{1b}[?1049l"));
    let raw = String::from_utf8_lossy(&terminal.raw()).into_owned();
    let place = |code: &str| raw.rfind(code).unwrap_or_else(|| panic!("{code:?} was not written"));
    assert!(place("\u{1b}[?25h") > place("\u{1b}[?25l"), "the cursor is hidden");
    assert!(place("\u{1b}[?2004l") > place("\u{1b}[?2004h"), "paste is bracketed");
    assert!(place("\u{1b}[?1049l") > place("\u{1b}[?1049h"), "the other screen is shown");
    assert!(place("\u{1b}[?1049l") > place("\u{1b}[?25h"), "not in reverse order");
    terminal.look(|shown| {
        assert!(!shown.screen().alternate_screen() && !shown.screen().hide_cursor());
        assert!(!shown.screen().bracketed_paste());
    });
}

#[test]
fn any_key_takes_over_a_demonstration_and_does_nothing_else() {
    /// Longer than a page of the demonstration stays.
    const LONGER_THAN_A_PAGE: Duration = Duration::from_secs(5);
    const ESCAPE: &str = "\u{1b}";
    const DOWN: &str = "\u{1b}[B";
    let place = Place::new();
    let taken_over = |key: &str| {
        let mut terminal = Terminal::start(place.0.path(), &["demo", "--watch"], SIZE);
        terminal.wait_for_text("you are watching; any key takes over");
        terminal.send(key);
        terminal.wait_for_text("you have taken over");
        let text = terminal.text();
        assert!(text.contains("\u{25b8} abb_irb120") && !text.contains("Leave the program?"), "{key:?}:\n{text}");
        terminal
    };
    for key in ["q", "c", "7", ESCAPE, DOWN] {
        drop(taken_over(key));
    }
    let mut terminal = taken_over(ENTER);
    let is_driven = |shown: &Shown| shown.has("The session gets a name") || shown.step() != Some(1);
    assert!(!terminal.comes(LONGER_THAN_A_PAGE, is_driven), "it is still driven:\n{}", terminal.text());
    terminal.send(ENTER);
    terminal.wait_for_text("use this robot");
    terminal.send(ENTER);
    terminal.wait_for_step(2);
}

#[test]
fn the_whole_calibration_is_walked_by_keys() {
    let place = Place::new();
    // The program sees the modes as the shell has set them: so they must be when it has ended.
    let line = format!("stty -a; '{PROGRAM}' wizard --profile soochow; echo \"code $?\"; stty -a; echo over");
    let mut terminal = Terminal::start_with(place.0.path(), "bash", &["-c", &line], SIZE, &[]);
    terminal.wait_for_step(1);
    assert!(terminal.look(|shown| shown.screen().alternate_screen() && shown.screen().hide_cursor()));
    terminal.wait_for("the robot", |shown| shown.has("not saved yet"));
    terminal.send(ENTER);
    terminal.wait_for_step(2);
    // By hand in mm, m, inch, over a wire; then the simulated cell, which asks for its seed first.
    terminal.send("\u{1b}[B\u{1b}[B\u{1b}[B\u{1b}[B");
    terminal.send(ENTER);
    terminal.wait_for_text("hidden errors of the arm");
    terminal.send(ENTER);
    terminal.wait_for("the instrument", |shown| shown.has("simulated") && !shown.has("no instrument"));
    terminal.send_until("n", "step 3", |shown| shown.step() == Some(3));
    terminal.send("p");
    terminal.send_until("n", "step 4", |shown| shown.step() == Some(4));
    terminal.send("l");
    terminal.send(&format!("{CTRL_U}plan.csv{ENTER}"));
    terminal.send_until("a", "step 5", |shown| shown.step() == Some(5));
    for pose in 1..=POSES {
        terminal.send("m");
        terminal.wait_for(&format!("sample {pose}"), |shown| shown.samples() == pose && shown.has("· saved ·"));
    }
    terminal.send_until("n", "step 6", |shown| shown.step() == Some(6));
    terminal.send("i");
    terminal.send_until("n", "step 7", |shown| shown.step() >= Some(7));
    terminal.send_until("n", "step 8", |shown| shown.step() == Some(8));
    terminal.send("d");
    let folder = fs::read_dir(place.0.path().join("sessions")).unwrap().next().unwrap().unwrap().path();
    terminal.wait_for("the files", |_| folder.join("calibration.ron").exists());
    // The files are there before the entry that says so.
    terminal.wait_for("what was done is saved", |shown| shown.has("Written") && shown.has("· saved ·"));
    terminal.send("q");
    terminal.send("y");
    terminal.wait_for_text("over");
    assert_eq!(terminal.end(PATIENCE, 0.0).0, 0);
    let raw = String::from_utf8(terminal.raw()).unwrap();
    assert!(raw.contains("code 0\r\n"), "{raw}");
    let (before, rest) = raw.split_once("\u{1b}[?1049h").unwrap();
    let (_, after) = rest.split_once("code 0\r\n").unwrap();
    assert!(before.contains(" echo ") && before.contains(" icanon "), "{before}");
    assert_eq!(after.replace("over\r\n", ""), before);
    is_given_back(&terminal);
    let session = Session::of(&read_journal(&folder).unwrap()).unwrap();
    assert!(session.closed && session.delivered.iter().any(|file| file.contains("calibration.ron")));
    assert_eq!(session.counted().count(), POSES);
}

#[test]
fn a_terminal_that_goes_away_in_any_step_ends_the_program_in_good_order() {
    for &step in Step::ALL {
        for hangs_up in [true, false] {
            let place = Place::new();
            let mut terminal = if step == Step::Profile { place.wizard(&[], &[]) } else { place.resumed(step) };
            let used = processor_seconds(terminal.process());
            if hangs_up {
                terminal.hang_up();
            } else {
                terminal.signal("HUP");
            }
            let (code, used) = terminal.end(GONE, used);
            assert_eq!(code, 129, "{step}");
            assert!(used < CLOSING, "{step}: {used} s of processor time");
            if step == Step::Profile && !hangs_up {
                assert!(!place.session().exists());
            } else if step != Step::Profile {
                assert!(place.is_closed().closed);
            }
        }
    }
}

#[test]
fn sigterm_closes_the_session_and_gives_the_terminal_back() {
    let place = Place::new();
    let mut terminal = place.resumed(Step::Capture);
    terminal.signal("TERM");
    assert_eq!(terminal.end(PATIENCE, 0.0).0, 143);
    terminal.wait_for("what it says", |shown| shown.has("trupose resume sessions/s"));
    is_given_back(&terminal);
    assert!(terminal.modes().contains("ICANON") && terminal.modes().contains("ECHO"), "{}", terminal.modes());
    assert_eq!(place.is_closed().step, Step::Capture);
}

#[test]
fn ctrl_z_goes_to_the_shell_and_fg_comes_back() {
    let place = Place::new();
    let line = format!(
        "set -m; '{PROGRAM}' wizard --profile soochow; echo stopped; stty -a; read answer; fg >/dev/null; echo \"code $?\"; stty -a"
    );
    let mut terminal = Terminal::start_with(place.0.path(), "bash", &["-c", &line], SIZE, &[]);
    terminal.wait_for_step(1);
    terminal.send(CTRL_Z);
    terminal.wait_for("the shell", |shown| shown.has("stopped") && shown.has(" icanon "));
    is_given_back(&terminal);
    terminal.send("go\n");
    terminal.wait_for("all of it again", |shown| {
        shown.step() == Some(1) && shown.screen().alternate_screen() && shown.has("quit")
    });
    // It takes keys again.
    terminal.send("?");
    terminal.wait_for_text("robot picture");
    // The last key means nothing any more; what the others did is drawn all the same.
    terminal.send(" q\u{1b}");
    terminal.wait_for("no help", |shown| !shown.has("robot picture"));
    terminal.send("q");
    terminal.send_until("y", "the end", |shown| shown.has("code 0"));
    assert_eq!(terminal.end(PATIENCE, 0.0).0, 0);
    is_given_back(&terminal);
}

#[test]
fn any_size_will_do_and_a_small_one_says_what_it_needs() {
    let place = Place::new();
    let mut terminal = place.wizard(&[], &[]);
    terminal.resize((40, 10));
    terminal.wait_for_text("terminal 40x10, need 60x18");
    terminal.resize(SIZE);
    terminal.wait_for("the step again", |shown| shown.step() == Some(1) && shown.has("quit"));
    terminal.resize((0, 0));
    // Keys are still taken: the help page is open when there is room again.
    terminal.send("?");
    terminal.resize((1, 1));
    terminal.resize(SIZE);
    terminal.wait_for_text("robot picture");
    terminal.resize((200, 50));
    terminal.wait_for("all of it, large", |shown| shown.step() == Some(1) && shown.text().lines().count() >= 49);
    terminal.resize((0, 0));
    terminal.signal("TERM");
    assert_eq!(terminal.end(PATIENCE, 0.0).0, 143);
}

#[test]
fn a_key_that_comes_together_with_a_new_size_is_taken_at_once() {
    let place = Place::new();
    let mut terminal = place.wizard(&[], &[]);
    // Whether both are there when the program looks is a matter of luck: it gets many chances.
    for turn in 0_u16..40 {
        terminal.resize((0, 0));
        terminal.send("?");
        terminal.resize((1, 1));
        terminal.resize(SIZE);
        let is_help = turn % 2 == 0;
        terminal.wait_for("the key", |shown| shown.step() == Some(1) && shown.has("redraw the screen") == is_help);
    }
    terminal.signal("TERM");
    assert_eq!(terminal.end(PATIENCE, 0.0).0, 143);
}

#[test]
fn the_bell_rings_only_when_it_is_asked_for() {
    let rings = |terminal: &Terminal| terminal.raw().split(|byte| *byte == 7).count() - 1;
    for (arguments, keys, expected) in [(&["--bell"][..], "\u{2}\u{2}", 1), (&[], "\u{2}", 1), (&["--bell"], "", 0)] {
        let place = Place::new();
        let mut terminal = place.wizard(arguments, &[]);
        terminal.send(keys);
        terminal.send("?");
        terminal.wait_for_text("redraw the screen");
        assert_eq!(rings(&terminal), expected, "{arguments:?} {keys:?}");
        terminal.signal("TERM");
        assert_eq!(terminal.end(PATIENCE, 0.0).0, 143);
    }
}

#[test]
fn a_session_is_replayed_by_keys() {
    let place = Place::new();
    place.session_in(Step::Verify);
    let file = place.session().join("journal.ron");
    let before = fs::read(&file).unwrap();
    let entries = read_journal(&place.session()).unwrap().lines.len();
    let mut terminal = Terminal::start(place.0.path(), &["replay", "sessions/s"], SIZE);
    let at = |entry: usize| format!("entry {entry} of {entries}");
    let press = |terminal: &mut Terminal, keys: &str, shown: &str| {
        terminal.send(keys);
        terminal.wait_for_text(shown);
    };
    terminal.wait_for_text(&at(1));
    press(&mut terminal, "\u{1b}[C", &at(2));
    press(&mut terminal, "\u{1b}[C", &at(3));
    press(&mut terminal, "\u{1b}[D", &at(2));
    press(&mut terminal, "\u{1b}[F", &at(entries));
    press(&mut terminal, "\t", "identification counts");
    press(&mut terminal, "\t", "parameters");
    press(&mut terminal, "\t\u{1b}[H", &at(1));
    // Two entries per second to begin with, twenty at most.
    press(&mut terminal, " ", "playing 2/s");
    press(&mut terminal, "+", "playing 4/s");
    press(&mut terminal, "++++++", "playing 20/s");
    press(&mut terminal, "-", "playing 16/s");
    terminal.wait_for("the end", |shown| shown.has(&at(entries)) && !shown.has("playing"));
    terminal.resize((100, 30));
    terminal.wait_for("all of it, larger", |shown| shown.has(&at(entries)) && shown.text().lines().count() >= 29);
    terminal.send("q");
    assert_eq!(terminal.end(PATIENCE, 0.0).0, 0);
    is_given_back(&terminal);
    assert!(terminal.modes().contains("ICANON") && terminal.modes().contains("ECHO"), "{}", terminal.modes());
    assert_eq!(fs::read(&file).unwrap(), before);
}

#[test]
fn a_replay_whose_terminal_goes_away_ends() {
    let place = Place::new();
    place.session_in(Step::Identify);
    for hangs_up in [true, false] {
        let mut terminal = Terminal::start(place.0.path(), &["replay", "sessions/s"], SIZE);
        terminal.wait_for_text("entry 1 of");
        terminal.send(" ");
        terminal.wait_for_text("playing");
        let used = processor_seconds(terminal.process());
        if hangs_up {
            terminal.hang_up();
        } else {
            terminal.signal("HUP");
        }
        let (code, used) = terminal.end(GONE, used);
        assert!(code == 129 && used < CLOSING, "{code}: {used} s of processor time");
    }
}

/// Codes of all `ESC [ … m` that were written.
fn looks(raw: &[u8]) -> Vec<u32> {
    let text = String::from_utf8_lossy(raw).into_owned();
    let sequences = text.split("\u{1b}[").skip(1).filter_map(|rest| {
        let end = rest.find(|c: char| c.is_ascii_alphabetic())?;
        (rest.get(end..=end) == Some("m")).then(|| rest.get(..end).unwrap_or_default().to_owned())
    });
    sequences.flat_map(|codes| codes.split(';').map(|code| code.parse().unwrap_or(0)).collect::<Vec<_>>()).collect()
}

const fn is_colour(code: u32) -> bool {
    matches!(code, 30..=49 | 90..=107)
}

/// Everything that is written on the way through the first steps.
fn written_on_a_walk(arguments: &[&str], variables: &[(&str, &str)]) -> Vec<u8> {
    let place = Place::new();
    let mut terminal = place.wizard(arguments, variables);
    terminal.send("?");
    terminal.wait_for_text("robot picture");
    terminal.send("\u{1b}");
    terminal.wait_for("the step", |shown| !shown.has("robot picture"));
    terminal.send_until("n", "step 2", |shown| shown.step() == Some(2));
    terminal.send("n");
    terminal.send_until("b", "step 1", |shown| shown.step() == Some(1));
    terminal.signal("TERM");
    terminal.end(PATIENCE, 0.0);
    terminal.raw()
}

#[test]
fn no_color_and_ascii_are_kept_to() {
    let usual = written_on_a_walk(&[], &[]);
    assert!(looks(&usual).into_iter().any(|code| is_colour(code) && !matches!(code, 39 | 49)));
    assert!(!usual.is_ascii());
    for variables in [&[("NO_COLOR", "1")][..], &[]] {
        let arguments: &[&str] = if variables.is_empty() { &["--color", "never"] } else { &[] };
        let colours: Vec<u32> =
            looks(&written_on_a_walk(arguments, variables)).into_iter().filter(|code| is_colour(*code)).collect();
        let allowed: &[u32] = if variables.is_empty() { &[39, 49] } else { &[] };
        assert!(colours.iter().all(|code| allowed.contains(code)), "{arguments:?}: {colours:?}");
    }
    for (arguments, variables) in [(&["--ascii"][..], &[][..]), (&[], &[("LANG", "C")])] {
        let written = written_on_a_walk(arguments, variables);
        assert!(written.is_ascii(), "{}", String::from_utf8_lossy(&written));
    }
}

/// Bytes as a broken line or a cat on the keyboard sends them, without what makes the program give the terminal back: then
/// such bytes are signals.
fn garbage() -> impl Strategy<Value = Vec<u8>> {
    let piece = prop_oneof![
        prop::collection::vec(any::<u8>(), 1..12),
        "\u{1b}\\[[0-9;?<>]{0,12}[@-~]".prop_map(String::into_bytes),
        "\u{1b}[OPN\\]_^][ -~]{0,6}".prop_map(String::into_bytes),
        "\u{1b}\\[200~[ -~\u{1b}\r\n]{0,40}\u{1b}\\[201~".prop_map(String::into_bytes),
    ];
    let harmless = |byte: u8| if matches!(byte, b'q' | 0x03 | 0x1a | 0x1c) { b'x' } else { byte };
    prop::collection::vec(piece, 600..700).prop_map(move |pieces| pieces.concat().into_iter().map(harmless).collect())
}

#[test]
fn garbage_does_not_make_it_fail() {
    let settings = Config { cases: 4, max_shrink_iters: 0, failure_persistence: None, ..Config::default() };
    let outcome = TestRunner::new(settings).run(&garbage(), |bytes| {
        let place = Place::new();
        let mut terminal = place.wizard(&[], &[]);
        let bytes: Vec<u8> = bytes.iter().copied().cycle().take(10_000).collect();
        for piece in bytes.chunks(1000) {
            terminal.send_bytes(piece);
            // What is pasted must end, or all the rest is a part of it.
            terminal.send("\u{1b}[201~");
        }
        // What was drawn again came after all of it.
        terminal.resize((81, 24));
        terminal.wait_for("a step", |shown| shown.step().is_some());
        terminal.signal("TERM");
        let (code, _) = terminal.end(PATIENCE, 0.0);
        let said = String::from_utf8_lossy(&terminal.raw()).into_owned();
        assert!(code == 143 && !said.contains("internal error"), "{code}: {}", terminal.text());
        Ok(())
    });
    outcome.unwrap();
}

/// An arm that is not in the list, from its data sheet to a corrected program: with an exchanged pose, a bad reading and a beam that
/// breaks, answered as the screen proposes.
#[test]
fn a_technician_without_a_profile_calibrates_by_keys() {
    let place = Place::new();
    let mut technician = Technician::start(&place);
    technician.describes_an_arm();
    technician.describes_the_cell();
    technician.press("\u{1b}[B\u{1b}[B\u{1b}[B\u{1b}[B");
    technician.press(ENTER);
    technician.terminal.wait_for_text("hidden errors of the arm");
    technician.fill(&[Some("5"), None, None, None, Some("swapped-rows@6, outlier@12:4mm, beam-break@15")]);
    technician.terminal.wait_for("the instrument", |shown| shown.has("simulated cell") && shown.has("answers"));
    technician.presses_until("n", "step 3", |shown| shown.step() == Some(3));
    technician.press("p");
    technician.presses_until("n", "step 4", |shown| shown.step() == Some(4));
    technician.press("26\u{1b}[B6\u{1b}[B120");
    technician.press("p");
    technician.terminal.wait_for_text("cancel choosing poses");
    let is_chosen = |shown: &Shown| !shown.has("cancel choosing poses");
    assert!(technician.terminal.comes(PLANNING, is_chosen), "{}", technician.terminal.text());
    technician.presses_until("a", "step 5", |shown| shown.step() == Some(5));

    // Enter always does the next sensible thing; what is in question is corrected, or measured again.
    for _ in 0..200 {
        if technician.terminal.look(|shown| shown.step() == Some(6)) {
            break;
        }
        let before = technician.terminal.look(Shown::text);
        let has_remedy = technician.terminal.look(|shown| shown.has("c apply the correction"));
        technician.press(if has_remedy { "c" } else { ENTER });
        technician.terminal.comes(Duration::from_secs(3), |shown| shown.text() != before && shown.has("· saved ·"));
    }
    technician.terminal.wait_for_step(6);
    technician.presses_until(ENTER, "step 7", |shown| shown.step() == Some(7));
    technician.terminal.wait_for("a verdict", |shown| shown.has("ACCEPTED") || shown.has("accepted"));
    technician.presses_until(ENTER, "step 8", |shown| shown.step() == Some(8));
    technician.press(ENTER);
    let mut inside = fs::read_dir(place.0.path().join("sessions")).unwrap().map(|entry| entry.unwrap().path());
    let folder = inside.find(|path| path.is_dir()).unwrap();
    technician.terminal.wait_for("the files", |_| folder.join("calibration.ron").exists());
    technician.terminal.wait_for("what was done is saved", |shown| shown.has("Written") && shown.has("· saved ·"));
    technician.press("q");
    technician.press("y");
    assert_eq!(technician.terminal.end(PATIENCE, 0.0).0, 0);
    let session = Session::of(&read_journal(&folder).unwrap()).unwrap();
    let counted = session.counted().count();
    eprintln!("{} keys, {} bytes for {counted} samples", technician.keys, technician.terminal.written());
    assert!(counted >= 32 && session.closed, "{counted}");
    assert!(place.path("sessions/cell.ron").exists());

    // To a corrected program.
    let program = "MODULE part\n  PROC main()\n    MoveAbsJ [[10,20,-20,30,40,50],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,fine,tool0;\n  ENDPROC\nENDMODULE\n";
    fs::write(place.path("part.mod"), program).unwrap();
    let calibration = folder.join("calibration.ron");
    let arguments = [
        "compensate",
        "--calibration",
        calibration.to_str().unwrap(),
        "--program",
        "part.mod",
        "--dialect",
        "rapid",
        "--points",
        "computed",
        "--out",
        "corrected.mod",
    ];
    let output = place.run(&arguments);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let corrected = fs::read_to_string(place.path("corrected.mod")).unwrap();
    assert!(corrected.contains("MoveAbsJ [[") && !corrected.contains("[[10,20,-20"), "{corrected}");
}
