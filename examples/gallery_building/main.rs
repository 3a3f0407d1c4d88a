//! Writes a generated building as a `gallery` file, and tells how long one visibility query takes in it.
//!
//! `cargo run --release --example gallery_building -- 20000 200 > building.json`

#![allow(clippy::print_stdout, clippy::print_stderr)]

mod building;

use clerestory::plan::free_space::open_space::OpenSpace;
use glam::DVec2;
use std::time::Instant;

fn main() -> anyhow::Result<()> {
    let mut numbers = std::env::args().skip(1).map(|a| a.parse::<usize>());
    let corners = numbers.next().transpose()?.unwrap_or(1000);
    let holes = numbers.next().transpose()?.unwrap_or(20);
    let polygon = building::building(corners, holes, 1);
    let open = OpenSpace::new(std::slice::from_ref(&polygon))?;
    let places = building::places(&open, 10_000);
    let (start, mut points) = (Instant::now(), 0);
    for &p in &places {
        points += open.visibility(p).map_or(0, |seen| seen.ring.len());
    }
    let (each, points) = (start.elapsed().as_secs_f64() * 1e6 / 1e4, points as f64 / 1e4);
    eprintln!(
        "{} corners, {} holes, {each:.2} µs a query, {points:.1} points seen",
        open.corners().len(),
        polygon.holes.len()
    );
    let array = |r: &Vec<DVec2>| r.iter().map(DVec2::to_array).collect::<Vec<_>>();
    let holes: Vec<_> = polygon.holes.iter().map(array).collect();
    println!("{}", serde_json::json!({ "outer": array(&polygon.outer), "holes": holes }));
    Ok(())
}
