//! Ray casting: single rays against brute force, packets against single rays, and what ray casters trip over.

use crate::support::data::shared;
use crate::support::{load, on_threads};
use clerestory::scene::{Hit, Mesh, Ray, Tracer};
use glam::{DVec3, Quat, Vec3};

/// A small linear congruential generator (Knuth's MMIX constants).
struct Dice(u64);

impl Dice {
    fn unit(&mut self) -> f32 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 40) as f32 / (1u64 << 24) as f32
    }

    fn signed(&mut self) -> Vec3 {
        Vec3::new(self.unit(), self.unit(), self.unit()) * 2.0 - 1.0
    }

    fn direction(&mut self) -> Vec3 {
        loop {
            let d = self.signed();
            if (0.01..1.0).contains(&d.length()) {
                return d.normalize();
            }
        }
    }
}

fn mesh(triangles: impl IntoIterator<Item = [Vec3; 3]>) -> Mesh {
    let mut mesh = Mesh::default();
    for corners in triangles {
        let first = mesh.positions.len() as u32;
        mesh.positions.extend(corners);
        mesh.triangles.push([first, first + 1, first + 2]);
    }
    mesh
}

fn soup(count: usize, size: f32, dice: &mut Dice) -> Mesh {
    mesh((0..count).map(|_| {
        let at = dice.signed() * 10.0;
        [at, at + dice.signed() * size, at + dice.signed() * size]
    }))
}

/// A closed box of axis-aligned walls, each a grid of `n`×`n` squares in two triangles; vertices are shared.
fn room(half: Vec3, n: u32) -> Mesh {
    let mut mesh = Mesh::default();
    for axis in 0..3 {
        for side in [-1.0, 1.0] {
            let first = mesh.positions.len() as u32;
            for i in 0..=n {
                for j in 0..=n {
                    let at = |k: u32| k as f32 / n as f32 * 2.0 - 1.0;
                    let mut p = Vec3::ZERO;
                    p[axis] = side;
                    p[(axis + 1) % 3] = at(i);
                    p[(axis + 2) % 3] = at(j);
                    mesh.positions.push(p * half);
                }
            }
            for i in 0..n {
                for j in 0..n {
                    let p = first + i * (n + 1) + j;
                    mesh.triangles.extend([[p, p + 1, p + n + 2], [p, p + n + 2, p + n + 1]]);
                }
            }
        }
    }
    mesh
}

/// A room whose vertices lie at no special places.
fn crooked_room(dice: &mut Dice) -> Mesh {
    let mut mesh = room(Vec3::new(4.0, 3.0, 2.0), 12);
    let turn = Quat::from_axis_angle(dice.direction(), 0.7);
    // the same jitter for the same place, so that walls keep meeting
    for p in &mut mesh.positions {
        let jitter = Vec3::new((p.dot(Vec3::new(12.9, 78.2, 37.7))).sin(), p.x * p.y * 0.1, p.z * p.y * 0.1);
        *p = turn * (*p + jitter * 0.02);
    }
    mesh
}

/// Distances by Möller and Trumbore's test in f64 against every triangle.
fn brute(mesh: &Mesh, ray: &Ray, t_min: f64) -> Option<f64> {
    let (o, d) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
    let meet = |i: u32| -> Option<f64> {
        let [a, b, c] = mesh.corners(i).map(|p| p.as_dvec3());
        let (e1, e2): (DVec3, DVec3) = (b - a, c - a);
        let p = d.cross(e2);
        let inv = 1.0 / e1.dot(p);
        let s = o - a;
        let (u, q) = (s.dot(p) * inv, s.cross(e1));
        let v = d.dot(q) * inv;
        (u >= 0.0 && v >= 0.0 && u + v <= 1.0).then(|| e2.dot(q) * inv).filter(|&t| t > t_min)
    };
    (0..mesh.triangles.len() as u32).filter_map(meet).min_by(f64::total_cmp)
}

