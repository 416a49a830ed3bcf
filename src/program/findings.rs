//! From definitions and moves to targets: a value is a target because a motion of the given files uses it.
//!
//! Readers note every value of a position type ([`Definition`]) and every motion instruction ([`Motion`]), in all files.
//! [`Findings::resolve`] connects them by name.

use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};

use super::configuration::Configuration;
use super::insert::Spot;
use super::motion::{
    Form, Goal, LeftAlone, Move, MoveKind, PoseTarget, ReadOptions, Reason, Scan, Setting, Slot, Target,
};
use super::rewrite::to_pendant;
use super::{ProgramError, Robot};

/// What a reader gets.
#[derive(Clone, Copy)]
pub(super) struct Source<'a> {
    pub(super) robot: &'a Robot<'a>,
    pub(super) options: &'a ReadOptions,
    pub(super) program: &'a [u8],
    /// Texts of the companions, with the line ends that the readers know.
    pub(super) companions: &'a [Cow<'a, [u8]>],
}

impl<'a> Source<'a> {
    /// The program, which is file 0, and its companions.
    pub(super) fn files(&self) -> impl Iterator<Item = (usize, &'a [u8])> + use<'a> {
        std::iter::once(self.program).chain(self.companions.iter().map(AsRef::as_ref)).enumerate()
    }
}

/// A value of a position type.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Literal {
    pub(super) form: Form,
    pub(super) slots: Vec<Slot>,
    /// The value at each slot, in the units of the form.
    pub(super) numbers: Vec<f64>,
    pub(super) configuration: Configuration,
}

/// A value that a motion may use.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Definition {
    pub(super) file: usize,
    pub(super) line: usize,
    pub(super) name: Option<String>,
    pub(super) key: Key,
    pub(super) content: Result<Literal, Reason>,
    /// Not worth a word unless a motion uses it, such as a frame.
    pub(super) is_quiet: bool,
}

/// Identity of a variable: names are compared as the language does.
#[derive(Clone, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Key {
    /// The routine that declares it; 0: the module.
    pub(super) scope: usize,
    pub(super) name: String,
    /// Index of the element, as written with constants; empty: the whole variable, or any element.
    pub(super) element: String,
}

impl Key {
    fn variable(&self) -> Self {
        Self { element: String::new(), ..self.clone() }
    }
}

/// The point that a motion goes to.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Point {
    /// Written in the instruction: index of its definition.
    Here(usize),
    Variable {
        key: Key,
        name: String,
    },
    Left {
        name: Option<String>,
        reason: Reason,
    },
    /// Where the arm already is.
    Current,
}

/// A motion instruction.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Motion {
    pub(super) file: usize,
    pub(super) line: usize,
    pub(super) way: Way,
    pub(super) via: Option<Box<Point>>,
    pub(super) point: Point,
    pub(super) tool: Result<Setting, Reason>,
    pub(super) frame: Result<Setting, Reason>,
    /// Branch, where the instruction states it and not the position.
    pub(super) configuration: Option<Configuration>,
    /// Where further points can be put in front of it.
    pub(super) spot: Option<Box<Spot>>,
}

/// Path of a motion.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Way {
    Joint,
    Linear,
    Circular,
    /// One of many points that are passed in a stream.
    Streamed,
}

/// A use of a variable that is no motion to it.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct OtherUse {
    pub(super) key: Key,
    pub(super) reason: Reason,
}

/// Everything that a reader notes.
#[derive(Default)]
pub(super) struct Findings {
    pub(super) definitions: Vec<Definition>,
    /// A `None` separates routines: no path crosses it.
    pub(super) motions: Vec<Option<Motion>>,
    pub(super) other_uses: Vec<OtherUse>,
    /// Copies: a move to the first variable is one to the value of the second.
    pub(super) copies: Vec<(Key, Key)>,
    /// Further places of the program that stay.
    pub(super) left: Vec<LeftAlone>,
    /// Tool and frame of definitions that are targets although no motion names them, such as the positions of a FANUC program:
    /// they belong to their program alone, and an instruction may compute their number.
    pub(super) always: BTreeMap<usize, [Result<Setting, Reason>; 2]>,
}

