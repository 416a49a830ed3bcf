//! The next action: go to a configuration, decide about a sample, or continue.

use ratatui::buffer::Buffer;
use ratatui::layout::Rect;

use super::joints;
use super::prediction::in_short;
use crate::session::journal::FindingCause;
use crate::text::{self, counted, wrapped};
use crate::tui::glyphs::shortened;
use crate::tui::keymap;
use crate::tui::paint;
use crate::tui::screen::ScreenCx;
use crate::tui::theme::{Role, Theme};
use crate::tui::values;
use crate::wizard::view::{CaptureView, FindingView, MoveCheck, PairView};
use crate::wizard::{Intent, IntentInfo};

/// Columns of the names of keys in the list of decisions.
const KEYS: usize = 12;
/// Lines from which nothing needs to be left out.
const TALL: u16 = 26;
/// Largest number of lines of a message.
const MESSAGE: usize = 4;
/// Largest number of distances shown.
const PAIRS: u16 = 5;

pub(super) fn draw(cx: &ScreenCx<'_>, content: &CaptureView, area: Rect, buf: &mut Buffer) {
    let theme = cx.theme;
    let room = usize::from(area.width);
    let is_tall = area.height >= TALL;
    let mut lines: Vec<(String, Role)> = Vec::new();
    let role = if content.finding.is_some() { Role::Warn } else { Role::Title };
    lines.extend(joined(&heading(content), theme, room, is_tall).into_iter().map(|line| (line, role)));
    lines.extend(joined(&count(content, is_tall), theme, room, is_tall).into_iter().map(|line| (line, Role::Plain)));
    if content.finding.is_none() && content.held.is_none() {
        let warning = warning(cx, content).map(|text| wrapped(&theme.glyphs.show(&text), room));
        lines.extend(warning.into_iter().flatten().map(|line| (line, Role::Warn)));
    }
    lines.extend(panel(cx, content, room));
    // While a sample is questioned, only that and the configuration matter.
    let status = if content.finding.is_some() && !is_tall { Vec::new() } else { status(cx, content, is_tall) };
    let status: Vec<(String, Role)> = status
        .into_iter()
        .flat_map(|(text, role)| {
            let text = theme.glyphs.show(&text);
            let parts = if is_tall { wrapped(&text, room) } else { vec![text] };
            parts.into_iter().map(move |part| (part, role))
        })
        .collect();
    // The joints matter most, but must leave room for the decision.
    let kept = if is_tall { height(status.len()) } else { u16::from(!status.is_empty()) };
    let pairs = content.finding.as_ref().map_or(&[][..], |finding| &finding.worst);
    let small = joints::layout(&content.joints, area.width, 0).rows;
    let free = area.height.saturating_sub(height(lines.len()).saturating_add(small));
    let most = height(pairs.len()).min(PAIRS).min(free.saturating_sub(1));
    if most > 0 {
        lines.extend(table(content, usize::from(most)));
    }
    let needed = height(lines.len()).saturating_add(kept);
    let layout = joints::layout(&content.joints, area.width, area.height.saturating_sub(needed));
    let mut row = 0;
    for (text, role) in &lines {
        paint::text(buf, area, (0, row), &shortened(text, room, theme.glyphs), theme.style(*role));
        row += 1;
    }
    let spare = area.height.saturating_sub(row).saturating_sub(layout.rows.saturating_add(height(status.len())));
    row += u16::from(spare > 0);
    joints::draw(&content.joints, layout, theme, paint::band(area, row, layout.rows), buf);
    row = row.saturating_add(layout.rows).saturating_add(u16::from(spare > 1));
    let below = paint::band(area, row, area.height);
    for (row, (text, role)) in (0_u16..).zip(&status) {
        paint::text(buf, below, (0, row), &shortened(text, room, theme.glyphs), theme.style(*role));
    }
}

/// Joins parts on one line and leaves out the last ones if there is no room; if `is_tall`, on as many lines as needed.
fn joined(parts: &[String], theme: Theme, room: usize, is_tall: bool) -> Vec<String> {
    let glyphs = theme.glyphs;
    let mut lines: Vec<String> = Vec::new();
    for part in parts {
        let part = glyphs.show(part);
        match lines.last_mut() {
            Some(line) if text::columns(line) + text::columns(glyphs.dot()) + text::columns(&part) <= room => {
                line.push_str(glyphs.dot());
                line.push_str(&part);
            }
            Some(_) if !is_tall => break,
            _ => lines.push(shortened(&part, room, glyphs)),
        }
    }
    lines
}

fn height(lines: usize) -> u16 {
    u16::try_from(lines).unwrap_or(u16::MAX)
}

