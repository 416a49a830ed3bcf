//! A small reader of YAML (block and flow) and JSON that keeps the place of every scalar. It reads what tools write for messages
//! and parameters; anchors, tags and folded texts are taken as plain scalars.

use std::ops::Range;

use super::super::lexer::BYTE_ORDER_MARK;

/// A value of a document.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Node {
    Scalar(Scalar),
    List(Vec<Self>),
    Map(Vec<Entry>),
}

/// A key with its value.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Entry {
    pub(super) key: String,
    pub(super) line: usize,
    pub(super) node: Node,
}

/// A text without quotes, by its place.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Scalar {
    pub(super) place: Range<usize>,
    pub(super) line: usize,
}

impl Node {
    /// The entry of this key; of several, the first.
    pub(super) fn get(&self, key: &str) -> Option<&Entry> {
        match self {
            Self::Map(entries) => entries.iter().find(|entry| entry.key == key),
            Self::Scalar(_) | Self::List(_) => None,
        }
    }

    pub(super) fn list(&self) -> Option<&[Self]> {
        if let Self::List(items) = self { Some(items) } else { None }
    }

    pub(super) const fn scalar(&self) -> Option<&Scalar> {
        if let Self::Scalar(scalar) = self { Some(scalar) } else { None }
    }
}

/// All documents of a file.
pub(super) fn documents(text: &[u8]) -> Vec<Node> {
    let start = if text.starts_with(BYTE_ORDER_MARK) { BYTE_ORDER_MARK.len() } else { 0 };
    let mut reader = Reader { text, at: start, line: 1, line_start: start };
    let mut documents = Vec::new();
    loop {
        reader.skip();
        if reader.at >= text.len() {
            return documents;
        }
        let before = reader.at;
        if reader.is_mark() {
            reader.skip_line();
            continue;
        }
        documents.push(reader.node(0, 0));
        // What cannot be read is passed over, one line at a time.
        if reader.at == before {
            reader.skip_line();
        }
    }
}

struct Reader<'a> {
    text: &'a [u8],
    at: usize,
    line: usize,
    line_start: usize,
}

/// Deepest nesting; messages have less than ten levels.
const DEEPEST: usize = 40;

