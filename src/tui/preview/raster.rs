//! A grid of dots with a depth buffer: capsules, lines and points go in, lit dots come out.
//!
//! Solids are filled with a dither of their brightness and outlined at steps in depth; lines are dotted more widely the farther away
//! they are. Depth can therefore be read with a single colour, and near objects hide far ones.

use std::ops::Range;

use nalgebra::{Point3, Vector3};

use super::camera::{Ray, View};

/// Largest number of samples of one line, as a multiple of width + height.
const SAMPLES: usize = 4;
/// Difference in depth up to which two surfaces touch (m): a crease, not a step.
const CREASE: f32 = 0.03;
/// Order of the dither (Bayer, 4 × 4).
const DITHER: [u8; 16] = [0, 8, 2, 10, 12, 4, 14, 6, 3, 11, 1, 9, 15, 7, 13, 5];
/// Direction of the light in screen axes: left, above, in front.
const LIGHT: Vector3<f64> = Vector3::new(-0.45, 0.65, 0.61);

/// Material of a dot. In a cell with several materials the later one wins.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Material {
    /// Nothing.
    #[default]
    Empty,
    /// Floor grid.
    Floor,
    /// Boxes to keep out of.
    KeepOut,
    /// The nominal arm.
    Nominal,
    Tracker,
    /// The identified arm.
    Identified,
    Beam,
    /// A planned point that is not measured yet.
    Open,
    /// A measured point.
    Done,
    /// An error of the nominal arm.
    NominalError,
    /// An error of the identified arm.
    IdentifiedError,
}

#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Dot {
    material: Material,
    /// Number of the solid; 0 for lines and empty dots.
    part: u16,
    /// Brightness of a solid, 0 … 15. A line is always lit.
    tone: u8,
}

/// How a line is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Stroke {
    /// Solid in front, dotted more widely with depth.
    ByDepth,
    /// Dotted, more widely with depth.
    Dotted,
    Dashed,
    /// Two dots wide.
    Thick,
}

/// A capsule.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Solid {
    /// One end (m).
    pub(super) from: Point3<f64>,
    /// The other (m).
    pub(super) to: Point3<f64>,
    /// Distance to the surface (m).
    pub(super) radius: f64,
    /// The part below this height is hidden (m).
    pub(super) above: f64,
}

/// A grid of dots with depths.
#[derive(Clone, Debug)]
pub(super) struct Raster {
    width: usize,
    height: usize,
    depths: Vec<f32>,
    dots: Vec<Dot>,
}

impl Raster {
    /// An empty raster of `width` × `height` dots.
    pub(super) fn new(width: usize, height: usize) -> Self {
        let count = width * height;
        Self { width, height, depths: vec![f32::INFINITY; count], dots: vec![Dot::default(); count] }
    }

    /// Dots per line.
    pub(super) const fn width(&self) -> usize {
        self.width
    }

    /// Lines.
    pub(super) const fn height(&self) -> usize {
        self.height
    }

    fn index(&self, x: f64, y: f64) -> Option<usize> {
        let (x, y) = (whole(x)?, whole(y)?);
        (x < self.width && y < self.height).then_some(y * self.width + x)
    }

    /// Whether a dot at this position and depth is hidden.
    pub(super) fn is_hidden(&self, x: f64, y: f64, depth: f64) -> bool {
        self.index(x, y).is_some_and(|index| f64::from(self.depths[index]) < depth - f64::from(CREASE))
    }

    /// Sets a dot, unless it is hidden.
    pub(super) fn dot(&mut self, x: f64, y: f64, depth: f64, material: Material) {
        let Some(index) = self.index(x, y) else { return };
        let depth = single(depth);
        // A dot on a surface is drawn in front of it.
        if depth <= self.depths[index] + CREASE {
            self.depths[index] = self.depths[index].min(depth);
            self.dots[index] = Dot { material, part: 0, tone: 15 };
        }
    }

