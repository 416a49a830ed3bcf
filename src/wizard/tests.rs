//! The wizard as a function: events in, effects out.

mod automatic;
mod bench;
mod capture;
mod cell;
mod gates;
mod joint_check;
mod journal_first;
mod resume;
mod shutdown;
mod stale;
mod steps;
mod tools;
mod units;
mod way;
