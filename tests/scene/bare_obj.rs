//! Bare OBJ files as people have them: what decides where the added camera and light go.
#![allow(clippy::unwrap_used, reason = "in a test, a panic is how a failure shows")]

use crate::support::binary::{has_device, run, stderr};
use glam::{Vec2, Vec3};
use penombre::scene::camera::{Camera, ImageSize, View};
use penombre::scene::light::LightKind;
use penombre::scene::load::{load, load_with};
use penombre::scene::report::Severity;
use penombre::scene::up_axis::UpAxis;
use std::f32::consts::PI;
use std::fmt::Write as _;
use std::path::Path;

/// An OBJ in the making.
#[derive(Clone, Default)]
struct Obj {
    text: String,
    vertices: usize,
}

impl Obj {
    /// A face with vertices of its own.
    fn face(mut self, corners: &[Vec3]) -> Self {
        let first = self.vertices + 1;
        corners.iter().for_each(|c| writeln!(self.text, "v {} {} {}", c.x, c.y, c.z).unwrap());
        self.vertices += corners.len();
        let listed: Vec<String> = (first..=self.vertices).map(|i| i.to_string()).collect();
        writeln!(self.text, "f {}", listed.join(" ")).unwrap();
        self
    }

    /// The sides of a box that are wanted: −x, +x, −y, +y, −z, +z.
    fn sides(self, lo: Vec3, hi: Vec3, wanted: [bool; 6]) -> Self {
        let corner = |k: usize| Vec3::select(glam::BVec3::new(k & 1 == 1, k & 2 == 2, k & 4 == 4), hi, lo);
        const SIDES: [[usize; 4]; 6] =
            [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
        let chosen = SIDES.iter().zip(wanted).filter(|(_, wanted)| *wanted);
        chosen.fold(self, |obj, (side, _)| obj.face(&side.map(corner)))
    }

    fn cuboid(self, lo: [f32; 3], hi: [f32; 3]) -> Self {
        self.sides(lo.into(), hi.into(), [true; 6])
    }

    /// A house of two parts, 4 × 4.5 × 4.
    fn house(self) -> Self {
        self.cuboid([-2., 0., -2.], [2., 3., 2.]).cuboid([-0.5, 3., -0.5], [0.5, 4.5, 0.5])
    }

    /// The upper half of a sphere about the origin, or all of it.
    fn dome(mut self, radius: f32, whole: bool) -> Self {
        const AROUND: i32 = 16;
        let lowest = if whole { -4 } else { 0 };
        let point = |ring: i32, k: i32| {
            let (y, r) = (ring as f32 * PI / 8.0).sin_cos();
            let (z, x) = (k as f32 * 2.0 * PI / AROUND as f32).sin_cos();
            Vec3::new(x * r, y, z * r) * radius
        };
        for ring in lowest..4 {
            for k in 0..AROUND {
                self = self.face(&[point(ring, k), point(ring, k + 1), point(ring + 1, k + 1), point(ring + 1, k)]);
            }
        }
        self
    }

    fn ground(self, half: f32) -> Self {
        self.face(&[[-1., 1.], [1., 1.], [1., -1.], [-1., -1.]].map(|[x, z]| Vec3::new(x * half, 0.0, z * half)))
    }

    fn speck(self, at: [f32; 3], size: f32) -> Self {
        self.face(&[Vec3::ZERO, Vec3::X, Vec3::Y].map(|c| c * size + Vec3::from(at)))
    }
}

/// Camera, position of the light, and what is said of the framing.
fn framed(obj: &Obj, up: Option<UpAxis>) -> (Camera, Vec3, String) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.obj");
    std::fs::write(&path, &obj.text).unwrap();
    let loaded = load_with(&path, up).unwrap();
    let said = loaded.report.lines(Severity::Warning).into_iter().find(|line| line.contains("no camera")).unwrap();
    let LightKind::Point { position, intensity } = loaded.scene.lights[0].kind else { panic!("no point light") };
    let camera = loaded.scene.cameras[0].camera;
    assert!((intensity.x / position.distance_squared(camera.look_at) / PI - 1.0).abs() < 1e-4);
    (camera, position, said)
}

