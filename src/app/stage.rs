//! The thread that draws for a window: session, renderer and panels live here, so that neither the driver nor the engine ever
//! holds up the window's own thread.

use super::Plan;
use super::command::Command;
use super::controls::{Controls, Event, Kept};
use super::panels;
use super::rate::{PassTimes, Rate};
use super::recovery::{Open, recover};
use super::reload::Reloader;
use super::screen::{Asked, Screen};
use super::viewer::Viewer;
use crate::error::{Error, Result};
use crate::scene::camera::ImageSize;
use crate::system;
use crate::vk::presenter::Presented;
use crossbeam_channel::{Receiver, RecvTimeoutError};
use egui::{PlatformOutput, Pos2, RawInput, Rect, ViewportId};
use glam::Vec2;
use std::collections::VecDeque;
use std::path::PathBuf;
use std::time::{Duration, Instant};

/// What the window tells.
pub enum Message {
    /// Something happened: as the panels take it, and as the controls do.
    Happened(Box<RawInput>, Option<Event>),
    /// The window has this size now; none while it is minimised.
    Resized(Option<ImageSize>),
    /// So many pixels are a point.
    Scaled(f32),
    /// Whether any of the window can be seen.
    Seen(bool),
    /// The user has closed the window.
    Closed,
}

/// What the window is told.
pub enum Reply {
    /// The form of the cursor and the like.
    Platform(Box<PlatformOutput>),
    /// Nothing is drawn any more.
    Ended,
}

/// How often an interrupt is looked for while nothing else happens.
const TICK: Duration = Duration::from_millis(100);

/// How often the memory of the process is looked up.
const BETWEEN_LOOKS: Duration = Duration::from_secs(1);

/// Pictures that the rate is a mean of.
const MEAN_OF: usize = 30;

/// Everything that a window shows.
pub struct Stage<T: Fn(Reply)> {
    viewer: Viewer,
    screen: Screen,
    plan: Plan,
    controls: Controls,
    reloader: Reloader,
    #[cfg(feature = "shader-reload")]
    shaders: super::shader_watch::ShaderWatch,
    open: Open,
    inbox: Receiver<Message>,
    tell: T,
    /// Time between two pictures while only the light changes.
    refresh: Duration,
    /// When the first picture was there.
    start: Option<Instant>,
    /// Commands of the script that are still to come.
    steps: VecDeque<super::script::Step>,
    /// What the panels have not heard of.
    input: RawInput,
    scale: f32,
    /// Size of the window; `None` while it is minimised.
    window: Option<ImageSize>,
    seen: bool,
    /// Whether the window shows less than there is.
    stale: bool,
    /// When the panels want to be laid out again.
    again: Option<Instant>,
    meter: Meter,
}

impl<T: Fn(Reply)> Stage<T> {
    /// A stage for a window of the session's size, of `scale` pixels a point, on which the scene is loaded again when it changes, and that
    /// has another device opened when its own is lost.
    pub fn new(
        viewer: Viewer,
        screen: Screen,
        plan: Plan,
        (inbox, tell): (Receiver<Message>, T),
        (scale, refresh): (f32, Duration),
        (reloader, open): (Reloader, Open),
    ) -> Self {
        Self {
            window: Some(viewer.session().size()),
            viewer,
            screen,
            steps: plan.script.steps.iter().cloned().collect(),
            plan,
            controls: Controls::default(),
            reloader,
            #[cfg(feature = "shader-reload")]
            shaders: super::shader_watch::ShaderWatch::start(super::shader_watch::FOLDER.into()),
            open,
            inbox,
            tell,
            refresh,
            start: None,
            input: RawInput::default(),
            scale,
            seen: true,
            stale: true,
            again: None,
            meter: Meter::default(),
        }
    }

    /// Draws until the user ends it; the files that were recorded.
    ///
    /// # Errors
    /// The device is lost, memory runs out, or the engine has stopped.
    pub fn run(mut self) -> Result<Vec<PathBuf>> {
        while !self.viewer.has_ended() && !(self.plan.interrupted)() {
            if let Err(fault) = self.turn() {
                recover(fault, &mut self.viewer, &mut self.screen, &mut self.open)?;
                self.stale = true;
            }
        }
        self.plan.finish(self.viewer.session())?;
        self.viewer.finish()
    }

    fn turn(&mut self) -> Result<()> {
        self.listen()?;
        self.play()?;
        self.reload()?;
        self.viewer.advance(self.now());
        if self.seen && self.window.is_some() && self.is_due() {
            self.picture()?;
        }
        Ok(())
    }

