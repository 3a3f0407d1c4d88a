//! Scratch: dumps maps.
use clerestory::audit::*;
use clerestory::panorama;
use clerestory::render::{Options, prepare};
use clerestory::scene::{self, Health};
use clerestory::site::Site;
use clerestory::volume::{self, Volume};
use std::path::Path;
use std::time::Instant;

fn main() {
    let args: Vec<String> = std::env::args().collect();
    let site = Site::load(Path::new(&args[1])).unwrap();
    let out = Path::new(&args[2]);
    std::fs::create_dir_all(out).unwrap();
    let scene = scene::load(&site, &mut Health::default()).unwrap();
    let t = Instant::now();
    let cameras: Vec<_> = site.views.iter().map(|v| v.camera).collect();
    let lighting = site.lightings()[0].clone();
    let options = Options {
        lightings: vec![lighting.clone()],
        probes: 99,
        sun: true,
        volume: volume::Settings::default(),
        all_stages: true,
        volume_for_all: true,
    };
    let setup = prepare(&site, &scene, &cameras, &options).unwrap();
    let light = &setup.lights[0].1;
    let volume = setup.transport_of[0].map(|t| Volume::new(&scene, &setup.transports[t], light));
    let pictures: Vec<_> = site
        .probes
        .iter()
        .filter_map(|p| Some((p, panorama::read(&p.pictures.iter().find(|x| x.lighting == lighting)?.path).unwrap())))
        .collect();
    let refs: Vec<_> = pictures.iter().map(|(p, x)| (*p, x)).collect();
    let prepared = Prepared::new(&scene, light, volume.as_ref(), &refs);
    println!("prepared {:.1} s", t.elapsed().as_secs_f64());
    for view in &site.views {
        if args.len() > 3 && !args[3..].contains(&view.name) {
            continue;
        }
        let t = Instant::now();
        let photo = Photograph::new(panorama::read(view.photo.as_ref().unwrap()).unwrap());
        let maps = examine(&prepared, &view.camera, &photo, &Settings::default());
        println!("{} {:.1} s {}", view.name, t.elapsed().as_secs_f64(), maps.line());
        let (w, h) = maps.size();
        let planes = maps.planes();
        let cols = 5;
        let rows = planes.len().div_ceil(cols);
        let mut sheet = image::GrayImage::new((w * cols) as u32, (h * rows) as u32);
        for (k, (name, p)) in planes.iter().enumerate() {
            let (lo, hi) = match *name {
                "photo" | "render" => {
                    let mut v = p.clone();
                    v.sort_by(f32::total_cmp);
                    (0.0, v[v.len() * 97 / 100])
                }
                "mismatch" => (0.0, 8.0),
                "gain" => (0.0, 600.0),
                "best" => (-0.3, 0.3),
                "sensitivity" => (0.0, 600.0),
                "able" | "seen" => (0.0, 4.0),
                "ratio" => (-1.0, 1.0),
                "lacking" => (0.0, 1.0),
                "surety" => (0.0, 12.0),
                "colour" => (0.0, 25.0),
                "foreign" => (0.0, 0.25),
                _ => (0.0, 0.5),
            };
            let mut v: Vec<f32> = p.clone();
            v.sort_by(f32::total_cmp);
            let q = |f: f64| v[((v.len() - 1) as f64 * f) as usize];
            println!("  {name:12} p50 {:.3} p90 {:.3} p99 {:.3} max {:.3}", q(0.5), q(0.9), q(0.99), q(1.0));
            for i in 0..w * h {
                let g = ((p[i] - lo) / (hi - lo) * 255.0).clamp(0.0, 255.0) as u8;
                sheet.put_pixel(((k % cols) * w + i % w) as u32, ((k / cols) * h + i / w) as u32, image::Luma([g]));
            }
        }
        sheet.save(out.join(format!("{}.png", view.name))).unwrap();
    }
}
