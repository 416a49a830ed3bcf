//! `trupose link test`: checks the connection to an instrument, its settings and a few shots, and reports problems.

use std::fs::File;
use std::io::Write;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use super::{Console, load, refused};
use crate::cli::{LinkCommand, LinkTestArgs};
use crate::error::{ExitStatus, Failure};
use crate::link::protocol::CONTROLLER;
use crate::link::{Link as _, LinkError, LinkEvent, RawLog, Wired, WiredRobot};
use crate::profile::Profile;
use crate::runtime::signals;
use crate::session::reading::{LiveReading, MeasureRequest, Reading};
use crate::session::wire::{LinkChoice, WireAddress};
use crate::units::{to_deg, to_mm};

/// Interval between two lines of the live view.
const LINE_INTERVAL: Duration = Duration::from_millis(500);
/// Scatter of the shots above which the test fails (mm).
const SCATTER_MM: f64 = 0.1;
/// The same limit in stated standard deviations; the larger one applies.
const SCATTER_SIGMAS: f64 = 4.0;

pub(super) fn run<O: Write, E: Write>(
    command: &LinkCommand,
    console: &mut Console<O, E>,
) -> Result<ExitStatus, Failure> {
    let LinkCommand::Test(args) = command;
    test(args, console)
}

/// Opens the raw log in a new file.
pub(super) fn raw_log(path: Option<&Path>) -> Result<Option<RawLog>, Failure> {
    let Some(path) = path else { return Ok(None) };
    let file = File::options().create(true).append(true).open(path).map_err(|error| {
        Failure::new(ExitStatus::Usage, format!("cannot write the raw log '{}': {error}", path.display()))
    })?;
    Ok(Some(RawLog::new(file)))
}

fn test<O: Write, E: Write>(args: &LinkTestArgs, console: &mut Console<O, E>) -> Result<ExitStatus, Failure> {
    let ended = Arc::new(AtomicBool::new(false));
    let signalled = Arc::clone(&ended);
    signals::on_signal(move |_signal| signalled.store(true, Ordering::Relaxed)).map_err(|error| refused(&error))?;
    let keep_going = || !ended.load(Ordering::Relaxed);
    let usage = |message: String| Failure::new(ExitStatus::Usage, message);
    let log = raw_log(args.raw_log.as_deref())?;
    let address: WireAddress = args.address.parse().map_err(usage)?;
    let loaded = args.profile.as_deref().map(load::profile).transpose()?;
    let profile = loaded.as_ref().map(|loaded| &loaded.profile);
    if address.protocol.is_robot() {
        return test_robot(args, &address, profile, log.as_ref(), console, &keep_going);
    }
    let choice = LinkChoice {
        address: args.address.clone(),
        options: args.options.clone(),
        robot: args.robot.clone(),
        robot_options: args.robot_options.clone(),
        is_automatic: false,
    };
    let wired = match profile {
        Some(profile) => Wired::for_arm(profile, &choice, log.as_ref()),
        None => Wired::new(&choice, log.as_ref()),
    };
    let mut wired = wired.map_err(|error| usage(error.to_string()))?;
    console.say(&format!("connecting to {address}\n"))?;
    let mut on_event = |event: LinkEvent| console.remark(&event_text(&event));
    let connected = wired.connect_while(&keep_going, &mut on_event);
    if let Some(identity) = wired.identity() {
        // The instrument may answer even if the robot does not.
        console.say(&format!("connected: {}\n", identity.name))?;
    }
    connected.map_err(|error| problem(&error, "cannot connect"))?;
    let identity = wired.identity().cloned().unwrap_or_default();
    for item in &identity.checked {
        console.say(&format!("checked: {item}\n"))?;
    }
    if let Some(robot) = &args.robot {
        console.say(&format!("robot: {robot} reports its joint angles\n"))?;
    }
    if let Some(reflector) = &identity.reflector {
        console.say(&format!(
            "reflector: {} (number {}), surface offset {:.3} mm; check that it is the one on the robot\n",
            reflector.name,
            reflector.id,
            to_mm(reflector.offset)
        ))?;
    }
    for note in &identity.notes {
        console.say(&format!("note: {note}\n"))?;
    }
    for warning in &identity.warnings {
        console.say(&format!("WARNING: {warning}\n"))?;
    }
    watch(args, &mut wired, console, &keep_going)?;
    if args.shots > 0 {
        shoot(args.shots, &mut wired, console, &keep_going)?;
    }
    if !keep_going() {
        return Err(ended_early());
    }
    if identity.warnings.is_empty() {
        console.print("the link works\n")?;
        Ok(ExitStatus::Accepted)
    } else {
        Err(Failure::new(ExitStatus::Instrument, "the link works, but with warnings, see above")
            .hint("fix the warnings and test again; distances measured like this may be wrong"))
    }
}

