//! Files on disk: reading with errors that name the file, and atomic replacement of results.

pub mod session;

use std::fs::{self, File, OpenOptions};
use std::io::{self, Read as _, Write as _};
use std::path::{Path, PathBuf};

use thiserror::Error;

/// Prefix of temporary files that will replace others.
const TEMPORARY: &str = ".trupose-";

/// A file that could not be read or written.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum StoreError {
    /// Reading failed.
    #[error("cannot read '{}'", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// Error of the system.
        source: io::Error,
    },
    /// Writing failed; the previous file is unchanged.
    #[error("cannot write '{}' (the previous file is unchanged)", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// Error of the system.
        source: io::Error,
    },
    /// Some of several files were replaced, the others are unchanged.
    #[error(
        "only a part of the files was written: {} new, {} NOT written",
        listed_or_none(written),
        listed_or_none(missing)
    )]
    Partly {
        /// Names of the files that were replaced.
        written: Vec<String>,
        /// Names of the files that were not.
        missing: Vec<String>,
        /// Error of the system.
        source: io::Error,
    },
    /// A link, a folder or a device where a session's own file belongs.
    #[error("'{}' is not a file but a link, a folder or a device; inside a session's folder nothing is written through it", path.display())]
    NotOwn { path: PathBuf },
    /// Writing to a device or pipe failed.
    #[error("cannot write to '{}'", path.display())]
    Into {
        /// Path of the device or pipe.
        path: PathBuf,
        /// Error of the system.
        source: io::Error,
    },
}

fn listed_or_none(names: &[String]) -> String {
    if names.is_empty() { "none".to_owned() } else { names.join(", ") }
}

/// What happens with links where files are replaced.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Links {
    /// The file behind a link is replaced, and a device or pipe is written to: the user has named the path.
    Followed,
    /// They are refused: the path is inside a folder that may come from elsewhere.
    Refused,
}

/// Largest file that is read (bytes): several times the largest table.
const LARGEST: u64 = 256 << 20;

/// Reads a file.
///
/// # Errors
/// It cannot be read, or is too large.
pub fn read(path: &Path) -> Result<Vec<u8>, StoreError> {
    let read = || -> io::Result<Vec<u8>> {
        let too_large = || io::Error::new(io::ErrorKind::FileTooLarge, format!("larger than {} MiB", LARGEST >> 20));
        let file = File::open(path)?;
        // A file tells its length, so that its bytes need not be in memory first.
        if file.metadata()?.len() > LARGEST {
            return Err(too_large());
        }
        let mut bytes = Vec::new();
        // The limit allows pipes but stops at endless devices.
        file.take(LARGEST + 1).read_to_end(&mut bytes)?;
        if bytes.len() as u64 > LARGEST { Err(too_large()) } else { Ok(bytes) }
    };
    read().map_err(|source| StoreError::Read { path: path.to_owned(), source })
}

/// The names that a path begun can be completed to, folders with a slash, in order; and the longest beginning that they share.
/// A folder that cannot be read has none.
pub fn completions(begun: &str) -> (String, Vec<String>) {
    let (folder, name) = begun.rfind('/').map_or(("", begun), |slash| begun.split_at(slash + 1));
    let folder_path = if folder.is_empty() { Path::new(".") } else { Path::new(folder) };
    let entries = fs::read_dir(folder_path).map(|entries| entries.filter_map(Result::ok).collect()).unwrap_or_default();
    let entries: Vec<fs::DirEntry> = entries;
    let mut names: Vec<String> = entries
        .iter()
        .filter_map(|entry| {
            let text = entry.file_name().into_string().ok()?;
            // Hidden files are offered to those who ask for them.
            let is_meant = text.starts_with(name) && (!text.starts_with('.') || name.starts_with('.'));
            let end = if entry.path().is_dir() { "/" } else { "" };
            is_meant.then(|| format!("{text}{end}"))
        })
        .collect();
    names.sort_unstable();
    let shared = names.iter().skip(1).fold(names.first().cloned(), |shared, next| {
        let shared: String = shared?.chars().zip(next.chars()).take_while(|(a, b)| a == b).map(|(a, _)| a).collect();
        Some(shared)
    });
    (shared.map_or_else(|| begun.to_owned(), |shared| format!("{folder}{shared}")), names)
}

