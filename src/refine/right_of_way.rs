//! Frames go first where the device that draws them is the CPU: threads that look for light stand aside meanwhile, for a part of the time. Low priority
//! does not do that: a thread that draws and wakes up waits for the end of their slice, several times a frame.

use std::cell::Cell;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::time::{Duration, Instant};

/// How long a thread stands aside, and how long it then goes on while the same frame is drawn: a walk, where one frame follows the other, must not
/// stop the light (docs/notebook/clock.md).
const ASIDE: Duration = Duration::from_millis(40);
const ON: Duration = Duration::from_millis(2);

/// Whether a frame has the right of way.
#[derive(Debug, Default)]
pub struct RightOfWay {
    drawing: AtomicBool,
    lock: Mutex<()>,
    drawn: Condvar,
}

/// A frame that has the right of way until this is dropped.
#[derive(Debug)]
pub struct Drawing(Arc<RightOfWay>);

thread_local! {
    /// Until when the thread goes on whatever is drawn.
    static GOES_ON: Cell<Option<Instant>> = const { Cell::new(None) };
}

impl RightOfWay {
    /// Gives a frame the right of way.
    #[must_use]
    pub fn draw(self: &Arc<Self>) -> Drawing {
        self.drawing.store(true, Ordering::Relaxed);
        Drawing(Arc::clone(self))
    }

    /// Stands aside if a frame has the right of way.
    #[inline]
    pub fn give_way(&self) {
        if self.drawing.load(Ordering::Relaxed) {
            self.stand_aside();
        }
    }

    #[cold]
    fn stand_aside(&self) {
        if GOES_ON.get().is_some_and(|until| Instant::now() < until) {
            return;
        }
        let lock = self.lock.lock().unwrap_or_else(PoisonError::into_inner);
        let is_drawing = |_: &mut ()| self.drawing.load(Ordering::Relaxed);
        // Whatever comes of it, it goes on.
        let _ = self.drawn.wait_timeout_while(lock, ASIDE, is_drawing);
        GOES_ON.set(Some(Instant::now() + ON));
    }
}

impl Drop for Drawing {
    fn drop(&mut self) {
        // Under the lock, so that no thread looks before it and falls asleep after it.
        let _lock = self.0.lock.lock().unwrap_or_else(PoisonError::into_inner);
        self.0.drawing.store(false, Ordering::Relaxed);
        self.0.drawn.notify_all();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::thread;

    /// How long a thread takes to do next to nothing.
    fn delay(frames: &Arc<RightOfWay>) -> thread::JoinHandle<Duration> {
        let (frames, start) = (Arc::clone(frames), Instant::now());
        thread::spawn(move || {
            frames.give_way();
            start.elapsed()
        })
    }

    #[test]
    fn threads_wait_until_a_frame_is_drawn_but_not_for_ever() {
        let frames = Arc::new(RightOfWay::default());
        let drawing = frames.draw();
        assert!(delay(&frames).join().expect("thread") >= ASIDE, "the frame takes longer than that");
        let waits = delay(&frames);
        thread::sleep(ASIDE / 8);
        drop(drawing);
        assert!(waits.join().expect("thread") >= ASIDE / 8);
        assert!((0..9).any(|_| delay(&frames).join().expect("thread") < ASIDE), "nothing is drawn any more");
    }

    #[test]
    fn who_has_stood_aside_goes_on_for_a_while() {
        let frames = Arc::new(RightOfWay::default());
        let _drawing = frames.draw();
        frames.give_way();
        let start = Instant::now();
        (0..100).for_each(|_| frames.give_way());
        assert!(start.elapsed() < ASIDE);
        thread::sleep(ON);
        frames.give_way();
        assert!(start.elapsed() >= ASIDE);
    }
}
