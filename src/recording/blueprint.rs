//! The layout that a viewer opens with.
//!
//! The library's layout builder has no cameras, regions or trails, and random ids. So this module writes the entities of a layout
//! itself: containers and views at paths that contain their ids, and the properties of a view below its path.

use nalgebra::{Point3, Vector3};
use rerun::blueprint::components::{
    BackgroundKind, ContainerKind, Corner2D, Eye3DKind, LoopMode, PanelState, PlayState, RootContainer,
};
use rerun::external::re_sdk_types::blueprint::archetypes::{
    Background, ContainerBlueprint, EyeControls3D, LineGrid3D, PanelBlueprint, PlotLegend, TimePanelBlueprint,
    ViewBlueprint, ViewContents, ViewportBlueprint, VisibleTimeRanges, VisualBounds2D,
};
use rerun::external::re_sdk_types::datatypes;
use rerun::{AsComponents, TimeCell, TimePoint};

use super::arm::{Posture, reach, rest};
use super::canvas::Row;
use super::chart::SHEET;
use super::renderer::{Magnified, legend_region, pairs_region, significant};
use super::{names, style};
use crate::profile::Profile;
use crate::session::journal::IdentifiedText;
use crate::session::state::Session;

/// The purpose of a recording.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Purpose {
    /// A session: its story is played.
    Story,
    /// A session that is being measured: a viewer follows the latest pose.
    Live,
    /// A plan: the arm drives through it.
    Plan,
}

/// What the layout depends on.
pub(super) struct Contents<'a> {
    pub(super) purpose: Purpose,
    /// The result, and how many times larger its errors are drawn.
    pub(super) result: Option<(&'a IdentifiedText, Magnified)>,
    /// There is a search to show.
    pub(super) has_search: bool,
    pub(super) has_report: bool,
    /// Series that have values. A plot of others would be empty.
    pub(super) series: &'a [&'static str],
    pub(super) eye: Eye,
}

/// Where the camera is, and the point that it looks at.
#[derive(Clone, Copy, Debug)]
pub(super) struct Eye {
    position: Point3<f64>,
    target: Point3<f64>,
}

/// An instrument farther than this many reaches away would leave only a few pixels for the arm.
const FAR: f64 = 3.0;
/// Distance of the camera in radii of what it shows.
const DISTANCE: f64 = 1.9;
/// Most postures that it is made for.
const POSTURES: usize = 100;

/// Returns the camera that shows these places.
pub(super) fn eye_on(places: &[Point3<f64>]) -> Eye {
    eye_of(places, None)
}

/// Returns the camera that shows the arm and its poses, and the instrument at the edge.
pub(super) fn eye(profile: &Profile, session: &Session, instrument: Option<Point3<f64>>) -> Eye {
    let planned = session.rows.iter().map(|row| row.planned.configuration.clone());
    let measured = session.samples.iter().map(|sample| session.configuration_of(sample));
    let mut all: Vec<Vec<f64>> = planned.chain(measured).collect();
    if all.is_empty() {
        all.push(rest(profile));
    }
    let some = all.iter().step_by(all.len().div_ceil(POSTURES));
    let places: Vec<Point3<f64>> = some
        .flat_map(|q| {
            let posture = Posture::nominal(profile, q);
            let frames = posture.frames.into_iter().map(|frame| Point3::from(frame.translation.vector));
            frames.chain([posture.reflector]).collect::<Vec<_>>()
        })
        .collect();
    eye_of(&places, instrument.filter(|place| place.coords.norm() < FAR * reach(profile)))
}

fn eye_of(places: &[Point3<f64>], near: Option<Point3<f64>>) -> Eye {
    let (low, high) = places
        .iter()
        .fold((Point3::origin(), Point3::origin()), |(low, high), place| (low.inf(place), high.sup(place)));
    let centre = nalgebra::center(&low, &high);
    let radius = places.iter().map(|place| (place - centre).norm()).fold(0.1, f64::max);
    // The side from which most is seen: across the line to the instrument, or else to the middle of the poses.
    let aim = near.map_or(centre.coords, |place| place - centre);
    let towards = Vector3::new(aim.x, aim.y, 0.0).try_normalize(1e-6).unwrap_or_else(Vector3::x);
    let aside = Vector3::new(towards.y, -towards.x, 0.0);
    let behind = near.map_or(0.0, |place| ((place - centre).norm() - radius).clamp(0.0, radius));
    let target = centre + towards * (0.35 * behind);
    let from = if near.is_some() { aside * 0.85 - towards * 0.6 } else { towards * 0.8 + aside * 0.6 };
    let from = (from + Vector3::z() * 0.42).normalize();
    Eye { position: target + from * (DISTANCE * radius + 0.6 * behind), target }
}

