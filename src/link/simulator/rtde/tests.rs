//! Literal bytes of the simulated controller, so that it does not only agree with the link that it was written for.

use super::super::bench::MockCell;
use super::*;

/// What is answered to a request.
fn ask(simulator: &mut RtdeSimulator, request: &[u8]) -> Option<Output> {
    simulator.feed(request, &mut MockCell::default(), Moment::ZERO);
    simulator.next_output()
}

#[test]
fn the_published_requests_have_the_published_answers() {
    let mut simulator = RtdeSimulator::new(Vec::new());
    simulator.accept(Moment::ZERO);
    let bytes = |bytes: &[u8]| Some(Output::Bytes(bytes.to_vec()));
    assert_eq!(ask(&mut simulator, &[0x00, 0x05, 0x56, 0x00, 0x02]), bytes(&[0x00, 0x04, 0x56, 0x01]));
    let names = b"timestamp,actual_q";
    let head = [0x00, 0x1d, 0x4f, 0x40, 0x5f, 0x40, 0x00, 0x00, 0x00, 0x00, 0x00];
    let types = [&[0x00, 0x13, 0x4f, 0x01][..], b"DOUBLE,VECTOR6D"].concat();
    assert_eq!(ask(&mut simulator, &[&head[..], names].concat()), bytes(&types));
    assert_eq!(ask(&mut simulator, &[0x00, 0x03, 0x53]), bytes(&[0x00, 0x04, 0x53, 0x01]));
    assert_eq!(simulator.next_deadline(), Some(Duration::from_millis(8)));
    simulator.tick(&mut MockCell::default(), Duration::from_millis(8));
    let q: Vec<u8> = [0.1, -1.2, 1.3, -0.4, 0.5, -0.6].iter().flat_map(|value| f64::to_be_bytes(*value)).collect();
    let data = [&[0x00, 0x3c, 0x55, 0x01][..], &0.008_f64.to_be_bytes(), &q].concat();
    assert_eq!(simulator.next_output(), bytes(&data));
    assert_eq!(ask(&mut simulator, &[0x00, 0x03, 0x50]), bytes(&[0x00, 0x04, 0x50, 0x01]));
    assert_eq!(simulator.next_deadline(), None);
}

#[test]
fn unknown_names_are_not_found_and_nothing_starts() {
    let mut simulator = RtdeSimulator::new(Vec::new());
    simulator.accept(Moment::ZERO);
    let request = [&[0, 37, b'O'][..], &125_f64.to_be_bytes(), b"actual_q,actual_TCP_pose__"].concat();
    let answer = [&[0, 22, b'O', 0][..], b"VECTOR6D,NOT_FOUND"].concat();
    assert_eq!(ask(&mut simulator, &request), Some(Output::Bytes(answer)));
    assert_eq!(ask(&mut simulator, &[0, 3, b'S']), Some(Output::Bytes(vec![0, 4, b'S', 0])));
    assert_eq!(ask(&mut simulator, &[0, 0]), Some(Output::Close));
}
