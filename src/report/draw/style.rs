//! Colours, hatches and lines of the house.
//!
//! The colours are Okabe and Ito's (*Color Universal Design*, 2008), told apart by colour-blind people; whatever they
//! say is said by a hatch too, so that a sheet may be printed in black and white.

/// Black, for lines and letters.
pub const BLACK: &str = "#000000";
/// White, for paper.
pub const WHITE: &str = "#ffffff";
/// Grey, for what is only there to help.
pub const GREY: &str = "#777777";
/// Light grey, for grids.
pub const LIGHT: &str = "#cccccc";
/// Okabe–Ito orange.
pub const ORANGE: &str = "#e69f00";
/// Okabe–Ito sky blue.
pub const SKY: &str = "#56b4e9";
/// Okabe–Ito bluish green.
pub const GREEN: &str = "#009e73";
/// Okabe–Ito yellow.
pub const YELLOW: &str = "#f0e442";
/// Okabe–Ito blue.
pub const BLUE: &str = "#0072b2";
/// Okabe–Ito vermilion.
pub const VERMILION: &str = "#d55e00";
/// Okabe–Ito reddish purple.
pub const PURPLE: &str = "#cc79a7";

/// Height of the letters of fine print, millimetres: seven points.
pub const FINE_PRINT: f64 = 2.5;

/// What a hatch is made of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pattern {
    /// Lines at an angle, degrees clockwise from horizontal.
    Lines(i32),
    /// Two families of lines, at an angle and across it.
    Cross(i32),
    /// Dots on a square grid.
    Dots,
}

/// A pattern that fills an area.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hatch {
    /// What it is made of.
    pub pattern: Pattern,
    /// `#rrggbb`.
    pub colour: &'static str,
    /// Millimetres between its lines or dots.
    pub spacing: f64,
    /// Width of its lines, or diameter of its dots, in millimetres.
    pub weight: f64,
}

impl Hatch {
    /// A hatch of usual fineness.
    pub const fn new(pattern: Pattern, colour: &'static str) -> Self {
        Self { pattern, colour, spacing: 1.8, weight: 0.3 }
    }

    pub(in crate::report) fn id(&self) -> String {
        let pattern = match self.pattern {
            Pattern::Lines(angle) => format!("lines{angle}"),
            Pattern::Cross(angle) => format!("cross{angle}"),
            Pattern::Dots => "dots".into(),
        };
        let colour = self.colour.trim_start_matches('#');
        format!("hatch-{pattern}-{colour}-{}-{}", number(self.spacing), number(self.weight)).replace('.', "_")
    }

    pub(in crate::report) fn definition(&self, id: &str) -> String {
        let (size, half) = (number(self.spacing), number(self.spacing / 2.0));
        let (weight, colour) = (number(self.weight), self.colour);
        let across = format!(r#"<path d="M0 {half}H{size}" stroke="{colour}" stroke-width="{weight}"/>"#);
        let along = format!(r#"<path d="M{half} 0V{size}" stroke="{colour}" stroke-width="{weight}"/>"#);
        let (angle, drawing) = match self.pattern {
            Pattern::Lines(angle) => (angle, across),
            Pattern::Cross(angle) => (angle, across + &along),
            Pattern::Dots => {
                let radius = number(self.weight);
                (45, format!(r#"<circle cx="{half}" cy="{half}" r="{radius}" fill="{colour}"/>"#))
            }
        };
        format!(
            "<pattern id=\"{id}\" width=\"{size}\" height=\"{size}\" patternUnits=\"userSpaceOnUse\" patternTransform=\"rotate({angle})\">{drawing}</pattern>\n"
        )
    }
}

/// What is inside an outline.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Fill {
    /// Nothing.
    None,
    /// One colour, `#rrggbb`.
    Plain(&'static str),
    /// A hatch.
    Hatch(Hatch),
}

/// How a shape is drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Style {
    /// The outline's colour, `#rrggbb`.
    pub stroke: &'static str,
    /// The outline's width in millimetres; 0 for none.
    pub stroke_width: f64,
    /// Millimetres on and off along the outline.
    pub dash: Option<[f64; 2]>,
    /// What is inside.
    pub fill: Fill,
    /// 0 to 1.
    pub fill_opacity: f64,
}

impl Style {
    /// A line of this colour and width in millimetres.
    pub const fn line(stroke: &'static str, stroke_width: f64) -> Self {
        Self { stroke, stroke_width, dash: None, fill: Fill::None, fill_opacity: 1.0 }
    }

    /// An area of this colour, without an outline.
    pub const fn fill(colour: &'static str) -> Self {
        Self { fill: Fill::Plain(colour), ..Self::line(BLACK, 0.0) }
    }

    /// A hatched area, without an outline.
    pub const fn hatch(hatch: Hatch) -> Self {
        Self { fill: Fill::Hatch(hatch), ..Self::line(BLACK, 0.0) }
    }

    /// The same with an outline.
    pub const fn outlined(self, stroke: &'static str, stroke_width: f64) -> Self {
        Self { stroke, stroke_width, ..self }
    }

    /// The same with a broken outline: millimetres on and off.
    pub const fn dashed(self, on: f64, off: f64) -> Self {
        Self { dash: Some([on, off]), ..self }
    }

    /// The same, with what is inside let through.
    pub const fn opacity(self, fill_opacity: f64) -> Self {
        Self { fill_opacity, ..self }
    }
}

/// A number with at most three decimals; what is not finite becomes 0, since an SVG must not hold it.
pub(in crate::report) fn number(x: f64) -> String {
    let x = if x.is_finite() { x } else { 0.0 };
    let text = format!("{x:.3}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0".into() } else { text.into() }
}
