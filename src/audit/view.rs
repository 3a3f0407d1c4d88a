//! One view: from a photograph to what both tests say of each pixel.

use glam::Vec3;
use rayon::prelude::*;
use std::f32::consts::PI;

use crate::audit::finding::PoseCorrection;
use crate::audit::likelihood::agreement::{Unlike, unlike};
use crate::audit::likelihood::appearance::{self, Texture};
use crate::audit::likelihood::photo_consistency::{self, Geometry};
use crate::audit::likelihood::placement::Placement;
use crate::audit::likelihood::structure::BLACK;
use crate::audit::likelihood::warped::Compared;
use crate::audit::observe::geometry_buffer::{GeometryBuffer, NONE, reduced};
use crate::audit::observe::gloss::{Gloss, without};
use crate::audit::observe::photo::{Blurred, Photo, Reduced};
use crate::audit::observe::pose;
use crate::audit::observe::probe_view::ProbeView;
use crate::audit::observe::radiometry::{self, Radiometry, Sights};
use crate::audit::observe::resample::soften;
use crate::audit::verdict::Reason;
use crate::panorama::{Picture, luminance};
use crate::render::{Frame, Relit, render};
use crate::scene::Scene;
use crate::shoot::Light;
use crate::site::{Camera, Probe};
use crate::volume::Volume;

/// How to audit.
#[derive(Clone, Debug)]
pub struct Settings {
    /// Photographs are reduced until their longer side has at most so many pixels.
    pub longest_px: u32,
    /// Refine each camera's pose by a few pixels.
    pub refine_pose: bool,
    /// Leave out probes that were not taken where the site has them; what was measured, or has just been registered, needs no such check.
    pub check_probes: bool,
    /// Use only the first so many probes.
    pub probes: usize,
    /// Cells of the irradiance volume along the model's longest side.
    pub cells: u32,
    /// Findings that a right model would give more often than this in a photograph are doubts.
    pub false_alarms: f64,
    /// Doubts that are less likely faults than this are not told.
    pub least_probability: f64,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            longest_px: 1024,
            refine_pose: true,
            check_probes: true,
            probes: usize::MAX,
            cells: 64,
            false_alarms: 0.1,
            least_probability: 0.1,
        }
    }
}

/// What all views share.
pub struct AuditScene<'a> {
    pub(crate) scene: &'a Scene,
    pub(crate) light: &'a Light,
    pub(crate) volume: Option<&'a Volume<'a>>,
    pub(crate) probes: Vec<ProbeView>,
    /// Per triangle, the part of the model it belongs to.
    pub(crate) parts: Vec<u32>,
}

impl<'a> AuditScene<'a> {
    /// Takes the model, the probes' light and a volume that has a value for every surface that views show.
    pub fn new(scene: &'a Scene, light: &'a Light, volume: Option<&'a Volume<'a>>) -> Self {
        Self { scene, light, volume, probes: Vec::new(), parts: scene.mesh.components() }
    }

    /// Adds a probe with its picture.
    pub fn with(mut self, probe: &Probe, picture: Picture) -> Self {
        self.probes.push(ProbeView::new(self.scene, probe, picture));
        self
    }

    /// The part of the model that a triangle is of; `NONE` for none.
    pub(crate) fn part(&self, triangle: u32) -> u32 {
        self.parts.get(triangle as usize).copied().unwrap_or(NONE)
    }

    /// Metres between a triangle's vertices where these have colours of their own, as a scan's do; 0 where not, `None` for no triangle.
    pub(crate) fn vertex_spacing(&self, triangle: u32) -> Option<f32> {
        let face = (triangle != NONE).then(|| self.scene.face(triangle))?;
        Some(self.scene.paint(&face, false).vertex_spacing(&face))
    }
}

