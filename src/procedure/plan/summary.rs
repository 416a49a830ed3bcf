//! The summary of a planned or checked set: its score, comparisons, and weak parameters.

use super::super::{ProcedureError, provenance};
use super::{Planner, RANDOM_SETS, SIZES};
use crate::identification::Terms;
use crate::kinematics::{FreeParameter, Place, coverage};
use crate::planning::candidates::{Candidate, Rejections};
use crate::planning::{
    DesignBound, EXPECTED_CURVES, Information, REPEATABILITY, Score, TermModel, TradeOff, Yardstick, trade_off,
};
use crate::profile::Level;
use crate::search::side_by_side;
use crate::session::advice::Advice;
use crate::session::plan_summary::{
    CandidateSummary, JointGapSummary, PlanSummary, RejectionSummary, SCHEMA, TradeOffSummary, WeakParameterSummary,
};
use crate::session::summary::{Warning, WarningCode};
use crate::units::to_mm;

impl Planner<'_> {
    /// Scores the candidates `set` of the pool, whose first `required` poses are measured already, and compares it with random sets, the bound and other
    /// sizes.
    pub(super) fn summary(
        &self,
        information: &Information,
        pool: &[Candidate],
        set: &[usize],
        required: usize,
        rejections: &Rejections,
    ) -> Result<PlanSummary, ProcedureError> {
        let score = Score::new(information, set)?;
        let measured: Vec<usize> = (0..required).collect();
        let mut warnings = Vec::new();
        let seed = self.request.seed;
        let compare = || {
            let yardstick = Yardstick::new(information, set.len(), RANDOM_SETS, seed);
            (yardstick, DesignBound::new(information, &|| true))
        };
        let other_sizes = || trade_off(information, &measured, &SIZES, seed, &|| true);
        let ((yardstick, bound), sizes) = side_by_side(self.threads(), compare, other_sizes);
        let (yardstick, sizes) = (yardstick?, sizes?);
        let d_efficiency = bound.efficiency(information, set)?;
        let sigma = self.sigma();
        let fresh = self.fresh()?;
        let terms = self.terms().map(|terms| TermModel::new(information, &self.arm, terms, &fresh));
        let with_terms = |set: &[usize]| {
            let places: Vec<Place> = set.iter().filter_map(|index| pool.get(*index)).map(Candidate::place).collect();
            terms.as_ref()?.predicted_rms(set, &places, sigma?.hypot(REPEATABILITY)).map(to_mm)
        };
        if sigma.is_none() {
            let text = "the sigma of the instrument is not known, so there are no predictions in mm and none about weak parameters";
            warnings.push(Warning::new(WarningCode::NoSigma, text, false).with_advice(Advice::StateSigma));
        }
        if let Some(sigma) = sigma
            && score.weak(sigma).any(|weak| weak.identifiable)
        {
            let text = "some identifiable parameters stay weakly determined (listed below); more poses or wider joint ranges help";
            warnings.push(Warning::new(WarningCode::WeakParameters, text, false));
        }
        Ok(PlanSummary {
            schema: SCHEMA,
            provenance: provenance(self.profile, self.profile_text, self.request.created.clone(), Vec::new()),
            objective: None,
            warnings,
            identification_poses: set.len(),
            verification_poses: 0,
            parameter_count: self.parameters.len(),
            sigma_mm: sigma.map(to_mm),
            predicted_verification_rms_mm: None,
            predicted_rms_mm: sigma.map(|sigma| to_mm(score.predicted_rms(sigma))),
            predicted_level3_rms_mm: with_terms(set),
            random: yardstick,
            d_efficiency,
            d_bound_gap: bound.gap,
            search: Vec::new(),
            trade_off: sizes.iter().map(|size| trade_off_row(size, sigma, with_terms(&size.set))).collect(),
            joint_gaps: self.joint_gaps(pool, set),
            weak_parameters: sigma.map_or_else(Vec::new, |sigma| weak_parameters(&score, sigma)),
            blind_groups: information.observability().groups.iter().map(|group| group.description.clone()).collect(),
            candidates: candidate_summary(rejections),
            score,
            time: None,
            poses: Vec::new(),
            elapsed_s: 0.0,
            interrupted: false,
            written: Vec::new(),
        })
    }

    /// The errors of the joints that are identified beside the geometry; `None` at levels without them.
    fn terms(&self) -> Option<Vec<FreeParameter>> {
        match self.request.level {
            Level::Offsets | Level::Geometric => None,
            Level::Auto | Level::Full => Some(Terms::all(EXPECTED_CURVES).parameters(&self.arm.chain)),
        }
    }

    /// The largest gap that the poses `set` leave in the range of each joint.
    fn joint_gaps(&self, pool: &[Candidate], set: &[usize]) -> Vec<JointGapSummary> {
        let configurations = set.iter().filter_map(|index| pool.get(*index)).map(|kept| kept.configuration.as_slice());
        let joints = self.arm.chain.joints().iter();
        let covered = joints.zip(coverage(&self.arm.chain, &self.limits, &configurations));
        covered
            .map(|(joint, coverage)| {
                let quantity = joint.joint_type.quantity();
                let gap = coverage.largest_gap();
                JointGapSummary {
                    joint: joint.name.clone(),
                    unit: quantity.unit().to_owned(),
                    largest_gap: quantity.to_edge(gap.size()),
                    from: quantity.to_edge(gap.from),
                    to: quantity.to_edge(gap.to),
                    even_gap: quantity.to_edge(coverage.even_gap(set.len())),
                }
            })
            .collect()
    }
}

fn trade_off_row(size: &TradeOff, sigma: Option<f64>, with_terms: Option<f64>) -> TradeOffSummary {
    TradeOffSummary {
        poses: size.poses,
        predicted_error_sigma: size.predicted_error,
        predicted_rms_mm: sigma.map(|sigma| to_mm(size.predicted_error * sigma)),
        predicted_level3_rms_mm: with_terms,
        time_min: None,
    }
}

fn weak_parameters(score: &Score, sigma: f64) -> Vec<WeakParameterSummary> {
    score
        .weak(sigma)
        .filter(|weak| weak.identifiable)
        .map(|weak| {
            let unit = weak.parameter.id.unit();
            WeakParameterSummary {
                name: weak.parameter.id.to_string(),
                unit: unit.name().to_owned(),
                predicted_sigma: unit.to_edge(weak.deviation_per_sigma * sigma),
                expected: unit.to_edge(weak.parameter.expected),
            }
        })
        .collect()
}

fn candidate_summary(rejections: &Rejections) -> CandidateSummary {
    CandidateSummary {
        tried: rejections.tried,
        kept: rejections.kept,
        rejections: rejections
            .rules()
            .map(|(rule, rejected)| RejectionSummary {
                rule: rule.name().to_owned(),
                rejected: rejected.all,
                alone: rejected.alone,
            })
            .collect(),
    }
}
