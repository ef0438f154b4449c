//! What the geometry files of one kind give a scene.

use super::material::{Material, TextureMap};
use super::report::Report;
use super::soup::Soup;
use super::textures::Request;
use std::path::PathBuf;

/// The files of one kind, read: OBJ with their MTL, or glTF.
pub(super) trait Source: Sync {
    /// How many materials it brings.
    fn slots(&self) -> usize;

    /// The textures that its materials ask for.
    fn requests(&self) -> Vec<Request<'_>>;

    /// Adds its triangles; its materials are those from number `first` on.
    fn add_to(&self, soup: &mut Soup, first: u32, report: &mut Report);

    /// Its materials; `maps` answers [`Self::requests`], in order.
    fn materials(&self, maps: &mut dyn Iterator<Item = Option<TextureMap>>, report: &mut Report) -> Vec<Material>;

    /// The files that were read, without textures.
    fn files(&self) -> Vec<PathBuf>;
}
