//! A checked site and what it is made of.

use glam::{DMat3, DVec2, Vec2, Vec3};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use crate::panorama::{Coding, Projection, Radiometry};
use crate::site::camera::Camera;
use crate::site::frame::{Frame, Pose};
use crate::site::resection::result::{Match, Resection};

/// What a title block says of the work, as a person wrote it, each in one line; empty where it was not said.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Project {
    /// What the work is called.
    pub title: String,
    /// Who has it done.
    pub institution: String,
    /// Who does it.
    pub author: String,
    /// When; `YYYY-MM-DD` if written as a date.
    pub date: String,
    /// Who may do what with it.
    pub rights: String,
}

/// A checked site: all paths exist, all poses are finite, all names are unique.
#[derive(Clone, Debug)]
pub struct Site {
    /// The site file itself.
    pub file: PathBuf,
    /// The name a person gave it.
    pub name: String,
    /// What a title block says of the work.
    pub project: Project,
    /// Units and axes of the model.
    pub frame: Frame,
    /// The model's OBJ file.
    pub model: PathBuf,
    /// What the numbers of the model's vertex colours are.
    pub vertex_colours: VertexColours,
    /// Outdoor light, for rehearsal and reference.
    pub environment: Option<Environment>,
    /// The sun, under every lighting that has none of its own.
    pub sun: Option<Sun>,
    /// Lightings under another sun. See [`Site::sun_under`].
    pub suns: BTreeMap<String, Sun>,
    /// The light probes, in the file's order; those of a pose file come last.
    pub probes: Vec<Probe>,
    /// The views, in the file's order; those of a pose file come last.
    pub views: Vec<View>,
    /// What another program has solved: a file or folder of poses.
    pub pose_file: Option<PathBuf>,
    /// How probes are to be planned.
    pub plan: Plan,
    /// What is odd but no fault, a sentence each.
    pub warnings: Vec<String>,
}

impl Site {
    /// The sun that shines under a lighting; `None` where the site names none, or one without light.
    pub fn sun_under(&self, lighting: &str) -> Option<Sun> {
        self.suns.get(lighting).copied().or(self.sun).filter(|sun| sun.irradiance.max_element() > 0.0)
    }

    /// The lighting to take: the one asked for, else the first; `""` where that has no name. A site without probes has no
    /// lighting that could be wrong.
    ///
    /// # Errors
    ///
    /// A name that no probe's picture has.
    pub fn lighting(&self, asked: Option<&str>) -> Result<String, UnknownName> {
        let known = self.lightings();
        match asked {
            None => Ok(known.first().cloned().unwrap_or_default()),
            Some(name) if known.is_empty() || known.iter().any(|k| k == name) => Ok(name.to_owned()),
            Some(name) => {
                let named: Vec<&str> = known.iter().filter(|k| !k.is_empty()).map(String::as_str).collect();
                let known = if named.is_empty() { "one, without a name".to_owned() } else { named.join(", ") };
                Err(UnknownName { what: "lighting", asked: name.to_owned(), known })
            }
        }
    }

    /// The views of some names, in the site's order; all where none is named.
    ///
    /// # Errors
    ///
    /// A name that no view has.
    pub fn views_named(&self, names: &[String]) -> Result<Vec<&View>, UnknownName> {
        if let Some(asked) = names.iter().find(|name| self.views.iter().all(|v| v.name != **name)) {
            let known = self.views.iter().map(|v| v.name.as_str()).collect::<Vec<_>>().join(", ");
            return Err(UnknownName { what: "view", asked: asked.clone(), known });
        }
        Ok(self.views.iter().filter(|v| names.is_empty() || names.contains(&v.name)).collect())
    }

    /// All lightings that any probe has, in the file's order; `""` is the lone picture's.
    pub fn lightings(&self) -> Vec<String> {
        let mut all: Vec<String> = Vec::new();
        for picture in self.probes.iter().flat_map(|p| &p.pictures) {
            if !all.contains(&picture.lighting) {
                all.push(picture.lighting.clone());
            }
        }
        all
    }
}

/// A lighting or a view was asked for that the site does not have.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("there is no {what} “{asked}”. The site's {what}s: {known}")]
pub struct UnknownName {
    /// `lighting` or `view`.
    pub what: &'static str,
    /// The name.
    pub asked: String,
    /// Those that there are.
    pub known: String,
}

/// How a model's vertex colours are encoded; OBJ does not say.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum VertexColours {
    /// Proportional to albedo.
    #[default]
    Linear,
    /// By sRGB's curve, as programs that colour scans from photographs mostly write them.
    #[serde(alias = "sRGB")]
    Srgb,
}

/// Whether the pictures of probes and the photographs of views must be there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pictures {
    /// A missing one is a fault.
    MustExist,
    /// They are still to be made; those that are there are checked.
    MayBeMissing,
}

