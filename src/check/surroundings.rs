//! What surrounds a probe or a camera, and whether it can stand there.

use glam::Vec3;

use super::cause::{Cause, CauseKind};
use crate::panorama::Projection;
use crate::scene::{Ray, Scene};
use crate::site::Pose;
use crate::sphere::sphere;
use crate::statistics::median;

/// Straight on, and a little beside it on either side: a ray that meets an edge exactly may slip through.
pub(super) const BESIDE: [(f32, f32); 3] = [(0.0, 0.0), (1e-3, 2e-3), (-2e-3, 1e-3)];

/// What a few thousand rays from a point tell of its surroundings.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Surroundings {
    /// Distance of the nearest hit in metres; infinite without any.
    pub(super) nearest_m: f32,
    /// Distance that half the hits are nearer than; infinite without any.
    pub(super) median_m: f32,
    /// Share of rays that hit within 5 cm.
    pub(super) close_share: f64,
    /// Share of hits on a triangle's back.
    pub(super) back_share: f64,
    /// Share of rays that hit nothing.
    pub(super) open_share: f64,
    /// Height above what is beneath, if anything is there.
    pub(super) beneath_m: Option<f32>,
    /// Whether rays went into a photograph's field of view only, not all around.
    pub(super) in_a_field: bool,
}

/// What is wrong or odd about a place.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct PlaceFault {
    /// Nothing can stand there: not merely odd.
    pub(super) is_impossible: bool,
    /// A sentence on “it”.
    pub(super) sentence: String,
}

impl PlaceFault {
    /// The cause that it is, of the `what` (probe, view) with this name; `None` where it is merely odd.
    pub(super) fn cause(&self, what: &str, name: &str) -> Option<Cause> {
        self.is_impossible.then(|| Cause::of(CauseKind::Place, what, name, &self.sentence))
    }
}

impl Surroundings {
    /// All around a place.
    pub(super) fn of(scene: &Scene, position: Vec3) -> Self {
        const RAYS: usize = 2048;
        Self::along(scene, position, sphere(RAYS), false)
    }

    /// In the field of view of a photograph of so many pixels that was taken there.
    pub(super) fn in_photograph(scene: &Scene, pose: &Pose, projection: &Projection, size: [usize; 2]) -> Self {
        let to_camera = pose.rotation.transpose();
        let shows = |d: Vec3| projection.pixel(size[0], size[1], to_camera * d.as_dvec3()).is_some();
        Self::in_field(scene, scene.local(pose.position), shows)
    }

    /// In the field of view that `shows` directions in the program's axes.
    fn in_field(scene: &Scene, position: Vec3, shows: impl Fn(Vec3) -> bool) -> Self {
        // a photograph of 50° × 40° takes about 800 of these
        const RAYS: usize = 1 << 14;
        Self::along(scene, position, sphere(RAYS).filter(|d| shows(*d)), true)
    }

    fn along(scene: &Scene, position: Vec3, directions: impl Iterator<Item = Vec3>, in_a_field: bool) -> Self {
        const CLOSE_M: f32 = 0.05;
        let cast = |direction| {
            let ray = Ray { origin: position, direction };
            scene.tracer.closest(&ray, 0.0).map(|hit| (hit.t, scene.mesh.normal(hit.triangle).dot(direction) > 0.0))
        };
        let all: Vec<Option<(f32, bool)>> = directions.map(cast).collect();
        let mut hits: Vec<(f32, bool)> = all.iter().flatten().copied().collect();
        hits.sort_by(|a, b| a.0.total_cmp(&b.0));
        let share = |n: usize, of: usize| n as f64 / of.max(1) as f64;
        Self {
            nearest_m: hits.first().map_or(f32::INFINITY, |h| h.0),
            median_m: hits.get(hits.len() / 2).map_or(f32::INFINITY, |h| h.0),
            close_share: share(hits.iter().filter(|h| h.0 < CLOSE_M).count(), all.len()),
            back_share: share(hits.iter().filter(|h| h.1).count(), hits.len()),
            open_share: share(all.len() - hits.len(), all.len()),
            beneath_m: beneath(|direction| cast(direction).map(|hit| hit.0)),
            in_a_field,
        }
    }

