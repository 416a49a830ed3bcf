//! Circles and targets are found where they are, with the right standard deviations.

use std::f64::consts::TAU;

use rand::SeedableRng as _;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution as _, StandardNormal};

use super::*;
use crate::kinematics::{Arm, LinkParameter, ParameterId};
use crate::profile::{Level, Profile, builtin, builtin_names};

const NOISE: f64 = 10.0 * MICROMETRE;

fn normal(rng: &mut ChaCha8Rng) -> f64 {
    StandardNormal.sample(rng)
}

fn noisy(points: &[Point3<f64>], sigma: f64, rng: &mut ChaCha8Rng) -> Vec<Point3<f64>> {
    points.iter().map(|point| point + Vector3::from_fn(|_, _| sigma * normal(rng))).collect()
}

/// A circle of 80 mm, 3 m from the tracker: centre, normal, points along an arc.
fn circle(count: usize, arc_deg: f64) -> (Point3<f64>, Vector3<f64>, Vec<Point3<f64>>) {
    let pose = Isometry3::new(Vector3::new(2.0, -2.1, 0.7), Vector3::new(0.4, -1.2, 0.8));
    let angle = |index: usize| 0.3 + arc_deg * DEGREE * index as f64 / (count - 1) as f64;
    let points = (0..count).map(|index| pose * Point3::new(0.08 * angle(index).cos(), 0.08 * angle(index).sin(), 0.0));
    (pose * Point3::origin(), pose * Vector3::z(), points.collect())
}

#[test]
fn an_exact_circle_is_found_exactly() {
    for (count, arc_deg) in [(3, 200.0), (4, 300.0), (12, 30.0), (40, 350.0)] {
        let (centre, axis, points) = circle(count, arc_deg);
        let fit = fit_circle(&points, Some(NOISE)).unwrap();
        assert!((fit.centre - centre).norm() < 1e-11 && (fit.radius - 0.08).abs() < 1e-11, "{count} {arc_deg}");
        assert!((fit.normal.into_inner() - axis).norm() < 1e-10, "{count} {arc_deg}");
        assert!(fit.max < 1e-12 && fit.rms <= fit.max);
        // The largest gap is the open end, or a step.
        let arc = 360.0 - (360.0 - arc_deg).max(arc_deg / (count - 1) as f64);
        assert!((to_deg(fit.arc) - arc).abs() < 1e-6, "{} {arc}", to_deg(fit.arc));
        let backwards: Vec<_> = points.iter().rev().copied().collect();
        let reversed = fit_circle(&backwards, None).unwrap();
        assert!((reversed.normal.into_inner() + axis).norm() < 1e-10);
        assert_eq!(reversed.uncertainty.is_some(), count > 3);
    }
}

#[test]
fn residuals_say_which_point_is_off_and_how() {
    let (centre, axis, mut points) = circle(24, 300.0);
    let outwards = (points[7] - centre).normalize();
    points[7] += outwards * 2e-3;
    points[15] += axis * 1e-3;
    let fit = fit_circle(&points, Some(NOISE)).unwrap();
    let worst = (0..24).max_by(|a, b| fit.residuals[*a].distance().total_cmp(&fit.residuals[*b].distance())).unwrap();
    assert_eq!(worst, 7);
    assert!(fit.residuals[7].radial > 1.5e-3 && fit.residuals[15].out_of_plane > 0.7e-3);
    assert!((fit.max - fit.residuals[7].distance()).abs() < 1e-15 && fit.rms > 20.0 * NOISE);
}

