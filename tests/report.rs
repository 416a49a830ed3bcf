//! The report: its numbers are those of the journal, nothing foreign becomes markup, nothing refers to the outside, and every
//! session has one, however little is in it.

#![expect(clippy::indexing_slicing, reason = "a failure of a test is a panic; test files need no atomic writes")]

use std::fs;
use std::sync::LazyLock;

use crate::support::{trupose, trupose_in};
use serde_json::Value;
use trupose::procedure::deliver::{data_files, files, reports};
use trupose::profile::builtin;
use trupose::report::identification_text;
use trupose::session::about::About;
use trupose::session::journal::{Entry, IdentifiedText, Journal, Line, PointErrorText};
use trupose::session::set_up::PayloadText;
use trupose::session::sha256;
use trupose::session::state::Session;
use trupose::session::summary::{
    CandidateSummary, Cause, JointErrorSummary, ParameterSummary, RejectedSummary, SelectionSummary, ShareSummary,
    StatisticsSummary, VerdictStatus, Warning, WarningCode, WorkspaceSummary,
};
use trupose::store::session::read_journal;

/// A short calibration in which something goes wrong and is decided about.
const SCRIPT: &str = r#"(title: "test", clock: Some("2026-01-05T08:00:00Z"), steps: [
    Do(NameSession("s")), Do(ChooseProfile("soochow")), Do(Next),
    Do(ChooseInstrument(Simulated((seed: 1, truth: Paper, faults: ["wrong-pose@11", "beam-break@15"])))), Do(Next),
    Do(ChooseTarget(Profile)), Do(Next), Do(LoadPlan("plan.csv")), Do(AcceptPlan),
    Capture(3, Fail), Do(Note("door open <b>&")), CaptureAll(MeasureAgain), Do(Next),
    Do(Identify), Do(Next), Do(Next),
    Do(About((serial: " R-17 ", operator: "Zoë", site: "cell 4"))), Do(Deliver),
])"#;

/// A figure of some statistics.
type Pick = fn(&StatisticsSummary) -> f64;

struct Calibrated {
    folder: tempfile::TempDir,
    journal: Journal,
}

static CALIBRATED: LazyLock<Calibrated> = LazyLock::new(|| {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("plan.csv"), include_str!("sessions/plan.csv")).unwrap();
    fs::write(folder.path().join("a.script.ron"), SCRIPT).unwrap();
    let output = trupose_in(folder.path(), &["--script", "a.script.ron", "--no-recording"]);
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    let journal = read_journal(&folder.path().join("sessions/s")).unwrap();
    Calibrated { folder, journal }
});

fn session_of(lines: &[Line]) -> Session {
    Session::of(&Journal { lines: lines.to_vec(), ..Journal::default() }).unwrap()
}

fn calibrated() -> Session {
    session_of(&CALIBRATED.journal.lines)
}

/// The session with its result changed.
fn with_result(change: impl Fn(&mut IdentifiedText)) -> Session {
    let mut session = calibrated();
    change(session.identified.as_deref_mut().unwrap());
    session
}

/// Both reports of a session, the page checked.
fn report(session: &Session) -> (Value, String) {
    let [(_, json), (_, html)] = reports(session, &data_files(session).unwrap()).unwrap().try_into().unwrap();
    check_page(&html);
    (serde_json::from_str(&json).unwrap(), html)
}

/// Marks of HTML in order: opening and closing names, attributes with them.
fn marks(html: &str) -> Vec<&str> {
    html.split('<').skip(1).map(|part| &part[..part.find('>').unwrap_or_else(|| panic!("no end: {part}"))]).collect()
}

