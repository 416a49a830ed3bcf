//! Every step: what it offers, what it does, what it shows.

use super::bench::{Bench, FOLDER, IDENTIFICATION, MANUAL, MEASURED, VERIFICATION, blocked, offers, started, texts};
use crate::procedure::models::Models;
use crate::session::corrected::{Points, ProgramChoice};
use crate::session::journal::Entry;
use crate::session::plan::PoseKind;
use crate::session::set_up::{InstrumentChoice, RecordedSet, Step, TargetChoice};
use crate::session::summary::VerdictStatus;
use crate::wizard::view::{Content, SessionCard};
use crate::wizard::{Activity, Answer, Event, Intent, PlanSettings, Request, Severity};

fn text(name: &str) -> String {
    name.to_owned()
}

#[test]
fn profile_begins_with_nothing_chosen() {
    let mut bench = Bench::new();
    assert_eq!(
        offers(&bench.wizard),
        ["Next -- choose a robot first", "ChooseProfile", "DescribeRobot", "NameSession", "Quit"]
    );
    let view = bench.wizard.view();
    assert_eq!((view.header.step, view.header.number, view.header.steps), (Step::Profile, 1, 8));
    assert_eq!((view.header.folder, view.header.session, view.header.saved_entries), (None, None, 0));
    let effects = bench.intend(Intent::ChooseProfile(text("soochow")));
    assert_eq!(texts(&effects), ["start reading the profile"]);
    bench.settle(effects);
    assert_eq!(offers(&bench.wizard), ["Next*", "ChooseProfile", "DescribeRobot", "NameSession", "Quit"]);
    let Content::Profile(view) = bench.wizard.view().content else { panic!() };
    assert_eq!(view.session, "soochow-20260301-0915");
    assert_eq!(view.chosen.map(|card| (card.name, card.joints.len())), Some((text("soochow"), 6)));
    assert!(!view.is_fixed);
}

#[test]
fn the_folder_is_made_before_the_first_lines() {
    let mut bench = Bench::new();
    bench.does(Intent::ChooseProfile(text("soochow")));
    bench.does(Intent::NameSession(text("first")));
    let mut effects = bench.intend(Intent::Next);
    assert_eq!(texts(&effects), ["create first"]);
    assert_eq!(bench.wizard.folder(), None);
    effects = bench.perform(effects.remove(0));
    let Some(crate::wizard::Effect::Append { lines, .. }) = effects.first() else { panic!() };
    assert_eq!(lines.iter().map(|line| line.number).collect::<Vec<_>>(), [1, 2, 3]);
    assert!(matches!(&lines[0].entry, Entry::Opened { name, .. } if name == "first"));
    assert!(matches!(&lines[1].entry, Entry::Profile { source, .. } if source == "soochow"));
    assert_eq!(lines[2].entry, Entry::Step(Step::Instrument));
    assert_eq!((bench.step(), bench.wizard.folder()), (Step::Profile, Some(FOLDER)));
    bench.settle(effects);
    assert_eq!(bench.step(), Step::Instrument);
    assert_eq!(bench.wizard.view().header.session, Some(text("first")));
}

#[test]
fn names_that_cannot_be_a_folder_are_refused() {
    let mut bench = Bench::new();
    bench.does(Intent::ChooseProfile(text("soochow")));
    for name in ["", "..", "a/b", "-x", "ä", &"x".repeat(65)] {
        bench.does(Intent::NameSession(text(name)));
        let notice = bench.wizard.notice().unwrap();
        assert_eq!(notice.severity, Severity::Error, "{name}");
        assert!(notice.what.contains("is not a valid session name"), "{}", notice.what);
    }
    let Content::Profile(view) = bench.wizard.view().content else { panic!() };
    assert_eq!(view.session, "soochow-20260301-0915");
}

#[test]
fn a_profile_that_cannot_be_read_is_said_and_nothing_is_chosen() {
    let mut bench = Bench::new();
    bench.does(Intent::ChooseProfile(text("nowhere")));
    assert_eq!(bench.told(), "there is no profile or file 'nowhere'");
    let effects = bench.intend(Intent::ChooseProfile(text("broken.ron")));
    let (id, _) = started(&effects);
    let broken = crate::wizard::Answer::Profile { source: text("broken.ron"), text: text("(name: 1)") };
    assert!(bench.answer(id, broken).is_empty());
    assert!(bench.told().starts_with("profile 'broken.ron' cannot be used"));
    assert_eq!(blocked(&bench.wizard, "Next"), "choose a robot first");
}

