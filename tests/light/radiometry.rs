//! Exposures and white balance planted in a site's probes come back, and so do its pictures.

#![allow(clippy::unwrap_used, reason = "tests may panic")]

use crate::support::data::shared;
use crate::support::{chapel, load, write_picture};
use clerestory::panorama::{self, Picture};
use clerestory::radiometry::{self, FitSettings, fit_to_render};
use clerestory::render::{Options, Relit, prepare, render};
use clerestory::scene::Scene;
use clerestory::site::{Camera, Site};
use clerestory::study::flip;
use clerestory::volume;
use glam::Vec3;
use tempfile::TempDir;

/// Gains of the planted kind: ±1.5 stops, and white balance off by ±20 %.
const PLANTED: [Vec3; 4] = [
    Vec3::new(2.83 * 1.2, 2.83, 2.83 * 0.8),
    Vec3::new(0.354 * 0.8, 0.354, 0.354 * 1.2),
    Vec3::new(1.6, 1.6, 1.6 * 1.2),
    Vec3::new(0.6 * 1.2, 0.6 * 0.9, 0.6),
];

/// Writes the probes' pictures of the first lighting anew, as if they had been taken with other exposures.
fn plant(site: &mut Site) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    for (i, (probe, gain)) in site.probes.iter_mut().zip(PLANTED).enumerate() {
        let mut picture = panorama::read(&probe.pictures[0].path).unwrap();
        picture.pixels.iter_mut().for_each(|p| *p /= gain);
        probe.pictures[0].path = folder.path().join(format!("{i}.exr"));
        write_picture(&probe.pictures[0].path, &picture);
    }
    folder
}

/// The factor of each channel that gains and planted ones have in common, and the worst ratio to it, less one.
fn off(site: &Site) -> (Vec3, f32) {
    let logs: Vec<Vec3> = site.probes.iter().zip(PLANTED).map(|(p, t)| (p.gain / t).map(f32::ln)).collect();
    let mean = logs.iter().sum::<Vec3>() / logs.len() as f32;
    let worst = logs.iter().map(|l| (*l - mean).abs().max_element()).fold(0.0, f32::max);
    (mean.map(f32::exp), worst.exp() - 1.0)
}

fn relit(site: &Site, scene: &Scene, camera: Camera, lighting: &str) -> Picture {
    let options = Options {
        lightings: vec![lighting.to_owned()],
        volume: volume::VolumeSettings { cells: 16, rays: 32, ..volume::VolumeSettings::default() },
        ..Options::of(site)
    };
    let setup = prepare(site, scene, &[camera], &options).unwrap();
    let light = &setup.lights[0].1;
    let volume = setup.volume(scene, 0);
    let relit = Relit { scene, light, volume: volume.as_ref(), volume_only: false };
    render(scene, &relit, &camera, 1, &|_, _| ()).radiance
}

#[test]
fn gains_planted_in_the_chapel_come_back() {
    let (original, scene) = load(&chapel());
    let mut site = original.clone();
    let _folder = plant(&mut site);
    let lighting = site.lightings()[0].clone();
    let fit = radiometry::fit(&site, &scene, &lighting, &FitSettings::default()).unwrap();
    assert!(fit.pictures.iter().all(|p| p.tied));
    fit.apply(&mut site);
    let (factor, worst) = off(&site);
    println!("worst gain {worst}, spread {} of {}", fit.spread, fit.spread_before);
    assert!(worst < 0.02, "{worst}: {fit:?}");
    // the pictures are those of the right exposures, up to the factor that nobody can know
    let view = &original.views[0];
    let found = relit(&site, &scene, view.camera, &lighting);
    let expected = relit(&original, &scene, view.camera, &lighting);
    let common = fit_to_render(&found, &expected, f32::INFINITY, |_| true).unwrap();
    assert!((Vec3::from(common.gain) * factor - 1.0).abs().max_element() < 0.02, "{common:?} {factor}");
    let found = common.develop(&found);
    let photo = panorama::read(view.photo.as_ref().unwrap()).unwrap();
    let [apart, with, without] = [flip(&found, &expected), flip(&found, &photo), flip(&expected, &photo)];
    println!("FLIP between the two {apart}, against the photograph {with}, as it was {without}");
    // FLIP of two pictures that differ by a factor of 1.004 all over is 0.0125 here
    assert!(apart < 0.02 && (with - without).abs() < 0.005, "{apart} {with} {without}");
}

#[test]
fn gains_planted_in_sibenik_come_back() {
    let Some(folder) = shared("truth/sibenik") else { return };
    let (mut site, scene) = load(&folder);
    let _folder = plant(&mut site);
    let lighting = site.lightings()[0].clone();
    let settings = FitSettings { samples: 600, ..FitSettings::default() };
    radiometry::fit(&site, &scene, &lighting, &settings).unwrap().apply(&mut site);
    let (_, worst) = off(&site);
    println!("worst gain {worst}");
    assert!(worst < 0.02, "{worst}");
}
