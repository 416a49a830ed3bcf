use std::time::Duration;

use proptest::prelude::*;

use super::*;
use crate::runtime::{Clock, Engine, Options};
use crate::tui::glyphs::Glyphs;
use crate::wizard::view::{BusyView, ProfileCard};
use crate::wizard::{Notice, Wizard};

fn view() -> ViewModel {
    Wizard::new(jiff::Timestamp::UNIX_EPOCH).view()
}

fn themes() -> [Theme; 2] {
    [Theme { has_colour: true, glyphs: Glyphs::Unicode }, Theme { has_colour: false, glyphs: Glyphs::Ascii }]
}

/// A robot chosen, planning under way, something to say.
fn crowded() -> ViewModel {
    let mut view = view();
    if let Content::Profile(content) = &mut view.content {
        let (profile, _) = Profile::parse(builtin("soochow").unwrap(), "soochow").unwrap();
        content.chosen = Some(ProfileCard {
            name: "soochow".to_owned(),
            title: profile.title().to_owned(),
            source: profile.source().to_owned(),
            joints: vec!["J1".to_owned(), "J2".to_owned()],
            free_parameters: 25,
            instrument: None,
            target_mm: Some([-1.473, 26.384, 71.991]),
            flange_at_zero_mm: [1065.0, 0.0, 1424.0],
            profile: None,
            warnings: Vec::new(),
        });
        view.header.robot = Some(profile.title().to_owned());
    }
    view.header.session = Some("soochow-20260105".to_owned());
    view.header.instrument = Some("simulated tracker, seed 1".to_owned());
    view.header.samples = 12;
    view.header.elapsed_min = 34.2;
    view.busy = Some(BusyView {
        what: "planning",
        progress: Some("choosing, start 2 of 3: condition 69.1, predicted error 0.680 sigma".to_owned()),
        part: Some(0.58),
        figures: None,
        is_cancelled: false,
    });
    let notice = Notice::attention("the reflector at pose 12 is 3.2 mm from where it should be: \u{1b}[31m bumped?");
    view.notice = Some(notice.hint("look at the reflector, then measure again").hint("or keep the sample as it is"));
    view
}

fn drawn(view: &ViewModel, theme: Theme, keys: &[Key], width: u16, height: u16) -> Buffer {
    let mut ui = Ui::new(theme);
    ui.refresh(view, &Session::default());
    for key in keys {
        ui.on_input(Input::Key(*key), view);
    }
    let mut buffer = Buffer::empty(Rect::new(0, 0, width, height));
    ui.draw(view, buffer.area, &mut buffer);
    buffer
}

impl Ui {
    /// With a robot in the picture, whatever the session is.
    pub(crate) fn put_scene(&mut self, scene: Scene) {
        self.scene = Some(scene);
    }
}

#[test]
fn a_path_that_was_refused_is_proposed_again_until_one_is_accepted() {
    let type_in = |ui: &mut Ui, view: &ViewModel, keys: &[Key]| -> Command {
        keys.iter().fold(Command::None, |_, key| ui.on_input(Input::Key(*key), view))
    };
    let key = |c: char| Key::plain_code(KeyCode::Char(c));
    let enter = Key::plain_code(KeyCode::Enter);
    let view = view();
    let mut ui = Ui::new(themes()[0]);
    ui.refresh(&view, &Session::default());
    let asked = Command::Intent(Intent::ChooseProfile("x.ro".to_owned()));
    let typed = [key('f'), key('x'), key('.'), key('r'), key('o'), enter];
    assert_eq!(type_in(&mut ui, &view, &typed), asked);
    let mut refused = view.clone();
    refused.notice = Some(Notice::error("there is no profile 'x.ro'"));
    ui.refresh(&refused, &Session::default());
    let end = Key::plain_code(KeyCode::End);
    let corrected = Command::Intent(Intent::ChooseProfile("x.ron".to_owned()));
    assert_eq!(type_in(&mut ui, &refused, &[key('f'), end, key('n'), enter]), corrected);
    // Accepted, the next question begins empty.
    ui.refresh(&view, &Session::default());
    assert_eq!(type_in(&mut ui, &view, &[key('f'), enter]), Command::Intent(Intent::ChooseProfile(String::new())));
}