#[test]
fn instrument_connects_as_soon_as_it_is_chosen() {
    let mut bench = Bench::at(Step::Instrument);
    assert_eq!(
        offers(&bench.wizard),
        [
            "Next -- choose an instrument first",
            "ChooseInstrument",
            "FindLinks",
            "Retry -- there is nothing to reconnect",
            "Back",
            "PlaceTracker",
            "LimitJoints",
            "AddBox",
            "DescribeCell",
            "CheckFaces",
            "Quit"
        ]
    );
    let mut effects = bench.intend(Intent::ChooseInstrument(MANUAL));
    assert_eq!(texts(&effects), ["append 4 instrument: typed in by hand, in mm"]);
    effects = bench.perform(effects.remove(0));
    assert_eq!(texts(&effects), ["start connecting"]);
    assert_eq!(
        offers(&bench.wizard),
        [
            "Cancel",
            "Next -- the instrument is not responding: reconnect, or choose another",
            "ChooseInstrument -- connecting is still running",
            "FindLinks -- connecting is still running",
            "Retry -- connecting is still running",
            "Back -- connecting is still running",
            "PlaceTracker -- connecting is still running",
            "LimitJoints -- connecting is still running",
            "AddBox -- connecting is still running",
            "DescribeCell -- connecting is still running",
            "CheckFaces -- connecting is still running",
            "Quit"
        ]
    );
    bench.settle(effects);
    assert_eq!(bench.wizard.view().header.instrument, Some(text("bench instrument")));
    let Content::Instrument(view) = bench.wizard.view().content else { panic!() };
    assert_eq!(view.choice, Some(text("typed in by hand, in mm")));
    assert_eq!(view.recorded_poses, 0);
    assert!(offers(&bench.wizard).contains(&text("Next*")));
}

#[test]
fn an_instrument_that_does_not_answer_can_be_tried_again() {
    let mut bench = Bench::at(Step::Instrument);
    let mut effects = bench.intend(Intent::ChooseInstrument(MANUAL));
    effects = bench.perform(effects.remove(0));
    let (id, _) = started(&effects);
    assert!(bench.answer(id, super::bench::failure("no route to host")).is_empty());
    assert_eq!(bench.told(), "no route to host");
    assert_eq!(blocked(&bench.wizard, "Next"), "the instrument is not responding: reconnect, or choose another");
    bench.does(Intent::Retry);
    assert_eq!(bench.wizard.view().header.instrument, Some(text("bench instrument")));
}

#[test]
fn another_robot_is_shown_to_the_instrument() {
    let mut bench = Bench::at(Step::Target);
    bench.does(Intent::Back);
    bench.does(Intent::Back);
    bench.does(Intent::ChooseProfile(text("ur5")));
    let Content::Profile(view) = bench.wizard.view().content else { panic!() };
    assert_eq!(view.session, "soochow-20260301-0915", "the session already has a name");
    let mut effects = bench.intend(Intent::Next);
    effects = bench.perform(effects.remove(0));
    let (_, request) = started(&effects);
    let Request::Connect { profile, .. } = request else { panic!() };
    assert_eq!(profile.name(), "ur5");
    assert_eq!(bench.wizard.view().header.instrument, None);
}

#[test]
fn target_says_where_the_smr_is() {
    let mut bench = Bench::at(Step::Target);
    assert_eq!(blocked(&bench.wizard, "Next"), "choose where the SMR is first");
    assert_eq!(blocked(&bench.wizard, "UseCircles"), "no circle has been measured");
    bench.does(Intent::ChooseTarget(TargetChoice::Free { sigma_mm: f64::NAN }));
    assert_eq!(bench.told(), "this is not a plausible SMR position");
    assert_eq!(bench.wizard.session().target, None);
    let known = TargetChoice::Known { xyz_mm: (1.0, 2.0, 3.0), sigma_mm: 0.5 };
    bench.does(Intent::ChooseTarget(known));
    assert_eq!(*bench.last_entry(), Entry::Target(known));
    let Content::Target(view) = bench.wizard.view().content else { panic!() };
    assert_eq!(view.choice, Some(text("(1.000, 2.000, 3.000) mm in the flange, to 0.5 mm")));
    assert!(offers(&bench.wizard).contains(&text("Next*")));
}

