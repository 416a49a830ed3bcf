use proptest::prelude::*;

use super::*;
use crate::planning::{Figures, ObservabilityIndices, Score, Spread, Yardstick};
use crate::session::journal::PlanText;
use crate::session::plan_summary::{
    CandidateSummary, JointGapSummary, PlanSummary, RejectionSummary, SCHEMA, TimeSummary, TradeOffSummary,
    WeakParameterSummary,
};
use crate::session::set_up::Step;
use crate::session::summary::{Provenance, Warning, WarningCode};
use crate::tui::screen::bench::{drawn, leaks, press, shown, themes, view};
use crate::wizard::IntentInfo;
use crate::wizard::view::{BusyView, PlanFigures};

fn summary() -> PlanSummary {
    let option = |poses: usize| TradeOffSummary {
        poses,
        predicted_error_sigma: 5.0 / (poses as f64).sqrt(),
        predicted_rms_mm: Some(0.075 / (poses as f64).sqrt()),
        predicted_level3_rms_mm: None,
        time_min: Some(1.9 * poses as f64 + 40.0),
    };
    let provenance = Provenance {
        program: "trupose".to_owned(),
        created: "2026-01-05T10:00:00Z".to_owned(),
        profile: "soochow".to_owned(),
        robot: "Soochow".to_owned(),
        profile_sha256: String::new(),
        inputs: Vec::new(),
        serial: String::new(),
        instrument_serial: String::new(),
    };
    PlanSummary {
        schema: SCHEMA,
        provenance,
        objective: None,
        warnings: vec![Warning::new(WarningCode::Weak, "the tracker sees only one side of the flange", false)],
        identification_poses: 56,
        verification_poses: 20,
        parameter_count: 25,
        score: Score {
            poses: 56,
            rank: 25,
            condition_number: 69.12,
            condition_number_raw: 812.0,
            observability: ObservabilityIndices { o1: 1.0, o2: 1.0, o3: 1.0, o4: 1.0, o5: 1.0 },
            predicted_error: 0.68,
            log_det: 1.0,
            precision: Vec::new(),
        },
        sigma_mm: Some(0.015),
        predicted_rms_mm: Some(0.0102),
        predicted_level3_rms_mm: None,
        joint_gaps: [("J1", 4.5), ("J5", 5.8)]
            .map(|(joint, largest_gap)| JointGapSummary {
                joint: joint.to_owned(),
                unit: "deg".to_owned(),
                largest_gap,
                from: 38.1,
                to: 38.1 + largest_gap,
                even_gap: 2.4,
            })
            .to_vec(),
        predicted_verification_rms_mm: Some(0.028),
        random: Yardstick {
            sets: 200,
            conditions: Spread { median: 131.4, best: 98.2 },
            errors: Spread { median: 0.91, best: 0.80 },
        },
        d_efficiency: 0.934,
        d_bound_gap: 0.001,
        search: Vec::new(),
        trade_off: (10..=100).step_by(4).map(option).collect(),
        weak_parameters: vec![WeakParameterSummary {
            name: "d2".to_owned(),
            unit: "mm".to_owned(),
            predicted_sigma: 0.912,
            expected: 1.0,
        }],
        blind_groups: vec!["theta1 and the angle of the tracker about z".to_owned()],
        candidates: CandidateSummary {
            tried: 9000,
            kept: 5000,
            rejections: vec![RejectionSummary { rule: "collision".to_owned(), rejected: 3000, alone: 1200 }],
        },
        time: Some(TimeSummary { total_min: 146.0, moving_min: 60.0, measuring_min: 86.0 }),
        poses: Vec::new(),
        elapsed_s: 12.0,
        interrupted: false,
        written: Vec::new(),
    }
}

fn figures() -> PlanFigures {
    PlanFigures {
        plan: PlanText {
            origin: "chosen among 5000 candidates, seed 1".to_owned(),
            condition_number: Some(69.12),
            predicted_error_sigma: Some(0.68),
            minutes: Some(146.0),
            search: Vec::new(),
            rows: Vec::new(),
        },
        identification: 56,
        verification: 20,
    }
}

fn nothing() -> PlanView {
    PlanView {
        program: None,
        settings: PlanSettings::default(),
        proposal: None,
        summary: None,
        accepted: None,
        left: 0,
        measured: 0,
    }
}

fn of(content: PlanView) -> ViewModel {
    let no = |is: bool| is.then(|| "not now".to_owned());
    let (has_proposal, has_plan) = (content.proposal.is_some(), content.accepted.is_some());
    let accept = IntentInfo::new(Intent::AcceptPlan, "measure this plan").unless(no(!has_proposal));
    let make = IntentInfo::new(Intent::MakePlan(content.settings), "choose poses");
    let next = IntentInfo::new(Intent::Next, "continue to Capture").unless(no(!has_plan));
    let intents = vec![
        accept.default_action(),
        if has_proposal || has_plan { make } else { make.default_action() },
        IntentInfo::new(Intent::LoadPlan("plan.csv".to_owned()), "load poses from a file"),
        IntentInfo::new(Intent::PlanFromRecording, "use the recorded poses").unless(no(true)),
        if has_proposal { next } else { next.default_action() },
        IntentInfo::new(Intent::Quit, "quit"),
    ];
    view(Step::Plan, Content::Plan(content), intents)
}

pub(in crate::tui::screen) fn proposal() -> ViewModel {
    of(PlanView { proposal: Some(figures()), summary: Some(Box::new(summary())), ..nothing() })
}

