//! `clerestory render SITE`.

mod compared;
mod gpu;
mod print;

use anyhow::bail;
use clap::{Args, ValueEnum, ValueHint};
use clerestory::check::{self, Saving};
use clerestory::panorama::{self, Exposure, write_exr, write_png};
use clerestory::paper::{Plain, PlainRelit, ProbeLight};
use clerestory::render::{Frame, Irradiance, LeftOut, Options, Relit, Setup, Timings, exposure_of, prepare, render};
use clerestory::report::{NotDone, Rendered, RenderedView};
use clerestory::scene::{self, Health, Mesh, Scene, Spared};
use clerestory::shoot::read_light;
use clerestory::site::{Camera, Site, View};
use clerestory::volume;
use clerestory::{paper, radiometry, site};
use compared::{Compared, compared, photos};
use print::print;
use std::collections::BTreeMap;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::Instant;

use super::register::lighting;
use super::terminal::output::Output;
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
    clerestory render sites/chapel --path walk.toml --out walk")]
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
    #[arg(long, value_name = "SHARE", default_value_t = 0.5, requires = "blend", value_parser = share)]
    share: f32,
    /// How to relight
    #[arg(long, value_enum, default_value_t = Method::Ibs)]
    method: Method,
    /// Rays a pixel
    #[arg(long, value_name = "N", default_value_t = SAMPLES, value_parser = clap::value_parser!(u32).range(1..=1024))]
    samples: u32,
    /// Use only the first N probes
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    probes: Option<u32>,
    /// Cells of the irradiance volume along the model's longest side
    #[arg(long, value_name = "N", default_value_t = volume::VolumeSettings::default().cells, value_parser = clap::value_parser!(u32).range(1..=512))]
    cells: u32,
    /// Rays from each place of the irradiance volume
    #[arg(long, value_name = "N", default_value_t = volume::VolumeSettings::default().rays, value_parser = clap::value_parser!(u32).range(8..=65536))]
    volume_rays: u32,
    /// With --method paper: the records' radius in metres [default: twice their median spacing]
    #[arg(long, value_name = "METRES", value_parser = radius)]
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
        return gpu::run(&site, args, out);
    }
    if args.register {
        let scene = scene::load(&site, &mut Health::default())?;
        let (found, lines) =
            super::register::in_passing(&site, &scene, args.lighting.as_deref(), &args.view, args.output.talks())?;
        site = found;
        site.warnings.extend(lines);
    }
    let outcome = rendered(site, args)?;
    if args.output.json {
        super::terminal::output::json(&outcome, out)?;
    } else if !args.output.quiet {
        print(&outcome, out)?;
    }
    Ok(())
}

impl RenderArgs {
    /// All views as they come, into a folder, silently.
    pub(super) fn as_they_come(out: &Path, compare: bool) -> Self {
        let volume::VolumeSettings { cells, rays } = volume::VolumeSettings::default();
        Self { samples: SAMPLES, cells, volume_rays: rays, compare, output: Output::silent(out), ..Self::default() }
    }
}

