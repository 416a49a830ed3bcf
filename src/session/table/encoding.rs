//! Bytes of a table into text.

use super::{Defect, TableErrors, TableProblem};

/// Windows-1252 at 0x80…0x9F, where it differs from Latin-1.
const WINDOWS: [char; 32] = [
    '€', '\u{81}', '‚', 'ƒ', '„', '…', '†', '‡', 'ˆ', '‰', 'Š', '‹', 'Œ', '\u{8d}', 'Ž', '\u{8f}', '\u{90}', '‘', '’',
    '“', '”', '•', '–', '—', '˜', '™', 'š', '›', 'œ', '\u{9d}', 'ž', 'Ÿ',
];

/// The text of `bytes`: UTF-8, UTF-16, or else Windows-1252, of which Latin-1 is a part. Numbers and units are ASCII and the same in
/// all of them, so that a wrong guess can spoil names but never a value.
///
/// # Errors
/// The file is no text, or damaged UTF-16.
pub(in crate::session) fn decode(bytes: &[u8], file: &str) -> Result<(String, Vec<TableProblem>), TableErrors> {
    let refused = |defect: Defect| TableErrors::new(file, vec![defect.of_table()], Vec::new());
    if bytes.starts_with(b"PK\x03\x04") {
        return Err(refused(Defect::Workbook));
    }
    if bytes.starts_with(&[0xd0, 0xcf, 0x11, 0xe0]) {
        return Err(refused(Defect::OldWorkbook));
    }
    let wide = utf16_order(bytes);
    if let Some((from_bytes, skipped)) = wide {
        let rest = bytes.get(skipped..).unwrap_or_default();
        let units: Vec<u16> = rest.as_chunks::<2>().0.iter().map(|pair| from_bytes(*pair)).collect();
        let text = String::from_utf16(&units).ok().filter(|_| rest.len() % 2 == 0);
        return text.map(|text| (text, Vec::new())).ok_or_else(|| refused(Defect::Utf16));
    }
    if bytes.contains(&0) {
        return Err(refused(Defect::NotText));
    }
    let text = match std::str::from_utf8(bytes) {
        Ok(text) => text.to_owned(),
        Err(_not_utf8) => bytes.iter().map(|byte| windows(*byte)).collect(),
    };
    Ok((text, Vec::new()))
}

/// How two bytes make a unit, and the length of the mark in front of the text.
type WideOrder = (fn([u8; 2]) -> u16, usize);

/// How the bytes of UTF-16 text make its units, and the length of the mark in front of it.
fn utf16_order(bytes: &[u8]) -> Option<WideOrder> {
    match bytes {
        [0xff, 0xfe, ..] => Some((u16::from_le_bytes, 2)),
        [0xfe, 0xff, ..] => Some((u16::from_be_bytes, 2)),
        // Without a mark: the first letters of a table are ASCII.
        [first, 0, second, 0, ..] if *first != 0 && *second != 0 => Some((u16::from_le_bytes, 0)),
        [0, first, 0, second, ..] if *first != 0 && *second != 0 => Some((u16::from_be_bytes, 0)),
        _ => None,
    }
}

fn windows(byte: u8) -> char {
    match byte {
        0x80..=0x9f => WINDOWS.get(usize::from(byte - 0x80)).copied().unwrap_or(char::REPLACEMENT_CHARACTER),
        _ => char::from(byte),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn encodings_of_spreadsheets_are_read() {
        let text = "q1_°;Größe\n1,5;2\n";
        let wide = |order: fn(u16) -> [u8; 2]| text.encode_utf16().flat_map(order).collect::<Vec<u8>>();
        let latin: Vec<u8> = text.chars().map(|c| u8::try_from(u32::from(c)).unwrap()).collect();
        for bytes in [
            text.as_bytes().to_vec(),
            [&[0xff, 0xfe][..], &wide(u16::to_le_bytes)].concat(),
            [&[0xfe, 0xff][..], &wide(u16::to_be_bytes)].concat(),
            wide(u16::to_le_bytes),
            wide(u16::to_be_bytes),
            latin,
        ] {
            assert_eq!(decode(&bytes, "t").unwrap().0, text);
        }
    }

    #[test]
    fn what_is_no_text_is_refused() {
        for bytes in [&b"a,b\n1,\x002\n"[..], b"PK\x03\x04rest", &[0xff, 0xfe, 1], &[0xff, 0xfe, 0, 0xd8]] {
            assert!(decode(bytes, "t").is_err());
        }
    }
}
