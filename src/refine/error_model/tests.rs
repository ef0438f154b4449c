//! Keys of direct light on a square whose light is set by hand.

use super::*;
use crate::cache::slot::Luminance;
use crate::cache::testing::known;
use crate::refine::testing::{Judged, judged};
use glam::Vec3;

/// A quadratic of the plane.
fn quadratic([a, b, c]: [f32; 3]) -> impl Fn(Vec3) -> f32 {
    move |x| 3.0 + x.x - 0.5 * x.z + a * x.x * x.x + b * x.x * x.z + c * x.z * x.z
}

/// Mean square error of interpolating a function linearly over a triangle, by the middles of its n² parts.
fn interpolation_error([a, b, c]: [Vec3; 3], f: &impl Fn(Vec3) -> f32) -> f64 {
    const N: u16 = 200;
    let error = |u: f32, v: f32| {
        let linear = f(a) + (f(b) - f(a)) * u + (f(c) - f(a)) * v;
        f64::from(f(a + (b - a) * u + (c - a) * v) - linear).powi(2)
    };
    let at = |i: u16, third: f32| (f32::from(i) + third) / f32::from(N);
    let mut sum = 0.0;
    for (i, j) in (0..N).flat_map(|i| (0..N - i).map(move |j| (i, j))) {
        sum += error(at(i, 1.0 / 3.0), at(j, 1.0 / 3.0));
        sum += if i + j + 1 < N { error(at(i, 2.0 / 3.0), at(j, 2.0 / 3.0)) } else { 0.0 };
    }
    sum / f64::from(N).powi(2)
}

#[test]
fn surpluses_give_the_mean_square_error_of_interpolating_a_quadratic() {
    for coefficients in [[1.0, 0.0, 0.0], [0.0, 2.0, 0.0], [1.0, -3.0, 0.5], [-0.7, 1.1, -2.0]] {
        let f = quadratic(coefficients);
        let mut square = judged(100.0);
        let root = square.roots[0];
        let middles = square.split(root).middles;
        square.show_direct(&f);
        let expected = 0.64 * interpolation_error(square.cache.corner_positions(root), &f);
        let surplus = f64::from(square.model().surplus(root, middles));
        assert!((surplus / expected - 1.0).abs() < 1e-3, "{coefficients:?}: {surplus} against {expected}");
    }
}

#[test]
fn surplus_that_noise_explains_is_none() {
    let mut square = judged(100.0);
    let root = square.roots[0];
    let middles = square.split(root).middles;
    square.show_direct(|_| 1.0);
    square.cache.slots[middles[0]].set_direct(known(1.2, 0.0));
    let measured = square.model().surplus(root, middles);
    assert!((measured / (SURPLUS_TO_MSE * 0.64 * 0.04) - 1.0).abs() < 1e-3, "{measured}");
    square.cache.slots[middles[0]].set_direct(known(1.2, 0.05));
    assert_eq!(square.model().surplus(root, middles), 0.0);
}

fn corner_lights(square: &mut Judged, lights: [f32; 3]) -> NodeId {
    let root = square.roots[0];
    let slots = square.corners(root);
    slots.into_iter().zip(lights).for_each(|(slot, y)| square.cache.slots[slot].set_direct(known(y, 0.0)));
    root
}

#[test]
fn contrast_is_the_largest_along_an_edge_and_makes_an_edge_hard() {
    let mut square = judged(100.0);
    let root = corner_lights(&mut square, [1.0, 1.2, 0.8]);
    let light = square.model().leaf(root);
    assert!((light.contrast - 0.2).abs() < 1e-4 && (light.mean - 0.8).abs() < 1e-4, "{light:?}");
    assert!((light.least - 0.64).abs() < 1e-4 && square.model().is_hard(root, &light), "{light:?}");
    let root = corner_lights(&mut square, [1.0, 1.1, 0.95]);
    assert!(!square.model().is_hard(root, &square.model().leaf(root)));
    // Light from elsewhere fills the shadow.
    let root = corner_lights(&mut square, [1.0, 1.2, 0.8]);
    square.corners(root).into_iter().for_each(|slot| square.cache.slots[slot].set_indirect(known(2.0, 0.0)));
    assert!((square.model().leaf(root).contrast - 0.4 / 6.0).abs() < 1e-4);
    // A covered corner is an edge whatever it shows.
    let covered = square.cache.corner_vertices(root)[0];
    square.cache.vertices[covered].progress.covered = true;
    let light = square.model().leaf(root);
    assert!(light.contrast == 1.0 && light.covered && square.model().is_hard(root, &light));
}

#[test]
fn what_is_not_worth_it_has_no_key() {
    let mut square = judged(100.0);
    let root = corner_lights(&mut square, [1.0; 3]);
    assert_eq!(square.model().split_key(root), 0.0, "even light");
    let root = corner_lights(&mut square, [0.5, 1.0, 1.0]);
    assert!(square.model().split_key(root) > 0.0);
    square.see(root, 0.01);
    assert_eq!(square.model().split_key(root), 0.0, "a hard edge ends far below a pixel");
    square.see(root, 100.0);
    square.options.tolerance = 1.0;
    assert_eq!(square.model().split_key(root), 0.0, "below the tolerance");
}

#[test]
fn a_leaf_with_measured_surplus_comes_before_one_without() {
    let mut square = judged(100.0);
    let root = corner_lights(&mut square, [1.0, 1.05, 0.95]);
    let key = |square: &Judged| square.model().split_key(root);
    let without = key(&square);
    square.cache.topology.nodes[root].direct_surplus = 1e-3;
    let with = key(&square);
    square.cache.topology.nodes[root].direct_surplus = 4e-3;
    assert!(without < with && with < key(&square), "{without} {with} {}", key(&square));
    square.cache.topology.nodes[root].direct_surplus = 1e-3;
    square.see(root, 200.0);
    assert!((key(&square) / with - 2.0).abs() < 1e-3, "twice the pixels");
}

#[test]
fn noise_is_worth_a_ray_as_far_as_it_shows() {
    let mut square = judged(90.0);
    let root = corner_lights(&mut square, [1.0; 3]);
    square.cache.draw(root, None);
    let slot = square.corners(root)[1];
    let vertex = square.cache.slots[slot].vertex;
    let mut key = |variance: f32, rays: f32| {
        let light = square.cache.slots[slot].direct();
        square.cache.slots[slot].set_direct(Luminance { variance, ..light });
        square.model().vertex_key(vertex, rays)
    };
    // A sixth of a corner's variance is in the leaf's mean square error; half of it goes.
    let gain = 0.64 * 0.8_f32.powf(-DARKS);
    assert!((key(0.125, 10.0) / (90.0 / 6.0 * 0.125 * gain * 0.5 / 10.0) - 1.0).abs() < 1e-3);
    assert_eq!((key(0.0, 10.0), key(1e-7, 10.0)), (0.0, 0.0));
}
