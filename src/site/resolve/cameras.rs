//! The `[cameras]` table: views and probes from another program's pose file.

use glam::{DMat3, DVec3, UVec2, Vec2, Vec3};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use toml::Spanned;

use super::super::camera::Camera;
use super::super::fault::SiteError;
use super::super::file::{CamerasTable, ProbesKey};
use super::super::files::is_url;
use super::super::frame::Pose;
use super::super::pose::{finite, matrix, quaternion};
use super::super::poses::{self, Similarity, SolvedCamera, listed};
use super::super::{CameraSource, LitPicture, Pictures, Probe, View};
use super::Resolver;
use super::names::lighting_name;
use super::photographs::{Masks, Pool, agreement, view_name};
use super::picture::ASPECT_TOLERANCE;
use crate::panorama::{self, Projection};

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
        let file =
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
        let lighting = t.lighting.as_ref().map_or(Ok(String::new()), |name| lighting_name(&self.source, name))?;
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
        for ((solved, part), photo) in file.cameras.into_iter().zip(parts).zip(found) {
            if !part.is_used() {
                continue;
            }
            let may_be_missing = self.pictures == Pictures::MayBeMissing && solved.intrinsics.size.is_some();
            if photo.is_none() && !may_be_missing {
                missing.push(solved.photo);
                continue;
            }
            let solved = solved.moved(&similarity);
            let camera = self.solved(t, &solved, photo.as_deref())?;
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
                    pictures: vec![LitPicture { lighting: lighting.clone(), path: photo.clone(), frames: Vec::new() }],
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
        warnings.extend(file.warnings);
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
        let mut found: Vec<_> = cameras.iter().map(|c| photos.find(&c.photo)).collect();
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

    /// From the pose file's axes and units to the model's.
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
        Ok(cameras.iter().map(one).collect())
    }

    /// A camera, solved in the model's axes, in the program's, for its photograph set upright.
    fn solved(&self, t: &CamerasTable, solved: &SolvedCamera, photo: Option<&Path>) -> Result<Camera, SiteError> {
        let fault = |problem: String, help: &str| self.source.fault(t.path.span(), problem, help);
        let upright = photo.map(|p| self.size_of(p, t.path.span())).transpose()?;
        let lens = &solved.intrinsics;
        // without a size, lengths belong to the upright picture
        let (quarters, mirrored) = match photo {
            Some(path) if lens.size.is_some() => panorama::quarter_turns(path).unwrap_or((0, false)),
            _ => (0, false),
        };
        if mirrored {
            return Err(fault(
                format!("the photograph of “{}” is marked as mirrored in its EXIF data", solved.photo),
                "Save it unmirrored, and solve the cameras again",
            ));
        }
        let stored = upright.map(|[w, h]| if quarters % 2 == 1 { [h, w] } else { [w, h] });
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
        let by = UVec2::from(wanted).as_dvec2() / UVec2::from(size).as_dvec2();
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
        let axis = |v: DVec3| self.frame.direction_in(solved.rotation * v);
        let pose = Pose {
            position: self.frame.point_in(solved.position),
            rotation: DMat3::from_cols(axis(DVec3::X), axis(DVec3::Z), axis(DVec3::NEG_Y)),
        };
        Ok(Camera::new(pose, &lens.model(size).resized(wanted[0], wanted[1])).turned(quarters))
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
