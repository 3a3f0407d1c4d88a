//! Grid, cache points, guided rays, and the fill in a furnace.

use super::cache_points::plastic;
use super::guide::Lobes;
use super::transport::first_met;
use super::{CachePoints, Grid, Guide, Nearby, Transport, Volume, VolumeSettings};
use crate::panorama::{Picture, Radiometry};
use crate::scene::Ray;
use crate::scene::testing::{grey, parallelograms};
use crate::shoot::{Chart, Hits, Light};
use glam::{IVec3, Mat3, Vec2, Vec3};
use proptest::prelude::*;
use std::f32::consts::{PI, TAU};
use std::sync::Arc;

fn sides(size: Vec3) -> Vec<(Vec3, Vec3, Vec3)> {
    let (x, y, z) = (Vec3::X * size, Vec3::Y * size, Vec3::Z * size);
    vec![(Vec3::ZERO, x, y), (z, x, y), (Vec3::ZERO, x, z), (y, x, z), (Vec3::ZERO, y, z), (x, y, z)]
}

proptest! {
    #[test]
    fn every_point_of_the_box_is_in_a_cell(
        low in prop::array::uniform3(-50.0f32..50.0),
        size in prop::array::uniform3(0.0f32..200.0),
        along in 1u32..100,
        at in prop::array::uniform3(0.0f32..1.0),
    ) {
        let (low, size) = (Vec3::from(low), Vec3::from(size));
        let grid = Grid::over(low, low + size, along);
        prop_assert_eq!(grid.size.max_element(), along as i32);
        let cell = grid.cell(low + Vec3::from(at) * size);
        let index = grid.index(cell).expect("inside");
        prop_assert!(index < grid.len());
        prop_assert_eq!(grid.cell(grid.centre(cell)), cell);
        let near = (grid.centre(cell) - low - Vec3::from(at) * size).abs().max_element();
        prop_assert!(near <= 0.5001 * grid.cell_m + 1e-4, "{near} {}", grid.cell_m);
        prop_assert!(grid.index(IVec3::new(-1, 0, 0)).is_none() && grid.index(grid.size).is_none());
    }

    /// Every surface point has a cache point beside it, on its own side.
    #[test]
    fn every_surface_point_has_an_anchor_near(
        size in prop::array::uniform3(1.0f32..20.0), along in 4u32..40, wall in 0usize..6, at in prop::array::uniform2(0.0f32..1.0), back: bool,
    ) {
        let quads = sides(Vec3::from(size));
        let scene = grey(parallelograms(&quads), 0.5);
        let (low, high) = scene.mesh.bounds();
        let cache_points = CachePoints::over(&scene, Grid::over(low, high, along));
        let (corner, u, v) = quads[wall];
        let normal = u.cross(v).normalize() * if back { -1.0 } else { 1.0 };
        let mut found = Vec::new();
        cache_points.around(corner + u * at[0] + v * at[1], normal, &mut found);
        prop_assert!(!found.is_empty());
        let best = &cache_points.list[found[0].1 as usize];
        prop_assert!(best.normal.dot(normal) > 0.99);
        prop_assert!(best.position.distance(corner + u * at[0] + v * at[1]) < 1.75 * cache_points.grid.cell_m);
        prop_assert!(found.windows(2).all(|w| w[0].0 >= w[1].0), "best first");
    }
}

/// Several guides: none, small and large spheres, partly below the horizon, overlapping, one around the point.
fn guides() -> Vec<Guide> {
    let grid = Grid::over(Vec3::splat(-5.0), Vec3::splat(5.0), 20);
    let ball = |centre: Vec3, radius: f32, power: f32| {
        (0..200).map(move |i| {
            let z = 1.0 - (i as f32 + 0.5) / 100.0;
            let (s, c) = (i as f32 * 2.4).sin_cos();
            (centre + radius * Vec3::new(c * (1.0 - z * z).sqrt(), s * (1.0 - z * z).sqrt(), z), power / 200.0)
        })
    };
    vec![
        Guide::default(),
        Guide::new(&grid, ball(Vec3::new(0.3, 0.2, 3.0), 0.05, 10.0)),
        Guide::new(&grid, ball(Vec3::new(3.0, 1.0, 0.1), 0.2, 1.0).chain(ball(Vec3::new(-1.0, 0.2, 1.0), 0.2, 5.0))),
        Guide::new(&grid, ball(Vec3::new(0.5, 0.5, 0.5), 2.0, 3.0)),
        Guide::new(&grid, ball(Vec3::ZERO, 0.1, 3.0).chain(ball(Vec3::new(0.0, 2.0, -0.05), 0.3, 3.0))),
    ]
}

