//! What a station sees in plan, ready to be asked point by point.

use glam::DVec2;

use super::isovist::Isovist;

/// A region that is region-shaped about a centre, cut at a range.
#[derive(Clone, Debug)]
pub struct VisibilityRegion {
    /// The viewpoint.
    pub centre: DVec2,
    /// The region's outline, turning left.
    pub ring: Vec<DVec2>,
    /// Angles of the ring's points about the centre, rising by less than 2π from the first.
    angles: Vec<f64>,
    /// Metres; infinite without limit.
    range_m: f64,
}

impl VisibilityRegion {
    /// An isovist as far as a range; 0 is without limit.
    pub fn new(isovist: Isovist, range_m: f64) -> Self {
        let Isovist { centre, ring, .. } = isovist;
        let mut angles: Vec<f64> = Vec::with_capacity(ring.len());
        for p in &ring {
            let mut angle = (p.y - centre.y).atan2(p.x - centre.x);
            if let Some(last) = angles.last() {
                // rounding may turn a radial edge back by an ulp
                while angle < last - 1e-9 {
                    angle += std::f64::consts::TAU;
                }
                angle = angle.max(*last);
            }
            angles.push(angle);
        }
        Self { centre, ring, angles, range_m: if range_m > 0.0 { range_m } else { f64::INFINITY } }
    }

    /// Whether a point is seen; points within `slack_m` behind the outline still are.
    pub fn sees(&self, p: DVec2, slack_m: f64) -> bool {
        let to = p - self.centre;
        let distance = to.length();
        if distance > self.range_m || self.ring.len() < 3 {
            return false;
        }
        distance <= self.reach(to, distance) + slack_m
    }

    /// How far is seen in a direction, the range apart.
    fn reach(&self, direction: DVec2, length: f64) -> f64 {
        if length == 0.0 {
            return f64::INFINITY;
        }
        let mut angle = direction.y.atan2(direction.x);
        while angle < self.angles[0] {
            angle += std::f64::consts::TAU;
        }
        while angle >= self.angles[0] + std::f64::consts::TAU {
            angle -= std::f64::consts::TAU;
        }
        let after = self.angles.partition_point(|a| *a <= angle);
        let count = self.ring.len();
        // rounding may leave the angle an ulp before the first
        let (a, b) = (self.ring[(after + count - 1) % count], self.ring[after % count]);
        let unit = direction / length;
        let edge = b - a;
        let across = unit.perp_dot(edge);
        if across.abs() < 1e-12 {
            return (a - self.centre).dot(unit).max((b - self.centre).dot(unit));
        }
        (a - self.centre).perp_dot(edge) / across
    }

    /// The outline as it is to be drawn: cut at the range by an arc of short chords.
    pub fn outline(&self) -> Vec<DVec2> {
        if self.range_m.is_infinite() || self.angles.is_empty() {
            return self.ring.clone();
        }
        // besides the corners, a direction a degree
        let first = self.angles[0];
        let mut out: Vec<(f64, DVec2)> = (0..360)
            .map(|i| first + f64::from(i).to_radians())
            .map(|angle| {
                let unit = DVec2::from_angle(angle);
                (angle, self.centre + unit * self.reach(unit, 1.0).min(self.range_m))
            })
            .collect();
        for (p, angle) in self.ring.iter().zip(&self.angles) {
            let to = *p - self.centre;
            out.push((*angle, self.centre + to.clamp_length_max(self.range_m)));
        }
        // a stable sort keeps the order of points along one ray
        out.sort_by(|a, b| a.0.total_cmp(&b.0));
        out.into_iter().map(|(_, p)| p).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plan::free_space::open_space::OpenSpace;
    use crate::plan::free_space::polygon::Polygon;
    use glam::dvec2;

    /// An L of two corridors.
    fn corner() -> OpenSpace {
        let outer = [(0.0, 0.0), (6.0, 0.0), (6.0, 2.0), (2.0, 2.0), (2.0, 6.0), (0.0, 6.0)];
        OpenSpace::new(&[Polygon { outer: outer.map(DVec2::from).to_vec(), holes: vec![] }]).unwrap()
    }

    #[test]
    fn a_region_sees_what_the_open_space_sees() {
        let open = corner();
        for centre in [dvec2(1.0, 1.0), dvec2(5.0, 0.5), dvec2(1.3, 5.2)] {
            let region = VisibilityRegion::new(open.visibility(centre).unwrap(), 0.0);
            for i in 0..3600 {
                let p = dvec2(f64::from(i % 60) * 0.1 + 0.051, f64::from(i / 60) * 0.1 + 0.047);
                assert_eq!(region.sees(p, 0.0), open.contains(p) && open.sees(centre, p), "{centre} {p}");
            }
        }
    }

    #[test]
    fn a_range_cuts_the_outline() {
        let region = VisibilityRegion::new(corner().visibility(dvec2(1.0, 1.0)).unwrap(), 2.0);
        assert!(region.outline().iter().all(|p| p.distance(region.centre) < 2.0 + 1e-9));
        assert!(region.sees(dvec2(2.9, 1.0), 0.0) && !region.sees(dvec2(3.1, 1.0), 0.0));
    }
}
