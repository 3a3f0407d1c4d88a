//! What leaving out what a site does not need saves: renders sites with and without `--all-stages`, each in a process of
//! its own, and writes `docs/stages.md`: processor time, peak memory and whether the pictures are the same, a row a site.
//!
//! `cargo run --release --example stage_plan -- PROGRAM make FOLDER` makes four of the six sites;
//! `cargo run --release --example stage_plan -- PROGRAM SITE…` measures; PROGRAM is the built clerestory; sites must have
//! their probes' pictures (`clerestory simulate` makes them).

#![allow(clippy::print_stdout)]

mod sites;

use std::error::Error;
use std::fmt::Write as _;
use std::fs;
use std::path::Path;
use std::process::Command;
use std::time::Instant;

type Outcome<T> = Result<T, Box<dyn Error>>;

/// Each way is run so often, by turns; the least time counts, as all else on a machine only adds to it.
const TURNS: usize = 5;

const HEAD: &str = "# What is left out, and what that saves

`check`, `render` and the report print, for each site, which stages of work it needs, which are left out and why, and
what that saves. `--all-stages` does everything; the pictures are the same to the last bit (`tests/light/stage_plan.rs`).

| a site with … | goes without | told by | what is saved |
|---|---|---|---|
| no place in any view that no probe sees | the volume | `check`, `render` | time and memory of its places, measured |
| parts behind closed walls, away from all probes and views | these triangles in the ray caster, and pictures that only they have, which are not decoded | `check`, `render` | measured on the rest |
| several lightings | decoding and giving out those not asked for | `check`, `render` | time by the rate of those that are read; memory of their pixels |
| one probe | weighing probes against each other | `check`, `render` | next to nothing: a loop over one |
| no texture | decoding and looking up pictures | `check`, `render` | there is none to decode |
| no photograph | the audit, and comparing | `check`, `report` | all of its time: it is not begun |
| no probe | shooting, volume, rendering, audit, study | `check`, `report` | all of their time |
| a model too low for two storeys | looking for more than one floor | `check` | nothing: the pass that finds where a tripod can stand gives the one floor's height too |
| any size | dividing the volume's cells | `check` | nothing: the method has no such stage. Values stand on surfaces, only those near places that a view asks for are worked out, and plain cells find them |

## Six sites

Each rendered by a process of its own with two threads, with and without `--all-stages`, five times by turns; the least
processor time of each, and peak memory. Made by

```text
cargo build --release
cargo run --release --example stage_plan -- target/release/clerestory make FOLDER
cargo run --release --example stage_plan -- target/release/clerestory sites/chapel ../shared/data/truth/sibenik \\
    FOLDER/ctk_church FOLDER/copyroom FOLDER/one-probe FOLDER/untextured
```

| site | left out | processor s | with all | saved | peak MiB | with all | same pictures |
|---|---|---:|---:|---:|---:|---:|---|
";

/// One rendering: processor seconds, peak bytes, what was left out, pictures' bytes.
struct Run {
    seconds: f64,
    peak: f64,
    left_out: Vec<String>,
    pictures: Vec<Vec<u8>>,
}

fn main() -> Outcome<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let usage = "usage: stage_plan PROGRAM make FOLDER, or stage_plan PROGRAM SITE…";
    let (program, sites) = arguments.split_first().ok_or(usage)?;
    match sites {
        [] => Err(usage.into()),
        [make, folder] if make == "make" => sites::make(program, Path::new(folder)),
        sites => measure(program, sites),
    }
}

fn measure(program: &str, sites: &[String]) -> Outcome<()> {
    let mut text = HEAD.to_owned();
    for site in sites {
        let mut lean: Option<Run> = None;
        let mut full: Option<Run> = None;
        for _ in 0..TURNS {
            lean = Some(better(lean, run(program, site, &[])?));
            full = Some(better(full, run(program, site, &["--all-stages"])?));
        }
        let (Some(lean), Some(full)) = (lean, full) else { continue };
        let name = Path::new(site).file_name().map_or_else(|| site.clone(), |n| n.to_string_lossy().into_owned());
        let row = format!(
            "| {name} | {} | {:.2} | {:.2} | {:.0} % | {:.0} | {:.0} | {} |",
            if lean.left_out.is_empty() { "nothing".to_owned() } else { lean.left_out.join(", ") },
            lean.seconds,
            full.seconds,
            100.0 * (1.0 - lean.seconds / full.seconds),
            lean.peak,
            full.peak,
            if lean.pictures == full.pictures { "yes" } else { "NO" }
        );
        println!("{row}");
        writeln!(text, "{row}")?;
    }
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/stages.md");
    Ok(fs::write(file, text)?)
}

/// The quicker of two runs.
fn better(before: Option<Run>, now: Run) -> Run {
    match before {
        Some(before) if before.seconds <= now.seconds => before,
        _ => now,
    }
}

fn run(program: &str, site: &str, more: &[&str]) -> Outcome<Run> {
    let out = std::env::temp_dir().join(format!("stage-plan-{}", std::process::id()));
    let (start, before) = (Instant::now(), children_seconds());
    let done = Command::new(program)
        .args(["--threads", "2", "render", site, "--json", "--out"])
        .arg(&out)
        .args(more)
        .output()?;
    let spent = children_seconds().zip(before).map(|(after, before)| after - before);
    let seconds = spent.unwrap_or_else(|| start.elapsed().as_secs_f64());
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

/// Processor seconds of all child processes that have ended, where Linux tells: fields 16 and 17 of `/proc/self/stat`, in
/// hundredths.
fn children_seconds() -> Option<f64> {
    let stat = fs::read_to_string("/proc/self/stat").ok()?;
    // the second field may hold blanks, but ends with the last bracket
    let fields: Vec<&str> = stat.rsplit_once(')')?.1.split_whitespace().collect();
    let ticks = |i: usize| fields.get(i)?.parse::<f64>().ok();
    Some((ticks(13)? + ticks(14)?) / 100.0)
}
