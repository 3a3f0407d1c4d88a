//! The command line program.

mod cli;

use clap::{Parser, Subcommand};
use std::io::{self, Write};
use std::process::ExitCode;

/// Plan, relight and audit heritage interiors with image-based shooting.
#[derive(Parser)]
#[command(version, arg_required_else_help = true)]
struct Arguments {
    #[command(subcommand)]
    verb: Verb,
}

#[derive(Subcommand)]
enum Verb {
    Check(cli::check::CheckArgs),
}

fn main() -> ExitCode {
    let Verb::Check(args) = Arguments::parse().verb;
    let mut out = io::BufWriter::new(io::stdout().lock());
    let result = cli::check::run(&args, &mut out).and_then(|()| Ok(out.flush()?));
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(cli::check::Error::Write(e)) if e.kind() == io::ErrorKind::BrokenPipe => ExitCode::SUCCESS,
        Err(e) => {
            // nobody is left to tell when stderr is gone too
            let _ = writeln!(io::stderr(), "error: {e}");
            ExitCode::from(1)
        }
    }
}
