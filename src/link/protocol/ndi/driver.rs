//! The conversation: set-up, live positions and shots.

use std::time::Duration;

use nalgebra::Vector3;

use super::super::Failure;
use super::super::LineChange;
use super::super::Moment;
use super::super::Protocol;
use super::super::ProtocolEvent;
use super::super::Severity;
use super::super::Shot;
use super::super::error_streak::ErrorStreak;
use super::super::excerpt::excerpt;
use super::super::outbox::Outbox;
use super::codes::BAD_CRC;
use super::codes::failure_of_error;
use super::line::LineStep;
use super::line::SerialLine;
use super::options::NdiOptions;
use super::options::ReplyFormat;
use super::set_up::NextStep;
use super::set_up::SetUp;
use super::set_up::SetUpStep;
use super::tools::Positions;
use super::tools::Tool;
use super::tools::ToolState;
use super::tools::decode_bx;
use super::tools::decode_tx;
use super::tools::tip_in_instrument;
use super::wire::Frame;
use super::wire::FrameDecoder;
use super::wire::encode_text;

/// Idle time after which the next byte starts a message.
const DRAIN: Duration = Duration::from_millis(200);

/// Interval at which a new frame is polled; instruments produce 20 to 60 per second.
const POLL: Duration = Duration::from_millis(10);

/// Interval of the live positions, which also serve as keep-alive.
const LIVE: Duration = Duration::from_millis(300);

/// Most repetitions of a damaged command.
const MAX_RESENDS: u32 = 2;

/// Consecutive unanswered live commands after which the link counts as lost.
const MAX_UNANSWERED: u32 = 5;

/// Most late replies to abandoned commands that are expected.
const MAX_OWED: u32 = 16;

/// An NDI tracker.
#[derive(Debug)]
pub struct NdiProtocol {
    options: NdiOptions,
    timeout: Duration,
    decoder: FrameDecoder,
    outbox: Outbox,
    phase: Phase,
    /// The serial line, if it is one.
    line: Option<SerialLine>,
    line_change: Option<LineChange>,
    set_up: SetUp,
    handle: u8,
    /// The command that was sent or is scheduled.
    pending: Option<Pending>,
    /// Number of late replies to abandoned commands that may still arrive.
    owed: u32,
    unanswered: u32,
    errors: ErrorStreak,
}

#[derive(Debug)]
enum Phase {
    Closed,
    /// Finding the speed of the serial line.
    Line(LineStep),
    SetUp(SetUpStep),
    /// Reading live positions.
    Idle,
    /// Waiting for a frame after the one that was current at the trigger.
    Shot {
        deadline: Moment,
        to_skip: u32,
        frame_at_trigger: Option<u32>,
    },
}

#[derive(Debug)]
struct Pending {
    command: String,
    is_sent: bool,
    /// When it must be sent, or when its answer is overdue.
    at: Moment,
    /// Time limit of the answer.
    limit: Duration,
    resends: u32,
    is_damaged: bool,
}

impl NdiProtocol {
    /// Fails if [`NdiOptions::validate`] does.
    pub fn new(options: NdiOptions) -> Result<Self, String> {
        options.validate()?;
        let timeout = Duration::from_secs_f64(options.timeout_s);
        Ok(Self {
            options,
            timeout,
            decoder: FrameDecoder::default(),
            outbox: Outbox::default(),
            phase: Phase::Closed,
            line: None,
            line_change: None,
            set_up: SetUp::default(),
            handle: 0,
            pending: None,
            owed: 0,
            unanswered: 0,
            errors: ErrorStreak::default(),
        })
    }

    /// Uses a serial line whose speed is set to this one (baud), whatever speed the instrument has now.
    #[must_use]
    pub const fn on_serial_line(mut self, speed: u32) -> Self {
        self.line = Some(SerialLine::new(speed));
        self
    }

    /// Bytes of an incomplete message.
    pub const fn pending(&self) -> usize {
        self.decoder.pending()
    }

    fn ask_at(&mut self, command: String, at: Moment) {
        self.pending =
            Some(Pending { command, is_sent: false, at, limit: self.timeout, resends: 0, is_damaged: false });
    }

    fn ask(&mut self, command: String, now: Moment) {
        self.ask_at(command, now);
        self.send(now);
    }

    fn send(&mut self, now: Moment) {
        if let Some(pending) = &mut self.pending {
            if std::mem::take(&mut pending.is_damaged) {
                self.decoder.resync();
            }
            pending.is_sent = true;
            let slow = match &self.phase {
                Phase::SetUp(step) => step.slowest(),
                Phase::Closed | Phase::Line(_) | Phase::Idle | Phase::Shot { .. } => Duration::ZERO,
            };
            pending.limit = self.timeout.max(slow);
            pending.at = now + pending.limit;
            self.outbox.send(encode_text(&pending.command));
        }
    }

