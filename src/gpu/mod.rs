//! Baked models drawn by a graphics card into linear pictures, without a window (feature `gpu`).
//!
//! ```text
//! Scene + Baked ─► Drawer::new: vertices, light, pictures with their levels, sky, what the sun sees ─► on the card
//! Camera ─► draw: triangles and sky at s × s samples a pixel ─► means in linear light ─► read back ─► Picture
//! ```
//!
//! A sample's radiance is albedo × picture × vertex colour × irradiance ÷ π, as [`mod@crate::render`] has it: lamps are white,
//! pictures are averaged over what a sample covers, back faces are left out. Where the bake keeps the sun apart, its shadows come from
//! a map of depths as the sun sees them (Williams, *Casting curved shadows on curved surfaces*, SIGGRAPH 1978).
//!
//! Cards round in their own ways: unlike all else in this library, pictures may differ in their last digits from card to card.
//!
//! ```no_run
//! # fn drawn(site: &clerestory::site::Site, scene: &clerestory::scene::Scene, baked: &clerestory::bake::Baked)
//! # -> Result<(), clerestory::gpu::GpuError> {
//! use clerestory::gpu::Drawer;
//!
//! let mut drawer = Drawer::new(scene, baked, 0)?;
//! let picture = drawer.draw(&site.views[0].camera, 4)?;
//! # Ok(())
//! # }
//! ```

mod device;
mod draw;
mod error;
mod frame;
mod mips;
mod pipelines;
mod upload;

pub use error::GpuError;

use glam::{DVec3, Vec3};

use crate::bake::Baked;
use crate::panorama::Picture;
use crate::scene::Scene;
use crate::site::Camera;
use device::Card;
use draw::{Stage, Targets, timed};
use frame::{SunView, View};
use pipelines::Pipelines;
use upload::Model;

/// Texels along a side of what the sun sees, if the card can.
const SHADOW_SIDE: u32 = 4096;

/// Samples along a side that are drawn together, if the card can: 320 MiB of light and depth.
const TILE_SIDE: u32 = 4096;

/// A baked model on a graphics card, ready to be drawn.
pub struct Drawer {
    card: Card,
    pipelines: Pipelines,
    model: Model,
    stage: Stage,
    /// The scene's.
    origin: DVec3,
    targets: Option<Targets>,
    times: FrameTimes,
}

/// How long a picture took.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FrameTimes {
    /// From the first command until the card has drawn and averaged all pixels, seconds.
    pub draw_s: f64,
    /// Copying the pixels into a [`Picture`], seconds.
    pub read_s: f64,
}

impl Drawer {
    /// Opens the fastest graphics card there is, in software where there is no other, and hands it a baked model under one of its
    /// lightings, counted from 0.
    ///
    /// # Errors
    ///
    /// No card, one that refuses or is too small, or no such lighting.
    pub fn new(scene: &Scene, baked: &Baked, lighting: usize) -> Result<Self, GpuError> {
        let card = Card::open()?;
        let picture = pipelines::picture_layout(&card);
        let model = Model::new(&card, &picture, scene, baked, lighting)?;
        let sun = baked.suns.get(lighting).copied().flatten().filter(|_| model.sunlight.is_some());
        // without a sun one texel stands in
        let side = if sun.is_some() { SHADOW_SIDE.min(card.device.limits().max_texture_dimension_2d) } else { 1 };
        let sun = sun.map(|sun| SunView::new(baked, sun, side));
        let shadow = draw::shadow(&card, &model, sun.as_ref(), side);
        let pipelines = Pipelines::new(&card, &picture, model.sunlight.is_some());
        let uniform = draw::uniform(&card);
        let frame = pipelines::frame_group(&card, &pipelines.frame, &uniform, &model.sky, &shadow);
        card.wait()?;
        let stage = Stage { uniform, frame, sun: sun.unwrap_or_default() };
        let times = FrameTimes::default();
        Ok(Self { card, pipelines, model, stage, origin: scene.origin, targets: None, times })
    }

    /// What a pinhole camera sees: linear radiance, each pixel the mean of `samples` (1, 4, 9, 16, …) on a grid.
    ///
    /// # Errors
    ///
    /// Another lens, a number of samples that is no square, or what the card's driver says.
    pub fn draw(&mut self, camera: &Camera, samples: u32) -> Result<Picture, GpuError> {
        let side = samples_along(camera, samples)?;
        let most = TILE_SIDE.min(self.card.device.limits().max_texture_dimension_2d) / side;
        let mut picture = Picture::new(camera.width as usize, camera.height as usize);
        let mut times = FrameTimes::default();
        let Self { card, pipelines, model, stage, targets, .. } = self;
        for tile in frame::tiles(camera.width, camera.height, most.max(1)) {
            let view = View::new(camera, self.origin, tile, side);
            let targets = Targets::fit(targets, card, pipelines, tile, side);
            timed(&mut times.draw_s, || draw::draw(card, pipelines, (model, stage), &view, targets))?;
            timed(&mut times.read_s, || targets.read_into(card, tile, &mut picture))?;
        }
        self.times = times;
        Ok(picture)
    }

    /// How long the last picture took.
    pub fn times(&self) -> FrameTimes {
        self.times
    }

    /// Gives the vertices other irradiance, one for each in the bake's order, as from [`crate::transfer::Transfer::light`]. What the
    /// sun adds where it is kept apart, and the sky, stay.
    ///
    /// # Errors
    ///
    /// Another number of vertices, or what the card's driver says.
    pub fn relight(&mut self, irradiance: &[Vec3]) -> Result<(), GpuError> {
        if irradiance.len() != self.model.vertices {
            return Err(GpuError::Vertices { given: irradiance.len(), expected: self.model.vertices });
        }
        let floats = upload::floats(irradiance);
        self.card.queue.write_buffer(&self.model.irradiance, 0, bytemuck::cast_slice(&floats));
        self.card.check()
    }

    /// The card's name, its driver, and whether it draws in software.
    pub fn adapter(&self) -> &str {
        &self.card.name
    }
}

/// The name of the card that a [`Drawer`] would open, its driver, and whether it draws in software: to ask before a long bake.
///
/// # Errors
///
/// No card, or one that refuses.
pub fn adapter() -> Result<String, GpuError> {
    Ok(Card::open()?.name)
}

/// Samples along a pixel's side for so many a pixel, if a card can draw this camera.
///
/// # Errors
///
/// A lens that is no pinhole, or a number of samples that is no square.
pub fn samples_along(camera: &Camera, samples: u32) -> Result<u32, GpuError> {
    if !camera.is_pinhole() {
        return Err(GpuError::NotPinhole);
    }
    let side = samples.isqrt().max(1);
    let more = side.saturating_add(1);
    match side * side == samples {
        true => Ok(side),
        false => Err(GpuError::Samples { given: samples, less: side * side, more: more.saturating_mul(more) }),
    }
}