#[test]
fn uncertainty_of_a_circle_is_that_of_repeated_fits() {
    for arc_deg in [40.0, 120.0, 300.0] {
        let (centre, axis, points) = circle(12, arc_deg);
        let mut rng = ChaCha8Rng::seed_from_u64(5);
        let (mut radius, mut tilt, mut middle, mut sigma) = (0.0, 0.0, 0.0, 0.0);
        let stated = fit_circle(&points, Some(NOISE)).unwrap().uncertainty.unwrap();
        for _ in 0..500 {
            let fit = fit_circle(&noisy(&points, NOISE, &mut rng), None).unwrap();
            radius += (fit.radius - 0.08).powi(2) / 500.0;
            tilt += fit.normal.cross(&axis).norm_squared() / 500.0;
            middle += (fit.centre - centre).norm_squared() / 500.0;
            sigma += fit.uncertainty.unwrap().point.powi(2) / 500.0;
        }
        let ratio = |square: f64, sigma: f64| square.sqrt() / sigma;
        assert!((ratio(radius, stated.radius) - 1.0).abs() < 0.1, "{arc_deg}: {}", ratio(radius, stated.radius));
        assert!((ratio(sigma, NOISE) - 1.0).abs() < 0.05, "{arc_deg}: {}", ratio(sigma, NOISE));
        // Worst direction: all directions together are up to √2 and √3 larger.
        assert!((0.93..1.5).contains(&ratio(tilt, stated.normal)), "{arc_deg}: {}", ratio(tilt, stated.normal));
        assert!((0.93..1.8).contains(&ratio(middle, stated.centre)), "{arc_deg}: {}", ratio(middle, stated.centre));
    }
    let of_arc = |arc_deg| fit_circle(&circle(12, arc_deg).2, Some(NOISE)).unwrap().uncertainty.unwrap().centre;
    assert!(of_arc(25.0) > 20.0 * of_arc(300.0));
}

#[test]
fn what_is_not_a_circle_is_said() {
    let (_, _, points) = circle(12, 300.0);
    let line: Vec<Point3<f64>> = (0..9).map(|step| Point3::new(0.1 * f64::from(step), 1.0, 2.0)).collect();
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let on_axis = noisy(&[points[0]; 12], NOISE, &mut rng);
    let (_, _, around) = circle(12, 330.0);
    let small: Vec<Point3<f64>> = around.iter().map(|point| Point3::from(point.coords * 0.03)).collect();
    let messages = [
        fit_circle(&points[..2], None).unwrap_err(),
        fit_circle(&on_axis, None).unwrap_err(),
        fit_circle(&noisy(&line, NOISE, &mut rng), None).unwrap_err(),
        fit_circle(&small, None).unwrap_err(),
        fit_circle(&circle(12, 15.0).2, None).unwrap_err(),
        fit_circle(&[points[0], points[1], points[2], Point3::new(f64::NAN, 0.0, 0.0)], None).unwrap_err(),
    ];
    insta::assert_snapshot!(messages.map(|error| error.to_string()).join("\n"), @r"
    2 points (2 different) do not fix a circle: at least 3 different ones are needed, and 4 to see an error
    12 points (1 different) do not fix a circle: at least 3 different ones are needed, and 4 to see an error; if the joint did turn, the SMR sits on its axis: mount it beside the axis
    the points lie on a line: turn the joint further
    the circle has a radius of 2.400 mm: the SMR sits too near to the axis; mount it at least 5 mm beside it, better 50 mm
    the points cover only 15.0 deg of the circle: from 20 deg on it is usable, 90 deg or more are good
    a point has a number that is not finite
    ");
}

/// Points of both series.
type Series = [Vec<Point3<f64>>; 2];

/// A cell in which the last two joints are turned: the readings of both series are exact.
struct Case {
    profile: Profile,
    truth: KinematicChain,
    target: Point3<f64>,
    configurations: [Vec<Vec<f64>>; 2],
}

impl Case {
    fn new(name: &str) -> Self {
        Self::with_points(name, 12)
    }

    fn with_points(name: &str, count: usize) -> Self {
        let (profile, _) = Profile::parse(builtin(name).unwrap(), name).unwrap();
        let chain = profile.chain();
        let limits: Vec<(f64, f64)> = profile.joints().iter().map(|joint| joint.limits.unwrap()).collect();
        let base: Vec<f64> = limits.iter().map(|(low, high)| low + 0.6 * (high - low)).collect();
        let last = chain.dof() - 1;
        let plan = |joint| circle_plan(chain, &limits, joint, &base, count).unwrap();
        let configurations = [plan(last), plan(last - 1)];
        let truth = chain.clone();
        Self { truth, target: Point3::new(0.045, -0.03, 0.062), configurations, profile }
    }

    fn points(&self) -> Series {
        let tracker_from_base = Isometry3::from_parts(
            Translation3::new(2.9, -1.1, 0.6),
            UnitQuaternion::from_scaled_axis(Vector3::new(0.3, -0.2, 2.1)),
        );
        let arm = ForwardKinematics::new(&self.truth);
        [0, 1].map(|series: usize| {
            let all = self.configurations[series].iter();
            all.map(|q| tracker_from_base * arm.point_in_base(q, &self.target)).collect()
        })
    }

    fn expected(&self) -> Vec<FreeParameter> {
        self.profile.parameters(Level::default())
    }

    fn locate(
        &self,
        points: &Series,
        sigma: Option<f64>,
        expected: &[FreeParameter],
    ) -> Result<TargetLocation, CirclePointError> {
        let chain = self.profile.chain();
        let last = chain.dof() - 1;
        let series = |index: usize| CircleSeries {
            joint: last - index,
            configurations: &self.configurations[index],
            points: &points[index],
        };
        locate_target(chain, &series(0), &series(1), sigma, expected)
    }
}

/// All shipped arms whose last two axes are not parallel.
fn suitable() -> impl Iterator<Item = &'static str> {
    builtin_names().filter(|name| *name != "epson_ls3_b401s")
}

