//! Errors of joints beside the geometry: found where there are any, left alone where there are none, and never trusted where nothing
//! was measured.

use std::ops::ControlFlow;

use crate::support::measured_data;
use crate::support::trupose;
use nalgebra::{Isometry3, Vector3};
use rand::SeedableRng as _;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution as _, StandardNormal};
use serde_json::Value;
use trupose::identification::{PointSample, Terms};
use trupose::kinematics::{Arm, Place};
use trupose::planning::{JointBox, random};
use trupose::procedure::EstimationSettings;
use trupose::procedure::identify::{Identified, IdentifyRequest, NamedSample, SampleSet, identify};
use trupose::profile::{Level, Profile, builtin};
use trupose::session::summary::{Cause, VerdictStatus, VerificationMode};

/// Standard deviation of a coordinate (m): instrument and repeatability.
const NOISE: f64 = 20e-6;
const ROBOT: &str = "abb_irb120";

fn text() -> String {
    builtin(ROBOT).unwrap().replace("position_rms_mm: 0.3", "position_rms_mm: 0.15")
}

/// The robot with a limit that leaves no room for a range without poses.
fn profile() -> Profile {
    Profile::parse(&text(), ROBOT).unwrap().0
}

fn normal(rng: &mut ChaCha8Rng) -> f64 {
    StandardNormal.sample(rng)
}

/// An arm with half of the deviations that the profile expects, and with these errors of its joints.
fn real_arm(profile: &Profile, terms: Terms, seed: u64) -> Arm {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let arm = profile.arm();
    let geometry = profile.parameters(Level::Geometric).into_iter().map(|parameter| (parameter, 0.5));
    let of_joints = terms.parameters(&arm.chain).into_iter().map(|parameter| (parameter, 1.0));
    let deviations: Vec<_> = geometry
        .chain(of_joints)
        .map(|(parameter, part)| (parameter.id, part * parameter.expected * normal(&mut rng)))
        .filter(|(id, _)| id.target().is_none())
        .collect();
    arm.with(deviations).unwrap()
}

/// What an instrument sees of `arm` at random configurations between the limits `ranges` (rad).
fn measured(arm: &Arm, ranges: &[(f64, f64)], poses: usize, seed: u64) -> Vec<NamedSample> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let station = Isometry3::new(Vector3::new(1.5, 1.0, 0.4), Vector3::new(0.1, 0.2, 1.0));
    let joint_box = JointBox::new(ranges.to_vec()).unwrap();
    random(&joint_box, seed)
        .take(poses)
        .enumerate()
        .map(|(index, configuration)| {
            let at = Place { configuration, target: 0 };
            let noise = Vector3::from_fn(|_, _| NOISE * normal(&mut rng));
            let point = station.inverse() * (arm.point_in_base(&at) + noise);
            let sample = PointSample { at, station: 0, point, sigma: None };
            NamedSample { pose: (index + 1).to_string(), line: index + 2, sample, temperature: None }
        })
        .collect()
}

/// The ranges in which the profile plans (rad).
fn ranges(profile: &Profile) -> Vec<(f64, f64)> {
    profile.joints().iter().map(|range| range.planning_limits.or(range.limits).unwrap()).collect()
}

fn identified(profile: &Profile, identification: Vec<NamedSample>, verification: Vec<NamedSample>) -> Identified {
    let request = IdentifyRequest {
        mounted: None,
        payload: None,
        profile: profile.clone(),
        profile_text: text(),
        created: "2026-01-02T03:04:05Z".to_owned(),
        inputs: Vec::new(),
        settings: EstimationSettings { sigma: Some(NOISE), ..EstimationSettings::default() },
        identification: SampleSet::from(identification),
        verification: SampleSet::from(verification),
        basis: "other poses".to_owned(),
        verification_mode: VerificationMode::Rest,
        layout: None,
        socket_distance_mm: None,
        previous: None,
    };
    identify(&request, &mut |_| ControlFlow::Continue(())).unwrap()
}

fn verified_rms(identified: &Identified) -> f64 {
    identified.summary.verification.as_ref().unwrap().identified.position_mm.unwrap().rms
}

