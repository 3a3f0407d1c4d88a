//! Where a rendered point's light came from.

/// What lit a point.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Source {
    /// Nothing: there is no record at all.
    #[default]
    None,
    /// Irradiance records around the point.
    Record,
    /// The irradiance volume.
    Volume,
}
