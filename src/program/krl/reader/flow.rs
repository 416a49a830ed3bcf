//! Where tool and base depend on how a program runs: branches, loops and the routines that it calls.

use std::collections::{BTreeMap, BTreeSet};

use super::super::super::findings::Findings;
use super::super::super::lexer::Kind;
use super::{ANY_BASE, ANY_TOOL, Frame, Line, Module, Variable, behind_words};

/// A branch or loop, with tool and base as they were in front of it.
pub(super) struct Block {
    /// File and first token of a loop; `None`: a branch.
    start: Option<(usize, usize)>,
    pub(super) tool: Option<Frame>,
    pub(super) base: Option<Frame>,
    /// Whether it sets tool and base to something else.
    pub(super) differs: [bool; 2],
}

/// What a routine does to tool and base, and the routines that it calls.
#[derive(Default)]
pub(super) struct Routine {
    pub(super) sets: [bool; 2],
    calls: BTreeSet<String>,
}

impl<'a> Module<'a> {
    /// Follows the words that begin, divide and end branches and loops.
    pub(super) fn block(&mut self, line: &Line<'_, 'a>, word: &str) {
        match word {
            "IF" | "SWITCH" | "FOR" | "WHILE" | "LOOP" | "REPEAT" => {
                let is_loop = !matches!(word, "IF" | "SWITCH");
                let start = is_loop.then_some((line.file, line.range.start));
                self.enter_loop(start);
                let (tool, base) = (self.state.tool.clone(), self.state.base.clone());
                self.blocks.push(Block { start, tool, base, differs: [false; 2] });
            }
            // The next branch begins as the one before it did.
            "ELSE" | "CASE" | "DEFAULT" => {
                if let Some(block) = self.blocks.last() {
                    self.state.tool.clone_from(&block.tool);
                    self.state.base.clone_from(&block.base);
                }
            }
            "ENDIF" | "ENDSWITCH" | "ENDFOR" | "ENDWHILE" | "ENDLOOP" | "UNTIL" => {
                let Some(block) = self.blocks.pop() else { return };
                let [tool, base] = block.differs;
                if let Some(start) = block.start.filter(|_| tool || base) {
                    self.loop_ends.insert(start, [self.state.tool.clone(), self.state.base.clone()]);
                }
                // Also the block around this one may now end with something else.
                if tool {
                    self.set_tool(Frame::Unknown);
                }
                if base {
                    self.set_base(Frame::Unknown);
                }
            }
            _ => {}
        }
    }

    /// Drops the frames whose value depends on how the program runs.
    pub(super) fn forget(&mut self) {
        let all_tools = self.changing.contains(ANY_TOOL);
        let all_bases = self.changing.contains(ANY_BASE);
        self.frames.retain(|name, _| {
            let is_numbered = all_tools && name.starts_with(ANY_TOOL) || all_bases && name.starts_with(ANY_BASE);
            !is_numbered && !self.changing.contains(name)
        });
    }

    /// Notes a frame whose value changes: `TOOL_DATA[1].X=…`, a second value, one that is computed, or one that a routine gets.
    pub(super) fn note_change(&mut self, line: &Line<'_, 'a>, first: usize) {
        let tokens = line.tokens;
        let mut change = |variable: &Variable| {
            let name = variable.name.to_lowercase();
            let is_constant = !variable.key.element.is_empty();
            let all = [ANY_TOOL, ANY_BASE].into_iter().find(|all| name.starts_with(all) && !is_constant);
            self.changing.insert(all.map_or(name, str::to_owned));
        };
        let Some(variable) = Variable::read(line, first) else { return };
        let assign = match tokens.get(variable.end).map(|token| token.kind) {
            Some(Kind::Symbol(b'=')) => Some(variable.end),
            Some(Kind::Symbol(b'.')) if tokens.is(variable.end + 2, b'=') => {
                change(&variable);
                None
            }
            _ => None,
        };
        if assign.is_some() && !tokens.is(variable.end + 1, b'{') {
            change(&variable);
        }
        // The parameters of a routine are its caller's variables.
        let is_harmless = ["BAS", "INV_POS"].iter().any(|word| tokens.is_word(first, word));
        if assign.is_none() && tokens.is(first + 1, b'(') && !is_harmless {
            line.range
                .clone()
                .skip_while(|at| *at <= first)
                .filter_map(|at| Variable::read(line, at))
                .for_each(|variable| change(&variable));
        }
    }

