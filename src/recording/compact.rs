//! Files with an index: many small pieces become few large ones, and what was replaced is dropped.

use std::fs::File;
use std::io::{Read as _, Seek as _, SeekFrom, Write as _};
use std::path::Path;

use rerun::external::re_build_info::CrateVersion;
use rerun::external::re_log_encoding::{Decodable as _, Encoder, EncodingOptions, StreamFooter};
use rerun::log::LogMsg;
use rerun::rrd::{OptimizationProfile, optimize};

use super::{RecordingError, read};
use crate::session::journal::Entry;
use crate::store;

/// Writes messages as one compact file at `path`, which is replaced only when all is on disk. Of several layouts the last stays.
pub(super) fn write(messages: &[LogMsg], path: &Path) -> Result<(), RecordingError> {
    let failed = |error: &dyn std::fmt::Display| RecordingError::library("compacting the recording", error);
    let mut encoder = Encoder::new_eager(CrateVersion::LOCAL, EncodingOptions::PROTOBUF_COMPRESSED, Vec::new())
        .map_err(|error| failed(&error))?;
    let layout = messages.iter().rev().find_map(|message| match message {
        LogMsg::BlueprintActivationCommand(command) => Some(&command.blueprint_id),
        _ => None,
    });
    for message in messages {
        let store = message.store_id();
        if store.is_recording() || Some(store) == layout {
            encoder.append(message).map_err(|error| failed(&error))?;
        }
    }
    encoder.finish().map_err(|error| failed(&error))?;
    let whole = encoder.into_inner().map_err(|error| failed(&error))?;
    let folder = path.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or_else(|| Path::new("."));
    let failed_to_write = |source| RecordingError::file("cannot write the recording", path, source);
    let mut file =
        store::temporary().prefix(TEMPORARY.0).suffix(TEMPORARY.1).tempfile_in(folder).map_err(failed_to_write)?;
    let mut compacted = Vec::new();
    read::guarded(|| optimize(whole.as_slice(), &mut compacted, &OptimizationProfile::LIVE))
        .ok_or_else(|| failed(&"the data are damaged"))?
        .map_err(|error| failed(&format!("{error:#}")))?;
    file.write_all(&compacted).and_then(|()| file.as_file().sync_all()).map_err(failed_to_write)?;
    file.persist(path).map_err(|error| failed_to_write(error.error))?;
    // The rename itself must survive a power cut.
    File::open(folder).and_then(|folder| folder.sync_all()).map_err(failed_to_write)
}

/// How the names of files begin and end that will be recordings.
const TEMPORARY: (&str, &str) = (".recording-", ".tmp");

/// Whether a name is that of a file that a program did not finish.
pub(super) fn is_temporary(name: &str) -> bool {
    name.starts_with(TEMPORARY.0) && name.ends_with(TEMPORARY.1)
}

/// All messages of files that can be read, in order; what is damaged or torn is passed over.
///
/// # Errors
/// A file cannot be read.
pub(super) fn messages<'a>(paths: impl Iterator<Item = &'a Path>) -> Result<Vec<LogMsg>, RecordingError> {
    let mut all = Vec::new();
    for path in paths {
        read::messages(path, |message| {
            all.extend(message.ok());
            Ok(())
        })?;
    }
    Ok(all)
}

/// Makes one file compact, in place.
///
/// # Errors
/// It is no recording of this program, or cannot be read or written.
pub fn compact_file(path: &Path) -> Result<(), RecordingError> {
    // Says what is wrong with a file that is none.
    read(path)?;
    let all = messages(std::iter::once(path))?;
    write(&all, path)
}

/// What was found in a recording.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Check {
    /// Size (bytes).
    pub bytes: u64,
    /// Whether it has an index: a viewer then opens it at once, and `rerun rrd verify` accepts it.
    pub has_index: bool,
    /// Lines of the journal in it.
    pub lines: usize,
    /// Samples among them.
    pub samples: usize,
    /// Numbers of lines that are missing between others.
    pub missing: Vec<i64>,
    /// Messages that cannot be read.
    pub damaged: usize,
}

impl Check {
    /// Whether nothing is amiss.
    pub const fn is_whole(&self) -> bool {
        self.has_index && self.missing.is_empty() && self.damaged == 0 && self.lines > 0
    }
}

/// Looks through the recording at `path`.
///
/// # Errors
/// It is no recording of this program, or cannot be read.
pub fn check(path: &Path) -> Result<Check, RecordingError> {
    let recording = read(path)?;
    let lines = recording.lines().map(|journal| journal.lines).unwrap_or_default();
    let bytes = std::fs::metadata(path)
        .map_err(|source| RecordingError::file("cannot read the recording", path, source))?
        .len();
    Ok(Check {
        bytes,
        has_index: has_index(path)?,
        lines: lines.len(),
        samples: lines.iter().filter(|line| matches!(line.entry, Entry::Sample(_))).count(),
        missing: recording.missing,
        damaged: recording.damaged,
    })
}

/// Whether the file ends with the place of an index.
pub(super) fn has_index(path: &Path) -> Result<bool, RecordingError> {
    let failed = |source| RecordingError::file("cannot read the recording", path, source);
    let mut file = File::open(path).map_err(failed)?;
    let size = i64::try_from(StreamFooter::ENCODED_SIZE_BYTES).unwrap_or(i64::MAX);
    if file.seek(SeekFrom::End(-size)).is_err() {
        return Ok(false);
    }
    let mut end = Vec::new();
    file.read_to_end(&mut end).map_err(failed)?;
    Ok(StreamFooter::from_rrd_bytes(&end).is_ok())
}
