//! Results for people: as text of at most 80 columns, and as a page to print; every number with its unit and as many digits as it
//! deserves.
//!
//! Knows the plain summaries of `session` and nothing of how they were made. [`Document`] is everything a report says:
//! `report.json` is that object, `report.html` ([`report_html`]) shows it.

mod comparison;
mod document;
mod health;
mod html;
mod iso9283;
mod plan;
mod tables;
mod text;

pub use crate::text::fixed as number;
pub use comparison::comparison_text;
pub use document::{
    AirPart, Counts, Details, Document, DriftPart, FilePart, FindingPart, Found, ParameterNote, PointOrigin, PointPart,
    PredictionPart, ResultState, RobotPart, SessionPart, TemperaturePart,
};
pub use health::{forecast_text, health_text};
pub use html::{comparison_html, report_html, test_html};
pub use iso9283::test_text;
pub use plan::plan_text;
pub use text::{identification_text, verification_text};
