use proptest::prelude::*;

use super::*;
use crate::session::journal::FindingCause;
use crate::session::plan::PoseKind;
use crate::session::set_up::Step;
use crate::tui::dialog::DialogOutcome;
use crate::tui::screen::bench::{drawn, leaks, paste, press, shown, themes, view};
use crate::wizard::view::{
    DriftView, FindingView, JointShown, LivePoint, LiveView, MeasuredRow, MoveCheck, PairView, PredictionView,
    ProposedPointView, ProposedState, ProposedView, SampleView,
};
use crate::wizard::{IntentInfo, Notice};

fn joints() -> Vec<JointShown> {
    let values = [-12.345, 48.0, -117.25, 179.999, -90.5, 0.0];
    let joint = |(number, value): (usize, f64)| JointShown {
        name: format!("J{number}"),
        value,
        unit: "deg".to_owned(),
        moves: if number == 4 { 121.4 } else { 12.0 },
        moves_most: number == 4,
    };
    (1..).zip(values).map(joint).collect()
}

fn rows() -> Vec<RowView> {
    let row = |row: usize| RowView {
        row,
        pose: row.to_string(),
        kind: if row > 30 { PoseKind::Verification } else { PoseKind::Identification },
        state: match row {
            5 => RowState::Skipped,
            7 => RowState::LeftOut,
            1..=14 => RowState::Measured,
            _ => RowState::Open,
        },
        measured: (row < 15 && row != 5).then(|| MeasuredRow {
            fit_mm: (row < 10).then_some(0.01 * ((row * 7) % 10) as f64),
            shots: 3,
            time: format!("09:{row:02}"),
            sample: SampleView {
                measurement: row as u64,
                pose: row.to_string(),
                xyz_mm: [1234.5678, -345.6789, 987.6543],
                scatter_mm: Some(0.004),
                counts: row != 7,
            },
            findings: Vec::new(),
            earlier: usize::from(row == 4),
        }),
        joints: vec![-12.345, 48.0, -117.25, 179.999, -90.5, 0.0],
        notes: if row == 3 { vec!["cable touched the arm".to_owned()] } else { Vec::new() },
    };
    (1..=40).map(row).collect()
}

fn normal() -> CaptureView {
    CaptureView {
        row: Some(15),
        pose: Some("15".to_owned()),
        kind: Some(PoseKind::Identification),
        joints: joints(),
        on_the_way: Vec::new(),
        move_check: MoveCheck::Free { from: "pose 14".to_owned() },
        predicted_point_in_base_mm: None,
        measured: 12,
        open: 26,
        skipped: 1,
        identification: 12,
        verification: 0,
        minutes_left: Some(38.4),
        last: Some(SampleView {
            measurement: 16,
            pose: "14".to_owned(),
            xyz_mm: [1234.5678, -345.6789, 987.6543],
            scatter_mm: Some(0.008),
            counts: true,
        }),
        held: None,
        finding: None,
        drift: vec![DriftView { pose: "1".to_owned(), measurement: 13, moved_mm: 0.004 }],
        prediction: Some(PredictionView {
            curve_mm: (9..=12).map(|n| (n, 0.3 / n as f64)).collect(),
            now_mm: 0.0250,
            with_all_mm: Some(0.0120),
            limit_mm: Some(0.04),
            open: 6,
            is_enough: false,
        }),
        typed_unit: None,
        too_few: None,
        rows: rows(),
        expected: None,
        fit_is_nominal: false,
        proposed: None,
        notes: vec![(Some("3".to_owned()), "cable touched the arm".to_owned())],
        refused: vec![("6".to_owned(), "the beam was interrupted".to_owned())],
    }
}

