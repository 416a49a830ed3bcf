//! Planning of measuring poses: which configurations to measure so that the identified arm predicts well everywhere, which of them
//! can be measured at all in the [`Cell`] ([`candidates`]), and in which order ([`order`]).
//!
//! From a pool of candidate configurations ([`Information`]) a set is chosen by exchange ([`Search`]) and judged ([`Score`]):
//!
//! - **Condition number** of the identification matrix `A·S` (actual pair rows `u_jk · (B_k − B_j)` of the set, every parameter
//!   in units of its expected deviation, on the subspace that distances can identify, prior not counted).
//! - **Predicted error**: RMS position error of the identified arm at fresh poses, registration included, per unit of
//!   measurement σ: `sqrt(trace(M⁻¹ W))`, M the information of the set and W the mean of `GᵀG` over fresh poses, both on the
//!   identifiable subspace together with the six parameters of the frame.
//!
//! The condition number alone is a bad master: sets that minimise it predict worse than random ones, because they give up the
//! strong directions. The default objective ([`Objective::Balanced`]) therefore minimises it only among sets whose predicted
//! error is near the best found. Measured on the paper's robot (1 mm and 0.1° expected, 1500 random candidates; the last column
//! is the median error at fresh poses over 1000 simulated calibrations, against 56 random poses, σ = 10 µm):
//!
//! | poses | condition number | predicted error (σ) | error of the identified arm |
//! |---|---|---|---|
//! | 56 random (median) | 94 | 0.76 | 0.75 σ |
//! | 56 balanced | 62 | 0.68 | −11 % |
//! | 56 by prediction | 86 | 0.65 | −14 % |
//! | 56 D-optimal | 86 | 0.67 | −13 % |
//! | 46 balanced | 62 | 0.75 | −1 % |
//! | 56 by condition number | 28 | 2.56 | +188 % |
//!
//! A bound from approximate design ([`DesignBound`]) says how much a better set could still gain.
//!
//! ```
//! use trupose_core::kinematics::Place;
//! use trupose_core::planning::{Information, Score, Search, SearchSettings};
//! use trupose_core::profile::{Level, Profile, builtin};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let (profile, _) = Profile::parse(builtin("soochow").unwrap(), "soochow")?;
//! let (arm, parameters) = (profile.arm(), profile.parameters(Level::Geometric));
//!
//! // 200 candidates that spread over the joint ranges, the last 50 only to judge by.
//! let value = |pose: usize, joint: usize| 3.0 * ((pose as f64 * (joint as f64 + 2.0).sqrt()).fract() - 0.5);
//! let place = |pose| Place { configuration: (0..6).map(|joint| value(pose, joint)).collect(), target: 0 };
//! let places: Vec<Place> = (1..=200).map(place).collect();
//! let (candidates, fresh) = places.split_at(150);
//! let information = Information::new(&arm, &parameters, candidates, fresh)?;
//!
//! let settings = SearchSettings { poses: 20, starts: 1, ..SearchSettings::default() };
//! let chosen = Search::new(&information, settings)?.run(&|| true, &|_| {})?;
//! let first: Vec<usize> = (0..20).collect();
//! let (score, unchosen) = (Score::new(&information, &chosen.set)?, Score::new(&information, &first)?);
//! assert!(score.condition_number < unchosen.condition_number);
//! assert!(score.predicted_error < unchosen.predicted_error);
//! # Ok(())
//! # }
//! ```
//!
//! Lengths in metres, angles in radians, configurations in pendant values. Nothing here reads a file or a clock or starts a
//! thread; randomness comes only from a passed seed, time limits only as a callback. `trupose::search` runs the
//! starts of a search in parallel.
//!
//! Literature: Sun & Hollerbach, "Observability index selection for robot calibration", ICRA 2008 (O1–O5); Fedorov, "Theory of
//! optimal experiments", 1972 (exchange); Kiefer & Wolfowitz, "The equivalence of two extremum problems", 1960 (bound);
//! Roberts, "The unreasonable effectiveness of quasirandom sequences", 2018 (samples).

#![warn(missing_docs)]

mod bound;
pub mod candidates;
mod cell;
mod choice;
pub mod collision;
mod descent;
mod error;
mod exchange;
mod filling;
mod information;
mod objective;
pub mod order;
mod pair_exchange;
mod pairs;
mod sampling;
mod score;
mod spreading;
mod terms;
mod trade_off;
pub mod verification_set;
pub mod visibility;
mod yardstick;

pub use bound::DesignBound;
pub use cell::{Body, BoxInBase, Cell, CellError, KeepOutBox, MountedTarget, TrackerStand};
pub use choice::Search;
pub use error::PlanningError;
pub use information::{Information, fewest_poses, findable};
pub use objective::{Chosen, Figures, Objective, Progress, SearchSettings, Stage};
pub use sampling::{JointBox, low_discrepancy, random};
pub use score::{ObservabilityIndices, ParameterPrecision, Score};
pub use spreading::Spreading;
pub use terms::{EXPECTED_CURVES, REPEATABILITY, TermModel};
pub use trade_off::{TradeOff, trade_off};
pub use yardstick::{Spread, Yardstick};

/// Checks that a set can be scored: known candidates, none twice, enough of them.
fn check_set(information: &Information, set: &[usize]) -> Result<(), PlanningError> {
    check_members(information, set)?;
    check_count(information, set.len())
}

/// Checks that a set holds known candidates, none twice.
fn check_members(information: &Information, set: &[usize]) -> Result<(), PlanningError> {
    let mut sorted = set.to_vec();
    sorted.sort_unstable();
    if let Some(&pose) = sorted.iter().find(|&&pose| pose >= information.len()) {
        return Err(PlanningError::UnknownCandidate { pose, candidates: information.len() });
    }
    if let Some(pair) = sorted.windows(2).find(|pair| pair[0] == pair[1]) {
        return Err(PlanningError::RepeatedPose { pose: pair[0] });
    }
    Ok(())
}

/// Checks that `poses` poses can determine what the pool can.
fn check_count(information: &Information, poses: usize) -> Result<(), PlanningError> {
    let needed = information.fewest_poses();
    if poses >= needed {
        return Ok(());
    }
    Err(PlanningError::TooFewPoses {
        poses,
        parameters: information.parameters().len(),
        rank: information.rank(),
        needed,
    })
}
