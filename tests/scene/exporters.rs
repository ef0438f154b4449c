//! OBJ and MTL files as other programs write them: what they mean is what is loaded, and one line says what was left out.

#![allow(clippy::expect_used, reason = "a test may end where its files cannot be written")]

use glam::Vec3;
use penombre::scene::TriangleId;
use penombre::scene::load::{Loaded, load};
use penombre::scene::report::Severity;
use std::path::Path;

/// A square of each of the materials that `mtl` defines, side by side, in that order.
fn squares(mtl: &str) -> String {
    let names = mtl.lines().filter_map(|line| line.strip_prefix("newmtl "));
    let square = |(k, name): (usize, &str)| {
        let [x, y] = [k, k + 1];
        format!("v {x} 0 0\nv {y} 0 0\nv {y} 1 0\nv {x} 1 0\nusemtl {name}\nf -4/1 -3/2 -2/3 -1/4\n")
    };
    let all: String = names.enumerate().map(square).collect();
    format!("mtllib a.mtl\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n{all}")
}

fn write(folder: &Path, name: &str, content: impl AsRef<[u8]>) {
    std::fs::write(folder.join(name), content).expect("a temporary file");
}

/// An image of one colour.
fn image(folder: &Path, name: &str, colour: [u8; 4]) {
    image::RgbaImage::from_pixel(2, 2, image::Rgba(colour)).save(folder.join(name)).expect("a written image");
}

fn load_in(folder: &Path) -> Loaded {
    load(&folder.join("a.obj")).unwrap_or_else(|e| panic!("{e}"))
}

/// The scene of [`squares`], in which red.png is an image.
fn load_mtl(mtl: &str) -> Loaded {
    let folder = tempfile::tempdir().expect("a temporary directory");
    image(folder.path(), "red.png", [255, 0, 0, 255]);
    write(folder.path(), "a.mtl", mtl);
    write(folder.path(), "a.obj", squares(mtl));
    load_in(folder.path())
}

/// What is said of MTL files, collapsed, without places and without what a bare OBJ gets.
fn said(loaded: &Loaded) -> Vec<String> {
    let lines = loaded.report.collapsed();
    let message = |line: &String| line.split_once("warning: ").map_or(line.clone(), |(_, message)| message.to_owned());
    lines.iter().map(message).filter(|m| !m.starts_with("no camera") && !m.starts_with("no light")).collect()
}

/// The diffuse reflectance of each drawn square, by the name of its material.
fn drawn(loaded: &Loaded) -> Vec<(String, Vec3)> {
    let scene = &loaded.scene;
    let squares = (0..scene.triangles.len()).step_by(2).map(|t| TriangleId(t as u32));
    squares.map(|t| (scene.material(t).name.clone(), scene.kd_at(t, 0.25, 0.25))).collect()
}

fn names(loaded: &Loaded) -> Vec<String> {
    drawn(loaded).into_iter().map(|(name, _)| name).collect()
}

#[test]
fn models_of_glass_are_opaque_unless_something_says_glass() {
    let loaded = load_mtl(
        "newmtl maya\nillum 4\nKd 0.6\nTf 1.00 1.00 1.00\nNi 1.00\nnewmtl c4d\nillum 7\nd 1\nKd 0.5\nNi 1\nKs 0.5\nNs 18\n\
         newmtl nine\nillum 9\nd 1.0\nKd 0.2\nnewmtl veil\nillum 4\nKd 0.2\nd 0.5\n\
         newmtl green\nillum 7\nKd 0.1\nTf 0.1\nNi 1.5\nnewmtl clear\nillum 7\nKd 0 0 0\nKs 1 1 1\nNs 10000\nNi 1.5\nTf 1 1 1\n",
    );
    assert_eq!(names(&loaded), ["maya", "c4d", "nine"]);
    assert_eq!(loaded.counts.see_through, 6);
    let said = said(&loaded);
    assert_eq!(said.len(), 2, "{said:?}");
    assert!(said[0].starts_with("material veil: d 0.5") && said[1].starts_with("materials green, clear: illum 7"));
}

#[test]
fn zero_opacity_almost_everywhere_is_the_opposite_convention() {
    for opacity in ["d 0.0", "Tr 1.000000"] {
        let loaded =
            load_mtl(&format!("newmtl a\nKd 0.6\n{opacity}\nnewmtl b\nKd 0.2\n{opacity}\nnewmtl c\nKd 0.5\nd 1\n"));
        assert_eq!(names(&loaded), ["a", "b", "c"], "{opacity}");
        let said = said(&loaded);
        assert_eq!(said.len(), 1, "one warning for the file: {said:?}");
        assert!(said[0].contains("2 of 3 materials"), "{said:?}");
    }
    let loaded = load_mtl("newmtl a\nKd 0.6\nnewmtl gone\nKd 0.2\nd 0\nnewmtl c\nKd 0.5\n");
    assert_eq!(names(&loaded), ["a", "c"], "one of three is meant as it is written");
}

