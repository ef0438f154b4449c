//! What a mode drawn triangles behind, counted pixel by pixel against a full redraw of the same state (method.md 7).

use super::mesh::Mesh;
use crate::pass::LuminanceLayers;
use crate::refine::update::DrawnId;
use glam::Vec3;

/// Relative difference of luminance from which an error counts as visible.
pub const VISIBLE: f32 = 0.02;

/// What stays the same while the camera does.
#[derive(Clone, Debug, Default)]
pub struct Surface {
    /// Face id + 1 of each pixel; 0 without geometry.
    pub face_id: Vec<u32>,
    /// Diffuse reflectance.
    pub kd: Vec<[f32; 3]>,
    /// Specular reflectance.
    pub ks: Vec<[f32; 3]>,
    /// Emitted radiance.
    pub emitted: Vec<[f32; 3]>,
}

impl Surface {
    /// Radiance of a pixel under the light of luminance images, W·sr⁻¹·m⁻².
    #[must_use]
    pub fn radiance(&self, light: &LuminanceLayers, pixel: usize) -> Vec3 {
        let [kd, ks, emitted] = [&self.kd, &self.ks, &self.emitted].map(|layer| Vec3::from(layer[pixel]));
        emitted + kd * Vec3::from(light.d[pixel]) + ks * Vec3::from(light.s[pixel])
    }
}

/// What a full redraw shows.
#[derive(Clone, Debug, Default)]
pub struct Truth {
    /// Triangle id + 1; 0 where none covers the pixel.
    pub drawn_id: Vec<u32>,
    /// Radiance.
    pub radiance: Vec<Vec3>,
}

/// What a mode shows after an update.
#[derive(Clone, Copy, Debug)]
pub struct Shown<'a> {
    /// The images.
    pub light: &'a LuminanceLayers,
    /// How often each pixel was written since the last comparison.
    pub written: &'a [u16],
    /// Whether each pixel was written twice in one update since then.
    pub doubled: &'a [bool],
    /// Whether the mode finds pixels by the image of face ids: it alone is then the truth about faces, else the full redraw is, too.
    pub goes_by_face: bool,
    /// The update of the last comparison.
    pub since: usize,
}

/// Pixels and errors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Counts {
    /// Pixels that show a face.
    pub visible: u64,
    /// Pixels to update: the full redraw shows them with a triangle of a patch, on the face that is visible there.
    pub updated: u64,
    /// Pixels to update that were not written.
    pub missed: u64,
    /// Pixels written with a triangle of another face than belongs there.
    pub foreign: u64,
    /// Pixels written twice in an update.
    pub double: u64,
    /// Pixels that show a triangle which is no longer part of the mesh.
    pub stale: u64,
    /// Pixels where luminance differs by more than [`VISIBLE`].
    pub wrong: u64,
    /// Pixels where the full redraw shows another face than is visible, or none: no measure of errors.
    pub unmeasured: u64,
    /// Pixels within 0.1 % of the full redraw in every channel.
    pub close: u64,
    /// Largest absolute difference of a channel, W·sr⁻¹·m⁻².
    pub max_error: f64,
    /// Sum over pixels of the mean absolute difference of the channels.
    pub error_sum: f64,
    /// Sum over the measured pixels of the mean of the channels of the full redraw.
    pub radiance_sum: f64,
}

impl Counts {
    /// Nothing counted.
    pub const ZERO: Self = Self {
        visible: 0,
        updated: 0,
        missed: 0,
        foreign: 0,
        double: 0,
        stale: 0,
        wrong: 0,
        unmeasured: 0,
        close: 0,
        max_error: 0.0,
        error_sum: 0.0,
        radiance_sum: 0.0,
    };

    /// Mean absolute difference over the measured pixels, W·sr⁻¹·m⁻².
    #[must_use]
    pub fn mean_error(&self) -> f64 {
        ratio(self.error_sum, self.measured() as f64)
    }

    /// The same against the mean of the full redraw.
    #[must_use]
    pub fn relative_error(&self) -> f64 {
        ratio(self.error_sum, self.radiance_sum)
    }

    /// Pixels whose errors count.
    #[must_use]
    pub const fn measured(&self) -> u64 {
        self.visible - self.unmeasured
    }

    /// Adds what a later comparison counted of events; of states, the later stand.
    pub fn add(&mut self, later: &Self) {
        let before = *self;
        *self = *later;
        self.updated += before.updated;
        self.missed += before.missed;
        self.foreign += before.foreign;
        self.double += before.double;
    }
}

/// 0/0 is 0.
pub(super) fn ratio(a: f64, b: f64) -> f64 {
    if a == 0.0 { 0.0 } else { a / b }
}

