//! The pixels of each leaf: those of a face lie side by side, and among them those of each of its leaves. A split sorts
//! the pixels of its leaf among the children where they lie, so that pixels are never counted over the whole image.

use crate::cache::pixels::weights_on_ray;
use crate::scene::FaceId;
use crate::scene::camera::View;
use glam::Vec3;
use std::sync::Arc;

/// Which face each pixel of an image sees.
#[derive(Clone, Debug, PartialEq)]
pub struct FaceImage {
    /// The view that it is of.
    pub view: View,
    /// Ids of the faces plus 1, row by row from the top left; 0 where there is none.
    pub faces: Arc<[u32]>,
}

/// A pixel of a leaf.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LeafPixel {
    /// Its number, row by row from the top left.
    pub pixel: u32,
    /// Barycentric weights of the point that its centre sees, at the first two corners of the leaf.
    weights: [f32; 2],
}

/// Where the pixels of a leaf lie in the list of all.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Span {
    start: u32,
    len: u32,
    /// Number of the image that it belongs to; 0 for none.
    image: u32,
}

/// The pixels of a view that see any face, by face and leaf.
#[derive(Debug, Default)]
pub struct PixelLists {
    /// Those of a face side by side; their weights hold from when the face is [weighed](Self::weigh).
    pixels: Vec<LeafPixel>,
    /// Number of the image: spans of other images mean nothing.
    image: u32,
    /// Pixels of a leaf that is being divided, with their children.
    divided: Vec<(LeafPixel, usize)>,
}

impl LeafPixel {
    /// A pixel whose centre sees the point of these weights.
    pub(super) const fn at(pixel: u32, [a, b, _]: [f32; 3]) -> Self {
        Self { pixel, weights: [a, b] }
    }

    /// Barycentric weights of the point that its centre sees, at the corners of the leaf.
    #[must_use]
    pub fn weights(&self) -> [f32; 3] {
        let [a, b] = self.weights;
        [a, b, 1.0 - a - b]
    }

    /// Which child of its leaf it lies in, at corner 0, 1, 2 or in the middle, with its weights there: a child is half
    /// as large, so that weights double, and nothing is rounded.
    pub(super) fn in_child(self) -> (Self, usize) {
        let weights = self.weights();
        let child = weights.iter().position(|weight| *weight > 0.5).unwrap_or(3);
        let of_child = |corner: usize| match child {
            // Corner i of the middle child is the midpoint of edge i, which joins corners i and i + 1.
            3 => 1.0 - 2.0 * weights[(corner + 2) % 3],
            _ if corner == child => 2.0 * weights[corner] - 1.0,
            _ => 2.0 * weights[corner],
        };
        (Self { weights: [of_child(0), of_child(1)], ..self }, child)
    }
}

impl Span {
    /// Number of pixels.
    #[must_use]
    pub const fn len(self) -> u32 {
        self.len
    }

    /// Whether there are none.
    #[must_use]
    pub const fn is_empty(self) -> bool {
        self.len == 0
    }

    const fn range(self) -> std::ops::Range<usize> {
        self.start as usize..(self.start + self.len) as usize
    }
}

impl PixelLists {
    /// Takes the pixels of an image in, in place of those of the one before, for `faces` faces, of which `index_of` tells
    /// the index; returns the span of each.
    pub fn list(&mut self, image: &FaceImage, faces: usize, index_of: impl Fn(FaceId) -> Option<usize>) -> Vec<Span> {
        self.image += 1;
        let mut spans = vec![Span { image: self.image, ..Span::default() }; faces];
        let seen = |id: u32| index_of(FaceId(id.checked_sub(1)?));
        image.faces.iter().filter_map(|&id| seen(id)).for_each(|face| spans[face].len += 1);
        let mut start = 0;
        for span in &mut spans {
            span.start = start;
            start += span.len;
        }
        let mut next: Vec<u32> = spans.iter().map(|span| span.start).collect();
        self.pixels.clear();
        self.pixels.resize(start as usize, LeafPixel::default());
        for (&id, pixel) in image.faces.iter().zip(0..) {
            let Some(face) = seen(id) else { continue };
            self.pixels[next[face] as usize].pixel = pixel;
            next[face] += 1;
        }
        spans
    }