/// Returns the rows of the layout.
pub(super) fn rows(contents: &Contents<'_>) -> Vec<Row> {
    let mut layout = Builder::default();
    let texts = [("The result", names::HEADLINE), ("The story", names::CAPTION)];
    let texts = texts.map(|(name, entity)| layout.entity("TextDocument", name, entity));
    let top = layout.shared(ContainerKind::Horizontal, "", &[2.0, 1.0], &texts);
    if let Some((result, magnified)) = contents.result {
        let pictures = before_and_after(contents, result, magnified, &mut layout);
        let below = below(contents, result, &mut layout);
        layout.shared(ContainerKind::Vertical, "", &[0.17, 0.5, 0.33], &[top, pictures, below]);
    } else {
        let cell = layout.picture("The cell", contents.eye, &["nominal", "trail/path"]);
        let beside = beside(contents, &mut layout);
        let middle = layout.shared(ContainerKind::Horizontal, "", &[1.7, 1.0], &[cell, beside]);
        layout.shared(ContainerKind::Vertical, "", &[0.17, 0.83], &[top, middle]);
    }
    let play = if contents.purpose == Purpose::Live { PlayState::Following } else { PlayState::Playing };
    layout.finish(play)
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

    /// Adds a row or a column that is divided in these shares. It needs a name where it is a tab.
    fn shared(&mut self, kind: ContainerKind, name: &str, shares: &[f32], contents: &[String]) -> String {
        let container = ContainerBlueprint::new(kind).with_display_name(name);
        let shares = shares.iter().copied();
        let container = match kind {
            ContainerKind::Horizontal => container.with_col_shares(shares),
            _ => container.with_row_shares(shares),
        };
        self.container(&container, contents)
    }

    /// Adds the panels around the views.
    fn finish(mut self, play: PlayState) -> Vec<Row> {
        // The container that was made last holds all others.
        let root = RootContainer(datatypes::Uuid { bytes: u128::from(self.items).to_be_bytes() });
        let viewport =
            ViewportBlueprint::new().with_root_container(root).with_auto_layout(false).with_auto_views(false);
        self.put("viewport", &viewport);
        for panel in ["blueprint_panel", "selection_panel"] {
            self.put(panel, &PanelBlueprint::new().with_state(PanelState::Collapsed));
        }
        let time_panel = TimePanelBlueprint::new()
            .with_state(PanelState::Collapsed)
            .with_timeline(names::STORY)
            .with_playback_speed(1.0)
            .with_loop_mode(LoopMode::Off)
            .with_play_state(play);
        self.put("time_panel", &time_panel);
        self.rows
    }

    /// Adds a chart of which a region is visible.
    fn sheet(&mut self, name: &str, entity: &str, [low, high]: [[f64; 2]; 2]) -> String {
        let path = self.entity("2D", name, entity);
        let region = datatypes::Range2D {
            x_range: datatypes::Range1D([low[0], high[0]]),
            y_range: datatypes::Range1D([low[1], high[1]]),
        };
        self.put(&format!("{path}/VisualBounds2D"), &VisualBounds2D::new(region));
        path
    }

    /// Adds a 3D view of the cell with these parts of the world besides.
    fn picture(&mut self, name: &str, eye: Eye, parts: &[&str]) -> String {
        let shared = ["cell", "tracker", "trail/plan", "trail/measured", "next", "unused"];
        let contents: Vec<String> =
            shared.iter().chain(parts).map(|part| format!("+ /{}/{part}/**", names::WORLD)).collect();
        let path = self.view("3D", name, names::WORLD, &contents.iter().map(String::as_str).collect::<Vec<_>>());
        let controls = EyeControls3D::new()
            .with_kind(Eye3DKind::Orbital)
            .with_position(style::at(&eye.position))
            .with_look_target(style::at(&eye.target))
            .with_eye_up([0.0, 0.0, 1.0]);
        self.put(&format!("{path}/EyeControls3D"), &controls);
        self.put(&format!("{path}/LineGrid3D"), &LineGrid3D::new().with_visible(false));
        let background = Background::new(BackgroundKind::SolidColor).with_color(style::BACKGROUND);
        self.put(&format!("{path}/Background"), &background);
        for trail in shared.iter().chain(parts).filter(|part| part.starts_with(names::TRAIL)) {
            self.put(&format!("{path}/ViewContents/overrides/{}/{trail}/visualizers", names::WORLD), &self::trail());
        }
        path
    }
}

/// Returns the rows of the layout of a picture of targets.
pub(super) fn rows_of_targets(eye: Eye, magnified: f64) -> Vec<Row> {
    let mut layout = Builder::default();
    let headline = layout.entity("TextDocument", "The result", names::HEADLINE);
    let picture =
        layout.picture(&format!("Targets, corrections drawn {magnified} x"), eye, &["targets", "trail/targets"]);
    let legend = layout.sheet("Scale", names::LEGEND, legend_region());
    let below = layout.shared(ContainerKind::Horizontal, "", &[1.0, 0.12], &[picture, legend]);
    layout.shared(ContainerKind::Vertical, "", &[0.17, 0.83], &[headline, below]);
    layout.finish(PlayState::Playing)
}

