//! Upper bounds of what lights send to a place, eight lights at a time: they are asked for wherever one light of many is drawn.

use super::facets::Facets;
use glam::{DVec3, Vec3};
use std::f32::consts::PI;

/// How far the light of a source, or of several, can reach: a sphere that holds it, and the directions it shines in.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct LightBounds {
    centre: Vec3,
    radius: f32,
    /// Upper bound of the luminance of irradiance × squared distance.
    strength: f32,
    /// Upper bound of the luminance of the irradiance.
    most: f32,
    /// How much of that shows in a direction from the source: `base` + `axis` · direction …
    base: f32,
    axis: Vec3,
    /// … as seen from its nearest point where it is plane, whose furthest one is this far over the plane through the centre, in
    /// lengths of the axis; …
    depth: f32,
    /// … else, where this is 1, as seen from its centre, and in each direction that one of its points may be seen in.
    bent: f32,
    /// 1 where it falls off as a spot light does, [`crate::scene::light::spot_falloff`].
    smooth: f32,
}

/// Distance between unit normals that is rounding.
const ROUNDING: f64 = 1e-6;
/// Most that a point sends, so that sums stay finite beside it.
const FINITE: f32 = 1e30;

impl LightBounds {
    /// Of several sources in a sphere, from outside of it.
    pub fn of_sphere(centre: Vec3, radius: f32, strength: f32) -> Self {
        Self { centre, radius, strength, most: FINITE, base: 1.0, ..Self::default() }
    }

    /// Of a point that sends a luminous intensity in all directions.
    pub fn of_point(position: Vec3, intensity: f32) -> Self {
        Self::of_sphere(position, 0.0, intensity)
    }

    /// Of a spot light.
    pub fn of_spot(position: Vec3, direction: Vec3, intensity: f32, [cos_inner, cos_outer]: [f32; 2]) -> Self {
        let slope = (cos_inner - cos_outer).max(1e-6).recip();
        Self { base: -cos_outer * slope, axis: direction * slope, smooth: 1.0, ..Self::of_point(position, intensity) }
    }

    /// Of facets of a radiance whose luminance is at most `peak`, in a sphere.
    pub fn of_facets(facets: &Facets, (centre, radius): (Vec3, f32), peak: f32, both_sides: bool) -> Self {
        let sphere = Self { most: peak * PI, ..Self::of_sphere(centre, radius, peak * facets.area as f32) };
        let sum: DVec3 = facets.list.iter().map(|f| f.normal * f.area).sum();
        let axis = sum.normalize_or_zero();
        if both_sides {
            sphere
        } else if facets.list.iter().all(|f| f.normal.distance(axis) < ROUNDING) {
            let heights = facets.list.iter().map(|f| axis.dot(centre.as_dvec3() - f.corner));
            Self { base: 0.0, axis: axis.as_vec3(), depth: heights.fold(0.0, f64::max) as f32, ..sphere }
        } else {
            // Fronts that face a direction d: Σ max(0, A·d) = ½ (Σ |A·d| + d·Σ A).
            Self { base: 0.5, axis: (sum * (0.5 / facets.area)).as_vec3(), bent: 1.0, ..sphere }
        }
    }

    /// Upper bound of the luminance of irradiance × squared distance.
    pub const fn strength(&self) -> f32 {
        self.strength
    }

    /// Upper bound of the luminance of the unoccluded irradiance at `x` on a surface of unit `normal`; 0 only where no light can
    /// arrive.
    #[inline(always)]
    pub fn bound(&self, x: Vec3, normal: Vec3) -> f32 {
        let offset = self.centre - x;
        let distance = offset.length();
        let highest = offset.dot(normal) + self.radius;
        // E ≤ L π, and E ≤ L A cosθ / d² with the nearest distance, the smallest angle, and the area shown: directions to
        // parts of the source differ from that to its centre by less than radius / nearest.
        let per_nearest = larger(distance - self.radius, f32::MIN_POSITIVE).recip();
        let per_distance = larger(distance, f32::MIN_POSITIVE).recip();
        let per_axis = if self.bent > 0.0 { per_distance } else { per_nearest };
        let along = (self.depth - self.axis.dot(offset)) * per_axis;
        let shown = smaller(larger(self.base + along + self.bent * self.radius * per_nearest, 0.0), 1.0);
        let shown = if self.smooth > 0.0 { shown * shown * (3.0 - 2.0 * shown) } else { shown };
        let cosine = smaller(highest * per_nearest, 1.0);
        let bound = smaller(self.strength * shown * cosine * per_nearest * per_nearest, self.most);
        if highest > 0.0 && shown > 0.0 { bound } else { 0.0 }
    }
}

