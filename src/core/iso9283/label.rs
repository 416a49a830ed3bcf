//! The names of the poses of a test in plans and tables.

use std::fmt;
use std::str::FromStr;

use thiserror::Error;

use super::POSES;

/// A visit of a pose: `c07-P3`, or `c07-P3b` where it is approached from several directions.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Label {
    /// Number of the cycle, from 1.
    pub cycle: usize,
    /// Number of the pose, from 1.
    pub pose: usize,
    /// Direction of approach, from 1; none where there is only one.
    pub direction: Option<usize>,
}

/// Directions of approach of the multi-directional test.
pub const DIRECTIONS: usize = 3;

/// A name that is none of a test.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[error("'{0}' is not a pose of the test; its names read like 'c07-P3', or 'c07-P3b' with the direction of approach")]
pub struct UnknownLabel(String);

impl fmt::Display for Label {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "c{:02}-P{}", self.cycle, self.pose)?;
        let letter = self.direction.and_then(|direction| char::from_digit(u32::try_from(9 + direction).ok()?, 36));
        letter.map_or(Ok(()), |letter| write!(f, "{letter}"))
    }
}

impl FromStr for Label {
    type Err = UnknownLabel;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let read = || {
            let (cycle, pose) = text.trim().strip_prefix(['c', 'C'])?.split_once('-')?;
            let mut pose = pose.strip_prefix(['P', 'p'])?.chars();
            let number = pose.next()?.to_digit(10)? as usize;
            let direction = match pose.next() {
                None => None,
                Some(letter) => Some((letter.to_digit(36)? as usize).checked_sub(9)?),
            };
            let label = Self { cycle: cycle.parse().ok()?, pose: number, direction };
            let is_known = label.cycle > 0
                && (1..=POSES).contains(&number)
                && direction.is_none_or(|direction| (1..=DIRECTIONS).contains(&direction))
                && pose.next().is_none();
            is_known.then_some(label)
        };
        read().ok_or_else(|| UnknownLabel(crate::text::printable(text)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_read_back() {
        for label in [
            Label { cycle: 7, pose: 3, direction: None },
            Label { cycle: 30, pose: 1, direction: Some(2) },
            Label { cycle: 130, pose: 5, direction: Some(3) },
        ] {
            assert_eq!(label.to_string().parse(), Ok(label));
        }
        assert_eq!(Label { cycle: 7, pose: 3, direction: Some(2) }.to_string(), "c07-P3b");
        for wrong in ["", "P3", "c0-P1", "c1-P6", "c1-P1d", "c1-P1bb", "c1-Q1", "c-P1", "c1-P", "17"] {
            assert!(wrong.parse::<Label>().is_err(), "{wrong}");
        }
    }
}
