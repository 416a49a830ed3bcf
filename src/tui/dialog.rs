//! Dialogs: they ask for the value of an intent, or for a confirmation. Drawn over the content of a screen.

pub mod ask;
mod cell;
mod correct;
mod form;
pub mod links;
mod place;
mod plain;

use crossterm::event::KeyCode;
use ratatui::buffer::Buffer;
use ratatui::layout::Rect;

pub use form::{Build, Form, Take, Taken};
pub use plain::Answered;

use super::form::{ChoiceList, Completion, FieldOutcome, NumberField, TextField};
use super::keymap::{Key, KeyHint};
use super::paint;
use super::theme::{Role, Theme};
use crate::runtime;
use crate::session::set_up::{CoordinateUnit, InstrumentChoice};
use crate::session::simulation::{Simulation, Truth};
use crate::text::wrapped;
use crate::wizard::view::{Content, RowState, RowView, ViewModel};
use crate::wizard::{Danger, Intent, IntentInfo};

/// Label, text, how it is understood or a problem of two lines.
const LINES_OF_COORDINATES: u16 = 5;
/// Largest number of poses that can be added at once.
const MOST_POSES: f64 = 200.0;

/// An open dialog.
#[derive(Clone, Debug)]
pub enum Dialog {
    /// Asks for a confirmation.
    Confirm {
        intent: Intent,
        /// Lines of explanation.
        lines: Vec<String>,
        /// Whether the focus is on yes.
        is_yes: bool,
    },
    /// Asks for a text.
    Text { field: TextField, intent: fn(String) -> Intent },
    /// Asks for a note to a pose.
    Note { field: TextField, pose: String },
    /// Asks for a number.
    Number { field: NumberField, intent: fn(f64) -> Intent },
    /// Asks for one of several intents.
    Choice {
        list: ChoiceList,
        /// Intent of each choice.
        intents: Vec<Intent>,
    },
    /// Asks what comes next: an intent, or another dialog.
    Menu {
        list: ChoiceList,
        /// What follows from each choice.
        then: Vec<Chosen>,
    },
    /// Asks for several values at once.
    Form(Form),
}

/// What follows from a choice of a menu.
#[derive(Clone, Debug)]
pub enum Chosen {
    Intent(Intent),
    Dialog(Box<Dialog>),
}

/// State of a dialog after a key.
#[derive(Clone, Debug, PartialEq)]
pub enum DialogOutcome {
    Open,
    /// Closed without an intent.
    Closed,
    /// Closed with an intent to send.
    Submitted(Intent),
}

impl Dialog {
    /// The dialog that an offered intent needs before it is sent; `None` if it needs none.
    pub fn before(info: &IntentInfo, view: &ViewModel) -> Option<Self> {
        let text = |label: &str, value: &str, intent: fn(String) -> Intent| {
            Some(Self::Text { field: TextField::new(label, value).proposed(), intent })
        };
        let path = |label: &str, value: &str, intent: fn(String) -> Intent| {
            Some(Self::Text { field: TextField::new(label, value).proposed().path(completed), intent })
        };
        match &info.intent {
            Intent::ChooseProfile(_) => choose_profile(view),
            Intent::ChooseInstrument(_) => Some(choose_instrument(view)),
            Intent::NameSession(proposal) => text("Name of the session", proposal, Intent::NameSession),
            Intent::LoadPlan(proposal) => path("File with the poses (CSV)", proposal, Intent::LoadPlan),
            Intent::TypeReading(_) => Some(ask::coordinates(view, "")),
            Intent::StatePayload(payload) => Some(ask::payload(payload)),
            Intent::About(about) => Some(ask::about(about)),
            Intent::CorrectProgram(_) => Some(correct::program()),
            Intent::DescribeCell(cell) => Some(cell::cell(cell, matches!(view.content, Content::Verify(_)))),
            Intent::DescribeRobot(sheet) => Some(cell::data_sheet(sheet)),
            Intent::PlaceTracker(points) => Some(place::tracker(points)).map(|dialog| dialog.seeing(view)),
            Intent::CheckFaces(_) => Some(place::faces().seeing(view)),
            Intent::LimitJoints(limits) => Some(place::limits(limits)).map(|dialog| dialog.seeing(view)),
            Intent::AddBox(proposal) => Some(place::obstacle(&proposal.name)).map(|dialog| dialog.seeing(view)),
            Intent::WriteProgram(settings) => Some(place::program(settings)),
            Intent::Note(_) => text(&note_label(view), "", Intent::Note),
            Intent::NotePose { .. } => {
                choose_pose(view, |_| true, |pose| Intent::NotePose { pose, text: String::new() })
            }
            Intent::GoToPose(_) => choose_pose(view, |_| true, Intent::GoToPose),
            Intent::Exclude(_) => choose_pose(view, |state| state == RowState::Measured, Intent::Exclude),
            Intent::Include(_) => choose_pose(view, |state| state == RowState::LeftOut, Intent::Include),
            Intent::ReadPoints(proposal) => {
                path("File with the points (text, CSV or xlsx)", proposal, Intent::ReadPoints)
            }
            Intent::ShowPoints(_) => text("Points, one per line", "", Intent::ShowPoints),
            Intent::SuggestPoses(count) => {
                #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a small whole number")]
                let intent = |count: f64| Intent::SuggestPoses(count as usize);
                let field = NumberField::new("Poses to add", *count as f64, "", (1.0, MOST_POSES)).whole();
                Some(Self::Number { field, intent })
            }
            intent => confirm(intent, info, view),
        }
    }

