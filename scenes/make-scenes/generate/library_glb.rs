//! The moonlit library as one binary glTF file: the same geometry, textures, lights and cameras.

use super::glb::{Glb, LUMENS_PER_WATT, with};
use super::library;
use super::obj::Obj;
use super::paint::{Paint, trim};
use super::textures::{self, Picture};
use super::toml::{Kind, Light};
use glam::DVec3;
use image::{GrayImage, ImageFormat, RgbaImage};
use serde_json::{Value, json};
use std::collections::HashMap;
use std::io::Cursor;

/// The file.
///
/// # Errors
/// If a texture cannot be encoded.
pub fn bytes() -> image::ImageResult<Vec<u8>> {
    let mut writer = Writer { glb: Glb::default(), pictures: textures::all()?, textures: HashMap::new() };
    let (hall, small) = library::objs();
    for (name, obj) in [("library", &hall), ("small-lights", &small)] {
        let mesh = writer.mesh(name, obj)?;
        writer.glb.root(json!({"name": name, "mesh": mesh}));
    }
    for light in library::lights() {
        writer.light(&light);
    }
    for camera in library::cameras() {
        writer.glb.camera(camera.0, camera.1, camera.2, camera.3);
    }
    Ok(writer.glb.bytes())
}

struct Writer {
    glb: Glb,
    pictures: Vec<Picture>,
    /// Number of each texture by its name, and that of its mask.
    textures: HashMap<(&'static str, Option<&'static str>), usize>,
}

impl Writer {
    fn mesh(&mut self, name: &str, obj: &Obj) -> image::ImageResult<usize> {
        let mut primitives = Vec::new();
        for group in obj.triangles() {
            let material = self.material(group.paint)?;
            let mut attributes = json!({
                "POSITION": self.glb.positions(&group.positions), "NORMAL": self.glb.floats(&group.normals),
            });
            if group.paint.is_textured() {
                let down: Vec<[f32; 2]> = group.uvs.iter().map(|[u, v]| [*u, 1.0 - v]).collect();
                attributes["TEXCOORD_0"] = json!(self.glb.floats(&down));
            }
            let indices = self.glb.indices(&group.indices);
            primitives.push(json!({"attributes": attributes, "indices": indices, "material": material}));
        }
        Ok(self.glb.push("meshes", json!({"name": name, "primitives": primitives})))
    }

    /// A material; its highlight goes to `extras`, since glTF has no Phong.
    fn material(&mut self, paint: &'static Paint) -> image::ImageResult<usize> {
        let [r, g, b] = paint.kd.map(trim);
        let mut pbr = json!({"baseColorFactor": [r, g, b, 1], "metallicFactor": 0, "roughnessFactor": 1});
        if let Some(map) = paint.map_kd {
            pbr["baseColorTexture"] = json!({"index": self.texture(map, paint.map_d)?});
        }
        let ks = [trim(paint.ks); 3];
        let penombre = json!({"ks": ks, "ns": trim(paint.ns).max(1.0)});
        let mut material = json!({"name": paint.name, "pbrMetallicRoughness": pbr, "extras": {"penombre": penombre}});
        if paint.map_d.is_some() {
            (material["alphaMode"], material["alphaCutoff"]) = (json!("MASK"), json!(0.5));
        }
        let strength = paint.ke.into_iter().fold(0.0, f64::max);
        if strength > 0.0 {
            self.glb.uses("KHR_materials_emissive_strength");
            material["emissiveFactor"] = json!(paint.ke.map(|c| trim(c) / strength));
            material["extensions"] = json!({"KHR_materials_emissive_strength": {"emissiveStrength": strength}});
        }
        if let Some(map) = paint.map_ke {
            material["emissiveTexture"] = json!({"index": self.texture(map, None)?});
        }
        Ok(self.glb.push("materials", material))
    }

    fn texture(&mut self, name: &'static str, mask: Option<&'static str>) -> image::ImageResult<usize> {
        if let Some(&known) = self.textures.get(&(name, mask)) {
            return Ok(known);
        }
        let png = |wanted: &str| self.pictures.iter().find(|p| p.name == wanted).map_or(&[][..], |p| &p.png);
        let texture = match mask {
            None => png(name).to_vec(),
            Some(mask) => masked(png(name), png(mask))?,
        };
        let number = self.glb.texture(name, &texture);
        self.textures.insert((name, mask), number);
        Ok(number)
    }

    fn light(&mut self, light: &Light) {
        let spectrum = |power: DVec3| {
            let most = power.max_element();
            let colour: Value = json!((power / most).to_array());
            json!({"color": colour, "intensity": most * LUMENS_PER_WATT})
        };
        match light.kind {
            Kind::Point { position, intensity } => {
                self.glb.light(&light.name, position, DVec3::NEG_Z, with(spectrum(intensity), "type", json!("point")));
            }
            Kind::Spot { position, direction, intensity, angles } => {
                let [inner, outer] = angles.map(f64::to_radians);
                let cone = json!({"innerConeAngle": inner, "outerConeAngle": outer});
                let spot = with(with(spectrum(intensity), "type", json!("spot")), "spot", cone);
                self.glb.light(&light.name, position, direction, spot);
            }
            Kind::Directional { direction, irradiance } => {
                let sun = with(spectrum(irradiance), "type", json!("directional"));
                self.glb.light(&light.name, DVec3::ZERO, direction, sun);
            }
        }
    }
}

/// A colour with a mask in its alpha, which is interpolated where the colour has more texels.
fn masked(colour: &[u8], mask: &[u8]) -> image::ImageResult<Vec<u8>> {
    let mut colour = image::load_from_memory(colour)?.to_rgba8();
    let mask = image::load_from_memory(mask)?.to_luma8();
    let (width, height) = colour.dimensions();
    for (x, y, texel) in colour.enumerate_pixels_mut() {
        texel.0[3] = bilinear(&mask, (f64::from(x) + 0.5) / f64::from(width), (f64::from(y) + 0.5) / f64::from(height));
    }
    encode(&colour)
}

/// A mask at a point, from 0 to 1 across and down; it repeats.
fn bilinear(mask: &GrayImage, u: f64, v: f64) -> u8 {
    let [across, down] = [(u, mask.width()), (v, mask.height())].map(|(c, n)| (c * f64::from(n) - 0.5, i64::from(n)));
    let at = |dx: i64, dy: i64| {
        let [x, y] = [(across, dx), (down, dy)].map(|((c, n), d)| (c.floor() as i64 + d).rem_euclid(n) as u32);
        f64::from(mask.get_pixel(x, y).0[0])
    };
    let [fx, fy] = [across.0, down.0].map(|c| c - c.floor());
    let row = |dy| at(0, dy) * (1.0 - fx) + at(1, dy) * fx;
    (row(0) * (1.0 - fy) + row(1) * fy).round() as u8
}

fn encode(image: &RgbaImage) -> image::ImageResult<Vec<u8>> {
    let mut png = Cursor::new(Vec::new());
    image.write_to(&mut png, ImageFormat::Png)?;
    Ok(png.into_inner())
}
