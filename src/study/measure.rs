//! One setting, measured: its set-up, its frames and their error.

use serde::{Deserialize, Serialize};
use std::borrow::Cow;
use std::ops::ControlFlow;
use std::path::Path;

use super::clock::{Clock, Seconds};
use super::conclusions::compare::{compare, hidden};
use super::metrics::blocks::Block;
use super::sweep::{Base, Method, Parameter, Setting};
use super::truth::{TruthView, part_of};
use super::{Comparison, Ranked, StudyError};
use crate::panorama::{self, Layer, Panorama, Picture, Projection, convert, write_exr};
use crate::paper::{self, Plain, PlainRelit};
use crate::reference::{Estimate, Eye, Lights, ReferenceSettings, add_samples};
use crate::render::{Irradiance, Options, Relit, prepare, render, shoot_probes};
use crate::scene::Scene;
use crate::site::{Camera, Site};
use crate::volume;

/// A frame is rendered again until it has been so often, or so long, whichever comes first.
const REPEATS: usize = 5;
const LONG_ENOUGH_S: f64 = 4.0;

/// What a study found out about one setting.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Run {
    /// What was tried.
    #[serde(flatten)]
    pub setting: Setting,
    /// Everything before the first frame: reading the model, shooting, indexing, the volume; or finding the lights.
    pub setup: Seconds,
    /// The views in the site's order. Path tracing may have only the first of them yet.
    pub views: Vec<ViewRun>,
    /// Whether a volume was needed.
    pub volume: bool,
    /// The paper's radius in metres.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub radius_m: Option<f64>,
    /// How long measuring took, seconds on the wall.
    pub spent_s: f64,
}

/// One view of a run.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct ViewRun {
    /// The view's name.
    pub view: String,
    /// A frame of the whole view: the median of several, or what its tiles took, scaled up.
    pub frame: Seconds,
    /// Its errors.
    pub blocks: Vec<Block>,
    /// Its errors over the whole photograph, where `blocks` are of tiles; of image-based shooting as it comes only.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub whole: Option<Vec<Block>>,
    /// Its errors over the whole photograph by where the light came from; of image-based shooting as it comes only.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub parts: Option<Comparison>,
}

/// What all runs share.
pub(super) struct Bench<'a> {
    pub(super) site: &'a Site,
    pub(super) scene: &'a Scene,
    pub(super) lights: Option<&'a Lights>,
    pub(super) lighting: &'a str,
    pub(super) truth: &'a [TruthView],
    pub(super) order: &'a [Ranked],
    pub(super) base: Base,
    /// Reading the model.
    pub(super) load: Seconds,
    /// Reading and finding the lights.
    pub(super) light_up: Seconds,
    pub(super) seed: u64,
}

