//! Fourier transforms of square grids that repeat on all sides: rustfft's, over both axes.

use rustfft::algorithm::Radix4;
pub(crate) use rustfft::num_complex::Complex32 as Complex;
use rustfft::{Fft, FftDirection};

/// Transforms of grids of one size, a power of two. Between `forward` and `back` x and y are exchanged.
pub(crate) struct Fourier {
    side: usize,
    forward: Radix4<f32>,
    back: Radix4<f32>,
}

impl Fourier {
    /// For grids of `side` × `side` values.
    pub(crate) fn new(side: usize) -> Self {
        let radix4 = |direction| Radix4::new(side, direction);
        Self { side, forward: radix4(FftDirection::Forward), back: radix4(FftDirection::Inverse) }
    }

    /// Σ v exp(−2πi kx / side) over both axes, of real values.
    pub(crate) fn forward(&self, values: impl Iterator<Item = f32>) -> Vec<Complex> {
        let mut grid: Vec<Complex> = values.map(|v| Complex::new(v, 0.0)).collect();
        self.both_axes(&self.forward, &mut grid);
        grid
    }

    /// The same of two grids at once.
    pub(crate) fn forward_two(&self, one: &[f32], other: &[f32]) -> [Vec<Complex>; 2] {
        let n = self.side;
        let mut grid: Vec<Complex> = one.iter().zip(other).map(|(a, b)| Complex::new(*a, *b)).collect();
        self.both_axes(&self.forward, &mut grid);
        // real values turn into what is its own conjugate on the other side of zero, imaginary ones into minus that
        let across = |k: usize| grid[(n - k / n) % n * n + (n - k % n) % n].conj();
        let one = grid.iter().enumerate().map(|(k, v)| (v + across(k)) * 0.5).collect();
        let other = grid.iter().enumerate().map(|(k, v)| (v - across(k)) * Complex::new(0.0, -0.5)).collect();
        [one, other]
    }

    /// What `forward` turns into the grid, in place.
    pub(crate) fn back(&self, grid: &mut [Complex]) {
        self.both_axes(&self.back, grid);
        let scale = 1.0 / (self.side * self.side) as f32;
        grid.iter_mut().for_each(|v| *v *= scale);
    }

    /// Transforms columns and rows, and leaves them exchanged.
    fn both_axes(&self, rows: &Radix4<f32>, grid: &mut [Complex]) {
        let mut scratch = vec![Complex::default(); rows.get_inplace_scratch_len()];
        rows.process_with_scratch(grid, &mut scratch);
        for y in 0..self.side {
            for x in 0..y {
                grid.swap(y * self.side + x, x * self.side + y);
            }
        }
        rows.process_with_scratch(grid, &mut scratch);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_correlation_peaks_where_the_pattern_was_put() {
        let side = 16;
        let fourier = Fourier::new(side);
        let pattern: Vec<f32> = (0..side * side).map(|i| ((i * i * 7919 + i) % 101) as f32).collect();
        let (dx, dy) = (5, 11);
        let moved: Vec<f32> =
            (0..side * side).map(|i| pattern[(i / side + dy) % side * side + (i % side + dx) % side]).collect();
        let [p, q] = fourier.forward_two(&moved, &pattern);
        assert!(p.iter().zip(fourier.forward(moved.into_iter())).all(|(a, b)| (a - b).norm() < 1e-2));
        let mut product: Vec<Complex> = q.iter().zip(&p).map(|(q, p)| q * p.conj()).collect();
        fourier.back(&mut product);
        let best = (0..side * side).max_by(|a, b| product[*a].re.total_cmp(&product[*b].re));
        assert_eq!(best, Some(dy * side + dx));
        let sum: f32 = pattern.iter().map(|v| v * v).sum();
        assert!((product[dy * side + dx].re / sum - 1.0).abs() < 1e-4);
    }

    #[test]
    fn back_undoes_forward() {
        for side in [1, 2, 32] {
            let fourier = Fourier::new(side);
            let first: Vec<f32> = (0..side * side).map(|i| (i % 7) as f32 + (i % 11) as f32).collect();
            let mut grid = fourier.forward(first.iter().copied());
            fourier.back(&mut grid);
            assert!(grid.iter().zip(&first).all(|(a, b)| (a - Complex::new(*b, 0.0)).norm() < 1e-4));
        }
    }
}
