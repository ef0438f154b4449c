//! Coarse levels above the geometry: real meshes are denser than their indirect light, so that not every base vertex
//! has to gather.
//!
//! Base vertices are taken into a coarse-to-fine order of spacings that shrink threefold. Each takes the prediction
//! of up to six coarser ones around it, by moving least squares, until it has gathered itself.

use super::between::Between;
use super::coarse_grids::{LEVELS, MOST_PARENTS, Near, Neighbours, insert_near, spacing, within};
use super::ids::{SlotId, VertexId};
use super::pieces::Piece;
use super::store::Cache;
use glam::{Mat4, Vec3, Vec4};
use smallvec::SmallVec;

/// Damping of the slopes of the least-squares fit.
const RIDGE: f32 = 0.03;
/// Bounds of a weight: extrapolation must not run wild.
const WEIGHTS: [f32; 2] = [-0.3, 1.3];

/// Vertices of each level or coarser around a base vertex, nearest first.
pub struct Around([Neighbours; LEVELS]);

/// A base vertex in the order.
pub struct Placed {
    vertex: VertexId,
    /// The level at which it is far enough from others.
    level: usize,
    /// The coarser vertices that predict it.
    parents: Neighbours,
}

/// Slots that predict one, with their weights.
pub struct PredictedBy {
    slot: SlotId,
    of: SmallVec<[(SlotId, f32); MOST_PARENTS]>,
}

impl Cache {
    /// What is in the order already around a base vertex.
    #[must_use]
    pub fn around_in_coarse_levels(&self, vertex: VertexId) -> Around {
        let here = &self.vertices[vertex];
        Around(std::array::from_fn(|level| match self.without.has(Piece::CoarseLevels) {
            true => Neighbours::new(),
            false => self.coarse.near(&self.vertices, here, level, self.scale),
        }))
    }

    /// Takes base vertices into the order, one after the other, each below the coarser ones that are there already: what was
    /// there before them all is `around` each. Once for each vertex.
    pub fn place_in_coarse_levels(&mut self, vertices: &[VertexId], around: Vec<Around>) -> Vec<Placed> {
        let mut placed: Vec<Placed> = Vec::with_capacity(vertices.len());
        for (&vertex, around) in vertices.iter().zip(around) {
            placed.push(self.place_among_coarser(vertex, around, &placed));
        }
        for &Placed { vertex, level, .. } in &placed {
            self.coarse.add(vertex, self.vertices[vertex].position, level, self.scale);
            let slots: SmallVec<[SlotId; 4]> = self.slots_of(vertex).collect();
            slots.into_iter().for_each(|slot| self.slots[slot].rank = level as u8);
        }
        placed
    }

    /// The level at which a base vertex is far enough from others, and the coarser vertices that predict it.
    fn place_among_coarser(&self, vertex: VertexId, around: Around, placed: &[Placed]) -> Placed {
        let (mut level, mut parents) = (LEVELS, Neighbours::new());
        if self.without.has(Piece::CoarseLevels) {
            return Placed { vertex, level: 0, parents };
        }
        for (l, mut near) in (0..).zip(around.0) {
            let fresh = placed.iter().filter(|other| other.level <= l);
            let fresh = fresh.map(|other| (other.vertex, self.vertices[other.vertex].position));
            insert_near(&mut near, fresh, (&self.vertices, &self.vertices[vertex]), within(self.scale, l));
            let alone = near.first().is_none_or(|n| n.distance > spacing(self.scale, l));
            if l == 0 || !alone {
                parents = near;
            }
            if alone {
                level = l;
                break;
            }
        }
        // Of the coarsest, the older predict the younger.
        parents.retain(|parent| level > 0 || parent.vertex < vertex);
        Placed { vertex, level, parents }
    }

