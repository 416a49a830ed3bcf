//! Models in and out: URDF to profile, profile to URDF, the identified arm in every format, each proven at random configurations.

use std::fs;

use crate::support::root;
use nalgebra::{Isometry3, Point3};
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use trupose::kinematics::{Arm as KinematicArm, Convention, ForwardKinematics, KinematicChain, ParameterId};
use trupose::model::proof::{self, configurations, prove};
use trupose::model::{
    Arm, CalibratedArm, Coupling, ExportOptions, Format, GivenUrdf, Heading, ImportedArm, ModelError, Urdf, complete,
    export, geometry_only, import, import_coupled, link_values, read_factory, urdf_text,
};
use trupose::profile::{Level, Masses, Profile, builtin, builtin_names};
use trupose::session::summary::JointErrorSummary;
use trupose::units::{MICRORADIAN, to_deg, to_mm};

const BOTH: [Convention; 2] = [Convention::Standard, Convention::Modified];

fn profile(name: &str) -> Profile {
    Profile::parse(builtin(name).unwrap(), name).unwrap_or_else(|errors| panic!("{errors}")).0
}

fn fixture(name: &str) -> String {
    fs::read_to_string(root().join("tests/urdf").join(name)).unwrap()
}

/// The chain written as a profile and read again.
fn through_text(arm: &ImportedArm) -> KinematicChain {
    let heading = Heading { comments: &["a test".to_owned()], name: "Test Arm", title: "t", source: "s" };
    let part = Arm { chain: &arm.chain, ranges: &arm.ranges, beta_joints: &arm.beta_joints, masses: &arm.masses };
    let text = geometry_only(&heading, &part);
    let (read, warnings) = Profile::parse(&text, "test.ron").unwrap_or_else(|errors| panic!("{errors}\n{text}"));
    // What a URDF cannot know, and nothing else: a beta that is not needed would be warned about too.
    for warning in &warnings {
        let warning = warning.to_string();
        assert!(warning.contains("no target is given") || warning.contains("has no limits"), "{warning}\n{text}");
    }
    assert_eq!(read.beta_joints(), arm.beta_joints);
    read.chain().clone()
}

fn limits(profile: &Profile) -> Vec<Option<(f64, f64)>> {
    profile.joints().iter().map(|range| range.limits).collect()
}

fn differs(a: &Isometry3<f64>, b: &Isometry3<f64>) -> f64 {
    (a.translation.vector - b.translation.vector).norm().max(a.rotation.angle_to(&b.rotation))
}

/// Deviations as they are expected of this robot, three times over.
fn deviated(profile: &Profile, seed: u64) -> KinematicChain {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let free = profile.parameters(Level::Geometric);
    let links = free.iter().filter(|free| free.id.target().is_none());
    let deviations: Vec<_> =
        links.map(|free| (free.id, 3.0 * free.expected * random.random_range(-1.0..1.0))).collect();
    profile.arm().with(deviations).unwrap().chain
}

fn calibrated(profile: &Profile) -> CalibratedArm {
    let identified = KinematicArm { chain: deviated(profile, 7), ..profile.arm() };
    CalibratedArm {
        geometry: identified.clone(),
        identified,
        lost: None,
        joint_errors: Vec::new(),
        about: vec!["Identified geometry of a test".to_owned()],
        edited: None,
        cautions: Vec::new(),
        untold: Vec::new(),
        profile: profile.clone(),
    }
}

#[test]
fn shipped_profiles_survive_the_way_through_urdf() {
    for name in builtin_names() {
        let profile = profile(name);
        // The nominal arm, and one that no axis of which is exactly parallel to another.
        for chain in [profile.chain().clone(), deviated(&profile, 3)] {
            let text = urdf_text(name, &[], &chain, profile.joints()).unwrap();
            let urdf = Urdf::parse(&text).unwrap();
            let way = urdf.chain("base", "flange").unwrap();
            for convention in BOTH {
                let imported =
                    import(&way, convention).unwrap_or_else(|error| panic!("{name} {convention:?}: {error}"));
                let read = through_text(&imported);
                let arm = ForwardKinematics::new(&read);
                // Joint values of a URDF turn one link against the one before: a coupled arm is uncoupled by it.
                let written = |q: &[f64]| arm.base_from_flange(&link_values(&chain, q));
                prove(&chain, &limits(&profile), proof::IMPORT, written)
                    .unwrap_or_else(|error| panic!("{name}: {error}"));
                for (joint, own) in read.joints().iter().zip(chain.joints()) {
                    assert_eq!((&joint.name, joint.joint_type), (&own.name, own.joint_type));
                    let worst = joint.link.a.abs().max(joint.link.d.abs());
                    assert!(worst < 2.0, "{name} {convention:?}: {} is {worst} m", joint.name);
                }
            }
        }
    }
}

/// Link constants in mm and degrees, for messages.
fn table(chain: &KinematicChain) -> String {
    let row = |joint: &trupose::kinematics::Joint| {
        let link = joint.link;
        let [alpha, theta, beta] = [link.alpha, link.theta, link.beta].map(to_deg);
        let (a, d) = (to_mm(link.a), to_mm(link.d));
        format!("{}: alpha {alpha:.4} a {a:.4} d {d:.4} theta {theta:.4} beta {beta:.4}\n", joint.name)
    };
    chain.joints().iter().map(row).collect()
}

fn imported(file: &str, base: &str, tip: &str, convention: Convention) -> ImportedArm {
    let urdf = Urdf::parse(&fixture(file)).unwrap();
    let way = urdf.chain(base, tip).unwrap();
    let arm = import(&way, convention).unwrap();
    let read = through_text(&arm);
    let fk = ForwardKinematics::new(&read);
    let limits: Vec<_> = arm.ranges.iter().map(|range| range.limits).collect();
    for q in configurations(&arm.chain, &limits, 1000) {
        let apart = differs(&fk.base_from_flange(&q), &way.base_from_tip(&q));
        assert!(apart < 1e-9, "{file} {base} {tip}: {apart}");
    }
    arm
}

