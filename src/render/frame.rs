//! A rendered view.

use glam::Vec3;

use crate::panorama::{Layer, Picture};

/// Where a pixel's irradiance came from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(u8)]
pub enum Source {
    /// From nowhere: the pixel shows the sky.
    #[default]
    None = 0,
    /// From records.
    Record = 1,
    /// From the volume.
    Volume = 2,
    /// From records that are little trusted there, or the nearest that the point sees or that lie on its surface: nothing
    /// better tells of it.
    Neighbour = 3,
}

/// A relit picture with what it was made of; all layers have the picture's size.
pub struct Frame {
    /// Radiance.
    pub radiance: Picture,
    /// Mean albedo, 0..=1.
    pub albedo: Picture,
    /// Unit normal of the surface that most samples show, the program's axes; zero for the sky.
    pub normal: Picture,
    /// Mean distance from the camera in metres; infinite for the sky.
    pub depth: Vec<f32>,
    /// Where most of the pixel's irradiance came from.
    pub source: Vec<Source>,
    /// How far the probes that see the pixel agree: 1 − standard deviation ÷ mean of their irradiances, 0..=1; 1 where
    /// fewer than two see it.
    pub agreement: Vec<f32>,
    /// Share of the surface samples that records light.
    pub covered_fraction: f64,
    /// Seconds for casting primary rays.
    pub rays_s: f64,
    /// Seconds for everything after.
    pub shade_s: f64,
}

/// One pixel of a [`Frame`].
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Pixel {
    pub(super) radiance: Vec3,
    pub(super) albedo: Vec3,
    pub(super) normal: Vec3,
    pub(super) depth: f32,
    pub(super) agreement: f32,
    /// Samples that met a surface, and those of them that their own records light.
    pub(super) surface: u32,
    pub(super) recorded: u32,
    /// Samples lit by neighbouring records.
    pub(super) neighboured: u32,
}

impl Frame {
    /// A frame without any rows yet.
    pub(super) fn new(width: usize, height: usize) -> Self {
        let picture = || Picture { width, height, pixels: Vec::with_capacity(width * height) };
        Self {
            radiance: picture(),
            albedo: picture(),
            normal: picture(),
            depth: Vec::with_capacity(width * height),
            source: Vec::with_capacity(width * height),
            agreement: Vec::with_capacity(width * height),
            covered_fraction: 1.0,
            rays_s: 0.0,
            shade_s: 0.0,
        }
    }

    /// Adds the next rows.
    pub(super) fn extend(&mut self, pixels: &[Pixel]) {
        let source = |p: &Pixel| match p {
            Pixel { surface: 0, .. } => Source::None,
            p if 2 * p.recorded >= p.surface => Source::Record,
            p if 2 * p.neighboured > p.surface => Source::Neighbour,
            _ => Source::Volume,
        };
        self.radiance.pixels.extend(pixels.iter().map(|p| p.radiance));
        self.albedo.pixels.extend(pixels.iter().map(|p| p.albedo));
        self.normal.pixels.extend(pixels.iter().map(|p| p.normal));
        self.depth.extend(pixels.iter().map(|p| p.depth));
        self.source.extend(pixels.iter().map(source));
        self.agreement.extend(pixels.iter().map(|p| p.agreement));
    }

    /// The layers of a linear EXR file: radiance, and where `all` is set albedo, normal, depth, source and agreement.
    pub fn layers(&self, all: bool) -> Vec<Layer> {
        let mut layers = vec![Layer::rgb("radiance", &self.radiance)];
        if all {
            layers.push(Layer::vectors("albedo", ["R", "G", "B"], &self.albedo.pixels, true));
            layers.push(Layer::vectors("normal", ["X", "Y", "Z"], &self.normal.pixels, true));
            layers.push(Layer::scalars("depth", "Z", self.depth.clone(), false));
            let source = self.source.iter().map(|&s| f32::from(s as u8)).collect();
            layers.push(Layer::scalars("source", "Y", source, true));
            layers.push(Layer::scalars("agreement", "Y", self.agreement.clone(), true));
        }
        layers
    }

    /// The same view under another lighting mixed in: radiance is linear in the light. `share` 0 keeps this frame, 1
    /// takes the other.
    pub fn mixed(mut self, other: &Self, share: f32) -> Self {
        for (mine, theirs) in self.radiance.pixels.iter_mut().zip(&other.radiance.pixels) {
            *mine = mine.lerp(*theirs, share);
        }
        for (mine, theirs) in self.agreement.iter_mut().zip(&other.agreement) {
            *mine = mine.min(*theirs);
        }
        self.rays_s += other.rays_s;
        self.shade_s += other.shade_s;
        self
    }
}
