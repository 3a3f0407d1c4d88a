//! Where a texture may lie, as far as a grid over its period shows.
//!
//! All shifts of one turn and scale are tried at once: a texture repeats, so that the pixels' structure, put where the
//! texture has it and folded to one period, correlates with the texture by Fourier transforms.

use glam::{Mat2, Vec2};

use crate::audit::hypothesis::laying::texture_alignment::TexturePatch;
use crate::audit::likelihood::structure::BAND;
use crate::audit::picture::fourier::Complex;

/// Variance along a side of a square pixel, in squared pixels.
const PIXEL: f32 = 1.0 / 12.0;

/// Shifts of one turn and scale that are looked at closely.
const PEAKS: usize = 3;

impl TexturePatch<'_> {
    /// The shifts at which the texture, turned and scaled so, correlates best with the photograph, the best first, as far
    /// as a grid over its period shows.
    pub(crate) fn shifts(&self, turn: Mat2) -> Vec<(f32, Vec2)> {
        let n = self.side;
        let [mut seen, mut weight] = [(); 2].map(|()| vec![0.0f32; n * n]);
        let mut energy = 0.0f32;
        for ((p, a), w) in self.places.iter().zip(&self.photo).zip(&self.weight) {
            let at = (self.centre + turn * (p.at - self.centre)) * n as f32;
            let [x, y] = at.round().to_array().map(|v| (v as i64).rem_euclid(n as i64) as usize);
            seen[y * n + x] += w * a;
            weight[y * n + x] += w;
            energy += w * a * a;
        }
        let [seen, weight] = self.fourier.forward_two(&seen, &weight);
        let shown: Vec<Complex> = self.period.iter().enumerate().map(|(k, v)| v * self.pass(k, turn)).collect();
        let mut square = shown.clone();
        self.fourier.back(&mut square);
        let square = self.fourier.forward(square.iter().map(|v| v.re * v.re));
        // two real results in one transform: what follows the photograph, and its own energy
        let mut both: Vec<Complex> =
            (0..n * n).map(|k| shown[k] * seen[k].conj() + Complex::i() * square[k] * weight[k].conj()).collect();
        self.fourier.back(&mut both);
        let most = both.iter().fold(0.0f32, |m, v| m.max(v.im));
        let fit: Vec<f32> = both
            .iter()
            .map(|v| if v.im > 1e-3 * most { v.re / (v.im * energy).sqrt().max(1e-20) } else { 0.0 })
            .collect();
        let mut peaks = peaks(&fit, n);
        peaks.sort_by(|a, b| fit[*b].total_cmp(&fit[*a]).then(a.cmp(b)));
        let at = |k: usize| Vec2::new((k % n) as f32, (k / n) as f32) / n as f32;
        peaks.into_iter().take(PEAKS).map(|k| (fit[k], at(k))).collect()
    }

    /// How much of a wave of the period a photograph of the texture, turned and scaled so, has as structure.
    fn pass(&self, k: usize, turn: Mat2) -> f32 {
        let n = self.side;
        let waves = |k: usize| std::f32::consts::TAU * if 2 * k > n { k as f32 - n as f32 } else { k as f32 };
        // the wave as it runs over the texture as it is
        let wave = turn.transpose() * Vec2::new(waves(k / n), waves(k % n));
        let [uu, uv, vv] = self.spread;
        let square = wave.x * wave.x * uu + 2.0 * wave.x * wave.y * uv + wave.y * wave.y * vv;
        // the pixel's own blur, and without what is smooth: the same bell, so many times wider
        let blurred = (-0.5 * PIXEL * square).exp();
        blurred * (1.0 - blurred.powi((BAND * BAND / PIXEL) as i32))
    }
}

/// The places of a square grid that repeats on all sides where no neighbour is higher.
fn peaks(grid: &[f32], side: usize) -> Vec<usize> {
    let value = |x: usize, y: usize| grid[(y % side) * side + x % side];
    let is_peak = |k: &usize| {
        let (x, y) = (k % side + side, k / side + side);
        (0..9).all(|n| value(x + n % 3 - 1, y + n / 3 - 1) <= grid[*k])
    };
    (0..grid.len()).filter(is_peak).collect()
}
