//! The wizard in plain lines, for terminals that cannot move their cursor, for screen readers and for pipes.
//!
//! The view is printed, then a line is read: a number from the list, followed by a value if one is needed, or an intent as in
//! scripts. The next line is read only when no work is running, so that lines can come from a file.

use std::io::{self, BufRead as _, BufReader, Read, Write};
use std::sync::mpsc::{Receiver, TryRecvError, sync_channel};
use std::thread;

use super::glyphs::Glyphs;
use super::values;
use super::{AtEnd, Exit, IDLE, LAST_ENTRY};
use crate::runtime::{Engine, Events, signals};
use crate::text::counted;
use crate::wizard::view::ViewModel;
use crate::wizard::{Activity, Intent, IntentInfo, Notice, Severity};

/// Capacity of the channel. Further lines wait in the pipe.
const WAITING: usize = 64;
/// Longest line that is read (bytes).
const LONGEST: u64 = 64 * 1024;

/// A line of the input, or its end.
enum Input {
    Line(String),
    End,
}

/// The meaning of a line.
#[derive(Clone, Debug, PartialEq)]
enum Command {
    /// Show the view again, with long lists in full if `all`.
    Show { all: bool },
    /// Send an intent.
    Intent(Intent),
    /// The line is invalid for this reason.
    Invalid(String),
}

/// Runs the wizard in plain lines until the wizard or the input ends.
///
/// # Errors
/// The system refuses a thread. If the output cannot be written, the session is closed cleanly, which is not an error.
pub fn run(
    mut engine: Engine,
    input: impl Read + Send + 'static,
    out: &mut impl Write,
    glyphs: Glyphs,
    at_end: AtEnd<'_>,
) -> io::Result<Exit> {
    let received = signals::watch(engine.sender())?;
    let lines = start(input, engine.sender())?;
    let mut driver = Driver { engine: &mut engine, out, glyphs };
    if driver.run(&lines).is_err() {
        engine.shut_down("the output cannot be written");
    }
    while !engine.has_exited() && engine.wait(LAST_ENTRY) {}
    at_end(engine.completed_intents());
    let remarks = engine.end_recording().into_iter().collect();
    Ok(Exit::of(engine.wizard(), received.signal(), remarks))
}

/// Starts the reading thread. It is never joined, because a read may never return.
fn start(input: impl Read + Send + 'static, events: Events) -> io::Result<Receiver<Input>> {
    let (sender, lines) = sync_channel(WAITING);
    let read = move || {
        let mut input = BufReader::new(input);
        loop {
            let mut bytes = Vec::new();
            let count = input.by_ref().take(LONGEST).read_until(b'\n', &mut bytes).unwrap_or(0);
            let next = if count == 0 { Input::End } else { Input::Line(String::from_utf8_lossy(&bytes).into_owned()) };
            if sender.send(next).is_err() || !events.wake() || count == 0 {
                break;
            }
        }
    };
    thread::Builder::new().name("input".to_owned()).spawn(read)?;
    Ok(lines)
}

struct Driver<'a, W> {
    engine: &'a mut Engine,
    out: &'a mut W,
    glyphs: Glyphs,
}

impl<W: Write> Driver<'_, W> {
    fn run(&mut self, lines: &Receiver<Input>) -> io::Result<()> {
        self.settle()?;
        let mut shown = self.engine.wizard().view();
        self.show(&shown, false)?;
        while !self.engine.has_exited() {
            match lines.try_recv() {
                Ok(Input::Line(line)) => {
                    self.on_line(&line)?;
                    shown = self.engine.wizard().view();
                }
                Ok(Input::End) | Err(TryRecvError::Disconnected) => self.engine.shut_down("the input ended"),
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

    fn on_line(&mut self, line: &str) -> io::Result<()> {
        let view = self.engine.wizard().view();
        match command(line, &view.intents) {
            Command::Show { all } => self.show(&view, all),
            Command::Invalid(reason) => self.say(&reason),
            Command::Intent(intent) => {
                self.engine.intend(intent);
                self.settle()?;
                if self.engine.has_exited() {
                    return Ok(());
                }
                self.show(&self.engine.wizard().view(), false)
            }
        }
    }

    /// Waits until the wizard is idle or needs the operator, and prints what is running.
    fn settle(&mut self) -> io::Result<()> {
        let mut said = None;
        while !self.engine.has_exited() && self.engine.wizard().activity() == Activity::Working {
            let busy = self.engine.wizard().view().busy.map(|busy| busy.what);
            if busy.is_some() && busy != said {
                self.say(&format!("{} ...", busy.unwrap_or_default()))?;
                said = busy;
            }
            self.engine.wait(IDLE);
        }
        // They are not used here and must not pile up.
        self.engine.outputs().for_each(drop);
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

/// The whole view in lines.
fn page(view: &ViewModel, has_all: bool) -> Vec<String> {
    let header = &view.header;
    let mut lines = vec![String::new(), format!("step {} of {}: {}", header.number, header.steps, header.step)];
    let mut parts = vec![header.robot.clone().unwrap_or_else(|| "no robot yet".to_owned())];
    parts.push(
        header
            .session
            .as_ref()
            .map_or_else(|| "not saved yet".to_owned(), |session| format!("session {session}, {}", header.saving())),
    );
    if header.samples > 0 {
        parts.push(counted(header.samples, "sample"));
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

/// Intents that are possible now, in the order of their numbers.
fn offers(intents: &[IntentInfo]) -> impl Iterator<Item = &IntentInfo> {
    intents.iter().filter(|offer| offer.is_enabled())
}

fn ron(intent: &Intent) -> String {
    ron::to_string(intent).unwrap_or_else(|_| intent.name().to_owned())
}

fn command(line: &str, intents: &[IntentInfo]) -> Command {
    let line = line.trim();
    match line {
        "" => return Command::Show { all: false },
        "all" => return Command::Show { all: true },
        _ => {}
    }
    let (first, value) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
    if let Ok(number) = first.parse::<usize>() {
        let Some(offer) = number.checked_sub(1).and_then(|index| offers(intents).nth(index)) else {
            return Command::Invalid(format!("there is no {number} in the list; an empty line shows the list again"));
        };
        return match with_value(&offer.intent, value.trim()) {
            Some(intent) => Command::Intent(intent),
            None => Command::Invalid(format!(
                "'{value}' is not a value for {}; write the intent as in the list",
                offer.intent.name()
            )),
        };
    }
    match ron::from_str(line) {
        Ok(intent) => Command::Intent(intent),
        Err(error) => Command::Invalid(format!(
            "neither a number from the list nor an intent such as ChooseProfile(\"soochow\"): {}",
            error.code
        )),
    }
}

/// The intent with the value typed after its number, or as offered if there is none.
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
        let parsed = |line: &str| command(line, &offers);
        assert_eq!(parsed(" 1 my plan.csv\n"), Command::Intent(Intent::LoadPlan("my plan.csv".to_owned())));
        assert_eq!(parsed("2"), Command::Intent(Intent::AcceptPlan));
        assert_eq!(parsed("Next"), Command::Intent(Intent::Next));
        assert_eq!(parsed("Note(\"warm\")"), Command::Intent(Intent::Note("warm".to_owned())));
        assert_eq!(parsed("\r\n"), Command::Show { all: false });
        for wrong in ["0", "3", "2 x", "-1", "measure", "99999999999999999999999", "Note(", "ä"] {
            assert!(matches!(parsed(wrong), Command::Invalid(_)), "{wrong}");
        }
    }
}
