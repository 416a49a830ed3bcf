//! Recordings read back: against the journal, after crashes, on full disks, with viewers that do not behave.

mod calculations;
mod content;
mod crashes;
mod damage;
mod live;
mod reading;
mod running;
mod viewer;