#[test]
fn circles_find_the_smr() {
    let mut bench = Bench::at(Step::Target);
    bench.does(Intent::StartCircles);
    for _ in 0..12 {
        bench.does(Intent::Measure);
    }
    let Content::Target(view) = bench.wizard.view().content else { panic!() };
    let circles = view.circles.unwrap();
    assert_eq!((circles.measured, circles.of, circles.fits.len(), circles.problem), (12, 12, 2, None));
    bench.does(Intent::UseCircles);
    let Some(TargetChoice::Circles { xyz_mm, sigma_mm }) = bench.wizard.session().target else { panic!() };
    let off = [xyz_mm.0 + 1.473, xyz_mm.1 - 26.384, xyz_mm.2 - 71.991];
    assert!(off.iter().all(|off| off.abs() < 1.0), "{off:?}");
    assert!(sigma_mm > 0.0);
    bench.does(Intent::DiscardCircles);
    assert!(bench.wizard.session().circle_points.is_empty());
}

#[test]
fn plan_is_proposed_then_accepted() {
    let mut bench = Bench::at(Step::Plan);
    assert_eq!(
        offers(&bench.wizard),
        [
            "AcceptPlan -- there is no new plan to accept",
            "MakePlan*",
            "LoadPlan",
            "PlanFromRecording -- the instrument does not play back recorded measurements",
            "Next -- accept a plan first",
            "Back",
            "PlaceTracker",
            "LimitJoints",
            "AddBox",
            "DescribeCell",
            "Quit"
        ]
    );
    let settings = PlanSettings { poses: 14, verification: 4, ..PlanSettings::default() };
    let effects = bench.intend(Intent::MakePlan(settings));
    let (_, request) = started(&effects);
    let Request::Plan { request, .. } = request else { panic!() };
    assert_eq!((request.poses, request.verification, request.included.len()), (14, 4, 0));
    bench.settle(effects);
    assert!(offers(&bench.wizard).contains(&text("AcceptPlan*")));
    assert!(bench.wizard.session().rows.is_empty(), "a proposal is no plan");
    let Content::Plan(view) = bench.wizard.view().content else { panic!() };
    assert_eq!(view.proposal.map(|figures| (figures.identification, figures.verification)), Some((14, 4)));
    assert_eq!((view.accepted, view.settings), (None, settings));
    let effects = bench.intend(Intent::AcceptPlan);
    assert_eq!(
        texts(&effects),
        ["append 8 plan: 14 identification and 4 verification poses, the plan of the bench | 9 step 5 of 8: Capture"]
    );
    bench.settle(effects);
    assert_eq!(bench.step(), Step::Capture);
    bench.does(Intent::Back);
    assert!(offers(&bench.wizard).contains(&text("Next*")));
}

#[test]
fn recorded_poses_can_be_the_plan() {
    let set = RecordedSet { file: text("m.csv"), kind: PoseKind::Identification, rows: None, layout: text("named") };
    let mut bench = Bench::with(&InstrumentChoice::Replay { sets: vec![set] }, Step::Plan);
    bench.does(Intent::PlanFromRecording);
    bench.does(Intent::AcceptPlan);
    assert_eq!(bench.wizard.session().open_rows().count(), MEASURED);
    assert_eq!(bench.wizard.session().plan.as_ref().unwrap().origin, "the poses of the recorded measurements");
}

#[test]
fn a_file_that_could_not_be_read_is_proposed_again() {
    let mut bench = Bench::at(Step::Plan);
    let proposed = |bench: &Bench| {
        let infos = bench.wizard.intents();
        infos.into_iter().find_map(|info| if let Intent::LoadPlan(file) = info.intent { Some(file) } else { None })
    };
    assert_eq!(proposed(&bench).as_deref(), Some("plan.csv"));
    let effects = bench.intend(Intent::LoadPlan(text("plns/cell 4.csv")));
    let (id, _) = started(&effects);
    bench.answer(id, super::bench::failure("cannot read it"));
    assert_eq!((bench.told().as_str(), proposed(&bench).as_deref()), ("cannot read it", Some("plns/cell 4.csv")));
}

