//! Forms of the cell that take what the links see: the place of the tracker, joint limits, a box, and the robot program.

use super::ask::number;
use super::cell::place;
use super::{Dialog, Form, Take};
use crate::profile::BoxText;
use crate::session::set_up::{FacePair, JointLimitsText, ProgramText, TrackerPoints};
use crate::wizard::Intent;

/// Languages, in the order of the list.
const LANGUAGES: &[&str] = &["rapid", "krl", "fanuc", "urscript", "val3", "inform", "ros"];
const WAITS: &[&str] = &["a time", "the operator"];

/// Asks for three points in the base and as the tracker sees them.
pub(super) fn tracker(known: &TrackerPoints) -> Dialog {
    let text = |at: usize, is_seen: bool| {
        let pair = known.0.get(at);
        let point = pair.map(|(base, seen)| if is_seen { seen } else { base });
        point.map_or_else(String::new, |(x, y, z)| format!("{x} {y} {z}"))
    };
    let base = "x y z in the base of the robot (mm). With a robot link Enter takes where the SMR is at the present joints; drive to three places well apart, not on one line.";
    let seen = "The same point as the tracker shows it (mm). With a live instrument Enter takes it.";
    let labels = ["point 1, base", "point 1, seen", "point 2, base", "point 2, seen", "point 3, base", "point 3, seen"];
    let mut form = Form::new("Where the tracker is: three points that are known in the base and that it sees", placed);
    for (index, label) in labels.into_iter().enumerate() {
        let is_seen = index % 2 == 1;
        let (about, take) = if is_seen { (seen, Take::Seen) } else { (base, Take::SmrInBase) };
        form = form.text(label, &text(index / 2, is_seen), about).taking(take);
    }
    Dialog::Form(form.done())
}

fn placed(values: &[String]) -> Result<Intent, String> {
    let [points @ .., _done] = values else { return Err("six points are needed".to_owned()) };
    let mut pairs = Vec::new();
    for (index, pair) in points.chunks(2).enumerate() {
        let [base, seen] = pair else { return Err("six points are needed".to_owned()) };
        let point = |text: &str, what: &str| {
            place(text)?.ok_or_else(|| format!("point {}, {what}: three numbers are needed", index + 1))
        };
        pairs.push((point(base, "base")?, point(seen, "seen")?));
    }
    Ok(Intent::PlaceTracker(TrackerPoints(pairs)))
}

/// Asks for one SMR in both faces.
pub(super) fn faces() -> Dialog {
    let first = "x y z (mm) of an SMR at rest, such as the one on the robot, in the present face. With a live instrument Enter takes it.";
    let second = "The same SMR, untouched, after the instrument was turned to its other face and has locked again.";
    Dialog::Form(
        Form::new("Two-face check: one SMR in both faces of the instrument", seen_twice)
            .text("present face", "", first)
            .taking(Take::Seen)
            .text("other face", "", second)
            .taking(Take::Seen)
            .done(),
    )
}

fn seen_twice(values: &[String]) -> Result<Intent, String> {
    let [first, second, _done] = values else { return Err("two points are needed".to_owned()) };
    let point = |text: &str| place(text)?.ok_or_else(|| "each face needs three numbers".to_owned());
    Ok(Intent::CheckFaces(FacePair { first_mm: point(first)?, second_mm: point(second)? }))
}

/// Asks for the limits of the joints in this cell.
pub(super) fn limits(known: &JointLimitsText) -> Dialog {
    let about = "Narrower than the robot's own, for poses in this cell. Drive the joint there by hand: Enter takes its value. Without a robot link type it (deg, sliding joints mm). Empty: the robot's own.";
    let mut form = Form::new("Joint limits of this cell: drive there, Enter", limited);
    for (joint, (name, range)) in known.0.iter().enumerate() {
        let shown = |value: Option<f64>| value.map_or_else(String::new, |value| value.to_string());
        form = form
            .text(format!("{name} lowest"), &shown(range.map(|(low, _)| low)), about)
            .taking(Take::Joint(joint))
            .text(format!("{name} highest"), &shown(range.map(|(_, high)| high)), about)
            .taking(Take::Joint(joint));
    }
    Dialog::Form(form.with_labels().done())
}

