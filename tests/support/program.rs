//! The program as a user runs it, from the root of the checkout.

use serde_json::Value;
use std::ffi::OsStr;
use std::process::Command;

/// What a run came to.
#[derive(Debug)]
pub(crate) struct Done {
    pub(crate) code: Option<i32>,
    pub(crate) stdout: String,
    pub(crate) stderr: String,
}

/// The program, to be given its arguments.
pub(crate) fn program() -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_clerestory"));
    command.current_dir(env!("CARGO_MANIFEST_DIR"));
    command
}

/// Runs the program with these arguments, and more.
pub(crate) fn clerestory(arguments: &[&dyn AsRef<OsStr>], more: &[&str]) -> Done {
    Done::of(program().args(arguments).args(more))
}

impl Done {
    pub(crate) fn of(command: &mut Command) -> Self {
        let output = command.output().unwrap();
        let text = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap();
        Self { code: output.status.code(), stdout: text(output.stdout), stderr: text(output.stderr) }
    }

    /// What it printed; it must have gone well.
    #[track_caller]
    pub(crate) fn text(self) -> String {
        assert_eq!(self.code, Some(0), "{}", self.stderr);
        self.stdout
    }

    #[track_caller]
    pub(crate) fn json(self) -> Value {
        serde_json::from_str(&self.text()).unwrap()
    }

    /// Why it did not go; it must have failed.
    #[track_caller]
    pub(crate) fn error(self) -> String {
        assert_ne!(self.code, Some(0), "{}", self.stdout);
        self.stderr
    }

    /// The same, in one line and with the exit code of a mistake in what was given.
    #[track_caller]
    pub(crate) fn error_line(self) -> String {
        assert!(self.code == Some(1) && self.stderr.lines().count() == 1, "{self:?}");
        self.stderr
    }
}
