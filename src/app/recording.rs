//! What was done, written down: as a script, and as a camera path.

use super::command::Command;
use super::lights::{Lights, Setting};
use crate::error::Result;
use crate::image::atomic;
use crate::scene::camera::Camera;
use glam::{DVec3, Vec3};
use std::fmt::Write as _;
use std::io::Write as _;
use std::path::PathBuf;

/// Time between two keys of a camera path, seconds: what lies between is a smooth curve.
const BETWEEN_KEYS: f64 = 0.1;

/// What is done and where the camera goes, while either is recorded.
#[derive(Default)]
pub struct Recording {
    script: Option<Script>,
    path: Option<Path>,
}

/// A script in the making.
struct Script {
    to: PathBuf,
    /// When it began, seconds.
    start: f64,
    lines: String,
}

/// A camera path in the making.
struct Path {
    to: PathBuf,
    /// When it began, seconds.
    start: f64,
    keys: Vec<(f64, Camera)>,
    /// Lines of the lights' changes.
    edits: String,
    lights: Option<Lights>,
}

impl Recording {
    /// Begins a script, by the camera's place; `origin` is that of the scene.
    pub fn begin_script(&mut self, to: PathBuf, time: f64, camera: &Camera, origin: DVec3) {
        let [position, look_at] = [camera.position, camera.look_at].map(|point| point.as_dvec3() + origin);
        let lines = format!("0 {}\n", Command::Place { position, look_at });
        self.script = Some(Script { to, start: time, lines });
    }

    /// Begins a camera path.
    pub fn begin_path(&mut self, to: PathBuf, time: f64) {
        self.path = Some(Path { to, start: time, keys: Vec::new(), edits: String::new(), lights: None });
    }

    /// Whether anything is recorded.
    #[must_use]
    pub const fn is_on(&self) -> bool {
        self.script.is_some() || self.path.is_some()
    }

    /// Notes a command.
    pub fn command(&mut self, time: f64, command: &Command) {
        if let Some(script) = &mut self.script {
            // Writing to a string does not fail.
            let _ = writeln!(script.lines, "{} {command}", rounded(time - script.start));
        }
    }

    /// Notes where the camera is and how the lights are set; once a frame. `origin` is that of the scene.
    pub fn frame(&mut self, time: f64, camera: &Camera, lights: &Lights, origin: DVec3) {
        if let Some(path) = &mut self.path {
            path.note(time - path.start, camera, lights, origin);
        }
    }

    /// Ends what is recorded, and writes it; the files. `origin` is that of the scene.
    ///
    /// # Errors
    /// [`crate::error::Error::Io`] naming the file.
    pub fn stop(&mut self, time: f64, camera: &Camera, origin: DVec3) -> Result<Vec<PathBuf>> {
        let mut written = Vec::new();
        if let Some(script) = self.script.take() {
            let end = format!("{} {}\n", rounded(time - script.start), Command::Quit);
            atomic::write(&script.to, |file| file.write_all((script.lines + &end).as_bytes()))?;
            written.push(script.to);
        }
        if let Some(mut path) = self.path.take() {
            path.key(time - path.start, camera);
            atomic::write(&path.to, |file| file.write_all(path.toml(origin).as_bytes()))?;
            written.push(path.to);
        }
        Ok(written)
    }
}

impl Path {
    fn note(&mut self, time: f64, camera: &Camera, lights: &Lights, origin: DVec3) {
        if self.keys.last().is_none_or(|(last, _)| time - last >= BETWEEN_KEYS) {
            self.key(time, camera);
        }
        if self.lights.as_ref() != Some(lights) {
            self.edit(time, lights, origin);
            self.lights = Some(lights.clone());
        }
    }

    /// A key later than the last; of those that agree, the first and the last stay.
    fn key(&mut self, time: f64, camera: &Camera) {
        let time = rounded(time);
        if let [.., (_, before), (last, present)] = &mut self.keys[..]
            && *present == *camera
            && *before == *camera
        {
            *last = time.max(*last);
        } else if self.keys.last().is_none_or(|(last, _)| time > *last) {
            self.keys.push((time, *camera));
        }
    }

    /// What changed of the lights; at first, what is not as loaded.
    fn edit(&mut self, time: f64, lights: &Lights, origin: DVec3) {
        let set = |light: &Setting| (light.on, light.power, light.colour, light.moved_to);
        for (number, light) in lights.all().iter().enumerate() {
            let before = self.lights.as_ref().map_or((true, 1.0, Vec3::ONE, None), |lights| set(&lights.all()[number]));
            if before != set(light) {
                let switch = if light.on { "on" } else { "off" };
                let [r, g, b] = light.colour.to_array().map(|value| float(value.into()));
                let _ = write!(
                    self.edits,
                    "\n[[edit]]\ntime = {}\nlight = {}\nswitch = \"{switch}\"\npower = {}\n\
                     colour = [{r}, {g}, {b}]\n",
                    float(rounded(time)),
                    toml::Value::from(light.name.as_str()),
                    float(f64::from(light.power)),
                );
                if let Some(place) = light.moved_to {
                    let _ = writeln!(self.edits, "position = {}", point(place, origin));
                }
            }
        }
    }

