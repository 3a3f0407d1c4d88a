//! Files that a site or a material names: finding them, and the size of a picture without decoding it.

use image::ImageDecoder;
use std::fs;
use std::io::Read;
use std::path::{Component, Path, PathBuf};

/// Whether a path is really a URL.
pub(crate) fn is_url(text: &str) -> bool {
    let scheme = text.split_once("://").map(|(scheme, _)| scheme);
    scheme.is_some_and(|s| !s.is_empty() && s.chars().all(|c| c.is_ascii_alphanumeric() || "+-.".contains(c)))
        || text.starts_with("data:")
        || text.starts_with("file:")
}

/// The file that `name` means in a folder where the name as written finds nothing: the same with `/` for `\`, and
/// any letter case.
pub(crate) fn find_loosely(folder: &Path, name: &str) -> Option<PathBuf> {
    let name = name.replace('\\', "/");
    let mut found = folder.to_owned();
    for part in Path::new(&name).components() {
        let next = found.join(part);
        found = match part {
            Component::Normal(wanted) if !next.exists() => {
                let wanted = wanted.to_string_lossy().to_lowercase();
                let mut names: Vec<_> = fs::read_dir(&found).ok()?.filter_map(|e| Some(e.ok()?.file_name())).collect();
                names.sort();
                found.join(names.into_iter().find(|n| n.to_string_lossy().to_lowercase() == wanted)?)
            }
            _ => next,
        };
    }
    found.is_file().then_some(found)
}

/// Width and height of a picture, upright, from its header alone; else why not.
pub(crate) fn picture_size(path: &Path) -> Result<(u32, u32), String> {
    let mut magic = [0; 4];
    let mut file = fs::File::open(path).map_err(|e| e.to_string())?;
    file.read_exact(&mut magic).map_err(|_| "the file is too short to be a picture".to_owned())?;
    if magic == [0x76, 0x2f, 0x31, 0x01] {
        let meta = exr::meta::MetaData::read_from_file(path, false).map_err(|e| e.to_string())?;
        let size = meta.headers.first().ok_or("the file holds no picture")?.shared_attributes.display_window.size;
        let side = |n: usize| u32::try_from(n).map_err(|_| "the picture is too large".to_owned());
        return Ok((side(size.width())?, side(size.height())?));
    }
    let reader = image::ImageReader::open(path).and_then(|r| r.with_guessed_format()).map_err(|e| e.to_string())?;
    let mut decoder = reader.into_decoder().map_err(|e| e.to_string())?;
    let (width, height) = decoder.dimensions();
    use image::metadata::Orientation as O;
    let turned = matches!(decoder.orientation(), Ok(O::Rotate90 | O::Rotate270 | O::Rotate90FlipH | O::Rotate270FlipH));
    Ok(if turned { (height, width) } else { (width, height) })
}
