//! Which errors of the joints the data can tell: nested candidates with fixed priors, scored by leaving one pose out at a time.
//!
//! A group of terms is added only for a clear gain, because what a few poses seem to show may be worse elsewhere; scales are not
//! fitted, because that looks equal on poses of the same region and is worse in another. All candidates share one linearisation at
//! the geometric solution: they differ from it by a ten-thousandth of a radian, which is far below a micrometre to second order.

use std::ops::ControlFlow;

use nalgebra::{DMatrix, DVector, Matrix3, Matrix6, SMatrix, Vector3};

use super::factor::Factor;
use super::linearise::{Evaluation, Trust, Weights, judged_places, point_residuals, project};
use super::noise::{Estimation, GroupMeans, Groups, Noise, Scatter, place_weights};
use super::terms::Terms;
use super::{
    Identification, IdentificationError, Iteration, Problem, SampleIndex, Settings, identify_from, identify_while,
};
use crate::kinematics::{FreeParameter, ParameterId};

/// A group of terms must lower the score by this part of it.
const CLEAR_GAIN: f64 = 0.02;
/// Selection and rejection take turns until both stay, at most this often.
const TURNS: usize = 4;
/// Rounds of noise and solution per candidate, and the relative change of σ that ends them.
const NOISE_ROUNDS: usize = 20;
const NOISE_TOLERANCE: f64 = 1e-4;
/// Weights in this proportion at most may share a normal matrix: candidates are compared, not used.
const SAME_FACTOR: f64 = 1.02;
/// Rows that are multiplied at once.
const BLOCK: usize = 384;

/// A candidate with its score.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scored {
    /// Its terms.
    pub terms: Terms,
    /// Root mean square of the position errors at poses that were left out (m).
    pub score: f64,
    /// What is left of a coordinate with all poses (m).
    pub sigma: f64,
}

/// Which candidate was kept, and against what.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Selection {
    /// All that were tried, from simple to rich.
    pub candidates: Vec<Scored>,
    /// Index of the one that was kept; `None` if no pose can be left out, so that the geometry stays alone.
    pub kept: Option<usize>,
}

impl Selection {
    /// The kept candidate.
    pub fn kept(&self) -> Option<&Scored> {
        self.candidates.get(self.kept?)
    }

    /// The kept terms.
    pub fn terms(&self) -> Terms {
        self.kept().map_or_else(Terms::default, |kept| kept.terms)
    }
}

/// What an identification is doing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Stage {
    /// The solver has taken a step.
    Step(Iteration),
    /// A candidate is being scored.
    Candidate {
        /// Its number, from 1.
        number: usize,
        /// How many there are.
        of: usize,
        /// Its terms.
        terms: Terms,
    },
}

/// An identified arm with the terms that its data can tell.
#[derive(Clone, Debug)]
pub struct WithTerms {
    /// The arm with all kept terms.
    pub found: Identification,
    /// The arm identified as geometry alone, for everything that has no other terms.
    pub geometric: Identification,
    /// What was kept, and against what.
    pub selection: Selection,
}

/// Identifies the parameters of `problem` (geometry and targets) with those terms among `candidates` that the data can tell.
/// `progress` may ask to stop at any stage.
///
/// # Errors
/// As [`identify_while`].
pub fn identify_with_terms(
    problem: &Problem<'_>,
    settings: &Settings,
    candidates: &[Vec<Terms>],
    progress: &mut dyn FnMut(Stage) -> ControlFlow<()>,
) -> Result<WithTerms, IdentificationError> {
    let geometric = identify_while(problem, settings, &mut |step| progress(Stage::Step(*step)))?;
    let mut found = geometric.clone();
    let mut selection = Selection::default();
    for _ in 0..TURNS {
        let rejected = rejected(&found);
        let (selected, start) = select(problem, settings, candidates, &found, progress)?;
        let terms = selected.terms();
        selection = selected;
        let Some(Start { deviations, noise }) = start else { break };
        let parameters = with_terms(problem, &terms);
        let trust = accepted(problem, &found);
        let start = super::Start { found: &geometric, deviations, noise, trust };
        let complete = Problem { parameters: &parameters, ..*problem };
        found = identify_from(&complete, settings, start, &mut |step| progress(Stage::Step(*step)))?;
        if self::rejected(&found) == rejected {
            break;
        }
    }
    Ok(WithTerms { found, geometric, selection })
}

