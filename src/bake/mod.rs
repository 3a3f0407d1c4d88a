//! Baking: irradiance at the vertices of a model, cut where light changes, for programs that draw vertex colours.
//!
//! The sides of triangles that can be seen from within (`sides`) are cut until their edges are short (`mesh`), lit as
//! [`Relit`] lights pictures, and cut again where light between two corners is not what they say (`refine`); pieces that
//! share an edge are cut at the same place. Scans, whose colour is at their vertices, keep these.

mod baked;
mod glb;
mod light;
mod mesh;
mod ply;
mod refine;
mod settings;
mod sides;

pub(crate) use baked::Run;
pub use baked::{Baked, Origin, Vertex};
pub use light::{BakedLight, Pieces};
pub use settings::BakeSettings;

pub use glb::write_glb;
pub use ply::write_ply;

use glam::{Vec2, Vec3};
use rayon::prelude::*;
use std::f32::consts::PI;
use std::path::PathBuf;

use crate::panorama::{Exposure, Picture, Projection};
use crate::render::{self, Options, Relit, Setup, SetupError, shown_points};
use crate::scene::Scene;
use crate::shoot::Light;
use crate::site::{Camera, Probe, Site};
use refine::SampleLight;

/// Why a baked model cannot be written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum BakeError {
    /// The file system refuses.
    #[error("{}: {source}. Check the folder and your right to write there", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What it says.
        source: std::io::Error,
    },
    /// A texture cannot be written.
    #[error("the picture “{name}” cannot be encoded: {why}. Save it as PNG or JPEG")]
    Picture {
        /// Its name.
        name: String,
        /// What happened.
        why: String,
    },
    /// More than the format can hold.
    #[error("{}: a binary glTF file holds at most 4 GiB, which this model exceeds. Bake with fewer --vertices", path.display())]
    TooLarge {
        /// The file.
        path: PathBuf,
    },
}

/// A bake with what made it.
pub struct Bake {
    /// The model.
    pub baked: Baked,
    /// Records and volume, and how long they took.
    pub setup: Setup,
}

/// Normals closer than this make one smooth surface: cosine for models, and for scans, whose normals are noise.
const SMOOTH: [f32; 2] = [0.996, 0.766];

/// Edges longer than the model's longest side ÷ this are cut before any light is asked for.
const COARSE: f32 = 100.0;

/// Edges shorter than the coarse length ÷ this are not cut.
const FINEST: f32 = 16.0;

/// The volume serves what so many of the views show, beside the surface's own samples: a walk may have thousands.
const LOOKS: usize = 32;

