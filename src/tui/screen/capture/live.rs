//! Live readings: the SMR over the last seconds, and whether it and the robot are where they should be.

use ratatui::buffer::Buffer;
use ratatui::layout::Rect;

use crate::text::wrapped;
use crate::tui::paint;
use crate::tui::screen::ScreenCx;
use crate::tui::theme::Role;
use crate::tui::values;
use crate::tui::widget::Chart;
use crate::wizard::view::{CaptureView, LiveView};

/// Largest number of rows of the chart.
const CHART: u16 = 12;

pub(super) fn draw(cx: &ScreenCx<'_>, content: &CaptureView, area: Rect, buf: &mut Buffer) {
    let theme = cx.theme;
    let Some(live) = &cx.view.live else {
        let text = "This instrument shows nothing between measurements.";
        paint::text(buf, area, (0, 0), text, theme.style(Role::Dim));
        return;
    };
    let room = usize::from(area.width);
    let lines = lines(live, content)
        .into_iter()
        .flat_map(|(text, role)| wrapped(&theme.glyphs.show(&text), room).into_iter().map(move |line| (line, role)));
    let mut row = 0;
    for (text, role) in lines {
        paint::text(buf, area, (0, row), &text, theme.style(role));
        row += 1;
    }
    let points: Vec<(f64, f64)> = live.track.iter().map(|point| (point.seconds, point.offset_mm)).collect();
    let chart = Chart {
        points: &points,
        level: None,
        limit: None,
        end: None,
        mark: None,
        y_title: "distance from where it is now (mm)",
        x_title: "seconds ago",
        digits: 3,
    };
    let below = paint::band(area, row.saturating_add(1), CHART.min(area.height.saturating_sub(row + 1)));
    chart.draw(theme, below, buf);
}

fn lines(live: &LiveView, content: &CaptureView) -> Vec<(String, Role)> {
    if let Some(down) = &live.down {
        // Older readings would be mistaken for current ones.
        return vec![
            (format!("The link is down: {down}"), Role::Warn),
            ("It is reconnected automatically. Nothing is measured meanwhile.".to_owned(), Role::Plain),
        ];
    }
    let mut lines = vec![match live.point_mm {
        Some(_) => (format!("SMR at {}", values::seen(live)), Role::Title),
        None if live.is_blind => ("This instrument shows nothing between measurements.".to_owned(), Role::Dim),
        None if live.silent_s.is_some() => (format!("Seen: {}", values::seen(live)), Role::Warn),
        None => ("No SMR is seen.".to_owned(), Role::Warn),
    }];
    lines.extend(values::live(live).filter(|_| live.point_mm.is_some()).map(|text| (text, Role::Plain)));
    if let (Some((joint, difference)), Some(pose)) = (live.joint_difference, &content.pose) {
        let name = content.joints.get(joint).map_or_else(|| (joint + 1).to_string(), |joint| joint.name.clone());
        let unit = content.joints.get(joint).map_or("deg", |joint| joint.unit.as_str());
        lines.push((format!("robot: joint {name} is {difference:.3} {unit} from pose {pose}"), Role::Plain));
    }
    lines.extend(live.is_still.map(|is_still| {
        if is_still { ("robot: at rest".to_owned(), Role::Ok) } else { ("robot: moving".to_owned(), Role::Warn) }
    }));
    lines
}
