//! The groups of errors that joints can have beside the geometry.

use std::fmt;
use std::str::FromStr;

use clap::ValueEnum;

use crate::kinematics::{FreeParameter, JointTerm, KinematicChain, MAX_ORDER, ParameterId, SMOOTH_ORDERS, TiltAxis};
use crate::text::{UnknownName, written_as_text};
use crate::units::MICRORADIAN;

/// A group of errors of joints. The comments on the values are the help of `--terms`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum TermGroup {
    /// Joints turn in proportion to the gravity torque about them
    Compliance,
    /// Bearings tilt under the gravity moment
    Tilt,
    /// Once and twice per turn
    Harmonics,
    /// 3 to 50 times per turn
    Curves,
}

/// The sizes of joint curves that are tried (rad, rms).
const CURVES: [f64; 5] =
    [50.0 * MICRORADIAN, 100.0 * MICRORADIAN, 150.0 * MICRORADIAN, 250.0 * MICRORADIAN, 400.0 * MICRORADIAN];
/// Names of the groups in a text.
const GEOMETRY: &str = "geometry";
const COMPLIANCE: &str = "compliance";
const TILT: &str = "tilt";
const HARMONICS: &str = "harmonics";
const CURVES_OF: &str = "curves";

/// Which groups of terms the joints have beside the geometry.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Terms {
    /// Turning in proportion to the gravity torque.
    pub compliance: bool,
    /// Bearings that tilt under the gravity moment.
    pub tilt: bool,
    /// The first two harmonics of each joint.
    pub harmonics: bool,
    /// Curves of each joint, of this size (rad, rms).
    pub curves: Option<f64>,
}

impl Terms {
    /// Everything, with curves of the size `curves` (rad, rms).
    pub const fn all(curves: f64) -> Self {
        Self { compliance: true, tilt: true, harmonics: true, curves: Some(curves) }
    }

    /// The candidates from simple to rich; among those of one group, which differ in the size of the curves, the score alone decides.
    pub fn candidates() -> Vec<Vec<Self>> {
        let none = Self::default();
        let compliance = Self { compliance: true, ..none };
        let smooth = Self { tilt: true, harmonics: true, ..compliance };
        vec![
            vec![none],
            vec![compliance],
            vec![Self { tilt: true, ..compliance }],
            vec![Self { harmonics: true, ..compliance }],
            vec![smooth],
            smooth.with_curves(),
        ]
    }

    /// The same terms with curves of every size.
    pub fn with_curves(self) -> Vec<Self> {
        CURVES.map(|size| Self { curves: Some(size), ..self }).to_vec()
    }

    /// These groups alone: one candidate, or with curves one of every size.
    pub fn of_groups(groups: &[TermGroup]) -> Vec<Self> {
        let terms = Self {
            compliance: groups.contains(&TermGroup::Compliance),
            tilt: groups.contains(&TermGroup::Tilt),
            harmonics: groups.contains(&TermGroup::Harmonics),
            curves: None,
        };
        if groups.contains(&TermGroup::Curves) { terms.with_curves() } else { vec![terms] }
    }

    /// Whether there is nothing beside the geometry.
    pub fn is_geometry(&self) -> bool {
        *self == Self::default()
    }

    /// The parameters of these terms that the arm can have, with their expected deviations.
    pub fn parameters(&self, chain: &KinematicChain) -> Vec<FreeParameter> {
        let mut terms = Vec::new();
        if self.compliance {
            terms.push(JointTerm::Compliance);
        }
        if self.tilt {
            terms.extend(TiltAxis::ALL.map(JointTerm::Tilt));
        }
        let first = if self.harmonics { 1 } else { SMOOTH_ORDERS + 1 };
        let last = if self.curves.is_some() { MAX_ORDER } else { SMOOTH_ORDERS };
        terms.extend((first..=last).flat_map(|order| [JointTerm::Sine(order), JointTerm::Cosine(order)]));
        let size = |term: JointTerm| if is_curve(term) { self.curves.unwrap_or(0.0) } else { 1.0 };
        let sized: Vec<(JointTerm, f64)> = terms.into_iter().map(|term| (term, term.expected() * size(term))).collect();
        let of_joint = |joint: usize| {
            let known = sized.iter().filter(move |(term, _)| chain.has_term(joint, *term));
            known.map(move |(term, expected)| FreeParameter {
                id: ParameterId::Joint { joint, term: *term },
                expected: *expected,
            })
        };
        (0..chain.dof()).flat_map(of_joint).collect()
    }

