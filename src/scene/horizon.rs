//! The horizon along a camera path: level, but for a turn where the view passes the camera's `up` or its opposite, the
//! poles, where no horizon is.
//!
//! Beyond a pole the level picture is turned by up to half a turn against the one before it. About a near pass the picture
//! is carried along without turning about the view (parallel transport), and what is then left to the level one is added
//! over the whole stretch, in proportion to how far the view has swung: it rests where the camera rests.

use super::camera::Camera;
use super::camera_path::CameraPath;
use super::report::Report;
use crate::error::{Error, Result};
use glam::{DQuat, DVec3, Vec3};
use std::f64::consts::PI;
use std::path::Path;

/// A view passes a pole if it comes nearer than this, radians. At this distance the level picture turns about six times as
/// fast as the view swings.
const NEAR: f64 = 10.0 * PI / 180.0;

/// How far the view swings before and after the pole itself while the picture turns, radians; less after a wider pass.
const SWING: f64 = 30.0 * PI / 180.0;

/// Sines below which two directions are parallel, as for the camera of a scene file.
const PARALLEL: f64 = 1e-6;

/// Samples of the path between two keys.
const SAMPLES: u32 = 256;

/// Where the path passes a pole, and how the picture turns there.
#[derive(Clone, Debug, PartialEq)]
pub struct Horizon {
    passes: Vec<Pass>,
}

/// A moment of the path.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Sample {
    /// Seconds.
    time: f32,
    /// Unit view direction.
    view: DVec3,
    /// How far the view has swung since the start of the path, radians.
    swung: f64,
    /// Angle to the nearer pole, radians.
    from_pole: f64,
}

/// A stretch of the path about a pole.
#[derive(Clone, Debug, PartialEq)]
struct Pass {
    /// Its time, seconds; infinite where the path starts or ends in it.
    from: f32,
    to: f32,
    /// Each with the picture's right side, carried along.
    samples: Vec<(Sample, DVec3)>,
    /// Turn about the view that the last sample lacks to be level, radians.
    turn: f64,
}

impl Horizon {
    /// Follows a path read from `file`, of a camera whose top is `up`.
    ///
    /// # Errors
    /// [`Error::Input`] where the path has no view that could be drawn: the camera passes through the point that it looks at,
    /// or looks along `up` from the start to the end.
    pub fn of(path: &CameraPath, up: Vec3, file: &Path) -> Result<Self> {
        let refuse = |line: Option<u32>, message: String| {
            let mut report = Report::default();
            report.error(file, line, message);
            Error::Input(report)
        };
        let up = up.as_dvec3().normalize_or(DVec3::Y);
        let samples = sample(path, up).map_err(|(line, message)| refuse(Some(line), message))?;
        let farthest = samples.iter().map(|s| s.from_pole).fold(0.0, f64::max);
        if farthest < PARALLEL {
            let message = "the view is parallel to the camera's up all along the path: give the scene's camera, by its up, \
                the direction that is to be at the top of the picture";
            return Err(refuse(path.keys.first().map(|key| key.line), message.into()));
        }
        let near = near_poles(&samples);
        let stretches = near.chunk_by(|a, b| a.1 == b.1).filter(|stretch| stretch[0].1);
        let pass = |stretch: &[(usize, bool)]| Pass::over(&samples, stretch[0].0, stretch[stretch.len() - 1].0, up);
        Ok(Self { passes: stretches.map(pass).collect() })
    }

    /// The camera of the path at `time`, seconds, with the top of its picture.
    #[must_use]
    pub fn hold(&self, time: f32, camera: Camera) -> Camera {
        let here = |pass: &&Pass| pass.from < time && time < pass.to;
        match self.passes.iter().find(here) {
            Some(pass) => Camera { up: pass.up(time, direction(&camera)).as_vec3(), ..camera },
            None => camera,
        }
    }
}

