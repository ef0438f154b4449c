//! `--trace` and `--log`, of `render` and of `view`: what is written of a run, as other programs read it.
#![allow(clippy::unwrap_used, reason = "in a test, a panic is how a failure shows")]

use crate::support::binary::{has_device, run, stderr};
use serde_json::Value;
use std::collections::{BTreeMap, HashSet};
use std::fs;
use std::path::Path;

/// A span by name and nanoseconds.
struct Span {
    name: String,
    from: u64,
    until: u64,
}

/// A trace as it was written.
struct Trace {
    /// Spans by process and track, in the order of the file.
    spans: BTreeMap<(u64, u64), Vec<Span>>,
    /// Names of tracks.
    names: BTreeMap<(u64, u64), String>,
    /// Names of counters, and details of instants.
    counters: HashSet<String>,
    instants: Vec<(String, String)>,
}

/// The process of the GPU's tracks.
const GPU: u64 = 2;

fn nanoseconds(microseconds: &Value) -> u64 {
    (microseconds.as_f64().unwrap() * 1e3).round() as u64
}

fn read(path: &Path) -> Trace {
    let file: Value = serde_json::from_slice(&fs::read(path).unwrap()).unwrap();
    assert!(file["otherData"]["dropped"].is_null());
    let mut trace =
        Trace { spans: BTreeMap::new(), names: BTreeMap::new(), counters: HashSet::new(), instants: vec![] };
    for event in file["traceEvents"].as_array().unwrap() {
        let (name, text) =
            (event["name"].as_str().unwrap().to_owned(), |value: &Value| value.as_str().map(str::to_owned));
        let track = (event["pid"].as_u64().unwrap(), event["tid"].as_u64().unwrap());
        match event["ph"].as_str().unwrap() {
            "M" if name == "thread_name" => drop(trace.names.insert(track, text(&event["args"]["name"]).unwrap())),
            "M" => assert_eq!(name, "process_name"),
            "X" => {
                let from = nanoseconds(&event["ts"]);
                let until = from + nanoseconds(&event["dur"]);
                trace.spans.entry(track).or_default().push(Span { name, from, until });
            }
            "i" => trace.instants.push((name, text(&event["args"]["detail"]).unwrap_or_default())),
            "C" => drop(trace.counters.insert(name)),
            other => panic!("{other}"),
        }
    }
    trace
}

impl Trace {
    /// All spans of threads, or of the GPU.
    fn of(&self, process: u64) -> impl Iterator<Item = &Span> {
        self.spans.iter().filter(move |((pid, _), _)| *pid == process).flat_map(|(_, spans)| spans)
    }

    fn thread(&self, name: &str) -> &[Span] {
        let track = self.names.iter().find(|(_, known)| *known == name);
        &self.spans[track.unwrap_or_else(|| panic!("no {name} in {:?}", self.names)).0]
    }

    /// Spans of a thread lie in each other or apart, all tracks have names, and the GPU's passes lie where they were waited for.
    fn check(&self) {
        assert!(self.spans.keys().all(|track| self.names.get(track).is_some_and(|name| !name.is_empty())));
        for (track, spans) in self.spans.iter().filter(|((process, _), _)| *process != GPU) {
            let mut open: Vec<u64> = Vec::new();
            for Span { name, from, until } in spans {
                open.retain(|end| end > from);
                let inside = open.last().is_none_or(|end| until <= end);
                assert!(inside && from <= until, "{name} of {:?} ends after what it lies in", self.names[track]);
                open.push(*until);
            }
        }
        let named = |name| self.of(1).filter(move |span| span.name == name);
        let submissions: Vec<(u64, u64)> =
            named("submit").zip(named("wait")).map(|(submit, wait)| (submit.from, wait.until)).collect();
        assert!(self.of(GPU).count() > 4);
        for Span { name, from, until } in self.of(GPU) {
            let is_waited_for = submissions.iter().any(|(begun, done)| begun <= from && until <= done);
            assert!(is_waited_for, "{name} at {from} to {until} lies between no submission and its fence");
        }
    }

