//! The window itself, on the thread that the system wants it on: what happens to it is passed on to the [`stage`](super::stage).

use super::controls::{Button, Event};
use super::reload::Reloader;
use super::screen::Screen;
use super::stage::{Message, Reply, Stage};
use super::viewer::Viewer;
use super::{Plan, libraries, lost_display};
use crate::error::{Error, Result};
use crate::geom::bvh::Bvh;
use crate::scene::Scene;
use crate::scene::camera::ImageSize;
use crate::session::{Gpu, Hierarchy, Options};
use crate::vk::{Device, DeviceOptions, Presenter, Vsync, WindowHandles};
use crate::{system, trace};
use crossbeam_channel::{Receiver, Sender, bounded, unbounded};
use egui::{Context, ViewportId};
use glam::Vec2;
use std::path::PathBuf;
use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::{Duration, Instant};
use winit::application::ApplicationHandler;
use winit::dpi::PhysicalSize;
use winit::error::EventLoopError;
use winit::event::{ElementState, MouseButton, MouseScrollDelta, WindowEvent};
use winit::event_loop::{ActiveEventLoop, EventLoop, EventLoopProxy};
use winit::keyboard::{Key, PhysicalKey};
use winit::platform::modifier_supplement::KeyEventExtModifierSupplement as _;
use winit::window::{Window, WindowId};

/// Pixels of a wheel that scrolls by pixels that count as a notch.
const NOTCH: f64 = 50.0;

/// The smallest window, pixels.
const LEAST: PhysicalSize<u32> = PhysicalSize::new(64, 64);

/// What is said where there is no display any more.
const GONE: &str = "the display is gone";

/// How long a display that is gone leaves to what draws.
const PATIENCE: Duration = Duration::from_secs(5);

/// What a window shows.
pub struct Show {
    /// The scene.
    pub scene: Arc<Scene>,
    /// Its hierarchy in the making.
    pub hierarchy: Hierarchy,
    /// How it is drawn: each frame makes a picture.
    pub options: Options,
    /// Whether pictures wait for the display.
    pub vsync: Vsync,
    /// What is done.
    pub plan: Plan,
    /// Title of the window.
    pub title: String,
    /// Ends the process where nothing else can be done.
    pub give_up: fn(&Error) -> !,
}

/// Checks that a window can be opened, before anything else is done.
///
/// # Errors
/// [`Error::NoWindow`] that says what is missing.
pub fn check() -> Result<()> {
    if cfg!(all(unix, not(target_vendor = "apple"))) {
        libraries::check(|name| std::env::var(name).ok(), system::can_load)?;
    }
    Ok(())
}

/// Opens a window and shows it until it is closed; the files that were recorded.
///
/// # Errors
/// [`Error::NoWindow`] if none can be opened, [`Error::NoDevice`] if nothing can draw to it; a lost device.
pub fn run(show: Show) -> Result<Vec<PathBuf>> {
    let events = EventLoop::<Reply>::with_user_event().build();
    let events = events.map_err(|e| Error::NoWindow(format!("the display cannot be opened: {}", reason(&e))))?;
    let (outbox, inbox) = unbounded();
    let (drawing_goes_on, until_drawn) = bounded(0);
    let (close, give_up) = (outbox.clone(), show.give_up);
    lost_display::when_lost(move || {
        // What is recorded is written, and the device freed, before the end.
        let _ = close.send(Message::Closed);
        let _ = until_drawn.recv_timeout(PATIENCE);
        give_up(&Error::NoWindow(GONE.to_owned()))
    });
    let mut app = App {
        show: Some((show, inbox)),
        drawing_goes_on: Some(drawing_goes_on),
        outbox,
        proxy: events.create_proxy(),
        window: None,
        panels: None,
        drawing: None,
        ended: Ok(()),
    };
    let ran = events.run_app(&mut app).map_err(|e| match e {
        EventLoopError::ExitFailure(_) => Error::NoWindow(GONE.to_owned()),
        other => Error::NoWindow(format!("{GONE}: {}", reason(&other))),
    });
    app.finish().and_then(|recorded| ran.map(|()| recorded))
}

