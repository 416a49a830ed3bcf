//! Lengths to fixed points, planes, lines and circles of unknown place: the same arm as with a tracker.

#![expect(clippy::print_stdout, reason = "the figures of the documents")]

use crate::support::paper_case::{PaperCase, measure, normal, paper_deviations, random_configurations, seeded};
use crate::support::{text, trupose};
use nalgebra::{Point3, UnitVector3, Vector3};
use rand_chacha::ChaCha8Rng;
use std::fmt::Write as _;
use std::fs;
use trupose::geometry::register;
use trupose::identification::{
    Identification, Length, LengthEnd, Observations, SampleIndex, Settings, Shape, identify,
};
use trupose::kinematics::{Arm, ForwardKinematics, LinkParameter, ParameterId, Place};
use trupose::profile::{Profile, builtin};
use trupose::units::{MICROMETRE, MILLIMETRE};

const NOISE: f64 = 20.0 * MICROMETRE;

/// A contact with a feature; of two components the second is measured.
fn contacts(at: &Place, feature: usize, shape: Shape, length: f64) -> impl Iterator<Item = Length> {
    let count = shape.components();
    (0..count).map(move |component| Length {
        from: LengthEnd::Target(at.clone()),
        to: LengthEnd::Feature { feature, component },
        length: if component + 1 == count { length } else { 0.0 },
        sigma: Some(NOISE),
    })
}

/// The configuration near a random one that puts the target at `point`.
fn reaching(model: &Arm, point: Point3<f64>, rng: &mut ChaCha8Rng) -> Option<Place> {
    let arm = ForwardKinematics::new(&model.chain);
    let mut q = random_configurations(1, rng).remove(0);
    for _ in 0..40 {
        let jacobian = arm.configuration_jacobian(&q, &model.targets[0]);
        let linear = jacobian.matrix.fixed_rows::<3>(0).into_owned();
        let step = linear.pseudo_inverse(1e-6).unwrap() * (point - jacobian.point_in_base);
        q.iter_mut().zip(step.iter()).for_each(|(q, step)| *q += step.clamp(-0.2, 0.2));
    }
    ((arm.point_in_base(&q, &model.targets[0]) - point).norm() < 1e-9).then_some(Place { configuration: q, target: 0 })
}

/// Poses that put the target at points that `draw` gives, each missed by the noise in all directions.
fn touching(
    model: &Arm,
    count: usize,
    rng: &mut ChaCha8Rng,
    draw: &dyn Fn(&mut ChaCha8Rng) -> Point3<f64>,
) -> Vec<Place> {
    let mut places = Vec::new();
    while places.len() < count {
        let point = draw(rng);
        let missed = point + Vector3::from_fn(|_, _| NOISE * normal(rng));
        places.extend(reaching(model, missed, rng));
    }
    places
}

fn uniform(rng: &mut ChaCha8Rng) -> f64 {
    rand::RngExt::random_range(rng, -1.0..1.0)
}

fn found(case: &PaperCase) -> Identification {
    identify(&case.problem(), &Settings::default(), &mut |_| {}).unwrap()
}

/// Root mean square distance between two arms at fresh poses, once the one is registered to the other.
fn apart(one: &Arm, other: &Arm) -> f64 {
    let mut rng = seeded(99);
    let places =
        random_configurations(300, &mut rng).into_iter().map(|configuration| Place { configuration, target: 0 });
    let places: Vec<Place> = places.collect();
    let points = [one, other].map(|arm| arm.points_in_base(&places));
    register(points[0].iter().zip(&points[1]).map(|(a, b)| (1.0, *a, *b))).unwrap().rms
}

