//! Makes the files of the bundled chapel that need no simulation: models, pictures, sky and site files.

pub mod building;
pub mod finish;
pub mod furnishing;
pub mod paint;
pub mod site;
pub mod sky;

use crate::common::mesh::Model;
use image::ImageResult;

/// Which of the two models.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Version {
    /// The chapel as it stands.
    Truth,
    /// The chapel as a modeller drew it, with planted faults.
    AsModelled,
}

impl Version {
    /// Whether the faults are in.
    pub fn faulty(self) -> bool {
        self == Self::AsModelled
    }
}

/// The whole model.
pub fn model(version: Version) -> Model<'static> {
    let mut m = Model::default();
    building::build(&mut m, version);
    furnishing::build(&mut m, version);
    m
}

/// Every file of the site that is made without simulation and is not an EXR: path inside the site, and bytes.
///
/// # Errors
/// When a picture cannot be encoded.
pub fn files() -> ImageResult<Vec<(String, Vec<u8>)>> {
    let mut files = vec![
        ("site.toml".to_string(), site::toml(Version::Truth).into_bytes()),
        ("as_modelled.toml".to_string(), site::toml(Version::AsModelled).into_bytes()),
        ("faults.json".to_string(), site::faults().into_bytes()),
    ];
    for (folder, version) in [("model", Version::Truth), ("as_modelled", Version::AsModelled)] {
        let model = model(version);
        files.push((
            format!("{folder}/chapel.obj"),
            model.obj("A small chapel of our own making", "chapel.mtl").into_bytes(),
        ));
        files.push((format!("{folder}/chapel.mtl"), model.mtl().into_bytes()));
        for name in model.finishes().iter().filter_map(|f| f.texture.as_deref()) {
            if let Some(picture) = paint::picture(name) {
                files.push((format!("{folder}/{name}"), picture?));
            }
        }
    }
    Ok(files)
}
