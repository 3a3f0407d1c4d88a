//! What relighting costs, as ratios within one run: a first and a second lighting of the same probes, each view's frame
//! beside its bare primary rays, and beside a path-traced picture of one sample a pixel.
//!
//! `cargo run --release --example relight_cost -- [SITE] [REPEATS]`, on 2 threads. Of each step the least of all repeats
//! counts, since a shared machine only ever adds time. Processor time is told where the system tells it (Linux).

#![allow(clippy::print_stdout, reason = "its result goes to the console")]

use clerestory::panorama::{self, Coding, Picture};
use clerestory::reference::{self, Lights};
use clerestory::render::{Relit, render, shown_points};
use clerestory::scene::{self, Health, Scene};
use clerestory::shoot::{Hits, Light, charted};
use clerestory::site::{Camera, Probe, Site};
use clerestory::volume::{self, Transport, Volume};

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

/// Samples a pixel.
const SAMPLES: u32 = 4;

fn main() -> Result<(), Fault> {
    let mut arguments = std::env::args().skip(1);
    let path = arguments.next().map(PathBuf::from).or_else(site).ok_or("usage: relight_cost SITE [REPEATS]")?;
    let repeats: usize = arguments.next().map_or(Ok(5), |n| n.parse())?;
    let pool = rayon::ThreadPoolBuilder::new().num_threads(2).build()?;
    let site = Site::load(&path)?;
    let scene = scene::load(&site, &mut Health::default())?;
    pool.install(|| measure(&site, &scene, repeats))
}

fn measure(site: &Site, scene: &Scene, repeats: usize) -> Result<(), Fault> {
    let read: Vec<_> = site
        .probes
        .iter()
        .map(|p| Ok((p, charted(panorama::read(&p.pictures[0].path)?, p.projection))))
        .collect::<Result<_, panorama::PanoramaError>>()?;
    let cameras: Vec<Camera> = site.views.iter().map(|v| v.camera).collect();
    let mut clock = Clock::default();
    let mut made = None;
    for _ in 0..repeats {
        let hits: Vec<Arc<Hits>> =
            clock.time("shoot", || read.iter().map(|(p, (chart, _))| shoot(scene, p, chart.clone())).collect());
        let light = clock.time("index", || shine(scene, site, &read, &hits));
        let transport = clock.time("volume: rays", || {
            let wanted = shown_points(scene, Some(&light), &cameras);
            Transport::cast(scene, &wanted, &[&light], &volume::VolumeSettings::default())
        });
        clock.time("volume: light", || Volume::new(scene, &transport, &light).len());
        // another lighting of the same probes
        let second = clock.time("index, second", || shine(scene, site, &read, &hits));
        clock.time("volume: light, second", || Volume::new(scene, &transport, &second).len());
        made = Some((light, transport));
    }
    let Some((light, transport)) = made else { return Ok(()) };
    let volume = Volume::new(scene, &transport, &light);
    let lights = Lights::load(site, scene)?;
    let traced = reference::ReferenceSettings { samples: 2, ..reference::ReferenceSettings::default() };
    println!("{:32} {:>9} {:>14}", "step, least of repeats", "wall, ms", "processor, ms");
    let first = ["shoot", "index", "volume: rays", "volume: light"];
    let second = ["index, second", "volume: light, second"];
    for name in first.iter().chain(&second) {
        clock.print(name);
    }
    let (first, second) = (clock.sum(&first), clock.sum(&second));
    println!(
        "set-up: first lighting {:.0} ms; second {:.0} ms, {:.1} % of the first (processor time {:.1} %)",
        1e3 * first.wall,
        1e3 * second.wall,
        100.0 * second.wall / first.wall,
        100.0 * second.cpu / first.cpu
    );
    for view in &site.views {
        let relit = Relit { scene, light: &light, volume: Some(&volume), volume_only: false };
        let mut least = [f64::INFINITY; 3];
        for _ in 0..repeats.max(3) {
            let start = Cost::now();
            let frame = render(scene, &relit, &view.camera, SAMPLES, &|_, _| ());
            let cpu = Cost::now().cpu - start.cpu;
            for (least, s) in least.iter_mut().zip([frame.rays_s, frame.shade_s, cpu]) {
                *least = s.min(*least);
            }
        }
        let [rays, shade, cpu] = least;
        let start = Instant::now();
        reference::trace(scene, &lights, &reference::Eye::Camera(view.camera), &traced);
        let path = start.elapsed().as_secs_f64() / f64::from(traced.samples);
        println!(
            "{}: rays {:.1} ms, frame {:.1} ms (processor {:.0}), {:.1} a second; frame ÷ rays {:.2}; one path-traced sample a pixel {:.0} ms, ÷ frame {:.1}",
            view.name,
            1e3 * rays,
            1e3 * (rays + shade),
            1e3 * cpu,
            1.0 / (rays + shade),
            (rays + shade) / rays,
            1e3 * path,
            path / (rays + shade)
        );
    }
    Ok(())
}

