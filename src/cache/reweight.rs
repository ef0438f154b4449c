//! Groups whose lights have changed against each other: what was sampled of them is weighed anew.
//!
//! Which points are visible does not depend on what lights emit, but sums over points of several lights do. Where all
//! points are remembered, the sums are made again without a ray. Where there were more, only that all or none were
//! visible still says something; other fractions become guesses, which are traced again when that is what costs most.

use super::direct::weigh;
use super::ids::{SlotId, VertexId};
use super::store::Cache;
use crate::estimate::visibility::{AreaSum, Origin, REMEMBERED, Visibility};
use crate::light::context::SceneContext;
use smallvec::SmallVec;

/// Weighs what is known of a light group at all vertices by what its sources count times now.
pub fn reweight(context: &SceneContext<'_>, cache: &mut Cache, light: usize) {
    for vertex in cache.vertices.ids() {
        let known = cache.layers[light].visibility.get(vertex);
        if known.origin != Origin::Sampled {
            continue;
        }
        let sums = if known.points <= REMEMBERED {
            sums_anew(context, cache, (vertex, light), known)
        } else {
            none(cache, vertex)
        };
        let layer = &mut cache.layers[light];
        sums.into_iter().for_each(|(slot, sum)| *layer.sums.entry(slot) = sum);
        if known.points > REMEMBERED {
            let fraction = known.fraction();
            let origin = if fraction == 0.0 || fraction == 1.0 { Origin::Inferred } else { Origin::Deferred };
            layer.visibility.set(vertex, Visibility::taken_over(origin, fraction));
        }
    }
}

type Sums = SmallVec<[(SlotId, AreaSum); 4]>;

fn none(cache: &Cache, vertex: VertexId) -> Sums {
    cache.slots_of(vertex).map(|slot| (slot, AreaSum::default())).collect()
}

/// The sums over remembered points.
fn sums_anew(context: &SceneContext<'_>, cache: &Cache, (vertex, light): (VertexId, usize), known: Visibility) -> Sums {
    let mut sums = none(cache, vertex);
    let points = context.points(&cache.vertices[vertex].shading_point(), light);
    for (index, visible) in known.remembered() {
        if let Some(arrival) = points.sample(context.scene, index) {
            weigh(cache, &arrival, visible, &mut sums);
        }
    }
    sums
}
