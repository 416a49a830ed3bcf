//! What the data can tell: rank by the gap in the singular values, the directions they are blind to in words, and the
//! condition number of the identification matrix A.
//!
//! The singular values are those of the position rows with the rigid motion projected out, every column scaled by the expected
//! deviation (`S`). They vanish exactly where those of the paper's pair rows `A·S` do, at a cost that is linear in the points;
//! the condition number is then taken from the pair rows themselves.

use nalgebra::{DMatrix, SymmetricEigen};

use super::linearise::{Evaluation, Weights, point_residuals, project};
use super::pairs::{PairPoint, pair_sums};
use super::problem::Problem;
use crate::kinematics::ParameterId;
use crate::text;

/// A ratio of neighbouring singular values below this is no gap: the rank would be a guess.
const CLEAR_GAP: f64 = 1e3;
/// Singular values below this fraction of the largest may be called zero.
const NEGLIGIBLE: f64 = 1e-6;
/// Arithmetic noise of the singular values, relative to the columns before the frames were taken out.
const NOISE_FLOOR: f64 = 1e-13;
/// The pair rows of at most this many points, evenly picked, enter the condition number.
const SCORED_POINTS: usize = 400;
/// A parameter with more than this share (squared) in a blind direction cannot be found on its own.
const BLIND_SHARE: f64 = 1e-6;

/// What the observations can tell at the nominal model.
#[derive(Clone, Debug)]
pub struct Observability {
    /// Singular values of the scaled rows, largest first: how far (m, root sum of squares) one expected deviation along each
    /// direction moves the points.
    pub singular_values: Vec<f64>,
    /// Number of independent combinations of parameters that the data determine; `None` where no gap decides it.
    pub rank: Option<usize>,
    /// Ratio of the last counted singular value to the first one called zero (or to the arithmetic noise at full rank).
    pub gap: f64,
    /// Condition number of `A·S` on the identifiable subspace, dimensionless; `None` without a rank.
    pub condition_number: Option<f64>,
    /// Condition number of A with parameters in rad and mm, as the paper has it.
    pub condition_number_raw: Option<f64>,
    /// Number of points whose pairs entered the condition numbers.
    pub scored_points: usize,
    /// Orthonormal basis of the blind directions in scaled parameters (deviation / expected), n × (n − rank).
    pub blind: DMatrix<f64>,
    /// Groups of parameters that blind directions tie together, in words.
    pub groups: Vec<BlindGroup>,
}

/// Parameters of which only some combinations can be found.
#[derive(Clone, Debug, PartialEq)]
pub struct BlindGroup {
    /// The parameters, in order of the problem.
    pub parameters: Vec<ParameterId>,
    /// Number of directions among them that the data are blind to.
    pub blind: usize,
    /// The finding in words.
    pub description: String,
}

impl Observability {
    /// Analyses `problem` at its nominal model.
    pub fn new(problem: &Problem<'_>) -> Self {
        let evaluation = Evaluation::new(problem, problem.arm);
        Self::of_evaluation(problem, evaluation)
    }

    fn of_evaluation(problem: &Problem<'_>, evaluation: Evaluation) -> Self {
        let weights = &Weights::uniform(problem, 1.0);
        let scale: Vec<f64> = problem.parameters.iter().map(|parameter| parameter.expected).collect();
        let (pair_gram, scored_points) = scored_pair_gram(problem, &evaluation);
        let residuals = point_residuals(problem, &evaluation.points, weights);
        let size = evaluation.largest_column(&scale);
        let rows = project(problem, evaluation, &residuals, weights);
        let n = scale.len();
        let svd = rows.triangular_factor(&scale).svd(false, true);
        let mut order: Vec<usize> = (0..n).collect();
        order.sort_by(|&a, &b| svd.singular_values[b].total_cmp(&svd.singular_values[a]));
        let singular_values: Vec<f64> = order.iter().map(|&index| svd.singular_values[index]).collect();
        let (rank, gap) = rank_by_gap(&singular_values, NOISE_FLOOR * size);
        let blind = match (rank, &svd.v_t) {
            (Some(rank), Some(v_t)) => {
                let columns: Vec<_> = order[rank..].iter().map(|&index| v_t.row(index).transpose()).collect();
                if columns.is_empty() { DMatrix::zeros(n, 0) } else { DMatrix::from_columns(&columns) }
            }
            _ => DMatrix::zeros(n, 0),
        };
        let raw: Vec<f64> = problem.parameters.iter().map(|parameter| parameter.id.unit().of_the_paper()).collect();
        // Without points there are no pair rows: the rows themselves are the identification matrix.
        let gram = pair_gram.unwrap_or_else(|| rows.normal_equations().gram);
        let condition = |scale: &[f64]| rank.and_then(|rank| condition_number(&gram, scale, rank));
        Self {
            condition_number: condition(&scale),
            condition_number_raw: condition(&raw),
            groups: blind_groups(problem, &blind, &scale),
            singular_values,
            rank,
            gap,
            scored_points,
            blind,
        }
    }

