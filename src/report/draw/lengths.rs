//! Lengths and areas as people on site read them: metres, or feet and inches where the site is in one of these.

use crate::site::Frame;

const FOOT_M: f64 = 0.3048;

/// Scales of metric drawings, 1 to ….
const METRIC: [f64; 16] =
    [20.0, 25.0, 50.0, 75.0, 100.0, 125.0, 150.0, 200.0, 250.0, 300.0, 400.0, 500.0, 750.0, 1000.0, 1500.0, 2000.0];
/// Scales of drawings in feet, 1 to …, and what stands for a length of them.
const IMPERIAL: [(f64, &str); 12] = [
    (12.0, "1″ = 1′"),
    (16.0, "¾″ = 1′"),
    (24.0, "½″ = 1′"),
    (32.0, "3/8″ = 1′"),
    (48.0, "¼″ = 1′"),
    (64.0, "3/16″ = 1′"),
    (96.0, "1/8″ = 1′"),
    (128.0, "3/32″ = 1′"),
    (192.0, "1/16″ = 1′"),
    (384.0, "1/32″ = 1′"),
    (600.0, "1″ = 50′"),
    (1200.0, "1″ = 100′"),
];

/// How a sheet writes lengths.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::report) enum Lengths {
    /// Metres and square metres.
    Metric,
    /// Feet, inches and quarters of an inch, and square feet.
    Imperial,
}

impl Lengths {
    /// As the site's unit suggests.
    pub(in crate::report) fn of(frame: &Frame) -> Self {
        let is = |metres: f64| (frame.metres_per_unit / metres - 1.0).abs() < 1e-4;
        // the survey foot is 2 parts in a million longer
        if is(FOOT_M) || is(FOOT_M / 12.0) { Self::Imperial } else { Self::Metric }
    }

    /// A length to be held against a tape: `3.42`, or `11′ 2¾″`.
    pub(in crate::report) fn tape(self, metres: f64) -> String {
        match self {
            Self::Metric => format!("{metres:.2}"),
            Self::Imperial => {
                let quarters = (metres / FOOT_M * 48.0).round().max(0.0) as u64;
                let fraction = ["", "¼", "½", "¾"][(quarters % 4) as usize];
                format!("{}′ {}{fraction}″", quarters / 48, quarters % 48 / 4)
            }
        }
    }

    /// The unit of [`Lengths::tape`] where it does not say itself.
    pub(in crate::report) fn unit(self) -> &'static str {
        match self {
            Self::Metric => ", m",
            Self::Imperial => "",
        }
    }

    /// A distance to walk, whole.
    pub(in crate::report) fn walk(self, metres: f64) -> String {
        match self {
            Self::Metric => format!("{metres:.0} m"),
            Self::Imperial => format!("{:.0} ft", metres / FOOT_M),
        }
    }

    /// An area with so many decimals of a square metre: `12.3 m²`, or `132 sq ft`.
    pub(in crate::report) fn area(self, m2: f64, decimals: usize) -> String {
        match self {
            Self::Metric => format!("{m2:.decimals$} m²"),
            Self::Imperial => {
                let feet = m2 / (FOOT_M * FOOT_M);
                format!("{feet:.0$} sq ft", decimals.saturating_sub(1))
            }
        }
    }

    /// The finest usual scale that is not finer than 1 to `needed`.
    pub(in crate::report) fn scale(self, needed: f64) -> f64 {
        let usual = match self {
            Self::Metric => METRIC.into_iter().find(|s| *s >= needed),
            Self::Imperial => IMPERIAL.into_iter().map(|s| s.0).find(|s| *s >= needed),
        };
        usual.unwrap_or_else(|| (needed / 1000.0).ceil() * 1000.0)
    }

    /// A scale in words: `1 : 100`, or `1/8″ = 1′ (1 : 96)`.
    pub(in crate::report) fn scale_says(self, scale: f64) -> String {
        match IMPERIAL.iter().find(|s| self == Self::Imperial && s.0 == scale) {
            Some((_, says)) => format!("{says} (1 : {scale})"),
            None => format!("1 : {scale}"),
        }
    }

    /// A round length of at most so many metres, for a scale bar, and how it is written.
    pub(in crate::report) fn bar(self, longest_m: f64) -> (f64, String) {
        let (unit_m, unit) = if self == Self::Metric { (1.0, "m") } else { (FOOT_M, "ft") };
        let longest = longest_m / unit_m;
        let ten = 10f64.powf(longest.log10().floor());
        let length = [5.0, 2.0, 1.0].into_iter().map(|k| k * ten).find(|l| *l <= longest).unwrap_or(ten);
        (length * unit_m, format!("{length} {unit}"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::site::Up;

    #[test]
    fn feet_where_the_site_is_in_feet_or_inches() {
        let of = |metres_per_unit| Lengths::of(&Frame { metres_per_unit, up: Up::Z, north_deg: 0.0 });
        assert_eq!([of(1.0), of(0.01), of(0.001)], [Lengths::Metric; 3]);
        assert_eq!([of(0.3048), of(0.0254), of(1200.0 / 3937.0)], [Lengths::Imperial; 3]);
    }

    #[test]
    fn a_tape_in_feet_is_read_to_the_quarter_inch() {
        let feet = Lengths::Imperial;
        // 3.42 m is 11 ft 2.646 in
        assert_eq!(feet.tape(3.42), "11′ 2¾″");
        assert_eq!(feet.tape(0.3048 * 5.0 - 1e-4), "5′ 0″", "inches are carried");
        assert_eq!(feet.tape(0.0), "0′ 0″");
        assert_eq!(Lengths::Metric.tape(3.416), "3.42");
        assert_eq!(feet.area(100.0, 0), "1076 sq ft");
        assert_eq!(Lengths::Metric.area(12.34, 1), "12.3 m²");
    }

    #[test]
    fn scales_and_bars_are_round_in_their_own_unit() {
        assert_eq!([Lengths::Metric.scale(51.0), Lengths::Imperial.scale(40.0)], [75.0, 48.0]);
        assert_eq!(Lengths::Metric.scale(2500.0), 3000.0);
        assert_eq!(Lengths::Imperial.scale_says(48.0), "¼″ = 1′ (1 : 48)");
        assert_eq!(Lengths::Metric.scale_says(50.0), "1 : 50");
        assert_eq!(Lengths::Metric.bar(4.5), (2.0, "2 m".to_owned()));
        let (metres, says) = Lengths::Imperial.bar(4.5);
        assert!((metres - 3.048).abs() < 1e-12 && says == "10 ft");
    }
}
