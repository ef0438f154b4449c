//! How the threads that trace rays share the cores with all others.

/// What a thread gets of a core that others want, too.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ThreadPriority {
    /// As much as they.
    #[default]
    Equal,
    /// A tenth, beside one that draws: it is never delayed by much.
    Low,
    /// Next to nothing: what a window's frames leave. They take a sixth less time than beside threads of low priority, on two cores that draw, too
    /// (docs/notebook/clock.md).
    Idle,
}

/// Niceness of threads of low priority.
#[cfg(target_os = "linux")]
const NICENESS: i32 = 10;

impl ThreadPriority {
    /// Gives it to the calling thread, where the system has priorities a thread (Linux).
    ///
    /// Elsewhere niceness belongs to the whole process, so that lowering it would slow the drawing thread as well:
    /// nothing is done there. A refusal is ignored, since only smoothness under load is at stake.
    pub fn take(self) {
        #[cfg(target_os = "linux")]
        match self {
            Self::Equal => {}
            Self::Low => be_nice(),
            Self::Idle => run_when_idle(),
        }
    }
}

#[cfg(target_os = "linux")]
fn be_nice() {
    if rustix::process::getpriority_process(None).is_ok_and(|present| present < NICENESS) {
        // `None` is the calling thread: Linux keeps niceness by thread, in deviation from POSIX [setpriority(2)].
        let _ = rustix::process::setpriority_process(None, NICENESS);
    }
}

/// The policy `SCHED_IDLE` [sched(7)].
#[cfg(target_os = "linux")]
fn run_when_idle() {
    use thread_priority::{NormalThreadSchedulePolicy, ThreadSchedulePolicy};
    let policy = ThreadSchedulePolicy::Normal(NormalThreadSchedulePolicy::Idle);
    let thread = thread_priority::thread_native_id();
    let _ = thread_priority::set_thread_priority_and_policy(thread, thread_priority::ThreadPriority::Min, policy);
}

#[cfg(all(test, target_os = "linux"))]
mod tests {
    use super::*;

    #[test]
    fn only_the_calling_thread_is_lowered() {
        let niceness = || rustix::process::getpriority_process(None).expect("niceness");
        let before = niceness();
        let lowered = std::thread::spawn(move || {
            ThreadPriority::Low.take();
            ThreadPriority::Low.take();
            niceness()
        });
        assert_eq!(lowered.join().expect("thread"), before.max(NICENESS));
        assert_eq!(niceness(), before);
    }

    #[test]
    fn a_thread_runs_when_its_core_is_idle() {
        let policy = || thread_priority::thread_schedule_policy().expect("policy");
        let before = policy();
        let idle = std::thread::spawn(move || {
            ThreadPriority::Idle.take();
            policy()
        });
        let of_idle = thread_priority::NormalThreadSchedulePolicy::Idle;
        assert_eq!(idle.join().expect("thread"), thread_priority::ThreadSchedulePolicy::Normal(of_idle));
        assert_eq!(policy(), before);
    }
}
