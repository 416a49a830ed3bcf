//! Figures of the proposed or accepted plan.

use ratatui::buffer::Buffer;
use ratatui::layout::Rect;

use crate::session::plan_summary::PlanSummary;
use crate::text::{fixed, wrapped};
use crate::tui::glyphs::shortened;
use crate::tui::paint;
use crate::tui::theme::{Role, Theme};
use crate::wizard::view::{PlanFigures, PlanView, ProgramView};

/// Columns of the names of the numbers.
const NAMES: usize = 16;
/// Columns of the comparison with random sets.
const COMPARED: u16 = 42;
/// Columns of the names in the narrow form.
const SHORT_NAMES: usize = 9;
/// Text if there is no plan.
const NO_PLAN: &str = "No plan yet. Enter chooses poses with these settings; l loads poses from a file.";
/// Text while poses are being chosen.
const SEARCHING: &str = "Choosing poses. Esc cancels; nothing is measured before you accept.";

/// A duration in minutes, or in hours and minutes.
pub(super) fn time(minutes: f64) -> String {
    if !minutes.is_finite() || minutes < 100.0 {
        return format!("{minutes:.0} min");
    }
    format!("{:.0} h {:02.0} min", (minutes.round() / 60.0).floor(), minutes.round() % 60.0)
}