fn rejected(found: &Identification) -> Vec<SampleIndex> {
    found.rejected.iter().map(|rejected| rejected.sample).collect()
}

/// Trust in the samples that `found` accepted.
fn accepted(problem: &Problem<'_>, found: &Identification) -> Trust {
    let mut trust = Trust::full(problem);
    let places = judged_places(problem);
    for rejected in &found.rejected {
        match rejected.sample {
            SampleIndex::Place(place) => trust.set_sample(place, 0.0),
            SampleIndex::Length(length) => trust.set_sample(places + length, 0.0),
        }
    }
    trust
}

/// The parameters of a problem, then those of the terms.
fn with_terms(problem: &Problem<'_>, terms: &Terms) -> Vec<FreeParameter> {
    problem.parameters.iter().copied().chain(terms.parameters(&problem.arm.chain)).collect()
}

/// Where the fit of a candidate begins: its linear solution.
struct Start {
    /// In expected deviations.
    deviations: DVector<f64>,
    noise: Noise,
}

/// Scores the candidates on the accepted samples of `found` and keeps the richest one that its gain justifies.
fn select(
    problem: &Problem<'_>,
    settings: &Settings,
    candidates: &[Vec<Terms>],
    found: &Identification,
    progress: &mut dyn FnMut(Stage) -> ControlFlow<()>,
) -> Result<(Selection, Option<Start>), IdentificationError> {
    let parameters = with_terms(problem, &Terms::all(1.0));
    let complete = Problem { parameters: &parameters, ..*problem };
    let shared = Shared::new(&complete, settings, found);
    let mut selection = Selection::default();
    let mut starts: Vec<Start> = Vec::new();
    let mut known: Vec<Terms> = Vec::new();
    let of = candidates.iter().map(Vec::len).sum();
    let mut number = 0;
    for group in candidates {
        let mut best: Option<usize> = None;
        for terms in group {
            number += 1;
            // What this arm cannot have leaves a candidate that was tried.
            let terms = &terms.on(&problem.arm.chain);
            if known.contains(terms) {
                continue;
            }
            known.push(*terms);
            if progress(Stage::Candidate { number, of, terms: *terms }).is_break() {
                return Err(IdentificationError::Cancelled);
            }
            let Some((scored, start)) = shared.score(terms) else { continue };
            let index = selection.candidates.len();
            selection.candidates.push(scored);
            starts.push(start);
            if best.is_none_or(|best| scored.score < selection.candidates[best].score) {
                best = Some(index);
            }
        }
        let score = |index: usize| selection.candidates[index].score;
        if let Some(best) = best
            && selection.kept.is_none_or(|kept| score(best) < (1.0 - CLEAR_GAIN) * score(kept))
        {
            selection.kept = Some(best);
        }
    }
    let start = selection.kept.map(|kept| starts.swap_remove(kept));
    Ok((selection, start))
}

/// The linear problem with the columns of all candidates; one block of rows per trusted group, weighted as its mean.
struct Shared<'a, 'p> {
    problem: &'a Problem<'p>,
    groups: Groups,
    trust: Trust,
    noise: Noise,
    /// Groups with a trusted reading, in the order of the columns below.
    used: Vec<usize>,
    /// Scaled by the expected deviations: one column per row of the Jacobian, free of frames.
    rows: DMatrix<f64>,
    /// Measured − predicted by the nominal arm, in the linear model (m): the priors are about it.
    residuals: DVector<f64>,
    /// Places of the groups (for the leverage of the frames).
    frames: Vec<Frame>,
    /// `rows · diag(weights) · rowsᵀ` for the weights at the shared estimate.
    gram: DMatrix<f64>,
    weights: DVector<f64>,
}

/// What the frame of a group does to its position.
#[derive(Clone, Copy, Debug)]
enum Frame {
    /// Index of the station; derivative of the position by its shift and turn about the centroid.
    Station(usize, SMatrix<f64, 3, 6>),
    /// Index of the shared point.
    Shared(usize),
}

