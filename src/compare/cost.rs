//! What an update costs by the number of its patches: the same drawn triangles split in four, in each mode, in turns.

use crate::error::Result;
use crate::pass::{FrameOptions, Renderer, UpdateMode};
use crate::refine::replay::HostMesh;
use crate::refine::update::{DrawnId, DrawnTriangle, Patch, Slot, SlotId, Update};
use crate::scene::Scene;
use glam::Vec3;
use serde::Serialize;

/// What a mode took for an update of so many patches: medians over the runs.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Cost {
    /// The mode's name.
    pub mode: &'static str,
    /// Patches.
    pub patches: usize,
    /// Milliseconds of the luminance pass by the device's clock.
    pub gpu_ms: f64,
    /// CPU milliseconds of the whole process from the plan to the end of the frame; on a software device that includes
    /// what it rasterises.
    pub cpu_ms: f64,
    /// Draw commands.
    pub draws: u32,
    /// Occlusion queries.
    pub queries: u32,
    /// Frames that it took.
    pub frames: u32,
}

/// A split of some drawn triangles into four, and its undoing.
struct Split {
    /// What is drawn before.
    base: Update,
    split: Update,
    merge: Update,
}

/// Measures an update of `patches` patches of what `mesh` holds, in turns over `runs` runs. The renderer has this scene and the
/// mesh's view. `stop` ends it early: what is there then is the medians of fewer runs, or nothing.
///
/// # Errors
/// The device is lost or memory runs out.
pub fn measure(
    renderer: &mut Renderer,
    (scene, mesh): (&Scene, &HostMesh),
    modes: &[UpdateMode],
    (patches, runs): (usize, usize),
    stop: &dyn Fn() -> bool,
) -> Result<Vec<Cost>> {
    let Some(split) = Split::new(scene, mesh, patches) else { return Ok(Vec::new()) };
    renderer.reset_drawn();
    renderer.apply(&split.base)?;
    let mut samples: Vec<Vec<Cost>> = vec![Vec::new(); modes.len()];
    // The first run fills caches, and buffers grow.
    for run in 0..=runs {
        for (&mode, samples) in modes.iter().zip(&mut samples) {
            if stop() {
                break;
            }
            let sample = split.draw(renderer, mode, patches)?;
            samples.extend((run > 0).then_some(sample));
        }
    }
    Ok(samples.into_iter().filter_map(|samples| median_of(&samples)).collect())
}

fn median_of(samples: &[Cost]) -> Option<Cost> {
    let of = |value: fn(&Cost) -> f64| median(samples.iter().map(value).collect());
    samples.first().map(|first| Cost { gpu_ms: of(|c| c.gpu_ms), cpu_ms: of(|c| c.cpu_ms), ..*first })
}

/// The median; 0 of nothing.
#[must_use]
pub fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    let middle = values.len() / 2;
    match values.len() {
        0 => 0.0,
        n if n % 2 == 1 => values[middle],
        _ => (values[middle - 1] + values[middle]) * 0.5,
    }
}

impl Split {
    /// Splits `patches` drawn triangles, evenly spread over the mesh; all of them are split first as often as it takes to have so many.
    /// Drawn triangles that are parts of a node, beside finer ones, are left alone. `None` for an empty mesh.
    fn new(scene: &Scene, mesh: &HostMesh, patches: usize) -> Option<Self> {
        let drawn_triangles = mesh.drawn().map(|(_, drawn, corners)| (DrawnTriangle { flat: None, ..drawn }, corners));
        let (mut drawn_triangles, parts): (Vec<_>, Vec<_>) =
            drawn_triangles.partition(|(drawn, corners)| is_whole(scene, drawn, corners));
        if drawn_triangles.is_empty() {
            return None;
        }
        while drawn_triangles.len() < patches {
            drawn_triangles = drawn_triangles.iter().flat_map(|&(drawn, corners)| quarters(drawn, corners)).collect();
        }
        let whole = drawn_triangles.len();
        let chosen = |i: usize| i < whole && (i + 1) * patches / whole > i * patches / whole;
        drawn_triangles.extend(parts);
        let mut this = Self { base: Update::default(), split: Update::default(), merge: Update::default() };
        let mut ids = mesh.free_ids();
        let mut new_drawn = |update: &mut Update, drawn: DrawnTriangle, corners: [Slot; 3]| {
            let slots = [0, 1, 2].map(|k| SlotId(ids.0.0 + k));
            let id = ids.1;
            ids = (SlotId(ids.0.0 + 3), DrawnId(id.0 + 1));
            update.slots.extend(slots.into_iter().zip(corners));
            update.drawn_triangles.push((id, DrawnTriangle { slots, ..drawn }));
            id
        };
        for (i, &(drawn, corners)) in drawn_triangles.iter().enumerate() {
            let parent = new_drawn(&mut this.base, drawn, corners);
            patch(&mut this.base, drawn, &[], &[parent]);
            if chosen(i) {
                let children =
                    quarters(drawn, corners).map(|(drawn, corners)| new_drawn(&mut this.split, drawn, corners));
                patch(&mut this.split, drawn, &[parent], &children);
                patch(&mut this.merge, drawn, &children, &[parent]);
            }
        }
        Some(this)
    }

