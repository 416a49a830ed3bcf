//! The position of the tracker: as planned, until the measured points determine it.

use nalgebra::{Isometry3, Point3};
use rerun::{Boxes3D, FillMode, LineStrips3D};

use crate::profile::Profile;
use crate::recording::canvas::{Canvas, Moment};
use crate::recording::posture::{Posture, rest};
use crate::recording::{names, style};
use crate::session::journal::{Entry, IdentifiedText, from_xyz_mm};
use crate::session::state::Session;
use crate::session::station;
use crate::units::MILLIMETRE;

/// Size of the tracker (m).
const TRACKER_SIZE: [f32; 3] = [0.11, 0.11, 0.16];
/// Distance from the drawn position beyond which the tracker is drawn again (m). Each time adds a row per pose.
const MOVED: f64 = 20.0 * MILLIMETRE;

/// The position of the tracker as far as the journal determines it.
#[derive(Clone, Debug, Default)]
pub(super) struct Station {
    /// Registration of the samples so far to the nominal arm.
    base_from_tracker: Option<Isometry3<f64>>,
    /// Drawn position in the base; `None`: as planned.
    drawn: Option<Point3<f64>>,
    /// The position comes from a result.
    is_identified: bool,
}

impl Station {
    /// Updates the position after an entry that is already in `session`. Returns whether the tracker must be drawn again.
    pub(super) fn update(&mut self, session: &Session, entry: &Entry) -> bool {
        match entry {
            Entry::Profile { .. } => *self = Self::default(),
            Entry::Sample(_) | Entry::Correction(_) | Entry::Decision { .. } => {
                self.base_from_tracker = station::registration(session).map(|found| found.to_from_from);
                if let (Some(found), false) = (self.base_from_tracker, self.is_identified) {
                    return self.move_to(&found);
                }
            }
            Entry::Identified(identified) => {
                if let Some(found) = of_result(session, identified) {
                    self.is_identified = true;
                    return self.move_to(&found);
                }
            }
            _ => {}
        }
        false
    }

    fn move_to(&mut self, base_from_tracker: &Isometry3<f64>) -> bool {
        let place = Point3::from(base_from_tracker.translation.vector);
        let is_new = self.drawn.is_none_or(|drawn| (drawn - place).norm() > MOVED);
        if is_new {
            self.drawn = Some(place);
        }
        is_new
    }

    /// Returns the transform from measured coordinates into the base of the nominal arm, once it is known.
    pub(super) const fn base_from_tracker(&self) -> Option<Isometry3<f64>> {
        self.base_from_tracker
    }

    fn place(&self, profile: &Profile) -> Point3<f64> {
        self.drawn.unwrap_or_else(|| profile.tracker().position_in_base)
    }

    /// Draws the tracker.
    pub(super) fn draw(&self, canvas: &mut Canvas, profile: &Profile) {
        let label = if self.drawn.is_some() { "tracker" } else { "tracker (as planned)" };
        let body = Boxes3D::from_centers_and_half_sizes([style::at(&self.place(profile))], [TRACKER_SIZE])
            .with_colors([style::TRACKER])
            .with_fill_mode(FillMode::Solid)
            .with_labels([label]);
        canvas.draw_static(names::TRACKER, &body);
    }

    /// Draws the beam to the reflector of the nominal arm.
    pub(super) fn beam(&self, canvas: &mut Canvas, profile: &Profile, posture: &Posture, moment: Moment) {
        let beam = [style::at(&self.place(profile)), style::at(&posture.reflector)];
        canvas.draw(moment, names::BEAM, &LineStrips3D::update_fields().with_strips([beam]));
    }

    /// Draws the tracker and all beams of `session` again, except that of the sample number `except`.
    pub(super) fn draw_all(&self, canvas: &mut Canvas, session: &Session, except: Option<u64>) {
        let Some(profile) = session.mounted_profile() else { return };
        self.draw(canvas, &profile);
        let posture = Posture::nominal(&profile, &rest(&profile));
        for moment in [Moment::pose(0), Moment::search(0)] {
            self.beam(canvas, &profile, &posture, moment);
        }
        if session.identified.is_some() {
            self.beam(canvas, &profile, &posture, Moment::solver(0));
        }
        for sample in session.samples.iter().filter(|sample| Some(sample.noted.number) != except) {
            let posture = Posture::nominal(&profile, &session.configuration_of(sample));
            self.beam(canvas, &profile, &posture, Moment::pose(sample.noted.number));
        }
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
