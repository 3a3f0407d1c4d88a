//! Pictures and camera files in folders, and what they seem to be.

use std::collections::{BTreeMap, VecDeque};
use std::path::{Path, PathBuf};

use super::InitError;
use crate::panorama::{self, Exif};
use crate::site::files::{PICTURES, is_picture};
use crate::site::{files_of_poses, pose_file_photographs};

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
        if is_picture(&path) && path.is_file() {
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
        return Err(InitError::NoPicture { path: folder.to_owned(), endings: PICTURES.join(", ") });
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

/// Bare digits are times of day only where neighbours lie at least this far apart, minutes: what is nearer is counted.
const LEAST_APART: u32 = 10;

/// Pictures of one place under several lightings, by the time at the end of their names: `west_1000`, `west_14-30`. In order
/// of names; each with its lighting, empty where it stands alone.
pub(super) fn by_lighting(pictures: &[Found]) -> Vec<(String, Vec<(String, &Found)>)> {
    let timed: Vec<Option<Timed>> = pictures.iter().map(|p| Timed::of(&p.stem())).collect();
    let mut minutes: BTreeMap<&str, Vec<u32>> = BTreeMap::new();
    timed.iter().flatten().for_each(|t| minutes.entry(&t.base).or_default().push(t.minutes));
    // whether a base's endings are lightings: those with a separator, and bare digits
    let lightings: BTreeMap<&str, [bool; 2]> = minutes
        .into_iter()
        .map(|(base, mut all)| {
            let several = all.len() > 1;
            all.sort_unstable();
            all.dedup();
            (base, [several, all.len() > 1 && all.windows(2).all(|two| two[1] - two[0] >= LEAST_APART)])
        })
        .collect();
    let is_lighting = |t: &Timed| lightings.get(t.base.as_str()).is_some_and(|of| of[usize::from(t.bare)]);
    let mut places: Vec<(String, Vec<(String, &Found)>)> = Vec::new();
    for (picture, timed) in pictures.iter().zip(&timed) {
        let (name, lighting) = match timed {
            Some(t) if is_lighting(t) => (t.base.clone(), t.time.clone()),
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
struct Timed {
    base: String,
    time: String,
    /// Since midnight.
    minutes: u32,
    /// Whether the time is four digits without a separator, which may be a number as well.
    bare: bool,
}

impl Timed {
    fn of(stem: &str) -> Option<Self> {
        let end = stem.trim_end_matches(|c: char| c.is_ascii_digit() || "-.h:".contains(c));
        let ending = &stem[end.len()..];
        let digits: String = ending.chars().filter(char::is_ascii_digit).collect();
        let base = end.strip_suffix(['_', '-', ' ']).filter(|b| !b.is_empty())?;
        let (hour, minute) = (digits.get(..2)?, digits.get(2..).filter(|m| m.len() == 2)?);
        let below = |text: &str, most: u32| text.parse::<u32>().ok().filter(|v| *v < most);
        Some(Self {
            base: base.to_owned(),
            time: format!("{hour}:{minute}"),
            minutes: 60 * below(hour, 24)? + below(minute, 60)?,
            bare: ending.len() == digits.len(),
        })
    }
}

/// A file or folder of cameras that another program has solved.
#[derive(Clone, Debug)]
pub(super) struct PoseFile {
    pub(super) path: PathBuf,
    /// Its photographs' names as the file has them, by their [`bare_names`].
    names: BTreeMap<String, String>,
}

impl PoseFile {
    /// Whether it names a picture, with or without folders and ending.
    pub(super) fn knows(&self, picture: &Found) -> bool {
        self.own_name(picture).is_some()
    }

    /// Its own name of a picture, the only one that is sure to be understood where it is read.
    pub(super) fn own_name(&self, picture: &Found) -> Option<&str> {
        self.names.get(&picture.stem().to_lowercase()).map(String::as_str)
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
            Ok(photographs) => {
                let named =
                    |own: &String| bare_names(own).into_iter().map(|bare| (bare, own.clone())).collect::<Vec<_>>();
                Ok(PoseFile { path, names: photographs.iter().flat_map(named).collect() })
            }
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
        if !files_of_poses(&folder).is_empty() {
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
        let parted = |stem: &str| Timed::of(stem).map(|t| format!("{} at {}", t.base, t.time));
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
    fn numbers_at_the_end_of_names_are_no_lightings() {
        let names = |all: &[&str]| -> Vec<String> {
            let all: Vec<Found> = all.iter().map(|name| found(PathBuf::from(name), [512, 256])).collect();
            by_lighting(&all).iter().map(|(name, pictures)| format!("{name} ×{}", pictures.len())).collect()
        };
        let counted = ["pano_0001.png", "pano_0002.png", "pano_0003.png"];
        assert_eq!(names(&counted), ["pano_0001 ×1", "pano_0002 ×1", "pano_0003 ×1"]);
        // two that are next to each other are enough
        let camera = ["IMG_1234.jpg", "IMG_1235.jpg", "IMG_1301.jpg"];
        assert_eq!(names(&camera), ["IMG_1234 ×1", "IMG_1235 ×1", "IMG_1301 ×1"]);
        assert_eq!(names(&["a_1000.exr", "a_1010.exr"]), ["a ×2"]);
        // one time twice is one lighting
        assert_eq!(names(&["a_1000.exr", "a_1000.hdr"]), ["a_1000 ×1", "a_1000 ×1"]);
        // nobody counts like this
        assert_eq!(names(&["a_10-00.exr", "a_10h01.exr"]), ["a ×2"]);
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
