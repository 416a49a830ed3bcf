//! The files of a recording in the folder of its session.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::path::{Path, PathBuf};

use rerun::external::re_log_types::StoreSource;
use rerun::sink::LogSink;
use rerun::{RecordingStream, RecordingStreamBuilder};

use super::blueprint::Purpose;
use super::compact::Compaction;
use super::scribe::Scribe;
use super::sink::DurableSink;
use super::{RecordingError, compact, names, read};
use crate::session::journal::{Entry, Line, says};
use crate::session::sha256;

/// Name of the recording in a session's folder.
pub const FILE_NAME: &str = "recording.rrd";

/// How the names of parts begin and end.
const PART: (&str, &str) = ("recording.part-", ".rrd");

/// Which recording lines belong to: all parts of a session carry the same id.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Identity {
    id: String,
    name: String,
}

impl Identity {
    /// From the first line of a journal.
    pub(super) fn of(first: &Line) -> Self {
        let name = match &first.entry {
            Entry::Opened { name, .. } => name.clone(),
            _ => "session".to_owned(),
        };
        let id = sha256(format!("{name} {}", first.time).as_bytes()).chars().take(32).collect();
        Self { id, name: read::plain(&name) }
    }

    /// A stream of this recording. Neither the environment nor a viewer decides whether it is written.
    pub(super) fn builder(&self) -> RecordingStreamBuilder {
        RecordingStreamBuilder::new(names::APPLICATION)
            .recording_id(self.id.clone())
            .recording_name(self.name.clone())
            .send_properties(true)
            .enabled(true)
    }

    /// A stream to a new file, forced to disk by every flush.
    pub(super) fn file(&self, path: &Path) -> Result<RecordingStream, RecordingError> {
        let create = |source| RecordingError::file("cannot create the recording", path, source);
        let file = File::options().write(true).create_new(true).open(path).map_err(create)?;
        let sink = DurableSink::new(file).map_err(|message| create(std::io::Error::other(message)))?;
        self.stream(sink)
    }

    /// A stream into `sink`.
    pub(super) fn stream(&self, sink: DurableSink) -> Result<RecordingStream, RecordingError> {
        self.builder()
            .store_source(StoreSource::Other(names::PART.to_owned()))
            .set_sinks(vec![Box::new(sink) as Box<dyn LogSink>])
            .map_err(|error| RecordingError::library("beginning the recording", error))
    }
}

/// The parts in `folder`, oldest first.
fn parts(folder: &Path) -> Vec<(u32, PathBuf)> {
    let entries = fs::read_dir(folder).into_iter().flatten().filter_map(Result::ok);
    let mut parts: Vec<(u32, PathBuf)> = entries
        .filter_map(|entry| {
            let name = entry.file_name();
            let number = name.to_str()?.strip_prefix(PART.0)?.strip_suffix(PART.1)?.parse().ok()?;
            Some((number, entry.path()))
        })
        .collect();
    parts.sort();
    parts
}

/// The files of the recording in `folder`, oldest first.
pub fn files(folder: &Path) -> Vec<PathBuf> {
    let whole = folder.join(FILE_NAME);
    let whole = whole.exists().then_some(whole);
    whole.into_iter().chain(parts(folder).into_iter().map(|(_, path)| path)).collect()
}

/// The path of the next part.
pub(super) fn next_part(folder: &Path) -> PathBuf {
    let number = parts(folder).last().map_or(1, |(number, _)| number + 1);
    folder.join(format!("{}{number:03}{}", PART.0, PART.1))
}

/// What the files of a folder are good for.
#[derive(Debug, Default, PartialEq, Eq)]
pub(super) struct Earlier {
    /// So many lines of the journal are drawn in files that were ended in good order.
    pub(super) lines: usize,
    /// Files that are to be replaced: a crash ended them and may have torn the last picture, or they cannot be read.
    pub(super) void: Vec<PathBuf>,
}

/// Looks through the files in `folder`, whose journal has these lines.
pub(super) fn earlier(folder: &Path, lines: &[Line]) -> Earlier {
    let mut earlier = Earlier::default();
    for file in files(folder) {
        let first = i64::try_from(earlier.lines + 1).unwrap_or(i64::MAX);
        let found = match read::journal_lines(&file) {
            Ok((texts, seen)) if seen.damaged == 0 && compact::has_index(&file).unwrap_or(false) => texts,
            _ => BTreeMap::new(),
        };
        // One that goes on where the others end, and has nothing that the journal has not.
        let follows = !found.is_empty() && found.keys().copied().eq((first..).take(found.len()));
        if follows && earlier.void.is_empty() && found.iter().all(|(number, text)| is_of(lines, *number, text)) {
            earlier.lines += found.len();
        } else {
            earlier.void.push(file);
        }
    }
    earlier
}

