//! Reads the journal out of a recording, for a replay. A program that measures never reads recordings.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufReader, Read as _};
use std::iter;
use std::panic::{self, AssertUnwindSafe};
use std::path::Path;

use rerun::external::re_log_encoding::DecoderApp;
use rerun::log::{Chunk, ChunkResult, LogMsg};
use rerun::{TextDocument, TimelineName};

use super::{RecordingError, names};
use crate::session::journal::{self, Journal};
use crate::store::StoreError;

/// First bytes of every recording of the library.
const MAGIC: &[u8] = b"RRF";
/// Bytes at the beginning that name the program (the library's message about the store comes first).
const HEAD: u64 = 1024;

/// Reads the journal that the recording at `path` carries. Its lines have check sums, so damage elsewhere in the file does not
/// matter.
///
/// # Errors
/// The file cannot be read, is not a recording of this program, or its journal is damaged.
pub fn read(path: &Path) -> Result<Journal, RecordingError> {
    File::open(path).map_err(|source| StoreError::Read { path: path.to_owned(), source })?;
    if !is_recording(path) {
        return Err(RecordingError::foreign(path, "it has not the beginning of one"));
    }
    let mut lines = BTreeMap::new();
    for message in decoded(path) {
        // The library panics about some kinds of damage.
        let _damage = panic::catch_unwind(AssertUnwindSafe(|| collect(&message, &mut lines))).is_err();
    }
    let text: String = lines.into_values().collect();
    journal::read(text.as_bytes()).map_err(|source| RecordingError::Journal { path: path.to_owned(), source })
}

/// Returns whether the file at `path` begins like a recording of this program. It only compares bytes: the library may fail at
/// damaged ones.
pub fn is_recording(path: &Path) -> bool {
    let mut head = Vec::new();
    let read = File::open(path).and_then(|file| file.take(HEAD).read_to_end(&mut head));
    let name = names::APPLICATION.as_bytes();
    read.is_ok() && head.starts_with(MAGIC) && head.windows(name.len()).any(|part| part == name)
}

/// Returns the messages of the file at `path`, up to the first that cannot be decoded.
fn decoded(path: &Path) -> impl Iterator<Item = LogMsg> {
    let file = File::open(path).into_iter();
    let mut messages = file.flat_map(|file| DecoderApp::decode_lazy(BufReader::new(file)));
    // The library panics about some kinds of damage.
    iter::from_fn(move || panic::catch_unwind(AssertUnwindSafe(|| messages.next())).ok()??.ok())
}

/// Adds the lines of the journal in a message, by their numbers.
fn collect(message: &LogMsg, lines: &mut BTreeMap<i64, String>) -> ChunkResult<()> {
    let LogMsg::ArrowMsg(_, arrow) = message else { return Ok(()) };
    let chunk = Chunk::from_arrow_msg(arrow)?;
    if chunk.entity_path().to_string().trim_start_matches('/') == names::JOURNAL {
        let text = TextDocument::descriptor_text().component;
        let at = chunk.iter_component_indices(TimelineName::from_static_str(names::ENTRY), text);
        let texts = chunk.iter_slices::<String>(text);
        lines.extend(at.zip(texts).filter_map(|((time, _row), text)| Some((time.as_i64(), text.first()?.to_string()))));
    }
    Ok(())
}
