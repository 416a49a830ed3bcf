//! Text of a filter into its condition: words with their places, then recursive descent.

use std::iter::Peekable;
use std::vec::IntoIter;

use super::{Condition, FilterError, Operator};
use crate::text::printable;

/// Parentheses and `not` inside each other: far more than anyone writes, far less than the stack holds.
const MAX_DEPTH: usize = 50;

#[derive(Clone, Debug, PartialEq)]
enum Token {
    Name(String),
    /// A name in double quotation marks: never `and`, `or`, `not`.
    QuotedName(String),
    Text(String),
    Number(f64),
    Operator(Operator),
    Percent,
    Open,
    Close,
}

pub(super) fn parse(text: &str) -> Result<Condition, FilterError> {
    let characters: Vec<char> = text.chars().collect();
    let tokens = tokens(&characters, text)?;
    let mut parser = Parser { text, end: characters.len(), tokens: tokens.into_iter().peekable(), depth: 0 };
    let condition = parser.any()?;
    match parser.tokens.peek() {
        None => Ok(condition),
        Some((_, Token::Close)) => parser.expected("this parenthesis was never opened"),
        Some(_) => parser.expected("expected 'and', 'or' or the end of the filter"),
    }
}

fn error<T>(text: &str, at: usize, expected: &str) -> Result<T, FilterError> {
    Err(FilterError::Syntax { text: printable(text), at, expected: expected.to_owned() })
}

/// Splits a filter into words, each with the 0-based character it begins at.
fn tokens(characters: &[char], text: &str) -> Result<Vec<(usize, Token)>, FilterError> {
    let mut tokens = Vec::new();
    let mut at = 0;
    while let Some(&first) = characters.get(at) {
        let second = characters.get(at + 1).copied();
        let start = at;
        let is_equal = second == Some('=');
        let (token, length) = match first {
            _ if first.is_whitespace() => {
                at += 1;
                continue;
            }
            '(' => (Token::Open, 1),
            ')' => (Token::Close, 1),
            '%' => (Token::Percent, 1),
            '=' if is_equal => (Token::Operator(Operator::Equal), 2),
            '!' if is_equal => (Token::Operator(Operator::NotEqual), 2),
            '<' if is_equal => (Token::Operator(Operator::LessOrEqual), 2),
            '>' if is_equal => (Token::Operator(Operator::GreaterOrEqual), 2),
            '<' => (Token::Operator(Operator::Less), 1),
            '>' => (Token::Operator(Operator::Greater), 1),
            '=' => return error(text, at, "equality is written '=='"),
            '!' => return error(text, at, "write 'not' before a condition, or '!=' between column and value"),
            '&' => return error(text, at, "write 'and'"),
            '|' => return error(text, at, "write 'or'"),
            '\'' | '"' => {
                let Some((content, length)) = quoted(characters.get(at..).unwrap_or_default(), first) else {
                    return error(text, at, "this quotation mark is not closed");
                };
                (if first == '"' { Token::QuotedName(content) } else { Token::Text(content) }, length)
            }
            _ if first.is_alphabetic() || first == '_' => {
                let name: String = run(characters, at, |c| c.is_alphanumeric() || c == '_' || c == '.');
                let length = name.chars().count();
                (Token::Name(name), length)
            }
            _ if first.is_ascii_digit() || matches!(first, '-' | '+' | '.') => {
                let number = number(characters, at);
                match number.parse::<f64>() {
                    Ok(value) if value.is_finite() => (Token::Number(value), number.len()),
                    _ => return error(text, at, "expected a number such as '-12.5'"),
                }
            }
            _ => return error(text, at, "this character has no meaning in a filter"),
        };
        tokens.push((start, token));
        at += length;
    }
    Ok(tokens)
}

/// Characters from `at` on as long as they are wanted.
fn run(characters: &[char], at: usize, wanted: impl Fn(char) -> bool) -> String {
    characters.iter().skip(at).copied().take_while(|&c| wanted(c)).collect()
}

/// A number with sign, point and exponent; a sign inside belongs to it only after the `e`.
fn number(characters: &[char], at: usize) -> String {
    let mut number = String::new();
    for &c in characters.iter().skip(at) {
        let is_sign = matches!(c, '-' | '+') && (number.is_empty() || number.ends_with(['e', 'E']));
        if !(c.is_ascii_alphanumeric() || c == '.' || is_sign) {
            break;
        }
        number.push(c);
    }
    number
}

/// Content and length of a text in quotation marks; a mark inside is written twice.
fn quoted(characters: &[char], mark: char) -> Option<(String, usize)> {
    let mut content = String::new();
    let mut at = 1;
    loop {
        let c = *characters.get(at)?;
        if c != mark {
            content.push(c);
            at += 1;
        } else if characters.get(at + 1) == Some(&mark) {
            content.push(mark);
            at += 2;
        } else {
            return Some((content, at + 1));
        }
    }
}

