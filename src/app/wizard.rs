//! `trupose`, `trupose wizard` and `trupose resume DIR`: the wizard in a terminal.

use std::io::{IsTerminal as _, Write, stdin, stdout};
use std::path::Path;

use super::{Console, script};
use crate::cli::{ColorArg, TerminalArgs, TerminalEnvironment};
use crate::error::{ExitStatus, Failure};
use crate::runtime::{Clock, Engine, Options};
use crate::tui;
use crate::tui::glyphs::Glyphs;
use crate::tui::theme::Theme;
use crate::wizard::Intent;

/// Begins a calibration, with a profile if one is given.
pub(super) fn run<O: Write, E: Write>(
    profile: Option<&str>,
    sessions: &Path,
    args: TerminalArgs,
    console: &mut Console<O, E>,
) -> Result<ExitStatus, Failure> {
    let terminal = terminal(args)?;
    let mut engine =
        Engine::new(options(sessions)).map_err(|error| Failure::from_error(ExitStatus::Internal, &error))?;
    if let Some(profile) = profile {
        engine.intend(Intent::ChooseProfile(profile.to_owned()));
    }
    play(engine, terminal, console)
}

/// Goes on with a session.
pub(super) fn resume<O: Write, E: Write>(
    folder: &Path,
    sessions: &Path,
    args: TerminalArgs,
    console: &mut Console<O, E>,
) -> Result<ExitStatus, Failure> {
    let terminal = terminal(args)?;
    let engine = script::open(folder, options(sessions))?;
    play(engine, terminal, console)
}

fn options(sessions: &Path) -> Options {
    Options { sessions: sessions.to_owned(), clock: Clock::System }
}

/// How the terminal is used, if there is one that will do.
fn terminal(args: TerminalArgs) -> Result<tui::Options, Failure> {
    let refused = |message: &str| {
        Err(Failure::new(ExitStatus::Usage, message)
            .hint("without one, run a script: 'trupose --script FILE', or 'trupose demo'")
            .hint("single commands need none either: see 'trupose --help'"))
    };
    if !stdout().is_terminal() || !stdin().is_terminal() {
        return refused("the guided calibration needs a terminal");
    }
    let environment = TerminalEnvironment::read();
    if environment.term.as_deref().is_none_or(|term| term == "dumb") {
        return refused("the guided calibration needs a terminal that can move its cursor; TERM says it cannot");
    }
    Ok(tui_options(args, &environment))
}

fn tui_options(args: TerminalArgs, environment: &TerminalEnvironment) -> tui::Options {
    let has_colour = match args.color {
        ColorArg::Auto => !environment.no_color,
        ColorArg::Always => true,
        ColorArg::Never => false,
    };
    let glyphs = match () {
        () if args.ascii || !environment.is_utf8 => Glyphs::Ascii,
        () if args.blocks => Glyphs::Blocks,
        () => Glyphs::Unicode,
    };
    let theme = Theme { has_colour, glyphs };
    tui::Options { theme, has_mouse: args.mouse, forces_colour: args.color == ColorArg::Always }
}

fn play<O: Write, E: Write>(
    engine: Engine,
    terminal: tui::Options,
    console: &mut Console<O, E>,
) -> Result<ExitStatus, Failure> {
    let exit = tui::run(engine, terminal)
        .map_err(|error| Failure::new(ExitStatus::Internal, format!("the terminal cannot be used: {error}")))?;
    for remark in &exit.remarks {
        console.remark(remark);
    }
    let saved = exit.folder.map(|folder| format!("the session is saved; go on with 'trupose resume {folder}'"));
    match exit.signal {
        None => {
            if let Some(saved) = saved {
                console.remark(&saved);
            }
            Ok(ExitStatus::Accepted)
        }
        Some(signal) => {
            let failure = Failure::new(ExitStatus::Signal(signal), exit.cause);
            Err(saved.into_iter().fold(failure, Failure::hint))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colour_and_characters_are_decided_once() {
        let utf8 = TerminalEnvironment { is_utf8: true, ..TerminalEnvironment::default() };
        let plain = TerminalEnvironment { no_color: true, ..TerminalEnvironment::default() };
        let theme = |args, environment| tui_options(args, environment).theme;
        let usual = TerminalArgs::default();
        assert_eq!(theme(usual, &utf8), Theme { has_colour: true, glyphs: Glyphs::Unicode });
        assert_eq!(theme(usual, &plain), Theme { has_colour: false, glyphs: Glyphs::Ascii });
        let always = TerminalArgs { color: ColorArg::Always, blocks: true, ..usual };
        assert_eq!(theme(always, &plain), Theme { has_colour: true, glyphs: Glyphs::Ascii });
        assert_eq!(theme(always, &utf8).glyphs, Glyphs::Blocks);
        assert!(tui_options(always, &plain).forces_colour);
    }
}
