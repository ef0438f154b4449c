//! Why a pixel is so: the parts that are told add up to the pixel of the written picture.
#![allow(clippy::unwrap_used, reason = "in a test, a panic is how a failure shows")]

use crate::support::binary::{has_device, run, stderr};
use glam::Vec3;
use penombre::image::exr::read_rgb;
use penombre::image::png;
use penombre::refine::explanation::{Kind, Known, Light};
use penombre::scene::Scene;
use penombre::scene::camera::ImageSize;
use penombre::scene::load::load;
use penombre::session::{Batches, Budget, Options, Pace, Probe, Session, Unobserved};
use serde_json::Value;
use std::fs;
use std::path::Path;
use std::sync::Arc;

const SIZE: ImageSize = ImageSize { width: 64, height: 48 };

/// A box that is open in front: a glossy floor under a block, a painted wall, a lamp in view, and two lights beside it.
const OBJECTS: &str = "mtllib box.mtl
v 0 0 0\nv 1 0 0\nv 1 0 1\nv 0 0 1\nv 0 1 0\nv 1 1 0\nv 1 1 1\nv 0 1 1
v .4 .99 .4\nv .6 .99 .4\nv .6 .99 .6\nv .4 .99 .6
v .3 0 .3\nv .7 0 .3\nv .7 0 .6\nv .3 0 .6\nv .3 .3 .3\nv .7 .3 .3\nv .7 .3 .6\nv .3 .3 .6
vt 0 0\nvt 3 0\nvt 3 3\nvt 0 3
usemtl floor\nf 4 3 2 1
usemtl wall\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6
f 17 20 19 18\nf 16 15 19 20\nf 15 14 18 19\nf 13 16 20 17\nf 14 13 17 18
usemtl paint\nf 4/1 1/2 5/3 8/4
usemtl lamp\nf 9 10 11 12\n";
const MATERIALS: &str = "newmtl floor\nKd .4 .4 .4\nKs .4 .4 .3\nNs 12\nnewmtl wall\nKd .7 .7 .6\n
newmtl paint\nKd 1 1 1\nmap_Kd paint.png\nnewmtl lamp\nKd .1 .1 .1\nKe 9 8 6\n";
const SCENE: &str = "[geometry]\nobj = [\"box.obj\"]\n[[camera]]\nposition = [0.5, 0.6, 2.7]\nlook_at = [0.5, 0.5, 0.0]\n\
    vertical_fov = 42\n[[light]]\nname = \"bulb\"\nkind = \"point\"\nposition = [0.15, 0.6, 0.8]\nintensity = [0.2, 0.1, 0.1]\n\
    [[light]]\nname = \"spot\"\nkind = \"spot\"\nposition = [0.9, 0.9, 0.9]\ndirection = [-1, -1, -1]\n\
    intensity = [0.2, 0.4, 0.5]\ninner_angle = 15\nouter_angle = 25\n";

fn write_scene(folder: &Path) {
    let (texels, size) = (8, ImageSize { width: 8, height: 8 });
    let paint = |i: usize| {
        [(i % texels * 30) as u8, (i / texels * 30) as u8, if (i + i / texels).is_multiple_of(2) { 200 } else { 40 }]
    };
    let pixels: Vec<u8> = (0..size.pixels()).flat_map(paint).collect();
    png::write_bytes(&folder.join("paint.png"), size, &pixels).unwrap();
    for (name, text) in [("box.obj", OBJECTS), ("box.mtl", MATERIALS), ("box.toml", SCENE)] {
        fs::write(folder.join(name), text).unwrap();
    }
}

/// A session that has refined the box, its picture, and the scene.
fn refined(folder: &Path) -> (Session, Vec<Vec3>, Arc<Scene>) {
    write_scene(folder);
    let scene = Arc::new(load(&folder.join("box.toml")).unwrap().scene);
    let options = Options {
        size: SIZE,
        threads: Some(2),
        pace: Pace::Fixed(Batches::A_FRAME),
        budget: Budget { rays: Some(100_000), ..Budget::default() },
        ..Options::default()
    };
    let mut session = Session::open(&scene, &options).unwrap();
    session.look_through(&scene.cameras[0].camera, &[]).unwrap();
    session.run(&mut Unobserved).unwrap();
    let file = folder.join("box.exr");
    session.still().unwrap().write(&file, "").unwrap();
    let picture = read_rgb(&file).unwrap();
    (session, picture.rgb, scene)
}