/// Why there is no display, without the place in winit's source that comes first.
fn reason(fault: &EventLoopError) -> String {
    let text = fault.to_string();
    text.rsplit(": ").next().unwrap_or(&text).to_owned()
}

struct App {
    /// Until the window is there.
    show: Option<(Show, Receiver<Message>)>,
    /// Gone once nothing is drawn any more.
    drawing_goes_on: Option<Sender<()>>,
    outbox: Sender<Message>,
    proxy: EventLoopProxy<Reply>,
    window: Option<Arc<Window>>,
    /// Turns events into what panels take.
    panels: Option<egui_winit::State>,
    /// The thread that draws.
    drawing: Option<JoinHandle<Result<Vec<PathBuf>>>>,
    ended: Result<()>,
}

impl App {
    fn open(&mut self, events: &ActiveEventLoop) -> Result<()> {
        let Some((show, inbox)) = self.show.take() else { return Ok(()) };
        let ImageSize { width, height } = show.options.size;
        let attributes = Window::default_attributes()
            .with_title(show.title.clone())
            .with_inner_size(PhysicalSize::new(width, height))
            .with_min_inner_size(LEAST);
        let window = events.create_window(attributes);
        let window = Arc::new(window.map_err(|e| Error::NoWindow(format!("no window can be opened: {e}")))?);
        let (context, scale) = (Context::default(), window.scale_factor() as f32);
        let panels = egui_winit::State::new(context.clone(), ViewportId::ROOT, &*window, Some(scale), None, None);
        let (shared, proxy, goes_on) = (Arc::clone(&window), self.proxy.clone(), self.drawing_goes_on.take());
        let drawing = std::thread::Builder::new().name("penombre-draw".to_owned()).spawn(move || {
            let tell = {
                let proxy = proxy.clone();
                // Fails if the window is gone, which the inbox tells, too.
                move |reply| drop(proxy.send_event(reply))
            };
            let drawn = draw(show, shared, context, (inbox, tell));
            drop(goes_on);
            drop(proxy.send_event(Reply::Ended));
            drawn
        });
        self.drawing = Some(drawing.map_err(|e| Error::Exhausted(format!("cannot start a thread: {e}")))?);
        (self.window, self.panels) = (Some(window), Some(panels));
        Ok(())
    }

    fn tell(&self, message: Message) {
        // Fails only if drawing has ended, which is told by a reply.
        let _ = self.outbox.send(message);
    }

    /// Waits for the thread that draws; how all ended.
    fn finish(mut self) -> Result<Vec<PathBuf>> {
        self.tell(Message::Closed);
        let drawn = self.drawing.take().map(JoinHandle::join);
        let drawn = drawn.unwrap_or(Ok(Ok(Vec::new())));
        let drawn = drawn.map_err(|_| Error::Internal("the thread that draws panicked".to_owned()));
        self.ended.and_then(|()| drawn.flatten())
    }
}

impl ApplicationHandler<Reply> for App {
    fn resumed(&mut self, events: &ActiveEventLoop) {
        if let Err(fault) = self.open(events) {
            self.ended = Err(fault);
            events.exit();
        }
    }

    fn user_event(&mut self, events: &ActiveEventLoop, reply: Reply) {
        match (reply, &self.window, &mut self.panels) {
            (Reply::Platform(output), Some(window), Some(panels)) => panels.handle_platform_output(window, *output),
            (Reply::Ended, ..) => events.exit(),
            _ => {}
        }
    }

    fn window_event(&mut self, _: &ActiveEventLoop, _: WindowId, event: WindowEvent) {
        let (Some(window), Some(panels)) = (&self.window, &mut self.panels) else { return };
        let _ = panels.on_window_event(window, &event);
        let input = Box::new(panels.egui_input_mut().take());
        let told = match &event {
            WindowEvent::Resized(PhysicalSize { width: 0, .. } | PhysicalSize { height: 0, .. }) => {
                Message::Resized(None)
            }
            WindowEvent::Resized(PhysicalSize { width, height }) => {
                Message::Resized(Some(ImageSize { width: *width, height: *height }))
            }
            WindowEvent::ScaleFactorChanged { scale_factor, .. } => Message::Scaled(*scale_factor as f32),
            WindowEvent::Occluded(hidden) => Message::Seen(!hidden),
            WindowEvent::CloseRequested | WindowEvent::Destroyed => Message::Closed,
            _ => Message::Happened(input, translate(event)),
        };
        self.tell(told);
    }
}

