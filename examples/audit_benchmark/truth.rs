//! Which pixels a fault changes, and which of them anybody could tell.

use clerestory::panorama::{Panorama, Picture};
use clerestory::render::PrimaryRays;
use clerestory::scene::{self, Health, Ray, Scene, Texture};
use clerestory::site::{Camera, Probe, Site};
use glam::Vec3;

use crate::Bench;
use crate::cases::Case;

/// What a fault does to a view's pixels.
pub struct Truth {
    /// The fault changes them, and it shows.
    pub wrong: Vec<bool>,
    /// In the part that is wrong, with nothing to see of it: neither right nor wrong to mark.
    pub alike: Vec<bool>,
    /// Of a fault of shape: in half of its pixels, pictures part by less than this many pixels of the coarser of
    /// photograph and probe, in the probe that tells best. Infinite for a texture.
    pub parallax_px: f64,
}

impl Truth {
    /// Nobody could tell at this resolution that it is a fault of shape.
    pub fn is_fine(&self) -> bool {
        self.parallax_px < 1.0
    }
}

/// Difference of logarithms, averaged over 7 × 7 pixels, from which on a fault shows.
const SHOWS: f32 = 0.06;

/// What a ray meets: distance and albedo.
type Met = Option<(f32, Vec3)>;

impl Bench {
    /// Which pixels a fault changes: where the two models' surfaces part, or show another albedo. It shows where the
    /// albedo differs, or where some probe saw something else at the model's place than at the real one and the two
    /// places are at least a pixel apart.
    pub fn truth(&self, model: &Scene, case: &Case) -> Truth {
        let camera = &self.cameras[case.view];
        let (w, h) = (camera.width as usize, camera.height as usize);
        let rays = PrimaryRays::new(camera, 1);
        let origin = self.scene.local(camera.pose.position);
        let look = |scene: &Scene, i: usize| -> Met {
            let ray = Ray { origin, direction: rays.direction(i % w, i / w, 0) };
            scene.tracer.closest(&ray, 1e-3).map(|hit| {
                let face = scene.face(hit.triangle);
                let surface = face.surface(&ray, hit.t);
                let (direction, sides) = rays.middle(i % w, i / w);
                let covered = face.covered(direction, sides, hit.t);
                (hit.t, scene.paint(&face, true).patch(&face, surface.barycentric, covered, Texture::APART))
            })
        };
        let probes: Vec<(Vec3, Panorama)> =
            self.site.probes.iter().zip(&self.probes).map(|(p, picture)| seen(&self.scene, p, picture)).collect();
        let mut changed = vec![false; w * h];
        let mut signal = vec![0.0f32; w * h];
        let mut parted = vec![];
        for i in 0..w * h {
            let (real, modelled) = (look(&self.scene, i), look(model, i));
            let direction = rays.direction(i % w, i / w, 0);
            if let (Some(a), Some(b)) = (real, modelled) {
                let ln = |v: Vec3| v.max(Vec3::splat(0.01)).map(f32::ln);
                signal[i] = (ln(a.1) - ln(b.1)).abs().element_sum() / 3.0;
                changed[i] = if case.fault.is_texture() {
                    case.place.holds(origin + direction * a.0, 1e-3 * a.0)
                } else {
                    (a.0 - b.0).abs() > 2e-3 + 5e-4 * a.0
                };
            } else {
                changed[i] = real.is_some() != modelled.is_some();
                signal[i] = if changed[i] { 1.0 } else { 0.0 };
            }
            if changed[i] && !case.fault.is_texture() {
                let pixel = 1.0 / camera.focal.y as f32;
                let (px, difference) = self.apart(origin, direction, pixel, &probes, real, modelled);
                parted.push(f64::from(px));
                signal[i] = signal[i].max(difference);
            }
        }
        // a picture is wrong over an area, not only where two texels differ
        let shows = |i: usize| {
            let (x, y) = ((i % w) as isize, (i / w) as isize);
            let (mut sum, mut count) = (0.0, 0.0);
            for (dx, dy) in (-3..=3).flat_map(|dy| (-3..=3).map(move |dx| (dx, dy))) {
                let (x, y) = (x + dx, y + dy);
                if x >= 0 && y >= 0 && x < w as isize && y < h as isize {
                    let j = y as usize * w + x as usize;
                    if changed[j] || case.fault.is_texture() {
                        sum += signal[j];
                        count += 1.0;
                    }
                }
            }
            sum / count > SHOWS
        };
        let wrong: Vec<bool> = (0..w * h).map(|i| changed[i] && shows(i)).collect();
        let alike = (0..w * h).map(|i| changed[i] && !wrong[i]).collect();
        parted.sort_by(f64::total_cmp);
        let parallax_px = parted.get(parted.len() / 2).copied().unwrap_or(f64::INFINITY);
        Truth { wrong, alike, parallax_px }
    }

