//! Screen Profile: a list that typing narrows, and the selected robot.

use crossterm::event::KeyCode;
use ratatui::buffer::Buffer;
use ratatui::layout::Rect;

use super::page::{Page, picture, split};
use super::{PicturePlace, Screen, ScreenCx, ScreenOutcome};
use crate::tui::dialog::{Dialog, completed};
use crate::tui::form::TextField;
use crate::tui::glyphs::shortened;
use crate::tui::keymap::{Key, KeyHint};
use crate::tui::paint;
use crate::tui::theme::Role;
use crate::wizard::Intent;
use crate::wizard::view::{Content, ProfileCard, ProfileView, SessionChoice};

/// Columns of the list.
const LIST: u16 = 26;
/// Columns of the card.
const CARD: u16 = 46;
/// Rows that the picture needs below the card.
const PICTURE_ROWS: u16 = 9;
/// Columns for list, card and picture side by side.
const ALL: u16 = 106;
/// The entry after the bundled profiles.
const FILE: &str = "file...";

/// An entry of the list.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Item<'a> {
    /// A session to continue.
    Session(&'a SessionChoice),
    /// A bundled profile.
    Robot(&'a str),
    File,
}

impl<'a> Item<'a> {
    fn name(self) -> &'a str {
        match self {
            Self::Session(session) => &session.name,
            Self::Robot(name) => name,
            Self::File => FILE,
        }
    }
}

#[derive(Clone, Debug)]
pub(super) struct ProfileScreen {
    /// Position among the entries that match the search; `None` if the operator has not moved it.
    cursor: Option<usize>,
    search: TextField,
    is_typing: bool,
}

impl Default for ProfileScreen {
    fn default() -> Self {
        Self { cursor: None, search: TextField::new("", ""), is_typing: false }
    }
}

const fn content<'a>(cx: &ScreenCx<'a>) -> Option<&'a ProfileView> {
    match &cx.view.content {
        Content::Profile(content) => Some(content),
        _ => None,
    }
}

impl ProfileScreen {
    /// Sessions to continue, unless a robot is being searched; names that contain every typed word; and the entry for a file.
    fn entries<'a>(&self, content: &'a ProfileView) -> Vec<Item<'a>> {
        let wanted = self.search.text().to_lowercase();
        let fits = |name: &&str| wanted.split_whitespace().all(|word| name.to_lowercase().contains(word));
        let sessions = if self.is_typing { &[][..] } else { &content.sessions };
        let robots = content.profiles.iter().map(String::as_str).filter(fits).map(Item::Robot);
        sessions.iter().map(Item::Session).chain(robots).chain([Item::File]).collect()
    }

    /// Position of the cursor.
    fn place(&self, content: &ProfileView) -> usize {
        let entries = self.entries(content);
        let chosen =
            content.chosen.as_ref().and_then(|card| entries.iter().position(|entry| *entry == Item::Robot(&card.name)));
        self.cursor.or(chosen).unwrap_or(0).min(entries.len().saturating_sub(1))
    }

    /// Whether the operator is looking for another robot.
    const fn is_browsing(&self) -> bool {
        self.is_typing || self.cursor.is_some()
    }

    /// Whether Enter loads the focused entry instead of continuing.
    fn loads(&self, content: &ProfileView) -> bool {
        !content.is_fixed && (self.is_browsing() || content.chosen.is_none())
    }

    fn load(&mut self, content: &ProfileView) -> ScreenOutcome {
        let place = self.place(content);
        let entry = self.entries(content).get(place).copied().unwrap_or(Item::File);
        *self = Self::default();
        match entry {
            Item::Session(session) => ScreenOutcome::Intent(Intent::ResumeSession(session.folder.clone())),
            Item::Robot(name) => ScreenOutcome::Intent(Intent::ChooseProfile(name.to_owned())),
            Item::File => file(),
        }
    }

    fn type_key(&mut self, key: Key) -> bool {
        match key.code {
            KeyCode::Esc => *self = Self::default(),
            KeyCode::Char(_) | KeyCode::Backspace | KeyCode::Delete | KeyCode::Left | KeyCode::Right => {
                self.search.on_key(key);
                self.cursor = Some(0);
            }
            _ => return false,
        }
        true
    }
}

/// Asks for the path of a profile.
fn file() -> ScreenOutcome {
    let field = TextField::new("Path of the profile (RON)", "").path(completed);
    ScreenOutcome::Open(Box::new(Dialog::Text { field, intent: Intent::ChooseProfile }))
}

