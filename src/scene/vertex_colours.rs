//! Colours of vertices: `v x y z r g b`, as scanners, MeshLab and Blender write them.

use super::texel::srgb_to_linear;
use super::text::{self, Warnings};
use std::io::Write;

/// Reflectance of a vertex without a colour in a file that has some: that of a material without `Kd`.
const PLAIN: f32 = 0.8;

/// The colours of a file's vertices as written; empty where none has one.
#[derive(Default)]
pub(super) struct VertexColours {
    written: Vec<Option<[f32; 3]>>,
    largest: f32,
    /// Line of the largest value.
    line: u32,
}

impl VertexColours {
    /// Takes what follows the keyword of the vertex of that index, from 0. A fourth number alone is a weight (w); one after
    /// three of colour is alpha, which is not used.
    pub(super) fn add(&mut self, index: u32, rest: &[u8], line: u32) {
        let mut words = text::words(rest).skip(3);
        let Some(first) = words.next() else { return };
        let [Some(r), Some(g), Some(b)] = [Some(first), words.next(), words.next()].map(|w| w.and_then(text::number))
        else {
            return;
        };
        self.written.resize(index as usize, None);
        self.written.push(Some([r, g, b]));
        let largest = r.max(g).max(b);
        if largest > self.largest {
            (self.largest, self.line) = (largest, line);
        }
    }

    pub(super) const fn is_empty(&self) -> bool {
        self.written.is_empty()
    }

    /// What the largest value means: 1, or 255. Warns where it is not 1.
    fn white(&self, warnings: &mut Warnings) -> f32 {
        // Twice the most is no rounding: such a file counts in codes.
        let white = if self.largest > 2.0 { 255.0 } else { 1.0 };
        if self.largest > 1.0 {
            warnings.add("vertex colours beyond 1", self.line, || {
                let meaning = if white > 1.0 { "all colours of the file are taken as of 255" } else { "1 is used" };
                format!("a vertex colour of {}, where 1 is the most: {meaning}", self.largest)
            });
        }
        white
    }

    /// Appends linear reflectances to the `v` lines of the text for `tobj`.
    pub(super) fn append_to(&self, vertices: &mut Vec<u8>, warnings: &mut Warnings) {
        let white = self.white(warnings);
        let linear = |c: f32| srgb_to_linear((c / white).clamp(0.0, 1.0));
        let mut written = self.written.iter();
        let mut out = Vec::with_capacity(vertices.len() + 32 * self.written.len());
        for line in vertices.split_inclusive(|&b| b == b'\n') {
            if !line.starts_with(b"v ") {
                out.extend_from_slice(line);
                continue;
            }
            let colour = written.next().copied().flatten().map_or([PLAIN; 3], |c| c.map(linear));
            out.extend_from_slice(line.trim_ascii_end());
            // Writing to memory cannot fail.
            let _ = writeln!(out, " {} {} {}", colour[0], colour[1], colour[2]);
        }
        *vertices = out;
    }
}
