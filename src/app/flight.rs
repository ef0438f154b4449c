//! How a camera is moved: flying, turning, orbiting, panning. Positions in scene units, angles in degrees.

use crate::scene::camera::Camera;
use glam::{Quat, Vec3};

/// How near the view may come to straight up or down, degrees: nearer, the horizon would spin.
const FROM_POLE: f32 = 1.0;

/// A camera with how it moves.
#[derive(Clone, Debug, PartialEq)]
pub struct Flight {
    /// Where it is.
    pub camera: Camera,
    /// Velocity in multiples of the speed: right, up, forward.
    pub velocity: Vec3,
    /// Scene units a second.
    pub speed: f32,
    /// What orbit, pan and dolly go about; `None` for a point ahead.
    pub pivot: Option<Vec3>,
}

impl Flight {
    /// A camera at rest.
    #[must_use]
    pub const fn new(camera: Camera, speed: f32) -> Self {
        Self { camera, velocity: Vec3::ZERO, speed, pivot: None }
    }

    /// Unit direction of the view.
    #[must_use]
    pub fn forward(&self) -> Vec3 {
        (self.camera.look_at - self.camera.position).normalize_or(Vec3::NEG_Z)
    }

    /// Distance of the point looked at.
    #[must_use]
    pub fn reach(&self) -> f32 {
        self.camera.look_at.distance(self.camera.position)
    }

    fn up(&self) -> Vec3 {
        self.camera.up.normalize_or(Vec3::Y)
    }

    fn right(&self) -> Vec3 {
        let (forward, up) = (self.forward(), self.up());
        forward.cross(up).try_normalize().unwrap_or_else(|| forward.any_orthonormal_vector())
    }

    /// Whether it moves by itself.
    #[must_use]
    pub fn is_moving(&self) -> bool {
        self.velocity != Vec3::ZERO
    }

    /// Flies on for so many seconds: in one go or in many, it comes to the same place.
    pub fn fly(&mut self, seconds: f32) {
        let Vec3 { x, y, z } = self.velocity * self.speed * seconds;
        self.shift(self.right() * x + self.up() * y + self.forward() * z);
    }

    /// Turns the view to the right and down.
    pub fn look(&mut self, [right, down]: [f32; 2]) {
        let turned = self.turn(right, down) * (self.camera.look_at - self.camera.position);
        self.camera.look_at = self.camera.position + turned;
    }

    /// Turns the scene to the right and down about the pivot, as if it were dragged.
    pub fn orbit(&mut self, [right, down]: [f32; 2]) {
        let (turn, pivot) = (self.turn(right, down), self.pivot());
        self.camera.position = pivot + turn * (self.camera.position - pivot);
        self.camera.look_at = pivot + turn * (self.camera.look_at - pivot);
    }

    /// Shifts the scene so that the pivot moves to the right and down by these shares of the image's height.
    pub fn pan(&mut self, [right, down]: [f32; 2]) {
        let ahead = (self.pivot() - self.camera.position).dot(self.forward());
        let depth = if ahead > 0.0 { ahead } else { self.reach() };
        let height = 2.0 * depth * (self.camera.vertical_fov.to_radians() * 0.5).tan();
        let image_up = self.right().cross(self.forward());
        self.shift((image_up * down - self.right() * right) * height);
    }

    /// Multiplies the distance from the pivot.
    pub fn dolly(&mut self, factor: f32) {
        self.shift((self.pivot() - self.camera.position) * (1.0 - factor));
    }

    /// Looks at a point, unless that is straight above or below, or where the camera is.
    pub fn look_at(&mut self, point: Vec3) {
        let towards = (point - self.camera.position).normalize_or_zero();
        if towards.cross(self.up()).length() > FROM_POLE.to_radians().sin() {
            self.camera.look_at = point;
        }
    }

    /// Steps back along the view until a box is in it, in images of a width over height; the point looked at is the box's centre then.
    pub fn frame(&mut self, (lo, hi): (Vec3, Vec3), aspect: f32) {
        let half_height = (self.camera.vertical_fov.to_radians() * 0.5).tan();
        let narrower = (half_height * aspect.min(1.0)).atan();
        let distance = ((hi - lo).length() * 0.5).max(f32::MIN_POSITIVE) / narrower.sin();
        let (centre, forward) = (lo.midpoint(hi), self.forward());
        self.camera = Camera { position: centre - forward * distance, look_at: centre, ..self.camera };
    }

    fn pivot(&self) -> Vec3 {
        self.pivot.unwrap_or(self.camera.look_at)
    }

    /// Moves it, and what it looks at.
    pub fn shift(&mut self, by: Vec3) {
        self.camera.position += by;
        self.camera.look_at += by;
    }

