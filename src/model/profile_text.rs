//! Writing profiles: the corrected one of a calibrated arm, and the first one of an arm from a URDF.

use nalgebra::{Isometry3, Point3, Vector3};

use super::transforms::{number, roll_pitch_yaw};
use crate::kinematics::{Convention, Joint, JointType, KinematicChain, LinkMass};
use crate::profile::{ExpectedDeviations, JointRange, Masses, Mounting, Profile, Target};
use crate::text::printable;
use crate::units::{MICROMETRE, MILLIRADIAN, Quantity, to_deg, to_mm};

/// The head of a profile: comments, names and source.
#[derive(Clone, Copy, Debug)]
pub struct Heading<'a> {
    /// Comment lines, without `//`.
    pub comments: &'a [String],
    /// Short name.
    pub name: &'a str,
    /// Title for people.
    pub title: &'a str,
    /// Where the numbers come from.
    pub source: &'a str,
}

/// The arm of a profile.
#[derive(Clone, Copy, Debug)]
pub struct Arm<'a> {
    pub chain: &'a KinematicChain,
    /// Limits and speeds, one entry per joint.
    pub ranges: &'a [JointRange],
    /// Joints whose link has a β.
    pub beta_joints: &'a [usize],
    /// Masses of the links.
    pub masses: &'a Masses,
}

/// A profile of an arm of which only geometry and limits are known. Everything else keeps its default, and comments in the text
/// list it.
pub fn geometry_only(heading: &Heading<'_>, arm: &Arm<'_>) -> String {
    let mut lines = Vec::new();
    head(&mut lines, heading, arm, &[]);
    for line in [
        "    // Not known from the geometry, to be filled in where the defaults do not fit:",
        "    // targets: the SMR on the flange; free within 50 mm of the flange origin as long as it is left out",
        "    // expected_deviations: 1 mm, 2 mrad, joint offsets 10 mrad",
        "    // acceptance: limits for the verification; none",
        "    // instrument: estimated from the residuals",
        "    // tracker: at (3000, 0, 1000) mm in the base, for planning only",
        "    // bodies, keep_out: only the joints and the SMR are kept above the floor, nothing else is checked for collisions",
        "    // floor_mm: at the height of the base",
        "    // payload, mounting: nothing on the flange, base on the floor",
    ] {
        lines.push(line.to_owned());
    }
    if *arm.masses == Masses::Unknown {
        lines.push("    // weight_kg, or mass_kg and centre_mm of the joints: without them nothing about gravity is identified".to_owned());
    }
    finished(lines)
}

/// The profile with another arm and other targets; everything else but the comments is kept.
pub fn complete(heading: &Heading<'_>, profile: &Profile, chain: &KinematicChain, targets: &[Target]) -> String {
    let mut lines = Vec::new();
    let arm = Arm { chain, ranges: profile.joints(), beta_joints: profile.beta_joints(), masses: profile.masses() };
    head(&mut lines, heading, &arm, profile.joint_aliases());
    lines.extend(gravity_lines(profile));
    lines.push("    targets: [".to_owned());
    for target in targets {
        let axis = target.axis_in_flange.into_inner();
        let axis = if (axis - Vector3::z()).norm() < 1e-12 {
            String::new()
        } else {
            format!(", axis_in_flange: {}", triple(axis.into()))
        };
        lines.push(format!(
            "        (name: {}, position_mm: {}, uncertainty_mm: {}{axis}),",
            quoted(&target.name),
            point(&target.position_in_flange),
            number(to_mm(target.uncertainty))
        ));
    }
    lines.push("    ],".to_owned());
    let fixed: Vec<String> = profile.fixed_parameters().iter().map(|id| quoted(&id.to_string())).collect();
    if !fixed.is_empty() {
        lines.push(format!("    fixed: [{}],", fixed.join(", ")));
    }
    lines.push(expected(profile.expected_deviations()));
    rest(&mut lines, profile);
    finished(lines)
}

