//! A setup's colours as a picture with a texel a point: then they are averaged over what a pixel covers of them, and may be
//! finer than the mesh.

use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ExtendedColorType, ImageEncoder};

use crate::memory;
use crate::scene::error::MAX_SIDE;

/// Every so-manieth of the rows and columns that points are numbered by.
#[derive(Clone, Copy, Debug)]
pub(super) struct Extent {
    /// One of so many is counted.
    step: i64,
    /// Least row and column, counted so.
    first: [i64; 2],
    /// How many rows and columns from there.
    pub(super) size: [usize; 2],
}

impl Extent {
    /// Around all places, row and column of each.
    ///
    /// # Errors
    ///
    /// Rows and columns so far apart that the raster is all but empty, or takes more memory than is allowed.
    pub(super) fn of(places: impl ExactSizeIterator<Item = [i32; 2]>, step: i64) -> Result<Self, String> {
        let count = places.len();
        let (mut low, mut high) = ([i64::MAX; 2], [i64::MIN; 2]);
        for (place, axis) in places.flat_map(|p| [(p[0], 0), (p[1], 1)]) {
            let place = i64::from(place) / step;
            (low[axis], high[axis]) = (low[axis].min(place), high[axis].max(place));
        }
        if count == 0 {
            return Ok(Self { step, first: [0; 2], size: [0; 2] });
        }
        let size = [0, 1].map(|axis| (high[axis] - low[axis] + 1) as usize);
        let room = count.saturating_mul(64).saturating_add(1 << 16);
        if size[0].checked_mul(size[1]).is_none_or(|all| all > room) || count >= u32::MAX as usize {
            let [rows, columns] = size;
            return Err(format!(
                "a scan of {count} points has {rows} rows and {columns} columns: they are numbered wrongly. Export it again"
            ));
        }
        memory::check(4 * (size[0] * size[1]) as u64).map_err(|over| over.to_string())?;
        Ok(Self { step, first: low, size })
    }

    /// Where a place stands, row by row.
    pub(super) fn index(&self, place: [i32; 2]) -> usize {
        let [row, column] = [0, 1].map(|axis| (i64::from(place[axis]) / self.step - self.first[axis]) as usize);
        row * self.size[1] + column
    }
}

/// A point's colour as sRGB, and its row and column.
#[derive(Clone, Copy, Debug)]
pub(super) struct Texel {
    pub(super) place: [i32; 2],
    pub(super) colour: [u8; 3],
}

/// A picture of a setup's colours.
#[derive(Debug)]
pub(super) struct Raster {
    extent: Extent,
    /// Row by row.
    texels: Vec<[u8; 3]>,
}

impl Raster {
    /// The picture of every `step`th row and column, or of fewer if it would be too wide; where there is no point, the colours beside it go on.
    ///
    /// # Errors
    ///
    /// As [`Extent::of`].
    pub(super) fn of(points: &[Texel], step: i64) -> Result<Self, String> {
        let extent = Extent::of(points.iter().map(|p| p.place), step)?;
        if extent.size[0].max(extent.size[1]) > MAX_SIDE as usize {
            return Self::of(points, 2 * step);
        }
        let mut texels = vec![None; extent.size[0] * extent.size[1]];
        points.iter().for_each(|p| texels[extent.index(p.place)] = Some(p.colour));
        Ok(Self { extent, texels: continued(&texels, extent.size[1]) })
    }

    /// How many of the scan's columns the picture spans.
    pub(super) fn columns(&self) -> i64 {
        self.extent.size[1] as i64 * self.extent.step
    }

    /// Texture coordinates of a row and column of the scan.
    pub(super) fn uv(&self, place: [i64; 2]) -> [f64; 2] {
        let [v, u] = [0, 1].map(|axis| {
            let texel = place[axis] as f64 / self.extent.step as f64 - self.extent.first[axis] as f64;
            (texel + 0.5) / self.extent.size[axis] as f64
        });
        [u, 1.0 - v]
    }

    /// The picture as a PNG file, quickly packed.
    ///
    /// # Errors
    ///
    /// What the encoder says.
    pub(super) fn png(&self) -> Result<Vec<u8>, String> {
        let mut bytes = Vec::new();
        let [height, width] = self.extent.size.map(|n| n as u32);
        PngEncoder::new_with_quality(&mut bytes, CompressionType::Fast, FilterType::Up)
            .write_image(self.texels.as_flattened(), width, height, ExtendedColorType::Rgb8)
            .map_err(|e| e.to_string())?;
        Ok(bytes)
    }
}

/// Texels of rows `width` wide, with those that are not there as the nearest in their row, or as in the row above.
fn continued(texels: &[Option<[u8; 3]>], width: usize) -> Vec<[u8; 3]> {
    let mut all: Vec<[u8; 3]> = Vec::with_capacity(texels.len());
    let first = texels.iter().flatten().next().copied().unwrap_or([255; 3]);
    for row in texels.chunks(width.max(1)) {
        let known: Vec<usize> = (0..row.len()).filter(|i| row[*i].is_some()).collect();
        let mut next = 0;
        for column in 0..row.len() {
            // the known texel whose part of the row this is
            while next + 1 < known.len() && known[next + 1] + known[next] <= 2 * column {
                next += 1;
            }
            let above = || all.len().checked_sub(width).map_or(first, |i| all[i]);
            let texel = known.get(next).and_then(|i| row[*i]).unwrap_or_else(above);
            all.push(texel);
        }
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_picture_has_each_points_colour_at_its_coordinates_and_goes_on_where_there_is_none() {
        let point = |row, column, grey| Texel { place: [row, column], colour: [grey; 3] };
        // every third of rows 6 to 12 and columns −3 to 9
        let raster = Raster::of(&[point(6, -3, 10), point(6, 9, 90), point(12, 0, 50)], 3).unwrap();
        let greys: Vec<u8> = raster.texels.iter().map(|t| t[0]).collect();
        assert_eq!(greys, [10, 10, 90, 90, 90, 10, 10, 90, 90, 90, 50, 50, 50, 50, 50]);
        let picture = image::load_from_memory(&raster.png().unwrap()).unwrap().into_rgb8();
        assert_eq!((picture.dimensions(), picture.get_pixel(4, 0).0), ((5, 3), [90; 3]));
        let close = |a: [f64; 2], b: [f64; 2]| (a[0] - b[0]).abs() + (a[1] - b[1]).abs() < 1e-12;
        assert!(close(raster.uv([6, -3]), [0.1, 1.0 - 1.0 / 6.0]) && close(raster.uv([12, 9]), [0.9, 1.0 / 6.0]));
        assert_eq!(raster.columns(), 15);
    }

    #[test]
    fn rows_and_columns_that_make_no_raster_are_refused() {
        assert!(Extent::of([[0, 0], [i32::MAX, i32::MAX]].into_iter(), 1).is_err());
        assert!(Extent::of([[i32::MIN, i32::MIN], [i32::MAX, i32::MAX]].into_iter(), 1).is_err());
        assert_eq!(Extent::of(std::iter::empty(), 1).unwrap().size, [0, 0]);
    }
}