    /// The rotation that turns the view to the right about the vertical, and down, kept off the poles.
    fn turn(&self, right: f32, down: f32) -> Quat {
        let from_up = self.forward().angle_between(self.up()).to_degrees();
        let turned = (from_up + down).clamp(FROM_POLE.min(from_up), (180.0 - FROM_POLE).max(from_up));
        let pitch = Quat::from_axis_angle(self.right(), (from_up - turned).to_radians());
        Quat::from_axis_angle(self.up(), -right.to_radians()) * pitch
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::camera::{ImageSize, View};
    use glam::Vec2;

    const SIZE: ImageSize = ImageSize { width: 400, height: 300 };

    fn flight() -> Flight {
        let camera =
            Camera { position: Vec3::new(0.0, 1.0, 5.0), look_at: Vec3::Y, up: Vec3::Y * 2.0, vertical_fov: 60.0 };
        Flight::new(camera, 2.0)
    }

    fn view(flight: &Flight) -> View {
        View::new(&flight.camera, SIZE, 0.1)
    }

    fn assert_near(a: Vec3, b: Vec3) {
        assert!(a.distance(b) < 1e-4, "{a} is not {b}");
    }

    #[test]
    fn motion_does_not_depend_on_the_frame_rate() {
        let mut once = flight();
        once.velocity = Vec3::new(1.0, 0.5, 3.0);
        let mut often = once.clone();
        once.fly(1.0);
        (0..240).for_each(|_| often.fly(1.0 / 240.0));
        assert_near(once.camera.position, often.camera.position);
        assert_near(once.camera.position, Vec3::new(2.0, 2.0, -1.0));
        assert!((once.reach() - 5.0).abs() < 1e-5);
    }

    #[test]
    fn looking_turns_on_the_spot_and_stops_short_of_the_poles() {
        let mut flight = flight();
        flight.look([90.0, 0.0]);
        assert_near(flight.forward(), Vec3::X);
        flight.look([0.0, 45.0]);
        assert_near(flight.forward(), Vec3::new(1.0, -1.0, 0.0).normalize());
        flight.look([0.0, 500.0]);
        assert!(flight.forward().y > -1.0 && flight.forward().y < -0.999, "{}", flight.forward());
        flight.look([0.0, -1000.0]);
        assert!(flight.forward().y < 1.0 && flight.forward().y > 0.999, "{}", flight.forward());
        assert_eq!(flight.camera.position, Vec3::new(0.0, 1.0, 5.0));
    }

    #[test]
    fn a_view_straight_down_can_be_left() {
        let mut flight = flight();
        flight.camera.look_at = flight.camera.position - Vec3::Y;
        flight.look([0.0, -30.0]);
        assert!((flight.forward().angle_between(Vec3::NEG_Y).to_degrees() - 30.0).abs() < 0.1);
        assert!(flight.camera.look_at.is_finite());
    }

    #[test]
    fn orbiting_keeps_the_pivot_where_it_is_in_the_image() {
        let mut flight = flight();
        let pivot = Vec3::new(0.7, 0.2, 1.0);
        flight.pivot = Some(pivot);
        let before = view(&flight).pixel_of(pivot).unwrap();
        flight.orbit([40.0, 10.0]);
        let after = view(&flight).pixel_of(pivot).unwrap();
        assert!(before.distance(after) < 0.05, "{before} {after}");
        // What lies before the pivot went to the right and down: so the camera went to the left and up.
        assert!(flight.camera.position.x < 0.0 && flight.camera.position.y > 1.0, "{}", flight.camera.position);
    }

    #[test]
    fn panning_moves_the_pivot_with_the_cursor() {
        let mut flight = flight();
        let pivot = Vec3::new(0.3, 0.4, -1.0);
        flight.pivot = Some(pivot);
        let before = view(&flight).pixel_of(pivot).unwrap();
        flight.pan([0.25, -0.1]);
        let after = view(&flight).pixel_of(pivot).unwrap();
        let moved = (after - before) / SIZE.height as f32;
        assert!(moved.distance(Vec2::new(0.25, -0.1)) < 1e-3, "{moved}");
    }

    #[test]
    fn dolly_goes_towards_the_pivot_which_stays_in_place() {
        let mut flight = flight();
        let pivot = Vec3::new(0.3, 0.4, -1.0);
        flight.pivot = Some(pivot);
        let before = (view(&flight).pixel_of(pivot).unwrap(), flight.camera.position.distance(pivot));
        flight.dolly(0.5);
        assert!(view(&flight).pixel_of(pivot).unwrap().distance(before.0) < 0.05);
        assert!((flight.camera.position.distance(pivot) / before.1 - 0.5).abs() < 1e-5);
    }

    #[test]
    fn framing_shows_all_corners_in_wide_and_tall_images() {
        let (lo, hi) = (Vec3::new(-3.0, 0.0, -1.0), Vec3::new(2.0, 4.0, 9.0));
        for size in [SIZE, ImageSize { width: 100, height: 300 }] {
            let mut flight = flight();
            flight.look([30.0, 20.0]);
            let forward = flight.forward();
            flight.frame((lo, hi), size.width as f32 / size.height as f32);
            assert_near(flight.forward(), forward);
            let view = View::new(&flight.camera, size, 0.1);
            for corner in 0..8 {
                let pick = |bit: u32, axis: usize| if corner >> bit & 1 == 1 { hi[axis] } else { lo[axis] };
                let pixel = view.pixel_of(Vec3::new(pick(0, 0), pick(1, 1), pick(2, 2))).unwrap();
                assert!(pixel.x >= 0.0 && pixel.x <= size.width as f32, "{pixel}");
                assert!(pixel.y >= 0.0 && pixel.y <= size.height as f32, "{pixel}");
            }
        }
    }

    #[test]
    fn centring_looks_at_the_point_but_never_straight_up() {
        let mut flight = flight();
        let before = flight.camera;
        flight.look_at(before.position + Vec3::Y * 3.0);
        flight.look_at(before.position);
        assert_eq!(flight.camera, before);
        flight.look_at(Vec3::new(1.0, 2.0, 0.0));
        assert_near(flight.camera.look_at, Vec3::new(1.0, 2.0, 0.0));
    }
}