#[test]
fn the_bell_rings_once_for_what_needs_attention() {
    let usual = screen::capture_tests::usual();
    let asked = screen::capture_tests::in_question();
    let rings = |has_bell: bool, views: &[&ViewModel]| -> Vec<bool> {
        let mut ui = Ui::new(themes()[0]).with_bell(has_bell);
        let ring = |view: &&ViewModel| {
            ui.refresh(view, &Session::default());
            ui.take_bell()
        };
        views.iter().map(ring).collect()
    };
    assert_eq!(rings(true, &[&usual, &asked, &asked, &usual, &asked]), [false, true, false, false, true]);
    assert_eq!(rings(false, &[&usual, &asked]), [false, false]);
    // By key, with a proof.
    let mut ui = Ui::new(themes()[0]);
    ui.refresh(&usual, &Session::default());
    let help = |ui: &mut Ui| {
        ui.on_input(Input::Key(Key::char('?')), &usual);
        let mut buffer = Buffer::empty(Rect::new(0, 0, 80, 60));
        ui.draw(&usual, buffer.area, &mut buffer);
        ui.on_input(Input::Key(Key::plain_code(KeyCode::Esc)), &usual);
        paint::snapshot(&buffer)
    };
    assert!(help(&mut ui).contains("needs attention: now off"));
    ui.on_input(Input::Key(keymap::BELL), &usual);
    assert!(ui.take_bell() && !ui.take_bell());
    assert!(help(&mut ui).contains("needs attention: now on"));
}

#[test]
fn the_skeleton_at_80x24() {
    let [unicode, ascii] = themes();
    insta::assert_snapshot!("first", paint::snapshot(&drawn(&view(), unicode, &[], 80, 24)));
    let [usual, in_ascii] = [unicode, ascii].map(|theme| paint::snapshot(&drawn(&crowded(), theme, &[], 80, 24)));
    insta::assert_snapshot!("crowded", usual);
    insta::assert_snapshot!("crowded_ascii", paint::differences(&usual, &in_ascii));
    insta::assert_snapshot!("smallest", paint::snapshot(&drawn(&crowded(), unicode, &[], 60, 18)));
}

#[test]
fn questions_and_help() {
    let [unicode, _] = themes();
    let after = |keys: &[Key]| paint::snapshot(&drawn(&view(), unicode, keys, 80, 24));
    for (name, key) in [("choose", 'c'), ("quit", 'q'), ("help", '?')] {
        insta::assert_snapshot!(name, paint::differences(&after(&[]), &after(&[Key::char(key)])));
    }
}

#[test]
fn too_small_says_what_it_needs() {
    let [unicode, _] = themes();
    let shown = paint::snapshot(&drawn(&view(), unicode, &[], 40, 10));
    assert!(shown.starts_with("terminal 40x10, need 60x18\n"), "{shown}");
    let shown = paint::snapshot(&drawn(&view(), unicode, &[], 20, 5));
    assert!(shown.starts_with("terminal 20x5, need\n60x18\n"), "{shown}");
}

#[test]
fn keys_become_intents() {
    let view = view();
    let mut ui = Ui::new(themes()[0]);
    ui.refresh(&view, &Session::default());
    let mut press = |key: Key| ui.on_input(Input::Key(key), &view);
    // Nothing to take yet: the wizard says why.
    assert_eq!(press(Key::char('n')), Command::Intent(Intent::Next));
    assert_eq!(press(Key::char('c')), Command::None);
    for c in "ur10e".chars() {
        assert_eq!(press(Key::char(c)), Command::None);
    }
    assert_eq!(press(Key::plain_code(KeyCode::Enter)), Command::Intent(Intent::ChooseProfile("ur10e".to_owned())));
    assert_eq!(press(Key::ctrl('c')), Command::None);
    assert_eq!(press(Key::ctrl('c')), Command::Intent(Intent::Quit));
    assert_eq!(press(Key::ctrl('z')), Command::Suspend);
}

#[test]
fn a_key_without_effect_hides_no_change() {
    let view = view();
    let mut ui = Ui::new(themes()[0]);
    ui.refresh(&view, &Session::default());
    assert!(ui.take_dirty());
    // Both before it is drawn again.
    ui.on_input(Input::Key(Key::char('?')), &view);
    ui.on_input(Input::Key(Key::char('?')), &view);
    ui.on_input(Input::Key(Key::plain_code(KeyCode::F(9))), &view);
    assert!(ui.take_dirty());
    ui.on_input(Input::Key(Key::plain_code(KeyCode::F(9))), &view);
    assert!(!ui.take_dirty());
}

#[test]
fn the_robot_is_seen_where_there_is_room_and_nothing_before_it() {
    let view = crowded();
    let mut ui = Ui::new(themes()[0]);
    ui.refresh(&view, &Session::default());
    let large = Rect::new(0, 0, 120, 40);
    assert!(ui.shows_picture(&view, large));
    assert!(!ui.shows_picture(&view, Rect::new(0, 0, 20, 5)));
    ui.on_input(Input::Key(Key::char('?')), &view);
    assert!(!ui.shows_picture(&view, large));
}

