//! Every fault that could be behind an alarm, compared by the probability that it gives to all data.
//!
//! A hypothesis is scored by its *energy*, −2 ln(prior · density of the data): a fault with free numbers (how far, which pose of how
//! many) pays for them because its density is spread over all their values. Samples that do not fit anything have a density of
//! their own, spread over all sizes, so that each hypothesis speaks about the same data.

use super::alarm::{EARLIER, SHIFT};
use super::fit::{Arm, Fit, Item};
use super::slips::{Slip, outlier_energy, slips};
use super::{Cause, Explanation, Finding, PairDeviation, Triage};
use crate::geometry::principal_spread;
use crate::units::{INCH, MILLIMETRE};

/// Samples among the earlier ones that may be set aside as bad.
const SET_ASIDE: usize = 3;
/// Earlier samples that are tried as the culprit, beside those set aside; with few points all are.
const SUSPECTS: usize = 2;
const FEW: usize = 7;
/// Hypotheses that are worked out by a fit of their own.
const WORKED_OUT: usize = 4;
/// A fault must be this much better than none (energy): faults are rare.
const RARE: f64 = 6.0;
/// Prices (energy) of a fault that is as common as any, less common, rare.
const COMMON: f64 = 2.0;
const UNCOMMON: f64 = 4.0;
const SELDOM: f64 = 6.0;
/// Alternatives that are at least this likely are named, and how many.
const WORTH_NAMING: f64 = 0.03;
const NAMED: usize = 5;
/// Pairs in a finding.
const PAIRS: usize = 3;
/// Squares of deviations beyond which something cannot be meant.
const ABSURD: f64 = 100.0;
/// An SMR that sits further off (m) has not been bumped.
const FARTHEST_BUMP: f64 = 60.0 * MILLIMETRE;
/// Above so many samples a joint sign is looked for only if several stand out.
const SIGN_UP_TO: usize = 30;
/// What coordinates may have to be multiplied by.
const FACTORS: [f64; 6] =
    [INCH / MILLIMETRE, 1e3, MILLIMETRE / INCH, 1e-3, 1.0 / INCH, INCH];

/// A fault with what it explains.
struct Hypothesis {
    sample: usize,
    cause: Cause,
    energy: f64,
    /// A single sample read otherwise: its place among the items, how to read it, and what the cause costs beside the data.
    altered: Option<(usize, Item, f64)>,
}

struct Case<'a, 't> {
    triage: &'a Triage<'t>,
    arm: &'a Arm<'a>,
    /// All samples, by number.
    all: &'a [Item],
    full: &'a Fit<'a>,
    /// Place of the newest among the items of `full`.
    newest: usize,
    /// Places of earlier items that are bad.
    aside: Vec<usize>,
    /// Fit of all but the newest and those.
    base: Fit<'a>,
    found: Vec<Hypothesis>,
}

/// Names the fault that explains the data best; `None` if no fault is better than chance.
pub(super) fn explain(triage: &Triage<'_>, arm: &Arm<'_>, all: &[Item], full: &Fit<'_>) -> Option<Finding> {
    let newest = full.items.len() - 1;
    let (base, aside) = set_aside(arm, full, newest)?;
    let mut case = Case { triage, arm, all, full, newest, aside, base, found: Vec::new() };
    case.single_samples();
    case.units();
    case.joint_signs();
    case.moved();
    case.swapped();
    case.work_out();
    case.finding()
}

/// The earlier items without the newest and without those that do not fit the others, and the places of the latter.
fn set_aside<'a>(arm: &'a Arm<'a>, full: &Fit<'_>, newest: usize) -> Option<(Fit<'a>, Vec<usize>)> {
    let without = |aside: &[usize]| {
        let places = (0..newest).filter(|place| !aside.contains(place));
        Fit::new(arm, places.map(|place| full.items[place].clone()).collect(), None)
    };
    let mut aside = Vec::new();
    let mut base = without(&aside)?;
    while aside.len() < SET_ASIDE && base.items.len() > 4 {
        let gains = base.gains();
        let mut worst: Vec<usize> = (0..gains.len()).filter(|&index| gains[index] > EARLIER).collect();
        worst.sort_by(|&a, &b| gains[b].total_cmp(&gains[a]));
        let tried = worst.into_iter().take(2).filter_map(|index| {
            let sample = base.items[index].sample;
            let place = full.items.iter().position(|item| item.sample == sample)?;
            let places: Vec<usize> = aside.iter().copied().chain([place]).collect();
            Some((without(&places)?, places))
        });
        let Some(best) = tried.min_by(|a, b| a.0.cost.total_cmp(&b.0.cost)) else { break };
        (base, aside) = best;
    }
    Some((base, aside))
}

