//! Luminance: D and S of the drawn triangles, all of them or those that changed (docs/method/updates.md).

use super::depth::Depth;
use super::needs::Needs;
use super::options::RendererOptions;
use super::plan::{DepthTest, Plan, Step};
use super::targets::Targets;
use super::update::UpdateMode;
use crate::error::Result;
use crate::vk::commands::{Draws, Load};
use crate::vk::pipeline::{ColourWrites, DepthBias, DepthStencil, PipelineDesc};
use crate::vk::report::{COLOUR_FORMAT, ID_FORMAT};
use crate::vk::{Bindings, Device, OcclusionQueries, Pass, Pipeline, shaders};
use ash::vk::{CompareOp, StencilOp};

/// The pass of that name. Depth and stencil state are dynamic: a few pipelines serve all update modes.
pub(super) struct Luminance {
    /// All fragments that pass the tests.
    plain: Pipeline,
    /// Only fragments where the id image shows the drawn triangle's face.
    on_face: Pipeline,
    /// As `plain` and `on_face` where the pixels of drawn triangles are counted as they are drawn.
    counted: Option<[Pipeline; 2]>,
    /// Depth and stencil only.
    mark: Pipeline,
    /// Depth only, where the id image shows nothing.
    background: Pipeline,
    /// Marks and drawn triangles that bring their stencil references.
    exported: Option<[Pipeline; 2]>,
    lookup: Option<Pipeline>,
    /// Whether S is drawn; its image stays as it is otherwise.
    draws_specular: bool,
    depth: Depth,
    /// What depths of a triangle and of its parts may differ by.
    bias: DepthBias,
}

impl Luminance {
    pub(super) fn new(device: &Device, bindings: &Bindings, options: &RendererOptions, needs: Needs) -> Result<Self> {
        let draws_specular = needs.draws_specular(options);
        let (vertex, fragment, on_face) = if needs.normal_maps {
            let on_face = shaders::LUMINANCE_ON_FACE_TURNED_FRAG;
            (shaders::LUMINANCE_TURNED_VERT, shaders::LUMINANCE_TURNED_FRAG, on_face)
        } else if draws_specular {
            (shaders::LUMINANCE_VERT, shaders::LUMINANCE_FRAG, shaders::LUMINANCE_ON_FACE_FRAG)
        } else {
            let on_face = shaders::LUMINANCE_ON_FACE_MATTE_FRAG;
            (shaders::LUMINANCE_MATTE_VERT, shaders::LUMINANCE_MATTE_FRAG, on_face)
        };
        let formats = [COLOUR_FORMAT, ID_FORMAT, COLOUR_FORMAT];
        let plain = PipelineDesc {
            vertex,
            fragment: Some(fragment),
            colour: if draws_specular { &formats } else { &formats[..2] },
            depth_stencil: Some(options.depth.format),
            colour_writes: if options.count_writes { ColourWrites::AddFirstAlpha } else { ColourWrites::Replace },
            constants: &needs.constants(options),
        };
        let with = |fragment| PipelineDesc { fragment: Some(fragment), ..plain };
        let mark =
            PipelineDesc { vertex: shaders::MARK_VERT, fragment: None, colour_writes: ColourWrites::Off, ..plain };
        let background =
            PipelineDesc { vertex: shaders::FULLSCREEN_VERT, fragment: Some(shaders::BACKGROUND_FRAG), ..mark };
        let lookup = if options.atomic_counts { shaders::LOOKUP_COUNTED_FRAG } else { shaders::LOOKUP_FRAG };
        let lookup = PipelineDesc { vertex: shaders::FULLSCREEN_VERT, ..with(lookup) };
        let new = |name, desc: &PipelineDesc<'_>| Pipeline::new(device, name, bindings, desc);
        let counted = || {
            Ok([
                new("luminance counted", &with(shaders::LUMINANCE_COUNTED_FRAG))?,
                new("luminance on face counted", &with(shaders::LUMINANCE_ON_FACE_COUNTED_FRAG))?,
            ])
        };
        let exported = || {
            let fragment = Some(shaders::MARK_EXPORT_FRAG);
            let drawn_triangles = with(shaders::LUMINANCE_EXPORT_FRAG);
            Ok([
                new("mark exported", &PipelineDesc { vertex: shaders::MARK_EXPORT_VERT, fragment, ..mark })?,
                new("luminance exported", &PipelineDesc { vertex: shaders::LUMINANCE_EXPORT_VERT, ..drawn_triangles })?,
            ])
        };
        let has = |mode| options.modes.contains(&mode);
        Ok(Self {
            plain: new("luminance", &plain)?,
            on_face: new("luminance on face", &with(on_face))?,
            counted: options.atomic_counts.then(counted).transpose()?,
            mark: new("luminance mark", &mark)?,
            background: new("background", &background)?,
            exported: has(UpdateMode::StencilExport).then(exported).transpose()?,
            lookup: has(UpdateMode::Lookup).then(|| new("luminance lookup", &lookup)).transpose()?,
            draws_specular,
            depth: options.depth,
            bias: bias(device, options.depth),
        })
    }

