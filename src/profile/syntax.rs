//! Reader of the RON subset that profiles are written in: a tree in which every value knows its place.
//!
//! The `ron` crate stops at the first problem and its values forget where they stood; a profile must show all its problems
//! with line and caret. Read here: structs, tuples, lists, maps, texts, numbers, names, `Some(x)` (the same as `x`), `None`,
//! trailing commas, line and nested block comments, `#![enable(…)]`. Raw texts and characters are not part of the subset.

mod lexer;
mod parser;

use super::diagnostic::{Findings, Span};

/// A value and its place.
#[derive(Clone, Debug)]
pub(super) struct Ast {
    pub(super) span: Span,
    pub(super) node: Node,
}

/// A field of a struct: name and value.
#[derive(Clone, Debug)]
pub(super) struct Field {
    pub(super) name: String,
    pub(super) name_span: Span,
    pub(super) value: Ast,
}

/// What a value is.
#[derive(Clone, Debug)]
pub(super) enum Node {
    /// `(name: value, …)`, with or without a name in front.
    Struct(Vec<Field>),
    /// `(value, …)`, with or without a name in front.
    Tuple(Vec<Ast>),
    /// `[value, …]`.
    List(Vec<Ast>),
    /// `{key: value, …}`.
    Map(Vec<(Ast, Ast)>),
    /// `"text"`.
    Text(String),
    /// A number; may be infinite or NaN.
    Number(f64),
    /// `true` or `false`.
    Flag(bool),
    /// A bare name such as `Revolute`.
    Name(String),
    /// `None`: the same as leaving the field out.
    Absent,
}

impl Node {
    /// What was found, for messages.
    pub(super) fn describe(&self) -> String {
        match self {
            Self::Struct(_) => "named fields".to_owned(),
            Self::Tuple(items) => format!("{} values in '( )'", items.len()),
            Self::List(_) => "a list".to_owned(),
            Self::Map(_) => "a map".to_owned(),
            Self::Text(text) => format!("text '{}'", shortened(text)),
            Self::Number(number) => format!("number {number}"),
            Self::Flag(flag) => format!("'{flag}'"),
            Self::Name(name) => format!("'{}'", shortened(name)),
            Self::Absent => "'None'".to_owned(),
        }
    }
}

/// The start of a text, for messages.
pub(super) fn shortened(text: &str) -> String {
    const LONGEST: usize = 32;
    if text.chars().count() <= LONGEST {
        return text.to_owned();
    }
    let mut start: String = text.chars().take(LONGEST).collect();
    start.push_str("...");
    start
}

/// Reads a whole text. `None` when the rest cannot be read; the reason is then in `findings`.
pub(super) fn parse(text: &str, findings: &mut Findings<'_>) -> Option<Ast> {
    parser::parse(text, findings)
}
