//! Pictures that were taken somewhere on the site's floors, nobody knows where.

use glam::{Mat3, Vec3};
use rayon::prelude::*;

use super::eye::{Eye, SEARCHED, level, tilts};
use super::model::{GeometryBuffer, LocalPose};
use super::picture::Level;
use super::search::{Candidate, Headings, Masked, of_model, of_picture};
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
pub(super) fn on_floors(site: &Site, scene: &Scene, eyes: &[&Eye]) -> Vec<Vec<Candidate>> {
    let places = match find_floors(scene, &site.plan, true) {
        Ok(found) => lenses(&found.floors, site.plan.probe_height_m),
        // a part of a building, such as a scan of a corner
        Err(_) => within(scene.mesh.bounds()),
    };
    let mut all = vec![Vec::new(); eyes.len()];
    // photographs have finer cells than panoramas
    let mut sizes: Vec<usize> = eyes.iter().map(|e| coarsest(e).raster.full / 2).collect();
    sizes.sort_unstable();
    sizes.dedup();
    for full in sizes {
        let headings = Headings::new(full);
        let raster = headings.raster();
        let of_size: Vec<usize> = (0..eyes.len()).filter(|&i| coarsest(eyes[i]).raster.full / 2 == full).collect();
        let pictures: Vec<(Mat3, Masked)> = of_size
            .par_iter()
            .map(|&i| {
                let upright = tilts(&eyes[i].given.rotation, 0.0)[0];
                (upright, headings.masked(&of_picture(raster, coarsest(eyes[i]), upright)))
            })
            .collect();
        let seen: Vec<Vec<Vec<Candidate>>> = places
            .par_iter()
            .map(|place| {
                let pose = LocalPose { origin: *place, rotation: Mat3::IDENTITY };
                let model = headings.spectra(&of_model(raster, &GeometryBuffer::cast(scene, raster, &pose)));
                pictures.iter().map(|(upright, picture)| headings.peaks(picture, *upright, *place, &model)).collect()
            })
            .collect();
        for of_place in seen {
            for (&i, candidates) in of_size.iter().zip(of_place) {
                all[i].extend(candidates);
            }
        }
    }
    for candidates in &mut all {
        // stable: equals stay in the order of places
        candidates.sort_by(|a, b| b.score.total_cmp(&a.score));
        candidates.truncate(MOST_CANDIDATES);
    }
    all
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
