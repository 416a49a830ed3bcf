//! Errors of script files.

use thiserror::Error;

/// Why a script cannot be used.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[non_exhaustive]
pub enum ScriptError {
    /// The text is not RON, or not a script.
    #[error("line {line}, column {column}: {message}")]
    Syntax {
        /// Line, from 1.
        line: usize,
        /// Column, from 1.
        column: usize,
        /// What is wrong.
        message: String,
    },
    /// A placeholder has no value.
    #[error("the script needs a value for '{name}': use '--set {name}=…'")]
    MissingValue { name: String },
    /// A value has no placeholder.
    #[error("the script has no placeholder '{name}'; it has: {known}")]
    UnknownValue { name: String, known: String },
    /// A placeholder is not closed.
    #[error("line {line}: '${{' without '}}'")]
    OpenPlaceholder {
        /// Line, from 1.
        line: usize,
    },
    /// The start of the clock is not a time.
    #[error("'{text}' is not a time; write for example '2026-01-01T08:00:00Z'")]
    Clock { text: String },
}
