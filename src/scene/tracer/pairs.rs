//! The two-wide tree that packets go through: obvhs's, with the boxes of two siblings side by side so that one
//! four-wide operation handles both.

use glam::{Vec3, Vec4};
use obvhs::bvh2::{Bvh2, node::Bvh2Node};

/// Marks a count as a leaf's.
const LEAF: u32 = 1 << 31;

/// The tree. The first pair holds the root's children; no pair where there is no triangle.
#[derive(Default)]
pub(super) struct Pairs {
    pub(super) pairs: Vec<Pair>,
    /// Slots of the triangles in the leaves.
    pub(super) slots: Vec<u32>,
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

/// What a child is.
pub(super) enum Kind {
    /// The index of the pair of its children.
    Inner(usize),
    /// The range of its triangles in [`Pairs::slots`].
    Leaf(std::ops::Range<usize>),
}

impl Child {
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

impl Pairs {
    /// Lays out a tree depth first. `slot_of` tells the slot of a primitive.
    pub(super) fn new(tree: &Bvh2, slot_of: &[u32]) -> Self {
        let slots: Vec<u32> = tree.primitive_indices.iter().map(|&i| slot_of[i as usize]).collect();
        let mut pairs = Vec::with_capacity(tree.nodes.len() / 2 + 1);
        let Some(root) = tree.nodes.first() else { return Self::default() };
        if root.is_leaf() {
            let nothing = Child { first: 0, count: LEAF };
            pairs.push(Pair { bounds: bounds(root, root), children: [leaf(root), nothing] });
            return Self { pairs, slots };
        }
        // where in `pairs` the reference to an inner node waits to be filled in
        let mut open: Vec<(u32, Option<(usize, usize)>)> = vec![(root.first_index, None)];
        while let Some((first, parent)) = open.pop() {
            let index = pairs.len();
            if let Some((pair, side)) = parent {
                let pair: &mut Pair = &mut pairs[pair];
                pair.children[side].first = index as u32;
            }
            let siblings = [&tree.nodes[first as usize], &tree.nodes[first as usize + 1]];
            pairs.push(Pair { bounds: bounds(siblings[0], siblings[1]), children: siblings.map(leaf) });
            for side in [1, 0] {
                if !siblings[side].is_leaf() {
                    pairs[index].children[side].count = 0;
                    open.push((siblings[side].first_index, Some((index, side))));
                }
            }
        }
        Self { pairs, slots }
    }

    pub(super) fn bytes(&self) -> usize {
        size_of_val(self.pairs.as_slice()) + size_of_val(self.slots.as_slice())
    }
}

fn leaf(node: &Bvh2Node) -> Child {
    Child { first: node.first_index, count: node.prim_count | LEAF }
}

fn bounds(a: &Bvh2Node, b: &Bvh2Node) -> [Vec4; 3] {
    let [a, b] = [a, b].map(|n| (Vec3::from(n.aabb().min), Vec3::from(n.aabb().max)));
    [0, 1, 2].map(|axis| Vec4::new(a.0[axis], b.0[axis], a.1[axis], b.1[axis]))
}
