//! Triangles told apart one by one for each view: what cannot show is not drawn, and what has to be clipped is drawn apart.
//!
//! Only for a software rasteriser, whose one thread for vertices is what a view waits for (docs/lavapipe.md): in a fraction of the time
//! that a triangle takes there the host tells that it lies between pixel centres, or behind what is there.

use super::clusters::Clusters;
use super::frustum::{Frustum, Place};
use super::occlusion::Occlusion;
use super::raster::{Projected, Raster};
use super::shared::{GpuVisibilityTriangle, NONE};
use glam::Vec3;
use rayon::prelude::*;
use std::ops::Range;

/// What tells them apart.
pub(super) struct Survivors<'a> {
    pub frustum: &'a Frustum,
    /// Where it is told what covers no pixel centre.
    pub raster: Option<&'a Raster>,
    /// What is there already.
    pub occlusion: Option<&'a Occlusion<'a>>,
    /// All triangles in drawing order.
    pub triangles: &'a [GpuVisibilityTriangle],
    /// Positions of the scene's vertices.
    pub positions: &'a [Vec3],
    /// Whether each face had pixels in the picture before: it most likely has some again, and is not looked at.
    pub visible: &'a [bool],
}

/// Vertices that were projected last, by their lowest bits: neighbours in drawing order share them.
struct Projections<'a> {
    positions: &'a [Vec3],
    known: [(u32, Projected); 256],
}

impl Projections<'_> {
    fn at(&mut self, raster: &Raster, vertex: u32) -> Projected {
        let known = &mut self.known[vertex as usize % 256];
        if known.0 != vertex {
            *known = (vertex, raster.project(self.positions[vertex as usize]));
        }
        known.1
    }
}

/// Survivors apart by where they came from.
#[derive(Default)]
struct Parts {
    /// Of clusters that lie wholly inside the frustum.
    whole: Vec<GpuVisibilityTriangle>,
    /// Of others, but need no clipping.
    single: Vec<GpuVisibilityTriangle>,
    clipped: Vec<GpuVisibilityTriangle>,
}

/// Clusters that a thread goes through at a time.
const CLUSTERS_A_JOB: usize = 32;

