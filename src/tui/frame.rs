//! The frame of every screen.
//!
//! ```text
//! trupose · robot                              step 5 of 8: Capture
//! session demo · saved · 12 samples · 34 min · instrument
//! ──────────────────────────────────────────────────────────────────
//! Purpose of this step.
//!
//! content
//!
//! measuring  ███████░░░░░  58 %  shot 3 of 5            (if busy)
//! message with hints                                    (if any)
//! ──────────────────────────────────────────────────────────────────
//! Enter measure   s skip   ? help   q quit
//! ```

use ratatui::buffer::Buffer;
use ratatui::layout::Rect;

use super::glyphs::shortened;
use super::keymap::KeyHint;
use super::paint;
use super::theme::{Role, Theme};
use crate::text::{self, wrapped};
use crate::wizard::view::{BusyView, Header, ViewModel};
use crate::wizard::{Notice, Severity};

/// Smallest usable size of the terminal.
pub const SMALLEST: (u16, u16) = (60, 18);
/// First row of the content.
const TOP: u16 = 5;
/// Largest number of lines of a message.
const MOST_NOTICE: usize = 6;
/// Largest number of lines of the footer.
const MOST_FOOTER: usize = 2;
/// Columns of the progress bar.
const BAR: u16 = 20;
/// Columns between two keys.
const GAP: usize = 3;

/// Whether a screen fits into `area`.
pub const fn fits(area: Rect) -> bool {
    area.width >= SMALLEST.0 && area.height >= SMALLEST.1
}

/// The area of the content, given the keys in the footer; `None` if the terminal is too small.
pub fn content_area(view: &ViewModel, keys: &[KeyHint], theme: Theme, area: Rect) -> Option<Rect> {
    if !fits(area) {
        return None;
    }
    let area = paint::inset(area, 1);
    let footer = footer_lines(keys, usize::from(area.width), MOST_FOOTER).len();
    let notice = view.notice.as_ref().map_or(0, |notice| notice_lines(notice, theme, area).len());
    let below = footer + 1 + notice + usize::from(view.busy.is_some());
    let bottom = area.height.saturating_sub(u16::try_from(below).unwrap_or(u16::MAX));
    Some(paint::band(area, TOP, bottom.saturating_sub(TOP)))
}

/// Draws everything but the content, and returns the area of the content; `None` if the terminal is too small.
pub fn draw(view: &ViewModel, keys: &[KeyHint], theme: Theme, area: Rect, buf: &mut Buffer) -> Option<Rect> {
    let Some(content) = content_area(view, keys, theme, area) else {
        say_too_small(theme, area, buf);
        return None;
    };
    let area = paint::inset(area, 1);
    header(&view.header, theme, area, buf);
    let rule = |buf: &mut Buffer, row: u16| paint::rule(buf, area, row, theme.glyphs.rule(), theme.style(Role::Dim));
    rule(buf, 2);
    let purpose = shortened(view.purpose, usize::from(area.width), theme.glyphs);
    paint::text(buf, area, (0, 3), &purpose, theme.style(Role::Hint));

    footer(keys, theme, area, buf);
    let mut row = TOP + content.height;
    if let Some(busy) = &view.busy {
        busy_line(busy, theme, paint::band(area, row, 1), buf);
        row += 1;
    }
    let notice = view.notice.as_ref().map_or_else(Vec::new, |notice| notice_lines(notice, theme, area));
    for (row, (text, role)) in (row..).zip(&notice) {
        paint::text(buf, area, (0, row), text, theme.style(*role));
    }
    Some(content)
}

/// Draws the required size of the terminal.
pub(super) fn say_too_small(theme: Theme, area: Rect, buf: &mut Buffer) {
    let (columns, rows) = SMALLEST;
    let said = format!("terminal {}x{}, need {columns}x{rows}", area.width, area.height);
    let lines = wrapped(&said, usize::from(area.width));
    for (row, line) in (0..area.height).zip(&lines) {
        paint::text(buf, area, (0, row), line, theme.style(Role::Warn));
    }
}

