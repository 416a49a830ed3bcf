//! Numbers that hold: what a verification counts, when it is compared with the nominal arm, and what the words about it say.

use nalgebra::{Point3, Vector3};
use trupose::identification::plausibility::{Columns, Mistake, compare_with_nominal};
use trupose::identification::{Observations, Problem};
use trupose::procedure::identify::NamedSample;
use trupose::profile::{Level, Profile, builtin};
use trupose::session::summary::VerdictStatus;
use trupose::units::{DEGREE, MILLIMETRE};

use crate::support::bench::{Bench, NOISE, altered, warning};
use crate::support::paper_case::normal;

/// 28 of 447 rows of one measured set were at identified poses, and blocked everything.
#[test]
fn verification_rows_at_identified_poses_are_left_out_and_the_rest_is_judged() {
    let mut bench = Bench::builtin("soochow", 1);
    let known = bench.random(40);
    let fresh = bench.random(20);
    // As it was, with the scatter of reported joints, and counted from 0 to 360.
    let mut same: Vec<Vec<f64>> = known.iter().take(3).map(|named| named.sample.at.configuration.clone()).collect();
    same[1].iter_mut().for_each(|value| *value += 0.03 * DEGREE);
    same[2].iter_mut().for_each(|value| *value = value.rem_euclid(360.0 * DEGREE));
    let mut seen = bench.measured(&same, 0);
    // Far off, so that it would show in the figures.
    for named in &mut seen {
        named.sample.point.x += 5.0 * MILLIMETRE;
    }
    let clean = bench.identify(known.clone(), fresh.clone());
    let mixed = bench.identify(known.clone(), seen.iter().chain(&fresh).cloned().collect());
    assert_eq!(mixed.summary.verdict.status, VerdictStatus::Accepted, "{:?}", mixed.summary.warnings);
    let (verification, alone) =
        (mixed.summary.verification.as_ref().unwrap(), clean.summary.verification.as_ref().unwrap());
    assert_eq!((verification.samples, verification.left_out, verification.independent), (20, 3, true));
    assert_eq!(verification.identified.position_mm, alone.identified.position_mm);
    let note = warning(&mixed, "seen_before").unwrap();
    assert!(!note.blocks_acceptance);
    assert!(
        note.message.starts_with("3 of 23 verification samples are at poses that were also identified"),
        "{note:?}"
    );
    assert!(note.message.contains("the other 20"), "{note:?}");

    // Too few are left: that blocks, not the rows at identified poses.
    let few = bench.identify(known.clone(), seen.iter().chain(&fresh[..3]).cloned().collect());
    assert_eq!(few.summary.verdict.status, VerdictStatus::NotAccepted);
    assert!(warning(&few, "few_verification_samples").unwrap().blocks_acceptance);
    assert!(warning(&few, "not_independent").is_none());

    // None is left: the words are true.
    let none = bench.identify(known, seen);
    let refused = warning(&none, "not_independent").unwrap();
    assert!(refused.blocks_acceptance && refused.message.starts_with("all 3 verification samples are at"));
    assert!(!none.summary.verification.unwrap().independent);
}

/// A set was accepted with a distance rms of 0.57 mm against 0.38 mm of the nominal arm.
#[test]
fn an_arm_that_is_no_better_than_the_nominal_one_is_not_accepted() {
    let mut bench = Bench::new(builtin("soochow").unwrap(), 0.02, 2);
    let known = bench.random(40);
    let good = bench.real.clone();
    // Something changes between the sets: a link that is 0.3 mm longer. Then the nominal arm happens to be the better one.
    bench.real = bench.profile.arm();
    let fresh = bench.random(20);
    bench.real = good;
    let identified = bench.identify(known, fresh);
    let refused = warning(&identified, "not_better").unwrap();
    assert!(refused.blocks_acceptance);
    for word in ["position error (rms)", "distance error (rms)", "Keep the nominal model"] {
        assert!(refused.message.contains(word), "{refused:?}");
    }
    assert_eq!(identified.summary.verdict.status, VerdictStatus::NotAccepted);
}

