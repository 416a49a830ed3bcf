//! Words, numbers, texts and symbols of a program, with their places. Comments are skipped; bytes beyond ASCII belong to words.

use std::borrow::Cow;
use std::ops::Range;

/// What differs between the languages.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rules {
    /// Starts a comment up to the end of the line.
    pub(super) comment: &'static [u8],
    /// Characters around texts.
    pub(super) quotes: &'static [u8],
    /// Characters of words besides letters, digits and `_`.
    pub(super) in_words: &'static [u8],
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    Word,
    Number,
    Text,
    Symbol(u8),
    LineEnd,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Token {
    pub(super) kind: Kind,
    pub(super) start: usize,
    pub(super) end: usize,
    /// Line, from 1.
    pub(super) line: usize,
}

/// A program as tokens.
#[derive(Debug)]
pub(super) struct Tokens<'a> {
    pub(super) text: &'a [u8],
    tokens: Vec<Token>,
}

impl<'a> Tokens<'a> {
    pub(super) fn new(text: &'a [u8], rules: Rules) -> Self {
        Self::part(text, 0..text.len(), 1, rules)
    }

    /// Tokens of a part of a file that begins at this line.
    pub(super) fn part(whole: &'a [u8], range: Range<usize>, line: usize, rules: Rules) -> Self {
        let text = whole.get(..range.end).unwrap_or(whole);
        let mut tokens = Vec::new();
        let (mut at, mut line) = (range.start, line);
        if at == 0 && text.starts_with(BYTE_ORDER_MARK) {
            at = BYTE_ORDER_MARK.len();
        }
        while let Some(&byte) = text.get(at) {
            let start = at;
            let kind = if byte == b'\n' {
                at += 1;
                Kind::LineEnd
            } else if text.get(at..).is_some_and(|rest| rest.starts_with(rules.comment)) {
                at = end_of(text, at, |byte| byte == b'\n');
                continue;
            } else if rules.quotes.contains(&byte) {
                at = end_of(text, at + 1, |other| other == byte || other == b'\n');
                at += usize::from(text.get(at) == Some(&byte));
                Kind::Text
            } else if byte.is_ascii_digit() || byte == b'.' && text.get(at + 1).is_some_and(u8::is_ascii_digit) {
                at = end_of_number(text, at);
                Kind::Number
            } else if is_in_word(byte) || rules.in_words.contains(&byte) {
                at = end_of(text, at, |byte| !is_in_word(byte) && !rules.in_words.contains(&byte));
                Kind::Word
            } else {
                at += 1;
                if byte.is_ascii_whitespace() {
                    continue;
                }
                Kind::Symbol(byte)
            };
            tokens.push(Token { kind, start, end: at, line });
            line += usize::from(kind == Kind::LineEnd);
        }
        Self { text, tokens }
    }

    pub(super) fn get(&self, at: usize) -> Option<Token> {
        self.tokens.get(at).copied()
    }

    pub(super) fn len(&self) -> usize {
        self.tokens.len()
    }

    pub(super) fn is(&self, at: usize, symbol: u8) -> bool {
        self.get(at).is_some_and(|token| token.kind == Kind::Symbol(symbol))
    }

