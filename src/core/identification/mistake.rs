//! Mistakes in a whole table of measurements, each with the data as they would be without it.

use nalgebra::Point3;

use super::problem::PointSample;
use crate::kinematics::{Arm, Joint, JointType};
use crate::text;
use crate::units::{DEGREE, INCH, MILLIMETRE, to_deg};

/// Factors of coordinates in another unit, with the story.
const UNITS: [(f64, &str); 7] = [
    (1e-3, "metres were read as millimetres; name the columns 'x_m', 'y_m', 'z_m'"),
    (1e3, "millimetres were read as metres; name the columns 'x_mm', 'y_mm', 'z_mm'"),
    (MILLIMETRE / INCH, "inches were read as millimetres; name the columns 'x_in', 'y_in', 'z_in'"),
    (INCH / MILLIMETRE, "millimetres were read as inches; name the columns 'x_mm', 'y_mm', 'z_mm'"),
    (INCH, "metres were read as inches; name the columns 'x_m', 'y_m', 'z_m'"),
    (0.1, "centimetres were read as millimetres; multiply the coordinates by 10"),
    (10.0, "tenths of millimetres were read as millimetres; divide the coordinates by 10"),
];
/// Zeros that joints are given by other conventions (rad).
const ZEROS: [f64; 3] = [90.0 * DEGREE, -90.0 * DEGREE, 180.0 * DEGREE];
/// Most joints whose signs are tried in every combination.
const MOST_SIGNS: usize = 8;

/// How the columns of the joints are mixed up.
#[derive(Clone, Debug, PartialEq)]
pub enum Columns {
    /// Two of them are exchanged.
    Exchanged {
        /// Indices of the joints.
        joints: [usize; 2],
    },
    /// The value of joint 1 is in the column of this joint, and so on, round and round.
    Rotated {
        /// Index of the column.
        first: usize,
    },
    /// They are in reverse order.
    Reversed,
    /// They begin with this joint, and the last ones are empty.
    Shifted {
        /// Index of the joint.
        first: usize,
    },
}

/// A mistake that explains data the nominal robot cannot.
#[derive(Clone, Debug, PartialEq)]
pub enum Mistake {
    /// Measured coordinates are in another unit.
    CoordinateUnit {
        /// Measured extent over predicted extent.
        ratio: f64,
        /// The likely story.
        story: &'static str,
    },
    /// Joint values were radians read as degrees.
    RadiansAsDegrees,
    /// Joint values were degrees read as radians.
    DegreesAsRadians,
    /// Joints count the other way.
    JointSigns {
        /// Indices of the joints.
        joints: Vec<usize>,
    },
    /// Joints have another zero.
    JointZeros {
        /// Indices of the joints, and what has to be added to their pendant values (rad).
        zeros: Vec<(usize, f64)>,
    },
    /// A joint counts together with another one, or the profile wrongly says so.
    Coupling {
        /// Index of the joint.
        joint: usize,
        /// Index of the other one.
        with: usize,
        /// What has to be added to the pendant value per value of the other joint.
        factor: f64,
        /// Whether the joint also counts the other way.
        reversed: bool,
    },
    /// Columns of the joints are mixed up.
    Columns(Columns),
    /// From some row on, each point belongs to the configuration of another row.
    RowsShifted {
        /// Index of the first such sample.
        from: usize,
        /// Whether it is that of the row below; else of the row above.
        below: bool,
    },
    /// The points are in reverse order.
    RowsReversed,
    /// Two coordinates of the points are exchanged, or one has the wrong sign. A rigid registration cannot tell which.
    Coordinates,
    /// The measured frame is left-handed.
    Mirrored,
}

