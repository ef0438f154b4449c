//! A session by itself, as a window or a script drives it: no command line, a small scene, a few lines.
#![allow(clippy::unwrap_used, reason = "in a test, a panic is how a failure shows")]

mod support;

use crate::support::device::{self, add_quad, empty_scene, finish, view_of};
use glam::Vec3;
use penombre::error::{Error, Result};
use penombre::geom::bvh::Bvh;
use penombre::pass::{Renderer, UpdateMode};
use penombre::refine::replay::HostMesh;
use penombre::refine::update::EngineStats;
use penombre::scene::Scene;
use penombre::scene::camera::{Camera, ImageSize, View};
use penombre::scene::light::{Light, LightKind, LightState};
use penombre::session::{
    Batches, Budget, EndedBy, FrameReport, Observer, Options, Pace, Refinement, Session, Unobserved, owned_engine,
};
use std::sync::Arc;
use std::time::Duration;

/// A floor under a lamp, half of it in the shadow of a board.
fn floor() -> Arc<Scene> {
    let mut scene = empty_scene();
    add_quad(&mut scene, Vec3::new(-1.0, -0.8, 1.0), Vec3::X * 2.0, Vec3::Z * -2.0, 0, 1.0);
    add_quad(&mut scene, Vec3::new(-0.5, 0.0, 0.3), Vec3::X * 0.6, Vec3::Z * -0.6, 0, 1.0);
    let kind = LightKind::Point { position: Vec3::new(0.2, 1.5, 0.4), intensity: Vec3::splat(6.0) };
    scene.lights.push(Light { name: "lamp".to_owned(), kind });
    Arc::new(scene)
}

fn options(budget: Budget) -> Options {
    Options {
        size: ImageSize { width: 64, height: 48 },
        threads: Some(1),
        pace: Pace::Fixed(Batches { rays: 200, most: 200, counts_lag: 2 }),
        refinement: Refinement { indirect: false, ..Refinement::default() },
        budget,
        ..Options::default()
    }
}

/// A session with an engine of its own, watched by the validation layers, if there is a device.
fn with_session(options: &Options, test: impl FnOnce(&mut Session, &View)) {
    let Some(device) = device::device() else { return };
    let scene = floor();
    let made_for = options.renderer_options(&device).unwrap();
    let mut renderer = Renderer::with_options(Arc::clone(&device), options.size, made_for).unwrap();
    renderer.load(&scene).unwrap();
    renderer.resize(options.size).unwrap();
    let engine = owned_engine(&scene, &Arc::new(Bvh::build(&scene)), options).unwrap();
    let mut session = Session::new(renderer, engine, &scene, options);
    test(&mut session, &view_of(&scene, options.size.width, options.size.height));
    drop(session);
    finish(device);
}

/// Steps until a frame is the last, and returns all reports.
fn steps(session: &mut Session) -> Vec<FrameReport> {
    let mut reports: Vec<FrameReport> = Vec::new();
    while reports.last().is_none_or(|last| last.ended_by.is_none()) {
        reports.push(session.step(&mut Unobserved).unwrap());
        assert!(reports.len() < 1000, "no end in sight");
    }
    reports
}

#[test]
fn frames_are_reported_until_nothing_is_left_to_do() {
    with_session(&options(Budget::default()), |session, view| {
        assert!(session.step(&mut Unobserved).is_err() && session.still().is_err(), "there is no view");
        session.look(view, &[]).unwrap();
        let reports = steps(session);
        assert!(reports.len() > 3, "{}", reports.len());
        assert!(reports.iter().zip(0..).all(|(report, number)| report.frame == number));
        assert!(reports.windows(2).all(|two| two[0].at <= two[1].at && two[0].engine.rays <= two[1].engine.rays));
        let (first, last) = (&reports[0], reports.last().unwrap());
        assert!(first.camera_moved && first.combined && first.passes.full && !first.updates[0].patches.is_empty());
        assert!(reports[1..].iter().all(|report| !report.camera_moved));
        assert_eq!(last.ended_by, Some(EndedBy::Converged));
        assert!(last.engine.converged && last.engine.complete && last.combined && session.is_idle());
        assert!(session.unfinished(EndedBy::Converged).is_none());
        let totals = session.totals();
        assert_eq!((totals.frames, totals.engine), (reports.len() as u64, last.engine));
        let moments = [totals.first_picture, totals.lit_picture, totals.complete_picture, totals.last_picture];
        let moments = moments.map(|moment| moment.unwrap().at);
        assert!(moments.is_sorted() && moments[0] < moments[3], "{moments:?}");
        // Another eye: a new view, whose light is known in part.
        let moved = View { eye: view.eye + Vec3::X * 0.1, ..*view };
        session.look(&moved, &[]).unwrap();
        let next = session.step(&mut Unobserved).unwrap();
        assert_eq!((next.frame, next.camera_moved), (reports.len() as u64, true));
    });
}

