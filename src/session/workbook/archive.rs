//! ZIP archives, as far as workbooks need them: stored and deflated parts, without encryption.

use crate::text::printable;

/// Most bytes of a part when it is unpacked.
const LARGEST_PART: usize = 64 << 20;
/// Most parts.
const MOST_PARTS: usize = 10_000;

const END_OF_DIRECTORY: [u8; 4] = *b"PK\x05\x06";
const ENTRY_OF_DIRECTORY: [u8; 4] = *b"PK\x01\x02";
const LOCAL_ENTRY: [u8; 4] = *b"PK\x03\x04";
/// Length of the end of the directory without its comment.
const END_LENGTH: usize = 22;
const LONGEST_COMMENT: usize = 65_535;

/// Where a part is.
#[derive(Clone, Debug)]
struct Entry {
    name: String,
    method: u16,
    is_encrypted: bool,
    packed: usize,
    offset: usize,
}

#[derive(Debug)]
pub(super) struct Archive<'a> {
    content: &'a [u8],
    entries: Vec<Entry>,
}

fn two(content: &[u8], at: usize) -> Option<u16> {
    Some(u16::from_le_bytes(content.get(at..at.checked_add(2)?)?.try_into().ok()?))
}

fn four(content: &[u8], at: usize) -> Option<usize> {
    let value = u32::from_le_bytes(content.get(at..at.checked_add(4)?)?.try_into().ok()?);
    usize::try_from(value).ok()
}

impl<'a> Archive<'a> {
    pub(super) fn new(content: &'a [u8]) -> Result<Self, String> {
        let damaged = || "the archive is damaged or incomplete; save it again".to_owned();
        let from = content.len().saturating_sub(END_LENGTH + LONGEST_COMMENT);
        let tail = content.get(from..).unwrap_or_default();
        let end = tail.windows(4).rposition(|bytes| bytes == END_OF_DIRECTORY).ok_or_else(damaged)? + from;
        let count = usize::from(two(content, end + 10).ok_or_else(damaged)?);
        let mut at = four(content, end + 16).ok_or_else(damaged)?;
        if count > MOST_PARTS {
            return Err(format!("the archive has {count} parts; a workbook has a few dozen"));
        }
        let mut entries = Vec::with_capacity(count);
        for _ in 0..count {
            let (entry, next) = entry(content, at).ok_or_else(damaged)?;
            entries.push(entry);
            at = next;
        }
        Ok(Self { content, entries })
    }

    /// The text of a part; `None` if there is none of this name.
    pub(super) fn part(&self, name: &str) -> Result<Option<String>, String> {
        let Some(entry) = self.entries.iter().find(|entry| entry.name.eq_ignore_ascii_case(name)) else {
            return Ok(None);
        };
        let name = printable(name);
        if entry.is_encrypted {
            return Err("it has a password; save it without one".to_owned());
        }
        let damaged = || format!("'{name}' is damaged; save the workbook again");
        let packed = self.packed(entry).ok_or_else(damaged)?;
        let bytes = match entry.method {
            0 if packed.len() <= LARGEST_PART => packed.to_vec(),
            8 => miniz_oxide::inflate::decompress_to_vec_with_limit(packed, LARGEST_PART).map_err(|error| {
                if error.status == miniz_oxide::inflate::TINFLStatus::HasMoreOutput {
                    format!("'{name}' has more than {} MB; copy the table to a workbook of its own", LARGEST_PART >> 20)
                } else {
                    damaged()
                }
            })?,
            method => return Err(format!("'{name}' is packed by method {method}; save the workbook again")),
        };
        String::from_utf8(bytes).map(Some).map_err(|_not_utf8| damaged())
    }

    fn packed(&self, entry: &Entry) -> Option<&'a [u8]> {
        let at = entry.offset;
        if self.content.get(at..at.checked_add(4)?)? != LOCAL_ENTRY {
            return None;
        }
        let (name, extra) = (two(self.content, at.checked_add(26)?)?, two(self.content, at.checked_add(28)?)?);
        let start = at.checked_add(30)?.checked_add(usize::from(name))?.checked_add(usize::from(extra))?;
        self.content.get(start..start.checked_add(entry.packed)?)
    }
}

/// The entry of the directory at a byte, and where the next one begins.
fn entry(content: &[u8], at: usize) -> Option<(Entry, usize)> {
    if content.get(at..at.checked_add(4)?)? != ENTRY_OF_DIRECTORY {
        return None;
    }
    let length = |offset: usize| two(content, at.checked_add(offset)?).map(usize::from);
    let (name, extra, comment) = (length(28)?, length(30)?, length(32)?);
    let start = at.checked_add(46)?;
    let entry = Entry {
        name: String::from_utf8_lossy(content.get(start..start.checked_add(name)?)?).into_owned(),
        method: two(content, at.checked_add(10)?)?,
        is_encrypted: two(content, at.checked_add(8)?)? & 1 == 1,
        packed: four(content, at.checked_add(20)?)?,
        offset: four(content, at.checked_add(42)?)?,
    };
    Some((entry, start.checked_add(name)?.checked_add(extra)?.checked_add(comment)?))
}
