//! Which regions are faults, how sure that is, and one finding for what several views show.

pub(crate) mod assess;
pub(crate) mod assessed;
pub(crate) mod background;
pub(crate) mod decision;
pub(crate) mod false_alarms;
pub(crate) mod judge;
pub(crate) mod judged;
pub(crate) mod label;
pub(crate) mod lines_of_sight;
pub(crate) mod merge;
pub(crate) mod odds;
pub(crate) mod scores;
