//! A camera's flight, and edits of lights on the way: the file of `--camera-path`.

use super::camera::Camera;
use super::input;
use super::light::{Light, LightState, why_fixed};
use super::report::Report;
use super::toml_walk::{At, Document, Table, nearest};
use crate::error::{Error, Result};
use glam::{DVec3, Vec3};
use std::path::Path;

/// A camera path: keys at ascending times, and edits of lights.
#[derive(Clone, Debug, PartialEq)]
pub struct CameraPath {
    /// Keys in order of time; never empty.
    pub keys: Vec<CameraKey>,
    /// Edits in order of time.
    pub edits: Vec<LightEdit>,
}

/// Where the camera is at a time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CameraKey {
    /// Time from the start, seconds.
    pub time: f32,
    /// Eye position, scene units.
    pub position: Vec3,
    /// Point looked at.
    pub look_at: Vec3,
    /// Line of the file, from 1, for messages.
    pub line: u32,
}

/// A change of a light at a time.
#[derive(Clone, Debug, PartialEq)]
pub struct LightEdit {
    /// Time from the start, seconds.
    pub time: f32,
    /// Line of the file, from 1, for messages.
    pub line: u32,
    /// Name of the light.
    pub light: String,
    /// New power, as a factor on the loaded light's.
    pub power: Option<f32>,
    /// New colour, as RGB factors on the loaded light's.
    pub colour: Option<Vec3>,
    /// Whether it is on.
    pub on: Option<bool>,
    /// New place of a point or spot light, scene units, until the next: it jumps there.
    pub position: Option<Vec3>,
}

/// Reads a camera path for a scene with this [`origin`](super::Scene::origin).
///
/// # Errors
/// [`Error::Io`] when it cannot be read, [`Error::Input`] with all its faults.
pub fn load_camera_path(path: &Path, origin: DVec3) -> Result<CameraPath> {
    std::fs::metadata(path).map_err(|e| Error::io(path, "cannot read", e))?;
    let text = input::read_scene_file(path).and_then(|bytes| {
        String::from_utf8(bytes)
            .map_err(|_| "is not UTF-8 text: a camera path is a TOML file with [[key]] entries".into())
    });
    let text = text.map_err(|why| {
        let mut report = Report::default();
        report.error(path, None, why);
        Error::Input(report)
    })?;
    let (camera_path, report) = read(path, &text, origin);
    if report.has_errors() { Err(Error::Input(report)) } else { Ok(camera_path) }
}

fn read(file: &Path, text: &str, origin: DVec3) -> (CameraPath, Report) {
    let (mut document, root) = Document::parse(file, text, origin);
    let mut table = Table::root(&mut document, &root);
    let keys = table.tables("key", "[[key]]", read_key);
    let edits = table.tables("edit", "[[edit]]", read_edit);
    if keys.is_empty() {
        table.error(1, "the camera path has no [[key]]: give at least one with time, position and look_at");
    }
    let keys: Vec<At<CameraKey>> =
        keys.into_iter().filter_map(|at| Some(At { value: at.value?, line: at.line })).collect();
    for pair in keys.windows(2) {
        if pair[1].value.time <= pair[0].value.time {
            let message = format!("time {} is not after the key before ({})", pair[1].value.time, pair[0].value.time);
            table.error(pair[1].line, message);
        }
    }
    table.reject_unknown();
    let mut edits: Vec<LightEdit> = edits.into_iter().filter_map(|at| at.value).collect();
    edits.sort_by(|a, b| a.time.total_cmp(&b.time));
    (CameraPath { keys: keys.into_iter().map(|at| at.value).collect(), edits }, document.finish())
}

fn read_time(t: &mut Table) -> Option<f32> {
    let time = t.number_in("time", "seconds from 0", |time| time >= 0.0);
    Some(t.required("time", time)?.value)
}

fn read_key(t: &mut Table) -> Option<CameraKey> {
    let time = read_time(t);
    let position = t.position("position");
    let position = t.required("position", position);
    let look_at = t.position("look_at");
    let look_at = t.required("look_at", look_at);
    let (position, look_at) = (position?, look_at?);
    if position.value == look_at.value {
        t.error(look_at.line, "look_at is the camera's position: look at another point");
    }
    Some(CameraKey { time: time?, position: position.value, look_at: look_at.value, line: t.line })
}

