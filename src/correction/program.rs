//! A robot program with its motion targets corrected, read back and proven.

use thiserror::Error;

use super::Corrector;
use super::report::{PathReport, TargetReport};
use super::targets::{self, Corrected, Resolved};
use crate::program::motion::{ReadOptions, Reason, Scan};
use crate::program::{Dialect, ProgramError, Robot, gzip, insert, rewrite, with_remark};

/// Why points that were taught are not corrected.
pub const TAUGHT: &str = "taught points are not corrected: they were recorded where the real arm was, so the arm returns to them as it is; corrected, \
     it would miss them by its error";

/// What a program says that was corrected with an edited calibration; it fits the 32 characters of the shortest remarks.
const EDITED: &str = "WARNING: EDITED CALIBRATION";

/// A program, unpacked.
#[derive(Clone, Debug)]
pub struct Input {
    pub text: Vec<u8>,
    /// The file as it was, if it is compressed.
    packed: Option<Vec<u8>>,
}

impl Input {
    /// The text of a file; what cannot be unpacked is refused by the reader.
    pub fn new(file: Vec<u8>) -> Self {
        match gzip::unpacked(&file) {
            Some(text) => Self { text, packed: Some(file) },
            None => Self { text: file, packed: None },
        }
    }
}

/// How a program is read and corrected.
#[derive(Clone, Debug)]
pub struct Work<'w> {
    pub dialect: Dialect,
    pub options: ReadOptions,
    pub resolved: Resolved<'w>,
    /// Largest deviation of linear moves, which get further points for it (m).
    pub insert: Option<f64>,
}

/// A program and what became of it.
#[derive(Debug)]
pub struct CorrectedProgram {
    pub scan: Scan,
    pub results: Vec<Corrected>,
    /// The whole file.
    pub file: Vec<u8>,
    pub is_changed: bool,
    /// Whether it should say that the calibration was edited, and has no place for it.
    pub lacks_remark: bool,
    pub paths: Vec<PathReport>,
    /// Lines of moves that deviate by more than they may, and have no place for further points.
    pub undivided: Vec<usize>,
}

#[derive(Clone, Debug, Error, PartialEq)]
pub enum CorrectionError {
    #[error(transparent)]
    Program(#[from] ProgramError),
    /// A defect of this program.
    #[error("reading back the corrected program: {0}; nothing is written")]
    Unproven(String),
}

/// Finds the targets of a program.
///
/// # Errors
/// The program cannot be read.
pub fn scan(corrector: &Corrector<'_>, work: &Work<'_>, input: &Input) -> Result<Scan, ProgramError> {
    with_robot(corrector, |robot| rewrite::scan(work.dialect, robot, &work.options, &input.text))
}

/// Calls `act` with the arm as readers of programs need it.
fn with_robot<T>(corrector: &Corrector<'_>, act: impl FnOnce(&Robot<'_>) -> T) -> T {
    let profile = &corrector.arm.profile;
    let pulses: Vec<Option<f64>> = profile.joints().iter().map(|joint| joint.pulses_per_degree).collect();
    act(&Robot {
        profile: profile.name(),
        chain: profile.chain(),
        max_speeds: &[],
        pulses_per_degree: &pulses,
        joint_aliases: profile.joint_aliases(),
    })
}

/// Corrects the targets that were found, and proves the result.
///
/// # Errors
/// The program cannot be written in its language, or the proof fails.
pub fn corrected(
    corrector: &Corrector<'_>,
    work: &Work<'_>,
    input: &Input,
    scan: Scan,
) -> Result<CorrectedProgram, CorrectionError> {
    let results = targets::corrected(corrector, &work.resolved, &scan);
    let (paths, insertions, undivided) = targets::between(corrector, &scan, &results, work.insert);
    let mut text = with_robot(corrector, |robot| -> Result<Vec<u8>, CorrectionError> {
        let read = |text: &[u8]| rewrite::scan(work.dialect, robot, &work.options, text);
        let commands: Vec<_> = results.iter().map(Corrected::command).collect();
        let text = rewrite::rewrite(work.dialect, robot, &input.text, &scan, &commands)?;
        if text == input.text {
            return Ok(text);
        }
        let again = read(&text)?;
        targets::prove(corrector, &results, &scan, &again).map_err(CorrectionError::Unproven)?;
        if insertions.is_empty() {
            return Ok(text);
        }
        let text = insert::insert(work.dialect, &text, &again, &insertions);
        targets::prove_inserted(&again, &insertions, &read(&text)?).map_err(CorrectionError::Unproven)?;
        Ok(text)
    })?;
    let is_changed = text != input.text;
    let mut lacks_remark = false;
    if is_changed && corrector.arm.edited.is_some() {
        match with_remark(work.dialect, &text, EDITED) {
            Some(with_remark) => text = with_remark,
            None => lacks_remark = true,
        }
    }
    let file = match &input.packed {
        Some(original) if !is_changed => original.clone(),
        Some(_) => gzip::packed(&text),
        None => text,
    };
    Ok(CorrectedProgram { scan, results, file, is_changed, lacks_remark, paths, undivided })
}

/// Whether something that is left counts as a motion target that should have been corrected.
fn is_missed(reason: &Reason) -> bool {
    // Not motions, or read with the file that has them.
    !matches!(reason, Reason::InFile(_) | Reason::SystemVariable | Reason::NotMovedTo | Reason::OtherGroup)
}

impl CorrectedProgram {
    /// Number of targets that are corrected.
    pub fn done(&self) -> usize {
        self.results.iter().filter(|result| result.is_done()).count()
    }

    /// Number of motion targets that are left.
    pub fn missed(&self) -> usize {
        let left = self.scan.left.iter().filter(|left| is_missed(&left.reason)).count();
        self.results.len() - self.done() + left
    }

    /// Lines of moves that stay uncorrected beside corrected ones of the same path.
    pub fn torn(&self) -> Vec<usize> {
        targets::half_corrected(&self.scan, &self.results)
    }

    /// The reason why the move on a line is left.
    pub fn why_left(&self, line: usize) -> Option<String> {
        let step = self.scan.moves.iter().find(|step| step.line == line);
        let target =
            step.and_then(|step| self.results.get(step.target?)).and_then(|result| result.report.reason.clone());
        target.or_else(|| self.scan.left.iter().find(|left| left.line == line).map(|left| left.reason.to_string()))
    }

    /// What happened to each target, and to each place that is left.
    pub fn reports(&self) -> impl Iterator<Item = TargetReport> + '_ {
        let left = self.scan.left.iter().map(|left| TargetReport {
            line: left.line,
            name: left.name.clone(),
            status: "left",
            reason: Some(left.reason.to_string()),
            ..TargetReport::default()
        });
        self.results.iter().map(|result| result.report.clone()).chain(left)
    }
}