#[test]
fn poses_that_move_one_joint_at_a_time_are_said_not_to_carry_over() {
    let mut bench = Bench::builtin("soochow", 3);
    let known = bench.random(40);
    let limits: Vec<_> = bench.profile.joints().iter().map(|joint| joint.planning_limits.unwrap()).collect();
    let home: Vec<f64> = limits.iter().map(|(low, high)| 0.4 * low + 0.6 * high).collect();
    let star: Vec<Vec<f64>> = (0..30)
        .map(|index| {
            let mut moved = home.clone();
            let (low, high) = limits[index % 6];
            moved[index % 6] = low + (high - low) * f64::from(u8::try_from(index / 6).unwrap()) / 4.0;
            moved
        })
        .collect();
    let fresh = bench.measured(&star, 0);
    let identified = bench.identify(known.clone(), fresh.clone());
    let refused = warning(&identified, "one_joint_at_a_time").unwrap();
    assert!(refused.blocks_acceptance && refused.message.contains("do not carry over"), "{refused:?}");
    // Such poses to identify from are only noted where a verification shows what they are worth.
    let spread = bench.random(20);
    let identified = bench.identify(fresh, spread);
    let noted = warning(&identified, "one_joint_at_a_time").unwrap();
    assert!(!noted.blocks_acceptance && noted.message.starts_with("the identification poses"), "{noted:?}");
}

fn two_targets() -> String {
    let text = builtin("soochow").unwrap();
    let start = text.find("targets: [").unwrap();
    let end = start + text[start..].find("],").unwrap() + 2;
    format!(
        "{}targets: [(name: \"first\", position_mm: (0.0, 20.0, 70.0)), (name: \"second\", position_mm: (30.0, -20.0, 70.0))],{}",
        &text[..start],
        &text[end..]
    )
}

/// It was judged at the guess of the profile, 25 mm off, without any warning.
#[test]
fn a_target_that_only_the_verification_has_is_refused() {
    let mut bench = Bench::new(&two_targets(), 0.5, 4);
    let known = bench.random(40);
    let poses = bench.configurations(20);
    let fresh = bench.measured(&poses, 1);
    let refused = bench.try_identify(known, fresh).unwrap_err();
    assert!(refused.to_string().contains("only the verification has samples of 'second'"), "{refused}");
}

/// It was an absolute millimetre, and left no file.
#[test]
fn what_does_not_fit_is_judged_by_sigma_and_the_nominal_arm_and_leaves_a_result() {
    let mut bench = Bench::builtin("soochow", 5);
    let known = bench.random(40);
    // 1.5 mm of scatter where the instrument promises 1 mm: sloppy, but no other robot.
    let mut sloppy = known.clone();
    for named in &mut sloppy {
        named.sample.point += Vector3::from_fn(|_, _| 1.5 * MILLIMETRE * normal(&mut bench.rng));
        named.sample.sigma = Some(MILLIMETRE);
    }
    let identified = bench.identify(sloppy.clone(), Vec::new());
    assert!(warning(&identified, "does_not_fit").is_none(), "{:?}", identified.summary.warnings);
    assert!(identified.calibration.is_some());

    // The same scatter from an instrument of 10 µm, on an arm that is nearly nominal: nothing is explained.
    for named in &mut sloppy {
        named.sample.sigma = Some(NOISE);
    }
    bench.real = bench.profile.arm();
    let mut wild = bench.random(40);
    for named in &mut wild {
        named.sample.point += Vector3::from_fn(|_, _| 3.0 * MILLIMETRE * normal(&mut bench.rng));
        named.sample.sigma = Some(NOISE);
    }
    let fresh = bench.random(20);
    let identified = bench.identify(wild, fresh);
    let refused = warning(&identified, "does_not_fit").unwrap();
    assert!(refused.blocks_acceptance && refused.message.contains("the nominal one by"), "{refused:?}");
    assert!(identified.calibration.is_some(), "the numbers are kept");
    assert_eq!(identified.summary.verdict.status, VerdictStatus::NotAccepted);
    assert!(identified.summary.workspace.is_some(), "results state their predicted error");
}

fn with_guess(x: f64, y: f64, z: f64) -> String {
    let text = builtin("abb_irb120").unwrap();
    text.replace("position_mm: (0.0, 0.0, 40.0)", &format!("position_mm: ({x:.1}, {y:.1}, {z:.1})"))
}