/// Every mark is closed, known and refers to nothing outside; no number is none.
fn check_page(html: &str) {
    const EMPTY: [&str; 3] = ["!DOCTYPE", "meta", "br"];
    const KNOWN: &[&str] = &[
        "!DOCTYPE",
        "html",
        "head",
        "meta",
        "title",
        "style",
        "body",
        "h1",
        "h2",
        "h3",
        "p",
        "b",
        "i",
        "strong",
        "br",
        "ul",
        "li",
        "code",
        "div",
        "span",
        "table",
        "caption",
        "thead",
        "tbody",
        "tr",
        "th",
        "td",
        "figure",
        "figcaption",
        "svg",
        "polyline",
        "circle",
        "rect",
        "path",
        "text",
    ];
    let mut open = Vec::new();
    // The line of the check sum is a comment.
    for mark in marks(html).into_iter().filter(|mark| !mark.starts_with("!-- trupose-check:")) {
        let name = mark.split([' ', '\n']).next().unwrap();
        if let Some(name) = name.strip_prefix('/') {
            assert_eq!(open.pop(), Some(name), "closed out of order: <{mark}>");
            continue;
        }
        assert!(KNOWN.contains(&name), "unknown mark <{mark}>");
        for attribute in mark.split(' ').skip(1).filter_map(|part| part.split_once('=')).map(|(name, _)| name) {
            let harmful = ["src", "href", "xlink:href", "srcset", "style", "action", "data"];
            assert!(!harmful.contains(&attribute) && !attribute.starts_with("on"), "<{mark}>");
        }
        if !EMPTY.contains(&name) {
            open.push(name);
        }
    }
    assert!(open.is_empty(), "not closed: {open:?}");
    for outside in ["http:", "https:", "//", "url(", "@import", "<script", "<link", "<img", "<iframe", "javascript:"] {
        assert!(!html.contains(outside), "{outside}");
    }
    assert!(html.chars().all(|c| !c.is_control() || c == '\n'));
    let shown = text(html);
    let words = shown.split(|c: char| !c.is_alphanumeric());
    for word in words {
        assert!(!["nan", "inf", "infinity"].contains(&word.to_lowercase().as_str()), "{word}");
    }
    for place in html.split("points=\"").skip(1).map(|rest| &rest[..rest.find('"').unwrap()]) {
        for number in place.split([' ', ',']).filter(|number| !number.is_empty()) {
            assert!(number.parse::<f64>().unwrap().is_finite(), "{place}");
        }
    }
}

/// What a reader sees, line by line: no drawings, no marks.
fn text(html: &str) -> String {
    let body = &html[html.find("<body>").unwrap()..];
    let mut lines = String::new();
    for (index, part) in body.split("<svg").enumerate() {
        let part = if index == 0 { part } else { &part[part.find("</svg>").unwrap()..] };
        lines.push_str(
            &part
                .replace("</td><td", " | </td><td")
                .replace("</th><th", " | </th><th")
                .replace("</th><td", ": </th><td"),
        );
    }
    let lines = lines.replace("</caption>", "</caption>\n").replace("<br>", "\n").replace("</b>", "</b> ");
    let mut shown = String::new();
    let mut inside = false;
    for c in lines.chars() {
        match c {
            '<' => inside = true,
            '>' => inside = false,
            c if !inside => shown.push(c),
            _ => {}
        }
    }
    let shown = [("&lt;", "<"), ("&gt;", ">"), ("&quot;", "\""), ("&#39;", "'"), ("&#47;", "/"), ("&amp;", "&")]
        .into_iter()
        .fold(shown, |shown, (from, to)| shown.replace(from, to));
    let shown = shown.replace('\u{2007}', "").replace('−', "-");
    shown.lines().map(str::trim_end).filter(|line| !line.is_empty()).collect::<Vec<_>>().join("\n")
}

/// Cells of the row that begins with these.
fn row(shown: &str, first: &str) -> Vec<String> {
    let found = shown.lines().find(|line| line.starts_with(&format!("{first} | ")));
    found.unwrap_or_else(|| panic!("no row '{first}' in\n{shown}")).split(" | ").skip(1).map(str::to_owned).collect()
}

/// The part of a text between two headings.
fn between<'a>(shown: &'a str, from: &str, to: &str) -> &'a str {
    let start = shown.find(from).unwrap_or_else(|| panic!("no '{from}'"));
    let rest = &shown[start..];
    &rest[..rest.find(to).unwrap_or_else(|| panic!("no '{to}'"))]
}

#[test]
fn the_json_report_is_the_result_of_the_journal_with_all_digits() {
    let session = calibrated();
    let (json, _) = report(&session);
    let result = session.identified.as_deref().unwrap();
    // The reader of JSON rounds the last digit of some numbers: both go through it.
    let expected = serde_json::to_string(&result.summary).unwrap();
    let Value::Object(expected) = serde_json::from_str(&expected).unwrap() else { panic!() };
    for (name, value) in expected.iter().filter(|(name, _)| *name != "written") {
        assert_eq!(json[name], *value, "{name}");
    }
    let points = json["report"]["points"].as_array().unwrap();
    assert_eq!(points.len(), result.points.len());
    for ((point, number), expected) in points.iter().zip(&result.samples).zip(&result.points) {
        let tuple = |(x, y, z): (f64, f64, f64)| serde_json::json!([x, y, z]);
        assert_eq!(point["number"], serde_json::json!(number));
        assert_eq!(point["nominal_mm"], tuple(expected.nominal_mm));
        assert_eq!(point["identified_mm"], tuple(expected.identified_mm));
        assert_eq!(point["joints"], serde_json::json!(session.sample(*number).unwrap().joints));
    }
    let about = &json["report"]["about"];
    assert_eq!(*about, serde_json::json!({ "serial": "R-17", "operator": "Zoë", "site": "cell 4" }));
    for file in json["report"]["files"].as_array().unwrap() {
        let path = CALIBRATED.folder.path().join("sessions/s").join(file["name"].as_str().unwrap());
        assert_eq!(file["sha256"], sha256(&fs::read(&path).unwrap()), "{}", path.display());
    }
}

