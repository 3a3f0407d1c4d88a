//! What the audit says of a single pixel, and why it says no more.

use serde::Serialize;

/// What the audit says of a pixel. [`Verdict::Untestable`] is never shown or counted as [`Verdict::Ok`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
#[repr(u8)]
pub enum Verdict {
    /// Photograph and model were compared and agree.
    Ok = 0,
    /// The surface is where the model has it, but looks otherwise.
    Texture = 1,
    /// The surface is not where the model has it.
    Geometry = 2,
    /// Something disagrees, and what it is cannot be told; see [`Reason`].
    Ambiguous = 3,
    /// Nothing could be compared, or what was compared tells neither way; see [`Reason`].
    #[default]
    Untestable = 4,
}

impl Verdict {
    /// All verdicts, in the order of their codes.
    pub const ALL: [Self; 5] = [Self::Ok, Self::Texture, Self::Geometry, Self::Ambiguous, Self::Untestable];

    /// The name in the machine-readable outputs.
    pub fn name(self) -> &'static str {
        match self {
            Self::Ok => "ok",
            Self::Texture => "texture",
            Self::Geometry => "geometry",
            Self::Ambiguous => "ambiguous",
            Self::Untestable => "untestable",
        }
    }
}

/// Why a pixel is ambiguous or untestable.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
#[repr(u8)]
pub enum Reason {
    /// There is no reason to give: the pixel was tested and told.
    #[default]
    None = 0,
    /// The photograph is clipped or has no valid value there.
    Clipped = 1,
    /// The photograph is too dark there for its noise.
    Dark = 2,
    /// The view's mask leaves the pixel out.
    Masked = 3,
    /// The model has no surface there.
    NoSurface = 4,
    /// No probe sees the surface.
    Unseen = 5,
    /// Camera and probe stand so that a moved surface would look the same.
    NoParallax = 6,
    /// Too little to see on the surface for its place or picture to be compared.
    NoTexture = 7,
    /// The model's albedo is too dark to compare anything with.
    BlackAlbedo = 8,
    /// The surface is seen too flatly, or lies too near an edge of the model.
    Grazing = 9,
    /// As much is off elsewhere in the pictures, where nothing is wrong.
    Usual = 10,
}

impl Reason {
    /// The name in the machine-readable outputs.
    pub fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Clipped => "clipped",
            Self::Dark => "dark",
            Self::Masked => "masked",
            Self::NoSurface => "no_surface",
            Self::Unseen => "unseen",
            Self::NoParallax => "no_parallax",
            Self::NoTexture => "no_texture",
            Self::BlackAlbedo => "black_albedo",
            Self::Grazing => "grazing",
            Self::Usual => "usual",
        }
    }

    /// The reason as words that follow “because”.
    pub fn words(self) -> &'static str {
        match self {
            Self::None => "",
            Self::Clipped => "the photograph is over-exposed there",
            Self::Dark => "the photograph is too dark there",
            Self::Masked => "the view's mask leaves it out",
            Self::NoSurface => "the model has no surface there",
            Self::Unseen => "no probe sees it",
            Self::NoParallax => "every probe that sees it looks from the camera's side",
            Self::NoTexture => "there is too little to see on it",
            Self::BlackAlbedo => "the model is black there",
            Self::Grazing => "it is seen too flatly or lies on an edge",
            Self::Usual => "as much is off elsewhere in these pictures",
        }
    }
}