/// Tool and frame of the moves to a variable.
#[derive(Clone, Debug, Default, PartialEq)]
struct Uses {
    settings: Option<[Result<Setting, Reason>; 2]>,
    are_several: bool,
    configuration: Option<Configuration>,
    other: Option<Reason>,
}

impl Uses {
    fn add(&mut self, motion: &Motion) {
        let settings = [motion.tool.clone(), motion.frame.clone()];
        match &self.settings {
            Some(known) => self.are_several |= *known != settings,
            None => self.settings = Some(settings),
        }
        if self.configuration.is_none() {
            self.configuration.clone_from(&motion.configuration);
        }
    }

    fn merge(&mut self, other: &Self) {
        self.are_several |= other.are_several;
        match (&self.settings, &other.settings) {
            (Some(mine), Some(its)) => self.are_several |= mine != its,
            (None, its) => self.settings.clone_from(its),
            (Some(_), None) => {}
        }
        if self.configuration.is_none() {
            self.configuration.clone_from(&other.configuration);
        }
        if self.other.is_none() {
            self.other.clone_from(&other.other);
        }
    }
}

impl Findings {
    pub(super) fn leave(&mut self, line: usize, name: Option<String>, reason: Reason) {
        self.left.push(LeftAlone { line, name, reason });
    }

    /// Notes a value that is written inside a motion instruction.
    pub(super) fn here(&mut self, file: usize, line: usize, content: Result<Literal, Reason>) -> Point {
        self.definitions.push(Definition { file, line, name: None, key: Key::default(), content, is_quiet: false });
        Point::Here(self.definitions.len() - 1)
    }

    /// Connects moves and definitions.
    pub(super) fn resolve(mut self, source: &Source<'_>) -> Result<Scan, ProgramError> {
        let names = Names::new(&self.definitions, &self.copies);
        let mut uses: BTreeMap<Key, Uses> = BTreeMap::new();
        // The motion of each value that is written in one.
        let mut here: Vec<Option<usize>> = vec![None; self.definitions.len()];
        for (at, motion) in self.motions.iter().enumerate() {
            let Some(motion) = motion else { continue };
            for point in std::iter::once(&motion.point).chain(motion.via.as_deref()) {
                match point {
                    Point::Here(index) => {
                        if let Some(place) = here.get_mut(*index) {
                            *place = Some(at);
                        }
                    }
                    Point::Variable { key, .. } => uses.entry(names.scoped(key)).or_default().add(motion),
                    Point::Left { .. } | Point::Current => {}
                }
            }
        }
        for other in &self.other_uses {
            let entry = uses.entry(names.scoped(&other.key)).or_default();
            if entry.other.is_none() {
                entry.other = Some(other.reason.clone());
            }
        }
        for (copy, original) in &self.copies {
            if let Some(its) = uses.get(&names.scoped(copy)).cloned() {
                uses.entry(names.scoped(original)).or_default().merge(&its);
            }
        }
        let mut scan = Scan::default();
        let mut target_of: BTreeMap<usize, usize> = BTreeMap::new();
        let mut order: Vec<usize> = (0..self.definitions.len()).collect();
        order.sort_by_key(|index| self.definitions.get(*index).map(Definition::place));
        for index in order {
            let Some(definition) = self.definitions.get(index).filter(|definition| definition.file == 0) else {
                continue;
            };
            let mut its = Uses::default();
            let motion = here.get(index).copied().flatten().and_then(|at| self.motions.get(at)?.as_ref());
            if let Some(motion) = motion {
                its.add(motion);
            }
            for key in [definition.key.clone(), definition.key.variable()] {
                if let Some(found) = uses.get(&key).filter(|_| !key.name.is_empty()) {
                    its.merge(found);
                }
            }
            // A use of one element says nothing about the others, but a variable that is written as a whole has all of them.
            let is_passed_on = matches!(its.other, Some(Reason::PassedTo(_)));
            if definition.is_quiet && its.settings.is_none() && !is_passed_on {
                continue;
            }
            match target(definition, &its, self.always.get(&index), source)? {
                Ok(target) => {
                    target_of.insert(index, scan.targets.len());
                    scan.targets.push(target);
                }
                Err(reason) => {
                    self.left.push(LeftAlone { line: definition.line, name: definition.name.clone(), reason });
                }
            }
        }
        self.moves(source, &names, &target_of, &mut scan);
        scan.left = self.left;
        scan.left.sort();
        scan.left.dedup();
        Ok(scan)
    }

