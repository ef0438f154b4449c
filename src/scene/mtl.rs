//! MTL files: a tolerant reader of every statement that this program knows, with their lines.
//!
//! `tobj` panics on a one-value `Kd` and on keywords without values, and keeps no line numbers.

use super::commas;
use super::map_statement::MapStatement;
use super::report::Report;
use super::text::{self, Lines, Warnings};
use std::collections::HashMap;
use std::path::{Path, PathBuf};

/// A material as its file has it; absent statements are `None`.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct MtlMaterial {
    /// Name, without the comment that may follow it.
    pub name: String,
    /// What follows `newmtl`.
    pub whole_name: String,
    /// The MTL file.
    pub file: PathBuf,
    /// Line of its `newmtl`.
    pub line: u32,
    /// Diffuse reflectance.
    pub kd: Option<[f32; 3]>,
    /// Specular reflectance.
    pub ks: Option<[f32; 3]>,
    /// Emitted radiance.
    pub ke: Option<[f32; 3]>,
    /// Transmission filter.
    pub tf: Option<[f32; 3]>,
    /// Phong exponent.
    pub ns: Option<f32>,
    /// Index of refraction.
    pub ni: Option<f32>,
    /// Opacity (`d`, or 1 − `Tr`).
    pub d: Option<f32>,
    /// Perceptual roughness (`Pr`), at most 1.
    pub roughness: Option<f32>,
    /// Metalness (`Pm`), at most 1.
    pub metallic: Option<f32>,
    /// Illumination model.
    pub illum: Option<u8>,
    /// Textures, by [`Map`].
    pub maps: [Option<MapStatement>; MAPS],
    /// What is not supported of the material: what it is, and the keyword.
    pub unsupported: Vec<(&'static str, String)>,
}

/// The textures that are used.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Map {
    /// `map_Kd`
    Kd = 0,
    /// `map_Ke`
    Ke = 1,
    /// `map_d`
    D = 2,
    /// `map_Pr`
    Roughness = 3,
    /// `map_Pm`
    Metallic = 4,
    /// `norm`
    Normal = 5,
    /// `map_Ka`, in place of a missing `map_Kd`
    Ka = 6,
}

/// Number of textures.
pub(super) const MAPS: usize = 7;

impl MtlMaterial {
    /// The statement of its diffuse texture.
    pub(super) fn diffuse_map(&self) -> Option<&MapStatement> {
        self.maps[Map::Kd as usize].as_ref().or(self.maps[Map::Ka as usize].as_ref())
    }

    /// Whether it is described by metalness and roughness. Values of 0 alone are what exporters write that fill in all keywords.
    pub(super) fn is_metallic_roughness(&self) -> bool {
        let is_given = |value: Option<f32>| value.is_some_and(|value| value > 0.0);
        let has = |map: Map| self.maps[map as usize].is_some();
        is_given(self.roughness) || is_given(self.metallic) || has(Map::Roughness) || has(Map::Metallic)
    }

    /// Whether the other material says the same, wherever.
    pub(super) fn is_alike(&self, other: &Self) -> bool {
        let place =
            |m: &Self| Self { file: PathBuf::new(), line: 0, maps: m.maps.clone().map(at_no_line), ..m.clone() };
        place(self) == place(other)
    }
}

fn at_no_line(map: Option<MapStatement>) -> Option<MapStatement> {
    map.map(|map| MapStatement { line: 0, ..map })
}

/// Statements that say nothing to this renderer, in lower case: light that comes from everywhere (`Ka`), how others filter, and values
/// of little weight.
const NO_DIFFERENCE: &str = "ka km kt sharpness map_aat pcr anisor";

