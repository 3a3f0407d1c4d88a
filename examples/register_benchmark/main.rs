//! How well `register` finds poses from planted starts: every probe and photograph of a site is turned to any heading, tilted and
//! moved, at random by seed, registered, and held against the site's own poses.
//!
//! ```text
//! cargo run --release --example register_benchmark -- SITE… [--starts 10] [--tilt 3] [--within 1] [--alone]
//!     [--probes-only] [--jpeg] [--near] [--anywhere] [--against SITE]
//! ```
//!
//! `--against SITE` starts from the site's own poses and holds what is found against those of another site file.
//! `--anywhere` lets each picture be looked for on all of the site's floors.
//! `--jpeg` gives each probe as an 8-bit JPEG, exposed up to two stops off, windows clipped; `--near` keeps headings (for
//! sites whose own poses are only roughly known).
#![allow(clippy::print_stdout)]

use clerestory::panorama::{self, Picture, linear_to_srgb};
use clerestory::register::{self, RegisterSettings, Registered, Subject, Verdict};
use clerestory::scene::{self, Health};
use clerestory::site::{Pose, Site};
use glam::{DMat3, DVec3, Vec3};
use std::path::Path;

struct Options {
    starts: usize,
    tilt_deg: f64,
    within_m: f64,
    alone: bool,
    probes_only: bool,
    jpeg: bool,
    near: bool,
    anywhere: bool,
    against: Option<String>,
}

/// What came of one picture from one start.
struct Outcome {
    off_m: f64,
    off_deg: f64,
    verdict: Verdict,
    /// The error in standard deviations, by the covariance told: its Mahalanobis length.
    sigmas: f64,
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut options = Options {
        starts: 10,
        tilt_deg: 3.0,
        within_m: 1.0,
        alone: false,
        probes_only: false,
        jpeg: false,
        near: false,
        anywhere: false,
        against: None,
    };
    let mut sites = Vec::new();
    let mut words = std::env::args().skip(1);
    while let Some(word) = words.next() {
        if word == "--against" {
            options.against = words.next();
            continue;
        }
        let mut number = || words.next().unwrap_or_default().parse::<f64>();
        match word.as_str() {
            "--starts" => options.starts = number()? as usize,
            "--tilt" => options.tilt_deg = number()?,
            "--within" => options.within_m = number()?,
            "--alone" => options.alone = true,
            "--probes-only" => options.probes_only = true,
            "--jpeg" => options.jpeg = true,
            "--near" => options.near = true,
            "--anywhere" => options.anywhere = true,
            _ => sites.push(word),
        }
    }
    println!(
        "site                 picture      found  ≤1cm,.05°  ≤5cm  median mm  median °  95 % mm  95 % °  ambiguous  lost  over 3×99 %  s a picture"
    );
    let mut all = Vec::new();
    for path in &sites {
        all.extend(one_site(path, &options)?);
    }
    if sites.len() > 1 {
        let refs: Vec<&Outcome> = all.iter().collect();
        row("all", "", &refs, 0.0);
    }
    Ok(())
}

