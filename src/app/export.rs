//! `trupose export` and `trupose profile import-urdf`: exports and imports of models.

use std::io::Write;
use std::path::Path;

use super::{Console, load};
use crate::cli::compensate::{ExportArgs, ImportUrArgs, ImportUrdfArgs};
use crate::error::{ExitStatus, Failure};
use crate::model::{
    Arm, CalibratedArm, ExportOptions, Format, GivenUrdf, Heading, ModelError, Urdf, complete, decode_xml, export,
    geometry_only, import_coupled, read_factory,
};
use crate::session::calibration::Calibration;
use crate::store;
use crate::units::{MICROMETRE, MICRORADIAN, to_mm};

/// Length that no arm exceeds (m).
const LONGEST_ARM: f64 = 20.0;

pub(super) fn run<O: Write, E: Write>(args: &ExportArgs, console: &mut Console<O, E>) -> Result<ExitStatus, Failure> {
    let (_, arm) = calibration(&args.calibration, args.edited, console)?;
    let given = args.into.as_deref().map(xml).transpose()?;
    let format = args.format;
    if given.is_some() && format != Format::Urdf {
        return Err(Failure::new(ExitStatus::Usage, "'--into' is for '--format urdf'"));
    }
    let into = given.as_deref().map(|text| GivenUrdf { text, base: &args.base, tip: &args.tip });
    let options = ExportOptions { into, with_tool_offset: args.with_tool_offset };
    let done = export(&arm, format, &options).map_err(|error| match (&error, &args.into) {
        (ModelError::Urdf(_), Some(path)) => Failure::new(ExitStatus::Usage, format!("'{}': {error}", path.display())),
        // With numbers that this program has not written, it is not its defect.
        (ModelError::Differs { .. } | ModelError::ReadBack(_), _) if arm.edited.is_none() => {
            Failure::from_error(ExitStatus::Internal, &error)
        }
        (ModelError::FlangeOffset { .. }, _) => {
            Failure::from_error(ExitStatus::Usage, &error).hint("'--with-tool-offset' lets the tool take it")
        }
        _ => Failure::from_error(ExitStatus::Usage, &error),
    })?;
    store::replace(&args.out, &done.text).map_err(|error| Failure::from_error(ExitStatus::Store, &error))?;
    let (position, angle) = (done.agreement.position / MICROMETRE, done.agreement.angle / MICRORADIAN);
    let read_back = if format.is_geometry() {
        let meant = if arm.lost.is_some() { "geometry that was identified alone" } else { "identified arm" };
        format!("within {position:.6} um and {angle:.6} urad of the {meant} at 1000 configurations")
    } else {
        format!("within {angle:.1} urad of the curves of the joints, also between the rows")
    };
    console.say(&format!("written: {}\nread back: {read_back}\n", args.out.display()))?;
    for remark in &done.remarks {
        console.remark(&format!("note: {remark}"));
    }
    Ok(ExitStatus::Accepted)
}

/// A calibration file and its arm. Prints the reasons not to apply it.
pub(super) fn calibration<O: Write, E: Write>(
    path: &Path,
    edited: bool,
    console: &mut Console<O, E>,
) -> Result<(Calibration, CalibratedArm), Failure> {
    let loaded = load::calibration(path, edited, console)?;
    let arm = CalibratedArm::new(&loaded.calibration, &loaded.profile)
        .map_err(|error| Failure::new(ExitStatus::Usage, format!("'{}': {error}", path.display())))?;
    for caution in &arm.cautions {
        console.remark(&format!("WARNING: {caution}"));
    }
    Ok((loaded.calibration, arm))
}

/// The text of an XML file in any of its encodings.
fn xml(path: &Path) -> Result<String, Failure> {
    let bytes = store::read(path).map_err(|error| Failure::from_error(ExitStatus::Usage, &error))?;
    decode_xml(&bytes).map_err(|reason| Failure::new(ExitStatus::Usage, format!("'{}': {reason}", path.display())))
}