    /// Slots that predict a base vertex, with their weights.
    pub fn parents_of(&self, vertex: VertexId) -> impl Iterator<Item = (SlotId, f32)> + '_ {
        let between = self.slots_of(vertex).find_map(|slot| self.between(slot).filter(|between| between.coarse));
        between.into_iter().flat_map(|between| between.of.iter().copied())
    }

    /// Which slots predict those of a base vertex.
    #[must_use]
    pub fn predicted_by(&self, placed: &Placed) -> SmallVec<[PredictedBy; 2]> {
        let parents = &placed.parents;
        if parents.is_empty() {
            return SmallVec::new();
        }
        let radius = parents.iter().map(|p| p.distance).fold(0.0, f32::max) * 1.1;
        let weights = least_squares_weights(parents, radius);
        let look = |parent: VertexId, normal: Vec3| {
            let cosine = |s: &SlotId| self.slots[*s].normal().dot(normal);
            self.slots_of(parent).max_by(|a, b| cosine(a).total_cmp(&cosine(b)))
        };
        let predicted_by = |slot: SlotId| {
            let normal = self.slots[slot].normal();
            let of = parents.iter().zip(&weights);
            PredictedBy { slot, of: of.filter_map(|(p, &weight)| Some((look(p.vertex, normal)?, weight))).collect() }
        };
        self.slots_of(placed.vertex).map(predicted_by).collect()
    }

    /// Notes which slots predict one.
    pub fn note_predicted_by(&mut self, PredictedBy { slot, of }: &PredictedBy) {
        self.note_between(*slot, Between { of, coarse: true });
    }
}

/// Weights by which the values at places around a point give the value at it: those of a linear function are kept, as
/// far as the places tell its slopes.
fn least_squares_weights(places: &[Near], radius: f32) -> SmallVec<[f32; MOST_PARENTS]> {
    let basis = |p: &Near| (p.offset / radius).extend(1.0);
    let kernel = |p: &Near| {
        let t = (p.distance / radius).powi(2);
        (1.0 - t) * (1.0 - t) / (t + 0.02)
    };
    let mut normal = Mat4::from_diagonal(Vec4::new(RIDGE, RIDGE, RIDGE, 0.0));
    for place in places {
        let (phi, k) = (basis(place), kernel(place));
        normal += Mat4::from_cols(phi * phi.x, phi * phi.y, phi * phi.z, phi * phi.w) * k;
    }
    // The constant's row of the inverse gives the fit's value at the point.
    let value = normal.inverse().w_axis;
    let raw = places.iter().map(|p| (kernel(p) * value.dot(basis(p))).clamp(WEIGHTS[0], WEIGHTS[1]));
    let raw: SmallVec<[f32; MOST_PARENTS]> = raw.collect();
    let sum: f32 = raw.iter().sum();
    raw.iter().map(|w| w / sum).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn places(offsets: &[Vec3]) -> Vec<Near> {
        offsets.iter().map(|&offset| Near { vertex: VertexId(0), offset, distance: offset.length() }).collect()
    }

    #[test]
    fn linear_functions_are_predicted_nearly_exactly() {
        let around = [Vec3::X, Vec3::new(-0.4, 0.9, 0.0), Vec3::new(-0.3, -0.7, 0.0), Vec3::new(0.2, 0.5, 0.0)];
        let weights = least_squares_weights(&places(&around), 1.1);
        let linear = |x: Vec3| 3.0 + x.x - 2.0 * x.y;
        let value: f32 = around.iter().zip(&weights).map(|(x, w)| linear(*x) * w).sum();
        assert!((value - 3.0).abs() < 0.15, "{value}");
        assert!((weights.iter().sum::<f32>() - 1.0).abs() < 1e-5);
    }

    #[test]
    fn one_place_or_places_in_a_line_give_finite_weights() {
        assert_eq!(least_squares_weights(&places(&[Vec3::Y]), 1.1).as_slice(), [1.0]);
        let line = least_squares_weights(&places(&[Vec3::X, Vec3::X * -1.5, Vec3::X * 2.0]), 2.2);
        assert!(line.iter().all(|w| w.is_finite()), "{line:?}");
    }
}
