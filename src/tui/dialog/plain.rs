//! Dialogs one question after the other, for plain lines. The words are those of the screens.

use super::{Chosen, Dialog, Form};
use crate::tui::form::TextField;
use crate::wizard::{Intent, PlanSettings};

/// The intent of a dialog whose questions are all answered.
#[derive(Clone, Debug, PartialEq)]
pub enum Answered {
    Intent(Intent),
    /// The operator has said no.
    Cancelled,
    /// The values do not fit together; the questions begin again.
    Wrong(String),
}

impl Dialog {
    /// The question of this number, from 0; `None` if there are no more.
    pub fn question(&self, number: usize) -> Option<Vec<String>> {
        match self {
            Self::Form(form) => form.question(number),
            _ if number > 0 => None,
            Self::Confirm { lines, .. } => Some([&lines[..], &["y or n".to_owned()]].concat()),
            Self::Text { field, .. } | Self::Note { field, .. } => Some(vec![with_value(field.label(), &field.text())]),
            Self::Number { field, .. } => Some(vec![with_value(field.label(), &field.text())]),
            Self::Choice { list, .. } | Self::Menu { list, .. } => Some(list.question()),
        }
    }

    /// Answers a question. An empty line keeps the value shown.
    ///
    /// # Errors
    /// What is wrong with the answer.
    pub fn answer(&mut self, number: usize, line: &str) -> Result<(), String> {
        match self {
            Self::Form(form) => form.answer(number, line),
            Self::Confirm { is_yes, .. } => {
                *is_yes = match line {
                    "y" | "yes" => true,
                    "n" | "no" => false,
                    "" => *is_yes,
                    _ => return Err("answer y or n".to_owned()),
                };
                Ok(())
            }
            Self::Text { field, .. } | Self::Note { field, .. } => {
                replace(field, line);
                field.problem().map_or(Ok(()), Err)
            }
            Self::Number { field, .. } => {
                if !line.is_empty() {
                    field.set(line);
                }
                field.value().map(|_| ())
            }
            Self::Choice { list, .. } | Self::Menu { list, .. } => list.answer(line),
        }
    }

    /// The dialog that follows from the choice of a menu.
    pub fn continued(&self) -> Option<Box<Self>> {
        let Self::Menu { list, then } = self else { return None };
        match list.selected().and_then(|index| then.get(index))? {
            Chosen::Dialog(dialog) => Some(dialog.clone()),
            Chosen::Intent(_) => None,
        }
    }

    /// What the answers make.
    pub fn answered(&self) -> Answered {
        let intent = match self {
            Self::Confirm { is_yes: false, .. } => return Answered::Cancelled,
            Self::Confirm { intent, .. } => Ok(intent.clone()),
            Self::Text { field, intent } => Ok(intent(field.text().trim().to_owned())),
            Self::Note { field, pose } => Ok(super::note(pose, field)),
            Self::Number { field, intent } => field.value().map(*intent),
            Self::Form(form) => form.value(),
            Self::Menu { list, then } => match list.selected().and_then(|index| then.get(index)) {
                Some(Chosen::Intent(intent)) => Ok(intent.clone()),
                Some(Chosen::Dialog(_)) | None => Err("nothing is chosen".to_owned()),
            },
            Self::Choice { list, intents } => {
                let chosen = list.selected().and_then(|index| intents.get(index).cloned());
                chosen.ok_or_else(|| "nothing is chosen".to_owned())
            }
        };
        intent.map_or_else(Answered::Wrong, Answered::Intent)
    }

    /// The settings of a search for poses, which a screen has on its page.
    pub fn plan(settings: PlanSettings) -> Self {
        let PlanSettings { poses, verification, candidates, seed, drift_every } = settings;
        let form = Form::new("Settings of the search", planned)
            .text("poses to identify", &poses.to_string(), "used to identify the arm")
            .text("poses to verify", &verification.to_string(), "used only to check the result")
            .text("candidates", &candidates.to_string(), "random poses to choose from")
            .text("seed", &seed.to_string(), "another seed, other candidates")
            .text("poses between drift checks", &drift_every.to_string(), "0: no pose is repeated");
        Self::Form(form)
    }
}

