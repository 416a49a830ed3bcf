//! Outliers: which samples do not belong to the others, and which of them to trust.
//!
//! A bumped SMR spoils one point and with it all M − 1 distances that end there, so trust is a property of a point (or of a
//! measured length), not of a pair. Clean data keep the full efficiency of least squares: the robust loss only finds the
//! outliers, which are then removed for real and the rest is fitted with full weights.
//!
//! Samples are judged by their *studentised* residual: the residual in units of what it should scatter by once the fit has
//! followed it, `√(eᵀ (I − h)⁻¹ e)` with the leverage h, and for a sample left out `√(eᵀ (I + h)⁻¹ e)`. A mistyped joint that
//! otherwise hardly moves has all the say about its own parameters: its plain residual is zero, its studentised one is not,
//! because the expected deviations disagree.

use std::ops::ControlFlow;

use nalgebra::{Cholesky, DMatrix, DVector, Dyn, Matrix3, Point3, SymmetricEigen, Vector3};

use super::linearise::{Evaluation, Weights, point_residuals, project};
use super::problem::Problem;
use super::solver::{Linearised, Solve};
use crate::units::MILLIMETRE;

/// A sample further off than this many robust standard deviations is rejected. Real arms have heavy tails (gravity, backlash,
/// gear harmonics): good points of the measured UR5 set reach five.
const REJECT_AT: f64 = 6.0;
/// Median of the norm of three standard normal numbers (chi distribution, 3 degrees of freedom).
const MEDIAN_CHI_3: f64 = 1.538_172_254_455_052;
/// Median of the absolute value of a standard normal number.
const MEDIAN_CHI_1: f64 = 0.674_489_750_196_082;
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
const ROUNDS: usize = 30;
/// In one round only samples at least this bad, relative to the worst, are left out: one wild sample makes others look bad.
const WORST_FIRST: f64 = 0.3;
/// Samples that stand out from the nominal arm by this many times what is typical are left out of the first fit of one search.
const SUSPECT_OF_NOMINAL: f64 = 3.0;
/// Parameters this many expected deviations from nominal deserve a search for a sample that bent them.
const RAN_AWAY: f64 = 5.0;
/// `1 − h` is not taken below this: beyond, a residual is rounding noise.
const FULL_LEVERAGE: f64 = 1e-9;

/// Trust and studentised residual of every sample: places with a residual of their own first (points, seats of shared points),
/// then lengths.
#[derive(Clone, Debug)]
pub(crate) struct Judgement {
    /// In units of the robust scatter of the accepted samples of its kind.
    pub(crate) ratios: Vec<f64>,
    /// That scatter for places, in units of what the weights promise.
    scatter: f64,
}

/// Places with a residual vector of their own: points and seats of shared points.
fn judged_places(problem: &Problem<'_>) -> usize {
    problem.observations.points.len() + problem.observations.shared.iter().map(|shared| shared.at.len()).sum::<usize>()
}

/// Standard deviation behind the median of some norms, with the median of the standard distribution.
fn robust_scale(mut norms: Vec<f64>, median_of_standard: f64) -> Option<f64> {
    let middle = norms.len() / 2;
    (!norms.is_empty()).then(|| {
        let (_, median, _) = norms.select_nth_unstable_by(middle, f64::total_cmp);
        *median / median_of_standard
    })
}

/// Judges every sample at a fit made with `weights`. `floor` is the smallest scatter, in units of the σ of the weights, that
/// samples are judged by.
pub(crate) fn judge(solve: &Solve<'_, '_>, at: &Linearised, weights: &Weights, floor: f64) -> Judgement {
    judge_with(solve, at, weights, weights, floor)
}

