//! What the visibility pass draws, and in which steps: on a graphics card what the view frustum may hold, at once; on the CPU occluders,
//! then what they do not hide.

use super::frustum::Frustum;
use super::occlusion::Occlusion;
use super::raster::Raster;
use super::renderer::Renderer;
use super::scene_buffers::OnHost;
use super::shared::{GpuVisibilityTriangle, NONE};
use super::survivors::Survivors;
use super::visibility::VisibilityDraws;
use crate::error::Result;
use crate::scene::{FaceId, TriangleId};

/// Pixels that a face covered that is drawn first in the next picture: what is smaller costs more than it hides.
const OCCLUDER_PIXELS: u32 = 6;

impl Renderer {
    /// Draws face ids and depth, and reads the ids back.
    pub(super) fn draw_visibility(&mut self, frustum: &Frustum) -> Result<()> {
        self.visibility_triangles = 0;
        if self.scene.on_host.is_none() {
            let [opaque, masked] = self.scene.draws(frustum);
            return self.record_visibility(&VisibilityDraws { opaque, masked, over_occluders: false });
        }
        let over_occluders = self.options.culls_on_host && self.draw_occluders(frustum)?;
        let [mut list, masked] = self.tell_apart(frustum, over_occluders)?;
        if over_occluders {
            list.reverse();
        }
        let [opaque_count, masked_count] = [list.len(), masked.len()].map(|count| count as u32);
        list.extend(masked);
        let first = self.scene.send_survivors(&self.device, &mut self.commands, &list)?;
        self.record_visibility(&VisibilityDraws {
            opaque: vec![(first, opaque_count)],
            masked: vec![(first + opaque_count, masked_count)],
            over_occluders,
        })
    }

    /// Remembers what covers most of the image: it is likely to hide much of the next.
    pub(super) fn choose_occluders(&mut self, counts: &[(FaceId, u32)]) {
        let most = counts.iter().filter(|(_, pixels)| *pixels >= OCCLUDER_PIXELS);
        self.occluders = most.map(|(face, _)| face.triangle()).collect();
        self.occluders.dedup();
    }

    /// Draws what hid most in the picture before and reads its depth back; false if there is nothing like it.
    fn draw_occluders(&mut self, frustum: &Frustum) -> Result<bool> {
        let Some(on_host) = &self.scene.on_host else { return Ok(false) };
        let of_order = |triangle: &TriangleId| match on_host.place[triangle.0 as usize] {
            NONE => None,
            place => Some(self.scene.order[place as usize]),
        };
        let raster = self.raster(on_host);
        let occluders =
            self.survivors(frustum, Some(&raster), on_host, None).of_list(self.occluders.iter().filter_map(of_order));
        if occluders.is_empty() || !self.options.depth.is_reversed_float() {
            return Ok(false);
        }
        let first = self.scene.send_survivors(&self.device, &mut self.commands, &occluders)?;
        let Self { commands, passes, bindings, targets, read_back, .. } = self;
        let drawn = (first, occluders.len() as u32);
        let mut recording = commands.begin()?;
        recording.pass("visibility", |pass| passes.visibility.record_occluders(pass, bindings, targets, drawn));
        recording.pass("readback", |pass| read_back.record_depth(pass, targets));
        let times = recording.submit()?;
        self.times.extend(times);
        self.visibility_triangles += drawn.1;
        Ok(true)
    }

    /// What may show, without mask and with, in order.
    fn tell_apart(&self, frustum: &Frustum, over_occluders: bool) -> Result<[Vec<GpuVisibilityTriangle>; 2]> {
        let Some(on_host) = &self.scene.on_host else { return Ok([Vec::new(), Vec::new()]) };
        let depth = over_occluders.then(|| self.read_back.depth()).transpose()?;
        let occlusion = depth.map(|depth| Occlusion::new(depth, self.targets.size.width as usize));
        let raster = self.options.culls_on_host.then(|| self.raster(on_host));
        Ok(self.scene.survivors(&self.survivors(frustum, raster.as_ref(), on_host, occlusion.as_ref())))
    }

    fn raster(&self, on_host: &OnHost) -> Raster {
        Raster::new(&self.view, self.jitter, on_host.reach, self.device.report().optional.sub_pixel_bits)
    }

    fn survivors<'a>(
        &'a self,
        frustum: &'a Frustum,
        raster: Option<&'a Raster>,
        on_host: &'a OnHost,
        occlusion: Option<&'a Occlusion<'a>>,
    ) -> Survivors<'a> {
        let (triangles, positions) = (&self.scene.order, &on_host.positions);
        Survivors { frustum, raster, occlusion, triangles, positions, visible: &self.visible }
    }

    fn record_visibility(&mut self, draws: &VisibilityDraws) -> Result<()> {
        let Self { commands, passes, bindings, targets, scene, read_back, .. } = self;
        let mut recording = commands.begin()?;
        recording.pass("visibility", |pass| passes.visibility.record(pass, bindings, targets, scene, draws));
        recording.pass("readback", |pass| read_back.record_ids(pass, targets));
        let times = recording.submit()?;
        self.times.extend(times);
        self.visibility_triangles += draws.triangles();
        Ok(())
    }
}
