//! The charts of a result and of a search.

use rerun::Image;

use super::document::significant;
use super::result::Judged;
use crate::planning::Figures;
use crate::profile::Acceptance;
use crate::recording::canvas::Canvas;
use crate::recording::chart::{Axis, Chart, Frame, SHEET, number, round_up};
use crate::recording::{names, style};
use crate::session::summary::{IdentificationSummary, JointErrorSummary, ParameterSummary};
use crate::text::{decimals_for, fixed};
use crate::units::{MICROMETRE, to_mm};

/// Width and height of the bar of colours, in its own units.
const BAR: [u32; 2] = [6, 80];
/// Side of a map of all pairs in its picture, and the space between two of them. More samples than that are thinned out evenly.
const MAP: usize = 42;
const MAP_GAP: usize = 16;
/// Points beyond which they are drawn smaller.
const MANY: usize = 200;
/// Rows of parameters below each other.
const COLUMN: usize = 16;

fn image(size: [usize; 2], color: impl Fn(usize, usize) -> Option<rerun::Color>) -> Image {
    let pixels = (0..size[1]).flat_map(|y| (0..size[0]).map(move |x| (x, y)));
    let bytes = pixels.flat_map(|(x, y)| {
        let [red, green, blue, _] = color(x, y).unwrap_or(style::rgb(0, 0, 0)).0.to_array();
        [red, green, blue]
    });
    let resolution = size.map(|side| u32::try_from(side).unwrap_or(u32::MAX));
    Image::from_rgb24(bytes.collect::<Vec<u8>>(), resolution)
}

/// Draws the colours of lengths up to the `largest` (mm), with the acceptance limit of the mean if it is among them.
pub(in crate::recording) fn legend(canvas: &mut Canvas, title: &str, largest: f64, limit: Option<f64>) {
    let [width, height] = BAR.map(|side| side as usize);
    let bar = image([width, height], |_, y| Some(style::error(1.0 - (y as f64 + 0.5) / height as f64)));
    let at = |value: f64| (1.0 - value / largest) * height as f64;
    let mut chart = Chart::default();
    for step in 0..=3 {
        let value = largest * f64::from(step) / 3.0;
        let more = if step == 3 { " +" } else { "" };
        chart.label([width as f64 + 8.0, at(value)], format!("{}{more}", significant(value)), style::TEXT);
    }
    chart.label([width as f64 / 2.0 + 4.0, -8.0], title, style::TEXT);
    if let Some(limit) = limit.filter(|limit| *limit < largest) {
        chart.line([[-2.0, at(limit)], [width as f64 + 2.0, at(limit)]], style::LIMIT, 1.2);
        chart.label([width as f64 + 10.0, at(limit) - 6.0], "limit", style::LIMIT);
    }
    chart.draw(canvas, names::LEGEND, Some(&bar));
}

