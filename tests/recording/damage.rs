//! Files that are damaged, disks that are full, folders that may not be written to.

use std::fs;
use std::os::unix::fs::PermissionsExt as _;
use std::path::PathBuf;
use std::time::{Duration, Instant};

use crate::support::{root, skip, text};
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use trupose::recording;
use trupose::store::session::read_journal;

use super::content::{compare_with_journal, compare_with_rebuilt};
use super::crashes::{one_by_one, torn_part};
use super::reading::content;
use super::running::{RESULT, begun, recorded, session_of, succeeded};
use crate::support::place::Place;
use crate::support::small_disk::SmallDisk;

#[test]
fn torn_and_damaged_files_are_named_and_never_stop_the_program() {
    let place = Place::new();
    // Always the same bytes: one flipped bit of thousands asks the library for more memory than there is, and ends the program.
    let whole = fs::read(root().join("sessions/example/recording.rrd")).unwrap();
    let mut random = ChaCha8Rng::seed_from_u64(9);
    let file = place.path("damaged.rrd");
    let mut unwhole = 0;
    for case in 0..16 {
        let mut bytes = whole.clone();
        if case % 2 == 0 {
            bytes.truncate(random.random_range(0..whole.len()));
        } else {
            for _ in 0..20 {
                let at = random.random_range(0..whole.len());
                bytes[at] ^= random.random_range(1..=255_u8);
            }
        }
        fs::write(&file, &bytes).unwrap();
        for arguments in [["record", "check"].as_slice(), &["replay", "--print"], &["record", "compact"]] {
            // Compacting takes seconds where the library is not optimised.
            if arguments == ["record", "compact"] && case % 4 > 1 {
                continue;
            }
            let output = place.run(&[arguments, &["damaged.rrd"]].concat());
            let code = output.status.code().unwrap_or_else(|| panic!("{arguments:?}, case {case}: no exit code"));
            assert!([0, 1, 5].contains(&code), "{arguments:?}: {code} {}", text(&output.stderr));
            assert!(!text(&output.stderr).contains("panicked"), "{}", text(&output.stderr));
            if arguments == ["record", "check"] {
                unwhole += u32::from(code != 0);
            }
        }
    }
    assert!(unwhole >= 14, "only {unwhole} of 16 damaged files were noticed");
    for (name, bytes, said) in [
        ("empty.rrd", Vec::new(), "is no recording of trupose"),
        ("garbage.rrd", b"not a recording at all".to_vec(), "is no recording of trupose"),
    ] {
        fs::write(place.path(name), bytes).unwrap();
        let output = place.run(&["record", "check", name]);
        assert_eq!(output.status.code(), Some(5));
        assert!(text(&output.stderr).contains(said), "{}", text(&output.stderr));
    }
}

