//! What was found about the errors of the joints, in words and drawn with characters: the same for terminal, wizard and page.

use super::summary::{JointErrorSummary, SelectionSummary, ShareSummary, WorkspaceSummary};
use crate::text::{fixed, listed};

/// Errors below this (mm) are shown with three decimals.
const FINE: f64 = 0.05;
/// A share below this (percent) would be shown as none.
const NO_SHARE: f64 = 0.5;
/// Scale of a drawing without any error (µrad).
const LEAST_SCALE: f64 = 1.0;

/// An error in mm with the digits that it deserves.
pub fn millimetres(value: f64) -> String {
    fixed(value, if value < FINE { 3 } else { 2 })
}

/// `geometry explains 71 %, gravity 9 % and joint curves 18 %; 0.08 mm are left (of the 0.72 mm of the nominal arm)`.
pub fn shares_sentence(selection: &SelectionSummary) -> String {
    let SelectionSummary { candidates, shares, left_rms_mm, nominal_rms_mm, .. } = selection;
    let left = format!(
        "{} mm are left (of the {} mm of the nominal arm)",
        millimetres(*left_rms_mm),
        millimetres(*nominal_rms_mm)
    );
    // Without the geometry alone nobody knows what the rest adds to it.
    if !candidates.iter().any(|candidate| candidate.terms.is_geometry()) {
        return left;
    }
    let named: Vec<String> = shares
        .iter()
        .filter(|share| share.percent >= NO_SHARE)
        .enumerate()
        .map(|(index, ShareSummary { cause, percent })| {
            format!("{cause}{} {percent:.0} %", if index == 0 { " explains" } else { "" })
        })
        .collect();
    if named.is_empty() { left } else { format!("{}; {left}", listed(&named)) }
}

/// `predicted over the whole range of the joints: 0.10 mm rms, 0.16 mm at 95 %`.
pub fn workspace_sentence(workspace: &WorkspaceSummary) -> String {
    let WorkspaceSummary { configurations, rms_mm, p95_mm, .. } = workspace;
    format!(
        "predicted over the whole range of the joints: {} mm rms, {} mm at 95 % of {configurations} random configurations",
        millimetres(*rms_mm),
        millimetres(*p95_mm)
    )
}

impl JointErrorSummary {
    /// Whether the joint was measured on both sides of a value (deg).
    pub fn is_measured_at(&self, value: f64) -> bool {
        (self.measured_deg.0..=self.measured_deg.1).contains(&value)
    }

    /// Largest error where it was measured (µrad).
    fn largest_urad(&self) -> f64 {
        let measured = self.curve.iter().filter(|(value, ..)| self.is_measured_at(*value));
        measured.map(|(_, error, _)| error.abs()).fold(0.0, f64::max)
    }

    /// Root mean square of the standard deviation of the curve where it was measured (µrad).
    pub fn sigma_urad(&self) -> Option<f64> {
        let sigmas = self.curve.iter().filter(|(value, ..)| self.is_measured_at(*value)).map(|(.., sigma)| *sigma);
        let (count, squares) = sigmas.fold((0.0, 0.0), |(count, sum), sigma| (count + 1.0, sigma.mul_add(sigma, sum)));
        (count > 0.0).then(|| (squares / count).sqrt())
    }

    /// `129 ± 15 urad at 153 Nm`: how far the joint gives way at its largest gravity torque.
    pub fn gravity_words(&self) -> Option<String> {
        let (turn, sigma) = self.compliance_urad?;
        let turn = format!("{} ± {} urad", fixed(turn, 0), fixed(sigma, 0));
        Some(match self.torque_nm {
            Some(torque) => format!("{turn} at {} Nm", fixed(torque, usize::from(torque < 10.0))),
            None => turn,
        })
    }

    /// Error and its standard deviation (µrad) at a value (deg), between the two nearest of the curve.
    pub fn at(&self, value: f64) -> Option<(f64, f64)> {
        let after = self.curve.iter().position(|(at, ..)| *at >= value)?;
        let (high, error_above, sigma_above) = *self.curve.get(after)?;
        let Some((low, error, sigma)) = after.checked_sub(1).and_then(|before| self.curve.get(before)).copied() else {
            return (high <= value).then_some((error_above, sigma_above));
        };
        let part = (value - low) / (high - low);
        Some((part.mul_add(error_above - error, error), part.mul_add(sigma_above - sigma, sigma)))
    }
}

/// What a curve is drawn with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CurveMarks {
    /// Eight blocks of rising height.
    Blocks,
    /// The digits 0 to 7.
    Digits,
}

impl CurveMarks {
    const fn levels(self) -> [char; 8] {
        match self {
            Self::Blocks => ['▁', '▂', '▃', '▄', '▅', '▆', '▇', '█'],
            Self::Digits => ['0', '1', '2', '3', '4', '5', '6', '7'],
        }
    }

    /// Marks a value that was not measured.
    const fn unknown(self) -> char {
        match self {
            Self::Blocks => '·',
            Self::Digits => '.',
        }
    }