#[test]
fn poses_of_another_arm_are_never_written() {
    let mut bench = Bench::at(Step::Plan);
    let effects = bench.intend(Intent::LoadPlan(text("other.csv")));
    let (id, _) = started(&effects);
    let mut rows = super::bench::plan();
    rows[1].configuration.truncate(4);
    bench.answer(id, crate::wizard::Answer::Planned { summary: None, rows, origin: text("other") });
    let before = bench.wizard.session().clone();
    assert!(bench.intend(Intent::AcceptPlan).is_empty());
    assert_eq!(*bench.wizard.session(), before);
    assert_eq!(bench.wizard.notice().unwrap().severity, Severity::Stop);
    assert_eq!(bench.wizard.activity(), Activity::Idle);
}

#[test]
fn identify_verify_and_deliver_end_in_files() {
    let mut bench = Bench::at(Step::Identify);
    assert_eq!(offers(&bench.wizard), ["Identify*", "Next -- identify first", "Back", "Quit"]);
    let effects = bench.intend(Intent::Identify);
    let (_, request) = started(&effects);
    let Request::Identify(request) = request else { panic!() };
    // The drift pose is in neither set.
    assert_eq!(request.identification.samples.len(), IDENTIFICATION);
    assert_eq!(request.verification.samples.len(), VERIFICATION);
    bench.settle(effects);
    assert_eq!(offers(&bench.wizard)[..2], ["Next*", "Identify"]);
    let Content::Identify(view) = bench.wizard.view().content else { panic!() };
    assert!(view.is_current && view.is_usable);
    assert_eq!(view.summary.unwrap().verification, None, "that is for the next step");
    bench.does(Intent::Next);
    let Content::Verify(view) = bench.wizard.view().content else { panic!() };
    assert_eq!((view.samples, view.is_current, view.too_few), (VERIFICATION, true, None));
    let verification = view.verification.unwrap();
    let mean = |model: &crate::session::summary::ModelSummary| model.position_mm.unwrap().mean;
    assert!(mean(&verification.identified) < 0.2 * mean(&verification.nominal));
    assert_eq!(offers(&bench.wizard), ["Next*", "Back", "DescribeCell", "Quit"]);
    bench.does(Intent::Next);
    assert_eq!(offers(&bench.wizard), ["Deliver*", REFUSED, "About", "Back", "Quit"]);
    let effects = bench.intend(Intent::Deliver);
    assert_eq!(texts(&effects), ["start writing and checking the models"]);
    bench.settle(effects);
    let models = ["corrected.ron", "corrected.urdf", "dh.csv"];
    let files = [
        &["plan.csv", "measurements.csv", "drift.csv", "calibration.ron"],
        &models[..],
        &["report.json", "report.html"],
    ]
    .concat();
    assert_eq!(bench.wizard.session().delivered, files);
    let Content::Deliver(view) = bench.wizard.view().content else { panic!() };
    assert_eq!(view.files, files);
    assert!(view.is_current);
}

#[test]
fn files_that_cannot_be_written_can_be_written_again() {
    let mut bench = Bench::at(Step::Deliver);
    let effects = bench.intend(Intent::Deliver);
    let (id, request) = started(&effects);
    let effects = bench.answer(id, super::bench::answer(&request));
    assert_eq!(texts(&effects), ["start writing files"]);
    let (id, _) = started(&effects);
    assert!(bench.answer(id, super::bench::failure("disk full")).is_empty());
    assert_eq!(bench.told(), "disk full");
    assert!(offers(&bench.wizard).contains(&text("Deliver*")));
    bench.does(Intent::Deliver);
    assert_eq!(bench.wizard.session().delivered.len(), 9);
    assert!(bench.wizard.session().left_out.is_empty());
}

