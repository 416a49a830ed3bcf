//! Paths of entities and names of timelines. Only `a` to `z`, digits, `_` and `/`: nothing that the library would escape.

/// Application id of all recordings: layouts belong to it.
pub(super) const APPLICATION: &str = "trupose";

/// Time since the story began.
pub(super) const STORY: &str = "story";
/// Clock time.
pub(super) const TIME: &str = "time";

/// The result in one line.
pub(super) const HEADLINE: &str = "text/headline";
/// Current chapter of the story.
pub(super) const CAPTION: &str = "text/caption";
/// Report on the result.
pub(super) const REPORT: &str = "text/report";
/// Guide to the picture.
pub(super) const GUIDE: &str = "text/guide";
/// Journal entries in words.
pub(super) const LOG: &str = "text/log";

/// Name and start of the recording.
pub(super) const PROPERTIES: &str = "__properties";
pub(super) const SESSION_PROPERTIES: &str = "__properties/session";
/// Properties of the last result.
pub(super) const RESULT_PROPERTIES: &str = "__properties/result";

/// Parent of everything in the picture.
pub(super) const WORLD: &str = "world";
/// Floor, base and boxes to keep out of.
pub(super) const CELL: &str = "world/cell";
/// Instrument, or the origin of its coordinates.
pub(super) const TRACKER: &str = "world/tracker";
/// The nominal arm with the beam to its reflector.
pub(super) const NOMINAL: &str = "world/nominal";
/// The same of the identified arm, true to scale.
pub(super) const IDENTIFIED: &str = "world/identified";
/// Parent, below the world, of what stays visible once it was drawn.
pub(super) const TRAIL: &str = "trail/";
/// Poses of the plan, one row each or several.
pub(super) const PLAN: &str = "world/trail/plan";
/// Way of the reflector through the plan.
pub(super) const PATH: &str = "world/trail/path";
/// Next pose.
pub(super) const NEXT: &str = "world/next";
/// Skipped poses and excluded samples.
pub(super) const UNUSED: &str = "world/unused";
/// Measured points, each at its pose.
pub(super) const MEASURED: &str = "world/trail/measured";
/// Errors of the nominal arm at the poses that were identified from.
pub(super) const BEFORE: &str = "world/before";
/// The same at the verification poses, some at a time.
pub(super) const BEFORE_VERIFICATION: &str = "world/trail/before";
/// Errors of the identified arm, drawn on the same scale.
pub(super) const AFTER: &str = "world/after";
pub(super) const AFTER_VERIFICATION: &str = "world/trail/after";
/// Errors of the identified arm, magnified.
pub(super) const RESIDUAL: &str = "world/residual";
/// Predicted uncertainty of positions, drawn on the scale of the magnified errors.
pub(super) const UNCERTAINTY: &str = "world/uncertainty";

/// Colours of errors and what they mean.
pub(super) const LEGEND: &str = "chart/legend";
/// Errors of both arms at every pose.
pub(super) const ERRORS: &str = "chart/errors";
/// Distance errors of all pairs, both arms.
pub(super) const PAIRS: &str = "chart/pairs";
/// Deviations of the parameters.
pub(super) const PARAMETERS: &str = "chart/parameters";
/// Angle errors of the joints.
pub(super) const JOINTS: &str = "chart/joints";
/// Course of the search for poses.
pub(super) const SEARCH: &str = "chart/search";

/// Scatter of the shots.
pub(super) const SCATTER: &str = "capture/scatter_mm";
pub(super) const TEMPERATURE: &str = "capture/temperature_degc";
/// Distance of a repeated pose from its first measurement.
pub(super) const DRIFT: &str = "capture/drift_mm";
/// Predicted error of a calibration from the samples so far.
pub(super) const PREDICTED: &str = "capture/predicted_error_mm";

/// Pose, joints and measured point of every sample.
pub(super) const SAMPLES: &str = "data/sample";
/// Errors of every sample.
pub(super) const SAMPLE_ERRORS: &str = "data/error";
/// Acceptance limits.
pub(super) const LIMITS: &str = "data/limit";
