//! Direct light at vertices: which lights are traced, and tracing them (docs/method/direct-light.md).
//!
//! Light is separated into what would arrive without occlusion, known in closed form, and the visible fraction, which
//! rays sample: one for a delta light, stratified points for an area light. Fully lit and fully dark vertices are
//! exact with a handful of rays; noise lives in penumbrae only.

use super::ids::{NodeId, SlotId, VertexId};
use super::pieces::Piece;
use super::store::Cache;
use super::vertex::Left;
use super::visibility_prior;
use crate::estimate::penumbra::Round;
use crate::estimate::visibility::{AreaSum, Origin, Visibility};
use crate::light::arrival::Arrival;
use crate::light::context::SceneContext;
use crate::light::group::LightGroup;
use crate::math::luminance;
use smallvec::SmallVec;

/// A visit to a vertex.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Job {
    /// The vertex.
    pub vertex: VertexId,
    /// What for.
    pub wanted: Wanted,
}

/// What a visit samples.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Wanted {
    /// First visit of a base vertex: the lights that make up most of what can arrive. Of a vertex that was visited before a light
    /// moved, only those that are not settled.
    Strongest,
    /// First visit of a midpoint: lights whose visibility the corners of the node that was split do not settle.
    Midpoint {
        /// The node.
        node: NodeId,
        /// Whether it is small enough to take agreeing corners' word for it.
        small: bool,
    },
    /// First visit of a vertex inside a leaf.
    Pixel,
    /// All lights not traced or inferred yet.
    Settle,
    /// One light group, traced closely because another vertex sees it otherwise.
    Confirm {
        /// The light group.
        light: u32,
    },
    /// As many points again for lights that are partly visible.
    Double,
}

impl Wanted {
    /// Whether a visit settles all lights, as far as they are worth it.
    #[must_use]
    pub const fn is_of_all_lights(self) -> bool {
        matches!(self, Self::Strongest | Self::Midpoint { .. } | Self::Pixel)
    }
}

/// New samples of one light at one vertex.
#[derive(Clone, Copy, Debug)]
pub struct LightResult {
    /// The vertex.
    pub vertex: VertexId,
    /// The light group.
    pub light: u32,
    /// Visibility including the new points.
    pub visibility: Visibility,
    /// How many entries of [`Results::sums`] belong to it.
    pub sums: u32,
}

/// Results of a run of jobs, in their order.
#[derive(Debug, Default)]
pub struct Results {
    /// By job and light.
    pub lights: Vec<LightResult>,
    /// What to add to the slots' sums, consecutive results' entries one after the other.
    pub sums: Vec<(SlotId, AreaSum)>,
    /// Vertices found covered by other geometry.
    pub covered: Vec<VertexId>,
    /// Rays traced.
    pub rays: u64,
}

/// Standard error of the light guessed on a first visit, against all that is expected, and lights that are worth it:
/// fewer cost less to trace than to come back for.
const DEFERRED_ERROR: f32 = 0.05;
const DEFERRED_LIGHTS: usize = 8;
/// Points of an area light that tell full and no visibility, and those that tell how much in between.
const FIRST_POINTS: u32 = 4;
const PENUMBRA_POINTS: u32 = 16;
/// Points after which a penumbra is not sampled further.
pub const MAX_POINTS: u32 = 1 << 16;

/// Where a vertex lies that is visited for the first time.
#[derive(Clone, Copy)]
enum VertexKind {
    /// At a corner of the scene's triangles.
    Base,
    /// On an edge of a node; whether that is so small that its corners may speak for it.
    Middle(NodeId, bool),
    /// Where a pixel sees it: nothing around it will tell that its few points missed something.
    Pixel,
}

