//! Camera moves that are drawn before the engine has answered: a small room, and an engine that is held by long batches.
#![allow(clippy::unwrap_used, reason = "in a test, a panic is how a failure shows")]

mod support;

use crate::support::device::{self, add_material, add_quad, empty_scene, finish};
use glam::{Vec2, Vec3};
use penombre::geom::bvh::Bvh;
use penombre::pass::{FrameOptions, Layers, Renderer};
use penombre::refine::engine::Engine;
use penombre::refine::thread::{Crew, EngineThread, Pace as ThreadPace};
use penombre::refine::update::Update;
use penombre::scene::camera::{Camera, ImageSize, View};
use penombre::scene::light::{Light, LightKind};
use penombre::scene::material::Model;
use penombre::scene::{FaceId, Scene};
use penombre::session::{Budget, FrameReport, LightEngine, Moves, Options, Quality, Refinement, Session, Unobserved};
use std::sync::Arc;
use std::time::Duration;

const SIZE: ImageSize = ImageSize { width: 64, height: 48 };
/// How long a batch of the engine lasts: frames of the room take some milliseconds.
const HELD: Duration = Duration::from_millis(150);

/// A room with a screen across it, behind which parts of it come into view as the camera goes aside; the floor is glossy or not.
fn room(glossy: bool) -> Arc<Scene> {
    let mut scene = empty_scene();
    let floor = add_material(&mut scene, |m| {
        (m.kd, m.model) = (Vec3::splat(0.5), Model::phong(Vec3::splat(if glossy { 0.4 } else { 0.0 }), 20.0));
    });
    let white = add_material(&mut scene, |m| m.kd = Vec3::splat(0.7));
    let [x, y, z] = [Vec3::X, Vec3::Y, Vec3::Z].map(|axis| axis * 2.0);
    add_quad(&mut scene, Vec3::new(-1.0, -1.0, 1.0), x, -z, floor, 1.0);
    add_quad(&mut scene, Vec3::new(-1.0, 1.0, -1.0), x, z, white, 1.0);
    add_quad(&mut scene, Vec3::new(-1.0, -1.0, -1.0), x, y, white, 1.0);
    add_quad(&mut scene, Vec3::new(-1.0, -1.0, 1.0), -z, y, white, 1.0);
    add_quad(&mut scene, Vec3::new(1.0, -1.0, -1.0), z, y, white, 1.0);
    // A block: its side is hidden from the middle of the room.
    add_quad(&mut scene, Vec3::new(-0.5, -1.0, 0.0), x * 0.25, y * 0.5, white, 1.0);
    add_quad(&mut scene, Vec3::new(0.0, -1.0, 0.0), z * -0.25, y * 0.5, white, 1.0);
    add_quad(&mut scene, Vec3::new(-0.5, 0.0, 0.0), x * 0.25, z * -0.25, white, 1.0);
    let kind = LightKind::Point { position: Vec3::new(0.6, 0.7, 0.6), intensity: Vec3::splat(2.0) };
    scene.lights.push(Light { name: "lamp".to_owned(), kind });
    Arc::new(scene)
}

fn view(scene: &Scene, x: f32) -> View {
    let camera = Camera {
        position: Vec3::new(x, 0.2, 2.6),
        look_at: Vec3::new(0.0, -0.2, 0.0),
        up: Vec3::Y,
        vertical_fov: 45.0,
    };
    scene.view(&camera, SIZE)
}

/// A session that draws moves at once, with an engine that looks for commands between long batches only.
fn with_held_engine(glossy: bool, test: impl FnOnce(&mut Held)) {
    let Some(device) = device::device() else { return };
    let scene = room(glossy);
    let mut refinement = Refinement { thresholds: Quality::Final.thresholds(), ..Refinement::default() };
    // Never done.
    refinement.thresholds.tolerance = 1e-9;
    let options = Options {
        size: SIZE,
        threads: Some(1),
        moves: Moves::AtOnce,
        refinement,
        refresh: Some(Duration::MAX),
        budget: Budget::default(),
        ..Options::default()
    };
    let renderer = || {
        let made_for = options.renderer_options(&device).unwrap();
        let mut renderer = Renderer::with_options(Arc::clone(&device), SIZE, made_for).unwrap();
        renderer.load(&scene).unwrap();
        renderer.resize(SIZE).unwrap();
        renderer
    };
    let (bvh, of, engine_options) = (Arc::new(Bvh::build(&scene)), Arc::clone(&scene), options.engine_options(&scene));
    let build = move |workers| Engine::new(of, bvh, workers, engine_options);
    let crew = Crew { threads: 1, beside_frames: false };
    let thread = EngineThread::spawn(ThreadPace::Free(HELD), crew, build, |_| {}).unwrap();
    let session = Session::new(renderer(), LightEngine::Thread(thread), &scene, &options);
    let mut held = Held { session, mirror: renderer(), scene, answered: Vec::new() };
    test(&mut held);
    drop(held);
    finish(device);
}

