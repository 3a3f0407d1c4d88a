//! Sheets and drawings of floors: where to put the tripod, how often each part is seen; galleries.

mod coverage_sheet;
mod dxf;
mod floor_map;
mod gallery_sheet;
mod plan_sheet;
mod write;

pub use gallery_sheet::gallery_sheet;
pub use write::write_plan;