#[test]
fn a_factory_calibrated_ur_comes_out_sane() {
    for (convention, beta_joints) in [(Convention::Standard, vec![1, 2]), (Convention::Modified, vec![2, 3])] {
        for (base, tip) in [("base", "tool0"), ("world", "camera"), ("base_link_inertia", "wrist_3_link")] {
            let arm = imported("ur5_calibrated.urdf", base, tip, convention);
            assert_eq!(arm.beta_joints, beta_joints);
            for joint in arm.chain.joints() {
                assert!(joint.link.a.abs() < 0.5 && joint.link.d.abs() < 0.2, "{}", table(&arm.chain));
            }
            assert!(arm.notes.is_empty(), "{:?}", arm.notes);
        }
    }
    // Close to the maker's constants: a2 = -425 mm, a3 = -392.25 mm, d5 = 94.65 mm.
    let arm = imported("ur5_calibrated.urdf", "base", "tool0", Convention::Standard);
    let links: Vec<_> = arm.chain.joints().iter().map(|joint| joint.link).collect();
    assert!((links[1].a + 0.42531).abs() < 2e-4 && (links[2].a + 0.39206).abs() < 1e-3, "{}", table(&arm.chain));
    assert!((links[4].d - 0.09472).abs() < 2e-4 && links[1].theta.abs() < 1e-3, "{}", table(&arm.chain));
    let speed = arm.ranges[0].max_speed.unwrap();
    assert!((to_deg(speed) - 180.0).abs() < 1e-9 && arm.ranges[2].limits.unwrap().0 < -3.1);
}

#[test]
fn a_panda_is_craigs_table_again() {
    let arm = imported("panda.urdf", "panda_link0", "panda_link8", Convention::Modified);
    assert_eq!(*arm.chain.base(), Isometry3::identity());
    let shipped = profile("franka_panda");
    for (joint, known) in arm.chain.joints().iter().zip(shipped.chain().joints()) {
        let (link, known) = (joint.link, known.link);
        let same = (link.alpha - known.alpha).abs() < 1e-9
            && (link.a - known.a).abs() < 1e-9
            && (link.d - known.d).abs() < 1e-9
            && (link.theta - known.theta).abs() < 1e-9;
        assert!(same, "{}", table(&arm.chain));
    }
    let arm = imported("panda.urdf", "panda_link0", "panda_leftfinger", Convention::Standard);
    assert_eq!(arm.chain.dof(), 8);
}

#[test]
fn a_scara_with_a_sliding_joint_keeps_its_arm_lengths() {
    let arm = imported("scara.urdf", "table", "tool", Convention::Standard);
    let links: Vec<_> = arm.chain.joints().iter().map(|joint| joint.link).collect();
    assert!(
        (links[0].a.abs() - 0.225).abs() < 1e-3 && (links[1].a.abs() - 0.175).abs() < 1e-3,
        "{}",
        table(&arm.chain)
    );
    assert_eq!(arm.beta_joints, [0, 1, 2]);
    assert_eq!(arm.notes, ["joint 'J4' is continuous: it has no limits; poses are planned only within limits"]);
    imported("scara.urdf", "pedestal", "shaft", Convention::Modified);
}

#[test]
fn what_is_no_serial_chain_is_refused_with_its_place() {
    let panda = fixture("panda.urdf");
    let urdf = Urdf::parse(&panda).unwrap();
    let refused = |base: &str, tip: &str| urdf.chain(base, tip).unwrap_err().to_string();
    let message = refused("panda_link0", "panda_rightfinger");
    assert!(
        message.starts_with("line 45: joint 'panda_finger_joint2': it follows joint 'panda_finger_joint1'"),
        "{message}"
    );
    let message = refused("panda_link3", "panda_link0");
    assert!(
        message.contains("joint 'panda_joint3'") && message.contains("leads up over this revolute joint"),
        "{message}"
    );
    let message = refused("panda_link7", "panda_link8");
    assert!(message.contains("no joint moves between"), "{message}");
    let message = refused("panda_linkO", "panda_link8");
    assert!(message.contains("there is no link 'panda_linkO'; links: panda_link0,"), "{message}");

    let joint = |inside: &str| {
        format!(
            "<robot name='r'><link name='a'/><link name='b'/>\n<joint name='j' type='revolute'>\n<parent link='a'/><child link='b'/>{inside}</joint></robot>"
        )
    };
    for (text, expected) in [
        ("<robot><link", "line 1, column"),
        ("<sdf/>", "line 1: <sdf>: a URDF begins with <robot>"),
        (
            &joint("").replace("<link name='b'/>", "<link name='b'/>\n<link name='b'/>"),
            "line 2: link 'b': the link of line 1 has the same name",
        ),
        (
            "<robot xmlns:xacro='http://www.ros.org/wiki/xacro'>\n<xacro:arm/></robot>",
            "line 2: <xacro:arm>: this is xacro, not URDF; expand it first",
        ),
        (
            &joint("").replace("parent link='a'", "parent link='x'"),
            "links 'a' and 'b' are not connected; line 3: <parent> of joint 'j': there is no link 'x'",
        ),
        (
            &joint("\n<origin rpy='0 1 ${pi/2}'/>"),
            "line 4: <origin> of joint 'j': attribute 'rpy' has '${pi/2}', which is not a number; it is xacro: expand it first",
        ),
        (
            &joint("\n<origin xyz='0 1'/>"),
            "line 4: <origin> of joint 'j': attribute 'xyz' needs three numbers, it has 2",
        ),
        (
            &joint("\n<origin rpy='0 1 x'/>"),
            "line 4: <origin> of joint 'j': attribute 'rpy' has 'x', which is not a number",
        ),
        (&joint("<axis xyz='0 0 0'/>"), "line 2: <axis> of joint 'j': it has no direction"),
        (&joint("\n<origin/>\n<origin/>"), "line 5: <origin> of joint 'j': the joint has two of them"),
    ] {
        let message = refusal(text, "a", "b");
        assert!(message.starts_with(expected), "{message}\nexpected {expected}");
    }
    let floating = joint("").replace("revolute", "floating");
    let message = Urdf::parse(&floating).unwrap().chain("a", "b").unwrap_err().to_string();
    assert!(message.starts_with("line 2: joint 'j': type 'floating' is not part of a serial arm"), "{message}");
    let ring = "<robot><link name='a'/><link name='b'/><joint name='j' type='fixed'><parent link='a'/><child link='b'/></joint>\
        <joint name='k' type='fixed'><parent link='b'/><child link='a'/></joint></robot>";
    assert!(Urdf::parse(ring).unwrap().chain("a", "b").unwrap_err().to_string().contains("part of a ring"));
    let two = "<robot><link name='a'/><link name='b'/><joint name='j' type='fixed'><parent link='a'/><child link='b'/></joint>\n\
        <joint name='k' type='fixed'><parent link='a'/><child link='b'/></joint></robot>";
    let message = refusal(two, "a", "b");
    assert!(message.starts_with("line 2: joint 'k': link 'b' already hangs on joint 'j' (line 1)"), "{message}");
}

