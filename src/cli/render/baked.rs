//! `render --baked`: views drawn from light on the model's vertices.

use clerestory::bake::{self, Bake, BakeSettings, Baked, BakedLight, Pieces};
use clerestory::render::{Irradiance, Options, Relit, Setup, render};
use clerestory::report::BakedFrames;
use clerestory::scene::Scene;
use clerestory::site::{Camera, Site};
use clerestory::study::flip;
use std::time::Instant;

use crate::cli::terminal::output::Told;

/// A bake, ready to be drawn from.
pub(super) struct Drawn {
    pub(super) baked: Baked,
    pieces: Pieces,
    seconds: f64,
}

/// Bakes a site under the lightings of `options`. Direct sun is kept apart, so that its edges are as sharp as when rendered; not
/// for a video, whose pictures tell both together.
pub(super) fn baked(
    site: &Site,
    scene: &Scene,
    options: &Options,
    (vertices, video): (usize, bool),
    told: Told,
) -> anyhow::Result<(Drawn, Setup)> {
    let start = Instant::now();
    let settings = BakeSettings { vertices, views: false, sun_apart: !video, ..BakeSettings::default() };
    let bar = told.bar("{spinner} {msg}  {elapsed}");
    bar.set_message("baking …");
    let Bake { baked, setup } =
        bake::bake(site, scene, options, &settings, &|n| bar.set_message(format!("{n} vertices …")))?;
    bar.finish_and_clear();
    let pieces = Pieces::new(scene, &baked);
    let t = setup.timings;
    let seconds = start.elapsed().as_secs_f64() - t.load_s - t.shoot_s - t.index_s - t.volume_s;
    Ok((Drawn { baked, pieces, seconds }, setup))
}

impl Drawn {
    /// What each lighting's views are drawn with.
    pub(super) fn lights<'a>(&'a self, relits: &'a [Relit<'a>]) -> Vec<BakedLight<'a>> {
        let one = |(i, relit)| BakedLight::new(&self.baked, i, relit, &self.pieces);
        relits.iter().enumerate().map(one).collect()
    }

    /// What was baked, and how far the first, the middle and the last of some frames are from rendering them in full.
    pub(super) fn told(
        &self,
        scene: &Scene,
        lights: [&dyn Irradiance; 2],
        frames: &[Camera],
        samples: u32,
    ) -> BakedFrames {
        let mut some = [0, frames.len() / 2, frames.len().saturating_sub(1)].to_vec();
        some.dedup();
        let off = |i: usize| {
            let camera = frames.get(i)?;
            let [full, drawn] = lights.map(|light| render(scene, light, camera, samples, &|_, _| ()).radiance);
            Some(flip(&drawn, &full))
        };
        let flip = some.into_iter().filter_map(off).collect();
        BakedFrames { vertices: self.baked.vertices.len(), seconds: self.seconds, flip, video: None }
    }
}
