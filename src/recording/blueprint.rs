//! The layout that a viewer opens with.
//!
//! The library's layout builder has no cameras, legends or trails, and random ids. So this module writes the entities of a layout
//! itself: containers and views at paths that contain their ids, and the properties of a view below its path.

use nalgebra::{Point3, Vector3};
use rerun::blueprint::components::{
    BackgroundKind, ContainerKind, Corner2D, Eye3DKind, PanelState, PlayState, RootContainer,
};
use rerun::external::re_sdk_types::blueprint::archetypes::{
    Background, ContainerBlueprint, EntityBehavior, EyeControls3D, LineGrid3D, PanelBlueprint, PlotLegend,
    TimePanelBlueprint, ViewBlueprint, ViewContents, ViewportBlueprint, VisibleTimeRanges,
};
use rerun::external::re_sdk_types::datatypes;
use rerun::{AsComponents, Color, TimeCell, TimePoint};

use super::canvas::Row;
use super::posture::Posture;
use super::{names, style};
use crate::profile::Profile;

/// What the layout depends on.
#[derive(Clone, Copy, Debug)]
pub(super) struct Contents {
    pub(super) purpose: Purpose,
    pub(super) has_temperatures: bool,
}

/// The purpose of a recording.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Purpose {
    /// A session that is being measured: the poses and the course of the measurement.
    Capture,
    /// A session with a result: errors of both arms at the poses.
    Result,
    /// A plan: the search for its poses.
    Plan,
}

/// Background of the picture.
const BACKGROUND: Color = style::rgb(24, 28, 33);

/// Returns the rows of the layout for the cell of `profile`.
pub(super) fn rows(profile: &Profile, contents: Contents) -> Vec<Row> {
    let mut layout = Builder::default();
    let picture = picture(profile, &mut layout);
    let (right, timeline) = match contents.purpose {
        Purpose::Capture => (capturing(contents.has_temperatures, &mut layout), names::POSE),
        Purpose::Result => (result(contents.has_temperatures, &mut layout), names::POSE),
        Purpose::Plan => (planning(&mut layout), names::PLAN_ITERATION),
    };
    layout.shared(ContainerKind::Horizontal, &[1.45, 1.0], &[picture, right]);
    // The container that was made last holds all others.
    let root = RootContainer(datatypes::Uuid { bytes: u128::from(layout.items).to_be_bytes() });
    let viewport = ViewportBlueprint::new().with_root_container(root).with_auto_layout(false).with_auto_views(false);
    layout.put("viewport", &viewport);
    for panel in ["blueprint_panel", "selection_panel"] {
        layout.put(panel, &PanelBlueprint::new().with_state(PanelState::Collapsed));
    }
    let time_panel = TimePanelBlueprint::new()
        .with_state(PanelState::Collapsed)
        .with_timeline(timeline)
        .with_fps(4.0)
        .with_play_state(PlayState::Following);
    layout.put("time_panel", &time_panel);
    layout.rows
}

/// Collects the entities of a layout. Every view and container has a path; a container lists the paths of its contents.
#[derive(Debug, Default)]
struct Builder {
    rows: Vec<Row>,
    /// Number of containers and views so far, from which their ids are made.
    items: u64,
}

impl Builder {
    fn put(&mut self, path: &str, what: &dyn AsComponents) {
        let time = TimePoint::default().with_index("blueprint", TimeCell::from_sequence(0));
        self.rows.push(Row::new(path, time, what));
    }

    /// Returns the path of a new container or view.
    fn path(&mut self, kind: &str) -> String {
        self.items += 1;
        format!("/{kind}/00000000-0000-0000-0000-{:012x}", self.items)
    }

    fn view(&mut self, class: &str, name: &str, origin: &str, contents: &[&str]) -> String {
        let path = self.path("view");
        self.put(&format!("{path}/ViewContents"), &ViewContents::new(contents.iter().copied()));
        let view = ViewBlueprint::new(class).with_display_name(name).with_space_origin(format!("/{origin}"));
        self.put(&path, &view);
        path
    }