impl<'a, 'p> Shared<'a, 'p> {
    fn new(problem: &'a Problem<'p>, settings: &Settings, found: &Identification) -> Self {
        let groups = Groups::new(problem);
        let trust = accepted(problem, found);
        let places = judged_places(problem);
        let stated = settings.sigma.map_or(0.0, |(sigma, _)| sigma * sigma);
        let noise = Noise {
            stated,
            shot: found.sigma.shots.powi(2),
            pose: found.sigma.poses.powi(2),
            confirmed: found.sigma.confirmed,
        };
        let weights = Weights::new(problem, &groups, &noise, &trust);
        let evaluation = Evaluation::new(problem, &found.arm);
        let predicted = evaluation.points.clone();
        let points = point_residuals(problem, &predicted, &weights);
        let projected = project(problem, evaluation, &points, &weights);
        let n = problem.parameters.len();
        let expected: Vec<f64> = problem.parameters.iter().map(|parameter| parameter.expected).collect();
        let deviation = |id: ParameterId| found.estimates.iter().find(|estimate| estimate.id == id);
        let deviations = problem.parameters.iter().map(|p| deviation(p.id).map_or(0.0, |e| e.deviation) / p.expected);
        let deviations = DVector::from_iterator(n, deviations);
        let means = GroupMeans::new(problem, &groups, &noise, &trust, &points.of_places);
        let mut first = vec![None; groups.len()];
        let mut sum = vec![0.0; groups.len()];
        for (place, &group) in groups.of_places().iter().enumerate() {
            if trust.places[place] > 0.0 {
                first[group].get_or_insert(place);
                sum[group] += weights.of_place(place);
            }
        }
        let used: Vec<usize> = (0..groups.len()).filter(|&group| first[group].is_some()).collect();
        let lengths: Vec<usize> = (0..trust.lengths.len()).collect();
        let count = 3 * used.len() + lengths.len();
        let mut rows = DMatrix::zeros(n, count);
        let mut residuals = DVector::zeros(count);
        let mut row_weights = DVector::zeros(count);
        let mut frames = Vec::with_capacity(used.len());
        let samples = &problem.observations.points;
        let mut source = Vec::with_capacity(count);
        for (position, &group) in used.iter().enumerate() {
            let place = first[group].unwrap_or(0);
            for axis in 0..3 {
                source.push(3 * place + axis);
                residuals[3 * position + axis] = means.residual[group][axis];
                row_weights[3 * position + axis] = sum[group];
            }
            frames.push(match samples.get(place) {
                Some(sample) => {
                    let arm = predicted[place] - points.centroid(sample.station);
                    let mut by_frame = SMatrix::<f64, 3, 6>::zeros();
                    by_frame.fixed_columns_mut::<3>(0).copy_from(&Matrix3::identity());
                    by_frame.fixed_columns_mut::<3>(3).copy_from(&-arm.cross_matrix());
                    Frame::Station(sample.station, by_frame)
                }
                None => Frame::Shared(groups.owner(group)),
            });
        }
        for length in lengths {
            let row = 3 * places + length;
            let column = source.len();
            source.push(row);
            residuals[column] = projected.residuals[row];
            row_weights[column] = projected.weights[row];
        }
        for (column, row) in source.into_iter().enumerate() {
            let values = projected.rows[n * row..n * (row + 1)].iter().zip(&expected);
            for (target, (value, expected)) in rows.column_mut(column).iter_mut().zip(values) {
                *target = value * expected;
            }
        }
        drop(projected);
        residuals += rows.tr_mul(&deviations);
        let gram = weighted_gram(&rows, &row_weights);
        Self { problem, groups, trust, noise, used, rows, residuals, frames, gram, weights: row_weights }
    }

    fn scatter(&self, residuals: &DVector<f64>, noise: &Noise) -> Scatter {
        let mut of_groups = vec![Vector3::zeros(); self.groups.len()];
        for (position, &group) in self.used.iter().enumerate() {
            of_groups[group] = residuals.fixed_rows::<3>(3 * position).into_owned();
        }
        let of_places: Vec<Vector3<f64>> = self.groups.of_places().iter().map(|&group| of_groups[group]).collect();
        let lengths = &residuals.as_slice()[3 * self.used.len()..];
        Scatter::new(self.problem, &self.groups, noise, &self.trust, &of_places, lengths)
    }

