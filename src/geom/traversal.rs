//! A tree of eight boxes a node, and rays through it.

use super::Ray;
use glam::Vec3;
use smallvec::SmallVec;
use wide::f32x8;

/// Children of a node.
pub const WIDTH: usize = 8;

/// The boxes of a node's children, coordinate by coordinate, and where those are: four lines of the processor's caches.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub struct Node {
    /// Low and high planes along x, y and z.
    planes: [[f32x8; 2]; 3],
    children: [Child; WIDTH],
}

/// Index of a node or of a leaf.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
#[repr(transparent)]
pub struct Child(u32);

/// The bit of a leaf.
const LEAF: u32 = 1 << 31;

impl Child {
    /// A node of the tree.
    pub const fn node(index: usize) -> Self {
        Self(index as u32)
    }

    /// A leaf.
    pub const fn leaf(index: usize) -> Self {
        Self(index as u32 | LEAF)
    }

    /// The same in a tree before whose nodes and leaves others have been put.
    pub const fn moved(self, nodes: usize, leaves: usize) -> Self {
        Self(self.0 + if self.0 & LEAF == 0 { nodes } else { leaves } as u32)
    }
}

impl Node {
    /// Of up to [`WIDTH`] children, each with the low and high corner of its box.
    pub fn new(children: &[(Child, [Vec3; 2])]) -> Self {
        // Lanes to spare have a box that ends before it begins.
        let empty = [Vec3::INFINITY, Vec3::NEG_INFINITY];
        let corner = |lane: usize, side: usize| children.get(lane).map_or(empty, |child| child.1)[side];
        let lanes = |axis: usize, side| f32x8::new(std::array::from_fn(|lane| corner(lane, side)[axis]));
        Self {
            planes: [0, 1, 2].map(|axis| [0, 1].map(|side| lanes(axis, side))),
            children: std::array::from_fn(|lane| children.get(lane).map_or(Child::default(), |child| child.0)),
        }
    }

    /// The same in a tree before whose nodes and leaves others have been put.
    pub fn moved(&self, nodes: usize, leaves: usize) -> Self {
        Self { children: self.children.map(|child| child.moved(nodes, leaves)), ..*self }
    }

    /// Where the ray enters the boxes, and a bit for each that it meets before `t_max`.
    #[inline(always)]
    fn meet(&self, ray: &Slopes, t_max: f32) -> (f32x8, u32) {
        let at = |axis: usize, far: usize| {
            (self.planes[axis][(ray.from_above[axis] ^ far) % 2] - ray.origin[axis]) * ray.inverse[axis]
        };
        let enter = at(0, 0).fast_max(at(1, 0)).fast_max(at(2, 0).fast_max(f32x8::ZERO));
        let leave = at(0, 1).fast_min(at(1, 1)).fast_min(at(2, 1).fast_min(f32x8::splat(t_max)));
        (enter, enter.simd_le(leave).to_bitmask())
    }
}

/// What box tests want to know of a ray.
struct Slopes {
    origin: [f32x8; 3],
    /// One over the direction.
    inverse: [f32x8; 3],
    /// By axis 1 where the ray goes down it, so that it meets the high planes first.
    from_above: [usize; 3],
}

impl Slopes {
    #[inline(always)]
    fn new(ray: &Ray) -> Self {
        // Finite, so that a plane through the origin is met at 0.
        const STEEPEST: f32 = 1e18;
        let inverse = ray.direction.to_array().map(|d| d.recip().clamp(-STEEPEST, STEEPEST));
        Self {
            origin: ray.origin.to_array().map(f32x8::splat),
            inverse: inverse.map(f32x8::splat),
            from_above: inverse.map(|slope| usize::from(slope < 0.0)),
        }
    }
}

/// A child that is still to be looked at. In the order of these numbers they are nearest first.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Entry(u64);

impl Entry {
    /// `t`, where the ray enters, is not negative, so that its bits are in its order.
    #[inline(always)]
    fn new(t: f32, child: Child) -> Self {
        Self(u64::from(t.to_bits()) << 32 | u64::from(child.0))
    }

    #[inline(always)]
    const fn t(self) -> f32 {
        f32::from_bits((self.0 >> 32) as u32)
    }

    #[inline(always)]
    const fn child(self) -> Child {
        Child(self.0 as u32)
    }
}

/// Children that wait, the nearest last; few trees are so deep that more do.
type Stack<T> = SmallVec<[T; 96]>;

/// Puts the children of `node` in `lanes` on the stack but for the nearest, which it returns.
#[inline(always)]
fn push_all_but_nearest(stack: &mut Stack<Entry>, node: &Node, enter: f32x8, mut lanes: u32) -> Option<Entry> {
    let enter = enter.to_array();
    let mut next = || {
        let lane = lanes.trailing_zeros() as usize % WIDTH;
        (lanes != 0).then(|| {
            lanes &= lanes - 1;
            Entry::new(enter[lane], node.children[lane])
        })
    };
    let mut nearest = next()?;
    let first = stack.len();
    while let Some(entry) = next() {
        let farther = nearest.max(entry);
        nearest = nearest.min(entry);
        let mut place = stack.len();
        stack.push(farther);
        while place > first && stack[place - 1] < farther {
            stack[place] = stack[place - 1];
            place -= 1;
        }
        stack[place] = farther;
    }
    Some(nearest)
}

/// Calls `meet` for the leaves along the ray, roughly from its origin on, with the end of the ray: what it returns is the new one.
#[inline(always)]
pub fn closest(nodes: &[Node], ray: &Ray, mut meet: impl FnMut(usize, f32) -> f32) {
    let (slopes, mut t_max) = (Slopes::new(ray), ray.t_max);
    let mut stack: Stack<Entry> = SmallVec::new();
    let mut next = (!nodes.is_empty()).then(|| Entry::new(0.0, Child::node(0)));
    while let Some(entry) = next {
        next = None;
        let Child(at) = entry.child();
        if at & LEAF != 0 {
            t_max = meet((at & !LEAF) as usize, t_max);
        } else {
            let node = &nodes[at as usize];
            let (enter, lanes) = node.meet(&slopes, t_max);
            next = push_all_but_nearest(&mut stack, node, enter, lanes);
        }
        while next.is_none() {
            let Some(entry) = stack.pop() else { return };
            next = (entry.t() <= t_max).then_some(entry);
        }
    }
}

/// Whether `meet` is true of any leaf along the ray; it is called in no order.
#[inline(always)]
pub fn any(nodes: &[Node], ray: &Ray, mut meet: impl FnMut(usize) -> bool) -> bool {
    let slopes = Slopes::new(ray);
    let mut stack: Stack<Child> = SmallVec::new();
    stack.extend((!nodes.is_empty()).then_some(Child::node(0)));
    while let Some(Child(at)) = stack.pop() {
        if at & LEAF != 0 {
            if meet((at & !LEAF) as usize) {
                return true;
            }
            continue;
        }
        let node = &nodes[at as usize];
        let (_, mut lanes) = node.meet(&slopes, ray.t_max);
        while lanes != 0 {
            stack.push(node.children[lanes.trailing_zeros() as usize % WIDTH]);
            lanes &= lanes - 1;
        }
    }
    false
}
