//! The folder of a session on disk: its lock, its journal and its result files.
//!
//! A line of the journal counts once it is written **and** synced to disk. After a partial write (full disk, failing disk) the
//! incomplete part is cut off again, so that the next attempt continues after complete lines. If that fails too, the next attempt
//! starts with it, and a reader drops the incomplete end.

use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::{self, Read as _, Seek as _, SeekFrom, Write as _};
use std::path::{Path, PathBuf};

use thiserror::Error;

use super::{Links, StoreError, TEMPORARY, create_folder, read, replace_all};
use crate::session::journal::{self, FILE_NAME, Journal, JournalError, Line, Sum};

/// Name of the lock file, which is locked while a program uses the folder.
const LOCK_NAME: &str = ".lock";

/// Message if the end of the journal is not as this program left it.
const FOREIGN: &str = "another program has written to this session, so no more is written here: close both programs, and check \
                       the journal with 'trupose session show'";

/// Message if the journal is no longer the file that was opened.
const GONE: &str = "the journal was removed or replaced while the session was open, so no more is written to it";

/// Name of the copies of incomplete ends of the journal: `journal.torn-1`, `journal.torn-2`, …
const TORN_NAME: &str = "journal.torn";

/// Largest number appended to a name that is taken.
const MOST_OF_ONE_NAME: usize = 1000;

/// Most bytes of a process number in a lock file, line break included.
const LONGEST_NUMBER: u64 = 32;

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
        /// The journal.
        path: PathBuf,
        /// What is wrong with it.
        source: JournalError,
    },
    /// Another program uses the folder.
    #[error("session '{}' is open in another program{}", folder.display(), holder(process.as_deref()))]
    Locked {
        folder: PathBuf,
        /// Process number of that program, if it is known.
        process: Option<String>,
    },
    /// The folder is not a session.
    #[error("'{}' is not a session: it has no {FILE_NAME}", folder.display())]
    NotASession { folder: PathBuf },
}

fn holder(process: Option<&str>) -> String {
    process.map_or_else(String::new, |process| format!(" (process {process})"))
}

pub trait JournalStorage {
    /// Appends bytes.
    ///
    /// # Errors
    /// None, some or all of the bytes may have been written.
    fn append(&mut self, bytes: &[u8]) -> io::Result<()>;

    /// Syncs everything to disk.
    ///
    /// # Errors
    /// The bytes may not be on disk.
    fn sync(&mut self) -> io::Result<()>;

    /// Length in bytes.
    ///
    /// # Errors
    /// The length cannot be determined.
    fn length(&mut self) -> io::Result<u64>;

    /// Truncates to `length` bytes.
    ///
    /// # Errors
    /// The rest may still exist.
    fn truncate(&mut self, length: u64) -> io::Result<()>;
}

impl JournalStorage for File {
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

    fn truncate(&mut self, length: u64) -> io::Result<()> {
        self.set_len(length)
    }
}

/// Writes a journal line by line.
#[derive(Debug)]
pub struct JournalWriter<S> {
    storage: S,
    sum: Sum,
    length: u64,
    /// Whether an incomplete write may have left bytes after `length`.
    is_torn: bool,
    /// Length of the storage as this writer left it; `None` if it could not be determined.
    end: Option<u64>,
}

impl<S: JournalStorage> JournalWriter<S> {
    /// Continues after the complete lines of `journal`, which is in `storage`.
    pub fn after(storage: S, journal: &Journal) -> Self {
        let (length, torn) = (journal.good_bytes as u64, journal.torn_bytes as u64);
        Self { storage, sum: journal.sum.clone(), length, is_torn: torn > 0, end: Some(length + torn) }
    }