impl Bench<'_> {
    /// Image-based shooting.
    pub(super) fn ibs(&self, setting: Setting, scratch: &Path) -> Result<Run, StudyError> {
        let spent = Clock::start();
        let value = |parameter| match setting.parameter == parameter {
            true => setting.value as u32,
            false => self.base.value(parameter) as u32,
        };
        let site = match setting.parameter {
            Parameter::Width => Cow::Owned(self.narrowed(setting.value as usize, scratch)?),
            Parameter::Probes => Cow::Owned(self.first(setting.value as usize)),
            _ => Cow::Borrowed(self.site),
        };
        let cameras: Vec<_> = self.truth.iter().map(|t| t.camera).collect();
        let options = Options {
            probes: site.probes.len(),
            volume: volume::VolumeSettings {
                cells: value(Parameter::Cells),
                rays: value(Parameter::Rays),
                ..volume::VolumeSettings::default()
            },
            ..self.options()
        };
        let clock = Clock::start();
        let setup = prepare(&site, self.scene, &cameras, &options)?;
        let light = &setup.lights[0].1;
        let volume = setup.volume(self.scene, 0);
        let setup_s = clock.read() + self.load;
        let relit = Relit { scene: self.scene, light, volume: volume.as_ref(), volume_only: false };
        let probes: Vec<_> = site.probes.iter().map(|p| self.scene.local(p.pose.position)).collect();
        let mut views = Vec::new();
        for truth in self.truth {
            let (frame, picture) = self.frames(&relit, truth, value(Parameter::Samples));
            let whole = truth.photo.as_ref().filter(|_| setting.parameter == Parameter::AsItComes);
            let parts = whole.and_then(|photo| {
                let hidden = hidden(self.scene, &probes, &truth.camera);
                compare(&hidden, &truth.camera, &picture, photo, None)
            });
            let blocks = truth.errors(&truth.cut(&picture.radiance));
            let whole = whole.filter(|_| truth.share() < 1.0).map(|photo| {
                let all = TruthView::of_photo(&truth.name, truth.camera, photo, 1.0);
                all.errors(std::slice::from_ref(&picture.radiance))
            });
            views.push(ViewRun { view: truth.name.clone(), frame, blocks, whole, parts });
        }
        let (volume, spent_s) = (volume.is_some(), spent.read().wall_s);
        Ok(Run { setting, setup: setup_s, views, volume, radius_m: None, spent_s })
    }

    /// The paper's method; `radius_m` is its own choice, once that is known.
    pub(super) fn paper(&self, setting: Setting, radius_m: Option<f64>) -> Result<Run, StudyError> {
        let spent = Clock::start();
        // what is behind windows is seen as with our own records; this is not the paper's time
        let outside = shoot_probes(self.site, self.scene, &self.options())?;
        let sky = |direction| outside.lights[0].1.sky(direction);
        let cells = match setting.parameter {
            Parameter::Cells => setting.value as u32,
            _ => self.base.cells,
        };
        let factor = if setting.parameter == Parameter::Radius { setting.value } else { 1.0 };
        let radius = radius_m.filter(|_| factor != 1.0).map(|r| (r * factor) as f32);
        let settings = paper::PaperSettings { radius_m: radius, cells, ..paper::PaperSettings::default() };
        let clock = Clock::start();
        let plain = Plain::of_probes(self.scene, &self.site.probes, self.lighting, settings)?;
        let setup = clock.read() + self.load;
        let relit = PlainRelit { plain: &plain, sky: &sky };
        let mut views = Vec::new();
        for truth in self.truth {
            let (frame, picture) = self.frames(&relit, truth, self.base.samples);
            let blocks = truth.errors(&truth.cut(&picture.radiance));
            views.push(ViewRun { view: truth.name.clone(), frame, blocks, whole: None, parts: None });
        }
        let radius_m = Some(f64::from(plain.radius_m));
        Ok(Run { setting, setup, views, volume: true, radius_m, spent_s: spent.read().wall_s })
    }

    /// One view by path tracing; `None` when `go_on` says so.
    pub(super) fn traced(
        &self,
        samples: u32,
        truth: &TruthView,
        lights: &Lights,
        go_on: &(dyn Fn() -> bool + Sync),
    ) -> Option<ViewRun> {
        let clock = Clock::start();
        let cameras = truth.tiles.iter().map(|tile| part_of(&truth.camera, tile.at));
        let traced =
            trace(self.scene, lights, cameras, samples.max(2), self.seed.wrapping_mul(2).wrapping_add(1), go_on)?;
        // the tracer takes samples in pairs, one a half: a single sample is a half, in half the time
        let (pictures, share): (Vec<Picture>, f64) = match samples {
            1 => (traced.iter().map(|e| e.half(0)).collect(), 0.5),
            _ => (traced.iter().map(Estimate::mean).collect(), 1.0),
        };
        let frame = clock.read().times(share / truth.share());
        let blocks = truth.errors(&pictures);
        Some(ViewRun { view: truth.name.clone(), frame, blocks, whole: None, parts: None })
    }

    fn options(&self) -> Options {
        Options { lightings: vec![self.lighting.to_owned()], ..Options::of(self.site) }
    }

    /// Renders a view several times; the middle one's time.
    fn frames(&self, relit: &dyn Irradiance, truth: &TruthView, samples: u32) -> (Seconds, crate::render::Frame) {
        let mut times: Vec<Seconds> = Vec::new();
        loop {
            let clock = Clock::start();
            let frame = render(self.scene, relit, &truth.camera, samples, &|_, _| ());
            times.push(clock.read());
            if times.len() == REPEATS || times.iter().map(|t| t.wall_s).sum::<f64>() > LONG_ENOUGH_S {
                times.sort_by(|a, b| a.cpu_s.total_cmp(&b.cpu_s));
                return (times[times.len() / 2], frame);
            }
        }
    }

    /// The site with only the first probes of the plan's order, as they stand in the file.
    fn first(&self, count: usize) -> Site {
        let mut taken: Vec<usize> = self.order.iter().take(count).map(|r| r.index).collect();
        taken.sort_unstable();
        let probes = taken.into_iter().map(|i| self.site.probes[i].clone()).collect();
        Site { probes, ..self.site.clone() }
    }

    /// The site with its latitude/longitude panoramas narrowed, as if they had been taken so; files go to `scratch`.
    fn narrowed(&self, width: usize, scratch: &Path) -> Result<Site, StudyError> {
        let mut site = self.site.clone();
        for (i, probe) in site.probes.iter_mut().enumerate() {
            if probe.projection != Projection::LatLong {
                continue;
            }
            probe.pictures.retain(|p| p.lighting == self.lighting);
            for lit in &mut probe.pictures {
                let picture = panorama::read(&lit.path)?;
                if picture.width <= width {
                    continue;
                }
                let whole = Panorama::new(picture, Projection::LatLong, glam::DMat3::IDENTITY);
                let narrow = convert(&whole, Projection::LatLong, width, width / 2);
                lit.path = scratch.join(format!("{i}-{width}.exr"));
                write_exr(&lit.path, width, width / 2, &[Layer::rgb("", &narrow)], None)?;
            }
        }
        Ok(site)
    }
}

