//! What a witness sees, made for asking whether a point lies in it.

use crate::plan::free_space::contour::from_segment;
use crate::plan::free_space::open_space::OpenSpace;
use glam::DVec2;

/// The region seen from a witness: all places from where a guard would see the witness.
pub(crate) struct WitnessRegion {
    pub(crate) low: DVec2,
    pub(crate) high: DVec2,
    /// From each corner that sight passes to where it ends: the borders of the region that are no walls, and slits.
    pub(crate) rays: Vec<Ray>,
    centre: DVec2,
    /// Triangles from the centre to the ring, in order of the angle of their first corner.
    sectors: Vec<Sector>,
    /// Where each sector begins: see [`angle`]. Apart from the sectors, since these are searched.
    angles: Vec<f64>,
    /// Slits: seen, but no part of the ring.
    slits: Vec<[DVec2; 2]>,
    tolerance: f64,
}

/// A line of sight past a corner.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ray {
    pub(crate) corner: u32,
    pub(crate) ends: [DVec2; 2],
    /// Where the region lies, going out along the ray: 1 left, −1 right, 0 not on one side all along.
    pub(crate) side: f64,
}

#[derive(Clone, Copy, Debug)]
struct Sector {
    /// Whether it is more than what rounding makes of a line of sight, where the ring steps back.
    wide: bool,
    ends: [DVec2; 2],
}

impl WitnessRegion {
    /// `tolerance`: points so far outside still count as seen, so that rounding never takes a place away.
    pub(crate) fn new(open: &OpenSpace, centre: DVec2, tolerance: f64) -> Self {
        let seen = open.visibility(centre).unwrap_or_default();
        let n = seen.ring.len();
        let mut region = Self {
            low: centre,
            high: centre,
            rays: vec![],
            centre,
            sectors: vec![],
            angles: vec![],
            slits: vec![],
            tolerance,
        };
        let mut sectors = Vec::with_capacity(n);
        for i in 0..n {
            let (a, b) = (seen.ring[i], seen.ring[(i + 1) % n]);
            let twice_area = (a - centre).perp_dot(b - centre);
            if a != centre && b != centre && twice_area > 0.0 {
                let wide = twice_area > tolerance * a.distance(centre).max(b.distance(centre));
                sectors.push((angle(a - centre), Sector { wide, ends: [a, b] }));
            }
            region.low = region.low.min(a);
            region.high = region.high.max(a);
        }
        sectors.sort_by(|a: &(f64, _), b| a.0.total_cmp(&b.0));
        (region.angles, region.sectors) = sectors.into_iter().unzip();
        for i in 0..n {
            let corner = seen.corners[i];
            if corner != u32::MAX && seen.ring[i] != centre {
                region.add_ray(open, corner, seen.ring[i], [seen.ring[(i + n - 1) % n], seen.ring[(i + 1) % n]]);
            }
        }
        region
    }

    /// `beside`: the ring's points before and after the corner.
    fn add_ray(&mut self, open: &OpenSpace, corner: u32, from: DVec2, beside: [DVec2; 2]) {
        let to = open.ray_end(self.centre, corner);
        if to.distance(from) <= self.tolerance {
            return;
        }
        // the ring turns left about the region: where it goes out along the ray, the region lies left
        let side = match beside.map(|p| p.distance(to) <= self.tolerance) {
            [false, true] => 1.0,
            [true, false] => -1.0,
            _ => 0.0,
        };
        self.rays.push(Ray { corner, ends: [from, to], side });
        if !self.holds(to) || !self.holds((from + to) / 2.0) {
            self.slits.push([from, to]);
            self.low = self.low.min(to);
            self.high = self.high.max(to);
        }
    }

    /// Whether a point lies in the region or within the tolerance of it.
    pub(crate) fn holds(&self, p: DVec2) -> bool {
        let eps = self.tolerance;
        if (p + eps).cmplt(self.low).any() || (p - eps).cmpgt(self.high).any() {
            return false;
        }
        let from = p - self.centre;
        let distance = from.length();
        if distance <= 2.0 * eps || self.in_slit(p) {
            return true;
        }
        let n = self.sectors.len();
        if n == 0 {
            return false;
        }
        let (at, turn) = (angle(from), 2.0 * eps / distance);
        let begun = |angle: f64| self.angles.partition_point(|&a| a <= angle);
        // a place a hair before a full turn may lie in the first sectors
        let first = if at + turn < 4.0 { begun(at + turn) } else { n + begun(at + turn - 4.0) };
        // back to the first sector that begins before the angle, less the tolerance; a hair may begin after the sector
        // that it lies in
        for k in 0..n {
            let i = (first + 2 * n - 1 - k) % n;
            if self.in_sector(self.sectors[i], p) {
                return true;
            }
            let behind = at - self.angles[i];
            let behind = if behind < 0.0 { behind + 4.0 } else { behind };
            if self.sectors[i].wide && behind > turn && behind < 4.0 - turn {
                return false;
            }
        }
        false
    }

    fn in_sector(&self, Sector { ends: [a, b], .. }: Sector, p: DVec2) -> bool {
        let (eps, o) = (self.tolerance, self.centre);
        let inside = |a: DVec2, b: DVec2| (b - a).perp_dot(p - a) >= -eps * (b - a).length();
        let (low, high) = (o.min(a).min(b) - eps, o.max(a).max(b) + eps);
        p.cmpge(low).all() && p.cmple(high).all() && inside(o, a) && inside(a, b) && inside(b, o)
    }

    fn in_slit(&self, p: DVec2) -> bool {
        self.slits.iter().any(|&[a, b]| from_segment(p, a, b) <= self.tolerance)
    }
}

/// Grows with the angle, 0 to 4 a turn, at most as fast as the angle in radians.
fn angle(d: DVec2) -> f64 {
    let t = d.y / (d.x.abs() + d.y.abs());
    let turned = if d.x < 0.0 { 2.0 - t } else { t };
    if turned < 0.0 { turned + 4.0 } else { turned }
}
