//! A small session, looked at again.

use proptest::prelude::*;

use super::*;
use crate::runtime::{Clock, Engine};
use crate::session::set_up::{InstrumentChoice, TargetChoice};
use crate::session::simulation::{Simulation, Truth};
use crate::store::session::read_journal;
use crate::tui::glyphs::Glyphs;
use crate::tui::paint;
use crate::wizard::Intent;
use ratatui::buffer::Buffer;

/// Measured poses.
const POSES: usize = 18;

/// The journal of a whole calibration.
fn journal() -> Journal {
    let folder = tempfile::tempdir().unwrap();
    let plan = folder.path().join("plan.csv");
    crate::store::replace(&plan, include_str!("../../../tests/sessions/plan.csv")).unwrap();
    let clock = Clock::starting_at(jiff::Timestamp::UNIX_EPOCH);
    let options = crate::runtime::Options::unrecorded(folder.path().to_owned(), clock);
    let mut engine = Engine::new(options).unwrap();
    let simulation = Simulation { truth: Truth::Paper, ..Simulation::default() };
    let before = [
        Intent::ChooseProfile("soochow".to_owned()),
        Intent::NameSession("small".to_owned()),
        Intent::Next,
        Intent::ChooseInstrument(InstrumentChoice::Simulated(simulation)),
        Intent::Next,
        Intent::ChooseTarget(TargetChoice::Profile),
        Intent::Next,
        Intent::LoadPlan(plan.display().to_string()),
        Intent::AcceptPlan,
    ];
    let measure = std::iter::repeat_n(Intent::Measure, POSES);
    let after = [Intent::Next, Intent::Identify, Intent::Quit];
    for intent in before.into_iter().chain(measure).chain(after) {
        engine.intend(intent);
        while engine.wizard().activity() == crate::wizard::Activity::Working {
            assert!(engine.wait(Duration::from_mins(2)), "nothing happens");
        }
    }
    let session = engine.wizard().folder().unwrap().to_owned();
    engine.release();
    let mut journal = read_journal(session.as_ref()).unwrap();
    for line in &mut journal.lines {
        // What is different with every version and every run.
        if let Entry::Opened { program, .. } = &mut line.entry {
            "trupose VERSION".clone_into(program);
        }
        if let Entry::Plan(plan) = &mut line.entry {
            "plan.csv".clone_into(&mut plan.origin);
        }
    }
    journal
}

fn tables(summary: &IdentificationSummary) -> String {
    format!("samples {}\nrank {:?}", summary.samples, summary.rank)
}

fn replay(glyphs: Glyphs) -> Replay {
    Replay::new(journal(), tables, Theme { has_colour: true, glyphs }).unwrap()
}

fn drawn(replay: &Replay, width: u16, height: u16) -> String {
    let mut buffer = Buffer::empty(Rect::new(0, 0, width, height));
    replay.draw(buffer.area, &mut buffer);
    paint::snapshot(&buffer)
}

fn press(replay: &mut Replay, code: KeyCode) -> ReplayCommand {
    replay.on_key(Key::plain_code(code))
}

#[test]
fn a_session_is_seen_at_every_entry() {
    let mut replay = replay(Glyphs::Unicode);
    insta::assert_snapshot!("first", drawn(&replay, 80, 24));
    let last = replay.lines.len() - 1;
    let is_sample = |line: &Line| matches!(line.entry, Entry::Sample(_));
    let first_sample = replay.lines.iter().position(is_sample).unwrap();
    replay.go(first_sample + 6);
    assert_eq!(replay.session().samples.len(), 7);
    insta::assert_snapshot!("capture", drawn(&replay, 80, 24));
    insta::assert_snapshot!("capture_large", drawn(&replay, 120, 40));
    press(&mut replay, KeyCode::Char('?'));
    insta::assert_snapshot!("help", drawn(&replay, 80, 24));
    assert_eq!(press(&mut replay, KeyCode::Char('q')), ReplayCommand::Draw);
    assert!(!replay.has_help);
    press(&mut replay, KeyCode::Tab);
    insta::assert_snapshot!("samples", drawn(&replay, 80, 24));
    press(&mut replay, KeyCode::Tab);
    assert!(drawn(&replay, 80, 24).contains("Not identified yet."));
    press(&mut replay, KeyCode::End);
    assert_eq!(replay.place, last);
    assert!(replay.session().closed);
    insta::assert_snapshot!("result", drawn(&replay, 80, 24));
    // Back is the same as never having been there.
    let there: Vec<Session> = (0..=last)
        .map(|place| {
            replay.go(place);
            replay.session().clone()
        })
        .collect();
    for place in (0..=last).rev() {
        press(&mut replay, KeyCode::Left);
        replay.go(place);
        assert_eq!(replay.session(), &there[place]);
    }
    let ascii = Theme { has_colour: false, glyphs: Glyphs::Ascii };
    let plain = Replay { theme: ascii, page: Page::Robot, ..replay };
    assert!(drawn(&plain, 120, 40).is_ascii());
    assert!(drawn(&plain, 40, 10).starts_with("terminal 40x10, need 60x18\n"));
}

#[test]
fn it_plays_to_the_end_and_stops_there() {
    let mut replay = replay(Glyphs::Ascii);
    let last = replay.lines.len() - 1;
    assert_eq!(replay.pause(), None);
    press(&mut replay, KeyCode::Char(' '));
    assert_eq!(replay.pause(), Some(Duration::from_millis(500)));
    press(&mut replay, KeyCode::Char('+'));
    assert_eq!(replay.pause(), Some(Duration::from_millis(250)));
    for _ in 0..last {
        assert!(replay.pause().is_some());
        replay.tick();
    }
    assert_eq!((replay.place, replay.pause()), (last, None));
    press(&mut replay, KeyCode::Char(' '));
    assert_eq!(replay.place, 0);
    assert!(replay.is_playing);
    press(&mut replay, KeyCode::Right);
    assert_eq!((replay.place, replay.is_playing), (1, false));
    assert_eq!(press(&mut replay, KeyCode::Char('q')), ReplayCommand::Quit);
    assert_eq!(replay.on_key(Key::ctrl('z')), ReplayCommand::Suspend);

    let keys = prop::sample::select(vec![
        KeyCode::Left,
        KeyCode::Right,
        KeyCode::Home,
        KeyCode::End,
        KeyCode::Tab,
        KeyCode::PageDown,
        KeyCode::PageUp,
        KeyCode::Char('v'),
        KeyCode::Char('-'),
        KeyCode::Up,
    ]);
    proptest!(ProptestConfig::with_cases(40), |(
        keys in prop::collection::vec(keys, 0..20), width in 0_u16..130, height in 0_u16..50,
    )| {
        let mut replay = replay.clone();
        for key in keys {
            press(&mut replay, key);
        }
        drawn(&replay, width, height);
    });
}
