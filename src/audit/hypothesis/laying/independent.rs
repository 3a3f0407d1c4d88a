//! How many pixels of two pictures' structure count as independent of each other.

use crate::audit::likelihood::structure::ALIKE_PX;
use crate::audit::picture::fourier::{Complex, Fourier};
use crate::audit::picture::regions::bounds;

/// How many of some pixels count as independent of each other, given what two pictures show there and how much each counts, the inverse of
/// a variance: what is alike in itself over many pixels in both, such as grain of wood or an edge all along a surface, is like the other by chance.
/// A correlation of two fields varies as one of so many independent samples does (Clifford, Richardson and Hémon, *Assessing the
/// significance of the correlation between two spatial processes*, 1989). Never more than where nothing is known: light's own structure,
/// such as a shadow's edge, is coarser than grain.
pub(super) fn independent(width: usize, pixels: &[usize], [one, other]: [&[f32]; 2], weight: &[f32]) -> f32 {
    if pixels.is_empty() {
        return 0.0;
    }
    let [left, top, right, bottom] = bounds(pixels, width);
    let side = (right - left).max(bottom - top).next_power_of_two();
    let mut grids = [(); 3].map(|()| vec![0.0f32; side * side]);
    for (((i, a), b), w) in pixels.iter().zip(one).zip(other).zip(weight) {
        let k = (i / width - top) * side + i % width - left;
        // in units of its own standard deviation
        (grids[0][k], grids[1][k], grids[2][k]) = (a * w.sqrt(), b * w.sqrt(), 1.0);
    }
    // at all lags, sums of each picture's products and numbers of pairs; the grid repeats, so that pixels at either end of it are
    // compared, too
    let fourier = Fourier::new(side);
    let squares = |all: &[Complex]| all.iter().map(Complex::norm_sqr).collect::<Vec<f32>>();
    let [a, b] = fourier.forward_two(&grids[0], &grids[1]).map(|all| squares(&all));
    let pairs = squares(&fourier.forward(grids[2].iter().copied()));
    let both = |re: &[f32], im: &[f32]| {
        let mut grid: Vec<Complex> = re.iter().zip(im).map(|(re, im)| Complex::new(*re, *im)).collect();
        fourier.back(&mut grid);
        grid
    };
    let (products, pairs) = (both(&a, &b), both(&pairs, &pairs));
    let of_lag = |(p, n): (&Complex, &Complex)| f64::from(p.re) * f64::from(p.im) / f64::from(n.re);
    // products of both correlations, each as often as there are pairs, over those of a pixel with itself
    let told = products.iter().zip(&pairs).filter(|(_, n)| n.re > 0.5).map(of_lag);
    let own = f64::from(products[0].re) * f64::from(products[0].im) / pixels.len() as f64;
    let alike = told.sum::<f64>() / own.max(1e-30);
    (pixels.len() as f64 / alike.max(f64::from(ALIKE_PX))) as f32
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reference::random::splitmix64;

    const SIDE: usize = 64;

    /// Uniform in −1..1, another for each number.
    fn noise(k: usize) -> f32 {
        (splitmix64(k as u64) >> 40) as f32 / (1 << 23) as f32 - 1.0
    }

    fn of(structure: &dyn Fn(usize, usize) -> f32) -> f32 {
        let pixels: Vec<usize> = (0..SIDE * SIDE).collect();
        let values: Vec<f32> = pixels.iter().map(|i| structure(i % SIDE, i / SIDE)).collect();
        independent(SIDE, &pixels, [&values, &values], &[1.0; SIDE * SIDE])
    }

    #[test]
    fn what_is_alike_all_along_counts_once() {
        let most = (SIDE * SIDE) as f32 / ALIKE_PX;
        let grain = |x: usize, y: usize| noise(y * SIDE + x);
        let all = of(&grain);
        assert!(all > 0.99 * most, "{all} of {most}");
        let blotches = of(&|x, y| noise(y / 8 * SIDE + x / 8));
        assert!((30.0..130.0).contains(&blotches), "{blotches} of 64 blotches");
        let columns = of(&|x, _| noise(x));
        assert!((20.0..130.0).contains(&columns), "{columns} of 64 columns");
        // an edge across what is not alike
        let edge = of(&|x, y| grain(x, y) + if (30..34).contains(&x) { 3.0 } else { 0.0 });
        assert!(edge < 0.2 * most, "{edge}");
        assert_eq!(independent(SIDE, &[], [&[], &[]], &[]), 0.0);
    }
}
