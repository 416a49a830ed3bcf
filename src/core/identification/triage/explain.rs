//! Every fault that could be behind an alarm, compared by the probability that it gives to all data.
//!
//! A hypothesis is scored by its *energy*, −2 ln(prior · density of the data): a fault with free numbers (how far, which pose of how
//! many) pays for them because its density is spread over all their values. Samples that do not fit anything have a density of
//! their own, spread over all sizes, so that each hypothesis speaks about the same data.

use nalgebra::Point3;

use super::super::robust::gross_trust;
use super::super::{Observations, Problem, RejectionReason};
use super::alarm::{EARLIER, SHIFT, limit_of_sum};
use super::fit::{Fit, Item, Nominal, Step};
use super::slips::{Slip, outlier_energy, slips};
use super::{Cause, Explanation, Finding, PairDeviation, Triage};
use crate::geometry::principal_spread;
use crate::kinematics::Place;
use crate::units::{INCH, MILLIMETRE, MILLIRADIAN};

/// Samples among the earlier ones that may be set aside as bad.
const SET_ASIDE: usize = 3;
/// Earlier samples that are tried as the culprit, beside those set aside; with few points all are.
const SUSPECTS: usize = 2;
const FEW: usize = 7;
/// A sample, or a move, that would improve the fit by less than this is not worth a thought.
const SUSPICIOUS: f64 = 9.0;
/// Samples that are left at least, the newest not counted.
const FEWEST: usize = 4;
/// Places where the target may have moved that are worked out, beside those of bad samples.
const STARTS: usize = 3;
/// Hypotheses that are worked out by a fit of their own.
const WORKED_OUT: usize = 4;
/// With more samples the arm is known so well that linear predictions do, and a fault of the whole set has long been seen.
const MANY: usize = 30;
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
/// What coordinates may have to be multiplied by.
const FACTORS: [f64; 6] = [INCH / MILLIMETRE, 1e3, MILLIMETRE / INCH, 1e-3, 1.0 / INCH, INCH];
/// How far an instrument is displaced that somebody has knocked against, little or much: (m) and (rad) about the middle of the points.
const KNOCK: Step = Step::Instrument(5.0 * MILLIMETRE, 2.0 * MILLIRADIAN);
const BLOW: Step = Step::Instrument(60.0 * MILLIMETRE, 15.0 * MILLIRADIAN);
/// Size of a displacement in units of [`KNOCK`] that is rather a [`BLOW`].
const IS_BLOW: f64 = 3.0;
/// So many earlier samples that fit together rule out a fault from the first one on.
const SETTLED: usize = 10;

/// A fault with what it explains.
struct Hypothesis {
    sample: usize,
    cause: Cause,
    energy: f64,
    /// A single sample read otherwise, and what the cause costs beside the data.
    altered: Option<(Item, f64)>,
}

struct Case<'a, 't> {
    triage: &'a Triage<'t>,
    nominal: &'a Nominal<'a>,
    /// All samples, those that the operator has left out too: they do not count, but they may help to explain.
    items: &'a [Item],
    /// Fit of all samples that count.
    full: &'a Fit<'a>,
    newest: usize,
    /// Earlier samples that are bad or left out, ascending.
    aside: Vec<usize>,
    /// Fit of all but the newest and those.
    base: Fit<'a>,
    found: Vec<Hypothesis>,
}

/// Names the fault that explains the data best; `None` if no fault is better than chance. `full` is the fit of the `items` that
/// are not left out.
pub(super) fn explain(triage: &Triage<'_>, nominal: &Nominal<'_>, items: &[Item], full: &Fit<'_>) -> Option<Finding> {
    let newest = items.len() - 1;
    let (base, aside) = set_aside(triage, nominal, items)?;
    let mut case = Case { triage, nominal, items, full, newest, aside, base, found: Vec::new() };
    case.single_samples();
    case.units();
    case.joint_signs();
    case.moved();
    case.swapped();
    case.work_out();
    case.finding()
}