    /// Text of a token; empty beyond the end, `?` for bytes that are no UTF-8.
    pub(super) fn str(&self, at: usize) -> &'a str {
        self.get(at).map_or("", |token| as_str(self.text, token.start..token.end))
    }

    /// The word at this place.
    pub(super) fn word(&self, at: usize) -> Option<&'a str> {
        self.get(at).filter(|token| token.kind == Kind::Word).map(|_| self.str(at))
    }

    pub(super) fn is_word(&self, at: usize, word: &str) -> bool {
        self.word(at).is_some_and(|found| found.eq_ignore_ascii_case(word))
    }

    /// Name of the variable at this place, also if it has bytes that are no UTF-8.
    pub(super) fn name(&self, at: usize) -> Option<String> {
        let token = self.get(at).filter(|token| token.kind == Kind::Word)?;
        Some(latin(self.text.get(token.start..token.end).unwrap_or_default()))
    }

    pub(super) fn line(&self, at: usize) -> usize {
        self.get(at).or_else(|| self.tokens.last().copied()).map_or(1, |token| token.line)
    }

    /// A number with its sign, and the place behind it.
    pub(super) fn number(&self, at: usize) -> Option<(Number, usize)> {
        let signs = usize::from(self.is(at, b'-') || self.is(at, b'+'));
        let (first, last) = (self.get(at)?, self.get(at + signs)?);
        // A sign belongs to the digits behind it; anything between them would be lost with the old number.
        if last.kind != Kind::Number || last.start != first.start + signs {
            return None;
        }
        let digits: f64 = as_str(self.text, last.start..last.end).parse().ok()?;
        let value = if self.is(at, b'-') { -digits } else { digits };
        let place = first.start..last.end;
        value.is_finite().then_some((Number { value, place }, at + signs + 1))
    }

    /// The place behind the bracket that closes the one at `at`; `end` if none does before.
    pub(super) fn behind(&self, at: usize, end: usize) -> usize {
        let mut depth = 0_usize;
        for place in at..end.min(self.len()) {
            match self.get(place).map(|token| token.kind) {
                Some(Kind::Symbol(b'(' | b'[' | b'{')) => depth += 1,
                Some(Kind::Symbol(b')' | b']' | b'}')) => {
                    depth = depth.saturating_sub(1);
                    if depth == 0 {
                        return place + 1;
                    }
                }
                _ => {}
            }
        }
        end
    }

    /// Ranges between the commas of `range`, brackets kept together.
    pub(super) fn split(&self, range: Range<usize>) -> Vec<Range<usize>> {
        let mut parts = Vec::new();
        let (mut depth, mut start) = (0_usize, range.start);
        for at in range.clone() {
            match self.get(at).map(|token| token.kind) {
                Some(Kind::Symbol(b'(' | b'[' | b'{')) => depth += 1,
                Some(Kind::Symbol(b')' | b']' | b'}')) => depth = depth.saturating_sub(1),
                Some(Kind::Symbol(b',')) if depth == 0 => {
                    parts.push(start..at);
                    start = at + 1;
                }
                _ => {}
            }
        }
        if start < range.end || !parts.is_empty() {
            parts.push(start..range.end);
        }
        parts.iter().map(|part| self.trimmed(part.clone())).collect()
    }

    /// A range without line ends around it.
    pub(super) fn trimmed(&self, range: Range<usize>) -> Range<usize> {
        let is_line_end = |at: usize| self.get(at).is_some_and(|token| token.kind == Kind::LineEnd);
        let (mut start, mut end) = (range.start, range.end);
        while start < end && is_line_end(start) {
            start += 1;
        }
        while end > start && is_line_end(end - 1) {
            end -= 1;
        }
        start..end
    }

    /// The next place that is no line end.
    pub(super) fn skip_line_ends(&self, mut at: usize) -> usize {
        while self.get(at).is_some_and(|token| token.kind == Kind::LineEnd) {
            at += 1;
        }
        at
    }

    /// Bytes of the tokens of a range.
    pub(super) fn bytes(&self, range: Range<usize>) -> Range<usize> {
        match (self.get(range.start), range.end.checked_sub(1).and_then(|last| self.get(last))) {
            (Some(first), Some(last)) if range.start < range.end => first.start..last.end,
            _ => 0..0,
        }
    }

    /// The source text of a range of tokens, for messages.
    pub(super) fn source(&self, range: Range<usize>) -> String {
        let bytes = self.text.get(self.bytes(range)).unwrap_or_default();
        latin(bytes).split_whitespace().collect::<Vec<_>>().join(" ")
    }
}

/// A number of the text.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Number {
    pub(super) value: f64,
    pub(super) place: Range<usize>,
}

/// A value with brackets.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Value {
    Number(Number),
    List(Vec<Self>),
    /// Range of tokens.
    Other(Range<usize>),
}

/// Deepest nesting that is read; no position needs more than an array of three dimensions.
const DEEPEST: usize = 8;

impl Value {
    /// Reads the value that fills a range, with lists between `open` and its counterpart.
    pub(super) fn read(tokens: &Tokens<'_>, range: Range<usize>, open: u8) -> Self {
        Self::read_nested(tokens, range, open, 0)
    }

    fn read_nested(tokens: &Tokens<'_>, range: Range<usize>, open: u8, depth: usize) -> Self {
        if let Some((number, end)) = tokens.number(range.start)
            && end == range.end
        {
            return Self::Number(number);
        }
        if tokens.is(range.start, open)
            && depth < DEEPEST
            && tokens.behind(range.start, range.end) == range.end
            && matches!(tokens.get(range.end - 1).map(|token| token.kind), Some(Kind::Symbol(b']' | b'}' | b')')))
        {
            let parts = tokens.split(range.start + 1..range.end.saturating_sub(1));
            return Self::List(
                parts.into_iter().map(|part| Self::read_nested(tokens, part, open, depth + 1)).collect(),
            );
        }
        Self::Other(range)
    }