    /// Weights of the rows for another noise.
    fn weights_of(&self, noise: &Noise) -> DVector<f64> {
        let of_places = place_weights(self.problem, &self.groups, noise, &self.trust);
        let mut of_groups = vec![0.0; self.groups.len()];
        for (weight, &group) in of_places.iter().zip(self.groups.of_places()) {
            of_groups[group] += weight;
        }
        let mut weights = self.weights.clone();
        for (position, &group) in self.used.iter().enumerate() {
            weights.rows_mut(3 * position, 3).fill(of_groups[group]);
        }
        weights
    }

    /// Leave-one-pose-out score of a candidate; `None` where a pose left out cannot be predicted.
    fn score(&self, terms: &Terms) -> Option<(Scored, Start)> {
        if self.used.is_empty() {
            return None;
        }
        let scales: Vec<(usize, f64)> = self
            .problem
            .parameters
            .iter()
            .enumerate()
            .map(|(index, parameter)| match parameter.id {
                ParameterId::Joint { term, .. } => (index, terms.scale(term)),
                ParameterId::Link { .. } | ParameterId::Target { .. } => (index, 1.0),
            })
            .filter(|(_, scale)| *scale > 0.0)
            .collect();
        let few_rows = self.rows.ncols() < scales.len();
        let columns = few_rows.then(|| self.columns(&scales));
        let kernel = columns.as_ref().map(|columns| columns.transpose() * columns);
        let mut noise = self.noise;
        let mut weights = self.weights.clone();
        let mut gram = std::borrow::Cow::Borrowed(&self.gram);
        let mut gram_weights = self.weights.clone();
        let mut result = None;
        for _ in 0..NOISE_ROUNDS {
            let fit = if let (Some(columns), Some(kernel)) = (&columns, &kernel) {
                Fit::FewRows(FewRows::new(columns, kernel, &self.residuals, &weights)?)
            } else {
                let factor = common_factor(&gram_weights, &weights).unwrap_or_else(|| {
                    gram = std::borrow::Cow::Owned(weighted_gram(&self.rows, &weights));
                    gram_weights.clone_from(&weights);
                    1.0
                });
                Fit::ManyRows(ManyRows::new(self, &gram, factor, &scales, &weights)?)
            };
            let scatter = self.scatter(&fit.solution().residuals, &noise);
            let now = scatter.noise(&noise, fit.determined(), Estimation::Efficient);
            let sigma = scatter.of_reading(&now);
            let change = sigma / scatter.of_reading(&noise) - 1.0;
            noise = now;
            result = Some((fit, weights.clone(), sigma));
            if change.abs() <= NOISE_TOLERANCE {
                break;
            }
            weights = self.weights_of(&noise);
        }
        let (fit, weights, sigma) = result?;
        let score = self.leave_one_out(&fit, &scales, &weights)?;
        Some((Scored { terms: *terms, score, sigma }, Start { deviations: fit.into_deviations(), noise }))
    }

    /// Columns of a candidate: parameters × rows.
    fn columns(&self, scales: &[(usize, f64)]) -> DMatrix<f64> {
        DMatrix::from_fn(scales.len(), self.rows.ncols(), |i, j| {
            let (index, scale) = scales[i];
            self.rows[(index, j)] * scale
        })
    }

    fn leave_one_out(&self, fit: &Fit, scales: &[(usize, f64)], weights: &DVector<f64>) -> Option<f64> {
        let residuals = &fit.solution().residuals;
        let frames = FrameLeverage::new(&self.frames, weights);
        let mut poses: std::collections::BTreeMap<usize, Vec<usize>> = std::collections::BTreeMap::new();
        for (position, &group) in self.used.iter().enumerate() {
            poses.entry(self.groups.pose(group)).or_default().push(position);
        }
        let poses: Vec<Vec<usize>> = poses.into_values().collect();
        let mut sum = 0.0;
        for chunk in poses.chunks(BLOCK / 3) {
            let members: Vec<usize> = chunk.iter().flatten().copied().collect();
            let hat = fit.hat(self, scales, weights, &members);
            let mut offset = 0;
            for pose in chunk {
                let size = 3 * pose.len();
                let block = DMatrix::from_fn(size, size, |i, j| {
                    let (a, b) = (pose[i / 3], pose[j / 3]);
                    let own = if i == j { 1.0 } else { 0.0 };
                    own - hat.of(offset + i, offset + j) - frames.between(a, b, weights)[(i % 3, j % 3)]
                });
                let whitened =
                    DVector::from_fn(size, |i, _| residuals[3 * pose[i / 3] + i % 3] * weights[3 * pose[i / 3]].sqrt());
                let left_out = block.lu().solve(&whitened)?;
                for (i, value) in left_out.iter().enumerate() {
                    sum += value * value / weights[3 * pose[i / 3]];
                }
                offset += size;
            }
        }
        let score = (sum / self.used.len().max(1) as f64).sqrt();
        score.is_finite().then_some(score)
    }
}

