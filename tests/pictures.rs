//! The pictures of the documents. The screens in `docs/technician.md`: the program in a real terminal of 80×24, resumed from the first
//! entries of the journal in `sessions/example`, shows exactly what is printed there. `docs/pictures/*.svg`: wider screens with their
//! colours. `docs/pictures/report.png`: the first page of the example's report. `docs/pictures/story.webp`: its recording.
//!
//! To write them again: `TRUPOSE_WRITE_PICTURES=1 cargo test --test main pictures`; the page needs Chromium on the path.

mod svg;

use std::fs;
use std::path::PathBuf;
use std::process::{Command, Stdio};
use std::time::Duration;

use crate::support::pty::{PATIENCE, Shown, Terminal};
use crate::support::root;
use trupose::session::sha256;

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
fn show(picture: &Picture, size: (u16, u16)) -> (tempfile::TempDir, Terminal) {
    let folder = tempfile::tempdir().unwrap();
    if picture.entries == 0 {
        let terminal = Terminal::start(folder.path(), &["wizard", "--no-recording"], size);
        return (folder, terminal);
    }
    let journal = fs::read_to_string(root().join("sessions/example/journal.ron")).unwrap();
    let kept: String = journal.split_inclusive('\n').take(picture.entries).collect();
    fs::create_dir_all(folder.path().join("sessions/example")).unwrap();
    fs::write(folder.path().join("sessions/example/journal.ron"), kept).unwrap();
    let terminal = Terminal::start(folder.path(), &["resume", "sessions/example", "--no-recording"], size);
    (folder, terminal)
}

#[test]
fn the_screens_are_those_of_the_document() {
    let is_written = is_written();
    let mut text = fs::read_to_string(document()).unwrap();
    assert_eq!(text.matches("<!-- picture: ").count(), PICTURES.len());
    for picture in &PICTURES {
        let (begin, end) = place(&text, picture.name);
        let (_folder, mut terminal) = show(picture, SIZE);
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

const WIDE: (u16, u16) = (120, 34);

/// Screens of `docs/pictures`, with their size.
const SCREENS: [Picture; 1] = [Picture { name: "capture", entries: 32, keys: "", has: "step 5 of 8" }];

fn is_written() -> bool {
    std::env::var_os("TRUPOSE_WRITE_PICTURES").is_some()
}

#[test]
fn the_wide_screens_are_those_of_the_program() {
    for picture in &SCREENS {
        let path = root().join(format!("docs/pictures/{}.svg", picture.name));
        let (_folder, mut terminal) = show(picture, WIDE);
        if !picture.keys.is_empty() {
            terminal.wait_for("the session", |shown| shown.step().is_some() && shown.has("saved"));
            terminal.send(picture.keys);
        }
        terminal.wait_for_text(picture.has);
        let drawn = |shown: &Shown| svg::of_screen(shown.screen(), WIDE);
        if is_written() {
            while terminal.comes(Duration::from_secs(1), {
                let seen = terminal.written();
                move |shown| shown.raw.len() > seen
            }) {}
            fs::write(&path, terminal.look(drawn)).unwrap();
        }
        let expected = fs::read_to_string(&path).unwrap();
        assert!(
            expected.matches("<text").count() > 20 && expected.matches('M').count() > 200,
            "{} is blank",
            picture.name
        );
        let is_same = terminal.comes(PATIENCE, |shown| drawn(shown) == expected);
        assert!(is_same, "docs/pictures/{}.svg is stale; the screen:\n{}", picture.name, terminal.look(Shown::text));
    }
}

/// Least size of a picture of a page (bytes): one that is blank has a tenth of it.
const NOT_BLANK: u64 = 60_000;

/// The page is made from the committed report, whose SHA-256 is beside the picture.
#[test]
fn the_picture_of_the_report_is_of_the_example() {
    let (page, picture) = (root().join("sessions/example/report.html"), root().join("docs/pictures/report.png"));
    let sum = sha256(&fs::read(&page).unwrap());
    let beside = root().join("docs/pictures/report.sha256");
    if is_written() {
        let status = Command::new("chromium")
            .args([
                "--headless",
                "--no-sandbox",
                "--disable-gpu",
                "--hide-scrollbars",
                "--force-device-scale-factor=1.5",
            ])
            .args(["--window-size=860,1500".to_owned(), format!("--screenshot={}", picture.display())])
            .arg(format!("file://{}", page.display()))
            .stderr(Stdio::null())
            .status()
            .expect("Chromium is on the path");
        assert!(status.success());
        fs::write(&beside, format!("{sum}\n")).unwrap();
    }
    assert_eq!(fs::read_to_string(&beside).unwrap().trim(), sum, "docs/pictures/report.png is stale");
    let bytes = fs::read(&picture).unwrap();
    assert!(bytes.starts_with(b"\x89PNG") && bytes.len() as u64 > NOT_BLANK, "{} bytes: it is blank", bytes.len());
}

/// The animation of the recording, which a script with the viewer draws (`docs/pictures/story.py`).
#[test]
fn the_story_is_that_of_the_example() {
    let recording = fs::read(root().join("sessions/example/recording.rrd")).unwrap();
    let beside = fs::read_to_string(root().join("docs/pictures/story.sha256")).unwrap();
    assert_eq!(beside.trim(), sha256(&recording), "docs/pictures/story.webp is stale: run docs/pictures/story.py");
    let story = fs::read(root().join("docs/pictures/story.webp")).unwrap();
    assert!(
        story.starts_with(b"RIFF") && (NOT_BLANK..2_000_000).contains(&(story.len() as u64)),
        "{} bytes",
        story.len()
    );
}

#[test]
fn the_readme_shows_pictures_that_exist_and_are_small() {
    let readme = fs::read_to_string(root().join("README.md")).unwrap();
    assert!(readme.lines().count() <= 100, "{} lines", readme.lines().count());
    let shown: Vec<&str> = readme.split("](docs/pictures/").skip(1).filter_map(|rest| rest.split(')').next()).collect();
    assert!(shown.len() >= 2, "{shown:?}");
    for name in shown {
        let size = fs::metadata(root().join("docs/pictures").join(name)).unwrap().len();
        assert!(size < 2_000_000, "{name}: {size} bytes");
    }
}