    /// What is wrong with a place that has these surroundings. `front_is_usual` says whether one sees the fronts of
    /// triangles there; it is `None` where the model's winding means nothing.
    pub(super) fn faults(&self, front_is_usual: Option<bool>) -> Vec<PlaceFault> {
        let mut faults = Vec::new();
        let impossible = |sentence: String| PlaceFault { is_impossible: true, sentence };
        let odd = |sentence: String| PlaceFault { is_impossible: false, sentence };
        let wrong_share = match front_is_usual {
            Some(true) => self.back_share,
            Some(false) => 1.0 - self.back_share,
            None => 0.0,
        };
        // in the open of a room one sees the other side of a few thin things only
        let cramped = self.back_share > 0.8 && self.median_m < 0.5 && front_is_usual.is_some();
        if self.open_share > 0.999 {
            return vec![impossible(
                "It sees nothing of the model: check its position, site.units and site.up.".to_owned(),
            )];
        }
        if self.close_share > 0.25 {
            faults.push(impossible(format!(
                "It stands in or on a surface: {:.0} % of what surrounds it is nearer than 5 cm.",
                100.0 * self.close_share
            )));
        } else if wrong_share > 0.6 || cramped {
            let share = 100.0 * wrong_share.max(self.back_share);
            faults.push(impossible(format!(
                "It stands inside a wall or below a floor: it sees {share:.0} % of surfaces from behind."
            )));
        }
        match self.beneath_m {
            // a scan has holes where no photograph looked
            None if self.in_a_field => {}
            None => faults
                .push(impossible("There is no surface beneath it: it stands below the floor or outside.".to_owned())),
            Some(height) if height < 0.2 => {
                faults.push(odd(format!("It is only {:.0} cm above the surface beneath.", 100.0 * height)));
            }
            Some(height) if height > 20.0 => {
                faults.push(odd(format!(
                    "It is {height:.0} m above the surface beneath: check its height and site.units."
                )));
            }
            Some(_) => {}
        }
        if self.open_share > 0.5 {
            let where_to = if self.in_a_field { "of its picture" } else { "of directions" };
            faults.push(odd(format!(
                "In {:.0} % {where_to} there is no surface: it may stand outside, or the model is open.",
                100.0 * self.open_share
            )));
        }
        faults
    }
}

/// Whether most places see fronts. A shell may be wound either way; a place that differs from the others is on the other
/// side of a surface.
pub(super) fn usual_side<'a>(around: impl Iterator<Item = &'a Surroundings>) -> bool {
    let (mut fronts, mut all) = (0, 0);
    for a in around {
        fronts += usize::from(a.back_share < 0.5);
        all += 1;
    }
    2 * fronts >= all
}

