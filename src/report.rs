//! Results as text for people: at most 80 columns, every number with its unit and as many digits as it deserves.
//!
//! Knows the plain summaries of `session` and nothing of how they were made.

mod plan;
mod tables;
mod text;

pub use plan::plan_text;
pub use tables::fixed as number;
pub use text::{identification_text, verification_text};
