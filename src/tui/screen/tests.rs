//! The screens of the steps around planning and measuring: what they show and what their keys mean.

use std::sync::LazyLock;

use crossterm::event::KeyCode;
use nalgebra::{Point3, Vector3};
use proptest::prelude::*;

use super::*;
use crate::identification::{Estimator, Prior, SigmaSource, TerminationReason, Weighting};
use crate::kinematics::{ParameterId, ParameterUnit};
use crate::profile::{Level, Profile, builtin};
use crate::session::about::About;
use crate::session::set_up::{CoordinateUnit, InstrumentChoice, TargetChoice};
use crate::session::state::Session;
use crate::session::summary::Verdict;
use crate::session::summary::{
    AxisSummary, BlindGroupSummary, CandidateSummary, Cause, IdentificationSettings, IdentificationSummary, JointBin,
    JointErrorSummary, JointSummary, LimitCheck, LimitedQuantity, ModelSummary, ParameterSummary, Provenance, Refit,
    RejectedSummary, SelectionSummary, ShareSummary, SigmaSummary, StatisticsSummary, VerdictStatus, VerificationMode,
    VerificationSummary, Warning, WarningCode, WorkspaceSummary,
};
use crate::session::wire::KnownLinks;
use crate::tui::glyphs::Glyphs;
use crate::tui::paint;
use crate::tui::preview::VerifiedPoint;
use crate::tui::ui::{Command, Ui};
use crate::wizard::view::purpose;
use crate::wizard::view::{
    CircleView, CirclesResult, CirclesView, Content, DeliverView, IdentifyView, InstrumentView, JointShown,
    ProfileCard, TargetView, VerifyView,
};
use crate::wizard::{IntentInfo, Notice, Wizard};

mod steps;

static SOOCHOW: LazyLock<Profile> = LazyLock::new(|| Profile::parse(builtin("soochow").unwrap(), "soochow").unwrap().0);

/// A view of a step with the offers that it has.
fn view(step: Step, content: Content, offers: Vec<IntentInfo>) -> ViewModel {
    let mut view = Wizard::new(jiff::Timestamp::UNIX_EPOCH).view();
    view.header.step = step;
    view.header.number = step.number();
    view.purpose = purpose(step);
    view.header.robot = Some(SOOCHOW.title().to_owned());
    view.header.session = Some("demo".to_owned());
    view.header.folder = Some("/home/op/sessions/demo".to_owned());
    view.header.folder_from_root = view.header.folder.clone();
    view.content = content;
    view.intents = offers;
    view.intents.push(IntentInfo::new(Intent::Quit, "quit"));
    if step != Step::Profile {
        view.intents.push(IntentInfo::new(Intent::Back, "back"));
    }
    view
}

fn profile(has_card: bool) -> ViewModel {
    let mut view = Wizard::new(jiff::Timestamp::UNIX_EPOCH).view();
    let Content::Profile(content) = &mut view.content else { panic!() };
    if has_card {
        content.chosen = Some(ProfileCard {
            name: "soochow".to_owned(),
            title: SOOCHOW.title().to_owned(),
            source: SOOCHOW.source().to_owned(),
            joints: ["J1", "J2", "J3", "J4", "J5", "J6"].map(str::to_owned).to_vec(),
            free_parameters: 25,
            instrument: Some("Leica AT901-B".to_owned()),
            target_mm: Some([-1.473, 26.384, 71.991]),
            flange_at_zero_mm: [1065.0, 0.0, 1424.0],
            profile: None,
            warnings: vec!["no bodies for link 3: \u{1b}[31m".to_owned()],
        });
        content.session = "soochow-20260105-0800".to_owned();
        view.intents = vec![IntentInfo::new(Intent::Next, "use this robot").default_action()];
    }
    view
}

fn instrument(choice: Option<&str>, identity: Option<&str>) -> ViewModel {
    let content = Content::Instrument(InstrumentView {
        link: None,
        known: KnownLinks::default(),
        choice: choice.map(str::to_owned),
        identity: identity.map(str::to_owned),
        recorded_poses: 0,
        stated_sigma: Some("Leica AT901-B: 0.015 mm + 6 um/m (one sigma)".to_owned()),
        cell: None,
    });
    let proposal = InstrumentChoice::Manual { unit: CoordinateUnit::Millimetre };
    let wait = identity.is_none().then(|| "the instrument does not answer yet".to_owned());
    let offers = vec![
        IntentInfo::new(Intent::Next, "use this instrument").unless(wait).default_action(),
        IntentInfo::new(Intent::ChooseInstrument(proposal), "choose an instrument"),
        IntentInfo::new(Intent::Retry, "reconnect").unless(identity.map(|_| "it answers".to_owned())),
    ];
    view(Step::Instrument, content, offers)
}

