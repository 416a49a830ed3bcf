//! The text of a URDF: encodings, and the small sins of files that other readers forgive.

use std::borrow::Cow;

/// Encodings of which every byte is a character, the same in the ASCII part. A URDF says nothing with the others.
const SINGLE_BYTE: [&str; 6] = ["iso-8859-1", "iso-8859-15", "latin1", "latin-1", "windows-1252", "us-ascii"];

/// The text of an XML file: UTF-8, UTF-16 with a byte order mark, or what it declares. A declaration of another encoding is changed to
/// UTF-8, which the text is from here on.
///
/// # Errors
/// The bytes are not what the file declares, in words.
pub fn decode_xml(bytes: &[u8]) -> Result<String, String> {
    let wide = |from: fn([u8; 2]) -> u16| {
        let units: Vec<u16> =
            bytes.get(2..).unwrap_or_default().as_chunks::<2>().0.iter().map(|pair| from(*pair)).collect();
        String::from_utf16(&units).map_err(|_damaged| "it is damaged UTF-16 text; save it as UTF-8".to_owned())
    };
    let text = match bytes {
        [0xff, 0xfe, ..] => wide(u16::from_le_bytes)?,
        [0xfe, 0xff, ..] => wide(u16::from_be_bytes)?,
        _ => match std::str::from_utf8(bytes) {
            Ok(text) => text.to_owned(),
            Err(error) => {
                let declared = declared(bytes);
                if !declared.as_deref().is_some_and(|name| SINGLE_BYTE.contains(&name)) {
                    let place = error.valid_up_to();
                    let stated = declared.map_or_else(
                        || "it declares no other encoding".to_owned(),
                        |name| format!("it declares '{name}'"),
                    );
                    return Err(format!("it is not UTF-8 text (byte {place}), and {stated}; save it as UTF-8"));
                }
                bytes.iter().map(|byte| char::from(*byte)).collect()
            }
        },
    };
    Ok(as_utf8(&text))
}

/// The encoding that a declaration names, in lower case.
fn declared(bytes: &[u8]) -> Option<String> {
    let head: String = bytes.iter().take(200).map(|byte| char::from(*byte)).collect();
    encoding_of(&head).map(|(from, to)| head.get(from..to).unwrap_or_default().to_lowercase())
}

/// Where the name of the encoding is in a declaration.
fn encoding_of(text: &str) -> Option<(usize, usize)> {
    let end = text.find("?>")?;
    let declaration = text.get(..end).filter(|declaration| declaration.contains("<?xml"))?;
    let at = declaration.find("encoding")?;
    let quote = declaration.get(at..)?.find(['"', '\''])? + at;
    let mark = declaration.get(quote..)?.chars().next()?;
    let length = declaration.get(quote + 1..)?.find(mark)?;
    Some((quote + 1, quote + 1 + length))
}

fn as_utf8(text: &str) -> String {
    match encoding_of(text) {
        Some((from, to)) => {
            format!("{}UTF-8{}", text.get(..from).unwrap_or_default(), text.get(to..).unwrap_or_default())
        }
        None => text.to_owned(),
    }
}

/// A text of the same length that the XML reader takes: a declaration after blank lines, which other readers forgive, becomes blanks.
pub(super) fn parseable(text: &str) -> Cow<'_, str> {
    let body = text.strip_prefix('\u{feff}').unwrap_or(text);
    let start = body.trim_start();
    let before = text.len() - start.len();
    let end = start.find("?>").map(|end| end + 2);
    match end {
        Some(end) if start.starts_with("<?xml") && body.len() != start.len() => {
            let blank = |c: char| if c == '\n' { '\n' } else { ' ' };
            let declaration = start.get(..end).unwrap_or_default();
            let blanks: String =
                declaration.chars().flat_map(|c| std::iter::repeat_n(blank(c), c.len_utf8())).collect();
            let (head, tail) = (text.get(..before).unwrap_or_default(), start.get(end..).unwrap_or_default());
            Cow::Owned(format!("{head}{blanks}{tail}"))
        }
        _ => Cow::Borrowed(text),
    }
}

/// What to do about a value that only xacro can calculate.
pub(super) fn beside_xacro(text: &str) -> &'static str {
    if text.contains("${") || text.contains("$(") {
        "; it is xacro: expand it first, 'xacro FILE.xacro > FILE.urdf'"
    } else {
        ""
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn declared_encodings_are_read_and_declared_as_what_they_are_then() {
        let text = "<?xml version=\"1.0\" encoding='ISO-8859-1'?><robot name='Ger\u{e4}t'/>";
        let latin: Vec<u8> = text.chars().map(|c| u8::try_from(u32::from(c)).unwrap()).collect();
        let expected = text.replace("ISO-8859-1", "UTF-8");
        assert_eq!(decode_xml(&latin), Ok(expected.clone()));
        let wide: Vec<u8> = text.encode_utf16().flat_map(u16::to_be_bytes).collect();
        assert_eq!(decode_xml(&[&[0xfe, 0xff][..], &wide].concat()), Ok(expected));
        let undeclared = decode_xml(b"<robot name='\xe4'/>").unwrap_err();
        assert!(undeclared.contains("save it as UTF-8"), "{undeclared}");
    }

    #[test]
    fn a_late_declaration_becomes_blanks() {
        let text = "\n\n<?xml version='1.0'?>\n<robot/>";
        let read = parseable(text);
        assert_eq!((read.len(), read.trim()), (text.len(), "<robot/>"));
        assert_eq!(read.lines().count(), text.lines().count());
        assert_eq!(parseable("<?xml version='1.0'?><robot/>"), "<?xml version='1.0'?><robot/>");
    }
}