/// The cause of a finding in words.
const fn in_words(cause: FindingCause) -> &'static str {
    match cause {
        FindingCause::Unit => "wrong unit",
        FindingCause::JointSign => "a joint turns the other way",
        FindingCause::MistypedJoint => "one joint value is wrong",
        FindingCause::WrongPose => "taken at another pose",
        FindingCause::StayedAtPrevious => "the robot had not moved",
        FindingCause::SwappedRows => "swapped with another pose",
        FindingCause::TargetMoved => "the SMR has moved",
        FindingCause::InstrumentMoved => "the tracker has moved",
        FindingCause::NotAtRest => "the robot was still moving",
        FindingCause::Drift => "it has drifted",
        FindingCause::Unexplained => "its reading does not fit",
    }
}

/// The pose to go to, and the poses on the way.
fn heading(content: &CaptureView) -> Vec<String> {
    if let Some(finding) = &content.finding {
        let cause = in_words(finding.cause);
        return vec![format!("Pose {} is in question: {cause}", finding.pose), "decide before continuing".to_owned()];
    }
    let Some(pose) = &content.pose else { return vec!["All poses of the plan have been measured.".to_owned()] };
    let mut parts = match content.on_the_way.split_first() {
        None => vec![format!("Go to pose {pose}")],
        Some((stop, [])) => vec![format!("Go to {stop} first"), format!("on the way to pose {pose}")],
        Some((stop, rest)) => {
            vec![format!("Go to {stop} first"), format!("then {} and pose {pose}", rest.join(", "))]
        }
    };
    parts.extend(content.kind.map(|kind| kind.name().to_owned()));
    // Where there is no room for both, the check matters more: the last parts are left out.
    if let MoveCheck::Free { from } = &content.move_check {
        parts.push(format!("checked from {from}"));
    }
    let most = content.joints.iter().find(|joint| joint.moves_most);
    parts.extend(most.map(|joint| format!("{} moves most: {:.1} {}", joint.name, joint.moves, joint.unit)));
    parts
}

/// The warning about a move that is not known to be free.
fn warning(cx: &ScreenCx<'_>, content: &CaptureView) -> Option<String> {
    let warning = match &content.move_check {
        MoveCheck::Free { .. } | MoveCheck::Arrived => return None,
        MoveCheck::Blocked { from, obstruction } => {
            format!("Blocked: straight from {from}, {obstruction}. Move by hand in small steps.")
        }
        MoveCheck::NotChecked { reason } => format!("This move was not checked for collisions: {reason}."),
    };
    let home = keymap::key_hints(&cx.view.intents, cx.theme.glyphs);
    let offers = |info: &IntentInfo| info.intent == Intent::ThroughHome && info.is_enabled();
    if let Some(info) = cx.view.intents.iter().find(|info| offers(info))
        && let Some(hint) = home.iter().find(|hint| hint.label == info.label && hint.blocked.is_none())
    {
        return Some(format!("{warning} '{}' goes through home.", hint.key));
    }
    Some(warning)
}

fn count(content: &CaptureView, is_tall: bool) -> Vec<String> {
    let all = content.measured + content.open;
    let mut parts = vec![format!("{} of {all} measured", content.measured)];
    if content.skipped > 0 {
        parts.push(format!("{} skipped", content.skipped));
    }
    if content.open > 0 {
        parts.extend(content.minutes_left.map(|minutes| format!("about {:.0} min left", minutes.ceil())));
    }
    // If there is room, it has a separate line.
    if let Some(drift) = content.drift.last().filter(|_| !is_tall) {
        parts.push(format!("drift {:.3} mm", drift.moved_mm));
    }
    parts
}

/// The distances that fit worst, as a table.
fn table(content: &CaptureView, most: usize) -> Vec<(String, Role)> {
    let Some(finding) = &content.finding else { return Vec::new() };
    let row = |pair: &PairView| {
        let again = if pair.is_drift { " (again)" } else { "" };
        let word = if pair.difference_mm < 0.0 { "too short" } else { "too long" };
        format!(
            // Blanks between all columns: a value that does not fit moves the rest.
            "  {:<15} {:>10.3} {:>10.3} {:>8.3} {word:<9} {:>6.3}",
            format!("pose {}{again}", pair.pose),
            pair.measured_mm,
            pair.predicted_mm,
            pair.difference_mm.abs(),
            pair.expected_mm
        )
    };
    let from = format!("mm, from {}", finding.pose);
    let head = format!("  {from:<15} {:>10} {:>10} {:>8} {:<9} {:>6}", "measured", "predicted", "differs", "", "usual");
    let rows = finding.worst.iter().take(most).map(|pair| (row(pair), Role::Plain));
    std::iter::once((head, Role::Dim)).chain(rows).collect()
}