#[test]
fn the_page_shows_the_numbers_of_the_journal() {
    let session = calibrated();
    let (_, html) = report(&session);
    let shown = text(&html);
    let summary = &session.identified.as_deref().unwrap().summary;
    let verification = summary.verification.as_ref().unwrap();
    let (before, after) = (&verification.nominal, &verification.identified);
    let table = |from: &str, to: &str, before: StatisticsSummary, after: StatisticsSummary| {
        let part = between(&shown, from, to);
        let rows: [(&str, Pick); 4] = [
            ("largest", |s| s.max),
            ("mean", |s| s.mean),
            ("root mean square", |s| s.rms),
            ("95 % are at most", |s| s.p95),
        ];
        for (name, pick) in rows {
            assert_eq!(
                row(part, name)[..2],
                [format!("{:.4}", pick(&before)), format!("{:.4}", pick(&after))],
                "{from} {name}"
            );
        }
    };
    table("Distance error of ", "Position error per axis", before.distance_mm.unwrap(), after.distance_mm.unwrap());
    table("Position error (length", "Errors as drawings", before.position_mm.unwrap(), after.position_mm.unwrap());
    let axes = |values: [f64; 3]| values.map(|value| format!("{value:.4}"));
    let (before, after) = (before.axis_mm.unwrap(), after.axis_mm.unwrap());
    assert_eq!(row(&shown, "nominal (before), largest absolute value"), axes(before.max));
    assert_eq!(row(&shown, "nominal (before), mean absolute value"), axes(before.mean));
    assert_eq!(row(&shown, "identified (after), largest absolute value"), axes(after.max));
    assert_eq!(row(&shown, "identified (after), mean absolute value"), axes(after.mean));

    for parameter in &summary.parameters {
        let cells = row(&shown, &parameter.id.to_string());
        assert_eq!(cells[1], parameter.unit.name(), "{}", parameter.id);
        let shown = |cell: &str| cell.parse::<f64>().unwrap_or_else(|_| panic!("{}: {cell}", parameter.id));
        let half = |cell: &str| 0.5001 * 0.1_f64.powi(i32::try_from(cell.len() - cell.find('.').unwrap() - 1).unwrap());
        let values =
            [parameter.nominal, parameter.deviation, parameter.sigma.unwrap(), parameter.nominal + parameter.deviation];
        for (cell, value) in cells[2..6].iter().zip(values) {
            assert!((shown(cell) - value).abs() <= half(cell), "{}: {cell} and {value}", parameter.id);
        }
        assert!(cells[6].starts_with("only combined") != parameter.identifiable, "{}: {cells:?}", parameter.id);
    }
    let (json, _) = report(&session);
    let decision = &json["report"]["decision"];
    assert_eq!(decision["limits"].as_array().unwrap().len(), summary.verdict.checks.len());
    for (check, limit) in summary.verdict.checks.iter().zip(decision["limits"].as_array().unwrap()) {
        assert!((limit["value_mm"].as_f64().unwrap() - check.value_mm.unwrap()).abs() < 1e-12);
        // As many digits as the uncertainty has, which is below the limit by far.
        let found = limit["uncertainty_mm"].as_f64().map_or_else(
            || format!(" | {:.4} | – | {:.3} | ", check.value_mm.unwrap(), check.limit_mm),
            |_| format!(" | {:.3} | ✓ pass", check.limit_mm),
        );
        assert!(shown.contains(&found), "{found} in\n{shown}");
    }
}

#[test]
fn the_tables_are_those_of_the_points() {
    let session = calibrated();
    let result = session.identified.as_deref().unwrap();
    let (json, _) = report(&session);
    let tested: Vec<[f64; 3]> = json["report"]["points"]
        .as_array()
        .unwrap()
        .iter()
        .filter(|point| point["verification"] == true)
        .map(|point| serde_json::from_value(point["identified_mm"].clone()).unwrap())
        .collect();
    let expected = result.summary.verification.as_ref().unwrap().identified.axis_mm.unwrap();
    for axis in 0..3 {
        let absolute = tested.iter().map(|error| error[axis].abs());
        let mean = absolute.clone().sum::<f64>() / tested.len() as f64;
        assert!((absolute.fold(0.0, f64::max) - expected.max[axis]).abs() < 2e-6, "axis {axis}");
        assert!((mean - expected.mean[axis]).abs() < 2e-6, "axis {axis}");
    }
}

