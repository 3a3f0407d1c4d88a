//! `clerestory bake SITE`.

use clap::{Args, ValueHint};
use clerestory::bake::{self, Bake, Baked, bake, write_glb, write_ply};
use clerestory::render::{Options, Timings};
use clerestory::scene::Scene;
use clerestory::site::Site;
use clerestory::volume::VolumeSettings;
use serde::Serialize;
use serde_json::{Map, Value};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::time::Instant;

use super::terminal::model::Model;
use super::terminal::number::between;
use super::terminal::output::{Output, Told, warn};

/// Put the light of the place on the model's vertices, for any 3D viewer.
///
/// Writes SITE.glb (original textures, light as vertex colour, no shading) and SITE.ply (for CloudCompare and MeshLab) into
/// --out, SITE-LIGHTING where the site has several lightings. Triangles are cut where light changes; scans keep their
/// vertices.
#[derive(Args, Debug)]
#[command(after_help = "Examples:\n  \
    clerestory bake sites/chapel\n  \
    clerestory bake sites/chapel --lighting 14:30 --error 0.04\n  \
    clerestory bake sites/chapel --vertices 200000 --out for-the-web")]
pub(crate) struct BakeArgs {
    /// The site file, or the folder that holds its site.toml
    #[arg(value_hint = ValueHint::AnyPath)]
    site: PathBuf,
    #[command(flatten)]
    how: BakeHow,
    #[command(flatten)]
    output: Output,
}

/// How to bake.
#[derive(Args, Debug, Default)]
pub(crate) struct BakeHow {
    /// Only this lighting; may be given several times [default: all]
    #[arg(long, value_name = "NAME")]
    pub(super) lighting: Vec<String>,
    /// At most so many vertices [default: 1000000; for a page 16 a triangle, 400000 to 1200000]
    #[arg(long, value_name = "N", value_parser = between(1_000..=50_000_000_usize, "a number from 1000 to 50000000"))]
    pub(super) vertices: Option<usize>,
    /// Cut a triangle where light between its corners is off by this share [default: 0.08; for a page 0.05]
    #[arg(long, value_name = "SHARE", value_parser = between(1e-3..=1.0_f32, "a share from 0.001 to 1"))]
    pub(super) error: Option<f32>,
    #[command(flatten)]
    pub(super) volume: VolumeHow,
}

/// How finely to fill what no probe sees.
#[derive(Args, Clone, Copy, Debug)]
pub(crate) struct VolumeHow {
    /// Cells of the irradiance volume along the model's longest side
    #[arg(long, value_name = "N", default_value_t = VolumeSettings::default().cells, value_parser = clap::value_parser!(u32).range(1..=512))]
    pub(super) cells: u32,
    /// Rays from each place of the irradiance volume
    #[arg(long, value_name = "N", default_value_t = VolumeSettings::default().rays, value_parser = clap::value_parser!(u32).range(8..=65536))]
    volume_rays: u32,
}

impl Default for VolumeHow {
    fn default() -> Self {
        let VolumeSettings { cells, rays, .. } = VolumeSettings::default();
        Self { cells, volume_rays: rays }
    }
}

impl VolumeHow {
    /// The same for the library.
    pub(super) fn settings(self) -> VolumeSettings {
        VolumeSettings { cells: self.cells, rays: self.volume_rays, ..VolumeSettings::default() }
    }
}

impl BakeHow {
    /// How finely to bake; `usual` is how finely if nothing else is asked for.
    pub(super) fn settings(&self, usual: bake::BakeSettings) -> bake::BakeSettings {
        bake::BakeSettings {
            vertices: self.vertices.unwrap_or(usual.vertices),
            error: self.error.unwrap_or(usual.error),
            ..usual
        }
    }
}

/// What was made, for scripts.
#[derive(Serialize)]
struct Outcome {
    setup: Timings,
    bake_s: f64,
    write_s: f64,
    vertices: usize,
    triangles: usize,
    /// Triangles of the model that nobody inside can see.
    hidden_triangles: usize,
    two_sided_triangles: usize,
    /// Shares of the vertices by where their light came from.
    records: f64,
    volume: f64,
    neighbours: f64,
    /// Seen by no probe.
    unseen: f64,
    files: Vec<PathBuf>,
    peak_bytes: Option<u64>,
    warnings: Vec<String>,
}

