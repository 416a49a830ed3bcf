//! The journal on a medium that fails at any moment, and folders that are held, broken or missing.

#![expect(clippy::disallowed_methods, reason = "test files need no atomic writes")]

use std::cell::RefCell;
use std::rc::Rc;

use jiff::Timestamp;

use super::*;
use crate::session::journal::{Entry, SCHEMA};
use crate::session::set_up::Step;

/// What is on a medium, and what goes wrong with it.
#[derive(Debug, Default)]
struct State {
    bytes: Vec<u8>,
    /// Bytes that still fit in.
    room: usize,
    sync_fails: bool,
    cut_fails: bool,
    syncs: usize,
}

/// A medium that the test can look into.
#[derive(Clone, Debug, Default)]
struct Faulty(Rc<RefCell<State>>);

impl JournalStorage for Faulty {
    fn append(&mut self, bytes: &[u8]) -> io::Result<()> {
        let mut state = self.0.borrow_mut();
        let written = bytes.len().min(state.room);
        state.bytes.extend_from_slice(&bytes[..written]);
        state.room -= written;
        if written == bytes.len() { Ok(()) } else { Err(io::ErrorKind::StorageFull.into()) }
    }

    fn sync(&mut self) -> io::Result<()> {
        let mut state = self.0.borrow_mut();
        state.syncs += 1;
        if state.sync_fails { Err(io::Error::other("medium error")) } else { Ok(()) }
    }

    fn length(&mut self) -> io::Result<u64> {
        Ok(self.0.borrow().bytes.len() as u64)
    }

    fn truncate(&mut self, length: u64) -> io::Result<()> {
        let mut state = self.0.borrow_mut();
        if state.cut_fails {
            return Err(io::Error::other("medium error"));
        }
        let length = usize::try_from(length).unwrap();
        state.room += state.bytes.len().saturating_sub(length);
        state.bytes.truncate(length);
        Ok(())
    }
}

impl Faulty {
    fn set(&self, change: impl FnOnce(&mut State)) {
        change(&mut self.0.borrow_mut());
    }

    fn bytes(&self) -> Vec<u8> {
        self.0.borrow().bytes.clone()
    }
}

fn line(number: u64) -> Line {
    let entry = match number {
        1 => Entry::Opened { schema: SCHEMA, program: "trupose".to_owned(), name: "s".to_owned() },
        2 => Entry::Step(Step::Capture),
        _ => Entry::Note { pose: None, text: "x".repeat(usize::try_from(number * 7).unwrap()) },
    };
    Line { number, time: Timestamp::from_second(1_772_356_502).unwrap(), entry }
}

/// What is appended: the number of lines at a time.
const BATCHES: [u64; 4] = [2, 1, 3, 1];

/// Appends all batches, trying each until it is written; after every failure `check` sees what is on the medium with the number
/// of lines that were acknowledged, and repairs what is to be repaired. Returns the number of failures.
fn write_all(medium: &Faulty, mut check: impl FnMut(&[u8], u64)) -> usize {
    let mut writer = JournalWriter::after(medium.clone(), &Journal::default());
    let (mut acknowledged, mut failures) = (0, 0);
    for batch in BATCHES {
        let lines: Vec<Line> = (acknowledged + 1..=acknowledged + batch).map(line).collect();
        while writer.append(&lines).is_err() {
            failures += 1;
            assert!(failures < 100);
            check(&medium.bytes(), acknowledged);
        }
        acknowledged += batch;
    }
    failures
}

/// Exactly the acknowledged lines, and perhaps a torn end.
fn holds_exactly(bytes: &[u8], acknowledged: u64) {
    match journal::read(bytes) {
        Ok(journal) => assert_eq!(journal.lines, (1..=acknowledged).map(line).collect::<Vec<_>>()),
        Err(error) => assert_eq!((error, acknowledged), (JournalError::Empty, 0)),
    }
}

/// The acknowledged lines, and perhaps whole lines of the batch that failed: a medium that can neither be written nor cut.
fn holds_at_least(bytes: &[u8], acknowledged: u64) {
    match journal::read(bytes) {
        Ok(journal) => {
            let count = journal.lines.len() as u64;
            assert!(count >= acknowledged);
            assert_eq!(journal.lines, (1..=count).map(line).collect::<Vec<_>>());
        }
        Err(error) => assert_eq!((error, acknowledged), (JournalError::Empty, 0)),
    }
}

