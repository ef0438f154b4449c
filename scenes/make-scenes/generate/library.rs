//! The moonlit library: a vaulted reading hall with a gallery, a spiral stair and a hundred lights.

use super::books::Case;
use super::furniture::{
    TABLE, armillary, chair, desk_lamp, globe, open_book, painting, palm, placed, rug, screen, stack, table, tapestry,
    vase,
};
use super::hall::{self, BAYS, EAST, END, GALLERY, NAVE, bay_centre};
use super::obj::Obj;
use super::paint::{OAK, PAINTING_MOON, PAINTING_SUN, Paint, mtl};
use super::rng::Rng;
use super::shapes::{block, rod, side};
use super::toml::{Camera, Light, SceneFile, path};
use super::{File, lamps, stairs, textures};
use glam::{DVec2, DVec3};

/// Centres of the two long tables, along z.
pub const TABLES: [f64; 2] = [-3.6, 3.5];
const NAME: &str = "moonlit_library";

/// The scene's files, in `moonlit_library/`.
///
/// # Errors
/// If a texture cannot be encoded.
pub fn files() -> image::ImageResult<Vec<File>> {
    let (hall, small) = objs();
    let mut files = meshes(&hall, &small);
    files.extend(scene_files());
    for picture in textures::all()? {
        files.push(File { path: format!("{NAME}/textures/{}", picture.name), bytes: picture.png });
    }
    Ok(files)
}

/// The hall with all that stands in it, and the meshes of the small lights.
pub fn objs() -> (Obj, Obj) {
    let mut hall = Obj::default();
    let mut rng = Rng::new(0x1B2A_2026);
    hall::build(&mut hall);
    stairs::balustrade(&mut hall);
    stairs::spiral(&mut hall);
    bookcases(&mut hall, &mut rng);
    furnish(&mut hall, &mut rng);
    lamps::fittings(&mut hall);
    lamps::strong_meshes(&mut hall);
    let mut small = Obj::default();
    lamps::small_meshes(&mut small);
    (hall, small)
}

/// All lights that are no meshes.
pub fn lights() -> Vec<Light> {
    lamps::strong_lights().into_iter().chain(lamps::small_lights()).collect()
}

fn text(name: &str, content: String) -> File {
    File { path: format!("{NAME}/{name}"), bytes: content.into_bytes() }
}

fn meshes(hall: &Obj, small: &Obj) -> Vec<File> {
    let off = "The ninety small lights, switched off";
    let on = "The ninety small lights";
    let title = "The moonlit library";
    vec![
        text("library.obj", hall.text(title, "library.mtl")),
        text("library.mtl", mtl(title, hall.paints(), 1.0)),
        text("small-lights.obj", small.text(on, "small-lights.mtl")),
        text("small-lights.mtl", mtl(on, small.paints(), 1.0)),
        text("small-lights-off.obj", small.text(off, "small-lights-off.mtl")),
        text("small-lights-off.mtl", mtl(off, small.paints(), 0.0)),
    ]
}

fn scene_files() -> Vec<File> {
    let all = lights();
    let scene = |title, small, lights: &[Light]| {
        let obj = ["library.obj", small];
        SceneFile { title, obj: &obj, cameras: &cameras(), lights, exposure: 0.0 }.text()
    };
    let hundred = "The moonlit library, with all hundred lights. Metres, y up. Written by make-scenes.";
    let ten = "The moonlit library with its ten strong lights only. Metres, y up. Written by make-scenes.";
    vec![
        text("moonlit_library.toml", scene(hundred, "small-lights.obj", &all)),
        text("moonlit_library-ten.toml", scene(ten, "small-lights-off.obj", &lamps::strong_lights())),
        text("walk.toml", path("A walk through the moonlit library, for --camera-path.", &walk())),
    ]
}

