//! The frame log: CSV, one row a frame, flushed as it goes, so that an interrupted run keeps its rows.

use crate::error::{Error, Result};
use crate::refine::update::{EngineStats, MemoryStats};
use csv::{ByteRecord, Writer};
use std::fs::File;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Columns of every log.
const COLUMNS: [&str; 18] = [
    "frame",
    "time_ms",
    "camera_moved",
    "cpu_ms",
    "visibility_ms",
    "colour_ms",
    "luminance_ms",
    "combine_ms",
    "readback_ms",
    "dirty_parents",
    "children_drawn",
    "queries",
    "query_pixels",
    "rays",
    "vertices",
    "triangles",
    "memory_mib",
    "estimated_error",
];

/// Columns that a reference image adds.
const ERROR_COLUMNS: [&str; 3] = ["rmse", "relmse", "flip"];

/// Columns that came later: behind all others, with a reference or without.
const LATER_COLUMNS: [&str; 7] = [
    "stale_specular",
    "filled_faces",
    "light_mib",
    "light_free_mib",
    "evicted_faces",
    "spilled_clusters",
    "paged_in_clusters",
];

/// What the passes of one frame did. Times are GPU timestamps; what did not run is `None`, an empty field.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PassRecord {
    /// Visibility pass.
    pub visibility: Option<Duration>,
    /// Colour pass.
    pub colour: Option<Duration>,
    /// Luminance pass.
    pub luminance: Option<Duration>,
    /// Combine pass.
    pub combine: Option<Duration>,
    /// Read-back.
    pub readback: Option<Duration>,
    /// Patches redrawn by the luminance pass.
    pub dirty_parents: Option<u64>,
    /// Triangles drawn by the luminance pass.
    pub children_drawn: Option<u64>,
    /// Occlusion queries whose result arrived.
    pub queries: Option<u64>,
    /// Pixels they counted.
    pub query_pixels: Option<u64>,
}

/// Error of one frame against the reference.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrameError {
    /// Root mean square error.
    pub rmse: f64,
    /// Relative mean square error.
    pub relmse: f64,
    /// Mean FLIP error as displayed, where it was measured.
    pub flip: Option<f64>,
}

/// One row.
#[derive(Clone, Copy, Debug)]
pub struct FrameRecord {
    /// Frame number, from 0.
    pub frame: u64,
    /// When the frame was complete, since the first frame began.
    pub at: Duration,
    /// Whether the camera moved since the frame before.
    pub camera_moved: bool,
    /// The passes.
    pub passes: PassRecord,
    /// The engine's totals after this frame; `cpu_ms` is their CPU time since the row before.
    pub engine: EngineStats,
    /// Memory of the cache and of the GPU's copies, MiB.
    pub memory_mib: Option<f64>,
    /// Error against the reference, where it was measured.
    pub error: Option<FrameError>,
    /// Whether it made a picture with specular luminance of an earlier view.
    pub stale_specular: bool,
    /// Faces that show light of others near by until their own comes.
    pub filled_faces: u64,
}

/// A frame log being written.
#[derive(Debug)]
pub struct FrameLog {
    path: PathBuf,
    writer: Writer<File>,
    with_error: bool,
    /// The engine's CPU time at the row before, seconds.
    cpu_before: f64,
}

impl FrameLog {
    /// Creates the file and writes the header; `with_error` adds the error columns.
    ///
    /// # Errors
    /// [`Error::Io`] naming the file.
    pub fn create(path: &Path, with_error: bool) -> Result<Self> {
        let file = File::create(path).map_err(|e| Error::io(path, "cannot create", e))?;
        let mut log = Self { path: path.to_owned(), writer: Writer::from_writer(file), with_error, cpu_before: 0.0 };
        let errors = if with_error { ERROR_COLUMNS.as_slice() } else { &[] };
        log.write(&COLUMNS.iter().chain(errors).chain(&LATER_COLUMNS).collect::<ByteRecord>())?;
        Ok(log)
    }

    /// Appends a row and flushes it.
    ///
    /// # Errors
    /// [`Error::Io`] naming the file.
    pub fn record(&mut self, row: &FrameRecord) -> Result<()> {
        let before = std::mem::replace(&mut self.cpu_before, row.engine.cpu_seconds);
        // Another engine, of a scene that was loaded again, counts from its own start.
        let before = if row.engine.cpu_seconds < before { 0.0 } else { before };
        let cpu_seconds = row.engine.cpu_seconds - before;
        let mut fields = fields(row, cpu_seconds);
        if self.with_error {
            fields.extend([
                scientific(row.error.map(|e| e.rmse)),
                scientific(row.error.map(|e| e.relmse)),
                scientific(row.error.and_then(|e| e.flip)),
            ]);
        }
        fields.extend([u8::from(row.stale_specular).to_string(), row.filled_faces.to_string()]);
        fields.extend(memory_fields(&row.engine.memory));
        self.write(&fields.iter().collect())
    }

    fn write(&mut self, record: &ByteRecord) -> Result<()> {
        let written = self.writer.write_byte_record(record).map_err(std::io::Error::from);
        let flushed = written.and_then(|()| self.writer.flush());
        flushed.map_err(|e| Error::io(&self.path, "cannot write", e))
    }
}

