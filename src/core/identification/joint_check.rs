//! The joint check: each joint is moved by a few degrees, one after the other, and the reflector is measured before the first
//! move and after each. The distances between these few points show whether every joint turns the way, as far and about the axis
//! that the nominal arm says.
//!
//! The points of a hypothesis are registered to the measured ones, with the place of the reflector in the flange left free, so that
//! neither the instrument nor the reflector has to be known. Hypotheses are the nominal arm, and the arm with up to three
//! of the faults that a profile can have. The nominal arm is preferred to whatever explains the points no better.

use nalgebra::{DMatrix, DVector, Isometry3, Matrix3, Point3, Vector3};

use crate::geometry::register;
use crate::kinematics::{ForwardKinematics, JointType, KinematicChain};
use crate::units::{DEGREE, INCH, MILLIMETRE};

/// Most faults at a time.
const MOST_FAULTS: usize = 3;
/// Hypotheses that are kept from one number of faults to the next.
const KEPT: usize = 6;
/// Steps of the fit of the reflector.
const STEPS: usize = 12;
/// The arm that is not calibrated yet: its points are about as far as this from the nominal ones (m), even if all joints are right.
const ARM: f64 = 0.2 * MILLIMETRE;
/// An explanation has to leave less than this part of what the simpler one leaves.
const BETTER: f64 = 0.25;
/// Explanations are alike if they leave at most this many times as much as the best one.
const ALIKE: f64 = 1.5;
/// What explains the points leaves at most this much (m, rms), or this part of the largest movement.
const EXPLAINED: (f64, f64) = (1.0 * MILLIMETRE, 0.01);
/// Expected error of a zero (rad, m) of an arm whose zeros are right.
const ZERO: (f64, f64) = (1.0 * DEGREE, 2.0 * MILLIMETRE);
/// Zeros farther off than this are a fault (rad, m), if they are known well enough.
const ZERO_FAULT: (f64, f64) = (3.0 * DEGREE, 5.0 * MILLIMETRE);
/// Zeros that joints have by other conventions (rad).
const ZEROS: [f64; 3] = [90.0 * DEGREE, -90.0 * DEGREE, 180.0 * DEGREE];
/// Factors between units of turning joints: radians and degrees. Gons are left out: a zero that is off looks much the same.
const TURNS: [f64; 2] = [1.0 / DEGREE, DEGREE];
/// Factors between units of sliding joints: inches, centimetres and metres.
const SLIDES: [f64; 6] = [INCH / MILLIMETRE, MILLIMETRE / INCH, 10.0, 0.1, 1000.0, 0.001];
/// A move is right if it is as long as asked within this part, or within three standard deviations.
const MOVE: f64 = 0.2;
/// A movement whose standard deviation is a larger part of it than this is not seen.
const UNSEEN: f64 = 0.3;

/// A stop of the check.
#[derive(Clone, Debug, PartialEq)]
pub struct CheckedStop {
    /// Joint that was moved to get there, from 0; `None` for the first stop.
    pub joint: Option<usize>,
    /// Pendant values (rad, sliding joints m).
    pub configuration: Vec<f64>,
    /// Measured point (m).
    pub point: Point3<f64>,
}

/// A way in which a robot differs from its profile.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum JointFault {
    /// A joint moves the other way.
    Reversed {
        /// Index of the joint.
        joint: usize,
    },
    /// The values of a joint are in another unit: the joint moves this many times as far.
    Unit {
        /// Index of the joint.
        joint: usize,
        /// True movement over the one asked for.
        factor: f64,
    },
    /// The zero of a joint is elsewhere: this has to be added to its pendant value (rad, m).
    Zero {
        /// Index of the joint.
        joint: usize,
        /// What has to be added.
        offset: f64,
    },
    /// A joint moves with another one, or the profile wrongly says so.
    Coupled {
        /// Index of the joint.
        joint: usize,
        /// Index of the one that it moves with.
        with: usize,
        /// What has to be added to its pendant value, per value of the other joint.
        factor: f64,
    },
    /// The frame of the instrument is left-handed.
    Mirrored,
}

