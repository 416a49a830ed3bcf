//! Estimates against truth that is known: error bars by Monte Carlo, outliers, mirrored frames, other kinds of data.

use crate::support::paper_case::{
    PaperCase, measure, normal, paper_deviations, paper_parameters, random_configurations, seeded, station_from_base,
};
use nalgebra::{DMatrix, DVector, Point3};
use rand::RngExt as _;
use trupose::geometry::register;
use trupose::identification::predicted::position_covariances;
use trupose::identification::verification::{DirectErrors, ModelErrors};
use trupose::identification::{
    Estimator, Identification, IdentificationError, Length, LengthEnd, Observations, PointSample, Rejected,
    RejectionReason, SampleIndex, Settings, SharedPoint, SigmaSource, TerminationReason, Weighting, identify,
};
use trupose::kinematics::{Arm, Axis, FreeParameter, LinkParameter, ParameterId, Place};
use trupose::units::{MICROMETRE, MILLIMETRE};

const NOISE: f64 = 10.0 * MICROMETRE;

fn settings() -> Settings {
    Settings { sigma: Some((NOISE, SigmaSource::Instrument)), ..Settings::default() }
}

fn run(case: &PaperCase, settings: &Settings) -> Identification {
    identify(&case.problem(), settings, &mut |_| {}).unwrap()
}

/// Deviations drawn from what the parameters are expected to have.
fn drawn_deviations(parameters: &[FreeParameter], rng: &mut rand_chacha::ChaCha8Rng) -> DVector<f64> {
    DVector::from_iterator(parameters.len(), parameters.iter().map(|parameter| parameter.expected * normal(rng)))
}

/// Standard deviation over many calibrations of the error of every identifiable combination, in units of the σ that the
/// result itself states. The combinations are the principal axes of the stated covariance (in expected deviations) within
/// the directions that are not blind.
fn normalised_errors(settings: &Settings, noise: f64) -> Vec<f64> {
    normalised_errors_of(settings, 1000, &|truth, rng| PaperCase::simulated(truth, 56, noise, rng))
}

fn normalised_errors_of(
    settings: &Settings,
    trials: usize,
    simulated: &dyn Fn(&DVector<f64>, &mut rand_chacha::ChaCha8Rng) -> PaperCase,
) -> Vec<f64> {
    let parameters = paper_parameters();
    let scale = DVector::from_iterator(parameters.len(), parameters.iter().map(|p| 1.0 / p.expected));
    let scale = DMatrix::from_diagonal(&scale);
    let mut squares: Vec<f64> = Vec::new();
    for trial in 0..trials {
        let mut rng = seeded(1000 + trial as u64);
        let truth = drawn_deviations(&parameters, &mut rng);
        let case = simulated(&truth, &mut rng);
        let found = run(&case, settings);
        let error = DVector::from_iterator(parameters.len(), found.estimates.iter().map(|e| e.deviation)) - &truth;
        let blind = &found.observability.blind;
        let n = parameters.len();
        let visible = (DMatrix::identity(n, n) - blind * blind.transpose()).symmetric_eigen();
        let columns: Vec<_> = (0..n).filter(|&i| visible.eigenvalues[i] > 0.5).collect();
        let visible = visible.eigenvectors.select_columns(&columns);
        let stated = (visible.transpose() * &scale * &found.covariance * &scale * &visible).symmetric_eigen();
        let mut combinations: Vec<(f64, f64)> = (0..columns.len())
            .map(|index| {
                let direction = &visible * stated.eigenvectors.column(index);
                let z = (direction.transpose() * &scale * &error)[0] / stated.eigenvalues[index].sqrt();
                (stated.eigenvalues[index], z)
            })
            .collect();
        combinations.sort_by(|a, b| a.0.total_cmp(&b.0));
        squares.resize(combinations.len(), 0.0);
        for (sum, (_, z)) in squares.iter_mut().zip(&combinations) {
            *sum += z * z / trials as f64;
        }
    }
    squares.into_iter().map(f64::sqrt).collect()
}

