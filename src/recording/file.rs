//! Files of recordings. They are written whole, and replaced only when the new one is on disk.

use std::fs::{self, File};
use std::io::Read as _;
use std::path::{Path, PathBuf};

use super::{RecordingError, names, rrd};
use crate::session::journal::Line;
use crate::session::plan_summary::PlanSummary;
use crate::store::{self, Links};

/// Name of the recording in a session's folder.
pub const FILE_NAME: &str = "recording.rrd";

/// Prefix and suffix of files that earlier versions left: parts of a recording, and the temporary file through which they were
/// joined.
const OLD_PARTS: [(&str, &str); 2] = [("recording.part-", ".rrd"), (".recording-", ".tmp")];

/// First bytes of every recording of the library.
const MAGIC: &[u8] = b"RRF";
/// Bytes at the beginning that name the program (the library's message about the store comes first).
const HEAD: u64 = 1024;

/// The outcome of [`rebuild`].
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Written {
    pub path: PathBuf,
    pub bytes: usize,
}

/// Makes the recording in `folder` again from the lines of its journal.
///
/// # Errors
/// The file cannot be written; the old one stays as it was.
pub fn rebuild(folder: &Path, lines: &[Line]) -> Result<Written, RecordingError> {
    let path = folder.join(FILE_NAME);
    let bytes = rrd::encode(lines, None)?;
    store::replace_all([(path.clone(), bytes.as_slice())], Links::Refused)?;
    Ok(Written { path, bytes: bytes.len() })
}

/// Writes a recording of these lines to `path`, or of a `plan` through whose poses the arm drives.
///
/// # Errors
/// There are no lines, or the file cannot be written.
pub fn write(path: &Path, lines: &[Line], plan: Option<&PlanSummary>) -> Result<(), RecordingError> {
    Ok(store::replace_bytes(path, &rrd::encode(lines, plan)?)?)
}

/// Returns whether the file at `path` begins like a recording of this program. It only compares bytes: this program never parses a
/// recording.
pub fn is_recording(path: &Path) -> bool {
    let mut head = Vec::new();
    let read = File::open(path).and_then(|file| file.take(HEAD).read_to_end(&mut head));
    let name = names::APPLICATION.as_bytes();
    read.is_ok() && head.starts_with(MAGIC) && head.windows(name.len()).any(|part| part == name)
}

/// Removes the parts of a recording that an earlier version has left in `folder`, and returns their number: [`rebuild`] makes one file
/// of the whole journal. A part that cannot be removed does no harm.
pub fn remove_old_parts(folder: &Path) -> usize {
    let is_old = |name: &str| OLD_PARTS.iter().any(|(begin, end)| name.starts_with(begin) && name.ends_with(end));
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    let old = entries.filter(|entry| entry.file_name().to_str().is_some_and(is_old));
    old.filter(|entry| fs::remove_file(entry.path()).is_ok()).count()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_of_an_earlier_version_are_removed_and_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        for name in ["recording.part-001.rrd", ".recording-x.tmp", "recording.part-of-mine.txt", FILE_NAME] {
            store::replace(&folder.path().join(name), "").unwrap();
        }
        assert_eq!(remove_old_parts(folder.path()), 2);
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 2);
    }
}