    fn position_command(&self) -> String {
        match self.options.reply {
            ReplyFormat::Text => "TX:0001".to_owned(),
            ReplyFormat::Binary => "BX:0001".to_owned(),
        }
    }

    fn take(&mut self, frame: Frame, now: Moment) {
        if let Frame::Damaged(text) = frame {
            return self.damaged(text, now);
        }
        self.errors.reset();
        let is_reset = frame == Frame::Text("RESET".to_owned());
        if is_reset && !matches!(self.phase, Phase::Closed | Phase::Line(_)) {
            return self.lose(Failure::Disconnected("the instrument was reset or switched off and on".to_owned()));
        }
        if frame == Frame::Text(format!("ERROR{BAD_CRC:02X}")) && self.send_again(now) {
            return;
        }
        match self.pending.take_if(|pending| pending.is_sent) {
            Some(_) => self.answer(&frame, now),
            None => self.owed = self.owed.saturating_sub(1),
        }
    }

    fn answer(&mut self, frame: &Frame, now: Moment) {
        self.unanswered = 0;
        let error = error_of(frame);
        if let Frame::Text(text) = frame
            && text.starts_with("WARNING")
        {
            self.outbox.report(Severity::Warning, format!("message of the instrument: {}", excerpt(text)));
        }
        match (std::mem::replace(&mut self.phase, Phase::Closed), error) {
            (Phase::Closed, _) => {}
            // Even an error shows that the speed is right.
            (Phase::Line(step), _) => self.next_line_step(self.line.and_then(|line| line.answered(step)), now),
            (Phase::SetUp(step), Some(code)) if !step.is_optional() => self.lose(failure_of_error(code)),
            (Phase::SetUp(step), error) => self.next_step(step, frame, error.is_some(), now),
            (Phase::Idle, _) => {
                self.live(frame);
                self.rest(now);
            }
            (Phase::Shot { .. }, Some(code)) => self.fail(failure_of_error(code), now),
            (Phase::Shot { deadline, to_skip, frame_at_trigger }, None) => {
                self.phase = Phase::Shot { deadline, to_skip, frame_at_trigger };
                self.check_for_new_frame(frame, now);
            }
        }
    }

    /// Does the next step on the serial line; without one, the set-up begins.
    fn next_line_step(&mut self, next: Option<LineStep>, now: Moment) {
        let Some(line) = self.line else { return self.begin_set_up(now) };
        let Some(step) = next else {
            // Whatever the speed was, from now on it is the one that was asked for.
            self.line_change = Some(LineChange::Speed(line.speed()));
            self.phase = Phase::SetUp(SetUpStep::Initialise);
            return self.ask_at(SetUpStep::Initialise.command(), now + DRAIN);
        };
        self.line_change = step.change_before();
        self.phase = Phase::Line(step);
        if let Some(command) = line.command(step) {
            return self.ask_at(command, now + DRAIN);
        }
        // After a break the instrument reports its reset without a command.
        let limit = LineStep::RESET_LIMIT;
        self.ask_at(String::new(), now + limit);
        if let Some(pending) = &mut self.pending {
            (pending.is_sent, pending.limit, pending.resends) = (true, limit, MAX_RESENDS);
        }
    }

    fn begin_set_up(&mut self, now: Moment) {
        let first = SetUpStep::Initialise;
        let command = first.command();
        self.phase = Phase::SetUp(first);
        self.ask(command, now);
    }

    fn next_step(&mut self, step: SetUpStep, frame: &Frame, is_error: bool, now: Moment) {
        let text = match frame {
            _ if is_error => None,
            Frame::Text(text) => Some(text.as_str()),
            _ => Some(""),
        };
        match self.set_up.advance(step, text, &self.options) {
            Err(failure) => self.lose(failure),
            Ok(NextStep::Step(step)) => {
                let command = step.command();
                self.phase = Phase::SetUp(step);
                self.ask(command, now);
            }
            Ok(NextStep::Ready(handle)) => {
                self.handle = handle;
                let identity = std::mem::take(&mut self.set_up).identity(handle, &self.options);
                self.outbox.push(ProtocolEvent::Ready(identity));
                self.rest(now);
            }
        }
    }

    /// Becomes idle and schedules the next live position.
    fn rest(&mut self, now: Moment) {
        self.phase = Phase::Idle;
        self.ask_at(self.position_command(), now + LIVE);
    }

    fn live(&mut self, frame: &Frame) {
        if let Ok((tool, positions)) = self.tool(frame)
            && let Ok(shot) = self.shot(&tool, &positions, frame)
        {
            self.outbox.push(ProtocolEvent::Live(shot));
        }
    }