fn target(choice: Option<&str>, circles: Option<CirclesView>) -> ViewModel {
    let is_complete = circles.as_ref().is_some_and(|circles| circles.result.is_some());
    let content = Content::Target(Box::new(TargetView {
        nominal_mm: [-1.473, 26.384, 71.991],
        nominal_sigma_mm: 0.5,
        choice: choice.map(str::to_owned),
        payload: None,
        circles,
        joint_check: None,
        advises_joint_check: false,
    }));
    let unusable = (!is_complete).then(|| "the circles are not complete".to_owned());
    let offers = vec![
        IntentInfo::new(Intent::ChooseTarget(TargetChoice::Profile), "as the profile says").default_action(),
        IntentInfo::new(Intent::ChooseTarget(TargetChoice::Free { sigma_mm: 50.0 }), "leave it free"),
        IntentInfo::new(Intent::StartCircles, "find it by circles"),
        IntentInfo::new(Intent::UseCircles, "use the result of the circles").unless(unusable),
    ];
    view(Step::Target, content, offers)
}

fn circles(is_complete: bool) -> CirclesView {
    let joint = |name: &str, value: f64, moves_most: bool| JointShown {
        name: name.to_owned(),
        value,
        unit: "deg".to_owned(),
        moves: 0.0,
        moves_most,
    };
    let fit = |name: &str, radius_mm: f64| CircleView {
        joint: name.to_owned(),
        points: 6,
        centre_mm: [1234.5678, -345.6789, 890.1234],
        axis: [0.0, 0.0, 1.0],
        radius_mm,
        residual_rms_mm: 0.0123,
        arc_deg: 300.0,
    };
    CirclesView {
        joint: (!is_complete).then(|| "J6".to_owned()),
        joints: if is_complete {
            Vec::new()
        } else {
            vec![
                joint("J1", 0.0, false),
                joint("J2", 11.459, false),
                joint("J3", -11.459, false),
                joint("J4", 17.189, false),
                joint("J5", 34.377, false),
                joint("J6", -120.0, true),
            ]
        },
        measured: if is_complete { 12 } else { 3 },
        of: 12,
        fits: if is_complete { vec![fit("J6", 26.425), fit("J5", 159.327)] } else { Vec::new() },
        arm: None,
        result: is_complete.then_some(CirclesResult {
            xyz_mm: [-1.4712, 26.3821, 71.9903],
            sigma_mm: [0.0051, 0.0049, 0.0112],
            residual_rms_mm: 0.0118,
        }),
        problem: None,
        typed_unit: None,
    }
}

fn parameter(name: &str, deviation: f64, sigma: Option<f64>, identifiable: bool) -> ParameterSummary {
    let id: ParameterId = name.parse().unwrap();
    let expected = if id.unit() == ParameterUnit::Millimetre { 1.0 } else { 0.114 };
    ParameterSummary { id, unit: id.unit(), nominal: 170.0, deviation, sigma, expected, identifiable }
}

fn verdict(status: VerdictStatus) -> Verdict {
    let is_met = status == VerdictStatus::Accepted;
    let check = |quantity, value: f64, limit_mm: f64| LimitCheck {
        quantity,
        value_mm: Some(value),
        interval_mm: Some([0.8 * value, 1.2 * value]),
        limit_mm,
        met: Some(value <= limit_mm),
    };
    Verdict {
        status,
        reasons: vec![
            if is_met { "both limits are met" } else { "position max is 1.2000 mm, allowed is 1.000 mm" }.to_owned(),
        ],
        undecided: Vec::new(),
        checks: vec![
            check(LimitedQuantity::PositionMean, 0.0103, 0.4),
            check(LimitedQuantity::PositionMax, if is_met { 0.0199 } else { 1.2 }, 1.0),
        ],
        advice: None,
    }
}

