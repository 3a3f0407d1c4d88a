//! Whether a photograph shows what the model makes, structure by structure.
//!
//! Photograph and model are cut into bands of structure, of a few pixels each and upwards. Where the model is right the one's
//! band is the other's and noise; where it is not, the two have nothing in common, and what both have adds up to their difference.
//! A model's blurred or pale paint loses some of what is common, but gains no difference beyond it. Differences count in units of
//! what they usually are in the picture at hand, with the covariance that its colours have there: light changes brightness more
//! than hue.

use glam::{Mat3, Vec3};
use rayon::prelude::*;

use crate::audit::likelihood::noise::{EVERY, whitening};
use crate::audit::observe::photo::DARK;
use crate::audit::picture::regions::{dilated, mask_of};
use crate::edge_aware::EdgeAware;
use crate::statistics::median;

/// Structure of a size is what the first blur keeps and the second does not: standard deviations, pixels.
const BANDS: [[f32; 2]; 3] = [[1.5, 4.0], [3.0, 8.0], [6.0, 16.0]];

/// Standard deviation of the widest window, pixels.
pub(crate) fn widest() -> f32 {
    BANDS[BANDS.len() - 1][1]
}

/// Per pixel, whether it is one of some or no farther off than the widest windows that regions are told over.
pub(crate) fn near(pixels: &[usize], width: usize, n: usize) -> Vec<bool> {
    dilated(&mask_of(pixels, n), width, n / width, widest() as usize)
}

/// Per size of structure and pixel, the logarithm of how much more photograph and model differ than they have in common, over a
/// window as wide as the structure: 0 where neither is more than noise.
pub(crate) type Unlike = [Vec<f32>; BANDS.len()];

/// Compares a photograph with what a model makes, radiance; what is not positive there is not compared, and what is darker than `dark` the
/// photograph does not tell apart.
pub(crate) fn unlike(width: usize, photo: &[Vec3], model: &[Vec3], usable: &[f32], dark: Vec3) -> Unlike {
    let n = photo.len();
    let open = EdgeAware::open(width, n / width.max(1));
    let known: Vec<f32> = (0..n)
        .map(|i| usable[i] > 0.0 && photo[i].is_finite() && model[i].is_finite() && model[i].max_element() > 0.0)
        .map(|known| if known { 1.0 } else { 0.0 })
        .collect();
    let (photo, model) = (levels(photo, &known, dark), levels(model, &known, dark));
    BANDS.map(|[fine, coarse]| {
        let within = [fine, coarse].map(|sigma| open.smoothed(&known, sigma));
        let band = |values: &[Vec3]| -> Vec<Vec3> {
            let [fine, coarse] = [(fine, &within[0]), (coarse, &within[1])]
                .map(|(sigma, smoothed)| open.mean_colour_with(values, &known, smoothed, sigma));
            fine.iter().zip(coarse).map(|(fine, coarse)| fine - coarse).collect()
        };
        let (a, b) = rayon::join(|| band(&photo), || band(&model));
        let unit = unit((0..n).step_by(EVERY).filter(|i| known[*i] > 0.0).map(|i| a[i] - b[i]).collect());
        let mean = |of: &(dyn Fn(Vec3, Vec3) -> f32 + Sync)| -> Vec<f32> {
            let values: Vec<f32> = (0..n).into_par_iter().map(|i| of(unit * a[i], unit * b[i]) / 3.0).collect();
            open.mean_with(&values, &known, &within[1], coarse)
        };
        let apart = mean(&|a, b| (a - b).length_squared());
        let common = mean(&|a, b| a.dot(b));
        let of = |i: usize| if known[i] > 0.0 { apart[i].ln_1p() - common[i].max(0.0).ln_1p() } else { 0.0 };
        (0..n).map(of).collect()
    })
}

