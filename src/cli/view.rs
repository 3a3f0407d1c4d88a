//! `clerestory view SITE`.

use clap::{Args, ValueHint};
use clerestory::bake::{self, Bake};
use clerestory::site::Site;
use clerestory::viewer::{Extras, write_viewer};
use serde::Serialize;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::Instant;

use super::bake::{BakeHow, baked, lightings};
use super::terminal::model::Model;
use super::terminal::output::{Output, Told};

/// Make a page to walk through the relit model in: one file, no network.
///
/// Writes viewer.html into --out; it opens in any browser with WebGL 2, from a disk or a server.
#[derive(Args, Debug)]
#[command(after_help = "Examples:\n  \
    clerestory view sites/chapel\n  \
    clerestory view sites/chapel --findings reports/chapel --plan reports/chapel/plan.json\n  \
    clerestory view sites/chapel --vertices 1000000 --error 0.04")]
pub(crate) struct ViewArgs {
    /// The site file, or the folder that holds its site.toml
    #[arg(value_hint = ValueHint::AnyPath)]
    site: PathBuf,
    /// Show what an audit found: the folder with its findings.json
    #[arg(long, value_name = "DIR", value_hint = ValueHint::DirPath)]
    findings: Option<PathBuf>,
    /// Show the stations of a plan: its plan.json
    #[arg(long, value_name = "FILE", value_hint = ValueHint::FilePath)]
    plan: Option<PathBuf>,
    #[command(flatten)]
    how: BakeHow,
    #[command(flatten)]
    output: Output,
}

/// How many vertices a page has unless told otherwise: a few for each of the model's triangles, no fewer and no more than browsers
/// open in seconds.
fn usual_vertices(triangles: usize) -> usize {
    (16 * triangles).clamp(400_000, 1_200_000)
}

/// A page has also a surface of at most so many vertices, drawn on slow machines while something moves.
const COARSE: usize = 100_000;

/// What was made, for scripts.
#[derive(Serialize)]
pub(super) struct Outcome {
    file: PathBuf,
    bytes: u64,
    vertices: usize,
    triangles: usize,
    seconds: f64,
}

/// Makes a site's viewer and tells `out` where it is.
pub(crate) fn run(args: &ViewArgs, out: &mut impl Write) -> anyhow::Result<()> {
    let site = Site::load(&args.site)?;
    let extras = Extras {
        findings: args.findings.clone(),
        plan: args.plan.clone(),
        command: super::terminal::command::own_command(),
    };
    let folder = args.output.folder(&site)?;
    let model = Model::of(&site, &folder)?;
    let outcome = viewed(&site, &model, &args.how, &extras, &folder, args.output.told)?;
    args.output.told.tell(&outcome, out, |out| {
        let Outcome { file, bytes, vertices, triangles, seconds } = &outcome;
        let megabytes = *bytes as f64 / 1e6;
        writeln!(
            out,
            "{}: {megabytes:.1} MB, {vertices} vertices, {triangles} triangles, {seconds:.1} s",
            file.display()
        )
    })
}

/// Bakes a site and writes its page into a folder.
pub(super) fn viewed(
    site: &Site,
    Model { scene, read, .. }: &Model,
    how: &BakeHow,
    extras: &Extras,
    folder: &Path,
    told: Told,
) -> anyhow::Result<Outcome> {
    let start = Instant::now();
    let lightings = lightings(site, &how.lighting)?;
    let usual = bake::BakeSettings {
        vertices: usual_vertices(scene.mesh.triangles.len()),
        error: 0.05,
        sun_apart: true,
        coarse: COARSE,
        ..bake::BakeSettings::default()
    };
    let (Bake { baked, .. }, _) = baked(site, scene, &lightings, how.volume.settings(), &how.settings(usual), told)?;
    let file = folder.join("viewer.html");
    write_viewer(&file, site, scene, &baked, extras)?;
    Ok(Outcome {
        bytes: std::fs::metadata(&file)?.len(),
        file,
        vertices: baked.vertices.len(),
        triangles: baked.triangles.len(),
        seconds: read.wall_s + start.elapsed().as_secs_f64(),
    })
}