impl Mistake {
    /// What it is and what to do, with names instead of indices.
    pub fn describe(&self, joint_name: impl Fn(usize) -> String) -> String {
        let listed = |joints: &[usize]| {
            let names: Vec<String> = joints.iter().map(|joint| joint_name(*joint)).collect();
            text::listed(&names)
        };
        match self {
            Self::CoordinateUnit { ratio, story } => {
                format!("the measured points span {ratio:.4} times what the robot can reach between them: {story}")
            }
            Self::RadiansAsDegrees => {
                "the joint values fit when read as radians: name the columns 'q1_rad', 'q2_rad', …".to_owned()
            }
            Self::DegreesAsRadians => {
                "the joint values fit when read as degrees: name the columns 'q1_deg', 'q2_deg', …".to_owned()
            }
            Self::JointSigns { joints } => match joints.as_slice() {
                [joint] => format!(
                    "joint {} counts the other way: the data fit with its sign reversed; check the sign of its column, or 'direction' in the profile",
                    joint_name(*joint)
                ),
                several => format!(
                    "joints {} count the other way: the data fit with their signs reversed; check the signs of their columns, or 'direction' in the profile",
                    listed(several)
                ),
            },
            Self::JointZeros { zeros } => match zeros.as_slice() {
                [(joint, offset)] => format!(
                    "joint {} has another zero: the data fit with {:+.0} deg added to it; check the column, or 'theta_deg' in the profile",
                    joint_name(*joint),
                    to_deg(*offset)
                ),
                several => {
                    let joints: Vec<usize> = several.iter().map(|(joint, _)| *joint).collect();
                    let offsets: Vec<String> =
                        several.iter().map(|(_, offset)| format!("{:+.0}", to_deg(*offset))).collect();
                    format!(
                        "joints {} have another zero: the data fit with {} deg added to them; check the columns, or 'theta_deg' in the profile",
                        listed(&joints),
                        text::listed(&offsets)
                    )
                }
            },
            Self::Coupling { joint, with, factor, reversed } => {
                let (joint, with) = (joint_name(*joint), joint_name(*with));
                let sign = if *reversed { "minus " } else { "" };
                format!(
                    "joint {joint} counts together with {with}, or the profile says so and the values do not: the data fit with {sign}{joint} {factor:+.0} times {with} in place of {joint}; check 'coupling' of {joint} in the profile (FANUC robots and parallel linkages), and whether the values are those of the pendant"
                )
            }
            Self::Columns(Columns::Exchanged { joints: [one, other] }) => format!(
                "the columns of joints {} and {} are exchanged: exchange their names in the header",
                joint_name(*one),
                joint_name(*other)
            ),
            Self::Columns(Columns::Rotated { first }) => format!(
                "the columns of the joints are rotated: the value of {} is in the column of {}; correct the header",
                joint_name(0),
                joint_name(*first)
            ),
            Self::Columns(Columns::Reversed) => {
                "the columns of the joints are in reverse order: correct the header".to_owned()
            }
            Self::Columns(Columns::Shifted { first }) => format!(
                "the columns of the joints are shifted: the first one holds {}, and the last ones no joint; correct the header, and look for the missing joints",
                joint_name(*first)
            ),
            Self::RowsShifted { from, below } => {
                let (what, remedy) = if *below {
                    ("below", "a point is missing there: leave its row out and move the points down again")
                } else {
                    ("above", "there is a point too many: remove it and move the points up again")
                };
                format!(
                    "from sample {} on, each point belongs to the joint values of the row {what}: {remedy}",
                    from + 1
                )
            }
            Self::RowsReversed => {
                "the points fit in reverse order: joints and points were listed in opposite orders; reverse one of them"
                    .to_owned()
            }
            Self::Coordinates => {
                "two columns of coordinates are exchanged (x and y, y and z, or x and z), or one has the wrong sign: the points fit when one axis is reversed; compare the coordinates of one point with the display of the instrument, and correct the header or the column"
                    .to_owned()
            }
            Self::Mirrored => {
                "the points fit only when mirrored: the instrument's frame is left-handed; reverse one of its axes. Trackers are hardly ever left-handed: rule out the signs of the joints and exchanged columns of coordinates first"
                    .to_owned()
            }
        }
    }

    /// How common it is: the smaller the likelier among explanations that fit equally.
    pub(super) fn rarity(&self) -> usize {
        match self {
            Self::CoordinateUnit { .. } | Self::RadiansAsDegrees | Self::DegreesAsRadians => 0,
            Self::JointSigns { joints } => joints.len(),
            // Half a turn looks like a reversed joint or two, which is commoner.
            Self::JointZeros { zeros } => {
                zeros.len() + 2 * zeros.iter().filter(|(_, zero)| zero.abs() > 135.0 * DEGREE).count()
            }
            Self::Coupling { reversed, .. } => 1 + usize::from(*reversed),
            Self::Columns(_) | Self::RowsShifted { .. } | Self::RowsReversed => 2,
            // Three joints at once is what an arm looks like that is symmetric about a plane.
            Self::Coordinates => 4,
            Self::Mirrored => 9,
        }
    }

