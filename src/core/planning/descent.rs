//! One start of a search: each pose in turn gives way to the best candidate for its place.
//!
//! While the search is young a place may also get a slightly worse pose than it had (threshold acceptance, Dueck & Scheuer
//! 1990): the condition number has many poor local minima. Where no exchange is left, a few poses are replaced at random.

use nalgebra::DMatrix;
use rand::RngExt as _;
use rand::seq::SliceRandom as _;
use rand_chacha::ChaCha8Rng;

use super::exchange::{Merit, Prediction, add_pose};
use super::filling::Unfilled;
use super::information::Information;
use super::objective::{Chosen, Figures, Objective, Progress, SearchSettings, Stage};
use super::pair_exchange::{Vacancy, spectral_cost};
use super::pairs::{add_pairs, pair_gram};
use super::score::{ObservabilityIndices, condition_number};

/// Poses replaced at random where no exchange is left.
const KICKED: usize = 3;
/// Promising candidates whose predicted error is looked at together, and how many allowed ones are judged by their pairs at a place
/// where the predicted error is limited: those after them bring nothing that lasts.
const CHUNK: usize = 64;
const ENOUGH: usize = 64;
/// Sets of up to so many poses look at whole windows.
const FULL_WINDOWS: usize = 100;
/// Tries to find a replacement that the limit allows.
const KICK_TRIES: usize = 20;
/// What a shortfall of one costs in the prediction stage, as a share of the predicted error.
const SHORTFALL_PRICE: f64 = 0.05;
/// The prediction stage ends where a sweep lowers the cost by less than this share.
const SETTLED: f64 = 1e-3;
/// An exchange must lower the cost by this share, lest rounding errors keep it going round.
const NEGLIGIBLE: f64 = 1e-12;

/// A set with its matrices.
#[derive(Clone, Debug)]
struct State {
    /// Candidates, the fixed ones first.
    set: Vec<usize>,
    /// Information matrix.
    matrix: DMatrix<f64>,
    /// Gram matrix of the pair rows; kept up to date for spectral objectives only.
    gram: DMatrix<f64>,
    cost: f64,
    merit: Merit,
    /// Of the joint angles in their ranges.
    shortfall: f64,
}

impl State {
    fn new(information: &Information, target: Target, set: Vec<usize>) -> Self {
        let matrix = information.sum(&set);
        let gram = pair_gram(information, &set);
        let merit = Merit::new(information, matrix.clone());
        let shortfall = information.angles().map_or(0.0, |filling| filling.shortfall(&set));
        let cost = if target.objective.is_spectral() {
            spectral_cost(target.objective, gram.symmetric_eigenvalues().as_slice(), set.len())
        } else {
            target.cost(&merit, shortfall)
        };
        Self { set, matrix, gram, cost, merit, shortfall }
    }

    fn figures(&self, information: &Information) -> Figures {
        // Eigenvalues of the Gram matrix of the pair rows (m²).
        let eigenvalues = pair_gram(information, &self.set).symmetric_eigenvalues();
        Figures {
            condition_number: condition_number(eigenvalues.as_slice()).unwrap_or(f64::INFINITY),
            o1: ObservabilityIndices::new(eigenvalues.as_slice(), self.set.len()).o1,
            predicted_error: self.merit.predicted_error(),
        }
    }
}

/// What a stage of the search goes for.
#[derive(Clone, Copy, Debug)]
struct Target {
    objective: Objective,
    /// Largest predicted error and shortfall allowed.
    limit: f64,
    largest_shortfall: f64,
    /// What a shortfall of one costs, as a share of the predicted error.
    price: f64,
}

impl Target {
    fn new(stage: Stage, settings: &SearchSettings) -> Self {
        match stage {
            Stage::Prediction => Self {
                objective: Objective::Prediction,
                limit: f64::INFINITY,
                largest_shortfall: f64::INFINITY,
                price: SHORTFALL_PRICE,
            },
            Stage::Objective { limit, shortfall } => {
                Self { objective: settings.objective, limit, largest_shortfall: shortfall, price: 0.0 }
            }
        }
    }

