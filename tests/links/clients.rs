//! Clients that others wrote, from a package registry, against the simulators: a driver and its simulator cannot be wrong together
//! where a client of someone else reads the same. Tests whose client is missing are skipped; `TRUPOSE_PYTHON` names the interpreter
//! that has them (`pip install CESAPI geocompy ndicapi py-openshowvar`).

use std::env;
use std::process::Command;

use super::{LISTEN, Simulator};
use crate::support::{root, skip, text};

/// What a client printed, run against a port; `None` where it is not installed.
fn run(client: &str, package: &str, address: &str) -> Option<Vec<f64>> {
    let python = env::var("TRUPOSE_PYTHON").unwrap_or_else(|_| "python3".to_owned());
    let script = root().join("tests/links/clients").join(client);
    let port = address.rsplit(':').next().unwrap();
    let found = Command::new(&python).args(["-c", &format!("import {package}")]).output();
    if !found.is_ok_and(|output| output.status.success()) {
        skip(&format!("the Python package {package} is not installed"));
        return None;
    }
    let output = Command::new(&python).arg(script).arg(port).output().unwrap();
    let (said, errors) = (text(&output.stdout), text(&output.stderr));
    assert!(output.status.success(), "{client}: {said}{errors}");
    Some(said.split_whitespace().map(|number| number.parse().unwrap()).collect())
}

/// The first shot of the program's own driver (mm).
fn own_shot(simulator: &Simulator) -> Vec<f64> {
    let (code, output, errors) = simulator.tested(&["--shots", "1", "--seconds", "0.1"]);
    assert_eq!(code, Some(0), "{output}{errors}");
    let line = output.lines().find(|line| line.starts_with("shot 1: ")).unwrap();
    line.split([' ', ',']).filter_map(|word| word.parse().ok()).take(3).collect()
}

fn length(point: &[f64]) -> f64 {
    point.iter().map(|value| value * value).sum::<f64>().sqrt()
}

/// Noise of 10 µm, and the digits of the wire.
const SAME_MM: f64 = 0.2;

#[test]
fn cesapi_measures_what_the_driver_of_emscon_measures() {
    let simulator = Simulator::start(&[&["emscon"][..], &LISTEN].concat());
    let Some(client) = run("emscon.py", "CESAPI", &simulator.address) else { return };
    let own = own_shot(&simulator);
    assert_eq!(client.len(), 3);
    for (theirs, own) in client.iter().zip(&own) {
        assert!((theirs - own).abs() < SAME_MM, "{client:?} {own:?}");
    }
}

#[test]
fn geocompy_measures_what_the_driver_of_geocom_measures() {
    let simulator = Simulator::start(&[&["geocom"][..], &LISTEN].concat());
    let Some(client) = run("geocom.py", "geocompy", &simulator.address) else { return };
    let own = own_shot(&simulator);
    // East, north, height beside x, y, z: the same distance, and the same height.
    assert!((length(&client) - length(&own)).abs() < SAME_MM, "{client:?} {own:?}");
    assert!((client[2] - own[2]).abs() < SAME_MM, "{client:?} {own:?}");
}

#[test]
fn ndicapi_measures_what_the_driver_of_ndi_measures() {
    let simulator = Simulator::start(&[&["ndi"][..], &LISTEN].concat());
    let Some(client) = run("ndi.py", "ndicapy", &simulator.address) else { return };
    let own = own_shot(&simulator);
    // By text and by bytes.
    for point in client.chunks(3) {
        assert!(point.iter().zip(&own).all(|(theirs, own)| (theirs - own).abs() < SAME_MM), "{client:?} {own:?}");
    }
    assert_eq!(client.len(), 6);
}

#[test]
fn openshowvar_reads_the_joints_of_the_simulated_kuka() {
    let simulator = Simulator::start(&["emscon", "--listen", "127.0.0.1:0", "--robot", "kuka:127.0.0.1:0"]);
    let Some(client) = run("kuka.py", "py_openshowvar", simulator.robot.as_deref().unwrap()) else { return };
    // The middle of the joint ranges of the default robot.
    let middle = [0.0, 15.0, -5.0, 0.0, 0.0, 0.0];
    assert_eq!(client.len(), middle.len());
    assert!(client.iter().zip(middle).all(|(read, real)| (read - real).abs() < 0.05), "{client:?}");
}
