//! Schedule of a simulator's faults: on which of its occasions, counted from 1, a fault occurs.
//!
//! The description of each fault states its occasion, such as a connection, a measurement or a data packet. As text a planned
//! fault is `name` (the first occasion), `name@3` (the third), `name@3x2` (the third and fourth) or `name@1x*` (always).

use std::fmt::{self, Debug, Display};
use std::str::FromStr;

use thiserror::Error;

/// Defines an enumeration of faults with names and descriptions.
macro_rules! faults {
    ($(#[$doc:meta])* $vis:vis $name:ident { $($variant:ident $text:literal $words:literal,)* }) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        $vis enum $name {
            $(#[doc = $words] $variant,)*
        }

        impl $name {
            /// All faults.
            $vis const ALL: &[Self] = &[$(Self::$variant),*];

            $vis const fn name(self) -> &'static str {
                match self {
                    $(Self::$variant => $text,)*
                }
            }

            /// Effect of the fault.
            $vis const fn description(self) -> &'static str {
                match self {
                    $(Self::$variant => $words,)*
                }
            }
        }

        impl std::fmt::Display for $name {
            fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.write_str(self.name())
            }
        }

        impl std::str::FromStr for $name {
            type Err = $crate::link::simulator::fault::FaultError;

            fn from_str(text: &str) -> Result<Self, Self::Err> {
                let known = Self::ALL.iter().copied().find(|fault| fault.name() == text);
                known.ok_or_else(|| $crate::link::simulator::fault::FaultError::Unknown {
                    name: text.to_owned(),
                    known: Self::ALL.iter().map(|fault| fault.name()).collect::<Vec<_>>().join(", "),
                })
            }
        }
    };
}
pub(crate) use faults;

/// Why a text is not a planned fault.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub enum FaultError {
    /// Unknown fault.
    #[error("there is no fault '{name}'; faults: {known}")]
    Unknown { name: String, known: String },
    /// The text after the `@` cannot be read.
    #[error("cannot read the occasions '{0}'; write name@first or name@firstxtimes, such as drip@2x3 or drip@1x*")]
    Occasions(String),
}

/// A fault with the occasions on which it occurs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Planned<F> {
    pub fault: F,
    /// First occasion, counted from 1.
    pub first: u32,
    /// Number of occasions; `u32::MAX` for all.
    pub times: u32,
}

impl<F> Planned<F> {
    /// Occurs on the first occasion only.
    pub const fn once(fault: F) -> Self {
        Self { fault, first: 1, times: 1 }
    }

    /// Occurs once, on this occasion.
    pub const fn at(fault: F, first: u32) -> Self {
        Self { fault, first, times: 1 }
    }

    /// Occurs on every occasion.
    pub const fn always(fault: F) -> Self {
        Self { fault, first: 1, times: u32::MAX }
    }

    /// Occurs on consecutive occasions.
    pub const fn from(fault: F, first: u32, times: u32) -> Self {
        Self { fault, first, times }
    }

    /// Whether it occurs on this occasion, counted from 1.
    const fn is_due(&self, occasion: u32) -> bool {
        occasion >= self.first && occasion - self.first < self.times
    }
}

impl<F: Display> Display for Planned<F> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match (self.first, self.times) {
            (1, 1) => write!(f, "{}", self.fault),
            (first, 1) => write!(f, "{}@{first}", self.fault),
            (first, u32::MAX) => write!(f, "{}@{first}x*", self.fault),
            (first, times) => write!(f, "{}@{first}x{times}", self.fault),
        }
    }
}

impl<F: FromStr<Err = FaultError>> FromStr for Planned<F> {
    type Err = FaultError;

    fn from_str(text: &str) -> Result<Self, FaultError> {
        let Some((name, occasions)) = text.split_once('@') else { return Ok(Self::once(text.parse()?)) };
        let unreadable = || FaultError::Occasions(occasions.to_owned());
        let count = |text: &str| text.parse::<u32>().ok().filter(|count| *count > 0).ok_or_else(unreadable);
        let (first, times) = match occasions.split_once('x') {
            None => (count(occasions)?, 1),
            Some((first, "*")) => (count(first)?, u32::MAX),
            Some((first, times)) => (count(first)?, count(times)?),
        };
        Ok(Self { fault: name.parse()?, first, times })
    }
}

/// Planned faults, each with the number of its past occasions.
#[derive(Clone, Debug, Default)]
pub struct FaultPlan<F> {
    faults: Vec<(Planned<F>, u32)>,
}

