//! Instrument, link, acceptance limits, tracker, bodies and boxes of a profile.

use nalgebra::Point3;

use super::super::decode::{Fields, fields, flag, list, not_negative, number, numbers, point, positive, range, text};
use super::super::diagnostic::Findings;
use super::super::syntax::Ast;
use super::super::wire::{LinkSettings, WireAddress};
use super::super::{Acceptance, Capsule, Instrument, KeepOut, Tracker};
use crate::units::{MICROMETRE, MILLIMETRE, Quantity, from_deg, from_mm, to_mm};

/// Largest acceptance limit that can be meant (m).
const LARGEST_LIMIT: f64 = 100.0 * MILLIMETRE;

pub(super) fn acceptance(top: &Fields<'_>, findings: &mut Findings<'_>) -> Option<Acceptance> {
    const FIELDS: [&str; 6] = [
        "position_mean_mm",
        "position_rms_mm",
        "position_max_mm",
        "distance_mean_mm",
        "distance_rms_mm",
        "distance_max_mm",
    ];
    let Some(ast) = top.get("acceptance") else { return Some(Acceptance::default()) };
    let inside = fields(ast, "'acceptance'", &FIELDS, findings)?;
    let limits =
        FIELDS.map(|name| inside.get_or(name, None, |ast| positive(ast, findings).map(|limit| Some(from_mm(limit)))));
    let [position_mean, position_rms, position_max, distance_mean, distance_rms, distance_max] = limits;
    check_limits(ast, "position", [position_mean, position_rms, position_max].map(Option::flatten), findings);
    check_limits(ast, "distance", [distance_mean, distance_rms, distance_max].map(Option::flatten), findings);
    Some(Acceptance {
        position_mean: position_mean?,
        position_rms: position_rms?,
        position_max: position_max?,
        distance_mean: distance_mean?,
        distance_rms: distance_rms?,
        distance_max: distance_max?,
    })
}

/// Warns about limits of one error that cannot be meant.
fn check_limits(ast: &Ast, of: &str, [mean, rms, max]: [Option<f64>; 3], findings: &mut Findings<'_>) {
    let named = [("mean", mean), ("rms", rms), ("max", max)];
    let set: Vec<(&str, f64)> = named.into_iter().filter_map(|(name, limit)| Some((name, limit?))).collect();
    // The mean of an error is never above its rms, nor that above its maximum.
    for (lower, upper) in set.iter().zip(set.iter().skip(1)).filter(|(lower, upper)| lower.1 > upper.1) {
        let message = format!("'{of}_{}_mm' is above '{of}_{}_mm' and so never decides", lower.0, upper.0);
        findings.warning(ast.span, message, "are the two exchanged?".to_owned());
    }
    for (name, limit) in set.iter().filter(|(_, limit)| *limit > LARGEST_LIMIT) {
        let message = format!("'{of}_{name}_mm' is {} mm, which every arm meets", to_mm(*limit));
        findings.warning(ast.span, message, "limits are in mm".to_owned());
    }
}

/// Decodes the instrument; `None` if it is absent or invalid.
pub(super) fn instrument(top: &Fields<'_>, findings: &mut Findings<'_>) -> Option<Instrument> {
    let ast = top.get("instrument")?;
    let inside = fields(ast, "'instrument'", &["name", "sigma_um", "sigma_um_per_m"], findings)?;
    let name = inside.require("name", "\"maker and type\"", findings).and_then(|ast| text(ast, findings));
    let sigma = inside.require("sigma_um", "10.0", findings).and_then(|ast| positive(ast, findings));
    let per_metre = inside.get_or("sigma_um_per_m", 0.0, |ast| not_negative(ast, findings));
    Some(Instrument { name: name?, sigma: sigma? * MICROMETRE, sigma_per_metre: per_metre? * MICROMETRE })
}

/// Decodes the link; `None` if it is absent or invalid.
pub(super) fn link(top: &Fields<'_>, findings: &mut Findings<'_>) -> Option<LinkSettings> {
    let ast = top.get("link")?;
    let inside = fields(ast, "'link'", &["address", "options", "robot", "robot_options", "automatic"], findings)?;
    let address = inside
        .require("address", "\"emscon:192.168.0.2\"", findings)
        .and_then(|ast| wire_address(ast, false, findings));
    let options = inside.get_or("options", None, |ast| text(ast, findings).map(Some));
    let robot = inside.get_or("robot", None, |ast| wire_address(ast, true, findings).map(Some));
    let robot_options = inside.get_or("robot_options", None, |ast| text(ast, findings).map(Some));
    let automatic = inside.get_or("automatic", false, |ast| flag(ast, findings));
    Some(LinkSettings {
        address: address?,
        options: options?,
        robot: robot?,
        robot_options: robot_options?,
        is_automatic: automatic?,
    })
}

