//! What the audit says of a single pixel, and why it says no more.

use serde::Serialize;

use super::Kind;
use super::judge::Judged;
use super::surfaces::NONE;
use super::texture::BLACK;
use super::view::Maps;
use crate::panorama::luminance;

/// A moved surface must raise the cost by this much for its place to count as tested.
pub(super) const SENSITIVITY: f32 = 120.0;

/// Odds below which a pixel's structure bears the model out.
const BORNE_OUT: f32 = -1.0;

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
    /// Nothing could be compared; see [`Reason`].
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

/// A verdict for each pixel, and why it is no better.
pub(super) fn verdicts(maps: &Maps, judged: &[Judged]) -> (Vec<Verdict>, Vec<Reason>) {
    let (s, t, g) = (&maps.surfaces, &maps.texture, &maps.geometry);
    let n = t.tested.len();
    let mut verdicts = vec![Verdict::Untestable; n];
    let mut reasons = vec![Reason::None; n];
    for i in 0..n {
        let reason = if maps.photo.unusable[i] != Reason::None {
            maps.photo.unusable[i]
        } else if s.triangle[i] == NONE {
            Reason::NoSurface
        } else if g.seen[i] == 0 {
            if s.normal[i].dot(s.ray[i]).abs() < 0.12 { Reason::Grazing } else { Reason::Unseen }
        } else if g.able[i] == 0 {
            Reason::NoParallax
        } else if luminance(maps.albedo[i]) <= BLACK {
            Reason::BlackAlbedo
        } else if !t.tested[i] {
            Reason::Grazing
        } else if g.sensitivity[i] < SENSITIVITY || (t.structured[i] && t.odds[i] > BORNE_OUT) {
            Reason::NoTexture
        } else {
            Reason::None
        };
        reasons[i] = reason;
        if reason == Reason::None {
            verdicts[i] = Verdict::Ok;
        }
    }
    for j in judged {
        for &i in &j.region.pixels {
            (verdicts[i], reasons[i]) = match (j.reason, j.kind) {
                (Reason::None, Kind::Texture) => (Verdict::Texture, Reason::None),
                (Reason::None, Kind::Geometry) => (Verdict::Geometry, Reason::None),
                (reason, _) => (Verdict::Ambiguous, reason),
            };
        }
    }
    (verdicts, reasons)
}