/// Draws the proposal, else the plan being measured, else a hint.
pub(super) fn draw(theme: Theme, content: &PlanView, is_searching: bool, area: Rect, buf: &mut Buffer) {
    let mut lines = match (&content.proposal, &content.accepted) {
        (Some(figures), _) => {
            let is_narrow = area.width < COMPARED;
            let title = if is_narrow { "Proposed" } else { "Proposed, not accepted yet" };
            let mut lines = vec![(Role::Title, title.to_owned())];
            lines.extend(numbers(figures, content.summary.as_deref(), is_narrow));
            lines
        }
        (None, Some(figures)) => {
            let mut lines = vec![(Role::Title, "This plan is being measured".to_owned())];
            lines.extend(numbers(figures, None, area.width < COMPARED));
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

/// Draws the command that makes the robot program of the plan.
pub(super) fn draw_program(theme: Theme, written: Option<&ProgramView>, area: Rect, buf: &mut Buffer) {
    for (row, (role, line)) in (0_u16..area.height).zip(program(written, usize::from(area.width))) {
        paint::text(buf, area, (0, row), &theme.glyphs.show(&line), theme.style(role));
    }
}

/// The robot program of the plan, and what to do about it.
fn program(written: Option<&ProgramView>, room: usize) -> Vec<(Role, String)> {
    let said =
        |role: Role, text: &str| wrapped(text, room).into_iter().map(move |line| (role, line)).collect::<Vec<_>>();
    match written {
        None => said(
            Role::Hint,
            "robot program: f writes it in the language of the controller, with its waits, beside plan.csv in the folder of the session.",
        ),
        Some(ProgramView { text, was_driven: true }) => {
            said(Role::Plain, &format!("robot program: {text}; driven once by hand"))
        }
        Some(ProgramView { text, was_driven: false }) => {
            let mut lines = said(Role::Plain, &format!("robot program: {text}"));
            let driven =
                "It was NOT driven by hand yet: drive it once at reduced speed, watching every move; then press y.";
            lines.extend(said(Role::Warn, driven));
            lines
        }
    }
}

fn named(name: &str, value: &str) -> (Role, String) {
    (Role::Plain, format!("{name:<NAMES$} {value}"))
}

fn numbers(figures: &PlanFigures, summary: Option<&PlanSummary>, is_narrow: bool) -> Vec<(Role, String)> {
    if is_narrow {
        return in_short(figures, summary);
    }
    if let (Some(summary), Some(condition), Some(sigma)) =
        (summary, figures.plan.condition_number, figures.plan.predicted_error_sigma)
    {
        return compared(figures, summary, condition, sigma);
    }
    let mut lines = vec![named("poses", &format!("{} + {} to verify", figures.identification, figures.verification))];
    if let Some(condition) = figures.plan.condition_number {
        lines.push(named("condition number", &format!("{condition:.1}")));
    }
    if let Some(sigma) = figures.plan.predicted_error_sigma {
        lines.push(named("predicted error", &format!("{sigma:.4} sigma")));
    }
    if let Some(minutes) = figures.plan.minutes {
        lines.push(named("time", &format!("about {}", time(minutes))));
    }
    lines.push((Role::Dim, figures.plan.origin.clone()));
    lines
}

/// The figures in the narrow form.
fn in_short(figures: &PlanFigures, summary: Option<&PlanSummary>) -> Vec<(Role, String)> {
    let line = |name: &str, value: &str| (Role::Plain, format!("{name:<SHORT_NAMES$} {value}"));
    let mut lines = vec![line("poses", &format!("{} + {}", figures.identification, figures.verification))];
    lines.extend(figures.plan.condition_number.map(|condition| line("condition", &format!("{condition:.1}"))));
    let mm = summary.and_then(|summary| summary.predicted_rms_mm).map(|mm| format!("{mm:.4} mm"));
    let sigma = figures.plan.predicted_error_sigma.map(|sigma| format!("{sigma:.4} sigma"));
    lines.extend(mm.or(sigma).map(|error| line("error", &error)));
    if let Some(summary) = summary {
        let best = &summary.random;
        lines.push((Role::Dim, format!("best of {} random:", best.sets)));
        let scale = summary.predicted_rms_mm.map_or(1.0, |mm| mm / summary.score.predicted_error);
        let error = best.errors.best * scale;
        lines.push((Role::Dim, format!("{:<SHORT_NAMES$} {:.1}, {error:.4}", "", best.conditions.best)));
    }
    lines.extend(figures.plan.minutes.map(|minutes| line("time", &time(minutes))));
    lines.extend(summary.and_then(largest_gap).map(|gap| line("gap", &gap)));
    lines
}

/// The largest gap between neighbouring values of a joint: in between, its error curve is not measured.
fn largest_gap(summary: &PlanSummary) -> Option<String> {
    let gap = summary.joint_gaps.iter().max_by(|one, other| one.largest_gap.total_cmp(&other.largest_gap))?;
    Some(format!("{} {} of {}", fixed(gap.largest_gap, 1), gap.unit, gap.joint))
}

/// The figures compared with random sets of the same size, the median and the best one.
fn compared(figures: &PlanFigures, summary: &PlanSummary, condition: f64, sigma: f64) -> Vec<(Role, String)> {
    let random = &summary.random;
    // σ to mm, if the instrument is known.
    let mm = summary.predicted_rms_mm.map(|mm| mm / sigma).filter(|mm| mm.is_finite());
    let (factor, unit) = mm.map_or((1.0, "sigma"), |mm| (mm, "mm"));
    let row = |name: &str, [plan, median, best]: [String; 3]| format!("{name:<NAMES$}{plan:>7}{median:>7}{best:>12}");
    let head = ["plan".to_owned(), "random".to_owned(), format!("best of {}", random.sets)];
    let of_condition = [condition, random.conditions.median, random.conditions.best];
    let error = &random.errors;
    let of_error = [sigma, error.median, error.best].map(|sigma| format!("{:.4}", sigma * factor));
    let mut lines = vec![
        named("poses", &format!("{} + {} to verify", figures.identification, figures.verification)),
        (Role::Dim, row("", head)),
        (Role::Plain, row("condition number", of_condition.map(|value| format!("{value:.1}")))),
        (Role::Plain, row(&format!("predicted, {unit}"), of_error)),
    ];
    lines.extend(figures.plan.minutes.map(|minutes| named("time", &format!("about {}", time(minutes)))));
    lines.extend(largest_gap(summary).map(|gap| named("largest gap", &gap)));
    let (weak, warnings) = (summary.weak_parameters.len(), summary.warnings.len());
    if weak + warnings > 0 {
        lines.push((Role::Warn, format!("weak parameters {weak}, warnings {warnings}: press Tab")));
    }
    lines
}
