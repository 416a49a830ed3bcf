//! The subject of the report: robot, instrument, people, time, conditions; and the origin of its numbers.

use super::markup::{NONE, add, escape, facts, number, paragraph, time};
use crate::report::document::{AirPart, Counts, Details, Document, PointOrigin, ResultState, TemperaturePart};
use crate::session::about::Detail;
use crate::text::counted;

/// Banners at the top of the report.
pub(super) fn banners(document: &Document) -> String {
    let report = &document.report;
    let mut html = String::new();
    let mut banner = |word: &str, text: &str| {
        add(&mut html, &format!("<div class=\"banner\" role=\"note\"><b>{word}</b> {text}</div>\n"));
    };
    match report.points_from {
        PointOrigin::Simulated => {
            banner(
                "SIMULATED.",
                "The points come from a simulated cell. Nothing was measured; this says nothing about a real robot.",
            );
        }
        PointOrigin::Recorded => {
            banner(
                "RECORDED.",
                "The points were measured earlier and played from tables; this program did not measure them.",
            );
        }
        PointOrigin::Typed | PointOrigin::Instrument | PointOrigin::Tables => {}
    }
    match report.state {
        ResultState::None => {
            banner("NO RESULT.", "Nothing has been identified yet. This report shows what was measured so far.");
        }
        ResultState::OutOfDate => banner(
            "OUT OF DATE.",
            "Samples have changed since the identification. The numbers below are those of the earlier samples; identify again.",
        ),
        ResultState::Unusable => banner(
            "NOT USABLE.",
            "The data gave no usable solution, and there is no calibration to apply. The warnings say why.",
        ),
        ResultState::Current => {}
    }
    html
}

/// Robot and instrument side by side, each with its papers.
pub(super) fn section(document: &Document) -> String {
    let report = &document.report;
    let said = |detail: Detail| match report.about.text(detail) {
        text if text.is_empty() => "<span class=\"soft\">not given</span>".to_owned(),
        text => escape(&text),
    };
    let row = |detail: Detail, name: &'static str| (name, said(detail));
    let robot = [
        ("Robot", report.robot.as_ref().map_or_else(|| NONE.to_owned(), |robot| escape(&robot.title))),
        row(Detail::Serial, "Serial number"),
        row(Detail::Controller, "Controller, software"),
        row(Detail::Options, "Accuracy options"),
        ("Payload", report.payload.as_deref().map_or_else(|| "not stated".to_owned(), escape)),
        row(Detail::Speed, "Speed"),
        row(Detail::WarmUp, "Warm-up"),
        row(Detail::Site, "Place and conditions"),
        row(Detail::Operator, "Operator"),
    ];
    let smr = match (&report.target, report.about.smr.is_empty()) {
        (None, true) => "as the profile says".to_owned(),
        (None, false) => said(Detail::Smr),
        (Some(place), true) => escape(place),
        (Some(place), false) => format!("{}; {}", said(Detail::Smr), escape(place)),
    };
    let instrument = [
        ("Instrument", instrument(report)),
        row(Detail::InstrumentSerial, "Serial number"),
        row(Detail::Certificate, "Certificate"),
        row(Detail::CertificateDue, "Valid until"),
        row(Detail::FieldCheck, "Field check"),
        ("Reflector (SMR)", smr),
        row(Detail::Weather, "Weather"),
        ("Temperature", temperature(report.temperature)),
        ("Air", report.air.map_or_else(String::new, air)),
        ("Measured", measured(report)),
    ];
    let expired = report.certificate_expired.map_or_else(String::new, |due| {
        format!(
            "<div class=\"warn\"><b>The certificate of the instrument expired on {due}</b>, before the last measurement.</div>\n"
        )
    });
    format!("<div class=\"two\">\n<div>{}</div>\n<div>{}</div>\n</div>\n{expired}", facts(&robot), facts(&instrument))
}

fn instrument(report: &Details) -> String {
    let of_profile = report.robot.as_ref().and_then(|robot| robot.instrument.as_ref());
    match (&report.instrument, of_profile) {
        (Some(how), Some(name)) => format!("{} (as the profile says); {}", escape(name), escape(how)),
        (Some(how), None) => escape(how),
        (None, Some(name)) => format!("{} (as the profile says)", escape(name)),
        (None, None) => NONE.to_owned(),
    }
}