/// Bakes a site under the lightings of `options`. `progress` hears how many samples there are.
///
/// # Errors
///
/// As [`render::prepare`].
pub fn bake(
    site: &Site,
    scene: &Scene,
    options: &Options,
    settings: &BakeSettings,
    progress: &(dyn Fn(usize) + Sync),
) -> Result<Bake, SetupError> {
    let is_scan = !scene.mesh.colours.is_empty();
    let (low, high) = scene.mesh.bounds();
    let coarse = (high - low).max_element() / COARSE;
    let finest = coarse / FINEST;
    let eyes = crate::check::eyes(site, scene.origin, None);
    let inner = sides::inner(scene, &eyes, is_scan);
    let mut surface = mesh::Surface::new(scene, &inner, SMOOTH[usize::from(is_scan)], 0.5 * finest, settings.coarse);
    if !is_scan {
        refine::cut_long(&mut surface, coarse, settings.vertices / 2);
    }
    let cameras: Vec<Camera> = site.views.iter().map(|v| v.camera).collect();
    let some: Vec<Camera> = cameras.iter().step_by(cameras.len().div_ceil(LOOKS).max(1)).copied().collect();
    let wanted = |seen: Option<&Light>| {
        let hidden = |s: &&mesh::Sample| seen.is_none_or(|l| l.observe(scene, s.position, s.normal).is_none());
        let own = surface.samples.par_iter().filter(hidden).map(|s| (s.position, s.normal));
        let mut all: Vec<(Vec3, Vec3)> = own.collect();
        all.extend(shown_points(scene, seen, &some));
        all
    };
    let setup = render::prepare_for(site, scene, wanted, options)?;
    let volumes = setup.volumes(scene);
    let relit: Vec<Relit> = (setup.lights.iter().zip(&volumes))
        .map(|((_, light), volume)| Relit { scene, light, volume: volume.as_ref(), volume_only: false })
        .collect();
    let lights = refine::Lights { relit: &relit, sun_apart: settings.sun_apart };
    let mut lit = lights.at(&surface.samples);
    if !is_scan {
        refine::refine(&mut surface, &mut lit, &lights, settings, [coarse, finest], &eyes, progress);
    }
    // records tell only of probes with a picture of the lighting
    let shot = |p: &Probe| setup.lights.first().is_some_and(|(lighting, _)| p.picture(lighting).is_some());
    let probes = (0..).zip(site.probes.iter().take(options.probes)).filter(|&(_, p)| shot(p)).map(|(i, _)| i);
    let probes: Vec<u32> = probes.collect();
    let mut baked = gathered(scene, &surface, &lit, (&setup, &probes), &inner);
    if settings.views {
        // with as many samples a pixel as `clerestory render` takes by default: a log-average hangs on how finely dark and
        // bright tiles are told apart
        let seen = |camera, relit| Exposure::of(&render::render(scene, relit, camera, 4, &|_, _| ()).radiance);
        baked.views = cameras.iter().map(|c| relit.iter().map(|r| seen(c, r)).collect()).collect();
    }
    let exposure = |l: usize| match baked.views.is_empty() {
        true => exposure(scene, &baked, l),
        // as people see the place, rather than with all its dark corners
        false => Exposure::mean(baked.views.iter().map(|view| view[l])),
    };
    baked.exposures = (0..relit.len()).map(exposure).collect();
    baked.skies = setup.lights.iter().map(|(_, light)| sky(light)).collect();
    drop(relit);
    drop(volumes);
    Ok(Bake { baked, setup })
}

/// The vertices of pieces, in the order of their first use.
struct Gather<'a> {
    scene: &'a Scene,
    surface: &'a mesh::Surface,
    corners: Vec<Corner>,
    /// Per sample its last vertex, and per vertex the one before it of the same sample, or [`mesh::NONE`].
    last: Vec<u32>,
    before: Vec<u32>,
}

/// A piece's corner; those that are the same are one vertex.
#[derive(Clone, Copy)]
struct Corner {
    place: u32,
    sample: u32,
    material: u32,
    uv: Vec2,
    colour: Vec3,
}

impl Corner {
    /// Whether two corners of one sample are the same.
    fn is(&self, other: &Self) -> bool {
        // no two zeros
        let key =
            |c: &Self| (c.material, [c.uv.x, c.uv.y, c.colour.x, c.colour.y, c.colour.z].map(|v| (v + 0.0).to_bits()));
        key(self) == key(other)
    }
}