fn place(rejected: &Rejected) -> usize {
    match rejected.sample {
        SampleIndex::Place(place) => place,
        SampleIndex::Length(length) => panic!("length {length} was rejected"),
    }
}

fn root_mean_square(values: &[f64]) -> f64 {
    (values.iter().map(|value| value * value).sum::<f64>() / values.len() as f64).sqrt()
}

#[test]
fn stated_standard_deviations_are_true() {
    let cases = [
        ("covariance", settings(), 0.1),
        ("uniform", Settings { weighting: Weighting::Uniform, ..settings() }, 0.1),
        // An estimated sigma has an uncertainty of its own, which a normal distribution does not know.
        ("estimated sigma", Settings::default(), 0.15),
    ];
    for (name, settings, tolerance) in cases {
        let deviations = normalised_errors(&settings, NOISE);
        assert_eq!(deviations.len(), 21);
        println!("{name}: {deviations:.3?}");
        assert!(deviations.iter().all(|value| (value - 1.0).abs() < tolerance), "{name}: {deviations:.3?}");
        let all = root_mean_square(&deviations);
        assert!((0.9..1.1).contains(&all), "{name}: {all}");
    }
}

/// Every pose of a simulated set read several times: `shots` in turn, with an error of the pose and one of each reading (m).
fn with_shots(case: &mut PaperCase, shots: &[usize], pose: f64, reading: f64, rng: &mut rand_chacha::ChaCha8Rng) {
    let poses = std::mem::take(&mut case.observations.points);
    for (mut sample, count) in poses.into_iter().zip(shots.iter().cycle()) {
        for axis in 0..3 {
            sample.point[axis] += pose * normal(rng);
        }
        for _ in 0..*count {
            let mut shot = sample.clone();
            for axis in 0..3 {
                shot.point[axis] += reading * normal(rng);
            }
            case.observations.points.push(shot);
        }
    }
}

#[test]
fn readings_of_one_pose_share_its_error() {
    for shots in [&[1][..], &[3], &[5], &[1, 3, 5]] {
        for (pose, reading) in [(0.0, 30.0), (20.0, 20.0), (100.0, 10.0)] {
            for stated in [None, Some((reading * MICROMETRE, SigmaSource::Instrument))] {
                let settings = Settings { sigma: stated, ..Settings::default() };
                let deviations = normalised_errors_of(&settings, 100, &|truth, rng| {
                    let mut case = PaperCase::simulated(truth, 56, 0.0, rng);
                    with_shots(&mut case, shots, pose * MICROMETRE, reading * MICROMETRE, rng);
                    case
                });
                let all = root_mean_square(&deviations);
                println!("{shots:?} {pose} {reading} {stated:?}: {all:.3}");
                assert!((0.9..1.1).contains(&all), "{shots:?} {pose} {reading} {stated:?}: {deviations:.3?}");
            }
        }
    }
}

#[test]
fn good_data_converge_in_a_few_steps() {
    for poses in [56, 600, 1500, 12_000] {
        for (stated, pose) in [(None, 0.0), (Some(20.0), 6.0), (Some(10.0), 300.0), (None, 300.0)] {
            for shots in if poses == 56 { &[1, 3, 12][..] } else { &[1] } {
                let mut rng = seeded(5);
                let mut case = PaperCase::simulated(&paper_deviations(), poses, 0.0, &mut rng);
                with_shots(&mut case, &[*shots], pose * MICROMETRE, stated.unwrap_or(20.0) * MICROMETRE, &mut rng);
                let sigma = stated.map(|stated| (stated * MICROMETRE, SigmaSource::Instrument));
                let found = run(&case, &Settings { sigma, ..Settings::default() });
                assert_eq!(found.termination, TerminationReason::Converged, "{poses} {stated:?} {pose} {shots}");
                assert!(found.iterations.len() <= 20, "{poses} {stated:?} {pose} {shots}: {}", found.iterations.len());
            }
        }
    }
}

