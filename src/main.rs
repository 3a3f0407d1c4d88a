//! The command line program.

mod cli;

use clap::Parser;
use cli::terminal::visible::{Visible, visible};
use std::io::{self, Write};
use std::process::ExitCode;

fn main() -> ExitCode {
    // without a handler Ctrl-C still stops the program, but a half-written file may stay
    let _ = ctrlc::set_handler(|| {
        clerestory::atomic_write::remove_unfinished();
        std::process::exit(130); // 128 + SIGINT, as shells expect
    });
    let mut out = Visible(io::BufWriter::new(io::stdout()));
    let done = cli::terminal::command::readable(std::env::args_os())
        .and_then(|()| cli::run(&cli::Arguments::parse(), &mut out));
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(e) if cli::is_broken_pipe(&e) => ExitCode::SUCCESS,
        Err(e) => {
            // nobody is left to tell when stderr is gone too
            let _ = writeln!(io::stderr(), "error: {}", visible(&cli::terminal::command::in_words(&e)));
            ExitCode::from(1)
        }
    }
}