    fn moves(&mut self, source: &Source<'_>, names: &Names, target_of: &BTreeMap<usize, usize>, scan: &mut Scan) {
        let mut path = 0;
        let mut is_new = true;
        for motion in std::mem::take(&mut self.motions) {
            let Some(motion) = motion else {
                is_new = true;
                continue;
            };
            let mut index_of = |point: &Point| match point {
                Point::Here(index) => target_of.get(index).copied(),
                Point::Variable { key, name } => {
                    let found = names.definition(key, &motion, &self.definitions);
                    let file = found.and_then(|index| self.definitions.get(index)).map(|definition| definition.file);
                    let reason = match file {
                        Some(0) => None,
                        Some(file) => {
                            let companion = source.options.companions.get(file - 1);
                            Some(Reason::InFile(companion.map_or_else(String::new, |file| file.name.clone())))
                        }
                        None => Some(Reason::Elsewhere),
                    };
                    if let Some(reason) = reason.filter(|_| motion.file == 0) {
                        self.left.push(LeftAlone { line: motion.line, name: Some(name.clone()), reason });
                    }
                    found.and_then(|index| target_of.get(&index).copied())
                }
                Point::Left { name, reason } => {
                    if motion.file == 0 {
                        let (name, reason) = (name.clone(), reason.clone());
                        self.left.push(LeftAlone { line: motion.line, name, reason });
                    }
                    None
                }
                Point::Current => None,
            };
            let via = motion.via.as_deref().and_then(&mut index_of);
            let target = index_of(&motion.point);
            if motion.point == Point::Current {
                continue;
            }
            let kind = match motion.way {
                Way::Joint | Way::Streamed => MoveKind::Joint,
                Way::Linear => MoveKind::Linear,
                Way::Circular => MoveKind::Circular { via },
            };
            let is_first = std::mem::take(&mut is_new);
            path += usize::from(is_first || motion.way == Way::Joint);
            let companion = motion.file.checked_sub(1);
            scan.moves.push(Move { line: motion.line, companion, kind, target, path, is_first, spot: motion.spot });
        }
    }
}

impl Definition {
    /// Place in the order of the text.
    fn place(&self) -> (usize, usize, usize) {
        let start =
            self.content.as_ref().ok().and_then(|literal| literal.slots.first()).map_or(0, |slot| slot.place.start);
        (self.file, self.line, start)
    }
}

/// Definitions by name.
struct Names {
    by_key: BTreeMap<Key, Vec<usize>>,
    /// Variables with their scope.
    variables: BTreeSet<(usize, String)>,
    /// The original of each copy.
    originals: BTreeMap<Key, Key>,
}

impl Names {
    fn new(definitions: &[Definition], copies: &[(Key, Key)]) -> Self {
        let mut by_key: BTreeMap<Key, Vec<usize>> = BTreeMap::new();
        let mut variables = BTreeSet::new();
        for (index, definition) in definitions.iter().enumerate() {
            let key = &definition.key;
            if key.name.is_empty() {
                continue;
            }
            variables.insert((key.scope, key.name.clone()));
            by_key.entry(key.clone()).or_default().push(index);
            if !key.element.is_empty() {
                by_key.entry(key.variable()).or_default().push(index);
            }
        }
        let mut names = Self { by_key, variables, originals: BTreeMap::new() };
        names.originals = copies.iter().map(|(copy, original)| (names.scoped(copy), original.clone())).collect();
        names
    }

