//! The error predicted for a calibration from the samples so far.

use ratatui::buffer::Buffer;
use ratatui::layout::Rect;

use crate::text::{counted, counted_as, wrapped};
use crate::tui::paint;
use crate::tui::theme::{Role, Theme};
use crate::tui::widget::Chart;
use crate::wizard::view::{CaptureView, PredictionView};

/// Meaning of the predicted error.
const MEANING: &str = "RMS position error anywhere in the range of the joints, predicted from the noise of instrument and arm and \
    from what lengths, angles and joints of arms deviate by, without their finer curves. Only Verify measures the real error.";

fn error(mm: f64) -> String {
    format!("{mm:.3} mm")
}

/// Whether the rest is worth the time, against the limit if there is one.
fn verdict(prediction: &PredictionView) -> String {
    let Some(limit) = prediction.limit_mm else {
        let said = if prediction.is_enough { "enough (rest gains < 5 %)" } else { "not enough yet" };
        return said.to_owned();
    };
    let limit = format!("limit {limit:.2} mm");
    if prediction.is_enough {
        return format!("{limit}: enough");
    }
    match prediction.with_all_mm {
        Some(all) if Some(all) > prediction.limit_mm => format!("{limit}: this plan does not reach it"),
        _ => format!("{limit}: not enough yet"),
    }
}

/// What the poses that are still open bring.
fn rest(prediction: &PredictionView) -> Option<String> {
    let all = prediction.with_all_mm.filter(|_| prediction.open > 0)?;
    let poses = counted_as(prediction.open, "more pose makes", "more poses make");
    Some(format!("{poses} it {}", error(all)))
}

/// The prediction in a line.
pub(super) fn in_short(prediction: &PredictionView, open: usize) -> String {
    let now = error(prediction.now_mm);
    if open == 0 {
        // Nothing is left of the plan, so there is nothing to say about the rest.
        return format!("predicted error {now} with all poses of the plan");
    }
    let rest = rest(prediction).map_or_else(String::new, |rest| format!("; {rest}"));
    format!("predicted error {now}, {}{rest}", verdict(prediction))
}

/// Draws the curve and its meaning.
pub(super) fn draw(theme: Theme, content: &CaptureView, area: Rect, buf: &mut Buffer) {
    let room = usize::from(area.width);
    let mut lines: Vec<(String, Role)> = Vec::new();
    let Some(prediction) = &content.prediction else {
        lines.push(("No prediction yet: too few poses to determine all parameters.".to_owned(), Role::Title));
        lines.extend(content.too_few.iter().map(|reason| (reason.clone(), Role::Plain)));
        text(theme, &lines, room, area, buf);
        return;
    };
    let now = error(prediction.now_mm);
    lines.push((format!("now, {}: {now}", counted(content.identification, "identification pose")), Role::Title));
    if let Some(mm) = prediction.with_all_mm.filter(|_| content.open > 0) {
        let rest = rest(prediction).unwrap_or_else(|| format!("with all poses of the plan: {}", error(mm)));
        lines.push((rest, Role::Plain));
    }
    let role = if prediction.is_enough { Role::Ok } else { Role::Hint };
    let said =
        if content.open == 0 { "all poses of the plan have been measured".to_owned() } else { verdict(prediction) };
    lines.push((said, role));
    lines.push((MEANING.to_owned(), Role::Dim));
    let used = text(theme, &lines, room, area, buf);

    let points: Vec<(f64, f64)> = prediction.curve_mm.iter().map(|(poses, mm)| (*poses as f64, *mm)).collect();
    let chart = Chart {
        points: &points,
        level: prediction.with_all_mm,
        limit: prediction.limit_mm,
        end: Some((content.identification + prediction.open) as f64),
        mark: points.last().map(|point| point.0),
        y_title: if prediction.limit_mm.is_some() {
            "predicted error (mm); dashed: limit; dotted: with all poses"
        } else {
            "predicted error (mm); dotted: with all poses"
        },
        x_title: "identification poses",
        digits: 3,
    };
    chart.draw(theme, paint::band(area, used + 1, area.height), buf);
}

/// Draws wrapped lines, and returns their number.
fn text(theme: Theme, lines: &[(String, Role)], room: usize, area: Rect, buf: &mut Buffer) -> u16 {
    let mut row = 0;
    for (line, role) in lines {
        for part in wrapped(&theme.glyphs.show(line), room) {
            paint::text(buf, area, (0, row), &part, theme.style(*role));
            row += 1;
        }
    }
    row
}
