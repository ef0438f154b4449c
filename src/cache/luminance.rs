//! Luminance shown at a slot, from the samples of its vertex: no ray is traced here.

use super::ids::SlotId;
use super::slot::Luminance;
use super::store::Cache;
use super::vertex::{Left, Vertex};
use crate::bsdf::Gloss;
use crate::estimate::lobe_share::lobe_share;
use crate::estimate::visibility::{AreaSum, Origin, Visibility};
use crate::light::appearance::Appearance;
use crate::light::arrival::Arrival;
use crate::light::context::SceneContext;
use crate::light::group::LightGroup;
use crate::light::receiver::Receiver;
use crate::light::source::Source;
use crate::math::luminance;
use glam::{Vec3, Vec4};
use std::f32::consts::PI;

/// Diffuse luminance of a slot.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Diffuse {
    /// D = Σ E/π over all lights, W·sr⁻¹·m⁻², as far as known (docs/method/what-a-pixel-shows.md).
    pub value: Vec3,
    /// Variance of its luminance, (W·sr⁻¹·m⁻²)², from penumbrae and from lights that are not traced yet.
    pub variance: f32,
}

/// Least odds that a guess of what a place sees of a light is wrong.
const LEAST_ODDS: f32 = 1.0 / 255.0;
/// Points from which on what they say of a penumbra tells their noise: fewer were taken where neighbours agree.
const SURE_POINTS: u32 = 16;
/// Variance of a group's stratified turns against independent ones.
const STRATIFIED: f32 = 0.3;

/// Relative variance of one point of a light that has no closed form.
const SAMPLED: f32 = 0.1;

/// What a slot shows.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Shown {
    /// Diffuse luminance.
    pub diffuse: Diffuse,
    /// Specular luminance S, W·sr⁻¹·m⁻² (docs/method/what-a-pixel-shows.md).
    pub specular: Vec3,
    /// Light vector by luminance over π, W·sr⁻¹·m⁻²: its component along the normal is the luminance of D, about. Only where the scene has
    /// normal maps, else 0. Behind it the fluence likewise.
    pub light_vector: Vec4,
    /// What its vertex leaves to trace.
    pub left: Left,
    /// Whether all of it is a guess by what was found around its vertex, which was never visited.
    pub guessed: bool,
}

/// Stands for the highlight that a matt surface has not.
const MATT: Gloss = Gloss::Phong { shininess: 0.0, mirror: false };

/// Luminance of a highlight against its light's diffuse one up to which it has the light's mean colour.
const COLOURLESS: f32 = 1e-3;

/// What one light group adds to what a slot shows.
#[derive(Clone, Copy, Debug)]
pub struct LightPart {
    /// The light group.
    pub light: usize,
    /// What is known of its visibility, or guessed.
    pub visibility: Visibility,
    /// Diffuse luminance D of it, with its variance.
    pub diffuse: Diffuse,
    /// Specular luminance S of it, W·sr⁻¹·m⁻².
    pub specular: Vec3,
}

/// Luminance of a slot seen from `eye`, over all lights. Highlights are exact for delta lights; for area lights they
/// are the unoccluded ones times the visibility of the remembered points, weighted by the lobe
/// (docs/method/what-a-pixel-shows.md). At a vertex that was never visited lights are taken to be as visible as they are around it,
/// once anything is known of that.
#[must_use]
pub fn shown(context: &SceneContext<'_>, cache: &Cache, slot: SlotId, eye: Vec3) -> Shown {
    add_up(context, cache, slot, eye, |_, _, _| {})
}

/// What each light group that is on adds to [`shown`], in their order.
#[must_use]
pub fn parts(context: &SceneContext<'_>, cache: &Cache, slot: SlotId, eye: Vec3) -> Vec<LightPart> {
    let mut parts = Vec::new();
    add_up(context, cache, slot, eye, |light, visibility, Sum { irradiance, variance, specular, .. }| {
        let diffuse = Diffuse { value: irradiance / PI, variance: variance / (PI * PI) };
        parts.push(LightPart { light, visibility, diffuse, specular });
    });
    parts
}

