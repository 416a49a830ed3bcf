//! Instruments whose connection or lines are not as they should be.

#![expect(clippy::disallowed_methods, reason = "deadlines and peers of tests")]

use std::io::{Read as _, Seek as _, Write as _};
use std::net::{TcpListener, TcpStream, UdpSocket};
use std::thread;

use super::*;
use crate::link::protocol::Failure;
use crate::session::reading::LiveReading;
use crate::session::wire::LinkChoice;

/// Every fault of a protocol over a real socket at its second occasion, with a good shot before it: whatever comes out is a shot that
/// was taken for it, and in the end the link measures again.
fn every_fault(protocol: WireProtocol, left_out: &[&str]) {
    for name in fault_names(protocol).into_iter().filter(|name| !left_out.contains(name)) {
        let mut bench = Bench::tcp(protocol, &[&format!("{name}@2x1")]);
        bench.wired.connect().unwrap_or_else(|error| panic!("{protocol} {name}: {error}"));
        for _ in 0..3 {
            drop(bench.measure());
        }
        let said = bench.recover();
        assert!(said.iter().all(|message| !message.is_empty()), "{protocol} {name}: {said:?}");
    }
}

#[test]
fn every_fault_of_emscon_gives_no_wrong_point_and_the_link_measures_again() {
    // Two take half a minute of real time, as commands may: they are tested with virtual time. Three begin with the connection.
    every_fault(WireProtocol::Emscon, &["mute", "warming-up", "in-use", "metres", "try-stuck"]);
}

#[test]
fn every_fault_of_lines_gives_no_wrong_point_and_the_link_measures_again() {
    every_fault(WireProtocol::Ascii, &[]);
}

#[test]
fn every_fault_of_geocom_gives_no_wrong_point_and_the_link_measures_again() {
    // Three take a quarter of a minute of real time, as requests may: they are tested with virtual time.
    every_fault(WireProtocol::Geocom, &["silent", "late-reply", "dead", "wrong-transaction"]);
}

#[test]
fn every_fault_of_ndi_gives_no_wrong_point_and_the_link_measures_again() {
    every_fault(WireProtocol::Ndi, &[]);
}

#[test]
fn what_comes_byte_by_byte_or_joined_or_in_halves_is_the_same() {
    for (protocol, fault) in [
        (WireProtocol::Emscon, "drip@1x*"),
        (WireProtocol::Emscon, "joined@1x*"),
        (WireProtocol::Ascii, "halves@1x9"),
        (WireProtocol::Geocom, "half-line@1x9"),
        (WireProtocol::Ndi, "halves@1x9"),
    ] {
        let mut bench = Bench::tcp(protocol, &[fault]);
        bench.wired.connect().unwrap_or_else(|error| panic!("{protocol} {fault}: {error}"));
        for _ in 0..3 {
            bench.measure().unwrap_or_else(|error| panic!("{protocol} {fault}: {error}"));
        }
    }
}

#[test]
fn a_serial_line_carries_the_same_points() {
    for protocol in [WireProtocol::Ascii, WireProtocol::Geocom, WireProtocol::Ndi] {
        let mut bench = Bench::with(protocol, &Endpoint::PseudoTerminal, &[], None, None);
        bench.wired.connect().unwrap();
        let reading = bench.measure().unwrap();
        assert_eq!(reading.shots, 1);
    }
}

#[test]
fn a_link_that_dies_in_mid_packet_fails_the_shot_comes_back_and_measures_nothing_by_itself() {
    for (protocol, fault) in [
        (WireProtocol::Emscon, "cut-20@2"),
        (WireProtocol::Ascii, "disconnect-mid-line@2"),
        (WireProtocol::Geocom, "disconnect-mid-line@2"),
    ] {
        let mut bench = Bench::tcp(protocol, &[fault]);
        bench.wired.connect().unwrap();
        bench.measure().unwrap();
        let error = bench.measure().unwrap_err();
        let LinkError::Instrument(failure @ Failure::Disconnected(_)) = &error else { panic!("{protocol}: {error:?}") };
        assert!(failure.to_string().starts_with("the connection was lost"), "{failure}");
        assert!(failure.hint().contains("reconnects automatically"), "{}", failure.hint());
        let taken = bench.stage.shots();
        bench.until(|news| matches!(news, LinkEvent::Up(_)));
        assert_eq!(bench.stage.shots(), taken, "{protocol}: nobody has asked for a shot");
        bench.measure().unwrap();
    }
}

