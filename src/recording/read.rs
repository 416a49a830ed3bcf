//! Reads recordings, also those that a crash left half-written.

use std::cell::Cell;
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, BufReader, Read as _, Seek as _, SeekFrom};
use std::panic::{self, AssertUnwindSafe};
use std::path::Path;
use std::sync::Once;

use rerun::external::re_log_encoding::rrd::DecodeError;
use rerun::external::re_log_encoding::{Decodable as _, DecoderApp, StreamFooter};
use rerun::external::re_log_types::{StoreInfo, StoreSource};
use rerun::log::{Chunk, LogMsg};
use rerun::{TextDocument, TimelineName};

use super::{RecordingError, names};
use crate::session::journal::{self, Journal};

/// Bytes before the first piece of a file.
const STREAM_HEADER: u64 = 12;
/// Bytes that say kind and length of a piece.
const PIECE_HEADER: u64 = 16;
/// Kind of the last piece, before the place of the index.
const LAST_PIECE: u64 = 0;
/// Largest kind of a piece.
const LARGEST_KIND: u64 = 3;
/// By so many bytes a piece may be longer than the file before it is taken for damaged.
const ROOM: u64 = 64 << 20;

/// What a recording carries of its session.
#[derive(Clone, Debug, Default)]
pub struct Recording {
    /// The journal as far as the recording has it, line breaks included. Empty if it has none.
    pub journal: Vec<u8>,
    /// Numbers of the journal lines in it.
    pub numbers: Vec<u64>,
    /// Messages that could not be read.
    pub damaged: usize,
    /// Journal lines that are missing between others.
    pub missing: Vec<i64>,
    /// Whether it was written while a session was measured, line by line: it may end anywhere.
    pub is_part: bool,
}

impl Recording {
    /// The journal's lines.
    ///
    /// # Errors
    /// There are none, or they do not fit together.
    pub fn lines(&self) -> Result<Journal, journal::JournalError> {
        journal::read(&self.journal)
    }
}

/// Reads the recording at `path`.
///
/// # Errors
/// The file cannot be read or is not a recording of this program.
pub fn read(path: &Path) -> Result<Recording, RecordingError> {
    let mut recording = Recording::default();
    let (lines, seen) = journal_lines(path)?;
    recording.damaged = seen.damaged;
    recording.is_part = seen.is_part;
    if let Some((last, _)) = lines.last_key_value() {
        recording.missing = (1..=*last).filter(|number| !lines.contains_key(number)).collect();
    }
    recording.numbers = lines.keys().filter_map(|number| u64::try_from(*number).ok()).collect();
    // Lines behind a gap cannot be checked.
    let whole = recording.missing.first().copied().unwrap_or(i64::MAX);
    recording.journal = lines.range(..whole).flat_map(|(_, text)| text.bytes()).collect();
    Ok(recording)
}

/// What was seen of a file while its data were read.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Seen {
    /// Messages that could not be read.
    pub(super) damaged: usize,
    /// It was written while a session was measured.
    pub(super) is_part: bool,
}

/// The journal lines in the recording at `path` by their numbers, line breaks included.
pub(super) fn journal_lines(path: &Path) -> Result<(BTreeMap<i64, String>, Seen), RecordingError> {
    let mut lines: BTreeMap<i64, String> = BTreeMap::new();
    let seen = chunks(path, |chunk| {
        if chunk.entity_path().to_string().trim_start_matches('/') != names::JOURNAL {
            return;
        }
        let text = TextDocument::descriptor_text().component;
        let at = chunk.iter_component_indices(TimelineName::from_static_str(names::ENTRY), text);
        let texts = chunk.iter_slices::<String>(text);
        for ((time, _row), text) in at.zip(texts) {
            if let Some(text) = text.first() {
                lines.insert(time.as_i64(), text.to_string());
            }
        }
    })?;
    Ok((lines, seen))
}