/// A guide from a point that nothing hides a sphere from, of at most 48 spheres.
fn in_the_open(guide: &Guide, point: Vec3, normal: Vec3) -> Lobes {
    let far_off = grey(parallelograms(&[(Vec3::splat(-100.0), Vec3::X, Vec3::Y)]), 0.5);
    guide.of(point, normal, &guide.clear(&far_off, point, normal, 48))
}

/// Veach's two tests of a sampler: Σ f/pdf finds integrals over the hemisphere whatever the guide, and directions fall
/// into bins as often as the density says.
#[test]
fn guided_rays_have_the_density_they_claim() {
    const N: u32 = 200_000;
    const ROWS: usize = 8;
    const COLUMNS: usize = 16;
    for (g, guide) in guides().iter().enumerate() {
        let lobes = in_the_open(guide, Vec3::ZERO, Vec3::Z);
        let (mut area, mut cosine) = (0.0f64, 0.0f64);
        // per bin how many fell in, and 1/pdf summed: an estimate of the bin's solid angle
        let mut bins = vec![(0u32, 0.0f64); ROWS * COLUMNS];
        for k in 0..N {
            let u = plastic(u64::from(k) + 1);
            let pick = (f64::from(k) * 0.618_033_988_749_895).fract() as f32;
            let Some((d, pdf)) = lobes.sample(pick, u) else { continue };
            assert!(pdf > 0.0 && pdf.is_finite() && (d.length() - 1.0).abs() < 1e-4 && d.z > 0.0);
            area += 1.0 / f64::from(pdf);
            cosine += f64::from(d.z / pdf);
            let row = ((d.z * ROWS as f32) as usize).min(ROWS - 1);
            let column = (((d.y.atan2(d.x) / TAU + 0.5) * COLUMNS as f32) as usize).min(COLUMNS - 1);
            let bin = &mut bins[row * COLUMNS + column];
            *bin = (bin.0 + 1, bin.1 + 1.0 / f64::from(pdf));
        }
        let (area, cosine) = (area / f64::from(N), cosine / f64::from(N));
        assert!((cosine / std::f64::consts::PI - 1.0).abs() < 0.01, "guide {g}: {cosine}");
        // 1/pdf has no finite variance at the horizon
        assert!((area / (2.0 * std::f64::consts::PI) - 1.0).abs() < 0.05, "guide {g}: {area}");
        let even = 2.0 * std::f64::consts::PI / (ROWS * COLUMNS) as f64;
        for (i, (count, sum)) in bins.iter().enumerate().skip(COLUMNS) {
            let ratio = sum / f64::from(N) / even;
            // bins are of equal solid angle; few rays in a bin tell little
            let tolerance = 6.0 / f64::from(*count).sqrt() + 0.03;
            assert!((ratio - 1.0).abs() < tolerance, "guide {g}, bin {i}: {ratio} from {count} rays");
        }
    }
}

/// What rounding does to an upright wall, as cutting its triangles does, hardly turns a ray from it.
#[test]
fn rays_from_an_upright_wall_hang_on_no_last_digit() {
    const RAYS: u32 = 96;
    let grid = Grid::over(Vec3::splat(-5.0), Vec3::splat(5.0), 20);
    // more bright things than a point follows, at places and of powers that any sequence gives
    let pieces = (1..200u64).map(|i| {
        let at = plastic(i);
        (Vec3::new(3.0 + at.x, 9.0 * at.y - 4.5, (at.x * 37.0).fract() * 9.0 - 4.5), 0.2 + (at.y * 53.0).fract())
    });
    let guide = Guide::new(&grid, pieces);
    let cast = |off: f32| {
        let lobes = in_the_open(&guide, Vec3::new(off, -off, off), Vec3::new(1.0, 0.0, off).normalize());
        let ray = |k: u32| lobes.sample((k as f32 + 0.5) / RAYS as f32, plastic(u64::from(k)));
        (0..RAYS).filter_map(ray).map(|r| r.0).collect::<Vec<_>>()
    };
    let (one, other) = (cast(1e-7), cast(-1e-7));
    assert_eq!(one.len(), other.len());
    let turned = one.iter().zip(&other).filter(|(a, b)| a.distance(**b) > 1e-4).count();
    assert!(turned <= 1, "{turned} of {} rays", one.len());
}