/// Path-traces what each camera sees, each with its own random numbers; `None` when stopped.
pub(super) fn trace(
    scene: &Scene,
    lights: &Lights,
    cameras: impl Iterator<Item = Camera>,
    samples: u32,
    seed: u64,
    go_on: &(dyn Fn() -> bool + Sync),
) -> Option<Vec<Estimate>> {
    let one = |(i, camera): (usize, Camera)| {
        let mut estimate = Estimate::new(camera.width as usize, camera.height as usize);
        let seed = seed.wrapping_add((i as u64) << 20);
        let settings = ReferenceSettings { samples, seed, ..ReferenceSettings::default() };
        let tell = |_, _| if go_on() { ControlFlow::Continue(()) } else { ControlFlow::Break(()) };
        add_samples(scene, lights, &Eye::Camera(camera), &settings, &mut estimate, &tell).ok()?;
        Some(estimate)
    };
    cameras.enumerate().map(one).collect()
}

/// The settings as they come, for a site under a lighting.
pub(super) fn base(site: &Site, lighting: &str) -> Result<Base, StudyError> {
    let mut width = 0;
    for probe in site.probes.iter().filter(|p| p.projection == Projection::LatLong) {
        if let Some(lit) = probe.picture(lighting) {
            width = width.max(panorama::dimensions(&lit.path)?.0 as u32);
        }
    }
    let volume::VolumeSettings { cells, rays, .. } = volume::VolumeSettings::default();
    let probes = site.probes.iter().filter(|p| p.picture(lighting).is_some()).count() as u32;
    Ok(Base { width, probes, cells, rays, samples: 4 })
}

impl Run {
    /// Mean over views of a frame.
    pub fn frame(&self) -> Seconds {
        let sum = self.views.iter().fold(Seconds::default(), |sum, v| sum + v.frame);
        sum.times(1.0 / self.views.len().max(1) as f64)
    }

    /// All views' blocks, one view after the other.
    pub fn blocks(&self) -> Vec<Block> {
        self.views.iter().flat_map(|v| v.blocks.iter().copied()).collect()
    }

    /// The blocks of whole photographs where there are any, else those of tiles, by view.
    pub(super) fn widest(&self) -> Vec<&Vec<Block>> {
        self.views.iter().map(|v| v.whole.as_ref().unwrap_or(&v.blocks)).collect()
    }

    /// Whether this is image-based shooting with nothing changed.
    pub fn is_plain_ibs(&self) -> bool {
        self.setting == Setting::plain(Method::Ibs)
    }
}
