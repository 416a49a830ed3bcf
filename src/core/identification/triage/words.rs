//! A finding in words that a technician understands: what, how sure, what to do.

use super::super::RejectionReason;
use super::{Cause, Explanation, Finding};
use crate::units::{Quantity, to_mm};

/// A second explanation this likely deserves an "or" in the first sentence.
const EITHER: f64 = 0.1;
/// A first explanation this likely needs no "perhaps".
const SURE: f64 = 0.9;
/// Beyond this many times the expected deviation the number says nothing.
const NOT_AT_ALL: f64 = 1000.0;

/// How samples, planned poses and joints are called on the screen.
pub struct Names<'a> {
    /// Name of a sample by its index.
    pub sample: &'a dyn Fn(usize) -> String,
    /// Name of a planned pose by its index.
    pub pose: &'a dyn Fn(usize) -> String,
    /// Name of a joint by its index.
    pub joint: &'a dyn Fn(usize) -> String,
}

impl std::fmt::Debug for Names<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Names")
    }
}

impl Finding {
    /// Whether other explanations are nearly as good.
    pub fn is_ambiguous(&self) -> bool {
        self.alternatives.first().is_some_and(|other| other.share > EITHER)
    }

    /// Samples that may be to blame, the likeliest first.
    pub fn suspects(&self) -> Vec<usize> {
        let mut suspects = vec![self.sample];
        for other in &self.alternatives {
            if other.share > EITHER && !suspects.contains(&other.sample) {
                suspects.push(other.sample);
            }
        }
        suspects
    }

    /// What is wrong, how sure that is, and what to do.
    pub fn describe(&self, names: &Names<'_>) -> String {
        let sample = (names.sample)(self.sample);
        if let Cause::NotAtRest { scatter } = self.cause {
            return format!(
                "{sample}: the shots scatter by {:.3} mm, {:.0} times what the instrument does: the robot was not at rest; wait until it stands still and measure again",
                to_mm(scatter),
                self.ratio
            );
        }
        let suspects = self.suspects();
        if suspects.len() > 2 {
            let listed: Vec<String> = suspects.iter().map(|&sample| (names.sample)(sample)).collect();
            return format!(
                "the distances do not fit ({}), but it cannot be told yet which of {} is wrong: the next point will tell; most likely {}",
                self.how_far(names),
                listed.join(", "),
                self.story(self.sample, &self.cause, names)
            );
        }
        let others = self.alternatives.iter().filter(|other| other.share > EITHER);
        let mut stories = vec![self.story(self.sample, &self.cause, names)];
        for Explanation { sample, cause, .. } in others {
            let told = self.story(*sample, cause, names);
            if !stories.contains(&told) {
                stories.push(told);
            }
        }
        if self.is_early && self.cause == Cause::Unexplained && self.typed.is_none() && stories.len() == 1 {
            stories.push(format!(
                "{sample} was taken at a pose that comes later (two poses exchanged), which cannot be told from a bad reading yet"
            ));
        }
        let told = match stories.as_slice() {
            [only] if self.share >= SURE => only.clone(),
            [only] => format!("most likely {only}"),
            stories => format!("either {}", stories.join(", or ")),
        };
        // How many thousand times too far says nothing more.
        let fit = if self.ratio > NOT_AT_ALL { "does not fit at all" } else { "does not fit" };
        format!("{sample} {fit} ({}): {told}; {}", self.how_far(names), self.advice(names))
    }

    fn story(&self, sample: usize, cause: &Cause, names: &Names<'_>) -> String {
        let typed = self.typed.filter(|_| sample == self.sample && *cause == Cause::Unexplained);
        typed
            .and_then(|typed| typed_story(typed, &(names.sample)(sample)))
            .unwrap_or_else(|| story(sample, cause, names))
    }

    fn advice(&self, names: &Names<'_>) -> String {
        if self.cause == Cause::Unexplained && self.typed.is_some() {
            return "compare the coordinates with the display of the instrument, or measure it again".to_owned();
        }
        advice(&self.cause, names)
    }

