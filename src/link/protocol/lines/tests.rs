//! Ends of lines, and every split.

use super::LineSplitter;
use super::MAX_LINE;
use super::Piece;

fn pieces(splitter: &mut LineSplitter, bytes: &[u8]) -> Vec<Piece> {
    bytes.iter().filter_map(|&byte| splitter.push(byte)).collect()
}

fn lines(bytes: &[u8]) -> Vec<String> {
    pieces(&mut LineSplitter::default(), bytes)
        .into_iter()
        .map(|piece| match piece {
            Piece::Line(line) => String::from_utf8_lossy(&line).into_owned(),
            Piece::Overlong => "(overlong)".to_owned(),
        })
        .collect()
}

#[test]
fn every_end_of_line_ends_a_line() {
    assert_eq!(lines(b"a\rb\nc\r\nd\n\re\n\n\r\n"), ["a", "b", "c", "d", "e"]);
}

#[test]
fn nul_and_byte_order_mark_are_dropped() {
    assert_eq!(lines(b"\xEF\xBB\xBF1\0,2\n\0\n\xEF\xBB\xBF\n"), ["1,2"]);
}

#[test]
fn a_part_is_kept_until_the_rest_comes() {
    let mut splitter = LineSplitter::default();
    assert_eq!(pieces(&mut splitter, b"ab"), []);
    assert_eq!(splitter.pending(), 2);
    assert_eq!(pieces(&mut splitter, b"c\n"), [Piece::Line(b"abc".to_vec())]);
}

#[test]
fn the_longest_line_passes_and_one_more_byte_does_not() {
    let longest = vec![b'x'; MAX_LINE];
    let mut splitter = LineSplitter::default();
    let mut stream = longest.clone();
    stream.extend(b"\n");
    assert_eq!(pieces(&mut splitter, &stream), [Piece::Line(longest)]);
    let mut stream = vec![b'x'; 10_000];
    stream.extend(b"\nnext\n");
    assert_eq!(pieces(&mut splitter, &stream), [Piece::Overlong, Piece::Line(b"next".to_vec())]);
    assert_eq!(splitter.overlong(), 1);
    assert!(splitter.partial.capacity() <= 2 * MAX_LINE);
}

#[test]
fn the_rest_of_a_discarded_line_is_no_line() {
    let mut splitter = LineSplitter::default();
    assert_eq!(pieces(&mut splitter, b"12.5,10"), []);
    splitter.discard_partial();
    assert_eq!(pieces(&mut splitter, b"0.0,3.0\n1,2,3\n"), [Piece::Line(b"1,2,3".to_vec())]);
    splitter.discard_partial();
    assert_eq!(pieces(&mut splitter, b"4\n"), [Piece::Line(b"4".to_vec())]);
}

#[test]
fn a_datagram_ends_its_line() {
    let mut splitter = LineSplitter::default();
    assert_eq!(pieces(&mut splitter, b"1,2,3"), []);
    assert_eq!(splitter.end(), Some(Piece::Line(b"1,2,3".to_vec())));
    assert_eq!(splitter.end(), None);
}
