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
    /// Let decoding one picture or model take so much memory, such as 512M or 4G [default: 2G]
    #[arg(long, global = true, value_name = "BYTES", value_parser = bytes)]
    memory: Option<u64>,
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
    if let Some(bytes) = arguments.memory {
        clerestory::memory::set_limit(bytes);
    }
    let threads = arguments.threads.unwrap_or(0) as usize;
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build()?;
    pool.install(|| {
        match &arguments.verb {
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
        Ok(out.flush()?)
    })
}

/// Bytes from a number with or without K, M or G, which are powers of 1024.
fn bytes(text: &str) -> Result<u64, String> {
    let wrong = || "expected bytes, from 1M on, such as 512M or 4G".to_owned();
    let digits = text.trim_end_matches(|c: char| c.is_ascii_alphabetic());
    let unit = match text[digits.len()..].to_ascii_uppercase().as_str() {
        "" => 1.0,
        "K" | "KB" | "KIB" => 1024.0,
        "M" | "MB" | "MIB" => 1024f64.powi(2),
        "G" | "GB" | "GIB" => 1024f64.powi(3),
        _ => return Err(wrong()),
    };
    let bytes = digits.parse::<f64>().map_err(|_| wrong())? * unit;
    if (1024f64.powi(2)..1e18).contains(&bytes) { Ok(bytes as u64) } else { Err(wrong()) }
}

/// Whether whoever read the output has stopped reading.
pub(crate) fn is_broken_pipe(error: &anyhow::Error) -> bool {
    error.chain().filter_map(|e| e.downcast_ref::<io::Error>()).any(|e| e.kind() == io::ErrorKind::BrokenPipe)
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    /// clap ends the program where a parser gives another type than its field has, defaults included.
    #[test]
    fn each_verb_takes_its_numbers() {
        Arguments::command().debug_assert();
        let lines = [
            "audit s --json -q",
            "bake s --vertices 5000 --error 0.1 --json -q",
            "check s --json -q",
            "demo d --json -q",
            "gallery g --certify --time-limit 3 --json -q",
            "init m --json -q",
            "plan s --json -q",
            "register s --within 1 --tilt 2 --json -q",
            "render s --blend b --share 0.3 --radius 1 --json -q",
            "report s --json -q",
            "simulate s --json -q",
            "study s --budget 9 --share 0.5 --json -q",
            "summary s --json -q",
            "view s --json -q",
        ];
        let read = |line: &str| Arguments::try_parse_from(std::iter::once("clerestory").chain(line.split(' '))).is_ok();
        for line in lines {
            assert!(read(line), "{line}");
        }
        for line in
            ["bake s --vertices 9", "register s --tilt 50", "render s --blend b --share 2", "study s --budget 0"]
        {
            assert!(!read(line), "{line}");
        }
    }

    #[test]
    fn memory_is_read_with_its_unit() {
        assert_eq!(
            [bytes("512M"), bytes("1.5g"), bytes("4GiB"), bytes("2097152")].map(Result::unwrap),
            [512 << 20, 3 << 29, 4 << 30, 2 << 20]
        );
        for wrong in ["", "4T", "-1G", "nan", "1K", "1e30G", "M"] {
            assert!(bytes(wrong).is_err(), "{wrong}");
        }
    }
}