/// Gives all chunks of data of the recording at `path` to `take`.
fn chunks(path: &Path, mut take: impl FnMut(&Chunk)) -> Result<Seen, RecordingError> {
    let (mut seen, mut known) = (Seen::default(), false);
    messages(path, |message| {
        match message {
            Ok(LogMsg::SetStoreInfo(info)) => {
                let application = info.info.store_id.application_id().to_string();
                if application != names::APPLICATION {
                    let message = format!("it was written by '{}'", plain(&application));
                    return Err(RecordingError::Foreign { path: path.to_owned(), message });
                }
                known = true;
                seen.is_part |= is_part(&info.info);
            }
            Ok(LogMsg::ArrowMsg(store, arrow)) if store.is_recording() => {
                // Damaged data may fit together and still break what looks at them.
                let taken = guarded(|| Chunk::from_arrow_msg(&arrow).map(|chunk| take(&chunk)).is_ok());
                seen.damaged += usize::from(taken != Some(true));
            }
            Ok(_) => {}
            Err(message) if !known => return Err(RecordingError::Foreign { path: path.to_owned(), message }),
            Err(_damage) => seen.damaged += 1,
        }
        Ok(())
    })?;
    if known {
        Ok(seen)
    } else {
        Err(RecordingError::Foreign { path: path.to_owned(), message: "there is nothing in it".to_owned() })
    }
}

/// Whether a recording says that it is written while a session is measured.
fn is_part(info: &StoreInfo) -> bool {
    matches!(&info.store_source, StoreSource::Other(source) if source == names::PART)
}

/// How a file ends, piece by piece.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum End {
    /// With the place of an index.
    Index,
    /// Within a piece or between two: it is still being written, or its end is missing.
    Torn,
    /// What stands behind so many bytes is no piece: nothing there can be told from garbage.
    Damaged(u64, &'static str),
}

/// Looks how the recording at `path` ends.
pub(super) fn end(path: &Path) -> Result<End, RecordingError> {
    let found = || -> io::Result<End> {
        let mut file = File::open(path)?;
        let size = file.metadata()?.len();
        end_of(&mut file, size)
    };
    found().map_err(|source| RecordingError::file("cannot read the recording", path, source))
}

/// How `file` of `size` bytes ends. The library takes memory for as much as a piece says, and the program ends where there is
/// not so much; and it says nothing about pieces of a kind that there is not.
fn end_of(file: &mut File, size: u64) -> io::Result<End> {
    let footer = StreamFooter::ENCODED_SIZE_BYTES as u64;
    let mut at = STREAM_HEADER;
    while at + PIECE_HEADER <= size {
        file.seek(SeekFrom::Start(at))?;
        let mut number = || {
            let mut bytes = [0; 8];
            file.read_exact(&mut bytes).map(|()| u64::from_le_bytes(bytes))
        };
        let (kind, length) = (number()?, number()?);
        if kind > LARGEST_KIND {
            return Ok(End::Damaged(at, "a piece of it is of no known kind"));
        }
        // The last piece of a file that is being written may be cut.
        if length > size.saturating_add(ROOM) {
            return Ok(End::Damaged(at, "a piece of it says that it is longer than the file"));
        }
        at += PIECE_HEADER + length;
        if kind == LAST_PIECE {
            if at + footer == size {
                file.seek(SeekFrom::Start(at))?;
                let mut bytes = Vec::new();
                file.read_to_end(&mut bytes)?;
                if StreamFooter::from_rrd_bytes(&bytes).is_ok() {
                    return Ok(End::Index);
                }
                return Ok(End::Damaged(at, "the place of its index is damaged"));
            }
            // Files may be joined end to end.
            at += footer + STREAM_HEADER;
        }
    }
    Ok(End::Torn)
}

/// Gives all messages of the file at `path` to `take`, and what is wrong with those that are damaged.
///
/// # Errors
/// The file cannot be read, or `take` refuses.
pub(super) fn messages(
    path: &Path,
    mut take: impl FnMut(Result<LogMsg, String>) -> Result<(), RecordingError>,
) -> Result<(), RecordingError> {
    let failed = |source| RecordingError::file("cannot read the recording", path, source);
    let mut file = File::open(path).map_err(failed)?;
    let size = file.metadata().map_err(failed)?.len();
    let (sound, damage) = match end_of(&mut file, size).map_err(failed)? {
        End::Damaged(sound, damage) => (sound, Some(damage)),
        End::Index | End::Torn => (size, None),
    };
    file.rewind().map_err(failed)?;
    let mut messages = DecoderApp::decode_lazy(BufReader::new(file.take(sound)));
    loop {
        let Some(next) = guarded(|| messages.next()) else {
            // Nothing behind it can be told from garbage.
            return take(Err("it is damaged".to_owned()));
        };
        match next {
            Some(Ok(message)) => take(Ok(message))?,
            // It would be tried again for ever.
            Some(Err(DecodeError::Read(source))) => return Err(failed(source)),
            Some(Err(error)) => take(Err(plain(&error.to_string())))?,
            None => return damage.map_or(Ok(()), |damage| take(Err(damage.to_owned()))),
        }
    }
}

