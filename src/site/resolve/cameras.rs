//! The `[cameras]` table: views and probes from another program's pose file.

use glam::{DMat3, DVec2, DVec3, Vec2, Vec3};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use toml::Spanned;

use super::super::camera::Camera;
use super::super::fault::SiteError;
use super::super::file::{CamerasTable, ProbesKey};
use super::super::files::is_url;
use super::super::frame::Pose;
use super::super::pose::{finite, matrix, quaternion};
use super::super::poses::{self, SolvedCamera, listed};
use super::super::{CameraSource, LitPicture, Pictures, Probe, View};
use super::Resolver;
use super::names::lighting_name;
use super::picture::ASPECT_TOLERANCE;
use crate::panorama::{self, Projection};

/// From a pose file's axes and units to the model's: scale · rotation · x + translation.
struct Similarity {
    scale: f64,
    rotation: DMat3,
    translation: DVec3,
}

/// What a camera of a pose file becomes.
#[derive(Clone, Copy)]
struct PoseUse {
    is_view: bool,
    is_probe: bool,
}

impl PoseUse {
    fn is_used(self) -> bool {
        self.is_view || self.is_probe
    }
}

impl Resolver<'_> {
    /// Adds the views and probes of a pose file; gives its path.
    pub(super) fn cameras(
        &self,
        table: &Spanned<CamerasTable>,
        views: &mut Vec<View>,
        probes: &mut Vec<Probe>,
        warnings: &mut Vec<String>,
    ) -> Result<PathBuf, SiteError> {
        let t = table.get_ref();
        let fault = |problem: String, help: &str| self.source.fault(t.path.span(), problem, help);
        let path = self.there(&t.path, "the pose file")?;
        let similarity = self.similarity(t)?;
        let mut file =
            poses::read(&path).map_err(|e| fault(e.to_string(), "Export the cameras again, or leave [cameras] out"))?;
        let moved = t.translation.is_some() || t.rotation.is_some() || t.matrix.is_some();
        if file.geocentric && !moved {
            return Err(fault(
                "the cameras' positions are geocentric, since the chunk has a geographic or projected coordinate system"
                    .to_owned(),
                "Set the chunk's coordinate system to Local Coordinates and export model and cameras again, or give \
                 scale, rotation and translation to the model's axes",
            ));
        }
        let parts = self.parts(t, &file.cameras)?;
        let wanted = parts.iter().filter(|part| part.is_used()).count();
        if wanted == 0 {
            return Err(fault(
                "the pose file holds no solved camera".to_owned(),
                "Align the photographs and export again",
            ));
        }
        let beside = if path.is_dir() { path.clone() } else { path.parent().unwrap_or(Path::new("")).to_owned() };
        let folder = t.photos.as_ref().map_or(Ok(beside), |key| self.there(key, "the photographs' folder"))?;
        let masks = t.masks.as_ref().map(|key| self.there(key, "the masks' folder")).transpose()?;
        let found = self.photographs(t, &file.cameras, &parts, &Pool::of(&folder))?;
        let mut masks = masks.map(Masks::of);
        let mut missing = Vec::new();
        let before = views.len() + probes.len();
        let lighting = t.lighting.as_ref().map_or("", |l| l.get_ref().as_str());
        for ((solved, part), photo) in file.cameras.iter().zip(parts).zip(found).filter(|((_, part), _)| part.is_used())
        {
            let photo = match photo {
                Some(photo) => Some(photo),
                None if self.pictures == Pictures::MayBeMissing && solved.intrinsics.size.is_some() => None,
                None => {
                    missing.push(solved.photo.clone());
                    continue;
                }
            };
            let camera = self.solved(t, solved, photo.as_deref(), &similarity)?;
            let name = view_name(&solved.photo);
            let twice = |what: &str| {
                fault(
                    format!("there are two {what}s named “{name}”"),
                    "Rename one of the photographs, views or probes, or list the ones wanted in cameras.only and \
                     cameras.probes",
                )
            };
            let photo = photo.unwrap_or_else(|| folder.join(&solved.photo));
            if part.is_probe {
                if probes.iter().any(|p| p.name.eq_ignore_ascii_case(&name)) {
                    return Err(twice("probe"));
                }
                probes.push(Probe {
                    name: name.clone(),
                    pose: camera.pose,
                    placed: true,
                    pictures: vec![LitPicture {
                        lighting: lighting.to_owned(),
                        path: photo.clone(),
                        frames: Vec::new(),
                    }],
                    projection: Projection::Camera(camera.model()),
                    gain: Vec3::ONE,
                    vignetting: Vec2::ZERO,
                    response: Vec2::ZERO,
                });
            }
            if part.is_view {
                if views.iter().any(|v| v.name.eq_ignore_ascii_case(&name)) {
                    return Err(twice("view"));
                }
                let mask = masks.as_mut().and_then(|m| m.find(&solved.photo, &photo));
                let source = CameraSource::PoseFile(path.clone());
                views.push(View { name, camera, photo: Some(photo), mask, matches: Vec::new(), source });
            }
        }
        if views.len() + probes.len() == before {
            return Err(fault(
                format!("none of its {} photographs is in “{}”: {}", missing.len(), folder.display(), listed(&missing)),
                "Set cameras.photos to the folder that holds them",
            ));
        }
        if let (Some(key), Some(masks)) = (&t.masks, &masks) {
            if masks.found == 0 && !masks.without.is_empty() {
                return Err(self.source.fault(
                    key.span(),
                    format!("none of {} photographs has a mask in it: {}", masks.without.len(), listed(&masks.without)),
                    "Name the mask of a.jpg a.png, a.jpg.png, a_mask.png or a.jpg.mask.png, or leave masks out",
                ));
            }
            if !masks.without.is_empty() {
                warnings.push(format!(
                    "{} photographs have no mask in “{}”, and they are compared as a whole: {}.",
                    masks.without.len(),
                    masks.folder.display(),
                    listed(&masks.without)
                ));
            }
        }
        if !missing.is_empty() {
            warnings.push(format!(
                "{} of {} photographs that “{}” names are not in “{}”, and they are left out: {}.",
                missing.len(),
                wanted,
                path.display(),
                folder.display(),
                listed(&missing)
            ));
        }
        warnings.append(&mut file.warnings);
        Ok(path)
    }

    /// The photograph of each camera. One that several would get, by their bare names, goes to the camera whose path agrees
    /// most with its own.
    fn photographs(
        &self,
        t: &CamerasTable,
        cameras: &[SolvedCamera],
        parts: &[PoseUse],
        photos: &Pool,
    ) -> Result<Vec<Option<PathBuf>>, SiteError> {
        let mut found: Vec<_> = cameras.iter().map(|c| photos.find(&photos.folder, &c.photo)).collect();
        let mut takers: BTreeMap<PathBuf, Vec<usize>> = BTreeMap::new();
        for (i, path) in found.iter().enumerate() {
            if let Some(path) = path {
                takers.entry(path.clone()).or_default().push(i);
            }
        }
        for (path, takers) in takers.iter().filter(|(_, takers)| takers.len() > 1) {
            let agreements: Vec<_> = takers.iter().map(|i| agreement(path, &cameras[*i].photo)).collect();
            let best = agreements.iter().max();
            let mut first: Option<&str> = None;
            for (&i, agreement) in takers.iter().zip(&agreements) {
                let photo = cameras[i].photo.as_str();
                match first {
                    _ if Some(agreement) < best => found[i] = None,
                    _ if !parts[i].is_used() => {}
                    // one name twice is told as that
                    Some(other) if other != photo => {
                        let at = t.photos.as_ref().map_or_else(|| t.path.span(), Spanned::span);
                        return Err(self.source.fault(
                            at,
                            format!("“{other}” and “{photo}” of the pose file would both be “{}”", path.display()),
                            "Set cameras.photos to the folder above, from which the pose file's paths lead to the \
                             photographs",
                        ));
                    }
                    _ => first = Some(photo),
                }
            }
        }
        Ok(found)
    }

    /// A file or folder that exists.
    fn there(&self, key: &Spanned<String>, what: &str) -> Result<PathBuf, SiteError> {
        let name = key.get_ref();
        let path = self.folder.join(name);
        if !name.trim().is_empty() && !is_url(name) && path.exists() {
            return Ok(path);
        }
        Err(self.source.fault(
            key.span(),
            format!("there is nothing at “{}” for {what}", path.display()),
            "Paths are relative to this file and on this machine; check the name",
        ))
    }

    fn similarity(&self, t: &CamerasTable) -> Result<Similarity, SiteError> {
        let scale = t.scale.as_ref().map_or(Ok(1.0), |v| self.number(v, |v| v > 0.0, "a scale above zero"))?;
        let rotation = match (&t.rotation, &t.matrix) {
            (Some(_), Some(m)) => {
                return Err(self.source.fault(m.span(), "the rotation is given twice", "Keep rotation or matrix"));
            }
            (Some(q), None) => quaternion(&self.source, q)?,
            (None, Some(m)) => matrix(&self.source, m)?,
            (None, None) => DMat3::IDENTITY,
        };
        let translation = t.translation.as_ref().map_or(Ok(DVec3::ZERO), |v| finite(&self.source, v))?;
        Ok(Similarity { scale, rotation, translation })
    }

    /// What each camera is: by default a view; a probe where `probes` lists it, and then a view only if `only` does, too.
    fn parts(&self, t: &CamerasTable, cameras: &[SolvedCamera]) -> Result<Vec<PoseUse>, SiteError> {
        let is = |camera: &SolvedCamera, name: &str| camera.photo == name || view_name(&camera.photo) == name;
        let listed_probes = match t.probes.as_ref().map(Spanned::get_ref) {
            Some(ProbesKey::These(names)) => names.as_slice(),
            Some(ProbesKey::All) | None => &[],
        };
        for name in t.only.iter().flatten().chain(listed_probes) {
            if !cameras.iter().any(|c| is(c, name.get_ref())) {
                return Err(self.source.fault(
                    name.span(),
                    format!("the pose file has no solved camera “{}”", name.get_ref()),
                    "Give names of photographs as the pose file has them, with or without their ending",
                ));
            }
        }
        let all = matches!(t.probes.as_ref().map(Spanned::get_ref), Some(ProbesKey::All));
        let one = |camera: &SolvedCamera| {
            let is_probe = all || listed_probes.iter().any(|name| is(camera, name.get_ref()));
            let is_view = match &t.only {
                Some(only) => only.iter().any(|name| is(camera, name.get_ref())),
                None => !is_probe,
            };
            PoseUse { is_view, is_probe }
        };
        if let (Some(lighting), None) = (&t.lighting, &t.probes) {
            return Err(self.source.fault(
                lighting.span(),
                "a lighting without probes",
                "Say in cameras.probes which photographs are probes, or leave the lighting out",
            ));
        }
        t.lighting.as_ref().map_or(Ok(()), |name| lighting_name(&self.source, name))?;
        Ok(cameras.iter().map(one).collect())
    }

    /// A pose file's camera in the program's axes, for its photograph set upright.
    fn solved(
        &self,
        t: &CamerasTable,
        solved: &SolvedCamera,
        photo: Option<&Path>,
        to_model: &Similarity,
    ) -> Result<Camera, SiteError> {
        let fault = |problem: String, help: &str| self.source.fault(t.path.span(), problem, help);
        let upright = photo.map(|p| self.size_of(p, t.path.span())).transpose()?;
        let (quarters, mirrored) = match photo {
            Some(path) if solved.intrinsics.as_stored => panorama::quarter_turns(path).unwrap_or((0, false)),
            _ => (0, false),
        };
        if mirrored {
            return Err(fault(
                format!("the photograph of “{}” is marked as mirrored in its EXIF data", solved.photo),
                "Save it unmirrored, and solve the cameras again",
            ));
        }
        let stored = upright.map(|(w, h)| if quarters % 2 == 1 { [h, w] } else { [w, h] });
        let lens = &solved.intrinsics;
        let Some(size) = lens.size.or(stored) else {
            return Err(fault(
                format!("the size of “{}” is not known", solved.photo),
                "Put the photograph into the folder",
            ));
        };
        let wanted = stored.unwrap_or(size);
        // a photograph that was turned upright after its camera had been solved as it is now needs no turn
        let already = quarters % 2 == 1 && wanted != size && [wanted[1], wanted[0]] == size;
        let (wanted, quarters) = if already { (size, 0) } else { (wanted, quarters) };
        let by =
            DVec2::new(f64::from(wanted[0]), f64::from(wanted[1])) / DVec2::new(f64::from(size[0]), f64::from(size[1]));
        if (by.x / by.y - 1.0).abs() > ASPECT_TOLERANCE {
            return Err(fault(
                format!(
                    "“{}” has {} × {} pixels in the pose file, but {} × {} in its photograph",
                    solved.photo, size[0], size[1], wanted[0], wanted[1]
                ),
                "Give the photographs that the cameras were solved with",
            ));
        }
        if lens.skew != 0.0 && quarters % 2 == 1 {
            return Err(fault(
                format!("“{}” lies on its side and its lens has a skew (b2), which is not read together", solved.photo),
                "Solve the cameras without skew, or turn the photographs upright first",
            ));
        }
        let (unit, middle) = match lens.size {
            Some(_) => (1.0, DVec2::ZERO),
            None => (f64::from(size[0].max(size[1])), 0.5 * DVec2::new(f64::from(size[0]), f64::from(size[1]))),
        };
        let axis = |v: DVec3| self.frame.direction_in(to_model.rotation * (solved.rotation * v));
        let position = to_model.rotation * solved.position * to_model.scale + to_model.translation;
        let camera = Camera {
            pose: Pose {
                position: self.frame.point_in(position),
                rotation: DMat3::from_cols(axis(DVec3::X), axis(DVec3::Z), axis(DVec3::NEG_Y)),
            },
            width: wanted[0],
            height: wanted[1],
            lens: lens.lens,
            focal: lens.focal * unit * by,
            centre: (lens.centre * unit + middle) * by,
            skew: lens.skew * unit * by.x,
            distortion: lens.distortion,
        };
        Ok(camera.turned(quarters))
    }
}

