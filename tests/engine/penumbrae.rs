//! Penumbrae against a closed form: their error must fall as long as rays are spent.
#![allow(clippy::expect_used, reason = "a failed expectation fails the test")]

use crate::support::by_hand::{Mirror, drawn, engine_with, front, interpolated, light, material, options, patch};
use glam::{Vec2, Vec3};
use penombre::light::area::AreaSource;
use penombre::light::lights::Lights;
use penombre::light::source::Source;
use penombre::math::sequence::Sequence;
use penombre::refine::engine::{Budget, Visible};
use penombre::refine::options::Options;
use penombre::refine::update::Slot;
use penombre::scene::light::LightKind;
use penombre::scene::{Scene, TriangleId};
use std::f32::consts::PI;

/// Edge of the screen, and its height; all of x beyond it is hidden from the lamp's points beyond the line of sight.
const EDGE: f32 = 0.05;
const HEIGHT: f32 = 0.4;

/// A lamp at height 1, facing down, from x = −0.2 to `end`.
fn add_lamp(scene: &mut Scene, end: f32) {
    let bright = material(scene, |m| m.ke = Vec3::ONE);
    let triangles = patch(scene, Vec3::new(-0.2, 1.0, -0.2), Vec3::X * (end + 0.2), Vec3::Z * 0.4, 1, bright);
    light(scene, LightKind::Area { triangles });
}

/// A floor under the lamp, half of it behind a wide screen.
fn scene() -> (Scene, Vec<TriangleId>) {
    let mut scene = Scene::default();
    let grey = material(&mut scene, |_| {});
    let floor = patch(&mut scene, Vec3::new(-0.5, 0.0, -0.5), Vec3::Z, Vec3::X, 1, grey);
    add_lamp(&mut scene, 0.2);
    patch(&mut scene, Vec3::new(EDGE, HEIGHT, -4.0), Vec3::Z * 8.0, Vec3::X * 8.0, 1, grey);
    (scene, floor)
}

/// D at a point of the floor: of the lamp, what is on this side of the line of sight past the edge.
fn exact(x: Vec3) -> f32 {
    let end = (x.x + (EDGE - x.x) / HEIGHT).min(0.2);
    if end <= -0.2 {
        return 0.0;
    }
    let mut visible = Scene::default();
    add_lamp(&mut visible, end);
    let Source::Area(source) = &Lights::new(&visible).sources[0] else { panic!("a lamp") };
    AreaSource::closed_form(source, x).expect("two triangles").irradiance(Vec3::Y).x / PI
}

/// Square error that the triangles of the floor show at random points, over the squared mean.
fn square_error(triangles: &[[Slot; 3]]) -> f64 {
    let (mut square, mut mean) = (0.0, 0.0);
    let points = 1000;
    for i in 0..points {
        let [u, v, ..] = Sequence::new(9).point(i);
        let p = Vec2::new(u, v) * 0.998 - 0.499;
        let x = Vec3::new(p.x, 0.0, p.y);
        let shown = triangles.iter().find_map(|t| interpolated(t, x)).expect("on the floor");
        let exact = f64::from(exact(x));
        square += (f64::from(shown.x) - exact).powi(2);
        mean += exact;
    }
    square / f64::from(points) / (mean / f64::from(points)).powi(2)
}

/// Relative errors after each of these numbers of rays.
fn errors(rays: &[u64]) -> Vec<f64> {
    let (scene, floor) = scene();
    let options = Options { min_pixels: 0.0, tolerance: 2.5e-4, shadow_size: 0.1, ..options(1) };
    let mut engine = engine_with(scene, 2, options);
    let faces = front(&floor).iter().map(|&f| (f, 100_000)).collect();
    let mut mirror = Mirror::default();
    mirror.apply(engine.set_visible(&Visible { generation: 1, eye: Vec3::Y, image: None, faces }));
    let after = |rays: &u64| {
        while !mirror.last.stats.converged && mirror.last.stats.rays < *rays {
            mirror.apply(engine.step(Budget::Rays(5_000)));
            engine.counted(&drawn(&mirror));
        }
        let triangles: Vec<[Slot; 3]> = front(&floor).iter().flat_map(|&face| mirror.triangles(face)).collect();
        square_error(&triangles).sqrt()
    };
    rays.iter().map(after).collect()
}

#[test]
fn their_error_goes_on_falling() {
    let errors = errors(&[300_000, 1_200_000, 4_800_000]);
    for pair in errors.windows(2) {
        // 0.68 and 0.62.
        assert!(pair[1] < 0.72 * pair[0], "four times as many rays: {errors:?}");
    }
    assert!(errors[2] < 0.002, "{errors:?}");
}