/// Decodes the address of an instrument or of a robot's controller.
fn wire_address(ast: &Ast, is_robot: bool, findings: &mut Findings<'_>) -> Option<WireAddress> {
    let hint = if is_robot { "write \"rtde:192.168.0.10\"" } else { "write \"emscon:192.168.0.2\", see docs/links.md" };
    let written = text(ast, findings)?;
    let address = if is_robot { WireAddress::of_robot(&written).or_else(|_| written.parse()) } else { written.parse() };
    let problem = match address {
        Ok(address) if address.protocol.is_robot() == is_robot => return Some(address),
        Ok(address) if is_robot => format!("{} is a protocol of instruments, not of robots", address.protocol),
        Ok(address) => format!("{} is a protocol of robots; it belongs in 'robot'", address.protocol),
        Err(problem) => problem,
    };
    findings.error(ast.span, problem, hint.to_owned());
    None
}

pub(super) fn tracker(top: &Fields<'_>, findings: &mut Findings<'_>) -> Option<Tracker> {
    let default = Tracker::default();
    let Some(ast) = top.get("tracker") else { return Some(default) };
    let inside = fields(ast, "'tracker'", &["position_mm", "acceptance_angle_deg", "range_mm"], findings)?;
    let position = inside.get_or("position_mm", default.position_in_base, |ast| point(ast, findings));
    let angle = inside.get_or("acceptance_angle_deg", default.acceptance_angle, |ast| {
        let angle = positive(ast, findings)?;
        if angle > 180.0 {
            let message = format!("{angle} deg is not an acceptance angle");
            findings.error(ast.span, message, "allowed: above 0, up to 180".to_owned());
        }
        Some(from_deg(angle))
    });
    let range = inside.get_or("range_mm", default.range, |ast| {
        let range = range(ast, Quantity::Length, findings)?;
        if range.0 < 0.0 {
            findings.error(ast.span, "a range cannot start below zero", "write (nearest, farthest)".to_owned());
        }
        Some(range)
    });
    Some(Tracker { position_in_base: position?, acceptance_angle: angle?, range: range? })
}

/// Decodes the bodies. `joints` is the number of joints, if it is known.
pub(super) fn bodies(top: &Fields<'_>, joints: Option<usize>, findings: &mut Findings<'_>) -> Option<Vec<Capsule>> {
    let Some(ast) = top.get("bodies") else { return Some(Vec::new()) };
    let items = list(ast, "bodies", findings)?;
    let bodies: Vec<Option<Capsule>> = items.iter().map(|item| body(item, joints, findings)).collect();
    bodies.into_iter().collect()
}

fn body(ast: &Ast, joints: Option<usize>, findings: &mut Findings<'_>) -> Option<Capsule> {
    let inside = fields(ast, "a body", &["link", "from_mm", "to_mm", "radius_mm"], findings)?;
    let link = inside.require("link", "1", findings).and_then(|ast| link_index(ast, joints, findings));
    let from = inside.require("from_mm", "(0.0, 0.0, 0.0)", findings).and_then(|ast| point(ast, findings));
    let to = inside.require("to_mm", "(0.0, 0.0, 0.0)", findings).and_then(|ast| point(ast, findings));
    let radius = inside.require("radius_mm", "50.0", findings).and_then(|ast| positive(ast, findings));
    Some(Capsule { link: link?, from: from?, to: to?, radius: from_mm(radius?) })
}

fn link_index(ast: &Ast, joints: Option<usize>, findings: &mut Findings<'_>) -> Option<usize> {
    let value = number(ast, findings)?;
    let last = joints.unwrap_or(usize::MAX);
    // Comparing with each index avoids rounding and overflow of a conversion, and arms are short.
    let index = (0..=last.min(64)).find(|index| (*index as f64).to_bits() == (value + 0.0).to_bits());
    if index.is_none() {
        let allowed = joints.map_or_else(|| "a whole number from 0".to_owned(), |last| format!("0 (base) to {last}"));
        findings.error(ast.span, format!("the arm has no link {value}"), format!("allowed: {allowed}"));
    }
    index
}

pub(super) fn keep_out(top: &Fields<'_>, findings: &mut Findings<'_>) -> Option<Vec<KeepOut>> {
    let Some(ast) = top.get("keep_out") else { return Some(Vec::new()) };
    let items = list(ast, "boxes", findings)?;
    let boxes: Vec<Option<KeepOut>> = items.iter().map(|item| keep_out_box(item, findings)).collect();
    boxes.into_iter().collect()
}

fn keep_out_box(ast: &Ast, findings: &mut Findings<'_>) -> Option<KeepOut> {
    let inside = fields(ast, "a box", &["name", "min_mm", "max_mm"], findings)?;
    let name = inside.require("name", "\"table\"", findings).and_then(|ast| text(ast, findings));
    let min = inside.require("min_mm", "(0.0, 0.0, 0.0)", findings).and_then(|ast| numbers::<3>(ast, findings));
    let max_ast = inside.require("max_mm", "(100.0, 100.0, 100.0)", findings);
    let max = max_ast.and_then(|ast| numbers::<3>(ast, findings));
    let (name, min, max) = (name?, min?, max?);
    for ((low, high), axis) in min.iter().zip(&max).zip(["x", "y", "z"]) {
        if low >= high
            && let Some(ast) = max_ast
        {
            let message = format!("box '{name}' is reversed in {axis}: {low} mm is not below {high} mm");
            findings.error(ast.span, message, "every coordinate of 'max_mm' must be above that of 'min_mm'".to_owned());
        }
    }
    Some(KeepOut { name, min: Point3::from(min.map(from_mm)), max: Point3::from(max.map(from_mm)) })
}
