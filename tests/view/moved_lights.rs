//! Lights that are moved: by a command, by figures in the panel, by their marks in the picture; and what is shown then.
#![allow(clippy::unwrap_used, reason = "in a test, a panic is how a failure shows")]

use crate::panels::{click, with_panels};
use crate::{converge, room, with_session};
use egui::accesskit::Role;
use egui_kittest::kittest::{NodeT as _, Queryable as _};
use glam::{DVec3, Vec2, Vec3};
use penombre::app::command::Command;
use penombre::app::viewer::{Open, Viewer};
use penombre::app::views::View as DebugView;
use penombre::pass::LuminanceLayers;
use penombre::scene::Scene;
use penombre::scene::light::LightKind;
use penombre::scene::material::Model;
use penombre::session::{Session, Unobserved};
use std::path::PathBuf;

const TO: Vec3 = Vec3::new(0.1, 0.3, -0.6);

/// The room, glossy.
fn glossy_room() -> Scene {
    let mut scene = room();
    scene.materials[0].model = Model::phong(Vec3::splat(0.3), 10.0);
    scene
}

/// The same with its left lamp where it is moved to.
fn moved_room() -> Scene {
    let mut scene = glossy_room();
    let LightKind::Point { position, .. } = &mut scene.lights[0].kind else { panic!("a point light") };
    *position = TO;
    scene
}

fn moves() -> Command {
    Command::MoveLight("left".to_owned(), TO.as_dvec3())
}

fn viewer(session: Session) -> Viewer {
    let camera = session.scene().cameras[0].camera;
    Viewer::new(session, camera, PathBuf::from("room"), Open { hud: false, lights: false, help: false })
}

/// Root of the mean square difference of D and S, each against the mean.
fn off(a: &LuminanceLayers, b: &LuminanceLayers) -> [f32; 2] {
    [(&a.d, &b.d), (&a.s, &b.s)].map(|(a, b)| {
        let mean = b.iter().flatten().sum::<f32>() / (3 * b.len()) as f32;
        let square = a.iter().flatten().zip(b.iter().flatten()).map(|(a, b)| (a - b).powi(2)).sum::<f32>();
        (square / (3 * b.len()) as f32).sqrt() / mean
    })
}

#[test]
fn direct_light_follows_at_once() {
    let mut fresh = LuminanceLayers::default();
    with_session(moved_room(), false, |mut session| {
        converge(&mut session);
        fresh = session.renderer_mut().read_luminance().unwrap();
    });
    with_session(glossy_room(), false, |mut session| {
        converge(&mut session);
        let mut viewer = viewer(session);
        viewer.frame(&mut Unobserved).unwrap();
        let shown = |viewer: &mut Viewer| {
            let report = viewer.frame(&mut Unobserved).unwrap().unwrap();
            (report.engine.complete, off(&viewer.session_mut().renderer_mut().read_luminance().unwrap(), &fresh))
        };
        let before = off(&viewer.session_mut().renderer_mut().read_luminance().unwrap(), &fresh);
        viewer.execute(&moves()).unwrap();
        let (knows, guess) = shown(&mut viewer);
        let (complete, visited) = shown(&mut viewer);
        println!("before {before:?}, guessed {guess:?}, visited {visited:?}");
        assert!(!knows && complete);
        assert!(guess[0] < 0.8 * before[0] && guess[1] < before[1], "{before:?} {guess:?}");
        assert!(visited[0] < 0.1 && visited[1] < 0.2, "but for where the mesh is still coarse: {visited:?}");
    });
}