#[test]
fn settings_that_lie_are_found_in_the_set_up_and_said() {
    for (fault, part) in [
        ("metres@1x*", "the instrument has a wrong setting"),
        ("try-stuck@1x*", "the instrument has a wrong setting"),
        ("in-use@1x*", "in use by another program"),
        ("warming-up@1x*", "not ready"),
    ] {
        let mut bench = Bench::tcp(WireProtocol::Emscon, &[fault]);
        let mut told = Vec::new();
        // A tracker that warms up is waited for; here nobody has so much time.
        let error = if fault.starts_with("warming") {
            let end = Instant::now() + Duration::from_millis(1500);
            bench.wired.connect_while(&|| Instant::now() < end, &mut |news| told.push(news)).unwrap_err()
        } else {
            bench.wired.connect().unwrap_err()
        };
        let waits = |news: &LinkEvent| matches!(news, LinkEvent::Notice(text) if text.contains("warming up"));
        let is_said = error.to_string().contains(part) || (error == LinkError::Cancelled && told.iter().any(waits));
        assert!(is_said, "{fault}: {error}");
    }
}

#[test]
fn points_in_another_unit_are_refused() {
    for (protocol, fault) in [(WireProtocol::Emscon, "silent-metres@1"), (WireProtocol::Ascii, "wrong-unit@1")] {
        let mut bench = Bench::tcp(protocol, &[fault]);
        bench.wired.connect().unwrap();
        let error = bench.measure().unwrap_err();
        assert!(matches!(error, LinkError::Instrument(Failure::Unusable(_))), "{protocol}: {error:?}");
        bench.measure().unwrap();
    }
}

fn choice(address: &str) -> LinkChoice {
    LinkChoice { address: address.to_owned(), ..LinkChoice::default() }
}

#[test]
fn what_is_not_stable_is_tried_three_times_and_then_said() {
    let mut bench = Bench::tcp(WireProtocol::Emscon, &["bad-status@1x2"]);
    bench.wired.connect().unwrap();
    bench.measure().unwrap();
    let mut bench = Bench::tcp(WireProtocol::Emscon, &["bad-status@1x3"]);
    bench.wired.connect().unwrap();
    let error = bench.measure().unwrap_err();
    assert!(matches!(error, LinkError::Instrument(Failure::Unstable(_))), "{error:?}");
    bench.measure().unwrap();
}

#[test]
fn a_shot_that_states_a_much_larger_sigma_than_usual_is_no_point() {
    let mut bench = Bench::tcp(WireProtocol::Emscon, &[]);
    bench.wired.connect().unwrap();
    for _ in 0..5 {
        bench.measure().unwrap();
    }
    bench.stage.lock().sigma = 0.2e-3;
    let error = bench.measure().unwrap_err();
    let LinkError::Instrument(Failure::Unstable(why)) = &error else { panic!("{error:?}") };
    assert_eq!(why, "its stated sigma is 0.346 mm, usually 0.009 mm");
    // What is more than usual, but still small, is a point: it stands farther away.
    bench.stage.lock().sigma = 20e-6;
    bench.measure().unwrap();
}

