//! Every tone-mapping operator of the combine shader against its twin on the CPU.
#![allow(clippy::unwrap_used, reason = "in a test, a panic is how a failure shows")]

use crate::support::device::*;
use glam::Vec3;
use penombre::image::tone_mapping;
use penombre::pass::{FrameOptions, UpdateMode};
use penombre::refine::update::Slot;
use penombre::scene::{Display, ToneMapping};

#[test]
fn operators_agree_with_their_twins() {
    with_renderer(|renderer| {
        let mut scene = empty_scene();
        let white = add_material(&mut scene, |m| m.kd = Vec3::ONE);
        add_quad(&mut scene, Vec3::new(-1.0, -1.0, 0.0), Vec3::X * 2.0, Vec3::Y * 2.0, white, 1.0);
        let visible = show(renderer, &scene, 96, 96);
        // A wide range of colours over the square, from near black to far beyond white, saturated ones among them.
        let light = |_, position: Vec3| {
            let diffuse =
                Vec3::new(8.0, 0.4, 0.01) * (position.x + 1.001) + Vec3::new(0.02, 0.3, 6.0) * (position.y + 1.0);
            Slot { position, weight: 1.0, diffuse, specular: Vec3::ZERO, light_vector: glam::Vec4::ZERO }
        };
        renderer.apply(&base_update(&scene, faces(&visible), false, light)).unwrap();
        for (name, tone_mapping) in ToneMapping::NAMES {
            let mut codes = std::collections::HashSet::new();
            for exposure in [-3.0, 0.0, 2.5] {
                let combine = Some(Display { exposure, tone_mapping });
                let options = FrameOptions {
                    full_luminance: true,
                    colour: true,
                    combine,
                    update_mode: UpdateMode::Stencil,
                    queries: 0,
                };
                renderer.frame(&options).unwrap();
                let display = renderer.read_display().unwrap();
                let layers = renderer.read_layers().unwrap();
                for (shown, linear) in display.iter().zip(&layers.combined) {
                    let [r, g, b, a] = *linear;
                    let expected = tone_mapping::display(Vec3::new(r, g, b), exposure, tone_mapping);
                    assert_eq!(shown[3], if a > 0.0 { 255 } else { 0 });
                    for (shown, expected) in shown.iter().zip(expected) {
                        let close = shown.abs_diff(expected) <= 1;
                        assert!(close, "{name} at {exposure}: {shown}, not {expected}, for {linear:?}");
                    }
                    codes.insert(expected);
                }
            }
            assert!(codes.len() > 300, "{name}: only {} colours compared", codes.len());
        }
    });
}
