//! Checks of plausibility.
