//! Fields to fill in: a line of text, a number, a choice from a list. They take keys and draw themselves; what the value is
//! for is their owner's business.

mod choice;
mod number;
mod text;

pub use choice::ChoiceList;
pub use number::NumberField;
pub use text::{Check, TextField};

/// What a key did to a field.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reaction {
    /// The field has no use for it.
    Ignored,
    /// Something changed.
    Changed,
    /// The value is meant.
    Done,
    /// The operator does not want it.
    Cancelled,
}