/// The fit of the earlier samples that fit together, and the others among the earlier ones: left out before, or bad.
fn set_aside<'a>(triage: &Triage<'_>, nominal: &'a Nominal<'a>, items: &[Item]) -> Option<(Fit<'a>, Vec<usize>)> {
    let (_, earlier) = items.split_last()?;
    let without = |aside: &[usize], start: Option<&Fit<'a>>| {
        let kept = earlier.iter().filter(|item| !aside.contains(&item.sample)).cloned().collect();
        Fit::from(nominal, kept, None, start)
    };
    let mut aside: Vec<usize> =
        earlier.iter().map(|item| item.sample).filter(|sample| triage.excluded.contains(sample)).collect();
    let left_out = aside.len();
    aside.extend(gross(triage, &items[..earlier.len()], &aside));
    let mut base = without(&aside, None)?;
    for _ in 0..SET_ASIDE {
        if base.items.len() <= FEWEST {
            break;
        }
        let gains = base.gains();
        let mut worst: Vec<usize> = (0..gains.len()).filter(|&index| gains[index] > EARLIER).collect();
        worst.sort_by(|&a, &b| gains[b].total_cmp(&gains[a]));
        // The worst one need not be the culprit: with few samples it may only be the one with the most to say.
        let candidates = if base.items.len() > MANY { 1 } else { 3 };
        let tried = worst.into_iter().take(candidates).filter_map(|index| {
            let samples = [&aside[..], &[base.items[index].sample]].concat();
            Some((without(&samples, Some(&base))?, samples))
        });
        let Some(best) = tried.min_by(|a, b| a.0.cost.total_cmp(&b.0.cost)) else { break };
        (base, aside) = best;
    }
    // What looked bad beside a worse one may be good.
    let fits = |sample: &usize| base.innovation(&items[*sample]).square() < SUSPICIOUS;
    let (back, bad): (Vec<usize>, Vec<usize>) = aside[left_out..].iter().partition(|sample| fits(sample));
    if !back.is_empty() {
        aside.truncate(left_out);
        aside.extend(bad);
        base = without(&aside, Some(&base))?;
    }
    aside.sort_unstable();
    Some((base, aside))
}

/// Samples that even the nominal arm shows to be impossible: one of them can lead a fit astray for good. None where so many are
/// that the arm, not a sample, is in question.
fn gross(triage: &Triage<'_>, earlier: &[Item], left_out: &[usize]) -> Vec<usize> {
    let kept: Vec<&Item> = earlier.iter().filter(|item| !left_out.contains(&item.sample)).collect();
    let points = kept.iter().map(|item| triage.samples[item.sample].clone()).collect();
    let observations = Observations { points, ..Observations::default() };
    let Triage { arm, parameters, .. } = *triage;
    let problem = Problem { arm, parameters, observations: &observations };
    let predicted = arm.points_in_base(kept.iter().map(|item| &item.at));
    let trust = gross_trust(&problem, &predicted);
    let impossible: Vec<usize> =
        kept.iter().zip(trust.places).filter(|(_, trust)| *trust <= 0.0).map(|(item, _)| item.sample).collect();
    if impossible.len() <= SET_ASIDE && kept.len() >= impossible.len() + FEWEST { impossible } else { Vec::new() }
}

