//! The camera: how points in the robot base become dots.
//!
//! On the screen x goes right and y down; depth is the distance along the view direction (m). All inputs are made finite and kept
//! in their ranges, so that no output is ever NaN.

use std::f64::consts::{FRAC_PI_2, PI};

use nalgebra::{Point3, Vector3};

use crate::units::DEGREE;

/// Steepest view (rad). Straight down would leave the upright direction undefined.
const STEEPEST: f64 = FRAC_PI_2 - DEGREE;
/// Smallest and largest zoom.
const ZOOM: (f64, f64) = (0.05, 50.0);
/// Largest pan, as a multiple of the height of the picture.
const FARTHEST_PAN: f64 = 10.0;
/// Opening angle of the perspective view along the height (rad).
const OPENING: f64 = 30.0 * DEGREE;
/// Used part of the area.
const USED: f64 = 0.88;
/// Part of the area that nothing shown may leave.
const FITS: f64 = 0.97;
/// Nearest depth that is drawn (m).
const NEAREST: f64 = 1e-3;

/// Kind of projection.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Projection {
    /// Distant objects are smaller.
    #[default]
    Perspective,
    /// Parallel lines stay parallel.
    Orthographic,
}

/// What the picture frames.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Framing {
    #[default]
    Arm,
    /// Everything: points and tracker too.
    All,
    /// The reflector, close up.
    Reflector,
}

/// A camera that orbits the centre of the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    yaw: f64,
    pitch: f64,
    zoom: f64,
    pan: (f64, f64),
    /// Kind of projection.
    pub projection: Projection,
    /// What the picture frames.
    pub framing: Framing,
}

impl Default for Camera {
    fn default() -> Self {
        Self {
            yaw: -55.0 * DEGREE,
            pitch: 20.0 * DEGREE,
            zoom: 1.0,
            pan: (0.0, 0.0),
            projection: Projection::Perspective,
            framing: Framing::Arm,
        }
    }
}

impl Camera {
    /// A camera in this direction: `yaw` about the vertical from the x axis of the base, `pitch` above the horizon (rad).
    pub fn from_direction(yaw: f64, pitch: f64) -> Self {
        let mut camera = Self { yaw: 0.0, pitch: 0.0, ..Self::default() };
        camera.orbit(yaw, pitch);
        camera
    }

    /// Direction of the camera: yaw and pitch (rad).
    pub const fn direction(&self) -> (f64, f64) {
        (self.yaw, self.pitch)
    }

    /// Orbits by these angles (rad).
    pub fn orbit(&mut self, yaw: f64, pitch: f64) {
        let turned = finite(self.yaw + finite(yaw, 0.0), 0.0);
        self.yaw = turned - 2.0 * PI * (turned / (2.0 * PI)).round();
        self.pitch = finite(self.pitch + finite(pitch, 0.0), 0.0).clamp(-STEEPEST, STEEPEST);
    }

    /// Enlarges the picture by a factor.
    pub fn zoom(&mut self, factor: f64) {
        if factor > 0.0 {
            self.zoom = finite(self.zoom * factor, 1.0).clamp(ZOOM.0, ZOOM.1);
        }
    }

    /// Pans the picture by parts of its height; right and up are positive.
    pub fn pan(&mut self, right: f64, up: f64) {
        let moved = |from: f64, by: f64| finite(from + finite(by, 0.0), 0.0).clamp(-FARTHEST_PAN, FARTHEST_PAN);
        self.pan = (moved(self.pan.0, right / self.zoom), moved(self.pan.1, up / self.zoom));
    }

    /// Resets the view, except for the kind of projection.
    pub fn reset(&mut self) {
        *self = Self { projection: self.projection, ..Self::default() };
    }

    /// The view on an area of `width` × `height` dots that frames `shown` (points with radii, m), before zoom and pan.
    pub fn view(&self, width: usize, height: usize, shown: &[(Point3<f64>, f64)]) -> View {
        let (width, height) = (width.max(1) as f64, height.max(1) as f64);
        let (sin_yaw, cos_yaw) = self.yaw.sin_cos();
        let (sin_pitch, cos_pitch) = self.pitch.sin_cos();
        let forward = Vector3::new(-cos_yaw * cos_pitch, -sin_yaw * cos_pitch, -sin_pitch);
        let right = Vector3::new(-sin_yaw, cos_yaw, 0.0);
        let up = right.cross(&forward);

        let (centre, [extent_x, extent_y, deep]) = bounds(shown, &[right, up, forward]);
        let scale = USED * (width / extent_x.max(0.01)).min(height / extent_y.max(0.01));
        let visible = height / scale;
        let depth = (deep / 2.0).max(0.01);
        // The whole scene is in front of the eye.
        let distance = (visible.max(extent_x * height / width) / (2.0 * (OPENING / 2.0).tan())).max(1.5 * depth);
        let pan = -right * (self.pan.0 * visible) - up * (self.pan.1 * visible);
        let mut view = View {
            eye: centre - forward * distance,
            right,
            up,
            forward,
            middle: (width / 2.0, height / 2.0),
            scale,
            distance,
            projection: self.projection,
            depths: (distance - depth, distance + depth),
        };
        view.scale *= view.fitting(shown) * self.zoom;
        view.eye += pan;
        view
    }
}

