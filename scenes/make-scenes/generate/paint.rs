//! Materials of the library and the MTL file.

use std::fmt::Write;

/// A material: what the MTL says, and how many metres one repeat of its texture covers.
pub struct Paint {
    /// Name in the MTL.
    pub name: &'static str,
    /// Diffuse reflectance, multiplied by `map_kd`.
    pub kd: [f64; 3],
    /// Specular reflectance.
    pub ks: f64,
    /// Phong exponent.
    pub ns: f64,
    /// Emitted radiance, W·sr⁻¹·m⁻².
    pub ke: [f64; 3],
    /// Diffuse texture.
    pub map_kd: Option<&'static str>,
    /// Emission texture.
    pub map_ke: Option<&'static str>,
    /// Cut-out mask.
    pub map_d: Option<&'static str>,
    /// Metres a repeat of the texture.
    pub tile: f64,
}

impl Paint {
    /// A diffuse material.
    const fn matt(name: &'static str, kd: [f64; 3]) -> Self {
        Self { name, kd, ks: 0.0, ns: 0.0, ke: [0.0; 3], map_kd: None, map_ke: None, map_d: None, tile: 1.0 }
    }
    /// An emitter.
    const fn glow(name: &'static str, ke: [f64; 3]) -> Self {
        Self { ke, ..Self::matt(name, [0.05; 3]) }
    }
    /// With a diffuse texture, `tile` metres a repeat.
    const fn textured(name: &'static str, map: &'static str, tile: f64) -> Self {
        Self { map_kd: Some(map), tile, ..Self::matt(name, [1.0; 3]) }
    }
    /// With a highlight; k_d + k_s stays within 1.
    const fn polished(self, ks: f64, ns: f64) -> Self {
        let keep = 1.0 - ks;
        Self { kd: [self.kd[0] * keep, self.kd[1] * keep, self.kd[2] * keep], ks, ns, ..self }
    }

    /// Whether texture coordinates matter.
    pub const fn is_textured(&self) -> bool {
        self.map_kd.is_some() || self.map_ke.is_some() || self.map_d.is_some()
    }

    /// Its entry in an MTL file; emission times `power`.
    fn write(&self, out: &mut String, power: f64) {
        let three = |v: [f64; 3]| format!("{} {} {}", trim(v[0]), trim(v[1]), trim(v[2]));
        let _ = writeln!(out, "\nnewmtl {}\nKd {}", self.name, three(self.kd));
        if self.ks > 0.0 {
            let _ = writeln!(out, "Ks {}\nNs {}", three([self.ks; 3]), trim(self.ns));
        }
        if self.ke != [0.0; 3] {
            let _ = writeln!(out, "Ke {}", three(self.ke.map(|c| c * power)));
        }
        for (keyword, map) in [("map_Kd", self.map_kd), ("map_Ke", self.map_ke), ("map_d", self.map_d)] {
            if let Some(map) = map {
                let _ = writeln!(out, "{keyword} textures/{map}");
            }
        }
        let _ = writeln!(out, "illum {}", if self.ks > 0.0 { 2 } else { 1 });
    }
}

/// Three decimals at most.
pub fn trim(value: f64) -> f64 {
    (value * 1e3).round() / 1e3
}

/// An MTL file of `paints`; emission times `power`.
pub fn mtl<'a>(title: &str, paints: impl Iterator<Item = &'a Paint>, power: f64) -> String {
    let mut out = format!("# {title}\n# Written by make-scenes; MIT OR Apache-2.0.\n");
    for paint in paints {
        paint.write(&mut out, power);
    }
    out
}