/// Difference of two colours against the brighter.
fn apart(a: Vec3, b: Vec3) -> f32 {
    (a - b).abs().max_element() / a.max(b).max_element().max(1e-6)
}

/// What the parts of an explanation add up to, each vertex by its share.
fn added_up(probe: &Probe) -> Vec3 {
    let vertices = probe.surface.iter().flat_map(|surface| &surface.vertices);
    let reflected = vertices.map(|vertex| {
        let mut sum = Light::default();
        let parts = vertex.lights.iter().map(|part| part.light).chain([vertex.indirect.light, vertex.unaccounted]);
        parts.for_each(|part| {
            sum.diffuse += part.diffuse * vertex.share;
            sum.specular += part.specular * vertex.share;
        });
        probe.colours.kd * sum.diffuse + probe.colours.ks * sum.specular
    });
    probe.colours.emission + reflected.sum::<Vec3>()
}

/// What pixels of the box were found to be.
#[derive(Debug, Default, PartialEq)]
struct Kinds {
    background: u32,
    emitter: u32,
    painted: u32,
    glossy: u32,
    covered: u32,
    flat: u32,
    inferred: u32,
    smoothed: u32,
    edge: u32,
    all: u32,
}

impl Kinds {
    fn count(&mut self, probe: &Probe) {
        let is = |of: bool| u32::from(of);
        self.all += 1;
        self.background += is(!probe.covered);
        self.emitter += is(probe.colours.emission != Vec3::ZERO);
        self.edge += is(probe.notes.iter().any(|note| note.contains("may differ")));
        let Some(surface) = &probe.surface else { return };
        self.painted += is(surface.face.material == "paint");
        self.glossy += is(surface.face.shininess.is_some() && surface.light.sum.specular != Vec3::ZERO);
        self.covered += is(surface.vertices.iter().any(|vertex| vertex.covered && vertex.barycentric > 0.1));
        self.flat += is(surface.vertices.iter().any(|vertex| vertex.kind == Kind::Pixel && vertex.share == 1.0));
        let mut lights = surface.vertices.iter().flat_map(|vertex| &vertex.lights);
        self.inferred += is(lights.any(|part| part.known == Known::Inferred));
        self.smoothed += is(surface.vertices.iter().any(|vertex| vertex.indirect.shown_as == "smoothed"));
    }
}

fn check(probe: &Probe, shown: Vec3) {
    let [x, y] = probe.pixel;
    assert_eq!(probe.covered, probe.surface.is_some(), "{x} {y}");
    if probe.notes.iter().any(|note| note.contains("may differ")) {
        return;
    }
    assert!(apart(added_up(probe), shown) < 1e-3, "{x} {y}: {} but shown {shown}", added_up(probe));
    assert!(apart(probe.radiance.sum, shown) < 1e-3 && apart(probe.image.radiance, shown) < 1e-3, "{x} {y}");
    let parts: Vec3 = probe.radiance.lights.iter().map(|part| part.radiance).sum();
    let rest = probe.radiance.emission + probe.radiance.indirect + probe.radiance.unaccounted;
    assert!(apart(parts + rest, shown) < 1e-3, "{x} {y}");
    let Some(surface) = &probe.surface else { return };
    assert!(probe.radiance.unaccounted.abs().max_element() <= 1e-3 * shown.max_element(), "{x} {y}");
    let shares: f32 = surface.vertices.iter().map(|vertex| vertex.share).sum();
    assert!((shares - 1.0).abs() < 1e-4, "{x} {y}: shares {shares}");
    let (first, last) = (&surface.nodes[0], &surface.nodes[surface.nodes.len() - 1]);
    assert_eq!((first.level, last.level as usize + 1), (0, surface.nodes.len()));
    let names: Vec<&str> = surface.light.lights.iter().map(|light| light.lights[0].as_str()).collect();
    assert_eq!(names, ["bulb", "spot", "lamp"]);
}

#[test]
fn the_parts_of_a_pixel_add_up_to_it() {
    if !has_device() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let (mut session, picture, scene) = refined(folder.path());
    assert_eq!(scene.lights.len(), 3);
    let mut kinds = Kinds::default();
    // Row 39 passes along the foot of the block, which covers vertices of the floor.
    let foot = 39 * SIZE.width as usize..40 * SIZE.width as usize;
    for index in (0..picture.len()).step_by(7).chain(foot) {
        let [x, y] = [index as u32 % SIZE.width, index as u32 / SIZE.width];
        let probe = session.probe([x, y]).unwrap();
        check(&probe, picture[index]);
        kinds.count(&probe);
    }
    println!("{kinds:?}");
    let Kinds { background, emitter, painted, glossy, covered, flat, inferred, smoothed, edge, all } = kinds;
    let seen = [background, emitter, painted, glossy, covered, flat, inferred, smoothed];
    assert!(seen.iter().all(|count| *count > 0), "{seen:?}");
    assert!(edge * 20 < all, "{edge} of {all} pixels at edges");
    let fault = session.probe([SIZE.width, 0]).unwrap_err();
    assert!(fault.to_string().contains("columns are 0 to 63"), "{fault}");
}

