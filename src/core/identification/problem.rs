//! What identification is given: the nominal arm, the free parameters and the observations.

use nalgebra::{DVector, Point3};

use super::{IdentificationError, Places, Rejected, SampleIndex, Shape};
use crate::kinematics::{Arm, FreeParameter, Joint, ParameterId, Place};

/// One measured point.
#[derive(Clone, Debug, PartialEq)]
pub struct PointSample {
    /// Where the arm stood and what was measured.
    pub at: Place,
    /// Index of the instrument station: points of one station share an unknown frame.
    pub station: usize,
    /// Coordinates in the frame of the station (m).
    pub point: Point3<f64>,
    /// Standard deviation of each coordinate (m), where the reading has one.
    pub sigma: Option<f64>,
}

/// Configurations in which the target sits in one and the same unknown point, as a ball in a socket.
#[derive(Clone, Debug, PartialEq)]
pub struct SharedPoint {
    /// The configurations.
    pub at: Vec<Place>,
}

/// One end of a measured length.
#[derive(Clone, Debug, PartialEq)]
pub enum LengthEnd {
    /// The target at a configuration.
    Target(Place),
    /// The shared point with this index.
    SharedPoint(usize),
    /// A feature of unknown place: a fixed point, a plane, a line or a circle.
    Feature {
        /// Its index.
        feature: usize,
        /// Which of the values of a contact: a line and a circle give two.
        component: usize,
    },
}

/// A measured length between two points of which no coordinates are known, or a contact with a feature.
#[derive(Clone, Debug, PartialEq)]
pub struct Length {
    /// From here …
    pub from: LengthEnd,
    /// … to here.
    pub to: LengthEnd,
    /// Measured length (m); of a contact what its [`Shape`] says, zero for a component that is not measured.
    pub length: f64,
    /// Its standard deviation (m), where it is known.
    pub sigma: Option<f64>,
}

impl Length {
    /// The feature that it is a contact with, and which value of the contact it is.
    pub fn feature(&self) -> Option<(usize, usize)> {
        [&self.from, &self.to].into_iter().find_map(|end| match end {
            LengthEnd::Feature { feature, component } => Some((*feature, *component)),
            LengthEnd::Target(_) | LengthEnd::SharedPoint(_) => None,
        })
    }
}

/// Everything that was observed. All kinds enter one estimate and none of them knows the robot base.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Observations {
    /// Measured points.
    pub points: Vec<PointSample>,
    /// Shared points.
    pub shared: Vec<SharedPoint>,
    /// Measured lengths.
    pub lengths: Vec<Length>,
    /// Features of unknown place that lengths end at.
    pub features: Vec<Shape>,
}

impl Observations {
    /// Number of independent values in the observations: 3 per point less 6 per station, 3 per seat less 3 per shared point,
    /// one per length less what the place of each feature takes.
    pub fn independent_values(&self) -> usize {
        let of_station = |station: usize| self.points.iter().filter(|sample| sample.station == station).count();
        let points: usize = (0..self.stations()).map(|station| (3 * of_station(station)).saturating_sub(6)).sum();
        let shared: usize = self.shared.iter().map(|shared| 3 * shared.at.len().saturating_sub(1)).sum();
        points + shared + self.length_values(|_| true)
    }

    /// Number of independent values in the lengths that `counts` picks: one each, less what the places of their features take.
    pub(crate) fn length_values(&self, counts: impl Fn(usize) -> bool) -> usize {
        let mut of_features = vec![0_usize; self.features.len()];
        let mut values = 0;
        for (_, length) in self.lengths.iter().enumerate().filter(|(index, _)| counts(*index)) {
            match length.feature().and_then(|(feature, _)| of_features.get_mut(feature)) {
                Some(count) => *count += 1,
                None => values += 1,
            }
        }
        let left = of_features.iter().zip(&self.features).map(|(count, shape)| count.saturating_sub(shape.unknowns()));
        values + left.sum::<usize>()
    }

