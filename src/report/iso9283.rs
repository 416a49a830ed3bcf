//! The figures of a test after ISO 9283 as text.

use crate::session::iso9283::{AccuracyMm, EstimateMm, FrameSource, TestSummary};
use crate::text::{counted, fixed, printable, wrapped};

/// Columns of a line.
const WIDTH: usize = 80;

/// The result of a test as text.
pub fn test_text(summary: &TestSummary) -> String {
    let provenance = &summary.provenance;
    let mut text = vec![format!(
        "Pose and distance figures with the definitions of ISO 9283:1998\n{} ({})\n  {}, {}\n",
        printable(&provenance.robot),
        printable(&provenance.profile),
        provenance.program,
        provenance.created
    )];
    for (name, given) in [("load", &summary.load), ("speed", &summary.speed)] {
        let given = given.as_deref().map_or_else(|| "not stated".to_owned(), printable);
        text.push(format!("  {name}: {given}\n"));
    }
    text.push(format!("  place of the instrument: {}\n\n", frame(summary)));
    let cycles = cycles(summary);
    text.push(format!("Poses, {cycles} (mm; in brackets the 95 % interval)\n"));
    text.push(row(["", "accuracy AP", "AP, corrected", "repeatability RP"]));
    for pose in &summary.poses {
        text.push(row([
            &pose.pose,
            &accuracy(Some(&pose.nominal_mm)),
            &accuracy(pose.identified_mm.as_ref()),
            &estimate(&pose.repeatability_mm),
        ]));
    }
    text.push("\nDistances (mm); they do not depend on where the instrument stands\n".to_owned());
    text.push(row(["", "accuracy AD", "AD, corrected", "repeatability RD"]));
    for distance in &summary.distances {
        text.push(row([
            &format!("{}-{}", distance.from, distance.to),
            &accuracy(Some(&distance.nominal_mm)),
            &accuracy(distance.identified_mm.as_ref()),
            &format!("±{}", estimate(&distance.repeatability_mm)),
        ]));
    }
    for row in &summary.directions {
        text.push(format!(
            "\n{}: accuracy varies by {} mm with {} directions of approach (vAP)",
            row.pose,
            fixed(row.variation_mm, 3),
            row.directions
        ));
    }
    if let Some(drift) = summary.drift_mm {
        text.push(format!("\nthe accuracy of P1 changes by {} mm over the cycles (dAP)", fixed(drift, 3)));
    }
    text.push("\n\n\"Corrected\": what is left when the identified arm corrects the commands.\n".to_owned());
    text.push("What differs from the procedure of the standard:\n".to_owned());
    for deviation in &summary.deviations {
        let lines = wrapped(&format!("- {deviation}"), WIDTH - 2);
        text.extend(lines.iter().map(|line| format!("  {line}\n")));
    }
    text.concat()
}

/// Where the frame of the instrument comes from.
pub(super) const fn frame(summary: &TestSummary) -> &'static str {
    match summary.frame {
        FrameSource::Fitted => "fitted to these same poses",
        FrameSource::Calibration => "as at the identification",
    }
}

/// The number of cycles of the poses.
pub(super) fn cycles(summary: &TestSummary) -> String {
    let cycles = || summary.poses.iter().map(|pose| pose.cycles);
    match (cycles().min(), cycles().max()) {
        (Some(fewest), Some(most)) if fewest < most => format!("{fewest} to {most} cycles"),
        (Some(all), _) => counted(all, "cycle"),
        (None, _) => String::new(),
    }
}

fn row([name, before, after, repeatability]: [&str; 4]) -> String {
    format!("{name:<6}{before:>24}{after:>24}{repeatability:>25}").trim_end().to_owned() + "\n"
}

fn accuracy(of: Option<&AccuracyMm>) -> String {
    of.map_or_else(|| "-".to_owned(), |of| estimate(&of.accuracy))
}

fn estimate(estimate: &EstimateMm) -> String {
    let EstimateMm { value, low, high } = *estimate;
    format!("{} [{}, {}]", fixed(value, 3), fixed(low, 3), fixed(high, 3))
}
