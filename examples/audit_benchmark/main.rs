//! Measures the audit against planted faults: how well it ranks pixels, finds regions, tells kinds apart and keeps quiet
//! on a faultless model, under nuisances, beside plain ways to compare pictures.
//!
//! ```text
//! cargo run --release --example audit_benchmark -- SITE [faults|nuisances|faultless] [--longest 256] [--seed 1]
//!     [--per 1] [--every 3] [--cells 32] [--only wall,hole]
//! ```
//!
//! Faults are planted in the model that the auditor is given; photographs and probes stay those of the true one.

#![allow(clippy::unwrap_used, clippy::print_stdout, missing_docs, unreachable_pub, reason = "a measuring program")]

mod measure;
mod nuisance;
mod plant;

use clerestory::audit::{Judged, Kind, Photo, Prepared, Reason, Settings, Verdict, examine};
use clerestory::panorama::{self, Picture, luminance};
use clerestory::render::{Options, PrimaryRays, Relit, prepare, render};
use clerestory::scene::{self, Health, Ray, Scene};
use clerestory::shoot::Light;
use clerestory::site::{Camera, Site};
use clerestory::study;
use clerestory::volume::{self, Volume};
use glam::Vec3;
use measure::{average_precision, dissimilarity, mean, median, overlap};
use nuisance::Nuisance;
use plant::{Fault, Place, objects, plant};
use std::collections::BTreeMap;
use std::path::Path;

struct Bench {
    site: Site,
    scene: Scene,
    /// Truth, at the audit's size.
    photos: Vec<Picture>,
    cameras: Vec<Camera>,
    probes: Vec<Picture>,
    cells: u32,
}

/// A fault to plant and the view that is to show it.
struct Case {
    fault: Fault,
    place: Place,
    object: Option<Vec<bool>>,
    view: usize,
}

/// What a fault does to a view's pixels.
struct Truth {
    wrong: Vec<bool>,
    /// In the part that is wrong, with nothing to see of it: neither right nor wrong to mark.
    alike: Vec<bool>,
}

/// What a view gave.
#[derive(Default)]
struct Row {
    ours: Vec<f64>,
    alone: Vec<f64>,
    difference: Vec<f64>,
    ssim: Vec<f64>,
    flip: Vec<f64>,
    found: usize,
    missed: usize,
    false_regions: usize,
    kind_right: usize,
    what_right: usize,
    displacement: Vec<f64>,
    sign_right: usize,
    wrongly_ok: Vec<f64>,
}

fn main() {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let number = |name: &str, default: u64| {
        args.iter().position(|a| a == name).map_or(default, |i| args[i + 1].parse().expect("a number"))
    };
    let longest = number("--longest", 256) as usize;
    let bench = Bench::load(Path::new(&args[0]), longest, number("--cells", 32) as u32);
    let what = args.get(1).map_or("faults", String::as_str);
    let seed = number("--seed", 1);
    if what == "faultless" {
        faultless(&bench);
        return;
    }
    let per = number("--per", 1) as usize;
    let mut cases = bench.cases(seed, per);
    // kinds whose name holds one of these words
    if let Some(i) = args.iter().position(|a| a == "--only") {
        let words: Vec<&str> = args[i + 1].split(',').collect();
        cases.retain(|c| words.iter().any(|w| c.fault.title().contains(w)));
    }
    let nuisances: &[Nuisance] = if what == "nuisances" { &Nuisance::EACH } else { &[Nuisance::Clean] };
    let mut by_fault: BTreeMap<String, Row> = BTreeMap::new();
    let mut by_nuisance: Vec<(String, Row)> = nuisances.iter().map(|n| (n.title(), Row::default())).collect();
    for (c, case) in cases.iter().enumerate() {
        if what == "nuisances" && c % number("--every", 3) as usize != 0 {
            continue;
        }
        let model = plant(&bench.scene, case.fault, &case.place, case.object.as_deref());
        let truth = bench.truth(&model, case);
        let size = truth.wrong.iter().filter(|t| **t).count();
        let alike = truth.alike.iter().filter(|t| **t).count();
        if size < 60 {
            println!("# {} in {}: too small ({size} pixels)", case.fault.title(), bench.site.views[case.view].name);
            continue;
        }
        if size * 5 < alike {
            println!(
                "# {} in {}: hardly to be seen ({size} of {} pixels look otherwise), not counted",
                case.fault.title(),
                bench.site.views[case.view].name,
                alike + size
            );
            continue;
        }
        if alike > 0 {
            println!("# {}: {alike} of {} pixels look the same all the same", case.fault.title(), alike + size);
        }
        for (k, nuisance) in nuisances.iter().enumerate() {
            let line = bench.run(&model, case, &truth, *nuisance);
            println!(
                "# {:14} {:12} {:16} {size:>5} px AP {:.2} ({:.2} SSIM, {:.2} FLIP) {}",
                case.fault.title(),
                bench.site.views[case.view].name,
                nuisance.title(),
                line.ours[0],
                line.ssim[0],
                line.flip[0],
                line_of(&line)
            );
            by_nuisance[k].1.add(&line);
            if *nuisance == Nuisance::Clean {
                by_fault.entry(case.fault.title()).or_default().add(&line);
            }
        }
    }
    if what == "faults" {
        table(&by_fault.into_iter().collect::<Vec<_>>());
    }
    table(&by_nuisance);
}

