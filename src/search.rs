//! The starts of a pose search, spread over threads.
//!
//! Every start is a pure function of the settings and its number, and a stage begins when all starts of the one before are done:
//! the result does not depend on the number of threads.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;

use crate::planning::{Chosen, PlanningError, Progress, Search, Stage};

/// Threads that the machine can run at once: one per core, as far as is known.
pub fn available_threads() -> usize {
    thread::available_parallelism().map_or(1, usize::from)
}

/// Runs a search on up to `threads` threads named `search-0`, `search-1`, …; the calling thread waits.
///
/// `keep_going` is asked before every exchange and may come from any thread; once it says no, the best set so far is returned.
/// `progress` receives every sweep, from any thread.
///
/// # Errors
/// No start found a set that determines what the pool can.
pub fn plan_in_parallel(
    search: &Search<'_>,
    threads: usize,
    keep_going: &(dyn Fn() -> bool + Sync),
    progress: &(dyn Fn(&Progress) + Sync),
) -> Result<Chosen, PlanningError> {
    search.run_with(&mut |stage, from| {
        let starts = search.settings().starts;
        let next = AtomicUsize::new(0);
        let work = || work_off(search, stage, from, &next, keep_going, progress);
        let mut results = thread::scope(|scope| {
            let spawn = |index| thread::Builder::new().name(format!("search-{index}")).spawn_scoped(scope, work);
            // A thread that the system refuses leaves its share to the others, in the end to this thread.
            let handles: Vec<_> = (0..threads.min(starts)).map_while(|index| spawn(index).ok()).collect();
            let mut results = if handles.is_empty() { work() } else { Vec::new() };
            for handle in handles {
                match handle.join() {
                    Ok(part) => results.extend(part),
                    Err(panic) => std::panic::resume_unwind(panic),
                }
            }
            results
        });
        results.sort_by_key(|(start, _)| *start);
        results.into_iter().map(|(_, chosen)| chosen).collect()
    })
}

/// The results of `one` and `other`, found side by side where there is a second thread.
pub fn side_by_side<A: Send, B>(threads: usize, one: impl Fn() -> A + Sync, other: impl FnOnce() -> B) -> (A, B) {
    if threads < 2 {
        return (one(), other());
    }
    thread::scope(|scope| match thread::Builder::new().name("search-figures".to_owned()).spawn_scoped(scope, &one) {
        Ok(handle) => {
            let other = other();
            (handle.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic)), other)
        }
        Err(_) => (one(), other()),
    })
}

/// Takes start after start until none is left.
fn work_off(
    search: &Search<'_>,
    stage: Stage,
    from: &[Chosen],
    next: &AtomicUsize,
    keep_going: &(dyn Fn() -> bool + Sync),
    progress: &(dyn Fn(&Progress) + Sync),
) -> Vec<(usize, Chosen)> {
    std::iter::repeat_with(|| next.fetch_add(1, Ordering::Relaxed))
        .take_while(|&start| start < search.settings().starts)
        .map(|start| (start, search.start(stage, start, from.get(start), keep_going, progress)))
        .collect()
}