/// Creates a folder and its parents.
///
/// # Errors
/// It cannot be created.
pub fn create_folder(path: &Path) -> Result<(), StoreError> {
    fs::create_dir_all(path).map_err(|source| StoreError::Write { path: path.to_owned(), source })
}

/// Replaces a file as a whole: the new text is written to a temporary file in the same folder, synced to disk and renamed. For a
/// symbolic link, its target is replaced. A device or pipe (such as `/dev/stdout`) is written to directly.
///
/// # Errors
/// A step failed; the old file is unchanged.
pub fn replace(path: &Path, text: &str) -> Result<(), StoreError> {
    replace_bytes(path, text.as_bytes())
}

/// Replaces several files. All of them are written beside the old ones and synced first, so that a full disk leaves every old file
/// as it was.
///
/// # Errors
/// All old files are unchanged, or [`StoreError::Partly`] says which.
pub fn replace_all<'a>(files: impl IntoIterator<Item = (PathBuf, &'a [u8])>, links: Links) -> Result<(), StoreError> {
    let staged =
        files.into_iter().map(|(path, bytes)| Staged::new(path, bytes, links)).collect::<Result<Vec<_>, _>>()?;
    let mut waiting = staged.into_iter();
    let mut written = Vec::new();
    while let Some(staged) = waiting.next() {
        let path = staged.path.clone();
        match staged.commit() {
            Ok(()) => written.push(name_of(&path)),
            Err(error) if written.is_empty() && waiting.len() == 0 => return Err(error),
            Err(StoreError::Write { source, .. } | StoreError::Into { source, .. }) => {
                let missing = std::iter::once(name_of(&path)).chain(waiting.map(|staged| name_of(&staged.path)));
                return Err(StoreError::Partly { written, missing: missing.collect(), source });
            }
            Err(error) => return Err(error),
        }
    }
    Ok(())
}

fn name_of(path: &Path) -> String {
    path.file_name().map_or_else(|| path.display().to_string(), |name| name.to_string_lossy().into_owned())
}

/// A file that is about to be replaced.
struct Staged<'a> {
    path: PathBuf,
    bytes: &'a [u8],
    to: Destination,
    /// The new file beside the old one, on disk.
    temporary: Option<tempfile::NamedTempFile>,
}

impl<'a> Staged<'a> {
    fn new(path: PathBuf, bytes: &'a [u8], links: Links) -> Result<Self, StoreError> {
        let failed = |source| StoreError::Write { path: path.clone(), source };
        let to = match links {
            Links::Followed => destination(&path).map_err(failed)?,
            Links::Refused => match fs::symlink_metadata(&path) {
                Ok(found) if !found.is_file() => return Err(StoreError::NotOwn { path }),
                _ => Destination::File(path.clone()),
            },
        };
        let temporary = match &to {
            Destination::File(file) => Some(beside(file, bytes).map_err(failed)?),
            Destination::Other(_) | Destination::Out | Destination::Err => None,
        };
        Ok(Self { path, bytes, to, temporary })
    }

    fn commit(self) -> Result<(), StoreError> {
        let Self { path, bytes, to, temporary } = self;
        let into = |written: io::Result<()>| written.map_err(|source| StoreError::Into { path: path.clone(), source });
        match to {
            Destination::File(file) => put(temporary, &file).map_err(|source| StoreError::Write { path, source }),
            Destination::Other(place) => {
                into(OpenOptions::new().append(true).open(place).and_then(|mut file| file.write_all(bytes)))
            }
            Destination::Out => into(write_out(io::stdout().lock(), bytes)),
            Destination::Err => into(write_out(io::stderr().lock(), bytes)),
        }
    }
}

/// As [`replace`], for bytes.
///
/// # Errors
/// A step failed; the old file is unchanged.
pub fn replace_bytes(path: &Path, bytes: &[u8]) -> Result<(), StoreError> {
    replace_all([(path.to_owned(), bytes)], Links::Followed)
}

fn write_out(mut out: impl io::Write, bytes: &[u8]) -> io::Result<()> {
    out.write_all(bytes).and_then(|()| out.flush())
}

fn folder_of(path: &Path) -> &Path {
    path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or_else(|| Path::new("."))
}

/// A temporary file with these bytes, synced, in the folder of `path`.
fn beside(path: &Path, bytes: &[u8]) -> io::Result<tempfile::NamedTempFile> {
    let mut file = temporary().tempfile_in(folder_of(path))?;
    file.write_all(bytes)?;
    file.as_file().sync_all()?;
    Ok(file)
}