#[test]
fn a_stated_sigma_below_what_is_found_changes_nothing() {
    let mut rng = seeded(8);
    let mut case = PaperCase::simulated(&paper_deviations(), 56, 0.0, &mut rng);
    with_shots(&mut case, &[1], 200.0 * MICROMETRE, 10.0 * MICROMETRE, &mut rng);
    let unstated = run(&case, &Settings::default());
    let stated = run(&case, &settings());
    for (with, without) in stated.estimates.iter().zip(&unstated.estimates) {
        assert!((with.deviation - without.deviation).abs() < 0.01 * without.sigma, "{}", with.id);
        assert!((with.sigma / without.sigma - 1.0).abs() < 0.01, "{}", with.id);
    }
}

#[test]
fn residuals_larger_than_stated_widen_the_error_bars() {
    let deviations = normalised_errors(&settings(), 3.0 * NOISE);
    let all = root_mean_square(&deviations);
    assert!((0.9..1.1).contains(&all), "{deviations:.3?}");
}

#[test]
fn outliers_are_named_and_really_removed() {
    for seed in 0..20 {
        let mut rng = seeded(seed);
        let mut case = PaperCase::simulated(&paper_deviations(), 56, NOISE, &mut rng);
        let mut bumped: Vec<usize> = (0..5).map(|_| rng.random_range(0..56)).collect();
        bumped.sort_unstable();
        bumped.dedup();
        for &index in &bumped {
            let size = 10_f64.powf(rng.random_range(-0.5..2.0)) * MILLIMETRE;
            case.observations.points[index].point.coords += nalgebra::Vector3::new(0.6, -0.64, 0.48) * size;
        }
        let found = run(&case, &settings());
        let rejected: Vec<usize> = found.rejected.iter().map(place).collect();
        assert_eq!(rejected, bumped, "seed {seed}");
        assert!(found.rejected.iter().all(|rejected| rejected.reason == RejectionReason::Outlier));

        // Removed for real: the result is that of the data without them.
        let mut index = 0;
        case.observations.points.retain(|_| {
            index += 1;
            !bumped.contains(&(index - 1))
        });
        let clean = run(&case, &settings());
        assert!(clean.rejected.is_empty());
        for (with, without) in found.estimates.iter().zip(&clean.estimates) {
            assert!((with.deviation - without.deviation).abs() < 1e-5 * with.expected, "{}", with.id);
            assert!((with.sigma / without.sigma - 1.0).abs() < 1e-6, "{}", with.id);
        }
    }
}

#[test]
fn clean_data_lose_nothing_to_the_robust_estimator() {
    let mut rejected = 0;
    for seed in 0..100 {
        let case = PaperCase::simulated(&paper_deviations(), 56, NOISE, &mut seeded(seed));
        rejected += run(&case, &settings()).rejected.len();
    }
    assert_eq!(rejected, 0);
}

#[test]
fn swapped_rows_are_recognised() {
    let mut case = PaperCase::simulated(&paper_deviations(), 56, NOISE, &mut seeded(3));
    let points = &mut case.observations.points;
    let first = points[17].point;
    points[17].point = points[40].point;
    points[40].point = first;
    let found = run(&case, &settings());
    let reasons: Vec<_> = found.rejected.iter().map(|rejected| (place(rejected), rejected.reason)).collect();
    assert_eq!(reasons, [(17, RejectionReason::SwappedWith(40)), (40, RejectionReason::SwappedWith(17))]);
}

#[test]
fn a_mirrored_frame_is_refused() {
    for weighting in [Weighting::Covariance, Weighting::Uniform] {
        let mut case = PaperCase::simulated(&paper_deviations(), 30, NOISE, &mut seeded(4));
        for sample in &mut case.observations.points {
            sample.point.y = -sample.point.y;
        }
        let refused = identify(&case.problem(), &Settings { weighting, ..settings() }, &mut |_| {}).unwrap_err();
        assert!(matches!(refused, IdentificationError::Mirrored { .. }), "{refused}");
    }
}