fn model(factor: f64) -> ModelSummary {
    let statistics = |count, mean: f64| StatisticsSummary {
        count,
        mean: factor * mean,
        rms: factor * 1.1 * mean,
        p95: factor * 1.6 * mean,
        max: factor * 2.4 * mean,
        mean_interval: Some([0.8 * factor * mean, 1.2 * factor * mean]),
        rms_interval: Some([0.9 * factor * mean, 1.3 * factor * mean]),
        max_interval: Some([1.6 * factor * mean, 2.4 * factor * mean]),
    };
    ModelSummary {
        position_mm: Some(statistics(20, 0.0103)),
        axis_mm: Some(AxisSummary { mean: [0.003 * factor; 3], max: [0.01 * factor; 3] }),
        distance_mm: Some(statistics(190, 0.0072)),
        seat_mm: None,
        orientation_mrad: None,
    }
}

fn verification() -> VerificationSummary {
    let joint = |name: &str, explained: f64| JointSummary {
        joint: name.to_owned(),
        unit: "deg".to_owned(),
        explained,
        bins: (0..5)
            .map(|n: u8| JointBin {
                from: -80.0 + 32.0 * f64::from(n),
                to: -48.0 + 32.0 * f64::from(n),
                count: usize::from(n),
                mean_mm: 0.004 + 0.003 * f64::from(n),
            })
            .collect(),
    };
    VerificationSummary {
        samples: 20,
        poses: 20,
        left_out: 0,
        basis: "the verification poses of this session, same set-up".to_owned(),
        independent: true,
        refit: Refit::None,
        nominal: model(980.0),
        identified: model(1.0),
        residual_by_joint: vec![joint("J1", 0.05), joint("J2", 0.62), joint("J3", 0.0)],
    }
}

fn warning(blocks_acceptance: bool) -> Warning {
    let message = "the verification poses cover 40 % of the range of J4: nothing is said about the rest of it";
    Warning::new(WarningCode::FewData, message, blocks_acceptance)
}

fn summary(is_good: bool) -> IdentificationSummary {
    let created = "2026-01-05T08:13:04Z".to_owned();
    IdentificationSummary {
        schema: 1,
        provenance: Provenance {
            program: "trupose 0.1.0".to_owned(),
            created,
            profile: "soochow".to_owned(),
            robot: SOOCHOW.title().to_owned(),
            profile_sha256: String::new(),
            inputs: Vec::new(),
            serial: String::new(),
            instrument_serial: String::new(),
        },
        settings: IdentificationSettings {
            level: Level::Geometric,
            weighting: Weighting::Covariance,
            prior: Prior::Expected,
            estimator: Estimator::Robust,
            iterations: 50,
            filter: None,
            expected_length_mm: None,
            expected_angle_deg: None,
            layout: None,
            socket_distance_mm: None,
            socket_distance_sigma_mm: None,
            verification: VerificationMode::Session,
        },
        warnings: if is_good { Vec::new() } else { vec![warning(true), warning(false)] },
        verdict: verdict(VerdictStatus::Accepted),
        verification: None,
        samples: 56,
        parameter_count: 25,
        rank: is_good.then_some(21),
        singular_value_gap: 3e7,
        condition_number: Some(167.8),
        condition_number_mm_rad: Some(1433.0),
        condition_number_points: 56,
        sigma: SigmaSummary {
            used_mm: 0.00577,
            source: SigmaSource::Readings,
            from_residuals_mm: Some(0.00592),
            instrument_mm: None,
            shots_mm: None,
            poses_mm: None,
        },
        parameters: (1..=6)
            .flat_map(|n| {
                [
                    parameter(&format!("a{n}"), -0.388_43, Some(0.0013), true),
                    parameter(&format!("d{n}"), 0.1, Some(0.7), true),
                    parameter(&format!("theta{n}"), -0.051_72, None, false),
                ]
            })
            .collect(),
        blind_groups: vec![BlindGroupSummary {
            parameters: vec!["d1".parse().unwrap()],
            blind: 1,
            description: "d1: cannot be found from distances, it only moves the robot's base frame".to_owned(),
        }],
        correlations: Vec::new(),
        rejected: if is_good {
            Vec::new()
        } else {
            vec![RejectedSummary {
                pose: "12".to_owned(),
                line: 12,
                residual_mm: 3.2,
                ratio: 420.0,
                reason: "it contradicts all others".to_owned(),
            }]
        },
        termination: TerminationReason::Converged,
        iterations: Vec::new(),
        selection: None,
        joint_errors: Vec::new(),
        workspace: None,
        features: Vec::new(),
        earlier: None,
        written: Vec::new(),
    }
}

