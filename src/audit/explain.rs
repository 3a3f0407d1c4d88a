//! What became of a texture: which turn, mirror, shift or scale of the model's picture the photograph shows.

use glam::{Mat2, Vec2};
use rayon::prelude::*;

use super::regions::Region;
use super::view::Maps;
use super::{What, correlation};
use crate::panorama::luminance;
use crate::scene::{Scene, Texture};

/// Pixels that are looked at.
const SAMPLES: usize = 1200;

/// Shifts that are tried along each side of the picture.
const SHIFTS: usize = 20;

/// The highest places among these from which a better one is looked for.
const PEAKS: usize = 8;

/// A correlation from which on a texture counts as found.
const FOUND: f32 = 0.45;

/// What must be gained over the texture as it is.
const GAINED: f32 = 0.2;

/// Brightness of less variance than this is even.
const LEAST_VARIANCE: f64 = 1e-8;

/// Neighbouring samples are alike: so many tell as much as one.
const ALIKE: f32 = 12.0;

/// Logarithm of the odds from which on a less likely transform is preferred: a chequered floor that was turned nearly fits
/// when it is shifted.
const ODDS: f32 = 3.0;

/// What the photograph shows of a texture.
#[derive(Clone, Copy, Debug)]
pub(super) struct Explained {
    pub(super) what: What,
    /// Correlation of brightness between photograph and model as it is.
    pub(super) as_is: f32,
    /// The same for the best explanation.
    pub(super) best: f32,
}

/// The transforms that are tried, with what they are called, the likelier first.
fn candidates(aspect: f32) -> Vec<(What, Mat2)> {
    let turn = |q: f32, s: f32| Mat2::from_cols(Vec2::new(0.0, q * s), Vec2::new(-q / s, 0.0));
    let scale = |s: f32| Mat2::from_diagonal(Vec2::splat(s));
    let mut all = vec![
        (What::Shifted, Mat2::IDENTITY),
        (What::Rotated, turn(1.0, 1.0)),
        (What::Rotated, turn(-1.0, 1.0)),
        (What::Rotated, scale(-1.0)),
        (What::Mirrored, Mat2::from_diagonal(Vec2::new(-1.0, 1.0))),
        (What::Mirrored, Mat2::from_diagonal(Vec2::new(1.0, -1.0))),
    ];
    if (aspect - 1.0).abs() > 0.05 {
        all.extend([1.0, -1.0].map(|q| (What::Rotated, turn(q, aspect))));
        all.extend([1.0, -1.0].map(|q| (What::Rotated, turn(q, 1.0 / aspect))));
    }
    all.extend([0.5, 0.625, 0.714, 0.8, 1.25, 1.4, 1.6, 2.0].map(|s| (What::Scaled, scale(s))));
    all
}