    fn how_far(&self, names: &Names<'_>) -> String {
        let ratio = match self.ratio {
            ratio if ratio > NOT_AT_ALL => format!("more than {NOT_AT_ALL:.0} times the expected deviation"),
            ratio => format!("{ratio:.0} times the expected deviation"),
        };
        match self.worst.first() {
            Some(pair) => {
                let sign = if pair.deviation > 0.0 { "longer" } else { "shorter" };
                let other = (names.sample)(pair.other);
                let (deviation, expected) = (to_mm(pair.deviation.abs()), to_mm(pair.expected));
                format!(
                    "{ratio}; distance to {other} {deviation:.2} mm {sign} than predicted, expected within {expected:.2} mm"
                )
            }
            None => ratio,
        }
    }
}

/// Edge value with sign and unit.
fn amount(by: f64, quantity: Quantity) -> String {
    format!("{:+.2} {}", quantity.to_edge(by), quantity.unit())
}

fn story(sample: usize, cause: &Cause, names: &Names<'_>) -> String {
    let named = (names.sample)(sample);
    match cause {
        Cause::Unit { factor, since } => format!(
            "since {} the coordinates are in another unit (they fit multiplied by {factor:.4}: {})",
            (names.sample)(*since),
            unit_story(*factor)
        ),
        Cause::JointSign { joint } => {
            format!("joint {} turns the other way than the profile says", (names.joint)(*joint))
        }
        Cause::MistypedJoint { joint, by, quantity } => {
            format!("at {named} joint {} stood {} from the value shown", (names.joint)(*joint), amount(*by, *quantity))
        }
        Cause::WrongPose { planned } => format!("{named} was taken at pose {}", (names.pose)(*planned)),
        Cause::StayedAtPrevious => format!("at {named} the robot still stood at the pose before"),
        Cause::SwappedRows { with } => format!("{named} and {} are exchanged", (names.sample)(*with)),
        Cause::TargetMoved { since, by } => {
            format!("the SMR has sat about {:.2} mm elsewhere since {}", to_mm(*by), (names.sample)(*since))
        }
        Cause::InstrumentMoved { since } => format!("the tracker stands elsewhere since {}", (names.sample)(*since)),
        Cause::NotAtRest { .. } => format!("at {named} the robot was not at rest"),
        Cause::Unexplained => format!("the reading of {named} is bad"),
    }
}

/// A slip of the pen in a coordinate of the sample `named`.
fn typed_story(typed: RejectionReason, named: &str) -> Option<String> {
    let name = |axis: usize| ["x", "y", "z"].get(axis).copied().unwrap_or("a coordinate");
    match typed {
        RejectionReason::Sign { axis } => {
            Some(format!("the sign of {} of {named} is wrong (the point fits with the other one)", name(axis)))
        }
        RejectionReason::Digit { axis, by } => {
            let (by, way) = (to_mm(by.abs()), if by > 0.0 { "less" } else { "more" });
            Some(format!("one digit of {} of {named} is wrong (the point fits with {by:.1} mm {way})", name(axis)))
        }
        RejectionReason::Outlier | RejectionReason::SwappedWith(_) => None,
    }
}

fn unit_story(factor: f64) -> &'static str {
    match factor {
        factor if factor > 500.0 => "metres instead of millimetres",
        factor if factor > 30.0 => "metres instead of inches",
        factor if factor > 1.0 => "inches instead of millimetres",
        factor if factor > 0.03 => "millimetres instead of inches",
        factor if factor > 0.01 => "inches instead of metres",
        _ => "millimetres instead of metres",
    }
}

fn advice(cause: &Cause, names: &Names<'_>) -> String {
    match cause {
        Cause::Unit { .. } => {
            "set the unit of the instrument back; what was measured in the other one can be converted".to_owned()
        }
        Cause::JointSign { joint } => {
            format!("check the sign of joint {}, or 'direction' in the profile", (names.joint)(*joint))
        }
        Cause::MistypedJoint { joint, .. } => {
            format!("compare joint {} on the pendant, correct it and measure again", (names.joint)(*joint))
        }
        Cause::WrongPose { .. } | Cause::StayedAtPrevious => "move to the pose shown and measure again".to_owned(),
        Cause::SwappedRows { .. } => "exchange the two points".to_owned(),
        Cause::TargetMoved { since, .. } => format!(
            "check the seat of the SMR; if it has moved, measure again from {} on, or start again",
            (names.sample)(*since)
        ),
        Cause::InstrumentMoved { since } => {
            format!("check the tracker's stand; the points from {} on belong to a new station", (names.sample)(*since))
        }
        Cause::NotAtRest { .. } => "wait until it stands still and measure again".to_owned(),
        Cause::Unexplained => "measure it again, and check the seat of the SMR".to_owned(),
    }
}
