//! Times of start-up and passes, printed; run with `--ignored --nocapture` on a quiet machine.
#![allow(clippy::unwrap_used, reason = "in a test, a panic is how a failure shows")]

use crate::support::device::*;
use glam::{Vec2, Vec3};
use penombre::pass::{FrameOptions, Renderer, UpdateMode};
use penombre::refine::update::Slot;
use penombre::scene::camera::ImageSize;
use penombre::scene::{Display, FaceId};
use penombre::vk::{Device, DeviceOptions};
use std::sync::Arc;
use std::time::Instant;

#[test]
#[ignore = "a measurement"]
fn start_up_and_passes() {
    let start = Instant::now();
    let options = DeviceOptions { device: None, validation: Some(false) };
    let Ok(device) = Device::new(&options) else { return };
    let ms = |since: Instant| since.elapsed().as_secs_f64() * 1e3;
    println!("device {:.1} ms", ms(start));
    let start = Instant::now();
    let mut renderer = Renderer::new(Arc::clone(&device), ImageSize { width: 500, height: 500 }).unwrap();
    println!("pipelines {:.1} ms", ms(start));
    for (n, width, height) in [(10, 500, 500), (100, 500, 500), (370, 500, 500), (100, 1024, 768)] {
        let scene = terrain(n);
        let start = Instant::now();
        renderer.load(&scene).unwrap();
        println!("{} triangles, {width} x {height}: load {:.1} ms", scene.triangles.len(), ms(start));
        renderer.resize(ImageSize { width, height }).unwrap();
        renderer.set_view(&view_of(&scene, width, height), Vec2::ZERO);
        let visible = renderer.visibility().unwrap();
        let light = |_: FaceId, position| Slot {
            position,
            weight: 1.0,
            diffuse: Vec3::ONE,
            specular: Vec3::ZERO,
            light_vector: glam::Vec4::ZERO,
        };
        renderer.apply(&base_update(&scene, faces(&visible), false, light)).unwrap();
        let combine = Some(Display::default());
        let all =
            FrameOptions { full_luminance: true, colour: true, combine, update_mode: UpdateMode::Stencil, queries: 0 };
        let first = renderer.frame(&all).unwrap();
        println!("  first frame {first:.1?}");
        per_call("visibility", || drop(renderer.visibility().unwrap()));
        let none = FrameOptions { full_luminance: false, colour: false, combine: None, ..all };
        for (name, options) in [
            ("empty", none),
            ("colour", FrameOptions { colour: true, ..none }),
            ("luminance", FrameOptions { full_luminance: true, ..none }),
            ("combine", FrameOptions { combine, ..none }),
        ] {
            per_call(name, || {
                renderer.frame(&options).unwrap();
            });
        }
        // Scattered over the mesh, with values that differ each time.
        let every = (visible.len() / 1000).max(1);
        let count = std::cell::Cell::new(1.0);
        let changed = || {
            count.set(count.get() + 0.01);
            let light = |_, position| Slot { diffuse: Vec3::splat(count.get()), ..light(FaceId(0), position) };
            base_update(&scene, faces(&visible).into_iter().step_by(every).take(1000), true, light)
        };
        for mode in MODES {
            per_call(&format!("1000 values, {mode:?}"), || {
                renderer.apply(&changed()).unwrap();
                renderer.frame(&FrameOptions { update_mode: mode, ..none }).unwrap();
            });
        }
        per_call("drawn_counts", || drop(renderer.drawn_counts().unwrap()));
        per_call("read_display", || drop(renderer.read_display().unwrap()));
        per_call("read_layers", || drop(renderer.read_layers().unwrap()));
    }
}

/// CPU time of the whole process, ms: what a busy machine does not distort. Ticks of 10 ms.
fn cpu_ms() -> f64 {
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    let fields: Vec<&str> = stat.rsplit(')').next().unwrap_or_default().split_whitespace().collect();
    [11, 12].iter().filter_map(|&i| fields.get(i)?.parse::<f64>().ok()).sum::<f64>() * 10.0
}

fn per_call(name: &str, mut call: impl FnMut()) {
    const CALLS: u32 = 20;
    let (cpu, wall) = (cpu_ms(), Instant::now());
    for _ in 0..CALLS {
        call();
    }
    let calls = f64::from(CALLS);
    println!(
        "  {name}: {:.1} ms CPU, {:.1} ms wall",
        (cpu_ms() - cpu) / calls,
        wall.elapsed().as_secs_f64() * 1e3 / calls
    );
}

/// 100,000 new triangles at once: how long until all are on the screen, and the longest frame.
#[test]
#[ignore = "a measurement"]
fn many_triangles_at_once() {
    let options = DeviceOptions { device: None, validation: Some(false) };
    let Ok(device) = Device::new(&options) else { return };
    for (mode, n) in MODES.into_iter().flat_map(|mode| [(mode, 30), (mode, 112), (mode, 160)]) {
        let size = ImageSize { width: 512, height: 512 };
        let mut renderer = Renderer::new(Arc::clone(&device), size).unwrap();
        let scene = terrain(n);
        let visible = faces(&show(&mut renderer, &scene, 512, 512));
        let light = |_, position| Slot {
            position,
            weight: 1.0,
            diffuse: Vec3::ONE,
            specular: Vec3::ZERO,
            light_vector: glam::Vec4::ZERO,
        };
        let combine = Some(Display::default());
        let frame = FrameOptions { combine, update_mode: mode, ..FrameOptions::default() };
        let mut mesh = Splitter::new(&scene, &visible);
        renderer.apply(&base_update(&scene, visible.iter().copied(), false, light)).unwrap();
        renderer.frame(&FrameOptions { full_luminance: true, colour: true, ..frame }).unwrap();
        let start = Instant::now();
        let (mut triangles, mut longest, mut frames) = (0, 0.0f64, 0);
        while triangles < 100_000 {
            let update = mesh.split(1.0);
            triangles += 4 * update.patches.len();
            renderer.apply(&update).unwrap();
        }
        let applied = start.elapsed().as_secs_f64() * 1e3;
        while renderer.has_pending() {
            let start = Instant::now();
            renderer.frame(&frame).unwrap();
            longest = longest.max(start.elapsed().as_secs_f64() * 1e3);
            frames += 1;
        }
        let all = start.elapsed().as_secs_f64() * 1e3;
        println!(
            "{mode:?}, {} faces: {triangles} triangles on the screen after {all:.0} ms ({applied:.0} ms to take in), \
             {frames} frames, the longest {longest:.1} ms",
            visible.len()
        );
        let full = FrameOptions { full_luminance: true, combine: None, ..frame };
        per_call("full redraw", || {
            renderer.frame(&full).unwrap();
        });
        per_call("full redraw with colour and combine", || {
            renderer.frame(&FrameOptions { full_luminance: true, colour: true, ..frame }).unwrap();
        });
        per_call("drawn_counts", || drop(renderer.drawn_counts().unwrap()));
    }
}