    /// Points and seats without repetitions: of every configuration and target the first per station and per shared point.
    #[must_use]
    pub fn without_repetitions(&self, joints: &[Joint]) -> Self {
        let of_station = |station: usize| {
            let points: Vec<&PointSample> = self.points.iter().filter(|sample| sample.station == station).collect();
            let first = Places::new(joints, points.iter().map(|sample| &sample.at)).first_of_each();
            let kept = points.into_iter().enumerate().zip(first).filter(|((index, _), first)| index == first);
            kept.map(|((_, sample), _)| sample.clone()).collect::<Vec<_>>()
        };
        let once = |shared: &SharedPoint| {
            let first = Places::new(joints, &shared.at).first_of_each();
            let kept = shared.at.iter().enumerate().zip(first).filter(|((index, _), first)| index == first);
            SharedPoint { at: kept.map(|((_, at), _)| at.clone()).collect() }
        };
        Self {
            points: (0..self.stations()).flat_map(of_station).collect(),
            shared: self.shared.iter().map(once).collect(),
            lengths: self.lengths.clone(),
            features: self.features.clone(),
        }
    }

    /// How many points, seats and lengths there are, without repetitions.
    pub fn distinct(&self, joints: &[Joint]) -> usize {
        let once = self.without_repetitions(joints);
        once.points.len() + once.shared.iter().map(|shared| shared.at.len()).sum::<usize>() + once.lengths.len()
    }

    fn stations(&self) -> usize {
        self.points.iter().map(|sample| sample.station + 1).max().unwrap_or(0)
    }

    /// The observations without the rejected ones.
    #[must_use]
    pub fn without(&self, rejected: &[Rejected]) -> Self {
        self.of_samples(|sample| rejected.iter().all(|rejected| rejected.sample != sample))
    }

    /// The observations with every place altered.
    #[must_use]
    pub(super) fn at(&self, change: impl Fn(&mut Place)) -> Self {
        let mut altered = self.clone();
        altered.points.iter_mut().for_each(|sample| change(&mut sample.at));
        altered.shared.iter_mut().flat_map(|shared| &mut shared.at).for_each(&change);
        for end in altered.lengths.iter_mut().flat_map(|length| [&mut length.from, &mut length.to]) {
            if let LengthEnd::Target(at) = end {
                change(at);
            }
        }
        altered
    }

    /// The samples that `keep` picks. Shared points keep their place in the list, also without a seat.
    #[must_use]
    pub fn of_samples(&self, keep: impl Fn(SampleIndex) -> bool) -> Self {
        let mut place = 0;
        let mut keeps = || {
            place += 1;
            keep(SampleIndex::Place(place - 1))
        };
        let points = self.points.iter().filter(|_| keeps()).cloned().collect();
        let shared = self
            .shared
            .iter()
            .map(|shared| SharedPoint { at: shared.at.iter().filter(|_| keeps()).cloned().collect() });
        let shared = shared.collect();
        let kept = self.lengths.iter().enumerate().filter(|(index, _)| keep(SampleIndex::Length(*index)));
        let lengths = kept.map(|(_, length)| length.clone()).collect();
        Self { points, shared, lengths, features: self.features.clone() }
    }

    /// The shared points whose index `keep` picks, with the lengths between them.
    #[must_use]
    pub fn of_shared(&self, keep: impl Fn(usize) -> bool) -> Self {
        let mut new_index = vec![None; self.shared.len()];
        let mut picked = Self { features: self.features.clone(), ..Self::default() };
        for (index, shared) in self.shared.iter().enumerate() {
            if keep(index) {
                new_index[index] = Some(picked.shared.len());
                picked.shared.push(shared.clone());
            }
        }
        let moved = |end: &LengthEnd| match end {
            LengthEnd::SharedPoint(index) => new_index.get(*index).copied().flatten().map(LengthEnd::SharedPoint),
            LengthEnd::Target(_) | LengthEnd::Feature { .. } => Some(end.clone()),
        };
        for length in &self.lengths {
            if let (Some(from), Some(to)) = (moved(&length.from), moved(&length.to)) {
                picked.lengths.push(Length { from, to, ..length.clone() });
            }
        }
        picked
    }

    /// All places where the target was observed, in a fixed order: points, shared points, lengths.
    pub fn places(&self) -> impl Iterator<Item = &Place> {
        let lengths = self.lengths.iter().flat_map(|length| [&length.from, &length.to]).filter_map(|end| match end {
            LengthEnd::Target(at) => Some(at),
            LengthEnd::SharedPoint(_) | LengthEnd::Feature { .. } => None,
        });
        self.points
            .iter()
            .map(|sample| &sample.at)
            .chain(self.shared.iter().flat_map(|shared| &shared.at))
            .chain(lengths)
    }
}