/// A view's name after its photograph's.
fn view_name(photo: &str) -> String {
    let photo = photo.replace('\\', "/");
    let stem = match photo.rsplit_once('.') {
        Some((stem, ending)) if is_picture(ending) => stem,
        _ => &photo,
    };
    let name: String = stem.chars().map(|c| if c.is_control() || "/:*?\"<>|".contains(c) { '_' } else { c }).collect();
    name.trim_matches([' ', '.']).to_owned()
}

fn is_picture(ending: &str) -> bool {
    ["jpg", "jpeg", "png", "tif", "tiff", "exr", "hdr"].iter().any(|e| ending.eq_ignore_ascii_case(e))
}

/// A picture's name without its ending.
fn stem(name: &str) -> &str {
    match name.rsplit_once('.') {
        Some((stem, ending)) if is_picture(ending) => stem,
        _ => name,
    }
}

/// How many last parts of a file's path a pose file's path has, too, leaving the ending aside; and whether that is the same.
fn agreement(file: &Path, photo: &str) -> (usize, bool) {
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
struct Masks {
    folder: PathBuf,
    /// It and the folders in it that were looked into.
    pools: BTreeMap<PathBuf, Pool>,
    /// Photographs with one.
    found: usize,
    /// Photographs without one.
    without: Vec<String>,
}

impl Masks {
    fn of(folder: PathBuf) -> Self {
        Self { folder, pools: BTreeMap::new(), found: 0, without: Vec::new() }
    }

    /// The mask of what the pose file calls `photo` and what lies at `path`, by that path or by its name, as `a.*`,
    /// `a.jpg.png`, `a_mask.*` or `a.jpg.mask.png`. Notes whether there is one.
    fn find(&mut self, photo: &str, path: &Path) -> Option<PathBuf> {
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
struct Pool {
    folder: PathBuf,
    by_stem: BTreeMap<String, PathBuf>,
}

impl Pool {
    fn of(folder: &Path) -> Self {
        let entries = std::fs::read_dir(folder).into_iter().flatten().flatten().map(|e| e.path());
        let mut files: Vec<PathBuf> =
            entries.filter(|p| p.extension().is_some_and(|e| is_picture(&e.to_string_lossy()))).collect();
        files.sort();
        let mut by_stem = BTreeMap::new();
        for file in files {
            let stem = file.file_stem().unwrap_or_default().to_string_lossy().to_lowercase();
            by_stem.entry(stem).or_insert(file);
        }
        Self { folder: folder.to_owned(), by_stem }
    }

    /// The picture that a pose file means: by its path, else by its name in any case and with any ending.
    fn find(&self, folder: &Path, photo: &str) -> Option<PathBuf> {
        let photo = photo.replace('\\', "/");
        let exact = folder.join(&photo);
        if exact.is_file() {
            return Some(exact);
        }
        let name = photo.rsplit('/').next().unwrap_or(&photo);
        self.by_stem.get(&stem(name).to_lowercase()).cloned()
    }
}

#[cfg(test)]
mod tests {
    use crate::site::Site;
    use std::fs;
    use std::path::{Path, PathBuf};

    /// A site with COLMAP's cameras of these photographs and pictures at these places.
    fn folder(photographs: &[&str], pictures: &[&str]) -> tempfile::TempDir {
        let dir = tempfile::tempdir().unwrap();
        fs::write(dir.path().join("m.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
        fs::create_dir(dir.path().join("sparse")).unwrap();
        fs::write(dir.path().join("sparse/cameras.txt"), "1 PINHOLE 4 3 4 4 2 1.5\n").unwrap();
        let line = |(i, name): (usize, &&str)| format!("{} 1 0 0 0 {i} 0 0 1 {name}\n\n", i + 1);
        let images: String = photographs.iter().enumerate().map(line).collect();
        fs::write(dir.path().join("sparse/images.txt"), images).unwrap();
        for name in pictures {
            let path = dir.path().join(name);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            image::GrayImage::new(4, 3).save(path).unwrap();
        }
        dir
    }

    fn site(dir: &Path, keys: &str) -> Result<Site, String> {
        let head = "[site]\nname = \"t\"\nunits = \"m\"\nup = \"z\"\n[model]\npath = \"m.obj\"\n";
        fs::write(dir.join("site.toml"), format!("{head}[cameras]\npath = \"sparse\"\n{keys}")).unwrap();
        Site::load(dir).map_err(|e| e.to_string())
    }

    #[test]
    fn cameras_of_one_name_in_two_folders_do_not_share_a_photograph() {
        let names = ["cam2/0001.png", "cam1/0001.png"];
        let dir = folder(&names, &["images/cam1/0001.png", "images/cam2/0001.png", "flat/0001.png"]);
        assert_eq!(site(dir.path(), "photos = \"images\"\n").unwrap().views.len(), 2);
        let one = site(dir.path(), "photos = \"images/cam1\"\n").unwrap();
        assert_eq!(one.views.iter().map(|v| v.name.as_str()).collect::<Vec<_>>(), ["cam1_0001"]);
        assert!(one.warnings.iter().any(|w| w.contains("cam2/0001.png")), "{:?}", one.warnings);
        // also where only the other is asked for
        assert!(site(dir.path(), "photos = \"images/cam1\"\nonly = [\"cam2/0001.png\"]\n").is_err());
        let tied = site(dir.path(), "photos = \"flat\"\n").unwrap_err();
        assert!(tied.contains("“cam2/0001.png” and “cam1/0001.png”") && tied.contains("the folder above"), "{tied}");
        assert_eq!(site(dir.path(), "photos = \"flat\"\nonly = [\"cam2/0001.png\"]\n").unwrap().views.len(), 1);
    }

    #[test]
    fn masks_are_found_by_the_names_that_programs_give_them() {
        let keys = "photos = \"p\"\nmasks = \"masks\"\n";
        for name in ["c/a.png", "c/a.jpg.png", "c/a_mask.png", "c/a.jpg.mask.png", "a.png", "a.jpg.png", "a_mask.tif"] {
            let dir = folder(&["c/a.jpg", "c/b.jpg"], &["p/c/a.jpg", "p/c/b.jpg", &format!("masks/{name}")]);
            let site = site(dir.path(), keys).unwrap();
            let masks: Vec<Option<PathBuf>> = site.views.iter().map(|v| v.mask.clone()).collect();
            assert!(masks[0].as_ref().is_some_and(|m| m.ends_with(name)) && masks[1].is_none(), "{name}: {masks:?}");
            let told = site.warnings.iter().any(|w| w.contains("no mask") && w.contains("c/b.jpg"));
            assert!(told, "{name}: {:?}", site.warnings);
        }
        let dir = folder(&["c/a.jpg"], &["p/c/a.jpg", "masks/other.png"]);
        let none = site(dir.path(), keys).unwrap_err();
        assert!(none.contains("cameras.masks") && none.contains("c/a.jpg"), "{none}");
    }
}
