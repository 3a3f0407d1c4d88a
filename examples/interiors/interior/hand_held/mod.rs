//! An interior as somebody scans it who walks through it with a colour and a depth camera in the hand.
//!
//! What a clean model and panoramas from a tripod lack is all here: the camera is tracked with an error that drifts, depths are noisy,
//! the mesh is fused from frames, so that it has holes, ragged ends, rounded edges, and light and reflections in its colours; frames are
//! exposed by the camera itself, blurred by hands that move, and have a lens that is known not quite. Some of the fused frames are the
//! site's probes, some that were not fused its photographs.

pub mod fusion;

use clerestory::panorama::{Distortion, Picture, srgb_to_linear};
use clerestory::reference::Eye;
use clerestory::scene::{Ray, Scene};
use clerestory::site::{Camera, Pose};
use glam::{DVec3, Vec3, dvec3};
use image::RgbImage;
use rayon::prelude::*;
use std::f64::consts::TAU;
use std::fmt::Write;

use super::develop;
use super::dice::Dice;
use super::given::smooth;
use super::layout::Layout;
use super::shade::{Sampling, Truth};
use super::site::FRAME;
use super::stations::{self, Station};
use crate::common::objects::objects;
use fusion::{Frame, Fused, Volume};

/// Frames of a walk.
const FRAMES: usize = 75;
/// Every so manyth frame is a probe, every so manyth a photograph.
const PROBE_EVERY: usize = 6;
const PHOTOGRAPH_EVERY: usize = 25;
/// Depths are measured between these, metres.
const RANGE: [f32; 2] = [0.4, 3.6];
/// Least distance of the camera from anything, metres.
const CLEARANCE: f32 = 0.4;

/// What a frame is for.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Role {
    /// It is fused.
    Fused,
    /// It is fused, and a probe.
    Probe,
    /// It is a photograph, and not fused.
    Photograph,
}

/// A walk through an interior.
#[derive(Clone, Debug)]
pub struct Walk {
    /// Vertical field of view, degrees.
    pub fov_y: f64,
    /// Radial distortion that nobody knows of.
    pub k1: f64,
    /// Root mean square error of the tracked position along each axis, metres, and of each angle, degrees.
    pub drift: [f64; 2],
    /// Where the camera was and where it is thought to have been.
    pub frames: Vec<(Station, Station, Role)>,
}

/// A picture that the camera took.
pub struct Taken {
    /// How it was developed.
    pub camera: develop::Camera,
    /// Pixels by which the camera moved.
    pub blur: [f64; 2],
    /// The picture.
    pub picture: RgbImage,
}

impl Walk {
    /// A walk around the place that shows most.
    pub fn new(scene: &Scene, layout: &Layout, dice: &mut Dice) -> Self {
        let fov_y = (dice.between(46.0, 56.0) * 10.0f64).round() / 10.0;
        let half = (0.5 * fov_y.to_radians()).tan();
        let probes = stations::probes(scene, &FRAME, layout, 2, dice);
        let best = stations::views(scene, &FRAME, layout, &probes, [half * 4.0 / 3.0, half], 1, dice);
        let middle =
            best.first().copied().unwrap_or(Station { position: layout.rooms[0].low + 1.5, bearings: [0.0; 3] });
        let drift = [dice.between(0.001, 0.004), dice.between(0.02, 0.08)];
        let path = Waves::new([0.7, 0.2, 0.7], dice);
        let turns = Waves::new([32.0, 10.0, 4.0], dice);
        let (places, angles) = (Waves::new([drift[0]; 3], dice), Waves::new([drift[1]; 3], dice));
        let frames = (0..FRAMES)
            .map(|k| {
                let t = k as f64 / FRAMES as f64;
                let position = reached(scene, middle.position, path.at(t));
                let [heading, pitch, roll] = middle.bearings;
                let turn = turns.at(t);
                let bearings = [heading + turn.x, pitch.min(-4.0) - 8.0 + turn.y, roll + turn.z];
                let (off, askew) = (places.at(t), angles.at(t));
                let tracked = [bearings[0] + askew.x, bearings[1] + askew.y, bearings[2] + askew.z];
                let role = if k % PHOTOGRAPH_EVERY == PHOTOGRAPH_EVERY / 2 {
                    Role::Photograph
                } else if k % PROBE_EVERY == 0 {
                    Role::Probe
                } else {
                    Role::Fused
                };
                (Station { position, bearings }, Station { position: position + off, bearings: tracked }, role)
            })
            .collect();
        Self { fov_y, k1: dice.between(-0.004, 0.004), drift, frames }
    }

    /// The eye of a frame, so many pixels wide, that stands where it truly was.
    pub fn eye(&self, frame: usize, width: usize) -> Eye {
        let mut camera = Camera::with_fov(pose(&self.frames[frame].0), width as u32, width as u32 * 3 / 4, self.fov_y);
        camera.distortion = Distortion::brown([self.k1, 0.0, 0.0, 0.0], [0.0; 2]);
        Eye::Camera(camera)
    }

