//! Simulated sessions with one fault each, and what the live triage makes of them: random robots, poses and tracker positions.

use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use nalgebra::{Isometry3, Vector3};
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution as _, StandardNormal, UnitSphere};
use trupose::identification::PointSample;
use trupose::identification::triage::{Cause, Finding, Triage, triage};
use trupose::kinematics::{Arm, ForwardKinematics, FreeParameter, ParameterId, Place};
use trupose::profile::{Level, Profile, builtin};
use trupose::units::{DEGREE, INCH, MICROMETRE, MILLIMETRE};

/// Noise of the simulated instrument (m), known to the triage.
pub(crate) const NOISE: f64 = 10.0 * MICROMETRE;
/// Poses of a session.
pub(crate) const POSES: usize = 24;

/// A robot as it is planned and calibrated.
pub(crate) struct Robot {
    pub(crate) name: &'static str,
    pub(crate) arm: Arm,
    pub(crate) parameters: Vec<FreeParameter>,
    pub(crate) ranges: Vec<(f64, f64)>,
}

impl Robot {
    pub(crate) fn new(name: &'static str) -> Self {
        let (profile, _) = Profile::parse(builtin(name).unwrap(), name).unwrap();
        Self {
            name,
            arm: profile.arm(),
            parameters: profile.parameters(Level::Geometric),
            ranges: profile.joints().iter().map(|joint| joint.planning_limits.unwrap()).collect(),
        }
    }
}

/// What goes wrong, at sample `k`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Fault {
    None,
    NextPose,
    Stayed,
    Swapped,
    /// Coordinates divided by this from the first sample on.
    UnitAll(f64),
    /// From sample k on.
    UnitSince(f64),
    SignAll(usize),
    /// A random joint off by this much (rad).
    Joint(f64),
    /// The target off by this much (m) since k.
    Bump(f64),
    /// One reading off by this much (m).
    Outlier(f64),
    /// The instrument moved by this much (m, and rad per m).
    Instrument(f64),
}

pub(crate) struct Session {
    pub(crate) planned: Vec<Vec<f64>>,
    pub(crate) samples: Vec<PointSample>,
    pub(crate) k: usize,
    pub(crate) joint: usize,
    pub(crate) by: f64,
}

fn normal(rng: &mut ChaCha8Rng) -> f64 {
    StandardNormal.sample(rng)
}

fn direction(rng: &mut ChaCha8Rng) -> Vector3<f64> {
    Vector3::from(UnitSphere.sample(rng))
}

impl Session {
    /// The fault comes at sample `at`, or anywhere from the 5th on.
    pub(crate) fn simulate(robot: &Robot, fault: Fault, at: Option<usize>, seed: u64, poses: usize) -> Self {
        let rng = &mut ChaCha8Rng::seed_from_u64(seed);
        let deviations: Vec<(ParameterId, f64)> =
            robot.parameters.iter().map(|parameter| (parameter.id, parameter.expected * normal(rng))).collect();
        let truth = robot.arm.with(deviations).unwrap();
        let planned: Vec<Vec<f64>> = (0..poses)
            .map(|_| robot.ranges.iter().map(|(low, high)| rng.random_range(*low..*high)).collect())
            .collect();
        let place = Vector3::new(rng.random_range(-5.0..5.0), rng.random_range(-5.0..5.0), rng.random_range(0.0..2.0));
        let tracker = Isometry3::new(place, direction(rng) * rng.random_range(0.0..3.0));
        let k = at.unwrap_or_else(|| rng.random_range(4..poses - 3));
        // Joint 1 alone has a say only through the others; any joint may slip at one pose.
        let joint = rng.random_range(0..robot.arm.chain.dof());
        let by = if let Fault::Joint(size) = fault { if rng.random() { size } else { -size } } else { 0.0 };
        let (bump, moved) = (direction(rng), Isometry3::new(direction(rng), direction(rng)));
        let arm = ForwardKinematics::new(&truth.chain);
        let samples = (0..poses)
            .map(|index| {
                let mut configuration = planned[index].clone();
                let mut target = truth.targets[0];
                let mut offset = Vector3::zeros();
                let mut factor = 1.0;
                let mut frame = tracker;
                match fault {
                    Fault::NextPose | Fault::Swapped if index == k => configuration.clone_from(&planned[index + 1]),
                    Fault::Stayed if index == k => configuration.clone_from(&planned[index - 1]),
                    Fault::Swapped if index == k + 1 => configuration.clone_from(&planned[index - 1]),
                    Fault::UnitAll(by) => factor = 1.0 / by,
                    Fault::UnitSince(by) if index >= k => factor = 1.0 / by,
                    Fault::SignAll(joint) => configuration[joint] *= -1.0,
                    Fault::Joint(_) if index == k => configuration[joint] += by,
                    Fault::Bump(by) if index >= k => target += bump * by,
                    Fault::Outlier(by) if index == k => offset = bump * by,
                    Fault::Instrument(by) if index >= k => {
                        frame =
                            Isometry3::new(moved.translation.vector * by, moved.rotation.scaled_axis() * by) * frame;
                    }
                    _ => {}
                }
                let mut point = frame * arm.point_in_base(&configuration, &target) + offset;
                for axis in 0..3 {
                    point[axis] += NOISE * normal(rng);
                }
                let at = Place { configuration: planned[index].clone(), target: 0 };
                PointSample { at, station: 0, point: point * factor, sigma: None }
            })
            .collect();
        Self { planned, samples, k, joint, by }
    }

