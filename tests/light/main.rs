//! Light: probes, records, volume, bake, the paper's method, the path tracer and the audit, each against closed forms and
//! each other.
//!
//! One program for many files of tests: each that is linked costs seconds.

#[path = "../support/mod.rs"]
mod support;

mod audit;
mod bake;
mod core_numbers;
mod leaks;
mod orientation;
mod paper;
mod radiometry;
mod reference_closed_forms;
mod reference_room;
mod reference_simulate;
mod render_verb;
mod stage_plan;
mod study;
mod tracer;
