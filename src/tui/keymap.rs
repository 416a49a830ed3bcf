//! The table of keys. Handler, footer and help page are made from it and from the intents that the wizard offers.

use crossterm::event::{KeyCode, KeyEvent, KeyModifiers};

use super::glyphs::Glyphs;
use crate::session::set_up::TargetChoice;
use crate::wizard::{Intent, IntentInfo};

/// A key with its modifiers. Shift is part of a letter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Key {
    pub code: KeyCode,
    pub modifiers: KeyModifiers,
}

impl Key {
    /// A letter or other character, without modifiers.
    pub const fn char(c: char) -> Self {
        Self::plain_code(KeyCode::Char(c))
    }

    pub const fn ctrl(c: char) -> Self {
        Self { code: KeyCode::Char(c), modifiers: KeyModifiers::CONTROL }
    }

    pub const fn plain_code(code: KeyCode) -> Self {
        Self { code, modifiers: KeyModifiers::NONE }
    }

    /// Whether Ctrl or Alt is held.
    pub const fn has_modifier(self) -> bool {
        !self.modifiers.is_empty()
    }

    /// The name in footer and help.
    pub fn name(self, glyphs: Glyphs) -> String {
        let name = match self.code {
            KeyCode::Char(' ') => "Space".to_owned(),
            KeyCode::Char(c) if self.has_modifier() => c.to_uppercase().to_string(),
            KeyCode::Char(c) => c.to_string(),
            KeyCode::Esc => "Esc".to_owned(),
            KeyCode::Enter => "Enter".to_owned(),
            KeyCode::Tab => "Tab".to_owned(),
            KeyCode::F(number) => format!("F{number}"),
            KeyCode::Left | KeyCode::Right | KeyCode::Up | KeyCode::Down if glyphs != Glyphs::Ascii => {
                match self.code {
                    KeyCode::Left => "←".to_owned(),
                    KeyCode::Right => "→".to_owned(),
                    KeyCode::Up => "↑".to_owned(),
                    _ => "↓".to_owned(),
                }
            }
            code => format!("{code:?}"),
        };
        if self.modifiers.contains(KeyModifiers::CONTROL) { format!("Ctrl-{name}") } else { name }
    }
}

impl From<KeyEvent> for Key {
    fn from(event: KeyEvent) -> Self {
        let modifiers = event.modifiers & (KeyModifiers::CONTROL | KeyModifiers::ALT);
        Self { code: event.code, modifiers }
    }
}

/// An action of the terminal, unknown to the wizard.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LocalAction {
    /// Show all keys of this screen.
    Help,
    Suspend,
    /// Redraw the whole screen.
    Redraw,
    /// Turn the bell on or off.
    ToggleBell,
}

