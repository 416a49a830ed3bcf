//! Corrects a robot program with the result of a session.

use std::path::Path;

use thiserror::Error;

use crate::correction::program::{self, CorrectedProgram, CorrectionError, Input, TAUGHT, Work};
use crate::correction::report::Report;
use crate::correction::settings::{NamedPose, Settings};
use crate::correction::targets::Resolved;
use crate::correction::{Corrector, LARGEST_UNCERTAINTY, tool_arms};
use crate::model::{CalibratedArm, ModelError};
use crate::program::motion::{Companion, Hint, ReadOptions, Scan};
use crate::program::{Dialect, ProgramError};
use crate::session::corrected::{CorrectedText, Points, ProgramChoice};
use crate::text::{counted, listed, printable};

use super::models::ModelsRequest;

/// Folder of the corrected programs in that of the session: they keep their names.
pub const FOLDER: &str = "corrected";

/// Lines that are named in a summary.
const NAMED: usize = 20;

/// A request to correct a program.
#[derive(Clone, Debug)]
pub struct CorrectRequest {
    /// The identified arm.
    pub arm: ModelsRequest,
    pub choice: ProgramChoice,
}

/// A corrected program in memory.
#[derive(Clone, Debug, PartialEq)]
pub struct ProgramFile {
    pub summary: CorrectedText,
    /// The whole file.
    pub bytes: Vec<u8>,
}