struct Held {
    session: Session,
    /// Knows what the engine has told, and draws it anew.
    mirror: Renderer,
    scene: Arc<Scene>,
    /// The views that the engine has answered, by generation.
    answered: Vec<u32>,
}

impl Held {
    fn step(&mut self) -> FrameReport {
        let report = self.session.step(&mut Unobserved).unwrap();
        report.updates.iter().for_each(|update| self.mirror.apply(update).unwrap());
        self.answered.extend(report.updates.iter().map(|update: &Update| update.generation));
        self.answered.dedup();
        report
    }

    /// Moves the camera, and draws.
    fn look(&mut self, x: f32) -> FrameReport {
        let view = view(&self.scene, x);
        self.session.look(&view, &[]).unwrap();
        self.step()
    }

    /// Steps until the engine has answered a view.
    fn answer(&mut self, generation: u32) {
        while self.answered.last() != Some(&generation) {
            self.step();
        }
    }

    /// Likewise, and then to the end of a batch: the next one has just begun.
    fn settle(&mut self, generation: u32) {
        self.answer(generation);
        self.step();
    }

    fn layers(&mut self) -> Layers {
        self.session.renderer_mut().read_layers().unwrap()
    }

    /// What is seen from a place in the light that the engine has told of, all drawn anew.
    fn drawn_anew(&mut self, x: f32) -> Layers {
        let display = Some(self.scene.display);
        self.mirror.set_view(&view(&self.scene, x), Vec2::ZERO);
        self.mirror.visibility().unwrap();
        let all = FrameOptions { full_luminance: true, colour: true, combine: display, ..FrameOptions::default() };
        self.mirror.frame(&all).unwrap();
        self.mirror.read_layers().unwrap()
    }
}

fn luminance(layers: &Layers, pixel: usize) -> f32 {
    layers.combined[pixel].iter().take(3).sum()
}

#[test]
fn a_move_is_drawn_before_the_engine_answers_and_no_face_is_black() {
    with_held_engine(false, |held| {
        held.look(-0.6);
        held.settle(1);
        let before = held.layers();
        let moved = held.look(0.9);
        assert!(moved.camera_moved && moved.combined && moved.passes.full, "{moved:?}");
        assert_eq!((held.answered.last(), moved.ended_by), (Some(&1), None), "drawn before the answer");
        let at_once = held.layers();
        // The block's side was hidden.
        let side = |layers: &Layers| {
            let shows = |&&id: &&u32| (12..14).contains(&(FaceId(id.max(1) - 1).triangle().0));
            layers.face_id.iter().filter(shows).count()
        };
        assert!(side(&before) == 0 && side(&at_once) > 30 && moved.filled_faces >= 1, "{}", side(&at_once));
        held.answer(2);
        let (answered, anew) = (held.layers(), held.drawn_anew(0.9));
        assert!(answered == anew, "the light is what it is where nothing is drawn at once");
        assert!(at_once.face_id == anew.face_id && at_once.kd == anew.kd, "geometry is exact");
        for pixel in 0..SIZE.pixels() {
            let [shown, right] = [&at_once, &anew].map(|layers| luminance(layers, pixel));
            assert!(shown >= 0.25 * right && shown < 4.0 * right + 0.05, "pixel {pixel}: {shown} for {right}");
        }
        assert_eq!(held.session.totals().ahead.filled, 1);
        let stands = held.step();
        assert_eq!((stands.camera_moved, stands.filled_faces, stands.stale_specular), (false, 0, false));
    });
}

#[test]
fn highlights_lag_by_two_pictures_at_most_and_views_that_are_superseded_are_not_answered() {
    with_held_engine(true, |held| {
        held.look(-0.6);
        held.settle(1);
        let mut stale = Vec::new();
        for step in 1..=7 {
            let report = held.look(-0.6 + 0.1 * step as f32);
            assert!(report.combined);
            stale.push(report.stale_specular);
            let (view, answered) = (step + 1, *held.answered.last().unwrap());
            assert!(answered + 2 >= view, "S of view {answered} in a picture of view {view}");
        }
        assert_eq!(stale, [true, true, false, true, true, false, true]);
        assert_eq!(held.answered, [1, 4, 7], "each time the newest");
        assert_eq!(held.session.totals().ahead.stale_specular, 5);
        held.answer(8);
        let (answered, anew) = (held.layers(), held.drawn_anew(0.1));
        assert!(answered.face_id == anew.face_id && answered.kd == anew.kd && answered.s == anew.s);
        // On edges of drawn triangles either may show: a step of half precision.
        let differs = |(a, b): (&[f32; 3], &[f32; 3])| (a[0] - b[0]).abs() > 1e-3 * b[0];
        assert!(!answered.d.iter().zip(&anew.d).any(differs));
    });
}

#[test]
fn diffuse_light_waits_for_nothing() {
    with_held_engine(false, |held| {
        held.look(-0.6);
        held.settle(1);
        let stale = (1..=5).filter(|&step| held.look(-0.6 + 0.1 * step as f32).stale_specular).count();
        assert_eq!((stale, held.answered.last()), (0, Some(&1)));
    });
}