/// Interrupts after so many frames, and wants pictures of them all.
struct Impatient {
    left: u64,
    seen: Vec<u64>,
}

impl Observer for Impatient {
    fn interrupted(&self) -> bool {
        self.left == self.seen.len() as u64 + 1
    }

    fn wants_picture(&mut self, _: &EngineStats) -> bool {
        true
    }

    fn frame(&mut self, session: &mut Session, report: &FrameReport) -> Result<()> {
        assert!(report.combined && session.totals().frames == report.frame + 1);
        self.seen.push(report.frame);
        Ok(())
    }
}

#[test]
fn an_observer_ends_a_run() {
    with_session(&Options { refresh: Some(Duration::MAX), ..options(Budget::default()) }, |session, view| {
        session.look(view, &[]).unwrap();
        let mut observer = Impatient { left: 3, seen: Vec::new() };
        assert_eq!(session.run(&mut observer).unwrap(), EndedBy::Interrupted);
        assert_eq!(observer.seen, [0, 1, 2]);
        assert_eq!(session.run(&mut Unobserved).unwrap(), EndedBy::Converged, "it can go on");
    });
}

#[test]
fn budgets_end_a_run() {
    let rays = Budget { rays: Some(600), ..Budget::default() };
    let frames = Budget { frames: Some(2), ..Budget::default() };
    for (budget, by) in [(rays, EndedBy::Rays), (frames, EndedBy::Frames)] {
        with_session(&options(budget), |session, view| {
            session.look(view, &[]).unwrap();
            assert_eq!(session.run(&mut Unobserved).unwrap(), by);
        });
    }
}

#[test]
fn the_same_steps_make_the_same_picture_wherever_the_engine_runs() {
    let Some(device) = device::device() else { return };
    drop(device);
    let picture = |mut session: Session| {
        session.run(&mut Unobserved).unwrap();
        let still = session.still().unwrap();
        (still.combined, still.layers.d, still.level)
    };
    let scene = floor();
    let budget = Budget { rays: Some(2_000), ..Budget::default() };
    let on_threads = |threads| {
        let options = Options { threads: Some(threads), ..options(budget) };
        let mut session = Session::open(&scene, &options).unwrap();
        session.look(&view_of(&scene, 64, 48), &[]).unwrap();
        picture(session)
    };
    let one = on_threads(1);
    assert!(one.0.iter().any(|pixel| pixel.x > 0.0) && one.2.iter().any(|&level| level > 0));
    assert!(one == on_threads(1) && one == on_threads(2));
    with_session(&options(budget), |session, view| {
        session.look(view, &[]).unwrap();
        session.run(&mut Unobserved).unwrap();
        let still = session.still().unwrap();
        assert!(one == (still.combined, still.layers.d, still.level), "in the caller's thread");
    });
}

#[test]
fn the_engine_runs_ahead_at_a_free_pace() {
    let Some(device) = device::device() else { return };
    drop(device);
    let scene = floor();
    let options = Options { pace: Pace::Free, ..options(Budget::default()) };
    let mut session = Session::open(&scene, &options).unwrap();
    session.look(&view_of(&scene, 64, 48), &[]).unwrap();
    assert_eq!(session.run(&mut Unobserved).unwrap(), EndedBy::Converged);
    assert!(session.totals().engine.complete && session.memory_bytes() > 0);
}

#[test]
fn a_recording_starts_with_every_vertex_lit_and_can_be_replayed() {
    // Indirect light, which is not done as soon as every vertex has a value.
    let mut options = Options { update: UpdateMode::Full, ..options(Budget::default()) };
    options.refinement.indirect = true;
    with_session(&options, |session, view| {
        let updates = session.record(view, 5, &mut Unobserved).unwrap();
        assert_eq!(updates.len(), 6);
        assert!(updates[0].stats.complete && updates[0].patches.iter().all(|patch| patch.old.is_empty()));
        assert!(updates.windows(2).all(|two| two[0].sequence < two[1].sequence));
        let mut mesh = HostMesh::default();
        updates.iter().for_each(|update| mesh.apply(update).unwrap());
        assert!(mesh.drawn().count() > updates[0].patch_triangles.len(), "it was refined");
    });
}

