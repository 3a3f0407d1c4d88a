//! `clerestory render SITE`.

mod baked;
mod compared;
mod gpu;
mod left_out;
mod pictures;
mod print;
mod video;
mod view_light;
mod walk_exposure;

use anyhow::{Context, bail};
use clap::{Args, ValueEnum, ValueHint};
use clerestory::bake;
use clerestory::check;
use clerestory::panorama::Exposure;
use clerestory::paper::{PaperSettings, Plain};
use clerestory::render::{Frame, Options, Relit, Setup, Timings, prepare, shoot_probes};
use clerestory::report::{BakedFrames, Rendered, RenderedView};
use clerestory::scene::{self, Health, Mesh, Scene, Spared};
use clerestory::site::{Site, View};
use clerestory::study::Seconds;
use clerestory::{radiometry, site};
use compared::{Compared, compared, photos};
use left_out::{not_done, not_loaded, unasked};
use print::print;
use std::collections::BTreeMap;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::Instant;
use video::Video;
use view_light::{Sky, ViewLight};
use walk_exposure::steady_exposures;

use super::bake::{BakeHow, VolumeHow};
use super::register::{in_passing, lighting};
use super::terminal::model::Model;
use super::terminal::number::between;
use super::terminal::output::{Output, apart};
use super::terminal::visible::visible;

/// Rays a pixel, unless others are asked for.
const SAMPLES: u32 = 4;

/// Relight a site's views from its probes.
///
/// Writes NAME.exr (linear radiance) and NAME.png (for people) per view into --out.
#[derive(Args, Debug, Default)]
#[command(after_help = "Examples:\n  \
    clerestory render sites/chapel\n  \
    clerestory render sites/chapel --view apse --lighting 14:30\n  \
    clerestory render sites/chapel --lighting 10:00 --blend 14:30 --share 0.5\n  \
    clerestory render sites/chapel --compare --method paper\n  \
    clerestory render sites/chapel --path walk.toml --baked --out walk")]
pub(crate) struct RenderArgs {
    /// The site file, or the folder that holds its site.toml
    #[arg(value_hint = ValueHint::AnyPath)]
    site: PathBuf,
    /// Only this view; may be given several times
    #[arg(long, value_name = "NAME")]
    view: Vec<String>,
    /// Frames along a walk in the place of the site's views: a TOML file with a [path] and its [[key]] frames
    #[arg(long, value_name = "FILE", value_hint = ValueHint::FilePath, conflicts_with_all = ["view", "compare"])]
    path: Option<PathBuf>,
    /// The probes' pictures of this lighting [default: the site's first]
    #[arg(long, value_name = "NAME")]
    lighting: Option<String>,
    /// Mix another lighting in
    #[arg(long, value_name = "NAME")]
    blend: Option<String>,
    /// How much of the other lighting, 0 to 1
    #[arg(long, value_name = "SHARE", default_value_t = 0.5, requires = "blend", value_parser = between(0.0..=1.0_f32, "a number from 0 to 1"))]
    share: f32,
    /// How to relight
    #[arg(long, value_enum, default_value_t = Method::Ibs)]
    method: Method,
    /// Rays a pixel
    #[arg(long, value_name = "N", default_value_t = SAMPLES, value_parser = clap::value_parser!(u32).range(1..=1024))]
    samples: u32,
    /// Draw from light that is put on the model's vertices first, as `bake` does it: many frames in little time, each a little
    /// off. For a walk it is told by how much
    #[arg(long, conflicts_with_all = ["method", "volume_only", "all_stages"])]
    baked: bool,
    /// With --baked, or where pictures are numbered: at most so many vertices
    #[arg(long, value_name = "N", default_value_t = bake::BakeSettings::default().vertices, value_parser = between(1_000..=50_000_000_usize, "a number from 1000 to 50000000"))]
    vertices: usize,
    /// Use only the first N probes
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    probes: Option<u32>,
    #[command(flatten)]
    volume: VolumeHow,
    /// With --method paper: the records' radius in metres [default: 2.5 times their median spacing]
    #[arg(long, value_name = "METRES", value_parser = between(f32::MIN_POSITIVE..=f32::MAX, "a length in metres, more than 0"))]
    radius: Option<f32>,
    /// Do not use the sun's direction to keep shadow edges sharp
    #[arg(long)]
    no_sun: bool,
    /// Take all light from the volume: shows what it alone is worth
    #[arg(long)]
    volume_only: bool,
    /// Tell each view's error against its photograph, as it comes and after fitting the photograph's exposure, white
    /// balance and vignetting to the render
    #[arg(long)]
    compare: bool,
    /// Fit the probes' gains (exposure and white balance) and vignetting to each other by what several of them
    /// see, render with them, and print them as lines for the site file
    #[arg(long, conflicts_with = "blend")]
    fit_gains: bool,
    /// With --fit-gains: fit a response curve of 8 and 16-bit probes, too. Gloss can look like one: keep it where pictures
    /// get better
    #[arg(long, requires = "fit_gains")]
    fit_response: bool,
    /// Write albedo, normal, depth, source and agreement into the EXR too. Source is where the light came from: 0 sky,
    /// 1 records, 2 the volume, 3 neighbouring or little trusted records
    #[arg(long)]
    layers: bool,
    /// Find the poses of probes and photographs first, as `register` does, and use those that are sure
    #[arg(long)]
    register: bool,
    /// Leave no stage out, needed or not
    #[arg(long)]
    all_stages: bool,
    /// Bake the light onto the model once and have the graphics card draw the views or frames: fast, light a little less fine.
    /// Rays a pixel are a square: 1, 4, 9, … Needs a program built with the feature gpu
    #[arg(long, conflicts_with_all = ["blend", "method", "probes", "radius", "no_sun", "volume_only", "compare", "fit_gains",
        "layers", "register", "all_stages"])]
    gpu: bool,
    #[command(flatten)]
    output: Output,
}

