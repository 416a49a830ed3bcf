//! Screen Deliver: which files were written, and what to do with them.

use crossterm::event::KeyCode;
use ratatui::buffer::Buffer;
use ratatui::layout::Rect;

use super::page::{Page, Scroll};
use super::{PicturePlace, Screen, ScreenCx, ScreenOutcome, verify};
use crate::session::summary::VerdictStatus;
use crate::text::counted;
use crate::tui::dialog::Dialog;
use crate::tui::keymap::{Key, KeyHint};
use crate::tui::theme::Role;
use crate::wizard::Intent;
use crate::wizard::view::{Content, DeliverView};

/// Rows from which the content of each file is explained.
const EXPLAINED: u16 = 22;

#[derive(Clone, Copy, Debug, Default)]
pub(super) struct DeliverScreen {
    scroll: Scroll,
}

const fn content<'a>(cx: &ScreenCx<'a>) -> Option<&'a DeliverView> {
    match &cx.view.content {
        Content::Deliver(content) => Some(content),
        _ => None,
    }
}

/// Whether the results are written and only quitting is left.
fn is_done(cx: &ScreenCx<'_>) -> bool {
    content(cx).is_some_and(|content| !content.files.is_empty() && content.is_current)
        && !cx.view.intents.iter().any(|info| info.is_default)
        && cx.view.busy.is_none()
}

/// Content of a file in words.
fn about(file: &str) -> &'static str {
    match file.rsplit(['/', '\\']).next().unwrap_or(file) {
        "plan.csv" => "the poses that were planned",
        "measurements.csv" => "all measurements, as input for any program",
        "calibration.ron" => "the identified arm, input of 'compensate', 'export' and 'verify'",
        "report.json" => "all figures of this session, for other programs",
        "report.html" => "all figures of this session, to read and print",
        "drift.csv" => "the repeated measurements of the drift pose",
        "corrected.ron" => "a profile with the identified constants, for this program",
        "corrected.urdf" => "the identified arm for robot software, such as ROS",
        "dh.csv" => "the identified link constants, for a controller or a spreadsheet",
        "joint-corrections.csv" => "what to add to the angle of each joint, and its compliance",
        "default_kinematics.yaml" => "the identified arm for the ROS driver of Universal Robots",
        "recording.rrd" => "the session as a 3D recording",
        _ => "",
    }
}

fn page(cx: &ScreenCx<'_>, columns: u16, rows: u16) -> Page {
    let mut page = Page::new(cx.theme, columns);
    let Some(content) = content(cx) else { return page };
    if !content.is_current {
        page.marked(
            ("OUT OF DATE: ", Role::Warn),
            "the samples have changed since then: go back and identify again.",
            Role::Plain,
        );
    }
    match &content.verdict {
        Some(verdict) => verify::status(verdict, "see the step Verify", &mut page),
        None => page.paragraph("There is no result yet: go back and identify.", Role::Warn),
    }
    let folder = cx.view.header.folder.as_deref().unwrap_or(".");
    let path = |file: &str| {
        if file.starts_with('/') { file.to_owned() } else { format!("{}/{file}", folder.trim_end_matches('/')) }
    };
    if content.files.is_empty() {
        let given: Vec<String> = content
            .about
            .given()
            .map(|(detail, text)| format!("{} {}", detail.label(), crate::text::printable(&text)))
            .collect();
        let given = if given.is_empty() { "nothing was said about it".to_owned() } else { given.join(", ") };
        page.paragraph(&format!("Report for: {given}"), Role::Plain);
        if content.about.serial.is_empty() {
            page.paragraph("Without a serial number the verdict belongs to no arm.", Role::Warn);
        }
        let is_writing = cx.view.busy.is_some();
        let nothing = "Nothing has been written yet. Enter writes the results to:";
        page.title(if is_writing { "The results are being written to:" } else { nothing });
        page.paragraph(folder, Role::Plain);
        page.gap();
        page.paragraph("calibration.ron is the identified arm; corrected.* and dh.csv are its geometry for other programs. report.html is for reading and printing, report.json has the same figures. plan.csv and measurements.csv are the data.", Role::Plain);
    } else {
        page.title(&format!("Written: {} in {folder}", counted(content.files.len(), "file")));
        for reason in &content.left_out {
            page.marked(("Left out: ", Role::Warn), reason, Role::Plain);
        }
        if !content.left_out.is_empty() {
            page.paragraph("'trupose export --help' lists what can be done about it.", Role::Plain);
        }
        corrected(content, &path, &mut page);
        let from_root = cx.view.header.folder_from_root.as_deref().unwrap_or(folder);
        next_steps(content, &path, (folder, from_root), &mut page);
        page.title("Files");
        for file in &content.files {
            page.paragraph(&path(file), Role::Plain);
            if rows >= EXPLAINED && !about(file).is_empty() {
                page.marked(("    ", Role::Dim), about(file), Role::Dim);
            }
        }
    }
    if !cx.view.header.is_unsaved {
        page.paragraph("Quitting is safe: every measurement is already in the journal.", Role::Ok);
    }
    page
}