    pub(super) fn use_frame_data(&mut self, name: Option<&str>) {
        let data = name.and_then(|name| self.frame_data.get(name)).cloned();
        let shown = name.unwrap_or_default().to_uppercase();
        let data = data.unwrap_or_default();
        self.set_tool(data.tool.map_or_else(|| Frame::Variable(format!("{shown}.TOOL_NO")), Frame::Number));
        self.set_base(data.base.map_or_else(|| Frame::Variable(format!("{shown}.BASE_NO")), Frame::Number));
        self.state.is_stationary = data.is_stationary;
    }

    /// A routine that sets no tool or base gets that of its file, if there is only one.
    pub(super) fn inherit(&self, findings: &mut Findings) {
        for (range, [tool, base]) in &self.heirs {
            for motion in findings.motions.get_mut(range.clone()).into_iter().flatten().flatten() {
                if *tool && self.set.tool.is_some() && motion.tool.is_ok() {
                    motion.tool = Ok(self.setting(self.set.tool.as_ref(), "TOOL"));
                }
                if *base && self.set.base.is_some() && motion.frame.is_ok() {
                    motion.frame = Ok(self.setting(self.set.base.as_ref(), "BASE"));
                }
            }
        }
    }

    /// A loop that ends with another tool or base than it begins with: which one holds at its beginning is unknown.
    fn enter_loop(&mut self, start: Option<(usize, usize)>) {
        let Some([tool, base]) = start.and_then(|start| self.loop_ends.get(&start)).cloned() else { return };
        if tool != self.state.tool {
            self.set_tool(Frame::Unknown);
        }
        if base != self.state.base {
            self.set_base(Frame::Unknown);
        }
    }

    /// Notes what a line of a routine sets and calls.
    pub(super) fn note_routine(&mut self, line: &Line<'_, 'a>) {
        let tokens = line.tokens;
        if line.scope == 0 {
            return;
        }
        let start = behind_words(tokens, line.range.start, &["GLOBAL"]);
        if tokens.is_word(start, "DEF") || tokens.is_word(start, "DEFFCT") {
            let place = line.range.clone().find(|at| tokens.is(*at + 1, b'('));
            self.declared = place.and_then(|at| tokens.name(at)).unwrap_or_default().to_lowercase();
        }
        let (calls, sets) = (called(line), assigned(line, start));
        let routine = self.routines.entry(self.declared.clone()).or_default();
        routine.calls.extend(calls);
        for (known, new) in routine.sets.iter_mut().zip(sets) {
            *known |= new;
        }
    }

    /// A routine also sets what the routines set that it calls.
    pub(super) fn follow_calls(&mut self) {
        let mut callers: BTreeMap<&String, Vec<&String>> = BTreeMap::new();
        for (name, routine) in &self.routines {
            for call in &routine.calls {
                callers.entry(call).or_default().push(name);
            }
        }
        let mut setters: [BTreeSet<String>; 2] = [BTreeSet::new(), BTreeSet::new()];
        for (what, found) in setters.iter_mut().enumerate() {
            let sets = |(name, routine): (&'_ String, &'_ Routine)| routine.sets[what].then(|| name.clone());
            let mut open: Vec<String> = self.routines.iter().filter_map(sets).collect();
            while let Some(name) = open.pop() {
                open.extend(
                    callers
                        .get(&name)
                        .into_iter()
                        .flatten()
                        .filter(|caller| !found.contains(**caller))
                        .map(|caller| (*caller).clone()),
                );
                found.insert(name);
            }
        }
        for (name, routine) in &mut self.routines {
            routine.sets = [0, 1].map(|what: usize| setters[what].contains(name));
        }
    }
}

/// Lower-case names in front of brackets: calls, except those of `BAS`, whose effect is known.
pub(super) fn called(line: &Line<'_, '_>) -> Vec<String> {
    let tokens = line.tokens;
    let start = behind_words(tokens, line.range.start, &["GLOBAL"]);
    if ["DEF", "DEFFCT", "EXT", "EXTFCT"].iter().any(|word| tokens.is_word(start, word)) {
        return Vec::new();
    }
    let is_call = |at: &usize| tokens.is(*at + 1, b'(') && !tokens.is_word(*at, "BAS");
    let names = line.range.clone().filter(is_call).filter_map(|at| tokens.name(at));
    names.map(|name| name.to_lowercase()).collect()
}

/// Whether a line sets tool and base.
fn assigned(line: &Line<'_, '_>, start: usize) -> [bool; 2] {
    let tokens = line.tokens;
    let is_form = tokens.is_word(start, "FDAT_ACT") && tokens.is(start + 1, b'=');
    [("$TOOL", "#TOOL"), ("$BASE", "#BASE")].map(|(variable, mode)| {
        let is_set = tokens.is_word(start, variable) && (tokens.is(start + 1, b'=') || tokens.is(start + 1, b'.'));
        is_form || is_set || tokens.is_word(start, "BAS") && tokens.is_word(start + 2, mode)
    })
}
