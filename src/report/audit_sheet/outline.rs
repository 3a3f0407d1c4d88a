//! Outlines of pixel regions.

use std::collections::BTreeMap;

use crate::plan::free_space::contour::simplified;
use crate::report::Point;

/// A grid of truth values, rows from the top.
pub(super) struct Cells {
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) inside: Vec<bool>,
}

impl Cells {
    /// A picture's mask brought to at most `most` cells along its longer side: a cell is inside where at least half of
    /// its pixels are.
    pub(super) fn of(width: usize, height: usize, most: usize, inside: impl Fn(usize) -> bool) -> Self {
        let step = width.max(height).div_ceil(most).max(1);
        let (w, h) = (width.div_ceil(step), height.div_ceil(step));
        let cell = |i: usize| {
            let (x0, y0) = (i % w * step, i / w * step);
            let (x1, y1) = ((x0 + step).min(width), (y0 + step).min(height));
            let pixels = (y0..y1).flat_map(|y| (x0..x1).map(move |x| y * width + x));
            2 * pixels.filter(|i| inside(*i)).count() >= (x1 - x0) * (y1 - y0)
        };
        Self { width: w, height: h, inside: (0..w * h).map(cell).collect() }
    }

    fn at(&self, x: isize, y: isize) -> bool {
        let inside = x >= 0 && y >= 0 && (x as usize) < self.width && (y as usize) < self.height;
        inside && self.inside[y as usize * self.width + x as usize]
    }

    /// The outlines as rings in shares of the picture's width and height, straightened by `slack` cells. By the even-odd
    /// rule they enclose what is inside.
    pub(super) fn rings(&self, slack: f64) -> Vec<Vec<Point>> {
        // each edge of an inside cell that borders on outside, walked with the inside on the right
        let mut next: BTreeMap<(isize, isize), Vec<(isize, isize)>> = BTreeMap::new();
        for (x, y) in (0..self.height as isize).flat_map(|y| (0..self.width as isize).map(move |x| (x, y))) {
            if !self.at(x, y) {
                continue;
            }
            let sides = [
                (self.at(x, y - 1), (x, y), (x + 1, y)),
                (self.at(x + 1, y), (x + 1, y), (x + 1, y + 1)),
                (self.at(x, y + 1), (x + 1, y + 1), (x, y + 1)),
                (self.at(x - 1, y), (x, y + 1), (x, y)),
            ];
            for (_, from, to) in sides.into_iter().filter(|(neighbour, ..)| !neighbour) {
                next.entry(from).or_default().push(to);
            }
        }
        let mut rings = Vec::new();
        while let Some((&start, _)) = next.first_key_value() {
            let mut ring = vec![start];
            let mut at = start;
            while let Some(ways) = next.get_mut(&at) {
                let Some(to) = ways.pop() else { break };
                if ways.is_empty() {
                    next.remove(&at);
                }
                at = to;
                if at == start {
                    break;
                }
                ring.push(at);
            }
            rings.push(self.shares(&straightened(&corners(&ring), slack)));
        }
        rings
    }

    fn shares(&self, ring: &[(isize, isize)]) -> Vec<Point> {
        ring.iter().map(|(x, y)| [*x as f64 / self.width as f64, *y as f64 / self.height as f64]).collect()
    }

    /// A cell well inside the region, as shares of width and height: the one farthest from the outside by city blocks.
    pub(super) fn middle(&self) -> Option<Point> {
        let (w, h) = (self.width, self.height);
        let mut depth: Vec<u32> = self.inside.iter().map(|i| if *i { u32::MAX } else { 0 }).collect();
        let lower = |depth: &mut Vec<u32>, i: usize, near: Option<usize>| {
            // beyond the frame is outside
            let from = near.map_or(0, |n| depth[n]);
            depth[i] = depth[i].min(from.saturating_add(1));
        };
        for i in 0..w * h {
            lower(&mut depth, i, (i % w > 0).then(|| i - 1));
            lower(&mut depth, i, (i >= w).then(|| i - w));
        }
        for i in (0..w * h).rev() {
            lower(&mut depth, i, (i % w + 1 < w).then(|| i + 1));
            lower(&mut depth, i, (i + w < w * h).then(|| i + w));
        }
        let deepest = (0..w * h).filter(|i| self.inside[*i]).max_by_key(|i| (depth[*i], usize::MAX - i))?;
        Some([((deepest % w) as f64 + 0.5) / w as f64, ((deepest / w) as f64 + 0.5) / h as f64])
    }
}

