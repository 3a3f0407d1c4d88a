//! Finding the photographs and masks that a pose file's cameras mean.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use super::super::files::{as_file_name, is_picture};

/// A view's name after its photograph's.
pub(super) fn view_name(photo: &str) -> String {
    as_file_name(stem(&photo.replace('\\', "/")))
}

/// A picture's name without its ending.
fn stem(name: &str) -> &str {
    match name.rsplit_once('.') {
        Some((stem, _)) if is_picture(Path::new(name)) => stem,
        _ => name,
    }
}

/// How many last parts of a file's path a pose file's path has, too, leaving the ending aside; and whether that is the same.
pub(super) fn agreement(file: &Path, photo: &str) -> (usize, bool) {
    let parts = |path: &str| -> Vec<String> {
        path.to_lowercase().replace('\\', "/").split('/').rev().map(str::to_owned).collect()
    };
    // so that “.” has a name, too
    let file = std::path::absolute(file).unwrap_or_else(|_| file.to_owned());
    let (file, photo) = (parts(&file.to_string_lossy()), parts(photo));
    let pairs = || file.iter().zip(&photo);
    let alike = pairs().enumerate().take_while(|(i, (a, b))| if *i == 0 { stem(a) == stem(b) } else { a == b });
    (alike.count(), pairs().next().is_some_and(|(a, b)| a == b))
}

/// A folder of masks.
pub(super) struct Masks {
    pub(super) folder: PathBuf,
    /// It and the folders in it that were looked into.
    pools: BTreeMap<PathBuf, Pool>,
    /// Photographs with one.
    pub(super) found: usize,
    /// Photographs without one.
    pub(super) without: Vec<String>,
}

impl Masks {
    pub(super) fn of(folder: PathBuf) -> Self {
        Self { folder, pools: BTreeMap::new(), found: 0, without: Vec::new() }
    }

    /// The mask of what the pose file calls `photo` and what lies at `path`, by that path or by its name, as `a.*`,
    /// `a.jpg.png`, `a_mask.*` or `a.jpg.mask.png`. Notes whether there is one.
    pub(super) fn find(&mut self, photo: &str, path: &Path) -> Option<PathBuf> {
        let mask = self.of_photo(&photo.replace('\\', "/"), path);
        match mask {
            Some(_) => self.found += 1,
            // where pictures may be missing
            None if !path.is_file() => {}
            None => self.without.push(photo.to_owned()),
        }
        mask
    }

    fn of_photo(&mut self, photo: &str, path: &Path) -> Option<PathBuf> {
        let exact = self.folder.join(photo);
        if exact.is_file() && exact != path {
            return Some(exact);
        }
        let (parent, name) = photo.rsplit_once('/').unwrap_or(("", photo));
        // the pose file may leave the ending out
        let full =
            if stem(name) == name { path.file_name().unwrap_or_default().to_string_lossy() } else { name.into() };
        let stem = stem(name);
        let names = [stem.to_owned(), full.to_string(), format!("{stem}_mask"), format!("{full}.mask")];
        let names = names.map(|name| name.to_lowercase());
        for place in [self.folder.join(parent), self.folder.clone()] {
            let pool = self.pools.entry(place).or_insert_with_key(|place| Pool::of(place));
            let mut masks = names.iter().filter_map(|name| pool.by_stem.get(name)).filter(|mask| *mask != path);
            if let Some(mask) = masks.next() {
                return Some(mask.clone());
            }
        }
        None
    }
}

/// The pictures of a folder, by their names without ending in small letters.
pub(super) struct Pool {
    folder: PathBuf,
    by_stem: BTreeMap<String, PathBuf>,
}

impl Pool {
    pub(super) fn of(folder: &Path) -> Self {
        let entries = std::fs::read_dir(folder).into_iter().flatten().flatten().map(|e| e.path());
        let mut files: Vec<PathBuf> = entries.filter(|path| is_picture(path)).collect();
        files.sort();
        let mut by_stem = BTreeMap::new();
        for file in files {
            let stem = file.file_stem().unwrap_or_default().to_string_lossy().to_lowercase();
            by_stem.entry(stem).or_insert(file);
        }
        Self { folder: folder.to_owned(), by_stem }
    }

    /// The picture that a pose file means: by its path, else by its name in any case and with any ending.
    pub(super) fn find(&self, photo: &str) -> Option<PathBuf> {
        let photo = photo.replace('\\', "/");
        let exact = self.folder.join(&photo);
        if exact.is_file() {
            return Some(exact);
        }
        let name = photo.rsplit('/').next().unwrap_or(&photo);
        self.by_stem.get(&stem(name).to_lowercase()).cloned()
    }
}
