//! Every debug view shows what it says, and the picture comes back.
#![allow(clippy::unwrap_used, reason = "in a test, a panic is how a failure shows")]

use crate::{converge, floor, room, with_session};
use glam::Vec3;
use penombre::scene::light::LightState;
use penombre::session::{DebugView, Session, Unobserved};
use std::collections::HashSet;

const ALL: [DebugView; 14] = [
    DebugView::Kd,
    DebugView::Ks,
    DebugView::Emission,
    DebugView::Diffuse,
    DebugView::Specular,
    DebugView::Direct(0),
    DebugView::Direct(1),
    DebugView::Indirect,
    DebugView::Faces,
    DebugView::Level,
    DebugView::Error,
    DebugView::Knowledge,
    DebugView::Mesh,
    DebugView::LightMesh(1),
];

/// Shows a view.
fn show(session: &mut Session, view: DebugView) {
    session.set_debug_view(view);
    assert!(view == DebugView::Final || !session.shows_debug_view());
    session.step(&mut Unobserved).unwrap();
    assert!(session.shows_debug_view(), "{view:?}");
}

/// The picture as displayed in a view.
fn picture(session: &mut Session, view: DebugView) -> Vec<[u8; 4]> {
    show(session, view);
    session.renderer_mut().read_display().unwrap()
}

/// D as the images hold it in a view, W/sr/m2.
fn diffuse(session: &mut Session, view: DebugView) -> Vec<Vec3> {
    show(session, view);
    session.renderer_mut().read_luminance().unwrap().d.into_iter().map(Vec3::from_array).collect()
}

/// The colours of the pixels that show geometry.
fn colours(picture: &[[u8; 4]]) -> HashSet<[u8; 3]> {
    picture.iter().filter(|pixel| pixel[3] > 0).map(|[r, g, b, _]| [*r, *g, *b]).collect()
}

/// Whether a pixel has the colour of a mesh's lines.
fn is_line(pixel: &&[u8; 4]) -> bool {
    pixel.iter().zip([255, 217, 77]).all(|(byte, line)| byte.abs_diff(line) <= 1)
}

#[test]
fn the_light_of_each_lamp_and_indirect_light_add_up_to_d() {
    with_session(room(), true, |mut session| {
        converge(&mut session);
        let whole = diffuse(&mut session, DebugView::Final);
        let parts =
            [DebugView::Direct(0), DebugView::Direct(1), DebugView::Indirect].map(|view| diffuse(&mut session, view));
        let most = whole.iter().copied().fold(Vec3::ZERO, Vec3::max).max_element();
        for (pixel, whole) in whole.iter().enumerate() {
            let sum: Vec3 = parts.iter().map(|part| part[pixel]).sum();
            assert!((sum - *whole).abs().max_element() < 0.005 * most, "{pixel}: {sum} instead of {whole}");
        }
        for part in &parts {
            let share = part.iter().copied().sum::<Vec3>() / whole.iter().copied().sum::<Vec3>();
            assert!(share.min_element() > 0.02 && share.max_element() < 0.9, "none of them is nothing: {share}");
        }
        assert!(diffuse(&mut session, DebugView::Final) == whole, "to the bit");
    });
}

#[test]
fn every_view_shows_something_else_and_the_picture_comes_back() {
    with_session(room(), true, |mut session| {
        converge(&mut session);
        let before = picture(&mut session, DebugView::Final);
        let mut seen = HashSet::from([before.clone()]);
        for view in ALL {
            let shown = picture(&mut session, view);
            let covered = |pixels: &[[u8; 4]]| pixels.iter().map(|pixel| pixel[3]).collect::<Vec<_>>();
            assert_eq!(covered(&shown), covered(&before), "{view:?}");
            let black = [DebugView::Ks, DebugView::Emission, DebugView::Specular].contains(&view);
            assert_eq!(colours(&shown) == HashSet::from([[0; 3]]), black, "{view:?}: nothing shines here");
            assert!(seen.insert(shown) || black, "{view:?}");
        }
        assert!(picture(&mut session, DebugView::Final) == before);
    });
}

