//! The command line: one file per verb; parses, calls the library and prints.

use clap::{Parser, Subcommand};
use std::io::{self, Write};

pub(crate) mod check;
pub(crate) mod demo;
pub(crate) mod gallery;
pub(crate) mod render;
pub(crate) mod simulate;
pub(crate) mod study;

/// Plan, relight and audit heritage interiors with image-based shooting.
#[derive(Parser)]
#[command(
    version,
    arg_required_else_help = true,
    after_help = "Start with:\n  clerestory demo chapel\n  clerestory check chapel\n  clerestory render chapel"
)]
pub(crate) struct Arguments {
    /// Work on so many threads; results do not depend on it [default: all cores]
    #[arg(long, global = true, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1024))]
    threads: Option<u32>,
    #[command(subcommand)]
    verb: Verb,
}

#[derive(Subcommand)]
enum Verb {
    Check(check::CheckArgs),
    Demo(demo::DemoArgs),
    Gallery(gallery::GalleryArgs),
    Render(Box<render::RenderArgs>),
    Simulate(simulate::SimulateArgs),
    Study(study::StudyArgs),
}

/// Runs the verb and writes its result to `out`.
pub(crate) fn run(arguments: &Arguments, out: &mut (impl Write + Send)) -> anyhow::Result<()> {
    let threads = arguments.threads.unwrap_or(0) as usize;
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build()?;
    pool.install(|| {
        match &arguments.verb {
            Verb::Check(args) => check::run(args, out)?,
            Verb::Demo(args) => demo::run(args, out)?,
            Verb::Gallery(args) => gallery::run(args, out)?,
            Verb::Render(args) => render::run(args, out)?,
            Verb::Simulate(args) => simulate::run(args, out)?,
            Verb::Study(args) => study::run(args, out)?,
        }
        Ok(out.flush()?)
    })
}

/// Whether whoever read the output has stopped reading.
pub(crate) fn is_broken_pipe(error: &anyhow::Error) -> bool {
    error.chain().filter_map(|e| e.downcast_ref::<io::Error>()).any(|e| e.kind() == io::ErrorKind::BrokenPipe)
}