impl Gather<'_> {
    /// Pieces as triangles with where they lie in the model, sorted by material and place in the model, and per material its
    /// first triangle.
    fn triangles(&mut self, pieces: &[mesh::Piece]) -> (Vec<[u32; 3]>, Vec<Origin>, Vec<u32>) {
        /// So many pieces are read together.
        const LOT: usize = 1 << 16;
        let mesh = &self.scene.mesh;
        let bounds = mesh.bounds();
        let key = |i: u32| {
            let piece = &pieces[i as usize];
            let middle = piece.corners.iter().map(|p| self.surface.places[*p as usize]).sum::<Vec3>() / 3.0;
            let place = mesh::morton(middle, bounds);
            (mesh.materials[piece.triangle as usize], place >> REGION, piece.patch, place, i)
        };
        let mut order: Vec<_> = (0..pieces.len() as u32).into_par_iter().map(key).collect();
        order.par_sort_unstable();
        let mut materials = vec![0u32; self.scene.materials.len() + 1];
        order.iter().for_each(|key| materials[key.0 as usize + 1] += 1);
        for i in 1..materials.len() {
            materials[i] += materials[i - 1];
        }
        let order: Vec<u32> = order.into_iter().map(|key| key.4).collect();
        let origin = |&i: &u32| {
            let piece = &pieces[i as usize];
            let at = piece.at.map(Vec2::from);
            // barycentric coordinates run the other way round on the back
            let back = u32::from((at[1] - at[0]).perp_dot(at[2] - at[0]) < 0.0);
            Origin { side: 2 * piece.triangle + back, at }
        };
        let origins = order.par_iter().map(origin).collect();
        let mut triangles = Vec::with_capacity(order.len());
        for lot in order.chunks(LOT) {
            let corners = |&i: &u32| [0, 1, 2].map(|c| self.corner(&pieces[i as usize], c));
            let corners: Vec<[Corner; 3]> = lot.par_iter().map(corners).collect();
            triangles.extend(corners.into_iter().map(|all| all.map(|corner| self.vertex(corner))));
        }
        (triangles, origins, materials)
    }

    /// A piece's corner.
    fn corner(&self, piece: &mesh::Piece, corner: usize) -> Corner {
        let mesh = &self.scene.mesh;
        let at = Vec2::from(piece.at[corner]);
        let material = mesh.materials[piece.triangle as usize];
        let painted = &self.scene.materials[material as usize];
        let textured = painted.texture.is_some();
        let uv = if textured { rounded(mesh.uv(piece.triangle, at).unwrap_or_default(), at) } else { Vec2::ZERO };
        let colour = mesh.colour(piece.triangle, at).filter(|_| !painted.is_lamp()).unwrap_or(Vec3::ONE);
        Corner { place: piece.corners[corner], sample: piece.samples[corner], material, uv, colour }
    }

    /// The number of the vertex at a corner.
    fn vertex(&mut self, corner: Corner) -> u32 {
        let last = &mut self.last[corner.sample as usize];
        let mut vertex = *last;
        while vertex != mesh::NONE && !self.corners[vertex as usize].is(&corner) {
            vertex = self.before[vertex as usize];
        }
        if vertex == mesh::NONE {
            vertex = self.corners.len() as u32;
            self.before.push(std::mem::replace(last, vertex));
            self.corners.push(corner);
        }
        vertex
    }
}

/// Vertices and triangles, sorted by material and place in the model; `probes` are the places in the site of the first
/// lighting's.
fn gathered(
    scene: &Scene,
    surface: &mesh::Surface,
    lit: &SampleLight,
    (setup, probes): (&Setup, &[u32]),
    inner: &[bool],
) -> Baked {
    let last = vec![mesh::NONE; surface.samples.len()];
    let mut gather = Gather { scene, surface, corners: Vec::new(), last, before: Vec::new() };
    let (triangles, origins, materials) = gather.triangles(&surface.pieces);
    let (coarse, _, coarse_materials) = gather.triangles(&surface.coarse);
    let corners = gather.corners;
    let light = setup.lights.first().map(|(_, light)| light);
    let vertex = |corner: &Corner| {
        let &Corner { place, sample, uv, colour, .. } = corner;
        let (sample, mesh::Sample { position, normal }) = (sample as usize, surface.samples[sample as usize]);
        let sees = |r: &&crate::shoot::Records| r.hits().find(scene, position, normal).is_some();
        let seen_by = light.map_or(0, |light| light.records.iter().filter(sees).count().min(255) as u8);
        let finest = light.filter(|_| seen_by > 0).and_then(|light| light.finest(scene, position, normal));
        Vertex {
            position: surface.places[place as usize],
            normal,
            lit_at: position,
            uv,
            colour,
            source: lit.source[sample],
            agreement: lit.agreement[sample],
            probe: finest.and_then(|(record, _)| probes.get(record as usize).copied()),
            seen_by,
        }
    };
    let vertices = corners.par_iter().map(vertex).collect();
    let lightings = setup.lights.len();
    // shade, or shade and sun, of each lighting
    let each = lit.values / lightings.max(1);
    let samples = || corners.iter().map(|c| lit.at(c.sample));
    let irradiance: Vec<Vec<Vec3>> = (0..lightings).map(|l| samples().map(|s| s[l * each]).collect()).collect();
    let suns: Vec<Option<Vec3>> = setup.lights.iter().map(|(_, light)| light.sun.map(|s| s.direction)).collect();
    let apart = |(l, known): (usize, &Option<Vec3>)| match known {
        Some(_) if each > 1 => samples().map(|s| s[l * each + 1] - s[l * each]).collect(),
        _ => Vec::new(),
    };
    let sunlight: Vec<Vec<Vec3>> = suns.iter().enumerate().map(apart).collect();
    let of_pairs = |both: bool| (0..).zip(inner.chunks(2)).filter(move |(_, p)| p == &[both; 2]).map(|(t, _)| t);
    Baked {
        lightings: setup.lights.iter().map(|l| l.0.clone()).collect(),
        vertices,
        irradiance,
        sunlight,
        suns,
        triangles,
        origins,
        materials,
        coarse,
        coarse_materials,
        exposures: Vec::new(),
        views: Vec::new(),
        skies: Vec::new(),
        hidden: of_pairs(false).collect(),
        two_sided: of_pairs(true).count(),
    }
}

