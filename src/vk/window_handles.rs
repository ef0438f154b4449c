//! Windows as surfaces are made of them.

use raw_window_handle::{HasDisplayHandle, HasWindowHandle};

/// A window that threads share.
pub trait WindowHandles: HasDisplayHandle + HasWindowHandle + Send + Sync {}

impl<W: HasDisplayHandle + HasWindowHandle + Send + Sync> WindowHandles for W {}