/// What a key is bound to.
#[derive(Clone, Copy, Debug)]
enum Target {
    /// The default intent of the wizard.
    Default,
    /// The offered intent that the predicate accepts.
    Offer(fn(&Intent) -> bool),
    /// A local action, with its label.
    Local(LocalAction, &'static str),
}

#[derive(Clone, Copy, Debug)]
struct Binding {
    key: Key,
    target: Target,
    /// Rank in the footer. The largest rank is dropped first when there is no room.
    rank: u8,
}

const fn bind(key: Key, rank: u8, target: Target) -> Binding {
    Binding { key, target, rank }
}

const fn offer(c: char, rank: u8, accepts: fn(&Intent) -> bool) -> Binding {
    bind(Key::char(c), rank, Target::Offer(accepts))
}

/// The key that turns the bell on and off.
pub const BELL: Key = Key::ctrl('b');

/// The table. Of several bindings with the same key, the first one whose intent is possible applies.
const BINDINGS: [Binding; 67] = [
    bind(Key::plain_code(KeyCode::Enter), 0, Target::Default),
    bind(Key::plain_code(KeyCode::Esc), 1, Target::Offer(|intent| matches!(intent, Intent::Cancel))),
    bind(Key::plain_code(KeyCode::Esc), 4, Target::Offer(|intent| matches!(intent, Intent::Dismiss))),
    bind(Key::char('?'), 2, Target::Local(LocalAction::Help, "help")),
    offer('q', 2, |intent| matches!(intent, Intent::Quit)),
    bind(Key::ctrl('c'), 9, Target::Offer(|intent| matches!(intent, Intent::Quit))),
    offer('n', 3, |intent| matches!(intent, Intent::Next)),
    offer('b', 5, |intent| matches!(intent, Intent::Back)),
    offer('r', 3, |intent| matches!(intent, Intent::Retry)),
    offer('c', 3, |intent| matches!(intent, Intent::ChooseProfile(_))),
    offer('e', 6, |intent| matches!(intent, Intent::NameSession(_))),
    offer('d', 4, |intent| matches!(intent, Intent::DescribeRobot(_))),
    offer('c', 3, |intent| matches!(intent, Intent::ChooseInstrument(_))),
    offer('j', 4, |intent| matches!(intent, Intent::DescribeCell(_))),
    offer('t', 6, |intent| matches!(intent, Intent::PlaceTracker(_))),
    offer('t', 6, |intent| matches!(intent, Intent::PlaceTrackerByPoses)),
    offer('g', 6, |intent| matches!(intent, Intent::LimitJoints(_))),
    offer('x', 6, |intent| matches!(intent, Intent::AddBox(_))),
    offer('2', 7, |intent| matches!(intent, Intent::CheckFaces(_))),
    offer('f', 4, |intent| matches!(intent, Intent::WriteProgram(_))),
    offer('y', 3, |intent| matches!(intent, Intent::ProgramDriven)),
    offer('s', 7, |intent| matches!(intent, Intent::FindLinks)),
    offer('p', 3, |intent| matches!(intent, Intent::ChooseTarget(TargetChoice::Profile))),
    offer('f', 4, |intent| matches!(intent, Intent::ChooseTarget(TargetChoice::Free { .. }))),
    offer('k', 4, |intent| matches!(intent, Intent::ChooseTarget(TargetChoice::Known { .. }))),
    offer('y', 6, |intent| matches!(intent, Intent::StatePayload(_))),
    offer('c', 4, |intent| matches!(intent, Intent::StartCircles)),
    offer('w', 5, |intent| matches!(intent, Intent::StartWholeArm)),
    offer('s', 3, |intent| matches!(intent, Intent::SaveArm)),
    offer('u', 3, |intent| matches!(intent, Intent::UseCircles)),
    offer('d', 6, |intent| matches!(intent, Intent::DiscardCircles)),
    offer('x', 3, |intent| matches!(intent, Intent::StartJointCheck)),
    offer('X', 7, |intent| matches!(intent, Intent::DiscardJointCheck)),
    offer('p', 3, |intent| matches!(intent, Intent::MakePlan(_))),
    offer('l', 5, |intent| matches!(intent, Intent::LoadPlan(_))),
    offer('r', 5, |intent| matches!(intent, Intent::PlanFromRecording)),
    offer('a', 3, |intent| matches!(intent, Intent::AcceptPlan)),
    offer('m', 3, |intent| matches!(intent, Intent::Measure)),
    bind(Key::char(' '), 9, Target::Offer(|intent| matches!(intent, Intent::Measure))),
    offer('t', 4, |intent| matches!(intent, Intent::TypeReading(_))),
    offer('a', 3, |intent| matches!(intent, Intent::AcceptReading)),
    offer('k', 3, |intent| matches!(intent, Intent::Keep)),
    offer('x', 3, |intent| matches!(intent, Intent::LeaveOut)),
    offer('r', 3, |intent| matches!(intent, Intent::MeasureAgain)),
    offer('c', 3, |intent| matches!(intent, Intent::ApplyRemedy)),
    offer('l', 6, |intent| matches!(intent, Intent::TurnTracker)),
    offer('s', 5, |intent| matches!(intent, Intent::Skip)),
    offer('h', 4, |intent| matches!(intent, Intent::ThroughHome)),
    offer('u', 5, |intent| matches!(intent, Intent::Undo)),
    offer('U', 5, |intent| matches!(intent, Intent::Redo)),
    bind(Key::ctrl('r'), 9, Target::Offer(|intent| matches!(intent, Intent::Redo))),
    offer('l', 6, |intent| matches!(intent, Intent::ReadPoints(_))),
    offer('t', 2, |intent| matches!(intent, Intent::TakePoints)),
    offer('a', 2, |intent| matches!(intent, Intent::TakeAllPoints)),
    offer('d', 2, |intent| matches!(intent, Intent::DropPoints)),
    bind(Key::plain_code(KeyCode::Esc), 4, Target::Offer(|intent| matches!(intent, Intent::DropPoints))),
    offer('g', 6, |intent| matches!(intent, Intent::GoToPose(_))),
    offer('w', 6, |intent| matches!(intent, Intent::Note(_))),
    offer('e', 7, |intent| matches!(intent, Intent::SuggestPoses(_))),
    offer('i', 3, |intent| matches!(intent, Intent::Identify)),
    offer('d', 3, |intent| matches!(intent, Intent::Deliver)),
    offer('p', 4, |intent| matches!(intent, Intent::CorrectProgram(_))),
    offer('a', 5, |intent| matches!(intent, Intent::About(_))),
    bind(Key::plain_code(KeyCode::F(1)), 9, Target::Local(LocalAction::Help, "help")),
    bind(Key::ctrl('z'), 9, Target::Local(LocalAction::Suspend, "suspend; 'fg' resumes")),
    bind(Key::ctrl('l'), 9, Target::Local(LocalAction::Redraw, "redraw the screen")),
    bind(BELL, 9, Target::Local(LocalAction::ToggleBell, "bell when a reading needs attention, on or off")),
];

/// Largest rank that is shown in the footer.
const FOOTER: u8 = 8;

/// What a key does now.
#[derive(Clone, Debug, PartialEq)]
pub enum Action {
    /// Sends an intent, which may be blocked.
    Offer(Box<IntentInfo>),
    /// Runs a local action.
    Local(LocalAction),
}

/// A key and its effect, for footer and help.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct KeyHint {
    pub key: String,
    /// Effect in a few words.
    pub label: String,
    /// Reason why it is not possible now.
    pub blocked: Option<String>,
    /// Rank in the footer; 0 is the default action.
    pub rank: u8,
}