fn planned(values: &[String]) -> Result<Intent, String> {
    let numbers: Vec<u64> = values
        .iter()
        .map(|value| value.parse().ok().ok_or_else(|| format!("'{value}' is not a whole number")))
        .collect::<Result<_, _>>()?;
    let [poses, verification, candidates, seed, drift_every] = numbers[..] else {
        return Err("five numbers are needed".to_owned());
    };
    let count = |value: u64| usize::try_from(value).unwrap_or(usize::MAX);
    Ok(Intent::MakePlan(PlanSettings {
        poses: count(poses),
        verification: count(verification),
        candidates: count(candidates),
        seed,
        drift_every: count(drift_every),
    }))
}

/// A label with the value that an empty line keeps.
pub(super) fn with_value(label: &str, value: &str) -> String {
    if value.is_empty() { label.to_owned() } else { format!("{label} [{value}]") }
}

/// Puts an answer into a field; an empty one keeps its value, a hyphen empties it.
pub(super) fn replace(field: &mut TextField, line: &str) {
    if line.is_empty() {
        return;
    }
    field.clear();
    if line != "-" {
        field.paste(line);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tui::form::{ChoiceList, NumberField};

    #[test]
    fn forms_are_asked_line_by_line() {
        let mut dialog = Dialog::plan(PlanSettings::default());
        assert_eq!(dialog.question(0).unwrap().last().unwrap(), "poses to identify [56]");
        assert_eq!(dialog.answer(0, "40"), Ok(()));
        for number in 1..5 {
            assert!(dialog.question(number).is_some());
            assert_eq!(dialog.answer(number, ""), Ok(()));
        }
        assert_eq!(dialog.question(5), None);
        let Answered::Intent(Intent::MakePlan(settings)) = dialog.answered() else { panic!() };
        assert_eq!(settings, PlanSettings { poses: 40, ..PlanSettings::default() });
        assert_eq!(dialog.answer(3, "x"), Ok(()));
        assert_eq!(dialog.answered(), Answered::Wrong("'x' is not a whole number".to_owned()));
    }

    #[test]
    fn choices_are_numbers_or_beginnings_of_words() {
        let list = ChoiceList::new("Robot", ["soochow", "ur5", "ur5e"].map(str::to_owned).to_vec(), 0);
        let intents = ["a", "b", "c"].map(|name| Intent::ChooseProfile(name.to_owned())).to_vec();
        let mut dialog = Dialog::Choice { list, intents };
        assert_eq!(dialog.question(0).unwrap(), ["Robot", "    1  soochow", "    2  ur5", "    3  ur5e", "number [1]"]);
        let mut chosen = |line: &str| dialog.answer(0, line).map(|()| dialog.answered());
        let intent = |name: &str| Ok(Answered::Intent(Intent::ChooseProfile(name.to_owned())));
        assert_eq!((chosen("3"), chosen("ur5"), chosen("soo")), (intent("c"), intent("b"), intent("a")));
        assert!(chosen("ur").is_err() && chosen("0").is_err() && chosen("9").is_err() && chosen("x").is_err());
        assert_eq!(chosen(""), intent("a"));
    }

    #[test]
    fn dangers_and_numbers_are_asked() {
        let mut dialog = Dialog::Confirm { intent: Intent::Quit, lines: vec!["Quit?".to_owned()], is_yes: false };
        assert!(dialog.answer(0, "perhaps").is_err());
        assert_eq!((dialog.answer(0, ""), dialog.answered()), (Ok(()), Answered::Cancelled));
        assert_eq!((dialog.answer(0, "y"), dialog.answered()), (Ok(()), Answered::Intent(Intent::Quit)));
        let field = NumberField::new("Poses to add", 8.0, "", (1.0, 200.0)).whole();
        let mut dialog = Dialog::Number { field, intent: |_| Intent::Next };
        assert!(dialog.answer(0, "0").is_err());
        assert_eq!(dialog.answer(0, "12"), Ok(()));
    }
}
