//! The most probable arm given some samples, with its uncertainty: one Bayesian fit in which parameters have their expected
//! deviations as prior, every station has a free frame, and from some sample on the target may have moved.
//!
//! Unknowns are whitened: `z` = deviation / expected deviation, frames in (m) and (rad) with a prior so wide (1 m, 1 rad about the
//! registration) that it does not count. With the whitened rows J the information is `H = Jᵀ J + 1`.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn, Isometry3, Matrix3, Point3, Translation3, UnitQuaternion, Vector3};

use crate::geometry::register;
use crate::kinematics::{Arm, ForwardKinematics, FreeParameter, IdentificationJacobian, ParameterId, Place};

/// Steps of a fit at most: from the nominal arm it takes four or five.
const STEPS: usize = 12;
/// A step that is expected to lower the cost by less than this is not worth taking.
const CONVERGED: f64 = 1e-2;
/// How often a step that makes things worse is halved.
const HALVINGS: i32 = 5;
/// Eigenvalues of `1 − leverage` are not taken below this.
const FULL_LEVERAGE: f64 = 1e-9;

/// The nominal arm with the expected deviations of its parameters: what does not change from fit to fit.
pub(super) struct Nominal<'a> {
    pub(super) arm: &'a Arm,
    pub(super) parameters: &'a [FreeParameter],
    /// The parameters, then all target axes: the latter give the direction of the flange.
    ids: Vec<ParameterId>,
}

impl<'a> Nominal<'a> {
    pub(super) fn new(arm: &'a Arm, parameters: &'a [FreeParameter]) -> Self {
        let axes = (0..arm.targets.len()).flat_map(ParameterId::of_target);
        let ids = parameters.iter().map(|parameter| parameter.id).chain(axes).collect();
        Self { arm, parameters, ids }
    }
}

/// Something that has moved before some samples, with the standard deviation that it had before the fit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Step {
    /// The target in the flange, per axis (m).
    Target(f64),
    /// The instrument, per axis (m) and (rad).
    Instrument(f64, f64),
}

impl Step {
    const fn columns(self) -> usize {
        match self {
            Self::Target(_) => 3,
            Self::Instrument(..) => 6,
        }
    }
}

/// A sample as a hypothesis has it.
#[derive(Clone, Debug)]
pub(super) struct Item {
    /// Index of the sample in the session.
    pub(super) sample: usize,
    pub(super) at: Place,
    pub(super) station: usize,
    /// Measured (m).
    pub(super) point: Point3<f64>,
    /// Standard deviation of a coordinate (m).
    pub(super) sigma: f64,
    /// Whether this sample comes after the [`Step`].
    pub(super) moved: bool,
}

/// Estimates of a fit.
#[derive(Clone)]
struct State {
    z: DVector<f64>,
    /// The step in units of its prior; a shift, then a turn.
    step: DVector<f64>,
    base_from_station: Vec<Isometry3<f64>>,
}

/// A fit and what it is made of.
pub(super) struct Fit<'a> {
    nominal: &'a Nominal<'a>,
    /// The arm at the estimate.
    arm: Arm,
    state: State,
    step: Option<Step>,
    centroids: Vec<Point3<f64>>,
    pub(super) items: Vec<Item>,
    /// Square sum of residuals and of deviations in units of what is expected: χ² of `3 M − 6` values if nothing is wrong.
    pub(super) cost: f64,
    /// −2 ln of the probability density of all measured coordinates.
    pub(super) energy: f64,
    factor: Cholesky<f64, Dyn>,
    /// `Jᵀ`, three columns per item.
    rows: DMatrix<f64>,
    /// Whitened residuals, three per item.
    residuals: DVector<f64>,
    /// Axes of the flange in the base, per item.
    axes: Vec<Matrix3<f64>>,
}

/// A measured point against its prediction by others.
pub(super) struct Innovation {
    /// Measured − predicted in the base (m).
    pub(super) error: Vector3<f64>,
    /// Its covariance (m²), noise of the point included.
    pub(super) covariance: Matrix3<f64>,
}

impl Innovation {
    /// Square of how many standard deviations the error has.
    pub(super) fn square(&self) -> f64 {
        self.covariance.cholesky().map_or(f64::INFINITY, |factor| self.error.dot(&factor.solve(&self.error)))
    }

