//! Numbers in 0..1 for a sample of a pixel: two-dimensional Owen-scrambled Sobol points, in another order for every pair
//! of dimensions.
//!
//! Burley, *Practical Hash-based Owen Scrambling*, JCGT 9(4), 2020, with the hash of Vegdahl, *Building a Better LK
//! Hash*, 2021. Each pair of dimensions is a (0,2)-net of its own. Burley shuffles nets by nested scrambling, too; that
//! leaves the leading bits of two pairs correlated (the variance of their product is 1.6 times that of independent
//! numbers), so here blocks of samples are permuted freely instead (Kensler, *Correlated Multi-Jittered Sampling*,
//! Pixar 13-01, 2013). A number depends on nothing but (seed, pixel, sample, dimension), so threads may take samples in
//! any order.

use glam::Vec2;

/// The random numbers of one sample of one pixel.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sampler {
    seed: u32,
    /// Within the block.
    index: u32,
    /// Length of a block less one.
    mask: u32,
}

impl Sampler {
    /// The numbers of sample `index` of the stream (`seed`, `pixel`). Samples `k·block .. (k+1)·block` are stratified
    /// among themselves; `block` is a power of two.
    pub(super) fn new(seed: u64, pixel: u64, index: u32, block: u32) -> Self {
        debug_assert!(block.is_power_of_two());
        let mask = block - 1;
        let group = u64::from(index & !mask) << 32 | u64::from(block);
        let mixed = splitmix64(splitmix64(splitmix64(seed) ^ pixel) ^ group);
        Self { seed: (mixed >> 32) as u32, index: index & mask, mask }
    }

    /// A point in the unit square; `pair` numbers the pair of dimensions.
    pub(super) fn pair(&self, pair: u32) -> Vec2 {
        let seed = hash(self.seed ^ pair.wrapping_mul(0x9e37_79b9));
        let index = permute(self.index, self.mask, seed);
        // The radical inverse in base 2 is the index itself, bits reversed
        let x = scramble_reversed(index, hash(seed ^ 0x68bc_21eb)).reverse_bits();
        let y = scramble_reversed(sobol_1_reversed(index), hash(seed ^ 0x02e5_be93)).reverse_bits();
        Vec2::new(unit(x), unit(y))
    }

    /// One number, not stratified.
    pub(super) fn single(&self, dimension: u32) -> f32 {
        unit(hash(self.seed ^ hash(self.index ^ hash(dimension.wrapping_add(0x51ed_270b)))))
    }
}

/// The entry of a running sum up to 1 that `u` in 0..1 falls into, and where in it, in 0..1.
pub(super) fn pick(cumulative: &[f32], u: f32) -> (usize, f32) {
    let i = cumulative.partition_point(|&c| c <= u).min(cumulative.len() - 1);
    let low = if i == 0 { 0.0 } else { cumulative[i - 1] };
    (i, ((u - low) / (cumulative[i] - low).max(f32::MIN_POSITIVE)).clamp(0.0, 1.0))
}

/// The top 24 bits as a number in 0..1, never 1.
fn unit(bits: u32) -> f32 {
    (bits >> 8) as f32 * (1.0 / 16_777_216.0)
}

/// An Owen scrambling of bits given in reverse order (Vegdahl 2021).
fn scramble_reversed(mut x: u32, seed: u32) -> u32 {
    x ^= x.wrapping_mul(0x3d20_adea);
    x = x.wrapping_add(seed);
    x = x.wrapping_mul((seed >> 16) | 1);
    x ^= x.wrapping_mul(0x0552_6c56);
    x ^= x.wrapping_mul(0x53a2_2864);
    x
}

/// Sobol's second dimension, bits reversed: the index times Pascal's triangle modulo 2, which is a Kronecker power and
/// so takes five steps instead of 32.
fn sobol_1_reversed(index: u32) -> u32 {
    let mut v = index;
    v ^= (v >> 16) & 0x0000_ffff;
    v ^= (v >> 8) & 0x00ff_00ff;
    v ^= (v >> 4) & 0x0f0f_0f0f;
    v ^= (v >> 2) & 0x3333_3333;
    v ^= (v >> 1) & 0x5555_5555;
    v
}

/// A permutation of 0..=`mask`, with `mask` one less than a power of two. Every step can be undone within the mask.
fn permute(mut i: u32, mask: u32, seed: u32) -> u32 {
    let half = (32 - mask.leading_zeros()).div_ceil(2).max(1);
    let mut key = seed;
    for _ in 0..4 {
        i = (i ^ key) & mask;
        i = i.wrapping_mul((key >> 7) | 1) & mask;
        i ^= i >> half;
        key = hash(key);
    }
    (i.wrapping_add(key)) & mask
}

