//! The materials that a file's faces use.

use super::document::Document;
use super::faults::Faults;
use super::maps::{Map, TextureRef};
use crate::scene::map_options::MapOptions;
use crate::scene::material::{Material, MetallicRoughness, Model, NormalMap, TextureMap};
use crate::scene::materials::bound;
use crate::scene::soup::SKIP;
use crate::scene::texel_source::{Recipe, Role};
use ::gltf::json::material::AlphaMode;
use ::gltf::json::validation::Checked;
use ::gltf::json::{self};
use glam::{Vec3, Vec4};
use serde::Deserialize;

/// What a texture is to a material.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum MapUse {
    Base,
    Emission,
    Mask,
    MetallicRoughness,
    Normal,
}

/// How many there are.
const USES: usize = 5;
/// Transmission from which on a material counts as glass, whose faces are left out.
const GLASS: f32 = 0.5;

/// A material in use.
#[derive(Clone, Debug)]
pub(super) struct Surface {
    /// Its number among those that are drawn; [`SKIP`] for one whose faces are left out.
    pub slot: u32,
    /// Which texture coordinates it is looked up by.
    pub uv_set: u32,
    /// Whether its faces are written a second time, turned over, so that both sides emit.
    pub twice: bool,
    /// Without its textures.
    material: Material,
    maps: Vec<(MapUse, Map)>,
    normal_scale: f32,
}

impl Surface {
    /// The material of faces that name none.
    pub(super) fn plain(coloured: bool) -> Self {
        let mut material = Material::grey("no material");
        if coloured {
            material.kd = Vec3::ONE;
        }
        Self { slot: 0, uv_set: 0, twice: false, material, maps: Vec::new(), normal_scale: 1.0 }
    }

    /// The material of that number, if there is one.
    pub(super) fn new(document: &Document, number: usize, faults: &mut Faults) -> Option<Self> {
        let m = document.root.materials.get(number)?;
        let name = m.name.clone().filter(|name| !name.is_empty()).unwrap_or_else(|| format!("material {number}"));
        let mut about = About { name, faults };
        let stated = Stated::of(m);
        let mut surface = Self::plain(false);
        surface.material = about.material(m, &stated);
        surface.twice = m.double_sided && surface.material.unlit;
        about.maps(document, (number, m), &stated, &mut surface);
        about.unsupported(document, number);
        if about.is_left_out(m, &stated) {
            surface.slot = SKIP;
        }
        Some(surface)
    }

    /// Whether it shows its colour whatever the light.
    pub(super) const fn is_unlit(&self) -> bool {
        self.material.unlit
    }

    /// Its textures.
    pub(super) fn maps(&self) -> impl Iterator<Item = &Map> {
        self.maps.iter().map(|(_, map)| map)
    }

    /// The material; `found` answers [`Self::maps`], in order.
    pub(super) fn build(&self, found: &mut dyn Iterator<Item = Option<TextureMap>>) -> Material {
        let mut maps = [None; USES];
        for (purpose, _) in &self.maps {
            maps[*purpose as usize] = found.next().flatten();
        }
        let [base, emission, mask, metallic_roughness, normal] = maps;
        let mut material = self.material.clone();
        material.map_d = mask;
        if material.unlit {
            material.map_ke = base;
            return material;
        }
        (material.map_kd, material.map_ke) = (base, emission);
        material.map_normal = normal.map(|map| NormalMap { map, scale: self.normal_scale });
        if let Model::MetallicRoughness(model) = &mut material.model {
            (model.map_metallic, model.map_roughness) = (metallic_roughness, metallic_roughness);
        }
        material
    }
}

/// What a material states of its surface, by whichever model.
struct Stated<'d> {
    base: Vec4,
    base_map: Option<TextureRef<'d>>,
    metallic: f32,
    roughness: f32,
    metallic_roughness_map: Option<TextureRef<'d>>,
    unlit: bool,
    phong: Result<Option<OurPhong>, String>,
}

/// `extras` of our own: the parameters of a Phong highlight (docs/scene-format.md).
#[derive(Clone, Copy, Debug, Deserialize)]
struct OurPhong {
    ks: [f32; 3],
    ns: f32,
}

#[derive(Deserialize)]
struct Extras {
    penombre: Option<OurPhong>,
}

