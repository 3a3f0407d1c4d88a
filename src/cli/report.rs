//! `clerestory report SITE`.

use anyhow::Context;
use clap::{Args, ValueHint};
use clerestory::csv;
use clerestory::panorama::{self, Exposure, Picture, write_png};
use clerestory::report::page::{Archive, Audit, Finding, Run, Study, ViewPictures, page};
use clerestory::report::{Manifest, Mark, fingerprints, marked, pdf, write_file};
use clerestory::scene::{self, Health};
use clerestory::site::{Site, View};
use serde::de::DeserializeOwned;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::time::{Instant, SystemTime};

use super::terminal::command::{command, in_words, own_command};

/// Do all that a site allows and gather it in one folder with a page, to read and to archive.
///
/// Runs check, plan, render, audit and study as far as the site has what they need, and writes index.html and
/// manifest.json (every input and output with its SHA-256, the commands, the times) beside their files. The page needs
/// no network.
#[derive(Args, Debug)]
#[command(after_help = "Examples:\n  \
    clerestory report sites/chapel\n  \
    clerestory report sites/chapel --out archive/chapel-2026 --budget 300\n  \
    clerestory report sites/chapel --register\n  \
    clerestory report sites/chapel --without study,plan")]
pub(crate) struct ReportArgs {
    /// The site file, or the folder that holds its site.toml
    #[arg(value_hint = ValueHint::AnyPath)]
    site: PathBuf,
    /// Folder for the report [default: reports/SITE]
    #[arg(long, value_name = "DIR", value_hint = ValueHint::DirPath)]
    out: Option<PathBuf>,
    /// Seconds for the study of error against run time
    #[arg(long, value_name = "SECONDS", default_value_t = 40, value_parser = clap::value_parser!(u32).range(1..))]
    budget: u32,
    /// Leave these parts out: plan, render, audit, study
    #[arg(long, value_name = "PART,…", value_delimiter = ',', value_parser = ["plan", "render", "audit", "study"])]
    without: Vec<String>,
    /// Find the poses of probes and photographs first, as `register` does, and render and audit with those that are sure
    #[arg(long)]
    register: bool,
    /// Make viewer.html too, a page to walk through the relit model in, and link it
    #[arg(long)]
    viewer: bool,
    /// Print the manifest as JSON
    #[arg(long)]
    json: bool,
    /// Print nothing but errors; with --json, the JSON alone
    #[arg(short, long)]
    quiet: bool,
}

