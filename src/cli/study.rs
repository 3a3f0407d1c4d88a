//! `clerestory study SITE`.

use clap::{Args, ValueHint};
use clerestory::report::write_study;
use clerestory::site::Site;
use clerestory::study::{self, Metric, Options, Outside, Progress, Study, Summary, order_said};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use super::terminal::command::{as_argument, command, own_command};
use super::terminal::model::Model;
use super::terminal::number::{ABOVE_ZERO, between};
use super::terminal::output::{Output, warn};
use super::terminal::visible::visible;

/// Weigh error against run time: image-based shooting over its settings beside path tracing.
///
/// Writes study.svg, study.png, study.csv and study.json into --out. A study that the budget cuts short goes on when the
/// same command is given again.
#[derive(Args, Debug)]
#[command(after_help = "Examples:\n  \
    clerestory study sites/chapel\n  \
    clerestory study sites/chapel --view apse --budget 60\n  \
    clerestory study big-site --share 0.0625 --budget 1800   # measure in tiles: path tracing gets further\n  \
    clerestory study big-site --outside other-program.json")]
pub(crate) struct StudyArgs {
    /// The site file, or the folder that holds its site.toml
    #[arg(value_hint = ValueHint::AnyPath)]
    site: PathBuf,
    /// Only this view; may be given several times
    #[arg(long, value_name = "NAME")]
    view: Vec<String>,
    /// The probes' pictures of this lighting [default: the site's first]
    #[arg(long, value_name = "NAME")]
    lighting: Option<String>,
    /// Begin nothing that would probably end later; give the command again to go on
    #[arg(long, value_name = "SECONDS", default_value_t = Options::default().budget_s, value_parser = between(ABOVE_ZERO, "a number of seconds, more than 0"))]
    budget: f64,
    /// Measure error in tiles that make up this share of each picture; path tracing traces only these
    #[arg(long, value_name = "SHARE", default_value_t = Options::default().share, value_parser = between(f64::MIN_POSITIVE..=1.0, "a number above 0 and up to 1"))]
    share: f64,
    /// Make a reference by path tracing even where there are photographs
    #[arg(long)]
    reference: bool,
    /// Samples a pixel of the reference
    #[arg(long, value_name = "N", default_value_t = Options::default().reference_samples, value_parser = clap::value_parser!(u32).range(2..=1 << 20))]
    reference_samples: u32,
    /// The most samples a pixel that path tracing is tried with
    #[arg(long, value_name = "N", default_value_t = Options::default().most_samples, value_parser = clap::value_parser!(u32).range(1..=1 << 20))]
    most_samples: u32,
    /// Figures of other programs to draw beside: JSON rows of camera, spp, wall_s, cpu_s, rmse, relmse_trim, flip, and
    /// oidn_s and oidn for a denoiser
    #[arg(long, value_name = "FILE", value_hint = ValueHint::FilePath)]
    outside: Option<PathBuf>,
    /// Another seed, other noise
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u64,
    /// Start anew where a study has been begun
    #[arg(long)]
    fresh: bool,
    #[command(flatten)]
    output: Output,
}

/// Studies a site and tells `out` what came of it.
pub(crate) fn run(args: &StudyArgs, out: &mut impl Write) -> anyhow::Result<()> {
    let site = Site::load(&args.site)?;
    let folder = args.output.folder(&site)?;
    let names: Vec<String> = site.views_named(&args.view)?.iter().map(|v| v.name.clone()).collect();
    let outside = match &args.outside {
        Some(path) => study::read_outside(path, &names)?,
        None => Vec::new(),
    };
    let options = Options {
        lighting: args.lighting.clone(),
        views: args.view.clone(),
        budget_s: args.budget,
        share: args.share,
        reference: args.reference,
        reference_samples: args.reference_samples,
        most_samples: args.most_samples,
        seed: args.seed,
        fresh: args.fresh,
    };
    let bar = args.output.told.bar("{msg:34} {wide_bar} {pos}/{len}  {elapsed}");
    let tell = |p: &Progress| {
        bar.set_length(p.planned as u64);
        bar.set_position(p.done as u64);
        bar.set_message(visible(&p.doing).into_owned());
    };
    let (study, summary) = studied(&site, &args.site, &options, &outside, &folder, &tell)?;
    bar.finish_and_clear();
    args.output.told.tell(&summary, out, |out| {
        print(&study, &summary, out)?;
        writeln!(out, "{}", folder.join("study.svg").display())
    })
}

