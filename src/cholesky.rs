//! Cholesky's method for symmetric positive definite systems: the normal equations of every least-squares fit here.

/// The lower factor of a matrix.
pub(crate) struct Cholesky {
    /// Unknowns.
    n: usize,
    /// Rows one after the other; what stands above the diagonal means nothing.
    lower: Vec<f64>,
}

/// Of a diagonal element, what must be left after the unknowns before it: less is rounding.
const LEAST: f64 = 1e-13;

impl Cholesky {
    /// Factors a symmetric matrix of `n` rows, one after the other, of which the lower half is read; `None` where it is not
    /// positive definite, to rounding.
    pub(crate) fn new(mut matrix: Vec<f64>, n: usize) -> Option<Self> {
        let a = &mut matrix;
        for i in 0..n {
            for j in 0..=i {
                let rest = (0..j).fold(a[i * n + j], |rest, k| rest - a[i * n + k] * a[j * n + k]);
                if i != j {
                    a[i * n + j] = rest / a[j * n + j];
                } else if rest.is_finite() && rest > LEAST * a[i * n + i].max(0.0) {
                    a[i * n + i] = rest.sqrt();
                } else {
                    return None;
                }
            }
        }
        Some(Self { n, lower: matrix })
    }

    /// Solves for a right side of as many numbers, in its place.
    pub(crate) fn solve(&self, right: &mut [f64]) {
        let (n, l) = (self.n, &self.lower);
        for i in 0..n {
            right[i] = (0..i).fold(right[i], |rest, k| rest - l[i * n + k] * right[k]) / l[i * n + i];
        }
        for i in (0..n).rev() {
            right[i] = (i + 1..n).fold(right[i], |rest, k| rest - l[k * n + i] * right[k]) / l[i * n + i];
        }
    }
}

/// The solution of a small system; `None` where the matrix is not positive definite.
pub(crate) fn solve<const N: usize>(matrix: &[[f64; N]; N], right: &[f64; N]) -> Option<[f64; N]> {
    let mut solution = *right;
    Cholesky::new(matrix.as_flattened().to_vec(), N)?.solve(&mut solution);
    solution.iter().all(|v| v.is_finite()).then_some(solution)
}

/// The inverse of a small matrix; `None` where it is not positive definite.
pub(crate) fn inverse<const N: usize>(matrix: &[[f64; N]; N]) -> Option<[[f64; N]; N]> {
    let factor = Cholesky::new(matrix.as_flattened().to_vec(), N)?;
    let mut inverse = [[0.0; N]; N];
    for (i, row) in inverse.iter_mut().enumerate() {
        row[i] = 1.0;
        factor.solve(row);
    }
    Some(inverse)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn what_is_solved_gives_the_right_side_again(
            factors in proptest::array::uniform6(proptest::array::uniform6(-2.0..2.0)),
            x in proptest::array::uniform6(-3.0..3.0),
        ) {
            let dot = |a: &[f64; 6], b: &[f64; 6]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
            let of = |i: usize, j: usize| dot(&factors[i], &factors[j]) + if i == j { 1.0 } else { 0.0 };
            let matrix: [[f64; 6]; 6] = std::array::from_fn(|i| std::array::from_fn(|j| of(i, j)));
            let right = matrix.map(|row| dot(&row, &x));
            let got = solve(&matrix, &right).unwrap();
            prop_assert!(got.iter().zip(x).all(|(g, x)| (g - x).abs() < 1e-8));
            let inverse = inverse(&matrix).unwrap();
            prop_assert!((0..6).all(|i| (dot(&inverse[i], &right) - x[i]).abs() < 1e-8));
        }
    }

    #[test]
    fn what_is_not_positive_definite_has_no_solution() {
        assert!(solve(&[[0.0; 3]; 3], &[1.0; 3]).is_none());
        assert!(solve(&[[1.0, 2.0], [2.0, 1.0]], &[1.0; 2]).is_none());
        assert!(solve(&[[f64::NAN, 0.0], [0.0, 1.0]], &[1.0; 2]).is_none());
        // of rank one, but for rounding
        assert!(inverse(&[[0.01, 0.1], [0.1, 1.0 + 1e-15]]).is_none());
    }
}
