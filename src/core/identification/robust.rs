//! Outliers: which samples do not belong to the others, and which of them to trust.
//!
//! A bumped SMR spoils one point and with it all M − 1 distances that end there, so trust is a property of a point (or of a
//! measured length), not of a pair. Clean data keep the full efficiency of least squares: the robust loss only finds the
//! outliers, which are then removed for real and the rest is fitted with full weights.
//!
//! Samples are judged by their *studentised* residual: the residual in units of what it should scatter by once the fit has
//! followed it, `√(eᵀ (I − h)⁻¹ e)` with the leverage h, and for a sample left out `√(eᵀ (I + h)⁻¹ e)`; of several readings of one
//! pose each is judged by a fit without that pose. A mistyped joint that
//! otherwise hardly moves has all the say about its own parameters: its plain residual is zero, its studentised one is not,
//! because the expected deviations disagree.

use std::ops::ControlFlow;

use nalgebra::{DMatrix, DVector, Matrix3, Point3, SymmetricEigen, Vector3};

use super::factor::Factor;
use super::linearise::{Trust, Weights, point_residuals};
use super::noise::{GroupMeans, Noise};
use super::problem::Problem;
use super::solver::{Linearised, Solve};
use super::systematic::{Unmodelled, unmodelled};
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
/// Samples are judged by no smaller scatter than this, in units of what the noise promises.
const SMALLEST_SCATTER: f64 = 1e-3;
/// Groups whose predictions are worked out in one product.
const GROUPS_AT_ONCE: usize = 128;
/// `1 − h` is not taken below this: beyond, a residual is rounding noise.
const FULL_LEVERAGE: f64 = 1e-9;

/// Studentised residual of every sample: places with a residual of their own first (points, seats of shared points), then lengths.
#[derive(Clone, Debug)]
pub(crate) struct Judgement {
    /// In units of the robust scatter of the accepted samples of its kind.
    pub(crate) ratios: Vec<f64>,
    /// That scatter for places, in units of what the noise promises.
    scatter: f64,
}

/// Standard deviation behind the median of some norms, with the median of the standard distribution.
fn robust_scale(mut norms: Vec<f64>, median_of_standard: f64) -> Option<f64> {
    let middle = norms.len() / 2;
    (!norms.is_empty()).then(|| {
        let (_, median, _) = norms.select_nth_unstable_by(middle, f64::total_cmp);
        *median / median_of_standard
    })
}

/// What the parameters are known from when samples are judged.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Known {
    /// From the trusted samples.
    FromSamples,
    /// From their expected deviations alone.
    FromPrior,
}

/// Judges every sample at a fit made with the trust of `solve`.
pub(crate) fn judge(solve: &Solve<'_, '_>, at: &Linearised) -> Judgement {
    judge_with(solve, at, Known::FromSamples)
}