impl<'d> Stated<'d> {
    fn of(m: &'d json::Material) -> Self {
        let pbr = &m.pbr_metallic_roughness;
        let extensions = m.extensions.as_ref();
        let phong =
            m.extras.as_ref().filter(|extras| extras.get().contains("\"penombre\"")).map_or(Ok(None), |extras| {
                serde_json::from_str::<Extras>(extras.get()).map(|extras| extras.penombre).map_err(|e| e.to_string())
            });
        let stated = Self {
            base: Vec4::from(pbr.base_color_factor.0),
            base_map: pbr.base_color_texture.as_ref().map(TextureRef::of),
            metallic: pbr.metallic_factor.0,
            roughness: pbr.roughness_factor.0,
            metallic_roughness_map: pbr.metallic_roughness_texture.as_ref().map(TextureRef::of),
            unlit: extensions.is_some_and(|extensions| extensions.unlit.is_some()),
            phong,
        };
        match extensions.and_then(|extensions| extensions.pbr_specular_glossiness.as_ref()) {
            Some(other) => Self {
                base: Vec4::from(other.diffuse_factor.0),
                base_map: other.diffuse_texture.as_ref().map(TextureRef::of),
                metallic: 0.0,
                roughness: 1.0 - other.glossiness_factor.0,
                metallic_roughness_map: None,
                ..stated
            },
            None => stated,
        }
    }
}

/// A material in the making, and what is to be said about it.
struct About<'a> {
    name: String,
    faults: &'a mut Faults,
}