fn line_of(r: &Row) -> String {
    format!(
        "found {} false {} kind {} what {} off {:?} ok {:.2}",
        r.found, r.false_regions, r.kind_right, r.what_right, r.displacement, r.wrongly_ok[0]
    )
}

fn table(rows: &[(String, Row)]) {
    println!(
        "{:18} {:>4} {:>6} {:>6} {:>6} {:>6} {:>6} {:>6} {:>7} {:>6} {:>6} {:>6} {:>5} {:>8}",
        "", "n", "AP", "AP own", "diff", "SSIM", "FLIP", "F1", "kind", "what", "displ", "sign", "false", "wrong ok"
    );
    for (name, r) in rows {
        let n = r.ours.len();
        let f1 = 2.0 * r.found as f64 / (2 * r.found + r.missed + r.false_regions).max(1) as f64;
        let share = |k: usize| format!("{k}/{}", r.found);
        println!(
            "{name:18} {n:>4} {:>6.2} {:>6.2} {:>6.2} {:>6.2} {:>6.2} {f1:>6.2} {:>7} {:>6} {:>6.2} {:>6} {:>5} {:>8.2}",
            mean(&r.ours),
            mean(&r.alone),
            mean(&r.difference),
            mean(&r.ssim),
            mean(&r.flip),
            share(r.kind_right),
            share(r.what_right),
            median(&mut r.displacement.clone()),
            format!("{}/{}", r.sign_right, r.displacement.len()),
            r.false_regions,
            mean(&r.wrongly_ok),
        );
    }
}

impl Row {
    fn add(&mut self, o: &Row) {
        for (a, b) in [
            (&mut self.ours, &o.ours),
            (&mut self.alone, &o.alone),
            (&mut self.difference, &o.difference),
            (&mut self.ssim, &o.ssim),
            (&mut self.flip, &o.flip),
            (&mut self.displacement, &o.displacement),
            (&mut self.wrongly_ok, &o.wrongly_ok),
        ] {
            a.extend(b);
        }
        self.found += o.found;
        self.missed += o.missed;
        self.false_regions += o.false_regions;
        self.kind_right += o.kind_right;
        self.what_right += o.what_right;
        self.sign_right += o.sign_right;
    }
}

impl Bench {
    fn load(path: &Path, longest: usize, cells: u32) -> Self {
        let site = Site::load(path).unwrap();
        let scene = scene::load(&site, &mut Health::default()).unwrap();
        let lighting = site.lightings()[0].clone();
        let picture = |p: &clerestory::site::Probe| {
            panorama::read(&p.pictures.iter().find(|x| x.lighting == lighting).unwrap().path).unwrap()
        };
        let probes = site.probes.iter().map(picture).collect();
        let (mut photos, mut cameras) = (vec![], vec![]);
        for view in &site.views {
            let photo = panorama::read(view.photo.as_ref().unwrap()).unwrap();
            let n = photo.width.max(photo.height).div_ceil(longest);
            photos.push(halved(&photo, n));
            let mut c = view.camera;
            (c.width, c.height) = (c.width / n as u32, c.height / n as u32);
            (c.focal, c.centre) = (c.focal / n as f64, c.centre / n as f64);
            cameras.push(c);
        }
        Self { site, scene, photos, cameras, probes, cells }
    }

