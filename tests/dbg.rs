mod by_hand;
use glam::Vec3;
use penombre::cache::layer::Origin;
use penombre::geom::bvh::Bvh;
use penombre::refine::engine::*;
use penombre::refine::options::*;
use penombre::refine::workers::Workers;
use penombre::scene::*;
use std::sync::Arc;
#[test]
fn dbg() {
    let scene = penombre::scene::load::load(std::path::Path::new("scenes/cornell_box/cornell_box.toml")).unwrap().scene;
    let faces: Vec<(FaceId, u32)> = (0..scene.triangles.len() as u32)
        .filter(|&i| {
            let n = scene.geometric_normal(TriangleId(i));
            let c = scene.corners(TriangleId(i))[0];
            n.dot(Vec3::new(278., 273., -800.) - c) > 0.0
        })
        .map(|i| (FaceId(i * 2), 10000))
        .collect();
    let diag = scene.diagonal();
    let bvh = Arc::new(Bvh::build(&scene));
    let mut e = Engine::new(
        Arc::new(scene),
        bvh,
        Workers::new(2).unwrap(),
        Options {
            seed: 0,
            priority: Priority::Error,
            min_pixels: 3.0,
            contrast: 0.02,
            shadow_size: diag * 12.0 / 512.0,
            tolerance: 1e-3,
        },
    );
    e.set_visible(&Visible { generation: 1, eye: Vec3::new(278., 273., -800.), faces });
    for k in 0..200 {
        let u = e.step(Budget::Rays(50000));
        if u.stats.converged || k % 20 == 19 {
            println!("{:?}", u.stats);
        }
        if u.stats.converged {
            break;
        }
    }
    let c = e.cache();
    let mut h = std::collections::BTreeMap::new();
    let mut bad = 0;
    let mut badp = std::collections::BTreeMap::new();
    for v in 0..c.vertices.end() {
        let k = c.layers[0].visibility.get(v);
        *h.entry((format!("{:?}", k.origin), k.points, (k.fraction() > 0.0 && k.fraction() < 1.0))).or_insert(0) += 1;
    }
    for (k, n) in &h {
        println!("{k:?} {n}");
    }
    for i in 0..c.topology.nodes.end() {
        let n = penombre::cache::topology::NodeId(i);
        if c.topology.nodes[i].child.is_some() {
            continue;
        }
        let vs = c.drawn_vertices(n);
        let f: Vec<f32> = vs.iter().map(|v| c.layers[0].visibility.get(v.0).fraction()).collect();
        let (lo, hi) = f.iter().fold((1f32, 0f32), |a, &b| (a.0.min(b), a.1.max(b)));
        if hi - lo > 0.0 {
            for v in &vs {
                let k = c.layers[0].visibility.get(v.0);
                if k.origin == Origin::Inferred || k.points < 16 {
                    bad += 1;
                    let sl: Vec<_> = c.slots_of(*v).map(|s| c.slots[s.0].normal).collect();
                    *badp.entry((format!("{:?}", k.origin), k.points)).or_insert(0) += 1;
                    if bad < 5 {
                        println!(
                            "bad {:?} {:?} {:?} {:?} level {}",
                            c.vertices[v.0].position, k, f, sl, c.topology.nodes[i].level
                        );
                    }
                }
            }
        }
    }
    println!("bad {bad} {badp:?}");
}