fn offers(content: &CaptureView) -> Vec<IntentInfo> {
    let no = |is: bool| is.then(|| "not now".to_owned());
    let (asked, manual) = (content.finding.is_some(), content.typed_unit.is_some());
    let none = content.pose.is_none();
    let measure = IntentInfo::new(Intent::Measure, "measure").unless(no(asked || manual || none));
    let type_in = IntentInfo::new(Intent::TypeReading(String::new()), "type the coordinates")
        .unless(no(!manual || (none && !asked)));
    vec![
        measure.default_action(),
        if manual { type_in.default_action() } else { type_in },
        IntentInfo::new(Intent::AcceptReading, "accept the reading").unless(no(content.held.is_none())),
        IntentInfo::new(Intent::MeasureAgain, "measure again").unless(no(!asked || manual)).default_action(),
        IntentInfo::new(Intent::Keep, "keep the sample").unless(no(!asked)),
        IntentInfo::new(Intent::LeaveOut, "exclude this sample").unless(no(!asked)),
        IntentInfo::new(Intent::ApplyRemedy, "apply the correction").unless(no(!asked)),
        IntentInfo::new(Intent::Skip, "skip this pose").unless(no(none || asked)),
        IntentInfo::new(Intent::Undo, "undo the last sample"),
        IntentInfo::new(Intent::GoToPose(String::new()), "go to another pose"),
        IntentInfo::new(Intent::Note(String::new()), "write a note"),
        IntentInfo::new(Intent::SuggestPoses(5), "add more poses"),
        IntentInfo::new(Intent::Next, "continue to Identify").unless(no(!none)).default_action(),
        IntentInfo::new(Intent::Quit, "quit"),
    ]
}

fn of(content: CaptureView) -> ViewModel {
    let intents = offers(&content);
    view(Step::Capture, Content::Capture(Box::new(content)), intents)
}

pub(crate) fn usual() -> ViewModel {
    of(normal())
}

pub(crate) fn in_question() -> ViewModel {
    let message = "pose 14 does not fit the other poses: its point fits pose 15; was the robot at another pose?";
    let mut view = of(CaptureView {
        row: Some(14),
        pose: Some("14".to_owned()),
        finding: Some(FindingView {
            pose: "14".to_owned(),
            measurement: 16,
            cause: FindingCause::WrongPose,
            message: message.to_owned(),
            has_remedy: true,
            worst: [(3, 1234.567, -3.125), (11, 987.654, 2.871), (1, 1502.9, 1.44), (9, 640.0, -0.903)]
                .map(|(pose, measured_mm, difference_mm)| PairView {
                    pose: pose.to_string(),
                    is_drift: pose == 1,
                    measured_mm,
                    predicted_mm: measured_mm - difference_mm,
                    difference_mm,
                    expected_mm: 0.41,
                })
                .to_vec(),
        }),
        ..normal()
    });
    view.notice = Some(Notice::attention(message));
    view
}

fn held() -> ViewModel {
    let reason = "the shots scatter by 0.412 mm, more than 0.080 mm";
    of(CaptureView { held: Some(reason.to_owned()), ..normal() })
}

fn all_measured() -> ViewModel {
    let mut content = CaptureView {
        row: None,
        pose: None,
        kind: None,
        joints: Vec::new(),
        on_the_way: Vec::new(),
        measured: 38,
        open: 0,
        ..normal()
    };
    if let Some(prediction) = &mut content.prediction {
        prediction.is_enough = true;
    }
    of(content)
}

fn manual() -> ViewModel {
    of(CaptureView { typed_unit: Some("in".to_owned()), ..normal() })
}

/// A stop on the way, reached by a free move.
fn on_the_way() -> ViewModel {
    let mut view = of(CaptureView { on_the_way: vec!["home".to_owned(), "via3".to_owned()], ..normal() });
    for info in &mut view.intents {
        info.is_default = false;
    }
    view.intents.push(IntentInfo::new(Intent::Passed, "the arm is there").default_action());
    view
}

/// A move that nobody has checked.
fn not_checked() -> ViewModel {
    let reason = "it is not known where the arm is now".to_owned();
    let mut view = of(CaptureView { move_check: MoveCheck::NotChecked { reason }, ..normal() });
    view.intents.push(IntentInfo::new(Intent::ThroughHome, "go through home"));
    view
}

/// A move that would hit something.
fn blocked() -> ViewModel {
    let obstruction = "link 3 would touch the floor".to_owned();
    of(CaptureView { move_check: MoveCheck::Blocked { from: "pose 14".to_owned(), obstruction }, ..normal() })
}