    /// Runs something with everything that views share, for a model, a nuisance and cameras.
    fn with<T>(
        &self,
        model: &Scene,
        nuisance: Nuisance,
        cameras: &[Camera],
        f: impl FnOnce(&Prepared, &Light, Option<&Volume>) -> T,
    ) -> T {
        let lighting = self.site.lightings()[0].clone();
        let mut site = self.site.clone();
        site.probes.truncate(nuisance.probes());
        let options = Options {
            lightings: vec![lighting],
            probes: usize::MAX,
            sun: true,
            volume: volume::Settings { cells: self.cells, ..volume::Settings::default() },
            all_stages: true,
            volume_for_all: true,
        };
        let folder = tempfile::tempdir().unwrap();
        let mut pictures = vec![];
        for (k, probe) in site.probes.iter_mut().enumerate() {
            let mut p = self.probes[k].clone();
            let gain = nuisance.gain(k);
            p.pixels.iter_mut().for_each(|v| *v *= gain);
            if gain != Vec3::ONE {
                let path = folder.path().join(format!("{k}.exr"));
                panorama::write_exr(&path, p.width, p.height, &[panorama::Layer::rgb("", &p)], None).unwrap();
                probe.pictures[0].path = path;
            }
            pictures.push(p);
        }
        let setup = prepare(&site, model, cameras, &options).unwrap();
        let light = &setup.lights[0].1;
        let volume = setup.transport_of[0].map(|t| Volume::new(model, &setup.transports[t], light));
        let lit: Vec<_> = site.probes.iter().zip(&pictures).collect();
        f(&Prepared::new(model, light, volume.as_ref(), &lit), light, volume.as_ref())
    }

    /// Audits a case under a nuisance.
    fn run(&self, model: &Scene, case: &Case, Truth { wrong: truth, alike }: &Truth, nuisance: Nuisance) -> Row {
        let photo = nuisance.photograph(&self.photos[case.view]);
        let camera = nuisance.camera(&self.cameras[case.view], 5.0);
        let (w, h) = (photo.width, photo.height);
        let settings = Settings { longest_px: 4096, ..Settings::default() };
        self.with(model, nuisance, &[camera], |prepared, light, volume| {
            let maps = examine(prepared, &camera, &Photo::new(photo.clone()), &settings);
            let [geometry, texture, _] = maps.scores();
            let (judged, verdicts) = maps.judged(prepared);
            let both = maps.suspicion(&judged);
            // what touches the mask's border by a pixel or two is neither
            let counted: Vec<bool> = counted(truth, w, h).iter().zip(alike).map(|(c, a)| *c && !a).collect();
            let relit = Relit { scene: model, light, volume, volume_only: false };
            let frame = render(model, &relit, &camera, 4, &|_, _| {});
            let [difference, ssim, flip] = baselines(&frame.radiance, &photo);
            let ap = |scores: &[f32]| vec![average_precision(scores, truth, &counted)];
            let mut row = Row {
                ours: ap(&both),
                alone: ap(if case.fault.is_texture() { &texture } else { &geometry }),
                difference: ap(&difference),
                ssim: ap(&ssim),
                flip: ap(&flip),
                ..Row::default()
            };
            let size = truth.iter().filter(|t| **t).count();
            row.wrongly_ok =
                vec![(0..w * h).filter(|i| truth[*i] && verdicts[*i] == Verdict::Ok).count() as f64 / size as f64];
            regions(&mut row, case, truth, alike, &judged);
            if std::env::var_os("REGIONS").is_some() {
                for j in &judged {
                    println!(
                        "#     {}/{} {} {} px, {:.2} over union, {:.2}: {}",
                        j.kind.name(),
                        j.what.name(),
                        j.reason.name(),
                        j.pixels().len(),
                        overlap(j.pixels(), truth, size),
                        j.score,
                        j.displacement.map_or(String::new(), |d| format!("{:.3} m", d.metres)),
                    );
                }
            }
            row
        })
    }

