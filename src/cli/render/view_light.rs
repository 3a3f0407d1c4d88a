//! The light that views are rendered with.

use clerestory::bake::BakedLight;
use clerestory::glam::Vec3;
use clerestory::paper::{Plain, PlainRelit};
use clerestory::render::{Frame, Irradiance, Relit, render};
use clerestory::scene::Scene;
use clerestory::site::Camera;
use indicatif::ProgressBar;

use super::video::Relighting;

/// What tells the sky's radiance.
pub(super) type Sky<'a> = Box<dyn Fn(Vec3) -> Vec3 + Sync + 'a>;

/// The light of one lighting, or of two to blend: from a bake where there is one, by the paper's method where that is asked
/// for, else ours.
pub(super) struct ViewLight<'a> {
    relits: &'a [Relit<'a>],
    plain: Vec<PlainRelit<'a>>,
    baked: Option<Vec<BakedLight<'a>>>,
}

impl<'a> ViewLight<'a> {
    /// Each lighting's light; of the paper's method with the skies.
    pub(super) fn new(
        relits: &'a [Relit<'a>],
        plain: &'a [Plain],
        skies: &'a [Sky<'a>],
        baked: Option<Vec<BakedLight<'a>>>,
    ) -> Self {
        let plain = plain.iter().zip(skies).map(|(plain, sky)| PlainRelit { plain, sky }).collect();
        Self { relits, plain, baked }
    }

    /// The light of a lighting.
    pub(super) fn of(&self, lighting: usize) -> &dyn Irradiance {
        match (&self.baked, self.plain.get(lighting)) {
            (Some(baked), _) => &baked[lighting],
            (None, Some(plain)) => plain,
            (None, None) => &self.relits[lighting],
        }
    }

    /// The first lighting's light in full and as baked.
    pub(super) fn full_and_baked(&self) -> Option<[&dyn Irradiance; 2]> {
        self.baked.as_ref().map(|baked| [&self.relits[0] as &dyn Irradiance, &baked[0]])
    }

    /// What a camera shows, under two lightings with this share of the second. `video` is the light of numbered pictures, for
    /// each lighting.
    pub(super) fn frame(
        &self,
        scene: &Scene,
        camera: &Camera,
        video: Option<&[Relighting]>,
        samples: u32,
        share: f32,
        bar: &ProgressBar,
    ) -> Option<Frame> {
        let under = |lighting: usize| {
            let before = bar.position();
            let tell = |rows: u64, _| bar.set_position(before + rows);
            let baked = self.baked.as_ref().map(|baked| &baked[lighting]);
            let now = video.zip(baked).map(|(video, baked)| baked.relit(&video[lighting].0, video[lighting].1));
            let light = now.as_ref().map_or(self.of(lighting), |now| now);
            render(scene, light, camera, samples, &tell)
        };
        (0..self.relits.len()).map(under).reduce(|first, second| first.mixed(&second, share))
    }
}