    /// Adds a view of one entity and everything below it.
    fn entity(&mut self, class: &str, name: &str, entity: &str) -> String {
        self.view(class, name, entity, &["$origin/**"])
    }

    fn container(&mut self, container: &ContainerBlueprint, contents: &[String]) -> String {
        let path = self.path("container");
        self.put(&path, &container.clone().with_contents(contents.iter().map(String::as_str)));
        path
    }

    /// Adds tabs or a column with a name.
    fn named(&mut self, kind: ContainerKind, name: &str, contents: &[String]) -> String {
        self.container(&ContainerBlueprint::new(kind).with_display_name(name), contents)
    }

    /// Adds a row or a column that is divided in these shares.
    fn shared(&mut self, kind: ContainerKind, shares: &[f32], contents: &[String]) -> String {
        let container = ContainerBlueprint::new(kind);
        let shares = shares.iter().copied();
        let container = match kind {
            ContainerKind::Horizontal => container.with_col_shares(shares),
            _ => container.with_row_shares(shares),
        };
        self.container(&container, contents)
    }
}

/// Adds the right half while there is no result, without views that would be empty.
fn capturing(has_temperatures: bool, layout: &mut Builder) -> String {
    let plots = [capture(has_temperatures, layout), search(layout)];
    let plots = layout.named(ContainerKind::Tabs, "Measurement", &plots);
    let log = log(layout);
    let texts = [guide(layout), report(layout)];
    let texts = layout.named(ContainerKind::Tabs, "Texts", &texts);
    layout.shared(ContainerKind::Vertical, &[1.0, 0.7, 1.3], &[plots, log, texts])
}

/// Adds the right half once there is a result.
fn result(has_temperatures: bool, layout: &mut Builder) -> String {
    let [positions, distances] = errors(layout);
    let plots = [positions, distances, capture(has_temperatures, layout), solver(layout), search(layout)];
    let plots = layout.named(ContainerKind::Tabs, "Errors", &plots);
    let bars = [
        layout.entity("BarChart", "Deviations in sigma (bar numbers: see report)", names::SIGNIFICANCE),
        layout.entity("Tensor", "All pairs, nominal (um)", names::MAP_NOMINAL),
        layout.entity("Tensor", "All pairs, identified (um)", names::MAP_IDENTIFIED),
    ];
    let bars = layout.named(ContainerKind::Tabs, "Parameters and pairs", &bars);
    let texts = [report(layout), guide(layout), log(layout)];
    let texts = layout.named(ContainerKind::Tabs, "Texts", &texts);
    layout.shared(ContainerKind::Vertical, &[1.1, 0.8, 1.1], &[plots, bars, texts])
}

/// Adds the right half of a plan.
fn planning(layout: &mut Builder) -> String {
    let search = search(layout);
    let texts = [guide(layout), report(layout), log(layout)];
    let texts = layout.named(ContainerKind::Tabs, "Texts", &texts);
    layout.container(&ContainerBlueprint::new(ContainerKind::Vertical), &[search, texts])
}

fn report(layout: &mut Builder) -> String {
    layout.entity("TextDocument", "Report", names::REPORT)
}

fn guide(layout: &mut Builder) -> String {
    layout.entity("TextDocument", "How to read this picture", names::GUIDE)
}

fn log(layout: &mut Builder) -> String {
    layout.entity("TextLog", "Log", names::LOG)
}

/// Adds the 3D view.
fn picture(profile: &Profile, layout: &mut Builder) -> String {
    let path = layout.entity("3D", "Cell", names::WORLD);
    let (eye, target) = camera(profile);
    let controls = EyeControls3D::new()
        .with_kind(Eye3DKind::Orbital)
        .with_position(style::at(&eye))
        .with_look_target(style::at(&target))
        .with_eye_up([0.0, 0.0, 1.0]);
    layout.put(&format!("{path}/EyeControls3D"), &controls);
    layout.put(&format!("{path}/LineGrid3D"), &LineGrid3D::new().with_visible(false));
    let background = Background::new(BackgroundKind::SolidColor).with_color(BACKGROUND);
    layout.put(&format!("{path}/Background"), &background);
    let visualizers = |entity: &str| format!("{path}/ViewContents/overrides/{entity}/visualizers");
    layout.put(&visualizers(names::MEASURED), &trail());
    for hidden in [names::PAIRS_NOMINAL, names::PAIRS_IDENTIFIED, names::UNCERTAINTY] {
        layout.put(&visualizers(hidden), &EntityBehavior::new().with_visible(false));
    }
    path
}

