//! Speed of compensation on one core: targets per second, and what a target costs in forward kinematics of the same arm. The
//! ratio hardly depends on the machine and on what else it does: both are measured in turns.
//!
//! `cargo bench --bench compensation`, or with `--profile dev`.

#![expect(
    clippy::unwrap_used,
    clippy::disallowed_methods,
    clippy::print_stdout,
    reason = "a benchmark stops when its case is broken; it measures time, and prints"
)]

use std::hint::black_box;
use std::time::Instant;

use nalgebra::{Isometry3, Vector3};
use trupose::compensation::{Compensator, Goal, PoseGoal, Settings, ToolArm};
use trupose::inverse::Posture;
use trupose::kinematics::ForwardKinematics;
use trupose::model::proof::configurations;
use trupose::profile::{Level, Profile, builtin, builtin_names};

const TARGETS: usize = 1000;
/// The best of so many turns counts: what is slower waited for something else.
const TURNS: usize = 15;
/// Forward kinematics per target in a turn, so that both sides take long enough to be timed.
const REPEATED: usize = 20;

/// Seconds that `work` takes.
fn seconds(work: impl FnOnce()) -> f64 {
    let begin = Instant::now();
    work();
    begin.elapsed().as_secs_f64()
}

/// Cartesian targets with tools, in the configuration that a program states: inverted, corrected, and inverted again as a controller does.
fn measure_poses(name: &str) {
    let profile = Profile::parse(builtin(name).unwrap(), name).unwrap().0;
    let free = profile.parameters(Level::default());
    let deviations =
        free.iter().zip([0.5, -0.5].into_iter().cycle()).map(|(free, half)| (free.id, half * free.expected));
    let arm = |chain| ToolArm { chain, flange_from_tool: Isometry3::identity() };
    let (nominal, identified) = (arm(profile.chain().clone()), arm(profile.arm().with(deviations).unwrap().chain));
    let limits: Vec<_> = profile.joints().iter().map(|range| range.limits).collect();
    let compensator = Compensator::new(&nominal, &identified, &limits, Settings::default());
    let forward = ForwardKinematics::new(profile.chain());
    let planning: Vec<_> = profile.joints().iter().map(|range| range.planning_limits).collect();
    let flange_from_tool = Isometry3::new(Vector3::new(0.1, -0.02, 0.2), Vector3::new(0.3, 1.0, -0.4));
    let targets = configurations(profile.chain(), &planning, TARGETS);
    let poses: Vec<_> = targets.iter().map(|q| forward.base_from_flange(q) * flange_from_tool).collect();
    let solve = |(q, pose): (&Vec<f64>, &Isometry3<f64>)| {
        let posture = compensator.inverse().posture(q);
        let is_meant = |other: Option<&Posture>, turned: &[f64]| {
            other == posture.as_ref() && turned.iter().zip(q).all(|(turned, q)| (turned - q).abs() < 0.3)
        };
        let goal = PoseGoal { base_from_tool: *pose, flange_from_tool, is_meant: &is_meant, near: Some(q) };
        compensator.solve_pose(black_box(&goal))
    };
    let usable = targets.iter().zip(&poses).filter(|target| solve(*target).is_ok()).count();
    let mut solving = f64::INFINITY;
    for _ in 0..TURNS {
        solving = solving.min(seconds(|| {
            for target in targets.iter().zip(&poses) {
                drop(black_box(solve(target)));
            }
        }));
    }
    println!("{name:<20} {usable:>5} of {TARGETS} usable {:>9.0} Cartesian targets/s", TARGETS as f64 / solving);
}

/// Joint targets within the planning limits, every parameter off by what is expected of it.
fn measure(name: &str) {
    let profile = Profile::parse(builtin(name).unwrap(), name).unwrap().0;
    let free = profile.parameters(Level::default());
    let deviations =
        free.iter().zip([1.0, -1.0].into_iter().cycle()).map(|(free, sign)| (free.id, sign * free.expected));
    let arm = |chain| ToolArm { chain, flange_from_tool: Isometry3::identity() };
    let (nominal, identified) = (arm(profile.chain().clone()), arm(profile.arm().with(deviations).unwrap().chain));
    let limits: Vec<_> = profile.joints().iter().map(|range| range.limits).collect();
    let compensator = Compensator::new(&nominal, &identified, &limits, Settings::default());
    let forward = ForwardKinematics::new(profile.chain());
    let planning: Vec<_> = profile.joints().iter().map(|range| range.planning_limits).collect();
    let targets = configurations(profile.chain(), &planning, TARGETS);
    let goals: Vec<Goal> = targets.iter().cloned().map(Goal::Configuration).collect();
    let usable = goals.iter().filter(|goal| compensator.solve(goal).status.is_usable()).count();
    let (mut solving, mut moving) = (f64::INFINITY, f64::INFINITY);
    for _ in 0..TURNS {
        solving = solving.min(seconds(|| {
            for goal in &goals {
                black_box(compensator.solve(black_box(goal)));
            }
        }));
        moving = moving.min(seconds(|| {
            for q in std::iter::repeat_n(&targets, REPEATED).flatten() {
                black_box(forward.base_from_flange(black_box(q)));
            }
        }));
    }
    let forward_time = moving / (REPEATED * TARGETS) as f64;
    let time = solving / TARGETS as f64;
    println!(
        "{name:<14} {usable:>5} of {TARGETS} usable {:>9.0} targets/s {:>7.1} forward kinematics per target ({:.3} us each)",
        1.0 / time,
        time / forward_time,
        1e6 * forward_time
    );
}

fn main() {
    println!("profile: {}", if cfg!(debug_assertions) { "dev" } else { "release" });
    for name in ["soochow", "ur5e", "franka_panda"] {
        measure(name);
    }
    for name in builtin_names().filter(|name| *name != "epson_ls3_b401s") {
        measure_poses(name);
    }
}