#[test]
fn what_is_damaged_is_not_made_compact() {
    let place = Place::new();
    let whole = fs::read(root().join("sessions/example/recording.rrd")).unwrap();
    let cut = whole[..whole.len() * 3 / 5].to_vec();
    assert!(cut.len() > 200_000, "it has lines of the journal");
    let mut flipped = whole.clone();
    // In the head of a piece: elsewhere the library may ask for more memory than there is.
    let mut at = 12;
    for _ in 0..20 {
        at += 16 + usize::try_from(u64::from_le_bytes(*whole[at + 8..].first_chunk().unwrap())).unwrap();
    }
    flipped[at + 3] ^= 0x55;
    let mut lengthened = whole;
    lengthened.extend_from_slice(b"more");
    for (name, bytes) in [("cut.rrd", cut), ("flipped.rrd", flipped), ("lengthened.rrd", lengthened)] {
        fs::write(place.path(name), &bytes).unwrap();
        let (status, said) = place.check_file(name);
        assert_eq!(status, Some(1), "{name}: {said}");
        let output = place.run(&["record", "compact", name]);
        let error = text(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{name}: {error}");
        assert!(error.contains("is not whole and stays as it is"), "{name}: {error}");
        assert!(error.contains("trupose record rebuild DIR"), "{name}: {error}");
        assert_eq!(fs::read(place.path(name)).unwrap(), bytes, "{name}");
        assert_eq!(place.check_file(name), (status, said), "{name}");
    }
    // Beside the journal there is no need for what is damaged.
    let session = place.session();
    fs::create_dir_all(&session).unwrap();
    let example = root().join("sessions/example");
    fs::copy(example.join("journal.ron"), session.join("journal.ron")).unwrap();
    fs::copy(place.path("cut.rrd"), place.recording()).unwrap();
    assert_eq!(place.check().0, Some(1));
    succeeded(&place.run(&["record", "compact", "sessions/s"]));
    compare_with_journal(&session);
}

#[test]
fn what_a_crash_left_alone_is_made_compact_and_is_said_to_be_torn() {
    let place = Place::new();
    let script = place.write_script("run.script.ron", &format!("{} {}", begun(""), one_by_one(6)));
    let bytes = fs::read(torn_part(&place, &script)).unwrap();
    // Wherever it is torn: also within the picture of the last entry.
    for (name, length) in
        [("one.rrd", bytes.len()), ("two.rrd", bytes.len() - 1000), ("three.rrd", bytes.len() * 4 / 5)]
    {
        fs::write(place.path(name), &bytes[..length]).unwrap();
        let found = recording::check(&place.path(name)).unwrap();
        assert!(found.is_unfinished() && found.lines > 2, "{name}: {found:?}");
        let output = place.run(&["record", "compact", name]);
        succeeded(&output);
        let said = text(&output.stdout);
        assert!(said.contains(&format!("its end was torn: all {} entries", found.lines)), "{said}");
        let (status, said) = place.check_file(name);
        assert_eq!(status, Some(0), "{said}");
        // Everything is drawn, as if the journal had these lines only.
        let then = place.path("then");
        fs::create_dir_all(&then).unwrap();
        let journal = fs::read(place.session().join("journal.ron")).unwrap();
        let lines: Vec<u8> =
            journal.split_inclusive(|byte| *byte == b'\n').take(found.lines).flatten().copied().collect();
        fs::write(then.join("journal.ron"), lines).unwrap();
        succeeded(&place.run(&["record", "rebuild", "then"]));
        assert_eq!(content(&place.path(name)), content(&then.join(recording::FILE_NAME)));
        // It is a whole now: where its end is missing again, anything may be missing.
        let compact = fs::read(place.path(name)).unwrap();
        fs::write(place.path(name), &compact[..compact.len() - 1000]).unwrap();
        assert_eq!(place.run(&["record", "compact", name]).status.code(), Some(1));
    }
}

#[test]
fn the_recording_of_another_session_is_noticed_and_not_gone_on_with() {
    let place = recorded(&format!("{} Capture(3, Fail)", begun("")));
    let own = fs::read(place.recording()).unwrap();
    // As many lines, other points.
    let other = recorded(&format!("{} Capture(3, Fail)", begun("\"outlier@2:9mm\"")));
    let lines = |place: &Place| read_journal(&place.session()).unwrap().lines.len();
    assert_eq!(lines(&place), lines(&other));
    let differs = read_journal(&place.session())
        .unwrap()
        .lines
        .iter()
        .zip(&read_journal(&other.session()).unwrap().lines)
        .position(|(one, other)| one != other)
        .unwrap();
    fs::copy(other.recording(), place.recording()).unwrap();
    let (status, said) = place.check();
    assert_eq!(status, Some(1), "{said}");
    assert!(said.contains(&format!("entry {} of it differs from the journal", differs + 1)), "{said}");
    assert!(said.contains("trupose record rebuild"), "{said}");
    succeeded(&place.run(&["record", "compact", "sessions/s"]));
    assert_eq!(place.check().0, Some(0));
    // A session that goes on draws it anew.
    fs::copy(other.recording(), place.recording()).unwrap();
    let rest = place.write_script("rest.script.ron", "Capture(1, Fail)");
    succeeded(&place.run(&["resume", "sessions/s", "--script", &rest, "--json"]));
    compare_with_journal(&place.session());
    compare_with_rebuilt(&place);
    // Another name, another session.
    let mut named = begun("");
    named = named.replacen("NameSession(\"s\")", "NameSession(\"t\")", 1);
    succeeded(&other.script(&format!("{named} Capture(3, Fail)"), &[]));
    fs::copy(other.path("sessions/t").join(recording::FILE_NAME), place.recording()).unwrap();
    let (status, said) = place.check();
    assert_eq!(status, Some(1), "{said}");
    assert!(said.contains("it is the recording of another session"), "{said}");
    // An older one of the same session lacks something, and is not another's.
    fs::write(place.recording(), own).unwrap();
    let (status, said) = place.check();
    assert_eq!(status, Some(1), "{said}");
    assert!(said.contains("missing of") && !said.contains("differs"), "{said}");
}

/// Runs the rest of a session over what is in the way of its recording, and returns the transcript.
pub(super) fn goes_on_over(obstacle: impl Fn(&Place)) -> (Place, String) {
    let place = recorded(&format!("{} Capture(3, Fail)", begun("")));
    obstacle(&place);
    let script = place.write_script("rest.script.ron", &format!("CaptureAll(Fail), {RESULT}"));
    let output = place.run(&["resume", "sessions/s", "--script", &script, "--json"]);
    succeeded(&output);
    let (_, session) = session_of(&place.session());
    assert!(session.closed && session.identified.is_some());
    (place, text(&output.stdout))
}

#[test]
fn garbage_in_place_of_a_recording_is_replaced() {
    let (place, _) = goes_on_over(|place| fs::write(place.recording(), "garbage").unwrap());
    compare_with_journal(&place.session());
    compare_with_rebuilt(&place);
}

#[test]
fn a_folder_in_place_of_the_recording_is_told_and_holds_nobody_up() {
    let (_place, transcript) = goes_on_over(|place| {
        fs::remove_file(place.recording()).unwrap();
        fs::create_dir(place.recording()).unwrap();
    });
    // At once, or at the end where that is sooner.
    assert!(transcript.contains("the 3D recording is not complete: "), "{transcript}");
}

#[test]
fn a_folder_that_may_not_be_written_to_is_told() {
    let place = recorded(&format!("{} Capture(3, Fail)", begun("")));
    let folder = place.session();
    fs::set_permissions(&folder, fs::Permissions::from_mode(0o555)).unwrap();
    let is_refused = fs::write(folder.join("probe"), "").is_err();
    let output = place.run(&["record", "rebuild", "sessions/s"]);
    fs::set_permissions(&folder, fs::Permissions::from_mode(0o755)).unwrap();
    if !is_refused {
        skip("root may write anywhere");
        return;
    }
    assert_eq!(output.status.code(), Some(5));
    assert!(text(&output.stderr).contains("cannot write the recording"), "{}", text(&output.stderr));
}

#[test]
fn a_full_disk_ends_the_recording_with_a_message_and_not_the_session() {
    let place = Place::new();
    let Some(_disk) = SmallDisk::mount(place.path("sessions"), 256) else { return };
    let start = Instant::now();
    // What is delivered waits: the recording gives its room back a little later than the disk is full.
    let output = place.script(&format!("{} CaptureAll(Fail), Do(Next), Do(Identify), Do(Next)", begun("")), &[]);
    succeeded(&output);
    assert!(start.elapsed() < Duration::from_mins(1), "{:?}", start.elapsed());
    let transcript = text(&output.stdout);
    assert!(transcript.contains("the 3D recording is not complete: "), "{transcript}");
    assert!(transcript.contains("No space left on device"), "{transcript}");
    let (_, session) = session_of(&place.session());
    assert!(session.closed && session.identified.is_some());
    // The session needs the room more.
    assert_eq!(recording::files(&place.session()), [] as [PathBuf; 0]);
    let rest = place.write_script("rest.script.ron", "Do(Next), Do(Deliver)");
    succeeded(&place.run(&["resume", "sessions/s", "--script", &rest, "--json", "--no-recording"]));
    assert!(place.session().join("report.html").exists());
}

#[test]
fn on_a_small_disk_the_session_goes_before_its_recording() {
    let steps = format!("{} CaptureAll(Fail)", begun(""));
    let all = session_of(&recorded(&steps).session()).1.counted().count();
    // Whichever of them finds the disk full.
    for kilobytes in (64..=192).step_by(16) {
        let place = Place::new();
        let Some(_disk) = SmallDisk::mount(place.path("sessions"), kilobytes) else { return };
        let output = place.script(&steps, &[]);
        succeeded(&output);
        let (_, session) = session_of(&place.session());
        assert!(session.closed && session.counted().count() == all, "{kilobytes} kB");
        if text(&output.stdout).contains("the disk is full, and the session needs its room") {
            assert_eq!(recording::files(&place.session()), [] as [PathBuf; 0], "{kilobytes} kB");
        }
    }
}