    /// Rows that a dialog takes above its screen, if that stays in view: what is typed is compared with it.
    pub fn rows_above(&self) -> Option<u16> {
        match self {
            Self::Text { field, .. } if field.is_checked() => Some(LINES_OF_COORDINATES),
            Self::Text { .. }
            | Self::Note { .. }
            | Self::Confirm { .. }
            | Self::Number { .. }
            | Self::Choice { .. }
            | Self::Menu { .. }
            | Self::Form(_) => None,
        }
    }

    /// This dialog with what was typed into another one that asked the same. Coordinates are not taken over: the next ones are
    /// typed there.
    #[must_use]
    pub fn with_answers_of(self, other: Self) -> Self {
        match (self, other) {
            (Self::Text { field, intent }, Self::Text { field: other, .. })
                if field.label() == other.label() && !field.is_checked() =>
            {
                Self::Text { field: other.proposed(), intent }
            }
            (Self::Form(form), Self::Form(other)) if form.title() == other.title() => Self::Form(other),
            (dialog, _) => dialog,
        }
    }

    /// The dialog with what the links see now.
    #[must_use]
    fn seeing(mut self, view: &ViewModel) -> Self {
        self.see(&taken(view));
        self
    }

    /// Sees what the links see now.
    pub fn see(&mut self, taken: &Taken) {
        if let Self::Form(form) = self {
            form.see(taken);
        }
    }

    pub fn on_key(&mut self, key: Key) -> DialogOutcome {
        if let Self::Menu { list, then } = self {
            let reaction = list.on_key(key);
            return match (reaction, list.selected().and_then(|index| then.get(index))) {
                (FieldOutcome::Submitted, Some(Chosen::Intent(intent))) => DialogOutcome::Submitted(intent.clone()),
                (FieldOutcome::Submitted, Some(Chosen::Dialog(dialog))) => {
                    let next = (**dialog).clone();
                    *self = next;
                    DialogOutcome::Open
                }
                (FieldOutcome::Cancelled, _) => DialogOutcome::Closed,
                _ => DialogOutcome::Open,
            };
        }
        let (reaction, intent) = match self {
            Self::Confirm { intent, is_yes, .. } => match key.code {
                KeyCode::Char('y') => (FieldOutcome::Submitted, Some(intent.clone())),
                // A second Ctrl-C confirms.
                KeyCode::Char('c') if key.has_modifier() && *intent == Intent::Quit => {
                    (FieldOutcome::Submitted, Some(intent.clone()))
                }
                KeyCode::Enter if *is_yes => (FieldOutcome::Submitted, Some(intent.clone())),
                KeyCode::Enter | KeyCode::Esc | KeyCode::Char('n') => (FieldOutcome::Cancelled, None),
                KeyCode::Tab | KeyCode::BackTab | KeyCode::Left | KeyCode::Right | KeyCode::Up | KeyCode::Down => {
                    *is_yes = !*is_yes;
                    (FieldOutcome::Changed, None)
                }
                _ => (FieldOutcome::Ignored, None),
            },
            Self::Text { field, intent } => (field.on_key(key), Some(intent(field.text().trim().to_owned()))),
            Self::Note { field, pose } => (field.on_key(key), Some(note(pose, field))),
            Self::Number { field, intent } => (field.on_key(key), field.value().ok().map(*intent)),
            Self::Form(form) => (form.on_key(key), form.value().ok()),
            Self::Choice { list, intents } => {
                (list.on_key(key), list.selected().and_then(|index| intents.get(index).cloned()))
            }
            // Handled above.
            Self::Menu { .. } => (FieldOutcome::Ignored, None),
        };
        match (reaction, intent) {
            (FieldOutcome::Submitted, Some(intent)) => DialogOutcome::Submitted(intent),
            (FieldOutcome::Cancelled, _) => DialogOutcome::Closed,
            _ => DialogOutcome::Open,
        }
    }

