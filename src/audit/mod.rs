//! Where the model is wrong, from photographs.
//!
//! Light divided by albedo and multiplied by it again would make a wrong texture cancel out, so there are two tests that
//! share nothing but the model's shape: `likelihood::photo_consistency` compares the photograph with what each probe saw of the
//! same surface, without albedo; `likelihood::appearance` compares it with albedo under irradiance gathered from all around.
//!
//! The folders stand in the order in which they are used: each imports only from those before it.

mod error;
mod verdict;

mod finding;
mod picture;

mod observe;

mod likelihood;

mod view;

mod hypothesis;

mod decide;

mod export;
mod run;

pub use decide::judged::Judged;
pub use error::AuditError;
pub use finding::{
    Audit, AuditedView, Displacement, Evidence, Finding, Kind, Method, PoseCorrection, ProbeGain, Shares, Shift,
    ViewSummary, What,
};
pub use observe::photo::Photo;
pub use run::{Progress, audit};
pub use verdict::{Reason, Verdict};
pub use view::{AuditScene, Observations, Settings, examine};
