//! Where the indirect light that a slot shows comes from, told apart: to look at, nothing is decided by it.

use super::ids::SlotId;
use super::indirect_layer::ShownAs;
use super::slot::{Eye, Luminance, SlotLight};
use super::store::Cache;
use glam::Vec3;

/// What there is of the indirect light of a slot.
#[derive(Clone, Copy, Debug)]
pub struct IndirectParts {
    /// Rays that its vertex has gathered under the present lights.
    pub rays: u32,
    /// What it has gathered itself.
    pub gathered: Option<SlotLight>,
    /// What those around it predict.
    pub predicted: Option<SlotLight>,
    /// What is kept, of both by what they are worth.
    pub kept: Luminance,
    /// Diffuse luminance D that is shown, W·sr⁻¹·m⁻².
    pub shown: Vec3,
    /// Which of them that is.
    pub shown_as: ShownAs,
}

impl Cache {
    /// What there is of the indirect light of a slot.
    #[must_use]
    pub fn indirect_parts(&self, slot: SlotId, eye: Eye<'_>) -> IndirectParts {
        let record = &self.slots[slot];
        let (shown, shown_as) = self.indirect_to_show(slot);
        let predicted = self.prediction(slot, eye);
        IndirectParts {
            rays: self.indirect.rays(record.vertex),
            gathered: self.indirect.is_sampled(slot).then(|| self.gathered(slot, eye.position)),
            predicted: predicted.map(|predicted| self.shown_by_prediction(slot, predicted)),
            kept: record.indirect(),
            shown,
            shown_as,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::indirect::SpecularTable;
    use super::super::testing::{known, square};
    use super::*;

    #[test]
    fn a_midpoint_tells_what_it_found_from_what_its_ends_predict() {
        let mut square = square();
        let middle = square.split(square.roots[0]).middles[2];
        let [near, _, far] = square.cache.topology.nodes[square.roots[0]].corners;
        for (end, diffuse) in [(near, 1.0), (far, 3.0)] {
            square.cache.slots[end].set_indirect(known(diffuse, 0.25));
        }
        let specular = SpecularTable::default();
        let eye = Eye { position: Vec3::Y, specular: &specular };
        let before = square.cache.indirect_parts(middle, eye);
        assert!(before.gathered.is_none() && before.rays == 0 && !before.kept.known);
        assert_eq!((before.predicted.map(|light| light.diffuse.x), before.shown_as), (Some(2.0), ShownAs::Expected));
        square.gather(middle, &[0.0, 8.0].repeat(8));
        square.cache.slots[middle].set_indirect(known(3.0, 0.1));
        let after = square.cache.indirect_parts(middle, eye);
        assert!((after.gathered.map_or(0.0, |light| light.diffuse.x) - 4.0).abs() < 1e-5 && after.rays == 16);
        assert_eq!((after.predicted.map(|light| light.diffuse.x), after.shown_as), (Some(2.0), ShownAs::Kept));
        assert!((after.shown.x - 3.0).abs() < 1e-3);
    }
}
