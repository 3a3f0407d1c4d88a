//! The pictures that materials name: found, decoded once each, and spared where nothing shows them.

use rayon::prelude::*;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

use super::error::SceneError;
use super::health::Health;
use super::model::Map;
use super::{Texture, Wrap};
use crate::site::files::find_loosely;

/// Pictures, which of them each map became, and what was not decoded.
pub(super) struct Decoded {
    pub(super) textures: Vec<Texture>,
    pub(super) indices: Vec<Option<u32>>,
    pub(super) spared: Spared,
}

/// A picture that materials want.
#[derive(PartialEq)]
struct Picture {
    /// Its file; a name beside the model's where it stands in that.
    path: PathBuf,
    embedded: Option<Arc<[u8]>>,
    wrap: [Wrap; 2],
}

impl Picture {
    fn load(&self) -> Result<Option<Texture>, SceneError> {
        let texture = match &self.embedded {
            Some(bytes) => Texture::decode(&self.path, bytes.clone())?,
            None => Texture::load(&self.path)?,
        };
        Ok(texture.map(|texture| texture.wrapped(self.wrap)))
    }
}

/// One picture alone, decoded; `None` where it is not there or cannot be used.
pub(super) fn alone(folder: &Path, map: &Map, health: &mut Health) -> Option<Texture> {
    match decoded(folder, &[Some(map.clone())], &[true], health) {
        Ok(decoded) => decoded.textures.into_iter().next(),
        Err(e) => {
            health.warnings.push(e.to_string());
            None
        }
    }
}

/// Decodes each picture once. One that only materials out of reach have is not decoded: a white texel stands for it.
pub(super) fn decoded(
    folder: &Path,
    maps: &[Option<Map>],
    reached: &[bool],
    health: &mut Health,
) -> Result<Decoded, SceneError> {
    let mut pictures: Vec<Picture> = Vec::new();
    let mut seen: Vec<bool> = Vec::new();
    // by the file that names a picture, since it is looked for beside that, its name, and how it goes on
    let mut known: BTreeMap<_, usize> = BTreeMap::new();
    let mut numbers: Vec<Option<usize>> = vec![None; maps.len()];
    for ((map, number), reached) in maps.iter().zip(&mut numbers).zip(reached) {
        let Some(map) = map else { continue };
        let key = (&map.file, &map.name, map.wrap.map(Wrap::code));
        let place = match known.get(&key) {
            Some(place) => *place,
            None => {
                let embedded = map.embedded.clone();
                let within = embedded.as_ref().map(|_| map.file.with_file_name(&map.name));
                let Some(path) = within.or_else(|| texture_file(folder, map, health)) else { continue };
                let picture = Picture { path, embedded, wrap: map.wrap };
                pictures.iter().position(|p| *p == picture).unwrap_or_else(|| {
                    pictures.push(picture);
                    seen.push(false);
                    pictures.len() - 1
                })
            }
        };
        known.insert(key, place);
        seen[place] |= reached;
        *number = Some(place);
    }
    let start = Instant::now();
    let load = |(p, seen): (&Picture, &bool)| if *seen { p.load() } else { Ok(Some(Texture::blank())) };
    let decoded = pictures.par_iter().zip(&seen).map(load).collect::<Vec<_>>();
    let seconds = start.elapsed().as_secs_f64();
    let spared = Spared {
        textures: seen.iter().filter(|s| !**s).count(),
        bytes: pictures.iter().zip(&seen).filter(|(_, seen)| !**seen).map(|(p, _)| Texture::bytes_of(&p.path)).sum(),
        ..Spared::default()
    };
    let mut textures = Vec::new();
    let mut places = Vec::new();
    for (Picture { path, .. }, texture) in pictures.iter().zip(decoded) {
        let texture = texture?;
        places.push(texture.is_some().then_some(textures.len() as u32));
        if texture.is_none() {
            health.warnings.push(format!(
                "{}: not a PNG, JPEG or TIFF picture: the plain colour is taken. Save it again as PNG.",
                path.display()
            ));
        }
        textures.extend(texture);
    }
    health.files.extend(pictures.into_iter().filter(|p| p.embedded.is_none()).map(|p| p.path));
    let indices = numbers.into_iter().map(|number| places[number?]).collect();
    let read = textures.iter().map(Texture::bytes).sum::<usize>();
    let rate = if spared.textures < seen.len() { seconds / read.max(1) as f64 } else { 0.0 };
    Ok(Decoded { textures, indices, spared: Spared { seconds: rate * spared.bytes as f64, ..spared } })
}

/// The file a material means: beside its MTL file or the model, as written, in other letters, or by its last name.
fn texture_file(folder: &Path, map: &Map, health: &mut Health) -> Option<PathBuf> {
    let place = format!("{}:{}", map.file.display(), map.line);
    let folders = [map.file.parent().unwrap_or(folder), folder];
    if let Some(exact) = folders.iter().map(|f| f.join(&map.name)).find(|p| p.is_file()) {
        return Some(exact);
    }
    let last = map.name.rsplit(['/', '\\']).next().unwrap_or(&map.name);
    let names = [map.name.as_str(), last].into_iter().filter(|n| !n.is_empty());
    let near = names.flat_map(|n| folders.iter().map(move |f| (f, n))).find_map(|(f, n)| find_loosely(f, n));
    let fate = match &near {
        Some(near) => format!("“{}” is taken", near.display()),
        None => "the plain colour is taken".to_owned(),
    };
    health.warnings.push(format!("{place}: there is no picture “{}”: {fate}.", map.name));
    near
}

/// What was left out of a scene.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Spared {
    /// Triangles that are in the mesh, so that indices and bounds stay, but not in the ray caster.
    pub triangles: usize,
    /// Pictures that only these triangles have; they were not decoded.
    pub textures: usize,
    /// About what this saved, by what the rest took: seconds.
    pub seconds: f64,
    /// About what this saved, bytes.
    pub bytes: u64,
}
