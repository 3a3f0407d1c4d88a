//! `clerestory simulate SITE`.

use anyhow::{Context, bail};
use clap::Args;
use clerestory::panorama::{Layer, Picture, Projection, write_exr};
use clerestory::reference::{Estimate, Eye, Lights, Noise, ReferenceSettings, add_samples};
use clerestory::scene::{self, Health, Scene};
use clerestory::site::{Environment, Pictures, Site, Sun};
use glam::{DVec3, Vec3};
use serde::Serialize;
use std::io::{self, Write};
use std::ops::ControlFlow;
use std::path::PathBuf;
use std::time::Instant;

use super::terminal::output::Told;
use super::terminal::visible::visible;

/// Samples a pixel in the first round of `--noise`.
const FIRST_ROUND: u32 = 32;

/// Samples a pixel after which `--noise` gives up.
const MOST_SAMPLES: u32 = 1 << 17;

/// Path-trace the probes and photographs of a site: rehearsal before a visit, truth for tests.
///
/// Every probe and every view's photograph is written where the site file says it should be, or into --out. Pictures
/// that are there already are kept. The light is the site's [environment], [sun] and emissive materials.
#[derive(Args, Debug)]
pub(crate) struct SimulateArgs {
    /// The site file, or the folder that holds its site.toml
    #[arg(value_hint = clap::ValueHint::AnyPath)]
    site: PathBuf,
    /// Write to DIR/probes/NAME.exr and DIR/photos/NAME.exr instead of where the site file says
    #[arg(long, value_name = "DIR", value_hint = clap::ValueHint::DirPath)]
    out: Option<PathBuf>,
    /// Only probes: all of them, or those named
    #[arg(long, value_name = "NAME,…", num_args = 0..=1, require_equals = true)]
    #[expect(clippy::option_option, reason = "absent, without names, with names")]
    probes: Option<Option<String>>,
    /// Only views: all of them, or those named. With --probes: both
    #[arg(long, value_name = "NAME,…", num_args = 0..=1, require_equals = true)]
    #[expect(clippy::option_option, reason = "absent, without names, with names")]
    views: Option<Option<String>>,
    /// Width of the probes' panoramas in pixels; they are half as high
    #[arg(long, value_name = "PIXELS", default_value_t = 1024, value_parser = clap::value_parser!(u32).range(2..=32768))]
    size: u32,
    /// Samples a pixel
    #[arg(long, value_name = "N", default_value_t = 256, value_parser = clap::value_parser!(u32).range(2..=1 << 24))]
    samples: u32,
    /// Instead: add samples until the median pixel has less than this noise
    #[arg(long, value_name = "PERCENT", conflicts_with = "samples", value_parser = percent)]
    noise: Option<f64>,
    /// Another seed, other noise
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u64,
    /// Write each probe's picture for this lighting; views are left out unless --views asks for them. Without it, the
    /// first lighting
    #[arg(long, value_name = "NAME")]
    lighting: Option<String>,
    /// Another sun than the lighting's: direction towards it in the model's axes, and irradiance on a surface that faces it; or `none`
    #[arg(long, value_name = "X,Y,Z:R,G,B", value_parser = sun, allow_hyphen_values = true)]
    sun: Option<SunArg>,
    /// A uniform sky of this radiance instead of the site's [environment]
    #[arg(long, value_name = "R,G,B", value_parser = colour)]
    sky: Option<Vec3>,
    /// Write over pictures that are there already
    #[arg(long)]
    force: bool,
    #[command(flatten)]
    told: Told,
}

/// A sun as the command line gives it.
#[derive(Clone, Copy, Debug)]
enum SunArg {
    None,
    /// Direction in the model's axes and irradiance.
    From(DVec3, Vec3),
}

/// One picture to make.
struct Job {
    kind: &'static str,
    name: String,
    file: PathBuf,
    eye: Eye,
    /// Radiance per stored value.
    gain: Vec3,
}

