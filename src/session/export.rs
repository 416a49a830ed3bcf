//! The tables of a session: its plan, and what was measured.

use super::journal::from_edge;
use super::measurements::{self, Row as MeasuredRow};
use super::plan::{self, PoseKind};
use super::state::{Robot, Session};
use crate::checksum::{self, Syntax};

/// How the comment begins that says of a table that nothing was measured.
const SIMULATED_MARK: &str = "# SIMULATED: ";

/// What a table says about a simulation that its points come from.
pub fn simulation_of_table(bytes: &[u8]) -> Option<String> {
    let bytes = bytes.strip_prefix("\u{feff}".as_bytes()).unwrap_or(bytes);
    let mut lines = bytes.split(|byte| *byte == b'\n').take_while(|line| line.starts_with(b"#"));
    let said = lines.find_map(|line| line.strip_prefix(SIMULATED_MARK.as_bytes()))?;
    Some(String::from_utf8_lossy(said).trim().to_owned())
}

/// The present plan as `plan.csv` has it; rows of earlier plans only where they were measured.
pub fn plan_csv(session: &Session, robot: &Robot) -> String {
    let is_in = |index: &usize| {
        session.rows.get(*index).is_some_and(|row| row.active) || session.sample_of_row(*index).is_some()
    };
    let rows = (0..session.rows.len()).filter(is_in);
    let rows: Vec<_> = rows.filter_map(|index| session.rows.get(index)).map(|row| row.planned.clone()).collect();
    checksum::with_sum(&plan::write(&rows, &robot.joint_types), Syntax::Csv)
}

/// The samples that count as a table that `trupose identify` reads: identification poses, then verification poses. A column
/// `kind` tells them apart; a comment before them says if they are simulated.
pub fn measurements_csv(session: &Session, robot: &Robot) -> String {
    table(session, robot, &[PoseKind::Identification, PoseKind::Verification])
}

/// The repetitions that show a drift; none without repetitions. They are not among the
/// measurements, because a repeated identification pose does not verify anything.
pub fn drift_csv(session: &Session, robot: &Robot) -> Option<String> {
    session.counted_of(PoseKind::Drift).next()?;
    Some(table(session, robot, &[PoseKind::Drift]))
}

/// A table of simulated points with the comment that says so.
pub fn marked_as_simulated(said: &str, table: &str) -> String {
    format!("{SIMULATED_MARK}{said}\n{table}")
}

fn table(session: &Session, robot: &Robot, of: &[PoseKind]) -> String {
    let mut kinds = vec!["kind"];
    let mut rows = Vec::new();
    for kind in of.iter().copied() {
        for sample in session.counted_of(kind) {
            kinds.push(kind.name());
            rows.push(MeasuredRow {
                line: rows.len() + 2,
                pose: session.pose_of(sample).to_owned(),
                target: None,
                configuration: from_edge(&sample.joints, &robot.joint_types),
                point: session.point_of(sample),
                sigma: session.sigma_of(sample),
                temperature: sample.noted.temperature_degc,
                fields: Vec::new(),
            });
        }
    }
    let table = measurements::write(&rows, &robot.joint_types);
    let lines: Vec<String> = table.lines().zip(kinds).map(|(line, kind)| format!("{line},{kind}")).collect();
    let mark = session.simulation().map(|said| format!("{SIMULATED_MARK}{said}\n")).unwrap_or_default();
    checksum::with_sum(&(mark + &lines.join("\n") + "\n"), Syntax::Csv)
}