fn packet(tracer: &Tracer, origin: Vec3, directions: &[Vec3], t_min: f32) -> Vec<Option<Hit>> {
    let mut hits = vec![Some(Hit { t: -1.0, triangle: 7 }); directions.len()];
    tracer.closest_packet(origin, directions, t_min, &mut hits);
    hits
}

fn singles(tracer: &Tracer, origin: Vec3, directions: &[Vec3], t_min: f32) -> Vec<Option<Hit>> {
    directions.iter().map(|&direction| tracer.closest(&Ray { origin, direction }, t_min)).collect()
}

#[test]
fn single_rays_find_what_brute_force_finds() {
    let mut dice = Dice(1);
    let mesh = soup(400, 3.0, &mut dice);
    let tracer = Tracer::new(&mesh);
    let mut found = 0;
    for _ in 0..4000 {
        let ray = Ray { origin: dice.signed() * 9.0, direction: dice.direction() };
        let (ours, truth) = (tracer.closest(&ray, 1e-3), brute(&mesh, &ray, 1e-3));
        match (ours, truth) {
            (Some(hit), Some(t)) => assert!((f64::from(hit.t) - t).abs() <= 1e-5 * t.max(1.0), "{hit:?} {t} {ray:?}"),
            (None, None) => {}
            _ => panic!("{ours:?} {truth:?} {ray:?}"),
        }
        if let Some(hit) = ours {
            found += 1;
            assert!(tracer.occluded(&ray, 1e-3, hit.t * 1.001) && !tracer.occluded(&ray, 1e-3, hit.t));
            assert!(tracer.occluded(&ray, 1e-3, f32::INFINITY));
        } else {
            assert!(!tracer.occluded(&ray, 1e-3, f32::INFINITY));
        }
    }
    assert!(found > 1000);
}

#[test]
fn packets_find_exactly_what_single_rays_find() {
    let mut dice = Dice(2);
    for (count, size) in [(1, 9.0), (2, 9.0), (3, 9.0), (60, 4.0), (3000, 1.0)] {
        let mesh = soup(count, size, &mut dice);
        let tracer = Tracer::new(&mesh);
        for _ in 0..200 {
            let origin = dice.signed() * 12.0;
            let middle = dice.direction();
            // from a pencil to all around, and a few rays to several packets
            let spread = 10f32.powf(-4.0 * dice.unit() + 1.0);
            let n = 1 + (dice.unit() * 150.0) as usize;
            let directions: Vec<Vec3> = (0..n).map(|_| (middle + dice.signed() * spread).normalize()).collect();
            assert_eq!(packet(&tracer, origin, &directions, 1e-4), singles(&tracer, origin, &directions, 1e-4));
        }
    }
}

#[test]
fn packets_and_single_rays_agree_along_axes_and_in_flat_boxes() {
    let mesh = room(Vec3::new(4.0, 3.0, 2.0), 4);
    let tracer = Tracer::new(&mesh);
    let mut dice = Dice(3);
    // also on the planes and lines of the grid
    for origin in [Vec3::ZERO, Vec3::new(2.0, 1.5, -1.0), Vec3::new(0.3, -0.1, 0.7), Vec3::new(-4.0, 0.1, 0.2)] {
        for axis in [Vec3::X, Vec3::Y, Vec3::Z] {
            for sign in [-1.0, 1.0] {
                for n in [1, 7, 64] {
                    let mut directions = vec![axis * sign; n];
                    for d in directions.iter_mut().skip(1) {
                        // some stay exactly on a plane
                        let aside = dice.signed() * 0.1;
                        *d = (*d + if dice.unit() < 0.5 { aside } else { Vec3::new(0.0, aside.y, 0.0) }).normalize();
                    }
                    let hits = packet(&tracer, origin, &directions, 1e-4);
                    assert_eq!(hits, singles(&tracer, origin, &directions, 1e-4));
                    assert!(origin.x < -3.9 || hits.iter().all(Option::is_some), "{origin} {axis} {sign}");
                }
            }
        }
    }
}

