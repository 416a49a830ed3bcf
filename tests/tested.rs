//! What the data do not show is said, and no arm is accepted that they cannot tell from a wrong one.

use nalgebra::Point3;
use trupose::identification::Prior;
use trupose::kinematics::Arm;
use trupose::procedure::EstimationSettings;
use trupose::procedure::identify::{Identified, NamedSample};
use trupose::profile::{Level, Profile, builtin};
use trupose::session::summary::VerdictStatus;
use trupose::units::{DEGREE, MILLIMETRE};

use crate::support::bench::{Bench, altered, warning};

/// An arm whose SMR the profile states at `stated` (mm), within `uncertainty` (mm), and which has it at `real`.
fn with_smr(stated: [f64; 3], uncertainty: f64, real: [f64; 3], seed: u64) -> Bench {
    let [x, y, z] = stated;
    let stated = format!("position_mm: ({x:.1}, {y:.1}, {z:.1}), uncertainty_mm: {uncertainty:.1}");
    let text = builtin("abb_irb120").unwrap().replace("position_mm: (40.0, 0.0, 40.0)", &stated);
    assert!(text.contains(&stated));
    let mut bench = Bench::new(&text, 0.3, seed);
    // Behind the last axis all is nominal, so that a point on the axis of the flange is on it.
    let of_last =
        bench.profile.parameters(Level::Geometric).into_iter().filter(|parameter| parameter.id.joint() == Some(5));
    let nominal = bench.profile.arm();
    let back = of_last.map(|parameter| {
        let value = |arm: &Arm| arm.value(parameter.id).unwrap();
        (parameter.id, value(&nominal) - value(&bench.real))
    });
    bench.real = bench.real.with(back.collect::<Vec<_>>()).unwrap();
    bench.real.targets[0] = Point3::from(real.map(|value| value * MILLIMETRE));
    bench
}

fn reversed(samples: &[NamedSample], joint: usize) -> Vec<NamedSample> {
    altered(samples, |q| q[joint] *= -1.0)
}

fn both(bench: &mut Bench, change: impl Fn(&[NamedSample]) -> Vec<NamedSample>) -> Identified {
    let (known, fresh) = (bench.random(40), bench.random(20));
    bench.identify(change(&known), change(&fresh))
}

/// A reversed joint 6 was accepted without a word: the SMR on its axis stays where it is when it turns.
#[test]
fn a_joint_that_the_smr_does_not_show_is_named_and_not_accepted() {
    for (seed, is_reversed) in [(1, true), (2, false)] {
        let mut bench = with_smr([0.0, 0.0, 40.0], 1.0, [0.0, 0.0, 40.3], seed);
        let identified = both(&mut bench, |samples| if is_reversed { reversed(samples, 5) } else { samples.to_vec() });
        let untested = warning(&identified, "untested_joint").unwrap();
        assert!(untested.blocks_acceptance, "{untested:?}");
        for words in ["joint J6 was not tested: the SMR is 0.0", "its sign, its zero or its scale", "beside that axis"]
        {
            assert!(untested.message.contains(words), "{untested:?}");
        }
        assert_eq!(identified.summary.verdict.status, VerdictStatus::NotAccepted);
        assert!(identified.calibration.is_some(), "the numbers are kept");
        let others: Vec<&str> = identified.summary.warnings.iter().map(|warning| warning.code.as_str()).collect();
        assert_eq!(others, ["untested_joint"], "the fit itself is good");
    }
    // The remedies work: an SMR beside the axis, or a second one.
    let mut bench = with_smr([30.0, 0.0, 40.0], 1.0, [30.2, 0.1, 40.3], 3);
    let identified = both(&mut bench, <[NamedSample]>::to_vec);
    assert!(warning(&identified, "untested_joint").is_none(), "{:?}", identified.summary.warnings);
    assert_eq!(identified.summary.verdict.status, VerdictStatus::Accepted);
    let second =
        "position_mm: (0.0, 0.0, 40.0)), (name: \"second\", position_mm: (30.0, 0.0, 40.0), uncertainty_mm: 1.0";
    let text = builtin("abb_irb120").unwrap().replace("position_mm: (40.0, 0.0, 40.0)", second);
    let mut bench = Bench::new(&text, 0.3, 4);
    bench.real.targets[0] = Point3::new(0.0, 0.0, 40.3 * MILLIMETRE);
    let poses = bench.configurations(40);
    let known: Vec<NamedSample> = [0, 1].into_iter().flat_map(|target| bench.measured(&poses, target)).collect();
    let fresh = bench.random(20);
    let identified = bench.identify(known, fresh);
    assert!(warning(&identified, "untested_joint").is_none(), "{:?}", identified.summary.warnings);
}