#[test]
fn files_hold_the_picture_in_any_view() {
    with_session(room(), true, |mut session| {
        converge(&mut session);
        show(&mut session, DebugView::Final);
        let before = session.still().unwrap();
        let in_view = picture(&mut session, DebugView::Direct(0));
        let still = session.still().unwrap();
        assert!(still.layers == before.layers && still.combined == before.combined);
        session.step(&mut Unobserved).unwrap();
        assert!(session.shows_debug_view() && session.renderer_mut().read_display().unwrap() == in_view);
    });
}

#[test]
fn a_floor_in_the_sun_is_of_one_level_and_two_faces() {
    with_session(floor(), false, |mut session| {
        converge(&mut session);
        let levels: HashSet<u32> = session.still().unwrap().level.into_iter().filter(|level| *level > 0).collect();
        assert_eq!((levels.len(), colours(&picture(&mut session, DebugView::Level)).len()), (1, 1), "{levels:?}");
        assert_eq!(colours(&picture(&mut session, DebugView::Faces)).len(), 2);
        assert_eq!(colours(&picture(&mut session, DebugView::Knowledge)), HashSet::from([[89; 3]]), "all is known");
        let mesh = picture(&mut session, DebugView::Mesh);
        let (lines, all) = (mesh.iter().filter(is_line).count(), mesh.iter().filter(|pixel| pixel[3] > 0).count());
        assert!(lines > 20 && lines < all, "edges and a diagonal: {lines} of {all}");
    });
}

#[test]
fn a_room_is_split_where_the_light_of_a_lamp_ends() {
    with_session(room(), false, |mut session| {
        converge(&mut session);
        let levels = picture(&mut session, DebugView::Level);
        assert!(colours(&levels).len() > 3);
        let lines = |picture: Vec<[u8; 4]>| picture.iter().filter(is_line).count();
        let drawn = lines(picture(&mut session, DebugView::Mesh));
        let own = [0, 1].map(|light| lines(picture(&mut session, DebugView::LightMesh(light))));
        assert!(own.iter().all(|own| *own < drawn && *own > 20), "each is coarser than all: {own:?}, {drawn}");
    });
}

#[test]
fn the_errors_of_all_pixels_make_up_the_estimated_error() {
    with_session(room(), true, |mut session| {
        for _ in 0..3 {
            session.step(&mut Unobserved).unwrap();
        }
        session.set_debug_view(DebugView::Error);
        let report = session.step(&mut Unobserved).unwrap();
        let answer = report.updates.iter().find_map(|update| update.answer.as_ref()).unwrap();
        let drawn = session.renderer_mut().read_luminance().unwrap().drawn_id;
        let of = |id: u32| answer.of.iter().find(|(drawn, _)| drawn.0 + 1 == id).map(|(_, bits)| f32::from_bits(*bits));
        let errors: Vec<f32> = drawn.into_iter().filter(|id| *id > 0).map(|id| of(id).unwrap()).collect();
        let rms = (errors.iter().map(|error| error * error).sum::<f32>() / errors.len() as f32).sqrt();
        let estimated = report.engine.estimated_error.unwrap();
        // Pixels as they are drawn, against those of the leaves that account for them.
        assert!((rms / estimated - 1.0).abs() < 0.2, "{rms} instead of {estimated}");
    });
}

#[test]
fn what_a_switch_makes_stale_is_counted_and_shown_until_it_is_gathered_again() {
    with_session(room(), true, |mut session| {
        let is_stale = |[r, g, b]: [u8; 3]| r > 200 && g > 150 && b < 60;
        let camera = session.scene().cameras[0].camera;
        converge(&mut session);
        assert_eq!(session.totals().engine.outdated, 0);
        let fresh = picture(&mut session, DebugView::Knowledge);
        assert!(!colours(&fresh).into_iter().any(is_stale));
        session.look_through(&camera, &[Vec3::ZERO, Vec3::ONE].map(LightState::times)).unwrap();
        session.step(&mut Unobserved).unwrap();
        let outdated = session.totals().engine.outdated;
        let stale = session.renderer_mut().read_display().unwrap();
        assert!(outdated > 0 && colours(&stale).into_iter().any(is_stale), "{outdated}");
        session.set_debug_view(DebugView::Final);
        converge(&mut session);
        assert!(session.totals().engine.outdated < outdated);
        session.look_through(&camera, &[]).unwrap();
        session.step(&mut Unobserved).unwrap();
        assert!(session.totals().engine.outdated < outdated, "a lamp that is switched back on has lost nothing");
    });
}