fn rest(lines: &mut Vec<String>, profile: &Profile) {
    let acceptance = profile.acceptance();
    let limits: Vec<String> = [
        ("position_mean_mm", acceptance.position_mean),
        ("position_rms_mm", acceptance.position_rms),
        ("position_max_mm", acceptance.position_max),
        ("distance_mean_mm", acceptance.distance_mean),
        ("distance_rms_mm", acceptance.distance_rms),
        ("distance_max_mm", acceptance.distance_max),
    ]
    .into_iter()
    .filter_map(|(name, limit)| Some(format!("{name}: {}", number(to_mm(limit?)))))
    .collect();
    if !limits.is_empty() {
        lines.push(format!("    acceptance: ({}),", limits.join(", ")));
    }
    if let Some(instrument) = profile.instrument() {
        lines.push(format!(
            "    instrument: (name: {}, sigma_um: {}, sigma_um_per_m: {}),",
            quoted(&instrument.name),
            number(instrument.sigma / MICROMETRE),
            number(instrument.sigma_per_metre / MICROMETRE)
        ));
    }
    let tracker = profile.tracker();
    lines.push(format!(
        "    tracker: (position_mm: {}, acceptance_angle_deg: {}, range_mm: ({}, {})),",
        point(&tracker.position_in_base),
        number(to_deg(tracker.acceptance_angle)),
        number(to_mm(tracker.range.0)),
        number(to_mm(tracker.range.1))
    ));
    let floor = profile.floor().map_or_else(|| "None".to_owned(), |floor| number(to_mm(floor)));
    lines.push(format!("    floor_mm: {floor},"));
    if !profile.bodies().is_empty() {
        lines.push("    bodies: [".to_owned());
        lines.extend(profile.bodies().iter().map(|body| {
            format!(
                "        (link: {}, from_mm: {}, to_mm: {}, radius_mm: {}),",
                body.link,
                point(&body.from),
                point(&body.to),
                number(to_mm(body.radius))
            )
        }));
        lines.push("    ],".to_owned());
    }
    if !profile.keep_out().is_empty() {
        lines.push("    keep_out: [".to_owned());
        lines.extend(profile.keep_out().iter().map(|zone| {
            format!(
                "        (name: {}, min_mm: {}, max_mm: {}),",
                quoted(&zone.name),
                point(&zone.min),
                point(&zone.max)
            )
        }));
        lines.push("    ],".to_owned());
    }
}

fn head(lines: &mut Vec<String>, heading: &Heading<'_>, arm: &Arm<'_>, aliases: &[Vec<String>]) {
    lines.extend(heading.comments.iter().map(|line| format!("// {}", printable(line))));
    let convention = match arm.chain.convention() {
        Convention::Standard => "Standard",
        Convention::Modified => "Modified",
    };
    lines.push("(".to_owned());
    lines.push("    schema: 1,".to_owned());
    lines.push(format!("    name: {},", quoted(&short_name(heading.name))));
    lines.push(format!("    title: {},", quoted(heading.title)));
    lines.push(format!("    source: {},", quoted(heading.source)));
    lines.push(format!("    convention: {convention},"));
    lines.extend(pose("base", arm.chain.base()));
    lines.push("    joints: [".to_owned());
    for (index, joint) in arm.chain.joints().iter().enumerate() {
        let range = arm.ranges.get(index).copied().unwrap_or_default();
        let mass = match arm.masses {
            Masses::Links(links) => links.get(index),
            Masses::Weight(_) | Masses::Unknown => None,
        };
        let aliases = aliases.get(index).map_or(&[][..], Vec::as_slice);
        lines.extend(joint_lines(joint, &range, mass, arm.beta_joints.contains(&index), arm.chain, aliases));
    }
    lines.push("    ],".to_owned());
    lines.extend(pose("flange", arm.chain.flange()));
}

/// Weight, payload and mounting, where they differ from the defaults.
fn gravity_lines(profile: &Profile) -> Vec<String> {
    let mut lines = Vec::new();
    if let Masses::Weight(weight) = profile.masses() {
        lines.push(format!("    weight_kg: {},", number(*weight)));
    }
    lines.extend(profile.payload().map(|payload| format!("    payload: ({}),", mass_fields(&payload))));
    match profile.mounting() {
        Mounting::Floor => {}
        Mounting::Wall => lines.push("    mounting: Wall,".to_owned()),
        Mounting::Ceiling => lines.push("    mounting: Ceiling,".to_owned()),
        Mounting::Gravity(direction) => {
            lines.push(format!("    gravity_in_base: {},", triple(direction.into_inner().into())));
        }
    }
    lines
}

fn mass_fields(mass: &LinkMass) -> String {
    format!("mass_kg: {}, centre_mm: {}", number(mass.mass), point(&mass.centre))
}

