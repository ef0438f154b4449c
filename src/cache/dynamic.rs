//! The cache as a whole, and the dynamic mesh: what is drawn, as slots (values at vertices) and leaves (triangles).

use super::coarse_levels::CoarseLevels;
use super::indirect::IndirectLayer;
use super::layer::Layer;
use super::pool::Pool;
use super::radiance_grid::RadianceGrid;
use super::topology::{Node, NodeId, Topology};
use super::vertex::{Vertex, VertexId, VertexName};
use super::visibility_prior::VisibilityPrior;
use super::weld::{Group, Weld};
use crate::estimate::penumbra::Penumbrae;
use crate::scene::{FaceId, Scene, TriangleId};
use glam::Vec3;
use rustc_hash::FxHashMap;
use smallvec::SmallVec;

/// Index of a vertex slot: position and luminance of one drawn vertex.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct SlotId(pub u32);

/// Index of a leaf triangle of the dynamic mesh, recycled when the leaf goes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct DrawnId(pub u32);

/// A leaf triangle: its three vertices in the order of the face's corners (front winding), and the face it lies on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DrawnTriangle {
    /// Vertices.
    pub slots: [SlotId; 3],
    /// The face.
    pub face: FaceId,
    /// Splits above its node.
    pub level: u8,
    /// The vertex whose value it shows all over instead of interpolating, if it shows in one pixel only and that has been
    /// sampled.
    pub flat: Option<SlotId>,
}

impl DrawnTriangle {
    /// Every slot that it is drawn with.
    pub fn all_slots(&self) -> impl Iterator<Item = SlotId> + use<> {
        self.slots.into_iter().chain(self.flat)
    }
}

/// Weight of a covered vertex in interpolation. Not 0, so that a triangle whose vertices are all covered still shows what
/// they know; beside a valid vertex it does not count.
/// The luminance pass relies on it (`LEAST_WEIGHT`): larger than what extrapolation by a raster step can make of 0.
pub const COVERED_WEIGHT: f32 = 4e-3;

/// One shading normal (and exponent) of a vertex, with the luminance shown there.
#[derive(Clone, Debug)]
pub struct SlotRecord {
    /// The vertex whose samples it shares.
    pub vertex: VertexId,
    /// The vertex's next slot.
    pub next: Option<SlotId>,
    /// Unit shading normal, on the vertex's side.
    pub normal: Vec3,
    /// Phong exponent where the surface is glossy.
    pub shininess: Option<f32>,
    /// Whether it is meant to mirror: until there are reflections its highlight shows direct light only.
    pub mirror: bool,
    /// Direct light.
    pub direct: Luminance,
    /// Indirect light.
    pub indirect: Luminance,
    /// First use by a leaf, `leaf * 4 + place`, linked through [`DrawnRecord::next_use`].
    first_use: Option<u32>,
    /// The slots that it lies between, if any.
    pub between: Option<Between>,
    /// Its place in the order in which slots are predicted: the spacing's number for base vertices, see
    /// [`super::coarse_levels`], and [`INSIDE`] for all others.
    pub rank: u8,
    /// Whether its prediction waits to be brought up to date.
    pub(super) waits: bool,
    /// First slot that lies between this one and others, `slot * 8 + place`, linked through `next_between`.
    first_between: Option<u32>,
    next_between: SmallVec<[Option<u32>; 3]>,
}

/// Rank of slots inside the faces: predicted after all base vertices, in the order in which they were made.
pub const INSIDE: u8 = u8::MAX;
/// Rank of base vertices that are not in the order yet.
const UNPLACED: u8 = u8::MAX - 1;

/// Slots that another lies between and that predict it: the ends of the edge that it is the middle of, the corners of the
/// leaf that it lies inside, or coarser base vertices around a base vertex.
#[derive(Clone, Debug)]
pub struct Between {
    /// The slots with their weights, of sum 1.
    pub of: SmallVec<[(SlotId, f32); 3]>,
    /// Whether they are base vertices around a base vertex.
    pub coarse: bool,
}

