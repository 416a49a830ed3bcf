//! Where threads send what has happened.

use std::sync::mpsc::{SyncSender, TrySendError};

use crate::wizard::Event;

/// What ends a wait.
#[derive(Debug)]
pub(super) enum Message {
    /// For the wizard.
    Event(Event),
    /// For the driver: look at what else there is.
    Wake,
}

/// Where threads send what has happened.
#[derive(Clone, Debug)]
pub struct Events(pub(super) SyncSender<Message>);

impl Events {
    /// Sends; waits for room. `false` if the engine is gone.
    pub fn send(&self, event: Event) -> bool {
        self.0.send(Message::Event(event)).is_ok()
    }

    /// Ends the driver's wait without an event: there is something else to look at, such as a key. `false` if the engine is
    /// gone. Nothing is lost when there is no room: then the driver is not waiting.
    pub fn wake(&self) -> bool {
        !matches!(self.0.try_send(Message::Wake), Err(TrySendError::Disconnected(_)))
    }

    /// Sends if there is room.
    pub(super) fn offer(&self, event: Event) {
        match self.0.try_send(Message::Event(event)) {
            // The next report says more than this one.
            Ok(()) | Err(TrySendError::Full(_) | TrySendError::Disconnected(_)) => {}
        }
    }
}
