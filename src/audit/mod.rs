//! Where the model is wrong, from photographs.
//!
//! Light divided by albedo and multiplied by it again would make a wrong texture cancel out, so there are two tests that
//! share nothing but the model's shape: `geometry` compares the photograph with what each probe saw of the same
//! surface, without albedo; `texture` compares it with albedo under irradiance gathered from all around.

mod align;
mod behind;
mod bins;
mod colour;
mod decision;
mod error;
mod explain;
mod extent;
mod figures;
mod files;
mod findings;
mod geometry;
mod joins;
mod judge;
mod mapping;
mod outline;
mod parts;
mod photo;
mod probe_view;
mod radiometry;
mod regions;
mod rim;
mod run;
mod scores;
mod soften;
mod surfaces;
mod sweep;
mod texture;
mod verdict;
mod view;

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

use joins::Joins;

/// The middle value; 0 of nothing.
fn median(values: &mut [f32]) -> f32 {
    let middle = values.len() / 2;
    if values.is_empty() { 0.0 } else { *values.select_nth_unstable_by(middle, f32::total_cmp).1 }
}