type Fault = Box<dyn std::error::Error + Send + Sync>;

type Read<'a> = (&'a Probe, (clerestory::shoot::Chart, Picture));

fn shoot(scene: &Scene, probe: &Probe, chart: clerestory::shoot::Chart) -> Arc<Hits> {
    let pose = &probe.pose;
    Arc::new(Hits::shoot(scene, scene.local(pose.position), pose.rotation.as_mat3(), chart))
}

fn shine(scene: &Scene, site: &Site, read: &[Read], hits: &[Arc<Hits>]) -> Light {
    let lit: Vec<_> = read
        .iter()
        .zip(hits)
        .map(|((p, (_, picture)), h)| (h.clone(), picture, p.radiometry(Coding::Linear)))
        .collect();
    Light::new(scene, lit, site.sun, None)
}

/// Wall and processor time in seconds.
#[derive(Clone, Copy)]
struct Cost {
    wall: f64,
    cpu: f64,
}

impl Cost {
    fn now() -> Self {
        let threads = std::fs::read_dir("/proc/self/task").into_iter().flatten().flatten();
        let busy = threads.filter_map(|t| {
            let text = std::fs::read_to_string(t.path().join("schedstat")).ok()?;
            text.split(' ').next()?.parse::<f64>().ok()
        });
        let wall = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH).map_or(0.0, |d| d.as_secs_f64());
        Self { wall, cpu: busy.sum::<f64>() * 1e-9 }
    }
}

/// The least cost of each step.
#[derive(Default)]
struct Clock(Vec<(String, Cost)>);

impl Clock {
    fn time<T>(&mut self, name: &str, step: impl FnOnce() -> T) -> T {
        let start = Cost::now();
        let result = step();
        let end = Cost::now();
        let cost = Cost { wall: end.wall - start.wall, cpu: end.cpu - start.cpu };
        match self.0.iter_mut().find(|(n, _)| n == name) {
            Some((_, least)) => *least = Cost { wall: least.wall.min(cost.wall), cpu: least.cpu.min(cost.cpu) },
            None => self.0.push((name.to_owned(), cost)),
        }
        result
    }

    fn sum(&self, names: &[&str]) -> Cost {
        let costs = self.0.iter().filter(|(n, _)| names.contains(&n.as_str()));
        costs.fold(Cost { wall: 0.0, cpu: 0.0 }, |a, (_, b)| Cost { wall: a.wall + b.wall, cpu: a.cpu + b.cpu })
    }

    fn print(&self, name: &str) {
        let cost = self.sum(&[name]);
        println!("{name:32} {:9.1} {:14.1}", 1e3 * cost.wall, 1e3 * cost.cpu);
    }
}

/// Šibenik cathedral where it lies beside the checkout, else the bundled chapel.
fn site() -> Option<PathBuf> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    ["../shared/data/truth/sibenik", "sites/chapel"].into_iter().map(|p| root.join(p)).find(|p| p.exists())
}
