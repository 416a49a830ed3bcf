//! The drawings of a report: errors per pose, their spread, against each joint, the search, the prediction, the drift.

use std::collections::BTreeSet;

use super::markup::number;
use super::plot::{Mark, Plot, Scale, WIDTH};
use crate::planning::Figures;
use crate::report::document::{Details, DriftPart, PointPart, PredictionPart, RobotPart};
use crate::text::counted;

/// Bars of a histogram.
const BINS: usize = 48;
/// Room above the bars for the name of a limit, as a part of the highest bar.
const ROOM: f64 = 0.22;
/// Size of a drawing over both columns.
const WIDE: (f64, f64) = (2.0 * WIDTH, 112.0);
/// Size of a drawing in one of three columns.
const SMALL: (f64, f64) = (236.0, 150.0);

/// Most points of a drawing and rows of a table; with more a page could not be opened.
pub(super) const MOST: usize = 500;
/// Most poses that are listed one by one.
pub(super) const LISTED: usize = 20;
/// Number of worst points in a thinned drawing.
const WORST: usize = 100;

/// The points of a drawing with their places in `points`: all, or the worst and some evenly chosen.
pub(super) fn shown<'a>(points: &[&'a PointPart]) -> Vec<(usize, &'a PointPart)> {
    if points.len() <= MOST {
        return points.iter().copied().enumerate().collect();
    }
    let step = points.len().div_ceil(MOST - WORST);
    let mut chosen: BTreeSet<usize> = worst(points).into_iter().take(WORST).collect();
    chosen.extend((0..points.len()).step_by(step));
    chosen.into_iter().filter_map(|index| Some((index, *points.get(index)?))).collect()
}

/// The places of all points, the worst first: by the error of the identified arm.
pub(super) fn worst(points: &[&PointPart]) -> Vec<usize> {
    let error = |index: &usize| points.get(*index).map_or(0.0, |point| norm(point.identified_mm));
    let mut order: Vec<usize> = (0..points.len()).collect();
    order.sort_by(|one, other| error(other).total_cmp(&error(one)));
    order
}

/// A remark if not all of `count` points are drawn; otherwise empty.
pub(super) fn thinned(count: usize) -> String {
    if count <= MOST {
        return String::new();
    }
    let step = count.div_ceil(MOST - WORST);
    format!("; of {count} samples one in {step} is drawn, and the {WORST} worst")
}

/// Length of an error.
pub(super) fn norm([x, y, z]: [f64; 3]) -> f64 {
    x.hypot(y).hypot(z)
}

/// Position errors, pose by pose, of both models.
pub(super) fn per_pose(points: &[&PointPart], title: &str, caption: &str) -> String {
    let all = points.iter().flat_map(|point| [norm(point.nominal_mm), norm(point.identified_mm)]);
    let x = Scale::linear(0.0, points.len() as f64 + 1.0);
    let mut plot = Plot::new((WIDTH, 210.0), (x, "pose, in the order of measuring"), (Scale::log(all), "mm"));
    for (index, point) in shown(points) {
        let x = (index + 1) as f64;
        let (before, after) = (plot.at(x, norm(point.nominal_mm)), plot.at(x, norm(point.identified_mm)));
        if let (Some(before), Some(after)) = (before, after) {
            plot.line("gr", &[before, after]);
            plot.mark(Mark::Nominal, before);
            plot.mark(if point.rejected { Mark::Rejected } else { Mark::Identified }, after);
        }
    }
    let mut legend = vec![(Mark::Nominal, "nominal"), (Mark::Identified, "identified")];
    if points.iter().any(|point| point.rejected) {
        legend.push((Mark::Rejected, "rejected"));
    }
    plot.legend(&legend);
    plot.figure(title, &format!("{caption}{}", thinned(points.len())))
}

/// How often errors of either model are how large, in one frame with the limits: name and mm.
pub(super) fn spread(points: &[&PointPart], limits: &[(String, f64)]) -> String {
    let lengths = |pick: fn(&PointPart) -> [f64; 3]| -> Vec<f64> {
        points.iter().map(|point| norm(pick(point))).filter(|error| error.is_finite() && *error > 0.0).collect()
    };
    let (before, after) = (lengths(|point| point.nominal_mm), lengths(|point| point.identified_mm));
    let all = before.iter().chain(&after).copied();
    let marked = limits.iter().map(|(_, limit)| *limit);
    let x = Scale::log(all.clone().chain(marked));
    let (low, high) =
        all.fold((f64::INFINITY, 0.0), |(low, high): (f64, f64), value| (low.min(value), high.max(value)));
    if low >= high {
        return String::new();
    }
    let (low, width) = (low.ln(), (high / low).ln() / BINS as f64);
    let counts = |lengths: &[f64]| {
        let mut bins = [0_u32; BINS];
        for error in lengths {
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a small whole number")]
            let index = (((error.ln() - low) / width).max(0.0) as usize).min(BINS - 1);
            if let Some(bin) = bins.get_mut(index) {
                *bin += 1;
            }
        }
        bins
    };
    let bins = [("nom", counts(&before)), ("idn", counts(&after))];
    let most = bins.iter().flat_map(|(_, bins)| bins).map(|count| f64::from(*count)).fold(0.0, f64::max);
    // Room for the names of the limits above the bars.
    let y = Scale::from_zero(std::iter::once(most * (1.0 + ROOM * limits.len() as f64)));
    let mut plot = Plot::new(WIDE, (x, "position error (mm), logarithmic"), (y, "poses"));
    for (class, bins) in &bins {
        for (index, count) in bins.iter().enumerate().filter(|(_, count)| **count > 0) {
            let from = width.mul_add(index as f64, low);
            plot.bar(class, (from.exp(), (from + width).exp()), f64::from(*count));
        }
    }
    let mut rows = 0.0;
    for (name, limit) in limits {
        plot.limit(*limit, rows, &format!("limit of the {name}: {} mm", number(*limit, 3)));
        rows += 1.0;
    }
    plot.legend(&[(Mark::Nominal, "before"), (Mark::Identified, "after")]);
    format!("<div class=\"wide\">{}</div>\n", plot.figure("How large the errors are", &counted(points.len(), "pose")))
}

