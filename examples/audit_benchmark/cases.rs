//! Where faults are planted: places on the model's surfaces and objects in it.

use clerestory::panorama::luminance;
use clerestory::render::PrimaryRays;
use clerestory::scene::Ray;
use glam::Vec3;
use std::collections::BTreeMap;

use crate::Bench;
use crate::objects::objects;
use crate::plant::{Fault, Place};

/// A fault to plant and the view that is to show it.
pub struct Case {
    pub fault: Fault,
    pub place: Place,
    pub object: Option<Vec<bool>>,
    pub view: usize,
}

impl Bench {
    /// Places on flat, textured surfaces that two probes see, and what to plant there.
    pub fn cases(&self, seed: u64, per: usize) -> Vec<Case> {
        let mut kinds = vec![
            Fault::Rotate90,
            Fault::Rotate180,
            Fault::Mirror,
            Fault::Shift(0.3),
            Fault::Scale(1.5),
            Fault::Recolour,
            Fault::Swap,
            Fault::Displace(-0.01),
            Fault::Displace(0.02),
            Fault::Displace(-0.05),
            Fault::Displace(0.05),
            Fault::Displace(-0.10),
            Fault::Displace(0.10),
            Fault::Hole,
            Fault::Extra(0.4),
        ];
        kinds = kinds.iter().flat_map(|k| std::iter::repeat_n(*k, per)).collect();
        let mut cases = vec![];
        let mut at = seed * 1000;
        for (k, fault) in kinds.into_iter().enumerate() {
            for _ in 0..400 {
                at += 1;
                let view = (k + seed as usize + at as usize % 2) % self.cameras.len();
                if let Some(place) = self.place(view, at, fault) {
                    cases.push(Case { fault, place, object: None, view });
                    break;
                }
            }
        }
        let parts = self.objects();
        for (k, fault) in [Fault::Missing, Fault::Move(0.1), Fault::Missing, Fault::Move(0.2)].into_iter().enumerate() {
            if let Some(case) = self.object(&parts, (k + seed as usize) % self.cameras.len(), fault, seed as usize) {
                cases.push(case);
            }
        }
        cases
    }

    /// The object that each triangle is of: what is connected or, of a scan whose generator knows better, what it says.
    fn objects(&self) -> Vec<usize> {
        let mesh = &self.scene.mesh;
        let folder = self.site.file.parent().unwrap();
        let Ok(known) = std::fs::read_to_string(folder.join("truth/objects.txt")) else { return objects(mesh) };
        let model = std::fs::read_to_string(folder.join("model/model.obj")).unwrap();
        // vertices as the file has them, to a tenth of a millimetre
        let key = |p: [f64; 3]| p.map(|v| (v * 1e4).round() as i64);
        let position = |line: &str| {
            let mut numbers = line.split_whitespace().skip(1).map(|n| n.parse::<f64>().unwrap());
            [(); 3].map(|()| numbers.next().unwrap())
        };
        let vertices = model.lines().filter(|l| l.starts_with("v ")).map(|l| key(position(l)));
        let of: BTreeMap<[i64; 3], usize> = vertices.zip(known.lines().map(|l| l.parse().unwrap())).collect();
        let object = |t: &[u32; 3]| {
            let p = mesh.positions[t[0] as usize].as_dvec3() + self.scene.origin;
            of[&key(self.site.frame.point_out(p).to_array())]
        };
        mesh.triangles.iter().map(object).collect()
    }

