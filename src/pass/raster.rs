//! Where triangles fall on the raster: which pixels they may cover and how near they may come there, however host and device round.

use crate::scene::camera::{ImageSize, View};
use glam::{Mat4, Vec2, Vec3, Vec4Swizzles};
use std::ops::Range;

/// What a clip coordinate may be off by as a share of its summands, on host and device together: four roundings each, of 2⁻²⁴.
const ROUNDING: f32 = 1e-6;
/// What an image coordinate may be off by as a share of the image, by rounding after the projection.
const RASTER_ROUNDING: f32 = 1e-6;
/// A triangle that is no thicker than this many times what its corners may be off by may cover anything between these, at any depth.
const THIN: f32 = 4.0;
/// What depth at a pixel centre may be off by, as a share of what it changes by over what corners may be off by: the plane goes through
/// corners that are off, and the centre may lie outside of the triangle by as much.
const EXTRAPOLATED: f32 = 8.0;

/// The raster of a view.
pub(super) struct Raster {
    clip_from_world: Mat4,
    /// Half of the image's extent, pixels.
    half: Vec2,
    size: ImageSize,
    near: f32,
    /// What x and y, and w, of clip coordinates may be off by.
    rounding: [f32; 2],
    /// What the device moves corners by, pixels.
    snap: f32,
}

/// A point on the raster.
#[derive(Clone, Copy, Default)]
pub(super) struct Projected {
    /// Distance along the view.
    w: f32,
    ndc: Vec2,
}

/// What a triangle may cover.
pub(super) struct Footprint {
    /// Columns and rows of pixels around it.
    pub columns: Range<usize>,
    pub rows: Range<usize>,
    /// Largest reversed depth that it may have anywhere; infinity where its corners do not bound it.
    pub nearest: f32,
    /// Its edges and its depth, unless it is too thin.
    shape: Option<Shape>,
}

/// Functions a x + b y + c of a pixel centre, as (a, b, c).
struct Shape {
    /// Not negative where the triangle may be.
    edges: [Vec3; 3],
    /// Reversed depth, at most.
    depth: Vec3,
    /// What it may be off by.
    margin: f32,
}

impl Footprint {
    /// Whether `shows` holds of a pixel that the triangle may cover, by column, row, and the largest reversed depth that it may have there.
    pub(super) fn any(&self, shows: impl FnMut(usize, usize, f32) -> bool) -> bool {
        self.any_within(self.columns.clone(), self.rows.clone(), shows)
    }

    /// The same of some of its columns and rows.
    pub(super) fn any_within(
        &self,
        columns: Range<usize>,
        mut rows: Range<usize>,
        mut shows: impl FnMut(usize, usize, f32) -> bool,
    ) -> bool {
        let Some(Shape { edges: [a, b, c], depth, .. }) = &self.shape else {
            return rows.any(|y| columns.clone().any(|x| shows(x, y, f32::INFINITY)));
        };
        rows.any(|y| {
            let [at_a, at_b, at_c, at_depth] = [a, b, c, depth].map(|f| f.y * (y as f32 + 0.5) + f.z);
            columns.clone().any(|x| {
                let centre = x as f32 + 0.5;
                let least = (a.x * centre + at_a).min(b.x * centre + at_b).min(c.x * centre + at_c);
                least >= 0.0 && shows(x, y, (depth.x * centre + at_depth).min(self.nearest))
            })
        })
    }
}

impl Raster {
    /// That of a view of a scene whose coordinates are `reach` at most, on a device that snaps to 2⁻ᵇ of a pixel.
    pub(super) fn new(view: &View, jitter: Vec2, reach: Vec3, bits: u32) -> Self {
        let clip_from_world = view.clip_from_world(jitter);
        let summands = |row: usize| {
            let row = clip_from_world.row(row).abs();
            row.xyz().dot(reach) + row.w
        };
        Self {
            clip_from_world,
            half: Vec2::new(view.size.width as f32, view.size.height as f32) * 0.5,
            size: view.size,
            near: view.near,
            rounding: [summands(0).max(summands(1)), summands(3)].map(|sum| ROUNDING * sum),
            snap: 2f32.powi(-(bits as i32)),
        }
    }

