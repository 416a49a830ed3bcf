//! The wizard in plain lines, for terminals that cannot move their cursor, for screen readers and for pipes.
//!
//! The view is printed, then a line is read: the number of what can be done. What needs a value is asked for in the words of the
//! screens, or the value follows the number. An intent as in scripts is understood too. The next line is read only when no work is
//! running, so that lines can come from a file.

use std::io::{self, BufRead as _, BufReader, Read, Write};
use std::sync::mpsc::{Receiver, TryRecvError, sync_channel};
use std::thread;

use super::dialog::{Answered, Dialog, taken};
use super::glyphs::Glyphs;
use super::screen::instrument::{way, ways};
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
    /// Do what is on offer, and ask for what it needs.
    Offer(Box<IntentInfo>),
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
    let mut driver = Driver { engine: &mut engine, out, glyphs, asking: None };
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
    /// What the next line answers, if it is no command.
    asking: Option<Asking>,
}

/// A question that is open.
enum Asking {
    /// Which of the ways to measure.
    Ways,
    /// A question of a dialog, by its number.
    Dialog(Box<Dialog>, usize),
}

impl Asking {
    fn question(&self) -> Vec<String> {
        match self {
            Self::Ways => {
                let ways = ways()
                    .iter()
                    .zip(1..)
                    .map(|((way, about), number): (_, usize)| format!("{number:5}  {way}: {about}"));
                ways.chain(["number".to_owned()]).collect()
            }
            Self::Dialog(dialog, number) => dialog.question(*number).unwrap_or_default(),
        }
    }
}

/// How an answer has ended.
enum Outcome {
    /// Another question is open, after a remark on the last answer.
    Asks(Asking, Option<String>),
    Does(Intent),
    Cancelled,
}

/// Takes a line as the answer to an open question.
fn answered(asking: Asking, line: &str, view: &ViewModel) -> Outcome {
    if line == "cancel" {
        return Outcome::Cancelled;
    }
    match asking {
        Asking::Ways => match line.parse::<usize>().ok().and_then(|number| number.checked_sub(1)) {
            Some(at) if at < ways().len() => match way(at, view) {
                Ok(intent) => Outcome::Does(intent),
                Err(dialog) => Outcome::Asks(Asking::Dialog(dialog, 0), None),
            },
            _ => Outcome::Asks(Asking::Ways, Some(format!("'{line}' is no number of the list"))),
        },
        Asking::Dialog(mut dialog, number) => {
            dialog.see(&taken(view));
            if let Err(problem) = dialog.answer(number, line) {
                return Outcome::Asks(Asking::Dialog(dialog, number), Some(problem));
            }
            if dialog.question(number + 1).is_some() {
                return Outcome::Asks(Asking::Dialog(dialog, number + 1), None);
            }
            if let Some(mut next) = dialog.continued() {
                next.see(&taken(view));
                return Outcome::Asks(Asking::Dialog(next, 0), None);
            }
            match dialog.answered() {
                Answered::Intent(intent) => Outcome::Does(intent),
                Answered::Cancelled => Outcome::Cancelled,
                Answered::Wrong(problem) => Outcome::Asks(Asking::Dialog(dialog, 0), Some(problem)),
            }
        }
    }
}

/// What an offer asks for before it is done.
fn asks(offer: &IntentInfo, view: &ViewModel) -> Option<Asking> {
    let dialog = |dialog| Some(Asking::Dialog(Box::new(dialog), 0));
    match &offer.intent {
        Intent::ChooseInstrument(_) => Some(Asking::Ways),
        Intent::MakePlan(settings) => dialog(Dialog::plan(*settings)),
        _ => Dialog::before(offer, view).and_then(dialog),
    }
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
        let understood = command(line, &view.intents);
        if let Some(asking) = self.asking.take() {
            // An intent as in scripts is never an answer.
            return match understood {
                Command::Intent(intent) if line.contains('(') => self.intend(intent),
                _ => self.take(answered(asking, line.trim(), &view)),
            };
        }
        match understood {
            Command::Show { all } => self.show(&view, all),
            Command::Invalid(reason) => self.say(&reason),
            Command::Intent(intent) => self.intend(intent),
            Command::Offer(offer) => match asks(&offer, &view) {
                Some(asking) => self.take(Outcome::Asks(asking, None)),
                None => self.intend(offer.intent),
            },
        }
    }

    fn intend(&mut self, intent: Intent) -> io::Result<()> {
        self.engine.intend(intent);
        self.settle()?;
        if self.engine.has_exited() {
            return Ok(());
        }
        self.show(&self.engine.wizard().view(), false)
    }

    /// Carries out what an answer leads to.
    fn take(&mut self, outcome: Outcome) -> io::Result<()> {
        match outcome {
            Outcome::Does(intent) => self.intend(intent),
            Outcome::Cancelled => self.show(&self.engine.wizard().view(), false),
            Outcome::Asks(asking, remark) => {
                if let Some(remark) = remark {
                    self.say(&format!("not yet: {remark}"))?;
                }
                let question = asking.question();
                let (last, before) =
                    question.split_last().map_or(("", &[][..]), |(last, before)| (last.as_str(), before));
                for line in before {
                    self.say(line)?;
                }
                write!(self.out, "{}: ", self.glyphs.show(last))?;
                self.out.flush()?;
                self.asking = Some(asking);
                Ok(())
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
        format!("{number:3}  {}{mark}", offer.label)
    }));
    lines.push(
        "Type a number. An empty line shows this again, 'all' without cutting, 'cancel' leaves a question.".to_owned(),
    );
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
        if value.trim().is_empty() {
            return Command::Offer(Box::new(offer.clone()));
        }
        return match with_value(&offer.intent, value.trim()) {
            Some(intent) => Command::Intent(intent),
            None => Command::Invalid(format!("'{}' takes no value here: type its number alone", offer.label)),
        };
    }
    match ron::from_str(line) {
        Ok(intent) => Command::Intent(intent),
        Err(_) => Command::Invalid(format!("'{line}' is no number of the list; an empty line shows the list again")),
    }
}

/// The intent with the value typed after its number.
fn with_value(intent: &Intent, value: &str) -> Option<Intent> {
    let text = value.to_owned();
    Some(match intent {
        Intent::ChooseProfile(_) => Intent::ChooseProfile(text),
        Intent::NameSession(_) => Intent::NameSession(text),
        Intent::LoadPlan(_) => Intent::LoadPlan(text),
        Intent::TypeReading(_) => Intent::TypeReading(text),
        Intent::GoToPose(_) => Intent::GoToPose(text),
        Intent::Note(_) => Intent::Note(text),
        Intent::Exclude(_) => Intent::Exclude(text),
        Intent::Include(_) => Intent::Include(text),
        Intent::ReadPoints(_) => Intent::ReadPoints(text),
        Intent::NotePose { .. } => {
            let (pose, note) = value.split_once(char::is_whitespace)?;
            Intent::NotePose { pose: pose.to_owned(), text: note.trim().to_owned() }
        }
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
        assert_eq!(parsed("2"), Command::Offer(Box::new(offers[2].clone())));
        assert_eq!(parsed("Next"), Command::Intent(Intent::Next));
        assert_eq!(parsed("Note(\"warm\")"), Command::Intent(Intent::Note("warm".to_owned())));
        assert_eq!(parsed("\r\n"), Command::Show { all: false });
        for wrong in ["0", "3", "2 x", "-1", "measure", "99999999999999999999999", "Note(", "ä"] {
            assert!(matches!(parsed(wrong), Command::Invalid(_)), "{wrong}");
        }
    }
}
