//! The store as a run uses it: blocks are handed over and come back at once, a thread of its own commits them every few seconds.

use super::block::{self, BlockKey, Damage, MAX_BLOCK};
use super::database::{Database, Found, MAX_NOTE, Refusal};
use super::directory::Directory;
use super::file_identity::FileIdentity;
use super::values::{Before, Limits, Saved, Use};
use crate::error::{Error, Result};
use rustc_hash::FxHashMap;
use std::path::Path;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, OnceLock, PoisonError, RwLock};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// An open store. It is for one process at a time, and for any of its threads. Dropping it commits what waits.
pub struct Store {
    shared: Arc<Shared>,
    thread: Mutex<Option<JoinHandle<()>>>,
}

impl std::fmt::Debug for Store {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_tuple("Store").field(&self.shared.path).finish()
    }
}

impl PartialEq for Store {
    /// Whether it is the same one.
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.shared, &other.shared)
    }
}

struct Shared {
    limits: Limits,
    /// Where the blocks are, for messages.
    path: std::path::PathBuf,
    state: Mutex<State>,
    wakes: Condvar,
    /// Once it is open: nothing, if it could not be.
    database: OnceLock<RwLock<Option<Database>>>,
}

/// Blocks by key.
type Blocks = FxHashMap<BlockKey, Arc<[u8]>>;

#[derive(Default)]
struct State {
    /// Sealed blocks that wait for the next commit, and since when.
    waiting: Blocks,
    since: Option<Instant>,
    /// Those that the thread commits now.
    committing: Arc<Blocks>,
    /// Bytes of both.
    held: usize,
    /// What the run uses, until it has begun.
    uses: Option<Use>,
    /// What was there when it began.
    before: Option<Arc<Before>>,
    note: Option<Vec<u8>>,
    /// Whether no more blocks come, and whether the thread has ended.
    closing: bool,
    closed: bool,
    /// Whether nothing is saved any more.
    gave_up: bool,
    warnings: Vec<String>,
    news: Vec<String>,
    saved: Saved,
}

impl Store {
    /// Opens the store of a directory, which is made if it is not there. The file of blocks is read and checked on a thread of its
    /// own: what is wrong with it comes as a warning, and nothing is kept then.
    ///
    /// # Errors
    /// [`Error::Usage`] if the directory is none or another process uses it, [`Error::Io`] if it cannot be written to,
    /// [`Error::Exhausted`] if the system gives no thread.
    pub fn open(directory: &Path, limits: Limits) -> Result<Self> {
        let directory = Directory::take(directory)?;
        let shared = Arc::new(Shared {
            limits,
            path: directory.blocks(),
            state: Mutex::default(),
            wakes: Condvar::new(),
            database: OnceLock::new(),
        });
        let at = Arc::clone(&shared);
        let thread = std::thread::Builder::new().name("penombre-store".to_owned()).spawn(move || {
            at.open(&directory);
            at.save();
            at.end();
        });
        let thread = thread.map_err(|e| Error::Exhausted(format!("cannot start a thread: {e}")))?;
        Ok(Self { shared, thread: Mutex::new(Some(thread)) })
    }

    /// Says what the run uses: nothing is committed before. Once more where another scene takes the place of the first.
    pub fn begin(&self, uses: Use) {
        let mut state = self.shared.state();
        (state.uses, state.before) = (Some(uses), None);
        drop(state);
        self.shared.wakes.notify_all();
    }

    /// What was there; waits for it, after [`Self::begin`].
    #[must_use]
    pub fn before(&self) -> Arc<Before> {
        let mut state = self.shared.state();
        loop {
            if let Some(before) = &state.before {
                return Arc::clone(before);
            }
            if state.closed {
                return Arc::default();
            }
            state = self.shared.wakes.wait(state).unwrap_or_else(PoisonError::into_inner);
        }
    }

    /// A block as it was last handed over, by this run or an earlier one; nothing if there is none, or it is damaged. Waits until the
    /// store is open.
    #[must_use]
    pub fn read(&self, key: BlockKey) -> Option<Vec<u8>> {
        let waiting = {
            let state = self.shared.state();
            state.waiting.get(&key).or_else(|| state.committing.get(&key)).map(Arc::clone)
        };
        let (sealed, kept) = match waiting {
            Some(block) => (None, Some(block)),
            None => (self.shared.kept(key)?, None),
        };
        let sealed = sealed.as_deref().or(kept.as_deref())?;
        self.shared.believed(key, sealed)
    }

    /// Hands blocks over: all of them are kept, or none, if the process ends in between. They take the place of earlier ones of their keys.
    pub fn write(&self, blocks: impl IntoIterator<Item = (BlockKey, Vec<u8>)>) {
        let sealed: Vec<(BlockKey, Arc<[u8]>)> =
            blocks.into_iter().map(|(key, bytes)| (key, Arc::from(block::sealed(key, &bytes)))).collect();
        let mut state = self.shared.state();
        if state.gave_up {
            return;
        }
        for (key, block) in sealed {
            if block.len() > MAX_BLOCK {
                state.warn(format!("{}: a block of {} MiB is not kept", self.shared.path.display(), block.len() >> 20));
                continue;
            }
            state.held += block.len();
            let before = state.waiting.insert(key, block);
            state.held -= before.map_or(0, |old| old.len());
            state.since.get_or_insert_with(Instant::now);
        }
        drop(state);
        self.shared.wakes.notify_all();
    }