/// Why there is no chain between two links.
fn refusal(text: &str, base: &str, tip: &str) -> String {
    match Urdf::parse(text) {
        Ok(urdf) => urdf.chain(base, tip).unwrap_err().to_string(),
        Err(error) => error.to_string(),
    }
}

/// What has no effect on the chain is no reason to refuse it.
#[test]
fn defects_elsewhere_do_not_matter() {
    let arm = |inside: &str, outside: &str| {
        format!(
            "<robot name='r'><link name='a'/><link name='b'/><link name='c'/>{outside}\
            <joint name='j' type='revolute'><parent link='a'/><child link='b'/><origin xyz='0.1 0.2 0.3' rpy='0.4 0.5 0.6'/><axis xyz='0 1 0'/>{inside}</joint>\
            <joint name='end' type='fixed'><parent link='b'/><child link='c'/><origin xyz='0 0 1'/><axis xyz='0 0 0'/><limit lower='3' upper='1'/></joint></robot>"
        )
    };
    let pose = |text: &str| {
        let urdf = Urdf::parse(text).unwrap_or_else(|error| panic!("{error}\n{text}"));
        let chain = urdf.chain("a", "c").unwrap_or_else(|error| panic!("{error}\n{text}"));
        (chain.base_from_tip(&[0.7]), import(&chain, Convention::Standard).unwrap().notes)
    };
    let limit = "<limit lower='-1' upper='1'/>";
    let (expected, notes) = pose(&arm(limit, ""));
    assert!(notes.is_empty(), "{notes:?}");
    let joint = |inside: &str| {
        format!("<link name='g'/><joint name='f' type='prismatic'><parent link='c'/><child link='g'/>{inside}</joint>")
    };
    for text in [
        arm(limit, &joint("<axis xyz='0 0 0'/>")),
        arm(limit, &joint("<axis xyz='0 0 x'/>")),
        arm(limit, &joint("<limit lower='2' upper='1'/>")),
        arm(limit, &joint("<origin xyz='1 2'/>")),
        arm(limit, &joint("<origin/><origin/>")),
        arm(limit, &joint("").replace("name='f'", "name='j'")),
        arm(limit, &joint("").replace("link='c'", "link='nowhere'")),
        arm(limit, &joint("").replace("type='prismatic'", "")),
        arm(limit, "<link/><joint/><link name='g'/><link name='g'/>"),
        arm(limit, "<link name='g'><inertial/></link>"),
        format!("\n\n<?xml version='1.0'?>\n{}", arm(limit, "")),
        format!(
            "<?xml version='1.0'?><!DOCTYPE robot [<!ENTITY h '0.3'>]>{}",
            arm(limit, "").replace("0.2 0.3'", "0.2 &h;'")
        ),
    ] {
        let (found, notes) = pose(&text);
        assert!(differs(&found, &expected) < 1e-15 && notes.is_empty(), "{notes:?}\n{text}");
    }
    // Limits are not geometry either: without usable ones the joint has none.
    for (inside, note) in [
        ("<limit lower='-inf' upper='inf' velocity='inf'/>", "has no usable <limit>"),
        ("<limit lower='1' upper='-1'/>", "lower 1 is above upper -1, taken as no limits"),
        (
            "<limit lower='${low}' upper='1'/>",
            "lower '${low}' is not a number and is left out; it is xacro: expand it first",
        ),
    ] {
        let (found, notes) = pose(&arm(inside, ""));
        assert!(differs(&found, &expected) < 1e-15 && notes.iter().any(|said| said.contains(note)), "{notes:?}");
    }
    // A mass of the arm that cannot be read: the geometry without masses.
    let heavy =
        arm(limit, "").replace("<link name='b'/>", "<link name='b'><inertial><mass value='x'/></inertial></link>");
    let (found, notes) = pose(&heavy);
    assert!(
        differs(&found, &expected) < 1e-15 && notes[0].starts_with("no masses are taken: line 1: <mass> of link 'b'"),
        "{notes:?}"
    );
}

#[test]
fn rounded_angles_are_pointed_out() {
    let said = |angle: &str| {
        let text = format!(
            "<robot name='r'><link name='a'/><link name='b'/><joint name='j' type='revolute'><parent link='a'/><child link='b'/>\
            <origin rpy='{angle} 0 0'/><limit lower='-1' upper='1'/></joint></robot>"
        );
        let urdf = Urdf::parse(&text).unwrap();
        import(&urdf.chain("a", "b").unwrap(), Convention::Standard).unwrap().notes
    };
    for (angle, meant) in [
        ("1.57", "89.9544 deg; if 90 deg is meant, write 1.5707963267948966"),
        ("3.141", "if 180 deg"),
        ("-0.785", "if -45 deg"),
    ] {
        let notes = said(angle);
        assert!(notes.len() == 1 && notes[0].contains(meant), "{notes:?}");
    }
    for angle in ["1.5707963", "1.5708", "0", "0.3", "1.5", "1.56"] {
        assert_eq!(said(angle), Vec::<String>::new(), "{angle}");
    }
}