#[test]
fn joint_curves_and_compliance_are_found_and_told() {
    let profile = profile();
    let arm = real_arm(&profile, Terms::all(150e-6), 5);
    let all = ranges(&profile);
    let found = identified(&profile, measured(&arm, &all, 90, 1), measured(&arm, &all, 40, 2));
    let summary = &found.summary;
    let selection = summary.selection.as_ref().unwrap();
    assert!(selection.kept.curves.is_some(), "{selection:?}");
    let geometry = selection.candidates.iter().find(|candidate| candidate.terms.is_geometry()).unwrap();
    assert!(selection.left_rms_mm < 0.6 * geometry.left_out_rms_mm, "{selection:?}");
    // Leaving one pose out predicts what other poses show.
    let other = verified_rms(&found);
    assert!((0.7..1.3).contains(&(other / selection.left_rms_mm)), "{other} {}", selection.left_rms_mm);
    let workspace = summary.workspace.as_ref().unwrap();
    assert!((0.6..1.5).contains(&(workspace.rms_mm / other)), "{workspace:?} {other}");
    assert!(workspace.beside_geometry_rms_mm.unwrap() > 0.03, "{workspace:?}");
    let parts: f64 = selection.shares.iter().map(|share| share.percent).sum();
    let left = 100.0 * selection.left_rms_mm / selection.nominal_rms_mm;
    assert!((parts + left - 100.0).abs() < 0.1, "{selection:?}");
    assert!(selection.shares.iter().any(|share| share.cause == Cause::JointCurves && share.percent > 1.0));
    // Curves come back within their band.
    let mut inside = 0;
    let mut all_points = 0;
    for (joint, error) in summary.joint_errors.iter().enumerate() {
        let truth = &arm.chain.errors()[joint];
        let mean = |value: &dyn Fn(f64) -> f64| {
            error.curve.iter().map(|point| value(point.0)).sum::<f64>() / error.curve.len() as f64
        };
        // A constant is a zero of the joint, which belongs to the geometry.
        let true_mean = mean(&|degrees| truth.curve(degrees.to_radians()) * 1e6);
        let found_mean = error.curve.iter().map(|point| point.1).sum::<f64>() / error.curve.len() as f64;
        for (degrees, micro, sigma) in &error.curve {
            let off = (truth.curve(degrees.to_radians()) * 1e6 - true_mean) - (micro - found_mean);
            inside += u32::from(off.abs() <= 3.0 * sigma + 1.0);
            all_points += 1;
        }
    }
    assert!(all_points > 200 && f64::from(inside) > 0.97 * f64::from(all_points), "{inside} of {all_points}");
    // Formats that know only geometry get a fit of their own.
    let calibration = found.calibration.unwrap();
    let own = calibration.identified_geometry(&profile).unwrap();
    assert!(!calibration.geometric.is_empty() && own.chain.errors().iter().all(|error| error.curve(1.0) == 0.0));
}

#[test]
fn an_arm_without_errors_of_joints_keeps_its_geometry() {
    let profile = profile();
    let arm = real_arm(&profile, Terms::default(), 7);
    let all = ranges(&profile);
    let found = identified(&profile, measured(&arm, &all, 60, 3), measured(&arm, &all, 20, 4));
    assert!(found.summary.selection.as_ref().unwrap().kept.is_geometry());
    assert!(found.summary.joint_errors.is_empty() && found.calibration.as_ref().unwrap().geometric.is_empty());
    assert_eq!(found.summary.verdict.status, VerdictStatus::Accepted, "{:?}", found.summary.warnings);
}

/// Figures that look perfect because the verification stays where the identification was.
#[test]
fn a_range_that_was_left_out_is_named_and_not_accepted() {
    let profile = profile();
    let arm = real_arm(&profile, Terms::all(150e-6), 9);
    for moved in [vec![2_usize], vec![0, 1, 3, 4, 5]] {
        let mut part = ranges(&profile);
        let narrow: Vec<usize> = if moved.len() == 1 {
            moved.clone()
        } else {
            (0..part.len()).filter(|joint| !moved.contains(joint)).collect()
        };
        for joint in &narrow {
            let (low, high) = part[*joint];
            let middle = f64::midpoint(low, high);
            part[*joint] = (middle - 0.06 * (high - low), middle + 0.06 * (high - low));
        }
        let found = identified(&profile, measured(&arm, &part, 70, 1), measured(&arm, &part, 30, 2));
        let warning = found.summary.warnings.iter().find(|warning| warning.code.as_str() == "workspace");
        let warning = warning.unwrap_or_else(|| panic!("{:?} {:?}", found.summary.workspace, found.summary.verdict));
        assert_eq!(found.summary.verdict.status, VerdictStatus::NotAccepted);
        assert!(warning.blocks_acceptance && warning.message.contains("Joint J3 matters most"), "{}", warning.message);
        assert!(verified_rms(&found) < 0.1, "{}", verified_rms(&found));
    }
}

