//! The thread that talks to the instrument.

use std::cell::Cell;
use std::collections::BTreeSet;
use std::io;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::thread;
use std::time::Duration;

use nalgebra::Point3;

use super::events::Events;
use crate::link::{Link, LinkError, LinkEvent, RawLog, Rehearsal, Replay, SimulatedCell, Wired};
use crate::profile::Profile;
use crate::session::filter::Filter;
use crate::session::measurements::{Expected, Layout, Reading as TableReading, SavedLayout, read_for};
use crate::session::plan::PlannedPose;
use crate::session::reading::{MeasureRequest, Reading};
use crate::session::set_up::{InstrumentChoice, RecordedSet};
use crate::session::workbook;
use crate::store;
use crate::wizard::{Answer, Event, Notice, Problem, RequestId};

/// Capacity of the channel of commands; the wizard never has more than one request running.
const COMMAND_CAPACITY: usize = 4;

/// Interval at which a link is polled while nothing is measured.
const POLL_INTERVAL: Duration = Duration::from_millis(100);

enum Command {
    Connect { id: RequestId, instrument: InstrumentChoice, profile: Box<Profile>, cancelled: Arc<AtomicBool> },
    Measure { id: RequestId, request: MeasureRequest, cancelled: Arc<AtomicBool> },
    Turn { id: RequestId, at: Point3<f64>, cancelled: Arc<AtomicBool> },
}

/// The channel of the link thread. The thread ends with it; the engine does not wait for an instrument that does not answer.
#[derive(Debug)]
pub(super) struct LinkThread {
    commands: SyncSender<Command>,
}

impl LinkThread {
    /// Starts the thread. `log` takes every byte from and to instruments.
    pub(super) fn start(events: Events, log: Option<RawLog>) -> io::Result<Self> {
        let (commands, received) = sync_channel(COMMAND_CAPACITY);
        thread::Builder::new().name("link".to_owned()).spawn(move || work(&received, &events, log.as_ref()))?;
        Ok(Self { commands })
    }

    pub(super) fn connect(
        &self,
        id: RequestId,
        instrument: InstrumentChoice,
        profile: Box<Profile>,
        cancelled: Arc<AtomicBool>,
    ) -> bool {
        self.commands.try_send(Command::Connect { id, instrument, profile, cancelled }).is_ok()
    }

    /// Turns the instrument to a place in its own frame (m).
    pub(super) fn turn(&self, id: RequestId, at: Point3<f64>, cancelled: Arc<AtomicBool>) -> bool {
        self.commands.try_send(Command::Turn { id, at, cancelled }).is_ok()
    }

    pub(super) fn measure(&self, id: RequestId, request: MeasureRequest, cancelled: Arc<AtomicBool>) -> bool {
        self.commands.try_send(Command::Measure { id, request, cancelled }).is_ok()
    }
}

fn work(commands: &Receiver<Command>, events: &Events, log: Option<&RawLog>) {
    let mut link: Option<Box<dyn Link>> = None;
    while let Some(command) = next(commands, link.as_deref_mut(), events) {
        let (id, answer) = match command {
            Command::Connect { id, instrument, profile, cancelled } => {
                link = None;
                let keep_going = || !cancelled.load(Ordering::Relaxed);
                let on_event = &mut |event| events.offer(Event::Remark(remark(event)));
                match connect(&instrument, &profile, log, &keep_going, on_event) {
                    Ok((connected, answer)) => {
                        link = connected;
                        (id, answer)
                    }
                    Err(LinkError::Cancelled) => (id, Answer::Cancelled),
                    Err(error) => (id, failed(&error)),
                }
            }
            Command::Turn { id, at, cancelled } => {
                let keep_going = || !cancelled.load(Ordering::Relaxed);
                let answer = match link.as_mut().map(|link| link.point(at, &keep_going)) {
                    Some(Ok(())) => Answer::Turned,
                    Some(Err(LinkError::Cancelled)) => Answer::Cancelled,
                    Some(Err(error)) => failed(&error),
                    None => failed(&LinkError::SetUp("no instrument is connected".to_owned())),
                };
                (id, answer)
            }
            Command::Measure { id, request, cancelled } => {
                let live_poll = link.as_ref().and_then(|link| link.live_poll());
                let shown = Cell::new(f64::NEG_INFINITY);
                let keep_going = || {
                    // Show the live view during the measurement, at most once per interval.
                    if let Some(live) = live_poll.as_ref().map(|poll| poll())
                        && live.seconds >= shown.get() + POLL_INTERVAL.as_secs_f64()
                    {
                        shown.set(live.seconds);
                        events.offer(Event::Live(live));
                    }
                    !cancelled.load(Ordering::Relaxed)
                };
                let measured = link.as_mut().map(|link| link.measure(&request, &keep_going));
                let answer = match measured {
                    Some(Ok(reading)) => Answer::Measured(reading),
                    Some(Err(LinkError::Cancelled)) => Answer::Cancelled,
                    Some(Err(error)) => failed(&error),
                    None => failed(&LinkError::SetUp("no instrument is connected".to_owned())),
                };
                (id, answer)
            }
        };
        if !events.send(Event::Answer { id, answer }) {
            break;
        }
    }
}

