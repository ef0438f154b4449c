//! Which materials let light pass, as exporters mean it rather than as they write it.

use super::mtl::{Map, MtlMaterial};
use super::report::Report;

/// Why a material is glass or nothing at all; `None` where it is opaque.
///
/// `illum` 4, 6, 7 and 9 alone say nothing: Maya and Cinema 4D write them for plaster, with `Tf` 1, `Ni` 1 and `d` 1.
pub(super) fn of(m: &MtlMaterial) -> Option<String> {
    let is = |value: Option<f32>| value.is_some_and(|value| value != 1.0);
    if let Some(d) = m.d.filter(|&d| d < 1.0 && m.maps[Map::D as usize].is_none()) {
        return Some(format!("d {d} (transparent)"));
    }
    let model = m.illum.filter(|model| matches!(model, 4 | 6 | 7 | 9))?;
    let filters = m.tf.is_some_and(|tf| tf != [1.0; 3]);
    // A surface without a colour of its own.
    let clear = m.kd == Some([0.0; 3]) && m.diffuse_map().is_none();
    (is(m.ni) && (filters || clear)).then(|| format!("illum {model} (glass)"))
}

/// Whether the triangles of a material are left out: until there are refractions. Warns.
pub(super) fn is_see_through(m: &MtlMaterial, report: &mut Report) -> bool {
    let Some(why) = of(m) else { return false };
    let message =
        format!("material {}: {why} is not supported yet: its faces are not drawn and let light pass", m.name);
    report.stand_in(&m.file, Some(m.line), message);
    true
}

/// Turns the opacity of the materials of one MTL file over where 0 stands for opaque, as some exporters write it: where most
/// materials would be nothing at all, or nothing would be left of those that faces use. Warns once.
///
/// `has_faces` says which materials faces use.
pub(super) fn settle(materials: &mut [MtlMaterial], has_faces: &[bool], report: &mut Report) {
    let nothing = |m: &MtlMaterial| m.d == Some(0.0);
    let used: Vec<&MtlMaterial> = materials.iter().zip(has_faces).filter(|(_, used)| **used).map(|(m, _)| m).collect();
    let count = materials.iter().filter(|m| nothing(m)).count();
    let used_count = used.iter().filter(|m| nothing(m)).count();
    let most = 2 * count > materials.len() || 2 * used_count > used.len();
    if used_count == 0 || !(most || used.iter().all(|m| of(m).is_some())) {
        return;
    }
    if let Some(first) = materials.iter().find(|m| nothing(m)) {
        let message = format!(
            "d 0 or Tr 1 in {count} of {} materials: taken for opaque, since some exporters write it the other way round",
            materials.len()
        );
        report.warn(&first.file, Some(first.line), message);
    }
    for m in materials {
        // Both ends are opaque: such files have d 1 beside map_d.
        m.d = m.d.map(|d| if d > 0.0 && d < 1.0 { 1.0 - d } else { 1.0 });
    }
}

#[cfg(test)]
mod tests {
    use super::super::map_statement::MapStatement;
    use super::*;

    fn material(d: Option<f32>) -> MtlMaterial {
        MtlMaterial { name: "a".into(), kd: Some([0.5; 3]), d, ..MtlMaterial::default() }
    }

    #[test]
    fn masks_are_not_see_through() {
        let mut m = material(Some(0.5));
        assert!(of(&m).is_some());
        m.maps[Map::D as usize] = MapStatement::read(b"m.png", 3);
        assert_eq!(of(&m), None);
        assert_eq!(of(&material(Some(1.0))), None);
    }

    #[test]
    fn models_of_glass_need_more_to_be_glass() {
        let glass = |kd: f32, tf: f32, ni: Option<f32>, illum| {
            let (kd, tf) = (Some([kd; 3]), Some([tf; 3]));
            of(&MtlMaterial { kd, tf, ni, illum: Some(illum), ..material(Some(1.0)) }).is_some()
        };
        for illum in [4, 6, 7, 9] {
            assert!(!glass(0.5, 1.0, Some(1.0), illum) && !glass(0.5, 0.1, Some(1.0), illum));
            assert!(!glass(0.5, 1.0, Some(1.5), illum) && !glass(0.5, 0.1, None, illum));
            assert!(glass(0.5, 0.1, Some(1.5), illum), "it filters and refracts");
            assert!(glass(0.0, 1.0, Some(1.5), illum), "it refracts and has no colour");
        }
        assert!(!glass(0.0, 0.1, Some(1.5), 2), "illum 2 is opaque");
    }

    /// Opacities after [`settle`], and how many warnings there were.
    fn settled(d: &[Option<f32>], has_faces: &[bool]) -> (Vec<Option<f32>>, usize) {
        let mut materials: Vec<_> = d.iter().map(|&d| material(d)).collect();
        let mut report = Report::default();
        settle(&mut materials, has_faces, &mut report);
        (materials.iter().map(|m| m.d).collect(), report.faults.len())
    }

    #[test]
    fn most_of_a_file_cannot_be_nothing() {
        let (zero, one) = (Some(0.0), Some(1.0));
        assert_eq!(settled(&[zero, zero, one, None], &[true; 4]).1, 0, "half are not most");
        assert_eq!(settled(&[zero, zero, Some(0.25)], &[true; 3]), (vec![one, one, Some(0.75)], 1));
        assert_eq!(settled(&[zero, one, one, one], &[true, true, false, false]).1, 0);
        assert_eq!(settled(&[zero, zero, one, one, one], &[true, true, true, false, false]).1, 1, "of those in use");
        assert_eq!(settled(&[zero, one, one], &[true, false, false]), (vec![one; 3], 1), "nothing would be left");
        assert_eq!(settled(&[zero, Some(0.5), one], &[true, true, false]).1, 1, "nothing would be left, beside glass");
        assert_eq!(settled(&[zero, zero, one], &[false, false, true]).1, 0, "no face is concerned");
        assert_eq!(settled(&[Some(0.5)], &[true]), (vec![Some(0.5)], 0), "glass is no convention");
    }
}
