//! The Cornell box from the measurements of the Cornell Program of Computer Graphics.

use super::File;
use super::toml::{Camera, SceneFile};
use glam::DVec3;
use std::fmt::Write;

/// A quadrilateral as the data page lists it, in its units (about a millimetre).
type Quad = [[f64; 3]; 4];

/// A part of the box: OBJ group, material, quadrilaterals, and a point that every one of them faces (`true`) or turns away from.
struct Part {
    name: &'static str,
    material: &'static str,
    quads: &'static [Quad],
    point: DVec3,
    towards: bool,
}

/// A point inside the room.
const ROOM: DVec3 = DVec3::new(278.0, 274.4, 279.6);

/// How far below the ceiling the lamp hangs: the page puts both at 548.8, where they would fight for the same pixels.
const LAMP_DROP: f64 = 0.1;

const SHORT_BLOCK: [Quad; 5] = [
    [[130.0, 165.0, 65.0], [82.0, 165.0, 225.0], [240.0, 165.0, 272.0], [290.0, 165.0, 114.0]],
    [[290.0, 0.0, 114.0], [290.0, 165.0, 114.0], [240.0, 165.0, 272.0], [240.0, 0.0, 272.0]],
    [[130.0, 0.0, 65.0], [130.0, 165.0, 65.0], [290.0, 165.0, 114.0], [290.0, 0.0, 114.0]],
    [[82.0, 0.0, 225.0], [82.0, 165.0, 225.0], [130.0, 165.0, 65.0], [130.0, 0.0, 65.0]],
    [[240.0, 0.0, 272.0], [240.0, 165.0, 272.0], [82.0, 165.0, 225.0], [82.0, 0.0, 225.0]],
];

const TALL_BLOCK: [Quad; 5] = [
    [[423.0, 330.0, 247.0], [265.0, 330.0, 296.0], [314.0, 330.0, 456.0], [472.0, 330.0, 406.0]],
    [[423.0, 0.0, 247.0], [423.0, 330.0, 247.0], [472.0, 330.0, 406.0], [472.0, 0.0, 406.0]],
    [[472.0, 0.0, 406.0], [472.0, 330.0, 406.0], [314.0, 330.0, 456.0], [314.0, 0.0, 456.0]],
    [[314.0, 0.0, 456.0], [314.0, 330.0, 456.0], [265.0, 330.0, 296.0], [265.0, 0.0, 296.0]],
    [[265.0, 0.0, 296.0], [265.0, 330.0, 296.0], [423.0, 330.0, 247.0], [423.0, 0.0, 247.0]],
];

const LAMP_Y: f64 = 548.8 - LAMP_DROP;

const PARTS: [Part; 8] = [
    room("floor", "white", &[[[552.8, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 559.2], [549.6, 0.0, 559.2]]]),
    room("ceiling", "white", &[[[556.0, 548.8, 0.0], [556.0, 548.8, 559.2], [0.0, 548.8, 559.2], [0.0, 548.8, 0.0]]]),
    room("back_wall", "white", &[[[549.6, 0.0, 559.2], [0.0, 0.0, 559.2], [0.0, 548.8, 559.2], [556.0, 548.8, 559.2]]]),
    room("right_wall", "green", &[[[0.0, 0.0, 559.2], [0.0, 0.0, 0.0], [0.0, 548.8, 0.0], [0.0, 548.8, 559.2]]]),
    room("left_wall", "red", &[[[552.8, 0.0, 0.0], [549.6, 0.0, 559.2], [556.0, 548.8, 559.2], [556.0, 548.8, 0.0]]]),
    room(
        "lamp",
        "lamp",
        &[[[343.0, LAMP_Y, 227.0], [343.0, LAMP_Y, 332.0], [213.0, LAMP_Y, 332.0], [213.0, LAMP_Y, 227.0]]],
    ),
    Part {
        name: "short_block",
        material: "white",
        quads: &SHORT_BLOCK,
        point: DVec3::new(185.5, 82.5, 169.0),
        towards: false,
    },
    Part {
        name: "tall_block",
        material: "white",
        quads: &TALL_BLOCK,
        point: DVec3::new(368.5, 165.0, 351.25),
        towards: false,
    },
];

const fn room(name: &'static str, material: &'static str, quads: &'static [Quad]) -> Part {
    Part { name, material, quads, point: ROOM, towards: true }
}

const MTL: &str = "# The Cornell box: reflectances and lamp of the measured spectra as linear Rec.709 RGB, the set that renderers commonly use.
# Written by make-scenes; MIT OR Apache-2.0.

newmtl white
Kd 0.725 0.71 0.68
illum 1

newmtl red
Kd 0.63 0.065 0.05
illum 1

newmtl green
Kd 0.14 0.45 0.091
illum 1

newmtl lamp
Kd 0.78 0.78 0.78
Ke 17 12 4
illum 1
";

const TITLE: &str = "The Cornell box, after https://www.graphics.cornell.edu/online/box/data.html
Geometry in the page's units (about a millimetre); its camera: (278, 273, -800) looking along +z, focal length
0.035 and film 0.025 x 0.025, so 2 atan(0.0125 / 0.035) = 39.31 degrees. Written by make-scenes.";

/// The scene's files, in `cornell_box/`.
pub fn files() -> Vec<File> {
    let camera = Camera("main", DVec3::new(278.0, 273.0, -800.0), DVec3::new(278.0, 273.0, 0.0), 39.31);
    let scene = SceneFile { title: TITLE, obj: &["cornell_box.obj"], cameras: &[camera], lights: &[], exposure: 1.5 };
    [("toml", scene.text()), ("obj", obj()), ("mtl", MTL.to_owned())]
        .map(|(extension, text)| File {
            path: format!("cornell_box/cornell_box.{extension}"),
            bytes: text.into_bytes(),
        })
        .into()
}

/// The OBJ text: positions shared by bits, quadrilaterals counter-clockwise from the side that is seen.
fn obj() -> String {
    let mut out = String::from(
        "# The Cornell box; the blocks have no bottoms, the lamp hangs 0.1 below the ceiling (coplanar on the data page).\n# Written by make-scenes; MIT OR Apache-2.0.\nmtllib cornell_box.mtl\n",
    );
    let mut count = 0;
    for part in &PARTS {
        let _ = writeln!(out, "\ng {}\nusemtl {}", part.name, part.material);
        for quad in part.quads {
            for [x, y, z] in facing(*quad, part) {
                let _ = writeln!(out, "v {x} {y} {z}");
            }
            let _ = writeln!(out, "f {} {} {} {}", count + 1, count + 2, count + 3, count + 4);
            count += 4;
        }
    }
    out
}

/// The quadrilateral turned counter-clockwise as seen from the part's visible side.
fn facing(mut quad: Quad, part: &Part) -> Quad {
    let [a, b, c, _] = quad.map(DVec3::from_array);
    let to_point = (part.point - a).dot((b - a).cross(c - a));
    if (to_point > 0.0) != part.towards {
        quad.reverse();
    }
    quad
}
