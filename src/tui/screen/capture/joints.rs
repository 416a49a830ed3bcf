//! The configuration to go to, as large as possible.

use ratatui::buffer::Buffer;
use ratatui::layout::Rect;

use crate::text::{self, decimal};
use crate::tui::glyphs::shortened;
use crate::tui::paint;
use crate::tui::theme::{Role, Theme};
use crate::tui::widget::digits;
use crate::wizard::view::JointShown;

/// Least and largest number of columns of a joint name.
const NAME: (usize, usize) = (4, 10);
/// Columns around a name: pointer before, gap after.
const AROUND_NAME: u16 = 3;
/// Columns of a line with a joint.
const LINE: u16 = 36;

/// Layout of the joints.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Layout {
    is_large: bool,
    columns: u16,
    /// Lines from one joint to the next.
    pitch: u16,
    /// Columns of name and unit.
    label: u16,
    /// Total number of lines.
    pub(super) rows: u16,
}

/// Columns of names and units of `joints`.
fn label(joints: &[JointShown]) -> u16 {
    let widest = joints.iter().map(|joint| text::columns(&joint.name)).max().unwrap_or(0).clamp(NAME.0, NAME.1);
    u16::try_from(widest).unwrap_or(0) + AROUND_NAME
}

/// The largest layout of `joints` that fits into `columns` × `rows`.
pub(super) fn layout(joints: &[JointShown], columns: u16, rows: u16) -> Layout {
    let count = u16::try_from(joints.len()).unwrap_or(u16::MAX);
    let label = label(joints);
    let large = label + joints.iter().map(|joint| digits::columns(&number(joint))).max().unwrap_or(0);
    let of = |is_large, columns: u16, pitch| {
        let lines = count.div_ceil(columns);
        let used = if is_large { lines.saturating_mul(pitch).saturating_sub(pitch - digits::HEIGHT) } else { lines };
        Layout { is_large, columns, pitch, label, rows: used }
    };
    let two = large.saturating_mul(2) <= columns;
    let candidates = [
        (large <= columns, of(true, 1, digits::HEIGHT + 1)),
        (large <= columns, of(true, 1, digits::HEIGHT)),
        (two, of(true, 2, digits::HEIGHT + 1)),
        (two, of(true, 2, digits::HEIGHT)),
        (true, of(false, 1, 1)),
    ];
    let fallback = of(false, (columns / LINE).max(1), 1);
    candidates.into_iter().find(|(fits, layout)| *fits && layout.rows <= rows).map_or(fallback, |(_, layout)| layout)
}

fn number(joint: &JointShown) -> String {
    decimal(joint.value, 3)
}

/// Draws the joints column by column, like a pendant.
pub(super) fn draw(joints: &[JointShown], layout: Layout, theme: Theme, area: Rect, buf: &mut Buffer) {
    let per_column = u16::try_from(joints.len()).unwrap_or(u16::MAX).div_ceil(layout.columns).max(1);
    let columns = if layout.is_large { area.width / layout.columns } else { LINE.min(area.width) };
    for (index, joint) in (0_u16..).zip(joints) {
        let (column, row) = (index / per_column, index % per_column);
        let x = column.saturating_mul(columns).min(area.width);
        let cell =
            paint::band(area, row.saturating_mul(layout.pitch), if layout.is_large { digits::HEIGHT } else { 1 });
        let cell = Rect { x: cell.x + x, width: columns.min(cell.width - x), ..cell };
        if layout.is_large {
            draw_large(joint, layout.label, theme, cell, buf);
        } else {
            draw_line(joint, layout.label, theme, cell, buf);
        }
    }
}

/// Draws the name behind the mark of the joint that moves most, and returns the column of the name.
fn draw_name(joint: &JointShown, label: u16, theme: Theme, cell: Rect, buf: &mut Buffer) -> u16 {
    let glyphs = theme.glyphs;
    let lead = if joint.moves_most { glyphs.pointer() } else { "  " };
    let column = paint::text(buf, cell, (0, 0), lead, theme.style(Role::Hint));
    let name = shortened(&glyphs.show(&joint.name), usize::from(label - AROUND_NAME), glyphs);
    let role = if joint.moves_most { Role::Focus } else { Role::Title };
    paint::text(buf, cell, (column, 0), &name, theme.style(role));
    column
}

fn draw_large(joint: &JointShown, label: u16, theme: Theme, cell: Rect, buf: &mut Buffer) {
    let glyphs = theme.glyphs;
    let column = draw_name(joint, label, theme, cell, buf);
    paint::text(buf, cell, (column, 1), &glyphs.show(&joint.unit), theme.style(Role::Dim));
    if joint.moves_most {
        paint::text(buf, cell, (column, 2), "most", theme.style(Role::Hint));
    }
    let text = number(joint);
    // Right-aligned, so that the decimal points line up, but no farther right than the widest angle needs.
    let right = cell.width.saturating_sub(1).min(label + digits::columns("-360.000").max(digits::columns(&text)));
    let start = right.saturating_sub(digits::columns(&text));
    let place = Rect { x: cell.x + start, width: cell.width - start, ..cell };
    digits::draw(&text, glyphs, theme.style(Role::Title), place, buf);
}

fn draw_line(joint: &JointShown, label: u16, theme: Theme, cell: Rect, buf: &mut Buffer) {
    let glyphs = theme.glyphs;
    draw_name(joint, label, theme, cell, buf);
    let text = number(joint);
    let start = usize::from(label) + 10_usize.saturating_sub(text::columns(&text));
    let column = paint::text(buf, cell, (u16::try_from(start).unwrap_or(0), 0), &text, theme.style(Role::Title));
    let column = paint::text(buf, cell, (column + 1, 0), &glyphs.show(&joint.unit), theme.style(Role::Dim));
    if joint.moves_most {
        paint::text(buf, cell, (column + 1, 0), "moves most", theme.style(Role::Hint));
    }
}
