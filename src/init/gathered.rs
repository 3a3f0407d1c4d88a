//! What was found beside a model, for the site file.

use std::path::{Path, PathBuf};

use crate::init::error::InitError;
use crate::init::found::{self, Found, PoseFile, Shape};
use crate::init::guess::Guess;
use crate::init::scans::Scanned;

/// What to look at.
#[derive(Clone, Debug, Default)]
pub struct Sources {
    /// The model's file.
    pub model: PathBuf,
    /// A folder of photographs.
    pub photos: Option<PathBuf>,
    /// A folder of light probes.
    pub probes: Option<PathBuf>,
    /// Whether a scan file's pictures may take the place of files that are there.
    pub overwrite: bool,
}

/// What is put into words.
pub(super) struct Findings<'a> {
    pub(super) name: String,
    /// The site file's folder, which paths are relative to.
    pub(super) folder: &'a Path,
    pub(super) model: &'a Path,
    /// Whether the model has colours of vertices whose coding nothing tells, as of glTF, where it is linear.
    pub(super) coloured: bool,
    pub(super) guess: &'a Guess,
    pub(super) pictures: &'a Gathered,
}

/// The pictures of a visit, by what they are good for.
#[derive(Default)]
pub(super) struct Gathered {
    /// Probes of which nothing tells where they were taken.
    pub(super) panoramas: Vec<Found>,
    /// Photographs that no camera file knows.
    pub(super) unposed: Vec<Found>,
    /// What another program has solved.
    pub(super) pose_file: Option<PoseFile>,
    /// Why it is left out, where it is.
    pub(super) left_out: Option<String>,
    /// The folder of the photographs that it names.
    pub(super) solved_folder: PathBuf,
    /// The camera file's own names of those among them that are probes.
    pub(super) solved_probes: Vec<String>,
    /// Pictures of a scan file, with their poses.
    pub(super) scanned: Vec<Scanned>,
}

impl Gathered {
    pub(super) fn of(sources: &Sources, warnings: &mut Vec<String>) -> Result<Self, InitError> {
        let mut read = |folder: &Option<PathBuf>| match folder {
            None => Ok(Vec::new()),
            Some(folder) => found::pictures(folder).map(|(pictures, odd)| {
                warnings.extend(odd);
                pictures
            }),
        };
        let (photos, probes) = (read(&sources.photos)?, read(&sources.probes)?);
        let folder = sources.photos.as_ref().or(sources.probes.as_ref()).cloned().unwrap_or_default();
        let known = if sources.photos.is_some() { &photos } else { &probes };
        let (files, odd) = found::pose_files(&folder, known);
        warnings.extend(odd);
        let mut files = files.into_iter();
        let pose_file = files.next();
        let others: Vec<String> = files.map(|p| p.path.display().to_string()).collect();
        if !others.is_empty() {
            warnings.push(format!("There are other camera files beside the pictures: {}.", others.join(", ")));
        }
        let solved = |picture: &Found| pose_file.as_ref().is_some_and(|f| f.knows(picture));
        let own_name = |picture: &Found| pose_file.as_ref()?.own_name(picture).map(str::to_owned);
        let (solved_photos, photos): (Vec<Found>, Vec<Found>) = photos.into_iter().partition(solved);
        // beside photographs the camera file is theirs: a probe of the same name is another picture
        let (solved_probes, probes): (Vec<Found>, Vec<Found>) =
            if sources.photos.is_none() { probes.into_iter().partition(solved) } else { (Vec::new(), probes) };
        let (panoramas, unposed): (Vec<Found>, Vec<Found>) =
            photos.into_iter().partition(|p| p.shape == Shape::Panorama);
        let panoramas: Vec<Found> = probes.into_iter().chain(panoramas).collect();
        let mut names: Vec<String> = solved_probes.iter().filter_map(own_name).collect();
        if panoramas.is_empty() && names.is_empty() {
            // photographs light the place, but every fifth is left to be compared with
            names = solved_photos.chunks(5).flat_map(|five| five.iter().take(4)).filter_map(own_name).collect();
        }
        let solved_folder = folder;
        Ok(Self { panoramas, unposed, pose_file, solved_folder, solved_probes: names, ..Self::default() })
    }
}
