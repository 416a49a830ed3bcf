//! Outliers: robust estimation over whole points, and the decision which samples to reject.
//!
//! A bumped SMR spoils one point and with it all M − 1 distances that end there, so trust is a property of a point. Clean data
//! keep the full efficiency of least squares: the robust loss only finds the outliers, which are then removed for real and the
//! rest is fitted with full weights.

use nalgebra::{Point3, Vector3};

use super::linearise::{Weights, point_residuals};
use super::problem::Problem;
use super::solver::{Linearised, Solve};
use crate::units::MILLIMETRE;

/// A point further off than this many robust standard deviations is rejected. Real arms have heavy tails (gravity, backlash,
/// gear harmonics): good points of the measured UR5 set reach five.
pub(crate) const REJECT_AT: f64 = 6.0;
/// Median of the norm of three standard normal numbers (chi distribution, 3 degrees of freedom).
const MEDIAN_CHI_3: f64 = 1.538_172_254_455_052;
/// Each step of the graduated search makes the loss this much less convex (Yang et al. 2020, "Graduated non-convexity for
/// robust spatial perception", section III).
const GRADUATION: f64 = 1.4;
/// A point further off the nominal arm than this many robust standard deviations is left out until the arm is known better.
const GROSS: f64 = 2.0 * REJECT_AT;
/// Most steps of the robust registration: enough for an outlier of a thousand times the spread.
const GROSS_STEPS: usize = 60;
/// Steps of each fit within the search.
const SEARCH_STEPS: usize = 30;
/// Rounds in which samples may change sides before the decision stands.
const ROUNDS: usize = 10;

/// Robust standard deviation of a coordinate (m) from the median residual of the trusted places, corrected for the share of the
/// residual that the fit took up.
pub(crate) fn robust_sigma(problem: &Problem<'_>, residuals: &[Vector3<f64>], trust: &[f64], floor: f64) -> f64 {
    let mut norms: Vec<f64> = residuals
        .iter()
        .zip(trust)
        .take(judged_places(problem))
        .filter(|(_, trust)| **trust > 0.0)
        .map(|(residual, _)| residual.norm())
        .collect();
    if norms.is_empty() {
        return floor;
    }
    let values = (3 * norms.len()) as f64;
    let middle = norms.len() / 2;
    let (_, median, _) = norms.select_nth_unstable_by(middle, f64::total_cmp);
    let fitted = (problem.parameters.len() + 6) as f64;
    let shrink = (1.0 - fitted / values).max(0.1).sqrt();
    (*median / MEDIAN_CHI_3 / shrink).max(floor)
}

/// Places with a residual vector of their own: points and seats of shared points.
fn judged_places(problem: &Problem<'_>) -> usize {
    problem.observations.points.len() + problem.observations.shared.iter().map(|shared| shared.at.len()).sum::<usize>()
}

/// Leaves out, for a start, what the nominal arm already shows to be impossible: a mistyped joint puts a point metres off, and one
/// such point can lead a least-squares fit astray for good. Trust 1 or 0 per place, from a robust registration of the nominal
/// predictions; the deviations of a real arm stay far below the limit, and later rounds take back whoever fits.
pub(crate) fn gross_trust(problem: &Problem<'_>, predicted: &[Point3<f64>]) -> Vec<f64> {
    let all = Weights::uniform(problem, MILLIMETRE);
    let places = problem.observations.points.len();
    let mut residuals = point_residuals(problem, predicted, &all).of_places;
    let sigma = robust_sigma(problem, &residuals, &all.trust, f64::MIN_POSITIVE);
    if residuals.iter().all(|residual| residual.norm() <= GROSS / 2.0 * sigma) {
        return all.trust;
    }
    let mut convexity = f64::INFINITY;
    for _ in 0..GROSS_STEPS {
        let sigma = robust_sigma(problem, &residuals, &all.trust, f64::MIN_POSITIVE);
        let scale = (REJECT_AT * sigma / 2.0).powi(2);
        let largest = residuals.iter().map(Vector3::norm_squared).fold(0.0, f64::max);
        convexity = (convexity / GRADUATION).min(2.0 * largest / scale).max(1.0);
        let mut weights = all.clone();
        for (trust, residual) in weights.trust.iter_mut().zip(&residuals).take(places) {
            *trust = geman_mcclure(residual, convexity * scale);
        }
        residuals = point_residuals(problem, predicted, &weights).of_places;
        if convexity <= 1.0 {
            break;
        }
    }
    let sigma = robust_sigma(problem, &residuals, &all.trust, f64::MIN_POSITIVE);
    let mut trust = all.trust;
    for (trust, residual) in trust.iter_mut().zip(&residuals).take(places) {
        if residual.norm() > GROSS * sigma {
            *trust = 0.0;
        }
    }
    trust
}

