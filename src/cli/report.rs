//! `clerestory report SITE`.

use anyhow::Context;
use clap::{Args, ValueEnum, ValueHint};
use clerestory::audit;
use clerestory::check::check;
use clerestory::panorama::{self, Exposure, write_png};
use clerestory::plan::{self, stations::run::plan};
use clerestory::report::page::{Archive, ViewPictures, page};
use clerestory::report::{
    Manifest, Run, fingerprints, marked, pdf, remove_earlier, write_file, write_json, write_plan,
};
use clerestory::site::Site;
use clerestory::study;
use clerestory::viewer::Extras;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::time::{Instant, SystemTime};

use super::audit::audited;
use super::bake::BakeHow;
use super::register::in_passing;
use super::render::{RenderArgs, rendered};
use super::study::studied;
use super::terminal::command::{as_argument, command, in_words, own_command};
use super::terminal::model::Model;
use super::terminal::output::{Output, Told, apart};
use super::view::viewed;

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
    /// Seconds for the study of error against run time
    #[arg(long, value_name = "SECONDS", default_value_t = 40, value_parser = clap::value_parser!(u32).range(1..))]
    budget: u32,
    /// Leave these parts out: plan, render, audit, study
    #[arg(long, value_name = "PART,…", value_delimiter = ',', value_enum)]
    without: Vec<Part>,
    /// Find the poses of probes and photographs first, as `register` does, and render and audit with those that are sure
    #[arg(long)]
    register: bool,
    /// Make viewer.html too, a page to walk through the relit model in, and link it
    #[arg(long)]
    viewer: bool,
    #[command(flatten)]
    output: Output,
}

/// A part of the report: what a verb does.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Part {
    #[value(skip)]
    Check,
    Plan,
    Render,
    Audit,
    Study,
    #[value(skip)]
    View,
}

impl Part {
    /// The parts in order; each may show what those before it found.
    const ALL: [Self; 6] = [Self::Check, Self::Plan, Self::Render, Self::Audit, Self::Study, Self::View];

    /// The verb that does the same by hand.
    fn verb(self) -> &'static str {
        match self {
            Self::Check => "check",
            Self::Plan => "plan",
            Self::Render => "render",
            Self::Audit => "audit",
            Self::Study => "study",
            Self::View => "view",
        }
    }

    /// Whether a file of this name is one that it writes; `View::file_stem` keeps views clear of the others' names.
    fn writes(self, file: &str, site: &Site) -> bool {
        let begins = |names: &[&str]| names.iter().any(|name| file.starts_with(name));
        match self {
            Self::Check => file == "check.json",
            Self::Plan => begins(&["plan.", "plan-", "coverage.", "coverage-"]),
            Self::Render => {
                let picture = |stem: &str| site.views.iter().any(|v| v.file_stem() == stem);
                begins(&["render.", "view-"]) || file.rsplit_once('.').is_some_and(|(stem, _)| picture(stem))
            }
            Self::Audit => begins(&["findings.", "findings-cloudcompare.txt", "audit-", "mask-"]),
            Self::Study => begins(&["study.", "study-"]),
            Self::View => file == "viewer.html",
        }
    }

    /// Why it is left out, if it is.
    fn left_out(self, site: &Site, args: &ReportArgs) -> Option<&'static str> {
        if args.without.contains(&self) {
            return Some("not asked for");
        }
        match self {
            Self::Render | Self::Audit | Self::Study | Self::View if site.probes.is_empty() => {
                Some("the site has no probe")
            }
            Self::Render | Self::Audit | Self::Study if site.views.is_empty() => Some("the site has no view"),
            Self::Audit if !has_photograph(site) => Some("the site has no photograph"),
            _ => None,
        }
    }
}

fn has_photograph(site: &Site) -> bool {
    site.views.iter().any(|v| v.photo.is_some())
}

