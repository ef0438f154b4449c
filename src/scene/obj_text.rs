//! A first, tolerant pass over the text of an OBJ file.
//!
//! `tobj` stops at the first fault, has no line numbers, and knows neither continuation lines nor forward references
//! across materials. This pass finds every fault with its line, drops what cannot be drawn, and writes a plain text that
//! `tobj` reads without a hitch: first all vertices, then faces whose indices are in range and whose corners all carry
//! the same attributes, with `usemtl` naming an entry of [`ObjText::materials`] by its number.

use super::commas;
use super::report::Report;
use super::text::{self, Lines, Warnings};
use super::vertex_colours::VertexColours;
use glam::DVec3;
use rustc_hash::FxHashMap;
use std::io::Write;
use std::path::Path;

/// Largest coordinate that is drawn: beyond it products of edges leave the range of 32-bit floats.
const MAX_COORDINATE: f64 = 1e9;

/// Statements of curves and surfaces that are no polygons.
const FREE_FORM: &str = "vp cstype deg bmat step curv curv2 surf parm trim hole scrv sp end con bsp bzp cdc cdp res";
/// Statements that make no difference here.
const NO_DIFFERENCE: &str = "mg lod bevel c_interp d_interp ctech stech shadow_obj trace_obj";

/// A name in the file, with its line.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Named {
    /// The name.
    pub name: String,
    /// Line of its first use, from 1.
    pub line: u32,
}

/// What the first pass makes of an OBJ file.
#[derive(Debug, Default)]
pub(super) struct ObjText {
    /// `v`, `vt` and `vn` lines for `tobj`.
    pub vertices: Vec<u8>,
    /// Whether all positions can be drawn.
    pub all_usable: bool,
    /// Whether the vertices have colours.
    pub has_colours: bool,
    /// `usemtl` and `f` lines for `tobj`.
    pub faces: Vec<u8>,
    /// Materials named by `usemtl`, in order of first use.
    pub materials: Vec<Named>,
    /// Whether faces use each of them.
    pub has_faces: Vec<bool>,
    /// What follows each `mtllib`.
    pub libraries: Vec<Named>,
    /// Faces that were dropped.
    pub dropped_faces: usize,
    /// Warnings.
    pub report: Report,
    /// What is subtracted from positions.
    origin: DVec3,
}

/// Something for each of `v`, `vt` and `vn`: how many there are, or the index of one.
type Triple<T> = [T; 3];
const V: usize = 0;
const VT: usize = 1;
const VN: usize = 2;

/// What the survey of the vertices found.
#[derive(Default)]
struct Survey {
    /// Totals of the file, without the stand-ins.
    totals: Triple<u32>,
    /// Positions that cannot be drawn, ascending, from 0.
    unusable: Vec<u32>,
}

impl ObjText {
    /// Reads the bytes of `file`; positions are taken from `origin`.
    pub(super) fn read(file: &Path, bytes: &[u8], origin: DVec3) -> Self {
        let mut warnings = Warnings::new(file);
        let mut out = Self { vertices: Vec::with_capacity(bytes.len()), origin, ..Self::default() };
        let survey = out.read_vertices(bytes, &mut warnings);
        out.read_faces(bytes, &survey, &mut warnings);
        out.report = warnings.finish();
        out
    }

    fn read_vertices(&mut self, bytes: &[u8], warnings: &mut Warnings) -> Survey {
        let mut survey = Survey::default();
        let mut colours = VertexColours::default();
        let mut lines = Lines::new(bytes);
        while let Some(line) = lines.next() {
            let (number, line) = match line {
                Ok(line) => line,
                Err(number) => {
                    warnings.add("line too long", number, || text::TOO_LONG.into());
                    continue;
                }
            };
            let (keyword, rest) = text::keyword(line);
            match keyword {
                b"v" => {
                    let rest = &commas::without(rest, number, warnings);
                    colours.add(survey.totals[V], rest, number);
                    self.position(rest, number, &mut survey, warnings);
                }
                b"vt" => {
                    survey.totals[VT] += 1;
                    self.texture_coordinate(&commas::without(rest, number, warnings), number, warnings);
                }
                b"vn" => {
                    survey.totals[VN] += 1;
                    self.normal(&commas::without(rest, number, warnings), number, warnings);
                }
                b"mtllib" => self.libraries.push(Named { name: text::decode(rest), line: number }),
                b"f" | b"fo" | b"usemtl" | b"g" | b"o" | b"s" => {}
                other => not_read(other, rest, number, warnings),
            }
        }
        self.has_colours = !colours.is_empty();
        if self.has_colours {
            colours.append_to(&mut self.vertices, warnings);
        }
        self.all_usable = survey.unusable.is_empty();
        self.stand_ins(survey.totals);
        survey
    }

