//! The cache as a whole: what is true of the light in a scene whatever is looked at.
//!
//! Sample points and their slots, the hierarchy and the triangles that its leaves are drawn as, a layer of samples
//! for each light group and one for indirect light, the radiance grid, and the priors of visibility. What a view
//! needs beyond that stands in `refine`.

use super::between::{Between, BetweenLists};
use super::coarse_grids::CoarseGrids;
use super::drawn_mesh::{DrawnMesh, DrawnTriangle};
use super::glosses::Glosses;
use super::ids::{BetweenId, DrawnId, NodeId, SlotId, VertexId};
use super::indirect_layer::{IndirectLayer, ShownAs};
use super::irradiance_prior::IrradiancePrior;
use super::layer::Layer;
use super::pieces::{Piece, Pieces};
use super::pool::{Pool, Table};
use super::radiance_grid::RadianceGrid;
use super::slot::{COVERED_WEIGHT, SlotRecord};
use super::topology::Topology;
use super::vertex::{Vertex, VertexName};
use super::visibility_prior::VisibilityPrior;
use crate::bsdf::Gloss;
use crate::estimate::penumbra::Penumbrae;
use crate::scene::{FaceId, Scene};
use glam::Vec3;
use rustc_hash::FxHashMap;
use smallvec::SmallVec;
use std::sync::Arc;

/// Everything that the engine thread owns of the light in a scene.
#[derive(Default)]
pub struct Cache {
    /// Vertices.
    pub vertices: Pool<VertexId, Vertex>,
    /// Their slots.
    pub slots: Pool<SlotId, SlotRecord>,
    /// The highlights that they have.
    pub(super) glosses: Glosses,
    /// Which of them lie between which.
    pub(super) between: BetweenLists,
    /// The hierarchy.
    pub topology: Topology,
    /// The triangles that its leaves are drawn as.
    pub drawn: DrawnMesh,
    /// What is sampled of each light group, in their order.
    pub layers: Vec<Layer>,
    /// What is gathered of indirect light.
    pub indirect: IndirectLayer,
    /// Indirect light to be expected where nothing is known of it.
    pub(super) expected: IrradiancePrior,
    /// How likely places see each light group.
    pub(super) prior: VisibilityPrior,
    /// How sure points in the lights' penumbrae are.
    pub(super) penumbrae: Penumbrae,
    /// What gather rays find at their hits.
    pub(super) radiance: Arc<RadianceGrid>,
    /// The order of base vertices in coarse levels.
    pub(super) coarse: CoarseGrids,
    /// Base vertices by name.
    pub(super) names: FxHashMap<VertexName, VertexId>,
    /// Roots of the faces that were asked for.
    pub(super) roots: FxHashMap<FaceId, NodeId>,
    /// The scene's scale, scene units.
    pub(super) scale: f32,
    /// Whether normal maps turn light, so that its vectors are wanted.
    pub turns: bool,
    /// Pieces that are taken out.
    pub without: Pieces,
}

impl Cache {
    /// An empty cache for a scene with so many light groups.
    #[must_use]
    pub fn new(scene: &Arc<Scene>, groups: usize) -> Self {
        let scale = scene.scale();
        let low = scene.bounds().map_or(Vec3::ZERO, |(low, _)| low);
        let radiance = Arc::new(RadianceGrid::new(low, scene.diagonal()));
        let prior = VisibilityPrior::new(groups, scale);
        let (penumbrae, expected) = (Penumbrae::new(groups), IrradiancePrior::new(scale));
        let layers = vec![Layer::default(); groups];
        let turns = scene.materials.iter().any(|material| material.map_normal.is_some());
        let glosses = Glosses::new(scene);
        Self { glosses, layers, expected, prior, penumbrae, radiance, scale, turns, ..Self::default() }
    }

    /// The root of `face`, if there is one.
    #[must_use]
    pub fn root_of(&self, face: FaceId) -> Option<NodeId> {
        self.roots.get(&face).copied()
    }

    /// The highlight of a slot, where its surface is glossy.
    #[must_use]
    #[inline]
    pub fn gloss(&self, slot: SlotId) -> Option<Gloss> {
        self.slots[slot].gloss().map(|id| self.glosses.get(id))
    }