#[test]
fn of_many_samples_the_worst_are_listed_and_some_are_drawn() {
    let times = 300;
    let (small, small_page) = report(&calibrated());
    let session = with_result(|identified| {
        let one = (identified.samples.clone(), identified.points.clone());
        for time in 1..times {
            identified.samples.extend(&one.0);
            // Every time a little worse.
            identified.points.extend(one.1.iter().map(|point| {
                let (x, y, z) = point.identified_mm;
                let worse = 1e-4 * f64::from(time);
                PointErrorText { identified_mm: (x + worse * x.signum(), y, z), ..*point }
            }));
        }
        let warning = Warning::new(WarningCode::Other("tested".to_owned()), "a remark of a row", false);
        identified.summary.warnings = vec![warning.clone(); 700];
        identified.summary.warnings.push(Warning::new(WarningCode::Other("tested".to_owned()), "what blocks", true));
        let rejected = [RejectedSummary {
            pose: "1".to_owned(),
            line: 1,
            reason: "far off".to_owned(),
            residual_mm: 1.0,
            ratio: 9.0,
        }];
        identified.summary.rejected = rejected.iter().cycle().take(700).cloned().collect();
        identified.summary.rejected[699].residual_mm = 987.654;
    });
    let (json, page) = report(&session);
    let all = |json: &Value| json["report"]["points"].as_array().unwrap().len();
    assert_eq!(all(&json), 300 * all(&small));
    let tested = json["report"]["points"].as_array().unwrap().iter().filter(|point| point["verification"] == true);
    let count = tested.count();
    let shown = text(&page);
    assert!(shown.contains(&format!("The 20 worst of {count} verification poses; all are in report.json")), "{count}");
    assert!(shown.contains(&format!("of {count} samples one in ")) && shown.contains("the 100 worst"));
    assert!(shown.contains(&format!("{count} poses: measured less predicted")), "all are counted");
    assert!(shown.contains("Rejected by the identification: 700 of"));
    assert!(shown.contains("the 500 that are farthest off are listed") && shown.contains("987.654"));
    assert_eq!(shown.matches("a remark of a row").count(), 500);
    assert!(shown.contains("what blocks") && shown.contains("And 200 more; all are in report.json."));
    assert!(page.len() < 1_500_000, "{} bytes, of a small one {}", page.len(), small_page.len());
    assert!(!small_page.contains("all are in report.json") && !small_page.contains("one in"));
}

#[test]
fn the_first_page_says_whose_verdict_it_is_and_by_which_rule() {
    let mut session = calibrated();
    let (json, html) = report(&session);
    let number = json["report"]["number"].as_str().unwrap().to_owned();
    assert!(number.len() == 10 && number.chars().all(|c| c.is_ascii_hexdigit()), "{number}");
    // In the head of every printed page and in the title.
    assert!(html.contains(&format!("document {number}")) && html.contains("@top-left"));
    let first = &html[html.find("<div class=\"first\">").unwrap()..html.find("<h2>").unwrap()];
    let shown = text(&format!("<body>{first}"));
    for words in [
        "NOT ACCEPTED",
        "Position error: ",
        "For the arm with serial number R-17",
        "Before: nominal arm",
        "After: identified arm",
        "ISO 14253-1, JCGM 106",
        "Undecided:",
        "Measured by: name, date, signature",
    ] {
        assert!(shown.contains(words), "no '{words}' in\n{shown}");
    }
    session.about.serial.clear();
    let (other, html) = report(&session);
    assert!(text(&html).contains("No serial number was given: this verdict belongs to no arm."));
    assert_ne!(other["report"]["number"], json["report"]["number"]);
    // The same content has the same number.
    assert_eq!(report(&session).0["report"]["number"], other["report"]["number"]);
}

#[test]
fn papers_of_the_instrument_and_its_remarks_are_shown() {
    let mut session = calibrated();
    session.about.controller = "IRC5 7.1".to_owned();
    session.about.field_check = "two-face: 12 µm".to_owned();
    session.about.certificate_due = "2020-01-31".parse().ok();
    for sample in &mut session.samples {
        sample.noted.remarks = vec!["weather station is off".to_owned()];
    }
    let (json, html) = report(&session);
    let shown = text(&html);
    for words in [
        "IRC5 7.1",
        "two-face: 12 µm",
        "The certificate of the instrument expired on 2020-01-31",
        "weather station is off",
    ] {
        assert!(shown.contains(words), "no '{words}' in\n{shown}");
    }
    let counted = session.counted().count();
    assert_eq!(json["report"]["remarks"][0]["samples"], counted);
    assert_eq!(json["report"]["certificate_expired"], "2020-01-31");
    session.about.certificate_due = "2026-01-05".parse().ok();
    assert!(report(&session).0["report"].get("certificate_expired").is_none(), "it is valid on its last day");
}

