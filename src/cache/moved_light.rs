//! Lights that have moved: what was sampled of them belongs to where they were.

use super::direct::strength;
use super::sparse::Sparse;
use super::store::Cache;
use crate::estimate::visibility::{Origin, Visibility};
use crate::light::lights::Lights;

/// Forgets what is known of a light group, which is still where it was, at all vertices, and of nothing else. Each is due to be
/// visited again. Until then it is a guess that as much of the light is visible from its new place as was, all of it where its
/// light could not arrive at all.
pub fn forget(before: &Lights, cache: &mut Cache, light: usize) {
    cache.prior.forget(light as u32);
    cache.penumbrae.forget(light as u32);
    cache.layers[light].sums = Sparse::default();
    for vertex in cache.vertices.ids() {
        let known = cache.layers[light].visibility.get(vertex);
        if known.is_known() {
            let was_reached = known.fraction() > 0.0 || strength(cache, vertex, before.group(light)) > 0.0;
            let guess = if was_reached { known.fraction() } else { 1.0 };
            cache.layers[light].visibility.set(vertex, Visibility::taken_over(Origin::Deferred, guess));
            cache.vertices[vertex].outdated = true;
        }
    }
}
