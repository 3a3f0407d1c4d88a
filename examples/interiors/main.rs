//! Writes a random interior as a site: `cargo run --release --example interiors -- DIR --seed N`.
//!
//! The same seed gives the same place; `--threads` changes no byte. Seeds below 1000 are there to develop on; figures that
//! are reported come from seeds from 1000 on.

#![allow(clippy::print_stdout, reason = "a tool for the terminal")]
#![allow(missing_docs, unreachable_pub, reason = "not a library")]

#[path = "../common/mod.rs"]
#[allow(dead_code, reason = "each example uses a part of it")]
mod common;
mod interior;

use interior::Options;
use std::error::Error;
use std::path::PathBuf;
use std::time::Instant;

const USAGE: &str = "usage: interiors DIR --seed N [--probe-size WIDTH] [--photo-size WIDTH] [--samples S] \
                     [--scan-triangles N] [--threads N] [--8-bit-probes] [--no-pictures] [--hand-held]";

fn main() -> Result<(), Box<dyn Error>> {
    let mut options = Options {
        seed: 0,
        probe_width: 1024,
        photo_size: [720, 480],
        samples: 9,
        links: 96,
        texels: 256.0,
        scan_triangles: 1e6,
        pictures: true,
        eight_bit: false,
        hand_held: false,
    };
    let (mut folder, mut threads, mut seeded) = (None, 1, false);
    let mut arguments = std::env::args().skip(1);
    while let Some(argument) = arguments.next() {
        let mut number = || -> Result<usize, Box<dyn Error>> {
            let text = arguments.next().ok_or_else(|| format!("{argument} wants a number; {USAGE}"))?;
            Ok(text.parse().map_err(|e| format!("{argument} {text}: {e}"))?)
        };
        match argument.as_str() {
            "--seed" => (options.seed, seeded) = (number()? as u64, true),
            "--probe-size" => options.probe_width = number()?,
            "--photo-size" => options.photo_size = number().map(|w| [w, w * 2 / 3])?,
            "--samples" => options.samples = number()?,
            "--scan-triangles" => options.scan_triangles = number()? as f64,
            "--threads" => threads = number()?,
            "--8-bit-probes" => options.eight_bit = true,
            "--hand-held" => options.hand_held = true,
            "--no-pictures" => options.pictures = false,
            other if other.starts_with("--") => return Err(format!("{other} is not known; {USAGE}").into()),
            _ => folder = Some(PathBuf::from(argument)),
        }
    }
    let folder = folder.filter(|_| seeded).ok_or(USAGE)?;
    rayon::ThreadPoolBuilder::new().num_threads(threads).build_global()?;
    let start = Instant::now();
    let drawn = interior::write(&folder, &options)?;
    let (kind, windows) = (drawn.kind, drawn.windows.len());
    println!("{}: {kind:?}, {windows} windows, {:.0} s", folder.display(), start.elapsed().as_secs_f64());
    Ok(())
}