    pub(super) fn list(&self) -> Option<&[Self]> {
        match self {
            Self::List(items) => Some(items),
            Self::Number(_) | Self::Other(_) => None,
        }
    }

    /// The numbers of a list that has nothing else.
    pub(super) fn numbers(&self) -> Option<Vec<&Number>> {
        let number = |value: &'_ Self| match value {
            Self::Number(_) => true,
            Self::List(_) | Self::Other(_) => false,
        };
        let items = self.list().filter(|items| items.iter().all(number))?;
        Some(
            items.iter().filter_map(|item| if let Self::Number(number) = item { Some(number) } else { None }).collect(),
        )
    }

    pub(super) fn number(&self) -> Option<&Number> {
        if let Self::Number(number) = self { Some(number) } else { None }
    }
}

fn is_in_word(byte: u8) -> bool {
    byte.is_ascii_alphanumeric() || byte == b'_' || !byte.is_ascii()
}

fn end_of(text: &[u8], from: usize, is_end: impl Fn(u8) -> bool) -> usize {
    let rest = text.get(from..).unwrap_or_default();
    from.min(text.len()) + rest.iter().position(|byte| is_end(*byte)).unwrap_or(rest.len())
}

fn end_of_number(text: &[u8], start: usize) -> usize {
    let is_digit = |at: usize| text.get(at).is_some_and(u8::is_ascii_digit);
    let digits = |from: usize| end_of(text, from, |byte| !byte.is_ascii_digit());
    let mut at = digits(start);
    if text.get(at) == Some(&b'.') {
        at = digits(at + 1);
    }
    if matches!(text.get(at), Some(b'e' | b'E')) {
        let sign = usize::from(matches!(text.get(at + 1), Some(b'+' | b'-')));
        if is_digit(at + 1 + sign) {
            at = digits(at + 1 + sign);
        }
    }
    at
}

/// The text with a line feed for every carriage return that ends a line alone, as old editors write it. All places stay the same.
pub(super) fn with_line_feeds(text: &[u8]) -> Cow<'_, [u8]> {
    let is_alone = |at: usize| text.get(at) == Some(&b'\r') && text.get(at + 1) != Some(&b'\n');
    if !(0..text.len()).any(is_alone) {
        return Cow::Borrowed(text);
    }
    Cow::Owned(text.iter().enumerate().map(|(at, byte)| if is_alone(at) { b'\n' } else { *byte }).collect())
}

/// How the lines of a program end.
pub(super) fn line_end(text: &[u8]) -> &'static str {
    if text.windows(2).any(|pair| pair == b"\r\n") {
        "\r\n"
    } else if text.contains(&b'\r') && !text.contains(&b'\n') {
        "\r"
    } else {
        "\n"
    }
}

/// Editors put a byte order mark in front of a text; it belongs to no line.
pub(super) const BYTE_ORDER_MARK: &[u8] = b"\xef\xbb\xbf";

/// Lines of a text with their number, from 1, and their place.
pub(super) fn lines(text: &[u8]) -> impl Iterator<Item = (usize, Range<usize>)> + '_ {
    let mut start = 0;
    text.split(|byte| *byte == b'\n').enumerate().map(move |(index, line)| {
        let place = start..start + line.len();
        start += line.len() + 1;
        let is_marked = index == 0 && line.starts_with(BYTE_ORDER_MARK);
        let mark = if is_marked { BYTE_ORDER_MARK.len() } else { 0 };
        (index + 1, place.start + mark..place.end)
    })
}

/// Bytes of ASCII text; empty if they are something else.
pub(super) fn as_str(text: &[u8], place: Range<usize>) -> &str {
    text.get(place).and_then(|bytes| std::str::from_utf8(bytes).ok()).unwrap_or_default()
}

/// Text for messages: UTF-8, or else Latin-1.
pub(super) fn latin(bytes: &[u8]) -> String {
    std::str::from_utf8(bytes).map_or_else(|_| bytes.iter().map(|byte| char::from(*byte)).collect(), str::to_owned)
}