/// Draws the position errors of both arms at every pose, and the limits. Verification poses are large.
pub(super) fn errors(canvas: &mut Canvas, judged: &[Judged<'_>], acceptance: &Acceptance) {
    let both = |one: &Judged<'_>| [to_mm(one.nominal.norm()), to_mm(one.identified.norm())];
    let limits =
        [("mean", acceptance.position_mean), ("rms", acceptance.position_rms), ("max", acceptance.position_max)];
    let limits = limits.into_iter().filter_map(|(name, limit)| Some((name, to_mm(limit?)))).collect::<Vec<_>>();
    let values = judged.iter().flat_map(both).chain(limits.iter().map(|(_, limit)| *limit));
    let frame = Frame {
        left: 22.0,
        top: 13.0,
        width: SHEET[0] - 28.0,
        height: SHEET[1] - 30.0,
        x: Axis::linear(0.0, judged.len() as f64 + 1.0),
        y: Axis::decades(values),
    };
    let mut chart = Chart::default();
    chart.axes(&frame, "measurement", "mm");
    let large = if judged.len() > MANY { 1.6 } else { 3.5 };
    for (index, one) in judged.iter().enumerate() {
        let size = if one.is_verification { large } else { 0.5 * large };
        for (error, color) in both(one).into_iter().zip([style::NOMINAL, style::IDENTIFIED]) {
            let color = if one.text.rejected { style::OUT } else { color };
            chart.dot(frame.at(index as f64 + 1.0, error), color, size);
        }
    }
    for ((name, limit), part) in limits.into_iter().zip([0.88, 0.62, 0.36]) {
        chart.limit(&frame, limit, &format!("limit of {name} {}", number(limit)), part);
    }
    for (name, color, x) in [("nominal arm", style::NOMINAL, 60.0), ("identified arm", style::IDENTIFIED, 115.0)] {
        chart.dot([x - 24.0, 5.0], color, 3.5);
        chart.label([x, 5.0], name, color);
    }
    chart.label([210.0, 5.0], "large: verification, small: identification", style::TEXT);
    chart.draw(canvas, names::ERRORS, None);
}

/// Draws the distance errors of all pairs of both arms with the same colours.
pub(super) fn pairs(canvas: &mut Canvas, judged: &[Judged<'_>]) {
    let trusted: Vec<&Judged<'_>> = judged.iter().filter(|one| !one.text.rejected).collect();
    if trusted.len() < 2 {
        return;
    }
    let shown: Vec<&Judged<'_>> = (0..MAP).map(|index| trusted[index * trusted.len() / MAP]).collect();
    let error = |x: usize, y: usize, arm: usize| to_mm(shown[x].distance_errors(shown[y])[arm].abs());
    let cells = (0..MAP).flat_map(|x| (0..x).map(move |y| (x, y)));
    let largest = round_up(cells.map(|(x, y)| error(x, y, 0).max(error(x, y, 1))).fold(1e-3, f64::max));
    let second = MAP + MAP_GAP;
    let bar = second + MAP + 12;
    let picture = image([bar + 5, MAP], |x, y| {
        let part = if x < MAP {
            error(x, y, 0) / largest
        } else if (second..second + MAP).contains(&x) {
            error(x - second, y, 1) / largest
        } else if x >= bar {
            1.0 - (y as f64 + 0.5) / MAP as f64
        } else {
            return None;
        };
        Some(style::error(part))
    });
    let mut chart = Chart::default();
    let (side, middle) = (MAP as f64, MAP as f64 / 2.0);
    chart.label([middle, -3.0], "nominal arm", style::NOMINAL);
    chart.label([second as f64 + middle, -3.0], "identified arm", style::IDENTIFIED);
    for left in [0, second] {
        chart.label([left as f64 + middle, side + 5.0], format!("sample 1 .. {}", trusted.len()), style::TEXT);
    }
    for (value, y) in [(largest, 2.0), (largest / 2.0, middle), (0.0, side)] {
        chart.label([bar as f64 + 14.0, y], format!("{} mm", number(value)), style::TEXT);
    }
    chart.draw(canvas, names::PAIRS, Some(&picture));
}

/// Returns the region of the sheet of all pairs.
pub(in crate::recording) const fn pairs_region() -> [[f64; 2]; 2] {
    [[-12.0, -7.0], [(2 * MAP + MAP_GAP + 36) as f64, MAP as f64 + 8.0]]
}

/// Returns the region of the legend's sheet.
pub(in crate::recording) const fn legend_region() -> [[f64; 2]; 2] {
    [[-8.0, -12.0], [26.0, 86.0]]
}

/// Draws the deviations of the constants as bars with two standard deviations, lengths and angles each in columns of their own.
pub(super) fn parameters(canvas: &mut Canvas, summary: &IdentificationSummary) {
    let mut units: Vec<Vec<&ParameterSummary>> = Vec::new();
    for parameter in summary.constants() {
        match units.iter_mut().find(|unit| unit[0].unit == parameter.unit) {
            Some(unit) => unit.push(parameter),
            None => units.push(vec![parameter]),
        }
    }
    let columns: Vec<(&[&ParameterSummary], f64)> = units
        .iter()
        .flat_map(|unit| {
            let size = |one: &&ParameterSummary| one.deviation.abs() + 2.0 * one.sigma.unwrap_or(0.0);
            let largest = round_up(unit.iter().map(size).filter(|size| size.is_finite()).fold(1e-9, f64::max));
            unit.chunks(COLUMN).map(move |column| (column, largest))
        })
        .collect();
    let mut chart = Chart::default();
    let width = SHEET[0] / columns.len().max(1) as f64;
    for (index, (column, largest)) in columns.iter().enumerate() {
        let frame = Frame {
            left: width * index as f64 + 24.0,
            top: 10.0,
            width: (width - 88.0).max(10.0),
            height: SHEET[1] - 11.0,
            x: Axis::linear(-largest, *largest),
            y: Axis::linear(0.0, COLUMN as f64),
        };
        column_of_bars(&mut chart, &frame, column, *largest);
    }
    chart.draw(canvas, names::PARAMETERS, None);
}

fn column_of_bars(chart: &mut Chart, frame: &Frame, column: &[&ParameterSummary], largest: f64) {
    let unit = column.first().map_or_else(String::new, |one| one.unit.to_string());
    for value in [-largest, 0.0, largest] {
        let [x, _] = frame.at(value, 0.0);
        chart.line([[x, frame.top], [x, frame.top + frame.height]], style::GRID, 0.5);
        chart.label([x, 5.0], format!("{} {unit}", number(value)), style::TEXT);
    }
    for (row, parameter) in column.iter().enumerate() {
        let at = |value: f64| frame.at(value, COLUMN as f64 - row as f64 - 0.5);
        let [_, y] = at(0.0);
        chart.line([at(0.0), at(parameter.deviation)], style::IDENTIFIED, 3.0);
        let known = parameter.sigma.filter(|sigma| sigma.is_finite());
        if let Some(sigma) = known {
            chart.line(
                [at(parameter.deviation - 2.0 * sigma), at(parameter.deviation + 2.0 * sigma)],
                style::LIMIT,
                1.0,
            );
        }
        let color = if parameter.identifiable { style::TEXT } else { style::OUT };
        chart.label([frame.left - 12.0, y], parameter.id.to_string(), color);
        let decimals = known.map_or(3, decimals_for);
        let value = fixed(parameter.deviation, decimals);
        let value = known.map_or_else(|| value.clone(), |sigma| format!("{value} ± {}", fixed(2.0 * sigma, decimals)));
        chart.label([frame.left + frame.width + 32.0, y], value, color);
    }
}

/// Draws the angle error of every joint over its range, with two standard deviations.
pub(super) fn joints(canvas: &mut Canvas, joints: &[JointErrorSummary]) {
    let columns = joints.len().div_ceil(2).max(1);
    // Where nothing was measured the curves are known badly; they are cut there.
    let measured = |joint: &'_ JointErrorSummary| {
        let known = joint.curve.iter().filter(|(value, ..)| joint.is_measured_at(*value));
        known.map(|(_, error, sigma)| error.abs() + 2.0 * sigma).collect::<Vec<_>>()
    };
    let largest = joints.iter().flat_map(measured);
    let largest = round_up(largest.filter(|value| value.is_finite()).fold(1.0, f64::max));
    let mut chart = Chart::default();
    for (index, joint) in joints.iter().enumerate() {
        let width = SHEET[0] / columns as f64;
        let (low, high) = match (joint.curve.first(), joint.curve.last()) {
            (Some(first), Some(last)) => (first.0, last.0),
            _ => joint.measured_deg,
        };
        let frame = Frame {
            left: width * (index % columns) as f64 + 18.0,
            top: 50.0 * (index / columns) as f64 + 9.0,
            width: width - 24.0,
            height: 31.0,
            x: Axis::linear(low, high),
            y: Axis::linear(-largest, largest),
        };
        for value in [-largest, 0.0, largest] {
            let [_, y] = frame.at(low, value);
            chart.line([[frame.left, y], [frame.left + frame.width, y]], style::GRID, 0.5);
            chart.label([frame.left - 8.0, y], number(value), style::TEXT);
        }
        for value in [low, high] {
            let [x, y] = frame.at(value, -largest);
            chart.label([x, y + 4.0], format!("{}°", fixed(value, 0)), style::TEXT);
        }
        for (sign, color, width) in [(2.0, style::GRID, 0.8), (-2.0, style::GRID, 0.8), (0.0, style::IDENTIFIED, 1.5)] {
            let line = joint.curve.iter().map(|(value, error, sigma)| frame.at(*value, error + sign * sigma));
            chart.line(line, color, width);
        }
        let title = format!("{}: {} µrad rms", joint.joint, fixed(joint.curve_rms_urad, 0));
        let middle = frame.left + frame.width / 2.0;
        chart.label([middle, frame.top - 5.0], title, style::TEXT);
        if let Some((turn, sigma)) = joint.compliance_urad {
            let gravity = format!("gravity {} ± {}", fixed(turn, 0), fixed(2.0 * sigma, 0));
            chart.label([middle, frame.top + frame.height + 4.0], gravity, style::TEXT);
        }
    }
    chart.draw(canvas, names::JOINTS, None);
}

/// Picks a figure of a sweep.
type Pick = fn(&Figures) -> f64;

/// Draws what the search for poses has changed, sweep by sweep, each figure as a part of its first value.
pub(super) fn search(canvas: &mut Canvas, steps: &[Figures]) {
    let (Some(first), Some(last)) = (steps.first(), steps.last()) else { return };
    let series: [(&str, rerun::Color, Pick); 3] = [
        ("condition number", style::DONE, |step| step.condition_number),
        ("predicted error, sigma", style::IDENTIFIED, |step| step.predicted_error),
        ("observability O1, µm", style::VERIFICATION, |step| step.o1 / MICROMETRE),
    ];
    let part = |of: fn(&Figures) -> f64, step: &Figures| 100.0 * of(step) / of(first);
    let parts = series.iter().flat_map(|(.., of)| steps.iter().map(|step| part(*of, step)));
    let highest = parts.filter(|part| part.is_finite()).fold(100.0, f64::max);
    let frame = Frame {
        left: 24.0,
        top: 34.0,
        width: SHEET[0] - 30.0,
        height: SHEET[1] - 50.0,
        x: Axis::linear(0.0, steps.len().saturating_sub(1) as f64),
        y: Axis::linear(0.0, 1.05 * highest),
    };
    let mut chart = Chart::default();
    chart.axes(&frame, "sweep of the search", "%");
    for (index, (name, color, of)) in series.into_iter().enumerate() {
        let points = steps.iter().enumerate().filter(|(_, step)| part(of, step).is_finite());
        let points: Vec<[f64; 2]> = points.map(|(sweep, step)| frame.at(sweep as f64, part(of, step))).collect();
        for point in &points {
            chart.dot(*point, color, 2.5);
        }
        chart.line(points, color, 0.8);
        let title = format!("{name}: {} → {}", significant(of(first)), significant(of(last)));
        chart.label([150.0, 4.0 + 9.0 * index as f64], title, color);
    }
    chart.draw(canvas, names::SEARCH, None);
}