fn on(tab: Tab) -> CaptureScreen {
    CaptureScreen { tab, ..CaptureScreen::default() }
}

#[test]
fn states_at_80x24() {
    let [unicode, ascii] = themes();
    let go_to = on(Tab::GoTo);
    let usual = shown(&drawn(&go_to, &usual(), unicode, (80, 24)));
    insta::assert_snapshot!("normal", usual);
    for (name, view) in [
        ("in_question", in_question()),
        ("held", held()),
        ("all_measured", all_measured()),
        ("manual", manual()),
        ("on_the_way", on_the_way()),
        ("not_checked", not_checked()),
        ("blocked", blocked()),
    ] {
        let shown = shown(&drawn(&go_to, &view, unicode, (80, 24)));
        insta::assert_snapshot!(name, paint::differences(&usual, &shown));
    }
    let in_ascii = shown(&drawn(&go_to, &of(normal()), ascii, (80, 24)));
    insta::assert_snapshot!("normal_ascii", paint::differences(&usual, &in_ascii));
    insta::assert_snapshot!("smallest", shown(&drawn(&go_to, &in_question(), unicode, (60, 18))));
}

#[test]
fn other_views() {
    let [unicode, _] = themes();
    for (name, tab) in
        [("poses", Tab::Poses), ("prediction", Tab::Prediction), ("notes", Tab::Notes), ("picture", Tab::Picture)]
    {
        insta::assert_snapshot!(name, shown(&drawn(&on(tab), &of(normal()), unicode, (80, 24))));
    }
    let large = |view: &ViewModel| shown(&drawn(&on(Tab::GoTo), view, unicode, (120, 40)));
    insta::assert_snapshot!("large_question", paint::differences(&large(&usual()), &large(&in_question())));
    insta::assert_snapshot!("at_100x24", shown(&drawn(&on(Tab::GoTo), &of(normal()), unicode, (100, 24))));
}

/// The tracker sees the SMR, which has come to rest; the robot stands a little off.
fn live() -> ViewModel {
    let track = (0..50).map(|index| {
        let seconds = f64::from(index) / 10.0 - 4.9;
        LivePoint { seconds, offset_mm: if seconds < -2.5 { 0.4 * (-2.5 - seconds) } else { 0.004 } }
    });
    let seen = LiveView {
        point_mm: Some([1234.567, -345.678, 987.654]),
        is_blind: false,
        silent_s: None,
        rest_s: Some(2.5),
        scatter_mm: Some(0.004),
        from_predicted_mm: Some(7.25),
        joints: Some(vec![0.0; 6]),
        joints_shown: Vec::new(),
        flange_in_base_mm: None,
        smr_in_base_mm: None,
        joint_difference: Some((3, 0.062)),
        is_still: Some(true),
        at_pose: None,
        down: None,
        track: track.collect(),
    };
    ViewModel { live: Some(seen), ..of(normal()) }
}

#[test]
fn what_the_instrument_sees_is_shown() {
    let [unicode, ascii] = themes();
    let page = |tab: Tab, view: &ViewModel| shown(&drawn(&on(tab), view, unicode, (80, 24)));
    let usual_live = page(Tab::Live, &live());
    insta::assert_snapshot!("live", usual_live);
    insta::assert_snapshot!("live_ascii", shown(&drawn(&on(Tab::Live), &live(), ascii, (60, 20))));
    insta::assert_snapshot!("live_go_to", paint::differences(&page(Tab::GoTo, &usual()), &page(Tab::GoTo, &live())));
    let mut lost = live();
    if let Some(live) = &mut lost.live {
        (live.point_mm, live.down) = (None, Some("the other end has closed the connection".to_owned()));
        live.track.clear();
    }
    insta::assert_snapshot!("live_lost", paint::differences(&usual_live, &page(Tab::Live, &lost)));
    insta::assert_snapshot!("live_none", paint::differences(&usual_live, &page(Tab::Live, &usual())));
}