fn accepted() -> ViewModel {
    of(PlanView { accepted: Some(figures()), left: 64, measured: 12, ..nothing() })
}

pub(in crate::tui::screen) fn empty() -> ViewModel {
    of(nothing())
}

pub(in crate::tui::screen) fn searching(condition: f64) -> ViewModel {
    let mut view = of(nothing());
    for info in &mut view.intents {
        info.blocked = Some("planning is still running".to_owned());
    }
    view.intents.push(IntentInfo::new(Intent::Cancel, "stop planning"));
    view.busy = Some(BusyView {
        what: "planning",
        progress: Some(format!("choosing, start 2 of 3: condition {condition:.1}, predicted error 0.680 sigma")),
        part: Some(0.58),
        figures: Some(Figures { condition_number: condition, o1: 0.1, predicted_error: 0.68 }),
        is_cancelled: false,
    });
    view
}

/// A screen that has seen a view.
fn seen(view: &ViewModel) -> PlanScreen {
    let mut plan = PlanScreen::default();
    plan.see(view);
    plan
}

fn has_searched() -> (PlanScreen, ViewModel) {
    let mut plan = PlanScreen::default();
    for n in 1..40 {
        plan.see(&searching(60.0 + 100.0 / f64::from(n)));
    }
    (plan, searching(62.6))
}

#[test]
fn states_at_80x24() {
    let [unicode, ascii] = themes();
    let page = |view: &ViewModel| shown(&drawn(&seen(view), view, unicode, (80, 24)));
    let proposed = page(&proposal());
    insta::assert_snapshot!("proposal", proposed);
    insta::assert_snapshot!("empty", paint::differences(&proposed, &page(&of(nothing()))));
    insta::assert_snapshot!("accepted", paint::differences(&proposed, &page(&accepted())));
    let (plan, view) = has_searched();
    insta::assert_snapshot!("searching", shown(&drawn(&plan, &view, unicode, (80, 24))));
    let in_ascii = shown(&drawn(&seen(&proposal()), &proposal(), ascii, (80, 24)));
    insta::assert_snapshot!("proposal_ascii", paint::differences(&proposed, &in_ascii));
}

#[test]
fn other_views() {
    let [unicode, _] = themes();
    let view = proposal();
    for (name, tab) in [("trade_off", Tab::TradeOff), ("weak", Tab::Weak)] {
        insta::assert_snapshot!(name, shown(&drawn(&PlanScreen { tab, ..seen(&view) }, &view, unicode, (80, 24))));
    }
}

fn made(reply: &ScreenOutcome) -> Option<PlanSettings> {
    match reply {
        ScreenOutcome::Intent(Intent::MakePlan(settings)) => Some(*settings),
        _ => None,
    }
}

#[test]
fn settings_become_a_plan() {
    let view = of(nothing());
    let mut plan = seen(&view);
    let enter = Key::plain_code(KeyCode::Enter);
    assert_eq!(made(&press(&mut plan, &view, enter)), Some(PlanSettings::default()));
    // Typing replaces, + gives more, Down goes to the next.
    for key in ['2', '4', '+'] {
        assert!(matches!(press(&mut plan, &view, Key::char(key)), ScreenOutcome::Changed));
    }
    press(&mut plan, &view, Key::plain_code(KeyCode::Down));
    press(&mut plan, &view, Key::char('5'));
    let wanted = PlanSettings { poses: 28, verification: 5, ..PlanSettings::default() };
    assert_eq!(made(&press(&mut plan, &view, enter)), Some(wanted));
    assert_eq!(made(&press(&mut plan, &view, Key::char('p'))), Some(wanted));
    assert_eq!(made(&press(&mut plan, &view, Key::char('o'))), Some(PlanSettings { seed: 2, ..wanted }));
}

#[test]
fn enter_accepts_only_what_is_shown() {
    let view = proposal();
    let mut plan = seen(&view);
    let enter = Key::plain_code(KeyCode::Enter);
    // Nothing changed: the table's default, which accepts.
    assert!(matches!(press(&mut plan, &view, enter), ScreenOutcome::Ignored));
    press(&mut plan, &view, Key::char('-'));
    assert_eq!(made(&press(&mut plan, &view, enter)).map(|settings| settings.poses), Some(52));
    // While a search runs there is nothing to choose.
    let (mut plan, view) = has_searched();
    assert!(matches!(press(&mut plan, &view, enter), ScreenOutcome::Ignored));
}

#[test]
fn a_number_out_of_range_is_kept_in_it() {
    let view = of(nothing());
    let mut plan = seen(&view);
    for key in "9999".chars() {
        press(&mut plan, &view, Key::char(key));
    }
    assert!(shown(&drawn(&plan, &view, themes()[0], (80, 24))).contains("1 to 500"));
    assert_eq!(plan.form.settings().poses, 500);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(96))]
    #[test]
    fn nothing_is_drawn_outside(
        x in 0_u16..60, y in 0_u16..30, width in 0_u16..140, height in 0_u16..50,
        tab in 0_usize..4, state in 0_usize..4, ascii: bool,
    ) {
        let (plan, view) = match state {
            0 => (seen(&of(nothing())), of(nothing())),
            1 => (seen(&proposal()), proposal()),
            2 => (seen(&accepted()), accepted()),
            _ => has_searched(),
        };
        let plan = PlanScreen { tab: Tab::ALL[tab].0, ..plan };
        prop_assert!(!leaks(&plan, &view, themes()[usize::from(ascii)], Rect::new(x, y, width, height)));
    }
}