fn ended_early() -> Failure {
    Failure::new(ExitStatus::Instrument, "the test was stopped before it was complete")
}

/// Tests a robot's controller without an instrument: whether it reports joint angles, and whether the robot is at rest.
#[expect(clippy::disallowed_methods, reason = "the edge of the program may look at the clock")]
fn test_robot<O: Write, E: Write>(
    args: &LinkTestArgs,
    address: &WireAddress,
    profile: Option<&Profile>,
    log: Option<&RawLog>,
    console: &mut Console<O, E>,
    keep_going: &dyn Fn() -> bool,
) -> Result<ExitStatus, Failure> {
    let options = args.options.as_deref();
    let robot = match profile {
        Some(profile) => WiredRobot::for_arm(profile, address, options, log),
        None => WiredRobot::new(address, options, log),
    };
    let mut robot = robot.map_err(|error| Failure::new(ExitStatus::Usage, error.to_string()))?;
    console.say(&format!("connecting to {address}\n"))?;
    let mut on_event = |event: LinkEvent| console.remark(&event_text(&event));
    let identity = robot.connect_while(keep_going, &mut on_event).map_err(|error| problem(&error, "cannot connect"))?;
    console.say(&format!("connected: {}\n", identity.name))?;
    for item in &identity.checked {
        console.say(&format!("checked: {item}\n"))?;
    }
    for warning in &identity.warnings {
        console.say(&format!("WARNING: {warning}\n"))?;
    }
    let until = Instant::now() + Duration::try_from_secs_f64(args.seconds).unwrap_or_default();
    while Instant::now() < until && keep_going() {
        let (live, events) = robot.watch(LINE_INTERVAL.min(until.saturating_duration_since(Instant::now())));
        for event in events {
            console.say(&format!("{}\n", event_text(&event)))?;
        }
        if let Some(cause) = live.down {
            return Err(is_down(&cause));
        }
        console
            .say(&format!("{}\n", joints_text(&live).unwrap_or_else(|| "no joint angles for one second".to_owned())))?;
    }
    if !keep_going() {
        return Err(ended_early());
    }
    console.print("the link works; compare the angles and their signs with the pendant\n")?;
    Ok(ExitStatus::Accepted)
}

fn is_down(cause: &str) -> Failure {
    Failure::new(ExitStatus::Instrument, format!("the link is down: {cause}"))
        .hint("check cable and address, and that the other end is switched on; then test again")
}

/// Prints the live view for a while.
#[expect(clippy::disallowed_methods, reason = "the edge of the program may look at the clock")]
fn watch<O: Write, E: Write>(
    args: &LinkTestArgs,
    wired: &mut Wired,
    console: &mut Console<O, E>,
    keep_going: &dyn Fn() -> bool,
) -> Result<(), Failure> {
    let until = Instant::now() + Duration::try_from_secs_f64(args.seconds).unwrap_or_default();
    while Instant::now() < until && keep_going() {
        let Some((live, events)) = wired.watch(LINE_INTERVAL.min(until.saturating_duration_since(Instant::now())))
        else {
            return Ok(());
        };
        for event in events {
            console.say(&format!("{}\n", event_text(&event)))?;
        }
        console.say(&format!("sees: {}\n", live_text(&live)))?;
        if let Some(cause) = live.down {
            return Err(is_down(&cause));
        }
    }
    Ok(())
}

