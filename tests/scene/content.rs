//! What light depends on: which edits of a scene change which key, and what is said of them.
#![allow(clippy::unwrap_used, reason = "in a test, a panic is how a failure shows")]

use penombre::scene::Scene;
use penombre::scene::content::Content;
use penombre::scene::load::load;

const OBJ: &str = "mtllib a.mtl
v 0 0 0\nv 4 0 0\nv 4 0 4\nv 0 0 4\nv 1 3 1\nv 2 3 1\nv 2 3 2
vt 0 0\nvt 1 0\nvt 1 1
usemtl floor\nf 1/1 4/2 3/3\nf 1/1 3/3 2/2
usemtl lamp\nf 5/1 6/2 7/3
";
const MTL: &str = "newmtl floor\nKd 0.5 0.5 0.5\nmap_Kd floor.png\nnewmtl lamp\nKd 0 0 0\nKe 10 10 10\n";
const TOML: &str = r#"[geometry]
obj = ["a.obj"]
[[camera]]
name = "main"
position = [2, 2, -5]
look_at = [2, 0, 2]
vertical_fov = 40
[display]
exposure = 1
[[light]]
name = "bulb"
kind = "point"
position = [1, 2, 1]
intensity = [3, 3, 3]
[[light]]
name = "sun"
kind = "directional"
direction = [0, -1, 0.5]
irradiance = [1, 1, 1]
[[light]]
name = "torch"
kind = "spot"
position = [2, 2, 3]
direction = [0, -1, 0]
inner_angle = 10
outer_angle = 30
intensity = [5, 5, 5]
"#;
/// The lights' places in the scene's order.
const BULB: u32 = 0;
const SUN: u32 = 1;
const TORCH: u32 = 2;
const LAMP: u32 = 3;

/// The scene with texts replaced in any of its files.
fn edited(edits: &[(&str, &str)]) -> Scene {
    let folder = tempfile::tempdir().unwrap();
    for (name, text) in [("a.obj", OBJ), ("a.mtl", MTL), ("a.toml", TOML)] {
        let text = edits.iter().fold(text.to_owned(), |text, (from, to)| text.replace(from, to));
        std::fs::write(folder.path().join(name), text).unwrap();
    }
    for (name, grey) in [("floor.png", 90), ("tiles.png", 120)] {
        image::RgbImage::from_pixel(4, 4, image::Rgb([grey; 3])).save(folder.path().join(name)).unwrap();
    }
    load(&folder.path().join("a.toml")).unwrap().scene
}

fn content(edits: &[(&str, &str)]) -> Content {
    Content::of(&edited(edits))
}

/// What of the light is as it was: shape, direct light of each light, indirect light.
fn kept(edits: &[(&str, &str)]) -> (bool, [bool; 4], bool) {
    let (before, now) = (content(&[]), content(edits));
    let direct = [BULB, SUN, TORCH, LAMP].map(|light| before.direct_key(&[light]) == now.direct_key(&[light]));
    let indirect = before.indirect_key("stratified") == now.indirect_key("stratified");
    assert_eq!(now.changes(&before).is_empty(), indirect, "what is outdated is told: {:?}", now.changes(&before));
    (before.shape_key() == now.shape_key(), direct, indirect)
}

/// What is said of an edit.
fn said(edits: &[(&str, &str)]) -> Vec<String> {
    content(edits).changes(&content(&[]))
}

#[test]
fn cameras_display_and_names_make_no_difference() {
    let all = (true, [true; 4], true);
    for edit in [
        ("", ""),
        ("[2, 2, -5]", "[2, 3, -9]"),
        ("vertical_fov = 40", "vertical_fov = 60"),
        ("exposure = 1", "exposure = -3"),
        ("\"torch\"", "\"flashlight\""),
    ] {
        assert_eq!(kept(&[edit]), all, "{edit:?}");
    }
    assert_eq!(kept(&[("floor\n", "ground\n"), ("newmtl floor", "newmtl ground")]), all);
}

#[test]
fn power_and_colour_of_a_light_of_one_direction_leave_its_direct_light() {
    for edit in
        [("[3, 3, 3]", "[9, 1, 0]"), ("irradiance = [1, 1, 1]", "irradiance = [2, 2, 2]"), ("[5, 5, 5]", "[6, 6, 6]")]
    {
        assert_eq!(kept(&[edit]), (true, [true; 4], false), "{edit:?}");
    }
    assert_eq!(
        said(&[("[3, 3, 3]", "[9, 1, 0]"), ("[5, 5, 5]", "[6, 6, 6]")]),
        ["lights 'bulb', 'torch': another power; direct light is used, indirect light is computed anew"]
    );
}

