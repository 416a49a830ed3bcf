//! The pure data of a session: plans, measured tables and the choice of rows from them.
//!
//! Text comes in, types go out. Inside, lengths are metres and angles radians; a *configuration* is the pendant joint
//! vector. Points are in the tracker frame, which is never registered to the robot base.
//!
//! This module reads no file and no clock, and never estimates anything. All defects of a table are reported together
//! ([`TableErrors`]), each with its place and what to do about it.

#![warn(clippy::wildcard_enum_match_arm)]

pub mod about;
pub mod advice;
pub mod calibration;
pub mod comparison;
pub mod constraints;
pub mod corrected;
pub mod decision;
pub mod export;
pub mod filter;
pub mod health;
pub mod iso9283;
pub mod joint_errors;
pub mod journal;
pub mod measurements;
mod orientation;
pub mod plan;
pub mod plan_summary;
pub mod reading;
pub mod set_up;
pub mod simulation;
pub mod state;
pub mod station;
pub mod summary;
mod table;
pub mod targets;
mod warning;
pub mod wire;
pub mod workbook;

pub use table::{Defect, TableErrors, TableProblem};

use sha2::{Digest as _, Sha256};

/// SHA-256 in hexadecimal.
pub fn sha256(bytes: &[u8]) -> String {
    Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect::<Vec<_>>().concat()
}
