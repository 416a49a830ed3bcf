//! The folder of a session on disk: its lock, its journal, its result files.
//!
//! A line of the journal counts once it is written **and** forced to disk. A write that fails part-way (full disk, broken
//! medium) is cut off again, so that the next try continues from whole lines; if even that fails, the next try begins with it,
//! and a reader drops the torn end.

use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::{self, Seek as _, SeekFrom, Write as _};
use std::path::{Path, PathBuf};

use thiserror::Error;

use super::{StoreError, TEMPORARY, create_folder, read, replace};
use crate::session::journal::{self, FILE_NAME, Journal, JournalError, Line, Sum};

/// Name of the file whose lock says that a program works in the folder.
const LOCK_NAME: &str = ".lock";

/// What is said where the journal does not end as this program has left it.
const FOREIGN: &str = "another program has written to this session; nothing is written here any more: end both programs, and \
                       look with 'trupose session show' what the journal has";

/// What is said where the journal is not the file any more that was opened.
const GONE: &str =
    "the journal was removed or replaced while the session is open; nothing is written to what is left of it";

/// Incomplete ends of the journal are kept as `journal.torn-1`, `journal.torn-2`, …
const TORN_NAME: &str = "journal.torn";

/// Folders of one name are told apart by a number up to this.
const MOST_OF_ONE_NAME: usize = 1000;

/// A session that cannot be opened or written.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum SessionError {
    /// Reading or writing failed.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// The journal cannot be used.
    #[error("'{}'", path.display())]
    Journal {
        /// Which file.
        path: PathBuf,
        /// Why.
        source: JournalError,
    },
    /// Another program works in the folder.
    #[error("session '{}' is open in another program{}", folder.display(), holder(process.as_deref()))]
    Locked {
        /// Which folder.
        folder: PathBuf,
        /// Its process number, if it can be told.
        process: Option<String>,
    },
    /// Not a session.
    #[error("'{}' is not a session: it has no {FILE_NAME}", folder.display())]
    NotASession {
        /// Which folder.
        folder: PathBuf,
    },
}

fn holder(process: Option<&str>) -> String {
    process.map_or_else(String::new, |process| format!(" (process {process})"))
}

/// Something that a journal is written to.
pub trait Medium {
    /// Writes at the end.
    ///
    /// # Errors
    /// Nothing, a part or all may have been written.
    fn append(&mut self, bytes: &[u8]) -> io::Result<()>;

    /// Forces everything to disk.
    ///
    /// # Errors
    /// It may not be there.
    fn sync(&mut self) -> io::Result<()>;

    /// Bytes that are there.
    ///
    /// # Errors
    /// It cannot be told.
    fn length(&mut self) -> io::Result<u64>;

    /// Cuts everything behind the first `length` bytes off.
    ///
    /// # Errors
    /// It may still be there.
    fn cut(&mut self, length: u64) -> io::Result<()>;
}

impl Medium for File {
    fn append(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.seek(SeekFrom::End(0))?;
        self.write_all(bytes)
    }

    fn sync(&mut self) -> io::Result<()> {
        self.sync_data()
    }

    fn length(&mut self) -> io::Result<u64> {
        self.metadata().map(|found| found.len())
    }

    fn cut(&mut self, length: u64) -> io::Result<()> {
        self.set_len(length)
    }
}

/// Writes a journal line by line.
#[derive(Debug)]
pub struct JournalWriter<M> {
    medium: M,
    sum: Sum,
    length: u64,
    /// Bytes behind `length` may be there from a write that failed.
    torn: bool,
    /// Where the medium ends as this writer has left it; `None`: it could not be told.
    end: Option<u64>,
}

impl<M: Medium> JournalWriter<M> {
    /// Goes on after the complete lines of `journal`, which `medium` holds.
    pub fn after(medium: M, journal: &Journal) -> Self {
        let (length, torn) = (journal.good_bytes as u64, journal.torn_bytes as u64);
        Self { medium, sum: journal.sum.clone(), length, torn: torn > 0, end: Some(length + torn) }
    }

