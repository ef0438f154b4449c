//! Blocks: what the cache knows of a cluster of neighbouring faces as bytes, to be spilled to disk or kept for another run. One
//! holds the shape of their hierarchy; others hold the samples of one layer each, by the permanent keys of vertices, so that a
//! layer may be missing or belong to a hierarchy that has changed.
//!
//! All numbers are little-endian. Bytes come from files: whatever they say is checked.

use crate::scene::FaceId;
use smallvec::SmallVec;

/// Triangles of a cluster; the faces on one side of them belong together.
const TRIANGLES: u32 = 16;

/// A cluster of faces: one side of triangles that follow each other in the scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct ClusterId(pub u32);

impl ClusterId {
    /// The cluster of a face.
    #[must_use]
    pub const fn of(face: FaceId) -> Self {
        Self(face.triangle().0 / TRIANGLES * 2 + face.is_back() as u32)
    }

    /// Number of clusters of so many triangles.
    #[must_use]
    pub const fn count(triangles: u32) -> u32 {
        triangles.div_ceil(TRIANGLES) * 2
    }

    /// Its faces, of a scene of so many triangles.
    pub fn faces(self, triangles: u32) -> impl Iterator<Item = FaceId> {
        let first = self.0 / 2 * TRIANGLES;
        let back = self.0 % 2 == 1;
        (first..(first + TRIANGLES).min(triangles)).map(move |t| FaceId::new(crate::scene::TriangleId(t), back))
    }
}

/// A layer that blocks hold.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum BlockLayer {
    /// The hierarchy and how far vertices have come.
    Shape,
    /// A light group's direct light.
    Direct(u32),
    /// Indirect light.
    Indirect,
}

/// The blocks of one cluster.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Blocks {
    /// [`BlockLayer::Shape`].
    pub shape: Vec<u8>,
    /// By light group; `None` where it is not known or not of these lights.
    pub direct: Vec<Option<Vec<u8>>>,
    /// [`BlockLayer::Indirect`], likewise.
    pub indirect: Option<Vec<u8>>,
    /// Faces and splits.
    pub size: [u32; 2],
}

impl Blocks {
    /// Bytes of all of them.
    #[must_use]
    pub fn len(&self) -> usize {
        let layers = self.direct.iter().chain([&self.indirect]);
        self.shape.len() + layers.flatten().map(Vec::len).sum::<usize>()
    }

    /// Whether there is nothing in them.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

/// Bytes that are not what a block may hold.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Malformed;

/// A node of the hierarchy.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct NodeShape {
    /// Whether it is split, and whether it is in the indirect layer.
    pub split: [bool; 2],
    /// [`super::topology::Node::direct_surplus`].
    pub direct_surplus: f32,
    /// [`super::topology::IndirectError`].
    pub indirect: [f32; 2],
}

/// A vertex.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct VertexShape {
    /// Its permanent key.
    pub key: u64,
    /// [`Self::VISITED`] and so on.
    pub flags: u8,
    /// Bits of the normals of its slots, each once.
    pub normals: SmallVec<[u32; 2]>,
}

impl VertexShape {
    pub(super) const VISITED: u8 = 1;
    pub(super) const TRACED: u8 = 2;
    pub(super) const COVERED: u8 = 4;
    pub(super) const ENCLOSED: u8 = 8;
    pub(super) const OUTDATED: u8 = 16;
}

/// The hierarchy of the faces of a cluster.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Shape {
    /// Faces with their nodes, breadth first: the children of the k-th that is split are 4 k + 1 to 4 k + 4.
    pub(super) faces: Vec<(FaceId, Vec<NodeShape>)>,
    /// By rising key.
    pub(super) vertices: Vec<VertexShape>,
}

impl Shape {
    /// Number of faces and splits.
    pub(super) fn size(&self) -> [u32; 2] {
        let splits = self.faces.iter().map(|(_, nodes)| nodes.len() as u32 / 4).sum();
        [self.faces.len() as u32, splits]
    }

