//! The light cache: vertices, their samples for each light, the dynamic mesh.
