//! Light from all around, infinitely far: a picture on the sphere, and how it hangs there.
//!
//! Pictures are equirectangular: the top row lies about `up`, columns go round to the right. Each texel is of one radiance all over where
//! light is computed, so that what is sampled and what a ray meets are the same; where the picture itself is looked at it is filtered.

use super::texel::{Encoding, MAX_VALUE, shared_exponent};
use super::texture::{Texture, Wrap};
use crate::math::luminance;
use glam::{Mat3, Quat, Vec2, Vec3};
use std::f32::consts::{FRAC_1_PI, PI, TAU};
use std::fmt;
use std::sync::Arc;

/// A picture of all directions.
#[derive(Clone)]
pub struct Picture {
    width: u32,
    height: u32,
    /// Radiance, W·sr⁻¹·m⁻², row by row.
    texels: Vec<Vec3>,
    /// The one radiance of all texels, if there is one.
    even: Option<Vec3>,
    /// The same by shared exponent, with its mip chain: to be looked at.
    shown: Texture,
}

/// Texels of a picture of one colour: some, so that directions are drawn from parts of it.
const EVEN: [u32; 2] = [64, 32];

impl Picture {
    /// A picture of texels row by row, radiance in W·sr⁻¹·m⁻².
    ///
    /// # Panics
    /// If there is not one texel, at least, and as many as the sides say.
    #[must_use]
    pub fn new([width, height]: [u32; 2], texels: Vec<Vec3>) -> Self {
        let codes = texels.iter().map(|&texel| shared_exponent(texel)).collect();
        let shown = Texture::encoded("environment".to_owned(), [width, height], codes, Encoding::SharedExponent);
        let even = texels.first().copied().filter(|first| texels.iter().all(|texel| texel == first));
        Self { width, height, texels, even, shown }
    }

    /// The same radiance from everywhere, W·sr⁻¹·m⁻².
    #[must_use]
    pub fn constant(radiance: Vec3) -> Self {
        Self::new(EVEN, vec![radiance; (EVEN[0] * EVEN[1]) as usize])
    }

    /// The same picture with radiance by channel times `factor`.
    #[must_use]
    pub fn times(self, factor: Vec3) -> Self {
        if factor == Vec3::ONE {
            return self;
        }
        let most = Vec3::splat(MAX_VALUE);
        Self::new(self.size(), self.texels.into_iter().map(|texel| (texel * factor).min(most)).collect())
    }

    /// Columns and rows.
    #[must_use]
    pub const fn size(&self) -> [u32; 2] {
        [self.width, self.height]
    }

    /// Radiance of all texels, W·sr⁻¹·m⁻², row by row.
    #[must_use]
    pub fn texels(&self) -> &[Vec3] {
        &self.texels
    }

    /// The one radiance of all texels, W·sr⁻¹·m⁻², if there is one.
    #[must_use]
    pub const fn even(&self) -> Option<Vec3> {
        self.even
    }

    /// The picture as it is looked at.
    #[must_use]
    pub const fn shown(&self) -> &Texture {
        &self.shown
    }

    /// Cosine of the angle to `up` of the upper edge of a row; of the height, −1.
    #[must_use]
    pub fn cosine(&self, row: u32) -> f32 {
        (row as f32 * PI / self.height as f32).cos()
    }

    /// Solid angle of each texel of a row, sr.
    #[must_use]
    pub fn solid_angle(&self, row: u32) -> f32 {
        // By the product, since the difference of two cosines loses digits near the poles.
        let step = std::f64::consts::PI / f64::from(self.height);
        let middle = (f64::from(row) + 0.5) * step;
        (2.0 * middle.sin() * (step * 0.5).sin() * std::f64::consts::TAU / f64::from(self.width)) as f32
    }