    /// Waits until more blocks may be handed over.
    pub fn wait_for_room(&self) {
        let mut state = self.shared.state();
        while !state.gave_up && !state.closed && state.held >= self.shared.limits.waiting {
            state = self.shared.wakes.wait(state).unwrap_or_else(PoisonError::into_inner);
        }
    }

    /// Whether more blocks may be handed over now: fewer wait than the limit.
    #[must_use]
    pub fn has_room(&self) -> bool {
        let state = self.shared.state();
        !state.gave_up && state.held < self.shared.limits.waiting
    }

    /// Warnings since the last call, each a line.
    #[must_use]
    pub fn warnings(&self) -> Vec<String> {
        std::mem::take(&mut self.shared.state().warnings)
    }

    /// Has a line told to the user.
    pub fn tell(&self, line: String) {
        self.shared.state().news.push(line);
    }

    /// What is to be told since the last call.
    #[must_use]
    pub fn news(&self) -> Vec<String> {
        std::mem::take(&mut self.shared.state().news)
    }

    /// How much it keeps, and how often.
    #[must_use]
    pub fn limits(&self) -> Limits {
        self.shared.limits
    }

    /// What was done so far.
    #[must_use]
    pub fn saved(&self) -> Saved {
        self.shared.state().saved
    }

    /// Commits what waits and closes the store: what it did, and warnings that are left.
    #[must_use]
    pub fn close(&self) -> (Saved, Vec<String>) {
        self.finish();
        (self.saved(), self.warnings())
    }

    fn finish(&self) {
        self.shared.state().closing = true;
        self.shared.wakes.notify_all();
        let thread = self.thread.lock().unwrap_or_else(PoisonError::into_inner).take();
        if let Some(thread) = thread {
            // A panic has been reported by the panic hook.
            let _ = thread.join();
        }
    }
}

impl Drop for Store {
    fn drop(&mut self) {
        self.finish();
    }
}

impl State {
    /// From now on nothing is saved.
    fn give_up(&mut self) {
        self.gave_up = true;
        self.waiting.clear();
        self.held = self.committing.values().map(|block| block.len()).sum();
    }

    fn warn(&mut self, line: String) {
        if !self.warnings.contains(&line) {
            self.warnings.push(line);
        }
    }
}

impl Shared {
    fn state(&self) -> MutexGuard<'_, State> {
        // Every change is complete when the guard goes.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Opens the database; without one nothing is kept, and a warning says why.
    fn open(&self, directory: &Directory) {
        let path = self.path.display();
        let mut opened = Database::open(&self.path, self.limits.most, self.limits.pages);
        if let Err(Refusal::Damaged(why)) = &opened {
            let aside = directory.put_aside();
            let told = match &aside {
                Ok(to) => format!("it was put aside as {} and light is kept anew", to.display()),
                Err(e) => format!("it cannot be put aside ({e}), and no light is kept"),
            };
            self.state().warn(format!("{path}: the file is damaged ({why}); {told}"));
            if aside.is_ok() {
                opened = Database::open(&self.path, self.limits.most, self.limits.pages);
            }
        }
        let fault = match &opened {
            Err(Refusal::Newer(version)) => Some(format!(
                "{path}: a later version of penombre wrote it (format {version}); no light is kept, give this version another --cache-dir"
            )),
            Err(Refusal::System(why)) => Some(format!("{path}: cannot be opened: {why}; no light is kept")),
            // Told above, but for a file that is new.
            Err(Refusal::Damaged(_)) | Ok(_) => None,
        };
        let mut state = self.state();
        if opened.is_err() {
            state.give_up();
        }
        fault.into_iter().for_each(|fault| state.warn(fault));
        drop(state);
        // It is set once.
        let _ = self.database.set(RwLock::new(opened.ok()));
    }

    /// Begins the run once it is known what that uses.
    fn begin(&self, Use { layers, note }: Use) {
        let mut before = Before::default();
        let mut database = self.database.wait().write().unwrap_or_else(PoisonError::into_inner);
        let begun = database.as_mut().map(|database| database.begin_run(&layers));
        drop(database);
        match begun {
            Some(Ok(Found { notes, blocks, bytes })) => before = Before { notes, blocks, bytes },
            Some(Err(fault)) => self.give_up(&fault.to_string()),
            None => {}
        }
        let mut state = self.state();
        state.note = Some(note).filter(|note| note.len() <= MAX_NOTE);
        if state.uses.is_none() {
            state.before = Some(Arc::new(before));
        }
        drop(state);
        self.wakes.notify_all();
    }

    /// Closes the file, before the directory's lock goes.
    fn end(&self) {
        self.state().closed = true;
        self.wakes.notify_all();
        if let Some(database) = self.database.get() {
            *database.write().unwrap_or_else(PoisonError::into_inner) = None;
        }
    }

