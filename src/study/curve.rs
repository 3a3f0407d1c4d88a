//! Curves of error against time, straight between their points in logarithms of both.

use serde::{Deserialize, Serialize};

/// So many times its last time a curve is followed, and only one of so many points; beyond that there is only a bound.
const FURTHEST: f64 = 8.0;
const LEAST_POINTS: usize = 4;

/// How a figure was found.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum How {
    /// Between two measured points.
    Measured,
    /// Beyond the last point, along the line through the last two.
    Extrapolated,
    /// At the first point: nothing quicker was measured.
    First,
    /// A bound: at the last point that much was not reached yet.
    AtLeast,
}

impl How {
    /// What stands before a figure that is a bound.
    pub fn bound(self) -> &'static str {
        if self == Self::AtLeast { "at least " } else { "" }
    }
}

/// Error by time (both above zero), in order of time.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Curve {
    points: Vec<(f64, f64)>,
}

impl Curve {
    /// A curve through points (time, error); those that have no logarithm are left out.
    pub fn new(points: impl IntoIterator<Item = (f64, f64)>) -> Self {
        let usable = |v: f64| v > 0.0 && v.is_finite();
        let mut points: Vec<_> = points.into_iter().filter(|p| usable(p.0) && usable(p.1)).collect();
        points.sort_by(|a, b| a.0.total_cmp(&b.0));
        Self { points }
    }

    /// The time at which the error first falls to `error`; the last time as a bound where that is not known: fewer than four
    /// points, none of which is enough, or more than eight times the last time. `None` without points.
    pub fn time_at(&self, error: f64) -> Option<(f64, How)> {
        let first = self.points.first().filter(|_| !error.is_nan())?;
        if first.1 <= error {
            return Some((first.0, How::First));
        }
        if let Some(pair) = self.points.windows(2).find(|p| p[1].1 <= error) {
            return between(flipped(pair[0]), flipped(pair[1]), error).map(|t| (t, How::Measured));
        }
        let last = self.points.last()?.0;
        let bound = Some((last, How::AtLeast));
        let [.., a, b] = self.points[..] else { return bound };
        let falls = self.points.len() >= LEAST_POINTS && b.1 < a.1;
        let time = if falls { between(flipped(a), flipped(b), error) } else { None };
        time.filter(|t| *t <= FURTHEST * last).map_or(bound, |t| Some((t, How::Extrapolated)))
    }

    /// The error at a time; before the first point, that point's. `None` without points, or beyond a lone one.
    pub fn error_at(&self, time: f64) -> Option<(f64, How)> {
        let first = self.points.first().filter(|_| !time.is_nan())?;
        if time <= first.0 {
            return Some((first.1, How::First));
        }
        if let Some(pair) = self.points.windows(2).find(|p| time <= p[1].0) {
            return between(pair[0], pair[1], time).map(|e| (e, How::Measured));
        }
        let [.., a, b] = self.points[..] else { return None };
        between(a, b, time).map(|e| (e, How::Extrapolated))
    }
}

fn flipped((a, b): (f64, f64)) -> (f64, f64) {
    (b, a)
}

/// On the line through two points in logarithms; `None` where that is no number.
fn between(a: (f64, f64), b: (f64, f64), x: f64) -> Option<f64> {
    let slope = (b.1.ln() - a.1.ln()) / (b.0.ln() - a.0.ln());
    let y = (b.1.ln() + (x.ln() - b.0.ln()) * slope).exp();
    y.is_finite().then_some(y)
}

/// The least-squares slope of ln y against ln x: the order p of y ∝ xᵖ. `None` for fewer than two different x.
pub fn order(points: &[(f64, f64)]) -> Option<f64> {
    let logs: Vec<(f64, f64)> =
        points.iter().map(|p| (p.0.ln(), p.1.ln())).filter(|p| p.0.is_finite() && p.1.is_finite()).collect();
    let n = logs.len() as f64;
    let (mx, my) = (logs.iter().map(|p| p.0).sum::<f64>() / n, logs.iter().map(|p| p.1).sum::<f64>() / n);
    let xx: f64 = logs.iter().map(|p| (p.0 - mx).powi(2)).sum();
    let xy: f64 = logs.iter().map(|p| (p.0 - mx) * (p.1 - my)).sum();
    (xx > 0.0).then(|| xy / xx)
}

/// Which of the points (time, error) no other beats in both.
pub fn pareto(points: &[(f64, f64)]) -> Vec<bool> {
    let beats = |a: &(f64, f64), b: &(f64, f64)| a.0 <= b.0 && a.1 <= b.1 && (a.0 < b.0 || a.1 < b.1);
    points.iter().map(|p| p.0.is_finite() && p.1.is_finite() && !points.iter().any(|q| beats(q, p))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn close(found: Option<(f64, How)>, value: f64, how: How) {
        let (v, h) = found.unwrap();
        assert!((v / value - 1.0).abs() < 1e-12 && h == how, "{v} {h:?}");
    }

    #[test]
    fn a_power_law_is_followed_and_continued() {
        let curve = Curve::new([1.0, 4.0, 8.0, 16.0].map(|t: f64| (t, t.powf(-0.5))));
        close(curve.time_at(2.0f64.powf(-1.5)), 8.0, How::Measured);
        close(curve.time_at(0.1), 100.0, How::Extrapolated);
        // more than eight times the last time, and from three points: only a bound
        close(curve.time_at(0.01), 16.0, How::AtLeast);
        close(Curve::new([1.0, 4.0, 16.0].map(|t: f64| (t, t.powf(-0.5)))).time_at(0.1), 16.0, How::AtLeast);
        close(curve.time_at(2.0), 1.0, How::First);
        close(curve.error_at(9.0), 1.0 / 3.0, How::Measured);
        close(curve.error_at(100.0), 0.1, How::Extrapolated);
        close(curve.error_at(0.1), 1.0, How::First);
        assert!((order(&[(1.0, 3.0), (2.0, 12.0), (4.0, 48.0)]).unwrap() - 2.0).abs() < 1e-12);
    }

    #[test]
    fn a_curve_that_does_not_fall_promises_nothing() {
        close(Curve::new([(1.0, 0.5), (2.0, 0.5)]).time_at(0.1), 2.0, How::AtLeast);
        close(Curve::new([(1.0, 0.5), (0.0, 3.0), (2.0, f64::NAN)]).time_at(0.1), 1.0, How::AtLeast);
        assert_eq!(Curve::default().time_at(0.1), None);
        assert_eq!(Curve::default().error_at(1.0), None);
        assert_eq!(order(&[(1.0, 2.0)]), None);
    }

    #[test]
    fn the_front_is_what_nothing_beats() {
        let front = pareto(&[(1.0, 5.0), (2.0, 3.0), (3.0, 4.0), (4.0, 1.0), (4.0, 2.0), (f64::NAN, 0.1)]);
        assert_eq!(front, [true, true, false, true, false, false]);
    }
}
