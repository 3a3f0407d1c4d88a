//! What leaving out what a site does not need saves: renders sites with and without `--all-stages`, each in a process of
//! its own, and prints time, peak memory and whether the pictures are the same, a Markdown row a site.
//!
//! `cargo run --release --example stage_plan -- PROGRAM SITE…`; PROGRAM is the built clerestory; sites
//! must have their probes' pictures (`clerestory simulate` makes them).

#![allow(clippy::print_stdout)]

use std::error::Error;
use std::fs;
use std::path::Path;
use std::process::Command;
use std::time::Instant;

type Outcome<T> = Result<T, Box<dyn Error>>;

/// One rendering: seconds on the wall, peak bytes, what was left out, a picture's bytes.
struct Run {
    seconds: f64,
    peak: f64,
    left_out: Vec<String>,
    pictures: Vec<Vec<u8>>,
}

fn main() -> Outcome<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let (program, sites) = arguments.split_first().ok_or("usage: stage_plan PROGRAM SITE…")?;
    println!("| site | left out | without them, s | with all, s | without them, MiB | with all, MiB | same pictures |");
    println!("|---|---|---:|---:|---:|---:|---|");
    for site in sites {
        let lean = run(program, site, &[])?;
        let full = run(program, site, &["--all-stages"])?;
        let same = lean.pictures == full.pictures;
        println!(
            "| {site} | {} | {:.2} | {:.2} | {:.0} | {:.0} | {} |",
            if lean.left_out.is_empty() { "nothing".to_owned() } else { lean.left_out.join(", ") },
            lean.seconds,
            full.seconds,
            lean.peak,
            full.peak,
            if same { "yes" } else { "NO" }
        );
    }
    Ok(())
}

fn run(program: &str, site: &str, more: &[&str]) -> Outcome<Run> {
    let out = std::env::temp_dir().join(format!("stage-plan-{}", std::process::id()));
    let start = Instant::now();
    let done = Command::new(program)
        .args(["--threads", "2", "render", site, "--json", "--out"])
        .arg(&out)
        .args(more)
        .output()?;
    let seconds = start.elapsed().as_secs_f64();
    if !done.status.success() {
        return Err(format!("{site}: {}", String::from_utf8_lossy(&done.stderr)).into());
    }
    let json: serde_json::Value = serde_json::from_slice(&done.stdout)?;
    let peak = json["peak_bytes"].as_f64().unwrap_or(0.0) / f64::from(1 << 20);
    let stages = json["left_out"].as_array().into_iter().flatten();
    let left_out = stages.filter_map(|l| l["stage"].as_str().map(str::to_owned)).collect();
    let views = json["views"].as_array().into_iter().flatten();
    let files = views.filter_map(|v| v["file"].as_str());
    let pictures = files.map(|f| fs::read(Path::new(f))).collect::<Result<_, _>>()?;
    fs::remove_dir_all(&out)?;
    Ok(Run { seconds, peak, left_out, pictures })
}
