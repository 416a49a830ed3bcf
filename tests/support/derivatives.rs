//! Analytic derivatives of the identification against difference quotients.

use nalgebra::Vector3;
use trupose::kinematics::{Arm, IdentificationJacobian, ParameterId, Place};

/// Difference quotients with this step are good to about its square times the size of the arm.
pub(crate) const STEP: f64 = 1e-6;

/// Compares the columns of all `ids` at one place of an arm, which messages call `name`.
pub(crate) fn assert_derivatives(name: &str, arm: &Arm, ids: &[ParameterId], place: &Place) {
    let mut rows = vec![0.0; 3 * ids.len()];
    let point = IdentificationJacobian::new(ids).at(&arm.prepared(), place, &mut rows);
    assert!((point - arm.point_in_base(place)).norm() < 1e-13);
    for (column, id) in ids.iter().enumerate() {
        let at = |step: f64| arm.with([(*id, step)]).unwrap().point_in_base(place);
        let quotient = (at(STEP) - at(-STEP)) / (2.0 * STEP);
        let analytic = Vector3::new(rows[column], rows[ids.len() + column], rows[2 * ids.len() + column]);
        let error = (quotient - analytic).norm();
        assert!(error < 1e-8, "{name} {id} at {place:?}: {quotient} against {analytic}");
    }
}