    /// What lowest and highest mark mean, and what the dots are.
    pub fn legend(self, scale_urad: f64) -> String {
        let [lowest, .., highest] = self.levels();
        let scale = fixed(scale_urad, 0);
        format!(
            "{lowest} is -{scale} urad, {highest} is +{scale} urad, {} was not measured; every joint to the same scale",
            self.unknown()
        )
    }
}

/// The largest error of all joints where they were measured, rounded up (µrad): the scale that all are drawn to.
pub fn curve_scale(joints: &[JointErrorSummary]) -> f64 {
    let largest = joints.iter().map(JointErrorSummary::largest_urad).fold(0.0, f64::max).max(LEAST_SCALE);
    let decade = 10.0_f64.powf(largest.log10().floor());
    (largest / decade * 2.0).ceil() / 2.0 * decade
}

/// The curve of a joint over its range on one line of so many columns, from minus to plus the scale.
pub fn curve_drawn(joint: &JointErrorSummary, columns: usize, scale_urad: f64, marks: CurveMarks) -> String {
    let (Some((first, ..)), Some((last, ..))) = (joint.curve.first(), joint.curve.last()) else {
        return String::new();
    };
    let levels = marks.levels();
    let mark = |value: f64| {
        let (error, _) = joint.at(value).filter(|_| joint.is_measured_at(value))?;
        let part = f64::midpoint(error / scale_urad, 1.0).clamp(0.0, 1.0);
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a small whole number, not negative"
        )]
        let level = (part * levels.len() as f64) as usize;
        Some(levels[level.min(levels.len() - 1)])
    };
    (0..columns)
        .map(|column| (last - first).mul_add((column as f64 + 0.5) / columns as f64, *first))
        .map(|value| mark(value).unwrap_or_else(|| marks.unknown()))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::identification::Terms;
    use crate::session::summary::{CandidateSummary, Cause};

    fn candidate(terms: Terms, left_out_rms_mm: f64) -> CandidateSummary {
        CandidateSummary { terms, left_out_rms_mm, residual_mm: 0.5 * left_out_rms_mm }
    }

    fn selection() -> SelectionSummary {
        let kept = Terms { compliance: true, ..Terms::default() };
        let share = |cause, percent| ShareSummary { cause, percent };
        SelectionSummary {
            candidates: vec![candidate(Terms::default(), 0.13), candidate(kept, 0.08)],
            kept,
            reason: "because".to_owned(),
            nominal_rms_mm: 0.719,
            shares: vec![share(Cause::Geometry, 71.4), share(Cause::Gravity, 9.2), share(Cause::JointCurves, 18.0)],
            left_rms_mm: 0.0812,
        }
    }

    #[test]
    fn shares_are_one_sentence() {
        let mut selection = selection();
        assert_eq!(
            shares_sentence(&selection),
            "geometry explains 71 %, gravity 9 % and joint curves 18 %; 0.08 mm are left (of the 0.72 mm of the nominal arm)"
        );
        selection.shares[1].percent = 0.2;
        selection.left_rms_mm = 0.0123;
        assert_eq!(
            shares_sentence(&selection),
            "geometry explains 71 % and joint curves 18 %; 0.012 mm are left (of the 0.72 mm of the nominal arm)"
        );
        selection.candidates.remove(0);
        assert_eq!(shares_sentence(&selection), "0.012 mm are left (of the 0.72 mm of the nominal arm)");
    }

    fn joint() -> JointErrorSummary {
        JointErrorSummary {
            joint: "J2".to_owned(),
            measured_deg: (-90.0, 90.0),
            compliance_urad: Some((129.4, 14.6)),
            torque_nm: Some(153.2),
            curve_rms_urad: 70.0,
            curve: vec![
                (-180.0, 0.0, 400.0),
                (-90.0, -100.0, 30.0),
                (0.0, 0.0, 30.0),
                (90.0, 97.0, 30.0),
                (180.0, 900.0, 400.0),
            ],
        }
    }

    #[test]
    fn a_curve_is_drawn_where_it_was_measured() {
        let joint = joint();
        let scale = curve_scale(std::slice::from_ref(&joint));
        assert!((scale - 100.0).abs() < 1e-9);
        assert_eq!(curve_drawn(&joint, 16, scale, CurveMarks::Blocks), "····▁▂▃▄▅▆▇█····");
        assert_eq!(curve_drawn(&joint, 16, scale, CurveMarks::Digits), "....01234567....");
        assert_eq!(joint.gravity_words().unwrap(), "129 ± 15 urad at 153 Nm");
        assert_eq!(joint.sigma_urad(), Some(30.0));
        assert_eq!((joint.at(-180.0), joint.at(45.0), joint.at(200.0)), (Some((0.0, 400.0)), Some((48.5, 30.0)), None));
    }

    #[test]
    fn the_scale_is_a_round_number_above_the_largest_error() {
        let scale = |error: f64| {
            let curve = vec![(0.0, error, 1.0)];
            curve_scale(&[JointErrorSummary { curve, ..joint() }])
        };
        for (error, above) in [(0.0, 1.0), (12.0, 15.0), (99.0, 100.0), (101.0, 150.0), (-501.0, 550.0)] {
            assert!((scale(error) - above).abs() < 1e-9, "{error}");
        }
    }
}