impl KeyHint {
    /// A key that a screen handles itself.
    pub fn new(key: impl Into<String>, label: impl Into<String>, rank: u8) -> Self {
        Self { key: key.into(), label: label.into(), blocked: None, rank }
    }

    /// Whether the key is shown in the footer.
    pub const fn is_for_footer(&self) -> bool {
        self.blocked.is_none() && self.rank <= FOOTER
    }
}

/// What a key does, given the offers of the wizard.
pub fn action(key: Key, offers: &[IntentInfo]) -> Option<Action> {
    let mut blocked = None;
    for binding in BINDINGS.iter().filter(|binding| binding.key == key) {
        match binding.target {
            Target::Local(local, _) => return Some(Action::Local(local)),
            Target::Default | Target::Offer(_) => {
                for info in offers.iter().filter(|info| accepts(binding.target, info)) {
                    if info.is_enabled() {
                        return Some(Action::Offer(Box::new(info.clone())));
                    }
                    blocked.get_or_insert_with(|| Action::Offer(Box::new(info.clone())));
                }
            }
        }
    }
    blocked.or_else(|| blocked_measurement(key, offers))
}

/// The blocked measurement, if the default key finds no default intent, such as while the link is down: the wizard then says why
/// nothing is measured. It does not apply while a request is running.
fn blocked_measurement(key: Key, offers: &[IntentInfo]) -> Option<Action> {
    let is_default_key = BINDINGS.iter().any(|binding| binding.key == key && matches!(binding.target, Target::Default));
    let is_busy = offers.iter().any(|info| info.intent == Intent::Cancel);
    if !is_default_key || is_busy || offers.iter().any(|info| info.is_default) {
        return None;
    }
    let measure = offers.iter().find(|info| info.intent == Intent::Measure && !info.is_enabled())?;
    Some(Action::Offer(Box::new(measure.clone())))
}

fn accepts(target: Target, info: &IntentInfo) -> bool {
    match target {
        Target::Default => info.is_default,
        Target::Offer(accepts) => accepts(&info.intent),
        Target::Local(..) => false,
    }
}

