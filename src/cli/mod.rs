//! The command line: one file per verb; parses, calls the library and prints.

use clap::{Parser, Subcommand};
use std::io::{self, Write};

pub(crate) mod audit;
pub(crate) mod bake;
pub(crate) mod check;
pub(crate) mod demo;
pub(crate) mod gallery;
pub(crate) mod init;
pub(crate) mod plan;
pub(crate) mod register;
pub(crate) mod render;
pub(crate) mod report;
pub(crate) mod simulate;
pub(crate) mod study;
pub(crate) mod summary;
pub(crate) mod terminal;
pub(crate) mod view;

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
    Audit(audit::AuditArgs),
    Bake(bake::BakeArgs),
    Check(check::CheckArgs),
    Demo(demo::DemoArgs),
    Plan(plan::PlanArgs),
    Gallery(gallery::GalleryArgs),
    Init(init::InitArgs),
    Register(register::RegisterArgs),
    Render(Box<render::RenderArgs>),
    Report(report::ReportArgs),
    Simulate(simulate::SimulateArgs),
    Study(study::StudyArgs),
    Summary(summary::SummaryArgs),
    View(view::ViewArgs),
}

/// Runs the verb and writes its result to `out`.
pub(crate) fn run(arguments: &Arguments, out: &mut (impl Write + Send)) -> anyhow::Result<()> {
    let threads = arguments.threads.unwrap_or(0) as usize;
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build()?;
    pool.install(|| {
        verb(&arguments.verb, out)?;
        Ok(out.flush()?)
    })
}

fn verb(verb: &Verb, out: &mut (impl Write + Send)) -> anyhow::Result<()> {
    match verb {
        Verb::Audit(args) => audit::run(args, out)?,
        Verb::Bake(args) => bake::run(args, out)?,
        Verb::Check(args) => check::run(args, out)?,
        Verb::Demo(args) => demo::run(args, out)?,
        Verb::Gallery(args) => gallery::run(args, out)?,
        Verb::Init(args) => init::run(args, out)?,
        Verb::Plan(args) => plan::run(args, out)?,
        Verb::Register(args) => register::run(args, out)?,
        Verb::Render(args) => render::run(args, out)?,
        Verb::Report(args) => report::run(args, out)?,
        Verb::Simulate(args) => simulate::run(args, out)?,
        Verb::Study(args) => study::run(args, out)?,
        Verb::Summary(args) => summary::run(args, out)?,
        Verb::View(args) => view::run(args, out)?,
    }
    Ok(())
}

/// Runs another verb as if its command line had been typed (without the program's name), on the same threads; gives what
/// it prints.
pub(crate) fn run_line(line: &[String]) -> anyhow::Result<Vec<u8>> {
    let words = std::iter::once("clerestory").chain(line.iter().map(String::as_str));
    let arguments = Arguments::try_parse_from(words)?;
    let mut out = Vec::new();
    verb(&arguments.verb, &mut out)?;
    Ok(out)
}

/// Whether whoever read the output has stopped reading.
pub(crate) fn is_broken_pipe(error: &anyhow::Error) -> bool {
    error.chain().filter_map(|e| e.downcast_ref::<io::Error>()).any(|e| e.kind() == io::ErrorKind::BrokenPipe)
}
