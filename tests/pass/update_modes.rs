//! Every update mode against a full redraw on meshes made by hand, refusals, and the three ways to count pixels.
#![allow(clippy::unwrap_used, reason = "in a test, a panic is how a failure shows")]

use crate::support::device::*;
use glam::{Vec2, Vec3};
use penombre::cache::ids::DrawnId;
use penombre::pass::{
    Depth, DepthFormat, DepthOrder, FrameOptions, LuminanceLayers, Renderer, RendererOptions, UpdateMode,
};
use penombre::refine::update::DrawnPixels;
use penombre::scene::Scene;
use penombre::scene::camera::{ImageSize, View};
use penombre::vk::Device;
use std::collections::HashMap;
use std::sync::Arc;

const SIZE: ImageSize = ImageSize { width: 160, height: 120 };
const FORMATS: [DepthFormat; 2] = [DepthFormat::D32S8, DepthFormat::D24S8];
const ORDERS: [DepthOrder; 2] = [DepthOrder::Reversed, DepthOrder::Ordinary];

fn patches(update_mode: UpdateMode) -> FrameOptions {
    FrameOptions { update_mode, ..FrameOptions::default() }
}

fn full(update_mode: UpdateMode) -> FrameOptions {
    FrameOptions { full_luminance: true, colour: true, ..patches(update_mode) }
}

fn renderer(device: &Arc<Device>, format: Option<DepthFormat>, order: DepthOrder, modes: &[UpdateMode]) -> Renderer {
    let depth = Depth::new(device, format, order).unwrap();
    let (modes, made) = (modes.to_vec(), RendererOptions::new(device).unwrap());
    let options = RendererOptions { depth, modes, count_writes: true, ..made };
    Renderer::with_options(Arc::clone(device), SIZE, options).unwrap()
}

/// Overlapping triangles of all slopes before a wall, behind a cut-out screen; both are oblique, since planes of one depth have
/// no artefacts.
fn scene() -> Scene {
    let mut scene = confetti(40);
    let holes = add_texture(&mut scene, 4, 4, |x, y| [255, 255, 255, if (x + y) % 2 == 0 { 255 } else { 0 }]);
    let masked = add_material(&mut scene, |m| m.map_d = Some(holes.into()));
    add_quad(&mut scene, Vec3::new(-1.0, -1.0, 1.2), Vec3::new(2.0, 0.0, -0.7), Vec3::Y * 2.0, masked, 2.0);
    add_quad(&mut scene, Vec3::new(-1.5, -1.5, -1.5), Vec3::new(3.0, 0.3, -0.9), Vec3::new(-0.2, 3.0, 1.4), 0, 1.0);
    scene
}

/// Six splits and changes of value in a mode; then what is shown, and what a full redraw in the same mode shows.
fn refine(renderer: &mut Renderer, scene: &Scene, mode: UpdateMode) -> [LuminanceLayers; 2] {
    renderer.load(scene).unwrap();
    renderer.resize(SIZE).unwrap();
    // A near plane as far as may be: integer depth resolves what planes differ by only then (docs/update-modes.md).
    renderer.set_view(&View { near: 1.0, ..view_of(scene, SIZE.width, SIZE.height) }, Vec2::ZERO);
    let visible = faces(&renderer.visibility().unwrap());
    let mut mesh = Splitter::new(scene, &visible);
    renderer.apply(&base_update(scene, visible.iter().copied(), false, |_, p| mesh.slot(p))).unwrap();
    renderer.frame(&full(mode)).unwrap();
    for _ in 0..3 {
        renderer.apply(&mesh.split(0.4)).unwrap();
        renderer.frame(&patches(mode)).unwrap();
        renderer.apply(&mesh.change(0.3)).unwrap();
        renderer.frame(&patches(mode)).unwrap();
    }
    let shown = renderer.read_luminance().unwrap();
    renderer.frame(&full(mode)).unwrap();
    [shown, renderer.read_luminance().unwrap()]
}

/// Share of the pixels that show another leaf, or the same with another value.
fn differing([a, b]: &[LuminanceLayers; 2]) -> f32 {
    let differs = |&i: &usize| {
        let near = |a: &[f32; 3], b: &[f32; 3]| a.iter().zip(b).all(|(a, b)| (a - b).abs() <= 4e-3 * b.abs() + 1e-3);
        a.drawn_id[i] != b.drawn_id[i] || !near(&a.d[i], &b.d[i])
    };
    (0..a.drawn_id.len()).filter(differs).count() as f32 / a.drawn_id.len() as f32
}

