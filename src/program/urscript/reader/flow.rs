//! Functions, conditions and loops of URScript: which tool is active, and what is known of the joints, where they begin and end.

use std::ops::Range;

use super::super::super::findings::Findings;
use super::super::super::lexer::Tokens;
use super::super::super::motion::{Reason, Setting};
use super::{Reader, TCP, without_keyword};

/// Functions of the controller that leave the arm and its tool as they are, and words that a parenthesis may follow.
#[rustfmt::skip]
const HARMLESS: [&str; 56] = [
    "and", "or", "not", "xor", "return", "set_digital_out", "set_standard_digital_out", "set_configurable_digital_out",
    "set_tool_digital_out", "set_analog_out", "set_standard_analog_out", "set_tool_voltage", "set_payload", "set_payload_mass",
    "set_payload_cog", "set_target_payload", "set_gravity", "get_digital_in", "get_standard_digital_in",
    "get_configurable_digital_in", "get_tool_digital_in", "get_standard_analog_in", "get_analog_in", "get_digital_out",
    "get_standard_digital_out", "get_actual_tcp_pose", "get_actual_joint_positions", "get_target_tcp_pose",
    "get_target_joint_positions", "get_forward_kin", "get_inverse_kin", "get_tcp_force", "force", "get_tcp_offset", "sleep",
    "sync", "textmsg", "popup", "pose_trans", "pose_add", "pose_sub", "pose_inv", "pose_dist", "interpolate_pose", "d2r", "r2d",
    "norm", "length", "floor", "sqrt", "to_str", "str_cat", "stopj", "stopl", "socket_send_string",
    "socket_open",
];

/// Functions of the controller whose poses and lists are no targets: forces, speeds, limits and settings.
const WITHOUT_TARGETS: [&str; 16] = [
    "force_mode",
    "speedj",
    "speedl",
    "end_force_mode",
    "force_mode_set_damping",
    "force_mode_set_gain_scaling",
    "get_inverse_kin_has_solution",
    "set_joint_limits",
    "direct_torque",
    "get_jacobian",
    "position_deviation_warning",
    "set_tcp",
    "set_conveyor_tick_count",
    "track_conveyor_circular",
    "wrench_trans",
    "print",
];

/// Whether the controller has a function of this name that moves to no position.
pub(super) fn is_of_controller(name: &str) -> bool {
    HARMLESS.contains(&name)
        || WITHOUT_TARGETS.contains(&name)
        || matches!(name, "if" | "while" | "elif" | "def" | "thread")
}

/// Whether a function or thread begins here.
pub(super) fn is_routine(tokens: &Tokens<'_>, at: usize) -> bool {
    matches!(tokens.word(at), Some("def" | "sec" | "thread"))
        && tokens.word(at + 1).is_some()
        && tokens.is(at + 2, b'(')
}

/// Whether a condition or loop begins here.
pub(super) fn is_block(tokens: &Tokens<'_>, at: usize) -> bool {
    matches!(tokens.word(at), Some("if" | "while" | "for")) && !tokens.is(at + 1, b'=')
}

/// An open `def`, `if` or `while`, with what was known where it began.
#[expect(clippy::struct_excessive_bools, reason = "independent facts about the moves of a program")]
pub(super) struct Block {
    is_routine: bool,
    routine: usize,
    has_moved: bool,
    tool: Option<Result<Setting, Reason>>,
    before: Option<Vec<f64>>,
    /// A branch has set the tool.
    sets_tool: bool,
    /// A branch has changed the joints of the move before.
    has_other_joints: bool,
}

impl Reader<'_, '_> {
    pub(super) fn open(&mut self, at: usize, is_routine: bool) {
        self.blocks.push(Block {
            is_routine,
            routine: self.routine,
            has_moved: self.has_moved,
            tool: self.tool.clone(),
            before: self.before.clone(),
            sets_tool: false,
            has_other_joints: false,
        });
        if is_routine {
            // It may be called from anywhere.
            self.routine = at + 1;
            self.has_moved = false;
            self.tool = None;
            self.before = None;
        } else if self.tokens.word(at) != Some("if") && self.loop_sets_tool(at) {
            // The second pass begins with the tool of the end of the first.
            self.tool = Some(Err(Reason::SeveralSettings));
        }
    }