    /// As bytes.
    pub(super) fn to_bytes(&self) -> Vec<u8> {
        let mut out = Vec::with_capacity(16 + self.faces.len() * 24 + self.vertices.len() * 14);
        put(&mut out, self.faces.len() as u32);
        for (face, nodes) in &self.faces {
            put(&mut out, face.0);
            put(&mut out, nodes.len() as u32);
            for node in nodes {
                out.push(u8::from(node.split[0]) | u8::from(node.split[1]) << 1);
                [node.direct_surplus, node.indirect[0], node.indirect[1]]
                    .iter()
                    .for_each(|x| put(&mut out, x.to_bits()));
            }
        }
        put(&mut out, self.vertices.len() as u32);
        for VertexShape { key, flags, normals } in &self.vertices {
            put(&mut out, *key as u32);
            put(&mut out, (key >> 32) as u32);
            out.extend([*flags, normals.len() as u8]);
            normals.iter().for_each(|&normal| put(&mut out, normal));
        }
        out
    }

    /// What bytes hold, for a cluster of a scene of so many triangles.
    ///
    /// # Errors
    /// If they hold no such thing.
    pub fn of_bytes(bytes: &[u8], cluster: ClusterId, triangles: u32) -> Result<Self, Malformed> {
        let mut input = Input(bytes);
        let mut shape = Self::default();
        for _ in 0..input.count(8)? {
            let face = FaceId(input.word()?);
            let is_next = shape.faces.last().is_none_or(|(before, _)| *before < face);
            if ClusterId::of(face) != cluster || face.triangle().0 >= triangles || !is_next {
                return Err(Malformed);
            }
            let nodes = (0..input.count(13)?).map(|_| input.node()).collect::<Result<Vec<_>, _>>()?;
            if nodes.len() != 1 + 4 * nodes.iter().filter(|node| node.split[0]).count() {
                return Err(Malformed);
            }
            shape.faces.push((face, nodes));
        }
        for _ in 0..input.count(10)? {
            let key = u64::from(input.word()?) | u64::from(input.word()?) << 32;
            let [flags, normals] = input.take()?;
            let normals = (0..normals).map(|_| input.word()).collect::<Result<_, _>>()?;
            if shape.vertices.last().is_some_and(|before| before.key >= key) {
                return Err(Malformed);
            }
            shape.vertices.push(VertexShape { key, flags, normals });
        }
        if input.0.is_empty() { Ok(shape) } else { Err(Malformed) }
    }
}

/// Appends a word.
pub(super) fn put(out: &mut Vec<u8>, word: u32) {
    out.extend(word.to_le_bytes());
}

/// Bytes that are still to be read.
pub(super) struct Input<'a>(pub &'a [u8]);

impl Input<'_> {
    pub(super) fn take<const N: usize>(&mut self) -> Result<[u8; N], Malformed> {
        let (first, rest) = self.0.split_first_chunk().ok_or(Malformed)?;
        self.0 = rest;
        Ok(*first)
    }

    pub(super) fn byte(&mut self) -> Result<u8, Malformed> {
        self.take().map(|[byte]| byte)
    }

    pub(super) fn word(&mut self) -> Result<u32, Malformed> {
        self.take().map(u32::from_le_bytes)
    }

    /// A number of things that take so many bytes each at least: no more than there are bytes for.
    pub(super) fn count(&mut self, least: usize) -> Result<usize, Malformed> {
        let count = self.word()? as usize;
        if count > self.0.len() / least { Err(Malformed) } else { Ok(count) }
    }

    /// A number that is not negative; none if it may be infinite.
    fn error(&mut self) -> Result<f32, Malformed> {
        Some(f32::from_bits(self.word()?)).filter(|error| *error >= 0.0).ok_or(Malformed)
    }

    fn node(&mut self) -> Result<NodeShape, Malformed> {
        let flags = self.byte()?;
        let split = [flags & 1 != 0, flags & 2 != 0];
        // The drawn mesh is at least as fine as that of indirect light.
        if flags > 3 || split == [false, true] {
            return Err(Malformed);
        }
        Ok(NodeShape { split, direct_surplus: self.error()?, indirect: [self.error()?, self.error()?] })
    }
}