    /// What is said when `count` samples have been taken.
    pub(crate) fn after(&self, robot: &Robot, count: usize) -> Option<Finding> {
        triage(&Triage {
            arm: &robot.arm,
            parameters: &robot.parameters,
            sigma: NOISE,
            planned: &self.planned,
            samples: &self.samples[..count],
            excluded: &[],
            scatter: None,
        })
    }

    /// Whether a story is the truth.
    fn is_true(&self, fault: Fault, sample: usize, cause: &Cause) -> bool {
        let k = self.k;
        match (fault, cause) {
            (Fault::NextPose | Fault::Swapped, Cause::WrongPose { planned }) => sample == k && *planned == k + 1,
            (Fault::Stayed, Cause::StayedAtPrevious) | (Fault::Outlier(_), Cause::Unexplained) => sample == k,
            (Fault::Swapped, Cause::SwappedRows { with }) => [k, k + 1].contains(&sample) && [k, k + 1].contains(with),
            (Fault::UnitAll(by), Cause::Unit { factor, since }) => (factor / by - 1.0).abs() < 1e-9 && *since == 0,
            (Fault::UnitSince(by), Cause::Unit { factor, since }) => (factor / by - 1.0).abs() < 1e-9 && *since == k,
            (Fault::SignAll(joint), Cause::JointSign { joint: named }) => joint == *named,
            (Fault::Joint(_), Cause::MistypedJoint { joint, by, .. }) => {
                sample == k && *joint == self.joint && (by - self.by).abs() < 0.2 * self.by.abs() + 0.2 * DEGREE
            }
            (Fault::Bump(_), Cause::TargetMoved { since, .. })
            | (Fault::Instrument(_), Cause::InstrumentMoved { since }) => *since == k,
            _ => false,
        }
    }

    /// Whether the finding says the truth, alone or as one of its "or"s.
    fn is_named(&self, fault: Fault, finding: &Finding) -> bool {
        self.is_true(fault, finding.sample, &finding.cause)
            || finding
                .alternatives
                .iter()
                .any(|other| other.share > 0.1 && self.is_true(fault, other.sample, &other.cause))
    }
}

/// Percentages of sessions after the faulty sample, the next one and the one after that.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Row {
    pub(crate) detected: [f64; 3],
    pub(crate) named: [f64; 3],
    /// The truth is the likeliest story.
    pub(crate) first: [f64; 3],
}