    /// Writes lines and forces them to disk: all of them count, or none.
    ///
    /// # Errors
    /// None of the lines counts; a later try may succeed. Where another program has written, nothing is written or cut off.
    pub fn append(&mut self, lines: &[Line]) -> io::Result<()> {
        let mut text = String::new();
        let mut sum = self.sum.clone();
        for line in lines {
            let (encoded, next) = journal::encode(line, &sum).map_err(io::Error::other)?;
            text.push_str(&encoded);
            sum = next;
        }
        let end = self.medium.length()?;
        if self.end.is_some_and(|own| own != end) {
            return Err(io::Error::other(FOREIGN));
        }
        if self.torn {
            self.medium.cut(self.length)?;
            self.torn = false;
        }
        match self.medium.append(text.as_bytes()).and_then(|()| self.medium.sync()) {
            Ok(()) => {
                self.sum = sum;
                self.length += text.len() as u64;
                self.end = Some(self.length);
                Ok(())
            }
            Err(error) => {
                self.torn = self.medium.cut(self.length).and_then(|()| self.medium.sync()).is_err();
                self.end = self.medium.length().ok();
                Err(error)
            }
        }
    }

    /// What it is written to.
    pub const fn medium(&self) -> &M {
        &self.medium
    }
}

/// A session's folder, held by this process.
#[derive(Debug)]
pub struct SessionFolder {
    folder: PathBuf,
    writer: JournalWriter<File>,
    /// Keeps the lock for as long as the folder is held.
    _lock: File,
}

impl SessionFolder {
    /// Makes a folder `name` in `root`, or `name-2`, `name-3`, … if that is taken.
    ///
    /// # Errors
    /// It cannot be made or written.
    pub fn create(root: &Path, name: &str) -> Result<Self, SessionError> {
        create_folder(root)?;
        let name_of = |number: usize| if number == 1 { name.to_owned() } else { format!("{name}-{number}") };
        let mut number = 1;
        let folder = loop {
            let folder = root.join(name_of(number));
            match fs::create_dir(&folder) {
                Ok(()) => break folder,
                Err(error) if error.kind() == io::ErrorKind::AlreadyExists && number < MOST_OF_ONE_NAME => number += 1,
                Err(source) => return Err(StoreError::Write { path: folder, source }.into()),
            }
        };
        Self::begin(root, &folder).inspect_err(|_error| {
            // Nothing was measured there: a second try on a full disk must not find the name taken by what the first has left.
            for file in [FILE_NAME, LOCK_NAME] {
                drop(fs::remove_file(folder.join(file)));
            }
            drop(fs::remove_dir(&folder));
        })
    }

    /// Takes hold of a folder that was just made, with an empty journal.
    fn begin(root: &Path, folder: &Path) -> Result<Self, SessionError> {
        let lock = lock(folder)?;
        let path = folder.join(FILE_NAME);
        let failed = |source| StoreError::Write { path: path.clone(), source };
        let file = OpenOptions::new().read(true).write(true).create_new(true).open(&path).map_err(failed)?;
        lock_journal(&file, folder, &path)?;
        // The new names themselves must survive a power cut.
        for place in [folder, root] {
            File::open(place).and_then(|place| place.sync_all()).map_err(failed)?;
        }
        Ok(Self { folder: folder.to_owned(), writer: JournalWriter::after(file, &Journal::default()), _lock: lock })
    }

    /// Opens an existing folder to go on with its session.
    ///
    /// # Errors
    /// Not a session, held by another program, not readable or writable, or damaged.
    pub fn open(folder: &Path) -> Result<(Self, Journal), SessionError> {
        let path = folder.join(FILE_NAME);
        if !path.is_file() {
            return Err(SessionError::NotASession { folder: folder.to_owned() });
        }
        let lock = lock(folder)?;
        let file = OpenOptions::new()
            .read(true)
            .write(true)
            .open(&path)
            .map_err(|source| StoreError::Write { path: path.clone(), source })?;
        lock_journal(&file, folder, &path)?;
        let bytes = read(&path)?;
        let journal = journal::read(&bytes).map_err(|source| SessionError::Journal { path: path.clone(), source })?;
        if journal.torn_bytes > 0 {
            set_aside(folder, bytes.get(journal.good_bytes..).unwrap_or_default());
        }
        remove_leftovers(folder);
        let writer = JournalWriter::after(file, &journal);
        Ok((Self { folder: folder.to_owned(), writer, _lock: lock }, journal))
    }

    /// Where it is.
    pub fn path(&self) -> &Path {
        &self.folder
    }

    /// Writes lines of the journal and forces them to disk: all of them count, or none.
    ///
    /// # Errors
    /// None of the lines counts.
    pub fn append(&mut self, lines: &[Line]) -> Result<(), StoreError> {
        let path = self.folder.join(FILE_NAME);
        let written = match is_same(self.writer.medium(), &path) {
            Ok(true) => self.writer.append(lines),
            Ok(false) => Err(io::Error::other(GONE)),
            Err(error) => Err(error),
        };
        written.map_err(|source| StoreError::Write { path, source })
    }