    /// Which pixels a fault changes: where the two models' surfaces part, or show another albedo; and which lie in the
    /// part that is wrong but look the same all the same, so that nothing could tell.
    fn truth(&self, model: &Scene, case: &Case) -> Truth {
        let camera = &self.cameras[case.view];
        let (w, h) = (camera.width as usize, camera.height as usize);
        let rays = PrimaryRays::new(camera, 1);
        let look = |scene: &Scene, i: usize| {
            let ray = Ray { origin: scene.local(camera.pose.position), direction: rays.direction(i % w, i / w, 0) };
            scene.tracer.closest(&ray, 1e-3).map(|hit| {
                let face = scene.face(hit.triangle);
                let surface = face.surface(&ray, hit.t);
                let (direction, sides) = rays.middle(i % w, i / w);
                let covered = face.covered(direction, sides, hit.t);
                (hit.t, scene.paint(&face, true).patch(&face, surface.barycentric, covered))
            })
        };
        let mut depth = vec![false; w * h];
        let mut planted = vec![false; w * h];
        let mut albedo = vec![0.0f32; w * h];
        for i in 0..w * h {
            match (look(&self.scene, i), look(model, i)) {
                (Some(a), Some(b)) => {
                    depth[i] = (a.0 - b.0).abs() > 2e-3 + 5e-4 * a.0;
                    let direction = rays.direction(i % w, i / w, 0);
                    let point = self.scene.local(camera.pose.position) + direction * a.0;
                    planted[i] = case.fault.is_texture() && case.place.holds(point, 1e-3 * a.0);
                    let ln = |v: Vec3| v.max(Vec3::splat(0.01)).map(f32::ln);
                    albedo[i] = (ln(a.1) - ln(b.1)).abs().element_sum() / 3.0;
                }
                (a, b) => depth[i] = a.is_some() != b.is_some(),
            }
        }
        if !case.fault.is_texture() {
            return Truth { alike: vec![false; w * h], wrong: depth };
        }
        // a texture is wrong over an area, not only where two texels differ
        let wrong: Vec<bool> = (0..w * h)
            .map(|i| {
                if !planted[i] {
                    return false;
                }
                let (x, y) = ((i % w) as isize, (i / w) as isize);
                let (mut sum, mut count) = (0.0, 0.0);
                for dy in -3..=3 {
                    for dx in -3..=3 {
                        let (x, y) = (x + dx, y + dy);
                        if x >= 0 && y >= 0 && x < w as isize && y < h as isize {
                            sum += albedo[y as usize * w + x as usize];
                            count += 1.0;
                        }
                    }
                }
                sum / count > 0.06
            })
            .collect();
        let alike = (0..w * h).map(|i| planted[i] && !wrong[i]).collect();
        Truth { wrong, alike }
    }

