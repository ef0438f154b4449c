//! The path-traced reference in place of the picture and beside it.
#![allow(clippy::unwrap_used, reason = "in a test, a panic is how a failure shows")]

use crate::{converge, room, with_session};
use glam::{Vec3, Vec4};
use penombre::app::command::Command;
use penombre::app::path_traced::{PathTraced, Share, Subject};
use penombre::app::viewer::{Open, Viewer};
use penombre::app::views::View as DebugView;
use penombre::geom::bvh::Bvh;
use penombre::image::tone_mapping::display;
use penombre::light::context::SceneContext;
use penombre::light::lights::Lights;
use penombre::reference::{Accumulator, Filter, Settings, Strategy, Transport};
use penombre::scene::camera::View;
use penombre::scene::light::LightKind;
use penombre::scene::{Display, Scene};
use penombre::session::{Options, Pace, Unobserved};
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

/// Runs a test on a viewer of the room in direct light, once nothing of it is left to do.
fn with_viewer(test: impl FnOnce(Viewer)) {
    with_session(room(), false, |mut session| {
        converge(&mut session);
        let camera = session.scene().cameras[0].camera;
        let open = Open { hud: false, lights: false, help: false };
        let mut viewer = Viewer::new(session, camera, PathBuf::from("room"), open);
        // The engine hears late of what was drawn.
        let mut still = 0;
        while still < 5 {
            execute(&mut viewer, &[Command::Exposure(0.0)]);
            let report = viewer.frame(&mut Unobserved).unwrap().unwrap();
            still = if report.updates.iter().all(|update| update.patches.is_empty()) { still + 1 } else { 0 };
        }
        test(viewer);
    });
}

fn execute(viewer: &mut Viewer, commands: &[Command]) {
    commands.iter().for_each(|command| viewer.execute(command).unwrap());
}

/// What is shown after some frames.
fn shown(viewer: &mut Viewer, frames: u32) -> Vec<[u8; 4]> {
    for _ in 0..frames {
        viewer.frame(&mut Unobserved).unwrap();
    }
    viewer.session_mut().renderer_mut().read_display().unwrap()
}

/// The same path tracer by itself, all pixels at once.
fn traced(scene: &Scene, view: &View, transport: Transport, samples: u32) -> Vec<Vec4> {
    let (bvh, lights) = (Bvh::build(scene), Lights::new(scene));
    let context = SceneContext::new(scene, &bvh, &lights, 0, scene.scale());
    let settings = Settings { filter: Filter::Point, transport, strategy: Strategy::Both };
    let mut accumulator = Accumulator::new(view);
    (0..samples).for_each(|_| assert!(accumulator.pass(&context, view, settings, || false).finished));
    accumulator.image().mean
}

/// Largest difference of bytes to what radiance is displayed as.
fn difference(shown: &[[u8; 4]], radiance: &[Vec4], how: Display) -> u8 {
    let pair = |(shown, radiance): (&[u8; 4], &Vec4)| {
        let [r, g, b] = display(radiance.truncate(), how.exposure, how.tone_mapping);
        let expected = [r, g, b, (radiance.w * 255.0 + 0.5) as u8];
        shown.iter().zip(expected).map(|(shown, expected)| shown.abs_diff(expected)).max().unwrap()
    };
    shown.iter().zip(radiance).map(pair).max().unwrap()
}

#[test]
fn the_reference_is_that_of_the_path_tracer_and_the_picture_comes_back() {
    with_viewer(|mut viewer| {
        execute(&mut viewer, &[Command::Exposure(0.7)]);
        let picture = shown(&mut viewer, 1);
        execute(&mut viewer, &[Command::Reference(true)]);
        let view = *viewer.session().view().unwrap();
        let first = shown(&mut viewer, 3);
        assert_eq!(viewer.reference_samples(), Some(3));
        let how = viewer.session().display();
        let expected = traced(&room(), &view, Transport::Direct, 3);
        assert!(difference(&first, &expected, how) <= 1, "{}", difference(&first, &expected, how));
        assert!(difference(&picture, &expected, how) > 1, "the picture interpolates");
        execute(&mut viewer, &[Command::Reference(false)]);
        assert!(shown(&mut viewer, 1) == picture);
        assert_eq!(viewer.reference_samples(), None);
        execute(&mut viewer, &[Command::Reference(true)]);
        let later = shown(&mut viewer, 2);
        assert_eq!(viewer.reference_samples(), Some(5), "it goes on where it stopped");
        assert!(difference(&later, &traced(&room(), &view, Transport::Direct, 5), how) <= 1);
    });
}

