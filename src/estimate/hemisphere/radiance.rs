//! What gathers light asks for it.

use glam::Vec3;

/// Light that arrives from directions, found in steps, so that where many directions are known beforehand each step is done for all of
/// them: then memory answers for some while others are computed. A function of index and direction does it in one.
pub trait Radiance {
    /// What is found first.
    type Met;

    /// What lies in a direction.
    fn meet(&mut self, index: u32, direction: Vec3) -> Self::Met;

    /// Looks up what is known of that; what it waits for is only memory.
    fn look_up(&self, index: u32, met: &mut Self::Met);

    /// The radiance.
    fn radiance(&mut self, index: u32, direction: Vec3, met: Self::Met) -> Vec3;

    /// All steps in turn.
    fn arriving(&mut self, index: u32, direction: Vec3) -> Vec3 {
        let mut met = self.meet(index, direction);
        self.look_up(index, &mut met);
        self.radiance(index, direction, met)
    }
}

impl<F: FnMut(u32, Vec3) -> Vec3> Radiance for F {
    type Met = ();

    fn meet(&mut self, _: u32, _: Vec3) {}

    fn look_up(&self, _: u32, (): &mut ()) {}

    fn radiance(&mut self, index: u32, direction: Vec3, (): ()) -> Vec3 {
        self(index, direction)
    }
}
