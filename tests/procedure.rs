//! The procedure of a calibration on data in memory, as the wizard uses it.

use std::ops::ControlFlow;
use std::sync::atomic::{AtomicUsize, Ordering};

use trupose::identification::PointSample;
use trupose::kinematics::Place;
use trupose::procedure::identify::{IdentifyRequest, NamedSample, SampleSet, identify};
use trupose::procedure::plan::{PlanRequest, Progress, check, plan, rows};
use trupose::procedure::{EstimationSettings, joint_types};
use trupose::profile::{Profile, builtin};
use trupose::session::measurements::read;
use trupose::session::plan::{PlannedPose, PoseKind};
use trupose::session::summary::{VerdictStatus, VerificationMode};

const CREATED: &str = "2026-01-02T03:04:05Z";

fn soochow() -> (Profile, String) {
    let text = builtin("soochow").unwrap();
    (Profile::parse(text, "soochow").unwrap().0, text.to_owned())
}

/// The samples of the example session.
fn samples(profile: &Profile) -> Vec<NamedSample> {
    let text = include_str!("../sessions/soochow-example/measurements.csv");
    let table = read(text, "measurements.csv", &joint_types(profile)).unwrap();
    table
        .distinct_rows()
        .map(|row| NamedSample {
            pose: row.pose.clone(),
            line: row.line,
            sample: PointSample {
                at: Place { configuration: row.configuration.clone(), target: 0 },
                station: 0,
                point: row.point,
                sigma: row.sigma,
            },
            temperature: row.temperature,
        })
        .collect()
}

/// Every fourth sample of the example verifies what the others identify.
fn request() -> IdentifyRequest {
    let (profile, profile_text) = soochow();
    let (verification, identification): (Vec<_>, Vec<_>) =
        samples(&profile).into_iter().enumerate().partition(|(index, _)| index % 4 == 0);
    let set = |samples: Vec<(usize, NamedSample)>| -> SampleSet {
        samples.into_iter().map(|(_, sample)| sample).collect::<Vec<_>>().into()
    };
    IdentifyRequest {
        mounted: None,
        payload: None,
        profile,
        profile_text,
        created: CREATED.to_owned(),
        inputs: Vec::new(),
        settings: EstimationSettings::default(),
        identification: set(identification),
        verification: set(verification),
        basis: "every fourth pose".to_owned(),
        verification_mode: VerificationMode::Rest,
        layout: None,
        socket_distance_mm: None,
        previous: None,
    }
}

#[test]
fn samples_in_memory_become_a_verified_calibration() {
    let request = request();
    let mut steps = 0;
    let identified = identify(&request, &mut |_| {
        steps += 1;
        ControlFlow::Continue(())
    })
    .unwrap();
    assert!(steps > 0);
    let summary = &identified.summary;
    assert_eq!(summary.provenance.created, CREATED);
    assert_eq!(summary.samples, request.identification.samples.len());
    assert_ne!(summary.verdict.status, VerdictStatus::NotEvaluated);
    let verification = summary.verification.as_ref().unwrap();
    assert_eq!(verification.samples, request.verification.samples.len());
    assert!(verification.independent);
    let rms = |model: &trupose::session::summary::ModelSummary| model.position_mm.unwrap().rms;
    assert!(rms(&verification.identified) < 0.1 * rms(&verification.nominal));
    let calibration = identified.calibration.unwrap();
    assert_eq!(calibration.profile, request.profile_text);
    assert_eq!(calibration.samples.len(), summary.samples);
    assert_eq!(identified.found.estimates.len(), summary.parameter_count);
    assert_eq!(identified.nominal.base_from_station.len(), 1);
}

#[test]
fn an_identification_can_be_cancelled_at_any_step() {
    let mut steps = 0;
    let failure = identify(&request(), &mut |_| {
        steps += 1;
        ControlFlow::Break(())
    })
    .unwrap_err();
    assert_eq!(steps, 1);
    assert_eq!(failure.to_string(), "the identification was cancelled");
}

/// A small plan without verification.
fn wishes() -> PlanRequest {
    PlanRequest {
        created: CREATED.to_owned(),
        candidates: 300,
        verification: 0,
        drift_every: 0,
        filters: false,
        threads: Some(1),
        ..PlanRequest::default()
    }
}

fn measured(profile: &Profile) -> Vec<PlannedPose> {
    let pose = |named: NamedSample| PlannedPose {
        pose: named.pose,
        kind: PoseKind::Identification,
        configuration: named.sample.at.configuration,
        point_in_base: None,
    };
    samples(profile).into_iter().map(pose).collect()
}

#[test]
fn the_next_best_poses_follow_those_already_measured() {
    let (profile, text) = soochow();
    let included = measured(&profile);
    let request = PlanRequest { poses: 2, included: included.clone(), ..wishes() };
    let sweeps = AtomicUsize::new(0);
    let summary = plan(&profile, &text, &request, &|| true, &|progress| {
        if matches!(progress, Progress::Sweep { .. }) {
            sweeps.fetch_add(1, Ordering::Relaxed);
        }
    })
    .unwrap();
    assert!(sweeps.into_inner() > 0);
    assert_eq!(summary.provenance.created, CREATED);
    assert_eq!(summary.identification_poses, included.len() + 2);
    let new: Vec<PlannedPose> =
        rows(&summary, &joint_types(&profile)).into_iter().filter(|row| row.kind == PoseKind::Identification).collect();
    assert_eq!(new.len(), 2);
    assert!(new.iter().all(|row| included.iter().all(|known| known.configuration != row.configuration)));

    let before = check(&profile, &text, &request, &included, "measured").unwrap();
    assert!(summary.score.predicted_error < before.score.predicted_error);
}

#[test]
fn a_search_that_may_not_go_on_says_so() {
    let (profile, text) = soochow();
    let summary = plan(&profile, &text, &wishes(), &|| false, &|_| ()).unwrap();
    assert!(summary.interrupted);
    assert_eq!(summary.identification_poses, 56);
}
