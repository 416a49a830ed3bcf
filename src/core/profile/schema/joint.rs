//! Joints of a profile.

use super::super::JointRange;
use super::super::decode::{Fields, choice, fields, list, number, number_map, positive, range, text};
use super::super::diagnostic::{Findings, Span};
use super::super::syntax::{Ast, shortened};
use super::masses;
use crate::kinematics::{Joint, JointType, Link, LinkMass};
use crate::text::near_miss;
use crate::units::Quantity;

const FIELDS: &[&str] = &[
    "name",
    "type",
    "alpha_deg",
    "a_mm",
    "d_mm",
    "theta_deg",
    "beta_deg",
    "direction",
    "coupling",
    "limits_deg",
    "limits_mm",
    "planning_limits_deg",
    "planning_limits_mm",
    "max_speed_deg_s",
    "max_speed_mm_s",
    "pulses_per_degree",
    "aliases",
    "mass_kg",
    "centre_mm",
];

/// A valid joint.
pub(super) struct DecodedJoint {
    pub(super) joint: Joint,
    pub(super) range: JointRange,
    /// Further names, as in common URDFs.
    pub(super) aliases: Vec<String>,
    pub(super) has_beta: bool,
    pub(super) mass: Option<LinkMass>,
    /// Span of its name, as the location of problems of the whole joint.
    pub(super) span: Span,
}

/// Properties of a joint that other parts of the file need, even if the joint is invalid.
#[derive(Clone, Copy, Debug)]
pub(super) struct JointShape {
    pub(super) has_beta: bool,
}

/// All joints of a profile.
pub(super) struct DecodedJoints {
    pub(super) shapes: Vec<JointShape>,
    /// `None` if one of them is invalid.
    pub(super) complete: Option<Vec<DecodedJoint>>,
}

pub(super) fn joints(ast: &Ast, findings: &mut Findings<'_>) -> Option<DecodedJoints> {
    let items = list(ast, "joints", findings)?;
    if items.is_empty() {
        findings.error(ast.span, "an arm needs at least one joint", "add the joints from base to flange".to_owned());
        return None;
    }
    // Decode the names first, because couplings may refer to later joints.
    let opened: Vec<Option<Fields<'_>>> = items.iter().map(|item| fields(item, "a joint", FIELDS, findings)).collect();
    let names = joint_names(&opened, findings);
    let mut shapes = Vec::new();
    let mut complete = Some(Vec::new());
    for (index, inside) in opened.iter().enumerate() {
        let Some(inside) = inside else {
            shapes.push(JointShape { has_beta: false });
            complete = None;
            continue;
        };
        let joint_type = inside.require("type", "Revolute", findings).and_then(|ast| {
            choice(ast, &[("Revolute", JointType::Revolute), ("Prismatic", JointType::Prismatic)], findings)
        });
        let has_beta = inside.get("beta_deg").is_some();
        shapes.push(JointShape { has_beta });
        let joint = joint(inside, index, joint_type, &names, findings);
        let has_mass = ["mass_kg", "centre_mm"].iter().any(|field| inside.get(field).is_some());
        let mass = if has_mass { masses::mass(inside, findings).map(Some) } else { Some(None) };
        match (joint, mass, &mut complete) {
            (Some((joint, range)), Some(mass), Some(complete)) => {
                let aliases = inside.get_or("aliases", Vec::new(), |ast| aliases(ast, findings)).unwrap_or_default();
                let span = inside.get("name").map_or_else(|| inside.start(), |name| name.span);
                complete.push(DecodedJoint { joint, range, aliases, has_beta, mass, span });
            }
            _ => complete = None,
        }
    }
    Some(DecodedJoints { shapes, complete })
}

/// Further names of a joint.
fn aliases(ast: &Ast, findings: &mut Findings<'_>) -> Option<Vec<String>> {
    list(ast, "aliases", findings)?.iter().map(|name| text(name, findings)).collect()
}

