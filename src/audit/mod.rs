//! Where the model is wrong, from photographs.
//!
//! Light divided by albedo and multiplied by it again would make a wrong texture cancel out, so there are two tests that
//! share nothing but the model's shape: `geometry` compares the photograph with what each probe saw of the same
//! surface, without albedo; `texture` compares it with albedo under irradiance gathered from all around. What is mapped in
//! one piece is then tried as a whole, laid otherwise: `relaid`.

mod alarm;
mod align;
mod assess;
mod behind;
mod bins;
mod coding;
mod colour;
mod decision;
mod error;
mod explain;
mod files;
mod findings;
mod fourier;
mod geometry;
mod gloss;

mod judge;
mod laid;
mod mapping;
mod merge;
mod noise;
mod outline;
mod parts;
mod photo;
mod probe_view;
mod radiometry;
mod regions;
mod relaid;
mod rim;
mod run;
mod scores;
mod shifts;
mod soften;
mod structure;
mod surfaces;
mod sweep;
mod texture;
mod verdict;
mod view;
mod witness;

pub use error::AuditError;
pub use findings::{
    Audit, AuditedView, Displacement, Evidence, Finding, Kind, Method, PoseCorrection, ProbeGain, Shares, Shift,
    ViewSummary, What,
};
pub use judge::Judged;
pub use photo::Photo;
pub use run::{Progress, audit};
pub use verdict::{Reason, Verdict};
pub use view::{Maps, Prepared, Settings, examine};

use glam::Vec3;

use crate::edge_aware::EdgeAware;
use crate::panorama::luminance;

/// Logarithm of a brightness; black counts as 10⁻⁴.
fn log_luminance(rgb: Vec3) -> f32 {
    luminance(rgb).max(1e-4).ln()
}

/// Pearson's correlation of pairs, and how many there are; 0 where either side varies by less than `least`.
fn correlation(pairs: impl Iterator<Item = (f32, f32)>, least: f64) -> (f32, f64) {
    let [mut n, mut a, mut b, mut aa, mut bb, mut ab] = [0.0f64; 6];
    for (p, q) in pairs {
        let (p, q) = (f64::from(p), f64::from(q));
        n += 1.0;
        a += p;
        b += q;
        aa += p * p;
        bb += q * q;
        ab += p * q;
    }
    let m = n.max(1.0);
    let (va, vb) = (aa / m - (a / m).powi(2), bb / m - (b / m).powi(2));
    let c = if va < least || vb < least { 0.0 } else { (ab / m - a * b / m / m) / (va * vb).sqrt() };
    (c as f32, n)
}
