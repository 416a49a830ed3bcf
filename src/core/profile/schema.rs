//! Schema 1 of profile files: the top level. Names carry units (mm, deg, mrad, um); unknown fields are errors.
//!
//! Required: `schema`, `name`, `title`, `source`, `convention`, `joints` with `name`, `type`, `alpha_deg`, `a_mm`, `d_mm`,
//! `theta_deg`. All other fields are optional:
//!
//! | field | default |
//! |---|---|
//! | `base`, `flange`: `(xyz_mm, rpy_deg)` | identity; roll, pitch, yaw about fixed axes as in URDF |
//! | `controller_world`: `(xyz_mm, rpy_deg)` | identity; the frame of the controller's Cartesian positions, in the base |
//! | joint `aliases` | none; further names, such as those of a URDF, for trajectories of ROS |
//! | joint `beta_deg` | the link has no β, and none is identified |
//! | joint `direction`, `coupling` | +1, none |
//! | joint `planning_limits_…` | the joint limits, of a revolute joint those within ±180° |
//! | `targets` | one target 'smr' at the flange origin, free (with a warning) |
//! | target `uncertainty_mm`, `axis_in_flange` | 50 mm; +z of the flange |
//! | joint `mass_kg`, `centre_mm` | no mass; both or none; the centre is in the frame at the end of the joint's link |
//! | `weight_kg` | no masses; the arm's weight as its maker states it, split over the links by their lengths |
//! | `payload`: `(mass_kg, centre_mm)` | nothing on the flange; the centre is in the flange frame |
//! | `mounting` | `Floor`; `Wall` (gravity along +x of the base), `Ceiling`, or `gravity_in_base: (x, y, z)` |
//! | `fixed`, `keep_out`, `bodies` | none |
//! | `expected_deviations` | 1 mm, α β 2 mrad, joint offset 10 mrad, prismatic offset 1 mm |
//! | `acceptance` | no limit |
//! | `instrument` | unknown; σ is estimated from the residuals |
//! | `link`: `(address, options, robot, robot_options, automatic)` | no proposal; the address is typed in the instrument step |
//! | `tracker` | at (3000, 0, 1000) mm, 30°, 500 to 20000 mm |
//! | `floor_mm` | 0 under an upright arm, otherwise no floor; `None`: no floor |

mod cell;
mod joint;
mod masses;
mod parameters;

use std::ops::Range;

use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};

use super::decode::{Fields, choice, direction, fields, list, not_negative, number, numbers, point, text};
use super::diagnostic::{Diagnostic, Findings, ProfileErrors, Span};
use super::syntax::{self, Ast};
use super::{FREE_TARGET_UNCERTAINTY, JointRange, Masses, Mounting, Profile, Target, check};
use crate::checksum::{self, Finding};
use crate::kinematics::{Convention, Joint, KinematicChain};
use crate::units::{from_deg, from_mm};
use joint::DecodedJoint;

/// Longest text of a profile (bytes): a hundred times the longest one that is shipped.
const LARGEST: usize = 1 << 20;
/// Longest title or source (characters).
const LONGEST_LINE: usize = 1000;

/// Schema version that this program reads and writes.
const SCHEMA: f64 = 1.0;

const FIELDS: &[&str] = &[
    "schema",
    "name",
    "title",
    "source",
    "convention",
    "base",
    "controller_world",
    "joints",
    "flange",
    "weight_kg",
    "payload",
    "mounting",
    "gravity_in_base",
    "targets",
    "fixed",
    "expected_deviations",
    "acceptance",
    "instrument",
    "link",
    "tracker",
    "bodies",
    "floor_mm",
    "keep_out",
];

/// See [`Profile::parse`].
pub(super) fn parse(text: &str, file_name: &str) -> Result<(Profile, Vec<Diagnostic>), ProfileErrors> {
    if text.len() > LARGEST {
        let mut findings = Findings::new("", file_name);
        let what = format!("the text has {} bytes; a profile has at most {LARGEST}", text.len());
        findings.error(Span { start: 0, end: 0 }, what, None);
        return Err(ProfileErrors { diagnostics: findings.into_diagnostics() });
    }
    let mut findings = Findings::new(text, file_name);
    let profile = syntax::parse(text, &mut findings).and_then(|tree| profile(&tree, &mut findings));
    if checksum::check(text) == Finding::Changed
        && let Some(Range { start, end }) = checksum::place(text)
    {
        let hint = "remove this line if the change was made on purpose";
        findings.warning(Span { start, end }, "the profile was changed after the program wrote it", hint.to_owned());
    }
    let failed = findings.has_errors();
    let diagnostics = findings.into_diagnostics();
    match profile {
        Some(profile) if !failed => Ok((profile, diagnostics)),
        _ => Err(ProfileErrors { diagnostics }),
    }
}

