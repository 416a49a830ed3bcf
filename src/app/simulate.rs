//! `trupose simulate`: a simulated instrument or robot controller, for rehearsals and for the development of drivers.

use std::io::{BufRead as _, Write, stdin};
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::thread;
use std::time::Duration;

use super::{Console, load, payload_of, refused};
use crate::cli::SimulateArgs;
use crate::error::{ExitStatus, Failure};
use crate::kinematics::JointType;
use crate::link::{LinkError, Served};
use crate::procedure::joint_types;
use crate::profile::Profile;
use crate::runtime::signals;
use crate::session::journal::from_edge;
use crate::session::plan::{self, PlannedPose, PoseKind};
use crate::session::simulation::Simulation;
use crate::session::wire::WireProtocol;
use crate::store;
use crate::text::counted;

/// Interval at which the robot checks whether to move on.
const LOOK: Duration = Duration::from_millis(50);
/// The robot moves on after this many checks without a shot: a driver reads the joints once more after its last shot.
const PAUSE: u32 = 20;

/// What can be typed.
const ORDERS: &str = "next, goto POSE, joints VALUES (deg, mm), where or quit";

/// An event that the simulation reacts to.
enum Order {
    /// A typed line.
    Line(String),
    /// A signal.
    End,
}

/// The poses that the robot visits.
struct Route {
    poses: Vec<PlannedPose>,
    at: usize,
}

impl Route {
    fn here(&self) -> Option<&PlannedPose> {
        self.poses.get(self.at)
    }

    fn go(&self, served: &mut Served) -> Result<(), LinkError> {
        let Some(pose) = self.here() else { return Ok(()) };
        let following = self.poses.get(self.at + 1).map(|pose| pose.configuration.as_slice());
        served.go(&pose.pose, &pose.configuration, following)
    }

    /// `pose 7 (3 of 56)`.
    fn text(&self) -> String {
        let pose = self.here().map_or("", |pose| &pose.pose);
        format!("pose {pose} ({} of {})", self.at + 1, self.poses.len())
    }
}

pub(super) fn run<O: Write, E: Write>(args: &SimulateArgs, console: &mut Console<O, E>) -> Result<ExitStatus, Failure> {
    if args.protocol == WireProtocol::Ndi && args.shots > 0 {
        let text =
            "an NDI tracker is polled for live positions and for shots in the same way: '--shots' cannot count them";
        return Err(
            Failure::new(ExitStatus::Usage, text).hint("leave out '--shots', and type 'next' after each measured pose")
        );
    }
    let loaded = load::profile(&args.profile)?;
    let profile = &loaded.profile;
    let joint_types = joint_types(profile);
    let mut route = Route { poses: poses(args, profile)?, at: 0 };
    let payload = payload_of(&args.payload, profile)?;
    let simulation = Simulation { seed: args.seed, joint_errors: args.joint_errors, payload, ..Simulation::default() };
    let usage = |error: &LinkError| Failure::new(ExitStatus::Usage, error.to_string());
    let mut served = Served::new(profile, &simulation, args.protocol, args.listen.as_deref(), &args.faults)
        .map_err(|error| usage(&error))?;
    route.go(&mut served).map_err(|error| usage(&error))?;
    console.say(&format!("listening: {}\n", served.address()))?;
    if let Some(options) = served.options() {
        console.say(&format!("options: {options}\n"))?;
    }
    if let Some(listen) = &args.robot {
        let (address, options) = served.listen_for_robot(profile, listen).map_err(|error| usage(&error))?;
        console.say(&format!("robot: {address}\n"))?;
        if let Some(options) = options {
            console.say(&format!("robot options: {options}\n"))?;
        }
    }
    console.remark(served.title());
    console.remark(&format!("the robot is at {}", route.text()));
    console.remark(&format!("{ORDERS}, or Ctrl-C"));
    let (sender, orders) = channel();
    let signalled = sender.clone();
    // The receiver is gone once this function has returned.
    signals::on_signal(move |_signal| drop(signalled.send(Order::End))).map_err(|error| refused(&error))?;
    read_lines(sender)?;
    let (mut seen, mut quiet) = (0, 0);
    loop {
        match orders.recv_timeout(LOOK) {
            Ok(Order::End) | Err(RecvTimeoutError::Disconnected) => break,
            Ok(Order::Line(line)) => match obey(line.trim(), &joint_types, &mut route, &mut served) {
                Some(said) => console.remark(&said),
                None => break,
            },
            Err(RecvTimeoutError::Timeout) => {
                let taken = served.taken();
                quiet = if taken == seen && taken >= args.shots { quiet + 1 } else { 0 };
                seen = taken;
                let is_done = args.shots > 0 && quiet >= PAUSE && route.at + 1 < route.poses.len();
                if is_done && let Some(said) = obey("next", &joint_types, &mut route, &mut served) {
                    quiet = 0;
                    console.remark(&said);
                }
            }
        }
    }
    Ok(ExitStatus::Accepted)
}