/// The same fit from four guesses of the SMR had 0, 4, 4 and 4 acceptances of 5.
#[test]
fn guesses_of_the_smr_with_the_same_fit_have_the_same_verdict() {
    let mut bench = Bench::new(&with_guess(35.0, 20.0, 60.0), 0.3, 6);
    let (known, fresh) = (bench.random(40), bench.random(20));
    let mut found = Vec::new();
    for (x, y, z) in [(35.0, 20.0, 60.0), (0.0, 0.0, 40.0), (0.0, 0.0, 60.0), (-20.0, 40.0, 20.0)] {
        let text = with_guess(x, y, z);
        bench.profile = Profile::parse(&text, "robot").unwrap().0;
        bench.text = text;
        let identified = bench.identify(known.clone(), fresh.clone());
        let codes: Vec<String> = identified.summary.warnings.iter().map(|warning| warning.code.to_string()).collect();
        let identifiable: Vec<bool> = identified.found.estimates.iter().map(|estimate| estimate.identifiable).collect();
        found.push((identified.summary.verdict.status, identified.summary.rank, codes, identifiable));
    }
    assert_eq!(found[0].0, VerdictStatus::Accepted, "{:?}", found[0]);
    assert!(found.iter().all(|other| *other == found[0]), "{found:?}");
}

#[test]
fn a_weak_combination_is_named_with_what_it_costs_and_blocks_beyond_the_limit() {
    let mut bench = Bench::builtin("abb_irb120", 7);
    // Joint 5 stays near zero, so that axes 4 and 6 are nearly one, and the instrument is poor.
    let mut narrow = bench.configurations(40);
    for configuration in &mut narrow {
        configuration[4] *= 0.1;
    }
    let mut known = bench.measured(&narrow, 0);
    for named in &mut known {
        named.sample.point += Vector3::from_fn(|_, _| MILLIMETRE * normal(&mut bench.rng));
        named.sample.sigma = Some(MILLIMETRE);
    }
    let fresh = bench.random(20);
    let identified = bench.identify(known.clone(), fresh.clone());
    let weak = warning(&identified, "poor_data").unwrap();
    assert!(weak.message.contains("mm rms over the workspace") && weak.message.contains(" by "), "{weak:?}");
    let loose = bench.text.replace(
        "acceptance: (position_rms_mm: 0.3, position_max_mm: 0.8, distance_rms_mm: 0.3)",
        "acceptance: (position_rms_mm: 30.0)",
    );
    bench.profile = Profile::parse(&loose, "robot").unwrap().0;
    bench.text = loose;
    let identified = bench.identify(known, fresh);
    let weak = warning(&identified, "poor_data").unwrap();
    assert!(!weak.blocks_acceptance, "{weak:?}");
}

/// The mistakes that are named for samples.
fn mistakes(bench: &Bench, samples: &[NamedSample]) -> Vec<Mistake> {
    let points = samples.iter().map(|named| named.sample.clone()).collect();
    let observations = Observations { points, ..Observations::default() };
    let (arm, parameters) = (bench.profile.arm(), bench.profile.parameters(Level::Geometric));
    let problem = Problem { arm: &arm, parameters: &parameters, observations: &observations };
    compare_with_nominal(&problem).unwrap().mistakes
}

/// An arm that is its own mirror image with joints 1, 4 and 6 reversed: the advice to reverse an axis of the tracker led to a
/// mirrored arm that was accepted.
#[test]
fn several_reversed_joints_are_named_before_a_mirrored_frame() {
    let mut bench = Bench::builtin("abb_irb120", 11);
    let samples = bench.random(40);
    let reversed = altered(&samples, |q| [0, 3, 5].iter().for_each(|joint| q[*joint] *= -1.0));
    let found = mistakes(&bench, &reversed);
    assert_eq!(found.first(), Some(&Mistake::JointSigns { joints: vec![0, 3, 5] }), "{found:?}");
    assert_eq!(found.last(), Some(&Mistake::Mirrored), "{found:?}");
    let refused = bench.try_identify(reversed, Vec::new()).unwrap_err().to_string();
    for words in
        ["the likeliest first: (1) joints J1, J4 and J6 count the other way", "Trackers are hardly ever left-handed"]
    {
        assert!(refused.contains(words), "{refused}");
    }
    let reversed = altered(&samples, |q| [1, 4].iter().for_each(|joint| q[*joint] *= -1.0));
    assert_eq!(mistakes(&bench, &reversed).first(), Some(&Mistake::JointSigns { joints: vec![1, 4] }));
}