#[test]
fn exact_readings_give_the_exact_target_on_every_arm() {
    let mut tried = 0;
    for name in suitable() {
        for count in [4, 15] {
            let case = Case::with_points(name, count);
            let points = case.points();
            let found = case.locate(&points, Some(NOISE), &[]).unwrap();
            assert!((found.point_in_flange - case.target).norm() < 1e-10, "{name}: {}", found.point_in_flange);
            assert!(found.max() < 1e-10 && (found.covariance - found.measured).norm() < 1e-18, "{name}");
            // The other order of the series gives the same.
            let chain = case.profile.chain();
            let last = chain.dof() - 1;
            let series = |joint, configurations, points| CircleSeries { joint, configurations, points };
            let a = series(last - 1, &case.configurations[1], &points[1]);
            let b = series(last, &case.configurations[0], &points[0]);
            let other = locate_target(chain, &a, &b, None, &[]).unwrap();
            assert!((other.point_in_flange - case.target).norm() < 1e-10, "{name}");
            tried += 1;
        }
    }
    assert!(tried >= 20);
}

/// Mean of `error² / covariance` per axis over many trials, rooted: 1 if the covariance is right.
fn normalised(trials: usize, mut trial: impl FnMut() -> (Vector3<f64>, Matrix3<f64>)) -> Vector3<f64> {
    let mut sum = Vector3::zeros();
    for _ in 0..trials {
        let (error, covariance) = trial();
        sum += error.component_mul(&error).component_div(&covariance.diagonal()) / trials as f64;
    }
    sum.map(f64::sqrt)
}

#[test]
fn readings_with_noise_have_the_stated_sigma() {
    for name in ["soochow", "ur5", "franka_panda", "kuka_kr6_r900"] {
        let case = Case::new(name);
        let exact = case.points();
        let mut rng = ChaCha8Rng::seed_from_u64(11);
        let mut square = 0.0;
        let ratio = normalised(500, || {
            let points = [0, 1].map(|series: usize| noisy(&exact[series], NOISE, &mut rng));
            let found = case.locate(&points, Some(NOISE), &[]).unwrap();
            square += (found.rms / found.expected_rms).powi(2) / 500.0;
            (found.point_in_flange - case.target, found.measured)
        });
        assert!(ratio.iter().all(|ratio| (0.9..1.1).contains(ratio)), "{name}: {ratio}");
        assert!((square.sqrt() - 1.0_f64).abs() < 0.03, "{name}: {square}");
        let points = [0, 1].map(|series: usize| noisy(&exact[series], NOISE, &mut rng));
        let estimated = case.locate(&points, None, &[]).unwrap().reading_sigma;
        assert!((0.6..1.4).contains(&(estimated / NOISE)), "{name}: {estimated}");
    }
}

#[test]
fn deviations_of_the_last_links_are_in_the_covariance() {
    for name in ["soochow", "ur5", "franka_panda"] {
        let mut case = Case::new(name);
        let expected = case.expected();
        let nominal = case.profile.arm();
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        let mut square = 0.0;
        let ratio = normalised(500, || {
            let drawn: Vec<(ParameterId, f64)> =
                expected.iter().map(|free| (free.id, free.expected * normal(&mut rng))).collect();
            case.truth = nominal.with(drawn).unwrap().chain;
            let points = case.points().map(|points| noisy(&points, NOISE, &mut rng));
            let found = case.locate(&points, Some(NOISE), &expected).unwrap();
            square += (found.rms / found.expected_rms).powi(2) / 500.0;
            assert!(found.sigma().iter().all(|sigma| *sigma > 2.0 * found.measured.diagonal().max().sqrt()));
            (found.point_in_flange - case.target, found.covariance)
        });
        assert!(ratio.iter().all(|ratio| (0.9..1.1).contains(ratio)), "{name}: {ratio}");
        assert!((square.sqrt() - 1.0_f64).abs() < 0.1, "{name}: {}", square.sqrt());
    }
}

