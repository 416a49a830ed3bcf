//! Laws of the triage on the arm of the method paper: silence without a fault, the same answer for any tracker position, and each
//! fault recognised on a fixed case. How often that holds is measured in `tests/triage.rs`.

use nalgebra::{Isometry3, Point3, Vector3};
use proptest::prelude::*;
use rand::SeedableRng as _;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution as _, StandardNormal};

use super::{Cause, Explanation, Finding, Names, Triage, triage};
use crate::identification::{PointSample, RejectionReason};
use crate::kinematics::{Arm, ForwardKinematics, FreeParameter, Place};
use crate::profile::{Level, Profile, builtin};
use crate::units::{INCH, MICROMETRE, MILLIMETRE, from_deg, from_mm};

const NOISE: f64 = 10.0 * MICROMETRE;

/// A session with twenty good samples.
struct Session {
    arm: Arm,
    parameters: Vec<FreeParameter>,
    truth: Arm,
    planned: Vec<Vec<f64>>,
    samples: Vec<PointSample>,
    excluded: Vec<usize>,
    scatter: Option<f64>,
}

impl Session {
    fn new(seed: u64) -> Self {
        let (profile, _) = Profile::parse(builtin("soochow").unwrap(), "soochow").unwrap();
        let rng = &mut ChaCha8Rng::seed_from_u64(seed);
        let parameters = profile.parameters(Level::default());
        let draw = |rng: &mut ChaCha8Rng| -> f64 { StandardNormal.sample(rng) };
        let deviations: Vec<_> =
            parameters.iter().map(|parameter| (parameter.id, parameter.expected * draw(rng))).collect();
        let arm = profile.arm();
        let truth = Arm { targets: arm.targets.clone(), ..arm.with(deviations).unwrap() };
        let ranges = profile.joints().iter().map(|joint| joint.planning_limits.unwrap());
        let ranges: Vec<(f64, f64)> = ranges.collect();
        let planned: Vec<Vec<f64>> =
            (0..20).map(|_| ranges.iter().map(|(low, high)| rng.random_range(*low..*high)).collect()).collect();
        let mut session = Self {
            arm,
            parameters,
            truth,
            planned: planned.clone(),
            samples: Vec::new(),
            excluded: Vec::new(),
            scatter: None,
        };
        for configuration in planned {
            let mut point = session.measured(&configuration, Vector3::zeros());
            for axis in 0..3 {
                point[axis] += NOISE * draw(rng);
            }
            session.samples.push(PointSample {
                at: Place { configuration, target: 0 },
                station: 0,
                point,
                sigma: None,
            });
        }
        session
    }

    /// What a perfect tracker sees of a target that has moved in the flange (m).
    fn measured(&self, configuration: &[f64], moved: Vector3<f64>) -> Point3<f64> {
        let frame = Isometry3::new(Vector3::new(2.9, -1.1, 0.6), Vector3::new(0.3, -0.2, 2.1));
        frame * ForwardKinematics::new(&self.truth.chain).point_in_base(configuration, &(self.truth.targets[0] + moved))
    }

    /// The sample is taken elsewhere than shown.
    fn take_at(&mut self, sample: usize, configuration: &[f64]) {
        self.samples[sample].point = self.measured(configuration, Vector3::zeros());
    }

    fn after(&self, count: usize) -> Option<Finding> {
        triage(&Triage {
            arm: &self.arm,
            parameters: &self.parameters,
            sigma: NOISE,
            planned: &self.planned,
            samples: &self.samples[..count],
            excluded: &self.excluded,
            scatter: self.scatter,
        })
    }

    fn cause_after(&self, count: usize) -> (usize, Cause) {
        let finding = self.after(count).unwrap();
        (finding.sample, finding.cause)
    }
}

fn told(finding: &Finding) -> String {
    finding.describe(&Names {
        sample: &|sample| format!("point {}", sample + 1),
        pose: &|pose| format!("{}", pose + 1),
        joint: &|joint| format!("J{}", joint + 1),
    })
}

