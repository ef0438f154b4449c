//! What the cache's memory goes to.

use super::store::Cache;
use super::vertex::VertexName;
use crate::cache::ids::NodeId;
use crate::scene::FaceId;

impl Cache {
    /// Bytes held by the cache's structures.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.bytes_by_part().iter().map(|(_, bytes)| bytes).sum()
    }

    /// Bytes held, by what they are held for.
    #[must_use]
    pub fn bytes_by_part(&self) -> [(&'static str, usize); 13] {
        let maps = self.names.capacity() * size_of::<(VertexName, super::ids::VertexId)>()
            + self.roots.capacity() * size_of::<(FaceId, NodeId)>();
        [
            ("vertices", self.vertices.bytes()),
            ("slots", self.slots.bytes()),
            ("slots between", self.between.bytes()),
            ("nodes", self.topology.nodes.bytes()),
            ("edges", self.topology.bytes() - self.topology.nodes.bytes()),
            ("drawn", self.drawn.triangles.bytes()),
            ("drawn tables", self.drawn.bytes() - self.drawn.triangles.bytes()),
            ("visibility", self.layers.iter().map(|layer| layer.visibility.bytes()).sum()),
            ("area sums", self.layers.iter().map(|layer| layer.sums.bytes()).sum()),
            ("indirect", self.indirect.bytes()),
            ("radiance grid", self.radiance.bytes()),
            ("priors", self.prior.bytes() + self.penumbrae.bytes()),
            ("names, roots", maps),
        ]
    }
}
