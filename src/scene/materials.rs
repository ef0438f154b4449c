//! From MTL statements to what the renderer reflects and emits.

use super::map_options::MapOptions;
use super::material::{Material, TextureMap};
use super::mtl::{Map, MtlMaterial};
use super::obj_text::Named;
use super::report::Report;
use super::texel_source::Role;
use super::textures::Request;
use glam::Vec3;

/// Reflectance of a material that names none.
const DEFAULT_KD: f32 = 0.8;
/// Phong exponents above this are mirrors, which show the highlight of direct light only.
const MIRROR_NS: f32 = 1000.0;
/// What is said of them.
const MIRROR: &str = "mirrors are not supported yet: it shows the highlight of direct light only";

/// Whether the triangles of a material are left out: glass, until there are refractions. Warns.
pub(super) fn is_see_through(m: &MtlMaterial, report: &mut Report) -> bool {
    let why = match (m.illum, m.d) {
        (Some(model @ (4 | 6 | 7 | 9)), _) => format!("illum {model} (glass)"),
        (_, Some(d)) if d < 1.0 && m.maps[Map::D as usize].is_none() => format!("d {d} (transparent)"),
        _ => return false,
    };
    let message =
        format!("material {}: {why} is not supported yet: its faces are not drawn and let light pass", m.name);
    report.stand_in(&m.file, Some(m.line), message);
    true
}

/// Whether a material leaves the colour to others.
pub(super) fn has_no_colour(m: &MtlMaterial) -> bool {
    m.kd.is_none() && m.maps[Map::Kd as usize].is_none()
}

/// The textures that a material asks for, with the map that each is for. A colour map brings its own mask where the material
/// names none.
pub(super) fn requests(m: &MtlMaterial) -> impl Iterator<Item = (Map, Request)> {
    let emits = m.ke.is_none_or(|ke| ke.iter().any(|&c| c > 0.0));
    let roles = [(Map::Kd, Map::Kd, Role::Colour), (Map::Ke, Map::Ke, Role::Emission), (Map::D, Map::D, Role::Mask)];
    let cut_out = m.maps[Map::D as usize].is_none().then_some((Map::Kd, Map::D, Role::CutOut));
    roles.into_iter().chain(cut_out).filter(move |&(from, ..)| from != Map::Ke || emits).filter_map(
        |(from, to, role)| {
            let Named { name, line } = m.maps[from as usize].clone()?;
            Some((to, Request { name, file: m.file.clone(), line, role, options: MapOptions::default() }))
        },
    )
}

/// The material with its decoded `textures`, by [`Map`]; vertex colours are the reflectance of a `painted` one. Warns of what had
/// to be changed.
pub(super) fn build(
    m: &MtlMaterial,
    textures: [Option<TextureMap>; 3],
    painted: bool,
    report: &mut Report,
) -> Material {
    let mut warn = |line: u32, what: String| report.warn(&m.file, Some(line), format!("material {}: {what}", m.name));
    let [map_kd, map_ke, map_d] = textures;
    let mut kd = m.kd.map_or(Vec3::splat(if map_kd.is_some() || painted { 1.0 } else { DEFAULT_KD }), Vec3::from);
    if map_kd.is_some() && kd == Vec3::ZERO {
        warn(m.line, "Kd 0 would blacken its map_Kd: 1 is used".into());
        kd = Vec3::ONE;
    }
    let ke = m.ke.map_or(Vec3::splat(if map_ke.is_some() { 1.0 } else { 0.0 }), Vec3::from);
    let shininess = m.ns.unwrap_or(0.0);
    let mut ks = m.ks.map_or(Vec3::ZERO, Vec3::from);
    if matches!(m.illum, Some(0 | 1)) && ks != Vec3::ZERO {
        warn(m.line, "illum 0 and 1 have no highlight: Ks is not used".into());
        ks = Vec3::ZERO;
    }
    let sum = kd + ks;
    if sum.max_element() > 1.0 {
        warn(m.line, format!("Kd + Ks is {}, more than the light that arrives: scaled down to 1", sum.max_element()));
        (kd, ks) = bound(kd, ks);
    }
    let mirror = ks != Vec3::ZERO && (matches!(m.illum, Some(3 | 5)) || shininess > MIRROR_NS);
    if mirror {
        let message = format!("material {}: {MIRROR}", m.name);
        report.stand_in(&m.file, Some(m.line), message);
    }
    Material { name: m.name.clone(), kd, ks, shininess, ke, map_kd, map_ke, map_d, mirror }
}

/// Scales both reflectances where they reflect more than arrives.
fn bound(kd: Vec3, ks: Vec3) -> (Vec3, Vec3) {
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
        MtlMaterial { name: "a".into(), kd: Some(kd), ks: Some(ks), illum: Some(2), ..MtlMaterial::default() }
    }

    #[test]
    fn no_channel_gains_energy() {
        let mut report = Report::default();
        let m = build(&glossy([0.9, 0.3, 1.0], [0.7, 0.3, f32::MAX]), [None; 3], false, &mut report);
        assert!((m.kd + m.ks).max_element() <= 1.0);
        assert!((m.kd.x / m.ks.x - 9.0 / 7.0).abs() < 1e-5);
        assert_eq!((m.kd.y, m.ks.y), (0.3, 0.3), "a sound channel is kept");
        assert_eq!(report.faults.len(), 1);
    }

    #[test]
    fn black_factor_of_a_map_is_one() {
        let mut report = Report::default();
        let m = build(&glossy([0.0; 3], [0.0; 3]), [Some(TextureId(0).into()), None, None], false, &mut report);
        assert_eq!(m.kd, Vec3::ONE);
        assert_eq!(build(&glossy([0.0; 3], [0.0; 3]), [None; 3], false, &mut report).kd, Vec3::ZERO);
    }

    #[test]
    fn glass_is_left_out_and_masks_are_not() {
        let mut report = Report::default();
        let mut m = glossy([0.5; 3], [0.0; 3]);
        assert!(!is_see_through(&m, &mut report));
        m.d = Some(0.5);
        assert!(is_see_through(&m, &mut report));
        m.maps[Map::D as usize] = Some(Named { name: "m.png".into(), line: 3 });
        assert!(!is_see_through(&m, &mut report));
        m.illum = Some(7);
        assert!(is_see_through(&m, &mut report));
        assert_eq!(report.faults.len(), 2);
    }
}
