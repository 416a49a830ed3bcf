//! Profiles as text of at most 80 columns, for `profile list`, `profile show` and `profile check`.
//!
//! Degrees and millimetres, as in the file. Every text ends with a line break.

use super::diagnostic::joined;
use super::{Diagnostic, Gap, JointRange, Level, Masses, Mounting, PARALLEL_TOLERANCE, Profile, ProfileErrors};
use crate::kinematics::{Convention, Joint, JointType, LinkMass, Loads};
use crate::text::{counted, counted_as, printable, shortened, wrapped};
use crate::units::{Quantity, to_deg, to_mm};

/// Widest line (characters).
const WIDTH: usize = 80;

/// A table of profiles: name, number of joints, title.
pub fn list_text<'p>(profiles: impl IntoIterator<Item = &'p Profile>) -> String {
    let profiles: Vec<&Profile> = profiles.into_iter().collect();
    let width = profiles.iter().map(|profile| profile.name().chars().count()).max().unwrap_or(0).max(4);
    let mut lines = vec![format!("{:width$}  joints  robot", "name")];
    for profile in profiles {
        let line = format!("{:width$}  {:>6}  {}", profile.name(), profile.chain().dof(), profile.title());
        lines.push(clipped(&line));
    }
    finished(&lines)
}

/// All values of a profile that identification and planning use.
pub fn show_text(profile: &Profile) -> String {
    let mut lines = wrapped(&format!("{}: {}", profile.name(), profile.title()), WIDTH);
    lines.extend(wrapped(&format!("source: {}", profile.source()), WIDTH));
    lines.push(String::new());
    lines.extend(geometry_lines(profile));
    lines.push(String::new());
    lines.extend(range_lines(profile));
    lines.push(String::new());
    lines.extend(target_lines(profile));
    lines.push(String::new());
    lines.extend(mass_lines(profile));
    lines.push(String::new());
    lines.extend(parameter_lines(profile));
    lines.push(String::new());
    lines.extend(cell_lines(profile));
    finished(&lines)
}

/// The result of reading a profile: its problems, and a final line that counts them.
pub fn check_text(file_name: &str, outcome: &Result<(Profile, Vec<Diagnostic>), ProfileErrors>) -> String {
    let (diagnostics, errors, verdict) = match outcome {
        Ok((profile, warnings)) => (warnings, 0, format!("profile '{}' can be used", profile.name())),
        Err(errors) => (&errors.diagnostics, errors.error_count(), "the profile cannot be used".to_owned()),
    };
    let file = printable(file_name);
    let gaps = outcome.as_ref().map(|(profile, _)| profile.gaps()).unwrap_or_default();
    let mut text = joined(diagnostics);
    if !diagnostics.is_empty() {
        text.push_str("\n\n");
    }
    for Gap { message, hint } in &gaps {
        let lines = wrapped(&format!("{file}: warning: {message}"), WIDTH).into_iter();
        let hint = wrapped(&format!("hint: {hint}"), WIDTH - 2).into_iter().map(|line| format!("  {line}"));
        text.push_str(&finished(&lines.chain(hint).chain([String::new()]).collect::<Vec<_>>()));
    }
    let warnings = diagnostics.len() - errors + gaps.len();
    let (errors, warnings) = (counted(errors, "error"), counted(warnings, "warning"));
    format!("{text}{file}: {verdict}: {errors}, {warnings}\n")
}

