//! Turns the wizard's effects into work on named threads, and answers into events.
//!
//! ```text
//!  driver (script, tui) ── Intent ──► Engine: Wizard::update ── Effect ──► store thread   (journal, files)
//!                                        ▲                         ├─────► link thread    (instrument)
//!                                        └────── Event ◄───────────┴─────► job threads    (plan, identify, read)
//! ```
//!
//! All channels are bounded. A progress report that nobody has room for is dropped; an answer never is. Every request can be
//! cancelled: its flag is asked by whoever works on it. A panic on a job thread is an answer that says so.

mod clock;
mod engine;
mod events;
mod jobs;
mod links;
pub mod signals;
mod store_thread;

pub use clock::Clock;
pub use engine::{Deed, Engine, Happening, Options};
pub use events::Events;
