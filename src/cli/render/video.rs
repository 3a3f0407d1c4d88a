//! Light from numbered pictures: each frame's goes through one operator, without a ray.

use clerestory::bake::Baked;
use clerestory::glam::Vec3;
use clerestory::panorama::{Picture, Radiometry};
use clerestory::render::{Options, Relit, pictures};
use clerestory::report::VideoTimes;
use clerestory::site::{LitPicture, Site, View};
use clerestory::transfer::{Point, Transfer};
use std::time::Instant;

/// How many frames the numbered pictures of some lightings have in the first probes, if there are such: the longest's.
pub(super) fn length(site: &Site, lightings: &[String], probes: usize) -> Option<usize> {
    let asked = |p: &&LitPicture| lightings.contains(&p.lighting);
    let all = site.probes.iter().take(probes).flat_map(|p| &p.pictures).filter(asked);
    all.map(|p| p.frames.len()).max().filter(|n| *n > 0)
}

/// What is shown, and with which of the numbered pictures: of a walk each frame with the next, of other views each with all.
pub(super) fn shots(views: &[&View], length: Option<usize>, walk: bool) -> Vec<(View, usize)> {
    let Some(length) = length else { return views.iter().map(|v| ((*v).clone(), 0)).collect() };
    if walk {
        return views.iter().enumerate().map(|(i, v)| ((*v).clone(), i.min(length - 1))).collect();
    }
    let named = |v: &View, frame: usize| View { name: format!("{}_{:04}", v.name, frame + 1), ..v.clone() };
    (0..length).flat_map(|frame| views.iter().map(move |v| (named(v, frame), frame))).collect()
}

/// Irradiance at a bake's vertices as a function of the probes' pictures, one operator a lighting.
pub(super) struct Video<'a> {
    site: &'a Site,
    options: &'a Options,
    transfers: Vec<Transfer<'a>>,
    pub(super) times: VideoTimes,
}

/// Irradiance at the vertices, and how many times as bright as at first the sky is.
pub(super) type Relighting = (Vec<Vec3>, f32);

impl<'a> Video<'a> {
    /// The operators of `relits`, which are lit by the first frame.
    pub(super) fn new(
        site: &'a Site,
        options: &'a Options,
        relits: &'a [Relit<'a>],
        baked: &Baked,
    ) -> anyhow::Result<Self> {
        let points: Vec<Point> = baked.vertices.iter().map(|v| (v.lit_at, v.normal)).collect();
        let one = |(i, relit): (usize, &'a Relit)| {
            let own = pictures(site, &options.lightings[i], options.probes, 0)?;
            let fed: Vec<(&Picture, Radiometry)> = own.iter().map(|(p, r)| (p, *r)).collect();
            Ok(Transfer::new(relit, &fed, &points))
        };
        let start = Instant::now();
        let transfers = relits.iter().enumerate().map(one).collect::<anyhow::Result<_>>()?;
        let times = VideoTimes { operator_s: start.elapsed().as_secs_f64(), ..VideoTimes::default() };
        Ok(Self { site, options, transfers, times })
    }

    /// The light of a frame, per lighting.
    pub(super) fn light(&mut self, frame: usize) -> anyhow::Result<Vec<Relighting>> {
        let mut all = Vec::new();
        for (lighting, transfer) in self.options.lightings.iter().zip(&self.transfers) {
            let start = Instant::now();
            let own = pictures(self.site, lighting, self.options.probes, frame)?;
            let shown: Vec<&Picture> = own.iter().map(|p| &p.0).collect();
            self.times.decode_s += start.elapsed().as_secs_f64();
            let start = Instant::now();
            let measured = transfer.measure(&shown);
            let brightness = transfer.brightness(&measured);
            let sky = Vec3::splat(brightness);
            all.push((transfer.light(&measured, transfer.sun(&measured), sky), brightness));
            self.times.product_s += start.elapsed().as_secs_f64();
        }
        self.times.frames += 1;
        Ok(all)
    }
}