#[test]
fn nothing_is_said_without_a_fault() {
    let session = Session::new(1);
    assert!((0..=20).all(|count| session.after(count).is_none()));
}

#[test]
fn nothing_is_said_before_the_fourth_point() {
    let mut session = Session::new(1);
    session.samples[1].point.x += 0.5;
    assert!((0..4).all(|count| session.after(count).is_none()));
    assert!(session.after(4).is_some());
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]
    #[test]
    fn the_tracker_may_stand_anywhere(
        shift in prop::array::uniform3(-20.0..20.0_f64),
        turn in prop::array::uniform3(-3.0..3.0_f64),
        off in 0.5..20.0_f64,
    ) {
        let mut session = Session::new(2);
        session.samples[11].point.y += from_mm(off);
        let here = session.after(12).unwrap();
        let motion = Isometry3::new(Vector3::from(shift), Vector3::from(turn));
        for sample in &mut session.samples {
            sample.point = motion * sample.point;
        }
        let there = session.after(12).unwrap();
        prop_assert_eq!((here.sample, &here.cause), (there.sample, &there.cause));
        prop_assert!((here.ratio / there.ratio - 1.0).abs() < 1e-3, "{} {}", here.ratio, there.ratio);
        prop_assert!((here.share - there.share).abs() < 1e-2, "{} {}", here.share, there.share);
    }
}

#[test]
fn another_pose_than_shown() {
    let mut session = Session::new(3);
    let (next, before) = (session.planned[10].clone(), session.planned[8].clone());
    session.take_at(9, &next);
    assert_eq!(session.cause_after(10), (9, Cause::WrongPose { planned: 10 }));
    session.take_at(9, &before);
    assert_eq!(session.cause_after(10), (9, Cause::StayedAtPrevious));
}

#[test]
fn two_rows_exchanged() {
    let mut session = Session::new(3);
    let (first, second) = (session.samples[8].point, session.samples[9].point);
    (session.samples[8].point, session.samples[9].point) = (second, first);
    assert_eq!(session.cause_after(9), (8, Cause::WrongPose { planned: 9 }));
    let (sample, cause) = session.cause_after(10);
    assert!(
        matches!((sample, &cause), (8, Cause::SwappedRows { with: 9 }) | (9, Cause::SwappedRows { with: 8 })),
        "{cause:?}"
    );
    // The first one left out after the first warning.
    session.excluded = vec![8];
    let (_, cause) = session.cause_after(10);
    assert_eq!(cause, Cause::SwappedRows { with: 8 });
}

#[test]
fn another_unit() {
    for factor in [INCH / MILLIMETRE, 1e3] {
        for (since, count) in [(0, 4), (9, 10)] {
            let mut session = Session::new(4);
            for sample in &mut session.samples[since..] {
                sample.point /= factor;
            }
            let (_, cause) = session.cause_after(count);
            let Cause::Unit { factor: found, since: named } = cause else { panic!("{cause:?}") };
            assert!((found / factor - 1.0).abs() < 1e-12 && named == since);
        }
    }
}

#[test]
fn a_joint_that_turns_the_other_way() {
    for joint in 0..6 {
        let mut session = Session::new(5);
        for sample in &mut session.samples {
            sample.at.configuration[joint] *= -1.0;
        }
        session.planned = session.samples.iter().map(|sample| sample.at.configuration.clone()).collect();
        let (_, cause) = session.cause_after(6);
        assert_eq!(cause, Cause::JointSign { joint });
    }
}

#[test]
fn a_joint_elsewhere_than_shown() {
    for (joint, degrees) in [(0, 1.0), (1, -5.0), (2, 10.0), (3, 27.0), (4, -3.0), (5, 90.0)] {
        let mut session = Session::new(6);
        let mut configuration = session.planned[14].clone();
        configuration[joint] += from_deg(degrees);
        session.take_at(14, &configuration);
        let (sample, cause) = session.cause_after(15);
        let Cause::MistypedJoint { joint: named, by, .. } = cause else { panic!("{joint}: {cause:?}") };
        assert_eq!((sample, named), (14, joint));
        assert!((by - from_deg(degrees)).abs() < from_deg(0.2), "{joint}: {by}");
    }
}

