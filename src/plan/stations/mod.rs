//! Stations for a whole site: [`run`] finds its floors, makes each a covering `problem` of candidates and witnesses, selects among the candidates, and puts a plan
//! together ([`result`]) with a tour and [`check_distances`].

mod assemble;
pub mod check_distances;
mod problem;
pub mod result;
pub mod run;
mod selection;
mod tour;
