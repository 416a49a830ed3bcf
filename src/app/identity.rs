//! Which arm and instrument a report is about, from options and a file.

use std::path::Path;

use super::load;
use crate::cli::IdentityArgs;
use crate::error::{ExitStatus, Failure};
use crate::session::about::{About, Detail};
use crate::text::printable;

/// What is `known` already, replaced by what the file and then the options say.
pub(super) fn about(args: &IdentityArgs, known: &About) -> Result<About, Failure> {
    let mut about = known.clone();
    let usage = |error: String| Failure::new(ExitStatus::Usage, error);
    if let Some(path) = &args.identity {
        for (detail, text) in read(path)?.given() {
            let refused = |error| usage(format!("'{}': {error}", path.display()));
            about.set(detail, &text).map_err(refused)?;
        }
    }
    let options = [(Detail::Serial, &args.serial), (Detail::Operator, &args.operator), (Detail::Site, &args.site)];
    for (detail, text) in options {
        if let Some(text) = text {
            about.set(detail, text).map_err(|error| usage(error.to_string()))?;
        }
    }
    Ok(about)
}

fn read(path: &Path) -> Result<About, Failure> {
    let text = load::text(path)?;
    ron::from_str(&text).map_err(|error| {
        let place = error.span.start;
        let message = format!(
            "'{}', line {}, column {}: {}",
            path.display(),
            place.line,
            place.col,
            printable(&error.code.to_string())
        );
        Failure::new(ExitStatus::Usage, message).hint(format!(
            "write for example (serial: \"20175\", certificate_due: \"2027-03-31\"); there are: {}",
            Detail::NAMES.join(", ")
        ))
    })
}