/// How to relight.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
enum Method {
    /// Image-based shooting as this program does it
    #[default]
    Ibs,
    /// The paper's plain method: fixed radius, equal average, point albedo, undirected volume
    Paper,
}

/// Renders a site's views and tells `out` about it.
pub(crate) fn run(args: &RenderArgs, out: &mut impl Write) -> anyhow::Result<()> {
    let mut site = Site::load(&args.site)?;
    if let Some(path) = &args.path {
        site.views = site::walk(&site, path)?;
    }
    chosen(&site, &args.view)?;
    if args.gpu {
        return gpu(&site, args, out);
    }
    if args.compare {
        comparable(&mut site, args)?;
    }
    let model = args.register.then(|| Model::of(&site, &args.output.folder(&site)?)).transpose()?;
    if let Some(Model { scene, .. }) = &model {
        let lines;
        (site, lines) = in_passing(&site, scene, args.lighting.as_deref(), &args.view, args.output.told)?;
        site.warnings.extend(lines);
    }
    let outcome = rendered(site, model, args)?;
    args.output.told.tell(&outcome, out, |out| print(&outcome, out))
}

/// Refuses to compare photographs, which show one light, with numbered pictures; warns where there are none.
fn comparable(site: &mut Site, args: &RenderArgs) -> anyhow::Result<()> {
    let probes = args.probes.map_or(site.probes.len(), |n| n as usize);
    if video::length(site, &lightings(site, args)?, probes).is_some() {
        bail!(
            "{}: probes have numbered pictures, but a photograph shows one light. Leave out --compare",
            site.file.display()
        );
    }
    if chosen(site, &args.view)?.iter().all(|view| view.photo.is_none()) {
        site.warnings.push("no view has a photo: there is nothing to compare with".to_owned());
    }
    Ok(())
}

/// Has a graphics card draw the views.
fn gpu(site: &Site, args: &RenderArgs, out: &mut impl Write) -> anyhow::Result<()> {
    let lighting = lighting(site, args.lighting.as_deref())?;
    let numbered = |p: &site::Probe| p.pictures.iter().any(|l| l.lighting == lighting && !l.frames.is_empty());
    if site.probes.iter().any(numbered) {
        bail!(
            "{}: probes have numbered pictures, which a graphics card is not fed with yet. Leave out --gpu",
            site.file.display()
        );
    }
    let views = chosen(site, &args.view)?;
    let how = BakeHow { volume: args.volume, vertices: Some(args.vertices), ..BakeHow::default() };
    let asked = gpu::Asked { views, lighting, how, samples: args.samples, walk: args.path.is_some() };
    gpu::run(site, &asked, &args.output, out)
}

impl RenderArgs {
    /// All views as they come, into a folder, silently.
    pub(super) fn as_they_come(out: &Path, compare: bool) -> Self {
        let vertices = bake::BakeSettings::default().vertices;
        Self { samples: SAMPLES, vertices, compare, output: Output::silent(out), ..Self::default() }
    }
}

