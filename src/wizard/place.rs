//! Where the tracker is, from points that are known in the base and that the tracker sees.

use nalgebra::Point3;

use crate::geometry::register;
use crate::profile::CellText;
use crate::session::journal::from_xyz_mm;
use crate::session::set_up::{InstrumentChoice, TrackerPoints};
use crate::session::state::Session;
use crate::session::station;
use crate::units::to_mm;

/// Points nearer to one line than this do not fix the place (m).
const SHORTEST_HEIGHT: f64 = 0.05;
/// Largest disagreement of the points that is taken (m): the arm is not calibrated yet, but a slip is larger.
const LARGEST_MISFIT: f64 = 0.025;

/// A place of the tracker with what was left over.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Place {
    /// In the base (mm).
    pub(super) tracker_mm: (f64, f64, f64),
    /// Root mean square disagreement (m).
    pub(super) rms: f64,
}

impl Place {
    /// The cell with this place.
    pub(super) fn put_into(self, cell: CellText) -> CellText {
        CellText { tracker_mm: Some(self.tracker_mm), ..cell }
    }
}

/// To a millimetre: nobody needs more for a line of sight.
fn rounded(point: &Point3<f64>) -> (f64, f64, f64) {
    let mm = |value: f64| to_mm(value).round();
    (mm(point.x), mm(point.y), mm(point.z))
}

/// The place from pairs of points.
///
/// # Errors
/// Too few points, points on one line, or points that do not fit each other, in words.
pub(super) fn from_points(points: &TrackerPoints) -> Result<Place, String> {
    let pairs: Vec<(Point3<f64>, Point3<f64>)> =
        points.0.iter().map(|(base, seen)| (from_xyz_mm(*seen), from_xyz_mm(*base))).collect();
    if pairs.len() < 3 {
        return Err("three points are needed".to_owned());
    }
    if !pairs.iter().flat_map(|(seen, base)| seen.iter().chain(base.iter())).all(|value| value.is_finite()) {
        return Err("the coordinates must be numbers".to_owned());
    }
    if height(&pairs) < SHORTEST_HEIGHT {
        return Err(format!(
            "the points are on one line to {:.0} mm: take one that is farther off it",
            to_mm(SHORTEST_HEIGHT)
        ));
    }
    let found = register(pairs.iter().map(|(seen, base)| (1.0, *seen, *base))).ok_or("the points fix no place")?;
    if found.rms > LARGEST_MISFIT {
        return Err(format!(
            "the points do not fit each other: {:.1} mm (RMS) are left. {}",
            to_mm(found.rms),
            worst(&pairs)
        ));
    }
    Ok(Place { tracker_mm: rounded(&(found.to_from_from * Point3::origin())), rms: found.rms })
}

/// The largest height of a triangle of the points over its longest side (m).
fn height(pairs: &[(Point3<f64>, Point3<f64>)]) -> f64 {
    let mut largest: f64 = 0.0;
    for (one, (_, a)) in pairs.iter().enumerate() {
        for (two, (_, b)) in pairs.iter().enumerate().skip(one + 1) {
            for (_, c) in pairs.iter().skip(two + 1) {
                let longest = (a - b).norm().max((b - c).norm()).max((c - a).norm());
                largest = largest.max((b - a).cross(&(c - a)).norm() / longest.max(1e-9));
            }
        }
    }
    largest
}

/// The pair of points whose distances differ most, in words.
fn worst(pairs: &[(Point3<f64>, Point3<f64>)]) -> String {
    let mut worst = (0.0, 0, 0, 0.0, 0.0);
    for (one, (seen, base)) in pairs.iter().enumerate() {
        for (two, (other_seen, other_base)) in pairs.iter().enumerate().skip(one + 1) {
            let (seen, base) = ((seen - other_seen).norm(), (base - other_base).norm());
            if (seen - base).abs() > worst.0 {
                worst = ((seen - base).abs(), one + 1, two + 1, seen, base);
            }
        }
    }
    let (_, one, two, seen, base) = worst;
    format!(
        "From point {one} to point {two} it is {:.1} mm in the base and {:.1} mm as seen: check coordinates and units",
        to_mm(base),
        to_mm(seen)
    )
}

/// The place from the poses measured so far.
///
/// # Errors
/// Why it cannot be told, in words.
pub(super) fn from_poses(session: &Session) -> Result<Place, String> {
    if matches!(session.instrument, Some(InstrumentChoice::Simulated(_))) {
        return Err("the simulated tracker is where the cell says".to_owned());
    }
    let found = station::registration(session).ok_or_else(|| format!("measure {} poses first", station::FEWEST))?;
    if found.rms > LARGEST_MISFIT {
        return Err(format!("the measured poses do not fit the arm yet: {:.1} mm (RMS)", to_mm(found.rms)));
    }
    Ok(Place { tracker_mm: rounded(&(found.to_from_from * Point3::origin())), rms: found.rms })
}

#[cfg(test)]
mod tests {
    use nalgebra::{Isometry3, Vector3};

    use super::*;

    fn points(slip: f64) -> TrackerPoints {
        let base_from_tracker = Isometry3::new(Vector3::new(2.5, -0.4, 0.9), Vector3::new(0.02, -0.01, 2.0));
        let base = [Point3::new(0.5, 0.1, 0.2), Point3::new(0.6, 0.7, 0.3), Point3::new(0.2, -0.6, 0.8)];
        let mm = |point: &Point3<f64>| (to_mm(point.x), to_mm(point.y), to_mm(point.z));
        let pair = |(index, point): (usize, &Point3<f64>)| {
            let mut seen = base_from_tracker.inverse() * point;
            if index == 1 {
                seen.x += slip;
            }
            (mm(point), mm(&seen))
        };
        TrackerPoints(base.iter().enumerate().map(pair).collect())
    }

    #[test]
    fn three_points_give_the_place_and_a_slip_is_named() {
        let place = from_points(&points(0.0)).unwrap();
        assert_eq!(place.tracker_mm, (2500.0, -400.0, 900.0));
        assert!(place.rms < 1e-9);
        let error = from_points(&points(0.3)).unwrap_err();
        assert!(error.contains("point 2"), "{error}");
        let mut on_a_line = points(0.0);
        on_a_line.0[2] = on_a_line.0[1];
        assert!(from_points(&on_a_line).unwrap_err().contains("on one line"));
        on_a_line.0.truncate(2);
        assert!(from_points(&on_a_line).unwrap_err().contains("three points"));
    }
}