#[test]
fn joint_offsets_alone() {
    let mut truth = paper_deviations();
    // All six joints turn.
    let is_offset = |id| matches!(id, ParameterId::Link { parameter: LinkParameter::Theta, .. });
    for (value, parameter) in truth.iter_mut().zip(paper_parameters()) {
        if !is_offset(parameter.id) {
            *value = 0.0;
        }
    }
    let mut case = PaperCase::simulated(&truth, 20, NOISE, &mut seeded(5));
    case.parameters.retain(|parameter| is_offset(parameter.id));
    let found = run(&case, &settings());
    assert_eq!((found.estimates.len(), found.observability.rank), (6, Some(5)));
    let truth: Vec<f64> =
        truth.iter().zip(paper_parameters()).filter(|(_, p)| is_offset(p.id)).map(|(v, _)| *v).collect();
    for (estimate, truth) in found.estimates.iter().zip(truth).skip(1) {
        assert!((estimate.deviation - truth).abs() < 4.0 * estimate.sigma, "{} {estimate:?} {truth}", estimate.id);
    }
}

#[test]
fn several_targets_are_identified_together() {
    let mut rng = seeded(6);
    let mut case = PaperCase::new(Vec::new());
    let second = Point3::new(0.08, -0.05, 0.06);
    case.arm.targets.push(second);
    for target in 0..2 {
        case.parameters.extend(
            Axis::ALL
                .map(|axis| FreeParameter { id: ParameterId::Target { target, axis }, expected: 50.0 * MILLIMETRE }),
        );
    }
    let mut truth = paper_deviations().as_slice().to_vec();
    truth.extend([3e-3, -2e-3, 1e-3, -8e-3, 5e-3, 12e-3]);
    let truth = DVector::from_vec(truth);
    let model = case.problem().arm_with(&truth);
    for (index, configuration) in random_configurations(60, &mut rng).into_iter().enumerate() {
        let mut samples = measure(&model, &[configuration], 0.0, &mut rng);
        let sample = &mut samples[0];
        sample.at.target = index % 2;
        sample.point = station_from_base() * model.point_in_base(&sample.at);
        for axis in 0..3 {
            sample.point[axis] += NOISE * normal(&mut rng);
        }
        case.observations.points.append(&mut samples);
    }
    let found = run(&case, &settings());
    // Two targets see the turn of the last joint against each other: what one target leaves open in the last link is theirs.
    let fresh: Vec<PointSample> = (0..2)
        .flat_map(|target| {
            let mut samples = measure(&model, &random_configurations(100, &mut rng), 0.0, &mut rng);
            for sample in &mut samples {
                sample.at.target = target;
                sample.point = station_from_base() * model.point_in_base(&sample.at);
            }
            samples
        })
        .collect();
    let errors = ModelErrors::new(&found.arm, &found.base_from_station, &fresh).unwrap();
    assert!(errors.position.rms < 12.0 * MICROMETRE, "{:?}", errors.position);
}

#[test]
fn two_stations_share_one_robot() {
    let mut rng = seeded(7);
    let mut case = PaperCase::simulated(&paper_deviations(), 60, NOISE, &mut rng);
    let moved =
        nalgebra::Isometry3::new(nalgebra::Vector3::new(-4.0, 1.0, 0.3), nalgebra::Vector3::new(0.1, 0.4, -2.0));
    for sample in case.observations.points.iter_mut().skip(30) {
        sample.station = 1;
        sample.point = moved * sample.point;
    }
    let found = run(&case, &settings());
    assert_eq!(found.base_from_station.len(), 2);
    assert_eq!(found.observability.rank, Some(21));
    let residual = found.sigma.from_residuals.unwrap();
    assert!((0.8..1.2).contains(&(residual / NOISE)), "{residual}");
}