impl Pass {
    /// The stretch from sample `first` to `last`, both near a pole, with the level samples beside it.
    fn over(samples: &[Sample], first: usize, last: usize, up: DVec3) -> Self {
        let (start, end) = (first.saturating_sub(1), (last + 1).min(samples.len() - 1));
        let stretch = &samples[start..=end];
        let level = |k: usize| stretch[k].view.cross(up).normalize_or_zero();
        let is_level = |k: usize| stretch[k].from_pole >= NEAR;
        let end_of_stretch = stretch.len() - 1;
        // The picture is level at both ends, or at the one that has a horizon, or where the horizon is clearest.
        let clearest = || (0..=end_of_stretch).max_by(|&a, &b| stretch[a].from_pole.total_cmp(&stretch[b].from_pole));
        let anchor = [0, end_of_stretch].into_iter().find(|&k| is_level(k)).or_else(clearest).unwrap_or(0);
        let mut right = vec![level(anchor); stretch.len()];
        for k in anchor..end_of_stretch {
            right[k + 1] = carry(right[k], stretch[k].view, stretch[k + 1].view);
        }
        for k in (0..anchor).rev() {
            right[k] = carry(right[k + 1], stretch[k + 1].view, stretch[k].view);
        }
        let both = anchor == 0 && is_level(end_of_stretch);
        let turn =
            if both { turn(right[end_of_stretch], level(end_of_stretch), stretch[end_of_stretch].view) } else { 0.0 };
        Self {
            from: if first == 0 { f32::NEG_INFINITY } else { stretch[0].time },
            to: if last + 1 == samples.len() { f32::INFINITY } else { stretch[end_of_stretch].time },
            samples: stretch.iter().copied().zip(right).collect(),
            turn,
        }
    }

    /// The top of the picture at `time`, when the camera looks in direction `view`.
    fn up(&self, time: f32, view: DVec3) -> DVec3 {
        let (first, last) = (&self.samples[0].0, &self.samples[self.samples.len() - 1].0);
        let next = self.samples.partition_point(|(sample, _)| sample.time <= time);
        let (before, right) = self.samples[next.saturating_sub(1)];
        let right = carry(right, before.view, view);
        let swing = last.swung - first.swung;
        let done = before.swung + before.view.angle_between(view) - first.swung;
        let share = if swing > 0.0 { (done / swing).clamp(0.0, 1.0) } else { 0.0 };
        let turned = share * share * (3.0 - 2.0 * share) * self.turn;
        (DQuat::from_axis_angle(view, turned) * right).cross(view)
    }
}

/// Unit view direction of a camera; zero where it looks at itself.
fn direction(camera: &Camera) -> DVec3 {
    (camera.look_at.as_dvec3() - camera.position.as_dvec3()).normalize_or_zero()
}

/// Moments of a path in order, or the line of a key and what is wrong on the way to it.
fn sample(path: &CameraPath, up: DVec3) -> Result<Vec<Sample>, (u32, String)> {
    let base = Camera { position: Vec3::ZERO, look_at: Vec3::X, up: Vec3::Y, vertical_fov: 45.0 };
    let steps = path.keys.windows(2).flat_map(|pair| {
        let (start, span) = (pair[0].time, pair[1].time - pair[0].time);
        (0..SAMPLES).map(move |i| (start + span * i as f32 / SAMPLES as f32, pair[1].line))
    });
    let end = path.keys.last().map(|key| (key.time, key.line));
    let mut samples: Vec<Sample> = Vec::new();
    for (time, line) in steps.chain(end) {
        let view = direction(&path.camera_at(time, &base));
        let before = samples.last().map_or((view, 0.0), |s| (s.view, s.swung));
        if view == DVec3::ZERO || view.dot(before.0) < 0.0 {
            let message = format!(
                "on the way to this key, at {time:.3} s, the camera passes through the point that it looks at: keep them apart"
            );
            return Err((line, message));
        }
        let swung = before.1 + before.0.angle_between(view);
        samples.push(Sample { time, view, swung, from_pole: view.cross(up).length().atan2(view.dot(up).abs()) });
    }
    Ok(samples)
}