    /// Draws a line.
    pub(super) fn line(
        &mut self,
        view: &View,
        from: &Point3<f64>,
        to: &Point3<f64>,
        material: Material,
        stroke: Stroke,
    ) {
        let most = SAMPLES * (self.width + self.height);
        let length = match (view.project(from), view.project(to)) {
            (Some(a), Some(b)) => (a.x - b.x).abs().max((a.y - b.y).abs()),
            _ => most as f64,
        };
        let steps = whole(length * 1.5).unwrap_or(most).clamp(1, most.max(1));
        let mut drawn = 0.0_f64;
        let mut last: Option<(f64, f64)> = None;
        for step in 0..=steps {
            let at = from + (to - from) * (step as f64 / steps as f64);
            let Some(seen) = view.project(&at) else {
                last = None;
                continue;
            };
            if let Some((x, y)) = last {
                drawn += (seen.x - x).abs().max((seen.y - y).abs());
            }
            last = Some((seen.x, seen.y));
            let farness = view.farness(seen.depth);
            let is_lit = match stroke {
                Stroke::Thick => true,
                Stroke::Dashed => drawn % 6.0 < 3.5,
                Stroke::ByDepth => farness < 0.35 || drawn % (1.0 + 3.0 * farness).round() < 1.0,
                Stroke::Dotted => drawn % (3.0 + 3.0 * farness).round() < 1.0,
            };
            if is_lit {
                self.dot(seen.x, seen.y, seen.depth, material);
                if stroke == Stroke::Thick {
                    self.dot(seen.x + 1.0, seen.y, seen.depth, material);
                    self.dot(seen.x, seen.y + 1.0, seen.depth, material);
                }
            }
        }
    }

    /// Draws a solid. `part` distinguishes it from its neighbours.
    pub(super) fn solid(&mut self, view: &View, solid: &Solid, material: Material, part: u16) {
        let Some(Extent { columns, rows, band }) = self.extent(view, solid) else { return };
        for y in rows {
            for x in columns.clone() {
                if band.is_some_and(|band| !band.may_cover(x, y)) {
                    continue;
                }
                let Some((depth, normal)) = hit(&view.ray(x, y), solid) else { continue };
                let index = y * self.width + x;
                let near = single(depth);
                if near >= self.depths[index] {
                    continue;
                }
                let facing = view.turned(&normal).dot(&LIGHT).max(0.0);
                let brightness = (0.08 + 0.62 * facing) * (1.0 - 0.35 * view.farness(depth));
                self.depths[index] = near;
                self.dots[index] = Dot { material, part, tone: tone(brightness) };
            }
        }
    }

    /// Dots that a solid can cover.
    fn extent(&self, view: &View, solid: &Solid) -> Option<Extent> {
        let all = Extent { columns: 0..self.width, rows: 0..self.height, band: None };
        let mut band = Band { from: (0.0, 0.0), to: (0.0, 0.0), half: 0.0 };
        let mut low = (f64::INFINITY, f64::INFINITY);
        let mut high = (f64::NEG_INFINITY, f64::NEG_INFINITY);
        for end in [&solid.from, &solid.to] {
            // A solid that is partly behind the eye may be anywhere.
            let Some(seen) = view.project(end) else { return Some(all) };
            let nearest = seen.depth - solid.radius;
            if nearest <= 0.05 {
                return Some(all);
            }
            // Wide enough for a sphere seen at an angle.
            let around = 1.0 + solid.radius * view.scale_at(nearest) * 1.3;
            band = Band { from: band.to, to: (seen.x, seen.y), half: around.max(band.half) };
            low = (low.0.min(seen.x - around), low.1.min(seen.y - around));
            high = (high.0.max(seen.x + around), high.1.max(seen.y + around));
        }
        let clamped = |value: f64, size: usize| whole(value.max(0.0)).unwrap_or(size).min(size);
        let (left, right) = (clamped(low.0, self.width), clamped(high.0 + 1.0, self.width));
        let (top, bottom) = (clamped(low.1, self.height), clamped(high.1 + 1.0, self.height));
        let extent = Extent { columns: left..right, rows: top..bottom, band: Some(band) };
        (left < right && top < bottom).then_some(extent)
    }

    /// Whether a dot is lit, and whether it belongs to a line or an outline.
    fn is_lit(&self, x: usize, y: usize) -> (bool, bool) {
        let index = y * self.width + x;
        let dot = self.dots[index];
        if dot.material == Material::Empty {
            return (false, false);
        }
        if dot.part == 0 || self.is_outline(x, y, index, dot) {
            return (true, true);
        }
        (dot.tone > DITHER[(y % 4) * 4 + x % 4], false)
    }