/// Returns the range of all rows up to the time cursor.
fn trail() -> VisibleTimeRanges {
    VisibleTimeRanges::new([names::POSE, names::TIME].map(|timeline| datatypes::VisibleTimeRange {
        timeline: timeline.into(),
        range: datatypes::TimeRange {
            start: datatypes::TimeRangeBoundary::Infinite,
            end: datatypes::TimeRangeBoundary::CursorRelative(datatypes::TimeInt(0)),
        },
    }))
}

/// Number of postures from which the extent of an arm is estimated.
const POSTURES: u32 = 64;
/// Each joint goes through its range in steps of a power of this fraction, so that no two postures are alike.
const STEP: f64 = 0.8567;

/// Returns the position of the camera and the point that it looks at: across the line from robot to tracker, and as near as the
/// extent of the arm allows.
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
    // Showing a tracker that is far away would leave only a few pixels for the arm.
    let behind = (distance - radius).clamp(0.0, 0.8 * radius);
    let target = centre + towards * (0.5 * behind) - Vector3::z() * (0.1 * radius);
    let from = (aside * 0.8 - towards * 0.75 + Vector3::z() * 0.45).normalize();
    (target + from * (2.0 * radius + 0.7 * behind), target)
}

/// Adds plots of the errors of positions and of distances at the poses.
fn errors(layout: &mut Builder) -> [String; 2] {
    let plots = [
        ("position", "Position error", "Position errors"),
        ("distance", "Mean distance error to all others", "Distance errors"),
    ];
    plots.map(|(quantity, title, name)| {
        // Each arm has its own plot: beside the nominal errors the identified ones would be invisible.
        let arms = ["nominal", "identified"].map(|arm| {
            let contents = format!("+ /{}/**", names::all_errors(quantity, arm));
            let plot = series(&format!("{title}, {arm} arm (mm)"), &[&contents], layout);
            layout.put(&format!("{plot}/PlotLegend"), &PlotLegend::new().with_corner(Corner2D::RightTop));
            plot
        });
        layout.named(ContainerKind::Vertical, name, &arms)
    })
}

/// Adds plots of the solver.
fn solver(layout: &mut Builder) -> String {
    let plots = [
        series("Mean error of all samples (mm), per solver step", &["+ /solver/mean_error_mm"], layout),
        series("Cost and largest step (log10), per solver step", &["+ /solver/cost_and_step_log10"], layout),
    ];
    layout.named(ContainerKind::Vertical, "Solver", &plots)
}

/// Adds plots of the search for poses.
fn search(layout: &mut Builder) -> String {
    let others = ["+ /search/observability_o1_mm", "+ /search/predicted_error_sigma"];
    let plots = [
        series("Condition number, per sweep", &["+ /search/condition_number"], layout),
        series("Observability O1 (mm), predicted error (sigma), per sweep", &others, layout),
    ];
    layout.named(ContainerKind::Vertical, "Search", &plots)
}

/// Adds plots of the capture. Many instruments report no temperature: then there is no plot of it.
fn capture(has_temperatures: bool, layout: &mut Builder) -> String {
    let lengths = ["+ /capture/predicted_error_mm", "+ /capture/scatter_mm", "+ /capture/drift_mm"];
    let mut plots = vec![series("Predicted error of a calibration so far, scatter, drift (mm)", &lengths, layout)];
    if has_temperatures {
        plots.push(series("Temperature (degC)", &["+ /capture/temperature_degc"], layout));
    }
    layout.named(ContainerKind::Vertical, "Capture", &plots)
}

fn series(name: &str, contents: &[&str], layout: &mut Builder) -> String {
    layout.view("TimeSeries", name, "", contents)
}
