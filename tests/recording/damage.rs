//! Files that are damaged, disks that are full, folders that may not be written to.

use std::collections::BTreeSet;
use std::fs;
use std::os::unix::fs::PermissionsExt as _;
use std::time::{Duration, Instant};

use super::content::{compare_with_journal, compare_with_rebuilt};
use super::running::{RESULT, begun, recorded, session_of, succeeded};
use crate::support::place::Place;
use crate::support::small_disk::SmallDisk;
use crate::support::{root, skip, text};

#[test]
fn the_recording_of_another_session_is_replaced() {
    let place = recorded(&format!("{} Capture(3, Fail)", begun("")));
    let other = recorded(&format!("{} Capture(3, Fail)", begun("\"outlier@2:9mm\"")));
    fs::copy(other.recording(), place.recording()).unwrap();
    let rest = place.write_script("rest.script.ron", "Capture(1, Fail)");
    succeeded(&place.run(&["resume", "sessions/s", "--script", &rest, "--json"]));
    compare_with_journal(&place.session());
    compare_with_rebuilt(&place);
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
    assert!(text(&output.stderr).contains("cannot write 'sessions/s/recording.rrd'"), "{}", text(&output.stderr));
}

#[test]
fn a_full_disk_ends_the_recording_with_a_message_and_not_the_session() {
    let place = Place::new();
    let Some(_disk) = SmallDisk::mount(place.path("sessions"), 256) else { return };
    let start = Instant::now();
    let output = place.script(&format!("{} CaptureAll(Fail), Do(Next), Do(Identify), Do(Next)", begun("")), &[]);
    succeeded(&output);
    assert!(start.elapsed() < Duration::from_mins(1), "{:?}", start.elapsed());
    let transcript = text(&output.stdout);
    assert!(transcript.contains("the 3D recording is not complete: "), "{transcript}");
    assert!(transcript.contains("less than 16 MiB are free on the disk"), "{transcript}");
    let (_, session) = session_of(&place.session());
    assert!(session.closed && session.identified.is_some());
    assert!(!place.recording().exists());
    let rest = place.write_script("rest.script.ron", "Do(Next), Do(Deliver)");
    succeeded(&place.run(&["resume", "sessions/s", "--script", &rest, "--json", "--no-recording"]));
    assert!(place.session().join("report.html").exists());
}

#[test]
fn on_a_small_disk_the_session_goes_before_its_recording() {
    let steps = format!("{} CaptureAll(Fail)", begun(""));
    let all = session_of(&recorded(&steps).session()).1.counted().count();
    for kilobytes in [64, 192, 1024] {
        let place = Place::new();
        let Some(_disk) = SmallDisk::mount(place.path("sessions"), kilobytes) else { return };
        let output = place.script(&steps, &[]);
        succeeded(&output);
        let (_, session) = session_of(&place.session());
        assert!(session.closed && session.counted().count() == all, "{kilobytes} kB");
        let told = text(&output.stdout).matches("the 3D recording has stopped").count();
        assert!(told <= 1 && !place.recording().exists(), "{kilobytes} kB, told {told} times");
    }
}

#[test]
fn what_does_not_fit_on_the_disk_leaves_the_old_recording_and_no_temporary_file() {
    let place = Place::new();
    let Some(_disk) = SmallDisk::mount(place.path("sessions"), 192) else { return };
    let session = place.session();
    fs::create_dir(&session).unwrap();
    let example = root().join("sessions/example");
    fs::copy(example.join("journal.ron"), session.join("journal.ron")).unwrap();
    fs::write(place.recording(), "old").unwrap();
    let output = place.run(&["record", "rebuild", "sessions/s"]);
    assert_eq!(output.status.code(), Some(5));
    assert!(text(&output.stderr).contains("No space left on device"), "{}", text(&output.stderr));
    assert_eq!(fs::read(place.recording()).unwrap(), b"old");
    let names: BTreeSet<_> = fs::read_dir(&session).unwrap().map(|entry| entry.unwrap().file_name()).collect();
    assert_eq!(names, [".lock", "journal.ron", "recording.rrd"].map(Into::into).into());
}
