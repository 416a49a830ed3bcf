//! Reads recordings, also those that a crash left half-written.

use std::cell::Cell;
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, BufReader, Read as _, Seek as _, SeekFrom};
use std::panic::{self, AssertUnwindSafe};
use std::path::Path;
use std::sync::Once;

use rerun::external::re_log_encoding::DecoderApp;
use rerun::external::re_log_encoding::rrd::DecodeError;
use rerun::log::{Chunk, LogMsg};
use rerun::{TextDocument, TimelineName};

use super::{RecordingError, names};
use crate::session::journal::{self, Journal};

/// Bytes before the first piece of a file.
const STREAM_HEADER: u64 = 12;
/// Bytes that say kind and length of a piece.
const PIECE_HEADER: u64 = 16;
/// Kind of the last piece, before the index.
const LAST_PIECE: u64 = 0;
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
    let (lines, damaged) = journal_lines(path)?;
    recording.damaged = damaged;
    if let Some((last, _)) = lines.last_key_value() {
        recording.missing = (1..=*last).filter(|number| !lines.contains_key(number)).collect();
    }
    recording.numbers = lines.keys().filter_map(|number| u64::try_from(*number).ok()).collect();
    // Lines behind a gap cannot be checked.
    let whole = recording.missing.first().copied().unwrap_or(i64::MAX);
    recording.journal = lines.range(..whole).flat_map(|(_, text)| text.bytes()).collect();
    Ok(recording)
}

/// Numbers of the journal lines in the recording at `path`, and how many messages could not be read.
pub(super) fn line_numbers(path: &Path) -> Result<(Vec<i64>, usize), RecordingError> {
    let (lines, damaged) = journal_lines(path)?;
    Ok((lines.into_keys().collect(), damaged))
}

fn journal_lines(path: &Path) -> Result<(BTreeMap<i64, String>, usize), RecordingError> {
    let mut lines: BTreeMap<i64, String> = BTreeMap::new();
    let damaged = chunks(path, |chunk| {
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
    Ok((lines, damaged))
}

/// Gives all chunks of data of the recording at `path` to `take`; returns how many messages could not be read.
pub(super) fn chunks(path: &Path, mut take: impl FnMut(&Chunk)) -> Result<usize, RecordingError> {
    let (mut damaged, mut known) = (0, false);
    messages(path, |message| {
        match message {
            Ok(LogMsg::SetStoreInfo(info)) => {
                let application = info.info.store_id.application_id().to_string();
                if application != names::APPLICATION {
                    let message = format!("it was written by '{}'", plain(&application));
                    return Err(RecordingError::Foreign { path: path.to_owned(), message });
                }
                known = true;
            }
            Ok(LogMsg::ArrowMsg(store, arrow)) if store.is_recording() => {
                // Damaged data may fit together and still break what looks at them.
                let taken = guarded(|| Chunk::from_arrow_msg(&arrow).map(|chunk| take(&chunk)).is_ok());
                damaged += usize::from(taken != Some(true));
            }
            Ok(_) => {}
            Err(message) if !known => return Err(RecordingError::Foreign { path: path.to_owned(), message }),
            Err(_damage) => damaged += 1,
        }
        Ok(())
    })?;
    if known {
        Ok(damaged)
    } else {
        Err(RecordingError::Foreign { path: path.to_owned(), message: "there is nothing in it".to_owned() })
    }
}

/// Bytes before the first piece that says that it is far longer than the file of `size` bytes; `size` if there is none. The
/// library takes memory for as much as a piece says, and the program ends where there is not so much.
fn sound_length(file: &mut File, size: u64) -> io::Result<u64> {
    let mut at = STREAM_HEADER;
    while at + PIECE_HEADER <= size {
        file.seek(SeekFrom::Start(at))?;
        let mut number = || {
            let mut bytes = [0; 8];
            file.read_exact(&mut bytes).map(|()| u64::from_le_bytes(bytes))
        };
        let (kind, length) = (number()?, number()?);
        if kind == LAST_PIECE {
            break;
        }
        // The last piece of a file that is being written may be cut.
        if length > size.saturating_add(ROOM) {
            return Ok(at);
        }
        at += PIECE_HEADER + length;
    }
    Ok(size)
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
    let sound = sound_length(&mut file, size).map_err(failed)?;
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
            None if sound < size => return take(Err("a piece of it says that it is longer than the file".to_owned())),
            None => return Ok(()),
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
        assert_eq!(sound_length(file.as_file_mut(), size).unwrap(), second);
        let mut told = Vec::new();
        messages(file.path(), |message| {
            told.push(message.map(drop));
            Ok(())
        })
        .unwrap();
        assert_eq!(told, [Ok(()), Err("a piece of it says that it is longer than the file".to_owned())]);
    }
}