/// The cameras, the default first.
pub fn cameras() -> [Camera; 8] {
    let d = DVec3::new;
    [
        Camera("hall", d(-1.7, 2.4, 7.8), d(0.45, 3.3, -3.0), 64.0),
        Camera("gallery", d(4.05, 5.6, 5.6), d(-1.3, 4.1, -3.0), 62.0),
        Camera("reading_table", d(1.55, 1.5, 5.55), d(-0.05, 0.86, 3.6), 42.0),
        Camera("aisle", d(5.55, 1.65, 7.4), d(5.75, 1.7, -4.0), 55.0),
        Camera("stair", d(0.2, 1.6, -2.6), d(2.9, 2.3, -6.4), 55.0),
        Camera("vault", d(0.6, 1.5, 5.8), d(-0.1, 7.4, -5.0), 62.0),
        Camera("screen", d(0.9, 1.5, 4.4), d(2.9, 0.5, 7.0), 50.0),
        Camera("hearth", d(-0.9, 1.45, -3.4), d(0.2, 1.35, -8.0), 50.0),
    ]
}

/// In by the south end, past the tables and the armillary sphere, up to the gallery and back along it.
fn walk() -> [(f64, DVec3, DVec3); 11] {
    let d = DVec3::new;
    [
        (0.0, d(-1.7, 2.4, 7.8), d(0.45, 3.3, -3.0)),
        (4.0, d(-1.9, 1.7, 4.6), d(0.2, 1.6, 0.0)),
        (7.0, d(-1.7, 1.6, 1.0), d(0.6, 1.8, -2.0)),
        (10.0, d(-1.3, 1.6, -2.6), d(0.3, 1.7, -8.0)),
        (13.0, d(1.3, 1.8, -3.6), d(3.0, 2.4, -6.4)),
        (16.0, d(2.6, 3.4, -3.0), d(3.4, 4.2, -6.4)),
        (20.0, d(3.2, 5.7, -1.6), d(0.0, 5.6, -8.0)),
        (23.0, d(4.4, 5.7, 0.0), d(5.8, 5.5, 4.0)),
        (26.0, d(5.1, 5.55, 2.2), d(4.6, 5.4, 6.0)),
        (29.0, d(4.4, 5.7, 3.3), d(0.0, 5.0, 1.0)),
        (33.0, d(4.05, 5.6, 5.6), d(-1.3, 4.1, -3.0)),
    ]
}

