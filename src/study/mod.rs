//! Error against run time, and the metrics that error is stated in.

mod compare;
mod flip;
mod metrics;

pub use compare::{Comparison, Errors, compare};
pub use flip::{flip, flip_ldr, flip_map};
pub use metrics::{exposure, mean_where, median_relative_error, relmse, relmse_where, rmse, ssim};