    /// −2 ln of the density with `spread` (m) added in every direction.
    pub(super) fn energy(&self, spread: f64) -> f64 {
        let covariance = self.covariance + Matrix3::identity() * (spread * spread);
        covariance.cholesky().map_or(f64::INFINITY, |factor| {
            let log_det = 2.0 * factor.l_dirty().diagonal().map(f64::ln).sum();
            self.error.dot(&factor.solve(&self.error)) + log_det + 3.0 * std::f64::consts::TAU.ln()
        })
    }
}

struct Linear {
    rows: DMatrix<f64>,
    residuals: DVector<f64>,
    axes: Vec<Matrix3<f64>>,
    cost: f64,
}

impl<'a> Fit<'a> {
    /// Fits `items`; `None` without any, or where the numbers break down.
    pub(super) fn new(nominal: &'a Nominal<'a>, items: Vec<Item>) -> Option<Self> {
        Self::from(nominal, items, None, None)
    }

    /// Fits `items` with something that has moved, beginning at the estimates of another fit.
    pub(super) fn from(
        nominal: &'a Nominal<'a>,
        items: Vec<Item>,
        step: Option<Step>,
        start: Option<&Self>,
    ) -> Option<Self> {
        let stations = items.iter().map(|item| item.station + 1).max()?;
        let n = nominal.parameters.len();
        let mut fit = Self {
            nominal,
            arm: nominal.arm.clone(),
            state: State {
                z: DVector::zeros(n),
                step: DVector::zeros(step.map_or(0, Step::columns)),
                base_from_station: vec![Isometry3::identity(); stations],
            },
            step,
            centroids: vec![Point3::origin(); stations],
            items,
            cost: f64::INFINITY,
            energy: f64::INFINITY,
            factor: DMatrix::identity(1, 1).cholesky()?,
            rows: DMatrix::zeros(0, 0),
            residuals: DVector::zeros(0),
            axes: Vec::new(),
        };
        match start.filter(|start| start.centroids.len() == stations) {
            Some(start) => {
                fit.state.z.clone_from(&start.state.z);
                fit.state.base_from_station.clone_from(&start.state.base_from_station);
                fit.centroids.clone_from(&start.centroids);
            }
            None => fit.register(),
        }
        let mut at = fit.linearise();
        let mut system = fit.system(&at)?;
        for _ in 0..STEPS {
            let step = system.0.solve(&system.1);
            if system.1.dot(&step) < CONVERGED {
                break;
            }
            let from = fit.state.clone();
            let mut better = None;
            for halving in 0..=HALVINGS {
                fit.move_by(&from, &step, 0.5_f64.powi(halving));
                let there = fit.linearise();
                if there.cost < at.cost {
                    better = Some(there);
                    break;
                }
            }
            let Some(there) = better else {
                fit.state = from;
                break;
            };
            at = there;
            system = fit.system(&at)?;
        }
        fit.finish(at, system.0)
    }

    fn columns(&self) -> usize {
        self.frame_column(self.centroids.len())
    }

    fn frame_column(&self, station: usize) -> usize {
        self.nominal.parameters.len() + self.state.step.len() + 6 * station
    }

    /// Frames by registration of the nominal predictions.
    fn register(&mut self) {
        let predicted = self.nominal.arm.points_in_base(self.items.iter().map(|item| &item.at));
        for station in 0..self.centroids.len() {
            let pairs = self
                .items
                .iter()
                .zip(&predicted)
                .filter(|(item, _)| item.station == station)
                .map(|(item, predicted)| (item.sigma.powi(-2), item.point, *predicted));
            if let Some(found) = register(pairs) {
                self.state.base_from_station[station] = found.to_from_from;
                self.centroids[station] = found.to_from_from * found.centroid_from;
            }
        }
    }

    /// The model at the state.
    fn apply(&mut self) {
        let deviations = self.nominal.parameters.iter().zip(self.state.z.iter());
        let deviations = deviations.map(|(parameter, z)| (parameter.id, z * parameter.expected));
        // Triage has checked that the arm has every parameter.
        if let Ok(arm) = self.nominal.arm.with(deviations) {
            self.arm = arm;
        }
    }