fn geometry_lines(profile: &Profile) -> Vec<String> {
    let chain = profile.chain();
    let column = name_column(profile);
    let (convention, product) = match chain.convention() {
        Convention::Standard => ("standard", "Rot(z,theta) Trans(z,d) Trans(x,a) Rot(x,alpha) Rot(y,beta)"),
        Convention::Modified => ("modified (Craig)", "Rot(x,alpha) Trans(x,a) Rot(y,beta) Rot(z,theta) Trans(z,d)"),
    };
    let mut lines = vec![format!("nominal geometry, {convention} convention:"), format!("  {product}")];
    lines.push(format!(
        "{:<column$}{:<10}{:>10}{:>11}{:>11}{:>11}{:>10}",
        "joint", "type", "alpha deg", "a mm", "d mm", "theta deg", "beta deg"
    ));
    for (index, joint) in chain.joints().iter().enumerate() {
        let link = joint.link;
        let beta = if profile.beta_joints().contains(&index) { fixed(to_deg(link.beta), 3) } else { "-".to_owned() };
        lines.push(clipped(&format!(
            "{:<column$}{:<10}{:>10}{:>11}{:>11}{:>11}{beta:>10}",
            name_in(joint, column),
            type_name(joint.joint_type),
            fixed(to_deg(link.alpha), 3),
            fixed(to_mm(link.a), 3),
            fixed(to_mm(link.d), 3),
            fixed(to_deg(link.theta), 3),
        )));
    }
    for joint in chain.joints() {
        let coupled: String = joint
            .coupling
            .iter()
            .zip(chain.joints())
            .filter(|(coefficient, _)| **coefficient != 0.0)
            .map(|(coefficient, other)| {
                let sign = if *coefficient < 0.0 { "-" } else { "+" };
                format!(" {sign} {} x {}", coefficient.abs(), other.name)
            })
            .collect::<Vec<_>>()
            .concat();
        let sense = if joint.direction < 0.0 { "-" } else { "" };
        if !coupled.is_empty() {
            lines.push(clipped(&format!("{0} in the chain = {sense}({0}{coupled}) of the pendant", joint.name)));
        } else if joint.direction < 0.0 {
            lines.push(clipped(&format!("{0} in the chain = -{0} of the pendant", joint.name)));
        }
    }
    let parallel: Vec<String> = chain
        .parallel_axes(PARALLEL_TOLERANCE)
        .into_iter()
        .filter_map(|first| {
            Some(format!("{} and {}", chain.joints().get(first)?.name, chain.joints().get(first + 1)?.name))
        })
        .collect();
    let parallel = if parallel.is_empty() { "none".to_owned() } else { parallel.join(", ") };
    lines.extend(wrapped(&format!("parallel neighbouring axes: {parallel}"), WIDTH));
    lines
}

fn range_lines(profile: &Profile) -> Vec<String> {
    let column = name_column(profile);
    let mut lines =
        vec![format!("{:<column$}{:<5}{:>22}{:>22}{:>14}", "joint", "unit", "limits", "for planning", "speed /s")];
    for (joint, range) in profile.chain().joints().iter().zip(profile.joints()) {
        lines.push(clipped(&range_line(joint, range, column)));
    }
    lines
}

fn range_line(joint: &Joint, range: &JointRange, column: usize) -> String {
    let quantity = joint.joint_type.quantity();
    let speed = range.max_speed.map_or_else(|| "-".to_owned(), |speed| fixed(quantity.to_edge(speed), 1));
    let limits = interval(range.limits, quantity);
    let planning = interval(range.planning_limits, quantity);
    format!("{:<column$}{:<5}{limits:>22}{planning:>22}{speed:>14}", name_in(joint, column), quantity.unit())
}

fn target_lines(profile: &Profile) -> Vec<String> {
    let mut lines = vec![format!("{:<12}{:>11}{:>11}{:>11}  {}", "target", "x mm", "y mm", "z mm", "in the flange")];
    for target in profile.targets() {
        let state = if target.is_free() {
            format!("free, within {} mm", fixed(to_mm(target.uncertainty), 1))
        } else {
            "taken as exact".to_owned()
        };
        let [x, y, z] = [0, 1, 2].map(|axis| fixed(to_mm(target.position_in_flange[axis]), 3));
        lines.push(clipped(&format!("{:<12}{x:>11}{y:>11}{z:>11}  {state}", target.name)));
    }
    lines
}

fn mass_lines(profile: &Profile) -> Vec<String> {
    let loads = profile.chain().loads();
    let links: Vec<String> =
        loads.map(Loads::links).unwrap_or_default().iter().map(|link| fixed(link.mass, 3)).collect();
    let masses = match profile.masses() {
        Masses::Unknown => "not given, nothing about gravity can be identified".to_owned(),
        Masses::Weight(weight) => {
            format!("{} kg, split by their lengths from {} kg of the arm", links.join(", "), fixed(*weight, 1))
        }
        Masses::Links(_) => format!("{} kg, stated link by link", links.join(", ")),
    };
    let payload = profile.payload().map_or_else(
        || "none".to_owned(),
        |LinkMass { mass, centre }| {
            let [x, y, z] = [0, 1, 2].map(|axis| fixed(to_mm(centre[axis]), 1));
            format!("{} kg, centre ({x}, {y}, {z}) mm in the flange", fixed(mass, 3))
        },
    );
    let mounting = match profile.mounting() {
        Mounting::Floor => "mounted on the floor".to_owned(),
        Mounting::Wall => "mounted on a wall, gravity along +x of the base".to_owned(),
        Mounting::Ceiling => "mounted on the ceiling".to_owned(),
        Mounting::Gravity(direction) => {
            let [x, y, z] = [0, 1, 2].map(|axis| fixed(direction[axis], 3));
            format!("gravity along ({x}, {y}, {z}) in the base")
        }
    };
    let mut lines = wrapped(&format!("masses of the links: {masses}"), WIDTH);
    lines.extend(wrapped(&format!("payload: {payload}; {mounting}"), WIDTH));
    lines
}

