//! Compressed programs, such as the `.urp` files of PolyScope: gzip (RFC 1952) around deflate (RFC 1951). What is written is not
//! compressed again, which every reader of gzip accepts.

/// First bytes of a gzip file.
const MARK: [u8; 2] = [0x1f, 0x8b];
/// Largest content that is unpacked (bytes).
const LARGEST: usize = 256 << 20;
/// Longest stored block (bytes).
const BLOCK: usize = 0xffff;
/// Longest code of an alphabet (bits).
const LONGEST_CODE: usize = 15;

/// Whether these bytes are a gzip file.
pub fn is_packed(bytes: &[u8]) -> bool {
    bytes.starts_with(&MARK)
}

/// The content of a gzip file; `None` if it is damaged or too large.
pub fn unpacked(bytes: &[u8]) -> Option<Vec<u8>> {
    let start = behind_header(bytes)?;
    let mut bits = Bits { bytes, at: start, buffer: 0, count: 0 };
    let content = inflated(&mut bits)?;
    let trailer = bytes.get(bits.at.saturating_sub(bits.count / 8)..)?;
    let number = |at: usize| Some(u32::from_le_bytes(trailer.get(at..at + 4)?.try_into().ok()?));
    let is_intact = number(0)? == checksum(&content) && number(4)? as usize == content.len() & 0xffff_ffff;
    is_intact.then_some(content)
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
    bytes.extend_from_slice(&checksum(content).to_le_bytes());
    #[expect(clippy::cast_possible_truncation, reason = "the format states the length modulo 2^32")]
    bytes.extend_from_slice(&(content.len() as u32).to_le_bytes());
    bytes
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

struct Bits<'a> {
    bytes: &'a [u8],
    at: usize,
    buffer: u32,
    count: usize,
}

impl Bits<'_> {
    fn take(&mut self, count: usize) -> Option<usize> {
        while self.count < count {
            self.buffer |= u32::from(*self.bytes.get(self.at)?) << self.count;
            self.at += 1;
            self.count += 8;
        }
        let value = self.buffer & ((1 << count) - 1);
        self.buffer >>= count;
        self.count -= count;
        Some(value as usize)
    }

    /// Drops the rest of a byte.
    fn align(&mut self) {
        let rest = self.count % 8;
        self.buffer >>= rest;
        self.count -= rest;
    }
}

/// A Huffman code by the number of codes of each length, and its symbols in order.
struct Code {
    counts: [usize; LONGEST_CODE + 1],
    symbols: Vec<usize>,
}

impl Code {
    fn new(lengths: &[usize]) -> Self {
        let mut counts = [0; LONGEST_CODE + 1];
        for length in lengths {
            counts[(*length).min(LONGEST_CODE)] += 1;
        }
        counts[0] = 0;
        let of_length = |wanted: usize| (0..lengths.len()).filter(move |symbol| lengths[*symbol] == wanted);
        Self { counts, symbols: (1..=LONGEST_CODE).flat_map(of_length).collect() }
    }

    fn symbol(&self, bits: &mut Bits<'_>) -> Option<usize> {
        let (mut code, mut first, mut index) = (0, 0, 0);
        for count in &self.counts[1..] {
            code |= bits.take(1)?;
            if code < first + count {
                return self.symbols.get(index + code - first).copied();
            }
            index += count;
            first = (first + count) << 1;
            code <<= 1;
        }
        None
    }
}

fn inflated(bits: &mut Bits<'_>) -> Option<Vec<u8>> {
    let mut content = Vec::new();
    loop {
        let is_last = bits.take(1)? == 1;
        match bits.take(2)? {
            0 => stored(bits, &mut content)?,
            1 => compressed(bits, &mut content, &fixed())?,
            2 => {
                let codes = dynamic(bits)?;
                compressed(bits, &mut content, &codes)?;
            }
            _ => return None,
        }
        if content.len() > LARGEST {
            return None;
        }
        if is_last {
            return Some(content);
        }
    }
}

fn stored(bits: &mut Bits<'_>, content: &mut Vec<u8>) -> Option<()> {
    bits.align();
    let (length, inverse) = (bits.take(16)?, bits.take(16)?);
    if length != !inverse & BLOCK {
        return None;
    }
    // Whole bytes that are already in the buffer come first.
    let start = bits.at - bits.count / 8;
    content.extend_from_slice(bits.bytes.get(start..start + length)?);
    (bits.at, bits.buffer, bits.count) = (start + length, 0, 0);
    Some(())
}

/// The codes of literals and distances that a fixed block has.
fn fixed() -> [Code; 2] {
    let lengths: Vec<usize> =
        [(8, 144), (9, 112), (7, 24), (8, 8)].into_iter().flat_map(|(length, count)| vec![length; count]).collect();
    [Code::new(&lengths), Code::new(&[5; 30])]
}

fn dynamic(bits: &mut Bits<'_>) -> Option<[Code; 2]> {
    const ORDER: [usize; 19] = [16, 17, 18, 0, 8, 7, 9, 6, 10, 5, 11, 4, 12, 3, 13, 2, 14, 1, 15];
    let (literals, distances, given) = (257 + bits.take(5)?, 1 + bits.take(5)?, 4 + bits.take(4)?);
    let mut lengths = [0; 19];
    for place in ORDER.iter().take(given) {
        lengths[*place] = bits.take(3)?;
    }
    let code = Code::new(&lengths);
    let mut all: Vec<usize> = Vec::new();
    while all.len() < literals + distances {
        let (value, count) = match code.symbol(bits)? {
            16 => (*all.last()?, 3 + bits.take(2)?),
            17 => (0, 3 + bits.take(3)?),
            18 => (0, 11 + bits.take(7)?),
            length => (length, 1),
        };
        all.resize(all.len() + count, value);
    }
    let (first, second) = all.get(..literals + distances)?.split_at(literals);
    Some([Code::new(first), Code::new(second)])
}

fn compressed(bits: &mut Bits<'_>, content: &mut Vec<u8>, [literals, distances]: &[Code; 2]) -> Option<()> {
    while content.len() <= LARGEST {
        match literals.symbol(bits)? {
            literal @ 0..=255 => content.push(u8::try_from(literal).ok()?),
            256 => return Some(()),
            symbol => {
                let length = length_of(symbol - 257, bits)?;
                let distance = distance_of(distances.symbol(bits)?, bits)?;
                let start = content.len().checked_sub(distance)?;
                for at in start..start + length {
                    content.push(*content.get(at)?);
                }
            }
        }
    }
    None
}

/// Lengths grow by groups of four, with one more bit in each.
fn length_of(index: usize, bits: &mut Bits<'_>) -> Option<usize> {
    match index {
        0..=7 => Some(3 + index),
        8..=27 => {
            let extra = index / 4 - 1;
            Some(3 + ((4 + index % 4) << extra) + bits.take(extra)?)
        }
        28 => Some(258),
        _ => None,
    }
}

/// Distances grow by groups of two.
fn distance_of(index: usize, bits: &mut Bits<'_>) -> Option<usize> {
    match index {
        0..=3 => Some(1 + index),
        4..=29 => {
            let extra = index / 2 - 1;
            Some(1 + ((2 + index % 2) << extra) + bits.take(extra)?)
        }
        _ => None,
    }
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