/// Renders views of a site that is loaded, and writes them.
pub(super) fn rendered(mut site: Site, args: &RenderArgs) -> anyhow::Result<Rendered> {
    let start = Instant::now();
    let views = chosen(&site, &args.view)?;
    let lightings = lightings(&site, args)?;
    let photos = if args.compare { photos(&views)? } else { BTreeMap::new() };
    let folder = args.output.folder(&site)?;

    let mut health = Health::default();
    let names: Vec<&str> = args.view.iter().map(String::as_str).collect();
    let marks = |mesh: &Mesh, origin| {
        let eyes = check::eyes(&site, origin, (!names.is_empty()).then_some(&names));
        if args.all_stages { None } else { check::unreachable(mesh, &eyes) }
    };
    let (scene, spared) = scene::load_without(&site, &mut health, marks)?;
    let unreached = spared.map(not_loaded);
    let load_s = start.elapsed().as_secs_f64();
    let fitting = radiometry::FitSettings { response: args.fit_response, ..radiometry::FitSettings::default() };
    let gains = args.fit_gains.then(|| radiometry::fit(&site, &scene, &lightings[0], &fitting)).transpose()?;
    gains.iter().for_each(|fit| fit.apply(&mut site));
    let views = chosen(&site, &args.view)?;
    let cameras: Vec<_> = views.iter().map(|v| v.camera).collect();
    let options = Options {
        lightings,
        probes: args.probes.map_or(site.probes.len(), |n| n as usize),
        sun: !args.no_sun,
        volume: volume::VolumeSettings { cells: args.cells, rays: args.volume_rays },
        all_stages: args.all_stages || args.volume_only,
        volume_for_all: args.volume_only,
    };
    let mut setup = prepare(&site, &scene, &cameras, &options)?;
    // all stages: the lightings that nobody asked for too
    let _unasked = if args.all_stages { unasked(&site, &scene, &options)? } else { None };
    let pictures_s = setup.timings.load_s;
    setup.timings.load_s += load_s;
    let plain = match args.method {
        Method::Ibs => None,
        Method::Paper => Some(plain(&site, &scene, &options, args, &mut setup)?),
    };

    let start = Instant::now();
    let volumes = setup.volumes(&scene);
    let volume_s = start.elapsed().as_secs_f64();

    let probes: Vec<_> = site.probes.iter().take(options.probes).map(|p| scene.local(p.pose.position)).collect();
    let bar = args.output.bar("{msg:16} {wide_bar} {percent:>3} %  {eta} left");
    bar.set_length(views.iter().map(|v| u64::from(v.camera.height)).sum::<u64>() * setup.lights.len() as u64);
    let mut done = Vec::new();
    let mut steady = args.path.is_some().then(|| walk_exposure(&scene, &setup, &volumes, &cameras));
    for view in &views {
        let mut frame: Option<Frame> = None;
        for (i, (_, light)) in setup.lights.iter().enumerate() {
            let sky = |direction| light.sky(direction);
            let relit: Box<dyn Irradiance> = match &plain {
                Some(plain) => Box::new(PlainRelit { plain: &plain[i], sky: &sky }),
                None => {
                    Box::new(Relit { scene: &scene, light, volume: volumes[i].as_ref(), volume_only: args.volume_only })
                }
            };
            bar.set_message(visible(&view.name).into_owned());
            let before = bar.position();
            let tell = |rows: u64, _| bar.set_position(before + rows);
            let this = render(&scene, relit.as_ref(), &view.camera, args.samples, &tell);
            frame = Some(match frame {
                None => this,
                Some(first) => first.mixed(&this, args.share),
            });
        }
        let Some(frame) = frame else { continue };
        let Compared { error, fit, error_after_fit } = photos
            .get(&view.name)
            .map_or_else(Compared::default, |photo| compared(&scene, &probes, &view.camera, &frame, photo));
        // frames of a walk must not flicker
        let exposure = *steady.get_or_insert_with(|| Exposure::of(&frame.radiance));
        if args.path.is_none() {
            steady = None;
        }
        let file = write(&frame, view, &folder, args.layers, exposure)?;
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
    let left_out = not_done(&site, args, &options, unreached, &setup, pictures_s)?;
    let Setup { mut timings, records, record_bytes, .. } = setup;
    timings.volume_s += volume_s;
    let warnings = site.warnings.iter().cloned().chain(health.warnings).collect();
    Ok(Rendered {
        setup: timings,
        views: done,
        records,
        record_bytes,
        peak_bytes: peak_bytes(),
        left_out,
        warnings,
        gains,
    })
}

/// The light of the lightings that nobody asked for.
fn unasked(site: &Site, scene: &Scene, options: &Options) -> anyhow::Result<Option<Setup>> {
    let others = site.lightings().into_iter().filter(|l| !options.lightings.contains(l)).collect::<Vec<_>>();
    if others.is_empty() {
        return Ok(None);
    }
    let options = Options { lightings: others, all_stages: false, ..options.clone() };
    Ok(Some(prepare(site, scene, &[], &options)?))
}

/// What no probe and no view can reach, in words.
fn not_loaded(spared: Spared) -> NotDone {
    let Spared { triangles, textures, seconds, bytes } = spared;
    let pictures = match textures {
        0 => String::new(),
        1 => ", with a picture that only they have".to_owned(),
        n => format!(", with {n} pictures that only they have"),
    };
    let why =
        format!("{triangles} triangles lie behind closed walls that part them from all probes and views{pictures}");
    NotDone { what: LeftOut { stage: "unreached", why }, saves: Some(Saving { seconds, bytes }) }
}

/// What was not done, and what that saved. `pictures_s` is what reading the pictures took that were read.
fn not_done(
    site: &Site,
    args: &RenderArgs,
    options: &Options,
    unreached: Option<NotDone>,
    setup: &Setup,
    pictures_s: f64,
) -> anyhow::Result<Vec<NotDone>> {
    let mut all: Vec<NotDone> =
        setup.left_out.iter().map(|what| NotDone { what: what.clone(), saves: None }).chain(unreached).collect();
    let (mut read, mut spared, mut count) = (0usize, 0usize, 0usize);
    for lit in site.probes.iter().take(options.probes).flat_map(|p| &p.pictures) {
        let (width, height) = panorama::dimensions(&lit.path)?;
        if options.lightings.contains(&lit.lighting) {
            read += width * height;
        } else {
            (spared, count) = (spared + width * height, count + 1);
        }
    }
    // with all stages they were
    if count > 0 && !args.all_stages {
        let why = format!("{count} pictures of lightings that were not asked for are not decoded");
        let seconds = (pictures_s + setup.timings.index_s) * spared as f64 / read.max(1) as f64;
        let bytes = (spared * size_of::<glam::Vec3>()) as u64;
        all.push(NotDone { what: LeftOut { stage: "lightings", why }, saves: Some(Saving { seconds, bytes }) });
    }
    Ok(all)
}

/// The views that were asked for, in the site's order.
fn chosen<'a>(site: &'a Site, names: &[String]) -> anyhow::Result<Vec<&'a View>> {
    let known: Vec<&str> = site.views.iter().map(|v| v.name.as_str()).collect();
    if site.views.is_empty() {
        bail!("{}: the site has no view to render. Add a [[view]]", site.file.display());
    }
    for name in names {
        if !known.contains(&name.as_str()) {
            bail!("{}: there is no view “{name}”. The site's views: {}", site.file.display(), known.join(", "));
        }
    }
    Ok(site.views.iter().filter(|v| names.is_empty() || names.contains(&v.name)).collect())
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
    let settings = paper::PaperSettings { radius_m: args.radius, cells: args.cells, ..paper::PaperSettings::default() };
    let probes: Vec<&site::Probe> = site.probes.iter().take(options.probes).collect();
    let (mut all, mut timings) = (Vec::new(), Timings { load_s: setup.timings.load_s, ..Timings::default() });
    for lighting in &options.lightings {
        let lit =
            probes.iter().filter_map(|probe| Some((probe, probe.pictures.iter().find(|p| p.lighting == *lighting)?)));
        let lit: Vec<_> =
            lit.map(|(probe, file)| Ok((*probe, read_light(probe, &file.path)?))).collect::<anyhow::Result<_>>()?;
        let lights: Vec<ProbeLight> = lit
            .iter()
            .map(|(probe, picture)| ProbeLight {
                origin: scene.local(probe.pose.position),
                to_world: probe.pose.rotation.as_mat3(),
                picture,
                projection: probe.projection,
            })
            .collect();
        let plain = Plain::new(scene, &lights, settings);
        let seconds = plain.seconds();
        timings.shoot_s += seconds.shoot;
        timings.index_s += seconds.index;
        timings.volume_s += seconds.volume;
        (setup.records, setup.record_bytes) = (plain.record_count(), plain.record_bytes());
        all.push(plain);
    }
    setup.timings = timings;
    setup.transport_of.fill(None);
    Ok(all)
}