fn read_edit(t: &mut Table) -> Option<LightEdit> {
    let time = read_time(t);
    let light = t.string("light");
    let light = t.required("light", light);
    let power = t.number_in("power", "a factor from 0", |power| power >= 0.0).map(|at| at.value);
    let colour = t.colour("colour").map(|at| at.value);
    let on = t.choice("switch", &[("on", true), ("off", false)]).map(|at| at.value);
    let position = t.position("position").map(|at| at.value);
    if power.is_none() && colour.is_none() && on.is_none() && position.is_none() {
        t.error(t.line, "the edit changes nothing: give power, colour, switch or position");
    }
    let light = light?;
    Some(LightEdit { time: time?, line: light.line, light: light.value, power, colour, on, position })
}

/// The first names of a list.
fn some_of<'a>(names: impl Iterator<Item = &'a str>) -> String {
    const SHOWN: usize = 8;
    let mut names: Vec<&str> = names.take(SHOWN + 1).collect();
    if names.len() > SHOWN {
        names[SHOWN] = "…";
    }
    names.join(", ")
}

impl LightEdit {
    /// Why it cannot be done to these lights.
    fn fault(&self, lights: &[Light]) -> Option<String> {
        let Self { light: name, .. } = self;
        let names = || lights.iter().map(|light| light.name.as_str());
        if names().all(|known| known != name) {
            let hint = match nearest(name, names()) {
                Some(near) => format!("did you mean {near:?}?"),
                None => format!("it has {}", some_of(names())),
            };
            return Some(format!("the scene has no light {name:?}: {hint}"));
        }
        self.position.and_then(|_| why_fixed(lights, name)).map(|why| format!("{name:?} {why}"))
    }
}

impl CameraPath {
    /// Time of the last key or edit, seconds.
    #[must_use]
    pub fn duration(&self) -> f32 {
        let last_edit = self.edits.last().map_or(0.0, |edit| edit.time);
        self.keys.last().map_or(0.0, |key| key.time).max(last_edit)
    }

    /// Checks that the edits are of lights that there are, and move none that cannot be; `file` is where the path was read from.
    ///
    /// # Errors
    /// [`Error::Input`] with every edit that is not.
    pub fn check_lights(&self, file: &Path, lights: &[Light]) -> Result<()> {
        let mut report = Report::default();
        for edit in &self.edits {
            edit.fault(lights).into_iter().for_each(|fault| report.error(file, Some(edit.line), fault));
        }
        if report.has_errors() { Err(Error::Input(report)) } else { Ok(()) }
    }

    /// What the edits up to `time`, seconds, make of each light.
    #[must_use]
    pub fn lights_at(&self, time: f32, lights: &[Light]) -> Vec<LightState> {
        let state = |light: &Light| {
            let (mut power, mut colour, mut on, mut position) = (1.0, Vec3::ONE, true, None);
            for edit in self.edits.iter().filter(|edit| edit.time <= time && edit.light == light.name) {
                power = edit.power.unwrap_or(power);
                colour = edit.colour.unwrap_or(colour);
                on = edit.on.unwrap_or(on);
                position = edit.position.or(position);
            }
            LightState { factor: if on { colour * power } else { Vec3::ZERO }, position }
        };
        lights.iter().map(state).collect()
    }

    /// The camera at `time`, seconds: `base` moved along a Catmull-Rom spline through the keys, which rests before the
    /// first, after the last, and between keys that agree. Its `up` is the base's: [`Horizon`] turns it where that is no
    /// horizon.
    ///
    /// [`Horizon`]: super::horizon::Horizon
    #[must_use]
    pub fn camera_at(&self, time: f32, base: &Camera) -> Camera {
        let at = |value: fn(&CameraKey) -> Vec3| self.interpolate(time, value);
        let (Some(position), Some(look_at)) = (at(|key| key.position), at(|key| key.look_at)) else { return *base };
        Camera { position, look_at, ..*base }
    }

