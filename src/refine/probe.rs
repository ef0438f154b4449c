//! Why a pixel is so: what the engine knows of the triangle that it shows, the vertices of that, and each light there. Nothing is
//! changed by looking.

use super::engine::Engine;
use super::explanation::{
    Explanation, Face, Indirect, Kind, Known, Leaf, Light, LightPart, Node, PixelLight, State, Triangle, Vertex,
};
use super::pixel_lists::LeafPixel;
use super::publisher::value;
use super::update::Slot;
use crate::cache::ids::{DrawnId, NodeId, SlotId};
use crate::cache::indirect_layer::ShownAs;
use crate::cache::luminance;
use crate::cache::pixels::{weights_in_plane, weights_on_ray};
use crate::cache::slot::{COVERED_WEIGHT, Eye};
use crate::estimate::visibility::{Origin, Visibility};
use crate::scene::FaceId;
use crate::scene::material::Model;
use glam::Vec3;

/// A pixel that is asked about.
#[derive(Clone, Copy, Debug)]
pub struct PixelQuestion {
    /// The face that it shows.
    pub face: FaceId,
    /// Position of the eye, scene units.
    pub eye: Vec3,
    /// Direction through the centre of the pixel, any length.
    pub ray: Vec3,
}

impl Engine {
    /// Explains a pixel by what was [settled](Engine::settle) last; `None` if its face never was in view.
    #[must_use]
    pub fn explain(&self, question: &PixelQuestion) -> Option<Explanation> {
        let nodes = self.nodes_above(question)?;
        let leaf = *nodes.last()?;
        let drawn = nodes.iter().rev().find_map(|&node| self.drawn_at(node, question));
        let vertices = drawn.map_or_else(Vec::new, |(drawn, weights)| self.vertices_of(drawn, weights));
        Some(Explanation {
            face: self.face(question.face),
            nodes: nodes.iter().map(|&node| self.node(node)).collect(),
            leaf: self.leaf(leaf),
            triangle: drawn.map(|(drawn, _)| self.triangle(drawn)),
            light: PixelLight::of(&vertices),
            vertices,
            state: self.state(),
        })
    }

    /// The nodes that hold the pixel's centre, from the root of its face to a leaf.
    fn nodes_above(&self, question: &PixelQuestion) -> Option<Vec<NodeId>> {
        let mut nodes = vec![self.cache.root_of(question.face)?];
        let corners = self.cache.corner_positions(nodes[0]);
        let weights = weights_on_ray(corners, question.eye, question.ray).unwrap_or([1.0 / 3.0; 3]);
        let mut pixel = LeafPixel::at(0, weights);
        while let Some(children) = self.cache.topology.nodes[nodes[nodes.len() - 1]].children() {
            let (in_child, child) = pixel.in_child();
            pixel = in_child;
            nodes.push(children.all()[child]);
        }
        Some(nodes)
    }

    /// The triangle of a node that the pixel's centre lies in, or next to, with the barycentric weights of it.
    fn drawn_at(&self, node: NodeId, question: &PixelQuestion) -> Option<(DrawnId, [f32; 3])> {
        let weights = |drawn: DrawnId| {
            let vertices = self.cache.drawn.triangles[drawn].slots.map(|slot| self.cache.slots[slot].vertex);
            let corners = vertices.map(|vertex| self.cache.vertices[vertex].position);
            Some((drawn, weights_in_plane(corners, question.eye, question.ray)?))
        };
        let least = |weights: [f32; 3]| weights.into_iter().fold(f32::INFINITY, f32::min);
        let all = self.cache.drawn.of_node(node).into_iter().filter_map(weights);
        all.max_by(|a, b| least(a.1).total_cmp(&least(b.1)))
    }

    fn face(&self, face: FaceId) -> Face {
        let material = self.scene.material(face.triangle());
        let (shininess, roughness) = match &material.model {
            Model::Phong(phong) => (material.is_glossy().then_some(phong.shininess), None),
            Model::MetallicRoughness(model) => (None, Some(model.roughness)),
        };
        Face {
            triangle: face.triangle().0,
            side: if face.is_back() { "back" } else { "front" },
            material: material.name.clone(),
            shininess,
            roughness,
        }
    }

    fn node(&self, id: NodeId) -> Node {
        let topology = &self.cache.topology;
        let parent = topology.nodes[id].parent.get();
        let part = parent.and_then(|parent| topology.children(parent).position(|child| child == id));
        Node {
            node: id.0,
            level: topology.nodes[id].level,
            part: part.map(|part| part as u8),
            corners: self.cache.corner_positions(id),
        }
    }

    fn leaf(&self, id: NodeId) -> Leaf {
        let estimate = self.error_model().leaf(id);
        let indirect = self.view.indirect[self.cache.topology.indirect_leaf(id)];
        let error = (indirect.accounted / indirect.pixels).max(0.0).sqrt();
        Leaf {
            pixels: self.view.leaves[id].pixels,
            contrast: estimate.contrast,
            interpolation_error: estimate.interpolation.max(0.0).sqrt(),
            noise_error: estimate.noise.max(0.0).sqrt(),
            indirect_error: (indirect.pixels > 0.0 && error.is_finite()).then_some(error),
        }
    }

