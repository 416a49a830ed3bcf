//! Faults of a single sample: the arm stood at another pose, or one joint elsewhere than shown.

use super::fit::{Fit, Innovation, Item, Probe};
use crate::kinematics::{JointType, KinematicChain};
use crate::units::{DEGREE, MILLIMETRE};

/// Spreads (m) of readings that fit nothing, each as likely as the others.
const SPREADS: [f64; 8] = [0.3e-3, 1e-3, 3e-3, 10e-3, 30e-3, 100e-3, 300e-3, 1.0];
/// Slips of a turning joint that are tried as a start (rad): this step up to half a turn.
const TURN_STEP: f64 = 10.0 * DEGREE;
const TURN_STEPS: i32 = 18;
/// The same of a sliding joint (m).
const SLIDE_STEP: f64 = 20.0 * MILLIMETRE;
const SLIDE_STEPS: i32 = 20;
/// Steps of refinement, and the change of a joint ((rad) or (m)) that its derivative is taken with.
const REFINEMENTS: usize = 12;
const DIFFERENCE: f64 = 1e-6;
/// Starts that are refined per joint, beside the smallest slip.
const STARTS: usize = 2;
/// ln of the ratio of the largest to the smallest slip of interest: all orders of size are alike.
const SIZES: f64 = 6.0;
/// Smaller slips ((rad) or (m)) are as likely as this one.
const SMALLEST: f64 = 1e-3;

/// −2 ln of the density of a reading that fits nothing.
pub(super) fn outlier_energy(innovation: &Innovation) -> f64 {
    let energies = SPREADS.map(|spread| innovation.energy(spread));
    let least = energies.iter().copied().fold(f64::INFINITY, f64::min);
    let sum: f64 = energies.iter().map(|energy| (0.5 * (least - energy)).exp()).sum();
    least - 2.0 * (sum / SPREADS.len() as f64).ln()
}

/// One joint elsewhere than shown.
#[derive(Clone, Copy, Debug)]
pub(super) struct Slip {
    pub(super) joint: usize,
    /// True less shown value (rad) or (m).
    pub(super) by: f64,
    /// −2 ln of the density of the point.
    pub(super) energy: f64,
    /// The part of `energy` that the free size costs.
    pub(super) price: f64,
}

/// The best slip of every joint for `item` against the others in `fit`.
pub(super) fn slips(chain: &KinematicChain, fit: &Fit<'_>, item: &Item) -> Vec<Slip> {
    let mut probe = fit.probe(item);
    (0..chain.dof()).filter_map(|joint| best_slip(chain, &mut probe, item, joint)).collect()
}

fn shifted(item: &Item, joint: usize, by: f64) -> Vec<f64> {
    let mut configuration = item.at.configuration.clone();
    configuration[joint] += by;
    configuration
}

fn best_slip(chain: &KinematicChain, probe: &mut Probe<'_, '_>, item: &Item, joint: usize) -> Option<Slip> {
    let (step, steps) = match chain.joints()[joint].joint_type {
        JointType::Revolute => (TURN_STEP, TURN_STEPS),
        JointType::Prismatic => (SLIDE_STEP, SLIDE_STEPS),
    };
    let grid: Vec<f64> = (-steps..=steps).map(|index| f64::from(index) * step).collect();
    let squares: Vec<f64> = grid.iter().map(|&by| probe.at(&shifted(item, joint, by)).square()).collect();
    let lowest = |index: &usize| {
        let not_below = |other: Option<&f64>| other.is_none_or(|other| *other >= squares[*index]);
        not_below(index.checked_sub(1).and_then(|before| squares.get(before))) && not_below(squares.get(index + 1))
    };
    let mut starts: Vec<usize> = (0..grid.len()).filter(lowest).collect();
    starts.sort_by(|&a, &b| squares[a].total_cmp(&squares[b]));
    starts
        .into_iter()
        .take(STARTS)
        .map(|index| grid[index])
        .chain([0.0])
        .filter_map(|start| refined(chain.dof(), probe, item, joint, start))
        .min_by(|a, b| a.energy.total_cmp(&b.energy))
}

fn refined(joints: usize, probe: &mut Probe<'_, '_>, item: &Item, joint: usize, start: f64) -> Option<Slip> {
    let mut by = start;
    for _ in 0..REFINEMENTS {
        let configuration = shifted(item, joint, by);
        let at = probe.at(&configuration);
        let factor = at.covariance.cholesky()?;
        let slope = probe.change(&configuration, &shifted(item, joint, by + DIFFERENCE)) / DIFFERENCE;
        let weighted = factor.solve(&slope);
        let curvature = slope.dot(&weighted);
        if curvature <= 0.0 {
            return None;
        }
        let change = -at.error.dot(&weighted) / curvature;
        if change.abs() < 1e-2 / curvature.sqrt() {
            // The share of all slips that is as good as this one.
            let density = 1.0 / (2.0 * SIZES * by.abs().max(SMALLEST));
            let share = (density * (std::f64::consts::TAU / curvature).sqrt()).min(1.0);
            let price = -2.0 * share.ln() + 2.0 * (joints as f64).ln();
            return Some(Slip { joint, by, energy: at.energy(0.0) + price, price });
        }
        by += change.clamp(-TURN_STEP, TURN_STEP);
    }
    None
}
