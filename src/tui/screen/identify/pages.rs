//! Pages of the identification.

use crate::identification::{SigmaSource, TerminationReason};
use crate::session::joint_errors::shares_sentence;
use crate::session::summary::{IdentificationSummary, ParameterSummary};
use crate::text::{counted, counted_as, decimals_for, fixed};
use crate::tui::screen::page::Page;
use crate::tui::theme::Role;
use crate::wizard::view::IdentifyView;

/// Standard deviation, as a share of the expected deviation, above which a parameter is only weakly determined.
const WEAK: f64 = 0.5;

/// The page before the identification.
pub(super) fn before(content: &IdentifyView, is_busy: bool, page: &mut Page) {
    page.pair("samples", &format!("{} to identify from", counted(content.samples, "pose")));
    page.gap();
    page.title("What is identified");
    page.marked(
        ("- ", Role::Dim),
        "the constants of every link: lengths, offsets and angles as the profile frees them",
        Role::Plain,
    );
    page.marked(
        ("- ", Role::Dim),
        "errors of the joints, gears and bearings, as far as the samples support them",
        Role::Plain,
    );
    page.marked(
        ("- ", Role::Dim),
        "the position of the tracker, and of the SMR as chosen in the step Target",
        Role::Plain,
    );
    page.gap();
    page.paragraph(
        "Samples that contradict all others are detected, reported and excluded. The verification poses are not used here.",
        Role::Plain,
    );
    page.gap();
    let text =
        if is_busy { "This takes a few seconds. Esc cancels." } else { "Enter starts it; it takes a few seconds." };
    page.paragraph(text, Role::Hint);
}

/// The warnings, then the basis of the result.
pub(super) fn result(content: &IdentifyView, summary: &IdentificationSummary, page: &mut Page) {
    if !content.is_current {
        page.marked(
            ("OUT OF DATE: ", Role::Warn),
            "the samples have changed since then; press i to identify again.",
            Role::Plain,
        );
    }
    if !content.is_usable {
        page.marked(
            ("NOT USABLE: ", Role::Alarm),
            "there is no solution that can be applied; see the warnings.",
            Role::Plain,
        );
    } else if content.is_current && !summary.warnings.is_empty() {
        let blocks = summary.warnings.iter().filter(|warning| warning.blocks_acceptance).count();
        let said = match blocks {
            0 => "the arm is identified, with remarks.".to_owned(),
            some => format!(
                "the arm is identified, but {} the result from being accepted.",
                counted_as(some, "warning keeps", "warnings keep")
            ),
        };
        let mark = if blocks == 0 { ("GOOD: ", Role::Ok) } else { ("CHECK: ", Role::Warn) };
        page.marked(mark, &said, Role::Plain);
    }
    for warning in &summary.warnings {
        let mark = if warning.blocks_acceptance { ("WARNING ", Role::Warn) } else { ("note    ", Role::Title) };
        page.marked(mark, &warning.message, Role::Plain);
    }
    if summary.warnings.is_empty() && content.is_current && content.is_usable {
        let used = counted(summary.samples.saturating_sub(summary.rejected.len()), "measurement");
        page.marked(("GOOD: ", Role::Ok), &format!("{used} agree with one model of the arm."), Role::Plain);
    }
    page.gap();
    let rejected = match summary.rejected.len() {
        0 => "none rejected".to_owned(),
        some => format!("{some} REJECTED, see page 4"),
    };
    page.pair("samples", &format!("{} ({rejected})", summary.samples));
    let constants = summary.constants().count();
    let tied = summary.constants().filter(|parameter| !parameter.identifiable).count();
    let weak = summary.constants().filter(|parameter| found(parameter) == "weakly").count();
    let alone = constants.saturating_sub(tied + weak);
    page.pair("parameters", &format!("{constants}: {alone} found, {weak} weakly, {tied} only combined"));
    if let Some(selection) = &summary.selection {
        page.pair("causes", &format!("{}; see page 3", shares_sentence(selection)));
    }
    page.gap();
    page.paragraph(
        "The next step shows how accurate the arm is, at poses that the identification did not use. Page 2 has the mathematics.",
        Role::Dim,
    );
}

