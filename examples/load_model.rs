//! How long a model takes to load, with the ray caster over it: `load_model MODEL [UP [TIMES]]`, the best of so many
//! times. For the memory that it takes once: `/usr/bin/time -v target/release/examples/load_model MODEL`.

#![allow(clippy::print_stdout, reason = "its result goes to the console")]

use clerestory::scene::{self, Health};
use clerestory::site::Site;
use std::path::Path;
use std::time::Instant;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let model = Path::new(words.first().ok_or("expected a model")?);
    let up = words.get(1).map_or("z", String::as_str);
    let text = format!("[site]\nunits = \"m\"\nup = \"{up}\"\n[model]\npath = '{}'\n", model.display());
    let site = Site::of_text(Path::new("site.toml"), &text)?;
    let mut best = f64::INFINITY;
    let mut triangles = 0;
    for _ in 0..words.get(2).map_or(Ok(1), |times| times.parse())? {
        let start = Instant::now();
        triangles = scene::load(&site, &mut Health::default())?.mesh.triangles.len();
        best = best.min(start.elapsed().as_secs_f64());
    }
    println!("{triangles} triangles in {best:.2} s");
    Ok(())
}
