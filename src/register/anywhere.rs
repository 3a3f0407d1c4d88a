//! Pictures that were taken somewhere on the site's floors, nobody knows where.

use glam::Vec3;
use rayon::prelude::*;
use std::collections::BTreeMap;

use super::eye::{Eye, SEARCHED, level, tilts};
use super::model::LocalPose;
use super::picture::Level;
use super::search::{Candidate, Headings, Masked};
use crate::plan::floors::find::find_floors;
use crate::plan::floors::floor::Floor;
use crate::scene::Scene;
use crate::site::Site;

/// How far apart places are tried, metres; farther on floors so large that there would be more places than this.
const STEP_M: f64 = 0.35;
const MOST_PLACES: f64 = 12_000.0;

/// Lenses are looked for at these heights, as differences from the one that `[plan]` has, metres.
const HEIGHTS_M: [f32; 2] = [0.0, -0.4];

/// Candidates that are handed on of a picture.
const MOST_CANDIDATES: usize = 2_000;

/// Per picture the poses anywhere on the site's floors that its features speak for, best first. The pictures stand as
/// upright as the site file has them: each place is seen once, for all of them, at half the cells that a search around a known place
/// has. In a model without floors they are looked for everywhere.
pub(super) fn on_floors(site: &Site, scene: &Scene, eyes: &[&Eye]) -> Vec<Vec<LocalPose>> {
    let places = match find_floors(scene, &site.plan, true) {
        Ok(found) => lenses(&found.floors, site.plan.probe_height_m),
        // a part of a building, such as a scan of a corner
        Err(_) => within(scene.mesh.bounds()),
    };
    let mut all = vec![Vec::new(); eyes.len()];
    // photographs have finer cells than panoramas
    let mut by_size: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    for (i, eye) in eyes.iter().enumerate() {
        by_size.entry(coarsest(eye).raster.full / 2).or_default().push(i);
    }
    for (full, of_size) in by_size {
        let headings = Headings::new(full);
        let upright = |eye: &Eye| headings.masked(coarsest(eye), tilts(&eye.given.rotation, 0.0)[0]);
        let pictures: Vec<Masked> = of_size.par_iter().map(|&i| upright(eyes[i])).collect();
        let seen: Vec<Vec<Vec<Candidate>>> = places
            .par_iter()
            .map(|place| {
                let model = headings.model(scene, *place);
                pictures.iter().map(|picture| headings.peaks(picture, *place, &model)).collect()
            })
            .collect();
        for of_place in seen {
            for (&i, candidates) in of_size.iter().zip(of_place) {
                all[i].extend(candidates);
            }
        }
    }
    let best = |mut candidates: Vec<Candidate>| {
        // stable: equals stay in the order of places
        candidates.sort_by(|a, b| b.score.total_cmp(&a.score));
        candidates.into_iter().take(MOST_CANDIDATES).map(|c| c.pose).collect()
    };
    all.into_iter().map(best).collect()
}

fn coarsest(eye: &Eye) -> &Level {
    level(&eye.levels, SEARCHED)
}

/// Places over the floors where a lens may have been, local metres: also over tables and pews.
fn lenses(floors: &[Floor], probe_height_m: f64) -> Vec<Vec3> {
    let area: f64 = floors.iter().map(|f| f.target.area()).sum();
    let step_m = STEP_M.max((area * HEIGHTS_M.len() as f64 / MOST_PLACES).sqrt());
    let mut places = Vec::new();
    for floor in floors {
        let grid = floor.target.grid;
        let every = (step_m / grid.cell_m).round().max(1.0) as usize;
        let on_lattice =
            |cell: &usize| (cell % grid.width) % every == every / 2 && (cell / grid.width) % every == every / 2;
        for cell in floor.target.cells().filter(on_lattice) {
            let at = grid.middle(cell);
            let lens = floor.lens(at, probe_height_m);
            places.extend(HEIGHTS_M.map(|h| at.as_vec2().extend(lens + h)));
        }
    }
    places
}

/// Places everywhere inside of bounds, local metres.
fn within((low, high): (Vec3, Vec3)) -> Vec<Vec3> {
    let size = (high - low).max(Vec3::ZERO);
    let step_m = (STEP_M as f32).max((size.x * size.y * size.z / MOST_PLACES as f32).cbrt());
    let count = (size / step_m).floor().as_uvec3() + 1;
    let rim = 0.5 * (size - (count - 1).as_vec3() * step_m);
    let at = |x, y, z| low + rim + glam::UVec3::new(x, y, z).as_vec3() * step_m;
    (0..count.z).flat_map(|z| (0..count.y).flat_map(move |y| (0..count.x).map(move |x| at(x, y, z)))).collect()
}