/// Does a job.
pub fn visit(context: &SceneContext<'_>, cache: &Cache, job: Job, out: &mut Results) {
    match job.wanted {
        Wanted::Strongest => first_visit(context, cache, job.vertex, VertexKind::Base, out),
        Wanted::Midpoint { node, small } => {
            first_visit(context, cache, job.vertex, VertexKind::Middle(node, small), out)
        }
        // The camera sees it: nothing covers it.
        Wanted::Pixel => first_lights(context, cache, job.vertex, VertexKind::Pixel, out),
        Wanted::Settle => {
            let open = |v: Visibility| matches!(v.origin, Origin::Deferred | Origin::Unknown);
            for light in 0..context.lights.group_count() as u32 {
                let known = cache.layers[light as usize].visibility.get(job.vertex);
                if context.lights.group_is_on(light as usize) && open(known) {
                    sample(context, cache, (job.vertex, light), [FIRST_POINTS, PENUMBRA_POINTS], out);
                }
            }
        }
        Wanted::Confirm { light } => confirm(context, cache, (job.vertex, light), out),
        Wanted::Double => double(context, cache, job.vertex, out),
    }
}

/// The first visit of a vertex on the surface: its lights, and whether something covers it. That does not change when lights move.
fn first_visit(context: &SceneContext<'_>, cache: &Cache, id: VertexId, place: VertexKind, out: &mut Results) {
    let before = out.lights.len();
    first_lights(context, cache, id, place, out);
    if cache.without.has(Piece::Covered) || cache.vertices[id].outdated {
        return;
    }
    // A vertex that sees a light is not enclosed: only dark ones are worth the probes.
    let dark = out.lights[before..]
        .iter()
        .all(|result| result.visibility.fraction() == 0.0 || !context.lights.group_is_on(result.light as usize));
    if context.is_covered(&cache.vertices[id].shading_point(), dark, &mut out.rays) {
        out.covered.push(id);
    }
}

/// Goes through all lights, those of which most is at stake first: those that together matter little are guessed.
fn first_lights(context: &SceneContext<'_>, cache: &Cache, id: VertexId, place: VertexKind, out: &mut Results) {
    let mut open: SmallVec<[Open; 128]> = SmallVec::new();
    let around = if cache.without.has(Piece::VisibilityPrior) {
        visibility_prior::PriorCells::default()
    } else {
        cache.prior.cells_of(&cache.vertices[id])
    };
    let outdated = cache.vertices[id].outdated;
    let mut expected = 0.0;
    for (loaded, light) in strengths(context, cache, id) {
        let known = if outdated { cache.layers[light as usize].visibility.get(id) } else { Visibility::default() };
        if known.is_settled() {
            expected += loaded * context.lights.group_factor(light as usize).max_element() * known.fraction();
            continue;
        }
        let settled = if loaded == 0.0 {
            Some(0.0)
        } else {
            settled(cache, (context.lights.group(light as usize), light), place)
        };
        if let Some(fraction) = settled {
            let visibility = Visibility::taken_over(Origin::Inferred, fraction);
            out.lights.push(LightResult { vertex: id, light, visibility, sums: 0 });
            continue;
        }
        // What light can arrive as it is now, rather than as loaded.
        let strength = loaded * context.lights.group_factor(light as usize).max_element();
        open.push(Open { light, strength, odds: odds(cache, around, place, light) });
    }
    expected += open.iter().map(|o| o.strength * o.odds).sum::<f32>();
    let mut left: f32 = open.iter().map(Open::variance).sum();
    open.sort_unstable_by(|a, b| b.variance().total_cmp(&a.variance()).then(a.light.cmp(&b.light)));
    let many =
        !cache.without.has(Piece::Deferred) && open.iter().filter(|o| o.strength > 0.0).count() >= DEFERRED_LIGHTS;
    for light in open {
        let (at_stake, Open { light, strength, odds }) = (light.variance(), light);
        if strength == 0.0 || (many && left <= (DEFERRED_ERROR * expected).powi(2)) {
            let visibility = Visibility::taken_over(Origin::Deferred, odds);
            out.lights.push(LightResult { vertex: id, light, visibility, sums: 0 });
            continue;
        }
        left -= at_stake;
        let first = if matches!(place, VertexKind::Pixel) { PENUMBRA_POINTS } else { FIRST_POINTS };
        sample(context, cache, (id, light), [first, PENUMBRA_POINTS], out);
        let found = out.lights.last().map_or(odds, |result| result.visibility.fraction());
        expected += strength * (found - odds);
    }
}

