//! Where a job runs with shifted positions: between `SFTON` and `SFTOF`, through jumps, and across the jobs that call each other.

use std::collections::{BTreeMap, BTreeSet};

use super::super::findings::Source;
use super::reader::lines;

/// Lines of the program whose moves may be shifted.
pub(super) struct Shifts(BTreeSet<usize>);

/// What matters for shifts in one line of a job.
enum Step {
    On,
    Off,
    Label(String),
    Jump(String),
    Call(String),
    Other,
}

/// A job of the given files.
#[derive(Default)]
struct Job {
    name: String,
    steps: Vec<(usize, Step)>,
}

impl Job {
    fn read(text: &[u8]) -> Self {
        let mut job = Self::default();
        let mut is_program = false;
        for (number, _, line) in lines(text) {
            if let Some(name) = line.strip_prefix("//NAME ") {
                name.trim().clone_into(&mut job.name);
            } else if line == "//INST" {
                is_program = true;
            } else if is_program {
                job.steps.push((number, Step::read(&line)));
            }
        }
        job
    }

    /// Whether the shift holds at each step and at the end, if it does at the beginning or not. `ends` says of each job whether it
    /// may end with a shift that it switched on.
    fn states(&self, is_shifted: bool, ends: &BTreeMap<String, bool>) -> (Vec<bool>, bool) {
        let mut at_label: BTreeMap<&str, bool> = BTreeMap::new();
        let mut states = Vec::new();
        // A jump back may bring a shift to its label; the second round finds it there.
        for _ in 0..2 {
            let mut state = is_shifted;
            states.clear();
            for (_, step) in &self.steps {
                match step {
                    Step::On => state = true,
                    Step::Off => state = false,
                    Step::Label(name) => state |= at_label.get(name.as_str()).copied().unwrap_or(false),
                    Step::Jump(name) => *at_label.entry(name).or_default() |= state,
                    Step::Call(name) => state |= ends.get(name).copied().unwrap_or(false),
                    Step::Other => {}
                }
                states.push(state);
            }
        }
        let is_shifted_at_end = states.last().copied().unwrap_or(is_shifted);
        (states, is_shifted_at_end)
    }
}

impl Step {
    fn read(line: &str) -> Self {
        if let Some(label) = line.strip_prefix('*') {
            return Self::Label(label.trim().to_owned());
        }
        let mut words = line.split_whitespace();
        match words.next() {
            Some("SFTON") => Self::On,
            Some("SFTOF") => Self::Off,
            Some("JUMP") => match words.next().and_then(|word| word.strip_prefix('*')) {
                Some(label) => Self::Jump(label.to_owned()),
                None => Self::Other,
            },
            Some("CALL") => match words.next().and_then(|word| word.strip_prefix("JOB:")) {
                Some(job) => Self::Call(job.to_owned()),
                None => Self::Other,
            },
            _ => Self::Other,
        }
    }
}

impl Shifts {
    pub(super) fn of(source: &Source<'_>) -> Self {
        let jobs: Vec<Job> = source.files().map(|(_, text)| Job::read(text)).collect();
        let mut ends: BTreeMap<String, bool> = BTreeMap::new();
        let mut begins: BTreeMap<String, bool> = BTreeMap::new();
        // A job inherits the shift of its caller, and a caller that of the job that it calls: at most one change per job and round.
        for _ in 0..=2 * jobs.len() {
            let before = (ends.clone(), begins.clone());
            for job in &jobs {
                let is_shifted = begins.get(&job.name).copied().unwrap_or(false);
                let (states, end) = job.states(is_shifted, &ends);
                *ends.entry(job.name.clone()).or_default() |= end;
                for ((_, step), state) in job.steps.iter().zip(states) {
                    if let (Step::Call(name), true) = (step, state) {
                        begins.insert(name.clone(), true);
                    }
                }
            }
            if before == (ends.clone(), begins.clone()) {
                break;
            }
        }
        let Some(program) = jobs.first() else { return Self(BTreeSet::new()) };
        let is_shifted = begins.get(&program.name).copied().unwrap_or(false);
        let (states, _) = program.states(is_shifted, &ends);
        Self(program.steps.iter().zip(states).filter(|(_, state)| *state).map(|((number, _), _)| *number).collect())
    }

    /// Whether the moves of this line may be shifted.
    pub(super) fn holds(&self, line: usize) -> bool {
        self.0.contains(&line)
    }
}
