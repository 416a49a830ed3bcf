//! Input fields: a line of text, a number, a choice from a list. They handle keys and draw themselves; their owner uses the value.

mod choice;
mod number;
mod text;

pub use choice::ChoiceList;
pub use number::NumberField;
pub use text::{Completion, TextField, Validator};

/// What a field did with a key.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FieldOutcome {
    /// Not handled.
    Ignored,
    /// The field changed.
    Changed,
    /// The operator submitted the value.
    Submitted,
    /// The operator cancelled.
    Cancelled,
}
