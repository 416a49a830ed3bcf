//! `report.html`: one file that needs nothing else. Style and drawings are inside, there is no script and no address, so that it
//! looks the same in the quality folder in ten years. Printable on A4, readable on a phone and in greyscale: marks and dashes
//! repeat what colours show.
//!
//! It shows a [`Document`] and computes nothing but the drawings.

mod annex;
mod charts;
mod comparison;
mod identity;
mod iso9283;
mod joints;
mod markup;
mod measuring;
mod pair;
mod parameters;
mod plot;
mod use_of;
mod verdict;
mod views;

use crate::report::document::{Details, Document, PointOrigin};
use crate::text::shortened;
pub use comparison::comparison_html;
pub use iso9283::test_html;
use markup::{add, css_string, escape};

/// The rules of the page.
const STYLE: &str = include_str!("html/style.css");
/// Longest name in the head of a printed page (characters).
const HEAD: usize = 60;

/// The report as a page.
pub fn report_html(document: &Document) -> String {
    let report = &document.report;
    let title = report.robot.as_ref().map_or("no robot chosen", |robot| robot.title.as_str());
    let mut html = String::from("<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n");
    html.push_str("<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n");
    add(&mut html, &format!("<title>Calibration report: {} {}</title>\n", escape(title), escape(&report.session.name)));
    add(&mut html, &format!("<style>\n{STYLE}{}</style>\n</head>\n<body>\n", page_rules(document)));
    html.push_str("<div class=\"first\">\n");
    html.push_str(&identity::banners(document));
    add(
        &mut html,
        &format!("<h1>Calibration report</h1>\n<p class=\"lead\">{}{}</p>\n", escape(title), numbered(report)),
    );
    html.push_str(&verdict::section(document));
    html.push_str(&verdict::before_and_after(document));
    html.push_str(&verdict::limits(document));
    html.push_str(&identity::section(document));
    html.push_str(identity::signatures());
    html.push_str("</div>\n");
    html.push_str(&verdict::warnings(document));
    html.push_str(&verdict::accuracy(document));
    html.push_str(&verdict::drawings(document));
    html.push_str(&joints::section(document));
    html.push_str(&parameters::section(document));
    html.push_str(&measuring::section(document));
    html.push_str(&measuring::samples(document));
    html.push_str(&use_of::section(document));
    html.push_str(&identity::origins(document));
    html.push_str(&annex::section(document));
    html.push_str("</body>\n</html>\n");
    html
}

/// The number of the document in a line.
fn numbered(report: &Details) -> String {
    if report.number.is_empty() { String::new() } else { format!(" · document {}", escape(&report.number)) }
}

/// Headers and footers of a printed page.
fn page_rules(document: &Document) -> String {
    let report = &document.report;
    let robot = report.robot.as_ref().map_or(String::new(), |robot| shortened(&robot.title, HEAD));
    let serial = &report.about.serial;
    let arm = if serial.is_empty() { robot } else { format!("{robot}, serial number {}", shortened(serial, HEAD)) };
    let name = &report.session.name;
    let session = if name.is_empty() { String::new() } else { format!("session {}", shortened(name, HEAD)) };
    let document_number = format!("Calibration report{}", numbered(report));
    let middle = if report.points_from == PointOrigin::Simulated { "SIMULATED" } else { "" };
    let place = |place: &str, content: &str| {
        format!("@{place}{{content:{content};font:8pt \"Helvetica Neue\",Arial,sans-serif;color:#555}}\n")
    };
    format!(
        "@page{{size:A4;margin:19mm 16mm 18mm 18mm;\n{}{}{}{}{}}}\n",
        place("top-left", &css_string(&document_number)),
        place("top-center", &css_string(middle)),
        place("top-right", &css_string(&session)),
        place("bottom-left", &css_string(&arm)),
        place("bottom-right", "\"page \" counter(page) \" of \" counter(pages)")
    )
}
