//! Poses measured with their orientation: a simulated arm is identified from them through the program, from one SMR, and from three
//! SMRs on a body.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};
use rand::SeedableRng as _;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution as _, StandardNormal};
use serde_json::Value;
use trupose::identification::verification::{ErrorStatistics, ModelErrors, fit_setup};
use trupose::identification::{Observations, PointSample};
use trupose::kinematics::{Arm, ForwardKinematics, FreeParameter, ParameterId, Place};
use trupose::planning::{JointBox, random};
use trupose::profile::{Level, Profile, Target, builtin, with_targets};
use trupose::session::calibration::Calibration;

use crate::support::{text, trupose_in};

const ROBOT: &str = "abb_irb120";
/// Standard deviations of a measured coordinate (m) and of an orientation about each axis (rad).
const SIGMA: f64 = 20e-6;
const SIGMA_ROTATION: f64 = 0.005 * std::f64::consts::PI / 180.0;
const POSES: usize = 40;
/// The tool in the frame of the probe (m): 300 mm away.
const TOOL: [f64; 3] = [0.3, 0.0, 0.0];

fn normal(rng: &mut ChaCha8Rng) -> f64 {
    StandardNormal.sample(rng)
}

fn noise(rng: &mut ChaCha8Rng, sigma: f64) -> Vector3<f64> {
    Vector3::from_fn(|_, _| sigma * normal(rng))
}

/// A cell with a probe on the flange whose orientation nobody knows.
struct Cell {
    profile: String,
    arm: Arm,
    deviations: Vec<(ParameterId, f64)>,
    flange_from_probe: Isometry3<f64>,
    station_from_base: Isometry3<f64>,
    rng: ChaCha8Rng,
}

/// The three SMRs of a body, in the frame of the probe (m).
const SMRS: [[f64; 3]; 3] = [[0.08, 0.0, 0.0], [-0.04, 0.07, 0.0], [-0.04, -0.07, 0.02]];

