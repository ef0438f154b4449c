//! What threads and the device do when, for a time line: spans, instants and counters. They are kept in memory until a run is over;
//! `log::trace_file` writes them.
//!
//! While nothing is recorded, a call costs one branch. While something is, each thread has a list of its own, whose memory is reserved
//! at its first event and used as it fills; what comes after it is full is counted and dropped.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// Events that are kept of a thread: 24 MiB, some minutes of the engine's own.
const MOST: usize = 1 << 19;

static ON: AtomicBool = AtomicBool::new(false);
static TRACKS: Mutex<Vec<Arc<Track>>> = Mutex::new(Vec::new());

thread_local! {
    static OWN: Arc<Track> = Track::of_this_thread();
}

/// Something that happened.
#[derive(Clone, Debug, PartialEq)]
pub struct Event {
    /// What it was.
    pub name: &'static str,
    /// When it began, nanoseconds by [`now`].
    pub at: u64,
    /// What else there is to say.
    pub kind: Kind,
}

/// What an event is.
#[derive(Clone, Debug, PartialEq)]
pub enum Kind {
    /// It went on until then, nanoseconds by [`now`].
    Span(u64),
    /// It took no time; with details, if there are any.
    Instant(Option<Box<str>>),
    /// A quantity changed to this.
    Counter(f64),
}

/// Events of one thread, or of the device by one clock.
#[derive(Debug)]
struct Track {
    name: String,
    of_device: bool,
    events: Mutex<Vec<Event>>,
    dropped: AtomicU64,
}

impl Track {
    fn of_this_thread() -> Arc<Self> {
        let thread = std::thread::current();
        // Those of the common pool have no names.
        let pooled = || rayon::current_thread_index().map(|index| format!("pool {index}"));
        let name = thread.name().map(str::to_owned).or_else(pooled).unwrap_or_else(|| format!("{:?}", thread.id()));
        Self::add(&mut tracks(), name, false)
    }

    fn add(tracks: &mut Vec<Arc<Self>>, name: String, of_device: bool) -> Arc<Self> {
        let track = Arc::new(Self { name, of_device, events: Mutex::default(), dropped: AtomicU64::new(0) });
        tracks.push(Arc::clone(&track));
        track
    }

    fn events(&self) -> MutexGuard<'_, Vec<Event>> {
        // A list of whole events, whatever panicked.
        self.events.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Nobody else holds the lock but at the end, when the list is taken.
    fn push(&self, event: Event) {
        let mut events = self.events();
        if events.capacity() == 0 {
            events.reserve_exact(MOST);
        }
        if events.len() < MOST {
            events.push(event);
        } else {
            self.dropped.fetch_add(1, Ordering::Relaxed);
        }
    }

    fn take(&self) -> Recorded {
        let (name, events) = (self.name.clone(), std::mem::take(&mut *self.events()));
        Recorded { name, of_device: self.of_device, events, dropped: self.dropped.swap(0, Ordering::Relaxed) }
    }
}

fn tracks() -> MutexGuard<'static, Vec<Arc<Track>>> {
    TRACKS.lock().unwrap_or_else(PoisonError::into_inner)
}

/// What was recorded of one thread, or of the device.
#[derive(Clone, Debug, PartialEq)]
pub struct Recorded {
    /// Name of the thread; of the device, how its clock was compared with this one.
    pub name: String,
    /// Whether it is the device's.
    pub of_device: bool,
    /// In the order of their ends.
    pub events: Vec<Event>,
    /// How many more there were.
    pub dropped: u64,
}

/// Begins to record.
pub fn start() {
    ON.store(true, Ordering::Relaxed);
}

/// Ends recording; what was recorded, tracks without events left out.
#[must_use]
pub fn stop() -> Vec<Recorded> {
    ON.store(false, Ordering::Relaxed);
    let mut tracks = tracks();
    let recorded = tracks.iter().map(|track| track.take()).filter(|track| !track.events.is_empty()).collect();
    // Those of threads that have ended, and of the device.
    tracks.retain(|track| Arc::strong_count(track) > 1);
    recorded
}

/// Whether anything is recorded.
#[inline]
#[must_use]
pub fn is_on() -> bool {
    ON.load(Ordering::Relaxed)
}

/// Nanoseconds by the system's monotonic clock, which is the one that Vulkan calls `CLOCK_MONOTONIC`.
#[cfg(unix)]
#[must_use]
pub fn now() -> u64 {
    let time = rustix::time::clock_gettime(rustix::time::ClockId::Monotonic);
    time.tv_sec as u64 * 1_000_000_000 + time.tv_nsec as u64
}