/// A metre taken for a millimetre: the columns stay apart.
#[test]
fn distances_that_are_far_off_stay_apart() {
    let mut view = in_question();
    let Content::Capture(capture) = &mut view.content else { panic!("not capturing") };
    let finding = capture.finding.as_mut().unwrap();
    let pair = &mut finding.worst[0];
    (pair.measured_mm, pair.predicted_mm, pair.difference_mm) = (1_083_586.953, 100_569.228, 983_017.725);
    let drawn = shown(&drawn(&on(Tab::GoTo), &view, themes()[0], (80, 24)));
    let row = drawn.lines().find(|line| line.contains("pose 3 ")).unwrap();
    let words: Vec<&str> = row.split_whitespace().collect();
    assert_eq!(words, ["pose", "3", "1083586.953", "100569.228", "983017.725", "too", "long", "0.410"], "{drawn}");
}

#[test]
fn digits_and_paste_open_the_question_for_coordinates() {
    let view = manual();
    let mut screen = on(Tab::GoTo);
    let ScreenOutcome::Open(mut dialog) = press(&mut screen, &view, Key::char('1')) else { panic!("no question") };
    dialog.paste("0.5 20 30");
    let answer = dialog.on_key(Key::plain_code(KeyCode::Enter));
    assert_eq!(answer, DialogOutcome::Submitted(Intent::TypeReading("10.5 20 30".to_owned())));
    let ScreenOutcome::Open(mut dialog) = paste(&mut screen, &view, " 1.5\t2\t3\n") else { panic!("no question") };
    let answer = dialog.on_key(Key::plain_code(KeyCode::Enter));
    assert_eq!(answer, DialogOutcome::Submitted(Intent::TypeReading("1.5 2 3".to_owned())));
    // An instrument that measures automatically takes no numbers.
    assert!(matches!(press(&mut screen, &of(normal()), Key::char('1')), ScreenOutcome::Ignored));
    assert!(matches!(paste(&mut screen, &of(normal()), "1 2 3"), ScreenOutcome::Ignored));
}

#[test]
fn coordinates_are_checked_as_they_are_typed() {
    // In inch, as the instrument of this session counts.
    let view = manual();
    let mut screen = on(Tab::GoTo);
    let ScreenOutcome::Open(mut dialog) = press(&mut screen, &view, Key::char('1')) else { panic!("no question") };
    let drawn = |dialog: &crate::tui::dialog::Dialog| {
        let mut buf = Buffer::empty(Rect::new(0, 0, 78, 10));
        dialog.draw(themes()[1], buf.area, &mut buf);
        shown(&buf)
    };
    for (text, reason) in [
        ("0.5 20", "found 2 numbers"),
        (" 30 mm", "the reading is in mm, but in was chosen"),
        ("000", "'10.5 20 30 mm000' is not a point"),
    ] {
        dialog.paste(text);
        assert!(drawn(&dialog).contains(reason), "{}", drawn(&dialog));
        assert_eq!(dialog.on_key(Key::plain_code(KeyCode::Enter)), DialogOutcome::Open);
    }
    for _ in 0..6 {
        dialog.on_key(Key::plain_code(KeyCode::Backspace));
    }
    assert!(!drawn(&dialog).contains("not"), "{}", drawn(&dialog));
    let answer = dialog.on_key(Key::plain_code(KeyCode::Enter));
    assert_eq!(answer, DialogOutcome::Submitted(Intent::TypeReading("10.5 20 30".to_owned())));
    // The key of the table asks the same.
    let offer = view.intents.iter().find(|info| matches!(info.intent, Intent::TypeReading(_))).unwrap();
    let asked = crate::tui::dialog::Dialog::before(offer, &view).unwrap();
    assert!(drawn(&asked).starts_with("Coordinates x y z of the SMR at pose 15 (in)"), "{}", drawn(&asked));
}