    /// Replaces a result file.
    ///
    /// # Errors
    /// What stood there before is still there.
    pub fn replace(&self, name: &str, text: &str) -> Result<(), StoreError> {
        replace(&self.folder.join(name), text)
    }
}

/// The journal of a session, without holding its folder.
///
/// # Errors
/// Not a session, not readable, or damaged.
pub fn read_journal(folder: &Path) -> Result<Journal, SessionError> {
    let path = folder.join(FILE_NAME);
    if !path.is_file() {
        return Err(SessionError::NotASession { folder: folder.to_owned() });
    }
    let bytes = read(&path)?;
    journal::read(&bytes).map_err(|source| SessionError::Journal { path, source })
}

/// The folders below `root` that hold a journal, by name.
///
/// # Errors
/// `root` cannot be read.
pub fn folders(root: &Path) -> Result<Vec<PathBuf>, StoreError> {
    let failed = |source| StoreError::Read { path: root.to_owned(), source };
    let entries = fs::read_dir(root).map_err(failed)?;
    let mut found = Vec::new();
    for entry in entries {
        let path = entry.map_err(failed)?.path();
        if path.join(FILE_NAME).is_file() {
            found.push(path);
        }
    }
    found.sort();
    Ok(found)
}

/// Removes what a program that died while it replaced a file has left. Only for who holds the folder; it may stay if it must.
fn remove_leftovers(folder: &Path) {
    let Ok(entries) = fs::read_dir(folder) else { return };
    for entry in entries.flatten() {
        if entry.file_name().to_string_lossy().starts_with(TEMPORARY) {
            drop(fs::remove_file(entry.path()));
        }
    }
}

/// Keeps a copy of what is about to be cut off the journal. It was never acknowledged; where there is no room, it goes.
fn set_aside(folder: &Path, torn: &[u8]) {
    let taken = |path: &PathBuf| path.exists();
    let name = |number: usize| folder.join(format!("{TORN_NAME}-{number}"));
    let Some(path) = (1..=MOST_OF_ONE_NAME).map(name).find(|path| !taken(path)) else { return };
    drop(OpenOptions::new().write(true).create_new(true).open(path).and_then(|mut file| file.write_all(torn)));
}

/// Takes the lock of a folder; the system gives it back when the process ends, however it ends.
fn lock(folder: &Path) -> Result<File, SessionError> {
    let path = folder.join(LOCK_NAME);
    let failed = |source| StoreError::Write { path: path.clone(), source };
    let mut file =
        OpenOptions::new().read(true).write(true).create(true).truncate(false).open(&path).map_err(failed)?;
    match file.try_lock() {
        Ok(()) => {}
        Err(TryLockError::WouldBlock) => {
            let process = fs::read_to_string(&path).ok().map(|text| text.trim().to_owned());
            let process = process.filter(|text| !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit()));
            return Err(SessionError::Locked { folder: folder.to_owned(), process });
        }
        Err(TryLockError::Error(source)) => return Err(failed(source).into()),
    }
    // Who holds it is a help for people only: a full disk must not keep anybody from resuming.
    drop(file.set_len(0).and_then(|()| writeln!(file, "{}", std::process::id())));
    Ok(file)
}

/// Takes the lock of the journal itself: that of the folder is gone where somebody removes its file.
fn lock_journal(file: &File, folder: &Path, path: &Path) -> Result<(), SessionError> {
    if !cfg!(unix) {
        // Elsewhere who locks a file keeps others from reading it.
        return Ok(());
    }
    match file.try_lock() {
        Ok(()) => Ok(()),
        Err(TryLockError::WouldBlock) => Err(SessionError::Locked { folder: folder.to_owned(), process: None }),
        Err(TryLockError::Error(source)) => Err(StoreError::Write { path: path.to_owned(), source }.into()),
    }
}

/// Whether `path` still is the file that was opened.
fn is_same(file: &File, path: &Path) -> io::Result<bool> {
    let found = match fs::metadata(path) {
        Ok(found) => found,
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(false),
        Err(error) => return Err(error),
    };
    #[cfg(unix)]
    {
        use std::os::unix::fs::MetadataExt as _;
        let own = file.metadata()?;
        Ok((own.dev(), own.ino()) == (found.dev(), found.ino()))
    }
    #[cfg(not(unix))]
    Ok(file.metadata()?.len() == found.len())
}

#[cfg(test)]
mod tests;