/// `trupose profile import-urdf`.
pub(super) fn import_urdf<O: Write, E: Write>(
    args: &ImportUrdfArgs,
    console: &mut Console<O, E>,
) -> Result<ExitStatus, Failure> {
    let text = xml(&args.file)?;
    let file = args.file.display().to_string();
    let unusable = |error: &dyn std::error::Error| Failure::new(ExitStatus::Usage, format!("'{file}': {error}"));
    let urdf = Urdf::parse(&text).map_err(|error| unusable(&error))?;
    let chain = urdf.chain(&args.base, &args.tip).map_err(|error| unusable(&error))?;
    let arm = import_coupled(&chain, args.convention, &args.couplings).map_err(|error| unusable(&error))?;
    let mut comments = vec![format!("From a URDF: links '{}' to '{}'.", args.base, args.tip)];
    comments.extend(arm.notes.iter().cloned());
    let heading = Heading {
        comments: &comments,
        name: &urdf.robot,
        title: &urdf.robot,
        source: &format!("URDF of '{}', from link '{}' to '{}'", urdf.robot, args.base, args.tip),
    };
    let part = Arm { chain: &arm.chain, ranges: &arm.ranges, beta_joints: &arm.beta_joints, masses: &arm.masses };
    let profile = geometry_only(&heading, &part);
    // A written profile must be readable.
    load::parse_profile(profile.clone(), "the imported profile")?;
    for note in &arm.notes {
        console.remark(&format!("note: {note}"));
    }
    let length = arm.chain.length();
    if length > LONGEST_ARM {
        console.remark(&format!(
            "WARNING: stretched out this arm is {length:.0} m long: lengths of a URDF are metres; are they millimetres in this one?"
        ));
    }
    match &args.out {
        Some(path) => {
            store::replace(path, &profile).map_err(|error| Failure::from_error(ExitStatus::Store, &error))?;
            console.say_written(path)?;
        }
        None => console.print(&profile)?,
    }
    Ok(ExitStatus::Accepted)
}

/// `trupose profile import-ur`.
pub(super) fn import_ur<O: Write, E: Write>(
    args: &ImportUrArgs,
    console: &mut Console<O, E>,
) -> Result<ExitStatus, Failure> {
    let file = args.file.display().to_string();
    let model = load::profile(&args.model)?.profile;
    let text = load::text(&args.file)?;
    let factory =
        read_factory(&text, &model).map_err(|error| Failure::new(ExitStatus::Usage, format!("'{file}': {error}")))?;
    let moved = to_mm(factory.moved);
    let title = format!("{}, with its factory calibration", model.title());
    let comments = vec![
        format!("Factory calibration of '{}' on the model '{}'.", args.file.display(), model.name()),
        format!("The flange is up to {moved:.3} mm from that of the model."),
    ];
    let heading = Heading {
        comments: &comments,
        name: &format!("{}-factory", model.name()),
        title: &title,
        source: &format!("factory calibration of the controller; model: {}", model.source()),
    };
    let arm = &factory.arm;
    let profile = if arm.beta_joints == model.beta_joints() {
        complete(&heading, &model, &arm.chain, model.targets())
    } else {
        console.remark("note: the links are not those of the model, so that targets, masses and shapes are left out");
        let part = Arm { chain: &arm.chain, ranges: &arm.ranges, beta_joints: &arm.beta_joints, masses: &arm.masses };
        geometry_only(&heading, &part)
    };
    // A written profile must be readable.
    load::parse_profile(profile.clone(), "the imported profile")?;
    for note in &arm.notes {
        console.remark(&format!("note: {note}"));
    }
    match &args.out {
        Some(path) => {
            store::replace(path, &profile).map_err(|error| Failure::from_error(ExitStatus::Store, &error))?;
            console.say_written(path)?;
            console.say(&format!("the flange of this arm is up to {moved:.3} mm from that of the model\n"))?;
        }
        None => console.print(&profile)?,
    }
    Ok(ExitStatus::Accepted)
}
