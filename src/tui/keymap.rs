//! One table from keys to what they do. Handler, footer and help page are all made from it and from what the wizard offers.

use crossterm::event::{KeyCode, KeyEvent, KeyModifiers};

use super::glyphs::Glyphs;
use crate::session::set_up::TargetChoice;
use crate::wizard::{Intent, IntentInfo};

/// A key with its modifiers; Shift is part of a letter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Key {
    /// Which key.
    pub code: KeyCode,
    /// What was held.
    pub modifiers: KeyModifiers,
}

impl Key {
    /// A letter or sign.
    pub const fn char(c: char) -> Self {
        Self::plain_code(KeyCode::Char(c))
    }

    /// A key with Ctrl.
    pub const fn ctrl(c: char) -> Self {
        Self { code: KeyCode::Char(c), modifiers: KeyModifiers::CONTROL }
    }

    /// A key without modifiers.
    pub const fn plain_code(code: KeyCode) -> Self {
        Self { code, modifiers: KeyModifiers::NONE }
    }

    /// Whether Ctrl, Alt or the like is held.
    pub const fn has_modifier(self) -> bool {
        !self.modifiers.is_empty()
    }

    /// As it is written in footer and help.
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

/// What happens in the terminal only.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Local {
    /// All keys of this screen.
    Help,
    /// Back to the shell for a while.
    Suspend,
    /// Draw everything anew.
    Redraw,
    /// Bell on or off.
    Bell,
}

/// What a key does.
#[derive(Clone, Copy, Debug)]
enum Does {
    /// The sensible next thing, as the wizard says.
    Default,
    /// The intent that this accepts, if the wizard offers one.
    Offer(fn(&Intent) -> bool),
    /// Something local.
    Local(Local, &'static str),
}

#[derive(Clone, Copy, Debug)]
struct Binding {
    key: Key,
    does: Does,
    /// Importance in the footer; the largest goes first when there is no room.
    rank: u8,
}

const fn bind(key: Key, rank: u8, does: Does) -> Binding {
    Binding { key, does, rank }
}

const fn offer(c: char, rank: u8, accepts: fn(&Intent) -> bool) -> Binding {
    bind(Key::char(c), rank, Does::Offer(accepts))
}

/// Turns the bell on and off.
pub const BELL: Key = Key::ctrl('b');

/// The table. Of several with one key the first whose intent is possible is meant.
const BINDINGS: [Binding; 42] = [
    bind(Key::plain_code(KeyCode::Enter), 0, Does::Default),
    bind(Key::plain_code(KeyCode::Esc), 1, Does::Offer(|intent| matches!(intent, Intent::Cancel))),
    bind(Key::plain_code(KeyCode::Esc), 4, Does::Offer(|intent| matches!(intent, Intent::Dismiss))),
    bind(Key::char('?'), 2, Does::Local(Local::Help, "help")),
    offer('q', 2, |intent| matches!(intent, Intent::Quit)),
    bind(Key::ctrl('c'), 9, Does::Offer(|intent| matches!(intent, Intent::Quit))),
    offer('n', 3, |intent| matches!(intent, Intent::Next)),
    offer('b', 5, |intent| matches!(intent, Intent::Back)),
    offer('r', 3, |intent| matches!(intent, Intent::Retry)),
    offer('c', 3, |intent| matches!(intent, Intent::ChooseProfile(_))),
    offer('e', 6, |intent| matches!(intent, Intent::NameSession(_))),
    offer('c', 3, |intent| matches!(intent, Intent::ChooseInstrument(_))),
    offer('p', 3, |intent| matches!(intent, Intent::ChooseTarget(TargetChoice::Profile))),
    offer('f', 4, |intent| matches!(intent, Intent::ChooseTarget(TargetChoice::Free { .. }))),
    offer('k', 4, |intent| matches!(intent, Intent::ChooseTarget(TargetChoice::Known { .. }))),
    offer('c', 4, |intent| matches!(intent, Intent::StartCircles)),
    offer('u', 3, |intent| matches!(intent, Intent::UseCircles)),
    offer('d', 6, |intent| matches!(intent, Intent::DiscardCircles)),
    offer('p', 3, |intent| matches!(intent, Intent::MakePlan(_))),
    offer('l', 5, |intent| matches!(intent, Intent::LoadPlan(_))),
    offer('r', 5, |intent| matches!(intent, Intent::PlanFromRecording)),
    offer('a', 3, |intent| matches!(intent, Intent::AcceptPlan)),
    offer('m', 3, |intent| matches!(intent, Intent::Measure)),
    bind(Key::char(' '), 9, Does::Offer(|intent| matches!(intent, Intent::Measure))),
    offer('t', 4, |intent| matches!(intent, Intent::TypeReading(_))),
    offer('a', 3, |intent| matches!(intent, Intent::AcceptReading)),
    offer('k', 3, |intent| matches!(intent, Intent::Keep)),
    offer('x', 3, |intent| matches!(intent, Intent::LeaveOut)),
    offer('r', 3, |intent| matches!(intent, Intent::MeasureAgain)),
    offer('c', 3, |intent| matches!(intent, Intent::ApplyRemedy)),
    offer('s', 5, |intent| matches!(intent, Intent::Skip)),
    offer('u', 5, |intent| matches!(intent, Intent::Undo)),
    offer('g', 6, |intent| matches!(intent, Intent::GoToPose(_))),
    offer('w', 6, |intent| matches!(intent, Intent::Note(_))),
    offer('e', 7, |intent| matches!(intent, Intent::SuggestPoses(_))),
    offer('i', 3, |intent| matches!(intent, Intent::Identify)),
    offer('d', 3, |intent| matches!(intent, Intent::Deliver)),
    offer('a', 5, |intent| matches!(intent, Intent::About(_))),
    bind(Key::plain_code(KeyCode::F(1)), 9, Does::Local(Local::Help, "help")),
    bind(Key::ctrl('z'), 9, Does::Local(Local::Suspend, "to the shell, back with 'fg'")),
    bind(Key::ctrl('l'), 9, Does::Local(Local::Redraw, "draw the screen anew")),
    bind(BELL, 9, Does::Local(Local::Bell, "bell when a reading needs attention, on or off")),
];

/// Least importance that is still worth a place in the footer.
const FOOTER: u8 = 8;

/// What a key means now.
#[derive(Clone, Debug, PartialEq)]
pub enum Meaning {
    /// An intent, possible or not.
    Offer(Box<IntentInfo>),
    /// Something local.
    Local(Local),
}

/// A key with what it does, for footer and help.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Item {
    /// Name of the key.
    pub key: String,
    /// What it does.
    pub label: String,
    /// Why not now.
    pub blocked: Option<String>,
    /// Importance; 0 is the default action.
    pub rank: u8,
}