    /// Seconds since the first picture.
    fn now(&self) -> f64 {
        self.start.map_or(0.0, |start| start.elapsed().as_secs_f64())
    }

    /// How long nothing need be drawn, if nothing happens.
    fn pause(&self) -> Duration {
        if !self.seen || self.window.is_none() {
            return TICK;
        }
        if self.stale || self.viewer.is_changing() {
            return Duration::ZERO;
        }
        let goes_on = !self.viewer.session().is_idle() || self.viewer.is_tracing();
        let light = goes_on.then(|| self.meter.until(self.refresh));
        let panels = self.again.map(|again| again.saturating_duration_since(Instant::now()));
        let step = self.steps.front().map(|step| Duration::from_secs_f64((step.time - self.now()).max(0.0)));
        [light, panels, step].into_iter().flatten().min().unwrap_or(TICK).min(TICK)
    }

    fn is_due(&self) -> bool {
        self.pause().is_zero()
    }

    /// Takes in what happened; waits for it while nothing is to be drawn. The last size of many counts.
    fn listen(&mut self) -> Result<()> {
        let first = match self.inbox.recv_timeout(self.pause()) {
            Ok(message) => Some(message),
            Err(RecvTimeoutError::Timeout) => None,
            Err(RecvTimeoutError::Disconnected) => Some(Message::Closed),
        };
        let more: Vec<Message> = self.inbox.try_iter().collect();
        let mut size = None;
        for message in first.into_iter().chain(more) {
            match message {
                Message::Happened(input, event) => self.happened(*input, event)?,
                Message::Resized(to) => size = Some(to),
                Message::Scaled(scale) => (self.scale, self.stale) = (scale, true),
                Message::Seen(seen) => self.appear(seen),
                Message::Closed => self.execute(&Command::Quit)?,
            }
        }
        size.map_or(Ok(()), |size| self.resize(size))
    }

    fn appear(&mut self, seen: bool) {
        (self.seen, self.stale) = (seen, true);
        if !seen {
            self.viewer.pause_reference();
        }
    }

    fn resize(&mut self, window: Option<ImageSize>) -> Result<()> {
        (self.window, self.stale) = (window, true);
        let Some(size) = window else {
            self.viewer.pause_reference();
            return Ok(());
        };
        match self.viewer.resize(size) {
            // Larger than the device's images: those that there are get stretched.
            Err(Error::Usage(fault)) => self.viewer.say(fault),
            other => other?,
        }
        self.screen.resize(self.viewer.session().size())
    }

    fn happened(&mut self, mut input: RawInput, event: Option<Event>) -> Result<()> {
        // Tab shows and hides the panel, instead of going through what is on it, and Space clicks nothing.
        let is_ours = |key: egui::Key| matches!(key, egui::Key::Tab | egui::Key::Space);
        input.events.retain(|event| !matches!(event, egui::Event::Key { key, .. } if is_ours(*key)));
        self.input.append(input);
        let context = self.screen.context();
        let kept = Kept { mouse: context.egui_wants_pointer_input(), keyboard: context.text_edit_focused() };
        // A cursor that moves over the picture alone must not take time from the light.
        let may_wait = matches!(event, Some(Event::Cursor(_))) && !kept.mouse;
        let wait = if may_wait { self.meter.until(self.refresh) } else { Duration::ZERO };
        let due = Instant::now() + wait;
        self.again = Some(self.again.map_or(due, |again| again.min(due)));
        let Some(event) = event else { return Ok(()) };
        self.viewer.advance(self.now());
        for command in self.controls.commands(event, self.pixels(), self.now(), kept) {
            self.execute(&command)?;
        }
        Ok(())
    }

    /// Does what the script says up to now, each at its time.
    fn play(&mut self) -> Result<()> {
        while self.start.is_some() && self.steps.front().is_some_and(|step| step.time <= self.now()) {
            let Some(step) = self.steps.pop_front() else { break };
            self.viewer.advance(step.time);
            self.execute(&step.command)?;
        }
        Ok(())
    }

    /// Asks for the scene again if it is wanted, and takes it if it has come.
    fn reload(&mut self) -> Result<()> {
        if self.viewer.take_reload() {
            self.reloader.ask();
        }
        #[cfg(feature = "shader-reload")]
        if let Some(edited) = self.shaders.arrived() {
            self.stale = true;
            self.viewer.edited(edited)?;
        }
        let Some(loaded) = self.reloader.arrived() else { return Ok(()) };
        self.stale = true;
        self.viewer.reloaded(loaded)
    }