#[test]
fn nothing_to_draw_never_comes_of_a_convention() {
    let folder = tempfile::tempdir().expect("a temporary directory");
    let mtl = "newmtl a\nd 0\nKd 0.3\nnewmtl b\nnewmtl c\nnewmtl d\n";
    write(folder.path(), "a.mtl", mtl);
    // `b` is named, but no face uses it.
    write(folder.path(), "a.obj", "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl b\nusemtl a\nf 1 2 3\n");
    let loaded = load_in(folder.path());
    assert_eq!(loaded.counts.drawn, 1);
    assert!(said(&loaded)[0].contains("d 0 or Tr 1 in 1 of 4 materials"), "{:?}", said(&loaded));
}

#[test]
fn a_red_model_stays_red() {
    let red = "Kd 0.8 0.1 0.1\n";
    let loaded = load_mtl(&format!(
        "newmtl plain\n{red}newmtl zero\n{red}Ks 1 1 1\nNs 0\nillum 2\nnewmtl none\n{red}Ks 1 1 1\nnewmtl third\n{red}Ks 0.33\n\
         newmtl mirror\n{red}Ks 0.1\nillum 3\nnewmtl gloss\n{red}Ks 0.1\nNs 96\n"
    ));
    assert!(drawn(&loaded).iter().all(|(_, kd)| *kd == Vec3::new(0.8, 0.1, 0.1)), "{:?}", drawn(&loaded));
    let glossy: Vec<_> = loaded.scene.materials.iter().map(penombre::scene::material::Material::is_glossy).collect();
    assert_eq!(glossy, [false, false, false, false, true, true]);
    let said = said(&loaded);
    assert!(said[0].starts_with("materials zero, none, third: Ks without Ns"), "{said:?}");
    assert_eq!(said.len(), 2, "and the mirror: {said:?}");
}

#[test]
fn options_after_the_name_and_comments_keep_the_texture() {
    let loaded = load_mtl(
        "newmtl after\nmap_Kd red.png -bm 1 -s 1 1 1\nnewmtl comment\nmap_Kd red.png # diffuse\nnewmtl named # a comment\nKd 0 1 0\n\
         newmtl quoted\nmap_Kd -bm 1 \"red.png\" # \"old.png\"\nnewmtl Material #25\nKd 0 0 1\nnewmtl commas\nKd 0, 0.25, 1\n",
    );
    let colours: Vec<Vec3> = drawn(&loaded).into_iter().map(|(_, kd)| kd).collect();
    let expected = [Vec3::X, Vec3::X, Vec3::Y, Vec3::X, Vec3::Z, Vec3::new(0.0, 0.25, 1.0)];
    assert_eq!(colours, expected);
    assert_eq!(names(&loaded)[2..5], ["named", "quoted", "Material #25"]);
    assert_eq!(said(&loaded), ["commas between numbers are read as blanks"]);
}

#[test]
fn a_name_may_hold_what_looks_like_a_comment() {
    let folder = tempfile::tempdir().expect("a temporary directory");
    image(folder.path(), "a.png", [255, 0, 0, 255]);
    image(folder.path(), "a #b.png", [0, 255, 0, 255]);
    let mtl = "newmtl a\nmap_Kd a #b.png\n";
    write(folder.path(), "a.mtl", mtl);
    // The comment is the OBJ's.
    write(folder.path(), "a.obj", squares(mtl).replace("usemtl a", "usemtl a # first"));
    assert_eq!(drawn(&load_in(folder.path())), [("a".to_owned(), Vec3::Y)]);
}

#[test]
fn maps_with_black_factors_show() {
    let loaded = load_mtl(
        "newmtl kd0\nKd 0 0 0\nmap_Kd red.png\nnewmtl missing\nKd 0 0 0\nmap_Kd gone.png\nnewmtl ke0\nKd 0.1\nKe 0 0 0\nmap_Ke red.png\n\
         newmtl ambient\nKa 1 1 1\nmap_Ka red.png\nnewmtl both\nmap_Kd red.png\nmap_Ka red.png\n",
    );
    let colours: Vec<Vec3> = drawn(&loaded).into_iter().map(|(_, kd)| kd).collect();
    assert_eq!(colours, [Vec3::X, Vec3::splat(0.8), Vec3::splat(0.1), Vec3::X, Vec3::X]);
    let emits: Vec<_> = loaded.scene.materials.iter().map(|m| m.is_emissive()).collect();
    assert_eq!(emits, [false, false, true, false, false]);
    let said = said(&loaded);
    for what in ["kd0: Kd 0", "missing: Kd is 0", "ke0: Ke 0", "ambient: map_Ka", "no file \"gone.png\""] {
        assert_eq!(said.iter().filter(|line| line.contains(what)).count(), 1, "{what}: {said:?}");
    }
    assert_eq!(said.len(), 5, "{said:?}");
}

#[test]
fn map_opacity_is_a_mask() {
    let folder = tempfile::tempdir().expect("a temporary directory");
    image(folder.path(), "black.png", [0, 0, 0, 255]);
    let mtl = "newmtl a\nmap_opacity black.png\nnewmtl b\nmap_d black.png\nnewmtl c\n";
    write(folder.path(), "a.mtl", mtl);
    write(folder.path(), "a.obj", squares(mtl));
    let scene = load_in(folder.path()).scene;
    let opaque: Vec<_> = [0, 2, 4].iter().map(|&t| scene.is_opaque_at(TriangleId(t), 0.3, 0.3)).collect();
    assert_eq!(opaque, [false, false, true]);
}

