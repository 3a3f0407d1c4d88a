//! One unit in the last place: what it does to results.

use clerestory::panorama;
use clerestory::render::{self, Options, Relit};
use clerestory::site::{LitPicture, Site};

use super::support::{Built, assert_finite, write_picture};

/// A factor that moves a number in single precision by one unit in its last place, up or down by turns.
pub(crate) fn nudge(i: usize) -> f32 {
    if i.is_multiple_of(3) { 1.0 + f32::EPSILON } else { 1.0 - f32::EPSILON }
}

/// Relative change of values, root mean square, in units of single precision; where both are 0 nothing has changed.
pub(crate) fn change(values: &[f32], moved: &[f32]) -> f64 {
    let relative = |(a, b): (&f32, &f32)| if a == b { 0.0 } else { (f64::from(*b) / f64::from(*a) - 1.0).powi(2) };
    let sum: f64 = values.iter().zip(moved).map(relative).sum();
    (sum / values.len().max(1) as f64).sqrt() / f64::from(f32::EPSILON)
}

/// What `ask` learns of a site under its probes' light, and how many units in the last place that moves when every pixel
/// of the probes moves by one.
pub(crate) fn asked(built: &Built, options: &Options, ask: impl Fn(&Relit) -> Vec<f32>) -> (Vec<f32>, f64) {
    let mut site = Site::load(built.folder.path()).unwrap();
    for (i, probe) in site.probes.iter_mut().enumerate() {
        let mut picture = panorama::read(&probe.pictures[0].path).unwrap();
        picture.pixels.iter_mut().enumerate().for_each(|(k, p)| *p *= nudge(k));
        let path = built.folder.path().join(format!("moved{i}.exr"));
        write_picture(&path, &picture);
        probe.pictures.push(LitPicture { lighting: "moved".to_owned(), path, frames: Vec::new() });
    }
    // a lighting more of the same probes: rays are cast once
    let options = Options { lightings: vec![String::new(), "moved".to_owned()], ..options.clone() };
    let cameras: Vec<_> = site.views.iter().map(|v| v.camera).collect();
    let setup = render::prepare(&site, &built.scene, &cameras, &options).unwrap();
    let volumes = setup.volumes(&built.scene);
    let mut answers = setup.lights.iter().zip(&volumes).map(|((_, light), volume)| {
        ask(&Relit { scene: &built.scene, light, volume: volume.as_ref(), volume_only: false })
    });
    let (as_is, moved) = (answers.next().unwrap(), answers.next().unwrap());
    let change = change(&as_is, &moved);
    (as_is, change)
}

/// The radiance of all views; every layer is checked to be finite.
pub(crate) fn shown(built: &Built, relit: &Relit) -> Vec<f32> {
    let frames = built.site.views.iter().map(|v| render::render(&built.scene, relit, &v.camera, 4, &|_, _| {}));
    let pixels = |f: render::Frame| {
        assert_finite(&f);
        f.radiance.pixels.iter().map(|p| p.x).collect::<Vec<_>>()
    };
    frames.flat_map(pixels).collect()
}
