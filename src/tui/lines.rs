//! The wizard in plain lines, for terminals that cannot move their cursor, for screen readers and for pipes.
//!
//! What there is to see is printed, then a line is read: a number from the list, with a value behind it where one is needed, or
//! an intent as scripts have it. The next line is read when nothing is under way any more, so that lines can come from a file.

use std::io::{self, BufRead as _, BufReader, Read, Write};
use std::sync::mpsc::{Receiver, TryRecvError, sync_channel};
use std::thread;

use super::glyphs::Glyphs;
use super::values;
use super::{AtEnd, Exit, IDLE, LAST_ENTRY};
use crate::runtime::{Engine, Events, signals};
use crate::wizard::view::ViewModel;
use crate::wizard::{Intent, IntentInfo, Notice, Severity};

/// Lines that wait; then they wait in the pipe.
const WAITING: usize = 64;
/// Longest line (bytes) that is looked at.
const LONGEST: u64 = 64 * 1024;

/// Something from the input.
enum Input {
    Line(String),
    Over,
}

/// What a line asks for.
#[derive(Clone, Debug, PartialEq)]
enum Asked {
    /// To be shown again, perhaps with everything.
    Show { all: bool },
    /// This is to be done.
    Intend(Intent),
    /// It cannot be understood.
    Unclear(String),
}

/// Runs the wizard in lines until it ends, or the input does.
///
/// # Errors
/// The system refuses a thread. Output that cannot be written ends the session in good order, and is no error.
pub fn run(
    mut engine: Engine,
    input: impl Read + Send + 'static,
    out: &mut impl Write,
    glyphs: Glyphs,
    at_end: AtEnd<'_>,
) -> io::Result<Exit> {
    let received = signals::watch(engine.sender())?;
    let lines = start(input, engine.sender())?;
    let mut talk = Talk { engine: &mut engine, out, glyphs };
    if talk.run(&lines).is_err() {
        engine.shut_down("the output cannot be written");
    }
    while !engine.has_exited() && engine.wait(LAST_ENTRY) {}
    at_end(engine.deeds());
    let remarks = engine.end_recording().into_iter().collect();
    let wizard = engine.wizard();
    Ok(Exit {
        cause: wizard.ended().unwrap_or("ended").to_owned(),
        signal: received.signal(),
        folder: wizard.folder().map(str::to_owned),
        remarks,
    })
}

/// Reads on a thread that nobody joins: a read may never return.
fn start(input: impl Read + Send + 'static, events: Events) -> io::Result<Receiver<Input>> {
    let (sender, lines) = sync_channel(WAITING);
    let read = move || {
        let mut input = BufReader::new(input);
        loop {
            let mut bytes = Vec::new();
            let count = input.by_ref().take(LONGEST).read_until(b'\n', &mut bytes).unwrap_or(0);
            let next = if count == 0 { Input::Over } else { Input::Line(String::from_utf8_lossy(&bytes).into_owned()) };
            if sender.send(next).is_err() || !events.wake() || count == 0 {
                break;
            }
        }
    };
    thread::Builder::new().name("input".to_owned()).spawn(read)?;
    Ok(lines)
}

struct Talk<'a, W> {
    engine: &'a mut Engine,
    out: &'a mut W,
    glyphs: Glyphs,
}

impl<W: Write> Talk<'_, W> {
    fn run(&mut self, lines: &Receiver<Input>) -> io::Result<()> {
        self.settle()?;
        let mut shown = self.engine.wizard().view();
        self.show(&shown, false)?;
        while !self.engine.has_exited() {
            match lines.try_recv() {
                Ok(Input::Line(line)) => {
                    let view = self.engine.wizard().view();
                    match asked(&line, &view.intents) {
                        Asked::Show { all } => self.show(&view, all)?,
                        Asked::Unclear(why) => self.say(&why)?,
                        Asked::Intend(intent) => {
                            self.engine.intend(intent);
                            self.settle()?;
                            if !self.engine.has_exited() {
                                self.show(&self.engine.wizard().view(), false)?;
                            }
                        }
                    }
                    shown = self.engine.wizard().view();
                }
                Ok(Input::Over) | Err(TryRecvError::Disconnected) => self.engine.shut_down("the input ended"),
                Err(TryRecvError::Empty) => {
                    self.engine.wait(IDLE);
                    self.settle()?;
                    let view = self.engine.wizard().view();
                    if view.notice != shown.notice && !self.engine.has_exited() {
                        self.show(&view, false)?;
                        shown = view;
                    }
                }
            }
        }
        let end = self.engine.wizard().ended().unwrap_or("ended").to_owned();
        self.say(&end)
    }

    /// Waits until nothing is under way; says what is.
    fn settle(&mut self) -> io::Result<()> {
        let mut said = None;
        while !self.engine.has_exited() && !self.engine.wizard().is_idle() {
            let busy = self.engine.wizard().view().busy.map(|busy| busy.what);
            if busy.is_some() && busy != said {
                self.say(&format!("{} ...", busy.unwrap_or_default()))?;
                said = busy;
            }
            self.engine.wait(IDLE);
        }
        // Nobody reads them here; they must not pile up.
        self.engine.happenings().for_each(drop);
        Ok(())
    }

    fn say(&mut self, line: &str) -> io::Result<()> {
        writeln!(self.out, "{}", self.glyphs.show(line))?;
        self.out.flush()
    }

    fn show(&mut self, view: &ViewModel, has_all: bool) -> io::Result<()> {
        let lines = page(view, has_all);
        let text: Vec<String> = lines.iter().map(|line| self.glyphs.show(line) + "\n").collect();
        write!(self.out, "{}> ", text.concat())?;
        self.out.flush()
    }
}

