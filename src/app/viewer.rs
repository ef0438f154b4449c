//! What is looked at and how, and what commands do to it. Neither a window nor a clock: time is told.

mod moves;
mod reference;
#[cfg(feature = "shader-reload")]
mod shaders;

use super::command::{Command, operator_name};
use super::explained::Explained;
use super::flight::Flight;
use super::history::History;
use super::lights::Lights;
use super::path_traced::PathTraced;
use super::recording::Recording;
use super::reload::Fresh;
use super::script;
use super::shots::{Shot, Shots};
use super::views::Choice;
use crate::error::{Error, Result};
use crate::refine::update::EngineStats;
use crate::scene::camera::{Camera, ImageSize};
use crate::scene::{Display, ToneMapping};
use crate::session::{FrameReport, Observer, Session};
use crate::trace;
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::time::Duration;

/// Seconds that it takes to fly as far as the scene is large, at first.
const CROSSING: f32 = 4.0;

/// Seconds for which a message is shown.
const MESSAGE: f64 = 4.0;

/// Files that hold the scene.
const SCENE: &str = "scene";

/// Range of the exposure, stops.
const STOPS: f32 = 64.0;

/// Which panels are open.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Open {
    /// The panel with figures and settings.
    pub hud: bool,
    /// The list of lights in it.
    pub lights: bool,
    /// The help.
    pub help: bool,
}

/// A session with a camera that moves, lights that are switched, and panels that are open.
pub struct Viewer {
    session: Session,
    flight: Flight,
    lights: Lights,
    open: Open,
    recording: Recording,
    shots: Shots,
    explained: Explained,
    /// The debug view.
    view: Choice,
    /// The path-traced reference, once it was wanted.
    reference: Option<PathTraced>,
    /// Whether it is shown in place of the picture.
    shows_reference: bool,
    /// Estimated errors so far.
    errors: History,
    /// The camera that was flown last, when another was taken.
    user: Option<Camera>,
    /// Whether the camera was moved since one of the scene's was taken.
    flown: bool,
    /// Whether the camera, the lights or the size changed since the session looked.
    changed: bool,
    /// Whether how pictures are displayed changed since the last.
    redisplay: bool,
    /// Seconds since the first picture.
    time: f64,
    message: Option<(String, f64)>,
    /// What is wrong with files, as long as it is, by what they hold.
    faults: BTreeMap<&'static str, String>,
    /// Whether the scene is to be loaded again.
    reload: bool,
    ended: bool,
    /// The engine's totals as the last frame shows them.
    stats: EngineStats,
}

impl Viewer {
    /// A viewer through a camera; pictures without a name of their own are called `name` with a number.
    #[must_use]
    pub fn new(session: Session, camera: Camera, name: PathBuf, open: Open) -> Self {
        let speed = session.scene().scale() / CROSSING;
        Self {
            lights: Lights::new(&session.scene().lights),
            flight: Flight::new(camera, speed),
            session,
            open,
            recording: Recording::default(),
            shots: Shots::new(name),
            explained: Explained::default(),
            view: Choice::default(),
            reference: None,
            shows_reference: false,
            errors: History::default(),
            user: None,
            flown: false,
            changed: true,
            redisplay: false,
            time: 0.0,
            message: None,
            faults: BTreeMap::new(),
            reload: false,
            ended: false,
            stats: EngineStats::default(),
        }
    }

    /// The session.
    #[must_use]
    pub const fn session(&self) -> &Session {
        &self.session
    }

    /// The lights as they are set.
    #[must_use]
    pub const fn lights(&self) -> &Lights {
        &self.lights
    }

    /// Which panels are open.
    #[must_use]
    pub const fn open(&self) -> Open {
        self.open
    }

    /// Where the camera is, and how it moves.
    #[must_use]
    pub const fn flight(&self) -> &Flight {
        &self.flight
    }

    /// Seconds since the first picture.
    #[must_use]
    pub const fn time(&self) -> f64 {
        self.time
    }

    /// What is to be said now.
    #[must_use]
    pub fn message(&self) -> Option<&str> {
        let message = self.message.as_ref().filter(|(_, until)| self.time < *until).map(|(text, _)| text);
        message.or_else(|| self.faults.values().next()).map(String::as_str)
    }

    /// How much longer that is to be said.
    #[must_use]
    pub fn message_left(&self) -> Option<Duration> {
        let left = self.message.as_ref()?.1 - self.time;
        (left > 0.0).then(|| Duration::from_secs_f64(left))
    }

    /// The engine's totals as the last frame shows them.
    #[must_use]
    pub const fn stats(&self) -> &EngineStats {
        &self.stats
    }

    /// The pixel that is explained.
    #[must_use]
    pub const fn explained(&self) -> &Explained {
        &self.explained
    }

    /// The debug view that is chosen.
    #[must_use]
    pub const fn view(&self) -> Choice {
        self.view
    }

