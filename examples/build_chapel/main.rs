//! Makes the bundled site, `sites/chapel`: `cargo run --release --example build_chapel -- sites/chapel`.
//!
//! Models, pictures, sky and site files take a second. Probes and photographs are then path-traced, which takes
//! minutes; `--no-simulation` leaves them as they are.

#![allow(clippy::print_stdout, reason = "a tool for the terminal")]
#![allow(missing_docs, unreachable_pub, reason = "not a library")]

mod chapel;
#[path = "../common/mod.rs"]
#[allow(dead_code, reason = "each example uses a part of it")]
mod common;
mod denoise;
mod simulate;

use clerestory::panorama::{Layer, write_exr};
use std::error::Error;
use std::path::{Path, PathBuf};

fn main() -> Result<(), Box<dyn Error>> {
    let mut samples = Some(128);
    let mut folder = None;
    let mut arguments = std::env::args().skip(1);
    while let Some(argument) = arguments.next() {
        match argument.as_str() {
            "--no-simulation" => samples = None,
            "--samples" => samples = Some(arguments.next().ok_or("--samples wants a number")?.parse()?),
            _ => folder = Some(PathBuf::from(argument)),
        }
    }
    let folder = folder.ok_or("usage: build_chapel FOLDER [--no-simulation | --samples N]")?;
    write_files(&folder)?;
    if let Some(samples) = samples {
        simulate::all(&folder, samples)?;
    }
    Ok(())
}

/// Everything that needs no simulation.
fn write_files(folder: &Path) -> Result<(), Box<dyn Error>> {
    for (name, bytes) in chapel::files()? {
        let path = folder.join(name);
        std::fs::create_dir_all(path.parent().unwrap_or(folder))?;
        std::fs::write(path, bytes)?;
    }
    let sky = chapel::sky::picture();
    let layer = Layer::vectors("", ["R", "G", "B"], &sky.pixels, true);
    write_exr(&folder.join("sky.exr"), sky.width, sky.height, &[layer], None)?;
    for version in [chapel::Version::Truth, chapel::Version::AsModelled] {
        println!("{version:?}: {} triangles", chapel::model(version).triangles());
    }
    println!("{} windows", chapel::building::windows().len());
    Ok(())
}