    fn is_outline(&self, x: usize, y: usize, index: usize, dot: Dot) -> bool {
        let here = self.depths[index];
        let differs = |other: usize| {
            let (there, neighbour) = (self.depths[other], self.dots[other]);
            neighbour.part != dot.part
                && (there > here + CREASE || ((there - here).abs() <= CREASE && neighbour.part < dot.part))
        };
        (x > 0 && differs(index - 1))
            || (x + 1 < self.width && differs(index + 1))
            || (y > 0 && differs(index - self.width))
            || (y + 1 < self.height && differs(index + self.width))
    }

    /// The content of a cell of 2 × 4 dots.
    pub(super) fn cell(&self, column: usize, row: usize) -> CellDots {
        let mut cell = CellDots::default();
        let mut weights = [(Material::Empty, 0_u32); 8];
        for (place, weight) in weights.iter_mut().enumerate() {
            let (x, y) = (column * 2 + place % 2, row * 4 + place / 2);
            if x >= self.width || y >= self.height {
                continue;
            }
            let dot = self.dots[y * self.width + x];
            let (lit, is_line) = self.is_lit(x, y);
            if lit {
                cell.lit |= 1 << place;
                *weight = (dot.material, if dot.part == 0 { 3 } else { 2 });
            }
            if is_line {
                cell.lines |= 1 << place;
            } else if dot.part != 0 {
                cell.tone += u32::from(dot.tone);
            }
        }
        if cell.lit == 0 {
            return cell;
        }
        if let Some((first, _)) = weights.iter().find(|(_, weight)| *weight > 0)
            && weights.iter().all(|(material, weight)| *weight == 0 || material == first)
        {
            cell.material = *first;
            return cell;
        }
        cell.material = weights
            .iter()
            .map(|(material, _)| *material)
            .max_by_key(|wanted| {
                let weight: u32 = weights.iter().filter(|(other, _)| other == wanted).map(|(_, weight)| weight).sum();
                (weight, *wanted)
            })
            .unwrap_or_default();
        cell
    }
}

/// The dots of a cell: bit 2·row + column.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct CellDots {
    /// All lit dots.
    pub(super) lit: u8,
    /// Dots of lines and outlines.
    pub(super) lines: u8,
    /// Sum of the brightness of the other dots, 0 … 120.
    pub(super) tone: u32,
    /// Prevailing material.
    pub(super) material: Material,
}

/// Dots that a solid can cover.
#[derive(Clone, Debug)]
struct Extent {
    columns: Range<usize>,
    rows: Range<usize>,
    /// Narrower bound, if there is one.
    band: Option<Band>,
}

/// All dots within a distance of a line.
#[derive(Clone, Copy, Debug)]
struct Band {
    from: (f64, f64),
    to: (f64, f64),
    half: f64,
}

impl Band {
    /// Whether the centre of a dot is inside.
    fn may_cover(&self, x: usize, y: usize) -> bool {
        let (x, y) = (x as f64 + 0.5 - self.from.0, y as f64 + 0.5 - self.from.1);
        let (dx, dy) = (self.to.0 - self.from.0, self.to.1 - self.from.1);
        let length = dx * dx + dy * dy;
        let along = if length > 0.0 { ((x * dx + y * dy) / length).clamp(0.0, 1.0) } else { 0.0 };
        let (aside, above) = (x - along * dx, y - along * dy);
        aside * aside + above * above <= self.half * self.half
    }
}

/// Depth and outward normal where a ray enters a solid (Ericson, *Real-Time Collision Detection*, 5.3.7).
fn hit(ray: &Ray, solid: &Solid) -> Option<(f64, Vector3<f64>)> {
    let axis = solid.to - solid.from;
    let start = ray.origin - solid.from;
    let (dd, dn, nn) = (ray.direction.norm_squared(), ray.direction.dot(&axis), axis.norm_squared());
    let (sd, sn) = (start.dot(&ray.direction), start.dot(&axis));
    let rr = solid.radius * solid.radius;
    let mut best: Option<f64> = None;
    let a = nn * dd - dn * dn;
    if nn > 1e-12 && a > 1e-12 {
        let b = nn * sd - sn * dn;
        let c = nn * (start.norm_squared() - rr) - sn * sn;
        let root = b * b - a * c;
        if root < 0.0 {
            return None;
        }
        let t = (-b - root.sqrt()) / a;
        let along = sn + t * dn;
        if t > 0.0 && along >= 0.0 && along <= nn {
            best = Some(t);
        }
    }
    let is_on_side = best.is_some();
    for end in [solid.from, solid.to] {
        if is_on_side {
            break;
        }
        let from_end = ray.origin - end;
        let b = from_end.dot(&ray.direction);
        let root = b * b - dd * (from_end.norm_squared() - rr);
        if root >= 0.0 {
            let t = (-b - root.sqrt()) / dd;
            if t > 0.0 && best.is_none_or(|best| t < best) {
                best = Some(t);
            }
        }
    }
    let depth = best.filter(|depth| depth.is_finite())?;
    let point = ray.origin + ray.direction * depth;
    if point.z < solid.above {
        return None;
    }
    let along = if nn > 1e-12 { ((point - solid.from).dot(&axis) / nn).clamp(0.0, 1.0) } else { 0.0 };
    let normal = (point - (solid.from + axis * along)) / solid.radius.max(1e-9);
    Some((depth, normal))
}

