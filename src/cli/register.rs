//! `clerestory register SITE`.

use anyhow::{Context, bail};
use clap::{Args, ValueHint};
use clerestory::atomic_write::folder_of;
use clerestory::register::{self, RegisterSettings, Registered, Rival, Subject, Verdict};
use clerestory::report::{RegisterSheet, register_sheet, register_stem, register_words, write_file, write_sheet};
use clerestory::scene::Scene;
use clerestory::site::edit::{PoseChange, in_site_file, length_decimals, number, quoted, with_poses};
use clerestory::site::{CameraSource, Frame, Pose, Site};
use serde::Serialize;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use super::terminal::model::Model;
use super::terminal::number::between;
use super::terminal::output::{Output, Told, warn};

/// Find where probes and photographs were taken, against the model and each other.
///
/// Says for each picture how far its pose was off, how sure the one found is, and whether another place fits as well;
/// prints blocks to paste, and writes a sheet per picture (register-probe-NAME or register-view-NAME, .svg and .png) into
/// --out. The site file stays as it is; --write makes a copy with the poses found.
#[derive(Args, Debug)]
#[command(after_help = "Examples:\n  \
    clerestory register sites/chapel\n  \
    clerestory register sites/chapel --only west --within 0.5\n  \
    clerestory register sites/chapel --only west --anywhere\n  \
    clerestory register my-site --write my-site/registered.toml\n  \
    clerestory register my-site --write my-site/site.toml --overwrite")]
pub(crate) struct RegisterArgs {
    /// The site file, or the folder that holds its site.toml
    #[arg(value_hint = ValueHint::AnyPath)]
    site: PathBuf,
    /// Only the probe or view of this name, or both; may be given several times
    #[arg(long, value_name = "NAME")]
    only: Vec<String>,
    /// Search so many metres around the place in the site file
    #[arg(long, value_name = "METRES", default_value_t = RegisterSettings::default().within_m, value_parser = between(0.0..=5.0_f32, "metres, from 0 to 5"))]
    within: f32,
    /// Search on all floors, wherever the site file has it; so it is anyway for a probe without a position. Pictures without a
    /// place are taken to stand as upright as the site file has them
    #[arg(long, conflicts_with_all = ["within", "tilt"])]
    anywhere: bool,
    /// Search so many degrees of tilt around the one in the site file; headings are searched all round
    #[arg(long, value_name = "DEGREES", default_value_t = RegisterSettings::default().tilt_deg, value_parser = between(0.0..=45.0_f32, "degrees, from 0 to 45"))]
    tilt: f32,
    /// The probes' pictures of this lighting [default: the site's first]
    #[arg(long, value_name = "NAME")]
    lighting: Option<String>,
    /// Each picture against the model alone, not against what the others saw
    #[arg(long)]
    alone: bool,
    /// Write a copy of the site file with the poses found, beside it
    #[arg(long, value_name = "FILE", value_hint = ValueHint::FilePath)]
    write: Option<PathBuf>,
    /// Let --write take the place of a file that is there, the site file itself included
    #[arg(long, requires = "write")]
    overwrite: bool,
    #[command(flatten)]
    output: Output,
}

/// What `--json` prints.
#[derive(Serialize)]
struct Outcome {
    pictures: Vec<PictureOutcome>,
    written: Option<PathBuf>,
    warnings: Vec<String>,
}

/// One picture.
#[derive(Serialize)]
struct PictureOutcome {
    name: String,
    kind: &'static str,
    verdict: &'static str,
    #[serde(flatten)]
    pose: PoseOut,
    moved_m: Option<f64>,
    turned_deg: Option<f64>,
    sigma_m: Option<f64>,
    sigma_deg: Option<f64>,
    fit: f64,
    fit_given: Option<f64>,
    rival: Option<RivalOutcome>,
    note: String,
    sheet: PathBuf,
    /// Why `--write` leaves this pose, where it does.
    not_written: Option<String>,
}

#[derive(Serialize)]
struct RivalOutcome {
    #[serde(flatten)]
    pose: PoseOut,
    fit: f64,
    best: f64,
    worse: f64,
}

/// A pose in the model's axes and units, angles in degrees as the site file has them.
#[derive(Serialize)]
struct PoseOut {
    position: [f64; 3],
    heading: f64,
    pitch: f64,
    roll: f64,
}

impl PoseOut {
    fn of(frame: &Frame, pose: &Pose) -> Self {
        let [heading, pitch, roll] = frame.bearings(&pose.rotation);
        Self { position: frame.point_out(pose.position).to_array(), heading, pitch, roll }
    }
}

