//! Solves the published art-gallery instances and compares with their published optima.
//!
//! `cargo run --release --example gallery_instances -- [--certify SECONDS] [--only TEXT] [FOLDER]`

#![allow(clippy::print_stdout)] // a table is what it is for

use clerestory::plan::free_space::open_space::OpenSpace;
use clerestory::plan::free_space::polygon::Polygon;
use clerestory::plan::gallery::{Effort, Guards, guard};
use glam::DVec2;
use std::path::PathBuf;
use std::time::{Duration, Instant};

#[derive(serde::Deserialize)]
struct File {
    outer: Vec<[f64; 2]>,
    #[serde(default)]
    holes: Vec<Vec<[f64; 2]>>,
}

struct Row {
    vertices: usize,
    optimum: usize,
    guards: Guards,
    seconds: f64,
}

fn main() -> anyhow::Result<()> {
    let mut arguments = std::env::args().skip(1);
    let (mut effort, mut only, mut folder) =
        (Effort::default(), String::new(), PathBuf::from("../shared/data/gallery"));
    while let Some(argument) = arguments.next() {
        match argument.as_str() {
            "--certify" => {
                let seconds: f64 = arguments.next().unwrap_or_default().parse()?;
                effort = Effort { certify: true, time_limit: Some(Duration::from_secs_f64(seconds)) };
            }
            "--only" => only = arguments.next().unwrap_or_default(),
            _ => folder = argument.into(),
        }
    }
    let table = std::fs::read_to_string(folder.join("optima.csv"))?;
    println!(
        "{:<56} {:>5} {:>4} {:>4} {:>4} {:>7} {:>6} {:>6}  unseen",
        "file", "n", "opt", "got", "lb", "s", "rounds", "wit"
    );
    let mut rows = Vec::new();
    for line in table.lines().skip(1).filter(|l| l.contains(&only)) {
        let fields: Vec<&str> = line.split(',').collect();
        let row = solve(&folder.join(fields[0]), fields[2].parse()?, fields[4].parse()?, effort)?;
        let g = &row.guards;
        let wrong = if g.lower_bound > row.optimum || g.guards.len() < row.optimum { "  WRONG" } else { "" };
        println!(
            "{:<56} {:>5} {:>4} {:>4} {:>4} {:>7.2} {:>6} {:>6}  {:.1e}{wrong}",
            fields[0],
            row.vertices,
            row.optimum,
            g.guards.len(),
            g.lower_bound,
            row.seconds,
            g.rounds,
            g.witnesses,
            1.0 - g.covered_fraction
        );
        rows.push(row);
    }
    summary("up to 200 vertices", &rows.iter().filter(|r| r.vertices < 250).collect::<Vec<_>>());
    summary("about 500 vertices", &rows.iter().filter(|r| (250..600).contains(&r.vertices)).collect::<Vec<_>>());
    summary("about 1000 vertices", &rows.iter().filter(|r| r.vertices >= 600).collect::<Vec<_>>());
    summary("all", &rows.iter().collect::<Vec<_>>());
    Ok(())
}

fn solve(file: &PathBuf, vertices: usize, optimum: usize, effort: Effort) -> anyhow::Result<Row> {
    let File { outer, holes } = serde_json::from_slice(&std::fs::read(file)?)?;
    let ring = |r: Vec<[f64; 2]>| r.into_iter().map(DVec2::from).collect::<Vec<_>>();
    let polygon = Polygon { outer: ring(outer), holes: holes.into_iter().map(ring).collect() };
    let start = Instant::now();
    let guards = guard(&OpenSpace::new(&[polygon])?, effort);
    Ok(Row { vertices, optimum, guards, seconds: start.elapsed().as_secs_f64() })
}

fn summary(what: &str, rows: &[&Row]) {
    let count = |f: &dyn Fn(&Row) -> bool| rows.iter().filter(|r| f(r)).count();
    let ratio: f64 =
        rows.iter().map(|r| r.guards.guards.len() as f64 / r.optimum as f64).sum::<f64>() / rows.len() as f64;
    println!(
        "{what}: {} instances, {} proved and equal to the optimum, {} equal, {} within one, mean guards/optimum {ratio:.4}, \
         lower bound above the optimum {}, longest {:.2} s",
        rows.len(),
        count(&|r| r.guards.proved() && r.guards.guards.len() == r.optimum),
        count(&|r| r.guards.guards.len() == r.optimum),
        count(&|r| r.guards.guards.len().abs_diff(r.optimum) <= 1),
        count(&|r| r.guards.lower_bound > r.optimum),
        rows.iter().map(|r| r.seconds).fold(0.0, f64::max),
    );
}
