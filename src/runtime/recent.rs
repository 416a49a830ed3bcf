//! The sessions of a folder that can be continued, for the first screen and for `trupose resume`.

use std::fs;
use std::path::{Path, PathBuf};
use std::thread;
use std::time::SystemTime;

use super::events::Events;
use super::store_thread::CELL;
use crate::link::serial_ports;
use crate::profile::CellText;
use crate::session::set_up::InstrumentChoice;
use crate::session::state::Session;
use crate::session::wire::{KnownLinks, LinkChoice};
use crate::store;
use crate::store::session::{folders, read_journal};
use crate::wizard::Event;
use crate::wizard::view::SessionCard;

/// Largest number of sessions on offer.
const SHOWN: usize = 3;
/// Largest number of sessions that are read to find them.
const READ: usize = 8;

/// The sessions of a folder, the one that was written to last first.
pub fn by_age(root: &Path) -> Vec<PathBuf> {
    let written = |folder: &PathBuf| -> SystemTime {
        let files = fs::read_dir(folder).into_iter().flatten().flatten();
        let times = files.filter_map(|file| file.metadata().and_then(|data| data.modified()).ok());
        times.max().unwrap_or(SystemTime::UNIX_EPOCH)
    };
    let mut found: Vec<(SystemTime, PathBuf)> =
        folders(root).unwrap_or_default().into_iter().map(|folder| (written(&folder), folder)).collect();
    found.sort_by(|one, other| other.cmp(one));
    found.into_iter().map(|(_, folder)| folder).collect()
}

/// The sessions of a folder that are not finished, the latest first. Those that cannot be read are passed over.
pub fn unfinished(root: &Path) -> Vec<SessionCard> {
    let read = |folder: PathBuf| {
        let session = Session::of(&read_journal(&folder).ok()?).ok()?;
        let is_finished = !session.delivered.is_empty() && session.is_current();
        (!is_finished).then(|| SessionCard::new(&session, folder.display().to_string()))
    };
    by_age(root).into_iter().take(READ).filter_map(read).take(SHOWN).collect()
}

/// The links of the latest sessions, each once.
fn links(root: &Path) -> Vec<LinkChoice> {
    let mut found: Vec<LinkChoice> = Vec::new();
    for folder in by_age(root).into_iter().take(READ) {
        let session = read_journal(&folder).ok().and_then(|lines| Session::of(&lines).ok());
        if let Some(InstrumentChoice::Linked(choice)) = session.and_then(|session| session.instrument)
            && !found.contains(&choice)
        {
            found.push(choice);
        }
    }
    found.truncate(SHOWN);
    found
}

/// The cell of the last session. A file that cannot be read is no cell.
fn earlier_cell(root: &Path) -> Option<CellText> {
    let bytes = store::read(&root.join(CELL)).ok()?;
    ron::from_str(&String::from_utf8(bytes).ok()?).ok()
}

/// Looks for unfinished sessions beside the first screen, which does not wait for them.
pub(super) fn look(root: PathBuf, events: Events) {
    let search = move || {
        if let Some(cell) = earlier_cell(&root) {
            events.send(Event::Cell(cell));
        }
        let found = unfinished(&root);
        if !found.is_empty() {
            events.send(Event::Sessions(found));
        }
        events.send(Event::Links(known_links(&root)));
    };
    // Without the thread, the operator starts a new session or types 'trupose resume'.
    drop(thread::Builder::new().name("sessions".to_owned()).spawn(search));
}

fn known_links(root: &Path) -> KnownLinks {
    KnownLinks { recent: links(root), ports: serial_ports() }
}

/// Looks for links beside the screen.
pub(super) fn look_for_links(root: PathBuf, events: Events) {
    let search = move || events.send(Event::Links(known_links(&root)));
    // Without the thread, addresses can still be typed.
    drop(thread::Builder::new().name("links".to_owned()).spawn(search));
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    #[test]
    fn the_session_written_last_comes_first() {
        let root = tempfile::tempdir().unwrap();
        for (name, age) in [("a", 30), ("b", 10), ("c", 20)] {
            let folder = root.path().join(name);
            fs::create_dir(&folder).unwrap();
            let journal = fs::File::create_new(folder.join("journal.ron")).unwrap();
            journal.set_modified(SystemTime::UNIX_EPOCH + Duration::from_secs(1_000_000 - age)).unwrap();
        }
        fs::create_dir(root.path().join("no-session")).unwrap();
        let names: Vec<String> =
            by_age(root.path()).iter().map(|path| path.file_name().unwrap().to_string_lossy().into_owned()).collect();
        assert_eq!(names, ["b", "c", "a"]);
        // What cannot be read is not on offer.
        assert!(unfinished(root.path()).is_empty());
        assert!(by_age(&root.path().join("nowhere")).is_empty());
    }
}
