//! Notes, drift, and refused measurements.

use ratatui::buffer::Buffer;
use ratatui::layout::Rect;

use crate::text::wrapped;
use crate::tui::paint;
use crate::tui::theme::{Role, Theme};
use crate::wizard::view::CaptureView;

/// Number of lines to scroll over.
pub(super) fn count(content: &CaptureView) -> usize {
    lines(content).len()
}

fn lines(content: &CaptureView) -> Vec<(Role, String)> {
    let mut lines = vec![(Role::Title, "Notes (w adds one to the pose shown)".to_owned())];
    lines.extend(content.notes.iter().rev().map(|(pose, text)| {
        let pose = pose.as_ref().map_or_else(|| "no pose".to_owned(), |pose| format!("pose {pose}"));
        (Role::Plain, format!("- {pose}: {text}"))
    }));
    if content.notes.is_empty() {
        lines.push((Role::Dim, "- none".to_owned()));
    }
    lines.push((Role::Title, "Drift: movement of a repeated pose".to_owned()));
    lines.extend(content.drift.iter().rev().map(|drift| {
        let (pose, measurement, moved) = (&drift.pose, drift.measurement, drift.moved_mm);
        (Role::Plain, format!("- pose {pose}, measurement {measurement}: {moved:.3} mm"))
    }));
    if content.drift.is_empty() {
        lines.push((Role::Dim, "- not repeated yet".to_owned()));
    }
    lines.push((Role::Title, "Refused measurements".to_owned()));
    lines.extend(content.refused.iter().rev().map(|(pose, reason)| (Role::Plain, format!("- pose {pose}: {reason}"))));
    if content.refused.is_empty() {
        lines.push((Role::Dim, "- none".to_owned()));
    }
    lines
}

/// Draws the lines, the newest of each kind first.
pub(super) fn draw(theme: Theme, content: &CaptureView, scroll: usize, area: Rect, buf: &mut Buffer) {
    let room = usize::from(area.width);
    let mut row = 0;
    for (role, line) in lines(content).into_iter().skip(scroll) {
        for part in wrapped(&theme.glyphs.show(&line), room) {
            if row >= area.height {
                return;
            }
            paint::text(buf, area, (0, row), &part, theme.style(role));
            row += 1;
        }
    }
}
