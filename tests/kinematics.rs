//! Laws of the kinematics, for every parameter of every shipped robot.

use std::f64::consts::PI;

use crate::support::derivatives::{STEP, assert_derivatives};
use crate::support::paper_case::seeded;
use nalgebra::{Isometry3, Matrix4, Point3, Vector3};
use rand::RngExt as _;
use rand_chacha::ChaCha8Rng;
use trupose::kinematics::{
    Arm, Convention, ForwardKinematics, Joint, JointType, KinematicChain, Link, ParameterId, Place,
};
use trupose::profile::{Profile, builtin, builtin_names};

fn shipped() -> Vec<Profile> {
    builtin_names().map(|name| Profile::parse(builtin(name).unwrap(), name).unwrap().0).collect()
}

/// All parameters that an arm with one target can have: more than any profile frees.
fn all_parameters(chain: &KinematicChain) -> Vec<ParameterId> {
    ParameterId::all(chain.dof(), 1).collect()
}

fn random_configuration(chain: &KinematicChain, rng: &mut ChaCha8Rng) -> Vec<f64> {
    chain
        .joints()
        .iter()
        .map(|joint| match joint.joint_type {
            JointType::Revolute => rng.random_range(-PI..PI),
            JointType::Prismatic => rng.random_range(-0.3..0.3),
        })
        .collect()
}

/// A chain whose link constants are all a little off, so that no derivative is zero by symmetry.
fn disturbed(chain: &KinematicChain, rng: &mut ChaCha8Rng) -> KinematicChain {
    let deviations: Vec<_> = all_parameters(chain).into_iter().map(|id| (id, rng.random_range(-0.02..0.02))).collect();
    let arm = Arm { chain: chain.clone(), targets: vec![Point3::origin()] };
    arm.with(deviations).unwrap().chain
}

#[test]
fn identification_jacobian_matches_difference_quotients() {
    let mut rng = seeded(1);
    for profile in shipped() {
        for round in 0..10 {
            let chain = if round == 0 { profile.chain().clone() } else { disturbed(profile.chain(), &mut rng) };
            let ids = all_parameters(&chain);
            let place = Place { configuration: random_configuration(&chain, &mut rng), target: 0 };
            let arm = Arm { chain, targets: vec![Point3::new(0.03, -0.02, 0.09)] };
            assert_derivatives(profile.name(), &arm, &ids, &place);
        }
    }
}

#[test]
fn configuration_jacobian_matches_difference_quotients() {
    let mut rng = seeded(2);
    for profile in shipped() {
        let chain = disturbed(profile.chain(), &mut rng);
        let arm = ForwardKinematics::new(&chain);
        let target = Point3::new(0.03, -0.02, 0.09);
        for _ in 0..10 {
            let q = random_configuration(&chain, &mut rng);
            let jacobian = arm.configuration_jacobian(&q, &target);
            for joint in 0..chain.dof() {
                let at = |step: f64| {
                    let mut q = q.clone();
                    q[joint] += step;
                    (arm.point_in_base(&q, &target), arm.base_from_flange(&q).rotation)
                };
                let (plus, minus) = (at(STEP), at(-STEP));
                let linear = (plus.0 - minus.0) / (2.0 * STEP);
                let angular = (plus.1 * minus.1.inverse()).scaled_axis() / (2.0 * STEP);
                let column = jacobian.matrix.column(joint);
                let error = (column.fixed_rows::<3>(0) - linear).norm() + (column.fixed_rows::<3>(3) - angular).norm();
                assert!(error < 1e-8, "{} joint {joint} at {q:?}: {error}", profile.name());
            }
        }
    }
}

/// Equation (3) of the method paper, entry by entry as printed.
fn equation_3(theta: f64, d: f64, a: f64, alpha: f64, beta: f64) -> Matrix4<f64> {
    let ((st, ct), (sa, ca), (sb, cb)) = (theta.sin_cos(), alpha.sin_cos(), beta.sin_cos());
    Matrix4::new(
        ct * cb - st * sa * sb,
        -st * ca,
        ct * sb + st * sa * cb,
        a * ct,
        st * cb + ct * sa * sb,
        ct * ca,
        st * sb - ct * sa * cb,
        a * st,
        -ca * sb,
        sa,
        ca * cb,
        d,
        0.0,
        0.0,
        0.0,
        1.0,
    )
}

fn one_joint(convention: Convention, joint_type: JointType, link: Link) -> KinematicChain {
    let joint = Joint { name: "J1".to_owned(), joint_type, link, direction: 1.0, coupling: Vec::new() };
    KinematicChain::new(convention, Isometry3::identity(), vec![joint], Isometry3::identity()).unwrap()
}

#[test]
fn a_standard_link_is_equation_3() {
    let mut rng = seeded(3);
    for _ in 0..100 {
        let mut number = || rng.random_range(-2.0..2.0);
        let link = Link { alpha: number(), a: number(), d: number(), theta: number(), beta: number() };
        let q = number();
        let turned = one_joint(Convention::Standard, JointType::Revolute, link);
        let expected = equation_3(link.theta + q, link.d, link.a, link.alpha, link.beta);
        let found = ForwardKinematics::new(&turned).base_from_flange(&[q]).to_homogeneous();
        assert!((found - expected).norm() < 1e-14);
        let slid = one_joint(Convention::Standard, JointType::Prismatic, link);
        let expected = equation_3(link.theta, link.d + q, link.a, link.alpha, link.beta);
        assert!((ForwardKinematics::new(&slid).base_from_flange(&[q]).to_homogeneous() - expected).norm() < 1e-14);
    }
}

#[test]
fn a_modified_link_is_its_product_of_elementary_transforms() {
    let mut rng = seeded(4);
    for _ in 0..100 {
        let mut number = || rng.random_range(-2.0..2.0);
        let link = Link { alpha: number(), a: number(), d: number(), theta: number(), beta: number() };
        let q = number();
        let chain = one_joint(Convention::Modified, JointType::Revolute, link);
        let turn = |axis: Vector3<f64>, angle: f64| Isometry3::rotation(axis * angle);
        let expected = turn(Vector3::x(), link.alpha)
            * Isometry3::translation(link.a, 0.0, 0.0)
            * turn(Vector3::y(), link.beta)
            * turn(Vector3::z(), link.theta + q)
            * Isometry3::translation(0.0, 0.0, link.d);
        let found = ForwardKinematics::new(&chain).base_from_flange(&[q]);
        assert!((found.to_homogeneous() - expected.to_homogeneous()).norm() < 1e-14);
    }
}

#[test]
fn link_frames_end_at_the_flange() {
    let mut rng = seeded(5);
    for profile in shipped() {
        let chain = profile.chain();
        let q = random_configuration(chain, &mut rng);
        let arm = ForwardKinematics::new(chain);
        let frames = arm.base_from_links(&q);
        assert_eq!(frames.len(), chain.dof() + 2);
        let flange = frames[chain.dof()] * chain.flange();
        assert!((flange.to_homogeneous() - arm.base_from_flange(&q).to_homogeneous()).norm() < 1e-13);
        assert!((frames[0].to_homogeneous() - chain.base().to_homogeneous()).norm() < 1e-15);
    }
}
