//! Any step as names and values, with the preview beside them.

use crossterm::event::KeyCode;
use ratatui::buffer::Buffer;
use ratatui::layout::Rect;
use ratatui::widgets::Widget as _;
use serde_json::Value;

use super::{Reply, Screen, ScreenCx};
use crate::tui::glyphs::shortened;
use crate::tui::keymap::{Item, Key};
use crate::tui::paint;
use crate::tui::preview::Preview;
use crate::tui::theme::Role;

/// Rows that one key passes over.
const PAGE: usize = 8;
/// Columns that values need before the preview gets any.
const VALUES: u16 = 34;
/// Longest list that is written on one line.
const SHORT_LIST: usize = 8;

/// Names and values, scrolled.
#[derive(Clone, Debug, Default)]
pub(super) struct Plain {
    scroll: usize,
}

impl Screen for Plain {
    fn items(&self, _cx: &ScreenCx<'_>) -> Vec<Item> {
        vec![Item::new("PgUp/PgDn", "scroll", 7)]
    }

    fn on_key(&mut self, key: Key, cx: &ScreenCx<'_>) -> Reply {
        let last = lines(cx).len().saturating_sub(1);
        self.scroll = match key.code {
            KeyCode::PageDown => (self.scroll + PAGE).min(last),
            KeyCode::PageUp => self.scroll.saturating_sub(PAGE),
            KeyCode::Home => 0,
            KeyCode::End => last,
            _ => return Reply::Ignored,
        };
        Reply::Changed
    }

    fn on_paste(&mut self, _text: &str, _cx: &ScreenCx<'_>) -> Reply {
        Reply::Ignored
    }

    fn draw(&self, cx: &ScreenCx<'_>, area: Rect, buf: &mut Buffer) {
        let left = if cx.scene.is_some() { (area.width * 2 / 5).max(VALUES).min(area.width) } else { area.width };
        let values = Rect { width: left, ..area };
        for (row, (depth, name, value)) in (0..values.height).zip(lines(cx).iter().skip(self.scroll)) {
            let style = cx.theme.style(if value.is_empty() { Role::Title } else { Role::Dim });
            let column = paint::text(buf, values, (2 * depth, row), name, style);
            let room = usize::from(values.width.saturating_sub(column + 2));
            let value = shortened(&cx.theme.glyphs.show(value), room, cx.theme.glyphs);
            paint::text(buf, values, (column + 1, row), &value, cx.theme.style(Role::Plain));
        }
        if let Some(scene) = cx.scene {
            let right = Rect { x: area.x + left, width: area.width - left, ..area };
            Preview { scene, camera: cx.camera, theme: cx.theme }.render(right, buf);
        }
    }
}

/// Depth, name and value of everything in the content.
fn lines(cx: &ScreenCx<'_>) -> Vec<(u16, String, String)> {
    let mut lines = Vec::new();
    if let Ok(Value::Object(steps)) = serde_json::to_value(&cx.view.content) {
        for value in steps.values() {
            collect(0, value, &mut lines);
        }
    }
    lines
}

fn collect(depth: u16, value: &Value, lines: &mut Vec<(u16, String, String)>) {
    let named: Vec<(String, &Value)> = match value {
        Value::Object(fields) => fields.iter().map(|(name, value)| (name.replace('_', " "), value)).collect(),
        Value::Array(values) => values.iter().zip(1..).map(|(value, number)| (number.to_string(), value)).collect(),
        _ => return,
    };
    for (name, value) in named {
        match value {
            Value::Null => {}
            Value::Array(values) if values.len() <= SHORT_LIST && values.iter().all(|value| !is_nested(value)) => {
                lines.push((depth, name, values.iter().map(short).collect::<Vec<_>>().join(", ")));
            }
            Value::Object(_) | Value::Array(_) => {
                lines.push((depth, name, String::new()));
                collect(depth + 1, value, lines);
            }
            value => lines.push((depth, name, short(value))),
        }
    }
}

const fn is_nested(value: &Value) -> bool {
    matches!(value, Value::Object(_) | Value::Array(_))
}

/// A value on a part of a line.
fn short(value: &Value) -> String {
    match value {
        Value::String(text) => text.clone(),
        Value::Bool(true) => "yes".to_owned(),
        Value::Bool(false) => "no".to_owned(),
        Value::Number(number) => match number.as_f64().filter(|_| number.is_f64()) {
            Some(value) => format!("{value:.4}"),
            None => number.to_string(),
        },
        value => value.to_string(),
    }
}