/// A rigid registration sees that the points are mirrored, and not why.
#[test]
fn exchanged_coordinates_are_named_before_a_mirrored_frame() {
    let mut bench = Bench::builtin("kuka_kr6_r900", 13);
    let samples = bench.random(40);
    for (one, other) in [(0, 1), (1, 2), (0, 2)] {
        let mut exchanged = samples.clone();
        for named in &mut exchanged {
            named.sample.point.coords.swap_rows(one, other);
        }
        let found = mistakes(&bench, &exchanged);
        let place = |mistake: &Mistake| found.iter().position(|found| found == mistake);
        assert!(
            place(&Mistake::Coordinates) < place(&Mistake::Mirrored) && found.contains(&Mistake::Coordinates),
            "{found:?}"
        );
    }
    assert!(bench.try_identify(samples.clone(), Vec::new()).is_ok());
    // J3 to J6 in the first columns, and zeros behind them.
    let shifted = altered(&samples, |q| {
        q.rotate_left(2);
        q[4..].fill(0.0);
    });
    let identified = bench.try_identify(shifted, Vec::new()).unwrap();
    let said = warning(&identified, "implausible").unwrap();
    let hint = "the columns of A5 and A6 hold only zeros: are the columns shifted, so that the first one holds A3?";
    assert!(said.message.contains(hint) && said.blocks_acceptance, "{said:?}");
    assert!(identified.calibration.is_some(), "it blocks the acceptance, not the result");
    assert_eq!(identified.summary.verdict.status, VerdictStatus::NotAccepted);
}

/// The values of joints 3 to 6 in the first columns, and zeros behind them, of an arm whose first joints stay at zero.
#[test]
fn shifted_columns_with_zeros_are_named() {
    for first in [1, 2] {
        let mut bench = Bench::builtin("abb_irb120", 16);
        let mut poses = bench.configurations(40);
        for q in &mut poses {
            q[..first].fill(0.0);
        }
        let samples = bench.measured(&poses, 0);
        let shifted = altered(&samples, |q| {
            q.rotate_left(first);
            q[6 - first..].fill(0.0);
        });
        let found = mistakes(&bench, &shifted);
        assert!(found.contains(&Mistake::Columns(Columns::Shifted { first })), "{found:?}");
        let refused = bench.try_identify(shifted, Vec::new()).unwrap_err().to_string();
        assert!(refused.contains(&format!("the first one holds J{}", first + 1)), "{refused}");
    }
}

#[test]
fn two_joints_with_another_zero_are_named() {
    let mut bench = Bench::builtin("kuka_kr6_r900", 12);
    let samples = bench.random(40);
    let moved = altered(&samples, |q| {
        q[1] += 90.0 * DEGREE;
        q[2] -= 90.0 * DEGREE;
    });
    let found = mistakes(&bench, &moved);
    let expected = Mistake::JointZeros { zeros: vec![(1, -90.0 * DEGREE), (2, 90.0 * DEGREE)] };
    assert_eq!(found.first(), Some(&expected), "{found:?}");
    let words = found[0].describe(|joint| format!("A{}", joint + 1));
    assert!(
        words.starts_with("joints A2 and A3 have another zero: the data fit with -90 and +90 deg added"),
        "{words}"
    );
}

/// The most frequent report of all: FANUC and linkage arms count joint 3 together with joint 2.
#[test]
fn a_coupling_that_is_missing_or_doubled_is_named() {
    for (name, added, factor) in
        [("fanuc_lrmate200id", 1.0, -1.0), ("fanuc_lrmate200id", -1.0, 1.0), ("abb_irb120", -1.0, 1.0)]
    {
        let mut bench = Bench::builtin(name, 13);
        let samples = bench.random(40);
        let coupled = altered(&samples, |q| q[2] += added * q[1]);
        let found = mistakes(&bench, &coupled);
        let expected = Mistake::Coupling { joint: 2, with: 1, factor, reversed: false };
        assert_eq!(found.first(), Some(&expected), "{name} {added}: {found:?}");
    }
    // Imported from a description without the coupling, joint 3 also counts the other way.
    let mut bench = Bench::builtin("abb_irb120", 14);
    let samples = bench.random(40);
    let fanuc = altered(&samples, |q| q[2] = -(q[2] + q[1]));
    let found = mistakes(&bench, &fanuc);
    let expected = Mistake::Coupling { joint: 2, with: 1, factor: -1.0, reversed: true };
    assert_eq!(found.first(), Some(&expected), "{found:?}");
}