/// Looks for the transform of a region's texture that the photograph shows.
pub(super) fn explain(scene: &Scene, maps: &Maps, region: &Region, colour: f32) -> Explained {
    let s = &maps.surfaces;
    let tested: Vec<usize> = region.pixels.iter().copied().filter(|i| maps.texture.tested[*i]).collect();
    let step = tested.len().div_ceil(SAMPLES).max(1);
    let chosen: Vec<usize> = tested.into_iter().step_by(step).collect();
    let real: Vec<f32> = chosen
        .iter()
        .map(|&i| luminance(maps.albedo[i] * maps.texture.ratio[i].map(f32::exp)).max(1e-6).ln())
        .collect();
    let modelled: Vec<f32> = chosen.iter().map(|&i| luminance(maps.albedo[i]).max(1e-6).ln()).collect();
    let as_is = alike(&real, &modelled);
    let recoloured = |as_is| if as_is > 0.6 || colour > 1.5 { What::Recoloured } else { What::Changed };
    // the texture that most of the region has
    let texture_of = |i: usize| scene.materials[s.material[i] as usize].texture;
    let mut votes = vec![0usize; scene.textures.len()];
    for &i in &chosen {
        if let Some(t) = texture_of(i) {
            votes[t as usize] += 1;
        }
    }
    let Some((id, _)) = votes.iter().enumerate().max_by_key(|(_, v)| **v).filter(|(_, v)| 2 * **v > chosen.len())
    else {
        return Explained { what: recoloured(as_is), as_is, best: as_is };
    };
    if as_is > 0.75 {
        return Explained { what: What::Recoloured, as_is, best: as_is };
    }
    let texture = &scene.textures[id];
    let places: Vec<(usize, Vec2, f32)> = chosen
        .iter()
        .enumerate()
        .filter(|(_, i)| texture_of(**i) == Some(id as u32))
        .filter_map(|(k, &i)| {
            let uv = scene.mesh.uv(s.triangle[i], s.barycentric[i])?;
            let texels = s.footprint(i) * scene.mesh.uv_per_metre(s.triangle[i]) * texture.texels_per_unit();
            let level = Texture::level_of(texels);
            Some((k, uv, level))
        })
        .collect();
    if places.len() < 30 {
        return Explained { what: recoloured(as_is), as_is, best: as_is };
    }
    let centre = places.iter().map(|p| p.1).sum::<Vec2>() / places.len() as f32;
    let (w, h) = texture.size();
    let photo: Vec<f32> = places.iter().map(|p| real[p.0]).collect();
    let score = |m: Mat2, shift: Vec2| {
        let shown: Vec<f32> = places
            .iter()
            .map(|(_, uv, level)| luminance(texture.sample(centre + m * (*uv - centre) + shift, *level)).max(1e-4).ln())
            .collect();
        alike(&photo, &shown)
    };
    // fine structure has narrow peaks: the highest point of a coarse grid need not lie on the highest of them
    let search = |m: Mat2| {
        let at = |k: usize| Vec2::new((k % SHIFTS) as f32, (k / SHIFTS) as f32) / SHIFTS as f32;
        let grid: Vec<f32> = (0..SHIFTS * SHIFTS).map(|k| score(m, at(k))).collect();
        let mut peaks = peaks(&grid);
        peaks.sort_by(|a, b| grid[*b].total_cmp(&grid[*a]));
        let climbed = peaks.into_iter().take(PEAKS).map(|k| {
            let (mut best, mut step) = ((grid[k], at(k)), 0.5 / SHIFTS as f32);
            for _ in 0..6 {
                for d in [Vec2::X, Vec2::NEG_X, Vec2::Y, Vec2::NEG_Y] {
                    let c = score(m, best.1 + d * step);
                    if c > best.0 {
                        best = (c, best.1 + d * step);
                    }
                }
                step *= 0.5;
            }
            best
        });
        climbed.fold((f32::NEG_INFINITY, Vec2::ZERO), |best, c| if c.0 > best.0 { c } else { best })
    };
    let candidates = candidates(w as f32 / h as f32);
    let found: Vec<(f32, Vec2)> = candidates.par_iter().map(|(_, m)| search(*m)).collect();
    let mut best = (What::Changed, as_is);
    for ((what, _), (c, _)) in candidates.iter().zip(&found) {
        // the likelier comes first, and a less likely one must explain what the likelier cannot
        let better = if best.0 == What::Changed {
            *c > best.1 + GAINED
        } else {
            let left = |c: f32| 1.0 - c.clamp(0.0, 0.999).powi(2);
            0.5 * places.len() as f32 / ALIKE * (left(best.1) / left(*c)).ln() > ODDS
        };
        if *c > FOUND && better {
            best = (*what, *c);
        }
    }
    if best.0 == What::Changed && as_is > 0.6 {
        best.0 = What::Recoloured;
    }
    Explained { what: best.0, as_is, best: best.1 }
}

/// The places of a square grid that repeats on all sides where no neighbour is higher.
fn peaks(grid: &[f32]) -> Vec<usize> {
    let value = |x: usize, y: usize| grid[(y % SHIFTS) * SHIFTS + x % SHIFTS];
    let is_peak = |k: &usize| {
        let (x, y) = (k % SHIFTS + SHIFTS, k / SHIFTS + SHIFTS);
        (0..9).all(|n| value(x + n % 3 - 1, y + n / 3 - 1) <= grid[*k])
    };
    (0..grid.len()).filter(is_peak).collect()
}

fn alike(a: &[f32], b: &[f32]) -> f32 {
    correlation(a.iter().copied().zip(b.iter().copied()), LEAST_VARIANCE).0
}
