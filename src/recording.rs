//! The recording of a session: every pose, error and arm for a 3D viewer. The only module that knows the viewer's library.
//!
//! A recording is a picture of the journal and never the truth: `scribe` turns journal lines into entities, line by line, so a
//! recording that is lost or damaged is made anew from the journal ([`rebuild`]) with the same content. It carries the text
//! of the journal as well, so a recording that was sent by mail can be looked at in a terminal.
//!
//! Positions and transforms in a recording are 32-bit floats, as the viewer wants them: exact to 0.25 µm at 3 m. Numbers that
//! are plotted, and the journal's text, are exact.
//!
//! | file | what |
//! |---|---|
//! | `recording.part-001.rrd`, … | what a running program writes, flushed to disk after every entry |
//! | `recording.rrd` | all parts as one, with an index; made when the program ends in good order |

mod blueprint;
mod canvas;
mod compact;
mod layout;
mod names;
mod read;
mod recorder;
mod scribe;
mod segments;
mod sink;

use std::path::PathBuf;

use thiserror::Error;

pub use compact::{Check, Compaction, check, compact_file};
pub use read::{Recording, read};
pub use recorder::{Live, Recorder, RecordingEvent, Room};
pub use segments::{FILE_NAME, compact_folder, files, foreign_lines, rebuild, write};

/// Why a recording cannot be written or read. The session goes on without it.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum RecordingError {
    /// A file cannot be read or written.
    #[error("{what} '{}'", path.display())]
    File {
        /// What was tried.
        what: &'static str,
        /// Which file.
        path: PathBuf,
        /// What the system says.
        #[source]
        source: std::io::Error,
    },
    /// The library refuses.
    #[error("{what}: {message}")]
    Library {
        /// What was tried.
        what: &'static str,
        /// What it says.
        message: String,
    },
    /// It is no recording, or not one of this program.
    #[error("'{}' is no recording of trupose: {message}", path.display())]
    Foreign {
        /// Which file.
        path: PathBuf,
        /// What is odd.
        message: String,
    },
    /// The port of the live view cannot be had.
    #[error("the live view cannot listen on 127.0.0.1:{port}: {message}")]
    Port {
        /// Which port.
        port: u16,
        /// What the system says.
        message: String,
    },
}

impl RecordingError {
    fn file(what: &'static str, path: &std::path::Path, source: std::io::Error) -> Self {
        Self::File { what, path: path.to_owned(), source }
    }

    fn library(what: &'static str, error: impl std::fmt::Display) -> Self {
        Self::Library { what, message: error.to_string() }
    }
}
