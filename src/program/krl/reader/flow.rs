//! Where tool and base depend on how a program runs: branches, loops and the routines that it calls.

use std::collections::{BTreeMap, BTreeSet};

use super::{Frame, Line, Module, behind_words};

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
        loop {
            let mut is_changed = false;
            let known: BTreeMap<String, [bool; 2]> =
                self.routines.iter().map(|(name, routine)| (name.clone(), routine.sets)).collect();
            for routine in self.routines.values_mut() {
                for sets in routine.calls.iter().filter_map(|call| known.get(call)) {
                    for (mine, its) in routine.sets.iter_mut().zip(sets) {
                        is_changed |= *its && !*mine;
                        *mine |= *its;
                    }
                }
            }
            if !is_changed {
                return;
            }
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