    /// Bytes held.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.pixels.capacity() * size_of::<LeafPixel>() + self.divided.capacity() * size_of::<(LeafPixel, usize)>()
    }

    /// Forgets the image.
    pub fn clear(&mut self) {
        self.image += 1;
        self.pixels.clear();
    }

    /// Whether a span is one of the present image.
    #[must_use]
    pub const fn holds(&self, span: Span) -> bool {
        span.image == self.image && span.image != 0
    }

    /// Finds where on its face each pixel of a face's span lies.
    pub fn weigh(&mut self, span: Span, view: &View, corners: [Vec3; 3]) {
        for pixel in &mut self.pixels[span.range()] {
            let ray = view.direction(view.size.centre_of(pixel.pixel as usize));
            // Seen edge-on, any point of the face will do.
            let weights = weights_on_ray(corners, view.eye, ray).unwrap_or([1.0 / 3.0; 3]);
            *pixel = LeafPixel::at(pixel.pixel, weights);
        }
    }

    /// The pixels of a span.
    #[must_use]
    pub fn of(&self, span: Span) -> &[LeafPixel] {
        &self.pixels[span.range()]
    }

    /// Sorts the pixels of a leaf among its children: at corners 0, 1, 2, and in the middle.
    pub fn divide(&mut self, span: Span) -> [Span; 4] {
        let mut children = [Span { image: self.image, ..Span::default() }; 4];
        self.divided.clear();
        for pixel in &self.pixels[span.range()] {
            let (pixel, child) = pixel.in_child();
            children[child].len += 1;
            self.divided.push((pixel, child));
        }
        let mut start = span.start;
        for child in &mut children {
            child.start = start;
            start += child.len;
        }
        let mut next = children.map(|child| child.start as usize);
        for &(pixel, child) in &self.divided {
            self.pixels[next[child]] = pixel;
            next[child] += 1;
        }
        children
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cache::pixels::weights_inside;
    use crate::scene::camera::{Camera, ImageSize};

    const CORNERS: [Vec3; 3] = [Vec3::new(-1.0, -0.8, 0.0), Vec3::new(1.1, -0.5, -0.6), Vec3::new(0.1, 0.9, 0.3)];

    /// An image in which a triangle, and nothing else, is face 3.
    fn image() -> FaceImage {
        let camera =
            Camera { position: Vec3::new(0.2, 0.1, 3.0), look_at: Vec3::ZERO, up: Vec3::Y, vertical_fov: 45.0 };
        let view = View::new(&camera, ImageSize { width: 64, height: 48 }, 4.0);
        let face = |pixel: usize| {
            let ray = view.direction(view.size.centre_of(pixel));
            if weights_inside(CORNERS, view.eye, ray).is_some() { 4 } else { 0 }
        };
        FaceImage { view, faces: (0..view.size.pixels()).map(face).collect() }
    }

    /// The pixels of faces, all with the same corners.
    fn listed(image: &FaceImage, faces: &[FaceId]) -> (PixelLists, Vec<Span>) {
        let mut lists = PixelLists::default();
        let spans = lists.list(image, faces.len(), |id| faces.iter().position(|face| *face == id));
        spans.iter().for_each(|&span| lists.weigh(span, &image.view, CORNERS));
        (lists, spans)
    }

    /// The corners of the children, in the order of `Topology::split`.
    fn children([a, b, c]: [Vec3; 3]) -> [[Vec3; 3]; 4] {
        let (ab, bc, ca) = ((a + b) * 0.5, (b + c) * 0.5, (c + a) * 0.5);
        [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
    }

    fn check(image: &FaceImage, lists: &PixelLists, span: Span, corners: [Vec3; 3]) {
        for pixel in lists.of(span) {
            let ray = image.view.direction(image.view.size.centre_of(pixel.pixel as usize)).normalize();
            let point: Vec3 = corners.iter().zip(pixel.weights()).map(|(corner, weight)| *corner * weight).sum();
            let off = (point - image.view.eye).normalize().distance(ray);
            assert!(off < 1e-5 && pixel.weights().iter().all(|w| *w > -1e-4), "{off} {:?}", pixel.weights());
        }
    }

    #[test]
    fn a_face_has_the_pixels_of_its_id() {
        let image = image();
        let (lists, spans) = listed(&image, &[FaceId(1), FaceId(3), FaceId(7)]);
        let expected: Vec<u32> =
            (0..).zip(image.faces.iter()).filter(|(_, id)| **id == 4).map(|(pixel, _)| pixel).collect();
        assert_eq!(spans.iter().map(|span| span.len()).collect::<Vec<_>>(), [0, expected.len() as u32, 0]);
        assert_eq!(lists.of(spans[1]).iter().map(|pixel| pixel.pixel).collect::<Vec<_>>(), expected);
        check(&image, &lists, spans[1], CORNERS);
    }

    #[test]
    fn spans_of_another_image_mean_nothing() {
        let image = image();
        let (mut lists, before) = listed(&image, &[FaceId(3)]);
        assert!(lists.holds(before[0]));
        let now = lists.list(&image, 1, |id| (id == FaceId(3)).then_some(0));
        assert_eq!([before[0], now[0]].map(|span| lists.holds(span)), [false, true]);
        lists.clear();
        assert!(!lists.holds(now[0]));
    }

    #[test]
    fn pixels_go_to_the_child_that_they_see() {
        let image = image();
        let (mut lists, spans) = listed(&image, &[FaceId(3)]);
        let mut leaves = vec![(spans[0], CORNERS)];
        for _ in 0..4 {
            let divided =
                leaves.iter().flat_map(|&(span, corners)| lists.divide(span).into_iter().zip(children(corners)));
            leaves = divided.collect();
            assert_eq!(leaves.iter().map(|(span, _)| span.len()).sum::<u32>(), spans[0].len());
            leaves.iter().for_each(|&(span, corners)| check(&image, &lists, span, corners));
        }
        assert!(leaves.iter().any(|(span, _)| span.is_empty()) && leaves.iter().any(|(span, _)| span.len() > 2));
    }
}