#[test]
fn negative_zeros_in_directions_change_nothing() {
    let tracer = Tracer::new(&room(Vec3::new(4.0, 3.0, 2.0), 4));
    let origin = Vec3::new(0.3, 0.4, 0.1);
    for axis in 0..3 {
        for sign in [-1.0, 1.0] {
            for zeros in [[0.0, 0.0], [-0.0, 0.0], [0.0, -0.0], [-0.0, -0.0]] {
                let mut direction = Vec3::ZERO;
                direction[axis] = sign;
                direction[(axis + 1) % 3] = zeros[0];
                direction[(axis + 2) % 3] = zeros[1];
                let ray = Ray { origin, direction };
                let wall = [4.0, 3.0, 2.0][axis] - sign * origin[axis];
                let hit = tracer.closest(&ray, 1e-4).unwrap();
                assert!((hit.t - wall).abs() < 1e-6);
                assert!(tracer.occluded(&ray, 1e-4, 9.0));
                assert_eq!(packet(&tracer, origin, &[direction; 5], 1e-4), [Some(hit); 5]);
            }
        }
    }
}

/// Boxes that end so near to a ray's origin are not left out.
#[test]
fn surfaces_a_twentieth_of_a_millimetre_away_are_found() {
    let half = Vec3::new(4.0, 3.0, 2.0);
    let tracer = Tracer::new(&room(half, 4));
    for axis in 0..3 {
        for sign in [-1.0, 1.0] {
            let mut direction = Vec3::ZERO;
            direction[axis] = sign;
            let origin = Vec3::new(0.3, 0.4, 0.1) * (Vec3::ONE - direction.abs()) + direction * (half - 5e-5);
            let hit = tracer.closest(&Ray { origin, direction }, 1e-5);
            assert!(hit.is_some_and(|hit| (hit.t - 5e-5).abs() < 1e-6), "{hit:?}");
            assert!(tracer.occluded(&Ray { origin, direction }, 0.0, 1e-4));
            assert_eq!(packet(&tracer, origin, &[direction; 9], 1e-5), [hit; 9]);
            assert_eq!(tracer.closest(&Ray { origin, direction }, 1e-4), None);
        }
    }
}

#[test]
fn rays_at_shared_edges_and_corners_do_not_leak() {
    let mut dice = Dice(4);
    for mesh in [room(Vec3::new(4.0, 3.0, 2.0), 12), crooked_room(&mut dice)] {
        let tracer = Tracer::new(&mesh);
        for _ in 0..40 {
            let origin = dice.signed();
            let mut aims = mesh.positions.clone();
            for i in 0..mesh.triangles.len() as u32 {
                let [a, b, c] = mesh.corners(i);
                let s = dice.unit();
                aims.extend([a.lerp(b, s), b.lerp(c, s), c.lerp(a, s)]);
            }
            let directions: Vec<Vec3> = aims.iter().map(|p| (p - origin).normalize()).collect();
            let leaks = singles(&tracer, origin, &directions, 1e-4).iter().filter(|hit| hit.is_none()).count();
            assert_eq!(leaks, 0);
            assert_eq!(packet(&tracer, origin, &directions, 1e-4), singles(&tracer, origin, &directions, 1e-4));
        }
    }
}

#[test]
fn nothing_is_found_in_an_empty_mesh() {
    let tracer = Tracer::new(&Mesh::default());
    let ray = Ray { origin: Vec3::ZERO, direction: Vec3::X };
    assert_eq!(tracer.closest(&ray, 0.0), None);
    assert!(!tracer.occluded(&ray, 0.0, f32::INFINITY));
    assert_eq!(packet(&tracer, Vec3::ZERO, &[Vec3::X; 65], 0.0), vec![None; 65]);
    assert_eq!(packet(&tracer, Vec3::ZERO, &[], 0.0), vec![]);
}