#[test]
fn options_place_the_texture_and_choose_the_mask() {
    let folder = tempfile::tempdir().expect("a temporary directory");
    // Left half red, cut out by alpha; right half green.
    let halves =
        image::RgbaImage::from_fn(64, 2, |x, _| image::Rgba(if x < 32 { [255, 0, 0, 0] } else { [0, 255, 0, 255] }));
    halves.save(folder.path().join("h.png")).expect("a written image");
    let mtl = "newmtl plain\nmap_Kd h.png\nmap_d -imfchan l h.png\nnewmtl scaled\nmap_Kd -s 2 1 1 h.png\nnewmtl moved\nmap_Kd h.png -o 0.5\n\
               newmtl clamped\nmap_Kd -s 4 4 -clamp on h.png\nnewmtl red\nmap_d -imfchan r h.png\n";
    write(folder.path(), "a.mtl", mtl);
    write(folder.path(), "a.obj", squares(mtl));
    let loaded = load_in(folder.path());
    let at = |square: u32, u: f32| {
        // On the first triangle of a square, whose corners have u of 0, 1, 1.
        let (t, v) = (TriangleId(2 * square), 0.1);
        (loaded.scene.kd_at(t, u - v, v), loaded.scene.is_opaque_at(t, u - v, v))
    };
    let (red, green) = (Vec3::X, Vec3::Y);
    assert_eq!([at(0, 0.3), at(0, 0.7)], [(red, false), (green, true)]);
    assert_eq!(
        [at(1, 0.2), at(1, 0.4), at(1, 0.7), at(1, 0.9)],
        [(red, false), (green, true), (red, false), (green, true)]
    );
    assert_eq!([at(2, 0.3), at(2, 0.7)], [(green, true), (red, false)]);
    assert_eq!(
        [at(3, 0.11), at(3, 0.2), at(3, 0.4), at(3, 0.9)],
        [(red, false), (green, true), (green, true), (green, true)]
    );
    assert_eq!([at(4, 0.3).1, at(4, 0.7).1], [true, false], "the mask is red");
    assert!(said(&loaded).is_empty(), "{:?}", said(&loaded));
}

#[test]
fn the_first_library_named_counts() {
    let folder = tempfile::tempdir().expect("a temporary directory");
    write(folder.path(), "first.mtl", "newmtl paint\nKd 1 0 0\nnewmtl twice\nKd 0\nnewmtl twice\nKd 0 1 0\n");
    write(folder.path(), "second.mtl", "newmtl paint\nKd 0 0 1\nnewmtl other\nKd 0 0 1\nnewmtl twice\nKd 0 1 0\n");
    let squares = squares("newmtl paint\nnewmtl other\nnewmtl twice\n");
    for libraries in ["mtllib first.mtl second.mtl", "mtllib first.mtl # the first\nmtllib second.mtl"] {
        write(folder.path(), "a.obj", squares.replace("mtllib a.mtl", libraries));
        let loaded = load_in(folder.path());
        let colours: Vec<Vec3> = drawn(&loaded).into_iter().map(|(_, kd)| kd).collect();
        assert_eq!(colours, [Vec3::X, Vec3::Z, Vec3::Y], "{libraries}");
        let about: Vec<_> = said(&loaded).into_iter().filter(|line| line.starts_with("material paint")).collect();
        assert_eq!(about.len(), 1, "{about:?}");
        assert!(!said(&loaded).iter().any(|line| line.starts_with("material twice: that of")), "they are alike");
    }
}

#[test]
fn maps_that_are_not_supported_are_one_warning() {
    let loaded = load_mtl(
        "newmtl bump\nKd 0.8\nmap_Bump -bm 1 gone.png\nnewmtl again\nKd 0.7\nmap_Bump gone too.png\nnewmtl norm\nnorm red.png\n\
         newmtl many\nKd 0.5\nKs 0.4\nNs 30\nmap_Ks red.png\nmap_Pr red.png\nPr 0.2\nnewmtl pbr\nPr 0.2\nPm 0\n\
         newmtl plain\nKa 1 1 1\nTf 0.1\nNi 1.5\nsharpness 60\n",
    );
    let what = "not supported yet and not used:";
    assert_eq!(
        said(&loaded),
        [
            format!("materials bump, again: {what} bump map (map_Bump)"),
            format!("material many: {what} specular map (map_Ks)"),
        ]
    );
}

#[test]
fn texture_options_without_effect_are_one_warning() {
    let loaded = load_mtl(
        "newmtl a\nmap_Kd -blendu off -boost 2 red.png -t 1\nmap_Ke red.png -boost 2\nnewmtl b\nmap_Kd -bm 1 -texres 64 red.png\n",
    );
    assert_eq!(said(&loaded), ["material a: texture options that are not used: -blendu, -boost, -t"]);
    assert!(loaded.report.lines(Severity::Error).is_empty());
}
