//! The test of ISO 9283: where to measure, and what the attained points say.

mod evaluate;
mod plan;

use thiserror::Error;

pub use evaluate::{Reading, TestRequest, evaluate};
pub use plan::{TestPlan, TestPlanRequest, plan};

use crate::iso9283::{FEWEST, UnknownLabel};
use crate::planning::CellError;
use crate::procedure::ProcedureError;

/// Why there is no test.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum TestError {
    /// The profile lacks something that planning needs.
    #[error(transparent)]
    Profile(#[from] Box<ProcedureError>),
    /// A cell that makes no sense.
    #[error(transparent)]
    Cell(#[from] CellError),
    /// No cube can be reached.
    #[error(
        "no cube with an edge of {edges} mm fits into what the arm reaches within its planning limits and without touching anything"
    )]
    NoCube {
        /// The edges that were tried, in words.
        edges: String,
    },
    /// A row that belongs to no pose.
    #[error("line {line}: {source}")]
    Label {
        /// Line in the file.
        line: usize,
        source: UnknownLabel,
    },
    /// No pose has enough cycles.
    #[error("no pose was attained in at least {FEWEST} cycles")]
    TooFewCycles,
    /// Frames cannot be found.
    #[error("the frame of the instrument cannot be fitted: at least three of the five poses are needed")]
    NoFrame,
}