#[test]
fn a_target_that_has_moved_shows_at_the_second_point() {
    let mut session = Session::new(7);
    for sample in 12..20 {
        let configuration = session.planned[sample].clone();
        session.samples[sample].point = session.measured(&configuration, Vector3::new(2e-3, 1e-3, 0.0));
    }
    assert!(session.after(12).is_none());
    let first = session.after(13).unwrap();
    assert!(first.is_ambiguous() && first.sample == 12, "{first:?}");
    for excluded in [vec![], vec![12]] {
        session.excluded = excluded;
        let (_, cause) = session.cause_after(14);
        let Cause::TargetMoved { since: 12, by } = cause else { panic!("{cause:?}") };
        assert!((by - 5.0_f64.sqrt() * 1e-3).abs() < 2e-4, "{by}");
    }
}

#[test]
fn a_tracker_that_has_moved() {
    let mut session = Session::new(8);
    let blow = Isometry3::new(Vector3::new(4e-3, -2e-3, 1e-3), Vector3::new(1e-3, 0.0, 2e-3));
    for sample in &mut session.samples[12..] {
        sample.point = blow * sample.point;
    }
    assert!(session.after(13).is_some());
    assert_eq!(session.cause_after(15).1, Cause::InstrumentMoved { since: 12 });
}

#[test]
fn a_robot_that_is_not_at_rest() {
    let mut session = Session::new(9);
    session.scatter = Some(2.0 * NOISE);
    assert!(session.after(10).is_none());
    session.scatter = Some(from_mm(0.3));
    let finding = session.after(2).unwrap();
    assert_eq!((finding.sample, &finding.cause), (1, &Cause::NotAtRest { scatter: from_mm(0.3) }));
}

#[test]
fn an_old_bad_point_does_not_hide_a_new_one() {
    for off in [0.02, 0.5, 30.0] {
        let mut session = Session::new(10);
        session.samples[7].point.z += off;
        let old = session.after(14).unwrap();
        assert_eq!(old.sample, 7, "{old:?}");
        session.samples[14].point.x += from_mm(5.0);
        let new = session.after(15).unwrap();
        assert_eq!((new.sample, &new.cause), (14, &Cause::Unexplained), "{new:?}");
        session.excluded = vec![7, 14];
        assert!((16..=20).all(|count| session.after(count).is_none()));
    }
}

#[test]
fn with_four_points_it_is_often_not_clear_who_is_wrong() {
    let mut unclear = 0;
    for seed in 11..19 {
        let mut session = Session::new(seed);
        let good = session.samples[2].point;
        // The smallest fault that is seen at all.
        let finding = (1..100).find_map(|off| {
            session.samples[2].point = good + Vector3::x() * from_mm(f64::from(off));
            session.after(4)
        });
        let finding = finding.unwrap();
        if finding.alternatives.iter().any(|other| other.sample != finding.sample) {
            unclear += 1;
        }
    }
    assert!(unclear > 0);
    let mut session = Session::new(11);
    session.samples[2].point.x += 0.02;
    assert_eq!(session.after(10).unwrap().suspects(), [2]);
}

#[test]
fn the_worst_distance_is_about_right() {
    let mut session = Session::new(12);
    session.samples[15].point.x += from_mm(3.0);
    let finding = session.after(16).unwrap();
    let worst = &finding.worst[0];
    assert!(finding.ratio > 10.0 && worst.deviation.abs() > 5.0 * worst.expected);
    assert!(worst.deviation.abs() < from_mm(3.5) && worst.deviation.abs() > from_mm(1.0), "{worst:?}");
}