/// Only the places where a ring turns.
fn corners(ring: &[(isize, isize)]) -> Vec<(isize, isize)> {
    let n = ring.len();
    let turns = |i: usize| {
        let (a, b, c) = (ring[(i + n - 1) % n], ring[i], ring[(i + 1) % n]);
        (b.0 - a.0, b.1 - a.1) != (c.0 - b.0, c.1 - b.1)
    };
    (0..n).filter(|i| turns(*i)).map(|i| ring[i]).collect()
}

/// Douglas and Peucker's simplification of a closed ring.
fn straightened(ring: &[(isize, isize)], slack: f64) -> Vec<(isize, isize)> {
    if ring.len() < 5 {
        return ring.to_vec();
    }
    let far = (0..ring.len()).max_by_key(|i| (ring[*i].0 - ring[0].0).pow(2) + (ring[*i].1 - ring[0].1).pow(2));
    let far = far.unwrap_or(0);
    let mut closed = ring.to_vec();
    closed.push(ring[0]);
    let off = |i: usize, [from, to]: [usize; 2]| {
        let (p, q) = (closed[from], closed[to]);
        let (dx, dy) = ((q.0 - p.0) as f64, (q.1 - p.1) as f64);
        ((closed[i].0 - p.0) as f64 * dy - (closed[i].1 - p.1) as f64 * dx).abs() / dx.hypot(dy).max(1e-9)
    };
    let keep = simplified(&[0, far, ring.len()], slack, off);
    ring.iter().zip(&keep).filter(|(_, k)| **k).map(|(p, _)| *p).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn area(rings: &[Vec<Point>]) -> f64 {
        let ring = |r: &Vec<Point>| {
            (0..r.len()).map(|i| (r[i], r[(i + 1) % r.len()])).map(|(a, b)| a[0] * b[1] - a[1] * b[0]).sum::<f64>()
                / 2.0
        };
        rings.iter().map(ring).sum()
    }

    #[test]
    fn rings_enclose_what_is_inside() {
        // a frame with a hole, and cells that touch at a corner
        let picture = ["######....", "#....#..#.", "#....#.#..", "######....", "..........", "##########"];
        let inside: Vec<bool> = picture.concat().chars().map(|c| c == '#').collect();
        let cells = Cells::of(10, 6, 100, |i| inside[i]);
        let count = inside.iter().filter(|i| **i).count() as f64;
        assert!((area(&cells.rings(0.0)) * 60.0 - count).abs() < 1e-9);
        let disc = Cells::of(400, 300, 100, |i| {
            let (x, y) = ((i % 400) as f64 - 200.0, (i / 400) as f64 - 150.0);
            x.hypot(y) < 100.0
        });
        let rings = disc.rings(0.8);
        assert!(rings.len() == 1 && rings[0].len() < 60, "{} rings, {} corners", rings.len(), rings[0].len());
        let expected = std::f64::consts::PI * 1e4 / 12e4;
        assert!((area(&rings) / expected - 1.0).abs() < 0.05);
        let [x, y] = disc.middle().unwrap();
        assert!((x - 0.5).abs() < 0.03 && (y - 0.5).abs() < 0.03);
        assert!(
            Cells::of(4, 4, 4, |_| false).rings(1.0).is_empty() && Cells::of(4, 4, 4, |_| false).middle().is_none()
        );
    }
}
