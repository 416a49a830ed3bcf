//! Turns the wizard's effects into work on named threads, and their answers into events.
//!
//! ```text
//!  driver (script, tui) ── Intent ──► Engine: Wizard::update ── Effect ──► store thread   (journal, files)
//!                                        ▲                         ├─────► link thread    (instrument)
//!                                        └────── Event ◄───────────┴─────► job threads    (plan, identify, read)
//! ```
//!
//! The channels of events and commands are bounded. A progress report that finds a full channel is dropped; an answer never is.
//! Every request can be cancelled: the thread that works on it polls its flag. A panic on a job thread becomes a failed answer.

mod clock;
mod engine;
mod events;
mod jobs;
mod links;
pub mod recent;
pub mod signals;
mod store_thread;

pub use crate::store::completions;
pub use clock::Clock;
pub use engine::{CompletedIntent, Engine, Options, Output};
pub use events::Events;
