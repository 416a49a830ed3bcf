//! Robots that do not stand as they should while the instrument measures.

#![expect(clippy::disallowed_methods, reason = "deadlines of tests")]

use super::*;
use crate::link::protocol::Failure;

fn bench(faults: &[&str]) -> Bench {
    let mut bench = Bench::with(WireProtocol::Emscon, &Endpoint::Loopback, &[], Some(faults), None);
    bench.wired.connect().unwrap();
    bench
}

#[test]
fn the_joints_of_the_robot_come_with_the_point() {
    let mut bench = bench(&[]);
    let reading = bench.measure().unwrap();
    let told = reading.configuration.unwrap();
    let stood = bench.stage.lock().joints.positions.clone();
    let differences = told.iter().zip(&stood).map(|(a, b)| (a - b).abs());
    assert!(differences.fold(0.0, f64::max) < 1e-12, "{told:?}");
    let end = Instant::now() + DEADLINE;
    loop {
        let (live, _) = bench.wired.watch(Duration::from_millis(20)).unwrap();
        if live.is_still == Some(true) && live.joints.is_some() {
            return;
        }
        assert!(Instant::now() < end, "{live:?}");
    }
}

#[test]
fn every_kind_of_controller_reports_the_joints_and_its_moves_are_noticed() {
    for protocol in WireProtocol::ALL.into_iter().filter(|protocol| protocol.is_robot()) {
        let mut bench = Bench::with_robot(protocol, &[]);
        bench.wired.connect().unwrap();
        let stood = bench.stage.lock().joints.positions.clone();
        let reading = bench.measure().unwrap();
        let told = reading.configuration.unwrap();
        let difference = told.iter().zip(&stood).map(|(told, stood)| (told - stood).abs()).fold(0.0, f64::max);
        // Half a pulse of the axis with the fewest per degree.
        let resolution = if protocol == WireProtocol::Yaskawa { (0.5_f64 / 600.0).to_radians() } else { 1e-8 };
        assert!(difference < resolution && told.len() == 6, "{protocol}: {told:?}");
        assert!(reading.joint_scatter.is_some_and(|scatter| scatter.count >= 4), "{protocol}");
        bench.stage.lock().turns = 0.01;
        let error = bench.measure().unwrap_err();
        assert!(matches!(&error, LinkError::Robot(why) if why.contains("moved during")), "{protocol}: {error:?}");
    }
}

#[test]
fn a_robot_that_moves_is_waited_for_and_then_refused() {
    let mut bench = bench(&["moving@1x*"]);
    let before = bench.stage.shots();
    let error = bench.measure().unwrap_err();
    assert!(matches!(&error, LinkError::Robot(why) if why.contains("still moving")), "{error:?}");
    assert_eq!(bench.stage.shots(), before, "nothing is measured while it moves");
}

#[test]
fn a_robot_that_moves_while_it_is_measured_spoils_the_point() {
    let mut bench = bench(&[]);
    bench.measure().unwrap();
    bench.stage.lock().turns = 0.01;
    let error = bench.measure().unwrap_err();
    assert!(matches!(&error, LinkError::Robot(why) if why.contains("moved during")), "{error:?}");
    bench.stage.lock().turns = 0.0;
    bench.measure().unwrap();
}

#[test]
fn a_robot_with_a_person_in_the_cell_is_measured_and_its_state_is_kept() {
    for (fault, words) in [
        ("reduced@1x*", "robot: reduced (2)"),
        ("safeguard@1x*", "robot: safeguard stop (5)"),
        ("enabling-switch@1x*", "robot: enabling switch released (13)"),
    ] {
        let reading = bench(&[fault]).measure().unwrap();
        assert_eq!(reading.remarks.iter().map(|remark| remark.text.as_str()).collect::<Vec<_>>(), [words]);
    }
}

