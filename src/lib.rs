//! trupose makes an industrial arm accurate: it identifies the kinematic errors of a robot from distances between points measured
//! with a laser tracker, verifies them on points it never saw, and delivers a corrected model with honest error bars.
//!
//! Words, one per thing: *nominal* is the maker's, *identified* is ours, *deviation* = identified − nominal; a *configuration* is
//! a joint vector as the pendant shows it; a *target* is an SMR on the flange; a *sample* is a configuration with its reading;
//! *residual* = measured − predicted. Transforms are named so that they cancel: `base_from_flange`, `point_in_base`.
//! Inside are metre, radian and `f64`; millimetre and degree live at the edge, with the unit in every field name.
//!
//! Layers, lowest first; a module knows only those before it (`tests/architecture.rs` checks it):
//!
//! - [`text`]: words for people. Knows nothing of robots.
//! - [`units`], [`geometry`], [`kinematics`], [`compensation`], [`identification`], [`planning`]: the maths. No I/O, no clock, no threads, no random numbers.
//! - [`profile`], [`session`], [`program`]: pure data. Text in, checked types out; robot programs out.
//! - [`model`]: models of the arm in the formats of others, in and out.
//! - [`correction`]: robot programs corrected with a calibration.
//! - [`link`]: instruments, simulated and replayed ones among them.
//! - [`store`], [`report`]: files on disk and text for people. Know the data, never how it was made.
//! - [`search`], [`error`]: a pose search on several threads; how a command ends and what its message says.
//! - [`procedure`]: the calibration itself on data in memory, the same for commands and wizard. No files, no clock.
//! - [`wizard`]: the guided calibration as a pure state machine.
//! - [`runtime`]: turns its effects into work on threads, and answers into events.
//! - [`script`], [`tui`]: the two drivers of the [`wizard`], without and with a terminal.
//! - [`cli`], [`app`]: what was typed, and what is done about it.
//!
//! Reference: "A distance error based industrial robot kinematic calibration method", Industrial Robot 41/5 (2014) 439–446,
//! called *the method paper* throughout.

pub mod app;
pub mod cli;
pub mod correction;
pub mod error;
pub mod link;
pub mod model;
pub mod procedure;
pub mod program;
pub mod recording;
pub mod report;
pub mod runtime;
pub mod script;
pub mod search;
pub mod session;
pub mod store;
pub mod tui;
pub mod wizard;

pub use trupose_core::{
    checksum, compensation, geometry, identification, inverse, iso9283, kinematics, planning, profile, text, units,
};