/// The factor by which `weights` exceed `others`; `None` if it is not nearly the same for all.
fn common_factor(others: &DVector<f64>, weights: &DVector<f64>) -> Option<f64> {
    let weighed = weights.iter().zip(others.iter()).filter(|(_, other)| **other > 0.0);
    let (mut low, mut high) = (f64::INFINITY, 0.0_f64);
    for (weight, other) in weighed {
        let factor = weight / other;
        (low, high) = (low.min(factor), high.max(factor));
    }
    (high <= low * SAME_FACTOR).then(|| (low * high).sqrt())
}

/// `rows · diag(weights) · rowsᵀ`, in blocks.
fn weighted_gram(rows: &DMatrix<f64>, weights: &DVector<f64>) -> DMatrix<f64> {
    let n = rows.nrows();
    let mut gram = DMatrix::zeros(n, n);
    let mut start = 0;
    while start < rows.ncols() {
        let count = BLOCK.min(rows.ncols() - start);
        let mut block = rows.columns(start, count).into_owned();
        for (index, mut column) in block.column_iter_mut().enumerate() {
            column *= weights[start + index].sqrt();
        }
        gram.gemm(1.0, &block, &block.transpose(), 1.0);
        start += count;
    }
    gram
}

/// What a linear fit found.
struct LinearSolution {
    /// In expected deviations.
    deviations: DVector<f64>,
    /// Measured − predicted (m).
    residuals: DVector<f64>,
}

/// A linear fit of one candidate.
enum Fit {
    /// By the normal matrix of the parameters.
    ManyRows(ManyRows),
    /// By the covariance of the rows, where they are fewer.
    FewRows(FewRows),
}

/// Hat matrix of some rows: as products of columns, or a matrix with the rows that are meant.
enum Hat {
    Columns(DMatrix<f64>),
    Rows(DMatrix<f64>, Vec<usize>),
}

impl Hat {
    fn of(&self, i: usize, j: usize) -> f64 {
        match self {
            Self::Columns(columns) => columns.column(i).dot(&columns.column(j)),
            Self::Rows(hat, rows) => hat[(rows[i], rows[j])],
        }
    }
}

impl Fit {
    const fn solution(&self) -> &LinearSolution {
        match self {
            Self::FewRows(fit) => &fit.solution,
            Self::ManyRows(fit) => &fit.solution,
        }
    }

    fn into_deviations(self) -> DVector<f64> {
        match self {
            Self::FewRows(fit) => fit.solution.deviations,
            Self::ManyRows(fit) => fit.solution.deviations,
        }
    }

    /// How many values the data determine of the parameters.
    fn determined(&self) -> f64 {
        match self {
            Self::FewRows(fit) => fit.inverse.nrows() as f64 - fit.inverse.trace(),
            Self::ManyRows(fit) => fit.factor.size() as f64 - fit.factor.inverse_trace(),
        }
    }

    /// Hat matrix among the rows of the groups at `positions`.
    fn hat(
        &self,
        shared: &Shared<'_, '_>,
        scales: &[(usize, f64)],
        weights: &DVector<f64>,
        positions: &[usize],
    ) -> Hat {
        let rows = positions.iter().flat_map(|&position| 3 * position..3 * position + 3);
        match self {
            Self::FewRows(fit) => {
                Hat::Rows(DMatrix::identity(fit.inverse.nrows(), fit.inverse.ncols()) - &fit.inverse, rows.collect())
            }
            Self::ManyRows(fit) => {
                let rows: Vec<usize> = rows.collect();
                let columns = DMatrix::from_fn(scales.len(), rows.len(), |i, j| {
                    let (index, scale) = scales[i];
                    shared.rows[(index, rows[j])] * scale * weights[rows[j]].sqrt()
                });
                Hat::Columns(fit.factor.whiten(&columns))
            }
        }
    }
}