/// Figures for those who know the method.
fn figures(summary: &IdentificationSummary, page: &mut Page) {
    let constants = summary.constants().count();
    let rank = summary.rank.map_or_else(
        || "not clear from these samples".to_owned(),
        |rank| format!("{rank} of {constants} combinations are determined"),
    );
    page.pair("rank", &rank);
    if let Some(condition) = summary.condition_number {
        let raw = summary
            .condition_number_mm_rad
            .map_or_else(String::new, |raw| format!("; {} in mm and rad", fixed(raw, 0)));
        page.pair("condition", &format!("{} in expected deviations{raw}", fixed(condition, 1)));
    }
    let source = match summary.sigma.source {
        SigmaSource::Readings => "given with the readings",
        SigmaSource::Option => "given on the command line",
        SigmaSource::Instrument => "from the profile's instrument",
        SigmaSource::Residuals => "estimated from the residuals",
        SigmaSource::Assumed => "ASSUMED, too few data to estimate it",
    };
    page.pair("sigma", &format!("{} mm per coordinate, {source}", fixed(summary.sigma.stated_mm(), 4)));
    if let Some(said) = summary.sigma.from_residuals_mm.filter(|_| summary.sigma.source != SigmaSource::Residuals) {
        page.pair("", &format!("{} mm from the residuals", fixed(said, 4)));
    }
    let ended = match summary.termination {
        TerminationReason::Converged => "converged",
        TerminationReason::IterationLimit => "STOPPED at the iteration limit",
        TerminationReason::NoImprovement => "no further improvement",
        TerminationReason::NonFinite => "FAILED: numbers that are not finite",
    };
    page.pair("solver", &format!("{ended} after {}", counted(summary.iterations.len(), "step")));
}

/// How well a parameter is determined.
fn found(parameter: &ParameterSummary) -> &'static str {
    if !parameter.identifiable {
        "only combined"
    } else if parameter.sigma.is_none_or(|sigma| sigma > WEAK * parameter.expected) {
        "weakly"
    } else {
        "yes"
    }
}

/// The mathematics of the result, and the table of parameters.
pub(super) fn parameters(summary: &IdentificationSummary, page: &mut Page) {
    figures(summary, page);
    page.gap();
    let head =
        format!("{:<10}{:>4}{:>12}{:>12}{:>11}  {}", "parameter", "unit", "nominal", "deviation", "sigma", "found");
    page.line(vec![(head, Role::Dim)]);
    for parameter in summary.constants() {
        let decimals = parameter.sigma.map_or(4, decimals_for);
        let sigma = parameter.sigma.map_or_else(|| "-".to_owned(), |sigma| fixed(sigma, decimals));
        let found = found(parameter);
        let line = format!(
            "{:<10}{:>4}{:>12}{:>12}{sigma:>11}  ",
            parameter.id,
            parameter.unit,
            fixed(parameter.nominal, 4),
            fixed(parameter.deviation, decimals),
        );
        let role = match found {
            "yes" => Role::Ok,
            "weakly" => Role::Warn,
            _ => Role::Dim,
        };
        page.line(vec![(line, Role::Plain), (found.to_owned(), role)]);
    }
    page.gap();
    page.paragraph("deviation: identified minus nominal. sigma: its standard deviation. weakly: sigma above half of the deviation expected before measuring. only combined: see page 4.", Role::Dim);
}

/// Rejected samples, and what the data cannot determine.
pub(super) fn limits(summary: &IdentificationSummary, page: &mut Page) {
    page.title(&format!("Rejected samples: {} of {}", summary.rejected.len(), summary.samples));
    for rejected in &summary.rejected {
        let off = fixed(rejected.residual_mm, 3);
        page.marked(
            ("- ", Role::Warn),
            &format!("pose {}: {off} mm off, {}", rejected.pose, rejected.reason),
            Role::Plain,
        );
    }
    page.title("What these samples cannot determine");
    if summary.blind_groups.is_empty() {
        page.paragraph("nothing: every parameter is determined individually", Role::Plain);
    }
    for group in &summary.blind_groups {
        page.marked(("- ", Role::Dim), &group.description, Role::Plain);
    }
    if !summary.correlations.is_empty() {
        page.title("Strongly correlated (hard to separate)");
        for pair in &summary.correlations {
            let [first, second] = &pair.parameters;
            page.line(vec![(format!("- {first} and {second}: {:+.2}", pair.correlation), Role::Plain)]);
        }
    }
}
