//! Escapes in trigger texts.

/// Bytes of a text with the escapes `\r`, `\n`, `\t`, `\0`, `\\` and `\x06`.
pub fn unescape(text: &str) -> Result<Vec<u8>, String> {
    let mut bytes = Vec::new();
    let mut characters = text.chars();
    while let Some(character) = characters.next() {
        if character != '\\' {
            let mut buffer = [0; 4];
            bytes.extend_from_slice(character.encode_utf8(&mut buffer).as_bytes());
            continue;
        }
        match characters.next() {
            Some('r') => bytes.push(b'\r'),
            Some('n') => bytes.push(b'\n'),
            Some('t') => bytes.push(b'\t'),
            Some('0') => bytes.push(0),
            Some('\\') => bytes.push(b'\\'),
            Some('x') => bytes.push(hexadecimal(characters.next(), characters.next())?),
            Some(other) => return Err(format!("unknown escape `\\{other}`: use \\r \\n \\t \\0 \\\\ or \\x06")),
            None => return Err("a single `\\` at the end: write `\\\\`".to_owned()),
        }
    }
    Ok(bytes)
}

fn hexadecimal(high: Option<char>, low: Option<char>) -> Result<u8, String> {
    let digit = |character: Option<char>| character.and_then(|c| c.to_digit(16)).and_then(|d| u8::try_from(d).ok());
    match (digit(high), digit(low)) {
        (Some(high), Some(low)) => Ok(high << 4 | low),
        _ => Err("`\\x` needs two hexadecimal digits, such as \\x06".to_owned()),
    }
}