    /// Where a point is, wherever it is.
    pub(super) fn project(&self, point: Vec3) -> Projected {
        let clip = self.clip_from_world * point.extend(1.0);
        Projected { w: clip.w, ndc: clip.xy() / clip.w }
    }

    /// The footprint of a triangle; `None` if it may come before the near plane.
    pub(super) fn footprint(&self, corners: [Projected; 3]) -> Option<Footprint> {
        let (w, ndc) = (corners.map(|corner| corner.w), corners.map(|corner| corner.ndc));
        let (least, most) = (w[0].min(w[1]).min(w[2]), w[0].max(w[1]).max(w[2]));
        let [off, off_w] = self.rounding;
        // Not a number counts as nearer.
        let beyond = w.iter().all(|w| w - off_w > self.near);
        if !beyond {
            return None;
        }
        let pixels = ndc.map(|p| (p + 1.0) * self.half);
        let (low, high) = (pixels[0].min(pixels[1]).min(pixels[2]), pixels[0].max(pixels[1]).max(pixels[2]));
        let farthest_out = ndc.iter().fold(1f32, |most, p| most.max(p.abs().max_element()));
        let extent = 2.0 * self.half.max_element();
        let off_pixels = self.snap
            + extent * (RASTER_ROUNDING * farthest_out + 0.5 * (off + farthest_out * off_w) / (least - off_w));
        let depths = w.map(|w| self.near / w);
        let nearest = self.near / least;
        let rounded = nearest * (4.0 * ROUNDING + off_w / (least - off_w));
        let shape = Shape::of(pixels, depths, off_pixels, [nearest - self.near / most, rounded]);
        Some(Footprint {
            columns: centres(low.x - off_pixels, high.x + off_pixels, self.size.width),
            rows: centres(low.y - off_pixels, high.y + off_pixels, self.size.height),
            nearest: nearest + shape.as_ref().map_or(f32::INFINITY, |shape| shape.margin),
            shape,
        })
    }
}

impl Shape {
    /// That of a triangle with such corners and reversed depths, which may be `off` pixels off; depths differ by `range` and are
    /// `rounded` off.
    fn of(corners: [Vec2; 3], depths: [f32; 3], off: f32, [range, rounded]: [f32; 2]) -> Option<Self> {
        let [a, b, c] = corners;
        let area = (b - a).perp_dot(c - a);
        let longest = (b - a).length_squared().max((c - b).length_squared()).max((a - c).length_squared()).sqrt();
        let height = area.abs() / longest;
        // Not a number counts as thin.
        let thick = height > THIN * off;
        let edge = |from: Vec2, to: Vec2| {
            let along = (to - from) * area.signum();
            let margin = off * (along.x.abs() + along.y.abs());
            Vec3::new(-along.y, along.x, along.y * from.x - along.x * from.y + margin)
        };
        let [da, db, dc] = depths;
        let slope = ((b - a) * (dc - da) - (c - a) * (db - da)).perp() / area;
        let margin = EXTRAPOLATED * range * off / height + rounded;
        let depth = slope.extend(da - slope.dot(a) + margin);
        thick.then_some(Self { edges: [edge(a, b), edge(b, c), edge(c, a)], depth, margin })
    }
}

