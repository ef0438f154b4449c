//! Textures under names of another machine, another system or another folder.

#![allow(clippy::expect_used, reason = "a test may end where its files cannot be written")]

use glam::Vec3;
use penombre::scene::TriangleId;
use penombre::scene::load::{Loaded, load};
use std::path::Path;

/// One triangle whose diffuse texture has this name, in the folder `models` beside the texture `file`.
fn load_named(name: &[u8], file: &str) -> Loaded {
    let folder = tempfile::tempdir().expect("a temporary directory");
    let models = folder.path().join("models");
    let path = models.join(file);
    std::fs::create_dir_all(&models).expect("a folder");
    std::fs::create_dir_all(path.parent().unwrap_or(Path::new("."))).expect("a folder");
    let green = image::RgbImage::from_pixel(1, 1, image::Rgb([0, 255, 0]));
    green.save(path).expect("a written image");
    let mtl = [b"newmtl a\nKd 1\nmap_Kd ", name, b"\n"].concat();
    std::fs::write(models.join("a.mtl"), mtl).expect("a written file");
    std::fs::write(models.join("a.obj"), "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl a\nf 1 2 3\n")
        .expect("a written file");
    load(&models.join("a.obj")).unwrap_or_else(|e| panic!("{e}"))
}

/// Whether the triangle has the texture's colour, and what is said of the texture.
fn result(name: &[u8], file: &str) -> (bool, Vec<String>) {
    let loaded = load_named(name, file);
    let said = loaded.report.collapsed().into_iter().filter(|line| line.contains("a.mtl")).collect();
    (loaded.scene.kd_at(TriangleId(0), 0.3, 0.3) == Vec3::Y, said)
}

#[test]
fn textures_are_found_by_their_names() {
    for (name, file) in [
        ("wood.png", "wood.png"),
        ("C:\\Users\\someone\\project\\textures\\wood.png", "textures/wood.png"),
        ("/home/someone/project/textures/wood.png", "textures/wood.png"),
        ("/home/someone/wood.png", "../textures/wood.png"),
        ("file:///C:/project/textures/wood.png", "Textures/wood.png"),
        ("wood.png", "maps/Wood.PNG"),
        ("wood%20oak.png", "wood oak.png"),
        ("wood oak.png", "wood oak.png"),
        ("100%_wool.png", "100%_wool.png"),
        ("Cafe\u{301}_sol.png", "Caf\u{e9}_sol.png"),
        ("Caf\u{e9}_sol.png", "Cafe\u{301}_sol.png"),
        ("\u{6728}\u{7eb9}.png", "textures/\u{6728}\u{7eb9}.png"),
    ] {
        assert_eq!(result(name.as_bytes(), file), (true, vec![]), "{name} for {file}");
    }
    assert_eq!(result(b"Gr\xfcn.png", "Gr\u{fc}n.png"), (true, vec![]), "a name in Latin-1");
}

#[test]
fn another_format_is_taken_with_a_warning() {
    let (is_found, said) = result(b"textures/wood.tga", "textures/wood.png");
    assert!(is_found && said.len() == 1, "{said:?}");
    assert!(
        said[0].contains("a.mtl:3: warning")
            && said[0].contains("\"textures/wood.tga\"")
            && said[0].contains("wood.png is used")
    );
    // The file may be in use under its own name, too.
    let (_, said) = result(b"textures/wood.png\nnewmtl b\nmap_Kd textures/wood.tga", "textures/wood.png");
    assert!(said.is_empty(), "no face uses b: {said:?}");
    let (is_found, said) = result(b"textures/wood.png\nmap_Ke textures/wood.tga", "textures/wood.png");
    assert!(is_found && said.len() == 1, "{said:?}");
    let (is_found, said) = result(b"gone.tga", "textures/wood.png");
    assert!(!is_found && said.len() == 1 && said[0].contains("there is no file \"gone.tga\""), "{said:?}");
}