    fn check_for_new_frame(&mut self, frame: &Frame, now: Moment) {
        let (tool, positions) = match self.tool(frame) {
            Ok(found) => found,
            Err(failure) => return self.fail(failure, now),
        };
        let Phase::Shot { deadline, to_skip, frame_at_trigger } = &mut self.phase else {
            return;
        };
        // This may be the answer to an abandoned command.
        if let Some(left) = to_skip.checked_sub(1) {
            *to_skip = left;
            self.owed = self.owed.saturating_sub(1);
        } else {
            let reference = *frame_at_trigger.get_or_insert(tool.frame);
            // The number wraps after 2^32 frames, and restarts with tracking.
            let is_new = tool.frame != reference && tool.frame.wrapping_sub(reference) < u32::MAX / 2;
            let has_no_frame = matches!(tool.state, ToolState::Disabled | ToolState::Unoccupied);
            if is_new || has_no_frame {
                let answer = self.shot(&tool, &positions, frame);
                self.rest(now);
                return self.outbox.push(answer.map_or_else(ProtocolEvent::Failed, ProtocolEvent::Shot));
            }
        }
        if *deadline <= now {
            return self.fail(Failure::NotReady("there is no new frame".to_owned()), now);
        }
        self.ask_at(self.position_command(), now + POLL);
    }

    /// The chosen tool, and all that came with it.
    fn tool(&self, frame: &Frame) -> Result<(Tool, Positions), Failure> {
        let positions = match frame {
            Frame::Text(text) => decode_tx(text),
            Frame::Binary(body) => decode_bx(body),
            Frame::Damaged(text) => Err(text.clone()),
        };
        let positions = positions.map_err(Failure::Garbled)?;
        let mine = positions.tools.iter().find(|tool| tool.handle == self.handle).cloned();
        let mine = mine.ok_or_else(|| Failure::Settings(format!("tool {:02X} is not in the reply", self.handle)))?;
        Ok((mine, positions))
    }

    fn shot(&self, tool: &Tool, positions: &Positions, frame: &Frame) -> Result<Shot, Failure> {
        let handle = tool.handle;
        if positions.has_failed() {
            return Err(Failure::Refused("it reports a failure of its hardware".to_owned()));
        }
        let (quaternion, origin, error) = match &tool.state {
            ToolState::Seen { quaternion, origin, error } => (*quaternion, *origin, *error),
            ToolState::Missing if tool.is_out_of_volume() => {
                return Err(Failure::NoTarget(format!("tool {handle:02X} is outside the measurement volume")));
            }
            ToolState::Missing => return Err(Failure::NoTarget(format!("tool {handle:02X} is not seen"))),
            ToolState::Disabled => return Err(Failure::Settings(format!("tool {handle:02X} is disabled"))),
            ToolState::Unoccupied => return Err(Failure::NoTarget(format!("no tool at port {handle:02X}"))),
        };
        let tip = Vector3::from(self.options.tip_mm) * 1e-3;
        let point = tip_in_instrument(quaternion, origin, tip).map_err(Failure::Unusable)?;
        let raw = match frame {
            Frame::Text(text) => text.clone().into_bytes(),
            Frame::Binary(body) => body.clone(),
            Frame::Damaged(_) => Vec::new(),
        };
        let shot = Shot { sequence: Some(tool.frame), raw, ..Shot::bare(point) };
        let shot = shot.with_remark(Severity::Info, format!("marker fit {:.4} mm", error * 1e3));
        let flags = tool.flags().chain(positions.flags());
        Ok(flags.fold(shot, |shot, flag| shot.with_remark(Severity::Warning, flag)))
    }

    fn damaged(&mut self, text: String, now: Moment) {
        if let Some(warning) = self.errors.record("replies", &text, "baud rate and kind of instrument") {
            self.outbox.report(Severity::Warning, warning);
        }
        if self.send_again(now) {
            return;
        }
        let was_sent = self.pending.take_if(|pending| pending.is_sent).is_some();
        if was_sent {
            self.give_up(Failure::Garbled(text), now);
        } else if let Some(pending) = &mut self.pending {
            // After noise between two commands, a pause separates the next message from it.
            pending.is_damaged = true;
            pending.at = pending.at.max(now + DRAIN);
        }
    }

    /// Schedules the command again after a pause, unless it was not sent or was repeated too often.
    fn send_again(&mut self, now: Moment) -> bool {
        match &mut self.pending {
            Some(pending) if pending.is_sent && pending.resends < MAX_RESENDS => {
                pending.resends += 1;
                pending.is_sent = false;
                pending.is_damaged = true;
                pending.at = now + DRAIN;
                true
            }
            _ => false,
        }
    }

