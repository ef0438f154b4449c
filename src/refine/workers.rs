//! The pool of tracing threads.

use super::nice::lower_priority;
use super::right_of_way::RightOfWay;
use crate::trace;
use crossbeam_channel::{Receiver, unbounded};
use rayon::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuildError, ThreadPoolBuilder};
use std::cell::Cell;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};

/// A fixed pool of threads that also counts the CPU time they spend on jobs.
pub struct Workers {
    pool: ThreadPool,
    clock: Arc<JobClock>,
}

/// Results in the order of their items, with the rays that they took.
#[derive(Debug)]
pub struct Counted<R> {
    /// The results.
    pub results: Vec<R>,
    /// Rays traced.
    pub rays: u64,
}

/// Work that was handed out and goes on beside what its owner does.
pub struct Underway<S, R> {
    shared: Arc<S>,
    /// The item that nobody has begun.
    next: Arc<AtomicUsize>,
    items: usize,
    work: fn(&S, usize) -> R,
    /// Results by the others, with the numbers of their items.
    done: Receiver<(usize, R)>,
    clock: Arc<JobClock>,
}

/// Parts of a region a thread, if its items are enough: those that are left when the first thread has run out of them are short.
const PARTS: usize = 8;

impl Workers {
    /// A pool of `threads` threads, of low priority if they work beside frames that somebody waits for.
    ///
    /// # Errors
    /// If the system gives no threads.
    pub fn new(threads: usize, beside_frames: bool) -> Result<Self, ThreadPoolBuildError> {
        Self::of(Self::builder(threads, beside_frames))
    }

    /// A pool of the calling thread, which is in no other, and as many more as make `threads`: it takes part in what it hands
    /// out instead of sleeping until that is done.
    ///
    /// # Errors
    /// If the system gives no threads.
    pub fn with_this_thread(threads: usize, beside_frames: bool) -> Result<Self, ThreadPoolBuildError> {
        Self::of(Self::builder(threads, beside_frames).use_current_thread())
    }

    fn builder(threads: usize, beside_frames: bool) -> ThreadPoolBuilder {
        let named = ThreadPoolBuilder::new().num_threads(threads).thread_name(|i| format!("penombre-trace-{i}"));
        named.start_handler(move |_| {
            if beside_frames {
                lower_priority();
            }
        })
    }

    fn of(builder: ThreadPoolBuilder) -> Result<Self, ThreadPoolBuildError> {
        Ok(Self { pool: builder.build()?, clock: Arc::default() })
    }

    /// The same with threads that stand aside while frames are drawn; before they are given any work.
    #[must_use]
    pub fn giving_way_to(self, frames: Arc<RightOfWay>) -> Self {
        Self { clock: Arc::new(JobClock { frames, ..JobClock::default() }), ..self }
    }

    /// Stands aside while a frame is drawn that goes first.
    pub fn give_way(&self) {
        self.clock.frames.give_way();
    }

    /// Items of a part, if fewer than `least` are not worth handing out.
    fn part(&self, items: usize, least: usize) -> usize {
        items.div_ceil(self.pool.current_num_threads() * PARTS).max(least)
    }

    /// Applies `work` to runs of `items` on all threads, in this one if there are no more than `least`: what these cost must be
    /// more than to wake a thread. Results come in the order of the items, whatever the threads do.
    pub fn map_chunks<T: Sync, R: Send>(&self, items: &[T], least: usize, work: impl Fn(&[T]) -> R + Sync) -> Vec<R> {
        let length = self.part(items.len(), least);
        if items.len() <= length {
            return vec![work(items)];
        }
        let timed = |chunk: &[T]| self.clock.time("job", || work(chunk));
        self.pool.install(|| items.par_chunks(length).with_max_len(1).map(timed).collect())
    }

    /// Applies `work` to each item, on all threads if there are many.
    pub fn map<T: Sync + Copy, R: Send>(&self, items: &[T], work: impl Fn(T) -> R + Sync) -> Vec<R> {
        /// Items that take some ten microseconds.
        const FEW: usize = 64;
        let chunks = self.map_chunks(items, FEW, |chunk| chunk.iter().map(|&item| work(item)).collect::<Vec<_>>());
        chunks.into_iter().flatten().collect()
    }

    /// Applies `work` to each item on all threads; it adds the rays that it traces to the count that it is given.
    pub fn map_counting<T: Sync, R: Send>(&self, items: &[T], work: impl Fn(&T, &mut u64) -> R + Sync) -> Counted<R> {
        let chunks = self.map_chunks(items, 1, |chunk| {
            let mut rays = 0;
            let results: Vec<R> = chunk.iter().map(|item| work(item, &mut rays)).collect();
            (results, rays)
        });
        let rays = chunks.iter().map(|(_, rays)| rays).sum();
        Counted { results: chunks.into_iter().flat_map(|(results, _)| results).collect(), rays }
    }

