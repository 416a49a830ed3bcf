//! Drawing of a replay.

use ratatui::buffer::Buffer;
use ratatui::layout::Rect;
use ratatui::widgets::Widget as _;

use super::{Page, Replay, SPEEDS};
use crate::session::set_up::Step;
use crate::session::state::Sample;
use crate::text::{self, wrapped};
use crate::tui::glyphs::shortened;
use crate::tui::keymap::KeyHint;
use crate::tui::preview::Preview;
use crate::tui::theme::Role;
use crate::tui::{frame, help, paint};
use crate::units::to_mm;

/// Largest number of lines for the entry in words.
const MOST_WORDS: usize = 4;
/// Entries listed before the shown one.
const BEFORE: usize = 3;
/// Least columns of the entries beside the preview.
const ENTRIES: u16 = 36;

impl Replay {
    /// Draws the replay at any size.
    pub fn draw(&self, area: Rect, buf: &mut Buffer) {
        let theme = self.theme;
        if !frame::fits(area) {
            frame::say_too_small(theme, area, buf);
            return;
        }
        let area = paint::inset(area, 1);
        self.header(area, buf);
        paint::rule(buf, area, 2, theme.glyphs.rule(), theme.style(Role::Dim));
        let bottom = frame::footer(&self.key_hints(), theme, area, buf);
        self.timeline(area, buf);
        let mut row = 4;
        for line in wrapped(&self.words(self.place), area.width.into()).iter().take(MOST_WORDS) {
            paint::text(buf, area, (0, row), line, theme.style(Role::Title));
            row += 1;
        }
        let content = paint::band(area, row + 1, bottom.saturating_sub(row + 1));
        if self.has_help {
            help::draw_keys(&self.all_keys(), theme, content, buf);
            return;
        }
        match self.page {
            Page::Robot => self.robot(content, buf),
            Page::Samples | Page::Result => {
                for (row, line) in (0..content.height).zip(self.page_lines().iter().skip(self.scroll)) {
                    let style = theme.style(Role::Plain);
                    let line = shortened(&theme.glyphs.show(line), content.width.into(), theme.glyphs);
                    paint::text(buf, content, (0, row), &line, style);
                }
            }
        }
    }

    fn key_hints(&self) -> Vec<KeyHint> {
        let next = match self.page {
            Page::Robot => "samples",
            Page::Samples => "result",
            Page::Result => "robot",
        };
        let mut items = vec![
            KeyHint::new("Space", if self.is_playing { "pause" } else { "play" }, 0),
            KeyHint::new("Left/Right", "step", 1),
            KeyHint::new("Home/End", "first, last", 3),
            KeyHint::new("+/-", "speed", 4),
            KeyHint::new("Tab", next, 2),
            KeyHint::new("?", "help", 1),
            KeyHint::new("q", "quit", 1),
        ];
        match self.page {
            Page::Robot => items.push(KeyHint::new("< > Up/Down z v", "turn the picture", 6)),
            Page::Samples | Page::Result => items.push(KeyHint::new("PgUp/PgDn", "scroll", 5)),
        }
        items
    }

    /// Every key with what it does, for the help. The arrows step through time here, so the picture turns by others.
    fn all_keys(&self) -> Vec<KeyHint> {
        [
            ("Space", if self.is_playing { "pause" } else { "play, from the start at the end" }),
            ("Left/Right", "one entry of the journal back or on"),
            ("Home/End", "first or last entry"),
            ("+/-", "play faster or slower"),
            ("Tab", "robot, samples, result"),
            ("PgUp/PgDn", "scroll samples and result"),
            ("< >", "turn the picture left or right"),
            ("Up/Down", "look from higher or lower"),
            ("z Z", "zoom in or out"),
            ("v", "view: arm, all, reflector"),
            ("o", "perspective or parallel"),
            ("0", "reset the view"),
            ("q", "quit"),
        ]
        .map(|(key, label)| KeyHint::new(key, label, 0))
        .into()
    }