    /// Whether the parameter at `index` can be found on its own.
    pub fn is_identifiable(&self, index: usize) -> bool {
        self.rank.is_some() && (index >= self.blind.nrows() || self.blind.row(index).norm_squared() < BLIND_SHARE)
    }
}

/// The rank at the largest ratio of neighbouring singular values, if that ratio is a clear gap down to negligible values.
/// `noise` is the size of rounding errors: what the frames took away from the rows may have been much larger than the rest.
fn rank_by_gap(values: &[f64], noise: f64) -> (Option<usize>, f64) {
    let largest = values.first().copied().unwrap_or(0.0);
    if largest <= CLEAR_GAP * noise {
        return (Some(0), f64::INFINITY);
    }
    let floor = noise.max(NOISE_FLOOR * largest);
    let at = |index: usize| values.get(index).map_or(floor, |value| value.max(floor));
    let candidate = (1..=values.len())
        .filter(|&rank| at(rank) <= NEGLIGIBLE * largest)
        .map(|rank| (rank, at(rank - 1) / at(rank)))
        .max_by(|a, b| a.1.total_cmp(&b.1));
    match candidate {
        Some((rank, gap)) if gap >= CLEAR_GAP => (Some(rank), gap),
        Some((_, gap)) => (None, gap),
        None => (None, 1.0),
    }
}

/// Gram matrix of the unweighted pair rows of (at most [`SCORED_POINTS`]) points, and how many were used.
fn scored_pair_gram(problem: &Problem<'_>, evaluation: &Evaluation) -> (Option<DMatrix<f64>>, usize) {
    let n = evaluation.n;
    let samples = &problem.observations.points;
    if samples.len() < 2 {
        return (None, 0);
    }
    let used = samples.len().min(SCORED_POINTS);
    let picked: Vec<usize> = (0..used).map(|i| i * samples.len() / used).collect();
    let stations = picked.iter().map(|&index| samples[index].station + 1).max().unwrap_or(0);
    let mut gram = DMatrix::zeros(n, n);
    for station in 0..stations {
        let points: Vec<PairPoint<'_>> = picked
            .iter()
            .filter(|&&index| samples[index].station == station)
            .map(|&index| PairPoint {
                predicted: evaluation.points[index],
                measured: samples[index].point,
                rows: &evaluation.rows[3 * n * index..3 * n * (index + 1)],
                trust: 1.0,
                group: index,
                variance: 1.0,
            })
            .collect();
        gram += pair_sums(&points, n, 1.0, 0.0).gram;
    }
    (Some(gram), used)
}

/// Square root of the ratio of the largest to the `rank`-th eigenvalue of the scaled Gram matrix.
fn condition_number(gram: &DMatrix<f64>, scale: &[f64], rank: usize) -> Option<f64> {
    let scaled = DMatrix::from_fn(gram.nrows(), gram.ncols(), |i, j| gram[(i, j)] * scale[i] * scale[j]);
    let mut eigenvalues: Vec<f64> = scaled.symmetric_eigenvalues().iter().copied().collect();
    eigenvalues.sort_by(|a, b| b.total_cmp(a));
    let (largest, smallest) = (eigenvalues.first()?, eigenvalues.get(rank.checked_sub(1)?)?);
    (*smallest > 0.0).then(|| (largest / smallest).sqrt())
}

/// Ties parameters together that share a blind direction, and says what is left of them.
///
/// The projector on the blind directions does not depend on the basis, so its connected blocks are facts of the robot.
fn blind_groups(problem: &Problem<'_>, blind: &DMatrix<f64>, scale: &[f64]) -> Vec<BlindGroup> {
    let n = problem.parameters.len();
    let projector = blind * blind.transpose();
    let tied = |i: usize, j: usize| projector[(i, j)].powi(2) > BLIND_SHARE * projector[(i, i)] * projector[(j, j)];
    let mut group_of: Vec<Option<usize>> = vec![None; n];
    let mut groups: Vec<Vec<usize>> = Vec::new();
    for start in 0..n {
        if group_of[start].is_some() || projector[(start, start)] < BLIND_SHARE {
            continue;
        }
        let group = groups.len();
        let mut members = vec![start];
        group_of[start] = Some(group);
        let mut next = 0;
        while next < members.len() {
            let i = members[next];
            for j in 0..n {
                if group_of[j].is_none() && projector[(j, j)] >= BLIND_SHARE && tied(i, j) {
                    group_of[j] = Some(group);
                    members.push(j);
                }
            }
            next += 1;
        }
        members.sort_unstable();
        groups.push(members);
    }
    groups.into_iter().map(|members| describe_group(problem, &projector, scale, &members)).collect()
}