/// A panel in a white closed room of radiance L: the probe does not see its back, whose irradiance is πL.
#[test]
fn an_unseen_wall_of_a_white_furnace_has_the_closed_form() {
    let mut quads = sides(Vec3::new(4.0, 3.0, 2.5));
    quads.push((Vec3::new(2.8, 0.8, 0.6), Vec3::Y * 1.2, Vec3::Z * 1.2));
    let scene = grey(parallelograms(&quads), 1.0);
    let hits = Hits::shoot(&scene, Vec3::new(1.7, 1.4, 1.3), Mat3::IDENTITY, Chart::latlong(64, 32));
    let picture = Picture { width: 64, height: 32, pixels: vec![Vec3::splat(3.0); 64 * 32] };
    let light = Light::new(&scene, [(Arc::new(hits), &picture, Radiometry::default())], None, None);
    let points: Vec<(Vec3, Vec3)> = (0..36)
        .map(|i| Vec2::new((i % 6) as f32 + 0.5, (i / 6) as f32 + 0.5) * 0.2)
        .map(|u| (Vec3::new(2.8, 0.8 + u.x, 0.6 + u.y), Vec3::X))
        .collect();
    assert!(points.iter().all(|&(p, n)| light.observe(&scene, p, n).is_none()));
    let transport = Transport::cast(
        &scene,
        &points,
        &[&light],
        &VolumeSettings { cells: 32, rays: 96, ..VolumeSettings::default() },
    );
    let volume = Volume::new(&scene, &transport, &light);
    assert!(!volume.is_empty());
    let mut mean = 0.0;
    for &(p, n) in &points {
        let e = volume.irradiance(&scene, p, n, &mut Nearby::default()).expect("the panel was wanted").irradiance.x
            / (PI * 3.0);
        assert!((e - 1.0).abs() < 0.05, "{p}: {e}");
        mean += e / points.len() as f32;
        let on_the_spot = volume.gather(&scene, &light, p, n, &mut Nearby::default()).irradiance.x / (PI * 3.0);
        assert!((on_the_spot - 1.0).abs() < 0.1, "{p}: {on_the_spot}");
    }
    assert!((mean - 1.0).abs() < 0.01, "{mean}");
}

#[test]
fn the_bottom_of_a_cup_that_hides_from_all_anchors_gets_one_of_its_own() {
    // a room of 4 m, and a cup of 6 cm on its floor, between the lines of the lattice that cache points lie on
    let mut quads = sides(Vec3::splat(4.0));
    let (low, size) = (Vec3::new(1.635, 1.635, 0.02), 0.06);
    let cup = sides(Vec3::splat(size)).into_iter().enumerate().filter(|&(i, _)| i != 1);
    quads.extend(cup.map(|(_, (corner, u, v))| (low + corner, u, v)));
    let scene = grey(parallelograms(&quads), 0.5);
    let (min, max) = scene.mesh.bounds();
    let mut cache_points = CachePoints::over(&scene, Grid::over(min, max, 8));
    let before = cache_points.list.len();
    let points: Vec<(Vec3, Vec3)> = (0..25)
        .map(|i| (low + Vec3::new(0.2 * (i % 5) as f32 + 0.1, 0.2 * (i / 5) as f32 + 0.1, 0.0) * size, Vec3::Z))
        .collect();
    let lonely = |cache_points: &CachePoints| {
        let mut found = Vec::new();
        let sees = |&&(point, normal): &&(Vec3, Vec3)| {
            cache_points.around(point, normal, &mut found);
            !found.iter().any(|f| cache_points.sees(&scene, f.1, point, normal))
        };
        points.iter().filter(sees).count()
    };
    assert_eq!(lonely(&cache_points), points.len(), "the cup must hide from the room");
    cache_points.complete(&scene, &points, VolumeSettings::default().spacing);
    assert_eq!(lonely(&cache_points), 0);
    assert!((1..=4).contains(&(cache_points.list.len() - before)), "{}", cache_points.list.len() - before);
}

