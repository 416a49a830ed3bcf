//! Compressed programs, such as the `.urp` files of PolyScope: gzip (RFC 1952) around deflate (RFC 1951). What is written is not
//! compressed again, which every reader of gzip accepts.

/// First bytes of a gzip file.
const MARK: [u8; 2] = [0x1f, 0x8b];
/// Largest content that is unpacked (bytes).
const LARGEST: usize = 256 << 20;
/// Longest stored block (bytes).
const BLOCK: usize = 0xffff;

/// Whether these bytes are a gzip file.
pub fn is_packed(bytes: &[u8]) -> bool {
    bytes.starts_with(&MARK)
}

/// The content of a gzip file; `None` if it is damaged or too large.
pub fn unpacked(bytes: &[u8]) -> Option<Vec<u8>> {
    let (stream, trailer) = bytes.get(behind_header(bytes)?..)?.split_last_chunk::<8>()?;
    let content = miniz_oxide::inflate::decompress_to_vec_with_limit(stream, LARGEST).ok()?;
    trailer_of(&content).eq(trailer).then_some(content)
}

/// A gzip file with this content.
pub fn packed(content: &[u8]) -> Vec<u8> {
    let mut bytes = vec![MARK[0], MARK[1], 8, 0, 0, 0, 0, 0, 0, 255];
    let mut blocks = content.chunks(BLOCK).peekable();
    if blocks.peek().is_none() {
        bytes.extend_from_slice(&[1, 0, 0, 0xff, 0xff]);
    }
    while let Some(block) = blocks.next() {
        let length = u16::try_from(block.len()).unwrap_or(u16::MAX);
        bytes.push(u8::from(blocks.peek().is_none()));
        bytes.extend_from_slice(&length.to_le_bytes());
        bytes.extend_from_slice(&(!length).to_le_bytes());
        bytes.extend_from_slice(block);
    }
    bytes.extend_from_slice(&trailer_of(content));
    bytes
}

/// What stands behind a content: its checksum and its length.
fn trailer_of(content: &[u8]) -> [u8; 8] {
    #[expect(clippy::cast_possible_truncation, reason = "the format states the length modulo 2^32")]
    let length = content.len() as u32;
    let mut trailer = [0; 8];
    trailer[..4].copy_from_slice(&checksum(content).to_le_bytes());
    trailer[4..].copy_from_slice(&length.to_le_bytes());
    trailer
}

/// CRC-32 of RFC 1952.
fn checksum(content: &[u8]) -> u32 {
    !content.iter().fold(u32::MAX, |sum, byte| {
        (0..8).fold(sum ^ u32::from(*byte), |sum, _| if sum & 1 == 1 { (sum >> 1) ^ 0xedb8_8320 } else { sum >> 1 })
    })
}

/// The place behind the header with its optional parts.
fn behind_header(bytes: &[u8]) -> Option<usize> {
    let flags = *bytes.get(3).filter(|_| is_packed(bytes) && bytes.get(2) == Some(&8))?;
    let mut at = 10;
    if flags & 4 != 0 {
        at += 2 + usize::from(u16::from_le_bytes([*bytes.get(at)?, *bytes.get(at + 1)?]));
    }
    // Name and comment end with a zero.
    for flag in [8, 16] {
        if flags & flag != 0 {
            at += 1 + bytes.get(at..)?.iter().position(|byte| *byte == 0)?;
        }
    }
    Some(at + if flags & 2 != 0 { 2 } else { 0 })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_packed_is_unpacked() {
        for length in [0_u64, 1, 65_535, 65_536, 200_000] {
            let content: Vec<u8> = (0..length).map(|index| u8::try_from(index * index % 251).unwrap()).collect();
            assert_eq!(unpacked(&packed(&content)).as_deref(), Some(content.as_slice()));
        }
    }

    /// As the tool gzip packs it, in a fixed block.
    const HELLO: [u8; 29] = [
        0x1f, 0x8b, 0x08, 0x00, 0x00, 0x00, 0x00, 0x00, 0x02, 0xff, 0xcb, 0x48, 0xcd, 0xc9, 0xc9, 0x57, 0xc8, 0x40,
        0x27, 0xb9, 0x00, 0x00, 0x88, 0x59, 0x0b, 0x18, 0x00, 0x00, 0x00,
    ];

    #[test]
    fn damaged_files_are_refused() {
        let packed = packed(b"<URProgram/>");
        for at in 0..packed.len() {
            let mut broken = packed.clone();
            broken[at] ^= 0x41;
            // The header has bytes that do not matter.
            let is_same = unpacked(&broken).is_none_or(|content| content == b"<URProgram/>");
            assert!(is_same, "{at}");
            assert!(unpacked(&packed[..at]).is_none());
        }
        assert_eq!(unpacked(&HELLO).as_deref(), Some(b"hello hello hello hello\n".as_slice()));
    }
}
