//! The result files of a session: tables, calibration and report.

use crate::checksum::{self, Syntax};
use crate::report::{Document, report_html};
use crate::session::export;
use crate::session::state::Session;

/// File name of the report for people.
pub const REPORT_HTML: &str = "report.html";
/// File name of the report for other programs.
pub const REPORT_JSON: &str = "report.json";

/// The files of a session that has a result, with their names: tables, calibration, the corrected `models`, report.
///
/// # Errors
/// There is no robot or no result; or the serialiser refuses, which is a defect.
pub fn files(session: &Session, models: Vec<(String, String)>) -> Result<Vec<(String, String)>, String> {
    if session.robot.is_none() {
        return Err("there is no robot".to_owned());
    }
    if session.identified.is_none() {
        return Err("there is no result".to_owned());
    }
    let mut files = data_files(session)?;
    files.extend(models);
    files.extend(reports(session, &files)?);
    Ok(files)
}

/// The files that a report describes: the tables, and the calibration if there is a usable result. None without a robot.
///
/// # Errors
/// The serialiser refuses, which is a defect.
pub fn data_files(session: &Session) -> Result<Vec<(String, String)>, String> {
    let Some(robot) = &session.robot else { return Ok(Vec::new()) };
    let mut files = vec![
        ("plan.csv".to_owned(), export::plan_csv(session, robot)),
        ("measurements.csv".to_owned(), export::measurements_csv(session, robot)),
    ];
    files.extend(export::drift_csv(session, robot).map(|text| ("drift.csv".to_owned(), text)));
    if let Some(calibration) = session.identified.as_ref().and_then(|result| result.calibration.as_ref()) {
        files.push(("calibration.ron".to_owned(), calibration.to_text().map_err(|error| error.to_string())?));
    }
    Ok(files)
}

/// The report in both forms, with the hashes of the `files` beside it.
///
/// # Errors
/// The serialiser refuses, which is a defect.
pub fn reports(session: &Session, files: &[(String, String)]) -> Result<Vec<(String, String)>, String> {
    let mut document = Document::new(session, files);
    if let Some(result) = &mut document.result {
        let names = files.iter().map(|(name, _)| name.as_str()).chain([REPORT_JSON, REPORT_HTML]);
        result.written = names.map(str::to_owned).collect();
    }
    let document = document.numbered();
    let json = serde_json::to_string_pretty(&document).map_err(|error| error.to_string())?;
    Ok(vec![
        (REPORT_JSON.to_owned(), checksum::with_sum(&(json + "\n"), Syntax::Json)),
        (REPORT_HTML.to_owned(), checksum::with_sum(&report_html(&document), Syntax::Html)),
    ])
}