fn describe_group(problem: &Problem<'_>, projector: &DMatrix<f64>, scale: &[f64], members: &[usize]) -> BlindGroup {
    let parameters: Vec<ParameterId> = members.iter().map(|&index| problem.parameters[index].id).collect();
    let block = DMatrix::from_fn(members.len(), members.len(), |i, j| projector[(members[i], members[j])]);
    let eigen = SymmetricEigen::new(block);
    let blind = eigen.eigenvalues.iter().filter(|&&value| value > 0.5).count().max(1);
    let names: Vec<String> = parameters.iter().map(ToString::to_string).collect();
    let listed = text::listed(&names);
    let description = if let [only] = parameters.as_slice() {
        lone_parameter(*only, &names[0])
    } else if blind == 1 {
        let direction = eigen.eigenvectors.column(eigen.eigenvalues.imax());
        // Back from deviation / expected to the deviation itself, in edge units so that the factors read naturally.
        let factors: Vec<f64> = members
            .iter()
            .zip(direction.iter())
            .map(|(&index, value)| problem.parameters[index].id.unit().to_edge(value * scale[index]))
            .collect();
        one_direction(&parameters, &names, &listed, &factors)
    } else if members.len() == blind + 1 {
        // One combination is seen: the direction that is orthogonal to all blind ones, per edge unit of each parameter.
        let direction = eigen.eigenvectors.column(eigen.eigenvalues.imin());
        let weights: Vec<f64> = members
            .iter()
            .zip(direction.iter())
            .map(|(&index, value)| problem.parameters[index].id.unit().from_edge(value / scale[index]))
            .collect();
        one_combination(&names, &listed, &weights)
    } else {
        let left = members.len() - blind.min(members.len());
        format!("{listed}: only {left} independent combinations of these {} can be found", members.len())
    };
    BlindGroup { parameters, blind, description }
}

fn lone_parameter(id: ParameterId, name: &str) -> String {
    match id {
        ParameterId::Link { joint: 0, .. } => {
            format!("{name}: cannot be found from distances, it only moves the robot's base frame")
        }
        ParameterId::Link { .. } | ParameterId::Joint { .. } | ParameterId::Target { .. } => {
            format!("{name}: has no effect on these measurements")
        }
    }
}

fn one_direction(parameters: &[ParameterId], names: &[String], listed: &str, factors: &[f64]) -> String {
    let same_unit = parameters.windows(2).all(|pair| pair[0].unit() == pair[1].unit());
    let equal = |a: f64, b: f64| (a - b).abs() < 1e-6 * b.abs();
    if let ([first, second], true) = (factors, same_unit) {
        if equal(*first, -second) {
            return format!("{listed}: only their sum");
        }
        if equal(*first, *second) {
            return format!("{listed}: only their difference");
        }
    }
    let largest = signed_largest(factors);
    let terms: Vec<String> = factors
        .iter()
        .zip(names)
        .zip(parameters)
        .map(|((factor, name), id)| format!("{:+.3} {} of {name}", factor / largest, id.unit()))
        .collect();
    format!("{listed}: cannot be told apart along the change {}", terms.join(", "))
}

fn one_combination(names: &[String], listed: &str, weights: &[f64]) -> String {
    let largest = signed_largest(weights);
    if weights.iter().all(|weight| (weight / largest - 1.0).abs() < 1e-6) {
        return format!("{listed}: only their sum");
    }
    let terms: Vec<String> =
        weights.iter().zip(names).map(|(weight, name)| format!("{:+.3} {name}", weight / largest)).collect();
    format!("{listed}: only the combination {}", terms.join(" "))
}

/// The value of largest size, with its sign.
fn signed_largest(values: &[f64]) -> f64 {
    values.iter().fold(0.0_f64, |largest, value| if value.abs() > largest.abs() { *value } else { largest })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_rank_stands_at_a_clear_gap() {
        assert_eq!(rank_by_gap(&[3.0, 1.0, 1e-3, 1e-12, 0.0], 1e-14), (Some(3), 1e-3 / 1e-12));
        let (rank, gap) = rank_by_gap(&[1.0, 0.5, 0.2], 1e-13);
        assert_eq!(rank, Some(3), "gap {gap}");
        assert_eq!(rank_by_gap(&[0.0, 0.0], 0.0).0, Some(0));
        assert_eq!(rank_by_gap(&[6e-15, 0.0], 1e-13).0, Some(0), "rounding errors of a frame");
    }

    #[test]
    fn values_that_fade_out_evenly_have_no_rank() {
        let fading: Vec<f64> = (0..14).map(|index| 10_f64.powi(-index)).collect();
        let (rank, gap) = rank_by_gap(&fading, 1e-16);
        assert_eq!(rank, None);
        assert!((gap - 10.0).abs() < 1e-6);
    }
}
