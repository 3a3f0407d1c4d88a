//! `clerestory demo DIR`.

use anyhow::{Context, bail};
use clap::Args;
use clerestory::atomic_write::{Unfinished, folder_of};
use serde::Serialize;
use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use super::terminal::output::Told;

/// Write a complete sample site: a small chapel with probes and photographs, and a faulty model of it.
#[derive(Args, Debug)]
#[command(
    after_help = "The folder gets site.toml (the chapel as it stands), as_modelled.toml (a model of it with planted \
                        faults, listed in faults.json), and all that they name."
)]
pub(crate) struct DemoArgs {
    /// Folder to write; made if need be
    #[arg(value_hint = clap::ValueHint::DirPath)]
    dir: PathBuf,
    /// Write into a folder that is not empty; files of the sample are replaced, others are left alone
    #[arg(long)]
    force: bool,
    #[command(flatten)]
    told: Told,
}

/// The files of the sample site, from the program itself: path inside the site, and bytes.
///
/// Plain `include_bytes!` does it; a crate that embeds folders would save this list, but not its test.
macro_rules! site {
    ($($name:literal),* $(,)?) => {
        &[$(($name, include_bytes!(concat!(env!("CARGO_MANIFEST_DIR"), "/sites/chapel/", $name)) as &[u8])),*]
    };
}

const FILES: &[(&str, &[u8])] = site![
    "README.md",
    "site.toml",
    "as_modelled.toml",
    "faults.json",
    "sky.exr",
    "model/chapel.obj",
    "model/chapel.mtl",
    "model/ashlar.jpg",
    "model/brick.jpg",
    "model/flag.jpg",
    "model/frieze.jpg",
    "model/mandorla.jpg",
    "model/marble.jpg",
    "model/plaque.jpg",
    "model/plaster.jpg",
    "model/rosette.jpg",
    "model/ship.jpg",
    "model/stars.jpg",
    "model/vine.jpg",
    "model/wood.jpg",
    "as_modelled/chapel.obj",
    "as_modelled/chapel.mtl",
    "as_modelled/ashlar.jpg",
    "as_modelled/brick.jpg",
    "as_modelled/flag.jpg",
    "as_modelled/frieze.jpg",
    "as_modelled/mandorla.jpg",
    "as_modelled/marble.jpg",
    "as_modelled/plaster.jpg",
    "as_modelled/rosette_recoloured.jpg",
    "as_modelled/ship.jpg",
    "as_modelled/stars.jpg",
    "as_modelled/vine.jpg",
    "as_modelled/wood.jpg",
    "probes/west_1000.exr",
    "probes/west_1430.exr",
    "probes/east_1000.exr",
    "probes/east_1430.exr",
    "probes/aisle_1000.exr",
    "probes/aisle_1430.exr",
    "photos/floor.exr",
    "photos/panels.exr",
    "photos/apse.exr",
    "photos/aisle.exr",
    "photos/sacristy.exr",
];

/// What was written.
#[derive(Serialize)]
struct Written<'a> {
    folder: &'a Path,
    files: usize,
    bytes: usize,
    sites: [PathBuf; 2],
}

/// Writes the sample site and tells `out` what to try next.
pub(crate) fn run(args: &DemoArgs, out: &mut impl Write) -> anyhow::Result<()> {
    let dir = args.dir.as_path();
    let exists = is_used(dir)?;
    if exists && !args.force {
        bail!("{}: the folder is not empty; name another one, or add --force to write into it", dir.display());
    }
    write(dir, exists).with_context(|| format!("{}: cannot be written", dir.display()))?;
    let written = Written {
        folder: dir,
        files: FILES.len(),
        bytes: FILES.iter().map(|(_, bytes)| bytes.len()).sum(),
        sites: [dir.join("site.toml"), dir.join("as_modelled.toml")],
    };
    args.told.tell(&written, out, |out| tell(&written, out))
}

fn tell(written: &Written, out: &mut impl Write) -> io::Result<()> {
    let [dir, twin] =
        [written.folder, &written.sites[1]].map(|p| super::terminal::command::quoted(&p.to_string_lossy()));
    let megabytes = written.bytes as f64 / 1e6;
    writeln!(out, "Wrote the chapel, {} files, {megabytes:.1} MB, to {dir}. Try next:\n", written.files)?;
    writeln!(out, "  clerestory check {dir}                      what the site holds and what it is fit for")?;
    writeln!(out, "  clerestory render {dir}                     pictures of all five views, at 10:00")?;
    writeln!(out, "  clerestory render {dir} --lighting 14:30    the same in the afternoon")?;
    writeln!(out, "  clerestory render {twin}    the model with its planted faults")
}

/// Whether there is a folder with something in it.
fn is_used(dir: &Path) -> anyhow::Result<bool> {
    match fs::read_dir(dir) {
        Ok(mut entries) => Ok(entries.next().is_some()),
        Err(e) if e.kind() == io::ErrorKind::NotFound => Ok(false),
        Err(e) if e.kind() == io::ErrorKind::NotADirectory => {
            bail!("{}: this is a file, not a folder; name a folder to write the sample site into", dir.display())
        }
        Err(e) => Err(e).with_context(|| format!("{}: cannot be written", dir.display())),
    }
}

/// Writes all files into a folder beside `dir`, which then takes its name; where `dir` is in use, its files are moved
/// into it one by one. A failure before that leaves `dir` as it was.
fn write(dir: &Path, in_use: bool) -> io::Result<()> {
    let whole = std::path::absolute(dir)?;
    let beside = whole.parent().unwrap_or(&whole);
    fs::create_dir_all(beside)?;
    let part = Unfinished::new(beside.join(format!(".clerestory-demo.{}.part", std::process::id())));
    let place = |folder: &Path, name: &str| {
        let file = folder.join(name);
        fs::create_dir_all(folder_of(&file)).map(|()| file)
    };
    for (name, bytes) in FILES {
        fs::write(place(part.path(), name)?, bytes)?;
    }
    if in_use {
        return FILES.iter().try_for_each(|(name, _)| fs::rename(part.path().join(name), place(dir, name)?));
    }
    if dir.exists() {
        fs::remove_dir(dir)?;
    }
    fs::rename(part.path(), dir)
}
