//! MTL files: a tolerant pass over the text, then `tobj`.
//!
//! `tobj` panics on a one-value `Kd` and on keywords without values, and keeps no line numbers. The pass writes each
//! statement that this program uses in the one form that `tobj` reads, and notes where it stood.

use super::obj_text::Named;
use super::report::Report;
use super::text::{self, Lines, Warnings};
use std::collections::HashMap;
use std::io::Write;
use std::path::{Path, PathBuf};

/// A material as its file has it; absent statements are `None`.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct MtlMaterial {
    /// Name.
    pub name: String,
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
    /// Phong exponent.
    pub ns: Option<f32>,
    /// Opacity (`d`, or 1 − `Tr`).
    pub d: Option<f32>,
    /// Illumination model.
    pub illum: Option<u8>,
    /// Texture files, by [`Map`]; each with its line.
    pub maps: [Option<Named>; 3],
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
}

/// Statements that say nothing to this renderer, or that it does not use yet.
/// In lower case.
const UNUSED: &str = "ka km kt ni tf sharpness map_ka map_ks map_ns map_km map_ni map_tr map_aat map_refl map_bump bump \
                      disp map_disp decal map_decal refl norm map_norm map_opacity pr pm ps pc pcr aniso anisor map_pr \
                      map_pm map_ps map_pc map_pcr map_aniso map_anisor map_rma map_orm";

/// The materials of the MTL file `file`, in order; of two of one name the later counts.
pub(super) fn read(file: &Path, bytes: &[u8]) -> (Vec<MtlMaterial>, Report) {
    let mut pass = Pass {
        file,
        out: Vec::new(),
        materials: Vec::new(),
        warnings: Warnings::new(file),
        lines: HashMap::new(),
        has_d: false,
    };
    let mut lines = Lines::new(bytes);
    while let Some(line) = lines.next() {
        match line {
            Ok((number, line)) => pass.statement(line, number),
            Err(number) => pass.warn("line too long", number, "the line is longer than 1 MiB and is left out"),
        }
    }
    let Pass { out, mut materials, warnings, .. } = pass;
    let mut report = warnings.finish();
    match tobj::load_mtl_buf(&mut out.as_slice()) {
        Ok((parsed, _)) => materials.iter_mut().zip(parsed).for_each(|(m, p)| m.take_values(p)),
        Err(error) => report.error(file, None, format!("cannot be read: {error}")),
    }
    (materials, report)
}

impl MtlMaterial {
    fn take_values(&mut self, parsed: tobj::Material) {
        (self.kd, self.ks, self.ke) = (parsed.diffuse, parsed.specular, parsed.emissive);
        (self.ns, self.d, self.illum) = (parsed.shininess, parsed.dissolve, parsed.illumination_model);
    }
}

