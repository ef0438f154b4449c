//! Samples by place and normal: the nearest to a place on a surface, in a k-d tree of positions and normals.

use glam::Vec3;
use kiddo::{ImmutableKdTree, SquaredEuclidean};
use std::num::NonZero;

/// A position, scene units, and a unit normal there.
pub type Place = (Vec3, Vec3);

/// Samples in a tree.
pub(super) struct SampleTree {
    tree: ImmutableKdTree<f32, 6>,
    normals: f32,
}

impl SampleTree {
    /// A tree of positions and unit normals, in which a difference of normals of length 1 counts as the distance `normals`; `None`
    /// without any.
    pub(super) fn new(places: impl Iterator<Item = Place>, normals: f32) -> Option<Self> {
        let points: Vec<[f32; 6]> = places.map(|(position, normal)| point(position, normal, normals)).collect();
        let tree = ImmutableKdTree::new_from_slice(&points).ok().filter(|_| !points.is_empty());
        tree.map(|tree| Self { tree, normals })
    }

    /// Square of the distance between two places on surfaces, square scene units.
    pub(super) fn squared_distance(&self, a: Place, b: Place) -> f32 {
        a.0.distance_squared(b.0) + a.1.distance_squared(b.1) * (self.normals * self.normals)
    }

    /// The numbers of the nearest few to a place, nearest first.
    pub(super) fn nearest(&self, (position, normal): Place, few: usize) -> impl Iterator<Item = usize> + use<> {
        let few = NonZero::new(few).unwrap_or(NonZero::<usize>::MIN);
        let query =
            self.tree.query(&point(position, normal, self.normals)).nearest_n::<SquaredEuclidean<f32>>(few).execute();
        query.into_iter().map(|near| near.item as usize)
    }
}

fn point(position: Vec3, normal: Vec3, normals: f32) -> [f32; 6] {
    let normal = normal * normals;
    [position.x, position.y, position.z, normal.x, normal.y, normal.z]
}
