//! Measures the audit against planted faults: how well it ranks pixels, finds regions, tells kinds apart and keeps quiet
//! on a faultless model, under nuisances, beside plain ways to compare pictures.
//!
//! ```text
//! cargo run --release --example audit_benchmark -- SITE [faults|nuisances|faultless] [--longest 256] [--seed 1]
//!     [--per 1] [--every 3] [--cells 32] [--only wall,hole] [--under JPEG,pose] [--regions] [--pictures FOLDER]
//! cargo run --release --example audit_benchmark -- corpus SITE… [--per 3] [--seed 1] [--only right,wall]
//!     [--candidates FILE] [--pictures FOLDER]
//! cargo run --release --example audit_benchmark -- held-out SITE [--every 3]
//! cargo run --release --example audit_benchmark -- masked SITE MASKS [SITE MASKS …]
//! cargo run --release --example audit_benchmark -- fit FILE… [--without "size;thickness"]
//! ```
//!
//! Faults are planted in the model that the auditor is given; photographs and probes stay those of the true one. Walls that are off
//! by less than a pixel of the coarser of photograph and probe have a table of their own: nobody could see them. Of
//! other faults of shape below a pixel, either kind counts as right.

#![allow(clippy::unwrap_used, clippy::print_stdout, missing_docs, unreachable_pub, reason = "a measuring program")]

mod cases;
mod corpus;
mod faultless;
mod fit;
mod held_out;
mod masked;
mod measure;
mod nuisance;
#[path = "../common/objects.rs"]
mod objects;
mod pictures;
mod plant;
mod row;
mod truth;

use cases::Case;
use clerestory::audit::{AuditScene, Judged, Photo, Settings, Verdict, examine};
use clerestory::panorama::{self, Picture};
use clerestory::render::{Options, Relit, prepare, render};
use clerestory::scene::{self, Health, Scene};
use clerestory::shoot::Light;
use clerestory::site::{Camera, Site};
use clerestory::volume::{self, Volume};
use glam::Vec3;
use measure::{average_precision, baselines, overlap};
use nuisance::Nuisance;
use plant::{Fault, plant};
use row::{Row, line_of, regions, table};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use truth::{Truth, counted};

struct Bench {
    site: Site,
    scene: Scene,
    /// Truth, at the audit's size.
    photos: Vec<Picture>,
    cameras: Vec<Camera>,
    probes: Vec<Picture>,
    cells: u32,
    /// Print each region.
    regions: bool,
    /// Where to write a picture of each case.
    pictures: Option<PathBuf>,
}