#[test]
fn datagrams_are_lines_and_half_a_datagram_is_none() {
    let port = UdpSocket::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
    let options = Some("UDP xyz+time".to_owned());
    let mut wired =
        Wired::new(&LinkChoice { options, ..choice(&format!("ascii:udp:127.0.0.1:{port}")) }, None).unwrap();
    wired.connect().unwrap();
    let stop = Arc::new(AtomicBool::new(false));
    let ended = Arc::clone(&stop);
    let sender = thread::spawn(move || {
        let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
        let mut number = 0_u32;
        while !ended.load(Ordering::Relaxed) {
            number += 1;
            // Without a line end: a datagram is whole.
            let line = format!("{:.4},-678.25,90.125,{number}", 1234.0 + f64::from(number));
            for text in ["1234.5,-678", line.as_str()] {
                // Nobody may listen yet.
                drop(socket.send_to(text.as_bytes(), ("127.0.0.1", port)));
            }
            thread::park_timeout(Duration::from_millis(5));
        }
    });
    let mut points: Vec<Point3<f64>> = Vec::new();
    let end = Instant::now() + DEADLINE;
    while points.len() < 3 {
        match wired.measure(&request(1), &|| true) {
            Ok(reading) => points.push(reading.point),
            Err(error) => assert!(matches!(error, LinkError::Instrument(Failure::Garbled(_))), "{error:?}"),
        }
        assert!(Instant::now() < end, "{points:?}");
    }
    stop.store(true, Ordering::Relaxed);
    sender.join().unwrap();
    assert!(points.iter().all(|point| (point.y + 0.67825).abs() < 1e-9 && (point.z - 0.090_125).abs() < 1e-9));
    assert!(points.windows(2).all(|pair| pair[1].x > pair[0].x), "{points:?}");
}

#[test]
fn a_port_where_nobody_listens_is_said_with_what_to_look_at() {
    let port = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
    let mut wired = Wired::new(&choice(&format!("emscon:127.0.0.1:{port}")), None).unwrap();
    let error = wired.connect().unwrap_err();
    assert!(matches!(error, LinkError::Instrument(Failure::Unreachable(_))), "{error:?}");
    assert!(error.to_string().contains("nothing listens there"), "{error}");
}

#[test]
fn a_serial_port_that_is_in_use_or_missing_is_said() {
    let (_master, slave) = serialport::TTYPort::pair().unwrap();
    let device = serialport::SerialPort::name(&slave).unwrap();
    let held = serialport::new(&device, 9600).open().unwrap();
    let refused = |address: &str| Wired::new(&choice(address), None).unwrap().connect().unwrap_err().to_string();
    let error = refused(&format!("geocom:serial:{device}"));
    assert!(error.contains("another program may be using it"), "{error}");
    drop(held);
    let error = refused("geocom:serial:/dev/there-is-no-such-port");
    assert!(error.contains("is the adapter plugged in?"), "{error}");
}

#[test]
fn addresses_of_the_wrong_kind_are_refused_before_anything_is_opened() {
    let refused = |choice: &LinkChoice| Wired::new(choice, None).unwrap_err().to_string();
    assert!(refused(&choice("rtde:127.0.0.1")).contains("not SMR positions"));
    let with_robot = LinkChoice { robot: Some("emscon:127.0.0.1".to_owned()), ..choice("emscon:127.0.0.1") };
    assert!(refused(&with_robot).contains("is not a robot controller"));
    let with_options = LinkChoice { options: Some("(speed: 3)".to_owned()), ..choice("emscon:127.0.0.1") };
    assert!(refused(&with_options).contains("speed"));
}

/// A peer that prints numbered lines as fast as they are taken.
fn flood() -> u16 {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let port = listener.local_addr().unwrap().port();
    thread::spawn(move || {
        let Ok((mut stream, _)) = listener.accept() else { return };
        let mut number = 0_u32;
        loop {
            let mut lines = String::new();
            for _ in 0..1000 {
                number += 1;
                writeln!(lines, "{:.4},-678.25,90.125", 1000.0 + 1e-4 * f64::from(number)).unwrap();
            }
            // Ends with the other side.
            if stream.write_all(lines.as_bytes()).is_err() {
                return;
            }
        }
    });
    port
}

#[test]
fn a_flood_of_lines_keeps_nobody_waiting_and_gives_lines_that_came_after_the_question() {
    let mut wired = Wired::new(&choice(&format!("ascii:127.0.0.1:{}", flood())), None).unwrap();
    wired.connect().unwrap();
    let mut before = 0.0;
    for _ in 0..5 {
        let reading = wired.measure(&request(1), &|| true).unwrap();
        assert!(reading.point.x > before && (reading.point.y + 0.67825).abs() < 1e-9, "{:?}", reading.point);
        before = reading.point.x;
    }
    // Whoever asks waits as long as asked, and not until the flood ends.
    let start = Instant::now();
    for _ in 0..20 {
        drop(wired.watch(Duration::from_millis(1)));
    }
    assert!(start.elapsed() < Duration::from_secs(5), "{:?}", start.elapsed());
}