/// A FANUC through a URDF, whose joints turn one link against the one before, counts like the pendant again.
#[test]
fn a_coupling_makes_pendant_values_of_joint_values() {
    let profile = profile("fanuc_lrmate200id");
    let chain = profile.chain();
    let coupled: Vec<(usize, &trupose::kinematics::Joint)> = chain
        .joints()
        .iter()
        .enumerate()
        .filter(|(_, joint)| joint.coupling.iter().any(|factor| *factor != 0.0))
        .collect();
    let [(index, joint)] = coupled.as_slice() else { panic!("one coupled joint") };
    let other = joint.coupling.iter().position(|factor| *factor != 0.0).unwrap();
    let text = urdf_text("fanuc", &[], chain, profile.joints()).unwrap();
    let urdf = Urdf::parse(&text).unwrap();
    let way = urdf.chain("base", "flange").unwrap();
    // In a URDF both joints turn with the signs of the pendant.
    let sign = if joint.coupling[other] > 0.0 { "" } else { "-" };
    let option = format!("{}={sign}{}", joint.name, chain.joints()[other].name);
    let arm = import_coupled(&way, Convention::Standard, &[option.parse().unwrap()]).unwrap();
    assert!(
        arm.notes.iter().any(|note| note.contains(&format!("'{}' counts with another", chain.joints()[*index].name)))
    );
    let read = through_text(&arm);
    let (ours, theirs) = (ForwardKinematics::new(&read), ForwardKinematics::new(chain));
    for q in configurations(chain, &limits(&profile), 200) {
        assert!(differs(&ours.base_from_flange(&q), &theirs.base_from_flange(&q)) < 1e-8);
    }
    let uncoupled =
        ForwardKinematics::new(&import(&way, Convention::Standard).unwrap().chain).base_from_flange(&[0.3; 6]);
    assert!(differs(&uncoupled, &theirs.base_from_flange(&[0.3; 6])) > 0.05);
    assert!("J3".parse::<Coupling>().is_err() && "J3=J3".parse::<Coupling>().is_err());
    let unknown = import_coupled(&way, Convention::Standard, &["J3=J9".parse().unwrap()]).unwrap_err().to_string();
    assert!(unknown.contains("there is no joint"), "{unknown}");
}

/// A rail and seven joints.
#[test]
fn a_rail_with_seven_joints_is_one_arm() {
    let panda = profile("franka_panda");
    let inner = urdf_text("panda", &[], panda.chain(), panda.joints()).unwrap();
    let text = inner.replace(
        "<link name=\"base\"/>",
        "<link name=\"base\"/><link name=\"floor\"/><joint name=\"rail\" type=\"prismatic\"><parent link=\"floor\"/><child link=\"base\"/><origin xyz=\"0 0.5 0.2\" rpy=\"0 0 1.2\"/><axis xyz=\"1 0 0\"/><limit lower=\"-2\" upper=\"3\"/></joint>",
    );
    let urdf = Urdf::parse(&text).unwrap();
    let way = urdf.chain("floor", "flange").unwrap();
    for convention in BOTH {
        let arm = import(&way, convention).unwrap();
        let read = through_text(&arm);
        assert_eq!(read.dof(), 8);
        let fk = ForwardKinematics::new(&read);
        for q in configurations(&read, &[Some((-2.0, 3.0))], 200) {
            assert!(differs(&fk.base_from_flange(&q), &way.base_from_tip(&q)) < 1e-9);
        }
    }
}

/// The deviations of a controller of Universal Robots: the same arm as their plain constants, with sane ones.
#[test]
fn a_factory_calibration_is_the_nominal_arm() {
    let profile = profile("ur5");
    let theta = [1e-6, 0.178, 6.2, -0.09_f64, 6e-6, -5e-7];
    let (a, alpha) = ([-2e-4, 3e-4, -1e-4, 1e-4, -2e-4, 0.0], [1e-3, 3.5e-4, -4e-4, 4e-4, -2e-3, 0.0]);
    // Three nearly parallel axes: large d that nearly cancel.
    let d = [9e-5, 12.062, 17.671, -29.733, -3e-5, 2e-4];
    let list = |values: &[f64; 6]| values.iter().map(|value| format!("{value:e}")).collect::<Vec<_>>().join(", ");
    let conf = |d: &[f64; 6], theta: &[f64; 6]| {
        format!(
            "[mounting]\ndelta_theta = [ {}]\ndelta_a = [{}]\ndelta_d = [ {}]\ndelta_alpha = [{}]\ncalibration_status = 2 # Linearised\n",
            list(theta),
            list(&a),
            list(d),
            list(&alpha)
        )
    };
    let plain = |d: &[f64; 6], theta: &[f64; 6]| {
        let joints = profile.chain().joints().iter().enumerate().map(|(index, joint)| trupose::kinematics::Joint {
            link: trupose::kinematics::Link {
                theta: joint.link.theta + theta[index],
                a: joint.link.a + a[index],
                d: joint.link.d + d[index],
                alpha: joint.link.alpha + alpha[index],
                ..joint.link
            },
            ..joint.clone()
        });
        KinematicChain::new(Convention::Standard, *profile.chain().base(), joints.collect(), *profile.chain().flange())
            .unwrap()
    };
    // Large angles make another arm, which is refused; with the nominal ones it is this arm.
    let refused = read_factory(&conf(&d, &theta), &profile).unwrap_err().to_string();
    assert!(refused.contains("is that of another model"), "{refused}");
    let (theta, d) = ([1e-6, 2e-4, -3e-4, 1e-4, 6e-6, -5e-7], [9e-5, 1.2062, 1.7671, -2.9733, -3e-5, 2e-4]);
    let alpha_free = read_factory(&conf(&d, &theta), &profile).unwrap();
    let meant = ForwardKinematics::new(&plain(&d, &theta)).base_from_flange(&[0.3, -1.0, 1.2, -0.4, 0.9, 2.0]);
    let found =
        ForwardKinematics::new(&through_text(&alpha_free.arm)).base_from_flange(&[0.3, -1.0, 1.2, -0.4, 0.9, 2.0]);
    assert!(differs(&found, &meant) < 1e-8);
    assert!(
        alpha_free.arm.chain.joints().iter().all(|joint| joint.link.d.abs() < 0.2),
        "{}",
        table(&alpha_free.arm.chain)
    );
    assert_eq!(alpha_free.arm.beta_joints, profile.beta_joints());
    assert!(alpha_free.moved > 1e-4 && alpha_free.moved < 0.05);

    // Out again in the kinematics file of the ROS description, and in from it.
    let mut arm = calibrated(&profile);
    arm.geometry.chain = alpha_free.arm.chain.clone();
    arm.identified = arm.geometry.clone();
    let yaml =
        export(&arm, Format::UrKinematics, &ExportOptions { with_tool_offset: true, ..ExportOptions::default() })
            .unwrap()
            .text;
    let back = read_factory(&yaml, &profile).unwrap().arm.chain;
    let (one, other) = (ForwardKinematics::new(&back), ForwardKinematics::new(&alpha_free.arm.chain));
    for q in configurations(&back, &limits(&profile), 100) {
        assert!(differs(&one.base_from_flange(&q), &other.base_from_flange(&q)) < 1e-8);
    }
    for (text, expected) in [
        ("hello".to_owned(), "neither a 'calibration.conf'"),
        (conf(&d, &theta).replace("delta_d", "delta_e"), "'delta_d' is missing"),
        (conf(&d, &theta).replacen(", ", " ", 1), "'delta_theta' has something that is not a number"),
        (yaml.replacen("    yaw", "    jaw", 1), "a link or a number is missing"),
    ] {
        let refused = read_factory(&text, &profile).unwrap_err().to_string();
        assert!(refused.contains(expected), "{refused}");
    }
}

