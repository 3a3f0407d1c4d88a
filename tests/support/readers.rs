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

/// Gives bytes to a reader, as a file in `folder`, which is its own: what it warns of, or why it refuses them.
pub(crate) fn read(reader: &str, bytes: &[u8], folder: &Path) -> Result<String, String> {
    fn said<T>(result: Result<T, impl std::fmt::Display>) -> Result<String, String> {
        result.map(|_| String::new()).map_err(|e| e.to_string())
    }
    let put = |name: &str, bytes: &[u8]| {
        let path = folder.join(name);
        fs::write(&path, bytes).map_err(|e| e.to_string()).map(|()| path)
    };
    let put_model = || if folder.join("m.obj").exists() { Ok(()) } else { put("m.obj", MODEL.as_bytes()).map(|_| ()) };
    let site_of = |model: &str| {
        let text = SITE.replace("m.obj", model);
        Site::of_text(&folder.join("site.toml"), &text).map_err(|e| e.to_string())
    };
    let load = |model: &str| {
        let mut health = Health::default();
        scene::load(&site_of(model)?, &mut health).map_err(|e| e.to_string())?;
        Ok(health.warnings.join(" "))
    };
    match reader {
        "exr" | "hdr" | "png" | "jpeg" | "tiff" => {
            let path = put("in", bytes)?;
            let _ = (panorama::dimensions(&path), panorama::quarter_turns(&path), Exif::read(&path));
            let _ = Texture::load(&path);
            let picture = panorama::read(&path).map_err(|e| e.to_string())?;
            Ok(format!("{}{}", "x".repeat(picture.width.ilog2() as usize), "y".repeat(picture.height.ilog2() as usize)))
        }
        "obj" => {
            put("in.obj", bytes)?;
            load("in.obj")
        }
        "ply" => {
            put("in.ply", bytes)?;
            load("in.ply")
        }
        "gltf" => {
            let name = if bytes.starts_with(b"glTF") { "in.glb" } else { "in.gltf" };
            put(name, bytes)?;
            load(name)
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
            put_model()?;
            put("m.mtl", bytes)?;
            load("m.obj")
        }
        "toml" => {
            put_model()?;
            put("site.toml", bytes)?;
            said(Site::load_with(folder, Pictures::MayBeMissing))
        }
        "walk" => {
            put_model()?;
            said(walk(&site_of("m.obj")?, &put("walk.toml", bytes)?))
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
