//! Sessions that can be continued.

use jiff::Timestamp;
use serde::Serialize;

use crate::session::set_up::Step;
use crate::session::state::Session;

/// A session on offer.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct SessionChoice {
    pub name: String,
    pub folder: String,
    pub robot: String,
    /// How far it is, and how long ago it was left.
    pub progress: String,
}

/// A session that can be continued.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct SessionCard {
    pub name: String,
    pub folder: String,
    /// Title of the robot.
    pub robot: Option<String>,
    pub step: Step,
    /// Samples that count.
    pub measured: usize,
    /// Poses to measure, those measured included.
    pub poses: usize,
    /// Time of the last entry.
    #[serde(skip)]
    pub latest: Option<Timestamp>,
}

impl SessionCard {
    /// The card of the session in a folder.
    pub fn new(session: &Session, folder: String) -> Self {
        let measured = session.counted().count();
        Self {
            name: session.name.clone(),
            folder,
            robot: session.robot.as_ref().map(|robot| robot.profile.title().to_owned()),
            step: session.step,
            measured,
            poses: measured + session.open_rows().count(),
            latest: session.latest,
        }
    }

    /// How far the session is, and how long ago it was left.
    pub fn progress(&self, now: Timestamp) -> String {
        let far = if self.poses > 0 {
            format!("{} of {} measured", self.measured, self.poses)
        } else {
            format!("step {}", self.step)
        };
        let ago = self.latest.map(|latest| now.duration_since(latest).as_secs_f64() / 60.0);
        match ago {
            Some(minutes) if minutes < 1.0 => format!("{far}, just now"),
            Some(minutes) if minutes < 120.0 => format!("{far}, {minutes:.0} min ago"),
            Some(minutes) if minutes < 48.0 * 60.0 => format!("{far}, {:.0} h ago", minutes / 60.0),
            Some(minutes) => format!("{far}, {:.0} days ago", minutes / 1440.0),
            None => far,
        }
    }
}