#[test]
fn two_joints_that_moved_say_nothing_about_the_others() {
    let profile = profile();
    let arm = real_arm(&profile, Terms::all(150e-6), 11);
    let all = ranges(&profile);
    let part: Vec<(f64, f64)> = all
        .iter()
        .enumerate()
        .map(|(joint, range)| if joint == 1 || joint == 2 { *range } else { (0.1, 0.1 + 1e-6) })
        .collect();
    let found = identified(&profile, measured(&arm, &part, 70, 1), measured(&arm, &part, 30, 2));
    assert_eq!(found.summary.verdict.status, VerdictStatus::NotAccepted);
    let says = |code: &str| found.summary.warnings.iter().any(|warning| warning.code.as_str() == code);
    assert!(says("poor_data") && says("workspace"), "{:?}", found.summary.warnings);
}

#[test]
fn asking_for_terms_and_ruling_them_out_is_an_error() {
    let table = "sessions/soochow-example/measurements.csv";
    for (asked, ruled_out) in [
        (["--terms", "curves"], ["--prior", "none"]),
        (["--level", "full"], ["--weighting", "uniform"]),
        (["--level", "full"], ["--iterations", "1"]),
    ] {
        let start = ["identify", "--profile", "soochow", "--measurements", table];
        let output = trupose(&[&start[..], &asked[..], &ruled_out[..]].concat());
        assert_eq!(output.status.code(), Some(2), "{asked:?} {ruled_out:?}");
        assert!(String::from_utf8_lossy(&output.stderr).contains("rule out the errors of joints"));
    }
}

/// Runs the program and reads its JSON object.
fn json(arguments: &[&str]) -> Value {
    let output = trupose(&[arguments, &["--json"]].concat());
    assert!(output.status.code().unwrap() <= 1, "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).unwrap()
}

/// Root mean square, mean and largest position error of the identified arm (mm).
fn position(value: &Value) -> [f64; 3] {
    ["rms", "mean", "max"].map(|name| value["verification"]["identified"]["position_mm"][name].as_f64().unwrap())
}

/// With the default settings.
#[test]
fn real_arms_become_as_accurate_as_their_joints_allow() {
    let Some(grid) = measured_data("ur5/grid.csv") else { return };
    let Some(points) = measured_data("ur5/random.csv") else { return };
    let (Some(b), Some(c)) = (measured_data("ur10/series_b.csv"), measured_data("ur10/series_c.csv")) else { return };
    let [grid, points, b, c] = [&grid, &points, &b, &c].map(|path| path.to_str().unwrap());
    let out = tempfile::tempdir().unwrap();
    let folder = out.path().to_str().unwrap();
    let calibration = out.path().join("calibration.ron");
    let calibration = calibration.to_str().unwrap();
    let identify = |profile: &str, table: &str, extra: &[&str]| {
        let start = ["identify", "--profile", profile, "--measurements", table, "--out", folder];
        json(&[&start[..], extra].concat())
    };
    let verify = |table: &str, extra: &[&str]| {
        json(&[&["verify", "--calibration", calibration, "--measurements", table][..], extra].concat())
    };

    let rest = position(&identify("ur5", grid, &["--use", "pose % 17 == 0", "--verify-rest"]));
    assert!(rest[0] <= 0.082 && rest[1] <= 0.074, "{rest:?}");
    let others = position(&verify(points, &[]));
    assert!(others[0] <= 0.084, "{others:?}");
    identify("ur5", grid, &[]);
    let others = position(&verify(points, &[]));
    assert!(others[0] <= 0.067, "{others:?}");

    let rest = position(&identify("ur10", b, &["--use", "pose % 10 < 7", "--verify-rest"]));
    // Of all 447 rows 0.1321; 28 of them are at poses that were also identified and do not count.
    assert!(rest[0] <= 0.1355, "{rest:?}");
    let elsewhere = position(&verify(c, &["--refit", "frame+target"]));
    assert!(elsewhere[0] <= 0.47, "{elsewhere:?}");
}