fn joint_names(joints: &[Option<Fields<'_>>], findings: &mut Findings<'_>) -> Vec<Option<String>> {
    let mut names: Vec<Option<String>> = Vec::new();
    for (index, joint) in joints.iter().enumerate() {
        let ast = joint.and_then(|inside| inside.require("name", &format!("\"J{}\"", index + 1), findings));
        let name = ast.and_then(|ast| text(ast, findings));
        if let (Some(ast), Some(name)) = (ast, &name)
            && let Some(earlier) = names.iter().position(|known| known.as_ref() == Some(name))
        {
            let message =
                format!("joint name '{}' is used twice: joints {} and {}", shortened(name), earlier + 1, index + 1);
            findings.error(ast.span, message, "give each joint the name it has on the pendant".to_owned());
        }
        names.push(name);
    }
    names
}

fn joint(
    inside: &Fields<'_>,
    index: usize,
    joint_type: Option<JointType>,
    names: &[Option<String>],
    findings: &mut Findings<'_>,
) -> Option<(Joint, JointRange)> {
    let mut constant = |field: &str, quantity: Quantity, required: bool| {
        let ast = if required { inside.require(field, "0.0", findings) } else { inside.get(field) };
        match ast {
            Some(ast) => number(ast, findings).map(|value| quantity.from_edge(value)),
            None => (!required).then_some(0.0),
        }
    };
    let alpha = constant("alpha_deg", Quantity::Angle, true);
    let a = constant("a_mm", Quantity::Length, true);
    let d = constant("d_mm", Quantity::Length, true);
    let theta = constant("theta_deg", Quantity::Angle, true);
    let beta = constant("beta_deg", Quantity::Angle, false);
    let direction = inside.get_or("direction", 1.0, |ast| direction(ast, findings));
    let coupling = inside.get_or("coupling", Vec::new(), |ast| coupling(ast, index, names, findings));
    let range = joint_type.and_then(|joint_type| joint_range(inside, joint_type, findings));
    let joint = Joint {
        name: names.get(index)?.clone()?,
        joint_type: joint_type?,
        link: Link { alpha: alpha?, a: a?, d: d?, theta: theta?, beta: beta? },
        direction: direction?,
        coupling: coupling?,
    };
    Some((joint, range?))
}

fn direction(ast: &Ast, findings: &mut Findings<'_>) -> Option<f64> {
    let value = number(ast, findings)?;
    if value.abs().to_bits() == 1.0_f64.to_bits() {
        return Some(value);
    }
    findings.error(ast.span, format!("direction {value} is not allowed"), "allowed: 1, -1".to_owned());
    None
}

/// Decodes a coupling into one coefficient per joint of the arm.
fn coupling(ast: &Ast, own: usize, names: &[Option<String>], findings: &mut Findings<'_>) -> Option<Vec<f64>> {
    let entries = number_map(ast, findings)?;
    let known: Vec<&str> = names.iter().flatten().map(String::as_str).collect();
    let mut row = vec![0.0; names.len()];
    let mut is_valid = true;
    for (name, span, value) in entries {
        let index = names.iter().position(|known| known.as_deref() == Some(name));
        match (index, number(value, findings)) {
            (Some(index), _) if index == own => {
                let hint = "name another joint; for the joint itself use 'direction'".to_owned();
                findings.error(span, format!("joint '{}' is coupled to itself", shortened(name)), hint);
                is_valid = false;
            }
            (Some(index), Some(value)) => {
                if let Some(entry) = row.get_mut(index) {
                    *entry = value;
                }
            }
            (None, _) => {
                let suggestion =
                    near_miss(name, &known).map_or_else(String::new, |near| format!("did you mean '{near}'? "));
                let hint = format!("{suggestion}joints: {}", known.join(", "));
                findings.error(span, format!("the arm has no joint '{}'", shortened(name)), hint);
                is_valid = false;
            }
            (Some(_), None) => is_valid = false,
        }
    }
    is_valid.then_some(row)
}

fn joint_range(inside: &Fields<'_>, joint_type: JointType, findings: &mut Findings<'_>) -> Option<JointRange> {
    let quantity = joint_type.quantity();
    let (kind, unit, other) = match joint_type {
        JointType::Revolute => ("revolute", "deg", "mm"),
        JointType::Prismatic => ("prismatic", "mm", "deg"),
    };
    let mut is_valid = true;
    for (field, suffix) in [("limits_", ""), ("planning_limits_", ""), ("max_speed_", "_s")] {
        let wrong = format!("{field}{other}{suffix}");
        if let Some(ast) = inside.get(&wrong) {
            let hint = format!("use '{field}{unit}{suffix}'");
            findings.error(ast.span, format!("a {kind} joint has no '{wrong}'"), hint);
            is_valid = false;
        }
    }
    let pulses = inside.get("pulses_per_degree");
    if let (JointType::Prismatic, Some(ast)) = (joint_type, pulses) {
        findings.error(ast.span, "a prismatic joint has no 'pulses_per_degree'", "remove it".to_owned());
    }
    let planning_field = format!("planning_limits_{unit}");
    let limits = inside.get_or(&format!("limits_{unit}"), None, |ast| range(ast, quantity, findings).map(Some));
    let planning = inside.get_or(&planning_field, None, |ast| range(ast, quantity, findings).map(Some));
    let max_speed = inside.get_or(&format!("max_speed_{unit}_s"), None, |ast| {
        positive(ast, findings).map(|speed| Some(quantity.from_edge(speed)))
    });
    let pulses_per_degree = inside.get_or("pulses_per_degree", None, |ast| {
        let value = number(ast, findings)?;
        if value == 0.0 {
            let hint = "pulses per degree are above 0, or below 0 for an encoder that counts down".to_owned();
            findings.error(ast.span, "0 pulses per degree are not allowed", hint);
        }
        Some(Some(value))
    });
    if let (Some(Some((low, high))), Some(Some((plan_low, plan_high))), Some(ast)) =
        (limits, planning, inside.get(&planning_field))
        && (plan_low < low || plan_high > high)
    {
        let [low, high] = [low, high].map(|limit| tidy(quantity.to_edge(limit)));
        findings.error(
            ast.span,
            format!("the planning limits reach beyond the joint limits ({low}, {high}) {unit}"),
            "planning limits can only narrow the joint limits".to_owned(),
        );
    }
    let limits = limits?;
    is_valid.then_some(JointRange {
        limits,
        planning_limits: planning?.or_else(|| Some(JointRange::usual_planning_limits(joint_type, limits?))),
        max_speed: max_speed?,
        pulses_per_degree: pulses_per_degree?,
    })
}

/// A limit as it was written, without the rounding error of the conversion.
fn tidy(value: f64) -> f64 {
    (value * 1e6).round() / 1e6
}