    fn interpolate(&self, time: f32, value: fn(&CameraKey) -> Vec3) -> Option<Vec3> {
        let (first, last) = (self.keys.first()?, self.keys.last()?);
        if time <= first.time || time.is_nan() {
            return Some(value(first));
        }
        if time >= last.time {
            return Some(value(last));
        }
        let next = self.keys.partition_point(|key| key.time <= time);
        let (a, b) = (&self.keys[next - 1], &self.keys[next]);
        if value(a) == value(b) {
            return Some(value(a));
        }
        let span = b.time - a.time;
        let t = (time - a.time) / span;
        let (ta, tb) = (self.tangent(next - 1, value) * span, self.tangent(next, value) * span);
        // Cubic Hermite basis.
        let (t2, t3) = (t * t, t * t * t);
        Some(
            value(a) * (2.0 * t3 - 3.0 * t2 + 1.0)
                + ta * (t3 - 2.0 * t2 + t)
                + value(b) * (3.0 * t2 - 2.0 * t3)
                + tb * (t3 - t2),
        )
    }

    /// Velocity at key `i`: that of the parabola through it and its neighbours (Catmull-Rom for uneven times), of the
    /// chord at the ends; none beside a rest, which would be overshot.
    fn tangent(&self, i: usize, value: fn(&CameraKey) -> Vec3) -> Vec3 {
        let slope = |k: usize| {
            let (a, b) = (&self.keys[k], &self.keys[k + 1]);
            ((value(b) - value(a)) / (b.time - a.time), b.time - a.time)
        };
        if i == 0 {
            return slope(0).0;
        }
        let (before, dt_before) = slope(i - 1);
        if i + 1 == self.keys.len() {
            return before;
        }
        let (after, dt_after) = slope(i);
        if before == Vec3::ZERO || after == Vec3::ZERO {
            return Vec3::ZERO;
        }
        (before * dt_after + after * dt_before) / (dt_before + dt_after)
    }
}

#[cfg(test)]
mod tests {
    use super::super::light::LightKind;
    use super::*;

    const BASE: Camera = Camera { position: Vec3::ZERO, look_at: Vec3::X, up: Vec3::Y, vertical_fov: 30.0 };

    fn parabola(times: &[f32]) -> CameraPath {
        let key = |&time: &f32| CameraKey {
            time,
            position: Vec3::new(time, time * time, 1.0),
            look_at: Vec3::splat(9.0),
            line: 1,
        };
        CameraPath { keys: times.iter().map(key).collect(), edits: Vec::new() }
    }

    #[test]
    fn inner_spans_reproduce_a_parabola_at_uneven_times() {
        let path = parabola(&[0.0, 1.0, 1.5, 4.0, 5.0]);
        for time in [1.0, 1.2, 1.5, 2.0, 3.7] {
            let found = path.camera_at(time, &BASE).position;
            assert!(found.distance(Vec3::new(time, time * time, 1.0)) < 1e-4, "{time}: {found}");
        }
    }

    #[test]
    fn the_camera_rests_outside_and_keeps_its_lens() {
        let path = parabola(&[1.0, 2.0]);
        assert_eq!(path.camera_at(0.0, &BASE).position, Vec3::ONE);
        assert_eq!(path.camera_at(7.0, &BASE).position, Vec3::new(2.0, 4.0, 1.0));
        assert_eq!(path.camera_at(f32::NAN, &BASE).position, Vec3::ONE);
        assert_eq!(path.camera_at(1.5, &BASE).vertical_fov, 30.0);
        assert_eq!(parabola(&[3.0]).camera_at(3.5, &BASE).position, Vec3::new(3.0, 9.0, 1.0));
    }

