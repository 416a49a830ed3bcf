//! When a simulated instrument misbehaves: named faults that begin at a counted occasion and end after some more.

use std::fmt;
use std::str::FromStr;

/// A kind of fault that has a name.
pub trait NamedFault: Copy + PartialEq + fmt::Debug + 'static {
    /// All faults of the kind.
    const ALL: &'static [Self];

    /// Its name, in lower case with hyphens.
    fn name(self) -> &'static str;

    /// Finds it by its name.
    fn find(name: &str) -> Result<Self, String> {
        Self::ALL.iter().copied().find(|fault| fault.name() == name).ok_or_else(|| {
            let known: Vec<&str> = Self::ALL.iter().map(|fault| fault.name()).collect();
            format!("no fault is called `{name}`; there are: {}", known.join(", "))
        })
    }
}

/// A fault with its time: written `name@from xtimes`, such as `not-a-number@3x2` for the third and fourth occasion.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Scheduled<F> {
    /// What goes wrong.
    pub fault: F,
    /// First occasion at which it does, counted from 1.
    pub from: u32,
    /// At how many occasions.
    pub times: u32,
}

impl<F> Scheduled<F> {
    /// Once, at an occasion counted from 1.
    pub const fn once(fault: F, from: u32) -> Self {
        Self { fault, from, times: 1 }
    }
}

impl<F: NamedFault> fmt::Display for Scheduled<F> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}@{}x{}", self.fault.name(), self.from, self.times)
    }
}

impl<F: NamedFault> FromStr for Scheduled<F> {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (name, when) = text.split_once('@').unwrap_or((text, "1"));
        let (from, times) = when.split_once('x').unwrap_or((when, "1"));
        let count = |digits: &str| match digits.parse::<u32>() {
            Ok(count) if count > 0 => Ok(count),
            _ => Err(format!("`{digits}` in `{text}` is not a count from 1 on; write it like `{name}@3x2`")),
        };
        Ok(Self { fault: F::find(name)?, from: count(from)?, times: count(times)? })
    }
}

/// The faults of one simulator, each with the number of occasions that it has seen.
#[derive(Clone, Debug)]
pub struct FaultPlan<F> {
    faults: Vec<(Scheduled<F>, u32)>,
}

impl<F: NamedFault> FaultPlan<F> {
    /// Nothing has happened yet.
    pub fn new(faults: impl IntoIterator<Item = Scheduled<F>>) -> Self {
        Self { faults: faults.into_iter().map(|fault| (fault, 0)).collect() }
    }

    /// An occasion at which some faults could happen; the first that is due.
    pub fn occasion(&mut self, could: impl Fn(F) -> bool) -> Option<F> {
        let mut due = None;
        for (scheduled, seen) in self.faults.iter_mut().filter(|(scheduled, _)| could(scheduled.fault)) {
            *seen = seen.saturating_add(1);
            let is_due = *seen >= scheduled.from && *seen - scheduled.from < scheduled.times;
            if is_due && due.is_none() {
                due = Some(scheduled.fault);
            }
        }
        due
    }
}

/// Writes `Display` and `FromStr` of a kind of fault by its names.
macro_rules! text_of_faults {
    ($kind:ty) => {
        impl std::fmt::Display for $kind {
            fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.write_str($crate::link::simulator::fault::NamedFault::name(*self))
            }
        }

        impl std::str::FromStr for $kind {
            type Err = String;

            fn from_str(name: &str) -> Result<Self, String> {
                $crate::link::simulator::fault::NamedFault::find(name)
            }
        }
    };
}
pub(super) use text_of_faults;

#[cfg(test)]
mod tests;
