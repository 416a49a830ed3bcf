//! All poses with their states, and the detail of the focused one.

use ratatui::buffer::Buffer;
use ratatui::layout::Rect;

use crate::text::{counted, wrapped};
use crate::tui::paint;
use crate::tui::theme::{Role, Theme};
use crate::tui::widget::{Column, Table};
use crate::wizard::view::{CaptureView, RowState, RowView};

/// Columns of the bar for the largest misfit.
const BAR: u16 = 3;
/// Rows of the detail, with the rule above it.
const DETAIL: u16 = 6;
/// Rows of the table that are worth more than the detail.
const FEWEST_ROWS: u16 = 5;

/// The columns. Until there is a result, samples are compared with the nominal arm.
const fn columns(is_nominal: bool) -> [Column<'static>; 8] {
    [
        Column::text("pose", 7),
        Column::text("for", 14),
        Column::text("state", 13),
        Column::number(if is_nominal { "off mm" } else { "fit mm" }, 6),
        Column::text("", BAR),
        Column::number("scatter", 7),
        Column::number("shots", 5),
        Column::text("time", 7),
    ]
}

/// Positions of the rows in the order shown: that of the plan, or the worst fit first.
pub(super) fn order(content: &CaptureView, by_fit: bool) -> Vec<usize> {
    let mut order: Vec<usize> = (0..content.rows.len()).collect();
    if by_fit {
        let fit = |index: &usize| content.rows.get(*index).and_then(fit_mm).unwrap_or(-1.0);
        order.sort_by(|one, other| fit(other).total_cmp(&fit(one)));
    }
    order
}

fn fit_mm(row: &RowView) -> Option<f64> {
    row.measured.as_ref()?.fit_mm
}

/// The cells of a row about its sample.
fn sample_cells(row: &RowView, worst: f64, theme: Theme) -> Vec<String> {
    let Some(measured) = &row.measured else { return Vec::new() };
    let number = |value: Option<f64>| value.map_or_else(String::new, |value| format!("{value:.3}"));
    let part = measured.fit_mm.map_or(0.0, |fit| fit / worst.max(f64::MIN_POSITIVE));
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0 to the columns of the bar")]
    let length = (part * f64::from(BAR)).round().clamp(0.0, f64::from(BAR)) as usize;
    let note = if row.notes.is_empty() { "" } else { " *" };
    vec![
        number(measured.fit_mm),
        theme.glyphs.bar_done().repeat(length),
        number(measured.sample.scatter_mm),
        measured.shots.to_string(),
        format!("{}{note}", measured.time),
    ]
}

/// Draws the list with the focus on row `selected`, and its detail below.
pub(super) fn draw(
    theme: Theme,
    content: &CaptureView,
    (order, selected): (&[usize], usize),
    area: Rect,
    buf: &mut Buffer,
) {
    if content.rows.is_empty() {
        paint::text(buf, area, (0, 1), "The plan has no poses: go back to the plan step.", theme.style(Role::Hint));
        return;
    }
    let worst = content.rows.iter().filter_map(fit_mm).fold(0.0, f64::max);
    let rows: Vec<(Role, Vec<String>)> = order
        .iter()
        .filter_map(|index| content.rows.get(*index))
        .map(|row| {
            let is_shown = Some(row.row) == content.row;
            let is_asked = content.finding.as_ref().is_some_and(|finding| {
                row.measured.as_ref().is_some_and(|measured| measured.sample.measurement == finding.measurement)
            }) && row.state == RowState::Measured;
            let (role, word) = match row.state {
                RowState::Measured if is_asked => (Role::Warn, format!("{} in question", theme.glyphs.doubt())),
                RowState::Measured if is_shown => (Role::Title, format!("{} again", theme.glyphs.next())),
                RowState::Measured => (Role::Ok, "done".to_owned()),
                RowState::Open if is_shown => (Role::Title, format!("{} next", theme.glyphs.next())),
                RowState::Open => (Role::Plain, "open".to_owned()),
                RowState::Skipped => (Role::Dim, "skipped".to_owned()),
                RowState::LeftOut => (Role::Warn, "excluded".to_owned()),
            };
            let cells = [row.pose.clone(), row.kind.name().to_owned(), word];
            (role, cells.into_iter().chain(sample_cells(row, worst, theme)).collect())
        })
        .collect();
    let has_detail = area.height > DETAIL + FEWEST_ROWS;
    let list = if has_detail { paint::band(area, 0, area.height - DETAIL) } else { area };
    let columns = columns(content.fit_is_nominal);
    Table { columns: &columns, rows: &rows, selected: Some(selected), first: 0 }.draw(theme, list, buf);
    if has_detail && let Some(row) = order.get(selected).and_then(|index| content.rows.get(*index)) {
        detail(theme, content, row, paint::band(area, area.height - DETAIL, area.height), buf);
    }
}

/// Everything about one pose.
fn detail(theme: Theme, content: &CaptureView, row: &RowView, area: Rect, buf: &mut Buffer) {
    let glyphs = theme.glyphs;
    let columns = usize::from(area.width);
    let rule = glyphs.rule().repeat(columns);
    paint::text(buf, area, (0, 0), &rule, theme.style(Role::Dim));
    let joints: Vec<String> =
        content.joints.iter().zip(&row.joints).map(|(joint, value)| format!("{} {value:.3}", joint.name)).collect();
    let mut lines = vec![(Role::Title, format!("Pose {}: {}", row.pose, joints.join("  ")))];
    match &row.measured {
        Some(measured) => {
            let [x, y, z] = measured.sample.xyz_mm;
            let to = if content.fit_is_nominal { "from the nominal arm" } else { "from the identified arm" };
            let fit = measured.fit_mm.map_or_else(String::new, |fit| format!(", {fit:.3} mm {to}"));
            let again = match measured.earlier {
                0 => String::new(),
                earlier => format!(", after {} that no longer count", counted(earlier, "measurement")),
            };
            lines.push((
                Role::Plain,
                format!("measurement {}: x {x:.3}  y {y:.3}  z {z:.3} mm{fit}{again}", measured.sample.measurement),
            ));
            lines.extend(measured.findings.iter().map(|finding| (Role::Warn, finding.clone())));
        }
        None => lines.push((Role::Dim, "not measured yet".to_owned())),
    }
    lines.extend(row.notes.iter().map(|note| (Role::Hint, format!("note: {note}"))));
    let shown = lines
        .iter()
        .flat_map(|(role, line)| wrapped(&glyphs.show(line), columns).into_iter().map(|line| (*role, line)));
    for ((role, line), at) in shown.zip(1..area.height) {
        paint::text(buf, area, (0, at), &line, theme.style(role));
    }
}