/// As [`judge`], with the frames fitted to the samples that `weights` trusts and the parameters known from those of `counting`.
fn judge_with(solve: &Solve<'_, '_>, at: &Linearised, weights: &Weights, counting: &Weights, floor: f64) -> Judgement {
    let problem = solve.problem;
    let evaluation = Evaluation::new(problem, &at.arm);
    let residuals = point_residuals(problem, &evaluation.points, weights);
    let full = Weights::uniform(problem, weights.sigma);
    let rows = project(problem, evaluation, &residuals, weights, &full);
    let places = judged_places(problem);
    let trusted = |sample: usize| counting.of_sample(sample, places) > 0.0;
    let t = &solve.basis.transform;
    let row_count = rows.residuals.len();
    let reduced = t.transpose() * DMatrix::from_column_slice(rows.n, row_count, &rows.rows);
    let sample_of = |row: usize| if row < 3 * places { row / 3 } else { places + row - 3 * places };
    let mut counted = reduced.clone();
    for (row, mut column) in counted.column_iter_mut().enumerate() {
        if !trusted(sample_of(row)) {
            column.fill(0.0);
        }
    }
    let mut information = &counted * counted.transpose();
    for index in 0..information.nrows() {
        information[(index, index)] += solve.basis.prior_weight;
    }
    let samples = places + problem.observations.lengths.len();
    let whitened = Cholesky::<f64, Dyn>::new(information)
        .and_then(|factor| factor.l().solve_lower_triangular(&reduced))
        .unwrap_or_else(|| DMatrix::zeros(reduced.nrows(), row_count));
    let studentised: Vec<f64> = (0..samples)
        .map(|sample| {
            let sign = if trusted(sample) { -1.0 } else { 1.0 };
            if sample < places {
                let block = whitened.columns(3 * sample, 3);
                let leverage = Matrix3::from_fn(|i, j| block.column(i).dot(&block.column(j)));
                let residual = Vector3::from_column_slice(&rows.residuals[3 * sample..3 * sample + 3]);
                studentised_norm(&(Matrix3::identity() + leverage * sign), &residual)
            } else {
                let row = 3 * places + sample - places;
                let leverage = whitened.column(row).norm_squared();
                rows.residuals[row].abs() / (1.0 + sign * leverage).max(FULL_LEVERAGE).sqrt()
            }
        })
        .collect();
    let scale = |range: std::ops::Range<usize>, median: f64| {
        let accepted = range.filter(|sample| trusted(*sample)).map(|sample| studentised[sample]).collect();
        robust_scale(accepted, median).unwrap_or(floor).max(floor)
    };
    let (of_places, of_lengths) = (scale(0..places, MEDIAN_CHI_3), scale(places..samples, MEDIAN_CHI_1));
    let ratios = studentised
        .into_iter()
        .enumerate()
        .map(|(sample, value)| value / if sample < places { of_places } else { of_lengths })
        .collect();
    Judgement { ratios, scatter: of_places }
}

/// `√(eᵀ V⁻¹ e)`, with the eigenvalues of V not taken below [`FULL_LEVERAGE`].
fn studentised_norm(variance: &Matrix3<f64>, residual: &Vector3<f64>) -> f64 {
    if let Some(factor) = variance.cholesky()
        && factor.l_dirty().diagonal().min() > FULL_LEVERAGE.sqrt()
    {
        return residual.dot(&factor.solve(residual)).max(0.0).sqrt();
    }
    let spread = SymmetricEigen::new(*variance);
    let along = spread.eigenvectors.transpose() * residual;
    along.component_div(&spread.eigenvalues.map(|value| value.max(FULL_LEVERAGE).sqrt())).norm()
}

/// More than this many robust standard deviations is what Gaussian noise of so many samples shows in one set of a hundred (chi
/// distribution, 3 degrees of freedom): the data deserve a search for outliers.
fn suspect_at(samples: usize) -> f64 {
    (4.4 + 0.5 * (samples as f64 / 50.0).log10()).clamp(4.0, REJECT_AT)
}