/// Nanoseconds by a clock that goes evenly.
#[cfg(not(unix))]
#[must_use]
pub fn now() -> u64 {
    static START: std::sync::OnceLock<std::time::Instant> = std::sync::OnceLock::new();
    START.get_or_init(std::time::Instant::now).elapsed().as_nanos() as u64
}

/// A span of this thread, which ends when it is dropped.
#[must_use = "a span ends when it is dropped"]
pub struct Span {
    name: &'static str,
    /// `None` if nothing is recorded.
    from: Option<u64>,
}

/// Begins a span of this thread.
#[inline]
pub fn span(name: &'static str) -> Span {
    Span { name, from: is_on().then(now) }
}

/// Does something in a span of this thread.
#[inline]
pub fn within<R>(name: &'static str, what: impl FnOnce() -> R) -> R {
    let _span = span(name);
    what()
}

impl Drop for Span {
    #[inline]
    fn drop(&mut self) {
        if let Some(from) = self.from.filter(|_| is_on()) {
            record(self.name, from, Kind::Span(now()));
        }
    }
}

/// Something that this thread does now; `detail` is asked only while something is recorded.
pub fn instant(name: &'static str, detail: impl FnOnce() -> Option<String>) {
    if is_on() {
        record(name, now(), Kind::Instant(detail().map(String::into_boxed_str)));
    }
}

/// A quantity, now.
#[inline]
pub fn counter(name: &'static str, value: f64) {
    if is_on() {
        record(name, now(), Kind::Counter(value));
    }
}

/// Something that the device did; `clock` says how its clock was compared with [`now`].
pub fn device_span(clock: &'static str, name: &'static str, (from, until): (u64, u64)) {
    if !is_on() {
        return;
    }
    let mut tracks = tracks();
    let known = tracks.iter().find(|track| track.of_device && track.name == clock).cloned();
    let track = known.unwrap_or_else(|| Track::add(&mut tracks, clock.to_owned(), true));
    track.push(Event { name, at: from, kind: Kind::Span(until) });
}

#[inline(never)]
fn record(name: &'static str, at: u64, kind: Kind) {
    // Fails while the thread ends.
    let _ = OWN.try_with(|track| track.push(Event { name, at, kind }));
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What a thread of a name recorded: other tests may record at the same time.
    fn of<'a>(recorded: &'a [Recorded], name: &str) -> &'a Recorded {
        recorded.iter().find(|track| track.name == name).unwrap_or_else(|| panic!("no {name} in {recorded:?}"))
    }

    fn on_thread(name: &str, work: impl FnOnce() + Send + 'static) {
        std::thread::Builder::new().name(name.to_owned()).spawn(work).expect("a thread").join().expect("no panic");
    }

    #[test]
    fn each_thread_has_its_events_and_a_bound() {
        within("before", || counter("before", 1.0));
        start();
        on_thread("spans", || {
            within("outer", || within("inner", || instant("now", || Some("what".to_owned()))));
            counter("things", 2.5);
        });
        on_thread("busy", || (0..MOST + 3).for_each(|_| counter("many", 0.0)));
        device_span("a clock", "pass", (5, 7));
        let recorded = stop();
        within("after", || counter("after", 1.0));
        let [instant, inner, outer, counter] = &of(&recorded, "spans").events[..] else { panic!("{recorded:?}") };
        assert_eq!((instant.name, &instant.kind), ("now", &Kind::Instant(Some("what".into()))));
        let until = |event: &Event| if let Kind::Span(until) = event.kind { until } else { panic!("{event:?}") };
        assert!((outer.name, inner.name) == ("outer", "inner") && outer.at <= inner.at && inner.at <= instant.at);
        assert!(instant.at <= until(inner) && until(inner) <= until(outer) && until(outer) <= counter.at);
        assert_eq!((counter.name, &counter.kind), ("things", &Kind::Counter(2.5)));
        let busy = of(&recorded, "busy");
        assert_eq!((busy.events.len(), busy.dropped), (MOST, 3));
        let device = of(&recorded, "a clock");
        assert!(device.of_device && device.events == [Event { name: "pass", at: 5, kind: Kind::Span(7) }]);
        let has = |track: &Recorded, name| track.events.iter().any(|event| event.name == name);
        let outside = |track: &Recorded| has(track, "before") || has(track, "after");
        assert!(!recorded.iter().chain(&stop()).any(outside), "nothing before, nothing after");
    }
}
