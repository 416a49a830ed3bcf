//! Parameters named in a profile: fixed ones and expected deviations.

use super::super::decode::{Fields, fields, list, nearest, number_map, positive};
use super::super::diagnostic::{Findings, Span};
use super::super::syntax::{Node, shortened};
use super::super::{ExpectedDeviations, Target};
use super::joint::JointShape;
use crate::kinematics::{Axis, LinkParameter, ParameterId};
use crate::units::{MILLIMETRE, MILLIRADIAN, Quantity};

/// The parameters that an arm has, by printed name.
pub(super) struct Names {
    known: Vec<(String, ParameterId)>,
}

impl Names {
    pub(super) fn new(joints: &[JointShape], targets: &[Target]) -> Self {
        let links = joints.iter().enumerate().flat_map(|(joint, shape)| {
            LinkParameter::ALL
                .into_iter()
                .filter(|parameter| shape.has_beta || *parameter != LinkParameter::Beta)
                .map(move |parameter| ParameterId::Link { joint, parameter })
        });
        let targets = (0..targets.len()).flat_map(|target| Axis::ALL.map(|axis| ParameterId::Target { target, axis }));
        Self { known: links.chain(targets).map(|id| (id.to_string(), id)).collect() }
    }

    fn find(&self, name: &str, span: Span, findings: &mut Findings<'_>) -> Option<ParameterId> {
        let id = self.known.iter().find(|(known, _)| known == name).map(|(_, id)| *id);
        if id.is_none() {
            let names: Vec<&str> = self.known.iter().map(|(name, _)| name.as_str()).collect();
            let suggestion = nearest(name, &names).map_or_else(String::new, |near| format!("did you mean '{near}'? "));
            let hint = format!("{suggestion}allowed: {}", names.join(", "));
            findings.error(span, format!("the arm has no parameter '{}'", shortened(name)), hint);
        }
        id
    }
}

/// `fixed: ["d2", …]`. Without names (unreadable joints) nothing can be said.
pub(super) fn fixed(top: &Fields<'_>, names: Option<&Names>, findings: &mut Findings<'_>) -> Option<Vec<ParameterId>> {
    let Some(ast) = top.get("fixed") else { return Some(Vec::new()) };
    let items = list(ast, "parameter names", findings)?;
    let names = names?;
    let mut ids = Vec::new();
    let mut good = true;
    for item in items {
        let Node::Text(name) = &item.node else {
            let message = format!("expected the name of a parameter in \"quotes\", found {}", item.node.describe());
            findings.error(item.span, message, "for example \"d2\"".to_owned());
            good = false;
            continue;
        };
        match names.find(name, item.span, findings) {
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
    names: Option<&Names>,
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
    let own = [
        ("parameters_mm", Quantity::Length, MILLIMETRE, "parameters_mrad"),
        ("parameters_mrad", Quantity::Angle, MILLIRADIAN, "parameters_mm"),
    ];
    for (field, quantity, unit, other) in own {
        let Some(entries) = inside.get(field).map(|ast| number_map(ast, findings)) else { continue };
        let (Some(entries), Some(names)) = (entries, names) else {
            good = false;
            continue;
        };
        for (name, span, value) in entries {
            let id = names.find(name, span, findings);
            let value = positive(value, findings);
            match (id, value) {
                (Some(id), _) if id.quantity() != quantity => {
                    let hint = format!("move it to '{other}'");
                    findings.error(span, format!("'{name}' does not belong in '{field}'"), hint);
                    good = false;
                }
                (Some(id), Some(value)) => {
                    expected.overrides.insert(id, value * unit);
                }
                _ => good = false,
            }
        }
    }
    good.then_some(expected)
}
