//! Points, planes, lines and circles of unknown place that the target was measured against.
//!
//! A contact is a measured value about the place of the target: its distance from a fixed point, or that it lies on a surface or a
//! curve. Where the feature is, is found along with the arm: at every estimate it is fitted to the predicted places, and what moves
//! with it is projected out of the rows, as is done with the frame of a tracker.

use nalgebra::{DMatrix, DVector, Matrix3, Point3, SMatrix, SVector, SymmetricEigen, Unit, UnitVector3, Vector3};

use crate::text::{names, written_as_text};

/// Coordinates of a feature: place, tilts of its axis about two directions, size.
pub(crate) const COORDINATES: usize = 6;
/// Most steps of a fit, and the change (m) that ends it.
const STEPS: usize = 60;
const SMALL_STEP: f64 = 1e-12;
/// Directions that the contacts show this much less than the best one are left alone.
const UNSEEN: f64 = 1e-12;
/// Singular values of the linear start below this part of the largest are zero.
const LINEAR_RANK: f64 = 1e-7;
/// Damping of a step: where it begins, and how it falls and grows.
const DAMPING: (f64, f64, f64) = (1e-6, 0.1, 10.0);

/// What the target was measured against.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shape {
    /// A point: the distance from it is measured.
    Point,
    /// A point: the distance from it is measured but for a constant, as by a draw wire whose zero is unknown.
    Wire,
    /// A point: the distance from it is always the same, as with a ball bar of unknown length.
    Sphere,
    /// A plane: the distance from it is measured, zero or that of a gauge.
    Plane,
    /// A straight line that the target is on.
    Line,
    /// A circle that the target is on.
    Circle,
    /// A circle of measured radius that the target is on.
    KnownCircle,
}

names!(Shape {
    Point = "point",
    Wire = "wire",
    Sphere = "sphere",
    Plane = "plane",
    Line = "line",
    Circle = "circle",
    KnownCircle = "circle of known radius",
});
written_as_text!(Shape);

impl Shape {
    /// Number of values that a contact gives.
    pub const fn components(self) -> usize {
        match self {
            Self::Point | Self::Wire | Self::Sphere | Self::Plane => 1,
            Self::Line | Self::Circle | Self::KnownCircle => 2,
        }
    }

    /// Number of values that finding the feature takes.
    pub const fn unknowns(self) -> usize {
        match self {
            Self::Point | Self::Plane => 3,
            Self::Wire | Self::Sphere | Self::Line => 4,
            Self::KnownCircle => 5,
            Self::Circle => 6,
        }
    }

    /// Whether contacts with it show how large the robot is.
    pub const fn shows_size(self) -> bool {
        match self {
            Self::Point | Self::Wire | Self::KnownCircle => true,
            Self::Sphere | Self::Plane | Self::Line | Self::Circle => false,
        }
    }
}

/// A feature where it was found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Feature {
    /// Its kind.
    pub shape: Shape,
    /// The point, the middle of the circle, or a point of the plane or line, in the base (m).
    pub at: Point3<f64>,
    /// Normal of the plane or circle, direction of the line; of no meaning for a point.
    pub axis: UnitVector3<f64>,
    /// Radius of the circle or sphere, or what a wire reads less than its length (m); zero for others.
    pub size: f64,
}

/// A value that is predicted about one place.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Predicted {
    /// The value (m).
    pub(crate) value: f64,
    /// Its derivative by the place.
    pub(crate) by_point: Vector3<f64>,
    /// Its derivative by the coordinates of the feature.
    pub(crate) by_feature: SVector<f64, COORDINATES>,
    /// Its derivative by a turn of everything about the axis of the feature, which means nothing.
    pub(crate) by_spin: f64,
}

/// One value measured about one place.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Contact {
    /// Predicted place of the target in the base (m).
    pub(crate) point: Point3<f64>,
    /// Which of the values of the contact.
    pub(crate) component: usize,
    /// What was measured (m).
    pub(crate) measured: f64,
    /// Inverse variance (1/m²).
    pub(crate) weight: f64,
}