/// The answer to a typed line; `None` ends the program.
fn obey(line: &str, joint_types: &[JointType], route: &mut Route, served: &mut Served) -> Option<String> {
    let target = match line.split_once(char::is_whitespace) {
        _ if line == "quit" => return None,
        _ if line.is_empty() || line == "where" => {
            return Some(format!("at {}, {} shots taken", route.text(), served.taken()));
        }
        None if line == "next" && route.at + 1 < route.poses.len() => route.at + 1,
        None if line == "next" => return Some("that was the last pose".to_owned()),
        Some(("goto", pose)) => match route.poses.iter().position(|one| one.pose == pose.trim()) {
            Some(found) => found,
            None => return Some(format!("there is no pose '{}'", pose.trim())),
        },
        Some(("joints", values)) => match configuration(values, joint_types) {
            Ok(configuration) => {
                let pose = "typed".to_owned();
                route.poses.push(PlannedPose {
                    pose,
                    kind: PoseKind::Identification,
                    configuration,
                    point_in_base: None,
                });
                route.poses.len() - 1
            }
            Err(problem) => return Some(problem),
        },
        _ => return Some(format!("'{line}' is not a command; use {ORDERS}")),
    };
    let before = std::mem::replace(&mut route.at, target);
    match route.go(served) {
        Ok(()) => Some(format!("the robot moves to {}", route.text())),
        Err(error) => {
            route.at = before;
            Some(error.to_string())
        }
    }
}

/// The configuration of pendant values (rad, m) from typed ones (deg, mm).
fn configuration(values: &str, joint_types: &[JointType]) -> Result<Vec<f64>, String> {
    let typed: Result<Vec<f64>, String> = values
        .split_whitespace()
        .map(|value| {
            value
                .parse()
                .ok()
                .filter(|value: &f64| value.is_finite())
                .ok_or_else(|| format!("'{value}' is not a number"))
        })
        .collect();
    let typed = typed?;
    if typed.len() != joint_types.len() {
        return Err(format!("the robot has {}, not {}", counted(joint_types.len(), "joint"), typed.len()));
    }
    Ok(from_edge(&typed, joint_types))
}

/// Sends the lines of standard input. Its end is not an event: a simulator may run without a terminal.
fn read_lines(sender: Sender<Order>) -> Result<(), Failure> {
    let read = move || {
        for line in stdin().lock().lines() {
            let Ok(line) = line else { return };
            if sender.send(Order::Line(line)).is_err() {
                return;
            }
        }
    };
    thread::Builder::new().name("simulate-orders".to_owned()).spawn(read).map(drop).map_err(|error| refused(&error))
}

/// The measured rows of the plan; without a plan one pose in the middle of the joint ranges.
fn poses(args: &SimulateArgs, profile: &Profile) -> Result<Vec<PlannedPose>, Failure> {
    let Some(path) = &args.plan else {
        let middle = |range: &crate::profile::JointRange| {
            range.planning_limits.or(range.limits).map_or(0.0, |(low, high)| f64::midpoint(low, high))
        };
        let configuration = profile.joints().iter().map(middle).collect();
        let pose = "middle".to_owned();
        let kind = PoseKind::Identification;
        return Ok(vec![PlannedPose { pose, kind, configuration, point_in_base: None }]);
    };
    let bytes = store::read(path).map_err(|error| Failure::from_error(ExitStatus::Usage, &error))?;
    let file = path.display().to_string();
    let mut listed = plan::read(&bytes, &file, &joint_types(profile))
        .map_err(|errors| Failure::new(ExitStatus::Usage, errors.to_string()))?;
    listed.rows.retain(|row| row.kind.is_measured());
    if listed.rows.is_empty() {
        return Err(Failure::new(ExitStatus::Usage, format!("'{file}' has no pose that is measured")));
    }
    Ok(listed.rows)
}
