//! Numbers on the command line.

use std::ops::RangeBounds;
use std::str::FromStr;

/// The smallest range without 0 and infinity.
pub(crate) const ABOVE_ZERO: std::ops::RangeInclusive<f64> = f64::MIN_POSITIVE..=f64::MAX;

/// A parser, for clap, of numbers in a range, which `expected` names.
pub(crate) fn between<T: FromStr + PartialOrd>(
    range: impl RangeBounds<T> + Clone,
    expected: &'static str,
) -> impl Fn(&str) -> Result<T, String> + Clone {
    move |text| text.parse().ok().filter(|v| range.contains(v)).ok_or_else(|| format!("expected {expected}"))
}
