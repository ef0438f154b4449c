//! PLY files: binary, little-endian. Colours as displayed in `red`, `green`, `blue`, since every reader knows these as bytes; light in
//! float properties beside them (docs/bake.md).

use super::lit_mesh::{LitMesh, Part};
use crate::error::{Error, Result};
use crate::image::{atomic, tone_mapping};
use crate::scene::Display;
use glam::{DVec3, Vec3};
use std::io::{self, BufWriter, Write};
use std::path::Path;

/// Writes the mesh.
///
/// # Errors
/// [`Error::Io`] naming the file; [`Error::Usage`] for more vertices than the format's indices tell apart.
pub fn write(path: &Path, mesh: &LitMesh, display: &Display) -> Result<()> {
    if i32::try_from(mesh.vertex_count()).is_err() {
        return Err(Error::Usage(format!("{}: a PLY file holds at most 2^31 vertices; bake coarser", path.display())));
    }
    atomic::write(path, |file| {
        let mut out = BufWriter::new(file);
        out.write_all(header(mesh).as_bytes())?;
        mesh.parts.iter().try_for_each(|part| vertices(&mut out, mesh.origin, part, display))?;
        let mut first = 0;
        for part in &mesh.parts {
            for triangle in &part.triangles {
                out.write_all(&[3])?;
                triangle.iter().try_for_each(|&corner| out.write_all(&(first + corner).to_le_bytes()))?;
            }
            first += part.vertices.len() as u32;
        }
        out.flush()
    })
}

/// What the light of a name, or what bounces, is called in properties.
fn property_of(index: usize, name: Option<&String>) -> String {
    if name.is_some() { format!("light_{index}") } else { "light_indirect".to_owned() }
}

fn header(mesh: &LitMesh) -> String {
    let mut text = "ply\nformat binary_little_endian 1.0\n".to_owned();
    text += concat!("comment penombre ", env!("CARGO_PKG_VERSION"), "\n");
    text += "comment red green blue: as displayed; radiance: L_e + k_d D, light: D, linear Rec.709, W/(sr m2)\n";
    for (index, name) in mesh.lights.iter().enumerate() {
        if let Some(name) = name {
            let name: String = name.chars().map(|c| if c.is_control() { ' ' } else { c }).collect();
            text += &format!("comment light_{index}: {name}\n");
        }
    }
    text += &format!("element vertex {}\n", mesh.vertex_count());
    // Far from the origin single precision is too coarse.
    let position = if mesh.origin == DVec3::ZERO { "float" } else { "double" };
    let mut property = |kind: &str, names: &[&str]| {
        names.iter().for_each(|name| text += &format!("property {kind} {name}\n"));
    };
    property(position, &["x", "y", "z"]);
    property("float", &["nx", "ny", "nz"]);
    property("uchar", &["red", "green", "blue"]);
    let parts = mesh.lights.iter().enumerate().map(|(index, name)| property_of(index, name.as_ref()));
    for name in ["radiance".to_owned(), "light".to_owned()].into_iter().chain(parts) {
        property("float", &["r", "g", "b"].map(|c| format!("{name}_{c}")).each_ref().map(String::as_str));
    }
    text + &format!("element face {}\nproperty list uchar int vertex_indices\nend_header\n", mesh.triangle_count())
}

fn vertices(out: &mut impl Write, origin: DVec3, part: &Part, display: &Display) -> io::Result<()> {
    for (index, vertex) in part.vertices.iter().enumerate() {
        if origin == DVec3::ZERO {
            floats(out, &vertex.position.to_array())?;
        } else {
            let position = vertex.position.as_dvec3() + origin;
            position.to_array().iter().try_for_each(|x| out.write_all(&x.to_le_bytes()))?;
        }
        floats(out, &vertex.normal.to_array())?;
        out.write_all(&tone_mapping::display(vertex.radiance, display.exposure, display.tone_mapping))?;
        let lights = part.lights.iter().map(|light| light[index]);
        let all: Vec<Vec3> = [vertex.radiance, vertex.light].into_iter().chain(lights).collect();
        all.iter().try_for_each(|value| floats(out, &value.to_array()))?;
    }
    Ok(())
}

fn floats(out: &mut impl Write, values: &[f32]) -> io::Result<()> {
    values.iter().try_for_each(|value| out.write_all(&value.to_le_bytes()))
}
