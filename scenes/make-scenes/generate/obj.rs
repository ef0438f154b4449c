//! A Wavefront OBJ in the making: corners are rounded to a lattice first, so that equal positions weld bit for bit.

use super::paint::Paint;
use glam::{DAffine3, DVec2, DVec3};
use std::collections::HashMap;
use std::fmt::Write;

/// Lattice of positions: 0.1 mm at metre scale.
const POSITION_STEPS: f64 = 1e4;
/// Lattice of normals and texture coordinates.
const DETAIL_STEPS: f64 = 1e3;

/// One corner of a face.
#[derive(Clone, Copy)]
pub struct Corner {
    /// Position, metres.
    pub p: DVec3,
    /// Shading normal, any length.
    pub n: DVec3,
    /// Texture coordinates, in repeats of the texture.
    pub uv: DVec2,
}

/// Distinct lattice points in the order of their first use.
#[derive(Default)]
struct Pool {
    points: Vec<[i64; 3]>,
    index: HashMap<[i64; 3], usize>,
}

impl Pool {
    fn add(&mut self, value: DVec3, steps: f64) -> usize {
        let key = (value * steps).to_array().map(|c| c.round() as i64);
        *self.index.entry(key).or_insert_with(|| {
            self.points.push(key);
            self.points.len()
        })
    }

    fn write(&self, out: &mut String, keyword: &str, dimensions: usize, digits: usize) {
        for point in &self.points {
            out.push_str(keyword);
            for &c in &point[..dimensions] {
                out.push(' ');
                write_fixed(out, c, digits);
            }
            out.push('\n');
        }
    }
}

/// Writes `value` / 10^`digits` without trailing zeros.
fn write_fixed(out: &mut String, value: i64, digits: usize) {
    let text = format!("{}{:0width$}", if value < 0 { "-" } else { "" }, value.abs(), width = digits + 1);
    let (whole, fraction) = text.split_at(text.len() - digits);
    let fraction = fraction.trim_end_matches('0');
    out.push_str(whole);
    if !fraction.is_empty() {
        let _ = write!(out, ".{fraction}");
    }
}

/// The faces of one material: position, texture and normal index of every corner.
struct Group {
    paint: &'static Paint,
    faces: Vec<Vec<[usize; 3]>>,
}

/// Triangles of one material.
pub struct Triangles {
    /// The material.
    pub paint: &'static Paint,
    /// Metres.
    pub positions: Vec<[f32; 3]>,
    /// About unit.
    pub normals: Vec<[f32; 3]>,
    /// With v up.
    pub uvs: Vec<[f32; 2]>,
    /// Three a triangle.
    pub indices: Vec<u32>,
}

impl Triangles {
    const fn new(paint: &'static Paint) -> Self {
        Self { paint, positions: Vec::new(), normals: Vec::new(), uvs: Vec::new(), indices: Vec::new() }
    }
}

/// A mesh under construction; everything added passes through the current transform.
#[derive(Default)]
pub struct Obj {
    positions: Pool,
    uvs: Pool,
    normals: Pool,
    groups: Vec<Group>,
    transform: DAffine3,
}

impl Obj {
    /// Runs `build` with `local` as the frame of what it adds.
    pub fn at(&mut self, local: DAffine3, build: impl FnOnce(&mut Self)) {
        let outer = self.transform;
        self.transform = outer * local;
        build(self);
        self.transform = outer;
    }

    /// [`Self::at`] with a translation only.
    pub fn offset(&mut self, by: DVec3, build: impl FnOnce(&mut Self)) {
        self.at(DAffine3::from_translation(by), build);
    }

    /// Adds a convex face, counter-clockwise from its front; repeated positions are dropped.
    pub fn face(&mut self, paint: &'static Paint, corners: &[Corner]) {
        let mut face: Vec<[usize; 3]> = Vec::with_capacity(corners.len());
        for corner in corners {
            let p = self.positions.add(self.transform.transform_point3(corner.p), POSITION_STEPS);
            let n = self.transform.transform_vector3(corner.n).normalize_or_zero();
            let n = self.normals.add(n, DETAIL_STEPS);
            let t = if paint.is_textured() { self.uvs.add(corner.uv.extend(0.0), DETAIL_STEPS) } else { 0 };
            if face.iter().all(|c| c[0] != p) {
                face.push([p, t, n]);
            }
        }
        if face.len() >= 3 {
            self.group(paint).faces.push(face);
        }
    }