/// Checks that an OBJ is framed as another is, and what is said.
#[track_caller]
fn framed_as(obj: &Obj, other: &Obj, left_out: &str) {
    let (expected, (camera, light, said)) = (framed(other, None), framed(obj, None));
    assert!(said.ends_with(&format!("; {left_out}: left out of the framing")), "{said}");
    assert!(camera.position.distance(expected.0.position) < 1e-3, "{camera:?}");
    assert!(camera.look_at.distance(expected.0.look_at) < 1e-3, "{camera:?}");
    assert!(light.distance(expected.1) < 1e-3, "{light}");
}

/// Checks that everything is framed as it always was: from outside the bounds.
#[track_caller]
fn whole(obj: &Obj, [lo, hi]: [[f32; 3]; 2]) {
    let (camera, _, said) = framed(obj, None);
    assert!(said.contains("framed the whole scene from"), "{said}");
    let (lo, hi) = (Vec3::from(lo), Vec3::from(hi));
    let distance = (hi - lo).length() * 0.5 / 20_f32.to_radians().sin();
    let position = (lo + hi) * 0.5 + Vec3::new(0.5, 0.35, 1.0).normalize() * distance;
    assert!(camera.look_at.distance((lo + hi) * 0.5) < 1e-3 * distance, "{camera:?}");
    assert!(camera.position.distance(position) < 1e-3 * distance, "{camera:?}");
}

#[test]
fn every_corner_of_the_bounds_is_in_the_image() {
    let obj = Obj::default().cuboid([-3., 10., 5.], [1., 11., 25.]);
    for up in [UpAxis::Y, UpAxis::Z] {
        let (camera, ..) = framed(&obj, Some(up));
        let clip = View::new(&camera, ImageSize { width: 300, height: 300 }, 20.0).clip_from_world(Vec2::ZERO);
        for k in 0..8 {
            let corner = [[-3., 1.], [10., 11.], [5., 25.]];
            let p = clip * Vec3::from([0, 1, 2].map(|axis| corner[axis][k >> axis & 1])).extend(1.0);
            assert!(p.w > 0.0 && (p.x / p.w).abs() <= 1.0 && (p.y / p.w).abs() <= 1.0, "{p}");
        }
    }
}

#[test]
fn what_lies_far_off_does_not_decide() {
    let house = Obj::default().house();
    let stray = house.clone().speck([7000., 0., 0.], 0.1);
    framed_as(&stray, &house, "1 of 3 parts lies far off");
    let strays = stray.speck([-300., 900., 2.], 0.1).speck([0., 0., -90.], 0.5);
    framed_as(&strays, &house, "3 of 5 parts lie far off");
}

#[test]
fn what_surrounds_the_rest_is_looked_at_from_inside() {
    let house = Obj::default().house();
    for (radius, whole) in [(500.0, false), (60.0, false), (500.0, true)] {
        framed_as(&house.clone().dome(radius, whole), &house, "1 of 3 parts surrounds the rest");
    }
    let all = house.clone().dome(500.0, true).dome(470.0, false).ground(480.0).speck([7e3, 0., 0.], 0.1);
    framed_as(&all, &house, "3 of 6 parts surround the rest and 1 of 6 parts lies far off");
    framed_as(&house.clone().ground(4000.0), &house, "1 of 3 parts surrounds the rest");
    // A dome so near that the camera would stand outside.
    let (camera, light, said) = framed(&house.clone().dome(15.0, true), None);
    assert!(said.contains("1 of 3 parts surrounds the rest"), "{said}");
    assert!(camera.position.length() < 14.8 && light.length() < 14.8, "{camera:?} {light}");
    // A closed room that only one table stands in.
    let room = Obj::default().cuboid([-4., 0., -3.], [4., 3., 3.]).cuboid([-1., 0., -0.5], [1., 0.8, 0.5]);
    let (camera, light, _) = framed(&room, None);
    for place in [camera.position, light] {
        assert!(place.abs().cmplt(Vec3::new(4.0, 3.0, 3.0)).all() && place.y > 0.0, "{place}");
    }
}