/// Everything there is to see, in lines.
fn page(view: &ViewModel, has_all: bool) -> Vec<String> {
    let header = &view.header;
    let mut lines = vec![String::new(), format!("step {} of {}: {}", header.number, header.steps, header.step)];
    let mut parts = vec![header.robot.clone().unwrap_or_else(|| "no robot yet".to_owned())];
    parts.push(header.session.as_ref().map_or_else(
        || "not saved yet".to_owned(),
        |session| format!("session {session}, {}", if header.is_saving { "saving" } else { "saved" }),
    ));
    if header.samples > 0 {
        parts.push(format!("{} {}", header.samples, if header.samples == 1 { "sample" } else { "samples" }));
    }
    parts.extend(header.instrument.clone());
    lines.push(parts.join(", "));
    lines.push(view.purpose.to_owned());
    lines.extend(view.live.as_ref().and_then(values::live).map(|text| format!("now: {text}")));
    lines.extend(values::lines(&view.content, has_all));
    lines.extend(view.notice.iter().flat_map(notice));
    lines.push("You can type:".to_owned());
    lines.extend(offers(&view.intents).zip(1..).map(|(offer, number): (&IntentInfo, usize)| {
        let mark = if offer.is_default { "   <- next" } else { "" };
        format!("{number:3}  {}: {}{mark}", offer.label, ron(&offer.intent))
    }));
    lines
}

fn notice(notice: &Notice) -> Vec<String> {
    let lead = match notice.severity {
        Severity::Info => "",
        Severity::Attention => "note: ",
        Severity::Error => "not done: ",
        Severity::Stop => "STOP: ",
    };
    let said = format!("{lead}{}", notice.what);
    let hints = notice.hints.iter().map(|hint| format!("hint: {hint}"));
    said.lines().map(str::to_owned).chain(hints).collect()
}

/// What can be done now, in the order of its numbers.
fn offers(intents: &[IntentInfo]) -> impl Iterator<Item = &IntentInfo> {
    intents.iter().filter(|offer| offer.is_enabled())
}

fn ron(intent: &Intent) -> String {
    ron::to_string(intent).unwrap_or_else(|_| intent.name().to_owned())
}

fn asked(line: &str, intents: &[IntentInfo]) -> Asked {
    let line = line.trim();
    match line {
        "" => return Asked::Show { all: false },
        "all" => return Asked::Show { all: true },
        _ => {}
    }
    let (first, value) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
    if let Ok(number) = first.parse::<usize>() {
        let Some(offer) = number.checked_sub(1).and_then(|index| offers(intents).nth(index)) else {
            return Asked::Unclear(format!("there is no {number} in the list; an empty line shows it again"));
        };
        return match with_value(&offer.intent, value.trim()) {
            Some(intent) => Asked::Intend(intent),
            None => {
                Asked::Unclear(format!("'{value}' does not fit {}; write it out as in the list", offer.intent.name()))
            }
        };
    }
    match ron::from_str(line) {
        Ok(intent) => Asked::Intend(intent),
        Err(error) => Asked::Unclear(format!(
            "neither a number of the list nor something to do, such as ChooseProfile(\"soochow\"): {}",
            error.code
        )),
    }
}

/// The intent with what was written behind its number; without that, as it is on offer.
fn with_value(intent: &Intent, value: &str) -> Option<Intent> {
    if value.is_empty() {
        return Some(intent.clone());
    }
    let text = value.to_owned();
    Some(match intent {
        Intent::ChooseProfile(_) => Intent::ChooseProfile(text),
        Intent::NameSession(_) => Intent::NameSession(text),
        Intent::LoadPlan(_) => Intent::LoadPlan(text),
        Intent::TypeReading(_) => Intent::TypeReading(text),
        Intent::GoToPose(_) => Intent::GoToPose(text),
        Intent::Note(_) => Intent::Note(text),
        Intent::SuggestPoses(_) => Intent::SuggestPoses(value.parse().ok()?),
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_is_a_number_with_a_value_or_an_intent() {
        let offers = [
            IntentInfo::new(Intent::Next, "go on").unless(Some("no plan".to_owned())),
            IntentInfo::new(Intent::LoadPlan(String::new()), "load a plan"),
            IntentInfo::new(Intent::AcceptPlan, "measure this plan"),
        ];
        let said = |line: &str| asked(line, &offers);
        assert_eq!(said(" 1 my plan.csv\n"), Asked::Intend(Intent::LoadPlan("my plan.csv".to_owned())));
        assert_eq!(said("2"), Asked::Intend(Intent::AcceptPlan));
        assert_eq!(said("Next"), Asked::Intend(Intent::Next));
        assert_eq!(said("Note(\"warm\")"), Asked::Intend(Intent::Note("warm".to_owned())));
        assert_eq!(said("\r\n"), Asked::Show { all: false });
        for wrong in ["0", "3", "2 x", "-1", "measure", "99999999999999999999999", "Note(", "ä"] {
            assert!(matches!(said(wrong), Asked::Unclear(_)), "{wrong}");
        }
    }
}
