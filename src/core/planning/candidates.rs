//! The candidates among which poses are chosen: configurations in which the arm can stand and the tracker can measure.
//!
//! Every configuration is judged by every rule, also after the first one that it breaks: so it is known how many more there
//! would be without a rule, and the message about too few of them can say which rule to relax.

use std::fmt;
use std::ops::AddAssign;

use nalgebra::Point3;
use thiserror::Error;

use super::collision::{ArmShape, Obstruction};
use super::visibility::{Hidden, Sight};
use super::{Cell, CellError};
use crate::kinematics::{JointType, KinematicChain, Place};
use crate::units::{DEGREE, MILLIMETRE};

/// Joint angles in a plan are multiples of this (rad): 0.001°, the last digit of a FANUC program. At 1.5 m half of it is 13 µm,
/// more than a tracker's noise: the robot must be sent to the very configuration that is identified with.
pub const ANGLE_GRID: f64 = 1e-3 * DEGREE;

/// Sliding joints in a plan are multiples of this (m).
pub const LENGTH_GRID: f64 = 1e-3 * MILLIMETRE;

/// Rounds a configuration (rad, sliding joints m) to what robot programs can express; inside the limits it stays inside.
pub fn on_grid(chain: &KinematicChain, limits: &[(f64, f64)], q: &[f64]) -> Vec<f64> {
    let rounded = |((joint, &(low, high)), q): ((&crate::kinematics::Joint, &(f64, f64)), &f64)| {
        let grid = match joint.joint_type {
            JointType::Revolute => ANGLE_GRID,
            JointType::Prismatic => LENGTH_GRID,
        };
        let steps = (q / grid).round();
        let is_inside = (low..=high).contains(q);
        let steps = match steps * grid {
            value if is_inside && value > high => steps - 1.0,
            value if is_inside && value < low => steps + 1.0,
            _ => steps,
        };
        steps * grid
    };
    chain.joints().iter().zip(limits).zip(q).map(rounded).collect()
}

/// A reason against a configuration.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Rule {
    /// Joint limits.
    Limits,
    /// The arm collides with itself.
    Arm,
    /// The arm touches the floor.
    Floor,
    /// The arm enters a keep-out box.
    KeepOut,
    /// The arm hits the tracker.
    Tracker,
    /// The SMR is outside the region.
    Region,
    /// The SMR is too near to the tracker or too far from it.
    Range,
    /// The SMR looks past the tracker.
    Facing,
    /// Something is in the beam.
    Beam,
}

impl Rule {
    /// All rules, in the order of tables.
    pub const ALL: [Self; 9] = [
        Self::Limits,
        Self::Arm,
        Self::Floor,
        Self::KeepOut,
        Self::Tracker,
        Self::Region,
        Self::Range,
        Self::Facing,
        Self::Beam,
    ];

    /// Short name in tables.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Limits => "joint limits",
            Self::Arm => "arm against itself",
            Self::Floor => "floor",
            Self::KeepOut => "keep-out boxes",
            Self::Tracker => "tracker in the way",
            Self::Region => "region of the SMR",
            Self::Range => "tracker range",
            Self::Facing => "SMR faces away",
            Self::Beam => "beam blocked",
        }
    }

    /// What to change so that the rule rejects less.
    pub const fn remedy(self) -> &'static str {
        match self {
            Self::Limits => "widen the joint limits",
            Self::Arm => "narrow the joint limits that fold the arm, or check the bodies of the profile",
            Self::Floor => "narrow the joint limits that lower the arm, or check the height of the floor",
            Self::KeepOut => "make the keep-out boxes smaller, or narrow the joint limits to the free side",
            Self::Tracker => "move the tracker away from the arm, or correct its place",
            Self::Region => "make the region larger",
            Self::Range => "move the tracker, or correct its place or range",
            Self::Facing => {
                "turn the SMR so that it looks at the tracker in more poses, give the true acceptance angle, use a \
                 wider SMR, or try more candidates"
            }
            Self::Beam => "move the tracker to where it sees the arm, or use a longer SMR adapter",
        }
    }

    const fn of_obstruction(obstruction: &Obstruction) -> Self {
        match obstruction {
            Obstruction::Arm { .. } => Self::Arm,
            Obstruction::Floor { .. } => Self::Floor,
            Obstruction::KeepOut { .. } => Self::KeepOut,
            Obstruction::Tracker { .. } => Self::Tracker,
        }
    }

    const fn of_hidden(hidden: &Hidden) -> Self {
        match hidden {
            Hidden::Range { .. } => Self::Range,
            Hidden::FacesAway { .. } => Self::Facing,
            Hidden::BehindArm { .. } | Hidden::BehindBox { .. } => Self::Beam,
            Hidden::OutsideRegion { .. } => Self::Region,
        }
    }
}