    /// Those of these terms that the arm can have: without masses it has no compliance and no tilt.
    #[must_use]
    pub fn on(self, chain: &KinematicChain) -> Self {
        let has = |term: JointTerm| (0..chain.dof()).any(|joint| chain.has_term(joint, term));
        Self {
            compliance: self.compliance && has(JointTerm::Compliance),
            tilt: self.tilt && has(JointTerm::Tilt(TiltAxis::X)),
            harmonics: self.harmonics && has(JointTerm::Sine(1)),
            curves: self.curves.filter(|_| has(JointTerm::Sine(MAX_ORDER))),
        }
    }

    /// Factor of a term's prior against that of [`Self::all`] with curves of one radian; zero for one that is not there.
    pub(super) fn scale(&self, term: JointTerm) -> f64 {
        let is_there = match term {
            JointTerm::Compliance => self.compliance,
            JointTerm::Tilt(_) => self.tilt,
            JointTerm::Sine(_) | JointTerm::Cosine(_) if is_curve(term) => return self.curves.unwrap_or(0.0),
            JointTerm::Sine(_) | JointTerm::Cosine(_) => self.harmonics,
        };
        if is_there { 1.0 } else { 0.0 }
    }
}

const fn is_curve(term: JointTerm) -> bool {
    match term {
        JointTerm::Compliance | JointTerm::Tilt(_) => false,
        JointTerm::Sine(order) | JointTerm::Cosine(order) => order > SMOOTH_ORDERS,
    }
}

written_as_text!(Terms);

/// `geometry + compliance + tilt + harmonics + curves 100 urad`.
impl fmt::Display for Terms {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(GEOMETRY)?;
        let groups = [(self.compliance, COMPLIANCE), (self.tilt, TILT), (self.harmonics, HARMONICS)];
        for (_, name) in groups.into_iter().filter(|(is_there, _)| *is_there) {
            write!(f, " + {name}")?;
        }
        match self.curves {
            Some(size) => write!(f, " + {CURVES_OF} {:.0} urad", size / MICRORADIAN),
            None => Ok(()),
        }
    }
}

impl FromStr for Terms {
    type Err = UnknownName;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let mut terms = Self::default();
        for group in text.split('+').map(str::trim) {
            let size = group.strip_prefix(CURVES_OF).and_then(|rest| rest.trim().strip_suffix("urad"));
            match (group, size.map(|size| size.trim().parse::<f64>())) {
                (GEOMETRY, _) => {}
                (COMPLIANCE, _) => terms.compliance = true,
                (TILT, _) => terms.tilt = true,
                (HARMONICS, _) => terms.harmonics = true,
                (_, Some(Ok(size))) if size.is_finite() && size > 0.0 => terms.curves = Some(size * MICRORADIAN),
                _ => return Err(UnknownName::new(group, &[GEOMETRY, COMPLIANCE, TILT, HARMONICS, "curves N urad"])),
            }
        }
        Ok(terms)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texts_come_back() {
        for terms in Terms::candidates().into_iter().flatten() {
            let read: Terms = terms.to_string().parse().unwrap();
            let same_curves = match (read.curves, terms.curves) {
                (Some(read), Some(written)) => (read - written).abs() < 1e-12,
                (read, written) => read == written,
            };
            assert!(same_curves && Terms { curves: None, ..read } == Terms { curves: None, ..terms }, "{terms}");
        }
        assert!("geometry + wobble".parse::<Terms>().is_err());
        assert!("geometry + curves -3 urad".parse::<Terms>().is_err());
    }
}
