//! Reading a site file from disk.

use std::path::{Path, PathBuf};

use super::fault::SiteError;
use super::site::{Environment, Pictures, Places, Site};
use super::{files, poses, resolve};

impl Site {
    /// Reads and checks a site file; a folder stands for the `site.toml` in it. All that the file names is checked
    /// to be there, pictures by their headers only.
    ///
    /// # Errors
    ///
    /// The first fault, with its place in the file, what was expected and what to do.
    pub fn load(path: &Path) -> Result<Self, SiteError> {
        Self::load_with(path, Pictures::MustExist)
    }

    /// The same, for a site whose probes' and views' pictures may still be to be made.
    ///
    /// # Errors
    ///
    /// As [`Site::load`].
    pub fn load_with(path: &Path, pictures: Pictures) -> Result<Self, SiteError> {
        Self::read(path, pictures, Places::MustBeGiven)
    }

    /// The same as [`Site::load`], for a site whose probes may lack a position: see [`Probe::placed`](super::Probe::placed).
    ///
    /// # Errors
    ///
    /// As [`Site::load`].
    pub fn load_to_register(path: &Path) -> Result<Self, SiteError> {
        Self::read(path, Pictures::MustExist, Places::MayBeMissing)
    }

    /// Checks a site file's text as if it stood in `file`, which need not be there; probes may lack a position.
    ///
    /// # Errors
    ///
    /// As [`Site::load`].
    pub fn of_text(file: &Path, text: &str) -> Result<Self, SiteError> {
        resolve::site(file, text, Pictures::MustExist, Places::MayBeMissing)
    }

    fn read(path: &Path, pictures: Pictures, places: Places) -> Result<Self, SiteError> {
        let unreadable = |path: &Path, why: String, help: &str| SiteError::Unreadable {
            path: path.to_owned(),
            why,
            help: help.to_owned(),
        };
        if files::is_url(&path.to_string_lossy()) {
            return Err(unreadable(path, "expected a path, found a URL".to_owned(), "Download the site first"));
        }
        let file = if path.is_dir() { path.join("site.toml") } else { path.to_owned() };
        if files::is_model(&file) && file.is_file() {
            let help = format!("Write a site file for it first: clerestory init {}", file.display());
            return Err(unreadable(&file, "expected a site file, found a model".to_owned(), &help));
        }
        if let Some((what, cure)) = files::foreign_model(&file) {
            return Err(unreadable(&file, format!("expected a site file, found {what}"), cure));
        }
        let bytes = std::fs::read(&file).map_err(|e| {
            unreadable(&file, e.to_string(), "Name a site file, or the folder that holds its site.toml")
        })?;
        let text = String::from_utf8(bytes)
            .map_err(|_| unreadable(&file, "the file is not UTF-8 text".to_owned(), "Save it as UTF-8"))?;
        resolve::site(&file, text.strip_prefix('\u{feff}').unwrap_or(&text), pictures, places)
    }

    /// All files that the site file names, and itself; a model's materials and textures are in
    /// [`crate::scene::Health::files`].
    pub fn files(&self) -> Vec<PathBuf> {
        let mut files = vec![self.file.clone(), self.model.clone()];
        if let Some(Environment::Image { path, .. }) = &self.environment {
            files.push(path.clone());
        }
        let pictures = self.probes.iter().flat_map(|p| &p.pictures);
        files.extend(pictures.flat_map(|l| std::iter::once(&l.path).chain(l.frames.iter().skip(1))).cloned());
        files.extend(self.views.iter().flat_map(|v| [v.photo.clone(), v.mask.clone()]).flatten());
        files.extend(self.pose_file.iter().flat_map(|path| poses::files(path)));
        files
    }
}