/// Makes the report and tells `out` where it is.
pub(crate) fn run(args: &ReportArgs, out: &mut impl Write) -> anyhow::Result<()> {
    let site = Site::load(&args.site)?;
    let folder = args.output.folder(&site)?;
    let parts = || Part::ALL.into_iter().filter(|p| *p != Part::View || args.viewer);
    let bar = args.output.told.bar("{spinner} {msg:12} {wide_bar} {pos} of {len}  {elapsed}");
    bar.set_length(1 + parts().filter(|p| p.left_out(&site, args).is_none()).count() as u64);

    let mut archive = Archive { site: site.name.clone(), project: site.project.clone(), ..Archive::default() };
    let mut report = Report { args, site: &site, folder: &folder, registered: None };
    let mut ended = Vec::new();
    for part in parts() {
        let mut run = Run { verb: part.verb().into(), command: report.by_hand(part, &archive), ..Run::default() };
        match part.left_out(&site, args) {
            Some(why) => run.note = why.to_owned(),
            None => {
                bar.set_message(format!("{} …", run.verb));
                let start = Instant::now();
                let done = report.add(part, &mut archive);
                run.seconds = Some(start.elapsed().as_secs_f64());
                match done {
                    // a model that cannot be read stops everything; a floor that is not found only the plan
                    Err(e) if part == Part::Check => return Err(e),
                    Err(e) => run.note = in_words(&e),
                    Ok(()) => ended.push(part),
                }
                bar.inc(1);
            }
        }
        archive.runs.push(run);
    }

    bar.set_message("page …");
    archive.views = pictures(&site, &archive, &folder)?;
    let home = site.file.parent().unwrap_or(Path::new("")).to_owned();
    let mut inputs = site.files();
    inputs.extend(archive.check.iter().flat_map(|c| c.model.files.iter().cloned()));
    inputs.sort();
    inputs.dedup();
    archive.inputs = fingerprints(&inputs, &home)?;
    let made = humantime::format_rfc3339_seconds(SystemTime::now()).to_string();
    archive.sheets_pdf = sheets_together(&archive, &made, &folder)?;
    write_file(&folder.join("index.html"), page(&archive).as_bytes())?;

    let earlier = |file: &str| Part::ALL.iter().any(|part| !ended.contains(part) && part.writes(file, &site));
    let manifest = Manifest {
        software: env!("CARGO_PKG_NAME"),
        version: env!("CARGO_PKG_VERSION"),
        site: archive.site.clone(),
        made,
        command: own_command(),
        runs: archive.runs.clone(),
        inputs: archive.inputs.clone(),
        outputs: fingerprints(&files_in(&folder, earlier)?, &folder)?,
    };
    write_json(&folder.join("manifest.json"), &manifest)?;
    bar.finish_and_clear();
    args.output.told.tell(&manifest, out, |out| {
        for run in &archive.runs {
            match (run.seconds, run.note.as_str()) {
                (None, why) => writeln!(out, "{:<7} left out: {why}", run.verb)?,
                (Some(s), "") => writeln!(out, "{:<7} {s:.1} s", run.verb)?,
                (Some(_), why) => writeln!(out, "{:<7} came to no end: {why}", run.verb)?,
            }
        }
        writeln!(out, "{}", folder.join("index.html").display())
    })
}

/// What all parts of a report share.
struct Report<'a> {
    args: &'a ReportArgs,
    site: &'a Site,
    folder: &'a Path,
    /// The site with the poses that were found, and what is to be said of them; once they have been looked for.
    registered: Option<(Site, Vec<String>)>,
}

