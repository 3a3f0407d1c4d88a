//! Order statistics and means.

/// The value that `share` (0..=1) of all stay below, and one of them; `None` of nothing. Orders the values partly.
pub(crate) fn quantile<T: Copy + Into<f64>>(values: &mut [T], share: f64) -> Option<T> {
    let at = ((values.len() as f64 * share) as usize).min(values.len().checked_sub(1)?);
    let order = |a: &T, b: &T| Into::<f64>::into(*a).total_cmp(&Into::<f64>::into(*b));
    Some(*values.select_nth_unstable_by(at, order).1)
}

/// The middle value, the upper one of two; `None` of nothing.
pub(crate) fn median<T: Copy + Into<f64>>(values: impl IntoIterator<Item = T>) -> Option<T> {
    quantile(&mut values.into_iter().collect::<Vec<T>>(), 0.5)
}

/// A standard deviation about zero that half of the values may contradict: 1.48 × the median of their sizes, as of a bell curve (Hampel,
/// *The influence curve and its role in robust estimation*, 1974); `None` of nothing.
pub(crate) fn robust_deviation<T: Into<f64>>(values: impl IntoIterator<Item = T>) -> Option<f64> {
    median(values.into_iter().map(|v| v.into().abs())).map(|size| 1.48 * size)
}

/// The mean; `None` of nothing.
pub(crate) fn mean(values: impl Iterator<Item = f64>) -> Option<f64> {
    let (sum, n) = values.fold((0.0, 0usize), |(sum, n), v| (sum + v, n + 1));
    (n > 0).then(|| sum / n as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_stand_where_so_many_are_below() {
        let values = [5.0, -1.0, 3.0, 9.0, 7.0f32];
        assert_eq!(
            [0.0, 0.2, 0.5, 0.99, 1.0].map(|q| quantile(&mut values.to_vec(), q).unwrap()),
            [-1.0, 3.0, 5.0, 9.0, 9.0]
        );
        assert_eq!(median([4.0, 1.0, 3.0, 2.0f64]), Some(3.0));
        assert_eq!(median(Vec::<f64>::new()), None);
        assert_eq!(robust_deviation([4.0, -1.0, 2.0f32]), Some(2.96));
    }
}
