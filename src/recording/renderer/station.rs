//! The instrument: where it is planned, until the measured points determine it.

use nalgebra::{Isometry3, Point3, Vector3};
use rerun::{Arrows3D, AsComponents, Capsules3D, FillMode, LineStrips3D, Points3D};

use crate::profile::Profile;
use crate::recording::arm::{Posture, reach};
use crate::recording::canvas::{Canvas, Moment};
use crate::recording::{names, style};
use crate::session::journal::{Entry, IdentifiedText, from_xyz_mm};
use crate::session::state::Session;
use crate::session::station;
use crate::units::MILLIMETRE;

/// Length and radius of the head of the tracker (m).
const HEAD: [f64; 2] = [0.22, 0.1];
/// How far the feet of the tripod are from its axis (m).
const FOOT: f64 = 0.35;
/// Shortest tripod (m).
const SHORTEST: f64 = 0.3;
/// Distance from the drawn position beyond which the instrument is drawn again (m).
const MOVED: f64 = 20.0 * MILLIMETRE;

/// Samples up to which every one is registered; of more, one in as many.
const ALL: usize = 32;

/// The position of the instrument as far as the journal determines it.
#[derive(Clone, Debug, Default)]
pub(super) struct Station {
    /// Registration of the samples so far to the nominal arm.
    base_from_tracker: Option<Isometry3<f64>>,
    /// Position in the base; `None`: as planned.
    found: Option<Isometry3<f64>>,
    /// The position comes from a result.
    is_identified: bool,
}

impl Station {
    /// Updates the position after an entry that is already in `session`. Returns whether the instrument must be drawn again.
    pub(super) fn update(&mut self, session: &Session, entry: &Entry) -> bool {
        match entry {
            Entry::Profile { .. } => *self = Self::default(),
            Entry::Sample(_)
            | Entry::Correction(_)
            | Entry::Decision { .. }
            | Entry::Undone { .. }
            | Entry::Redone { .. } => {
                // Every sample is compared with all others, which would take long for thousands.
                if session.samples.len() > ALL && !session.samples.len().is_multiple_of(ALL) {
                    return false;
                }
                self.base_from_tracker = station::registration(session).map(|found| found.to_from_from);
                if let (Some(found), false) = (self.base_from_tracker, self.is_identified) {
                    return self.move_to(found);
                }
            }
            Entry::Identified(identified) => {
                if let Some(found) = of_result(session, identified) {
                    self.is_identified = true;
                    return self.move_to(found);
                }
            }
            _ => {}
        }
        false
    }

    fn move_to(&mut self, found: Isometry3<f64>) -> bool {
        let apart = |before: Isometry3<f64>| (before.translation.vector - found.translation.vector).norm();
        let is_moved = self.found.is_none_or(|before| apart(before) > MOVED);
        if is_moved {
            self.found = Some(found);
        }
        is_moved
    }

    /// Returns the transform from measured coordinates into the base of the nominal arm, once it is known.
    pub(super) const fn base_from_tracker(&self) -> Option<Isometry3<f64>> {
        self.base_from_tracker
    }

    fn place(&self, profile: &Profile) -> Point3<f64> {
        self.found.map_or_else(|| profile.tracker().position_in_base, |found| Point3::from(found.translation.vector))
    }

    /// Returns the position of the instrument. Within the reach of the arm there is none: the measured coordinates are not its own.
    pub(super) fn instrument(&self, profile: &Profile) -> Option<Point3<f64>> {
        let place = self.place(profile);
        (place.coords.norm() > reach(profile)).then_some(place)
    }

    /// Draws the instrument: a tracker on its tripod, or the axes of the measured coordinates.
    pub(super) fn draw(&self, canvas: &mut Canvas, profile: &Profile, moment: Moment) {
        let (mut heads, mut legs, mut axes) = (Vec::new(), Vec::new(), Vec::new());
        let place = self.place(profile);
        let label = if self.instrument(profile).is_some() {
            let [length, _] = HEAD;
            let neck = place - Vector3::z() * (0.6 * length);
            let floor = profile.floor().unwrap_or(0.0).min(place.z - SHORTEST);
            heads.push(place - Vector3::z() * (0.4 * length));
            legs.extend([0.0_f64, 120.0, 240.0].map(f64::to_radians).map(|angle| {
                [
                    style::at(&neck),
                    style::at(&Point3::new(place.x + FOOT * angle.cos(), place.y + FOOT * angle.sin(), floor)),
                ]
            }));
            if self.found.is_some() { "tracker" } else { "tracker (as planned)" }
        } else {
            let turned = self.found.unwrap_or_else(Isometry3::identity);
            let unit = 0.12 * reach(profile);
            axes.extend([Vector3::x(), Vector3::y(), Vector3::z()].map(|axis| style::vector(&(turned * axis * unit))));
            "origin of coordinates"
        };
        let [length, radius] = HEAD.map(style::single);
        let head = Capsules3D::from_lengths_and_radii(heads.iter().map(|_| length), heads.iter().map(|_| radius))
            .with_translations(heads.iter().map(style::at))
            .with_colors([style::TRACKER])
            .with_fill_mode(FillMode::Solid);
        let tripod = LineStrips3D::new(legs).with_radii([0.015]).with_colors([style::TRACKER]);
        let arrows = Arrows3D::from_vectors(axes.iter())
            .with_origins(axes.iter().map(|_| style::at(&place)))
            .with_colors([style::rgb(220, 80, 80), style::rgb(90, 190, 90), style::rgb(90, 120, 230)])
            .with_radii([style::points(1.5)]);
        let name = Points3D::new([style::at(&place)])
            .with_radii([style::points(0.5)])
            .with_colors([style::TRACKER])
            .with_labels([label])
            .with_show_labels(true);
        canvas.draw(moment, names::TRACKER, &[&head as &dyn AsComponents, &tripod, &arrows, &name]);
    }

    /// Returns the beam to the reflector.
    pub(super) fn beam(&self, profile: &Profile, posture: &Posture) -> Vec<[[f32; 3]; 2]> {
        let beam = self.instrument(profile).map(|place| [style::at(&place), style::at(&posture.reflector)]);
        beam.into_iter().collect()
    }
}

/// Returns the transform from measured coordinates into the base of the identified arm.
fn of_result(session: &Session, identified: &IdentifiedText) -> Option<Isometry3<f64>> {
    let samples = identified.samples.iter().zip(&identified.points).filter(|(_, point)| !point.rejected);
    let pairs: Vec<(Point3<f64>, Point3<f64>)> = samples
        .filter_map(|(number, point)| {
            let measured = session.point_of(session.sample(*number)?);
            Some((measured, from_xyz_mm(point.at_mm) + from_xyz_mm(point.identified_mm).coords))
        })
        .collect();
    station::registered(&pairs).map(|found| found.to_from_from)
}