/// Adds up the light groups that are on, and tells of each.
#[inline]
fn add_up(
    context: &SceneContext<'_>,
    cache: &Cache,
    slot: SlotId,
    eye: Vec3,
    mut tell: impl FnMut(usize, Visibility, Sum),
) -> Shown {
    let record = &cache.slots[slot];
    let vertex = &cache.vertices[record.vertex];
    let place = LitSlot::new(context, cache, slot, eye);
    let (mut sum, mut left) = (Sum::default(), Left::default());
    let turns = cache.turns.then_some(place.receiver.normal);
    let around = place.is_guess.then(|| cache.prior.cells_of(vertex));
    for (light, (emitter, layer)) in context.lights.groups().zip(&cache.layers).enumerate() {
        let factor = context.lights.group_factor(light);
        if factor == Vec3::ZERO {
            continue;
        }
        let known = layer.visibility.get(record.vertex);
        left.add(emitter, known);
        let guess = |around| Visibility::taken_over(Origin::Deferred, cache.prior.at(around, light as u32));
        let visibility = around.map_or(known, guess);
        let spread = spread(emitter, visibility, |points| cache.penumbrae.gain(light as u32, points));
        let mut of_light = Sum::default();
        if visibility.fraction() > 0.0 || (spread > 0.0 && visibility.is_known()) {
            let samples = Samples { light, visibility, sum: layer.sums.get(slot) };
            let part = place.part(emitter, samples).times(factor);
            of_light.add(part, spread, None);
            sum.add(part, spread, turns);
        }
        tell(light, visibility, of_light);
    }
    let diffuse = Diffuse { value: sum.irradiance / PI, variance: sum.variance / (PI * PI) };
    let light_vector = sum.vector.extend(sum.fluence) / PI;
    Shown { diffuse, specular: sum.specular, light_vector, left, guessed: around.is_some() }
}

/// D of one light group at a slot, W·sr⁻¹·m⁻²: what it adds to that of [`shown`].
#[must_use]
pub fn direct_of(context: &SceneContext<'_>, cache: &Cache, slot: SlotId, group: usize) -> Vec3 {
    let (vertex, layer) = (cache.slots[slot].vertex, &cache.layers[group]);
    let at = &cache.vertices[vertex];
    let visibility = if at.progress.visited || !cache.prior.knows_any() {
        layer.visibility.get(vertex)
    } else {
        Visibility::taken_over(Origin::Deferred, cache.prior.at(cache.prior.cells_of(at), group as u32))
    };
    if visibility.fraction() == 0.0 {
        return Vec3::ZERO;
    }
    let samples = Samples { light: group, visibility, sum: layer.sums.get(slot) };
    let part = LitSlot::new(context, cache, slot, at.position).part(context.lights.group(group), samples);
    part.irradiance * context.lights.group_factor(group) / PI
}

impl Cache {
    /// Keeps what direct light was found to show at a slot, in any view.
    pub fn note_direct(&mut self, slot: SlotId, shown: &Shown) {
        let record = &mut self.slots[slot];
        let Vertex { progress, outdated, .. } = &mut self.vertices[record.vertex];
        record.set_direct(Luminance {
            diffuse: shown.diffuse.value,
            variance: shown.diffuse.variance,
            known: progress.visited,
            stale: shown.guessed || *outdated,
            ..Luminance::default()
        });
        progress.left = shown.left;
    }
}

/// Light of one source at a slot.
#[derive(Clone, Copy, Debug, Default)]
struct Part {
    irradiance: Vec3,
    /// Irradiance without occlusion, W·m⁻².
    unoccluded: Vec3,
    specular: Vec3,
    /// Unit mean direction that it comes from, 0 if that is not known, and how wide it is, |V|/Φ.
    direction: Vec3,
    concentration: f32,
}

impl Part {
    fn times(self, factor: Vec3) -> Self {
        Self {
            irradiance: self.irradiance * factor,
            unoccluded: self.unoccluded * factor,
            specular: self.specular * factor,
            ..self
        }
    }
}

/// Light of all sources.
#[derive(Clone, Copy, Debug, Default)]
struct Sum {
    irradiance: Vec3,
    variance: f32,
    specular: Vec3,
    /// Light vector and fluence by luminance, W·m⁻².
    vector: Vec3,
    fluence: f32,
}

