//! The channel through which threads report to the engine.

use std::sync::mpsc::{SyncSender, TrySendError};

use crate::wizard::Event;

/// Ends a wait of the engine.
#[derive(Debug)]
pub(super) enum Message {
    /// An event for the wizard.
    Event(Box<Event>),
    /// Tells the driver to look at its other inputs.
    Wake,
}

/// Sends events to an engine.
#[derive(Clone, Debug)]
pub struct Events(pub(super) SyncSender<Message>);

impl Events {
    /// Sends an event, and waits while the channel is full. Returns `false` if the engine is gone.
    pub fn send(&self, event: Event) -> bool {
        self.0.send(Message::Event(Box::new(event))).is_ok()
    }

    /// Ends the driver's wait without an event, because it has another input such as a key. Returns `false` if the engine is
    /// gone. A full channel is fine: the driver is not waiting then.
    pub fn wake(&self) -> bool {
        !matches!(self.0.try_send(Message::Wake), Err(TrySendError::Disconnected(_)))
    }

    /// Sends an event unless the channel is full.
    pub(super) fn offer(&self, event: Event) {
        match self.0.try_send(Message::Event(Box::new(event))) {
            // The next report supersedes this one.
            Ok(()) | Err(TrySendError::Full(_) | TrySendError::Disconnected(_)) => {}
        }
    }
}