impl Report<'_> {
    /// Does a part, writes its files and takes its result into the archive.
    fn add(&mut self, part: Part, archive: &mut Archive) -> anyhow::Result<()> {
        let Self { args, site, folder, .. } = *self;
        match part {
            Part::Check => {
                let check = check(site)?;
                apart(folder, &check.model.files)?;
                // it is there only where all else is, and of one run
                remove_earlier(&folder.join("manifest.json"))?;
                write_json(&folder.join("check.json"), &check)?;
                archive.check = Some(check);
            }
            Part::Plan => {
                let Model { scene, .. } = Model::of(site, folder)?;
                let plan = plan(site, &scene, &plan::stations::run::Options::default())
                    .with_context(|| site.file.display().to_string())?;
                archive.plan = Some(write_plan(site, &scene, &plan, folder)?.0);
            }
            Part::Render => {
                let (mut site, said) = self.registered()?;
                site.warnings.extend(said);
                let rendered = rendered(site, None, &RenderArgs::as_they_come(folder, has_photograph(self.site)))?;
                write_json(&folder.join("render.json"), &rendered)?;
                archive.render = Some(rendered);
            }
            Part::Audit => {
                let (site, found) = self.registered()?;
                let Model { scene, health, .. } = Model::of(&site, folder)?;
                let said = health.warnings.into_iter().chain(found).collect();
                let settings = audit::Settings::default();
                archive.audit = Some(audited(&site, &scene, said, None, &[], &settings, folder, Told::NOTHING)?);
            }
            Part::Study => {
                let options = study::Options { budget_s: f64::from(args.budget), ..study::Options::default() };
                archive.study = Some(studied(site, &args.site, &options, &[], folder, &|_| {})?.1);
            }
            Part::View => {
                let extras = Extras {
                    findings: archive.audit.as_ref().map(|_| folder.to_owned()),
                    plan: archive.plan.as_ref().map(|_| folder.join("plan.json")),
                    command: own_command(),
                };
                viewed(site, &Model::of(site, folder)?, &BakeHow::default(), &extras, folder, Told::NOTHING)?;
                archive.viewer = Some("viewer.html".to_owned());
            }
        }
        Ok(())
    }

    /// The site to render and audit, and what is to be said of its poses.
    fn registered(&mut self) -> anyhow::Result<(Site, Vec<String>)> {
        let registered = match self.registered.take() {
            Some(known) => known,
            None if self.args.register => {
                in_passing(self.site, &Model::of(self.site, self.folder)?.scene, None, &[], Told::NOTHING)?
            }
            None => (self.site.clone(), Vec::new()),
        };
        Ok(self.registered.insert(registered).clone())
    }

    /// The command line that does a part by hand.
    fn by_hand(&self, part: Part, archive: &Archive) -> String {
        let mut line = vec![part.verb().to_owned(), as_argument(&self.args.site)];
        if part != Part::Check {
            line.extend(["--out".into(), as_argument(self.folder)]);
        }
        if self.args.register && matches!(part, Part::Render | Part::Audit) {
            line.push("--register".into());
        }
        match part {
            Part::Render if has_photograph(self.site) => line.push("--compare".into()),
            Part::Study => line.extend(["--budget".into(), self.args.budget.to_string()]),
            Part::View => {
                if archive.audit.is_some() {
                    line.extend(["--findings".into(), as_argument(self.folder)]);
                }
                if archive.plan.is_some() {
                    line.extend(["--plan".into(), as_argument(&self.folder.join("plan.json"))]);
                }
            }
            _ => {}
        }
        command(&line)
    }
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
            if let Some(audit) = &archive.audit
                && let Some(png) = marked(audit, name, &photo, exposure)?
            {
                let file = marked_file(name);
                write_file(&folder.join(&file), &png)?;
                pictures.findings = Some(file);
            }
            pictures.photo = Some(file);
        }
        let audited = archive.audit.iter().flat_map(|a| &a.views).any(|v| v.summary.view == *name);
        pictures.sheet = audited.then(|| audit::sheet_stem(name));
        all.push(pictures);
    }
    // an earlier report may have had more; names may differ in letter case alone, which some file systems do not tell apart
    let now: Vec<String> = all.iter().filter_map(|v| v.findings.as_ref()).map(|f| f.to_lowercase()).collect();
    for file in site.views.iter().map(|v| marked_file(&v.name)).filter(|f| !now.contains(&f.to_lowercase())) {
        remove_earlier(&folder.join(file))?;
    }
    Ok(all)
}

