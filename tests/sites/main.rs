//! Sites: their files right and wrong, what is planned, registered, drawn and reported of them, and the sources themselves.
//!
//! One program for many files of tests: each that is linked costs seconds.

#[path = "../../examples/build_chapel/chapel/mod.rs"]
#[allow(dead_code, missing_docs, unreachable_pub)]
mod chapel;
#[path = "../../examples/common/mod.rs"]
#[allow(dead_code, missing_docs, unreachable_pub)]
mod common;
#[path = "../../examples/interiors/interior/mod.rs"]
#[allow(dead_code, missing_docs, unreachable_pub)]
mod interior;
#[path = "../support/mod.rs"]
mod support;

mod check;
mod demo;
mod gallery;
mod interiors;
mod layout;
mod never_nan;
mod photographs;
mod plan;
mod register;
mod report;
mod viewer;
mod whole_files;
mod wrong_inputs;
