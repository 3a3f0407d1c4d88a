//! From a yes/no map to polygons.

use glam::DVec2;
use std::collections::BTreeMap;

use super::polygon::{Polygon, Ring, ring_area};
use crate::plan::floors::raster::{Grid, Map};

/// East, north, west, south.
const STEPS: [(isize, isize); 4] = [(1, 0), (0, 1), (-1, 0), (0, -1)];

/// The outlines of a map, one polygon a connected part (cells that share a side), with corners thinned out so that no
/// outline moves by more than `tolerance_m` (Douglas and Peucker 1973). Outer rings turn left, holes right. A
/// tolerance of 0 keeps every corner.
pub fn polygons(map: &Map, tolerance_m: f64) -> Vec<Polygon> {
    let part = map.labels();
    let mut polygons: BTreeMap<u32, Polygon> = BTreeMap::new();
    for (cell, ring) in rings(map) {
        let simple = thinned(&ring, tolerance_m);
        if simple.len() < 3 {
            continue;
        }
        let polygon = polygons.entry(part[cell]).or_default();
        if ring_area(&ring) > 0.0 {
            polygon.outer = simple;
        } else {
            polygon.holes.push(simple);
        }
    }
    polygons.into_values().filter(|p| p.outer.len() > 2).collect()
}

/// Closed outlines along cell sides, cells that are on to the left, corners only; each with a cell beside it.
fn rings(map: &Map) -> Vec<(usize, Ring)> {
    let (w, h) = (map.grid.width as isize, map.grid.height as isize);
    let on = |x: isize, y: isize| x >= 0 && y >= 0 && x < w && y < h && map.on[(y * w + x) as usize];
    // whether an outline leaves a lattice point in a direction: on to its left, off to its right
    let leaves = |x: isize, y: isize, d: usize| match d {
        0 => on(x, y) && !on(x, y - 1),
        1 => on(x - 1, y) && !on(x, y),
        2 => on(x - 1, y - 1) && !on(x - 1, y),
        _ => on(x, y - 1) && !on(x - 1, y - 1),
    };
    let mut done = vec![0u8; ((w + 1) * (h + 1)) as usize];
    let mut rings = Vec::new();
    for y in 0..h {
        for x in 0..w {
            // every outline has a stretch that runs east along the south side of a cell
            if !leaves(x, y, 0) || done[(y * (w + 1) + x) as usize] & 1 != 0 {
                continue;
            }
            let (mut px, mut py, mut d) = (x, y, 0);
            let mut ring = Ring::new();
            let mut last = usize::MAX;
            loop {
                let seen = &mut done[(py * (w + 1) + px) as usize];
                if *seen & 1 << d != 0 {
                    break;
                }
                *seen |= 1 << d;
                if d != last {
                    ring.push(corner(&map.grid, px, py));
                }
                last = d;
                (px, py) = (px + STEPS[d].0, py + STEPS[d].1);
                // the sharpest left turn stays with the same cells where two outlines meet
                d = [(d + 1) % 4, d, (d + 3) % 4].into_iter().find(|d| leaves(px, py, *d)).unwrap_or(d);
            }
            rings.push(((y * w + x) as usize, ring));
        }
    }
    rings
}

fn corner(grid: &Grid, x: isize, y: isize) -> DVec2 {
    grid.low + DVec2::new(x as f64, y as f64) * grid.cell_m
}

/// A ring without the corners that a tolerance does not need.
fn thinned(ring: &[DVec2], tolerance_m: f64) -> Ring {
    if ring.len() < 4 || tolerance_m <= 0.0 {
        return ring.to_vec();
    }
    // two corners far apart are kept
    let far = |from: DVec2| {
        (0..ring.len()).fold(0, |best, i| {
            if ring[i].distance_squared(from) > ring[best].distance_squared(from) { i } else { best }
        })
    };
    let a = far(ring[0]);
    let b = far(ring[a]);
    let (a, b) = (a.min(b), a.max(b));
    let turned: Vec<DVec2> = (0..=ring.len()).map(|i| ring[(a + i) % ring.len()]).collect();
    let mut simple = simplified(&turned, &[0, b - a, ring.len()], tolerance_m);
    // the first again
    simple.pop();
    simple
}

/// A line without corners that move it by no more than a tolerance (Douglas and Peucker 1973). The points of the numbers in
/// `anchors`, in order from its first to its last, stay in any case.
pub(crate) fn simplified(line: &[DVec2], anchors: &[usize], tolerance: f64) -> Vec<DVec2> {
    let mut keep = vec![false; line.len()];
    anchors.iter().for_each(|anchor| keep[*anchor] = true);
    let mut open: Vec<[usize; 2]> = anchors.windows(2).map(|pair| [pair[0], pair[1]]).collect();
    while let Some([from, to]) = open.pop() {
        let off = |i: usize| (from_segment(line[i], line[from], line[to]), i);
        let worst = (from + 1..to).map(off).max_by(|a, b| a.0.total_cmp(&b.0));
        if let Some((_, i)) = worst.filter(|(distance, _)| *distance > tolerance) {
            keep[i] = true;
            open.extend([[from, i], [i, to]]);
        }
    }
    line.iter().zip(keep).filter(|(_, keep)| *keep).map(|(p, _)| *p).collect()
}

/// Distance of a point from a segment.
pub(crate) fn from_segment(p: DVec2, a: DVec2, b: DVec2) -> f64 {
    let along = b - a;
    let t = ((p - a).dot(along) / along.length_squared().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
    p.distance(a + along * t)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn map(side: usize, f: impl Fn(f64, f64) -> bool) -> Map {
        let grid = Grid { low: DVec2::new(-1.0, 2.0), cell_m: 0.1, width: side, height: side };
        Map::of(grid, |c| f((c % side) as f64, (c / side) as f64))
    }

    #[test]
    fn a_frame_has_an_outer_ring_and_a_hole() {
        let map = map(40, |x, y| {
            (5.0..35.0).contains(&x)
                && (5.0..35.0).contains(&y)
                && !((10.0..20.0).contains(&x) && (10.0..15.0).contains(&y))
        });
        let polygons = polygons(&map, 0.05);
        let [p] = polygons.as_slice() else { panic!("{polygons:?}") };
        assert_eq!((p.outer.len(), p.holes.len(), p.holes[0].len()), (4, 1, 4));
        assert!((p.area() - map.area()).abs() < 1e-9 && (map.area() - 8.5).abs() < 1e-9);
        assert!(ring_area(&p.outer) > 0.0 && ring_area(&p.holes[0]) < 0.0);
    }

    #[test]
    fn a_disc_keeps_its_area_with_few_corners() {
        let map = map(100, |x, y| (x - 50.0).hypot(y - 50.0) < 40.0);
        let p = polygons(&map, 0.075).remove(0);
        assert!(p.outer.len() < 80 && (p.area() / map.area() - 1.0).abs() < 0.02, "{} {}", p.outer.len(), p.area());
    }

    #[test]
    fn parts_that_meet_at_a_corner_are_two() {
        let p = polygons(&map(4, |x, y| (x, y) == (1.0, 1.0) || (x, y) == (2.0, 2.0)), 0.0);
        assert_eq!(p.len(), 2);
        assert!(p.iter().all(|p| p.outer.len() == 4 && (p.area() - 0.01).abs() < 1e-12));
    }
}
