//! Light: probes, records, volume, bake, the paper's method and the path tracer, each against closed forms and each other.
//!
//! One program for many files of tests: each that is linked costs seconds.

#[path = "../support/mod.rs"]
mod support;

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
mod same_bytes;
mod stage_plan;
mod study;
mod tracer;
