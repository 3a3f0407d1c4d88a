//! What a new lighting of the same probes costs as a sparse product, and how far it is from shooting anew.
//!
//! `cargo run --release --example light_product -- [SITE] [FRAMES]`, on 2 threads: bakes the site under its first lighting,
//! makes the operator for all baked vertices, and multiplies. Reading pictures is told apart.

#![allow(clippy::print_stdout, reason = "its result goes to the console")]

#[path = "common/direct.rs"]
mod direct;

use clerestory::bake::{self, Bake, bake};
use clerestory::panorama::{Picture, Radiometry};
use clerestory::render::{Options, Relit, Source, pictures};
use clerestory::scene::{self, Health, Scene};
use clerestory::shoot::{Light, Outside};
use clerestory::site::Site;
use clerestory::transfer::{Point, Transfer};
use clerestory::volume::{self, Volume};
use direct::direct;
use glam::Vec3;
use std::path::PathBuf;
use std::time::Instant;

type Fault = Box<dyn std::error::Error + Send + Sync>;

fn main() -> Result<(), Fault> {
    let mut arguments = std::env::args().skip(1);
    let path = PathBuf::from(arguments.next().unwrap_or_else(|| "sites/chapel".to_owned()));
    let frames: usize = arguments.next().map_or(Ok(100), |n| n.parse())?;
    let pool = rayon::ThreadPoolBuilder::new().num_threads(2).build()?;
    let site = Site::load(&path)?;
    let scene = scene::load(&site, &mut Health::default())?;
    pool.install(|| measure(&site, &scene, frames))
}

fn measure(site: &Site, scene: &Scene, frames: usize) -> Result<(), Fault> {
    let lightings: Vec<String> = site.lightings().into_iter().take(1).collect();
    let options = Options { lightings, volume: volume::VolumeSettings::default().for_products(), ..Options::of(site) };
    let start = Instant::now();
    let Bake { baked, setup } = bake(site, scene, &options, &bake::BakeSettings::default(), &|_| ())?;
    println!("bake: {} vertices, {:.1} s", baked.vertices.len(), start.elapsed().as_secs_f64());
    let points: Vec<Point> = baked.vertices.iter().map(|v| (v.position, v.normal)).collect();
    let (name, light) = &setup.lights[0];
    let volume = setup.volume(scene, 0);
    let relit = Relit { scene, light, volume: volume.as_ref(), volume_only: false };
    let start = Instant::now();
    let own = pictures(site, name, site.probes.len(), 0)?;
    println!("decode: {:.0} ms", 1e3 * start.elapsed().as_secs_f64());
    let fed: Vec<(&Picture, Radiometry)> = own.iter().map(|(p, r)| (p, *r)).collect();
    let start = Instant::now();
    let transfer = Transfer::new(&relit, &fed, &points);
    println!("operator: {:.1} s", start.elapsed().as_secs_f64());
    let shown: Vec<&Picture> = own.iter().map(|p| &p.0).collect();
    let sun = light.sun.map_or(Vec3::ZERO, |s| s.irradiance);
    let (mut least, mut sum, mut product) = ([f64::INFINITY; 2], 0.0, Vec::new());
    for _ in 0..frames.max(1) {
        let start = Instant::now();
        let measured = transfer.measure(&shown);
        let half = start.elapsed().as_secs_f64();
        product = transfer.light(&measured, sun, Vec3::ONE);
        let whole = start.elapsed().as_secs_f64();
        least = [least[0].min(half), least[1].min(whole - half)];
        sum += whole;
    }
    println!(
        "a new lighting: cells {:.1} ms + product {:.1} ms at best; {:.1} a second over {frames} frames",
        1e3 * least[0],
        1e3 * least[1],
        frames as f64 / sum
    );
    let truth = direct(&relit, &points);
    let share = |of: Source| 100.0 * truth.iter().filter(|t| t.1 == of).count() as f64 / truth.len().max(1) as f64;
    let (records, volume) = (share(Source::Record), share(Source::Volume));
    println!("lit by records {records:.1} %, by the volume {volume:.1} %, guessed {:.1} %", 100.0 - records - volume);
    tell("its own lighting", &product, &truth);
    // another lighting: warmer, and with one probe's light halved, which weights do not go along with
    let other: Vec<Picture> = (own.iter().enumerate())
        .map(|(i, (p, _))| {
            let tint = Vec3::new(1.2, 1.0, 0.7) * if i == 0 { 0.5 } else { 1.0 };
            Picture { pixels: p.pixels.iter().map(|l| *l * tint).collect(), ..p.clone() }
        })
        .collect();
    let anew: Vec<_> = (light.records.iter().zip(&other).zip(&own))
        .map(|((r, p), (_, radiometry))| (r.hits().clone(), p, *radiometry))
        .collect();
    let light = Light::new(scene, anew, light.sun, Outside::of(site)?);
    let volume = setup.transports.first().map(|t| Volume::new(scene, t, &light));
    let relit = Relit { scene, light: &light, volume: volume.as_ref(), volume_only: false };
    let sun = light.sun.map_or(Vec3::ZERO, |s| s.irradiance);
    let product = transfer.light(&transfer.measure(&other.iter().collect::<Vec<_>>()), sun, Vec3::ONE);
    tell("another lighting", &product, &direct(&relit, &points));
    Ok(())
}

fn tell(name: &str, product: &[Vec3], truth: &[(Vec3, Source)]) {
    let mean = truth.iter().map(|(e, _)| e.max_element()).sum::<f32>() / truth.len().max(1) as f32;
    let one = |(a, (b, _)): (&Vec3, &(Vec3, Source))| (*a - *b).abs().max_element() / b.max_element().max(0.01 * mean);
    let mut off: Vec<f32> = product.iter().zip(truth).map(one).collect();
    off.sort_by(f32::total_cmp);
    let at = |share: f64| off[((off.len() - 1) as f64 * share) as usize];
    let beyond = off.iter().filter(|o| **o > 1e-5).count() as f64 / off.len().max(1) as f64;
    println!(
        "{name}: off by more than 1e-5 at {:.2} % of the vertices; median {:.1e}, 95 % {:.1e}, 99 % {:.1e}, most {:.1e}",
        100.0 * beyond,
        at(0.5),
        at(0.95),
        at(0.99),
        at(1.0)
    );
}