fn judge_with(solve: &Solve<'_, '_>, at: &Linearised, known: Known) -> Judgement {
    let floor = smallest_scatter(solve, at);
    let problem = solve.problem;
    let trust = solve.trust;
    let places = trust.places.len();
    let samples = places + trust.lengths.len();
    let counts = |sample: usize| known == Known::FromPrior || trust.of_sample(sample) > 0.0;
    let predictions = Predictions::new(solve, at, known);
    let means = GroupMeans::new(problem, solve.groups, &at.noise, trust, &at.points.of_places);
    let mut studentised: Vec<f64> = (0..places)
        .map(|place| {
            let group = solve.groups.of(place);
            let weight = if known == Known::FromPrior { 0.0 } else { predictions.weights[group] };
            let variance = at.noise.pose + at.noise.of_reading(Noise::own_sigma(problem, place));
            let (own, mean) = (&at.points.of_places[place], &means.residual[group]);
            predicted_without(&predictions.covariances[group], weight, variance, own, mean)
        })
        .collect();
    studentised.extend((0..trust.lengths.len()).map(|length| {
        let variance = at.rows.length_variances[length];
        let leverage = predictions.of_lengths[length] / variance;
        let sign = if counts(places + length) && known == Known::FromSamples { -1.0 } else { 1.0 };
        let residual = at.rows.residuals[3 * places + length];
        residual.abs() / (variance * (1.0 + sign * leverage).max(FULL_LEVERAGE)).sqrt()
    }));
    let scale = |range: std::ops::Range<usize>, median: f64| {
        let accepted = range.filter(|sample| counts(*sample)).map(|sample| studentised[sample]).collect();
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

/// The smallest scatter, in units of what the noise promises, that samples are judged by: one within the stated σ is never an
/// outlier, however good the others are.
fn smallest_scatter(solve: &Solve<'_, '_>, at: &Linearised) -> f64 {
    let stated = Noise { shot: 0.0, confirmed: 1.0, ..at.noise };
    let variances =
        (0..solve.trust.places.len()).map(|place| stated.of_reading(Noise::own_sigma(solve.problem, place)));
    let mean = variances.sum::<f64>() / solve.trust.places.len().max(1) as f64;
    (mean / (mean + at.noise.shot + at.noise.pose).max(f64::MIN_POSITIVE)).sqrt().max(SMALLEST_SCATTER)
}

/// What the fit knows about the places.
struct Predictions {
    /// Covariance of the predicted position of each group (m²).
    covariances: Vec<Matrix3<f64>>,
    /// Weight of each group in the fit (1/m²).
    weights: Vec<f64>,
    /// Variance of each predicted length (m²).
    of_lengths: Vec<f64>,
}

impl Predictions {
    fn new(solve: &Solve<'_, '_>, at: &Linearised, known: Known) -> Self {
        let places = solve.trust.places.len();
        let n = at.rows.n;
        let mut weights = vec![0.0; solve.groups.len()];
        let mut first = vec![None; solve.groups.len()];
        for (place, &group) in solve.groups.of_places().iter().enumerate() {
            weights[group] += at.rows.weights[3 * place];
            first[group].get_or_insert(place);
        }
        let transform = &solve.basis.transform;
        let mut information = match known {
            Known::FromSamples => solve.basis.reduce(&at.rows.normal_equations().gram),
            Known::FromPrior => DMatrix::zeros(transform.ncols(), transform.ncols()),
        };
        for index in 0..information.nrows() {
            information[(index, index)] += solve.basis.prior_weight;
        }
        let factor = Factor::new(information);
        let whitened = |rows: &[f64]| {
            let reduced = transform.transpose() * DMatrix::from_column_slice(n, rows.len() / n.max(1), rows);
            factor
                .as_ref()
                .map_or_else(|| DMatrix::zeros(reduced.nrows(), reduced.ncols()), |factor| factor.whiten(&reduced))
        };
        let mut covariances = Vec::with_capacity(first.len());
        for groups in first.chunks(GROUPS_AT_ONCE) {
            let places = groups.iter().map(|place| place.unwrap_or(0));
            let rows: Vec<f64> =
                places.flat_map(|place| &at.rows.rows[3 * n * place..3 * n * (place + 1)]).copied().collect();
            let known = whitened(&rows);
            covariances.extend((0..groups.len()).map(|group| {
                let column = |axis: usize| known.column(3 * group + axis);
                if n == 0 { Matrix3::zeros() } else { Matrix3::from_fn(|i, j| column(i).dot(&column(j))) }
            }));
        }
        let lengths = whitened(&at.rows.rows[3 * n * places..]);
        let of_lengths = 0..solve.trust.lengths.len();
        let of_lengths = of_lengths.map(|length| if n == 0 { 0.0 } else { lengths.column(length).norm_squared() });
        Self { covariances, weights, of_lengths: of_lengths.collect() }
    }
}

/// Size of the residual `own` of a reading in standard deviations, as seen by a fit without its group. `covariance` is that of the
/// prediction with the group (m²), `weight` the group's share in it (1/m²), `mean` the group's residual (m) and `variance` that of a
/// reading (m²). For a single reading this is `√(eᵀ (I − h)⁻¹ e)` with the leverage h.
fn predicted_without(
    covariance: &Matrix3<f64>,
    weight: f64,
    variance: f64,
    own: &Vector3<f64>,
    mean: &Vector3<f64>,
) -> f64 {
    let spread = SymmetricEigen::new(*covariance);
    let own = spread.eigenvectors.transpose() * own;
    let mean = spread.eigenvectors.transpose() * mean;
    let square: f64 = (0..3)
        .map(|axis| {
            let known = spread.eigenvalues[axis].max(0.0);
            let left = (1.0 - weight * known).max(FULL_LEVERAGE);
            let residual = own[axis] + mean[axis] * (1.0 / left - 1.0);
            residual * residual / (variance + known / left).max(f64::MIN_POSITIVE)
        })
        .sum();
    square.sqrt()
}

/// More than this many robust standard deviations is what Gaussian noise of so many samples shows in one set of a hundred (chi
/// distribution, 3 degrees of freedom): the data deserve a search for outliers.
fn suspect_at(samples: usize) -> f64 {
    (4.4 + 0.5 * (samples as f64 / 50.0).log10()).clamp(4.0, REJECT_AT)
}

/// Leaves out, for a start, what the nominal arm already shows to be impossible: a mistyped joint puts a point metres off, and one
/// such point can lead a least-squares fit astray for good. Trust is 1 or 0, from a robust registration of the nominal
/// predictions; the deviations of a real arm stay far below the limit, and later rounds take back whatever fits.
pub(crate) fn gross_trust(problem: &Problem<'_>, predicted: &[Point3<f64>]) -> Trust {
    let mut trust = Trust::full(problem);
    let places = problem.observations.points.len();
    let spread = |residuals: &[Vector3<f64>]| {
        robust_scale(residuals.iter().take(places).map(Vector3::norm).collect(), MEDIAN_CHI_3).unwrap_or(0.0)
    };
    let residuals_with =
        |trust: &Trust| point_residuals(problem, predicted, &Weights::trusting(problem, trust, MILLIMETRE)).of_places;
    let mut residuals = residuals_with(&trust);
    let sigma = spread(&residuals);
    if residuals.iter().take(places).all(|residual| residual.norm() <= GROSS / 2.0 * sigma) {
        return trust;
    }
    let mut convexity = f64::INFINITY;
    for _ in 0..GROSS_STEPS {
        let scale = (REJECT_AT * spread(&residuals) / 2.0).powi(2).max(f64::MIN_POSITIVE);
        let largest = residuals.iter().map(Vector3::norm_squared).fold(0.0, f64::max);
        convexity = (convexity / GRADUATION).min(2.0 * largest / scale).max(1.0);
        let mut weighted = trust.clone();
        for (trust, residual) in weighted.places.iter_mut().zip(&residuals).take(places) {
            *trust = geman_mcclure(residual.norm_squared(), convexity * scale);
        }
        residuals = residuals_with(&weighted);
        if convexity <= 1.0 {
            break;
        }
    }
    let limit = GROSS * spread(&residuals);
    for (trust, residual) in trust.places.iter_mut().zip(&residuals).take(places) {
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

/// A decision about which samples to trust, 1 or 0, and what in it is the arm.
#[derive(Debug)]
pub(crate) struct Decision {
    pub(crate) trust: Trust,
    pub(crate) unmodelled: Vec<Unmodelled>,
}

impl Decision {
    /// Keeps the samples that `trust` leaves out, at the fit `at` that was made with it, where they are the arm.
    pub(crate) fn new(solve: &Solve<'_, '_>, mut trust: Trust, at: &Linearised) -> Self {
        let judged = judge(&Solve { trust: &trust, ..*solve }, at);
        let problem = solve.problem;
        let joints = problem.arm.chain.joints();
        let unmodelled = unmodelled(joints, &problem.observations.points, &trust, &judged.ratios);
        for place in unmodelled.iter().flat_map(Unmodelled::places) {
            trust.set_sample(*place, 1.0);
        }
        Self { trust, unmodelled }
    }
}

/// Decides which samples to trust, beginning with a fit made with the trust of `solve`.
pub(crate) fn find_outliers(solve: &Solve<'_, '_>, first: &Linearised) -> Decision {
    let start = solve.trust.clone();
    let judged = judge(solve, first);
    let suspect = suspect_at(judged.ratios.len());
    let settled = judged
        .ratios
        .iter()
        .enumerate()
        .all(|(sample, ratio)| if start.of_sample(sample) > 0.0 { *ratio <= suspect } else { *ratio > REJECT_AT });
    // One sample can also bend parameters so far that everything fits: they then leave what is expected of them.
    let ran_away = solve.basis.prior_weight > 0.0 && first.z.amax() > RAN_AWAY;
    if settled && !ran_away {
        return Decision::new(solve, start, first);
    }
    // Several outliers, or one with all the say about some parameter, can bend a fit so that it accepts them. So the decision
    // is made from three starts that go wrong in different ways, and the cheapest explanation counts.
    let nominal = suspects_of_nominal(solve, first.noise);
    let searched = graduated_search(solve, first);
    let candidates = [
        peel(solve, first.clone(), start, Begin::Fitted),
        peel(solve, nominal.0, nominal.1, Begin::Refit),
        peel(solve, searched.0, searched.1, Begin::Judged),
    ];
    let scatter = candidates.iter().map(|candidate| candidate.scatter).fold(SMALLEST_SCATTER, f64::max);
    let noise = candidates.iter().map(|candidate| candidate.at.noise).max_by(|a, b| a.pose.total_cmp(&b.pose));
    let noise = noise.unwrap_or(first.noise);
    let price = |candidate: &Candidate| {
        let (all, accepted) = candidate.trust.samples();
        let solve = Solve { trust: &candidate.trust, ..*solve };
        solve.linearise(candidate.at.z.clone(), noise).cost + (all - accepted) as f64 * (REJECT_AT * scatter).powi(2)
    };
    let priced = candidates.iter().map(|candidate| (price(candidate), candidate));
    let best = priced.min_by(|a, b| a.0.total_cmp(&b.0));
    match best {
        Some((_, candidate)) => Decision::new(solve, candidate.trust.clone(), &candidate.at),
        None => Decision { trust: solve.trust.clone(), unmodelled: Vec::new() },
    }
}

/// Lets samples change sides, beginning with a fit `at` that was made with the trust of `solve`.
pub(crate) fn settle(solve: &Solve<'_, '_>, at: Linearised) -> Candidate {
    peel(solve, at, solve.trust.clone(), Begin::Fitted)
}

/// A decision with the fit that it leads to.
pub(crate) struct Candidate {
    pub(crate) trust: Trust,
    pub(crate) at: Linearised,
    /// Robust scatter of the accepted places.
    scatter: f64,
}

/// The nominal arm without the samples that stand out from it, given what its parameters may deviate. Good samples among them come
/// back as soon as the arm is fitted to the rest.
fn suspects_of_nominal(solve: &Solve<'_, '_>, noise: Noise) -> (Linearised, Trust) {
    let mut trust = solve.trust.clone();
    let at = solve.linearise(DVector::zeros(solve.basis.transform.ncols()), noise);
    // Registered with all of them, judged by what the prior alone allows.
    let judged = judge_with(solve, &at, Known::FromPrior);
    let typical = robust_scale(judged.ratios.clone(), 1.0).unwrap_or(1.0);
    for (sample, ratio) in judged.ratios.iter().enumerate() {
        if *ratio > SUSPECT_OF_NOMINAL * typical {
            trust.set_sample(sample, 0.0);
        }
    }
    (at, trust)
}

/// What is known of the parameters where [`peel`] begins.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Begin {
    /// They are those of a fit with the trust that it begins with.
    Fitted,
    /// They are good enough to judge samples by.
    Judged,
    /// They are to be fitted first.
    Refit,
}

/// Lets samples change sides, the worst first, until the decision agrees with the fit that it leads to.
fn peel(solve: &Solve<'_, '_>, from: Linearised, start: Trust, begin: Begin) -> Candidate {
    let mut trust = start;
    let mut at = from;
    let mut seen: Vec<Trust> = Vec::new();
    let mut scatter = SMALLEST_SCATTER;
    let fit = |trust: &Trust, at: &Linearised| {
        let solve = Solve { trust, ..*solve };
        solve.run(at.z.clone(), at.noise, SEARCH_STEPS, &mut |_, _| ControlFlow::Continue(())).at
    };
    let mut is_fitted = begin == Begin::Fitted;
    for round in 0..ROUNDS {
        if !is_fitted && (round > 0 || begin == Begin::Refit) {
            at = fit(&trust, &at);
            is_fitted = true;
        }
        let judged = judge(&Solve { trust: &trust, ..*solve }, &at);
        scatter = judged.scatter;
        let accepted = |sample: usize| trust.of_sample(sample) > 0.0;
        let accepted_ratios = judged.ratios.iter().enumerate().filter(|(sample, _)| accepted(*sample));
        let worst = accepted_ratios.map(|(_, ratio)| *ratio).fold(0.0, f64::max);
        let mut decided = trust.clone();
        for (sample, ratio) in judged.ratios.iter().enumerate() {
            let is_bad =
                if accepted(sample) { *ratio > REJECT_AT && *ratio >= WORST_FIRST * worst } else { *ratio > REJECT_AT };
            decided.set_sample(sample, if is_bad { 0.0 } else { 1.0 });
        }
        if decided == trust {
            break;
        }
        let count = |trust: &Trust| trust.samples().1;
        if seen.contains(&decided) || count(&decided) < 4 {
            // Samples go back and forth: a sample that half of the time belongs is not rejected.
            if count(&decided) > count(&trust) {
                trust = decided;
                is_fitted = false;
            }
            break;
        }
        seen.push(std::mem::replace(&mut trust, decided));
        is_fitted = false;
    }
    let at = if is_fitted { at } else { fit(&trust, &at) };
    Candidate { trust, at, scatter }
}

/// Geman–McClure loss on the residuals, from convex to redescending, one step of the solver per degree; the samples without
/// trust in `solve` stay out.
fn graduated_search(solve: &Solve<'_, '_>, first: &Linearised) -> (Linearised, Trust) {
    let problem = solve.problem;
    let squares = |at: &Linearised| -> Vec<f64> {
        let variance = |place: usize| first.noise.pose + first.noise.of_reading(Noise::own_sigma(problem, place));
        let residuals = at.points.of_places.iter().take(solve.trust.places.len()).enumerate();
        residuals.map(|(place, residual)| residual.norm_squared() / variance(place)).collect()
    };
    let spread = |squares: &[f64]| -> f64 {
        let trusted = squares.iter().zip(&solve.trust.places).filter(|(_, trust)| **trust > 0.0);
        let scale = robust_scale(trusted.map(|(square, _)| square.sqrt()).collect(), MEDIAN_CHI_3).unwrap_or(1.0);
        (REJECT_AT * scale / 2.0).powi(2).max(f64::MIN_POSITIVE)
    };
    let mut at = first.clone();
    let mut now = squares(&at);
    let mut convexity = (2.0 * now.iter().copied().fold(0.0, f64::max) / spread(&now)).max(1.0);
    loop {
        let mut weighted = solve.trust.clone();
        let width = convexity * spread(&now);
        for (trust, square) in weighted.places.iter_mut().zip(&now) {
            *trust *= geman_mcclure(*square, width);
        }
        let step = Solve { trust: &weighted, ..*solve };
        let here = step.linearise(at.z, first.noise);
        at = step.step(&here).unwrap_or(here);
        now = squares(&at);
        if convexity <= 1.0 {
            break;
        }
        convexity = (convexity / GRADUATION).max(1.0);
    }
    let limit = 4.0 * spread(&now);
    let mut trust = solve.trust.clone();
    for (trust, square) in trust.places.iter_mut().zip(&now) {
        if *square > limit {
            *trust = 0.0;
        }
    }
    let solve = Solve { trust: &trust, ..*solve };
    (solve.linearise(at.z, first.noise), trust)
}