/// Whether probes must have a position.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Places {
    MustBeGiven,
    MayBeMissing,
}

/// Where the light outside comes from.
#[derive(Clone, Debug)]
#[expect(clippy::large_enum_variant, reason = "a site has one")]
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
    /// Whether the site file says where; without a place, [`Site::load_to_register`] gives the model's origin.
    pub placed: bool,
    /// One picture per lighting, in the file's order; a lone picture has the lighting `""`.
    pub pictures: Vec<LitPicture>,
    /// How pixels map to directions.
    pub projection: Projection,
    /// Radiance per stored value, by channel: exposure and white balance.
    pub gain: Vec3,
    /// Vignetting of a perspective picture, see [`Radiometry`].
    pub vignetting: Vec2,
    /// What the camera bent beside sRGB's curve, see [`Radiometry`].
    pub response: Vec2,
}

impl Probe {
    /// How values that its files store become light.
    pub fn radiometry(&self, coding: Coding) -> Radiometry {
        let Self { gain, vignetting, response, .. } = *self;
        Radiometry { gain, vignetting, response, clipped: coding.clipped() }
    }

    /// Its picture under a lighting, if it has one.
    pub fn picture(&self, lighting: &str) -> Option<&LitPicture> {
        self.pictures.iter().find(|p| p.lighting == lighting)
    }
}

/// One of a probe's pictures.
#[derive(Clone, Debug)]
pub struct LitPicture {
    /// The lighting's name, such as `10:00`; empty where the site has only one.
    pub lighting: String,
    /// The picture's file; of a numbered sequence the first.
    pub path: PathBuf,
    /// All pictures of a numbered sequence, in their order; empty for a lone picture.
    pub frames: Vec<PathBuf>,
}

impl LitPicture {
    /// The picture at a frame of a video: that of a sequence, which stays at its last, or the lone one.
    pub fn at(&self, frame: usize) -> &Path {
        self.frames.get(frame).or(self.frames.last()).unwrap_or(&self.path)
    }
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
    /// Known pairs of pixel and model point.
    pub matches: Vec<Match>,
    /// Where the camera comes from.
    pub source: CameraSource,
}

impl View {
    /// The name of its pictures' files, without ending: its own, or with `view-` before it where that is one of the report's own
    /// files.
    pub fn file_stem(&self) -> String {
        const FILES: [&str; 8] = ["index", "manifest", "check", "render", "plan", "study", "findings", "coverage"];
        const BEGINNINGS: [&str; 7] = ["view-", "audit-", "plan-", "coverage-", "mask-", "register-", "study-"];
        let name = self.name.to_lowercase();
        let stem = name.split('.').next().unwrap_or(&name);
        let taken = FILES.contains(&stem) || BEGINNINGS.iter().any(|begin| name.starts_with(begin));
        // the report's own pictures of a view are called so
        let ending =
            if ["-photo", "-relit", "-findings", "-view"].iter().any(|own| name.ends_with(own)) { "-view" } else { "" };
        if taken { format!("view-{}{ending}", self.name) } else { self.name.clone() }
    }
}

/// Where a view's camera comes from.
#[derive(Clone, Debug)]
pub enum CameraSource {
    /// From the site file.
    SiteFile,
    /// From a file that another program wrote.
    PoseFile(PathBuf),
    /// From pairs of pixel and model point.
    Matches(Box<Resection>),
}

/// How probes are to be planned. Lengths are metres; points are the program's x and y, not re-centred.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    /// Height of the probe above the floor.
    pub probe_height_m: f64,
    /// Least distance to a wall.
    pub clearance_m: f64,
    /// How far a probe sees; 0 is without limit.
    pub range_m: f64,
    /// Degrees from the normal past which a surface does not count as seen.
    pub incidence_deg: f64,
    /// The share of the open surface that is enough, above 0 and at most 1.
    pub target_coverage: f64,
    /// The most probes to place.
    pub max_probes: u32,
    /// The share of what a probe sees that it must have in common with a neighbour, 0 to 1.
    pub overlap: f64,
    /// The lowest and highest direction that a probe's picture holds, degrees above the horizon.
    pub vertical_field_deg: [f64; 2],
    /// Polygons where no tripod may stand.
    pub keep_out: Vec<Vec<DVec2>>,
    /// Places where a probe must stand.
    pub fixed: Vec<DVec2>,
}

impl Default for Plan {
    /// Values that suit a tripod.
    fn default() -> Self {
        Self {
            probe_height_m: 1.6,
            clearance_m: 0.3,
            range_m: 0.0,
            incidence_deg: 80.0,
            target_coverage: 0.98,
            max_probes: 12,
            overlap: 0.3,
            vertical_field_deg: [-90.0, 90.0],
            keep_out: Vec::new(),
            fixed: Vec::new(),
        }
    }
}