    /// Writes lines and syncs them to disk: either all of them count, or none.
    ///
    /// # Errors
    /// None of the lines counts; a later attempt may succeed. If another program has written, nothing is written or truncated.
    pub fn append(&mut self, lines: &[Line]) -> io::Result<()> {
        let mut text = String::new();
        let mut sum = self.sum.clone();
        for line in lines {
            let (encoded, next) = journal::encode(line, &sum).map_err(io::Error::other)?;
            text.push_str(&encoded);
            sum = next;
        }
        let end = self.storage.length()?;
        if self.end.is_some_and(|own| own != end) {
            return Err(io::Error::other(FOREIGN));
        }
        if self.is_torn {
            self.storage.truncate(self.length)?;
            self.is_torn = false;
        }
        match self.storage.append(text.as_bytes()).and_then(|()| self.storage.sync()) {
            Ok(()) => {
                self.sum = sum;
                self.length += text.len() as u64;
                self.end = Some(self.length);
                Ok(())
            }
            Err(error) => {
                self.is_torn = self.storage.truncate(self.length).and_then(|()| self.storage.sync()).is_err();
                self.end = self.storage.length().ok();
                Err(error)
            }
        }
    }

    /// The storage of the journal.
    pub const fn storage(&self) -> &S {
        &self.storage
    }
}

/// A session's folder, locked by this process.
#[derive(Debug)]
pub struct SessionFolder {
    folder: PathBuf,
    writer: JournalWriter<File>,
    /// Keeps the folder locked.
    _lock: File,
}

impl SessionFolder {
    /// Creates a folder `name` in `root`, or `name-2`, `name-3`, … if that is taken.
    ///
    /// # Errors
    /// It cannot be created or written.
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
            // Nothing was measured yet. Remove the folder, so that a second attempt on a full disk does not find the name taken.
            for file in [FILE_NAME, LOCK_NAME] {
                drop(fs::remove_file(folder.join(file)));
            }
            drop(fs::remove_dir(&folder));
        })
    }

    /// Locks a new folder and creates an empty journal.
    fn begin(root: &Path, folder: &Path) -> Result<Self, SessionError> {
        let lock = lock(folder)?;
        let path = folder.join(FILE_NAME);
        let failed = |source| StoreError::Write { path: path.clone(), source };
        let file = OpenOptions::new().read(true).write(true).create_new(true).open(&path).map_err(failed)?;
        lock_journal(&file, folder, &path)?;
        // Sync the folders too, so that the new names survive a power cut.
        for parent in [folder, root] {
            File::open(parent).and_then(|parent| parent.sync_all()).map_err(failed)?;
        }
        Ok(Self { folder: folder.to_owned(), writer: JournalWriter::after(file, &Journal::default()), _lock: lock })
    }

    /// Opens an existing folder to continue its session.
    ///
    /// # Errors
    /// Not a session, locked by another program, not readable or writable, or damaged.
    pub fn open(folder: &Path) -> Result<(Self, Journal), SessionError> {
        let path = folder.join(FILE_NAME);
        if !path.is_file() {
            return Err(SessionError::NotASession { folder: folder.to_owned() });
        }
        let lock = lock(folder)?;
        let file = open_own(OpenOptions::new().read(true).write(true), &path)?;
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

    /// Path of the folder.
    pub fn path(&self) -> &Path {
        &self.folder
    }

    /// Writes lines of the journal and syncs them to disk: either all of them count, or none.
    ///
    /// # Errors
    /// None of the lines counts.
    pub fn append(&mut self, lines: &[Line]) -> Result<(), StoreError> {
        let path = self.folder.join(FILE_NAME);
        let written = match is_same(self.writer.storage(), &path) {
            Ok(true) => self.writer.append(lines),
            Ok(false) => Err(io::Error::other(GONE)),
            Err(error) => Err(error),
        };
        written.map_err(|source| StoreError::Write { path, source })
    }

    /// Replaces result files, given by name and text.
    ///
    /// # Errors
    /// The error says whether all of the previous files are unchanged.
    pub fn replace(&self, files: &[(String, String)]) -> Result<(), StoreError> {
        replace_all(files.iter().map(|(name, text)| (self.folder.join(name), text.as_bytes())), Links::Refused)
    }
}

/// A folder that no other program of this kind writes to as long as this value lives.
#[derive(Debug)]
pub struct HeldFolder {
    /// Keeps the folder locked.
    _lock: File,
}

/// Holds the folder of a session to replace result files in it, without opening its journal to write.
///
/// # Errors
/// Another program uses it, or it cannot be locked.
pub fn hold(folder: &Path) -> Result<HeldFolder, SessionError> {
    let lock = lock(folder)?;
    remove_leftovers(folder);
    Ok(HeldFolder { _lock: lock })
}

