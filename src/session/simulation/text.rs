//! The text form of a fault: `NAME@FIRST[-LAST][:SIZE]`.

use std::fmt;
use std::str::FromStr;

use thiserror::Error;

use super::{Fault, FaultKind};
use crate::text::printable;
use crate::units::Quantity;

/// How each fault is written, the parts in brackets may be missing.
const FORMS: [(&str, &str); 13] = [
    ("wrong-pose", "wrong-pose@FIRST[-LAST]"),
    ("swapped-rows", "swapped-rows@FIRST"),
    ("inch", "inch@FIRST[-LAST]"),
    ("metre", "metre@FIRST[-LAST]"),
    ("joint-sign", "joint-sign@FIRST[-LAST]:jJOINT"),
    ("joint-unit", "joint-unit@FIRST[-LAST]:jJOINT:FACTOR"),
    ("joint-coupling", "joint-coupling@FIRST[-LAST]:jJOINT:jOTHER[:FACTOR]"),
    ("mistyped-joint", "mistyped-joint@FIRST[-LAST]:jJOINT:SIZEdeg (or SIZEmm)"),
    ("target-bumped", "target-bumped@FIRST[-LAST]:SIZEmm"),
    ("not-at-rest", "not-at-rest@FIRST[-LAST]:SIZEmm"),
    ("outlier", "outlier@FIRST[-LAST]:SIZEmm"),
    ("beam-break", "beam-break@FIRST[-LAST]"),
    ("drift", "drift@FIRST[-LAST]:SIZEmm/h"),
];

/// Why a text is not a fault.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[non_exhaustive]
pub enum FaultError {
    /// A name that is not known.
    #[error(
        "'{text}' is not a fault: the name '{name}' is not known; known are {}, written as in 'wrong-pose@12'",
        names()
    )]
    UnknownName {
        /// What was given.
        text: String,
        name: String,
    },
    /// A known name with the wrong parts.
    #[error("'{text}' is not a fault: {reason}; it is written {form}")]
    Form {
        /// What was given.
        text: String,
        /// What is wrong.
        reason: String,
        /// How it is written.
        form: &'static str,
    },
}

fn names() -> String {
    FORMS.map(|(name, _)| name).join(", ")
}

impl FaultKind {
    /// The name in the text form.
    pub const fn name(&self) -> &'static str {
        match self {
            Self::WrongPose => "wrong-pose",
            Self::SwappedRows => "swapped-rows",
            Self::Inch => "inch",
            Self::Metre => "metre",
            Self::JointSign { .. } => "joint-sign",
            Self::JointUnit { .. } => "joint-unit",
            Self::JointCoupling { .. } => "joint-coupling",
            Self::MistypedJoint { .. } => "mistyped-joint",
            Self::TargetBumped { .. } => "target-bumped",
            Self::NotAtRest { .. } => "not-at-rest",
            Self::Outlier { .. } => "outlier",
            Self::BeamBreak => "beam-break",
            Self::Drift { .. } => "drift",
        }
    }
}

/// `wrong-pose@12`, `mistyped-joint@8:j2:5deg`, `beam-break@7-9`: what [`FromStr`] reads.
impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}@{}", self.kind.name(), self.first)?;
        if let Some(last) = self.last {
            write!(f, "-{last}")?;
        }
        match self.kind {
            FaultKind::JointSign { joint } => write!(f, ":j{}", joint.saturating_add(1)),
            FaultKind::JointUnit { joint, factor } => write!(f, ":j{}:{factor}", joint.saturating_add(1)),
            FaultKind::JointCoupling { joint, with, factor } => {
                write!(f, ":j{}:j{}:{factor}", joint.saturating_add(1), with.saturating_add(1))
            }
            FaultKind::MistypedJoint { joint, by, quantity } => {
                write!(f, ":j{}:{by}{}", joint.saturating_add(1), quantity.unit())
            }
            FaultKind::TargetBumped { by_mm } | FaultKind::NotAtRest { by_mm } | FaultKind::Outlier { by_mm } => {
                write!(f, ":{by_mm}mm")
            }
            FaultKind::Drift { mm_per_hour } => write!(f, ":{mm_per_hour}mm/h"),
            FaultKind::WrongPose
            | FaultKind::SwappedRows
            | FaultKind::Inch
            | FaultKind::Metre
            | FaultKind::BeamBreak => Ok(()),
        }
    }
}