fn parameter_lines(profile: &Profile) -> Vec<String> {
    let count = |level| profile.parameters(level).len();
    let fixed_names: Vec<String> = profile.fixed_parameters().iter().map(ToString::to_string).collect();
    let mut lines = vec![format!(
        "free parameters: {} geometric, {} offsets only (target coordinates included)",
        count(Level::Geometric),
        count(Level::Offsets)
    )];
    if !fixed_names.is_empty() {
        lines.extend(wrapped(&format!("fixed: {}", fixed_names.join(", ")), WIDTH));
    }
    let acceptance = profile.acceptance();
    let limits: Vec<String> = [
        ("position mean", acceptance.position_mean),
        ("position RMS", acceptance.position_rms),
        ("position max", acceptance.position_max),
        ("distance mean", acceptance.distance_mean),
        ("distance RMS", acceptance.distance_rms),
        ("distance max", acceptance.distance_max),
    ]
    .into_iter()
    .filter_map(|(name, limit)| limit.map(|limit| format!("{name} {} mm", fixed(to_mm(limit), 3))))
    .collect();
    let limits = if limits.is_empty() { "none".to_owned() } else { limits.join(", ") };
    lines.extend(wrapped(&format!("acceptance limits: {limits}"), WIDTH));
    lines
}

fn cell_lines(profile: &Profile) -> Vec<String> {
    let instrument = profile.instrument().map_or_else(
        || "not given; its uncertainty is estimated from the residuals".to_owned(),
        |instrument| format!("{}, sigma {}", instrument.name, instrument.sigma_text()),
    );
    let tracker = profile.tracker();
    let [x, y, z] = [0, 1, 2].map(|axis| fixed(to_mm(tracker.position_in_base[axis]), 0));
    let mut lines = wrapped(&format!("instrument: {instrument}"), WIDTH);
    lines.extend(wrapped(
        &format!(
            "tracker near ({x}, {y}, {z}) mm in the base, sees up to {} deg off the SMR axis, {} to {} mm away",
            fixed(to_deg(tracker.acceptance_angle), 0),
            fixed(to_mm(tracker.range.0), 0),
            fixed(to_mm(tracker.range.1), 0),
        ),
        WIDTH,
    ));
    if let Some(link) = profile.link() {
        let robot = link.robot.as_ref().map_or_else(String::new, |robot| format!(", robot at {robot}"));
        let automatic = if link.is_automatic { ", measuring automatically" } else { "" };
        lines.extend(wrapped(&format!("link: {}{robot}{automatic}", link.address), WIDTH));
    }
    let floor =
        profile.floor().map_or_else(|| "no floor".to_owned(), |z| format!("floor at {} mm", fixed(to_mm(z), 0)));
    lines.push(format!(
        "collision shapes: {}, {floor}, keep-out boxes: {}",
        counted_as(profile.bodies().len(), "body", "bodies"),
        profile.keep_out().len()
    ));
    lines
}

/// Width of the column of joint names: that of the longest one, limited so that the table stays within [`WIDTH`].
fn name_column(profile: &Profile) -> usize {
    let longest = profile.chain().joints().iter().map(|joint| joint.name.chars().count()).max().unwrap_or(0);
    (longest + 1).clamp(8, 16)
}

/// A joint name shortened to its column with one blank.
fn name_in(joint: &Joint, column: usize) -> String {
    joint.name.chars().take(column - 1).collect()
}

const fn type_name(joint_type: JointType) -> &'static str {
    match joint_type {
        JointType::Revolute => "revolute",
        JointType::Prismatic => "prismatic",
    }
}

fn interval(limits: Option<(f64, f64)>, quantity: Quantity) -> String {
    limits.map_or_else(
        || "-".to_owned(),
        |(low, high)| format!("{} .. {}", fixed(quantity.to_edge(low), 1), fixed(quantity.to_edge(high), 1)),
    )
}

/// A number with this many decimals; never `-0.000`.
fn fixed(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    match text.strip_prefix('-') {
        Some(digits) if digits.chars().all(|c| matches!(c, '0' | '.')) => digits.to_owned(),
        _ => text,
    }
}

/// A line of at most [`WIDTH`] columns.
fn clipped(line: &str) -> String {
    shortened(line.trim_end(), WIDTH)
}

fn finished(lines: &[String]) -> String {
    let mut text = lines.join("\n");
    text.push('\n');
    text
}
