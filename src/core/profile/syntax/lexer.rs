//! Splits a RON text into tokens.

use super::super::diagnostic::{Findings, Span};

/// A token with its location.
#[derive(Clone, Debug)]
pub(super) struct Token {
    pub(super) kind: TokenKind,
    pub(super) span: Span,
    /// Whether this is a text without an end, so that the rest of its line is lost.
    pub(super) is_torn: bool,
}

/// Kind of a token.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum TokenKind {
    /// One of `( ) [ ] { } : , # !`.
    Mark(char),
    /// A name, also `true`, `inf`, `Some`.
    Name(String),
    /// `"text"`.
    Text(String),
    /// A number.
    Number(f64),
    /// The end of the file.
    End,
}

impl TokenKind {
    /// Description for messages.
    pub(super) fn describe(&self) -> String {
        match self {
            Self::Mark(mark) => format!("'{mark}'"),
            Self::Name(name) => format!("'{}'", super::shortened(name)),
            Self::Text(text) => format!("text '{}'", super::shortened(text)),
            Self::Number(number) => format!("number {number}"),
            Self::End => "the end of the file".to_owned(),
        }
    }
}

/// Splits a text into tokens; problems go to `findings`. The last token is always [`TokenKind::End`].
pub(super) fn tokens(text: &str, findings: &mut Findings<'_>) -> Vec<Token> {
    let mut lexer = Lexer { text, at: 0, is_torn: false };
    let mut tokens = Vec::new();
    loop {
        let token = lexer.next_token(findings);
        let is_end = token.kind == TokenKind::End;
        tokens.push(token);
        if is_end {
            return tokens;
        }
    }
}

struct Lexer<'a> {
    text: &'a str,
    at: usize,
    is_torn: bool,
}

impl Lexer<'_> {
    fn peek(&self) -> Option<char> {
        self.rest().chars().next()
    }

    fn rest(&self) -> &str {
        self.text.get(self.at..).unwrap_or_default()
    }

    fn bump(&mut self) -> Option<char> {
        let next = self.peek()?;
        self.at += next.len_utf8();
        Some(next)
    }

    fn skip_while(&mut self, keep: impl Fn(char) -> bool) {
        while self.peek().is_some_and(&keep) {
            self.bump();
        }
    }

    fn slice_from(&self, start: usize) -> &str {
        self.text.get(start..self.at).unwrap_or_default()
    }

    fn next_token(&mut self, findings: &mut Findings<'_>) -> Token {
        loop {
            self.skip_blank(findings);
            let start = self.at;
            let Some(first) = self.peek() else {
                return Token { kind: TokenKind::End, span: Span::new(start, start), is_torn: false };
            };
            let kind = match first {
                '(' | ')' | '[' | ']' | '{' | '}' | ':' | ',' | '#' | '!' => {
                    self.bump();
                    Some(TokenKind::Mark(first))
                }
                '"' => Some(self.text_token(findings)),
                '0'..='9' | '+' | '-' | '.' => Some(self.number(findings)),
                _ if first.is_ascii_alphabetic() || first == '_' => {
                    self.skip_while(|c| c.is_ascii_alphanumeric() || c == '_');
                    Some(TokenKind::Name(self.slice_from(start).to_owned()))
                }
                _ => {
                    self.bump();
                    let hint = "a profile consists of names, numbers, \"texts\" and ( ) [ ] { } : ,".to_owned();
                    findings.error(Span::new(start, self.at), format!("unexpected character '{first}'"), hint);
                    None
                }
            };
            if let Some(kind) = kind {
                let is_torn = std::mem::take(&mut self.is_torn);
                return Token { kind, span: Span::new(start, self.at), is_torn };
            }
        }
    }

    /// Skips white space and comments.
    fn skip_blank(&mut self, findings: &mut Findings<'_>) {
        // Ignore a byte order mark.
        if self.at == 0 && self.peek() == Some('\u{feff}') {
            self.bump();
        }
        loop {
            self.skip_while(char::is_whitespace);
            if self.rest().starts_with("//") {
                self.skip_while(|c| c != '\n');
            } else if self.rest().starts_with("/*") {
                self.skip_block_comment(findings);
            } else {
                return;
            }
        }
    }

    fn skip_block_comment(&mut self, findings: &mut Findings<'_>) {
        let start = self.at;
        let mut depth = 0_usize;
        loop {
            if self.rest().starts_with("/*") {
                depth += 1;
                self.at += 2;
            } else if self.rest().starts_with("*/") {
                depth -= 1;
                self.at += 2;
                if depth == 0 {
                    return;
                }
            } else if self.bump().is_none() {
                findings.error(Span::new(start, start + 2), "this comment has no end", "close it with '*/'".to_owned());
                return;
            }
        }
    }

    fn number(&mut self, findings: &mut Findings<'_>) -> TokenKind {
        let start = self.at;
        self.skip_while(|c| c.is_ascii_alphanumeric() || matches!(c, '+' | '-' | '.' | '_'));
        let written = self.slice_from(start);
        let plain = written.replace('_', "");
        // `f64::from_str` also accepts "infinity", which is not a number here.
        let unsigned = plain.trim_start_matches(['+', '-']);
        if let Ok(number) = plain.parse::<f64>()
            && !unsigned.eq_ignore_ascii_case("infinity")
        {
            return TokenKind::Number(number);
        }
        let hint = "write it like 12, -0.5 or 1.5e-3, without a unit: the unit is in the name of the field".to_owned();
        findings.error(Span::new(start, self.at), format!("'{}' is not a number", super::shortened(written)), hint);
        // With zero the parser can continue; the error makes the profile unusable.
        TokenKind::Number(0.0)
    }

    fn text_token(&mut self, findings: &mut Findings<'_>) -> TokenKind {
        let start = self.at;
        self.bump();
        let mut text = String::new();
        // A text ends with its line, so that a missing quote does not hide the rest of the file.
        while let Some(next) = self.peek().filter(|c| *c != '\n') {
            let escape_start = self.at;
            self.bump();
            match next {
                '"' => return TokenKind::Text(text),
                '\\' => match self.escape() {
                    Some(character) => text.push(character),
                    None => findings.error(
                        Span::new(escape_start, self.at),
                        "unknown escape in a text",
                        r#"allowed: \" \\ \n \t \r \0 \xHH \u{H...}"#.to_owned(),
                    ),
                },
                character => text.push(character),
            }
        }
        self.is_torn = true;
        let hint = "close it with '\"' on the same line".to_owned();
        findings.error(Span::new(start, self.at), "this text has no end", hint);
        TokenKind::Text(text)
    }

    /// The character after a backslash; `None` if there is no such escape.
    fn escape(&mut self) -> Option<char> {
        Some(match self.bump()? {
            character @ ('"' | '\\' | '\'') => character,
            'n' => '\n',
            't' => '\t',
            'r' => '\r',
            '0' => '\0',
            'x' => {
                let start = self.at;
                self.bump().filter(char::is_ascii_hexdigit)?;
                self.bump().filter(char::is_ascii_hexdigit)?;
                char::from(u8::from_str_radix(self.slice_from(start), 16).ok()?)
            }
            'u' => {
                self.bump().filter(|c| *c == '{')?;
                let start = self.at;
                self.skip_while(|c| c.is_ascii_hexdigit());
                let code = u32::from_str_radix(self.slice_from(start), 16).ok()?;
                self.bump().filter(|c| *c == '}')?;
                char::from_u32(code)?
            }
            _ => return None,
        })
    }
}