    /// The slots of a vertex.
    pub fn slots_of(&self, vertex: VertexId) -> impl Iterator<Item = SlotId> + '_ {
        std::iter::successors(self.vertices[vertex].first_slot.get(), |&slot| self.slots[slot].next.get())
    }

    /// The vertices at a node's corners.
    #[must_use]
    pub fn corner_vertices(&self, node: NodeId) -> [VertexId; 3] {
        self.topology.nodes[node].corners.map(|slot| self.slots[slot].vertex)
    }

    /// The vertices that a leaf is drawn with: its corners, and the midpoints on its edges.
    #[must_use]
    pub fn drawn_vertices(&self, node: NodeId) -> SmallVec<[VertexId; 6]> {
        let edges = self.topology.nodes[node].edges;
        let middles = edges.iter().filter_map(|&edge| self.topology.midpoint(edge));
        self.corner_vertices(node).into_iter().chain(middles).collect()
    }

    /// A drawn triangle, as the GPU is told of it.
    #[must_use]
    pub fn drawn_triangle(&self, id: DrawnId) -> DrawnTriangle {
        let record = &self.drawn.triangles[id];
        let node = &self.topology.nodes[record.node];
        DrawnTriangle { slots: record.slots, face: node.face, level: node.level, flat: record.flat.get() }
    }

    /// Positions of a node's corners.
    #[must_use]
    pub fn corner_positions(&self, node: NodeId) -> [Vec3; 3] {
        self.corner_vertices(node).map(|v| self.vertices[v].position)
    }

    /// The slots that one lies between, if any.
    #[must_use]
    pub fn between(&self, slot: SlotId) -> Option<Between<'_>> {
        self.between.get(self.slots[slot].between)
    }

    /// The slots that lie between one and others.
    pub(super) fn lying_between(&self, slot: SlotId) -> impl Iterator<Item = SlotId> + '_ {
        let next = |id: &BetweenId| self.between.next(self.slots[SlotId(id.0 / 8)].between, id.0 as usize % 8);
        std::iter::successors(self.slots[slot].first_between.get(), next).map(|id| SlotId(id.0 / 8))
    }

    /// Whether other geometry covers a slot's vertex.
    #[must_use]
    pub fn is_covered(&self, slot: SlotId) -> bool {
        self.vertices[self.slots[slot].vertex].progress.covered
    }

    /// Weight of a slot's vertex in interpolation.
    #[must_use]
    pub fn weight(&self, slot: SlotId) -> f32 {
        if self.is_covered(slot) { COVERED_WEIGHT } else { 1.0 }
    }

    /// Diffuse luminance to show at a slot, W·sr⁻¹·m⁻²: where nothing is known of its indirect light, with what is to be expected of
    /// it.
    #[must_use]
    pub fn diffuse_to_show(&self, slot: SlotId) -> Vec3 {
        self.slots[slot].direct().diffuse + self.indirect_to_show(slot).0
    }

    /// Diffuse luminance of indirect light to show at a slot, W·sr⁻¹·m⁻², and which of the values that there are it is.
    #[must_use]
    pub(super) fn indirect_to_show(&self, slot: SlotId) -> (Vec3, ShownAs) {
        let (record, kept) = (&self.slots[slot], self.slots[slot].indirect());
        if let Some(indirect) = self.indirect.smoothed(slot) {
            return (indirect, ShownAs::Smoothed);
        }
        if kept.known || self.without.has(Piece::IrradiancePrior) {
            return (kept.diffuse, ShownAs::Kept);
        }
        (self.expected.at(self.vertices[record.vertex].position, record.normal()), ShownAs::Expected)
    }

    /// Checks hierarchy, slots and drawn triangles against each other, in time linear in their number.
    ///
    /// # Panics
    /// If a rule is broken (debug builds and tests call it).
    pub fn validate(&self) {
        self.topology.validate(|slot| self.slots[slot].vertex);
        self.validate_lists_of_vertices();
        self.validate_lists_between();
        self.validate_lists_of_drawn();
    }

    /// Each slot is listed at its vertex, once.
    fn validate_lists_of_vertices(&self) {
        let mut listed = Table::<SlotId, bool>::default();
        for vertex in self.vertices.ids() {
            for slot in self.slots_of(vertex) {
                assert_eq!(self.slots[slot].vertex, vertex, "slot {}: listed at its own vertex", slot.0);
                assert!(!std::mem::replace(&mut listed[slot], true), "slot {}: listed once", slot.0);
            }
        }
        for id in self.slots.ids() {
            assert!(listed[id], "slot {} is listed at its vertex", id.0);
            assert!((self.slots[id].normal().length() - 1.0).abs() < 1e-3, "slot {}: unit normal", id.0);
        }
    }

    /// Each slot is listed at those it lies between, and comes after them in the order of predictions.
    fn validate_lists_between(&self) {
        let order = |id: SlotId| (self.slots[id].rank, id);
        let between =
            |id: SlotId| self.between(id).filter(|between| !between.coarse).map_or(&[][..], |between| between.of);
        let mut listed = Table::<SlotId, usize>::default();
        for id in self.slots.ids() {
            for slot in self.lying_between(id) {
                assert!(
                    between(slot).iter().any(|(other, _)| *other == id),
                    "slot {}: listed at what it lies between",
                    slot.0
                );
                assert!(order(id) < order(slot), "slot {}: predicted after those it lies between", slot.0);
                listed[slot] += 1;
                assert!(listed[slot] <= between(slot).len(), "slot {}: listed once", slot.0);
            }
        }
        for id in self.slots.ids() {
            assert_eq!(listed[id], between(id).len(), "slot {}: listed at those it lies between", id.0);
        }
        let mut predicted = Table::<VertexId, u32>::default();
        let coarse = self.slots.ids().filter_map(|id| self.between(id).filter(|between| between.coarse));
        coarse.flat_map(|between| between.of).for_each(|(of, _)| predicted[self.slots[*of].vertex] += 1);
        for id in self.vertices.ids() {
            assert_eq!(self.coarse.predicts(id), predicted[id] > 0, "vertex {}: predicts what goes by it", id.0);
        }
    }

    /// Drawn triangles are listed at their slots and their nodes.
    fn validate_lists_of_drawn(&self) {
        for id in self.slots.ids() {
            for drawn in self.drawn.with_slot(id) {
                let record = &self.drawn.triangles[drawn];
                assert!(record.all_slots().any(|slot| slot == id), "slot {}: {drawn:?} uses it", id.0);
                assert!(self.drawn.of_node(record.node).contains(&drawn), "{drawn:?} is one of its node's");
            }
        }
    }
}