/// The bytes of the journal without any fault.
fn intact() -> Vec<u8> {
    let medium = Faulty::default();
    medium.set(|state| state.room = usize::MAX / 2);
    assert_eq!(write_all(&medium, |_, _| panic!("there is no fault")), 0);
    assert_eq!(medium.0.borrow().syncs, BATCHES.len());
    medium.bytes()
}

#[test]
fn a_disk_that_is_full_after_any_byte_loses_nothing() {
    let intact = intact();
    for room in 0..intact.len() {
        let medium = Faulty::default();
        medium.set(|state| state.room = room);
        let failures = write_all(&medium, |bytes, acknowledged| {
            holds_exactly(bytes, acknowledged);
            medium.set(|state| state.room = usize::MAX / 2);
        });
        assert_eq!(failures, 1);
        assert_eq!(medium.bytes(), intact);
    }
}

#[test]
fn a_full_disk_that_cannot_be_cut_either_goes_on_when_it_is_mended() {
    let intact = intact();
    for room in 0..intact.len() {
        let medium = Faulty::default();
        medium.set(|state| (state.room, state.cut_fails) = (room, true));
        let mut tries = 0;
        let failures = write_all(&medium, |bytes, acknowledged| {
            holds_at_least(bytes, acknowledged);
            tries += 1;
            // There is room again, but the torn end cannot be cut off yet: nothing may be written behind it.
            medium.set(|state| state.room = usize::MAX / 2);
            if tries == 1 {
                assert_eq!(bytes.len(), room);
            } else {
                assert_eq!(bytes.len(), room, "written behind a torn end");
                medium.set(|state| state.cut_fails = false);
            }
        });
        assert_eq!(failures, 2);
        assert_eq!(medium.bytes(), intact);
    }
}

/// Appends all batches; while the batch `failing` is written, nothing can be forced to disk.
fn write_without_sync(medium: &Faulty, failing: usize, cut_fails: bool) {
    let mut writer = JournalWriter::after(medium.clone(), &Journal::default());
    let holds = if cut_fails { holds_at_least } else { holds_exactly };
    let mut acknowledged = 0;
    for (index, batch) in BATCHES.into_iter().enumerate() {
        let lines: Vec<Line> = (acknowledged + 1..=acknowledged + batch).map(line).collect();
        let fails = index == failing;
        medium.set(|state| (state.sync_fails, state.cut_fails) = (fails, fails && cut_fails));
        for _ in 0..if fails { 3 } else { 0 } {
            assert_eq!(writer.append(&lines).unwrap_err().to_string(), "medium error");
            holds(&medium.bytes(), acknowledged);
        }
        medium.set(|state| (state.sync_fails, state.cut_fails) = (false, false));
        writer.append(&lines).unwrap();
        acknowledged += batch;
    }
}

#[test]
fn what_is_not_forced_to_disk_does_not_count() {
    let intact = intact();
    for cut_fails in [false, true] {
        for failing in 0..BATCHES.len() {
            let medium = Faulty::default();
            medium.set(|state| state.room = usize::MAX / 2);
            write_without_sync(&medium, failing, cut_fails);
            assert_eq!(medium.bytes(), intact);
        }
    }
}

#[test]
fn a_program_that_dies_while_the_medium_fails_goes_on_where_it_was() {
    let intact = intact();
    for room in 0..intact.len() {
        let medium = Faulty::default();
        medium.set(|state| (state.room, state.cut_fails) = (room, true));
        // The first failure is the last thing that this program sees.
        let mut writer = JournalWriter::after(medium.clone(), &Journal::default());
        let mut next = 1;
        for batch in BATCHES {
            let lines: Vec<Line> = (next..next + batch).map(line).collect();
            if writer.append(&lines).is_err() {
                break;
            }
            next += batch;
        }
        medium.set(|state| (state.room, state.cut_fails) = (usize::MAX / 2, false));
        let journal = match journal::read(&medium.bytes()) {
            Ok(journal) => journal,
            Err(JournalError::Empty) => continue,
            Err(error) => panic!("{error}"),
        };
        let read = journal.lines.len() as u64;
        assert!(read >= next - 1);
        let mut writer = JournalWriter::after(medium.clone(), &journal);
        let total: u64 = BATCHES.iter().sum();
        writer.append(&(read + 1..=total).map(line).collect::<Vec<_>>()).unwrap();
        assert_eq!(medium.bytes(), intact);
    }
}

