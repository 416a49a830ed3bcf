//! Reads joint trajectories of ROS: the `positions` of trajectory points and of the goals of a trajectory publisher, in YAML or
//! JSON, for the joints that the trajectory names.

use super::super::ProgramError;
use super::super::configuration::Configuration;
use super::super::findings::{Findings, Literal, Motion, Source, Way};
use super::super::lexer::{as_str, latin};
use super::super::motion::{Form, JointUnit, Reason, Scan, Setting, Slot};
use super::yaml::{Entry, Node, documents};

pub(super) fn read(source: &Source<'_>) -> Result<Scan, ProgramError> {
    let mut trajectories = Trajectories { source, findings: Findings::default(), foreign: None, is_any_known: false };
    for document in documents(source.program) {
        trajectories.visit(&document, &Names::None, 0);
    }
    let Trajectories { mut findings, foreign, is_any_known, .. } = trajectories;
    if let Some(found) = foreign.filter(|_| !is_any_known) {
        return Err(ProgramError::JointNames { found, expected: expected(source) });
    }
    findings.motions.push(None);
    findings.resolve(source)
}

fn expected(source: &Source<'_>) -> Vec<String> {
    let own = || source.robot.chain.joints().iter().map(|joint| super::super::names::ascii(&joint.name)).collect();
    source.options.joint_names.clone().unwrap_or_else(own)
}

/// Joint names that count for a part of the document.
enum Names {
    None,
    /// For each joint of the arm its place in the lists, and the number of names.
    Arm(Vec<usize>, usize),
    /// Of some joints of the arm, or of others.
    Foreign,
}

struct Trajectories<'a> {
    source: &'a Source<'a>,
    findings: Findings,
    /// Names of the first trajectory of other joints.
    foreign: Option<Vec<String>>,
    is_any_known: bool,
}

/// Deepest part of a document that is searched.
const DEEPEST: usize = 40;

impl Trajectories<'_> {
    fn visit(&mut self, node: &Node, names: &Names, depth: usize) {
        if depth > DEEPEST {
            return;
        }
        match node {
            Node::Scalar(_) => {}
            Node::List(items) => items.iter().for_each(|item| self.visit(item, names, depth + 1)),
            Node::Map(entries) => {
                let own = ["joint_names", "joints"]
                    .into_iter()
                    .find_map(|key| node.get(key).and_then(|entry| self.names(&entry.node)));
                let names = own.as_ref().unwrap_or(names);
                let is_publisher = node.get("goal_names").is_some();
                if own.is_some() {
                    self.findings.motions.push(None);
                }
                for Entry { key, node: child, .. } in entries {
                    match (key.as_str(), child) {
                        ("points", Node::List(points)) => points.iter().for_each(|point| self.point(point, names)),
                        (_, Node::Map(_)) if is_publisher && child.get("positions").is_some() => {
                            self.point(child, names);
                        }
                        _ => self.visit(child, names, depth + 1),
                    }
                }
            }
        }
    }

    /// The names of a list, matched with the arm.
    fn names(&mut self, node: &Node) -> Option<Names> {
        let items = node.list()?;
        let text = self.source.program;
        let scalars: Option<Vec<String>> = items
            .iter()
            .map(|item| item.scalar().map(|scalar| latin(text.get(scalar.place.clone()).unwrap_or_default())))
            .collect();
        let found = scalars.filter(|names| !names.is_empty())?;
        let order = self.order(&found);
        self.is_any_known |= order.is_some();
        let Some(order) = order else {
            self.foreign.get_or_insert(found);
            return Some(Names::Foreign);
        };
        Some(Names::Arm(order, found.len()))
    }

    fn order(&self, found: &[String]) -> Option<Vec<usize>> {
        let place = |is: &dyn Fn(&str) -> bool| {
            let mut places = found.iter().enumerate().filter(|(_, name)| is(name)).map(|(index, _)| index);
            // A name that is there twice is no name.
            places.next().filter(|_| places.next().is_none())
        };
        if let Some(names) = &self.source.options.joint_names {
            return names.iter().map(|expected| place(&|name| name == expected)).collect();
        }
        let joints = self.source.robot.chain.joints();
        let own: Option<Vec<usize>> = joints
            .iter()
            .map(|joint| {
                let expected = super::super::names::ascii(&joint.name);
                place(&|name| name == expected)
            })
            .collect();
        // All names of one kind: the first aliases of all joints, or the second ones.
        let aliases = self.source.robot.joint_aliases;
        let kinds = aliases.iter().map(Vec::len).max().unwrap_or(0);
        own.or_else(|| {
            (0..kinds).find_map(|kind| {
                let all: Option<Vec<usize>> = aliases
                    .iter()
                    .map(|names| {
                        let expected = names.get(kind)?;
                        place(&|name| name == expected)
                    })
                    .collect();
                all.filter(|all| all.len() == joints.len())
            })
        })
    }

    fn point(&mut self, point: &Node, names: &Names) {
        let Some(positions) = point.get("positions") else { return };
        let line = positions.line;
        let content = self.content(&positions.node, names);
        let target = self.findings.here(0, line, content);
        self.findings.motions.push(Some(Motion {
            file: 0,
            line,
            way: Way::Streamed,
            via: None,
            point: target,
            tool: Ok(Setting::Identity),
            frame: Ok(Setting::Identity),
            configuration: None,
            spot: None,
        }));
    }

    fn content(&self, positions: &Node, names: &Names) -> Result<Literal, Reason> {
        let items = positions.list().ok_or(Reason::Unreadable)?;
        let (order, count) = match names {
            Names::Arm(order, count) => (order, *count),
            Names::Foreign | Names::None => return Err(Reason::OtherJoints),
        };
        if items.len() != count {
            return Err(Reason::JointCount { found: items.len(), joints: count });
        }
        let mut slots = Vec::new();
        let mut numbers = Vec::new();
        for item in order.iter().filter_map(|place| items.get(*place)) {
            let place = item.scalar().ok_or(Reason::Unreadable)?.place.clone();
            let value = as_str(self.source.program, place.clone()).parse::<f64>().ok();
            numbers.push(value.filter(|value| value.is_finite()).ok_or(Reason::Unreadable)?);
            slots.push(Slot::at(place));
        }
        Ok(Literal { form: Form::Joints(JointUnit::Links), slots, numbers, configuration: Configuration::Free })
    }
}