struct ManyRows {
    factor: Factor,
    solution: LinearSolution,
}

impl ManyRows {
    fn new(
        shared: &Shared<'_, '_>,
        gram: &DMatrix<f64>,
        factor: f64,
        scales: &[(usize, f64)],
        weights: &DVector<f64>,
    ) -> Option<Self> {
        let p = scales.len();
        let mut hessian =
            DMatrix::from_fn(p, p, |i, j| gram[(scales[i].0, scales[j].0)] * factor * scales[i].1 * scales[j].1);
        for index in 0..p {
            hessian[(index, index)] += 1.0;
        }
        let all = &shared.rows * weights.component_mul(&shared.residuals);
        let gradient = DVector::from_fn(p, |i, _| all[scales[i].0] * scales[i].1);
        let factor = Factor::new(hessian)?;
        let deviations = factor.solve(&gradient);
        let mut change = DVector::zeros(shared.rows.nrows());
        for ((index, scale), deviation) in scales.iter().zip(deviations.iter()) {
            change[*index] = scale * deviation;
        }
        let residuals = &shared.residuals - shared.rows.tr_mul(&change);
        Some(Self { factor, solution: LinearSolution { deviations, residuals } })
    }
}

struct FewRows {
    /// `(I + B Bᵀ)⁻¹` of the weighted rows B.
    inverse: DMatrix<f64>,
    solution: LinearSolution,
}

impl FewRows {
    /// `kernel` is `columnsᵀ columns`, of the rows before they are weighted.
    fn new(
        columns: &DMatrix<f64>,
        kernel: &DMatrix<f64>,
        residuals: &DVector<f64>,
        weights: &DVector<f64>,
    ) -> Option<Self> {
        let roots = weights.map(f64::sqrt);
        let mut kernel = kernel.component_mul(&(&roots * roots.transpose()));
        for index in 0..kernel.nrows() {
            kernel[(index, index)] += 1.0;
        }
        let inverse = Factor::new(kernel)?.inverse();
        let whitened = &inverse * residuals.component_mul(&roots);
        let safe = |root: f64| if root > 0.0 { 1.0 / root } else { 0.0 };
        let deviations = columns * whitened.component_mul(&roots);
        let residuals = whitened.component_mul(&roots.map(safe));
        Some(Self { inverse, solution: LinearSolution { deviations, residuals } })
    }
}

/// What the frames, which are fitted along, take of the residuals.
struct FrameLeverage<'a> {
    frames: &'a [Frame],
    stations: Vec<Matrix6<f64>>,
    shared: Vec<f64>,
}

impl<'a> FrameLeverage<'a> {
    fn new(frames: &'a [Frame], weights: &DVector<f64>) -> Self {
        let mut stations: Vec<Matrix6<f64>> = Vec::new();
        let mut shared: Vec<f64> = Vec::new();
        for (position, frame) in frames.iter().enumerate() {
            let weight = weights[3 * position];
            match frame {
                Frame::Station(station, by_frame) => {
                    if stations.len() <= *station {
                        stations.resize(station + 1, Matrix6::zeros());
                    }
                    stations[*station] += by_frame.transpose() * by_frame * weight;
                }
                Frame::Shared(point) => {
                    if shared.len() <= *point {
                        shared.resize(point + 1, 0.0);
                    }
                    shared[*point] += weight;
                }
            }
        }
        let inverse =
            |information: Matrix6<f64>| information.pseudo_inverse(1e-12 * information.amax()).unwrap_or_default();
        Self { frames, stations: stations.into_iter().map(inverse).collect(), shared }
    }

    fn between(&self, a: usize, b: usize, weights: &DVector<f64>) -> Matrix3<f64> {
        let root = (weights[3 * a] * weights[3 * b]).sqrt();
        match (&self.frames[a], &self.frames[b]) {
            (Frame::Station(first, of_a), Frame::Station(second, of_b)) if first == second => {
                of_a * self.stations[*first] * of_b.transpose() * root
            }
            (Frame::Shared(first), Frame::Shared(second)) if first == second && self.shared[*first] > 0.0 => {
                Matrix3::identity() * (root / self.shared[*first])
            }
            _ => Matrix3::zeros(),
        }
    }
}