/// Checks that the parameters are within their error bars and that the arm is the one that a tracker finds.
fn check(name: &str, case: &PaperCase, truth: &Arm, limit: f64) {
    let found = found(case);
    assert_eq!(found.observability.rank, Some(21), "{name}: {:?}", found.observability.gap);
    assert_eq!(found.rejected, [], "{name}");
    let mut beyond = 0;
    for (estimate, truth) in found.estimates.iter().zip(&paper_deviations()).filter(|(e, _)| e.identifiable) {
        let ratio = (estimate.deviation - truth).abs() / estimate.sigma;
        beyond += usize::from(ratio > 3.0);
        assert!(ratio < 4.0, "{name}: {} {estimate:?} {truth}", estimate.id);
    }
    assert!(beyond <= 1, "{name}: {beyond} parameters are more than 3 sigma off");
    let mut with_tracker = PaperCase::new(Vec::new());
    let mut rng = seeded(3);
    with_tracker.observations.points = measure(truth, &random_configurations(56, &mut rng), NOISE, &mut rng);
    let tracked = self::found(&with_tracker).arm;
    let figures =
        [apart(&found.arm, truth), apart(&found.arm, &tracked), apart(&case.arm, truth)].map(|m| m / MILLIMETRE);
    println!(
        "{name}: {:.3} mm from the truth, {:.3} mm from the tracker's arm, nominal {:.1} mm",
        figures[0], figures[1], figures[2]
    );
    assert!(figures[0] < limit && figures[1] < limit + 0.03 && figures[2] > 3.0, "{name}: {figures:?}");
}

fn random_places(count: usize, rng: &mut ChaCha8Rng) -> Vec<Place> {
    random_configurations(count, rng).into_iter().map(|configuration| Place { configuration, target: 0 }).collect()
}

const ANCHORS: [Point3<f64>; 3] =
    [Point3::new(2.0, -1.5, 0.1), Point3::new(1.8, 1.7, 0.3), Point3::new(-1.6, 0.4, 2.4)];

#[test]
fn wires_and_lasers_to_unknown_points_find_the_arm() {
    for (name, shape, zeros) in
        [("lasers", Shape::Point, [0.0; 3]), ("wires of unknown zero", Shape::Wire, [0.3, -0.2, 0.05])]
    {
        let mut rng = seeded(21);
        let mut case = PaperCase::new(Vec::new());
        let truth = case.problem().arm_with(&paper_deviations());
        let mut observations = Observations { features: vec![shape; 3], ..Observations::default() };
        for (index, place) in random_places(180, &mut rng).iter().enumerate() {
            let feature = index % 3;
            let length = (truth.point_in_base(place) - ANCHORS[feature]).norm() - zeros[feature];
            observations.lengths.extend(contacts(place, feature, shape, length + NOISE * normal(&mut rng)));
        }
        case.observations = observations;
        check(name, &case, &truth, 0.08);
        let found = found(&case);
        for (index, anchor) in ANCHORS.iter().enumerate() {
            let feature = found.features[index].unwrap();
            assert!((feature.size - zeros[index]).abs() < 0.3 * MILLIMETRE, "{feature:?}");
            let sigma = found.feature_covariances[index].trace().sqrt();
            assert!(sigma < 0.3 * MILLIMETRE && (feature.at - anchor).norm() < 3.0 * sigma, "{feature:?} {sigma}");
        }
    }
}

#[test]
fn ball_bars_with_an_unknown_fixed_end_find_the_arm() {
    let ends = [Point3::new(1.1, 0.3, 0.4), Point3::new(0.9, -0.6, 0.9), Point3::new(-0.5, 1.0, 0.8)];
    for (name, shape) in [("ball bar", Shape::Point), ("ball bars of unknown length beside a known one", Shape::Sphere)]
    {
        let mut rng = seeded(22);
        let mut case = PaperCase::new(Vec::new());
        let truth = case.problem().arm_with(&paper_deviations());
        let bar = 0.45;
        let mut observations = Observations { features: vec![Shape::Point, shape, shape], ..Observations::default() };
        for (feature, end) in ends.iter().enumerate() {
            let on_sphere =
                |rng: &mut ChaCha8Rng| end + bar * Vector3::new(uniform(rng), uniform(rng), uniform(rng)).normalize();
            let length = if observations.features[feature] == Shape::Point { bar } else { 0.0 };
            for place in touching(&truth, 70, &mut rng, &on_sphere) {
                let shape = observations.features[feature];
                observations.lengths.extend(contacts(&place, feature, shape, length));
            }
        }
        case.observations = observations;
        check(name, &case, &truth, 0.1);
    }
}

