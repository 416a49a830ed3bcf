//! The worked example of `docs/engineer.md`: the numbers that an integrator checks an implementation against are those of the program,
//! and the formulas in the document give the loads and angles in it.

use std::collections::BTreeMap;
use std::fs;

use nalgebra::{Isometry3, Point3, Vector3};
use trupose::kinematics::{Arm, ForwardKinematics, LinkMass, Loads, ParameterId};
use trupose::profile::{Profile, builtin};
use trupose::units::{DEGREE, MICRORADIAN, from_mm, to_mm};

use crate::support::root;

/// The part of the document.
fn document() -> String {
    let text = fs::read_to_string(root().join("docs/engineer.md")).unwrap();
    text.split_once("**Worked example.**").unwrap().1.split_once("<!-- end of example -->").unwrap().0.to_owned()
}

fn cells(line: &str) -> Vec<&str> {
    line.trim_matches('|').split('|').map(str::trim).collect()
}

fn numbers(text: &str) -> Vec<f64> {
    text.replace('−', "-").split(", ").map(|number| number.split(' ').next().unwrap().parse().unwrap()).collect()
}

/// Coefficients and deviations as they are stated: `NAME VALUE UNIT`.
fn deviations(document: &str) -> BTreeMap<ParameterId, f64> {
    let block = document.split_once("```text\n").unwrap().1.split_once("```").unwrap().0;
    let words: Vec<&str> = block.split_whitespace().collect();
    let parameter = |words: &[&str]| {
        let id: ParameterId = words[0].parse().unwrap();
        assert_eq!(words[2], id.unit().name(), "{id}");
        (id, id.unit().from_edge(words[1].parse().unwrap()))
    };
    words.chunks(3).map(parameter).collect()
}

/// Masses of the links, the payload last.
fn masses(document: &str) -> Vec<LinkMass> {
    let rows = document.split_once("end of link |\n|---|---|---|\n").unwrap().1.lines();
    rows.map_while(|line| line.starts_with('|').then(|| cells(line)))
        .map(|row| {
            let centre = numbers(row[2]);
            let centre = Point3::new(from_mm(centre[0]), from_mm(centre[1]), from_mm(centre[2]));
            LinkMass { mass: row[1].parse().unwrap(), centre }
        })
        .collect()
}

/// Gravity moment of everything beyond each joint, in the frame before its rotation: the formula of the document.
fn moments(nominal: &ForwardKinematics<'_>, masses: &[LinkMass], q: &[f64]) -> Vec<Vector3<f64>> {
    let frames: Vec<Isometry3<f64>> = nominal.base_from_links(q);
    let gravity = Vector3::new(0.0, 0.0, -9.81);
    (0..6)
        .map(|joint| {
            // Entry 0 is the base; the payload is in the flange frame, the last entry.
            let before = frames[joint];
            let beyond = masses.iter().enumerate().skip(joint).map(|(link, mass)| {
                let centre = frames[link + 1] * mass.centre;
                (centre - Point3::from(before.translation.vector)).cross(&gravity) * mass.mass
            });
            before.rotation.inverse() * beyond.sum::<Vector3<f64>>()
        })
        .collect()
}

#[test]
fn the_numbers_of_the_worked_example_are_those_of_the_program() {
    let document = document();
    let (deviations, masses) = (deviations(&document), masses(&document));
    let profile = Profile::parse(builtin("ur5").unwrap(), "ur5").unwrap().0;
    let nominal = profile.chain().without_errors();
    let ranges: Vec<(f64, f64)> = profile.joints().iter().map(|range| range.limits.unwrap()).collect();
    let (payload, links) = masses.split_last().unwrap();
    let loads = Loads::new(&nominal, links.to_vec(), *payload, -Vector3::z(), &ranges);
    let largest = (loads.largest_torque(1), loads.largest_torque(2), loads.largest_moment());
    let target = Point3::new(0.0, 0.0, 0.031);
    let arm = Arm { chain: nominal.clone().with_loads(loads), targets: vec![target] };
    let geometry =
        arm.with(deviations.iter().filter(|(id, _)| !id.is_joint_error()).map(|(id, by)| (*id, *by))).unwrap();
    let whole = arm.with(deviations.iter().map(|(id, by)| (*id, *by))).unwrap();

    let shown = |values: &[f64], decimals: usize| {
        values.iter().map(|value| format!("{value:.decimals$}")).collect::<Vec<_>>().join(", ")
    };
    let rows: Vec<Vec<&str>> =
        document.split_once("| quantity | value |\n|---|---|\n").unwrap().1.lines().map(cells).collect();
    let row = |name: &str| rows.iter().find(|row| row[0] == name).unwrap_or_else(|| panic!("no row '{name}'"))[1];
    let q: Vec<f64> = numbers(row("q (deg)")).iter().map(|value| value * DEGREE).collect();
    let away: Vec<f64> = q.iter().map(|value| -value).collect();
    let at = |arm: &Arm, q: &[f64]| {
        let point = ForwardKinematics::new(&arm.chain).point_in_base(q, &target);
        shown(&[to_mm(point.x), to_mm(point.y), to_mm(point.z)], 4)
    };

    let moment = moments(&ForwardKinematics::new(&nominal), &masses, &q);
    let value = |name: &str| deviations.get(&name.parse::<ParameterId>().unwrap()).copied().unwrap_or(0.0);
    let tilt = |axis: &str, moment: f64| value(&format!("joint1.tilt_{axis}")) * moment / largest.2;
    let turn = |joint: usize| {
        let curve: f64 = (1..=50_u32)
            .map(|order| {
                let angle = f64::from(order) * q[joint - 1];
                let [sine, cosine] = ["sin", "cos"].map(|wave| value(&format!("joint{joint}.{wave}{order}")));
                sine * angle.sin() + cosine * angle.cos()
            })
            .sum();
        let torque = match joint {
            2 => moment[1].z / largest.0,
            3 => moment[2].z / largest.1,
            _ => 0.0,
        };
        (curve + value(&format!("joint{joint}.compliance")) * torque) / MICRORADIAN
    };
    let tilts = [tilt("x", moment[0].x), tilt("y", moment[0].y)].map(|tilt| tilt / MICRORADIAN);

    let expected = [
        ("τ_2,max, τ_3,max, M_max (Nm)", shown(&[largest.0, largest.1, largest.2], 4)),
        ("τ_2, τ_3 (Nm)", shown(&[moment[1].z, moment[2].z], 4)),
        ("M_1x, M_1y (Nm)", shown(&[moment[0].x, moment[0].y], 4)),
        ("e_x, e_y, e_z of joint 1 (µrad)", shown(&[tilts[0], tilts[1], turn(1)], 3)),
        ("e_z of joints 2, 3, 6 (µrad)", shown(&[turn(2), turn(3), turn(6)], 3)),
        ("SMR, nominal arm (mm)", at(&arm, &q)),
        ("SMR, with the deviations of geometry (mm)", at(&geometry, &q)),
        ("SMR, with everything (mm)", at(&whole, &q)),
        ("the same at −q (mm)", at(&whole, &away)),
    ];
    for (name, computed) in &expected {
        assert_eq!(row(name), computed, "{name}");
    }
    assert_eq!(rows.iter().filter(|row| row.len() == 2).count(), expected.len() + 1, "a row is not checked");
}
