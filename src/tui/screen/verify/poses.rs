//! Errors of the identified arm at the verification poses: a histogram, then pose by pose.

use crate::session::summary::LimitedQuantity;
use crate::text::fixed;
use crate::tui::glyphs::Glyphs;
use crate::tui::preview::Scene;
use crate::tui::screen::page::Page;
use crate::tui::theme::Role;
use crate::units::to_mm;
use crate::wizard::view::VerifyView;

/// Largest number of classes of the histogram.
const CLASSES: f64 = 6.0;
/// Columns beside the bars.
const LABELS: usize = 30;

/// Writes the histogram and the bars.
pub(super) fn poses(content: &VerifyView, scene: Option<&Scene>, glyphs: Glyphs, page: &mut Page) {
    let mut errors: Vec<(&str, f64, f64)> = scene
        .map_or(&[][..], |scene| &scene.verified)
        .iter()
        .map(|one| (one.pose.as_str(), to_mm(one.nominal.norm()), to_mm(one.identified.norm())))
        .collect();
    let largest = errors.iter().map(|(.., after)| *after).fold(0.0, f64::max);
    if errors.is_empty() || !(largest > 0.0 && largest.is_finite()) {
        page.paragraph("There are no verification samples to show.", Role::Plain);
        return;
    }
    let room = page.columns().saturating_sub(LABELS).min(48);
    histogram(&errors, largest, room, glyphs, page);
    let limit = content.verdict.as_ref().and_then(|verdict| {
        verdict.checks.iter().find(|check| check.quantity == LimitedQuantity::PositionMax).map(|check| check.limit_mm)
    });
    let above = limit.map_or_else(String::new, |limit| format!("; allowed: {} mm", fixed(limit, 3)));
    page.title(&format!("Error at each verification pose, largest first{above}"));
    page.line(vec![(format!("{:<8}{:>10}{:>10}", "pose", "before mm", "after mm"), Role::Dim)]);
    errors.sort_by(|(.., one), (.., other)| other.total_cmp(one));
    for (pose, before, after) in errors {
        let is_above = limit.is_some_and(|limit| after > limit);
        let bar = glyphs.bar_done().repeat(part(after / largest, room));
        let (mark, role) = if is_above { (" TOO LARGE", Role::Warn) } else { ("", Role::Plain) };
        page.line(vec![
            (format!("{pose:<8}{:>10}{:>10} ", fixed(before, 4), fixed(after, 4)), Role::Plain),
            (bar, Role::Hint),
            (mark.to_owned(), role),
        ]);
    }
}

fn histogram(errors: &[(&str, f64, f64)], largest: f64, room: usize, glyphs: Glyphs, page: &mut Page) {
    page.title(&format!("Errors of the identified arm, {} poses", errors.len()));
    let step = round_step(largest / CLASSES);
    let decimals = (1..=6_u8).find(|&n| step * 10_f64.powi(i32::from(n)) > 0.999).map_or(6, usize::from);
    let within = |low: f64| errors.iter().filter(|(.., error)| *error >= low && *error < low + step).count();
    let classes: Vec<(f64, usize)> = (0..=8_u8)
        .map(|class| f64::from(class) * step)
        .take_while(|low| *low <= largest)
        .map(|low| (low, within(low)))
        .collect();
    let most = classes.iter().map(|(_, count)| *count).max().unwrap_or(1).max(1);
    for (low, count) in classes {
        let range = format!("{} .. {} mm", fixed(low, decimals), fixed(low + step, decimals));
        let bar = glyphs.bar_done().repeat(part(count as f64 / most as f64, room));
        page.line(vec![(format!("{range:<22}{count:>6} "), Role::Plain), (bar, Role::Hint)]);
    }
}

/// Columns for a share of `room`; a positive share gets at least one.
fn part(share: f64, room: usize) -> usize {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a small number of columns")]
    let columns = (share * room as f64).round().clamp(0.0, room as f64) as usize;
    if share > 0.0 { columns.max(1) } else { 0 }
}

/// The smallest 1, 2 or 5 times a power of ten that is not below `step`.
fn round_step(step: f64) -> f64 {
    let power = 10_f64.powf(step.log10().floor());
    [1.0, 2.0, 5.0].into_iter().map(|factor| factor * power).find(|round| *round >= step).unwrap_or(10.0 * power)
}
