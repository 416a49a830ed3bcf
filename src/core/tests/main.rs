//! Tests of the maths that compute much: they are optimised as the library is.

#![expect(clippy::unwrap_used, clippy::panic, reason = "a failure of a test is a panic")]

// Both sets of tests call the library by one name, and share their cases.
extern crate trupose_core as trupose;

#[path = "../../../tests/support/cell_of.rs"]
mod cell_of;
#[path = "../../../tests/support/paper_case.rs"]
mod paper_case;
#[path = "../../../tests/support/point_cloud.rs"]
mod point_cloud;
mod support {
    pub(crate) use super::{cell_of, paper_case, point_cloud};
}

mod cell;
mod estimation;