#[test]
fn both_arms_are_drawn_on_one_scale() {
    let (_, html) = report(&calibrated());
    let picture = |name: &str| {
        let from = html.find(&format!("aria-label=\"{name}\"")).unwrap();
        &html[from..from + html[from..].find("</svg>").unwrap()]
    };
    let (before, after) = (picture("Before: nominal arm"), picture("After: identified arm"));
    // The errors of the nominal arm are arrows; those of the identified one are a thousandth of them, and dots on the same scale.
    assert!(before.matches("<path class=\"a").count() == 4, "{before}");
    assert_eq!(after.matches("<path class=\"a").count(), 0, "{after}");
    assert_eq!(after.matches("<circle class=\"k0\"").count(), 4);
    // The castings of the arm are the same.
    let arm =
        |svg: &str| svg.lines().filter(|line| line.contains("class=\"cast\"")).map(str::to_owned).collect::<Vec<_>>();
    assert!(!arm(before).is_empty() && arm(before) == arm(after));
}

#[test]
fn what_happened_is_told_with_how_it_was_decided() {
    let (json, html) = report(&calibrated());
    let shown = text(&html);
    let part = &json["report"];
    let findings = part["findings"].as_array().unwrap();
    assert!(
        findings.iter().any(|finding| finding["cause"] == "wrong_pose" && finding["decision"] == "measured again"),
        "{findings:?}"
    );
    assert_eq!(part["not_counted"].as_array().unwrap().len(), 1, "{part}");
    assert_eq!(part["refused"].as_array().unwrap().len(), 1, "{part}");
    for words in [
        "Measured, but not counted",
        "Readings that were refused",
        "door open <b>&",
        "R-17",
        "Zoë",
        "SIMULATED.",
        "were not run",
    ] {
        assert!(shown.contains(words), "no '{words}' in\n{shown}");
    }
    assert!(!html.contains("door open <b>"));
}

#[test]
fn the_page_of_a_small_session_stays_as_it_is() {
    let shown = text(&report(&calibrated()).1);
    // Sums of files stand and fall with the last digits of their numbers.
    let is_sum = |word: &str| matches!(word.len(), 10 | 64) && word.chars().all(|c| c.is_ascii_hexdigit());
    let words = shown.split_inclusive([' ', '\n']).map(|word| match word.trim_end() {
        sum if is_sum(sum) => word.replace(sum, "<sha256>"),
        _ => word.to_owned(),
    });
    insta::assert_snapshot!("small", words.collect::<String>());
}

#[test]
fn names_of_others_stay_text() {
    let hostile = [
        "</style></title><script>alert(1)</script>",
        "\u{1b}[31mred\u{7}\u{202e}\u{0}",
        "\"' onload=alert(1) x='",
        "机器人 Ωмега العربية",
        "see https://example.org//x and url(http://a) @import",
    ];
    let long = "x".repeat(5000);
    for name in hostile.into_iter().chain([long.as_str()]) {
        let mut session = calibrated();
        name.clone_into(&mut session.name);
        session.about = About {
            serial: name.to_owned(),
            operator: name.to_owned(),
            site: name.to_owned(),
            controller: name.to_owned(),
            options: name.to_owned(),
            speed: name.to_owned(),
            warm_up: name.to_owned(),
            instrument_serial: name.to_owned(),
            certificate: name.to_owned(),
            certificate_due: "2026-12-31".parse().ok(),
            field_check: name.to_owned(),
            smr: name.to_owned(),
            weather: name.to_owned(),
        };
        for row in &mut session.rows {
            name.clone_into(&mut row.planned.pose);
        }
        for note in &mut session.notes {
            name.clone_into(&mut note.text);
        }
        for refused in &mut session.refused {
            name.clone_into(&mut refused.reason);
        }
        for sample in &mut session.samples {
            for finding in &mut sample.noted.findings {
                name.clone_into(&mut finding.message);
            }
        }
        let result = session.identified.as_deref_mut().unwrap();
        for group in &mut result.summary.blind_groups {
            name.clone_into(&mut group.description);
        }
        name.clone_into(&mut result.summary.provenance.program);
        result.summary.verdict.reasons = vec![name.to_owned()];
        for warning in &mut result.summary.warnings {
            name.clone_into(&mut warning.message);
        }
        let [_, (_, html)] = reports(&session, &[(name.to_owned(), String::new())]).unwrap().try_into().unwrap();
        // An address may be read, but nothing follows it.
        check_page(
            &html.replace("https:/&#47;", "").replace("http:/&#47;", "").replace("url(", "").replace("@import", ""),
        );
        let plain: String = name.chars().filter(|c| !c.is_control() && *c != '\u{202e}').collect();
        let seen = text(&html).replace('\u{fffd}', "");
        assert!(seen.contains(plain.trim()) || name.contains('-'), "{name:?}");
    }
}

