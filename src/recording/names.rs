//! Paths of entities, timelines and frames. Only `a` to `z`, digits, `_` and `/`: nothing that the library would escape.

/// Application id of all recordings: layouts belong to it.
pub(super) const APPLICATION: &str = "trupose";

/// Number of the measurement; 0 before the first.
pub(super) const POSE: &str = "pose";
/// Sweep of the pose search.
pub(super) const PLAN_ITERATION: &str = "plan_iteration";
/// Step of the solver; 0 is the nominal arm.
pub(super) const SOLVER_ITERATION: &str = "solver_iteration";
/// Clock time.
pub(super) const TIME: &str = "time";
/// Number of the journal line.
pub(super) const ENTRY: &str = "entry";

/// Lines of the journal, byte by byte.
pub(super) const JOURNAL: &str = "journal";
/// Journal entries in words.
pub(super) const LOG: &str = "log";
/// Report on the result.
pub(super) const REPORT: &str = "report";
/// Guide to the picture.
pub(super) const GUIDE: &str = "guide";

/// Name and start of the recording.
pub(super) const PROPERTIES: &str = "__properties";
pub(super) const SESSION_PROPERTIES: &str = "__properties/session";
/// Properties of the last result.
pub(super) const RESULT_PROPERTIES: &str = "__properties/result";

/// Parent of everything in the picture.
pub(super) const WORLD: &str = "world";
/// Frames of the nominal arm at the pose.
pub(super) const NOMINAL_FRAMES: &str = "world/nominal/frames";
/// Castings and joint axes of the nominal arm, one entity per frame.
pub(super) const NOMINAL_LINKS: &str = "world/nominal/link";
/// Line through the joints of an arm without castings.
pub(super) const NOMINAL_SKELETON: &str = "world/nominal/skeleton";
/// Frames of the identified arm at the pose, true to scale.
pub(super) const IDENTIFIED_FRAMES: &str = "world/identified/frames";
/// Castings of the identified arm with its deviations enlarged; a line through its joints if it has none.
pub(super) const ENLARGED: &str = "world/identified/enlarged";
/// Floor of the cell.
pub(super) const FLOOR: &str = "world/cell/floor";
/// Base of the robot.
pub(super) const BASE: &str = "world/cell/base";
/// Boxes to keep out of.
pub(super) const KEEP_OUT: &str = "world/cell/keep_out";
/// Body of the tracker.
pub(super) const TRACKER: &str = "world/tracker/body";
/// Beam from the tracker to the reflector.
pub(super) const BEAM: &str = "world/tracker/beam";
/// Poses of the plan that are not skipped.
pub(super) const PLAN: &str = "world/plan/poses";
/// Next pose.
pub(super) const NEXT: &str = "world/plan/next";
/// Skipped poses and excluded samples.
pub(super) const UNUSED: &str = "world/plan/unused";
/// Measured points, each at its pose.
pub(super) const MEASURED: &str = "world/measured";
/// Errors of the nominal arm, enlarged.
pub(super) const ERRORS_NOMINAL: &str = "world/errors/nominal";
/// Errors of the identified arm, enlarged.
pub(super) const ERRORS_IDENTIFIED: &str = "world/errors/identified";
/// Errors at the steps of the solver, enlarged like those of the nominal arm.
pub(super) const ERRORS_SOLVING: &str = "world/errors/solving";
/// The pairs with the largest distance errors of the nominal arm.
pub(super) const PAIRS_NOMINAL: &str = "world/pairs/nominal";
/// The same of the identified arm.
pub(super) const PAIRS_IDENTIFIED: &str = "world/pairs/identified";
/// Predicted uncertainty of positions, enlarged.
pub(super) const UNCERTAINTY: &str = "world/uncertainty";
/// Factors of enlargement.
pub(super) const SCALE_NOTE: &str = "world/scale_note";

/// Distance errors of all pairs, nominal arm.
pub(super) const MAP_NOMINAL: &str = "pairs_map/nominal_um";
/// The same of the identified arm.
pub(super) const MAP_IDENTIFIED: &str = "pairs_map/identified_um";

/// Measured coordinates in the tracker frame (mm).
pub(super) const READING: &str = "reading/xyz_mm";
/// Scatter of the shots.
pub(super) const SCATTER: &str = "capture/scatter_mm";
pub(super) const TEMPERATURE: &str = "capture/temperature_degc";
/// Distance of a repeated pose from its first measurement.
pub(super) const DRIFT: &str = "capture/drift_mm";
/// Predicted error of a calibration from the samples so far.
pub(super) const PREDICTED: &str = "capture/predicted_error_mm";
/// Condition number during the search.
pub(super) const CONDITION: &str = "search/condition_number";
/// Observability index O1 during the search.
pub(super) const OBSERVABILITY: &str = "search/observability_o1_mm";
/// Predicted error during the search.
pub(super) const SEARCH_PREDICTED: &str = "search/predicted_error_sigma";
/// Cost of the solver and its largest step, as powers of ten.
pub(super) const COST_AND_STEP: &str = "solver/cost_and_step_log10";
/// Mean error of all samples while the solver works.
pub(super) const FIT: &str = "solver/mean_error_mm";
/// Deviations in units of their standard deviation, one bar per parameter.
pub(super) const SIGNIFICANCE: &str = "parameters/deviation_in_sigma";

/// Returns the entity of the errors at each pose of the result number `run`: `quantity` is `position` or `distance`, `arm` is `nominal` or `identified`,
/// `samples` is `fit`, `verification` or `rejected`.
pub(super) fn errors(run: usize, quantity: &str, arm: &str, samples: &str) -> String {
    format!("{}/{samples}_{run}", all_errors(quantity, arm))
}

/// Parent of the errors of all results.
pub(super) fn all_errors(quantity: &str, arm: &str) -> String {
    format!("errors_mm/{quantity}_{arm}")
}

/// Returns the name of frame `index` of an arm.
pub(super) fn frame(arm: &str, index: usize) -> String {
    format!("{arm}/{index}")
}

/// Frame of the robot base.
pub(super) const WORLD_FRAME: &str = "tf#/world";