    /// After the file's own: attributes for corners that lack one, so that all corners are alike to `tobj`.
    fn stand_ins(&mut self, totals: Triple<u32>) {
        if totals[VT] > 0 {
            self.vertices.extend_from_slice(b"vt 0 0\n");
        }
        if totals[VN] > 0 {
            self.vertices.extend_from_slice(b"vn 0 0 0\n");
        }
    }

    fn position(&mut self, rest: &[u8], line: u32, survey: &mut Survey, warnings: &mut Warnings) {
        let index = survey.totals[V];
        survey.totals[V] += 1;
        let moved = text::position(rest).map(|p| p - self.origin);
        match moved.filter(|p| p.is_finite() && p.abs().max_element() <= MAX_COORDINATE) {
            // A fourth number (w) belongs to rational curves; colours are appended later.
            Some(_) if self.origin == DVec3::ZERO => return self.copy_words(b"v", rest, 3),
            Some(p) => {
                // Writing to memory cannot fail.
                let _ = writeln!(self.vertices, "v {} {} {}", p.x as f32, p.y as f32, p.z as f32);
                return;
            }
            None => {}
        }
        survey.unusable.push(index);
        self.vertices.extend_from_slice(b"v 0 0 0\n");
        warnings.add("unusable vertex", line, || {
            "a vertex needs three finite numbers of at most 1e9, with blanks between them: faces that use this one are left out"
                .into()
        });
    }

    fn texture_coordinate(&mut self, rest: &[u8], line: u32, warnings: &mut Warnings) {
        let mut values = text::words(rest).map(text::number);
        match (values.next().flatten(), values.next()) {
            (Some(_), Some(Some(_))) => self.copy_words(b"vt", rest, 2),
            (Some(_), None) => {
                self.copy_words(b"vt", rest, 1);
                self.vertices.pop();
                self.vertices.extend_from_slice(b" 0\n");
            }
            _ => {
                self.vertices.extend_from_slice(b"vt 0 0\n");
                warnings.add("texture coordinate", line, || {
                    "a texture coordinate needs two finite numbers: (0, 0) is used".into()
                });
            }
        }
    }

    fn normal(&mut self, rest: &[u8], line: u32, warnings: &mut Warnings) {
        if numbers::<3>(rest).is_some() {
            self.copy_words(b"vn", rest, 3);
        } else {
            self.vertices.extend_from_slice(b"vn 0 0 0\n");
            warnings.add("normal", line, || "a normal needs three finite numbers: the geometric normal is used".into());
        }
    }

    fn copy_words(&mut self, keyword: &[u8], rest: &[u8], count: usize) {
        self.vertices.extend_from_slice(keyword);
        for word in text::words(rest).take(count) {
            self.vertices.push(b' ');
            self.vertices.extend_from_slice(word);
        }
        self.vertices.push(b'\n');
    }