#[derive(Serialize, Default)]
struct Outcome {
    pictures: Vec<Made>,
    kept: Vec<PathBuf>,
    left_out: Vec<LeftOut>,
    seconds: f64,
}

#[derive(Serialize)]
struct Made {
    kind: &'static str,
    name: String,
    file: PathBuf,
    width: usize,
    height: usize,
    samples: u32,
    seconds: f64,
    rays: u64,
    /// Standard errors as shares of the light: 0.01 is 1 %.
    noise: Noise,
}

#[derive(Serialize)]
struct LeftOut {
    name: String,
    why: String,
}

/// Simulates a site's pictures and writes what was made to `out`.
pub(crate) fn run(args: &SimulateArgs, out: &mut impl Write) -> anyhow::Result<()> {
    let start = Instant::now();
    let mut site = Site::load_with(&args.site, Pictures::MayBeMissing)?;
    let lighting = super::register::lighting(&site, args.lighting.as_deref())?;
    let mut outcome = Outcome::default();
    let jobs = jobs(&site, &lighting, args, &mut outcome)?;
    if args.told.talks() {
        for LeftOut { name, why } in &outcome.left_out {
            writeln!(out, "left out {name}: {why}")?;
        }
        for file in &outcome.kept {
            writeln!(out, "kept {} (--force writes over it)", file.display())?;
        }
    }
    if !jobs.is_empty() {
        relight(&mut site, &lighting, args);
        let scene = scene::load(&site, &mut Health::default())?;
        let lights = Lights::load(&site, &scene)?;
        for job in &jobs {
            let made = make(job, &scene, &lights, args)?;
            if args.told.talks() {
                print(&made, out)?;
                out.flush()?;
            }
            outcome.pictures.push(made);
        }
    }
    outcome.seconds = start.elapsed().as_secs_f64();
    // in words it was told picture by picture
    args.told.tell(&outcome, out, |_| Ok(()))
}

/// What is to be made; what is not goes to the outcome, with the reason.
fn jobs(site: &Site, lighting: &str, args: &SimulateArgs, outcome: &mut Outcome) -> anyhow::Result<Vec<Job>> {
    let any = args.probes.is_some() || args.views.is_some();
    let wants_probes = args.probes.is_some() || !any;
    let wants_views = args.views.is_some() || !any && args.lighting.is_none();
    let (width, height) = (args.size as usize, (args.size as usize / 2).max(1));
    let mut jobs = Vec::new();

    let probes: Vec<&str> = site.probes.iter().map(|p| p.name.as_str()).collect();
    let wanted = selected("probe", &probes, args.probes.as_ref())?;
    for probe in site.probes.iter().filter(|p| wants_probes && wanted.contains(&p.name.as_str())) {
        let Some(picture) = probe.picture(lighting) else {
            let why = format!("it has no picture for the lighting “{lighting}”");
            outcome.left_out.push(LeftOut { name: probe.name.clone(), why });
            continue;
        };
        if probe.projection != Projection::LatLong {
            bail!(
                "probe “{}” is not latitude/longitude, the only projection that is simulated; set projection = \"latlong\"",
                probe.name
            );
        }
        let file = destination(args, "probes", &probe.name, &picture.lighting).unwrap_or_else(|| picture.path.clone());
        let eye = Eye::Panorama { pose: probe.pose, width, height };
        jobs.push(Job { kind: "probe", name: probe.name.clone(), file, eye, gain: probe.gain });
    }

    let views: Vec<&str> = site.views.iter().map(|v| v.name.as_str()).collect();
    let wanted = selected("view", &views, args.views.as_ref())?;
    for view in site.views.iter().filter(|v| wants_views && wanted.contains(&v.name.as_str())) {
        let Some(file) = destination(args, "photos", &view.name, "").or_else(|| view.photo.clone()) else {
            let why = "the site file names no photo for it, and there is no --out".to_owned();
            outcome.left_out.push(LeftOut { name: view.name.clone(), why });
            continue;
        };
        jobs.push(Job { kind: "view", name: view.name.clone(), file, eye: Eye::Camera(view.camera), gain: Vec3::ONE });
    }

    let (old, new): (Vec<Job>, Vec<Job>) = jobs.into_iter().partition(|job| job.file.exists() && !args.force);
    outcome.kept = old.into_iter().map(|job| job.file).collect();
    if let Some(job) = new.iter().find(|job| job.file.extension().is_none_or(|e| !e.eq_ignore_ascii_case("exr"))) {
        bail!(
            "{}: simulated pictures are OpenEXR; name an .exr file in the site file, or give --out",
            job.file.display()
        );
    }
    Ok(new)
}