#[test]
fn a_letter_without_effect_is_answered_until_the_next_key() {
    let view = screen::capture_tests::usual();
    let mut ui = Ui::new(themes()[0]);
    ui.refresh(&view, &Session::default());
    ui.note_picture(false);
    let footer = |ui: &mut Ui, key: Key| {
        ui.take_dirty();
        assert_eq!(ui.on_input(Input::Key(key), &view), Command::None);
        let is_dirty = ui.take_dirty();
        let mut buffer = Buffer::empty(Rect::new(0, 0, 80, 24));
        ui.draw(&view, buffer.area, &mut buffer);
        (is_dirty, paint::snapshot(&buffer))
    };
    for letter in ['z', 'j'] {
        let (is_dirty, shown) = footer(&mut ui, Key::char(letter));
        assert!(is_dirty && shown.contains(&format!("{letter} has no effect here")), "{shown}");
    }
    let (is_dirty, shown) = footer(&mut ui, Key::plain_code(KeyCode::F(9)));
    assert!(is_dirty && !shown.contains("has no effect"), "{shown}");
}

/// The terminal's loop without a terminal.
struct Walk {
    engine: Engine,
    ui: Ui,
}

impl Walk {
    fn press(&mut self, key: Key) {
        let view = self.engine.wizard().view();
        self.ui.refresh(&view, self.engine.wizard().session());
        if let Command::Intent(intent) = self.ui.on_input(Input::Key(key), &view) {
            self.engine.intend(intent);
        }
        while self.engine.wizard().activity() == crate::wizard::Activity::Working {
            assert!(self.engine.wait(Duration::from_mins(2)), "nothing happens");
        }
        let view = self.engine.wizard().view();
        self.ui.refresh(&view, self.engine.wizard().session());
        self.every_possible_intent_has_a_key(&view);
        let mut buffer = Buffer::empty(Rect::new(0, 0, 80, 24));
        self.ui.draw(&view, buffer.area, &mut buffer);
    }

    fn every_possible_intent_has_a_key(&self, view: &ViewModel) {
        let shown = keymap::key_hints(&view.intents, Glyphs::Unicode);
        for offer in view.intents.iter().filter(|offer| offer.is_enabled()) {
            let has_key = shown.iter().any(|item| item.label == offer.label && item.blocked.is_none());
            assert!(has_key, "{offer:?} in the step {}", self.ui.step);
        }
    }

    fn is_at(&self, step: Step) {
        let notice = self.engine.wizard().notice();
        assert_eq!(self.engine.wizard().view().header.step, step, "{notice:?}");
    }
}

#[test]
fn the_first_steps_are_walked_by_keys() {
    let folder = tempfile::tempdir().unwrap();
    let clock = Clock::starting_at(jiff::Timestamp::UNIX_EPOCH);
    let engine = Engine::new(Options::unrecorded(folder.path().to_owned(), clock)).unwrap();
    let mut walk = Walk { engine, ui: Ui::new(themes()[0]) };
    let enter = Key::plain_code(KeyCode::Enter);
    walk.press(Key::char('c'));
    for c in "soo".chars() {
        walk.press(Key::char(c));
    }
    walk.press(enter);
    walk.press(enter);
    walk.is_at(Step::Instrument);
    walk.press(Key::char('c'));
    walk.press(enter);
    walk.press(enter);
    walk.is_at(Step::Target);
    walk.press(Key::char('p'));
    walk.press(enter);
    walk.is_at(Step::Plan);
    walk.press(Key::char('b'));
    walk.is_at(Step::Target);
    walk.press(Key::char('q'));
    walk.press(Key::char('y'));
    assert!(walk.engine.has_exited());
}

fn any_key() -> impl Strategy<Value = Key> {
    let codes = [
        KeyCode::Enter,
        KeyCode::Esc,
        KeyCode::Tab,
        KeyCode::Up,
        KeyCode::Down,
        KeyCode::Left,
        KeyCode::Right,
        KeyCode::PageUp,
        KeyCode::PageDown,
        KeyCode::Home,
        KeyCode::End,
        KeyCode::Backspace,
        KeyCode::Delete,
    ];
    prop_oneof![
        prop::sample::select(codes.to_vec()).prop_map(Key::plain_code),
        any::<char>().prop_map(Key::char),
        prop::char::range('a', 'z').prop_map(Key::char),
        prop::char::range('a', 'z').prop_map(Key::ctrl),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]
    #[test]
    fn no_key_and_no_size_makes_it_fail(
        keys in prop::collection::vec(any_key(), 0..25), width in 0_u16..130, height in 0_u16..50, ascii: bool,
    ) {
        drawn(&crowded(), themes()[usize::from(ascii)], &keys, width, height);
    }
}
