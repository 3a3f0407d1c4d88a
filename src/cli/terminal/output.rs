//! The folder that a verb writes into, and what it tells.

use anyhow::{Context, bail};
use clap::{Args, ValueHint};
use clerestory::atomic_write::folder_of;
use clerestory::site::Site;
use serde::Serialize;
use std::fmt::Display;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// Where a verb's results go, and what it prints.
#[derive(Args, Debug, Default)]
pub(crate) struct Output {
    /// Folder for the results [default: reports/SITE]
    #[arg(long, value_name = "DIR", value_hint = ValueHint::DirPath)]
    out: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) told: Told,
}

/// What a verb prints.
#[derive(Args, Clone, Copy, Debug, Default)]
pub(crate) struct Told {
    /// Print JSON
    #[arg(long)]
    pub(crate) json: bool,
    /// Print nothing but errors; with --json, the JSON alone
    #[arg(short, long)]
    quiet: bool,
}

impl Told {
    /// Nothing but errors.
    pub(crate) const NOTHING: Self = Self { json: false, quiet: true };

    /// Whether a person is to be told how it goes.
    pub(crate) fn talks(self) -> bool {
        !self.quiet && !self.json
    }

    /// Tells a result: as JSON where that was asked for, in `words` where a person reads.
    pub(crate) fn tell<W: Write>(
        self,
        result: &impl Serialize,
        out: &mut W,
        words: impl FnOnce(&mut W) -> io::Result<()>,
    ) -> anyhow::Result<()> {
        match self {
            Self { json: true, .. } => json(result, out)?,
            Self { quiet: true, .. } => {}
            _ => words(out)?,
        }
        Ok(())
    }
}

impl Output {
    /// Into a folder, and nothing printed.
    pub(crate) fn silent(folder: &Path) -> Self {
        Self { out: Some(folder.to_owned()), told: Told::NOTHING }
    }

    /// The folder asked for, else the site's own under `reports`; made where it is not there yet.
    ///
    /// # Errors
    ///
    /// A folder in which the site's model or pictures lie: a result may have the name of one.
    pub(crate) fn folder(&self, site: &Site) -> anyhow::Result<PathBuf> {
        let folder = self.out.clone().unwrap_or_else(|| by_default(site));
        let own: Vec<PathBuf> = site.files().into_iter().filter(|f| *f != site.file).collect();
        apart(&folder, &own)?;
        std::fs::create_dir_all(&folder).with_context(|| format!("{}: the folder cannot be made", folder.display()))?;
        Ok(folder)
    }
}

/// Refuses a folder in which files of the site's own lie.
pub(crate) fn apart(folder: &Path, own: &[PathBuf]) -> anyhow::Result<()> {
    let Ok(known) = folder.canonicalize() else { return Ok(()) };
    let Some(own) = own.iter().find(|f| folder_of(f).canonicalize().is_ok_and(|f| f == known)) else { return Ok(()) };
    bail!(
        "{}: the site's own files lie there, such as {}, and results could take their place. Give --out another folder",
        folder.display(),
        own.display()
    )
}

/// `reports/SITE`, after the site's folder, or after the site file where it is not called site.toml.
fn by_default(site: &Site) -> PathBuf {
    let stem = site.file.file_stem().filter(|s| *s != "site").map(|s| s.to_owned());
    let folder = site.file.canonicalize().ok().and_then(|f| Some(f.parent()?.file_name()?.to_owned()));
    let folder = folder.unwrap_or_else(|| "site".into());
    let name = match stem {
        Some(stem) => PathBuf::from(format!("{}-{}", folder.to_string_lossy(), stem.to_string_lossy())),
        None => PathBuf::from(folder),
    };
    Path::new("reports").join(name)
}

/// Tells what is odd, a line each, after a mark.
pub(crate) fn warn<T: Display>(
    mark: &str,
    warnings: impl IntoIterator<Item = T>,
    out: &mut impl Write,
) -> io::Result<()> {
    warnings.into_iter().try_for_each(|warning| writeln!(out, "{mark} {warning}"))
}

/// Tells a value as JSON, and ends the line.
pub(crate) fn json(value: &impl Serialize, out: &mut impl Write) -> io::Result<()> {
    serde_json::to_writer_pretty(&mut *out, value)?;
    writeln!(out)
}