    /// The estimated error over time.
    #[must_use]
    pub const fn errors(&self) -> &History {
        &self.errors
    }

    /// Whether anything is recorded.
    #[must_use]
    pub const fn is_recording(&self) -> bool {
        self.recording.is_on()
    }

    /// Whether it was asked to end.
    #[must_use]
    pub const fn has_ended(&self) -> bool {
        self.ended
    }

    /// Whether the next frame differs from the last, whatever the engine does.
    #[must_use]
    pub fn is_changing(&self) -> bool {
        self.changed || self.redisplay || self.explained.is_asked() || self.flight.is_moving()
    }

    /// Says something for a while.
    pub fn say(&mut self, text: impl Into<String>) {
        self.message = Some((text.into(), self.time + MESSAGE));
    }

    /// Lets time go on to `time`: what moves has moved then.
    pub fn advance(&mut self, time: f64) {
        if time > self.time && self.flight.is_moving() {
            self.flight.fly((time - self.time) as f32);
            self.changed = true;
        }
        self.time = self.time.max(time);
    }

    /// Makes pictures of a size.
    ///
    /// # Errors
    /// As [`Session::resize`].
    pub fn resize(&mut self, size: ImageSize) -> Result<()> {
        if size != self.session.size() {
            self.session.resize(size)?;
            self.changed = true;
        }
        Ok(())
    }

    /// Draws a frame, if there is one to draw, and explains a pixel of it, if that was asked for.
    ///
    /// # Errors
    /// As [`Session::step`], or what the observer could not do; [`Error::Io`] if what is said of a pixel cannot be written: all goes on as
    /// before.
    pub fn frame(&mut self, observer: &mut dyn Observer) -> Result<Option<FrameReport>> {
        let asked = self.redisplay || self.explained.is_asked() || self.reference_has_news();
        if !self.changed && !asked && self.session.is_idle() {
            return Ok(None);
        }
        let moved = std::mem::take(&mut self.changed);
        if moved {
            let looked = self.session.look_through(&self.flight.camera, &self.lights.states());
            self.changed = looked.is_err();
            looked?;
        }
        self.follow_reference(moved)?;
        self.redisplay = false;
        let report = self.session.step(observer)?;
        observer.frame(&mut self.session, &report)?;
        self.stats = report.engine;
        self.errors.note(self.time, self.stats.estimated_error);
        self.recording.frame(self.time, &self.flight.camera, &self.lights, self.session.scene().origin);
        // The first frame of a view is followed by one with its work.
        if !report.camera_moved {
            self.explain()?;
        }
        Ok(Some(report))
    }

    /// Answers what is asked about a pixel.
    fn explain(&mut self) -> Result<()> {
        let written = self.explained.answer(&mut self.session)?;
        written.iter().for_each(|file| self.say(file.display().to_string()));
        Ok(())
    }

    /// Whether the scene is to be loaded again, for the caller to do it.
    pub const fn take_reload(&mut self) -> bool {
        std::mem::replace(&mut self.reload, false)
    }

    /// Takes a scene that was loaded again: the camera stays, and the lights of the same names as they are set. What is wrong with
    /// the files is said until it is mended, and all stays as it was.
    ///
    /// # Errors
    /// As [`Session::replace_scene`].
    pub fn reloaded(&mut self, loaded: Result<Fresh>) -> Result<()> {
        let Fresh { scene, bvh, warnings, .. } = match loaded {
            Ok(fresh) => fresh,
            Err(fault @ (Error::Input(_) | Error::Io { .. } | Error::Usage(_))) => {
                self.faults.insert(SCENE, first_lines(fault.to_string().lines()));
                return Ok(());
            }
            Err(other) => return Err(other),
        };
        let shift = (self.session.scene().origin - scene.origin).as_vec3();
        self.session.replace_scene(&scene, bvh)?;
        self.flight.shift(shift);
        self.flight.pivot = None;
        self.user =
            self.user.map(|user| Camera { position: user.position + shift, look_at: user.look_at + shift, ..user });
        self.lights = self.lights.carried_to(&scene.lights, shift);
        self.faults.remove(SCENE);
        self.changed = true;
        let said = std::iter::once("the scene was loaded again").chain(warnings.iter().map(String::as_str));
        self.say(first_lines(said));
        Ok(())
    }

    /// Pictures that are to be written once the next frame is shown, for the caller to take.
    pub fn take_shots(&mut self) -> Vec<Shot> {
        self.shots.take()
    }

    /// The session, to make written pictures of.
    pub const fn session_mut(&mut self) -> &mut Session {
        &mut self.session
    }