/// Renders views of a site, and writes them; without its model, reads what of it probes and views can reach.
pub(super) fn rendered(mut site: Site, model: Option<Model>, args: &RenderArgs) -> anyhow::Result<Rendered> {
    let start = Instant::now();
    site.probes.truncate(args.probes.map_or(usize::MAX, |n| n as usize));
    let views = chosen(&site, &args.view)?;
    if args.method == Method::Paper && args.volume_only {
        bail!("--volume-only: the paper's method does not take all light from a volume. Leave one of the two out");
    }
    let lightings = lightings(&site, args)?;
    let mut options = Options {
        lightings,
        probes: site.probes.len(),
        sun: !args.no_sun,
        volume: args.volume.settings(),
        all_stages: args.all_stages || args.volume_only,
        volume_for_all: args.volume_only,
    };
    let video = video::length(&site, &options.lightings, options.probes);
    if video.is_some() && (args.method == Method::Paper || args.volume_only || args.all_stages) {
        bail!(
            "{}: probes have numbered pictures, whose light goes to the model's vertices first. Leave out --method, --volume-only and --all-stages",
            site.file.display()
        );
    }
    if video.is_some() {
        options.volume = options.volume.for_products();
    }
    let photos = if args.compare { photos(&views)? } else { BTreeMap::new() };
    let folder = args.output.folder(&site)?;
    let (Model { scene, health, read }, spared) = match model {
        Some(model) => (model, None),
        None => reachable(&site, args, &folder)?,
    };
    let unreached = spared.map(not_loaded);
    let load_s = read.wall_s + start.elapsed().as_secs_f64();
    let fitting = radiometry::FitSettings { response: args.fit_response, ..radiometry::FitSettings::default() };
    let gains = args.fit_gains.then(|| radiometry::fit(&site, &scene, &options.lightings[0], &fitting)).transpose()?;
    gains.iter().for_each(|fit| fit.apply(&mut site));
    let views = chosen(&site, &args.view)?;
    let cameras: Vec<_> = views.iter().map(|v| v.camera).collect();
    let (baked, mut setup) = match args.baked || video.is_some() {
        true => baked::baked(&site, &scene, &options, (args.vertices, video.is_some()), args.output.told)
            .map(|(baked, setup)| (Some(baked), setup))?,
        // the paper's method has a volume of its own: of ours it takes what is behind windows
        false if args.method == Method::Paper => (None, shoot_probes(&site, &scene, &options)?),
        false => (None, prepare(&site, &scene, &cameras, &options)?),
    };
    // all stages: the lightings that nobody asked for too
    let _unasked = if args.all_stages { unasked(&site, &scene, &options)? } else { None };
    let pictures_s = setup.timings.load_s;
    setup.timings.load_s += load_s;
    let plain = match args.method {
        Method::Ibs => Vec::new(),
        Method::Paper => plain(&site, &scene, &options, args, &mut setup)?,
    };

    let start = Instant::now();
    let volumes = setup.volumes(&scene);
    let volume_s = start.elapsed().as_secs_f64();

    let volume_only = args.volume_only;
    let relits: Vec<Relit> = (setup.lights.iter().zip(&volumes))
        .map(|((_, light), volume)| Relit { scene: &scene, light, volume: volume.as_ref(), volume_only })
        .collect();
    let skies: Vec<Sky> = setup.lights.iter().map(|(_, light)| -> Sky { Box::new(|d| light.sky(d)) }).collect();
    let mut filmed = match (&baked, video) {
        (Some(drawn), Some(_)) => Some(Video::new(&site, &options, &relits, &drawn.baked)?),
        _ => None,
    };
    let light = ViewLight::new(&relits, &plain, &skies, baked.as_ref().map(|b| b.lights(&relits)));

    let probes: Vec<_> = site.probes.iter().take(options.probes).map(|p| scene.local(p.pose.position)).collect();
    let bar = args.output.told.bar("{msg:16} {wide_bar} {percent:>3} %  {eta} left");
    let shots = video::shots(&views, video, args.path.is_some());
    bar.set_length(shots.iter().map(|s| u64::from(s.0.camera.height)).sum::<u64>() * setup.lights.len() as u64);
    let mut done = Vec::new();
    // frames of a walk, or of one view's video, must not flicker
    let together = if args.path.is_some() { 1 } else { views.len() };
    let frames: Vec<_> = shots.chunks(together).collect();
    let mut steady = match args.path.is_some() || video.is_some() {
        true => steady_exposures(&scene, &light, &mut filmed, &frames, args.share)?,
        false => Vec::new(),
    };
    let mut relighting: Option<(usize, Vec<video::Relighting>)> = None;
    for (n, (view, picture)) in shots.iter().enumerate() {
        if let Some(video) = &mut filmed
            && relighting.as_ref().is_none_or(|r| r.0 != *picture)
        {
            relighting = Some((*picture, video.light(*picture)?));
        }
        bar.set_message(visible(&view.name).into_owned());
        let now = relighting.as_ref().map(|r| &r.1[..]);
        let Some(frame) = light.frame(&scene, &view.camera, now, args.samples, args.share, &bar) else { continue };
        let Compared { error, fit, error_after_fit } = photos
            .get(&view.name)
            .map_or_else(Compared::default, |photo| compared(&scene, &probes, &view.camera, &frame, photo));
        let number = n % together;
        if steady.len() <= number {
            steady.push(Exposure::of(&frame.radiance));
        }
        let file = pictures::write(&frame.layers(args.layers), &frame.radiance, view, &folder, steady[number])?;
        let Frame { rays_s, shade_s, covered_fraction, .. } = frame;
        done.push(RenderedView {
            name: view.name.clone(),
            rays_s,
            shade_s,
            covered_fraction,
            file,
            error,
            fit,
            error_after_fit,
        });
    }
    bar.finish_and_clear();
    let baked = baked.as_ref().zip(light.full_and_baked()).map(|(baked, lights)| {
        let frames = if args.path.is_some() && video.is_none() { &cameras[..] } else { &[] };
        let told = baked.told(&scene, lights, frames, args.samples);
        BakedFrames { video: filmed.as_ref().map(|video| video.times), ..told }
    });
    let left_out = not_done(&site, args.all_stages, &options, unreached, &setup, pictures_s)?;
    let timings = Timings { volume_s: setup.timings.volume_s + volume_s, ..setup.timings };
    let warnings = site.warnings.iter().cloned().chain(health.warnings).collect();
    Ok(Rendered {
        setup: timings,
        views: done,
        baked,
        records: setup.records,
        record_bytes: setup.record_bytes,
        peak_bytes: clerestory::memory::peak(),
        left_out,
        warnings,
        gains,
    })
}

