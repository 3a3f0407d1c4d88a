//! Pictures and camera files in folders, and what they seem to be.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::path::{Path, PathBuf};

use super::InitError;
use crate::panorama::{self, Exif};
use crate::site::pose_file_photographs;

/// Pictures that are read here, by the ending of their names.
const ENDINGS: [&str; 7] = ["exr", "hdr", "png", "jpg", "jpeg", "tif", "tiff"];

/// A picture and what its shape and its EXIF data tell.
#[derive(Clone, Debug)]
pub(super) struct Found {
    pub(super) path: PathBuf,
    pub(super) shape: Shape,
    /// Vertical field of view by EXIF, degrees.
    pub(super) fov_y: Option<f64>,
}

/// What a picture seems to be by its aspect.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Shape {
    /// Twice as wide as high: a latitude/longitude panorama.
    Panorama,
    /// As wide as high.
    Square,
    /// Three by four squares.
    Cross,
    /// Anything else.
    Photograph,
}

impl Found {
    /// The name without folders and ending.
    pub(super) fn stem(&self) -> String {
        self.path.file_stem().unwrap_or_default().to_string_lossy().into_owned()
    }
}

/// The pictures of a folder, in order of their names; those that cannot be read come as sentences.
pub(super) fn pictures(folder: &Path) -> Result<(Vec<Found>, Vec<String>), InitError> {
    let unreadable = |e: std::io::Error| InitError::Folder { path: folder.to_owned(), why: e.to_string() };
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(unreadable)? {
        let path = entry.map_err(unreadable)?.path();
        let ending = path.extension().map_or_else(String::new, |e| e.to_string_lossy().to_ascii_lowercase());
        if ENDINGS.contains(&ending.as_str()) && path.is_file() {
            files.push(path);
        }
    }
    files.sort();
    let (mut all, mut odd) = (Vec::new(), Vec::new());
    for path in files {
        if path.file_name().is_some_and(|name| name.to_str().is_none()) {
            odd.push(format!("{}: the name is no UTF-8, so that no site file can say it; left out.", path.display()));
            continue;
        }
        match panorama::dimensions(&path) {
            Ok((width, height)) => all.push(found(path, [width, height].map(|v| v.min(1 << 24) as u32))),
            Err(e) => odd.push(format!("{e}; left out.")),
        }
    }
    if all.is_empty() && odd.is_empty() {
        return Err(InitError::NoPicture { path: folder.to_owned(), endings: ENDINGS.join(", ") });
    }
    Ok((all, odd))
}

fn found(path: PathBuf, size: [u32; 2]) -> Found {
    let [width, height] = size.map(|v| f64::from(v.max(1)));
    let is = |aspect: f64| (width / height / aspect - 1.0).abs() < 0.01;
    let linear = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("exr") || e.eq_ignore_ascii_case("hdr"));
    let shape = if is(2.0) {
        Shape::Panorama
    } else if is(1.0) {
        Shape::Square
    } else if linear && (is(0.75) || is(4.0 / 3.0)) && size.iter().all(|s| s % 3 == 0 || s % 4 == 0) {
        Shape::Cross
    } else {
        Shape::Photograph
    };
    let focal = Exif::read(&path).focal_px(size[0], size[1]);
    let fov_y = focal.map(|f| (2.0 * (0.5 * height / f).atan()).to_degrees());
    Found { path, shape, fov_y }
}

/// Pictures of one place under several lightings, by the time at the end of their names: `west_1000`, `west_14-30`. In order
/// of names; each with its lighting, empty where it stands alone.
pub(super) fn by_lighting(pictures: &[Found]) -> Vec<(String, Vec<(String, &Found)>)> {
    let timed: Vec<Option<(String, String)>> = pictures.iter().map(|p| timed(&p.stem())).collect();
    let mut together: BTreeMap<&str, usize> = BTreeMap::new();
    timed.iter().flatten().for_each(|(base, _)| *together.entry(base).or_default() += 1);
    let mut places: Vec<(String, Vec<(String, &Found)>)> = Vec::new();
    for (picture, timed) in pictures.iter().zip(&timed) {
        let (name, lighting) = match timed {
            Some((base, time)) if together[base.as_str()] > 1 => (base.clone(), time.clone()),
            _ => (picture.stem(), String::new()),
        };
        match places.iter_mut().find(|p| p.0 == name && p.1.iter().all(|(l, _)| *l != lighting)) {
            Some(place) => place.1.push((lighting, picture)),
            None => places.push((name, vec![(lighting, picture)])),
        }
    }
    places
}

/// A name that ends in a time of day, parted: `west_1000` is `west` and `10:00`.
fn timed(stem: &str) -> Option<(String, String)> {
    let end = stem.trim_end_matches(|c: char| c.is_ascii_digit() || "-.h:".contains(c));
    let digits: String = stem[end.len()..].chars().filter(char::is_ascii_digit).collect();
    let base = end.strip_suffix(['_', '-', ' ']).filter(|b| !b.is_empty())?;
    let (hour, minute) = (digits.get(..2)?, digits.get(2..).filter(|m| m.len() == 2)?);
    let is = |text: &str, most: u32| text.parse::<u32>().is_ok_and(|v| v < most);
    (is(hour, 24) && is(minute, 60)).then(|| (base.to_owned(), format!("{hour}:{minute}")))
}

