//! Reading Radiance `.hdr`.

use std::fs::File;
use std::io::BufReader;
use std::path::Path;

use glam::Vec3;
use image::ImageDecoder;
use image::codecs::hdr::HdrDecoder;

use super::limits::{Result, allocate, check_size};
use super::raster::decode_error;
use crate::panorama::{PanoramaError, Picture};

pub(crate) fn dimensions(path: &Path, file: BufReader<File>) -> Result<(usize, usize)> {
    let decoder = HdrDecoder::new_nonstrict(file).map_err(|e| decode_error(path, e))?;
    let (width, height) = decoder.dimensions();
    check_size(path, width.into(), height.into())
}

pub(crate) fn read(path: &Path, file: BufReader<File>) -> Result<Picture> {
    let decoder = HdrDecoder::new_nonstrict(file).map_err(|e| decode_error(path, e))?;
    let (width, height) = decoder.dimensions();
    let (width, height) = check_size(path, width.into(), height.into())?;
    let meta = decoder.metadata();
    // the header's lines multiply up; stored values are radiance times them (Ward, *Real Pixels*, 1991)
    let correction = meta.color_correction.map_or(Vec3::ONE, |(r, g, b)| Vec3::new(r, g, b));
    let scale = (correction * meta.exposure.unwrap_or(1.0)).recip();
    if !(scale.is_finite() && scale.min_element() > 0.0) {
        return Err(PanoramaError::damaged(path, "EXPOSURE or COLORCORR that is not a positive number"));
    }
    let mut picture = allocate(path, width, height)?;
    decoder.read_image(bytemuck::cast_slice_mut(&mut picture.pixels)).map_err(|e| decode_error(path, e))?;
    picture.pixels.iter_mut().for_each(|pixel| *pixel *= scale);
    Ok(picture)
}

#[cfg(test)]
mod tests {
    use crate::panorama::dimensions;
    use crate::panorama::read;
    use glam::Vec3;

    fn file(header: &str, pixels: &[[u8; 4]]) -> (tempfile::TempDir, std::path::PathBuf) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.hdr");
        let bytes = [header.as_bytes(), pixels.as_flattened()].concat();
        std::fs::write(&path, bytes).unwrap();
        (folder, path)
    }

    /// 128 · 2^(129 − 136) = 1 and so on.
    const PIXELS: [[u8; 4]; 2] = [[128, 64, 32, 129], [255, 1, 0, 140]];

    #[test]
    fn exposure_and_colour_correction_are_divided_out() {
        for magic in ["#?RADIANCE", "#?RGBE"] {
            let (_folder, path) = file(&format!("{magic}\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 2\n"), &PIXELS);
            assert_eq!(dimensions(&path).unwrap(), (2, 1));
            let picture = read(&path).unwrap();
            assert_eq!(picture.pixels, [Vec3::new(1.0, 0.5, 0.25), Vec3::new(4080.0, 16.0, 0.0)]);
        }
        // the header's lines multiply up
        let header = "#?RADIANCE\nEXPOSURE=2\nEXPOSURE=4\nCOLORCORR=1 2 0.5\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 2\n";
        let (_folder, path) = file(header, &PIXELS);
        let expected = [Vec3::new(1.0, 0.25, 0.5) / 8.0, Vec3::new(510.0, 1.0, 0.0)];
        assert_eq!(read(&path).unwrap().pixels, expected);
    }

    #[test]
    fn what_is_not_read_is_named() {
        for (header, named) in [
            ("#?RADIANCE\nFORMAT=32-bit_rle_xyze\n\n-Y 1 +X 2\n", "xyze"),
            ("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n+Y 1 +X 2\n", "+Y"),
            ("#?RADIANCE\nEXPOSURE=0\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 2\n", "EXPOSURE"),
        ] {
            let (_folder, path) = file(header, &PIXELS);
            let message = read(&path).unwrap_err().to_string();
            assert!(message.contains("a.hdr") && message.contains(named), "{message}");
        }
    }
}
