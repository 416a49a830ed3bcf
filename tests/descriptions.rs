//! Robot descriptions of other shapes than those of the shipped profiles: in, to a profile, out and in again.

use trupose::kinematics::{Convention, ForwardKinematics};
use trupose::model::proof::configurations;
use trupose::model::{Arm, Heading, Urdf, geometry_only, import, urdf_text};
use trupose::profile::Profile;

/// Joints of an arm, one per line: type, place (m), roll, pitch and yaw (rad), axis.
const ARMS: [(&str, &str); 6] = [
    (
        "two pairs of parallel axes on a tilted column",
        "revolute 0 0 0.31 0 0.12 0.4 0 0 1\nrevolute 0.05 0 0.1 1.5707963 0 0 0 0 1\nrevolute 0 0.42 0 0 0 0.2 0 0 1\nrevolute 0.11 0.33 0.02 0 0 0 0 0 1",
    ),
    (
        "seven joints with shifted elbow and wrist",
        "revolute 0 0 0.22 0 0 0 0 0 1\nrevolute 0 0 0.14 0 0 0 0 1 0\nrevolute 0.02 0 0.21 0 0 0 0 0 1\nrevolute -0.03 0 0.19 0 0 0 0 -1 0\nrevolute 0 0 0.2 0 0 0 0 0 1\nrevolute 0.06 0 0.2 0 0 0 0 1 0\nrevolute 0.08 0 0 0 1.5707963 0 0 0 1",
    ),
    (
        "a gantry of three slides that carries a wrist",
        "prismatic 0 0 2.1 0 0 0 1 0 0\nprismatic 0.1 0 0 0 0 0 0 1 0\nprismatic 0 0 -0.3 0 0 0 0 0 -1\nrevolute 0 0 -0.2 0 0 0 0 0 1\nrevolute 0 0.05 -0.1 0 0 0 1 0 0\nrevolute 0 0 -0.12 0 0 0 0 0 1",
    ),
    (
        "axes that cross at no right angle",
        "revolute 0 0 0.4 0 0 0 0 0 1\nrevolute 0.1 0.02 0.2 0.7 0.1 0 0.6 0 0.8\nrevolute 0.3 -0.01 0.1 -0.4 0.5 1.1 0 0.28 0.96\nrevolute 0.05 0.04 0.5 0.2 -0.9 0.3 1 0 0\nrevolute 0 0.1 0.3 1 0.2 -0.6 0 1 0\nrevolute 0.02 0 0.1 0.5 1.2 0.7 0 0 -1",
    ),
    (
        "a horizontal arm with a slide before its last joint",
        "revolute 0 0 0.5 0 0 0 0 0 1\nrevolute 0.35 0 0.04 0 0 0 0 0 1\nprismatic 0.25 0 0 3.1415926 0 0 0 0 1\nrevolute 0 0 0.1 0 0 0 0 0 1",
    ),
    (
        "a painting arm with a skew wrist on a rail",
        "prismatic 0 -1 0.1 0 0 1.57 1 0 0\nrevolute 0 0 0.5 0 0 0 0 0 1\nrevolute 0.2 0 0.3 0 0 0 0 1 0\nrevolute 0 0 1.1 0 0 0 0 1 0\nrevolute 1.2 0 0.15 0 0 0 1 0 0\nrevolute 0.1 0 0 0 0 0 0.8191520 0.5735764 0\nrevolute 0.08 0 0 0 0 0 1 0 0\nrevolute 0.05 0 0.02 0 0.3 0 0 1 0",
    ),
];

/// The URDF, with a camera and names that the chain does not need.
fn description(joints: &str) -> String {
    let mut text =
        "<!-- drawn for a test -->\n<robot name='drawn'>\n<material name='grey'/><link name='part0'/>\n".to_owned();
    for (index, line) in joints.lines().enumerate() {
        let words: Vec<&str> = line.split(' ').collect();
        let [kind, x, y, z, roll, pitch, yaw, u, v, w] = words[..] else { panic!("{line}") };
        let next = index + 1;
        let part = format!(
            "<link name='part{next}'><visual/></link>\n<joint type='{kind}' name='drive_{next}'><axis xyz='{u} {v} {w}'/>\n <limit upper='1.9' lower='-1.7' velocity='2'/><child link='part{next}'/><parent link='part{index}'/><origin rpy='{roll} {pitch} {yaw}' xyz='{x} {y} {z}'/></joint>\n"
        );
        text.push_str(&part);
    }
    let last = joints.lines().count();
    text + &format!(
        "<link name='camera'/><joint name='eye' type='fixed'><parent link='part0'/><child link='camera'/><axis xyz='0 0 0'/></joint>\n<link name='plate'/><joint name='plate' type='fixed'><parent link='part{last}'/><child link='plate'/><origin xyz='0.01 0.02 0.03' rpy='0.1 -0.2 0.3'/></joint>\n</robot>\n"
    )
}

#[test]
fn arms_of_other_shapes_survive_the_way_to_a_profile_and_back() {
    for (name, joints) in ARMS {
        let given = Urdf::parse(&description(joints)).unwrap();
        let way = given.chain("part0", "plate").unwrap();
        for convention in [Convention::Standard, Convention::Modified] {
            let arm = import(&way, convention).unwrap_or_else(|error| panic!("{name} {convention:?}: {error}"));
            let heading = Heading { comments: &[], name: "drawn", title: name, source: "a test" };
            let part =
                Arm { chain: &arm.chain, ranges: &arm.ranges, beta_joints: &arm.beta_joints, masses: &arm.masses };
            let text = geometry_only(&heading, &part);
            let (profile, _warnings) = Profile::parse(&text, name).unwrap_or_else(|errors| panic!("{name}: {errors}"));
            let written = urdf_text("drawn", &[], profile.chain(), profile.joints()).unwrap();
            let again = Urdf::parse(&written).unwrap();
            let back = again.chain("base", "flange").unwrap();
            let limits: Vec<_> = profile.joints().iter().map(|range| range.limits).collect();
            let fk = ForwardKinematics::new(profile.chain());
            assert_eq!(profile.chain().dof(), joints.lines().count(), "{name}");
            for q in configurations(profile.chain(), &limits, 100) {
                let meant = way.base_from_tip(&q);
                for found in [fk.base_from_flange(&q), back.base_from_tip(&q)] {
                    let apart = (found.to_homogeneous() - meant.to_homogeneous()).abs().max();
                    assert!(apart < 1e-9, "{name} {convention:?}: {apart}");
                }
            }
        }
    }
}