#[test]
fn a_lost_device_is_made_anew_and_the_pictures_are_the_same() {
    let mut limited = options(Budget { rays: Some(2_000), ..Budget::default() });
    limited.refinement.indirect = true;
    let picture = |lose_device_at: Vec<u64>| {
        let mut picture = None;
        with_session(&Options { lose_device_at, ..limited.clone() }, |session, view| {
            session.look(view, &[LightState::times(Vec3::splat(0.5))]).unwrap();
            let mut losses = 0;
            let by = loop {
                match session.run(&mut Unobserved) {
                    Ok(by) => break by,
                    Err(fault) => session.recover(fault).unwrap(),
                }
                losses += 1;
            };
            let (still, totals) = (session.still().unwrap(), session.totals());
            picture = Some(((still.combined, still.layers.d, still.level), (by, totals.frames), losses));
        });
        picture
    };
    let Some((still, end, losses)) = picture(vec![]) else { return };
    assert!(losses == 0 && end.1 > 6 && still.0.iter().any(|pixel| pixel.x > 0.0));
    for at in [0, 1, 5] {
        let Some(lost) = picture(vec![at]) else { panic!("the device is gone") };
        assert_eq!((lost.1, lost.2), (end, 1), "frame {at}");
        assert!(lost.0 == still, "frame {at}");
    }
}

#[test]
fn a_device_that_is_lost_again_at_once_is_given_up() {
    let lost = Options { lose_device_at: vec![1, 2], ..options(Budget::default()) };
    with_session(&lost, |session, view| {
        session.look(view, &[]).unwrap();
        let fault = session.run(&mut Unobserved).unwrap_err();
        session.recover(fault).unwrap();
        let fault = session.run(&mut Unobserved).unwrap_err();
        let fault = session.recover(fault).unwrap_err();
        assert_eq!((fault.exit_status(), fault.to_string().contains("was lost")), (4, true), "{fault}");
        let other = session.recover(Error::Usage("no".to_owned())).unwrap_err();
        assert_eq!(other.exit_status(), 2, "no device was lost");
    });
}

/// Two walls of many facets that face each other, half of each in the shadow of boards.
fn two_walls() -> Arc<Scene> {
    const CELLS: u32 = 20;
    let mut scene = empty_scene();
    for (z, across) in [(-2.0, Vec3::X), (2.0, -Vec3::X)] {
        for cell in 0..CELLS * CELLS {
            let step = 2.0 / CELLS as f32;
            let [i, j] = [cell % CELLS, cell / CELLS].map(|i| i as f32 * step);
            let corner = across * (i - 1.0) + Vec3::Y * (j - 1.0) + Vec3::Z * z;
            add_quad(&mut scene, corner, across * step, Vec3::Y * step, 0, 1.0);
        }
        add_quad(&mut scene, Vec3::new(-0.3, -0.4, z * 0.8), across * 0.5, Vec3::Y * 0.7, 0, 1.0);
    }
    let kind = LightKind::Point { position: Vec3::new(0.2, 0.3, 0.1), intensity: Vec3::splat(6.0) };
    scene.lights.push(Light { name: "lamp".to_owned(), kind });
    Arc::new(scene)
}

/// Looks from wall to wall and back, so often; the last pictures of each, and the engine's totals.
fn look_around(memory: Option<u64>) -> ([Vec<glam::Vec4>; 2], EngineStats) {
    let budget = Budget { rays: Some(0), ..Budget::default() };
    let options = Options { memory, pace: Pace::Fixed(Batches { rays: 1000, ..Batches::A_FRAME }), ..options(budget) };
    let scene = two_walls();
    let mut session = Session::open(&scene, &options).unwrap();
    let view = |z: f32| {
        let camera = Camera { position: Vec3::ZERO, look_at: Vec3::Z * z, up: Vec3::Y, vertical_fov: 60.0 };
        scene.view(&camera, options.size)
    };
    let mut pictures = [Vec::new(), Vec::new()];
    for turn in 0..6 {
        session.look(&view([-1.0, 1.0][turn % 2]), &[]).unwrap();
        (0..40).for_each(|_| _ = session.step(&mut Unobserved).unwrap());
        pictures[turn % 2] = session.still().unwrap().combined;
    }
    (pictures, session.totals().engine)
}

/// What is drawn after triangles and slots were taken back and their numbers used again is what is drawn of an engine with room for all.
#[test]
fn pictures_within_a_memory_budget_are_those_without() {
    let Some(device) = device::device() else { return };
    drop(device);
    let (free, stats) = look_around(None);
    let (tight, tight_stats) = look_around(Some(stats.memory.held * 7 / 10));
    assert!(tight_stats.memory.evicted > 500 && tight_stats.memory.paged_in > 10, "{:?}", tight_stats.memory);
    assert!(tight_stats.memory.held < stats.memory.held * 3 / 4, "{:?} {:?}", tight_stats.memory, stats.memory);
    for (a, b) in free.iter().zip(&tight) {
        let off: f32 = a.iter().zip(b).map(|(a, b)| (*a - *b).abs().x).sum();
        let worst = a.iter().zip(b).map(|(a, b)| (*a - *b).abs().x).fold(0.0, f32::max);
        let mean: f32 = a.iter().map(|pixel| pixel.x).sum();
        assert!(off < mean * 0.01, "{off} of {mean}, {worst} at most");
    }
}
