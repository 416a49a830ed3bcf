//! `trupose profile list | show | new | check`.

mod new;

use std::io::Write;
use std::path::Path;

use super::{Console, load};
use crate::cli::ProfileCommand;
use crate::error::{ExitStatus, Failure};
use crate::profile::{Profile, builtin, builtin_names, check_text, list_text, show_text};

pub(super) fn run<O: Write, E: Write>(
    command: &ProfileCommand,
    console: &mut Console<O, E>,
) -> Result<ExitStatus, Failure> {
    match command {
        ProfileCommand::ImportUrdf(args) => super::export::import_urdf(args, console),
        ProfileCommand::ImportUr(args) => super::export::import_ur(args, console),
        ProfileCommand::List => {
            let profiles: Vec<Profile> = builtin_names()
                .filter_map(|name| Profile::parse(builtin(name)?, name).ok())
                .map(|(profile, _)| profile)
                .collect();
            console.print(&list_text(&profiles))?;
            Ok(ExitStatus::Accepted)
        }
        ProfileCommand::Show { profile } => {
            let loaded = load::profile(profile)?;
            for warning in &loaded.warnings {
                console.remark(&warning.to_string());
            }
            console.print(&show_text(&loaded.profile))?;
            Ok(ExitStatus::Accepted)
        }
        ProfileCommand::New(args) => new::run(args, console),
        ProfileCommand::Check { file } => {
            let name = file.display().to_string();
            let text = text(file)?;
            let outcome = Profile::parse(&text, &name);
            console.print(&check_text(&name, &outcome))?;
            Ok(if outcome.is_ok() { ExitStatus::Accepted } else { ExitStatus::Usage })
        }
    }
}

/// The text of a profile: a file, or a shipped one.
fn text(name: &Path) -> Result<String, Failure> {
    match builtin(&name.display().to_string()) {
        Some(text) if !name.exists() => Ok(text.to_owned()),
        _ => load::text(name),
    }
}