/// Registers a site's pictures and tells `out` about it.
pub(crate) fn run(args: &RegisterArgs, out: &mut impl Write) -> anyhow::Result<()> {
    let site = Site::load_to_register(&args.site)?;
    let target = args.write.as_deref().map(|file| writable(file, &site, args.overwrite)).transpose()?;
    let lighting = lighting(&site, args.lighting.as_deref())?;
    let folder = args.output.folder(&site)?;
    let Model { scene, health, .. } = Model::of(&site, &folder)?;
    if let Some(target) = &target {
        spared(target, &health.files)?;
    }
    let settings = RegisterSettings {
        within_m: args.within,
        tilt_deg: args.tilt,
        together: !args.alone,
        lighting: Some(lighting.clone()),
        only: args.only.clone(),
        anywhere: args.anywhere,
        ..RegisterSettings::default()
    };
    let all = args.output.told.by_steps(|step| register::register(&site, &scene, &settings, step))?;
    let mut pictures = Vec::new();
    for (i, f) in all.iter().enumerate() {
        let sheet = sheet(&site, &scene, f, &lighting, [i + 1, all.len()], &folder)?;
        pictures.push(tell(&site, f, sheet));
    }
    if let Some(target) = &target {
        write(&site, &all, target, &mut pictures)?;
    }
    let warnings = site.warnings.iter().cloned().chain(health.warnings).collect();
    let outcome = Outcome { pictures, written: target, warnings };
    args.output.told.tell(&outcome, out, |out| print(&outcome, &site, &all, out))
}

/// [`Site::lighting`], with the site file in its error.
pub(super) fn lighting(site: &Site, asked: Option<&str>) -> anyhow::Result<String> {
    site.lighting(asked).with_context(|| site.file.display().to_string())
}

/// A site with the poses that registration is sure of, and a line per picture that says what changed: for other verbs, in
/// passing. Where `views` are named, no other views are registered.
pub(crate) fn in_passing(
    site: &Site,
    scene: &Scene,
    lighting: Option<&str>,
    views: &[String],
    told: Told,
) -> anyhow::Result<(Site, Vec<String>)> {
    let mut only = Vec::new();
    if !views.is_empty() {
        only.extend(site.probes.iter().filter(|p| !p.pictures.is_empty()).map(|p| p.name.clone()));
        only.extend(site.views.iter().filter(|v| v.photo.is_some() && views.contains(&v.name)).map(|v| v.name.clone()));
    }
    let lighting = Some(self::lighting(site, lighting)?);
    let settings = RegisterSettings { lighting, only, ..RegisterSettings::default() };
    let mut all = told.by_steps(|step| register::register(site, scene, &settings, step))?;
    // a view may share a probe's name
    let asked = |f: &Registered| match f.subject {
        Subject::Probe(_) => true,
        Subject::View(i) => views.is_empty() || views.contains(&site.views[i].name),
    };
    all.retain(asked);
    let line = |f: &Registered| format!("{} “{}”: {}", f.subject.kind(), f.subject.name(site), register_words(f));
    let lines = all.iter().map(line).collect();
    all.retain(|f| f.verdict == Verdict::Found);
    Ok((register::with_poses(site, &all), lines))
}

/// Draws and writes a picture's sheet; gives the SVG's path.
fn sheet(
    site: &Site,
    scene: &Scene,
    found: &Registered,
    lighting: &str,
    number: [usize; 2],
    folder: &Path,
) -> anyhow::Result<PathBuf> {
    let Some(picture) = register::picture(site, found.subject, lighting)? else {
        bail!("{}: “{}” has no picture any more", site.file.display(), found.subject.name(site));
    };
    let command = super::terminal::command::own_command();
    let about = RegisterSheet { site, scene, found, picture: &picture, command: &command, sheet: number };
    Ok(write_sheet(&register_sheet(&about), folder, &register_stem(site, found.subject))?)
}

/// The file to write, if it may be written: beside the site file, whose paths are relative, and new unless `overwrite`.
fn writable(file: &Path, site: &Site, overwrite: bool) -> anyhow::Result<PathBuf> {
    let folder = |path: &Path| {
        let parent = folder_of(path);
        parent.canonicalize().with_context(|| format!("{}: there is no such folder", parent.display()))
    };
    let home = folder(&site.file)?;
    if file.is_dir() || file.file_name().is_none() {
        bail!("{}: expected a file to write, found a folder. Add a name, such as registered.toml", file.display());
    }
    if folder(file)? != home {
        bail!(
            "{}: the site file's paths are relative to its folder, so a copy elsewhere would not find its files. Write \
             it into {}",
            file.display(),
            folder_of(&site.file).display()
        );
    }
    let others: Vec<PathBuf> = site.files().into_iter().filter(|f| *f != site.file).collect();
    spared(file, &others)?;
    if file.exists() && !overwrite {
        let own = file.canonicalize().ok() == site.file.canonicalize().ok();
        let what = if own { "this is the site file itself" } else { "the file is there already" };
        bail!("{}: {what}. Give another name, or --overwrite to take its place", file.display());
    }
    Ok(file.to_owned())
}

