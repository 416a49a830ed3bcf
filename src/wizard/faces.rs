//! The two-face check: the same SMR seen in both faces of the instrument, whose difference shows errors of its axes.

use super::intent::{Intent, IntentInfo};
use super::notice::Notice;
use super::step::Action;
use crate::session::about::Detail;
use crate::session::journal::{Entry, from_xyz_mm};
use crate::session::set_up::{FacePair, Step};
use crate::session::state::Session;
use crate::units::to_mm;

/// The largest permissible difference of the faces is twice that of a point, which is taken as two standard deviations.
const SIGMAS: f64 = 4.0;
/// Differences beyond this are no error of the instrument (m).
const SLIP: f64 = 0.005;

/// The offer of a check: before the first point and after the last one.
pub(super) fn offer(step: Step, session: &Session) -> Option<IntentInfo> {
    let label = match step {
        Step::Instrument => "two-face check",
        Step::Capture if !session.samples.is_empty() => "two-face check at the end",
        Step::Profile | Step::Target | Step::Plan | Step::Capture | Step::Identify | Step::Verify | Step::Deliver => {
            return None;
        }
    };
    Some(IntentInfo::new(Intent::CheckFaces(FacePair::default()), label))
}

/// Judges a check and keeps it in the details for the report.
pub(super) fn check(pair: &FacePair, session: &Session) -> Vec<Action> {
    let (one, other) = (from_xyz_mm(pair.first_mm), from_xyz_mm(pair.second_mm));
    let difference = (one - other).norm();
    let distance = one.coords.norm();
    if !difference.is_finite() || distance < 0.1 {
        return vec![Action::Say(Notice::error("the coordinates are no points of the instrument"))];
    }
    if difference > SLIP {
        return vec![Action::Say(
            Notice::error(format!(
                "the two points are {:.1} mm apart: this is not one SMR in both faces",
                to_mm(difference)
            ))
            .hint("leave the SMR where it is, turn the instrument to its other face, and let it lock again"),
        )];
    }
    let instrument = session.robot.as_ref().and_then(|robot| robot.profile.instrument());
    let limit = instrument.map(|instrument| SIGMAS * instrument.sigma_at(distance));
    let when = if session.samples.is_empty() { "start" } else { "end" };
    let (found, at) = (to_mm(difference), distance);
    let said = match limit {
        Some(limit) => format!("two faces, {when}: {found:.3} mm at {at:.1} m, limit {:.3} mm", to_mm(limit)),
        None => format!("two faces, {when}: {found:.3} mm at {at:.1} m"),
    };
    let mut about = session.about.clone();
    let before = about.text(Detail::FieldCheck);
    let parts = before.split("; ").filter(|part| !part.is_empty() && !part.starts_with(&format!("two faces, {when}")));
    let text = parts.chain([said.as_str()]).collect::<Vec<_>>().join("; ");
    let mut actions = Vec::new();
    if about.set(Detail::FieldCheck, &text).is_ok() {
        actions.push(Action::Write(vec![Entry::About(about)]));
    }
    actions.push(Action::Say(match limit {
        Some(limit) if difference > limit => Notice::attention(said)
            .hint("beyond the limit of the class: warm up, then let the instrument's own field check compensate it, and check again"),
        Some(_) => Notice::info(said).hint("within the limit of the class; it is kept for the report"),
        None => Notice::info(said).hint("state the accuracy of the instrument in the cell, and the limit of its class is said"),
    }));
    actions
}

#[cfg(test)]
mod tests {
    use super::*;

    fn said(pair: FacePair, session: &Session) -> Vec<String> {
        check(&pair, session)
            .into_iter()
            .map(|action| if let Action::Say(notice) = action { notice.what } else { format!("{action:?}") })
            .collect()
    }

    #[test]
    fn a_difference_is_judged_and_a_slip_is_no_check() {
        let session = Session::default();
        let pair = FacePair { first_mm: (3000.0, 0.0, 0.0), second_mm: (3000.0, 0.03, 0.04) };
        let found = said(pair, &session);
        assert!(found[0].contains("two faces, start: 0.050 mm at 3.0 m"), "{found:?}");
        assert!(found[1].contains("0.050 mm"), "{found:?}");
        let slip = FacePair { first_mm: (3000.0, 0.0, 0.0), second_mm: (3000.0, 30.0, 0.0) };
        assert!(said(slip, &session)[0].contains("not one SMR"));
        assert!(said(FacePair::default(), &session)[0].contains("no points"));
    }
}
