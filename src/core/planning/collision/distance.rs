//! Distances between lines of finite length, and between such a line and a box: closed forms.

use nalgebra::{Point3, Vector3};

use crate::planning::BoxInBase;

/// A line from one point to another (m); both may be the same point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Segment {
    /// One end.
    pub from: Point3<f64>,
    /// The other end.
    pub to: Point3<f64>,
}

impl Segment {
    /// Distance to another segment (m).
    ///
    /// Closest points of two segments after Ericson, *Real-Time Collision Detection* (2005), §5.1.9: solve for the lines,
    /// clamp one parameter to its segment, take the best other one, clamp it, and once more the first. Parallel lines and
    /// points are no special case of the result.
    pub fn distance_to(&self, other: &Self) -> f64 {
        let d1 = self.to - self.from;
        let d2 = other.to - other.from;
        let r = self.from - other.from;
        let (a, e) = (d1.norm_squared(), d2.norm_squared());
        let (c, f, b) = (d1.dot(&r), d2.dot(&r), d1.dot(&d2));
        let clamped = |numerator: f64, denominator: f64| {
            if denominator > f64::MIN_POSITIVE { (numerator / denominator).clamp(0.0, 1.0) } else { 0.0 }
        };
        // Without length `e` the other segment is a point: t stays 0 and s is its projection.
        let s = if e > f64::MIN_POSITIVE { clamped(b * f - c * e, a * e - b * b) } else { clamped(-c, a) };
        let t = clamped(b * s + f, e);
        let s = clamped(b * t - c, a);
        (r + d1 * s - d2 * t).norm()
    }

    /// Distance to a box (m); zero inside.
    ///
    /// The squared distance along the segment is convex and piecewise quadratic: each coordinate contributes while it is
    /// outside its interval. Its derivative is piecewise linear and rising, so the zero lies between the last of the at most
    /// six break points with a negative derivative and the next one, where it is interpolated exactly.
    pub fn distance_to_box(&self, space: &BoxInBase) -> f64 {
        let direction = self.to - self.from;
        let outside = |t: f64| -> Vector3<f64> {
            let point = self.from + direction * t;
            Vector3::from_fn(|axis, _| point[axis] - point[axis].max(space.min[axis]).min(space.max[axis]))
        };
        let slope = |t: f64| outside(t).dot(&direction);
        let (mut below, mut above) = (0.0, 1.0);
        if slope(0.0) >= 0.0 {
            return outside(0.0).norm();
        }
        if slope(1.0) <= 0.0 {
            return outside(1.0).norm();
        }
        for axis in 0..3 {
            for face in [space.min[axis], space.max[axis]] {
                let t = (face - self.from[axis]) / direction[axis];
                if below < t && t < above {
                    if slope(t) < 0.0 { below = t } else { above = t }
                }
            }
        }
        let (falling, rising) = (slope(below), slope(above));
        let t = below + (above - below) * falling / (falling - rising);
        outside(t).norm()
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn point() -> impl Strategy<Value = Point3<f64>> {
        // Whole numbers now and then: parallel, crossing and degenerate segments.
        let coordinate = prop_oneof![(-3..=3_i32).prop_map(f64::from), -3.0..3.0_f64];
        prop::array::uniform3(coordinate).prop_map(Point3::from)
    }

    fn segment() -> impl Strategy<Value = Segment> {
        (point(), point(), 0..6_u8)
            .prop_map(|(from, to, degenerate)| Segment { from, to: if degenerate == 0 { from } else { to } })
    }

    fn cuboid() -> impl Strategy<Value = BoxInBase> {
        (point(), prop::array::uniform3(0.1..2.0_f64))
            .prop_map(|(min, size)| BoxInBase { min, max: min + Vector3::from(size) })
    }

    const STEPS: u32 = 400;

    fn points(segment: Segment) -> impl Iterator<Item = Point3<f64>> {
        (0..=STEPS).map(move |step| segment.from + (segment.to - segment.from) * (f64::from(step) / f64::from(STEPS)))
    }

    /// Distance from a point to the nearest of the box's points, coordinate by coordinate.
    fn point_to_box(point: &Point3<f64>, space: &BoxInBase) -> f64 {
        let gap = |axis: usize| (space.min[axis] - point[axis]).max(point[axis] - space.max[axis]).max(0.0);
        (0..3).map(|axis| gap(axis).powi(2)).sum::<f64>().sqrt()
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

        #[test]
        fn segment_distance_is_that_of_the_nearest_sampled_points(one in segment(), other in segment()) {
            let exact = one.distance_to(&other);
            let sampled = points(one)
                .flat_map(|a| points(other).map(move |b| (a - b).norm()))
                .fold(f64::INFINITY, f64::min);
            let spacing = ((one.to - one.from).norm() + (other.to - other.from).norm()) / f64::from(STEPS);
            prop_assert!(exact <= sampled + 1e-12, "{exact} {sampled}");
            prop_assert!(sampled <= exact + spacing + 1e-9, "{exact} {sampled}");
            prop_assert!((exact - other.distance_to(&one)).abs() < 1e-7);
        }

        #[test]
        fn box_distance_is_that_of_the_nearest_sampled_point(segment in segment(), space in cuboid()) {
            let exact = segment.distance_to_box(&space);
            let sampled = points(segment).map(|p| point_to_box(&p, &space)).fold(f64::INFINITY, f64::min);
            let spacing = (segment.to - segment.from).norm() / f64::from(STEPS);
            prop_assert!(exact <= sampled + 1e-12, "{exact} {sampled}");
            prop_assert!(sampled <= exact + spacing, "{exact} {sampled}");
        }
    }
}