#[test]
fn an_append_of_nothing_is_harmless() {
    let medium = Faulty::default();
    let mut writer = JournalWriter::after(medium.clone(), &Journal::default());
    writer.append(&[]).unwrap();
    assert!(medium.bytes().is_empty() && writer.storage().bytes().is_empty());
}

fn names(root: &Path) -> Vec<String> {
    let mut names: Vec<String> =
        fs::read_dir(root).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

#[test]
fn a_name_that_is_taken_gets_a_number() {
    let root = tempfile::tempdir().unwrap();
    let below = root.path().join("not/there/yet");
    let folders: Vec<SessionFolder> = (0..3).map(|_| SessionFolder::create(&below, "cell").unwrap()).collect();
    assert_eq!(names(&below), ["cell", "cell-2", "cell-3"]);
    assert_eq!(folders[1].path(), below.join("cell-2"));
    // A file is in the way as well.
    File::options().write(true).create_new(true).open(below.join("cell-4")).unwrap();
    assert_eq!(SessionFolder::create(&below, "cell").unwrap().path(), below.join("cell-5"));
}

#[test]
fn a_session_goes_on_with_what_was_written() {
    let root = tempfile::tempdir().unwrap();
    let mut folder = SessionFolder::create(root.path(), "s").unwrap();
    let path = folder.path().to_owned();
    folder.append(&[line(1), line(2)]).unwrap();
    folder.append(&[line(3)]).unwrap();
    drop(folder);
    let (mut folder, journal) = SessionFolder::open(&path).unwrap();
    assert_eq!(journal.lines, [line(1), line(2), line(3)]);
    folder.append(&[line(4)]).unwrap();
    assert_eq!(read_journal(&path).unwrap().lines.len(), 4);
}

#[test]
fn a_torn_end_is_cut_off_by_the_next_append() {
    let root = tempfile::tempdir().unwrap();
    let mut folder = SessionFolder::create(root.path(), "s").unwrap();
    let path = folder.path().join(FILE_NAME);
    folder.append(&[line(1), line(2), line(3)]).unwrap();
    drop(folder);
    let whole = fs::read(&path).unwrap();
    let start = {
        let journal = journal::read(&whole).unwrap();
        journal::encode(&line(3), &journal.sum).unwrap().0.len()
    };
    for keep in [whole.len() - start, whole.len() - start + 1, whole.len() - 1] {
        fs::write(&path, &whole[..keep]).unwrap();
        let (mut folder, journal) = SessionFolder::open(path.parent().unwrap()).unwrap();
        assert_eq!((journal.lines.len(), journal.torn_bytes), (2, keep + start - whole.len()));
        // Opening alone changes nothing.
        assert_eq!(fs::read(&path).unwrap(), &whole[..keep]);
        folder.append(&[line(3)]).unwrap();
        assert_eq!(fs::read(&path).unwrap(), whole);
    }
}

#[test]
fn a_session_is_held_by_one_at_a_time() {
    let root = tempfile::tempdir().unwrap();
    let folder = SessionFolder::create(root.path(), "s").unwrap();
    let path = folder.path().to_owned();
    drop(folder);
    // Empty: nothing to go on with, and the lock is free again all the same.
    for _ in 0..2 {
        assert!(matches!(SessionFolder::open(&path), Err(SessionError::Journal { source: JournalError::Empty, .. })));
    }
    let mut folder = SessionFolder::create(root.path(), "s").unwrap();
    let path = folder.path().to_owned();
    folder.append(&[line(1)]).unwrap();
    let error = SessionFolder::open(&path).unwrap_err();
    let expected = format!("session '{}' is open in another program (process {})", path.display(), std::process::id());
    assert_eq!(error.to_string(), expected);
    // Reading needs no lock.
    assert_eq!(read_journal(&path).unwrap().lines.len(), 1);
    folder.append(&[line(2)]).unwrap();
    drop(folder);
    let (held, _) = SessionFolder::open(&path).unwrap();
    // Whoever wrote nonsense into the lock is not quoted.
    fs::write(path.join(LOCK_NAME), "\u{1b}[31m rm -rf\n").unwrap();
    let error = SessionFolder::open(&path).unwrap_err();
    assert_eq!(error.to_string(), format!("session '{}' is open in another program", path.display()));
    drop(held);
    SessionFolder::open(&path).unwrap();
}

#[test]
fn nothing_is_written_behind_what_another_program_has_written() {
    let medium = Faulty::default();
    medium.set(|state| state.room = 1 << 20);
    let mut writer = JournalWriter::after(medium.clone(), &Journal::default());
    writer.append(&[line(1)]).unwrap();
    let own = medium.bytes();
    medium.set(|state| state.bytes.extend_from_slice(b"foreign"));
    let error = writer.append(&[line(2)]).unwrap_err();
    assert!(error.to_string().contains("another program has written to this session"), "{error}");
    assert_eq!(medium.bytes(), [own.as_slice(), b"foreign"].concat());
    // Also behind what a write that failed has left, which is cut off otherwise.
    medium.set(|state| state.bytes.truncate(own.len()));
    medium.set(|state| (state.room, state.cut_fails) = (5, true));
    writer.append(&[line(2)]).unwrap_err();
    medium.set(|state| (state.room, state.cut_fails) = (1 << 20, false));
    assert_eq!(medium.bytes().len(), own.len() + 5);
    medium.set(|state| state.bytes.extend_from_slice(b"foreign"));
    writer.append(&[line(2)]).unwrap_err();
    assert!(medium.bytes().ends_with(b"foreign"));
    medium.set(|state| state.bytes.truncate(own.len() + 5));
    writer.append(&[line(2)]).unwrap();
    assert_eq!(journal::read(&medium.bytes()).unwrap().lines, [line(1), line(2)]);
}

#[cfg(unix)]
#[test]
fn without_its_lock_file_a_session_is_still_held_by_one() {
    let root = tempfile::tempdir().unwrap();
    let mut held = SessionFolder::create(root.path(), "s").unwrap();
    held.append(&[line(1)]).unwrap();
    let folder = held.path().to_owned();
    let is_locked = || matches!(SessionFolder::open(&folder), Err(SessionError::Locked { .. }));
    fs::remove_file(folder.join(LOCK_NAME)).unwrap();
    assert!(is_locked());
    held.append(&[line(2)]).unwrap();
    drop(held);
    let (mut held, journal) = SessionFolder::open(&folder).unwrap();
    assert_eq!(journal.lines, [line(1), line(2)]);
    fs::remove_file(folder.join(LOCK_NAME)).unwrap();
    assert!(is_locked());
    // Who asks for no lock.
    let path = folder.join(FILE_NAME);
    let mut before = fs::read(&path).unwrap();
    OpenOptions::new().append(true).open(&path).unwrap().write_all(b"foreign").unwrap();
    before.extend_from_slice(b"foreign");
    let error = SessionError::from(held.append(&[line(3)]).unwrap_err());
    let cause = std::error::Error::source(&error).unwrap().to_string();
    assert!(cause.contains("another program has written to this session"), "{cause}");
    assert_eq!(fs::read(&path).unwrap(), before);
    // Nor is it written where nobody will find it.
    fs::rename(&path, folder.join("moved")).unwrap();
    for _ in 0..2 {
        let cause = std::error::Error::source(&held.append(&[line(3)]).unwrap_err()).unwrap().to_string();
        assert!(cause.contains("was removed or replaced"), "{cause}");
        fs::write(&path, &before).unwrap();
    }
}

#[test]
fn what_a_killed_program_left_half_written_is_removed() {
    let root = tempfile::tempdir().unwrap();
    let mut folder = SessionFolder::create(root.path(), "s").unwrap();
    let path = folder.path().to_owned();
    folder.append(&[line(1)]).unwrap();
    folder.replace(&[("report.json".to_owned(), "{}".to_owned())]).unwrap();
    fs::write(path.join(".trupose-a1B2c3"), "{").unwrap();
    // Not by somebody who does not hold the folder.
    assert!(SessionFolder::open(&path).is_err());
    assert_eq!(names(&path), [".lock", ".trupose-a1B2c3", "journal.ron", "report.json"]);
    drop(folder);
    drop(SessionFolder::open(&path).unwrap());
    assert_eq!(names(&path), [".lock", "journal.ron", "report.json"]);
}

#[test]
fn what_is_no_session_is_named() {
    let root = tempfile::tempdir().unwrap();
    for folder in [root.path().to_owned(), root.path().join("missing")] {
        let expected = format!("'{}' is not a session: it has no journal.ron", folder.display());
        assert_eq!(SessionFolder::open(&folder).unwrap_err().to_string(), expected);
        assert_eq!(read_journal(&folder).unwrap_err().to_string(), expected);
    }
    // Nothing was made there.
    assert!(names(root.path()).is_empty());
    assert!(folders(root.path()).unwrap().is_empty());
    let missing = root.path().join("missing");
    assert_eq!(folders(&missing).unwrap_err().to_string(), format!("cannot read '{}'", missing.display()));
    // A journal that is a folder is none.
    fs::create_dir_all(root.path().join("odd").join(FILE_NAME)).unwrap();
    assert!(matches!(SessionFolder::open(&root.path().join("odd")), Err(SessionError::NotASession { .. })));
}

#[test]
fn a_damaged_journal_is_not_touched() {
    let root = tempfile::tempdir().unwrap();
    let mut folder = SessionFolder::create(root.path(), "s").unwrap();
    let path = folder.path().to_owned();
    folder.append(&[line(1), line(2), line(3)]).unwrap();
    drop(folder);
    let mut bytes = fs::read(path.join(FILE_NAME)).unwrap();
    bytes[30] ^= 1;
    fs::write(path.join(FILE_NAME), &bytes).unwrap();
    let error = SessionFolder::open(&path).unwrap_err();
    assert!(matches!(&error, SessionError::Journal { source: JournalError::Damaged { line: 1, .. }, .. }), "{error}");
    assert_eq!(fs::read(path.join(FILE_NAME)).unwrap(), bytes);
}

#[test]
fn sessions_are_listed_by_name() {
    let root = tempfile::tempdir().unwrap();
    for name in ["b", "a", "c"] {
        drop(SessionFolder::create(root.path(), name).unwrap());
    }
    fs::create_dir(root.path().join("none")).unwrap();
    fs::write(root.path().join("file"), "x").unwrap();
    let found: Vec<String> = folders(root.path()).unwrap().iter().map(|path| path.display().to_string()).collect();
    assert_eq!(found, ["a", "b", "c"].map(|name| root.path().join(name).display().to_string()));
}

#[cfg(unix)]
#[test]
fn a_folder_that_must_not_be_written_is_named() {
    use std::os::unix::fs::{MetadataExt as _, PermissionsExt as _};
    let root = tempfile::tempdir().unwrap();
    // Whoever made the folder is who runs the test.
    if fs::metadata(root.path()).unwrap().uid() == 0 {
        // Not by `eprintln!`, which the test harness swallows.
        writeln!(io::stderr(), "SKIPPED a_folder_that_must_not_be_written_is_named: root may write everywhere")
            .unwrap();
        return;
    }
    let mut folder = SessionFolder::create(root.path(), "s").unwrap();
    let path = folder.path().to_owned();
    folder.append(&[line(1)]).unwrap();
    drop(folder);
    let allow = |path: &Path, mode| fs::set_permissions(path, fs::Permissions::from_mode(mode)).unwrap();
    allow(&path.join(FILE_NAME), 0o400);
    let error = SessionFolder::open(&path).unwrap_err();
    assert!(error.to_string().contains("journal.ron"), "{error}");
    allow(root.path(), 0o500);
    let error = SessionFolder::create(root.path(), "other").unwrap_err();
    assert!(error.to_string().contains("other"), "{error}");
    allow(root.path(), 0o700);
    assert_eq!(names(root.path()), ["s"]);
}

#[test]
fn a_folder_that_could_not_be_begun_does_not_take_the_name() {
    let root = tempfile::tempdir().unwrap();
    // The journal cannot be made because its name is taken.
    let folder = root.path().join("s");
    fs::create_dir_all(folder.join(FILE_NAME)).unwrap();
    SessionFolder::begin(root.path(), &folder).unwrap_err();
    fs::remove_dir_all(&folder).unwrap();
    assert_eq!(SessionFolder::create(root.path(), "s").unwrap().path(), folder);
}
