//! An X server that goes away. Xlib ends the process then, from within whatever call notices, with a status that means something else here:
//! unless a handler ends it first.

use crate::system;
use std::ffi::{c_int, c_void};
use std::sync::OnceLock;

static END: OnceLock<Box<dyn Fn() + Send + Sync>> = OnceLock::new();

/// Does something, once, when the connection to an X server breaks; the process ends when it has been done.
pub fn when_lost(end: impl Fn() + Send + Sync + 'static) {
    // A process has one window.
    if END.set(Box::new(end)).is_ok() {
        system::when_x11_breaks(broken);
    }
}

extern "C" fn broken(_: *mut c_void) -> c_int {
    END.get().iter().for_each(|end| end());
    0
}
