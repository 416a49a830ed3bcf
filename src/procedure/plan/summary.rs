//! The summary of a planned or checked set: its score, comparisons, and weak parameters.

use super::super::{ProcedureError, provenance};
use super::{Planner, RANDOM_SETS, SIZES};
use crate::planning::candidates::Rejections;
use crate::planning::{DesignBound, Information, Score, TradeOff, Yardstick, trade_off};
use crate::session::advice::Advice;
use crate::session::plan_summary::{
    CandidateSummary, PlanSummary, RejectionSummary, SCHEMA, TradeOffSummary, WeakParameterSummary,
};
use crate::session::summary::Warning;
use crate::units::to_mm;

impl Planner<'_> {
    /// Scores `set`, whose first `required` poses are measured already, and compares it with random sets, the bound and other
    /// sizes.
    pub(super) fn summary(
        &self,
        information: &Information,
        set: &[usize],
        required: usize,
        rejections: &Rejections,
    ) -> Result<PlanSummary, ProcedureError> {
        let score = Score::new(information, set)?;
        let measured: Vec<usize> = (0..required).collect();
        let mut warnings = Vec::new();
        let yardstick = Yardstick::new(information, set.len(), RANDOM_SETS, self.request.seed)?;
        let bound = DesignBound::new(information, &|| true);
        let d_efficiency = bound.efficiency(information, set)?;
        let sizes = trade_off(information, &measured, &SIZES, self.request.seed, &|| true)?;
        let sigma = self.sigma();
        if sigma.is_none() {
            let text = "the sigma of the instrument is not known, so there are no predictions in mm and none about weak parameters";
            warnings.push(Warning::new("no_sigma", text, false).with_advice(Advice::StateSigma));
        }
        if let Some(sigma) = sigma
            && score.weak(sigma).any(|weak| weak.identifiable)
        {
            let text = "some identifiable parameters stay weakly determined (listed below); more poses or wider joint ranges help";
            warnings.push(Warning::new("weak_parameters", text, false));
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
            random: yardstick,
            d_efficiency,
            d_bound_gap: bound.gap,
            search: Vec::new(),
            trade_off: sizes.iter().map(|size| trade_off_row(size, sigma)).collect(),
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
}

fn trade_off_row(size: &TradeOff, sigma: Option<f64>) -> TradeOffSummary {
    TradeOffSummary {
        poses: size.poses,
        predicted_error_sigma: size.predicted_error,
        predicted_rms_mm: sigma.map(|sigma| to_mm(size.predicted_error * sigma)),
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
