//! Pages of text lines with a fixed width, scrolling and tabs.

use crossterm::event::KeyCode;
use ratatui::buffer::Buffer;
use ratatui::layout::Rect;

use crate::text::{self, wrapped};
use crate::tui::glyphs::shortened;
use crate::tui::keymap::{Key, KeyHint};
use crate::tui::paint;
use crate::tui::preview::{Preview, Scene};
use crate::tui::screen::{PicturePlace, ScreenCx};
use crate::tui::theme::{Role, Theme};

/// Rows that PgUp and PgDn scroll.
const PAGE: usize = 8;
/// Rows that stay in view at the end.
const KEPT: usize = 4;
/// Least columns of a useful picture.
const PICTURE: u16 = 26;
/// Columns of the names in [`Page::pair`].
const NAMES: usize = 12;

#[derive(Clone, Debug)]
pub(super) struct Page {
    theme: Theme,
    columns: usize,
    lines: Vec<Vec<(String, Role)>>,
    /// First and last line that stay in view at any scroll position.
    kept: Option<(usize, usize)>,
}

impl Page {
    /// An empty page with this many columns.
    pub(super) const fn new(theme: Theme, columns: u16) -> Self {
        Self { theme, columns: columns as usize, lines: Vec::new(), kept: None }
    }

    /// Keeps the lines from `first` to the last one so far in view.
    pub(super) const fn keep_from(&mut self, first: usize) {
        self.kept = Some((first, self.lines.len().saturating_sub(1)));
    }

    pub(super) const fn len(&self) -> usize {
        self.lines.len()
    }

    /// Columns of a line.
    pub(super) const fn columns(&self) -> usize {
        self.columns
    }

    /// Adds an empty line, unless the page is empty or already ends with one.
    pub(super) fn gap(&mut self) {
        if self.lines.last().is_some_and(|line| !line.is_empty()) {
            self.lines.push(Vec::new());
        }
    }

    /// Adds a line of parts. Text that does not fit is cut off.
    pub(super) fn line(&mut self, parts: Vec<(String, Role)>) {
        let mut room = self.columns;
        let mut line = Vec::new();
        for (text, role) in parts {
            let text = shortened(&self.theme.glyphs.show(&text), room, self.theme.glyphs);
            room -= text::columns(&text).min(room);
            line.push((text, role));
        }
        self.lines.push(line);
    }

    pub(super) fn title(&mut self, text: &str) {
        self.gap();
        self.line(vec![(text.to_owned(), Role::Title)]);
    }

    /// A paragraph behind a mark; further lines are below its text.
    pub(super) fn marked(&mut self, mark: (&str, Role), text: &str, role: Role) {
        let lead = text::columns(mark.0);
        let room = self.columns.saturating_sub(lead).max(1);
        for (index, line) in wrapped(&self.theme.glyphs.show(text), room).into_iter().enumerate() {
            let first = if index == 0 { mark.0.to_owned() } else { " ".repeat(lead) };
            self.lines.push(vec![(first, mark.1), (line, role)]);
        }
    }

    pub(super) fn paragraph(&mut self, text: &str, role: Role) {
        self.marked(("", role), text, role);
    }

    /// Adds a name with its value, wrapped.
    pub(super) fn pair(&mut self, name: &str, value: &str) {
        self.pair_as(name, value, Role::Plain);
    }

    /// Adds a name with its value in a role.
    pub(super) fn pair_as(&mut self, name: &str, value: &str, role: Role) {
        self.marked((&format!("{name:<NAMES$} "), Role::Dim), value, role);
    }

    /// Draws the lines from `first` on. If lines are left below, the last row says so.
    pub(super) fn draw(&self, first: usize, area: Rect, buf: &mut Buffer) {
        let rows = usize::from(area.height);
        let first = if self.len() <= rows { 0 } else { first.min(self.len().saturating_sub(KEPT)) };
        // The last row may be needed to say that there are more lines.
        let whole = rows.saturating_sub(1).max(1);
        let first = match self.kept.filter(|_| self.len() > rows) {
            Some((from, _)) if from < first => from,
            Some((from, to)) if to >= first + whole => from.min((to + 1).saturating_sub(whole)),
            _ => first,
        };
        for (row, line) in (0..area.height).zip(self.lines.iter().skip(first)) {
            let mut column = 0;
            for (text, role) in line {
                column = paint::text(buf, area, (column, row), text, self.theme.style(*role));
            }
        }
        if self.len() > first + rows && rows > 0 {
            let last = area.height - 1;
            paint::text(buf, area, (0, last), &" ".repeat(self.columns), self.theme.style(Role::Plain));
            let said = format!("({} more lines: PgDn)", self.len() + 1 - first - rows);
            paint::text(buf, area, (0, last), &said, self.theme.style(Role::Hint));
        }
    }
}

/// How far a page is scrolled.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Scroll(pub(super) usize);

