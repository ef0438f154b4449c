//! A tree for boxes in boxes. Clustering merges one pair of these at a time, which takes quadratic time (20,000 nested triangles: 3 s), and
//! makes a chain of them; halves by place make a tree of even depth in no time, whose rays are slower elsewhere.

use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::node::Bvh2Node;

/// Boxes that come one after another, and whose pile is looked for.
const RUN: usize = 1 << 12;
/// Sum of half areas of a run against that of their common box, which is the number of boxes that a ray through it meets, from which it is a
/// pile: surfaces have a few, foliage and hair some tens.
const PILE: f32 = 400.0;

/// Whether many boxes lie in each other, in all or among those that come one after another.
pub fn is_piled(boxes: &[Aabb]) -> bool {
    let is = |run: &[Aabb]| {
        let mut all = Aabb::empty();
        let areas = run.iter().fold(0.0, |sum, b| {
            all.extend(b.min);
            all.extend(b.max);
            sum + b.half_area()
        });
        areas > PILE * all.half_area()
    };
    boxes.chunks(RUN).any(is)
}

/// A tree that halves the boxes by the longer side of what their centres span, a box a leaf. `indices` are the primitives of the boxes.
pub fn halved(boxes: &[Aabb], indices: Vec<u32>) -> Bvh2 {
    let mut order: Vec<usize> = (0..boxes.len()).collect();
    let mut nodes = vec![Bvh2Node::default()];
    let mut open = vec![(0, 0..boxes.len(), 1)];
    let mut depth = 1;
    while let Some((at, range, level)) = open.pop() {
        let part = &mut order[range.clone()];
        let mut all = Aabb::empty();
        let mut centres = Aabb::empty();
        for &i in part.iter() {
            all.extend(boxes[i].min);
            all.extend(boxes[i].max);
            centres.extend(boxes[i].center());
        }
        depth = depth.max(level);
        if let [only] = part {
            nodes[at] = Bvh2Node::new(all, 1, *only as u32);
            continue;
        }
        let axis = (centres.max - centres.min).max_position();
        let middle = part.len() / 2;
        let centre = |i: &usize| boxes[*i].center()[axis];
        part.select_nth_unstable_by(middle, |a, b| centre(a).total_cmp(&centre(b)).then(a.cmp(b)));
        let first = nodes.len();
        nodes[at] = Bvh2Node::new(all, 0, first as u32);
        nodes.extend([Bvh2Node::default(); 2]);
        let half = range.start + middle;
        open.extend([(first, range.start..half, level + 1), (first + 1, half..range.end, level + 1)]);
    }
    Bvh2 { nodes, primitive_indices: indices, max_depth: depth + 1, uses_spatial_splits: true, ..Bvh2::default() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3A;

    fn cube(least: f32, size: f32) -> Aabb {
        Aabb::new(Vec3A::splat(least), Vec3A::splat(least + size))
    }

    #[test]
    fn nested_boxes_are_a_pile_and_neighbours_are_none() {
        let nested: Vec<Aabb> = (0..8192).map(|i| cube(0.0, 1.0 - i as f32 / 16384.0)).collect();
        let row: Vec<Aabb> = (0..8192).map(|i| cube(i as f32, 1.0)).collect();
        assert_eq!([is_piled(&nested), is_piled(&row), is_piled(&nested[..100])], [true, false, false]);
    }

    #[test]
    fn each_box_is_a_leaf_in_the_box_of_its_parents() {
        for count in [1, 2, 3, 1000] {
            let boxes: Vec<Aabb> = (0..count).map(|i| cube(0.0, 1.0 / (i + 1) as f32)).collect();
            let tree = halved(&boxes, (0..count).collect());
            let mut found = Vec::new();
            let mut open = vec![(0, 1)];
            while let Some((at, level)) = open.pop() {
                let node = &tree.nodes[at];
                assert!(level <= 12, "{level}");
                if node.is_leaf() {
                    found.push(tree.primitive_indices[node.first_index as usize]);
                    continue;
                }
                let halves = [0, 1].map(|i| node.first_index as usize + i);
                let holds = |half: usize| {
                    let (own, below) = (node.aabb(), tree.nodes[half].aabb());
                    own.min.cmple(below.min).all() && own.max.cmpge(below.max).all()
                };
                assert!(halves.into_iter().all(holds));
                open.extend(halves.map(|half| (half, level + 1)));
            }
            found.sort_unstable();
            assert!(found.into_iter().eq(0..count));
        }
    }
}