/// The names that an option selects: all where it gives none.
fn selected<'a>(
    what: &'static str,
    known: &[&'a str],
    option: Option<&Option<String>>,
) -> anyhow::Result<Vec<&'a str>> {
    let Some(Some(list)) = option else { return Ok(known.to_vec()) };
    let find = |name: &str| {
        let all = if known.is_empty() { "none".to_owned() } else { known.join(", ") };
        let unknown = || anyhow::anyhow!("there is no {what} “{name}”; the site has: {all}");
        known.iter().copied().find(|k| *k == name).ok_or_else(unknown)
    };
    list.split(',').map(|name| find(name.trim())).collect()
}

/// The file under `--out`, if that is given.
fn destination(args: &SimulateArgs, folder: &str, name: &str, lighting: &str) -> Option<PathBuf> {
    let plain = |text: &str| text.replace(['/', '\\', ':'], "-");
    let file = if lighting.is_empty() { plain(name) } else { format!("{}@{}", plain(name), plain(lighting)) };
    args.out.as_ref().map(|out| out.join(folder).join(format!("{file}.exr")))
}

/// Puts the lighting's sun, or the command line's sun and sky, in the place of the site's.
fn relight(site: &mut Site, lighting: &str, args: &SimulateArgs) {
    match args.sun {
        None => site.sun = site.sun_under(lighting),
        Some(SunArg::None) => site.sun = None,
        Some(SunArg::From(direction, irradiance)) => {
            site.sun = Some(Sun { direction: site.frame.direction_in(direction).as_vec3(), irradiance });
        }
    }
    if let Some(radiance) = args.sky {
        site.environment = Some(Environment::Uniform(radiance));
    }
}

/// Traces one picture and writes it.
fn make(job: &Job, scene: &Scene, lights: &Lights, args: &SimulateArgs) -> anyhow::Result<Made> {
    let start = Instant::now();
    let (width, height) = job.eye.size();
    let mut estimate = Estimate::new(width, height);
    let samples = if args.noise.is_some() { FIRST_ROUND } else { args.samples };
    let mut settings = ReferenceSettings { samples, seed: args.seed, ..ReferenceSettings::default() };
    loop {
        let bar = args.told.bar("{msg} {wide_bar} {percent:>3} %  {eta} left");
        bar.set_message(visible(&format!("{} {}", job.kind, job.name)).into_owned());
        let progress = |done, total| {
            bar.set_length(total);
            bar.set_position(done);
            ControlFlow::Continue(())
        };
        add_samples(scene, lights, &job.eye, &settings, &mut estimate, &progress)?;
        bar.finish_and_clear();
        let Some(target) = args.noise else { break };
        let noise = estimate.noise().median;
        if noise <= target || estimate.samples() >= MOST_SAMPLES {
            break;
        }
        // error falls as the root of the number of samples; never more than double on the word of a noisy figure
        let needed = f64::from(estimate.samples()) * ((noise / target).powi(2) - 1.0);
        settings.samples = (needed as u32).clamp(estimate.samples() / 4, estimate.samples());
    }
    let noise = estimate.noise();
    save(job, &estimate, &noise, args)?;
    Ok(Made {
        kind: job.kind,
        name: job.name.clone(),
        file: job.file.clone(),
        width,
        height,
        samples: estimate.samples(),
        seconds: start.elapsed().as_secs_f64(),
        rays: estimate.rays,
        noise,
    })
}