fn identify(summary: Option<IdentificationSummary>, is_current: bool) -> ViewModel {
    let has_result = summary.is_some();
    let content = Content::Identify(IdentifyView {
        samples: 56,
        is_current,
        summary: summary.map(Box::new),
        is_usable: has_result,
    });
    let next = IntentInfo::new(Intent::Next, "continue to Verify");
    let offers = vec![IntentInfo::new(Intent::Identify, "identify the arm").default_action(), next];
    view(Step::Identify, content, offers)
}

fn verify(verdict: Option<Verdict>) -> ViewModel {
    let is_good = verdict.as_ref().is_some_and(|verdict| verdict.status == VerdictStatus::Accepted);
    let has_any = verdict.is_some();
    let content = Content::Verify(VerifyView {
        workspace: None,
        samples: if has_any { 20 } else { 0 },
        is_current: true,
        too_few: (!has_any).then(|| "there are no verification poses: nothing can be said about accuracy".to_owned()),
        verification: has_any.then(|| Box::new(verification())),
        verdict: verdict.map(Box::new),
        warnings: if is_good { Vec::new() } else { vec![warning(true)] },
    });
    view(Step::Verify, content, vec![IntentInfo::new(Intent::Next, "continue to Deliver").default_action()])
}

fn deliver(files: &[&str]) -> ViewModel {
    let content = Content::Deliver(DeliverView {
        files: files.iter().map(|file| (*file).to_owned()).collect(),
        left_out: Vec::new(),
        verdict: Some(Box::new(verdict(VerdictStatus::Accepted))),
        is_current: true,
        about: About { serial: "R-17".to_owned(), ..About::default() },
        corrected: Vec::new(),
    });
    let deliver = IntentInfo::new(Intent::Deliver, "write the files");
    view(Step::Deliver, content, vec![if files.is_empty() { deliver.default_action() } else { deliver }])
}

const FILES: [&str; 4] = ["plan.csv", "measurements.csv", "calibration.ron", "report.json"];

/// Twenty verification samples about the arm.
fn checked() -> Scene {
    let mut scene = Scene::at_rest(&SOOCHOW);
    for n in 0..20_u8 {
        let (sin, cos) = f64::from(n).sin_cos();
        let error = Vector3::new(sin, cos, 0.5) * (1.0 + 0.05 * f64::from(n));
        let at = Point3::new(0.9 + 0.3 * cos, 0.6 * sin, 0.5 + 0.04 * f64::from(n));
        scene.verified.push(VerifiedPoint {
            pose: format!("{}", n + 57),
            at,
            nominal: error * 0.01,
            identified: error * 1e-5,
        });
    }
    scene
}

fn theme(is_ascii: bool) -> Theme {
    Theme { has_colour: !is_ascii, glyphs: if is_ascii { Glyphs::Ascii } else { Glyphs::Unicode } }
}

/// The screen of a step after some keys, without frame.
fn drawn(view: &ViewModel, scene: Option<&Scene>, keys: &[Key], theme: Theme, (width, height): (u16, u16)) -> Buffer {
    let camera = Camera::default();
    let cx = ScreenCx { view, scene, camera: &camera, theme };
    let mut screen = of(view.header.step);
    for key in keys {
        screen.on_key(*key, &cx);
    }
    let mut buffer = Buffer::empty(Rect::new(0, 0, width + 4, height + 4));
    screen.draw(&cx, Rect::new(2, 2, width, height), &mut buffer);
    for y in 0..height + 4 {
        for x in 0..width + 4 {
            let is_inside = (2..2 + width).contains(&x) && (2..2 + height).contains(&y);
            assert!(is_inside || buffer[(x, y)].symbol() == " ", "drawn outside at {x}, {y}");
        }
    }
    screen.key_hints(&cx);
    buffer
}

/// The whole terminal after some keys.
fn whole(view: &ViewModel, keys: &[Key], (width, height): (u16, u16)) -> String {
    let mut ui = Ui::new(theme(false));
    ui.refresh(view, &Session::default());
    for key in keys {
        ui.on_input(crate::tui::input::Input::Key(*key), view);
    }
    let mut buffer = Buffer::empty(Rect::new(0, 0, width, height));
    ui.draw(view, buffer.area, &mut buffer);
    paint::snapshot(&buffer)
}

const SMALL: (u16, u16) = (80, 24);
const LARGE: (u16, u16) = (120, 40);