impl Survivors<'_> {
    /// Those of clusters, in order: of whole clusters, then single ones that need no clipping, then those that do.
    pub(super) fn of(&self, clusters: &Clusters) -> Vec<GpuVisibilityTriangle> {
        let places: Vec<(Range<usize>, Place)> = clusters.places(self.frustum).collect();
        let parts: Vec<Parts> = places.par_chunks(CLUSTERS_A_JOB).map(|clusters| self.of_clusters(clusters)).collect();
        let whole = parts.iter().flat_map(|part| &part.whole);
        let single = parts.iter().flat_map(|part| &part.single);
        let clipped = parts.iter().flat_map(|part| &part.clipped);
        whole.chain(single).chain(clipped).copied().collect()
    }

    fn of_clusters(&self, clusters: &[(Range<usize>, Place)]) -> Parts {
        let (mut parts, mut vertices) = (Parts::default(), self.projections());
        for (range, place) in clusters {
            let triangles = self.triangles[range.clone()].iter().copied();
            match place {
                Place::Inside => parts.whole.extend(triangles.filter(|t| self.may_show(*t, &mut vertices))),
                Place::Crossing => self.tell_apart(triangles, &mut vertices, &mut parts),
                Place::Outside => {}
            }
        }
        parts
    }

    /// Those of a list, what has to be clipped last.
    pub(super) fn of_list(&self, list: impl Iterator<Item = GpuVisibilityTriangle>) -> Vec<GpuVisibilityTriangle> {
        let mut parts = Parts::default();
        self.tell_apart(list, &mut self.projections(), &mut parts);
        parts.single.append(&mut parts.clipped);
        parts.single
    }

    /// Adds triangles to those that need no clipping or to those that do.
    fn tell_apart(
        &self,
        triangles: impl Iterator<Item = GpuVisibilityTriangle>,
        vertices: &mut Projections<'_>,
        parts: &mut Parts,
    ) {
        for triangle in triangles {
            let corners = triangle.corners.map(|corner| self.positions[corner as usize]);
            match self.frustum.place_triangle(corners) {
                Place::Inside if self.may_show(triangle, vertices) => parts.single.push(triangle),
                Place::Crossing => parts.clipped.push(triangle),
                _ => {}
            }
        }
    }

    /// Whether a triangle that needs no clipping may cover a pixel centre and be nearer than what is there.
    fn may_show(&self, triangle: GpuVisibilityTriangle, vertices: &mut Projections<'_>) -> bool {
        let Some(raster) = self.raster.filter(|_| !self.was_visible(triangle)) else { return true };
        let Some(footprint) = raster.footprint(triangle.corners.map(|corner| vertices.at(raster, corner))) else {
            return true;
        };
        match self.occlusion {
            Some(occlusion) => !occlusion.hides(&footprint),
            None => footprint.any(|_, _, _| true),
        }
    }

    fn was_visible(&self, triangle: GpuVisibilityTriangle) -> bool {
        let front = 2 * triangle.id as usize;
        self.visible.get(front..front + 2).is_some_and(|faces| faces[0] || faces[1])
    }

    fn projections(&self) -> Projections<'_> {
        let known = [(NONE, Projected::default()); 256];
        Projections { positions: self.positions, known }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::camera::{Camera, ImageSize, View};
    use glam::Vec2;

    /// A sheet of small triangles, a row after the other, from −8 to 8 across the view.
    fn sheet() -> (Vec<GpuVisibilityTriangle>, Vec<Vec3>) {
        let rows = (0..64).flat_map(|y| (0..64).map(move |x| Vec3::new(x as f32, y as f32, 0.0) * 0.25 - 8.0));
        let positions: Vec<Vec3> = rows.flat_map(|p| [p, p + Vec3::X * 0.2, p + Vec3::Y * 0.2]).collect();
        let corners = (0..positions.len() as u32 / 3).map(|id| ([3 * id, 3 * id + 1, 3 * id + 2], id));
        (corners.map(|(corners, id)| GpuVisibilityTriangle { corners, id }).collect(), positions)
    }

    #[test]
    fn what_may_show_is_drawn_once_and_what_is_clipped_comes_last() {
        let (triangles, positions) = sheet();
        let of = |t: &GpuVisibilityTriangle| t.corners.map(|corner| positions[corner as usize]);
        let clusters = Clusters::new(0, &triangles.iter().map(of).collect::<Vec<_>>());
        let camera = Camera { position: Vec3::ZERO, look_at: Vec3::NEG_Z, up: Vec3::Y, vertical_fov: 50.0 };
        let view = View::new(&camera, ImageSize { width: 960, height: 640 }, 1.0);
        let frustum = Frustum::new(&view, Vec2::ZERO);
        let raster = Raster::new(&view, Vec2::ZERO, Vec3::splat(8.0), 8);
        let survivors = Survivors {
            frustum: &frustum,
            raster: Some(&raster),
            occlusion: None,
            triangles: &triangles,
            positions: &positions,
            visible: &[],
        };
        let place = |id: &u32| frustum.place_triangle(of(&triangles[*id as usize]));
        let may_show: Vec<u32> = (0..triangles.len() as u32).filter(|id| place(id) != Place::Outside).collect();
        for drawn in [survivors.of(&clusters), survivors.of_list(triangles.iter().copied())] {
            let drawn: Vec<u32> = drawn.iter().map(|t| t.id).collect();
            let clipped = drawn.iter().filter(|id| place(id) == Place::Crossing).count();
            assert!((1..may_show.len() / 4).contains(&clipped), "{clipped}");
            assert!(drawn[..drawn.len() - clipped].iter().all(|id| place(id) == Place::Inside));
            let mut once = drawn;
            once.sort_unstable();
            assert_eq!(once, may_show);
        }
    }
}