    /// What is minimised where the information matrix decides.
    fn cost(&self, merit: &Merit, shortfall: f64) -> f64 {
        match self.objective {
            Objective::D => -merit.log_det,
            _ => merit.predicted_error() * (1.0 + self.price * shortfall),
        }
    }

    fn allows(&self, merit: &Merit, shortfall: f64) -> bool {
        merit.predicted_error() <= self.limit && shortfall <= self.largest_shortfall
    }
}

/// How much worse a new pose may be at first, as a share of the cost. Measured on the paper's robot: 1 to 2 % of a condition
/// number reach 10 % lower ones than pure descent does in the same time; the smoother objectives gain nothing.
fn first_threshold(objective: Objective, limit: f64) -> f64 {
    match objective {
        Objective::Prediction | Objective::D | Objective::O1 | Objective::O5 => 0.0,
        // Within a limit there is little room.
        _ if limit.is_finite() => 0.01,
        _ => 0.02,
    }
}

/// The best exchange seen at a place.
#[derive(Clone, Copy, Debug)]
struct Exchange {
    entering: usize,
    cost: f64,
    merit: Merit,
    shortfall: f64,
}

/// A start on its way.
#[derive(Debug)]
pub(super) struct Descent<'a> {
    information: &'a Information,
    target: Target,
    stage: Stage,
    sweeps: usize,
    window: usize,
    fixed: usize,
    rng: ChaCha8Rng,
    /// All candidates in random order; each visit looks at the next window of them.
    pool: Vec<usize>,
    cursor: usize,
    is_in: Vec<bool>,
    current: State,
    best: State,
}

impl<'a> Descent<'a> {
    /// From `set`, whose first poses are the required ones.
    pub(super) fn new(
        information: &'a Information,
        settings: &SearchSettings,
        stage: Stage,
        set: Vec<usize>,
        mut rng: ChaCha8Rng,
    ) -> Self {
        let target = Target::new(stage, settings);
        let mut pool: Vec<usize> = (0..information.len()).collect();
        pool.shuffle(&mut rng);
        let current = State::new(information, target, set);
        let mut descent = Self {
            information,
            target,
            stage,
            sweeps: settings.sweeps_of(stage),
            // A sweep over a larger set has more visits.
            window: settings.window.min(settings.window * FULL_WINDOWS / settings.poses.max(1)).max(1),
            fixed: settings.required.len(),
            rng,
            pool,
            cursor: 0,
            is_in: Vec::new(),
            best: current.clone(),
            current,
        };
        descent.mark_members();
        descent
    }

    /// Sweeps over all places until the work is done or `keep_going` says no.
    pub(super) fn run(
        mut self,
        start: usize,
        keep_going: &(dyn Fn() -> bool + Sync),
        progress: &(dyn Fn(&Progress) + Sync),
    ) -> Chosen {
        let first_threshold = first_threshold(self.target.objective, self.target.limit);
        let mut interrupted = false;
        let mut unmoved = 0;
        for sweep in 1..=self.sweeps {
            let before = self.best.cost;
            let threshold = first_threshold * (1.0 - sweep as f64 / self.sweeps as f64);
            let Some(moved) = self.sweep(threshold, keep_going) else {
                interrupted = true;
                break;
            };
            progress(&Progress { start, stage: self.stage, sweep, figures: self.best.figures(self.information) });
            // The reference of the next stage need not be exact.
            if self.stage == Stage::Prediction && sweep > 1 && self.best.cost > (1.0 - SETTLED) * before {
                break;
            }
            // Nothing is left only when every place has seen the whole pool.
            unmoved = if moved { 0 } else { unmoved + self.window };
            if unmoved >= self.pool.len() {
                unmoved = 0;
                self.kick();
            }
        }
        let mut set = self.best.set;
        // The numbers are those of the set whatever way it was found.
        set.sort_unstable();
        let best = State::new(self.information, self.target, set);
        let figures = best.figures(self.information);
        Chosen { figures, cost: best.cost, set: best.set, shortfall: best.shortfall, interrupted }
    }