impl Feature {
    /// The value that is predicted for a place.
    pub(crate) fn predicted(&self, point: &Point3<f64>, component: usize) -> Predicted {
        let off = point - self.at;
        let across = directions(&self.axis);
        let mut by_feature = SVector::<f64, COORDINATES>::zeros();
        let mut place = |by_point: Vector3<f64>| by_feature.fixed_rows_mut::<3>(0).copy_from(&-by_point);
        let (value, by_point, by_spin) = match (self.shape, component) {
            (Shape::Point | Shape::Wire | Shape::Sphere, _) => {
                let by_point = direction(&off);
                place(by_point);
                let value = off.norm() - self.size;
                if self.shape != Shape::Point {
                    by_feature[5] = -1.0;
                }
                (value, by_point, 0.0)
            }
            (Shape::Plane, _) | (Shape::Circle | Shape::KnownCircle, 0) => {
                place(*self.axis);
                for (index, direction) in across.iter().enumerate() {
                    by_feature[3 + index] = direction.dot(&off);
                }
                (self.axis.dot(&off), *self.axis, 0.0)
            }
            (Shape::Line, component) => {
                let component = component.min(1);
                place(across[component]);
                by_feature[3 + component] = -self.axis.dot(&off);
                let spin = if component == 0 { across[1].dot(&off) } else { -across[0].dot(&off) };
                (across[component].dot(&off), across[component], spin)
            }
            (Shape::Circle | Shape::KnownCircle, _) => {
                let height = self.axis.dot(&off);
                let outwards = direction(&(off - *self.axis * height));
                place(outwards);
                for (index, direction) in across.iter().enumerate() {
                    by_feature[3 + index] = -height * direction.dot(&outwards);
                }
                let radius = (off - *self.axis * height).norm();
                if self.shape == Shape::Circle {
                    by_feature[5] = -1.0;
                    (radius - self.size, outwards, 0.0)
                } else {
                    (radius, outwards, 0.0)
                }
            }
        };
        Predicted { value, by_point, by_feature, by_spin }
    }

    /// The feature that fits the contacts best; `None` if there are fewer than two that count.
    pub(crate) fn fit(shape: Shape, contacts: &[Contact]) -> Option<Self> {
        let counted: Vec<Contact> = contacts.iter().filter(|contact| contact.weight > 0.0).copied().collect();
        let points: Vec<(Point3<f64>, f64)> = counted
            .iter()
            .filter(|contact| contact.component + 1 == shape.components())
            .map(|contact| (contact.point, contact.measured))
            .collect();
        if points.len() < 2 {
            return None;
        }
        let fits = starts(shape, &points).into_iter().map(|start| start.refined(&counted));
        fits.filter(|(_, cost)| cost.is_finite()).min_by(|a, b| a.1.total_cmp(&b.1)).map(|(feature, _)| feature)
    }

    fn cost(&self, contacts: &[Contact]) -> f64 {
        let square = |contact: &Contact| {
            let residual = contact.measured - self.predicted(&contact.point, contact.component).value;
            contact.weight * residual * residual
        };
        contacts.iter().map(square).sum()
    }

    /// Levenberg–Marquardt steps from here, with the cost where they end.
    fn refined(mut self, contacts: &[Contact]) -> (Self, f64) {
        let (first, falls, grows) = DAMPING;
        let mut damping = first;
        let mut cost = self.cost(contacts);
        for _ in 0..STEPS {
            let mut information = SMatrix::<f64, COORDINATES, COORDINATES>::zeros();
            let mut gradient = SVector::<f64, COORDINATES>::zeros();
            for contact in contacts {
                let predicted = self.predicted(&contact.point, contact.component);
                information += predicted.by_feature * predicted.by_feature.transpose() * contact.weight;
                gradient += predicted.by_feature * (contact.weight * (contact.measured - predicted.value));
            }
            let largest = information.diagonal().max();
            let mut step = None;
            while step.is_none() && damping < 1e9 {
                let mut damped = information;
                for index in 0..COORDINATES {
                    damped[(index, index)] += damping * information[(index, index)] + UNSEEN * largest;
                }
                let change = damped.cholesky().map(|factor| factor.solve(&gradient));
                let next = change.map(|change| (self.moved(&change), change));
                match next.map(|(next, change)| (next, change, next.cost(contacts))) {
                    Some((next, change, better)) if better <= cost => {
                        step = Some(change.norm());
                        (self, cost) = (next, better);
                        damping = (damping * falls).max(1e-15);
                    }
                    _ => damping *= grows,
                }
            }
            if step.is_none_or(|step| step < SMALL_STEP) {
                break;
            }
        }
        (self, cost)
    }

    fn moved(&self, change: &SVector<f64, COORDINATES>) -> Self {
        let [first, second] = directions(&self.axis);
        Self {
            at: self.at + change.fixed_rows::<3>(0),
            axis: Unit::new_normalize(*self.axis + first * change[3] + second * change[4]),
            size: self.size + change[5],
            ..*self
        }
    }
}

/// The direction of a vector; zero for one without length, which has none.
fn direction(vector: &Vector3<f64>) -> Vector3<f64> {
    vector.try_normalize(f64::EPSILON).unwrap_or_default()
}

/// Two directions across an axis and each other.
fn directions(axis: &UnitVector3<f64>) -> [Vector3<f64>; 2] {
    let first = axis.cross(&Vector3::ith(axis.iamin(), 1.0)).normalize();
    [first, axis.cross(&first)]
}