    fn read_faces(&mut self, bytes: &[u8], survey: &Survey, warnings: &mut Warnings) {
        self.faces = Vec::with_capacity(bytes.len().saturating_sub(self.vertices.len()) + 64);
        // `tobj` asks for materials when it meets a library.
        self.faces.extend_from_slice(b"mtllib materials\n");
        let mut numbers_of: FxHashMap<Vec<u8>, usize> = FxHashMap::default();
        let mut so_far = Triple::default();
        let mut corners = Vec::new();
        let mut material = None;
        let mut lines = Lines::new(bytes);
        while let Some(line) = lines.next() {
            let Ok((number, line)) = line else { continue };
            let (keyword, rest) = text::keyword(line);
            match keyword {
                b"v" => so_far[V] += 1,
                b"vt" => so_far[VT] += 1,
                b"vn" => so_far[VN] += 1,
                b"f" | b"fo" => {
                    let face = Face { so_far, survey, line: number };
                    if !face.write(rest, &mut corners, &mut self.faces, warnings) {
                        self.dropped_faces += 1;
                    } else if let Some(id) = material {
                        self.has_faces[id] = true;
                    }
                }
                b"usemtl" => material = self.use_material(rest, number, &mut numbers_of, warnings).or(material),
                _ => {}
            }
        }
    }

    /// The number of the material, if the statement names one.
    fn use_material(
        &mut self,
        name: &[u8],
        line: u32,
        numbers_of: &mut FxHashMap<Vec<u8>, usize>,
        warnings: &mut Warnings,
    ) -> Option<usize> {
        if name.is_empty() {
            warnings.add("usemtl", line, || "usemtl names no material: the one before stays in use".into());
            return None;
        }
        let next = self.materials.len();
        let id = *numbers_of.entry(name.to_vec()).or_insert(next);
        if id == next {
            self.materials.push(Named { name: text::decode(name), line });
            self.has_faces.push(false);
        }
        // Writing to memory cannot fail.
        let _ = writeln!(self.faces, "usemtl {id}");
        Some(id)
    }
}

/// What is said of a statement that gives no vertex.
fn not_read(keyword: &[u8], rest: &[u8], line: u32, warnings: &mut Warnings) {
    let is_in = |list: &str| list.split(' ').any(|known| known.as_bytes() == keyword);
    if keyword == b"l" || keyword == b"p" {
        warnings.add("lines and points", line, || "lines and points (l, p) are not drawn: only faces are".into());
    } else if is_in(FREE_FORM) {
        warnings.once("free form", line, || {
            let kind = if keyword == b"cstype" { text::decode(&rest[..rest.len().min(40)]) } else { String::new() };
            let statement = format!("{} {kind}", text::decode(keyword));
            let statement = statement.trim_end();
            format!(
                "free-form curves and surfaces ({statement}) are not supported: tessellate to polygons when exporting"
            )
        });
    } else if !is_in(NO_DIFFERENCE) {
        warnings.add("unknown keyword", line, || format!("{} is not read: the line is left out", text::quote(keyword)));
    }
}

/// The first `N` words as finite numbers.
fn numbers<const N: usize>(rest: &[u8]) -> Option<[f32; N]> {
    let mut words = text::words(rest);
    let mut out = [0.0; N];
    for x in &mut out {
        *x = text::number(words.next()?)?;
    }
    Some(out)
}

/// One corner as written: position, texture coordinate, normal; 0 where there is none.
type Corner = Triple<i64>;

/// Where a face stands in its file.
struct Face<'s> {
    so_far: Triple<u32>,
    survey: &'s Survey,
    line: u32,
}