fn finite(value: f64, otherwise: f64) -> f64 {
    if value.is_finite() { value } else { otherwise }
}

/// Whether a point with a radius can be framed.
fn is_usable((point, radius): &(Point3<f64>, f64)) -> bool {
    radius.is_finite() && *radius >= 0.0 && *radius < 1e6 && point.iter().all(|x| x.is_finite() && x.abs() < 1e6)
}

/// Centre of points with radii, and their extents along three directions.
fn bounds(shown: &[(Point3<f64>, f64)], along: &[Vector3<f64>; 3]) -> (Point3<f64>, [f64; 3]) {
    if !shown.iter().any(is_usable) {
        return (Point3::origin(), [2.0; 3]);
    }
    let mut centre = Point3::origin();
    let extents = along.map(|direction| {
        let mut low = f64::INFINITY;
        let mut high = f64::NEG_INFINITY;
        for (point, radius) in shown.iter().filter(|shown| is_usable(shown)) {
            let at = point.coords.dot(&direction);
            low = low.min(at - radius);
            high = high.max(at + radius);
        }
        centre += direction * f64::midpoint(low, high);
        high - low
    });
    (centre, extents)
}

/// A camera applied to an area of dots.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    eye: Point3<f64>,
    right: Vector3<f64>,
    up: Vector3<f64>,
    forward: Vector3<f64>,
    middle: (f64, f64),
    /// Dots per metre at `distance`.
    scale: f64,
    distance: f64,
    projection: Projection,
    /// Nearest and farthest depth of the scene.
    pub depths: (f64, f64),
}

/// Position of a point on the screen (dots), and its depth (m).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Projected {
    /// Dots to the right.
    pub x: f64,
    /// Dots down.
    pub y: f64,
    /// Distance along the view direction.
    pub depth: f64,
}

/// The ray of a dot: points `origin + t · direction`, where `t` is the depth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// Start of the ray.
    pub origin: Point3<f64>,
    /// Direction, with a component of 1 along the view direction.
    pub direction: Vector3<f64>,
}

impl View {
    /// The factor, at most 1, by which the picture must shrink to contain what is shown: what is nearer than the middle is larger
    /// than its size alone says.
    fn fitting(&self, shown: &[(Point3<f64>, f64)]) -> f64 {
        let reach = |(point, radius): &(Point3<f64>, f64)| {
            let seen = self.project(point)?;
            let radius = radius.max(0.0) * self.scale_at(seen.depth);
            let aside = ((seen.x - self.middle.0).abs() + radius) / self.middle.0;
            let above = ((seen.y - self.middle.1).abs() + radius) / self.middle.1;
            Some(aside.max(above)).filter(|reach| reach.is_finite())
        };
        let farthest = shown.iter().filter(|shown| is_usable(shown)).filter_map(reach).fold(FITS, f64::max);
        FITS / farthest
    }

    /// Projects a point; `None` behind the eye or if it is not finite.
    pub fn project(&self, point: &Point3<f64>) -> Option<Projected> {
        let seen = point - self.eye;
        let depth = seen.dot(&self.forward);
        if depth.is_nan() || depth <= NEAREST {
            return None;
        }
        let scale = self.scale_at(depth);
        let x = self.middle.0 + seen.dot(&self.right) * scale;
        let y = self.middle.1 - seen.dot(&self.up) * scale;
        (x.is_finite() && y.is_finite()).then_some(Projected { x, y, depth })
    }

    /// Dots per metre at a depth.
    pub fn scale_at(&self, depth: f64) -> f64 {
        match self.projection {
            Projection::Perspective => self.scale * self.distance / depth.max(NEAREST),
            Projection::Orthographic => self.scale,
        }
    }

    /// The ray of the centre of a dot.
    pub fn ray(&self, x: usize, y: usize) -> Ray {
        let aside = (x as f64 + 0.5 - self.middle.0) / self.scale;
        let above = (self.middle.1 - y as f64 - 0.5) / self.scale;
        match self.projection {
            Projection::Perspective => Ray {
                origin: self.eye,
                direction: self.forward + (self.right * aside + self.up * above) / self.distance,
            },
            Projection::Orthographic => {
                Ray { origin: self.eye + self.right * aside + self.up * above, direction: self.forward }
            }
        }
    }

