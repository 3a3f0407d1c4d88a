//! Progress of long work: on a terminal only, on stderr.

use indicatif::{ProgressBar, ProgressStyle};
use std::io::{self, IsTerminal};
use std::time::Duration;

use super::visible::visible;

/// A bar of steps, each with its name.
pub(crate) const STEPS: &str = "{msg:16} {wide_bar} {pos} of {len}  {eta} left";

/// Moves a bar to so many steps done of all, and says what is being done.
pub(crate) fn step(bar: &ProgressBar) -> impl Fn(&str, usize, usize) {
    move |doing, done, all| {
        bar.set_length(all as u64);
        bar.set_position(done as u64);
        bar.set_message(visible(doing).into_owned());
    }
}

/// A bar drawn after indicatif's `template`; hidden where it is not `wanted` or stderr is no terminal.
pub(crate) fn bar(wanted: bool, template: &str) -> ProgressBar {
    if !wanted || !io::stderr().is_terminal() {
        return ProgressBar::hidden();
    }
    let style = ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar());
    let bar = ProgressBar::new(1).with_style(style);
    bar.enable_steady_tick(Duration::from_millis(200));
    bar
}
