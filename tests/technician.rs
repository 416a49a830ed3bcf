//! A technician in a real terminal of 80×24, keys only, over a simulated emScon tracker: what is mistyped, exchanged, forgotten or
//! cut off is answered as the screen proposes.

use std::fs;
use std::io::{BufRead as _, BufReader, Write as _};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::Duration;

use crate::support::PROGRAM;
use crate::support::place::Place;
use crate::support::pty::{ENTER, PATIENCE, Shown};
use crate::support::technician::{LONG, Technician};
use trupose::session::journal::Entry;
use trupose::session::state::Session;
use trupose::store::session::read_journal;

/// A search for poses on a busy machine.
const PLANNING: Duration = Duration::from_mins(4);

/// A tracker and a robot, until this is dropped. The robot goes where it is told.
struct Cell {
    child: Child,
    address: String,
}

impl Cell {
    /// Listens at `address`, with port 0 at any free one.
    fn start(folder: &Path, address: &str, plan: Option<&Path>) -> Self {
        let mut command = Command::new(PROGRAM);
        command.current_dir(folder).args(["simulate", "emscon", "--profile", "arm.ron", "--listen", address]);
        if let Some(plan) = plan {
            command.arg("--plan").arg(plan);
        }
        let mut child = command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::null()).spawn().unwrap();
        let line = BufReader::new(child.stdout.take().unwrap()).lines().next().unwrap().unwrap();
        let address = line.strip_prefix("listening: ").unwrap().to_owned();
        Self { child, address }
    }

    /// Drives the robot to a pose of the plan.
    fn go(&mut self, pose: &str) {
        let orders = self.child.stdin.as_mut().unwrap();
        writeln!(orders, "goto {pose}").unwrap();
        orders.flush().unwrap();
    }
}

impl Drop for Cell {
    fn drop(&mut self) {
        drop(self.child.kill());
        drop(self.child.wait());
    }
}

/// What the screen of the capture step asks for.
#[derive(Clone, Debug, PartialEq)]
enum Asked {
    /// To drive through a stop.
    Pass,
    /// To measure at a pose.
    Pose(String),
    /// To decide about a sample; whether a correction is proposed.
    Question { has_remedy: bool },
    /// Nothing: everything is measured.
    Nothing,
}

/// Reads the capture screen; `None` while something is running.
fn asked(shown: &Shown) -> Option<Asked> {
    let text = shown.text();
    if shown.step() != Some(5) || text.contains("cancel ") || !text.contains("· saved ·") {
        return None;
    }
    if text.contains("is in question") {
        return Some(Asked::Question { has_remedy: text.contains("apply the proposed correction") });
    }
    if text.contains("All poses of the plan have been measured.") {
        return Some(Asked::Nothing);
    }
    if text.contains(" first · ") {
        return Some(Asked::Pass);
    }
    let (_, after) = text.split_once("Go to pose ")?;
    Some(Asked::Pose(after.split_whitespace().next()?.to_owned()))
}

fn folder_of(place: &Place) -> Option<PathBuf> {
    let inside = fs::read_dir(place.path("sessions")).ok()?;
    inside.filter_map(Result::ok).map(|entry| entry.path()).find(|path| path.join("journal.ron").exists())
}

fn session(place: &Place) -> Session {
    Session::of(&read_journal(&folder_of(place).unwrap()).unwrap()).unwrap()
}