    /// Saves nothing any more, for a reason. What is kept can still be read: after a fault of the disk redb wants to be opened again.
    fn give_up(&self, why: &str) {
        let mut state = self.state();
        state.give_up();
        state.warn(format!("{}: light cannot be saved: {why}; the run goes on without", self.path.display()));
        drop(state);
        if let Some(database) = self.database.get() {
            let mut database = database.write().unwrap_or_else(PoisonError::into_inner);
            *database = None;
            *database = Database::open(&self.path, self.limits.most, self.limits.pages).ok();
        }
    }

    /// A sealed block from the file.
    fn kept(&self, key: BlockKey) -> Option<Option<Vec<u8>>> {
        let database = self.database.wait().read().unwrap_or_else(PoisonError::into_inner);
        match database.as_ref()?.block(key) {
            Ok(block) => Some(block),
            Err(fault) => {
                self.state().warn(format!("{}: cannot be read: {fault}; light is computed anew", self.path.display()));
                None
            }
        }
    }

    /// The bytes of a sealed block, if they are what was written.
    fn believed(&self, key: BlockKey, sealed: &[u8]) -> Option<Vec<u8>> {
        let opened = block::opened(key, sealed);
        let mut state = self.state();
        match opened {
            Ok(bytes) => {
                state.saved.read += 1;
                state.saved.read_bytes += bytes.len() as u64;
                Some(bytes.to_vec())
            }
            Err(damage) => {
                state.saved.damaged += 1;
                let path = self.path.display();
                state.warn(match damage {
                    Damage::Checksum => format!("{path}: blocks are damaged; their light is computed anew"),
                    Damage::Version => format!("{path}: blocks are of another version; their light is computed anew"),
                });
                None
            }
        }
    }

    /// Commits what is handed over, from the beginning of the run until the store is closed.
    fn save(&self) {
        let identity = FileIdentity::of(&self.path);
        let mut has_begun = false;
        loop {
            let uses = self.state().uses.take();
            if let Some(uses) = uses {
                self.begin(uses);
                has_begun = true;
            }
            if !has_begun {
                if self.must_not_wait_for_uses() {
                    return;
                }
                continue;
            }
            let (blocks, note, last) = self.due();
            if !blocks.is_empty() {
                let kept = if FileIdentity::of(&self.path) == identity {
                    self.commit(&blocks, note.as_deref())
                } else {
                    Err("it was removed or replaced meanwhile".to_owned())
                };
                self.committed(&blocks, kept);
            }
            if last {
                return;
            }
        }
    }

    /// Waits until it is known what the run uses; whether the store is closed before.
    fn must_not_wait_for_uses(&self) -> bool {
        let mut state = self.state();
        while state.uses.is_none() && !state.closing {
            state = self.wakes.wait(state).unwrap_or_else(PoisonError::into_inner);
        }
        state.uses.is_none()
    }

    /// Waits until blocks are due: those, the note if it is still to be written, and whether they are the last.
    fn due(&self) -> (Arc<Blocks>, Option<Vec<u8>>, bool) {
        let mut state = self.state();
        loop {
            let full = state.held >= self.limits.waiting / 2;
            let left = state.since.map(|since| self.limits.every.saturating_sub(since.elapsed()));
            let is_due = full || left == Some(Duration::ZERO);
            if state.closing || state.uses.is_some() || !state.waiting.is_empty() && is_due {
                let blocks = Arc::new(std::mem::take(&mut state.waiting));
                state.committing = Arc::clone(&blocks);
                state.since = None;
                return (blocks, state.note.clone(), state.closing && state.uses.is_none());
            }
            let woken = self.wakes.wait_timeout(state, left.unwrap_or(Duration::from_secs(3600)));
            state = woken.unwrap_or_else(PoisonError::into_inner).0;
        }
    }

    fn commit(&self, blocks: &Blocks, note: Option<&[u8]>) -> Result<(), String> {
        let database = self.database.wait().read().unwrap_or_else(PoisonError::into_inner);
        let Some(database) = database.as_ref() else { return Err("it is not open".to_owned()) };
        // In the order of keys, so that the same blocks make the same file.
        let mut sorted: Vec<_> = blocks.iter().map(|(key, block)| (*key, &**block)).collect();
        sorted.sort_unstable_by_key(|(key, _)| *key);
        let kept = database.keep(sorted.into_iter(), note).map_err(|e| e.to_string())?;
        if kept > self.limits.most {
            return Err(format!("{} MiB of light are kept, which is the most", kept >> 20));
        }
        Ok(())
    }

    /// Counts what was committed; after a fault nothing is saved any more.
    fn committed(&self, blocks: &Blocks, kept: Result<(), String>) {
        let mut state = self.state();
        state.committing = Arc::default();
        let bytes: usize = blocks.values().map(|block| block.len()).sum();
        state.held -= bytes;
        match kept {
            Ok(()) => {
                state.note = None;
                state.saved.blocks += blocks.len() as u64;
                state.saved.bytes += bytes as u64;
            }
            Err(why) if !state.gave_up => {
                drop(state);
                self.give_up(&why);
            }
            Err(_) => {}
        }
        self.wakes.notify_all();
    }
}