/// Weight of a point with the Geman–McClure loss of squared width `width`.
fn geman_mcclure(residual: &Vector3<f64>, width: f64) -> f64 {
    (width / (residual.norm_squared() + width)).powi(2)
}

/// Finds outliers at a least-squares solution. Returns the trust of every place: 1 or 0.
///
/// `floor` is the smallest standard deviation (m) that residuals are judged by.
pub(crate) fn find_outliers(solve: &Solve<'_, '_>, least_squares: &Linearised, floor: f64) -> Vec<f64> {
    let problem = solve.problem;
    let places = judged_places(problem);
    let all = vec![1.0; solve.weights.trust.len()];
    let residuals = &least_squares.points.of_places;
    let sigma = robust_sigma(problem, residuals, &all, floor);
    let largest = residuals.iter().take(places).map(Vector3::norm).fold(0.0, f64::max);
    if largest <= suspect_at(places) * sigma {
        return all;
    }
    let (start, sigma) = graduated_search(solve, least_squares, floor);
    let mut trust = decide(&start.points.of_places, places, &all, sigma);
    let mut from = start.z;
    for _ in 0..ROUNDS {
        if trust.iter().sum::<f64>() < 4.0 {
            return all;
        }
        let weights = Weights { sigma: solve.weights.sigma, trust: trust.clone() };
        let refit = Solve { weights: &weights, ..*solve };
        let (fit, _) = refit.run(from, SEARCH_STEPS, &mut Vec::new());
        let sigma = robust_sigma(problem, &fit.points.of_places, &trust, floor);
        let decided = decide(&fit.points.of_places, places, &all, sigma);
        from = fit.z;
        if decided == trust {
            break;
        }
        trust = decided;
    }
    trust
}

/// Geman–McClure loss, from convex to redescending; one step of the solver per degree.
fn graduated_search(solve: &Solve<'_, '_>, start: &Linearised, floor: f64) -> (Linearised, f64) {
    let problem = solve.problem;
    let all = vec![1.0; solve.weights.trust.len()];
    let mut at = start.clone();
    let mut sigma = robust_sigma(problem, &at.points.of_places, &all, floor);
    let scale = |sigma: f64| (REJECT_AT * sigma / 2.0).powi(2);
    let largest = at.points.of_places.iter().map(Vector3::norm_squared).fold(0.0, f64::max);
    let mut convexity = (2.0 * largest / scale(sigma)).max(1.0);
    loop {
        let trust: Vec<f64> =
            at.points.of_places.iter().map(|residual| geman_mcclure(residual, convexity * scale(sigma))).collect();
        let weights = Weights { sigma: solve.weights.sigma, trust };
        let step = Solve { weights: &weights, ..*solve };
        let here = step.linearise(at.z.clone());
        match step.step(&here) {
            Ok((next, _)) => at = next,
            Err(_) => at = here,
        }
        sigma = robust_sigma(problem, &at.points.of_places, &all, floor);
        if convexity <= 1.0 {
            return (at, sigma);
        }
        convexity = (convexity / GRADUATION).max(1.0);
    }
}

fn decide(residuals: &[Vector3<f64>], places: usize, all: &[f64], sigma: f64) -> Vec<f64> {
    let mut trust = all.to_vec();
    for (trust, residual) in trust.iter_mut().zip(residuals).take(places) {
        if residual.norm() > REJECT_AT * sigma {
            *trust = 0.0;
        }
    }
    trust
}

/// A largest residual beyond this many robust standard deviations starts the robust search: more than what Gaussian noise of
/// so many points shows in about one set of a hundred (chi distribution, 3 degrees of freedom).
fn suspect_at(places: usize) -> f64 {
    (4.4 + 0.5 * (places as f64 / 50.0).log10()).clamp(4.0, REJECT_AT)
}