    /// Whether this is the other one and more.
    pub(super) fn contains(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::JointSigns { joints }, Self::JointSigns { joints: fewer }) => {
                fewer.len() < joints.len() && fewer.iter().all(|joint| joints.contains(joint))
            }
            (Self::JointZeros { zeros }, Self::JointZeros { zeros: fewer }) => {
                fewer.len() < zeros.len() && fewer.iter().all(|zero| zeros.contains(zero))
            }
            (Self::RowsShifted { below, .. }, Self::RowsShifted { below: other, .. }) => below == other,
            _ => false,
        }
    }
}

/// A mistake with the samples as they would be without it.
pub(super) type Trial = (Mistake, Vec<PointSample>);

fn alter(points: &[PointSample], change: impl Fn(&mut PointSample)) -> Vec<PointSample> {
    let mut altered = points.to_vec();
    altered.iter_mut().for_each(change);
    altered
}

fn is_turning(joints: &[Joint], joint: usize) -> bool {
    joints[joint].joint_type == JointType::Revolute
}

/// Mistakes of one number each, which are tried whatever the others show. `ratio` is measured over predicted extent.
pub(super) fn simple(arm: &Arm, points: &[PointSample], ratio: f64) -> Vec<Trial> {
    let joints = arm.chain.joints();
    let mut trials: Vec<Trial> = UNITS
        .iter()
        .filter(|(factor, _)| (0.5..2.0).contains(&(ratio / factor)))
        .map(|(factor, story)| {
            let scaled = alter(points, |sample| sample.point.coords /= *factor);
            (Mistake::CoordinateUnit { ratio, story }, scaled)
        })
        .collect();
    let scaled = |factor: f64| {
        alter(points, |sample| {
            for joint in (0..joints.len()).filter(|joint| is_turning(joints, *joint)) {
                sample.at.configuration[joint] *= factor;
            }
        })
    };
    trials.push((Mistake::RadiansAsDegrees, scaled(1.0 / DEGREE)));
    trials.push((Mistake::DegreesAsRadians, scaled(DEGREE)));
    let mirrored = alter(points, |sample| sample.point = Point3::new(-sample.point.x, sample.point.y, sample.point.z));
    trials.push((Mistake::Coordinates, mirrored.clone()));
    trials.push((Mistake::Mirrored, mirrored));
    for joint in 0..joints.len() {
        trials.push(signs(points, vec![joint]));
    }
    for zero in single_zeros(joints) {
        trials.push(zeros(points, vec![zero]));
    }
    trials
}

/// Mistakes of several numbers, of which there are many: all but a few are ruled out at a glance.
pub(super) fn compound(arm: &Arm, all: &[PointSample], picked: &[PointSample]) -> Vec<Trial> {
    let joints = arm.chain.joints();
    let count = joints.len();
    let mut trials = Vec::new();
    for set in 1..1_usize << count.min(MOST_SIGNS) {
        if set.count_ones() > 1 {
            trials.push(signs(picked, (0..count).filter(|joint| set >> joint & 1 == 1).collect()));
        }
    }
    let single = single_zeros(joints);
    for (index, one) in single.iter().enumerate() {
        for other in single[index + 1..].iter().filter(|other| other.0 != one.0) {
            trials.push(zeros(picked, vec![*one, *other]));
            // Three at once, by the zeros of neighbours.
            for third in single.iter().filter(|third| third.0 == other.0 + 1) {
                trials.push(zeros(picked, vec![*one, *other, *third]));
            }
        }
    }
    for joint in 1..count {
        for (factor, reversed) in [(1.0, false), (-1.0, false), (1.0, true), (-1.0, true)] {
            let with = joint - 1;
            let coupled = alter(picked, |sample| {
                let q = &mut sample.at.configuration;
                q[joint] = if reversed { -q[joint] } else { q[joint] } + factor * q[with];
            });
            trials.push((Mistake::Coupling { joint, with, factor, reversed }, coupled));
        }
    }
    trials.extend(columns(count, picked));
    trials.extend(rows(arm, all));
    trials
}

fn signs(points: &[PointSample], joints: Vec<usize>) -> Trial {
    let reversed = alter(points, |sample| joints.iter().for_each(|joint| sample.at.configuration[*joint] *= -1.0));
    (Mistake::JointSigns { joints }, reversed)
}