struct Parser<'a> {
    text: &'a str,
    end: usize,
    tokens: Peekable<IntoIter<(usize, Token)>>,
    depth: usize,
}

impl Parser<'_> {
    fn any(&mut self) -> Result<Condition, FilterError> {
        let mut conditions = vec![self.all()?];
        while self.take_word("or") {
            conditions.push(self.all()?);
        }
        Ok(only_or(conditions, Condition::Any))
    }

    fn all(&mut self) -> Result<Condition, FilterError> {
        let mut conditions = vec![self.term()?];
        while self.take_word("and") {
            conditions.push(self.term()?);
        }
        Ok(only_or(conditions, Condition::All))
    }

    fn term(&mut self) -> Result<Condition, FilterError> {
        if self.depth >= MAX_DEPTH {
            return self.expected("the filter is nested too deeply");
        }
        self.depth += 1;
        let condition = if self.take_word("not") {
            Condition::Not(Box::new(self.term()?))
        } else if self.tokens.next_if(|(_, token)| *token == Token::Open).is_some() {
            let inner = self.any()?;
            if self.tokens.next_if(|(_, token)| *token == Token::Close).is_none() {
                return self.expected("expected ')', 'and' or 'or'");
            }
            inner
        } else {
            self.comparison()?
        };
        self.depth -= 1;
        Ok(condition)
    }

    fn comparison(&mut self) -> Result<Condition, FilterError> {
        let column = match self.tokens.peek() {
            Some((_, Token::Name(name))) if !is_word(name) => name.clone(),
            Some((_, Token::QuotedName(name))) => name.clone(),
            Some((_, Token::Text(_))) => {
                return self.expected("expected the name of a column; without quotation marks, or in double ones");
            }
            _ => return self.expected("expected the name of a column, 'not' or '('"),
        };
        self.tokens.next();
        let divisor = if self.tokens.next_if(|(_, token)| *token == Token::Percent).is_some() {
            match self.tokens.peek() {
                Some((_, Token::Number(divisor))) if *divisor > 0.0 => {
                    let divisor = *divisor;
                    self.tokens.next();
                    Some(divisor)
                }
                _ => return self.expected("expected a number above zero after '%'"),
            }
        } else {
            None
        };
        let Some(&(_, Token::Operator(operator))) = self.tokens.peek() else {
            return self.expected(if divisor.is_some() {
                "expected '==', '!=', '<', '<=', '>' or '>='"
            } else {
                "expected '==', '!=', '<', '<=', '>', '>=' or '%'"
            });
        };
        self.tokens.next();
        let condition = match self.tokens.peek() {
            Some((_, Token::Number(value))) => Condition::Number { column, divisor, operator, value: *value },
            Some((_, Token::Text(_))) if divisor.is_some() => {
                return self.expected("expected a number: a remainder is not a text");
            }
            Some((_, Token::Text(value))) => {
                let equal = match operator {
                    Operator::Equal => true,
                    Operator::NotEqual => false,
                    Operator::Less | Operator::LessOrEqual | Operator::Greater | Operator::GreaterOrEqual => {
                        return self.expected("expected a number: texts are compared by '==' and '!=' only");
                    }
                };
                Condition::Text { column, equal, value: value.clone() }
            }
            Some((_, Token::Name(_) | Token::QuotedName(_))) => {
                return self.expected("expected a number, or a text in single quotation marks");
            }
            _ => return self.expected("expected a number or a text in single quotation marks"),
        };
        self.tokens.next();
        Ok(condition)
    }

    /// Takes the next token if it is this word.
    fn take_word(&mut self, word: &str) -> bool {
        let is_it = |token: &Token| matches!(token, Token::Name(name) if name == word);
        self.tokens.next_if(|(_, token)| is_it(token)).is_some()
    }

    /// An error at the next token, or at the end.
    fn expected<T>(&mut self, expected: &str) -> Result<T, FilterError> {
        let at = self.tokens.peek().map_or(self.end, |(at, _)| *at);
        error(self.text, at, expected)
    }
}

fn is_word(name: &str) -> bool {
    matches!(name, "and" | "or" | "not")
}

/// The only condition as it is; several of them joined.
fn only_or(mut conditions: Vec<Condition>, join: impl FnOnce(Vec<Condition>) -> Condition) -> Condition {
    match conditions.pop() {
        Some(only) if conditions.is_empty() => only,
        last => {
            conditions.extend(last);
            join(conditions)
        }
    }
}