#[test]
fn a_pose_is_chosen_from_the_list() {
    let view = of(normal());
    let mut screen = on(Tab::GoTo);
    assert!(matches!(press(&mut screen, &view, Key::plain_code(KeyCode::Enter)), ScreenOutcome::Ignored));
    assert!(matches!(press(&mut screen, &view, Key::plain_code(KeyCode::Tab)), ScreenOutcome::Changed));
    for _ in 0..2 {
        press(&mut screen, &view, Key::plain_code(KeyCode::Down));
    }
    match press(&mut screen, &view, Key::plain_code(KeyCode::Enter)) {
        ScreenOutcome::Intent(intent) => assert_eq!(intent, Intent::GoToPose("17".to_owned())),
        reply => panic!("{reply:?}"),
    }
    assert_eq!(screen.tab, Tab::GoTo);
    press(&mut screen, &view, Key::plain_code(KeyCode::BackTab));
    assert_eq!(screen.tab, Tab::Picture);
    // There the arrows turn the picture.
    assert!(matches!(press(&mut screen, &view, Key::plain_code(KeyCode::Up)), ScreenOutcome::Ignored));
}

/// The list: the pose under the cursor is excluded, counts again, gets a note; lines that are pasted are looked at first.
#[test]
fn the_list_decides_about_the_pose_under_the_cursor() {
    let view = of(normal());
    let mut screen = on(Tab::Poses);
    for _ in 0..20 {
        press(&mut screen, &view, Key::plain_code(KeyCode::Up));
    }
    for _ in 0..3 {
        press(&mut screen, &view, Key::plain_code(KeyCode::Down));
    }
    let does = |screen: &mut CaptureScreen, key| match press(screen, &view, Key::char(key)) {
        ScreenOutcome::Intent(intent) => intent,
        reply => panic!("{reply:?}"),
    };
    assert_eq!(does(&mut screen, 'x'), Intent::Exclude("4".to_owned()));
    insta::assert_snapshot!("poses_detail", shown(&drawn(&screen, &view, themes()[0], (80, 24))));
    let ScreenOutcome::Open(mut dialog) = press(&mut screen, &view, Key::char('w')) else { panic!("no question") };
    dialog.paste("warm");
    let note = Intent::NotePose { pose: "4".to_owned(), text: "warm".to_owned() };
    assert_eq!(dialog.on_key(Key::plain_code(KeyCode::Enter)), DialogOutcome::Submitted(note));
    for _ in 0..3 {
        press(&mut screen, &view, Key::plain_code(KeyCode::Down));
    }
    assert_eq!(does(&mut screen, 'x'), Intent::Include("7".to_owned()));
    assert_eq!(does(&mut screen, 'r'), Intent::GoToPose("7".to_owned()));
    let view = manual();
    let lines = "1 2 3\n4 5 6";
    match paste(&mut on(Tab::GoTo), &view, lines) {
        ScreenOutcome::Intent(intent) => assert_eq!(intent, Intent::ShowPoints(lines.to_owned())),
        reply => panic!("{reply:?}"),
    }
}

#[test]
fn points_are_listed_with_what_the_checks_say() {
    let point = |number: usize, state, message: Option<&str>| ProposedPointView {
        name: (number < 3).then(|| format!("P{number}")),
        pose: Some((14 + number).to_string()),
        xyz_mm: [1234.5678 + number as f64, -345.6789, 987.6543],
        state,
        message: message.map(str::to_owned),
    };
    let proposed = ProposedView {
        source: "'tracker.csv'".to_owned(),
        points: vec![
            point(1, ProposedState::Fits, None),
            point(2, ProposedState::InQuestion, Some("the reading of pose 16 is bad; measure it again")),
            point(3, ProposedState::Impossible, Some("the reading is 0, 0, 0: the instrument has no target")),
        ],
    };
    let view = of(CaptureView { proposed: Some(proposed), ..normal() });
    insta::assert_snapshot!("proposed", shown(&drawn(&on(Tab::GoTo), &view, themes()[0], (80, 24))));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(96))]
    #[test]
    fn nothing_is_drawn_outside(
        x in 0_u16..60, y in 0_u16..30, width in 0_u16..140, height in 0_u16..50,
        tab in 0_usize..5, state in 0_usize..8, ascii: bool,
    ) {
        let view = [|| of(normal()), in_question, held, all_measured, manual, on_the_way, not_checked, blocked][state]();
        let theme = themes()[usize::from(ascii)];
        prop_assert!(!leaks(&on(Tab::ALL[tab].0), &view, theme, Rect::new(x, y, width, height)));
    }
}