/// Bakes a site and tells `out` about it.
pub(crate) fn run(args: &BakeArgs, out: &mut impl Write) -> anyhow::Result<()> {
    let site = Site::load(&args.site)?;
    let lightings = lightings(&site, &args.how.lighting)?;
    let folder = args.output.folder(&site)?;
    let Model { scene, health, read } = Model::of(&site, &folder)?;
    let volume = args.how.volume.settings().for_products();
    let settings = args.how.settings(bake::BakeSettings::default());
    let (Bake { baked, mut setup }, bake_s) = baked(&site, &scene, &lightings, volume, &settings, args.output.told)?;
    setup.timings.load_s += read.wall_s;
    let start = Instant::now();
    let files = write(&folder, &site, &scene, &baked)?;
    let share = |of: &dyn Fn(&bake::Vertex) -> bool| {
        baked.vertices.iter().filter(|v| of(v)).count() as f64 / baked.vertices.len().max(1) as f64
    };
    let by = |source: clerestory::render::Source| share(&|v| v.source == source);
    let outcome = Outcome {
        setup: setup.timings,
        bake_s,
        write_s: start.elapsed().as_secs_f64(),
        vertices: baked.vertices.len(),
        triangles: baked.triangles.len(),
        hidden_triangles: baked.hidden.len(),
        two_sided_triangles: baked.two_sided,
        records: by(clerestory::render::Source::Record),
        volume: by(clerestory::render::Source::Volume),
        neighbours: by(clerestory::render::Source::Neighbour),
        unseen: share(&|v| v.seen_by == 0),
        files,
        peak_bytes: clerestory::memory::peak(),
        warnings: site.warnings.iter().cloned().chain(health.warnings).collect(),
    };
    args.output.told.tell(&outcome, out, |out| print(&outcome, out))
}

/// Bakes with a bar that shows how many vertices there are; tells also the seconds that baking took, what it was set up with apart.
pub(super) fn baked(
    site: &Site,
    scene: &Scene,
    lightings: &[String],
    volume: VolumeSettings,
    settings: &bake::BakeSettings,
    told: Told,
) -> anyhow::Result<(Bake, f64)> {
    let start = Instant::now();
    let options = Options { lightings: lightings.to_vec(), volume, ..Options::of(site) };
    let bar = told.bar("{spinner} {msg}  {elapsed}");
    bar.set_message("shooting …");
    let made = bake(site, scene, &options, settings, &|n| bar.set_message(format!("{n} vertices …")))?;
    bar.finish_and_clear();
    let Timings { load_s, shoot_s, index_s, volume_s } = made.setup.timings;
    Ok((made, start.elapsed().as_secs_f64() - load_s - shoot_s - index_s - volume_s))
}

/// The lightings that were asked for, each once, or all; a site without names for them has one.
pub(super) fn lightings(site: &Site, asked: &[String]) -> anyhow::Result<Vec<String>> {
    let known = site.lightings();
    if asked.is_empty() && !known.is_empty() {
        return Ok(known);
    }
    let mut once: Vec<String> = Vec::new();
    for name in asked {
        let name = super::register::lighting(site, Some(name))?;
        if !once.contains(&name) {
            once.push(name);
        }
    }
    // a site without probes is told so later
    Ok(if once.is_empty() { vec![String::new()] } else { once })
}

/// The site's name as a file may have it.
pub(super) fn stem(site: &Site) -> String {
    let plain = |c: char| if c.is_alphanumeric() || "-_".contains(c) { c.to_ascii_lowercase() } else { '-' };
    let name: String = site.name.chars().map(plain).collect();
    match name.trim_matches('-') {
        "" => "site".to_owned(),
        "coverage" => "site-coverage".to_owned(), // the plan's own
        name => name.to_owned(),
    }
}