    /// Hands out `work` on items, each by its number, which goes on beside what the caller does next; all that it reads is
    /// `shared`. Regions that the caller hands out meanwhile come first.
    pub fn start<S, R>(&self, shared: S, items: usize, work: fn(&S, usize) -> R) -> Underway<S, R>
    where
        S: Send + Sync + 'static,
        R: Send + 'static,
    {
        let (sender, done) = unbounded();
        let (next, shared) = (Arc::new(AtomicUsize::new(0)), Arc::new(shared));
        let helpers = (self.pool.current_num_threads() - 1).min(items);
        for _ in 0..helpers {
            let (shared, next, sender) = (Arc::downgrade(&shared), Arc::clone(&next), sender.clone());
            let clock = Arc::clone(&self.clock);
            self.pool.spawn(move || {
                while let item = next.fetch_add(1, Ordering::Relaxed)
                    && item < items
                    && let Some(shared) = shared.upgrade()
                {
                    let result = clock.time("gather job", || work(&shared, item));
                    // Before it is done: who has all results is alone with what they were made from.
                    drop(shared);
                    // Nobody waits for it if the engine is gone.
                    let _ = sender.send((item, result));
                    let _ = rayon::yield_now();
                }
            });
        }
        Underway { shared, next, items, work, done, clock: Arc::clone(&self.clock) }
    }

    /// CPU time spent in jobs so far, over all threads, seconds.
    #[must_use]
    pub fn cpu_seconds(&self) -> f64 {
        self.clock.nanoseconds.load(Ordering::Relaxed) as f64 * 1e-9
    }
}

impl<S, R> Underway<S, R> {
    /// Does what nobody else has begun, and waits for the rest; the results, in the order of the items.
    #[must_use]
    pub fn finish(self) -> Vec<R> {
        let Self { shared, next, items, work, done, clock } = self;
        let mut found: Vec<(usize, R)> = Vec::with_capacity(items);
        while let item = next.fetch_add(1, Ordering::Relaxed)
            && item < items
        {
            found.push((item, clock.time("gather job", || work(&shared, item))));
        }
        found.extend(done.iter().take(items - found.len()));
        found.sort_unstable_by_key(|&(item, _)| item);
        found.into_iter().map(|(_, result)| result).collect()
    }
}

/// Counts the CPU time of jobs.
#[derive(Debug, Default)]
struct JobClock {
    /// What goes before jobs.
    frames: Arc<RightOfWay>,
    nanoseconds: AtomicU64,
}

thread_local! {
    /// CPU time that this thread has spent on jobs, of any pool, nanoseconds.
    static IN_JOBS: Cell<u64> = const { Cell::new(0) };
}

impl JobClock {
    /// Does a job, by the name that a trace gives it; it waits for no other.
    fn time<R>(&self, name: &'static str, job: impl FnOnce() -> R) -> R {
        self.frames.give_way();
        let _job = trace::span(name);
        let start = thread_nanoseconds();
        let result = job();
        let spent = thread_nanoseconds() - start;
        self.nanoseconds.fetch_add(spent, Ordering::Relaxed);
        IN_JOBS.set(IN_JOBS.get() + spent);
        result
    }
}

/// CPU time of the calling thread in jobs, nanoseconds.
#[must_use]
pub fn job_nanoseconds() -> u64 {
    IN_JOBS.get()
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

#[cfg(test)]
mod tests {
    use super::*;

    fn busy(number: u64) -> u64 {
        (0..20_000).fold(number, |sum, i| sum.wrapping_mul(31).wrapping_add(i))
    }

    /// Pools that this thread is in, and is not in.
    fn pools(threads: usize) -> [Workers; 2] {
        [Workers::with_this_thread(threads, false), Workers::new(threads, false)]
            .map(|workers| workers.expect("threads"))
    }

    #[test]
    fn results_come_in_the_order_of_the_items_whatever_goes_on_beside() {
        let items: Vec<u64> = (0..500).collect();
        let expected: Vec<u64> = items.iter().map(|&item| busy(item)).collect();
        for threads in [1, 2, 16] {
            let check = move |workers: &Workers, items: &[u64], expected: &[u64]| {
                let underway = workers.start(items.to_vec(), items.len(), |items, item| busy(items[item]));
                assert_eq!(workers.map(items, busy), expected, "beside it");
                assert_eq!(underway.finish(), expected, "{threads} threads");
            };
            let (items, expected) = (items.clone(), expected.clone());
            let thread = std::thread::spawn(move || {
                pools(threads).iter().for_each(|workers| check(workers, &items, &expected));
            });
            thread.join().expect("no panic");
        }
    }

    #[test]
    fn who_has_all_results_is_alone_with_what_they_were_made_from() {
        let workers = Workers::new(4, false).expect("threads");
        for _ in 0..200 {
            let mut read = Arc::new(1_u64);
            let underway = workers.start(Arc::clone(&read), 8, |read, item| **read + item as u64);
            assert_eq!(underway.finish(), (1..9).collect::<Vec<_>>());
            assert!(Arc::get_mut(&mut read).is_some());
        }
    }

    #[test]
    fn jobs_are_counted_once_on_the_thread_that_does_them() {
        let workers = Workers::with_this_thread(1, false).expect("threads");
        let items: Vec<u64> = (0..200).collect();
        let before = (thread_nanoseconds(), job_nanoseconds());
        workers.map_chunks(&items, 1, |chunk| chunk.iter().map(|&item| busy(item)).fold(0, u64::wrapping_add));
        let own = job_nanoseconds() - before.1;
        assert!((own as f64 * 1e-9 - workers.cpu_seconds()).abs() < 1e-9 && own > 0);
        assert!(own <= thread_nanoseconds() - before.0);
        workers.map_chunks(&items[..4], 4, |chunk| busy(chunk[0]));
        assert_eq!(job_nanoseconds() - before.1, own, "what is too little to be handed out is the caller's own work");
    }
}
