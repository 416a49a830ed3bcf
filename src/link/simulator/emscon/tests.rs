//! Literal bytes of the simulated tracker, so that it does not only agree with the link that it was written for.

use super::super::bench::{MockCell, hex};
use super::*;

/// A tracker to which somebody is connected.
fn connected(faults: &[Planned<EmsconFault>]) -> EmsconSimulator {
    let mut simulator = EmsconSimulator::new(faults.to_vec());
    simulator.accept(Moment::ZERO);
    simulator
}

/// What is answered to a request, packet by packet.
fn ask(simulator: &mut EmsconSimulator, request: &str) -> Vec<Vec<u8>> {
    simulator.feed(&hex(request), &mut MockCell::default(), Moment::ZERO);
    written(simulator)
}

fn written(simulator: &mut EmsconSimulator) -> Vec<Vec<u8>> {
    let outputs = std::iter::from_fn(|| simulator.next_output());
    let bytes = |output| match output {
        Output::Bytes(bytes) => bytes,
        Output::Close => panic!("hung up"),
    };
    outputs.map(bytes).collect()
}

#[test]
fn the_published_requests_have_the_published_answers() {
    let mut simulator = connected(&[]);
    let requests = [
        ("20000000 00000000 05000000 01000000 00000000 00000000 00000000 00000000", "05000000"),
        ("10000000 00000000 1A000000 00000000", "1A000000"),
        ("10000000 00000000 18000000 00000000", "18000000"),
        ("14000000 00000000 1C000000 F4010000 01000000", "1C000000"),
        (
            "30000000 00000000 2F000000 02000000 00000000 00000000 00000000 01000000 00000000 00000000 00000000 00000000",
            "2F000000",
        ),
        ("0C000000 00000000 34000000", "34000000"),
    ];
    for (request, command) in requests {
        let reply = format!("10000000 00000000 {command} 00000000");
        assert_eq!(ask(&mut simulator, request), [hex(&reply)], "{request}");
    }
    let accepted = ask(&mut simulator, "0C000000 00000000 31000000");
    assert_eq!(accepted, [hex("10000000 00000000 31000000 00000000"), hex("0C000000 08000000 1A000000")]);
    assert_eq!(simulator.next_deadline(), Some(Duration::from_millis(500)));
    simulator.tick(&mut MockCell::default(), Duration::from_millis(500));
    let done = written(&mut simulator);
    assert_eq!(done.len(), 2);
    let head = "9C000000 02000000 00000000 00000000 00000000 00000000004A9340 00000000003285C0 0000000000885640";
    assert_eq!((done[0].len(), &done[0][..44]), (156, &hex(head)[..]));
    assert_eq!(done[1], hex("0C000000 08000000 1B000000"));
}

#[test]
fn refusals_have_the_published_bytes() {
    let mut simulator = connected(&[Planned::once(EmsconFault::NotReady)]);
    let error = ask(&mut simulator, "0C000000 00000000 31000000");
    assert_eq!(error, [hex("10000000 01000000 31000000 14270000")]);
    assert_eq!(ask(&mut simulator, "0C000000 00000000 8C000000"), [hex("10000000 00000000 8C000000 02000000")]);
    let short = ask(&mut simulator, "10000000 00000000 05000000 01000000");
    assert_eq!(short, [hex("10000000 00000000 05000000 62000000")]);
}

#[test]
fn answers_have_the_published_sizes() {
    let mut simulator = connected(&[]);
    let sizes =
        [(1, 56), (2, 20), (6, 36), (13, 64), (15, 72), (25, 20), (27, 20), (29, 24), (41, 20), (42, 100), (48, 52)];
    for (command, size) in sizes {
        for answer in ask(&mut simulator, &format!("0C000000 00000000 {command:02X}000000")) {
            assert_eq!((answer.len(), i32_at(&answer, 0)), (size, i32::try_from(size).ok()), "command {command}");
            assert_eq!((i32_at(&answer, 8), i32_at(&answer, 12)), (Some(command), Some(0)));
        }
    }
}

#[test]
fn the_extended_result_and_the_position_have_the_published_sizes() {
    let mut simulator = connected(&[Planned::once(EmsconFault::ExtendedResult), Planned::once(EmsconFault::Flood)]);
    ask(&mut simulator, "0C000000 00000000 31000000");
    simulator.tick(&mut MockCell::default(), Duration::from_secs(3));
    let packets = written(&mut simulator);
    let (result, positions) = packets.split_last().unwrap();
    assert_eq!((result.len(), &result[..8]), (204, &hex("CC000000 09000000")[..]));
    assert!(!positions.is_empty());
    for position in positions {
        assert_eq!((position.len(), &position[..8]), (36, &hex("24000000 07000000")[..]));
    }
}

#[test]
fn a_request_that_cannot_be_one_hangs_up() {
    let mut simulator = connected(&[]);
    simulator.feed(&[0; 12], &mut MockCell::default(), Moment::ZERO);
    assert_eq!(simulator.next_output(), Some(Output::Close));
    assert_eq!(simulator.next_output(), None);
}