fn limited(values: &[String]) -> Result<Intent, String> {
    // Each value is preceded by the label of its field.
    let mut limits = Vec::new();
    let fields: Vec<(&str, &str)> = values.iter().filter_map(|value| value.split_once('\t')).collect();
    for pair in fields.chunks(2) {
        let [(label, low), (_, high)] = pair else { break };
        let Some(name) = label.strip_suffix(" lowest") else { break };
        let range = match (*low, *high) {
            ("", "") => None,
            ("", _) | (_, "") => return Err(format!("{name}: give both limits, or neither")),
            (low, high) => {
                let (one, other) = (number(label, low)?, number(label, high)?);
                if (one - other).abs() < f64::EPSILON {
                    return Err(format!("{name}: the limits are the same"));
                }
                // Driven to in either order.
                Some((one.min(other), one.max(other)))
            }
        };
        limits.push((name.to_owned(), range));
    }
    Ok(Intent::LimitJoints(JointLimitsText(limits)))
}

/// Asks for a box that the arm must not touch.
pub(super) fn obstacle(name: &str) -> Dialog {
    let corner = "x y z in the base of the robot (mm). Enter takes where the flange is at the present joints: drive it to two opposite corners.";
    Dialog::Form(
        Form::new("A box that the arm must not touch", boxed)
            .text("name", name, "Of the table, fence or fixture, in one word.")
            .text("one corner", "", corner)
            .taking(Take::FlangeInBase)
            .text("opposite corner", "", corner)
            .taking(Take::FlangeInBase)
            .done(),
    )
}

fn boxed(values: &[String]) -> Result<Intent, String> {
    let [name, one, other, _done] = values else { return Err("a name and two corners are needed".to_owned()) };
    let corner = |text: &str| place(text)?.ok_or_else(|| "each corner needs three numbers".to_owned());
    let (one, other) = (corner(one)?, corner(other)?);
    let name = name.split_whitespace().collect::<Vec<_>>().join("-");
    if name.is_empty() {
        return Err("the box needs a name".to_owned());
    }
    Ok(Intent::AddBox(BoxText {
        name,
        min_mm: (one.0.min(other.0), one.1.min(other.1), one.2.min(other.2)),
        max_mm: (one.0.max(other.0), one.1.max(other.1), one.2.max(other.2)),
    }))
}

/// Asks how the robot program of the plan is written.
pub(super) fn program(known: &ProgramText) -> Dialog {
    let at = LANGUAGES.iter().position(|language| *language == known.dialect).unwrap_or(0);
    let dwell = known.dwell_s.unwrap_or(6.0);
    Dialog::Form(
        Form::new("The robot program of the plan, written into the folder of the session", programmed)
            .pick("language", LANGUAGES, at, "Left/Right. rapid: ABB; krl: KUKA; fanuc: TP; urscript: Universal Robots; val3: Staubli; inform: Yaskawa; ros: trajectory.")
            .pick("waits at poses for", WAITS, usize::from(known.dwell_s.is_none()), "Left/Right. With a time the program drives on alone: the measurement must fit into it.")
            .text("time (s)", &dwell.to_string(), "Rest at each measured pose.")
            .text("speed (%)", &known.speed_percent.to_string(), "Of the full joint speed, at most 50."),
    )
}

fn programmed(values: &[String]) -> Result<Intent, String> {
    let [language, wait, dwell, speed] = values else { return Err("four values are needed".to_owned()) };
    let dwell_s = if WAITS.last() == Some(&wait.as_str()) { None } else { Some(number("time", dwell)?) };
    if dwell_s.is_some_and(|dwell| !(0.5..=3600.0).contains(&dwell)) {
        return Err("the time is from 0.5 to 3600 s".to_owned());
    }
    let speed_percent = number("speed", speed)?;
    if !(0.1..=50.0).contains(&speed_percent) {
        return Err("the speed is from 0.1 to 50 %".to_owned());
    }
    Ok(Intent::WriteProgram(ProgramText { dialect: language.clone(), dwell_s, speed_percent }))
}

#[cfg(test)]
mod tests {
    use crossterm::event::KeyCode;

    use super::*;
    use crate::tui::dialog::{DialogOutcome, Taken};
    use crate::tui::keymap::Key;

    fn enter(dialog: &mut Dialog) -> DialogOutcome {
        dialog.on_key(Key::plain_code(KeyCode::Enter))
    }

