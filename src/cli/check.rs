//! `clerestory check SITE`.

use clap::Args;
use clerestory::check::{Check, ProbeCheck, ViewCheck, check};
use clerestory::scene::Health;
use clerestory::site::Site;
use std::io::{self, Write};
use std::path::PathBuf;

use super::terminal::output::{Told, warn};

/// Read everything a site names; tell its health and what work it is fit for.
#[derive(Args, Debug)]
pub(crate) struct CheckArgs {
    /// The site file, or the folder that holds its site.toml
    #[arg(value_hint = clap::ValueHint::AnyPath)]
    site: PathBuf,
    #[command(flatten)]
    told: Told,
}

/// Checks a site and writes the result to `out`.
pub(crate) fn run(args: &CheckArgs, out: &mut impl Write) -> anyhow::Result<()> {
    let result = check(&Site::load(&args.site)?)?;
    args.told.tell(&result, out, |out| print(&result, out))
}

fn print(check: &Check, out: &mut impl Write) -> io::Result<()> {
    writeln!(out, "{}", check.site)?;
    warn("!", check.causes.iter().map(|cause| &cause.sentence).chain(&check.warnings), out)?;
    print_model(check, out)?;
    for probe in &check.probes {
        print_probe(probe, out)?;
    }
    for view in &check.views {
        print_view(view, out)?;
    }
    writeln!(out, "\nStages")?;
    for stage in &check.stages {
        let verdict = if stage.needed { "needed  " } else { "left out" };
        let saves = stage.saves.map_or_else(String::new, |s| {
            format!("; saves {:.2} s and {:.1} MiB", s.seconds, s.bytes as f64 / f64::from(1 << 20))
        });
        writeln!(out, "  {:<15} {verdict}  {}{saves}", stage.stage, stage.why)?;
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
    warn("  !", check.model.warnings.iter().chain(&check.edge_warnings), out)
}

fn print_probe(probe: &ProbeCheck, out: &mut impl Write) -> io::Result<()> {
    let metres = |d: Option<f32>| d.map_or_else(|| "none".to_owned(), |d| format!("{d:.2} m"));
    writeln!(out, "\nProbe {}", probe.name)?;
    writeln!(out, "  floor beneath {}, nearest surface {}", metres(probe.height_m), metres(probe.nearest_m))?;
    for picture in &probe.pictures {
        let exposure = exposure(picture.exposure_value);
        let frames = if picture.frames > 1 { format!(", the first of {}", picture.frames) } else { String::new() };
        writeln!(out, "  {} × {} pixels, {}{frames}{exposure}", picture.width, picture.height, picture.file.display())?;
    }
    warn("  !", &probe.warnings, out)
}

fn print_view(view: &ViewCheck, out: &mut impl Write) -> io::Result<()> {
    let list = |v: [f64; 3], digits: usize| v.map(|n| format!("{n:.digits$}")).join(", ");
    // no −0.00
    let [heading, pitch, roll] = view.bearings_deg.map(|v| (100.0 * v).round() / 100.0 + 0.0);
    writeln!(out, "\nView {} ({}), {} × {} pixels", view.name, view.source, view.size[0], view.size[1])?;
    writeln!(
        out,
        "  at [{}] in the model's own axes and units, heading {heading:.2}°, pitch {pitch:.2}°, roll {roll:.2}°",
        list(view.position, 3)
    )?;
    writeln!(out, "  field of view {:.2}° high, focal length {:.1} pixels", view.fov_y_deg, view.focal_px)?;
    if let Some(u) = &view.uncertainty {
        let focal = u.focal_px.map_or(String::new(), |f| format!(", focal length ± {f:.1} pixels"));
        writeln!(
            out,
            "  uncertain by ± {:.3} m, ± {:.3}°{focal} (one standard deviation)",
            u.position_m, u.direction_deg
        )?;
    }
    if let Some(rms) = view.rms_px {
        let each = view.residuals_px.iter().map(|r| format!("{r:.2}")).collect::<Vec<_>>().join(", ");
        writeln!(out, "  its matches are off by {each} pixels, {rms:.2} in the root mean square")?;
    }
    if let Some(photo) = &view.photograph {
        let percent = |share: f64| format!("{:.1} %", 100.0 * share);
        write!(out, "  photograph {}: {} usable", photo.file.display(), percent(photo.usable))?;
        for (share, what) in [(photo.clipped, "clipped"), (photo.dark, "too dark"), (photo.masked, "masked")] {
            if share > 0.0 {
                write!(out, ", {} {what}", percent(share))?;
            }
        }
        let camera = photo.camera.as_ref().map_or(String::new(), |c| format!(" ({c})"));
        writeln!(out, "{}{camera}", exposure(photo.exposure_value))?;
    }
    warn("  !", &view.warnings, out)
}

/// What EXIF tells of a picture's exposure.
fn exposure(value: Option<f64>) -> String {
    value.map_or_else(String::new, |v| format!(", exposure value {v:.1} by EXIF"))
}