/// An identification problem: checked once, then trusted by everything below.
#[derive(Clone, Debug)]
pub struct Problem<'a> {
    /// Nominal arm.
    pub arm: &'a Arm,
    /// Parameters to identify, in the order of all vectors and matrices.
    pub parameters: &'a [FreeParameter],
    /// What was observed.
    pub observations: &'a Observations,
}

impl Problem<'_> {
    /// The same problem with other parameters.
    pub(crate) const fn of_geometry<'b>(&self, parameters: &'b [FreeParameter]) -> Problem<'b>
    where
        Self: 'b,
    {
        Problem { arm: self.arm, parameters, observations: self.observations }
    }

    /// The ids of the parameters, in order.
    pub fn parameter_ids(&self) -> Vec<ParameterId> {
        self.parameters.iter().map(|parameter| parameter.id).collect()
    }

    /// The arm with the deviations `x` ((m) or (rad)) of the parameters, in order.
    pub fn arm_with(&self, x: &DVector<f64>) -> Arm {
        let deviations = self.parameters.iter().map(|parameter| parameter.id).zip(x.iter().copied());
        // The problem was checked: the arm has every parameter.
        self.arm.with(deviations).unwrap_or_else(|_| self.arm.clone())
    }

    /// Checks sizes, indices and finiteness.
    ///
    /// # Errors
    /// The first thing that is wrong.
    pub fn check(&self) -> Result<(), IdentificationError> {
        for parameter in self.parameters {
            if self.arm.value(parameter.id).is_none() {
                return Err(IdentificationError::UnknownParameter { parameter: parameter.id.to_string() });
            }
            if !(parameter.expected.is_finite() && parameter.expected > 0.0) {
                return Err(IdentificationError::ExpectedDeviation {
                    parameter: parameter.id.to_string(),
                    expected: parameter.expected,
                });
            }
        }
        for (index, place) in self.observations.places().enumerate() {
            if place.configuration.len() != self.arm.chain.dof() {
                return Err(IdentificationError::Joints {
                    sample: index,
                    given: place.configuration.len(),
                    joints: self.arm.chain.dof(),
                });
            }
            if place.target >= self.arm.targets.len() {
                return Err(IdentificationError::Target {
                    sample: index,
                    target: place.target,
                    targets: self.arm.targets.len(),
                });
            }
            if !place.configuration.iter().all(|value| value.is_finite()) {
                return Err(IdentificationError::NotFinite { sample: index });
            }
        }
        for (index, sample) in self.observations.points.iter().enumerate() {
            let sigma_ok = sample.sigma.is_none_or(|sigma| sigma.is_finite() && sigma > 0.0);
            if !(sample.point.coords.iter().all(|value| value.is_finite()) && sigma_ok) {
                return Err(IdentificationError::NotFinite { sample: index });
            }
        }
        for (index, length) in self.observations.lengths.iter().enumerate() {
            let sigma_ok = length.sigma.is_none_or(|sigma| sigma.is_finite() && sigma > 0.0);
            let shape =
                length.feature().map(|(feature, component)| (self.observations.features.get(feature), component));
            let value_ok = length.length.is_finite()
                && match shape {
                    None | Some((Some(Shape::Point), _)) => length.length > 0.0,
                    Some((Some(shape), component)) => component < shape.components(),
                    Some((None, _)) => false,
                };
            let end_ok = |end: &LengthEnd| match end {
                LengthEnd::Target(_) | LengthEnd::Feature { .. } => true,
                LengthEnd::SharedPoint(shared) => *shared < self.observations.shared.len(),
            };
            let is_of_features = [&length.from, &length.to].iter().all(|end| matches!(end, LengthEnd::Feature { .. }));
            if !(value_ok && sigma_ok && end_ok(&length.from) && end_ok(&length.to)) || is_of_features {
                return Err(IdentificationError::Length { length: index, value: length.length });
            }
        }
        if self.observations.independent_values() == 0 {
            return Err(IdentificationError::NoData);
        }
        Ok(())
    }
}
