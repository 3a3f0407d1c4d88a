//! Student's distribution, which what is off about paint, light and places follows: some of it is far off (Lange,
//! Little and Taylor, “Robust statistical modeling using the t distribution”, 1989).

/// Degrees of freedom.
const FREEDOM: f64 = 3.0;

/// Negative logarithm of the density of so many values at once, given their squared length in variances, but for a constant.
pub(crate) fn unlikeliness(squared: f64, values: f64) -> f64 {
    0.5 * (FREEDOM + values) * (squared / FREEDOM).ln_1p()
}

/// How much one value counts, 0..=1, given its square in variances: the less, the farther off it is.
pub(crate) fn weight(squared: f64) -> f64 {
    1.0 / (1.0 + squared / FREEDOM)
}