fn save(job: &Job, estimate: &Estimate, noise: &Noise, args: &SimulateArgs) -> anyhow::Result<()> {
    if let Some(folder) = job.file.parent() {
        std::fs::create_dir_all(folder).with_context(|| format!("{}: the folder cannot be made", folder.display()))?;
    }
    let mean = estimate.mean();
    let pixels = mean.pixels.iter().map(|p| p / job.gain).collect();
    let layer = Layer::rgb("", &Picture { pixels, ..mean });
    let note = serde_json::json!({
        "made_by": "path tracing",
        "noise": noise.median,
        "samples": estimate.samples(),
        "seed": args.seed,
    });
    write_exr(&job.file, estimate.width, estimate.height, &[layer], Some(&note.to_string()))?;
    Ok(())
}

fn print(made: &Made, out: &mut impl Write) -> io::Result<()> {
    let Made { kind, name, width, height, samples, seconds, rays, noise, file } = made;
    writeln!(
        out,
        "{kind} {name}: {width} × {height}, {samples} samples a pixel, {seconds:.1} s, {:.2} M rays/s, about {:.2} % \
         noise in the median pixel → {}",
        *rays as f64 / seconds / 1e6,
        100.0 * noise.median,
        file.display()
    )
}

fn percent(text: &str) -> Result<f64, String> {
    match text.trim().trim_end_matches('%').trim().parse::<f64>() {
        Ok(v) if v > 0.0 && v.is_finite() => Ok(v / 100.0),
        _ => Err("expected a percentage above zero, such as 2".to_owned()),
    }
}

fn three(text: &str) -> Option<DVec3> {
    let numbers: Vec<f64> = text.split(',').map(|n| n.trim().parse().ok()).collect::<Option<_>>()?;
    let three: [f64; 3] = numbers.try_into().ok()?;
    Some(DVec3::from(three)).filter(|v| v.is_finite())
}

fn colour(text: &str) -> Result<Vec3, String> {
    let light = three(text).map(|c| c.as_vec3()).filter(|c| c.is_finite() && c.min_element() >= 0.0);
    light.ok_or_else(|| "expected three numbers from zero up, such as 1,1.1,1.3".to_owned())
}

fn sun(text: &str) -> Result<SunArg, String> {
    if text == "none" {
        return Ok(SunArg::None);
    }
    let (direction, irradiance) =
        text.split_once(':').ok_or("expected x,y,z:r,g,b, such as 0.3,0.6,0.7:50,46,40, or none")?;
    let direction = three(direction)
        .and_then(DVec3::try_normalize)
        .ok_or("expected a direction x,y,z towards the sun before the colon")?;
    Ok(SunArg::From(direction, colour(irradiance)?))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn suns_skies_and_percentages_are_read_or_refused() {
        let SunArg::From(d, e) = sun("0,-3,4:50,46,40").unwrap() else { panic!("a sun was given") };
        assert!((d - DVec3::new(0.0, -0.6, 0.8)).length() < 1e-12);
        assert_eq!(e, Vec3::new(50.0, 46.0, 40.0));
        assert!(matches!(sun("none"), Ok(SunArg::None)));
        for bad in ["", "1,2,3", "0,0,0:1,1,1", "1,2,3:1,1", "1,2,3:1,1,-1", "nan,1,1:1,1,1"] {
            assert!(sun(bad).is_err(), "{bad}");
        }
        // more than a pixel holds
        assert!(colour("1e300,1,1").is_err());
        assert_eq!(percent("2 %"), Ok(0.02));
        assert!(percent("0").is_err() && percent("-1").is_err() && percent("many").is_err());
    }
}