fn main() {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let after = |name: &str| args.iter().position(|a| a == name).map(|i| args[i + 1].as_str());
    let number = |name: &str, default: u64| after(name).map_or(default, |v| v.parse().expect("a number"));
    let files =
        |args: &[String]| -> Vec<String> { args.iter().take_while(|a| !a.starts_with("--")).cloned().collect() };
    let named = |name: &str, title: &str| after(name).is_none_or(|words| words.split(',').any(|w| title.contains(w)));
    if args.first().is_some_and(|a| a == "corpus") {
        let sites = files(&args[1..]);
        let (per, seed) = (number("--per", 3) as usize, number("--seed", 1));
        let candidates = after("--candidates").map(Path::new);
        let pictures = after("--pictures").map(PathBuf::from);
        return corpus::corpus(&sites, per, seed, &|title| named("--only", title), candidates, pictures);
    }
    if args.first().is_some_and(|a| a == "held-out") {
        return held_out::held_out(&args[1], number("--every", 3) as usize);
    }
    if args.first().is_some_and(|a| a == "masked") {
        return masked::masked(&files(&args[1..]));
    }
    if args.first().is_some_and(|a| a == "fit") {
        let without: Vec<&str> = after("--without").map_or(vec![], |names| names.split(';').collect());
        return fit::fit(&files(&args[1..]), &without);
    }
    let what = args.get(1).map_or("faults", String::as_str);
    let mut nuisances = if what == "faults" { vec![Nuisance::Clean] } else { Nuisance::EACH.to_vec() };
    if what == "faultless" {
        nuisances.push(Nuisance::Pose(5.0));
    }
    nuisances.retain(|n| named("--under", &n.title()));
    let mut bench = Bench::load(Path::new(&args[0]), number("--longest", 256) as usize, number("--cells", 32) as u32);
    bench.regions = args.iter().any(|a| a == "--regions");
    bench.pictures = after("--pictures").map(PathBuf::from);
    if what == "faultless" {
        faultless::faultless(&bench, &nuisances);
        return;
    }
    let mut by_fault: BTreeMap<String, Row> = BTreeMap::new();
    let mut fine: Vec<(String, Row)> = vec![];
    let mut by_nuisance: Vec<(String, Row)> = nuisances.iter().map(|n| (n.title(), Row::default())).collect();
    let every = number("--every", if what == "faults" { 1 } else { 3 }) as usize;
    let cases = bench.cases(number("--seed", 1), number("--per", 1) as usize);
    for case in cases.iter().step_by(every).filter(|c| named("--only", &c.fault.title())) {
        let title = case.fault.title();
        let view = &bench.site.views[case.view].name;
        let model = plant(&bench.scene, case.fault, &case.place, case.object.as_deref());
        let mut truth = bench.truth(&model, case);
        // a wall that is off by less than can be seen; an object may still show as another picture
        let fine_wall = truth.is_fine() && matches!(case.fault, Fault::Displace(_));
        if fine_wall {
            truth.wrong = truth.wrong.iter().zip(&truth.alike).map(|(a, b)| *a || *b).collect();
            truth.alike.fill(false);
        }
        let [size, alike] = [&truth.wrong, &truth.alike].map(|t| t.iter().filter(|t| **t).count());
        if size < 60 || size * 5 < alike {
            println!("# {title} in {view}: {size} of {} pixels look otherwise: not counted", size + alike);
            continue;
        }
        for (k, line) in bench.run(&model, case, &truth, &nuisances) {
            println!(
                "# {title:14} {view:12} {:16} {size:>5} px + {alike} alike, parallax {:.1} px: AP {:.2} ({:.2} SSIM, {:.2} FLIP) {}",
                nuisances[k].title(),
                truth.parallax_px,
                line.ours[0],
                line.ssim[0],
                line.flip[0],
                line_of(&line)
            );
            if fine_wall {
                let name = format!("{title} in {view}, {:.1} px: {}", truth.parallax_px, nuisances[k].title());
                fine.push((name, line));
                continue;
            }
            by_nuisance[k].1.add(&line);
            if what == "faults" {
                by_fault.entry(title.clone()).or_default().add(&line);
            }
        }
    }
    if what == "faults" {
        table("fault", &by_fault.into_iter().collect::<Vec<_>>());
    }
    table("under", &by_nuisance);
    if !fine.is_empty() {
        // no eye could see these at this resolution: they are in no mean
        table("below one pixel of parallax", &fine);
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
        Self { site, scene, photos, cameras, probes, cells, regions: false, pictures: None }
    }

    /// Runs something with everything that views share, for a model, a nuisance and cameras.
    fn with<T>(
        &self,
        model: &Scene,
        nuisance: Nuisance,
        cameras: &[Camera],
        f: impl FnOnce(&AuditScene, &Light, Option<&Volume>) -> T,
    ) -> T {
        let lighting = self.site.lightings()[0].clone();
        let mut site = self.site.clone();
        site.probes.truncate(nuisance.probes());
        let options = Options {
            lightings: vec![lighting],
            probes: usize::MAX,
            sun: true,
            volume: volume::VolumeSettings { cells: self.cells, ..volume::VolumeSettings::default() },
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
        let volume = setup.volume(model, 0);
        let prepared = AuditScene::new(model, light, volume.as_ref());
        let prepared =
            site.probes.iter().zip(pictures).fold(prepared, |all, (probe, picture)| all.with(probe, picture));
        f(&prepared, light, volume.as_ref())
    }

    /// Audits a case under nuisances, and says which each row belongs to. What the probes give is set up once for all
    /// nuisances that leave them alike.
    fn run(&self, model: &Scene, case: &Case, truth: &Truth, nuisances: &[Nuisance]) -> Vec<(usize, Row)> {
        let alike = |a: Nuisance, b: Nuisance| a.probes() == b.probes() && (0..4).all(|k| a.gain(k) == b.gain(k));
        let mut rows: Vec<(usize, Row)> = vec![];
        for (first, &nuisance) in nuisances.iter().enumerate() {
            if nuisances[..first].iter().any(|n| alike(*n, nuisance)) {
                continue;
            }
            self.with(model, nuisance, &[self.cameras[case.view]], |prepared, light, volume| {
                let relit = Relit { scene: model, light, volume, volume_only: false };
                for (k, n) in nuisances.iter().enumerate().filter(|(_, n)| alike(**n, nuisance)) {
                    rows.push((k, self.audited(prepared, &relit, case, truth, *n)));
                }
            });
        }
        rows.sort_by_key(|r| r.0);
        rows
    }

    /// Audits a case under a nuisance.
    fn audited(&self, prepared: &AuditScene, relit: &Relit, case: &Case, truth: &Truth, nuisance: Nuisance) -> Row {
        let photo = nuisance.photograph(&self.photos[case.view]);
        let camera = nuisance.camera(&self.cameras[case.view], 5.0);
        let (w, h) = (photo.width, photo.height);
        let settings = Settings { longest_px: 4096, ..Settings::default() };
        let maps = examine(prepared, &camera, &Photo::new(photo.clone()), &settings);
        let [geometry, texture] = maps.scores();
        let (judgement, verdicts) = maps.judged(prepared);
        let both = judgement.suspicion(settings.least_probability);
        let judged = judgement.regions;
        let Truth { wrong, alike, .. } = truth;
        // what touches the mask's border by a pixel or two is neither
        let of_interest: Vec<bool> = counted(wrong, w, h).iter().zip(alike).map(|(c, a)| *c && !a).collect();
        let frame = render(relit.scene, relit, &camera, 4, &|_, _| {});
        let [difference, ssim, flip] = baselines(&frame.radiance, &photo);
        let ap = |scores: &[f32]| vec![average_precision(scores, wrong, &of_interest)];
        let all: Vec<bool> = wrong.iter().zip(alike).map(|(w, a)| *w || *a).collect();
        let size = wrong.iter().filter(|t| **t).count();
        let ok = (0..w * h).filter(|i| wrong[*i] && verdicts[*i] == Verdict::Ok).count();
        let mut row = Row {
            ours: ap(&both),
            whole: vec![average_precision(&both, &all, &counted(&all, w, h))],
            alone: ap(if case.fault.is_texture() { &texture } else { &geometry }),
            difference: ap(&difference),
            ssim: ap(&ssim),
            flip: ap(&flip),
            wrongly_ok: vec![ok as f64 / size as f64],
            ..Row::default()
        };
        regions(&mut row, case, truth, &judged);
        if self.regions {
            judged.iter().for_each(|j| println!("#     {}", described(j, wrong, size)));
        }
        if let Some(folder) = &self.pictures {
            let name = format!("{}-{}-{}", case.fault.title(), self.site.views[case.view].name, nuisance.title());
            let path = folder.join(name.replace(' ', "-") + ".png");
            let verdicts = pictures::verdicts(&verdicts);
            let shown: Vec<f32> = (0..w * h)
                .map(|i| {
                    if wrong[i] {
                        1.0
                    } else if alike[i] {
                        0.4
                    } else {
                        0.0
                    }
                })
                .collect();
            let half = |v: &[f32]| v.iter().map(|v| v / 2.0).collect::<Vec<f32>>();
            let tiles = [pictures::tone(&photo), pictures::tone(&frame.radiance), shown, half(&both), half(&geometry)];
            pictures::write(&path, w, h, &[&tiles[..], &[half(&texture), verdicts, ssim]].concat());
        }
        row
    }
}

/// A region in a line.
fn described(j: &Judged, wrong: &[bool], size: usize) -> String {
    format!(
        "{}/{} {} {} px, {:.2} over union, {:.2} {}; {}",
        j.kind.name(),
        j.what.name(),
        j.reason(Settings::default().false_alarms).name(),
        j.pixels().len(),
        overlap(j.pixels(), wrong, size),
        j.score(),
        j.displacement.map_or(String::new(), |d| format!("{:.3} m", d.metres)),
        j.evidence.iter().map(|e| format!("{} {:.2}", e.test, e.value)).collect::<Vec<_>>().join(", ")
    )
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
