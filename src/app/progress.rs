//! Progress on stderr for solves that take longer than half a second.

use std::io::Write;
use std::time::{Duration, Instant};

use crate::identification::Iteration;

/// Silence before the first line, and between two lines.
const INTERVAL: Duration = Duration::from_millis(500);

/// Prints solver steps, but only when there is time to read them.
#[derive(Debug)]
pub(super) struct Progress<'a, W: Write> {
    out: &'a mut W,
    last: Instant,
    steps: usize,
}

impl<'a, W: Write> Progress<'a, W> {
    #[expect(clippy::disallowed_methods, reason = "the edge of the program may look at the clock")]
    pub(super) fn new(out: &'a mut W) -> Self {
        Self { out, last: Instant::now(), steps: 0 }
    }

    /// Takes note of a step.
    pub(super) fn step(&mut self, iteration: &Iteration) {
        self.steps += 1;
        if self.last.elapsed() >= INTERVAL {
            #[expect(clippy::disallowed_methods, reason = "the edge of the program may look at the clock")]
            let now = Instant::now();
            self.last = now;
            // Nobody may be listening.
            drop(writeln!(
                self.out,
                "identifying: step {}, cost {:.6e}, largest change {:.1e} expected deviations",
                self.steps, iteration.cost, iteration.step
            ));
        }
    }
}
