//! A digest of the cache: one number for all that is known at each vertex, by its permanent key, whatever its place in the arenas.
//! Two runs that are to be alike are compared by it, and the first vertex that differs is named.

use super::block::put;
use super::ids::VertexId;
use super::store::Cache;
use crate::math::combine;
use glam::Vec3;
use std::fmt;

/// What is known at a vertex, as one number.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VertexDigest {
    /// Its permanent key.
    pub key: u64,
    /// Where it lies, scene units.
    pub position: Vec3,
    /// Of how far it has come, visibility, sums and light vectors.
    pub known: u64,
}

/// Vertices by rising key.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Digest {
    /// The vertices.
    pub vertices: Vec<VertexDigest>,
}

/// The first vertex of which two digests differ.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Difference {
    /// As it is in one and in the other, if it is there.
    pub of: [Option<VertexDigest>; 2],
}

impl Cache {
    /// What is known, as numbers.
    #[must_use]
    pub fn digest(&self) -> Digest {
        let digest = |id: VertexId| {
            let vertex = &self.vertices[id];
            VertexDigest { key: vertex.key, position: vertex.position, known: hash(&self.known_at(id)) }
        };
        let mut vertices: Vec<VertexDigest> = self.vertices.ids().map(digest).collect();
        vertices.sort_unstable_by_key(|vertex| (vertex.key, vertex.known));
        Digest { vertices }
    }

    /// All that is known at a vertex, as bytes.
    fn known_at(&self, id: VertexId) -> Vec<u8> {
        let of = [id];
        let mut bytes = Vec::new();
        let shape = self.vertex_shape(id);
        bytes.push(shape.flags);
        shape.normals.iter().for_each(|&normal| put(&mut bytes, normal));
        (0..self.layers.len()).for_each(|light| bytes.extend(self.direct_block(&of, light)));
        bytes.extend(self.indirect_block(&of));
        bytes
    }
}

/// A number that stands for bytes.
fn hash(bytes: &[u8]) -> u64 {
    let words = bytes.chunks(8).map(|chunk| {
        let mut word = [0; 8];
        word[..chunk.len()].copy_from_slice(chunk);
        u64::from_le_bytes(word)
    });
    words.fold(bytes.len() as u64, combine)
}

impl Digest {
    /// One number for all.
    #[must_use]
    pub fn total(&self) -> u64 {
        self.vertices
            .iter()
            .fold(self.vertices.len() as u64, |sum, vertex| combine(combine(sum, vertex.key), vertex.known))
    }

    /// The first vertex of which this and another differ.
    #[must_use]
    pub fn first_difference(&self, other: &Self) -> Option<Difference> {
        let [mut a, mut b] = [self, other].map(|digest| digest.vertices.iter().copied().peekable());
        loop {
            let of = [a.peek().copied(), b.peek().copied()];
            let keys = of.map(|vertex| vertex.map_or(u64::MAX, |vertex| vertex.key));
            match (of, keys) {
                ([None, None], _) => return None,
                ([one, other], _) if one == other => _ = (a.next(), b.next()),
                ([one, _], [first, second]) if first < second => return Some(Difference { of: [one, None] }),
                ([_, other], [first, second]) if second < first => return Some(Difference { of: [None, other] }),
                _ => return Some(Difference { of }),
            }
        }
    }
}

impl fmt::Display for Difference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Some(VertexDigest { key, position, .. }) = self.of.into_iter().flatten().next() else { return Ok(()) };
        write!(f, "vertex {key:016x} at {position}: ")?;
        match self.of.map(|vertex| vertex.map(|vertex| vertex.known)) {
            [Some(one), Some(other)] => write!(f, "{one:016x} in one, {other:016x} in the other"),
            [Some(_), None] => f.write_str("only in one"),
            _ => f.write_str("only in the other"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::ids::SlotId;
    use super::super::testing::square;

    #[test]
    fn the_first_vertex_that_differs_is_named() {
        let (mut one, mut other) = (square(), square());
        assert_eq!(one.cache.digest().first_difference(&other.cache.digest()), None);
        one.gather(SlotId(1), &[1.0; 4]);
        other.gather(SlotId(1), &[1.0; 4]);
        let [a, b] = [&one, &other].map(|square| square.cache.digest());
        assert_eq!((a.first_difference(&b), a.total()), (None, b.total()));
        other.gather(SlotId(1), &[0.5; 4]);
        let b = other.cache.digest();
        let difference = a.first_difference(&b).expect("one vertex knows more");
        let vertex = other.cache.slots[SlotId(1)].vertex;
        assert_eq!(difference.of.map(|of| of.map(|of| of.key)), [Some(other.cache.vertices[vertex].key); 2]);
        assert!(a.total() != b.total() && difference.to_string().contains("in the other"), "{difference}");
        other.split(other.roots[0]);
        let more = other.cache.digest().first_difference(&b).expect("three more");
        assert!(more.to_string().contains("only in"), "{more}");
    }
}
