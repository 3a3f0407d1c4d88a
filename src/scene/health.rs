//! What is wrong with a mesh, and the cleaning that import does.

use super::Mesh;

/// What import found and did.
#[derive(Clone, Debug, Default)]
pub struct Health {
    /// Sentences a modeller understands.
    pub warnings: Vec<String>,
}

pub(super) fn clean(_mesh: &mut Mesh, _health: &mut Health) {}