impl<F: Copy + PartialEq> FaultPlan<F> {
    /// A plan without past occasions.
    pub fn new(faults: impl IntoIterator<Item = Planned<F>>) -> Self {
        Self { faults: faults.into_iter().map(|planned| (planned, 0)).collect() }
    }

    /// Counts an occasion of a fault and returns whether the fault occurs.
    pub fn strikes(&mut self, fault: F) -> bool {
        let mut strikes = false;
        for (planned, passed) in self.faults.iter_mut().filter(|(planned, _)| planned.fault == fault) {
            *passed = passed.saturating_add(1);
            strikes |= planned.is_due(*passed);
        }
        strikes
    }

    /// Counts an occasion of several faults and returns the first one that occurs.
    pub fn occasion(&mut self, could: impl Fn(F) -> bool) -> Option<F> {
        let mut due = None;
        for (planned, passed) in self.faults.iter_mut().filter(|(planned, _)| could(planned.fault)) {
            *passed = passed.saturating_add(1);
            if due.is_none() && planned.is_due(*passed) {
                due = Some(planned.fault);
            }
        }
        due
    }
}

#[cfg(test)]
mod tests {
    use super::super::ascii::AsciiFault;
    use super::super::emscon::EmsconFault;
    use super::super::geocom::GeocomFault;
    use super::super::ndi::NdiFault;
    use super::super::rtde::RtdeFault;
    use super::*;

    faults! {
        /// For the tests.
        Example {
            Drip "drip" "Single bytes.",
            CutOff "cut-20" "Cuts.",
        }
    }

    #[test]
    fn a_planned_fault_reads_back_from_its_text() {
        let plans = [
            Planned::once(Example::Drip),
            Planned::always(Example::CutOff),
            Planned::from(Example::Drip, 3, 2),
            Planned::from(Example::Drip, 7, 1),
        ];
        assert_eq!(plans.map(|plan| plan.to_string()), ["drip", "cut-20@1x*", "drip@3x2", "drip@7"]);
        for plan in plans {
            assert_eq!(plan.to_string().parse(), Ok(plan));
        }
    }

    #[test]
    fn an_unknown_fault_is_refused_with_the_known_names() {
        let refused = |text: &str| text.parse::<Planned<Example>>().unwrap_err().to_string();
        assert_eq!(refused("drop"), "there is no fault 'drop'; faults: drip, cut-20");
        for text in ["drip@", "drip@0", "drip@1x", "drip@1x0", "drip@x2", "drip@-1", "drip@1x2x3"] {
            assert!(refused(text).starts_with("cannot read the occasions"), "{text}");
        }
    }

    #[test]
    fn every_fault_has_its_own_name_and_a_description() {
        fn check<F: Copy + Debug + PartialEq + FromStr>(
            faults: &[F],
            name: fn(F) -> &'static str,
            description: fn(F) -> &'static str,
        ) {
            for fault in faults {
                let is_name = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '-';
                assert!(name(*fault).chars().all(is_name), "{fault:?}");
                assert!(description(*fault).ends_with('.'), "{fault:?}");
                assert_eq!(name(*fault).parse().ok(), Some(*fault));
            }
        }
        check(EmsconFault::ALL, EmsconFault::name, EmsconFault::description);
        check(AsciiFault::ALL, AsciiFault::name, AsciiFault::description);
        check(GeocomFault::ALL, GeocomFault::name, GeocomFault::description);
        check(NdiFault::ALL, NdiFault::name, NdiFault::description);
        check(RtdeFault::ALL, RtdeFault::name, RtdeFault::description);
        check(Example::ALL, Example::name, Example::description);
    }

    #[test]
    fn a_fault_occurs_on_its_occasions_only() {
        let mut plan = FaultPlan::new(vec![Planned::from(Example::Drip, 2, 2), Planned::from(Example::Drip, 6, 1)]);
        let strikes: Vec<bool> = (0..7).map(|_| plan.strikes(Example::Drip)).collect();
        assert_eq!(strikes, [false, true, true, false, false, true, false]);
        assert!(!plan.strikes(Example::CutOff));
    }

    #[test]
    fn an_occasion_of_several_faults_counts_for_each_and_the_first_one_occurs() {
        let mut plan = FaultPlan::new([Planned::at(Example::Drip, 2), Planned::at(Example::CutOff, 2)]);
        assert_eq!(plan.occasion(|_| true), None);
        assert_eq!(plan.occasion(|fault| fault == Example::CutOff), Some(Example::CutOff));
        assert_eq!(plan.occasion(|_| true), Some(Example::Drip));
        assert_eq!(plan.occasion(|_| true), None);
    }
}