    pub fn paste(&mut self, text: &str) {
        match self {
            Self::Confirm { .. } => {}
            Self::Text { field, .. } | Self::Note { field, .. } => field.paste(text),
            Self::Number { field, .. } => field.paste(text),
            Self::Choice { list, .. } | Self::Menu { list, .. } => list.paste(text),
            Self::Form(form) => form.paste(text),
        }
    }

    /// Keys of the dialog.
    pub fn key_hints(&self) -> Vec<KeyHint> {
        let mut items = vec![KeyHint::new("Enter", "accept", 0), KeyHint::new("Esc", "cancel", 1)];
        match self {
            Self::Confirm { .. } => {
                items = vec![KeyHint::new("y", "yes", 1), KeyHint::new("n", "no", 1), KeyHint::new("Tab", "switch", 3)];
            }
            Self::Choice { .. } | Self::Menu { .. } => items.push(KeyHint::new("Up/Down", "choose", 2)),
            Self::Form(form) => {
                if let Some(here) = form.offer() {
                    items = vec![KeyHint::new("Enter", format!("take {here}"), 0), KeyHint::new("Esc", "cancel", 1)];
                }
                items.push(KeyHint::new("Tab", "next field", 2));
                items.push(KeyHint::new("Ctrl-U", "clear the line", 4));
            }
            Self::Text { .. } | Self::Note { .. } | Self::Number { .. } => {
                if matches!(self, Self::Text { field, .. } if field.is_path()) {
                    items.push(KeyHint::new("Tab", "complete", 2));
                }
                items.push(KeyHint::new("Ctrl-U", "clear the line", 4));
            }
        }
        items
    }

    pub fn draw(&self, theme: Theme, area: Rect, buf: &mut Buffer) {
        match self {
            Self::Confirm { lines, is_yes, .. } => draw_confirmation(lines, *is_yes, theme, area, buf),
            Self::Text { field, .. } | Self::Note { field, .. } => field.draw(theme, area, buf),
            Self::Number { field, .. } => field.draw(theme, area, buf),
            Self::Choice { list, .. } | Self::Menu { list, .. } => list.draw(theme, area, buf),
            Self::Form(form) => form.draw(theme, area, buf),
        }
    }
}

/// A path as far as the names of files say it.
pub fn completed(begun: &str) -> Completion {
    let (text, names) = runtime::completions(begun);
    Completion { text, names }
}

/// What the links see now, as it is written into fields.
pub fn taken(view: &ViewModel) -> Taken {
    let Some(live) = view.live.as_ref().filter(|live| live.down.is_none()) else { return Taken::default() };
    let point = |[x, y, z]: [f64; 3]| format!("{x:.3} {y:.3} {z:.3}");
    Taken {
        seen: live.point_mm.map(point),
        smr_in_base: live.smr_in_base_mm.map(point),
        flange_in_base: live.flange_in_base_mm.map(point),
        joints: live.joints_shown.iter().map(|value| format!("{value:.2}")).collect(),
    }
}

fn draw_confirmation(lines: &[String], is_yes: bool, theme: Theme, area: Rect, buf: &mut Buffer) {
    let columns = usize::from(area.width);
    let mut row = 0;
    for line in lines.iter().flat_map(|line| wrapped(&theme.glyphs.show(line), columns)) {
        let role = if row == 0 { Role::Title } else { Role::Plain };
        paint::text(buf, area, (0, row), &line, theme.style(role));
        row += 1;
    }
    let (no, yes) = if is_yes { (Role::Plain, Role::Focus) } else { (Role::Focus, Role::Plain) };
    let column = paint::text(buf, area, (0, row + 1), "[ no ]", theme.style(no));
    paint::text(buf, area, (column + 2, row + 1), "[ yes ]", theme.style(yes));
}

fn choose_profile(view: &ViewModel) -> Option<Dialog> {
    let Content::Profile(content) = &view.content else { return None };
    let chosen = content.chosen.as_ref().and_then(|card| content.profiles.iter().position(|name| *name == card.name));
    let intents = content.profiles.iter().cloned().map(Intent::ChooseProfile).collect();
    Some(Dialog::Choice { list: ChoiceList::new("Robot", content.profiles.clone(), chosen.unwrap_or(0)), intents })
}

/// The instruments that need no further values. The hidden errors of the method paper only fit its own arm.
fn choose_instrument(view: &ViewModel) -> Dialog {
    let mut choices = Vec::new();
    let simulated = |truth| InstrumentChoice::Simulated(Simulation { truth, ..Simulation::default() });
    if view.header.robot.as_deref().is_some_and(|robot| robot.contains("method paper")) {
        choices.push(("simulated: the arm of the method paper, table II hidden".to_owned(), simulated(Truth::Paper)));
    }
    choices.push(("simulated: an arm with random errors, for rehearsing".to_owned(), simulated(Truth::Drawn)));
    for unit in CoordinateUnit::ALL {
        let label = format!("by hand: coordinates typed or pasted, in {}", unit.sign());
        choices.push((label, InstrumentChoice::Manual { unit }));
    }
    let (labels, instruments): (Vec<String>, Vec<InstrumentChoice>) = choices.into_iter().unzip();
    let intents = instruments.into_iter().map(Intent::ChooseInstrument).collect();
    Dialog::Choice { list: ChoiceList::new("Instrument", labels, 0), intents }
}