/// Pixels along an axis whose centres lie from `low` to `high`.
fn centres(low: f32, high: f32, pixels: u32) -> Range<usize> {
    // Conversion saturates.
    let (first, last) = ((low - 0.5).ceil() as usize, (high + 0.5).floor().max(0.0) as usize);
    first.min(pixels as usize)..last.min(pixels as usize)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::camera::Camera;
    use glam::{DVec2, DVec3};

    const SIZE: ImageSize = ImageSize { width: 40, height: 30 };

    fn view() -> View {
        let camera = Camera {
            position: Vec3::new(1.0, 2.0, 3.0),
            look_at: Vec3::new(0.0, 1.0, -4.0),
            up: Vec3::Y,
            vertical_fov: 60.0,
        };
        View::new(&camera, SIZE, 0.1)
    }

    /// Triangles of all sizes before the eye.
    fn triangles() -> impl Iterator<Item = [Vec3; 3]> {
        let share = |i: u32, bits: u32| (i.wrapping_mul(2_654_435_761) >> bits & 0xff) as f32 / 255.0 - 0.5;
        let point = move |i: u32| Vec3::new(share(i, 0), share(i, 8), share(i, 16));
        (0..4000).map(move |i| {
            let centre = point(7 * i) * Vec3::new(3.0, 3.0, 4.0) + Vec3::new(0.0, 1.0, -2.0);
            let size = [0.02, 0.1, 0.5, 2.0][i as usize % 4];
            [1, 2, 3].map(|k| centre + point(7 * i + k) * size)
        })
    }

    /// Depth of a triangle at a pixel centre that it covers, in f64.
    fn covered(view: &View, corners: [Vec3; 3], x: usize, y: usize) -> Option<f64> {
        let axes = [view.right, view.down, view.forward].map(Vec3::as_dvec3);
        let place = |p: Vec3| {
            let offset = p.as_dvec3() - view.eye.as_dvec3();
            let along = |k: usize| offset.dot(axes[k]) / axes[k].length_squared();
            let ndc = DVec2::new(along(0), along(1)) / along(2);
            ((ndc + 1.0) * 0.5 * DVec2::new(40.0, 30.0)).extend(f64::from(view.near) / along(2))
        };
        let [a, b, c] = corners.map(place);
        let p = DVec3::new(x as f64 + 0.5, y as f64 + 0.5, 0.0);
        let twice = |a: DVec3, b: DVec3, c: DVec3| (b - a).truncate().perp_dot((c - a).truncate());
        let area = twice(a, b, c);
        let weights = DVec3::new(twice(b, c, p), twice(c, a, p), twice(a, b, p)) / area;
        (weights.min_element() >= 0.0).then(|| weights.dot(DVec3::new(a.z, b.z, c.z)))
    }

    #[test]
    fn footprints_hold_what_triangles_cover_and_little_more() {
        let view = view();
        let raster = Raster::new(&view, Vec2::ZERO, Vec3::splat(4.0), 8);
        let (mut inside, mut told, mut empty) = (0, 0, 0);
        for corners in triangles() {
            let Some(footprint) = raster.footprint(corners.map(|p| raster.project(p))) else { continue };
            let mut depths = vec![None; SIZE.pixels()];
            footprint.any(|x, y, depth| {
                depths[y * 40 + x] = Some(f64::from(depth));
                false
            });
            told += depths.iter().flatten().count();
            empty += usize::from(depths.iter().all(Option::is_none));
            for (x, y) in (0..30).flat_map(|y| (0..40).map(move |x| (x, y))) {
                let Some(depth) = covered(&view, corners, x, y) else { continue };
                inside += 1;
                let most = depths[y * 40 + x].unwrap();
                assert!(most >= depth, "{most} {depth}");
                assert!(most <= depth * 1.02 + 1e-3 || most.is_infinite(), "{most} {depth}");
            }
        }
        assert!(told >= inside && told < inside + inside / 20 + 60, "{told} for {inside}");
        assert!(empty > 600, "{empty} between pixel centres");
    }

    #[test]
    fn what_comes_before_the_near_plane_has_no_footprint() {
        let view = view();
        let raster = Raster::new(&view, Vec2::ZERO, Vec3::splat(4.0), 8);
        let far = view.eye + view.forward * 2.0;
        let has_one = |third: Vec3| raster.footprint([far, far + Vec3::X, third].map(|p| raster.project(p))).is_some();
        assert!(!has_one(view.eye) && !has_one(view.eye - view.forward) && !has_one(Vec3::NAN));
        assert!(has_one(far + Vec3::Y));
    }
}
