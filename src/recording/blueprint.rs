//! The layout that a viewer opens with.
//!
//! The library's layout builder lacks cameras, legends and trails; they are entities of the same store, written beside what
//! the builder writes.

use nalgebra::{Point3, Vector3};
use rerun::blueprint::components::{BackgroundKind, Corner2D, Eye3DKind, PanelState, PlayState};
use rerun::blueprint::{
    BarChartView, Blueprint, BlueprintActivation, BlueprintPanel, ContainerLike, Horizontal, SelectionPanel,
    Spatial3DView, Tabs, TensorView, TextDocumentView, TextLogView, TimePanel, TimeSeriesView, Vertical,
};
use rerun::external::re_log_types::BlueprintActivationCommand;
use rerun::external::re_sdk_types::blueprint::archetypes::{
    Background, EntityBehavior, EyeControls3D, LineGrid3D, PlotLegend, VisibleTimeRanges,
};
use rerun::external::re_sdk_types::datatypes;
use rerun::log::LogMsg;
use rerun::{AsComponents, Color, RecordingStream, RecordingStreamBuilder};

use super::canvas::Canvas;
use super::scribe::Posture;
use super::{RecordingError, layout, names};
use crate::profile::Profile;

/// What there is to see of a recording.
#[derive(Clone, Copy, Debug)]
pub(super) struct Contents {
    /// What it is looked at for.
    pub(super) purpose: Purpose,
    /// Temperatures were measured.
    pub(super) has_temperatures: bool,
}

/// What a recording is looked at for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Purpose {
    /// A session that is measured: the poses, and what the measurement says about itself.
    Capture,
    /// A session with a result: errors of both arms at the poses.
    Result,
    /// A plan: the search first.
    Plan,
}

/// Background of the picture.
const BACKGROUND: Color = layout::rgb(24, 28, 33);

/// Something that the layout builder cannot say, at a path of the layout's store.
type Extra = (String, Box<dyn AsComponents>);

/// Sends the layout for the cell of `profile`.
pub(super) fn send(canvas: &Canvas, profile: &Profile, contents: Contents) {
    // A layout that cannot be made leaves the viewer's own: no reason to lose a recording.
    if let Ok((messages, activation)) = messages(profile, contents) {
        canvas.stream().send_blueprint(messages, activation);
    }
}

fn messages(
    profile: &Profile,
    contents: Contents,
) -> Result<(Vec<LogMsg>, BlueprintActivationCommand), RecordingError> {
    let mut extras = Vec::new();
    let picture = picture(profile, &mut extras);
    let (right, timeline) = match contents.purpose {
        Purpose::Capture => (capturing(contents.has_temperatures, &mut extras), names::POSE),
        Purpose::Result => (result(contents.has_temperatures, &mut extras), names::POSE),
        Purpose::Plan => (planning(&mut extras), names::PLAN_ITERATION),
    };
    let root = Horizontal::new([picture, right]).with_column_shares([1.45, 1.0]);
    let blueprint = Blueprint::new(root)
        .with_auto_views(false)
        .with_auto_layout(false)
        .with_blueprint_panel(BlueprintPanel::from_state(PanelState::Collapsed))
        .with_selection_panel(SelectionPanel::from_state(PanelState::Collapsed))
        .with_time_panel(
            TimePanel::new()
                .with_state(PanelState::Collapsed)
                .with_timeline(timeline)
                .with_fps(4.0)
                .with_play_state(PlayState::Following),
        );
    with_extras(&blueprint, &extras)
}

/// Beside the picture while there is no result: nothing that would be empty.
fn capturing(has_temperatures: bool, extras: &mut Vec<Extra>) -> ContainerLike {
    let plots = Tabs::new([capture(has_temperatures, extras), search(extras)]).with_name("Measurement");
    Vertical::new([plots.into(), log(), Tabs::new([guide(), report()]).with_name("Texts").into()])
        .with_row_shares([1.0, 0.7, 1.3])
        .into()
}

/// Beside the picture when there is a result.
fn result(has_temperatures: bool, extras: &mut Vec<Extra>) -> ContainerLike {
    let (positions, distances) = errors(extras);
    let plots = Tabs::new([positions, distances, capture(has_temperatures, extras), solver(extras), search(extras)]);
    let bars = Tabs::new([
        view(BarChartView::new("Deviations in sigma (bar numbers: see report)").with_origin(names::SIGNIFICANCE)),
        view(TensorView::new("All pairs, nominal (um)").with_origin(names::MAP_NOMINAL)),
        view(TensorView::new("All pairs, identified (um)").with_origin(names::MAP_IDENTIFIED)),
    ]);
    Vertical::new([
        ContainerLike::from(plots.with_name("Errors")),
        bars.with_name("Parameters and pairs").into(),
        Tabs::new([report(), guide(), log()]).with_name("Texts").into(),
    ])
    .with_row_shares([1.1, 0.8, 1.1])
    .into()
}

