//! Parses tokens into a tree. A missing comma or colon is reported and skipped; any other syntax error is fatal, because it would
//! cause many follow-up errors.

use super::super::diagnostic::{Findings, Span};
use super::lexer::{Token, TokenKind, tokens};
use super::{Ast, Field, Node};

/// Deepest nesting, which is far above that of any profile and far below the limit of the stack.
const DEEPEST: usize = 32;

/// Parses a whole text; `None` after a fatal syntax error.
pub(super) fn parse(text: &str, findings: &mut Findings<'_>) -> Option<Ast> {
    let mut parser = Parser { tokens: tokens(text, findings), at: 0, depth: 0, findings };
    parser.skip_extensions()?;
    let value = parser.value()?;
    let rest = parser.peek().clone();
    if rest.kind != TokenKind::End {
        let hint = "a profile is one pair of brackets: ( schema: 1, ... )".to_owned();
        parser.findings.error(rest.span, format!("{} after the end of the profile", rest.kind.describe()), hint);
        return None;
    }
    Some(value)
}

struct Parser<'f, 'a> {
    tokens: Vec<Token>,
    at: usize,
    depth: usize,
    findings: &'f mut Findings<'a>,
}

/// The token beyond the end of the list.
const END: Token = Token { kind: TokenKind::End, span: Span::new(0, 0), is_torn: false };

impl Parser<'_, '_> {
    fn peek(&self) -> &Token {
        self.tokens.get(self.at).or_else(|| self.tokens.last()).unwrap_or(&END)
    }

    fn peek_second(&self) -> &TokenKind {
        self.tokens.get(self.at + 1).map_or(&TokenKind::End, |token| &token.kind)
    }

    fn next(&mut self) -> Token {
        let token = self.peek().clone();
        self.at += 1;
        token
    }

    fn is_mark(&self, mark: char) -> bool {
        self.peek().kind == TokenKind::Mark(mark)
    }

    fn take(&mut self, mark: char) -> bool {
        let is_next = self.is_mark(mark);
        if is_next {
            self.at += 1;
        }
        is_next
    }

    fn fail<T>(&mut self, expected: &str) -> Option<T> {
        self.fail_with_hint(expected, None)
    }

    fn fail_with_hint<T>(&mut self, expected: &str, hint: Option<String>) -> Option<T> {
        let token = self.peek().clone();
        self.findings.error(token.span, format!("expected {expected}, found {}", token.kind.describe()), hint);
        None
    }

    fn previous(&self) -> Option<&Token> {
        self.at.checked_sub(1).and_then(|previous| self.tokens.get(previous))
    }

    /// Skips `#![enable(implicit_some)]` and similar lines, which have no effect here.
    fn skip_extensions(&mut self) -> Option<()> {
        while self.take('#') {
            if !(self.take('!') && self.take('[')) {
                return self.fail("'#![enable(...)]'");
            }
            while !self.take(']') {
                if self.next().kind == TokenKind::End {
                    return self.fail("']'");
                }
            }
        }
        Some(())
    }

    fn value(&mut self) -> Option<Ast> {
        if self.depth >= DEEPEST {
            return self.fail(&format!("at most {DEEPEST} levels of brackets"));
        }
        self.depth += 1;
        let value = self.value_inside();
        self.depth -= 1;
        value
    }

    fn value_inside(&mut self) -> Option<Ast> {
        let Token { kind, span, .. } = self.peek().clone();
        let start = span.start;
        let node = match kind {
            TokenKind::Text(text) => {
                self.at += 1;
                Node::Text(text)
            }
            TokenKind::Number(number) => {
                self.at += 1;
                Node::Number(number)
            }
            TokenKind::Name(name) => {
                self.at += 1;
                if self.is_mark('(') {
                    let inside = self.round()?;
                    match inside {
                        Node::Tuple(mut items) if name == "Some" && items.len() == 1 => return items.pop(),
                        inside => inside,
                    }
                } else {
                    match name.as_str() {
                        "true" => Node::Flag(true),
                        "false" => Node::Flag(false),
                        "None" => Node::Absent,
                        "inf" => Node::Number(f64::INFINITY),
                        "NaN" => Node::Number(f64::NAN),
                        _ => Node::Name(name),
                    }
                }
            }
            TokenKind::Mark('(') => self.round()?,
            TokenKind::Mark('[') => {
                self.at += 1;
                Node::List(self.items(']', span)?)
            }
            TokenKind::Mark('{') => {
                self.at += 1;
                self.map(span)?
            }
            TokenKind::Mark(_) | TokenKind::End => return self.fail("a value"),
        };
        let end = self.previous().map_or(start, |token| token.span.end);
        Some(Ast { span: Span::new(start, end), node })
    }

    /// Parses `( … )`, which is a struct if it starts with a name and a colon.
    fn round(&mut self) -> Option<Node> {
        let open = self.peek().span;
        self.take('(');
        // A name followed by a value is a field with a missing colon.
        let is_struct = matches!(self.peek().kind, TokenKind::Name(_))
            && !matches!(self.peek_second(), TokenKind::Mark(',' | ')' | '(') | TokenKind::End);
        if !is_struct {
            return Some(Node::Tuple(self.items(')', open)?));
        }
        let mut fields = Vec::new();
        while !self.take(')') {
            let Token { kind: TokenKind::Name(name), span: name_span, .. } = self.peek().clone() else {
                return self.fail("the name of a field or ')'");
            };
            self.at += 1;
            self.colon(None)?;
            let value = self.value()?;
            fields.push(Field { name, name_span, value });
            self.comma(')', open)?;
        }
        Some(Node::Struct(fields))
    }

    fn items(&mut self, close: char, open: Span) -> Option<Vec<Ast>> {
        let mut items = Vec::new();
        while !self.take(close) {
            items.push(self.value()?);
            self.comma(close, open)?;
        }
        Some(items)
    }

    fn map(&mut self, open: Span) -> Option<Node> {
        let mut entries = Vec::new();
        while !self.take('}') {
            let key = self.value()?;
            self.colon(Some("entries of '{ }' are \"name\": value; a list is written '[ ]'"))?;
            entries.push((key, self.value()?));
            self.comma('}', open)?;
        }
        Some(Node::Map(entries))
    }

    fn colon(&mut self, hint: Option<&str>) -> Option<()> {
        if self.take(':') {
            return Some(());
        }
        self.fail_with_hint::<()>("':'", hint.map(str::to_owned));
        // If a value follows, only the colon is missing.
        self.begins_value().then_some(())
    }

    /// Expects the comma after an entry, unless the bracket opened at `open` ends here.
    fn comma(&mut self, close: char, open: Span) -> Option<()> {
        if self.take(',') || self.is_mark(close) {
            return Some(());
        }
        // The comma may have been lost with the end of a text, which was reported already.
        if !self.previous().is_some_and(|token| token.is_torn) {
            let line = self.findings.line_of(open);
            let hint = (!self.begins_value()).then(|| format!("the bracket of line {line} is still open here"));
            self.fail_with_hint::<()>(&format!("',' or '{close}'"), hint);
        }
        self.begins_value().then_some(())
    }

    fn begins_value(&self) -> bool {
        match self.peek().kind {
            TokenKind::Name(_) | TokenKind::Text(_) | TokenKind::Number(_) | TokenKind::Mark('(' | '[' | '{') => true,
            TokenKind::Mark(_) | TokenKind::End => false,
        }
    }
}
