//! The text of an OBJ file, read with every fault at its line.
//!
//! Two passes: first all vertices, so that faces may name those that follow them, then the faces. What cannot be drawn is left out, and
//! said; so are continuation lines, negative indices and attributes that only some corners have made out here.

use super::commas;
use super::report::Report;
use super::text::{self, Lines, Warnings};
use super::vertex_colours::VertexColours;
use glam::{DVec3, Vec2, Vec3};
use rustc_hash::FxHashMap;
use std::path::Path;

/// Largest coordinate that is drawn: beyond it products of edges leave the range of 32-bit floats.
const MAX_COORDINATE: f32 = 1e9;

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

/// The polygons of an OBJ file.
#[derive(Debug, Default)]
pub(super) struct ObjMesh {
    /// Positions; not numbers where they cannot be drawn.
    pub positions: Vec<Vec3>,
    /// Linear colours of the positions; empty where none has one.
    pub colours: Vec<Vec3>,
    /// Texture coordinates.
    pub uvs: Vec<Vec2>,
    /// Normals, of any length; zero where the file has none that can be read.
    pub normals: Vec<Vec3>,
    /// Corners of all faces, one after the other.
    pub corners: Vec<Corner>,
    /// The faces in order.
    pub faces: Vec<Face>,
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

/// Where a corner's position, texture coordinate and normal stand in their arrays; [`ABSENT`] where it has none.
pub(super) type Corner = Triple<u32>;

/// An attribute that a corner goes without.
pub(super) const ABSENT: u32 = u32::MAX;

/// A polygon.
#[derive(Clone, Copy, Debug)]
pub(super) struct Face {
    /// Number of its corners.
    pub corners: u32,
    /// Index of its material in [`ObjMesh::materials`]; none before the first `usemtl`.
    pub material: Option<u32>,
}

/// Something for each of `v`, `vt` and `vn`: how many there are, or the index of one.
type Triple<T> = [T; 3];
pub(super) const V: usize = 0;
pub(super) const VT: usize = 1;
pub(super) const VN: usize = 2;

/// What the survey of the vertices found.
#[derive(Default)]
struct Survey {
    /// Totals of the file.
    totals: Triple<u32>,
    /// Positions that cannot be drawn, ascending, from 0.
    unusable: Vec<u32>,
}

impl ObjMesh {
    /// Reads the bytes of `file`; positions are taken from `origin`.
    pub(super) fn read(file: &Path, bytes: &[u8], origin: DVec3) -> Self {
        let mut warnings = Warnings::new(file);
        let mut out = Self { origin, ..Self::default() };
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
        if !colours.is_empty() {
            self.colours = colours.linear(self.positions.len(), warnings);
        }
        survey
    }

    fn position(&mut self, rest: &[u8], line: u32, survey: &mut Survey, warnings: &mut Warnings) {
        let index = survey.totals[V];
        survey.totals[V] += 1;
        // A fourth number (w) belongs to rational curves.
        let position = if self.origin == DVec3::ZERO {
            numbers::<3>(rest).map(Vec3::from_array)
        } else {
            text::position(rest).map(|p| (p - self.origin).as_vec3())
        };
        let usable = position.filter(|p| p.is_finite() && p.abs().max_element() <= MAX_COORDINATE);
        self.positions.push(usable.unwrap_or(Vec3::NAN));
        if usable.is_some() {
            return;
        }
        survey.unusable.push(index);
        warnings.add("unusable vertex", line, || {
            "a vertex needs three finite numbers of at most 1e9, with blanks between them: faces that use this one are left out"
                .into()
        });
    }

    fn texture_coordinate(&mut self, rest: &[u8], line: u32, warnings: &mut Warnings) {
        let mut values = text::words(rest).map(text::number);
        let uv = match (values.next().flatten(), values.next()) {
            (Some(u), Some(Some(v))) => Some(Vec2::new(u, v)),
            (Some(u), None) => Some(Vec2::new(u, 0.0)),
            _ => None,
        };
        self.uvs.push(uv.unwrap_or(Vec2::ZERO));
        if uv.is_none() {
            warnings.add("texture coordinate", line, || {
                "a texture coordinate needs two finite numbers: (0, 0) is used".into()
            });
        }
    }

    fn normal(&mut self, rest: &[u8], line: u32, warnings: &mut Warnings) {
        let normal = numbers::<3>(rest).map(Vec3::from_array);
        self.normals.push(normal.unwrap_or(Vec3::ZERO));
        if normal.is_none() {
            warnings.add("normal", line, || "a normal needs three finite numbers: the geometric normal is used".into());
        }
    }