/// Removes what a killed program left in a session's folder, unless a program uses it now. Errors are ignored, so that a session on
/// a read-only disk can be looked at.
pub fn tidy(folder: &Path) {
    if leftovers(folder).next().is_some() {
        drop(hold(folder));
    }
}

/// Reads the journal of a session without locking its folder.
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

/// The folders in `root` that contain a journal, sorted by name.
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

/// Temporary files of a program that ended while it replaced a file.
fn leftovers(folder: &Path) -> impl Iterator<Item = PathBuf> {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    let is_temporary = |entry: &fs::DirEntry| entry.file_name().to_string_lossy().starts_with(TEMPORARY);
    entries.filter(is_temporary).map(|entry| entry.path())
}

/// Removes temporary files. The folder must be locked. Errors are ignored.
fn remove_leftovers(folder: &Path) {
    leftovers(folder).for_each(|path| drop(fs::remove_file(path)));
}

/// Keeps a copy of the incomplete end before it is cut off. It was never acknowledged, so a failed copy is ignored.
fn set_aside(folder: &Path, torn: &[u8]) {
    let mut names = (1..=MOST_OF_ONE_NAME).map(|number| folder.join(format!("{TORN_NAME}-{number}")));
    // A link counts as taken wherever it leads.
    let Some(path) = names.find(|path| fs::symlink_metadata(path).is_err()) else { return };
    drop(OpenOptions::new().write(true).create_new(true).open(path).and_then(|mut file| file.write_all(torn)));
}

/// Locks a folder. The system releases the lock when the process ends, however it ends.
fn lock(folder: &Path) -> Result<File, SessionError> {
    let path = folder.join(LOCK_NAME);
    let failed = |source| StoreError::Write { path: path.clone(), source };
    let mut file = open_own(OpenOptions::new().read(true).write(true).create(true).truncate(false), &path)?;
    match file.try_lock() {
        Ok(()) => {}
        Err(TryLockError::WouldBlock) => {
            let process = process_in(&mut file).filter(|text| !text.is_empty());
            return Err(SessionError::Locked { folder: folder.to_owned(), process });
        }
        Err(TryLockError::Error(source)) => return Err(failed(source).into()),
    }
    // The process number is only for messages, so a full disk must not prevent resuming. A file with anything else is not ours.
    if process_in(&mut file).is_some() {
        drop(file.set_len(0).and_then(|()| file.rewind()).and_then(|()| writeln!(file, "{}", std::process::id())));
    }
    Ok(file)
}

/// The process number in a lock file, empty in a new one; none if the file holds anything else.
fn process_in(file: &mut File) -> Option<String> {
    let mut text = String::new();
    file.take(LONGEST_NUMBER).read_to_string(&mut text).ok()?;
    let number = text.trim();
    number.bytes().all(|byte| byte.is_ascii_digit()).then(|| number.to_owned())
}

/// Opens a file of a session's folder to write it. A folder may come from elsewhere, so a link in it must not lead the program to
/// another file of the user.
fn open_own(options: &mut OpenOptions, path: &Path) -> Result<File, StoreError> {
    if fs::symlink_metadata(path).is_ok_and(|found| !found.is_file()) {
        return Err(StoreError::NotOwn { path: path.to_owned() });
    }
    #[cfg(unix)]
    {
        use std::os::unix::fs::OpenOptionsExt as _;
        // The check above gives the better message; this one cannot be outrun.
        options.custom_flags(rustix::fs::OFlags::NOFOLLOW.bits().cast_signed());
    }
    options.open(path).map_err(|source| StoreError::Write { path: path.to_owned(), source })
}

/// Locks the journal itself, because the folder's lock is lost if its file is removed.
fn lock_journal(file: &File, folder: &Path, path: &Path) -> Result<(), SessionError> {
    if !cfg!(unix) {
        // On other systems the lock would prevent other programs from reading the journal.
        return Ok(());
    }
    match file.try_lock() {
        Ok(()) => Ok(()),
        Err(TryLockError::WouldBlock) => Err(SessionError::Locked { folder: folder.to_owned(), process: None }),
        Err(TryLockError::Error(source)) => Err(StoreError::Write { path: path.to_owned(), source }.into()),
    }
}

/// Whether `path` is still the file that was opened.
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
