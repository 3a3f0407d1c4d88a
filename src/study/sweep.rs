//! Which settings a study tries.

use serde::{Deserialize, Serialize};

/// A way to make pictures.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub enum Method {
    /// Image-based shooting, this program's.
    #[serde(rename = "ibs")]
    Ibs,
    /// Image-based shooting as published.
    #[serde(rename = "paper")]
    Paper,
    /// The reference path tracer.
    #[serde(rename = "path tracing")]
    PathTracing,
}

impl Method {
    /// As files name it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Ibs => "ibs",
            Self::Paper => "paper",
            Self::PathTracing => "path tracing",
        }
    }
}

/// What a setting changes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Parameter {
    /// Nothing: the method as it comes.
    AsItComes,
    /// Width of the panoramas in pixels.
    Width,
    /// How many probes, the first of [the plan's order](super::plan_order).
    Probes,
    /// Cells of the volume along the model's longest side.
    Cells,
    /// Rays from each place of the volume.
    Rays,
    /// Samples a pixel.
    Samples,
    /// Radius of the paper's records, as a multiple of its own choice.
    Radius,
}

impl Parameter {
    /// As tables name it.
    pub fn name(self) -> &'static str {
        match self {
            Self::AsItComes => "default settings",
            Self::Width => "panorama width",
            Self::Probes => "probes",
            Self::Cells => "volume cells",
            Self::Rays => "volume rays",
            Self::Samples => "samples a pixel",
            Self::Radius => "record radius",
        }
    }
}

/// One thing to try: a method with one parameter changed.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Setting {
    /// The method.
    pub method: Method,
    /// What is changed.
    pub parameter: Parameter,
    /// To what; 0 where nothing is changed.
    pub value: f64,
}

impl Setting {
    /// A method as it comes.
    pub fn plain(method: Method) -> Self {
        Self { method, parameter: Parameter::AsItComes, value: 0.0 }
    }

    /// As tables name it.
    pub fn label(&self) -> String {
        let v = self.value;
        let count = |one: &str, many: &str| format!("{v} {}", if v == 1.0 { one } else { many });
        match self.parameter {
            Parameter::AsItComes => "default settings".to_owned(),
            Parameter::Width => format!("panoramas {v} wide"),
            Parameter::Probes => count("probe", "probes"),
            Parameter::Cells => format!("{v} volume cells"),
            Parameter::Rays => format!("{v} volume rays"),
            Parameter::Samples => count("sample a pixel", "samples a pixel"),
            Parameter::Radius => format!("radius × {v}"),
        }
    }
}

/// What the settings as they come are for a site.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Base {
    /// Greatest width of a panorama that can be narrowed, 0 where none can.
    pub width: u32,
    /// Number of probes.
    pub probes: u32,
    /// Cells of the volume along the model's longest side.
    pub cells: u32,
    /// Rays from each place of the volume.
    pub rays: u32,
    /// Samples a pixel.
    pub samples: u32,
}

impl Base {
    /// The value that the settings as they come give a parameter.
    pub fn value(&self, parameter: Parameter) -> f64 {
        match parameter {
            Parameter::Width => f64::from(self.width),
            Parameter::Probes => f64::from(self.probes),
            Parameter::Cells => f64::from(self.cells),
            Parameter::Rays => f64::from(self.rays),
            Parameter::Samples => f64::from(self.samples),
            Parameter::Radius | Parameter::AsItComes => 1.0,
        }
    }

    /// The settings of image-based shooting beside those that come, one parameter at a time. Without a volume its
    /// parameters are left alone.
    pub fn sweep(&self, volume: bool) -> Vec<Setting> {
        let all = |parameter, values: Vec<u32>| {
            values.into_iter().map(move |v| Setting { method: Method::Ibs, parameter, value: f64::from(v) })
        };
        let widths = (1..4).map(|halvings| self.width >> halvings).filter(|w| *w >= 32).collect();
        let probes = (0..).map(|k| if self.probes <= 6 { k + 1 } else { 1 << k }).take_while(|n| *n < self.probes);
        let (cells, rays) = if volume {
            (vec![self.cells / 4, self.cells / 2, self.cells * 2], vec![self.rays / 4, self.rays * 4])
        } else {
            (vec![], vec![])
        };
        all(Parameter::Width, widths)
            .chain(all(Parameter::Probes, probes.collect()))
            .chain(all(Parameter::Cells, cells))
            .chain(all(Parameter::Rays, rays))
            .chain(all(Parameter::Samples, vec![1, 16]))
            .collect()
    }
}

/// The paper's settings beside those that come.
pub(super) fn paper_sweep(base: &Base) -> Vec<Setting> {
    let of = |parameter, value| Setting { method: Method::Paper, parameter, value };
    vec![
        of(Parameter::Radius, 0.5),
        of(Parameter::Radius, 2.0),
        of(Parameter::Cells, f64::from(base.cells / 2)),
        of(Parameter::Cells, f64::from(base.cells * 2)),
    ]
}

/// Path tracing at 1, 4, 16, 64, … samples a pixel, as long as `most` allows.
pub(super) fn ladder(most: u32) -> impl Iterator<Item = Setting> {
    let counts = (0..16).map(|k| 1u32 << (2 * k)).take_while(move |n| *n <= most);
    counts.map(|n| Setting { method: Method::PathTracing, parameter: Parameter::Samples, value: f64::from(n) })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sweep_changes_one_thing_and_stays_sane() {
        let base = Base { width: 256, probes: 3, cells: 64, rays: 192, samples: 4 };
        let labels: Vec<String> = base.sweep(true).iter().map(Setting::label).collect();
        assert_eq!(
            labels,
            [
                "panoramas 128 wide",
                "panoramas 64 wide",
                "panoramas 32 wide",
                "1 probe",
                "2 probes",
                "16 volume cells",
                "32 volume cells",
                "128 volume cells",
                "48 volume rays",
                "768 volume rays",
                "1 sample a pixel",
                "16 samples a pixel"
            ]
        );
        let small = Base { width: 0, probes: 1, ..base };
        assert!(small.sweep(false).iter().all(|s| s.parameter == Parameter::Samples));
        assert_eq!(ladder(70).map(|s| s.value).collect::<Vec<_>>(), [1.0, 4.0, 16.0, 64.0]);
    }
}
