//! Scene files and OBJ files written here: what loads, and what is said of what does not.

#![allow(clippy::expect_used, reason = "a test may end where its files cannot be written")]

use glam::{DVec3, Vec3};
use penombre::error::Error;
use penombre::scene::camera_path::load_camera_path;
use penombre::scene::light::LightKind;
use penombre::scene::load::{Loaded, load};
use penombre::scene::report::{Report, Severity};
use penombre::scene::{EmissionSide, ToneMapping, TriangleId};
use std::path::PathBuf;
use tempfile::TempDir;

/// A directory with files in it.
struct Files {
    directory: TempDir,
}

impl Files {
    fn new(files: &[(&str, &[u8])]) -> Self {
        let directory = tempfile::tempdir().expect("a temporary directory");
        for (name, content) in files {
            std::fs::write(directory.path().join(name), content).expect("a temporary file");
        }
        Self { directory }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.directory.path().join(name)
    }

    fn load(&self, name: &str) -> Loaded {
        load(&self.path(name)).unwrap_or_else(|e| panic!("{name}: {e}"))
    }

    fn refused(&self, name: &str) -> Report {
        match load(&self.path(name)) {
            Err(Error::Input(report)) => report,
            other => panic!("{name}: {other:?}"),
        }
    }
}

/// The scene of one OBJ.
fn obj(text: impl AsRef<[u8]>) -> Loaded {
    Files::new(&[("a.obj", text.as_ref())]).load("a.obj")
}

fn lines(report: &Report, severity: Severity) -> Vec<u32> {
    report.faults.iter().filter(|f| f.severity == severity).map(|f| f.place.line.unwrap_or(0)).collect()
}

const TRIANGLE: &[u8] = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";

#[test]
fn a_full_scene_file_is_read() {
    let files = Files::new(&[
        ("tri.obj", TRIANGLE),
        (
            "s.toml",
            br#"
[geometry]
obj = ["tri.obj", "tri.obj"]
emit = "both"
[[camera]]
name = "main"
position = [278, 273, -8e2]
look_at = [278, 273, 0]
up = [0, 1, 0]
vertical_fov = 37.5
[[camera]]
position = [0, 0, 5]
look_at = [0, 0, 0]
[[light]]
kind = "point"
name = "bulb"
position = [1, 2, 3]
intensity = [1e5, 0, 0x10]
[[light]]
kind = "spot"
position = [0, 1, 0]
direction = [0, -2, 0]
intensity = [1, 1, 1]
inner_angle = 30
outer_angle = 60
[[light]]
kind = "directional"
direction = [3, 0, 4]
irradiance = [1, 2, 3]
[display]
exposure = -1.5
tone_mapping = "pbr-neutral"
"#,
        ),
    ]);
    let Loaded { scene, report, .. } = files.load("s.toml");
    assert!(lines(&report, Severity::Error).is_empty());
    assert_eq!((scene.triangles.len(), scene.positions.len()), (2, 3), "two files share welded positions");
    assert_eq!(scene.emission_side, EmissionSide::Both);
    assert_eq!(scene.cameras.iter().map(|c| c.name.as_str()).collect::<Vec<_>>(), ["main", "camera 2"]);
    assert_eq!(scene.cameras[0].camera.position, Vec3::new(278.0, 273.0, -800.0));
    assert_eq!(scene.cameras[0].camera.vertical_fov, 37.5);
    assert_eq!(scene.lights.iter().map(|l| l.name.as_str()).collect::<Vec<_>>(), ["bulb", "light 2", "light 3"]);
    let bulb = LightKind::Point { position: Vec3::new(1.0, 2.0, 3.0), intensity: Vec3::new(1e5, 0.0, 16.0) };
    assert_eq!(scene.lights[0].kind, bulb);
    let LightKind::Spot { direction, cos_inner, cos_outer, .. } = scene.lights[1].kind else { panic!("no spot") };
    assert_eq!(direction, Vec3::NEG_Y);
    assert!((cos_inner - 0.75_f32.sqrt()).abs() < 1e-6 && (cos_outer - 0.5).abs() < 1e-6);
    let LightKind::Directional { direction, .. } = scene.lights[2].kind else { panic!("no directional light") };
    assert!(direction.distance(Vec3::new(0.6, 0.0, 0.8)) < 1e-6);
    assert_eq!((scene.display.exposure, scene.display.tone_mapping), (-1.5, ToneMapping::PbrNeutral));
}

