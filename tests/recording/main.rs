//! Recordings read back: against the journal, after crashes, on full disks, with viewers that do not behave.

#![expect(
    clippy::unwrap_used,
    clippy::disallowed_methods,
    reason = "a failure of a test is a panic; what is skipped is said; test files need no atomic writes"
)]
#![cfg(unix)]

mod calculations;
mod content;
mod crashes;
mod damage;
mod live;
#[path = "../support/place.rs"]
mod place;
mod reading;
mod running;
#[path = "../support/small_disk.rs"]
mod small_disk;