/// The note in a field.
fn note(pose: &str, field: &TextField) -> Intent {
    Intent::NotePose { pose: pose.to_owned(), text: field.text().trim().to_owned() }
}

/// The label of a note, with the pose that it will be attached to.
fn note_label(view: &ViewModel) -> String {
    match &view.content {
        Content::Capture(content) => match &content.pose {
            Some(pose) => format!("Note to pose {pose}"),
            None => "Note".to_owned(),
        },
        _ => "Note".to_owned(),
    }
}

/// A choice among the poses in some states; `None` if there is none.
fn choose_pose(view: &ViewModel, is_wanted: fn(RowState) -> bool, intent: fn(String) -> Intent) -> Option<Dialog> {
    let Content::Capture(content) = &view.content else { return None };
    let rows: Vec<&RowView> = content.rows.iter().filter(|row| is_wanted(row.state)).collect();
    let labels: Vec<String> =
        rows.iter().map(|row| format!("{}  {}  {}", row.pose, row.kind, row.state.words())).collect();
    let shown = rows.iter().position(|row| Some(row.row) == content.row);
    let intents = rows.iter().map(|row| intent(row.pose.clone())).collect();
    Some(Dialog::Choice { list: ChoiceList::new("Pose", labels, shown.unwrap_or(0)), intents })
}

fn confirm(intent: &Intent, info: &IntentInfo, view: &ViewModel) -> Option<Dialog> {
    let lines = match info.danger {
        Danger::None => return None,
        Danger::Turns => vec![
            format!("{}?", capitalised(&info.label)),
            "Its head moves, searches there and locks. Nobody may look into the beam, and nothing may be in its way."
                .to_owned(),
        ],
        Danger::DropsData => vec![
            format!("{}?", capitalised(&info.label)),
            "It will no longer count. It stays in the journal; nothing is deleted.".to_owned(),
        ],
        Danger::Leaves if view.header.is_unsaved => {
            let lost = "The last change is NOT saved and will be lost.".to_owned();
            let saved = format!("{} entries are saved.", view.header.saved_entries);
            let resume = view.header.folder.iter().map(|folder| format!("Resume later with: trupose resume {folder}"));
            ["Quit the program?".to_owned(), lost, saved].into_iter().chain(resume).collect()
        }
        Danger::Leaves => match &view.header.folder {
            Some(folder) => vec![
                "Quit the program?".to_owned(),
                format!("{} entries are saved. Resume later with:", view.header.saved_entries),
                format!("trupose resume {folder}"),
            ],
            None => vec!["Quit the program?".to_owned(), "Nothing has been measured yet; nothing is lost.".to_owned()],
        },
    };
    // Before there is a session nothing can be lost.
    let is_yes = info.danger == Danger::Leaves && view.header.folder.is_none();
    Some(Dialog::Confirm { intent: intent.clone(), lines, is_yes })
}

fn capitalised(text: &str) -> String {
    let mut characters = text.chars();
    characters.next().map_or_else(String::new, |first| first.to_uppercase().chain(characters).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_answer_to_a_danger_is_no_unless_meant() {
        let dialog = || Dialog::Confirm { intent: Intent::Quit, lines: vec!["Leave?".to_owned()], is_yes: false };
        assert_eq!(dialog().on_key(Key::plain_code(KeyCode::Enter)), DialogOutcome::Closed);
        assert_eq!(dialog().on_key(Key::char('y')), DialogOutcome::Submitted(Intent::Quit));
        assert_eq!(dialog().on_key(Key::ctrl('c')), DialogOutcome::Submitted(Intent::Quit));
        let mut toggled = dialog();
        assert_eq!(toggled.on_key(Key::plain_code(KeyCode::Tab)), DialogOutcome::Open);
        assert_eq!(toggled.on_key(Key::plain_code(KeyCode::Enter)), DialogOutcome::Submitted(Intent::Quit));
    }

    #[test]
    fn a_text_becomes_an_intent() {
        let mut dialog = Dialog::Text { field: TextField::new("Note", ""), intent: Intent::Note };
        dialog.paste(" warm tool ");
        assert_eq!(
            dialog.on_key(Key::plain_code(KeyCode::Enter)),
            DialogOutcome::Submitted(Intent::Note("warm tool".to_owned()))
        );
    }
}