    fn read_faces(&mut self, bytes: &[u8], survey: &Survey, warnings: &mut Warnings) {
        let mut numbers_of: FxHashMap<Vec<u8>, u32> = FxHashMap::default();
        let mut so_far = Triple::default();
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
                    let statement = Statement { so_far, survey, line: number };
                    match statement.read(rest, &mut self.corners, warnings) {
                        Some(corners) => self.faces.push(Face { corners, material }),
                        None => self.dropped_faces += 1,
                    }
                }
                b"usemtl" => material = self.use_material(rest, number, &mut numbers_of, warnings).or(material),
                _ => {}
            }
        }
        self.has_faces = vec![false; self.materials.len()];
        for material in self.faces.iter().filter_map(|face| face.material) {
            self.has_faces[material as usize] = true;
        }
    }

    /// The number of the material, if the statement names one.
    fn use_material(
        &mut self,
        name: &[u8],
        line: u32,
        numbers_of: &mut FxHashMap<Vec<u8>, u32>,
        warnings: &mut Warnings,
    ) -> Option<u32> {
        if name.is_empty() {
            warnings.add("usemtl", line, || "usemtl names no material: the one before stays in use".into());
            return None;
        }
        let next = self.materials.len() as u32;
        let id = *numbers_of.entry(name.to_vec()).or_insert(next);
        if id == next {
            self.materials.push(Named { name: text::decode(name), line });
        }
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

/// A corner as written: indices from 1 of position, texture coordinate and normal, negative ones from the end.
type Written = Triple<i64>;

/// A face statement, by where it stands in its file.
struct Statement<'s> {
    so_far: Triple<u32>,
    survey: &'s Survey,
    line: u32,
}

impl Statement<'_> {
    /// Appends the corners and tells their number; `None`, and nothing is appended, when the face has to be dropped.
    fn read(&self, rest: &[u8], corners: &mut Vec<Corner>, warnings: &mut Warnings) -> Option<u32> {
        let before = corners.len();
        let found = self.append(rest, corners, warnings);
        if found.is_none() {
            corners.truncate(before);
        }
        found
    }

    fn append(&self, rest: &[u8], corners: &mut Vec<Corner>, warnings: &mut Warnings) -> Option<u32> {
        let mut count = 0;
        for word in text::words(rest) {
            let Some(written) = parse_corner(word) else {
                warnings.add("unreadable face", self.line, || {
                    format!("{} is no corner (v, v/vt, v//vn or v/vt/vn): the face is left out", text::quote(word))
                });
                return None;
            };
            corners.push(self.resolve(written, warnings)?);
            count += 1;
        }
        if count < 3 {
            warnings.add("face of fewer than three corners", self.line, || {
                format!("a face needs three corners, this one has {count}: it is left out")
            });
            return None;
        }
        Some(count)
    }

    /// Where the corner's attributes are; `None`, with a warning, when it cannot be drawn.
    fn resolve(&self, corner: Written, warnings: &mut Warnings) -> Option<Corner> {
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
        if !self.survey.unusable.is_empty() && self.survey.unusable.binary_search(&v).is_ok() {
            warnings.add("face with an unusable vertex", self.line, || {
                format!("vertex {} is unusable (see its line): the face is left out", v + 1)
            });
            return None;
        }
        Some([v, self.attribute(VT, corner[VT], warnings), self.attribute(VN, corner[VN], warnings)])
    }

    /// Index of a texture coordinate or normal; [`ABSENT`] when it is missing or wrong.
    fn attribute(&self, kind: usize, written: i64, warnings: &mut Warnings) -> u32 {
        if written == NONE {
            return ABSENT;
        }
        self.index(kind, written).unwrap_or_else(|| {
            warnings.add("attribute index out of range", self.line, || {
                let what = if kind == VT { "texture coordinate" } else { "normal" };
                let which = if written == UNREADABLE { "with an unreadable index".into() } else { written.to_string() };
                format!("there is no {what} {which}: the corner goes without")
            });
            ABSENT
        })
    }

    /// An index from 0 into the whole file, `None` out of range. Negative ones count back from the line.
    fn index(&self, kind: usize, written: i64) -> Option<u32> {
        let index = if written < 0 { i64::from(self.so_far[kind]) + 1 + written } else { written };
        let limit = if written < 0 { self.so_far[kind] } else { self.survey.totals[kind] };
        (1..=i64::from(limit)).contains(&index).then(|| index as u32 - 1)
    }
}

/// An attribute that a corner does not name.
const NONE: i64 = i64::MIN;
/// An attribute that cannot be read; out of range in any file.
const UNREADABLE: i64 = i64::MAX;

fn parse_corner(word: &[u8]) -> Option<Written> {
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