fn zeros(points: &[PointSample], zeros: Vec<(usize, f64)>) -> Trial {
    let moved = alter(points, |sample| {
        for (joint, offset) in &zeros {
            sample.at.configuration[*joint] += offset;
        }
    });
    (Mistake::JointZeros { zeros }, moved)
}

/// The zeros that one joint can have. That of joint 1 only turns the base: distances cannot see it, and need not.
fn single_zeros(joints: &[Joint]) -> Vec<(usize, f64)> {
    let turning = (1..joints.len()).filter(|joint| is_turning(joints, *joint));
    turning.flat_map(|joint| ZEROS.map(|offset| (joint, offset))).collect()
}

fn columns(count: usize, points: &[PointSample]) -> Vec<Trial> {
    let arranged = |columns: Columns, source: &dyn Fn(usize) -> Option<usize>| {
        let altered = alter(points, |sample| {
            let given = sample.at.configuration.clone();
            for (joint, value) in sample.at.configuration.iter_mut().enumerate() {
                *value = source(joint).and_then(|column| given.get(column).copied()).unwrap_or(0.0);
            }
        });
        (Mistake::Columns(columns), altered)
    };
    let mut trials = Vec::new();
    for one in 0..count {
        for other in one + 1..count {
            let source = |joint| {
                Some(if joint == one {
                    other
                } else if joint == other {
                    one
                } else {
                    joint
                })
            };
            trials.push(arranged(Columns::Exchanged { joints: [one, other] }, &source));
        }
    }
    for first in 1..count {
        trials.push(arranged(Columns::Rotated { first }, &|joint| Some((joint + first) % count)));
    }
    trials.push(arranged(Columns::Reversed, &|joint| Some(count - 1 - joint)));
    for first in 1..=2.min(count.saturating_sub(2)) {
        trials.push(arranged(Columns::Shifted { first }, &|joint| joint.checked_sub(first)));
    }
    trials
}

/// Points of another row, from the first sample on or from the sample where the distances between neighbours say so.
fn rows(arm: &Arm, all: &[PointSample]) -> Vec<Trial> {
    let mut trials = Vec::new();
    let with_configuration_of =
        |sample: &PointSample, other: &PointSample| PointSample { at: other.at.clone(), ..sample.clone() };
    let reversed = all.iter().zip(all.iter().rev()).map(|(sample, other)| with_configuration_of(sample, other));
    trials.push((Mistake::RowsReversed, reversed.collect()));
    for below in [true, false] {
        let shifted = |from: usize| -> Vec<PointSample> {
            let other = |index: usize| if below { index + 1 } else { index.wrapping_sub(1) };
            let moved = (from..all.len()).filter_map(|index| Some((all.get(index)?, all.get(other(index))?)));
            all[..from].iter().cloned().chain(moved.map(|(a, b)| with_configuration_of(a, b))).collect()
        };
        let start = usize::from(!below);
        // A break at the first rows is none.
        let later = break_of(arm, all, below).filter(|from| *from > start + 1);
        for from in [Some(start), later].into_iter().flatten() {
            trials.push((Mistake::RowsShifted { from, below }, shifted(from)));
        }
    }
    trials
}

/// The sample from which on the distances between neighbours fit those one row below or above best.
fn break_of(arm: &Arm, all: &[PointSample], below: bool) -> Option<usize> {
    let predicted = arm.points_in_base(all.iter().map(|sample| &sample.at));
    let count = all.len();
    // An error of a metre is not worse than one of a hundred millimetres: neither fits.
    let miss = |index: usize, of: usize| -> f64 {
        let (Some(from), Some(to)) = (predicted.get(of), predicted.get(of + 1)) else { return 0.0 };
        ((all[index].point - all[index + 1].point).norm() - (from - to).norm()).abs().min(0.1)
    };
    let pairs = count.saturating_sub(1);
    let as_given: Vec<f64> = (0..pairs).map(|index| miss(index, index)).collect();
    let shifted: Vec<f64> =
        (0..pairs).map(|index| miss(index, if below { index + 1 } else { index.saturating_sub(1) })).collect();
    let mut before = 0.0;
    let mut after: f64 = shifted.iter().skip(1).sum();
    let mut best = None;
    for from in 1..pairs {
        // The pair across the break fits neither.
        if best.is_none_or(|(_, least)| before + after < least) {
            best = Some((from, before + after));
        }
        before += as_given[from - 1];
        after -= shifted[from];
    }
    best.map(|(from, _)| from)
}