/// A configuration in which a pose can be measured.
#[derive(Clone, Debug, PartialEq)]
pub struct Candidate {
    /// Pendant joint values (rad, sliding joints m), on the grid of [`on_grid`].
    pub configuration: Vec<f64>,
    /// Centre of the SMR in the base (m).
    pub point_in_base: Point3<f64>,
}

impl Candidate {
    /// The place of its first target.
    pub fn place(&self) -> Place {
        Place { configuration: self.configuration.clone(), target: 0 }
    }
}

/// How many configurations a rule was against.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Rejected {
    /// Against these it was.
    pub all: usize,
    /// Against these no other rule was: so many more there would be without it.
    pub alone: usize,
}

/// What became of the configurations that were tried.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Rejections {
    /// Configurations tried.
    pub tried: usize,
    /// Configurations kept.
    pub kept: usize,
    counts: [Rejected; Rule::ALL.len()],
}

impl Rejections {
    /// What a rule rejected.
    pub fn of(&self, rule: Rule) -> Rejected {
        self.counts.get(rule as usize).copied().unwrap_or_default()
    }

    /// The rules that rejected something, in the order of [`Rule::ALL`].
    pub fn rules(&self) -> impl Iterator<Item = (Rule, Rejected)> {
        Rule::ALL.into_iter().map(|rule| (rule, self.of(rule))).filter(|(_, rejected)| rejected.all > 0)
    }

    /// The rule whose absence would help most: which was most often the only one against a configuration, or if none ever
    /// was, the one that rejected most.
    pub fn strictest(&self) -> Option<Rule> {
        // From the back: of equals the first counts.
        let backwards = Rule::ALL.into_iter().rev().map(|rule| (rule, self.of(rule)));
        let rejecting = backwards.filter(|(_, rejected)| rejected.all > 0);
        rejecting.max_by_key(|(_, rejected)| (rejected.alone, rejected.all)).map(|(rule, _)| rule)
    }

    fn count(&mut self, rules: &[bool; Rule::ALL.len()]) {
        self.tried += 1;
        let broken = rules.iter().filter(|broken| **broken).count();
        if broken == 0 {
            self.kept += 1;
        }
        for (count, _) in self.counts.iter_mut().zip(rules).filter(|(_, broken)| **broken) {
            count.all += 1;
            count.alone += usize::from(broken == 1);
        }
    }
}

/// Sums of two parts of a search.
impl AddAssign<&Self> for Rejections {
    fn add_assign(&mut self, other: &Self) {
        self.tried += other.tried;
        self.kept += other.kept;
        for (count, other) in self.counts.iter_mut().zip(&other.counts) {
            count.all += other.all;
            count.alone += other.alone;
        }
    }
}

/// A table: one line per rule that rejected something, at most 60 columns wide.
impl fmt::Display for Rejections {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:<22} {:>10} {:>12}", "rule", "rejected", "by it alone")?;
        for (rule, Rejected { all, alone }) in self.rules() {
            write!(f, "\n{:<22} {all:>10} {alone:>12}", rule.name())?;
        }
        write!(f, "\n{:<22} {:>10} of {} tried", "kept", self.kept, self.tried)
    }
}

/// Fewer candidates than are needed.
#[derive(Clone, Debug, Error, PartialEq)]
#[error(
    "only {} of {} configurations tried can be measured, but at least {needed} are needed{}",
    rejections.kept, rejections.tried, strictest_text(rejections)
)]
pub struct TooFewCandidates {
    /// Candidates needed.
    pub needed: usize,
    /// What became of the others.
    pub rejections: Box<Rejections>,
}