/// The decision to make, with its keys.
fn panel(cx: &ScreenCx<'_>, content: &CaptureView, room: usize) -> Vec<(String, Role)> {
    let theme = cx.theme;
    let mut lines = Vec::new();
    if let Some(finding) = &content.finding {
        lines.extend(question(cx, finding, room));
    } else if let (Some(stop), None) = (content.on_the_way.first(), &content.held) {
        lines.extend(choice(cx, &format!("the arm is at {stop}"), |intent| *intent == Intent::Passed));
    } else if let Some(reason) = &content.held {
        lines.push((format!("{}Reading held back, not counted yet", theme.glyphs.pointer()), Role::Warn));
        lines.extend(message(cx, reason, room));
        lines.extend(choice(cx, "measure again at rest", |intent| {
            matches!(intent, Intent::Measure | Intent::TypeReading(_))
        }));
        lines.extend(choice(cx, "accept it as it is", |intent| *intent == Intent::AcceptReading));
        lines.extend(choice(cx, "skip this pose", |intent| *intent == Intent::Skip));
    } else if content.pose.is_none() {
        if let Some(reason) = &content.too_few {
            lines.push((theme.glyphs.show(reason), Role::Warn));
        }
        lines.extend(choice(cx, "continue: identify the arm", |intent| *intent == Intent::Next));
        lines.extend(choice(cx, "add the most useful poses", |intent| matches!(intent, Intent::SuggestPoses(_))));
    }
    lines
}

fn question(cx: &ScreenCx<'_>, finding: &FindingView, room: usize) -> Vec<(String, Role)> {
    let mut lines = message(cx, &finding.message, room);
    if finding.has_remedy {
        lines.extend(choice(cx, "apply the proposed correction", |intent| *intent == Intent::ApplyRemedy));
    }
    lines.extend(choice(cx, "measure this pose again", |intent| {
        matches!(intent, Intent::MeasureAgain | Intent::TypeReading(_))
    }));
    lines.extend(choice(cx, "keep it: it counts as it is", |intent| *intent == Intent::Keep));
    lines.extend(choice(cx, "exclude it; it stays in the journal", |intent| *intent == Intent::LeaveOut));
    lines
}

/// A message, unless it is already shown as the notice.
fn message(cx: &ScreenCx<'_>, text: &str, room: usize) -> Vec<(String, Role)> {
    if cx.view.notice.as_ref().is_some_and(|notice| notice.what == text) {
        return Vec::new();
    }
    let lines = wrapped(&cx.theme.glyphs.show(text), room);
    lines.into_iter().take(MESSAGE).map(|line| (line, Role::Plain)).collect()
}

/// A decision with its keys; `None` if it is not possible now.
fn choice(cx: &ScreenCx<'_>, label: &str, accepts: impl Fn(&Intent) -> bool) -> Option<(String, Role)> {
    let glyphs = cx.theme.glyphs;
    let info = cx.view.intents.iter().find(|info| info.is_enabled() && accepts(&info.intent))?;
    let items = keymap::key_hints(&cx.view.intents, glyphs);
    let keys: Vec<&str> = items
        .iter()
        .filter(|item| item.blocked.is_none() && item.label == info.label)
        .map(|item| item.key.as_str())
        .take(2)
        .collect();
    (!keys.is_empty()).then(|| (format!("  {:<KEYS$} {label}", keys.join(" or ")), Role::Plain))
}

/// Last reading, prediction and drift, one line each.
fn status(cx: &ScreenCx<'_>, content: &CaptureView, is_tall: bool) -> Vec<(String, Role)> {
    let mut lines = Vec::new();
    if let Some(live) = &cx.view.live {
        lines.extend(values::live(live).map(|text| (format!("now: {text}"), Role::Hint)));
    }
    if let (Some(expected), Some(_)) = (&content.expected, &content.typed_unit) {
        let [x, y, z] = expected.xyz_mm;
        let spread = expected.spread_mm;
        let text = format!("expected here: x {x:.1}  y {y:.1}  z {z:.1} mm, give or take {spread:.1} mm");
        lines.push((text, Role::Hint));
    }
    if let Some(last) = &content.last {
        let scatter = last.scatter_mm.map_or_else(String::new, |scatter| format!(", scatter {scatter:.3} mm"));
        let [x, y, z] = last.xyz_mm;
        let is_out = if last.counts { "" } else { " (does not count)" };
        let text = format!("last: pose {}{is_out}{scatter}, x {x:.3}  y {y:.3}  z {z:.3} mm", last.pose);
        lines.push((text, Role::Plain));
    }
    if let Some(prediction) = &content.prediction {
        let role = if prediction.is_enough && content.open > 0 { Role::Ok } else { Role::Plain };
        lines.push((in_short(prediction, content.open), role));
    }
    if let Some(drift) = content.drift.last().filter(|_| is_tall) {
        let checks = counted(content.drift.len(), "check");
        let text = format!(
            "drift: pose {} has moved {:.3} mm since its first measurement ({checks})",
            drift.pose, drift.moved_mm
        );
        lines.push((text, Role::Plain));
    }
    lines
}
