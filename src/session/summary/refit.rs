//! What a verification fits.

use clap::ValueEnum;

use crate::text::names_of_option;

/// What is fitted to verification samples because the set-up changed. The comments on the values are the help of `--refit`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum Refit {
    /// Same tracker position and SMR mounting as at the identification
    #[default]
    None,
    /// The tracker was moved
    Frame,
    /// The SMR was remounted, or is another one
    Target,
    /// The tracker was moved and the SMR remounted
    #[value(name = "frame+target")]
    FrameAndTarget,
}

names_of_option!(Refit);
