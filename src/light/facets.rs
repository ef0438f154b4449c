//! The geometry of an emissive component in double precision: its triangles, and its plane regions merged to convex
//! polygons where they are that, so that closed forms pay for outlines only.

use crate::math::polygon::edges;
use crate::scene::{Scene, TriangleId};
use glam::DVec3;
use rustc_hash::FxHashMap;
use std::ops::Range;

/// A convex polygon, counter-clockwise seen from its front.
#[derive(Clone, Debug)]
pub struct Polygon {
    /// First corner, scene units.
    pub base: DVec3,
    /// Unit normal of the front.
    pub normal: DVec3,
    /// Its corners relative to `base`, in [`Outlines::corners`].
    pub corners: Range<usize>,
}

/// The polygons that tile a component.
#[derive(Clone, Debug, Default)]
pub struct Outlines {
    /// The polygons.
    pub polygons: Vec<Polygon>,
    /// Corners of all polygons, each relative to its own first.
    pub corners: Vec<DVec3>,
}

/// A triangle that light is sampled from.
#[derive(Clone, Copy, Debug)]
pub struct Facet {
    /// The scene's triangle, for its texture.
    pub id: TriangleId,
    /// First corner, scene units.
    pub corner: DVec3,
    /// From the first corner to the two others.
    pub edges: [DVec3; 2],
    /// Unit normal of the front.
    pub normal: DVec3,
    /// Area.
    pub area: f64,
    /// Centroid.
    pub middle: DVec3,
    /// Square of the largest distance of a corner from the centroid.
    pub squared_radius: f64,
}

impl Facet {
    /// `None` for a triangle without area.
    fn new(id: TriangleId, [a, b, c]: [DVec3; 3]) -> Option<Self> {
        let edges = [b - a, c - a];
        let cross = edges[0].cross(edges[1]);
        let normal = cross.try_normalize()?;
        let middle = a + (edges[0] + edges[1]) / 3.0;
        let squared_radius = [a, b, c].iter().map(|p| p.distance_squared(middle)).fold(0.0, f64::max);
        Some(Self { id, corner: a, edges, normal, area: 0.5 * cross.length(), middle, squared_radius })
    }

    /// The point at barycentrics `at`, as seen from `x`.
    #[must_use]
    pub fn from(&self, x: DVec3, at: [f64; 2]) -> DVec3 {
        self.corner - x + self.edges[0] * at[0] + self.edges[1] * at[1]
    }

    /// The facet of a scene's triangle; `None` for one without area.
    #[must_use]
    pub fn of_scene(scene: &Scene, id: TriangleId) -> Option<Self> {
        Self::new(id, scene.corners(id).map(|p| p.as_dvec3()))
    }
}

/// Facets with running sums of their areas.
#[derive(Clone, Debug)]
pub struct Facets {
    /// The facets.
    pub list: Vec<Facet>,
    /// Sum of the areas of each facet and all before it.
    until: Vec<f64>,
    /// Sum of all areas.
    pub area: f64,
}

impl Facets {
    /// Sums the areas.
    #[must_use]
    pub fn new(list: Vec<Facet>) -> Self {
        let mut area = 0.0;
        let mut until = Vec::with_capacity(list.len());
        for facet in &list {
            area += facet.area;
            until.push(area);
        }
        Self { list, until, area }
    }

    /// A point uniform on the facets of `range`: the facet, and the barycentrics of the ends of its edges.
    #[must_use]
    pub fn pick(&self, range: Range<usize>, [u, v]: [f64; 2]) -> Option<(&Facet, [f64; 2])> {
        let before = |k: usize| if k == 0 { 0.0 } else { self.until[k - 1] };
        let start = before(range.start);
        let target = start + u * (before(range.end) - start);
        let index = range.start + self.until[range.clone()].partition_point(|&sum| sum <= target);
        let index = index.min(range.end.checked_sub(1)?);
        let within = ((target - before(index)) / (self.until[index] - before(index))).clamp(0.0, 1.0);
        Some((self.list.get(index)?, uniform_barycentrics([within, v])))
    }
}

/// Barycentrics moved into the triangle where rounding put them outside.
#[must_use]
pub fn moved_inside([s, t]: [f64; 2]) -> [f64; 2] {
    let (s, t) = (s.max(0.0), t.max(0.0));
    let excess = (s + t).max(1.0);
    [s / excess, t / excess]
}

/// Uniform on a triangle, strata kept: √ maps the area, the second coordinate slides along.
#[must_use]
pub fn uniform_barycentrics([u, v]: [f64; 2]) -> [f64; 2] {
    let root = u.sqrt();
    [root * (1.0 - v), root * v]
}

/// Normals that agree to 1e-3 rad are one plane: single-precision corners of a small lamp far from the origin scatter that
/// much. Where all of a polygon's triangles face a point its light vector is their sum exactly, plane or not.
const SAME_PLANE: f64 = 1.0 - 0.5e-6;
/// Rounding of single-precision coordinates, relative to the largest: corners this close to a line lie on it.
const ROUNDING: f64 = 2.5e-7;

impl Outlines {
    /// Merges the facets of a component.
    #[must_use]
    pub fn new(scene: &Scene, facets: &[Facet]) -> Self {
        let mut outlines = Self::default();
        for region in plane_regions(scene, facets) {
            match convex_outline(scene, facets, &region) {
                Some(outline) => outlines.push(&outline, facets[region[0]].normal),
                None => region.iter().for_each(|&k| outlines.push_facet(&facets[k])),
            }
        }
        outlines
    }

