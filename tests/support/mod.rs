//! What tests share.
#![allow(dead_code, reason = "each test program uses its own part")]

pub mod binary;
pub mod by_hand;
pub mod device;
pub mod shapes;
