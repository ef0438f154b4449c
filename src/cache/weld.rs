//! Which facets share a base vertex: welding by position bits and normal group (docs/method/hierarchy-and-vertices.md).

use crate::scene::{Scene, TriangleId};
use glam::Vec3;

/// Facets whose normals lie within this angle of their group's mean share one vertex; cosine of 60°.
const GROUP_COSINE: f32 = 0.5;

/// The triangles around every position of the scene, in ascending order.
#[derive(Clone, Debug)]
pub struct Weld {
    /// `first[p]..first[p + 1]` indexes `around` for position p.
    first: Vec<u32>,
    around: Vec<TriangleId>,
    /// Number of the group that each of them belongs to there, as far as that was asked for; [`UNKNOWN`] else.
    groups: Vec<u8>,
}

const UNKNOWN: u8 = u8::MAX;

/// A normal group at a position, as seen from the front side.
#[derive(Clone, Debug, PartialEq)]
pub struct Group {
    /// Its number at this position, permanent: it depends on the geometry only.
    pub index: u32,
    /// Unit mean normal weighted by the facets' angles at the position.
    pub normal: Vec3,
    /// Area-weighted mean of the facets' centroids: where the inside of the surface lies.
    pub centroid: Vec3,
    /// Root of the mean facet area, the local size of the mesh.
    pub size: f32,
    /// Its facets, in ascending order.
    pub facets: Vec<TriangleId>,
}

impl Weld {
    /// Lists the triangles around every position.
    #[must_use]
    pub fn new(scene: &Scene) -> Self {
        let mut first = vec![0_u32; scene.positions.len() + 1];
        for &p in scene.triangles.iter().flatten() {
            first[p as usize + 1] += 1;
        }
        for i in 1..first.len() {
            first[i] += first[i - 1];
        }
        let mut next = first.clone();
        let mut around = vec![TriangleId(0); scene.triangles.len() * 3];
        for (i, triangle) in scene.triangles.iter().enumerate() {
            for &p in triangle {
                let place = &mut next[p as usize];
                around[*place as usize] = TriangleId(i as u32);
                *place += 1;
            }
        }
        let groups = vec![UNKNOWN; around.len()];
        Self { first, around, groups }
    }

    /// Triangles around a position.
    #[must_use]
    pub fn around(&self, position: u32) -> &[TriangleId] {
        let p = position as usize;
        &self.around[self.first[p] as usize..self.first[p + 1] as usize]
    }

    /// The number of the normal group that `triangle` belongs to at `position`, one of its corners, if it was found before.
    #[must_use]
    pub fn known_group(&self, position: u32, triangle: TriangleId) -> Option<u32> {
        let place = self.around(position).binary_search(&triangle).ok()?;
        let group = self.groups[self.first[position as usize] as usize + place];
        (group != UNKNOWN).then_some(u32::from(group))
    }

    /// The normal group that `triangle` belongs to at `position`, one of its corners.
    ///
    /// Facets are taken in ascending order; each joins the first group whose mean normal lies within 60° of its own.
    #[must_use]
    pub fn group(&mut self, scene: &Scene, position: u32, triangle: TriangleId) -> Group {
        let mut groups: Vec<Sums> = Vec::with_capacity(4);
        let mut wanted = 0;
        for place in self.first[position as usize] as usize..self.first[position as usize + 1] as usize {
            let facet = self.around[place];
            let vector = Facet::new(scene, position, facet);
            let near = |g: &Sums| g.normal.normalize_or_zero().dot(vector.normal) > GROUP_COSINE;
            let index = groups.iter().position(near).unwrap_or(groups.len());
            if index == groups.len() {
                groups.push(Sums::default());
            }
            groups[index].add(facet, &vector);
            self.groups[place] = u8::try_from(index).unwrap_or(UNKNOWN);
            if facet == triangle {
                wanted = index;
            }
        }
        groups.swap_remove(wanted).finish(wanted as u32, scene.positions[position as usize])
    }
}

/// What a facet adds to its group.
struct Facet {
    normal: Vec3,
    angle: f32,
    area: f32,
    centroid: Vec3,
}

impl Facet {
    fn new(scene: &Scene, position: u32, triangle: TriangleId) -> Self {
        let corners = scene.corners(triangle);
        let at = scene.triangles[triangle.0 as usize].iter().position(|&p| p == position).unwrap_or(0);
        let here = corners[at];
        let edges = [corners[(at + 1) % 3] - here, corners[(at + 2) % 3] - here];
        Self {
            normal: scene.geometric_normal(triangle),
            angle: edges[0].angle_between(edges[1]),
            area: scene.area_vector(triangle).length() * 0.5,
            centroid: (corners[0] + corners[1] + corners[2]) / 3.0,
        }
    }
}

/// Running sums of a group.
#[derive(Default)]
struct Sums {
    normal: Vec3,
    centroid: Vec3,
    area: f32,
    facets: Vec<TriangleId>,
}

impl Sums {
    fn add(&mut self, triangle: TriangleId, facet: &Facet) {
        // Angles, so that how a quad was cut does not matter; a facet too thin for one still counts a little.
        self.normal += facet.normal * facet.angle.max(1e-3);
        self.centroid += facet.centroid * facet.area;
        self.area += facet.area;
        self.facets.push(triangle);
    }

    fn finish(self, index: u32, position: Vec3) -> Group {
        let centroid = if self.area > 0.0 { self.centroid / self.area } else { position };
        let size = (self.area / self.facets.len().max(1) as f32).sqrt();
        Group { index, normal: self.normal.normalize_or(Vec3::Y), centroid, size, facets: self.facets }
    }
}