#[test]
fn ordinary_scenes_are_framed_whole() {
    let house = Obj::default().house();
    whole(&house.clone().ground(20.0), [[-20., 0., -20.], [20., 4.5, 20.]]);
    // A smaller thing aside, one as large far away, and a field of cards that do not touch.
    whole(&house.clone().cuboid([9., 0., 9.], [9.3, 1., 9.3]), [[-2., 0., -2.], [9.3, 4.5, 9.3]]);
    whole(&house.clone().cuboid([300., 0., 0.], [304., 4., 4.]), [[-2., 0., -2.], [304., 4.5, 4.]]);
    let cards =
        (0..400).fold(Obj::default(), |obj, i| obj.speck([(i % 20) as f32 * 9.0, 0.0, (i / 20) as f32 * 9.0], 0.1));
    whole(&cards, [[0., 0., 0.], [171.1, 0.1, 171.]]);
    // Rooms, open to the front and closed, with a table; a bottle with a pea.
    let (lo, hi) = ([-4., 0., -3.], [4., 3., 3.]);
    let open = Obj::default().sides(lo.into(), hi.into(), [true, true, true, true, true, false]);
    whole(&open.cuboid([-0.2, 0., -0.2], [0.2, 0.5, 0.2]), [lo, hi]);
    whole(&Obj::default().cuboid(lo, hi).cuboid([-2., 0., -0.5], [2., 0.8, 0.5]), [lo, hi]);
    let bottle = Obj::default().cuboid([-1., 0., -1.], [1., 8., 1.]);
    whole(&bottle.cuboid([-0.1, 0.1, -0.1], [0.1, 0.3, 0.1]), [[-1., 0., -1.], [1., 8., 1.]]);
}

#[test]
fn z_can_be_up() {
    let y_up = Obj::default().house().dome(500.0, false);
    let to_z_up = |p: Vec3| Vec3::new(p.x, -p.z, p.y);
    let lines = y_up.text.lines().map(|line| {
        let Some(v) = line.strip_prefix("v ") else { return format!("{line}\n") };
        let v: Vec<f32> = v.split(' ').map(|c| c.parse().unwrap()).collect();
        let p = to_z_up(Vec3::new(v[0], v[1], v[2]));
        format!("v {} {} {}\n", p.x, p.y, p.z)
    });
    let z_up = Obj { text: lines.collect(), vertices: y_up.vertices };
    let ((upright, light, _), (camera, turned, said)) = (framed(&y_up, None), framed(&z_up, Some(UpAxis::Z)));
    assert!(said.contains("1 of 3 parts surrounds the rest"), "{said}");
    assert_eq!((upright.up, camera.up), (Vec3::Y, Vec3::Z));
    assert!(camera.position.distance(to_z_up(upright.position)) < 1e-3, "{camera:?}");
    assert!(turned.distance(to_z_up(light)) < 1e-3, "{turned}");
}

#[test]
fn up_of_a_scene_file_is_in_the_file() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("a.obj"), "v 0 0 0\nv 1 0 0\nv 0 0 1\nf 1 2 3\n").unwrap();
    std::fs::write(folder.path().join("s.toml"), "[geometry]\nobj = \"a.obj\"\n").unwrap();
    let output = run(folder.path(), "reference s.toml -o r.exr --up z --spp 1 --size 8x8");
    assert_eq!(output.status.code(), Some(2));
    assert!(stderr(&output).contains("--up is for a bare OBJ: in s.toml, up = [x, y, z]"), "{}", stderr(&output));
    assert!(load(&folder.path().join("s.toml")).is_ok());
    let output = run(folder.path(), "reference a.obj -o r.exr --up z --spp 1 --size 8x8");
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
}

#[test]
fn the_model_in_a_dome_is_what_the_picture_shows() {
    if !has_device() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let house = Obj::default().house();
    let render = |name: &str, obj: &Obj| {
        std::fs::write(folder.path().join(format!("{name}.obj")), &obj.text).unwrap();
        let line = format!("render {name}.obj -o {name}.png --size 96x72 --deterministic --rays 60000 --direct-only");
        let output = run(folder.path(), &line);
        assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
        mean(&folder.path().join(format!("{name}.png")))
    };
    let alone = render("alone", &house);
    assert!(alone > 20.0, "{alone}");
    for (name, obj) in [("dome", house.clone().dome(500.0, false)), ("stray", house.speck([7e3, 0., 0.], 0.1))] {
        let shown = render(name, &obj);
        assert!((shown / alone - 1.0).abs() < 0.02, "{name}: {shown} {alone}");
    }
}

/// Mean of the displayed values, of 255.
fn mean(path: &Path) -> f32 {
    let (_, pixels) = penombre::image::png::read(path).unwrap();
    pixels.iter().flatten().map(|&v| f32::from(v)).sum::<f32>() / (3 * pixels.len()) as f32
}