#[test]
fn a_joint_without_limits_and_a_gimbal_locked_origin_are_exact() {
    let text = "<robot name='r'><link name='a'/><link name='b'/><link name='c'/><link name='d'/>\
        <joint name='j1' type='revolute'><parent link='a'/><child link='b'/><origin xyz='0.1 0.2 0.3' rpy='0.4 1.5707963267948966 0.3'/><axis xyz='1 2 -2'/></joint>\
        <joint name='j2' type='prismatic'><parent link='b'/><child link='c'/><origin xyz='0 0 1' rpy='0.1 -1.5707963267948966 2'/></joint>\
        <joint name='j3' type='revolute'><parent link='c'/><child link='d'/><origin xyz='1 0 0' rpy='0 -1.5707963267948966 0'/><axis xyz='0 3 0'/><limit lower='0' upper='0' velocity='0'/></joint></robot>";
    let urdf = Urdf::parse(text).unwrap();
    let way = urdf.chain("a", "d").unwrap();
    for convention in BOTH {
        let arm = import(&way, convention).unwrap();
        assert_eq!(arm.notes.len(), 3, "{:?}", arm.notes);
        let read = through_text(&arm);
        let fk = ForwardKinematics::new(&read);
        for q in configurations(&read, &[], 200) {
            assert!(differs(&fk.base_from_flange(&q), &way.base_from_tip(&q)) < 1e-9);
        }
    }
}

/// What hangs together without motion is one mass, in the frame at the end of its link; the tool is not part of the arm.
#[test]
fn masses_of_a_urdf_arrive_at_the_same_places() {
    let text = "<robot name='r'>
        <link name='base'><inertial><mass value='9'/></inertial></link>
        <link name='upper'><inertial><origin xyz='0 0.1 0.2' rpy='1 2 3'/><mass value='4'/></inertial></link>
        <link name='cover'><inertial><origin xyz='0 0 0.05'/><mass value='1'/></inertial></link>
        <link name='lower'><inertial><origin xyz='0.2 0 0'/><mass value='2.5'/></inertial></link>
        <link name='flange'/><link name='gripper'><inertial><mass value='0.7'/></inertial></link>
        <joint name='j1' type='revolute'><parent link='base'/><child link='upper'/><origin xyz='0.1 0 0.3' rpy='0.2 0 0.1'/><axis xyz='0 0 1'/><limit lower='-2' upper='2'/></joint>
        <joint name='screws' type='fixed'><parent link='upper'/><child link='cover'/><origin xyz='0.3 0 0' rpy='0 1.5 0'/></joint>
        <joint name='j2' type='revolute'><parent link='upper'/><child link='lower'/><origin xyz='0 0.05 0.4' rpy='1.5 0.1 0'/><axis xyz='0 1 0'/><limit lower='-2' upper='2'/></joint>
        <joint name='end' type='fixed'><parent link='lower'/><child link='flange'/><origin xyz='0.5 0 0'/></joint>
        <joint name='tool' type='fixed'><parent link='flange'/><child link='gripper'/></joint></robot>";
    let urdf = Urdf::parse(text).unwrap();
    let way = urdf.chain("base", "flange").unwrap();
    let pose = |name: &str, q: &[f64]| urdf.chain("base", name).unwrap().base_from_tip(q);
    let q = [0.7, -1.1];
    let centre = |link: &str, at: [f64; 3]| pose(link, &q) * Point3::from(at);
    let (upper, cover) = (centre("upper", [0.0, 0.1, 0.2]), centre("cover", [0.0, 0.0, 0.05]));
    let expected = [(5.0, (upper.coords * 4.0 + cover.coords) / 5.0), (2.5, centre("lower", [0.2, 0.0, 0.0]).coords)];
    for convention in BOTH {
        let arm = import(&way, convention).unwrap();
        assert_eq!(
            arm.notes,
            ["link 'gripper' is fixed to the tip: its mass is not part of the arm; state it as 'payload'"]
        );
        let read = through_text(&arm);
        let frames = ForwardKinematics::new(&read).base_from_links(&q);
        for (joint, (mass, place)) in expected.iter().enumerate() {
            let found = read.loads().unwrap().links()[joint];
            assert!((found.mass - mass).abs() < 1e-9);
            assert!(((frames[joint + 1] * found.centre).coords - place).norm() < 1e-9, "{convention:?} {joint}");
        }
    }
    // The base does not move: its mass says nothing. That of a moving link is left out with the reason.
    for (wrong, message) in [
        ("<inertial><mass value='-4'/>", "line 3: <mass> of link 'upper': -4 kg is below zero"),
        (
            "<inertial><mass value='x'/>",
            "line 3: <mass> of link 'upper': attribute 'value' has 'x', which is not a number",
        ),
        ("<inertial>", "line 3: <inertial> of link 'upper': has no <mass>"),
    ] {
        let given = "<inertial><origin xyz='0 0.1 0.2' rpy='1 2 3'/><mass value='4'/>";
        let urdf = Urdf::parse(&text.replacen(given, wrong, 1)).unwrap();
        let arm = import(&urdf.chain("base", "flange").unwrap(), Convention::Standard).unwrap();
        assert_eq!(arm.masses, Masses::Unknown);
        assert!(arm.notes.contains(&format!("no masses are taken: {message}")), "{:?}", arm.notes);
        let base = Urdf::parse(&text.replacen("<inertial><mass value='9'/>", wrong, 1)).unwrap();
        assert_ne!(
            import(&base.chain("base", "flange").unwrap(), Convention::Standard).unwrap().masses,
            Masses::Unknown
        );
    }
    // A corrected profile keeps what gravity acts on.
    let given = builtin("ur5").unwrap().replacen("    targets: [", "    payload: (mass_kg: 2.0, centre_mm: (0.0, 1.0, 60.0)),\n    gravity_in_base: (0.0, 0.6, -0.8),\n    targets: [", 1);
    for given in [
        given.as_str(),
        builtin("meca500").unwrap(),
        &given.replace("gravity_in_base: (0.0, 0.6, -0.8)", "mounting: Wall"),
    ] {
        let given = Profile::parse(given, "given").unwrap().0;
        let heading = Heading { comments: &[], name: "x", title: "t", source: "s" };
        let written = complete(&heading, &given, given.chain(), given.targets());
        let read = Profile::parse(&written, "written").unwrap_or_else(|errors| panic!("{errors}\n{written}")).0;
        assert_eq!(read.masses(), given.masses());
        assert_eq!((read.payload(), read.mounting()), (given.payload(), given.mounting()));
    }
}