fn one_site(path: &str, options: &Options) -> Result<Vec<Outcome>, Box<dyn std::error::Error>> {
    let mut site = Site::load(Path::new(path))?;
    if options.probes_only {
        site.views.iter_mut().for_each(|v| v.photo = None);
    }
    let scene = scene::load(&site, &mut Health::default())?;
    let folder = std::env::temp_dir().join(format!("register_benchmark.{}", std::process::id()));
    if options.jpeg {
        std::fs::create_dir_all(&folder)?;
        coded(&mut site, &folder)?;
    }
    let mut random = Random(0x5eed);
    let mut outcomes: Vec<(Subject, Outcome)> = Vec::new();
    let mut seconds = 0.0;
    let truth =
        options.against.as_ref().map(|path| Site::load(Path::new(path))).transpose()?.unwrap_or_else(|| site.clone());
    for _ in 0..options.starts {
        let started = if options.against.is_some() { site.clone() } else { displaced(&site, options, &mut random) };
        let settings = RegisterSettings {
            within_m: options.within_m as f32,
            tilt_deg: options.tilt_deg as f32,
            together: !options.alone,
            anywhere: options.anywhere,
            ..RegisterSettings::default()
        };
        let before = processor_s();
        let found = register::register(&started, &scene, &settings, &|_, _, _| {})?;
        seconds += (processor_s() - before) / found.len().max(1) as f64;
        outcomes.extend(found.iter().map(|f| (f.subject, outcome(f, &f.subject.pose(&truth)))));
    }
    if options.jpeg {
        std::fs::remove_dir_all(&folder)?;
    }
    let seconds = seconds / options.starts.max(1) as f64;
    let name = Path::new(path).file_name().unwrap_or_default().to_string_lossy().into_owned();
    let mut subjects: Vec<Subject> = Vec::new();
    for (s, _) in &outcomes {
        if !subjects.contains(s) {
            subjects.push(*s);
        }
    }
    for s in subjects {
        let mine: Vec<&Outcome> = outcomes.iter().filter(|o| o.0 == s).map(|o| &o.1).collect();
        row(&name, s.name(&site), &mine, seconds);
    }
    Ok(outcomes.into_iter().map(|o| o.1).collect())
}

/// The site with every registered pose off by a random amount.
fn displaced(site: &Site, options: &Options, random: &mut Random) -> Site {
    let mut off = |pose: &mut Pose| {
        let shift = loop {
            let v = DVec3::new(random.next(), random.next(), random.next()) * 2.0 - 1.0;
            if v.length() <= 1.0 {
                break v * options.within_m;
            }
        };
        let heading = if options.near { (random.next() - 0.5) * 0.1 } else { random.next() * std::f64::consts::TAU };
        let axis = random.next() * std::f64::consts::TAU;
        let tilt = (random.next() * options.tilt_deg).to_radians();
        let tilted = DMat3::from_axis_angle(DVec3::new(axis.cos(), axis.sin(), 0.0), tilt);
        pose.position += shift;
        pose.rotation = DMat3::from_rotation_z(heading) * tilted * pose.rotation;
    };
    let mut site = site.clone();
    site.probes.iter_mut().for_each(|p| off(&mut p.pose));
    site.views.iter_mut().filter(|v| v.photo.is_some()).for_each(|v| off(&mut v.camera.pose));
    site
}

fn outcome(found: &Registered, truth: &Pose) -> Outcome {
    let shift = found.pose.rotation.transpose() * (truth.position - found.pose.position);
    let turn = glam::DQuat::from_mat3(&(found.pose.rotation.transpose() * truth.rotation)).to_scaled_axis();
    let error = [shift.x, shift.y, shift.z, turn.x, turn.y, turn.z];
    Outcome {
        off_m: shift.length(),
        off_deg: register::turn_deg(&found.pose, truth),
        verdict: found.verdict,
        sigmas: mahalanobis(&found.covariance, &error),
    }
}

/// √(eᵀ C⁻¹ e) by Gaussian elimination; infinite where C is singular.
fn mahalanobis(c: &[[f64; 6]; 6], e: &[f64; 6]) -> f64 {
    let (mut m, mut x) = (*c, *e);
    for k in 0..6 {
        if m[k][k].abs() < 1e-30 {
            return f64::INFINITY;
        }
        for i in k + 1..6 {
            let f = m[i][k] / m[k][k];
            let pivot = m[k];
            for (v, p) in m[i].iter_mut().zip(pivot).skip(k) {
                *v -= f * p;
            }
            x[i] -= f * x[k];
        }
    }
    for k in (0..6).rev() {
        let rest: f64 = (k + 1..6).map(|j| m[k][j] * x[j]).sum();
        x[k] = (x[k] - rest) / m[k][k];
    }
    x.iter().zip(e).map(|(a, b)| a * b).sum::<f64>().max(0.0).sqrt()
}

