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
        let mut wanted = parts.iter().map(|part| part.is_view || part.is_probe);
        file.cameras.retain(|_| wanted.next().unwrap_or(false));
        let parts: Vec<PoseUse> = parts.into_iter().filter(|part| part.is_view || part.is_probe).collect();
        if file.cameras.is_empty() {
            return Err(fault(
                "the pose file holds no solved camera".to_owned(),
                "Align the photographs and export again",
            ));
        }
        let beside = if path.is_dir() { path.clone() } else { path.parent().unwrap_or(Path::new("")).to_owned() };
        let folder = t.photos.as_ref().map_or(Ok(beside), |key| self.there(key, "the photographs' folder"))?;
        let masks = t.masks.as_ref().map(|key| self.there(key, "the masks' folder")).transpose()?;
        let (photos, masks) = (Pool::of(&folder), masks.map(|m| Pool::of(&m)));
        let mut missing = Vec::new();
        let before = views.len() + probes.len();
        let lighting = t.lighting.as_ref().map_or("", |l| l.get_ref().as_str());
        for (solved, part) in file.cameras.iter().zip(parts) {
            let photo = match photos.find(&folder, &solved.photo) {
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
                let mask = masks.as_ref().and_then(|m| m.find(&m.folder, &solved.photo));
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
        if !missing.is_empty() {
            warnings.push(format!(
                "{} of {} photographs that “{}” names are not in “{}”, and they are left out: {}.",
                missing.len(),
                file.cameras.len(),
                path.display(),
                folder.display(),
                listed(&missing)
            ));
        }
        warnings.append(&mut file.warnings);
        Ok(path)
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
        let stem = match name.rsplit_once('.') {
            Some((stem, ending)) if is_picture(ending) => stem,
            _ => name,
        };
        self.by_stem.get(&stem.to_lowercase()).cloned()
    }
}
