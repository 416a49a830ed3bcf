//! Tools and frames that a program names: from the program, or from the options.

use std::str::FromStr;

use nalgebra::{Isometry3, Translation3, UnitQuaternion};

use super::report::Missing;
use crate::program::motion::Setting;
use crate::text::printable;
use crate::units::{from_deg, from_mm};

/// A pose with the name that a program gives it; without a name for all.
#[derive(Clone, Debug, PartialEq)]
pub struct NamedPose {
    pub name: Option<String>,
    pub pose: Isometry3<f64>,
}

impl FromStr for NamedPose {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wrong = || {
            format!(
                "'{}' is no pose; write for example 'gripper=0,0,120,0,0,90' (mm; degrees about the fixed x, y, z)",
                printable(text)
            )
        };
        let (name, numbers) =
            text.rsplit_once('=').map_or((None, text), |(name, numbers)| (Some(name.trim()), numbers));
        let values: Vec<f64> = numbers
            .split(',')
            .map(|number| number.trim().parse())
            .collect::<Result<_, _>>()
            .map_err(|_not_one| wrong())?;
        match values[..] {
            [x, y, z, roll, pitch, yaw] if values.iter().all(|value| value.is_finite()) => {
                let rotation = UnitQuaternion::from_euler_angles(from_deg(roll), from_deg(pitch), from_deg(yaw));
                let translation = Translation3::new(from_mm(x), from_mm(y), from_mm(z));
                Ok(Self { name: name.map(str::to_owned), pose: Isometry3::from_parts(translation, rotation) })
            }
            _ => Err(wrong()),
        }
    }
}

/// What the user says about tools or about frames.
#[derive(Clone, Copy, Debug)]
pub struct Settings<'a> {
    pub given: &'a [NamedPose],
    /// `tool` or `frame`, for messages.
    pub kind: &'static str,
}

impl Settings<'_> {
    /// The pose of a setting; a name that the user gives counts before what the program says.
    ///
    /// # Errors
    /// Nobody states it.
    pub fn pose(&self, setting: &Setting) -> Result<Isometry3<f64>, Missing> {
        let of_name = |name: &str| {
            let same = |given: &&NamedPose| given.name.as_deref().is_some_and(|known| known.eq_ignore_ascii_case(name));
            self.given.iter().find(same).map(|given| given.pose)
        };
        let for_all = || self.given.iter().find(|given| given.name.is_none()).map(|given| given.pose);
        match setting {
            Setting::Identity => Ok(Isometry3::identity()),
            Setting::Known { name, pose } => Ok(of_name(name).unwrap_or(**pose)),
            Setting::Named(name) => {
                of_name(name).or_else(for_all).ok_or_else(|| Missing { kind: self.kind, name: name.clone() })
            }
        }
    }
}
