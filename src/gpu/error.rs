//! Why a graphics card draws nothing.

/// Why a graphics card draws nothing.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum GpuError {
    /// No driver offers a card, not even one in software.
    #[error(
        "no graphics card that can be used: {why}. Install its driver (on Debian, mesa-vulkan-drivers has one that draws in \
         software, too), or render without --gpu"
    )]
    NoAdapter {
        /// What the drivers say.
        why: String,
    },
    /// The card's driver refuses, runs out of memory or stops.
    #[error("{card}: {why}. Update its driver, close what else draws on it, or render without --gpu")]
    Card {
        /// The card's name.
        card: String,
        /// What its driver says.
        why: String,
    },
    /// More than the card can hold in one piece.
    #[error(
        "{card}: {what} take {bytes} bytes, and the card holds at most {limit} in one piece. Bake with fewer vertices"
    )]
    TooLarge {
        /// The card's name.
        card: String,
        /// What is too large.
        what: &'static str,
        /// Its size.
        bytes: u64,
        /// The most that the card takes.
        limit: u64,
    },
    /// A lens that a linear projection cannot be.
    #[error(
        "a graphics card draws pinhole cameras only, and this lens is none (a fisheye, distortion, or leaning columns). \
         Undistort the photograph and give the view fov_y, or render it without --gpu"
    )]
    NotPinhole,
    /// A number of samples that is no square.
    #[error("a graphics card takes samples on a square grid, and {given} is no square. Take {less} or {more}")]
    Samples {
        /// What was asked for.
        given: u32,
        /// The next square below.
        less: u32,
        /// The next square above.
        more: u32,
    },
    /// A lighting that was not baked.
    #[error("lighting number {asked} is asked for, and {baked} are baked. Count from 0")]
    Lighting {
        /// What was asked for.
        asked: usize,
        /// How many there are.
        baked: usize,
    },
    /// Light for another number of vertices.
    #[error(
        "light for {given} vertices, where the model has {expected}. Give one irradiance a vertex, in the bake's order"
    )]
    Vertices {
        /// How many are given.
        given: usize,
        /// How many there are.
        expected: usize,
    },
}