fn colour(value: &Value) -> Vec3 {
    Vec3::from_array([0, 1, 2].map(|channel| value[channel].as_f64().unwrap() as f32))
}

const RUN: &str = "--size 64x48 --rays 100000 --deterministic -q";

#[test]
fn the_command_tells_of_the_picture_that_render_writes() {
    if !has_device() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    write_scene(folder.path());
    let rendered = run(folder.path(), &format!("render box.toml -o box.exr {RUN}"));
    assert_eq!((rendered.status.code(), stderr(&rendered).as_str()), (Some(0), ""));
    let picture = read_rgb(&folder.path().join("box.exr")).unwrap();
    let told = [1, 2].map(|threads| {
        let output = run(folder.path(), &format!("probe box.toml 40 38 {RUN} --threads {threads}"));
        assert_eq!((output.status.code(), stderr(&output).as_str()), (Some(0), ""));
        String::from_utf8(output.stdout).unwrap()
    });
    assert!(told[0] == told[1], "the same whatever the number of threads");
    let probe: Value = serde_json::from_str(&told[0]).unwrap();
    let shown = picture.rgb[38 * 64 + 40];
    assert!(apart(colour(&probe["radiance"]["sum"]), shown) < 1e-3, "{shown}");
    assert_eq!(probe["surface"]["vertices"][0]["lights"][0]["lights"][0], "bulb");
    let meanwhile = run(folder.path(), "probe box.toml 40 38 --size 64x48 --time 0.2 -q");
    assert_eq!((meanwhile.status.code(), stderr(&meanwhile).as_str()), (Some(0), ""));
    let probe: Value = serde_json::from_slice(&meanwhile.stdout).unwrap();
    let [sum, shown] = [&probe["radiance"]["sum"], &probe["image"]["radiance"]].map(colour);
    assert!(apart(sum, shown) < 1e-3, "of one moment, though the engine goes on beside it: {sum} {shown}");
    let outside = run(folder.path(), &format!("probe box.toml 64 0 {RUN}"));
    assert_eq!(outside.status.code(), Some(2));
    assert!(stderr(&outside).contains("no pixel of an image of 64x48"), "{}", stderr(&outside));
}

#[test]
fn a_script_explains_a_pixel_and_saves_what_is_said() {
    if !has_device() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    write_scene(folder.path());
    let script = "0.25 pixel.explain 0.65 0.8\n0.5 window.screenshot with.png\n0.5 window.picture without.png\n\
                  0.75 app.back\n1 window.screenshot closed.png\n1 window.picture bare.png\n\
                  1.25 pixel.explain 0.65 0.8\n1.25 pixel.save pixel.json\n";
    fs::write(folder.path().join("walk.script"), script).unwrap();
    let line = "view box.toml --headless --size 320x240 --rays 20000 --fps 8 --script walk.script -q";
    let output = run(folder.path(), line);
    assert_eq!((output.status.code(), stderr(&output).as_str()), (Some(0), ""));
    let probe: Value = serde_json::from_slice(&fs::read(folder.path().join("pixel.json")).unwrap()).unwrap();
    assert_eq!(probe["pixel"], serde_json::json!([208, 192]));
    assert_eq!(probe["surface"]["face"]["material"], "floor");
    let pixels = |name: &str| png::read(&folder.path().join(name)).unwrap().1;
    assert!(pixels("with.png") != pixels("without.png"), "a panel lies over the picture");
    assert!(pixels("closed.png") == pixels("bare.png"), "until it is closed");
    assert!(apart(colour(&probe["radiance"]["sum"]), colour(&probe["image"]["radiance"])) < 1e-3);
    fs::write(folder.path().join("walk.script"), "0 pixel.save pixel.json\n").unwrap();
    let early = run(folder.path(), line);
    assert_eq!(early.status.code(), Some(2));
    assert!(stderr(&early).contains("no pixel is explained"), "{}", stderr(&early));
}