    /// Whether a loop sets the tool, or calls a routine that may.
    fn loop_sets_tool(&self, at: usize) -> bool {
        let tokens = self.tokens;
        if self.script.setters.is_empty() || matches!(self.tool, Some(Err(_))) {
            return false;
        }
        let is_set_elsewhere = self.script.is_set_elsewhere((self.file, self.routine));
        let mut depth = 0_usize;
        for place in at..tokens.len() {
            if is_routine(tokens, place) || is_block(tokens, place) {
                depth += 1;
            } else if tokens.word(place) == Some("end") {
                depth = depth.saturating_sub(1);
                if depth == 0 {
                    return false;
                }
            } else if tokens.is(place + 1, b'(') {
                let name = tokens.str(place);
                if name == "set_tcp" || is_set_elsewhere && self.script.routines.contains(name) {
                    return true;
                }
            }
        }
        false
    }

    /// `elif` and `else` begin with what was known in front of the `if`.
    pub(super) fn branch(&mut self) {
        let Some(block) = self.blocks.last_mut().filter(|block| !block.is_routine) else { return };
        block.has_other_joints |= self.before != block.before;
        self.before.clone_from(&block.before);
        self.tool.clone_from(&block.tool);
    }

    pub(super) fn close(&mut self) {
        let Some(block) = self.blocks.pop() else { return };
        if block.is_routine {
            self.routine = block.routine;
            self.has_moved = block.has_moved;
            self.tool = block.tool;
            self.before = block.before;
            return;
        }
        // Which branch ran is unknown.
        if block.has_other_joints || self.before != block.before {
            self.before = None;
        }
        if block.sets_tool {
            self.tool = Some(Err(Reason::SeveralSettings));
        }
    }

    /// `set_tcp(…)`.
    pub(super) fn set_tool(&mut self, inside: Range<usize>) {
        let tokens = self.tokens;
        let parts = tokens.split(inside);
        let argument = parts.first().map(|part| self.argument(without_keyword(tokens, part.clone())));
        let tool =
            argument.map_or_else(|| Setting::Named(TCP.to_owned()), |argument| self.setting(argument.range, "set_tcp"));
        if !self.tools.contains(&tool) && self.tools.len() < 2 {
            self.tools.push(tool.clone());
        }
        self.is_set_late |= self.has_moved;
        for block in self.blocks.iter_mut().rev().take_while(|block| !block.is_routine) {
            block.sets_tool = true;
            self.is_unclear = true;
        }
        self.tool = Some(Ok(tool));
    }

    /// A call of something that is no motion instruction: it may move the arm and set the tool.
    pub(super) fn other_call(&mut self, name: &str) {
        let is_routine = self.script.routines.contains(name);
        if !is_routine && HARMLESS.contains(&name) {
            return;
        }
        self.before = None;
        if is_routine && self.script.is_set_elsewhere((self.file, self.routine)) {
            if self.tool.is_some() {
                self.tool = Some(Err(Reason::SeveralSettings));
            }
            // A loop or condition around the call: it may run never, or between moves.
            let is_in_block = self.blocks.last().is_some_and(|block| !block.is_routine);
            self.is_unclear |= is_in_block || self.has_moved;
            for block in self.blocks.iter_mut().rev().take_while(|block| !block.is_routine) {
                block.sets_tool = true;
            }
        }
    }

    /// Tools of the motions whose routine sets none before.
    pub(super) fn complete_tools(&self, findings: &mut Findings) {
        let Some(setter) = self.script.setters.first() else { return };
        let is_unclear = self.is_unclear || self.script.setters.len() > 1;
        for (index, routine) in &self.unset {
            let Some(Some(motion)) = findings.motions.get_mut(*index) else { continue };
            match self.tools.as_slice() {
                _ if is_unclear => motion.tool = Err(Reason::SeveralSettings),
                // A function that sets no tool is called after the only `set_tcp` of the file.
                [tool] if !self.is_set_late => motion.tool = Ok(tool.clone()),
                _ if *setter != (self.file, *routine) => motion.tool = Err(Reason::SeveralSettings),
                _ => {}
            }
        }
    }
}