/// Renames a temporary file to `path`.
fn put(temporary: Option<tempfile::NamedTempFile>, path: &Path) -> io::Result<()> {
    let Some(file) = temporary else { return Ok(()) };
    file.persist(path).map_err(|failed| failed.error)?;
    // Sync the folder too, so that the rename survives a power cut.
    File::open(folder_of(path))?.sync_all()
}

/// What a path refers to.
#[derive(Clone, Debug, PartialEq, Eq)]
enum Destination {
    /// An existing or new file; not a link.
    File(PathBuf),
    /// A device, a pipe or an open file of this process, which must not be replaced by a file.
    Other(PathBuf),
    /// Standard output. It must not be opened again, because that would overwrite earlier output.
    Out,
    /// Standard error.
    Err,
}

/// Most symbolic links that are followed; the system has the same limit.
const MOST_LINKS: usize = 40;

/// Resolves `path` link by link, because a link may lead to a file that does not exist yet.
fn destination(path: &Path) -> io::Result<Destination> {
    let mut current = path.to_owned();
    for _ in 0..MOST_LINKS {
        if let Some(open) = open_file(&current) {
            return Ok(open);
        }
        match fs::symlink_metadata(&current) {
            Ok(found) if found.is_symlink() => {
                let folder = current.parent().map_or_else(PathBuf::new, Path::to_owned);
                current = folder.join(fs::read_link(&current)?);
            }
            Ok(found) if found.is_file() || found.is_dir() => return Ok(Destination::File(current)),
            Ok(_) => return Ok(Destination::Other(current)),
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(Destination::File(current)),
            Err(error) => return Err(error),
        }
    }
    Err(io::Error::other("too many symbolic links, or they lead in a circle"))
}

/// Resolves paths of open files of this process, such as `/dev/fd/1` or `/proc/self/fd/1`.
fn open_file(path: &Path) -> Option<Destination> {
    let (folder, name) = (path.parent()?, path.file_name()?.to_str()?);
    let own = format!("/proc/{}/fd", std::process::id());
    let is_of_this =
        ["/dev/fd", "/proc/self/fd", "/proc/thread-self/fd", &own].iter().any(|own| folder == Path::new(own));
    match name {
        _ if !is_of_this || !name.bytes().all(|byte| byte.is_ascii_digit()) => None,
        "1" => Some(Destination::Out),
        "2" => Some(Destination::Err),
        _ => Some(Destination::Other(path.to_owned())),
    }
}

/// Bytes that can still be written to the disk of `folder`; `None` where the system cannot tell.
pub fn free_bytes(folder: &Path) -> Option<u64> {
    #[cfg(unix)]
    {
        let disk = rustix::fs::statvfs(folder).ok()?;
        Some(disk.f_bavail.saturating_mul(disk.f_frsize))
    }
    #[cfg(not(unix))]
    {
        let _unknown = folder;
        None
    }
}