    /// Column and row of the texel in a direction of the picture's own frame.
    fn texel_at(&self, own: Vec3) -> [u32; 2] {
        let [u, down] = place(own);
        let index = |share: f32, count: u32| ((share * count as f32) as u32).min(count - 1);
        [index(u, self.width), index(down, self.height)]
    }
}

impl PartialEq for Picture {
    fn eq(&self, other: &Self) -> bool {
        self.size() == other.size() && self.texels == other.texels
    }
}

impl fmt::Debug for Picture {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Picture({} × {})", self.width, self.height)
    }
}

/// Shares of the picture's width and height, from its upper left corner, where a direction of its own frame lies.
fn place(own: Vec3) -> [f32; 2] {
    let turn = own.x.atan2(own.z) / TAU + 0.5;
    [if turn < 1.0 { turn } else { 0.0 }, own.y.clamp(-1.0, 1.0).acos() * FRAC_1_PI]
}

/// A picture and how it hangs in the world.
#[derive(Clone, Debug, PartialEq)]
pub struct Environment {
    /// What is seen.
    pub picture: Arc<Picture>,
    /// Unit directions in the world of what lies a quarter of the picture to the right of its middle, above, and in its middle.
    pub axes: Mat3,
}

impl Environment {
    /// A picture with `up` at its top, turned about that by `rotation`, radians, counter-clockwise seen from above. Unturned, its middle
    /// lies in −z if y is up, and in the direction to which the shortest turn from y to `up` takes that.
    #[must_use]
    pub fn new(picture: Arc<Picture>, up: Vec3, rotation: f32) -> Self {
        Self { picture, axes: axes(up, rotation) }
    }

    /// A picture with its middle in the horizontal direction `forward`.
    #[must_use]
    pub fn facing(picture: Arc<Picture>, up: Vec3, forward: Vec3) -> Self {
        Self { picture, axes: Mat3::from_cols(forward.cross(up), up, forward) }
    }

    /// A direction of the world in the picture's own frame.
    #[must_use]
    pub fn own(&self, direction: Vec3) -> Vec3 {
        self.axes.transpose() * direction
    }

    /// The texel in a unit direction: column and row.
    #[must_use]
    pub fn texel(&self, direction: Vec3) -> [u32; 2] {
        self.picture.texel_at(self.own(direction))
    }

    /// Radiance from a unit direction, W·sr⁻¹·m⁻²: that of the texel there.
    #[must_use]
    pub fn radiance(&self, direction: Vec3) -> Vec3 {
        let [column, row] = self.texel(direction);
        self.picture.texels[(row * self.picture.width + column) as usize]
    }

    /// The picture in a unit direction, filtered over `angle`, radians, W·sr⁻¹·m⁻²: as `glsl/include/sky.glsl` shows it.
    #[must_use]
    pub fn seen(&self, direction: Vec3, angle: f32) -> Vec3 {
        let [u, down] = place(self.own(direction));
        let height = self.picture.height as f32;
        // The poles are the middles of the outer rows: beyond them the opposite rows would show.
        let level = (angle * height * FRAC_1_PI).max(1.0).log2().ceil();
        let margin = (0.5 / (height * (-level).exp2()).floor().max(1.0)).min(0.5);
        let uv = Vec2::new(u, 1.0 - down.clamp(margin, 1.0 - margin));
        let width = Vec2::new(0.0, angle * FRAC_1_PI);
        self.picture.shown.sample_filtered(uv, width, width, [Wrap::Repeat; 2])
    }

    /// Mean luminance over all directions, W·sr⁻¹·m⁻².
    #[must_use]
    pub fn mean_luminance(&self) -> f32 {
        let rows = self.picture.texels.chunks(self.picture.width as usize).zip(0..);
        let of_row = |(row, y): (&[Vec3], u32)| {
            let sum: f64 = row.iter().map(|&texel| f64::from(luminance(texel))).sum();
            sum * f64::from(self.picture.solid_angle(y))
        };
        (rows.map(of_row).sum::<f64>() / (4.0 * std::f64::consts::PI)) as f32
    }
}

