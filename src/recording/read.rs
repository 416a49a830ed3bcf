//! Reads recordings, also those that a crash left half-written.

use std::cell::Cell;
use std::collections::BTreeMap;
use std::fs::File;
use std::io::BufReader;
use std::panic::{self, AssertUnwindSafe};
use std::path::Path;
use std::sync::Once;

use rerun::external::re_log_encoding::DecoderApp;
use rerun::external::re_log_encoding::rrd::DecodeError;
use rerun::log::{Chunk, LogMsg};
use rerun::{TextDocument, TimelineName};

use super::{RecordingError, names};
use crate::session::journal::{self, Journal};

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

/// Gives all messages of the file at `path` to `take`, and what is wrong with those that are damaged.
///
/// # Errors
/// The file cannot be read, or `take` refuses.
pub(super) fn messages(
    path: &Path,
    mut take: impl FnMut(Result<LogMsg, String>) -> Result<(), RecordingError>,
) -> Result<(), RecordingError> {
    let failed = |source| RecordingError::file("cannot read the recording", path, source);
    let mut messages = DecoderApp::decode_lazy(BufReader::new(File::open(path).map_err(failed)?));
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
