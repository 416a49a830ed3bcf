//! `trupose demo --watch`: the wizard drives itself through its screens at reading speed, until a key is pressed.

use std::collections::VecDeque;
use std::time::Duration;

use crate::script::{Script, ScriptStep};
use crate::session::set_up::Step;
use crate::tui::{Move, Pilot};
use crate::wizard::{Intent, Wizard};

/// Time to read a page before something is done on it.
const PAGE: Duration = Duration::from_millis(3500);
/// Time to read the first measurements, and each of the others.
const FIRST_POSES: Duration = Duration::from_secs(2);
const POSE: Duration = Duration::from_millis(250);
/// Measurements that are shown slowly.
const SLOW_POSES: usize = 4;

/// Drives the wizard as a script says.
#[derive(Debug)]
pub(super) struct Tour {
    steps: VecDeque<ScriptStep>,
}

impl Tour {
    pub(super) fn of(script: Script) -> Self {
        Self { steps: script.steps.into() }
    }
}

impl Pilot for Tour {
    fn next(&mut self, wizard: &Wizard) -> Option<Move> {
        loop {
            let next = match self.steps.front()? {
                ScriptStep::Do(intent) => {
                    Some(Move { after: PAGE, caption: caption(intent).to_owned(), intent: intent.clone() })
                }
                ScriptStep::CaptureAll(_) | ScriptStep::Capture(..) => {
                    return measure(wizard).or_else(|| {
                        self.steps.pop_front();
                        self.next(wizard)
                    });
                }
                // What a script checks, says or restarts is nothing to see.
                ScriptStep::Fails(..)
                | ScriptStep::Blocked(..)
                | ScriptStep::Expect(..)
                | ScriptStep::CaptureCircles
                | ScriptStep::Restart
                | ScriptStep::Say(_) => None,
            };
            self.steps.pop_front();
            if next.is_some() {
                return next;
            }
        }
    }
}

/// The next thing to do while poses are measured: whatever the screen has under its first key.
fn measure(wizard: &Wizard) -> Option<Move> {
    let session = wizard.session();
    if session.step != Step::Capture || session.open_rows().next().is_none() {
        return None;
    }
    let offer = wizard.intents().into_iter().find(|info| info.is_default && info.is_enabled())?;
    let after = if session.samples.len() < SLOW_POSES { FIRST_POSES } else { POSE };
    let caption = "Capture: the robot goes to each pose, the instrument measures, and every point is checked at once";
    Some(Move { after, caption: caption.to_owned(), intent: offer.intent })
}

/// What is about to happen, in a sentence.
const fn caption(intent: &Intent) -> &'static str {
    match intent {
        Intent::ChooseProfile(_) => "Profile: first the robot is chosen, here the one of the method paper",
        Intent::NameSession(_) => "The session gets a name; everything is saved under it from the first moment on",
        Intent::ChooseInstrument(_) => "Instrument: here a simulated tracker in front of an arm with hidden errors",
        Intent::ChooseTarget(_) => "Target: where the SMR sits on the flange; the profile knows it",
        Intent::MakePlan(_) => "Plan: the poses that tell most about this arm are chosen; this takes a few seconds",
        Intent::AcceptPlan => "The plan is accepted and saved as plan.csv; a robot program can be written from it",
        Intent::Identify => "Identify: the errors of the arm are found from the distances between the points",
        Intent::About(_) => "Deliver: serial number and operator are entered for the report",
        Intent::Deliver => "Deliver: report, calibration and corrected models are written",
        _ => "On to the next page",
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::*;

    #[test]
    fn the_demo_is_driven_by_its_script() {
        let script = Script::parse(include_str!("../../sessions/demo.script.ron"), &BTreeMap::new()).unwrap();
        let mut tour = Tour::of(script);
        let wizard = Wizard::new(jiff::Timestamp::UNIX_EPOCH);
        let mut names = Vec::new();
        while let Some(next) = tour.next(&wizard) {
            assert!(!next.caption.is_empty() && next.after >= POSE);
            names.push(next.intent.name());
        }
        assert_eq!(names.first(), Some(&"ChooseProfile"));
        assert_eq!(names.last(), Some(&"Deliver"));
        assert!(names.contains(&"AcceptPlan") && names.contains(&"Identify"), "{names:?}");
    }
}