impl Reader<'_> {
    fn peek(&self) -> Option<u8> {
        self.text.get(self.at).copied()
    }

    fn step(&mut self) {
        if self.peek() == Some(b'\n') {
            self.line += 1;
            self.line_start = self.at + 1;
        }
        self.at += 1;
    }

    fn skip_line(&mut self) {
        while let Some(byte) = self.peek() {
            self.step();
            if byte == b'\n' {
                break;
            }
        }
    }

    /// Skips blanks, line ends and comments.
    fn skip(&mut self) {
        while let Some(byte) = self.peek() {
            match byte {
                b'#' => {
                    while self.peek().is_some_and(|byte| byte != b'\n') {
                        self.step();
                    }
                }
                _ if byte.is_ascii_whitespace() => self.step(),
                _ => break,
            }
        }
    }

    const fn column(&self) -> usize {
        self.at - self.line_start
    }

    fn starts(&self, mark: &[u8]) -> bool {
        self.text.get(self.at..).is_some_and(|rest| rest.starts_with(mark))
    }

    /// `---` or `...` at the begin of a line, or a directive.
    fn is_mark(&self) -> bool {
        self.column() == 0 && (self.starts(b"---") || self.starts(b"...") || self.starts(b"%"))
    }

    fn is_item(&self) -> bool {
        self.peek() == Some(b'-') && self.text.get(self.at + 1).is_none_or(u8::is_ascii_whitespace)
    }

    /// A node whose column is at least `indent`.
    fn node(&mut self, indent: usize, depth: usize) -> Node {
        self.skip();
        let empty = |reader: &Self| Node::Scalar(Scalar { place: reader.at..reader.at, line: reader.line });
        if self.peek().is_none() || self.column() < indent || self.is_mark() || depth > DEEPEST {
            return empty(self);
        }
        let column = self.column();
        if self.is_item() {
            return self.block_list(column, depth);
        }
        if matches!(self.peek(), Some(b'[' | b'{')) {
            return self.flow(depth);
        }
        let (scalar, is_key) = self.plain(false);
        if is_key { self.block_map(column, scalar, depth) } else { Node::Scalar(scalar) }
    }

    fn block_list(&mut self, column: usize, depth: usize) -> Node {
        let mut items = Vec::new();
        loop {
            self.skip();
            if self.column() != column || !self.is_item() || self.is_mark() {
                return Node::List(items);
            }
            self.step();
            let line = self.line;
            self.skip();
            let is_same_line = self.line == line;
            // An item that is empty must not take the next one.
            if is_same_line || self.column() > column {
                items.push(self.node(column + 1, depth + 1));
            }
            if depth >= DEEPEST {
                self.skip_line();
            }
        }
    }

    /// A map whose first key has been read.
    fn block_map(&mut self, column: usize, first: Scalar, depth: usize) -> Node {
        let mut entries = Vec::new();
        let mut key = first;
        loop {
            let name = String::from_utf8_lossy(self.text.get(key.place.clone()).unwrap_or_default()).into_owned();
            let line = self.line;
            self.skip();
            let is_same_line = self.line == line;
            // A list may have the column of its key.
            let is_list = self.is_item() && self.column() == column;
            let node = if is_same_line || self.column() > column || is_list && self.peek().is_some() {
                self.node(if is_list { column } else { column + usize::from(!is_same_line) }, depth + 1)
            } else {
                Node::Scalar(Scalar { place: self.at..self.at, line })
            };
            entries.push(Entry { key: name, line: key.line, node });
            if depth >= DEEPEST {
                self.skip_line();
            }
            self.skip();
            if self.peek().is_none() || self.column() != column || self.is_mark() || self.is_item() {
                return Node::Map(entries);
            }
            let before = self.at;
            let (next, is_key) = self.plain(false);
            if !is_key {
                if self.at == before {
                    self.skip_line();
                }
                return Node::Map(entries);
            }
            key = next;
        }
    }

    /// A scalar, and whether a colon follows it, which is passed.
    fn plain(&mut self, is_in_flow: bool) -> (Scalar, bool) {
        let line = self.line;
        let is_colon = |reader: &Self, is_quoted: bool| {
            let next = reader.text.get(reader.at + 1);
            let is_end =
                next.is_none_or(|next| next.is_ascii_whitespace() || is_in_flow && matches!(next, b',' | b']' | b'}'));
            reader.peek() == Some(b':') && (is_end || is_quoted && is_in_flow)
        };
        if let Some(quote @ (b'"' | b'\'')) = self.peek() {
            self.step();
            let start = self.at;
            while let Some(byte) = self.peek() {
                if byte == quote || byte == b'\n' {
                    break;
                }
                if byte == b'\\' && quote == b'"' {
                    self.step();
                }
                self.step();
            }
            let place = start..self.at.min(self.text.len());
            if self.peek() == Some(quote) {
                self.step();
            }
            while matches!(self.peek(), Some(b' ' | b'\t')) {
                self.step();
            }
            let is_key = is_colon(self, true);
            if is_key {
                self.step();
            }
            return (Scalar { place, line }, is_key);
        }
        let start = self.at;
        let mut end = start;
        while let Some(byte) = self.peek() {
            let is_comment =
                byte == b'#' && self.at > start && self.text.get(self.at - 1).is_some_and(u8::is_ascii_whitespace);
            let is_flow_end = is_in_flow && matches!(byte, b',' | b'[' | b']' | b'{' | b'}');
            if byte == b'\n' || is_comment || is_flow_end {
                break;
            }
            if is_colon(self, false) {
                self.step();
                return (Scalar { place: start..end, line }, true);
            }
            self.step();
            if !byte.is_ascii_whitespace() {
                end = self.at;
            }
        }
        (Scalar { place: start..end, line }, false)
    }

    fn flow(&mut self, depth: usize) -> Node {
        let is_list = self.peek() == Some(b'[');
        let close = if is_list { b']' } else { b'}' };
        self.step();
        let (mut items, mut entries) = (Vec::new(), Vec::new());
        loop {
            self.skip();
            match self.peek() {
                None => break,
                Some(byte) if byte == close => {
                    self.step();
                    break;
                }
                Some(b',') => self.step(),
                // A bracket that does not fit: the file is broken here.
                Some(b']' | b'}') => {
                    self.step();
                    break;
                }
                Some(b'[' | b'{') if depth > DEEPEST => self.step(),
                Some(b'[' | b'{') => items.push(self.flow(depth + 1)),
                Some(_) => {
                    let before = self.at;
                    let (scalar, is_key) = self.plain(true);
                    if self.at == before {
                        self.step();
                        continue;
                    }
                    if is_key {
                        let line = scalar.line;
                        let key = String::from_utf8_lossy(self.text.get(scalar.place).unwrap_or_default()).into_owned();
                        self.skip();
                        let node = match self.peek() {
                            Some(b'[' | b'{') if depth <= DEEPEST => self.flow(depth + 1),
                            _ => Node::Scalar(self.plain(true).0),
                        };
                        entries.push(Entry { key, line, node });
                    } else {
                        items.push(Node::Scalar(scalar));
                    }
                }
            }
        }
        if is_list { Node::List(items) } else { Node::Map(entries) }
    }
}
