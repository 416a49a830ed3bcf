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
        self.orders(&format!("goto {pose}"));
    }

    fn orders(&mut self, line: &str) {
        let orders = self.child.stdin.as_mut().unwrap();
        writeln!(orders, "{line}").unwrap();
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

/// Folder of the session that was begun last.
fn folder_of(place: &Place) -> Option<PathBuf> {
    let inside = fs::read_dir(place.path("sessions")).ok()?;
    let sessions =
        inside.filter_map(Result::ok).map(|entry| entry.path()).filter(|path| path.join("journal.ron").exists());
    sessions.max_by_key(|path| fs::metadata(path.join("journal.ron")).and_then(|data| data.created()).ok())
}

fn session(place: &Place) -> Session {
    Session::of(&read_journal(&folder_of(place).unwrap()).unwrap()).unwrap()
}

/// Connects to the tracker, from the list of links to the third step.
fn connects(technician: &mut Technician, address: &str) {
    technician.press("\u{1b}[B\u{1b}[B\u{1b}[B");
    technician.does(ENTER, "the list of links", |shown| shown.has("(type to search)"));
    technician.press("address as");
    technician.does(ENTER, "the form of the link", |shown| shown.has("An instrument on the network"));
    technician.fill(&[Some(address), Some("(measure_ms: 200)")]);
    technician.sees(LONG, "the tracker", |shown| shown.has("answers") && !shown.has("cancel connecting"));
    // A moment passes between the answer and the first point.
    technician.sees(LONG, "a point", |shown| shown.has("sees "));
    technician.presses_until("n", "step 3", |shown| shown.step() == Some(3));
}

/// The point of the circles that is asked for: its title, and the joints as they are shown.
fn circle_point(shown: &Shown) -> Option<(String, String)> {
    let text = shown.text();
    let title = text.lines().find(|line| line.contains("circle of ") && line.contains(": point "))?.trim().to_owned();
    let value = |line: &str| {
        let mut words = line.split_whitespace();
        let name = words.next()?;
        let is_joint = name.strip_prefix('J').is_some_and(|rest| rest.parse::<u32>().is_ok());
        words.next().filter(|value| is_joint && value.parse::<f64>().is_ok()).map(str::to_owned)
    };
    let joints: Vec<String> = text.lines().filter_map(value).collect();
    (joints.len() == 6).then(|| (title, joints.join(" ")))
}

/// Measures the whole arm by circles, and saves it as a profile in the folder of the session.
fn measures_the_arm(technician: &mut Technician, cell: &mut Cell) {
    technician.does("w", "the first circle", |shown| circle_point(shown).is_some());
    let mut last = None;
    loop {
        let mut read = None;
        technician.sees(LONG, "a point, or the arm", |shown| {
            let is_done = shown.has("Circles, ");
            read = circle_point(shown).filter(|_| !shown.has("cancel ")).filter(|point| Some(point) != last.as_ref());
            is_done || read.is_some()
        });
        let Some(point) = read else { break };
        cell.orders(&format!("joints {}", point.1));
        technician.press(ENTER);
        last = Some(point);
    }
    technician.does("s", "the measured arm", |shown| shown.has("measured-arm.ron"));
}

/// An arm that is not in the list, from its data sheet with a mistyped dimension, with the tracker on the network; the simulated
/// one has the same arm in front of it.
fn begins(place: &Place) -> (Technician, Cell) {
    let mut technician = Technician::start(place);
    technician.describes_an_arm();
    technician.describes_the_cell();
    let journal = read_journal(&folder_of(place).unwrap()).unwrap();
    let profile = journal.lines.iter().find_map(|line| match &line.entry {
        Entry::Profile { text, .. } => Some(text.clone()),
        _ => None,
    });
    fs::write(place.path("arm.ron"), profile.unwrap()).unwrap();
    let cell = Cell::start(place.0.path(), "127.0.0.1:0", None);
    connects(&mut technician, &cell.address);
    (technician, cell)
}

#[test]
fn a_technician_measures_over_a_wire_whatever_goes_wrong() {
    let place = Place::new();
    let (mut technician, cell) = begins(&place);
    calibrates(&place, &mut technician, cell);
}

/// The rest of that day is the one of the test above; it takes a minute more, and is walked where `TRUPOSE_WHOLE_DAY` is set.
#[test]
fn a_technician_measures_an_arm_by_circles_and_continues_with_it() {
    let place = Place::new();
    let (mut technician, mut cell) = begins(&place);
    measures_the_arm(&mut technician, &mut cell);
    technician.press("q");
    technician.press("y");
    assert_eq!(technician.terminal.end(PATIENCE, 0.0).0, 0);

    // Another session begins with the measured arm. Its path is completed.
    technician.begins_again(&place);
    technician.does("f", "the path", |shown| shown.has("Path of the profile"));
    technician.does("sessions/m\t", "the session", |shown| shown.has("sessions/maker"));
    technician.does("measured\t", "the file", |shown| shown.has("/measured-arm.ron"));
    technician.does(ENTER, "the measured arm", |shown| !shown.has("Path of the profile"));
    technician.does(ENTER, "step 2", |shown| shown.step() == Some(2));
    // The cell is the one of before.
    technician.does("j", "the cell", |shown| shown.has("This cell.") && shown.has("2500 0 700"));
    technician.does(ENTER, "the accuracy", |shown| shown.has("Leica AT9xx"));
    connects(&mut technician, &cell.address);
    if std::env::var_os("TRUPOSE_WHOLE_DAY").is_some() {
        calibrates(&place, &mut technician, cell);
    }
}

/// From the choice of the SMR to a corrected program. On the way two poses are exchanged, one is missed, and the connection drops.
fn calibrates(place: &Place, technician: &mut Technician, mut cell: Cell) {
    technician.does("p", "the choice", |shown| shown.has("chosen       as the profile says"));
    technician.does("n", "step 4", |shown| shown.step() == Some(4));
    technician.press("18\u{1b}[B10\u{1b}[B120\u{1b}[B\u{1b}[B0");
    technician.does("p", "the search", |shown| shown.has("cancel choosing poses"));
    technician.sees(PLANNING, "the plan", |shown| !shown.has("cancel choosing poses"));
    technician.does("a", "step 5", |shown| shown.step() == Some(5));

    // The connection drops, and the tracker comes back with the robot at the plan.
    technician.sees(LONG, "the plan on disk", |_| folder_of(place).unwrap().join("plan.csv").exists());
    let listen = cell.address.strip_prefix("emscon:").unwrap().trim_start_matches("tcp:").to_owned();
    let plan = folder_of(place).unwrap().join("plan.csv");
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
    let state = session(place);
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
    let folder = folder_of(place).unwrap();
    technician.sees(LONG, "the files", |shown| shown.has("Written") && folder.join("calibration.ron").exists());

    // A program of the cell: its points were computed.
    fs::write(place.path("pick.src"), "DEF pick()\nPTP {A1 10, A2 20, A3 -30, A4 15, A5 40, A6 60}\nEND\n").unwrap();
    technician.does("p", "the form", |shown| shown.has("Robot program to correct"));
    technician.fill(&[Some("pick.src"), None, Some("\u{1b}[C")]);
    technician.sees(LONG, "the corrected program", |shown| shown.has("1 target corrected, 0 left"));
    let corrected = fs::read_to_string(folder.join("corrected/pick.src")).unwrap();
    assert!(corrected.starts_with("DEF pick()\nPTP {A1 ") && !corrected.contains("A1 10,"), "{corrected}");

    technician.press("q");
    technician.press("y");
    assert_eq!(technician.terminal.end(PATIENCE, 0.0).0, 0);
    assert!(session(place).closed);
}