/// Makes the report and tells `out` where it is.
pub(crate) fn run(args: &ReportArgs, out: &mut impl Write) -> anyhow::Result<()> {
    let site = Site::load(&args.site)?;
    let folder = super::terminal::output::folder(args.out.as_deref(), &site)?;
    let parts = parts(&site, args);
    let bar = super::terminal::progress::bar(
        !args.quiet && !args.json,
        "{spinner} {msg:12} {wide_bar} {pos} of {len}  {elapsed}",
    );
    bar.set_length(1 + parts.iter().filter(|(_, left_out, _)| left_out.is_none()).count() as u64);

    let mut archive = Archive {
        site: site.name.clone(),
        project: site.project.clone(),
        software: concat!(env!("CARGO_PKG_NAME"), " ", env!("CARGO_PKG_VERSION")).into(),
        ..Archive::default()
    };
    let shown = |path: &Path| path.to_string_lossy().into_owned();
    let (file, dir) = (shown(&args.site), shown(&folder));
    for (verb, left_out, options) in parts {
        let mut line = vec![verb.to_owned(), file.clone()];
        if verb != "check" {
            line.extend(["--out".into(), dir.clone()]);
        }
        line.extend(options);
        let mut run = Run { verb: verb.into(), command: command(&line), ..Run::default() };
        if let Some(why) = left_out {
            run.note = why;
            archive.runs.push(run);
            continue;
        }
        bar.set_message(format!("{verb} …"));
        if verb == "view" {
            // what came before is shown in it
            let shown = |option: &str, file: &str| [option.to_owned(), shown(&folder.join(file))];
            line.extend(archive.audit.iter().flat_map(|_| shown("--findings", "")));
            line.extend(archive.plan.iter().flat_map(|_| shown("--plan", "plan.json")));
            run.command = command(&line);
        }
        line.push("--json".into());
        let start = Instant::now();
        let printed = super::run_line(&line);
        run.seconds = Some(start.elapsed().as_secs_f64());
        match printed {
            Ok(json) => keep(verb, &json, &folder, &mut archive)?,
            // a model that cannot be read stops everything; a floor that is not found only the plan
            Err(e) if verb == "check" => return Err(e),
            Err(e) => run.note = in_words(&e),
        }
        archive.runs.push(run);
        bar.inc(1);
    }

    bar.set_message("page …");
    archive.views = pictures(&site, &archive, &folder)?;
    let mut health = Health::default();
    scene::load(&site, &mut health)?;
    let home = site.file.parent().unwrap_or(Path::new("")).to_owned();
    let mut inputs = site.files();
    inputs.extend(health.files);
    inputs.sort();
    inputs.dedup();
    archive.inputs = fingerprints(&inputs, &home)?;
    archive.sheets_pdf = sheets_together(&archive, &folder)?;
    write_file(&folder.join("index.html"), page(&archive).as_bytes())?;

    let manifest = Manifest {
        software: env!("CARGO_PKG_NAME"),
        version: env!("CARGO_PKG_VERSION"),
        site: archive.site.clone(),
        made: humantime::format_rfc3339_seconds(SystemTime::now()).to_string(),
        command: own_command(),
        runs: archive.runs.clone(),
        inputs: archive.inputs.clone(),
        outputs: fingerprints(&files_in(&folder)?, &folder)?,
    };
    let mut json = serde_json::to_vec_pretty(&manifest)?;
    json.push(b'\n');
    write_file(&folder.join("manifest.json"), &json)?;
    bar.finish_and_clear();
    if args.json {
        out.write_all(&json)?;
    } else if !args.quiet {
        for run in &archive.runs {
            match (run.seconds, run.note.as_str()) {
                (None, why) => writeln!(out, "{:<7} left out: {why}", run.verb)?,
                (Some(s), "") => writeln!(out, "{:<7} {s:.1} s", run.verb)?,
                (Some(_), why) => writeln!(out, "{:<7} came to no end: {why}", run.verb)?,
            }
        }
        writeln!(out, "{}", folder.join("index.html").display())?;
    }
    Ok(())
}

/// The verbs in order: why each is left out, if it is, and its options.
fn parts(site: &Site, args: &ReportArgs) -> Vec<(&'static str, Option<String>, Vec<String>)> {
    let words = |list: &[&str]| list.iter().map(|w| (*w).to_owned()).collect::<Vec<_>>();
    let photos = site.views.iter().any(|v| v.photo.is_some());
    let (no_probe, no_view) = (site.probes.is_empty(), site.views.is_empty());
    let why_not = |verb: &str| -> Option<&str> {
        if args.without.iter().any(|w| w == verb) {
            return Some("not asked for");
        }
        match verb {
            "render" | "audit" | "study" | "view" if no_probe => Some("the site has no probe"),
            "render" | "audit" | "study" if no_view => Some("the site has no view"),
            "audit" if !photos => Some("the site has no photograph"),
            _ => None,
        }
    };
    let register: &[&str] = if args.register { &["--register"] } else { &[] };
    let compare: &[&str] = if photos { &["--compare"] } else { &[] };
    let budget = args.budget.to_string();
    let part = |verb, options: &[&str]| (verb, why_not(verb).map(str::to_owned), words(options));
    let mut all = vec![
        part("check", &[]),
        part("plan", &[]),
        part("render", &[register, compare].concat()),
        part("audit", register),
        part("study", &["--budget", &budget]),
    ];
    if args.viewer {
        all.push(part("view", &[]));
    }
    all
}

/// Takes what a verb printed or wrote into the archive.
fn keep(verb: &str, json: &[u8], folder: &Path, archive: &mut Archive) -> anyhow::Result<()> {
    match verb {
        "check" => {
            write_file(&folder.join("check.json"), json)?;
            archive.check = Some(serde_json::from_slice(json)?);
        }
        "render" => {
            write_file(&folder.join("render.json"), json)?;
            archive.render = Some(serde_json::from_slice(json)?);
        }
        "view" => archive.viewer = Some("viewer.html".to_owned()),
        "plan" => archive.plan = Some(read_json(&folder.join("plan.json"))?),
        "audit" => archive.audit = Some(read_json(&folder.join("findings.json"))?),
        "study" => {
            archive.study = Some(Study {
                table: csv::rows(&std::fs::read_to_string(folder.join("study.csv"))?),
                summary: serde_json::from_slice(json)?,
            })
        }
        _ => {}
    }
    Ok(())
}

