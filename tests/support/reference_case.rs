//! Pose planning on the reference case: the paper's robot, 1 mm and 0.1° for every length and angle, random candidates, SMR position
//! known, instrument frame free.
#![allow(dead_code, reason = "a test or benchmark uses a part of it")]
#![allow(clippy::allow_attributes, reason = "whether code is dead differs from one program to the next")]

use nalgebra::DVector;
use trupose::identification::verification::ModelErrors;
use trupose::identification::{Estimator, Observations, PointSample, Prior, Problem, Settings, SigmaSource, identify};
use trupose::kinematics::{Arm, FreeParameter, ParameterUnit, Place};
use trupose::planning::{Chosen, Information, Search, SearchSettings};
use trupose::search::plan_in_parallel;
use trupose::units::{DEGREE, MICROMETRE, MILLIMETRE};

use super::paper_case::{measure, normal, paper_chain, paper_parameters, paper_target, random_configurations, seeded};

/// Candidates of the reference case.
pub(crate) const CANDIDATES: usize = 1500;
/// Configurations at which the predicted error is taken.
const FRESH: usize = 5000;

/// The reference case.
pub(crate) struct Reference {
    pub(crate) model: Arm,
    pub(crate) parameters: Vec<FreeParameter>,
    pub(crate) candidates: Vec<Place>,
    pub(crate) information: Information,
}

fn places(configurations: Vec<Vec<f64>>) -> Vec<Place> {
    configurations.into_iter().map(|configuration| Place { configuration, target: 0 }).collect()
}

impl Reference {
    pub(crate) fn new(candidates: usize) -> Self {
        let model = Arm { chain: paper_chain(), targets: vec![paper_target()] };
        let mut parameters = paper_parameters();
        for parameter in &mut parameters {
            parameter.expected =
                if parameter.id.unit() == ParameterUnit::Millimetre { MILLIMETRE } else { 0.1 * DEGREE };
        }
        let candidates = places(random_configurations(candidates, &mut seeded(1)));
        let fresh = places(random_configurations(FRESH, &mut seeded(2)));
        let information = Information::new(&model, &parameters, &candidates, &fresh).unwrap();
        Self { model, parameters, candidates, information }
    }

    /// Searches on all the cores there are.
    pub(crate) fn plan(&self, settings: SearchSettings) -> Chosen {
        let search = Search::new(&self.information, settings).unwrap();
        let threads = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
        plan_in_parallel(&search, threads, &|| true, &|_| {}).unwrap()
    }

    /// Configurations of a set.
    pub(crate) fn configurations(&self, set: &[usize]) -> Vec<Vec<f64>> {
        set.iter().map(|&pose| self.candidates[pose].configuration.clone()).collect()
    }

    /// An arm with random deviations of the expected size.
    fn truth(&self, rng: &mut rand_chacha::ChaCha8Rng) -> Arm {
        let deviations = self.parameters.iter().map(|parameter| normal(rng) * parameter.expected);
        let deviations = DVector::from_iterator(self.parameters.len(), deviations);
        self.problem(&Observations::default()).arm_with(&deviations)
    }

    pub(crate) fn problem<'a>(&'a self, observations: &'a Observations) -> Problem<'a> {
        Problem { arm: &self.model, parameters: &self.parameters, observations }
    }

    /// RMS over `trials` of the position error (in σ) of plain least squares from the poses of `set`, at fresh configurations.
    pub(crate) fn least_squares_error(&self, set: &[usize], trials: u32, rng: &mut rand_chacha::ChaCha8Rng) -> f64 {
        let settings = Settings {
            prior: Prior::None,
            estimator: Estimator::LeastSquares,
            sigma: Some((SIGMA, SigmaSource::Option)),
            ..Settings::default()
        };
        let configurations = self.configurations(set);
        let square: f64 = (0..trials)
            .map(|_| {
                let fresh = random_configurations(200, rng);
                self.verification_error(&settings, &configurations, &fresh, rng).powi(2)
            })
            .sum();
        (square / f64::from(trials)).sqrt()
    }

    /// RMS position error (in σ) at `fresh` configurations, registration included, after identification from noisy points.
    pub(crate) fn verification_error(
        &self,
        settings: &Settings,
        configurations: &[Vec<f64>],
        fresh: &[Vec<f64>],
        rng: &mut rand_chacha::ChaCha8Rng,
    ) -> f64 {
        let truth = self.truth(rng);
        let points = measure(&truth, configurations, SIGMA, rng);
        let observations = Observations { points, ..Observations::default() };
        let found = identify(&self.problem(&observations), settings, &mut |_| {}).unwrap();
        let truth: Vec<PointSample> = measure(&truth, fresh, 0.0, rng);
        ModelErrors::new(&found.arm, &found.base_from_station, &truth).unwrap().position.rms / SIGMA
    }
}

/// Standard deviation of a measured coordinate in the simulations (m).
pub(crate) const SIGMA: f64 = 10.0 * MICROMETRE;