/// Height above what is beneath; where nothing is straight below, in the narrowest ring around that mostly meets something:
/// scanners do not see what they stand on.
fn beneath(distance: impl Fn(Vec3) -> Option<f32>) -> Option<f32> {
    const TILTS_DEG: [f32; 5] = [2.0, 8.0, 16.0, 30.0, 45.0];
    const RAYS: usize = 12;
    let around = |tilt: &f32| {
        let (sin, cos) = tilt.to_radians().sin_cos();
        let rays = (0..RAYS).filter_map(|i| {
            let (y, x) = (std::f32::consts::TAU * i as f32 / RAYS as f32).sin_cos();
            distance(Vec3::new(sin * x, sin * y, -cos)).map(|t| t * cos)
        });
        let heights: Vec<f32> = rays.collect();
        median(heights.iter().copied()).filter(|_| 2 * heights.len() > RAYS)
    };
    let down = BESIDE.map(|(x, y)| Vec3::new(x, y, -1.0).normalize());
    down.into_iter().find_map(&distance).or_else(|| TILTS_DEG.iter().find_map(around))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::testing::{boxes, grey};

    /// Boxes with fronts outwards, or inwards for a room.
    fn scene(all: &[([f32; 3], [f32; 3], bool)]) -> Scene {
        let corners: Vec<(Vec3, Vec3)> = all.iter().map(|&(low, high, _)| (low.into(), high.into())).collect();
        let mut mesh = boxes(&corners);
        for (triangles, _) in mesh.triangles.chunks_mut(12).zip(all).filter(|(_, b)| b.2) {
            triangles.iter_mut().for_each(|t| t.swap(1, 2));
        }
        grey(mesh, 0.5)
    }

    const ROOM: ([f32; 3], [f32; 3], bool) = ([0.0; 3], [6.0, 5.0, 4.0], true);
    /// Its ends stand out of floor and ceiling.
    const PILLAR: ([f32; 3], [f32; 3], bool) = ([2.0, 2.0, -0.1], [3.0, 3.0, 4.1], false);

    #[test]
    fn a_probe_in_a_room_is_fine_and_one_in_a_pillar_is_not() {
        let scene = scene(&[ROOM, PILLAR]);
        let free = Surroundings::of(&scene, Vec3::new(1.0, 1.0, 1.6));
        assert!(free.back_share < 0.01 && free.open_share == 0.0);
        assert!((free.beneath_m.unwrap() - 1.6).abs() < 1e-4 && (free.nearest_m - 1.0).abs() < 0.01);
        assert_eq!(free.faults(Some(true)), []);
        let inside = Surroundings::of(&scene, Vec3::new(2.5, 2.5, 1.6));
        // floor and ceiling run through the pillar and show their fronts
        assert!(inside.back_share > 0.8);
        let faults = inside.faults(Some(true));
        assert!(faults[0].sentence.contains("inside a wall") && faults[0].is_impossible);
        assert!(!inside.faults(None).iter().any(|f| f.sentence.contains("inside a wall")));
        // a photograph from there, too
        let ahead = Surroundings::in_field(&scene, Vec3::new(2.5, 2.5, 1.6), |d| d.x > 0.8);
        assert!(ahead.faults(Some(true))[0].sentence.contains("inside a wall"));
    }

    #[test]
    fn a_probe_on_a_wall_below_the_floor_or_far_away_is_told() {
        let scene = scene(&[ROOM]);
        let told = |x, y, z| {
            let faults = Surroundings::of(&scene, Vec3::new(x, y, z)).faults(Some(true));
            faults.into_iter().map(|f| f.sentence).collect::<Vec<_>>().join(" ")
        };
        assert!(told(0.01, 2.5, 1.6).contains("in or on a surface"));
        assert!(told(3.0, 2.5, -0.5).contains("no surface beneath"));
        assert!(told(3.0, 2.5, -0.5).contains("below a floor"));
        assert!(told(3000.0, 2.5, 1.6).contains("nothing of the model"));
        assert!(told(3.0, 2.5, 0.1).contains("only 10 cm above"));
    }

    #[test]
    fn a_scanner_stands_in_a_hole_of_its_own() {
        // a floor around a hole of 60 cm
        let slab = |x: [f32; 2], y: [f32; 2]| ([x[0], y[0], -0.1], [x[1], y[1], 0.0], false);
        let [west, east] = [[0.0, 2.7], [3.3, 6.0]].map(|x| slab(x, [0.0, 5.0]));
        let [south, north] = [[0.0, 2.2], [2.8, 5.0]].map(|y| slab([2.7, 3.3], y));
        let scene = scene(&[west, east, south, north]);
        let beneath = |x| Surroundings::of(&scene, Vec3::new(x, 2.5, 1.6)).beneath_m;
        assert!((beneath(3.0).unwrap() - 1.6).abs() < 1e-3);
        assert_eq!(beneath(8.0), None, "a floor far to one side is not beneath");
    }

    #[test]
    fn a_photograph_is_judged_by_what_it_shows() {
        // a scan of one wall: from all around most is open, and there is no floor
        let mut scan = scene(&[ROOM]);
        let keep: Vec<bool> = (0..scan.mesh.triangles.len() as u32).map(|t| scan.mesh.normal(t).x < -0.9).collect();
        scan.tracer = crate::scene::Tracer::over(&scan.mesh, &keep);
        let eye = Vec3::new(3.0, 2.5, 1.6);
        assert_eq!(Surroundings::of(&scan, eye).faults(Some(true)).len(), 2);
        assert_eq!(Surroundings::in_field(&scan, eye, |d| d.x > 0.9).faults(Some(true)), []);
        let away = Surroundings::in_field(&scan, eye, |d| d.x < -0.9).faults(Some(true));
        assert!(away[0].sentence.contains("sees nothing"));
    }

    /// A room whose fronts all point outwards: every probe sees backs, which then is the usual side.
    #[test]
    fn a_room_wound_outwards_is_no_fault() {
        let (low, high, _) = ROOM;
        let scene = scene(&[(low, high, false)]);
        let around = Surroundings::of(&scene, Vec3::new(3.0, 2.5, 1.6));
        assert!(around.back_share > 0.99 && !usual_side([&around].into_iter()));
        assert_eq!(around.faults(Some(false)), []);
    }
}