#[test]
fn planes_lines_and_circles_find_the_arm() {
    let mut rng = seeded(23);
    let mut case = PaperCase::new(Vec::new());
    let truth = case.problem().arm_with(&paper_deviations());
    let features = vec![Shape::Plane, Shape::Plane, Shape::Plane, Shape::Line, Shape::Circle, Shape::KnownCircle];
    let mut observations = Observations { features, ..Observations::default() };
    let planes = [
        (Point3::new(1.0, 0.2, 0.3), Vector3::new(0.05, 0.1, 1.0)),
        (Point3::new(1.2, 0.0, 0.7), Vector3::new(-1.0, 0.2, 0.1)),
        (Point3::new(0.5, 0.9, 0.7), Vector3::new(0.1, -1.0, 0.2)),
    ];
    for (feature, (at, normal)) in planes.iter().enumerate() {
        let normal = UnitVector3::new_normalize(*normal);
        for height in [0.0, 0.1] {
            let on_plane = |rng: &mut ChaCha8Rng| {
                let off = 0.4 * Vector3::new(uniform(rng), uniform(rng), uniform(rng));
                at + off - *normal * normal.dot(&off) + *normal * height
            };
            for place in touching(&truth, 40, &mut rng, &on_plane) {
                observations.lengths.extend(contacts(&place, feature, Shape::Plane, height));
            }
        }
    }
    let on_line = |rng: &mut ChaCha8Rng| Point3::new(0.9, 0.0, 0.6) + 0.6 * uniform(rng) * Vector3::new(0.3, 0.9, 0.2);
    for place in touching(&truth, 30, &mut rng, &on_line) {
        observations.lengths.extend(contacts(&place, 3, Shape::Line, 0.0));
    }
    for (feature, radius) in [(4, 0.0), (5, 0.3)] {
        let axis = UnitVector3::new_normalize(Vector3::new(-0.2, 0.1, 1.0));
        let first = axis.cross(&Vector3::y()).normalize();
        let second = axis.cross(&first);
        let on_circle = move |rng: &mut ChaCha8Rng| {
            let (sine, cosine) = (3.0 * uniform(rng)).sin_cos();
            Point3::new(0.9, 0.1, 0.7) + 0.3 * (first * cosine + second * sine)
        };
        let shape = observations.features[feature];
        for place in touching(&truth, 30, &mut rng, &on_circle) {
            observations.lengths.extend(contacts(&place, feature, shape, radius));
        }
    }
    case.observations = observations;
    check("planes, lines and circles", &case, &truth, 0.12);
}

#[test]
fn a_wrong_length_to_a_point_is_found() {
    let mut rng = seeded(24);
    let mut case = PaperCase::new(Vec::new());
    let truth = case.problem().arm_with(&paper_deviations());
    let mut observations = Observations { features: vec![Shape::Point; 3], ..Observations::default() };
    for (index, place) in random_places(150, &mut rng).iter().enumerate() {
        let wrong = if [11, 90].contains(&index) { 3.0 * MILLIMETRE } else { 0.0 };
        let length = (truth.point_in_base(place) - ANCHORS[index % 3]).norm() + wrong + NOISE * normal(&mut rng);
        observations.lengths.extend(contacts(place, index % 3, Shape::Point, length));
    }
    case.observations = observations;
    let rejected: Vec<SampleIndex> = found(&case).rejected.iter().map(|rejected| rejected.sample).collect();
    assert_eq!(rejected, [11, 90].map(SampleIndex::Length));
}