#[test]
fn the_deviations_of_the_rest_of_the_arm_do_not_matter() {
    let mut case = Case::new("soochow");
    let of_joint = |joint: usize| {
        let parameters = [LinkParameter::Alpha, LinkParameter::A, LinkParameter::D, LinkParameter::Theta];
        parameters.map(|parameter| (ParameterId::Link { joint, parameter }, 3e-3))
    };
    case.truth = Arm::from(case.truth).with((0..4).flat_map(of_joint)).unwrap().chain;
    let found = case.locate(&case.points(), None, &case.expected()).unwrap();
    assert!((found.point_in_flange - case.target).norm() < 1e-10 && found.max() < 1e-10);
}

#[test]
fn gross_errors_are_seen_in_the_residual() {
    let case = Case::new("soochow");
    let expected = case.expected();
    let mut points = case.points();
    points[0][4] += Vector3::new(0.0, 0.05, 0.0);
    let found = case.locate(&points, Some(NOISE), &expected).unwrap();
    assert!(found.rms > 5.0 * found.expected_rms, "{} {}", found.rms, found.expected_rms);
    let worst = found.residuals[0].iter().copied().fold(0.0, f64::max);
    assert!((worst - found.residuals[0][4]).abs() < 1e-15 && (worst - found.max()).abs() < 1e-15);
}

#[test]
fn a_wrong_sense_shows_in_the_residual_or_on_the_other_side_of_the_flange() {
    let mirror = |points: Series| points.map(|p| p.iter().map(|p| Point3::new(-p.x, p.y, p.z)).collect());
    for (name, wrist_behind_flange) in [("soochow", Some(0.125)), ("ur5", Some(0.0823)), ("franka_panda", None)] {
        let mut case = Case::new(name);
        let (points, expected) = (case.points(), case.expected());
        let last = case.truth.dof() - 1;
        let mirrored = case.locate(&mirror(points.clone()), Some(NOISE), &expected).unwrap();
        for q in case.configurations.iter_mut().flatten() {
            q[last] = -q[last];
        }
        let reversed = case.locate(&points, Some(NOISE), &expected).unwrap();
        for found in [mirrored, reversed] {
            if let Some(behind) = wrist_behind_flange {
                let reflected = -case.target.z - 2.0 * behind;
                assert!((found.point_in_flange.z - reflected).abs() < 1e-9 && found.max() < 1e-9, "{name}");
            } else {
                assert!(found.rms > 5.0 * found.expected_rms, "{name}: {} {}", found.rms, found.expected_rms);
            }
        }
    }
}

