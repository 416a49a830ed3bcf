//! The settings of an identification, and the solver settings that follow from them.

use crate::identification::{Estimator, Prior, Settings, SigmaSource, TermGroup, Terms, Weighting};
use crate::kinematics::FreeParameter;
use crate::profile::{ExpectedDeviation, Level, Profile};
use crate::session::summary::{IdentificationSettings, VerificationMode};
use crate::units::{to_deg, to_mm};

/// Settings of an identification. The defaults are those of every command and of the wizard.
#[derive(Clone, Debug, PartialEq)]
pub struct EstimationSettings {
    /// The parameters to identify.
    pub level: Level,
    /// Errors of the joints to identify instead of those that the level says.
    pub terms: Option<Vec<TermGroup>>,
    /// How distances are weighted.
    pub weighting: Weighting,
    /// The assumption about deviations.
    pub prior: Prior,
    /// The treatment of outliers.
    pub estimator: Estimator,
    /// Largest number of solver steps; 1 is the paper's single linear step.
    pub iterations: usize,
    /// Standard deviation of a measured coordinate (m) that the operator states; `None`: of the readings, else of the profile's
    /// instrument, else estimated.
    pub sigma: Option<f64>,
    /// Expected deviation of every length (m) and angle (rad) of the links instead of the profile's.
    pub expected_deviation: Option<ExpectedDeviation>,
    /// The condition that picked the identification samples, for the summary only.
    pub filter: Option<String>,
}

impl Default for EstimationSettings {
    fn default() -> Self {
        let Settings { weighting, prior, estimator, iterations, .. } = Settings::default();
        Self {
            level: Level::default(),
            terms: None,
            weighting,
            prior,
            estimator,
            iterations,
            sigma: None,
            expected_deviation: None,
            filter: None,
        }
    }
}

impl EstimationSettings {
    /// The record of these settings. What only some commands have is left empty.
    pub(crate) fn record(&self) -> IdentificationSettings {
        IdentificationSettings {
            level: self.level,
            weighting: self.weighting,
            prior: self.prior,
            estimator: self.estimator,
            iterations: self.iterations,
            filter: self.filter.clone(),
            expected_length_mm: self.expected_deviation.map(|expected| to_mm(expected.length)),
            expected_angle_deg: self.expected_deviation.map(|expected| to_deg(expected.angle)),
            layout: None,
            socket_distance_mm: None,
            socket_distance_sigma_mm: None,
            verification: VerificationMode::None,
        }
    }

    /// The errors of joints to choose from, in groups from simple to rich; none where the geometry stays alone. They need the prior,
    /// weights with the covariance, and more than the paper's single step.
    pub(crate) fn candidates(&self) -> Vec<Vec<Terms>> {
        match (&self.terms, self.level) {
            _ if !self.can_have_terms() => Vec::new(),
            (Some(groups), _) => vec![Terms::of_groups(groups)],
            (None, Level::Offsets | Level::Geometric) => Vec::new(),
            (None, Level::Auto) => Terms::candidates(),
            (None, Level::Full) => {
                let all = [TermGroup::Compliance, TermGroup::Tilt, TermGroup::Harmonics, TermGroup::Curves];
                vec![Terms::of_groups(&all)]
            }
        }
    }

    fn can_have_terms(&self) -> bool {
        self.prior == Prior::Expected && self.weighting == Weighting::Covariance && self.iterations > 1
    }

    /// Whether these settings ask for errors of joints and rule them out at the same time.
    pub fn contradict_terms(&self) -> bool {
        (self.terms.is_some() || self.level == Level::Full) && !self.can_have_terms()
    }

    /// The free parameters of the geometry at the chosen level.
    pub(crate) fn parameters(&self, profile: &Profile) -> Vec<FreeParameter> {
        self.parameters_of(self.level, profile)
    }

    /// The free parameters of a level with the chosen expected deviations.
    pub(crate) fn parameters_of(&self, level: Level, profile: &Profile) -> Vec<FreeParameter> {
        let mut parameters = profile.parameters(level);
        if let Some(expected) = self.expected_deviation {
            expected.replace_in(&mut parameters);
        }
        parameters
    }

    /// Settings of the solver; `distance` is the typical distance from the instrument (m), if there is one.
    pub(crate) fn solver(&self, profile: &Profile, distance: Option<f64>) -> Settings {
        let option = self.sigma.map(|sigma| (sigma, SigmaSource::Option));
        let instrument = || {
            let instrument = profile.instrument()?;
            Some((instrument.sigma_at(distance?), SigmaSource::Instrument))
        };
        Settings {
            weighting: self.weighting,
            prior: self.prior,
            estimator: self.estimator,
            iterations: self.iterations,
            sigma: option.or_else(instrument),
        }
    }
}

/// The target coordinates among `parameters`.
pub(crate) fn target_parameters(parameters: &[FreeParameter]) -> Vec<FreeParameter> {
    parameters.iter().filter(|parameter| parameter.id.target().is_some()).copied().collect()
}