#[test]
fn a_peer_that_says_nothing_is_said_to_be_silent() {
    let mut bench = Bench::tcp(WireProtocol::Ascii, &["silent@2"]);
    bench.wired.connect().unwrap();
    bench.measure().unwrap();
    let error = bench.measure().unwrap_err();
    assert!(matches!(error, LinkError::Instrument(Failure::Silent { .. })), "{error:?}");
    bench.measure().unwrap();
}

#[test]
fn a_measurement_can_be_given_up() {
    let mut bench = Bench::tcp(WireProtocol::Emscon, &["silence@1x*"]);
    bench.wired.connect().unwrap();
    assert_eq!(bench.wired.measure(&request(1), &|| false), Err(LinkError::Cancelled));
}

#[test]
fn somebody_may_connect_to_this_program() {
    let port = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
    let mut wired = Wired::new(&choice(&format!("ascii:listen:127.0.0.1:{port}")), None).unwrap();
    let end = Instant::now() + DEADLINE;
    let mut stream = loop {
        match TcpStream::connect(("127.0.0.1", port)) {
            Ok(stream) => break stream,
            Err(error) => assert!(Instant::now() < end, "{error}"),
        }
    };
    let stop = Arc::new(AtomicBool::new(false));
    let ended = Arc::clone(&stop);
    let printer = thread::spawn(move || {
        let mut number = 0_u32;
        while !ended.load(Ordering::Relaxed) {
            number += 1;
            if stream.write_all(format!("{:.4},-678.25,90.125\n", 1234.0 + f64::from(number)).as_bytes()).is_err() {
                return;
            }
            thread::yield_now();
        }
    });
    wired.connect().unwrap();
    let reading = wired.measure(&request(1), &|| true).unwrap();
    assert!((reading.point.y + 0.67825).abs() < 1e-9);
    stop.store(true, Ordering::Relaxed);
    printer.join().unwrap();
}

#[test]
fn the_raw_log_holds_what_came_and_went() {
    let mut file = tempfile::tempfile().unwrap();
    let log = RawLog::new(file.try_clone().unwrap());
    let mut bench = Bench::with(WireProtocol::Ascii, &Endpoint::Loopback, &[], None, Some(&log));
    bench.wired.connect().unwrap();
    let reading = bench.measure().unwrap();
    let mut text = String::new();
    file.rewind().unwrap();
    file.read_to_string(&mut text).unwrap();
    let bytes = |direction: &str| -> String {
        text.lines().filter_map(|line| line.split_once(&format!(" ascii {direction} "))).map(|(_, hex)| hex).collect()
    };
    assert_eq!(bytes("out"), "4d0d");
    let x = format!("{:.4}", reading.point.x * 1e3);
    let hex: String = x.bytes().fold(String::new(), |mut hex, byte| {
        write!(hex, "{byte:02x}").unwrap();
        hex
    });
    assert!(bytes("in").contains(&hex), "{text}");
}

#[test]
fn whatever_a_simulator_can_say_of_itself_says_that_it_is_simulated() {
    for (protocol, says_so) in [
        (WireProtocol::Emscon, true),
        (WireProtocol::Geocom, true),
        (WireProtocol::Ndi, true),
        // Lines of points carry no name.
        (WireProtocol::Ascii, false),
    ] {
        let identity = Bench::tcp(protocol, &[]).wired.connect().unwrap();
        assert_eq!(identity.to_lowercase().contains("simulated"), says_so, "{protocol}: {identity}");
    }
}

#[test]
fn a_scale_of_the_tracker_refuses_the_link_and_a_shift_is_warned_of() {
    let error = Bench::tcp(WireProtocol::Emscon, &["scaled@1x*"]).wired.connect().unwrap_err();
    assert_eq!(error, LinkError::Instrument(Failure::Scaled(1.0001)));
    let mut bench = Bench::tcp(WireProtocol::Emscon, &["moved@1x*"]);
    let identity = bench.wired.connect().unwrap();
    let warnings = bench.wired.warnings();
    assert!(matches!(warnings.as_slice(), [text] if text.contains("distances stay right") && identity.contains(text)));
}