#[test]
fn lengths_alone_identify_the_robot() {
    let mut rng = seeded(8);
    let mut case = PaperCase::new(Vec::new());
    let truth = case.problem().arm_with(&paper_deviations());
    let mut place = || Place { configuration: random_configurations(1, &mut rng).remove(0), target: 0 };
    let pairs: Vec<(Place, Place)> = (0..200).map(|_| (place(), place())).collect();
    let lengths = pairs.into_iter().map(|(from, to)| {
        let length = (truth.point_in_base(&to) - truth.point_in_base(&from)).norm() + NOISE * normal(&mut rng);
        Length { from: LengthEnd::Target(from), to: LengthEnd::Target(to), length, sigma: Some(NOISE) }
    });
    case.observations = Observations { lengths: lengths.collect(), ..Observations::default() };
    let found = run(&case, &settings());
    assert_eq!(found.observability.rank, Some(21));
    for (estimate, truth) in
        found.estimates.iter().zip(&paper_deviations()).filter(|(estimate, _)| estimate.identifiable)
    {
        assert!((estimate.deviation - truth).abs() < 4.5 * estimate.sigma, "{} {estimate:?} {truth}", estimate.id);
        assert!(estimate.sigma < 0.5 * estimate.expected, "{} {estimate:?}", estimate.id);
    }
}

/// Configurations that put the target into one point, found by Gauss–Newton from random ones.
fn seated(model: &Arm, socket: Point3<f64>, count: usize, rng: &mut rand_chacha::ChaCha8Rng) -> Vec<Place> {
    let arm = trupose::kinematics::ForwardKinematics::new(&model.chain);
    let mut seats = Vec::new();
    while seats.len() < count {
        let mut q = random_configurations(1, rng).remove(0);
        for _ in 0..30 {
            let jacobian = arm.configuration_jacobian(&q, &model.targets[0]);
            let linear = jacobian.matrix.fixed_rows::<3>(0).into_owned();
            let step = linear.pseudo_inverse(1e-6).unwrap() * (socket - jacobian.point_in_base);
            q.iter_mut().zip(step.iter()).for_each(|(q, step)| *q += step.clamp(-0.2, 0.2));
        }
        if (arm.point_in_base(&q, &model.targets[0]) - socket).norm() < 1e-9 {
            seats.push(Place { configuration: q, target: 0 });
        }
    }
    seats
}

#[test]
fn balls_in_sockets_identify_the_robot_without_an_instrument() {
    let mut rng = seeded(9);
    let mut case = PaperCase::new(Vec::new());
    let truth = case.problem().arm_with(&paper_deviations());
    let mut observations = Observations::default();
    for position in 0..6 {
        let angle = f64::from(position);
        let socket = Point3::new(1.0 + 0.25 * angle.cos(), 0.5 * angle.sin(), 0.4 + 0.12 * angle);
        for offset in [0.0, 0.05] {
            let at = seated(&truth, socket + nalgebra::Vector3::new(0.0, offset, 0.0), 25, &mut rng);
            observations.shared.push(SharedPoint { at });
        }
        let index = observations.shared.len();
        observations.lengths.push(Length {
            from: LengthEnd::SharedPoint(index - 2),
            to: LengthEnd::SharedPoint(index - 1),
            length: 0.05,
            sigma: Some(NOISE),
        });
    }
    case.observations = observations;
    let before = DirectErrors::new(&case.arm, &[], &case.observations);
    let found = run(&case, &settings());
    let after = DirectErrors::new(&found.arm, &[], &case.observations);
    assert!(before.seat.unwrap().rms > 5.0 * MILLIMETRE, "{:?}", before.seat);
    assert!(after.seat.unwrap().max < 1.0 * MICROMETRE, "{:?}", after.seat);
    assert_eq!(found.observability.rank, Some(21));
    let fresh = measure(&truth, &random_configurations(200, &mut rng), 0.0, &mut rng);
    let setup = trupose::identification::verification::fit_setup(
        &found.arm,
        &[],
        &Observations { points: fresh.clone(), ..Observations::default() },
    )
    .unwrap();
    let errors = ModelErrors::new(&setup.arm, &setup.base_from_station, &fresh).unwrap();
    assert!(errors.position.rms < 0.2 * MILLIMETRE, "{:?}", errors.position);
}

