//! What several setups see is kept from the one that sees it most finely: of the same wall scanned from near and from far
//! the far mesh would lie in and before the near one, and blur what is painted on it. And where one setup's mesh goes from a
//! rim straight to what lies behind, another one often looks through.

use glam::{Mat3, Vec3};
use rayon::prelude::*;
use std::f32::consts::{PI, TAU};

use super::grid::{Grid, Placement};

/// How far two setups' places of one surface may be apart: metres, and a share of the distance.
const APART: [f32; 2] = [0.01, 0.002];

/// A setup gives way to a later one whose points lie closer together than this share of its own spacing, and to one before
/// it from equality on: never both to each other.
const FINER: f32 = 0.9;

/// Each setup's triangles, without those that another one has finer, or looks through.
pub(super) fn finest(grids: &[(&Grid, Placement)]) -> Vec<Vec<[u32; 3]>> {
    let triangles: Vec<Vec<[u32; 3]>> = grids.iter().map(|(grid, _)| grid.triangles()).collect();
    if grids.len() < 2 {
        return triangles;
    }
    let setups: Vec<Setup> = grids.iter().zip(&triangles).map(|((grid, at), t)| Setup::of(grid, *at, t)).collect();
    let kept = |(own, all): (usize, &Vec<[u32; 3]>)| {
        let mine = &setups[own];
        let sight = |(i, other)| (Sight::new(other, mine), if i < own { 1.0 } else { FINER });
        let others: Vec<(Sight, f32)> = setups.iter().enumerate().filter(|(i, _)| *i != own).map(sight).collect();
        let keeps = |t: &&[u32; 3]| {
            let patch = mine.patch(**t);
            !others.iter().any(|(other, share)| {
                let middle = other.turn * patch.middle + other.shift;
                other.has_finer(&patch, middle, *share) || other.looks_through(&patch, middle)
            })
        };
        all.par_iter().filter(keeps).copied().collect()
    };
    triangles.iter().enumerate().map(kept).collect()
}

/// A setup's triangle, in the scanner's own axes.
struct Patch {
    middle: Vec3,
    /// Towards the scanner; as long as twice the triangle's area.
    normal: Vec3,
    /// Longest side, metres.
    size: f32,
    /// How close together points lie there, metres.
    spacing: f32,
}

/// One setup, and how another one's places lie in its axes.
struct Sight<'a> {
    setup: &'a Setup<'a>,
    turn: Mat3,
    shift: Vec3,
}

impl<'a> Sight<'a> {
    fn new(setup: &'a Setup, other: &Setup) -> Self {
        let back = setup.at.rotation.transpose();
        let shift = back * (other.at.position - setup.at.position);
        Self { setup, turn: (back * other.at.rotation).as_mat3(), shift: shift.as_vec3() }
    }

    /// Whether this setup sees the other one's surface from the same side, and by points that lie closer together than a share
    /// of the other's. `middle` is the triangle's in this setup's axes.
    fn has_finer(&self, patch: &Patch, middle: Vec3, share: f32) -> bool {
        if (self.turn * patch.normal).dot(middle) >= 0.0 {
            return false;
        }
        let apart = apart(middle.length());
        let sees = |bin: &Bin| {
            bin.spacing > 0.0
                && bin.spacing < share * patch.spacing
                && bin.normal.dot(middle - bin.middle).abs() < apart + 2.0 * bin.rough
        };
        // all around as well: no gap opens at the rim of what this one sees
        self.setup.around(middle, sees)
    }

    /// Whether this setup looks through where the other one's triangle lies: it bridges the gap between a rim and what is behind.
    fn looks_through(&self, patch: &Patch, middle: Vec3) -> bool {
        let distance = middle.length();
        // what is smaller than the gaps between rays may just be missed
        self.setup.step * distance < patch.size
            && self.setup.around(middle, |bin| bin.nearest > distance + 2.0 * apart(distance))
    }
}

/// A setup's points, and its surface by direction.
struct Setup<'a> {
    at: Placement,
    /// In the scanner's own axes.
    points: &'a [Vec3],
    /// Per point the longest side of its triangles, metres; 0 without any.
    spacing: Vec<f32>,
    /// Angle between rows of bins.
    step: f32,
    /// First bin of each row, from straight down; one more at the end.
    rows: Vec<usize>,
    bins: Vec<Bin>,
}

