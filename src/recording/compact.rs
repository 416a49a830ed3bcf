//! Files with an index: many small pieces become few large ones, and what was replaced is dropped.

use std::path::Path;

use rerun::external::re_build_info::CrateVersion;
use rerun::external::re_log_encoding::{Encoder, EncodingOptions};
use rerun::external::re_log_types::StoreSource;
use rerun::log::LogMsg;
use rerun::rrd::{OptimizationProfile, optimize};

use super::{Recording, RecordingError, names, read, segments};
use crate::session::journal::Entry;
use crate::store::{self, StoreError};

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
        if !store.is_recording() && Some(store) != layout {
            continue;
        }
        if let LogMsg::SetStoreInfo(info) = message {
            // The whole is no part any more.
            let mut info = info.clone();
            info.info.store_source = StoreSource::Other(names::APPLICATION.to_owned());
            encoder.append(&LogMsg::SetStoreInfo(info)).map_err(|error| failed(&error))?;
        } else {
            encoder.append(message).map_err(|error| failed(&error))?;
        }
    }
    encoder.finish().map_err(|error| failed(&error))?;
    let whole = encoder.into_inner().map_err(|error| failed(&error))?;
    let mut compacted = Vec::new();
    read::guarded(|| optimize(whole.as_slice(), &mut compacted, &OptimizationProfile::LIVE))
        .ok_or_else(|| failed(&"the data are damaged"))?
        .map_err(|error| failed(&format!("{error:#}")))?;
    store::replace_through(path, TEMPORARY, &compacted).map_err(|error| match error {
        StoreError::Read { path, source } | StoreError::Write { path, source } | StoreError::Into { path, source } => {
            RecordingError::file("cannot write the recording", &path, source)
        }
    })
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

/// What has become of a file that was to be made compact.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Compaction {
    /// It is compact, and has all that it had.
    AsItWas,
    /// A program had not ended it. Everything is drawn anew from the lines of the journal in it: the last picture may have been torn.
    DrawnAnew,
    /// It is damaged, or a part of it is missing: it stays as it is.
    Refused,
}

/// Makes one file compact, in place.
///
/// # Errors
/// It is no recording of this program, or cannot be read or written.
pub fn compact_file(path: &Path) -> Result<Compaction, RecordingError> {
    let (found, recording) = look(path)?;
    if found.is_whole() {
        let all = messages(std::iter::once(path))?;
        write(&all, path)?;
        return Ok(Compaction::AsItWas);
    }
    match recording.lines() {
        Ok(journal) if found.is_unfinished() => {
            segments::write(path, &journal.lines, false)?;
            Ok(Compaction::DrawnAnew)
        }
        _ => Ok(Compaction::Refused),
    }
}

/// What was found in a recording.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Check {
    /// Size (bytes).
    pub bytes: u64,
    /// Whether it was written while a session was measured, line by line: it may end anywhere.
    pub is_part: bool,
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
        self.has_index && self.is_intact()
    }

    /// Whether nothing is amiss but that no program has ended it: it is being written, or a crash has torn its end.
    pub const fn is_unfinished(&self) -> bool {
        !self.has_index && self.is_part && self.is_intact()
    }

    const fn is_intact(&self) -> bool {
        self.missing.is_empty() && self.damaged == 0 && self.lines > 0
    }
}

/// Looks through the recording at `path`.
///
/// # Errors
/// It is no recording of this program, or cannot be read.
pub fn check(path: &Path) -> Result<Check, RecordingError> {
    look(path).map(|(found, _recording)| found)
}

fn look(path: &Path) -> Result<(Check, Recording), RecordingError> {
    let recording = read(path)?;
    let lines = recording.lines().map(|journal| journal.lines).unwrap_or_default();
    let bytes = std::fs::metadata(path)
        .map_err(|source| RecordingError::file("cannot read the recording", path, source))?
        .len();
    // Lines that do not fit together were changed.
    let unfit = recording.missing.is_empty() && lines.len() != recording.numbers.len();
    let found = Check {
        bytes,
        is_part: recording.is_part,
        has_index: has_index(path)?,
        lines: lines.len(),
        samples: lines.iter().filter(|line| matches!(line.entry, Entry::Sample(_))).count(),
        missing: recording.missing.clone(),
        damaged: recording.damaged + usize::from(unfit),
    };
    Ok((found, recording))
}

/// Whether the file ends with the place of an index.
pub(super) fn has_index(path: &Path) -> Result<bool, RecordingError> {
    Ok(read::end(path)? == read::End::Index)
}