impl Face<'_> {
    /// Writes the face for `tobj`; `false` when it has to be dropped. `corners` is scratch.
    fn write(&self, rest: &[u8], corners: &mut Vec<Corner>, out: &mut Vec<u8>, warnings: &mut Warnings) -> bool {
        corners.clear();
        let mut as_written = true;
        for word in text::words(rest) {
            let Some(corner) = parse_corner(word) else {
                warnings.add("unreadable face", self.line, || {
                    format!("{} is no corner (v, v/vt, v//vn or v/vt/vn): the face is left out", text::quote(word))
                });
                return false;
            };
            let Some((corner, same)) = self.resolve(corner, warnings) else { return false };
            as_written &= same;
            corners.push(corner);
        }
        if corners.len() < 3 {
            warnings.add("face of fewer than three corners", self.line, || {
                format!("a face needs three corners, this one has {}: it is left out", corners.len())
            });
            return false;
        }
        out.push(b'f');
        if as_written {
            for word in text::words(rest) {
                out.push(b' ');
                out.extend_from_slice(word);
            }
        } else {
            corners.iter().for_each(|&corner| write_corner(out, corner));
        }
        out.push(b'\n');
        true
    }

    /// Indices from 1 into the whole file with stand-ins for missing attributes, and whether that is how the corner
    /// was written; `None`, with a warning, when it cannot be drawn.
    fn resolve(&self, corner: Corner, warnings: &mut Warnings) -> Option<(Corner, bool)> {
        let totals = self.survey.totals;
        let Some(v) = self.index(V, corner[V]) else {
            warnings.add("vertex index out of range", self.line, || {
                format!(
                    "there is no vertex {} ({} in the file, {} so far): the face is left out",
                    corner[V], totals[V], self.so_far[V]
                )
            });
            return None;
        };
        // The survey has named the vertex's own line.
        if !self.survey.unusable.is_empty() && self.survey.unusable.binary_search(&(v as u32 - 1)).is_ok() {
            warnings.add("face with an unusable vertex", self.line, || {
                format!("vertex {v} is unusable (see its line): the face is left out")
            });
            return None;
        }
        let out = [v, self.attribute(VT, corner[VT], warnings), self.attribute(VN, corner[VN], warnings)];
        let same = |kind: usize| out[kind] == corner[kind] && out[kind] > 0 || out[kind] == 0 && corner[kind] == NONE;
        Some((out, (0..3).all(same)))
    }

    /// Index of a texture coordinate or normal; the stand-in, or 0 where the file has none, when it is missing or wrong.
    fn attribute(&self, kind: usize, written: i64, warnings: &mut Warnings) -> i64 {
        let total = i64::from(self.survey.totals[kind]);
        let stand_in = if total > 0 { total + 1 } else { 0 };
        if written == NONE {
            return stand_in;
        }
        self.index(kind, written).unwrap_or_else(|| {
            warnings.add("attribute index out of range", self.line, || {
                let what = if kind == VT { "texture coordinate" } else { "normal" };
                let which = if written == UNREADABLE { "with an unreadable index".into() } else { written.to_string() };
                format!("there is no {what} {which}: the corner goes without")
            });
            stand_in
        })
    }

    /// An index from 1 into the whole file, `None` out of range. Negative ones count back from the line.
    fn index(&self, kind: usize, written: i64) -> Option<i64> {
        let index = if written < 0 { i64::from(self.so_far[kind]) + 1 + written } else { written };
        let limit = if written < 0 { self.so_far[kind] } else { self.survey.totals[kind] };
        (1..=i64::from(limit)).contains(&index).then_some(index)
    }
}

/// An attribute that a corner does not name.
const NONE: i64 = i64::MIN;
/// An attribute that cannot be read; out of range in any file.
const UNREADABLE: i64 = i64::MAX;

fn parse_corner(word: &[u8]) -> Option<Corner> {
    let mut corner = [NONE; 3];
    let mut parts = word.split(|&b| b == b'/');
    corner[V] = parse_index(parts.next()?)?;
    for slot in &mut corner[VT..] {
        match parts.next() {
            None => break,
            Some([]) => {}
            // Only the attribute is lost.
            Some(part) => *slot = parse_index(part).unwrap_or(UNREADABLE),
        }
    }
    parts.next().is_none().then_some(corner)
}

fn parse_index(bytes: &[u8]) -> Option<i64> {
    let (negative, digits) = match bytes.strip_prefix(b"-") {
        Some(digits) => (true, digits),
        None => (false, bytes),
    };
    if digits.is_empty() || digits.len() > 18 {
        return None;
    }
    let mut value = 0_i64;
    for &b in digits {
        if !b.is_ascii_digit() {
            return None;
        }
        value = value * 10 + i64::from(b - b'0');
    }
    Some(if negative { -value } else { value })
}

fn write_corner(out: &mut Vec<u8>, [v, vt, vn]: Corner) {
    // Writing to memory cannot fail.
    let _ = match (vt, vn) {
        (0, 0) => write!(out, " {v}"),
        (_, 0) => write!(out, " {v}/{vt}"),
        (0, _) => write!(out, " {v}//{vn}"),
        _ => write!(out, " {v}/{vt}/{vn}"),
    };
}
