//! What the system tells of this process and of the machine: CPU clocks, memory, load. `None` where it does not: threads, memory and load
//! are read from /proc, on Linux.

use serde::Serialize;
use std::ffi::{c_int, c_void};

/// Whether a shared library can be loaded, by the name that programs ask for.
#[allow(unsafe_code, reason = "libraries of the window system run no code of their own when they are loaded")]
#[must_use]
pub fn can_load(library: &str) -> bool {
    // SAFETY: the library is one that the window is about to load and to use, and its symbols are not looked at here.
    unsafe { libloading::Library::new(library) }.is_ok()
}

/// Has Xlib call a function when its connection to the display breaks. Xlib ends the process, with status 1, if that returns. Without Xlib
/// nothing happens.
#[allow(unsafe_code, reason = "a function of Xlib is called by its name")]
pub fn when_x11_breaks(handler: extern "C" fn(*mut c_void) -> c_int) {
    type SetHandler = unsafe extern "C" fn(extern "C" fn(*mut c_void) -> c_int) -> *mut c_void;
    // SAFETY: the function has this signature in every Xlib, and may be called at any time; the library stays loaded for ever, since
    // it now has a pointer into this program, as this program may have into it.
    unsafe {
        let Ok(xlib) = libloading::Library::new("libX11.so.6") else { return };
        if let Ok(set) = xlib.get::<SetHandler>(b"XSetIOErrorHandler\0") {
            set(handler);
        }
        std::mem::forget(xlib);
    }
}

/// CPU time of a living thread of this process.
#[derive(Clone, Debug, PartialEq)]
pub struct ThreadTime {
    /// Its name as the system has it: the first 15 bytes, or that of the thread that started it if it was given none.
    pub name: String,
    /// Whether it is the thread that the process started with.
    pub is_main: bool,
    /// Seconds.
    pub seconds: f64,
}

/// The machine, as results pages name it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Machine {
    /// Name of the processor.
    pub processor: Option<String>,
    /// Threads that it can run at once, as far as they are this process's.
    pub cores: usize,
    /// Bytes.
    pub memory: Option<u64>,
    /// Name of the operating system.
    pub system: &'static str,
}

impl Machine {
    /// This one.
    #[must_use]
    pub fn this() -> Self {
        Self {
            processor: of_machine::processor(),
            cores: std::thread::available_parallelism().map_or(1, usize::from),
            memory: of_machine::memory(),
            system: std::env::consts::OS,
        }
    }
}

/// CPU time of this process, all threads, those that have ended, too, seconds.
#[cfg(unix)]
#[must_use]
pub fn cpu_seconds() -> Option<f64> {
    let time = rustix::time::clock_gettime(rustix::time::ClockId::ProcessCPUTime);
    Some(time.tv_sec as f64 + time.tv_nsec as f64 * 1e-9)
}

/// CPU time of the processes that this one has started and waited for, seconds.
#[cfg(unix)]
#[must_use]
pub fn children_cpu_seconds() -> Option<f64> {
    use nix::sys::resource::{UsageWho, getrusage};
    let usage = getrusage(UsageWho::RUSAGE_CHILDREN).ok()?;
    let times = [usage.user_time(), usage.system_time()];
    Some(times.iter().map(|time| time.tv_sec() as f64 + time.tv_usec() as f64 * 1e-6).sum())
}

/// CPU time of this process, which is not known here.
#[cfg(not(unix))]
#[must_use]
pub const fn cpu_seconds() -> Option<f64> {
    None
}

/// CPU time of the processes that this one has waited for, which is not known here.
#[cfg(not(unix))]
#[must_use]
pub const fn children_cpu_seconds() -> Option<f64> {
    None
}

/// The living threads of this process.
#[must_use]
pub fn threads() -> Option<Vec<ThreadTime>> {
    of_machine::threads()
}

/// Memory that programs can still have without others being written to disk, bytes.
#[must_use]
pub fn available_memory() -> Option<u64> {
    of_machine::available_memory()
}

/// The most memory that this process has held at once, bytes.
#[must_use]
pub fn peak_memory() -> Option<u64> {
    of_machine::peak_memory()
}

/// The memory that this process holds now, bytes.
#[must_use]
pub fn resident_memory() -> Option<u64> {
    of_machine::resident_memory()
}

