//! Writing text into an area of any size. Nothing is ever written outside it.

use ratatui::buffer::Buffer;
use ratatui::layout::Rect;
use ratatui::style::Style;
use unicode_width::UnicodeWidthChar as _;

/// Writes `text` at column and row `at` of `area`, and returns the column after it.
pub fn text(buf: &mut Buffer, area: Rect, at: (u16, u16), text: &str, style: Style) -> u16 {
    let area = area.intersection(buf.area);
    let (mut column, row) = at;
    if row >= area.height {
        return column;
    }
    for c in text.chars() {
        let wide = u16::try_from(c.width().unwrap_or(0)).unwrap_or(0);
        if wide == 0 {
            continue;
        }
        if column.checked_add(wide).is_none_or(|end| end > area.width) {
            break;
        }
        if let Some(cell) = buf.cell_mut((area.x + column, area.y + row)) {
            cell.set_char(c).set_style(style);
        }
        for more in 1..wide {
            if let Some(cell) = buf.cell_mut((area.x + column + more, area.y + row)) {
                cell.reset();
            }
        }
        column += wide;
    }
    column
}

/// Part of `area`: up to `rows` lines from line `top` on.
pub fn band(area: Rect, top: u16, rows: u16) -> Rect {
    let top = top.min(area.height);
    Rect { x: area.x, y: area.y.saturating_add(top), width: area.width, height: rows.min(area.height - top) }
}

/// `area` without `margin` columns on the left and right.
pub const fn inset(area: Rect, margin: u16) -> Rect {
    let margin = if 2 * margin as u32 > area.width as u32 { 0 } else { margin };
    Rect { x: area.x + margin, y: area.y, width: area.width - 2 * margin, height: area.height }
}

/// Fills a line with a symbol.
pub fn rule(buf: &mut Buffer, area: Rect, row: u16, sign: &str, style: Style) {
    text(buf, area, (0, row), &sign.repeat(usize::from(area.width)), style);
}

/// A buffer as text for snapshots: its characters, then the number of cells of each style.
#[cfg(test)]
pub(crate) fn snapshot(buf: &Buffer) -> String {
    let mut styles = std::collections::BTreeMap::<String, usize>::new();
    let mut lines = Vec::new();
    for y in buf.area.y..buf.area.bottom() {
        let mut line = String::new();
        for x in buf.area.x..buf.area.right() {
            let Some(cell) = buf.cell((x, y)) else { continue };
            line.push_str(cell.symbol());
            if cell.symbol() != " " || cell.modifier.contains(ratatui::style::Modifier::REVERSED) {
                let style = format!("{} {:?}", cell.fg, cell.modifier).replace("Modifier", "");
                *styles.entry(style).or_default() += 1;
            }
        }
        lines.push(line.trim_end().to_owned());
    }
    let styles: Vec<String> = styles.iter().map(|(style, count)| format!("{style} {count}")).collect();
    lines.join("\n") + "\nstyles: " + &styles.join("; ")
}
