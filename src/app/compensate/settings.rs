//! Tools and frames that a program names: from the program, or from the options.

use nalgebra::Isometry3;

use crate::cli::compensate::NamedPose;
use crate::program::motion::Setting;
use crate::text::printable;

/// What the options say about tools or about frames.
#[derive(Clone, Copy, Debug)]
pub(super) struct Settings<'a> {
    pub(super) given: &'a [NamedPose],
    /// `tool` or `frame`, for messages.
    pub(super) kind: &'static str,
}

impl Settings<'_> {
    /// The pose of a setting; a name in the options counts before what the program says.
    ///
    /// # Errors
    /// In words: nobody states it.
    pub(super) fn pose(&self, setting: &Setting) -> Result<Isometry3<f64>, String> {
        let of_name = |name: &str| {
            let same = |given: &&NamedPose| given.name.as_deref().is_some_and(|known| known.eq_ignore_ascii_case(name));
            self.given.iter().find(same).map(|given| given.pose)
        };
        let for_all = || self.given.iter().find(|given| given.name.is_none()).map(|given| given.pose);
        match setting {
            Setting::Identity => Ok(Isometry3::identity()),
            Setting::Known { name, pose } => Ok(of_name(name).unwrap_or(**pose)),
            Setting::Named(name) => of_name(name).or_else(for_all).ok_or_else(|| self.unknown(name)),
        }
    }

    fn unknown(&self, name: &str) -> String {
        let (kind, name) = (self.kind, printable(name));
        if name.is_empty() {
            format!("its {kind} is not stated; give '--{kind} x,y,z,rx,ry,rz'")
        } else {
            format!("its {kind} '{name}' is not in the given files; give '--{kind} {name}=x,y,z,rx,ry,rz'")
        }
    }
}