fn tabs(times: usize) -> Vec<Key> {
    vec![Key::plain_code(KeyCode::Tab); times]
}

fn failed(mut view: ViewModel) -> ViewModel {
    view.notice = Some(Notice::error("the file 'x.csv' has no units").hint("write q1_deg, x_mm and so on"));
    view
}

/// How the whole terminal differs from the usual one of the step after some keys; [`steps`] has the usual ones whole.
fn changed(usual: &ViewModel, view: &ViewModel, keys: &[Key]) -> String {
    paint::differences(&whole(usual, &[], SMALL), &whole(view, keys, SMALL))
}

#[test]
fn before_measuring_at_80x24() {
    let chosen = profile(true);
    insta::assert_snapshot!("profile_first", changed(&chosen, &profile(false), &[]));
    let search = [Key::char('c'), Key::char('u'), Key::char('r'), Key::plain_code(KeyCode::Down)];
    insta::assert_snapshot!("profile_search_error", changed(&chosen, &failed(profile(true)), &search));
    let answers = instrument(Some("simulated cell, seed 1"), Some("simulated tracker, seed 1"));
    insta::assert_snapshot!("instrument_first", changed(&answers, &instrument(None, None), &[]));
    let silent = failed(instrument(Some("recorded measurements: x.csv"), None));
    insta::assert_snapshot!("instrument_silent", changed(&answers, &silent, &[]));
    let down = |times| vec![Key::plain_code(KeyCode::Down); times];
    let enter = Key::plain_code(KeyCode::Enter);
    insta::assert_snapshot!("instrument_simulated", changed(&answers, &answers, &[down(3), vec![enter]].concat()));
    let wrong = [down(4), vec![enter, Key::char('a'), Key::plain_code(KeyCode::Down), Key::char('%'), enter]].concat();
    insta::assert_snapshot!("instrument_recorded_wrong", changed(&answers, &answers, &wrong));
    let known = target(Some("as the profile says"), None);
    insta::assert_snapshot!("target_first", changed(&known, &target(None, None), &[]));
    insta::assert_snapshot!("target_known", changed(&known, &known, &[Key::char('k')]));
    insta::assert_snapshot!("target_circles", changed(&known, &target(None, Some(circles(false))), &[]));
    let result = target(None, Some(circles(true)));
    insta::assert_snapshot!("target_result", changed(&known, &result, &[]));
    let problem = CirclesView { problem: Some("the axes are parallel".to_owned()), ..circles(true) };
    insta::assert_snapshot!("target_problem", changed(&result, &failed(target(None, Some(problem))), &[]));
}

#[test]
fn the_identification() {
    let good = identify(Some(summary(true)), true);
    insta::assert_snapshot!("identify_before", changed(&good, &identify(None, false), &[]));
    insta::assert_snapshot!("identify_parameters", changed(&good, &good, &tabs(1)));
    let bad = failed(identify(Some(summary(false)), false));
    insta::assert_snapshot!("identify_bad", changed(&good, &bad, &[]));
    insta::assert_snapshot!("identify_limits", changed(&bad, &bad, &tabs(3)));
    insta::assert_snapshot!("identify_large", whole(&good, &tabs(1), LARGE));
}

/// A result whose joints have errors: a large one that was measured in part, and none.
fn with_joint_errors() -> IdentificationSummary {
    let terms = |text: &str| text.parse().unwrap();
    let candidate = |text: &str, left_out_rms_mm: f64| CandidateSummary {
        terms: terms(text),
        left_out_rms_mm,
        residual_mm: left_out_rms_mm / 2.0,
    };
    let share = |cause, percent| ShareSummary { cause, percent };
    let kept = "geometry + compliance + tilt + harmonics + curves 100 urad";
    let joint = |name: &str, size: f64, compliance_urad| JointErrorSummary {
        joint: name.to_owned(),
        measured_deg: (-90.0, 120.0),
        compliance_urad,
        torque_nm: Some(153.0),
        curve_rms_urad: size / 2.0_f64.sqrt(),
        curve: (-90..=90)
            .map(|index| 2.0 * f64::from(index))
            .map(|value| (value, size * (5.0 * value.to_radians()).sin(), 20.0))
            .collect(),
    };
    IdentificationSummary {
        selection: Some(SelectionSummary {
            candidates: vec![
                candidate("geometry", 0.131),
                candidate("geometry + compliance", 0.104),
                candidate(kept, 0.079),
            ],
            kept: terms(kept),
            reason: "each group gains more than 2 %".to_owned(),
            nominal_rms_mm: 0.72,
            shares: vec![share(Cause::Geometry, 81.8), share(Cause::Gravity, 3.7), share(Cause::JointCurves, 3.5)],
            left_rms_mm: 0.079,
        }),
        joint_errors: vec![joint("J1", 380.0, None), joint("J2", 4.0, Some((129.4, 14.6)))],
        parameter_count: 26,
        parameters: summary(true)
            .parameters
            .into_iter()
            .chain([parameter("joint1.sin5", 380.0, Some(9.0), true)])
            .collect(),
        ..summary(true)
    }
}