/// Whether the line `number` of the journal says this.
fn is_of(lines: &[Line], number: i64, text: &str) -> bool {
    let index = usize::try_from(number).ok().and_then(|number| number.checked_sub(1));
    index.and_then(|index| lines.get(index)).is_some_and(|line| says(text, line))
}

/// Numbers of the lines in the recording at `path` that the journal with these lines has not, or that say something else there.
///
/// # Errors
/// The file cannot be read or is not a recording of this program.
pub fn foreign_lines(path: &Path, lines: &[Line]) -> Result<Vec<i64>, RecordingError> {
    let (texts, _seen) = read::journal_lines(path)?;
    Ok(texts.into_iter().filter(|(number, text)| !is_of(lines, *number, text)).map(|(number, _)| number).collect())
}

/// Removes files.
pub(super) fn remove(files: &[PathBuf]) -> Result<(), RecordingError> {
    for file in files {
        fs::remove_file(file).map_err(|source| RecordingError::file("cannot remove", file, source))?;
    }
    Ok(())
}

/// Removes all parts in `folder`. The journal has what was in them.
pub(super) fn remove_parts(folder: &Path) {
    for (_, path) in parts(folder) {
        // What cannot be removed keeps its room.
        drop(fs::remove_file(path));
    }
}

/// Removes what a program left that was ended while it made one file of all. The folder must be held.
pub(super) fn clean(folder: &Path) {
    let entries = fs::read_dir(folder).into_iter().flatten().filter_map(Result::ok);
    let left = entries.filter(|entry| entry.file_name().to_str().is_some_and(compact::is_temporary));
    // What cannot be removed does no harm.
    left.for_each(|entry| drop(fs::remove_file(entry.path())));
}

/// Makes the recording in `folder`, whose journal has these lines, one compact file, and returns its path. Where a crash has
/// left gaps or torn the last picture it is drawn anew.
///
/// # Errors
/// A file cannot be read or written; nothing is lost then.
pub fn compact_folder(folder: &Path, lines: &[Line]) -> Result<PathBuf, RecordingError> {
    let found = earlier(folder, lines);
    if found.void.is_empty()
        && found.lines == lines.len()
        && let Some(path) = merge(folder)?
        && compact::compact_file(&path)? == Compaction::AsItWas
    {
        return Ok(path);
    }
    rebuild(folder, lines)
}

/// Makes one compact file of all parts in `folder`; the parts go when it is on disk. Returns its path, if there is anything.
pub(super) fn merge(folder: &Path) -> Result<Option<PathBuf>, RecordingError> {
    clean(folder);
    let whole = folder.join(FILE_NAME);
    let parts = parts(folder);
    if parts.is_empty() {
        return Ok(whole.exists().then_some(whole));
    }
    let all = files(folder);
    let messages = compact::messages(all.iter().map(PathBuf::as_path))?;
    compact::write(&messages, &whole)?;
    for (_, part) in parts {
        fs::remove_file(&part).map_err(|source| RecordingError::file("cannot remove", &part, source))?;
    }
    Ok(Some(whole))
}

/// Makes the recording in `folder` anew from the lines of its journal, and returns its path.
///
/// # Errors
/// It cannot be written; the old one stays then.
pub fn rebuild(folder: &Path, lines: &[Line]) -> Result<PathBuf, RecordingError> {
    clean(folder);
    let whole = folder.join(FILE_NAME);
    write_for(&whole, lines, Purpose::Capture)?;
    for (_, part) in parts(folder) {
        fs::remove_file(&part).map_err(|source| RecordingError::file("cannot remove", &part, source))?;
    }
    Ok(whole)
}

/// Writes a recording of these lines to `path`. `of_plan`: it opens on the search for the poses.
///
/// # Errors
/// There are no lines, or the file cannot be written.
pub fn write(path: &Path, lines: &[Line], of_plan: bool) -> Result<(), RecordingError> {
    write_for(path, lines, if of_plan { Purpose::Plan } else { Purpose::Capture })
}

fn write_for(path: &Path, lines: &[Line], purpose: Purpose) -> Result<(), RecordingError> {
    let Some(first) = lines.first() else {
        return Err(RecordingError::library("beginning the recording", "there is nothing to record"));
    };
    let (stream, storage) = Identity::of(first)
        .builder()
        .memory()
        .map_err(|error| RecordingError::library("beginning the recording", error))?;
    let mut scribe = Scribe::new(stream, purpose, &[]);
    for line in lines {
        scribe.take(line);
    }
    scribe.stream().flush_blocking().map_err(|error| RecordingError::library("drawing the recording", error))?;
    compact::write(&storage.take(), path)
}