#[test]
fn modes_without_artefacts_show_what_a_full_redraw_shows() {
    let Some(device) = device() else { return };
    for (format, order) in FORMATS.into_iter().flat_map(|f| ORDERS.map(|o| (f, o))) {
        let modes: Vec<_> = UpdateMode::ALL.into_iter().filter(|mode| mode.check(device.report()).is_ok()).collect();
        assert!(modes.len() + 1 >= UpdateMode::ALL.len(), "stencil export is all that a device may lack: {modes:?}");
        let mut renderer = renderer(&device, Some(format), order, &modes);
        for mode in modes {
            let share = differing(&refine(&mut renderer, &scene(), mode));
            println!("{} {} {}: {share}", format.name(), order.name(), mode.name());
            match mode {
                UpdateMode::DepthLessEqual | UpdateMode::DepthEqual => assert!(share > 0.02, "{share}"),
                UpdateMode::Full | UpdateMode::Lookup => assert_eq!(share, 0.0),
                _ => assert!(share < 2e-3, "{}: {share}", mode.name()),
            }
        }
    }
    finish(device);
}

#[test]
fn sixteen_bits_of_depth_serve_the_modes_without_stencil() {
    let Some(device) = device() else { return };
    let depth = Depth::new(&device, Some(DepthFormat::D16), DepthOrder::Ordinary).unwrap();
    let options = RendererOptions { depth, ..RendererOptions::new(&device).unwrap() };
    let refused = options.check(&device).unwrap_err();
    assert!(refused.exit_status() == 2 && refused.to_string().contains("d32s8"), "{refused}");
    let modes = [UpdateMode::Id, UpdateMode::DepthEqual, UpdateMode::DepthBias, UpdateMode::Lookup];
    let mut renderer = renderer(&device, Some(DepthFormat::D16), DepthOrder::Ordinary, &modes);
    for mode in [UpdateMode::Id, UpdateMode::Lookup] {
        let share = differing(&refine(&mut renderer, &scene(), mode));
        assert!(share < 2e-3, "{}: {share}", mode.name());
    }
    drop(renderer);
    finish(device);
}

#[test]
fn what_a_device_lacks_is_named() {
    let Some(device) = device() else { return };
    let mut report = device.report().clone();
    report.optional.stencil_export = true;
    UpdateMode::ALL.iter().for_each(|mode| mode.check(&report).unwrap());
    report.optional.stencil_export = false;
    let refused = UpdateMode::StencilExport.check(&report).unwrap_err();
    assert_eq!(refused.exit_status(), 3);
    assert!(refused.to_string().contains("VK_EXT_shader_stencil_export"), "{refused}");
    finish(device);
}

fn pixels_of(counted: &[DrawnPixels]) -> HashMap<DrawnId, u32> {
    counted.iter().map(|drawn| (drawn.drawn, drawn.pixels)).collect()
}

#[test]
fn queries_counters_and_histogram_agree() {
    let Some(device) = device() else { return };
    let modes = [UpdateMode::Stencil, UpdateMode::Id, UpdateMode::DepthBias, UpdateMode::Lookup];
    let depth = Depth::new(&device, None, DepthOrder::Reversed).unwrap();
    let made = RendererOptions::new(&device).unwrap();
    let options = RendererOptions { depth, modes: modes.to_vec(), count_writes: true, atomic_counts: true, ..made };
    let mut renderer = Renderer::with_options(Arc::clone(&device), SIZE, options).unwrap();
    for mode in modes {
        let scene = terrain(20);
        let visible = faces(&show(&mut renderer, &scene, SIZE.width, SIZE.height));
        renderer.reset_drawn();
        let mut mesh = Splitter::new(&scene, &visible);
        renderer.apply(&base_update(&scene, visible.iter().copied(), false, |_, p| mesh.slot(p))).unwrap();
        renderer.frame(&full(mode)).unwrap();
        assert!(renderer.atomic_counts().is_empty(), "a full draw counts by histogram");
        let update = mesh.split(0.2);
        let new: Vec<DrawnId> = update.drawn_triangles.iter().map(|&(drawn, _)| drawn).collect();
        renderer.apply(&update).unwrap();
        let stats = renderer.frame(&FrameOptions { queries: 1000, ..patches(mode) }).unwrap();
        let queried: HashMap<DrawnId, u32> = pixels_of(renderer.query_counts());
        let counted: HashMap<DrawnId, u32> = pixels_of(renderer.atomic_counts());
        let histogram: HashMap<DrawnId, u32> = pixels_of(&renderer.drawn_counts().unwrap().drawn_triangles);
        assert!(new.len() > 500 && counted.len() == new.len(), "{} {}", new.len(), counted.len());
        assert_eq!(queried.len(), stats.queries as usize);
        assert!(mode == UpdateMode::Lookup || !queried.is_empty());
        for drawn in new {
            let shown = histogram.get(&drawn).copied().unwrap_or(0);
            assert_eq!(counted[&drawn], shown, "{mode:?}: counter of {drawn:?}");
            assert!(queried.get(&drawn).is_none_or(|&pixels| pixels == shown), "{mode:?}: query of {drawn:?}");
        }
    }
    drop(renderer);
    finish(device);
}
