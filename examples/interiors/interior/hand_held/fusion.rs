//! Fuses frames with depths into a mesh: signed distances, cut off a little before and behind the surface, are averaged at voxels
//! (Curless and Levoy, *A volumetric method for building complex models from range images*, 1996), and a net is drawn where they are
//! zero (Gibson, *Constrained elastic surface nets*, 1998).

use clerestory::site::Pose;
use glam::{IVec3, Vec3, ivec3};
use rayon::prelude::*;
use std::collections::{BTreeMap, HashMap};

/// Voxels along each side of a block.
const BLOCK: i32 = 8;
/// Voxels before and behind a surface that distances are kept for.
const REACH: f32 = 4.0;
/// So many frames must have seen a voxel.
const LEAST_FRAMES: f32 = 2.0;

/// What a frame measured, and where it is thought to stand.
pub struct Frame {
    /// The pose, local metres.
    pub pose: Pose,
    /// Width and height of `depths` in pixels.
    pub size: [usize; 2],
    /// Focal length in these pixels.
    pub focal: f32,
    /// Metres along the axis of view; 0 where nothing was measured.
    pub depths: Vec<f32>,
    /// sRGB values, 0..1.
    pub colours: Vec<Vec3>,
    /// What object each pixel shows.
    pub objects: Vec<u32>,
}

#[derive(Clone, Copy, Default)]
struct Voxel {
    /// In units of the reach, -1..1: before the surface it is positive.
    distance: f32,
    frames: f32,
    colour: Vec3,
    object: u32,
}

/// Voxels near surfaces.
pub struct Volume {
    side: f32,
    blocks: BTreeMap<[i32; 3], Vec<Voxel>>,
}

/// A mesh with what each of its vertices has.
#[derive(Default)]
pub struct Fused {
    /// Local metres.
    pub positions: Vec<Vec3>,
    /// sRGB values, 0..1.
    pub colours: Vec<Vec3>,
    /// Objects.
    pub objects: Vec<u32>,
    /// Corners, counter-clockwise seen from the air.
    pub triangles: Vec<[u32; 3]>,
}

impl Volume {
    /// An empty one of voxels of a side, metres.
    pub fn new(side: f32) -> Self {
        Self { side, blocks: BTreeMap::new() }
    }

    /// Adds what a frame measured.
    pub fn add(&mut self, frame: &Frame) {
        let [w, h] = frame.size;
        let origin = frame.pose.position.as_vec3();
        let turned = frame.pose.rotation.as_mat3();
        let middle = [0.5 * w as f32, 0.5 * h as f32];
        let reach = REACH * self.side;
        for (i, &depth) in frame.depths.iter().enumerate().filter(|d| *d.1 > 0.0) {
            let x = ((i % w) as f32 + 0.5 - middle[0]) / frame.focal;
            let y = (middle[1] - (i / w) as f32 - 0.5) / frame.focal;
            let way = turned * Vec3::new(x, 1.0, y);
            for step in -2..=2 {
                let at = origin + way * (depth + 0.5 * reach * step as f32);
                let block = (at / (self.side * BLOCK as f32)).floor().as_ivec3();
                let new = || vec![Voxel::default(); (BLOCK * BLOCK * BLOCK) as usize];
                self.blocks.entry(block.to_array()).or_insert_with(new);
            }
        }
        let side = self.side;
        let back = turned.transpose();
        self.blocks.par_iter_mut().for_each(|(block, voxels)| {
            let corner = IVec3::from(*block) * BLOCK;
            let size = side * BLOCK as f32;
            let centre = back * ((corner.as_vec3() + 0.5 * BLOCK as f32) * side - origin);
            // beside the picture by more than the block can reach into it
            let aside = (centre.x.abs() * frame.focal - middle[0] * centre.y)
                .max(centre.z.abs() * frame.focal - middle[1] * centre.y);
            if centre.y < -size || aside > 2.0 * size * frame.focal {
                return;
            }
            for (k, voxel) in voxels.iter_mut().enumerate() {
                let p = back * ((corner + cell(k)).as_vec3() * side - origin);
                if p.y < 0.1 {
                    continue;
                }
                let (x, y) = (middle[0] + frame.focal * p.x / p.y, middle[1] - frame.focal * p.z / p.y);
                if x < 0.0 || y < 0.0 || x >= w as f32 || y >= h as f32 {
                    continue;
                }
                let pixel = y as usize * w + x as usize;
                let off = (frame.depths[pixel] - p.y) / reach;
                if frame.depths[pixel] == 0.0 || off < -1.0 {
                    continue;
                }
                let share = 1.0 / (voxel.frames + 1.0);
                voxel.distance += (off.min(1.0) - voxel.distance) * share;
                voxel.colour += (frame.colours[pixel] - voxel.colour) * share;
                voxel.frames += 1.0;
                if off.abs() < 0.5 {
                    voxel.object = frame.objects[pixel];
                }
            }
        });
    }