/// Share of a light that a vertex may be expected to see, by what others around it and the corners of its node do.
fn odds(cache: &Cache, around: visibility_prior::PriorCells, place: VertexKind, light: u32) -> f32 {
    let odds = cache.prior.at(around, light);
    let VertexKind::Middle(node, _) = place else { return odds };
    let corners = cache.corner_vertices(node).map(|v| cache.layers[light as usize].visibility.get(v));
    let known = || corners.iter().filter(|corner| corner.is_settled());
    (odds + known().map(|corner| corner.fraction()).sum::<f32>()) / (1 + known().count()) as f32
}

/// Points of a light that a vertex should not fall short of: half of what those that it lies between took in its
/// penumbra, lest it know less than they told before it was there.
fn points_around(cache: &Cache, id: VertexId, light: u32) -> u32 {
    if cache.without.has(Piece::InheritedPoints) {
        return 0;
    }
    let layer = &cache.layers[light as usize].visibility;
    let points = |slot: SlotId| {
        let known = layer.get(cache.slots[slot].vertex);
        if known.is_partial() { known.points / 2 } else { 0 }
    };
    let between = cache.slots_of(id).filter_map(|slot| cache.between(slot)).filter(|between| !between.coarse);
    between.flat_map(|between| between.of).map(|&(slot, _)| points(slot)).max().unwrap_or(0)
}

/// A light that nothing but a ray can settle at a vertex.
struct Open {
    light: u32,
    /// What can arrive: luminance of irradiance, W·m⁻².
    strength: f32,
    /// Share of it that is likely to arrive.
    odds: f32,
}

impl Open {
    /// Variance of what arrives, by the odds, (W·m⁻²)².
    fn variance(&self) -> f32 {
        self.strength * self.strength * self.odds * (1.0 - self.odds)
    }
}

/// Unoccluded strength of each light at a vertex, on the slot that faces it most.
fn strengths(context: &SceneContext<'_>, cache: &Cache, id: VertexId) -> SmallVec<[(f32, u32); 128]> {
    context.lights.groups().map(|light| strength(cache, id, light)).zip(0..).collect()
}

pub(super) fn strength(cache: &Cache, id: VertexId, light: LightGroup<'_>) -> f32 {
    let position = cache.vertices[id].position;
    let at_slot = |slot: SlotId| light.strength(position, cache.slots[slot].normal());
    cache.slots_of(id).map(at_slot).fold(0.0, f32::max)
}

/// Points that are no fewer and give each member of a group as many turns; those that tell all, if there are such.
fn in_turns(light: LightGroup<'_>, points: u32) -> u32 {
    light.all_points().unwrap_or_else(|| points.next_multiple_of(light.count()))
}