/// Studies a site and writes what came of it; `named` is the site as a person names it.
pub(super) fn studied(
    site: &Site,
    named: &Path,
    options: &Options,
    outside: &[Outside],
    folder: &Path,
    tell: &(dyn Fn(&Progress) + Sync),
) -> anyhow::Result<(Study, Summary)> {
    let lighting = options.lighting.iter().flat_map(|name| ["--lighting".to_owned(), name.clone()]);
    let render: Vec<String> = ["render".to_owned(), as_argument(named)].into_iter().chain(lighting).collect();
    let Model { scene, health, read } = Model::of(site, folder)?;
    let mut study = study::study(site, (&scene, &health.files, read), options, folder, tell)?;
    let summary = study::summary(&study, outside, &command(&render));
    write_study(site, &own_command(), &study, &summary, outside, folder)?;
    study.summary = Some(summary.clone());
    study.save(&folder.join("study.json"))?;
    Ok((study, summary))
}

fn print(study: &Study, summary: &Summary, out: &mut impl Write) -> io::Result<()> {
    warn("!", &study.notes, out)?;
    if let (Some(rmse), Some(flip)) = (study.truth.noise_rmse, study.truth.noise_flip) {
        writeln!(out, "the reference's own noise: RMSE {rmse:.3e} (taken off), FLIP between its halves {flip:.4}")?;
    }
    writeln!(
        out,
        "{:<13} {:<22} {:>9} {:>9} {:>9} {:>8} {:>8} {:>8} {:>17} {:>6}",
        "method", "setting", "set-up s", "frame s", "frame cpu", "RMSE", "relMSE", "FLIP", "95 %", "SSIM"
    )?;
    for r in &summary.rows {
        let flip = format!("{:.4} – {:.4}", r.flip.low, r.flip.high);
        writeln!(
            out,
            "{:<13} {:<22} {:>9.3} {:>9.4} {:>9.4} {:>8.4} {:>8.4} {:>8.4} {flip:>17} {:>6.3}{}",
            r.setting.method.name(),
            r.label,
            r.setup.wall_s,
            r.frame.wall_s,
            r.frame.cpu_s,
            r.rmse.value,
            r.relmse.value,
            r.flip.value,
            r.ssim.value,
            if r.pareto { " *" } else { "" }
        )?;
    }
    for s in &summary.speed_ups {
        writeln!(out, "{}", s.sentence())?;
    }
    for e in summary.equal_time.iter().filter(|e| e.metric == Metric::Flip) {
        writeln!(out, "{}", e.sentence())?;
    }
    if let Some(order) = order_said(&summary.probe_order) {
        writeln!(out, "{order}")?;
    }
    for c in &summary.convergence {
        let tail = c.tail.map_or_else(String::new, |t| format!("; what is left to gain falls with order {t:.2}"));
        writeln!(
            out,
            "order of {} in {} of {}: {:.2} (95 %: {:.2} to {:.2}, {} points{tail})",
            c.metric.name(),
            c.parameter.name(),
            c.method.name(),
            c.order.value,
            c.order.low,
            c.order.high,
            c.points
        )?;
    }
    for loss in &summary.losses {
        writeln!(out, "loses: {loss}")?;
    }
    if !study.pending.is_empty() {
        writeln!(out, "left undone by the budget (the same command goes on): {}", study.pending.join("; "))?;
    }
    if let Some(r) = &summary.recommended {
        writeln!(out, "{}\n\n    {}\n", r.why, r.snippet)?;
    }
    Ok(())
}