/// Beside the picture of a plan.
fn planning(extras: &mut Vec<Extra>) -> ContainerLike {
    Vertical::new([search(extras), Tabs::new([guide(), report(), log()]).with_name("Texts").into()]).into()
}

fn report() -> ContainerLike {
    view(TextDocumentView::new("Report").with_origin(names::REPORT))
}

fn guide() -> ContainerLike {
    view(TextDocumentView::new("How to read this picture").with_origin(names::GUIDE))
}

fn log() -> ContainerLike {
    view(TextLogView::new("Log").with_origin(names::LOG))
}

/// The 3D view.
fn picture(profile: &Profile, extras: &mut Vec<Extra>) -> ContainerLike {
    let view: ContainerLike = Spatial3DView::new("Cell").with_origin(names::WORLD).with_contents(["$origin/**"]).into();
    let Some(path) = path(&view) else { return view };
    let (eye, target) = camera(profile);
    let mut at = |name: &str, what: Box<dyn AsComponents>| extras.push((format!("{path}/{name}"), what));
    at(
        "EyeControls3D",
        Box::new(
            EyeControls3D::new()
                .with_kind(Eye3DKind::Orbital)
                .with_position(layout::at(&eye))
                .with_look_target(layout::at(&target))
                .with_eye_up([0.0, 0.0, 1.0]),
        ),
    );
    at("LineGrid3D", Box::new(LineGrid3D::new().with_visible(false)));
    at("Background", Box::new(Background::new(BackgroundKind::SolidColor).with_color(BACKGROUND)));
    let mut of = |entity: &str, name: &str, what: Box<dyn AsComponents>| {
        let _: () = extras.push((format!("{path}/ViewContents/overrides/{entity}{name}"), what));
    };
    of(names::MEASURED, "/visualizers", Box::new(trail()));
    for hidden in [names::PAIRS_NOMINAL, names::PAIRS_IDENTIFIED, names::UNCERTAINTY] {
        of(hidden, "/visualizers", Box::new(EntityBehavior::new().with_visible(false)));
    }
    view
}

/// All rows up to the time cursor.
fn trail() -> VisibleTimeRanges {
    VisibleTimeRanges::new([names::POSE, names::TIME].map(|timeline| datatypes::VisibleTimeRange {
        timeline: timeline.into(),
        range: datatypes::TimeRange {
            start: datatypes::TimeRangeBoundary::Infinite,
            end: datatypes::TimeRangeBoundary::CursorRelative(datatypes::TimeInt(0)),
        },
    }))
}

/// Postures that tell how much room an arm takes.
const POSTURES: u32 = 64;
/// Every joint goes through its range in steps of a power of this part of it: no two postures are alike.
const STEP: f64 = 0.8567;

/// Where the camera stands and what it looks at: across the line from robot to tracker, as near as all of the arm's room allows.
fn camera(profile: &Profile) -> (Point3<f64>, Point3<f64>) {
    let postures = (1..=POSTURES).flat_map(|number| {
        let q: Vec<f64> = (1..)
            .zip(profile.joints())
            .map(|(power, joint)| {
                let (low, high) = joint.planning_limits.or(joint.limits).unwrap_or((-1.0, 1.0));
                low + (high - low) * (f64::from(number) * STEP.powi(power)).fract()
            })
            .collect();
        Posture::nominal(profile, &q).line
    });
    let places: Vec<Point3<f64>> = postures.collect();
    let (mut low, mut high) = (Point3::origin(), Point3::origin());
    for place in &places {
        low = low.inf(place);
        high = high.sup(place);
    }
    let centre = nalgebra::center(&low, &high);
    let radius = places.iter().map(|place| (place - centre).norm()).fold(0.1, f64::max);
    let tracker = profile.tracker().position_in_base;
    let towards = Vector3::new(tracker.x - centre.x, tracker.y - centre.y, 0.0);
    let distance = towards.norm();
    let towards = towards.try_normalize(1e-9).unwrap_or_else(Vector3::x);
    let aside = Vector3::new(towards.y, -towards.x, 0.0);
    // A tracker far away is not worth an arm of a few pixels.
    let behind = (distance - radius).clamp(0.0, 0.8 * radius);
    let target = centre + towards * (0.5 * behind) - Vector3::z() * (0.1 * radius);
    let from = (aside * 0.8 - towards * 0.75 + Vector3::z() * 0.45).normalize();
    (target + from * (2.0 * radius + 0.7 * behind), target)
}

