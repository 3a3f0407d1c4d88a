#![allow(missing_docs, clippy::all, clippy::print_stdout, clippy::unwrap_used)]
use clerestory::{scene::{self, Health, Ray}, site::{Camera, Pose, Site}};
use glam::{DVec3, Vec3, dvec3, vec3};
use rayon::prelude::*;
fn main() {
    let a: Vec<String> = std::env::args().collect();
    let site = Site::load(std::path::Path::new(&a[1])).unwrap();
    let mut h = Health::default();
    let s = scene::load(&site, &mut h).unwrap();
    println!("{h:?}");
    let n: Vec<f64> = a[3].split(',').map(|v| v.parse().unwrap()).collect();
    // az (deg from north clockwise), el
    let (az, el) = (n[7].to_radians(), n[8].to_radians());
    let sun = vec3((az.sin() * el.cos()) as f32, (az.cos() * el.cos()) as f32, el.sin() as f32);
    let p = |x: f64, y: f64, z: f64| dvec3(x, -z, y);
    let cam = Camera::with_fov(Pose::look_at(p(n[0], n[1], n[2]), p(n[3], n[4], n[5])), 640, 480, n[6]);
    let o = s.local(cam.pose.position);
    let px: Vec<[u8; 3]> = (0..640 * 480usize).into_par_iter().map(|i| {
        let mut sum = Vec3::ZERO;
        let mut seed = (i as u64).wrapping_mul(0x9E3779B97F4A7C15) | 1;
        let mut rnd = || { seed ^= seed << 13; seed ^= seed >> 7; seed ^= seed << 17; (seed >> 40) as f32 / (1u64 << 24) as f32 };
        for k in 0..4 {
            let d = cam.direction((i % 640) as f64 + 0.25 + 0.5 * (k % 2) as f64, (i / 640) as f64 + 0.25 + 0.5 * (k / 2) as f64).as_vec3();
            let ray = Ray { origin: o, direction: d };
            let Some(hit) = s.tracer.closest(&ray, 1e-4) else { sum += vec3(0.5, 0.7, 1.0); continue };
            let sf = s.surface(&ray, &hit);
            if s.mesh.normal(hit.triangle).dot(d) > 0.0 { sum += vec3(1.0, 0.0, 1.0); continue }
            let at = sf.position + sf.normal * 1e-3;
            let mut e = 0.08;
            if sf.normal.dot(sun) > 0.0 && !s.tracer.occluded(&Ray { origin: at, direction: sun }, 1e-4, 1e4) { e += 1.2 * sf.normal.dot(sun); }
            for _ in 0..8 {
                let (u, v) = (rnd() * std::f32::consts::TAU, rnd());
                let (t, b) = sf.normal.any_orthonormal_pair();
                let w = (t * u.cos() + b * u.sin()) * v.sqrt() + sf.normal * (1.0 - v).sqrt();
                let r = s.tracer.closest(&Ray { origin: at, direction: w.normalize() }, 1e-4);
                e += match r { None => 2.0, Some(h) => 0.75 * (h.t / 2.5).min(1.0) } / 8.0;
            }
            sum += s.albedo(hit.triangle, sf.barycentric) * e;
        }
        (sum / 4.0).to_array().map(|v| ((v * 1.2).clamp(0.0, 1.0).powf(1.0 / 2.2) * 255.0) as u8)
    }).collect();
    image::RgbImage::from_raw(640, 480, px.concat()).unwrap().save(&a[2]).unwrap();
}
