//! The statements of a RAPID module, without the keywords that enclose them.

use std::ops::Range;

use super::super::findings::Key;
use super::super::lexer::{Kind, Tokens};
use super::instruction::{Instruction, behind_label, displaces};

/// More routines than a file can have: their numbers differ between files.
const ROUTINES: usize = 1 << 24;

/// One instruction or declaration, without the block keywords in front of it.
pub(super) struct Statement<'t, 'a> {
    pub(super) tokens: &'t Tokens<'a>,
    pub(super) file: usize,
    /// The routine; 0: the module.
    pub(super) scope: usize,
    pub(super) range: Range<usize>,
    pub(super) kind: StatementKind,
    /// The instruction of an `IF` without `THEN`.
    pub(super) is_conditional: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum StatementKind {
    /// The header of a routine, with its parameters.
    Routine,
    LoopStart,
    LoopEnd,
    /// An instruction or a declaration.
    Plain,
}

impl Statement<'_, '_> {
    /// Identity of its place in all files.
    pub(super) fn place(&self) -> (usize, usize) {
        (self.file, self.range.start)
    }

    pub(super) fn line(&self) -> usize {
        self.tokens.line(self.range.start)
    }

    pub(super) fn key(&self, at: usize) -> Option<Key> {
        let name = self.tokens.name(at)?.to_lowercase();
        Some(Key { scope: self.scope, name, element: String::new() })
    }
}

/// Keywords that stand alone in front of an instruction.
const BLOCKS: &[&str] = &[
    "endproc",
    "endmodule",
    "endif",
    "endfor",
    "endwhile",
    "endtest",
    "else",
    "endfunc",
    "endtrap",
    "default",
    "undo",
    "error",
    "backward",
    "endrecord",
    "local",
    "task",
];

/// Calls `work` with every instruction, declaration and routine header.
pub(super) fn each_statement<'a>(tokens: &Tokens<'a>, file: usize, mut work: impl FnMut(&Statement<'_, 'a>)) {
    let mut at = 0;
    let mut scope = 0;
    let mut is_behind_if = false;
    // Routines have the same numbers in every pass.
    let mut scopes = file.saturating_mul(ROUTINES);
    while at < tokens.len() {
        at = tokens.skip_line_ends(at);
        if let Some(behind) = behind_label(tokens, at) {
            at = behind;
            continue;
        }
        let Some(word) = tokens.word(at).map(str::to_ascii_lowercase) else {
            at += 1;
            continue;
        };
        let is_conditional = std::mem::take(&mut is_behind_if);
        match word.as_str() {
            "module" | "test" => at = end_of_line(tokens, at),
            "record" => {
                while at < tokens.len() && !tokens.is_word(at, "endrecord") {
                    at += 1;
                }
            }
            "proc" | "func" | "trap" => {
                let end = (at..tokens.len())
                    .find(|place| tokens.is(*place, b'(') || line_ends(tokens, *place))
                    .unwrap_or(tokens.len());
                let end = if tokens.is(end, b'(') { tokens.behind(end, tokens.len()) } else { end };
                scopes += 1;
                scope = scopes;
                work(&Statement { tokens, file, scope, range: at..end, kind: StatementKind::Routine, is_conditional });
                at = end;
            }
            "if" | "elseif" | "while" | "for" => {
                if matches!(word.as_str(), "while" | "for") {
                    let kind = StatementKind::LoopStart;
                    work(&Statement { tokens, file, scope, range: at..at + 1, kind, is_conditional });
                }
                at = behind_condition(tokens, at);
                is_behind_if = !tokens.is_word(at - 1, "THEN") && !tokens.is_word(at - 1, "DO");
            }
            "case" => {
                let colon = (at..tokens.len()).find(|place| tokens.is(*place, b':') || line_ends(tokens, *place));
                at = colon.unwrap_or(tokens.len()) + 1;
            }
            _ if BLOCKS.contains(&word.as_str()) => {
                if matches!(word.as_str(), "endproc" | "endfunc" | "endtrap") {
                    scope = 0;
                } else if matches!(word.as_str(), "endwhile" | "endfor") {
                    let kind = StatementKind::LoopEnd;
                    work(&Statement { tokens, file, scope, range: at..at + 1, kind, is_conditional });
                }
                at += 1;
            }
            _ => {
                let end = (at..tokens.len()).find(|place| tokens.is(*place, b';')).unwrap_or(tokens.len());
                work(&Statement { tokens, file, scope, range: at..end, kind: StatementKind::Plain, is_conditional });
                at = end + 1;
            }
        }
    }
}

pub(super) fn line_ends(tokens: &Tokens<'_>, at: usize) -> bool {
    tokens.get(at).is_none_or(|token| token.kind == Kind::LineEnd)
}

fn end_of_line(tokens: &Tokens<'_>, at: usize) -> usize {
    (at..tokens.len()).find(|place| line_ends(tokens, *place)).unwrap_or(tokens.len())
}

/// The place behind `IF … THEN`, `WHILE … DO` and `FOR … DO`, or behind the condition of an `IF` with one instruction.
fn behind_condition(tokens: &Tokens<'_>, start: usize) -> usize {
    let mut depth = 0_usize;
    for at in start + 1..tokens.len() {
        let Some(token) = tokens.get(at) else { break };
        match token.kind {
            Kind::Symbol(b'(' | b'[') => depth += 1,
            Kind::Symbol(b')' | b']') => depth = depth.saturating_sub(1),
            Kind::Symbol(b';') => return at + 1,
            Kind::Word if tokens.is_word(at, "THEN") || tokens.is_word(at, "DO") => return at + 1,
            Kind::Word if depth == 0 => {
                let word = tokens.str(at).to_ascii_lowercase();
                let is_behind_operand = tokens
                    .get(at - 1)
                    .is_some_and(|before| matches!(before.kind, Kind::Word | Kind::Number | Kind::Symbol(b')' | b'}')));
                let is_argument = tokens.is(at + 1, b':') || tokens.is(at + 1, b'(');
                if at > start + 1
                    && is_behind_operand
                    && !is_argument
                    && (Instruction::named(&word).is_some() || displaces(&word))
                {
                    return at;
                }
            }
            _ => {}
        }
    }
    tokens.len()
}
