//! The nodes of a file's scene, each with where it is in the world.

use super::document::Document;
use super::faults::Faults;
use super::transform;
use glam::DAffine3;

/// Most nodes above one another.
const MAX_DEPTH: usize = 1024;

/// A node of the scene.
#[derive(Clone, Copy, Debug)]
pub(super) struct Placed {
    /// Its number.
    pub node: usize,
    /// Its transform to the world.
    pub frame: DAffine3,
}

/// The nodes of the default scene (else of the first, else of none: all), parents first.
pub(super) fn placed(document: &Document, faults: &mut Faults) -> Vec<Placed> {
    let nodes = &document.root.nodes;
    let mut seen = vec![false; nodes.len()];
    let mut out = Vec::new();
    let mut waiting: Vec<(usize, usize, DAffine3)> = Vec::new();
    waiting.extend(roots(document, faults).into_iter().rev().map(|root| (root, 0, DAffine3::IDENTITY)));
    while let Some((number, depth, parent)) = waiting.pop() {
        let Some(node) = nodes.get(number) else {
            faults.error("nodes", format!("there is no node {number}, which the scene or a node names"));
            continue;
        };
        if std::mem::replace(&mut seen[number], true) {
            let message = format!("node {number} is reached twice: a node has one parent, and never itself above it");
            faults.error("nodes", message);
            continue;
        }
        if depth == MAX_DEPTH {
            faults.error("depth", format!("node {number} lies deeper than {MAX_DEPTH} nodes: flatten the tree"));
            continue;
        }
        let frame = match transform::of(node) {
            Ok(local) => parent * local,
            Err(why) => {
                faults.error("transforms", format!("node {number}: {why}"));
                parent
            }
        };
        out.push(Placed { node: number, frame });
        let children = node.children.iter().flatten().rev();
        waiting.extend(children.map(|child| (child.value(), depth + 1, frame)));
    }
    out
}

fn roots(document: &Document, faults: &mut Faults) -> Vec<usize> {
    let root = &document.root;
    let number = root.scene.map_or(0, |scene| scene.value());
    if let Some(scene) = root.scenes.get(number) {
        return scene.nodes.iter().map(|node| node.value()).collect();
    }
    if root.scene.is_some() {
        faults.error("scenes", format!("there is no scene {number}"));
    }
    let mut is_child = vec![false; root.nodes.len()];
    for child in root.nodes.iter().flat_map(|node| node.children.iter().flatten()) {
        if let Some(is_child) = is_child.get_mut(child.value()) {
            *is_child = true;
        }
    }
    (0..root.nodes.len()).filter(|&node| !is_child[node]).collect()
}