/// Errors of the identified arm against every joint.
pub(super) fn against_joints(robot: &RobotPart, points: &[PointPart]) -> String {
    let used: Vec<&PointPart> = points.iter().filter(|point| !point.rejected).collect();
    let caption = thinned(used.len());
    let caption = caption.trim_start_matches("; ");
    let used: Vec<&PointPart> = shown(&used).into_iter().map(|(_, point)| point).collect();
    let largest = Scale::from_zero(used.iter().map(|point| norm(point.identified_mm)));
    let joints = robot.joints.iter().zip(&robot.joint_units).enumerate();
    joints
        .map(|(index, (name, unit))| {
            let value = |point: &PointPart| point.joints.get(index).copied().unwrap_or(f64::NAN);
            let x = Scale::around(used.iter().map(|point| value(point)));
            let mut plot = Plot::new(SMALL, (x, unit), (largest, "mm"));
            // Verification in front.
            for is_verification in [false, true] {
                for point in used.iter().filter(|point| point.verification == is_verification) {
                    let mark = if is_verification { Mark::Identified } else { Mark::Residual };
                    if let Some(place) = plot.at(value(point), norm(point.identified_mm)) {
                        plot.mark(mark, place);
                    }
                }
            }
            plot.figure(name, caption)
        })
        .collect()
}

/// Condition number and predicted error over the sweeps of the search.
pub(super) fn search(steps: &[Figures]) -> String {
    let drawn = |title: &str, label: &str, pick: fn(&Figures) -> f64| {
        let x = Scale::linear(0.0, steps.len().saturating_sub(1).max(1) as f64);
        let y = Scale::from_zero(steps.iter().map(pick));
        let mut plot = Plot::new((WIDTH, 160.0), (x, "sweep of the search"), (y, label));
        let values = || steps.iter().enumerate().map(|(index, step)| (index as f64, pick(step)));
        plot.curve("il", values());
        let places: Vec<_> = values().filter_map(|(x, y)| plot.at(x, y)).collect();
        for place in places {
            plot.mark(Mark::Identified, place);
        }
        let ends = steps.first().zip(steps.last()).map(|(first, last)| (pick(first), pick(last)));
        let caption = ends.map_or_else(String::new, |(first, last)| {
            format!("from {} at the start to {} in the end", number(first, 2), number(last, 2))
        });
        plot.figure(title, &caption)
    };
    drawn("Condition number over the search", "condition number", |step| step.condition_number)
        + &drawn("Predicted error over the search", "× sigma", |step| step.predicted_error)
}

/// Predicted error against the number of samples.
pub(super) fn prediction(steps: &[PredictionPart]) -> String {
    let x = Scale::around(steps.iter().map(|step| step.samples as f64));
    let y = Scale::log(steps.iter().map(|step| step.predicted_error_sigma));
    let mut plot = Plot::new((WIDTH, 160.0), (x, "identification samples"), (y, "× sigma"));
    plot.curve("il", steps.iter().map(|step| (step.samples as f64, step.predicted_error_sigma)));
    plot.figure(
        "Predicted error against the number of poses",
        "RMS position error to expect at fresh poses, per standard deviation of the instrument; computed while measuring",
    )
}

/// Distance of the repeated pose from its first measurement, over time.
pub(super) fn drift(parts: &[DriftPart]) -> String {
    let x = Scale::from_zero(parts.iter().map(|part| part.minutes));
    let y = Scale::from_zero(parts.iter().map(|part| norm(part.moved_mm)));
    let mut plot = Plot::new((WIDTH, 160.0), (x, "minutes since its first measurement"), (y, "mm"));
    plot.curve("il", parts.iter().map(|part| (part.minutes, norm(part.moved_mm))));
    let places: Vec<_> = parts.iter().filter_map(|part| plot.at(part.minutes, norm(part.moved_mm))).collect();
    for place in places {
        plot.mark(Mark::Identified, place);
    }
    plot.figure(
        "Drift over time",
        "distance of the repeated pose from its first measurement, in the frame of the instrument",
    )
}

/// The points of one kind.
pub(super) fn of_kind(report: &Details, is_verification: bool) -> Vec<&PointPart> {
    report.points.iter().filter(|point| point.verification == is_verification).collect()
}