/// A text for people, one line.
fn line(ast: &Ast, findings: &mut Findings<'_>) -> Option<String> {
    let text = text(ast, findings)?;
    let characters = text.chars().count();
    if characters > LONGEST_LINE {
        findings.error(
            ast.span,
            format!("the text has {characters} characters, at most {LONGEST_LINE} are allowed"),
            None,
        );
        return None;
    }
    Some(text)
}

fn profile(tree: &Ast, findings: &mut Findings<'_>) -> Option<Profile> {
    let top = fields(tree, "the profile", FIELDS, findings)?;
    schema_number(&top, findings);
    let name = top.require("name", "\"my-robot\"", findings).and_then(|ast| short_name(ast, findings));
    let title = top.require("title", "\"Maker and type\"", findings).and_then(|ast| line(ast, findings));
    let source = top.require("source", "\"where the numbers come from\"", findings).and_then(|ast| line(ast, findings));
    let convention = top.require("convention", "Standard", findings).and_then(|ast| {
        let choices = [("Standard", Convention::Standard), ("Modified", Convention::Modified)];
        choice(ast, &choices, findings)
    });
    let base = top.get_or("base", Isometry3::identity(), |ast| pose(ast, "'base'", findings));
    let world = top.get_or("controller_world", Isometry3::identity(), |ast| pose(ast, "'controller_world'", findings));
    let flange = top.get_or("flange", Isometry3::identity(), |ast| pose(ast, "'flange'", findings));
    let joints = top
        .require("joints", "[(name: \"J1\", type: Revolute, ...), ...]", findings)
        .and_then(|ast| joint::joints(ast, findings));
    let targets = targets(&top, findings);
    let acceptance = cell::acceptance(&top, findings);
    let instrument = cell::instrument(&top, findings);
    let link = cell::link(&top, findings);
    let tracker = cell::tracker(&top, findings);
    let mounting = masses::mounting(&top, findings);
    let payload = masses::payload(&top, findings);
    let floor = floor(&top, mounting, findings);
    let keep_out = cell::keep_out(&top, findings);
    let known = joints.as_ref().map(|joints| joints.shapes.as_slice());
    let bodies = cell::bodies(&top, known.map(<[_]>::len), findings);
    let parameters = known.map(|joints| parameters::Known::new(joints, targets.as_deref().unwrap_or_default()));
    let fixed_parameters = parameters::fixed(&top, parameters.as_ref(), findings);
    let expected_deviations = parameters::expected_deviations(&top, parameters.as_ref(), findings);

    // All values are required from here on; missing ones were reported above.
    let decoded = joints?;
    let joints = decoded.complete?;
    let spans: Vec<_> = joints.iter().map(|joint| joint.span).collect();
    let links: Vec<_> = joints.iter().map(|joint| (joint.mass, joint.span)).collect();
    let masses = masses::masses(&top, &links, findings);
    let joint_aliases = joints.iter().map(|joint| joint.aliases.clone()).collect();
    let (chain_joints, joint_ranges, has_beta) = unzipped(joints);
    let chain = match KinematicChain::new(convention?, base?, chain_joints, flange?) {
        Ok(chain) => chain,
        Err(error) => {
            findings.error(top.start(), error.to_string(), None);
            return None;
        }
    };
    let beta_joints = (0..chain.dof()).filter(|&joint| has_beta.get(joint).copied().unwrap_or(false)).collect();
    let profile = Profile {
        name: name?,
        title: title?,
        source: source?,
        chain,
        masses: masses?,
        mounting: mounting?,
        payload,
        joints: joint_ranges,
        joint_aliases,
        base_from_world: world?,
        beta_joints,
        fixed_parameters: fixed_parameters?,
        targets: targets?,
        expected_deviations: expected_deviations?,
        acceptance: acceptance?,
        instrument,
        link,
        bodies: bodies?,
        floor,
        keep_out: keep_out?,
        tracker: tracker?,
    };
    check::check(&profile, &spans, findings);
    if let (Masses::Unknown, Some(ast)) = (&profile.masses, top.get("payload")) {
        let hint = "add 'weight_kg', or 'mass_kg' and 'centre_mm' of the joints".to_owned();
        findings.warning(ast.span, "the payload has no effect: the masses of the arm are not given", hint);
    }
    Some(profile.under_gravity())
}

