//! From MTL statements to what the renderer reflects and emits.

use super::map_statement::MapStatement;
use super::material::{Material, MetallicRoughness, Model, NormalMap, Phong, TextureMap};
use super::mtl::{MAPS, Map, MtlMaterial};
use super::report::Report;
use super::texel_source::{Recipe, Role};
use super::textures::{ImageAt, Placing, Request};
use glam::Vec3;

/// Reflectance of a material that names none.
const DEFAULT_KD: f32 = 0.8;
/// Perceptual roughness of a metal that names none.
const DEFAULT_ROUGHNESS: f32 = 0.5;
/// Phong exponents above this are mirrors, which show the highlight of direct light only.
const MIRROR_NS: f32 = 1000.0;
/// What is said of them.
const MIRROR: &str = "mirrors are not supported yet: it shows the highlight of direct light only";

/// Whether a material leaves the colour to others.
pub(super) fn has_no_colour(m: &MtlMaterial) -> bool {
    m.kd.is_none() && m.diffuse_map().is_none()
}

/// The textures that a material asks for, with the map that each is for. A colour map brings its own mask where the material
/// names none.
pub(super) fn requests(m: &MtlMaterial) -> impl Iterator<Item = (Map, Request<'static>)> {
    let mask = if m.maps[Map::D as usize].is_some() { (Map::D, Role::Mask) } else { (Map::Kd, Role::CutOut) };
    let data = |map: Map| (map, (map, Role::Data));
    let [roughness, metallic, normal] = [Map::Roughness, Map::Metallic, Map::Normal].map(data);
    let colours = [(Map::Kd, (Map::Kd, Role::Colour)), (Map::Ke, (Map::Ke, Role::Emission))];
    let roles = colours.into_iter().chain([(Map::D, mask), roughness, metallic, normal]);
    roles.filter_map(|(map, (from, role))| {
        let MapStatement { names, line, options, .. } = statement(m, from)?.clone();
        let (recipe, placing) = (Recipe::new(role, &options), Placing::from(&options));
        Some((map, Request { image: ImageAt::Named(names), file: m.file.clone(), line: Some(line), recipe, placing }))
    })
}

/// The statement of the texture that is used as `map`.
fn statement(m: &MtlMaterial, map: Map) -> Option<&MapStatement> {
    if map == Map::Kd { m.diffuse_map() } else { m.maps[map as usize].as_ref() }
}

/// The material with its decoded `textures`, by [`Map`]; vertex colours are the reflectance of a `painted` one. Warns of what had
/// to be changed.
pub(super) fn build(
    m: &MtlMaterial,
    textures: [Option<TextureMap>; MAPS],
    painted: bool,
    report: &mut Report,
) -> Material {
    let mut about = About { m, report };
    let [map_kd, map_ke, map_d, map_roughness, map_metallic, map_normal, _] = textures;
    let kd = if painted { Vec3::ONE } else { about.diffuse(map_kd.is_some()) };
    let ke = about.emission(map_ke.is_some());
    let map_normal = map_normal.map(|map| NormalMap { map, scale: 1.0 });
    let whole =
        |model, kd| Material { name: m.name.clone(), kd, model, ke, unlit: false, map_kd, map_ke, map_d, map_normal };
    if m.is_metallic_roughness() {
        about.unsupported();
        let model = about.metallic_roughness(map_roughness, map_metallic);
        return whole(Model::MetallicRoughness(model), about.base_colour(kd, map_kd.is_some()));
    }
    let (ks, shininess) = about.highlight();
    let (kd, ks) = about.bounded(kd, ks);
    let mirror = ks != Vec3::ZERO && (is_mirror_model(m) || shininess > MIRROR_NS);
    if mirror {
        about.report.stand_in(&m.file, Some(m.line), format!("material {}: {MIRROR}", m.name));
    }
    about.unsupported();
    let model = Model::Phong(Phong { ks, shininess, mirror });
    whole(model, kd)
}

const fn is_mirror_model(m: &MtlMaterial) -> bool {
    matches!(m.illum, Some(3 | 5))
}

/// A material in the making, and what is to be said about it.
struct About<'a> {
    m: &'a MtlMaterial,
    report: &'a mut Report,
}

