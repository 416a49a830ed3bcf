//! Drawing a scene into dots, solids first, and placing its labels.

use nalgebra::{Point3, Vector3};

use super::camera::{Camera, Framing, View};
use super::raster::{Material, Raster, Solid, Stroke};
use super::scene::{ArmStyle, DrawnArm, ErrorsOf, MarkKind, Scene};
use crate::tui::glyphs::Glyphs;
use crate::tui::theme::Role;

/// Radius around the reflector that is framed (m).
const AROUND_REFLECTOR: f64 = 0.25;
/// Largest number of lines of the floor grid on each side of the base.
const GRID: i32 = 4;
/// Columns below which words are left out.
const FEW_COLUMNS: usize = 30;

/// A word or symbol over the picture.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Label {
    pub(super) column: usize,
    pub(super) row: usize,
    pub(super) role: Role,
    symbol: Symbol,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Symbol {
    Word(&'static str),
    Next,
    Reflector,
    Doubt,
}

impl Label {
    /// The text of the label.
    pub(super) const fn text(&self, glyphs: Glyphs) -> &'static str {
        match self.symbol {
            Symbol::Word(word) => word,
            Symbol::Next => glyphs.next(),
            Symbol::Reflector => glyphs.reflector(),
            Symbol::Doubt => glyphs.doubt(),
        }
    }
}

/// Draws the scene, and returns its labels.
pub(super) fn scene(scene: &Scene, camera: &Camera, raster: &mut Raster) -> Vec<Label> {
    let shown = match (camera.framing, scene.reflector()) {
        (Framing::Reflector, Some(reflector)) => vec![(reflector, AROUND_REFLECTOR)],
        (Framing::All, _) => scene.around_all(),
        (Framing::Arm | Framing::Reflector, _) => scene.around_errors(),
    };
    let view = camera.view(raster.width(), raster.height(), &shown);
    let floor = scene.floor.unwrap_or(f64::NEG_INFINITY);
    let mut part = 1;
    for arm in scene.arms.iter().filter(|arm| arm.style == ArmStyle::Solid) {
        for body in &arm.bodies {
            let solid = Solid { from: body.from, to: body.to, radius: body.radius, above: floor };
            raster.solid(&view, &solid, Material::Nominal, part);
            part = part.saturating_add(1);
        }
        if let (Some(flange), Some(reflector)) = (arm.joints.last(), arm.reflector) {
            raster.line(&view, flange, &reflector, Material::Nominal, Stroke::Thick);
        }
    }
    if let Some(tracker) = scene.tracker {
        draw_tracker(&view, &tracker, floor, raster, part);
    }
    if let Some(height) = scene.floor {
        draw_floor(&view, height, scene.radius(), raster);
    }
    for space in &scene.keep_out {
        draw_box(&view, &space.min, &space.max, raster);
    }
    for arm in scene.arms.iter().filter(|arm| arm.style == ArmStyle::Dashed) {
        draw_dashed(&view, arm, raster);
    }
    if let Some(beam) = &scene.beam {
        raster.line(&view, &beam.from, &beam.to, Material::Beam, Stroke::Dashed);
    }
    let material = match scene.errors_of {
        ErrorsOf::Nominal => Material::NominalError,
        ErrorsOf::Identified => Material::IdentifiedError,
    };
    for error in &scene.errors {
        let tip = error.at + error.error * scene.exaggeration;
        raster.line(&view, &error.at, &tip, material, Stroke::ByDepth);
        draw_spot(&view, &tip, material, raster);
    }
    for mark in &scene.marks {
        match mark.kind {
            MarkKind::Open => {
                // Two dots, to tell it from a dot of the floor.
                if let Some(seen) = view.project(&mark.at) {
                    raster.dot(seen.x, seen.y, seen.depth, Material::Open);
                    raster.dot(seen.x, seen.y + 1.0, seen.depth, Material::Open);
                }
            }
            MarkKind::Done => draw_spot(&view, &mark.at, Material::Done, raster),
            MarkKind::Next | MarkKind::Doubt => {}
        }
    }
    labels(scene, &view, raster)
}

/// Draws a spot of 2 × 2 dots.
fn draw_spot(view: &View, at: &Point3<f64>, material: Material, raster: &mut Raster) {
    if let Some(seen) = view.project(at) {
        for (x, y) in [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)] {
            raster.dot(seen.x + x, seen.y + y, seen.depth, material);
        }
    }
}

