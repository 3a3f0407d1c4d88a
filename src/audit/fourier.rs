//! Fourier transforms of square grids that repeat on all sides.

use std::f32::consts::TAU;

/// A complex number: real and imaginary part.
pub(super) type Complex = [f32; 2];

/// Product of one number and the conjugate of another.
pub(super) fn times_conjugate([a, b]: Complex, [c, d]: Complex) -> Complex {
    [a * c + b * d, b * c - a * d]
}

/// Turns of a circle in steps of one over the grid's side.
pub(super) struct Fourier {
    side: usize,
    turns: Vec<Complex>,
}

impl Fourier {
    /// For grids of `side` × `side` values; `side` is a power of two.
    pub(super) fn new(side: usize) -> Self {
        debug_assert!(side.is_power_of_two());
        let turn = |k: usize| {
            let (sin, cos) = (TAU * k as f32 / side as f32).sin_cos();
            [cos, -sin]
        };
        Self { side, turns: (0..side / 2).map(turn).collect() }
    }

    /// Σ v exp(−2πi kx / side) over both axes, in place.
    pub(super) fn forward(&self, grid: &mut [Complex]) {
        self.rows(grid);
        self.transpose(grid);
        self.rows(grid);
        self.transpose(grid);
    }

    /// What `forward` turns into the grid, in place.
    pub(super) fn back(&self, grid: &mut [Complex]) {
        let scale = 1.0 / (self.side * self.side) as f32;
        grid.iter_mut().for_each(|v| v[1] = -v[1]);
        self.forward(grid);
        grid.iter_mut().for_each(|v| *v = [v[0] * scale, -v[1] * scale]);
    }

    /// The transform of real values.
    pub(super) fn of_real(&self, values: impl Iterator<Item = f32>) -> Vec<Complex> {
        let mut grid: Vec<Complex> = values.map(|v| [v, 0.0]).collect();
        self.forward(&mut grid);
        grid
    }

    fn transpose(&self, grid: &mut [Complex]) {
        for y in 0..self.side {
            for x in 0..y {
                grid.swap(y * self.side + x, x * self.side + y);
            }
        }
    }

    /// Each row by decimation in time (Cooley and Tukey, *An algorithm for the machine calculation of complex Fourier
    /// series*, 1965).
    fn rows(&self, grid: &mut [Complex]) {
        let n = self.side;
        let bits = n.trailing_zeros();
        for row in grid.chunks_exact_mut(n) {
            for i in 0..n {
                let j = if bits == 0 { 0 } else { i.reverse_bits() >> (usize::BITS - bits) };
                if i < j {
                    row.swap(i, j);
                }
            }
            let mut half = 1;
            while half < n {
                let step = n / (2 * half);
                for block in row.chunks_exact_mut(2 * half) {
                    let (low, high) = block.split_at_mut(half);
                    for (k, (a, b)) in low.iter_mut().zip(high).enumerate() {
                        let [c, s] = self.turns[k * step];
                        let t = [b[0] * c - b[1] * s, b[0] * s + b[1] * c];
                        *b = [a[0] - t[0], a[1] - t[1]];
                        *a = [a[0] + t[0], a[1] + t[1]];
                    }
                }
                half *= 2;
            }
        }
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
        let moved = |i: usize| pattern[(i / side + dy) % side * side + (i % side + dx) % side];
        let (p, q) = (fourier.of_real((0..side * side).map(moved)), fourier.of_real(pattern.iter().copied()));
        let mut product: Vec<Complex> = q.iter().zip(&p).map(|(q, p)| times_conjugate(*q, *p)).collect();
        fourier.back(&mut product);
        let best = (0..side * side).max_by(|a, b| product[*a][0].total_cmp(&product[*b][0]));
        assert_eq!(best, Some(dy * side + dx));
        let sum: f32 = pattern.iter().map(|v| v * v).sum();
        assert!((product[dy * side + dx][0] / sum - 1.0).abs() < 1e-4);
    }

    #[test]
    fn back_undoes_forward() {
        for side in [1, 2, 32] {
            let fourier = Fourier::new(side);
            let first: Vec<Complex> = (0..side * side).map(|i| [(i % 7) as f32, (i % 11) as f32 - 5.0]).collect();
            let mut grid = first.clone();
            fourier.forward(&mut grid);
            fourier.back(&mut grid);
            let off = |(a, b): (&Complex, &Complex)| (a[0] - b[0]).abs().max((a[1] - b[1]).abs());
            assert!(grid.iter().zip(&first).map(off).fold(0.0, f32::max) < 1e-4);
        }
    }
}