/// That of an even hemisphere.
const LEAST_CONCENTRATION: f32 = 0.5;
/// Least cosine to the normal at which light is taken to arrive, for light vectors: what grazes would make them long.
const LEAST_COSINE: f32 = 0.1;

impl Sum {
    /// Adds a part; its light vector where the unit normal is given.
    fn add(&mut self, part: Part, spread: f32, normal: Option<Vec3>) {
        self.irradiance += part.irradiance;
        self.variance += luminance(part.unoccluded).powi(2) * spread;
        self.specular += part.specular;
        if let Some(normal) = normal {
            let along = luminance(part.irradiance) / normal.dot(part.direction).max(LEAST_COSINE);
            self.vector += part.direction * along;
            self.fluence += along / part.concentration.max(LEAST_CONCENTRATION);
        }
    }
}

/// Variance of a light at a slot over the square of what is unoccluded.
fn spread(emitter: LightGroup<'_>, visibility: Visibility, gain: impl Fn(u32) -> f32) -> f32 {
    let mut spread = match (visibility.origin, emitter) {
        (Origin::Sampled, LightGroup::Shared(_)) => group_variance(emitter, visibility, gain),
        _ => fraction_variance(visibility, gain),
    };
    if visibility.points > 0 && !emitter.has_closed_form() {
        spread += SAMPLED / visibility.points as f32;
    }
    spread
}

/// Variance of the visible fraction of a group. Where each member has had its turns, only what differs from turn to
/// turn is noise.
fn group_variance(group: LightGroup<'_>, visibility: Visibility, gain: impl Fn(u32) -> f32) -> f32 {
    let (count, points) = (group.count(), visibility.points);
    if group.all_points().is_some_and(|all| points >= all) {
        return 0.0;
    }
    match visibility.change_after(count).filter(|_| points >= SURE_POINTS) {
        Some(change) => change * 0.5 * STRATIFIED / points as f32,
        None => fraction_variance(visibility, gain),
    }
}

/// Variance of a visible fraction, by the `gain` of stratified points.
fn fraction_variance(visibility: Visibility, gain: impl Fn(u32) -> f32) -> f32 {
    let fraction = visibility.fraction();
    match visibility.origin {
        Origin::Sampled if visibility.points >= SURE_POINTS => {
            // Half a point of doubt each way: that all points agree does not say that all others would.
            let n = visibility.points as f32;
            let likely = (fraction * n + 0.5) / (n + 1.0);
            likely * (1.0 - likely) * gain(visibility.points) / n
        }
        Origin::Sampled | Origin::Inferred => 0.0,
        Origin::Deferred | Origin::Unknown => {
            let odds = fraction.clamp(LEAST_ODDS, 1.0 - LEAST_ODDS);
            odds * (1.0 - odds)
        }
    }
}

/// What a slot knows of a light group.
#[derive(Clone, Copy, Debug, Default)]
struct Samples {
    light: usize,
    visibility: Visibility,
    sum: AreaSum,
}

impl Samples {
    /// Whether any point counts at the slot.
    fn weigh(self) -> bool {
        self.visibility.points > 0 && self.sum.unoccluded > 0.0
    }

    /// Visible irradiance where it would be `unoccluded` without occlusion, if any point tells.
    fn of_closed_form(self, unoccluded: Vec3) -> Option<Vec3> {
        self.weigh().then(|| self.sum.visible * (luminance(unoccluded) / self.sum.unoccluded))
    }
}

/// A slot that is being lit.
struct LitSlot<'a> {
    context: &'a SceneContext<'a>,
    vertex: &'a Vertex,
    receiver: Receiver,
    /// Its highlight.
    gloss: Option<Gloss>,
    /// Whether it was never visited, so that what it sees of lights is a guess by what was found around it.
    is_guess: bool,
}

impl<'a> LitSlot<'a> {
    /// A slot seen from `eye`.
    fn new(context: &'a SceneContext<'a>, cache: &'a Cache, slot: SlotId, eye: Vec3) -> Self {
        let record = &cache.slots[slot];
        let vertex = &cache.vertices[record.vertex];
        let (normal, gloss) = (record.normal(), cache.gloss(slot));
        let to_eye = (eye - vertex.position).normalize_or(normal);
        let lobe = gloss.unwrap_or(MATT).seen(normal, to_eye);
        let receiver = Receiver { x: vertex.position, normal, to_eye, lobe };
        let is_guess = !vertex.progress.visited && cache.prior.knows_any();
        Self { context, vertex, receiver, gloss, is_guess }
    }

