//! Files on disk: reading with errors that name the file, and replacing results atomically.

pub mod session;

use std::fs::{self, File};
use std::io::{self, Read as _, Write as _};
use std::path::{Path, PathBuf};

use thiserror::Error;

/// How the names of files begin that will replace others.
const TEMPORARY: &str = ".trupose-";

/// A file that could not be read or written.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum StoreError {
    /// Reading failed.
    #[error("cannot read '{}'", path.display())]
    Read {
        /// Which file.
        path: PathBuf,
        /// What the system says.
        source: io::Error,
    },
    /// Writing failed; what stood there before is untouched.
    #[error("cannot write '{}' (what was there before is unchanged)", path.display())]
    Write {
        /// Which file.
        path: PathBuf,
        /// What the system says.
        source: io::Error,
    },
}

/// Largest file that is read: a million rows are a tenth of it.
const LARGEST: u64 = 1 << 30;

/// The bytes of a file.
///
/// # Errors
/// It cannot be read.
pub fn read(path: &Path) -> Result<Vec<u8>, StoreError> {
    let read = || -> io::Result<Vec<u8>> {
        let mut bytes = Vec::new();
        // Pipes are welcome, endless devices are not.
        File::open(path)?.take(LARGEST + 1).read_to_end(&mut bytes)?;
        if bytes.len() as u64 > LARGEST {
            return Err(io::Error::new(io::ErrorKind::FileTooLarge, format!("larger than {} MiB", LARGEST >> 20)));
        }
        Ok(bytes)
    };
    read().map_err(|source| StoreError::Read { path: path.to_owned(), source })
}

/// Makes a folder and those above it.
///
/// # Errors
/// It cannot be made.
pub fn create_folder(path: &Path) -> Result<(), StoreError> {
    fs::create_dir_all(path).map_err(|source| StoreError::Write { path: path.to_owned(), source })
}

/// Replaces a file as a whole: the new text is written beside it, forced to disk, and renamed over it.
///
/// # Errors
/// Any step failed; the old file is then still there.
pub fn replace(path: &Path, text: &str) -> Result<(), StoreError> {
    replace_bytes(path, text.as_bytes())
}

/// As [`replace`], for what may be no UTF-8.
///
/// # Errors
/// Any step failed; the old file is then still there.
pub fn replace_bytes(path: &Path, bytes: &[u8]) -> Result<(), StoreError> {
    let written = || -> io::Result<()> {
        let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or_else(|| Path::new("."));
        let mut file = temporary().prefix(TEMPORARY).tempfile_in(folder)?;
        file.write_all(bytes)?;
        file.as_file().sync_all()?;
        file.persist(path).map_err(|failed| failed.error)?;
        // The rename itself must survive a power cut.
        File::open(folder)?.sync_all()
    };
    written().map_err(|source| StoreError::Write { path: path.to_owned(), source })
}

/// Temporary files that will be results: not private as the library's are, but for whom the process allows it.
pub(crate) fn temporary<'a>() -> tempfile::Builder<'a, 'a> {
    #[cfg_attr(not(unix), expect(unused_mut, reason = "only Unix has modes"))]
    let mut builder = tempfile::Builder::new();
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt as _;
        builder.permissions(fs::Permissions::from_mode(0o666));
    }
    builder
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn replacing_keeps_either_the_old_or_the_new_text() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("result.ron");
        replace(&path, "one").unwrap();
        replace(&path, "two").unwrap();
        assert_eq!(read(&path).unwrap(), b"two");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[test]
    fn a_missing_folder_is_named() {
        let error = replace(Path::new("/nowhere/at/all.ron"), "text").unwrap_err();
        assert_eq!(error.to_string(), "cannot write '/nowhere/at/all.ron' (what was there before is unchanged)");
    }
}