    /// Visits every place once, in random order. Returns whether a pose changed; `None` when interrupted.
    pub(super) fn sweep(&mut self, threshold: f64, keep_going: &(dyn Fn() -> bool + Sync)) -> Option<bool> {
        let mut order: Vec<usize> = (self.fixed..self.current.set.len()).collect();
        order.shuffle(&mut self.rng);
        let mut moved = false;
        for place in order {
            if !keep_going() {
                return None;
            }
            moved |= self.visit(place, threshold);
            if self.current.cost < self.best.cost {
                self.best = self.current.clone();
            }
        }
        // Rounding errors of the updates do not pile up.
        self.rebuild(self.current.set.clone());
        Some(moved)
    }

    /// Puts the best candidate of the window in a place, if its cost stays below the current one plus `threshold` (a share).
    fn visit(&mut self, place: usize, threshold: f64) -> bool {
        let leaving = self.current.set[place];
        let window = self.next_window();
        let mut matrix = self.current.matrix.clone();
        add_pose(self.information, &mut matrix, leaving, -1.0);
        let bar = self.current.cost + (threshold - NEGLIGIBLE) * self.current.cost.abs();
        let others: Vec<usize> = self.current.set.iter().copied().filter(|&pose| pose != leaving).collect();
        let unfilled = self.unfilled(&others);
        let found = if self.target.objective.is_spectral() {
            let mut gram = self.current.gram.clone();
            add_pairs(self.information, &mut gram, leaving, &others, -1.0);
            let vacancy = Vacancy::new(self.information, self.target.objective, &others, gram);
            let found = self.best_by_pairs(&vacancy, &matrix, unfilled.as_ref(), &window, bar);
            if let Some(found) = found {
                self.current.gram = vacancy.gram_with(found.entering);
            }
            found
        } else {
            self.best_by_merit(&matrix, unfilled.as_ref(), &window, bar)
        };
        let Some(Exchange { entering, cost, merit, shortfall }) = found else { return false };
        add_pose(self.information, &mut matrix, entering, 1.0);
        self.current.matrix = matrix;
        self.current.cost = cost;
        self.current.merit = merit;
        self.current.shortfall = shortfall;
        self.current.set[place] = entering;
        self.is_in[leaving] = false;
        self.is_in[entering] = true;
        true
    }

    /// The candidate of lowest cost below `bar`, judged by the information matrix of the other poses.
    fn best_by_merit(
        &self,
        others: &DMatrix<f64>,
        unfilled: Option<&Unfilled<'_>>,
        window: &[usize],
        bar: f64,
    ) -> Option<Exchange> {
        let mut best: Option<Exchange> = None;
        let mut bar = bar;
        let least = unfilled.map_or(0.0, |unfilled| unfilled.least);
        with_each(self.information, others, window, |entering, merit| {
            if self.target.cost(&merit, least) >= bar {
                return;
            }
            let shortfall = shortfall_with(unfilled, entering);
            let cost = self.target.cost(&merit, shortfall);
            if cost < bar {
                bar = cost;
                best = Some(Exchange { entering, cost, merit, shortfall });
            }
        });
        best
    }