/// An arm that is not in the list, from its data sheet with a mistyped dimension to a corrected program. On the way two poses are
/// exchanged, one is missed, and the connection drops.
#[expect(clippy::too_many_lines, reason = "one day of a technician")]
#[test]
fn a_technician_measures_over_a_wire_whatever_goes_wrong() {
    let place = Place::new();
    let mut technician = Technician::start(&place);
    technician.describes_an_arm();

    // The tracker on the network; the simulated one has the same arm in front of it.
    technician.describes_the_cell();
    let journal = read_journal(&folder_of(&place).unwrap()).unwrap();
    let profile = journal.lines.iter().find_map(|line| match &line.entry {
        Entry::Profile { text, .. } => Some(text.clone()),
        _ => None,
    });
    fs::write(place.path("arm.ron"), profile.unwrap()).unwrap();
    let mut cell = Cell::start(place.0.path(), "127.0.0.1:0", None);
    technician.press("\u{1b}[B\u{1b}[B\u{1b}[B");
    technician.does(ENTER, "the list of links", |shown| shown.has("(type to search)"));
    technician.press("address as");
    technician.does(ENTER, "the form of the link", |shown| shown.has("An instrument on the network"));
    let address = cell.address.clone();
    technician.fill(&[Some(&address), Some("(measure_ms: 200)")]);
    technician.sees(LONG, "the tracker", |shown| shown.has("answers") && !shown.has("cancel connecting"));
    // A moment passes between the answer and the first point.
    technician.sees(LONG, "a point", |shown| shown.has("sees "));
    technician.presses_until("n", "step 3", |shown| shown.step() == Some(3));
    technician.does("p", "the choice", |shown| shown.has("chosen       as the profile says"));
    technician.does("n", "step 4", |shown| shown.step() == Some(4));
    technician.press("18\u{1b}[B10\u{1b}[B120\u{1b}[B\u{1b}[B0");
    technician.does("p", "the search", |shown| shown.has("cancel choosing poses"));
    technician.sees(PLANNING, "the plan", |shown| !shown.has("cancel choosing poses"));
    technician.does("a", "step 5", |shown| shown.step() == Some(5));

    // The connection drops, and the tracker comes back with the robot at the plan.
    technician.sees(LONG, "the plan on disk", |_| folder_of(&place).unwrap().join("plan.csv").exists());
    let listen = address.strip_prefix("emscon:").unwrap().trim_start_matches("tcp:").to_owned();
    let plan = folder_of(&place).unwrap().join("plan.csv");
    drop(cell);
    cell = Cell::start(place.0.path(), &listen, Some(&plan));

    let (mut measured, mut has_dropped, mut exchanged) = (0, false, None::<String>);
    let mut corrected = 0;
    for _ in 0..200 {
        // What is asked may change with the next frame: it is read together with the rest.
        let mut read = None;
        technician.sees(LONG, "something to do", |shown| {
            read = asked(shown).map(|asked| (asked, shown.text(), shown.samples()));
            read.is_some()
        });
        let (asks, before, samples) = read.unwrap();
        match asks {
            Asked::Pass => technician.press(ENTER),
            Asked::Nothing => break,
            Asked::Question { has_remedy: true } => {
                corrected += 1;
                technician.press("c");
            }
            Asked::Question { has_remedy: false } => {
                // Measured again where it should have been.
                if let Some(pose) = technician.terminal.look(|shown| {
                    let text = shown.text();
                    let (_, after) = text.split_once("Pose ")?;
                    Some(after.split_whitespace().next()?.to_owned())
                }) {
                    cell.go(&pose);
                }
                technician.press(ENTER);
            }
            Asked::Pose(pose) => {
                // Poses 7 and 8 in the wrong order; at pose 11 the robot is not moved; the connection drops at pose 13.
                let to = match (pose.as_str(), &exchanged) {
                    ("7", None) => "8",
                    ("8", None) => {
                        exchanged = Some("done".to_owned());
                        "7"
                    }
                    ("11", _) if measured == 10 => "10",
                    (other, _) => other,
                };
                cell.go(to);
                if pose == "13" && !has_dropped {
                    has_dropped = true;
                    drop(cell);
                    technician
                        .sees(LONG, "that the link is down", |shown| shown.has("down") || shown.has("reconnecting"));
                    cell = Cell::start(place.0.path(), &listen, Some(&plan));
                    cell.go(to);
                    technician.sees(LONG, "the tracker again", |shown| !shown.has("the link is down"));
                }
                measured += 1;
                technician.press(ENTER);
            }
        }
        technician.terminal.comes(LONG, |shown| {
            let now = shown.text();
            now != before && (asked(shown).is_some() || shown.samples() != samples)
        });
    }
    technician.sees(LONG, "the end", |shown| asked(shown) == Some(Asked::Nothing));
    let state = session(&place);
    assert!(state.counted().count() >= 20, "{}", state.counted().count());
    assert!(has_dropped && corrected > 0, "the connection was cut, and a correction was applied");
    let findings: Vec<String> = state
        .samples
        .iter()
        .flat_map(|sample| &sample.noted.findings)
        .map(|finding| finding.cause.to_string())
        .collect();
    assert!(!findings.is_empty());

    technician.does("n", "step 6", |shown| shown.step() == Some(6));
    technician.sees(LONG, "the result", |shown| !shown.has("cancel identifying"));
    technician.terminal.send_until(ENTER, "step 7", |shown| shown.step() == Some(7));
    technician.sees(LONG, "a verdict", |shown| shown.has("ACCEPTED:"));
    technician.terminal.send_until(ENTER, "step 8", |shown| shown.step() == Some(8));
    technician.press(ENTER);
    let folder = folder_of(&place).unwrap();
    technician.sees(LONG, "the files", |shown| shown.has("Written") && folder.join("calibration.ron").exists());

    // A program of the cell: its points were computed.
    fs::write(place.path("pick.src"), "DEF pick()\nPTP {A1 10, A2 20, A3 -30, A4 15, A5 40, A6 60}\nEND\n").unwrap();
    technician.does("p", "the form", |shown| shown.has("Robot program to correct"));
    technician.fill(&[Some("pick.src"), None, Some("\u{1b}[C")]);
    technician.sees(LONG, "the corrected program", |shown| shown.has("1 target corrected, 0 left"));
    let corrected = fs::read_to_string(folder.join("corrected/pick.src")).unwrap();
    assert!(corrected.starts_with("DEF pick()\nPTP {A1 ") && !corrected.contains("A1 10,"), "{corrected}");

    eprintln!("{} keys for {} samples, findings: {findings:?}", technician.keys, state.counted().count());
    technician.press("q");
    technician.press("y");
    assert_eq!(technician.terminal.end(PATIENCE, 0.0).0, 0);
    assert!(session(&place).closed);
}
