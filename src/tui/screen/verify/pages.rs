//! Verdict and tables of the verification.

use crate::session::joint_errors::workspace_sentence;
use crate::session::summary::{Figure, ORIENTATION_SENTENCE, Verdict, VerdictStatus, VerificationSummary};
use crate::text::{self, counted, fixed};
use crate::tui::screen::page::Page;
use crate::tui::theme::Role;
use crate::wizard::view::VerifyView;

/// Verdict, limits, warnings and tables.
pub(super) fn accuracy(content: &VerifyView, page: &mut Page) {
    if !content.is_current {
        page.marked(
            ("OUT OF DATE: ", Role::Warn),
            "the samples have changed since then: go back and identify again.",
            Role::Plain,
        );
    }
    if let Some(too_few) = &content.too_few {
        page.marked(("UNKNOWN: ", Role::Warn), too_few, Role::Plain);
    }
    if let Some(verdict) = &content.verdict {
        if let Some(verification) = &content.verification {
            page.paragraph(&sentence(verification, verdict), role_of(verdict));
        }
        status(verdict, "see below", page);
        limits(verdict, page);
    }
    if let Some(workspace) = &content.workspace {
        page.marked(("  ", Role::Dim), &workspace_sentence(workspace), Role::Plain);
    }
    for warning in &content.warnings {
        let mark = if warning.blocks_acceptance { ("WARNING ", Role::Warn) } else { ("note    ", Role::Title) };
        page.marked(mark, &warning.message, Role::Plain);
    }
    if let Some(verification) = &content.verification {
        tables(verification, page);
    }
}

/// The result in a sentence: the accuracy, where it was measured, and what it was before.
fn sentence(verification: &VerificationSummary, verdict: &Verdict) -> String {
    let VerificationSummary { samples, independent, nominal, identified, .. } = verification;
    let which = if *independent { "were not used to identify it" } else { "were used to identify it as well" };
    let mut errors = identified.errors().into_iter().zip(nominal.errors());
    let known = errors.find_map(|((name, after), (_, before))| Some((name, after?, before?)));
    let Some((name, after, before)) = known else {
        return format!("Nothing can be said about the accuracy from {}.", counted(*samples, "pose"));
    };
    let quantity = if name.starts_with("distance") { " between poses" } else { "" };
    let worst = verdict.checks.iter().find(|check| check.met == Some(false));
    let limit = worst.map_or_else(String::new, |check| {
        format!(", but {} must not exceed {} mm", check.quantity.words(), fixed(check.limit_mm, 3))
    });
    format!(
        "The arm is accurate to {} mm{quantity} (rms; at most {} mm) on {} that {which}; before, it was {} mm{limit}.",
        fixed(after.rms, 3),
        fixed(after.max, 3),
        counted(*samples, "pose"),
        fixed(before.rms, 3),
    )
}

/// The colour of a verdict.
const fn role_of(verdict: &Verdict) -> Role {
    match verdict.status {
        VerdictStatus::Accepted if verdict.undecided.is_empty() => Role::Ok,
        VerdictStatus::Accepted | VerdictStatus::NotEvaluated => Role::Warn,
        VerdictStatus::NotAccepted => Role::Alarm,
    }
}

/// Beginning of a reason that refers to a warning by its code.
const BY_CODE: &str = "see the warning '";

/// The verdict in words. `place` says where the warnings can be read, because their codes are shown nowhere.
pub(in crate::tui::screen) fn status(verdict: &Verdict, place: &str, page: &mut Page) {
    let mark = format!("{}: ", verdict.word());
    let by_code = verdict.reasons.iter().filter(|reason| reason.starts_with(BY_CODE)).count();
    let mut reasons: Vec<String> =
        verdict.reasons.iter().filter(|reason| !reason.starts_with(BY_CODE)).cloned().collect();
    if by_code > 0 {
        let verb = if by_code == 1 { "rules" } else { "rule" };
        reasons.push(format!("{} {verb} it out, {place}", counted(by_code, "warning")));
    }
    page.marked((&mark, role_of(verdict)), &reasons.join("; "), Role::Plain);
}

fn limits(verdict: &Verdict, page: &mut Page) {
    for check in &verdict.checks {
        let (sign, result, role) = match check.met {
            Some(true) => ("<=", "met", Role::Ok),
            Some(false) => ("> ", "NOT MET", Role::Warn),
            None => ("  ", "NOT EVALUATED", Role::Warn),
        };
        let value = check.value_text();
        let quantity = check.quantity.words();
        let line = format!("  {quantity:<16}{value:>9} mm  {sign} {:>7} mm  ", fixed(check.limit_mm, 3));
        page.line(vec![(line, Role::Plain), (result.to_owned(), role)]);
    }
}

