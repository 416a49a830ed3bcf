//! Scripts: the wizard without a terminal.
//!
//! A script is a RON file, `*.script.ron`: a list of intents, waits and expectations ([`Script`]). The runner ([`Runner`])
//! executes it with the same wizard and the same threads as the terminal, and prints one line per event. The first expectation
//! that is not met ends the script, and the report names the step, what was expected and what was seen.
//!
//! Placeholders: `${name:default}` is replaced by the value of `--set name=value`, or else by the default. `${name}` has no
//! default and needs a value.

mod error;
mod expectation;
mod grammar;
mod placeholders;
mod runner;
mod transcript;

pub use error::ScriptError;
pub use expectation::Check;
pub use grammar::{OnFinding, Script, ScriptStep};
pub use runner::{Outcome, Runner};
pub use transcript::{Format, Transcript};