/// Threads that ran or waited for a core, the mean of about a minute.
#[must_use]
pub fn load_average() -> Option<f32> {
    of_machine::load_average()
}

#[cfg(target_os = "linux")]
mod of_machine {
    use super::ThreadTime;
    use procfs::process::{Process, Task};
    use procfs::{CpuInfo, Current as _, LoadAverage, Meminfo};

    pub fn processor() -> Option<String> {
        CpuInfo::current().ok()?.model_name(0).map(str::to_owned)
    }

    pub fn memory() -> Option<u64> {
        Some(Meminfo::current().ok()?.mem_total)
    }

    pub fn available_memory() -> Option<u64> {
        Meminfo::current().ok()?.mem_available
    }

    pub fn threads() -> Option<Vec<ThreadTime>> {
        let time = |task: Task| {
            let nanoseconds = task.schedstat().ok()?.sum_exec_runtime;
            let (name, is_main) = (task.stat().ok()?.comm, task.tid == task.pid);
            Some(ThreadTime { name, is_main, seconds: nanoseconds as f64 * 1e-9 })
        };
        let tasks = Process::myself().ok()?.tasks().ok()?;
        // A thread may end while it is looked at.
        let times: Vec<ThreadTime> = tasks.filter_map(|task| time(task.ok()?)).collect();
        (!times.is_empty()).then_some(times)
    }

    pub fn peak_memory() -> Option<u64> {
        const KIB: u64 = 1024;
        Some(Process::myself().ok()?.status().ok()?.vmhwm? * KIB)
    }

    pub fn resident_memory() -> Option<u64> {
        const KIB: u64 = 1024;
        Some(Process::myself().ok()?.status().ok()?.vmrss? * KIB)
    }

    pub fn load_average() -> Option<f32> {
        Some(LoadAverage::current().ok()?.one)
    }
}

#[cfg(not(target_os = "linux"))]
mod of_machine {
    use super::ThreadTime;

    pub const fn processor() -> Option<String> {
        None
    }

    pub const fn memory() -> Option<u64> {
        None
    }

    pub const fn available_memory() -> Option<u64> {
        None
    }

    pub const fn threads() -> Option<Vec<ThreadTime>> {
        None
    }

    pub const fn peak_memory() -> Option<u64> {
        None
    }

    pub const fn resident_memory() -> Option<u64> {
        None
    }

    pub const fn load_average() -> Option<f32> {
        None
    }
}

#[cfg(all(test, target_os = "linux"))]
mod tests {
    use super::*;
    use std::time::{Duration, Instant};

    /// Keeps a core busy.
    fn work(time: Duration) {
        let start = Instant::now();
        while start.elapsed() < time {}
    }

    #[test]
    fn a_thread_s_time_is_its_own_and_the_process_s() {
        let (to_end, end) = std::sync::mpsc::channel::<()>();
        let (to_tell, told) = std::sync::mpsc::channel();
        let before = cpu_seconds().unwrap();
        let thread = std::thread::Builder::new().name("busy-for-a-while-long".to_owned()).spawn(move || {
            work(Duration::from_millis(60));
            to_tell.send(()).unwrap();
            let _ = end.recv();
        });
        told.recv().unwrap();
        let threads = threads().unwrap();
        let busy = threads.iter().find(|thread| thread.name == "busy-for-a-whil").unwrap();
        assert!(!busy.is_main && busy.seconds > 0.005 && busy.seconds < 1.0, "{busy:?}");
        assert_eq!(threads.iter().filter(|thread| thread.is_main).count(), 1);
        assert!(cpu_seconds().unwrap() - before >= busy.seconds);
        drop(to_end);
        thread.unwrap().join().unwrap();
    }

    #[test]
    fn a_child_s_time_is_known_once_it_is_waited_for() {
        let before = children_cpu_seconds().unwrap();
        let line = "i=0; while [ $i -lt 30000 ]; do i=$((i+1)); done";
        assert!(std::process::Command::new("sh").args(["-c", line]).status().unwrap().success());
        let spent = children_cpu_seconds().unwrap() - before;
        assert!(spent > 0.001 && spent < 10.0, "{spent}");
    }

    #[test]
    fn the_machine_is_known() {
        let machine = Machine::this();
        assert!(machine.cores > 0 && machine.memory.unwrap() > 1 << 28, "{machine:?}");
        assert!(peak_memory().unwrap() > 1 << 20 && load_average().is_some());
    }
}