    fn toml(&self, origin: DVec3) -> String {
        let point = |place: Vec3| point(place, origin);
        let key = |(time, camera): &(f64, Camera)| {
            let Camera { position, look_at, .. } = *camera;
            format!("[[key]]\ntime = {}\nposition = {}\nlook_at = {}\n", float(*time), point(position), point(look_at))
        };
        let keys: Vec<String> = self.keys.iter().map(key).collect();
        keys.join("\n") + &self.edits
    }
}

/// A point in coordinates of the scene's files, whose origin this is, as TOML has it.
fn point(place: Vec3, origin: DVec3) -> String {
    let [x, y, z] = (place.as_dvec3() + origin).to_array().map(float);
    format!("[{x}, {y}, {z}]")
}

/// To a tenth of a millisecond.
fn rounded(seconds: f64) -> f64 {
    (seconds * 1e4).round() / 1e4
}

/// A number that TOML takes for a float.
fn float(value: f64) -> String {
    format!("{value:?}")
}

#[cfg(test)]
mod tests {
    use super::super::script;
    use super::*;
    use crate::scene::camera_path::load_camera_path;
    use crate::scene::light::{Light, LightKind};

    fn camera(x: f32) -> Camera {
        Camera { position: Vec3::new(x, 0.25, 0.0), look_at: Vec3::NEG_Z, up: Vec3::Y, vertical_fov: 40.0 }
    }

    fn lamp() -> Lights {
        let kind = LightKind::Point { position: Vec3::X, intensity: Vec3::ONE };
        Lights::new(&[Light { name: "light \"1\"".to_owned(), kind }])
    }

    #[test]
    fn a_camera_path_can_be_loaded_again() {
        let folder = tempfile::tempdir().unwrap();
        let to = folder.path().join("walk.toml");
        let (mut recording, mut lights) = (Recording::default(), lamp());
        let origin = DVec3::new(1000.0, 0.0, 0.0);
        recording.begin_path(to.clone(), 10.0);
        for frame in 0..=60 {
            // Half a second of flight, then half a second of rest; the light goes off in the middle.
            let seconds = f64::from(frame) / 60.0;
            if frame == 30 {
                lights.change("light \"1\"", |light| light.on = false);
                lights.change("light \"1\"", |light| light.moved_to = Some(Vec3::splat(0.5)));
            }
            recording.frame(10.0 + seconds, &camera(seconds.min(0.5) as f32 * 2.0), &lights, origin);
        }
        assert_eq!(recording.stop(11.0, &camera(1.0), origin).unwrap(), std::slice::from_ref(&to));
        assert!(!recording.is_on());
        let path = load_camera_path(&to, origin).unwrap();
        assert!(path.keys.len() <= 8, "a rest is two keys: {}", path.keys.len());
        assert_eq!(path.keys.last().unwrap().time, 1.0);
        for time in [0.0, 0.21, 0.4, 0.77, 1.0_f32] {
            let found = path.camera_at(time, &camera(0.0)).position;
            assert!(found.distance(camera(time.min(0.5) * 2.0).position) < 0.02, "{time}: {found}");
        }
        assert_eq!((path.edits.len(), path.edits[0].time, path.edits[0].on), (1, 0.5, Some(false)));
        assert_eq!(path.edits[0].position, Some(Vec3::splat(0.5)));
    }

    #[test]
    fn a_script_can_be_played_again() {
        let folder = tempfile::tempdir().unwrap();
        let to = folder.path().join("walk.script");
        let mut recording = Recording::default();
        recording.begin_script(to.clone(), 2.0, &camera(0.5), DVec3::ZERO);
        recording.command(2.25, &Command::Fly(Vec3::Z));
        recording.command(3.5, &Command::ToggleLight("light 1".to_owned()));
        recording.stop(4.0, &camera(1.0), DVec3::ZERO).unwrap();
        let script = script::Script::load(&to).unwrap();
        let steps: Vec<(f64, String)> = script.steps.iter().map(|step| (step.time, step.command.to_string())).collect();
        let expected = [
            (0.0, "camera.place 0.5 0.25 0 0 0 -1"),
            (0.25, "camera.fly 0 0 1"),
            (1.5, "light.toggle \"light 1\""),
            (2.0, "app.quit"),
        ];
        assert_eq!(steps, expected.map(|(time, line)| (time, line.to_owned())));
    }
}
