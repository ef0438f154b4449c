//! Render passes on a device.

#[path = "../support/mod.rs"]
mod support;

mod colour;
mod combine;
mod counts;
mod culling;
mod device;
mod frame;
mod luminance;
mod patches;
mod sky;
mod tailored;
mod texel_buffers;
mod timing;
mod turned;
mod update_modes;
mod visibility;
