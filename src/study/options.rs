//! What a study is asked.

/// What to study and for how long.
#[derive(Clone, Debug)]
pub struct Options {
    /// The lighting; `None` for the site's first.
    pub lighting: Option<String>,
    /// The views, by name; empty for all.
    pub views: Vec<String>,
    /// Nothing is begun that would probably end later than so many seconds after the start.
    pub budget_s: f64,
    /// The share of each picture in which error is measured, above 0 and up to 1.
    pub share: f64,
    /// Make a reference even where there are photographs.
    pub reference: bool,
    /// Samples a pixel of the reference.
    pub reference_samples: u32,
    /// The most samples a pixel that path tracing is tried with.
    pub most_samples: u32,
    /// Another seed, other noise.
    pub seed: u64,
    /// Start anew even where a study has been begun.
    pub fresh: bool,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            lighting: None,
            views: vec![],
            budget_s: 300.0,
            share: 1.0,
            reference: false,
            reference_samples: 1024,
            most_samples: 1 << 16,
            seed: 0,
            fresh: false,
        }
    }
}
