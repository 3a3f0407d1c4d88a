//! What the model shows from a pose, through a picture's own lens: for people to compare with the picture.

use glam::{DVec2, Vec3};
use rayon::prelude::*;

use super::{RegisterError, Subject};
use crate::panorama::{self, Picture, luminance};
use crate::photograph;
use crate::scene::{Ray, Scene};
use crate::site::{Pose, Site};

/// The model from a pose, pixel by pixel.
#[derive(Clone, Debug)]
pub struct Preview {
    /// Width in pixels.
    pub width: usize,
    /// Height in pixels.
    pub height: usize,
    /// Linear, 0..=1: albedo under a lamp at the lens that reaches all distances alike. Lamps of the model and what is not
    /// modelled are white; `None` where the picture shows nothing.
    pub shade: Vec<Option<f32>>,
    /// Whether an edge of the model lies between this pixel and the one to its right or below: a silhouette, two materials
    /// side by side, or a crease. A scan's creases are left out where they are noise.
    pub edge: Vec<bool>,
}

/// What is left of a surface's shade where it is seen edge-on.
const AMBIENT: f32 = 0.35;

/// Rays shorter than this are taken for the tripod, metres.
const NEAREST_M: f32 = 1e-3;

/// Surfaces whose normals differ by this cosine meet in a crease.
const CREASE: f32 = 0.9;

/// What a pixel shows of the model.
#[derive(Clone, Copy)]
struct SurfacePoint {
    /// Local metres.
    point: Vec3,
    normal: Vec3,
    distance: f32,
    material: u32,
    shade: f32,
}

/// The picture of a probe (of this lighting, or its first) or of a view; `None` where it has none.
///
/// # Errors
///
/// A picture that cannot be read.
pub fn picture(site: &Site, subject: Subject, lighting: &str) -> Result<Option<Picture>, RegisterError> {
    match subject {
        Subject::Probe(i) => {
            let probe = &site.probes[i];
            let lit = probe.picture(lighting).or(probe.pictures.first());
            Ok(lit.map(|l| panorama::read(&l.path)).transpose()?)
        }
        Subject::View(i) => Ok(photograph::read(&site.views[i])?.map(|(picture, _)| picture)),
    }
}

/// The model from `pose` as a picture of `full` pixels (width, height) would show it, drawn in `size` pixels.
pub fn preview(
    site: &Site,
    scene: &Scene,
    subject: Subject,
    pose: &Pose,
    full: [usize; 2],
    size: [usize; 2],
) -> Preview {
    let [width, height] = size;
    let scale = DVec2::new(full[0] as f64 / width as f64, full[1] as f64 / height as f64);
    let origin = scene.local(pose.position);
    let rotation = pose.rotation.as_mat3();
    let projection = subject.projection(site);
    let toward = |x: f64, y: f64| {
        let p = DVec2::new(x, y) * scale;
        projection.direction(full[0], full[1], p.x, p.y)
    };
    // a pixel's angle, for the albedo's footprint: that of the middle
    let middle = [0.5 * width as f64, 0.5 * height as f64];
    let angle = match (toward(middle[0], middle[1]), toward(middle[0] + 1.0, middle[1])) {
        (Some(a), Some(b)) => a.angle_between(b) as f32,
        _ => std::f32::consts::TAU / width.max(1) as f32,
    };
    let at = |i: usize| -> Option<Option<SurfacePoint>> {
        let d = toward((i % width) as f64 + 0.5, (i / width) as f64 + 0.5)?;
        Some(seen(scene, origin, rotation * d.as_vec3(), angle))
    };
    let pixels: Vec<Option<Option<SurfacePoint>>> = (0..width * height).into_par_iter().map(at).collect();
    let line = |parted: &(dyn Fn(Option<SurfacePoint>, Option<SurfacePoint>) -> bool + Sync)| -> Vec<bool> {
        let between = |i: usize, j: usize| matches!((pixels[i], pixels[j]), (Some(a), Some(b)) if parted(a, b));
        let right = |i: usize| i % width + 1 < width && between(i, i + 1);
        let below = |i: usize| i + width < width * height && between(i, i + width);
        (0..width * height).into_par_iter().map(|i| right(i) || below(i)).collect()
    };
    let mut edge = line(&|a, b| outline(origin, a, b, angle));
    let creases = line(&crease);
    if !rough(&creases) {
        edge.iter_mut().zip(&creases).for_each(|(e, c)| *e |= c);
    }
    let shade = pixels.iter().map(|p| p.map(|seen| seen.map_or(1.0, |s| s.shade))).collect();
    Preview { width, height, shade, edge }
}

fn seen(scene: &Scene, origin: Vec3, direction: Vec3, angle: f32) -> Option<SurfacePoint> {
    let ray = Ray { origin, direction };
    let hit = scene.tracer.closest(&ray, NEAREST_M)?;
    let face = scene.face(hit.triangle);
    let s = face.surface(&ray, hit.t);
    let cosine = s.normal.dot(direction).abs();
    let lamp = scene.emission(hit.triangle) != Vec3::ZERO;
    let footprint = hit.t * angle / cosine.max(0.1).sqrt();
    let albedo = luminance(scene.paint(&face, true).albedo(s.barycentric, footprint));
    let shade = if lamp { 1.0 } else { albedo * (AMBIENT + (1.0 - AMBIENT) * cosine) };
    let material = scene.mesh.materials[hit.triangle as usize];
    Some(SurfacePoint { point: s.position, normal: s.normal, distance: hit.t, material, shade: shade.clamp(0.0, 1.0) })
}

/// Whether a silhouette or a change of material lies between what two neighbouring pixels show.
fn outline(origin: Vec3, a: Option<SurfacePoint>, b: Option<SurfacePoint>, angle: f32) -> bool {
    let (Some(a), Some(b)) = (a, b) else { return a.is_some() != b.is_some() };
    if a.material != b.material {
        return true;
    }
    // one surface goes on in the other's plane, within what a bend of less than a crease can do
    let (near, far) = if a.distance < b.distance { (a, b) } else { (b, a) };
    let off = near.normal.dot(far.point - near.point).abs();
    let cosine = near.normal.dot((near.point - origin).normalize_or_zero()).abs();
    off > 0.5 * near.point.distance(far.point) && off > 1.5 * near.distance * angle && cosine > 0.02
}

/// Whether two surfaces meet at an angle between two neighbouring pixels.
fn crease(a: Option<SurfacePoint>, b: Option<SurfacePoint>) -> bool {
    matches!((a, b), (Some(a), Some(b)) if a.normal.dot(b.normal) < CREASE)
}

/// Whether creases are the noise of a scan, not lines: they are too many.
fn rough(creases: &[bool]) -> bool {
    /// The share of pixels on creases: 1 to 4 % in the bundled chapel, 8 to 10 % in a hand-held scan, 1024 pixels wide.
    const MOST: f64 = 0.06;
    creases.iter().filter(|c| **c).count() as f64 > MOST * creases.len() as f64
}