/// Luminance at a slot from the lights or from everything else.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Luminance {
    /// Diffuse luminance D, W·sr⁻¹·m⁻².
    pub diffuse: Vec3,
    /// Specular luminance S for the present camera, W·sr⁻¹·m⁻².
    pub specular: Vec3,
    /// Variance of the luminance of D.
    pub variance: f32,
    /// Whether there is a value at all.
    pub known: bool,
    /// Whether it is a guess, from before the lights changed or from coarser vertices: to be shown, but not to be computed with.
    pub stale: bool,
    /// Whether it is what coarser base vertices predict.
    pub coarse: bool,
}

impl SlotRecord {
    /// Whether it belongs to a base vertex.
    #[must_use]
    pub const fn is_base(&self) -> bool {
        self.rank < INSIDE
    }

    /// Whether it belongs to a base vertex that is not in the order above the geometry yet.
    #[must_use]
    pub const fn is_unplaced(&self) -> bool {
        self.rank == UNPLACED
    }

    /// Diffuse luminance of all light.
    #[must_use]
    pub fn diffuse(&self) -> Vec3 {
        self.direct.diffuse + self.indirect.diffuse
    }

    /// Specular luminance of all light.
    #[must_use]
    pub fn specular(&self) -> Vec3 {
        self.direct.specular + self.indirect.specular
    }
}

/// A leaf with the links of the leaves around its vertices.
#[derive(Clone, Copy, Debug)]
pub struct DrawnRecord {
    /// The triangle.
    pub triangle: DrawnTriangle,
    /// The node that it is part of.
    pub node: NodeId,
    /// The last batch that redrew it.
    pub batch: u32,
    next_use: [Option<u32>; 4],
}

/// Everything that the engine thread owns: vertices, hierarchy, static meshes, dynamic mesh.
#[derive(Default)]
pub struct Cache {
    /// Vertices.
    pub vertices: Pool<Vertex>,
    /// The hierarchy.
    pub topology: Topology,
    /// One static mesh a light or group of lights, in the order of the light groups.
    pub layers: Vec<Layer>,
    /// How likely places see each of them.
    pub(super) odds: VisibilityPrior,
    /// How sure points in the lights' penumbrae are.
    pub(super) penumbrae: Penumbrae,
    /// The static mesh of indirect light.
    pub indirect: IndirectLayer,
    /// What gather rays find at their hits.
    pub(super) radiance: RadianceGrid,
    /// The order of base vertices above the geometry.
    pub(super) coarse: CoarseLevels,
    /// Drawn vertices.
    pub slots: Pool<SlotRecord>,
    /// Drawn triangles.
    pub drawn: Pool<DrawnRecord>,
    names: FxHashMap<VertexName, VertexId>,
    roots: FxHashMap<FaceId, NodeId>,
    pub(super) scale: f32,
}

/// What a split created.
#[derive(Clone, Copy, Debug)]
pub struct Split {
    /// First of the four children.
    pub first: NodeId,
    /// Slots in the middle of the edges.
    pub middles: [SlotId; 3],
}

impl Cache {
    /// An empty cache for a scene with `lights` light groups.
    #[must_use]
    pub fn new(scene: &Scene, lights: usize) -> Self {
        let scale = scene.scale();
        let radiance = RadianceGrid::new(scene.bounds().map_or(Vec3::ZERO, |(low, _)| low), scene.diagonal());
        let odds = VisibilityPrior::new(lights, scale);
        let penumbrae = Penumbrae::new(lights);
        Self { layers: vec![Layer::default(); lights], odds, penumbrae, radiance, scale, ..Self::default() }
    }

    /// The root of `face`, created with its vertices on first demand.
    pub fn root(&mut self, scene: &Scene, weld: &Weld, face: FaceId) -> NodeId {
        if let Some(&root) = self.roots.get(&face) {
            return root;
        }
        let corners = [0, 1, 2].map(|corner| self.corner_slot(scene, weld, face, corner));
        let vertices = corners.map(|slot| self.slots[slot.0].vertex);
        let root = self.topology.add_root(face, corners, vertices);
        self.roots.insert(face, root);
        root
    }

    /// The root of `face`, if there is one.
    #[must_use]
    pub fn root_of(&self, face: FaceId) -> Option<NodeId> {
        self.roots.get(&face).copied()
    }