impl About<'_> {
    fn warn(&mut self, what: &str) {
        self.faults.warn("materials", format!("material {}: {what}", self.name));
    }

    fn material(&mut self, m: &json::Material, stated: &Stated<'_>) -> Material {
        let base = self.share(stated.base.truncate(), "its base colour");
        let mut material = Material { kd: base, unlit: stated.unlit, ..Material::grey(&self.name) };
        if stated.unlit {
            (material.kd, material.ke) = (Vec3::ZERO, base);
            return material;
        }
        material.ke = self.emission(m);
        match &stated.phong {
            Ok(Some(phong)) => self.phong(*phong, &mut material),
            Ok(None) => {
                let [metallic, roughness] = [(stated.metallic, "its metalness"), (stated.roughness, "its roughness")]
                    .map(|(v, what)| self.share(Vec3::splat(v), what).x);
                let (map_metallic, map_roughness) = (None, None);
                material.model =
                    Model::MetallicRoughness(MetallicRoughness { metallic, roughness, map_metallic, map_roughness });
            }
            Err(why) => {
                let message = format!("its extras name penombre, but not as {{\"ks\": [r, g, b], \"ns\": s}}: {why}");
                self.warn(&message);
            }
        }
        material
    }

    fn phong(&mut self, OurPhong { ks, ns }: OurPhong, material: &mut Material) {
        let ks = Vec3::from(ks);
        if !ks.is_finite() || ks.min_element() < 0.0 || !ns.is_finite() || ns <= 0.0 {
            self.warn("the penombre of its extras wants ks of 0 or more and ns above 0: it has no highlight");
            return;
        }
        let (kd, ks) = bound(material.kd, ks);
        material.kd = kd;
        material.model = Model::phong(ks, ns);
    }

    /// Numbers from 0 to 1.
    fn share(&mut self, value: Vec3, what: &str) -> Vec3 {
        let within = Vec3::from(value.to_array().map(|v| if v.is_nan() { 0.0 } else { v.clamp(0.0, 1.0) }));
        if within != value {
            self.warn(&format!("{what} is not within 0 and 1: it is brought there"));
        }
        within
    }

    /// L_e: the number that the file has for nits (docs/units.md).
    fn emission(&mut self, m: &json::Material) -> Vec3 {
        let strength = m.extensions.as_ref().and_then(|extensions| extensions.emissive_strength.as_ref());
        let emission = Vec3::from(m.emissive_factor.0) * strength.map_or(1.0, |strength| strength.emissive_strength.0);
        if emission.is_finite() && emission.min_element() >= 0.0 {
            return emission;
        }
        self.warn("its emission is negative or no number: it does not emit");
        Vec3::ZERO
    }

    /// Chooses the texture coordinates, and the textures that are looked up by them.
    fn maps(
        &mut self,
        document: &Document,
        (number, m): (usize, &json::Material),
        stated: &Stated<'_>,
        surface: &mut Surface,
    ) {
        let is_phong = matches!(surface.material.model, Model::Phong(_));
        let plain = |role| Recipe::new(role, &MapOptions::default());
        let mut wanted: Vec<(MapUse, TextureRef<'_>, Recipe)> = Vec::new();
        let base_role = if stated.unlit { Role::Emission } else { Role::Colour };
        wanted.extend(stated.base_map.map(|map| (MapUse::Base, map, plain(base_role))));
        let cut = stated.base_map.zip(self.cutoff(m, stated));
        wanted.extend(cut.map(|(map, cutoff)| (MapUse::Mask, map, cut_recipe(cutoff))));
        if !stated.unlit {
            let emission = m.emissive_texture.as_ref().filter(|_| surface.material.ke != Vec3::ZERO);
            wanted.extend(emission.map(|info| (MapUse::Emission, TextureRef::of(info), plain(Role::Emission))));
            let data = stated.metallic_roughness_map.filter(|_| !is_phong);
            wanted.extend(data.map(|map| (MapUse::MetallicRoughness, map, plain(Role::Data))));
            if let Some(normals) = &m.normal_texture {
                let transform = document.names.materials.get(number).and_then(|names| names.normal_transform());
                wanted.push((MapUse::Normal, TextureRef::of_normals(normals, transform), plain(Role::Data)));
                surface.normal_scale = if normals.scale.is_finite() { normals.scale } else { 1.0 };
            }
        }
        surface.uv_set = wanted.first().map_or(0, |(_, map, _)| map.set);
        let others = wanted.iter().filter(|(_, map, _)| map.set != surface.uv_set).count();
        if others > 0 {
            let set = surface.uv_set;
            self.warn(&format!(
                "its textures have different texture coordinates: those by TEXCOORD_{set} alone are used"
            ));
        }
        for (purpose, texture, recipe) in wanted.into_iter().filter(|(_, map, _)| map.set == surface.uv_set) {
            match Map::new(document, texture, recipe) {
                Ok(map) => surface.maps.push((purpose, map)),
                // Said of the colour already.
                Err(_) if purpose == MapUse::Mask => {}
                Err(why) => self.warn(&format!("{why}: the constant is used")),
            }
        }
    }

    /// The alpha of the texture from which on it is opaque; `None` where it is everywhere.
    fn cutoff(&mut self, m: &json::Material, stated: &Stated<'_>) -> Option<f32> {
        let cutoff = match m.alpha_mode {
            Checked::Valid(AlphaMode::Mask) => m.alpha_cutoff.map_or(0.5, |cutoff| cutoff.0),
            Checked::Valid(AlphaMode::Blend) => 0.5,
            Checked::Valid(AlphaMode::Opaque) => return None,
            Checked::Invalid => {
                self.warn("its alphaMode is none of OPAQUE, MASK and BLEND: it is opaque");
                return None;
            }
        };
        Some(cutoff / stated.base.w).filter(|cutoff| *cutoff > 0.0)
    }

    /// Whether its faces let light pass, or are nowhere opaque.
    fn is_left_out(&mut self, m: &json::Material, stated: &Stated<'_>) -> bool {
        let transmission = m.extensions.as_ref().and_then(|extensions| extensions.transmission.as_ref());
        let clear = transmission.filter(|t| t.transmission_texture.is_none()).map_or(0.0, |t| t.transmission_factor.0);
        let is_blended = matches!(m.alpha_mode, Checked::Valid(AlphaMode::Blend));
        let opaque_from = self.cutoff(m, stated);
        let why = if clear >= GLASS {
            format!("transmission {clear} (glass)")
        } else if opaque_from.is_some_and(|cutoff| cutoff > 1.0) {
            format!("alpha {} (transparent)", stated.base.w)
        } else {
            if is_blended && (stated.base_map.is_some() || stated.base.w < 1.0) {
                let message = format!(
                    "material {}: blending is not supported yet: it is cut out where alpha is below 0.5",
                    self.name
                );
                self.faults.stand_in(message);
            }
            return false;
        };
        let message =
            format!("material {}: {why} is not supported yet: its faces are not drawn and let light pass", self.name);
        self.faults.stand_in(message);
        true
    }

    /// Names what of the material is not used.
    fn unsupported(&mut self, document: &Document, number: usize) {
        const READ: [&str; 4] = [
            "KHR_materials_emissive_strength",
            "KHR_materials_unlit",
            "KHR_materials_transmission",
            "KHR_materials_variants",
        ];
        let names = document.names.materials.get(number).into_iter().flat_map(|names| names.names());
        let missed: Vec<&str> =
            names.filter(|name| !READ.contains(name) && !name.starts_with("KHR_xmp")).map(in_words).collect();
        if !missed.is_empty() {
            let message = format!("material {}: not supported yet and not used: {}", self.name, missed.join(", "));
            self.faults.stand_in(message);
        }
    }
}

fn in_words(extension: &str) -> &str {
    match extension {
        "KHR_materials_pbrSpecularGlossiness" => {
            "KHR_materials_pbrSpecularGlossiness (but for its diffuse colour and glossiness)"
        }
        other => other,
    }
}

/// The mask of a texture whose alpha is opaque from `cutoff` on: our rule is 0.5, and so alpha is scaled to have it there.
fn cut_recipe(cutoff: f32) -> Recipe {
    let gain = (0.5 / cutoff).min(0.5 / (1.0 - cutoff).max(0.0));
    Recipe::new(Role::Cut, &MapOptions { base: 0.5 - gain * cutoff, gain, ..MapOptions::default() })
}