#[test]
fn a_move_or_another_light_begins_anew() {
    with_viewer(|mut viewer| {
        execute(&mut viewer, &[Command::Reference(true)]);
        shown(&mut viewer, 3);
        let dimmed =
            [Command::DimLight("left".to_owned(), 0.5), Command::ColourLight("right".to_owned(), [0.2, 1.0, 3.0])];
        execute(&mut viewer, &dimmed);
        let now = shown(&mut viewer, 3);
        assert_eq!(viewer.reference_samples(), Some(2), "the first frame of a view comes before it");
        let mut scene = room();
        for (light, factor) in scene.lights.iter_mut().zip([Vec3::splat(0.5), Vec3::new(0.2, 1.0, 3.0)]) {
            let LightKind::Point { intensity, .. } = &mut light.kind else { panic!("a lamp") };
            *intensity *= factor;
        }
        let view = *viewer.session().view().unwrap();
        let how = viewer.session().display();
        let off = difference(&now, &traced(&scene, &view, Transport::Direct, 2), how);
        assert!(off <= 1, "{off}");
        execute(&mut viewer, &[Command::Pan([0.1, 0.0])]);
        let moved = shown(&mut viewer, 2);
        assert_eq!(viewer.reference_samples(), Some(1));
        let view = *viewer.session().view().unwrap();
        assert!(difference(&moved, &traced(&scene, &view, Transport::Direct, 1), how) <= 1);
    });
}

#[test]
fn beside_it_is_the_right_half() {
    with_viewer(|mut viewer| {
        let picture = shown(&mut viewer, 1);
        let beside = DebugView::named("beside").unwrap();
        execute(&mut viewer, &[Command::View(beside, None)]);
        let both = shown(&mut viewer, 2);
        let (size, how) = (viewer.session().size(), viewer.session().display());
        let view = *viewer.session().view().unwrap();
        let expected = traced(&room(), &view, Transport::Direct, 2);
        let middle = size.width as usize / 2;
        for (y, row) in both.chunks(size.width as usize).enumerate() {
            let at = y * size.width as usize;
            assert!(row[..middle] == picture[at..at + middle], "row {y}");
            let line = [255, 217, 77, 255];
            let off = row[middle].iter().zip(line).map(|(byte, line)| byte.abs_diff(line)).max();
            assert!(off <= Some(1), "a line between: {:?}", row[middle]);
            let right = at + middle + 1..at + size.width as usize;
            assert!(difference(&row[middle + 1..], &expected[right], how) <= 1, "row {y}");
        }
        execute(&mut viewer, &[Command::View(DebugView::named("final").unwrap(), None)]);
        assert!(shown(&mut viewer, 1) == picture);
    });
}

#[test]
fn the_engine_rests_while_the_reference_is_shown_and_works_beside_it() {
    with_session(room(), true, |session| {
        let camera = session.scene().cameras[0].camera;
        let open = Open { hud: false, lights: false, help: false };
        let mut viewer = Viewer::new(session, camera, PathBuf::from("room"), open);
        shown(&mut viewer, 2);
        execute(&mut viewer, &[Command::Reference(true)]);
        let view = *viewer.session().view().unwrap();
        let off =
            difference(&shown(&mut viewer, 2), &traced(&room(), &view, Transport::Full, 2), viewer.session().display());
        assert!(off <= 1, "with all bounces: {off}");
        let mut rays = |command: Command| {
            let before = viewer.stats().rays;
            execute(&mut viewer, &[command]);
            shown(&mut viewer, 2);
            viewer.stats().rays - before
        };
        assert_eq!(rays(Command::Reference(true)), 0);
        assert!(rays(Command::Reference(false)) > 0);
        assert!(rays(Command::View(DebugView::named("beside").unwrap(), None)) > 0);
    });
}

/// Waits until a reference has more samples a pixel than `before`; how many.
fn more_samples(reference: &mut PathTraced, before: u32) -> u32 {
    for _ in 0..3000 {
        reference.advance();
        if let Some(samples) = reference.progress().map(|progress| progress.samples).filter(|now| *now > before) {
            return samples;
        }
        std::thread::sleep(Duration::from_millis(5));
    }
    panic!("nothing is traced");
}

#[test]
fn on_threads_of_its_own_it_goes_on_where_it_stopped() {
    let scene = Arc::new(room());
    let bvh = Arc::new(Bvh::build(&scene));
    let of = |width| {
        let view = crate::support::device::view_of(&scene, width, 36);
        Subject { scene: Arc::clone(&scene), bvh: Arc::clone(&bvh), view, lights: Vec::new() }
    };
    let options = Options { threads: Some(2), pace: Pace::Free, ..Options::default() };
    let mut reference = PathTraced::new(&options).unwrap();
    reference.trace(of(48), Share::All);
    let first = more_samples(&mut reference, 2);
    let progress = reference.progress().unwrap();
    assert!(progress.picture == traced(&scene, &of(48).view, Transport::Full, first));
    reference.rest();
    assert!(!reference.is_on() && !reference.advance() && reference.progress().is_none());
    reference.trace(of(48), Share::Quarter);
    assert!(more_samples(&mut reference, 0) >= first, "it goes on");
    reference.trace(of(20), Share::Quarter);
    assert!(reference.progress().is_none(), "another view");
    more_samples(&mut reference, 0);
    assert_eq!(reference.progress().unwrap().picture.len(), 20 * 36);
}
