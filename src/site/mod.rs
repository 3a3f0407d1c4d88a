//! The site file: what a site is made of, checked, with every pose brought into the program's frame.

mod camera;
mod frame;

pub use camera::{Camera, Distortion};
pub use frame::{Frame, Pose, Up};

use glam::{DMat3, DVec3, Vec3};
use std::path::PathBuf;

use crate::panorama::Projection;

/// A checked site: all paths exist, all poses are finite, all names are unique.
#[derive(Clone, Debug)]
pub struct Site {
    /// The site file itself.
    pub file: PathBuf,
    /// The name a person gave it.
    pub name: String,
    /// Units and axes of the model.
    pub frame: Frame,
    /// The model's OBJ file.
    pub model: PathBuf,
    /// Outdoor light, for rehearsal and reference.
    pub environment: Option<Environment>,
    /// The sun, for rehearsal and reference.
    pub sun: Option<Sun>,
    /// The light probes, in the file's order.
    pub probes: Vec<Probe>,
    /// The views, in the file's order.
    pub views: Vec<View>,
}

/// Where the light outside comes from.
#[derive(Clone, Debug)]
pub enum Environment {
    /// The same radiance from everywhere.
    Uniform(Vec3),
    /// A panorama around the site; the rotation takes its own axes (x right, y to the centre column, z up) to the
    /// program's.
    Image {
        /// The picture's file.
        path: PathBuf,
        /// From the panorama's axes to the program's.
        rotation: DMat3,
        /// How its pixels map to directions.
        projection: Projection,
    },
}

/// A distant, point-like sun.
#[derive(Clone, Copy, Debug)]
pub struct Sun {
    /// Unit vector towards the sun, in the program's axes.
    pub direction: Vec3,
    /// Irradiance on a surface that faces it, W/m² in the site's own units of light.
    pub irradiance: Vec3,
}

/// An HDR picture taken inside, with a pose.
#[derive(Clone, Debug)]
pub struct Probe {
    /// Unique name.
    pub name: String,
    /// Where it was taken.
    pub pose: Pose,
    /// One picture per lighting, in the file's order; a lone picture has the lighting `""`.
    pub pictures: Vec<LitPicture>,
    /// How pixels map to directions.
    pub projection: Projection,
    /// Radiance per stored value.
    pub gain: f32,
}

/// One of a probe's pictures.
#[derive(Clone, Debug)]
pub struct LitPicture {
    /// The lighting's name, such as `10:00`; empty where the site has only one.
    pub lighting: String,
    /// The picture's file.
    pub path: PathBuf,
}

/// A camera whose picture is rendered.
#[derive(Clone, Debug)]
pub struct View {
    /// Unique name.
    pub name: String,
    /// The camera.
    pub camera: Camera,
    /// The photograph taken there, if any.
    pub photo: Option<PathBuf>,
    /// A picture whose dark pixels are left out of comparisons.
    pub mask: Option<PathBuf>,
}

/// A position in the program's frame before re-centring: metres, z up.
pub type Position = DVec3;