    /// Does what a command says, now.
    ///
    /// # Errors
    /// [`Error::Usage`] for a light or camera that is not there, [`Error::Io`] for a file that cannot be written: all goes on as
    /// before.
    pub fn execute(&mut self, command: &Command) -> Result<()> {
        script::check(command, self.session.scene()).map_err(Error::Usage)?;
        trace::instant("command", || Some(command.to_string()));
        let records = matches!(command, Command::RecordSession(_) | Command::RecordCamera(_) | Command::RecordStop);
        if !records && *command != Command::Quit {
            self.recording.command(self.time, command);
        }
        match command {
            Command::RecordCamera(_) | Command::RecordSession(_) | Command::RecordStop => self.record(command)?,
            Command::ToggleLight(_) | Command::DimLight(..) | Command::ColourLight(..) | Command::MoveLight(..) => {
                self.lights.execute(command, self.session.scene().origin);
                self.changed = true;
            }
            Command::View(..) | Command::NextView => self.change_view(command),
            Command::Reference(shown) => (self.shows_reference, self.redisplay) = (*shown, true),
            Command::Update(mode) => {
                self.session.set_update_mode(*mode)?;
                self.redisplay = true;
            }
            Command::Reload => self.reload = true,
            Command::Screenshot(path) => self.shots.ask(path.as_deref(), true),
            Command::Picture(path) => self.shots.ask(path.as_deref(), false),
            Command::Explain(place) => self.explained.ask(*place, self.session.size()),
            Command::SaveExplanation(path) => {
                if self.explained.save(path)? {
                    self.say(path.display().to_string());
                }
            }
            Command::ToggleHud => self.open.hud = !self.open.hud,
            Command::ToggleLights => self.toggle_lights(),
            Command::ToggleHelp => self.open.help = !self.open.help,
            Command::Back => self.back(),
            Command::Quit => self.ended = true,
            Command::Exposure(_) | Command::Expose(_) | Command::ToneMapping(_) | Command::NextToneMapping => {
                self.display(command);
            }
            _ => self.move_camera(command),
        }
        Ok(())
    }

    /// Ends what is recorded, and writes it.
    ///
    /// # Errors
    /// [`Error::Io`] naming the file.
    pub fn finish(&mut self) -> Result<Vec<PathBuf>> {
        self.recording.stop(self.time, &self.flight.camera, self.session.scene().origin)
    }

    fn display(&mut self, command: &Command) {
        let mut display = self.session.display();
        match command {
            Command::Exposure(stops) => display.exposure = *stops,
            Command::Expose(stops) => display.exposure = (display.exposure + stops).clamp(-STOPS, STOPS),
            Command::ToneMapping(operator) => display.tone_mapping = *operator,
            _ => display.tone_mapping = next_operator(display.tone_mapping),
        }
        let Display { exposure, tone_mapping } = display;
        self.say(format!("exposure {exposure:+.1}, {}", operator_name(tone_mapping)));
        self.session.set_display(display);
        self.redisplay = true;
    }

    fn change_view(&mut self, command: &Command) {
        let scene = self.session.scene();
        match command {
            Command::View(view, light) => {
                let named = light.as_ref().and_then(|name| scene.lights.iter().position(|light| light.name == *name));
                self.view = Choice { view, light: named.map_or(self.view.light, |number| number as u32) };
            }
            _ => self.view = self.view.next(scene),
        }
        self.say(format!("view {}", self.view.label(self.session.scene())));
        self.redisplay = true;
    }

    fn toggle_lights(&mut self) {
        let shown = self.open.hud && self.open.lights;
        (self.open.hud, self.open.lights) = (self.open.hud || !shown, !shown);
    }

    /// Closes the help, or what is said of a pixel; without any, says how to end: a key that is pressed to get out of something must not end all.
    fn back(&mut self) {
        if self.open.help {
            self.open.help = false;
        } else if !self.explained.close() {
            self.say("Ctrl + Q ends");
        }
    }

    fn record(&mut self, command: &Command) -> Result<()> {
        let (time, camera, origin) = (self.time, self.flight.camera, self.session.scene().origin);
        match command {
            Command::RecordCamera(to) => self.recording.begin_path(to.clone(), time),
            Command::RecordSession(to) => self.recording.begin_script(to.clone(), time, &camera, origin),
            _ => {
                let written = self.finish()?;
                let files: Vec<String> = written.iter().map(|file| file.display().to_string()).collect();
                self.say(if files.is_empty() { "nothing was recorded".to_owned() } else { files.join(", ") });
            }
        }
        Ok(())
    }
}

/// As many lines as a message may have.
fn first_lines<'a>(lines: impl Iterator<Item = &'a str>) -> String {
    const MOST: usize = 6;
    lines.take(MOST).collect::<Vec<_>>().join("\n")
}

fn next_operator(operator: ToneMapping) -> ToneMapping {
    let known = ToneMapping::NAMES.map(|(_, operator)| operator);
    let present = known.iter().position(|known| *known == operator).unwrap_or_default();
    known[(present + 1) % known.len()]
}
