//! Triangles of clusters that cross the view frustum, told apart one by one for each view: what lies outside is not drawn, and
//! what has to be clipped is drawn apart.
//!
//! Only for a software rasteriser, which clips slowly (docs/lavapipe.md); the host's work grows with what crosses the frustum.

use super::clusters::Clusters;
use super::frustum::{Frustum, Place};
use super::shared::GpuVisibilityTriangle;
use glam::Vec3;
use std::ops::Range;

/// What tells them apart.
pub(super) struct Crossing<'a> {
    pub frustum: &'a Frustum,
    /// All triangles in drawing order.
    pub triangles: &'a [GpuVisibilityTriangle],
    /// Positions of the scene's vertices.
    pub positions: &'a [Vec3],
}

impl Crossing<'_> {
    /// Draws, as (first triangle, triangles), of what may show: whole clusters, then single triangles that need no clipping, then
    /// those that do; the single ones are appended to `copies`, of which the first is drawn as the triangle after the last.
    pub(super) fn draws(&self, clusters: &Clusters, copies: &mut Vec<GpuVisibilityTriangle>) -> Vec<(u32, u32)> {
        let mut draws = clusters.draws(self.frustum, &[Place::Inside]);
        let mut clipped = Vec::new();
        let first = copies.len();
        for range in crossing(clusters, self.frustum) {
            for &triangle in &self.triangles[range] {
                match self.place(triangle) {
                    Place::Inside => copies.push(triangle),
                    Place::Crossing => clipped.push(triangle),
                    Place::Outside => {}
                }
            }
        }
        let middle = copies.len();
        copies.append(&mut clipped);
        for range in [first..middle, middle..copies.len()] {
            draws.push(((self.triangles.len() + range.start) as u32, range.len() as u32));
        }
        draws
    }

    fn place(&self, triangle: GpuVisibilityTriangle) -> Place {
        self.frustum.place_triangle(triangle.corners.map(|corner| self.positions[corner as usize]))
    }
}

fn crossing(clusters: &Clusters, frustum: &Frustum) -> impl Iterator<Item = Range<usize>> {
    clusters.places(frustum).filter(|(_, place)| *place == Place::Crossing).map(|(range, _)| range)
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
        let view = View::new(&camera, ImageSize { width: 96, height: 64 }, 1.0);
        let frustum = Frustum::new(&view, Vec2::ZERO);
        let crossing = Crossing { frustum: &frustum, triangles: &triangles, positions: &positions };
        let mut copies = vec![triangles[0]]; // of another list of clusters
        let draws = crossing.draws(&clusters, &mut copies);

        let all: Vec<_> = triangles.iter().chain(&copies).collect();
        let drawn = |draws: &[(u32, u32)]| -> Vec<u32> {
            draws.iter().flat_map(|&(first, count)| &all[first as usize..][..count as usize]).map(|t| t.id).collect()
        };
        let place = |id: &u32| frustum.place_triangle(of(&triangles[*id as usize]));
        let (clipped, whole) = draws.split_last().unwrap();
        assert!(drawn(whole).iter().all(|id| place(id) == Place::Inside));
        assert!(drawn(&[*clipped]).iter().all(|id| place(id) == Place::Crossing));
        let mut once = drawn(&draws);
        once.sort_unstable();
        let may_show: Vec<u32> = (0..triangles.len() as u32).filter(|id| place(id) != Place::Outside).collect();
        assert_eq!(once, may_show);
        assert!((1..may_show.len() as u32 / 4).contains(&clipped.1), "{clipped:?}");
    }
}
