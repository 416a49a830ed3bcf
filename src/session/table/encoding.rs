//! Bytes of a table into text.

use super::{Defect, TableErrors, TableProblem};

/// The text of `bytes`, and its lines that are not UTF-8. They are read with replacement characters so that the rest of the
/// table can be checked as well.
///
/// # Errors
/// The file is UTF-16.
pub(in crate::session) fn decode(bytes: &[u8], file: &str) -> Result<(String, Vec<TableProblem>), TableErrors> {
    if bytes.starts_with(&[0xff, 0xfe]) || bytes.starts_with(&[0xfe, 0xff]) {
        return Err(TableErrors::new(file, vec![Defect::Utf16.of_table()], Vec::new()));
    }
    let mut problems = Vec::new();
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
    Ok((text, problems))
}