    fn move_by(&mut self, from: &State, step: &DVector<f64>, fraction: f64) {
        let mut state = from.clone();
        let n = state.z.len();
        state.z += step.rows(0, n) * fraction;
        let moved = state.step.len();
        state.step += step.rows(n, moved) * fraction;
        for (station, frame) in state.base_from_station.iter_mut().enumerate() {
            let column = self.frame_column(station);
            let shift: Vector3<f64> = step.fixed_rows::<3>(column) * fraction;
            let turn: Vector3<f64> = step.fixed_rows::<3>(column + 3) * fraction;
            let centre = self.centroids[station].coords;
            let turned =
                Isometry3::from_parts(Translation3::from(centre + shift), UnitQuaternion::from_scaled_axis(turn));
            *frame = turned * Translation3::from(-centre) * *frame;
        }
        self.state = state;
    }

    /// Residual (m), its derivatives by all unknowns (three rows of [`Self::columns`] numbers) and the axes of the flange.
    fn block(
        &self,
        jacobian: &mut IdentificationJacobian,
        arm: &ForwardKinematics<'_>,
        item: &Item,
        scratch: &mut [f64],
        rows: &mut [f64],
    ) -> (Vector3<f64>, Matrix3<f64>) {
        let (n, all, columns) = (self.nominal.parameters.len(), self.nominal.ids.len(), self.columns());
        let mut target = self.arm.targets[item.at.target];
        if item.moved {
            target += self.shift();
        }
        let predicted = jacobian.evaluate(arm, &item.at.configuration, item.at.target, &target, scratch);
        let first_axis = n + 3 * item.at.target;
        let axes = Matrix3::from_fn(|row, axis| scratch[row * all + first_axis + axis]);
        let measured = self.measured(item);
        let lever = measured - self.centroids[item.station];
        // A turn ω moves the measured point by ω × lever.
        let turn = -lever.cross_matrix();
        let frame = self.frame_column(item.station);
        for row in 0..3 {
            let into = &mut rows[row * columns..(row + 1) * columns];
            into.fill(0.0);
            for (column, parameter) in self.nominal.parameters.iter().enumerate() {
                into[column] = -scratch[row * all + column] * parameter.expected;
            }
            match self.step.filter(|_| item.moved) {
                Some(Step::Target(prior)) => {
                    for axis in 0..3 {
                        into[n + axis] = -axes[(row, axis)] * prior;
                    }
                }
                Some(Step::Instrument(shift, angle)) => {
                    into[n + row] = shift;
                    for axis in 0..3 {
                        into[n + 3 + axis] = turn[(row, axis)] * angle;
                    }
                }
                None => {}
            }
            into[frame + row] = 1.0;
            for axis in 0..3 {
                into[frame + 3 + axis] = turn[(row, axis)];
            }
        }
        (measured - predicted, axes)
    }

    fn linearise(&mut self) -> Linear {
        self.apply();
        let arm = ForwardKinematics::new(&self.arm.chain);
        let mut jacobian = IdentificationJacobian::new(&self.nominal.ids);
        let columns = self.columns();
        let mut scratch = vec![0.0; 3 * self.nominal.ids.len()];
        let mut rows = DMatrix::zeros(columns, 3 * self.items.len());
        let mut residuals = DVector::zeros(3 * self.items.len());
        let mut axes = Vec::with_capacity(self.items.len());
        for (index, item) in self.items.iter().enumerate() {
            let into = &mut rows.as_mut_slice()[3 * columns * index..3 * columns * (index + 1)];
            let (residual, flange) = self.block(&mut jacobian, &arm, item, &mut scratch, into);
            for value in into {
                *value /= item.sigma;
            }
            residuals.fixed_rows_mut::<3>(3 * index).copy_from(&(residual / item.sigma));
            axes.push(flange);
        }
        let cost = residuals.norm_squared() + self.state.z.norm_squared() + self.state.step.norm_squared();
        Linear { rows, residuals, axes, cost }
    }