/// Leaves out, for a start, what the nominal arm already shows to be impossible: a mistyped joint puts a point metres off, and one
/// such point can lead a least-squares fit astray for good. Trust 1 or 0 per place, from a robust registration of the nominal
/// predictions; the deviations of a real arm stay far below the limit, and later rounds take back the samples that fit.
pub(crate) fn gross_trust(problem: &Problem<'_>, predicted: &[Point3<f64>]) -> Vec<f64> {
    let all = Weights::uniform(problem, MILLIMETRE);
    let places = problem.observations.points.len();
    let spread = |residuals: &[Vector3<f64>]| {
        robust_scale(residuals.iter().take(places).map(Vector3::norm).collect(), MEDIAN_CHI_3).unwrap_or(0.0)
    };
    let mut residuals = point_residuals(problem, predicted, &all).of_places;
    let sigma = spread(&residuals);
    if residuals.iter().take(places).all(|residual| residual.norm() <= GROSS / 2.0 * sigma) {
        return all.trust;
    }
    let mut convexity = f64::INFINITY;
    for _ in 0..GROSS_STEPS {
        let scale = (REJECT_AT * spread(&residuals) / 2.0).powi(2).max(f64::MIN_POSITIVE);
        let largest = residuals.iter().map(Vector3::norm_squared).fold(0.0, f64::max);
        convexity = (convexity / GRADUATION).min(2.0 * largest / scale).max(1.0);
        let mut weights = all.clone();
        for (trust, residual) in weights.trust.iter_mut().zip(&residuals).take(places) {
            *trust = geman_mcclure(residual.norm_squared(), convexity * scale);
        }
        residuals = point_residuals(problem, predicted, &weights).of_places;
        if convexity <= 1.0 {
            break;
        }
    }
    let limit = GROSS * spread(&residuals);
    let mut trust = all.trust;
    for (trust, residual) in trust.iter_mut().zip(&residuals).take(places) {
        if residual.norm() > limit {
            *trust = 0.0;
        }
    }
    trust
}

/// Weight of a square residual with the Geman–McClure loss of squared width `width`.
fn geman_mcclure(square: f64, width: f64) -> f64 {
    (width / (square + width)).powi(2)
}

/// Decides which samples to trust, beginning with a fit made with the trust of `solve`. Trust is 1 or 0.
pub(crate) fn find_outliers(solve: &Solve<'_, '_>, first: &Linearised, floor: f64) -> Weights {
    let problem = solve.problem;
    let places = judged_places(problem);
    let start = solve.weights.clone();
    let judged = judge(solve, first, &start, floor);
    let suspect = suspect_at(judged.ratios.len());
    let settled = judged.ratios.iter().enumerate().all(|(sample, ratio)| {
        if start.of_sample(sample, places) > 0.0 { *ratio <= suspect } else { *ratio > REJECT_AT }
    });
    // One sample can also bend parameters so far that everything fits: they then leave what is expected of them.
    let ran_away = solve.basis.prior_weight > 0.0 && first.z.amax() > RAN_AWAY;
    if settled && !ran_away {
        return start;
    }
    // Several outliers, or one with all the say about some parameter, can bend a fit so that it accepts them. So the decision
    // is made from three starts that go wrong in different ways, and the cheapest explanation counts.
    let nominal = suspects_of_nominal(solve, floor);
    let searched = graduated_search(solve, first);
    let candidates = [
        peel(solve, first.clone(), start, floor, false),
        peel(solve, nominal.0, nominal.1, floor, true),
        peel(solve, searched.0, searched.1, floor, false),
    ];
    let scatter = candidates.iter().map(|candidate| candidate.scatter).fold(floor, f64::max);
    let all = places + problem.observations.lengths.len();
    let price = |candidate: &Candidate| {
        let rejected = all - candidate.weights.accepted(places);
        candidate.cost + rejected as f64 * (REJECT_AT * scatter).powi(2)
    };
    let [first, others @ ..] = candidates;
    others.into_iter().fold(first, |best, other| if price(&other) < price(&best) { other } else { best }).weights
}

/// A decision with what it costs.
struct Candidate {
    weights: Weights,
    /// Square sum of the accepted residuals in units of σ, plus the prior's share.
    cost: f64,
    /// Robust scatter of the accepted places.
    scatter: f64,
}

/// The nominal arm without the samples that stand out from it, given what its parameters may deviate. Good samples among them come
/// back as soon as the arm is fitted to the rest.
fn suspects_of_nominal(solve: &Solve<'_, '_>, floor: f64) -> (Linearised, Weights) {
    let places = judged_places(solve.problem);
    let mut weights = solve.weights.clone();
    let at = solve.linearise(DVector::zeros(solve.basis.transform.ncols()));
    let mut nobody = weights.clone();
    nobody.trust.fill(0.0);
    nobody.length_trust.fill(0.0);
    // Registered with everyone, judged by what the prior alone allows.
    let judged = judge_with(solve, &at, &weights, &nobody, floor);
    let typical = robust_scale(judged.ratios.clone(), 1.0).unwrap_or(1.0);
    for (sample, ratio) in judged.ratios.iter().enumerate() {
        if *ratio > SUSPECT_OF_NOMINAL * typical {
            weights.set_sample(sample, places, 0.0);
        }
    }
    (at, weights)
}