    fn triangle(&self, id: DrawnId) -> Triangle {
        let record = &self.cache.drawn.triangles[id];
        Triangle { id: id.0, node: record.node.0, flat: record.flat.get().is_some() }
    }

    /// The vertices of a drawn triangle at a point of it.
    fn vertices_of(&self, drawn: DrawnId, barycentric: [f32; 3]) -> Vec<Vertex> {
        let record = &self.cache.drawn.triangles[drawn];
        let flat = record.flat.get();
        let weigh = |slot| value(&self.cache, &self.view, slot).weight;
        let at = record.slots.into_iter().zip(barycentric);
        // One that is shown all over leaves nothing to the others.
        let counts = at.clone().map(|(slot, share)| if flat.is_some() { 0.0 } else { share * weigh(slot) });
        let counts: Vec<f32> = counts.chain(flat.map(weigh)).collect();
        let total = counts.iter().sum::<f32>().max(COVERED_WEIGHT);
        let all = at.chain(flat.map(|slot| (slot, 0.0))).zip(counts);
        all.map(|((slot, barycentric), count)| self.vertex(slot, barycentric, count / total)).collect()
    }

    fn vertex(&self, id: SlotId, barycentric: f32, share: f32) -> Vertex {
        let record = &self.cache.slots[id];
        let progress = self.cache.vertices[record.vertex].progress;
        let Slot { position, weight, diffuse, specular, .. } = value(&self.cache, &self.view, id);
        let lights = self.lights_at(id);
        let mut unaccounted = Light { diffuse: record.direct().diffuse, specular: self.view.specular.get(id).direct };
        lights.iter().for_each(|part| unaccounted.add(part.light, -1.0));
        let between = self.cache.between(id).into_iter().flat_map(|between| between.of);
        let around = self.cache.drawn.with_slot(id).map(|drawn| self.publisher.updates_since(drawn));
        Vertex {
            slot: id.0,
            vertex: record.vertex.0,
            kind: self.kind(id),
            between: between.map(|(slot, _)| slot.0).collect(),
            position,
            normal: record.normal(),
            visited: progress.visited,
            covered: progress.covered,
            enclosed: progress.enclosed,
            barycentric,
            weight,
            share,
            lights,
            indirect: self.indirect_at(id),
            unaccounted,
            shown: Light { diffuse, specular },
            direct_error: record.direct().variance.max(0.0).sqrt(),
            unchanged_updates: around.max(),
        }
    }

    fn kind(&self, id: SlotId) -> Kind {
        match () {
            () if self.cache.slots[id].is_base() => Kind::Base,
            () if self.cache.pixel_slot(self.cache.slots[id].vertex).is_some() => Kind::Pixel,
            () => Kind::Midpoint,
        }
    }

    fn lights_at(&self, id: SlotId) -> Vec<LightPart> {
        let visited = self.cache.vertices[self.cache.slots[id].vertex].progress.visited;
        let name = |&source: &u32| self.scene.lights[source as usize].name.clone();
        let part = |part: luminance::LightPart| LightPart {
            lights: self.lights.sources_of_group(part.light).iter().map(name).collect(),
            visible: part.visibility.fraction(),
            known: known(part.visibility, visited),
            points: part.visibility.points,
            light: Light { diffuse: part.diffuse.value, specular: part.specular },
            error: part.diffuse.variance.max(0.0).sqrt(),
        };
        luminance::parts(&self.context(), &self.cache, id, self.view.eye).into_iter().map(part).collect()
    }

    fn indirect_at(&self, id: SlotId) -> Indirect {
        let specular = &self.view.specular;
        let parts = self.cache.indirect_parts(id, Eye { position: self.view.eye, specular });
        Indirect {
            rays: parts.rays,
            gathered: parts.gathered.map(|own| Light { diffuse: own.diffuse, specular: own.specular }),
            gathered_error: parts.gathered.map(|own| own.variance.max(0.0).sqrt()),
            predicted: parts.predicted.map(|light| Light { diffuse: light.diffuse, specular: light.specular }),
            kept: parts.kept.diffuse,
            kept_error: parts.kept.variance.max(0.0).sqrt(),
            kept_is_guess: parts.kept.stale,
            shown_as: match parts.shown_as {
                ShownAs::Smoothed => "smoothed",
                ShownAs::Kept => "kept",
                ShownAs::Expected => "expected",
            },
            light: Light { diffuse: parts.shown, specular: specular.get(id).indirect },
        }
    }

    fn state(&self) -> State {
        State {
            view: self.view.generation,
            update: self.publisher.sequence(),
            rays: self.stats.rays,
            image_mean: self.image.mean(),
            estimated_error: self.stats.estimated_error,
        }
    }
}

/// How a visible fraction is known.
const fn known(visibility: Visibility, visited: bool) -> Known {
    match visibility.origin {
        Origin::Unknown => Known::Unknown,
        Origin::Sampled => Known::Traced,
        Origin::Inferred => Known::Inferred,
        Origin::Deferred if visited => Known::Deferred,
        Origin::Deferred => Known::Guessed,
    }
}
