//! Fits a photograph to its render.

use glam::Vec3;
use serde::Serialize;

use super::solve::{Row, VIGNETTING_PAYS, solve};
use crate::panorama::{Picture, Radiometry, radius2};

/// Exposure, white balance and vignetting of a photograph against its render.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct PhotographFit {
    /// The render's radiance per value of the photograph: red, green, blue.
    pub gain: [f32; 3],
    /// See [`Radiometry`].
    pub vignetting: [f32; 2],
    /// Robust standard deviation of the logarithm of what is left between the two.
    pub spread: f64,
    /// Pixels that were compared.
    pub pixels: usize,
}

/// At most so many pixels are compared, spread evenly.
const MOST: usize = 20_000;

/// Fewer say nothing.
const FEWEST: usize = 200;

/// Fits a photograph to a render of the same size, vignetting where that pays, as pictures are fitted to each other, over the pixels that `usable`
/// marks: lit surfaces that the photograph shows well. A value from `clipped` on is a lower bound. `None` where too few
/// pixels can be used.
pub fn fit_to_render(
    photo: &Picture,
    render: &Picture,
    clipped: f32,
    usable: impl Fn(usize) -> bool,
) -> Option<PhotographFit> {
    let (width, height) = (photo.width, photo.height);
    if (width, height) != (render.width, render.height) {
        return None;
    }
    // the golden ratio's multiples: no row or column is left out
    let count = photo.pixels.len();
    let chosen = (0..count.min(MOST)).map(|k| match count <= MOST {
        true => k,
        false => ((k as f64 * 0.618_033_988_749_894_9).fract() * count as f64) as usize,
    });
    let (mut plain, mut bent, mut pixels) = (Vec::new(), Vec::new(), 0);
    for i in chosen.filter(|&i| usable(i)) {
        let (p, r) = (photo.pixels[i], render.pixels[i]);
        if !Picture::valid(p) || !Picture::valid(r) {
            continue;
        }
        pixels += 1;
        let r2 = f64::from(radius2(width, height, (i % width) as f32 + 0.5, (i / width) as f32 + 0.5));
        for c in (0..3).filter(|&c| p[c] > 0.0 && r[c] > 0.0) {
            let residual = f64::from(p[c]).ln() - f64::from(r[c]).ln();
            let bound = i8::from(p[c] >= clipped);
            plain.push(Row::new(residual, &[(c, 1.0)], bound));
            bent.push(Row::new(residual, &[(c, 1.0), (3, r2), (4, r2 * r2)], bound));
        }
    }
    if pixels < FEWEST {
        return None;
    }
    let (mut found, with) = (solve(&plain, 3, 3, &[]), solve(&bent, 5, 3, &[]));
    if with.spread < VIGNETTING_PAYS * found.spread {
        found = with;
    }
    let [r, g, b, v, w] = [0, 1, 2, 3, 4].map(|k| found.theta.get(k).map_or(0.0, |t| *t as f32));
    Some(PhotographFit { gain: [r.exp(), g.exp(), b.exp()], vignetting: [v, w], spread: found.spread, pixels })
}

impl PhotographFit {
    /// The photograph in the render's light.
    pub fn develop(&self, photo: &Picture) -> Picture {
        let mut picture = photo.clone();
        let (gain, vignetting) = (Vec3::from(self.gain), self.vignetting.into());
        Radiometry { gain, vignetting, ..Radiometry::default() }.develop(&mut picture);
        picture
    }
}