/// Close to the axis the data do show it, by less than what makes points implausible.
#[test]
fn a_reversed_joint_that_the_data_hardly_show_is_named_and_not_accepted() {
    for (seed, beside) in [(5, 0.1), (6, 0.3), (7, 2.0)] {
        let mut bench = with_smr([0.0, 0.0, 40.0], 5.0, [beside, 0.0, 40.3], seed);
        let identified = both(&mut bench, |samples| reversed(samples, 5));
        let found = warning(&identified, "reversed_joint").unwrap();
        assert!(
            found.blocks_acceptance && found.message.starts_with("joint J6 counts the other way"),
            "{beside}: {found:?}"
        );
        assert_eq!(identified.summary.verdict.status, VerdictStatus::NotAccepted);
        let identified = both(&mut bench, <[NamedSample]>::to_vec);
        assert!(warning(&identified, "reversed_joint").is_none(), "{:?}", identified.summary.warnings);
    }
}

/// The SMR's place and the zero of the last joint are found together: that is said, and holds nothing up.
#[test]
fn a_zero_that_only_the_place_of_the_smr_could_show_is_named() {
    for (seed, uncertainty, is_tested) in [(8, 50.0, false), (9, 1.0, true), (10, 0.0, true)] {
        let mut bench = with_smr([40.0, 0.0, 40.0], uncertainty, [40.0, 0.0, 40.0], seed);
        let identified = both(&mut bench, <[NamedSample]>::to_vec);
        let untested = warning(&identified, "untested_joint");
        assert_eq!(untested.is_none(), is_tested, "{uncertainty}: {untested:?}");
        assert!(untested.is_none_or(|warning| {
            !warning.blocks_acceptance && warning.message.starts_with("the zero of joint J6 was not tested")
        }));
        assert_eq!(identified.summary.verdict.status, VerdictStatus::Accepted, "{:?}", identified.summary.warnings);
        // What is said is true: with another zero all fits as well.
        let (known, fresh) = (bench.random(40), bench.random(20));
        let turned = |samples: &[NamedSample]| altered(samples, |q| q[5] += 90.0 * DEGREE);
        match bench.try_identify(turned(&known), turned(&fresh)) {
            Ok(turned) => assert!(turned.summary.verdict.status != VerdictStatus::Accepted || !is_tested),
            Err(refused) => {
                assert!(is_tested && refused.to_string().contains("joint J6 has another zero"), "{refused}");
            }
        }
    }
}

#[test]
fn a_joint_that_stands_still_is_not_accepted() {
    for joint in 0..6 {
        let mut bench = with_smr([40.0, 0.0, 40.0], 1.0, [40.2, 0.1, 40.0], 20 + joint as u64);
        let identified = both(&mut bench, |samples| altered(samples, |q| q[joint] = 0.0));
        let still = warning(&identified, "poor_data").map(|warning| warning.blocks_acceptance);
        assert!(
            still == Some(true) || identified.summary.verdict.status == VerdictStatus::NotAccepted,
            "J{}: {:?}",
            joint + 1,
            identified.summary.warnings
        );
    }
}

/// Without a prior the directions to solve in were those that a guess of the SMR shows.
#[test]
fn guesses_of_the_smr_lead_to_one_result_without_a_prior() {
    let mut found: Vec<(VerdictStatus, usize, Vec<bool>, f64)> = Vec::new();
    let mut bench = with_smr([35.0, 20.0, 60.0], 50.0, [35.0, 20.0, 60.0], 30);
    let (known, fresh) = (bench.random(60), bench.random(20));
    for stated in [[35.0, 20.0, 60.0], [0.0, 0.0, 40.0], [0.0, 0.0, 60.0], [-20.0, 40.0, 20.0], [0.001, 0.0, 40.0]] {
        let other = with_smr(stated, 50.0, stated, 30);
        bench.profile = Profile::parse(&other.text, "robot").unwrap().0;
        bench.text = other.text;
        bench.settings =
            EstimationSettings { prior: Prior::None, level: Level::Geometric, ..EstimationSettings::default() };
        let identified = bench.identify(known.clone(), fresh.clone());
        let identifiable = identified.found.estimates.iter().map(|estimate| estimate.identifiable).collect();
        let error = identified.summary.verification.unwrap().identified.position_mm.unwrap().rms;
        found.push((identified.summary.verdict.status, identified.summary.rank.unwrap(), identifiable, error));
    }
    for other in &found {
        let same = (&other.0, other.1, &other.2) == (&found[0].0, found[0].1, &found[0].2);
        assert!(same && (other.3 - found[0].3).abs() < 1e-4, "{found:#?}");
    }
}
