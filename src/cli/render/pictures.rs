//! What a view is written as.

use clerestory::panorama::{Exposure, Layer, Picture, write_exr, write_png};
use clerestory::site::View;
use std::path::{Path, PathBuf};

/// Writes a view's layers as EXR and its radiance as PNG, whole or not at all; tells the EXR file's path.
pub(super) fn write(
    layers: &[Layer],
    radiance: &Picture,
    view: &View,
    folder: &Path,
    exposure: Exposure,
) -> anyhow::Result<PathBuf> {
    let file = folder.join(format!("{}.exr", view.file_stem()));
    write_exr(&file, radiance.width, radiance.height, layers, None)?;
    write_png(&file.with_extension("png"), radiance, exposure)?;
    Ok(file)
}
