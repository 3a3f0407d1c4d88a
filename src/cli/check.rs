//! `clerestory check SITE`.

use clap::Args;
use clerestory::check::{Check, CheckError, ProbeCheck, check};
use clerestory::scene::Health;
use clerestory::site::{Site, SiteError};
use std::io::{self, Write};
use std::path::PathBuf;

/// Read everything a site names; tell its health and what work it is fit for.
#[derive(Args, Debug)]
pub(crate) struct CheckArgs {
    /// The site file, or the folder that holds its site.toml
    #[arg(value_hint = clap::ValueHint::AnyPath)]
    site: PathBuf,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

/// Why `check` did not come to an end.
#[derive(Debug, thiserror::Error)]
pub(crate) enum Error {
    #[error(transparent)]
    Site(#[from] SiteError),
    #[error(transparent)]
    Check(#[from] CheckError),
    #[error("cannot write the result: {0}")]
    Write(#[from] io::Error),
}

/// Checks a site and writes the result to `out`.
pub(crate) fn run(args: &CheckArgs, out: &mut impl Write) -> Result<(), Error> {
    let result = check(&Site::load(&args.site)?)?;
    if args.json {
        serde_json::to_writer_pretty(&mut *out, &result).map_err(io::Error::from)?;
        writeln!(out)?;
    } else {
        print(&result, out)?;
    }
    Ok(())
}

fn print(check: &Check, out: &mut impl Write) -> io::Result<()> {
    writeln!(out, "{}", check.site)?;
    sentences(&check.warnings, "", out)?;
    print_model(check, out)?;
    for probe in &check.probes {
        print_probe(probe, out)?;
    }
    writeln!(out, "\nStages")?;
    for stage in &check.stages {
        let verdict = if stage.needed { "needed  " } else { "left out" };
        writeln!(out, "  {:<9} {verdict}  {}", stage.stage, stage.why)?;
    }
    let verdict =
        if check.ok { "Nothing is wrong." } else { "The site can be used; mind the lines marked with “!”." };
    writeln!(out, "\n{verdict}")
}

fn print_model(check: &Check, out: &mut impl Write) -> io::Result<()> {
    let Health { triangles, size_m, bounds, areas, .. } = &check.model;
    let [low, high] = bounds.map(|p| p.map(|v| format!("{v:.2}")).join(", "));
    writeln!(out, "\nModel")?;
    writeln!(
        out,
        "  {triangles} triangles, {:.2} × {:.2} × {:.2} m (east, north, up)",
        size_m[0], size_m[1], size_m[2]
    )?;
    writeln!(out, "  from [{low}] to [{high}] in the model's own axes and units")?;
    let e = &check.edges;
    writeln!(
        out,
        "  {} edges: {} open, {} of three or more triangles, {} inverted",
        e.total, e.open, e.non_manifold, e.inverted
    )?;
    for area in areas.iter().take(12) {
        let name = if area.material.is_empty() { "(no material)" } else { &area.material };
        writeln!(out, "  {:>10.2} m²  {name}", area.area_m2)?;
    }
    if let Some(more) = areas.len().checked_sub(12).filter(|n| *n > 0) {
        writeln!(out, "  and {more} materials more")?;
    }
    sentences(&check.model.warnings, "  ", out)?;
    sentences(&check.edge_warnings, "  ", out)
}

fn print_probe(probe: &ProbeCheck, out: &mut impl Write) -> io::Result<()> {
    let metres = |d: Option<f32>| d.map_or_else(|| "none".to_owned(), |d| format!("{d:.2} m"));
    writeln!(out, "\nProbe {}", probe.name)?;
    writeln!(out, "  floor beneath {}, nearest surface {}", metres(probe.height_m), metres(probe.nearest_m))?;
    for picture in &probe.pictures {
        writeln!(out, "  {} × {} pixels, {}", picture.width, picture.height, picture.file.display())?;
    }
    sentences(&probe.warnings, "  ", out)
}

fn sentences(list: &[String], indent: &str, out: &mut impl Write) -> io::Result<()> {
    list.iter().try_for_each(|sentence| writeln!(out, "{indent}! {sentence}"))
}
