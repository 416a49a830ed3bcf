//! Warnings about results: what to read before the numbers.

use std::fmt;

use serde::{Deserialize, Serialize};

use super::advice::Advice;

macro_rules! codes {
    ($($(#[$doc:meta])* $variant:ident => $name:literal,)*) => {
        /// Kind of a [`Warning`]; its name in files and messages is stable.
        #[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
        #[serde(from = "String", into = "String")]
        pub enum WarningCode {
            $($(#[$doc])* $variant,)*
            /// One that another version of this program wrote.
            Other(String),
        }

        impl WarningCode {
            /// The name in files and messages.
            pub fn as_str(&self) -> &str {
                match self {
                    $(Self::$variant => $name,)*
                    Self::Other(name) => name,
                }
            }
        }

        impl From<String> for WarningCode {
            fn from(name: String) -> Self {
                match name.as_str() {
                    $($name => Self::$variant,)*
                    _ => Self::Other(name),
                }
            }
        }
    };
}

codes! {
    /// The points to verify come from another set-up than the calibration.
    AnotherSetUp => "another_set_up",
    /// A move of the plan was found to hit something.
    BlockedMove => "blocked_move",
    /// The calibration that is verified was not acceptable.
    CalibrationNotAcceptable => "calibration_not_acceptable",
    /// A calibration has changed since this program wrote it.
    ChangedCalibration => "changed_calibration",
    /// A table has changed since this program wrote it.
    ChangedTable => "changed_table",
    /// A joint was not measured over its range.
    Coverage => "coverage",
    /// The identified arm does not describe the data.
    DoesNotFit => "does_not_fit",
    /// A few points to verify are far off.
    FarVerificationSamples => "far_verification_samples",
    /// So few points leave little to judge by.
    FewData => "few_data",
    /// So few points to verify say little.
    FewVerificationSamples => "few_verification_samples",
    /// The points cannot be of this robot with these joint angles.
    Implausible => "implausible",
    /// Configurations beyond the limits of the joints.
    JointLimits => "joint_limits",
    /// A parameter is far from nominal in spite of the prior.
    LargeDeviation => "large_deviation",
    /// New points contradict the calibration that an identification began with.
    EarlierDoesNotFit => "earlier_does_not_fit",
    /// Points that the operator excluded.
    LeftOut => "left_out",
    /// Acceptance limits that were set when a result had been seen.
    LimitsSetLate => "limits_set_late",
    /// So many points were rejected that nothing consistent is left.
    ManyRejected => "many_rejected",
    /// Nothing states a length.
    NoScale => "no_scale",
    /// Nothing is known about the instrument's accuracy.
    NoSigma => "no_sigma",
    /// The identified arm is no better than the nominal one.
    NotBetter => "not_better",
    /// Moves that nothing could check for collisions.
    NotChecked => "not_checked",
    /// The solver stopped before its result had settled.
    NotConverged => "not_converged",
    /// Poses that should be in a plan and are not.
    NotIncluded => "not_included",
    /// Points to verify that the identification used.
    NotIndependent => "not_independent",
    /// Poses at which the instrument cannot measure.
    NotMeasurable => "not_measurable",
    /// Only joint zeros were identified.
    OffsetsOnly => "offsets_only",
    /// All poses have the arm in one configuration.
    OneArmConfiguration => "one_arm_configuration",
    /// The poses move one joint at a time.
    OneJointAtATime => "one_joint_at_a_time",
    /// The identified arm is not known well.
    PoorData => "poor_data",
    /// Without a prior, parameters took any value.
    RanAway => "ran_away",
    /// The model lacks something in a part of the workspace.
    RegionNotDescribed => "region_not_described",
    /// The data fit better with a joint reversed.
    ReversedJoint => "reversed_joint",
    /// Points to verify at poses that were identified are left out.
    SeenBefore => "seen_before",
    /// Residuals are larger than the stated accuracy.
    SigmaExcess => "sigma_excess",
    /// Points are simulated.
    Simulated => "simulated",
    /// Something odd in a table.
    Table => "table",
    /// The data do not show the sign or the zero of a joint.
    UntestedJoint => "untested_joint",
    /// A joint has an unusually large error of its own.
    UnusualJoint => "unusual_joint",
    /// A weakness of a plan.
    Weak => "weak",
    /// A plan determines some parameters badly.
    WeakParameters => "weak_parameters",
    /// The arm is not known well where it will work.
    Workspace => "workspace",
}

impl fmt::Display for WarningCode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.as_str())
    }
}

impl From<WarningCode> for String {
    fn from(code: WarningCode) -> Self {
        code.as_str().to_owned()
    }
}

/// A warning to read before the numbers.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Warning {
    /// Its kind.
    pub code: WarningCode,
    /// The problem and what to do about it.
    pub message: String,
    /// Whether it rules out the verdict "accepted".
    pub blocks_acceptance: bool,
    /// Advice on the remedy; taken by [`Warning::put_into_words`] before anything is shown or written.
    #[serde(skip)]
    pub advice: Option<Advice>,
}

impl Warning {
    /// A warning without advice.
    pub fn new(code: WarningCode, message: impl Into<String>, blocks_acceptance: bool) -> Self {
        Self { code, message: message.into(), blocks_acceptance, advice: None }
    }

    /// Adds what can be done about it.
    #[must_use]
    pub const fn with_advice(mut self, advice: Advice) -> Self {
        self.advice = Some(advice);
        self
    }

    /// Appends the advice to the message in the words of the module that shows it.
    pub fn put_into_words(&mut self, words: impl Fn(Advice) -> String) {
        if let Some(advice) = self.advice.take() {
            self.message = format!("{}; {}", self.message, words(advice));
        }
    }

    /// The kinds among `warnings` that rule out the verdict "accepted", each once.
    pub fn blocking(warnings: &[Self]) -> Vec<&WarningCode> {
        let mut codes = Vec::new();
        for warning in warnings.iter().filter(|warning| warning.blocks_acceptance) {
            if !codes.contains(&&warning.code) {
                codes.push(&warning.code);
            }
        }
        codes
    }

    /// That points are simulated, as `said`.
    pub fn simulated(said: &str) -> Self {
        Self::new(WarningCode::Simulated, format!("SIMULATED: {said}"), false)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn kinds_of_other_versions_are_kept() {
        for (text, code) in
            [("\"few_data\"", WarningCode::FewData), ("\"new_kind\"", WarningCode::Other("new_kind".to_owned()))]
        {
            assert_eq!(serde_json::from_str::<WarningCode>(text).unwrap(), code);
            assert_eq!(serde_json::to_string(&code).unwrap(), text);
            assert_eq!(ron::from_str::<WarningCode>(text).unwrap(), code);
        }
    }
}