/// Where the fit of a feature to places with their measured values may begin.
fn starts(shape: Shape, points: &[(Point3<f64>, f64)]) -> Vec<Feature> {
    let count = points.len() as f64;
    let centre = Point3::from(points.iter().map(|(point, _)| point.coords).sum::<Vector3<f64>>() / count);
    let spread = points.iter().fold(Matrix3::zeros(), |sum, (point, _)| {
        let off = point - centre;
        sum + off * off.transpose()
    });
    let eigen = SymmetricEigen::new(spread);
    let column = |index: usize| Unit::new_normalize(eigen.eigenvectors.column(index).into_owned());
    let (along, normal) = (column(eigen.eigenvalues.imax()), column(eigen.eigenvalues.imin()));
    let feature = |at, axis, size| Feature { shape, at, axis, size };
    match shape {
        Shape::Point | Shape::Wire | Shape::Sphere => {
            let Some((off, size, height)) = linear_start(shape, &centre, points) else { return Vec::new() };
            let flat = off - *normal * normal.dot(&off);
            // Places in a plane see a point and its mirror image alike: both are tried.
            [off, off - *normal * (2.0 * normal.dot(&off)), flat + *normal * height, flat - *normal * height]
                .into_iter()
                .map(|off| feature(centre + off, normal, size))
                .collect()
        }
        Shape::Plane => {
            let mean = points.iter().map(|(_, measured)| measured).sum::<f64>() / count;
            let gradient = points.iter().map(|(point, measured)| (point - centre) * (measured - mean)).sum();
            let steepest = Unit::try_new(gradient, f64::EPSILON).unwrap_or(normal);
            [normal, -normal, steepest].map(|axis| feature(centre - *axis * mean, axis, 0.0)).to_vec()
        }
        Shape::Line => vec![feature(centre, along, 0.0)],
        Shape::Circle | Shape::KnownCircle => {
            let flattened: Vec<(Point3<f64>, f64)> =
                points.iter().map(|(point, _)| (point - *normal * normal.dot(&(point - centre)), 0.0)).collect();
            let start = linear_start(Shape::Sphere, &centre, &flattened);
            let start = start.map(|(off, size, _)| feature(centre + off - *normal * normal.dot(&off), normal, size));
            start.into_iter().collect()
        }
    }
}