/// Statements that are not supported, in lower case, and what they are. A value of 0 asks for nothing.
const UNSUPPORTED: [(&str, &str); 23] = [
    ("map_bump", "bump map"),
    ("bump", "bump map"),
    ("disp", "displacement map"),
    ("map_disp", "displacement map"),
    ("map_ks", "specular map"),
    ("map_ns", "shininess map"),
    ("map_ni", "refraction map"),
    ("map_tr", "transparency map"),
    ("map_tf", "transmission map"),
    ("map_refl", "reflection map"),
    ("refl", "reflection map"),
    ("map_decal", "decal"),
    ("decal", "decal"),
    ("ps", "sheen"),
    ("pc", "clearcoat"),
    ("aniso", "anisotropy"),
    ("map_ps", "sheen map"),
    ("map_pc", "clearcoat map"),
    ("map_pcr", "clearcoat roughness map"),
    ("map_aniso", "anisotropy map"),
    ("map_anisor", "anisotropy map"),
    ("map_rma", "roughness and metalness map"),
    ("map_orm", "roughness and metalness map"),
];

/// The materials of the MTL file `file`, in order; of two of one name the later counts.
pub(super) fn read(file: &Path, bytes: &[u8]) -> (Vec<MtlMaterial>, Report) {
    let mut pass =
        Pass { file, materials: Vec::new(), warnings: Warnings::new(file), lines: HashMap::new(), has_d: false };
    let mut lines = Lines::new(bytes);
    while let Some(line) = lines.next() {
        match line {
            Ok((number, line)) => pass.statement(line, number),
            Err(number) => pass.warn("line too long", number, text::TOO_LONG),
        }
    }
    (pass.materials, pass.warnings.finish())
}

struct Pass<'a> {
    file: &'a Path,
    materials: Vec<MtlMaterial>,
    warnings: Warnings<'a>,
    /// Line of each name's `newmtl`.
    lines: HashMap<String, u32>,
    /// Whether the current material's opacity came from `d`, which wins over `Tr`.
    has_d: bool,
}

