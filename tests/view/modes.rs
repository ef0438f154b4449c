//! Update modes changed while light converges.
#![allow(clippy::unwrap_used, reason = "in a test, a panic is how a failure shows")]

use crate::{converge, room, with_session};
use glam::Vec3;
use penombre::pass::UpdateMode;
use penombre::scene::light::LightState;
use penombre::session::Unobserved;

#[test]
fn modes_that_find_every_pixel_draw_the_same_when_they_are_switched_to() {
    with_session(room(), false, |mut session| {
        let camera = session.scene().cameras[0].camera;
        for _ in 0..2 {
            session.step(&mut Unobserved).unwrap();
        }
        let exact = [UpdateMode::Id, UpdateMode::Stencil, UpdateMode::StencilExport, UpdateMode::Lookup];
        let modes: Vec<UpdateMode> = exact.into_iter().filter(|mode| session.renderer().allows(*mode)).collect();
        assert!(modes.contains(&UpdateMode::Lookup));
        for (number, mode) in modes.into_iter().enumerate() {
            session.set_update_mode(mode).unwrap();
            assert_eq!(session.update_mode(), mode);
            session
                .look_through(&camera, &[Vec3::splat(number as f32 + 0.5), Vec3::ONE].map(LightState::times))
                .unwrap();
            converge(&mut session);
            let updated = session.renderer_mut().read_luminance().unwrap();
            session.renderer_mut().draw_all_next();
            session.step(&mut Unobserved).unwrap();
            let drawn = session.renderer_mut().read_luminance().unwrap();
            assert!(updated.d == drawn.d, "{}", mode.name());
        }
    });
}