fn event_text(event: &LinkEvent) -> String {
    match event {
        LinkEvent::Up(identity) => format!("reconnected: {identity}"),
        LinkEvent::Down(cause) => format!("lost: {cause}"),
        LinkEvent::Notice(text) => format!("message: {text}"),
    }
}

fn live_text(live: &LiveReading) -> String {
    let unseen = match live.silent {
        _ if live.is_blind => "no live view: this instrument sends nothing between shots".to_owned(),
        Some(seconds) => format!("nothing: the instrument has been silent for {seconds:.0} s"),
        None => "no SMR, or no position between shots yet".to_owned(),
    };
    let mut parts = vec![live.point.map_or_else(
        || unseen,
        |point| format!("x {:.3}  y {:.3}  z {:.3} mm", to_mm(point.x), to_mm(point.y), to_mm(point.z)),
    )];
    parts.extend(joints_text(live));
    parts.join("; ")
}

fn joints_text(live: &LiveReading) -> Option<String> {
    let joints: Vec<String> = live.joints.as_ref()?.iter().map(|joint| format!("{:.3}", to_deg(*joint))).collect();
    let rests = if live.is_still == Some(true) { "at rest" } else { "not at rest" };
    Some(format!("robot {rests} at {} deg", joints.join(" ")))
}

/// Takes single shots and prints their scatter.
fn shoot<O: Write, E: Write>(
    count: u32,
    wired: &mut Wired,
    console: &mut Console<O, E>,
    keep_going: &dyn Fn() -> bool,
) -> Result<(), Failure> {
    let mut readings: Vec<Reading> = Vec::new();
    for number in 1..=count {
        let request = MeasureRequest {
            number: u64::from(number),
            pose: "test".to_owned(),
            target: 0,
            configuration: Vec::new(),
            following: None,
            settle: 0.0,
            shots: 1,
        };
        let reading = wired
            .measure(&request, keep_going)
            .map_err(|error| problem(&error, &format!("shot {number} of {count} failed")))?;
        let point = reading.point;
        let sigma = reading.sigma.map_or_else(String::new, |sigma| format!(", stated sigma {:.4} mm", to_mm(sigma)));
        console.say(&format!(
            "shot {number}: x {:.4}  y {:.4}  z {:.4} mm, {:.3} m away, {:.1} s{sigma}\n",
            to_mm(point.x),
            to_mm(point.y),
            to_mm(point.z),
            point.coords.norm(),
            reading.seconds
        ))?;
        readings.push(reading);
    }
    let shots = readings.len() as f64;
    let mean = readings.iter().map(|reading| reading.point.coords).sum::<nalgebra::Vector3<f64>>() / shots;
    let square = readings.iter().map(|reading| (reading.point.coords - mean).norm_squared()).sum::<f64>() / shots;
    let scatter = to_mm(square.sqrt());
    if readings.len() > 1 {
        console.say(&format!("scatter of {count} shots: {scatter:.4} mm\n"))?;
    }
    let stated = readings.iter().filter_map(|reading| reading.sigma).fold(0.0, f64::max);
    if readings.len() > 1 && scatter > SCATTER_MM.max(SCATTER_SIGMAS * to_mm(stated)) {
        return Err(Failure::new(ExitStatus::Instrument, format!("the shots scatter by {scatter:.3} mm"))
            .hint("check that the reflector is at rest, that nothing near the beam is warm or shaking, and that every shot sees the same reflector"));
    }
    Ok(())
}

/// The failure for a link error, with advice.
fn problem(error: &LinkError, what: &str) -> Failure {
    let failure = Failure::new(ExitStatus::Instrument, format!("{what}: {error}"));
    match error {
        LinkError::Instrument(instrument) => failure.hint(instrument.hint()),
        // The instrument is connected, or there is none, so the problem is the robot's controller.
        LinkError::Controller(robot) => {
            Failure::new(ExitStatus::Instrument, format!("the robot: {}", robot.message(CONTROLLER)))
                .hint(robot.controller_hint())
        }
        LinkError::Robot(_) => failure.hint("bring the robot to rest and look at its pendant; then test again"),
        LinkError::Cancelled => ended_early(),
        _ => failure,
    }
}