    fn push(&mut self, outline: &[DVec3], normal: DVec3) {
        let (base, first) = (outline[0], self.corners.len());
        self.corners.extend(outline.iter().map(|&p| p - base));
        self.polygons.push(Polygon { base, normal, corners: first..self.corners.len() });
    }

    fn push_facet(&mut self, facet: &Facet) {
        let corners = [DVec3::ZERO, facet.edges[0], facet.edges[1]].map(|e| facet.corner + e);
        self.push(&corners, facet.normal);
    }

    /// The polygons as fans of triangles, all with the id of the first triangle of the component.
    pub fn fans(&self, triangles: &[TriangleId]) -> impl Iterator<Item = Facet> {
        let id = triangles.first().copied().unwrap_or(TriangleId(0));
        self.polygons.iter().flat_map(move |polygon| {
            let corners = &self.corners[polygon.corners.clone()];
            (1..corners.len() - 1).filter_map(move |i| Facet::new(id, [0, i, i + 1].map(|k| polygon.base + corners[k])))
        })
    }
}

/// Groups of facets that are connected by edges and lie in one plane, each in ascending order of discovery.
fn plane_regions(scene: &Scene, facets: &[Facet]) -> Vec<Vec<usize>> {
    let mut at_edge: FxHashMap<[u32; 2], Vec<usize>> = FxHashMap::default();
    for (k, facet) in facets.iter().enumerate() {
        for edge in directed_edges(scene, facet.id) {
            at_edge.entry(edge).or_default().push(k);
        }
    }
    let mut taken = vec![false; facets.len()];
    let mut regions = Vec::new();
    for seed in 0..facets.len() {
        if std::mem::replace(&mut taken[seed], true) {
            continue;
        }
        let mut region = vec![seed];
        let mut next = 0;
        while next < region.len() {
            for [i, j] in directed_edges(scene, facets[region[next]].id) {
                for &k in at_edge.get(&[j, i]).into_iter().flatten() {
                    if !taken[k] && facets[k].normal.dot(facets[seed].normal) > SAME_PLANE {
                        taken[k] = true;
                        region.push(k);
                    }
                }
            }
            next += 1;
        }
        regions.push(region);
    }
    regions
}

/// Edges of a triangle as indices of positions, counter-clockwise.
pub(super) fn directed_edges(scene: &Scene, id: TriangleId) -> [[u32; 2]; 3] {
    let [a, b, c] = scene.triangles[id.0 as usize];
    [[a, b], [b, c], [c, a]]
}

/// The outline of a region when it is one convex loop, without the corners on straight stretches.
fn convex_outline(scene: &Scene, facets: &[Facet], region: &[usize]) -> Option<Vec<DVec3>> {
    // Edges whose opposite is not in the region, by their first corner.
    let mut next: FxHashMap<u32, u32> = FxHashMap::default();
    let all: Vec<[u32; 2]> = region.iter().flat_map(|&k| directed_edges(scene, facets[k].id)).collect();
    let mut present: FxHashMap<[u32; 2], u32> = FxHashMap::default();
    all.iter().for_each(|&edge| *present.entry(edge).or_default() += 1);
    if present.values().any(|&count| count > 1) {
        return None;
    }
    for &[i, j] in all.iter().filter(|&&[i, j]| !present.contains_key(&[j, i])) {
        if next.insert(i, j).is_some() {
            return None;
        }
    }
    let start = *next.keys().min()?;
    let mut loop_corners = vec![start];
    let mut at = *next.get(&start)?;
    while at != start && loop_corners.len() <= next.len() {
        loop_corners.push(at);
        at = *next.get(&at)?;
    }
    if loop_corners.len() != next.len() {
        return None;
    }
    let points: Vec<DVec3> = loop_corners.iter().map(|&i| scene.positions[i as usize].as_dvec3()).collect();
    turning_corners(&points, facets[region[0]].normal)
}

/// The corners at which a convex loop turns; `None` where it turns the wrong way or more than once round.
fn turning_corners(points: &[DVec3], normal: DVec3) -> Option<Vec<DVec3>> {
    let n = points.len();
    let tolerance = ROUNDING * points.iter().fold(0.0, |m, p| p.abs().max_element().max(m));
    // The corner farthest from any other one is an extreme point of the loop, so it turns.
    let start = (0..n).max_by(|&i, &j| points[i].distance(points[0]).total_cmp(&points[j].distance(points[0])))?;
    let mut kept = vec![points[start]];
    for i in 1..n {
        let (last, here, next) = (kept[kept.len() - 1], points[(start + i) % n], points[(start + i + 1) % n]);
        let (before, after) = (here - last, next - here);
        // Height of the corner over the line that would leave it out.
        let height = before.cross(after).dot(normal) / (next - last).length();
        if height.is_nan() || height < -tolerance || (height < tolerance && before.dot(after) < 0.0) {
            return None;
        }
        if height >= tolerance {
            kept.push(here);
        }
    }
    let sides: Vec<DVec3> = edges(&kept).map(|(a, b)| b - a).collect();
    let turned: f64 = edges(&sides).map(|(a, b)| a.cross(b).dot(normal).atan2(a.dot(b))).sum();
    (kept.len() >= 3 && turned < std::f64::consts::TAU + 1.0).then_some(kept)
}