/// Draws the tracker as a head on three legs.
fn draw_tracker(view: &View, tracker: &Point3<f64>, floor: f64, raster: &mut Raster, part: u16) {
    let head = Solid { from: *tracker, to: tracker - Vector3::z() * 0.25, radius: 0.11, above: floor };
    raster.solid(view, &head, Material::Tracker, part);
    let foot = if floor.is_finite() { floor } else { tracker.z - 1.0 };
    for turn in 0..3 {
        let (sin, cos) = (f64::from(turn) * std::f64::consts::TAU / 3.0).sin_cos();
        let hip = tracker - Vector3::z() * 0.3;
        let ground = Point3::new(tracker.x + 0.35 * cos, tracker.y + 0.35 * sin, foot);
        raster.line(view, &hip, &ground, Material::Tracker, Stroke::ByDepth);
    }
}

/// Draws the floor as squares of a round size around the base, and the axes x and y.
fn draw_floor(view: &View, height: f64, radius: f64, raster: &mut Raster) {
    let size = [0.1, 0.25, 0.5, 1.0].into_iter().find(|size| size * f64::from(GRID) >= radius).unwrap_or(2.0);
    let lines = (1..GRID).find(|lines| size * f64::from(*lines) >= radius).unwrap_or(GRID);
    let end = size * f64::from(lines);
    for line in -lines..=lines {
        let at = size * f64::from(line);
        let ends = [(-end, at, end, at), (at, -end, at, end)];
        for (x0, y0, x1, y1) in ends {
            let (from, to) = (Point3::new(x0, y0, height), Point3::new(x1, y1, height));
            raster.line(view, &from, &to, Material::Floor, Stroke::Dotted);
        }
    }
    for axis in [Vector3::x(), Vector3::y()] {
        let origin = Point3::new(0.0, 0.0, height);
        raster.line(view, &origin, &(origin + axis * axis_length(radius)), Material::Floor, Stroke::ByDepth);
    }
}

fn axis_length(radius: f64) -> f64 {
    0.75 * radius
}

fn draw_box(view: &View, min: &Point3<f64>, max: &Point3<f64>, raster: &mut Raster) {
    let corner = |bits: u8| {
        let pick = |bit: u8, low: f64, high: f64| if bits >> bit & 1 == 1 { high } else { low };
        Point3::new(pick(0, min.x, max.x), pick(1, min.y, max.y), pick(2, min.z, max.z))
    };
    for from in 0..8_u8 {
        for bit in 0..3 {
            let to = from | 1 << bit;
            if to != from {
                raster.line(view, &corner(from), &corner(to), Material::KeepOut, Stroke::ByDepth);
            }
        }
    }
}

/// Draws dashes from joint to joint, and a spot on each.
fn draw_dashed(view: &View, arm: &DrawnArm, raster: &mut Raster) {
    let points: Vec<&Point3<f64>> = arm.joints.iter().chain(&arm.reflector).collect();
    for pair in points.windows(2) {
        if let [from, to] = pair {
            raster.line(view, from, to, Material::Identified, Stroke::Dashed);
        }
    }
    for point in points {
        draw_spot(view, point, Material::Identified, raster);
    }
}

fn labels(scene: &Scene, view: &View, raster: &Raster) -> Vec<Label> {
    let mut labels = Vec::new();
    let mut put = |at: &Point3<f64>, symbol: Symbol, role: Role, hides: bool| {
        let Some(seen) = view.project(at) else { return };
        if hides && raster.is_hidden(seen.x, seen.y, seen.depth) {
            return;
        }
        let inside = |value: f64, size: usize| value >= 0.0 && value < size as f64;
        if inside(seen.x, raster.width()) && inside(seen.y, raster.height()) {
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "inside the picture")]
            let (column, row) = (seen.x as usize / 2, seen.y as usize / 4);
            labels.push(Label { column, row, role, symbol });
        }
    };
    let axis = axis_length(scene.radius()) * 1.08;
    if let Some(height) = scene.floor {
        put(&Point3::new(axis, 0.0, height), Symbol::Word("x"), Role::Dim, true);
        put(&Point3::new(0.0, axis, height), Symbol::Word("y"), Role::Dim, true);
    }
    if let Some(tracker) = scene.tracker.filter(|_| raster.width() >= 2 * FEW_COLUMNS) {
        put(&(tracker + Vector3::z() * 0.25), Symbol::Word("tracker"), Role::Title, true);
    }
    if let Some(reflector) = scene.reflector() {
        put(&reflector, Symbol::Reflector, Role::Title, true);
    }
    for mark in &scene.marks {
        match mark.kind {
            MarkKind::Next => put(&mark.at, Symbol::Next, Role::Warn, false),
            MarkKind::Doubt => put(&mark.at, Symbol::Doubt, Role::Alarm, false),
            MarkKind::Open | MarkKind::Done => {}
        }
    }
    labels
}
