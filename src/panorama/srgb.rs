//! sRGB's curve.

use std::sync::{Arc, LazyLock};

/// Linear value of each 8-bit sRGB code.
pub(crate) static LINEAR: LazyLock<Arc<[f32; 256]>> =
    LazyLock::new(|| Arc::new(std::array::from_fn(|code| srgb_to_linear(code as f32 / 255.0))));

/// From sRGB-encoded 0..=1 to linear (IEC 61966-2-1).
pub fn srgb_to_linear(v: f32) -> f32 {
    if v <= 0.04045 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) }
}

/// From linear 0..=1 to sRGB-encoded (IEC 61966-2-1).
pub fn linear_to_srgb(v: f32) -> f32 {
    if v <= 0.003_130_8 { v * 12.92 } else { 1.055 * v.powf(1.0 / 2.4) - 0.055 }
}

/// The nearest 8-bit sRGB code of a linear value; those beyond 0..=1 have the code of the nearer end.
pub(crate) fn linear_to_code(v: f32) -> u8 {
    (linear_to_srgb(v) * 255.0 + 0.5) as u8
}
