//! Tags of XML with the places of their attributes, as far as robot programs need it.

use std::ops::Range;

use super::lexer::{as_str, latin};
use super::motion::{Reason, Slot};

/// Tags of a file, and its program texts.
pub(super) struct Xml<'a> {
    pub(super) text: &'a [u8],
    pub(super) tags: Vec<Tag>,
    pub(super) code: Vec<(Range<usize>, usize)>,
}

pub(super) struct Tag {
    pub(super) name: String,
    pub(super) line: usize,
    pub(super) attributes: Vec<(String, Range<usize>)>,
    pub(super) is_closing: bool,
    pub(super) is_empty: bool,
    /// Place of the name's end, for attributes that are inserted.
    pub(super) name_end: usize,
}

impl Tag {
    pub(super) fn place(&self, name: &str) -> Option<Range<usize>> {
        self.attributes.iter().find(|(found, _)| found == name).map(|(_, place)| place.clone())
    }

    pub(super) fn value(&self, text: &[u8], name: &str) -> Option<String> {
        self.place(name).map(|place| latin(text.get(place).unwrap_or_default()))
    }

    /// Places of these numbers. A missing one is zero and would be inserted behind the one before it.
    pub(super) fn numbers(&self, text: &[u8], names: &[String]) -> Result<(Vec<Slot>, Vec<f64>), Reason> {
        let mut slots = Vec::new();
        let mut numbers = Vec::new();
        let mut behind =
            self.attributes.iter().find(|(name, _)| name == "key").map_or(self.name_end, |(_, key)| key.end + 1);
        for name in names {
            if let Some(place) = self.place(name) {
                let value = as_str(text, place.clone()).trim().parse::<f64>().ok();
                numbers.push(value.filter(|value| value.is_finite()).ok_or(Reason::Unreadable)?);
                behind = place.end + 1;
                slots.push(Slot::at(place));
            } else {
                numbers.push(0.0);
                slots.push(Slot { attribute: Some(name.clone()), ..Slot::at(behind..behind) });
            }
        }
        Ok((slots, numbers))
    }
}

impl<'a> Xml<'a> {
    pub(super) fn read(text: &'a [u8]) -> Self {
        let mut xml = Self { text, tags: Vec::new(), code: Vec::new() };
        let (mut at, mut line, mut counted) = (0, 1, 0);
        // A mark that is missing behind some place is missing behind every later one: the file is searched only once.
        while let Some(start) = next(text, at, b"<") {
            line += newlines(text, counted..start);
            counted = start;
            let rest = text.get(start..).unwrap_or_default();
            if rest.starts_with(b"<!--") {
                at = next(text, start, b"-->").map_or(text.len(), |end| end + 3);
            } else if rest.starts_with(b"<![CDATA[") {
                let end = next(text, start, b"]]>").unwrap_or(text.len());
                xml.code.push((start + 9..end, line));
                at = end;
            } else {
                at = xml.tag(start, line);
            }
        }
        xml
    }

    /// Reads a tag and returns the place behind it. A program text without CDATA follows its `Code` tag.
    fn tag(&mut self, start: usize, line: usize) -> usize {
        let text = self.text;
        let is_closing = text.get(start + 1) == Some(&b'/');
        let name_start = start + 1 + usize::from(is_closing);
        let mut at = while_in(text, name_start, |byte| {
            byte.is_ascii_alphanumeric() || matches!(byte, b':' | b'_' | b'?' | b'!')
        });
        let name = as_str(text, name_start..at).to_owned();
        let name_end = at;
        let mut attributes = Vec::new();
        let mut is_empty = false;
        // A tag or a text without its end is broken: nothing in it is changed.
        let (mut is_closed, mut is_torn) = (false, false);
        while let Some(&byte) = text.get(at) {
            match byte {
                b'>' => {
                    is_closed = true;
                    at += 1;
                    break;
                }
                b'<' => break,
                b'/' => {
                    is_empty = true;
                    at += 1;
                }
                _ if byte.is_ascii_alphabetic() => {
                    let begin = at;
                    at = while_in(text, at, |byte| byte.is_ascii_alphanumeric() || matches!(byte, b':' | b'_' | b'.'));
                    let attribute = as_str(text, begin..at).to_owned();
                    let sign = while_in(text, at, |byte| byte.is_ascii_whitespace());
                    if text.get(sign) != Some(&b'=') {
                        is_torn = true;
                        continue;
                    }
                    let quote = while_in(text, sign + 1, |byte| byte.is_ascii_whitespace());
                    at = quote;
                    if let Some(&mark @ (b'"' | b'\'')) = text.get(quote) {
                        let end = while_in(text, quote + 1, |byte| byte != mark && byte != b'<');
                        attributes.push((attribute, quote + 1..end));
                        is_torn |= text.get(end) != Some(&mark);
                        at = end + usize::from(text.get(end) == Some(&mark));
                    }
                }
                _ => {
                    is_torn |= matches!(byte, b'"' | b'\'');
                    at += 1;
                }
            }
        }
        if name == "Code" && !is_closing && !is_empty {
            let end = while_in(text, at, |byte| byte != b'<');
            let first = line + newlines(text, start..at);
            if end > at {
                self.code.push((at..end, first));
            }
        }
        let name = if is_closed && !is_torn { name } else { String::new() };
        self.tags.push(Tag { name, line, attributes, is_closing, is_empty, name_end });
        at
    }
}

fn next(text: &[u8], from: usize, mark: &[u8]) -> Option<usize> {
    let rest = text.get(from..)?;
    rest.windows(mark.len()).position(|window| window == mark).map(|at| from + at)
}

#[expect(clippy::naive_bytecount, reason = "every byte is counted once")]
fn newlines(text: &[u8], range: Range<usize>) -> usize {
    text.get(range).unwrap_or_default().iter().filter(|byte| **byte == b'\n').count()
}

fn while_in(text: &[u8], from: usize, is: impl Fn(u8) -> bool) -> usize {
    from + text.get(from..).unwrap_or_default().iter().take_while(|byte| is(**byte)).count()
}
