//! A simulated robot in front of a tracker, and its identification.

use std::ops::ControlFlow;

use nalgebra::{Isometry3, Point3, Vector3};
use rand::RngExt as _;
use rand_chacha::ChaCha8Rng;
use trupose::identification::PointSample;
use trupose::kinematics::{Arm, Place};
use trupose::procedure::identify::{Identified, IdentifyRequest, NamedSample, SampleSet, identify};
use trupose::procedure::{EstimationSettings, ProcedureError};
use trupose::profile::{Level, Profile, builtin};
use trupose::session::summary::{VerificationMode, Warning};
use trupose::units::MICROMETRE;

use super::paper_case::{normal, seeded};

/// What the simulated tracker scatters by (m).
pub(crate) const NOISE: f64 = 10.0 * MICROMETRE;

/// A simulated robot in front of a tracker.
pub(crate) struct Bench {
    pub(crate) profile: Profile,
    pub(crate) text: String,
    /// The arm as it is.
    pub(crate) real: Arm,
    pub(crate) rng: ChaCha8Rng,
    /// How the arm is identified.
    pub(crate) settings: EstimationSettings,
}

impl Bench {
    /// The robot of a profile whose constants are off by `size` times what is expected.
    pub(crate) fn new(text: &str, size: f64, seed: u64) -> Self {
        let profile = Profile::parse(text, "robot").unwrap_or_else(|errors| panic!("{errors}")).0;
        let mut rng = seeded(seed);
        let deviations: Vec<_> = profile
            .parameters(Level::Geometric)
            .into_iter()
            .map(|parameter| (parameter.id, size * normal(&mut rng) * parameter.expected))
            .collect();
        let real = profile.arm().with(deviations).unwrap();
        let settings = EstimationSettings { level: Level::Geometric, ..EstimationSettings::default() };
        Self { profile, text: text.to_owned(), real, rng, settings }
    }

    pub(crate) fn builtin(name: &str, seed: u64) -> Self {
        Self::new(builtin(name).unwrap(), 0.5, seed)
    }

    pub(crate) fn configurations(&mut self, count: usize) -> Vec<Vec<f64>> {
        let limits: Vec<_> = self.profile.joints().iter().map(|joint| joint.planning_limits.unwrap()).collect();
        (0..count).map(|_| limits.iter().map(|(low, high)| self.rng.random_range(*low..*high)).collect()).collect()
    }

    pub(crate) fn point(&mut self, at: &Place) -> Point3<f64> {
        let station = Isometry3::new(Vector3::new(2.0, 1.0, 0.4), Vector3::new(0.1, 0.2, 1.0));
        let noise = Vector3::from_fn(|_, _| NOISE * normal(&mut self.rng));
        station.inverse() * self.real.point_in_base(at) + noise
    }

    pub(crate) fn measured(&mut self, configurations: &[Vec<f64>], target: usize) -> Vec<NamedSample> {
        let named = |(index, configuration): (usize, &Vec<f64>)| {
            let at = Place { configuration: configuration.clone(), target };
            let point = self.point(&at);
            NamedSample {
                pose: (index + 1).to_string(),
                line: index + 2,
                sample: PointSample { at, station: 0, point, sigma: None },
                temperature: None,
            }
        };
        configurations.iter().enumerate().map(named).collect()
    }

    pub(crate) fn random(&mut self, count: usize) -> Vec<NamedSample> {
        let configurations = self.configurations(count);
        self.measured(&configurations, 0)
    }

    pub(crate) fn try_identify(
        &self,
        identification: Vec<NamedSample>,
        verification: Vec<NamedSample>,
    ) -> Result<Identified, ProcedureError> {
        let verification_mode = if verification.is_empty() { VerificationMode::None } else { VerificationMode::File };
        let request = IdentifyRequest {
            mounted: None,
            payload: None,
            profile: self.profile.clone(),
            profile_text: self.text.clone(),
            created: "2026-01-02T03:04:05Z".to_owned(),
            inputs: Vec::new(),
            settings: self.settings.clone(),
            identification: SampleSet::from(identification),
            verification: SampleSet::from(verification),
            basis: "other poses".to_owned(),
            verification_mode,
            layout: None,
            socket_distance_mm: None,
            previous: None,
        };
        identify(&request, &mut |_| ControlFlow::Continue(()))
    }

    pub(crate) fn identify(&self, identification: Vec<NamedSample>, verification: Vec<NamedSample>) -> Identified {
        self.try_identify(identification, verification).unwrap()
    }
}

/// The warning of this kind, if there is one.
pub(crate) fn warning<'a>(identified: &'a Identified, code: &str) -> Option<&'a Warning> {
    identified.summary.warnings.iter().find(|warning| warning.code.as_str() == code)
}

/// The samples with other joint values.
pub(crate) fn altered(samples: &[NamedSample], change: impl Fn(&mut [f64])) -> Vec<NamedSample> {
    let mut samples = samples.to_vec();
    for named in &mut samples {
        change(&mut named.sample.at.configuration);
    }
    samples
}