/// Draws the keys below a rule, and returns the row of the rule.
pub(super) fn footer(keys: &[KeyHint], theme: Theme, area: Rect, buf: &mut Buffer) -> u16 {
    let lines = footer_lines(keys, usize::from(area.width), MOST_FOOTER);
    let top = area.height.saturating_sub(u16::try_from(lines.len()).unwrap_or(0));
    for (row, line) in (top..).zip(&lines) {
        draw_footer_line(line, theme, (area, row), buf);
    }
    let rule = top.saturating_sub(1);
    paint::rule(buf, area, rule, theme.glyphs.rule(), theme.style(Role::Dim));
    rule
}

fn header(header: &Header, theme: Theme, area: Rect, buf: &mut Buffer) {
    let glyphs = theme.glyphs;
    let step = format!("step {} of {}: {}", header.number, header.steps, header.step);
    let room = usize::from(area.width).saturating_sub(text::columns(&step) + 2);
    let robot = header.robot.as_deref().unwrap_or("no robot yet");
    let title = shortened(&glyphs.show(&format!("trupose{}{robot}", glyphs.dot())), room, glyphs);
    paint::text(buf, area, (0, 0), &title, theme.style(Role::Title));
    let column = u16::try_from(usize::from(area.width).saturating_sub(text::columns(&step))).unwrap_or(0);
    paint::text(buf, area, (column, 0), &step, theme.style(Role::Title));

    let mut parts = vec![match &header.session {
        Some(session) => format!("session {session}"),
        None => "not saved yet: no session".to_owned(),
    }];
    if header.session.is_some() {
        parts.push(header.saving().to_owned());
    }
    if header.samples > 0 {
        parts.push(text::counted(header.samples, "sample"));
    }
    if header.elapsed_min >= 1.0 {
        parts.push(format!("{:.0} min", header.elapsed_min));
    }
    // The longest part comes last, because it may be cut off.
    parts.push(header.instrument.clone().unwrap_or_else(|| "no instrument".to_owned()));
    let line = shortened(&glyphs.show(&parts.join(glyphs.dot())), usize::from(area.width), glyphs);
    paint::text(buf, area, (0, 1), &line, theme.style(Role::Dim));
}

/// The lines of a message, starting with its severity in words.
fn notice_lines(notice: &Notice, theme: Theme, area: Rect) -> Vec<(String, Role)> {
    let (lead, role) = match notice.severity {
        Severity::Info => ("", Role::Plain),
        Severity::Attention => ("note: ", Role::Warn),
        Severity::Error => ("not done: ", Role::Warn),
        Severity::Stop => ("STOP: ", Role::Alarm),
    };
    let columns = usize::from(area.width);
    let lines_of = |lead: &str, text: &str, role: Role| {
        let shown: Vec<String> = text.split('\n').map(|line| theme.glyphs.show(line)).collect();
        wrapped(&format!("{lead}{}", shown.join("\n")), columns).into_iter().map(move |line| (line, role)).collect()
    };
    let mut lines: Vec<(String, Role)> = lines_of(lead, &notice.what, role);
    let hints: Vec<(String, Role)> =
        notice.hints.iter().flat_map(|hint| -> Vec<(String, Role)> { lines_of("hint: ", hint, Role::Hint) }).collect();
    // Hints are more useful than the end of a long description.
    let most = MOST_NOTICE.min(usize::from(area.height / 3));
    let kept = hints.len().min(most / 2);
    if lines.len() + kept > most {
        lines.truncate(most.saturating_sub(kept));
        if let Some((last, _)) = lines.last_mut() {
            *last = shortened(&format!("{last} {}", theme.glyphs.ellipsis()), columns, theme.glyphs);
        }
    }
    let room = most.saturating_sub(lines.len());
    lines.extend(hints.into_iter().take(room));
    lines
}

fn busy_line(busy: &BusyView, theme: Theme, area: Rect, buf: &mut Buffer) {
    let glyphs = theme.glyphs;
    let what = if busy.is_cancelled { format!("stopping: {}", busy.what) } else { busy.what.to_owned() };
    let mut column = paint::text(buf, area, (0, 0), &what, theme.style(Role::Title)) + 2;
    if let Some(part) = busy.part.filter(|part| part.is_finite()) {
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0 to 20")]
        let done = (part.clamp(0.0, 1.0) * f64::from(BAR)).round() as u16;
        let bar = glyphs.bar_done().repeat(done.into()) + &glyphs.bar_left().repeat((BAR - done).into());
        column = paint::text(buf, area, (column, 0), &bar, theme.style(Role::Ok));
        column = paint::text(buf, area, (column, 0), &format!(" {:3.0} %  ", 100.0 * part), theme.style(Role::Plain));
    }
    if let Some(progress) = &busy.progress {
        let room = usize::from(area.width.saturating_sub(column));
        let progress = shortened(&glyphs.show(progress), room, glyphs);
        paint::text(buf, area, (column, 0), &progress, theme.style(Role::Dim));
    }
}