/// Logarithms, the dark drawn together; 0 where nothing is known.
fn levels(values: &[Vec3], known: &[f32], dark: Vec3) -> Vec<Vec3> {
    let middle = |c: usize| {
        let all = values.iter().zip(known).filter(|(_, k)| **k > 0.0).map(|(v, _)| v[c]);
        median(all).unwrap_or(1.0).max(1e-30)
    };
    let middle = Vec3::new(middle(0), middle(1), middle(2));
    let level = |v: Vec3| ((v.max(Vec3::ZERO) + dark) / middle + Vec3::splat(DARK)).map(f32::ln);
    values.iter().zip(known).map(|(v, k)| if *k > 0.0 { level(*v) } else { Vec3::ZERO }).collect()
}

/// Squared length that half of all differences are shorter than, in units that [`unit()`] makes: half a unit a channel.
pub(crate) const USUAL: f32 = 1.5;

/// Makes the channels of differences independent and alike, and half of them shorter than half a unit a channel, squared.
pub(crate) fn unit(differences: Vec<Vec3>) -> Mat3 {
    let white = whitening(differences.iter().copied());
    let middle = median(differences.iter().map(|d| (white * *d).length_squared())).unwrap_or(0.0);
    white * (USUAL / middle.max(1e-9)).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reference::random::splitmix64;

    const SIDE: usize = 96;

    /// Uniform in 0..1, another for each number.
    fn uniform(n: usize) -> f32 {
        (splitmix64(n as u64) >> 40) as f32 / (1 << 24) as f32
    }

    /// Blotches of some pixels, another picture for each seed.
    fn blotches(seed: usize) -> Vec<Vec3> {
        let of = |i: usize, c: usize| 0.2 + 0.5 * uniform((3 * seed + c) * 4096 + i / SIDE / 6 * 64 + i % SIDE / 6);
        (0..SIDE * SIDE).map(|i| Vec3::new(of(i, 0), of(i, 1), of(i, 2))).collect()
    }

    fn mean(values: &[f32], inside: &dyn Fn(usize) -> bool) -> f32 {
        let all: Vec<f32> = (0..values.len()).filter(|i| inside(*i)).map(|i| values[i]).collect();
        all.iter().sum::<f32>() / all.len() as f32
    }

    #[test]
    fn another_picture_is_unlike_and_pale_paint_in_uneven_light_is_not() {
        let model = blotches(1);
        let other = blotches(9);
        let within = |i: usize| (30..66).contains(&(i % SIDE)) && (30..66).contains(&(i / SIDE));
        let noise = |i: usize| 0.04 * (2.0 * uniform(i) - 1.0);
        // paler than the model, and brighter to the right
        let photo: Vec<Vec3> = (0..SIDE * SIDE)
            .map(|i| {
                let real = if within(i) { other[i] } else { model[i].powf(0.8) };
                real * (noise(i) + 0.01 * (i % SIDE) as f32).exp()
            })
            .collect();
        let told = unlike(SIDE, &photo, &model, &[1.0; SIDE * SIDE], Vec3::ZERO);
        // all but the coarsest band, which few blotches fill
        for band in &told[..2] {
            let (inside, outside) = (mean(band, &within), mean(band, &|i| i % SIDE < 20));
            assert!(inside > 1.1 && outside < -1.0, "{inside} {outside}");
        }
    }

    #[test]
    fn what_is_not_known_says_nothing_and_noise_says_little() {
        let mut model = vec![Vec3::splat(0.4); SIDE * SIDE];
        model[..SIDE * 10].fill(Vec3::NAN);
        let noise = |i: usize| Vec3::new(uniform(3 * i), uniform(3 * i + 1), uniform(3 * i + 2));
        let photo: Vec<Vec3> = (0..SIDE * SIDE).map(|i| (1e-3 * noise(i)).map(f32::exp)).collect();
        let told = unlike(SIDE, &photo, &model, &[1.0; SIDE * SIDE], Vec3::ZERO);
        for band in &told {
            assert!(band[..SIDE * 10].iter().all(|u| *u == 0.0));
            let (usual, most) = (mean(&band[SIDE * 10..], &|_| true), band.iter().copied().fold(0.0, f32::max));
            assert!((0.0..0.8).contains(&usual) && most < 1.1, "{usual} {most}");
        }
    }
}
