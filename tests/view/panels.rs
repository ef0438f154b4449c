//! The panels, by what a reader of the screen is told: they show what the viewer holds, and what is clicked comes out as commands.
#![allow(clippy::unwrap_used, reason = "in a test, a panic is how a failure shows")]

use crate::{converge, room, with_session};
use egui_kittest::Harness;
use egui_kittest::kittest::Queryable as _;
use penombre::app::command::Command;
use penombre::app::panels;
use penombre::app::rate::{PassTimes, Rate};
use penombre::app::viewer::{Open, Viewer};
use penombre::session::Unobserved;
use std::cell::RefCell;
use std::path::PathBuf;

const RATE: Rate = Rate {
    pictures: 25.0,
    frame_ms: 12.0,
    rays: 3e6,
    passes: PassTimes { visibility: Some(1.0), colour: None, luminance: Some(2.5), combine: Some(0.5) },
    resident: Some(300 << 20),
};

/// Runs a test on the panels of a viewer, in which commands were done.
pub(crate) fn with_panels(commands: &[Command], test: impl FnOnce(&mut Harness<'_>, &RefCell<Vec<Command>>)) {
    with_session(room(), true, |mut session| {
        converge(&mut session);
        let camera = session.scene().cameras[0].camera;
        let open = Open { hud: true, lights: true, help: false };
        let mut viewer = Viewer::new(session, camera, PathBuf::from("room"), open);
        for command in commands {
            viewer.execute(command).unwrap();
        }
        for frame in 0..4 {
            viewer.advance(f64::from(frame) * 0.5);
            viewer.frame(&mut Unobserved).unwrap();
        }
        let clicked: RefCell<Vec<Command>> = RefCell::default();
        let mut panels = Harness::builder().with_size(egui::vec2(900.0, 700.0)).build_ui(|ui| {
            clicked.borrow_mut().extend(panels::lay_out(ui.ctx(), &viewer, RATE, &|_| None));
        });
        panels.run_steps(3);
        test(&mut panels, &clicked);
    });
}

/// Clicks what is labelled so; what came of it.
pub(crate) fn click(panels: &mut Harness<'_>, clicked: &RefCell<Vec<Command>>, label: &str) -> Vec<String> {
    clicked.borrow_mut().clear();
    panels.get_by_label(label).click();
    panels.run_steps(2);
    clicked.borrow().iter().map(ToString::to_string).collect()
}

#[test]
fn figures_are_those_of_the_viewer_and_its_frames() {
    with_panels(&[Command::Exposure(1.5)], |panels, _| {
        for part in ["25.0 fps  12.0 ms", "visibility 1.0 ms", "luminance 2.5 ms  combine 0.5 ms", "3.00 M/s"] {
            assert!(panels.query_by_label_contains(part).is_some(), "{part}");
        }
        assert!(panels.query_by_label_contains("process 300 MiB").is_some());
        assert!(panels.query_by_label_contains("stale").is_none());
        assert!(panels.query_by_label_contains("lights (2)").is_some());
    });
}

#[test]
fn the_switch_of_a_light_is_a_command() {
    with_panels(&[], |panels, clicked| {
        assert_eq!(click(panels, clicked, "left"), ["light.toggle left"]);
        assert_eq!(click(panels, clicked, "right"), ["light.toggle right"]);
        assert_eq!(click(panels, clicked, "help"), ["help.toggle"]);
    });
}

#[test]
fn a_lamp_that_was_switched_leaves_stale_light_and_says_so() {
    with_panels(&[Command::ToggleLight("left".to_owned())], |panels, _| {
        assert!(panels.query_by_label_contains("stale: indirect light of").is_some());
    });
}
