//! One command under way: how long its answer may take, and when it is sent again.

use std::time::Duration;

use super::super::Moment;
use super::super::patience::Patience;
use super::command::Command;
use super::status::CommandId;

/// An ordinary command is answered within this.
pub(super) const ORDINARY: Duration = Duration::from_secs(30);

/// The initialisation is answered within this: the head of the tracker turns.
pub(super) const INITIALIZE: Duration = Duration::from_secs(90);

/// The first question of a connection is answered within this: it only reads. What takes the connection and says nothing is often
/// no tracker.
pub(super) const FIRST: Duration = Duration::from_secs(8);

/// A command whose answer is not complete.
#[derive(Clone, Debug)]
pub(super) struct Exchange {
    /// The command.
    pub command: Command,
    /// When it was sent, or is to be sent again.
    state: State,
    patience: Patience,
}

#[derive(Clone, Copy, Debug)]
enum State {
    Sent { until: Moment },
    Paused { until: Moment },
}

/// What time has done to an exchange.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Due {
    /// Nothing.
    Nothing,
    /// These bytes are to be sent again.
    Again(Vec<u8>),
    /// No answer came in time.
    TimedOut,
}

impl Exchange {
    /// A command that is being sent now.
    pub(super) fn new(command: Command, now: Moment) -> Self {
        let state = State::Sent { until: now + patience(command.id) };
        Self { command, state, patience: Patience::default() }
    }

    /// The first one of a connection.
    pub(super) fn first(command: Command, now: Moment) -> Self {
        Self { state: State::Sent { until: now + FIRST }, ..Self::new(command, now) }
    }

    /// True where an answer to this command is the answer to this exchange.
    pub(super) fn is_answered_by(&self, command: CommandId) -> bool {
        matches!(self.state, State::Sent { .. }) && self.command.id == command
    }

    /// The next moment at which [`Self::due`] has something to say.
    pub(super) const fn deadline(&self) -> Moment {
        match self.state {
            State::Sent { until } | State::Paused { until } => until,
        }
    }

    /// Asks again after a pause.
    pub(super) fn repeat_after(&mut self, pause: Duration, now: Moment) {
        self.state = State::Paused { until: now + pause };
    }

    /// The tracker is busy: asks again after a growing pause. False once that has gone on for too long.
    pub(super) fn retry(&mut self, now: Moment) -> bool {
        let again = self.patience.again_at(now);
        if let Some(until) = again {
            self.state = State::Paused { until };
        }
        again.is_some()
    }

    /// What is to be done now.
    pub(super) fn due(&mut self, now: Moment) -> Due {
        match self.state {
            State::Sent { until } if now >= until => Due::TimedOut,
            State::Paused { until } if now >= until => {
                self.state = State::Sent { until: now + patience(self.command.id) };
                Due::Again(self.command.encode())
            }
            _ => Due::Nothing,
        }
    }
}

/// How long the answer to a command may take.
pub(super) const fn patience(command: CommandId) -> Duration {
    match command {
        CommandId::Initialize => INITIALIZE,
        _ => ORDINARY,
    }
}