    fn header(&self, area: Rect, buf: &mut Buffer) {
        let (theme, glyphs) = (self.theme, self.theme.glyphs);
        let place = format!("entry {} of {}", self.place + 1, self.lines.len());
        let robot = self.session.robot.as_ref().map_or("no robot yet", |robot| robot.profile.title());
        let title = glyphs.show(&["replay", &self.session.name, robot].join(glyphs.dot()));
        let room = usize::from(area.width).saturating_sub(text::columns(&place) + 2);
        paint::text(buf, area, (0, 0), &shortened(&title, room, glyphs), theme.style(Role::Title));
        let column = u16::try_from(usize::from(area.width).saturating_sub(text::columns(&place))).unwrap_or(0);
        paint::text(buf, area, (column, 0), &place, theme.style(Role::Title));

        let samples = self.session.counted().count();
        let mut parts = vec![
            self.lines.get(self.place).map_or_else(String::new, |line| format!("{:.0}", line.time)),
            text::counted(samples, "sample"),
        ];
        parts.push(format!("step {} of {}: {}", self.session.step.number(), Step::ALL.len(), self.session.step));
        if self.session.identified.is_some() {
            parts.push(if self.session.is_current() { "identified" } else { "result out of date" }.to_owned());
        }
        let line = shortened(&glyphs.show(&parts.join(glyphs.dot())), area.width.into(), glyphs);
        paint::text(buf, area, (0, 1), &line, theme.style(Role::Dim));
    }

    fn timeline(&self, area: Rect, buf: &mut Buffer) {
        let (theme, glyphs) = (self.theme, self.theme.glyphs);
        let speed = SPEEDS.get(self.speed).copied().unwrap_or(1.0);
        let state = format!("{} {speed}/s", if self.is_playing { "playing" } else { "paused" });
        let columns = usize::from(area.width).saturating_sub(text::columns(&state) + 2);
        // A session with a single entry is complete.
        let done = match self.lines.len().saturating_sub(1) {
            0 => columns,
            last => (columns * self.place).div_ceil(last).min(columns),
        };
        let column = paint::text(buf, area, (0, 3), &glyphs.bar_done().repeat(done), theme.style(Role::Ok));
        let column =
            paint::text(buf, area, (column, 3), &glyphs.bar_left().repeat(columns - done), theme.style(Role::Dim));
        paint::text(buf, area, (column + 2, 3), &state, theme.style(Role::Dim));
    }

    /// An entry with its number, in words.
    fn words(&self, place: usize) -> String {
        self.lines.get(place).map_or_else(String::new, |line| {
            let text = line.entry.describe();
            self.theme.glyphs.show(&format!("{} {}", line.number, text.replace('\n', " ")))
        })
    }

    fn robot(&self, area: Rect, buf: &mut Buffer) {
        let theme = self.theme;
        let scene = self.scene();
        let left = if scene.is_some() { (area.width * 2 / 5).max(ENTRIES).min(area.width) } else { area.width };
        let list = Rect { width: left, ..area };
        let rows = usize::from(area.height);
        let first = self.place.saturating_sub(BEFORE).min(self.lines.len().saturating_sub(rows));
        for (row, place) in (0..area.height).zip(first..self.lines.len()) {
            let style = match place.cmp(&self.place) {
                std::cmp::Ordering::Less => theme.style(Role::Plain),
                std::cmp::Ordering::Equal => theme.style(Role::Focus),
                std::cmp::Ordering::Greater => theme.style(Role::Dim),
            };
            let mark = if place == self.place { ">" } else { " " };
            let room = usize::from(left.saturating_sub(4));
            let line = format!("{mark} {}", shortened(&self.words(place), room, theme.glyphs));
            paint::text(buf, list, (0, row), &line, style);
        }
        if let Some(scene) = &scene {
            let right = Rect { x: area.x + left, width: area.width - left, ..area };
            Preview { scene, camera: &self.camera, theme }.render(right, buf);
        }
    }

    /// Lines of a page of text.
    fn page_lines(&self) -> Vec<String> {
        match self.page {
            Page::Robot => Vec::new(),
            Page::Samples => self.sample_lines(),
            Page::Result => match &self.session.identified {
                None => vec!["Not identified yet.".to_owned()],
                Some(result) => (self.tables)(&result.summary).lines().map(str::to_owned).collect(),
            },
        }
    }

    /// Largest scroll position.
    pub(super) fn last_line(&self) -> usize {
        self.page_lines().len().saturating_sub(1)
    }

    /// The samples so far as a table, latest first.
    fn sample_lines(&self) -> Vec<String> {
        let head = format!(
            "{:>4}  {:<8} {:<14} {:<10} {:>10} {:>10} {:>10}",
            "no.", "pose", "for", "state", "x mm", "y mm", "z mm"
        );
        let lines = self.session.samples.iter().rev().map(|sample| self.sample_line(sample));
        std::iter::once(head).chain(lines).collect()
    }

    fn sample_line(&self, sample: &Sample) -> String {
        let kind = self.session.kind_of(sample);
        let state = sample.state;
        let [x, y, z] = self.session.point_of(sample).coords.map(to_mm).into();
        let pose = self.session.pose_of(sample);
        let number = sample.noted.number;
        format!("{number:>4}  {pose:<8} {kind:<14} {state:<10} {x:>10.3} {y:>10.3} {z:>10.3}")
    }
}