#[test]
fn every_format_carries_every_arm_or_says_why_not() {
    for name in builtin_names() {
        let profile = profile(name);
        let arm = calibrated(&profile);
        for &format in <Format as clap::ValueEnum>::value_variants() {
            let is_ur = name.starts_with("ur");
            match export(&arm, format, &ExportOptions { with_tool_offset: true, ..ExportOptions::default() }) {
                Ok(done) => {
                    assert!(done.agreement.position < 1e-9 && done.agreement.angle < 1e-9, "{name} {format:?}");
                    let is_off = proof::configurations(profile.chain(), &limits(&profile), 1).iter().any(|q| {
                        let (nominal, identified) = (profile.chain(), &arm.identified.chain);
                        let pose = |chain| ForwardKinematics::new(chain).base_from_flange(q);
                        differs(&pose(nominal), &pose(identified)) > 1e-4
                    });
                    assert!(is_off, "{name}: the proof would not tell identified from nominal");
                }
                Err(ModelError::Unsuitable(reason)) => {
                    let has_no_curves = format == Format::JointCorrections;
                    assert!(has_no_curves || format == Format::UrKinematics && !is_ur, "{name} {format:?}: {reason}");
                }
                Err(error) => panic!("{name} {format:?}: {error}"),
            }
        }
    }
}

#[test]
fn a_corrected_profile_differs_from_the_nominal_one_in_geometry_and_targets_only() {
    for name in builtin_names() {
        let profile = profile(name);
        let text = export(&calibrated(&profile), Format::CorrectedProfile, &ExportOptions::default()).unwrap().text;
        let (read, _) = Profile::parse(&text, "corrected.ron").unwrap();
        assert_eq!(read.fixed_parameters(), profile.fixed_parameters());
        assert_eq!(read.beta_joints(), profile.beta_joints());
        assert_eq!(read.joint_aliases(), profile.joint_aliases());
        let close = |a: f64, b: f64| (a - b).abs() < 1e-9;
        for (a, b) in read.joints().iter().zip(profile.joints()) {
            for (a, b) in [(a.limits, b.limits), (a.planning_limits, b.planning_limits)] {
                assert!(close(a.unwrap().0, b.unwrap().0) && close(a.unwrap().1, b.unwrap().1));
            }
            assert!(close(a.max_speed.unwrap(), b.max_speed.unwrap()));
        }
        let free = |profile: &Profile| profile.parameters(Level::Geometric);
        assert!(free(&read).iter().zip(free(&profile)).all(|(a, b)| a.id == b.id && close(a.expected, b.expected)));
        assert_eq!(read.bodies().len(), profile.bodies().len());
        assert_eq!(read.instrument().map(|i| &i.name), profile.instrument().map(|i| &i.name));
        assert_eq!(read.floor().is_some(), profile.floor().is_some());
        assert_eq!(read.acceptance().position_rms.is_some(), profile.acceptance().position_rms.is_some());
    }
}

#[test]
fn nothing_is_written_that_differs() {
    let profile = profile("soochow");
    let arm = ForwardKinematics::new(profile.chain());
    let tilted = deviated(&profile, 1);
    let error = prove(&tilted, &limits(&profile), proof::EXPORT, |q| arm.base_from_flange(q)).unwrap_err();
    assert!(matches!(error, ModelError::Differs { position_mm, .. } if position_mm > 0.01), "{error}");
    let error = prove(&tilted, &[], proof::EXPORT, |_| Isometry3::translation(f64::NAN, 0.0, 0.0)).unwrap_err();
    assert!(matches!(error, ModelError::Differs { .. }), "{error}");
}

/// A text without the elements `<origin …>`, and how many there were.
fn without_origins(text: &str) -> (String, usize) {
    let mut parts = text.split("<origin");
    let mut rest = parts.next().unwrap().to_owned();
    let mut count = 0;
    for part in parts {
        let (_, after) = part.split_once('>').unwrap();
        rest.push_str(after.strip_prefix("</origin>").unwrap_or(after));
        count += 1;
    }
    (rest, count)
}

#[test]
fn a_given_urdf_changes_in_the_origins_of_its_chain_only() {
    let (given, profile) = (fixture("ur5.urdf"), profile("ur5"));
    let arm = calibrated(&profile);
    for (base, tip, changed) in [("base", "tool0", 7), ("base", "flange", 7)] {
        let options = ExportOptions { into: Some(GivenUrdf { text: &given, base, tip }), ..ExportOptions::default() };
        let done = export(&arm, Format::Urdf, &options).unwrap();
        assert!(done.agreement.position < 1e-9);
        assert_eq!(without_origins(&done.text), without_origins(&given), "something else changed");
        let lines = done.text.lines().zip(given.lines()).filter(|(new, old)| new != old).count();
        assert!(lines >= changed, "{lines}");
        assert!(
            done.text.contains("<joint name=\"elbow_joint\"><origin xyz=\"9 9 9\"/>"),
            "a transmission is no joint"
        );
        // Meshes stay on their links: every link frame moves by the size of the deviations only.
        let (old, new) = (Urdf::parse(&given).unwrap(), Urdf::parse(&done.text).unwrap());
        for joint in &old.joints {
            let other = new.joints.iter().find(|other| other.name == joint.name).unwrap();
            assert!(differs(&joint.origin, &other.origin) < 0.06, "{}", joint.name);
            assert_eq!((joint.limits, joint.axis), (other.limits, other.axis));
        }
    }
    // From the wrong base, without a fixed joint behind the last axis, and of another robot: refused.
    let refused = |base: &str, tip: &str, arm: &CalibratedArm| {
        let options = ExportOptions { into: Some(GivenUrdf { text: &given, base, tip }), ..ExportOptions::default() };
        export(arm, Format::Urdf, &options).unwrap_err().to_string()
    };
    assert!(refused("base_link", "tool0", &arm).contains("not the nominal arm of the profile"));
    assert!(refused("base", "wrist_3_link", &arm).contains("no fixed joint behind it"));
    assert!(
        refused("base", "tool0", &calibrated(&self::profile("ur10"))).contains("not the nominal arm of the profile")
    );
    assert!(refused("base", "tool0", &calibrated(&self::profile("franka_panda"))).contains("has 6 moving joints"));
}