impl From<Fault> for String {
    fn from(fault: Fault) -> Self {
        fault.to_string()
    }
}

impl TryFrom<String> for Fault {
    type Error = FaultError;

    fn try_from(text: String) -> Result<Self, Self::Error> {
        text.parse()
    }
}

impl FromStr for Fault {
    type Err = FaultError;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let text = text.trim();
        let (name, rest) = text.split_once('@').unwrap_or((text, ""));
        let name = name.trim();
        let Some((_, form)) = FORMS.iter().find(|(known, _)| *known == name) else {
            return Err(FaultError::UnknownName { text: printable(text), name: printable(name) });
        };
        read(name, rest).map_err(|reason| FaultError::Form { text: printable(text), reason: printable(&reason), form })
    }
}

/// Reads what follows `@`.
fn read(name: &str, rest: &str) -> Result<Fault, String> {
    let mut parts = rest.split(':').map(str::trim);
    let when = parts.next().unwrap_or_default();
    if when.is_empty() {
        return Err("the number of the measurement is missing".to_owned());
    }
    let (first, last) = match when.split_once('-') {
        Some((first, last)) => (number(first)?, Some(number(last)?)),
        None => (number(when)?, None),
    };
    if last.is_some_and(|last| last < first) {
        return Err(format!("the last measurement of '{when}' comes before the first"));
    }
    let kind = match name {
        "wrong-pose" => FaultKind::WrongPose,
        "swapped-rows" if last.is_some() => return Err("it is two measurements, FIRST and the next one".to_owned()),
        "swapped-rows" => FaultKind::SwappedRows,
        "inch" => FaultKind::Inch,
        "metre" => FaultKind::Metre,
        "beam-break" => FaultKind::BeamBreak,
        "joint-sign" => FaultKind::JointSign { joint: joint(parts.next())? },
        "joint-unit" => {
            let joint = joint(parts.next())?;
            FaultKind::JointUnit { joint, factor: factor(parts.next().ok_or("the factor is missing")?)? }
        }
        "joint-coupling" => {
            let (joint, with) = (joint(parts.next())?, joint(parts.next())?);
            if joint == with {
                return Err("a joint moves with another one, not with itself".to_owned());
            }
            let factor = parts.next().map_or(Ok(1.0), factor)?;
            FaultKind::JointCoupling { joint, with, factor }
        }
        "mistyped-joint" => {
            let joint = joint(parts.next())?;
            let (by, quantity) = joint_step(parts.next())?;
            FaultKind::MistypedJoint { joint, by, quantity }
        }
        "target-bumped" => FaultKind::TargetBumped { by_mm: positive(parts.next(), "mm")? },
        "not-at-rest" => FaultKind::NotAtRest { by_mm: positive(parts.next(), "mm")? },
        "outlier" => FaultKind::Outlier { by_mm: positive(parts.next(), "mm")? },
        "drift" => FaultKind::Drift { mm_per_hour: positive(parts.next(), "mm/h")? },
        _ => return Err(format!("'{name}' cannot be read")),
    };
    match parts.next() {
        Some(extra) => Err(format!("'{extra}' is too much")),
        None => Ok(Fault { kind, first, last }),
    }
}

/// The number of a measurement.
fn number(text: &str) -> Result<u64, String> {
    let number = text.trim().parse().ok().filter(|number| *number >= 1);
    number.ok_or_else(|| format!("'{}' is not the number of a measurement (1, 2, 3, …)", text.trim()))
}

/// `j3`: the index 2.
fn joint(text: Option<&str>) -> Result<usize, String> {
    let text = text.ok_or("the joint is missing (j1, j2, …)")?;
    let number = text.strip_prefix(['j', 'J']).and_then(|number| number.parse::<usize>().ok());
    number.and_then(|number| number.checked_sub(1)).ok_or_else(|| format!("'{text}' is not a joint (j1, j2, …)"))
}