/// A file or folder of cameras that another program has solved.
#[derive(Clone, Debug)]
pub(super) struct PoseFile {
    pub(super) path: PathBuf,
    /// Its photographs' names, see [`bare_names`].
    names: BTreeSet<String>,
}

impl PoseFile {
    /// Whether it names a picture, with or without folders and ending.
    pub(super) fn knows(&self, picture: &Found) -> bool {
        self.names.contains(&picture.stem().to_lowercase())
    }
}

/// The camera files in or beside a folder of pictures, the one that knows most of them first; those that cannot be read come as
/// sentences.
pub(super) fn pose_files(folder: &Path, pictures: &[Found]) -> (Vec<PoseFile>, Vec<String>) {
    let beside = folder.canonicalize().ok().and_then(|f| Some(f.parent()?.to_owned()));
    let mut all: BTreeMap<PathBuf, Result<PoseFile, String>> = BTreeMap::new();
    for path in [Some(folder.to_owned()), beside].into_iter().flatten().flat_map(|f| candidates(&f)) {
        let Ok(whole) = path.canonicalize() else { continue };
        all.entry(whole).or_insert_with(|| match pose_file_photographs(&path) {
            Ok(photographs) => Ok(PoseFile { path, names: photographs.iter().flat_map(|p| bare_names(p)).collect() }),
            Err(e) => Err(format!("{e}; these cameras are left out.")),
        });
    }
    // most .xml files are about something else
    let odd =
        all.iter().filter(|(path, _)| path.is_dir()).filter_map(|(_, file)| file.as_ref().err().cloned()).collect();
    let known = |file: &PoseFile| pictures.iter().filter(|p| file.knows(p)).count();
    let mut all: Vec<PoseFile> = all.into_values().flatten().filter(|file| known(file) > 0).collect();
    all.sort_by_key(|file| std::cmp::Reverse(known(file)));
    (all, odd)
}

/// A photograph's name without folders, with and without its ending, in small letters.
fn bare_names(photograph: &str) -> Vec<String> {
    let name = photograph.replace('\\', "/").to_lowercase();
    let name = name.rsplit('/').next().unwrap_or(&name);
    let stem = name.rsplit_once('.').map(|(stem, _)| stem.to_owned());
    stem.into_iter().chain([name.to_owned()]).collect()
}

/// What may be a camera file in a folder and up to three levels below it.
fn candidates(folder: &Path) -> Vec<PathBuf> {
    /// A folder with more below it is somebody's home.
    const MOST: usize = 5000;
    let mut open = VecDeque::from([(folder.to_owned(), 0)]);
    let (mut found, mut seen) = (Vec::new(), 0);
    while let Some((folder, depth)) = open.pop_front() {
        let entries = std::fs::read_dir(&folder).into_iter().flatten().flatten().map(|e| e.path());
        let mut paths: Vec<PathBuf> = entries.take(MOST).collect();
        paths.sort();
        seen += paths.len();
        if seen > MOST {
            break;
        }
        let has = |ending: &str| {
            paths.iter().any(|p| p.extension().is_some_and(|e| e.eq_ignore_ascii_case(ending)) && p.is_file())
        };
        if ["bin", "txt"].iter().any(|e| folder.join(format!("images.{e}")).is_file()) || has("xmp") {
            found.push(folder.clone());
        }
        for path in paths {
            let hidden = path.file_name().is_some_and(|n| n.to_string_lossy().starts_with('.'));
            if path.is_dir() && depth < 3 && !hidden {
                open.push_back((path, depth + 1));
            } else if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("xml")) {
                found.push(path);
            }
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_at_the_end_of_names_are_lightings() {
        let parted = |stem: &str| timed(stem).map(|(base, time)| format!("{base} at {time}"));
        assert_eq!(parted("west_1000").as_deref(), Some("west at 10:00"));
        assert_eq!(parted("north aisle 14-30").as_deref(), Some("north aisle at 14:30"));
        assert_eq!([parted("IMG_2599"), parted("1000"), parted("p_160"), parted("west_20240101")], [const { None }; 4]);
        let picture = |name: &str| found(PathBuf::from(name), [512, 256]);
        let all = ["east_1000.exr", "west_1000.exr", "west_1430.exr"].map(picture);
        let places = by_lighting(&all);
        // a lone number is part of a name
        let names: Vec<(&str, usize)> = places.iter().map(|(name, pictures)| (name.as_str(), pictures.len())).collect();
        assert_eq!(names, [("east_1000", 1), ("west", 2)]);
        assert_eq!(places[1].1[1].0, "14:30");
    }

    #[test]
    fn shapes_are_told_by_aspect() {
        let shape = |name: &str, size| found(PathBuf::from(name), size).shape;
        assert_eq!(shape("a.exr", [512, 256]), Shape::Panorama);
        assert_eq!(shape("a.hdr", [300, 400]), Shape::Cross);
        assert_eq!(shape("a.jpg", [4000, 3000]), Shape::Photograph);
        assert_eq!(shape("a.jpg", [1000, 1000]), Shape::Square);
    }
}
