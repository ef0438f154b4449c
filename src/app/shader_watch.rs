//! Shaders compiled again when their files change, beside what is shown: for work on them.

use super::reload::{POLL, Stamps, stamps};
use crate::vk::edited_shaders::EditedShaders;
use crossbeam_channel::{Receiver, RecvTimeoutError, Sender, unbounded};
use std::path::{Path, PathBuf};

/// Where the shaders are that were built in.
pub const FOLDER: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/glsl");

/// What became of shaders that were edited.
pub type Compiled = Result<EditedShaders, Vec<String>>;

/// Looks at the shaders of a folder, on a thread of its own that ends with this.
pub struct ShaderWatch {
    compiled: Receiver<Compiled>,
    /// Nothing is sent: the thread ends when it is gone.
    _alive: Sender<()>,
}

impl ShaderWatch {
    /// Starts to look at them. Without a thread nothing is ever compiled.
    #[must_use]
    pub fn start(folder: PathBuf) -> Self {
        let (alive, is_alive) = unbounded();
        let (tell, compiled) = unbounded();
        let thread = std::thread::Builder::new().name("penombre-shaders".to_owned());
        let _ = thread.spawn(move || watch(&folder, &is_alive, &tell));
        Self { compiled, _alive: alive }
    }

    /// The shaders as they were last compiled, or every fault; `None` if none were since the last.
    #[must_use]
    pub fn arrived(&self) -> Option<Compiled> {
        self.compiled.try_iter().last()
    }
}

/// The files of a folder and of its `include`.
fn files(folder: &Path) -> Vec<PathBuf> {
    let of = |folder: PathBuf| std::fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path());
    of(folder.to_owned()).chain(of(folder.join("include"))).filter(|path| path.is_file()).collect()
}

/// Compiles until nobody listens any more. A change counts once nothing more has changed from one look to the next.
fn watch(folder: &Path, alive: &Receiver<()>, tell: &Sender<Compiled>) {
    let look = || -> Stamps { stamps(files(folder).iter()) };
    let mut compiled = look();
    let mut seen = compiled.clone();
    while alive.recv_timeout(POLL) == Err(RecvTimeoutError::Timeout) {
        let now = look();
        let at_rest = now == seen;
        seen = now;
        if seen == compiled || !at_rest {
            continue;
        }
        compiled.clone_from(&seen);
        if tell.send(EditedShaders::compile(folder)).is_err() {
            return;
        }
    }
}