    /// Draws the split in a mode, and undoes it.
    fn draw(&self, renderer: &mut Renderer, update_mode: UpdateMode, patches: usize) -> Result<Cost> {
        let options = FrameOptions { update_mode, ..FrameOptions::default() };
        renderer.frame(&FrameOptions { full_luminance: true, ..options })?;
        renderer.apply(&self.split)?;
        let start = cpu_ms();
        let mut cost =
            Cost { mode: update_mode.name(), patches, gpu_ms: 0.0, cpu_ms: 0.0, draws: 0, queries: 0, frames: 0 };
        while renderer.has_pending() {
            let stats = renderer.frame(&options)?;
            cost.gpu_ms += stats.luminance_ms.unwrap_or(0.0);
            cost.draws += stats.draws;
            cost.queries += stats.queries;
            cost.frames += 1;
        }
        cost.cpu_ms = cpu_ms() - start;
        renderer.apply(&self.merge)?;
        Ok(cost)
    }
}

/// Whether a drawn triangle is a whole node: as large as its level says.
fn is_whole(scene: &Scene, drawn: &DrawnTriangle, corners: &[Slot; 3]) -> bool {
    let area = |[a, b, c]: [Vec3; 3]| (b - a).cross(c - a).length();
    let node = area(scene.corners(drawn.face.triangle())) * 0.25_f32.powi(i32::from(drawn.level));
    area(corners.map(|slot| slot.position)) > 0.9 * node
}

/// The four parts of a drawn triangle between the middles of its edges.
fn quarters(drawn: DrawnTriangle, [a, b, c]: [Slot; 3]) -> [(DrawnTriangle, [Slot; 3]); 4] {
    let middle = |a: Slot, b: Slot| Slot {
        position: (a.position + b.position) * 0.5,
        weight: (a.weight + b.weight) * 0.5,
        diffuse: (a.diffuse + b.diffuse) * 0.5,
        specular: (a.specular + b.specular) * 0.5,
        light_vector: glam::Vec4::ZERO,
    };
    let [ab, bc, ca] = [middle(a, b), middle(b, c), middle(c, a)];
    let part = DrawnTriangle { level: drawn.level + 1, ..drawn };
    [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]].map(|corners| (part, corners))
}

fn patch(update: &mut Update, drawn: DrawnTriangle, old: &[DrawnId], new: &[DrawnId]) {
    let start = update.patch_triangles.len() as u32;
    update.patch_triangles.extend_from_slice(old);
    let middle = update.patch_triangles.len() as u32;
    update.patch_triangles.extend_from_slice(new);
    let end = update.patch_triangles.len() as u32;
    update.patches.push(Patch { face: drawn.face, old: start..middle, new: middle..end });
}

/// CPU time of the process so far, milliseconds.
#[cfg(unix)]
fn cpu_ms() -> f64 {
    let time = rustix::time::clock_gettime(rustix::time::ClockId::ProcessCPUTime);
    time.tv_sec as f64 * 1e3 + time.tv_nsec as f64 * 1e-6
}

/// Wall-clock time, milliseconds: what there is here.
#[cfg(not(unix))]
fn cpu_ms() -> f64 {
    static START: std::sync::OnceLock<std::time::Instant> = std::sync::OnceLock::new();
    START.get_or_init(std::time::Instant::now).elapsed().as_secs_f64() * 1e3
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::FaceId;
    use glam::Vec3;

    #[test]
    fn medians() {
        assert_eq!((median(vec![]), median(vec![3.0, 1.0, 2.0]), median(vec![4.0, 1.0])), (0.0, 2.0, 2.5));
    }

    #[test]
    fn a_split_has_as_many_patches_as_asked_for() {
        let mut update = Update::default();
        let scene =
            Scene { positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y], triangles: vec![[0, 1, 2]; 3], ..Scene::default() };
        for face in 0..3 {
            let slots = [0, 1, 2].map(|k| SlotId(3 * face + k));
            for (slot, position) in slots.into_iter().zip([Vec3::ZERO, Vec3::X, Vec3::Y]) {
                let slot_value = Slot {
                    position,
                    weight: 1.0,
                    diffuse: Vec3::ONE,
                    specular: Vec3::ZERO,
                    light_vector: glam::Vec4::ZERO,
                };
                update.slots.push((slot, slot_value));
            }
            let drawn = DrawnTriangle { slots, face: FaceId(2 * face), level: 0, flat: None };
            update.drawn_triangles.push((DrawnId(face), drawn));
            patch(&mut update, drawn, &[], &[DrawnId(face)]);
        }
        let mut mesh = HostMesh::default();
        assert!(Split::new(&scene, &mesh, 1).is_none());
        mesh.apply(&update).expect("an update that fits");
        for patches in [1, 2, 3, 10, 48, 100] {
            let split = Split::new(&scene, &mesh, patches).expect("a mesh");
            assert_eq!((split.split.patches.len(), split.merge.patches.len()), (patches, patches));
            assert_eq!(split.split.drawn_triangles.len(), 4 * patches);
            let area = |update: &Update| {
                let of = |id: SlotId| update.slots.iter().find(|s| s.0 == id).expect("slot").1.position;
                let drawn = |drawn: &DrawnTriangle| {
                    (of(drawn.slots[1]) - of(drawn.slots[0])).cross(of(drawn.slots[2]) - of(drawn.slots[0]))
                };
                update.drawn_triangles.iter().map(|(_, l)| drawn(l).length() * 0.5).sum::<f32>()
            };
            assert!((area(&split.base) - 1.5).abs() < 1e-5, "the parts tile the whole");
        }
    }
}