#[test]
fn columns_and_rows_that_are_mixed_up_are_named() {
    let mut bench = Bench::builtin("abb_irb120", 15);
    let samples = bench.random(40);
    let columns = |change: fn(&mut [f64])| mistakes(&bench, &altered(&samples, change)).into_iter().next();
    let exchanged = columns(|q| q.swap(4, 5));
    assert_eq!(exchanged, Some(Mistake::Columns(Columns::Exchanged { joints: [4, 5] })));
    assert_eq!(columns(|q| q.rotate_right(1)), Some(Mistake::Columns(Columns::Rotated { first: 1 })));
    assert_eq!(columns(<[f64]>::reverse), Some(Mistake::Columns(Columns::Reversed)));

    let rows = |change: &dyn Fn(&mut Vec<Point3<f64>>)| {
        let mut points: Vec<Point3<f64>> = samples.iter().map(|named| named.sample.point).collect();
        change(&mut points);
        let mut mixed = samples.clone();
        mixed.truncate(points.len());
        for (named, point) in mixed.iter_mut().zip(points) {
            named.sample.point = point;
        }
        mistakes(&bench, &mixed).into_iter().next()
    };
    // A point is lost: the others move up.
    for from in [0, 11, 18] {
        let lost = rows(&|points| {
            points.remove(from);
        });
        assert_eq!(lost, Some(Mistake::RowsShifted { from, below: true }));
    }
    let doubled = rows(&|points| points.insert(12, points[3]));
    assert!(matches!(doubled, Some(Mistake::RowsShifted { from: 12 | 13, below: false })), "{doubled:?}");
    assert_eq!(rows(&|points| points.reverse()), Some(Mistake::RowsReversed));
    let centimetres = rows(&|points| points.iter_mut().for_each(|point| *point /= 10.0));
    assert!(matches!(centimetres, Some(Mistake::CoordinateUnit { story, .. }) if story.contains("centimetres")));
}

/// 21 of 22 rejected poses of one measured set had J2 below -30 deg, and the arm became worse there.
#[test]
fn rejected_samples_that_share_a_region_are_the_arm_and_are_kept() {
    let mut bench = Bench::builtin("abb_irb120", 21);
    let mut samples = bench.random(150);
    let bends = |q: &[f64]| q[1] < -40.0 * DEGREE;
    let bent = samples.iter().filter(|named| bends(&named.sample.at.configuration)).count();
    assert!((5..40).contains(&bent), "{bent}");
    for named in samples.iter_mut().filter(|named| bends(&named.sample.at.configuration)) {
        let direction = named.sample.at.configuration[0];
        named.sample.point +=
            0.2 * MILLIMETRE * Vector3::new(direction.sin(), direction.cos(), (7.0 * direction).sin());
    }
    let identified = bench.identify(samples, Vec::new());
    let noted = warning(&identified, "region_not_described").unwrap();
    assert!(noted.message.contains("have J2 below") && noted.message.contains("kept"), "{noted:?}");
    assert!(identified.found.rejected.len() <= bent / 4, "{:?}", identified.found.rejected);
}

#[test]
fn a_pose_at_which_no_smr_fits_is_the_arm_and_one_bumped_smr_is_not() {
    let mut bench = Bench::new(&two_targets(), 0.5, 22);
    let poses = bench.configurations(40);
    let first = bench.measured(&poses, 0);
    let mut samples: Vec<NamedSample> = first.into_iter().chain(bench.measured(&poses, 1)).collect();
    let off = Vector3::new(0.2, -0.1, 0.15) * MILLIMETRE;
    for index in [7, 47, 12] {
        samples[index].sample.point += off;
    }
    let identified = bench.identify(samples, Vec::new());
    let rejected: Vec<usize> = identified.summary.rejected.iter().map(|rejected| rejected.line).collect();
    assert_eq!(rejected, [14], "line of sample 12: {:?}", identified.summary.rejected);
    let noted = warning(&identified, "region_not_described").unwrap();
    assert!(noted.message.starts_with("no SMR fits at 1 pose"), "{noted:?}");
}