#[test]
fn urdfs_with_their_own_frames_are_patched_too() {
    // Every frame of the given URDF is turned about its axis and moved along it, axes point anywhere, some count backwards.
    for name in ["soochow", "kuka_kr6_r900", "fanuc_lrmate200id", "epson_ls3_b401s", "franka_panda"] {
        let profile = profile(name);
        let fresh = urdf_text(name, &[], profile.chain(), profile.joints()).unwrap();
        let urdf = Urdf::parse(&fresh).unwrap();
        let way = urdf.chain("base", "flange").unwrap();
        let mut random = ChaCha8Rng::seed_from_u64(5);
        let mut given = fresh.clone();
        let mut before = Isometry3::identity();
        let places: Vec<usize> = fresh.match_indices("<origin").map(|(place, _)| place).collect();
        let mut edits = Vec::new();
        for (joint, place) in way.joints.iter().zip(places) {
            let is_fixed = joint.type_name == "fixed";
            let z = if is_fixed { 0.0 } else { random.random_range(-0.1..0.1) };
            let turn = nalgebra::UnitQuaternion::from_euler_angles(
                random.random_range(-1.0..1.0),
                random.random_range(-1.0..1.0),
                random.random_range(-1.0..1.0),
            );
            let own = if is_fixed {
                Isometry3::identity()
            } else {
                Isometry3::from_parts(nalgebra::Translation3::new(0.0, 0.0, z), turn)
            };
            let origin = before.inverse() * joint.origin * own;
            let axis = own.rotation.inverse() * joint.axis.into_inner();
            let [roll, pitch, yaw] = trupose::model::roll_pitch_yaw(&origin.rotation);
            let p = origin.translation.vector;
            edits.push((
                place,
                format!("<origin xyz=\"{} {} {}\" rpy=\"{roll} {pitch} {yaw}\"/>", p.x, p.y, p.z),
                axis,
            ));
            before = own;
        }
        for (place, origin, axis) in edits.into_iter().rev() {
            let end = place + given.get(place..).unwrap().find('>').unwrap() + 1;
            given.replace_range(place..end, &origin);
            let after = place + origin.len();
            let Some(start) = given.get(after..).unwrap().find("<axis") else { continue };
            let start = after + start;
            let end = start + given.get(start..).unwrap().find('>').unwrap() + 1;
            if !given.get(after..start).unwrap().contains("</joint>") {
                given.replace_range(start..end, &format!("<axis xyz=\"{} {} {}\"/>", axis.x, axis.y, axis.z));
            }
        }
        let options = ExportOptions {
            into: Some(GivenUrdf { text: &given, base: "base", tip: "flange" }),
            ..ExportOptions::default()
        };
        let done =
            export(&calibrated(&profile), Format::Urdf, &options).unwrap_or_else(|error| panic!("{name}: {error}"));
        assert_eq!(without_origins(&done.text), without_origins(&given), "{name}");
    }
}

#[test]
fn the_ur_file_is_the_one_of_the_ros_description() {
    let profile = profile("ur5");
    let mut arm = calibrated(&profile);
    let error = export(&arm, Format::UrKinematics, &ExportOptions::default()).unwrap_err().to_string();
    assert!(error.contains("alpha6, a6") && error.contains("Let the tool carry it"), "{error}");
    let options = ExportOptions { with_tool_offset: true, ..ExportOptions::default() };
    let remarks = export(&arm, Format::UrKinematics, &options).unwrap().remarks;
    assert!(remarks.iter().any(|remark| remark.contains("in front of every tool")), "{remarks:?}");
    arm.identified = profile.arm();
    arm.geometry = profile.arm();
    let text = export(&arm, Format::UrKinematics, &ExportOptions::default()).unwrap().text;
    let numbers = |name: &str| -> Vec<f64> {
        let lines = text.lines().skip_while(|line| *line != format!("  {name}:")).skip(1).take(6);
        lines.map(|line| line.split_once(": ").unwrap().1.parse().unwrap()).collect()
    };
    // Numbers of the public description of this robot.
    let half = std::f64::consts::FRAC_PI_2;
    for (name, expected) in [
        ("shoulder", [0.0, 0.0, 0.089_159, 0.0, 0.0, 0.0]),
        ("upper_arm", [0.0, 0.0, 0.0, half, 0.0, 0.0]),
        ("forearm", [-0.425, 0.0, 0.0, 0.0, 0.0, 0.0]),
        ("wrist_1", [-0.392_25, 0.0, 0.109_15, 0.0, 0.0, 0.0]),
        ("wrist_2", [0.0, -0.094_65, 0.0, half, 0.0, 0.0]),
        ("wrist_3", [0.0, 0.0823, 0.0, -half, 0.0, 0.0]),
    ] {
        for (found, expected) in numbers(name).iter().zip(expected) {
            assert!((found - expected).abs() < 1e-9, "{name}: {found} {expected}\n{text}");
        }
    }
}