/// Visible fraction that corners which agree settle without a ray.
fn settled(cache: &Cache, (emitter, light): (LightGroup<'_>, u32), place: VertexKind) -> Option<f32> {
    let VertexKind::Middle(node, true) = place else { return None };
    let layer = &cache.layers[light as usize].visibility;
    let corners = cache.corner_vertices(node).map(|v| layer.get(v));
    let first = corners[0].fraction();
    let known = corners.iter().all(|corner| corner.is_settled());
    let agree = corners.iter().all(|c| c.fraction() == first) && (first == 0.0 || first == 1.0);
    let exact = emitter.has_closed_form() || first == 0.0;
    (known && agree && exact).then_some(first)
}

/// Traces a light for the first time: by `first` points, or those that tell a penumbra; more where others around know
/// it better.
fn sample(
    context: &SceneContext<'_>,
    cache: &Cache,
    (id, light): (VertexId, u32),
    [first, penumbra]: [u32; 2],
    out: &mut Results,
) {
    let emitter = context.lights.group(light as usize);
    if !emitter.is_delta() {
        let around = points_around(cache, id, light);
        let [first, penumbra] = [first.max(around), penumbra.max(around)];
        let mut round = Tracing::new(context, cache, (id, light), Visibility::default(), out);
        round.trace(first.min(emitter.all_points().unwrap_or(u32::MAX)), out);
        if round.is_penumbra() {
            round.trace(in_turns(emitter, penumbra), out);
        }
        return round.finish(out);
    }
    let vertex = &cache.vertices[id];
    let shading_point = vertex.shading_point();
    let mut visibility = Visibility::default();
    let visible = context.points(&shading_point, light as usize).sample(context.scene, 0).is_some_and(|arrival| {
        out.rays += 1;
        context.visible(&shading_point, &arrival)
    });
    visibility.push(visible);
    out.lights.push(LightResult { vertex: id, light, visibility, sums: 0 });
}

/// Whether a vertex must be traced (again) where its neighbours see more or less of a light: what it knows was
/// inferred, or comes from too few points to tell a penumbra.
#[must_use]
pub fn is_unconfirmed(light: LightGroup<'_>, known: Visibility) -> bool {
    match known.origin {
        Origin::Inferred => true,
        Origin::Sampled => known.points < in_turns(light, PENUMBRA_POINTS),
        Origin::Deferred | Origin::Unknown => false,
    }
}

/// Traces a light with enough points for a penumbra.
fn confirm(context: &SceneContext<'_>, cache: &Cache, (id, light): (VertexId, u32), out: &mut Results) {
    let emitter = context.lights.group(light as usize);
    if emitter.is_delta() {
        return sample(context, cache, (id, light), [FIRST_POINTS, PENUMBRA_POINTS], out);
    }
    let known = cache.layers[light as usize].visibility.get(id);
    let mut round = Tracing::new(context, cache, (id, light), known, out);
    round.trace(in_turns(emitter, PENUMBRA_POINTS), out);
    round.finish(out);
}

/// Traces as many points again of each area light that is partly visible.
fn double(context: &SceneContext<'_>, cache: &Cache, id: VertexId, out: &mut Results) {
    for (light, emitter) in (0_u32..).zip(context.lights.groups()) {
        let known = cache.layers[light as usize].visibility.get(id);
        if context.lights.group_is_on(light as usize) && is_doubled(emitter, known) {
            let mut round = Tracing::new(context, cache, (id, light), known, out);
            round.trace(known.points * 2, out);
            round.finish(out);
        }
    }
}

/// Whether more points of a light would tell more: in its penumbra, and everywhere if it has no closed form.
fn is_doubled(light: LightGroup<'_>, known: Visibility) -> bool {
    if light.all_points().is_some() {
        return false;
    }
    // Where neighbours agree, few points were taken and none are needed.
    let penumbra = known.points >= in_turns(light, PENUMBRA_POINTS);
    let sampled = known.points > 0 && known.fraction() > 0.0 && !light.has_closed_form();
    (penumbra || sampled) && known.points < MAX_POINTS
}

impl Left {
    /// Takes in what a light that is on leaves to do.
    pub(super) fn add(&mut self, light: LightGroup<'_>, known: Visibility) {
        // One ray for a delta light, four for an area light: two is near enough for a key.
        self.settle += if known.origin == Origin::Deferred { 2 } else { 0 };
        self.double += if is_doubled(light, known) { known.points } else { 0 };
        self.partial += if known.is_partial() { known.points } else { 0 };
    }
}

/// A round of points of one light group at one vertex.
struct Tracing<'a> {
    context: &'a SceneContext<'a>,
    cache: &'a Cache,
    id: VertexId,
    light: u32,
    visibility: Visibility,
    /// First entry of the results' sums that is this round's.
    first: usize,
}

