//! Single rays through a four-wide tree: obvhs's two-wide one with about every second level left out, so that one
//! four-wide operation handles the boxes of four siblings (after Dammertz, Hanika and Keller, *Shallow bounding volume
//! hierarchies for fast SIMD ray tracing of incoherent rays*, 2008).

use glam::{Vec3, Vec4};
use smallvec::SmallVec;

use super::bvh2::{Boxed, Bvh2, Child, Kind, Pair, Stack, Waiting};
use super::hit::{Best, Hit, Ray, Triangles};
use super::triangle::{BESIDE, xyz};

/// The least speed towards a side; keeps its reciprocal finite.
const LEAST: f32 = 1e-24;

/// The tree. The first quad holds the root's children; no quad where there is no triangle.
#[derive(Default)]
pub(super) struct Bvh4(pub(super) Vec<Quad>);

/// Four siblings: two cache lines.
#[repr(align(64))]
pub(super) struct Quad {
    /// The low ends of all boxes along x, y and z, then the high ends.
    bounds: [Vec4; 6],
    children: [Child; 4],
}

/// A ray as boxes are tested with it.
struct Slabs {
    origin: [Vec4; 3],
    /// Metres of ray for a metre towards a box, where boxes grow with the distance: to the side met first, and last.
    inverse: [[Vec4; 3]; 2],
    /// Which of a quad's bounds the ray meets first along each axis, and which last.
    near: [usize; 3],
    far: [usize; 3],
}

impl Slabs {
    fn new(ray: &Ray) -> Self {
        let Ray { origin, direction } = *ray;
        let against = |axis: usize| direction[axis].is_sign_negative();
        let inverse = |axis: usize, wider: f32| {
            let d = direction[axis];
            Vec4::splat((d.abs() + wider).max(LEAST).recip().copysign(d))
        };
        Self {
            origin: xyz(|axis| Vec4::splat(origin[axis])),
            inverse: [xyz(|axis| inverse(axis, BESIDE)), xyz(|axis| inverse(axis, -BESIDE))],
            near: xyz(|axis| if against(axis) { axis + 3 } else { axis }),
            far: xyz(|axis| if against(axis) { axis } else { axis + 3 }),
        }
    }

    /// Which boxes (a bit each) the ray meets no farther than `t_max`, and where it enters them. Boxes count as larger by
    /// what hits may lie beside their triangles, which also covers the rounding here.
    #[inline(always)]
    fn meet(&self, quad: &Quad, t_max: f32) -> (u32, Vec4) {
        let near = |axis: usize| (quad.bounds[self.near[axis]] - self.origin[axis]) * self.inverse[0][axis];
        let far = |axis: usize| (quad.bounds[self.far[axis]] - self.origin[axis]) * self.inverse[1][axis];
        let enters = near(0).max(near(1)).max(near(2)).max(Vec4::ZERO);
        let leaves = far(0).min(far(1)).min(far(2)).min(Vec4::splat(t_max));
        (enters.cmple(leaves).bitmask(), enters)
    }
}

impl Bvh4 {
    /// The same tree, laid out depth first.
    pub(super) fn new(tree: &Bvh2) -> Self {
        let mut quads: Vec<Quad> = Vec::with_capacity(tree.pairs.len() / 2 + 1);
        // a pair, and where the reference to its quad waits to be filled in
        let mut open: Vec<(&Pair, Option<(usize, usize)>)> =
            tree.pairs.first().map(|root| (root, None)).into_iter().collect();
        while let Some((pair, parent)) = open.pop() {
            let index = quads.len();
            if let Some((quad, lane)) = parent {
                let quad: &mut Quad = &mut quads[quad];
                quad.children[lane] = Child::inner(index);
            }
            let quad = Quad::over(&opened(tree, pair));
            for (lane, child) in quad.children.iter().enumerate().rev() {
                if let Kind::Inner(pair) = child.kind() {
                    open.push((&tree.pairs[pair], Some((index, lane))));
                }
            }
            quads.push(quad);
        }
        Self(quads)
    }