#[test]
fn every_part_of_a_session_has_a_report() {
    let lines = &CALIBRATED.journal.lines;
    for count in 1..=lines.len() {
        let session = session_of(&lines[..count]);
        let (json, html) = report(&session);
        let state = json["report"]["state"].as_str().unwrap();
        match &session.identified {
            None => {
                assert_eq!((state, files(&session, Vec::new()).is_err()), ("none", true));
                assert!(html.contains("NOT EVALUATED") && html.contains("NO RESULT."), "after {count} entries");
                assert!(json.get("verdict").is_none());
            }
            Some(_) => assert_eq!(state, "current"),
        }
    }
}

#[test]
fn a_result_that_does_not_hold_is_not_shown_as_accepted() {
    // Four poses are too few for an uncertainty: nothing is decided about a limit.
    let undecided = with_result(|result| result.summary.verdict.status = VerdictStatus::Accepted);
    let (json, html) = report(&undecided);
    assert_eq!(json["report"]["decision"]["outcome"], "undecided");
    assert!(html.contains("? UNDECIDED") && !html.contains("✓ ACCEPTED"));
    let mut session = with_result(|result| {
        result.summary.verdict.status = VerdictStatus::Accepted;
        for check in &mut result.summary.verdict.checks {
            check.interval_mm = check.value_mm.map(|value| [0.9 * value, 1.1 * value]);
        }
    });
    assert!(report(&session).1.contains("✓ ACCEPTED"));
    let last = session.samples.iter().rposition(|sample| session.kind_of(sample).is_measured()).unwrap();
    session.samples[last].state = trupose::session::state::SampleState::LeftOut;
    let (json, html) = report(&session);
    assert_eq!(json["report"]["state"], "out_of_date");
    assert!(html.contains("OUT OF DATE.") && html.contains("– NOT EVALUATED") && !html.contains("✓ ACCEPTED"));

    let unusable = with_result(|result| result.calibration = None);
    let (json, html) = report(&unusable);
    assert_eq!(json["report"]["state"], "unusable");
    assert!(html.contains("NOT USABLE.") && html.contains("There is nothing to apply"));
}

#[test]
fn little_or_nothing_to_show_is_said() {
    let unverified = with_result(|result| {
        result.summary.verification = None;
        result.summary.verdict.checks.clear();
    });
    let shown = text(&report(&unverified).1);
    assert!(
        shown.contains("nothing can be said about the accuracy") && shown.contains("no acceptance limit was compared")
    );
    assert!(!shown.contains("Accuracy on poses"));
    let unlimited = with_result(|result| result.summary.verdict.checks.clear());
    assert!(text(&report(&unlimited).1).contains("states no acceptance limits"));

    let all_rejected = with_result(|result| {
        for point in &mut result.points {
            point.rejected = true;
        }
    });
    report(&all_rejected);

    let three = with_result(|result| {
        result.samples.truncate(3);
        result.points.truncate(3);
        result.summary.samples = 3;
        result.summary.rank = None;
        result.summary.parameters.clear();
        result.summary.blind_groups.clear();
    });
    assert!(text(&report(&three).1).contains("an unclear number"));

    let bare = with_result(|result| {
        result.samples.clear();
        result.points.clear();
    });
    report(&bare);

    for profile in ["epson_ls3_b401s", "ur5e"] {
        let text = builtin(profile).unwrap().to_owned();
        let entry = Entry::Profile { source: profile.to_owned(), sha256: sha256(text.as_bytes()), text };
        let first = &CALIBRATED.journal.lines[0];
        let session = session_of(&[first.clone(), Line { number: 2, time: first.time, entry }]);
        let (json, html) = report(&session);
        assert_eq!(json["report"]["robot"]["profile"], profile);
        assert!(html.contains("No plan was accepted."));
    }
}