/// An event as the controls take it.
fn translate(event: WindowEvent) -> Option<Event> {
    match event {
        WindowEvent::KeyboardInput { event, is_synthetic, .. } => {
            let PhysicalKey::Code(code) = event.physical_key else { return None };
            let printed = match event.key_without_modifiers() {
                Key::Character(text) if !text.trim().is_empty() => Some(text.to_uppercase()),
                _ => None,
            };
            let pressed = event.state == ElementState::Pressed;
            // Keys that were down before the window had the keyboard are not meant for it.
            (!(is_synthetic && pressed)).then_some(Event::Key { code, pressed, repeat: event.repeat, printed })
        }
        WindowEvent::ModifiersChanged(modifiers) => {
            let state = modifiers.state();
            let [control, shift, alt] = [state.control_key(), state.shift_key(), state.alt_key()];
            Some(Event::Modifiers { control, shift, alt })
        }
        WindowEvent::CursorMoved { position, .. } => {
            Some(Event::Cursor(Vec2::new(position.x as f32, position.y as f32)))
        }
        WindowEvent::MouseInput { state, button, .. } => {
            let button = match button {
                MouseButton::Left => Button::Left,
                MouseButton::Middle => Button::Middle,
                MouseButton::Right => Button::Right,
                _ => return None,
            };
            Some(Event::Button { button, pressed: state == ElementState::Pressed })
        }
        WindowEvent::MouseWheel { delta, .. } => Some(Event::Wheel(match delta {
            MouseScrollDelta::LineDelta(_, lines) => lines,
            MouseScrollDelta::PixelDelta(pixels) => (pixels.y / NOTCH) as f32,
        })),
        WindowEvent::Focused(false) => Some(Event::FocusLost),
        _ => None,
    }
}

/// Everything on the thread that draws.
fn draw(
    show: Show,
    window: Arc<Window>,
    context: Context,
    (inbox, tell): (Receiver<Message>, impl Fn(Reply)),
) -> Result<Vec<PathBuf>> {
    let Show { scene, hierarchy, mut options, vsync, plan, .. } = show;
    let start = Instant::now();
    let scale = window.scale_factor() as f32;
    let PhysicalSize { width, height } = window.inner_size();
    options.size = ImageSize { width: width.max(1), height: height.max(1) };
    let wanted = DeviceOptions { device: options.device.clone(), validation: None };
    let handles: Arc<dyn WindowHandles> = window;
    let open = move || -> Result<_> {
        let (device, surface) = Device::for_window(&wanted, Arc::clone(&handles))?;
        let presenter = Presenter::new(&device, surface, vsync)?;
        Ok((device, Some(presenter)))
    };
    let (device, presenter) = trace::within("open device", &open)?;
    let refresh = refresh_of(&device);
    let gpu = Gpu::new(Arc::clone(&device), start.elapsed(), &options)?;
    let finish = move |scene: &Scene| -> Arc<Bvh> { hierarchy.finish(scene) };
    let session = gpu.session(&scene, finish, &options)?;
    let screen = Screen::new(&device, options.size, presenter, context)?;
    // Only the session and the screen keep it.
    drop(device);
    let viewer = Viewer::new(session, plan.camera, plan.name.clone(), plan.open);
    let reloader = Reloader::start(plan.source.clone())?;
    Stage::new(viewer, screen, plan, (inbox, tell), (scale, refresh), (reloader, Box::new(open))).run()
}

/// Time between two pictures while only the light changes: on a CPU, drawing takes its time from the engine.
fn refresh_of(device: &Device) -> Duration {
    Duration::from_millis(if device.report().is_cpu() { 100 } else { 33 })
}
