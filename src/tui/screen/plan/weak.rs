//! Weakly determined parameters, and warnings about the plan.

use ratatui::buffer::Buffer;
use ratatui::layout::Rect;

use crate::text::wrapped;
use crate::tui::paint;
use crate::tui::theme::{Role, Theme};
use crate::wizard::view::PlanView;

/// Number of lines to scroll over.
pub(super) fn count(content: &PlanView) -> usize {
    lines(content).len()
}

fn lines(content: &PlanView) -> Vec<(Role, String)> {
    let Some(summary) = &content.summary else {
        return vec![(Role::Hint, "Known once poses have been chosen (Enter or p).".to_owned())];
    };
    let mut lines = Vec::new();
    if !summary.warnings.is_empty() {
        lines.push((Role::Title, "Warnings".to_owned()));
        lines.extend(summary.warnings.iter().map(|warning| (Role::Warn, format!("- {}", warning.message))));
    }
    if summary.weak_parameters.is_empty() {
        lines.push((Role::Ok, "No weak parameters: the poses determine all of them well.".to_owned()));
    } else {
        lines.push((Role::Title, "Weak parameters: hardly better known than before".to_owned()));
        lines.extend(summary.weak_parameters.iter().map(|weak| {
            let (name, unit) = (&weak.name, &weak.unit);
            let text = format!(
                "- {name}: known to {:.3} {unit} afterwards; expected deviation {:.3} {unit}",
                weak.predicted_sigma, weak.expected
            );
            (Role::Plain, text)
        }));
    }
    if !summary.blind_groups.is_empty() {
        lines.push((Role::Title, "Not separable by any poses".to_owned()));
        lines.extend(summary.blind_groups.iter().map(|group| (Role::Plain, format!("- {group}"))));
    }
    let candidates = &summary.candidates;
    let text = format!("Candidates: {} of {} tried can be measured", candidates.kept, candidates.tried);
    lines.push((Role::Title, text));
    lines.extend(candidates.rejections.iter().filter(|rejection| rejection.rejected > 0).map(|rejection| {
        (
            Role::Dim,
            format!("- {}: {} rejected, {} by this rule alone", rejection.rule, rejection.rejected, rejection.alone),
        )
    }));
    lines
}

pub(super) fn draw(theme: Theme, content: &PlanView, scroll: usize, area: Rect, buf: &mut Buffer) {
    let mut row = 0;
    for (role, line) in lines(content).into_iter().skip(scroll) {
        for part in wrapped(&theme.glyphs.show(&line), usize::from(area.width)) {
            if row >= area.height {
                return;
            }
            paint::text(buf, area, (0, row), &part, theme.style(role));
            row += 1;
        }
    }
}
