//! Progress on stderr for work that takes longer than half a second, and the time it took.

use std::io::Write;
use std::time::{Duration, Instant};

use crate::identification::{Iteration, Stage};

/// Least time before the first line, and between two lines.
const INTERVAL: Duration = Duration::from_millis(500);

/// Measures the time since it was created.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stopwatch {
    started: Instant,
}

impl Stopwatch {
    #[expect(clippy::disallowed_methods, reason = "the edge of the program may look at the clock")]
    pub(super) fn new() -> Self {
        Self { started: Instant::now() }
    }

    /// Seconds since it was created.
    pub(super) fn seconds(&self) -> f64 {
        self.started.elapsed().as_secs_f64()
    }
}

/// Prints progress lines, at most one per interval.
#[derive(Debug)]
pub(super) struct Progress<'a, W: Write> {
    out: &'a mut W,
    last: Stopwatch,
    steps: usize,
}

impl<'a, W: Write> Progress<'a, W> {
    pub(super) fn new(out: &'a mut W) -> Self {
        Self { out, last: Stopwatch::new(), steps: 0 }
    }

    /// Prints a line about what an identification is doing.
    pub(super) fn identifying(&mut self, stage: Stage) {
        match stage {
            Stage::Step(Iteration { cost, step, .. }) => {
                self.steps += 1;
                let steps = self.steps;
                self.say(|| {
                    format!("identifying: step {steps}, cost {cost:.6e}, largest change {step:.1e} expected deviations")
                });
            }
            Stage::Candidate { number, of, terms } => {
                self.say(|| format!("identifying: model {number} of {of}: {terms}"));
            }
        }
    }

    /// Prints a line if the last one was long enough ago.
    pub(super) fn say(&mut self, text: impl FnOnce() -> String) {
        if self.last.seconds() >= INTERVAL.as_secs_f64() {
            self.last = Stopwatch::new();
            // Progress is optional: a closed stderr is not a failure.
            drop(writeln!(self.out, "{}", text()));
        }
    }
}