/// What of a site's model probes and views can reach, and what that spared.
fn reachable(site: &Site, args: &RenderArgs, folder: &Path) -> anyhow::Result<(Model, Option<Spared>)> {
    let names: Vec<&str> = args.view.iter().map(String::as_str).collect();
    let marks = |mesh: &Mesh, origin| {
        let eyes = check::eyes(site, origin, (!names.is_empty()).then_some(&names));
        if args.all_stages { None } else { check::unreachable(mesh, &eyes) }
    };
    let mut health = Health::default();
    let (scene, spared) = scene::load_without(site, &mut health, marks)?;
    apart(folder, &health.files)?;
    Ok((Model { scene, health, read: Seconds::default() }, spared))
}

/// The views that were asked for, in the site's order.
fn chosen<'a>(site: &'a Site, names: &[String]) -> anyhow::Result<Vec<&'a View>> {
    let file = || site.file.display().to_string();
    if site.views.is_empty() {
        bail!("{}: the site has no view to render. Add a [[view]]", file());
    }
    site.views_named(names).with_context(file)
}

/// The lightings that are needed: one, or two to blend.
fn lightings(site: &Site, args: &RenderArgs) -> anyhow::Result<Vec<String>> {
    let first = lighting(site, args.lighting.as_deref())?;
    let blended = args.blend.iter().map(|name| lighting(site, Some(name)));
    std::iter::once(Ok(first)).chain(blended).collect()
}

/// The paper's method, one per lighting; its timings and records take the place of ours.
fn plain(
    site: &Site,
    scene: &Scene,
    options: &Options,
    args: &RenderArgs,
    setup: &mut Setup,
) -> anyhow::Result<Vec<Plain>> {
    let settings = PaperSettings { radius_m: args.radius, cells: args.volume.cells, ..PaperSettings::default() };
    let probes = &site.probes[..options.probes.min(site.probes.len())];
    let mut timings = Timings { load_s: setup.timings.load_s, ..Timings::default() };
    let mut all = Vec::new();
    for lighting in &options.lightings {
        let plain = Plain::of_probes(scene, probes, lighting, settings)?;
        let Timings { shoot_s, index_s, volume_s, .. } = plain.timings;
        timings.shoot_s += shoot_s;
        timings.index_s += index_s;
        timings.volume_s += volume_s;
        (setup.records, setup.record_bytes) = (plain.record_count(), plain.record_bytes());
        all.push(plain);
    }
    setup.timings = timings;
    Ok(all)
}