impl Item {
    /// A key of a screen of its own.
    pub fn new(key: impl Into<String>, label: impl Into<String>, rank: u8) -> Self {
        Self { key: key.into(), label: label.into(), blocked: None, rank }
    }

    /// Whether it belongs into the footer.
    pub const fn is_for_footer(&self) -> bool {
        self.blocked.is_none() && self.rank <= FOOTER
    }
}

/// What a key means where `offers` can be done.
pub fn meaning(key: Key, offers: &[IntentInfo]) -> Option<Meaning> {
    let mut blocked = None;
    for binding in BINDINGS.iter().filter(|binding| binding.key == key) {
        match binding.does {
            Does::Local(local, _) => return Some(Meaning::Local(local)),
            Does::Default | Does::Offer(_) => {
                for info in offers.iter().filter(|info| accepts(binding.does, info)) {
                    if info.is_enabled() {
                        return Some(Meaning::Offer(Box::new(info.clone())));
                    }
                    blocked.get_or_insert_with(|| Meaning::Offer(Box::new(info.clone())));
                }
            }
        }
    }
    blocked.or_else(|| unmeasured(key, offers))
}

/// Where measuring would be the next thing and cannot be done now, such as while the link is down: the wizard says why. While
/// something is under way a key waits for nothing.
fn unmeasured(key: Key, offers: &[IntentInfo]) -> Option<Meaning> {
    let is_next = BINDINGS.iter().any(|binding| binding.key == key && matches!(binding.does, Does::Default))
        && !offers.iter().any(|info| info.is_default || info.intent == Intent::Cancel);
    let is_blocked = |info: &&IntentInfo| matches!(info.intent, Intent::Measure) && !info.is_enabled();
    offers.iter().filter(|_| is_next).find(is_blocked).map(|info| Meaning::Offer(Box::new(info.clone())))
}

fn accepts(does: Does, info: &IntentInfo) -> bool {
    match does {
        Does::Default => info.is_default,
        Does::Offer(accepts) => accepts(&info.intent),
        Does::Local(..) => false,
    }
}

/// All keys that mean something where `offers` can be done, most important first.
pub fn items(offers: &[IntentInfo], glyphs: Glyphs) -> Vec<Item> {
    let mut items = Vec::new();
    for binding in &BINDINGS {
        let key = binding.key.name(glyphs);
        match binding.does {
            Does::Local(_, label) => {
                items.push(Item { key, label: label.to_owned(), blocked: None, rank: binding.rank });
            }
            Does::Default | Does::Offer(_) => {
                for info in offers.iter().filter(|info| accepts(binding.does, info)) {
                    let is_meant = match meaning(binding.key, offers) {
                        Some(Meaning::Offer(meant)) => *meant == *info,
                        _ => false,
                    };
                    if is_meant || !info.is_enabled() {
                        // Under its own key the default would stand twice in the footer.
                        let rank = if info.is_default && binding.rank > 0 { FOOTER + 1 } else { binding.rank };
                        let (label, blocked) = (info.label.clone(), info.blocked.clone());
                        items.push(Item { key: key.clone(), label, blocked, rank });
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
        let meant = |offers: &[IntentInfo]| match meaning(enter, offers) {
            Some(Meaning::Offer(info)) => Some(info.intent),
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
            IntentInfo::new(Intent::Cancel, "cancel planning").unless(Some("it is being cancelled".to_owned())),
            IntentInfo::new(Intent::Dismiss, "dismiss the message"),
        ];
        let meant = meaning(Key::plain_code(KeyCode::Esc), &offers);
        assert_eq!(meant, Some(Meaning::Offer(Box::new(offers[1].clone()))));
        assert_eq!(meaning(Key::char('z'), &offers), None);
        assert_eq!(meaning(Key::char('?'), &offers), Some(Meaning::Local(Local::Help)));
    }

    #[test]
    fn footer_and_handler_agree() {
        let offers = [
            IntentInfo::new(Intent::AcceptPlan, "measure this plan").default_action(),
            IntentInfo::new(Intent::MakePlan(PlanSettings::default()), "choose poses"),
            IntentInfo::new(Intent::Next, "go on").unless(Some("no plan".to_owned())),
            IntentInfo::new(Intent::Quit, "quit"),
        ];
        let shown = items(&offers, Glyphs::Unicode);
        let text: Vec<String> = shown.iter().map(|item| format!("{} {}", item.key, item.label)).collect();
        assert_eq!(text[0], "Enter measure this plan");
        assert!(text.contains(&"a measure this plan".to_owned()) && text.contains(&"p choose poses".to_owned()));
        let footer: Vec<&Item> = shown.iter().filter(|item| item.is_for_footer()).collect();
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