#[test]
fn all_faults_are_listed_with_their_lines() {
    let files = Files::new(&[
        ("tri.obj", b"mtllib gone.mtl\nusemtl x\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nf 1 2 9\n"),
        (
            "s.toml",
            b"titel = 1
[geometry]
obj = [\"tri.obj\", \"gone.obj\"]
emitt = \"both\"
[camera]
position = [0, 0, 0]
look_at = [0, 0, 0]
vertical_fov = 180
[[light]]
kind = \"spot\"
position = [0, 0, nan]
direction = [0, 0, 0]
intensity = [1, -1, 1]
inner_angle = 30
outer_angle = 20
[[light]]
kind = \"environment\"
file = \"sky.hdr\"
[[light]]
kind = \"pont\"
[[light]]
kind = \"point\"
position = [0, 1, 0]
[display]
tone_mapping = 3
",
        ),
    ]);
    let report = files.refused("s.toml");
    assert_eq!(
        lines(&report, Severity::Error),
        [1, 4, 7, 8, 11, 12, 13, 14, 18, 20, 21, 25, 3],
        "{}",
        Error::Input(report.clone())
    );
    let said = |line: u32, words: &str| {
        let at = |f: &&penombre::scene::report::Fault| f.place.line == Some(line) && f.message.contains(words);
        assert!(report.faults.iter().any(|f| at(&f)), "no {words:?} at line {line}: {report:#?}");
    };
    said(4, "did you mean emit?");
    said(11, "[0, 0, nan]");
    said(18, "sky.hdr: No such file");
    said(20, "did you mean \"point\"?");
    said(21, "lacks intensity");
    // The OBJ's own faults come along.
    said(1, "gone.mtl");
    said(2, "material x: in no MTL file");
    said(7, "no vertex 9");
}

#[test]
fn syntax_errors_have_lines_and_do_not_hide_other_faults() {
    let files = Files::new(&[("s.toml", b"[geometry]\nobj = \n[camera]\npozition = [0, 0, 1]\n")]);
    let errors = lines(&files.refused("s.toml"), Severity::Error);
    assert!(errors.contains(&2) && errors.contains(&4), "{errors:?}");
}

#[test]
fn what_is_no_scene_gets_one_message() {
    let files = Files::new(&[
        ("empty.obj", b" \n"),
        ("binary.obj", b"v 0 0 0\n\0\x01\x02"),
        ("binary.toml", b"\x7fELF\0"),
        ("latin.toml", b"# \xe9\n[geometry]\n"),
        ("scene.gltf", b"{\"asset\": {}}"),
        ("scene.GLB", b"glTF\x02\0\0\0"),
        ("renamed.obj", b"glTF\x02\0\0\0"),
        ("scene.txt", b"hello"),
        ("points.obj", b"v 0 0 0\nv 1 1 1\n"),
        ("flat.obj", b"v 0 0 0\nv 1 1 1\nv 2 2 2\nf 1 2 3\n"),
    ]);
    std::fs::create_dir(files.path("folder.obj")).expect("a folder");
    for (name, words) in [
        ("empty.obj", "is empty"),
        ("binary.obj", "binary"),
        ("binary.toml", "binary"),
        ("latin.toml", "UTF-8"),
        ("scene.gltf", "is no valid glTF: missing field `version`"),
        ("scene.GLB", "is a binary glTF file that ends within its header"),
        ("renamed.obj", "is a binary glTF file: name it .glb"),
        ("scene.txt", "neither a scene file"),
        ("folder.obj", "is a directory"),
        ("points.obj", "nothing to draw: there is no face"),
        ("flat.obj", "nothing to draw (triangles without area: 1)"),
    ] {
        let report = files.refused(name);
        assert_eq!(report.faults.len(), 1, "{name}: {report:?}");
        assert!(report.faults[0].message.contains(words), "{name}: {}", report.faults[0]);
        assert_eq!(report.faults[0].place.file, files.path(name));
    }
    let missing = load(&files.path("missing.obj"));
    assert!(matches!(&missing, Err(Error::Io { path, .. }) if *path == files.path("missing.obj")), "{missing:?}");
    assert_eq!(missing.map_err(|e| e.exit_status()).err(), Some(2));
}

#[test]
fn line_endings_continuations_and_latin_1_are_read() {
    let text =
        b"# caf\xe9 \\\r\nv 0 0 0\r\nv 1 \\\r\n 0 0\r\nv 0 1 0\r\nusemtl mat\xe9riau\r\nf 1 2 \\\r\n3\r\nf 1 2 7\r\n";
    let Loaded { scene, report, .. } = obj(text);
    assert_eq!(scene.positions, [Vec3::ZERO, Vec3::X, Vec3::Y]);
    assert_eq!(scene.materials[0].name, "matériau");
    // Lines count as in the file: the comment's backslash does not swallow a vertex, a joined line counts its parts.
    assert_eq!(lines(&report, Severity::Warning)[..2], [9, 6]);
    assert_eq!(obj(b"v 0 0 0\rv 1 0 0\rv 0 1 0\rf 1 2 3\r").scene.triangles.len(), 1, "old Mac line ends");
    assert_eq!(obj(b"\xef\xbb\xbfv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3").scene.positions[0], Vec3::ZERO, "BOM");
}

#[test]
fn indices_are_resolved_like_a_tolerant_loader() {
    let loaded = obj("l 1 2\np 1\nf 1 2 3\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf -1 -2 -3\nv -0.0 0 1\nf 1 2 4\nf 0 1 2\n\
                      f 4294967295 1 2\nf 99999999999999999999 1 2\nf 1/x 2/7/ 3//5\nf 1 2/3/4/5 3\nf 1 2\nf -9 1 2\n");
    assert_eq!(loaded.scene.triangles, [[0, 1, 2], [2, 1, 0], [0, 1, 3], [0, 1, 2]]);
    assert_eq!(loaded.counts.dropped_faces, 6);
    let found: Vec<_> = lines(&loaded.report, Severity::Warning).into_iter().filter(|&l| l > 0).collect();
    assert_eq!(found, [1, 2, 10, 11, 12, 13, 13, 13, 14, 15, 16]);
}

#[test]
fn positions_are_welded_by_their_bits() {
    let loaded =
        obj("v 0 0 0\nv 1 0 0\nv 0 1 0\nv -0 -0.0 0e0\nv 1.0 0 0\nf 1 2 3\nf 3 5 4\nv 1.0000001 0 0\nf 1 6 3\n");
    assert_eq!(loaded.scene.triangles, [[0, 1, 2], [2, 1, 0], [0, 3, 2]]);
    assert!(loaded.scene.positions.iter().all(|p| p.is_negative_bitmask() == 0), "no -0");
}

#[test]
fn many_faults_of_a_kind_are_counted() {
    let mut text = String::from_utf8(TRIANGLE.to_vec()).expect("text");
    text.push_str(&"f 1 2 77\n".repeat(1000));
    let report = obj(text).report;
    let faults: Vec<_> = report.faults.iter().filter(|f| f.place.line.is_some()).collect();
    assert_eq!(faults.len(), 11);
    assert!(faults[10].message.contains("and 990 more like it"), "{}", faults[10]);
    assert_eq!(faults[10].place.line, Some(15));
}

#[test]
fn attributes_follow_their_corners() {
    let loaded = obj("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nvt 0.25 0.5 9\nvt 1\nvn 0 0 5\nvn 1 0 -1\n\
                      f 1/1/1 2/2 3//1\nf 2 4 3\nf 2//2 4//2 3//2\n");
    let scene = loaded.scene;
    assert_eq!(scene.uvs[0].map(|uv| uv.to_array()), [[0.25, 0.5], [1.0, 0.0], [0.0, 0.0]]);
    assert_eq!(scene.normals[1], [Vec3::Z; 3]);
    let turned = Vec3::new(-1.0, 0.0, 1.0).normalize();
    assert!(scene.normals[2].iter().all(|n| n.distance(turned) < 1e-6), "a normal behind its face is turned");
    assert!(loaded.report.faults.iter().any(|f| f.message.contains("3 vertex normals")), "{:?}", loaded.report);
}

#[test]
fn concave_faces_keep_their_shape() {
    // The L of area 3, as one face whose fan would cover more.
    let loaded = obj("v 0 1 0\nv 0 0 0\nv 2 0 0\nv 2 2 0\nv 1 2 0\nv 1 1 0\nf 4 5 6 1 2 3\n");
    let area: f32 = (0..4).map(|t| loaded.scene.area_vector(TriangleId(t)).z / 2.0).sum();
    assert_eq!((loaded.counts.drawn, area), (4, 3.0));
    assert!((0..4).all(|t| loaded.scene.area_vector(TriangleId(t)).z > 0.0));
}

#[test]
fn textures_are_decoded_once_for_each_use() {
    let image = image::RgbaImage::from_fn(2, 2, |x, _| image::Rgba([200, 100, 0, if x == 0 { 255 } else { 10 }]));
    let files = Files::new(&[
        (
            "a.obj",
            b"mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl a\nf 1 2 3\nusemtl b\nf 1 2 3\nusemtl c\nf 1 3 2\n",
        ),
        (
            "a.mtl",
            b"newmtl a\nKd 1\nmap_Kd tex\\My Image.PNG\nmap_d my image.png\nnewmtl b\nKd 0\nmap_kd my image.png\n\
              newmtl c\nKd 0.5\nmap_Kd broken.png\nmap_d gone.png\nnewmtl unused\nmap_Kd also gone.png\n",
        ),
        ("broken.png", b"\x89PNG\r\n\x1a\nnothing more"),
    ]);
    image.save(files.path("my image.png")).expect("a written image");
    let Loaded { scene, report, .. } = files.load("a.obj");
    let [a, b, c] = [0, 1, 2].map(|m| &scene.materials[m]);
    assert_eq!(scene.textures.len(), 2);
    assert_eq!(a.map_kd, b.map_kd);
    assert_ne!(a.map_kd, a.map_d);
    assert_eq!(a.map_d, b.map_d, "the alpha of a colour map is its mask");
    assert_eq!((c.map_kd, c.map_d, c.kd), (None, None, Vec3::splat(0.5)));
    assert_eq!(b.kd, Vec3::ONE, "Kd 0 with a map means 1");
    let texels = |map: Option<penombre::scene::material::TextureMap>| scene.texture(&map.expect("a map")).texels();
    assert_eq!(texels(a.map_kd)[..2], [[200, 100, 0, 255]; 2], "alpha of a colour map is not used");
    assert_eq!(texels(a.map_d)[..2].iter().map(|t| t[3]).collect::<Vec<_>>(), [255, 10]);
    let found: Vec<_> = lines(&report, Severity::Warning).into_iter().filter(|&l| l > 0).collect();
    assert_eq!(found, [5, 10, 11], "{report:#?}");
}

#[test]
fn emitters_become_named_area_lights() {
    let files = Files::new(&[
        ("a.obj", b"mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nusemtl lamp\nf 1 2 3\nf 2 4 3\nusemtl wall\nf 1 3 2\n"),
        ("a.mtl", b"newmtl lamp\nKe 3\nnewmtl wall\nKd 0.5\n"),
        (
            "s.toml",
            b"[geometry]\nobj = \"a.obj\"\n[light]\nname = \"lamp\"\nkind = \"point\"\nposition = [0, 0, 1]\nintensity = [1, 1, 1]\n",
        ),
    ]);
    let area = LightKind::Area { triangles: vec![TriangleId(0), TriangleId(1)] };
    let bare = files.load("a.obj");
    assert_eq!(bare.scene.lights.len(), 1, "no light is added where something emits");
    assert_eq!((bare.scene.lights[0].name.as_str(), &bare.scene.lights[0].kind), ("lamp", &area));
    let lights = files.load("s.toml").scene.lights;
    assert_eq!(lights.iter().map(|l| l.name.as_str()).collect::<Vec<_>>(), ["lamp", "lamp (area)"]);
    assert_eq!(lights[1].kind, area);
}

#[test]
fn a_bomb_of_an_image_is_refused() {
    // A PNG header that claims 200,000 × 200,000 texels.
    let mut png = b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR".to_vec();
    png.extend_from_slice(&[0, 3, 0x0d, 0x40, 0, 3, 0x0d, 0x40, 8, 6, 0, 0, 0, 0, 0, 0, 0]);
    let files = Files::new(&[
        ("a.obj", b"mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl a\nf 1 2 3\n"),
        ("a.mtl", b"newmtl a\nKd 0.5\nmap_Kd bomb.png\n"),
        ("bomb.png", &png),
    ]);
    let loaded = files.load("a.obj");
    assert!(loaded.scene.textures.is_empty());
    assert_eq!(lines(&loaded.report, Severity::Warning)[0], 3, "{:?}", loaded.report);
}

#[test]
fn camera_paths_are_read_and_refused() {
    let files = Files::new(&[
        (
            "good.toml",
            b"[[key]]\ntime = 0\nposition = [0, 0, 0]\nlook_at = [1, 0, 0]\n[[key]]\ntime = 2\nposition = [0, 4, 0]\n\
              look_at = [1, 0, 0]\n[[edit]]\ntime = 1\nlight = \"lamp\"\npower = 0.5\nswitch = \"off\"\n",
        ),
        ("bad.toml", b"[[kee]]\ntime = 0\n"),
    ]);
    let path = load_camera_path(&files.path("good.toml"), DVec3::ZERO).expect("a camera path");
    assert_eq!((path.keys.len(), path.duration()), (2, 2.0));
    assert_eq!((path.edits[0].power, path.edits[0].on, path.edits[0].colour), (Some(0.5), Some(false), None));
    let Err(Error::Input(report)) = load_camera_path(&files.path("bad.toml"), DVec3::ZERO) else { panic!("accepted") };
    assert_eq!(report.faults.len(), 2, "{report:?}");
    assert!(report.faults[1].message.contains("did you mean key?"), "{report:?}");
}
