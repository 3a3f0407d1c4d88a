//! Where the model is wrong, from photographs.

mod error;
mod findings;
mod verdict;

pub use error::AuditError;
pub use findings::{
    Audit, AuditedView, Displacement, Evidence, Finding, Kind, Method, PoseCorrection, ProbeGain, Shares, ViewSummary,
    What,
};
pub use verdict::{Reason, Verdict};