/// Runs `work` for every seed on two threads and gathers the results in the order of seeds.
pub(crate) fn on_threads<T: Send>(count: usize, work: impl Fn(u64) -> T + Sync) -> Vec<T> {
    let next = AtomicUsize::new(0);
    let results: Mutex<Vec<(usize, T)>> = Mutex::new(Vec::new());
    std::thread::scope(|scope| {
        for thread in 0..2 {
            let (next, results, work) = (&next, &results, &work);
            let run = move || loop {
                let seed = next.fetch_add(1, Ordering::Relaxed);
                if seed >= count {
                    break;
                }
                let result = work(seed as u64);
                results.lock().unwrap().push((seed, result));
            };
            std::thread::Builder::new().name(format!("triage-{thread}")).spawn_scoped(scope, run).unwrap();
        }
    });
    let mut results = results.into_inner().unwrap();
    results.sort_by_key(|(seed, _)| *seed);
    results.into_iter().map(|(_, result)| result).collect()
}

/// What becomes of `count` sessions with a fault at the sample `at`, or anywhere from the 5th sample on.
pub(crate) fn measure(robot: &Robot, fault: Fault, at: Option<usize>, count: usize) -> Row {
    let outcomes = on_threads(count, |seed| {
        let session = Session::simulate(robot, fault, at, 1000 + seed, POSES);
        let first = if matches!(fault, Fault::UnitAll(_) | Fault::SignAll(_)) { 3 } else { session.k };
        let mut seen = [[false; 3]; 3];
        for later in 0..3 {
            let so_far = if later > 0 { seen[later - 1] } else { [false; 3] };
            if so_far == [true; 3] {
                seen[later] = so_far;
                continue;
            }
            let finding = session.after(robot, first + 1 + later);
            let now = finding.map_or([false; 3], |finding| {
                [true, session.is_named(fault, &finding), session.is_true(fault, finding.sample, &finding.cause)]
            });
            seen[later] = [so_far[0] || now[0], so_far[1] || now[1], so_far[2] || now[2]];
        }
        seen
    });
    let percent = |what: usize| {
        [0, 1, 2].map(|later| 100.0 * outcomes.iter().filter(|seen| seen[later][what]).count() as f64 / count as f64)
    };
    Row { detected: percent(0), named: percent(1), first: percent(2) }
}

/// How many of `count` faultless sessions have a finding.
pub(crate) fn false_alarms(robot: &Robot, count: usize) -> usize {
    let alarmed = on_threads(count, |seed| {
        let session = Session::simulate(robot, Fault::None, None, seed, POSES);
        (4..=POSES).any(|count| session.after(robot, count).is_some())
    });
    alarmed.into_iter().filter(|alarmed| *alarmed).count()
}

/// Faults that must be found and named by the second point after them, on either robot, wherever in the session they happen.
/// Sizes are those from which on docs/triage.md promises it.
const PROMISED: [Fault; 14] = [
    Fault::NextPose,
    Fault::Stayed,
    Fault::Swapped,
    Fault::UnitAll(INCH / MILLIMETRE),
    Fault::UnitAll(1e3),
    Fault::UnitSince(INCH / MILLIMETRE),
    Fault::UnitSince(1e3),
    Fault::SignAll(0),
    Fault::SignAll(2),
    Fault::SignAll(5),
    Fault::Joint(10.0 * DEGREE),
    Fault::Bump(10.0 * MILLIMETRE),
    Fault::Outlier(20.0 * MILLIMETRE),
    Fault::Instrument(10.0 * MILLIMETRE),
];

/// Small faults late in the session, when the arm is known well.
const PROMISED_LATE: [Fault; 3] =
    [Fault::Joint(DEGREE), Fault::Bump(0.5 * MILLIMETRE), Fault::Outlier(0.5 * MILLIMETRE)];
const LATE: usize = 19;

/// All faults that docs/triage.md promises to find, with the sample at which they happen; anywhere without one.
pub(crate) fn promises() -> impl Iterator<Item = (Fault, Option<usize>)> {
    let anywhere = PROMISED.into_iter().map(|fault| (fault, None));
    anywhere.chain(PROMISED_LATE.into_iter().map(|fault| (fault, Some(LATE))))
}

impl Row {
    /// Whether by the second next point at least `percent` of the sessions were found and named.
    pub(crate) fn keeps_the_promise(&self, fault: Fault, percent: f64) -> bool {
        // Which way a tracker has moved shows only after some more points.
        let is_named = self.named[2] >= percent || matches!(fault, Fault::Instrument(_));
        self.detected[2] >= percent && is_named
    }
}