#[test]
fn joint_angles_are_the_mean_of_all_packets_with_their_scatter() {
    let mut bench = bench(&["encoder-noise@1x*", "noisy-speeds@1x*"]);
    let stood = bench.stage.lock().joints.positions.clone();
    let mut error: f64 = 0.0;
    for _ in 0..3 {
        let reading = bench.measure().unwrap();
        let scatter = reading.joint_scatter.unwrap();
        assert!(scatter.count >= 13, "{}", scatter.count);
        assert!(scatter.sigma.iter().all(|sigma| (5e-6..60e-6).contains(sigma)), "{:?}", scatter.sigma);
        let told = reading.configuration.unwrap();
        error = told.iter().zip(&stood).map(|(told, stood)| (told - stood).abs()).fold(error, f64::max);
    }
    // Single packets are up to 100 µrad away.
    assert!(error < 30e-6, "{error}");
}

#[test]
fn a_protective_stop_is_said_at_once_and_nothing_is_measured() {
    let mut bench = bench(&[]);
    bench.measure().unwrap();
    let before = bench.stage.shots();
    bench.stage.lock().joints.stopped = Some("protective stop".to_owned());
    let error = bench.measure().unwrap_err();
    assert!(matches!(&error, LinkError::Robot(why) if why.contains("is stopped")), "{error:?}");
    assert_eq!(bench.stage.shots(), before);
    bench.stage.lock().joints.stopped = None;
    bench.measure().unwrap();
}

#[test]
fn every_fault_of_the_controller_is_survived_or_said() {
    for name in fault_names(WireProtocol::Rtde) {
        let mut bench =
            Bench::with(WireProtocol::Emscon, &Endpoint::Loopback, &[], Some(&[&format!("{name}@2x1")]), None);
        // Where the fault comes early, it is the set-up that fails; it is tried again.
        let end = Instant::now() + DEADLINE;
        let mut said = Vec::new();
        while let Err(error) = bench.wired.connect() {
            said.push(error.to_string());
            assert!(Instant::now() < end, "{name}: {said:?}");
        }
        said.extend(bench.recover());
        let is_of_robot = |message: &String| message.starts_with("the robot: ") && !message.contains("instrument");
        assert!(said.iter().all(is_of_robot), "{name}: {said:?}");
    }
}

#[test]
fn a_controller_that_goes_away_is_told_and_comes_back() {
    let mut bench = bench(&["cut@20"]);
    bench.until(|news| matches!(news, LinkEvent::Down(cause) if cause.starts_with("robot: ")));
    bench.until(|news| matches!(news, LinkEvent::Up(name) if name.starts_with("robot: ")));
    bench.measure().unwrap();
}

/// What came before is not an order to measure later.
#[test]
fn a_shot_that_is_asked_for_while_the_controller_is_away_is_refused_at_once() {
    let mut bench = bench(&["cut@20"]);
    bench.until(|news| matches!(news, LinkEvent::Down(cause) if cause.starts_with("robot: ")));
    let (before, start) = (bench.stage.shots(), Instant::now());
    let error = bench.measure().unwrap_err();
    assert!(matches!(&error, LinkError::Controller(Failure::Disconnected(_))), "{error:?}");
    assert!(start.elapsed() < Duration::from_millis(300), "{:?}", start.elapsed());
    bench.until(|news| matches!(news, LinkEvent::Up(name) if name.starts_with("robot: ")));
    assert_eq!(bench.stage.shots(), before, "nothing is measured automatically");
}

#[test]
fn what_is_wrong_with_the_controller_is_told_with_what_helps() {
    for (fault, part, hint) in [
        ("old-protocol@1x*", "version 2 of the interface, which PolyScope has from 3.4 on", "check the version"),
        ("in-use@1x*", "another program", "close the other program"),
        ("not-found@1x*", "does not know", "check the version"),
    ] {
        let mut bench = Bench::with(WireProtocol::Emscon, &Endpoint::Loopback, &[], Some(&[fault]), None);
        let error = bench.wired.connect().unwrap_err();
        let LinkError::Controller(failure) = &error else { panic!("{fault}: {error:?}") };
        assert!(error.to_string().starts_with("the robot: ") && error.to_string().contains(part), "{fault}: {error}");
        assert!(failure.controller_hint().contains(hint), "{fault}: {}", failure.controller_hint());
        assert!(bench.wired.identity().is_some(), "{fault}: the instrument answers");
    }
}