#[test]
fn the_errors_of_the_joints() {
    let view = identify(Some(with_joint_errors()), true);
    let page = |width, is_ascii| paint::snapshot(&drawn(&view, None, &tabs(2), theme(is_ascii), (width, 20)));
    insta::assert_snapshot!("identify_joints", page(78, false));
    insta::assert_snapshot!("identify_joints_ascii", paint::differences(&page(78, false), &page(78, true)));
    assert!(page(150, false).contains("180 deg"));
    let parameters = whole(&view, &tabs(1), LARGE);
    assert!(!parameters.contains("joint1.sin5") && parameters.contains("theta6"), "{parameters}");
    let first = whole(&view, &[], LARGE);
    assert!(first.contains("geometry explains 82 %"), "{first}");
    assert!(parameters.contains("21 of 18 combinations"), "{parameters}");
}

#[test]
fn the_prediction_stands_beside_the_accuracy() {
    let mut view = verify(Some(verdict(VerdictStatus::Accepted)));
    let Content::Verify(content) = &mut view.content else { panic!() };
    content.workspace = Some(WorkspaceSummary {
        configurations: 400,
        rms_mm: 0.104,
        p95_mm: 0.163,
        max_mm: 0.3,
        beside_geometry_rms_mm: None,
    });
    let shown = whole(&view, &[], LARGE);
    assert!(shown.contains("predicted over the whole range of the joints: 0.10 mm rms, 0.16 mm at 95 %"), "{shown}");
}

#[test]
fn the_verification() {
    let accepted = verify(Some(verdict(VerdictStatus::Accepted)));
    insta::assert_snapshot!("verify_joints", changed(&accepted, &accepted, &tabs(2)));
    insta::assert_snapshot!("verify_none", changed(&accepted, &failed(verify(None)), &[]));
    let scene = checked();
    let page =
        |tab: usize, is_ascii| paint::snapshot(&drawn(&accepted, Some(&scene), &tabs(tab), theme(is_ascii), (78, 15)));
    insta::assert_snapshot!("verify_poses", page(1, false));
    insta::assert_snapshot!("verify_poses_ascii", paint::differences(&page(1, false), &page(1, true)));
    insta::assert_snapshot!("verify_picture", page(3, false));
    let before = [tabs(3), vec![Key::char('m')]].concat();
    let buffer = drawn(&accepted, Some(&scene), &before, theme(false), (78, 15));
    assert!(paint::snapshot(&buffer).contains("BEFORE: nominal arm's errors (m: identified)"));
}

#[test]
fn where_there_is_room_both_arms_have_one_scale() {
    let accepted = verify(Some(verdict(VerdictStatus::Accepted)));
    let scene = checked();
    let shown = paint::snapshot(&drawn(&accepted, Some(&scene), &tabs(3), theme(false), (118, 24)));
    assert!(shown.contains("BEFORE: nominal, largest ") && shown.contains("AFTER: identified, largest "), "{shown}");
    let times: Vec<&str> = shown.split("errors enlarged ").skip(1).filter_map(|rest| rest.split(' ').next()).collect();
    assert!(matches!(times[..], [one, other] if one == other), "{times:?} in\n{shown}");
    insta::assert_snapshot!("verify_pair", shown);
}

#[test]
fn the_delivery() {
    let written = deliver(&FILES);
    insta::assert_snapshot!("deliver_before", changed(&written, &deliver(&[]), &[]));
    insta::assert_snapshot!("deliver_error", changed(&deliver(&[]), &failed(deliver(&[])), &[]));
    let mut refused = deliver(&FILES);
    if let Content::Deliver(content) = &mut refused.content {
        let mut verdict = verdict(VerdictStatus::NotAccepted);
        verdict.reasons = ["poor_data", "few_data"].map(|code| format!("see the warning '{code}'")).to_vec();
        content.verdict = Some(Box::new(verdict));
    }
    insta::assert_snapshot!("deliver_refused", changed(&written, &refused, &[]));
    insta::assert_snapshot!("deliver_quit", changed(&written, &written, &[Key::plain_code(KeyCode::Enter)]));
}