fn fields(row: &FrameRecord, cpu_seconds: f64) -> Vec<String> {
    let FrameRecord { passes, engine, .. } = row;
    vec![
        row.frame.to_string(),
        milliseconds(Some(row.at)),
        u8::from(row.camera_moved).to_string(),
        format!("{:.3}", cpu_seconds * 1e3),
        milliseconds(passes.visibility),
        milliseconds(passes.colour),
        milliseconds(passes.luminance),
        milliseconds(passes.combine),
        milliseconds(passes.readback),
        count(passes.dirty_parents),
        count(passes.children_drawn),
        count(passes.queries),
        count(passes.query_pixels),
        engine.rays.to_string(),
        engine.vertices.to_string(),
        engine.triangles.to_string(),
        row.memory_mib.map_or_else(String::new, |m| format!("{m:.1}")),
        scientific(engine.estimated_error.map(f64::from)),
    ]
}

fn memory_fields(memory: &MemoryStats) -> [String; 5] {
    let mib = |bytes: u64| format!("{:.2}", bytes as f64 / f64::from(1 << 20));
    let MemoryStats { held, free, evicted, spilled, paged_in, .. } = *memory;
    [mib(held), mib(free), evicted.to_string(), spilled.to_string(), paged_in.to_string()]
}

fn milliseconds(time: Option<Duration>) -> String {
    time.map_or_else(String::new, |t| format!("{:.3}", t.as_secs_f64() * 1e3))
}

fn count(value: Option<u64>) -> String {
    value.map_or_else(String::new, |v| v.to_string())
}

/// Six significant digits whatever the magnitude.
fn scientific(value: Option<f64>) -> String {
    value.map_or_else(String::new, |v| format!("{v:.5e}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    const HEADER: &str = "frame,time_ms,camera_moved,cpu_ms,visibility_ms,colour_ms,luminance_ms,combine_ms,readback_ms,\
        dirty_parents,children_drawn,queries,query_pixels,rays,vertices,triangles,memory_mib,estimated_error";
    const LATER: &str =
        "stale_specular,filled_faces,light_mib,light_free_mib,evicted_faces,spilled_clusters,paged_in_clusters";

    fn row(at: Duration) -> FrameRecord {
        let engine = EngineStats {
            rays: 1000,
            vertices: 20,
            triangles: 30,
            cpu_seconds: 0.0125,
            estimated_error: None,
            ..Default::default()
        };
        let passes = PassRecord {
            luminance: Some(Duration::from_micros(1500)),
            combine: Some(Duration::ZERO),
            dirty_parents: Some(0),
            ..Default::default()
        };
        FrameRecord {
            frame: 3,
            at,
            camera_moved: true,
            passes,
            engine,
            memory_mib: Some(12.34),
            error: None,
            stale_specular: true,
            filled_faces: 7,
        }
    }

    #[test]
    fn rows_are_on_disk_at_once_and_what_did_not_run_is_empty() {
        let folder = tempfile::tempdir().expect("folder");
        let path = folder.path().join("frames.csv");
        let mut log = FrameLog::create(&path, false).expect("log");
        let header = format!("{HEADER},{LATER}\n");
        assert_eq!(std::fs::read_to_string(&path).expect("log"), header);
        log.record(&row(Duration::from_millis(40))).expect("row");
        // The log is still open: the row must not wait in a buffer.
        let first = header + "3,40.000,1,12.500,,,1.500,0.000,,0,,,,1000,20,30,12.3,,1,7,0.00,0.00,0,0,0\n";
        assert_eq!(std::fs::read_to_string(&path).expect("log"), first);

        let mut next = row(Duration::from_micros(80_500));
        next.engine.cpu_seconds += 0.030;
        log.record(&next).expect("row");
        let second = "3,80.500,1,30.000,,,1.500,0.000,,0,,,,1000,20,30,12.3,,1,7,0.00,0.00,0,0,0\n";
        assert_eq!(std::fs::read_to_string(&path).expect("log"), first + second, "CPU time is the frame's own");
    }

    #[test]
    fn a_reference_adds_error_columns() {
        let folder = tempfile::tempdir().expect("folder");
        let path = folder.path().join("frames.csv");
        let mut log = FrameLog::create(&path, true).expect("log");
        let mut with = row(Duration::ZERO);
        with.error = Some(FrameError { rmse: 0.5, relmse: 1.25e-7, flip: Some(0.125) });
        with.engine.estimated_error = Some(0.25);
        log.record(&with).expect("row");
        log.record(&row(Duration::ZERO)).expect("row");
        with.error = Some(FrameError { rmse: 0.5, relmse: 1.25e-7, flip: None });
        log.record(&with).expect("row");
        let text = std::fs::read_to_string(&path).expect("log");
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines[0], format!("{HEADER},rmse,relmse,flip,{LATER}"));
        assert!(
            lines[1].ends_with(",12.3,2.50000e-1,5.00000e-1,1.25000e-7,1.25000e-1,1,7,0.00,0.00,0,0,0"),
            "{}",
            lines[1]
        );
        assert!(lines[2].ends_with(",12.3,,,,,1,7,0.00,0.00,0,0,0"), "{}", lines[2]);
        assert!(lines[3].ends_with("5.00000e-1,1.25000e-7,,1,7,0.00,0.00,0,0,0"), "{}", lines[3]);
    }

    #[test]
    fn faults_name_the_file() {
        let folder = tempfile::tempdir().expect("folder");
        let error = FrameLog::create(&folder.path().join("no/frames.csv"), false).expect_err("no folder");
        assert!(error.to_string().contains("frames.csv: cannot create"), "{error}");
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn a_full_disk_is_an_error() {
        let error = FrameLog::create(Path::new("/dev/full"), false).expect_err("full");
        assert!(error.to_string().contains("/dev/full: cannot write"), "{error}");
    }
}