    /// Records the draws of a plan.
    pub(super) fn record<'a>(
        &'a self,
        pass: &Pass<'a>,
        bindings: &'a Bindings,
        targets: &'a Targets,
        plan: &Plan,
        queries: Option<&'a OcclusionQueries>,
    ) {
        if let Some(queries) = queries.filter(|_| !plan.queried.is_empty()) {
            pass.reset_queries(queries);
        }
        let load = if plan.clear { Load::Clear(self.depth.infinity()) } else { Load::Keep };
        let images = [&targets.diffuse, &targets.drawn_ids, &targets.specular];
        let images = if self.draws_specular { &images } else { &images[..2] };
        pass.render(images, Some(&targets.luminance_depth), load, |draws| {
            let mut queried = (0..).zip(&plan.queried).peekable();
            for (number, &step) in plan.steps.iter().enumerate() {
                match (queries, queried.next_if(|(_, (_, counted))| *counted == number)) {
                    (Some(queries), Some((query, _))) => {
                        draws.counted(queries, query, || self.step(draws, bindings, step));
                    }
                    _ => self.step(draws, bindings, step),
                }
            }
        });
    }

    fn step<'a>(&'a self, draws: &Draws<'_, 'a>, bindings: &'a Bindings, step: Step) {
        let (plain, on_face) = match &self.counted {
            Some([plain, on_face]) if step.counts_pixels().is_some() => (plain, on_face),
            _ => (&self.plain, &self.on_face),
        };
        let by_id_or_depth = |masked| if masked { on_face } else { plain };
        let [mark_exported, marked_exported] = self.exported.as_ref().map_or([&self.mark, plain], |e| e.each_ref());
        let depth = |compare, write, stencil| DepthStencil { compare, write, stencil, bias: None };
        let marking = |reference| Some((CompareOp::ALWAYS, StencilOp::REPLACE, reference));
        // Depth must be written, or the next level's marks find the plane of the level before.
        let marked = |reference| Some((CompareOp::EQUAL, StencilOp::ZERO, reference));
        let (pipeline, state, (first, count)) = match step {
            Step::ClearStencil => return draws.clear_stencil(),
            Step::Full { drawn_triangles, on_face } => (by_id_or_depth(on_face), self.depth.nearer(), drawn_triangles),
            Step::Background => (&self.background, self.depth.nearer(), (0, 1)),
            Step::Values { drawn_triangles, on_face } => {
                (by_id_or_depth(on_face), depth(CompareOp::EQUAL, false, None), drawn_triangles)
            }
            Step::OnFace { drawn_triangles, depth: write } => {
                (on_face, depth(CompareOp::ALWAYS, write, None), drawn_triangles)
            }
            Step::Mark { triangles, reference } => {
                (&self.mark, depth(CompareOp::EQUAL, false, marking(reference)), triangles)
            }
            Step::Marked { drawn_triangles, reference } => {
                (plain, depth(CompareOp::ALWAYS, true, marked(reference)), drawn_triangles)
            }
            Step::MarkExported { triangles } => (mark_exported, depth(CompareOp::EQUAL, false, marking(0)), triangles),
            Step::MarkedExported { drawn_triangles } => {
                (marked_exported, depth(CompareOp::ALWAYS, true, marked(0)), drawn_triangles)
            }
            Step::ByDepth { drawn_triangles, on_face, test } => {
                (by_id_or_depth(on_face), self.against(test), drawn_triangles)
            }
            // Where there was nothing yet, depth says that there is something now.
            Step::Lookup { .. } => {
                (self.lookup.as_ref().unwrap_or(plain), depth(CompareOp::ALWAYS, true, None), (0, 1))
            }
        };
        draws.bind(pipeline, bindings);
        draws.depth_stencil(state);
        draws.triangles(first, count);
    }

    fn against(&self, test: DepthTest) -> DepthStencil {
        let (compare, write, bias) = match test {
            DepthTest::NotFarther => (self.depth.not_farther(), true, None),
            DepthTest::Equal => (CompareOp::EQUAL, true, None),
            DepthTest::Biased => (self.depth.not_farther(), false, Some(self.bias)),
        };
        DepthStencil { compare, write, stencil: None, bias }
    }
}

/// What the depths of a triangle and of its parts may differ by, towards the eye. Vertices are snapped to 2⁻ᵇ of a pixel, by
/// up to half of that each way, while their depth stays: planes of parent and part differ by up to the slope times 2¹⁻ᵇ
/// together, and by a few steps of rounding (docs/update-modes.md).
fn bias(device: &Device, depth: Depth) -> DepthBias {
    const STEPS: f32 = 8.0;
    let bits = device.report().optional.sub_pixel_bits;
    let towards = depth.towards_the_eye();
    DepthBias { constant: STEPS * towards, slope: 2f32.powi(1 - bits as i32) * towards }
}