/// Which samples belong to a pass: those from which no more than [`SWING`] leads to a pole, less where it is passed at a
/// distance.
fn near_poles(samples: &[Sample]) -> Vec<(usize, bool)> {
    let mut left: Vec<f64> = samples.iter().map(|s| SWING * (1.0 - s.from_pole / NEAR).max(0.0)).collect();
    let spent = |k: usize| samples[k].swung - samples[k - 1].swung;
    for k in 1..samples.len() {
        left[k] = left[k].max(left[k - 1] - spent(k));
    }
    for k in (1..samples.len()).rev() {
        left[k - 1] = left[k - 1].max(left[k] - spent(k));
    }
    left.into_iter().map(|left| left > 0.0).enumerate().collect()
}

/// Carries the picture's right side along, from one view to the next, without turning it about the view.
fn carry(right: DVec3, from: DVec3, to: DVec3) -> DVec3 {
    (DQuat::from_rotation_arc(from, to) * right).reject_from_normalized(to).normalize_or(right)
}

/// Angle about `axis` from one direction to another, in (−π, π]; half a turn is always positive, whatever is rounded.
fn turn(from: DVec3, to: DVec3, axis: DVec3) -> f64 {
    const ROUNDED: f64 = 1e-3;
    let angle = axis.dot(from.cross(to)).atan2(from.dot(to));
    if angle < ROUNDED - PI { angle + 2.0 * PI } else { angle }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::camera::{ImageSize, View};
    use crate::scene::camera_path::CameraKey;

    const BASE: Camera = Camera { position: Vec3::ZERO, look_at: Vec3::X, up: Vec3::Y, vertical_fov: 30.0 };

    fn path(keys: &[(f32, [f32; 3], [f32; 3])]) -> CameraPath {
        let key = |(line, &(time, position, look_at)): (u32, &(f32, [f32; 3], [f32; 3]))| CameraKey {
            time,
            position: position.into(),
            look_at: look_at.into(),
            line,
        };
        CameraPath { keys: (1..).zip(keys).map(key).collect(), edits: Vec::new() }
    }

    /// From the front over the top to the back; `aside` moves the top.
    fn over(aside: f32) -> CameraPath {
        path(&[
            (0.0, [0., 2., 12.], [0., 1.5, 0.]),
            (1.0, [aside, 12., 0.], [0.; 3]),
            (2.0, [0., 2., -12.], [0., 1.5, 0.]),
        ])
    }

    fn horizon(path: &CameraPath) -> Horizon {
        Horizon::of(path, Vec3::Y, Path::new("p.toml")).expect("accepted")
    }

    fn frame(path: &CameraPath, horizon: &Horizon, time: f32) -> [Vec3; 3] {
        let camera = horizon.hold(time, path.camera_at(time, &BASE));
        let view = View::new(&camera, ImageSize { width: 16, height: 16 }, 10.0);
        [view.forward, view.right.normalize(), view.down.normalize()]
    }

    /// Largest turn of the picture about the view between neighbouring moments, and largest swing, degrees.
    fn fastest(path: &CameraPath) -> (f32, f32) {
        let horizon = horizon(path);
        let frames: Vec<_> = (0..=4000).map(|i| frame(path, &horizon, path.duration() * i as f32 / 4000.0)).collect();
        let swing = |w: &[[Vec3; 3]]| w[0][0].angle_between(w[1][0]);
        let turn = |w: &[[Vec3; 3]]| w[0][1].angle_between(w[1][1]).max(w[0][2].angle_between(w[1][2]));
        let largest = |of: &dyn Fn(&[[Vec3; 3]]) -> f32| frames.windows(2).map(of).fold(0.0, f32::max).to_degrees();
        (largest(&turn), largest(&swing))
    }

    #[test]
    fn the_picture_turns_smoothly_however_near_the_pole_is_passed() {
        for aside in [0.0, 1e-4, 0.02, 0.3, 1.0, 1.9, 2.1, 2.5, 5.0] {
            let (turn, swing) = fastest(&over(aside));
            assert!(swing < 0.1 && turn < 7.0 * swing, "{aside}: {turn} degrees with a swing of {swing}");
        }
        let straight = [0., 15., 0.];
        for end in [[0.0; 3], [1e-5, 0., 1e-5], [0., 0., 2.]] {
            let (turn, swing) = fastest(&path(&[(0.0, [6., 2., 10.], [0., 1.5, 0.]), (1.0, straight, end)]));
            assert!(swing < 0.1 && turn < 7.0 * swing, "{end:?}: {turn} degrees with a swing of {swing}");
        }
    }

    #[test]
    fn the_horizon_is_level_away_from_the_poles() {
        for aside in [0.0, 0.3, 1.9, 5.0] {
            let path = over(aside);
            let horizon = horizon(&path);
            for i in 0..=200 {
                let time = i as f32 / 100.0;
                let [forward, right, down] = frame(&path, &horizon, time);
                if forward.y.abs() < 40_f32.to_radians().cos() {
                    assert!(right.y.abs() < 1e-6 && down.y < 0.0, "{aside}, {time} s: {right}");
                    assert_eq!(horizon.hold(time, path.camera_at(time, &BASE)).up, Vec3::Y);
                }
            }
        }
        // Half a turn, half of it done above the middle.
        let path = over(0.0);
        let [_, right, _] = frame(&path, &horizon(&path), 1.0);
        assert!(right.x.abs() < 1e-3, "{right}");
    }

    #[test]
    fn the_way_down_to_a_pole_ends_with_the_flight_at_the_top() {
        let path = path(&[(0.0, [0., 2., 10.], [0., 1.5, 0.]), (1.0, [0., 15., 0.], [0.; 3])]);
        let [forward, right, down] = frame(&path, &horizon(&path), 5.0);
        assert!(forward.distance(Vec3::NEG_Y) < 1e-6 && down.distance(Vec3::Z) < 1e-3, "{right} {down}");
    }

    #[test]
    fn a_rest_above_the_middle_is_still() {
        let (front, top, back) = ([0., 0., 12.], [0., 12., 0.], [0., 0., -12.]);
        let path = path(&[(0.0, front, [0.; 3]), (1.0, top, [0.; 3]), (3.0, top, [0.; 3]), (4.0, back, [0.; 3])]);
        let horizon = horizon(&path);
        let still = frame(&path, &horizon, 1.0);
        for time in [1.25, 2.0, 2.99, 3.0] {
            assert_eq!(frame(&path, &horizon, time), still, "{time}");
        }
    }

    #[test]
    fn paths_without_a_view_are_refused() {
        let line = |path: &CameraPath, up| match Horizon::of(path, up, Path::new("p.toml")) {
            Err(Error::Input(report)) => report.faults[0].to_string(),
            other => panic!("{other:?}"),
        };
        let down = path(&[(0.0, [0., 9., 0.], [0.; 3]), (1.0, [5., 9., 0.], [5., 0., 0.])]);
        let said = line(&down, Vec3::Y);
        assert!(said.starts_with("p.toml:1: error: the view is parallel to the camera's up"), "{said}");
        assert!(Horizon::of(&down, Vec3::Z, Path::new("p.toml")).is_ok());
        let through = path(&[(0.0, [0., 0., 4.], [0.; 3]), (1.0, [0., 0., -4.], [0.; 3])]);
        let said = line(&through, Vec3::Y);
        assert!(
            said.starts_with("p.toml:2: error: on the way to this key, at 0.500 s, the camera passes through"),
            "{said}"
        );
    }
}