/// What a setup sees in a direction: a plane through its points there.
#[derive(Clone, Copy)]
struct Bin {
    /// Unit length, towards the scanner.
    normal: Vec3,
    middle: Vec3,
    /// How far a point lies off the plane.
    rough: f32,
    /// Least distance of a point; 0 where there is none.
    nearest: f32,
    /// Longest side of the triangles; 0 where there is none, or where the points lie on no one surface.
    spacing: f32,
}

impl<'a> Setup<'a> {
    fn of(grid: &'a Grid, at: Placement, triangles: &[[u32; 3]]) -> Self {
        let points = grid.points();
        let mut spacing = vec![0.0f32; points.len()];
        for t in triangles {
            let longest = longest_side(t.map(|i| points[i as usize]));
            t.iter().for_each(|i| spacing[*i as usize] = spacing[*i as usize].max(longest));
        }
        let angle = |t: &[u32; 3]| longest_side(t.map(|i| points[i as usize].normalize()));
        let some = triangles.iter().step_by((triangles.len() / 4096).max(1)).map(angle);
        let step = (1.5 * crate::statistics::median(some).unwrap_or(0.1)).clamp(1e-3, 0.5);
        let mut rows = vec![0];
        for row in 0..(PI / step).ceil() as usize {
            let level = ((row as f32 + 0.5) * step - 0.5 * PI).cos().max(0.0);
            rows.push(rows[row] + ((TAU * level / step).round() as usize).max(1));
        }
        let none = Bin { normal: Vec3::ZERO, middle: Vec3::ZERO, rough: 0.0, nearest: 0.0, spacing: 0.0 };
        let bins = vec![none; rows.last().copied().unwrap_or(0)];
        let mut setup = Self { at, points, spacing, step, rows, bins };
        setup.fill(triangles);
        setup
    }

    fn bin(&self, place: Vec3) -> usize {
        let row = self.row(place);
        self.rows[row] + self.column(row, turn(place))
    }

    fn fill(&mut self, triangles: &[[u32; 3]]) {
        let mut counts = vec![0.0f32; self.bins.len()];
        for t in triangles {
            let [a, b, c] = t.map(|i| self.points[i as usize]);
            let normal = (b - a).cross(c - a).normalize_or_zero();
            for i in t {
                let point = self.points[*i as usize];
                let bin = self.bin(point);
                counts[bin] += 1.0;
                let bin = &mut self.bins[bin];
                bin.normal += if normal.dot(point) > 0.0 { -normal } else { normal };
                bin.middle += point;
                bin.spacing = bin.spacing.max(self.spacing[*i as usize]);
            }
        }
        for (bin, count) in self.bins.iter_mut().zip(counts) {
            bin.normal = bin.normal.normalize_or_zero();
            bin.middle /= count.max(1.0);
        }
        for (point, spacing) in self.points.iter().zip(&self.spacing) {
            let bin = self.bin(*point);
            let bin = &mut self.bins[bin];
            if *spacing > 0.0 {
                bin.rough = bin.rough.max(bin.normal.dot(*point - bin.middle).abs());
            }
            let range = point.length();
            bin.nearest = if bin.nearest > 0.0 { bin.nearest.min(range) } else { range };
        }
        // beyond that, a bin holds a foreground's rim and what lies behind it
        for bin in &mut self.bins {
            if bin.rough > apart(bin.middle.length()) + 0.5 * bin.spacing {
                bin.spacing = 0.0;
            }
        }
    }

    fn row(&self, place: Vec3) -> usize {
        let elevation = (place.z / place.length().max(f32::MIN_POSITIVE)).clamp(-1.0, 1.0).asin();
        (((elevation + 0.5 * PI) / self.step) as usize).min(self.rows.len() - 2)
    }

    fn column(&self, row: usize, turn: f32) -> usize {
        let count = self.rows[row + 1] - self.rows[row];
        ((turn * count as f32) as usize).min(count - 1)
    }

    fn patch(&self, t: [u32; 3]) -> Patch {
        let [a, b, c] = t.map(|i| self.points[i as usize]);
        let (middle, normal) = ((a + b + c) / 3.0, (b - a).cross(c - a));
        Patch {
            middle,
            normal: if normal.dot(middle) > 0.0 { -normal } else { normal },
            size: longest_side([a, b, c]),
            spacing: t.iter().map(|i| self.spacing[*i as usize]).fold(f32::INFINITY, f32::min),
        }
    }

