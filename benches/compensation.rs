//! Speed of compensation: targets per second on one core. The paper's robot and an arm with seven joints.

#![expect(clippy::unwrap_used, reason = "a benchmark stops when its case is broken")]

use divan::Bencher;
use divan::counter::ItemsCount;
use nalgebra::Isometry3;
use trupose::compensation::{Compensator, Goal, Settings, ToolArm};
use trupose::model::proof::configurations;
use trupose::profile::{Level, Profile, builtin};

fn main() {
    divan::main();
}

/// Joint targets, every parameter off by what is expected of it.
#[divan::bench(args = ["soochow", "ur5e", "franka_panda"])]
fn joint_targets_1000(bencher: Bencher<'_, '_>, name: &str) {
    let profile = Profile::parse(builtin(name).unwrap(), name).unwrap().0;
    let free = profile.free_parameters(Level::Geometric);
    let deviations =
        free.iter().zip([1.0, -1.0].into_iter().cycle()).map(|(free, sign)| (free.id, sign * free.expected));
    let arm = |chain| ToolArm { chain, flange_from_tool: Isometry3::identity() };
    let (nominal, identified) =
        (arm(profile.chain().clone()), arm(profile.chain().with_deviations(deviations).unwrap()));
    let limits: Vec<_> = profile.joints().iter().map(|range| range.limits).collect();
    let compensator = Compensator::new(&nominal, &identified, &limits, Settings::default());
    let planning: Vec<_> = profile.joints().iter().map(|range| range.planning_limits).collect();
    let goals: Vec<Goal> =
        configurations(profile.chain(), &planning, 1000).into_iter().map(Goal::Configuration).collect();
    bencher
        .counter(ItemsCount::new(goals.len()))
        .bench_local(|| goals.iter().filter(|goal| compensator.solve(goal).status.is_usable()).count());
}