impl JointFault {
    /// The joint that is wrong, if it is one.
    pub const fn joint(&self) -> Option<usize> {
        match *self {
            Self::Reversed { joint }
            | Self::Unit { joint, .. }
            | Self::Zero { joint, .. }
            | Self::Coupled { joint, .. } => Some(joint),
            Self::Mirrored => None,
        }
    }

    /// How rare it is: the smaller the likelier among faults that explain the points equally.
    const fn rarity(&self) -> usize {
        match *self {
            Self::Reversed { .. } => 1,
            Self::Coupled { .. } | Self::Unit { .. } => 2,
            // Half a turn looks like a reversed joint or two, which is commoner.
            Self::Zero { .. } => 3,
            Self::Mirrored => 8,
        }
    }

    /// Turns pendant values `q` into those of the profile, where `corrected` has those without this fault.
    pub fn correct(&self, q: &[f64], corrected: &mut [f64]) {
        let Some(value) = self.joint().and_then(|joint| corrected.get_mut(joint)) else { return };
        match *self {
            Self::Reversed { .. } => *value = -*value,
            Self::Unit { factor, .. } => *value *= factor,
            Self::Zero { offset, .. } => *value += offset,
            Self::Coupled { with, factor, .. } => *value += factor * q.get(with).copied().unwrap_or(0.0),
            Self::Mirrored => {}
        }
    }
}

/// A joint in the result of the check.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JointSeen {
    /// Movement that was asked for (rad, m).
    pub asked: f64,
    /// Movement that was seen and its standard deviation (rad, m); `None` if the reflector does not show it.
    pub seen: Option<(f64, f64)>,
    /// Error of the zero and its standard deviation (rad, m); `None` for the first and the last joint, whose zeros distances to a free
    /// reflector cannot show.
    pub zero: Option<(f64, f64)>,
}

/// Result of the joint check.
#[derive(Clone, Debug, PartialEq)]
pub struct JointCheck {
    /// What is wrong with the profile or the robot; none if everything is as it should be.
    pub faults: Vec<JointFault>,
    /// Whether nothing that is known explains the points.
    pub is_unexplained: bool,
    /// One per joint.
    pub joints: Vec<JointSeen>,
    /// Place of the reflector in the flange, with the faults corrected.
    pub point_in_flange: Point3<f64>,
    /// Its standard deviation (m).
    pub sigma: Vector3<f64>,
    /// Distance of the points from where the arm should have them (m, rms).
    pub rms: f64,
}

/// A value with its standard deviation, if it is known.
type WithSigma = Option<(f64, f64)>;

/// A set of faults with what it leaves.
#[derive(Clone, Debug)]
struct Hypothesis {
    faults: Vec<JointFault>,
    fit: Fit,
}

/// A fit of reflector and instrument.
#[derive(Clone, Debug)]
struct Fit {
    target: Point3<f64>,
    base_from_tracker: Isometry3<f64>,
    rms: f64,
}

/// Compares the stops with the nominal arm. `target` is where the reflector is expected, with the standard deviation `doubt` (m);
/// `sigma` is that of a coordinate of the instrument.
///
/// # Panics
/// Never: joints that the stops do not have are ignored.
pub fn check_joints(
    chain: &KinematicChain,
    stops: &[CheckedStop],
    (target, doubt): (Point3<f64>, f64),
    sigma: f64,
) -> Option<JointCheck> {
    let check = Check { chain, stops, target, doubt: doubt.max(MILLIMETRE), sigma: sigma.hypot(ARM) };
    let nominal = check.hypothesis(Vec::new())?;
    let best = check.best(&nominal);
    let extent = stops.windows(2).map(|pair| (pair[1].point - pair[0].point).norm()).fold(0.0, f64::max);
    let explained = EXPLAINED.0.max(EXPLAINED.1 * extent);
    let mut faults = best.faults.clone();
    let (zeros, fit) = check.zeros(&best)?;
    for (joint, zero) in zeros.iter().enumerate() {
        let Some((offset, deviation)) = *zero else { continue };
        let limit = if check.is_turning(joint) { ZERO_FAULT.0 } else { ZERO_FAULT.1 };
        let is_known = faults.iter().any(|fault| fault.joint() == Some(joint));
        if offset.abs() > limit.max(4.0 * deviation) && !is_known {
            faults.push(JointFault::Zero { joint, offset });
        }
    }
    let offsets: Vec<f64> = zeros.iter().map(|zero| zero.map_or(0.0, |(offset, _)| offset)).collect();
    let moves = check.moves(&best.faults, &offsets, &fit);
    let joints = (0..chain.dof()).map(|joint| JointSeen {
        asked: check.asked(joint),
        seen: moves.get(joint).copied().flatten(),
        zero: zeros.get(joint).copied().flatten(),
    });
    Some(JointCheck {
        is_unexplained: fit.rms > explained,
        joints: joints.collect(),
        point_in_flange: fit.target,
        sigma: check.target_sigma(&best),
        rms: fit.rms,
        faults,
    })
}

