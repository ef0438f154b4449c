//! Samples by place and normal: the nearest to a place on a surface, in a k-d tree of positions and normals.

use glam::Vec3;
use kiddo::{ImmutableKdTree, SquaredEuclidean};
use std::num::NonZero;

/// Samples in a tree.
pub(super) struct SampleTree {
    tree: ImmutableKdTree<f32, 6>,
    normals: f32,
}

/// A sample that was found.
#[derive(Clone, Copy, Debug)]
pub(super) struct Found {
    /// Its number.
    pub index: usize,
    /// Square of its distance, with what its normal counts for, square scene units.
    pub squared_distance: f32,
}

impl SampleTree {
    /// A tree of positions and unit normals, in which a difference of normals of length 1 counts as the distance `normals`; `None`
    /// without any.
    pub(super) fn new(places: impl Iterator<Item = (Vec3, Vec3)>, normals: f32) -> Option<Self> {
        let points: Vec<[f32; 6]> = places.map(|(position, normal)| point(position, normal, normals)).collect();
        let tree = ImmutableKdTree::new_from_slice(&points).ok().filter(|_| !points.is_empty());
        tree.map(|tree| Self { tree, normals })
    }

    /// The nearest few to a place on a surface of this unit normal, nearest first.
    pub(super) fn nearest(&self, position: Vec3, normal: Vec3, few: usize) -> impl Iterator<Item = Found> + use<> {
        let few = NonZero::new(few).unwrap_or(NonZero::<usize>::MIN);
        let query =
            self.tree.query(&point(position, normal, self.normals)).nearest_n::<SquaredEuclidean<f32>>(few).execute();
        query.into_iter().map(|near| Found { index: near.item as usize, squared_distance: near.distance })
    }
}

fn point(position: Vec3, normal: Vec3, normals: f32) -> [f32; 6] {
    let normal = normal * normals;
    [position.x, position.y, position.z, normal.x, normal.y, normal.z]
}
