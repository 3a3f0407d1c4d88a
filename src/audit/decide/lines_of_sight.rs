//! What the model lacks stands before its surfaces, elsewhere in each photograph: what two photographs show of it lies on lines of
//! sight that meet (epipolar geometry; Hartley and Zisserman, *Multiple View Geometry in Computer Vision*, 2004, chapter 9).

use rayon::prelude::*;

use crate::audit::decide::assessed::Eye;
use crate::audit::picture::regions::mask_of;

/// Pixels from one line of sight to the next that is followed, and places tried on each.
const STEP: usize = 4;
const PLACES: usize = 48;

/// The nearest place, as a share of the way to the modelled surface.
const NEAREST: f32 = 0.125;

/// Whether what two photographs show, given by its pixels in each, may be one thing before the model's surfaces: most lines of sight
/// of either meet the other's.
pub(crate) fn are_one_thing(own: (&Eye, &[usize]), other: (&Eye, &[usize])) -> bool {
    let mostly = |(eye, pixels): (&Eye, &[usize]), (other, theirs): (&Eye, &[usize])| {
        let lines: Vec<usize> = pixels.iter().copied().step_by(STEP).collect();
        let meet = Lines::new(eye, &lines, other).meet(&mask_of(theirs, other.distance.len()));
        2 * meet.iter().filter(|m| **m).count() > lines.len()
    };
    mostly(own, other) && mostly(other, own)
}

/// Lines of sight of one photograph as another sees them.
struct Lines {
    /// Per line, the other's pixels that would show its places before the modelled surfaces.
    before: Vec<Vec<u32>>,
    /// The other's pixel that shows the surface where it ends.
    end: Vec<Option<usize>>,
}

impl Lines {
    /// Those of some of its pixels.
    fn new(own: &Eye, pixels: &[usize], other: &Eye) -> Self {
        let eye = (own.camera.pose.position - own.origin).as_vec3();
        let follow = |&i: &usize| -> (Vec<u32>, Option<usize>) {
            if !own.distance[i].is_finite() {
                return (vec![], None);
            }
            let way = own.position[i] - eye;
            // even steps of the inverse of the distance are about even steps in the other photograph
            let share = |k: usize| 1.0 / (1.0 + (1.0 / NEAREST - 1.0) * k as f32 / (PLACES - 1) as f32);
            let before = (0..PLACES).filter_map(|k| other.before(eye + way * share(k))).map(|i| i as u32);
            (before.collect(), other.on(own.position[i]))
        };
        let (before, end) = pixels.par_iter().map(follow).unzip();
        Self { before, end }
    }

    /// Of each line, whether it meets those of the other's region before the modelled surfaces. One that ends where the other sees the
    /// region is of the same place of a surface, and may show no more than its light or paint.
    fn meet(&self, region: &[bool]) -> Vec<bool> {
        let meets = |(before, end): (&Vec<u32>, &Option<usize>)| {
            !end.is_some_and(|i| region[i]) && before.iter().any(|i| region[*i as usize])
        };
        self.before.par_iter().zip(&self.end).map(meets).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::site::{Camera, Pose};
    use glam::{DVec3, Vec3};

    /// A camera that looks along y at a wall 4 m off.
    fn eye(x: f64) -> Eye {
        let position = DVec3::new(x, 0.0, 0.0);
        let camera = Camera::with_fov(Pose::look_at(position, position + DVec3::Y), 64, 64, 90.0);
        let at = |i: usize| {
            let d = camera.direction((i % 64) as f64 + 0.5, (i / 64) as f64 + 0.5);
            (position + d * (4.0 / d.y)).as_vec3()
        };
        let places: Vec<Vec3> = (0..64 * 64).map(at).collect();
        let distance = places.iter().map(|p| p.distance(position.as_vec3())).collect();
        Eye { camera, origin: DVec3::ZERO, position: places, distance }
    }

    /// Every few pixels of a picture, along each side.
    fn grid() -> Vec<usize> {
        (0..64 * 64).filter(|i| [i % 64, i / 64].iter().all(|k| k % STEP == STEP / 2)).collect()
    }

    /// Where an eye sees a small thing.
    fn seen(eye: &Eye, thing: Vec3) -> (usize, Vec<bool>) {
        let i = eye.before(thing).unwrap();
        let near = |j: usize| (j % 64).abs_diff(i % 64) <= 3 && (j / 64).abs_diff(i / 64) <= 3;
        (i, (0..64 * 64).map(near).collect())
    }

    #[test]
    fn lines_of_sight_meet_at_a_thing_and_beside_it_only_along_a_stripe() {
        let (own, other) = (eye(-0.5), eye(0.5));
        let thing = Vec3::new(0.1, 2.0, 0.3);
        let grid = grid();
        let meet = Lines::new(&own, &grid, &other).meet(&seen(&other, thing).1);
        let (at, around) = seen(&own, thing);
        let within: Vec<bool> = (0..grid.len()).filter(|k| around[grid[*k]]).map(|k| meet[k]).collect();
        assert!(within.len() >= 2 && within.iter().all(|m| *m));
        // the eyes stand side by side, so that the stripe is level
        let level = |k: usize| (grid[k] / 64).abs_diff(at / 64) <= 3 + STEP / 2;
        assert!((0..grid.len()).all(|k| !meet[k] || level(k)));
        assert!(meet.iter().filter(|m| **m).count() * 5 < meet.len());
    }

    #[test]
    fn a_thing_that_two_photographs_show_is_one_and_two_things_are_two() {
        let (own, other) = (eye(-0.5), eye(0.5));
        let pixels = |eye: &Eye, thing: Vec3| -> Vec<usize> {
            let (_, around) = seen(eye, thing);
            (0..around.len()).filter(|i| around[*i]).collect()
        };
        let (thing, lower) = (Vec3::new(0.1, 2.0, 0.3), Vec3::new(0.1, 2.0, -0.6));
        let here = pixels(&own, thing);
        assert!(are_one_thing((&own, &here), (&other, &pixels(&other, thing))));
        assert!(!are_one_thing((&own, &here), (&other, &pixels(&other, lower))));
        let on_the_wall = |eye: &Eye| -> Vec<usize> {
            (0..64 * 64).filter(|i| eye.position[*i].distance(Vec3::new(0.0, 4.0, 0.0)) < 0.4).collect()
        };
        assert!(!are_one_thing((&own, &on_the_wall(&own)), (&other, &on_the_wall(&other))));
    }

    #[test]
    fn what_two_photographs_show_of_one_place_of_a_wall_is_no_thing_before_it() {
        let (own, other) = (eye(-0.5), eye(0.5));
        let place = Vec3::new(0.0, 4.0, 0.0);
        let mask = |eye: &Eye| -> Vec<bool> { eye.position.iter().map(|p| p.distance(place) < 0.4).collect() };
        let (grid, inside) = (grid(), mask(&own));
        let meet = Lines::new(&own, &grid, &other).meet(&mask(&other));
        let within: Vec<bool> = (0..grid.len()).filter(|k| inside[grid[*k]]).map(|k| meet[k]).collect();
        assert!(within.len() >= 2 && within.iter().all(|m| !m));
    }
}
