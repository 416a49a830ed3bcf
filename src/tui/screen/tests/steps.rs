//! Every step as it usually is, while something is under way, and when something has gone wrong; the key ones at other sizes.

use super::*;
use crate::wizard::view::BusyView;

/// A view with the texts above it in a snapshot.
type Shown = (&'static str, ViewModel, Vec<Key>);

/// Something is under way.
fn busy(mut view: ViewModel, what: &'static str, progress: Option<&str>) -> ViewModel {
    view.busy =
        Some(BusyView { what, progress: progress.map(str::to_owned), part: None, figures: None, is_cancelled: false });
    for info in &mut view.intents {
        info.blocked.get_or_insert_with(|| format!("{what} is still running"));
    }
    view.intents.insert(0, IntentInfo::new(Intent::Cancel, format!("cancel {what}")));
    view
}

/// An entry is on its way to the disk.
fn saving(mut view: ViewModel) -> ViewModel {
    view.header.is_saving = true;
    view
}

fn said(mut view: ViewModel, notice: Notice) -> ViewModel {
    view.notice = Some(notice);
    view
}

fn states(step: Step) -> [Shown; 3] {
    let tab = |times| tabs(times);
    match step {
        Step::Profile => [
            ("normal", profile(true), vec![]),
            ("busy", busy(profile(false), "reading the profile", None), vec![]),
            (
                "error",
                said(
                    profile(false),
                    Notice::error(
                        "profile 'cell7.ron', line 12: joint 3: lower limit 90 deg is above upper limit -90 deg",
                    )
                    .hint("exchange the two, then load the file again"),
                ),
                vec![],
            ),
        ],
        Step::Instrument => {
            let chosen = Some("simulated cell, seed 1");
            let silent = Notice::error("the instrument at 192.168.0.12:700 does not answer")
                .hint("check cable and address, then press r");
            [
                ("normal", instrument(chosen, Some("simulated tracker, seed 1")), vec![]),
                ("busy", busy(instrument(chosen, None), "connecting", None), vec![]),
                ("error", said(instrument(chosen, None), silent), vec![]),
            ]
        }
        Step::Target => {
            let problem = CirclesView { problem: Some("the axes are parallel".to_owned()), ..circles(true) };
            [
                ("normal", target(Some("as the profile says"), None), vec![]),
                ("busy", busy(target(None, Some(circles(false))), "measuring", None), vec![]),
                ("error", target(None, Some(problem)), vec![]),
            ]
        }
        Step::Plan => {
            let notice =
                Notice::error("of 5000 candidates only 12 can be measured: the SMR faces away from the tracker")
                    .hint("turn the SMR on the flange, or move the tracker, and say so in the profile");
            [
                ("normal", plan::tests::proposal(), vec![]),
                ("busy", plan::tests::searching(69.1), vec![]),
                ("error", said(plan::tests::empty(), notice), vec![]),
            ]
        }
        Step::Capture => {
            let notice = Notice::error("pose 15: the beam was interrupted").hint("clear the view, then measure again");
            [
                ("normal", capture::tests::usual(), vec![]),
                ("busy", busy(capture::tests::usual(), "measuring", None), vec![]),
                ("error", said(capture::tests::usual(), notice), vec![]),
            ]
        }
        Step::Identify => {
            let progress = Some("cost 2.134500e3, largest change 1.2e-3 expected deviations");
            [
                ("normal", identify(Some(summary(true)), true), vec![]),
                ("busy", busy(identify(None, false), "identifying", progress), vec![]),
                ("error", failed(identify(Some(summary(false)), false)), tab(2)),
            ]
        }
        Step::Verify => [
            ("normal", verify(Some(verdict(VerdictStatus::Accepted))), vec![]),
            ("busy", saving(verify(Some(verdict(VerdictStatus::Accepted)))), tab(2)),
            ("error", verify(Some(verdict(VerdictStatus::NotAccepted))), vec![]),
        ],
        Step::Deliver => {
            let full = Notice::error("report.json cannot be written: no space left on device")
                .hint("make room, then press Enter again; what was measured is safe");
            [
                ("normal", deliver(&FILES), vec![]),
                ("busy", busy(deliver(&[]), "writing files", None), vec![]),
                ("error", said(deliver(&[]), full), vec![]),
            ]
        }
    }
}

/// The terminal, with a robot where the step shows one.
fn terminal(view: &ViewModel, keys: &[Key], size: (u16, u16), theme: Theme) -> String {
    let mut ui = Ui::new(theme);
    ui.refresh(view, &Session::default());
    if view.header.step != Step::Deliver {
        ui.put_scene(checked());
    }
    for key in keys {
        ui.on_input(crate::tui::input::Input::Key(*key), view);
    }
    let mut buffer = Buffer::empty(Rect::new(0, 0, size.0, size.1));
    ui.draw(view, buffer.area, &mut buffer);
    paint::snapshot(&buffer)
}

#[test]
fn every_step_in_every_state_at_80x24() {
    for &step in Step::ALL {
        let [normal, busy, error] = states(step).map(|(_, view, keys)| terminal(&view, &keys, SMALL, theme(false)));
        let (busy, error) = (paint::differences(&normal, &busy), paint::differences(&normal, &error));
        insta::assert_snapshot!(
            format!("step_{}_{}", step.number(), step.to_string().to_lowercase()),
            format!("{normal}\n== busy\n{busy}\n== error\n{error}")
        );
    }
}

#[test]
fn key_screens_at_other_sizes() {
    for step in [Step::Plan, Step::Capture, Step::Identify, Step::Verify, Step::Deliver] {
        let [(_, view, _), ..] = states(step);
        let [small, large, huge] =
            [(60, 20), (120, 40), (200, 50)].map(|size| terminal(&view, &[], size, theme(false)));
        insta::assert_snapshot!(
            format!("sizes_{}", step.to_string().to_lowercase()),
            format!("== 60x20\n{small}\n== 120x40\n{large}")
        );
        // More room leaves nothing out, and needs no scrolling.
        let lines = large.lines().filter(|line| !line.contains("more lines: PgDn"));
        for word in lines.flat_map(str::split_whitespace).filter(|word| word.chars().all(char::is_alphanumeric)) {
            assert!(huge.contains(word), "{step}: '{word}' is missing:\n{huge}");
        }
    }
}

#[test]
fn no_size_is_too_small_for_any_state() {
    for &step in Step::ALL {
        for (name, view, keys) in states(step) {
            for size in [(0, 0), (1, 1), (0, 24), (80, 0), (59, 18), (60, 17)] {
                let shown = terminal(&view, &keys, size, theme(true));
                assert!(!shown.contains("step "), "{step}, {name}, {size:?}: {shown}");
            }
        }
    }
}

#[test]
fn the_picture_is_turned_only_where_it_is_seen() {
    let has_hint = |step: Step, keys: &[Key], size| {
        let [(_, view, _), ..] = states(step);
        let shown = terminal(&view, keys, size, theme(false));
        (shown.contains("turn the picture"), shown.contains("←↑↓→ turn"))
    };
    let wide = (160, 50);
    assert_eq!(has_hint(Step::Capture, &[], SMALL), (false, false));
    assert_eq!(has_hint(Step::Capture, &tabs(5), SMALL), (true, true));
    assert_eq!(has_hint(Step::Capture, &[], wide), (true, true));
    // Up and Down choose in the list of poses.
    assert_eq!(has_hint(Step::Capture, &tabs(1), wide), (true, false));
    assert_eq!(has_hint(Step::Plan, &[], wide), (false, false));
    assert_eq!(has_hint(Step::Plan, &tabs(3), SMALL), (true, true));
    assert_eq!(has_hint(Step::Verify, &[], SMALL), (false, false));
    assert_eq!(has_hint(Step::Verify, &tabs(3), SMALL), (true, true));
    assert_eq!(has_hint(Step::Instrument, &[], wide), (true, false));
    assert_eq!(has_hint(Step::Deliver, &[], wide), (false, false));
}

#[test]
fn the_focus_of_a_list_stays_in_view() {
    for (view, last) in [(target(None, None), "joint check"), (instrument(None, None), "recorded measurements")] {
        for count in 0..7 {
            let shown = terminal(&view, &vec![Key::plain_code(KeyCode::Down); count], (60, 18), theme(true));
            let focus =
                shown.lines().find(|line| line.starts_with(" > ")).unwrap_or_else(|| panic!("{count}: {shown}"));
            assert!(count < 5 || focus.contains(last), "{count}: {shown}");
        }
    }
}