    fn has(&self, process: u64, names: &[&str]) {
        let known: HashSet<&str> = self.of(process).map(|span| span.name.as_str()).collect();
        assert!(names.iter().all(|name| known.contains(name)), "{names:?} are not all in {known:?}");
    }
}

#[test]
fn a_trace_of_a_render_has_threads_passes_and_counters_on_one_time_line() {
    if !has_device() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let line = "render {cornell} --size 64x64 --threads 2 --rays 60000 --deterministic -q -o a.png --trace t.json";
    let output = run(folder.path(), line);
    assert_eq!((output.status.code(), stderr(&output).as_str()), (Some(0), ""));
    let trace = read(&folder.path().join("t.json"));
    trace.check();
    trace.has(1, &["load", "parse", "textures", "hierarchy", "open device", "pipelines", "send scene"]);
    trace.has(
        1,
        &["batch", "choose", "grow", "direct trace", "gather rounds", "apply", "judge", "publish", "settle", "smooth"],
    );
    trace.has(1, &["frame", "take updates", "plan", "record", "submit", "wait"]);
    trace.has(GPU, &["visibility", "colour", "luminance", "combine", "readback"]);
    assert!(trace.thread("penombre-engine").iter().any(|span| span.name == "choose"));
    assert!(trace.thread("penombre-trace-1").iter().any(|span| span.name == "gather job"));
    assert!(trace.thread("main").iter().any(|span| span.name == "frame"));
    assert!(["rays", "vertices", "memory, MiB"].iter().all(|name| trace.counters.contains(*name)));
}

#[test]
fn what_a_script_does_is_in_log_and_trace() {
    if !has_device() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    fs::write(at("walk.script"), "0.1 camera.look 5 0\n0.2 light.dim lamp 0.5\n0.3 app.quit\n").unwrap();
    let line = "view {cornell} --headless --size 64x64 --threads 1 --rays 4000 --fps 10 --script walk.script";
    let output = run(folder.path(), &format!("{line} --log l.csv --trace t.json"));
    assert_eq!((output.status.code(), stderr(&output).as_str()), (Some(0), ""));
    let trace = read(&at("t.json"));
    trace.check();
    let details =
        |of: &str| trace.instants.iter().filter(|(name, _)| name == of).map(|(_, d)| d.clone()).collect::<Vec<_>>();
    assert_eq!(details("command"), ["camera.look 5 0", "light.dim lamp 0.5", "app.quit"]);
    assert_eq!(details("camera"), ["view 1", "view 2", "view 3"]);
    let log = fs::read_to_string(at("l.csv")).unwrap();
    let rows: Vec<Vec<&str>> = log.lines().skip(1).map(|row| row.split(',').collect()).collect();
    let moved: Vec<&str> = rows.iter().map(|row| row[2]).collect();
    assert_eq!(moved, ["1", "0", "1", "0", "1", "0", "0"], "{log}");
    assert!(rows.iter().all(|row| row.len() == 25) && rows.last().unwrap()[13].parse::<u64>().unwrap() > 4000, "{log}");
    let summary: Value = serde_json::from_slice(&fs::read(at("l.json")).unwrap()).unwrap();
    assert_eq!((summary["frames"].as_u64(), summary["size"][0].as_u64()), (Some(7), Some(64)));
    assert!(summary["device"].as_str().is_some_and(|name| !name.is_empty()));
}

#[test]
fn a_trace_is_written_of_a_run_that_is_broken_off() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("s.toml"), "nonsense = 1\n").unwrap();
    let output = run(folder.path(), "render s.toml -o a.png --trace t.json");
    assert_eq!(output.status.code(), Some(2));
    let text = fs::read_to_string(folder.path().join("t.json")).unwrap();
    assert!(
        serde_json::from_str::<Value>(&text).unwrap()["traceEvents"]
            .as_array()
            .unwrap()
            .iter()
            .any(|e| e["name"] == "load")
    );
    let refused = run(folder.path(), "render s.toml -o a.png --trace t.csv");
    assert!(refused.status.code() == Some(2) && stderr(&refused).contains(".json"));
}
