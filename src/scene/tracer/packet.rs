//! Up to 64 rays from one point through the two-wide tree together.
//!
//! The rays lie within a pyramid along the axis that they run along most. A ray's slopes are its other two components
//! divided by that one; a box is left out where it lies beside the pyramid or behind all hits found, both siblings at once.
//! A triangle is seen through a rectangle of slopes, and only the rays whose own slopes meet it are tested, four at a
//! time (after Reshetov, Soupikov and Hurley, *Multi-level ray tracing algorithm*, 2005, and Boulos et al., *Interactive
//! distribution ray tracing*, 2006). glam's `Vec4` is the machine's four-wide register.

use glam::{BVec4A, Mat4, Vec3, Vec4, Vec4Swizzles};

use super::bvh2::{Bvh2, Kind, Pair, Stack, Waiting};
use super::hit::{Best, Hit, Triangles};
use super::triangle::{Corners, xyz};

/// Most rays in one packet.
pub(super) const PACKET: usize = 64;
const GROUPS: usize = PACKET / 4;

/// The widest pyramid, in slope, that is worth being cast together.
const WIDEST: f32 = 0.5;

/// The least component along the main axis: beyond it slopes lose their digits.
const LEAST_ALONG: f32 = 0.1;

/// How much slopes are widened against rounding, for a slope of one.
const SLACK: f32 = 2e-6;

/// Rays from one point that stay close together.
pub(super) struct RayPacket {
    origin: [Vec4; 3],
    /// Main axis, and the two others.
    axes: [usize; 3],
    /// ±1: which way along the main axis.
    sign: f32,
    /// x, y and z of the directions, four rays a group.
    directions: [[Vec4; GROUPS]; 3],
    /// How many groups are in use.
    groups: usize,
    /// Slopes of the whole beam.
    slopes: [Span; 2],
    /// Slopes of each group, four groups a lane.
    group_slopes: [[Span; 2]; GROUPS / 4],
}

#[derive(Clone, Copy, Default)]
struct Span {
    low: Vec4,
    high: Vec4,
}

/// The nearest hits so far.
struct Nearest {
    hits: [[Best; 4]; GROUPS],
    /// How far a hit may lie to count.
    reach: [Vec4; GROUPS],
    /// How far along the main axis the farthest of these lies.
    depth: f32,
}

impl RayPacket {
    /// Nothing where the rays spread too far to be cast together.
    pub(super) fn new(origin: Vec3, rays: &[Vec3]) -> Option<Self> {
        let last = *rays.last()?;
        let middle = rays[0] + rays[rays.len() / 2] + last;
        let main = middle.abs().max_position();
        let sign = 1f32.copysign(middle[main]);
        let axes = [main, (main + 1) % 3, (main + 2) % 3];
        let groups = rays.len().div_ceil(4);
        // what is left of the last group and lane is filled with the last ray
        let mut directions = last.to_array().map(|d| [Vec4::splat(d); GROUPS]);
        for (group, rays) in rays.chunks(4).enumerate() {
            let ray = |i: usize| rays.get(i).copied().unwrap_or(last);
            let [a, b, c, d] = [ray(0), ray(1), ray(2), ray(3)];
            directions[0][group] = Vec4::new(a.x, b.x, c.x, d.x);
            directions[1][group] = Vec4::new(a.y, b.y, c.y, d.y);
            directions[2][group] = Vec4::new(a.z, b.z, c.z, d.z);
        }
        let mut beam = Self {
            origin: xyz(|axis| Vec4::splat(origin[axis])),
            axes,
            sign,
            directions,
            groups,
            slopes: Default::default(),
            group_slopes: Default::default(),
        };
        let along = beam.directions[main][..groups].iter().fold(Vec4::MAX, |least, &d| least.min(d * sign));
        beam.span();
        let wide = |s: Span| s.high.x - s.low.x;
        let narrow = wide(beam.slopes[0]) <= WIDEST && wide(beam.slopes[1]) <= WIDEST;
        (along.min_element() > LEAST_ALONG && narrow).then_some(beam)
    }

    /// Finds the slopes of the groups and of the whole.
    fn span(&mut self) {
        let mut whole = [Span { low: Vec4::MAX, high: Vec4::MIN }; 2];
        for k in 0..GROUPS / 4 {
            let quad = |of: &dyn Fn(usize) -> Vec4| {
                Mat4::from_cols(of(4 * k), of(4 * k + 1), of(4 * k + 2), of(4 * k + 3)).transpose()
            };
            for (side, all) in whole.iter_mut().enumerate() {
                let m =
                    quad(&|g| self.directions[self.axes[1 + side]][g] / (self.directions[self.axes[0]][g] * self.sign));
                let low = m.x_axis.min(m.y_axis).min(m.z_axis.min(m.w_axis));
                let high = m.x_axis.max(m.y_axis).max(m.z_axis.max(m.w_axis));
                self.group_slopes[k][side] = widened(low, high);
                *all = Span { low: all.low.min(low), high: all.high.max(high) };
            }
        }
        self.slopes = whole.map(|s| widened(Vec4::splat(s.low.min_element()), Vec4::splat(s.high.max_element())));
    }

    /// Finds the nearest hits farther than `t_min`.
    pub(super) fn closest(&self, tree: &Bvh2, triangles: &Triangles, t_min: f32, hits: &mut [Option<Hit>]) {
        let mut best = Nearest { hits: [[Best::NONE; 4]; GROUPS], reach: [Vec4::MAX; GROUPS], depth: f32::MAX };
        self.traverse(tree, triangles, t_min, &mut best);
        for (i, hit) in hits.iter_mut().enumerate() {
            *hit = best.hits[i / 4][i % 4].found();
        }
    }