/// What the files of some of a site's lightings are called, whichever are baked with them: each in its own way, letter case
/// aside: “10:00” and “1000” are two.
fn stems(site: &str, all: &[String], baked: &[String]) -> Vec<String> {
    let mut stems: Vec<String> = Vec::new();
    for lighting in all {
        let plain = lighting.replace(|c: char| !c.is_alphanumeric() && c != '-', "");
        let stem = if all.len() > 1 { format!("{site}-{plain}") } else { site.to_owned() };
        let taken = |name: &String| stems.iter().any(|s| s.to_lowercase() == name.to_lowercase());
        let mut names = std::iter::once(stem.clone()).chain((2..).map(|n| format!("{stem}-{n}")));
        stems.extend(names.find(|name| !taken(name)));
    }
    let stem = |lighting: &String| all.iter().position(|l| l == lighting).and_then(|i| stems.get(i).cloned());
    baked.iter().map(|lighting| stem(lighting).unwrap_or_else(|| site.to_owned())).collect()
}

fn write(folder: &Path, site: &Site, scene: &Scene, baked: &Baked) -> anyhow::Result<Vec<PathBuf>> {
    let mut files = Vec::new();
    let command = super::terminal::command::own_command();
    for (l, stem) in stems(&stem(site), &site.lightings(), &baked.lightings).iter().enumerate() {
        let mut notes = Map::new();
        notes.insert("site".into(), Value::from(site.name.as_str()));
        notes.insert("command".into(), Value::from(command.as_str()));
        let [glb, ply] = ["glb", "ply"].map(|kind| folder.join(format!("{stem}.{kind}")));
        let (one, other) = rayon::join(
            || write_glb(&glb, scene, baked, l, notes),
            || write_ply(&ply, scene, &site.frame, baked, l, &command),
        );
        one.and(other)?;
        files.extend([glb, ply]);
    }
    Ok(files)
}

fn print(o: &Outcome, out: &mut impl Write) -> io::Result<()> {
    warn("warning:", &o.warnings, out)?;
    let percent = |share: f64| 100.0 * share;
    writeln!(
        out,
        "{} vertices, {} triangles: {:.0} % lit by records, {:.0} % by the volume, {:.0} % by neighbours; {:.0} % no probe sees",
        o.vertices,
        o.triangles,
        percent(o.records),
        percent(o.volume),
        percent(o.neighbours),
        percent(o.unseen)
    )?;
    if o.hidden_triangles > 0 {
        writeln!(out, "{} triangles of the model cannot be seen from within and are left out", o.hidden_triangles)?;
    }
    let t = o.setup;
    writeln!(
        out,
        "load {:.2} s, shoot {:.2} s, index {:.2} s, volume {:.2} s, bake {:.2} s, write {:.2} s",
        t.load_s, t.shoot_s, t.index_s, t.volume_s, o.bake_s, o.write_s
    )?;
    o.files.iter().try_for_each(|f| writeln!(out, "{}", f.display()))
}

#[cfg(test)]
mod tests {
    use super::stems;

    #[test]
    fn no_lighting_s_files_take_the_place_of_another_s() {
        let owned = |names: &[&str]| names.iter().map(|n| (*n).to_owned()).collect::<Vec<_>>();
        let of = |all: &[&str], baked: &[&str]| stems("nave", &owned(all), &owned(baked));
        assert_eq!(of(&[""], &[""]), ["nave"]);
        assert_eq!(of(&["10:00"], &["10:00"]), ["nave"]);
        let two = ["10:00", "14:30"];
        assert_eq!(of(&two, &two), ["nave-1000", "nave-1430"]);
        assert_eq!(of(&two, &["10:00"]), ["nave-1000"]);
        assert_eq!(of(&two, &["14:30", "10:00"]), ["nave-1430", "nave-1000"]);
        let many = ["10:00", "1000", "Day", "day", "?", "!"];
        assert_eq!(of(&many, &many), ["nave-1000", "nave-1000-2", "nave-Day", "nave-day-2", "nave-", "nave--2"]);
        assert_eq!(of(&many, &["day"]), ["nave-day-2"]);
    }
}
