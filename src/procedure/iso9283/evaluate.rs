//! Figures from the points that were attained.

use std::collections::BTreeMap;

use nalgebra::{Isometry3, Point3};

use super::TestError;
use crate::geometry::register;
use crate::identification::PointSample;
use crate::iso9283::{
    CYCLES, DIRECTIONS, DistanceFigures, Estimate, Label, POSES, PoseFigures, barycentre, distance_figures, drift,
    multi_directional_variation, pose_figures,
};
use crate::kinematics::Arm;
use crate::session::iso9283::{
    AccuracyMm, DirectionRow, DistanceRow, EstimateMm, FrameSource, PoseRow, SCHEMA, TestSummary,
};
use crate::session::summary::Provenance;
use crate::text::counted;
use crate::units::to_mm;

/// Cycles of a block: drift is the change from one to another.
const BLOCK: usize = 10;

/// One attained point.
#[derive(Clone, Debug, PartialEq)]
pub struct Reading {
    /// Pose and cycle.
    pub label: Label,
    /// The commanded place and the attained point.
    pub sample: PointSample,
}

/// A test to evaluate.
#[derive(Clone, Debug)]
pub struct TestRequest<'a> {
    /// The arm as its controller knows it.
    pub nominal: &'a Arm,
    /// The identified arm, if there is one.
    pub identified: Option<&'a Arm>,
    /// The instrument in the base of the nominal and of the identified arm; none: fitted to the poses.
    pub base_from_station: Option<(Isometry3<f64>, Isometry3<f64>)>,
    /// The readings.
    pub readings: &'a [Reading],
    /// The load, in words.
    pub load: Option<String>,
    /// The speed, in words.
    pub speed: Option<String>,
    /// Where the numbers come from.
    pub provenance: Provenance,
}

/// The figures of a test.
///
/// # Errors
/// Too few cycles, or poses that give no frame.
pub fn evaluate(request: &TestRequest<'_>) -> Result<TestSummary, TestError> {
    let groups = Groups::new(request.readings);
    let identified_frame = request.base_from_station.map(|(_, identified)| identified);
    let nominal = Side::new(request.nominal, request.base_from_station.map(|(nominal, _)| nominal), &groups)?;
    let identified = request.identified.map(|arm| Side::new(arm, identified_frame, &groups)).transpose()?;
    let poses: Vec<PoseRow> =
        (1..=POSES).filter_map(|pose| pose_row(pose, &groups, &nominal, identified.as_ref())).collect();
    if poses.is_empty() {
        return Err(TestError::TooFewCycles);
    }
    let pairs = (1..=POSES).flat_map(|from| (from + 1..=POSES).map(move |to| (from, to)));
    let distances = pairs.filter_map(|pair| distance_row(pair, &groups, &nominal, identified.as_ref())).collect();
    let frame = if request.base_from_station.is_some() { FrameSource::Calibration } else { FrameSource::Fitted };
    Ok(TestSummary {
        schema: SCHEMA,
        provenance: request.provenance.clone(),
        load: request.load.clone(),
        speed: request.speed.clone(),
        frame,
        directions: directions(&groups),
        drift_mm: accuracy_drift(&groups, &nominal).map(to_mm),
        deviations: deviations(request, &groups, &poses),
        poses,
        distances,
    })
}

/// Readings by pose and direction, and in them by cycle.
struct Groups<'a>(BTreeMap<(usize, Option<usize>), BTreeMap<usize, &'a Reading>>);

impl<'a> Groups<'a> {
    /// Of several readings of one visit the last counts.
    fn new(readings: &'a [Reading]) -> Self {
        let mut groups: BTreeMap<_, BTreeMap<usize, &Reading>> = BTreeMap::new();
        for reading in readings {
            let Label { cycle, pose, direction } = reading.label;
            groups.entry((pose, direction)).or_default().insert(cycle, reading);
        }
        Self(groups)
    }

    fn of(&self, pose: usize) -> Option<&BTreeMap<usize, &'a Reading>> {
        self.0.get(&(pose, None))
    }
}

/// An arm with the frame of the instrument in its base.
struct Side<'a> {
    arm: &'a Arm,
    base_from_station: Isometry3<f64>,
}

impl<'a> Side<'a> {
    fn new(arm: &'a Arm, known: Option<Isometry3<f64>>, groups: &Groups<'_>) -> Result<Self, TestError> {
        let base_from_station = match known {
            Some(known) => known,
            None => fitted(arm, groups).ok_or(TestError::NoFrame)?,
        };
        Ok(Self { arm, base_from_station })
    }

    /// Where this arm says that the commanded configurations are: their mean, as all are meant to be the same.
    fn commanded(&self, readings: &BTreeMap<usize, &Reading>) -> Point3<f64> {
        barycentre(readings.values().map(|reading| self.arm.point_in_base(&reading.sample.at)))
    }

    fn attained(&self, reading: &Reading) -> Point3<f64> {
        self.base_from_station * reading.sample.point
    }

    fn pose(&self, readings: &BTreeMap<usize, &Reading>) -> Option<PoseFigures> {
        let attained: Vec<_> = readings.values().map(|reading| self.attained(reading)).collect();
        pose_figures(&self.commanded(readings), &attained)
    }

