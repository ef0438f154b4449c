//! Cameras: the pinhole that both the rasteriser and `reference` look through.

use glam::{Mat4, Vec2, Vec3};

/// A pinhole camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// Eye position, scene units.
    pub position: Vec3,
    /// Point looked at.
    pub look_at: Vec3,
    /// Up vector, any length, not parallel to the view.
    pub up: Vec3,
    /// Full vertical field of view, degrees.
    pub vertical_fov: f32,
}

/// A camera of the scene with its name.
#[derive(Clone, Debug, PartialEq)]
pub struct NamedCamera {
    /// Name, for `--camera`.
    pub name: String,
    /// The camera.
    pub camera: Camera,
}

/// Image size in pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ImageSize {
    /// Width, ≥ 1.
    pub width: u32,
    /// Height, ≥ 1.
    pub height: u32,
}

impl ImageSize {
    /// Number of pixels.
    #[must_use]
    pub const fn pixels(self) -> usize {
        self.width as usize * self.height as usize
    }

    /// Image coordinates of the centre of a pixel, counted row by row from the top left.
    #[must_use]
    pub fn centre_of(self, pixel: usize) -> Vec2 {
        let width = self.width as usize;
        Vec2::new((pixel % width) as f32 + 0.5, (pixel / width) as f32 + 0.5)
    }
}

/// A camera's orthonormal frame scaled to an image: the ray through a pixel is linear in its coordinates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// Eye position.
    pub eye: Vec3,
    /// Unit view direction.
    pub forward: Vec3,
    /// Right, scaled so that NDC x = ±1 are the image's edges at distance 1.
    pub right: Vec3,
    /// Down, scaled likewise (pixel rows grow downwards).
    pub down: Vec3,
    /// Near plane distance, scene units.
    pub near: f32,
    /// Image size.
    pub size: ImageSize,
}

/// The near plane where nothing is before the eye, or nothing near: depth is its inverse, which must not overflow.
const FARTHEST_NEAR: f32 = 1e12;

impl View {
    /// The view of `camera` on an image, for a scene of which nothing is nearer to the eye than `nearest`: half of that way ahead,
    /// even in the corners of the image, the near plane cuts nothing off.
    #[must_use]
    pub fn new(camera: &Camera, size: ImageSize, nearest: f32) -> Self {
        let forward = (camera.look_at - camera.position).normalize_or(Vec3::NEG_Z);
        let side = forward.cross(camera.up);
        let right = if side.length_squared() > 1e-12 { side.normalize() } else { forward.any_orthonormal_vector() };
        let down = forward.cross(right);
        let half_height = (camera.vertical_fov.to_radians() * 0.5).tan();
        let half_width = half_height * size.width as f32 / size.height as f32;
        Self {
            eye: camera.position,
            forward,
            right: right * half_width,
            down: down * half_height,
            near: (nearest * 0.5 / Vec3::new(half_width, half_height, 1.0).length()).min(FARTHEST_NEAR),
            size,
        }
    }

    /// Direction (not unit: its component along `forward` is 1) through image coordinates in pixels;
    /// the centre of the top-left pixel is (0.5, 0.5).
    #[must_use]
    pub fn direction(&self, pixel: Vec2) -> Vec3 {
        let ndc_x = 2.0 * pixel.x / self.size.width as f32 - 1.0;
        let ndc_y = 2.0 * pixel.y / self.size.height as f32 - 1.0;
        self.forward + self.right * ndc_x + self.down * ndc_y
    }

    /// Where a point shows, image coordinates in pixels; `None` if it is not beyond the near plane.
    #[must_use]
    pub fn pixel_of(&self, point: Vec3) -> Option<Vec2> {
        let offset = point - self.eye;
        let distance = offset.dot(self.forward);
        let along = |axis: Vec3| offset.dot(axis) / (axis.length_squared() * distance);
        let size = Vec2::new(self.size.width as f32, self.size.height as f32);
        (distance > self.near).then(|| (Vec2::new(along(self.right), along(self.down)) + 1.0) * 0.5 * size)
    }

    /// SceneContext to Vulkan clip space (y down), reversed depth with an infinite far plane: z/w = near / distance.
    ///
    /// `jitter` shifts the image: pixel (x, y) is sampled at its centre + `jitter` (pixels, each in [−½, ½]).
    #[must_use]
    pub fn clip_from_world(&self, jitter: Vec2) -> Mat4 {
        let (w, h) = (self.right.length(), self.down.length());
        let (r, d, f) = (self.right / (w * w), self.down / (h * h), self.forward);
        let shift = Vec2::new(-2.0 * jitter.x / self.size.width as f32, -2.0 * jitter.y / self.size.height as f32);
        // Rows of the matrix; the shift multiplies w, which is the distance along `forward`.
        let row_x = r + f * shift.x;
        let row_y = d + f * shift.y;
        #[rustfmt::skip]
        let columns = [
            row_x.x, row_y.x, 0.0, f.x,
            row_x.y, row_y.y, 0.0, f.y,
            row_x.z, row_y.z, 0.0, f.z,
            -row_x.dot(self.eye), -row_y.dot(self.eye), self.near, -f.dot(self.eye),
        ];
        Mat4::from_cols_array(&columns)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn projection_and_pixel_rays_agree() {
        let camera = Camera {
            position: Vec3::new(1.0, 2.0, 3.0),
            look_at: Vec3::new(-2.0, 0.5, 1.0),
            up: Vec3::Y,
            vertical_fov: 50.0,
        };
        let size = ImageSize { width: 640, height: 360 };
        let view = View::new(&camera, size, 10.0);
        for (pixel, jitter) in [(Vec2::new(0.5, 0.5), Vec2::ZERO), (Vec2::new(400.5, 77.5), Vec2::new(0.3, -0.4))] {
            let p = view.eye + view.direction(pixel + jitter) * 7.0;
            let clip = view.clip_from_world(jitter) * p.extend(1.0);
            let ndc = clip.truncate() / clip.w;
            let back = Vec2::new((ndc.x + 1.0) * 320.0, (ndc.y + 1.0) * 180.0);
            assert!(back.distance(pixel) < 1e-3, "{back} {pixel}");
            assert!((ndc.z - view.near / 7.0).abs() < 1e-6);
            assert!(view.pixel_of(p).unwrap().distance(pixel + jitter) < 1e-3);
        }
        // Up in the world is up in the image: a smaller row.
        let above = view.clip_from_world(Vec2::ZERO) * (camera.look_at + Vec3::Y).extend(1.0);
        assert!(above.y / above.w < 0.0);
    }
}