macro_rules! paints {
    ($($(#[doc = $doc:literal])* $id:ident = $value:expr;)*) => {
        $($(#[doc = $doc])* pub static $id: Paint = $value;)*
    };
}

paints! {
    /// Black and cream marble flags.
    FLAGS = Paint::textured("flags", "flags.png", 2.0).polished(0.05, 20.0);
    /// Waxed planks of the gallery floor.
    PLANKS = Paint::textured("planks", "planks.png", 1.6).polished(0.06, 30.0);
    /// Warm lime plaster.
    PLASTER = Paint::textured("plaster", "plaster.png", 2.0);
    /// Dressed limestone of arcade, columns and window wall.
    STONE = Paint::textured("stone", "stone.png", 1.6);
    /// The vault: gold stars on blue.
    STARS = Paint::textured("stars", "stars.png", 2.2);
    /// Oak of shelves and tables.
    OAK = Paint::textured("oak", "oak.png", 1.0).polished(0.05, 30.0);
    /// Darker oak of rails and frames.
    DARK_OAK = Paint { kd: [0.5, 0.42, 0.38], ..Paint::textured("dark_oak", "oak.png", 0.8) }.polished(0.06, 40.0);
    /// Leather book spines, an atlas of 8 × 8.
    BOOKS = Paint::textured("books", "books.png", 1.0).polished(0.03, 20.0);
    /// Page edges of closed books.
    PAGE_EDGE = Paint::matt("page_edge", [0.68, 0.6, 0.46]);
    /// Printed pages.
    PAGES = Paint::textured("pages", "pages.png", 1.0);
    /// The rug.
    RUG = Paint::textured("rug", "rug.png", 1.0);
    /// Fringe and underside of the rug.
    FRINGE = Paint::matt("fringe", [0.55, 0.45, 0.3]);
    /// Brick of the hearth.
    BRICK = Paint::textured("brick", "brick.png", 0.9);
    /// Polished brass.
    BRASS = Paint::matt("brass", [0.52, 0.36, 0.13]).polished(0.4, 30.0);
    /// Wrought iron.
    IRON = Paint::matt("iron", [0.06, 0.06, 0.07]).polished(0.12, 20.0);
    /// Lead of the windows.
    LEAD = Paint::matt("lead", [0.12, 0.12, 0.13]).polished(0.1, 15.0);
    /// Green glass of the lamp shades, opaque here.
    SHADE = Paint::matt("shade", [0.03, 0.24, 0.12]).polished(0.2, 60.0);
    /// Bookbinder's cloth, blue.
    CLOTH_BLUE = Paint::matt("cloth_blue", [0.06, 0.1, 0.26]);
    /// Bookbinder's cloth, green.
    CLOTH_GREEN = Paint::matt("cloth_green", [0.07, 0.2, 0.12]);
    /// Bookbinder's cloth, tan.
    CLOTH_TAN = Paint::matt("cloth_tan", [0.42, 0.26, 0.12]);
    /// Blue-and-white glaze.
    GLAZE = Paint::matt("glaze", [0.2, 0.32, 0.6]).polished(0.15, 60.0);
    /// Terracotta.
    TERRACOTTA = Paint::matt("terracotta", [0.55, 0.24, 0.13]);
    /// Potting soil.
    SOIL = Paint::matt("soil", [0.08, 0.055, 0.04]);
    /// Leaves, cut out by a mask.
    LEAF = Paint { map_d: Some("leaf_mask.png"), ..Paint::textured("leaf", "leaf.png", 1.0) }.polished(0.05, 20.0);
    /// Stems of the palms.
    STEM = Paint::matt("stem", [0.14, 0.22, 0.07]);
    /// Rattan lattice of the folding screen, cut out by a mask.
    RATTAN = Paint { map_d: Some("rattan_mask.png"), ..Paint::textured("rattan", "oak.png", 0.24) };
    /// Wax of the candles.
    WAX = Paint::matt("wax", [0.82, 0.76, 0.62]);
    /// Red velvet.
    VELVET = Paint::matt("velvet", [0.36, 0.035, 0.05]);
    /// Painting: moon over hills.
    PAINTING_MOON = Paint::textured("painting_moon", "painting_moon.png", 1.0);
    /// Painting: a harbour at sunset.
    PAINTING_SUN = Paint::textured("painting_sun", "painting_sun.png", 1.0);
    /// Globe with continents.
    GLOBE = Paint::textured("globe", "globe.png", 1.0).polished(0.06, 40.0);
    /// Charred logs.
    LOG = Paint::matt("log", [0.1, 0.07, 0.05]);

    /// Rose window, lit from behind.
    ROSE_GLASS = Paint { map_ke: Some("rose.png"), ..Paint::glow("rose_glass", [7.0, 7.0, 9.0]) };
    /// Night sky behind the windows.
    NIGHT_SKY = Paint { map_ke: Some("night.png"), ..Paint::glow("night_sky", [1.6, 1.9, 2.6]) };
    /// Alabaster globes.
    ALABASTER = Paint::glow("alabaster", [42.0, 28.0, 14.5]);
    /// Fire in the hearth.
    FIRE = Paint::glow("fire", [40.0, 12.0, 1.6]);
    /// Bulbs of the table lamps.
    BULB = Paint::glow("bulb", [150.0, 104.0, 56.0]);
    /// Candle flames.
    FLAME = Paint::glow("flame", [170.0, 92.0, 32.0]);
    /// Bulbs of the string light.
    FAIRY = Paint::glow("fairy", [64.0, 37.0, 14.0]);
    /// Panels of the hanging lanterns.
    LANTERN = Paint::glow("lantern", [30.0, 17.5, 7.0]);
    /// Light strips on top of the bookcases.
    STRIP = Paint::glow("strip", [30.0, 21.0, 11.5]);
}