/// The robot programs that were corrected, and what stays in them.
fn corrected(content: &DeliverView, path: &dyn Fn(&str) -> String, page: &mut Page) {
    if content.corrected.is_empty() {
        return;
    }
    page.title("Corrected programs");
    for program in &content.corrected {
        let whole = crate::session::corrected::CorrectedText { file: path(&program.file), ..program.clone() };
        page.marked(("- ", Role::Dim), &whole.line(), Role::Ok);
        for reason in &program.reasons {
            page.marked(("    left: ", Role::Dim), reason, Role::Plain);
        }
    }
}

/// How to apply the result, pass it on and check it later, with commands to copy.
fn next_steps(
    content: &DeliverView,
    path: &dyn Fn(&str) -> String,
    (folder, from_root): (&str, &str),
    page: &mut Page,
) {
    page.title("What to do next");
    let calibration = path("calibration.ron");
    let is_accepted = content.verdict.as_ref().is_some_and(|verdict| verdict.status == VerdictStatus::Accepted);
    let mut steps = Vec::new();
    if is_accepted {
        steps.push((
            "correct a robot program whose points were computed, not taught (key p), so that the arm goes where it says:",
            format!(
                "trupose compensate --calibration {calibration} --program FILE --dialect krl --points computed --out NEW-FILE"
            ),
        ));
        steps.push((
            "or give the corrected arm to your offline software; other formats:",
            format!("trupose export --calibration {calibration} --format dh-csv --out dh.csv"),
        ));
    } else {
        let wait = "do not apply it yet: b goes back to Verify, which says what is missing";
        page.marked(("- ", Role::Dim), wait, Role::Warn);
    }
    steps.push(("read the report here:", format!("trupose session report --text {folder}")));
    // From another computer, a path without its beginning would be looked for at home.
    steps.push(("or copy all files from this computer to yours:", format!("scp -r THIS-COMPUTER:{from_root} .")));
    steps.push((
        "verify with new points, later or after a collision:",
        format!("trupose verify --calibration {calibration} --measurements NEW.csv --refit frame+target"),
    ));
    steps.push(("measure more:", format!("trupose resume {folder}")));
    for (what, command) in steps {
        page.marked(("- ", Role::Dim), what, Role::Plain);
        page.marked(("    ", Role::Dim), &command, Role::Title);
    }
}

impl Screen for DeliverScreen {
    fn key_hints(&self, cx: &ScreenCx<'_>) -> Vec<KeyHint> {
        let mut items = vec![Scroll::key_hint()];
        if is_done(cx) {
            items.push(KeyHint::new("Enter", "done: quit", 0));
        }
        items
    }

    fn on_key(&mut self, key: Key, cx: &ScreenCx<'_>) -> ScreenOutcome {
        if key.code == KeyCode::Enter && is_done(cx) {
            let mut lines = vec!["Done. Quit the program?".to_owned(), "Everything is saved.".to_owned()];
            if let Some(folder) = &cx.view.header.folder {
                lines.push("Resume later with:".to_owned());
                lines.push(format!("trupose resume {folder}"));
            }
            return ScreenOutcome::Open(Box::new(Dialog::Confirm { intent: Intent::Quit, lines, is_yes: true }));
        }
        let lines = page(cx, 78, 0).len();
        self.scroll.on_key(key, lines).into()
    }

    fn picture_place(&self, _cx: &ScreenCx<'_>, _area: Rect) -> PicturePlace {
        PicturePlace::Nowhere
    }

    fn draw(&self, cx: &ScreenCx<'_>, area: Rect, buf: &mut Buffer) {
        page(cx, area.width, area.height).draw(self.scroll.0, area, buf);
    }
}
