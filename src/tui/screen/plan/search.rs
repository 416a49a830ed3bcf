//! The running search for poses.

use ratatui::buffer::Buffer;
use ratatui::layout::Rect;

use crate::tui::paint;
use crate::tui::theme::{Role, Theme};
use crate::tui::widget::Chart;
use crate::wizard::view::BusyView;

/// Largest number of values kept. More would not be visible.
const MOST: usize = 2000;

/// Results of the search so far.
#[derive(Clone, Debug, Default)]
pub(super) struct Search {
    is_running: bool,
    conditions: Vec<(f64, f64)>,
    /// Smallest predicted error seen, per σ.
    best_error: Option<f64>,
}

impl Search {
    /// Observes the running request.
    pub(super) fn see(&mut self, busy: Option<&BusyView>) {
        let Some(busy) = busy else {
            self.is_running = false;
            return;
        };
        if !self.is_running {
            *self = Self { is_running: true, ..Self::default() };
        }
        let Some(found) = busy.figures.filter(|found| found.condition_number.is_finite()) else { return };
        let condition = found.condition_number;
        if found.predicted_error.is_finite() {
            self.best_error =
                Some(self.best_error.map_or(found.predicted_error, |best| best.min(found.predicted_error)));
        }
        if self.conditions.last().is_none_or(|last| last.1.to_bits() != condition.to_bits())
            && self.conditions.len() < MOST
        {
            let number = self.conditions.len() + 1;
            self.conditions.push((number as f64, condition));
        }
    }

    /// Whether a request is running.
    pub(super) const fn is_running(&self) -> bool {
        self.is_running
    }

    /// Draws the condition number over the search.
    pub(super) fn draw(&self, theme: Theme, area: Rect, buf: &mut Buffer) {
        let best = self.conditions.iter().map(|point| point.1).min_by(f64::total_cmp);
        let text = match (best, self.best_error) {
            (Some(best), Some(error)) => {
                format!("best so far: condition number {best:.1}, predicted error {error:.3} sigma")
            }
            (Some(best), None) => format!("best so far: condition number {best:.1}"),
            (None, _) => "looking for configurations that can be reached and seen".to_owned(),
        };
        paint::text(buf, area, (0, 0), &text, theme.style(Role::Title));
        let chart = Chart {
            points: &self.conditions,
            level: None,
            limit: None,
            end: None,
            mark: self.conditions.last().map(|point| point.0),
            y_title: "condition number (smaller is better)",
            x_title: "pose sets examined",
            digits: 1,
        };
        if self.conditions.len() > 1 {
            chart.draw(theme, paint::band(area, 1, area.height), buf);
        }
    }
}