/// The integer part of a number that is not negative.
fn whole(value: f64) -> Option<usize> {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "checked to be small and not negative")]
    (0.0..1e9).contains(&value).then_some(value as usize)
}

/// Converts to single precision, which is enough for depths.
const fn single(value: f64) -> f32 {
    #[expect(clippy::cast_possible_truncation, reason = "less precise, never wrong: the largest become infinite")]
    let single = value as f32;
    single
}

/// Maps a brightness of 0 … 1 to 0 … 15.
fn tone(brightness: f64) -> u8 {
    whole((brightness * 16.0).clamp(0.0, 15.0)).and_then(|tone| u8::try_from(tone).ok()).unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::super::camera::{Camera, Projection};
    use super::*;

    fn flat(width: usize, height: usize) -> View {
        let mut camera = Camera::from_direction(0.0, 0.0);
        camera.projection = Projection::Orthographic;
        camera.view(width, height, &[(Point3::origin(), 1.0)])
    }

    fn lit(raster: &Raster) -> String {
        (0..raster.height())
            .map(|y| (0..raster.width()).map(|x| if raster.is_lit(x, y).1 { '#' } else { '.' }).collect::<String>())
            .collect::<Vec<_>>()
            .join("\n")
    }

    #[test]
    fn a_ball_is_a_ring() {
        let mut raster = Raster::new(12, 12);
        let ball = Solid { from: Point3::origin(), to: Point3::origin(), radius: 0.6, above: -9.0 };
        raster.solid(&flat(12, 12), &ball, Material::Nominal, 1);
        insta::assert_snapshot!(lit(&raster), @r"
        ............
        ............
        ............
        ....####....
        ...#....#...
        ...#....#...
        ...#....#...
        ...#....#...
        ....####....
        ............
        ............
        ............
        ");
    }

    #[test]
    fn near_hides_far() {
        let view = flat(12, 12);
        let mut raster = Raster::new(12, 12);
        let ball = Solid { from: Point3::origin(), to: Point3::origin(), radius: 0.6, above: -9.0 };
        raster.solid(&view, &ball, Material::Nominal, 1);
        let behind = Point3::new(-1.0, -0.9, 0.0);
        let in_front = Point3::new(1.0, -0.9, 0.0);
        let across = Vector3::new(0.0, 1.8, 0.0);
        let before = lit(&raster);
        raster.line(&view, &behind, &(behind + across), Material::Beam, Stroke::Thick);
        let middle = |text: &str| text.lines().nth(6).unwrap().chars().skip(3).take(5).collect::<String>();
        assert_eq!(middle(&lit(&raster)), middle(&before));
        raster.line(&view, &in_front, &(in_front + across), Material::Beam, Stroke::Thick);
        assert_eq!(middle(&lit(&raster)), "#####");
        assert_eq!(raster.cell(2, 1).material, Material::Beam);
    }

    #[test]
    fn degenerate_solids_and_lines_draw_nothing_wrong() {
        let view = flat(20, 20);
        let mut raster = Raster::new(20, 20);
        let nan = Point3::new(f64::NAN, 0.0, 0.0);
        let far = Point3::new(1e300, -1e300, 1e300);
        for point in [nan, far] {
            raster.line(&view, &point, &Point3::origin(), Material::Beam, Stroke::Dotted);
            raster.solid(&view, &Solid { from: point, to: point, radius: 0.1, above: 0.0 }, Material::Nominal, 1);
        }
        raster.solid(&view, &Solid { from: nan, to: far, radius: f64::NAN, above: 0.0 }, Material::Nominal, 1);
        assert!(raster.depths.iter().all(|depth| !depth.is_nan()));
    }
}