/// Refuses a file that is one of those that the site is made of.
fn spared(file: &Path, others: &[PathBuf]) -> anyhow::Result<()> {
    let Ok(known) = file.canonicalize() else { return Ok(()) };
    if others.iter().any(|f| f.canonicalize().is_ok_and(|f| f == known)) {
        bail!("{}: the site's own model or picture. Give another name", file.display());
    }
    Ok(())
}

/// Writes the copy of the site file with the poses found, and notes which could not be written.
fn write(site: &Site, all: &[Registered], target: &Path, told: &mut [PictureOutcome]) -> anyhow::Result<()> {
    let file = || site.file.display().to_string();
    let text = std::fs::read_to_string(&site.file).with_context(file)?;
    let change =
        |f: &Registered| PoseChange { list: f.subject.kind(), name: f.subject.name(site).to_owned(), pose: f.pose };
    let (sure, unsure): (Vec<usize>, Vec<usize>) = (0..all.len()).partition(|&i| all[i].verdict == Verdict::Found);
    let changes: Vec<PoseChange> = sure.iter().map(|&i| change(&all[i])).collect();
    let edited = with_poses(&text, &site.frame, &changes).with_context(file)?;
    write_file(target, edited.text.as_bytes())?;
    for i in unsure {
        let verdict = told[i].verdict.replace('_', " ");
        told[i].not_written = Some(format!("{verdict}, so the site file stays as it is there"));
    }
    for (k, why) in edited.left {
        told[sure[k]].not_written = Some(why.to_string());
    }
    Ok(())
}

fn tell(site: &Site, f: &Registered, sheet: PathBuf) -> PictureOutcome {
    let verdict = match f.verdict {
        Verdict::Found => "found",
        Verdict::Ambiguous => "ambiguous",
        Verdict::NotFound => "not_found",
    };
    let known = f.verdict != Verdict::NotFound;
    let rival = |r: &Rival| {
        let pose = PoseOut::of(&site.frame, &r.pose);
        RivalOutcome { pose, fit: r.fit, best: r.best, worse: r.worse }
    };
    PictureOutcome {
        name: f.subject.name(site).to_owned(),
        kind: f.subject.kind(),
        verdict,
        pose: PoseOut::of(&site.frame, &f.pose),
        moved_m: f.moved().map(|m| m.0),
        turned_deg: f.moved().map(|m| m.1),
        sigma_m: known.then(|| f.position_m()),
        sigma_deg: known.then(|| f.direction_deg()),
        fit: f.fit,
        fit_given: f.fit_given,
        rival: f.rival.as_ref().map(rival),
        note: register_words(f),
        sheet,
        not_written: None,
    }
}

fn print(outcome: &Outcome, site: &Site, all: &[Registered], out: &mut impl Write) -> io::Result<()> {
    warn("!", &outcome.warnings, out)?;
    for t in &outcome.pictures {
        writeln!(out, "{} “{}”: {}", t.kind, t.name, t.note)?;
        match t.fit_given {
            Some(before) => write!(out, "  fit {before:.2} before, {:.2} now", t.fit)?,
            None => write!(out, "  fit {:.2}", t.fit)?,
        }
        match &t.rival {
            Some(r) if t.verdict == "found" => writeln!(
                out,
                "; the next best place, at {}, fits {:.2} where this one fits {:.2}",
                point(&site.frame, &r.pose),
                r.fit,
                r.best
            )?,
            Some(r) if t.verdict == "ambiguous" => {
                writeln!(out, "; the places are {} and {}", point(&site.frame, &t.pose), point(&site.frame, &r.pose))?
            }
            _ => writeln!(out)?,
        }
        if let Some(why) = &t.not_written {
            writeln!(out, "  ! not written: {why}")?;
        }
        writeln!(out, "  {}", t.sheet.display())?;
    }
    for f in all.iter().filter(|f| f.verdict == Verdict::Found) {
        writeln!(out, "\n{}", block(site, f))?;
    }
    if all.iter().any(|f| f.verdict == Verdict::Found) {
        writeln!(out)?;
    }
    if let Some(file) = &outcome.written {
        writeln!(out, "written: {}", file.display())?;
    }
    Ok(())
}

/// A point in the model's axes and units.
fn point(frame: &Frame, pose: &PoseOut) -> String {
    let decimals = length_decimals(frame).min(2);
    format!("[{}]", pose.position.map(|v| number(v, decimals)).join(", "))
}

/// What to paste into the site file.
fn block(site: &Site, f: &Registered) -> String {
    let (position, [heading, pitch, roll]) = in_site_file(&site.frame, &f.pose);
    let elsewhere = match f.subject {
        Subject::View(i) => !matches!(site.views[i].source, CameraSource::SiteFile),
        Subject::Probe(_) => false,
    };
    let note = if elsewhere { "   # with the lens and the photo of this view" } else { "" };
    format!(
        "[[{}]]{note}\nname = {}\nposition = [{}]\nheading = {heading}\npitch = {pitch}\nroll = {roll}",
        f.subject.kind(),
        quoted(f.subject.name(site)),
        position.join(", ")
    )
}