/// The file of a view's photograph with its findings marked.
fn marked_file(view: &str) -> String {
    format!("view-{view}-findings.png")
}

/// Writes all sheets of a report as one PDF file for archives, `report.pdf`: floors, views, the study; gives whether there
/// are any. Where there are none, that of an earlier report is removed.
fn sheets_together(archive: &Archive, made: &str, folder: &Path) -> anyhow::Result<bool> {
    let floors = archive.plan.iter().flat_map(|p| &p.floors).flat_map(|f| f.sheets.iter().cloned());
    let views = archive.audit.iter().flat_map(|a| &a.views).map(|v| audit::sheet_stem(&v.summary.view));
    let study = archive.study.iter().map(|_| "study".to_owned());
    let mut texts = Vec::new();
    for stem in floors.chain(views).chain(study) {
        let file = folder.join(stem + ".svg");
        texts.push(std::fs::read_to_string(&file).with_context(|| file.display().to_string())?);
    }
    let file = folder.join("report.pdf");
    if texts.is_empty() {
        remove_earlier(&file)?;
        return Ok(false);
    }
    let texts: Vec<&str> = texts.iter().map(String::as_str).collect();
    write_file(&file, &pdf(&archive.site, &texts, Some(made))?)?;
    Ok(true)
}

/// All files in a folder but the manifest and what an `earlier` report left, sorted.
fn files_in(folder: &Path, earlier: impl Fn(&str) -> bool) -> io::Result<Vec<PathBuf>> {
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder)? {
        let path = entry?.path();
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        // a program that was ended while it wrote has left its parts
        if path.is_file() && name != "manifest.json" && !name.ends_with(".part") && !earlier(&name) {
            files.push(path);
        }
    }
    files.sort();
    Ok(files)
}

#[cfg(test)]
mod tests {
    use super::{Archive, Part, Site, files_in, sheets_together};

    #[test]
    fn sheets_of_an_earlier_report_are_not_this_ones() {
        let folder = tempfile::tempdir().unwrap();
        let together = folder.path().join("report.pdf");
        std::fs::write(&together, "an earlier report's").unwrap();
        assert!(!sheets_together(&Archive::default(), "", folder.path()).unwrap());
        assert!(!together.exists());
    }

    #[test]
    fn what_a_crash_left_is_no_result() {
        let folder = tempfile::tempdir().unwrap();
        for name in ["a.png", "b.png.12.part", "manifest.json", "mask-apse-F1.png"] {
            std::fs::write(folder.path().join(name), "").unwrap();
        }
        let listed = files_in(folder.path(), |file| file.starts_with("mask-")).unwrap();
        assert_eq!(listed, [folder.path().join("a.png")]);
    }

    #[test]
    fn a_file_tells_by_its_name_which_part_wrote_it() {
        let site = Site::load(concat!(env!("CARGO_MANIFEST_DIR"), "/sites/chapel").as_ref()).unwrap();
        let parts = |file: &str| Part::ALL.into_iter().filter(|p| p.writes(file, &site)).collect::<Vec<_>>();
        for (part, files) in [
            (Part::Check, "check.json"),
            (Part::Plan, "plan.json plan-ground.dxf coverage.ply coverage-ground.svg"),
            (Part::Render, "render.json apse.exr apse.png view-apse-relit.png"),
            (Part::Audit, "findings.ma findings-cloudcompare.txt audit-apse.pdf mask-apse-D1.png"),
            (Part::Study, "study.csv study-truth-apse-a.exr"),
            (Part::View, "viewer.html"),
        ] {
            assert!(files.split(' ').all(|file| parts(file) == [part]), "{files}");
        }
        assert!(["index.html", "report.pdf"].iter().all(|file| parts(file).is_empty()));
    }
}
