//! `trupose profile new`.

use std::io::{BufRead as _, IsTerminal as _, Write, stdin};
use std::path::Path;

use nalgebra::Point3;

use super::super::{Console, load};
use crate::cli::NewProfileArgs;
use crate::error::{ExitStatus, Failure};
use crate::identification::circle_point::{MeasuredArm, Template, measure_arm};
use crate::kinematics::JointType;
use crate::model::{Arm, Heading, geometry_only};
use crate::procedure::joint_types;
use crate::procedure::measured_arm::{ASTONISHING, ASTONISHING_ZERO_DEG, constants, profile_text};
use crate::profile::datasheet::{Agreement, Datasheet, Dimension, Limits, Maker};
use crate::profile::{JointRange, Masses, Profile};
use crate::session::measurements::{Layout, read_as, types_in_header};
use crate::store;
use crate::text::{alternatives, counted};
use crate::units::{from_mm, to_deg, to_mm};

pub(super) fn run<O: Write, E: Write>(
    args: &NewProfileArgs,
    console: &mut Console<O, E>,
) -> Result<ExitStatus, Failure> {
    let text = match (&args.from, args.data_sheet, &args.circles) {
        (Some(from), _, _) => super::text(Path::new(from))?,
        (None, Some(maker), _) => data_sheet(maker, args, console)?,
        (None, None, Some(circles)) => measured(circles, args, console)?,
        (None, None, None) => return Err(Failure::new(ExitStatus::Usage, "nothing to start from was given")),
    };
    let Some(out) = &args.out else {
        console.print(&text)?;
        return Ok(ExitStatus::Accepted);
    };
    if out.exists() {
        let message = format!("'{}' exists already", out.display());
        return Err(Failure::new(ExitStatus::Usage, message).hint("give '--out' another name"));
    }
    store::replace(out, &text).map_err(|error| Failure::from_error(ExitStatus::Store, &error))?;
    let file = out.display();
    console.remark(&format!("written to '{file}': edit it, then check it with 'trupose profile check {file}'"));
    Ok(ExitStatus::Accepted)
}

fn usage(error: &dyn std::error::Error) -> Failure {
    Failure::from_error(ExitStatus::Usage, error)
}

/// The text of a profile from seven dimensions.
fn data_sheet<O: Write, E: Write>(
    maker: Maker,
    args: &NewProfileArgs,
    console: &mut Console<O, E>,
) -> Result<String, Failure> {
    let mut dimensions_mm = [0.0; 7];
    for (dimension, place) in Dimension::ALL.into_iter().zip(&mut dimensions_mm) {
        *place = match args.dimensions.value(dimension) {
            Some(value) => value,
            None if dimension == Dimension::Side => 0.0,
            None => asked(&format!("{} (mm), {}", dimension.label(), dimension.about()), console, |answer| {
                answer.replace(',', ".").parse().ok().ok_or_else(|| format!("'{answer}' is not a number"))
            })?,
        };
    }
    let read = |text: &str| text.parse::<Limits>().map_err(|error| error.to_string());
    let limits_deg = match &args.limits {
        Some(text) => read(text).map_err(|error| Failure::new(ExitStatus::Usage, error))?,
        None => {
            asked("limits of the six joints (deg), such as 165, -110..110, -110..70, 160, 120, 400", console, read)?
        }
    };
    let name = match &args.name {
        Some(name) => name.clone(),
        None => asked("name of the arm", console, |answer| {
            if answer.is_empty() { Err("a name is needed".to_owned()) } else { Ok(answer.to_owned()) }
        })?,
    };
    let sheet = Datasheet { name, maker, dimensions_mm, limits_deg };
    let (text, profile) = sheet.profile().map_err(|error| usage(&error))?;
    let [x, y, z] = profile.flange_at_zero();
    console.remark(&format!("at all zeros the flange is at x {x:.1}, y {y:.1}, z {z:.1} mm"));
    match &args.pendant {
        None => console.remark("is that what the pendant shows, without a tool? '--pendant X,Y,Z' compares them and says what could be wrong"),
        Some(pendant) => compare(&sheet, pendant.0, console)?,
    }
    Ok(text)
}

/// Compares the flange at all zeros with the pendant.
fn compare<O: Write, E: Write>(
    sheet: &Datasheet,
    pendant: [f64; 3],
    console: &mut Console<O, E>,
) -> Result<(), Failure> {
    match sheet.compared(pendant).map_err(|error| usage(&error))? {
        Agreement::Agrees => {
            console.remark("the pendant shows the same: dimensions and zero position are right");
            Ok(())
        }
        Agreement::Differs { by_mm, causes } => {
            let failure =
                Failure::new(ExitStatus::Usage, format!("the pendant shows the flange {by_mm:.1} mm from there"));
            let causes: Vec<String> = causes.iter().map(ToString::to_string).collect();
            Err(if causes.is_empty() {
                failure.hint("no single dimension explains it: is the tool of the controller the bare flange, and are all joints at 0?")
            } else {
                failure.hint(format!("this would explain it: {}", alternatives(&causes)))
            })
        }
    }
}

/// Asks on the terminal until the answer can be used. Without a terminal the option is missing.
fn asked<T, O: Write, E: Write>(
    question: &str,
    console: &mut Console<O, E>,
    read: impl Fn(&str) -> Result<T, String>,
) -> Result<T, Failure> {
    if !stdin().is_terminal() {
        return Err(Failure::new(ExitStatus::Usage, format!("missing: {question}"))
            .hint("give it as an option ('trupose profile new --help'), or start on a terminal to be asked"));
    }
    loop {
        drop(write!(console.err, "{question}: "));
        drop(console.err.flush());
        let mut line = String::new();
        let count = stdin().lock().read_line(&mut line);
        if !matches!(count, Ok(1..)) {
            return Err(Failure::new(ExitStatus::Usage, "the input ended"));
        }
        match read(line.trim()) {
            Ok(value) => return Ok(value),
            Err(error) => console.remark(&error),
        }
    }
}