/// Builder of temporary files that become results. The library makes them private; these get the usual permissions of the process.
fn temporary<'a>() -> tempfile::Builder<'a, 'a> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(TEMPORARY);
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
    fn paths_are_completed_as_far_as_they_are_certain() {
        let folder = tempfile::tempdir().unwrap();
        let inside = |name: &str| format!("{}/{name}", folder.path().display());
        for name in ["plan.csv", "plan-2.csv", ".hidden", "other.csv"] {
            replace(Path::new(&inside(name)), "").unwrap();
        }
        fs::create_dir(inside("programs")).unwrap();
        let (text, names) = completions(&inside("pl"));
        assert_eq!((text, names), (inside("plan"), vec!["plan-2.csv".to_owned(), "plan.csv".to_owned()]));
        assert_eq!(completions(&inside("pr")), (inside("programs/"), vec!["programs/".to_owned()]));
        assert_eq!(completions(&inside("")).1, ["other.csv", "plan-2.csv", "plan.csv", "programs/"]);
        assert_eq!(completions(&inside(".h")).0, inside(".hidden"));
        assert_eq!(completions(&inside("none/x")), (inside("none/x"), Vec::new()));
    }

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
    fn what_was_written_of_several_files_and_what_was_not_is_said() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        replace(&at("c"), "old").unwrap();
        fs::create_dir_all(at("b/inside")).unwrap();
        let files = ["a", "b", "c"].map(|name| (at(name), b"new".as_slice()));
        let error = replace_all(files, Links::Followed).unwrap_err();
        assert_eq!(error.to_string(), "only a part of the files was written: a new, b, c NOT written");
        assert_eq!((read(&at("a")).unwrap(), read(&at("c")).unwrap()), (b"new".to_vec(), b"old".to_vec()));
        let left = fs::read_dir(folder.path()).unwrap().count();
        assert_eq!(left, 3, "no temporary file is left");
        // Where that is seen before anything is replaced, nothing is.
        replace(&at("a"), "old").unwrap();
        let files = ["a", "b"].map(|name| (at(name), b"new".as_slice()));
        assert!(matches!(replace_all(files, Links::Refused), Err(StoreError::NotOwn { .. })));
        assert_eq!(read(&at("a")).unwrap(), b"old");
    }

    #[cfg(unix)]
    #[test]
    fn links_stay_and_the_files_behind_them_are_replaced() {
        use std::os::unix::fs::symlink;
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        create_folder(&at("elsewhere")).unwrap();
        replace(&at("elsewhere/real"), "old").unwrap();
        symlink("elsewhere/real", at("near")).unwrap();
        symlink(at("near"), at("far")).unwrap();
        symlink("elsewhere/new", at("dangling")).unwrap();
        symlink("circle", at("circle")).unwrap();
        for (link, file) in [("near", "elsewhere/real"), ("far", "elsewhere/real"), ("dangling", "elsewhere/new")] {
            replace(&at(link), link).unwrap();
            assert!(fs::symlink_metadata(at(link)).unwrap().is_symlink(), "{link}");
            assert!(fs::symlink_metadata(at(file)).unwrap().is_file(), "{file}");
            assert_eq!(read(&at(file)).unwrap(), link.as_bytes());
        }
        assert_eq!(fs::read_dir(at("elsewhere")).unwrap().count(), 2);
        let error = replace(&at("circle"), "text").unwrap_err();
        assert!(std::error::Error::source(&error).unwrap().to_string().contains("in a circle"), "{error}");
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn devices_and_pipes_stay_what_they_are_and_tell_errors() {
        use std::os::unix::fs::FileTypeExt as _;
        let is_device = |path: &str| fs::metadata(path).unwrap().file_type().is_char_device();
        replace(Path::new("/dev/null"), "text").unwrap();
        let error = replace(Path::new("/dev/full"), "text").unwrap_err();
        assert_eq!(error.to_string(), "cannot write to '/dev/full'");
        assert!(std::error::Error::source(&error).unwrap().to_string().contains("No space left"));
        assert!(is_device("/dev/null") && is_device("/dev/full"));
        let folder = tempfile::tempdir().unwrap();
        let pipe = folder.path().join("pipe");
        assert!(std::process::Command::new("mkfifo").arg(&pipe).status().unwrap().success());
        let reader = {
            let pipe = pipe.clone();
            std::thread::Builder::new().spawn(move || read(&pipe).unwrap()).unwrap()
        };
        replace(&pipe, "through a pipe").unwrap();
        assert_eq!(reader.join().unwrap(), b"through a pipe");
        assert!(fs::metadata(&pipe).unwrap().file_type().is_fifo());
    }

    #[test]
    fn open_files_of_this_process_are_not_replaced() {
        let own = format!("/proc/{}/fd/2", std::process::id());
        for (path, expected) in [
            ("/dev/fd/1", Some(Destination::Out)),
            ("/proc/self/fd/1", Some(Destination::Out)),
            (own.as_str(), Some(Destination::Err)),
            ("/dev/fd/7", Some(Destination::Other("/dev/fd/7".into()))),
            ("/dev/fd/x", None),
            ("/tmp/fd/1", None),
            ("1", None),
        ] {
            assert_eq!(open_file(Path::new(path)), expected, "{path}");
        }
        #[cfg(target_os = "linux")]
        assert_eq!(destination(Path::new("/dev/stdout")).unwrap(), Destination::Out);
    }

    #[test]
    fn a_missing_folder_is_named() {
        let error = replace(Path::new("/nowhere/at/all.ron"), "text").unwrap_err();
        assert_eq!(error.to_string(), "cannot write '/nowhere/at/all.ron' (the previous file is unchanged)");
    }
}
