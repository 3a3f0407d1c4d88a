//! The fewest candidates that cover what must be covered: set cover, with proof of how good the answer is.
//!
//! [`greedy`] is fast: lazy greedy, redundant candidates dropped, two replaced by one and three by two
//! (`local_search`). [`exact`] reduces, splits into parts and branches, and stopped early still gives a valid lower
//! bound.

mod bound;
pub mod coverage;
pub mod exact;
pub mod greedy;
mod local_search;
pub(crate) mod overlap;
pub(crate) mod partial_bound;
pub mod reduce;
#[cfg(test)]
mod tests;