    fn place(&self, view: usize, at: u64, fault: Fault) -> Option<Place> {
        let camera = &self.cameras[view];
        let scene = &self.scene;
        let u = |k: u64| {
            let z = (at * 2 + k).wrapping_mul(0x9E37_79B9_7F4A_7C15);
            let z = (z ^ (z >> 29)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
            ((z ^ (z >> 32)) >> 11) as f64 / (1u64 << 53) as f64
        };
        let (x, y) = ((0.15 + 0.7 * u(0)) * f64::from(camera.width), (0.15 + 0.7 * u(1)) * f64::from(camera.height));
        let ray = Ray { origin: scene.local(camera.pose.position), direction: camera.direction(x, y).as_vec3() };
        let hit = scene.tracer.closest(&ray, 1e-3)?;
        let s = scene.surface(&ray, &hit);
        let cos = -s.normal.dot(ray.direction);
        if !(1.5..11.0).contains(&hit.t) || cos < 0.3 {
            return None;
        }
        let material = |t: u32| scene.mesh.materials[t as usize];
        let textured = scene.materials[material(s.triangle) as usize].texture.is_some();
        // a scan has its picture at its vertices, and no other to put in its place
        let coloured = !scene.mesh.colours.is_empty() && fault != Fault::Swap;
        if fault.is_texture() && !textured && !coloured {
            return None;
        }
        let half = 0.09 * hit.t / cos.sqrt();
        let place = Place { middle: s.position, normal: s.normal, half, depth: 0.08 };
        let [a, b, _] = place.axes();
        let (mut shown, mut seen) = (vec![], 0);
        for i in 0..49 {
            let (p, q) = ((i % 7) as f32 / 3.0 - 1.0, (i / 7) as f32 / 3.0 - 1.0);
            let at = s.position + (a * p + b * q) * half;
            let down = Ray { origin: at + s.normal * 0.3, direction: -s.normal };
            let hit = scene.tracer.closest(&down, 0.0)?;
            if (hit.t - 0.3).abs() > 0.01 || material(hit.triangle) != material(s.triangle) {
                return None;
            }
            let on = scene.surface(&down, &hit);
            shown.push(luminance(scene.filtered_albedo(on.triangle, on.barycentric, 0.01 * ray.origin.distance(at))));
            let to_camera = ray.origin - at;
            let from = at + s.normal * 2e-3;
            let clear = |to: Vec3| {
                let d = to - from;
                !scene.tracer.occluded(&Ray { origin: from, direction: d.normalize() }, 0.0, d.length())
            };
            if to_camera.dot(s.normal) <= 0.0 || !clear(ray.origin) {
                return None;
            }
            let shows = |k: &usize| {
                let (probe, picture) = (&self.site.probes[*k], &self.probes[*k]);
                let eye = scene.local(probe.pose.position);
                let way = probe.pose.rotation.transpose() * (at - eye).as_dvec3();
                (eye - at).normalize().dot(s.normal) > 0.15
                    && probe.projection.pixel(picture.width, picture.height, way).is_some()
                    && clear(eye)
            };
            seen += (0..self.probes.len()).filter(shows).count();
        }
        let (low, high) = shown.iter().fold((f32::INFINITY, 0.0f32), |(low, high), l| (low.min(*l), high.max(*l)));
        // colours of a scan hold its light, too: a picture bends, where light only slopes
        let bend = |k: usize| {
            let [a, b, c] = [k - 1, k, k + 1].map(|k| shown[k].max(0.01).ln());
            (a - 2.0 * b + c).abs()
        };
        let bends = (0..49).filter(|k| (1..6).contains(&(k % 7))).map(bend).sum::<f32>() / 35.0;
        let pictured = high > 1.15 * low && (textured || !fault.is_texture() || bends > 0.15);
        // two probes on the average, and some picture to go by
        (seen >= 90 && pictured).then_some(place)
    }

    /// A small object of the model that a view shows well.
    fn object(&self, parts: &[usize], view: usize, fault: Fault, seed: usize) -> Option<Case> {
        let camera = &self.cameras[view];
        let rays = PrimaryRays::new(camera, 1);
        let scene = &self.scene;
        let mut seen: BTreeMap<usize, usize> = BTreeMap::new();
        let (w, h) = (camera.width as usize, camera.height as usize);
        for i in (0..w * h).step_by(3) {
            let ray = Ray { origin: scene.local(camera.pose.position), direction: rays.direction(i % w, i / w, 0) };
            if let Some(hit) = scene.tracer.closest(&ray, 1e-3) {
                *seen.entry(parts[hit.triangle as usize]).or_default() += 3;
            }
        }
        let bounds = |part: usize| {
            let mut low = Vec3::INFINITY;
            let mut high = Vec3::NEG_INFINITY;
            for t in (0..parts.len()).filter(|t| parts[*t] == part) {
                for p in scene.mesh.corners(t as u32) {
                    (low, high) = (low.min(p), high.max(p));
                }
            }
            (low, high)
        };
        let mut fit: Vec<(usize, usize)> = seen
            .into_iter()
            .filter(|(part, n)| {
                let (low, high) = bounds(*part);
                let size = high - low;
                (0.15..5.0).contains(&size.max_element())
                    && size.min_element() > 0.02
                    && *n > w * h / 250
                    && *n < w * h / 8
            })
            .map(|(part, n)| (n, part))
            .collect();
        fit.sort_unstable_by(|a, b| b.cmp(a));
        let (_, part) = *fit.get(seed % fit.len().max(1)).or(fit.first())?;
        let (low, high) = bounds(part);
        let place = Place { middle: (low + high) * 0.5, normal: Vec3::Z, half: 1.0, depth: 1.0 };
        Some(Case { fault, place, object: Some(parts.iter().map(|p| *p == part).collect()), view })
    }
}