    #[test]
    fn what_two_keys_agree_on_rests_between_them() {
        let key = |time: f32, x: f32, z: f32| CameraKey {
            time,
            position: Vec3::X * x,
            look_at: Vec3::new(0.0, 5.0, z),
            line: 1,
        };
        // The position rests from 1 s to 3 s, the point looked at from 2 s to 3 s, and the keys at the end agree.
        let keys = vec![
            key(0., 8., 0.),
            key(1., 3., 1.),
            key(2., 3., 2.),
            key(3., 3., 2.),
            key(4., -3., 4.),
            key(5., -3., 4.),
        ];
        let path = CameraPath { keys, edits: Vec::new() };
        let at = |time: f32| path.camera_at(time, &BASE);
        for i in 0..=100 {
            let t = i as f32 / 100.0;
            assert_eq!(at(1.0 + 2.0 * t).position.x, 3.0);
            assert_eq!(at(2.0 + t).look_at.z, 2.0);
            assert!((3.0..=8.0).contains(&at(t).position.x) && (-3.0..=3.0).contains(&at(3.0 + t).position.x));
            assert_eq!(at(4.0 + t).position.x, -3.0);
        }
        assert!((1.4..1.8).contains(&at(1.5).look_at.z), "it goes on turning");
        let speed = |time: f32| (at(time + 1e-3).position - at(time).position).length() / 1e-3;
        assert!(speed(0.998) < 0.1 && speed(0.5) > 5.0, "it comes to rest gently");
    }

    #[test]
    fn edits_add_up() {
        let text = "[[key]]\ntime = 1\nposition = [0,0,0]\nlook_at = [0,0,1]\n\
            [[edit]]\ntime = 3\nlight = \"a\"\nswitch = \"on\"\n\
            [[edit]]\ntime = 1\nlight = \"a\"\npower = 0.5\ncolour = [1, 0.5, 0]\n\
            [[edit]]\ntime = 2\nlight = \"a\"\nswitch = \"off\"\n\
            [[edit]]\ntime = 3\nlight = \"lamb\"\npower = 2\n\
            [[edit]]\ntime = 2.75\nlight = \"lamp\"\nposition = [11, 2, 3]\n\
            [[edit]]\ntime = 2.5\nlight = \"a\"\nposition = [0, 0, 0]\n";
        let (path, report) = read(Path::new("p.toml"), text, DVec3::X * 10.0);
        assert!(!report.has_errors() && path.duration() == 3.0);
        let far = LightKind::Directional { direction: Vec3::X, irradiance: Vec3::ONE };
        let near = LightKind::Point { position: Vec3::ZERO, intensity: Vec3::ONE };
        let lights = [("a", far), ("lamp", near)].map(|(name, kind)| Light { name: name.into(), kind });
        let half = Vec3::new(0.5, 0.25, 0.0);
        for (time, factor) in [(0.5, Vec3::ONE), (1.0, half), (2.5, Vec3::ZERO), (9.0, half)] {
            let [a, lamp] = path.lights_at(time, &lights)[..] else { panic!("two lights") };
            assert_eq!((a.factor, lamp.factor), (factor, Vec3::ONE), "{time}");
            assert_eq!(lamp.position, (time > 2.75).then_some(Vec3::new(1.0, 2.0, 3.0)), "{time}");
        }
        let Err(Error::Input(report)) = path.check_lights(Path::new("p.toml"), &lights) else { panic!("accepted") };
        let lines = report.lines(super::super::report::Severity::Error);
        let expected = [
            "p.toml:28: error: \"a\" is infinitely far: it has no place to move",
            "p.toml:20: error: the scene has no light \"lamb\": did you mean \"lamp\"?",
        ];
        assert_eq!(lines, expected);
    }

    #[test]
    fn faults_are_listed_with_lines() {
        let text = "[[key]]\ntime = 1\nposition = [0,0,0]\nlook_at = [0,0,1]\n[[key]]\ntime = 1\nposition = [0,0,0]\n\
                    look_at = [0,0,0]\n[[edit]]\ntime = 2\nlight = \"a\"\n[[edit]]\ntime = 1\nswich = \"off\"\n";
        let (path, report) = read(Path::new("p.toml"), text, DVec3::ZERO);
        let lines: Vec<_> = report.faults.iter().filter_map(|f| f.place.line).collect();
        assert_eq!(lines, [5, 8, 9, 12, 12, 14], "{report:#?}");
        assert_eq!(path.edits.len(), 1, "the edit without a light is left out");
    }
}