/// The session with errors of joints in its result: one measured in part, one hardly larger than nothing.
fn with_joint_errors() -> Session {
    with_result(|result| {
        let kept = "geometry + compliance + tilt + harmonics + curves 100 urad";
        let candidate = |text: &str, left_out_rms_mm: f64| CandidateSummary {
            terms: text.parse().unwrap(),
            left_out_rms_mm,
            residual_mm: left_out_rms_mm / 2.0,
        };
        let share = |cause, percent| ShareSummary { cause, percent };
        result.summary.selection = Some(SelectionSummary {
            candidates: vec![candidate("geometry", 0.131), candidate(kept, 0.0812)],
            kept: kept.parse().unwrap(),
            reason: "each group gains more than 2 %".to_owned(),
            nominal_rms_mm: 0.72,
            shares: vec![share(Cause::Geometry, 81.8), share(Cause::Gravity, 3.7), share(Cause::JointCurves, 3.2)],
            left_rms_mm: 0.0812,
        });
        let joint = |name: &str, size: f64| JointErrorSummary {
            joint: name.to_owned(),
            measured_deg: (-90.5, 120.0),
            compliance_urad: Some((129.4, 14.6)),
            torque_nm: Some(153.2),
            curve_rms_urad: 0.7 * size,
            curve: (-90..=90)
                .map(|index| 2.0 * f64::from(index))
                .map(|value| (value, size * (5.0 * value.to_radians()).sin(), 20.0))
                .collect(),
        };
        result.summary.joint_errors = vec![joint("J1<b>", 380.0), joint("J2", 4.0)];
        result.summary.workspace = Some(WorkspaceSummary {
            configurations: 400,
            rms_mm: 0.104,
            p95_mm: 0.163,
            max_mm: 0.3,
            beside_geometry_rms_mm: Some(0.2),
        });
        let term = ParameterSummary { id: "joint1.sin5".parse().unwrap(), ..result.summary.parameters[0].clone() };
        result.summary.parameters.push(term);
        result.summary.parameter_count += 1;
    })
}

#[test]
fn errors_of_joints_have_a_part_of_their_own() {
    let session = with_joint_errors();
    let (json, html) = report(&session);
    assert_eq!(json["selection"]["kept"], "geometry + compliance + tilt + harmonics + curves 100 urad");
    let shown = text(&html);
    let sentence =
        "eometry explains 82 %, gravity 4 % and joint curves 3 %; 0.08 mm are left (of the 0.72 mm of the nominal arm)";
    let predicted = "redicted over the whole range of the joints: 0.10 mm rms, 0.16 mm at 95 %";
    assert!(shown.contains(sentence) && shown.contains(predicted), "{shown}");
    assert_eq!(row(&shown, "J2"), ["-90 … 120", "3", "20", "129 ± 15", "153.2"]);
    assert!(
        shown.contains("measured from -90 to 120 deg, 266 µrad rms; gives way by 129 ± 15 urad at 153 Nm"),
        "{shown}"
    );
    assert_eq!(html.matches("<polyline class=\"bnd\"").count(), 2);
    assert!(html.contains("25 parameters (level") && !html.contains("joint1.sin5"));

    let printed = identification_text(&session.identified.as_deref().unwrap().summary);
    let words = printed.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(words.contains(sentence) && words.contains(predicted), "{printed}");
    assert!(words.contains("25 parameters and 1 term of joint errors"), "{printed}");
    assert!(words.contains("of 25 (gap") && !words.contains("joint1.sin5"), "{printed}");
    assert!(words.contains("kept 0.081 mm geometry + compliance"), "{printed}");
    assert!(printed.lines().all(|line| line.chars().count() <= 80), "{printed}");
    let drawn = printed.lines().find(|line| line.contains("-180 ·")).unwrap();
    assert!(drawn.contains('█') && drawn.ends_with("180 deg"), "{drawn}");
}

#[test]
fn what_the_flange_carried_is_stated() {
    let mut session = calibrated();
    assert!(text(&report(&session).1).contains("\nPayload: not stated\n"));
    session.payload = Some(PayloadText { mass_kg: 2.5, centre_mm: (0.0, 0.0, 60.0) });
    let (json, html) = report(&session);
    let stated = "2.5 kg, centre (0, 0, 60) mm in the flange";
    assert!(text(&html).contains(&format!("\nPayload: {stated}\n")));
    assert_eq!(json["report"]["payload"], stated);
}

#[test]
fn the_air_is_stated_with_what_it_does_to_distances() {
    let mut session = calibrated();
    assert!(!text(&report(&session).1).contains("\nAir: "));
    for (index, sample) in session.samples.iter_mut().enumerate() {
        let later = if index == 0 { 0.0 } else { 1.0 };
        sample.noted.temperature_degc = Some(20.0 + 2.0 * later);
        sample.noted.pressure_hpa = Some(1010.0 - 5.0 * later);
        sample.noted.humidity_percent = Some(40.0);
    }
    // Two degrees and five hectopascal: both make the air thinner, 1.86 and 1.35 ppm.
    let (json, html) = report(&session);
    let stated = "1005.0 to 1010.0 hPa, 40 to 40 % relative humidity; with the temperature it would change distances by 3.2 ppm, \
                  if the instrument did not correct for it";
    assert!(text(&html).contains(&format!("\nAir: {stated}\n")), "{}", text(&html));
    let change = json["report"]["air"]["change_ppm"].as_f64().unwrap();
    assert!((change - 3.21).abs() < 1e-9, "{change}");
}