/// Lines to sign on.
pub(super) const fn signatures() -> &'static str {
    "<div class=\"sign\"><div>Measured by: name, date, signature</div><div>Released by: name, date, signature</div></div>\n"
}

fn measured(report: &Details) -> String {
    let session = &report.session;
    match (&session.first_sample, &session.last_sample) {
        // Rows of a table carry no time, also if they are simulated.
        _ if report.points_from == PointOrigin::Tables
            || (report.points_from == PointOrigin::Simulated && report.instrument.is_none()) =>
        {
            "read from tables, which carry no time".to_owned()
        }
        (Some(first), Some(last)) => {
            let work = format!("{} min of work", number(session.worked_min, 0));
            format!("{} to {} ({work})", time(first), time(last))
        }
        _ => "nothing yet".to_owned(),
    }
}

fn temperature(range: Option<TemperaturePart>) -> String {
    range.map_or_else(
        || "not recorded".to_owned(),
        |range| {
            let (low, high) = (number(range.lowest_degc, 1), number(range.highest_degc, 1));
            let span = number(range.highest_degc - range.lowest_degc, 1);
            format!("{low} to {high} °C over {} (range {span} °C)", counted(range.samples, "sample"))
        },
    )
}

fn air(air: AirPart) -> String {
    let range = |range: Option<(f64, f64)>, unit: &str, digits: usize| {
        range.map(|(low, high)| format!("{} to {} {unit}", number(low, digits), number(high, digits)))
    };
    let values = [range(air.pressure_hpa, "hPa", 1), range(air.humidity_percent, "% relative humidity", 0)];
    let values: Vec<String> = values.into_iter().flatten().collect();
    let change = number(air.change_ppm, 1);
    format!(
        "{}; with the temperature it would change distances by {change} ppm, if the instrument did not correct for it",
        values.join(", ")
    )
}

fn samples(counts: &Counts) -> String {
    let Counts { identification, verification, drift, .. } = counts;
    format!("{identification} for identification, {verification} for verification, {drift} drift")
}

/// Where the numbers come from, with hashes to check it.
pub(super) fn origins(document: &Document) -> String {
    let report = &document.report;
    let result = document.result.as_ref();
    let mut rows = vec![
        (
            "Identified".to_owned(),
            result.map_or_else(|| "not yet".to_owned(), |result| time(&result.provenance.created)),
        ),
        ("Samples that count".to_owned(), samples(&report.counts)),
        ("Session".to_owned(), escape(&report.session.name)),
        (
            "Program".to_owned(),
            result.map_or_else(|| escape(&report.session.program), |result| escape(&result.provenance.program)),
        ),
    ];
    let hash = |text: &str| format!("<code class=\"hash\">{}</code>", escape(text));
    if let Some(robot) = &report.robot {
        rows.push(("Profile".to_owned(), format!("{}<br>{}", escape(&robot.profile), hash(&robot.profile_sha256))));
        rows.push(("Nominal numbers".to_owned(), escape(&robot.source)));
    }
    for input in document.result.iter().flat_map(|result| &result.provenance.inputs) {
        rows.push((format!("Read: {}", input.role), format!("{}<br>{}", escape(&input.file), hash(&input.sha256))));
    }
    for file in &report.files {
        rows.push((format!("Beside this: {}", escape(&file.name)), hash(&file.sha256)));
    }
    let session = &report.session;
    let resumed = match session.resumed {
        0 => String::new(),
        times => format!(", opened again {}", counted(times, "time")),
    };
    if session.journal_entries > 0 {
        let text = format!("{} entries up to this report{resumed}", session.journal_entries);
        rows.push(("Journal".to_owned(), text));
    }
    let rows: Vec<(&str, String)> = rows.iter().map(|(name, value)| (name.as_str(), value.clone())).collect();
    let intro = "The codes are SHA-256 sums: <code>sha256sum FILE</code> shows the same for an unchanged file. All numbers of this report are in report.json as well, with all their digits.";
    format!("<h2>Where the numbers come from</h2>\n{}{}", paragraph(intro), facts(&rows))
}