    /// Information of the unknowns and the gradient that a step follows.
    fn system(&self, at: &Linear) -> Option<(Cholesky<f64, Dyn>, DVector<f64>)> {
        let mut information = &at.rows * at.rows.transpose();
        for index in 0..information.nrows() {
            information[(index, index)] += 1.0;
        }
        let mut gradient = -(&at.rows * &at.residuals);
        let n = self.state.z.len();
        gradient.rows_mut(0, n).axpy(-1.0, &self.state.z, 1.0);
        gradient.rows_mut(n, self.state.step.len()).axpy(-1.0, &self.state.step, 1.0);
        Some((Cholesky::new(information)?, gradient))
    }

    fn finish(mut self, at: Linear, factor: Cholesky<f64, Dyn>) -> Option<Self> {
        self.apply();
        let log_det = 2.0 * factor.l_dirty().diagonal().map(f64::ln).sum();
        let log_noise: f64 =
            self.items.iter().map(|item| 6.0 * item.sigma.ln() + 3.0 * std::f64::consts::TAU.ln()).sum();
        self.energy = at.cost + log_det + log_noise;
        self.cost = at.cost;
        self.rows = at.rows;
        self.residuals = at.residuals;
        self.axes = at.axes;
        self.factor = factor;
        self.energy.is_finite().then_some(self)
    }

    /// `L⁻¹ Jᵀ`: the leverage of the items.
    fn whitened(&self) -> DMatrix<f64> {
        let mut whitened = self.rows.clone();
        self.factor.l_dirty().solve_lower_triangular_mut(&mut whitened);
        whitened
    }

    /// Shift of the target that was found (m), in the flange.
    pub(super) fn shift(&self) -> Vector3<f64> {
        match self.step {
            Some(Step::Target(prior)) => self.state.step.fixed_rows::<3>(0) * prior,
            _ => Vector3::zeros(),
        }
    }

    /// How large the step is in units of its prior.
    pub(super) fn step_size(&self) -> f64 {
        self.state.step.norm()
    }

    /// The measured point in the base (m).
    fn measured(&self, item: &Item) -> Point3<f64> {
        let point = self.state.base_from_station[item.station] * item.point;
        match self.step {
            Some(Step::Instrument(shift, angle)) if item.moved => {
                let centre = self.centroids[item.station];
                let turn: Vector3<f64> = self.state.step.fixed_rows::<3>(3) * angle;
                centre
                    + self.state.step.fixed_rows::<3>(0) * shift
                    + UnitQuaternion::from_scaled_axis(turn) * (point - centre)
            }
            _ => point,
        }
    }

    /// Per item: by how much the cost would fall without it. χ² of three values if nothing is wrong.
    pub(super) fn gains(&self) -> Vec<f64> {
        let whitened = self.whitened();
        (0..self.items.len())
            .map(|index| {
                let block = whitened.columns(3 * index, 3);
                let left = Matrix3::identity() - block.transpose() * block;
                let residual: Vector3<f64> = self.residuals.fixed_rows::<3>(3 * index).into();
                studentised_square(&left, &residual)
            })
            .collect()
    }

    /// Per item: by how much the cost would fall if the target (all targets) had moved just before it, by about `prior` (m). χ² of three
    /// values.
    pub(super) fn moved_gains(&self, prior: f64) -> Vec<f64> {
        let whitened = self.whitened();
        let columns = whitened.nrows();
        let mut tied = DMatrix::<f64>::zeros(columns, 3);
        let (mut own, mut gradient) = (Matrix3::identity(), Vector3::zeros());
        let mut found = vec![0.0; self.items.len()];
        for (index, item) in self.items.iter().enumerate().rev() {
            let derivative = self.axes[index] * (-prior / item.sigma);
            let block = whitened.columns(3 * index, 3);
            tied.gemm(1.0, &block, &derivative, 1.0);
            own += derivative.transpose() * derivative;
            gradient -= derivative.transpose() * self.residuals.fixed_rows::<3>(3 * index);
            let left: Matrix3<f64> = own - Matrix3::from_fn(|i, j| tied.column(i).dot(&tied.column(j)));
            if let Some(factor) = left.cholesky() {
                found[index] = gradient.dot(&factor.solve(&gradient));
            }
        }
        found
    }