impl Cell {
    fn new(seed: u64) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let target = Target { position_in_flange: Point3::new(0.03, 0.0, 0.1), ..Target::beside_the_flange("probe") };
        let profile = with_targets(builtin(ROBOT).unwrap(), &[target]).unwrap();
        let nominal = Profile::parse(&profile, ROBOT).unwrap().0;
        let deviations: Vec<_> = nominal
            .parameters(Level::Geometric)
            .into_iter()
            .filter(|parameter| parameter.id.target().is_none())
            .map(|parameter| (parameter.id, parameter.expected * normal(&mut rng)))
            .collect();
        Self {
            arm: nominal.arm().with(deviations.iter().copied()).unwrap(),
            profile,
            deviations,
            flange_from_probe: Isometry3::new(Vector3::new(0.045, -0.02, 0.11), Vector3::new(0.8, -1.1, 0.4)),
            station_from_base: Isometry3::new(Vector3::new(2.5, 1.0, -0.4), Vector3::new(0.1, 0.2, 1.0)),
            rng,
        }
    }

    fn nominal(&self) -> Profile {
        Profile::parse(&self.profile, ROBOT).unwrap().0
    }

    fn configurations(&self, count: usize, seed: u64) -> Vec<Vec<f64>> {
        let limits = self.nominal().joints().iter().map(|joint| joint.planning_limits.unwrap()).collect();
        random(&JointBox::new(limits).unwrap(), seed).take(count).collect()
    }

    fn probe(&self, configuration: &[f64]) -> Isometry3<f64> {
        let base_from_flange = ForwardKinematics::new(&self.arm.chain).base_from_flange(configuration);
        self.station_from_base * base_from_flange * self.flange_from_probe
    }

    /// The tables of the same poses: positions with quaternions, positions alone, and three SMRs.
    fn tables(&mut self, count: usize, seed: u64) -> [String; 3] {
        let joints: Vec<String> = (1..=6).map(|joint| format!("q{joint}_deg")).collect();
        let joints = joints.join(",");
        let mut poses = format!("pose,{joints},x_mm,y_mm,z_mm,qw,qx,qy,qz,sigma_mm,sigma_rot_deg\n");
        let mut points = format!("pose,{joints},x_mm,y_mm,z_mm,sigma_mm\n");
        let mut smrs = format!("pose,target,{joints},x_mm,y_mm,z_mm,sigma_mm\n");
        for (index, configuration) in self.configurations(count, seed).into_iter().enumerate() {
            let probe = self.probe(&configuration);
            let position = Point3::from(probe.translation.vector) + noise(&mut self.rng, SIGMA);
            let turn = UnitQuaternion::new(noise(&mut self.rng, SIGMA_ROTATION));
            let q = (turn * probe.rotation).into_inner();
            let values: Vec<String> = configuration.iter().map(|value| format!("{:.9}", value.to_degrees())).collect();
            let values = values.join(",");
            let mm = |point: &Point3<f64>| format!("{:.6},{:.6},{:.6}", 1e3 * point.x, 1e3 * point.y, 1e3 * point.z);
            let (sigma, sigma_rotation) = (1e3 * SIGMA, SIGMA_ROTATION.to_degrees());
            let at = mm(&position);
            let turned = format!("{:.12},{:.12},{:.12},{:.12}", q.w, q.i, q.j, q.k);
            writeln!(poses, "P{index},{values},{at},{turned},{sigma},{sigma_rotation}").unwrap();
            writeln!(points, "P{index},{values},{at},{sigma}").unwrap();
            for (number, smr) in SMRS.iter().enumerate() {
                let point = probe * Point3::from(*smr) + noise(&mut self.rng, SIGMA);
                writeln!(smrs, "P{index},s{number},{values},{},{sigma}", mm(&point)).unwrap();
            }
        }
        [poses, points, smrs]
    }

    /// Errors (m) of an arm at the tool, whose place on the flange and whose frame are fitted as if they were taught with it.
    fn tool_error(&self, arm: &Arm) -> ErrorStatistics {
        let tool = Point3::from(TOOL);
        let sample = |configuration: Vec<f64>| PointSample {
            point: self.probe(&configuration) * tool,
            at: Place { configuration, target: 0 },
            station: 0,
            sigma: None,
        };
        let points: Vec<PointSample> = self.configurations(150, 99).into_iter().map(sample).collect();
        let arm = Arm { chain: arm.chain.clone(), targets: vec![self.flange_from_probe * tool] };
        let free: Vec<FreeParameter> = self
            .nominal()
            .parameters(Level::Geometric)
            .into_iter()
            .filter(|parameter| parameter.id.target().is_some())
            .collect();
        let observations = Observations { points: points.clone(), ..Observations::default() };
        let setup = fit_setup(&arm, &free, &observations).unwrap();
        ModelErrors::new(&setup.arm, &setup.base_from_station, &points).unwrap().position
    }
}

/// Identifies from a table through the program: the arm, and the report.
fn identified(folder: &Path, profile: &str, name: &str) -> (Arm, Value) {
    let out = format!("out-{name}");
    let (table, tested) = (format!("{name}.csv"), format!("{name}-verify.csv"));
    let arguments = ["identify", "--profile", profile, "--measurements", &table, "--verify", &tested, "--out", &out];
    let output = trupose_in(folder, &[&arguments[..], &["--level", "geometric"]].concat());
    let said = text(&output.stdout) + &text(&output.stderr);
    assert!(matches!(output.status.code(), Some(0 | 3)), "{name}: {:?}\n{said}", output.status);
    let folder = folder.join(out);
    let calibration = Calibration::parse(&fs::read_to_string(folder.join("calibration.ron")).unwrap()).unwrap();
    let profile = Profile::parse(&calibration.profile, "calibration").unwrap().0;
    let arm = calibration.identified(&calibration.mounted_on(&profile)).unwrap();
    let mut report: Value = serde_json::from_str(&fs::read_to_string(folder.join("report.json")).unwrap()).unwrap();
    report["said"] = Value::from(said);
    report["html"] = Value::from(fs::read_to_string(folder.join("report.html")).unwrap());
    (arm, report)
}

/// The verification of a report, wherever it is.
fn verification(report: &Value) -> &Value {
    let found = &report["verification"];
    if found.is_null() { &report["result"]["verification"] } else { found }
}