fn strictest_text(rejections: &Rejections) -> String {
    rejections.strictest().map_or_else(String::new, |rule| {
        let Rejected { all, alone } = rejections.of(rule);
        format!("; the strictest rule is '{}' (against {all}, {alone} of them alone): {}", rule.name(), rule.remedy())
    })
}

/// Candidates with the account of what was rejected.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Candidates {
    /// In the order in which they were tried.
    pub kept: Vec<Candidate>,
    /// What became of the others.
    pub rejections: Rejections,
}

/// All rules together.
#[derive(Clone, Debug)]
pub struct CandidateFilter<'a> {
    shape: ArmShape<'a>,
    sight: Sight,
}

impl<'a> CandidateFilter<'a> {
    /// The rules of `cell` for the arm `chain`, with a clearance (m) everywhere.
    ///
    /// # Errors
    /// A cell that makes no sense.
    pub fn new(chain: &'a KinematicChain, cell: &Cell, clearance: f64) -> Result<Self, CellError> {
        Ok(Self { shape: ArmShape::new(chain, cell, clearance)?, sight: Sight::new(chain, cell)? })
    }

    /// The rules about collisions.
    pub const fn shape(&self) -> &ArmShape<'a> {
        &self.shape
    }

    /// The rules about sight.
    pub const fn sight(&self) -> &Sight {
        &self.sight
    }

    /// Tries configurations (rad, sliding joints m), rounded by [`on_grid`], until `enough` are kept or there are no more.
    pub fn collect(&self, configurations: impl IntoIterator<Item = Vec<f64>>, enough: usize) -> Candidates {
        let mut candidates = Candidates::default();
        for q in configurations {
            if candidates.kept.len() >= enough {
                break;
            }
            let q = on_grid(self.shape.arm().chain(), self.shape.limits(), &q);
            let (broken, point_in_base) = self.judge(&q);
            candidates.rejections.count(&broken);
            if broken.iter().all(|broken| !broken) {
                candidates.kept.push(Candidate { configuration: q, point_in_base });
            }
        }
        candidates
    }

    /// As [`Self::collect`], with at least `needed` of them.
    ///
    /// # Errors
    /// Fewer than `needed` were kept.
    pub fn collect_at_least(
        &self,
        configurations: impl IntoIterator<Item = Vec<f64>>,
        enough: usize,
        needed: usize,
    ) -> Result<Candidates, TooFewCandidates> {
        let candidates = self.collect(configurations, enough);
        if candidates.kept.len() < needed {
            return Err(TooFewCandidates { needed, rejections: Box::new(candidates.rejections) });
        }
        Ok(candidates)
    }

    /// The reasons against one configuration, in words; none: it can be measured.
    pub fn reasons(&self, q: &[f64]) -> Vec<String> {
        if q.len() != self.shape.limits().len() {
            return vec![format!("{} joint values for {} joints", q.len(), self.shape.limits().len())];
        }
        let limits = (!self.shape.is_within_limits(q)).then(|| "outside the joint limits".to_owned());
        let obstructions = self.shape.obstructions(q).into_iter().map(|obstruction| obstruction.to_string());
        let links = self.shape.arm().base_from_links(q);
        let hidden: Vec<String> = self.sight.reasons(&links).map(|hidden| hidden.to_string()).collect();
        limits.into_iter().chain(obstructions).chain(hidden).collect()
    }

    fn judge(&self, q: &[f64]) -> ([bool; Rule::ALL.len()], Point3<f64>) {
        let mut broken = [false; Rule::ALL.len()];
        let mut against = |rule: Rule| {
            if let Some(entry) = broken.get_mut(rule as usize) {
                *entry = true;
            }
        };
        if !self.shape.is_within_limits(q) {
            against(Rule::Limits);
        }
        if q.len() != self.shape.limits().len() {
            return (broken, Point3::origin());
        }
        let links = self.shape.arm().base_from_links(q);
        self.shape.for_each_obstruction(&links, |obstruction| against(Rule::of_obstruction(&obstruction)));
        self.sight.reasons(&links).for_each(|hidden| against(Rule::of_hidden(&hidden)));
        (broken, self.sight.point_in_base(&links))
    }
}