/// One exposure for all frames of a walk: the geometric mean of some of theirs.
fn walk_exposure(scene: &Scene, setup: &Setup, volumes: &[Option<volume::Volume>], cameras: &[Camera]) -> Exposure {
    const ASKED: usize = 16;
    let relit = |i: usize| Relit { scene, light: &setup.lights[i].1, volume: volumes[i].as_ref(), volume_only: false };
    let some: Vec<&Camera> = cameras.iter().step_by(cameras.len().div_ceil(ASKED)).collect();
    let sum: f32 = some.iter().map(|camera| exposure_of(scene, &relit(0), camera).0.ln()).sum();
    Exposure((sum / some.len() as f32).exp())
}

/// Writes a view's pictures, whole or not at all.
fn write(frame: &Frame, view: &View, folder: &Path, layers: bool, exposure: Exposure) -> anyhow::Result<PathBuf> {
    let (width, height) = (frame.radiance.width, frame.radiance.height);
    let file = folder.join(format!("{}.exr", view.file_stem()));
    write_exr(&file, width, height, &frame.layers(layers), None)?;
    write_png(&file.with_extension("png"), &frame.radiance, exposure)?;
    Ok(file)
}

/// The most memory that the process has held, where the system tells.
pub(super) fn peak_bytes() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|l| l.starts_with("VmHWM:"))?;
    line.split_whitespace().nth(1)?.parse::<u64>().ok().map(|kib| kib * 1024)
}

fn share(text: &str) -> Result<f32, String> {
    text.parse().ok().filter(|s| (0.0..=1.0).contains(s)).ok_or_else(|| "expected a number from 0 to 1".to_owned())
}

fn radius(text: &str) -> Result<f32, String> {
    let ok = text.parse().ok().filter(|r: &f32| *r > 0.0 && r.is_finite());
    ok.ok_or_else(|| "expected a length in metres, more than 0".to_owned())
}
