//! The pictures of the screens in `docs/technician.md`: the program in a real terminal of 80×24, resumed from the first entries of the
//! journal in `sessions/example`, shows exactly what is printed there.
//!
//! To write them again: `TRUPOSE_WRITE_PICTURES=1 cargo test --test main pictures`.

use std::fs;
use std::path::PathBuf;
use std::time::Duration;

use crate::support::pty::{PATIENCE, Shown, Terminal};
use crate::support::root;

const SIZE: (u16, u16) = (80, 24);

/// A picture: its name in the document, how many entries of the journal come before it, and the keys that lead to it.
struct Picture {
    name: &'static str,
    entries: usize,
    keys: &'static str,
    /// What the screen has as soon as it has settled.
    has: &'static str,
}

const PICTURES: [Picture; 11] = [
    Picture { name: "profile", entries: 0, keys: "", has: "step 1 of 8" },
    Picture { name: "instrument", entries: 4, keys: "", has: "answers      simulated" },
    Picture { name: "target", entries: 6, keys: "", has: "step 3 of 8" },
    Picture { name: "plan", entries: 8, keys: "", has: "step 4 of 8" },
    Picture { name: "capture", entries: 17, keys: "", has: "step 5 of 8" },
    Picture { name: "question", entries: 27, keys: "", has: "step 5 of 8" },
    Picture { name: "measured", entries: 44, keys: "", has: "step 5 of 8" },
    Picture { name: "identify", entries: 46, keys: "", has: "step 6 of 8" },
    Picture { name: "verify", entries: 47, keys: "", has: "step 7 of 8" },
    Picture { name: "errors", entries: 47, keys: "4", has: "[4 picture]" },
    Picture { name: "deliver", entries: 50, keys: "", has: "Written" },
];

fn document() -> PathBuf {
    root().join("docs/technician.md")
}

/// Where the block of a picture begins and ends in the document, fences excluded.
fn place(document: &str, name: &str) -> (usize, usize) {
    let mark = format!("<!-- picture: {name} -->\n```text\n");
    let begin = document.find(&mark).unwrap_or_else(|| panic!("there is no picture '{name}'")) + mark.len();
    let end = begin + document.get(begin..).unwrap().find("```\n").unwrap();
    (begin, end)
}

/// The screen as it stands in the document.
fn drawn(shown: &Shown) -> String {
    shown.text().lines().flat_map(|line| [line.trim_end(), "\n"]).collect()
}

/// A folder with the session as it was after some entries, and the program there.
fn show(picture: &Picture) -> (tempfile::TempDir, Terminal) {
    let folder = tempfile::tempdir().unwrap();
    if picture.entries == 0 {
        let terminal = Terminal::start(folder.path(), &["wizard", "--no-recording"], SIZE);
        return (folder, terminal);
    }
    let journal = fs::read_to_string(root().join("sessions/example/journal.ron")).unwrap();
    let kept: String = journal.split_inclusive('\n').take(picture.entries).collect();
    fs::create_dir_all(folder.path().join("sessions/example")).unwrap();
    fs::write(folder.path().join("sessions/example/journal.ron"), kept).unwrap();
    let terminal = Terminal::start(folder.path(), &["resume", "sessions/example", "--no-recording"], SIZE);
    (folder, terminal)
}

#[test]
fn the_screens_are_those_of_the_document() {
    let is_written = std::env::var_os("TRUPOSE_WRITE_PICTURES").is_some();
    let mut text = fs::read_to_string(document()).unwrap();
    assert_eq!(text.matches("<!-- picture: ").count(), PICTURES.len());
    for picture in &PICTURES {
        let (begin, end) = place(&text, picture.name);
        let (_folder, mut terminal) = show(picture);
        if !picture.keys.is_empty() {
            terminal.wait_for("the session", |shown| shown.step().is_some() && shown.has("saved"));
            terminal.send(picture.keys);
        }
        if is_written {
            terminal.wait_for_text(picture.has);
            // Whatever else is on its way.
            while terminal.comes(Duration::from_secs(1), {
                let seen = terminal.written();
                move |shown| shown.raw.len() > seen
            }) {}
            text.replace_range(begin..end, &terminal.look(drawn));
        } else {
            let expected = text.get(begin..end).unwrap();
            let is_same = terminal.comes(PATIENCE, |shown| drawn(shown) == expected);
            assert!(is_same, "picture '{}':\n{expected}the screen:\n{}", picture.name, terminal.look(drawn));
        }
    }
    if is_written {
        fs::write(document(), text).unwrap();
    }
}