fn unzipped(joints: Vec<DecodedJoint>) -> (Vec<Joint>, Vec<JointRange>, Vec<bool>) {
    let mut chain_joints = Vec::with_capacity(joints.len());
    let mut ranges = Vec::with_capacity(joints.len());
    let mut has_beta = Vec::with_capacity(joints.len());
    for DecodedJoint { joint, range, has_beta: beta, .. } in joints {
        chain_joints.push(joint);
        ranges.push(range);
        has_beta.push(beta);
    }
    (chain_joints, ranges, has_beta)
}

/// Decodes the height of the floor (m).
fn floor(top: &Fields<'_>, mounting: Option<Mounting>, findings: &mut Findings<'_>) -> Option<f64> {
    match top.get("floor_mm") {
        Some(ast) => number(ast, findings).map(from_mm),
        None if top.states("floor_mm") || mounting != Some(Mounting::Floor) => None,
        None => Some(0.0),
    }
}

fn schema_number(top: &Fields<'_>, findings: &mut Findings<'_>) {
    let Some(ast) = top.require("schema", "1", findings) else { return };
    let Some(schema) = number(ast, findings) else { return };
    if schema.to_bits() != SCHEMA.to_bits() {
        let hint = format!("this program reads schema {SCHEMA}");
        findings.error(ast.span, format!("schema {schema} is not known"), hint);
    }
}

/// Decodes a name that is suitable for command lines and file names.
fn short_name(ast: &Ast, findings: &mut Findings<'_>) -> Option<String> {
    let name = text(ast, findings)?;
    if name.chars().all(|c| c.is_ascii_lowercase() || c.is_ascii_digit() || matches!(c, '_' | '-')) {
        return Some(name);
    }
    let hint = "use lower-case letters, digits, '_' and '-'".to_owned();
    findings.error(ast.span, format!("'{}' cannot be the name of a profile", syntax::shortened(&name)), hint);
    None
}

/// Decodes `(xyz_mm: (…), rpy_deg: (…))` with fixed-axis roll, pitch, yaw as in URDF.
fn pose(ast: &Ast, what: &str, findings: &mut Findings<'_>) -> Option<Isometry3<f64>> {
    let inside = fields(ast, what, &["xyz_mm", "rpy_deg"], findings)?;
    let origin = inside.get_or("xyz_mm", Point3::origin(), |ast| point(ast, findings));
    let angles = inside.get_or("rpy_deg", [0.0; 3], |ast| numbers(ast, findings));
    let [roll, pitch, yaw] = angles?.map(from_deg);
    let rotation = UnitQuaternion::from_euler_angles(roll, pitch, yaw);
    Some(Isometry3::from_parts(Translation3::from(origin?), rotation))
}

fn targets(top: &Fields<'_>, findings: &mut Findings<'_>) -> Option<Vec<Target>> {
    let items = match top.get("targets") {
        Some(ast) => list(ast, "targets", findings)?,
        None => &[],
    };
    if items.is_empty() {
        let place = top.get("targets").map_or_else(|| top.start(), |ast| ast.span);
        findings.warning(
            place,
            "no target is given: one SMR is assumed within 50 mm of the flange origin",
            "add 'targets: [(name: \"smr\", position_mm: (0.0, 0.0, 50.0))]' with the position as mounted".to_owned(),
        );
        return Some(vec![Target::beside_the_flange("smr")]);
    }
    let mut targets: Vec<Option<Target>> = Vec::new();
    for item in items {
        let target = target(item, findings);
        if let Some(target) = &target
            && targets.iter().flatten().any(|earlier| earlier.name == target.name)
        {
            let hint = "give each target its own name".to_owned();
            findings.error(item.span, format!("two targets are called '{}'", target.name), hint);
        }
        targets.push(target);
    }
    targets.into_iter().collect()
}

fn target(ast: &Ast, findings: &mut Findings<'_>) -> Option<Target> {
    let inside = fields(ast, "a target", &["name", "position_mm", "uncertainty_mm", "axis_in_flange"], findings)?;
    let name = inside.require("name", "\"smr\"", findings).and_then(|ast| text(ast, findings));
    let position = inside.require("position_mm", "(0.0, 0.0, 50.0)", findings).and_then(|ast| point(ast, findings));
    let uncertainty =
        inside.get_or("uncertainty_mm", FREE_TARGET_UNCERTAINTY, |ast| not_negative(ast, findings).map(from_mm));
    let axis = inside.get_or("axis_in_flange", Vector3::z_axis(), |ast| direction(ast, findings));
    Some(Target { name: name?, position_in_flange: position?, uncertainty: uncertainty?, axis_in_flange: axis? })
}