#[test]
fn the_view_of_what_is_known_has_guesses_in_the_first_picture_alone() {
    with_session(room(), false, |mut session| {
        converge(&mut session);
        let mut viewer = viewer(session);
        viewer.execute(&Command::View(DebugView::named("stale").unwrap(), None)).unwrap();
        let guessed = |viewer: &mut Viewer| {
            // Instead of D: nothing known, guessed, covered.
            let shown = viewer.session_mut().renderer_mut().read_luminance().unwrap();
            shown.d.iter().filter(|[_, guessed, _]| *guessed > 0.5).count()
        };
        for _ in 0..3 {
            viewer.frame(&mut Unobserved).unwrap();
        }
        assert_eq!(guessed(&mut viewer), 0);
        viewer.execute(&moves()).unwrap();
        viewer.frame(&mut Unobserved).unwrap();
        assert!(guessed(&mut viewer) > 500);
        for _ in 0..3 {
            viewer.frame(&mut Unobserved).unwrap();
        }
        assert_eq!(guessed(&mut viewer), 0);
    });
}

#[test]
fn lights_that_cannot_be_moved_say_why() {
    with_session(crate::floor(), false, |session| {
        let mut viewer = viewer(session);
        let mut fault =
            |name: &str| viewer.execute(&Command::MoveLight(name.to_owned(), DVec3::ZERO)).unwrap_err().to_string();
        assert!(fault("sun").contains("\"sun\" is infinitely far"));
        assert!(fault("son").contains("did you mean \"sun\""));
    });
    with_session(room(), false, |session| {
        let far = Command::MoveLight("left".to_owned(), DVec3::X * 1e200);
        assert!(viewer(session).execute(&far).unwrap_err().to_string().contains("too far"));
    });
}

/// The name and the place of a command that moves a light.
fn place(command: &Command) -> (&str, Vec3) {
    let Command::MoveLight(name, to) = command else { panic!("{command}") };
    (name, to.as_vec3())
}

#[test]
fn a_mark_that_is_dragged_moves_its_light_across_the_picture() {
    with_panels(&[], |panels, clicked| {
        let scene = room();
        let view = scene.view(&scene.cameras[0].camera, crate::options(false).size);
        // The other mark lies below the panel.
        let from = Vec3::new(0.7, 0.6, 0.4);
        let mark = panels.get_by_label("move right").rect().center();
        let pixels_a_point = Vec2::new(view.size.width as f32 / 900.0, view.size.height as f32 / 700.0);
        let pixel = view.pixel_of(from).unwrap();
        assert!((Vec2::new(mark.x, mark.y) * pixels_a_point).distance(pixel) < 0.1, "{mark} {pixel}");
        panels.drag_at(mark);
        panels.run_steps(2);
        clicked.borrow_mut().clear();
        panels.hover_at(mark + egui::vec2(90.0, 35.0));
        panels.step();
        let commands = clicked.borrow().clone();
        let (name, to) = place(&commands[0]);
        assert_eq!((name, commands.len()), ("right", 1));
        let moved = view.pixel_of(to).unwrap() - pixel;
        assert!(moved.distance(Vec2::new(90.0, 35.0) * pixels_a_point) < 0.05, "{moved}");
        assert!((to - from).dot(view.forward).abs() < 1e-5, "as far ahead as before");
        panels.drop_at(mark);
    });
}

#[test]
fn the_place_of_a_light_is_figures_in_the_panel() {
    with_panels(&[], |panels, clicked| {
        assert!(panels.query_by_label("move right").is_some());
        let height = panels
            .get_all_by_role(Role::SpinButton)
            .find(|node| node.accesskit_node().numeric_value() == Some(f64::from(0.4_f32)));
        let at = height.unwrap().rect().center();
        panels.drag_at(at);
        panels.run_steps(2);
        clicked.borrow_mut().clear();
        panels.hover_at(at + egui::vec2(30.0, 0.0));
        panels.step();
        let commands = clicked.borrow().clone();
        let (name, to) = place(&commands[0]);
        assert_eq!((name, to.x, to.y), ("left", -0.7, 0.6));
        assert!(to.z > 0.41 && to.z < 1.0, "{to}");
        panels.drop_at(at);
        // Marks are there as long as the list is.
        assert_eq!(click(panels, clicked, "lights (2)"), ["hud.lights"]);
    });
    with_panels(&[Command::ToggleLights], |panels, _| assert!(panels.query_by_label("move right").is_none()));
}
