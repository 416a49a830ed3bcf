//! The recording of a session: every pose, error and arm for a 3D viewer. The only module that knows the viewer's library.
//!
//! A recording is a function of the journal and never the truth: `renderer` turns journal lines into rows, and the whole file is
//! made of them and replaced at once ([`rebuild`]). While a session is measured a thread ([`Recorder`]) does that every few
//! seconds and at the end; a file that is lost, or that a crash left behind the journal, is made again. It carries the text of
//! the journal as well, so a recording that was sent by mail can be replayed in a terminal ([`read`]).
//!
//! Positions and transforms in a recording are 32-bit floats, as the viewer wants them: exact to 0.25 µm at 3 m. Numbers that
//! are plotted, and the journal's text, are exact.

mod blueprint;
mod canvas;
mod file;
mod identity;
mod latin;
mod layout;
mod live;
mod names;
mod posture;
mod read;
mod recorder;
mod renderer;
mod rrd;

use std::path::{Path, PathBuf};

use thiserror::Error;

pub use file::{FILE_NAME, Written, rebuild, remove_old_parts, write};
pub use live::Live;
pub use read::{is_recording, read};
pub use recorder::{Recorder, RecordingEvent};

use crate::session::journal::JournalError;
use crate::store::StoreError;

/// Why a recording cannot be written or read. The session itself is never affected.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum RecordingError {
    /// A file cannot be read or written.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// The rest of the disk is left for the session.
    #[error("less than {} MiB are free on the disk, and they are left for the session", reserve >> 20)]
    NoRoom {
        /// Bytes that are left free.
        reserve: u64,
    },
    /// The library refuses.
    #[error("{what}: {message}")]
    Library {
        /// What was tried.
        what: &'static str,
        /// Message of the library.
        message: String,
    },
    /// The file is not a recording of this program.
    #[error("'{}' is no recording of trupose: {message}", path.display())]
    Foreign {
        /// Path of the file.
        path: PathBuf,
        /// What is odd.
        message: String,
    },
    /// The journal in a recording is damaged.
    #[error("the journal in '{}'", path.display())]
    Journal {
        /// Path of the recording.
        path: PathBuf,
        /// What is wrong.
        source: JournalError,
    },
    /// The port of the live view cannot be used.
    #[error("the live view cannot listen on 127.0.0.1:{port}: {message}")]
    Port {
        /// Number of the port.
        port: u16,
        /// Message of the system.
        message: String,
    },
}

impl RecordingError {
    fn library(what: &'static str, error: impl std::fmt::Display) -> Self {
        Self::Library { what, message: error.to_string() }
    }

    fn foreign(path: &Path, message: impl Into<String>) -> Self {
        Self::Foreign { path: path.to_owned(), message: message.into() }
    }
}