fn joint_lines(
    joint: &Joint,
    range: &JointRange,
    mass: Option<&LinkMass>,
    has_beta: bool,
    chain: &KinematicChain,
    aliases: &[String],
) -> Vec<String> {
    let link = joint.link;
    let (joint_type, unit) = match joint.joint_type {
        JointType::Revolute => ("Revolute", "deg"),
        JointType::Prismatic => ("Prismatic", "mm"),
    };
    let mut first = format!(
        "        (name: {}, type: {joint_type}, alpha_deg: {}, a_mm: {}, d_mm: {}, theta_deg: {}",
        quoted(&joint.name),
        number(to_deg(link.alpha)),
        number(to_mm(link.a)),
        number(to_mm(link.d)),
        number(to_deg(link.theta))
    );
    let mut add = |text: String| first.push_str(&text);
    if has_beta || link.beta != 0.0 {
        add(format!(", beta_deg: {}", number(to_deg(link.beta))));
    }
    if joint.direction < 0.0 {
        add(", direction: -1".to_owned());
    }
    let coupled: Vec<String> = chain
        .joints()
        .iter()
        .zip(&joint.coupling)
        .filter(|(_, coefficient)| **coefficient != 0.0)
        .map(|(other, coefficient)| format!("{}: {}", quoted(&other.name), number(*coefficient)))
        .collect();
    if !coupled.is_empty() {
        add(format!(", coupling: {{{}}}", coupled.join(", ")));
    }
    let quantity = joint.joint_type.quantity();
    let mut second = Vec::new();
    let mut interval = |field: &str, limits: Option<(f64, f64)>| {
        if let Some((low, high)) = limits {
            second.push(format!("{field}_{unit}: ({}, {})", edge(quantity, low), edge(quantity, high)));
        }
    };
    interval("limits", range.limits);
    let usual = range.limits.map(|limits| JointRange::usual_planning_limits(joint.joint_type, limits));
    interval("planning_limits", range.planning_limits.filter(|planning| Some(*planning) != usual));
    second.extend(range.max_speed.map(|speed| format!("max_speed_{unit}_s: {}", edge(quantity, speed))));
    second.extend(range.pulses_per_degree.map(|pulses| format!("pulses_per_degree: {}", number(pulses))));
    if !aliases.is_empty() {
        let names: Vec<String> = aliases.iter().map(|name| quoted(name)).collect();
        second.push(format!("aliases: [{}]", names.join(", ")));
    }
    let more = [second.join(", "), mass.map(mass_fields).unwrap_or_default()];
    let more = more.into_iter().filter(|fields| !fields.is_empty()).map(|fields| format!("            {fields}"));
    let fields: Vec<String> = std::iter::once(first).chain(more).collect();
    format!("{}),", fields.join(",\n")).lines().map(str::to_owned).collect()
}

/// A limit with the digits that makers give: without the last bits of the conversion.
fn edge(quantity: Quantity, value: f64) -> String {
    number((quantity.to_edge(value) * 1e9).round() / 1e9)
}

fn expected(deviations: &ExpectedDeviations) -> String {
    let mut fields = vec![
        format!("length_mm: {}", number(to_mm(deviations.length))),
        format!("angle_mrad: {}", number(deviations.angle / MILLIRADIAN)),
        format!("joint_offset_mrad: {}", number(deviations.joint_offset / MILLIRADIAN)),
        format!("prismatic_offset_mm: {}", number(to_mm(deviations.prismatic_offset))),
    ];
    for (field, size) in ExpectedDeviations::FIELDS {
        let own: Vec<String> = deviations
            .overrides
            .iter()
            .filter(|(id, _)| ExpectedDeviations::field_of(**id) == field)
            .map(|(id, value)| format!("{}: {}", quoted(&id.to_string()), number(value / size)))
            .collect();
        if !own.is_empty() {
            fields.push(format!("{field}: {{{}}}", own.join(", ")));
        }
    }
    format!("    expected_deviations: ({}),", fields.join(", "))
}

fn pose(field: &str, pose: &Isometry3<f64>) -> Option<String> {
    (*pose != Isometry3::identity()).then(|| {
        format!(
            "    {field}: (xyz_mm: {}, rpy_deg: {}),",
            triple(pose.translation.vector.map(to_mm).into()),
            triple(roll_pitch_yaw(&pose.rotation).map(to_deg))
        )
    })
}

fn point(point: &Point3<f64>) -> String {
    triple(point.coords.map(to_mm).into())
}

fn triple([x, y, z]: [f64; 3]) -> String {
    format!("({}, {}, {})", number(x), number(y), number(z))
}

fn finished(mut lines: Vec<String>) -> String {
    lines.push(")".to_owned());
    lines.join("\n") + "\n"
}

/// A text in quotation marks; characters that would need an escape sequence are replaced.
fn quoted(text: &str) -> String {
    let clean: String = printable(text).chars().map(|c| if matches!(c, '"' | '\\') { '\'' } else { c }).collect();
    let clean = clean.trim();
    format!("\"{}\"", if clean.is_empty() { "-" } else { clean })
}

/// A name that a profile may have.
fn short_name(text: &str) -> String {
    let clean: String = text
        .to_lowercase()
        .chars()
        .map(|c| if c.is_ascii_lowercase() || c.is_ascii_digit() || matches!(c, '_' | '-') { c } else { '_' })
        .collect();
    if clean.is_empty() { "robot".to_owned() } else { clean }
}