/// The footer in at most `most` lines of `columns`. Keys that do not fit are left out, the least important first.
pub fn footer_lines(keys: &[KeyHint], columns: usize, most: usize) -> Vec<Vec<KeyHint>> {
    let mut kept: Vec<KeyHint> = keys.iter().filter(|item| item.is_for_footer()).cloned().collect();
    loop {
        let lines = laid_out(&kept, columns);
        let is_good = lines.len() <= most && lines.iter().all(|line| line_width(line) <= columns);
        let Some(least) = kept.iter().enumerate().max_by_key(|(place, item)| (item.rank, *place)) else {
            return lines;
        };
        if is_good {
            return lines;
        }
        // Keys that are too wide for any line are removed first.
        let too_wide = kept.iter().position(|item| item_width(item) > columns);
        kept.remove(too_wide.unwrap_or(least.0));
    }
}

fn laid_out(items: &[KeyHint], columns: usize) -> Vec<Vec<KeyHint>> {
    let mut lines: Vec<Vec<KeyHint>> = Vec::new();
    for item in items {
        match lines.last_mut() {
            Some(line) if line_width(line) + GAP + item_width(item) <= columns => line.push(item.clone()),
            _ => lines.push(vec![item.clone()]),
        }
    }
    lines
}

fn item_width(item: &KeyHint) -> usize {
    text::columns(&item.key) + 1 + text::columns(&item.label)
}

fn line_width(line: &[KeyHint]) -> usize {
    line.iter().map(item_width).sum::<usize>() + GAP * line.len().saturating_sub(1)
}

fn draw_footer_line(line: &[KeyHint], theme: Theme, (area, row): (Rect, u16), buf: &mut Buffer) {
    let mut column = 0;
    for item in line {
        let is_default = item.rank == 0;
        let key = theme.style(if is_default { Role::Focus } else { Role::Title });
        column = paint::text(buf, area, (column, row), &item.key, key);
        let label = theme.style(if is_default { Role::Title } else { Role::Plain });
        column = paint::text(buf, area, (column + 1, row), &theme.glyphs.show(&item.label), label);
        column += u16::try_from(GAP).unwrap_or(0);
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn text(lines: &[Vec<KeyHint>]) -> Vec<String> {
        let one = |item: &KeyHint| format!("{} {}", item.key, item.label);
        lines.iter().map(|line| line.iter().map(one).collect::<Vec<_>>().join("   ")).collect()
    }

    #[test]
    fn the_footer_wraps_then_drops_the_least_important() {
        let keys = [
            KeyHint::new("Enter", "measure", 0),
            KeyHint::new("?", "help", 2),
            KeyHint::new("q", "quit", 2),
            KeyHint::new("s", "skip this pose", 5),
            KeyHint::new("w", "write a note", 6),
        ];
        assert_eq!(
            text(&footer_lines(&keys, 80, 2)),
            ["Enter measure   ? help   q quit   s skip this pose   w write a note"]
        );
        assert_eq!(
            text(&footer_lines(&keys, 40, 2)),
            ["Enter measure   ? help   q quit", "s skip this pose   w write a note"]
        );
        assert_eq!(text(&footer_lines(&keys, 31, 1)), ["Enter measure   ? help   q quit"]);
        assert_eq!(text(&footer_lines(&keys, 7, 1)), ["? help"]);
        assert!(footer_lines(&keys, 0, 2).is_empty());
    }

    proptest! {
        #[test]
        fn the_footer_is_never_clipped(
            labels in prop::collection::vec(("[a-z]{1,5}", "[a-zµ漢 ]{0,20}", 0_u8..9), 0..20),
            columns in 0_usize..120, most in 0_usize..4,
        ) {
            let keys: Vec<KeyHint> = labels.into_iter().map(|(key, label, rank)| KeyHint::new(key, label, rank)).collect();
            let lines = footer_lines(&keys, columns, most);
            prop_assert!(lines.len() <= most);
            prop_assert!(lines.iter().all(|line| line_width(line) <= columns));
        }
    }
}