    /// What cannot be done is said, and all goes on.
    fn execute(&mut self, command: &Command) -> Result<()> {
        self.stale = true;
        match self.viewer.execute(command) {
            Err(fault @ (Error::Usage(_) | Error::NoDevice(_) | Error::Io { .. })) => {
                self.viewer.say(fault.to_string())
            }
            other => other?,
        }
        Ok(())
    }

    fn pixels(&self) -> Vec2 {
        let size = self.window.unwrap_or_else(|| self.viewer.session().size());
        Vec2::new(size.width as f32, size.height as f32)
    }

    /// Draws a frame and the panels, and shows them.
    fn picture(&mut self) -> Result<()> {
        let began = Instant::now();
        match self.viewer.frame(&mut self.plan) {
            Err(fault @ Error::Io { .. }) => self.viewer.say(fault.to_string()),
            other => other?.iter().for_each(|report| self.meter.passes.note(&report.passes)),
        }
        self.start.get_or_insert_with(Instant::now);
        for command in self.panels() {
            self.execute(&command)?;
        }
        let Some(window) = self.window else { return Ok(()) };
        let drawn = began.elapsed();
        let shown = self.screen.show(self.viewer.session().renderer().display_image(), window)?;
        self.stale = shown == Presented::Busy;
        self.meter.shown(drawn, self.viewer.stats().rays);
        self.write_shots()
    }

    /// Lays the panels out; what was clicked.
    fn panels(&mut self) -> Vec<Command> {
        let size = self.viewer.session().size();
        let points = egui::vec2(size.width as f32, size.height as f32) / self.scale;
        let mut input = self.input.take();
        input.screen_rect = Some(Rect::from_min_size(Pos2::ZERO, points));
        input.time = Some(self.now());
        input.viewports.entry(ViewportId::ROOT).or_default().native_pixels_per_point = Some(self.scale);
        let (viewer, controls, rate) = (&self.viewer, &self.controls, self.meter.rate());
        let mut commands = Vec::new();
        let Asked { platform, again } = self.screen.lay_out(input, |context| {
            commands = panels::lay_out(context, viewer, rate, &|code| controls.printed(code));
        });
        let message = self.viewer.message_left().unwrap_or(Duration::MAX);
        self.again = Instant::now().checked_add(again.min(message));
        (self.tell)(Reply::Platform(Box::new(platform)));
        commands
    }

    fn write_shots(&mut self) -> Result<()> {
        for shot in self.viewer.take_shots() {
            let written = shot.write(&mut self.screen, self.viewer.session_mut());
            match written {
                Ok(warning) => self.viewer.say(warning.unwrap_or_else(|| shot.path.display().to_string())),
                Err(fault @ Error::Io { .. }) => self.viewer.say(fault.to_string()),
                Err(fault) => return Err(fault),
            }
            self.stale = true;
        }
        Ok(())
    }
}

/// When the last pictures were shown.
#[derive(Default)]
struct Meter {
    /// With the rays so far.
    shown: VecDeque<(Instant, u64)>,
    last: Duration,
    passes: PassTimes,
    /// Memory of the process, with the time at which it was looked up.
    resident: Option<(Instant, u64)>,
}

impl Meter {
    fn shown(&mut self, drawn_in: Duration, rays: u64) {
        self.last = drawn_in;
        if self.resident.is_none_or(|(then, _)| then.elapsed() >= BETWEEN_LOOKS) {
            self.resident = system::resident_memory().map(|bytes| (Instant::now(), bytes));
        }
        self.shown.push_back((Instant::now(), rays));
        if self.shown.len() > MEAN_OF {
            self.shown.pop_front();
        }
    }

    /// How long until the next picture is due.
    fn until(&self, refresh: Duration) -> Duration {
        self.shown.back().map_or(Duration::ZERO, |(last, _)| refresh.saturating_sub(last.elapsed()))
    }

    fn rate(&self) -> Rate {
        let (Some((first, few)), Some((last, many))) = (self.shown.front(), self.shown.back()) else {
            return Rate::default();
        };
        let seconds = last.duration_since(*first).as_secs_f64().max(1e-6);
        Rate {
            pictures: (self.shown.len() - 1) as f64 / seconds,
            frame_ms: self.last.as_secs_f64() * 1e3,
            rays: many.saturating_sub(*few) as f64 / seconds,
            passes: self.passes,
            resident: self.resident.map(|(_, bytes)| bytes),
        }
    }
}