/// Lets samples change sides, the worst first, until the decision agrees with the fit that it leads to. With `refit` the
/// parameters of `from` are not yet those of a fit.
fn peel(solve: &Solve<'_, '_>, from: Linearised, start: Weights, floor: f64, refit: bool) -> Candidate {
    let problem = solve.problem;
    let places = judged_places(problem);
    let mut weights = start;
    let mut at = from;
    let mut seen: Vec<Weights> = Vec::new();
    let mut scatter = floor;
    let fit = |weights: &Weights, z| {
        Solve { weights, ..*solve }.run(z, SEARCH_STEPS, &mut |_, _| ControlFlow::Continue(())).0
    };
    for round in 0..ROUNDS {
        if round > 0 || refit {
            at = fit(&weights, at.z);
        }
        let judged = judge(solve, &at, &weights, floor);
        scatter = judged.scatter;
        let accepted = |sample: usize| weights.of_sample(sample, places) > 0.0;
        let accepted_ratios = judged.ratios.iter().enumerate().filter(|(sample, _)| accepted(*sample));
        let worst = accepted_ratios.map(|(_, ratio)| *ratio).fold(0.0, f64::max);
        let mut decided = weights.clone();
        for (sample, ratio) in judged.ratios.iter().enumerate() {
            let is_bad =
                if accepted(sample) { *ratio > REJECT_AT && *ratio >= WORST_FIRST * worst } else { *ratio > REJECT_AT };
            decided.set_sample(sample, places, if is_bad { 0.0 } else { 1.0 });
        }
        if decided == weights {
            break;
        }
        if seen.contains(&decided) || decided.accepted(places) < 4 {
            // Samples go back and forth: a sample that half of the time belongs is not rejected.
            if decided.accepted(places) > weights.accepted(places) {
                weights = decided;
            }
            break;
        }
        seen.push(std::mem::replace(&mut weights, decided));
    }
    let cost = fit(&weights, at.z).cost;
    Candidate { weights, cost, scatter }
}

/// Geman–McClure loss on the residuals, from convex to redescending, one step of the solver per degree; the samples without
/// trust in `solve` stay out.
fn graduated_search(solve: &Solve<'_, '_>, first: &Linearised) -> (Linearised, Weights) {
    let problem = solve.problem;
    let places = judged_places(problem);
    let squares = |at: &Linearised, weights: &Weights| -> Vec<f64> {
        let sigma = |place: usize| weights.sigma_of(problem, place);
        at.points.of_places.iter().take(places).enumerate().map(|(p, e)| e.norm_squared() / sigma(p).powi(2)).collect()
    };
    let spread = |squares: &[f64]| -> f64 {
        let trusted = squares.iter().zip(&solve.weights.trust).filter(|(_, trust)| **trust > 0.0);
        let scale = robust_scale(trusted.map(|(square, _)| square.sqrt()).collect(), MEDIAN_CHI_3).unwrap_or(1.0);
        (REJECT_AT * scale / 2.0).powi(2).max(f64::MIN_POSITIVE)
    };
    let mut at = first.clone();
    let mut now = squares(&at, solve.weights);
    let mut convexity = (2.0 * now.iter().copied().fold(0.0, f64::max) / spread(&now)).max(1.0);
    loop {
        let mut weights = solve.weights.clone();
        let width = convexity * spread(&now);
        for (trust, square) in weights.trust.iter_mut().zip(&now) {
            *trust *= geman_mcclure(*square, width);
        }
        let step = Solve { weights: &weights, ..*solve };
        let here = step.linearise(at.z.clone());
        at = step.step(&here).map_or(here, |(next, _)| next);
        now = squares(&at, solve.weights);
        if convexity <= 1.0 {
            break;
        }
        convexity = (convexity / GRADUATION).max(1.0);
    }
    let limit = 4.0 * spread(&now);
    let mut weights = solve.weights.clone();
    for (trust, square) in weights.trust.iter_mut().zip(&now) {
        if *square > limit {
            *trust = 0.0;
        }
    }
    (at, weights)
}