    /// How wide a frame is, where probes and photographs are `full`: what is only fused is half as wide.
    pub fn width(&self, frame: usize, full: usize) -> usize {
        if self.frames[frame].2 == Role::Fused { full / 2 } else { full }
    }

    /// Takes all pictures; of probes and photographs they are `full` pixels wide.
    pub fn take(&self, truth: &Truth, full: usize, seed: u64) -> Vec<Taken> {
        let mut dice = Dice::new(seed, "hand-held camera");
        let (warm, vignetting) = (dice.between(-0.12, 0.12), dice.between(0.0, 0.15));
        let noise = [dice.between(0.006, 0.016), dice.between(0.001, 0.003)];
        (0..self.frames.len())
            .map(|k| {
                let role = self.frames[k].2;
                let width = self.width(k, full);
                let pixels = if dice.chance(0.4) { 2.0 * width as f64 / full as f64 } else { 0.0 };
                let blur = [dice.between(-pixels, pixels), dice.between(-pixels, pixels)];
                let side = if role == Role::Fused { 1 } else { 2 };
                let picture = truth.picture(&self.eye(k, width), &Sampling { side, blur, seed: seed << 8 | k as u64 });
                // a lens scatters some of the light that falls on it over all of the picture
                let mean = picture.pixels.iter().sum::<Vec3>() / picture.pixels.len() as f32;
                let glare = mean * dice.between(0.0, 0.06) as f32;
                let pixels = picture.pixels.iter().map(|p| *p + glare).collect();
                let picture = Picture { pixels, ..picture };
                let automatic = develop::Camera::automatic(&picture, &mut dice);
                let (exposure, warm) = (automatic.gain[1], warm + dice.between(-0.04, 0.04));
                let gain = [exposure * (1.0 + warm), exposure, exposure * (1.0 - warm)];
                let camera = develop::Camera { gain, vignetting, noise, quality: 95 };
                let picture = camera.photograph(&picture, &mut dice);
                Taken { camera, blur, picture }
            })
            .collect()
    }

    /// The mesh that the frames are fused to, of voxels of a side.
    pub fn fused(&self, scene: &Scene, taken: &[Taken], full: usize, side: f32, seed: u64) -> Fused {
        let objects = objects(&scene.mesh);
        let mut volume = Volume::new(side);
        for k in (0..self.frames.len()).filter(|k| self.frames[*k].2 != Role::Photograph) {
            volume.add(&self.measured(scene, &objects, k, &taken[k].picture, full / 2, seed));
        }
        volume.surface()
    }

    /// Depths of a frame, so many pixels wide, as a depth camera measures them (Nguyen, Izadi and Lovell, *Modeling Kinect sensor noise
    /// for improved 3D reconstruction and tracking*, 2012): their noise grows with the square of the distance, edges are off by a pixel,
    /// and what is seen at a grazing angle is not measured.
    fn measured(
        &self,
        scene: &Scene,
        objects: &[usize],
        k: usize,
        picture: &RgbImage,
        width: usize,
        seed: u64,
    ) -> Frame {
        let Eye::Camera(camera) = self.eye(k, width) else { unreachable!("walks have cameras") };
        let size = [width, width * 3 / 4];
        let origin = scene.local(camera.pose.position);
        let forward = camera.pose.rotation.y_axis.as_vec3();
        let measure = |i: usize| {
            let mut dice = Dice::new(seed ^ ((k * size[0] * size[1] + i) as u64) << 8, "depth");
            let (x, y) =
                ((i % width) as f64 + 0.5 + 0.5 * dice.normal(), (i / width) as f64 + 0.5 + 0.5 * dice.normal());
            let ray = Ray { origin, direction: camera.direction(x, y).as_vec3() };
            let hit = scene.tracer.closest(&ray, 0.0)?;
            let depth = hit.t * ray.direction.dot(forward);
            let grazing = -scene.surface(&ray, &hit).normal.dot(ray.direction) < 0.17;
            if grazing || !(RANGE[0]..RANGE[1]).contains(&depth) {
                return None;
            }
            // what the depth camera itself is off by, alike in all frames
            let bias = 0.004 * (smooth(dvec3(x / width as f64 * 3.0, y / width as f64 * 3.0, 0.5), seed) - 0.5);
            let noise = 0.0012 + 0.0019 * f64::from(depth - RANGE[0]).powi(2);
            let measured = f64::from(depth) * (1.0 + bias) + noise * dice.normal();
            Some((measured as f32, objects[hit.triangle as usize] as u32 + 1))
        };
        let met: Vec<Option<(f32, u32)>> = (0..size[0] * size[1]).into_par_iter().map(measure).collect();
        let colour = |i: usize| {
            let scale = picture.width() / width as u32;
            let at = |n: usize| n as u32 * scale + scale / 2;
            Vec3::from(picture.get_pixel(at(i % width), at(i / width)).0.map(|c| f32::from(c) / 255.0))
        };
        let tracked = pose(&self.frames[k].1);
        Frame {
            pose: Pose { position: scene.local(tracked.position).as_dvec3(), rotation: tracked.rotation },
            size,
            focal: (camera.focal.y) as f32,
            depths: met.iter().map(|m| m.map_or(0.0, |m| m.0)).collect(),
            colours: (0..met.len()).map(colour).collect(),
            objects: met.iter().map(|m| m.map_or(0, |m| m.1)).collect(),
        }
    }