    /// Whether something holds of the bin that a place lies in and of all around it.
    fn around(&self, place: Vec3, holds: impl Fn(&Bin) -> bool) -> bool {
        let (row, turn) = (self.row(place), turn(place));
        let beside = [row.checked_sub(1), Some(row + 1).filter(|r| *r < self.rows.len() - 1)];
        // most often it does not hold in the middle
        [Some(row)].into_iter().chain(beside).flatten().all(|r| {
            let (first, count, column) = (self.rows[r], self.rows[r + 1] - self.rows[r], self.column(r, turn));
            [0, 1, count - 1].into_iter().all(|step| holds(&self.bins[first + (column + step) % count]))
        })
    }
}

fn longest_side([a, b, c]: [Vec3; 3]) -> f32 {
    a.distance(b).max(b.distance(c)).max(c.distance(a))
}

/// How far two setups' places of one surface may be apart at a distance.
fn apart(distance: f32) -> f32 {
    APART[0] + APART[1] * distance
}

/// Which way a place lies around the scanner, as a share of a turn.
fn turn(place: Vec3) -> f32 {
    place.y.atan2(place.x) / TAU + 0.5
}

#[cfg(test)]
mod tests {
    use super::super::grid::Cell;
    use super::*;
    use glam::{DMat3, DVec3};

    /// A box of 8 × 4 × 3 m as a scanner in it at `x` sees it, `rows` × 2 `rows` points.
    fn scan(x: f32, rows: i64) -> (Grid, Placement) {
        let half = Vec3::new(4.0, 2.0, 1.5);
        let mut cells = Vec::new();
        for (row, column) in (0..rows).flat_map(|r| (0..2 * rows).map(move |c| (r, c))) {
            let step = PI / rows as f32;
            let (azimuth, elevation) = ((column as f32 + 0.5) * step, 0.5 * PI - (row as f32 + 0.5) * step);
            let d = Vec3::new(elevation.cos() * azimuth.cos(), elevation.cos() * azimuth.sin(), elevation.sin());
            let range = ((half - d.signum() * Vec3::X * x) / d.abs()).min_element();
            cells.push(Cell { place: [row as i32, column as i32], local: d * range });
        }
        let at = Placement { position: DVec3::X * f64::from(x), rotation: DMat3::IDENTITY };
        (Grid::of(&cells, 1, 2 * rows).unwrap(), at)
    }

    #[test]
    fn each_end_of_a_room_is_kept_from_the_scanner_beside_it_and_no_gap_opens() {
        let scans = [scan(-3.0, 90), scan(3.0, 90)];
        let scans = [(&scans[0].0, scans[0].1), (&scans[1].0, scans[1].1)];
        let kept = finest(&scans);
        let middles: Vec<Vec<Vec3>> = (0..2)
            .map(|s| {
                let points = scans[s].0.points();
                let shift = scans[s].1.position.as_vec3();
                kept[s].iter().map(|t| t.iter().map(|i| points[*i as usize] + shift).sum::<Vec3>() / 3.0).collect()
            })
            .collect();
        // towards its rim the end wall is seen at a glancing angle from beside it, and better from afar
        let on_end = |p: &Vec3, end: f32| p.x * end > 3.9 && p.y.abs() < 1.0 && p.z.abs() < 0.7;
        assert!(!middles[0].iter().any(|p| on_end(p, 1.0)) && !middles[1].iter().any(|p| on_end(p, -1.0)));
        assert!(middles[0].iter().any(|p| on_end(p, -1.0)) && middles[1].iter().any(|p| on_end(p, 1.0)));
        // both together still cover the box, with little twice
        let area = |s: usize| -> f32 {
            let points = scans[s].0.points();
            let one = |t: &[u32; 3]| {
                let [a, b, c] = t.map(|i| points[i as usize]);
                0.5 * (b - a).cross(c - a).length()
            };
            kept[s].iter().map(one).sum()
        };
        let (whole, all) = (2.0 * (8.0 * 4.0 + 8.0 * 3.0 + 4.0 * 3.0), area(0) + area(1));
        assert!(all > 0.97 * whole && all < 1.4 * whole, "{all} of {whole}");
        // a lone scan stays as it is
        assert_eq!(finest(&scans[..1])[0].len(), scans[0].0.triangles().len());
    }
}