    /// Places on flat, textured surfaces that two probes see, and what to plant there.
    fn cases(&self, seed: u64, per: usize) -> Vec<Case> {
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
        let parts = objects(&self.scene.mesh);
        for (k, fault) in [Fault::Missing, Fault::Move(0.1), Fault::Missing, Fault::Move(0.2)].into_iter().enumerate() {
            if let Some(case) = self.object(&parts, (k + seed as usize) % self.cameras.len(), fault, seed as usize) {
                cases.push(case);
            }
        }
        cases
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
        if !textured && fault.is_texture() {
            return None;
        }
        let half = 0.09 * hit.t / cos.sqrt();
        let place = Place { middle: s.position, normal: s.normal, half, depth: 0.08 };
        let up = if s.normal.z.abs() > 0.9 { Vec3::Y } else { Vec3::Z };
        let a = up.cross(s.normal).normalize();
        let b = s.normal.cross(a);
        let (mut low, mut high, mut seen) = (f32::INFINITY, 0.0f32, 0);
        for i in 0..49 {
            let (p, q) = ((i % 7) as f32 / 3.0 - 1.0, (i / 7) as f32 / 3.0 - 1.0);
            let at = s.position + (a * p + b * q) * half;
            let down = Ray { origin: at + s.normal * 0.3, direction: -s.normal };
            let hit = scene.tracer.closest(&down, 0.0)?;
            if (hit.t - 0.3).abs() > 0.01 || material(hit.triangle) != material(s.triangle) {
                return None;
            }
            let on = scene.surface(&down, &hit);
            let l = luminance(scene.filtered_albedo(on.triangle, on.barycentric, 0.01 * ray.origin.distance(at)));
            (low, high) = (low.min(l), high.max(l));
            let to_camera = ray.origin - at;
            let from = at + s.normal * 2e-3;
            let clear = |to: Vec3| {
                let d = to - from;
                !scene.tracer.occluded(&Ray { origin: from, direction: d.normalize() }, 0.0, d.length())
            };
            if to_camera.dot(s.normal) <= 0.0 || !clear(ray.origin) {
                return None;
            }
            let probes = self.site.probes.iter().map(|p| scene.local(p.pose.position));
            seen += probes.filter(|p| (*p - at).normalize().dot(s.normal) > 0.15 && clear(*p)).count();
        }
        // two probes on the average, and some picture to go by
        (seen >= 90 && high > 1.15 * low).then_some(place)
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

/// Fills a row's figures about regions.
fn regions(row: &mut Row, case: &Case, truth: &[bool], alike: &[bool], judged: &[Judged]) {
    let size = truth.iter().filter(|t| **t).count();
    let sure: Vec<(&Judged, Vec<usize>)> = judged
        .iter()
        .filter(|j| j.reason == Reason::None)
        .map(|j| (j, j.pixels().iter().copied().filter(|i| !alike[*i]).collect()))
        .collect();
    let inside = |pixels: &[usize]| pixels.iter().filter(|i| truth[**i]).count() * 2 >= pixels.len();
    // a fault that came out in several pieces is found if the pieces together cover it
    let pieces: Vec<usize> = sure.iter().filter(|j| inside(&j.1)).flat_map(|j| j.1.iter().copied()).collect();
    let one = sure.iter().max_by(|a, b| overlap(&a.1, truth, size).total_cmp(&overlap(&b.1, truth, size))).map(|j| j.0);
    let best = sure.iter().map(|j| overlap(&j.1, truth, size)).fold(0.0, f64::max);
    let found = best.max(overlap(&pieces, truth, size)) >= 0.3;
    row.false_regions = sure.iter().filter(|j| !inside(&j.1) && overlap(&j.1, truth, size) < 0.3).count();
    row.found = usize::from(found);
    row.missed = usize::from(!found);
    if let (true, Some(j)) = (found, one) {
        let kind = if case.fault.is_texture() { Kind::Texture } else { Kind::Geometry };
        row.kind_right = usize::from(j.kind == kind);
        row.what_right = usize::from(case.fault.names().contains(&j.what.name()));
        if let (Fault::Displace(d), Some(m)) = (case.fault, j.displacement) {
            // the model was moved by d: the real surface is −d from it
            row.displacement.push((m.metres + f64::from(d)).abs() / f64::from(d.abs()));
            row.sign_right = usize::from(m.metres * f64::from(d) < 0.0);
        }
    }
}

/// All pixels but those within two of the truth's border.
fn counted(truth: &[bool], w: usize, h: usize) -> Vec<bool> {
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

/// Difference of logarithms after an exposure fit, 1 − SSIM and FLIP.
fn baselines(render: &Picture, photo: &Picture) -> [Vec<f32>; 3] {
    let valid = photo.pixels.iter().filter(|p| Picture::valid(**p));
    let white = Vec3::splat(valid.fold(0.0f32, |m, p| m.max(p.max_element())));
    let pixels = photo.pixels.iter().map(|p| if Picture::valid(*p) { *p } else { white }).collect();
    let photo = &Picture { pixels, ..photo.clone() };
    let log = |p: &Picture| -> Vec<f32> { p.pixels.iter().map(|v| luminance(*v).max(1e-6).ln()).collect() };
    let (a, b) = (log(render), log(photo));
    let mut d: Vec<f32> = a.iter().zip(&b).map(|(a, b)| b - a).collect();
    let at = d.len() / 2;
    let fit = *d.select_nth_unstable_by(at, f32::total_cmp).1;
    let difference = a.iter().zip(&b).map(|(a, b)| (b - a - fit).abs()).collect();
    let exposed = Picture { pixels: render.pixels.iter().map(|p| *p * fit.exp()).collect(), ..render.clone() };
    let mut all: Vec<f32> = photo.pixels.iter().map(|p| luminance(*p)).collect();
    let at = all.len() * 9 / 10;
    let white = *all.select_nth_unstable_by(at, f32::total_cmp).1;
    let shown = |p: &Picture| -> Vec<f32> {
        p.pixels.iter().map(|v| panorama::linear_to_srgb((luminance(*v) / white).clamp(0.0, 1.0))).collect()
    };
    let ssim = dissimilarity(&shown(&exposed), &shown(photo), photo.width, photo.height);
    [difference, ssim, study::flip_map(&exposed, photo)]
}

/// Regions that are told of a model without fault.
fn faultless(bench: &Bench) {
    let (mut regions, mut pixels) = (0, 0.0);
    let quick = std::env::var_os("QUICK").is_some();
    let chosen = [Nuisance::Clean, Nuisance::Jpeg(60), Nuisance::Probes(1), Nuisance::Pose(5.0), Nuisance::All];
    for nuisance in if quick { chosen.to_vec() } else { Nuisance::EACH.to_vec() } {
        let cameras: Vec<Camera> = bench.cameras.iter().map(|c| nuisance.camera(c, 5.0)).collect();
        let settings = Settings { longest_px: 4096, ..Settings::default() };
        let mut line = String::new();
        let mut here = 0;
        let (mut most, mut left) = (0.0f64, 0.0f64);
        bench.with(&bench.scene, nuisance, &cameras, |prepared, _, _| {
            for (v, camera) in cameras.iter().enumerate() {
                let photo = nuisance.photograph(&bench.photos[v]);
                let maps = examine(prepared, camera, &Photo::new(photo), &settings);
                let (judged, _) = maps.judged(prepared);
                let (refined, pose) = maps.pose();
                most = most.max(pose.mean_px);
                left = left.max(apart(&refined, &bench.cameras[v], &bench.scene));
                let sure: Vec<&Judged> = judged.iter().filter(|j| j.reason == Reason::None).collect();
                here += sure.len();
                pixels += (camera.width * camera.height) as f64;
                for j in sure {
                    line += &format!(
                        " {}:{}/{}({})",
                        bench.site.views[v].name,
                        j.kind.name(),
                        j.what.name(),
                        j.pixels().len()
                    );
                }
            }
        });
        regions += here;
        println!(
            "{:18} {here:>3} false; camera moved {most:.2} px, off by {left:.2} px in the worst view;{line}",
            nuisance.title()
        );
    }
    println!(
        "{regions} false regions in {:.2} megapixels: {:.2} per megapixel",
        pixels / 1e6,
        regions as f64 * 1e6 / pixels
    );
}

/// Mean distance in pixels between where two cameras show the scene.
fn apart(a: &Camera, b: &Camera, scene: &Scene) -> f64 {
    let mut all = vec![];
    for i in 0..400 {
        let (x, y) = ((i % 20) as f64 + 0.5, (i / 20) as f64 + 0.5);
        let d = b.direction(x / 20.0 * f64::from(b.width), y / 20.0 * f64::from(b.height));
        let ray = Ray { origin: scene.local(b.pose.position), direction: d.as_vec3() };
        if let Some(hit) = scene.tracer.closest(&ray, 1e-3) {
            let p = b.pose.position + d * f64::from(hit.t);
            if let (Some(p), Some(q)) = (a.project(p), b.project(p)) {
                all.push(p.distance(q));
            }
        }
    }
    mean(&all)
}

/// Averages of n × n pixels.
fn halved(p: &Picture, n: usize) -> Picture {
    let (w, h) = (p.width / n, p.height / n);
    let mut out = Picture::new(w, h);
    for y in 0..h * n {
        for x in 0..w * n {
            out.pixels[y / n * w + x / n] += p.pixels[y * p.width + x] / (n * n) as f32;
        }
    }
    out
}