#[test]
fn a_model_that_cannot_be_written_is_left_out_and_said() {
    let mut bench = Bench::at(Step::Deliver);
    let effects = bench.intend(Intent::Deliver);
    let (id, _) = started(&effects);
    let left_out = vec!["dh.csv: it does not fit".to_owned()];
    let files = vec![("corrected.ron".to_owned(), "x".to_owned())];
    let effects = bench.answer(id, Answer::Modelled(Box::new(Models { files, left_out: left_out.clone() })));
    bench.settle(effects);
    assert_eq!(bench.told(), "left out: dh.csv: it does not fit");
    let Content::Deliver(view) = bench.wizard.view().content else { panic!() };
    assert_eq!(view.left_out, left_out);
    assert!(view.files.iter().any(|file| file == "corrected.ron") && !view.files.iter().any(|file| file == "dh.csv"));
}

#[test]
fn going_back_and_forth_loses_nothing_measured() {
    let mut bench = Bench::at(Step::Deliver);
    let before = bench.wizard.session().clone();
    let views: Vec<Content> = std::iter::from_fn(|| {
        let content = bench.wizard.view().content;
        (bench.step() != Step::Profile).then(|| bench.does(Intent::Back)).map(|()| content)
    })
    .collect();
    assert_eq!(views.len(), 7);
    for (step, seen) in Step::ALL.iter().skip(1).zip(views.iter().rev()) {
        bench.does(Intent::Next);
        assert_eq!((bench.step(), &bench.wizard.view().content), (*step, seen));
    }
    let after = bench.wizard.session();
    assert_eq!((&after.samples, &after.rows, &after.identified), (&before.samples, &before.rows, &before.identified));
    assert!(after.is_current());
}

#[test]
fn what_is_not_on_offer_is_answered_with_a_reason() {
    let mut bench = Bench::at(Step::Plan);
    assert!(bench.intend(Intent::Measure).is_empty());
    assert_eq!(bench.told(), "not now: 'Measure' is not available in the step Plan");
    assert!(bench.intend(Intent::Next).is_empty());
    assert_eq!(bench.told(), "not now: accept a plan first");
    assert!(offers(&bench.wizard).contains(&text("Dismiss")));
    bench.does(Intent::Dismiss);
    assert_eq!(bench.told(), "");
    assert!(!offers(&bench.wizard).contains(&text("Dismiss")));
}

#[test]
fn what_is_measured_fixes_robot_instrument_and_target() {
    let mut bench = Bench::at(Step::Capture);
    bench.measure(1);
    for _ in 0..2 {
        bench.does(Intent::Back);
    }
    assert_eq!(bench.step(), Step::Target);
    let fixed = "samples were measured with this SMR; a different mounting needs a new session";
    assert_eq!(blocked(&bench.wizard, "ChooseTarget"), fixed);
    assert_eq!(blocked(&bench.wizard, "StartCircles"), fixed);
    assert!(bench.intend(Intent::ChooseTarget(TargetChoice::Profile)).is_empty());
    bench.does(Intent::Back);
    assert_eq!(
        blocked(&bench.wizard, "ChooseInstrument"),
        "points from another instrument cannot be mixed with those already measured; start another session"
    );
    assert!(bench.intend(Intent::ChooseInstrument(MANUAL)).is_empty());
    bench.does(Intent::Back);
    assert_eq!(
        blocked(&bench.wizard, "ChooseProfile"),
        "points have already been measured: a session has only one robot; start another session"
    );
    assert!(bench.intend(Intent::ChooseProfile(text("ur5"))).is_empty());
    assert_eq!(blocked(&bench.wizard, "NameSession"), "the session already has a name");
    let Content::Profile(view) = bench.wizard.view().content else { panic!() };
    assert!(view.is_fixed);
    assert_eq!(view.chosen.unwrap().name, "soochow");
    // Taking the last sample back does not open them again: it was measured all the same.
    for _ in 0..4 {
        bench.does(Intent::Next);
    }
    bench.does(Intent::Undo);
    bench.does(Intent::Back);
    bench.does(Intent::Back);
    assert_eq!(blocked(&bench.wizard, "ChooseTarget"), fixed);
}

#[test]
fn every_offer_has_a_label_and_at_most_one_is_the_default() {
    for &step in Step::ALL {
        let bench = Bench::at(step);
        let intents = bench.wizard.intents();
        assert!(intents.iter().all(|info| !info.label.is_empty()), "{step}");
        let defaults: Vec<&str> =
            intents.iter().filter(|info| info.is_default).map(|info| info.intent.name()).collect();
        assert!(defaults.len() <= 1, "{step}: {defaults:?}");
        assert!(intents.iter().filter(|info| info.is_default).all(crate::wizard::IntentInfo::is_enabled));
        assert_eq!(bench.wizard.view().intents, intents);
    }
}