    /// `item`, not one of those fitted, against its prediction.
    pub(super) fn innovation(&self, item: &Item) -> Innovation {
        self.probe(item).at(&item.at.configuration)
    }

    /// Where `item` was predicted, in the frame of its station.
    pub(super) fn fitting(&self, item: &Item, innovation: &Innovation) -> Point3<f64> {
        let base_from_station = self.state.base_from_station[item.station];
        item.point - base_from_station.inverse_transform_vector(&innovation.error)
    }

    /// The point of `item`, not one of those fitted, to be compared with predictions for any configuration.
    pub(super) fn probe<'f>(&'f self, item: &Item) -> Probe<'f, 'a> {
        Probe {
            fit: self,
            arm: ForwardKinematics::new(&self.arm.chain),
            jacobian: IdentificationJacobian::new(&self.nominal.ids),
            scratch: vec![0.0; 3 * self.nominal.ids.len()],
            rows: DMatrix::zeros(self.columns(), 3),
            item: item.clone(),
        }
    }

    /// Predicted distance between two items (m), and the standard deviation (m) of the measured one about it.
    pub(super) fn distance(&self, from: &Item, to: &Item) -> (f64, f64) {
        let arm = ForwardKinematics::new(&self.arm.chain);
        let mut jacobian = IdentificationJacobian::new(&self.nominal.ids);
        let columns = self.columns();
        let mut scratch = vec![0.0; 3 * self.nominal.ids.len()];
        let mut blocks = [DMatrix::zeros(columns, 3), DMatrix::zeros(columns, 3)];
        let mut points = [Vector3::zeros(); 2];
        for ((item, rows), point) in [from, to].into_iter().zip(&mut blocks).zip(&mut points) {
            let (error, _) = self.block(&mut jacobian, &arm, item, &mut scratch, rows.as_mut_slice());
            *point = self.measured(item).coords - error;
        }
        let difference = points[1] - points[0];
        let predicted = difference.norm();
        let direction = if predicted > f64::EPSILON { difference / predicted } else { Vector3::x() };
        let mut row = (&blocks[1] - &blocks[0]) * direction;
        // Distances do not see the frame: what is left of its columns is the residuals' size.
        row.rows_mut(self.frame_column(0), 6 * self.centroids.len()).fill(0.0);
        self.factor.l_dirty().solve_lower_triangular_mut(&mut row);
        let variance = row.norm_squared() + from.sigma.powi(2) + to.sigma.powi(2);
        (predicted, variance.sqrt())
    }
}

/// See [`Fit::probe`].
pub(super) struct Probe<'f, 'a> {
    fit: &'f Fit<'a>,
    arm: ForwardKinematics<'f>,
    jacobian: IdentificationJacobian,
    scratch: Vec<f64>,
    rows: DMatrix<f64>,
    item: Item,
}

impl Probe<'_, '_> {
    /// The point against its prediction at a configuration.
    pub(super) fn at(&mut self, configuration: &[f64]) -> Innovation {
        self.item.at.configuration.clear();
        self.item.at.configuration.extend_from_slice(configuration);
        let rows = &mut self.rows;
        let (error, _) =
            self.fit.block(&mut self.jacobian, &self.arm, &self.item, &mut self.scratch, rows.as_mut_slice());
        self.fit.factor.l_dirty().solve_lower_triangular_mut(rows);
        let known = Matrix3::from_fn(|i, j| rows.column(i).dot(&rows.column(j)));
        Innovation { error, covariance: known + Matrix3::identity() * (self.item.sigma * self.item.sigma) }
    }

    /// Change of the error from one configuration to another (m).
    pub(super) fn change(&self, from: &[f64], to: &[f64]) -> Vector3<f64> {
        let target = &self.fit.arm.targets[self.item.at.target];
        self.arm.point_in_base(from, target) - self.arm.point_in_base(to, target)
    }
}

/// `eᵀ V⁻¹ e`, V kept away from singular.
fn studentised_square(variance: &Matrix3<f64>, residual: &Vector3<f64>) -> f64 {
    let guarded = variance + Matrix3::identity() * FULL_LEVERAGE;
    guarded.cholesky().map_or(0.0, |factor| residual.dot(&factor.solve(residual)).max(0.0))
}