/// A table of draw-wire lengths of an arm whose second link is 1 mm longer.
fn table(profile: &Profile) -> String {
    let nominal = profile.arm();
    let truth = nominal.with([(ParameterId::Link { joint: 1, parameter: LinkParameter::A }, MILLIMETRE)]).unwrap();
    let mut rng = seeded(25);
    let mut table = "feature,shape,q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg,length_mm,sigma_mm,note\n".to_owned();
    for (index, place) in random_places(120, &mut rng).iter().enumerate() {
        let feature = index % 3;
        let length = (truth.point_in_base(place) - ANCHORS[feature]).norm() + NOISE * normal(&mut rng);
        let joints: Vec<String> = place.configuration.iter().map(|q| format!("{:.6}", q.to_degrees())).collect();
        let part = if index % 4 == 3 { "check" } else { "" };
        let (length, sigma) = (length / MILLIMETRE, NOISE / MILLIMETRE);
        writeln!(table, "post {feature},point,{},{length:.4},{sigma},{part}", joints.join(",")).unwrap();
    }
    table
}

#[test]
fn the_command_takes_a_table_of_lengths_to_unknown_points() {
    let (profile, _) = Profile::parse(builtin("soochow").unwrap(), "soochow").unwrap();
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("wires.csv");
    fs::write(&file, table(&profile)).unwrap();
    let arguments = [
        "constraints",
        "--profile",
        "soochow",
        "--measurements",
        file.to_str().unwrap(),
        "--level",
        "geometric",
        "--use",
        "note != 'check'",
        "--verify-rest",
    ];
    let output = trupose(&[&arguments[..], &["--json"]].concat());
    let report: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let features = report["features"].as_array().unwrap();
    assert_eq!(features.iter().map(|feature| feature["contacts"].as_u64().unwrap()).collect::<Vec<_>>(), [30, 30, 30]);
    assert_eq!(features[1]["name"], "post 1");
    let link = report["parameters"].as_array().unwrap().iter().find(|parameter| parameter["name"] == "a2").unwrap();
    assert!((link["deviation"].as_f64().unwrap() - 1.0).abs() < 3.0 * link["sigma"].as_f64().unwrap(), "{link}");
    // Verified where the identification found the posts, on rows that it did not see.
    let verification = &report["verification"];
    assert!(verification["identified"]["distance_mm"]["rms"].as_f64().unwrap() < 0.06, "{verification}");
    assert!(verification["nominal"]["distance_mm"]["rms"].as_f64().unwrap() > 0.1, "{verification}");
    let shown = text(&trupose(&arguments).stdout);
    assert!(shown.contains("Found along with the arm, in its base (mm):"), "{shown}");
    assert!(shown.contains("post 2        point"), "{shown}");
}

#[test]
fn tables_of_contacts_are_checked() {
    use trupose::kinematics::JointType::Revolute;
    use trupose::session::constraints::read_constraints;
    let refused = |table: &str| read_constraints(table, "t.csv", &[Revolute]).unwrap_err().to_string();
    let header = "feature,shape,q1_deg,length_mm\n";
    for (rows, reason) in [
        ("a,cube,1,2\n", "'cube' is not a shape; write 'point', 'wire', 'sphere', 'plane', 'line' or 'circle'"),
        ("a,point,1,\n", "a point needs the measured length in each row"),
        ("a,line,1,3\n", "a line has no measured length"),
        ("a,point,1,3\na,plane,2,3\n", "feature 'a' is on line 2 with another shape"),
        ("a,circle,1,3\na,circle,2,\n", "feature 'a' is on line 2 with another shape, or with a length"),
        ("a,point,1,-3\n", "'-3' is not a length"),
        (",point,1,3\n", "line 2, column 'feature': the cell is empty"),
    ] {
        let message = refused(&format!("{header}{rows}"));
        assert!(message.contains(reason), "{message}");
    }
    let few = read_constraints("anchor,q1_deg,length_mm\np,1,900\np,2,901\n", "t.csv", &[Revolute]).unwrap();
    let trupose::session::constraints::Constraints::Contacts(few) = few else { panic!("{few:?}") };
    assert_eq!((few.features[0].shape, few.rows.len(), few.warnings.len()), (Shape::Point, 2, 1));
    assert!(few.warnings[0].to_string().contains("only show where it is; at least 4 tell"), "{}", few.warnings[0]);
}
