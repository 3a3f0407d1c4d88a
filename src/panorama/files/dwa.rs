//! OpenEXR's lossy compressions DWAA and DWAB: a look at a block's head before the crate decodes it, since that takes memory for
//! what the head claims (OpenEXR, `internal_dwa_compressor.h`: eleven counts of eight bytes).

use exr::block::chunk::{Chunk, CompressedBlock, CompressedScanLineBlock, CompressedTileBlock};
use exr::compression::Compression;
use exr::error::Result;
use exr::meta::header::Header;

/// Whether what a block says that it holds fits its pixels; blocks of other compressions do.
///
/// # Errors
///
/// A block that lies in no place of the picture.
pub(super) fn counts_fit(chunk: &Chunk, header: &Header) -> Result<bool> {
    /// Raw, run-length coded and coefficients' sizes among the counts.
    const SIZES: [usize; 5] = [1, 6, 7, 8, 9];
    let (Compression::DWAA(_) | Compression::DWAB(_)) = header.compression else { return Ok(true) };
    let (CompressedBlock::ScanLine(CompressedScanLineBlock { compressed_pixels_le: data, .. })
    | CompressedBlock::Tile(CompressedTileBlock { compressed_pixels_le: data, .. })) = &chunk.compressed_block
    else {
        return Ok(true);
    };
    let place = header.get_block_data_indices(&chunk.compressed_block)?;
    let size = header.get_absolute_block_pixel_coordinates(place)?.size;
    if data.len() == size.area() * header.channels.bytes_per_pixel {
        return Ok(true); // stored as it is
    }
    // coefficients fill whole squares of 8 × 8, and what does not shrink grows a little
    let squares = size.x().div_ceil(8) as u64 * size.y().div_ceil(8) as u64;
    let most = squares * 64 * header.channels.list.len() as u64 * 4 * 2;
    let count = |i: usize| data.get(8 * i..8 * i + 8).map(|b| b.iter().rev().fold(0u64, |n, b| n << 8 | u64::from(*b)));
    Ok(SIZES.iter().all(|i| count(*i).is_some_and(|count| count <= most)))
}

#[cfg(test)]
mod tests {
    use crate::panorama::{PanoramaError, read};
    use exr::compression::Compression;
    use exr::prelude::{Encoding, Image, SpecificChannels, Vec2, WritableImage};

    #[test]
    fn a_block_that_claims_more_than_fits_is_refused_before_memory_is_taken() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.exr");
        let channels = SpecificChannels::rgb(|Vec2(x, y)| ((x * y) as f32 / 1000.0, x as f32 / 32.0, 0.5_f32));
        let mut image = Image::from_channels((32, 32), channels);
        image.layer_data.encoding = Encoding { compression: Compression::DWAA(None), ..Encoding::FAST_LOSSLESS };
        image.write().to_file(&path).unwrap();
        assert_eq!(read(&path).unwrap().width, 32);
        // the one block: its line, its length, and eleven counts
        let whole = std::fs::read(&path).unwrap();
        let four = |at: usize| u32::from_le_bytes([whole[at], whole[at + 1], whole[at + 2], whole[at + 3]]) as usize;
        let start = (0..whole.len() - 8).find(|at| four(*at) == 0 && four(at + 4) == whole.len() - at - 8).unwrap() + 8;
        for count in [1, 6, 7, 8, 9] {
            let mut bytes = whole.clone();
            bytes[start + 8 * count + 6] = 1;
            std::fs::write(&path, bytes).unwrap();
            let error = read(&path).unwrap_err();
            assert!(
                matches!(error, PanoramaError::Damaged { .. }) && error.to_string().contains("more than fits"),
                "{error}"
            );
        }
    }
}
