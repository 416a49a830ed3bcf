//! What the checks say about a new point: live triage by distance, and drift where a pose is measured again.

use crate::session::journal::{FindingText, MeasuredText};
use crate::wizard::step::Cx;

/// All findings about a point that is about to be written, the most important first.
pub(super) fn findings(_cx: &Cx<'_>, _noted: &MeasuredText) -> Vec<FindingText> {
    Vec::new()
}
