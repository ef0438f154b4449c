//! What keys are computed from, of a square in view, for unit tests.

use super::error_model::ErrorModel;
use super::memory::Room;
use super::options::{Options, Pieces, Priority};
use super::reflectances::Reflectances;
use super::view::ViewState;
use super::visible_faces::VisibleFaces;
use crate::cache::ids::{NodeId, SlotId};
use crate::cache::testing::{Rooted, square};
use crate::estimate::hemisphere::Method;
use glam::Vec3;
use std::ops::{Deref, DerefMut};

/// A unit square of two triangles, of reflectance 0.8, and a view of it.
pub struct Judged {
    pub rooted: Rooted,
    pub view: ViewState,
    pub options: Options,
    reflectances: Reflectances,
}

/// A square whose triangles a view from above shows in so many pixels each.
pub fn judged(pixels: f32) -> Judged {
    let rooted = square();
    let reflectances = Reflectances::new(&rooted.scene);
    let faces = VisibleFaces::of_roots(&rooted.roots);
    let view = ViewState { generation: 1, eye: Vec3::Y, faces, ..ViewState::default() };
    let mut judged = Judged { rooted, view, options: options(), reflectances };
    judged.roots.clone().into_iter().for_each(|root| judged.see(root, pixels));
    judged
}

/// Options by which a leaf may hide nothing.
fn options() -> Options {
    Options {
        seed: 1,
        without: Pieces::default(),
        indirect: true,
        filter: true,
        hemisphere: Method::Stratified,
        max_light_groups: 8,
        priority: Priority::Error,
        min_pixels: 1.0,
        listed: false,
        contrast: 0.02,
        shadow_size: f32::INFINITY,
        shadow_pixels: f32::INFINITY,
        white: f32::INFINITY,
        tolerance: 1e-3,
    }
}

impl Judged {
    /// Keys of an image of mean luminance 1.
    pub fn model(&self) -> ErrorModel<'_> {
        ErrorModel {
            scene: &self.scene,
            cache: &self.cache,
            view: &self.view,
            reflectances: &self.reflectances,
            options: &self.options,
            tolerance: self.options.tolerance,
            mean: 1.0,
            miss_rate: 1e-5,
            room: Room::default(),
        }
    }

    /// Has the view show a leaf in so many pixels.
    pub fn see(&mut self, leaf: NodeId, pixels: f32) {
        self.view.show(leaf, None, pixels);
        self.view.indirect[leaf].pixels = pixels;
    }

    /// The slots at a node's corners.
    pub fn corners(&self, node: NodeId) -> [SlotId; 3] {
        self.cache.topology.nodes[node].corners
    }
}

impl Deref for Judged {
    type Target = Rooted;

    fn deref(&self) -> &Rooted {
        &self.rooted
    }
}

impl DerefMut for Judged {
    fn deref_mut(&mut self) -> &mut Rooted {
        &mut self.rooted
    }
}
