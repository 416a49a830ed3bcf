//! Problems of a profile, each with its location: `file:line:column`, the source line, a caret and the allowed values.
//!
//! Text from the file is shown without control characters and without characters that reorder the line.

use std::fmt;

use thiserror::Error;

use crate::text::{printable, wrapped};

/// Width of a message (characters).
const WIDTH: usize = 80;
/// Longest shown part of a source line (characters).
const EXCERPT: usize = 64;
/// Most problems shown for one file.
const MOST: usize = 100;

/// Severity of a problem.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Severity {
    /// The profile can be used, but something is probably unintended.
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

/// A problem of a profile with its location. `Display` writes several lines without a final line break.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Diagnostic {
    pub severity: Severity,
    /// File name for messages.
    pub file: String,
    /// Line number, from 1.
    pub line: usize,
    /// Column number in characters, from 1.
    pub column: usize,
    /// Description, in lower case without a full stop.
    pub message: String,
    /// Allowed values or advice.
    pub hint: Option<String>,
    /// Printable part of the source line around the location.
    excerpt: String,
    /// Number of characters of the excerpt before the caret.
    indent: usize,
    /// Number of carets.
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

/// All problems of an unusable profile, including warnings, in the order of the file.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[error("{}", joined(diagnostics))]
pub struct ProfileErrors {
    /// The problems, of which at least one is an error.
    pub diagnostics: Vec<Diagnostic>,
}

impl ProfileErrors {
    /// Number of errors among the problems.
    pub fn error_count(&self) -> usize {
        self.diagnostics.iter().filter(|diagnostic| diagnostic.severity == Severity::Error).count()
    }
}

/// Several problems as one text, separated by blank lines.
pub(super) fn joined(diagnostics: &[Diagnostic]) -> String {
    diagnostics.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n\n")
}

/// A byte range of the source text, with an exclusive end.
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

/// The text of a file with the problems found so far.
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

    /// Line number of a location, from 1.
    pub(super) fn line_of(&self, span: Span) -> usize {
        self.text.get(..span.start).unwrap_or_default().matches('\n').count() + 1
    }

    /// All problems in the order of the file.
    pub(super) fn into_diagnostics(mut self) -> Vec<Diagnostic> {
        self.found.sort_by_key(|(start, _)| *start);
        self.found.into_iter().map(|(_, diagnostic)| diagnostic).collect()
    }

    /// Adds a problem. After [`MOST`] problems only a final one is added, because the file is probably not a profile.
    fn add(&mut self, severity: Severity, span: Span, message: &str, hint: Option<&str>) {
        let (severity, message, hint) = match self.found.len() {
            0..MOST => (severity, message, hint),
            MOST => (Severity::Error, "too many problems; the rest is not shown", None),
            _ => return,
        };
        let start = span.start.min(self.text.len());
        let before = self.text.get(..start).unwrap_or_default();
        let line_start = before.rfind('\n').map_or(0, |newline| newline + 1);
        let line_text = self.text.get(line_start..).unwrap_or_default().lines().next().unwrap_or_default();
        let indent = before.get(line_start..).unwrap_or_default().chars().count();
        // A span over several lines is marked up to the end of its first line.
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

/// The part of a line around a location, with its indent and the number of carets.
fn cut(line: &str, indent: usize, carets: usize) -> (String, usize, usize) {
    let characters: Vec<char> = printable(line).chars().collect();
    if characters.len() <= EXCERPT {
        let room = characters.len().saturating_sub(indent).max(1);
        return (characters.into_iter().collect(), indent, carets.min(room));
    }
    // Keep the location in the first half of the excerpt, and mark the cut-off parts.
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