/// A peer that prints lines until it is silenced; the connection stays.
fn printing(stop: &Arc<AtomicBool>) -> u16 {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let port = listener.local_addr().unwrap().port();
    let stop = Arc::clone(stop);
    thread::spawn(move || {
        let Ok((mut stream, _)) = listener.accept() else { return };
        let mut number = 0_u32;
        while !stop.load(Ordering::Relaxed) {
            number += 1;
            let line = format!("{:.4},-678.25,90.125\n", 1000.0 + 1e-4 * f64::from(number));
            if stream.write_all(line.as_bytes()).is_err() {
                return;
            }
            thread::park_timeout(Duration::from_millis(20));
        }
        // Ends with the other side.
        drop(stream.read(&mut [0; 1]));
    });
    port
}

/// Looks until it is seen.
fn until_seen(wired: &mut Wired, what: impl Fn(&LiveReading) -> bool) {
    let end = Instant::now() + DEADLINE;
    loop {
        let (live, _) = wired.watch(Duration::from_millis(20)).unwrap();
        if what(&live) {
            return;
        }
        assert!(Instant::now() < end, "{live:?}");
    }
}

#[test]
fn an_instrument_that_falls_silent_is_said_to_be_and_nothing_old_is_shown_as_now() {
    let stop = Arc::new(AtomicBool::new(false));
    let mut wired = Wired::new(&choice(&format!("ascii:127.0.0.1:{}", printing(&stop))), None).unwrap();
    wired.connect().unwrap();
    until_seen(&mut wired, |live| live.point.is_some() && live.silent.is_none() && !live.is_blind);
    stop.store(true, Ordering::Relaxed);
    until_seen(&mut wired, |live| {
        assert!(live.silent.is_none() || live.point.is_none(), "{live:?}");
        live.silent.is_some_and(|seconds| seconds >= 2.0)
    });
    // The same is seen while a measurement waits for it.
    let poll = wired.live_poll().unwrap();
    let end = Instant::now() + DEADLINE;
    let silent = || poll().silent.is_some_and(|seconds| seconds >= 2.5) && poll().point.is_none();
    let result = wired.measure(&request(1), &|| !silent() && Instant::now() < end);
    assert_eq!(result, Err(LinkError::Cancelled));
    assert!(silent());
}

#[test]
fn an_instrument_without_a_live_view_is_not_said_to_see_nothing() {
    for (protocol, is_blind) in [(WireProtocol::Geocom, true), (WireProtocol::Ascii, true), (WireProtocol::Ndi, false)]
    {
        let mut bench = Bench::tcp(protocol, &[]);
        bench.wired.connect().unwrap();
        until_seen(&mut bench.wired, |live| {
            live.is_blind == is_blind && live.silent.is_none() && live.point.is_none() == is_blind
        });
    }
}

#[test]
fn who_takes_the_connection_and_says_nothing_is_perhaps_another_device() {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let port = listener.local_addr().unwrap().port();
    let mut wired = Wired::new(&choice(&format!("ndi:127.0.0.1:{port}")), None).unwrap();
    let error = wired.connect().unwrap_err();
    let LinkError::Instrument(failure @ Failure::Foreign(why)) = &error else { panic!("{error:?}") };
    assert!(why.contains("sent nothing for 2 s"), "{why}");
    assert!(failure.hint().contains("the port"), "{}", failure.hint());
    drop(listener);
}

#[test]
fn instruments_with_motors_turn_to_the_reflector_and_say_where_there_is_none() {
    for protocol in [WireProtocol::Emscon, WireProtocol::Geocom] {
        let mut bench = Bench::tcp(protocol, &[]);
        bench.wired.connect().unwrap();
        let there = Stage::point(bench.stage.shots());
        bench.wired.point(there, &|| true).unwrap();
        let error = bench.wired.point(Point3::new(-1.0, 0.5, 0.4), &|| true).unwrap_err();
        assert!(matches!(&error, LinkError::Instrument(_)), "{protocol}: {error:?}");
        // It measures as before.
        bench.measure().unwrap();
    }
    let mut bench = Bench::tcp(WireProtocol::Ascii, &[]);
    bench.wired.connect().unwrap();
    let error = bench.wired.point(Stage::point(0), &|| true).unwrap_err();
    assert!(error.to_string().contains("cannot be turned"), "{error}");
}