impl<'a> Case<'a, '_> {
    /// All samples but some, each changed by `change`.
    fn fit(&self, without: &[usize], step: Option<Step>, change: impl Fn(&mut Item)) -> Option<Fit<'a>> {
        let kept = self.items.iter().filter(|item| !without.contains(&item.sample));
        let changed = kept.map(|item| {
            let mut item = item.clone();
            change(&mut item);
            item
        });
        Fit::from(self.nominal, changed.collect(), step, Some(&self.base))
    }

    /// Energy of all samples that count, each changed by `change`: a fault from the first sample on, of which the other fits know
    /// nothing.
    fn energy_of_all(&self, change: impl Fn(&mut Item)) -> Option<f64> {
        let changed = self.full.items.iter().map(|item| {
            let mut item = item.clone();
            change(&mut item);
            item
        });
        let fit = Fit::new(self.nominal, changed.collect())?;
        Some(fit.energy + self.outliers(&fit, self.triage.excluded, None))
    }

    /// Energy of the samples in `without`, except `but`, as readings that fit nothing.
    fn outliers(&self, fit: &Fit<'_>, without: &[usize], but: Option<usize>) -> f64 {
        let others = without.iter().filter(|&&sample| Some(sample) != but);
        others.map(|&sample| outlier_energy(&fit.innovation(&self.items[sample])) + COMMON).sum()
    }

    /// The same as one number: the fit of the changed samples without some, and those as readings that fit nothing.
    fn energy(&self, without: &[usize], step: Option<Step>, change: impl Fn(&mut Item)) -> Option<(f64, Fit<'a>)> {
        let fit = self.fit(without, step, change)?;
        Some((fit.energy + self.outliers(&fit, without, None), fit))
    }

    /// Price of one sample among all.
    fn several(&self) -> f64 {
        2.0 * (self.items.len() as f64).ln()
    }

    /// Whether the earlier samples fit together so well that nothing is wrong with all of them.
    fn is_settled(&self) -> bool {
        let count = self.base.items.len();
        count >= SETTLED && self.base.cost < limit_of_sum(3 * count - 6)
    }

    fn left_out(&self, sample: usize) -> bool {
        self.triage.excluded.contains(&sample)
    }

    fn add(&mut self, sample: usize, cause: Cause, energy: f64) {
        self.found.push(Hypothesis { sample, cause, energy, altered: None });
    }

    fn single_samples(&mut self) {
        let gains = self.full.gains();
        let mut suspects: Vec<(f64, usize)> = gains
            .into_iter()
            .zip(&self.full.items)
            .map(|(gain, item)| (gain, item.sample))
            .filter(|(gain, sample)| *gain > SUSPICIOUS && *sample != self.newest && !self.aside.contains(sample))
            .collect();
        suspects.sort_by(|a, b| b.0.total_cmp(&a.0));
        suspects.truncate(if self.full.items.len() <= FEW { FEW } else { SUSPECTS });
        let aside: Vec<usize> = self.aside.iter().copied().filter(|&sample| !self.left_out(sample)).collect();
        if !aside.is_empty()
            && let Some(others) = self.fit(&self.aside, None, |_| {})
        {
            for &sample in &aside {
                self.single_sample(sample, &others);
            }
        }
        for sample in suspects.into_iter().map(|(_, sample)| sample).chain([self.newest]) {
            let without = [&self.aside[..], &[sample]].concat();
            if let Some(others) = self.fit(&without, None, |_| {}) {
                self.single_sample(sample, &others);
            }
        }
    }

    /// Everything that can be wrong with one sample, given the others.
    fn single_sample(&mut self, sample: usize, others: &Fit<'_>) {
        let item = self.items[sample].clone();
        let energy = others.energy + self.outliers(others, &self.aside, Some(sample));
        let innovation = others.innovation(&item);
        let unexplained = energy + outlier_energy(&innovation) + COMMON;
        self.add(sample, Cause::Unexplained, unexplained);
        let by = innovation.error.norm();
        if sample == self.newest && by < FARTHEST_BUMP {
            self.add(sample, Cause::TargetMoved { since: sample, by }, unexplained + COMMON);
        }
        self.poses(&item, others, energy);
        for Slip { joint, by, energy: own, price } in slips(&self.triage.arm.chain, others, &item) {
            let quantity = self.triage.arm.chain.joints()[joint].joint_type.quantity();
            let mut altered = item.clone();
            altered.at.configuration[joint] += by;
            self.found.push(Hypothesis {
                sample,
                cause: Cause::MistypedJoint { joint, by, quantity },
                energy: energy + own + COMMON,
                altered: Some((altered, price + COMMON)),
            });
        }
    }

    /// Another planned pose, or that of the sample before.
    fn poses(&mut self, item: &Item, others: &Fit<'_>, energy: f64) {
        let before = item.sample.checked_sub(1).map(|sample| self.items[sample].at.configuration.as_slice());
        let before = before.filter(|configuration| !same(configuration, &item.at.configuration));
        let planned = self.triage.planned;
        let own = planned.iter().position(|configuration| same(configuration, &item.at.configuration));
        let is_other = |configuration: &[f64]| {
            !same(configuration, &item.at.configuration) && before.is_none_or(|before| !same(configuration, before))
        };
        let poses: Vec<usize> = (0..planned.len()).filter(|&pose| is_other(&planned[pose])).collect();
        let many = 2.0 * (poses.len().max(1) as f64).ln();
        let price = |pose: usize| if own.is_some_and(|own| own + 1 == pose) { COMMON } else { UNCOMMON + many };
        let mut probe = others.probe(item);
        let mut scored: Vec<(f64, Cause, &[f64], f64)> = poses
            .into_iter()
            .map(|pose| {
                let own = probe.at(&planned[pose]).energy(0.0) + price(pose);
                (own, Cause::WrongPose { planned: pose }, planned[pose].as_slice(), price(pose))
            })
            .collect();
        scored.sort_by(|a, b| a.0.total_cmp(&b.0));
        scored.truncate(2);
        if let Some(before) = before {
            scored.push((probe.at(before).energy(0.0) + COMMON, Cause::StayedAtPrevious, before, COMMON));
        }
        for (own, cause, configuration, price) in scored {
            let at = Place { configuration: configuration.to_vec(), target: item.at.target };
            let altered = Item { at, ..item.clone() };
            let altered = Some((altered, price));
            self.found.push(Hypothesis { sample: item.sample, cause, energy: energy + own, altered });
        }
    }

    /// Another unit, from the first sample on or from some later one on.
    fn units(&mut self) {
        let extent = |points: Vec<Point3<f64>>| principal_spread(points.iter())[0];
        let predicted = extent(self.triage.arm.points_in_base(self.full.items.iter().map(|item| &item.at)));
        let measured = extent(self.full.items.iter().map(|item| item.point).collect());
        let ratio = predicted / measured.max(f64::MIN_POSITIVE);
        for factor in FACTORS {
            if !self.is_settled()
                && (0.5..2.0).contains(&(ratio / factor))
                && let Some(energy) = self.energy_of_all(|item| item.point *= factor)
            {
                self.add(self.newest, Cause::Unit { factor, since: 0 }, energy + UNCOMMON);
            }
            let mut scaled = self.items[self.newest].clone();
            scaled.point *= factor;
            if self.base.innovation(&scaled).square() > ABSURD {
                continue;
            }
            for since in self.aside.iter().copied().chain([self.newest]).collect::<Vec<usize>>() {
                let without: Vec<usize> = self.aside.iter().copied().filter(|&sample| sample < since).collect();
                let change = |item: &mut Item| {
                    if item.sample >= since {
                        item.point *= factor;
                    }
                };
                if let Some((energy, _)) = self.energy(&without, None, change) {
                    self.add(self.newest, Cause::Unit { factor, since }, energy + UNCOMMON);
                }
            }
        }
    }

    fn joint_signs(&mut self) {
        if self.is_settled() {
            return;
        }
        let joints = self.triage.arm.chain.dof();
        for joint in 0..joints {
            let reversed = self.energy_of_all(|item| item.at.configuration[joint] *= -1.0);
            if let Some(energy) = reversed {
                self.add(self.newest, Cause::JointSign { joint }, energy + UNCOMMON + 2.0 * (joints as f64).ln());
            }
        }
    }

    /// The target on the flange, or the instrument, elsewhere from some sample on.
    fn moved(&mut self) {
        let mut gains: Vec<(f64, usize)> = self
            .full
            .moved_gains(SHIFT)
            .into_iter()
            .zip(&self.full.items)
            .map(|(gain, item)| (gain, item.sample))
            .filter(|(gain, sample)| *gain > SUSPICIOUS && (1..self.newest).contains(sample))
            .collect();
        gains.sort_by(|a, b| b.0.total_cmp(&a.0));
        let tried = if self.items.len() > MANY { 1 } else { STARTS };
        let mut starts: Vec<usize> = gains.into_iter().take(tried).map(|(_, sample)| sample).collect();
        starts.extend(self.aside.iter().filter(|&&sample| sample > 0).take(tried));
        starts.sort_unstable();
        starts.dedup();
        for since in starts {
            let without: Vec<usize> = self.aside.iter().copied().filter(|&sample| sample < since).collect();
            let after = |item: &mut Item| item.moved = item.sample >= since;
            if let Some((energy, by)) = self.target_moved(&without, after)
                && by < FARTHEST_BUMP
            {
                self.add(self.newest, Cause::TargetMoved { since, by }, energy + UNCOMMON + self.several());
            }
            let mut displaced = self.energy(&without, Some(KNOCK), after);
            if displaced.as_ref().is_some_and(|(_, fit)| fit.step_size() > IS_BLOW) {
                displaced = self.energy(&without, Some(BLOW), after);
            }
            if let Some((energy, _)) = displaced {
                self.add(self.newest, Cause::InstrumentMoved { since }, energy + SELDOM + self.several());
            }
        }
    }

    /// Energy and size (m) of a shift of the target. Half a millimetre is as likely as fifty: the prior is taken from the data.
    fn target_moved(&self, without: &[usize], after: impl Fn(&mut Item)) -> Option<(f64, f64)> {
        let (energy, fit) = self.energy(without, Some(Step::Target(SHIFT)), &after)?;
        let by = fit.shift().norm();
        if (0.4..2.5).contains(&(by / SHIFT)) {
            return Some((energy, by));
        }
        let prior = by.max(0.3 * MILLIMETRE) / 3.0_f64.sqrt();
        let (energy, fit) = self.energy(without, Some(Step::Target(prior)), &after)?;
        Some((energy, fit.shift().norm()))
    }

    /// The points of two samples exchanged.
    fn swapped(&mut self) {
        let own: Vec<usize> = self.aside.iter().copied().filter(|&sample| !self.left_out(sample)).collect();
        for sample in own.into_iter().chain([self.newest]) {
            let item = &self.items[sample];
            let differs =
                |other: &&Item| other.sample != sample && !same(&other.at.configuration, &item.at.configuration);
            let mut probe = self.base.probe(item);
            let squares =
                self.items.iter().filter(differs).map(|other| (probe.at(&other.at.configuration).square(), other));
            let best = squares.min_by(|a, b| a.0.total_cmp(&b.0));
            let Some((_, with)) = best.filter(|(square, _)| *square < ABSURD) else { continue };
            let pair = [sample, with.sample];
            let without: Vec<usize> = self.aside.iter().copied().filter(|aside| !pair.contains(aside)).collect();
            let exchanged = self.energy(&without, None, |changed| {
                if changed.sample == sample {
                    changed.at.configuration.clone_from(&with.at.configuration);
                } else if changed.sample == with.sample {
                    changed.at.configuration.clone_from(&item.at.configuration);
                }
            });
            if let Some((energy, _)) = exchanged {
                let far = if sample.abs_diff(with.sample) == 1 { 0.0 } else { self.several() };
                let with = with.sample;
                self.add(sample, Cause::SwappedRows { with }, energy + COMMON + far);
            }
        }
    }

    /// Fits the best hypotheses about single samples with the sample read as they say.
    fn work_out(&mut self) {
        self.sort();
        if self.items.len() > MANY {
            return;
        }
        for index in 0..self.found.len().min(WORKED_OUT) {
            let Some((altered, price)) = self.found[index].altered.take() else { continue };
            let sample = altered.sample;
            let without: Vec<usize> = self.aside.iter().copied().filter(|&other| other != sample).collect();
            let changed = self.energy(&without, None, |item| {
                if item.sample == sample {
                    item.at.configuration.clone_from(&altered.at.configuration);
                }
            });
            if let Some((energy, _)) = changed {
                self.found[index].energy = energy + price;
            }
        }
        self.sort();
    }

    fn sort(&mut self) {
        self.found.sort_by(|a, b| a.energy.total_cmp(&b.energy));
    }

    fn finding(self) -> Option<Finding> {
        let best = self.found.first()?;
        let nothing = self.full.energy + self.outliers(self.full, self.triage.excluded, None);
        if best.energy + RARE > nothing {
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
        let blamed = self.found.iter().filter(|hypothesis| weight(hypothesis) / total > WORTH_NAMING);
        let mut unexplained = blamed.filter(|hypothesis| hypothesis.cause == Cause::Unexplained);
        let typed =
            unexplained.any(|hypothesis| hypothesis.sample == best.sample).then(|| self.typed(best.sample)).flatten();
        Some(Finding {
            sample: best.sample,
            ratio,
            worst,
            cause: best.cause.clone(),
            share: weight(best) / total,
            alternatives,
            typed,
            is_early: best.sample == self.newest && self.base.items.len() < SETTLED && !self.triage.planned.is_empty(),
        })
    }

    /// The wrong sign or digit of one coordinate that makes a sample unlike what the others say.
    fn typed(&self, sample: usize) -> Option<RejectionReason> {
        let without = [&self.aside[..], &[sample]].concat();
        let others = self.fit(&without, None, |_| {})?;
        let item = &self.items[sample];
        let fitting = others.fitting(item, &others.innovation(item));
        // Far off, the point would scatter by the turn of the frame as well.
        let there = others.innovation(&Item { point: fitting, ..item.clone() });
        RejectionReason::typed(&item.point, &fitting, (there.covariance.trace() / 3.0).sqrt())
    }

    /// How far a sample is off the others, and the distances that show it.
    fn deviations(&self, sample: usize) -> (f64, Vec<PairDeviation>) {
        let without = [&self.aside[..], &[sample]].concat();
        let Some(others) = self.fit(&without, None, |_| {}) else { return (f64::INFINITY, Vec::new()) };
        let item = &self.items[sample];
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