#[test]
fn a_light_that_moves_or_emits_otherwise_takes_its_own_layer_along() {
    let only = |light: u32| [BULB, SUN, TORCH, LAMP].map(|other| other != light);
    assert_eq!(kept(&[("[1, 2, 1]", "[1, 2, 1.5]")]), (true, only(BULB), false));
    assert_eq!(kept(&[("[0, -1, 0.5]", "[0, -1, 0.6]")]), (true, only(SUN), false));
    assert_eq!(kept(&[("outer_angle = 30", "outer_angle = 31")]), (true, only(TORCH), false));
    // Sums over points of an area light hold what it emits.
    assert_eq!(kept(&[("Ke 10 10 10", "Ke 20 20 20")]), (true, only(LAMP), false));
    assert_eq!(
        said(&[("[1, 2, 1]", "[1, 2, 1.5]")]),
        ["light 'bulb': changed; its direct light and indirect light are computed anew"]
    );
}

#[test]
fn materials_and_textures_leave_direct_light() {
    for (edit, told) in [
        (("Kd 0.5 0.5 0.5", "Kd 0.5 0.4 0.5"), "material 'floor': changed; indirect light is computed anew"),
        (("floor.png", "tiles.png"), "tiles.png': changed; indirect light is computed anew"),
        (("vt 1 1", "vt 1 2"), "what surfaces look like: changed; indirect light is computed anew"),
    ] {
        assert_eq!(kept(&[edit]), (true, [true; 4], false), "{edit:?}");
        let said = said(&[edit]);
        assert!(said.len() == 1 && said[0].ends_with(told), "{said:?}");
    }
}

#[test]
fn geometry_takes_all_along() {
    for edit in [
        ("v 4 0 4", "v 4 0.1 4"),
        ("f 5/1 6/2 7/3", "f 5/1 7/3 6/2"),
        // A hole, and a highlight that the others do not have: what shares vertices is another.
        ("map_Kd floor.png", "map_Kd floor.png\nmap_d tiles.png"),
        ("Kd 0.5 0.5 0.5", "Kd 0.5 0.5 0.5\nKs 0.2 0.2 0.2\nNs 20"),
    ] {
        let (shape, direct, indirect) = kept(&[edit]);
        assert_eq!((shape, direct, indirect), (false, [false; 4], false), "{edit:?}");
    }
    let more = said(&[("f 5/1 6/2 7/3", "f 5/1 6/2 7/3\nusemtl floor\nf 5/1 1/2 2/3")]);
    assert_eq!(more, ["geometry: changed (3 triangles, now 4); all light is computed anew"]);
    // How bright a highlight is does not tell what shares vertices.
    let glossy = |ks: &'static str| ("Kd 0.5 0.5 0.5", ks);
    let [dim, bright] = ["Ks 0.1 0.1 0.1\nNs 20", "Ks 0.2 0.2 0.2\nNs 30"].map(|ks| content(&[glossy(ks)]));
    assert!(dim.shape_key() == bright.shape_key() && dim.indirect_key("") != bright.indirect_key(""));
}

#[test]
fn lights_that_come_and_go_leave_the_others() {
    let sun_only = TOML.split("[[light]]").nth(2).map(|light| format!("[[light]]{light}")).unwrap();
    let (before, now) = (content(&[]), content(&[(&*sun_only, "")]));
    assert_eq!(before.direct_key(&[TORCH]), now.direct_key(&[TORCH - 1]));
    assert_eq!(now.changes(&before), ["light 'sun': gone; indirect light is computed anew"]);
    assert_eq!(before.changes(&now), ["light 'sun': new; indirect light is computed anew"]);
}

#[test]
fn groups_and_methods_have_keys_of_their_own() {
    let (before, brighter) = (content(&[]), content(&[("[3, 3, 3]", "[9, 9, 9]")]));
    let both = [BULB, TORCH];
    assert_ne!(before.direct_key(&both), before.direct_key(&[TORCH]));
    // What is visible of a group depends on what its lights emit beside each other.
    assert_ne!(before.direct_key(&both), brighter.direct_key(&both));
    assert_ne!(before.indirect_key("stratified"), before.indirect_key("adaptive"));
}

#[test]
fn the_earlier_scene_with_the_most_in_common_is_found() {
    let now = content(&[]);
    let power = content(&[("[3, 3, 3]", "[9, 1, 0]")]);
    let moved = content(&[("v 4 0 4", "v 4 0.1 4")]);
    assert!(now.in_common(&now) > now.in_common(&power) && now.in_common(&power) > now.in_common(&moved));
}

#[test]
fn contents_come_back_from_notes() {
    let now = content(&[]);
    let note = serde_json::to_vec(&now).unwrap();
    assert_eq!(serde_json::from_slice::<Content>(&note).unwrap(), now);
}