    /// The key with the scope in which the variable is declared.
    fn scoped(&self, key: &Key) -> Key {
        let is_local = self.variables.contains(&(key.scope, key.name.clone()));
        Key { scope: if is_local { key.scope } else { 0 }, ..key.clone() }
    }

    /// The definition that a move most likely uses: the last one before it in its file, or else the first one.
    fn definition(&self, key: &Key, motion: &Motion, definitions: &[Definition]) -> Option<usize> {
        let key = self.scoped(key);
        let found = self.by_key.get(&key).or_else(|| self.by_key.get(&key.variable())).or_else(|| {
            let original = self.originals.get(&key)?;
            self.by_key.get(&self.scoped(original))
        })?;
        let is_behind = |index: &usize| {
            definitions
                .get(*index)
                .is_none_or(|definition| (definition.file, definition.line) > (motion.file, motion.line))
        };
        let split = found.partition_point(|index| !is_behind(index));
        let before = split.checked_sub(1).and_then(|last| found.get(last)).copied();
        let is_here = |index: &usize| definitions.get(*index).is_some_and(|definition| definition.file == motion.file);
        match before.filter(is_here) {
            // Any element of an array stands for the array: its first.
            Some(index) if key.element.is_empty() => {
                let is_element = definitions.get(index).is_some_and(|found| !found.key.element.is_empty());
                if is_element { found.first().copied() } else { Some(index) }
            }
            Some(index) => Some(index),
            None => found.first().copied(),
        }
    }
}

/// The target of a definition, or why it stays.
fn target(
    definition: &Definition,
    uses: &Uses,
    always: Option<&[Result<Setting, Reason>; 2]>,
    source: &Source<'_>,
) -> Result<Result<Target, Reason>, ProgramError> {
    let [tool, frame] = match (&uses.settings, always.filter(|_| uses.other.is_none())) {
        (Some(settings), _) | (None, Some(settings)) => settings.clone(),
        (None, None) => return Ok(Err(uses.other.clone().unwrap_or(Reason::NotMovedTo))),
    };
    let literal = match &definition.content {
        Ok(literal) => literal,
        Err(reason) => return Ok(Err(reason.clone())),
    };
    let goal = match literal.form {
        Form::Joints(unit) => {
            let joints = source.robot.chain.dof();
            if literal.numbers.len() != joints {
                return Ok(Err(Reason::JointCount { found: literal.numbers.len(), joints }));
            }
            if literal.numbers.iter().any(|value| value.abs() >= LARGEST) {
                return Ok(Err(Reason::Unreadable));
            }
            Goal::Joints(to_pendant(unit, source.robot, &literal.numbers)?)
        }
        Form::Pose(orientation) => {
            if uses.are_several {
                return Ok(Err(Reason::SeveralSettings));
            }
            let is_sensible = literal.numbers.iter().all(|value| value.abs() < LARGEST);
            let Some(frame_from_tool) = orientation.pose(&literal.numbers).filter(|_| is_sensible) else {
                return Ok(Err(Reason::Unreadable));
            };
            match (tool, frame) {
                (Ok(tool), Ok(frame)) => {
                    let stated = uses.configuration.clone().filter(|_| literal.configuration == Configuration::Free);
                    let configuration = stated.unwrap_or_else(|| literal.configuration.clone());
                    Goal::Pose(PoseTarget { frame_from_tool, configuration, tool, frame })
                }
                (Err(reason), _) | (_, Err(reason)) => return Ok(Err(reason)),
            }
        }
    };
    let (line, name) = (definition.line, definition.name.clone());
    Ok(Ok(Target { line, name, goal, slots: literal.slots.clone(), form: literal.form }))
}

/// A value from this size on means "not used" in several languages (9E9), or is nonsense. Pulses and mm stay far below.
const LARGEST: f64 = 1e8;