/// A 32-bit integer hash (Wellons's `lowbias32`).
fn hash(mut x: u32) -> u32 {
    x ^= x >> 16;
    x = x.wrapping_mul(0x7feb_352d);
    x ^= x >> 15;
    x = x.wrapping_mul(0x846c_a68b);
    x ^ (x >> 16)
}

/// Steele, Lea and Flood's SplitMix64.
pub(crate) fn splitmix64(x: u64) -> u64 {
    let mut z = x.wrapping_add(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Sobol's second dimension by its direction numbers: v₁ = ½, vᵢ₊₁ = vᵢ ⊕ vᵢ/2.
    fn sobol_1_by_definition(index: u32) -> u32 {
        let mut direction = 1_u32 << 31;
        let mut x = 0;
        for bit in 0..32 {
            if index >> bit & 1 == 1 {
                x ^= direction;
            }
            direction ^= direction >> 1;
        }
        x
    }

    #[test]
    fn second_dimension_follows_its_direction_numbers() {
        for i in (0..5000).chain([u32::MAX, 0x8000_0000, 0xdead_beef]) {
            assert_eq!(sobol_1_reversed(i).reverse_bits(), sobol_1_by_definition(i), "index {i}");
        }
    }

    #[test]
    fn every_aligned_block_is_a_net() {
        // 64 points: each of the elementary intervals of area 1/64 holds exactly one
        for pixel in 0..20 {
            for pair in [0, 1, 17] {
                for start in [0, 64, 640] {
                    let points: Vec<Vec2> =
                        (start..start + 64).map(|i| Sampler::new(3, pixel, i, 64).pair(pair)).collect();
                    for shape in 0..=6 {
                        let (nx, ny) = (1 << shape, 64 >> shape);
                        let mut seen = [0; 64];
                        for p in &points {
                            seen[(p.y * ny as f32) as usize * nx + (p.x * nx as f32) as usize] += 1;
                        }
                        assert!(seen.iter().all(|&n| n == 1), "pixel {pixel} pair {pair} shape {nx}×{ny}");
                    }
                }
            }
        }
    }

    #[test]
    fn pairs_are_uncorrelated_and_uniform() {
        let n = 4096;
        let mut mean = [0.0_f64; 4];
        let mut product = 0.0_f64;
        for i in 0..n {
            // across pixels, so that stratification does not help
            let s = Sampler::new(1, i, 5, 16);
            let (a, b) = (s.pair(0), s.pair(1));
            for (m, v) in mean.iter_mut().zip([a.x, a.y, b.x, b.y]) {
                *m += f64::from(v) / n as f64;
            }
            product += f64::from((a.x - 0.5) * (b.x - 0.5)) / n as f64;
        }
        assert!(mean.iter().all(|m| (m - 0.5).abs() < 0.02), "{mean:?}");
        assert!(product.abs() < 0.006, "{product}");
        assert!(((0..n).map(|i| Sampler::new(1, i, 0, 1).single(9)).sum::<f32>() / n as f32 - 0.5).abs() < 0.02);
    }

    /// Nested shuffling fails this: 1.57.
    #[test]
    fn pairs_are_as_good_as_independent_within_a_pixel() {
        let (n, pixels) = (32, 4000);
        for (p, q) in [(0, 1), (3, 6), (4, 7)] {
            let mut variance = 0.0_f64;
            for pixel in 0..pixels {
                let product = |i| {
                    let s = Sampler::new(0, pixel, i, n);
                    f64::from((s.pair(p).x - 0.5) * (s.pair(q).x - 0.5))
                };
                variance += ((0..n).map(product).sum::<f64>() / f64::from(n)).powi(2) / pixels as f64;
            }
            let independent = 1.0 / 144.0 / f64::from(n);
            assert!((0.85..1.15).contains(&(variance / independent)), "pairs {p}, {q}: {}", variance / independent);
        }
    }

    #[test]
    fn permutations_hit_every_place_once() {
        for bits in 0..10 {
            let mask = (1 << bits) - 1;
            for seed in 0..50 {
                let mut seen = vec![false; 1 << bits];
                (0..=mask).for_each(|i| seen[permute(i, mask, hash(seed)) as usize] = true);
                assert!(seen.iter().all(|&s| s), "{bits} bits, seed {seed}");
            }
        }
    }
}