#[test]
fn words_say_what_how_sure_and_what_to_do() {
    let mut session = Session::new(3);
    let next = session.planned[10].clone();
    session.take_at(9, &next);
    let text = told(&session.after(10).unwrap());
    assert!(
        text.contains("point 10 was taken at pose 11") && text.ends_with("move to the pose shown and measure again"),
        "{text}"
    );
    let mut session = Session::new(12);
    session.samples[15].point.x += from_mm(3.0);
    let text = told(&session.after(16).unwrap());
    assert!(text.starts_with("point 16 does not fit") && text.contains("either") && text.contains(", or "), "{text}");
    session.scatter = Some(from_mm(0.3));
    assert!(told(&session.after(16).unwrap()).contains("not at rest"));
}

#[test]
fn several_suspects_are_all_named() {
    let blame = |sample| Explanation { sample, cause: Cause::Unexplained, share: 0.25 };
    let finding = Finding {
        sample: 3,
        ratio: 7.0,
        worst: Vec::new(),
        cause: Cause::Unexplained,
        share: 0.4,
        alternatives: vec![blame(1), blame(0)],
        typed: None,
        is_early: false,
    };
    assert_eq!(finding.suspects(), [3, 1, 0]);
    let text = told(&finding);
    assert!(text.contains("which of point 4, point 2, point 1 is wrong: the next point will tell"), "{text}");
}

/// An exchange of two poses that cannot be told from a bad reading yet is called that.
#[test]
fn an_early_exchange_is_not_called_a_bad_reading_alone() {
    let mut session = Session::new(12);
    let away = Vector3::new(from_mm(211.3), from_mm(-187.9), from_mm(41.7));
    session.samples[5].point += away;
    let early = session.after(6).unwrap();
    assert_eq!((early.sample, &early.cause, early.is_early), (5, &Cause::Unexplained, true));
    assert!(
        told(&early).contains("two poses exchanged), which cannot be told from a bad reading yet"),
        "{}",
        told(&early)
    );
    let mut session = Session::new(12);
    session.samples[15].point += away;
    let late = session.after(16).unwrap();
    assert!(!late.is_early && !told(&late).contains("exchanged"), "{}", told(&late));
}

/// A coordinate that was read off a display is typed with another digit, or without its sign.
#[test]
fn slips_of_the_pen_are_named_while_measuring() {
    let mut session = Session::new(12);
    session.samples[15].point.y *= -1.0;
    let finding = session.after(16).unwrap();
    assert_eq!(finding.typed, Some(RejectionReason::Sign { axis: 1 }), "{finding:?}");
    let text = told(&finding);
    assert!(
        text.contains("the sign of y of point 16 is wrong")
            && text.ends_with("compare the coordinates with the display of the instrument, or measure it again"),
        "{text}"
    );
    for (axis, by) in [(0, 3.0), (0, 30.0), (1, 70.0), (1, -70.0), (2, -40.0), (0, 500.0)] {
        let mut session = Session::new(12);
        session.samples[15].point[axis] += from_mm(by);
        let finding = session.after(16).unwrap();
        let Some(RejectionReason::Digit { axis: found, by: less }) = finding.typed else { panic!("{finding:?}") };
        assert!(found == axis && (less - from_mm(by)).abs() < 1e-9, "{finding:?}");
        let text = told(&finding);
        let words = if by > 0.0 { "mm less)" } else { "mm more)" };
        assert!(text.contains("one digit of") && text.contains(words), "{text}");
    }
    // Neither a bumped SMR nor another pose is one.
    let mut session = Session::new(12);
    session.samples[15].point.coords += Vector3::new(from_mm(3.1), from_mm(-1.7), from_mm(0.4));
    assert_eq!(session.after(16).unwrap().typed, None);
    let mut session = Session::new(3);
    let next = session.planned[10].clone();
    session.take_at(9, &next);
    assert_eq!(session.after(10).unwrap().typed, None);
}

#[test]
fn misuse_is_no_finding() {
    let mut session = Session::new(13);
    session.samples[3].at.configuration.pop();
    assert!(session.after(10).is_none());
    let mut session = Session::new(13);
    session.samples[3].point.x = f64::NAN;
    assert!(session.after(10).is_none());
    let mut session = Session::new(13);
    session.samples[3].point.x += 1.0;
    session.excluded = vec![40];
    assert!(session.after(10).is_none());
}