/// Why a program is not corrected.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum CorrectError {
    #[error("no program is named")]
    NoFile,
    #[error("the ending of '{0}' tells no language; there are {list}", list = listed(Dialect::NAMES))]
    Language(String),
    #[error("'{0}' is no language of a robot; there are {list}", list = listed(Dialect::NAMES))]
    NoLanguage(String),
    #[error("{0}")]
    Setting(String),
    #[error("are the points of this program computed or taught? Only computed ones are corrected{hints}")]
    Points {
        /// What the program says about it.
        hints: String,
    },
    #[error("{TAUGHT}")]
    Taught,
    #[error(transparent)]
    Arm(#[from] ModelError),
    #[error(transparent)]
    Program(#[from] ProgramError),
    #[error(transparent)]
    Correction(#[from] CorrectionError),
    #[error("no motion target was found; is it this language?")]
    NoTarget,
    #[error("nothing is corrected; {0}")]
    Nothing(String),
    #[error("{moves} would stay uncorrected beside corrected ones of the same path, first line {line}{reason}", moves = counted(*count, "move"))]
    Torn { count: usize, line: usize, reason: String },
}

/// The language, the points and the settings of a choice, as far as they can be checked without the program.
///
/// # Errors
/// Something is missing or cannot be understood.
pub fn check(choice: &ProgramChoice) -> Result<(), CorrectError> {
    language(choice)?;
    poses(&choice.tool)?;
    poses(&choice.frame)?;
    match choice.points {
        Points::Computed => Ok(()),
        Points::Taught => Err(CorrectError::Taught),
        Points::NotStated => Err(CorrectError::Points { hints: String::new() }),
    }
}

/// Names of several things with semicolons between them.
pub fn several(text: &str) -> impl Iterator<Item = &str> {
    text.split(';').map(str::trim).filter(|part| !part.is_empty())
}

fn language(choice: &ProgramChoice) -> Result<Dialect, CorrectError> {
    if choice.file.is_empty() {
        return Err(CorrectError::NoFile);
    }
    if choice.dialect.is_empty() {
        return Dialect::of_file(&choice.file).ok_or_else(|| CorrectError::Language(printable(&choice.file)));
    }
    choice.dialect.parse().map_err(|_unknown| CorrectError::NoLanguage(printable(&choice.dialect)))
}

fn poses(text: &str) -> Result<Vec<NamedPose>, CorrectError> {
    several(text).map(|part| part.parse().map_err(CorrectError::Setting)).collect()
}

/// Corrects a program, given as the bytes of its file, with the files that belong to it.
///
/// # Errors
/// The reason in words; nothing is corrected by half.
pub fn correct(
    request: &CorrectRequest,
    file: Vec<u8>,
    companions: Vec<Companion>,
) -> Result<ProgramFile, CorrectError> {
    let CorrectRequest { arm, choice } = request;
    let dialect = language(choice)?;
    let (tools, frames) = (poses(&choice.tool)?, poses(&choice.frame)?);
    let calibrated = CalibratedArm::new(&arm.calibration, &arm.profile)?;
    let [nominal, identified] = tool_arms(&calibrated, None);
    let corrector = Corrector::new(&arm.calibration, &calibrated, [&nominal, &identified], LARGEST_UNCERTAINTY, false);
    let companions =
        companions.into_iter().map(|companion| Companion { text: Input::new(companion.text).text, ..companion });
    let work = Work {
        dialect,
        options: ReadOptions { companions: companions.collect(), ..ReadOptions::default() },
        resolved: Resolved {
            tools: Settings { given: &tools, kind: "tool" },
            frames: Settings { given: &frames, kind: "frame" },
        },
        insert: None,
    };
    let input = Input::new(file);
    let scan = program::scan(&corrector, &work, &input)?;
    match choice.points {
        Points::Computed => {}
        Points::Taught => return Err(CorrectError::Taught),
        Points::NotStated => return Err(CorrectError::Points { hints: hints(&scan) }),
    }
    if scan.targets.is_empty() && scan.left.is_empty() {
        return Err(CorrectError::NoTarget);
    }
    let program = program::corrected(&corrector, &work, &input, scan)?;
    let torn = program.torn();
    if let Some(&line) = torn.first() {
        let reason = program.why_left(line).map_or_else(String::new, |reason| format!(" ({reason})"));
        return Err(CorrectError::Torn { count: torn.len(), line, reason });
    }
    let summary = summary(&choice.file, &program);
    if program.is_changed {
        Ok(ProgramFile { summary, bytes: program.file })
    } else {
        let reasons = summary.reasons.iter().take(3).cloned().collect::<Vec<_>>().join("; ");
        Err(CorrectError::Nothing(reasons))
    }
}

/// The signs in a program that its points were computed or taught.
fn hints(scan: &Scan) -> String {
    let hints: Vec<String> = scan.hints.iter().map(ToString::to_string).collect();
    let guess = match scan.hints.iter().find_map(Hint::is_computed) {
        Some(true) => ". They look computed",
        Some(false) => ". They look taught",
        None => "",
    };
    if hints.is_empty() { guess.to_owned() } else { format!(" (in this program: {}){guess}", hints.join("; ")) }
}

fn summary(source: &str, program: &CorrectedProgram) -> CorrectedText {
    let report = Report { targets: program.reports().collect(), ..Report::default() };
    let mut named: Vec<(usize, String)> = Vec::new();
    for target in report.targets.iter().filter(|target| target.moved.is_none()) {
        let name = target.name.as_ref().map_or_else(String::new, |name| format!("{}: ", printable(name)));
        named.push((
            target.line,
            format!("line {}: {name}{}", target.line, target.reason.as_deref().unwrap_or_default()),
        ));
    }
    named.sort();
    let more = named.len().saturating_sub(NAMED);
    let mut reasons: Vec<String> = named.into_iter().take(NAMED).map(|(_, text)| text).collect();
    if more > 0 {
        reasons.push(format!("and {more} more"));
    }
    let largest = |values: &mut dyn Iterator<Item = f64>| values.max_by(f64::total_cmp);
    let name = source.rsplit(['/', '\\']).next().unwrap_or(source);
    CorrectedText {
        source: source.to_owned(),
        file: Path::new(FOLDER).join(name).display().to_string(),
        corrected: program.done(),
        left: program.missed(),
        reasons,
        largest_mm: largest(&mut report.targets.iter().filter_map(|target| target.moved.map(|moved| moved.moved_mm))),
        uncertainty_mm: largest(&mut report.targets.iter().filter_map(|target| target.uncertainty_mm)),
        path_mm: largest(&mut program.paths.iter().map(|path| path.corrected_mm)),
    }
}