/// The pictures: centre on the wall, which one, outward direction of the wall.
pub fn paintings() -> [(DVec3, &'static Paint, DVec3); 6] {
    let d = DVec3::new;
    [
        (d(0.0, 3.3, -END), &PAINTING_SUN, DVec3::Z),
        (d(-2.75, 3.7, -END), &PAINTING_MOON, DVec3::Z),
        (d(2.75, 3.3, END), &PAINTING_MOON, DVec3::NEG_Z),
        (d(0.0, 3.3, END), &PAINTING_SUN, DVec3::NEG_Z),
        (d(-2.75, 3.3, END), &PAINTING_MOON, DVec3::NEG_Z),
        (d(0.0, 6.3, END), &PAINTING_MOON, DVec3::NEG_Z),
    ]
}

/// Where the palms stand.
pub fn palms() -> [DVec3; 4] {
    [DVec3::new(-1.95, 0.0, -6.9), DVec3::new(-3.5, 0.0, 4.8), DVec3::new(3.5, 0.0, 5.0), DVec3::new(3.55, 0.0, -1.2)]
}

/// Cases along the east wall on both storeys, between the windows, and by the hearth.
fn bookcases(obj: &mut Obj, rng: &mut Rng) {
    for i in 0..BAYS {
        let z = bay_centre(i);
        for (y, height, rows) in [(0.0, 2.75, 7), (GALLERY, 2.35, 6)] {
            let frame = placed(DVec3::new(EAST, y, z - 1.45), -90.0);
            obj.at(frame, |obj| Case { width: 2.9, height, columns: 3, rows }.build(obj, rng));
            valance(obj, DVec3::new(EAST - 0.34, y + height + 0.09, z));
        }
    }
    for i in 1..BAYS {
        let z = (bay_centre(i - 1) + bay_centre(i)) * 0.5;
        let frame = placed(DVec3::new(-NAVE, 0.0, z + 0.6), 90.0);
        obj.at(frame, |obj| Case { width: 1.2, height: 2.3, columns: 1, rows: 6 }.build(obj, rng));
    }
    obj.offset(DVec3::new(-3.75, 0.0, -END), |obj| {
        Case { width: 2.0, height: 2.4, columns: 2, rows: 6 }.build(obj, rng)
    });
}

/// The board in front of a cornice and the valance under it, which hide the light strip from the nave.
fn valance(obj: &mut Obj, at: DVec3) {
    let (lo, hi) = (DVec3::new(-0.32, -0.07, -1.2), DVec3::new(-0.06, -0.04, 1.2));
    block(obj, &OAK, [at + lo, at + hi], 0.4, side::ALL);
    let (lo, hi) = (DVec3::new(-0.32, -0.18, -1.2), DVec3::new(-0.3, -0.07, 1.2));
    block(obj, &OAK, [at + lo, at + hi], 0.4, side::ALL & !side::BIT[3]);
}

fn furnish(obj: &mut Obj, rng: &mut Rng) {
    for (i, &z) in TABLES.iter().enumerate() {
        obj.offset(DVec3::Z * z, |obj| rug(obj, 3.0, 4.8));
        obj.offset(DVec3::new(0.0, 0.012, z), |obj| {
            table(obj, 3.2);
            for k in -1..=1 {
                let dz = f64::from(k) * 1.0;
                let pull = rng.range(0.0, 0.22);
                obj.at(placed(DVec3::new(0.72 + pull, 0.0, dz + 0.1), rng.range(-14.0, 14.0)), chair);
                let pull = rng.range(0.0, 0.22);
                obj.at(placed(DVec3::new(-0.72 - pull, 0.0, dz - 0.1), 180.0 + rng.range(-14.0, 14.0)), chair);
            }
        });
        on_table(obj, rng, DVec3::new(0.0, TABLE + 0.012, z), i == 0);
    }
    for at in lamps::desk_lamps() {
        obj.offset(at, desk_lamp);
    }
    obj.offset(DVec3::ZERO, armillary);
    for at in palms() {
        obj.offset(at, |obj| palm(obj, rng, 7));
    }
    for (at, paint, facing) in paintings() {
        let size = if at.y > 6.0 { DVec2::new(2.2, 1.6) } else { DVec2::new(1.5, 1.1) };
        obj.at(placed(at, if facing.z > 0.0 { 0.0 } else { 180.0 }), |obj| painting(obj, paint, size));
    }
    obj.at(placed(DVec3::new(2.5, 0.0, 6.7), -35.0), screen);
    obj.offset(DVec3::new(2.7, 0.0, 1.7), globe);
    obj.offset(DVec3::new(-3.3, 0.0, -2.9), vase);
    obj.offset(DVec3::new(3.7, 0.0, 2.4), vase);
    for x in [-2.9, 2.9] {
        obj.offset(DVec3::new(x, 0.0, 0.06 - END), tapestry);
    }
    ladder(obj, DVec3::new(6.0, 0.0, -1.0));
}

/// Open books and piles on a table whose top is centred at `at`.
fn on_table(obj: &mut Obj, rng: &mut Rng, at: DVec3, north: bool) {
    let turn = if north { 180.0 } else { 0.0 };
    for (x, z, degrees) in [(0.26, 0.12, 78.0), (-0.28, -0.45, -84.0), (0.27, -0.95, 97.0), (-0.25, 0.95, -100.0)] {
        obj.at(placed(at + DVec3::new(x, 0.0, z), degrees + turn), open_book);
    }
    for (x, z, count) in [(0.3, 0.62, 4), (-0.3, 0.05, 3), (-0.28, -1.42, 5), (0.24, 1.42, 2)] {
        obj.at(placed(at + DVec3::new(x, 0.0, z), rng.range(0.0, 180.0)), |obj| stack(obj, rng, count));
    }
}

/// A ladder leaning against the cases of the east aisle.
fn ladder(obj: &mut Obj, foot: DVec3) {
    let lean = DVec3::new(0.6, 2.6, 0.0);
    for z in [-0.2, 0.2] {
        let base = foot + DVec3::new(0.0, 0.01, z);
        rod(obj, &OAK, [base, base + lean], 0.022, 7);
    }
    for k in 1..9 {
        let middle = foot + lean * (f64::from(k) / 9.0);
        rod(obj, &OAK, [middle - DVec3::Z * 0.2, middle + DVec3::Z * 0.2], 0.014, 6);
    }
}