    /// Probes and views of a site file in the folder of `probes/` and `photos/`, where pictures are `width` pixels wide; `told` are the
    /// poses as tracked, otherwise they are true.
    pub fn stations(&self, up: &str, taken: &[Taken], width: usize, told: bool, seed: u64) -> String {
        let mut out = String::new();
        let mut dice = Dice::new(seed, "gains");
        let exposures: Vec<f64> = taken.iter().map(|t| t.camera.gain[1]).collect();
        let usual = exposures.iter().sum::<f64>() / exposures.len().max(1) as f64;
        for (k, (station, tracked, role)) in self.frames.iter().enumerate() {
            let Station { position, bearings: [heading, pitch, roll] } = if told { tracked } else { station };
            let name = name(*role, k);
            let pose = format!(
                "name = \"{name}\"\nposition = [{:.5}, {:.5}, {:.5}]\nheading = {heading:.4}\npitch = {pitch:.4}\nroll = {roll:.4}\n",
                position.x, position.y, position.z
            );
            // gains that somebody fitted
            let gain = exposures.get(k).map_or(1.0, |e| usual / e * (1.0 + 0.015 * dice.normal()));
            let fov = format!("fov_y = {:.4}\n", self.fov_y);
            let _ = match role {
                Role::Fused => Ok(()),
                Role::Probe => write!(
                    out,
                    "\n[[probe]]\n{pose}image = \"{up}probes/{name}.jpg\"\nprojection = \"perspective\"\n{fov}gain = {gain:.4}\n"
                ),
                Role::Photograph => write!(
                    out,
                    "\n[[view]]\n{pose}{fov}size = [{width}, {}]\nphoto = \"{up}photos/{name}.jpg\"\n",
                    width * 3 / 4
                ),
            };
        }
        out
    }
}

/// What a frame is called.
pub fn name(role: Role, frame: usize) -> String {
    format!("{}{frame:02}", if role == Role::Photograph { "view_" } else { "probe_" })
}

/// The model as an OBJ file: positions with linear colours, one material.
pub fn obj(fused: &Fused, scene: &Scene) -> String {
    let mut out = String::from(
        "# A scan, fused from frames; metres, y up, north = -z; vertex colours are linear\nmtllib model.mtl\n",
    );
    for (p, c) in fused.positions.iter().zip(&fused.colours) {
        let p = FRAME.point_out(p.as_dvec3() + scene.origin);
        let [r, g, b] = c.to_array().map(srgb_to_linear);
        let _ = writeln!(out, "v {:.4} {:.4} {:.4} {r:.4} {g:.4} {b:.4}", p.x, p.y, p.z);
    }
    out += "usemtl scan\n";
    for t in &fused.triangles {
        let [a, b, c] = t.map(|i| i + 1);
        let _ = writeln!(out, "f {a} {b} {c}");
    }
    out
}

/// Slow swings in three directions: three waves along each, of these standard deviations together.
struct Waves([[[f64; 3]; 3]; 3]);

impl Waves {
    fn new(sizes: [f64; 3], dice: &mut Dice) -> Self {
        Self(sizes.map(|size| {
            [1.0, 2.0, 5.0].map(|turns| {
                let share = size * (2.0 / 3.0f64).sqrt() * dice.between(0.6, 1.4);
                [turns + dice.between(0.0, 0.9), share, dice.between(0.0, TAU)]
            })
        }))
    }

    /// At a time, 0..1.
    fn at(&self, t: f64) -> DVec3 {
        let sum = |waves: &[[f64; 3]; 3]| waves.iter().map(|[n, size, first]| size * (TAU * n * t + first).sin()).sum();
        DVec3::from(self.0.each_ref().map(sum))
    }
}

/// As far from a place towards another as nothing is near.
fn reached(scene: &Scene, from: DVec3, by: DVec3) -> DVec3 {
    let free = |p: DVec3| {
        let origin = scene.local(FRAME.point_in(p));
        let start = scene.local(FRAME.point_in(from));
        let way = origin - start;
        let clear = |direction: Vec3, far: f32, at: Vec3| {
            scene.tracer.closest(&Ray { origin: at, direction }, 0.0).is_none_or(|hit| hit.t > far)
        };
        let around = (0..26).all(|k| {
            let axis = |n: i32| (k / n % 3 - 1) as f32;
            let direction = Vec3::new(axis(1), axis(3), axis(9));
            direction == Vec3::ZERO || clear(direction.normalize(), CLEARANCE, origin)
        });
        around && (way.length() < 1e-3 || clear(way.normalize(), way.length(), start))
    };
    let all = [1.0, 0.7, 0.5, 0.3, 0.15].map(|share| from + by * share);
    all.into_iter().find(|p| free(*p)).unwrap_or(from)
}

fn pose(station: &Station) -> Pose {
    let [heading, pitch, roll] = station.bearings;
    Pose { position: FRAME.point_in(station.position), rotation: FRAME.rotation(heading, pitch, roll) }
}