/// What both tests say of a view, pixel by pixel, at the audit's size.
pub struct Observations {
    pub(crate) camera: Camera,
    pub(crate) reduced_by: u32,
    pub(crate) surfaces: GeometryBuffer,
    pub(crate) photo: Reduced,
    pub(crate) render: Picture,
    pub(crate) albedo: Vec<Vec3>,
    /// Smooth irradiance; zero where nothing tells it.
    pub(crate) irradiance: Vec<Vec3>,
    pub(crate) radiometry: Radiometry,
    pub(crate) sights: Sights,
    /// The photograph, as coarse as the model's own colours, with exposure, white balance and vignetting taken out; logarithm.
    pub(crate) log_photo: Vec<Vec3>,
    pub(crate) usable: Vec<f32>,
    /// The most that surfaces may mirror towards the camera, radiance.
    pub(crate) mirrored: Vec<Vec3>,
    pub(crate) geometry: Geometry,
    pub(crate) placement: Placement,
    pub(crate) texture: Texture,
    pub(crate) pose: PoseCorrection,
    pub(crate) settings: Settings,
}

/// Aligns a view's photograph with the model and runs both tests. `mask` is true where the photograph is to be left
/// out; as long as the photograph, or empty.
pub fn examine(prepared: &AuditScene, camera: &Camera, photograph: &Photo, settings: &Settings) -> Observations {
    let scene = prepared.scene;
    let side = camera.width.max(camera.height);
    let n = side.div_ceil(settings.longest_px.max(16)).max(1);
    let first = reduced(camera, n);
    let photo = photograph.reduced(n as usize);
    let usable: Vec<f32> = photo.unusable.iter().map(|r| if *r == Reason::None { 1.0 } else { 0.0 }).collect();
    let relit = Relit { scene, light: prepared.light, volume: prepared.volume, volume_only: false };
    let (camera, pose, (surfaces, frame)) = aligned(scene, &relit, first, &photo, settings);
    let blurred = Blurred::new(&photo.pixels, &usable, &surfaces.shape);
    let sights = Sights::look(&surfaces, &prepared.probes, &usable);
    let soft: Vec<Vec<Vec3>> = prepared
        .probes
        .iter()
        .zip(&sights.of)
        .map(|(probe, sights)| soften(&surfaces, probe, sights, &blurred, &usable))
        .collect();
    let radiometry = radiometry::fit(&surfaces, &sights, &prepared.probes, &soft);
    let log_photo: Vec<Vec3> = (0..usable.len())
        .into_par_iter()
        .map(|i| blurred.at(i, model_blur(scene, &surfaces, i)) + radiometry.at(surfaces.radius2(i)))
        .collect();
    drop(blurred);
    let dark = radiometry.dark(photo.dark);
    let compared = Compared::new(&surfaces, &sights, &prepared.probes, soft, &radiometry, dark);
    let gloss = Gloss::fit(&relit, &surfaces, &prepared.probes, &compared.pairs());
    let geometry = photo_consistency::test(&surfaces, &sights, &prepared.probes, compared, &gloss);
    let placement = Placement::of(&surfaces, &geometry, &prepared.probes);
    let e = appearance::irradiance(scene, &surfaces, prepared.light, prepared.volume);
    let texture = appearance::test(&surfaces, &log_photo, &usable, &frame.albedo.pixels, &e, dark);
    Observations {
        camera,
        reduced_by: n,
        surfaces,
        photo,
        render: frame.radiance,
        albedo: frame.albedo.pixels,
        irradiance: e,
        radiometry,
        sights,
        log_photo,
        usable,
        mirrored: gloss.to_camera,
        geometry,
        placement,
        texture,
        pose,
        settings: settings.clone(),
    }
}

/// What a camera shows of the model: its surfaces, and its picture in the probes' light.
fn look(scene: &Scene, relit: &Relit, camera: &Camera) -> (GeometryBuffer, Frame) {
    (GeometryBuffer::look(scene, camera), render(scene, relit, camera, 4, &|_, _| {}))
}