    /// The slot of a face's corner: shared with every facet of the vertex's group of the same normal and gloss.
    fn corner_slot(&mut self, scene: &Scene, weld: &Weld, face: FaceId, corner: usize) -> SlotId {
        let (triangle, back) = (face.triangle(), face.is_back());
        let position = scene.triangles[triangle.0 as usize][corner];
        let group = weld.group(scene, position, triangle);
        let name = VertexName { position, back, group: group.index };
        let vertex = match self.names.get(&name) {
            Some(&vertex) => vertex,
            None => self.add_base_vertex(scene, name, &group),
        };
        self.slot(vertex, slot_look(scene, position, triangle, back))
    }

    /// Creates a vertex with the slots of all facets of its group, visible or not: its rays serve them all.
    fn add_base_vertex(&mut self, scene: &Scene, name: VertexName, group: &Group) -> VertexId {
        let vertex = VertexId(self.vertices.insert(Vertex::base(scene, name, group, self.scale)));
        self.names.insert(name, vertex);
        for &facet in &group.facets {
            self.slot(vertex, slot_look(scene, name.position, facet, name.back));
        }
        vertex
    }

    /// The slot of a vertex with the given normal and exponent, added if there is none.
    pub(super) fn slot(&mut self, vertex: VertexId, look: Look) -> SlotId {
        let Look { normal, shininess, mirror } = look;
        // Coplanar facets may differ in the last bits of their normals; 1e-6 is 0.08°.
        let same = |&slot: &SlotId| {
            let record = &self.slots[slot.0];
            (record.shininess, record.mirror) == (shininess, mirror) && record.normal.dot(normal) > 1.0 - 1e-6
        };
        if let Some(slot) = self.slots_of(vertex).find(same) {
            return slot;
        }
        let slot = SlotId(self.slots.insert(SlotRecord {
            vertex,
            next: self.vertices[vertex.0].first_slot,
            normal,
            shininess,
            mirror,
            direct: Luminance::default(),
            indirect: Luminance::default(),
            first_use: None,
            between: None,
            first_between: None,
            next_between: SmallVec::new(),
            rank: UNPLACED,
            waits: false,
        }));
        self.vertices[vertex.0].first_slot = Some(slot);
        slot
    }

    /// Splits a leaf, whose neighbours must not be coarser than it.
    pub fn split(&mut self, id: NodeId) -> Split {
        let edges = self.topology.nodes[id.0].edges;
        for edge in edges {
            if self.topology.midpoint(edge).is_none() {
                let [a, b] = self.topology.ends(edge).map(|end| &self.vertices[end.0]);
                let vertex = VertexId(self.vertices.insert(Vertex::midpoint(a, b, self.scale)));
                self.topology.set_midpoint(edge, vertex);
            }
        }
        let middles = [0, 1, 2].map(|at| self.middle_slot(id, at).unwrap_or(self.topology.nodes[id.0].corners[at]));
        let slots = &self.slots;
        let first = self.topology.split(id, middles, |slot| slots[slot.0].vertex);
        Split { first, middles }
    }

    /// The slot of a node's own look at the midpoint of its edge `at`, if that edge has one.
    fn middle_slot(&mut self, id: NodeId, at: usize) -> Option<SlotId> {
        let node = &self.topology.nodes[id.0];
        let vertex = self.topology.midpoint(node.edges[at])?;
        let ends = [node.corners[at], node.corners[(at + 1) % 3]];
        let [a, b] = ends.map(|slot| &self.slots[slot.0]);
        let normal = (a.normal + b.normal).normalize_or(a.normal);
        let look = Look { normal, shininess: a.shininess, mirror: a.mirror };
        let slot = self.slot(vertex, look);
        if self.slots[slot.0].between.is_none() {
            self.note_between(slot, Between { of: ends.into_iter().map(|end| (end, 0.5)).collect(), coarse: false });
        }
        Some(slot)
    }

    /// Notes that a new slot lies between others.
    pub(super) fn note_between(&mut self, slot: SlotId, between: Between) {
        for (place, (other, _)) in (0..).zip(&between.of) {
            let previous = self.slots[other.0].first_between.replace(slot.0 * 8 + place);
            self.slots[slot.0].next_between.push(previous);
        }
        let record = &mut self.slots[slot.0];
        if !between.coarse {
            record.rank = INSIDE;
        }
        record.between = Some(between);
    }