impl<'a> Tracing<'a> {
    fn new(
        context: &'a SceneContext<'a>,
        cache: &'a Cache,
        (id, light): (VertexId, u32),
        known: Visibility,
        out: &mut Results,
    ) -> Self {
        let first = out.sums.len();
        out.sums.extend(cache.slots_of(id).map(|slot| (slot, AreaSum::default())));
        let visibility = if known.points == 0 { Visibility::default() } else { known };
        Self { context, cache, id, light, visibility, first }
    }

    /// Adds points until there are `until`.
    fn trace(&mut self, until: u32, out: &mut Results) {
        let shading_point = self.cache.vertices[self.id].shading_point();
        let points = self.context.points(&shading_point, self.light as usize);
        while self.visibility.points < until {
            let arrival = points.sample(self.context.scene, self.visibility.points);
            let lit = arrival
                .filter(|a| self.cache.slots_of(self.id).any(|s| self.cache.slots[s].normal().dot(a.direction) > 0.0));
            // Points that no normal faces carry no weight; as visible ones they do not pretend a penumbra.
            let visible = lit.is_none_or(|a| {
                out.rays += 1;
                self.context.visible(&shading_point, &a)
            });
            self.visibility.push(visible);
            let Some(arrival) = lit else { continue };
            weigh(self.cache, &arrival, visible, &mut out.sums[self.first..]);
        }
    }

    fn is_penumbra(&self) -> bool {
        let fraction = self.visibility.fraction();
        fraction > 0.0 && fraction < 1.0
    }

    fn finish(self, out: &mut Results) {
        let sums = (out.sums.len() - self.first) as u32;
        out.lights.push(LightResult { vertex: self.id, light: self.light, visibility: self.visibility, sums });
    }
}

/// Adds the light of a point to the sums of slots.
pub(super) fn weigh(cache: &Cache, arrival: &Arrival, visible: bool, sums: &mut [(SlotId, AreaSum)]) {
    for (slot, sum) in sums {
        let cosine = cache.slots[*slot].normal().dot(arrival.direction).max(0.0);
        sum.unoccluded += luminance(arrival.facing) * cosine;
        if visible {
            sum.visible += arrival.facing * cosine;
        }
    }
}

/// Writes results into the cache, in order (the engine alone, phase "apply").
pub fn apply(cache: &mut Cache, results: &Results) {
    for vertex in &results.covered {
        cache.vertices[*vertex].progress.covered = true;
    }
    let mut sums = results.sums.as_slice();
    let mut cells = (None, [0; 3]);
    for result in &results.lights {
        let before = cache.layers[result.light as usize].visibility.get(result.vertex);
        if result.visibility.origin == Origin::Sampled && before.points == 0 {
            if cells.0 != Some(result.vertex) {
                cells = (Some(result.vertex), cache.prior.cells(&cache.vertices[result.vertex]));
            }
            cache.prior.note(cells.1, result.light, result.visibility.fraction());
        }
        let (own, rest) = sums.split_at(result.sums as usize);
        sums = rest;
        note_rounds(cache, result, before, own);
        let layer = &mut cache.layers[result.light as usize];
        layer.visibility.set(result.vertex, result.visibility);
        cache.vertices[result.vertex].progress.traced |= result.visibility.origin == Origin::Sampled;
        for &(slot, sum) in own {
            let entry = layer.sums.entry(slot);
            entry.visible += sum.visible;
            entry.unoccluded += sum.unoccluded;
        }
    }
}

/// Notes how as many new points of a light as there were before differ from those.
fn note_rounds(cache: &mut Cache, result: &LightResult, before: Visibility, sums: &[(SlotId, AreaSum)]) {
    let points = before.points;
    if points == 0 || result.visibility.points != 2 * points {
        return;
    }
    let round =
        |sum: AreaSum| (sum.unoccluded > 0.0).then(|| Round { points, share: luminance(sum.visible) / sum.unoccluded });
    let layer = &cache.layers[result.light as usize].sums;
    let told = sums.iter().find_map(|&(slot, sum)| Some([round(layer.get(slot))?, round(sum)?]));
    if let Some([before, more]) = told {
        cache.penumbrae.note(result.light, before, more);
    }
}