impl Screen for ProfileScreen {
    fn takes_letters(&self) -> bool {
        self.is_typing
    }

    fn key_hints(&self, cx: &ScreenCx<'_>) -> Vec<KeyHint> {
        let Some(content) = content(cx).filter(|content| !content.is_fixed) else { return Vec::new() };
        let mut items = vec![KeyHint::new("Up/Down", "choose", 2)];
        if self.loads(content) {
            let place = self.place(content);
            let label = match self.entries(content).get(place) {
                Some(Item::Session(_)) => "continue this session",
                Some(Item::File) => "profile from a file",
                Some(Item::Robot(_)) | None => "show this robot",
            };
            items.push(KeyHint::new("Enter", label, 0));
        }
        if self.is_typing {
            items.push(KeyHint::new("Esc", "all robots", 1));
        } else {
            items.push(KeyHint::new("c", "search by name", 3));
            items.push(KeyHint::new("f", "profile from a file", 4));
        }
        items
    }

    fn on_key(&mut self, key: Key, cx: &ScreenCx<'_>) -> ScreenOutcome {
        let Some(content) = content(cx) else { return ScreenOutcome::Ignored };
        if content.is_fixed || key.has_modifier() {
            return ScreenOutcome::Ignored;
        }
        let last = self.entries(content).len().saturating_sub(1);
        let place = self.place(content);
        match key.code {
            KeyCode::Up => self.cursor = Some(place.saturating_sub(1)),
            KeyCode::Down => self.cursor = Some((place + 1).min(last)),
            KeyCode::Home => self.cursor = Some(0),
            KeyCode::End => self.cursor = Some(last),
            KeyCode::PageUp => self.cursor = Some(place.saturating_sub(5)),
            KeyCode::PageDown => self.cursor = Some((place + 5).min(last)),
            KeyCode::Enter if self.loads(content) => return self.load(content),
            _ if self.is_typing && self.type_key(key) => {}
            KeyCode::Char('c' | '/') => self.is_typing = true,
            KeyCode::Char('f') => return file(),
            _ => return ScreenOutcome::Ignored,
        }
        ScreenOutcome::Changed
    }

    fn on_paste(&mut self, text: &str, cx: &ScreenCx<'_>) -> ScreenOutcome {
        if content(cx).is_none_or(|content| content.is_fixed) {
            return ScreenOutcome::Ignored;
        }
        self.is_typing = true;
        self.search.paste(text);
        self.cursor = Some(0);
        ScreenOutcome::Changed
    }

    fn picture_place(&self, cx: &ScreenCx<'_>, area: Rect) -> PicturePlace {
        PicturePlace::of(false, content(cx).is_some_and(|content| self.parts(content, cx, area).picture.is_some()))
    }

    fn draw(&self, cx: &ScreenCx<'_>, area: Rect, buf: &mut Buffer) {
        let Some(content) = content(cx) else { return };
        let parts = self.parts(content, cx, area);
        self.draw_list(content, cx, parts.list, buf);
        let Some(card) = &content.chosen else {
            let entries = self.entries(content);
            return match entries.get(self.place(content)) {
                Some(Item::Session(session)) => session_page(session, cx, parts.text, buf),
                _ => introduction(cx, parts.text, buf),
            };
        };
        card_page(card, content, cx, parts.text.width).draw(0, parts.text, buf);
        if let (Some(scene), Some(area)) = (cx.scene, parts.picture) {
            picture(cx, scene, area, buf);
        }
    }
}

/// Areas of the screen.
struct Parts {
    list: Rect,
    text: Rect,
    picture: Option<Rect>,
}

impl ProfileScreen {
    fn parts(&self, content: &ProfileView, cx: &ScreenCx<'_>, area: Rect) -> Parts {
        let (list, right) = match &content.chosen {
            Some(_) if content.is_fixed || !self.is_browsing() && area.width < ALL => (Rect::ZERO, area),
            _ => columns(area),
        };
        let Some(card) = content.chosen.as_ref().filter(|_| cx.scene.is_some()) else {
            return Parts { list, text: right, picture: None };
        };
        let (text, side) = split(right, CARD, true);
        let used = u16::try_from(card_page(card, content, cx, text.width).len()).unwrap_or(u16::MAX).saturating_add(1);
        let has_room = text.height >= used.saturating_add(PICTURE_ROWS);
        let picture = side.or_else(|| has_room.then(|| paint::band(text, used, text.height)));
        Parts { list, text, picture }
    }
}

