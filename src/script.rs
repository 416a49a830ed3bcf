//! Scripts: a wizard run without a terminal.
//!
//! A script is a RON file, `*.script.ron`: a list of intents, waits and expectations ([`Script`]). The runner ([`Runner`]) does
//! them with the same wizard and the same threads as the terminal, and prints one line for everything that happens. The first
//! expectation that is not met ends it, with the step, what was expected and what was seen.
//!
//! Placeholders: `${name:default}` is replaced by the value given with `--set name=value`, or by its default; `${name}` without a
//! default must be given.

mod expectation;
mod grammar;
mod placeholders;
mod runner;
mod transcript;

pub use expectation::Check;
pub use grammar::{OnFinding, Script, ScriptError, ScriptStep};
pub use runner::{Outcome, Runner};
pub use transcript::{Format, Transcript};