/// The axes of a picture with the unit `up` at its top, turned by `rotation`, radians.
fn axes(up: Vec3, rotation: f32) -> Mat3 {
    let turned = Quat::from_rotation_arc(Vec3::Y, up) * Quat::from_rotation_y(rotation);
    Mat3::from_cols(turned * Vec3::X, turned * Vec3::Y, turned * Vec3::NEG_Z)
}

/// The direction that counts as north under the unit `up` unless something else is said: the middle of an unturned picture.
pub(super) fn north(up: Vec3) -> Vec3 {
    axes(up, 0.0).z_axis
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of_columns() -> Picture {
        let texel = |i: u32| Vec3::new((i % 8) as f32, (i / 8) as f32, 1.0);
        Picture::new([8, 4], (0..32).map(texel).collect())
    }

    #[test]
    fn the_middle_lies_ahead_and_columns_go_to_the_right() {
        let environment = Environment::new(Arc::new(of_columns()), Vec3::Y, 0.0);
        let at = |x: f32, y: f32, z: f32| environment.radiance(Vec3::new(x, y, z).normalize());
        assert_eq!(at(0.1, -0.1, -1.0), Vec3::new(4.0, 2.0, 1.0), "ahead is −z");
        assert_eq!(at(1.0, 0.1, 0.1), Vec3::new(6.0, 1.0, 1.0), "right of it is +x");
        assert_eq!(at(-0.1, 9.0, 1.0), Vec3::new(0.0, 0.0, 1.0), "u is 0 behind, on the left");
        assert_eq!(at(0.1, 9.0, 1.0), Vec3::new(7.0, 0.0, 1.0), "and 1 on the right");
        let turned = Environment::new(Arc::new(of_columns()), Vec3::Y, PI / 2.0);
        assert_eq!(turned.radiance(Vec3::new(-1.0, -0.1, -0.1).normalize()), Vec3::new(4.0, 2.0, 1.0), "to the left");
        let z_up = Environment::new(Arc::new(of_columns()), Vec3::Z, 0.0);
        assert_eq!(z_up.radiance(Vec3::new(0.1, 1.0, -0.1).normalize()), Vec3::new(4.0, 2.0, 1.0), "ahead is +y");
    }

    #[test]
    fn rows_fill_the_sphere() {
        for size in [[8, 4], [7, 5], [1, 1], [4096, 2048]] {
            let picture = Picture::new(size, vec![Vec3::ONE; (size[0] * size[1]) as usize]);
            let sum: f64 = (0..size[1]).map(|row| f64::from(picture.solid_angle(row)) * f64::from(size[0])).sum();
            assert!((sum / (4.0 * std::f64::consts::PI) - 1.0).abs() < 1e-5, "{size:?}: {sum}");
        }
    }

    /// No seam where the first column meets the last, and none of the other pole's rows at a pole.
    #[test]
    fn what_is_seen_goes_on_round_the_back_and_stays_at_its_pole() {
        let up = |i: u32| if i < 64 { Vec3::X } else { Vec3::Z };
        let environment = Environment::new(Arc::new(Picture::new([16, 8], (0..128).map(up).collect())), Vec3::Y, 0.3);
        for angle in [0.0, 0.3, 0.6] {
            assert_eq!(environment.seen(Vec3::Y, angle).z, 0.0, "{angle}");
            assert_eq!(environment.seen(Vec3::NEG_Y, angle).x, 0.0, "{angle}");
        }
        let columns = Environment::new(Arc::new(of_columns()), Vec3::Y, 0.0);
        let beside = [-1e-4, 1e-4].map(|x: f32| columns.seen(Vec3::new(x, 0.01, 1.0).normalize(), 0.0).x);
        assert!((beside[0] - 3.5).abs() < 0.02 && (beside[1] - 3.5).abs() < 0.02, "{beside:?}");
    }
}