impl<'a> Case<'a, '_> {
    fn item(&self, place: usize) -> &'a Item {
        &self.full.items[place]
    }

    fn sample(&self, place: usize) -> usize {
        self.item(place).sample
    }

    fn newest_sample(&self) -> usize {
        self.sample(self.newest)
    }

    /// All items but some, each changed by `change`.
    fn fit(&self, without: &[usize], shift: Option<f64>, change: impl Fn(&mut Item)) -> Option<Fit<'a>> {
        let places = (0..self.full.items.len()).filter(|place| !without.contains(place));
        let items = places.map(|place| {
            let mut item = self.item(place).clone();
            change(&mut item);
            item
        });
        Fit::new(self.arm, items.collect(), shift)
    }

    /// Energy of the places in `without`, except `but`, as readings that fit nothing.
    fn outliers(&self, fit: &Fit<'_>, without: &[usize], but: usize) -> f64 {
        let others = without.iter().filter(|&&place| place != but);
        others.map(|&place| outlier_energy(&fit.innovation(self.item(place))) + COMMON).sum()
    }

    fn several(&self) -> f64 {
        2.0 * (self.full.items.len() as f64).ln()
    }

    fn add(&mut self, place: usize, cause: Cause, energy: f64) {
        let sample = self.sample(place);
        self.found.push(Hypothesis { sample, cause, energy, altered: None });
    }

    fn single_samples(&mut self) {
        let gains = self.full.gains();
        let mut suspects: Vec<usize> =
            (0..self.newest).filter(|place| !self.aside.contains(place)).collect();
        suspects.sort_by(|&a, &b| gains[b].total_cmp(&gains[a]));
        let count = if self.full.items.len() <= FEW { FEW } else { SUSPECTS };
        suspects.truncate(count);
        let base = self.fit(&[&self.aside[..], &[self.newest]].concat(), None, |_| {});
        if let Some(base) = base {
            self.single_sample(self.newest, &base);
        }
        for place in self.aside.clone() {
            if let Some(others) = self.fit(&self.aside, None, |_| {}) {
                self.single_sample(place, &others);
            }
        }
        for place in suspects {
            let without = [&self.aside[..], &[place]].concat();
            if let Some(others) = self.fit(&without, None, |_| {}) {
                self.single_sample(place, &others);
            }
        }
    }

    /// Everything that can be wrong with one sample, given the others.
    fn single_sample(&mut self, place: usize, others: &Fit<'_>) {
        let item = self.item(place).clone();
        let energy = others.energy + self.outliers(others, &self.aside, place);
        let innovation = others.innovation(&item);
        let unexplained = energy + outlier_energy(&innovation) + COMMON;
        self.add(place, Cause::Unexplained, unexplained);
        let by = innovation.error.norm();
        if place == self.newest && by < FARTHEST_BUMP {
            self.add(place, Cause::TargetMoved { since: item.sample, by }, unexplained + COMMON);
        }
        self.poses(place, &item, others, energy);
        for Slip { joint, by, energy: own, price } in slips(self.triage.chain, others, &item) {
            let quantity = self.triage.chain.joints()[joint].joint_type.quantity();
            let mut altered = item.clone();
            altered.configuration[joint] += by;
            self.found.push(Hypothesis {
                sample: item.sample,
                cause: Cause::MistypedJoint { joint, by, quantity },
                energy: energy + own + COMMON,
                altered: Some((place, altered, price + COMMON)),
            });
        }
    }

    /// Another planned pose, or that of the sample before.
    fn poses(&mut self, place: usize, item: &Item, others: &Fit<'_>, energy: f64) {
        let before = item.sample.checked_sub(1).map(|sample| self.all[sample].configuration.as_slice());
        let before = before.filter(|configuration| !same(configuration, &item.configuration));
        let planned = self.triage.planned;
        let own = planned.iter().position(|configuration| same(configuration, &item.configuration));
        let is_other = |configuration: &[f64]| {
            !same(configuration, &item.configuration) && before.is_none_or(|before| !same(configuration, before))
        };
        let poses: Vec<usize> = (0..planned.len()).filter(|&pose| is_other(&planned[pose])).collect();
        let configurations = poses.iter().map(|&pose| planned[pose].as_slice());
        let many = 2.0 * (poses.len().max(1) as f64).ln();
        let price = |pose: usize| if own.is_some_and(|own| own + 1 == pose) { COMMON } else { UNCOMMON + many };
        let of_poses = poses.iter().map(|&pose| (Cause::WrongPose { planned: pose }, pose, price(pose)));
        let mut scored: Vec<(f64, Cause, &[f64], f64)> = of_poses
            .zip(others.innovations(item, configurations))
            .map(|((cause, pose, price), innovation)| {
                (innovation.energy(0.0) + price, cause, planned[pose].as_slice(), price)
            })
            .collect();
        scored.sort_by(|a, b| a.0.total_cmp(&b.0));
        scored.truncate(2);
        if let Some(before) = before {
            let innovation = others.innovations(item, std::iter::once(before)).next();
            let own = innovation.map_or(f64::INFINITY, |innovation| innovation.energy(0.0));
            scored.push((own + COMMON, Cause::StayedAtPrevious, before, COMMON));
        }
        for (own, cause, configuration, price) in scored {
            let altered = Item { configuration: configuration.to_vec(), ..item.clone() };
            self.found.push(Hypothesis {
                sample: item.sample,
                cause,
                energy: energy + own,
                altered: Some((place, altered, price)),
            });
        }
    }

    /// Another unit, from the first sample on or from some later one on.
    fn units(&mut self) {
        let extent = |points: &[nalgebra::Point3<f64>]| principal_spread(points.iter())[0];
        let measured: Vec<_> = self.full.items.iter().map(|item| item.point).collect();
        let arm = crate::kinematics::ForwardKinematics::new(self.triage.chain);
        let predicted: Vec<_> = self
            .full
            .items
            .iter()
            .map(|item| arm.point_in_base(&item.configuration, &self.triage.targets[item.target]))
            .collect();
        let ratio = extent(&predicted) / extent(&measured).max(f64::MIN_POSITIVE);
        let first = self.sample(0);
        let newest = self.item(self.newest).clone();
        let scaled = |item: &Item, factor: f64| Item { point: item.point * factor, ..item.clone() };
        for factor in FACTORS {
            if (0.5..2.0).contains(&(ratio / factor))
                && let Some(fit) = self.fit(&[], None, |item| item.point *= factor)
            {
                self.add(self.newest, Cause::Unit { factor, since: first }, fit.energy + UNCOMMON);
            }
            let innovation = self.base.innovation(&scaled(&newest, factor));
            if innovation.square() > ABSURD {
                continue;
            }
            let since = self.newest_sample();
            let energy = self.base.energy + self.outliers(&self.base, &self.aside, self.newest);
            let price = UNCOMMON;
            self.add(self.newest, Cause::Unit { factor, since }, energy + innovation.energy(0.0) + price);
            let Some(&start) = self.aside.iter().min() else { continue };
            let since = self.sample(start);
            let change = |item: &mut Item| {
                if item.sample >= since {
                    item.point *= factor;
                }
            };
            if let Some(fit) = self.fit(&[], None, change) {
                self.add(self.newest, Cause::Unit { factor, since }, fit.energy + price);
            }
        }
    }

    fn joint_signs(&mut self) {
        if self.full.items.len() > SIGN_UP_TO && self.aside.len() < 2 {
            return;
        }
        let joints = self.triage.chain.dof();
        for joint in 0..joints {
            if let Some(fit) = self.fit(&[], None, |item| item.configuration[joint] *= -1.0) {
                let energy = fit.energy + UNCOMMON + 2.0 * (joints as f64).ln();
                self.add(self.newest, Cause::JointSign { joint }, energy);
            }
        }
    }

    /// The target on the flange, or the instrument, elsewhere from some sample on.
    fn moved(&mut self) {
        let gains = self.full.moved_gains(SHIFT);
        let mut starts: Vec<usize> = (1..self.newest).collect();
        starts.sort_by(|&a, &b| gains[b].0.total_cmp(&gains[a].0));
        starts.truncate(3);
        starts.extend(self.aside.iter().min().filter(|&&place| place > 0));
        starts.sort_unstable();
        starts.dedup();
        for place in starts {
            let since = self.sample(place);
            let prior = gains[place].1.norm().clamp(0.5 * MILLIMETRE, FARTHEST_BUMP);
            let moved = self.fit(&[], Some(prior), |item| item.moved = item.sample >= since);
            if let Some(fit) = moved {
                let energy = fit.energy + UNCOMMON + self.several();
                let by = fit.shift().norm();
                if by < FARTHEST_BUMP {
                    self.add(self.newest, Cause::TargetMoved { since, by }, energy);
                }
            }
            let station = self.item(self.newest).station;
            let fresh = self.full.items.iter().map(|item| item.station + 1).max().unwrap_or(1);
            let displaced = self.fit(&[], None, |item| {
                if item.sample >= since && item.station == station {
                    item.station = fresh;
                }
            });
            if let Some(fit) = displaced {
                let energy = fit.energy + SELDOM + self.several();
                self.add(self.newest, Cause::InstrumentMoved { since }, energy);
            }
        }
    }

    /// The points of two samples exchanged.
    fn swapped(&mut self) {
        let suspects: Vec<usize> = self.aside.iter().copied().chain([self.newest]).collect();
        for place in suspects {
            let item = self.item(place).clone();
            let others: Vec<&Item> = self
                .all
                .iter()
                .filter(|other| other.sample != item.sample && !same(&other.configuration, &item.configuration))
                .collect();
            let configurations = others.iter().map(|other| other.configuration.as_slice());
            let squares = self.base.innovations(&item, configurations).map(|innovation| innovation.square());
            let best = squares.zip(&others).min_by(|a, b| a.0.total_cmp(&b.0));
            let Some((square, &with)) = best else { continue };
            if square > ABSURD {
                continue;
            }
            let exchanged = [
                Item { configuration: with.configuration.clone(), ..item.clone() },
                Item { configuration: item.configuration.clone(), ..with.clone() },
            ];
            let pair = [item.sample, with.sample];
            let kept = self.full.items.iter().enumerate().filter(|(place, other)| {
                !self.aside.contains(place) && !pair.contains(&other.sample)
            });
            let items = kept.map(|(_, item)| item.clone()).chain(exchanged).collect();
            let Some(fit) = Fit::new(self.arm, items, None) else { continue };
            let aside = self.aside.iter().copied().filter(|&place| !pair.contains(&self.sample(place)));
            let aside: Vec<usize> = aside.collect();
            let mut energy = fit.energy + self.outliers(&fit, &aside, self.full.items.len()) + COMMON;
            if item.sample.abs_diff(with.sample) != 1 {
                energy += self.several();
            }
            if self.triage.excluded.contains(&with.sample) {
                // The other hypotheses do not speak about a sample that was left out.
                energy -= outlier_energy(&self.base.innovation(with)) + COMMON;
            }
            self.add(place, Cause::SwappedRows { with: with.sample }, energy);
        }
    }

    /// Fits the best hypotheses about single samples with the sample read as they say.
    fn work_out(&mut self) {
        self.sort();
        for index in 0..self.found.len().min(WORKED_OUT) {
            let Some((place, altered, price)) = self.found[index].altered.take() else { continue };
            let without: Vec<usize> = self.aside.iter().copied().filter(|&other| other != place).collect();
            let changed = self.fit(&without, None, |item| {
                if item.sample == altered.sample {
                    item.configuration.clone_from(&altered.configuration);
                }
            });
            if let Some(fit) = changed {
                self.found[index].energy = fit.energy + self.outliers(&fit, &without, place) + price;
            }
        }
        self.sort();
    }

    fn sort(&mut self) {
        self.found.sort_by(|a, b| a.energy.total_cmp(&b.energy));
    }

    fn finding(self) -> Option<Finding> {
        let best = self.found.first()?;
        if best.energy + RARE > self.full.energy {
            return None;
        }
        let weight = |hypothesis: &Hypothesis| (0.5 * (best.energy - hypothesis.energy)).exp();
        let total: f64 = self.found.iter().map(weight).sum();
        let others = self.found.iter().skip(1).map(|hypothesis| Explanation {
            sample: hypothesis.sample,
            cause: hypothesis.cause.clone(),
            share: weight(hypothesis) / total,
        });
        let alternatives = others.filter(|other| other.share > WORTH_NAMING).take(NAMED).collect();
        let (ratio, worst) = self.deviations(best.sample);
        Some(Finding {
            sample: best.sample,
            ratio,
            worst,
            cause: best.cause.clone(),
            share: weight(best) / total,
            alternatives,
        })
    }

    /// How far a sample is off the others, and the distances that show it.
    fn deviations(&self, sample: usize) -> (f64, Vec<PairDeviation>) {
        let place = self.full.items.iter().position(|item| item.sample == sample).unwrap_or(self.newest);
        let without: Vec<usize> = self.aside.iter().copied().chain([place]).collect();
        let Some(others) = self.fit(&without, None, |_| {}) else { return (f64::INFINITY, Vec::new()) };
        let item = self.item(place);
        let ratio = others.innovation(item).square().sqrt();
        let same_station = others.items.iter().filter(|other| other.station == item.station);
        let mut pairs: Vec<PairDeviation> = same_station
            .map(|other| {
                let (predicted, expected) = others.distance(other, item);
                let deviation = (item.point - other.point).norm() - predicted;
                PairDeviation { other: other.sample, deviation, expected }
            })
            .collect();
        pairs.sort_by(|a, b| (b.deviation / b.expected).abs().total_cmp(&(a.deviation / a.expected).abs()));
        pairs.truncate(PAIRS);
        (ratio, pairs)
    }
}

/// Whether two configurations are the same pose.
fn same(a: &[f64], b: &[f64]) -> bool {
    a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-9)
}