#[test]
fn sessions_can_be_continued_until_a_robot_is_chosen() {
    let other = Bench::at(Step::Capture);
    let card = SessionCard::new(other.wizard.session(), "sessions/other".to_owned());
    let mut bench = Bench::new();
    assert!(bench.wizard.update(Event::Sessions(vec![card.clone()])).is_empty());
    let offered = |bench: &Bench| bench.wizard.intents().into_iter().find(|info| info.intent.name() == "ResumeSession");
    let Content::Profile(view) = bench.wizard.view().content else { panic!() };
    assert_eq!(view.sessions[0].progress, "0 of 19 measured, just now");
    let info = offered(&bench).unwrap();
    assert_eq!(info.intent, Intent::ResumeSession("sessions/other".to_owned()));
    let mut begun = bench.clone();
    begun.does(Intent::ChooseProfile("soochow".to_owned()));
    assert!(offered(&begun).is_none());
    bench.does(info.intent);
    assert_eq!((bench.wizard.resumes(), bench.exits), (Some("sessions/other"), 1));
}

/// Robot programs are made before anything is measured.
#[test]
fn an_accepted_plan_is_written_beside_the_journal() {
    let mut bench = Bench::at(Step::Plan);
    bench.does(Intent::MakePlan(PlanSettings::default()));
    let effects = bench.intend(Intent::AcceptPlan);
    let (id, lines) = super::bench::appended(&effects);
    let effects = bench.written(id, lines);
    let (_, Request::Deliver { files, .. }) = started(&effects) else { panic!() };
    assert_eq!(files.len(), 1);
    assert_eq!(files[0].0, "plan.csv");
    let lines = files[0].1.lines().filter(|line| !line.starts_with('#')).count();
    assert_eq!(lines, 1 + bench.wizard.session().rows.len());
    bench.settle(effects);
    assert_eq!(bench.told(), "the plan is saved as plan.csv in the folder of the session");
    // It is no result.
    assert!(bench.wizard.session().delivered.is_empty());
    // Suggested poses are in it as well.
    bench.measure(9);
    let rows = bench.wizard.session().rows.len();
    bench.does(Intent::SuggestPoses(2));
    assert!(bench.wizard.session().rows.len() > rows);
    assert!(bench.told().starts_with("the plan is saved"));
}

/// The offer to correct a program with a result that is not accepted.
const REFUSED: &str = "CorrectProgram -- the result is not accepted: see the step Verify";

#[test]
fn a_program_is_corrected_written_and_noted() {
    let mut bench = Bench::at(Step::Deliver);
    bench.wizard.session.identified.as_mut().unwrap().summary.verdict.status = VerdictStatus::Accepted;
    let choice = |points: Points| {
        let choice = ProgramChoice { file: "cell/pick.mod".to_owned(), points, ..ProgramChoice::default() };
        Intent::CorrectProgram(Box::new(choice))
    };
    assert!(bench.intend(choice(Points::NotStated)).is_empty());
    assert!(bench.told().contains("computed or taught?"), "{}", bench.told());
    assert!(bench.intend(choice(Points::Taught)).is_empty());
    assert!(bench.told().contains("taught points are not corrected"), "{}", bench.told());
    let effects = bench.intend(choice(Points::Computed));
    assert_eq!(texts(&effects), ["start correcting the program"]);
    bench.settle(effects);
    let [program] = bench.wizard.session().corrected.as_slice() else { panic!("{}", bench.told()) };
    assert_eq!((program.file.as_str(), program.corrected, program.left), ("corrected/pick.mod", 1, 0));
    assert!(program.largest_mm.unwrap() > 0.1 && program.largest_mm.unwrap() < 20.0, "{program:?}");
    assert!(bench.told().contains("1 target corrected, 0 left"), "{}", bench.told());
    let Content::Deliver(view) = bench.wizard.view().content else { panic!() };
    assert_eq!(view.corrected.len(), 1);
}