/// How far apart the hypotheses of one fault are from an arm that is as it should be (m, rms): the smaller, the harder to tell.
/// `target` is where the reflector is expected.
pub fn distinction(chain: &KinematicChain, configurations: &[(Option<usize>, Vec<f64>)], target: Point3<f64>) -> f64 {
    let forward = ForwardKinematics::new(chain);
    let stop = |(joint, q): &(Option<usize>, Vec<f64>)| CheckedStop {
        joint: *joint,
        configuration: q.clone(),
        point: forward.point_in_base(q, &target),
    };
    let stops: Vec<CheckedStop> = configurations.iter().map(stop).collect();
    let check = Check { chain, stops: &stops, target, doubt: 50.0 * MILLIMETRE, sigma: ARM };
    let reversed = (0..chain.dof()).map(|joint| JointFault::Reversed { joint });
    let left = reversed.chain(check.couplings()).filter_map(|fault| Some(check.hypothesis(vec![fault])?.fit.rms));
    left.fold(f64::INFINITY, f64::min)
}

struct Check<'a> {
    chain: &'a KinematicChain,
    stops: &'a [CheckedStop],
    target: Point3<f64>,
    doubt: f64,
    sigma: f64,
}

impl Check<'_> {
    fn is_turning(&self, joint: usize) -> bool {
        self.chain.joints().get(joint).is_some_and(|joint| joint.joint_type == JointType::Revolute)
    }

    /// Movement of a joint that was asked for.
    fn asked(&self, joint: usize) -> f64 {
        let moved = self.stops.windows(2).find(|pair| pair[1].joint == Some(joint));
        let value = |stop: &CheckedStop| stop.configuration.get(joint).copied().unwrap_or(0.0);
        moved.map_or(0.0, |pair| value(&pair[1]) - value(&pair[0]))
    }

    fn couplings(&self) -> impl Iterator<Item = JointFault> {
        let count = self.chain.dof();
        let pairs = (0..count).flat_map(move |joint| (0..count).map(move |with| (joint, with)));
        let near = pairs.filter(|(joint, with)| joint != with && joint.abs_diff(*with) <= 2);
        near.flat_map(|(joint, with)| [1.0, -1.0].map(|factor| JointFault::Coupled { joint, with, factor }))
    }

    /// All single faults.
    fn faults(&self) -> Vec<JointFault> {
        let count = self.chain.dof();
        let mut faults: Vec<JointFault> = (0..count).map(|joint| JointFault::Reversed { joint }).collect();
        for joint in 0..count {
            let factors: &[f64] = if self.is_turning(joint) { &TURNS } else { &SLIDES };
            faults.extend(factors.iter().map(|factor| JointFault::Unit { joint, factor: *factor }));
        }
        // The zeros of the first and the last joint only turn the base and move the reflector.
        for joint in (1..count.saturating_sub(1)).filter(|joint| self.is_turning(*joint)) {
            faults.extend(ZEROS.map(|offset| JointFault::Zero { joint, offset }));
        }
        faults.extend(self.couplings());
        faults.push(JointFault::Mirrored);
        faults
    }

    /// The simplest hypothesis that no other one is much better than.
    fn best(&self, nominal: &Hypothesis) -> Hypothesis {
        let single = self.faults();
        let mut best = nominal.clone();
        let mut kept = vec![nominal.clone()];
        for _ in 0..MOST_FAULTS {
            // What is left is what an arm leaves that is not calibrated: no fault is needed.
            if best.fit.rms <= self.sigma.max(EXPLAINED.0 / 2.0) {
                break;
            }
            let mut next: Vec<Hypothesis> = Vec::new();
            for before in &kept {
                let is_new = |fault: &&JointFault| before.faults.iter().all(|known| known.joint() != fault.joint());
                next.extend(
                    single
                        .iter()
                        .filter(is_new)
                        .filter_map(|fault| self.hypothesis(before.faults.iter().chain([fault]).copied().collect())),
                );
            }
            next.sort_by(|one, other| one.fit.rms.total_cmp(&other.fit.rms));
            // Of explanations that leave about the same, the commonest.
            let least = next.first().map_or(f64::INFINITY, |first| first.fit.rms);
            let alike = next.iter().filter(|one| one.fit.rms <= ALIKE * least.max(self.sigma));
            let rarity = |one: &Hypothesis| one.faults.iter().map(JointFault::rarity).sum::<usize>();
            let commonest = alike.min_by_key(|one| rarity(one)).filter(|one| one.fit.rms < BETTER * best.fit.rms);
            if let Some(found) = commonest {
                best = found.clone();
            }
            next.truncate(KEPT);
            kept = next;
        }
        best
    }

    /// The pose of the flange at each stop, with faults corrected and `change` applied.
    fn flanges(&self, faults: &[JointFault], change: impl Fn(usize, &mut [f64])) -> Vec<Isometry3<f64>> {
        let forward = ForwardKinematics::new(self.chain);
        let flange = |(index, stop): (usize, &CheckedStop)| {
            let mut q = stop.configuration.clone();
            q.resize(self.chain.dof(), 0.0);
            for fault in faults {
                fault.correct(&stop.configuration, &mut q);
            }
            change(index, &mut q);
            forward.base_from_flange(&q)
        };
        self.stops.iter().enumerate().map(flange).collect()
    }

    /// The measured points; mirrored if a fault says so.
    fn points(&self, faults: &[JointFault]) -> Vec<Point3<f64>> {
        let is_mirrored = faults.contains(&JointFault::Mirrored);
        let flip = |point: Point3<f64>| if is_mirrored { Point3::new(-point.x, point.y, point.z) } else { point };
        self.stops.iter().map(|stop| flip(stop.point)).collect()
    }

    fn hypothesis(&self, faults: Vec<JointFault>) -> Option<Hypothesis> {
        let flanges = self.flanges(&faults, |_, _| {});
        let fit = self.fit(&flanges, &self.points(&faults))?;
        Some(Hypothesis { faults, fit })
    }

    /// Fits reflector and instrument: linear in both once they are nearly right.
    fn fit(&self, flanges: &[Isometry3<f64>], points: &[Point3<f64>]) -> Option<Fit> {
        let mut target = self.target;
        let mut fit = None;
        for _ in 0..STEPS {
            let pairs = || points.iter().zip(flanges).map(|(point, flange)| (1.0, *point, flange * target));
            let found = register(pairs())?;
            let base_from_tracker = found.to_from_from;
            fit = Some(Fit { target, base_from_tracker, rms: found.rms });
            let system = Linear::new(self, flanges, points, (target, base_from_tracker), &[]);
            let step = system.solve()?;
            let moved = Vector3::new(step[6], step[7], step[8]);
            target += moved;
            if moved.norm() < 1e-7 {
                break;
            }
        }
        fit
    }

    /// Errors of the zeros of all joints but the first and the last, with their standard deviations, and the fit without them.
    fn zeros(&self, best: &Hypothesis) -> Option<(Vec<WithSigma>, Fit)> {
        let count = self.chain.dof();
        let free: Vec<usize> = (1..count.saturating_sub(1)).collect();
        let points = self.points(&best.faults);
        let mut offsets = vec![0.0; count];
        let mut fit = best.fit.clone();
        let mut deviations = vec![0.0; count];
        for _ in 0..STEPS {
            let with = |offsets: &[f64]| {
                self.flanges(&best.faults, |_, q| {
                    q.iter_mut().zip(offsets).for_each(|(value, offset)| *value += offset);
                })
            };
            let flanges = with(&offsets);
            let pairs = points.iter().zip(&flanges).map(|(point, flange)| (1.0, *point, flange * fit.target));
            let found = register(pairs)?;
            fit = Fit { target: fit.target, base_from_tracker: found.to_from_from, rms: found.rms };
            let columns: Vec<Extra> = free
                .iter()
                .map(|joint| {
                    let mut moved = offsets.clone();
                    if let Some(offset) = moved.get_mut(*joint) {
                        *offset += STEP;
                    }
                    let expected = if self.is_turning(*joint) { ZERO.0 } else { ZERO.1 };
                    // A zero may well be wrong: what counts as expected grows with what is found.
                    let now = offsets.get(*joint).copied().unwrap_or(0.0);
                    Extra { flanges: with(&moved), expected: expected.max(now.abs()), now }
                })
                .collect();
            let system = Linear::new(self, &flanges, &points, (fit.target, fit.base_from_tracker), &columns);
            let step = system.solve()?;
            let sigma = system.deviations();
            fit.target += Vector3::new(step[6], step[7], step[8]);
            for (index, joint) in free.iter().enumerate() {
                offsets[*joint] += step[9 + index];
                deviations[*joint] = sigma[9 + index];
            }
            if step.iter().all(|value| value.abs() < 1e-8) {
                break;
            }
        }
        let zero = |joint: usize| free.contains(&joint).then(|| (offsets[joint], deviations[joint]));
        Some(((0..count).map(zero).collect(), fit))
    }

    /// How far each joint was moved, with its standard deviation.
    fn moves(&self, faults: &[JointFault], offsets: &[f64], fit: &Fit) -> Vec<WithSigma> {
        let count = self.chain.dof();
        let shift = |q: &mut [f64]| q.iter_mut().zip(offsets).for_each(|(value, offset)| *value += offset);
        let flanges = self.flanges(faults, |_, q| shift(q));
        let points = self.points(faults);
        // A joint that was moved farther than asked is still there at all later stops.
        let after = |joint: usize| self.stops.iter().position(|stop| stop.joint == Some(joint)).unwrap_or(usize::MAX);
        let columns: Vec<Extra> = (0..count)
            .map(|joint| {
                let first = after(joint);
                let moved = self.flanges(faults, |index, q| {
                    shift(q);
                    if index >= first
                        && let Some(value) = q.get_mut(joint)
                    {
                        *value += STEP;
                    }
                });
                Extra { flanges: moved, expected: self.asked(joint).abs().max(STEP), now: 0.0 }
            })
            .collect();
        let system = Linear::new(self, &flanges, &points, (fit.target, fit.base_from_tracker), &columns);
        let Some(step) = system.solve() else { return vec![None; count] };
        let sigma = system.deviations();
        // What a fault changes is seen with its sign.
        let corrected = |joint: usize| {
            let of = |index: usize| {
                let stop = self.stops.get(index)?;
                let mut q = stop.configuration.clone();
                for fault in faults {
                    fault.correct(&stop.configuration, &mut q);
                }
                q.get(joint).copied()
            };
            let index = after(joint);
            Some(of(index)? - of(index.checked_sub(1)?)?)
        };
        (0..count)
            .map(|joint| {
                let (more, deviation) = (step[9 + joint], sigma[9 + joint]);
                let asked = self.asked(joint).abs();
                (deviation < UNSEEN * asked).then_some((corrected(joint)? + more, deviation))
            })
            .collect()
    }

    fn target_sigma(&self, best: &Hypothesis) -> Vector3<f64> {
        let flanges = self.flanges(&best.faults, |_, _| {});
        let points = self.points(&best.faults);
        let system = Linear::new(self, &flanges, &points, (best.fit.target, best.fit.base_from_tracker), &[]);
        let sigma = system.deviations();
        Vector3::new(sigma[6], sigma[7], sigma[8])
    }
}