    fn distance(&self, from: &BTreeMap<usize, &Reading>, to: &BTreeMap<usize, &Reading>) -> Option<DistanceFigures> {
        let both = from.iter().filter_map(|(cycle, first)| Some((self.attained(first), self.attained(to.get(cycle)?))));
        let attained: Vec<_> = both.collect();
        distance_figures((&self.commanded(from), &self.commanded(to)), &attained)
    }
}

/// The frame that brings the barycentres nearest to the commanded points.
fn fitted(arm: &Arm, groups: &Groups<'_>) -> Option<Isometry3<f64>> {
    let here = Side { arm, base_from_station: Isometry3::identity() };
    let of = |pose: usize| {
        let readings = groups.of(pose)?;
        Some((1.0, barycentre(readings.values().map(|reading| reading.sample.point)), here.commanded(readings)))
    };
    let pairs: Vec<_> = (1..=POSES).filter_map(of).collect();
    (pairs.len() >= 3).then(|| register(pairs.into_iter()))?.map(|registration| registration.to_from_from)
}

fn pose_row(pose: usize, groups: &Groups<'_>, nominal: &Side<'_>, identified: Option<&Side<'_>>) -> Option<PoseRow> {
    let readings = groups.of(pose)?;
    let figures = nominal.pose(readings)?;
    let after = identified.and_then(|side| side.pose(readings));
    let accuracy = |figures: &PoseFigures| accuracy(&figures.accuracy, figures.components);
    Some(PoseRow {
        pose: format!("P{pose}"),
        cycles: figures.cycles,
        nominal_mm: accuracy(&figures),
        identified_mm: after.as_ref().map(accuracy),
        repeatability_mm: estimate(&figures.repeatability),
    })
}

fn distance_row(
    (from, to): (usize, usize),
    groups: &Groups<'_>,
    nominal: &Side<'_>,
    identified: Option<&Side<'_>>,
) -> Option<DistanceRow> {
    let (first, second) = (groups.of(from)?, groups.of(to)?);
    let figures = nominal.distance(first, second)?;
    let after = identified.and_then(|side| side.distance(first, second));
    let accuracy = |figures: &DistanceFigures| accuracy(&figures.accuracy, figures.components);
    Some(DistanceRow {
        from: format!("P{from}"),
        to: format!("P{to}"),
        cycles: figures.cycles,
        commanded_mm: to_mm(figures.commanded),
        nominal_mm: accuracy(&figures),
        identified_mm: after.as_ref().map(accuracy),
        repeatability_mm: estimate(&figures.repeatability),
    })
}

/// The variation of every pose that was approached from all directions. It needs no frame.
fn directions(groups: &Groups<'_>) -> Vec<DirectionRow> {
    let of = |pose: usize| {
        let attained = |direction| groups.0.get(&(pose, Some(direction)));
        let barycentres: Option<Vec<_>> = (1..=DIRECTIONS)
            .map(|direction| {
                attained(direction).map(|readings| barycentre(readings.values().map(|reading| reading.sample.point)))
            })
            .collect();
        let variation = multi_directional_variation(&barycentres?)?;
        Some(DirectionRow { pose: format!("P{pose}"), directions: DIRECTIONS, variation_mm: to_mm(variation) })
    };
    (1..=POSES).filter_map(of).collect()
}

/// The largest change of the accuracy of P1 between blocks of cycles (m).
fn accuracy_drift(groups: &Groups<'_>, nominal: &Side<'_>) -> Option<f64> {
    let readings: Vec<_> = groups.of(1)?.iter().collect();
    let blocks = readings.chunks_exact(BLOCK).map(|block| {
        let block: BTreeMap<usize, &Reading> = block.iter().map(|(cycle, reading)| (**cycle, **reading)).collect();
        nominal.pose(&block).map(|figures| figures.accuracy.value)
    });
    let accuracies: Vec<f64> = blocks.collect::<Option<_>>()?;
    if accuracies.len() < 2 { None } else { drift(&accuracies) }
}

/// What differs from the standard's procedure, in words.
fn deviations(request: &TestRequest<'_>, groups: &Groups<'_>, poses: &[PoseRow]) -> Vec<String> {
    let mut deviations = Vec::new();
    if poses.len() < POSES {
        deviations.push(format!("{} instead of {POSES}", counted(poses.len(), "pose")));
    }
    if let Some(fewest) = poses.iter().map(|row| row.cycles).min().filter(|fewest| *fewest < CYCLES) {
        deviations.push(format!("{} instead of {CYCLES}", counted(fewest, "cycle")));
    }
    if request.base_from_station.is_none() {
        deviations.push(
            "the frame of the instrument was fitted to these same poses: pose accuracies are smaller than in the robot's own base".to_owned(),
        );
    }
    if request.load.is_none() {
        deviations.push("the load is not stated".to_owned());
    }
    if request.speed.is_none() {
        deviations.push("the speed is not stated".to_owned());
    }
    if !groups.0.keys().any(|(_, direction)| direction.is_some()) {
        deviations.push("the variation with the direction of approach was not tested".to_owned());
    }
    deviations.push("orientations were not measured".to_owned());
    deviations
}

fn estimate(estimate: &Estimate) -> EstimateMm {
    EstimateMm { value: to_mm(estimate.value), low: to_mm(estimate.low), high: to_mm(estimate.high) }
}

fn accuracy(of: &Estimate, components: nalgebra::Vector3<f64>) -> AccuracyMm {
    AccuracyMm { accuracy: estimate(of), xyz: components.map(to_mm).into() }
}