    /// Light of a light group.
    fn part(&self, emitter: LightGroup<'_>, samples: Samples) -> Part {
        match emitter {
            LightGroup::Single(source) => self.single(source, samples),
            LightGroup::Shared(_) => self.group(emitter, samples),
        }
    }

    /// Light of one source.
    fn single(&self, source: &Source, samples: Samples) -> Part {
        let Receiver { x, normal, .. } = self.receiver;
        let fraction = samples.visibility.fraction();
        if samples.visibility.is_unlikely() && !source.is_delta() {
            // Taken to be hidden for the most part: what little of it counts need not be exact.
            let unoccluded = source.rough_irradiance(x, normal);
            return Part { irradiance: unoccluded * fraction, unoccluded, direction: normal, ..Part::default() };
        }
        if let Some(part) = self.guess(source) {
            return Part { irradiance: part.unoccluded * fraction, specular: part.specular * fraction, ..part };
        }
        let appearance = source.appearance(x, normal);
        if let Appearance::Direction(arrival) = appearance {
            return arrival.map_or(Part::default(), |arrival| self.of_direction(&arrival, fraction));
        }
        let (irradiance, unoccluded) = self.irradiance(&appearance, samples);
        let (direction, concentration) = appearance.spread(x, normal);
        let mut part = Part { irradiance, unoccluded, specular: Vec3::ZERO, direction, concentration };
        if let Some(gloss) = self.gloss {
            let share = gloss.diffuse_in_spread(normal.dot(direction), concentration);
            part = Part { irradiance: irradiance * share, unoccluded: unoccluded * share, ..part };
        }
        if self.gloss.is_some() && fraction > 0.0 {
            let full = self.highlight(&appearance, luminance(unoccluded) * COLOURLESS);
            if full != Vec3::ZERO {
                let is_around = matches!(source, Source::Environment(_));
                part.specular =
                    full * if is_around { self.share_around(samples) } else { self.lobe_visibility(samples) };
            }
        }
        part
    }

    /// Light of a source as if nothing occluded it where it need not be exact, since how much of it is visible is a guess.
    fn guess(&self, source: &Source) -> Option<Part> {
        let Receiver { x, normal, .. } = self.receiver;
        let Source::Area(area) = source else { return None };
        let (unoccluded, direction) = if self.is_guess { area.from_afar(x, normal) } else { None }?;
        Some(self.reflected(unoccluded, direction, 1.0))
    }

    /// Light of a single direction, of which a fraction is visible.
    fn of_direction(&self, arrival: &Arrival, fraction: f32) -> Part {
        self.reflected(arrival.irradiance(self.receiver.normal), arrival.direction, fraction)
    }

    /// Light of an irradiance without occlusion from a unit direction, of which a fraction is visible.
    fn reflected(&self, unoccluded: Vec3, direction: Vec3, fraction: f32) -> Part {
        let Some(gloss) = self.gloss else {
            let irradiance = unoccluded * fraction;
            return Part { irradiance, unoccluded, specular: Vec3::ZERO, direction, concentration: 1.0 };
        };
        let share = gloss.diffuse_in(self.receiver.normal.dot(direction));
        let specular = unoccluded * fraction * self.receiver.lobe.value(direction);
        let irradiance = unoccluded * (fraction * share);
        Part { irradiance, unoccluded: unoccluded * share, specular, direction, concentration: 1.0 }
    }