impl JointSeen {
    /// Whether the joint was seen to move as far as asked, and its zero is where it should be.
    pub fn is_right(&self) -> bool {
        let has_moved = self
            .seen
            .is_none_or(|(seen, sigma)| (seen - self.asked).abs() <= (MOVE * self.asked.abs()).max(3.0 * sigma));
        has_moved && self.zero.is_none_or(|(zero, sigma)| zero.abs() <= ZERO_FAULT.0.max(4.0 * sigma))
    }
}

/// Step of numeric derivatives (rad, m).
const STEP: f64 = 1e-5;

/// A parameter besides instrument and reflector, by the flanges with it a [`STEP`] larger.
struct Extra {
    flanges: Vec<Isometry3<f64>>,
    /// Its expected deviation.
    expected: f64,
    /// Its value now.
    now: f64,
}

/// The linear system: rotation (3) and translation (3) of the instrument, the reflector (3), and extras, each with a prior.
struct Linear {
    matrix: DMatrix<f64>,
    right: DVector<f64>,
}

impl Linear {
    fn new(
        check: &Check<'_>,
        flanges: &[Isometry3<f64>],
        points: &[Point3<f64>],
        (target, base_from_tracker): (Point3<f64>, Isometry3<f64>),
        extras: &[Extra],
    ) -> Self {
        let (columns, rows) = (9 + extras.len(), 3 * points.len() + 3 + extras.len());
        let mut matrix = DMatrix::zeros(rows, columns);
        let mut right = DVector::zeros(rows);
        let measured: Vec<Point3<f64>> = points.iter().map(|point| base_from_tracker * point).collect();
        let centre = measured.iter().map(|point| point.coords).sum::<Vector3<f64>>() / measured.len().max(1) as f64;
        for (index, (point, flange)) in measured.iter().zip(flanges).enumerate() {
            let first = 3 * index;
            let predicted = flange * target;
            let arm = point.coords - centre;
            let turn: Matrix3<f64> = arm.cross_matrix();
            // measured + omega x arm + shift = predicted + R dt + extras
            let place = |matrix: &mut DMatrix<f64>, column: usize, block: &Matrix3<f64>| {
                matrix.fixed_view_mut::<3, 3>(first, column).copy_from(&(block / check.sigma));
            };
            place(&mut matrix, 0, &turn);
            place(&mut matrix, 3, &-Matrix3::identity());
            place(&mut matrix, 6, flange.rotation.to_rotation_matrix().matrix());
            for (extra, column) in extras.iter().zip(9..) {
                let Some(moved) = extra.flanges.get(index) else { continue };
                let derivative = ((moved * target) - predicted) / (STEP * check.sigma);
                matrix.fixed_view_mut::<3, 1>(first, column).copy_from(&derivative);
            }
            right.fixed_rows_mut::<3>(first).copy_from(&((point - predicted) / check.sigma));
        }
        let first = 3 * points.len();
        for axis in 0..3 {
            matrix[(first + axis, 6 + axis)] = 1.0 / check.doubt;
            right[first + axis] = (check.target[axis] - target[axis]) / check.doubt;
        }
        for (index, extra) in extras.iter().enumerate() {
            matrix[(first + 3 + index, 9 + index)] = 1.0 / extra.expected;
            right[first + 3 + index] = -extra.now / extra.expected;
        }
        Self { matrix, right }
    }

    fn solve(&self) -> Option<DVector<f64>> {
        let normal = self.matrix.tr_mul(&self.matrix);
        let solved = match normal.cholesky() {
            Some(factor) => factor.solve(&self.matrix.tr_mul(&self.right)),
            None => self.matrix.clone().svd(true, true).solve(&self.right, 1e-12).ok()?,
        };
        solved.iter().all(|value| value.is_finite()).then_some(solved)
    }

    /// Standard deviations of the unknowns.
    fn deviations(&self) -> DVector<f64> {
        let normal = self.matrix.transpose() * &self.matrix;
        let columns = normal.ncols();
        let inverse = normal.pseudo_inverse(1e-12).unwrap_or_else(|_| DMatrix::zeros(columns, columns));
        DVector::from_fn(columns, |index, _| inverse[(index, index)].max(0.0).sqrt())
    }
}
