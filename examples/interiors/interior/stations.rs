//! Where probes and cameras stand: in the open, at a tripod's or a hand's height, and where they see much.

use clerestory::scene::{Ray, Scene};
use clerestory::site::Frame;
use glam::{DVec3, IVec3, Vec3};
use std::collections::HashSet;
use std::f64::consts::{PI, TAU};

use super::dice::Dice;
use super::layout::Layout;

/// A probe or a camera.
#[derive(Clone, Copy, Debug)]
pub struct Station {
    /// Model's axes, metres.
    pub position: DVec3,
    /// Heading, pitch and roll in degrees, as in site files.
    pub bearings: [f64; 3],
}

/// Rays by which a place is looked around from.
const RAYS: usize = 900;
/// Side of the cells by which what is seen is counted, metres.
const CELL: f32 = 0.3;
/// Least distance of a lens from anything, metres.
const CLEARANCE: f32 = 0.4;

/// A place in the open, and the cells that it sees.
struct Candidate {
    position: DVec3,
    sees: HashSet<IVec3>,
}

fn cell(p: Vec3) -> IVec3 {
    (p / CELL).floor().as_ivec3()
}

/// The k-th of n directions that are even over the sphere (Fibonacci lattice).
fn around(k: usize, n: usize) -> Vec3 {
    let z = 1.0 - (2.0 * k as f64 + 1.0) / n as f64;
    let (s, c) = (k as f64 * PI * (3.0 - 5f64.sqrt())).sin_cos();
    let r = (1.0 - z * z).sqrt();
    DVec3::new(r * c, r * s, z).as_vec3()
}

/// A number with so many decimals, so that site files are short and the truth is what they say.
fn rounded(v: f64, decimals: i32) -> f64 {
    let unit = 10f64.powi(decimals);
    (v * unit).round() / unit
}

/// A place between two heights above the floor with free space around and below it.
fn candidate(scene: &Scene, frame: &Frame, layout: &Layout, heights: [f64; 2], dice: &mut Dice) -> Option<Candidate> {
    let room = &layout.rooms[dice.whole(0, layout.rooms.len() - 1)];
    let x = dice.between(room.low.x + 0.45, room.high.x - 0.45);
    let z = dice.between(room.low.z + 0.45, room.high.z - 0.45);
    let height = dice.between(heights[0], heights[1]);
    let position = DVec3::new(x, room.low.y + height, z).map(|v| rounded(v, 4));
    let origin = scene.local(frame.point_in(position));
    let down = |aside: Vec3| {
        let ray = Ray { origin: origin + aside, direction: Vec3::NEG_Z };
        scene.tracer.closest(&ray, 0.0).map_or(0.0, |h| h.t)
    };
    let feet = [Vec3::ZERO, Vec3::X * 0.25, Vec3::X * -0.25, Vec3::Y * 0.25, Vec3::Y * -0.25];
    if feet.iter().any(|f| (down(*f) - height as f32).abs() > 0.05) {
        return None;
    }
    let mut sees = HashSet::new();
    for k in 0..RAYS {
        let ray = Ray { origin, direction: around(k, RAYS) };
        let Some(hit) = scene.tracer.closest(&ray, 0.0) else { continue };
        if hit.t < CLEARANCE {
            return None;
        }
        sees.insert(cell(origin + ray.direction * hit.t));
    }
    Some(Candidate { position, sees })
}

fn candidates(
    scene: &Scene,
    frame: &Frame,
    layout: &Layout,
    heights: [f64; 2],
    count: usize,
    dice: &mut Dice,
) -> Vec<Candidate> {
    let mut found = Vec::new();
    for _ in 0..count * 40 {
        if found.len() == count {
            break;
        }
        found.extend(candidate(scene, frame, layout, heights, dice));
    }
    found
}

/// So many probes: each sees much that those before it do not, and a sixth of what it sees in common with one of them.
pub fn probes(scene: &Scene, frame: &Frame, layout: &Layout, count: usize, dice: &mut Dice) -> Vec<Station> {
    let found = candidates(scene, frame, layout, [1.2, 1.8], 30, dice);
    let mut seen: HashSet<IVec3> = HashSet::new();
    let mut chosen: Vec<&Candidate> = Vec::new();
    for _ in 0..count {
        let gain = |c: &&Candidate| {
            let new = c.sees.difference(&seen).count();
            let shared = c.sees.len() - new;
            let near = chosen.iter().any(|o| o.position.distance(c.position) < 1.0);
            if near || (!chosen.is_empty() && shared * 6 < c.sees.len()) { 0 } else { new }
        };
        let Some(best) = found.iter().max_by_key(gain) else { break };
        if chosen.iter().any(|o| o.position == best.position) {
            break;
        }
        seen.extend(&best.sees);
        chosen.push(best);
    }
    chosen
        .iter()
        .map(|c| {
            let tilt = rounded(dice.between(0.0, 3.0), 3);
            let way = dice.between(0.0, TAU);
            let bearings = [dice.between(0.0, 360.0), tilt * way.cos(), tilt * way.sin()];
            Station { position: c.position, bearings: bearings.map(|b| rounded(b, 4)) }
        })
        .collect()
}

