//! The origin of results: program, profile and inputs with their hashes.

use crate::profile::Profile;
use crate::session::sha256;
use crate::session::summary::{InputFile, InputRole, Provenance};

/// The record of an input that was read from `file` in this role.
pub fn input_file(role: InputRole, file: String, bytes: &[u8]) -> InputFile {
    InputFile { role, file, sha256: sha256(bytes) }
}

/// Provenance of results made at `created` (RFC 3339, UTC).
pub(crate) fn provenance(profile: &Profile, profile_text: &str, created: String, inputs: Vec<InputFile>) -> Provenance {
    Provenance {
        program: format!("{} {}", env!("CARGO_PKG_NAME"), env!("CARGO_PKG_VERSION")),
        created,
        profile: profile.name().to_owned(),
        robot: profile.title().to_owned(),
        profile_sha256: sha256(profile_text.as_bytes()),
        inputs,
        serial: String::new(),
        instrument_serial: String::new(),
    }
}
