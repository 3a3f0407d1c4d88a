//! clerestory plans where to put 360° HDR light probes inside a heritage interior, relights a model of that interior
//! from the probes, and audits the model against photographs.
//!
//! The core is Image-Based Shooting (Happa, Bashford-Rogers, Debattista and Chalmers, *Rendering Interior Cultural
//! Heritage Scenes Using Image-based Shooting*, VAST 2010). A stage is a plain function from typed input to typed
//! output; each stage is a module:
//!
//! [`site`] → [`scene`] + [`panorama`] → [`shoot`] → [`volume`] → [`render`], and [`mod@reference`] makes the truth that
//! [`study`] measures error against.
//!
//! Inside the program everything is right-handed, in metres, z up, with +y towards the model's own north, and local to
//! [`scene::Scene::origin`]. Colour is linear Rec. 709 RGB.

pub mod atomic_write;
pub mod audit;
pub mod bake;
pub mod check;
pub(crate) mod cholesky;
pub(crate) mod components;
pub mod csv;
pub(crate) mod edge_aware;
pub mod init;
pub(crate) mod lists;
pub mod panorama;
pub mod paper;
pub mod photograph;
pub mod plan;
pub mod radiometry;
pub mod reference;
pub mod register;
pub mod render;
pub mod report;
pub mod scene;
pub mod shoot;
pub mod site;
pub(crate) mod sphere;
pub(crate) mod statistics;
pub mod study;
pub mod transfer;
pub mod viewer;
pub mod volume;
