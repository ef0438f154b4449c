//! CPU time by what threads do.

use crate::log::summary::ThreadTimes;
use crate::system::{self, ThreadTime};

/// Names of the threads of this program, as [`crate::refine::workers`] and [`crate::refine::thread`] give them; the system keeps 15
/// bytes.
const TRACING: &str = "penombre-trace";
const ENGINE: &str = "penombre-engine";

/// CPU time of this process by what its threads do; `None` where the system does not tell. Engines are to be alive, still. The
/// engine's own thread takes part in tracing: `own_job_seconds` of its time.
#[must_use]
pub fn thread_times(own_job_seconds: f64) -> Option<ThreadTimes> {
    let living = system::threads()?;
    Some(with_own_jobs(sorted(&living, system::cpu_seconds()?), own_job_seconds))
}

/// Counts the jobs of the engine's own thread as what they are.
fn with_own_jobs(times: ThreadTimes, seconds: f64) -> ThreadTimes {
    ThreadTimes { tracing: times.tracing + seconds, engine: times.engine - seconds, ..times }
}

/// Sorts the time of living threads by their names; what is left of the `whole` are threads that have ended.
fn sorted(living: &[ThreadTime], whole: f64) -> ThreadTimes {
    let main = living.iter().find(|thread| thread.is_main).map_or("", |thread| thread.name.as_str());
    let mut times = ThreadTimes::default();
    for ThreadTime { name, seconds, .. } in living {
        let kind = match name.as_str() {
            name if name.starts_with(TRACING) => &mut times.tracing,
            name if name.starts_with(ENGINE) => &mut times.engine,
            // Its pool takes its name.
            name if name == main => &mut times.main,
            _ => &mut times.rasteriser,
        };
        *kind += seconds;
    }
    times.ended = (whole - living.iter().map(|thread| thread.seconds).sum::<f64>()).max(0.0);
    times
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn threads_are_known_by_their_names() {
        let thread = |name: &str, seconds| ThreadTime { name: name.to_owned(), is_main: seconds == 1.0, seconds };
        let living = [
            thread("penombre-engine", 8.0),
            thread("penombre", 1.0),
            thread("penombre", 2.0),
            thread("penombre-trace-", 16.0),
            thread("penombre-trace-", 32.0),
            thread("llvmpipe-0", 64.0),
            thread("penombre-gpu-se", 128.0),
        ];
        let times = ThreadTimes { tracing: 48.0, engine: 8.0, main: 3.0, rasteriser: 192.0, ended: 4.0 };
        assert_eq!(sorted(&living, 255.0), times);
        assert_eq!(sorted(&living, 250.0).ended, 0.0, "clocks are read one after the other");
        assert_eq!(with_own_jobs(times, 5.0), ThreadTimes { tracing: 53.0, engine: 3.0, ..times });
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn the_names_are_those_of_the_threads() {
        use crate::refine::workers::Workers;
        let workers = Workers::new(1, false).expect("threads");
        let items = vec![0_u64; 1000];
        let busy = |&item: &u64| (0..20_000).fold(item, |sum, i| sum.wrapping_mul(31).wrapping_add(i));
        workers.map_chunks(&items, 1, |chunk| chunk.iter().map(busy).fold(0, u64::wrapping_add));
        let times = thread_times(0.0).expect("times");
        assert!(times.tracing >= 0.5 * workers.cpu_seconds() && times.tracing > 0.0, "{times:?}");
    }
}