    /// The first of the slots that lie between a slot and others, with the link to the next.
    pub(super) fn first_between(&self, slot: SlotId) -> Option<(SlotId, Option<u32>)> {
        self.linked_between(self.slots[slot.0].first_between?)
    }

    /// The slot that a link of [`Self::first_between`] leads to, with the link to the next.
    pub(super) fn linked_between(&self, link: u32) -> Option<(SlotId, Option<u32>)> {
        Some((SlotId(link / 8), self.slots[link / 8].next_between[link as usize % 8]))
    }

    /// How a node's surface looks inside it.
    pub(super) fn look_inside(&self, id: NodeId, weights: [f32; 3]) -> Look {
        let corners = self.topology.nodes[id.0].corners.map(|slot| &self.slots[slot.0]);
        let [a, ..] = corners;
        let sum: Vec3 = corners.iter().zip(weights).map(|(corner, weight)| corner.normal * weight).sum();
        Look { normal: sum.normalize_or(a.normal), shininess: a.shininess, mirror: a.mirror }
    }

    /// The triangles that draw a leaf through the midpoints on its edges, so that no crack or kink shows (method 3).
    pub fn triangulate(&mut self, id: NodeId) -> Vec<[SlotId; 3]> {
        let c = self.topology.nodes[id.0].corners;
        let m = [0, 1, 2].map(|at| self.middle_slot(id, at));
        let at = |i: usize| c[i % 3];
        match (m, m.iter().flatten().count()) {
            ([Some(m0), Some(m1), Some(m2)], _) => {
                vec![[c[0], m0, m2], [m0, c[1], m1], [m2, m1, c[2]], [m0, m1, m2]]
            }
            (_, 2) => {
                // The two split edges meet at corner i + 1; the quadrilateral left over is cut from corner i.
                let i = (0..3).find(|&i| m[i].is_some() && m[(i + 1) % 3].is_some()).unwrap_or(0);
                let (Some(first), Some(second)) = (m[i], m[(i + 1) % 3]) else { return vec![c] };
                vec![[first, at(i + 1), second], [at(i), first, second], [at(i), second, at(i + 2)]]
            }
            (_, 1) => {
                let i = (0..3).find(|&i| m[i].is_some()).unwrap_or(0);
                let Some(middle) = m[i] else { return vec![c] };
                vec![[at(i), middle, at(i + 2)], [middle, at(i + 1), at(i + 2)]]
            }
            _ => vec![c],
        }
    }

    /// Adds a drawn triangle of a node, which shows the value of `flat` all over if that is given.
    pub fn add_drawn(&mut self, slots: [SlotId; 3], flat: Option<SlotId>, node: NodeId) -> DrawnId {
        let Node { face, level, .. } = self.topology.nodes[node.0];
        let leaf = DrawnTriangle { slots, face, level, flat };
        let id = DrawnId(self.drawn.insert(DrawnRecord { triangle: leaf, node, batch: 0, next_use: [None; 4] }));
        for (place, slot) in (0..).zip(leaf.all_slots()) {
            let previous = self.slots[slot.0].first_use.replace(id.0 * 4 + place);
            self.drawn[id.0].next_use[place as usize] = previous;
        }
        id
    }

    /// Takes a drawn triangle out of use. Its index must not be recycled before the GPU has drawn what replaces it:
    /// the caller gives it back with [`Pool::remove`] then.
    pub fn retire_drawn_triangle(&mut self, id: DrawnId) {
        let leaf = self.drawn[id.0].triangle;
        for (place, slot) in (0..).zip(leaf.all_slots()) {
            let (wanted, next) = (id.0 * 4 + place, self.drawn[id.0].next_use[place as usize]);
            if self.slots[slot.0].first_use == Some(wanted) {
                self.slots[slot.0].first_use = next;
                continue;
            }
            let mut usage = self.slots[slot.0].first_use;
            while let Some(u) = usage {
                let link = &mut self.drawn[u / 4].next_use[u as usize % 4];
                if *link == Some(wanted) {
                    *link = next;
                    break;
                }
                usage = *link;
            }
        }
    }