/// Places that were not gathered are spoken for by a gathered one beside them, never through a third: few rays' noise stays
/// where it is.
#[test]
fn what_stands_in_for_a_place_lies_beside_it() {
    let mut quads = sides(Vec3::new(4.0, 3.0, 2.5));
    // a wall that leaves a gap of 30 cm: the probe sees little behind it
    quads.push((Vec3::new(2.0, 0.0, 0.0), Vec3::Y * 2.7, Vec3::Z * 2.5));
    let scene = grey(parallelograms(&quads), 0.5);
    let hits = Hits::shoot(&scene, Vec3::new(1.0, 1.0, 1.3), Mat3::IDENTITY, Chart::latlong(64, 32));
    let picture = Picture { width: 64, height: 32, pixels: vec![Vec3::ONE; 64 * 32] };
    let light = Light::new(&scene, [(Arc::new(hits), &picture, Radiometry::default())], None, None);
    let wanted = [(Vec3::new(3.0, 1.0, 0.0), Vec3::Z)];
    let Transport { cache_points, gathered, places, .. } = Transport::cast(
        &scene,
        &wanted,
        &[&light],
        &VolumeSettings { cells: 32, rays: 512, ..VolumeSettings::default() },
    );
    let mut stand_ins = 0;
    for (of, &place) in places.iter().enumerate() {
        let Some(by) = gathered.get(place as usize).map(|g| g.cache_point) else { continue };
        let [of, by] = [of, by as usize].map(|i| cache_points.list[i]);
        let far = of.position.distance(by.position) / cache_points.grid.cell_m;
        assert!(far < 1.1 && of.normal.dot(by.normal) > 0.3, "{far} cells off");
        stand_ins += usize::from(far > 0.0);
    }
    assert!(stand_ins > 20, "{stand_ins}");
}

/// What gets out of a room through a crack of a scan tells of the wall beside it; what gets out through a window, or of a model, of the sky.
#[test]
fn a_ray_through_a_crack_of_a_scan_meets_the_wall_and_one_through_a_window_the_sky() {
    const TILES: i32 = 40;
    let met = |opening: f32, scan: bool| {
        // a room of 4 m, one of whose walls has two halves of tiles of some 5 cm, and a slit so wide between them
        let mut quads = sides(Vec3::splat(4.0));
        quads.pop();
        let side = (2.0 - 0.5 * opening) / TILES as f32;
        for (i, k) in (-TILES..TILES).flat_map(|i| (0..2 * TILES).map(move |k| (i, k))) {
            let aside = if i < 0 { -0.5 * opening } else { 0.5 * opening };
            let corner = Vec3::new(4.0, 2.0 + aside + i as f32 * side, k as f32 * 0.05);
            quads.push((corner, Vec3::Y * side, Vec3::Z * 0.05));
        }
        let mut mesh = parallelograms(&quads);
        let colour = |i: usize| Vec3::splat(0.4 + 0.1 * (i % 3) as f32);
        mesh.colours = (0..if scan { mesh.positions.len() } else { 0 }).map(colour).collect();
        let ray = Ray { origin: Vec3::new(2.0, 2.0, 2.01), direction: Vec3::X };
        // 80 cm wide at the wall
        first_met(&grey(mesh, 0.5), &ray, 0.4).map(|(ray, hit)| ray.origin + ray.direction * hit.t)
    };
    let beside = met(0.01, true).expect("a crack");
    let away = beside.distance(Vec3::new(4.0, 2.0, 2.01));
    assert!((beside.x - 4.0).abs() < 1e-3 && (0.3..0.5).contains(&away), "{beside}");
    assert!(met(0.01, false).is_none() && met(0.3, true).is_none() && met(0.3, false).is_none());
    assert!(met(-0.2, true).is_some_and(|p| p.distance(Vec3::new(4.0, 2.0, 2.01)) < 1e-3));
}