    fn traverse(&self, tree: &Bvh2, triangles: &Triangles, t_min: f32, best: &mut Nearest) {
        let Some(mut pair) = tree.pairs.first() else { return };
        let mut waiting: Stack<Waiting> = Stack::new();
        loop {
            let (seen, near) = self.sees(pair, best.depth);
            let mut next = None;
            if seen & 3 == 3 {
                let (first, second) = if near.x <= near.y { (0, 1) } else { (1, 0) };
                waiting.push(Waiting { child: pair.children[second], near: near[second] });
                next = Some(pair.children[first]);
            } else if seen != 0 {
                next = Some(pair.children[(seen >> 1) as usize]);
            }
            loop {
                let child = match next.take() {
                    Some(child) => child,
                    None => match waiting.pop() {
                        Some(w) if w.near <= best.depth => w.child,
                        Some(_) => continue,
                        None => return,
                    },
                };
                match child.kind() {
                    Kind::Inner(index) => {
                        pair = &tree.pairs[index];
                        break;
                    }
                    Kind::Leaf(slots) => self.leaf(slots, triangles, t_min, best),
                }
            }
        }
    }

    /// Which of two boxes (bits 0 and 1) the pyramid meets no farther than `depth`, and where along the main axis they begin.
    #[inline(always)]
    fn sees(&self, pair: &Pair, depth: f32) -> (u32, Vec4) {
        let bounds = |axis: usize| pair.bounds[self.axes[axis]] - self.origin[self.axes[axis]];
        let w = bounds(0) * self.sign;
        let (near, far) = (w.min(w.zwxy()).max(Vec4::ZERO), w.max(w.zwxy()));
        let mut low = (far.cmpge(Vec4::ZERO) & near.cmple(Vec4::splat(depth))).bitmask();
        let mut high = low;
        for side in 0..2 {
            let b = bounds(1 + side);
            let s = self.slopes[side];
            low &= b.cmple((s.high * near).max(s.high * far)).bitmask();
            high &= b.cmpge((s.low * near).min(s.low * far)).bitmask();
        }
        (low & (high >> 2) & 3, near)
    }

    #[inline(always)]
    fn leaf(&self, slots: std::ops::Range<usize>, triangles: &Triangles, t_min: f32, best: &mut Nearest) {
        let mut found = false;
        for slot in slots {
            let corners = triangles.corners[slot].seen_from(&self.origin);
            let groups = self.groups_that_see(&corners, best.depth);
            if groups != 0 {
                found |= self.test(&corners, groups, (triangles, slot), t_min, best);
            }
        }
        if found {
            let along = &self.directions[self.axes[0]];
            let depth = (0..self.groups).fold(Vec4::ZERO, |d, g| d.max(best.reach[g] * along[g].abs()));
            best.depth = depth.max_element() * (1.0 + SLACK);
        }
    }

    /// Bits of the groups whose slopes meet a triangle's (relative to the origin).
    #[inline(always)]
    fn groups_that_see(&self, corners: &Corners, depth: f32) -> u32 {
        let all = (1u32 << self.groups) - 1;
        let w = corners.0[self.axes[0]] * self.sign;
        let nearest = w.min_element();
        if nearest <= 0.0 {
            return if w.max_element() < 0.0 { 0 } else { all };
        }
        if nearest > depth {
            return 0;
        }
        let slope = |axis: usize| {
            let s = corners.0[self.axes[axis]] / w;
            (Vec4::splat(s.min_element()), Vec4::splat(s.max_element()))
        };
        let slopes = [slope(1), slope(2)];
        let mut seen = 0;
        for (k, groups) in self.group_slopes.iter().enumerate() {
            let meets = |side: usize| -> BVec4A {
                groups[side].low.cmple(slopes[side].1) & groups[side].high.cmpge(slopes[side].0)
            };
            seen |= (meets(0) & meets(1)).bitmask() << (4 * k);
        }
        seen & all
    }

    /// Tests groups of rays against a triangle; whether any was hit.
    #[inline(always)]
    fn test(
        &self,
        corners: &Corners,
        mut groups: u32,
        (triangles, slot): (&Triangles, usize),
        t_min: f32,
        best: &mut Nearest,
    ) -> bool {
        let enclose = corners.edges().spread();
        let mut found = false;
        while groups != 0 {
            let g = groups.trailing_zeros() as usize % GROUPS;
            groups &= groups - 1;
            let directions = xyz(|axis| self.directions[axis][g]);
            let inside = enclose(&directions);
            if inside.bitmask() == 0 {
                continue;
            }
            let t = corners.distance(&directions);
            let mut nearer = (inside & t.cmpgt(Vec4::splat(t_min)) & t.cmple(best.reach[g])).bitmask();
            while nearer != 0 {
                let lane = nearer.trailing_zeros() as usize % 4;
                nearer &= nearer - 1;
                let direction = Vec3::from_array(xyz(|axis| directions[axis][lane]));
                let hit = triangles.hit(slot, direction, t[lane]);
                if hit.before(&best.hits[g][lane]) {
                    best.hits[g][lane] = hit;
                    best.reach[g][lane] = hit.reach();
                    found = true;
                }
            }
        }
        found
    }
}

fn widened(low: Vec4, high: Vec4) -> Span {
    Span { low: low - SLACK * (1.0 + low * low), high: high + SLACK * (1.0 + high * high) }
}
