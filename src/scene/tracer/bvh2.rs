//! The two-wide tree that packets go through: obvhs's, with the boxes of two siblings side by side so that one
//! four-wide operation handles both.

use glam::{Vec3, Vec4};
use obvhs::bvh2::{Bvh2 as Built, node::Bvh2Node};
use smallvec::SmallVec;

/// Marks a count as a leaf's.
const LEAF: u32 = 1 << 31;

/// The tree. The first pair holds the root's children; no pair where there is no triangle.
#[derive(Default)]
pub(super) struct Bvh2 {
    pub(super) pairs: Vec<Pair>,
}

/// Two siblings: one cache line.
#[derive(Clone, Copy)]
pub(super) struct Pair {
    /// Along x, y and z: the low ends of both boxes, then the high ends.
    pub(super) bounds: [Vec4; 3],
    pub(super) children: [Child; 2],
}

/// An inner node or a leaf.
#[derive(Clone, Copy)]
pub(super) struct Child {
    first: u32,
    count: u32,
}

/// A subtree that waits, and how far its box begins.
#[derive(Clone, Copy)]
pub(super) struct Waiting {
    pub(super) child: Child,
    pub(super) near: f32,
}

/// Subtrees that wait, so many without asking for memory; a deeper tree asks.
pub(super) type Stack<T> = SmallVec<[T; 64]>;

/// What a child is.
pub(super) enum Kind {
    /// The index of the pair of its children.
    Inner(usize),
    /// The slots of its triangles.
    Leaf(std::ops::Range<usize>),
}

/// A child with its box.
#[derive(Clone, Copy)]
pub(super) struct Boxed {
    pub(super) low: Vec3,
    pub(super) high: Vec3,
    pub(super) child: Child,
}

impl Boxed {
    /// Half of the box's surface.
    pub(super) fn area(&self) -> f32 {
        let side = self.high - self.low;
        side.x * side.y + side.y * side.z + side.z * side.x
    }
}

impl Child {
    /// A leaf without triangles.
    pub(super) const NOTHING: Self = Self { first: 0, count: LEAF };

    pub(super) fn inner(index: usize) -> Self {
        Self { first: index as u32, count: 0 }
    }

    #[inline(always)]
    pub(super) fn kind(self) -> Kind {
        let first = self.first as usize;
        if self.count & LEAF == 0 {
            Kind::Inner(first)
        } else {
            Kind::Leaf(first..first + (self.count ^ LEAF) as usize)
        }
    }
}

impl Pair {
    pub(super) fn boxes(&self) -> [Boxed; 2] {
        let corner = |lane: usize| Vec3::from_array(self.bounds.map(|b| b[lane]));
        [0, 1].map(|i| Boxed { low: corner(i), high: corner(2 + i), child: self.children[i] })
    }
}

impl Bvh2 {
    /// Lays out a tree depth first. Also gives the primitive of each slot: slots are counted in the order of the leaves.
    pub(super) fn new(tree: &Built) -> (Self, Vec<u32>) {
        let mut primitives = Vec::with_capacity(tree.primitive_indices.len());
        let mut pairs = Vec::with_capacity(tree.nodes.len() / 2 + 1);
        let Some(root) = tree.nodes.first() else { return Default::default() };
        if root.is_leaf() {
            let only = leaf(tree, root, &mut primitives);
            pairs.push(Pair { bounds: bounds(root, root), children: [only, Child::NOTHING] });
            return (Self { pairs }, primitives);
        }
        // where in `pairs` the reference to an inner node waits to be filled in
        let mut open: Vec<(u32, Option<(usize, usize)>)> = vec![(root.first_index, None)];
        while let Some((first, parent)) = open.pop() {
            let index = pairs.len();
            if let Some((pair, side)) = parent {
                let pair: &mut Pair = &mut pairs[pair];
                pair.children[side] = Child::inner(index);
            }
            let siblings = [&tree.nodes[first as usize], &tree.nodes[first as usize + 1]];
            let children = siblings.map(|n| if n.is_leaf() { leaf(tree, n, &mut primitives) } else { Child::NOTHING });
            pairs.push(Pair { bounds: bounds(siblings[0], siblings[1]), children });
            for side in [1, 0] {
                if !siblings[side].is_leaf() {
                    open.push((siblings[side].first_index, Some((index, side))));
                }
            }
        }
        (Self { pairs }, primitives)
    }
}

/// A leaf with the next slots for its primitives.
fn leaf(tree: &Built, node: &Bvh2Node, primitives: &mut Vec<u32>) -> Child {
    let slot = primitives.len() as u32;
    let first = node.first_index as usize;
    primitives.extend(&tree.primitive_indices[first..first + node.prim_count as usize]);
    Child { first: slot, count: node.prim_count | LEAF }
}

fn bounds(a: &Bvh2Node, b: &Bvh2Node) -> [Vec4; 3] {
    let [a, b] = [a, b].map(|n| (Vec3::from(n.aabb().min), Vec3::from(n.aabb().max)));
    [0, 1, 2].map(|axis| Vec4::new(a.0[axis], b.0[axis], a.1[axis], b.1[axis]))
}