/// What the last of some keys is worth.
fn pressed(view: &ViewModel, keys: &[KeyCode]) -> Command {
    let mut ui = Ui::new(theme(false));
    ui.refresh(view, &Session::default());
    let mut wish = Command::None;
    for code in keys {
        wish = ui.on_input(crate::tui::input::Input::Key(Key::plain_code(*code)), view);
    }
    wish
}

#[test]
fn keys_become_intents() {
    use KeyCode::{Char, Down, Enter, Esc, Up};
    let is =
        |view: &ViewModel, keys: &[KeyCode], intent: Intent| assert_eq!(pressed(view, keys), Command::Intent(intent));
    let robot = |name: &str| Intent::ChooseProfile(name.to_owned());
    is(&profile(false), &[Down, Down, Up, Enter], robot("abb_irb1600_6_145"));
    is(&profile(true), &[Enter], Intent::Next);
    is(&profile(true), &[Down, Enter], robot("staubli_tx2_60"));
    is(&profile(true), &[Down, Char('c'), Esc, Enter], Intent::Next);
    is(&profile(false), &[Char('/'), Char('q'), Esc, Char('f'), Char('p'), Enter], robot("p"));
    let by_hand = |unit| Intent::ChooseInstrument(InstrumentChoice::Manual { unit });
    is(&instrument(None, None), &[Enter], by_hand(CoordinateUnit::Millimetre));
    is(&instrument(None, None), &[Down, Down, Enter], by_hand(CoordinateUnit::Inch));
    is(&instrument(Some("x"), Some("y")), &[Enter], Intent::Next);
    is(&instrument(Some("x"), None), &[Char('r')], Intent::Retry);
    let simulated = pressed(&instrument(None, None), &[Down, Down, Down, Down, Enter, Enter]);
    assert!(
        matches!(simulated, Command::Intent(Intent::ChooseInstrument(InstrumentChoice::Simulated(_)))),
        "{simulated:?}"
    );
    is(&target(None, None), &[Enter], Intent::ChooseTarget(TargetChoice::Profile));
    is(&target(None, None), &[Down, Down, Enter], Intent::ChooseTarget(TargetChoice::Free { sigma_mm: 50.0 }));
    is(&target(None, None), &[Down, Down, Down, Enter], Intent::StartCircles);
    is(&target(None, None), &[Down, Down, Down, Down, Enter], Intent::StartWholeArm);
    is(&target(None, None), &[Down, Down, Down, Down, Down, Enter], Intent::StartJointCheck);
    let known = TargetChoice::Known { xyz_mm: (-1.473, 26.384, 71.991), sigma_mm: 0.1 };
    is(&target(None, None), &[Char('k'), Enter], Intent::ChooseTarget(known));
    is(&target(None, Some(circles(true))), &[Enter], Intent::UseCircles);
    is(&identify(None, false), &[Enter], Intent::Identify);
    is(&deliver(&[]), &[Enter], Intent::Deliver);
    is(&deliver(&FILES), &[Enter, Enter], Intent::Quit);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]
    #[test]
    fn nothing_is_drawn_outside_at_any_size(
        which in 0_usize..12, tab in 0_usize..4, down in 0_usize..6,
        width in 0_u16..210, height in 0_u16..60, is_ascii: bool, has_scene: bool,
    ) {
        let view = match which {
            0 => profile(false),
            1 => profile(true),
            2 => instrument(Some("x"), None),
            3 => target(None, None),
            4 => target(None, Some(circles(false))),
            5 => target(None, Some(circles(true))),
            6 => identify(None, false),
            7 => identify(Some(summary(false)), true),
            8 => verify(Some(verdict(VerdictStatus::NotAccepted))),
            9 => verify(None),
            10 => deliver(&[]),
            _ => deliver(&FILES),
        };
        let keys = [tabs(tab), vec![Key::plain_code(KeyCode::PageDown); down]].concat();
        let scene = has_scene.then(checked);
        drawn(&view, scene.as_ref(), &keys, theme(is_ascii), (width, height));
    }
}
