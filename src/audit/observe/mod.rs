//! What is observed: the photograph, what the model shows in its pixels, and what the probes saw there.

pub(crate) mod geometry_buffer;
pub(crate) mod gloss;
pub(crate) mod photo;
pub(crate) mod pose;
pub(crate) mod probe_view;
pub(crate) mod radiometry;
pub(crate) mod resample;
pub(crate) mod uv_islands;
