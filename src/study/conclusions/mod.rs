//! What a study says: speed-ups, orders, the front, and which setting to take.

pub(crate) mod compare;
pub(crate) mod result;
pub(crate) mod summary;
pub(crate) mod verdict;