/// The point that fits places and distances best in the square of the distance, from the centre; what a wire reads too little, or the
/// radius; and how far from the plane of the places the point would be if they showed only its foot.
fn linear_start(shape: Shape, centre: &Point3<f64>, points: &[(Point3<f64>, f64)]) -> Option<(Vector3<f64>, f64, f64)> {
    // (measured + size)² = |p − a|² is linear in a, in the size and in one more number.
    let rows = DMatrix::from_fn(points.len(), 5, |row, column| match column {
        0..=2 => -2.0 * (points[row].0 - centre)[column],
        3 => 1.0,
        _ if shape == Shape::Wire => -2.0 * points[row].1,
        _ => 0.0,
    });
    let squares = DVector::from_fn(points.len(), |row, _| {
        let (point, measured) = &points[row];
        let measured = if shape == Shape::Sphere { 0.0 } else { *measured };
        measured * measured - (point - centre).norm_squared()
    });
    let svd = rows.svd(true, true);
    let solution = svd.solve(&squares, LINEAR_RANK * svd.singular_values.max()).ok()?;
    let off = Vector3::new(solution[0], solution[1], solution[2]);
    let rest = off.norm_squared() - solution[3];
    let (size, height) = match shape {
        Shape::Wire => (solution[4], (solution[3] + solution[4].powi(2) - off.norm_squared()).max(0.0).sqrt()),
        Shape::Point => (0.0, (-rest).max(0.0).sqrt()),
        Shape::Sphere | Shape::Plane | Shape::Line | Shape::Circle | Shape::KnownCircle => (rest.max(0.0).sqrt(), 0.0),
    };
    Some((off, size, height))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn points() -> Vec<Point3<f64>> {
        let value = |index: usize, axis: usize| ((index + 1) as f64 * (axis as f64 + 2.0).sqrt()).fract() - 0.5;
        (0..20).map(|index| Point3::new(value(index, 0), value(index, 1), 1.0 + value(index, 3))).collect()
    }

    fn contacts(shape: Shape, truth: &Feature, points: &[Point3<f64>]) -> Vec<Contact> {
        let of = |point: &Point3<f64>, component: usize| Contact {
            point: *point,
            component,
            measured: truth.predicted(point, component).value,
            weight: 1e8,
        };
        points.iter().flat_map(|point| (0..shape.components()).map(move |component| of(point, component))).collect()
    }

    #[test]
    fn features_are_found_where_they_are() {
        let axis = Unit::new_normalize(Vector3::new(0.2, -0.3, 0.9));
        let at = Point3::new(1.5, -2.0, 0.3);
        let [first, second] = directions(&axis);
        for (shape, size) in
            [(Shape::Point, 0.0), (Shape::Wire, 0.35), (Shape::Sphere, 0.6), (Shape::Circle, 0.4), (Shape::Line, 0.0)]
        {
            let truth = Feature { shape, at, axis, size };
            let places: Vec<Point3<f64>> = match shape {
                Shape::Sphere => points().iter().map(|point| at + 0.6 * (point - at).normalize()).collect(),
                Shape::Line => points().iter().map(|point| at + *axis * point.x).collect(),
                Shape::Circle => {
                    let on = |angle: f64| at + (first * angle.cos() + second * angle.sin()) * 0.4;
                    (0..9).map(|index| on(0.5 * f64::from(index))).collect()
                }
                Shape::Point | Shape::Wire | Shape::Plane | Shape::KnownCircle => points(),
            };
            let found = Feature::fit(shape, &contacts(shape, &truth, &places)).unwrap();
            let off = found.at - at;
            let off = if shape == Shape::Line { off - *axis * axis.dot(&off) } else { off };
            assert!(off.norm() < 1e-7, "{shape:?} {found:?}");
            assert!((found.size - size).abs() < 1e-7, "{shape:?} {found:?}");
            if matches!(shape, Shape::Line | Shape::Circle) {
                assert!(found.axis.cross(&axis).norm() < 1e-7, "{shape:?} {found:?}");
            }
        }
    }

    #[test]
    fn planes_take_the_side_that_the_distances_show() {
        let truth = Feature {
            shape: Shape::Plane,
            at: Point3::new(0.1, 0.2, 0.4),
            axis: Unit::new_normalize(Vector3::new(0.1, 0.2, -0.9)),
            size: 0.0,
        };
        let found = Feature::fit(Shape::Plane, &contacts(Shape::Plane, &truth, &points())).unwrap();
        assert!((*found.axis - *truth.axis).norm() < 1e-7, "{found:?}");
        assert!(truth.axis.dot(&(found.at - truth.at)).abs() < 1e-7, "{found:?}");
    }

    #[test]
    fn places_in_a_plane_still_find_the_distance_of_a_point() {
        let flat: Vec<Point3<f64>> = points().iter().map(|point| Point3::new(point.x, point.y, 0.4)).collect();
        let truth = Feature { shape: Shape::Point, at: Point3::new(0.3, 1.0, 1.2), axis: Vector3::z_axis(), size: 0.0 };
        let found = Feature::fit(Shape::Point, &contacts(Shape::Point, &truth, &flat)).unwrap();
        assert!((found.at.xy() - truth.at.xy()).norm() < 1e-6, "{found:?}");
        assert!(((found.at.z - 0.4).abs() - 0.8).abs() < 1e-6, "{found:?}");
    }

    #[test]
    fn derivatives_are_those_of_differences() {
        let axis = Unit::new_normalize(Vector3::new(0.2, -0.3, 0.9));
        for shape in
            [Shape::Point, Shape::Wire, Shape::Sphere, Shape::Plane, Shape::Line, Shape::Circle, Shape::KnownCircle]
        {
            let feature = Feature { shape, at: Point3::new(0.5, 0.1, 0.3), axis, size: 0.2 };
            let point = Point3::new(0.7, -0.4, 0.9);
            for component in 0..shape.components() {
                let at = feature.predicted(&point, component);
                let has_size = matches!(shape, Shape::Wire | Shape::Sphere | Shape::Circle);
                for coordinate in 0..if has_size { COORDINATES } else { COORDINATES - 1 } {
                    let step = 1e-6;
                    let change = SVector::<f64, COORDINATES>::ith(coordinate, step);
                    // Directions across the axis jump where it is level with two of the base; not here.
                    let values =
                        [change, -change].map(|change| feature.moved(&change).predicted(&point, component).value);
                    let difference = (values[0] - values[1]) / (2.0 * step);
                    let close = (difference - at.by_feature[coordinate]).abs() < 1e-6;
                    // A line turns its own directions along, which is the turn that means nothing.
                    let spins = shape == Shape::Line && coordinate >= 3;
                    assert!(close || spins, "{shape:?} {component} {coordinate}: {difference} {at:?}");
                }
                for axis in 0..3 {
                    let step = Vector3::ith(axis, 1e-6);
                    let values = [point + step, point - step].map(|point| feature.predicted(&point, component).value);
                    assert!(((values[0] - values[1]) / 2e-6 - at.by_point[axis]).abs() < 1e-6, "{shape:?}");
                }
            }
        }
    }
}
