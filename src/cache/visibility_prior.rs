//! How likely a place sees a light, by what was found around it: what an untraced light is taken to send, and which
//! lights are worth a ray (docs/method/direct-light.md).
//!
//! Most of a hundred lamps hang behind something. Where twenty vertices found a lamp hidden, the next need not ask.
//! Counts by cell, side and light give the odds, those of a larger cell as the prior of the smaller one's.

use super::ids::CountId;
use super::pool::map_bytes;
use super::sparse::Sparse;
use super::vertex::Vertex;
use crate::math::nearest_axis;
use glam::IVec3;
use rustc_hash::FxHashMap;

/// Edges of the cells against the scene's scale, coarse to fine.
const CELLS: [f32; SIZES] = [1.0, 1.0 / 32.0, 1.0 / 128.0];
const SIZES: usize = 3;
/// What a larger cell's odds count beside a cell's own, in vertices.
const PRIOR: [f32; SIZES] = [1.0, 1.0, 2.0];
/// Odds of seeing a light of which nothing is known.
const UNKNOWN: f32 = 0.5;

/// Cells at a place, for one side of its surface.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct PriorCells {
    cells: [Option<u32>; SIZES],
}

/// What was found in a cell of one light.
#[derive(Clone, Copy, Debug, Default)]
struct Count {
    /// Vertices that have traced it.
    traced: f32,
    /// Sum of the fractions that they see.
    seen: f32,
}

/// A cell's size, place and side: the axis along which its surfaces face most.
type Key = (u8, IVec3, u8);

/// Odds of seeing each light, by place.
#[derive(Clone, Debug, Default)]
pub struct VisibilityPrior {
    cells: FxHashMap<Key, u32>,
    /// By cell, then light: most cells have traced few lights.
    counts: Sparse<CountId, Count>,
    lights: u32,
    scale: f32,
}

impl VisibilityPrior {
    pub(super) fn new(lights: usize, scale: f32) -> Self {
        Self { lights: lights as u32, scale, ..Self::default() }
    }

    /// The cells of a vertex, as far as anything was found in them.
    pub(super) fn cells_of(&self, vertex: &Vertex) -> PriorCells {
        PriorCells { cells: [0, 1, 2].map(|size| self.cells.get(&self.key(size, vertex)).copied()) }
    }

    /// Whether anything was found anywhere.
    pub(super) fn knows_any(&self) -> bool {
        !self.cells.is_empty()
    }

    /// Share of a light that a place may be expected to see: between 0 and 1, neither.
    pub(super) fn at(&self, place: PriorCells, light: u32) -> f32 {
        let refine = |odds: f32, (cell, prior): (&Option<u32>, f32)| {
            let count = cell.map_or(Count::default(), |cell| self.counts.get(self.index(cell, light)));
            (count.seen + odds * prior) / (count.traced + prior)
        };
        place.cells.iter().zip(PRIOR).fold(UNKNOWN, refine)
    }

    /// The cells of a vertex, made where there are none.
    pub(super) fn cells(&mut self, vertex: &Vertex) -> [u32; SIZES] {
        [0, 1, 2].map(|size| {
            let next = self.cells.len() as u32;
            *self.cells.entry(self.key(size, vertex)).or_insert(next)
        })
    }

    /// Takes in which share of a light a vertex in some cells has found visible.
    pub(super) fn note(&mut self, cells: [u32; SIZES], light: u32, fraction: f32) {
        for cell in cells {
            let count = self.counts.entry(self.index(cell, light));
            count.traced += 1.0;
            count.seen += fraction;
        }
    }

    /// Forgets what was found of a light.
    pub(super) fn forget(&mut self, light: u32) {
        let cells = self.cells.len() as u32;
        (0..cells).for_each(|cell| self.counts.reset(self.index(cell, light)));
    }

    /// Bytes held.
    pub(super) fn bytes(&self) -> usize {
        map_bytes(&self.cells) + self.counts.bytes()
    }

    fn index(&self, cell: u32, light: u32) -> CountId {
        CountId(cell * self.lights + light)
    }

    fn key(&self, size: usize, vertex: &Vertex) -> Key {
        (size as u8, (vertex.position / (self.scale * CELLS[size])).floor().as_ivec3(), nearest_axis(vertex.normal()))
    }
}

#[cfg(test)]
mod tests {
    use super::super::testing::{rooted, scene_of, square};
    use super::*;
    use glam::Vec3;

    /// A vertex facing up.
    fn vertex_at(position: Vec3) -> Vertex {
        let cache = square().cache;
        let mut vertex = cache.vertices.ids().next().map(|id| cache.vertices[id].clone()).expect("corners");
        vertex.position = position;
        vertex
    }

    /// Odds of light 1 of two at `asked`, after vertices at the origin have found fractions of it.
    fn odds(fractions: &[f32], asked: &Vertex) -> f32 {
        let mut prior = VisibilityPrior::new(2, 1.0);
        let origin = vertex_at(Vec3::ZERO);
        for &fraction in fractions {
            let cells = prior.cells(&origin);
            prior.note(cells, 1, fraction);
        }
        assert_eq!(prior.at(prior.cells_of(asked), 0), UNKNOWN, "nothing is known of the other light");
        prior.at(prior.cells_of(asked), 1)
    }

    #[test]
    fn counts_give_the_odds() {
        let here = vertex_at(Vec3::splat(1e-3));
        assert_eq!(odds(&[], &here), UNKNOWN);
        let quarter = odds(&[0.0, 0.0, 0.5, 0.5].repeat(100), &here);
        assert!((quarter - 0.25).abs() < 1e-3, "{quarter}");
        let (few, many) = (odds(&[1.0; 2], &here), odds(&[1.0; 200], &here));
        assert!(0.5 < few && few < many && many < 1.0, "{few} {many}");
        let (few, many) = (odds(&[0.0; 2], &here), odds(&[0.0; 200], &here));
        assert!(0.5 > few && few > many && many > 0.0, "{few} {many}");
    }

    #[test]
    fn a_larger_cell_is_the_prior_of_the_smaller() {
        let seen = [1.0; 20];
        let here = odds(&seen, &vertex_at(Vec3::splat(1e-3)));
        // In the same cell of edge 1/32, and of edge 1, but in no smaller one.
        let (near, far) = (odds(&seen, &vertex_at(Vec3::X * 0.03)), odds(&seen, &vertex_at(Vec3::X * 0.9)));
        assert!(here > near && near > far && far > UNKNOWN, "{here} {near} {far}");
        // Twenty beside a prior that counts for one.
        assert!((far - 20.5 / 21.0).abs() < 1e-6 && (near - (20.0 + far) / 21.0).abs() < 1e-6);
        assert_eq!(odds(&seen, &vertex_at(Vec3::X * 1.1)), UNKNOWN);
    }

    #[test]
    fn surfaces_that_face_elsewhere_have_cells_of_their_own() {
        let wall = rooted(scene_of(&[Vec3::ZERO, Vec3::X, Vec3::Y], &[[0, 1, 2]])).cache;
        let corner = wall.vertices.ids().next().expect("corners");
        assert_eq!(wall.vertices[corner].position, Vec3::ZERO);
        assert_eq!(odds(&[1.0; 20], &wall.vertices[corner]), UNKNOWN);
    }
}