impl About<'_> {
    fn warn(&mut self, what: &str) {
        self.report.warn(&self.m.file, Some(self.m.line), format!("material {}: {what}", self.m.name));
    }

    /// k_d, a factor where there is a map.
    fn diffuse(&mut self, has_map: bool) -> Vec3 {
        let names_map = self.m.diffuse_map().is_some();
        if names_map && self.m.maps[Map::Kd as usize].is_none() {
            self.warn("map_Ka without map_Kd is used as map_Kd");
        }
        match self.m.kd.map(Vec3::from) {
            None => Vec3::splat(if has_map { 1.0 } else { DEFAULT_KD }),
            Some(Vec3::ZERO) if has_map => {
                self.warn("Kd 0 would blacken its map_Kd: 1 is used");
                Vec3::ONE
            }
            Some(Vec3::ZERO) if names_map => {
                self.warn("Kd is 0 and its map_Kd cannot be used: grey is used");
                Vec3::splat(DEFAULT_KD)
            }
            Some(kd) => kd,
        }
    }

    /// L_e, a factor where there is a map.
    fn emission(&mut self, has_map: bool) -> Vec3 {
        match self.m.ke.map(Vec3::from) {
            None => Vec3::splat(if has_map { 1.0 } else { 0.0 }),
            Some(Vec3::ZERO) if has_map => {
                self.warn("Ke 0 would put out its map_Ke: 1 is used");
                Vec3::ONE
            }
            Some(ke) => ke,
        }
    }

    /// k_s and the exponent.
    fn highlight(&mut self) -> (Vec3, f32) {
        let (ks, shininess) = (self.m.ks.map_or(Vec3::ZERO, Vec3::from), self.m.ns.unwrap_or(0.0));
        if ks == Vec3::ZERO {
            return (ks, shininess);
        }
        if matches!(self.m.illum, Some(0 | 1)) {
            self.warn("illum 0 and 1 have no highlight: Ks is not used");
            return (Vec3::ZERO, shininess);
        }
        if shininess > 0.0 {
            return (ks, shininess);
        }
        if is_mirror_model(self.m) {
            return (ks, MIRROR_NS);
        }
        self.warn("Ks without Ns, or with Ns 0, would be a veil and no highlight: Ks is not used");
        (Vec3::ZERO, shininess)
    }

    /// Metalness and roughness, factors of 1 where there is a map.
    fn metallic_roughness(
        &self,
        map_roughness: Option<TextureMap>,
        map_metallic: Option<TextureMap>,
    ) -> MetallicRoughness {
        let factor = |value: Option<f32>, has_map: bool, default: f32| match value {
            Some(value) if !has_map || value > 0.0 => value,
            _ if has_map => 1.0,
            _ => default,
        };
        MetallicRoughness {
            metallic: factor(self.m.metallic, map_metallic.is_some(), 0.0),
            roughness: factor(self.m.roughness, map_roughness.is_some(), DEFAULT_ROUGHNESS),
            map_metallic,
            map_roughness,
        }
    }

    /// At most 1. A black metal is one whose colour stands in `Ks`.
    fn base_colour(&mut self, kd: Vec3, has_map: bool) -> Vec3 {
        let is_metal = self.m.metallic.is_some_and(|metallic| metallic > 0.5);
        let colour = match self.m.ks.map(Vec3::from) {
            Some(ks) if is_metal && kd == Vec3::ZERO && !has_map => ks,
            _ => kd,
        };
        if colour.max_element() > 1.0 {
            self.warn("Kd of more than 1 would reflect more than the light that arrives: 1 is used");
        }
        colour.min(Vec3::ONE)
    }

    /// Both reflectances, scaled down where they reflect more than arrives.
    fn bounded(&mut self, kd: Vec3, ks: Vec3) -> (Vec3, Vec3) {
        let most = (kd + ks).max_element();
        if most <= 1.0 {
            return (kd, ks);
        }
        self.warn(&format!("Kd + Ks is {most}, more than the light that arrives: scaled down to 1"));
        bound(kd, ks)
    }

    fn unsupported(&mut self) {
        let missed: Vec<String> =
            self.m.unsupported.iter().map(|(what, keyword)| format!("{what} ({keyword})")).collect();
        if !missed.is_empty() {
            self.warn(&format!("not supported yet and not used: {}", missed.join(", ")));
        }
        let mut options: Vec<&str> = Vec::new();
        for map in [Map::Kd, Map::Ke, Map::D, Map::Roughness, Map::Metallic, Map::Normal] {
            let Some(statement) = statement(self.m, map) else { continue };
            options.extend(&statement.unused);
            // A channel makes a mask, not a colour.
            options.extend((map != Map::D && statement.options.channel.is_some()).then_some("-imfchan"));
        }
        options.sort_unstable();
        options.dedup();
        if !options.is_empty() {
            self.warn(&format!("texture options that are not used: {}", options.join(", ")));
        }
    }
}

