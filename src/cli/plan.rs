//! `clerestory plan SITE`.

use anyhow::anyhow;
use clap::{Args, ValueHint};
use clerestory::plan::export::tables::{self, Outward};
use clerestory::plan::stations::result::FloorPlan;
use clerestory::plan::stations::run::{Options, plan};
use clerestory::report::write_plan;
use clerestory::site::{Pictures, Site};
use std::io::{self, Write};
use std::path::PathBuf;

use super::terminal::model::Model;
use super::terminal::output::Output;

/// Plan where to put the tripod: floors, stations, what they see and what nothing will.
///
/// Writes plan-FLOOR and coverage-FLOOR (SVG and PNG, A4), plan-FLOOR.dxf for CAD programs, plan.json, plan.csv and coverage.ply into --out, and prints the
/// stations as [[probe]] blocks to paste into the site file. Limits come from the site file's [plan]. Probes that the
/// site has already are counted: only what is missing is planned.
#[derive(Args, Debug)]
#[command(after_help = "Examples:\n  \
    clerestory plan sites/chapel\n  \
    clerestory plan sites/chapel --fresh --out before-the-visit\n  \
    clerestory plan sites/chapel --floor ground --no-surface")]
pub(crate) struct PlanArgs {
    /// The site file, or the folder that holds its site.toml
    #[arg(value_hint = ValueHint::AnyPath)]
    site: PathBuf,
    /// Plan as if no probe had been taken yet
    #[arg(long)]
    fresh: bool,
    /// Only this floor (ground, first, …); may be given several times
    #[arg(long, value_name = "NAME")]
    floor: Vec<String>,
    /// Count small parts too that cannot be walked to and are open to what is not their floor
    #[arg(long)]
    all_parts: bool,
    /// Leave the check by rays on the model's surface out, and coverage.ply
    #[arg(long)]
    no_surface: bool,
    #[command(flatten)]
    output: Output,
}

/// Plans a site and tells `out` what came of it.
pub(crate) fn run(args: &PlanArgs, out: &mut impl Write) -> anyhow::Result<()> {
    let site = Site::load_with(&args.site, Pictures::MayBeMissing)?;
    let folder = args.output.folder(&site)?;
    let spinner = args.output.told.bar("{spinner} {msg}");
    spinner.set_message("reading the model");
    let Model { scene, health, .. } = Model::of(&site, &folder)?;
    spinner.set_message("planning");
    let patches = if args.no_surface { 0 } else { Options::default().patches };
    let options = Options { fresh: args.fresh, floors: args.floor.clone(), patches, all_parts: args.all_parts };
    let mut warnings = site.warnings.clone();
    for probe in site.probes.iter().filter(|_| !args.fresh) {
        if let Some(missing) = probe.pictures.iter().find(|p| !p.path.exists()) {
            warnings.push(format!(
                "Probe “{}” counts as taken, but its picture {} is not there yet; --fresh plans without it.",
                probe.name,
                missing.path.display()
            ));
        }
    }
    let mut plan = plan(&site, &scene, &options).map_err(|e| anyhow!("{}: {e}", site.file.display()))?;
    plan.warnings.splice(0..0, warnings.into_iter().chain(health.warnings));
    spinner.set_message("drawing");
    let (json, files) = write_plan(&site, &scene, &plan, &folder)?;
    spinner.finish_and_clear();
    args.output.told.tell(&json, out, |out| {
        let outward = Outward::of(&site, &scene);
        for warning in &plan.warnings {
            writeln!(out, "! {warning}")?;
        }
        plan.floors.iter().try_for_each(|floor| print(floor, &outward, out))?;
        writeln!(out, "\n{}", tables::probe_blocks(&plan, &outward).trim_end())?;
        writeln!(out, "\n# wrote {} into {}", files.join(", "), folder.display())
    })
}

/// The result in lines that a site file takes for comments.
fn print(plan: &FloorPlan, outward: &Outward, out: &mut impl Write) -> io::Result<()> {
    let stations = plan.stations.len();
    writeln!(
        out,
        "\n# {}, elevation {}: {:.1} m² open at probe height, {:.1} m² where a tripod can stand",
        plan.floor.name,
        outward.elevation(plan.floor.elevation),
        plan.area_m2,
        plan.floor.standable.area()
    )?;
    if !plan.present.is_empty() {
        let share = 100.0 * plan.present_fraction;
        writeln!(out, "#   {} taken already see {share:.1} %", tables::counted(plan.present.len(), "probe"))?;
    }
    let more = stations.saturating_sub(plan.needed);
    let why = if more > 0 { format!(" ({more} of them for the surface in 3D and for overlap)") } else { String::new() };
    writeln!(
        out,
        "#   {}{why}; at least {} needed in plan, for the floor cut into {} places and {} points",
        tables::counted(stations, "station"),
        plan.lower_bound,
        plan.discrete[0],
        plan.discrete[1]
    )?;
    let curve: Vec<String> = plan.curve.iter().map(|v| format!("{:.1}", 100.0 * v)).collect();
    if !curve.is_empty() {
        writeln!(out, "#   seen after 1, 2, … stations: {} %", curve.join(", "))?;
    }
    writeln!(
        out,
        "#   floor seen {:.1} %, walls at probe height {:.1} %",
        100.0 * plan.covered_fraction(),
        100.0 * plan.wall_fraction
    )?;
    if let Some(s) = plan.surface {
        writeln!(
            out,
            "#   surface seen in 3D {:.1} % of {:.0} m² that can be seen from here",
            100.0 * s.covered_fraction,
            s.reachable_m2
        )?;
    }
    writeln!(out, "#   seen from no allowed place: {:.1} m² of floor", plan.unreachable_m2)?;
    if plan.walk.len() > 1 {
        let names: Vec<&str> = plan.walk.iter().map(|i| plan.stations[*i].name.as_str()).collect();
        writeln!(out, "#   shortest walk {:.0} m: {}", plan.walk_m, names.join(", "))?;
    }
    Ok(())
}