/// The text of a profile from moving each joint in turn.
fn measured<O: Write, E: Write>(
    circles: &Path,
    args: &NewProfileArgs,
    console: &mut Console<O, E>,
) -> Result<String, Failure> {
    let bytes = store::read(circles).map_err(|error| usage(&error))?;
    let file = circles.display().to_string();
    let compared = args.compare.as_deref().map(load::profile).transpose()?.map(|loaded| loaded.profile);
    let types = match &compared {
        Some(profile) => joint_types(profile),
        None => types_in_header(&bytes).ok_or_else(|| {
            Failure::new(ExitStatus::Usage, format!("'{file}' has no columns q1_deg, q2_deg, … in its first line"))
                .hint("name them q1_deg,…,x_mm,y_mm,z_mm; a joint that slides is q3_mm")
        })?,
    };
    let table = read_as(Layout::Named, &bytes, &file, &types)
        .map_err(|errors| Failure::new(ExitStatus::Usage, errors.to_string()))?;
    let (rows, points): (Vec<Vec<f64>>, Vec<Point3<f64>>) =
        table.rows.into_iter().map(|row| (row.configuration, row.point)).unzip();
    let template = match &compared {
        Some(profile) => Template {
            chain: profile.chain().without_errors(),
            beta_joints: profile.beta_joints().to_vec(),
            is_nominal: true,
        },
        None => Template::unknown(&types).map_err(|error| usage(&error))?,
    };
    let arm = measure_arm(&template, &rows, &points, args.sigma_mm.map(from_mm))
        .map_err(|error| Failure::from_error(ExitStatus::Numerical, &error))?;
    report(&arm, compared.is_some(), console);
    let base = match compared {
        Some(profile) => profile,
        None => first_profile(&arm, &types, args)?,
    };
    let text = profile_text(&base, &arm, args.name.as_deref(), &file);
    // A written profile must be readable.
    load::parse_profile(text.clone(), "the measured profile")?;
    Ok(text)
}

/// A profile of an arm of which nothing was known.
fn first_profile(arm: &MeasuredArm, types: &[JointType], args: &NewProfileArgs) -> Result<Profile, Failure> {
    let mut ranges = vec![JointRange::default(); types.len()];
    if let Some(text) = &args.limits {
        let limits = JointRange::limits_from_text(text, types)
            .map_err(|error| Failure::new(ExitStatus::Usage, format!("'--limits': {error}")))?;
        for (range, limits) in ranges.iter_mut().zip(limits) {
            range.limits = Some(limits);
        }
    }
    let name = args.name.as_deref().unwrap_or("measured");
    let heading = Heading { comments: &[], name, title: name, source: "measured" };
    let part = Arm { chain: &arm.chain, ranges: &ranges, beta_joints: &arm.beta_joints, masses: &Masses::Unknown };
    Ok(load::parse_profile(geometry_only(&heading, &part), "the measured profile")?.profile)
}

/// Prints what was measured.
fn report<O: Write, E: Write>(arm: &MeasuredArm, is_compared: bool, console: &mut Console<O, E>) {
    let name = |joint: usize| arm.chain.joints().get(joint).map_or("?", |joint| joint.name.as_str());
    console.remark(&format!("{:<8}{:>8}{:>14}{:>14}{:>12}", "joint", "points", "radius mm", "moved", "RMS mm"));
    for motion in &arm.motions {
        let radius = motion.radius.map_or_else(|| "slides".to_owned(), |radius| format!("{:.3}", to_mm(radius)));
        let extent = match motion.radius {
            Some(_) => format!("{:.1} deg", to_deg(motion.extent)),
            None => format!("{:.1} mm", to_mm(motion.extent)),
        };
        console.remark(&format!(
            "{:<8}{:>8}{radius:>14}{extent:>14}{:>12.4}",
            name(motion.joint),
            motion.points,
            to_mm(motion.rms)
        ));
    }
    let titles = if is_compared { format!("{:>14}{:>12}", "nominal", "difference") } else { String::new() };
    console.remark(&format!("\n{:<8}{:>14}{:>10}{titles}", "constant", "measured", "sigma"));
    let mut astonishing = 0;
    for row in constants(arm) {
        let nominal = match (row.nominal, row.difference()) {
            (Some(nominal), Some(difference)) => {
                let mark = if row.is_astonishing { " !" } else { "" };
                format!("{nominal:>14.3}{difference:>12.3}{mark}")
            }
            _ => String::new(),
        };
        astonishing += usize::from(row.is_astonishing);
        console.remark(&format!("{:<8}{:>14.4}{:>10.4} {:<3}{nominal}", row.name, row.measured, row.sigma, row.unit));
    }
    let [x, y, z] = [0, 1, 2].map(|axis| to_mm(arm.point_in_flange[axis]));
    console.remark(&format!("\nSMR in the flange: x {x:.3}, y {y:.3}, z {z:.3} mm"));
    let worst = arm.residuals.iter().copied().fold(0.0, f64::max);
    console.remark(&format!(
        "the measured arm puts {} at most {:.3} mm from where they were seen",
        counted(arm.residuals.len(), "point"),
        to_mm(worst)
    ));
    if astonishing > 0 {
        console.remark(&format!(
            "WARNING: {} marked ! (beyond {} mm, {} deg, or {ASTONISHING_ZERO_DEG} deg of a joint's zero): another arm, a wrong profile, or joint values that are not the pendant's",
            counted(astonishing, "difference"),
            ASTONISHING.0,
            ASTONISHING.1
        ));
    }
}
