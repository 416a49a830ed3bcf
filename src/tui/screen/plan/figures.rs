//! What is proposed or being measured, in numbers.

use ratatui::buffer::Buffer;
use ratatui::layout::Rect;

use crate::session::plan_summary::PlanSummary;
use crate::tui::glyphs::{shortened, wrapped};
use crate::tui::paint;
use crate::tui::theme::{Role, Theme};
use crate::wizard::view::{PlanFigures, PlanView};

/// Columns of the names of the numbers.
const NAMES: usize = 16;
/// Said where there is no plan.
const NO_PLAN: &str = "No plan yet. Enter chooses poses with the settings beside; l takes the poses of a file.";
/// Said while one is made.
const SEARCHING: &str = "Choosing poses. Esc stops; nothing is measured before you accept.";

/// Hours and minutes, as a shift is planned.
pub(super) fn time(minutes: f64) -> String {
    if !minutes.is_finite() || minutes < 100.0 {
        return format!("{minutes:.0} min");
    }
    format!("{:.0} h {:02.0} min", (minutes.round() / 60.0).floor(), minutes.round() % 60.0)
}

/// Draws the proposal, else the plan that is being measured, else what to do.
pub(super) fn draw(theme: Theme, content: &PlanView, is_searching: bool, area: Rect, buf: &mut Buffer) {
    let mut lines = match (&content.proposal, &content.accepted) {
        (Some(figures), _) => {
            let mut lines = vec![(Role::Title, "Proposed, not accepted yet".to_owned())];
            lines.extend(numbers(figures, content.summary.as_deref()));
            lines
        }
        (None, Some(figures)) => {
            let mut lines = vec![(Role::Title, "This plan is being measured".to_owned())];
            lines.extend(numbers(figures, None));
            lines.push(named("measured", &format!("{}, {} left", content.measured, content.left)));
            lines
        }
        (None, None) => {
            let text = if is_searching { SEARCHING } else { NO_PLAN };
            let lines = wrapped(text, usize::from(area.width));
            lines.into_iter().map(|line| (Role::Plain, line)).collect()
        }
    };
    lines.truncate(usize::from(area.height));
    for (row, (role, line)) in (0_u16..).zip(&lines) {
        let line = shortened(&theme.glyphs.show(line), usize::from(area.width), theme.glyphs);
        paint::text(buf, area, (0, row), &line, theme.style(*role));
    }
}

fn named(name: &str, value: &str) -> (Role, String) {
    (Role::Plain, format!("{name:<NAMES$} {value}"))
}

fn numbers(figures: &PlanFigures, summary: Option<&PlanSummary>) -> Vec<(Role, String)> {
    let mut lines = vec![named("poses", &format!("{} + {} to verify", figures.identification, figures.verification))];
    if let Some(condition) = figures.condition_number {
        let random = summary.map_or_else(String::new, |summary| {
            let random = &summary.random.condition_number;
            format!(" (random {:.1})", random.median)
        });
        lines.push(named("condition number", &format!("{condition:.1}{random}")));
    }
    if let Some(sigma) = figures.predicted_error_sigma {
        // σ to mm, where the instrument is known.
        let mm = summary.and_then(|summary| summary.predicted_rms_mm).map(|mm| mm / sigma).filter(|mm| mm.is_finite());
        let (factor, unit) = mm.map_or((1.0, "sigma"), |mm| (mm, "mm"));
        let random = summary.map_or_else(String::new, |summary| {
            let random = &summary.random.predicted_error_sigma;
            format!(" (random {:.4})", random.median * factor)
        });
        lines.push(named("predicted error", &format!("{:.4} {unit}{random}", sigma * factor)));
    }
    if let Some(minutes) = figures.minutes {
        lines.push(named("time", &format!("about {}", time(minutes))));
    }
    if let Some(summary) = summary {
        lines.push(named("D-efficiency", &format!("at least {:.0} % of the best", 100.0 * summary.d_efficiency)));
        let (weak, warnings) = (summary.weak_parameters.len(), summary.warnings.len());
        if weak + warnings > 0 {
            lines.push((Role::Warn, format!("weak parameters {weak}, warnings {warnings}: see Tab")));
        }
    } else {
        lines.push((Role::Dim, figures.origin.clone()));
    }
    lines
}
