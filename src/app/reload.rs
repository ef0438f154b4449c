//! The scene loaded again when its files change, beside what is shown.
//!
//! Files are looked at twice a second instead of being watched by the system: that works on network drives and mounts of containers,
//! where the system tells nothing, and with editors that write a new file and rename it.

use crate::error::{Error, Result};
use crate::geom::bvh::Bvh;
use crate::scene::Scene;
use crate::scene::load::{Loaded, load_beside};
use crate::scene::up_axis::UpAxis;
use crate::session::Hierarchy;
use crossbeam_channel::{Receiver, RecvTimeoutError, Sender, unbounded};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, SystemTime};

/// Time between two looks at the files.
pub(super) const POLL: Duration = Duration::from_millis(500);

/// Where a scene is loaded from.
#[derive(Clone, Debug)]
pub struct Source {
    /// Its file.
    pub path: PathBuf,
    /// Which axis of a bare OBJ points up.
    pub up: Option<UpAxis>,
    /// All files that it was read from.
    pub files: Vec<PathBuf>,
}

/// A scene that was loaded again.
pub struct Fresh {
    /// The scene.
    pub scene: Arc<Scene>,
    /// Its hierarchy.
    pub bvh: Arc<Bvh>,
    /// Warnings, what is alike in one line.
    pub warnings: Vec<String>,
    files: Vec<PathBuf>,
}

impl Source {
    /// Loads it.
    ///
    /// # Errors
    /// As [`load_beside`]; [`Error::Exhausted`] if the system gives no thread.
    pub fn load(&self) -> Result<Fresh> {
        let mut hierarchy = None;
        let Loaded { scene, report, files, .. } =
            load_beside(&self.path, self.up, |geometry| hierarchy = Some(Hierarchy::start(geometry)))?;
        let hierarchy =
            hierarchy.ok_or_else(|| Error::Internal("a scene was loaded without triangles".to_owned()))??;
        let bvh = hierarchy.finish(&scene);
        Ok(Fresh { scene: Arc::new(scene), bvh, warnings: report.collapsed(), files })
    }
}

/// Loads a scene again when its files change, or when it is asked to, on a thread of its own that ends with this.
pub struct Reloader {
    ask: Sender<()>,
    loaded: Receiver<Result<Fresh>>,
}

impl Reloader {
    /// Starts to look at the files.
    ///
    /// # Errors
    /// [`Error::Exhausted`] if the system gives no thread.
    pub fn start(source: Source) -> Result<Self> {
        let (ask, asked) = unbounded();
        let (tell, loaded) = unbounded();
        let thread = std::thread::Builder::new().name("penombre-reload".to_owned());
        let thread = thread.spawn(move || watch(&source, &asked, &tell));
        thread.map_err(|e| Error::Exhausted(format!("cannot start a thread: {e}")))?;
        Ok(Self { ask, loaded })
    }

    /// Asks for the scene, changed or not.
    pub fn ask(&self) {
        // Fails only if the thread is gone, with the process.
        let _ = self.ask.send(());
    }

    /// The scene as it was last loaded again, or why it could not be; `None` if nothing was loaded since the last.
    #[must_use]
    pub fn arrived(&self) -> Option<Result<Fresh>> {
        self.loaded.try_iter().last()
    }
}

/// Time of the last change and length of each file; `None` for one that is not there.
pub(super) type Stamps = BTreeMap<PathBuf, Option<(SystemTime, u64)>>;

fn stamp(file: &Path) -> Option<(SystemTime, u64)> {
    let data = std::fs::metadata(file).ok()?;
    Some((data.modified().ok()?, data.len()))
}

pub(super) fn stamps<'a>(files: impl Iterator<Item = &'a PathBuf>) -> Stamps {
    files.map(|file| (file.clone(), stamp(file))).collect()
}

/// Loads until nobody asks or listens any more. A change counts once nothing more has changed from one look to the next: a file that
/// is being written is left alone.
fn watch(source: &Source, asked: &Receiver<()>, tell: &Sender<Result<Fresh>>) {
    let mut loaded = stamps(source.files.iter());
    let mut seen = loaded.clone();
    loop {
        let asked = match asked.recv_timeout(POLL) {
            Ok(()) => true,
            Err(RecvTimeoutError::Timeout) => false,
            Err(RecvTimeoutError::Disconnected) => return,
        };
        let now = stamps(loaded.keys());
        let at_rest = now == seen;
        seen = now;
        if !asked && (seen == loaded || !at_rest) {
            continue;
        }
        let fresh = source.load();
        loaded = seen.clone();
        if let Ok(Fresh { files, .. }) = &fresh {
            // As they were before they were read: what changed meanwhile is a change.
            loaded = files
                .iter()
                .map(|file| (file.clone(), seen.get(file).copied().unwrap_or_else(|| stamp(file))))
                .collect();
            seen.clone_from(&loaded);
        }
        if tell.send(fresh).is_err() {
            return;
        }
    }
}