impl Scroll {
    /// Handles a key on a page of `lines` lines. Returns `false` if it is not a scroll key.
    pub(super) fn on_key(&mut self, key: Key, lines: usize) -> bool {
        let last = lines.saturating_sub(KEPT);
        self.0 = match key.code {
            KeyCode::PageDown => (self.0 + PAGE).min(last),
            KeyCode::PageUp => self.0.min(last).saturating_sub(PAGE),
            KeyCode::Home => 0,
            KeyCode::End => last,
            _ => return false,
        };
        true
    }

    /// Keys for footer and help.
    pub(super) fn key_hint() -> KeyHint {
        KeyHint::new("PgUp/PgDn", "scroll", 6)
    }
}

/// The pages of a screen, as tabs.
#[derive(Clone, Copy, Debug)]
pub(super) struct Tabs {
    titles: &'static [&'static str],
    /// Index of the page that is shown.
    pub(super) at: usize,
}

impl Tabs {
    /// Tabs that show the first page.
    pub(super) const fn new(titles: &'static [&'static str]) -> Self {
        Self { titles, at: 0 }
    }

    /// Handles a key. Returns `false` if it is not a tab key.
    pub(super) fn on_key(&mut self, key: Key) -> bool {
        let count = self.titles.len().max(1);
        self.at = match key.code {
            KeyCode::Tab => (self.at + 1) % count,
            KeyCode::BackTab => (self.at + count - 1) % count,
            KeyCode::Char(c @ '1'..='9') if !key.has_modifier() => match c.to_digit(10) {
                Some(digit) if (digit as usize) <= count => digit as usize - 1,
                _ => return false,
            },
            _ => return false,
        };
        true
    }

    /// Keys for footer and help.
    pub(super) fn key_hint(&self) -> KeyHint {
        KeyHint::new(format!("Tab or 1-{}", self.titles.len()), "next page", 4)
    }

    /// Draws the titles in one line, and returns the remaining area.
    pub(super) fn draw(&self, theme: Theme, area: Rect, buf: &mut Buffer) -> Rect {
        let mut column = 0;
        for (index, title) in self.titles.iter().enumerate() {
            let (text, role) = if index == self.at {
                (format!("[{} {title}]", index + 1), Role::Title)
            } else {
                (format!(" {} {title} ", index + 1), Role::Dim)
            };
            column = paint::text(buf, area, (column, 0), &text, theme.style(role)) + 1;
        }
        paint::band(area, 1, area.height)
    }
}

/// Areas of the text and of the picture.
#[derive(Clone, Copy, Debug)]
pub(super) struct Parts {
    text: Option<Rect>,
    picture: Option<Rect>,
}

impl Parts {
    /// The picture is beside a text of `wanted` columns if there is room for both, else alone if its own tab is shown.
    pub(super) const fn of(cx: &ScreenCx<'_>, area: Rect, wanted: u16, is_picture_tab: bool) -> Self {
        match split(area, wanted, cx.scene.is_some()) {
            (_, None) if is_picture_tab && cx.scene.is_some() => Self { text: None, picture: Some(area) },
            (text, picture) => Self { text: Some(text), picture },
        }
    }

    pub(super) const fn picture_place(self) -> PicturePlace {
        PicturePlace::of(self.text.is_none(), self.picture.is_some())
    }

    /// Draws the page for the columns of the text, scrolled to a line, and the picture.
    pub(super) fn draw(
        self,
        cx: &ScreenCx<'_>,
        buf: &mut Buffer,
        (page, scroll): (impl FnOnce(u16) -> Page, Scroll),
        picture: impl FnOnce(&Scene, Rect, &mut Buffer),
    ) {
        if let Some(text) = self.text {
            page(text.width).draw(scroll.0, text, buf);
        }
        if let (Some(scene), Some(area)) = (cx.scene, self.picture) {
            picture(scene, area, buf);
        }
    }
}

/// Splits `area` into text of `wanted` columns and a picture, if there is room for both.
pub(super) const fn split(area: Rect, wanted: u16, has_picture: bool) -> (Rect, Option<Rect>) {
    let left = wanted + 2;
    if !has_picture || area.width < left.saturating_add(PICTURE) {
        return (area, None);
    }
    let text = Rect { x: area.x, y: area.y, width: wanted, height: area.height };
    (text, Some(Rect { x: area.x + left, y: area.y, width: area.width - left, height: area.height }))
}

pub(super) fn picture(cx: &ScreenCx<'_>, scene: &Scene, area: Rect, buf: &mut Buffer) {
    use ratatui::widgets::Widget as _;
    Preview { scene, camera: cx.camera, theme: cx.theme }.render(area, buf);
}

/// Draws the robot, or says that there is none.
pub(super) fn picture_if_any(cx: &ScreenCx<'_>, area: Rect, buf: &mut Buffer) {
    match cx.scene {
        Some(scene) => picture(cx, scene, area, buf),
        None => {
            paint::text(buf, area, (0, 1), "no robot to show", cx.theme.style(Role::Dim));
        }
    }
}
