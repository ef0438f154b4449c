//! The pool of tracing threads.

use super::nice::lower_priority;
use rayon::ThreadPool;
use rayon::prelude::*;
use std::sync::atomic::{AtomicU64, Ordering};

/// A fixed pool of threads that also counts the CPU time they spend on jobs.
pub struct Workers {
    pool: ThreadPool,
    nanoseconds: AtomicU64,
}

/// Results in the order of their items, with the rays that they took.
#[derive(Debug)]
pub struct Counted<R> {
    /// The results.
    pub results: Vec<R>,
    /// Rays traced.
    pub rays: u64,
}

impl Workers {
    /// A pool of `threads` threads, of low priority if they work beside frames that somebody waits for.
    ///
    /// # Errors
    /// If the system gives no threads.
    pub fn new(threads: usize, beside_frames: bool) -> Result<Self, rayon::ThreadPoolBuildError> {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .thread_name(|i| format!("penombre-trace-{i}"))
            .start_handler(move |_| {
                if beside_frames {
                    lower_priority();
                }
            })
            .build()?;
        Ok(Self { pool, nanoseconds: AtomicU64::new(0) })
    }

    /// Applies `work` to runs of `items` on all threads; results come in the order of the items, whatever the threads
    /// do.
    pub fn map_chunks<T: Sync, R: Send>(&self, items: &[T], work: impl Fn(&[T]) -> R + Sync) -> Vec<R> {
        let length = items.len().div_ceil(self.pool.current_num_threads() * 4).max(1);
        self.pool.install(|| {
            items
                .par_chunks(length)
                .map(|chunk| {
                    let start = thread_nanoseconds();
                    let result = work(chunk);
                    self.nanoseconds.fetch_add(thread_nanoseconds() - start, Ordering::Relaxed);
                    result
                })
                .collect()
        })
    }

    /// Applies `work` to each item, on all threads if there are many: what it costs must be more than to wake them.
    pub fn map<T: Sync + Copy, R: Send>(&self, items: &[T], work: impl Fn(T) -> R + Sync) -> Vec<R> {
        /// Items that take some ten microseconds.
        const FEW: usize = 64;
        if items.len() <= FEW {
            return items.iter().map(|&item| work(item)).collect();
        }
        let chunks = self.map_chunks(items, |chunk| chunk.iter().map(|&item| work(item)).collect::<Vec<_>>());
        chunks.into_iter().flatten().collect()
    }

    /// Applies `work` to each item on all threads; it adds the rays that it traces to the count that it is given.
    pub fn map_counting<T: Sync, R: Send>(&self, items: &[T], work: impl Fn(&T, &mut u64) -> R + Sync) -> Counted<R> {
        let chunks = self.map_chunks(items, |chunk| {
            let mut rays = 0;
            let results: Vec<R> = chunk.iter().map(|item| work(item, &mut rays)).collect();
            (results, rays)
        });
        let rays = chunks.iter().map(|(_, rays)| rays).sum();
        Counted { results: chunks.into_iter().flat_map(|(results, _)| results).collect(), rays }
    }

    /// CPU time spent in jobs so far, over all threads, seconds.
    #[must_use]
    pub fn cpu_seconds(&self) -> f64 {
        self.nanoseconds.load(Ordering::Relaxed) as f64 * 1e-9
    }
}

/// CPU time of the calling thread, nanoseconds from some start.
#[cfg(unix)]
#[must_use]
pub fn thread_nanoseconds() -> u64 {
    let time = rustix::time::clock_gettime(rustix::time::ClockId::ThreadCPUTime);
    time.tv_sec as u64 * 1_000_000_000 + time.tv_nsec as u64
}

/// Wall time stands in for CPU time where the system has no such clock in reach.
#[cfg(not(unix))]
#[must_use]
pub fn thread_nanoseconds() -> u64 {
    static START: std::sync::OnceLock<std::time::Instant> = std::sync::OnceLock::new();
    START.get_or_init(std::time::Instant::now).elapsed().as_nanos() as u64
}