fn read_json<T: DeserializeOwned>(path: &Path) -> anyhow::Result<T> {
    let bytes = std::fs::read(path).with_context(|| path.display().to_string())?;
    serde_json::from_slice(&bytes).with_context(|| path.display().to_string())
}

/// Writes each rendered view and its photograph at one exposure, so that they can lie over each other.
fn pictures(site: &Site, archive: &Archive, folder: &Path) -> anyhow::Result<Vec<ViewPictures>> {
    let mut all = Vec::new();
    for rendered in archive.render.iter().flat_map(|r| &r.views) {
        let Some(view) = site.views.iter().find(|v| v.name == rendered.name) else { continue };
        let relit = panorama::read(&rendered.file)?;
        let photo = view.photo.as_deref().map(panorama::read).transpose()?;
        let photo = photo.filter(|p| (p.width, p.height) == (relit.width, relit.height));
        let exposure = Exposure::of(photo.as_ref().unwrap_or(&relit));
        let name = &view.name;
        let mut pictures = ViewPictures {
            name: name.clone(),
            size: [relit.width, relit.height],
            render: format!("view-{name}-relit.png"),
            ..ViewPictures::default()
        };
        write_png(&folder.join(&pictures.render), &relit, exposure)?;
        if let Some(photo) = photo {
            let file = format!("view-{name}-photo.png");
            write_png(&folder.join(&file), &photo, exposure)?;
            if let Some(audit) = &archive.audit {
                pictures.findings = findings(view, audit, &photo, exposure, folder)?;
            }
            pictures.photo = Some(file);
        }
        let sheet = format!("audit-{name}");
        pictures.sheet = folder.join(format!("{sheet}.svg")).is_file().then_some(sheet);
        all.push(pictures);
    }
    Ok(all)
}

/// The photograph with this view's findings marked; `None` where there are none.
fn findings(
    view: &View,
    audit: &Audit,
    photo: &Picture,
    exposure: Exposure,
    folder: &Path,
) -> anyhow::Result<Option<String>> {
    let mut marks = Vec::new();
    let doubt = |f: &Finding| Finding { kind: "ambiguous".into(), ..f.clone() };
    let all = audit.findings.iter().cloned().chain(audit.doubts.iter().map(doubt));
    for finding in all.filter(|f| f.view == view.name) {
        let path = folder.join(&finding.mask);
        let mask = image::open(&path).with_context(|| path.display().to_string())?.to_luma8();
        marks.push(Mark { id: finding.id, kind: finding.kind, mask, bbox: finding.bbox });
    }
    if marks.is_empty() {
        return Ok(None);
    }
    let shown = |x: u32, y: u32| {
        let p = exposure.show(photo.pixels[y as usize * photo.width + x as usize]);
        image::Rgb((p * 255.0 + 0.5).to_array().map(|v| v as u8))
    };
    let shown = image::RgbImage::from_fn(photo.width as u32, photo.height as u32, shown);
    let file = format!("view-{}-findings.png", view.name);
    write_file(&folder.join(&file), &marked(&shown, &marks)?)?;
    Ok(Some(file))
}

/// Writes all sheets of a report as one PDF file, `report.pdf`: floors, views, the study; gives whether there are any.
fn sheets_together(archive: &Archive, folder: &Path) -> anyhow::Result<bool> {
    let floors = archive.plan.iter().flat_map(|p| &p.floors).flat_map(|f| f.sheets.iter().cloned());
    let views = archive.views.iter().filter_map(|v| v.sheet.clone());
    let study = archive.study.iter().map(|_| "study".to_owned());
    let mut texts = Vec::new();
    for stem in floors.chain(views).chain(study) {
        let file = folder.join(stem + ".svg");
        texts.push(std::fs::read_to_string(&file).with_context(|| file.display().to_string())?);
    }
    if texts.is_empty() {
        return Ok(false);
    }
    let texts: Vec<&str> = texts.iter().map(String::as_str).collect();
    write_file(&folder.join("report.pdf"), &pdf(&archive.site, &texts)?)?;
    Ok(true)
}

/// All files in a folder but the manifest, sorted.
fn files_in(folder: &Path) -> io::Result<Vec<PathBuf>> {
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder)? {
        let path = entry?.path();
        if path.is_file() && path.file_name().is_some_and(|n| n != "manifest.json") {
            files.push(path);
        }
    }
    files.sort();
    Ok(files)
}