impl Pass<'_> {
    fn warn(&mut self, kind: &'static str, line: u32, message: &str) {
        self.warnings.add(kind, line, || message.to_owned());
    }

    /// Exporters differ in the case of keywords.
    fn statement(&mut self, line: &[u8], number: u32) {
        let (word, rest) = text::keyword(line);
        let keyword = text::decode(word).to_ascii_lowercase();
        if keyword == "newmtl" {
            return self.new_material(rest, number);
        }
        let Some(index) = self.materials.len().checked_sub(1) else {
            return self.warn("statement before newmtl", number, "stands before the first newmtl and is left out");
        };
        match keyword.as_str() {
            "kd" => self.colour("Kd", rest, number, |m| &mut m.kd),
            "ks" => self.colour("Ks", rest, number, |m| &mut m.ks),
            "ke" => self.colour("Ke", rest, number, |m| &mut m.ke),
            "tf" => self.colour("Tf", rest, number, |m| &mut m.tf),
            "ns" => self.exponent(rest, number),
            "ni" => self.materials[index].ni = text::words(rest).next().and_then(text::number),
            "d" => self.opacity("d", rest, number),
            "tr" => self.opacity("Tr", rest, number),
            "pr" => self.share("Pr", rest, number, |m| &mut m.roughness),
            "pm" => self.share("Pm", rest, number, |m| &mut m.metallic),
            "illum" => self.illumination(rest, number),
            "map_kd" => self.map(Map::Kd, rest, number),
            "map_ke" => self.map(Map::Ke, rest, number),
            "map_d" | "map_opacity" => self.map(Map::D, rest, number),
            "map_pr" => self.map(Map::Roughness, rest, number),
            "map_pm" => self.map(Map::Metallic, rest, number),
            "norm" | "map_norm" => self.map(Map::Normal, rest, number),
            "map_ka" => self.map(Map::Ka, rest, number),
            _ => self.not_used(word, &keyword, rest, number),
        }
    }

    fn new_material(&mut self, rest: &[u8], line: u32) {
        if rest.is_empty() {
            self.warn("newmtl", line, "newmtl without a name: the material cannot be used");
        }
        self.has_d = false;
        let whole_name = text::decode(rest);
        let name = text::uncommented(&whole_name).unwrap_or(&whole_name).to_owned();
        if let Some(first) = self.lines.insert(whole_name.clone(), line) {
            self.warnings.add("material defined twice", line, || {
                format!("material {name} stands already at line {first}: the later one counts")
            });
        }
        let file = self.file.to_owned();
        self.materials.push(MtlMaterial { name, whole_name, file, line, ..MtlMaterial::default() });
    }

    fn colour(
        &mut self,
        keyword: &str,
        rest: &[u8],
        line: u32,
        field: impl FnOnce(&mut MtlMaterial) -> &mut Option<[f32; 3]>,
    ) {
        let rest = commas::without(rest, line, &mut self.warnings);
        let words: Vec<&[u8]> = text::words(&rest).collect();
        if let Some(&kind @ (b"spectral" | b"xyz")) = words.first() {
            let message = format!("{keyword} {} is not supported: give RGB values", text::decode(kind));
            return self.warn("colour space", line, &message);
        }
        let values: Option<Vec<f32>> = words.iter().map(|w| text::number(w)).collect();
        let rgb = match values.as_deref() {
            Some(&[grey]) => [grey; 3],
            Some(&[r, g, b, ..]) => [r, g, b],
            _ => {
                let message = format!("{keyword} needs one or three finite numbers: the default is used");
                return self.warn("colour", line, &message);
            }
        };
        if rgb.iter().any(|&c| c < 0.0) {
            self.warn("negative colour", line, &format!("{keyword} is negative: 0 is used"));
        }
        if let Some(material) = self.materials.last_mut() {
            *field(material) = Some(rgb.map(|c| c.max(0.0)));
        }
    }

    /// The one number of a statement.
    fn number(&mut self, rest: &[u8], line: u32) -> Option<f32> {
        let rest = commas::without(rest, line, &mut self.warnings);
        text::words(&rest).find(|word| *word != b"-halo").and_then(text::number)
    }

    fn exponent(&mut self, rest: &[u8], line: u32) {
        let Some(ns) = self.number(rest, line) else {
            return self.warn("Ns", line, "Ns needs one finite number: 0 is used");
        };
        if ns < 0.0 {
            self.warn("negative Ns", line, "Ns is negative: 0 is used");
        }
        if let Some(material) = self.materials.last_mut() {
            material.ns = Some(ns.max(0.0));
        }
    }

    /// A number from 0 to 1.
    fn share(
        &mut self,
        keyword: &str,
        rest: &[u8],
        line: u32,
        field: impl FnOnce(&mut MtlMaterial) -> &mut Option<f32>,
    ) {
        let Some(value) = self.number(rest, line) else {
            return self.warn("share", line, &format!("{keyword} needs one finite number: it is left out"));
        };
        if !(0.0..=1.0).contains(&value) {
            self.warn("share", line, &format!("{keyword} is outside 0 to 1 and is clamped"));
        }
        if let Some(material) = self.materials.last_mut() {
            *field(material) = Some(value.clamp(0.0, 1.0));
        }
    }

    fn opacity(&mut self, keyword: &str, rest: &[u8], line: u32) {
        let Some(value) = self.number(rest, line) else {
            return self.warn("opacity", line, &format!("{keyword} needs one finite number: opaque is used"));
        };
        if !(0.0..=1.0).contains(&value) {
            self.warn("opacity range", line, &format!("{keyword} is outside 0 to 1 and is clamped"));
        }
        let value = value.clamp(0.0, 1.0);
        let is_d = keyword == "d";
        if let Some(material) = self.materials.last_mut().filter(|_| is_d || !self.has_d) {
            material.d = Some(if is_d { value } else { 1.0 - value });
            self.has_d = is_d;
        }
    }

    fn illumination(&mut self, rest: &[u8], line: u32) {
        let word = text::words(rest).next().unwrap_or_default();
        let model = std::str::from_utf8(word).ok().and_then(|w| w.parse::<u8>().ok()).filter(|model| *model <= 10);
        match (model, self.materials.last_mut()) {
            (Some(model), Some(material)) => material.illum = Some(model),
            _ => self.warn("illum", line, "illum needs a whole number from 0 to 10: 2 is used"),
        }
    }

    fn map(&mut self, map: Map, rest: &[u8], line: u32) {
        match (MapStatement::read(rest, line), self.materials.last_mut()) {
            (Some(statement), Some(material)) => material.maps[map as usize] = Some(statement),
            _ => self.warn("texture without a file", line, "the texture names no file: the constant is used"),
        }
    }

    fn not_used(&mut self, word: &[u8], keyword: &str, rest: &[u8], line: u32) {
        if let Some(&(_, what)) = UNSUPPORTED.iter().find(|(known, _)| *known == keyword) {
            let asks_for_nothing = text::words(rest).all(|word| text::number(word) == Some(0.0));
            if let Some(material) = self.materials.last_mut().filter(|_| !asks_for_nothing) {
                let is_new = material.unsupported.iter().all(|(known, _)| *known != what);
                material.unsupported.extend(is_new.then(|| (what, text::decode(word))));
            }
        } else if !NO_DIFFERENCE.split(' ').any(|known| known == keyword) {
            self.warnings
                .add("unknown keyword", line, || format!("{} is not known: the line is left out", text::quote(word)));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn one(body: &str) -> (MtlMaterial, Report) {
        let (mut materials, report) = read(Path::new("a.mtl"), format!("newmtl a\n{body}\n").as_bytes());
        assert_eq!(materials.len(), 1);
        (materials.remove(0), report)
    }

    #[test]
    fn one_value_is_grey() {
        let (m, report) = one("Kd 0.7\n\tKe 1 2 3 # white");
        assert_eq!((m.kd, m.ke), (Some([0.7; 3]), Some([1.0, 2.0, 3.0])));
        assert!(report.faults.is_empty(), "{report:?}");
    }

    #[test]
    fn faults_have_lines_and_defaults() {
        let (m, report) = one("Kd\nKd 1 2\nKs spectral a.rfl 1\nNs\nd x\nillum\nillum 99\nmap_Kd\nNs -3\nKd 0.1 nan 0");
        let lines: Vec<_> = report.faults.iter().filter_map(|f| f.place.line).collect();
        assert_eq!(lines, [2, 3, 4, 5, 6, 7, 8, 9, 10, 11], "{report:?}");
        assert_eq!((m.kd, m.ks, m.ns, m.d, m.illum), (None, None, Some(0.0), None, None));
    }

    #[test]
    fn d_wins_over_tr() {
        assert_eq!(one("d 0.75\nTr 0.5").0.d, Some(0.75));
        assert_eq!(one("Tr 0.5\nd 0.75").0.d, Some(0.75));
        assert_eq!(one("Tr 0.25").0.d, Some(0.75));
    }

    #[test]
    fn keywords_of_any_case_are_read() {
        let (m, report) = one("kd 0.1 0.2 0.3\nNS 5\nTF 0.5\nni 1.5\nMap_Opacity a.png");
        assert_eq!((m.kd, m.ns, m.tf, m.ni), (Some([0.1, 0.2, 0.3]), Some(5.0), Some([0.5; 3]), Some(1.5)));
        assert_eq!(m.maps[Map::D as usize].as_ref().map(|map| map.names.as_slice()), Some(&["a.png".to_owned()][..]));
        assert!(report.faults.is_empty(), "{report:?}");
    }

    #[test]
    fn comments_are_no_part_of_names() {
        let names = |line: &str| {
            let (materials, _) = read(Path::new("a.mtl"), line.as_bytes());
            (materials[0].name.clone(), materials[0].whole_name.clone())
        };
        assert_eq!(names("newmtl red paint # of the door"), ("red paint".into(), "red paint # of the door".into()));
        assert_eq!(names("newmtl Material #25"), ("Material #25".into(), "Material #25".into()));
    }

    #[test]
    fn what_is_not_supported_is_listed_once() {
        let (m, report) = one("Ka 1\nbump a.png\nmap_Bump b.png\nPm 0\nPr 0.5\nPs 0 0 0\nmap_Ks c.png\nsharpness 60");
        let listed: Vec<_> = m.unsupported.iter().map(|(what, keyword)| format!("{what} ({keyword})")).collect();
        assert!(m.is_metallic_roughness());
        assert_eq!(listed, ["bump map (bump)", "specular map (map_Ks)"]);
        assert!(report.faults.is_empty(), "{report:?}");
    }
}