/// The smaller of two, the second where the first is not a number: a single instruction, as `f32::min` is not.
#[inline(always)]
fn smaller(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

/// The larger of two, likewise.
#[inline(always)]
fn larger(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

/// Lights bounded side by side.
pub(super) const LANES: usize = 8;

/// Some lights, coordinate by coordinate; spare lanes send nothing.
#[derive(Clone, Debug, Default)]
pub(super) struct Bounds8 {
    centre: [[f32; LANES]; 3],
    radius: [f32; LANES],
    strength: [f32; LANES],
    most: [f32; LANES],
    base: [f32; LANES],
    axis: [[f32; LANES]; 3],
    depth: [f32; LANES],
    bent: [f32; LANES],
    smooth: [f32; LANES],
    factor: [f32; LANES],
}

impl Bounds8 {
    /// With what the light of each counts times.
    pub fn new(lights: &[(LightBounds, f32)]) -> Self {
        let mut pack = Self::default();
        for (lane, (light, factor)) in lights.iter().enumerate() {
            for axis in 0..3 {
                pack.centre[axis][lane] = light.centre[axis];
                pack.axis[axis][lane] = light.axis[axis];
            }
            pack.radius[lane] = light.radius;
            pack.strength[lane] = light.strength;
            pack.most[lane] = light.most;
            pack.base[lane] = light.base;
            pack.depth[lane] = light.depth;
            pack.bent[lane] = light.bent;
            pack.smooth[lane] = light.smooth;
            pack.factor[lane] = *factor;
        }
        pack
    }

    /// [`LightBounds::bound`] of each light times its factor.
    pub fn bounds(&self, x: Vec3, normal: Vec3) -> [f32; LANES] {
        let vector = |of: &[[f32; LANES]; 3], lane: usize| Vec3::new(of[0][lane], of[1][lane], of[2][lane]);
        let mut bounds = [0.0; LANES];
        // A plain loop, which compilers turn into vector instructions.
        for (lane, bound) in bounds.iter_mut().enumerate() {
            let light = LightBounds {
                centre: vector(&self.centre, lane),
                radius: self.radius[lane],
                strength: self.strength[lane],
                most: self.most[lane],
                base: self.base[lane],
                axis: vector(&self.axis, lane),
                depth: self.depth[lane],
                bent: self.bent[lane],
                smooth: self.smooth[lane],
            };
            *bound = light.bound(x, normal) * self.factor[lane];
        }
        bounds
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::light::facets::Facet;
    use crate::light::lights::Source;
    use crate::math::luminance;
    use crate::math::sequence::Sequence;
    use crate::scene::TriangleId;
    use crate::scene::light::LightKind;

    /// Places within 4 of the origin, and normals.
    fn places() -> impl Iterator<Item = (Vec3, Vec3)> {
        let point = |i| Vec3::from_slice(&Sequence::new(3).point(i)[..3]) * 2.0 - Vec3::ONE;
        (0..500).map(move |i| (point(2 * i) * 4.0, point(2 * i + 1).normalize()))
    }

    /// A right-angled triangle of sides 0.2 that shines downwards.
    fn lamp() -> Facets {
        let (corner, edges) = (DVec3::new(0.1, 0.2, 0.3), [DVec3::X * 0.2, DVec3::Z * 0.2]);
        let middle = corner + (edges[0] + edges[1]) / 3.0;
        let (normal, squared_radius) = (DVec3::NEG_Y, 0.0223);
        Facets::new(vec![Facet { id: TriangleId(0), corner, edges, normal, area: 0.02, middle, squared_radius }])
    }

    #[test]
    fn a_spot_light_sends_its_bound() {
        let (position, direction, intensity) = (Vec3::new(0.3, 1.0, -0.2), Vec3::NEG_Y, Vec3::new(1.0, 2.0, 3.0));
        let (cos_inner, cos_outer) = (0.9, 0.5);
        let bounds = LightBounds::of_spot(position, direction, luminance(intensity), [cos_inner, cos_outer]);
        let source = Source::Delta(LightKind::Spot { position, direction, intensity, cos_inner, cos_outer });
        let mut lit = 0;
        for (x, normal) in places() {
            let (bound, exact) = (bounds.bound(x, normal), source.strength(x, normal));
            assert!((bound - exact).abs() <= 1e-5 * exact + 1e-7, "{x} {normal}: {bound} {exact}");
            lit += u32::from(exact > 0.0);
        }
        assert!(lit > 20, "{lit}");
    }

    #[test]
    fn a_plane_lamp_has_a_tight_bound_in_front_and_none_behind() {
        let (centre, radius) = (Vec3::new(0.2, 0.2, 0.4), 0.02_f32.sqrt());
        let bounds = LightBounds::of_facets(&lamp(), (centre, radius), 5.0, false);
        let mut lit = 0;
        for (x, normal) in places() {
            let bound = bounds.bound(x, normal);
            let offset = lamp().list[0].middle.as_vec3() - x;
            let distance = offset.length();
            if offset.y <= 0.0 || offset.dot(normal) < -radius {
                assert_eq!(bound, 0.0, "{x} {normal}");
            } else if offset.dot(normal) > 2.0 * radius && distance > 10.0 * radius {
                let exact = 5.0 * 0.02 * offset.dot(normal) * offset.y / distance.powi(4);
                assert!((0.99..3.0).contains(&(bound / exact)), "{x} {normal}: {bound} {exact}");
                lit += 1;
            }
        }
        assert!(lit > 50, "{lit}");
    }

    #[test]
    fn packs_tell_the_bounds_of_each() {
        let sphere = (Vec3::new(0.2, 0.2, 0.4), 0.15);
        let lights = [
            (LightBounds::of_facets(&lamp(), sphere, 5.0, false), 1.0),
            (LightBounds::of_facets(&lamp(), sphere, 5.0, true), 0.5),
            (LightBounds::of_spot(Vec3::Y, Vec3::NEG_Y, 2.0, [0.9, 0.5]), 2.0),
            (LightBounds::of_point(Vec3::X, 3.0), 1.0),
            (LightBounds::of_sphere(Vec3::Z, 0.5, 1.0), 1.0),
        ];
        let pack = Bounds8::new(&lights);
        for (x, normal) in places() {
            let single =
                |lane: usize| lights.get(lane).map_or(0.0, |(bounds, factor)| bounds.bound(x, normal) * factor);
            for (lane, bound) in pack.bounds(x, normal).into_iter().enumerate() {
                assert!((bound - single(lane)).abs() <= 1e-6 * bound, "{lane} {bound} {}", single(lane));
            }
        }
    }
}
