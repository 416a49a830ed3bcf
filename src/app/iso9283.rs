//! `trupose iso9283`: the test of ISO 9283, before and after the measurement.

use std::io::Write;

use nalgebra::{Isometry3, Point3};

use super::{Console, load, to_json};
use crate::checksum::{self, Syntax};
use crate::cli::iso9283::{Iso9283Command, TestArgs, TestPlanArgs};
use crate::error::{ExitStatus, Failure};
use crate::kinematics::Arm;
use crate::procedure::iso9283::{Reading, TestError, TestPlanRequest, TestRequest, evaluate, plan};
use crate::procedure::{input_file, joint_types, provenance};
use crate::report;
use crate::session::calibration::Calibration;
use crate::session::iso9283::TestSummary;
use crate::session::plan;
use crate::session::summary::InputRole;
use crate::store;
use crate::text::{causes, counted, fixed};
use crate::units::{from_mm, to_mm};

pub(super) fn run<O: Write, E: Write>(
    command: &Iso9283Command,
    console: &mut Console<O, E>,
) -> Result<ExitStatus, Failure> {
    match command {
        Iso9283Command::Plan(args) => write_plan(args, console),
        Iso9283Command::Evaluate(args) => {
            let summary = figures(&args.test, console)?;
            console.print(&if args.json { to_json(&summary)? } else { report::test_text(&summary) })?;
            Ok(ExitStatus::Accepted)
        }
        Iso9283Command::Report(args) => {
            let page = report::test_html(&figures(&args.test, console)?);
            store::replace(&args.out, &checksum::with_sum(&page, Syntax::Html))
                .map_err(|error| Failure::from_error(ExitStatus::Store, &error))?;
            console.print(&format!("written: {}\n", args.out.display()))?;
            Ok(ExitStatus::Accepted)
        }
    }
}

fn write_plan<O: Write, E: Write>(args: &TestPlanArgs, console: &mut Console<O, E>) -> Result<ExitStatus, Failure> {
    let loaded = load::profile(&args.profile)?;
    for diagnostic in &loaded.warnings {
        console.remark(&diagnostic.to_string());
    }
    let profile = &loaded.profile;
    let request = TestPlanRequest {
        edge: args.edge_mm.map(from_mm),
        centre: args.centre_mm.map(|point| Point3::from(point.map(from_mm))),
        plane: args.plane,
        cycles: args.cycles,
        multi_directional: args.multi_directional,
    };
    let test = plan(profile, &request).map_err(|error| failure(&error))?;
    store::replace(&args.out, &plan::write(&test.rows, &joint_types(profile)))
        .map_err(|error| Failure::from_error(ExitStatus::Store, &error))?;
    let mm = |point: &Point3<f64>| {
        let [x, y, z] = point.coords.map(|value| fixed(to_mm(value), 1)).into();
        format!("({x}, {y}, {z})")
    };
    let mut text = vec![format!(
        "cube with an edge of {} mm, centre {} mm in the base, plane {}\n",
        fixed(to_mm(test.cube.edge), 0),
        mm(&test.cube.centre),
        args.plane
    )];
    for (number, point) in (1..).zip(&test.poses) {
        text.push(format!("P{number} at {} mm\n", mm(point)));
    }
    let measured = test.rows.iter().filter(|row| row.kind.is_measured()).count();
    text.push(format!("written: {} ({} to measure)\n", args.out.display(), counted(measured, "pose")));
    console.print(&text.concat())?;
    console.remark(
        "note: whether the tracker sees the reflector at all five poses is not checked; look before the test, the flange keeps its orientation",
    );
    Ok(ExitStatus::Accepted)
}

/// The arms of a test, and the place of the instrument in their bases.
struct Arms {
    nominal: Arm,
    identified: Option<Arm>,
    base_from_station: Option<(Isometry3<f64>, Isometry3<f64>)>,
}

/// The figures of a measured test.
fn figures<O: Write, E: Write>(args: &TestArgs, console: &mut Console<O, E>) -> Result<TestSummary, Failure> {
    let mut inputs = Vec::new();
    let (profile, profile_text, arms) = match (&args.calibration, &args.profile) {
        (Some(path), _) => {
            let file = path.display().to_string();
            let loaded = load::calibration(path, args.edited, console)?;
            let calibration = loaded.calibration;
            let profile = calibration.mounted_on(&loaded.profile);
            let unusable = |error: &dyn std::error::Error| {
                Failure::new(ExitStatus::Usage, format!("'{file}' is not a usable calibration: {}", causes(error)))
            };
            let arms = Arms {
                nominal: calibration.nominal(&profile).map_err(|error| unusable(&error))?,
                identified: Some(calibration.identified(&profile).map_err(|error| unusable(&error))?),
                base_from_station: if args.same_set_up { Some(stations(&calibration, &file)?) } else { None },
            };
            inputs.push(input_file(InputRole::Calibration, file, loaded.text.as_bytes()));
            (profile, calibration.profile, arms)
        }
        (None, Some(name)) => {
            let loaded = load::profile(name)?;
            let nominal = loaded.profile.arm();
            (loaded.profile, loaded.text, Arms { nominal, identified: None, base_from_station: None })
        }
        (None, None) => return Err(Failure::new(ExitStatus::Usage, "give '--profile' or '--calibration'")),
    };
    let named = (&profile, args.profile.as_deref().unwrap_or_default());
    let measured = load::measurements(&args.measurements, "named", named, InputRole::Verification)?;
    for warning in &measured.table.warnings {
        console.remark(&format!("note: {warning}"));
    }
    if let Some(simulated) = &measured.simulated {
        console.remark(&format!("note: {}", simulated.message));
    }
    // Copies of rows are left out: two visits never give the same point to all digits.
    let rows: Vec<_> = measured.table.distinct_rows().collect();
    let readings = rows
        .iter()
        .zip(load::samples(&rows, &profile)?)
        .map(|(row, sample)| {
            let label = row.pose.parse().map_err(|source| TestError::Label { line: row.line, source })?;
            Ok(Reading { label, sample })
        })
        .collect::<Result<Vec<_>, TestError>>()
        .map_err(|error| failure(&error))?;
    inputs.push(measured.input.clone());
    let request = TestRequest {
        nominal: &arms.nominal,
        identified: arms.identified.as_ref(),
        base_from_station: arms.base_from_station,
        readings: &readings,
        load: args.load.clone(),
        speed: args.speed.clone(),
        provenance: provenance(&profile, &profile_text, load::now(), inputs),
    };
    evaluate(&request).map_err(|error| failure(&error))
}

/// The place of the instrument for the nominal and the identified arm.
fn stations(calibration: &Calibration, file: &str) -> Result<(Isometry3<f64>, Isometry3<f64>), Failure> {
    let (Some(nominal), Some(identified)) = (&calibration.nominal_base_from_station, &calibration.base_from_station)
    else {
        return Err(Failure::new(ExitStatus::Usage, format!("'{file}' contains no tracker position"))
            .hint("leave out '--same-set-up'"));
    };
    Ok((nominal.into(), identified.into()))
}

fn failure(error: &TestError) -> Failure {
    Failure::new(ExitStatus::Usage, causes(error))
}
