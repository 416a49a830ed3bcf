//! One command in progress: the time limit of its answer, and its retries.

use std::time::Duration;

use super::super::Moment;
use super::super::backoff::Backoff;
use super::command::Command;
use super::status::CommandId;

/// Time limit of an ordinary command.
pub(super) const ORDINARY: Duration = Duration::from_secs(30);

/// Time limit of the initialisation, in which the head of the tracker turns.
pub(super) const INITIALIZE: Duration = Duration::from_secs(90);

/// Time limit of the first command of a connection, which only reads. A peer that accepts the connection and stays silent is
/// usually not a tracker.
pub(super) const FIRST: Duration = Duration::from_secs(8);

/// A command that was not answered completely.
#[derive(Clone, Debug)]
pub(super) struct Exchange {
    pub command: Command,
    state: State,
    backoff: Backoff,
}

#[derive(Clone, Copy, Debug)]
enum State {
    Sent { until: Moment },
    Paused { until: Moment },
}

/// What an exchange needs at some time.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Due {
    Nothing,
    /// Send these bytes again.
    Resend(Vec<u8>),
    /// The answer is overdue.
    TimedOut,
}

impl Exchange {
    /// A command sent now.
    pub(super) fn new(command: Command, now: Moment) -> Self {
        let state = State::Sent { until: now + time_limit(command.id) };
        Self { command, state, backoff: Backoff::default() }
    }

    /// The first command of a connection, sent now.
    pub(super) fn first(command: Command, now: Moment) -> Self {
        Self { state: State::Sent { until: now + FIRST }, ..Self::new(command, now) }
    }

    /// Whether an answer to this command answers this exchange.
    pub(super) fn is_answered_by(&self, command: CommandId) -> bool {
        matches!(self.state, State::Sent { .. }) && self.command.id == command
    }

    /// The next time at which [`Self::due`] returns an action.
    pub(super) const fn deadline(&self) -> Moment {
        match self.state {
            State::Sent { until } | State::Paused { until } => until,
        }
    }

    /// Schedules the command again after a pause.
    pub(super) fn repeat_after(&mut self, pause: Duration, now: Moment) {
        self.state = State::Paused { until: now + pause };
    }

    /// Schedules a retry for a busy tracker after a growing pause; `false` once it has been busy for too long.
    pub(super) fn retry(&mut self, now: Moment) -> bool {
        let Some(until) = self.backoff.next_attempt(now) else { return false };
        self.state = State::Paused { until };
        true
    }

    /// The action that is due now.
    pub(super) fn due(&mut self, now: Moment) -> Due {
        match self.state {
            State::Sent { until } if now >= until => Due::TimedOut,
            State::Paused { until } if now >= until => {
                self.state = State::Sent { until: now + time_limit(self.command.id) };
                Due::Resend(self.command.encode())
            }
            _ => Due::Nothing,
        }
    }
}

/// Time limit of a command.
pub(super) const fn time_limit(command: CommandId) -> Duration {
    match command {
        CommandId::Initialize | CommandId::GoPosition => INITIALIZE,
        _ => ORDINARY,
    }
}