    #[test]
    fn enter_takes_where_the_joint_is_and_moves_on() {
        let joints = JointLimitsText(vec![("J1".to_owned(), None), ("J2".to_owned(), Some((-10.0, 20.0)))]);
        let mut dialog = limits(&joints);
        for value in ["90.5", "-45"] {
            dialog.see(&Taken { joints: vec![value.to_owned(), "7".to_owned()], ..Taken::default() });
            assert_eq!(enter(&mut dialog), DialogOutcome::Open);
        }
        // Tab leaves a limit as it is; what was typed is not overwritten.
        dialog.on_key(Key::plain_code(KeyCode::Tab));
        for key in ['3', '0'] {
            dialog.on_key(Key::ctrl('u'));
            dialog.on_key(Key::char(key));
        }
        assert_eq!(enter(&mut dialog), DialogOutcome::Open);
        let wanted = vec![("J1".to_owned(), Some((-45.0, 90.5))), ("J2".to_owned(), Some((-10.0, 0.0)))];
        assert_eq!(enter(&mut dialog), DialogOutcome::Submitted(Intent::LimitJoints(JointLimitsText(wanted))));
    }

    #[test]
    fn enter_on_the_name_of_a_box_moves_on_to_its_corners() {
        let mut dialog = obstacle("box1");
        for typed in ["", "900 500 0", "300 -500 400"] {
            dialog.paste(typed);
            let is_last = typed.starts_with('3');
            assert_eq!(enter(&mut dialog) == DialogOutcome::Open, !is_last, "{typed}");
        }
    }

    #[test]
    fn without_links_enter_accepts_the_form() {
        let mut dialog = limits(&JointLimitsText(vec![("J1".to_owned(), Some((-10.0, 20.0)))]));
        let wanted = vec![("J1".to_owned(), Some((-10.0, 20.0)))];
        assert_eq!(enter(&mut dialog), DialogOutcome::Submitted(Intent::LimitJoints(JointLimitsText(wanted))));
        let mut half = limits(&JointLimitsText(vec![("J1".to_owned(), None)]));
        half.paste("5");
        assert_eq!(enter(&mut half), DialogOutcome::Open);
    }

    #[test]
    fn points_and_corners_are_taken_where_they_are() {
        let mut dialog = tracker(&TrackerPoints::default());
        let mut wanted = Vec::new();
        for point in 0..3_u8 {
            let base = format!("{point} 2 3");
            let seen = format!("{point}.5 5 6");
            dialog.see(&Taken { seen: Some(seen), smr_in_base: Some(base), ..Taken::default() });
            assert_eq!((enter(&mut dialog), enter(&mut dialog)), (DialogOutcome::Open, DialogOutcome::Open));
            wanted.push(((f64::from(point), 2.0, 3.0), (f64::from(point) + 0.5, 5.0, 6.0)));
        }
        assert_eq!(enter(&mut dialog), DialogOutcome::Submitted(Intent::PlaceTracker(TrackerPoints(wanted))));
        let mut corners = obstacle("box1");
        corners.on_key(Key::plain_code(KeyCode::Tab));
        for corner in ["900 500 0", "300 -500 400"] {
            corners.see(&Taken { flange_in_base: Some(corner.to_owned()), ..Taken::default() });
            assert_eq!(enter(&mut corners), DialogOutcome::Open);
        }
        let wanted = BoxText { name: "box1".to_owned(), min_mm: (300.0, -500.0, 0.0), max_mm: (900.0, 500.0, 400.0) };
        assert_eq!(enter(&mut corners), DialogOutcome::Submitted(Intent::AddBox(wanted)));
    }

    #[test]
    fn a_program_needs_a_language_a_wait_and_a_speed() {
        let known = ProgramText { dialect: "krl".to_owned(), dwell_s: Some(6.0), speed_percent: 10.0 };
        let Dialog::Form(form) = program(&known) else { panic!() };
        assert_eq!(form.value(), Ok(Intent::WriteProgram(known.clone())));
        let by_hand = ProgramText { dwell_s: None, ..known };
        let Dialog::Form(form) = program(&by_hand) else { panic!() };
        assert_eq!(form.value(), Ok(Intent::WriteProgram(by_hand)));
        for texts in [["krl", "a time", "0", "10"], ["krl", "a time", "6", "80"], ["krl", "a time", "x", "10"]] {
            let texts: Vec<String> = texts.iter().map(|text| (*text).to_owned()).collect();
            assert!(programmed(&texts).is_err());
        }
        for language in LANGUAGES {
            assert!(language.parse::<crate::program::Dialect>().is_ok());
        }
    }
}