/// Adds both arms beside each other, and a view of the errors that are left, magnified.
fn before_and_after(
    contents: &Contents<'_>,
    result: &IdentifiedText,
    magnified: Magnified,
    layout: &mut Builder,
) -> String {
    let figure = |of_nominal: bool| {
        let verification = result.summary.verification.as_ref()?;
        let model = if of_nominal { &verification.nominal } else { &verification.identified };
        Some(format!(", mean error {} mm", significant(model.position_mm?.mean)))
    };
    let name = |arm: &str, of_nominal| {
        format!("{arm} arm{}; drawn {} x", figure(of_nominal).unwrap_or_default(), magnified.both)
    };
    let before = layout.picture(
        &format!("BEFORE: {}", name("nominal", true)),
        contents.eye,
        &["nominal", "before", "trail/before"],
    );
    let legend = layout.sheet("Scale", names::LEGEND, legend_region());
    let after = layout.picture(
        &format!("AFTER: {}", name("identified", false)),
        contents.eye,
        &["identified", "after", "trail/after"],
    );
    let pair = layout.shared(ContainerKind::Horizontal, "Before | after", &[1.0, 0.17, 1.0], &[before, legend, after]);
    let residual = format!("What is left, drawn {} x", magnified.residual);
    let residual = layout.picture(&residual, contents.eye, &["identified", "residual", "uncertainty"]);
    layout.named(ContainerKind::Tabs, "Before and after", &[pair, residual])
}

/// Adds charts and texts of a result.
fn below(contents: &Contents<'_>, result: &IdentifiedText, layout: &mut Builder) -> String {
    let sheet = [[0.0, 0.0], SHEET];
    let mut charts = vec![layout.sheet("Position error at every pose", names::ERRORS, sheet)];
    charts.extend(plots(contents, layout));
    let charts = layout.named(ContainerKind::Tabs, "Errors", &charts);
    let mut others = vec![layout.sheet("Parameters, with 2 sigma", names::PARAMETERS, sheet)];
    if !result.summary.joint_errors.is_empty() {
        others.push(layout.sheet("Joints, µrad", names::JOINTS, sheet));
    }
    others.push(layout.sheet("All pairs", names::PAIRS, pairs_region()));
    others.extend(texts(contents, layout));
    let others = layout.named(ContainerKind::Tabs, "Details", &others);
    layout.shared(ContainerKind::Horizontal, "", &[1.0, 1.0], &[charts, others])
}

/// Adds what is beside the cell while there is no result.
fn beside(contents: &Contents<'_>, layout: &mut Builder) -> String {
    let plots = plots(contents, layout);
    let texts = texts(contents, layout);
    let texts = layout.named(ContainerKind::Tabs, "Texts", &texts);
    let rows: Vec<String> = plots.into_iter().chain([texts]).collect();
    layout.container(&ContainerBlueprint::new(ContainerKind::Vertical), &rows)
}

/// Adds plots of the measurement and the search, as far as there is something to see.
fn plots(contents: &Contents<'_>, layout: &mut Builder) -> Vec<String> {
    let mut plots = Vec::new();
    let groups: [(&str, &[&str]); 2] = [
        ("Measurement, mm", &[names::PREDICTED, names::SCATTER, names::DRIFT]),
        ("Temperature, °C", &[names::TEMPERATURE]),
    ];
    for (name, paths) in groups {
        let known: Vec<String> =
            paths.iter().filter(|path| contents.series.contains(path)).map(|path| format!("+ /{path}")).collect();
        if !known.is_empty() {
            let plot = layout.view("TimeSeries", name, "", &known.iter().map(String::as_str).collect::<Vec<_>>());
            layout.put(&format!("{plot}/PlotLegend"), &PlotLegend::new().with_corner(Corner2D::LeftTop));
            plots.push(plot);
        }
    }
    if contents.has_search {
        plots.push(layout.sheet("Search for poses", names::SEARCH, [[0.0, 0.0], SHEET]));
    }
    plots
}

/// Adds the texts.
fn texts(contents: &Contents<'_>, layout: &mut Builder) -> Vec<String> {
    let report = contents.has_report.then(|| layout.entity("TextDocument", "Report", names::REPORT));
    let log = layout.entity("TextLog", "Log", names::LOG);
    let guide = layout.entity("TextDocument", "How to read this", names::GUIDE);
    report.into_iter().chain([log, guide]).collect()
}

/// Returns the range of all rows up to the time cursor.
fn trail() -> VisibleTimeRanges {
    VisibleTimeRanges::new([names::STORY, names::TIME].map(|timeline| datatypes::VisibleTimeRange {
        timeline: timeline.into(),
        range: datatypes::TimeRange {
            start: datatypes::TimeRangeBoundary::Infinite,
            end: datatypes::TimeRangeBoundary::CursorRelative(datatypes::TimeInt(0)),
        },
    }))
}