#[test]
fn a_few_loose_readings_do_not_hide_a_wrong_sigma() {
    let mut rng = seeded(11);
    let mut case = PaperCase::simulated(&paper_deviations(), 56, 0.0, &mut rng);
    // Fifty readings promise 10 µm and scatter by 200, six promise 5 mm and keep it.
    for (index, sample) in case.observations.points.iter_mut().enumerate() {
        let (stated, real) = if index < 50 { (NOISE, 20.0 * NOISE) } else { (5.0 * MILLIMETRE, 5.0 * MILLIMETRE) };
        sample.sigma = Some(stated);
        for axis in 0..3 {
            sample.point[axis] += real * normal(&mut rng);
        }
    }
    let found = run(&case, &Settings { estimator: Estimator::LeastSquares, ..Settings::default() });
    assert!((15.0..25.0).contains(&found.sigma.excess()), "{:?}", found.sigma);
    for (estimate, truth) in found.estimates.iter().zip(&paper_deviations()) {
        assert!((estimate.deviation - truth).abs() < 4.5 * estimate.sigma, "{} {estimate:?} {truth}", estimate.id);
    }
}

#[test]
fn readings_that_declare_their_scatter_are_not_outliers() {
    let mut rng = seeded(12);
    let mut case = PaperCase::simulated(&paper_deviations(), 56, 0.0, &mut rng);
    for (index, sample) in case.observations.points.iter_mut().enumerate() {
        let sigma = if index % 8 == 0 { 3.0 * MILLIMETRE } else { NOISE };
        sample.sigma = Some(sigma);
        for axis in 0..3 {
            sample.point[axis] += sigma * normal(&mut rng);
        }
    }
    let found = run(&case, &Settings::default());
    assert_eq!(found.rejected, []);
    assert!(found.sigma.excess() < 1.3, "{:?}", found.sigma);
}

#[test]
fn a_mistyped_joint_is_found_although_that_joint_hardly_moves() {
    for (range, wanted) in [(2.0_f64, 17), (10.0, 19), (40.0, 19), (360.0, 19)] {
        let mut found_alone = 0;
        for seed in 0..20 {
            let mut rng = seeded(100 + seed);
            let mut configurations = random_configurations(50, &mut rng);
            for configuration in &mut configurations {
                configuration[3] *= range / 360.0;
            }
            let mut case = PaperCase::new(Vec::new());
            let truth = case.problem().arm_with(&paper_deviations());
            case.observations.points = measure(&truth, &configurations, NOISE, &mut rng);
            let wrong = rng.random_range(0..50);
            let typed = rng.random_range(30.0..120.0_f64) * if rng.random_bool(0.5) { 1.0 } else { -1.0 };
            case.observations.points[wrong].at.configuration[3] += typed.to_radians();
            let found = run(&case, &settings());
            let rejected: Vec<usize> = found.rejected.iter().map(place).collect();
            found_alone += usize::from(rejected == [wrong]);
        }
        println!("joint 4 over {range} deg: {found_alone} of 20");
        assert!(found_alone >= wanted, "joint 4 over {range} deg: {found_alone} of 20");
    }
}

#[test]
fn wrong_lengths_are_found_as_well() {
    let mut rng = seeded(13);
    let mut case = PaperCase::new(Vec::new());
    let truth = case.problem().arm_with(&paper_deviations());
    let mut place = || Place { configuration: random_configurations(1, &mut rng).remove(0), target: 0 };
    let pairs: Vec<(Place, Place)> = (0..120).map(|_| (place(), place())).collect();
    let lengths = pairs.into_iter().enumerate().map(|(index, (from, to))| {
        let wrong = if [7, 50, 93].contains(&index) { 2.0 * MILLIMETRE } else { 0.0 };
        let length = (truth.point_in_base(&to) - truth.point_in_base(&from)).norm() + NOISE * normal(&mut rng) + wrong;
        Length { from: LengthEnd::Target(from), to: LengthEnd::Target(to), length, sigma: Some(NOISE) }
    });
    case.observations = Observations { lengths: lengths.collect(), ..Observations::default() };
    let found = run(&case, &settings());
    let rejected: Vec<SampleIndex> = found.rejected.iter().map(|rejected| rejected.sample).collect();
    assert_eq!(rejected, [7, 50, 93].map(SampleIndex::Length));
    assert!(found.rejected.iter().all(|rejected| (rejected.residual / MILLIMETRE - 2.0).abs() < 0.1));
    assert!(found.sigma.excess() < 1.3, "{:?}", found.sigma);
}