/// Waits for the next command, and sends the live view and the events of the link meanwhile.
fn next(commands: &Receiver<Command>, link: Option<&mut (dyn Link + 'static)>, events: &Events) -> Option<Command> {
    let Some(link) = link else { return commands.recv().ok() };
    loop {
        let Some((live, link_events)) = link.watch(Duration::ZERO) else { return commands.recv().ok() };
        events.offer(Event::Live(live));
        for event in link_events {
            events.offer(Event::Remark(remark(event)));
        }
        // A command interrupts the wait for the next poll.
        match commands.recv_timeout(POLL_INTERVAL) {
            Ok(command) => return Some(command),
            Err(RecvTimeoutError::Disconnected) => return None,
            Err(RecvTimeoutError::Timeout) => {}
        }
    }
}

/// A link event as a message for the operator.
fn remark(event: LinkEvent) -> Notice {
    match event {
        LinkEvent::Up(identity) => Notice::info(format!("connected: {identity}")),
        LinkEvent::Down(cause) => Notice::attention(format!("the link is down: {cause}"))
            .hint("it reconnects automatically; nothing measured so far is lost"),
        LinkEvent::Notice(text) => Notice::attention(text),
    }
}

/// A link error as an answer with advice.
fn failed(error: &LinkError) -> Answer {
    let hints = match error {
        LinkError::BeamBroken => {
            vec!["return the SMR to the nest until the tracker has locked on to it, then measure again".to_owned()]
        }
        LinkError::Instrument(failure) => vec![failure.hint().to_owned()],
        LinkError::Controller(failure) => vec![failure.controller_hint().to_owned()],
        LinkError::Robot(_) => {
            vec!["bring the robot to rest at the pose and clear any stop at its pendant, then measure again".to_owned()]
        }
        LinkError::NoReading { .. } => vec!["skip the pose, or take the poses of the recording as plan".to_owned()],
        _ => Vec::new(),
    };
    Answer::Failed(Problem { hints, ..Problem::new(error.to_string()) })
}

/// A link with the answer to its connection.
type Connected = (Option<Box<dyn Link>>, Answer);

fn connect(
    instrument: &InstrumentChoice,
    profile: &Profile,
    log: Option<&RawLog>,
    keep_going: &dyn Fn() -> bool,
    on_event: &mut dyn FnMut(LinkEvent),
) -> Result<Connected, LinkError> {
    let plain = |identity| Answer::Connected { identity, warnings: Vec::new(), recorded: Vec::new() };
    match instrument {
        InstrumentChoice::Manual { unit } => Ok((None, plain(format!("coordinates typed in, in {}", unit.sign())))),
        InstrumentChoice::Simulated(simulation) if !simulation.wires.is_empty() => {
            let mut rehearsal = Rehearsal::new(profile, simulation, log)?;
            let identity = rehearsal.connect()?;
            let answer = Answer::Connected { identity, warnings: rehearsal.warnings(), recorded: Vec::new() };
            Ok((Some(Box::new(rehearsal)), answer))
        }
        InstrumentChoice::Linked(choice) => {
            let mut wired = Wired::for_arm(profile, choice, log)?;
            let identity = wired.connect_while(keep_going, on_event)?;
            let answer = Answer::Connected { identity, warnings: wired.warnings(), recorded: Vec::new() };
            Ok((Some(Box::new(wired)), answer))
        }
        InstrumentChoice::Simulated(simulation) => {
            let mut cell = SimulatedCell::new(profile, simulation)?;
            let identity = cell.connect()?;
            Ok((Some(Box::new(cell)), plain(identity)))
        }
        InstrumentChoice::Replay { sets } => {
            let mut recordings = Recordings::new(profile, sets)?;
            let (identity, recorded) = (recordings.connect()?, recordings.poses());
            Ok((Some(Box::new(recordings)), Answer::Connected { identity, warnings: Vec::new(), recorded }))
        }
    }
}

/// Several tables that are played as one instrument. A pose of a later table whose name is taken gets the name of its table as a
/// prefix.
struct Recordings {
    played: Vec<(Replay, Vec<PlannedPose>)>,
}

impl Recordings {
    fn new(profile: &Profile, sets: &[RecordedSet]) -> Result<Self, LinkError> {
        if sets.is_empty() {
            return Err(LinkError::SetUp("no table of recorded measurements is named".to_owned()));
        }
        let mut taken = BTreeSet::new();
        let played = sets.iter().map(|set| recording(profile, set, &mut taken)).collect::<Result<_, _>>()?;
        Ok(Self { played })
    }

    fn poses(&self) -> Vec<PlannedPose> {
        self.played.iter().flat_map(|(_, poses)| poses.iter().cloned()).collect()
    }
}

fn recording(
    profile: &Profile,
    set: &RecordedSet,
    taken: &mut BTreeSet<String>,
) -> Result<(Replay, Vec<PlannedPose>), LinkError> {
    let set_up = |message: String| LinkError::SetUp(message);
    let path = Path::new(&set.file);
    let bytes = store::read(path).map_err(|error| {
        let cause = std::error::Error::source(&error).map(|cause| format!(": {cause}")).unwrap_or_default();
        set_up(format!("{error}{cause}"))
    })?;
    let (layout, reading) = layout(set)?;
    let joints = profile.chain().joints().iter().map(|joint| joint.joint_type).collect::<Vec<_>>();
    let sheet = workbook::is_workbook(&bytes).then(|| workbook::sheet_text(&bytes, &set.file, None)).transpose();
    let sheet = sheet.map_err(|errors| set_up(errors.to_string()))?;
    let content = sheet.as_deref().map_or(bytes.as_slice(), str::as_bytes);
    let mut table = read_for(&Expected::of(profile, &joints), layout, &reading, content, &set.file)
        .map_err(|errors| set_up(errors.to_string()))?;
    let distinct = table.distinct_rows().cloned().collect();
    (table.rows, table.duplicates) = (distinct, Vec::new());
    if let Some(condition) = &set.rows {
        let wrong = |error: &dyn std::fmt::Display| set_up(format!("rows '{condition}' of '{}': {error}", set.file));
        let filter = Filter::parse(condition).map_err(|error| wrong(&error))?;
        filter.check(&table.columns).map_err(|error| wrong(&error))?;
        let mut kept = Vec::new();
        for row in &table.rows {
            if filter.matches(&table.columns, &row.fields, row.line).map_err(|error| wrong(&error))? {
                kept.push(row.clone());
            }
        }
        table.rows = kept;
    }
    if table.rows.is_empty() {
        return Err(set_up(format!("no row of '{}' is left to play", set.file)));
    }
    let stem = path.file_stem().map_or_else(|| "set".to_owned(), |stem| stem.to_string_lossy().into_owned());
    let clashes = table.rows.iter().any(|row| taken.contains(&row.pose));
    if clashes {
        for row in &mut table.rows {
            row.pose = format!("{stem}-{}", row.pose);
        }
    }
    taken.extend(table.rows.iter().map(|row| row.pose.clone()));
    let replay = Replay::of_table(profile, &table, &set.file)?;
    let poses = replay
        .rows()
        .iter()
        .filter(|row| !row.repeats)
        .map(|row| PlannedPose {
            pose: row.pose.clone(),
            kind: set.kind,
            configuration: row.configuration.clone(),
            point_in_base: None,
        })
        .collect();
    Ok((replay, poses))
}

/// The layout of a table: one that the program knows, or one that was saved beside the table or in the current folder.
fn layout(set: &RecordedSet) -> Result<(Layout, TableReading), LinkError> {
    let set_up = |reason: String| LinkError::SetUp(format!("'{}': {reason}", set.layout));
    let known = match set.layout.parse::<Layout>() {
        Ok(layout) => return Ok((layout, TableReading::default())),
        Err(unknown) => unknown,
    };
    let file = SavedLayout::file_name(&set.layout);
    let beside = Path::new(&set.file).with_file_name(&file);
    let Some(path) = [beside, file.into()].into_iter().find(|path| path.is_file()) else {
        return Err(set_up(known.to_string()));
    };
    let bytes = store::read(&path).map_err(|error| set_up(error.to_string()))?;
    let reading = SavedLayout::parse(&String::from_utf8_lossy(&bytes)).map_err(set_up)?;
    Ok((Layout::Named, reading))
}

impl Link for Recordings {
    fn connect(&mut self) -> Result<String, LinkError> {
        let identities: Result<Vec<String>, LinkError> =
            self.played.iter_mut().map(|(replay, _)| replay.connect()).collect();
        Ok(identities?.join("; "))
    }

    fn measure(&mut self, request: &MeasureRequest, keep_going: &dyn Fn() -> bool) -> Result<Reading, LinkError> {
        let has_pose = |poses: &[PlannedPose]| poses.iter().any(|pose| pose.pose == request.pose);
        let of_pose = self.played.iter().position(|(_, poses)| has_pose(poses));
        let (replay, _) = self
            .played
            .get_mut(of_pose.unwrap_or(0))
            .ok_or_else(|| LinkError::SetUp("no table of recorded measurements is named".to_owned()))?;
        replay.measure(request, keep_going)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::link::protocol::Failure;
    use crate::profile::builtin;
    use crate::session::wire::LinkChoice;

    fn refused(instrument: &InstrumentChoice, profile: &str) -> Problem {
        let (profile, _) = Profile::parse(builtin(profile).unwrap(), profile).unwrap();
        let error = connect(instrument, &profile, None, &|| true, &mut |_| ()).map(drop).unwrap_err();
        let Answer::Failed(problem) = failed(&error) else { panic!("{error}") };
        problem
    }

    #[test]
    fn an_arm_whose_joints_the_controller_cannot_tell_is_refused_before_anything_is_opened() {
        let instrument = InstrumentChoice::Linked(LinkChoice {
            address: "emscon:127.0.0.1:1".to_owned(),
            robot: Some("rtde:127.0.0.1:1".to_owned()),
            ..LinkChoice::default()
        });
        for (profile, joints) in [("kuka_iiwa7", "7 joints"), ("epson_ls3_b401s", "4 joints")] {
            let problem = refused(&instrument, profile);
            assert!(problem.message.contains(joints) && problem.message.contains("rtde reports 6"), "{problem:?}");
        }
        // Six joints are asked about, and nobody is there.
        assert!(refused(&instrument, "soochow").message.contains("no connection"));
    }

    #[test]
    fn what_helps_is_said_about_the_end_that_has_failed() {
        let failure = Failure::InUse("another program has actual_q".to_owned());
        let of_robot = failed(&LinkError::Controller(failure.clone()));
        let Answer::Failed(problem) = of_robot else { panic!("{of_robot:?}") };
        assert_eq!(
            problem.message,
            "the robot: the controller is in use by another program (another program has actual_q)"
        );
        assert_eq!(problem.hints, [failure.controller_hint()]);
        assert_ne!(failure.controller_hint(), failure.hint());
    }
}
