//! The cell once more, as clouds of points: a check that shares no closed form with the one it checks.

use nalgebra::{Isometry3, Point3};
use trupose::kinematics::{ForwardKinematics, KinematicChain};
use trupose::planning::collision::{SMR_RADIUS, TRACKER_RADIUS};
use trupose::planning::order::{Route, StepKind};
use trupose::planning::visibility::OWN_BODY;
use trupose::planning::{Cell, KeepOutBox};

/// Distance between points of the sampled lines (m).
pub(crate) const SPACING: f64 = 10e-3;

/// The cell again, as clouds of points.
pub(crate) struct PointCloud<'a> {
    arm: ForwardKinematics<'a>,
    cell: &'a Cell,
    /// Link, radius, points in the link frame.
    balls: Vec<(usize, f64, Vec<Point3<f64>>)>,
    /// Pairs of bodies that are checked.
    pub(crate) pairs: Vec<(usize, usize)>,
}

fn sampled(from: Point3<f64>, to: Point3<f64>) -> Vec<Point3<f64>> {
    let length = (to - from).norm();
    let between = std::iter::successors(Some(0.0), |at| Some(at + SPACING)).take_while(|at| *at < length);
    between.map(|at| from + (to - from) * (at / length)).chain([to]).collect()
}

impl<'a> PointCloud<'a> {
    pub(crate) fn new(chain: &'a KinematicChain, cell: &'a Cell) -> Self {
        let mut balls: Vec<_> =
            cell.bodies.iter().map(|body| (body.link, body.radius, sampled(body.from, body.to))).collect();
        let flange = chain.flange();
        balls.push((
            chain.dof(),
            SMR_RADIUS,
            sampled(flange * Point3::origin(), flange * cell.target.position_in_flange),
        ));
        let links = |a: usize, b: usize| balls[a].0.abs_diff(balls[b].0);
        let pairs = (0..balls.len())
            .flat_map(|a| (a + 1..balls.len()).map(move |b| (a, b)))
            .filter(|&(a, b)| links(a, b) > 1)
            .collect();
        Self { arm: ForwardKinematics::new(chain), cell, balls, pairs }
    }

    fn placed(&self, q: &[f64]) -> Vec<Vec<Point3<f64>>> {
        let links = self.arm.base_from_links(q);
        self.balls.iter().map(|(link, _, points)| points.iter().map(|point| links[*link] * point).collect()).collect()
    }

    /// What is wrong in `q`, in words.
    pub(crate) fn collision(&self, q: &[f64]) -> Option<String> {
        if !q.iter().zip(&self.cell.limits).all(|(q, (low, high))| low <= q && q <= high) {
            return Some(format!("limits: {q:?}"));
        }
        let placed = self.placed(q);
        let touch = |a: &[Point3<f64>], b: &[Point3<f64>], reach: f64| {
            a.iter().any(|p| b.iter().any(|r| (p - r).norm_squared() < reach * reach))
        };
        for &(a, b) in &self.pairs {
            if touch(&placed[a], &placed[b], self.balls[a].1 + self.balls[b].1) {
                return Some(format!("bodies {a} and {b} at {q:?}"));
            }
        }
        for ((link, radius, _), points) in self.balls.iter().zip(&placed) {
            if let Some(stand) = self.cell.tracker
                && touch(points, &[stand.position_in_base], radius + TRACKER_RADIUS)
            {
                return Some(format!("tracker and link {link}"));
            }
            if *link == 0 {
                continue;
            }
            if let Some(floor) = self.cell.floor
                && points.iter().any(|point| point.z - radius < floor)
            {
                return Some(format!("floor and link {link} at {q:?}"));
            }
            for zone in &self.cell.keep_out {
                let outside = |point: &Point3<f64>| {
                    let nearest = point.coords.zip_map(&zone.space.min.coords, f64::max);
                    (point.coords - nearest.zip_map(&zone.space.max.coords, f64::min)).norm()
                };
                if points.iter().any(|point| outside(point) < *radius) {
                    return Some(format!("box and link {link} at {q:?}"));
                }
            }
        }
        None
    }

    fn hidden(&self, q: &[f64]) -> Option<String> {
        let stand = self.cell.tracker?;
        let flange = self.arm.base_from_flange(q);
        let smr = flange * self.cell.target.position_in_flange;
        let beam = stand.position_in_base - smr;
        let cosine = (flange * self.cell.target.axis_in_flange).dot(&beam) / beam.norm();
        if cosine < stand.acceptance_angle.cos() - 1e-12 {
            return Some(format!("faces away: {cosine}"));
        }
        if beam.norm() < stand.range.0 || beam.norm() > stand.range.1 {
            return Some("range".to_owned());
        }
        let points = sampled(smr, stand.position_in_base);
        let arm = self.placed(q);
        let bodies = self.balls.iter().zip(&arm).take(self.cell.bodies.len());
        for ((link, radius, _), body) in bodies {
            let is_own = *link == self.arm.chain().dof();
            let start = if is_own { OWN_BODY } else { 0.0 };
            let seen = points.iter().filter(|point| (*point - smr).norm() >= start);
            if seen.clone().any(|p| body.iter().any(|r| (p - r).norm() < *radius)) {
                return Some(format!("link {link} in the beam"));
            }
        }
        let inside = |zone: &KeepOutBox| points.iter().any(|point| zone.space.contains(point));
        let screens = self.cell.keep_out.iter().filter(|zone| !zone.space.contains(&stand.position_in_base));
        screens.clone().find(|zone| inside(zone)).map(|zone| format!("box {} in the beam", zone.name))
    }

    /// Every stop and every move of a route, densely.
    pub(crate) fn check(&self, route: &Route) {
        for step in &route.steps {
            if matches!(step.kind, StepKind::Measure | StepKind::Drift) {
                assert_eq!(self.hidden(&step.configuration), None);
            }
        }
        for leg in route.steps.windows(2) {
            let (from, to) = (&leg[0].configuration, &leg[1].configuration);
            // Steps of about 20 mm of the farthest point: measured, not bounded.
            let at = |t: f64| -> Vec<f64> { from.iter().zip(to).map(|(a, b)| a + (b - a) * t).collect() };
            let mut t: f64 = 0.0;
            let mut step: f64 = 0.01;
            loop {
                let q = at(t);
                if let Some(reason) = self.collision(&q) {
                    panic!("{:?} to {:?} at {t}: {reason}", leg[0], leg[1]);
                }
                if t >= 1.0 {
                    break;
                }
                let moved = self.farthest(&q, &at((t + step).min(1.0)));
                step = (step * 20e-3 / moved.max(1e-6)).clamp(1e-4, 0.1);
                t = (t + step).min(1.0);
            }
        }
    }

    fn farthest(&self, from: &[f64], to: &[f64]) -> f64 {
        let links: [Vec<Isometry3<f64>>; 2] = [from, to].map(|q| self.arm.base_from_links(q));
        let ends =
            self.balls.iter().flat_map(|(link, _, points)| [(*link, points[0]), (*link, *points.last().unwrap())]);
        ends.map(|(link, point)| (links[0][link] * point - links[1][link] * point).norm()).fold(0.0, f64::max)
    }
}