/// Compares what a mode shows with the truth; `masks` (the truth but for `lookup`, whose own full redraw it then is) says which
/// triangle each pixel is part of.
#[must_use]
pub fn compare(surface: &Surface, mesh: &Mesh, truth: &Truth, masks: &[u32], shown: &Shown<'_>) -> Counts {
    let mut counts = Counts::ZERO;
    for pixel in (0..masks.len()).filter(|&pixel| surface.face_id[pixel] != 0) {
        counts.visible += 1;
        events(surface, mesh, masks, shown, pixel, &mut counts);
        counts.stale += u64::from(is_stale(mesh, shown.light.drawn_id[pixel]));
        errors(surface, mesh, truth, shown.light, pixel, &mut counts);
    }
    counts
}

/// Whether a pixel shows a triangle that is no longer part of the mesh.
fn is_stale(mesh: &Mesh, id: u32) -> bool {
    id.checked_sub(1).is_some_and(|drawn| !mesh.is_drawn(DrawnId(drawn)))
}

/// Face of the triangle of an id, both plus 1.
fn face_of(mesh: &Mesh, id: u32) -> Option<u32> {
    id.checked_sub(1).and_then(|drawn| mesh.face(DrawnId(drawn))).map(|face| face.0 + 1)
}

/// Whether a pixel shows a face that does not belong there: not the one that is visible, nor, where the mode goes by depth, the one
/// that the full redraw shows. (At silhouettes those two may differ; either is right.)
fn is_foreign(mesh: &Mesh, shown: &Shown<'_>, (visible, true_face): (u32, Option<u32>), pixel: usize) -> bool {
    let face = face_of(mesh, shown.light.drawn_id[pixel]);
    face.is_some() && face != Some(visible) && (shown.goes_by_face || (true_face.is_some() && face != true_face))
}

/// Counts what happened at a pixel since the last comparison.
fn events(surface: &Surface, mesh: &Mesh, masks: &[u32], shown: &Shown<'_>, pixel: usize, counts: &mut Counts) {
    let visible = surface.face_id[pixel];
    let true_face = face_of(mesh, masks[pixel]);
    let to_update = true_face == Some(visible) && mesh.changed_after(DrawnId(masks[pixel] - 1), shown.since);
    let written = shown.written[pixel] > 0;
    let foreign = written && is_foreign(mesh, shown, (visible, true_face), pixel);
    counts.updated += u64::from(to_update);
    counts.missed += u64::from(to_update && !written);
    counts.foreign += u64::from(foreign);
    counts.double += u64::from(shown.doubled[pixel]);
}

/// What is wrong with a pixel as it stands, the worst last.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub enum Mark {
    /// Nothing, or not to be judged.
    #[default]
    Nothing,
    /// Its luminance differs by more than [`VISIBLE`].
    Wrong,
    /// It shows a triangle that is no longer part of the mesh.
    Stale,
    /// It shows another face than belongs there.
    Foreign,
}

/// What is wrong with each pixel; the arguments are those of [`compare`].
#[must_use]
pub fn marks(surface: &Surface, mesh: &Mesh, truth: &Truth, masks: &[u32], shown: &Shown<'_>) -> Vec<Mark> {
    let mark = |pixel: usize| {
        let (visible, id) = (surface.face_id[pixel], shown.light.drawn_id[pixel]);
        let true_face = face_of(mesh, masks[pixel]);
        let mut counts = Counts::ZERO;
        errors(surface, mesh, truth, shown.light, pixel, &mut counts);
        match (visible, is_stale(mesh, id)) {
            (0, _) => Mark::Nothing,
            (_, true) => Mark::Stale,
            _ if is_foreign(mesh, shown, (visible, true_face), pixel) => Mark::Foreign,
            _ if counts.wrong > 0 => Mark::Wrong,
            _ => Mark::Nothing,
        }
    };
    (0..masks.len()).map(mark).collect()
}

