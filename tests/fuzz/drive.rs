//! Feeds bytes to one of the readers, as a file among sound ones: it may refuse them, and must end. Shared by the fuzz targets and by
//! the test that goes through their corpora.
#![allow(clippy::expect_used, reason = "a failed expectation fails the test")]

use penombre::error::Error;
use penombre::image::{exr, png};
use penombre::scene::camera_path::load_camera_path;
use penombre::scene::load::load;
use std::cell::RefCell;
use std::fs;
use std::path::{Path, PathBuf};

/// The targets, by name.
#[allow(dead_code, reason = "each user takes its own part")]
pub const TARGETS: [&str; 8] = ["scene_file", "obj", "mtl", "texture", "exr", "camera_path", "gltf", "lamp"];

const OBJ: &str = "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 1\nvt 0 0\nvt 1 0\nvt 0 1\nvn 0 0 1\nusemtl m\nf 1/1/1 2/2/1 3/3/1\n\
    usemtl n\nf 2/2 4/3 3/1\n";
const MTL: &str = "newmtl m\nKd 0.5 0.4 0.3\nKs 0.1 0.1 0.1\nNs 20\nnewmtl n\nKd 0.2 0.2 0.2\nKe 1 1 1\n";
const LAMP: &str = "[[light]]\nkind = \"point\"\nposition = [0, 2, 0]\nflux = 100\n";

/// A folder in memory with what targets find beside their bytes.
struct Folder(tempfile::TempDir);

impl Folder {
    fn new() -> Self {
        let in_memory = Path::new("/dev/shm");
        let folder = if in_memory.is_dir() { tempfile::tempdir_in(in_memory) } else { tempfile::tempdir() };
        let folder = Self(folder.expect("a folder"));
        folder.write("sound.obj", OBJ.as_bytes());
        folder.write("a.mtl", MTL.as_bytes());
        folder
    }

    fn at(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn write(&self, name: &str, bytes: &[u8]) -> PathBuf {
        fs::write(self.at(name), bytes).expect("a file");
        self.at(name)
    }
}

thread_local!(static FOLDER: RefCell<Option<Folder>> = const { RefCell::new(None) });

/// Feeds bytes to a target; panics if it does what it must not.
pub fn drive(target: &str, bytes: &[u8]) {
    FOLDER.with_borrow_mut(|folder| feed(folder.get_or_insert_with(Folder::new), target, bytes));
}

fn feed(folder: &Folder, target: &str, bytes: &[u8]) {
    match target {
        "scene_file" => scene(&folder.write("a.toml", bytes)),
        "obj" => scene(&folder.write("a.obj", bytes)),
        "mtl" => {
            folder.write("fed.mtl", bytes);
            scene(&folder.write("b.obj", OBJ.replace("a.mtl", "fed.mtl").as_bytes()));
        }
        "texture" => texture(folder, bytes),
        "exr" => image(folder, bytes),
        "camera_path" => refused_or_read(load_camera_path(&folder.write("walk.toml", bytes), Default::default())),
        "gltf" => scene(&folder.write(if bytes.starts_with(b"glTF") { "a.glb" } else { "a.gltf" }, bytes)),
        "lamp" => {
            let name = if bytes.starts_with(b"IES") { "lamp.ies" } else { "lamp.ldt" };
            folder.write(name, bytes);
            let text = format!("[geometry]\nobj = [\"sound.obj\"]\n{LAMP}photometry = \"{name}\"\n");
            scene(&folder.write("lamp.toml", text.as_bytes()));
        }
        other => panic!("no target is called {other}"),
    }
}

/// As a texture of the kind that it begins like, and of every use.
fn texture(folder: &Folder, bytes: &[u8]) {
    let name = match bytes {
        [0x89, ..] => "t.png",
        [0xff, ..] => "t.jpg",
        [b'#', ..] => "t.hdr",
        [b'B', ..] => "t.bmp",
        [0x76, ..] => "t.exr",
        _ => "t.tga",
    };
    folder.write(name, bytes);
    let mtl = format!(
        "newmtl m\nmap_Kd {name}\nmap_d {name}\nnewmtl n\nKe 1 1 1\nmap_Ke {name}\nnorm {name}\nPr 0.5\nPm 0.5\nmap_Pm {name}\n"
    );
    folder.write("fed.mtl", mtl.as_bytes());
    scene(&folder.write("b.obj", OBJ.replace("a.mtl", "fed.mtl").as_bytes()));
}

/// As an image to compare with.
fn image(folder: &Folder, bytes: &[u8]) {
    if bytes.starts_with(&[0x89]) {
        refused_or_read(png::read(&folder.write("i.png", bytes)));
    } else {
        refused_or_read(exr::read_rgb(&folder.write("i.exr", bytes)));
    }
}

fn refused_or_read<T>(read: Result<T, Error>) {
    match read {
        Err(Error::Input(report)) => assert!(report.has_errors(), "refused without a reason"),
        Ok(_) | Err(Error::Usage(_)) => {}
        Err(other) => panic!("{other}"),
    }
}

/// Loads a scene, which must keep its promises.
fn scene(path: &Path) {
    let loaded = match load(path) {
        Ok(loaded) => loaded,
        Err(refused) => return refused_or_read::<()>(Err(refused)),
    };
    let scene = &loaded.scene;
    assert!(!scene.triangles.is_empty() && !loaded.report.has_errors());
    assert!(!scene.cameras.is_empty());
    assert!(scene.positions.iter().all(|p| p.is_finite()), "positions");
    assert!(scene.normals.iter().flatten().all(|n| n.is_normalized()), "normals");
    assert!(scene.uvs.iter().flatten().all(|uv| uv.is_finite()), "texture coordinates");
    assert!(scene.triangles.iter().flatten().all(|&i| (i as usize) < scene.positions.len()), "indices");
    for m in &scene.materials {
        let values = [m.kd, m.ke, m.phong().ks];
        assert!(values.iter().all(|v| v.is_finite() && v.min_element() >= 0.0), "{m:?}");
        assert!((m.kd + m.phong().ks).max_element() <= 1.0 && m.phong().shininess.is_finite(), "{m:?}");
    }
}