    /// Adds a flat convex face with texture coordinates from its local position, `paint.tile` metres a repeat.
    pub fn flat(&mut self, paint: &'static Paint, points: &[DVec3]) {
        // Newell's sum also serves a quadrilateral with two equal corners.
        let next = points.iter().cycle().skip(1);
        let n = points.iter().zip(next).fold(DVec3::ZERO, |sum, (a, b)| sum + (*a - points[0]).cross(*b - points[0]));
        let a = n.abs();
        let project = |p: DVec3| {
            if a.y >= a.x && a.y >= a.z {
                DVec2::new(p.x, -p.z)
            } else if a.x >= a.z {
                DVec2::new(-p.z * n.x.signum(), p.y)
            } else {
                DVec2::new(p.x * n.z.signum(), p.y)
            }
        };
        let corners: Vec<Corner> = points.iter().map(|&p| Corner { p, n, uv: project(p) / paint.tile }).collect();
        self.face(paint, &corners);
    }

    fn group(&mut self, paint: &'static Paint) -> &mut Group {
        let found = self.groups.iter().position(|g| g.paint.name == paint.name);
        let index = found.unwrap_or_else(|| {
            self.groups.push(Group { paint, faces: Vec::new() });
            self.groups.len() - 1
        });
        &mut self.groups[index]
    }

    /// The materials in use, in order of first use.
    pub fn paints(&self) -> impl Iterator<Item = &'static Paint> {
        self.groups.iter().map(|g| g.paint)
    }

    /// The triangles of each material, by vertices that have all of a corner.
    #[must_use]
    pub fn triangles(&self) -> Vec<Triangles> {
        let point = |pool: &Pool, number: usize, steps: f64| pool.points[number - 1].map(|c| (c as f64 / steps) as f32);
        let triangles = |group: &Group| {
            let mut out = Triangles::new(group.paint);
            let mut known: HashMap<[usize; 3], u32> = HashMap::new();
            for face in &group.faces {
                let numbers: Vec<u32> = face
                    .iter()
                    .map(|&corner| {
                        *known.entry(corner).or_insert_with(|| {
                            let [p, t, n] = corner;
                            out.positions.push(point(&self.positions, p, POSITION_STEPS));
                            out.normals.push(point(&self.normals, n, DETAIL_STEPS));
                            let uv = if t > 0 { point(&self.uvs, t, DETAIL_STEPS) } else { [0.0; 3] };
                            out.uvs.push([uv[0], uv[1]]);
                            out.positions.len() as u32 - 1
                        })
                    })
                    .collect();
                out.indices.extend((1..numbers.len() - 1).flat_map(|k| [numbers[0], numbers[k], numbers[k + 1]]));
            }
            out
        };
        self.groups.iter().map(triangles).collect()
    }

    /// The text of the OBJ file.
    #[must_use]
    pub fn text(&self, title: &str, mtllib: &str) -> String {
        let mut out = format!("# {title}\n# Written by make-scenes; MIT OR Apache-2.0.\nmtllib {mtllib}\n");
        self.positions.write(&mut out, "v", 3, 4);
        self.uvs.write(&mut out, "vt", 2, 3);
        self.normals.write(&mut out, "vn", 3, 3);
        for group in &self.groups {
            let _ = writeln!(out, "g {0}\nusemtl {0}", group.paint.name);
            for face in &group.faces {
                out.push('f');
                for [p, t, n] in face {
                    let _ = match group.paint.is_textured() {
                        true => write!(out, " {p}/{t}/{n}"),
                        false => write!(out, " {p}//{n}"),
                    };
                }
                out.push('\n');
            }
        }
        out
    }
}