/// Plots of the errors of positions and of distances at the poses.
fn errors(extras: &mut Vec<Extra>) -> (ContainerLike, ContainerLike) {
    // Each arm has a plot of its own: beside the nominal errors the identified ones would not be seen.
    let mut both = |quantity: &str, title: &str, name: &str| {
        let mut of = |arm: &str| {
            let contents = format!("+ /{}/**", names::all_errors(quantity, arm));
            series(&format!("{title}, {arm} arm (mm)"), &[&contents], extras)
        };
        ContainerLike::from(Vertical::new([of("nominal"), of("identified")]).with_name(name))
    };
    let positions = both("position", "Position error", "Position errors");
    let distances = both("distance", "Mean distance error to all others", "Distance errors");
    (positions, distances)
}

/// Plots of the solver.
fn solver(extras: &mut Vec<Extra>) -> ContainerLike {
    Vertical::new([
        series("Mean error of all samples (mm), per solver step", &["+ /solver/mean_error_mm"], extras),
        series("Cost and largest step (log10), per solver step", &["+ /solver/cost_and_step_log10"], extras),
    ])
    .with_name("Solver")
    .into()
}

/// Plots of the search for poses.
fn search(extras: &mut Vec<Extra>) -> ContainerLike {
    let others = ["+ /search/observability_o1_mm", "+ /search/predicted_error_sigma"];
    Vertical::new([
        series("Condition number, per sweep", &["+ /search/condition_number"], extras),
        series("Observability O1 (mm), predicted error (sigma), per sweep", &others, extras),
    ])
    .with_name("Search")
    .into()
}

/// Plots of the capture. Nothing that would be empty: many instruments report no temperature.
fn capture(has_temperatures: bool, extras: &mut Vec<Extra>) -> ContainerLike {
    let lengths = series(
        "Predicted error of a calibration so far, scatter, drift (mm)",
        &["+ /capture/predicted_error_mm", "+ /capture/scatter_mm", "+ /capture/drift_mm"],
        extras,
    );
    let mut plots = vec![lengths];
    if has_temperatures {
        plots.push(series("Temperature (degC)", &["+ /capture/temperature_degc"], extras));
    }
    Vertical::new(plots).with_name("Capture").into()
}

fn series(name: &str, contents: &[&str], extras: &mut Vec<Extra>) -> ContainerLike {
    let view: ContainerLike = TimeSeriesView::new(name).with_origin("/").with_contents(contents.iter().copied()).into();
    let is_crowded = contents.iter().any(|content| content.ends_with("**"));
    if let (Some(path), true) = (path(&view), is_crowded) {
        extras.push((format!("{path}/PlotLegend"), Box::new(PlotLegend::new().with_corner(Corner2D::RightTop))));
    }
    view
}

fn view(view: impl Into<ContainerLike>) -> ContainerLike {
    view.into()
}

/// Where a view stands in the layout's store.
fn path(view: &ContainerLike) -> Option<String> {
    match view {
        ContainerLike::View(view) => Some(view.blueprint_path().to_string()),
        _ => None,
    }
}

/// The messages of a layout with what its builder cannot say.
fn with_extras(
    blueprint: &Blueprint,
    extras: &[Extra],
) -> Result<(Vec<LogMsg>, BlueprintActivationCommand), RecordingError> {
    let failed = |error: rerun::RecordingStreamError| RecordingError::library("making the layout", error);
    if !rerun::decide_logging_enabled(true) {
        // The library's builder then makes nothing, and panics about it. Everything else is recorded all the same.
        return Err(RecordingError::library("making the layout", "the environment variable RERUN forbids it"));
    }
    let (carrier, sent) = RecordingStreamBuilder::new(names::APPLICATION).enabled(true).memory().map_err(failed)?;
    let activation = BlueprintActivation { make_active: true, make_default: true };
    blueprint.send(&carrier, activation).map_err(failed)?;
    let mut messages = Vec::new();
    let mut command = None;
    for message in sent.take() {
        match message {
            LogMsg::BlueprintActivationCommand(activation) => command = Some(activation),
            message if message.store_id().is_blueprint() => messages.push(message),
            _ => {}
        }
    }
    let command = command.ok_or_else(|| RecordingError::library("making the layout", "it has no activation"))?;
    let (own, written): (RecordingStream, _) = RecordingStreamBuilder::from_store_id(&command.blueprint_id)
        .send_properties(false)
        .enabled(true)
        .memory()
        .map_err(failed)?;
    own.set_time_sequence("blueprint", 0);
    for (path, what) in extras {
        own.log(path.as_str(), what.as_ref()).map_err(failed)?;
    }
    messages.extend(written.take().into_iter().filter(|message| matches!(message, LogMsg::ArrowMsg(..))));
    Ok((messages, command))
}
