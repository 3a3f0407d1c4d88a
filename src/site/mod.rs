//! The site file: what a site is made of, checked, with every pose brought into the program's frame.
//!
//! `file` knows the keys, `resolve` checks them table by table, `fault` says what is wrong and where, [`edit`] writes poses
//! back. `camera` and `lens`
//! map points to pixels and back, `resection` finds a pose from picked points, `poses` reads what other programs found.
//!
//! # Orientation
//!
//! A probe or view is turned by one of
//!
//! | keys | meaning |
//! |---|---|
//! | `heading`, `pitch`, `roll` | degrees clockwise from true north seen from above; up; clockwise as the camera sees it. All default to 0 |
//! | `look_at = [x, y, z]` | a point of the model in the picture's centre; the horizon level |
//! | `rotation = [w, x, y, z]` | a unit quaternion from the camera's axes to the model's |
//! | `matrix = [[…], […], […]]` | the same as rows of a rotation matrix |
//!
//! The camera's axes of a quaternion or matrix are those of OpenGL, Blender and glTF: +x right, +y up, −z forward; so
//! the matrix's columns are the camera's right, up and backward in the model's axes. A panorama's forward is its centre
//! column. Unit length and right angles may be off by 10⁻³. Inside the program a camera has +x right, +y forward, +z up
//! ([`Pose::rotation`]).
//!
//! # Example
//!
//! ```
//! use clerestory::site::Site;
//! use std::path::Path;
//! # let chapel = concat!(env!("CARGO_MANIFEST_DIR"), "/sites/chapel");
//!
//! let site = Site::load(Path::new(chapel))?;
//! assert_eq!(site.lightings(), ["10:00", "14:30"]);
//! assert_eq!(site.views[0].camera.width, 256);
//!
//! // what is wrong is told with its place
//! let text = "[site]\nunits = \"m\"\nup = \"y\"\n[model]\npth = \"a.obj\"\n";
//! let fault = Site::of_text(&Path::new(chapel).join("other.toml"), text).unwrap_err().to_string();
//! assert!(fault.contains("other.toml") && fault.contains("pth"));
//! # Ok::<(), clerestory::site::SiteError>(())
//! ```

mod camera;
pub mod edit;
mod fault;
mod file;
pub(crate) mod files;
mod frame;
mod load;
mod numbers;
mod parse;
mod pose;
mod poses;
mod resection;
mod resolve;
mod sequence;
#[expect(clippy::module_inception, reason = "where a newcomer looks for Site")]
mod site;
mod walk;

pub use crate::panorama::{Distortion, Lens};
pub use camera::Camera;
pub use fault::SiteError;
pub(crate) use file::metres_in;
pub use frame::{Frame, Pose, UNITS, Unit, Up};
pub(crate) use poses::files as files_of_poses;
pub use poses::{PoseFileError, photographs as pose_file_photographs};
pub use resection::{Match, Resection, ResectionError};
pub use site::{
    CameraSource, Environment, LitPicture, Pictures, Plan, Probe, Project, Site, Sun, UnknownName, VertexColours, View,
};
pub use walk::walk;