thread_local! {
    /// Whether panics of this thread are expected and caught.
    static GUARDED: Cell<bool> = const { Cell::new(false) };
}

/// Does something with data that may be damaged: the library panics about some kinds of damage. `None` then.
pub(super) fn guarded<T>(work: impl FnOnce() -> T) -> Option<T> {
    static HOOK: Once = Once::new();
    HOOK.call_once(|| {
        let usual = panic::take_hook();
        panic::set_hook(Box::new(move |info| {
            if !GUARDED.get() {
                usual(info);
            }
        }));
    });
    GUARDED.set(true);
    let done = panic::catch_unwind(AssertUnwindSafe(work));
    GUARDED.set(false);
    done.ok()
}

/// A text in plain Latin letters: some viewers cannot draw others.
pub(super) fn plain(text: &str) -> String {
    let mut plain = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '\u{2212}' | '\u{2013}' | '\u{2014}' => plain.push('-'),
            '\u{394}' => plain.push('d'),
            'σ' => plain.push_str("sigma"),
            'α' => plain.push_str("alpha"),
            'β' => plain.push_str("beta"),
            'θ' => plain.push_str("theta"),
            'µ' | 'μ' => plain.push('u'),
            '°' => plain.push_str(" deg"),
            '±' => plain.push_str("+-"),
            '…' => plain.push_str("..."),
            '²' => plain.push_str("^2"),
            '\u{2019}' => plain.push('\''),
            // Latin letters with marks are drawn everywhere.
            '\n' | ' '..='~' | 'À'..='ÿ' => plain.push(c),
            _ => plain.push('?'),
        }
    }
    plain
}

#[cfg(test)]
mod tests {
    use std::io::Write as _;

    use super::*;

    #[test]
    fn a_piece_of_no_kind_ends_what_is_read_and_is_told() {
        let mut bytes = include_bytes!("../../sessions/example/recording.rrd").to_vec();
        let at = usize::try_from(STREAM_HEADER).unwrap();
        bytes[at + 3] ^= 1;
        let mut file = tempfile::NamedTempFile::new().unwrap();
        file.write_all(&bytes).unwrap();
        let mut told = Vec::new();
        messages(file.path(), |message| {
            told.push(message.map(drop));
            Ok(())
        })
        .unwrap();
        assert_eq!(told, [Err("a piece of it is of no known kind".to_owned())]);
    }

    #[test]
    fn a_piece_longer_than_the_file_ends_what_is_read_and_is_told() {
        let whole = include_bytes!("../../sessions/example/recording.rrd");
        let mut file = tempfile::NamedTempFile::new().unwrap();
        // The length of the second piece.
        let length = |at: u64| u64::from_le_bytes(*whole[usize::try_from(at).unwrap()..].first_chunk().unwrap());
        let second = STREAM_HEADER + PIECE_HEADER + length(STREAM_HEADER + 8);
        let mut bytes = whole.to_vec();
        bytes[usize::try_from(second).unwrap() + 14] ^= 1;
        file.write_all(&bytes).unwrap();
        let size = bytes.len() as u64;
        let damage = "a piece of it says that it is longer than the file";
        assert_eq!(end_of(file.as_file_mut(), size).unwrap(), End::Damaged(second, damage));
        let mut told = Vec::new();
        messages(file.path(), |message| {
            told.push(message.map(drop));
            Ok(())
        })
        .unwrap();
        assert_eq!(told, [Ok(()), Err(damage.to_owned())]);
    }
}