struct Pass<'a> {
    file: &'a Path,
    /// The text for `tobj`.
    out: Vec<u8>,
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

    fn statement(&mut self, line: &[u8], number: u32) {
        let (keyword, rest) = text::keyword(line);
        let keyword = text::decode(keyword);
        if keyword == "newmtl" {
            return self.new_material(rest, number);
        }
        if self.materials.is_empty() {
            return self.warn("statement before newmtl", number, "stands before the first newmtl and is left out");
        }
        match keyword.as_str() {
            "Kd" | "Ks" | "Ke" => self.colour(&keyword, rest, number),
            "Ns" => self.exponent(rest, number),
            "d" | "Tr" => self.opacity(&keyword, rest, number),
            "illum" => self.illumination(rest, number),
            _ => match keyword.to_ascii_lowercase().as_str() {
                "map_kd" => self.map(Map::Kd, rest, number),
                "map_ke" => self.map(Map::Ke, rest, number),
                "map_d" => self.map(Map::D, rest, number),
                lower if UNUSED.split_whitespace().any(|known| known == lower) => {}
                _ => {
                    self.warnings.add("unknown keyword", number, || {
                        format!("{} is not known: the line is left out", text::quote(keyword.as_bytes()))
                    });
                }
            },
        }
    }

    fn new_material(&mut self, rest: &[u8], line: u32) {
        if rest.is_empty() {
            self.warn("newmtl", line, "newmtl without a name: the material cannot be used");
        }
        self.has_d = false;
        let name = text::decode(rest);
        if let Some(first) = self.lines.insert(name.clone(), line) {
            self.warnings.add("material defined twice", line, || {
                format!("material {name} stands already at line {first}: the later one counts")
            });
        }
        let _ = writeln!(self.out, "newmtl {}", self.materials.len());
        self.materials.push(MtlMaterial { name, file: self.file.to_owned(), line, ..MtlMaterial::default() });
    }

    fn colour(&mut self, keyword: &str, rest: &[u8], line: u32) {
        let words: Vec<&[u8]> = text::words(rest).collect();
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
        let [r, g, b] = rgb.map(|c| c.max(0.0));
        let _ = writeln!(self.out, "{keyword} {r} {g} {b}");
    }

    fn exponent(&mut self, rest: &[u8], line: u32) {
        match text::words(rest).next().and_then(text::number) {
            Some(ns) => {
                if ns < 0.0 {
                    self.warn("negative Ns", line, "Ns is negative: 0 is used");
                }
                let _ = writeln!(self.out, "Ns {}", ns.max(0.0));
            }
            None => self.warn("Ns", line, "Ns needs one finite number: 0 is used"),
        }
    }

    fn opacity(&mut self, keyword: &str, rest: &[u8], line: u32) {
        let Some(value) = text::words(rest).find(|w| *w != b"-halo").and_then(text::number) else {
            return self.warn("opacity", line, &format!("{keyword} needs one finite number: opaque is used"));
        };
        if !(0.0..=1.0).contains(&value) {
            self.warn("opacity range", line, &format!("{keyword} is outside 0 to 1 and is clamped"));
        }
        let value = value.clamp(0.0, 1.0);
        if keyword == "d" {
            self.has_d = true;
            let _ = writeln!(self.out, "d {value}");
        } else if !self.has_d {
            let _ = writeln!(self.out, "d {}", 1.0 - value);
        }
    }

    fn illumination(&mut self, rest: &[u8], line: u32) {
        let word = text::words(rest).next().unwrap_or_default();
        match std::str::from_utf8(word).ok().and_then(|w| w.parse::<u8>().ok()) {
            Some(model @ 0..=10) => {
                let _ = writeln!(self.out, "illum {model}");
            }
            _ => self.warn("illum", line, "illum needs a whole number from 0 to 10: 2 is used"),
        }
    }

    fn map(&mut self, map: Map, rest: &[u8], line: u32) {
        let (name, ignored) = texture_name(rest);
        if name.is_empty() {
            return self.warn("texture without a file", line, "the texture names no file: the constant is used");
        }
        if !ignored.is_empty() {
            let message = format!("the texture option {} is not used", ignored.join(", "));
            self.warn("texture options", line, &message);
        }
        if let Some(material) = self.materials.last_mut() {
            material.maps[map as usize] = Some(Named { name, line });
        }
    }
}

/// Splits a texture statement into its file name and the options that would change the picture.
fn texture_name(rest: &[u8]) -> (String, Vec<String>) {
    let mut rest = rest.trim_ascii();
    let mut ignored = Vec::new();
    while rest.starts_with(b"-") {
        let (option, after) = text::keyword(rest);
        let Some((least, most)) = option_values(option) else { break };
        let (mut after, mut neutral) = (after, true);
        for k in 0..most {
            let (value, next) = text::keyword(after);
            // The file's name may stand where an optional value could.
            let number = text::number(value);
            if k >= least && (number.is_none() || next.is_empty()) {
                break;
            }
            neutral &= number == Some(if option == b"-s" { 1.0 } else { 0.0 });
            after = next;
        }
        if matches!(option, b"-s" | b"-o" | b"-t" | b"-mm" | b"-clamp") && !neutral && !after.is_empty() {
            ignored.push(text::decode(option));
        }
        rest = after;
    }
    let name = rest.strip_prefix(b"\"").and_then(|r| r.strip_suffix(b"\"")).unwrap_or(rest);
    (text::decode(name), ignored)
}

/// Least and most number of values of a texture option.
fn option_values(option: &[u8]) -> Option<(usize, usize)> {
    match option {
        b"-o" | b"-s" | b"-t" => Some((1, 3)),
        b"-mm" => Some((2, 2)),
        b"-blendu" | b"-blendv" | b"-cc" | b"-clamp" | b"-imfchan" | b"-texres" | b"-bm" | b"-boost" | b"-type"
        | b"-colorspace" => Some((1, 1)),
        _ => None,
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
    fn texture_options_are_skipped() {
        for (line, name, ignored) in [
            ("a b.png", "a b.png", 0),
            ("-texres 512 input.jpg", "input.jpg", 0),
            ("-o 0.1 diffuse.jpg", "diffuse.jpg", 1),
            ("-s 1 1 1 -o 0 0 x y.png", "x y.png", 0),
            ("-s 0.1 0.2 specular.jpg", "specular.jpg", 1),
            ("-clamp off -type sphere 12", "12", 1),
            ("-s 2 2 7", "7", 1),
            ("\"quoted name.png\"", "quoted name.png", 0),
            ("-odd.png", "-odd.png", 0),
        ] {
            let (found, options) = texture_name(line.as_bytes());
            assert_eq!((found.as_str(), options.len()), (name, ignored), "{line}");
        }
    }
}
