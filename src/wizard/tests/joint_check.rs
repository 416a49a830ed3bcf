//! The joint check: seven points before a plan.

use super::bench::{Bench, MANUAL, blocked, fold, offers, simulated};
use crate::session::set_up::{Step, TargetChoice};
use crate::wizard::Intent;
use crate::wizard::view::{Content, JointCheckView};

fn check(bench: &Bench) -> JointCheckView {
    let Content::Target(view) = bench.wizard.view().content else { panic!("not in the target step") };
    view.joint_check.unwrap()
}

/// In the target step, with the check begun.
fn begun() -> Bench {
    let mut bench = Bench::with(&simulated(), Step::Target);
    bench.does(Intent::ChooseTarget(TargetChoice::Profile));
    bench.does(Intent::StartJointCheck);
    bench
}

#[test]
fn every_joint_is_moved_once_and_is_right() {
    let mut bench = begun();
    assert_eq!((check(&bench).joint, check(&bench).measured, check(&bench).of), (None, 0, 7));
    bench.does(Intent::Measure);
    assert_eq!(check(&bench).joint.as_deref(), Some("J1"));
    let moving: Vec<f64> = check(&bench).joints.iter().map(|joint| joint.moves.round()).collect();
    assert_eq!(moving, [10.0, 0.0, 0.0, 0.0, 0.0, 0.0], "only one joint moves");
    for _ in 0..6 {
        bench.does(Intent::Measure);
    }
    let done = check(&bench);
    let verdict = done.verdict.unwrap();
    assert_eq!(verdict.faults, [""; 0]);
    assert!(verdict.joints.iter().all(|joint| joint.is_right), "{:?}", verdict.joints);
    assert!(bench.told().starts_with("all joints are as the profile says"), "{}", bench.told());
    assert!(done.joints.is_empty());
    assert_eq!(
        blocked(&bench.wizard, "StartJointCheck"),
        "the joints are checked; measure the check again to repeat it"
    );
    assert!(offers(&bench.wizard).contains(&"Next*".to_owned()));
}

#[test]
fn it_continues_at_the_same_joint_after_a_crash() {
    let mut bench = begun();
    for _ in 0..3 {
        bench.does(Intent::Measure);
    }
    assert_eq!(fold(&bench.journal), *bench.wizard.session());
    let (mut resumed, effects) = bench.resumed(bench.journal.len());
    resumed.settle(effects);
    assert!(offers(&resumed.wizard).contains(&"StartJointCheck".to_owned()), "{:?}", offers(&resumed.wizard));
    resumed.does(Intent::StartJointCheck);
    assert_eq!((check(&resumed).joint.as_deref(), check(&resumed).measured), (Some("J3"), 3));
    for _ in 0..4 {
        resumed.does(Intent::Measure);
    }
    assert!(check(&resumed).verdict.unwrap().faults.is_empty());
    resumed.does(Intent::DiscardJointCheck);
    assert_eq!((check(&resumed).measured, check(&resumed).verdict), (0, None));
}

#[test]
fn it_is_skipped_by_continuing_and_points_can_be_typed() {
    let mut bench = begun();
    bench.does(Intent::Next);
    assert_eq!(bench.step(), Step::Plan);
    let mut bench = Bench::with(&MANUAL, Step::Target);
    bench.does(Intent::StartJointCheck);
    bench.does(Intent::TypeReading("0 0 0".to_owned()));
    assert_eq!(bench.told(), "the reading is 0, 0, 0: the instrument has no target");
    bench.does(Intent::TypeReading("1000 200 300".to_owned()));
    assert_eq!(check(&bench).measured, 1);
}