#[test]
fn a_sigma_in_the_wrong_unit_does_not_drown_the_expected_deviations() {
    let case = PaperCase::simulated(&paper_deviations(), 56, NOISE, &mut seeded(14));
    let found = run(&case, &Settings { sigma: Some((1e-12, SigmaSource::Option)), ..Settings::default() });
    for estimate in found.estimates.iter().filter(|estimate| estimate.id.to_string() == "theta1") {
        assert!((estimate.sigma / estimate.expected - 1.0).abs() < 0.01, "{estimate:?}");
    }
    assert!(found.sigma.excess() > 10.0);
}

#[test]
fn predicted_position_errors_are_those_of_many_calibrations() {
    const TRIALS: u64 = 150;
    const PLACES: usize = 12;
    let parameters = paper_parameters();
    let places: Vec<Place> = random_configurations(PLACES, &mut seeded(77))
        .into_iter()
        .map(|configuration| Place { configuration, target: 0 })
        .collect();
    let places: Vec<&Place> = places.iter().collect();
    let (mut stated, mut seen) = ([0.0; PLACES], [0.0; PLACES]);
    for trial in 0..TRIALS {
        let mut rng = seeded(5000 + trial);
        let truth = drawn_deviations(&parameters, &mut rng);
        let case = PaperCase::simulated(&truth, 30, NOISE, &mut rng);
        let found = run(&case, &settings());
        let real = case.problem().arm_with(&truth);
        let pairs: Vec<_> =
            places.iter().map(|at| (1.0, found.arm.point_in_base(at), real.point_in_base(at))).collect();
        let registered = register(pairs.iter().copied()).unwrap().to_from_from;
        for (place, (covariance, (_, from, to))) in position_covariances(&found, &places).iter().zip(&pairs).enumerate()
        {
            stated[place] += covariance.trace();
            seen[place] += (registered * from - to).norm_squared();
        }
    }
    let (all_stated, all_seen): (f64, f64) = (stated.iter().sum(), seen.iter().sum());
    let ratio = (all_seen / all_stated).sqrt();
    assert!((ratio - 1.0).abs() < 0.07, "errors are {ratio} times what was stated");
    for (place, (stated, seen)) in stated.iter().zip(&seen).enumerate() {
        let ratio = (seen / stated).sqrt();
        assert!((ratio - 1.0).abs() < 0.25, "place {place}: errors are {ratio} times what was stated");
    }
}

#[test]
fn the_path_of_the_solver_ends_at_the_result() {
    let outlying = {
        let mut case = PaperCase::simulated(&paper_deviations(), 56, NOISE, &mut seeded(4));
        case.observations.points[7].point.x += 5.0 * MILLIMETRE;
        case
    };
    for case in [PaperCase::simulated(&paper_deviations(), 56, NOISE, &mut seeded(3)), outlying] {
        let found = run(&case, &settings());
        assert_eq!(found.path.len(), found.iterations.len());
        let last = found.path.last().unwrap();
        for (value, estimate) in last.iter().zip(&found.estimates) {
            // What no data tell may be moved along its blind direction in the end.
            if estimate.identifiable {
                assert!(
                    (value - estimate.deviation).abs() < 1e-12,
                    "{}: {value} or {}",
                    estimate.id,
                    estimate.deviation
                );
            }
        }
        assert!(found.path.len() > 1);
    }
}
