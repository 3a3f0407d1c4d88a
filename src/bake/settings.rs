//! What a bake is asked.

/// How finely to bake.
#[derive(Clone, Copy, Debug)]
pub struct BakeSettings {
    /// At most so many samples of light.
    pub vertices: usize,
    /// Light that differs by less than this share from what lies between two corners is not cut for.
    pub error: f32,
    /// Find the exposures of the site's views, and take their mean for the whole.
    pub views: bool,
    /// Keep direct sun apart, for a viewer that casts its shadows: nothing is cut at their edges then.
    pub sun_apart: bool,
    /// Keep also the triangles as they were with at most so many samples, or uncut where the model alone has more; 0 for none.
    pub coarse: usize,
}

impl Default for BakeSettings {
    fn default() -> Self {
        Self { vertices: 1_000_000, error: 0.08, views: true, sun_apart: false, coarse: 0 }
    }
}
