//! Problems of a profile, each with its place: `file:line:column`, the source line, a caret and what is allowed.
//!
//! Text that came from a file is shown without control characters and without marks that reorder the line.

use std::fmt;

use thiserror::Error;

use crate::text::printable;

/// Widest message line (characters).
const WIDTH: usize = 80;
/// Characters of a source line that are shown.
const EXCERPT: usize = 64;
/// Problems of one file that are shown.
const MOST: usize = 100;

/// How bad a problem is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Severity {
    /// The profile can be used, but something is probably not meant so.
    Warning,
    /// The profile cannot be used.
    Error,
}

impl Severity {
    const fn name(self) -> &'static str {
        match self {
            Self::Warning => "warning",
            Self::Error => "error",
        }
    }
}

/// One problem of a profile and its place. `Display` gives several lines, without a line break at the end.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Diagnostic {
    /// Error or warning.
    pub severity: Severity,
    /// File name as it was given for messages.
    pub file: String,
    /// Line, from 1.
    pub line: usize,
    /// Column in characters, from 1.
    pub column: usize,
    /// What is wrong, lower case, without a full stop.
    pub message: String,
    /// What is allowed or what to do.
    pub hint: Option<String>,
    /// The source line, printable, cut to the neighbourhood of the place.
    excerpt: String,
    /// Characters of the excerpt before the caret.
    indent: usize,
    /// Length of the caret.
    carets: usize,
}

impl fmt::Display for Diagnostic {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let place = format!("{}:{}:{}", self.file, self.line, self.column);
        write!(f, "{place}: {}: {}", self.severity.name(), self.message)?;
        let number = self.line.to_string();
        let margin = " ".repeat(number.len());
        write!(f, "\n  {number} |{}{}", if self.excerpt.is_empty() { "" } else { " " }, self.excerpt)?;
        write!(f, "\n  {margin} | {}{}", " ".repeat(self.indent), "^".repeat(self.carets))?;
        if let Some(hint) = &self.hint {
            let lines = wrapped(hint, WIDTH - 8);
            for (index, line) in lines.iter().enumerate() {
                write!(f, "\n  {} {line}", if index == 0 { "hint:" } else { "     " })?;
            }
        }
        Ok(())
    }
}

/// All problems of a profile that cannot be used, warnings included, in the order of the file.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[error("{}", joined(diagnostics))]
pub struct ProfileErrors {
    /// The problems; at least one is an error.
    pub diagnostics: Vec<Diagnostic>,
}

impl ProfileErrors {
    /// Number of problems that are errors.
    pub fn error_count(&self) -> usize {
        self.diagnostics.iter().filter(|diagnostic| diagnostic.severity == Severity::Error).count()
    }
}

/// Several problems as one text, a blank line between them.
pub(super) fn joined(diagnostics: &[Diagnostic]) -> String {
    diagnostics.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n\n")
}

/// Bytes of a source text, end exclusive.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Span {
    pub(super) start: usize,
    pub(super) end: usize,
}

impl Span {
    pub(super) const fn new(start: usize, end: usize) -> Self {
        Self { start, end }
    }
}

/// The text of a file and the problems found in it so far.
#[derive(Debug)]
pub(super) struct Findings<'a> {
    text: &'a str,
    file: String,
    found: Vec<(usize, Diagnostic)>,
}

impl<'a> Findings<'a> {
    pub(super) fn new(text: &'a str, file: &str) -> Self {
        Self { text, file: printable(file), found: Vec::new() }
    }

    pub(super) fn error(&mut self, span: Span, message: impl Into<String>, hint: impl Into<Option<String>>) {
        self.add(Severity::Error, span, &message.into(), hint.into().as_deref());
    }

    pub(super) fn warning(&mut self, span: Span, message: impl Into<String>, hint: impl Into<Option<String>>) {
        self.add(Severity::Warning, span, &message.into(), hint.into().as_deref());
    }

    pub(super) fn has_errors(&self) -> bool {
        self.found.iter().any(|(_, diagnostic)| diagnostic.severity == Severity::Error)
    }

    /// Line of a place, from 1.
    pub(super) fn line_of(&self, span: Span) -> usize {
        self.text.get(..span.start).unwrap_or_default().matches('\n').count() + 1
    }

    /// The problems in the order of the file.
    pub(super) fn into_diagnostics(mut self) -> Vec<Diagnostic> {
        self.found.sort_by_key(|(start, _)| *start);
        self.found.into_iter().map(|(_, diagnostic)| diagnostic).collect()
    }

    /// Notes a problem. After [`MOST`] of them only one more says so: the file is no profile, and the rest helps nobody.
    fn add(&mut self, severity: Severity, span: Span, message: &str, hint: Option<&str>) {
        let (severity, message, hint) = match self.found.len() {
            0..MOST => (severity, message, hint),
            MOST => (Severity::Error, "too many problems: the rest is not shown", None),
            _ => return,
        };
        let start = span.start.min(self.text.len());
        let before = self.text.get(..start).unwrap_or_default();
        let line_start = before.rfind('\n').map_or(0, |newline| newline + 1);
        let line_text = self.text.get(line_start..).unwrap_or_default().lines().next().unwrap_or_default();
        let indent = before.get(line_start..).unwrap_or_default().chars().count();
        // A span over several lines is marked to the end of its first line.
        let span_text = self.text.get(start..span.end.min(self.text.len())).unwrap_or_default();
        let carets = span_text.lines().next().unwrap_or_default().chars().count().max(1);
        let (excerpt, indent_shown, carets_shown) = cut(line_text, indent, carets);
        let diagnostic = Diagnostic {
            severity,
            file: self.file.clone(),
            line: before.matches('\n').count() + 1,
            column: indent + 1,
            message: printable(message),
            hint: hint.map(printable),
            excerpt,
            indent: indent_shown,
            carets: carets_shown,
        };
        self.found.push((start, diagnostic));
    }
}

/// The part of a line around a place, its indent there and the length of the caret.
fn cut(line: &str, indent: usize, carets: usize) -> (String, usize, usize) {
    let characters: Vec<char> = printable(line).chars().collect();
    if characters.len() <= EXCERPT {
        let room = characters.len().saturating_sub(indent).max(1);
        return (characters.into_iter().collect(), indent, carets.min(room));
    }
    // The place goes to the middle at the latest; what is cut off is marked.
    let first = indent.saturating_sub(EXCERPT / 2).min(characters.len() - EXCERPT);
    let last = first + EXCERPT;
    let mut shown: String = characters.iter().skip(first).take(EXCERPT).collect();
    let mut shift = 0;
    if first > 0 {
        shown.insert_str(0, "...");
        shift = 3;
    }
    if last < characters.len() {
        shown.push_str("...");
    }
    (shown, indent - first + shift, carets.min(last.saturating_sub(indent)).max(1))
}

/// Lines of at most `width` characters, broken at spaces.
pub(super) fn wrapped(text: &str, width: usize) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in text.split_whitespace() {
        match lines.last_mut() {
            Some(line) if line.chars().count() + 1 + word.chars().count() <= width => {
                line.push(' ');
                line.push_str(word);
            }
            _ => lines.push(word.to_owned()),
        }
    }
    lines
}
