//! Parser for the RON subset of profiles. Its syntax tree keeps the location of every value.
//!
//! The `ron` crate stops at the first problem and does not keep locations, but all problems of a profile must be shown with line
//! and caret. The subset has structs, tuples, lists, maps, texts, numbers, names, `Some(x)` (the same as `x`), `None`, trailing
//! commas, line and nested block comments, and `#![enable(…)]`, but no raw texts and characters.

mod lexer;
mod parser;

use super::diagnostic::{Findings, Span};

/// A value with its location.
#[derive(Clone, Debug)]
pub(super) struct Ast {
    pub(super) span: Span,
    pub(super) node: Node,
}

/// A field of a struct.
#[derive(Clone, Debug)]
pub(super) struct Field {
    pub(super) name: String,
    pub(super) name_span: Span,
    pub(super) value: Ast,
}

/// A value of the syntax tree.
#[derive(Clone, Debug)]
pub(super) enum Node {
    /// `(name: value, …)`, optionally after a name.
    Struct(Vec<Field>),
    /// `(value, …)`, optionally after a name.
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
    /// Description for messages.
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

/// The beginning of a text, for messages.
pub(super) fn shortened(text: &str) -> String {
    const LONGEST: usize = 32;
    crate::text::shortened(text, LONGEST)
}

/// Parses a whole text. `None` after a fatal syntax error, which is in `findings`.
pub(super) fn parse(text: &str, findings: &mut Findings<'_>) -> Option<Ast> {
    parser::parse(text, findings)
}
