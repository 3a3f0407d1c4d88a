//! `clerestory init MODEL`.

use anyhow::bail;
use clap::{Args, ValueHint};
use clerestory::atomic_write::folder_of;
use clerestory::init::{Draft, Guessed, Sources, draft};
use clerestory::report::write_file;
use serde::Serialize;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use super::terminal::command::command;
use super::terminal::output::{Told, warn};

/// Write a first site file for a model: its unit and up axis, probes, photographs and cameras found beside them.
///
/// Nothing in most models says how large a unit is or which way is up: both are guessed, and the file says from what, and
/// where to look because nothing decides. Pictures twice as wide as high become probes, whose places `register` finds; cameras
/// come from COLMAP, RealityCapture or Metashape where their files lie in or beside the folder of pictures. The pictures of an
/// E57 scan, which have their poses, are taken out into a folder beside the site file.
#[derive(Args, Debug)]
#[command(after_help = "Examples:\n  \
    clerestory init chapel.glb\n  \
    clerestory init scan.ply --photos photos --probes panoramas --out church/site.toml")]
pub(crate) struct InitArgs {
    /// The model: OBJ, PLY, glTF, or a structured E57 scan
    #[arg(value_hint = ValueHint::FilePath)]
    model: PathBuf,
    /// A folder of photographs
    #[arg(long, value_name = "DIR", value_hint = ValueHint::DirPath)]
    photos: Option<PathBuf>,
    /// A folder of light probes
    #[arg(long, value_name = "DIR", value_hint = ValueHint::DirPath)]
    probes: Option<PathBuf>,
    /// The site file to write; its folder is made where there is none
    #[arg(long, value_name = "FILE", default_value = "site.toml", value_hint = ValueHint::FilePath)]
    out: PathBuf,
    /// Take the place of a file that is there
    #[arg(long)]
    overwrite: bool,
    #[command(flatten)]
    told: Told,
}

/// What `--json` prints.
#[derive(Serialize)]
struct Outcome<'a> {
    file: &'a Path,
    units: Guess,
    up: Guess,
    views: usize,
    probes: usize,
    /// Probes whose place is still to be found.
    unplaced: usize,
    /// Photographs that nothing tells the place of.
    unposed: usize,
    cameras: Option<&'a Path>,
    warnings: &'a [String],
    /// Command lines to go on with.
    next: Vec<String>,
}

#[derive(Serialize)]
struct Guess {
    value: String,
    sure: bool,
    why: String,
    rival: Option<String>,
}

impl Guess {
    fn of<T>(guessed: &Guessed<T>, name: impl Fn(&T) -> String) -> Self {
        let rival = guessed.rival.as_ref().map(&name);
        Self { value: name(&guessed.value), sure: guessed.sure(), why: guessed.why.clone(), rival }
    }

    fn sentence(&self) -> String {
        let doubt = match &self.rival {
            Some(rival) => format!(". Not sure: is it {rival}?"),
            None => String::new(),
        };
        format!("{} ({}){doubt}", self.value, self.why)
    }
}

/// Writes a site file and tells `out` what is in it.
pub(crate) fn run(args: &InitArgs, out: &mut impl Write) -> anyhow::Result<()> {
    let file = if args.out.is_dir() { args.out.join("site.toml") } else { args.out.clone() };
    if file.exists() && !args.overwrite {
        bail!("{}: the file is there already. Name another with --out, or add --overwrite", file.display());
    }
    let folder = folder_of(&file);
    std::fs::create_dir_all(folder).map_err(|e| anyhow::anyhow!("{}: {e}", folder.display()))?;
    let sources = Sources {
        model: args.model.clone(),
        photos: args.photos.clone(),
        probes: args.probes.clone(),
        overwrite: args.overwrite,
    };
    let draft = draft(&file, &sources)?;
    write_file(&file, draft.text.as_bytes())?;
    let outcome = Outcome {
        file: &file,
        units: Guess::of(&draft.guess.unit, |unit| unit.name.to_owned()),
        up: Guess::of(&draft.guess.up, |up| format!("{} up", up.name())),
        views: draft.views,
        probes: draft.probes,
        unplaced: draft.unplaced,
        unposed: draft.unposed,
        cameras: draft.pose_file.as_deref(),
        warnings: &draft.warnings,
        next: next(&file, &draft),
    };
    args.told.tell(&outcome, out, |out| tell(&outcome, out))
}

fn tell(o: &Outcome, out: &mut impl Write) -> io::Result<()> {
    writeln!(out, "Wrote {}.\n", o.file.display())?;
    writeln!(out, "  unit     {}", o.units.sentence())?;
    writeln!(out, "  up axis  {}", o.up.sentence())?;
    if let Some(cameras) = o.cameras {
        writeln!(out, "  cameras  from {}", cameras.display())?;
    }
    let unplaced = match o.unplaced {
        0 => String::new(),
        n => format!(", {n} of them without a place yet"),
    };
    writeln!(out, "  probes   {}{unplaced}", o.probes)?;
    writeln!(out, "  views    {}", o.views)?;
    if o.unposed > 0 {
        writeln!(out, "  {} photographs stand in the file as comments: say where they were taken", o.unposed)?;
    }
    warn("  !", o.warnings, out)?;
    if !(o.units.sure && o.up.sure) {
        writeln!(out, "\nLook at `units` and `up` in the file first: everything hangs on them.")?;
    }
    writeln!(out, "\nNext:")?;
    o.next.iter().try_for_each(|line| writeln!(out, "  {line}"))
}

/// The command lines that go on from here.
fn next(file: &Path, draft: &Draft) -> Vec<String> {
    let site = if file.file_name().is_some_and(|n| n == "site.toml") { folder_of(file) } else { file };
    let named = site.to_string_lossy();
    let registered = folder_of(file).join("registered.toml");
    let registered = registered.to_string_lossy();
    if draft.unplaced > 0 {
        vec![command(&["register", &named, "--write", &registered]), command(&["check", &registered])]
    } else if draft.probes + draft.views > 0 {
        vec![command(&["check", &named])]
    } else {
        vec![command(&["check", &named]), command(&["plan", &named])]
    }
}
