//! Parameters named in a profile: fixed ones and expected deviations.

use super::super::decode::{Fields, fields, list, number_map, positive};
use super::super::diagnostic::{Findings, Span};
use super::super::syntax::{Node, shortened};
use super::super::{ExpectedDeviations, Target};
use super::joint::JointShape;
use crate::kinematics::{LinkParameter, ParameterId};
use crate::text::near_miss;
use crate::units::{MILLIMETRE, MILLIRADIAN};

/// The parameters that an arm has.
pub(super) struct Known {
    ids: Vec<ParameterId>,
}

impl Known {
    pub(super) fn new(joints: &[JointShape], targets: &[Target]) -> Self {
        let without_beta: Vec<ParameterId> = (joints.iter().enumerate())
            .filter(|(_, shape)| !shape.has_beta)
            .map(|(joint, _)| ParameterId::Link { joint, parameter: LinkParameter::Beta })
            .collect();
        let all = ParameterId::all(joints.len(), targets.len());
        Self { ids: all.filter(|id| !without_beta.contains(id)).collect() }
    }

    fn find(&self, name: &str, span: Span, findings: &mut Findings<'_>) -> Option<ParameterId> {
        let id = name.parse().ok().filter(|id| self.ids.contains(id));
        if id.is_none() {
            let names: Vec<String> = self.ids.iter().map(ToString::to_string).collect();
            let names: Vec<&str> = names.iter().map(String::as_str).collect();
            let suggestion =
                near_miss(name, &names).map_or_else(String::new, |near| format!("did you mean '{near}'? "));
            let hint = format!("{suggestion}allowed: {}", names.join(", "));
            findings.error(span, format!("the arm has no parameter '{}'", shortened(name)), hint);
        }
        id
    }
}

/// `fixed: ["d2", …]`. Without known parameters (unreadable joints) nothing can be said.
pub(super) fn fixed(top: &Fields<'_>, known: Option<&Known>, findings: &mut Findings<'_>) -> Option<Vec<ParameterId>> {
    let Some(ast) = top.get("fixed") else { return Some(Vec::new()) };
    let items = list(ast, "parameter names", findings)?;
    let known = known?;
    let mut ids = Vec::new();
    let mut good = true;
    for item in items {
        let Node::Text(name) = &item.node else {
            let message = format!("expected the name of a parameter in \"quotes\", found {}", item.node.describe());
            findings.error(item.span, message, "for example \"d2\"".to_owned());
            good = false;
            continue;
        };
        match known.find(name, item.span, findings) {
            Some(id) => ids.push(id),
            None => good = false,
        }
    }
    ids.sort_unstable();
    ids.dedup();
    good.then_some(ids)
}

pub(super) fn expected_deviations(
    top: &Fields<'_>,
    known: Option<&Known>,
    findings: &mut Findings<'_>,
) -> Option<ExpectedDeviations> {
    const FIELDS: &[&str] =
        &["length_mm", "angle_mrad", "joint_offset_mrad", "prismatic_offset_mm", "parameters_mm", "parameters_mrad"];
    let mut expected = ExpectedDeviations::default();
    let Some(ast) = top.get("expected_deviations") else { return Some(expected) };
    let inside = fields(ast, "'expected_deviations'", FIELDS, findings)?;
    let mut good = true;
    let general = [
        ("length_mm", MILLIMETRE, &mut expected.length),
        ("angle_mrad", MILLIRADIAN, &mut expected.angle),
        ("joint_offset_mrad", MILLIRADIAN, &mut expected.joint_offset),
        ("prismatic_offset_mm", MILLIMETRE, &mut expected.prismatic_offset),
    ];
    for (field, unit, slot) in general {
        if let Some(ast) = inside.get(field) {
            match positive(ast, findings) {
                Some(value) => *slot = value * unit,
                None => good = false,
            }
        }
    }
    for (field, size) in ExpectedDeviations::FIELDS {
        let Some(entries) = inside.get(field).map(|ast| number_map(ast, findings)) else { continue };
        let (Some(entries), Some(known)) = (entries, known) else {
            good = false;
            continue;
        };
        for (name, span, value) in entries {
            let id = known.find(name, span, findings);
            let value = positive(value, findings);
            match (id, value) {
                (Some(id), _) if ExpectedDeviations::field_of(id) != field => {
                    let hint = format!("move it to '{}'", ExpectedDeviations::field_of(id));
                    findings.error(span, format!("'{name}' does not belong in '{field}'"), hint);
                    good = false;
                }
                (Some(id), Some(value)) => {
                    expected.overrides.insert(id, value * size);
                }
                _ => good = false,
            }
        }
    }
    good.then_some(expected)
}