/// Compares the radiance of a pixel where the full redraw shows the face that is visible.
fn errors(surface: &Surface, mesh: &Mesh, truth: &Truth, light: &LuminanceLayers, pixel: usize, counts: &mut Counts) {
    if face_of(mesh, truth.drawn_id[pixel]) != Some(surface.face_id[pixel]) {
        counts.unmeasured += 1;
        return;
    }
    let (is, wanted) = (surface.radiance(light, pixel), truth.radiance[pixel]);
    let difference = (is - wanted).abs();
    let y = |c: Vec3| c.dot(Vec3::new(0.2126, 0.7152, 0.0722));
    counts.wrong += u64::from((y(is) - y(wanted)).abs() > VISIBLE * y(wanted));
    counts.close += u64::from(difference.cmple(wanted.abs() * 1e-3).all());
    counts.max_error = counts.max_error.max(f64::from(difference.max_element()));
    counts.error_sum += f64::from(difference.element_sum()) / 3.0;
    counts.radiance_sum += f64::from(wanted.element_sum()) / 3.0;
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::refine::update::{DrawnTriangle, Patch, SlotId, Update};
    use crate::scene::FaceId;

    /// Face 0 drawn with drawn triangle 0, then split into drawn triangles 2 and 3; face 1 with drawn triangle 1 throughout.
    fn mesh() -> Mesh {
        let mut mesh = Mesh::default();
        let drawn =
            |id, face| (DrawnId(id), DrawnTriangle { slots: [SlotId(0); 3], face: FaceId(face), level: 0, flat: None });
        let patch = |face, old, new| Patch { face: FaceId(face), old, new };
        mesh.apply(&Update {
            drawn_triangles: vec![drawn(0, 0), drawn(1, 1)],
            patches: vec![patch(0, 0..0, 0..1), patch(1, 1..1, 1..2)],
            patch_triangles: vec![DrawnId(0), DrawnId(1)],
            ..Update::default()
        });
        mesh.apply(&Update {
            drawn_triangles: vec![drawn(2, 0), drawn(3, 0)],
            patches: vec![patch(0, 0..1, 1..3)],
            patch_triangles: vec![DrawnId(0), DrawnId(2), DrawnId(3)],
            ..Update::default()
        });
        mesh
    }

    #[test]
    fn every_kind_of_artefact_is_counted_once() {
        // Right; missed and stale; twice; foreign; untouched; background.
        let surface = Surface {
            face_id: vec![1, 1, 1, 2, 2, 0],
            kd: vec![[1.0; 3]; 6],
            ks: vec![[0.0; 3]; 6],
            emitted: vec![[0.5; 3]; 6],
        };
        let d = |values: [f32; 6]| values.map(|v| [v; 3]).to_vec();
        let light = LuminanceLayers {
            d: d([1.0, 3.0, 1.0, 1.0, 2.0, 0.0]),
            s: d([9.0; 6]),
            writes: Vec::new(),
            drawn_id: vec![3, 1, 4, 4, 2, 0],
        };
        let truth = Truth {
            drawn_id: vec![3, 4, 4, 2, 2, 0],
            radiance: [1.5, 1.5, 1.5, 2.5, 2.5, 0.0].map(Vec3::splat).to_vec(),
        };
        let doubled = [false, false, true, false, false, false];
        let mut shown =
            Shown { light: &light, written: &[1, 0, 2, 1, 0, 0], doubled: &doubled, goes_by_face: false, since: 1 };
        let counts = compare(&surface, &mesh(), &truth, &truth.drawn_id, &shown);
        assert_eq!((counts.visible, counts.updated, counts.missed), (5, 3, 1));
        assert_eq!((counts.foreign, counts.double, counts.stale), (1, 1, 1));
        assert_eq!((counts.wrong, counts.close, counts.unmeasured), (2, 3, 0));
        assert!((counts.max_error - 2.0).abs() < 1e-6 && (counts.mean_error() - 3.0 / 5.0).abs() < 1e-6);
        assert!((counts.relative_error() - 3.0 / 9.5).abs() < 1e-6);
        use Mark::{Foreign, Nothing, Stale};
        let marked = marks(&surface, &mesh(), &truth, &truth.drawn_id, &shown);
        assert_eq!(marked, [Nothing, Stale, Nothing, Foreign, Nothing, Nothing]);
        // Nothing changed since the last update.
        shown.since = 2;
        assert_eq!(compare(&surface, &mesh(), &truth, &truth.drawn_id, &shown).updated, 0);
    }

    #[test]
    fn where_the_full_redraw_and_the_visible_face_differ_either_is_right() {
        let surface = Surface { face_id: vec![2], kd: vec![[1.0; 3]], ks: vec![[0.0; 3]], emitted: vec![[0.0; 3]] };
        let light = LuminanceLayers { d: vec![[5.0; 3]], s: vec![[0.0; 3]], writes: vec![1], drawn_id: vec![2] };
        let truth = Truth { drawn_id: vec![3], radiance: vec![Vec3::ONE] };
        let mut shown = Shown { light: &light, written: &[1], doubled: &[false], goes_by_face: true, since: 0 };
        let by_face = compare(&surface, &mesh(), &truth, &truth.drawn_id, &shown);
        assert_eq!((by_face.foreign, by_face.unmeasured, by_face.wrong), (0, 1, 0));
        shown.goes_by_face = false;
        assert_eq!(compare(&surface, &mesh(), &truth, &truth.drawn_id, &shown).foreign, 0);
        // The full redraw's own face, which is not the visible one.
        let light = LuminanceLayers { drawn_id: vec![4], ..light.clone() };
        let mut shown = Shown { light: &light, ..shown };
        assert_eq!(compare(&surface, &mesh(), &truth, &truth.drawn_id, &shown).foreign, 0);
        shown.goes_by_face = true;
        assert_eq!(compare(&surface, &mesh(), &truth, &truth.drawn_id, &shown).foreign, 1);
    }
}