/// `57.3`, `-1`: a factor other than zero.
fn factor(text: &str) -> Result<f64, String> {
    let factor = text.parse::<f64>().ok().filter(|factor| factor.is_finite() && *factor != 0.0);
    factor.ok_or_else(|| format!("'{text}' is not a factor (57.3, -1, …)"))
}

/// `5deg`, `-2.5mm`: a size other than zero and what it measures.
fn joint_step(text: Option<&str>) -> Result<(f64, Quantity), String> {
    let text = text.ok_or("the size is missing (such as 5deg)")?;
    [Quantity::Angle, Quantity::Length]
        .into_iter()
        .find_map(|quantity| Some((size(text.strip_suffix(quantity.unit())?)?, quantity)))
        .ok_or_else(|| format!("'{text}' is not a size in deg or mm other than zero"))
}

/// A positive size before its unit.
fn positive(text: Option<&str>, unit: &str) -> Result<f64, String> {
    let text = text.ok_or_else(|| format!("the size is missing (such as 2{unit})"))?;
    let value = text.strip_suffix(unit).and_then(size).filter(|value| *value > 0.0);
    value.ok_or_else(|| format!("'{text}' is not a positive size in {unit}"))
}

fn size(text: &str) -> Option<f64> {
    text.trim().parse().ok().filter(|value: &f64| value.is_finite() && value.abs() > 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::session::simulation::Simulation;

    #[test]
    fn every_example_is_read_and_written_back() {
        for text in [
            "wrong-pose@12",
            "swapped-rows@9",
            "inch@1",
            "metre@1",
            "joint-sign@1:j3",
            "mistyped-joint@8:j2:5deg",
            "mistyped-joint@8:j3:-2.5mm",
            "target-bumped@20:5mm",
            "not-at-rest@6:0.3mm",
            "outlier@10:2mm",
            "beam-break@7-9",
            "drift@1:0.2mm/h",
            "drift@3-30:0.1mm/h",
        ] {
            let fault: Fault = text.parse().unwrap();
            assert_eq!(fault.to_string(), text);
            assert_eq!(Fault::try_from(String::from(fault.clone())).unwrap(), fault);
        }
        let spaced: Fault = " mistyped-joint @ 8 : J2 : 5 deg ".parse().unwrap();
        assert_eq!(spaced.to_string(), "mistyped-joint@8:j2:5deg");
        for (name, _) in FORMS {
            let [a, b, c] = ["", ":j2", ":1mm"].map(|size| format!("{name}@2{size}").parse::<Fault>());
            let others =
                [":j2:1deg", ":1mm/h", ":j2:2.5", ":j2:j3"].map(|size| format!("{name}@2{size}").parse::<Fault>());
            let read: Vec<Fault> = [a, b, c].into_iter().chain(others).flatten().collect();
            assert!(read.len() == 1 && read[0].kind.name() == name, "{name}: {read:?}");
        }
    }

    #[test]
    fn messages_name_what_is_known_and_how_it_is_written() {
        let message = |text: &str| text.parse::<Fault>().unwrap_err().to_string();
        insta::assert_snapshot!(
            [
                "wrongpose@12",
                "",
                "\u{1b}[2J@1",
                "outlier",
                "outlier@0:2mm",
                "outlier@10",
                "outlier@10:-2mm",
                "outlier@10:2",
                "beam-break@9-7",
                "beam-break@7-9:1mm",
                "swapped-rows@9-11",
                "joint-sign@1:j0",
                "mistyped-joint@8:j2",
                "mistyped-joint@8:j2:5rad",
                "drift@1:0.2mm",
                "drift@1:NaNmm/h",
            ]
            .map(message)
            .join("\n"),
            @r#"
            'wrongpose@12' is not a fault: the name 'wrongpose' is not known; known are wrong-pose, swapped-rows, inch, metre, joint-sign, joint-unit, joint-coupling, mistyped-joint, target-bumped, not-at-rest, outlier, beam-break, drift, written as in 'wrong-pose@12'
            '' is not a fault: the name '' is not known; known are wrong-pose, swapped-rows, inch, metre, joint-sign, joint-unit, joint-coupling, mistyped-joint, target-bumped, not-at-rest, outlier, beam-break, drift, written as in 'wrong-pose@12'
            '�[2J@1' is not a fault: the name '�[2J' is not known; known are wrong-pose, swapped-rows, inch, metre, joint-sign, joint-unit, joint-coupling, mistyped-joint, target-bumped, not-at-rest, outlier, beam-break, drift, written as in 'wrong-pose@12'
            'outlier' is not a fault: the number of the measurement is missing; it is written outlier@FIRST[-LAST]:SIZEmm
            'outlier@0:2mm' is not a fault: '0' is not the number of a measurement (1, 2, 3, …); it is written outlier@FIRST[-LAST]:SIZEmm
            'outlier@10' is not a fault: the size is missing (such as 2mm); it is written outlier@FIRST[-LAST]:SIZEmm
            'outlier@10:-2mm' is not a fault: '-2mm' is not a positive size in mm; it is written outlier@FIRST[-LAST]:SIZEmm
            'outlier@10:2' is not a fault: '2' is not a positive size in mm; it is written outlier@FIRST[-LAST]:SIZEmm
            'beam-break@9-7' is not a fault: the last measurement of '9-7' comes before the first; it is written beam-break@FIRST[-LAST]
            'beam-break@7-9:1mm' is not a fault: '1mm' is too much; it is written beam-break@FIRST[-LAST]
            'swapped-rows@9-11' is not a fault: it is two measurements, FIRST and the next one; it is written swapped-rows@FIRST
            'joint-sign@1:j0' is not a fault: 'j0' is not a joint (j1, j2, …); it is written joint-sign@FIRST[-LAST]:jJOINT
            'mistyped-joint@8:j2' is not a fault: the size is missing (such as 5deg); it is written mistyped-joint@FIRST[-LAST]:jJOINT:SIZEdeg (or SIZEmm)
            'mistyped-joint@8:j2:5rad' is not a fault: '5rad' is not a size in deg or mm other than zero; it is written mistyped-joint@FIRST[-LAST]:jJOINT:SIZEdeg (or SIZEmm)
            'drift@1:0.2mm' is not a fault: '0.2mm' is not a positive size in mm/h; it is written drift@FIRST[-LAST]:SIZEmm/h
            'drift@1:NaNmm/h' is not a fault: 'NaNmm/h' is not a positive size in mm/h; it is written drift@FIRST[-LAST]:SIZEmm/h
            "#
        );
    }

    #[test]
    fn faults_of_the_set_up_last_and_slips_happen_once() {
        let numbers = |text: &str| -> Vec<u64> {
            let fault: Fault = text.parse().unwrap();
            (1..=6).filter(|number| fault.affects(*number)).collect()
        };
        assert_eq!(numbers("inch@4"), [4, 5, 6]);
        assert_eq!(numbers("target-bumped@5:1mm"), [5, 6]);
        assert_eq!(numbers("joint-sign@2-3:j1"), [2, 3]);
        assert_eq!(numbers("wrong-pose@4"), [4]);
        assert_eq!(numbers("beam-break@2-4"), [2, 3, 4]);
    }

    #[test]
    fn a_simulation_is_written_in_words() {
        let text = r#"(seed: 7, noise_mm: Some(0.02), faults: ["inch@1", "outlier@3:2mm"])"#;
        let simulation: Simulation = ron::from_str(text).unwrap();
        assert_eq!((simulation.seed, simulation.faults.len()), (7, 2));
        let again: Simulation = ron::from_str(&ron::to_string(&simulation).unwrap()).unwrap();
        assert_eq!(again, simulation);
        let wrong = ron::from_str::<Simulation>(r#"(faults: ["inch"])"#).unwrap_err().to_string();
        assert!(wrong.contains("inch@FIRST[-LAST]"), "{wrong}");
    }
}