    /// The slots of a vertex.
    pub fn slots_of(&self, vertex: VertexId) -> impl Iterator<Item = SlotId> + '_ {
        std::iter::successors(self.vertices[vertex.0].first_slot, |slot| self.slots[slot.0].next)
    }

    /// The drawn triangles that use a slot.
    pub fn drawn_with(&self, slot: SlotId) -> impl Iterator<Item = DrawnId> + '_ {
        let next = |&usage: &u32| self.drawn[usage / 4].next_use[usage as usize % 4];
        std::iter::successors(self.slots[slot.0].first_use, next).map(|usage| DrawnId(usage / 4))
    }

    /// The vertices at a node's corners.
    #[must_use]
    pub fn corner_vertices(&self, node: NodeId) -> [VertexId; 3] {
        self.topology.nodes[node.0].corners.map(|slot| self.slots[slot.0].vertex)
    }

    /// The vertices that a leaf is drawn with: its corners, and the midpoints on its edges.
    #[must_use]
    pub fn drawn_vertices(&self, node: NodeId) -> SmallVec<[VertexId; 6]> {
        let edges = self.topology.nodes[node.0].edges;
        let middles = edges.iter().filter_map(|&edge| self.topology.midpoint(edge));
        self.corner_vertices(node).into_iter().chain(middles).collect()
    }

    /// Positions of a node's corners.
    #[must_use]
    pub fn corner_positions(&self, node: NodeId) -> [Vec3; 3] {
        self.corner_vertices(node).map(|v| self.vertices[v.0].position)
    }

    /// Bytes held by the cache's structures.
    #[must_use]
    pub fn bytes(&self) -> usize {
        let layers: usize = self.layers.iter().map(|l| l.visibility.bytes() + l.sums.bytes()).sum();
        let maps = self.names.capacity() * size_of::<(VertexName, VertexId)>()
            + self.roots.capacity() * size_of::<(FaceId, NodeId)>();
        layers
            + self.odds.bytes()
            + self.penumbrae.bytes()
            + self.indirect.bytes()
            + self.radiance.bytes()
            + maps
            + self.topology.bytes()
            + self.vertices.bytes()
            + self.slots.bytes()
            + self.drawn.bytes()
    }

    /// Checks hierarchy, slots and drawn triangles against each other.
    ///
    /// # Panics
    /// If a rule is broken (debug builds and tests call it).
    pub fn validate(&self) {
        self.topology.validate(|slot| self.slots[slot.0].vertex);
        for i in 0..self.slots.end() {
            let slot = &self.slots[i];
            assert!(self.slots_of(slot.vertex).any(|s| s.0 == i), "slot {i} is listed at its vertex");
            assert!((slot.normal.length() - 1.0).abs() < 1e-3, "slot {i}: unit normal");
            for (other, _) in slot.between.iter().flat_map(|between| &between.of) {
                let before = |s: &SlotRecord, id: u32| (s.rank, id);
                let order = before(&self.slots[other.0], other.0) < before(slot, i);
                assert!(order, "slot {i}: predicted after those it lies between");
                let next = |&(_, link): &(SlotId, Option<u32>)| self.linked_between(link?);
                let mut between = std::iter::successors(self.first_between(*other), next);
                assert!(between.any(|(s, _)| s.0 == i), "slot {i}: listed at those it lies between");
            }
            for leaf in self.drawn_with(SlotId(i)) {
                let record = &self.drawn[leaf.0];
                assert!(record.triangle.all_slots().any(|slot| slot.0 == i), "slot {i}: leaf {leaf:?} uses it");
                let drawn = &self.topology.nodes[record.node.0].drawn;
                assert!(drawn.contains(&leaf), "leaf {leaf:?} is drawn by its node");
            }
        }
    }
}

/// What facets must have in common to share a slot.
#[derive(Clone, Copy, Debug)]
pub(super) struct Look {
    pub(super) normal: Vec3,
    pub(super) shininess: Option<f32>,
    pub(super) mirror: bool,
}

/// Shading normal and gloss of a triangle's corner at `position`, on the given side.
fn slot_look(scene: &Scene, position: u32, triangle: TriangleId, back: bool) -> Look {
    let t = triangle.0 as usize;
    let corner = scene.triangles[t].iter().position(|&p| p == position).unwrap_or(0);
    let front = scene.normals[t][corner];
    let material = scene.material(triangle);
    let normal = if back { -front } else { front };
    Look { normal, shininess: material.is_glossy().then_some(material.shininess), mirror: material.mirror }
}
