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
    Simulate(cli::simulate::SimulateArgs),
}

fn main() -> ExitCode {
    let mut out = io::BufWriter::new(io::stdout().lock());
    let result = match Arguments::parse().verb {
        Verb::Check(args) => cli::check::run(&args, &mut out).map_err(Error::Check),
        Verb::Simulate(args) => cli::simulate::run(&args, &mut out).map_err(Error::Simulate),
    };
    match result.and_then(|()| Ok(out.flush()?)) {
        Ok(()) => ExitCode::SUCCESS,
        Err(e) if e.is_broken_pipe() => ExitCode::SUCCESS,
        Err(e) => {
            // nobody is left to tell when stderr is gone too
            let _ = writeln!(io::stderr(), "error: {e}");
            ExitCode::from(1)
        }
    }
}

/// Why a verb did not come to an end.
#[derive(Debug, thiserror::Error)]
enum Error {
    #[error(transparent)]
    Check(cli::check::Error),
    #[error(transparent)]
    Simulate(cli::simulate::Error),
    #[error("cannot write the result: {0}")]
    Write(#[from] io::Error),
}

impl Error {
    /// Whether whoever read the output has stopped reading.
    fn is_broken_pipe(&self) -> bool {
        let (Self::Check(cli::check::Error::Write(e))
        | Self::Simulate(cli::simulate::Error::Write(e))
        | Self::Write(e)) = self
        else {
            return false;
        };
        e.kind() == io::ErrorKind::BrokenPipe
    }
}