/// The camera by which the model lies over the photograph, how far it was moved from `first`, and what it shows.
fn aligned(
    scene: &Scene,
    relit: &Relit,
    first: Camera,
    photo: &Reduced,
    settings: &Settings,
) -> (Camera, PoseCorrection, (GeometryBuffer, Frame)) {
    let (mut camera, mut pose) = (first, PoseCorrection::default());
    let (mut surfaces, mut frame) = look(scene, relit, &camera);
    // a model without colours shows nothing to lay over a photograph
    let coloured = frame.albedo.pixels.iter().filter(|a| luminance(**a) > BLACK).count();
    if !settings.refine_pose || 2 * coloured <= surfaces.triangle.iter().filter(|t| **t != NONE).count() {
        return (camera, pose, (surfaces, frame));
    }
    // a clipped pixel is still as bright as that: its edges tell of the pose
    let pictured = |(r, p): (&Reason, &Vec3)| matches!(r, Reason::None | Reason::Clipped) && Picture::valid(*p);
    let to_align: Vec<f32> =
        photo.unusable.iter().zip(&photo.pixels).map(pictured).map(|p| if p { 1.0 } else { 0.0 }).collect();
    let brightness: Vec<f32> = photo.pixels.iter().map(|p| luminance(*p)).collect();
    for _ in 0..2 {
        let shown: Vec<f32> = frame.radiance.pixels.iter().map(|p| luminance(*p)).collect();
        let aligned = pose::align(scene, &surfaces, &camera, &first, &shown, &brightness, &to_align);
        let before = pose.mean_px;
        (camera, pose) = (aligned.camera, aligned.correction);
        if !pose.refined {
            break;
        }
        drop((surfaces, frame));
        (surfaces, frame) = look(scene, relit, &camera);
        if (pose.mean_px - before).abs() < 0.2 {
            break;
        }
    }
    (camera, pose, (surfaces, frame))
}

/// Standard deviation, pixels, of the blur by which a photograph gets as coarse in a pixel as the model's own colours can be: these are means
/// over a texel or around a scan's vertex, and linear between them. A pixel is a mean, too.
fn model_blur(scene: &Scene, surfaces: &GeometryBuffer, i: usize) -> f32 {
    if surfaces.triangle[i] == NONE {
        return 0.0;
    }
    let face = scene.face(surfaces.triangle[i]);
    let detail_px = scene.paint(&face, false).finest_detail(&face) / surfaces.footprint(i);
    0.5 * (detail_px * detail_px - 1.0).max(0.0).sqrt()
}

impl Observations {
    /// Width and height.
    pub fn size(&self) -> (usize, usize) {
        (self.surfaces.width, self.surfaces.height)
    }

    /// Whether the photograph shows something in a pixel.
    pub(crate) fn shows(&self, i: usize) -> bool {
        self.usable[i] > 0.0 && self.log_photo[i].is_finite()
    }

    /// Whether the photograph has a pixel that is not to be left out, too bright or too dark to say anything though it may be.
    pub(crate) fn pictures(&self, i: usize) -> bool {
        self.photo.unusable[i] != Reason::Masked && self.photo.pixels[i].max_element() > 0.0
    }

    /// How unlike the photograph is to the model's albedo in smooth light, but for pixels that something explains already.
    pub(crate) fn unlike(&self, explained: &[bool]) -> Unlike {
        let scale = self.texture.offset.map(f32::exp) / PI;
        let in_smooth_light: Vec<Vec3> =
            self.albedo.iter().zip(&self.irradiance).map(|(a, e)| *a * *e * scale).collect();
        // what a surface mirrors is no structure of its own
        let matt = |i: usize| without(self.log_photo[i].map(f32::exp), self.mirrored[i], in_smooth_light[i]);
        let matt: Vec<Vec3> = (0..self.log_photo.len()).into_par_iter().map(matt).collect();
        let usable: Vec<f32> = self.usable.iter().zip(explained).map(|(u, e)| if *e { 0.0 } else { *u }).collect();
        unlike(self.surfaces.width, &matt, &in_smooth_light, &usable, self.radiometry.dark(self.photo.dark))
    }

    /// The refined camera, at the audit's size, and how far it was moved.
    pub fn pose(&self) -> (Camera, PoseCorrection) {
        (self.camera, self.pose)
    }
}