/// All keys that have an effect, given the offers of the wizard, most important first.
pub fn key_hints(offers: &[IntentInfo], glyphs: Glyphs) -> Vec<KeyHint> {
    let mut items = Vec::new();
    for binding in &BINDINGS {
        let key = binding.key.name(glyphs);
        match binding.target {
            Target::Local(_, label) => {
                items.push(KeyHint { key, label: label.to_owned(), blocked: None, rank: binding.rank });
            }
            Target::Default | Target::Offer(_) => {
                for info in offers.iter().filter(|info| accepts(binding.target, info)) {
                    let is_chosen = match action(binding.key, offers) {
                        Some(Action::Offer(chosen)) => *chosen == *info,
                        _ => false,
                    };
                    if is_chosen || !info.is_enabled() {
                        // The default action is already in the footer under the default key.
                        let rank = if info.is_default && binding.rank > 0 { FOOTER + 1 } else { binding.rank };
                        let (label, blocked) = (info.label.clone(), info.blocked.clone());
                        items.push(KeyHint { key: key.clone(), label, blocked, rank });
                    }
                }
            }
        }
    }
    items.sort_by_key(|item| item.rank);
    items
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wizard::PlanSettings;

    #[test]
    fn enter_is_answered_where_measuring_is_next_and_cannot_be_done() {
        let down = IntentInfo::new(Intent::Measure, "measure").unless(Some("the link is down".to_owned()));
        let enter = Key::plain_code(KeyCode::Enter);
        let meant = |offers: &[IntentInfo]| match action(enter, offers) {
            Some(Action::Offer(info)) => Some(info.intent),
            _ => None,
        };
        assert_eq!(meant(std::slice::from_ref(&down)), Some(Intent::Measure));
        let next = IntentInfo::new(Intent::Next, "go on").default_action();
        assert_eq!(meant(&[down.clone(), next]), Some(Intent::Next));
        let cancel = IntentInfo::new(Intent::Cancel, "cancel measuring");
        assert_eq!(meant(&[down, cancel]), None);
    }

    #[test]
    fn the_first_possible_intent_of_a_key_is_meant() {
        let offers = [
            IntentInfo::new(Intent::Cancel, "cancel planning").unless(Some("already being cancelled".to_owned())),
            IntentInfo::new(Intent::Dismiss, "dismiss the message"),
        ];
        let meant = action(Key::plain_code(KeyCode::Esc), &offers);
        assert_eq!(meant, Some(Action::Offer(Box::new(offers[1].clone()))));
        assert_eq!(action(Key::char('z'), &offers), None);
        assert_eq!(action(Key::char('?'), &offers), Some(Action::Local(LocalAction::Help)));
    }

    #[test]
    fn footer_and_handler_agree() {
        let offers = [
            IntentInfo::new(Intent::AcceptPlan, "measure this plan").default_action(),
            IntentInfo::new(Intent::MakePlan(PlanSettings::default()), "choose poses"),
            IntentInfo::new(Intent::Next, "go on").unless(Some("no plan".to_owned())),
            IntentInfo::new(Intent::Quit, "quit"),
        ];
        let shown = key_hints(&offers, Glyphs::Unicode);
        let text: Vec<String> = shown.iter().map(|item| format!("{} {}", item.key, item.label)).collect();
        assert_eq!(text[0], "Enter measure this plan");
        assert!(text.contains(&"a measure this plan".to_owned()) && text.contains(&"p choose poses".to_owned()));
        let footer: Vec<&KeyHint> = shown.iter().filter(|item| item.is_for_footer()).collect();
        assert_eq!(footer.iter().map(|item| item.key.as_str()).collect::<Vec<_>>(), ["Enter", "?", "q", "p"]);
        assert!(shown.iter().any(|item| item.blocked.as_deref() == Some("no plan")));
    }

    #[test]
    fn names_of_keys() {
        let names = [Key::ctrl('z'), Key::char(' '), Key::plain_code(KeyCode::Left), Key::plain_code(KeyCode::F(1))];
        assert_eq!(names.map(|key| key.name(Glyphs::Unicode)), ["Ctrl-Z", "Space", "←", "F1"]);
        assert_eq!(Key::plain_code(KeyCode::Left).name(Glyphs::Ascii), "Left");
    }
}
