//! Viewers that do not behave.

use std::fs;
use std::io::{Read as _, Write as _};
use std::net::{Ipv4Addr, TcpListener, TcpStream};
use std::process::Stdio;
use std::time::{Duration, Instant};

use super::reading::whole;
use super::running::{begun, plain, recorded, succeeded};
use crate::support::place::Place;
use crate::support::text;

/// A port that was free a moment ago.
pub(super) fn free_port() -> u16 {
    TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).unwrap().local_addr().unwrap().port()
}

#[test]
fn a_busy_port_is_refused_before_anything_is_begun() {
    let place = Place::new();
    let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).unwrap();
    let port = listener.local_addr().unwrap().port().to_string();
    let output = place.script(&plain(), &["--live", &port]);
    assert_eq!(output.status.code(), Some(2));
    assert!(text(&output.stderr).contains(&format!("cannot listen on 127.0.0.1:{port}")), "{}", text(&output.stderr));
    assert!(!place.path("sessions").exists());
}

#[test]
fn neither_a_missing_viewer_nor_one_that_never_reads_is_noticed() {
    let without = Instant::now();
    let place = recorded(&plain());
    let without = without.elapsed();
    let expected = fs::read(place.recording()).unwrap();

    let place = Place::new();
    let port = free_port();
    let alone = Instant::now();
    succeeded(&place.script(&plain(), &["--live", &port.to_string()]));
    let alone = alone.elapsed();
    assert!(fs::read(place.recording()).unwrap() == expected);
    assert!(alone < without * 2 + Duration::from_secs(2), "{alone:?} with the live view, {without:?} without");

    let place = Place::new();
    let port = free_port();
    let script = place.write_script("run.script.ron", &plain());
    let mut child = place
        .command(&["--script", &script, "--json", "--live", &port.to_string()])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    // It is there before the session has begun, asks for everything, and reads nothing of it. Another goes away at once.
    let (mut viewers, mut gone) = (Vec::new(), 0);
    while child.try_wait().unwrap().is_none() && viewers.len() < 4 {
        if let Ok(mut viewer) = TcpStream::connect((Ipv4Addr::LOCALHOST, port)) {
            drop(viewer.write_all(b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n\0\0\0\x04\0\0\0\0\0"));
            if gone < viewers.len() {
                gone += 1;
            } else {
                viewers.push(viewer);
            }
        }
        std::thread::yield_now();
    }
    let (mut out, mut err) = (Vec::new(), Vec::new());
    child.stdout.take().unwrap().read_to_end(&mut out).unwrap();
    child.stderr.take().unwrap().read_to_end(&mut err).unwrap();
    assert_eq!(child.wait().unwrap().code(), Some(0), "{}", text(&err));
    assert!(!viewers.is_empty() && gone > 0);
    assert!(fs::read(place.recording()).unwrap() == expected);
}

#[test]
fn the_environment_does_not_silence_the_recording() {
    let place = Place::new();
    let script = place.write_script("run.script.ron", &format!("{} Capture(2, Fail)", begun("")));
    let output = place.command(&["--script", &script]).env("RERUN", "off").output().unwrap();
    succeeded(&output);
    assert!(whole(&place.recording()) > 2);
    // `--no-recording` writes none, and changes nothing in the journal.
    let journal = fs::read(place.session().join("journal.ron")).unwrap();
    let place = Place::new();
    succeeded(&place.script(&format!("{} Capture(2, Fail)", begun("")), &["--no-recording"]));
    assert!(!place.recording().exists());
    assert_eq!(fs::read(place.session().join("journal.ron")).unwrap(), journal);
}