/// Deviations found less the true ones, in their own standard deviations.
fn in_sigmas(cell: &Cell, report: &Value) -> Vec<f64> {
    let parameters = report["parameters"].as_array().or_else(|| report["result"]["parameters"].as_array()).unwrap();
    cell.deviations
        .iter()
        .filter_map(|(id, deviation)| {
            let found = parameters.iter().find(|parameter| parameter["name"] == id.to_string())?;
            let unit = if found["unit"] == "mm" { 1e-3 } else { std::f64::consts::PI / 180.0 };
            let number = |name: &str| found[name].as_f64().unwrap() * unit;
            Some((number("deviation") - deviation) / number("sigma"))
        })
        .collect()
}

/// Writes the tables and profiles of a cell.
fn written(cell: &mut Cell, folder: &Path) {
    fs::write(folder.join("probe.ron"), &cell.profile).unwrap();
    let smr = |name: &str| Target::beside_the_flange(name);
    let body = with_targets(&cell.profile, &["s0", "s1", "s2"].map(smr)).unwrap();
    let body = body.replace("uncertainty_mm: 50.0", "uncertainty_mm: 200.0");
    fs::write(folder.join("body.ron"), body).unwrap();
    for (suffix, count, seed) in [("", POSES, 1), ("-verify", 20, 2)] {
        let tables = cell.tables(count, seed);
        for (name, table) in ["poses", "points", "smrs"].iter().zip(tables) {
            fs::write(folder.join(format!("{name}{suffix}.csv")), table).unwrap();
        }
    }
}

#[test]
fn poses_with_orientation_make_points_far_from_the_flange_accurate() {
    let mut cell = Cell::new(11);
    let folder = tempfile::tempdir().unwrap();
    written(&mut cell, folder.path());
    let (of_poses, report) = identified(folder.path(), "probe.ron", "poses");
    let (of_points, alone) = identified(folder.path(), "probe.ron", "points");
    let (of_smrs, three) = identified(folder.path(), "body.ron", "smrs");

    for (name, report) in [("poses", &report), ("points", &alone), ("smrs", &three)] {
        let off = in_sigmas(&cell, report);
        let rms = (off.iter().map(|z| z * z).sum::<f64>() / off.len() as f64).sqrt();
        let worst = off.iter().fold(0.0_f64, |worst, z| worst.max(z.abs()));
        assert!(off.len() > 15 && rms < 1.5 && worst < 4.0, "{name}: rms {rms}, worst {worst} of {}", off.len());
    }
    let errors = [&of_poses, &of_points, &of_smrs].map(|arm| 1e3 * cell.tool_error(arm).rms);
    let [with, without, smrs] = errors;
    assert!(with < 0.8 * without, "tool 300 mm away, mm: {errors:?}");
    assert!(smrs < 0.8 * without && (smrs - with).abs() < 0.5 * without, "tool 300 mm away, mm: {errors:?}");

    let orientation = &verification(&report)["identified"]["orientation_mrad"];
    let rms = orientation["rms"].as_f64().unwrap();
    // Three axes of the probe, and what is left of the arm.
    let of_probe = 1e3 * SIGMA_ROTATION * 3.0_f64.sqrt();
    assert!(rms > 0.7 * of_probe && rms < 2.0 * of_probe, "{rms} of {of_probe}");
    assert_eq!(orientation["count"], 20);
    assert!(verification(&report)["nominal"]["orientation_mrad"]["rms"].as_f64().unwrap() > 3.0 * rms);
    assert!(verification(&three)["identified"]["orientation_mrad"]["rms"].as_f64().is_some());
    assert!(verification(&alone)["identified"]["orientation_mrad"].is_null());
    let said = report["said"].as_str().unwrap();
    for part in ["orientation (mrad), mean of 20", "carry its orientation", "four points of a rigid body"] {
        assert!(said.split_whitespace().collect::<Vec<_>>().join(" ").contains(part), "{part}: {said}");
    }
    assert!(report["html"].as_str().unwrap().contains("Orientation error of the flange"));

    // The written table and profile say the same without any orientation in them.
    let arguments = ["import", "poses.csv", "--profile", "probe.ron", "--out", "four.csv", "--out-profile", "four.ron"];
    let output = trupose_in(folder.path(), &arguments);
    assert!(output.status.success(), "{}", text(&output.stderr));
    fs::copy(folder.path().join("poses-verify.csv"), folder.path().join("four-verify.csv")).unwrap();
    let (again, _) = identified(folder.path(), "four.ron", "four");
    assert!((1e3 * cell.tool_error(&again).rms - with).abs() < 0.002);
    let table = fs::read_to_string(folder.path().join("four.csv")).unwrap();
    assert_eq!(table.matches(",probe.d,").count(), POSES);

    let calibration = "out-poses/calibration.ron";
    let verify = ["verify", "--calibration", calibration, "--measurements", "poses-verify.csv", "--json"];
    let output = trupose_in(folder.path(), &verify);
    let report: Value = serde_json::from_str(&text(&output.stdout)).unwrap();
    let same = report["verification"]["identified"]["orientation_mrad"]["rms"].as_f64().unwrap();
    assert!((same - rms).abs() < 1e-6, "{same} {rms}");
    // Other errors make no other body: the corners are those of the calibration.
    let table = fs::read_to_string(folder.path().join("poses-verify.csv")).unwrap();
    let (ours, other) = (format!(",{}\n", SIGMA_ROTATION.to_degrees()), ",0.02\n");
    fs::write(folder.path().join("poses-verify.csv"), table.replace(&ours, other)).unwrap();
    let output = trupose_in(folder.path(), &verify);
    let report: Value = serde_json::from_str(&text(&output.stdout)).unwrap();
    let same = report["verification"]["identified"]["orientation_mrad"]["rms"].as_f64().unwrap();
    assert!((same - rms).abs() < 1e-6, "{same} {rms}");
}

