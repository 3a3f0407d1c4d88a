//! All readers of files, by name, as fuzzing and the replay of its corpus call them.

use clerestory::panorama::{self, Exif};
use clerestory::scene::e57::{ScanPictures, setups};
use clerestory::scene::{self, Health, Texture};
use clerestory::site::{Pictures, Site, pose_file_photographs, walk};
use clerestory::study::Study;
use clerestory::{report, study};
use std::fs;
use std::path::Path;

/// The readers' names, each that of a folder of seeds.
pub(crate) const READERS: [&str; 15] =
    ["colmap", "e57", "exr", "gltf", "hdr", "jpeg", "json", "mtl", "obj", "ply", "png", "tiff", "toml", "walk", "xml"];

/// Between the two files of a COLMAP model: images before it, cameras after it.
const PARTED: &[u8] = b"\n=====\n";

const SITE: &str = "[site]\nname = \"f\"\nunits = \"m\"\nup = \"z\"\n[model]\npath = \"m.obj\"\n";

const MODEL: &str = "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nusemtl a\n\
                     f 1/1 2/2 3/3\nusemtl b\nf 1/1 3/3 4/4\n";

/// Gives bytes to a reader, as a file in `folder`, which is its own; the error's words if it refuses them.
pub(crate) fn read(reader: &str, bytes: &[u8], folder: &Path) -> Result<(), String> {
    fn said<T>(result: Result<T, impl std::fmt::Display>) -> Result<(), String> {
        result.map(|_| ()).map_err(|e| e.to_string())
    }
    let put = |name: &str, bytes: &[u8]| {
        let path = folder.join(name);
        fs::write(&path, bytes).map_err(|e| e.to_string()).map(|()| path)
    };
    match reader {
        "exr" | "hdr" | "png" | "jpeg" | "tiff" => {
            let path = put("in", bytes)?;
            let _ = (panorama::dimensions(&path), panorama::quarter_turns(&path), Exif::read(&path));
            let _ = Texture::load(&path);
            said(panorama::read(&path))
        }
        "obj" => said(scene::mesh_of(&put("in.obj", bytes)?)),
        "ply" => said(scene::mesh_of(&put("in.ply", bytes)?)),
        "gltf" => {
            let path = put(if bytes.starts_with(b"glTF") { "in.glb" } else { "in.gltf" }, bytes)?;
            scene::mesh_of(&path).map_err(|e| e.to_string())?;
            let text = SITE.replace("m.obj", &path.file_name().unwrap_or_default().to_string_lossy());
            let site = Site::of_text(&folder.join("site.toml"), &text).map_err(|e| e.to_string())?;
            said(scene::load(&site, &mut Health::default()))
        }
        "e57" => {
            let path = put("in.e57", bytes)?;
            let _ = setups(&path);
            let pictures = ScanPictures::of(&path).map(|all| {
                for picture in all.pictures.iter().take(4) {
                    let _ = (all.picture(picture), all.mask(picture));
                }
            });
            said(scene::mesh_of(&path)).or(said(pictures))
        }
        "mtl" => {
            put("m.mtl", bytes)?;
            put("m.obj", MODEL.as_bytes())?;
            let site = Site::of_text(&folder.join("site.toml"), SITE).map_err(|e| e.to_string())?;
            said(scene::load(&site, &mut Health::default()))
        }
        "toml" => {
            put("m.obj", MODEL.as_bytes())?;
            put("site.toml", bytes)?;
            said(Site::load_with(folder, Pictures::MayBeMissing))
        }
        "walk" => {
            put("m.obj", MODEL.as_bytes())?;
            let site = Site::of_text(&folder.join("site.toml"), SITE).map_err(|e| e.to_string())?;
            said(walk(&site, &put("walk.toml", bytes)?))
        }
        "json" => {
            let outside = study::read_outside(&put("manifest.json", bytes)?, &["apse".to_owned()]);
            said(report::overview(folder)).or(said(outside)).or(said(serde_json::from_slice::<Study>(bytes)))
        }
        "colmap" => {
            let at = bytes.windows(PARTED.len()).position(|part| part == PARTED).unwrap_or(bytes.len());
            let (images, cameras) = (&bytes[..at], bytes.get(at + PARTED.len()..).unwrap_or_default());
            let ending = if images.contains(&0) { "bin" } else { "txt" };
            for other in ["images.bin", "images.txt"] {
                let _ = fs::remove_file(folder.join(other));
            }
            put(&format!("images.{ending}"), images)?;
            put(&format!("cameras.{ending}"), cameras)?;
            said(pose_file_photographs(folder))
        }
        "xml" => {
            let is_xmp = bytes.windows(4).any(|part| part == b"xcr:");
            said(pose_file_photographs(&put(if is_xmp { "in.xmp" } else { "in.xml" }, bytes)?))
        }
        other => Err(format!("there is no reader “{other}”")),
    }
}
