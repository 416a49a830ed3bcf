//! Samples that do not count, and decisions about the findings of the checks.

use super::FindingPart;
use crate::session::journal::correction_text;
use crate::session::state::{Refused, Sample, SampleState, Session};

/// Samples that do not count. Outliers of the identification are not among them: they count, and the identification says why it
/// excluded them.
pub(super) fn not_counted(session: &Session) -> Vec<Refused> {
    let without = session.samples.iter().filter(|sample| sample.state != SampleState::Counts);
    without
        .map(|sample| Refused {
            number: sample.noted.number,
            pose: session.pose_of(sample).to_owned(),
            reason: reason(session, sample),
        })
        .collect()
}

fn reason(session: &Session, sample: &Sample) -> String {
    let number = sample.noted.number;
    let about = session.samples.iter().flat_map(|holder| &holder.noted.findings).filter(|found| found.about == number);
    let found: Vec<&str> = about.map(|found| found.message.as_str()).collect();
    let found = if found.is_empty() { String::new() } else { format!(" ({})", found.join("; ")) };
    match sample.state {
        SampleState::Counts => String::new(),
        SampleState::Superseded => {
            let later = session.samples.iter().rfind(|other| other.row == sample.row && other.noted.number != number);
            let later = later.map_or_else(String::new, |later| format!(" as measurement {}", later.noted.number));
            format!("measured again{later}{found}")
        }
        SampleState::LeftOut => format!("excluded by the operator{found}"),
        SampleState::Undone => format!("undone by the operator{found}"),
    }
}

/// Corrections in words, with the points that were converted from the other unit because of them.
pub(super) fn corrections(session: &Session) -> Vec<String> {
    let corrected = session.corrections.iter().map(|corrected| correction_text(&corrected.correction));
    let in_other_unit = session.samples.chunk_by(|one, next| one.noted.factor == next.noted.factor);
    let in_other_unit = in_other_unit.filter_map(|samples| {
        let (first, last) = (&samples.first()?.noted, &samples.last()?.noted);
        let which = if first.number == last.number {
            format!("measurement {}", first.number)
        } else {
            format!("measurements {} to {}", first.number, last.number)
        };
        Some(format!("{which}, in the other unit like the one before: coordinates times {}", first.factor?))
    });
    corrected.chain(in_other_unit).collect()
}

/// Findings of the checks while measuring.
pub(super) fn findings(session: &Session) -> Vec<FindingPart> {
    let findings = session.samples.iter().flat_map(|holder| {
        let raised_at = holder.noted.number;
        holder.noted.findings.iter().map(move |finding| (raised_at, finding))
    });
    findings
        .map(|(raised_at, finding)| {
            let about = session.sample(finding.about);
            FindingPart {
                raised_at,
                about: finding.about,
                pose: about.map_or_else(String::new, |about| session.pose_of(about).to_owned()),
                cause: finding.cause,
                ratio: finding.ratio,
                message: finding.message.clone(),
                decision: about.map_or("", |about| decision(about, raised_at)).to_owned(),
            }
        })
        .collect()
}

const fn decision(about: &Sample, raised_at: u64) -> &'static str {
    match about.state {
        SampleState::Superseded => "measured again",
        SampleState::LeftOut => "excluded by the operator",
        SampleState::Undone => "undone by the operator",
        SampleState::Counts if about.settled >= raised_at => "set right, see the corrections",
        SampleState::Counts if about.kept => "kept by the operator",
        SampleState::Counts => "not decided: the sample counts as it is",
    }
}