#[test]
fn numbers_that_are_none_reach_neither_file() {
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e300] {
        let mut session = with_result(|result| {
            let summary = &mut result.summary;
            summary.sigma.used_mm = bad;
            summary.condition_number = Some(bad);
            summary.singular_value_gap = if bad.is_nan() { 0.0 } else { bad.abs().min(1e300) };
            for parameter in &mut summary.parameters {
                (parameter.nominal, parameter.deviation, parameter.sigma) = (bad, bad, Some(bad));
            }
            let verification = summary.verification.as_mut().unwrap();
            for model in [&mut verification.nominal, &mut verification.identified] {
                model.position_mm = Some(StatisticsSummary {
                    count: 1,
                    mean: bad,
                    rms: bad,
                    p95: bad,
                    max: bad,
                    ..StatisticsSummary::default()
                });
            }
            for (index, point) in result.points.iter_mut().enumerate() {
                *point = PointErrorText {
                    at_mm: if index == 0 { point.at_mm } else { (bad, 0.0, bad) },
                    nominal_mm: (bad, bad, bad),
                    identified_mm: if index % 2 == 0 { (bad, 0.0, 0.0) } else { point.identified_mm },
                    ..*point
                };
            }
        });
        for sample in &mut session.samples {
            sample.noted.temperature_degc = Some(bad);
            sample.noted.predicted_error_sigma = Some(bad);
        }
        report(&session);
    }
}

#[test]
fn the_command_makes_the_same_report_again() {
    let place = CALIBRATED.folder.path();
    let delivered = fs::read_to_string(place.join("sessions/s/report.json")).unwrap();
    fs::create_dir_all(place.join("again")).unwrap();
    let output = trupose_in(place, &["session", "report", "sessions/s", "--out", "again/mine.html"]);
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    let said = String::from_utf8(output.stdout).unwrap();
    assert_eq!(said, "written: again/mine.json\nwritten: again/mine.html\n");
    let read = |text: &str| {
        let mut value: Value = serde_json::from_str(text).unwrap();
        for later in ["journal_entries", "worked_min"] {
            value["report"]["session"][later] = Value::Null;
        }
        // The number is that of the content.
        assert!(value["report"]["number"].take().is_string());
        // The check sum covers those as well.
        assert!(value["check"].take().is_string());
        value
    };
    assert_eq!(read(&fs::read_to_string(place.join("again/mine.json")).unwrap()), read(&delivered));
    check_page(&fs::read_to_string(place.join("again/mine.html")).unwrap());
    let output = trupose_in(place, &["session", "report", "nowhere"]);
    assert_ne!(output.status.code(), Some(0));
}

#[test]
fn the_report_is_printed_as_plain_text() {
    let place = CALIBRATED.folder.path();
    let before = fs::read_dir(place.join("sessions/s")).unwrap().count();
    let output = trupose_in(place, &["session", "report", "sessions/s", "--text"]);
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    assert!(output.stderr.is_empty());
    let said = String::from_utf8(output.stdout).unwrap();
    let delivered: Value =
        serde_json::from_str(&fs::read_to_string(place.join("sessions/s/report.json")).unwrap()).unwrap();
    let mean = delivered["verification"]["identified"]["position_mm"]["mean"].as_f64().unwrap();
    assert!(said.contains("Verdict: NOT ACCEPTED") && said.contains(&format!("{mean:.4}")), "{said}");
    // No colour, no control characters, no line that a terminal would break.
    assert!(said.chars().all(|c| c == '\n' || !c.is_control()), "{said:?}");
    assert!(said.lines().all(|line| line.chars().count() <= 80), "{said}");
    assert_eq!(fs::read_dir(place.join("sessions/s")).unwrap().count(), before);
    let output = trupose_in(place, &["session", "report", "sessions/s", "--text", "--out", "x.html"]);
    assert_eq!(output.status.code(), Some(2));
}

#[test]
fn identify_writes_both_reports() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("r");
    let arguments = ["identify", "--profile", "soochow", "--measurements", "sessions/soochow-example/measurements.csv"];
    let verify = ["--verify", "sessions/soochow-example/verification.csv", "--out", out.to_str().unwrap()];
    let output = trupose(&[&arguments[..], &verify].concat());
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    let html = fs::read_to_string(out.join("report.html")).unwrap();
    check_page(&html);
    let json: Value = serde_json::from_str(&fs::read_to_string(out.join("report.json")).unwrap()).unwrap();
    assert_eq!(json["report"]["points"].as_array().unwrap().len(), 76);
    assert_eq!(json["report"]["points_from"], "tables");
    assert!(text(&html).contains("read from tables, which carry no time"));
    let calibration = sha256(&fs::read(out.join("calibration.ron")).unwrap());
    assert_eq!(json["report"]["files"], serde_json::json!([{ "name": "calibration.ron", "sha256": calibration }]));
}
