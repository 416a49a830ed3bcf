//! Bytes of a table into text.

use super::{Defect, TableProblem};

/// The text of `bytes`. Lines that are not UTF-8 are reported, and read with replacement characters so that the rest of
/// the table can be checked as well.
pub(in crate::session) fn decode(bytes: &[u8], problems: &mut Vec<TableProblem>) -> String {
    if bytes.starts_with(&[0xff, 0xfe]) || bytes.starts_with(&[0xfe, 0xff]) {
        problems.push(Defect::Utf16.of_table());
        return String::new();
    }
    let mut text = String::with_capacity(bytes.len());
    let mut line = 1;
    let mut reported = 0;
    for chunk in bytes.utf8_chunks() {
        line += chunk.valid().bytes().filter(|&byte| byte == b'\n').count();
        text.push_str(chunk.valid());
        if let Some(&byte) = chunk.invalid().first() {
            if reported != line {
                problems.push(Defect::NotUtf8 { byte }.at(line));
                reported = line;
            }
            text.push(char::REPLACEMENT_CHARACTER);
        }
    }
    text
}