/// So many cameras with this field of view (tangents of its halves): they see things of many kinds that probes see, too.
pub fn views(
    scene: &Scene,
    frame: &Frame,
    layout: &Layout,
    probes: &[Station],
    half_field: [f64; 2],
    count: usize,
    dice: &mut Dice,
) -> Vec<Station> {
    let eyes: Vec<Vec3> = probes.iter().map(|p| scene.local(frame.point_in(p.position))).collect();
    let places = candidates(scene, frame, layout, [1.35, 1.75], 24, dice);
    let mut found = Vec::new();
    for place in &places {
        for _ in 0..8 {
            let bearings =
                [dice.between(0.0, 360.0), dice.between(-16.0, 6.0), dice.between(-1.5, 1.5)].map(|b| rounded(b, 4));
            let station = Station { position: place.position, bearings };
            let (score, seen) = worth(scene, frame, &station, &eyes, half_field);
            found.push((score, seen, station));
        }
    }
    let mut chosen: Vec<Station> = Vec::new();
    let mut shown: HashSet<IVec3> = HashSet::new();
    for _ in 0..count {
        let value = |(score, seen, _): &(f64, HashSet<IVec3>, Station)| {
            score * (seen.difference(&shown).count() as f64 / seen.len().max(1) as f64)
        };
        let Some(best) = found.iter().max_by(|a, b| value(a).total_cmp(&value(b))) else { break };
        shown.extend(&best.1);
        chosen.push(best.2);
    }
    chosen
}

/// What a camera's picture is worth, 0 and up, and the cells that it shows.
fn worth(
    scene: &Scene,
    frame: &Frame,
    station: &Station,
    eyes: &[Vec3],
    half_field: [f64; 2],
) -> (f64, HashSet<IVec3>) {
    const GRID: [usize; 2] = [24, 16];
    let origin = scene.local(frame.point_in(station.position));
    let [heading, pitch, roll] = station.bearings;
    let rotation = frame.rotation(heading, pitch, roll);
    let (mut covered, mut near, mut depth) = (0.0, 0.0, 0.0);
    let (mut seen, mut shares) = (HashSet::new(), vec![0.0f64; scene.materials.len()]);
    let total = (GRID[0] * GRID[1]) as f64;
    for k in 0..GRID[0] * GRID[1] {
        let x = ((k % GRID[0]) as f64 + 0.5) / GRID[0] as f64 * 2.0 - 1.0;
        let y = 1.0 - ((k / GRID[0]) as f64 + 0.5) / GRID[1] as f64 * 2.0;
        let direction = (rotation * DVec3::new(x * half_field[0], 1.0, y * half_field[1])).normalize().as_vec3();
        let ray = Ray { origin, direction };
        let Some(hit) = scene.tracer.closest(&ray, 0.0) else { continue };
        let s = scene.surface(&ray, &hit);
        near += f64::from(u8::from(hit.t < 1.2)) / total;
        depth += f64::from(hit.t.min(6.0)) / total;
        seen.insert(cell(s.position));
        shares[scene.mesh.materials[s.triangle as usize] as usize] += 1.0 / total;
        let from = s.position + s.normal * 1e-3;
        let in_sight = eyes.iter().any(|eye| {
            let to = *eye - from;
            let distance = to.length();
            to.dot(s.normal) > 0.1 * distance
                && !scene.tracer.occluded(&Ray { origin: from, direction: to / distance }, 0.0, distance)
        });
        covered += f64::from(u8::from(in_sight)) / total;
    }
    // of how many kinds a picture is, by the entropy of their shares
    let entropy: f64 = shares.iter().filter(|s| **s > 0.0).map(|s| -s * s.ln()).sum();
    let score = covered * entropy.exp() * (0.4 + 0.1 * depth) * (1.0 - near).powi(2);
    (score, seen)
}