/// Scales both reflectances where they reflect more than arrives.
pub(super) fn bound(kd: Vec3, ks: Vec3) -> (Vec3, Vec3) {
    let scale = (kd + ks).max(Vec3::ONE).recip();
    // Down by a rounding error, so that the bound holds in f32 whatever the order of the sum.
    let scale = Vec3::select(scale.cmplt(Vec3::ONE), scale * (1.0 - f32::EPSILON), scale);
    (kd * scale, ks * scale)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::texture::TextureId;

    fn glossy(kd: [f32; 3], ks: [f32; 3]) -> MtlMaterial {
        MtlMaterial {
            name: "a".into(),
            kd: Some(kd),
            ks: Some(ks),
            ns: Some(8.0),
            illum: Some(2),
            ..MtlMaterial::default()
        }
    }

    #[test]
    fn no_channel_gains_energy() {
        let mut report = Report::default();
        let m = build(&glossy([0.9, 0.3, 1.0], [0.7, 0.3, f32::MAX]), [None; MAPS], false, &mut report);
        let ks = m.phong().ks;
        assert!((m.kd + ks).max_element() <= 1.0);
        assert!((m.kd.x / ks.x - 9.0 / 7.0).abs() < 1e-5);
        assert_eq!((m.kd.y, ks.y), (0.3, 0.3), "a sound channel is kept");
        assert_eq!(report.faults.len(), 1);
    }

    #[test]
    fn black_factor_of_a_map_is_one() {
        let mut report = Report::default();
        let m = build(
            &glossy([0.0; 3], [0.0; 3]),
            std::array::from_fn(|map| (map == 0).then_some(TextureId(0).into())),
            false,
            &mut report,
        );
        assert_eq!(m.kd, Vec3::ONE);
        assert_eq!(build(&glossy([0.0; 3], [0.0; 3]), [None; MAPS], false, &mut report).kd, Vec3::ZERO);
    }

    #[test]
    fn a_missing_map_blackens_nothing() {
        let mut report = Report::default();
        let mut m = glossy([0.0; 3], [0.0; 3]);
        m.maps[Map::Kd as usize] = MapStatement::read(b"gone.png", 3);
        assert_eq!(build(&m, [None; MAPS], false, &mut report).kd, Vec3::splat(DEFAULT_KD));
        m.kd = Some([0.0, 0.0, 0.1]);
        assert_eq!(build(&m, [None; MAPS], false, &mut report).kd, Vec3::new(0.0, 0.0, 0.1));
        assert_eq!(report.faults.len(), 1);
    }

    #[test]
    fn ks_without_an_exponent_is_no_highlight() {
        let mut report = Report::default();
        let red = MtlMaterial { ns: None, ..glossy([0.8, 0.1, 0.1], [1.0; 3]) };
        for (ns, illum) in [(None, None), (Some(0.0), Some(2)), (None, Some(7))] {
            let m = build(&MtlMaterial { ns, illum, ..red.clone() }, [None; MAPS], false, &mut report);
            assert_eq!((m.kd, m.phong().ks), (Vec3::new(0.8, 0.1, 0.1), Vec3::ZERO), "{ns:?} {illum:?}");
        }
        assert_eq!(report.faults.len(), 3);
        let mirror = build(&MtlMaterial { illum: Some(3), ..red }, [None; MAPS], false, &mut report);
        let Phong { ks, shininess, mirror } = mirror.phong();
        assert!(mirror && ks.x > 0.5 && shininess == MIRROR_NS, "mirrors need none");
    }

    #[test]
    fn what_is_not_used_is_one_warning() {
        let mut report = Report::default();
        let unsupported = vec![("bump map", "bump".to_owned()), ("sheen", "Ps".to_owned())];
        let m = MtlMaterial { unsupported, ns: None, ..glossy([0.5; 3], [0.0; 3]) };
        build(&m, [None; MAPS], false, &mut report);
        let said: Vec<_> = report.faults.iter().map(|f| f.message.as_str()).collect();
        assert_eq!(said, ["material a: not supported yet and not used: bump map (bump), sheen (Ps)"]);
    }

    /// The colour of a metal stands in `Kd`, or in `Ks` where that is black.
    #[test]
    fn metalness_and_roughness_are_a_model_of_their_own() {
        let mut report = Report::default();
        let m = MtlMaterial { roughness: Some(0.3), metallic: Some(1.0), ..glossy([0.5, 0.4, 0.3], [0.9; 3]) };
        let built = build(&m, [None; MAPS], false, &mut report);
        let expected = MetallicRoughness { metallic: 1.0, roughness: 0.3, map_metallic: None, map_roughness: None };
        assert_eq!((built.kd, built.model), (Vec3::new(0.5, 0.4, 0.3), Model::MetallicRoughness(expected)));
        let black = MtlMaterial { kd: Some([0.0; 3]), ..m.clone() };
        assert_eq!(build(&black, [None; MAPS], false, &mut report).kd, Vec3::splat(0.9));
        let zero = MtlMaterial { roughness: Some(0.0), metallic: Some(0.0), ..m };
        assert!(!zero.is_metallic_roughness(), "what exporters write that fill in all keywords");
        assert!(report.faults.is_empty());
    }
}
