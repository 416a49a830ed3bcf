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

/// A buffer as text for snapshots: its characters, then its styles, with the words that a colour marks.
#[cfg(test)]
pub(crate) fn snapshot(buf: &Buffer) -> String {
    use ratatui::style::{Color, Modifier};
    let mut styles = std::collections::BTreeMap::<String, Vec<String>>::new();
    let mut lines = Vec::new();
    for y in buf.area.y..buf.area.bottom() {
        let cells: Vec<_> = (buf.area.x..buf.area.right()).filter_map(|x| buf.cell((x, y))).collect();
        let line: String = cells.iter().map(|cell| cell.symbol()).collect();
        lines.push(line.trim_end().to_owned());
        for run in cells.chunk_by(|a, b| (a.fg, a.modifier) == (b.fg, b.modifier)) {
            let (fg, modifier) = (run[0].fg, run[0].modifier);
            let text: String = run.iter().map(|cell| cell.symbol()).collect();
            let text = text.trim().to_owned();
            if text.is_empty() && !modifier.contains(Modifier::REVERSED) {
                continue;
            }
            let marked = styles.entry(format!("{fg} {modifier:?}").replace("Modifier", "")).or_default();
            if fg != Color::Reset && text.contains(char::is_alphabetic) && !marked.contains(&text) {
                marked.push(text);
            }
        }
    }
    for (style, marked) in styles {
        let marked: Vec<String> = marked.iter().map(|text| format!(" '{text}'")).collect();
        lines.push(format!("style {style}:{}", marked.concat()).trim_end_matches(':').to_owned());
    }
    lines.join("\n")
}

/// The lines in which a screen differs from the usual one: `-` gone, `+` new.
#[cfg(test)]
pub(crate) fn differences(usual: &str, shown: &str) -> String {
    let (old, new): (Vec<&str>, Vec<&str>) = (usual.lines().collect(), shown.lines().collect());
    // How many lines the rests of both have in common.
    let mut common = vec![vec![0_usize; new.len() + 1]; old.len() + 1];
    for i in (0..old.len()).rev() {
        for j in (0..new.len()).rev() {
            common[i][j] =
                if old[i] == new[j] { common[i + 1][j + 1] + 1 } else { common[i + 1][j].max(common[i][j + 1]) };
        }
    }
    let (mut i, mut j, mut lines) = (0, 0, Vec::new());
    while i < old.len() || j < new.len() {
        if i < old.len() && j < new.len() && old[i] == new[j] {
            (i, j) = (i + 1, j + 1);
            if lines.last().is_some_and(|line| line != "...") {
                lines.push("...".to_owned());
            }
        } else if j == new.len() || (i < old.len() && common[i + 1][j] >= common[i][j + 1]) {
            lines.push(format!("- {}", old[i]));
            i += 1;
        } else {
            lines.push(format!("+ {}", new[j]));
            j += 1;
        }
    }
    lines.join("\n").trim_end_matches("\n...").to_owned()
}
