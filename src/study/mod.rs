//! Error against run time, and the metrics that error is stated in.
//!
//! ```text
//! Site ─► truth (photographs, or a reference that knows its noise) ─┐
//!         sweep ─► measure: set-up, frames, errors by block ────────┴─► Study ─► summary: speed-ups, orders, front
//! ```
//!
//! ```
//! use clerestory::glam::Vec3;
//! use clerestory::study::{relmse, rmse};
//!
//! let truth = vec![Vec3::ONE; 64];
//! let render = vec![Vec3::splat(1.1); 64];
//! assert!((rmse(&render, &truth) - 0.1).abs() < 1e-6);
//! assert!((relmse(&render, &truth) - 0.01 / 1.01).abs() < 1e-6); // (x − t)² / (t² + 0.01 · mean²)
//! ```

mod clock;
mod conclusions;
mod curve;
mod error;
mod measure;
mod metrics;
mod options;
mod order;
mod outside;
mod run;
mod state;
mod sweep;
mod truth;

pub use clock::{Clock, Seconds, has_processor_time};
pub use conclusions::compare::{Comparison, Errors, compare, hidden};
pub use conclusions::result::{Convergence, EqualTime, Recommended, Row, SpeedUp, Summary, rounded};
pub use conclusions::summary::summary;
pub use curve::{Curve, How, order, pareto};
pub use error::StudyError;
pub use measure::{Run, ViewRun};
pub use metrics::blocks::{Block, Interval, Metric, Resamples};
pub use metrics::flip::{flip, flip_ldr, flip_map};
pub use metrics::{mean_where, median, median_relative_error, relmse, relmse_where, rmse, ssim};
pub use options::Options;
pub use order::{Ranked, order_said, plan_order};
pub use outside::{Outside, OutsidePoint, read as read_outside};
pub use run::{Progress, study};
pub use state::{Study, TruthNote};
pub use sweep::{Base, Method, Parameter, Setting};
