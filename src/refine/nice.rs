//! Scheduling priority of the threads that trace rays.

/// Niceness of tracing threads: they use what the rest of the machine leaves, and never delay the thread that draws.
#[cfg(target_os = "linux")]
const NICENESS: i32 = 10;

/// Lowers the priority of the calling thread, where the system has priorities a thread (Linux).
///
/// Elsewhere niceness belongs to the whole process, so that lowering it would slow the drawing thread as well:
/// nothing is done there. A refusal is ignored, since only smoothness under load is at stake.
pub fn lower_priority() {
    #[cfg(target_os = "linux")]
    if rustix::process::getpriority_process(None).is_ok_and(|present| present < NICENESS) {
        // `None` is the calling thread: Linux keeps niceness by thread, in deviation from POSIX [setpriority(2)].
        let _ = rustix::process::setpriority_process(None, NICENESS);
    }
}

#[cfg(all(test, target_os = "linux"))]
mod tests {
    use super::*;

    #[test]
    fn only_the_calling_thread_is_lowered() {
        let niceness = || rustix::process::getpriority_process(None).expect("niceness");
        let before = niceness();
        let lowered = std::thread::spawn(move || {
            lower_priority();
            lower_priority();
            niceness()
        });
        assert_eq!(lowered.join().expect("thread"), before.max(NICENESS));
        assert_eq!(niceness(), before);
    }
}