/// An arm whose joints have errors of their own, with the curves as a calibration has them.
fn with_joint_errors(name: &str) -> CalibratedArm {
    let arm = calibrated(&profile(name));
    let terms = [(1, "sin3", 90.0), (1, "cos20", 40.0), (3, "cos1", -120.0), (0, "sin2", 60.0)];
    let deviation = |(joint, term, urad): (usize, &str, f64)| {
        (format!("joint{}.{term}", joint + 1).parse::<ParameterId>().unwrap(), urad * MICRORADIAN)
    };
    let identified = arm.identified.with(terms.map(deviation)).unwrap();
    let chain = &identified.chain;
    let joint_errors = chain.joints().iter().zip(chain.errors()).map(|(joint, error)| JointErrorSummary {
        joint: joint.name.clone(),
        measured_deg: (-60.0, 60.0),
        compliance_urad: (joint.name == chain.joints()[1].name).then_some((129.0, 15.0)),
        torque_nm: Some(150.0),
        curve_rms_urad: 50.0,
        curve: (-50..=50)
            .map(|index| (2.0 * f64::from(index), error.curve(f64::from(2 * index).to_radians()) / MICRORADIAN, 20.0))
            .collect(),
    });
    let joint_errors = joint_errors.collect();
    CalibratedArm { identified, joint_errors, lost: Some("geometry only: 0.12 mm".to_owned()), ..arm }
}

#[test]
fn formats_of_geometry_get_the_geometry_identified_alone_and_say_what_is_lost() {
    let arm = with_joint_errors("ur5");
    for format in [Format::CorrectedProfile, Format::Urdf, Format::DhCsv, Format::Json, Format::UrKinematics] {
        let options = ExportOptions { with_tool_offset: true, ..ExportOptions::default() };
        let done = export(&arm, format, &options).unwrap();
        assert!(done.agreement.position < 1e-9 && done.agreement.angle < 1e-9, "{format:?}");
        assert!(done.text.contains("geometry only: 0.12 mm"), "{format:?}: {}", done.text);
        assert!(done.remarks.iter().any(|remark| remark == "geometry only: 0.12 mm"), "{format:?}");
    }
    let without = export(&calibrated(&profile("ur5")), Format::DhCsv, &ExportOptions::default()).unwrap();
    assert!(!without.text.contains("geometry only"), "{}", without.text);
}

/// `(joint, angle in degrees, correction in rad)`.
fn corrections(text: &str) -> Vec<(String, f64, f64)> {
    let mut reader = csv::ReaderBuilder::new().comment(Some(b'#')).from_reader(text.as_bytes());
    assert_eq!(reader.headers().unwrap(), vec!["joint", "angle_deg", "correction_urad", "sigma_urad"]);
    let rows = reader.deserialize::<(String, f64, f64, f64)>().map(Result::unwrap);
    rows.map(|(joint, angle, correction, _)| (joint, angle, correction * MICRORADIAN)).collect()
}

#[test]
fn a_joint_with_its_correction_added_turns_as_if_it_had_no_error() {
    // Joints that count the other way are among them.
    for name in ["ur5", "kuka_kr6_r900"] {
        let arm = with_joint_errors(name);
        let done = export(&arm, Format::JointCorrections, &ExportOptions::default()).unwrap();
        assert!(done.agreement.angle < 2.0 * MICRORADIAN, "{:?}", done.agreement);
        assert!(done.text.contains("ADD it to the commanded angle"), "{}", done.text);
        assert!(done.text.contains("compliance 0.860 ± 0.100 urad/Nm (129 ± 15 urad at 150 Nm)"), "{}", done.text);
        assert!(done.remarks.is_empty(), "{:?}", done.remarks);
        let table = corrections(&done.text);
        assert_eq!(table.len(), 6 * 201);
        let with_errors = ForwardKinematics::new(&arm.identified.chain);
        let without = arm.identified.chain.without_errors();
        let without = ForwardKinematics::new(&without);
        for angle in [-83.0, -7.0, 0.0, 45.0, 91.0] {
            let meant = vec![f64::to_radians(angle); 6];
            let commanded: Vec<f64> = arm
                .identified
                .chain
                .joints()
                .iter()
                .zip(&meant)
                .map(|(joint, value)| {
                    let row =
                        table.iter().find(|(name, at, _)| *name == joint.name && (*at - angle).abs() < 1e-9).unwrap();
                    value + row.2
                })
                .collect();
            let apart = |q: &[f64]| differs(&with_errors.base_from_flange(q), &without.base_from_flange(&meant));
            assert!(apart(&commanded) < 2e-7 && apart(&meant) > 2e-5, "{name} {angle}: {}", apart(&commanded));
        }
    }
}

/// Damaged files of others: refused or read, never a panic.
#[test]
fn mutated_urdfs_and_factory_calibrations_never_panic() {
    let profile = profile("ur5");
    let conf = "[mounting]\ndelta_theta = [1e-4, 0.0, 0.0, 0.0, 0.0, 0.0]\ndelta_a = [0, 0, 0, 0, 0, 0]\ndelta_d = [0, 0, 0, 0, 0, 0]\n\
        delta_alpha = [0, 0, 0, 0, 0, 0]\ncalibration_status = 2 # x\n";
    assert!(read_factory(conf, &profile).is_ok());
    let urdf = format!(
        "<?xml version=\"1.0\" encoding=\"ISO-8859-1\"?><!DOCTYPE robot [<!ENTITY h '0.3'>]>{}",
        fixture("scara.urdf").trim_start_matches("<?xml version=\"1.0\"?>")
    );
    let mut random = ChaCha8Rng::seed_from_u64(5);
    for round in 0..400 {
        for text in [conf, urdf.as_str()] {
            let mut bytes = text.as_bytes().to_vec();
            for _ in 0..random.random_range(1..6) {
                let at = random.random_range(0..bytes.len());
                match random.random_range(0..3) {
                    0 => bytes[at] = random.random_range(0..=255),
                    1 => drop(bytes.remove(at)),
                    _ => bytes.insert(at, random.random_range(0..=255)),
                }
            }
            if round % 50 == 0 {
                bytes.truncate(bytes.len() / 2);
            }
            drop(read_factory(&String::from_utf8_lossy(&bytes), &profile));
            let Ok(text) = trupose::model::decode_xml(&bytes) else { continue };
            let Ok(urdf) = Urdf::parse(&text) else { continue };
            if let (Some(first), Some(last)) = (urdf.links.first(), urdf.links.last())
                && let Ok(chain) = urdf.chain(first, last)
            {
                drop(import(&chain, Convention::Standard));
            }
        }
    }
}