    pub(super) fn closest(&self, triangles: &Triangles, ray: &Ray, t_min: f32) -> Option<Hit> {
        let slabs = Slabs::new(ray);
        let (mut best, mut reach) = (Best::NONE, f32::MAX);
        let mut waiting: Stack<Waiting> = Stack::new();
        let mut quad = self.0.first()?;
        loop {
            let (mut met, near) = slabs.meet(quad, reach);
            let first = waiting.len();
            while met != 0 {
                let lane = met.trailing_zeros() as usize % 4;
                met &= met - 1;
                let mut i = waiting.len();
                waiting.push(Waiting { child: quad.children[lane], near: near[lane] });
                while i > first && waiting[i - 1].near < waiting[i].near {
                    waiting.swap(i - 1, i);
                    i -= 1;
                }
            }
            quad = loop {
                match waiting.pop() {
                    None => return best.found(),
                    Some(w) if w.near > reach => {}
                    Some(w) => match w.child.kind() {
                        Kind::Inner(index) => break &self.0[index],
                        Kind::Leaf(slots) => {
                            for slot in slots {
                                let meets = triangles.corners[slot].seen_from(&slabs.origin).meet(ray.direction);
                                let Some(t) = meets.filter(|&t| t > t_min && t <= reach) else { continue };
                                let hit = triangles.hit(slot, ray.direction, t);
                                if hit.before(&best) {
                                    (best, reach) = (hit, hit.reach());
                                }
                            }
                        }
                    },
                }
            };
        }
    }

    /// The slot of a triangle that stands on a ray.
    pub(super) fn occluder(&self, triangles: &Triangles, ray: &Ray, t_min: f32, t_max: f32) -> Option<usize> {
        let slabs = Slabs::new(ray);
        let mut waiting: Stack<Child> = Stack::new();
        let mut quad = self.0.first()?;
        loop {
            let (mut met, _) = slabs.meet(quad, t_max);
            while met != 0 {
                let lane = met.trailing_zeros() as usize % 4;
                met &= met - 1;
                waiting.push(quad.children[lane]);
            }
            quad = loop {
                match waiting.pop()?.kind() {
                    Kind::Inner(index) => break &self.0[index],
                    Kind::Leaf(mut slots) => {
                        if let Some(slot) = slots.find(|&slot| triangles.stops(slot, ray, t_min, t_max)) {
                            return Some(slot);
                        }
                    }
                }
            };
        }
    }
}

impl Quad {
    /// Up to four boxes; a lane without one holds a box that no ray meets.
    fn over(boxes: &[Boxed]) -> Self {
        let nothing = Boxed { low: Vec3::INFINITY, high: Vec3::NEG_INFINITY, child: Child::NOTHING };
        let boxes = [0, 1, 2, 3].map(|lane| boxes.get(lane).copied().unwrap_or(nothing));
        let ends = [0, 1, 2, 3, 4, 5].map(|end| boxes.map(|b| if end < 3 { b.low[end] } else { b.high[end - 3] }));
        Self { bounds: ends.map(Vec4::from_array), children: boxes.map(|b| b.child) }
    }
}

/// A pair's boxes, the larger of them opened until there are four.
fn opened(tree: &Bvh2, pair: &Pair) -> SmallVec<[Boxed; 4]> {
    let mut boxes: SmallVec<[Boxed; 4]> = SmallVec::from_iter(pair.boxes());
    while boxes.len() < 4 {
        let largest = boxes
            .iter()
            .enumerate()
            .filter_map(|(i, b)| match b.child.kind() {
                Kind::Inner(pair) => Some((i, pair, b.area())),
                Kind::Leaf(_) => None,
            })
            .max_by(|a, b| a.2.total_cmp(&b.2));
        let Some((i, pair, _)) = largest else { break };
        let [a, b] = tree.pairs[pair].boxes();
        boxes[i] = a;
        boxes.push(b);
    }
    boxes
}
