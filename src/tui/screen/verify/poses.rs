//! Errors at the verification poses: a histogram of both arms, then pose by pose.

use crate::session::summary::LimitedQuantity;
use crate::text::fixed;
use crate::tui::glyphs::Glyphs;
use crate::tui::preview::Scene;
use crate::tui::screen::page::Page;
use crate::tui::theme::Role;
use crate::units::to_mm;
use crate::wizard::view::VerifyView;

/// Largest number of classes of the histogram: five powers of ten.
const MOST_CLASSES: usize = 15;
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
    let limit = content.verdict.as_ref().and_then(|verdict| {
        verdict.checks.iter().find(|check| check.quantity == LimitedQuantity::PositionMax).map(|check| check.limit_mm)
    });
    histogram(&errors, limit, room, glyphs, page);
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
            (bar, Role::Identified),
            (mark.to_owned(), role),
        ]);
    }
}

/// How often errors of either arm are how large: classes of equal ratio, because the arms differ by so much.
fn histogram(errors: &[(&str, f64, f64)], limit: Option<f64>, room: usize, glyphs: Glyphs, page: &mut Page) {
    page.title(&format!("Errors of both arms, {} poses", errors.len()));
    let all = errors.iter().flat_map(|(_, before, after)| [*before, *after]).filter(|error| *error > 0.0);
    let (low, high) =
        all.fold((f64::INFINITY, 0.0), |(low, high): (f64, f64), error| (low.min(error), high.max(error)));
    let bounds = classes(low, high);
    let within = |pick: fn(&(&str, f64, f64)) -> f64, (from, to): (f64, f64)| {
        errors.iter().map(pick).filter(|error| *error >= from && *error < to).count()
    };
    let side = room / 2;
    let counted: Vec<_> = bounds
        .iter()
        .zip(bounds.iter().skip(1))
        .map(|(from, to)| {
            let class = (*from, *to);
            (class, within(|(_, before, _)| *before, class), within(|(.., after)| *after, class))
        })
        .collect();
    let most = counted.iter().map(|(_, before, after)| *before.max(after)).max().unwrap_or(1).max(1);
    page.line(vec![
        (format!("{:<20}", "mm"), Role::Dim),
        (format!("{:>5} {:<side$} ", "", "before"), Role::Nominal),
        (format!("{:>5} {}", "", "after"), Role::Identified),
    ]);
    let bar = |count: usize| glyphs.bar_done().repeat(part(count as f64 / most as f64, side));
    for ((from, to), before, after) in counted {
        let mark = limit
            .filter(|limit| (from..to).contains(limit))
            .map_or_else(String::new, |limit| format!(" limit {}", fixed(limit, decimals(limit))));
        let range = format!("{} .. {}", fixed(from, decimals(from)), fixed(to, decimals(to)));
        page.line(vec![
            (format!("{range:<20}"), Role::Plain),
            (format!("{before:>5} {:<side$} ", bar(before)), Role::Nominal),
            (format!("{after:>5} {}", bar(after)), Role::Identified),
            (mark, Role::Warn),
        ]);
    }
}

/// Round bounds of classes around errors from `low` to `high`: 1, 2 or 5 times powers of ten.
fn classes(low: f64, high: f64) -> Vec<f64> {
    let mut bounds = Vec::new();
    let mut power = 10_f64.powf(low.log10().floor());
    while bounds.last().is_none_or(|last| *last <= high) && bounds.len() < MOST_CLASSES {
        bounds.extend([1.0, 2.0, 5.0].map(|factor| factor * power));
        power *= 10.0;
    }
    let first = bounds.iter().rposition(|bound| *bound <= low).unwrap_or(0);
    let last = bounds.iter().position(|bound| *bound > high).unwrap_or(bounds.len());
    bounds.into_iter().take(last + 1).skip(first).collect()
}

/// Decimals that a round number needs.
fn decimals(value: f64) -> usize {
    (0..=6_u8).find(|&n| value * 10_f64.powi(i32::from(n)) > 0.999).map_or(6, usize::from)
}

/// Columns for a share of `room`; a positive share gets at least one.
fn part(share: f64, room: usize) -> usize {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a small number of columns")]
    let columns = (share * room as f64).round().clamp(0.0, room as f64) as usize;
    if share > 0.0 { columns.max(1) } else { 0 }
}
