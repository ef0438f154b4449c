//! What a leaf's corners do not say: one ray a light from where a pixel sees it.
//!
//! Corners may all lie in or under other geometry while the leaf between them is lit, and a shadow or a shaft of
//! light may pass between them.

use super::ids::{NodeId, VertexId};
use super::store::Cache;
use crate::light::context::{SceneContext, ShadingPoint};
use crate::light::group::LightGroup;
use smallvec::SmallVec;
use std::f32::consts::PI;

/// Share of all the light that may arrive above which a light is worth a ray.
const WEAK: f32 = 0.03;
/// Cosine between a facet and a light below which the facet's own body hides it, whatever the shading normals say.
const GRAZING: f32 = 0.05;
/// Points of an area light, or a group of them, that tell how much of it is visible where the first says otherwise
/// than the corners do.
const POINTS: u32 = 16;

/// What rays from between the corners of a leaf found.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Mismatch {
    /// Luminance of D, W·sr⁻¹·m⁻², by which the lights found otherwise than all corners say differ from that.
    pub luminance: f32,
    /// Whether there are lights of which the corners do not say the same: nothing was traced for them.
    pub open: bool,
    /// Whether there are lights of which another point may say something else.
    pub more: bool,
}

/// Asks by a ray to each light whether it is at a point of a leaf, given by barycentric weights, as all corners of
/// the leaf say; of an area light or a group, by its `turn`-th point.
#[must_use]
pub fn mismatch(
    context: &SceneContext<'_>,
    cache: &Cache,
    (id, weights): (NodeId, [f32; 3]),
    turn: u32,
    rays: &mut u64,
) -> Mismatch {
    let shading_point = cache.vertex_inside(id, weights).shading_point();
    let corners = cache.drawn_vertices(id);
    let strength = |(light, emitter): (usize, LightGroup<'_>)| {
        emitter.strength(shading_point.position, shading_point.normal)
            * context.lights.group_factor(light).max_element()
    };
    let strengths: SmallVec<[f32; 128]> = context.lights.groups().enumerate().map(strength).collect();
    let weak = WEAK * strengths.iter().sum::<f32>();
    let mut mismatch = Mismatch::default();
    for (light, &strength) in strengths.iter().enumerate().filter(|(_, strength)| **strength > weak) {
        match agreed(cache, light, &corners) {
            Some(visible) => {
                let share = disagreement(context, &shading_point, (light, visible), turn, rays);
                mismatch.luminance += strength * share / PI;
                mismatch.more |= turn + 1 < context.lights.group(light).all_points().unwrap_or(POINTS);
            }
            None => mismatch.open = true,
        }
    }
    mismatch
}

/// Lights of which the corners of a node do not know the same: nothing is asked about them.
#[must_use]
pub fn open_lights(cache: &Cache, id: NodeId) -> u32 {
    let corners = cache.drawn_vertices(id);
    (0..cache.layers.len()).filter(|&light| agreed(cache, light, &corners).is_none()).count() as u32
}

/// Share of a light that is visible though it should not be, or hidden though it should be visible.
fn disagreement(
    context: &SceneContext<'_>,
    shading_point: &ShadingPoint,
    (light, visible): (usize, bool),
    turn: u32,
    rays: &mut u64,
) -> f32 {
    let points = context.points(shading_point, light);
    let mut differs = |point: u32| {
        let arrival = points.sample(context.scene, point).filter(|a| a.direction.dot(shading_point.normal) > GRAZING);
        arrival.is_some_and(|arrival| {
            *rays += 1;
            context.visible(shading_point, &arrival) != visible
        })
    };
    // One point of an area light or a group says no more than that there is something.
    let all = context.lights.group(light).all_points().unwrap_or(POINTS);
    if turn >= all || !differs(turn) {
        return 0.0;
    }
    (1 + (0..all).filter(|&point| point != turn && differs(point)).count()) as f32 / all as f32
}

/// Whether a light is visible, if all corners of a node know and agree.
fn agreed(cache: &Cache, light: usize, corners: &[VertexId]) -> Option<bool> {
    let visibility = &cache.layers[light].visibility;
    let told = |corner: &VertexId| {
        let known = visibility.get(*corner);
        let whole = known.fraction() == 0.0 || known.fraction() == 1.0;
        (known.is_settled() && whole).then(|| known.fraction() == 1.0)
    };
    let first = told(&corners[0])?;
    corners[1..].iter().all(|corner| told(corner) == Some(first)).then_some(first)
}
