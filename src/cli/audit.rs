//! `clerestory audit SITE`.

use anyhow::{Context, bail};
use clap::{Args, ValueHint};
use clerestory::audit::{self, Audit, Finding, Settings};
use clerestory::report::{write_audit_sheets, write_markers};
use clerestory::scene::Scene;
use clerestory::site::Site;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use super::terminal::model::Model;
use super::terminal::number::{ABOVE_ZERO, between};
use super::terminal::output::{Output, Told, warn};

/// Find where the model is wrong, from photographs.
///
/// Compares each view's photograph with the model under the probes' light, and writes a sheet per view (audit-VIEW.svg
/// and .png), findings.json, findings.csv, a mask PNG per finding, and the findings as points for Maya (findings.ma) and
/// CloudCompare (findings-cloudcompare.txt) into --out.
#[derive(Args, Debug)]
#[command(after_help = "Examples:\n  \
    clerestory audit sites/chapel/as_modelled.toml\n  \
    clerestory audit sites/chapel --view apse --json\n  \
    clerestory audit sites/chapel --no-pose --out reports/chapel-audit")]
pub(crate) struct AuditArgs {
    /// The site file, or the folder that holds its site.toml
    #[arg(value_hint = ValueHint::AnyPath)]
    site: PathBuf,
    /// Only this view; may be given several times
    #[arg(long, value_name = "NAME")]
    view: Vec<String>,
    /// The probes' pictures of this lighting: the one the photographs were taken in [default: the site's first]
    #[arg(long, value_name = "NAME")]
    lighting: Option<String>,
    /// Use only the first N probes
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    probes: Option<u32>,
    /// Take the cameras' poses as they are
    #[arg(long)]
    no_pose: bool,
    /// Find the poses of probes and photographs first, as `register` does, and use those that are sure
    #[arg(long)]
    register: bool,
    /// Work at so many pixels along the photographs' longer side at most
    #[arg(long, value_name = "PIXELS", default_value_t = 1024, value_parser = clap::value_parser!(u32).range(64..=8192))]
    longest: u32,
    /// How many findings a photograph of a right model may give; what is less strange is a doubt
    #[arg(long, value_name = "NUMBER", default_value_t = 0.1, value_parser = between(ABOVE_ZERO, "a number above 0"))]
    false_alarms: f64,
    #[command(flatten)]
    output: Output,
}

/// Audits a site and tells `out` about it.
pub(crate) fn run(args: &AuditArgs, out: &mut impl Write) -> anyhow::Result<()> {
    let mut site = Site::load(&args.site)?;
    let file = site.file.display();
    let views = site.views_named(&args.view).with_context(|| file.to_string())?;
    if let Some(view) = views.iter().find(|v| v.photo.is_none() && args.view.contains(&v.name)) {
        bail!("{file}: the view “{}” has no photo to compare with", view.name);
    }
    let lighting = super::register::lighting(&site, args.lighting.as_deref())?;
    let lit = |n: usize| site.probes.iter().take(n).any(|p| p.picture(&lighting).is_some());
    if let Some(n) = args.probes
        && !lit(n as usize)
        && lit(usize::MAX)
    {
        let what = if lighting.is_empty() { String::new() } else { format!(" for the lighting “{lighting}”") };
        bail!("{file}: none of the first {n} probes has a picture{what}: give more with --probes");
    }
    let folder = args.output.folder(&site)?;
    let Model { scene, health, .. } = Model::of(&site, &folder)?;
    let mut found = Vec::new();
    if args.register {
        (site, found) = super::register::in_passing(&site, &scene, Some(&lighting), &args.view, args.output.told)?;
    }
    let settings = Settings {
        longest_px: args.longest,
        refine_pose: !args.no_pose,
        probes: args.probes.map_or(usize::MAX, |n| n as usize),
        ..Settings::allowing(args.false_alarms)
    };
    let said = health.warnings.into_iter().chain(found).collect();
    let audit = audited(&site, &scene, said, Some(&lighting), &args.view, &settings, &folder, args.output.told)?;
    if args.output.told.json {
        out.write_all(audit.json()?.as_bytes())?;
    } else if args.output.told.talks() {
        print(&audit, &folder, out)?;
    }
    Ok(())
}

/// Audits views, or all where none is named, and writes what came of it; `said` are sentences to tell with it.
#[expect(clippy::too_many_arguments, reason = "what the verb and the report have in common")]
pub(super) fn audited(
    site: &Site,
    scene: &Scene,
    said: Vec<String>,
    lighting: Option<&str>,
    views: &[String],
    settings: &Settings,
    folder: &Path,
    told: Told,
) -> anyhow::Result<Audit> {
    let lighting = super::register::lighting(site, lighting)?;
    let mut audit = told.by_steps(|step| audit::audit(site, scene, &lighting, views, settings, step))?;
    audit.warnings.extend(said);
    audit.write(folder)?;
    write_audit_sheets(site, scene, &audit, &super::terminal::command::own_command(), folder)?;
    write_markers(&audit, site, folder)?;
    Ok(audit)
}

fn print(audit: &Audit, folder: &Path, out: &mut impl Write) -> io::Result<()> {
    warn("!", &audit.warnings, out)?;
    for view in &audit.views {
        let s = &view.summary;
        let percent = |v: f64| format!("{:.0} %", 100.0 * v);
        writeln!(
            out,
            "{}: {} ok, {} texture, {} geometry, {} ambiguous, {} untestable",
            s.view,
            percent(s.shares.ok),
            percent(s.shares.texture),
            percent(s.shares.geometry),
            percent(s.shares.ambiguous),
            percent(s.shares.untestable)
        )?;
        let pose = if s.pose.refined {
            format!("camera moved by {:.2} ± {:.2} pixels", s.pose.mean_px, s.pose.residual_px)
        } else {
            "camera as given".to_owned()
        };
        writeln!(out, "  exposure {:+.2} stops, {pose}, noise {:.1} %", s.exposure_ev, 100.0 * s.noise)?;
        let mut reasons: Vec<(&String, &f64)> = s.reasons.iter().collect();
        reasons.sort_by(|a, b| b.1.total_cmp(a.1).then(a.0.cmp(b.0)));
        let reasons: Vec<String> = reasons
            .iter()
            .take(3)
            .map(|(name, share)| format!("{} {}", name.replace('_', " "), percent(**share)))
            .collect();
        if !reasons.is_empty() {
            writeln!(out, "  not tested, mostly: {}", reasons.join(", "))?;
        }
        warn("  !", s.warnings.iter().chain(s.probes.iter().filter_map(|p| p.warning.as_ref())), out)?;
    }
    let line = |out: &mut dyn Write, f: &Finding| {
        let views = std::iter::once(&f.view).chain(&f.also_in).map(String::as_str).collect::<Vec<_>>().join(", ");
        let [x, y, z] = f.position;
        writeln!(
            out,
            "{:>4}  {:<8} {:<10} {:>3.0} %  {}. At [{x:.2}, {y:.2}, {z:.2}], in {views}",
            f.id,
            f.kind.name(),
            f.what.name(),
            100.0 * f.score,
            f.note
        )
    };
    if audit.findings.is_empty() {
        writeln!(out, "nothing found wrong where it could be tested")?;
    }
    audit.findings.iter().try_for_each(|f| line(out, f))?;
    if !audit.doubts.is_empty() {
        writeln!(out, "doubts (something disagrees, and it is not clear what):")?;
        audit.doubts.iter().try_for_each(|f| line(out, f))?;
    }
    writeln!(out, "{}", folder.join("findings.json").display())
}