/// The area of the list, and the rest.
const fn columns(area: Rect) -> (Rect, Rect) {
    let width = if area.width < LIST { area.width } else { LIST };
    let list = Rect { x: area.x, y: area.y, width, height: area.height };
    (list, Rect { x: area.x + width, y: area.y, width: area.width - width, height: area.height })
}

impl ProfileScreen {
    fn draw_list(&self, content: &ProfileView, cx: &ScreenCx<'_>, area: Rect, buf: &mut Buffer) {
        let theme = cx.theme;
        let area = Rect { width: area.width.saturating_sub(2), ..area };
        let column = paint::text(buf, area, (0, 0), "Robot ", theme.style(Role::Title));
        if self.is_typing {
            let field = Rect { x: area.x + column, width: area.width.saturating_sub(column), ..area };
            self.search.draw_line(theme, paint::band(field, 0, 1), buf);
        }
        let list = paint::band(area, 1, area.height);
        let (entries, place) = (self.entries(content), self.place(content));
        let rows = usize::from(list.height);
        let first = place.saturating_sub(rows / 2).min(entries.len().saturating_sub(rows));
        for (row, (index, item)) in (0..list.height).zip(entries.iter().enumerate().skip(first)) {
            let has_focus = index == place;
            let lead = if has_focus { theme.glyphs.pointer() } else { "  " };
            let column = paint::text(buf, list, (0, row), lead, theme.style(Role::Hint));
            let role = match item {
                _ if has_focus => Role::Focus,
                Item::Session(_) => Role::Ok,
                Item::Robot(_) | Item::File => Role::Plain,
            };
            let room = usize::from(list.width.saturating_sub(column));
            let name = shortened(&theme.glyphs.show(item.name()), room, theme.glyphs);
            paint::text(buf, list, (column, row), &name, theme.style(role));
        }
    }
}

/// What is known about a session that can be continued.
fn session_page(session: &SessionChoice, cx: &ScreenCx<'_>, area: Rect, buf: &mut Buffer) {
    let mut page = Page::new(cx.theme, area.width);
    page.paragraph(&format!("Continue {}", session.name), Role::Title);
    page.pair("robot", &session.robot);
    page.pair("progress", &session.progress);
    page.pair("folder", &session.folder);
    page.gap();
    page.paragraph("Enter continues this session. Down leads to the robots for a new one.", Role::Hint);
    page.draw(0, area, buf);
}

fn introduction(cx: &ScreenCx<'_>, area: Rect, buf: &mut Buffer) {
    let mut page = Page::new(cx.theme, area.width);
    page.paragraph(
        "A profile describes how the arm is built, what measures it and which errors are allowed.",
        Role::Plain,
    );
    page.gap();
    page.paragraph("Move to your robot and press Enter to see it. Enter again uses it.", Role::Plain);
    page.gap();
    page.paragraph("Is your robot not in the list? d makes it from the dimensions of its data sheet, f loads a profile from a file. 'trupose profile new' also copies one, or measures the arm.", Role::Dim);
    page.gap();
    page.paragraph(
        "To rehearse without hardware, choose soochow, the arm of the method paper, and then the simulated cell.",
        Role::Dim,
    );
    page.draw(0, area, buf);
}

fn card_page(card: &ProfileCard, content: &ProfileView, cx: &ScreenCx<'_>, columns: u16) -> Page {
    let mut page = Page::new(cx.theme, columns);
    page.paragraph(&card.title, Role::Title);
    for warning in &card.warnings {
        page.marked(("warning: ", Role::Warn), warning, Role::Warn);
    }
    page.pair("session", &content.session);
    page.pair("profile", &card.name);
    page.pair("joints", &format!("{}: {}", card.joints.len(), card.joints.join(" ")));
    page.pair("identified", &format!("{} parameters", card.free_parameters));
    page.pair("instrument", card.instrument.as_deref().unwrap_or("none stated"));
    if let Some([x, y, z]) = card.target_mm {
        page.pair("SMR", &format!("({x:.3}, {y:.3}, {z:.3}) mm in the flange"));
    }
    let [x, y, z] = card.flange_at_zero_mm;
    page.pair("at all zeros", &format!("flange ({x:.1}, {y:.1}, {z:.1}) mm: as on the pendant?"));
    page.pair("source", &card.source);
    if content.is_fixed {
        page.gap();
        page.paragraph("Points have already been measured: this session keeps its robot.", Role::Dim);
    } else {
        page.gap();
        page.paragraph("Enter uses this robot; Up/Down shows the others.", Role::Hint);
    }
    page
}