    fn voxel(&self, at: IVec3) -> Option<&Voxel> {
        let block = self.blocks.get(&at.div_euclid(IVec3::splat(BLOCK)).to_array())?;
        let in_block = at.rem_euclid(IVec3::splat(BLOCK));
        let voxel = &block[(in_block.x + BLOCK * (in_block.y + BLOCK * in_block.z)) as usize];
        (voxel.frames >= LEAST_FRAMES).then_some(voxel)
    }

    /// The surface.
    pub fn surface(&self) -> Fused {
        let mut fused = Fused::default();
        let mut vertices: HashMap<IVec3, u32> = HashMap::new();
        let each =
            || self.blocks.keys().flat_map(|b| (0..BLOCK.pow(3) as usize).map(|k| IVec3::from(*b) * BLOCK + cell(k)));
        for low in each() {
            self.vertex(low, &mut fused, &mut vertices);
        }
        const AXES: [IVec3; 3] = [IVec3::X, IVec3::Y, IVec3::Z];
        for at in each() {
            let Some(here) = self.voxel(at) else { continue };
            for k in 0..3 {
                let Some(next) = self.voxel(at + AXES[k]) else { continue };
                if (here.distance < 0.0) == (next.distance < 0.0) {
                    continue;
                }
                let (b, c) = (AXES[(k + 1) % 3], AXES[(k + 2) % 3]);
                let around = [at, at - b, at - b - c, at - c].map(|cell| vertices.get(&cell).copied());
                let [Some(p), Some(q), Some(r), Some(s)] = around else { continue };
                let quad = if here.distance < 0.0 { [p, q, r, s] } else { [s, r, q, p] };
                fused.triangles.push([quad[0], quad[1], quad[2]]);
                fused.triangles.push([quad[0], quad[2], quad[3]]);
            }
        }
        fused
    }

    /// The vertex in a cell between eight voxels, if the surface goes through it: the mean of where it crosses the cell's edges.
    fn vertex(&self, low: IVec3, fused: &mut Fused, vertices: &mut HashMap<IVec3, u32>) {
        let corner = |k: i32| ivec3(k & 1, k >> 1 & 1, k >> 2 & 1);
        let mut all = [Voxel::default(); 8];
        for (k, voxel) in all.iter_mut().enumerate() {
            let Some(known) = self.voxel(low + corner(k as i32)) else { return };
            *voxel = *known;
        }
        let (mut at, mut colour, mut crossings, mut object) = (Vec3::ZERO, Vec3::ZERO, 0.0, 0);
        for a in 0..8usize {
            for b in [1, 2, 4].map(|bit| a | bit).into_iter().filter(|b| *b != a) {
                let (here, there) = (&all[a], &all[b]);
                if (here.distance < 0.0) == (there.distance < 0.0) {
                    continue;
                }
                let share = here.distance / (here.distance - there.distance);
                at += corner(a as i32).as_vec3().lerp(corner(b as i32).as_vec3(), share);
                colour += here.colour.lerp(there.colour, share);
                object = here.object.max(there.object);
                crossings += 1.0;
            }
        }
        if crossings > 0.0 {
            vertices.insert(low, fused.positions.len() as u32);
            fused.positions.push((low.as_vec3() + at / crossings) * self.side);
            fused.colours.push(colour / crossings);
            fused.objects.push(object);
        }
    }
}

/// The k-th voxel's place in its block.
fn cell(k: usize) -> IVec3 {
    let k = k as i32;
    ivec3(k % BLOCK, k / BLOCK % BLOCK, k / (BLOCK * BLOCK))
}
