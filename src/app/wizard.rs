//! `trupose`, `trupose wizard` and `trupose resume DIR`: the wizard in a terminal.

use std::io::{IsTerminal as _, Write, stdin, stdout};
use std::path::Path;

use super::watch::Tour;
use super::{Console, refused, script};
use crate::cli::{ColorArg, ScriptArgs, TerminalArgs, TerminalEnvironment};
use crate::error::{ExitStatus, Failure};
use crate::runtime::{Clock, CompletedIntent, Engine};
use crate::script::{Script, ScriptStep};
use crate::store;
use crate::tui;
use crate::tui::glyphs::Glyphs;
use crate::tui::theme::Theme;
use crate::wizard::Intent;

/// Starts a calibration, with a profile if one is given.
pub(super) fn run<O: Write, E: Write>(
    profile: Option<&str>,
    args: &ScriptArgs,
    terminal: TerminalArgs,
    console: &mut Console<O, E>,
) -> Result<ExitStatus, Failure> {
    let surface = surface(terminal)?;
    let mut engine =
        Engine::new(script::live_options(Clock::System, args, console)?).map_err(|error| refused(&error))?;
    match profile {
        Some(profile) => {
            engine.intend(Intent::ChooseProfile(profile.to_owned()));
            engine.offer_links(args.sessions.clone());
        }
        None => engine.offer_sessions(args.sessions.clone()),
    }
    match play(engine, surface, args.record_script.as_deref(), console)? {
        Ended::Done(status) => Ok(status),
        Ended::Continues(folder) => resume(Some(Path::new(&folder)), args, terminal, console),
    }
}

/// Drives the screens as a script says, until a key is pressed.
pub(super) fn watch<O: Write, E: Write>(
    script: Script,
    args: &ScriptArgs,
    terminal: TerminalArgs,
    console: &mut Console<O, E>,
) -> Result<ExitStatus, Failure> {
    let options = screen(terminal, &TerminalEnvironment::read())?;
    let engine = Engine::new(script::live_options(Clock::System, args, console)?).map_err(|error| refused(&error))?;
    let mut tour = Tour::of(script);
    match play(engine, Surface::Watched(options, &mut tour), args.record_script.as_deref(), console)? {
        Ended::Done(status) => Ok(status),
        Ended::Continues(folder) => resume(Some(Path::new(&folder)), args, terminal, console),
    }
}

/// Resumes a session: the one of a folder or name, or else the latest.
pub(super) fn resume<O: Write, E: Write>(
    folder: Option<&Path>,
    args: &ScriptArgs,
    terminal: TerminalArgs,
    console: &mut Console<O, E>,
) -> Result<ExitStatus, Failure> {
    let surface = surface(terminal)?;
    let folder = script::find(folder, &args.sessions)?;
    let mut engine = script::open(&folder, script::live_options(Clock::System, args, console)?)?;
    engine.offer_links(args.sessions.clone());
    match play(engine, surface, args.record_script.as_deref(), console)? {
        Ended::Done(status) => Ok(status),
        Ended::Continues(folder) => resume(Some(Path::new(&folder)), args, terminal, console),
    }
}

/// How the wizard ended.
enum Ended {
    Done(ExitStatus),
    /// The operator wants to continue the session of this folder.
    Continues(String),
}

/// Where the wizard is shown.
enum Surface<'a> {
    Screen(tui::Options),
    Watched(tui::Options, &'a mut Tour),
    Lines(Glyphs),
}

fn surface(args: TerminalArgs) -> Result<Surface<'static>, Failure> {
    let environment = TerminalEnvironment::read();
    if args.plain || environment.term.as_deref() == Some("dumb") {
        return Ok(Surface::Lines(tui_options(args, &environment).theme.glyphs));
    }
    screen(args, &environment).map(Surface::Screen)
}

/// The settings of the terminal, if it is suitable.
pub(super) fn screen(args: TerminalArgs, environment: &TerminalEnvironment) -> Result<tui::Options, Failure> {
    let refused = |message: &str| {
        Err(Failure::new(ExitStatus::Usage, message)
            .hint("without one, use '--plain' for plain lines, or run a script: 'trupose --script FILE', or 'trupose demo'")
            .hint("single commands need none either: see 'trupose --help'"))
    };
    if !stdout().is_terminal() || !stdin().is_terminal() {
        return refused("the guided calibration needs a terminal");
    }
    if environment.term.as_deref().is_none_or(|term| term == "dumb") {
        return refused("the guided calibration needs a terminal that can move its cursor; TERM says it cannot");
    }
    Ok(tui_options(args, environment))
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
    tui::Options { theme, has_mouse: args.mouse, forces_colour: args.color == ColorArg::Always, has_bell: args.bell }
}

fn play<O: Write, E: Write>(
    engine: Engine,
    surface: Surface<'_>,
    record: Option<&Path>,
    console: &mut Console<O, E>,
) -> Result<Ended, Failure> {
    let mut recorded = Ok(());
    let mut at_end =
        |completed: &[CompletedIntent]| recorded = record.map_or(Ok(()), |file| write_script(file, completed));
    let exit = match surface {
        Surface::Screen(options) => tui::run(engine, options, &mut at_end),
        Surface::Watched(options, tour) => tui::watch(engine, options, Some(tour), &mut at_end),
        Surface::Lines(glyphs) => tui::lines::run(engine, stdin(), &mut console.out, glyphs, &mut at_end),
    };
    let exit =
        exit.map_err(|error| Failure::new(ExitStatus::Store, format!("the terminal cannot be used: {error}")))?;
    for remark in &exit.remarks {
        console.remark(remark);
    }
    let resume = exit.folder.map(|folder| format!("resume it with 'trupose resume {folder}'"));
    if !exit.unsaved.is_empty() {
        let status = exit.signal.map_or(ExitStatus::Store, ExitStatus::Signal);
        let failure = Failure::new(status, format!("{}; {}", exit.cause, not_saved(&exit.unsaved)));
        let resume = resume.map(|resume| format!("the session is saved up to there; {resume}"));
        return Err(resume.into_iter().fold(failure, Failure::hint));
    }
    if let Some(folder) = exit.resumes {
        return Ok(Ended::Continues(folder));
    }
    let saved = resume.map(|resume| format!("the session is saved; {resume}"));
    match exit.signal {
        None => {
            if let Some(saved) = saved {
                console.remark(&saved);
            }
            recorded.map(|()| Ended::Done(ExitStatus::Accepted))
        }
        Some(signal) => {
            let failure = Failure::new(ExitStatus::Signal(signal), exit.cause);
            Err(saved.into_iter().fold(failure, Failure::hint))
        }
    }
}

/// The sentence about entries that are in no file.
pub(super) fn not_saved(unsaved: &[String]) -> String {
    format!("NOT saved: {}", unsaved.join("; "))
}

/// Writes the operator's actions as a script.
fn write_script(file: &Path, completed: &[CompletedIntent]) -> Result<(), Failure> {
    let step = |done: &CompletedIntent| match &done.failure {
        None => ScriptStep::Do(done.intent.clone()),
        Some(message) => ScriptStep::Fails(done.intent.clone(), message.clone()),
    };
    let steps = completed.iter().map(step).collect();
    let script = Script { title: "recorded in the terminal".to_owned(), clock: None, steps };
    let text = script.to_text().map_err(|error| Failure::from_error(ExitStatus::Internal, &error))?;
    store::replace(file, &text).map_err(|error| Failure::from_error(ExitStatus::Store, &error))
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
