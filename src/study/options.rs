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