    /// The gaps that `others` leave, where ranges are to be filled.
    fn unfilled(&self, others: &[usize]) -> Option<Unfilled<'a>> {
        let is_asked = self.target.price > 0.0 || self.target.largest_shortfall.is_finite();
        let filling = self.information.angles().filter(|_| is_asked)?;
        Some(Unfilled::new(filling, others, others.len() + 1))
    }

    /// The same, judged by the pair rows: the bound first, then the predicted error, then the exact cost.
    fn best_by_pairs(
        &self,
        vacancy: &Vacancy<'_>,
        others: &DMatrix<f64>,
        unfilled: Option<&Unfilled<'_>>,
        window: &[usize],
        bar: f64,
    ) -> Option<Exchange> {
        let mut best: Option<Exchange> = None;
        let mut bar = bar;
        let mut judged = 0;
        let enough = if self.target.limit.is_finite() { ENOUGH } else { usize::MAX };
        let fills = |candidate: &usize| shortfall_with(unfilled, *candidate) <= self.target.largest_shortfall;
        for hopeful in vacancy.shortlist(window, bar).chunks(CHUNK) {
            let mut allowed = Vec::new();
            let hopeful: Vec<usize> = hopeful.iter().copied().filter(fills).collect();
            with_each(self.information, others, &hopeful, |candidate, merit| {
                let shortfall = shortfall_with(unfilled, candidate);
                if self.target.allows(&merit, shortfall) {
                    allowed.push((candidate, merit, shortfall));
                }
            });
            judged += allowed.len();
            for (entering, merit, shortfall) in allowed {
                if vacancy.may_reach(entering, bar) {
                    let cost = vacancy.cost(entering);
                    if cost < bar {
                        bar = cost;
                        best = Some(Exchange { entering, cost, merit, shortfall });
                    }
                }
            }
            if judged >= enough {
                break;
            }
        }
        best
    }

    /// The next candidates of the pool that are not in the set.
    fn next_window(&mut self) -> Vec<usize> {
        let count = self.window.min(self.pool.len());
        let picked = self.pool.iter().cycle().skip(self.cursor).take(count);
        let window = picked.copied().filter(|&candidate| !self.is_in[candidate]).collect();
        self.cursor = (self.cursor + count) % self.pool.len();
        window
    }

    /// Goes back to the best set and replaces a few of its poses at random, within the limit.
    fn kick(&mut self) {
        self.rebuild(self.best.set.clone());
        let places = self.fixed..self.current.set.len();
        if places.is_empty() {
            return;
        }
        for _ in 0..KICKED {
            let place = self.rng.random_range(places.clone());
            for _ in 0..KICK_TRIES {
                let entering = self.pool[self.rng.random_range(0..self.pool.len())];
                let mut set = self.current.set.clone();
                set[place] = entering;
                let within = || {
                    let state = State::new(self.information, self.target, set.clone());
                    self.target.allows(&state.merit, state.shortfall)
                };
                if !self.is_in[entering] && within() {
                    self.rebuild(set);
                    break;
                }
            }
        }
    }

    /// Makes `set` the current one, with matrices from scratch.
    fn rebuild(&mut self, set: Vec<usize>) {
        self.current = State::new(self.information, self.target, set);
        self.mark_members();
    }

    fn mark_members(&mut self) {
        self.is_in = vec![false; self.information.len()];
        for &candidate in &self.current.set {
            self.is_in[candidate] = true;
        }
    }

    /// Adds the candidate that the objective (one of the information matrix) gains most from.
    pub(super) fn grow(&mut self) {
        let rest: Vec<usize> = self.pool.iter().copied().filter(|&candidate| !self.is_in[candidate]).collect();
        let unfilled = self.unfilled(&self.current.set);
        if let Some(found) = self.best_by_merit(&self.current.matrix, unfilled.as_ref(), &rest, f64::INFINITY) {
            let mut set = self.current.set.clone();
            set.push(found.entering);
            self.rebuild(set);
            self.best = self.current.clone();
        }
    }

    /// Number of poses in the set.
    pub(super) const fn poses(&self) -> usize {
        self.current.set.len()
    }

    /// The best set, ascending.
    pub(super) fn set(&self) -> Vec<usize> {
        let mut set = self.best.set.clone();
        set.sort_unstable();
        set
    }

    /// Predicted error of the best set (σ).
    pub(super) fn predicted_error(&self) -> f64 {
        self.best.merit.predicted_error()
    }
}

/// The shortfall with `candidate`; 0 where no range is to be filled.
fn shortfall_with(unfilled: Option<&Unfilled<'_>>, candidate: usize) -> f64 {
    unfilled.map_or(0.0, |unfilled| unfilled.with(candidate))
}

/// Calls `visit` with the merit of the information `others` plus each of `candidates`. Too few other poses leave no inverse to
/// update: each sum is then judged from scratch.
fn with_each(
    information: &Information,
    others: &DMatrix<f64>,
    candidates: &[usize],
    mut visit: impl FnMut(usize, Merit),
) {
    if candidates.is_empty() {
        return;
    }
    if let Some(prediction) = Prediction::new(information, others.clone()) {
        prediction.with_each(information, candidates, visit);
    } else {
        for &candidate in candidates {
            let mut matrix = others.clone();
            add_pose(information, &mut matrix, candidate, 1.0);
            visit(candidate, Merit::new(information, matrix));
        }
    }
}