/// Errors before and after, as in tables III and IV of the method paper.
fn tables(verification: &VerificationSummary, page: &mut Page) {
    let VerificationSummary { samples, basis, independent, nominal, identified, .. } = verification;
    page.gap();
    let which =
        if *independent { "the identification did not use" } else { "the identification DID USE, in part or all" };
    page.paragraph(&format!("Errors at {samples} poses that {which}: {basis}."), Role::Plain);
    let names = names(page);
    page.line(vec![(format!("{:<names$}{:>10}{:>10}{:>9}", "mm", "before", "after", "better"), Role::Dim)]);
    for ((name, before), (_, after)) in nominal.errors().into_iter().zip(identified.errors()) {
        let (Some(before), Some(after)) = (before, after) else { continue };
        let names =
            [format!("{name}, mean of {}", after.count), "  rms".to_owned(), "  95 %".to_owned(), "  max".to_owned()];
        for ((name, before), after) in names.iter().zip(before.figures()).zip(after.figures()) {
            row(page, name, before, after);
        }
    }
    let orientations = nominal.orientation_mrad.zip(identified.orientation_mrad);
    if let Some((before, after)) = orientations {
        let name = format!("orientation (mrad), mean of {}", after.count);
        let names = [name.as_str(), "  rms", "  95 %", "  max"].into_iter();
        for ((name, before), after) in names.zip(before.figures()).zip(after.figures()) {
            row(page, name, before, after);
        }
    }
    if let (Some(before), Some(after)) = (&nominal.axis_mm, &identified.axis_mm) {
        for (axis, name) in ["X", "Y", "Z"].iter().enumerate() {
            let [from, to] = [before, after].map(|model| (model.mean.get(axis), model.max.get(axis)));
            if let ((Some(mean), Some(max)), (Some(mean_after), Some(max_after))) = (from, to) {
                let plain = |value: &f64| Figure { value: *value, interval: None };
                row(page, &format!("along {name}, mean of absolute"), plain(mean), plain(mean_after));
                row(page, "  largest", plain(max), plain(max_after));
            }
        }
    }
    for (name, errors) in identified.errors() {
        let Some(errors) = errors else { continue };
        let figures = ["mean", "rms", "95 %", "max"].into_iter().zip(errors.figures());
        let intervals: Vec<String> =
            figures.filter_map(|(figure, of)| Some(format!("{figure} {}", of.interval_text()?))).collect();
        if !intervals.is_empty() {
            page.paragraph(&format!("{name} after, 95 % intervals: {}.", text::listed(&intervals)), Role::Plain);
        }
    }
    if orientations.is_some() {
        page.paragraph(&format!("{ORIENTATION_SENTENCE}."), Role::Dim);
    }
    if let Some(sentence) = verification.sample_sentence() {
        page.paragraph(&format!("{sentence}."), Role::Dim);
    }
    page.paragraph("before: nominal model; after: identified model. Distance errors need no frame.", Role::Dim);
}

/// Columns of the names of the errors. Where there is little room, the numbers take precedence.
fn names(page: &Page) -> usize {
    page.columns().saturating_sub(29).clamp(26, 32)
}

fn row(page: &mut Page, name: &str, before: Figure, after: Figure) {
    let ratio = before.value / after.value;
    let (better, role) = match ratio {
        ratio if !ratio.is_finite() => ("-".to_owned(), Role::Plain),
        ratio if ratio < 1.0 => ("WORSE".to_owned(), Role::Warn),
        ratio if ratio < 10.0 => (format!("{ratio:.1} x"), Role::Plain),
        ratio => (format!("{ratio:.0} x"), Role::Plain),
    };
    let names = names(page);
    let line = format!("{name:<names$}{:>10}{:>10}", before.text(), after.text());
    page.line(vec![(line, Role::Plain), (format!("{better:>9}"), role)]);
}

/// Mean error over the range of each joint.
pub(super) fn joints(content: &VerifyView, page: &mut Page) {
    let joints = content.verification.as_ref().map_or(&[][..], |verification| &verification.residual_by_joint);
    if joints.iter().all(|joint| joint.bins.is_empty()) {
        page.paragraph("There are no verification samples.", Role::Plain);
        return;
    }
    page.paragraph("Mean error of the identified arm (mm) over fifths of each joint's range. A pattern indicates an error that is not in the model, such as an eccentric gear or a flexible link.", Role::Plain);
    page.gap();
    page.line(vec![(
        format!(
            "{:<6}{:<18}{:>7}{:>7}{:>7}{:>7}{:>7}{:>7}",
            "joint", "range", "1/5", "2/5", "3/5", "4/5", "5/5", "share"
        ),
        Role::Dim,
    )]);
    for joint in joints {
        let Some(range) = joint.range() else { continue };
        let bins = joint.means(7);
        let (share, role) = joint.share().map_or_else(|| ("-".to_owned(), Role::Dim), |share| (share, Role::Warn));
        page.line(vec![(format!("{:<6}{range:<18}{bins}", joint.joint), Role::Plain), (format!("{share:>7}"), role)]);
    }
    page.gap();
    page.paragraph("share: part of the square error that depends on the joint, if chance does not explain it. A dash in a fifth: no verification pose there.", Role::Dim);
}