#[test]
fn a_missing_sign_and_a_wrong_digit_are_named() {
    let mut bench = Bench::builtin("soochow", 23);
    let mut samples = bench.random(40);
    samples[5].sample.point.y *= -1.0;
    samples[9].sample.point.x += 30.0 * MILLIMETRE;
    samples[14].sample.point.z += 31.4 * MILLIMETRE;
    let identified = bench.identify(samples, Vec::new());
    let reasons: Vec<(usize, &str)> =
        identified.summary.rejected.iter().map(|rejected| (rejected.line, rejected.reason.as_str())).collect();
    assert_eq!(reasons[0], (7, "the sign of y is wrong: the point fits with the other one"));
    assert_eq!(reasons[1], (11, "one digit of x is wrong: the point fits with 30.000 mm less"));
    assert!(reasons[2].0 == 16 && reasons[2].1.ends_with("times the scatter of the others"), "{reasons:?}");
}

#[test]
fn joints_from_0_to_360_degrees_are_called_that() {
    let mut bench = Bench::builtin("abb_irb120", 24);
    let samples = bench.random(30);
    let turned =
        altered(&samples, |q| q.iter_mut().filter(|value| **value < 0.0).for_each(|value| *value += 360.0 * DEGREE));
    let identified = bench.identify(turned, Vec::new());
    let noted = warning(&identified, "joint_limits").unwrap();
    assert!(noted.message.contains("count from 0 to 360 deg"), "{noted:?}");
}

#[test]
fn figures_of_a_verification_come_with_intervals_and_digits_that_mean_something() {
    let mut bench = Bench::builtin("soochow", 25);
    let (known, fresh) = (bench.random(40), bench.random(20));
    let identified = bench.identify(known.clone(), fresh.clone());
    let verification = identified.summary.verification.as_ref().unwrap();
    assert_eq!(verification.poses, 20);
    for errors in [verification.identified.position_mm.unwrap(), verification.identified.distance_mm.unwrap()] {
        let [mean, rms, _, max] = errors.figures();
        for figure in [mean, rms, max] {
            let [low, high] = figure.interval.unwrap();
            assert!(low <= figure.value && figure.value <= high && high < 3.0 * low, "{figure:?}");
        }
        assert!(max.interval.unwrap()[1] <= errors.max, "a sample says nothing about larger errors");
    }
    let nominal = verification.nominal.position_mm.unwrap();
    // Millimetres with an uncertainty of some tenths: no micrometres.
    assert!(nominal.figures()[0].text().split('.').nth(1).unwrap().len() <= 2, "{nominal:?}");
    let text = trupose::report::identification_text(&identified.summary);
    assert!(text.contains("95 % interval") && text.contains("about 1 of 21"), "{text}");
    assert!(text.lines().all(|line| line.chars().count() <= 80), "{text}");
    // The same data have the same intervals, under names that scripts read.
    let again = bench.identify(known, fresh);
    assert_eq!(again.summary.verification.as_ref(), Some(verification));
    let json = serde_json::to_value(verification).unwrap();
    let interval = json["identified"]["position_mm"]["rms_interval"].as_array().unwrap();
    assert!(interval.len() == 2 && interval[0].as_f64() < interval[1].as_f64(), "{json}");
}

#[test]
fn poses_of_one_arm_configuration_are_said_not_to_carry_over() {
    let mut bench = Bench::builtin("abb_irb120", 26);
    let one_side = |configurations: Vec<Vec<f64>>| -> Vec<Vec<f64>> {
        let mut configurations = configurations;
        for q in &mut configurations {
            q[1] = 30.0 * DEGREE + 0.2 * q[1];
            q[2] *= 0.3;
            q[4] = q[4].abs() + 5.0 * DEGREE;
        }
        configurations
    };
    let (known, fresh) = (bench.configurations(120), bench.configurations(60));
    let both = (bench.measured(&known, 0), bench.measured(&fresh, 0));
    let identified = bench.identify(both.0, both.1);
    assert!(warning(&identified, "one_arm_configuration").is_none());
    let (known, fresh) = (bench.measured(&one_side(known), 0), bench.measured(&one_side(fresh), 0));
    let identified = bench.identify(known, fresh);
    let noted = warning(&identified, "one_arm_configuration").unwrap();
    assert!(noted.message.starts_with("all identification and verification poses"), "{noted:?}");
}