/// The sky as probes or the site tell it, black where nobody does.
fn sky(light: &Light) -> Picture {
    const WIDTH: usize = 512;
    let mut picture = Picture::new(WIDTH, WIDTH / 2);
    picture.pixels.par_iter_mut().enumerate().for_each(|(i, pixel)| {
        let (x, y) = ((i % WIDTH) as f64 + 0.5, (i / WIDTH) as f64 + 0.5);
        let direction = Projection::LatLong.direction(WIDTH, WIDTH / 2, x, y);
        *pixel = direction.map_or(Vec3::ZERO, |d| light.sky(d.as_vec3()));
    });
    picture
}

/// Bits of [`mesh::morton`] that tell places within one of 16³ regions: a viewer draws only the runs of triangles that it sees.
const REGION: u32 = 18;

/// Texture coordinates to a 65536th of a repeat but at the model's own corners: neighbours share a vertex then.
fn rounded(uv: Vec2, at: Vec2) -> Vec2 {
    const STEPS: f32 = 65536.0;
    let own = [Vec2::ZERO, Vec2::X, Vec2::Y].contains(&at);
    if own || uv.abs().max_element() > 128.0 { uv } else { (uv * STEPS).round() / STEPS }
}

/// What brings the log-average radiance of the surface, each part by its area, to middle grey.
fn exposure(scene: &Scene, baked: &Baked, lighting: usize) -> Exposure {
    /// So many places say enough, each for the same area.
    const PLACES: usize = 1 << 14;
    let e = &baked.irradiance[lighting];
    let area = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|v| baked.vertices[v as usize].position);
        f64::from((b - a).cross(c - a).length())
    };
    let total: f64 = baked.triangles.iter().map(area).sum();
    let mut pixels = Vec::with_capacity(PLACES);
    let (mut sum, mut next) = (0.0, 0.0);
    for (material, ends) in baked.materials.windows(2).enumerate() {
        let (plain, texture) = scene.materials[material].with_white_lamps();
        let texture = texture.map(|t| &scene.textures[t as usize]);
        for t in &baked.triangles[ends[0] as usize..ends[1] as usize] {
            sum += area(t);
            while next < sum && pixels.len() < PLACES {
                let mean = |of: &dyn Fn(usize) -> Vec3| t.iter().map(|v| of(*v as usize)).sum::<Vec3>() / 3.0;
                let colour = mean(&|v| baked.vertices[v].colour * e[v]);
                let texel = texture.map_or(Vec3::ONE, |t| t.sample(Vec2::ZERO, f32::MAX));
                pixels.push(plain * texel * colour / PI);
                next += total / PLACES as f64;
            }
        }
    }
    Exposure::of(&Picture { width: pixels.len(), height: 1, pixels })
}