    /// Handles the failure of the command in progress.
    fn give_up(&mut self, failure: Failure, now: Moment) {
        self.unanswered = self.unanswered.saturating_add(1);
        match self.phase {
            Phase::Closed => {}
            Phase::Line(step) => {
                if let Some(next) = self.line.and_then(|line| line.unanswered(step)) {
                    self.decoder.resync();
                    self.owed = 0;
                    self.next_line_step(Some(next), now);
                } else {
                    self.line_change = self.line.map(|line| LineChange::Speed(line.speed()));
                    self.lose(failure);
                }
            }
            Phase::SetUp(_) => self.lose(failure),
            Phase::Idle if self.unanswered >= MAX_UNANSWERED => self.lose(failure),
            Phase::Idle => {
                self.rest(now);
                self.mark_damaged();
            }
            Phase::Shot { .. } => {
                self.fail(failure, now);
                self.mark_damaged();
            }
        }
    }

    /// Lets the rest of a damaged message be discarded before the next command.
    const fn mark_damaged(&mut self) {
        if let Some(pending) = &mut self.pending {
            pending.is_damaged = true;
        }
    }

    fn fail(&mut self, failure: Failure, now: Moment) {
        self.outbox.fail(failure);
        self.rest(now);
    }

    fn lose(&mut self, failure: Failure) {
        self.phase = Phase::Closed;
        self.pending = None;
        self.outbox.lose(failure);
    }

    fn time_out(&mut self, now: Moment) {
        let what = match &self.phase {
            Phase::Line(_) => "trying the speeds of the serial line".to_owned(),
            Phase::SetUp(step) => format!("waiting for the answer to {}", step.command()),
            _ => "waiting for a position".to_owned(),
        };
        let limit = self.pending.take().map_or(self.timeout, |pending| pending.limit);
        self.owed = (self.owed + 1).min(MAX_OWED);
        self.give_up(Failure::Silent { what, seconds: limit.as_secs_f64() }, now);
    }
}

/// Error number of an `ERRORxx` reply.
fn error_of(frame: &Frame) -> Option<u8> {
    match frame {
        Frame::Text(text) => text.strip_prefix("ERROR").map(|code| u8::from_str_radix(code, 16).unwrap_or(0)),
        _ => None,
    }
}

impl Protocol for NdiProtocol {
    fn start(&mut self, now: Moment) {
        self.decoder.resync();
        self.outbox.clear();
        self.set_up = SetUp::default();
        self.owed = 0;
        self.unanswered = 0;
        self.errors.reset();
        self.pending = None;
        self.line_change = None;
        // A short question first: the set-up allows more time than a device that is not a tracker should cost.
        self.phase = Phase::Line(LineStep::AtSpeed);
        self.ask(LineStep::PROBE.to_owned(), now);
    }

    fn feed(&mut self, bytes: &[u8], now: Moment) {
        for &byte in bytes {
            if let Some(frame) = self.decoder.push(byte) {
                self.take(frame, now);
            }
        }
    }

    fn tick(&mut self, now: Moment) {
        match &self.pending {
            Some(pending) if pending.at <= now && pending.is_sent => self.time_out(now),
            Some(pending) if pending.at <= now => self.send(now),
            _ => {}
        }
    }

    fn trigger(&mut self, now: Moment) {
        if !matches!(self.phase, Phase::Idle) {
            let is_set_up = matches!(self.phase, Phase::Shot { .. });
            let text = if is_set_up { "another shot is in progress" } else { "the set-up is not complete" };
            return self.outbox.fail(Failure::TooEarly(text.to_owned()));
        }
        // A live position in transit belongs to a frame before the trigger, so it is skipped.
        let is_asked = self.pending.as_ref().is_some_and(|pending| pending.is_sent);
        self.phase = Phase::Shot {
            deadline: now + self.timeout,
            to_skip: self.owed + u32::from(is_asked),
            frame_at_trigger: None,
        };
        if let Some(pending) = self.pending.as_mut().filter(|pending| !pending.is_sent) {
            pending.at = if pending.is_damaged { now + DRAIN } else { now };
        }
        self.tick(now);
    }

    fn cancel(&mut self, now: Moment) {
        if matches!(self.phase, Phase::Shot { .. }) {
            let is_asked = self.pending.as_ref().is_some_and(|pending| pending.is_sent);
            self.owed = (self.owed + u32::from(is_asked)).min(MAX_OWED);
            self.rest(now);
        }
    }

    fn next_line_change(&mut self) -> Option<LineChange> {
        self.line_change.take()
    }

    fn outbox(&mut self) -> &mut Outbox {
        &mut self.outbox
    }

    fn next_deadline(&self) -> Option<Moment> {
        self.pending.as_ref().map(|pending| pending.at)
    }

    fn shows_live(&self) -> bool {
        true
    }
}