    /// A direction of the base in screen axes: right, up, towards the eye.
    pub fn turned(&self, direction: &Vector3<f64>) -> Vector3<f64> {
        Vector3::new(direction.dot(&self.right), direction.dot(&self.up), -direction.dot(&self.forward))
    }

    /// Relative depth in the scene: 0 in front, 1 at the back.
    pub fn farness(&self, depth: f64) -> f64 {
        ((depth - self.depths.0) / (self.depths.1 - self.depths.0)).clamp(0.0, 1.0)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn the_middle_of_what_is_shown_is_in_the_middle() {
        for projection in [Projection::Perspective, Projection::Orthographic] {
            let camera = Camera { projection, ..Camera::default() };
            let shown = [(Point3::new(0.0, 0.0, 0.0), 0.0), (Point3::new(1.0, 1.0, 1.0), 0.0)];
            let view = camera.view(80, 60, &shown);
            let seen = view.project(&Point3::new(0.5, 0.5, 0.5)).unwrap();
            assert!((seen.x - 40.0).abs() < 1e-9 && (seen.y - 30.0).abs() < 1e-9, "{seen:?}");
        }
    }

    #[test]
    fn from_the_front_left_is_left_and_up_is_up() {
        // Looking from +x to the base, +y of the base is to the right.
        let view = Camera::from_direction(0.0, 0.0).view(100, 100, &[(Point3::origin(), 1.0)]);
        let y = view.project(&Point3::new(0.0, 0.5, 0.0)).unwrap();
        let z = view.project(&Point3::new(0.0, 0.0, 0.5)).unwrap();
        let x = view.project(&Point3::new(0.5, 0.0, 0.0)).unwrap();
        let middle = view.project(&Point3::origin()).unwrap();
        assert!(y.x > middle.x && z.y < middle.y && x.depth < middle.depth);
    }

    proptest! {
        #[test]
        fn what_is_shown_is_inside(
            yaw in -7.0_f64..7.0, pitch in -1.5_f64..1.5, perspective: bool,
            points in prop::collection::vec((-2.0_f64..2.0, -2.0_f64..2.0, 0.0_f64..2.0, 0.0_f64..0.2), 2..12),
            width in 20_usize..400, height in 20_usize..300,
        ) {
            let mut camera = Camera::from_direction(yaw, pitch);
            camera.projection = if perspective { Projection::Perspective } else { Projection::Orthographic };
            let shown: Vec<_> = points.iter().map(|&(x, y, z, r)| (Point3::new(x, y, z), r)).collect();
            let view = camera.view(width, height, &shown);
            for (point, _) in &shown {
                let seen = view.project(point).unwrap();
                prop_assert!((0.0..=width as f64).contains(&seen.x), "{seen:?} of {width}");
                prop_assert!((0.0..=height as f64).contains(&seen.y), "{seen:?} of {height}");
            }
        }

        #[test]
        fn rays_go_where_points_are_seen(
            yaw in -7.0_f64..7.0, pitch in -3.0_f64..3.0, zoom in 0.1_f64..10.0, x in 0_usize..300, y in 0_usize..200,
            perspective: bool, along in 0.1_f64..5.0,
        ) {
            let mut camera = Camera::from_direction(yaw, pitch);
            camera.projection = if perspective { Projection::Perspective } else { Projection::Orthographic };
            camera.zoom(zoom);
            let view = camera.view(300, 200, &[(Point3::new(0.3, -0.2, 0.5), 0.8)]);
            let ray = view.ray(x, y);
            let seen = view.project(&(ray.origin + ray.direction * along)).unwrap();
            prop_assert!((seen.x - x as f64 - 0.5).abs() < 1e-6 && (seen.y - y as f64 - 0.5).abs() < 1e-6);
            prop_assert!((seen.depth - along).abs() < 1e-9);
        }

        #[test]
        fn no_input_makes_a_view_that_is_not_finite(
            moves in prop::collection::vec((any::<f64>(), any::<f64>(), 0_u8..3), 0..8),
            points in prop::collection::vec((any::<f64>(), any::<f64>(), any::<f64>(), any::<f64>()), 0..5),
            width in 0_usize..400, height in 0_usize..400,
        ) {
            let mut camera = Camera::default();
            for (a, b, kind) in moves {
                match kind {
                    0 => camera.orbit(a, b),
                    1 => camera.pan(a, b),
                    _ => camera.zoom(a),
                }
            }
            let shown: Vec<_> = points.iter().map(|&(x, y, z, r)| (Point3::new(x, y, z), r)).collect();
            let view = camera.view(width, height, &shown);
            let ray = view.ray(0, 0);
            prop_assert!(ray.origin.iter().chain(ray.direction.iter()).all(|x| x.is_finite()), "{view:?}");
            if let Some(seen) = view.project(&Point3::new(0.1, 0.2, 0.3)) {
                prop_assert!(seen.x.is_finite() && seen.y.is_finite());
            }
        }
    }
}