/// Measures what section 4 of `docs/engineer.md` says about orientations.
#[test]
fn figures_of_poses_with_orientation_are_those_of_the_document() {
    let arms = 8;
    let mut squares = [0.0; 3];
    let mut parameters: Vec<(String, [f64; 2])> = Vec::new();
    for seed in 0..arms {
        let mut cell = Cell::new(100 + seed);
        let folder = tempfile::tempdir().unwrap();
        written(&mut cell, folder.path());
        let (of_poses, report) = identified(folder.path(), "probe.ron", "poses");
        let (of_points, alone) = identified(folder.path(), "probe.ron", "points");
        let (of_smrs, _) = identified(folder.path(), "body.ron", "smrs");
        for (sum, arm) in squares.iter_mut().zip([of_poses, of_points, of_smrs]) {
            *sum += cell.tool_error(&arm).rms.powi(2) / arms as f64;
        }
        if seed == 0 {
            for name in ["theta4", "theta5", "alpha4", "alpha5", "theta6"] {
                let of = |report: &Value| sigma(report, name);
                parameters.push((name.to_owned(), [of(&report), of(&alone)]));
            }
        }
    }
    let [with, without, smrs] = squares.map(|square| 1e3 * square.sqrt());
    for (found, said) in [(with, 0.017), (without, 0.051), (smrs, 0.016)] {
        assert!((found - said).abs() < 0.0011, "tool 300 mm away, mm: {with}, {without}, {smrs}");
    }
    for (name, [with, without]) in parameters {
        let (with, without) = (1e3 * with, 1e3 * without);
        let (said, alone) = match name.as_str() {
            "theta4" => (0.66, 1.4),
            "theta5" => (0.58, 5.3),
            "alpha4" => (0.62, 2.4),
            "alpha5" => (0.66, 6.0),
            _ => (570.0, 573.0),
        };
        let is_said = (with - said).abs() < 0.05 * said && (without - alone).abs() < 0.05 * alone;
        assert!(is_said, "{name}: {with} and {without} thousandths of a degree");
    }
}

fn sigma(report: &Value, name: &str) -> f64 {
    let parameters = report["parameters"].as_array().or_else(|| report["result"]["parameters"].as_array()).unwrap();
    let found = parameters.iter().find(|parameter| parameter["name"] == name);
    found.and_then(|found| found["sigma"].as_f64()).unwrap_or(f64::NAN)
}