    /// Light of a group: what its sources send without occlusion, each exactly, times the fraction that they share.
    fn group(&self, group: LightGroup<'_>, samples: Samples) -> Part {
        let (mut all, mut weights) = (Part::default(), 0.0);
        for (source, factor) in group.sources().filter(|(_, factor)| *factor != Vec3::ZERO) {
            let part = self.unoccluded(source);
            all.irradiance += part.unoccluded * factor;
            all.specular += part.specular * factor;
            let weight = luminance(part.unoccluded * factor);
            (all.direction, weights) = (all.direction + part.direction * weight, weights + weight);
        }
        let full = all.irradiance;
        let fraction = samples.visibility.fraction();
        // A few points have the colours of a few members.
        let sampled = samples.of_closed_form(full).filter(|_| fraction < 1.0);
        let irradiance = sampled.unwrap_or(full * fraction);
        let shines = fraction > 0.0 && all.specular != Vec3::ZERO;
        let specular = if shines { all.specular * self.lobe_visibility(samples) } else { Vec3::ZERO };
        let concentration = all.direction.length() / weights.max(f32::MIN_POSITIVE);
        Part { irradiance, unoccluded: full, specular, direction: all.direction.normalize_or_zero(), concentration }
    }

    /// Light of one source of a closed form as if nothing occluded it.
    fn unoccluded(&self, source: &Source) -> Part {
        if let Some(part) = self.guess(source) {
            return part;
        }
        let appearance = source.appearance(self.receiver.x, self.receiver.normal);
        let unoccluded = appearance.irradiance(self.context.scene, &self.receiver);
        let floor = luminance(unoccluded) * COLOURLESS;
        let Receiver { x, normal, .. } = self.receiver;
        let (direction, concentration) = appearance.spread(x, normal);
        let Some(gloss) = self.gloss else {
            return Part { irradiance: unoccluded, unoccluded, specular: Vec3::ZERO, direction, concentration };
        };
        let shown = unoccluded * gloss.diffuse_in_spread(normal.dot(direction), concentration);
        let specular = self.highlight(&appearance, floor);
        Part { irradiance: shown, unoccluded: shown, specular, direction, concentration }
    }

    /// Irradiance from an area light, and what it would be without occlusion: the closed form times the visible
    /// fraction, or the mean of the samples where there is no closed form.
    fn irradiance(&self, appearance: &Appearance<'_>, samples: Samples) -> (Vec3, Vec3) {
        let Samples { visibility, sum, .. } = samples;
        let fraction = visibility.fraction();
        if !appearance.is_exact() && samples.weigh() {
            let mean = sum.visible / visibility.points as f32;
            return (mean, mean / fraction.max(0.05));
        }
        let unoccluded = appearance.irradiance(self.context.scene, &self.receiver);
        // Where all of it is visible, a few points would have the colours of a few texels.
        let sampled = samples.of_closed_form(unoccluded).filter(|_| fraction < 1.0);
        (sampled.unwrap_or(unoccluded * fraction), unoccluded)
    }

    /// Highlight without occlusion.
    fn highlight(&self, appearance: &Appearance<'_>, floor: f32) -> Vec3 {
        appearance.specular(self.context.scene, &self.receiver, floor)
    }

    /// Visible share of a highlight of light from all around.
    fn share_around(&self, Samples { light, visibility, .. }: Samples) -> f32 {
        let fraction = visibility.fraction();
        if visibility.points == 0 || fraction == 1.0 {
            return fraction;
        }
        let lobe = self.receiver.lobe;
        let points = self.context.points(&self.vertex.shading_point(), light);
        let traced = visibility.remembered();
        let traced = traced.filter_map(|(index, visible)| Some((points.sample(self.context.scene, index)?, visible)));
        lobe_share(&self.receiver, |direction| luminance(lobe.value(direction)), traced).unwrap_or(fraction)
    }

    /// Visible share of a highlight: the remembered points weighted by what each adds to it, the plain fraction where
    /// none does.
    fn lobe_visibility(&self, Samples { light, visibility, .. }: Samples) -> f32 {
        let fraction = visibility.fraction();
        if visibility.points == 0 || fraction == 1.0 {
            return fraction;
        }
        let Receiver { normal, lobe, .. } = self.receiver;
        let points = self.context.points(&self.vertex.shading_point(), light);
        let (mut seen, mut all) = (0.0, 0.0);
        for (index, visible) in visibility.remembered() {
            if let Some(a) = points.sample(self.context.scene, index) {
                let cosine = normal.dot(a.direction).max(0.0);
                let weight = luminance(a.facing) * cosine * luminance(lobe.value(a.direction));
                all += weight;
                seen += if visible { weight } else { 0.0 };
            }
        }
        // Where hardly any point falls into the lobe, its share says nothing.
        if all > 1e-12 { seen / all } else { fraction }
    }
}
