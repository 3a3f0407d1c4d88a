//! Makes the files of the bundled chapel that need no simulation: models, pictures, sky and site files.

pub mod building;
pub mod finish;
pub mod furnishing;
pub mod mesh;
pub mod paint;
pub mod parts;

use mesh::Model;

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
pub fn model(version: Version) -> Model {
    let mut m = Model::default();
    building::build(&mut m, version);
    furnishing::build(&mut m, version);
    m
}