fn row(site: &str, picture: &str, outcomes: &[&Outcome], seconds: f64) {
    let n = outcomes.len().max(1) as f64;
    let share = |f: &dyn Fn(&Outcome) -> bool| 100.0 * outcomes.iter().filter(|o| f(o)).count() as f64 / n;
    let quantile = |f: &dyn Fn(&Outcome) -> f64, q: f64| {
        let mut v: Vec<f64> = outcomes.iter().map(|o| f(o)).collect();
        v.sort_by(f64::total_cmp);
        v[((v.len() as f64 - 1.0) * q).round() as usize]
    };
    // the 99 % region of six unknowns has a radius of 4.1 standard deviations
    let wrong = |o: &Outcome| o.verdict == Verdict::Found && o.sigmas > 3.0 * 4.1;
    println!(
        "{site:<20} {picture:<12} {:>4.0} %  {:>7.0} %  {:>4.0} %  {:>8.1}  {:>8.3}  {:>7.1}  {:>6.3}  {:>7.0} %  {:>3.0} %  {:>8.1} %  {seconds:.1}",
        share(&|o| o.verdict == Verdict::Found),
        share(&|o| o.off_m <= 0.01 && o.off_deg <= 0.05),
        share(&|o| o.off_m <= 0.05),
        1e3 * quantile(&|o| o.off_m, 0.5),
        quantile(&|o| o.off_deg, 0.5),
        1e3 * quantile(&|o| o.off_m, 0.95),
        quantile(&|o| o.off_deg, 0.95),
        share(&|o| o.verdict == Verdict::Ambiguous),
        share(&|o| o.verdict == Verdict::NotFound),
        share(&wrong),
    );
}

/// Writes each probe's first picture as an 8-bit JPEG, exposed up to two stops off, and names it in its place.
fn coded(site: &mut Site, folder: &Path) -> Result<(), Box<dyn std::error::Error>> {
    let mut random = Random(7);
    for (i, probe) in site.probes.iter_mut().enumerate() {
        let picture = panorama::read(&probe.pictures[0].path)?;
        let exposure = panorama::Exposure::of(&picture).0 * ((random.next() * 4.0 - 2.0).exp2() as f32);
        let path = folder.join(format!("{i}.jpg"));
        jpeg(&picture, exposure, &path)?;
        probe.pictures.truncate(1);
        probe.pictures[0].path = path;
    }
    Ok(())
}

fn jpeg(picture: &Picture, exposure: f32, path: &Path) -> Result<(), Box<dyn std::error::Error>> {
    let code = |p: &Vec3| {
        (*p * exposure).clamp(Vec3::ZERO, Vec3::ONE).to_array().map(|v| (linear_to_srgb(v) * 255.0 + 0.5) as u8)
    };
    let bytes: Vec<u8> = picture.pixels.iter().flat_map(code).collect();
    let file = std::io::BufWriter::new(std::fs::File::create(path)?);
    image::codecs::jpeg::JpegEncoder::new_with_quality(file, 88).encode(
        &bytes,
        picture.width as u32,
        picture.height as u32,
        image::ExtendedColorType::Rgb8,
    )?;
    Ok(())
}

/// Processor time of this process in seconds, where the system tells it.
fn processor_s() -> f64 {
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    let fields: Vec<f64> =
        stat.rsplit(')').next().unwrap_or("").split_whitespace().filter_map(|v| v.parse().ok()).collect();
    // utime and stime are the 14th and 15th fields; the state, third, is no number
    fields.get(10).zip(fields.get(11)).map_or(0.0, |(u, s)| (u + s) / 100.0)
}

/// Numbers in 0..1 (Knuth's linear congruence, upper bits).
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as f64 / (1u64 << 31) as f64
    }
}
