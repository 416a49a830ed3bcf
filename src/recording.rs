//! Recordings of sessions for a 3D viewer: a film of the calibration. The only module that knows the viewer's library.
//!
//! A recording is a function of the journal: `renderer` turns journal lines into rows, `rrd` encodes them, and [`rebuild`] replaces
//! the whole file. While a session is measured, a thread ([`Recorder`]) does that every few seconds and at the end. A recording
//! that is lost or lacks the last lines can be made again at any time, and this program never reads one.
//!
//! Positions in a recording are 32-bit floats, as the viewer wants them: exact to 0.25 µm at 3 m. Numbers for plots and tables are
//! exact.

mod arm;
mod blueprint;
mod canvas;
mod chart;
mod file;
mod identity;
mod latin;
mod live;
mod names;
mod recorder;
mod renderer;
mod rrd;
mod style;
mod targets;

use thiserror::Error;

pub use file::{FILE_NAME, Written, is_recording, rebuild, remove_old_parts, write};
pub use live::Live;
pub use recorder::{Recorder, RecordingEvent};
pub use targets::{DrawnTarget, write_targets};

use crate::store::StoreError;

/// A recording cannot be written. The session itself is never affected.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum RecordingError {
    /// The file cannot be written.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// Too little of the disk is free; the rest is left to the session.
    #[error("less than {} MiB are free on the disk, and they are left to the session", reserve >> 20)]
    NoRoom {
        /// Free bytes that are left to the session.
        reserve: u64,
    },
    /// The library has failed.
    #[error("{what}: {message}")]
    Library { what: &'static str, message: String },
    /// The port of the live view cannot be used.
    #[error("the live view cannot listen on 127.0.0.1:{port}: {message}")]
    Port { port: u16, message: String },
}

impl RecordingError {
    fn library(what: &'static str, error: impl std::fmt::Display) -> Self {
        Self::Library { what, message: error.to_string() }
    }
}