    /// By how many pixels the probes' pictures of the real and the modelled place of a view's ray part, in the probe
    /// that tells best, and by how much those that part by a pixel differ there.
    fn apart(
        &self,
        origin: Vec3,
        direction: Vec3,
        pixel: f32,
        probes: &[(Vec3, Panorama)],
        real: Met,
        modelled: Met,
    ) -> (f32, f32) {
        let Some((t, _)) = real else { return (f32::INFINITY, 1.0) };
        let point = origin + direction * t;
        let (mut most, mut difference) = (0.0f32, 0.0f32);
        for (eye, panorama) in probes {
            let to = point - *eye;
            let ray = Ray { origin: *eye, direction: to.normalize() };
            if self.scene.tracer.occluded(&ray, 1e-3, to.length() - 2e-3 - 1e-3 * t) {
                continue;
            }
            let Some((s, _)) = modelled else { return (f32::INFINITY, 1.0) };
            let other = (origin + direction * s - *eye).normalize();
            let coarser = (std::f32::consts::PI / panorama.picture().height as f32).max(pixel * t / to.length());
            let px = ray.direction.angle_between(other) / coarser;
            most = most.max(px);
            if px >= 1.0 {
                let ln = |d: Vec3| panorama.radiance(d).max(Vec3::splat(1e-5)).map(f32::ln);
                difference = difference.max((ln(ray.direction) - ln(other)).abs().element_sum() / 3.0);
            }
        }
        (most, difference)
    }
}

/// What a site's pictures were made from, where its folder says so: what `interiors` writes.
pub fn true_place(site: &Site) -> Option<(Site, Scene)> {
    let truth = Site::load(&site.file.parent()?.join("truth/site.toml")).ok()?;
    let scene = scene::load(&truth, &mut Health::default()).unwrap();
    Some((truth, scene))
}

/// Pixels in which a model has its surface elsewhere than the place that was photographed: a scan lacks what its depths missed. By more than
/// 3 cm and 3 % of the distance, and than all within three pixels.
pub fn astray(model: &Scene, camera: &Camera, place: &Scene, taken_by: &Camera) -> Vec<bool> {
    const OFF: (f32, f32) = (0.03, 0.03);
    const REACH: usize = 3;
    let (w, h) = (camera.width as usize, camera.height as usize);
    let (given, real) = (distances(model, camera), distances(place, taken_by));
    let within = |i: usize| {
        let (x, y) = (i % w, i / w);
        let rows = y.saturating_sub(REACH)..(y + REACH + 1).min(h);
        let row = |y: usize| y * w + x.saturating_sub(REACH)..y * w + (x + REACH + 1).min(w);
        let all = rows.flat_map(row).map(|j| real[j]);
        all.fold([f32::INFINITY, 0.0f32], |[least, most], t| [least.min(t), most.max(t)])
    };
    let off = |i: usize| {
        let [least, most] = within(i);
        given[i] < least * (1.0 - OFF.1) - OFF.0 || given[i] > most * (1.0 + OFF.1) + OFF.0
    };
    (0..w * h).map(off).collect()
}

/// Per pixel, how far the surface is; infinite without one.
fn distances(scene: &Scene, camera: &Camera) -> Vec<f32> {
    let (w, h) = (camera.width as usize, camera.height as usize);
    let rays = PrimaryRays::new(camera, 1);
    let origin = scene.local(camera.pose.position);
    let far = |i: usize| {
        let ray = Ray { origin, direction: rays.direction(i % w, i / w, 0) };
        scene.tracer.closest(&ray, 1e-3).map_or(f32::INFINITY, |hit| hit.t)
    };
    (0..w * h).map(far).collect()
}

/// Where a probe stands and what it saw.
fn seen(scene: &Scene, probe: &Probe, picture: &Picture) -> (Vec3, Panorama) {
    (scene.local(probe.pose.position), Panorama::new(picture.clone(), probe.projection, probe.pose.rotation))
}

/// All pixels but those within two of the truth's border.
pub fn counted(truth: &[bool], w: usize, h: usize) -> Vec<bool> {
    (0..w * h)
        .map(|i| {
            let (x, y) = ((i % w) as isize, (i / w) as isize);
            (-2..=2).all(|dy: isize| {
                (-2..=2).all(|dx: isize| {
                    let (x, y) = (x + dx, y + dy);
                    x < 0
                        || y < 0
                        || x >= w as isize
                        || y >= h as isize
                        || truth[y as usize * w + x as usize] == truth[i]
                })
            })
        })
        .collect()
}
