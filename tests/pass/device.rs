//! Devices: choice, report, refusals, and that everything is given back.
#![allow(clippy::unwrap_used, reason = "in a test, a panic is how a failure shows")]

use crate::support::device::*;
use penombre::error::Error;
use penombre::pass::Renderer;
use penombre::scene::camera::ImageSize;
use penombre::vk::buffer::BufferUse;
use penombre::vk::report::LINEAR_FORMAT;
use penombre::vk::{Buffer, Device, DeviceOptions, Image, report};
use std::sync::Arc;

#[test]
fn a_renderer_can_be_made_and_dropped_twice() {
    for _ in 0..2 {
        with_renderer(|renderer| {
            show(renderer, &confetti(20), 40, 30);
        });
    }
}

#[test]
fn a_renderer_can_be_made_on_another_thread() {
    let Some(device) = device() else { return };
    let size = ImageSize { width: 33, height: 32 };
    let shared = Arc::clone(&device);
    let mut renderer = std::thread::spawn(move || Renderer::new(shared, size)).join().unwrap().unwrap();
    assert!(!show(&mut renderer, &confetti(20), 33, 32).is_empty());
    drop(renderer);
    finish(device);
}

#[test]
fn two_renderers_share_a_device() {
    let Some(device) = device() else { return };
    let size = ImageSize { width: 30, height: 32 };
    let mut renderers = [0, 1].map(|_| Renderer::new(Arc::clone(&device), size).unwrap());
    let counts = renderers.each_mut().map(|renderer| show(renderer, &confetti(20), 40, 30));
    assert_eq!(counts[0], counts[1]);
    drop(renderers);
    finish(device);
}

#[test]
fn devices_are_chosen_by_index_and_by_name() {
    let Some(device) = device() else { return };
    let report = device.report().clone();
    assert!(report.missing.is_empty() && !report.driver.is_empty() && report.formats.depth_stencil.is_some());
    let listed = report::devices().unwrap();
    assert!(listed.contains(&report));
    let open = |name: &str| Device::new(&DeviceOptions { device: Some(name.to_owned()), validation: Some(false) });
    let part: String = report.name.to_uppercase().chars().take(5).collect();
    for name in [report.index.to_string(), part] {
        assert_eq!(open(&name).unwrap().report().name, report.name);
    }
    let Err(Error::Usage(message)) = open("no such device") else { panic!("an unknown device was accepted") };
    assert!(message.contains(&report.name), "{message}");
    finish(device);
}

#[test]
fn too_large_an_allocation_is_refused_with_its_figure() {
    let Some(device) = device() else { return };
    let too_large = (device.report().max_allocation_mib + 1) << 20;
    let Err(Error::Exhausted(message)) = Buffer::new(&device, "huge", too_large, BufferUse::Static) else {
        panic!("{too_large} bytes were granted")
    };
    assert!(message.contains("huge") && message.contains(&device.report().max_allocation_mib.to_string()), "{message}");
    finish(device);
}

#[test]
fn too_large_a_picture_is_refused_and_the_old_one_kept() {
    with_renderer(|renderer| {
        let before = show(renderer, &confetti(20), 40, 30);
        let too_wide = ImageSize { width: renderer.device().report().max_image_side + 1, height: 1 };
        assert!(matches!(renderer.resize(too_wide), Err(Error::Usage(_))));
        assert_eq!(renderer.visibility().unwrap(), before);
    });
}

/// The largest square in the widest format: a device that cannot hold it says so before the validation layer does.
#[test]
fn an_image_beyond_the_memory_is_refused_without_a_validation_message() {
    let Some(device) = device() else { return };
    let side = device.report().max_image_side;
    let size = ash::vk::Extent2D { width: side, height: side };
    if let Err(e) = Image::colour(&device, "huge", size, LINEAR_FORMAT) {
        assert!(matches!(&e, Error::Exhausted(message) if message.contains("huge")), "{e}");
    }
    finish(device);
}

#[test]
fn what_is_alive_is_listed_by_name() {
    let Some(device) = device() else { return };
    let buffer = Buffer::new(&device, "kept too long", 100, BufferUse::Stream).unwrap();
    assert_eq!(device.live_objects(), ["kept too long"]);
    assert_eq!(buffer.size(), 100);
    drop(buffer);
    finish(device);
}
