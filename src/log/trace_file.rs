//! A recorded time line as Chrome's trace event JSON, which <https://ui.perfetto.dev> opens: a track a thread, and one for the device.

use crate::error::Result;
use crate::image::atomic;
use crate::trace::{Event, Kind, Recorded};
use serde::Serialize;
use serde_json::{Value, json};
use std::io::{self, BufWriter, Write};
use std::path::Path;

/// Threads of this program and tracks of the device are shown as two processes.
const PROGRAM: u32 = 1;
const DEVICE: u32 = 2;

/// An event as it is written. Times are in microseconds.
#[derive(Serialize)]
struct Line<'a> {
    ph: &'static str,
    name: &'a str,
    pid: u32,
    tid: u32,
    ts: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    dur: Option<f64>,
    /// What an instant belongs to: its thread.
    #[serde(skip_serializing_if = "Option::is_none")]
    s: Option<&'static str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    args: Option<Value>,
}

/// Writes what was recorded; the first event is at time 0.
///
/// # Errors
/// [`crate::error::Error::Io`] naming the file.
pub fn write(path: &Path, recorded: &[Recorded]) -> Result<()> {
    atomic::write(path, |file| {
        let mut writer = BufWriter::new(file);
        write_all(&mut writer, recorded)?;
        writer.flush()
    })
}

/// What is to be said of events that were dropped, if any were.
#[must_use]
pub fn dropped(recorded: &[Recorded]) -> Option<String> {
    let full = recorded.iter().filter(|track| track.dropped > 0);
    let full: Vec<String> = full.map(|track| format!("{} of {}", track.dropped, track.name)).collect();
    (!full.is_empty()).then(|| format!("the trace is not whole: events were dropped, {}", full.join(", ")))
}

fn write_all(writer: &mut impl Write, recorded: &[Recorded]) -> io::Result<()> {
    let start = recorded.iter().flat_map(|track| &track.events).map(|event| event.at).min().unwrap_or(0);
    writer.write_all(b"{\"displayTimeUnit\":\"ms\",\"otherData\":")?;
    serde_json::to_writer(&mut *writer, &json!({ "dropped": dropped(recorded) }))?;
    writer.write_all(b",\"traceEvents\":[\n")?;
    serde_json::to_writer(&mut *writer, &name("process_name", (PROGRAM, 0), "penombre"))?;
    write_next(writer, &name("process_name", (DEVICE, 0), "GPU"))?;
    for (track, tid) in recorded.iter().zip(1..) {
        let place = (if track.of_device { DEVICE } else { PROGRAM }, tid);
        write_next(writer, &name("thread_name", place, &track.name))?;
        // Outer spans first.
        let mut events: Vec<&Event> = track.events.iter().collect();
        events.sort_by_key(|event| (event.at, std::cmp::Reverse(end(event))));
        for event in events {
            write_next(writer, &line(event, place, start))?;
        }
    }
    writer.write_all(b"\n]}\n")
}

fn write_next(writer: &mut impl Write, line: &Line<'_>) -> io::Result<()> {
    writer.write_all(b",\n")?;
    Ok(serde_json::to_writer(writer, line)?)
}

/// Names a process or a thread.
fn name(what: &'static str, (pid, tid): (u32, u32), name: &str) -> Line<'static> {
    Line { ph: "M", name: what, pid, tid, ts: 0.0, dur: None, s: None, args: Some(json!({ "name": name })) }
}

const fn end(event: &Event) -> u64 {
    if let Kind::Span(until) = event.kind { until } else { event.at }
}

fn line(event: &Event, (pid, tid): (u32, u32), start: u64) -> Line<'static> {
    let microseconds = |nanoseconds: u64| nanoseconds as f64 * 1e-3;
    let ts = microseconds(event.at.saturating_sub(start));
    let line = Line { ph: "X", name: event.name, pid, tid, ts, dur: None, s: None, args: None };
    match &event.kind {
        Kind::Span(until) => Line { dur: Some(microseconds(until.saturating_sub(event.at))), ..line },
        Kind::Instant(detail) => {
            let args = detail.as_ref().map(|detail| json!({ "detail": detail }));
            Line { ph: "i", s: Some("t"), args, ..line }
        }
        Kind::Counter(value) => Line { ph: "C", args: Some(json!({ event.name: value })), ..line },
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn events_are_written_as_the_format_has_them() {
        let event = |name, at, kind| Event { name, at, kind };
        let events = vec![
            event("inner", 2000, Kind::Span(3500)),
            event("outer", 2000, Kind::Span(5000)),
            event("camera", 2500, Kind::Instant(Some("\"far\"".into()))),
            event("rays", 4000, Kind::Counter(7.0)),
        ];
        let thread = Recorded { name: "engine".to_owned(), of_device: false, events, dropped: 2 };
        let passes = vec![event("colour", 2250, Kind::Span(2750))];
        let device = Recorded { name: "passes".to_owned(), of_device: true, events: passes, dropped: 0 };
        let folder = tempfile::tempdir().expect("folder");
        let path = folder.path().join("trace.json");
        write(&path, &[thread, device]).expect("written");
        let text = std::fs::read_to_string(&path).expect("text");
        let written: Value = serde_json::from_str(&text).expect("JSON");
        assert_eq!(written["otherData"]["dropped"], "the trace is not whole: events were dropped, 2 of engine");
        let expected = json!([
            { "ph": "M", "name": "process_name", "pid": 1, "tid": 0, "ts": 0.0, "args": { "name": "penombre" } },
            { "ph": "M", "name": "process_name", "pid": 2, "tid": 0, "ts": 0.0, "args": { "name": "GPU" } },
            { "ph": "M", "name": "thread_name", "pid": 1, "tid": 1, "ts": 0.0, "args": { "name": "engine" } },
            { "ph": "X", "name": "outer", "pid": 1, "tid": 1, "ts": 0.0, "dur": 3.0 },
            { "ph": "X", "name": "inner", "pid": 1, "tid": 1, "ts": 0.0, "dur": 1.5 },
            { "ph": "i", "name": "camera", "pid": 1, "tid": 1, "ts": 0.5, "s": "t", "args": { "detail": "\"far\"" } },
            { "ph": "C", "name": "rays", "pid": 1, "tid": 1, "ts": 2.0, "args": { "rays": 7.0 } },
            { "ph": "M", "name": "thread_name", "pid": 2, "tid": 2, "ts": 0.0, "args": { "name": "passes" } },
            { "ph": "X", "name": "colour", "pid": 2, "tid": 2, "ts": 0.25, "dur": 0.5 },
        ]);
        assert_eq!(written["traceEvents"], expected);
    }
}
