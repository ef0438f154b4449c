//! Metalness and roughness at slots, against the model itself and against sums over points of lamps.
#![allow(clippy::expect_used, reason = "a failed expectation fails the test")]

use crate::direct::lamp;
use crate::support::by_hand::{both_sides, engine, front, light, material, patch, solve};
use glam::Vec3;
use penombre::bsdf::{Gloss, Reflectance};
use penombre::scene::light::LightKind;
use penombre::scene::material::{MetallicRoughness, Model};
use penombre::scene::{Scene, TriangleId};
use std::f32::consts::PI;

const COLOUR: Vec3 = Vec3::new(0.9, 0.5, 0.2);

/// A floor of that material.
fn floor(scene: &mut Scene, metallic: f32, roughness: f32, cells: u32) -> Vec<TriangleId> {
    let model = MetallicRoughness { metallic, roughness, map_metallic: None, map_roughness: None };
    let of_floor = material(scene, |m| (m.kd, m.model) = (COLOUR, Model::MetallicRoughness(model)));
    patch(scene, Vec3::new(-1.0, 0.0, -1.0), Vec3::Z * 2.0, Vec3::X * 2.0, cells, of_floor)
}

fn gloss(metallic: f32, roughness: f32) -> Gloss {
    Reflectance::metallic_roughness(COLOUR, metallic, roughness).gloss.expect("it shines")
}

/// One direction: both D and S are the model's.
#[test]
fn point_lights_are_exact() {
    for (metallic, roughness) in [(0.0, 0.4), (0.0, 0.8), (1.0, 0.3), (0.6, 0.5)] {
        let mut scene = Scene::default();
        let ids = floor(&mut scene, metallic, roughness, 4);
        let (position, eye) = (Vec3::new(0.5, 1.0, 0.0), Vec3::new(-1.0, 1.0, 0.3));
        light(&mut scene, LightKind::Point { position, intensity: Vec3::splat(3.0) });
        let mirror = solve(&mut engine(scene, 1, 0), &both_sides(&ids), eye);
        let gloss = gloss(metallic, roughness);
        for slot in front(&ids).iter().flat_map(|&face| mirror.face(face)) {
            let to_light = position - slot.position;
            let l = to_light.normalize();
            let irradiance = 3.0 * l.y / to_light.length_squared();
            let lobe = gloss.seen(Vec3::Y, (eye - slot.position).normalize());
            let specular = lobe.value(l) * irradiance;
            let diffuse = irradiance / PI * gloss.diffuse_in(l.y);
            let error = (slot.specular - specular).abs().max_element() / specular.max_element();
            assert!(error < 1e-3, "{metallic} {roughness}: {} {specular}", slot.specular);
            assert!(
                (slot.diffuse.x / diffuse - 1.0).abs() < 1e-3,
                "{metallic} {roughness}: {} {diffuse}",
                slot.diffuse
            );
        }
    }
}

/// Of a lamp, D and S are sums over its points to within what the page on reflection says.
#[test]
fn lamps_are_nearly_exact() {
    for (metallic, roughness) in [(0.0, 0.2), (0.0, 0.6), (1.0, 0.15), (1.0, 0.4), (1.0, 1.0)] {
        let mut scene = Scene::default();
        let ids = floor(&mut scene, metallic, roughness, 6);
        let (corner, side) = (Vec3::new(-0.4, 1.0, -0.3), 0.6);
        lamp(&mut scene, corner, Vec3::X * side, Vec3::Z * side);
        let eye = Vec3::new(0.2, 0.9, 1.6);
        let mirror = solve(&mut engine(scene, 1, 0), &both_sides(&ids), eye);
        let gloss = gloss(metallic, roughness);
        let (mut error, mut all, mut of_diffuse) = (0.0, 0.0, 0.0_f32);
        for slot in front(&ids).iter().flat_map(|&face| mirror.face(face)) {
            let lobe = gloss.seen(Vec3::Y, (eye - slot.position).normalize());
            let n = 96;
            let (mut specular, mut diffuse) = (Vec3::ZERO, 0.0);
            for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
                let at = |i: i32| (i as f32 + 0.5) / n as f32 * side;
                let to_light = corner + Vec3::new(at(i), 0.0, at(j)) - slot.position;
                let l = to_light.normalize();
                let arriving = l.y * l.y / to_light.length_squared() * (side / n as f32).powi(2);
                specular += lobe.value(l) * arriving;
                diffuse += gloss.diffuse_in(l.y) * arriving / PI;
            }
            error += (slot.specular - specular).abs().max_element();
            all += specular.max_element();
            of_diffuse = of_diffuse.max((slot.diffuse.x / diffuse - 1.0).abs());
        }
        assert!(error < 0.03 * all, "{metallic} {roughness}: S differs by {} on average", error / all);
        assert!(of_diffuse < 0.01, "{metallic} {roughness}: D differs by {of_diffuse}");
    }
}