#[test]
fn series_that_do_not_tell_the_place_are_refused() {
    let case = Case::new("ur5e");
    let points = case.points();
    let error = |change: &dyn Fn(&mut Case, &mut Series)| {
        let mut case = Case::new("ur5e");
        let mut points = points.clone();
        change(&mut case, &mut points);
        case.locate(&points, Some(NOISE), &[]).unwrap_err().to_string()
    };
    let mut on_axis = Case::new("ur5e");
    on_axis.target = Point3::new(0.0, 0.0, 0.031);
    let origins = [Point3::origin(); 4];
    let scara = Profile::parse(builtin("epson_ls3_b401s").unwrap(), "epson").unwrap().0;
    let q = vec![vec![0.1; 4]; 4];
    let series = |joint| CircleSeries { joint, configurations: &q, points: &origins };
    let scara_error = |a, b| locate_target(scara.chain(), &series(a), &series(b), None, &[]).unwrap_err().to_string();
    let messages = [
        error(&|_, points| points[0].truncate(5)),
        error(&|case, points| {
            case.configurations[1].truncate(2);
            points[1].truncate(2);
        }),
        error(&|case, _| case.configurations[1][3][2] += 0.1),
        error(&|case, _| case.configurations[0].iter_mut().for_each(|q| q[0] += 0.01)),
        on_axis.locate(&on_axis.points(), None, &[]).unwrap_err().to_string(),
        scara_error(3, 2),
        scara_error(1, 0),
    ];
    insta::assert_snapshot!(messages.join("\n"), @r"
    joint J6: 12 configurations and 5 points; each point needs a configuration of 6 joint values
    joint J5: 2 points (2 different) do not fix a circle: at least 3 different ones are needed, and 4 to see an error
    joint J3 moved while joint J5 was turned: only the last two joints may move, one after the other
    joint J1 moved while joint J5 was turned: only the last two joints may move, one after the other
    joint J6: 12 points (1 different) do not fix a circle: at least 3 different ones are needed, and 4 to see an error; if the joint did turn, the SMR sits on its axis: mount it beside the axis
    joint J3 slides: it makes no circle; give the place of the SMR, or leave it free
    circles of the last two joints are needed, one of each; the arm has 4 joints
    ");

    // An arm that ends with two parallel axes.
    let joints = scara.chain().joints()[..2].to_vec();
    let flat = KinematicChain::new(scara.chain().convention(), *scara.chain().base(), joints, *scara.chain().flange())
        .unwrap();
    let q = vec![vec![0.1; 2]; 4];
    let series = |joint| CircleSeries { joint, configurations: &q, points: &origins };
    let error = locate_target(&flat, &series(1), &series(0), None, &[]).unwrap_err();
    assert_eq!(error, CirclePointError::Parallel { first: "J1".into(), second: "J2".into() });
}

#[test]
fn a_plan_turns_one_joint_inside_its_limits() {
    let profile = Profile::parse(builtin("soochow").unwrap(), "soochow").unwrap().0;
    let mut limits: Vec<(f64, f64)> = profile.joints().iter().map(|joint| joint.limits.unwrap()).collect();
    let base = [0.1, 0.2, 0.3, 0.4, 0.5, 0.6];
    let turned = |limits: &[(f64, f64)], joint: usize, base: &[f64]| -> (f64, f64) {
        let plan = circle_plan(profile.chain(), limits, joint, base, 10).unwrap();
        let (low, high) = limits[joint];
        for q in &plan {
            assert!(q.iter().zip(base).enumerate().all(|(index, (a, b))| index == joint || (a - b).abs() < 1e-15));
            assert!((low..=high).contains(&q[joint]));
        }
        let steps: Vec<f64> = plan.windows(2).map(|pair| pair[1][joint] - pair[0][joint]).collect();
        assert!(plan.len() == 10 && steps.iter().all(|step| (step - steps[0]).abs() < 1e-9 && *step > 0.0));
        (to_deg(plan[0][joint]), to_deg(plan[9][joint]))
    };
    let near = |a: (f64, f64), b: (f64, f64)| assert!((a.0 - b.0).abs() + (a.1 - b.1).abs() < 1e-9, "{a:?} {b:?}");
    near(turned(&limits, 5, &base), (to_deg(0.6) - 150.0, to_deg(0.6) + 150.0));
    near(turned(&limits, 4, &base), (-120.0, 120.0));
    near(turned(&limits, 5, &[0.0, 0.0, 0.0, 0.0, 0.0, TAU - 0.1]), (60.0, 360.0));
    limits[5] = (-0.1, 0.1);
    assert!(matches!(circle_plan(profile.chain(), &limits, 5, &base, 10), Err(CirclePointError::NarrowLimits { .. })));
    assert_eq!(circle_plan(profile.chain(), &limits, 4, &base, 3), Err(CirclePointError::FewPlanned { count: 3 }));
    assert!(circle_plan(profile.chain(), &limits, 6, &base, 8).is_err());
}

#[test]
fn coupled_joints_make_no_circle() {
    let profile = Profile::parse(builtin("soochow").unwrap(), "soochow").unwrap().0;
    let mut joints = profile.chain().joints().to_vec();
    joints[5].coupling = vec![0.0, 0.0, 0.0, 0.0, 1.0, 0.0];
    let chain = KinematicChain::new(profile.chain().convention(), Isometry3::identity(), joints, Isometry3::identity())
        .unwrap();
    let limits = [(-1.0, 1.0); 6];
    assert_eq!(
        circle_plan(&chain, &limits, 4, &[0.0; 6], 8).unwrap_err().to_string(),
        "joint J5 is coupled: turning it alone moves J6 too, and the SMR leaves its circle"
    );
    assert!(circle_plan(&chain, &limits, 5, &[0.0; 6], 8).is_ok());
}
