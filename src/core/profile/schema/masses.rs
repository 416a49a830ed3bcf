//! Weight, mounting and payload of a profile.

use super::super::decode::{Fields, choice, direction, fields, not_negative, point, positive};
use super::super::diagnostic::{Findings, Span};
use super::super::masses::{Masses, Mounting};
use crate::kinematics::LinkMass;

/// A mass with its centre. The mass is required.
pub(super) fn mass(inside: &Fields<'_>, findings: &mut Findings<'_>) -> Option<LinkMass> {
    let mass = inside.require("mass_kg", "2.0", findings).and_then(|ast| not_negative(ast, findings));
    let centre = inside.require("centre_mm", "(0.0, 0.0, 50.0)", findings).and_then(|ast| point(ast, findings));
    Some(LinkMass { mass: mass?, centre: centre? })
}

/// Decodes the masses of the arm. `links` are those of the joints that have one.
pub(super) fn masses(
    top: &Fields<'_>,
    links: &[(Option<LinkMass>, Span)],
    findings: &mut Findings<'_>,
) -> Option<Masses> {
    let weight = top.get("weight_kg");
    let stated = links.iter().filter(|(mass, _)| mass.is_some()).count();
    match weight {
        Some(ast) if stated > 0 => {
            let message = "'weight_kg' is given beside the masses of the links";
            findings.error(ast.span, message, "keep one of them: 'mass_kg' of the joints says more".to_owned());
            None
        }
        Some(ast) => positive(ast, findings).map(Masses::Weight),
        None if stated == 0 => Some(Masses::Unknown),
        None => {
            for (_, span) in links.iter().filter(|(mass, _)| mass.is_none()) {
                let hint = "add 'mass_kg' and 'centre_mm', or 'mass_kg: 0.0, centre_mm: (0.0, 0.0, 0.0)'".to_owned();
                findings.warning(*span, "other links have a mass, this one is taken as weightless", hint);
            }
            Some(Masses::Links(links.iter().map(|(mass, _)| mass.unwrap_or_default()).collect()))
        }
    }
}

/// Decodes the mounting of the base.
pub(super) fn mounting(top: &Fields<'_>, findings: &mut Findings<'_>) -> Option<Mounting> {
    let choices = [("Floor", Mounting::Floor), ("Wall", Mounting::Wall), ("Ceiling", Mounting::Ceiling)];
    match (top.get("mounting"), top.get("gravity_in_base")) {
        (Some(_), Some(ast)) => {
            let hint = "keep one of them: Floor is (0.0, 0.0, -1.0), Wall (1.0, 0.0, 0.0), Ceiling (0.0, 0.0, 1.0)";
            findings.error(ast.span, "'gravity_in_base' is given beside 'mounting'", hint.to_owned());
            None
        }
        (Some(ast), None) => choice(ast, &choices, findings),
        (None, Some(ast)) => direction(ast, findings).map(Mounting::Gravity),
        (None, None) => Some(Mounting::default()),
    }
}

/// Decodes the payload; `None` if it is absent or invalid.
pub(super) fn payload(top: &Fields<'_>, findings: &mut Findings<'_>) -> Option<LinkMass> {
    let inside = fields(top.get("payload")?, "'payload'", &["mass_kg", "centre_mm"], findings)?;
    mass(&inside, findings)
}