#[test]
fn directions_that_are_none_find_nothing() {
    let tracer = Tracer::new(&room(Vec3::ONE, 2));
    for bad in [Vec3::NAN, Vec3::ZERO, Vec3::INFINITY] {
        let hits = packet(&tracer, Vec3::ZERO, &[Vec3::X, bad, Vec3::X], 0.0);
        assert!(hits[1].is_none());
    }
}

#[test]
fn the_number_of_threads_changes_nothing() {
    let mesh = soup(5000, 1.0, &mut Dice(5));
    let cast = |threads| {
        let tracer = on_threads(threads, || Tracer::new(&mesh));
        let mut dice = Dice(6);
        let hits: Vec<_> = (0..5000)
            .map(|_| tracer.closest(&Ray { origin: dice.signed() * 9.0, direction: dice.direction() }, 0.0))
            .collect();
        (tracer.bytes(), hits)
    };
    assert_eq!(cast(1), cast(2));
}

#[test]
fn packets_and_single_rays_agree_on_sibenik() {
    let Some(path) = shared("truth/sibenik") else { return };
    let (site, scene) = load(&path);
    for view in &site.views {
        let camera = &view.camera;
        let origin = scene.local(camera.pose.position);
        for (tile_x, tile_y) in (0..64 * 64).map(|i| (i % 64, i / 64)).step_by(3) {
            let directions: Vec<Vec3> = (0..64)
                .map(|i| {
                    let (x, y) = (tile_x * 8 + i % 8, tile_y * 8 + i / 8);
                    camera.direction(f64::from(x) + 0.5, f64::from(y) + 0.5).as_vec3()
                })
                .collect();
            assert_eq!(
                packet(&scene.tracer, origin, &directions, 1e-4),
                singles(&scene.tracer, origin, &directions, 1e-4)
            );
        }
    }
}

/// Two floors in one place, turned against each other and with the rounding of any model: the first one shows nearly everywhere.
#[test]
fn of_two_surfaces_in_one_place_the_first_shows() {
    let mut mesh = Mesh::default();
    let slope = Quat::from_rotation_x(0.2);
    for turn in [0.0, 0.7] {
        let corner = |x: f32, y: f32| slope * (Quat::from_rotation_z(turn) * Vec3::new(x, y, 0.0)) + Vec3::splat(7.3);
        let first = mesh.positions.len() as u32;
        mesh.positions.extend([corner(-9.0, -9.0), corner(9.0, -9.0), corner(9.0, 9.0), corner(-9.0, 9.0)]);
        mesh.triangles.extend([[0, 1, 2], [0, 2, 3]].map(|t| t.map(|i| first + i)));
    }
    let tracer = Tracer::new(&mesh);
    let origin = Vec3::new(8.1, 6.9, 13.7);
    let mut dice = Dice(5);
    let directions: Vec<Vec3> = (0..2000).map(|_| (Vec3::NEG_Z + 0.2 * dice.signed()).normalize()).collect();
    let second = singles(&tracer, origin, &directions, 0.0).iter().flatten().filter(|h| h.triangle > 1).count();
    // distances on either side of where their leading bits change still differ
    assert!(second < directions.len() / 20, "{second}");
}

#[test]
fn a_wall_modelled_once_for_each_side_shows_each_side_its_own() {
    let corner = |x: f32, y: f32| Vec3::new(x, y, 4.1);
    let positions = vec![corner(-5.0, -5.0), corner(5.0, -5.0), corner(0.0, 6.0)];
    let mesh = Mesh { positions, triangles: vec![[0, 2, 1], [0, 1, 2]], ..Mesh::default() };
    let tracer = Tracer::new(&mesh);
    for (z, direction, shown) in [(9.7, Vec3::NEG_Z, 1), (-3.3, Vec3::Z, 0)] {
        let origin = Vec3::new(0.3, 0.2, z);
        let hits = singles(&tracer, origin, &[direction], 0.0);
        assert_eq!(hits[0].map(|h| h.triangle), Some(shown));
        assert_eq!(hits, packet(&tracer, origin, &[direction], 0.0));
    }
}
